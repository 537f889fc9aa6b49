"""Checks for the author of a model, a drive or a law, to call in a test: all that is derived from
equations is compared with what was derived in another way, with all numbers off their
defaults."""

from __future__ import annotations

from nsdrill.script.declared_model import Declared
from nsdrill.testing.bench import Bench, bench_of
from nsdrill.testing.check_report import Report
from nsdrill.testing.computed import COMPUTED
from nsdrill.testing.drive_bench import compare_drive
from nsdrill.testing.laws import compare_law
from nsdrill.testing.observed_motion import OBSERVED

__all__ = ["Report", "check_drive", "check_law", "check_model"]


def check_model(model: Declared | str, study: str = "", *, seed: int = 1, states: int = 64) -> Report:
    """Check a model of :func:`nsdrill.model`, or that of this name. Python and machine code
    are compared with the graph of the equations, the tangent with differences, the rate of
    each channel with its change along the motion, features with a dense trace, and explicit
    with implicit friction; numbers that nothing reads are found, and conditions at which
    slopes jump. ``study`` is more YAML of the study that is run, such as a short
    ``simulation``; ``states`` is how many states are looked at.

    AssertionError, with the report, where something differs."""
    bench = bench_of(Bench, model, study, seed, states)
    report = Report(f"the model {bench.name}")
    for check in (*COMPUTED, *OBSERVED):
        check(bench, report)
    return report.passed()


def check_law(name: str) -> Report:
    """Check the law of friction of this name: its slope and its fall against differences,
    its steepest fall against a search, and whether it is odd in the slip.

    AssertionError, with the report, where something differs."""
    report = Report(f"the law {name}")
    compare_law(name, report)
    return report.passed()


def check_drive(name: str, study: str = "", *, model: str = "torsion", seed: int = 1, states: int = 64) -> Report:
    """Check the drive of this kind, of :func:`nsdrill.drive` or of nsdrill, in a ``model`` with
    a drive. Its torque is compared with its function called with numbers, or with the law
    of the gains that ``check`` tells; gains, small deviations and steady drilling with
    differences; explicit with implicit friction, of a bit that turns and of one at rest.
    Found besides are a drive that makes the string swing by itself, or pushes backwards at
    rest; numbers that nothing reads; and states whose natural scale is too great.
    ``study`` is more YAML of the study.

    AssertionError, with the report, where something differs."""
    report = Report(f"the drive {name} in the model {model}")
    compare_drive(name, model, study, seed, states, report)
    return report.passed()
