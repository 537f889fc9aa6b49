"""The files: run log, results, trace, branches, exports. Each has one writer at a time,
and a file appears under its name only when it is complete.

The modules are imported lazily, so that the size of a record can be computed without
importing h5py.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from nsdrill.late import late

if TYPE_CHECKING:
    from nsdrill.store.branch_file import branches_of, open_branches, write_branches
    from nsdrill.store.claims import check_target, claim, claim_file, claim_work
    from nsdrill.store.dataset import from_dataset, open_results, to_dataset
    from nsdrill.store.hdf5 import to_netcdf
    from nsdrill.store.log import RunLog, part_path, rewrite_log
    from nsdrill.store.points import (
        MemoryLog,
        Sink,
        Source,
        columns,
        contents_in,
        pending_records,
        points_in_block,
        record_dtype,
    )
    from nsdrill.store.results import (
        collect,
        is_log,
        kind_of,
        log_from_results,
        read_attributes,
        read_partial,
        read_point,
        read_results,
        read_trace,
        rewrite_labels,
        variables_in,
        write_results,
        write_trace,
    )

__all__ = [
    "MemoryLog",
    "RunLog",
    "Sink",
    "Source",
    "branches_of",
    "check_target",
    "claim",
    "claim_file",
    "claim_work",
    "collect",
    "columns",
    "contents_in",
    "from_dataset",
    "is_log",
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
    "rewrite_labels",
    "rewrite_log",
    "to_dataset",
    "to_netcdf",
    "variables_in",
    "write_branches",
    "write_results",
    "write_trace",
]

__getattr__ = late(
    __name__,
    {
        "MemoryLog": "nsdrill.store.points",
        "RunLog": "nsdrill.store.log",
        "Sink": "nsdrill.store.points",
        "Source": "nsdrill.store.points",
        "check_target": "nsdrill.store.claims",
        "claim": "nsdrill.store.claims",
        "claim_file": "nsdrill.store.claims",
        "claim_work": "nsdrill.store.claims",
        "collect": "nsdrill.store.results",
        "columns": "nsdrill.store.points",
        "from_dataset": "nsdrill.store.dataset",
        "contents_in": "nsdrill.store.points",
        "is_log": "nsdrill.store.results",
        "kind_of": "nsdrill.store.results",
        "log_from_results": "nsdrill.store.results",
        "branches_of": "nsdrill.store.branch_file",
        "open_branches": "nsdrill.store.branch_file",
        "open_results": "nsdrill.store.dataset",
        "part_path": "nsdrill.store.log",
        "pending_records": "nsdrill.store.points",
        "points_in_block": "nsdrill.store.points",
        "read_attributes": "nsdrill.store.results",
        "read_partial": "nsdrill.store.results",
        "read_point": "nsdrill.store.results",
        "read_results": "nsdrill.store.results",
        "read_trace": "nsdrill.store.results",
        "record_dtype": "nsdrill.store.points",
        "rewrite_labels": "nsdrill.store.results",
        "rewrite_log": "nsdrill.store.log",
        "to_dataset": "nsdrill.store.dataset",
        "to_netcdf": "nsdrill.store.hdf5",
        "variables_in": "nsdrill.store.results",
        "write_branches": "nsdrill.store.branch_file",
        "write_results": "nsdrill.store.results",
        "write_trace": "nsdrill.store.results",
    },
)
