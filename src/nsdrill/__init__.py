"""nsdrill: a bifurcation explorer for coupled axial, torsional and lateral drill-string vibration.

>>> import nsdrill
>>> study = nsdrill.load_study("study.yaml")
>>> results = nsdrill.run(study, "out.h5")
>>> data = nsdrill.open_results("out.h5")
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from nsdrill.app.attractors import attractors
    from nsdrill.app.check import check
    from nsdrill.app.diff import diff
    from nsdrill.app.hysteresis import hysteresis
    from nsdrill.app.run import run
    from nsdrill.app.trajectory import replay, simulate
    from nsdrill.app.window import window
    from nsdrill.errors import FileError, InputError, NsdrillError, StudyError
    from nsdrill.store import open_results, read_trace
    from nsdrill.study import Study, load_study, parse_study

__version__ = "0.1.0"

_HOME = {
    "FileError": "errors",
    "InputError": "errors",
    "NsdrillError": "errors",
    "Study": "study",
    "StudyError": "errors",
    "attractors": "app.attractors",
    "check": "app.check",
    "diff": "app.diff",
    "hysteresis": "app.hysteresis",
    "load_study": "study",
    "open_results": "store",
    "parse_study": "study",
    "read_trace": "store",
    "replay": "app.trajectory",
    "run": "app.run",
    "simulate": "app.trajectory",
    "window": "app.window",
}

__all__ = [
    "FileError",
    "InputError",
    "NsdrillError",
    "Study",
    "StudyError",
    "attractors",
    "check",
    "diff",
    "hysteresis",
    "load_study",
    "open_results",
    "parse_study",
    "read_trace",
    "replay",
    "run",
    "simulate",
    "window",
]


# Names arrive when they are first used: numba alone takes half a second, and `nsdrill --help` needs none of it.
def __getattr__(name: str) -> Any:
    if name in _HOME:
        return getattr(import_module(f"nsdrill.{_HOME[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted([*globals(), *_HOME])
