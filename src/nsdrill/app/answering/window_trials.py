"""Trials of a setting that a window recommends, and of changes of the string where it
recommends none: runs with the study of the file and its overrides."""

from __future__ import annotations

import json
import threading
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from nsdrill import interrupt
from nsdrill.analysis.advice import Advice, Kind, without
from nsdrill.analysis.confirmed import confirmed
from nsdrill.analysis.counts import carried_axis
from nsdrill.analysis.graded import SLACK, Graded, graded
from nsdrill.analysis.trials import HOLDS_SPEED, Change, Robust, Trials, Way, deepest, narrowed
from nsdrill.analysis.window import find_window
from nsdrill.app.answering.answers import path_of, plain_window, results_for_window
from nsdrill.app.answering.remedies import AS_IT_IS, SPEEDS, Changed, shown
from nsdrill.app.answering.trial_runs import OBSERVE, SETTLE, Bench, Told, result_of
from nsdrill.app.experiment import stored_experiment, unlike
from nsdrill.app.running.run import checked_workers
from nsdrill.app.running.stages import Watch
from nsdrill.app.simulating.motions import Motions
from nsdrill.data import IN_MEMORY, WITHIN, Answer, Array, Results, units_of
from nsdrill.errors import InputError
from nsdrill.variables import SAMPLE, dimension_of

if TYPE_CHECKING:
    from nsdrill.app.datasets import Source

MOST_CUTS = 12  # of what to stay within, by trials
MOST_CHANGES = 3  # that are tried
MOST_SETTINGS = 3  # at which a change is tried


def window(
    source: Source, severity: int | None = None, confidence: float | None = None, within: object = None
) -> Answer:
    """The window of :func:`nsdrill.app.answering.answers.window` with trials."""
    results = results_for_window(source, severity, within)
    found = tried(find_window(results, severity, confidence), results, path_of(source))
    return plain_window(found, units_of(results.attrs))


def tried(
    summary: Answer,
    results: Results,
    path: str = IN_MEMORY,
    *,
    workers: int | None = None,
    watch: Watch = lambda progress: None,
) -> Answer:
    """The ``summary`` of the window of ``results`` with trials of its answer, which confirm
    or withdraw it; and where no setting has room or is left, with what would help. Interrupted, it
    has those that ended. FileError where the file has no study of this version."""
    advice: Advice = summary["answer"]
    if advice.kind == Kind.UNKNOWN:
        return summary
    experiment = stored_experiment(path, results)
    if not (model := experiment.study.model).drills:
        raise InputError(
            f"{path}: found results of the model {model.name}; allowed: trials of a drill string, of which they move "
            "weight and speed. The window without trials needs neither."
        )
    motions, workers = Motions(experiment), checked_workers(workers)
    # what vibrates by itself is allowed by no trial that vibrates, and an answer by a stricter level is tried by that
    severity = None if advice.vibrates is not None else advice.severity
    told = Told(watch, workers)
    differing = tuple(unlike(results.attrs))
    samples = SAMPLE in results.coords
    mapped = "up" in results.procedures and not samples and carried_axis(results) in (None, "rotary_speed")
    found = Trials(settled=SETTLE, observed=OBSERVE, samples=samples, mapped=mapped, differing=differing)
    found = replace(found, nothing=mapped and advice.kind == Kind.NOTHING)
    nothing = advice.narrow or advice.kind == Kind.NOTHING
    within = {axis: (low, high) for axis, (low, high) in json.loads(results.attrs.get(WITHIN, "{}")).items()}

    def changes_at(place: dict[str, float]) -> Changed:
        weights = _weights(results, severity, place, within.get("wob"), motions)
        return Changed(motions, place, results.coords["rotary_speed"], severity, within, weights)

    changed, later, is_open = None, None, advice.cell is not None and advice.kind != Kind.NOTHING
    if nothing and "rotary_speed" in results.swept:
        place = _values(summary, results, motions, advice)
        if advice.kind == Kind.HINT and "wob" in results.swept:  # there it is free already
            place["wob"] = _middle(results.coords["wob"], within.get("wob"))
        changed = changes_at(place)
        found = replace(found, wob=place["wob"])
    elif is_open and "rotary_speed" in results.swept:  # where trials withdraw it
        place = _values(summary, results, motions, advice)
        later = changes_at(place)
    if (priced := changed or later) is not None:
        told.foresee(priced, is_sure=changed is not None, is_first=not is_open)
    try:
        with interrupt.interruptible():
            if is_open:
                place = _values(summary, results, motions, advice)
                ends = advice.stay_within.get("rotary_speed")
                low, speeds = ends.low if ends else None, results.coords["rotary_speed"]
                corners, modelled, way = _corners(advice, place), advice.modelled, advice.way_in
                bench = Bench(motions, place, speeds, low, severity, corners, modelled, way)
                found = bench.all(replace(found, depth=place["depth"] if advice.depths else None), workers, told)
                advice, found = _within_corners(advice, found, bench, results, summary["confidence"], workers, told)
                is_open = False
            if changed is None and (found.withdraws or advice.narrow) and "rotary_speed" in results.swept:
                changed, found = later, replace(found, wob=place["wob"])
            if changed is not None and not found.interrupted:
                found = replace(found, by_map=_as_it_is(results, severity, changed) if mapped else None)
                told.begin()
                speeds = np.asarray(results.coords["rotary_speed"], dtype=float)
                steps = float(np.ptp(speeds)) / (SPEEDS - 1), float(np.max(np.diff(speeds), initial=0.0))
                found = replace(found, begins=float(np.min(speeds)), steps=steps)
                for change in changed_all(changed, told, workers):
                    found = replace(found, changes=(*found.changes, change))
                found = _with_changes_tried(found, changed, results.coords["rotary_speed"], workers, told)
    except KeyboardInterrupt:
        found = replace(found, interrupted=True, is_cut_short=found.is_cut_short or is_open)
    return {**summary, "answer": confirmed(advice, found)}


