"""The motions from which a continuation sets out: settled at some values of the continued
number, or the points of a results file."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from nsdrill import interrupt
from nsdrill.analysis.comparison import string_differences
from nsdrill.app.continuation_setup import ContinuationSetup, number_of
from nsdrill.app.following import Following, Say
from nsdrill.data import Array, Results, resolved_study
from nsdrill.errors import FileError, option
from nsdrill.models.leaves import OPERATION, word_or_number
from nsdrill.orbit.flow import Flow, Legs
from nsdrill.orbit.seeds import Seed
from nsdrill.store import read_results
from nsdrill.study.write import changes_text
from nsdrill.variables import OK, dimension_of

PIECE = 20.0  # of the time in which seeds settle, between two looks at the clock [s]


def seeds_of(setup: ContinuationSetup, flow: Flow, path: str | os.PathLike[str] | None, say: Say) -> list[Seed]:
    """The seeds of a continuation, from the results file ``path`` if given."""
    source = setup.continuation.seeds if path is None else path
    if isinstance(source, str | os.PathLike):
        return _seeds_in(setup, Path(source))
    return _settled(setup, flow, np.array(source[setup.continuation.along], dtype=float), say)


def _settled(setup: ContinuationSetup, flow: Flow, numbers: Array, say: Say) -> list[Seed]:
    """The motions on which the starts of the study settle at ``numbers`` [n] (SI) of
    the continued number, preceded by one start of each as a seed of a steady motion."""
    study, model = setup.study, setup.model
    starts = max(1, study.initial.starts)
    at = np.repeat(numbers, starts)[:, None]
    values = setup.values(at, (setup.continuation.along,))
    state = model.starts(values, np.tile(np.arange(starts), len(numbers)))
    states, phase = state[:, :-1], state[:, -1]
    duration = study.simulation.transient + study.simulation.observe
    first = [Seed(*one, steady=True) for one in zip(states[::starts], phase[::starts], at[::starts], strict=True)]
    say(f"{len(at)} motions settle for {duration:g} s")
    ok = np.ones(len(at), dtype=bool)
    pieces, following = max(1, int(np.ceil(duration / PIECE))), Following(say)
    for piece in range(pieces):
        interrupt.check()
        following.settled(piece * duration / pieces, duration)
        ends = flow.run(Legs(states, phase, duration / pieces, at))
        ok &= ends.ok
        states = np.where(ok[:, None], ends.state, states)
        phase = phase + flow.phase_rate(at) * (duration / pieces)
    return [*first, *(Seed(*one, near=True) for one in zip(states[ok], phase[ok], at[ok], strict=True))]


def _seeds_in(setup: ContinuationSetup, path: Path) -> list[Seed]:
    """The settled points of a results file with the same string and, except for the
    continued number, the same operating point as the study, from all of its starts."""
    results, along = read_results(path, ("status", "settled", "final_state")), dimension_of(setup.continuation.along)
    _check_string(setup, results, path)
    if along not in results.axes and along in OPERATION:
        raise FileError(f"{path}: found no {along}. Choose results of a sweep as seeds.")
    good = (results["status"] == OK) & (results["settled"] == 1)
    from_other_starts = {one.name for one in results.more if one.key.startswith("initial.")}
    for place, name in enumerate(results.grid):
        if name not in ("procedure", "start", "sample", along) and name not in from_other_starts:
            near = _place_of(setup, results, name, path)
            good &= np.indices(results.shape, sparse=True)[place] == near
    if along in results.grid:
        numbers = results.coords[along][np.nonzero(good)[results.grid.index(along)]]
    else:
        numbers = np.full(np.count_nonzero(good), number_of(setup.study, along))
    seeds = [
        Seed(state[:-1], float(state[-1]), np.array([number]))
        for state, number in zip(results["final_state"][good], numbers, strict=True)
        if setup.continuation.low <= number <= setup.continuation.high
    ]
    if not seeds:
        raise FileError(
            f"{path}: found no settled point between the ends of continue.from and continue.to; allowed: results "
            "with some. Run the sweep for longer (simulation.transient), or widen the range."
        )
    return seeds


def _check_string(setup: ContinuationSetup, results: Results, path: Path) -> None:
    """FileError where ``results`` are of another string than the study."""
    study = setup.study
    if str(results.attrs.get("model", study.model.name)) != study.model.name:
        raise FileError(
            f"{path}: made with the model {results.attrs['model']}, the study has {study.model.name}. Choose results "
            "of the same model as seeds."
        )
    source = resolved_study(results.attrs)
    free = {setup.continuation.along, *source.get("sweep", {})}
    keys = [key for key, _, _ in string_differences(source, study.resolved, free)]
    if source.get("uncertain") != study.resolved.get("uncertain"):
        keys.append("uncertain")
    if keys:
        changes = changes_text(source, study.resolved, keys)
        raise FileError(f"{path}: made with another string ({changes}). Choose results of the same string as seeds.")


def _place_of(setup: ContinuationSetup, results: Results, name: str, path: Path) -> int:
    """The place along the axis ``name`` of ``results`` of the value of the study; FileError
    where it is not there."""
    wanted, values = number_of(setup.study, name), results.coords[name]
    near = int(np.argmin(np.abs(values - wanted)))
    if abs(values[near] - wanted) > 1e-6 * max(abs(wanted), 1e-300):
        low, high, own = (word_or_number(name, one) for one in (values[0], values[-1], wanted))
        raise FileError(
            f"{path}: found {name} from {low} to {high}, of which none is {own}, as in the study; allowed: results "
            f"that have the study's {name}, or {option('set')} a value that they have."
        )
    return near
