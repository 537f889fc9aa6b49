"""The grade of every operating point on the grid of a sweep, in each sample of uncertain
numbers: the one definition of what is allowed."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from dataclasses import astuple, replace

import numpy as np

from nsdrill.analysis.counts import after_failure, carried_axis, known
from nsdrill.analysis.histories import Grade, Label, Ways, carried, excursion, is_allowed
from nsdrill.analysis.planes import along_axis, axes_of
from nsdrill.analysis.safety import DECIDING, known_runs, run_safety
from nsdrill.analysis.sticking import Sticking, sticking
from nsdrill.analysis.unmodelled import unmodelled
from nsdrill.data import LASTING_MOTIONS, LASTING_UNTOLD, MUD_DRIVES, Answer, Array, Results, resolved_study
from nsdrill.errors import count
from nsdrill.models.registry import responses_in
from nsdrill.models.responses import RESPONSES, STALLED, Response
from nsdrill.variables import OK, TRUST, UNMEASURED

# What shows that a motion that may last was met and left: the response, and of whirl its kind.
BOUNCE = "bit_bounce"
MET = {"wall_speed": ("whirl", "backward_rolling"), "lobe_resonance": (BOUNCE, None)}


def labels_of(results: Results, severity: int | None = None) -> Array:
    """The :class:`Label` of every run, on the grid. With ``severity`` a run with responses
    of that severity at most is clear, and so is one that oscillates in torsion, at that
    severity at most, without sticking."""
    runs = run_safety(results, severity)
    bits = np.where(known_runs(results), results["response"], 0).astype(int)
    touches = np.zeros(results.shape, dtype=bool)
    for one in responses_in(results.attrs).values():
        if (name := _touched_by(one)) in results.variables:
            allowed = 0 if one.share else severity or 0
            with np.errstate(invalid="ignore"):
                beyond = results[name] > allowed
            if one.kind is not None and one.kind.name in results.variables:
                beyond &= ~one.is_harmless(results[one.kind.name])
            touches |= beyond
    labels = np.where(runs.safe, Label.CLEAR, np.where(runs.unsafe, Label.CRITICAL, Label.UNKNOWN))
    labels = np.where((labels == Label.CLEAR) & touches & (bits == 0), Label.TOUCHING, labels)
    ended = (known(results["status"]) | (results["status"] == UNMEASURED)) & ~after_failure(results)
    labels = np.where((labels == Label.UNKNOWN) & ended, Label.OPEN, labels)
    return np.where(runs.unsafe & (bits & STALLED > 0), Label.STALLED, labels)


def _touched_by(response: Response) -> str:
    """The variable that tells how near a run is to a response; "" of one without severities."""
    if response.severity is None:
        return ""
    return response.feature if response.share else response.severity.name


def used_by_labels(critical: Iterable[Response]) -> tuple[str, ...]:
    """The variables that :func:`labels_of` uses of results with these responses, beside those of
    :func:`nsdrill.analysis.safety.needed`."""
    of_responses = [(_touched_by(one), one.kind.name if one.kind is not None else "") for one in critical]
    return (*TRUST, *DECIDING, *(name for names in of_responses for name in names if name))


def grades_of(results: Results, severity: int | None = None) -> Array:
    """The :class:`nsdrill.analysis.histories.Grade` of every point, in each sample: on the
    grid without the procedures. What no response, or a lesser severity, allows is allowed: a mild
    vibration that this severity allows may be what a worse one came from, or why one starts at a point."""
    if results.part_of is not None:
        whole, axis, chosen = results.part_of
        return np.take(grades_of(whole, severity), chosen, axis=whole.axes.index(axis))
    found = _grades_at(results, severity)
    # a run that came free where the model leaves a motion out tells nothing
    found = np.where(unmodelled(results) & (found > Grade.CRITICAL), Grade.UNKNOWN, found)
    if severity is None:
        return found
    less = severity - 1 if severity > 0 else None
    labels = labels_of(results, severity)
    # one that failed may have been worse, and of one that was inferred no severity is known
    is_no_worse = ((labels > Label.UNKNOWN) & (labels >= labels_of(results, less))).all(axis=0)
    stricter = grades_of(results, less)
    return np.where(is_allowed(stricter) & is_no_worse, np.maximum(stricter, found), found)


def _grades_at(results: Results, severity: int | None) -> Array:
    """The grades at this severity alone."""
    labels = labels_of(results, severity)
    by_way, along = dict(zip(results.procedures, labels, strict=True)), _along(results)
    up, down, same = (
        None if (found := by_way.get(way)) is None else np.moveaxis(found, along, 0) for way in ("up", "down", "same")
    )
    met = True if down is None else np.moveaxis(_met(results, labels, along), along, 0)
    found = sticking(results, labels, along)
    about = (found.lasts, found.open, found.met, found.unstable, found.tried, found.may, found.between, found.perhaps)
    lasts, is_open, stuck, unstable, tried, may, between, perhaps = (np.moveaxis(part, along, 0) for part in about)
    ways = Ways(up, down, same, met, lasts, is_open, stuck, unstable, tried, may, between, perhaps)
    if severity is not None and up is not None and down is not None:
        any_up, any_down = (
            carried(np.moveaxis(labels_of(results)[results.procedures.index(way)], along, 0)[::step])[::step]
            for way, step in (("up", 1), ("down", -1))
        )
        ways = replace(ways, allowed=excursion(any_up, any_down))
    return np.moveaxis(ways.grades(), 0, along)


def sticking_of(results: Results, severity: int | None = None) -> Sticking:
    """What is known of stick-slip that lasts, on the grid without the procedures."""
    if results.part_of is not None:
        whole, axis, chosen = results.part_of
        found, place = sticking_of(whole, severity), whole.axes.index(axis)
        return Sticking(*(np.take(part, chosen, axis=place) for part in astuple(found)))
    return sticking(results, labels_of(results, severity), _along(results))


def _along(results: Results) -> int:
    """The place among the axes of that along which the state is carried; of x of the maps
    where a file does not tell it."""
    along, swept = carried_axis(results), axes_of(results)
    if along is None and swept is not None:
        along = swept[0]
    return 0 if along is None else results.axes.index(along)


def lasting(results: Results) -> list[Answer]:
    """The motions that may last above a critical speed, once they begin."""
    found: list[Answer] = json.loads(results.attrs.get(LASTING_MOTIONS, "[]"))
    return found


def lasts_above(one: Answer, wob: float | None) -> list[float] | None:
    """The least and the greatest speed [rad/s] above which one of :func:`lasting` may last at a
    weight ``wob`` [N], and where that is not told by weight, over the whole study; None where
    it cannot."""
    here = [row["rotary_speed"] for row in one.get("by_weight", ()) if row["wob"] == wob]
    found: list[float] | None = one["lasts"] if not here else None if here[0] is None else [here[0], here[0]]
    return found


WIDE = 0.5  # of initial.spread: 1 is from a bit at rest to one at twice the speed, and as far as the wall


def spread_of(results: Results) -> float | None:
    """How far apart many starts are drawn (initial.spread), where that is less than
    :data:`WIDE`, so that all of them are one start, disturbed a little; None where they are
    further apart, where there is a slice, and where a file does not say."""
    initial = resolved_study(results.attrs).get("initial", {})
    spread = initial.get("spread") if "start" in results.coords and not initial.get("slice") else None
    return None if spread is None or float(spread) >= WIDE else float(spread)


def unsettled_runs(results: Results) -> Array:
    """Whether each run was finished and did not settle, or turned faster than the speed above
    which rotating mud drives whirl at its setting, however slowly; nowhere in a file that does not say."""
    found = np.zeros(results["status"].shape, dtype=bool)
    if "settled" in results.variables:
        found |= results["settled"] == 0
    found |= driven_by_mud(results)[0]
    return np.asarray((results["status"] == OK) & found)


def unsettled_in(results: Results) -> Answer:
    """In how many (``runs``) of the runs that ended well (``of``) a motion had not settled; empty
    where in none."""
    runs = int(np.count_nonzero(unsettled_runs(results)))
    return {"runs": runs, "of": int(np.count_nonzero(results["status"] == OK))} if runs else {}


def unsettled_words(found: Answer) -> str:
    """What :func:`unsettled_in` has found, of shares of samples, in words."""
    return (
        f"in {found['runs']} of {count(found['of'], 'run')} a motion was still changing, or is chaotic; shares of what "
        "still changes are those of a transient: lengthen simulation.transient until they stay"
    )


def driven_by_mud(results: Results) -> tuple[Array, Array]:
    """Whether each run turns faster than the speed above which rotating mud drives whirl by
    itself at its setting; and these speeds [rad/s], infinite where it does not."""
    shape = results["status"].shape
    if MUD_DRIVES not in results.variables:
        return np.zeros(shape, dtype=bool), np.full(shape, np.inf)
    above = results[MUD_DRIVES]
    drawn = results.uncertain.get("rotary_speed")
    speeds = results.coords["rotary_speed"] if drawn is None else drawn
    place = results.grid.index("rotary_speed" if drawn is None else "sample")
    return along_axis(np.asarray(speeds, float), place, len(shape)) > above, above


def _met(results: Results, labels: Array, along: int) -> Array:
    """Where every motion that may last was met higher up on the way down, ``along`` an axis,
    or cannot last at that speed. Of a model that does not tell all motions that may last any
    vibration must have been met as well, and a bounce where its bit may bounce: stick-slip that
    ended does not show that a bounce does."""
    down = results.procedures.index("down")
    everything = np.ones(results["status"][down].shape, dtype=bool)
    if int(results.attrs.get(LASTING_UNTOLD, 0)):
        everything &= _from_there_down(np.isin(labels[down], (Label.CRITICAL, Label.STALLED)), along)
        if BOUNCE in responses_in(results.attrs):
            everything &= _from_there_down(_shows(results, BOUNCE, down), along)
    if not lasting(results):
        return everything
    speeds = np.asarray(results.coords["rotary_speed"], dtype=float)
    by_speed = along_axis(speeds, results.axes.index("rotary_speed"), everything.ndim)
    for one in lasting(results):
        response, kind = MET.get(one["name"], (None, None))
        if not one["lasts"] or response is None:
            continue
        begins = _lasts_above_in(one, results, everything.ndim)
        name = RESPONSES[response].kind
        if kind is not None and name is not None and name.name in results.variables:
            there = results[name.name][down] == (name.flag_meanings or "").split().index(kind)
        else:
            there = _shows(results, response, down)
        everything &= _from_there_down(there, along) | (by_speed < begins)
    return everything


def _lasts_above_in(one: Answer, results: Results, dimensions: int) -> Array:
    """The speed [rad/s] above which a motion may last at the weight of each point, infinite
    where it cannot; where that is not told by weight, the least over all of them."""
    if "wob" not in results.axes:
        return np.asarray(float(one["lasts"][0]))
    ends = [lasts_above(one, wob) for wob in np.asarray(results.coords["wob"], dtype=float).tolist()]
    above = np.array([math.inf if found is None else found[0] for found in ends])
    return along_axis(above, results.axes.index("wob"), dimensions)


def _shows(results: Results, response: str, way: int) -> Array:
    """Where runs of a ``way`` show a response."""
    return np.asarray(results["response"][way].astype(int) & RESPONSES[response].bit > 0)


def _from_there_down(there: Array, along: int) -> Array:
    """Where something is ``there`` or was higher up ``along`` an axis."""
    return np.flip(np.logical_or.accumulate(np.flip(there, along), axis=along), along)