def _corners(advice: Advice, place: Mapping[str, float]) -> tuple[tuple[float, float], ...]:
    """The speed and the weight at each corner of what to stay within, but the point itself; an
    axis that is not there is as it is at the point."""
    here = place["rotary_speed"], place["wob"]
    speeds, weights = (
        (one.low, one.high) if (one := advice.stay_within.get(axis)) is not None else (value, value)
        for axis, value in zip(("rotary_speed", "wob"), here, strict=True)
    )
    return tuple(dict.fromkeys(one for one in product(speeds, weights) if one != here))


def _within_corners(
    advice: Advice, found: Trials, bench: Bench, results: Results, confidence: float | None, workers: int, told: Told
) -> tuple[Advice, Trials]:
    """The ``advice`` with what to stay within cut until no corner of it vibrates in trials, nor
    the setting after an excursion in it; and the trials with those of its new corners; after
    many cuts these are not tried."""
    maps = None
    for cut in range(MOST_CUTS):
        bad = [*found.bad_excursions, *found.bad_corners]
        if not bad or found.withdraws:
            break
        maps = maps or graded(results, advice.severity, confidence)
        advice = without(maps, advice, bad)
        tried = {(one.speed, one.wob) for one in found.corners}
        corners = tuple(one for one in _corners(advice, bench.values) if one not in tried)
        if not corners:
            break
        if found.interrupted or cut == MOST_CUTS - 1:
            return advice, replace(found, untried=corners)
        found = replace(bench, corners=corners).of_corners(found, workers, told)
    return advice, found


def _with_changes_tried(found: Trials, changed: Changed, speeds: Array, workers: int, told: Told) -> Trials:
    """The trials with those of the changes that promise most, until none that is left can be better: what helps is
    judged as the setting itself is."""
    if found.best is None or not found.best.key:
        return found
    best: Change | None = None
    promising = _promising(found)
    promising += _further(found, promising)
    told.ran_changes(len(promising))
    for number, change in enumerate(promising):
        if best is not None and best.rank[:2] >= change.rank[:2]:
            continue  # trials only take away
        told.begin()
        tried = _tried_change(change, changed, speeds, workers, told)
        told.ran_one(len(promising) - number - 1)
        if tried is None:  # of a part of them nothing is told
            return replace(found, interrupted=True)
        found = replace(found, changes=tuple(one.with_one(tried) for one in found.changes))
        if tried.has_room and tried.is_sound and (best is None or tried.rank > best.rank):
            best = tried
    return found


def _promising(found: Trials) -> list[Change]:
    """The changes to try: what promises most first, each at the weight nearest to those that are drilled with, and then
    at that at which it has the most room, as it may hold there where it does not nearer."""
    chosen: list[list[Change]] = []
    for one in found.nearest_first(found.helping):
        same = next((each for each in chosen if each[0].is_of(one)), None)
        if same is None:
            chosen.append([one])
        elif (one.room or 0.0) > (same[-1].room or 0.0):
            same[1:] = [one]
    return [one for each in chosen[:MOST_CHANGES] for one in each]


