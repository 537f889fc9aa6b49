"""Continuation of a study: from its section ``continue`` and seeds to a file of branches,
and from a point of it to the trace of its motion."""

from __future__ import annotations

import hashlib
import math
import os
import time
from collections import Counter
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from nsdrill import interrupt
from nsdrill.analysis.bifurcations import seed_text
from nsdrill.analysis.counts import driving_in_parts, driving_words
from nsdrill.analysis.own_contacts import creeping_in_parts, creeping_words
from nsdrill.app.following.bending import bending_of
from nsdrill.app.following.branch_data import dataset_of, with_curves
from nsdrill.app.following.orbits import ITS_STUDY, OrbitPoint, check_study, orbit_point, settings_for
from nsdrill.app.following.seeding import (
    ALL,
    RANGE_PARTS,
    Chosen,
    ContinuationSetup,
    Following,
    Source,
    continuation_setup,
    dropped_words,
    edited_seeds,
    seeds_of,
)
from nsdrill.app.running import unfinished
from nsdrill.app.running.run import processors
from nsdrill.app.running.unfinished import Part
from nsdrill.app.simulating.trajectory import DEFAULT_SAMPLE, Trajectory, simulate
from nsdrill.app.telling import Telling
from nsdrill.data import json_text, resolved_study
from nsdrill.errors import FileError, InputError, RunWarning, count, option, warn
from nsdrill.models.registry import model_named
from nsdrill.models.variant import variant_at
from nsdrill.orbit.branch import Branch, Key, from_arrays, to_arrays
from nsdrill.orbit.explore import Explorer, Found
from nsdrill.orbit.flow import RTOL, Flow, Legs
from nsdrill.orbit.seeds import Orders, Seed
from nsdrill.orbit.special import Graze
from nsdrill.records import dataclass
from nsdrill.store import open_branches, part_path, write_branches
from nsdrill.study.continuation import SECTION
from nsdrill.study.study import Study, study_from_resolved
from nsdrill.study.write import changes_text

if TYPE_CHECKING:
    from xarray import Dataset


WHAT = "continuation"


@dataclass(frozen=True)
class ContinuationResult:
    """The result of a continuation: the Dataset of branches, the number of seeds by
    their outcome in words, and the wall time in seconds."""

    data: Dataset
    seeds: dict[str, int]
    seconds: float


def _finished(study: Study, path: str | os.PathLike[str]) -> ContinuationResult:
    """The result in the finished file ``path``. FileError where it was made from
    another study."""
    data = open_branches(path)
    if listed := changes_text(resolved_study(data.attrs), study.resolved):
        raise FileError(
            f"{path}: finished, and made from another study ({listed}). Start anew by {option('overwrite')}."
        )
    return ContinuationResult(data, {}, 0.0)


def continue_study(
    study: Study,
    path: str | os.PathLike[str] | None = None,
    *,
    seeds: Source | None = None,
    chosen: Chosen = ALL,
    workers: int | None = None,
    overwrite: bool = False,
    resume: bool = False,
    told: Telling,
) -> ContinuationResult:
    """Continue ``study``, from ``seeds``, results or branches, in place of its own if given,
    of which one motion may be ``chosen``, into ``path`` if given.

    Each branch is saved next to ``path`` as it ends, until the file is written, and
    ``resume`` continues from them; the text of a KeyboardInterrupt says so. A finished
    file of the same study is returned as it is. InputError where the study cannot be
    continued.
    """
    setup = continuation_setup(study)
    if path is not None and resume and not overwrite and os.path.lexists(path) and not part_path(path).exists():
        return _finished(study, path)
    claim = (
        nullcontext() if path is None else Part.claim(path, WHAT, study.model.name, overwrite=overwrite, resume=resume)
    )
    with claim as part, interrupt.with_end_message(lambda: _interrupted(part)):
        begun, is_resumed = time.perf_counter(), part is not None and bool(part.kept)
        try:
            with interrupt.interruptible():
                data, found = _followed(setup, part, seeds, chosen, workers or processors(), told)
        except KeyboardInterrupt:
            raise KeyboardInterrupt(_interrupted(part)) from None
        if path is not None and part is not None:
            remedy = f"{part.kept} are kept in {part.path}. Go on with {option('resume')}."
            write_branches(path, data, lambda: remedy, overwrite=overwrite or is_resumed)
            part.discard()
        seeds_of = Counter(seed_text(one, study.model) for one in found.seeds)
        return ContinuationResult(data, dict(seeds_of), time.perf_counter() - begun)


