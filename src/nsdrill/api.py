"""The functions of ``nsdrill`` for Python: studies, files and quantities in any form
in, xarray Datasets out.

Wherever a *study* is taken, it is a :class:`Study`, the name of a YAML file, YAML text,
or a mapping. Wherever *results* are taken, they are a Dataset or the name of a file.
Wherever a *quantity* is taken, it is a number in SI units or a text with its unit,
``"60 rpm"``. Errors are :class:`InputError` and the others of :mod:`nsdrill.errors`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from nsdrill.data import NOT_CARRIED_WORDS
from nsdrill.errors import ENDINGS, RunWarning, count, warn
from nsdrill.late import deferred
from nsdrill.operations import fit as fits
from nsdrill.operations import pictures, questions, result_files, runs
from nsdrill.operations.argument import public

with deferred():
    from nsdrill import store, variables
    from nsdrill.analysis import doubts
    from nsdrill.app.check import unread_numbers
    from nsdrill.app.running import run as running
    from nsdrill.models.registry import model_in

if TYPE_CHECKING:
    from xarray import Dataset

    from nsdrill.app.check import Report as Report
    from nsdrill.app.fitting.ensemble_fit import Fit as Fit
    from nsdrill.app.following.continuing import ContinuationResult
    from nsdrill.app.picture_making import Film
    from nsdrill.app.running.run import RunResult
    from nsdrill.app.simulating.trajectory import Trajectory
    from nsdrill.data import Results
    from nsdrill.progress import Progress as Progress
    from nsdrill.study import Study as Study
    from nsdrill.web.explorer import View as View


def _of_run(found: RunResult | Results) -> Dataset:
    """The results of a run; RunWarning where points failed, of what makes numbers wrong or
    not those of their setting, as a command tells it, and of numbers that nothing reads."""
    data = store.open_results(found.path) if isinstance(found, running.RunResult) else store.to_dataset(found)
    if failed := int(variables.has_failed(data["status"].values).sum()):
        of = count(data["status"].size, "point")
        text = f"{failed} of {of} failed; status says which and how, and nsdrill.show lists them."
        warn(text, RunWarning)
    for note in found.notes if isinstance(found, running.RunResult) else doubts.notes_of_run(found):
        warn(note, RunWarning)
    if unread := unread_numbers(model_in(data.attrs)):
        warn(unread, RunWarning)
    for note in doubts.notes_before(data.attrs):
        warn(note, RunWarning)
    return data


def _of_continuation(found: ContinuationResult) -> Dataset:
    return found.data


def _trace(found: Trajectory) -> Dataset:
    """The trace of a run; RunWarning where it ended early."""
    if found.status != variables.OK:
        status = str(found.trace.attrs["status"])
        advice = f"; {found.advice}" if found.advice else ""
        text = f"The run ended early ({status}): {ENDINGS.get(status, status)}{advice}."
        warn(f"{text} The trace holds what was computed before.", RunWarning)
    return store.to_dataset(found.trace)


def _replayed(found: Trajectory) -> Dataset:
    """The trace of a replay; RunWarning where it does not end in the stored state, and where
    nothing was carried to its run."""
    if found.after_failure:
        warn(NOT_CARRIED_WORDS, RunWarning)
    if not found.same_bits:
        warn(f"The run {found.warning}", RunWarning)
    return _trace(found).assign_attrs(same_bits=int(bool(found.same_bits)))


def _labelled(found: runs.Labelled) -> Dataset:
    results = found.results
    return store.open_results(results) if isinstance(results, str) else store.to_dataset(results)


def _in_words(found: questions.Shown) -> str:
    return "\n".join(found.lines())


def _name_of(found: Film) -> str:
    return found.name


def _combined(found: tuple[Results, str]) -> Dataset:
    return store.to_dataset(found[0])


load_study = public(runs.load_study)
run = public(runs.run, _of_run)
continue_branches = public(runs.continue_branches, _of_continuation)
simulate = public(runs.simulate, _trace)
replay = public(runs.replay, _replayed)
lyapunov_spectrum = public(runs.lyapunov_spectrum)
classify = public(runs.classify, _labelled)
fit = public(fits.fit)
check = public(questions.check)
show = public(questions.show, _in_words)
window = public(questions.window)
report = public(questions.report)
probability = public(questions.probability)
sensitivity = public(questions.sensitivity)
hysteresis = public(questions.hysteresis)
attractors = public(questions.attractors)
diff = public(questions.diff)
plot = public(pictures.plot)
animate = public(pictures.animate, _name_of)
chart = public(pictures.chart)
view = public(pictures.view)
cite = public(result_files.cite)
combine = public(result_files.combine, _combined)
open_results = public(result_files.open_results)
save = public(result_files.save)