def _further(found: Trials, promising: Sequence[Change]) -> list[Change]:
    """The same changes at the other weights at which they promise to be good: what trials take away at one may hold at
    another, and is tried before what takes more effort is named."""
    untried = [one for one in found.nearest_first(found.helping) if one not in promising]
    return [one for one in untried if one.promised == Robust.GOOD and any(one.is_of(each) for each in promising)]


def _tried_change(change: Change, changed: Changed, speeds: Array, workers: int, told: Told) -> Change | None:
    """The ``change`` with its trials, at the weights to which a driller holds it as well, and what it allows there, by
    its ways up, cut until no corner of that vibrates; with a usual damping of torsion, where that leaves room. Where
    its setting has no room in what is left, or trials take it away, the setting moves to the :func:`deepest` speed of
    that, and is tried there.
    None where trials were interrupted."""
    change = changed.with_usual_damping(changed.held_in_weight(change))
    for left in reversed(range(MOST_SETTINGS)):
        tried = _tried_at(change, changed, speeds, workers, told)
        if tried is None:
            return None
        if tried.has_room and tried.is_sound:
            return changed.with_low_damping(tried)
        moved = deepest(tried) if tried.is_sound else _beside(tried)
        if not moved.has_room:
            return tried
        change = replace(moved, why=change.why, trials=tuple(one for one in tried.trials if one.way == Way.CORNER))
        if not left:
            return replace(tried, room=None, why=f"what {MOST_SETTINGS} settings leave was not tried")
    raise AssertionError


def _beside(change: Change) -> Change:
    """The ``change`` without its setting, of which trials took that away: of the speeds below and above those with
    more room."""
    assert change.speed is not None
    assert change.widest is not None
    (low, high), speed = change.widest, change.speed
    sides = (low, min(high, speed - HOLDS_SPEED)), (max(low, speed + HOLDS_SPEED), high)
    return max((deepest(narrowed(change, *ends)) for ends in sides), key=lambda one: one.room or 0.0)


def _tried_at(change: Change, changed: Changed, speeds: Array, workers: int, told: Told) -> Change | None:
    """The ``change`` with the trials of its setting, and with what it allows cut until no corner of that vibrates, nor
    the setting after an excursion in it, as long as the setting lies within. None where they were interrupted."""
    motions, place = changed.point(change)
    assert change.widest is not None
    low, wob, before = change.widest[0], place["wob"], change.trials
    seen = {(one.speed, one.wob) for one in before}
    corners = tuple(one for one in _corners_of(change, wob) if one not in seen)
    bench = Bench(motions, place, speeds, low, changed.severity, corners)
    ran = bench.all(Trials(), workers, told)
    for _ in range(MOST_CUTS):
        if ran.is_cut_short:
            return None
        change = replace(change, trials=(*ran.trials, *before))
        less = _less(change, wob)
        if less is change or ran.withdraws:
            return less
        seen = {(one.speed, one.wob) for one in change.trials}
        change, corners = less, tuple(one for one in _corners_of(less, wob) if one not in seen)
        if not less.holds_setting or not deepest(less).has_room:
            return less
        if corners:
            ran = replace(bench, corners=corners).of_corners(ran, workers, told)
    return replace(change, room=None, why=f"after {MOST_CUTS} cuts corners of what is left were not tried")


def _corners_of(change: Change, wob: float) -> tuple[tuple[float, float], ...]:
    """The speed and the weight at each corner of what a ``change`` allows, but its setting."""
    assert change.widest is not None
    assert change.weights is not None
    corners = dict.fromkeys(product(change.widest, change.weights))
    return tuple(one for one in corners if one != (change.speed, wob))


def _less(change: Change, wob: float) -> Change:
    """The ``change`` with less of what it allows where corners of that vibrate, or the setting after an excursion in
    it; itself where none does. A weight goes at which both ends of the speeds vibrate, else what a driller
    holds of the speeds."""
    assert change.speed is not None
    assert change.widest is not None
    assert change.weights is not None
    speed, (low, high), (light, heavy) = change.speed, change.widest, change.weights
    corners = {(one.speed, one.wob) for one in change.inside if one.way == Way.CORNER and one.outcome.is_bad}
    there = [one.there for one in change.inside if one.there is not None and one.outcome.is_bad]
    if not corners and not there:
        return change
    gone = {one for one in (light, heavy) if one != wob and {(low, one), (high, one)} <= corners}
    left = {one for one in corners if one[1] not in gone}
    speeds = {one for one, _ in left}
    lows = [low + HOLDS_SPEED] * (low in speeds) + [one + HOLDS_SPEED for one in there if one < speed]
    highs = [high - HOLDS_SPEED] * (high in speeds) + [one - HOLDS_SPEED for one in there if one > speed]
    low, high = max([low, *lows]), min([high, *highs])
    weights = (wob if light in gone else light, wob if heavy in gone else heavy)
    return replace(narrowed(change, low, high), weights=weights)