def _followed(
    setup: ContinuationSetup, part: Part | None, source: Source | None, chosen: Chosen, workers: int, told: Telling
) -> tuple[Dataset, Found]:
    """The Dataset of branches, and what was found. The branches that have ended are saved
    in ``part``, which may have some already."""
    continuation, flow = setup.continuation, _flow_of(setup, workers)
    seeds = seeds_of(setup, flow, source, told, chosen)
    digest = _digest(setup.study, seeds)
    branches = _load_branches(part, digest) if part is not None and part.kept else {}

    def save(key: Key, branch: Branch) -> None:
        branches[key] = branch
        kept = f"{count(len(branches), 'branch')}, {count(sum(map(len, branches.values())), 'point')}"
        if part is not None:
            numbers = {one: number for number, one in enumerate(branches)}
            shown = [(numbers[one], own) for one, own in explorer.so_far.items()]
            arrays, descriptions = to_arrays(branches)
            done = {"open": explorer.open, "seeds": explorer.seeds, "shown": shown}
            part.write(digest, {"branches": descriptions, **done, **_origin(setup.study)}, arrays, kept)
        following.kept(kept)

    following = Following(told, setup)
    explorer = Explorer(flow, _orders(setup, flow), dict(branches), save, interrupt.check, following.watch)
    found = explorer.run(seeds)
    if not found.branches:
        raise InputError(_no_branch(setup.study, found, seeds) + _turning(setup.study, flow, seeds))
    if any(one != "followed" for one in found.seeds) and (remedy := _turning(setup.study, flow, seeds)):
        warn(f"not every seed was followed:{remedy}", RunWarning)
    if words := dropped_words(len(branches), len(found.branches)):
        told.note(words)
    told.begins(f"measuring {count(sum(map(len, found.branches)), 'point')}")
    data = dataset_of(setup, flow, found)
    measured = {str(name): one.values for name, one in data.data_vars.items()}
    if driven := driving_in_parts(data.attrs, measured):
        warn(f"FRICTION DRIVES: {driving_words(driven, 'point')}.", RunWarning)
    if creeping := creeping_in_parts(data.attrs, measured):
        warn(f"NO STICK: {creeping_words(creeping, 'point')}.", RunWarning)
    if continuation.curves is not None:
        data = with_curves(setup, data, found, workers, told)
    data.attrs |= edited_seeds(setup, source)
    return data, found


def _flow_of(setup: ContinuationSetup, workers: int) -> Flow:
    """The flow in which the continued number is free."""
    continuation = setup.continuation
    return setup.flow((continuation.along,), ((continuation.high - continuation.low) / RANGE_PARTS,), workers)


def _origin(study: Study) -> dict[str, object]:
    """The ``study`` as plain data, from which what is kept can be shown."""
    about = {"text": study.text, "source": study.source, "overrides": list(study.overrides)}
    return {"study": {"resolved": study.resolved, **about}}


def branches_kept(path: str | os.PathLike[str]) -> Dataset | None:
    """The Dataset of the branches of an unfinished continuation in its part file ``path``;
    its title and the attribute ``unfinished`` say how much there is. None where it is
    another file, or has no branch yet. FileError where it is damaged."""
    told = unfinished.contents(path, WHAT)
    if told is None:
        return None
    (data, arrays), study = told, told[0]["study"]
    setup = continuation_setup(
        study_from_resolved(study["resolved"], study["text"], study["source"], study["overrides"])
    )
    kept = [*from_arrays(arrays, data["branches"]).values()]
    found = Found([kept[number].stretch((first, after)) for number, (first, after) in data["shown"]], [])
    words = (
        f"unfinished: {count(len(found.branches), 'branch')} so far, "
        f"{data['open']} of {count(data['seeds'], 'seed')} still to follow or to place"
    )
    dataset = dataset_of(setup, _flow_of(setup, 1), found, as_kept=True)
    return dataset.assign_attrs(unfinished=words, title=f"{dataset.attrs['title']} ({words})".strip())


def _orders(setup: ContinuationSetup, flow: Flow) -> Orders:
    continuation, motions = setup.continuation, {*setup.continuation.motions}
    return Orders(
        continuation.lobes,
        (continuation.low, continuation.high),
        continuation.points,
        continuation.switch,
        "periodic" in motions,
        bool({"rolling", "stick_slip", "cycle"} & motions),
        "rolling" in motions,
        grazes_of(setup.study, flow),
        {"both": 0, "up": 1, "down": -1}[continuation.direction],
        bending_of(setup, flow),
    )


def grazes_of(study: Study, flow: Flow) -> dict[int, Graze]:
    """The labels for reaching and losing each contact and level, by its place."""
    codes = {(one.contact, one.when): one.code for one in study.model.grazing}
    equations = flow.equations
    return {
        place: Graze(codes.get((name, "reached")), codes.get((name, "lost")), place < len(equations.contacts))
        for place, name in enumerate((*equations.contacts, *equations.levels))
    }


def _interrupted(part: Part | None) -> str:
    """The text of an interrupt."""
    if part is None:
        return interrupt.NOTHING
    if not (kept := part.held()):
        return "Interrupted before the first branch had ended: nothing is kept. The same command begins anew."
    return f"Interrupted: {kept} are kept in {part.path}. Go on with {option('resume')}."


