"""nsdrill: a bifurcation explorer for coupled axial, torsional and lateral drill-string
vibration.

>>> import nsdrill
>>> study = nsdrill.load_study("study.yaml")
>>> results = nsdrill.run(study, "out.h5")
>>> nsdrill.plot(results)
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from nsdrill.api import (
        Progress,
        Study,
        animate,
        attractors,
        chart,
        check,
        classify,
        combine,
        continue_branches,
        diff,
        fit,
        hysteresis,
        load_study,
        open_results,
        plot,
        probability,
        replay,
        run,
        save,
        sensitivity,
        show,
        simulate,
        view,
        window,
    )
    from nsdrill.errors import FileError, InputError, NsdrillError, RunWarning, StudyError

__version__ = "0.1.0"

__all__ = [
    "FileError",
    "InputError",
    "NsdrillError",
    "Progress",
    "RunWarning",
    "Study",
    "StudyError",
    "animate",
    "attractors",
    "chart",
    "check",
    "classify",
    "combine",
    "continue_branches",
    "diff",
    "fit",
    "hysteresis",
    "load_study",
    "open_results",
    "plot",
    "probability",
    "replay",
    "run",
    "save",
    "sensitivity",
    "show",
    "simulate",
    "view",
    "window",
]

_HOME = {
    "FileError": "errors",
    "InputError": "errors",
    "NsdrillError": "errors",
    "Progress": "progress",
    "RunWarning": "errors",
    "Study": "study",
    "StudyError": "errors",
}


# Names arrive when they are first used: numpy alone takes a tenth of a second, and
# `nsdrill --help` needs none of it.
def __getattr__(name: str) -> Any:
    # the room that has the name of the function plot can be called like it
    if name in ("api", "plot"):
        return import_module(f"nsdrill.{name}")
    if name in __all__:
        return getattr(import_module(f"nsdrill.{_HOME.get(name, 'api')}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
