"""Up to which speed stick-slip, once it is there, may last at each setting: by the runs of
a file, and by the model; and whether steady drilling is stable at all.

Where stick-slip coexists with steady drilling, a step of the sweep in speed, or in any
other number, may end it by the phase at which it comes. So a point that is free above
the last one that sticks need not be free for a string that is brought there more
smoothly. Runs show that stick-slip lasts up to a speed where one sticks there that was
started at the point, or lowered to it; the model shows it by its cycle. Many starts of
a point need not find it, as few of them begin in it.
"""

from __future__ import annotations

import json

import numpy as np

from nsdrill.analysis.chains import chain_of
from nsdrill.analysis.histories import Label
from nsdrill.analysis.planes import along_axis
from nsdrill.analysis.safety import known_runs
from nsdrill.data import STICKS_TO, Array, Attributes, Results, json_text
from nsdrill.models.responses import STICK_SLIP, WHIRL
from nsdrill.records import dataclass

SPEED = "rotary_speed"
ENDS = ("unstable_to", "lasts_to", "shown_to")  # in the attribute: speeds of each setting
EVERY = "every"  # in the attribute: at every speed
NEAR = 0.98  # of the onset of stick-slip, up to which steady drilling is unstable for certain
_SLACK = 1e-9


@dataclass(frozen=True)
class Sticking:
    """Stick-slip over the grid without the procedures, arrays [axes, worlds]:

    - ``lasts``: whether it may last at the point, once it is there;
    - ``open``: whether it might, by a run that is not known;
    - ``unstable``: whether steady drilling does not last, so that it begins by itself;
    - ``met``: whether it is met before the point on the way up, along the axis along
      which the state is carried, or may have been, in a part of a chain without its
      beginning, or below the sweep where by the model it lasts up to the point;
    - ``may``: whether it may have been, in a run that is not known;
    - ``tried``: whether it is known at the point: by the model, or by a start there, with
      the bit at rest, that came free;
    - ``to``: the set speed up to which it may last [rad/s], by dry friction where the model tells it: 0 where it
      does at none, infinite where it does at every speed;
    - ``shown_to``: the same by the smoothed friction of the runs, which can show no more;
    - ``modelled``: whether the model says so of dry friction, or the runs and the smoothed one alone;
    - ``between``: whether it lies between two speeds at which a start at the point sticks;
    - ``perhaps``: whether it may, by runs that are not known.
    """

    lasts: Array
    open: Array
    unstable: Array
    met: Array
    may: Array
    tried: Array
    to: Array
    shown_to: Array
    modelled: Array
    between: Array
    perhaps: Array


def sticking(results: Results, labels: Array, along: int) -> Sticking:
    """What is known of stick-slip, with the :class:`Label` of every run [procedure, axes,
    worlds]; the state is carried ``along`` an axis of that number. A run of which nothing
    is known may have stuck."""
    known = known_runs(results)
    bits = np.where(known, results["response"], 0).astype(int)
    critical, unknown = np.isin(labels, (Label.CRITICAL, Label.STALLED)), labels <= Label.UNKNOWN
    sticks = critical & (bits & STICK_SLIP > 0)
    if SPEED not in results.axes:
        none, free = np.zeros(sticks.shape[1:]), np.zeros(sticks.shape[1:], dtype=bool)
        return Sticking(free, free, free, free, free, ~free, none, none, ~free, free, free)
    alone = sticks & (bits & WHIRL == 0)  # of a collar on the wall it is the friction there
    shape, speeds, place = sticks.shape[1:], np.asarray(results.coords[SPEED], dtype=float), results.axes.index(SPEED)
    speed = np.broadcast_to(along_axis(speeds, place, len(shape)), shape)
    # a way up that sticks again above a free stretch began to anew
    told = [way for way, name in enumerate(results.procedures) if name != "up"]
    is_stuck, is_open = alone[told].any(axis=0), unknown[told].any(axis=0)
    met_to = np.max(np.where(is_stuck, speed, 0.0), axis=place, keepdims=True)
    open_to = np.max(np.where(is_open, speed, 0.0), axis=place, keepdims=True)
    unstable_to, lasts_to, seen_to, is_held = _by_model(results, shape)
    modelled = np.isfinite(lasts_to) | np.isposinf(lasts_to)
    near = np.where(modelled, NEAR, 1.0)  # alone, it is the threshold of all motions
    shown, tried = np.nan_to_num(seen_to, nan=0.0, posinf=np.inf), modelled
    estimate = np.where(modelled, lasts_to, shown)  # at least, where it is known of smoothed friction alone
    is_smoothed = ~modelled & ~np.isnan(seen_to)
    doubted = np.zeros(shape, dtype=bool)
    if is_held:  # a bit that was held at the point, let go and came free; of one that failed it is not known
        same = results.procedures.index("same")
        free, doubted = (~critical & known & (bits == 0))[same] & ~is_smoothed, unknown[same]
        ended = free & (shown >= speed)
        end = _dry_end(ended & (speed > met_to), speed, estimate, shown, place)
        estimate = np.where(free & (speed >= end), 0.0, estimate)
        shown, tried = np.where(ended, 0.0, shown), modelled | free
    to, shown_to = (np.maximum(np.broadcast_to(met_to, shape), part) for part in (estimate, shown))
    met = may = np.zeros(shape, dtype=bool)
    if "up" in results.procedures:
        up, chain = results.procedures.index("up"), chain_of(results)
        begins = chain is not None and chain.begins_before
        met, may = _before(sticks[up], along, begins), _before(unknown[up], along)
    met = met | ((estimate > 0.0) & (speed <= estimate * (1.0 + _SLACK)))  # it may begin below the sweep
    between = perhaps = np.zeros(shape, dtype=bool)
    if "same" in results.procedures:
        same = results.procedures.index("same")
        between, perhaps = _between(alone[same], place), _between(alone[same] | unknown[same], place)
    certain = np.where(doubted, np.broadcast_to(met_to, shape), to)
    lasts = (certain > 0.0) & (speed <= certain * (1.0 + _SLACK))
    return Sticking(
        lasts,
        np.asarray(~lasts & (speed <= open_to)),
        np.asarray(np.nan_to_num(unstable_to, nan=0.0, posinf=np.inf) * near > speed),
        met,
        may,
        tried,
        to,
        shown_to,
        modelled,
        between,
        perhaps,
    )


