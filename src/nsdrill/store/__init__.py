"""The files: run log, results, trace, branches, exports. Each has one writer at a time,
and a file appears under its name only when it is complete.

The modules are imported lazily, so that the size of a record can be computed without
importing h5py.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from nsdrill.late import late

if TYPE_CHECKING:
    from nsdrill.files import write_text
    from nsdrill.store.claims import check_target, claim, claim_file
    from nsdrill.store.dataset import from_dataset, open_results, to_dataset
    from nsdrill.store.hdf5 import to_netcdf
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
    from nsdrill.store.results import columns, open_branches, points_in_block, write_branches, write_results
    from nsdrill.store.rewrite import rewrite_log
    from nsdrill.store.sink import Sink, Source
    from nsdrill.store.trace import read_trace, write_trace

__all__ = [
    "MemoryLog",
    "RunLog",
    "Sink",
    "Source",
    "check_target",
    "claim",
    "claim_file",
    "collect",
    "columns",
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
    "rewrite_labels",
    "rewrite_log",
    "to_dataset",
    "to_netcdf",
    "variables_in",
    "write_branches",
    "write_results",
    "write_text",
    "write_trace",
]

__getattr__ = late(
    __name__,
    {
        "MemoryLog": "nsdrill.store.memory",
        "RunLog": "nsdrill.store.log",
        "Sink": "nsdrill.store.sink",
        "Source": "nsdrill.store.sink",
        "check_target": "nsdrill.store.claims",
        "claim": "nsdrill.store.claims",
        "claim_file": "nsdrill.store.claims",
        "collect": "nsdrill.store.read",
        "columns": "nsdrill.store.results",
        "from_dataset": "nsdrill.store.dataset",
        "kept_of": "nsdrill.store.read",
        "kind_of": "nsdrill.store.read",
        "log_from_results": "nsdrill.store.read",
        "open_branches": "nsdrill.store.results",
        "open_results": "nsdrill.store.dataset",
        "part_path": "nsdrill.store.log",
        "pending_records": "nsdrill.store.records",
        "points_in_block": "nsdrill.store.results",
        "read_attributes": "nsdrill.store.read",
        "read_partial": "nsdrill.store.read",
        "read_point": "nsdrill.store.read",
        "read_results": "nsdrill.store.read",
        "read_trace": "nsdrill.store.trace",
        "record_dtype": "nsdrill.store.records",
        "recorded": "nsdrill.store.records",
        "rewrite_log": "nsdrill.store.rewrite",
        "rewrite_labels": "nsdrill.store.read",
        "to_dataset": "nsdrill.store.dataset",
        "to_netcdf": "nsdrill.store.hdf5",
        "variables_in": "nsdrill.store.read",
        "write_branches": "nsdrill.store.results",
        "write_results": "nsdrill.store.results",
        "write_text": "nsdrill.files",
        "write_trace": "nsdrill.store.trace",
    },
)