def _values(summary: Answer, results: Results, motions: Motions, advice: Advice) -> dict[str, float]:
    """The values of all axes at the point of the ``advice``; where it has none, in the
    middle of each axis, of where one drills."""
    within = json.loads(results.attrs.get(WITHIN, "{}"))
    values = {key: _middle(axis, within.get(dimension_of(key))) for key, axis in motions.plan.axes.items()}
    if advice.cell is not None:
        x, y = (*summary["axes"], None)[:2]
        at = dict(zip((summary["third"], y, x), advice.cell, strict=True))
        for key in values:
            if (name := dimension_of(key)) in at:
                values[key] = float(np.asarray(results.coords[name], dtype=float)[at[name]])
    return values


def _middle(axis: Array, within: Sequence[float] | None) -> float:
    """The value in the middle of an axis, of those ``within`` two values where some are."""
    values = _drilled(axis, within)
    return float(values[len(values) // 2])


def _drilled(axis: Array, within: Sequence[float] | None) -> Array:
    """The values of an axis ``within`` two values; all where none is."""
    values = np.asarray(axis, dtype=float)
    if within is None:
        return values
    inside = values[(values >= within[0] * (1.0 - SLACK)) & (values <= within[1] * (1.0 + SLACK))]
    return inside if inside.size else values


def _as_it_is(results: Results, severity: int | None, changed: Changed) -> Change | None:
    """The string as it is, from the map itself, at the values and the weights of ``changed``; None of a map that is
    not over the speed."""
    maps = graded(results, severity)
    if maps.x != "rotary_speed":
        return None
    here, *others = (_row_of(maps, {**changed.values, "wob": wob}) for wob in changed.wobs(AS_IT_IS))
    return replace(here, others=tuple(others))


def _row_of(maps: Graded, values: Mapping[str, float]) -> Change:
    """The string as it is, from the row of ``maps`` at these ``values``."""
    at = {dimension_of(key): value for key, value in values.items()}
    number, row = (
        0 if axis is None or axis not in at else int(np.abs(maps.values(axis) - at[axis]).argmin())
        for axis in (maps.third, maps.y)
    )
    return shown(replace(AS_IT_IS, wob=values["wob"]), maps, number, row)


def _weights(
    results: Results, severity: int | None, place: Mapping[str, float], within: Sequence[float] | None, motions: Motions
) -> tuple[float, ...]:
    """The weights [N] of the map at which changes are run, of those ``within`` two: that of the ``place``, the
    lightest and that between them, that of the study, and that at which the map is most nearly free."""
    if "wob" not in results.swept:
        return (place["wob"],)
    values = _drilled(results.coords["wob"], within)
    here, least = place["wob"], float(values.min())
    chosen = here, least, (here + least) / 2.0, motions.study.operation.wob
    found = {float(values[np.abs(values - one).argmin()]) for one in chosen} | {here}
    maps = graded(results, severity)
    if maps.x == "rotary_speed" and "wob" in (maps.y, maps.third):
        rows = [_row_of(maps, {**place, "wob": float(wob)}) for wob in values]
        nearly = max(rows, key=lambda one: (one.room or 0.0, sum(high - low for low, high in one.free), one.wob))
        found.add(nearly.wob or place["wob"])
    return tuple(sorted(found))


def changed_all(changed: Changed, told: Told, workers: int) -> Iterator[Change]:
    """The changes with what they do, in their order. The string as it is, is run as they are even where the map has
    shown what it does: its steps and histories are others, and of two ways up that differ in more than the change none
    tells what that does."""
    stop = threading.Event()

    def run(change: Change) -> Change:
        with interrupt.while_wanted(lambda: not stop.is_set()):
            return changed.run(change)

    to_run = changed.all()
    with ThreadPoolExecutor(workers) as threads:
        running: list[Future[Change]] = []
        try:
            told.at(0, len(to_run), "changes")
            running = [threads.submit(run, one) for one in to_run]
            for number, one in enumerate(running):
                told.at(number, len(to_run), "changes")
                yield result_of(one)
        finally:
            stop.set()
            for one in running:
                one.cancel()