def _dry_end(ended: Array, speed: Array, lasts_to: Array, shown_to: Array, place: int) -> Array:
    """The speed [rad/s] up to which dry friction may keep stick-slip that ``ended`` at the least such speed with
    smoothed friction: as much higher as its estimates, ``lasts_to`` and ``shown_to``, are; infinite where it ended
    nowhere. Speeds are along the axis at a ``place``."""
    first = np.min(np.where(ended, speed, np.inf), axis=place, keepdims=True)
    more = np.divide(lasts_to, shown_to, out=np.ones_like(lasts_to), where=(shown_to > 0.0) & np.isfinite(lasts_to))
    return np.asarray(first * np.maximum(more, 1.0))


def joined(sticking: Array, bits: Array, unknown: Array) -> Array:
    """Those of the ``sticking`` points of a row along the speed, in which runs have these ``bits``, that tell how far
    stick-slip lasts: where a collar that whirls makes the bit stick and slip above a speed at which it does not, that
    is the friction at the wall, and a limit of its own. What is ``unknown`` joins what lies on both sides."""
    found, is_joined = np.zeros(len(sticking), dtype=bool), True
    for place in range(len(sticking)):
        if sticking[place]:
            is_joined = is_joined or not bits[place] & WHIRL
            found[place] = is_joined
        elif not unknown[place]:
            is_joined = False
    return found


def _before(runs: Array, along: int, begins: bool = False) -> Array:
    """Where a run is one of these ``runs`` [axes, worlds] before a point along an axis, or
    where the chain ``begins`` in one."""
    found = np.logical_or.accumulate(np.moveaxis(runs, along, 0), axis=0)
    first = np.full_like(found[:1], begins)
    return np.moveaxis(np.concatenate([first, found[:-1] | first]), 0, along)


def _between(runs: Array, along: int) -> Array:
    """Where one of these ``runs`` [axes, worlds] is before a point along an axis, and one
    behind it."""
    return _before(runs, along) & np.flip(_before(np.flip(runs, along), along), along)


def from_rest(results: Results) -> bool:
    """Whether the runs that were started at the points had the bit at rest."""
    found = json.loads(results.attrs.get(STICKS_TO, "null"))
    return found is not None and bool(found["from_rest"] and "same" in results.procedures)


def attributes_at(results: Results, dimension: str, place: int) -> Attributes:
    """The root attributes of the results at one ``place`` along a ``dimension`` of samples or
    starts: of the speeds that the model tells those of this place."""
    found = json.loads(results.attrs.get(STICKS_TO, "null"))
    if found is None or dimension not in found["over"]:
        return results.attrs
    lengths, along = [len(results.coords[name]) for name in found["over"]], found["over"].index(dimension)
    for name in {*ENDS} & found.keys():
        found[name] = np.array(found[name], dtype=object).reshape(lengths).take([place], along).ravel().tolist()
    found["over"].remove(dimension)
    return {**results.attrs, STICKS_TO: json_text(found)}


def _by_model(results: Results, shape: tuple[int, ...]) -> tuple[Array, Array, Array, bool]:
    """The speeds below which steady drilling is unstable, up to which stick-slip may
    last, and up to which smoothed friction shows it, by the model, over the grid, NaN where it does not say; and
    whether the starts at the points are those of a bit that is held, which tells of other starts too."""
    found = json.loads(results.attrs.get(STICKS_TO, "null"))
    if found is None:
        unknown = np.full(shape, np.nan)
        return unknown, unknown, unknown, False
    over = [len(results.coords[name]) if name in found["over"] else 1 for name in results.grid if name != "procedure"]

    def array(name: str) -> Array:
        values = [np.nan if one is None else np.inf if one == EVERY else one for one in found[name]]
        return np.broadcast_to(np.asarray(values, dtype=float).reshape(over), shape)

    unstable_to, lasts_to, shown_to = (array(name if name in found else "lasts_to") for name in ENDS)
    return unstable_to, lasts_to, shown_to, from_rest(results) and not found.get("by_start")


def ends_by_smoothed_alone(results: Results) -> bool:
    """Whether the model tells somewhere to which speed stick-slip lasts by smoothed friction, and not by dry one."""
    found = json.loads(results.attrs.get(STICKS_TO, "null")) or {}
    pairs = zip(found.get("lasts_to", ()), found.get("shown_to", ()), strict=False)
    return any(lasts is None and shown is not None for lasts, shown in pairs)


def sticks_past(bits: Array, inside: Array) -> Array:
    """Whether ways up with these responses, [..., speed], pass all speeds ``inside`` a range in stick-slip, and without
    whirl: the collar is not driven to the wall there, and how the string begins below decides on what follows."""
    passed = bits[..., inside]
    return np.asarray(inside.any() & np.all((passed & STICK_SLIP > 0) & (passed & WHIRL == 0), axis=-1))
