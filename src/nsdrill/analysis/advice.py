"""The answer to "at which weight and speed may I run?": where to run, how one comes there,
what to stay within and never to exceed, how a vibration ends, and what is seen at the
surface; or, where no setting is allowed, the best hint and what stops it.

All numbers are in SI. The words are those of :mod:`nsdrill.plot.answer`.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from enum import StrEnum

import numpy as np

from nsdrill.analysis.graded import Graded, lasting
from nsdrill.analysis.histories import Grade, Label, is_allowed
from nsdrill.analysis.planes import Cell, mean_known, planes_of
from nsdrill.analysis.probability import interval, known_runs
from nsdrill.analysis.room import Kind as Room
from nsdrill.analysis.room import choose, room, stretch
from nsdrill.analysis.trials import Trials
from nsdrill.analysis.trials import data_of as data_of_trials
from nsdrill.data import Answer, Array
from nsdrill.models.leaves import in_words
from nsdrill.models.responses import RESPONSES, STICK_SLIP, WHIRL

RATE = "rate_of_penetration"


class Kind(StrEnum):
    """What the answer is."""

    ANY_HISTORY = "any_history"
    FROM_BELOW = "from_below"
    QUICK_START = "quick_start"
    HINT = "hint"
    NOTHING = "nothing"
    UNKNOWN = "unknown"


@dataclass(frozen=True)
class Border:
    """What lies beyond an end of a stretch of allowed points: the first ``value`` that is
    not in it, None where the sweep ends; its ``grade``; the ``responses`` there, on the
    way in, or of a point that is free from below on the way down."""

    value: float | None
    grade: Grade | None = None
    responses: tuple[str, ...] = ()


@dataclass(frozen=True)
class Stretch:
    """Allowed points side by side along an axis, from ``low`` to ``high``, and what lies
    beyond."""

    low: float
    high: float
    below: Border
    above: Border


class Recovery(StrEnum):
    """What becomes of a vibration when the axis is lowered."""

    ENDS = "ends"
    LASTS = "lasts"
    NOT_MET = "not_met"
    STOPS = "stops"
    """Trials alone tell it: of a knock at the point it comes free again."""


@dataclass(frozen=True)
class Recover:
    """How a vibration that was met above the stretch ends: its ``outcome``; ``at`` which
    value the way down was clear again; the ``responses`` that were met; and above which
    speed [rad/s] the wall holds a collar, ``lasts_above``, None where it does not."""

    outcome: Recovery
    at: float | None = None
    responses: tuple[str, ...] = ()
    lasts_above: float | None = None


@dataclass(frozen=True)
class WayIn:
    """How the point was reached: the weight is set at ``begins`` [rad/s], and the speed
    is raised, ``through`` stick-slip up to that speed [rad/s]. ``wall`` are the speeds
    [rad/s] between which a collar off bottom reaches the wall; ``passing_rate``
    [rad/s^2] is the rate at which it does not."""

    begins: float | None = None
    through: float | None = None
    wall: tuple[float, float] | None = None
    passing_rate: float | None = None
    first_speed_touches: float | None = None


@dataclass(frozen=True)
class Surface:
    """What is seen at the surface: the mean torque [N m] at the point; least and greatest
    torque in the stick-slip nearest below it, and its period [s], at least; and the
    mean torque and the r.m.s. lateral acceleration [m/s^2] of a whirl at the point.
    None where that was not met."""

    torque: float | None = None
    sticking: tuple[float, float] | None = None
    period: float | None = None
    whirling: float | None = None
    acceleration: float | None = None


@dataclass(frozen=True)
class Share:
    """The share of the known samples in which the point is allowed, of ``any_history`` in
    which it is safe whatever came before, with 95 % intervals; of how many samples, and
    how many failed."""

    probability: float
    low: float
    high: float
    any_history: float
    of: int
    failed: int


@dataclass(frozen=True)
class Advice:
    """The answer. ``point`` has the values of the axes, of a hint or of a setting; ``at``
    that of a third axis, a word or a number; ``depths`` the depths from which and to
    which one setting holds, and the first at which it does not."""

    kind: Kind
    grade: Grade | None = None
    room: float | None = None
    narrow: bool = False
    point: dict[str, float] = field(default_factory=dict)
    at: dict[str, float | str] = field(default_factory=dict)
    stay_within: dict[str, Stretch] = field(default_factory=dict)
    never_exceed: float | None = None
    known_to: float | None = None
    way_in: WayIn | None = None
    recover: Recover | None = None
    surface: Surface | None = None
    share: Share | None = None
    depths: tuple[float, float, float | None] | None = None
    stops: tuple[tuple[str, float, float], ...] = ()
    """Where nothing is allowed: the responses on the way in, from and to which value."""
    yields: dict[str, float] = field(default_factory=dict)
    cell: Cell | None = None
    """Where the point is in the maps."""
    trials: Trials | None = None


def advise(maps: Graded) -> Advice:
    """The answer of a sweep."""
    if not np.any(maps.grades != Grade.UNKNOWN):
        return Advice(Kind.UNKNOWN)
    if "depth" in (maps.y, maps.third) and (over := _over_depths(maps)) is not None:
        return over
    rates = _yields(maps, RATE)
    planes = []
    for number in range(len(maps.allowed)):
        x, y = ((axis, maps.values(axis)) for axis in (maps.x, maps.y))
        place, how, is_better = choose(maps.allowed[number], maps.better[number], y, x, rates[number])  # type: ignore[arg-type]
        planes.append((number, place, how, is_better, int(maps.allowed[number].sum())))
    order = list(Room)[::-1]
    number, place, how, is_better, _ = max(planes, key=lambda one: (order.index(one[2]), one[4]))
    if place is None:
        return _nothing(maps, rates)
    return _at_point(maps, (number, *place), how, is_better)


def _at_point(maps: Graded, cell: Cell, how: Room, is_better: bool) -> Advice:
    """The answer that names an allowed point."""
    number, row, column = cell
    field_ = maps.better if is_better else maps.allowed
    grade = Grade(int(maps.grade[cell]))
    passed = any(one["from"] is not None for one in lasting(maps.results))
    kind = Kind.HINT
    if how == Room.RUN and not passed:
        kind = {Grade.ANY_HISTORY: Kind.ANY_HISTORY, Grade.FROM_START: Kind.QUICK_START}.get(grade, Kind.FROM_BELOW)
    along_x = _stretch(maps, field_, cell, 2)
    ends = {maps.x: along_x}
    if maps.y and maps.y != "depth":
        ends[maps.y] = _stretch(maps, field_, cell, 1)
    # the field of what is allowed may go on beyond that of any history
    _, last = stretch(maps.allowed[number, row], column)
    values = maps.values(maps.x)
    is_end = last + 1 == len(values)
    inside = room(maps.allowed[number], (maps.y, maps.values(maps.y)), (maps.x, values))
    return Advice(
        kind,
        grade,
        room=float(inside[row, column]),
        narrow=how != Room.RUN,
        point=_values(maps, cell),
        at=_third(maps, number),
        stay_within=ends,
        never_exceed=None if is_end else float(values[last]),
        known_to=float(values[-1]) if is_end else None,
        way_in=_way_in(maps, cell),
        recover=_recover(maps, cell, last),
        surface=_surface(maps, cell),
        share=_share(maps, cell),
        yields=_all_yields(maps, cell),
        cell=cell,
    )


def _values(maps: Graded, cell: Cell) -> dict[str, float]:
    return {axis: float(maps.values(axis)[place]) for axis, place in ((maps.x, cell[2]), (maps.y, cell[1])) if axis}


def _third(maps: Graded, number: int) -> dict[str, float | str]:
    return dict(in_words({maps.third: float(maps.values(maps.third)[number])})) if maps.third else {}


def _stretch(maps: Graded, chosen: Array, cell: Cell, place: int) -> Stretch:
    """The stretch of ``chosen`` points around a cell along the axis at this place."""
    values = maps.values((maps.third, maps.y, maps.x)[place])
    first, last = stretch(np.moveaxis(chosen, place, -1)[tuple(np.delete(cell, place))], cell[place])

    def border(index: int) -> Border:
        if not 0 <= index < len(values):
            return Border(None)
        there = tuple(index if axis == place else at for axis, at in enumerate(cell))
        grade = Grade(int(maps.grade[there]))
        bits = int(maps.bits_on(maps.way_in)[there])
        if not bits and grade not in (Grade.UNKNOWN, Grade.ANY_HISTORY):
            bits = int(np.bitwise_or.reduce([maps.bits_on(way)[there] for way in maps.ways]))
        return Border(float(values[index]), grade, names_of(bits))

    return Stretch(float(values[first]), float(values[last]), border(first - 1), border(last + 1))


def names_of(bits: int) -> tuple[str, ...]:
    """The names of the responses with these bits."""
    return tuple(name for name, one in RESPONSES.items() if bits & one.bit)


def _line(maps: Graded, array: Array, cell: Cell) -> Array:
    """``array`` [third, y, x, ...] along x through a cell."""
    return np.asarray(array[cell[0], cell[1]])


def _recover(maps: Graded, cell: Cell, last: int) -> Recover | None:
    """What the way down says of a vibration that was met above place ``last``; None where
    no way down was run along this axis."""
    speeds = [one["lasts"][0] for one in lasting(maps.results) if one["name"] == "wall_speed" and one["lasts"]]
    above = float(speeds[0]) if speeds else None
    if "down" not in maps.ways or maps.along != maps.x or maps.confidence is not None:
        return None
    down = maps.ways.index("down")
    labels = _line(maps, maps.labels[down], cell)[:, 0]
    bits = _line(maps, maps.bits[down], cell)[:, 0]
    met = np.flatnonzero(np.isin(labels, (Label.CRITICAL, Label.STALLED)))
    met = met[met > last]
    if not met.size:
        return Recover(Recovery.NOT_MET, lasts_above=above)
    # the block of the way down that begins highest, and the first clear point below it
    highest = int(met[-1])
    clear = np.flatnonzero(labels[:highest] == Label.CLEAR)
    if not clear.size:
        here = int(bits[cell[2]]) or int(np.bitwise_or.reduce(bits[met]))
        return Recover(Recovery.LASTS, responses=names_of(here), lasts_above=above)
    at = int(clear[-1])
    responses = names_of(int(np.bitwise_or.reduce(bits[at + 1 : highest + 1])))
    return Recover(Recovery.ENDS, float(maps.values(maps.x)[at]), responses, above)


def _way_in(maps: Graded, cell: Cell) -> WayIn | None:
    """How the point was reached on the way up."""
    if "up" not in maps.ways or maps.along != maps.x or maps.x != "rotary_speed":
        return None
    speeds, up = maps.values(maps.x), maps.bits_on("up")
    sticking = np.flatnonzero(_line(maps, up, cell)[: cell[2]] & STICK_SLIP)
    wall = next((one for one in lasting(maps.results) if one["name"] == "wall_speed"), None)
    touches = None
    if maps.y == "wob" and cell[1] > 0:
        lightest = np.flatnonzero(up[cell[0], 0, : cell[2]] & WHIRL)
        touches = float(speeds[lightest[0]]) if lightest.size else None
    reach = wall["range"] if wall else None
    return WayIn(
        begins=float(speeds[0]),
        through=float(speeds[sticking[-1]]) if sticking.size else None,
        wall=(float(reach["from"]), float(reach["to"])) if reach else None,
        passing_rate=wall.get("passing_rate") if wall else None,
        first_speed_touches=touches,
    )


def _surface(maps: Graded, cell: Cell) -> Surface | None:
    """What is seen at the surface at the point and in the motions near it."""
    variables = maps.results.variables
    if "surface_torque_mean" not in variables or maps.confidence is not None or "start" in maps.results.coords:
        return None
    way = maps.way_in

    def of(name: str, which: str) -> Array:
        part = variables[name][maps.ways.index(which)]
        return np.asarray(planes_of(maps.results, maps.x, maps.y, maps.third)(part[None])[..., 0])

    sticking = period = whirling = acceleration = None
    below = np.flatnonzero(_line(maps, maps.bits_on(way), cell)[: cell[2]] & STICK_SLIP)
    if below.size and maps.x == "rotary_speed":
        near = (*cell[:2], int(below[-1]))
        sticking = tuple(float(of(f"surface_torque_{end}", way)[near]) for end in ("min", "max"))
        if "stick_slip_period" in variables:
            found = float(of("stick_slip_period", way)[near])
            period = found if np.isfinite(found) else None
    if "down" in maps.ways and int(maps.bits_on("down")[cell]) & WHIRL:
        whirling = float(of("surface_torque_mean", "down")[cell])
        acceleration = float(of("lateral_acceleration_rms", "down")[cell])
    torque = float(of("surface_torque_mean", way)[cell])
    return Surface(torque, sticking, period, whirling, acceleration)  # type: ignore[arg-type]


def _share(maps: Graded, cell: Cell) -> Share | None:
    """The probability of a point of results with samples, or the share of its starts."""
    if maps.share is not None:
        labels = maps.labels[0][cell]
        count, total = int((labels >= Label.TOUCHING).sum()), len(labels)
        failed = int((labels == Label.UNKNOWN).sum())
        low, high = interval(np.asarray(count), total, failed)
        return Share(float(maps.share[cell]), float(low), float(high), float(maps.share[cell]), total, failed)
    if maps.confidence is None:
        return None
    probability, lower, upper = (float(part[cell]) for part in maps.probability())
    any_history = float(maps.probability(any_history=True)[0][cell])
    grades = maps.grades[cell]
    return Share(probability, lower, upper, any_history, len(grades), int((grades == Grade.UNKNOWN).sum()))


def _yields(maps: Graded, name: str) -> Array:
    """A yield at every point, [third, y, x]: the mean of the runs on the way in; NaN where
    it is not known."""
    if name not in maps.results.variables:
        return np.full(maps.allowed.shape, np.nan)
    values = np.where(known_runs(maps.results), maps.results[name], np.nan)[maps.ways.index(maps.way_in)]
    return mean_known(planes_of(maps.results, maps.x, maps.y, maps.third)(values[None]))


def _all_yields(maps: Graded, cell: Cell) -> dict[str, float]:
    found = {name: float(_yields(maps, name)[cell]) for name in (RATE, "mechanical_specific_energy")}
    return {name: value for name, value in found.items() if np.isfinite(value)}


def _over_depths(maps: Graded) -> Advice | None:
    """One setting for all depths: depth is none, so what is named holds from the first
    depth down to as deep as any setting does, with the most room at the tightest depth.
    None where no setting holds at the first depth."""
    depth_first = maps.allowed if maps.third == "depth" else np.moveaxis(maps.allowed, 1, 0)
    depths = maps.values("depth")
    # [depth, y or 1, x]
    reach = np.logical_and.accumulate(depth_first, axis=0).sum(axis=0)
    deepest = int(reach.max(initial=0))
    if not deepest:
        return None
    holds = reach == deepest
    rooms = np.min(
        [
            room(level, (maps.y if maps.third == "depth" else None, _rows(maps, level)), (maps.x, maps.values(maps.x)))
            for level in depth_first[:deepest]
        ],
        axis=0,
    )
    row, column = np.unravel_index(int(np.argmax(np.where(holds, rooms, -np.inf))), holds.shape)
    tight = deepest - 1
    cell = (tight, int(row), int(column)) if maps.third == "depth" else (0, tight, int(column))
    how = Room.RUN if rooms[row, column] >= 1.0 else Room.NARROW
    found = _at_point(maps, cell, how, False)
    ends = (float(depths[0]), float(depths[tight]), float(depths[deepest]) if deepest < len(depths) else None)
    point = {axis: value for axis, value in found.point.items() if axis != "depth"}
    values = {**found.__dict__, "point": point, "depths": ends, "at": {}, "room": float(rooms[row, column])}
    return Advice(**values)


def _rows(maps: Graded, level: Array) -> Array:
    return maps.values(maps.y) if maps.third == "depth" else np.zeros(len(level))


def _nothing(maps: Graded, rates: Array) -> Advice:
    """The answer where no point is allowed: the best hint, and what stops it."""
    cell, grade = None, None
    if maps.confidence is not None:
        value = is_allowed(maps.grades).mean(axis=-1)
        if value.max() > 0.0:
            fast = np.nan_to_num(rates, nan=0.0)
            value = value + 1e-6 * fast / (fast.max() or 1.0)
            cell = _greatest(value)
    elif np.any(above := maps.grade == Grade.ONLY_FROM_ABOVE):
        value = np.stack([room(one, (maps.y, maps.values(maps.y)), (maps.x, maps.values(maps.x))) for one in above])
        cell, grade = _greatest(value), Grade.ONLY_FROM_ABOVE
    found = Advice(Kind.NOTHING, grade, stops=_stops(maps))
    if cell is None:
        return found
    values = {
        **found.__dict__,
        "point": _values(maps, cell),
        "at": _third(maps, cell[0]),
        "share": _share(maps, cell),
        "yields": _all_yields(maps, cell),
        "cell": cell,
    }
    return Advice(**values)


def _greatest(values: Array) -> Cell:
    third, row, column = np.unravel_index(int(np.argmax(values)), values.shape)
    return int(third), int(row), int(column)


def _stops(maps: Graded) -> tuple[tuple[str, float, float], ...]:
    """The responses on the way in, and from and to which value of x they occur."""
    bits, values = maps.bits_on(maps.way_in), maps.values(maps.x)
    found = []
    for name, one in RESPONSES.items():
        at = np.flatnonzero((bits & one.bit > 0).any(axis=(0, 1)))
        if at.size:
            found.append((name, float(values[at[0]]), float(values[at[-1]])))
    return tuple(found)


def data_of(advice: Advice, along: str) -> Answer:
    """The answer of a window whose first axis is ``along`` as plain data: values stand
    under the name of their axis, or beside it, so that they can be given in any
    units."""
    found: Answer = asdict(advice)
    found.pop("cell")
    found |= data_of_trials(advice.trials or Trials(), along)
    found["kind"] = str(advice.kind)
    found["grade"] = _name(advice.grade)
    found["stay_within"] = {
        axis: {"from": one.low, "to": one.high, "below": _border(axis, one.below), "above": _border(axis, one.above)}
        for axis, one in advice.stay_within.items()
    }
    for key in ("never_exceed", "known_to"):
        found[key] = None if found[key] is None else {along: found[key]}
    if (way := advice.way_in) is not None:
        speeds = {"begins": way.begins, "through": way.through, "first_speed_touches": way.first_speed_touches}
        found["way_in"] = {
            **{key: None if value is None else {"rotary_speed": value} for key, value in speeds.items()},
            "wall": way.wall and {"axis": "rotary_speed", "from": way.wall[0], "to": way.wall[1]},
            "passing_rate": way.passing_rate,
        }
    if (end := advice.recover) is not None:
        found["recover"] = {
            "outcome": str(end.outcome),
            "at": None if end.at is None else {along: end.at},
            "responses": list(end.responses),
            "lasts_above": None if end.lasts_above is None else {"rotary_speed": end.lasts_above},
        }
    if (depths := advice.depths) is not None:
        found["depths"] = {"axis": "depth", "from": depths[0], "to": depths[1], "beyond": {"depth": depths[2]}}
    found["stops"] = [{"response": name, "axis": along, "from": low, "to": high} for name, low, high in advice.stops]
    return found


def _name(grade: Grade | None) -> str | None:
    return None if grade is None else grade.name.lower()


def _border(axis: str, border: Border) -> Answer:
    value = {} if border.value is None else {axis: border.value}
    return {"at": value or None, "grade": _name(border.grade), "responses": list(border.responses)}