def _no_branch(study: Study, found: Found, seeds: list[Seed]) -> str:
    """The error where no seed led to a branch."""
    words = Counter(seed_text(one, study.model) for one in found.seeds)
    outcomes = "; ".join(f"{number} of {len(seeds)}: {word}" for word, number in words.items())
    steady = "steady drilling" if study.model.drills else "an equilibrium"
    if values := sum(one.steady for one in seeds):
        outcomes = (
            f"{count(values, 'value')} of continue.seeds, each with a guess of {steady} and with what settled "
            f"there: {count(len(seeds), 'seed')}. {outcomes}"
        )
    return (
        f"{study.source or 'the study'}: found no motion to follow from its seeds ({outcomes or 'no seeds at all'}); "
        "allowed: seeds that have settled on a motion that repeats. Take the settled points of a sweep "
        f"({option('seeds', 'SWEEP.h5')}), give other values (continue.seeds), let them settle for longer "
        "(simulation.transient), or try longer periods (continue.lobes)."
    )


def _turning(study: Study, flow: Flow, seeds: list[Seed]) -> str:
    """The remedy where a state of a model of a script seems to grow without bound, as it
    grows alike over many revolutions of the forcing, as an angle does that turns; "" where
    none does."""
    settled = [one for one in seeds if not one.steady]
    if study.model.drills or not flow.symmetry.folds or flow.symmetry.turned or not settled:
        return ""
    grows = np.zeros(len(settled[0].state), bool)
    for seed in settled:
        turn, parts = 2.0 * math.pi / flow.phase_rate(seed.values), np.arange(1, PARTS + 1)
        times = turn * np.concatenate([parts / PARTS, REVOLUTIONS * parts / PARTS])
        values = np.tile(seed.values, (len(times), 1))
        ends = flow.run(Legs(np.tile(seed.state, (len(times), 1)), seed.phase, times, values))
        within, steps = ends.state[:PARTS], np.diff(np.stack([seed.state, *ends.state[PARTS:]]), axis=0)
        least, most = np.min(np.abs(steps), axis=0), np.max(np.abs(steps), axis=0)
        alike = (np.abs(np.sum(np.sign(steps), axis=0)) == PARTS) & (least > 0.5 * most)
        grows |= ends.ok.all() & alike & (np.abs(steps.sum(axis=0)) > FARTHER * np.ptp(within, axis=0))
    names = variant_at(model_named(study.model.name), study.parameters).states
    if grown := [name for name, is_growing in zip(names, grows, strict=True) if is_growing]:
        return (
            f" {' and '.join(grown)} may grow without bound, as an angle does that turns, and then no motion repeats: "
            "take its difference from that of the forcing as the state, angle - omega * t or angle + omega * t."
        )
    return ""


def _digest(study: Study, seeds: list[Seed]) -> str:
    """Digest of all inputs that decide the branches."""
    digest = hashlib.sha256(study.sha256.encode())
    digest.update(json_text(study.resolved.get(SECTION)).encode())
    for one in seeds:
        digest.update(one.state.tobytes() + one.values.tobytes() + np.float64(one.phase).tobytes())
    return digest.hexdigest()


def _load_branches(part: Part, digest: str) -> dict[Key, Branch]:
    """The branches in ``part``; FileError where they are of another continuation."""
    data, arrays = part.read(digest, "another study or from other seeds")
    try:
        return from_arrays(arrays, data["branches"])
    except (ValueError, KeyError, TypeError, IndexError) as error:
        raise part.damaged(error) from error


FEWEST_SAMPLES = 400  # per period
REVOLUTIONS, PARTS = 64, 8  # of a forcing, in all parts of which a state grows that grows without bound,
FARTHER = 4.0  # and further than it moves within one: a motion that only does not repeat turns back


def trace_of(
    study: Study,
    changed: Callable[[list[str]], Study],
    path: str | os.PathLike[str],
    number: int,
    *,
    duration: float | None = None,
    sample: float | None = None,
) -> tuple[Trajectory, OrbitPoint]:
    """The trace of the motion at the point of this ``number``, over one period or
    ``duration`` [s], sampled every ``sample`` [s], and the point. ``changed`` returns
    the ``study`` with other values, texts ``key=value``. FileError where the branches
    are not those of the study's string."""
    point, attrs = orbit_point(path, number)
    here = changed(settings_for(study, point))
    check_study(path, here, point, attrs)
    return simulate_orbit(here, path, point, duration=duration, sample=sample), point


def simulate_orbit(
    study: Study,
    path: str | os.PathLike[str],
    point: OrbitPoint,
    *,
    duration: float | None = None,
    sample: float | None = None,
) -> Trajectory:
    """The trace of the motion at ``point``, over one period or ``duration`` [s].
    ``study`` must have the numbers of the point."""
    states = study.model.states(study.parameters)
    if len(states) != len(point.state):
        raise FileError(
            f"{path}: its motions have {count(len(point.state), 'state')}, the study {len(states)}. {ITS_STUDY}"
        )
    span = point.period if duration is None else duration
    here = {name: value for name, value in point.values.items() if name in study.operation.names()}
    operation, simulation = replace(study.operation, **here), replace(study.simulation, rtol=RTOL)
    fine = replace(study, operation=operation, ramps={}, simulation=simulation)
    return simulate(
        fine,
        duration=span,
        sample=min(DEFAULT_SAMPLE, span / FEWEST_SAMPLES) if sample is None else sample,
        state=point.state,
    )
