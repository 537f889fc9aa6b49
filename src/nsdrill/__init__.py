"""nsdrill: a bifurcation explorer for coupled axial, torsional and lateral drill-string
vibration.

Examples
--------
>>> import nsdrill
>>> study = nsdrill.load_study("study.yaml")
>>> results = nsdrill.run(study, progress=False)
>>> results.nsdrill.bouncing.dims
('procedure', 'rotary_speed')
>>> figure = nsdrill.plot(results)
"""

from __future__ import annotations

import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any

from nsdrill.version import __version__ as __version__

if TYPE_CHECKING:
    from nsdrill.api import (
        Fit,
        Progress,
        Report,
        Study,
        View,
        animate,
        attractors,
        chart,
        check,
        cite,
        classify,
        combine,
        continue_branches,
        diff,
        fit,
        hysteresis,
        load_study,
        lyapunov_spectrum,
        open_results,
        plot,
        probability,
        replay,
        report,
        run,
        save,
        sensitivity,
        show,
        simulate,
        view,
        window,
    )
    from nsdrill.errors import FileError, FileWarning, InputError, NsdrillError, RunWarning, StudyError
    from nsdrill.script.declared_drive import drive
    from nsdrill.script.declared_model import model
    from nsdrill.script.declared_picture import picture
    from nsdrill.script.physics import friction, law, touching
    from nsdrill.script.quantities import feature
    from nsdrill.script.signature import number
    from nsdrill.script.tableaus import pair

__all__ = [
    "FileError",
    "FileWarning",
    "Fit",
    "InputError",
    "NsdrillError",
    "Progress",
    "Report",
    "RunWarning",
    "Study",
    "StudyError",
    "View",
    "animate",
    "attractors",
    "chart",
    "check",
    "cite",
    "classify",
    "combine",
    "continue_branches",
    "diff",
    "drive",
    "feature",
    "fit",
    "friction",
    "hysteresis",
    "law",
    "load_study",
    "lyapunov_spectrum",
    "model",
    "number",
    "open_results",
    "pair",
    "picture",
    "plot",
    "probability",
    "replay",
    "report",
    "run",
    "save",
    "sensitivity",
    "show",
    "simulate",
    "touching",
    "view",
    "window",
]

_HOME = {
    "FileError": "errors",
    "FileWarning": "errors",
    "Fit": "app.fitting.ensemble_fit",
    "InputError": "errors",
    "NsdrillError": "errors",
    "Progress": "progress",
    "Report": "app.check",
    "RunWarning": "errors",
    "Study": "study",
    "StudyError": "errors",
    "View": "web.explorer",
    "drive": "script.declared_drive",
    "feature": "script.quantities",
    "friction": "script.physics",
    "law": "script.physics",
    "model": "script.declared_model",
    "number": "script.signature",
    "pair": "script.tableaus",
    "picture": "script.declared_picture",
    "touching": "script.physics",
}


# Names arrive when they are first used: numpy alone takes a tenth of a second, and
# `nsdrill --help` needs none of it.
def __getattr__(name: str) -> Any:
    if name == "api":
        return import_module("nsdrill.api")
    if name in __all__:
        found = globals()[name] = getattr(import_module(f"nsdrill.{_HOME.get(name, 'api')}"), name)
        return found
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)


if "xarray" in sys.modules:
    import_module("nsdrill.accessor")  # data.nsdrill
