"""The files: run log, results, trace, exports. One writer, and nothing under the asked name that is not whole."""

from nsdrill.files import write_text
from nsdrill.store.branches import open_branches, write_branches
from nsdrill.store.claim import check_target, claim, claim_file
from nsdrill.store.dataset import from_dataset, open_results, to_dataset
from nsdrill.store.export import flag_words, to_csv, to_netcdf
from nsdrill.store.held import HeldResults
from nsdrill.store.log import RunLog, part_path
from nsdrill.store.memory import MemoryLog
from nsdrill.store.read import (
    collect,
    kept_of,
    kind_of,
    log_from_results,
    read_attributes,
    read_partial,
    read_point,
    read_results,
    rewrite_labels,
    variables_in,
)
from nsdrill.store.records import pending_records, record_dtype, recorded
from nsdrill.store.renew import renew
from nsdrill.store.results import columns, points_in_block, write_results
from nsdrill.store.sink import Sink, Source
from nsdrill.store.trace import read_trace, write_trace

__all__ = [
    "HeldResults",
    "MemoryLog",
    "RunLog",
    "Sink",
    "Source",
    "check_target",
    "claim",
    "claim_file",
    "collect",
    "columns",
    "flag_words",
    "from_dataset",
    "kept_of",
    "kind_of",
    "log_from_results",
    "open_branches",
    "open_results",
    "part_path",
    "pending_records",
    "points_in_block",
    "read_attributes",
    "read_partial",
    "read_point",
    "read_results",
    "read_trace",
    "record_dtype",
    "recorded",
    "renew",
    "rewrite_labels",
    "to_csv",
    "to_dataset",
    "to_netcdf",
    "variables_in",
    "write_branches",
    "write_results",
    "write_text",
    "write_trace",
]
