"""Continuation of a study: from its section ``continue`` and seeds to a file of
branches."""

from __future__ import annotations

import hashlib
import os
import time
from collections import Counter
from contextlib import nullcontext
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from nsdrill import interrupt
from nsdrill.app.branch_data import dataset_of, with_curves
from nsdrill.app.continuation_setup import RANGE_PARTS, ContinuationSetup, continuation_setup
from nsdrill.app.following import Following, Say, dropped_words
from nsdrill.app.run import processors
from nsdrill.app.seeding import seeds_of
from nsdrill.app.unfinished import Part
from nsdrill.data import json_text, resolved_study
from nsdrill.errors import FileError, InputError, option
from nsdrill.orbit.branch import Branch, Key, from_arrays, to_arrays
from nsdrill.orbit.explore import Explorer, Found
from nsdrill.orbit.flow import Flow
from nsdrill.orbit.seeds import Orders, Seed
from nsdrill.orbit.special import Graze
from nsdrill.store import open_branches, part_path, write_branches
from nsdrill.study.continuation import SECTION
from nsdrill.study.study import Study
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
    seeds: str | os.PathLike[str] | None = None,
    workers: int | None = None,
    overwrite: bool = False,
    resume: bool = False,
    say: Say = lambda text: None,
) -> ContinuationResult:
    """Continue ``study``, from the results file ``seeds`` in place of its own seeds if
    given, into ``path`` if given.

    Finished branches are saved next to ``path`` until the file is written, and
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
    with claim as part:
        begun, is_resumed = time.perf_counter(), part is not None and bool(part.kept)
        try:
            with interrupt.interruptible():
                data, found = _followed(setup, part, seeds, workers or processors(), say)
        except KeyboardInterrupt:
            raise KeyboardInterrupt(_interrupted(part)) from None
        if path is not None and part is not None:
            remedy = f"{part.kept} are safe in {part.path}. Go on with {option('resume')}."
            write_branches(path, data, lambda: remedy, overwrite=overwrite or is_resumed)
            part.discard()
        return ContinuationResult(data, dict(Counter(found.seeds)), time.perf_counter() - begun)


def _followed(
    setup: ContinuationSetup, part: Part | None, source: str | os.PathLike[str] | None, workers: int, say: Say
) -> tuple[Dataset, Found]:
    """The Dataset of branches, and what was found. The branches that have ended are saved
    in ``part``, which may have some already."""
    continuation = setup.continuation
    flow = setup.flow((continuation.along,), ((continuation.high - continuation.low) / RANGE_PARTS,), workers)
    seeds = seeds_of(setup, flow, source, say)
    digest = _digest(setup.study, seeds)
    branches = _load_branches(part, digest) if part is not None and part.kept else {}

    def save(finished: dict[Key, Branch]) -> None:
        branches.update(finished)
        number, points = len(branches), sum(map(len, branches.values()))
        kept = f"{number} branch{'' if number == 1 else 'es'}, {points} points"
        if part is not None:
            arrays, data = to_arrays(branches)
            part.write(digest, data, arrays, kept)
        say(f"so far {kept}")

    orders = _orders(setup, flow)
    found = Explorer(flow, orders, dict(branches), save, interrupt.check, Following(say).watch).run(seeds)
    if not found.branches:
        raise InputError(_no_branch(setup.study, found, seeds))
    if words := dropped_words(len(branches), len(found.branches)):
        say(words)
    say(f"measuring {sum(map(len, found.branches))} points")
    data = dataset_of(setup, flow, found)
    if continuation.curves is not None:
        say("curves")
        data = with_curves(setup, data, found, workers)
    return data, found


def _orders(setup: ContinuationSetup, flow: Flow) -> Orders:
    continuation, motions = setup.continuation, {*setup.continuation.motions}
    return Orders(
        continuation.lobes,
        (continuation.low, continuation.high),
        continuation.points,
        continuation.switch,
        "periodic" in motions,
        bool({"rolling", "stick_slip"} & motions),
        "rolling" in motions,
        grazes_of(setup.study, flow),
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
    if not part.kept:
        return "Interrupted before the first branches had ended: nothing is kept. The same command begins anew."
    return f"Interrupted: {part.kept} are safe in {part.path}. Go on with {option('resume')}."


def _no_branch(study: Study, found: Found, seeds: list[Seed]) -> str:
    """The error where no seed led to a branch."""
    outcomes = (
        "; ".join(f"{count} of {len(seeds)}: {word}" for word, count in Counter(found.seeds).items())
        or "no seeds at all"
    )
    return (
        f"{study.source or 'the study'}: found no motion to follow from its seeds ({outcomes}); allowed: seeds that "
        f"have settled on a motion that repeats. Give others (continue.seeds or "
        f"{option('seeds')}), let them settle for longer "
        "(simulation.transient), or try longer periods (continue.lobes)."
    )


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
        return from_arrays(arrays, data)
    except (ValueError, KeyError, TypeError, IndexError) as error:
        raise part.damaged(error) from error
