"""The answer to "at which weight and speed may I run?": where to run, how one comes there,
what to stay within and never to exceed, how a vibration ends, and what is seen at the
surface; or, where no setting is allowed, the best hint and what stops it.

All numbers are in SI. The words are those of :mod:`nsdrill.words.answer`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, field, replace
from enum import StrEnum
from itertools import product

import numpy as np

from nsdrill.analysis.basis import Basis, basis_of, data_of_basis
from nsdrill.analysis.chains import SLACK, Chain, chain_of
from nsdrill.analysis.graded import Graded
from nsdrill.analysis.grades import lasting, lasts_above
from nsdrill.analysis.histories import Grade, Label, is_allowed
from nsdrill.analysis.off_bottom import drag_off_bottom, torsional_period
from nsdrill.analysis.planes import Cell, along_axis, planes_of
from nsdrill.analysis.probability import independent, interval
from nsdrill.analysis.room import ENOUGH, choose, nearest_outside, rectangle, room, stretch, tolerance
from nsdrill.analysis.room import Kind as Room
from nsdrill.analysis.sticking import from_rest
from nsdrill.analysis.trials import Trial, Trials
from nsdrill.analysis.trials import data_of as data_of_trials
from nsdrill.analysis.unmodelled import first_unmodelled
from nsdrill.analysis.untried import (
    Jump,
    between_gaps,
    data_of_jump,
    first_on_the_way,
    gaps_of,
    jumps_of,
    past,
    stuck_past,
    without_jumps,
)
from nsdrill.analysis.vibrating import Vibration
from nsdrill.data import Answer, Array
from nsdrill.models.choices import in_words, words_along
from nsdrill.models.in_force import in_force
from nsdrill.models.registry import responses_in
from nsdrill.models.responses import BIT_BOUNCE, RESPONSES, STALLED, STICK_SLIP, WHIRL, Response
from nsdrill.records import dataclass

RATE = "rate_of_penetration"
FASTEST = 10.0 * np.pi / 30  # rad/s^2, 10 rpm/s: what a top drive or a rotary table does
BOUNDED = 2.0 * FASTEST  # a bound of the rate above this is none to any drive
CLEAR = 2.0  # tolerances above the wall's speeds, to which the bit may swing: a collar that passed them swings still
BORDERLINE, STICKS_ON = "borderline", "sticks_on"  # grades, as data have them
UNSTABLE = "unstable"  # of the second: where that alone bars a point
NEAR = 0.3  # of the speed: what whirl shows farther away is not what it shows here
QUICK = 0.5  # of the period of torsion: a bit that stops as often does not swing with it
MILD = 0.25  # of the greatest torque at the surface: less of a swing is none of stick-slip
STEADY = 0.2  # of the mean torque: one that swings by more is not steady


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
    beside: tuple[str, float] | None = None
    """Of a rectangle: the other axis and its value there, where that is not the point's."""
    sticks_to: float | None = None
    """Where stick-slip may last: up to which speed [rad/s], infinite at every one."""
    is_dry: bool = False
    """Whether it may by dry friction alone: the smoothed friction of the runs cannot show it there."""
    outside: bool = False
    """Whether one does not drill there; it has a grade where it is not free, too."""
    by_trial: bool = False
    """Whether a trial met the responses, and the map did not."""
    is_jumped: bool = False
    """Whether it is allowed, but a step up to there may jump across a vibration."""
    is_gap: bool = False
    """Whether it is allowed, but nothing was run between, in a gap of the values."""
    is_started: bool = False
    """Whether the responses are those of the start at the point, and none of the ways that are
    carried has any."""
    is_unsettled: bool = False
    """Whether it is free, but a motion was still changing there."""
    is_on_wall: bool = False
    """Whether it is allowed, but off bottom the collar reaches the wall there, on the way in and when picked up."""
    is_partly_known: bool = False
    """Whether some runs of it are known, of a point of which others are not, or runs elsewhere leave open
    whether it is free; the responses are those of the known ones."""
    is_met_on_way_in: bool = False
    """Of such a point whether the responses are those on the way in."""
    is_unmodelled: bool = False
    """Whether it is not known as the model leaves out a motion that the string has there."""
    not_passed: str = ""
    """Of an allowed point above a critical speed to which nothing was brought up through that: what it is."""
    free_from: tuple[int, int] | None = None
    """Of a point that is free from some of many starts only: from how many, of how many."""


@dataclass(frozen=True)
class Limit:
    """The last ``value`` of a setting that is allowed, whatever the other one within what to
    stay within, and what lies ``beyond``."""

    value: float
    beyond: Border


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
    LEFT_OUT = "left_out"
    """What was met above is not in this part of the chain."""
    STOPS = "stops"
    """Trials alone tell it: of a knock at the point it comes free again."""


@dataclass(frozen=True)
class Recover:
    """How a vibration that was met above the stretch ends: its ``outcome``; ``at`` which
    value the way down was clear again; the ``responses`` that were met; and above which
    speed [rad/s] the wall may hold a collar, ``lasts_above``, None where it cannot."""

    outcome: Recovery
    at: float | None = None
    responses: tuple[str, ...] = ()
    lasts_above: float | None = None
    axis: str = "rotary_speed"
    """Along which the state was carried."""
    then: tuple[str, ...] = ()
    """Other responses that trials met where it ended, or those that ``may`` begin there."""
    may: bool = False
    """Whether no run met these there after the vibration had ended, but the way up did."""
    bound: Border | None = None
    """The nearest value below ``at`` at which what was lowered vibrates again, or of which nothing is known: not to be
    lowered to. None where no run that was lowered does: what only vibrates when brought up bounds no lowering."""
    free_to: float | None = None
    """Down to which value all runs that were lowered are free, from ``at`` on; below it lies the ``bound``, or
    nothing was run. None of what trials alone show, which say nothing of what lies below ``at``."""
    raised: tuple[str, ...] = ()
    """The responses of the runs that were brought up to these values: there one does not start up."""
    elsewhere: tuple[str, ...] = ()
    """Of a vibration that was not met above the stretch: the responses of all other runs."""
    by_trial: bool = False
    """Whether a trial alone shows that it ends there, of what a knock started, and no way down of the map."""
    only_at: tuple[str, float] | None = None
    """The other axis and its value at the point, where the way down is not clear ``at`` the same value everywhere
    else within the limits."""

    @property
    def held_to(self) -> float | None:
        """To how much ``at`` is held, where below it there is no room for that; else None."""
        if self.at is None:
            return None
        held = float(tolerance(self.axis, np.array([0.0, self.at]))[1])
        return None if self.at - (self.at if self.free_to is None else self.free_to) >= held * ENOUGH else held


class First(StrEnum):
    """What is set first on the way in."""

    SPEED = "speed"
    WEIGHT = "weight"
    NONE = "none"
    """With the weight on it vibrates, and off bottom no drive is fast enough."""


@dataclass(frozen=True)
class WayIn:
    """How one comes to the point, ``first`` the speed, off bottom, or first the weight, or
    no way that is known. ``wall`` are the speeds [rad/s] between which a collar off bottom
    reaches the wall; ``passing_rate`` [rad/s^2] is the estimate of the rate at which it
    does not, and ``rate`` that from which on to pass: at least twice the estimate, as the bit
    lags behind the drive, or what trials showed to be free; None where none is known. After a stop at
    the point the bit swings below its speed: ``swing_rate`` is the greatest rate at which it stays
    :data:`CLEAR` of the wall's speeds, None where no drive is as fast.

    As the map was run, the weight is set at ``begins`` [rad/s], and the speed is raised,
    ``through`` stick-slip up to that speed [rad/s]; at the lightest weight
    ``first_speed_touches`` the wall [rad/s]. Where the state was carried along the weight,
    that is raised ``from_weight`` [N]."""

    first: First = First.SPEED
    begins: float | None = None
    through: float | None = None
    wall: tuple[float, float] | None = None
    passing_rate: float | None = None
    rate: float | None = None
    first_speed_touches: float | None = None
    from_weight: float | None = None
    crossed: tuple[tuple[str, float, float], ...] = ()
    """The responses that the way up meets with the weight on before it is free at the point, from
    and to which value of the axis along which the state was carried; of the speed without
    stick-slip, which has :attr:`through`."""
    at_once: bool = False
    """Whether the weight is set at once, as with it raised from step to step it vibrates."""
    most: float | None = None
    """The greatest rate [rad/s^2] at which trials ended free; None without trials."""
    is_shaken: bool = False
    """Whether runs of the map bounced, over lobes or as the wall holds a collar, which may begin when the weight is
    set."""
    swing_rate: float | None = None
    crosses: bool = False
    """Whether the point lies above where the wall range begins, so that it is passed."""

    @property
    def can_pass(self) -> bool:
        """Whether a drive passes the wall range off bottom fast enough, and stops clear of it."""
        return self.is_fast_enough and not self.is_too_near

    @property
    def is_fast_enough(self) -> bool:
        """Whether a drive passes the wall range off bottom fast enough, wherever it stops."""
        return self.wall is not None and self.rate is not None and self.rate <= FASTEST

    @property
    def is_too_near(self) -> bool:
        """Whether the bit comes back to the wall range after a stop at the point, at any rate at which it passes."""
        return self.swing_rate is not None and self.swing_rate < (self.rate or 0.0)

    @property
    def no_stop_from(self) -> float | None:
        """From where on [rad/s] the speed is raised off bottom without a stop: a tolerance below the wall's."""
        if self.wall is None:
            return None
        return self.wall[0] - float(tolerance("rotary_speed", np.array([self.wall[0], self.wall[1]]))[0])


@dataclass(frozen=True)
class Surface:
    """What is seen at the surface: the mean torque [N m] at the point, with
    its ``swing`` where it swings by more than :data:`STEADY` of it; least and greatest
    torque in the stick-slip nearest below it, and its period [s], at least; and the
    mean torque and the r.m.s. lateral acceleration [m/s^2] of a whirl at the point, or of the nearest
    one at its weight, and the least acceleration of those within the limits, else its own. None where
    that was not met."""

    torque: float | None = None
    swing: tuple[float, float] | None = None
    """Least and greatest torque at the point, where it is not steady."""
    sticking: tuple[float, float] | None = None
    period: float | None = None
    least_period: float | None = None
    """Of a stick-slip whose period was not measured, the least that it has [s]: that of the torsional mode."""
    whirling: float | None = None
    acceleration: float | None = None
    least_acceleration: float | None = None
    free_acceleration: float | None = None
    """The r.m.s. lateral acceleration at the point [m/s^2], with nothing that vibrates."""
    alarm_acceleration: float | None = None
    """Above which acceleration [m/s^2] the study calls a whirl severe, whatever the runs show."""
    off_bottom: float | None = None
    """The torque of the string off bottom at the speed of the point [N m], where nothing rubs
    along the hole: all torques here are above that at their speed, as a gauge that is
    zeroed off bottom shows them. None where they are whole."""
    sticking_at: float | None = None
    """The speed [rad/s] at which the stick-slip was met, at the weight of the point."""
    whirling_at: float | None = None
    """The speed [rad/s] at which the whirl was met, at the weight of the point; None: at the point."""
    at: dict[str, float] = field(default_factory=dict)
    """The swept weight and depth of the runs that all this is of, but for the least acceleration: at others it is
    another torque, and another period."""

    @property
    def above_off_bottom(self) -> bool:
        """Whether the torques are above those off bottom."""
        return self.off_bottom is not None


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
class Depths:
    """The depths [m] from the ``first`` to the ``last`` over which one setting holds; the next
    one ``beyond``, at which it does not, and the last one ``above``, at which none
    does."""

    first: float
    last: float
    beyond: float | None = None
    above: float | None = None


@dataclass(frozen=True)
class Unsettled:
    """Of the ``of`` points within which one is to stay at so many ``points`` a motion was
    still changing when it was observed, ``here`` at the setting itself; and at so many
    ``beside`` these, which bound them. ``short`` is whether the runs are short beside the
    slowest motion of the model."""

    points: int
    of: int
    here: bool
    beside: int
    short: bool


@dataclass(frozen=True)
class Split:
    """The ``unknown`` whose ``threshold`` [SI] best divides the samples at the best point: the
    shares of ``samples`` below and above it, two numbers each, in which it is
    allowed."""

    unknown: str
    threshold: float
    below: float
    above: float
    samples: tuple[int, int]


@dataclass(frozen=True)
class Advice:
    """The answer. ``point`` has the values of the axes, of a hint or of a setting; ``at``
    that of a third axis, a word or a number; ``depths`` the depths over which one setting
    holds."""

    kind: Kind
    grade: Grade | None = None
    room: float | None = None
    narrow: bool = False
    point: dict[str, float] = field(default_factory=dict)
    at: dict[str, float | str] = field(default_factory=dict)
    held: dict[str, float] = field(default_factory=dict)
    """The weight and the speed where no axis has them."""
    stay_within: dict[str, Stretch] = field(default_factory=dict)
    """Along each axis; of two together a rectangle of which every point is allowed."""
    lines: dict[str, Stretch] = field(default_factory=dict)
    """The stretch through the point along each axis, with the other as it is there."""
    most: dict[str, Limit] = field(default_factory=dict)
    """The limit of each setting."""
    way_in: WayIn | None = None
    recover: Recover | None = None
    surface: Surface | None = None
    share: Share | None = None
    depths: Depths | None = None
    stops: tuple[tuple[str, float, float], ...] = ()
    """Where nothing is allowed: the responses on the way in, from and to which value."""
    beside: Border | None = None
    """Of a hint without room: the nearest point that is not allowed, along the first axis,
    with the value of the other."""
    near: tuple[tuple[str, float, float], ...] = ()
    """As ``stops``, where points are :data:`STICKS_ON`, :data:`UNSTABLE` or :data:`BORDERLINE`."""
    slowly: tuple[str, ...] = ()
    """Of a quick start: the responses where the point is brought up slowly."""
    slowly_at: dict[str, float] = field(default_factory=dict)
    """Where these are met: the nearest such setting within the limits; empty at the point."""
    slowly_from: dict[str, float] = field(default_factory=dict)
    """At which value of the axis along which the state was carried that begins on the way up there: what is raised
    from below this meets it. Empty where no run tells it."""
    from_first: bool = False
    """Whether that is the first value of the sweep, below which nothing was run."""
    from_rest: bool = False
    """Whether the starts at the points are those of a bit at rest."""
    split: Split | None = None
    severity: int | None = None
    """The greatest severity that the answer allows; None: no response."""
    yields: dict[str, float] = field(default_factory=dict)
    sticks_to: float | None = None
    """The speed [rad/s] up to which stick-slip, once started, may last at the weight of the
    point, infinite where at every one; 0 where it does at none; None where the model does
    not tell it and no run sticks."""
    modelled: bool = False
    """Whether that is of the model, and not of the runs alone."""
    started: tuple[str, ...] = ()
    """Of a point that is free from below: the responses of the start at the point."""
    cell: Cell | None = None
    """Where the point is in the maps."""
    unsettled: Unsettled | None = None
    """Where it rests on runs that were short or had not settled; None where on none."""
    basis: Basis | None = None
    """What it rests on to stay within; None where it names no range."""
    trials: Trials | None = None
    is_unreached: bool = False
    """Whether it is a hint for that alone that no way in is known."""
    jump: Jump | None = None
    """Where the way up to it, in the steps of the sweep, may have jumped across speeds at which
    it vibrates; None where it did not, or where a start at the point shows that it is free."""
    stuck_past: tuple[float, float] | None = None
    """The speeds [rad/s] at which the collar reaches the wall, where the way in passes them in stick-slip: it is not
    driven to the wall then, and whether it is hangs on where the sweep begins. None where it does not."""
    tried_kind: Kind | None = None
    """Of a hint for that alone: what it is where a trial comes through these speeds; else None."""
    vibrates: Vibration | None = None
    """What its own runs do, of a hint that only its severity allows; None where they are free of vibration."""
    settled_only: bool = False
    """Whether points at which a motion was still changing are left out."""
    by_request: bool = False
    """Of a hint: whether it has no room for that alone that one drills within less of the map, which is free beyond."""

    @property
    def is_withdrawn(self) -> bool:
        """Whether trials leave nothing of it: no way in can be relied on, or what has no room vibrates
        after a pick up and tag as well."""
        tried = self.trials
        return tried is not None and (tried.withdraws or (self.narrow and tried.bad_tag is not None))

    @property
    def nearer_limit(self) -> Stretch | None:
        """What to stay within, where its lower limit is met sooner than what bounds the lowering that ends a
        vibration, as where trials draw it in; None where it is not, or where a vibration ends below it, or so near to
        it that the speed could not be held between the two."""
        found = self.recover
        one = self.stay_within.get(found.axis) if found is not None else None
        if found is None or found.at is None or one is None or one.below is None:
            return None
        if found.at - one.low < float(tolerance(found.axis, np.array([0.0, found.at]))[1]) * ENOUGH:
            return None
        held = found.free_to if found.held_to is not None else None
        bound = found.bound.value if found.bound is not None else held
        border = one.below.value
        return None if bound is None or border is None or bound >= border else one

    @property
    def is_without_way_in(self) -> bool:
        """Whether no way in to it can be relied on: trials withdrew it, or none is known. Then nothing is ordered
        beside that: nothing never to exceed, and nothing that ends a vibration and comes in again."""
        way = self.way_in
        return self.is_withdrawn or self.is_unreached or (way is not None and way.first == First.NONE)

    @property
    def is_no_order(self) -> bool:
        """Whether nothing of it is ordered: no way in can be relied on, or its own runs vibrate."""
        return self.is_without_way_in or self.vibrates is not None

    @property
    def is_lax(self) -> bool:
        """Whether it allows vibration, by its severity."""
        return bool(self.severity)

    @property
    def ends(self) -> dict[str, tuple[float, float]]:
        """The ends of what to stay within along each axis, and of the depths over which it holds."""
        found = {axis: (one.low, one.high) for axis, one in self.stay_within.items()}
        return found if self.depths is None else {**found, "depth": (self.depths.first, self.depths.last)}

    def never_exceed(self, axis: str) -> float | None:
        """The last allowed value of a setting; None where the map ends first, or where nothing is ordered."""
        limit = None if self.is_no_order else self.most.get(axis)
        return None if limit is None or limit.beyond.value is None else limit.value


@dataclass(frozen=True)
class Choice:
    """The best point of one map: where it is, how much room it has, within which of the
    fields of allowed points, and whether within the part that is safe after any
    history."""

    cell: Cell
    how: Room
    field: int
    is_better: bool

    def within(self, maps: Graded) -> Array:
        """The points around it within which one may stay, [third, y, x]."""
        return maps.better if self.is_better else maps.fields[self.field]


def best_of(maps: Graded, number: int) -> Choice | None:
    """The point to recommend of one map, or its best hint; None where no point that was run
    is allowed. One to which the sweep did not begin low enough, or no way in is known, is no more
    than a hint: it comes after others with room, and one without a way in after all others."""
    ran = maps.was_run[number]
    reached = ran & ~unreached(maps, number)
    above = begun_above(maps, number)
    tiers = [(reached & ~above, (Room.RUN,)), (reached, tuple(Room))]
    if (beyond := past(maps, gaps_of(maps.results))[number]).any():
        tiers.insert(0, (reached & ~above & ~beyond, (Room.RUN,)))
    for candidates, enough in tiers:
        found = _best_among(maps, number, candidates)
        if found is not None and found.how in enough:
            return found
    return _best_among(maps, number, ran)


def _best_among(maps: Graded, number: int, candidates: Array) -> Choice | None:
    x, y, rate = maps.values(maps.x), maps.values(maps.y), maps.yields(RATE)[number]
    found = []
    above = begun_above(maps, number)  # what was not brought up there gives no room to what was, nor the reverse
    parts = [part & side for part in between_gaps(maps) for side in (~above, above) if side.any()]
    for place, part in product(range(len(maps.fields)), parts):
        chosen = maps.fields[place][number] & part
        better = maps.better[number] & chosen
        at, how, is_better = choose(chosen, better, (maps.y, y), (maps.x, x), rate, candidates)
        if at is not None:
            # within all that is allowed one may not move slowly: of samples, some are free from below
            # there and others from a start
            is_mixed = place == len(maps.fields) - 1 > 0
            how = Room.NARROW if is_mixed and how == Room.RUN else how
            own = next(one for one, field in enumerate(maps.fields) if field[(number, *at)]) if is_mixed else place
            found.append(Choice((number, *at), how, own, is_better))
    return min(found, key=lambda one: list(Room).index(one.how), default=None)


RECOMMENDED = (Kind.ANY_HISTORY, Kind.FROM_BELOW, Kind.QUICK_START)  # the best first


def advise(maps: Graded) -> Advice:
    """The answer of a sweep. Points at which a motion was still changing are left out, where
    the others have a setting that is as good."""
    found = _advise(maps)
    if found.cell is None or not np.any(maps.unsettled & maps.allowed):
        return found
    settled = _advise(replace(maps, settled_only=True))
    return settled if _rank(settled) <= _rank(found) < len(RECOMMENDED) else found


def _rank(advice: Advice) -> int:
    """How good a setting is, the least the best; of a hint more than of any."""
    kind = advice.tried_kind or advice.kind
    return RECOMMENDED.index(kind) if kind in RECOMMENDED else len(RECOMMENDED)


def _advise(maps: Graded) -> Advice:
    if not np.any(maps.grades != Grade.UNKNOWN):
        return Advice(Kind.UNKNOWN)
    if "depth" in (maps.x, maps.y, maps.third) and (over := _over_depths(maps)) is not None:
        return over
    choices = [one for number in range(len(maps.allowed)) if (one := best_of(maps, number)) is not None]
    if not choices:
        return _nothing(maps) if (found := _of_starts(maps)) is None else found
    order, widest = list(Room), maps.allowed.sum(axis=(1, 2))
    return _at_point(
        maps,
        min(choices, key=lambda one: (order.index(one.how), bool(passed_over(maps, one.cell)), -widest[one.cell[0]])),
    )


def _of_starts(maps: Graded) -> Advice | None:
    """The answer of many starts where no point is safe from all of them: what is free from
    some is a hint with its share, the largest first, and has no limits, as nothing around it is
    allowed. A start that failed counts as one that vibrates, so that none makes another point the
    hint which vibrates from more. None where no point is, and of others than starts."""
    if maps.share is None:
        return None
    free = (maps.labels[0] >= Label.TOUCHING).mean(axis=-1)
    some = np.isin(maps.grade, (Grade.FROM_SOME, Grade.UNKNOWN)) & (free > 0.0) & maps.was_run
    if not some.any():
        return None
    deep = np.stack([room(one, (maps.y, maps.values(maps.y)), (maps.x, maps.values(maps.x))) for one in some])
    cell = _greatest(np.where(some, free + 1e-6 * np.minimum(deep, 1e3), -1.0))
    return Advice(
        Kind.HINT,
        Grade.FROM_SOME,
        room=0.0,
        narrow=True,
        point=_values(maps, cell),
        at=_third(maps, cell[0]),
        held={axis: maps.results.held[axis] for axis in ("wob", "rotary_speed") if axis in maps.results.held},
        share=_share(maps, cell),
        stops=_stops(maps),
        near=_near(maps),
        yields=_all_yields(maps, cell),
        sticks_to=sticks_to(maps, cell),
        modelled=bool(maps.modelled is not None and maps.modelled[cell].all()),
        cell=cell,
    )


def _at_point(maps: Graded, choice: Choice, through: Array | None = None, levels: slice | None = None) -> Advice:
    """The answer that names an allowed point; of one ``through`` several depths, the
    ``levels``, what is allowed at all of them."""
    number, row, column = cell = choice.cell
    how, field_ = choice.how, choice.within(maps) if through is None else through
    jumps = jumps_of(maps)
    near = without_jumps(maps, jumps, cell)  # a step that may jump across a vibration bounds what was run
    passed = bool(passed_over(maps, cell))
    above = _all_begun_above(maps)
    if not passed:  # and so does a critical speed through which nothing was brought up
        near = near & ~above
    field_ = field_ & near
    grade = Grade(int(maps.grade[cell]))
    is_started = choice.field > 0
    kind = Kind.HINT
    if how == Room.RUN and not passed:
        kind = Kind.QUICK_START if is_started else Kind.FROM_BELOW
        kind = Kind.ANY_HISTORY if choice.is_better else kind
    settings = [(axis, place) for axis, place in ((maps.x, 2), (maps.y, 1)) if axis and axis != "depth"]
    drills = {"rotary_speed", "wob"} <= set(maps.results.axes)  # others have no weight to set
    way = _way_in(maps, cell) if drills else None
    off_wall = field_ & _above_wall(maps, cell, way)
    lines = {axis: _stretch(maps, off_wall, cell, place, levels) for axis, place in settings}
    ends = lines if len(settings) < 2 else _rectangle(maps, off_wall, cell, levels)
    lines, ends = (_told_of_wall(found, way) for found in (lines, ends))
    # what is allowed goes on beyond what is safe after any history
    reach = (maps.fields[choice.field] if through is None else through) & near
    inside = room(reach[number], (maps.y, maps.values(maps.y)), (maps.x, maps.values(maps.x)))
    if (jumps or above.any()) and how == Room.RUN and inside[row, column] < ENOUGH:
        how, kind = Room.NARROW, Kind.HINT
    by_request = False
    if how != Room.RUN and maps.outside is not None and through is None:
        beyond = (replace(maps, outside=None).fields[choice.field] & near)[number]
        by_request = bool(
            room(beyond, (maps.y, maps.values(maps.y)), (maps.x, maps.values(maps.x)))[row, column] >= ENOUGH
        )
    is_quick, carried = kind == Kind.QUICK_START and "up" in maps.ways, maps.along or maps.x
    slowly, slowly_at, begins = _slowly(maps, cell, ends) if is_quick else (0, {}, None)
    held = from_rest(maps.results)
    # a bit that was at rest shows nothing of a string that is brought there turning
    is_unreached = kind == Kind.QUICK_START and (held or (way is not None and way.first == First.NONE))
    kind = Kind.HINT if is_unreached else kind  # unless trials reach it
    jump = None if kind == Kind.QUICK_START else first_on_the_way(maps, jumps, cell)
    stuck = _stuck_past(maps, cell, way) if kind != Kind.QUICK_START else None
    tried_kind = kind if (jump is not None or stuck is not None) and kind != Kind.HINT else None
    kind = Kind.HINT if tried_kind is not None else kind  # unless trials come through
    return Advice(
        kind,
        grade,
        room=float(inside[row, column]),
        narrow=how != Room.RUN,
        point=_values(maps, cell),
        at=_third(maps, number),
        held={axis: maps.results.held[axis] for axis in ("wob", "rotary_speed") if axis in maps.results.held},
        stay_within=ends,
        lines=lines,
        most=_limits(maps, reach, cell, settings, ends, levels),
        way_in=way,
        recover=_told_beside(maps, cell, _recover(maps, cell), ends),
        surface=_surface(maps, cell, ends, levels),
        share=_share(maps, cell),
        slowly=names_of(int(slowly), responses_in(maps.results.attrs)),
        slowly_at=slowly_at,
        slowly_from={} if begins is None else {carried: float(maps.values(carried)[begins])},
        from_first=begins == 0,
        from_rest=held,
        beside=_beside(maps, reach[number], cell) if how != Room.RUN and maps.y not in (None, "depth") else None,
        yields=_all_yields(maps, cell),
        sticks_to=sticks_to(maps, cell),
        modelled=bool(maps.modelled is not None and maps.modelled[cell].all()),
        started=names_of(0 if is_started else _started(maps, cell), responses_in(maps.results.attrs)),
        cell=cell,
        is_unreached=is_unreached,
        jump=jump,
        stuck_past=stuck,
        tried_kind=tried_kind,
        settled_only=maps.settled_only,
        by_request=by_request,
        basis=basis_of(maps, cell, {axis: (one.low, one.high) for axis, one in ends.items()}),
    )


def _above_wall(maps: Graded, cell: Cell, way: WayIn | None) -> Array:
    """The points, bool [third, y, x], above the speeds that the ``way`` in passes without a stop off bottom, where the
    collar reaches the wall: one that strays there and picks up is on the wall. All, where the cell itself is
    not above them."""
    order, speed = (maps.third, maps.y, maps.x), "rotary_speed"
    if way is None or way.wall is None or not way.crosses or speed not in order:
        return np.ones(maps.grade.shape, dtype=bool)
    place = order.index(speed)
    above = maps.values(speed) > way.wall[1]
    return np.broadcast_to(along_axis(above | (not above[cell[place]]), place), maps.grade.shape)


def _told_of_wall(found: Mapping[str, Stretch], way: WayIn | None) -> dict[str, Stretch]:
    """The stretches as ``found``, with that the wall ends them where a point that is allowed lies below."""
    one = found.get("rotary_speed")
    if one is None or way is None or way.wall is None or not way.crosses or one.below.value is None:
        return dict(found)
    is_allowed = one.below.grade is not None and one.below.grade >= Grade.FROM_START
    if not (is_allowed and one.below.value <= way.wall[1] < one.low):
        return dict(found)
    return {**found, "rotary_speed": replace(one, below=replace(one.below, is_on_wall=True))}


def sticks_to(maps: Graded, cell: Cell, shown: bool = False) -> float | None:
    """The speed [rad/s] up to which stick-slip, once started, may last at the setting of a
    cell, or up to which the friction of the runs can have ``shown`` it: of samples in all but so many as the confidence
    leaves; 0 where it does at none, None where that is not known."""
    ends = maps.shown_to if shown else maps.sticks_to
    if ends is None or maps.modelled is None:
        return None
    found = np.sort(ends[cell])
    to = float(found[-1] if maps.confidence is None else found[int(np.ceil(maps.confidence * len(found))) - 1])
    return None if to == 0.0 and not maps.modelled[cell].all() else to


def _lasts_at(maps: Graded, cell: Cell) -> bool:
    """Whether stick-slip, once started, may last at a cell."""
    return _speed(maps, cell) <= (sticks_to(maps, cell) or 0.0)


def only_unstable(maps: Graded) -> Array:
    """The points, bool [third, y, x], that are barred as steady drilling is unstable there, and not as stick-slip
    that was started elsewhere lasts: what grows by itself may be another vibration."""
    found = np.zeros(maps.grade.shape, dtype=bool)
    if maps.unstable is not None:
        for third, y, x in np.argwhere((maps.grade == Grade.STICKS_ON) & maps.unstable.any(axis=-1)).tolist():
            found[third, y, x] = not _lasts_at(maps, (third, y, x))
    return found


def is_dry(maps: Graded, cell: Cell) -> bool:
    """Whether it lasts there by dry friction alone, as the friction of the runs cannot show it."""
    return _lasts_at(maps, cell) and _speed(maps, cell) > (sticks_to(maps, cell, shown=True) or 0.0)


def _speed(maps: Graded, cell: Cell) -> float:
    """The set speed of a cell [rad/s], infinite where there is none."""
    at = {**maps.results.held, **_values(maps, cell)}
    if maps.third == "rotary_speed":
        at[maps.third] = float(maps.values(maps.third)[cell[0]])
    return at.get("rotary_speed", np.inf)


def _stuck_past(maps: Graded, cell: Cell, way: WayIn | None) -> tuple[float, float] | None:
    """The speeds of :attr:`Advice.stuck_past`; None of a way in on which the speed is set first, off bottom."""
    if way is not None and way.first == First.SPEED:
        return None
    found = stuck_past(maps)
    return (found.low, found.high) if found is not None and found.points[cell] else None


def _slowly(maps: Graded, cell: Cell, ends: Mapping[str, Stretch]) -> tuple[int, dict[str, float], int | None]:
    """The responses of a slow way up to a cell, and of one that is free there those of the
    nearest cell within the ``ends`` that is free from a start only, with its setting; and the
    place at which they begin on that way up, None where no run has them."""

    def bits(there: Cell) -> int:
        met = int(maps.bits_on("up")[there])
        return met or (STICK_SLIP if _lasts_at(maps, there) else 0)

    if (here := bits(cell)) or maps.grade[cell] == Grade.FROM_START:
        return here, {}, _begins(maps, cell)
    rows, columns = (_inside(maps, axis, ends, at) for axis, at in ((maps.y, cell[1]), (maps.x, cell[2])))
    found = [
        (cell[0], row, column)
        for row in rows
        for column in columns
        if maps.grade[cell[0], row, column] == Grade.FROM_START
    ]
    if not found:
        return 0, {}, None
    there = min(found, key=lambda one: max(abs(one[1] - cell[1]), abs(one[2] - cell[2])))
    return bits(there), _values(maps, there), _begins(maps, there)


def _begins(maps: Graded, cell: Cell) -> int | None:
    """The place at which the vibration of a cell on the way up begins on it, along the axis along which the
    state was carried: it goes on from there to the cell. None where no run of the way up has it, and where that axis
    is none of the map."""
    along, order = maps.along or maps.x, (maps.third, maps.y, maps.x)
    if along not in order:
        return None
    place = order.index(along)
    line = np.moveaxis(maps.bits_on("up"), place, -1)[tuple(np.delete(cell, place))][: cell[place] + 1]
    if not line[-1]:
        return None
    quiet = np.flatnonzero(line == 0)
    return int(quiet[-1]) + 1 if quiet.size else 0


def _inside(maps: Graded, axis: str | None, ends: Mapping[str, Stretch], at: int) -> range:
    """The places of an axis within its ``ends``; ``at`` alone of one that has none."""
    if axis is None or axis not in ends:
        return range(at, at + 1)
    first, last = np.searchsorted(maps.values(axis), [ends[axis].low, ends[axis].high])
    return range(int(first), int(last) + 1)


def _limits(
    maps: Graded,
    reach: Array,
    cell: Cell,
    settings: list[tuple[str, int]],
    ends: Mapping[str, Stretch],
    levels: slice | None,
) -> dict[str, Limit]:
    """The last value of each of the ``settings``, axes with their place in a cell, up to which
    the points of ``reach`` [third, y, x] go on from a cell, at all values of the other setting
    within the ``ends``."""
    found = {}
    for axis, along in settings:
        across = 3 - along
        other = (maps.third, maps.y, maps.x)[across]
        places = _inside(maps, other, ends if len(settings) > 1 else {}, cell[across])
        rows = np.moveaxis(reach[cell[0]], along - 1, -1)[places.start : places.stop]
        _, last = stretch(rows.all(axis=0), cell[along])
        if other is None:
            beyond = _border(maps, cell, along, last + 1, levels)
        else:
            beyond = _side(maps, reach, cell, along, last + 1, (places.start, places.stop - 1), levels)
        found[axis] = Limit(float(maps.values(axis)[last]), beyond)
    return found


def without(maps: Graded, advice: Advice, bad: Sequence[Trial]) -> Advice:
    """The ``advice`` at its point, where settings turned out ``bad`` in trials: what to stay
    within leaves them out, and the speeds of excursions after which it vibrated. As it was
    of several depths, or of many starts."""
    if advice.cell is None or advice.depths is not None or maps.share is not None:
        return advice
    maps = replace(maps, settled_only=advice.settled_only)
    choice = best_of(maps, advice.cell[0])
    if choice is None or choice.cell != advice.cell:
        return advice
    known, found = responses_in(maps.results.attrs), {}
    for one in bad:
        speed = one.speed if one.there is None else _first_beyond(maps, advice, one.there)
        if speed is None:
            continue
        at = {"rotary_speed": speed, "wob": one.wob}
        place = [
            here if axis is None or (value := at.get(axis)) is None else int(np.abs(maps.values(axis) - value).argmin())
            for axis, here in zip((maps.third, maps.y, maps.x), advice.cell, strict=True)
        ]
        bits = sum(known[name].bit for name in one.responses)
        found[place[0], place[1], place[2]] = bits or STALLED
    found.pop(advice.cell, None)
    less = maps.without(found)
    inside = room(
        less.fields[choice.field][advice.cell[0]], (maps.y, maps.values(maps.y)), (maps.x, maps.values(maps.x))
    )
    is_narrow = inside[advice.cell[1:]] < ENOUGH and choice.how == Room.RUN
    is_better = choice.is_better and bool(less.better[advice.cell])
    changed = replace(choice, how=Room.NARROW if is_narrow else choice.how, is_better=is_better)
    return replace(_at_point(less, changed), severity=advice.severity, unsettled=advice.unsettled)


def passed_over(maps: Graded, cell: Cell | None) -> list[Answer]:
    """The critical speeds above which the sweep begins, so that a point was not brought up
    through them, and no speed that lies above the point, as where each speed is swept by itself;
    that of stick-slip only at its weights, where the bit did not stick
    on the way up to the point, and where it is not known to which speed stick-slip lasts: where that
    is, no point up to there is allowed, and of one above it makes no difference where the sweep begins."""
    speed = np.inf if cell is None else _speed(maps, cell)

    def concerns(one: Answer) -> bool:
        off = (one.get("off_bottom") or {}).get("from", np.inf)
        if speed < min(one["min"], off):
            return False
        if (weights := one.get("weights")) is None:
            return True
        if cell is None or "up" not in maps.ways or (maps.tried is not None and maps.tried[cell].all()):
            return False
        at: dict[str, float] = {**maps.results.held, **_values(maps, cell)}
        if maps.third:
            at[maps.third] = float(maps.values(maps.third)[cell[0]])
        low, high = weights
        is_near = low <= at.get("wob", low) <= high
        return is_near and not np.any(_line(maps.bits_on("up"), cell)[: cell[2]] & STICK_SLIP)

    return [one for one in lasting(maps.results) if one["from"] is not None and concerns(one)]


def unreached(maps: Graded, number: int) -> Array:
    """To which points of a map, bool [y, x], no way in is known: they are free from a start at the
    point alone, and off bottom no drive passes the speeds at which the collar reaches the wall."""
    found, past_wall = maps.grade[number] == Grade.FROM_START, _past_walls(maps)
    if "up" not in maps.ways or not found.any():
        return np.zeros_like(found)
    speed = "rotary_speed"
    if maps.third == speed:
        speeds = maps.values(speed)[number]
    elif speed in (maps.y, maps.x):
        speeds = along_axis(maps.values(speed), (maps.y, maps.x).index(speed), 2)
    else:
        speeds = np.asarray(maps.results.held.get(speed, 0.0))
    ways = [past_wall(float(speed)) for speed in speeds.ravel()]
    blocked = np.array([way.crosses and not way.can_pass for way in ways]).reshape(speeds.shape)
    return np.asarray(found & blocked)


def _past_walls(maps: Graded) -> Callable[[float], WayIn]:
    """How one comes to a speed [rad/s] off bottom, past the speeds at which the collar
    reaches the wall, if there are any. Where it does so at all greater ones, no rate passes
    them; nor where the bit swings back to them after a stop so near above."""
    off = next((one.get("off_bottom") for one in lasting(maps.results) if one["name"] == "wall_speed"), None)
    if off is None:
        return lambda speed: WayIn()
    low, ends = float(off["from"]), off["to"] is not None

    def past_wall(speed: float) -> WayIn:
        high = float(off["to"]) if ends else max(speed, low)
        beside = CLEAR * float(tolerance("rotary_speed", np.array([high, high]))[0])
        clear = (speed - high - beside) / off["swing"] if ends and speed > low else np.inf
        return WayIn(
            wall=(low, high),
            passing_rate=off["passing_rate"] if ends else None,
            rate=off["sure_rate"] if ends else None,
            swing_rate=max(clear, 0.0) if clear < BOUNDED else None,
            crosses=speed > low,
        )

    return past_wall


def begun_above(maps: Graded, number: int) -> Array:
    """At which points of a map, bool [y, x], the sweep begins above a critical speed, so that
    they were not brought up through it."""
    found = np.zeros(maps.grade.shape[1:], dtype=bool)
    if any(one["from"] is not None for one in lasting(maps.results)):
        for row, column in np.argwhere(maps.allowed[number]):
            found[row, column] = bool(passed_over(maps, (number, int(row), int(column))))
    return found


def _all_begun_above(maps: Graded) -> Array:
    """The same of all maps, [third, y, x]."""
    return np.stack([begun_above(maps, number) for number in range(len(maps.grade))])


def _values(maps: Graded, cell: Cell) -> dict[str, float]:
    return {axis: float(maps.values(axis)[place]) for axis, place in ((maps.x, cell[2]), (maps.y, cell[1])) if axis}


def _third(maps: Graded, number: int) -> dict[str, float | str]:
    return dict(in_words({maps.third: float(maps.values(maps.third)[number])})) if maps.third else {}


def _stretch(maps: Graded, chosen: Array, cell: Cell, place: int, levels: slice | None = None) -> Stretch:
    """The stretch of ``chosen`` points around a cell along the axis at this place; of points
    that are chosen over several depths, the ``levels``, its borders are those of the
    first depth that has one."""
    values = maps.values((maps.third, maps.y, maps.x)[place])
    first, last = stretch(np.moveaxis(chosen, place, -1)[tuple(np.delete(cell, place))], cell[place])
    below, above = (_border(maps, cell, place, index, levels) for index in (first - 1, last + 1))
    return Stretch(float(values[first]), float(values[last]), below, above)


def _not_passed(maps: Graded, there: Cell, seen_from: Cell) -> str:
    """The critical speed above which an allowed point lies, and the point from which it is seen does not; else ""."""
    if not maps.allowed[there] or passed_over(maps, seen_from):
        return ""
    over = passed_over(maps, there)
    return str(over[0]["words"]) if over else ""


def _border(
    maps: Graded, cell: Cell, place: int, index: int, levels: slice | None = None, seen_from: Cell | None = None
) -> Border:
    """What lies at this ``index`` of the axis at a place of a cell, ``seen_from`` another one
    from which it is reached."""
    values = maps.values((maps.third, maps.y, maps.x)[place])
    if not 0 <= index < len(values):
        return Border(None)
    there = tuple(index if axis == place else at for axis, at in enumerate(cell))
    if levels is not None:
        depth = (maps.third, maps.y, maps.x).index("depth")
        over = [(*there[:depth], level, *there[depth + 1 :]) for level in range(levels.start, levels.stop)]
        there = next((one for one in over if not maps.allowed[one]), there)
    if maps.outside is not None and maps.outside[there]:
        return _border_outside(replace(maps, outside=None), cell, place, index, levels, seen_from)
    if maps.is_left_out(there):  # type: ignore[arg-type]
        return Border(float(values[index]), is_unsettled=True)
    grade = Grade(int(maps.grade[there]))
    bits = int(maps.bits_on(maps.way_in)[there])
    is_started = False
    on_way_in = bits != 0
    if not bits and grade != Grade.ANY_HISTORY:
        carried = [int(maps.bits_on(way)[there]) for way in maps.ways if way != "same"]
        bits = int(np.bitwise_or.reduce(np.array(carried, dtype=int), initial=0))
        if not bits and "same" in maps.ways:
            bits, is_started = int(maps.bits_on("same")[there]), True
    is_lasting = grade in (Grade.STICKS_ON, Grade.UNKNOWN) and _lasts_at(maps, there)  # type: ignore[arg-type]
    is_unstable = maps.unstable is not None and bool(maps.unstable[there].any())
    is_lasting = is_lasting or (grade == Grade.STICKS_ON and not is_unstable)
    to = sticks_to(maps, there) if is_lasting else None  # type: ignore[arg-type]
    is_partly = grade == Grade.UNKNOWN and any(np.any(way[there] > Label.UNKNOWN) for way in maps.labels)
    names = names_of(bits, responses_in(maps.results.attrs))
    jumps = jumps_of(maps)
    gaps = tuple(one for one in jumps if one.motion is None)
    is_gap = bool(maps.allowed[there]) and not without_jumps(maps, gaps, seen_from or cell)[there]
    is_near = without_jumps(maps, jumps, seen_from or cell)[there]
    is_jumped = bool(maps.allowed[there]) and grade != Grade.FROM_START and not is_near and not is_gap
    return Border(
        float(values[index]),
        grade,
        names,
        sticks_to=to,
        is_dry=to is not None and is_dry(maps, there),  # type: ignore[arg-type]
        by_trial=there in maps.in_trials,
        not_passed=_not_passed(maps, there, seen_from or cell),  # type: ignore[arg-type]
        is_jumped=is_jumped,
        is_gap=is_gap,
        is_started=is_started,
        is_partly_known=is_partly,
        is_met_on_way_in=is_partly and on_way_in,
        free_from=_free_starts(maps, there) if grade == Grade.FROM_SOME else None,  # type: ignore[arg-type]
        is_unmodelled=grade == Grade.UNKNOWN and _is_unmodelled(maps, there),  # type: ignore[arg-type]
    )


def _is_unmodelled(maps: Graded, cell: Cell) -> bool:
    """Whether a cell lies where the model leaves out a motion of the string."""
    first = first_unmodelled(maps.results)
    return first is not None and np.isfinite(_speed(maps, cell)) and _speed(maps, cell) > first


def _border_outside(
    maps: Graded, cell: Cell, place: int, index: int, levels: slice | None, seen: Cell | None
) -> Border:
    """A border beyond which one does not drill, of ``maps`` of all points: what a string that is brought
    in through there meets is told all the same, and nothing of what is free."""
    values = maps.values((maps.third, maps.y, maps.x)[place])
    there = tuple(index if axis == place else at for axis, at in enumerate(cell))
    found = _border(maps, cell, place, index, levels, seen)
    is_free = bool(maps.allowed[there]) and not (found.is_jumped or found.is_gap)
    return Border(float(values[index]), outside=True) if is_free else replace(found, outside=True)


def _free_starts(maps: Graded, cell: Cell) -> tuple[int, int]:
    """From how many starts a cell is free, and how many there are."""
    labels = maps.labels[0][cell]
    return int((labels >= Label.TOUCHING).sum()), len(labels)


def _beside(maps: Graded, reach: Array, cell: Cell) -> Border | None:
    """The point nearest to a cell that is not within ``reach`` [y, x]; None where the map ends
    nearer."""
    axes = (maps.y, maps.values(maps.y)), (maps.x, maps.values(maps.x))
    place = nearest_outside(reach, *axes, (cell[1], cell[2]))
    if place is None:
        return None
    assert maps.y is not None
    there = (cell[0], *place)
    border = _border(maps, there, 2, place[1], seen_from=cell)
    return replace(border, beside=(maps.y, float(maps.values(maps.y)[place[0]])))


def _first_beyond(maps: Graded, advice: Advice, there: float) -> float | None:
    """The first value of the speed [rad/s] that is reached from the point over a speed
    ``there``; None where that is not one at which the ``advice`` lets one stay."""
    one = advice.stay_within.get("rotary_speed")
    if one is None or not one.low <= there <= one.high:
        return None
    values, slack = maps.values("rotary_speed"), SLACK * there
    is_beyond = values >= there - slack if there > advice.point["rotary_speed"] else values <= there + slack
    found = values[is_beyond]
    return float(found[np.argmin(np.abs(found - there))])


def _rectangle(maps: Graded, chosen: Array, cell: Cell, levels: slice | None) -> dict[str, Stretch]:
    """The largest rectangle of ``chosen`` points around a cell over both axes of its map. Its
    borders are those nearest to the point."""
    number, *place = cell
    sides = rectangle(
        chosen[number], (maps.y, maps.values(maps.y)), (maps.x, maps.values(maps.x)), (place[0], place[1])
    )
    found = {}
    for along, across in ((2, 1), (1, 2)):
        axis = (maps.third, maps.y, maps.x)[along]
        assert axis is not None
        values, (first, last) = maps.values(axis), sides[along - 1]
        below, above = (
            _side(maps, chosen, cell, along, index, sides[across - 1], levels) for index in (first - 1, last + 1)
        )
        found[axis] = Stretch(float(values[first]), float(values[last]), below, above)
    return found


def _side(
    maps: Graded, chosen: Array, cell: Cell, along: int, index: int, rows: tuple[int, int], levels: slice | None
) -> Border:
    """What bounds a rectangle at this ``index`` of the axis at the place ``along`` of a cell:
    the point nearest to the cell that is not ``chosen``, of the ``rows`` from the first to
    the last of the other axis."""
    across = 3 - along
    other = (maps.third, maps.y, maps.x)[across]
    assert other is not None
    if not 0 <= index < maps.grade.shape[along]:
        return Border(None)
    for at in sorted(range(rows[0], rows[1] + 1), key=lambda one: abs(one - cell[across])):
        there = (cell[0], at, index) if along == 2 else (cell[0], index, at)
        if not chosen[there]:
            beside = None if at == cell[across] else (other, float(maps.values(other)[at]))
            return replace(_border(maps, there, along, index, levels, cell), beside=beside)
    return _border(maps, cell, along, index, levels)


def names_of(bits: int, responses: Mapping[str, Response] = RESPONSES) -> tuple[str, ...]:
    """The names of those of the ``responses`` with these bits, by default of a drill
    string."""
    return tuple(name for name, one in responses.items() if bits & one.bit)


def _line(array: Array, cell: Cell) -> Array:
    """``array`` [third, y, x, ...] along x through a cell."""
    return np.asarray(array[cell[0], cell[1]])


def _recover(maps: Graded, cell: Cell) -> Recover | None:
    """What the way down says of a vibration that was met at the point or above it, along the axis
    along which the state is carried: within the limits, too, what is free from below may vibrate on the
    way down. None where no way down was run along an axis of the map."""
    wob = {**maps.results.held, **_values(maps, cell)}.get("wob")
    ends = [found for one in lasting(maps.results) if one["name"] == "wall_speed" and (found := lasts_above(one, wob))]
    above = float(ends[0][0]) if ends else None
    along = maps.along or maps.x
    if (
        "down" not in maps.ways
        or along not in (maps.x, maps.y)
        or maps.confidence is not None
        or maps.share is not None
    ):
        return None
    down, place = maps.ways.index("down"), 2 if along == maps.x else 1
    line = tuple(slice(None) if axis == place else at for axis, at in enumerate(cell))
    labels, bits = maps.labels[down][line][:, 0], maps.bits[down][line][:, 0]
    # whatever of it a severity allows, it is met, and has not ended
    met = np.flatnonzero(np.isin(labels, (Label.CRITICAL, Label.STALLED)) | (bits != 0))
    met = met[met >= cell[place]]
    if not met.size:
        chain = chain_of(maps.results)
        outcome = Recovery.LEFT_OUT if chain is not None and chain.goes_on else Recovery.NOT_MET
        others = np.bitwise_or.reduce(maps.bits[:, cell[0]], axis=None)
        elsewhere = names_of(int(others), responses_in(maps.results.attrs))
        return Recover(outcome, lasts_above=above, axis=along, elsewhere=elsewhere)
    critical = responses_in(maps.results.attrs)
    # the first clear point below all that was met, from the setting on
    highest = int(met[-1])
    below = slice(cell[place] + 1)
    clear = np.flatnonzero((labels[below] == Label.CLEAR) & (bits[below] == 0))
    if not clear.size:
        here = int(bits[cell[place]]) or int(np.bitwise_or.reduce(bits[met]))
        return Recover(Recovery.LASTS, responses=names_of(here, critical), lasts_above=above, axis=along)
    at = int(clear[-1])
    responses = names_of(int(np.bitwise_or.reduce(bits[at + 1 : highest + 1])), critical)
    end = Recover(Recovery.ENDS, float(maps.values(along)[at]), responses, above, along)
    return _with_room(maps, cell, place, at, end)


def _told_beside(maps: Graded, cell: Cell, found: Recover | None, ends: Mapping[str, Stretch]) -> Recover | None:
    """How a vibration ends, with whether the way down tells so at the point alone, of all values of the other axis
    that are within the limits; where it does at all of them, with the least room of these."""
    other = maps.y if found is not None and found.axis == maps.x else maps.x
    if found is None or found.at is None or other is None or other not in ends:
        return found
    values, across, along = maps.values(other), *((1, 2) if other == maps.y else (2, 1))
    at = int(np.argmin(np.abs(maps.values(found.axis) - found.at)))
    rows = np.flatnonzero((values >= ends[other].low) & (values <= ends[other].high))
    cells = [tuple(int(row) if axis == across else value for axis, value in enumerate(cell)) for row in rows]
    down = maps.ways.index("down")
    line = [tuple(at if axis == along else value for axis, value in enumerate(one)) for one in cells]
    if not all(maps.labels[down][one][0] == Label.CLEAR and not maps.bits[down][one][0] for one in line):
        return replace(found, only_at=(other, float(values[cell[across]])))
    each = [(one, _with_room(maps, one, along, at, found)) for one in cells]  # type: ignore[arg-type]
    worst, least = max(each, key=lambda one: (one[1].free_to or 0.0, one[0] == cell))
    if least.bound is not None and worst != cell:
        least = replace(least, bound=replace(least.bound, beside=(other, float(values[worst[across]]))))
    raised = {name: None for _, one in each for name in one.raised}
    return replace(least, raised=tuple(name for name in responses_in(maps.results.attrs) if name in raised))


def _with_room(maps: Graded, cell: Cell, place: int, at: int, found: Recover) -> Recover:
    """How a vibration ends that is lowered to the place ``at``, with how far below that all runs that were lowered
    are free, what bounds that, and what runs meet that are brought up there."""
    labels, bits = maps.labels, maps.bits
    line = tuple(slice(at + 1) if axis == place else value for axis, value in enumerate(cell))
    down, values = maps.ways.index("down"), maps.values(found.axis)
    bad = np.flatnonzero((labels[down][line][:, 0] != Label.CLEAR) | (bits[down][line][:, 0] != 0))
    last, bound = 0, None
    critical = responses_in(maps.results.attrs)
    if bad.size:
        last = int(bad[-1]) + 1
        label, met = int(labels[down][line][last - 1, 0]), int(bits[down][line][last - 1, 0])
        bound = Border(float(values[last - 1]), _GRADES_BELOW[Label(label)], names_of(met, critical))
    up = bits[maps.ways.index("up")][line][last:, 0] if "up" in maps.ways else np.zeros(1, dtype=int)
    raised = names_of(int(np.bitwise_or.reduce(up)), critical)
    return replace(found, bound=bound, free_to=float(values[last]), raised=raised)


_GRADES_BELOW = {  # what a run that was lowered tells of a point, by its label
    Label.OPEN: Grade.UNKNOWN,
    Label.UNKNOWN: Grade.UNKNOWN,
    Label.STALLED: Grade.STALLED,
    Label.CRITICAL: Grade.CRITICAL,
    Label.TOUCHING: Grade.BORDERLINE,
    Label.CLEAR: Grade.CRITICAL,  # with a response that a severity allows
}


def _way_in(maps: Graded, cell: Cell) -> WayIn | None:
    """How one comes to the point. The speed is raised first, off bottom, where the collar is
    kept from the wall by passing quickly where it would reach it; with the weight on, as
    the map was run, only where no drive is fast enough for that, or where it is not known.
    None where nothing was brought up."""
    if "up" not in maps.ways:
        return None
    speed = _values(maps, cell).get("rotary_speed", maps.results.held.get("rotary_speed"))
    reaches = any(one["name"] == "wall_speed" for one in lasting(maps.results))
    way = WayIn() if speed is None else _past_walls(maps)(speed)
    way = replace(way, is_shaken=bool(np.any(np.bitwise_or.reduce(maps.bits, axis=None) & BIT_BOUNCE)))
    chain = chain_of(maps.results)
    is_started = Grade(int(maps.grade[cell])) == Grade.FROM_START
    if maps.along == "wob" and "wob" in (maps.x, maps.y):
        first = float((maps.values("wob") if chain is None else chain.whole)[0])
        crossed = () if is_started else _crossed(maps, cell, "wob")
        way = replace(way, from_weight=None if is_started else first, at_once=is_started, crossed=crossed)
    elif maps.along in (None, maps.x) and maps.x == "rotary_speed":
        way = _as_run(maps, cell, way, chain)
    if way.crosses and not way.can_pass:
        vibrates = is_started or way.begins is None
        return replace(way, first=First.NONE if vibrates else First.WEIGHT)
    if not is_started and (
        (not reaches and way.first_speed_touches is not None)
        or (not way.crosses and way.begins is not None and not _may_start(maps, cell))
    ):
        return replace(way, first=First.WEIGHT)
    return way


def _started(maps: Graded, cell: Cell) -> int:
    """The responses of a start at a point; 0 where it is clear, or was not run."""
    if "same" not in maps.ways or maps.share is not None or maps.confidence is not None:
        return 0
    same = maps.ways.index("same")
    vibrates = maps.labels[same][cell][0] in (Label.CRITICAL, Label.STALLED)
    return int(maps.bits[same][cell][0]) if vibrates else 0


def _may_start(maps: Graded, cell: Cell) -> bool:
    """Whether nothing speaks against a start at a point: it is free, or none was run. Of one that
    failed nothing is known."""
    if "same" not in maps.ways or maps.share is not None or maps.confidence is not None:
        return True
    return int(maps.labels[maps.ways.index("same")][cell][0]) >= Label.TOUCHING


def _as_run(maps: Graded, cell: Cell, way: WayIn, chain: Chain | None) -> WayIn:
    """The ``way`` with the way up of the map: at a constant weight the speed is raised."""
    speeds, up = maps.values(maps.x), maps.bits_on("up")
    sticking = np.flatnonzero(_line(up, cell)[: cell[2]] & STICK_SLIP)
    touches = None
    if maps.y == "wob" and cell[1] > 0:
        lightest = np.flatnonzero(up[cell[0], 0, : cell[2]] & WHIRL)
        touches = float(speeds[lightest[0]]) if lightest.size else None
    through = _through(maps, cell, float(speeds[sticking[-1]])) if sticking.size else None
    if through is None and chain is not None and chain.begins_before:  # the runs that stick are not in this part
        through = _through(maps, cell, 0.0) or None
    begins = float((speeds if chain is None else chain.whole)[0])
    crossed = _crossed(maps, cell, maps.x, but=STICK_SLIP)
    return replace(way, begins=begins, through=through, first_speed_touches=touches, crossed=crossed)


def _crossed(maps: Graded, cell: Cell, axis: str, but: int = 0) -> tuple[tuple[str, float, float], ...]:
    """The responses, ``but`` one, that the way up along an axis meets before it is free at a cell,
    and from and to which value."""
    if maps.grade[cell] == Grade.FROM_START or maps.confidence is not None:  # of samples some meet it
        return ()
    place, values = (maps.third, maps.y, maps.x).index(axis), maps.values(axis)
    line = np.moveaxis(_met(maps, "up"), place, -1)[tuple(np.delete(cell, place))][: cell[place]]
    found = []
    for name, one in responses_in(maps.results.attrs).items():
        at = np.flatnonzero(line & one.bit & ~but)
        if at.size:
            found.append((name, float(values[at[0]]), float(values[at[-1]])))
    return tuple(found)


def _met(maps: Graded, way: str) -> Array:
    """The responses that the runs of a way met: what only trials met is not among them."""
    bits = np.array(maps.bits_on(way))
    for there in maps.in_trials:
        bits[there] = 0
    return bits


def _through(maps: Graded, cell: Cell, last: float) -> float:
    """Up to which speed stick-slip goes on that was met ``last`` on the way up [rad/s]."""
    to = sticks_to(maps, cell) or 0.0
    return max(last, to) if to < maps.values(maps.x)[cell[2]] else last


def _surface(maps: Graded, cell: Cell, within: Mapping[str, Stretch], levels: slice | None = None) -> Surface | None:
    """What is seen at the surface at the point and in the motions near it, ``within`` the
    limits; of an answer for several depths, the ``levels``, at that of the cell."""
    variables = maps.results.variables
    if "surface_torque_mean" not in variables or maps.confidence is not None or "start" in maps.results.coords:
        return None
    way = maps.way_in

    here = {**maps.results.held, **_values(maps, cell)}
    if maps.third:
        here[maps.third] = float(maps.values(maps.third)[cell[0]])
    drag = drag_off_bottom(maps.results.attrs, here)
    off_bottom = (drag or 0.0) * here.get("rotary_speed", 0.0)

    def of(name: str, which: str) -> Array:
        part = variables[name][maps.ways.index(which)]
        return np.asarray(planes_of(maps.results, maps.x, maps.y, maps.third)(part[None])[..., 0])

    sticking = period = shortest = whirling = acceleration = least_shocks = at = None
    below = np.flatnonzero(_line(_met(maps, way), cell)[: cell[2]] & STICK_SLIP)
    if maps.x == "rotary_speed" and {"surface_torque_min", "surface_torque_max"} <= variables.keys():
        torsional = torsional_period(maps.results.attrs, here)
        for near in ((*cell[:2], int(column)) for column in below[::-1]):
            # of the ways that stick there that which swings most: a mild one is no measure of it
            ways = [one for one in maps.ways if int(_met(maps, one)[near]) & STICK_SLIP]
            ends = {one: tuple(float(of(f"surface_torque_{end}", one)[near]) for end in ("min", "max")) for one in ways}
            widest = max(ways, key=lambda one: ends[one][1] - ends[one][0])
            found = float(of("stick_slip_period", widest)[near]) if "stick_slip_period" in variables else np.nan
            if _is_of_bounce(found, torsional, *ends[widest]):
                continue
            at = float(maps.values(maps.x)[near[-1]])
            sticking = tuple(one - (drag or 0.0) * at for one in ends[widest])
            # what repeats faster than torsion swings is no cycle of it, but what a bouncing bit adds
            period = found if found >= (torsional or 0.0) else None
            shortest = torsional if period is None else None
            break
    whirling_at = None
    if "lateral_acceleration_rms" in variables and (whirl := _nearest_whirl(maps, cell)) is not None:
        whirls, column = whirl
        there = (*cell[:2], column)
        drag_there = off_bottom
        if column != cell[2]:
            whirling_at = float(maps.values(maps.x)[column])
            drag_there = (drag or 0.0) * whirling_at
        whirling = float(of("surface_torque_mean", whirls)[there]) - drag_there
        accelerations = of("lateral_acceleration_rms", whirls)
        acceleration = float(accelerations[there])
        # it grows with the speed, so that what is least tells whirl everywhere in the limits
        inside = (_met(maps, whirls) & WHIRL > 0) & _all_within(maps, cell, within, levels)
        least_shocks = float(np.min(accelerations[inside])) if inside.any() else acceleration
    free = maps.free_way(cell)
    torque = float(of("surface_torque_mean", free)[cell]) - off_bottom
    swing = None
    if {"surface_torque_min", "surface_torque_max"} <= variables.keys():
        least, most = (float(of(f"surface_torque_{end}", free)[cell]) - off_bottom for end in ("min", "max"))
        swing = (least, most) if most - least > STEADY * abs(torque) else None
    above = None if drag is None else off_bottom
    free_shocks = alarm = None
    if acceleration is not None:
        free_shocks = float(of("lateral_acceleration_rms", free)[cell])
        alarm = in_force(maps.results.attrs).get("whirl", {}).get("severe_acceleration")
    shocks = acceleration, least_shocks, free_shocks, alarm
    places = {axis: here[axis] for axis in ("depth", "wob") if axis in (maps.x, maps.y, maps.third)}
    return Surface(torque, swing, sticking, period, shortest, whirling, *shocks, above, at, whirling_at, places)  # type: ignore[arg-type]


def _is_of_bounce(period: float, torsional: float | None, least: float, most: float) -> bool:
    """Whether a bit that stops every ``period`` [s] does so as it bounces, while the torque at the surface stays
    between two that are near to each other: torsion does not swing, and this tells nothing of stick-slip."""
    is_fast = torsional is not None and period < QUICK * torsional
    return bool(is_fast and most - least < MILD * max(abs(most), abs(least)))


def _all_within(maps: Graded, cell: Cell, within: Mapping[str, Stretch], levels: slice | None) -> Array:
    """The points, bool [third, y, x], at which an answer lets one be: ``within`` the limits, at the depths of the
    ``levels``, and elsewhere as the cell."""
    found = np.ones(maps.grade.shape, dtype=bool)
    for place, axis in enumerate((maps.third, maps.y, maps.x)):
        values, inside = maps.values(axis), np.zeros(maps.grade.shape[place], dtype=bool)
        if axis is not None and axis in within:
            inside = (values >= within[axis].low) & (values <= within[axis].high)
        elif axis == "depth" and levels is not None:
            inside[levels] = True
        else:
            inside[cell[place]] = True
        found = found & along_axis(inside, place)
    return found


def _nearest_whirl(maps: Graded, cell: Cell) -> tuple[str, int] | None:
    """The way and the column of a whirl at a cell; where none was met there, of the nearest one in its
    row along the speed without stick-slip, whose torque swings by itself; None where none was met."""
    found = []
    for way in ("down", "up"):
        if way in maps.ways:
            bits = _line(_met(maps, way), cell)
            if bits[cell[2]] & WHIRL:
                return way, cell[2]
            if maps.x == "rotary_speed":
                speeds = maps.values(maps.x)
                is_near = np.abs(speeds - speeds[cell[2]]) <= NEAR * speeds[cell[2]]
                columns = np.flatnonzero((bits & WHIRL > 0) & (bits & STICK_SLIP == 0) & is_near)
                found += [(abs(int(column) - cell[2]), way, int(column)) for column in columns]
    return min(found)[1:] if found else None


def _share(maps: Graded, cell: Cell) -> Share | None:
    """The probability of a point of results with samples, or the share of its starts."""
    if maps.share is not None:
        labels, (count, total) = maps.labels[0][cell], _free_starts(maps, cell)
        failed = int((labels == Label.UNKNOWN).sum())
        low, high = interval(np.asarray(count), total, failed)
        return Share(float(maps.share[cell]), float(low), float(high), float(maps.share[cell]), total, failed)
    if maps.confidence is None:
        return None
    probability, lower, upper = (float(part[cell]) for part in maps.probability())
    any_history = float(maps.probability(any_history=True)[0][cell])
    grades = maps.grades[cell]
    return Share(probability, lower, upper, any_history, len(grades), int((grades == Grade.UNKNOWN).sum()))


def _all_yields(maps: Graded, cell: Cell) -> dict[str, float]:
    found = {name: float(maps.yields(name)[cell]) for name in (RATE, "mechanical_specific_energy")}
    return {name: value for name, value in found.items() if np.isfinite(value)}


def _over_depths(maps: Graded) -> Advice | None:
    """One setting for all depths: depth is none, so what is named holds from the first
    depth at which anything does down to as deep as any setting from there, with the
    most room at the tightest depth. None where no setting holds at any depth."""
    order = (maps.third, maps.y, maps.x)
    place, depths = order.index("depth"), maps.values("depth")
    others = [axis for axis in order if axis != "depth"]
    number = next((number for number, chosen in enumerate(maps.fields) if np.any(chosen & maps.was_run)), None)
    if number is None:
        return None
    levels = np.moveaxis(maps.fields[number] & maps.was_run, place, 0)  # [depth, other, other]
    first = int(np.flatnonzero(levels.any(axis=(1, 2)))[0])
    reach = np.logical_and.accumulate(levels[first:], axis=0).sum(axis=0)
    count = int(reach.max())
    last = first + count - 1
    through = np.broadcast_to(levels[first : last + 1].all(axis=0), levels.shape)
    rooms = np.min([_room_at(maps, level, others) for level in levels[first : last + 1]], axis=0)
    at = np.unravel_index(int(np.argmax(np.where(reach == count, rooms, -np.inf))), rooms.shape)
    cell = tuple(int(one) for one in np.insert(at, place, last))
    how = Room.RUN if rooms[at] >= ENOUGH and first == 0 and maps.share is None else Room.NARROW
    found = _at_point(maps, Choice(cell, how, number, False), np.moveaxis(through, 0, place), slice(first, last + 1))  # type: ignore[arg-type]
    ends = Depths(
        float(depths[first]),
        float(depths[last]),
        float(depths[last + 1]) if last + 1 < len(depths) else None,
        float(depths[first - 1]) if first else None,
    )
    point = {axis: value for axis, value in {**_held(maps), **found.point}.items() if axis != "depth"}
    named = {axis: value for axis, value in found.at.items() if axis != "depth"}
    found = replace(found, point=point, at=named, depths=ends, room=float(rooms[at]))
    return replace(found, basis=basis_of(maps, cell, found.ends))  # type: ignore[arg-type]


def _held(maps: Graded) -> dict[str, float]:
    """The weight and the speed where only depth is swept."""
    held = maps.results.held if maps.x == "depth" else {}
    return {axis: held[axis] for axis in ("wob", "rotary_speed") if axis in held}


def _room_at(maps: Graded, level: Array, axes: list[str | None]) -> Array:
    """The room of the points of one depth, [other, other], over the axes that are settings;
    none where no setting is swept."""
    (one, rows), (other, columns) = ((axis, maps.values(axis)) for axis in axes)
    if other is None:
        return np.where(level, 0.0, -1.0)
    if one is not None and one == maps.third:  # each of its values has a map of its own
        return np.concatenate([room(row[None], (None, np.zeros(1)), (other, columns)) for row in level])
    return room(level, (one, rows), (other, columns))


def _nothing(maps: Graded) -> Advice:
    """The answer where no point is allowed: the best hint, what stops it, and of samples on
    which unknown that turns most."""
    cell, grade, split = None, None, None
    if maps.confidence is not None:
        value = maps.least
        if value.max() > 0.0:
            fast = np.nan_to_num(maps.yields(RATE), nan=0.0)
            cell = _greatest(value + 1e-6 * fast / (fast.max() or 1.0))
            split = _split(maps, cell)
    elif np.any(above := maps.grade == Grade.ONLY_FROM_ABOVE):
        value = np.stack([room(one, (maps.y, maps.values(maps.y)), (maps.x, maps.values(maps.x))) for one in above])
        cell, grade = _greatest(value), Grade.ONLY_FROM_ABOVE
    found = Advice(Kind.NOTHING, grade, stops=_stops(maps), near=_near(maps))
    if cell is None:
        return found
    return replace(
        found,
        point=_values(maps, cell),
        at=_third(maps, cell[0]),
        share=_share(maps, cell),
        split=split,
        yields=_all_yields(maps, cell),
        cell=cell,
    )


LEAST_PART = 4  # of the samples, one in so many lies on either side of a threshold
LEAST_SAMPLES = 3
SHUFFLES, BY_CHANCE = 199, 0.05  # of the samples, and the part of them that may divide as clearly by chance


def _split(maps: Graded, cell: Cell) -> Split | None:
    """The unknown, and its threshold, that best divides the known samples at a point into
    those in which it is allowed and the others; None where no number does more clearly than
    chance: the best of many thresholds always divides them somehow."""
    grades = maps.grades[cell]
    known = grades != Grade.UNKNOWN
    allowed, total = is_allowed(grades)[known].astype(float), int(known.sum())
    least = max(LEAST_SAMPLES, total // LEAST_PART)
    samples = independent(maps.results)
    drawn = {
        unknown.name: np.asarray(values, dtype=float)[samples][known]
        for unknown, values in maps.results.drawn.items()
        if not words_along(unknown.name)
    }
    if not drawn or total < 2 * least or np.ptp(allowed) == 0.0:
        return None
    orders = {name: np.argsort(values, kind="stable") for name, values in drawn.items()}
    counts = np.arange(least, total - least + 1)
    differ = {name: values[orders[name]][counts - 1] != values[orders[name]][counts] for name, values in drawn.items()}

    def shares(name: str, good: Array) -> tuple[Array, Array]:
        """Those allowed below and above each threshold."""
        sums = np.cumsum(good[orders[name]])
        return sums[counts - 1] / counts, (sums[-1] - sums[counts - 1]) / (total - counts)

    def contrasts(name: str, good: Array) -> Array:
        below, above = shares(name, good)
        return np.where(differ[name], np.abs(below - above), 0.0)

    best = max(drawn, key=lambda name: float(contrasts(name, allowed).max()))
    found = contrasts(best, allowed)
    chance = np.random.default_rng(0)
    as_clear = sum(
        max(float(contrasts(name, shuffled).max()) for name in drawn) >= found.max()
        for shuffled in (chance.permutation(allowed) for _ in range(SHUFFLES))
    )
    if (as_clear + 1) / (SHUFFLES + 1) > BY_CHANCE:
        return None
    at = int(np.argmax(found))
    values, (below, above) = drawn[best][orders[best]], shares(best, allowed)
    count = int(counts[at])
    threshold = float((values[count - 1] + values[count]) / 2)
    return Split(best, threshold, float(below[at]), float(above[at]), (count, total - count))


def _greatest(values: Array) -> Cell:
    third, row, column = np.unravel_index(int(np.argmax(values)), values.shape)
    return int(third), int(row), int(column)


def _stops(maps: Graded) -> tuple[tuple[str, float, float], ...]:
    """The responses on the way in that a severity does not allow, and from and to which value of x they occur;
    those at the most points first."""
    bits, values = maps.barred, maps.values(maps.x)
    found = []
    for name, one in responses_in(maps.results.attrs).items():
        at = np.flatnonzero((bits & one.bit > 0).any(axis=(0, 1)))
        if at.size:
            found.append((int(np.count_nonzero(bits & one.bit)), (name, float(values[at[0]]), float(values[at[-1]]))))
    return tuple(one for _, one in sorted(found, key=lambda of: -of[0]))


def _near(maps: Graded) -> tuple[tuple[str, float, float], ...]:
    """From and to which value of x points are free on the way in, but stick-slip may last, or steady drilling is
    unstable, or borderline: of samples as many as are not allowed elsewhere."""
    values, found, unstable = maps.values(maps.x), [], only_unstable(maps)
    lasting = (maps.grade == Grade.STICKS_ON) & ~unstable
    for name, chosen in ((STICKS_ON, lasting), (UNSTABLE, unstable), (BORDERLINE, maps.grade == Grade.BORDERLINE)):
        at = np.flatnonzero(chosen.any(axis=(0, 1)))
        if at.size:
            found.append((name, float(values[at[0]]), float(values[at[-1]])))
    return tuple(found)


def data_of(advice: Advice, along: str) -> Answer:
    """The answer of a window whose first axis is ``along`` as plain data: values stand
    under the name of their axis, or beside it, so that they can be given in any
    units. What is not ordered is left out."""
    if advice.is_no_order:
        advice = replace(advice, most={}, recover=None)
    if advice.is_withdrawn:  # what the map allows is nothing to stay within
        advice = replace(advice, stay_within={}, basis=None)
    found: Answer = asdict(advice)
    found.pop("cell")
    found["sticks_to"] = speed_of(advice.sticks_to)
    found |= data_of_trials(advice.trials or Trials(), along)
    found["kind"], found["withdrawn"] = str(advice.kind), advice.is_withdrawn
    found["tried_kind"] = advice.tried_kind and str(advice.tried_kind)
    found["vibrates"] = advice.vibrates and [
        {**asdict(one), "responses": list(one.responses)} for one in advice.vibrates.ways
    ]
    found["jump"] = advice.jump and data_of_jump(advice.jump)
    stuck = advice.stuck_past
    found["stuck_past"] = stuck and {"axis": "rotary_speed", "from": stuck[0], "to": stuck[1]}
    found["grade"] = _name(advice.grade)
    found["basis"] = advice.basis and data_of_basis(advice.basis)
    found["beside"] = advice.beside and _data_of_border(along, advice.beside)
    for key, limits in (("stay_within", advice.stay_within), ("through_point", advice.lines)):
        found[key] = {
            axis: {
                "axis": axis,
                "from": one.low,
                "to": one.high,
                "below": _data_of_border(axis, one.below),
                "above": _data_of_border(axis, one.above),
            }
            for axis, one in limits.items()
        }
    found.pop("lines")
    found["most"] = {
        axis: {axis: one.value, "beyond": _data_of_border(axis, one.beyond)} for axis, one in advice.most.items()
    }
    limit = advice.most.get(along)
    for key, is_there in (("never_exceed", lambda one: one is not None), ("known_to", lambda one: one is None)):
        found[key] = {along: limit.value} if limit is not None and is_there(limit.beyond.value) else None
    found["limits"] = {axis: one.value for axis, one in advice.most.items() if one.beyond.value is not None}
    if (way := advice.way_in) is not None:
        if advice.is_withdrawn:
            way = replace(way, first=First.NONE, rate=None, most=None)
        speeds = {
            "no_stop_from": way.no_stop_from,
            "begins": way.begins,
            "through": way.through,
            "first_speed_touches": way.first_speed_touches,
        }
        found["way_in"] = {
            **{key: None if value is None else {"rotary_speed": value} for key, value in speeds.items()},
            "first": str(way.first),
            "wall": way.wall and {"axis": "rotary_speed", "from": way.wall[0], "to": way.wall[1]},
            "crosses": way.crosses,
            "crossed": [
                {"response": name, "axis": "wob" if way.from_weight is not None else along, "from": low, "to": high}
                for name, low, high in way.crossed
            ],
            "at_once": way.at_once,
            "is_shaken": way.is_shaken,
            **{
                key: None if value is None else {"value": value, "units": "rad/s^2"}
                for key, value in (
                    ("passing_rate", way.passing_rate),
                    ("rate", way.rate),
                    ("most_rate", way.most),
                    ("swing_rate", way.swing_rate),
                )
            },
            "from_weight": None if way.from_weight is None else {"wob": way.from_weight},
        }
    if (end := advice.recover) is not None:
        nearer = advice.nearer_limit
        bound = end.bound if nearer is None else nearer.below
        found["recover"] = {
            "outcome": str(end.outcome),
            "axis": end.axis,
            "at": None if end.at is None else {end.axis: end.at},
            "only_at": None if end.only_at is None else dict([end.only_at]),
            "by_trial": end.by_trial,
            "responses": list(end.responses),
            "then": list(end.then),
            "may": end.may,
            "bound": bound and _data_of_border(end.axis, bound),
            "not_below": None if nearer is None else {end.axis: nearer.low},
            "free_to": None if end.free_to is None else {end.axis: end.free_to},
            "held_to": None if end.held_to is None else {end.axis: end.held_to},
            "raised": list(end.raised),
            "lasts_above": None if end.lasts_above is None else {"rotary_speed": end.lasts_above},
        }
    if (depths := advice.depths) is not None:
        found["depths"] = {"axis": "depth", "from": depths.first, "to": depths.last} | {
            key: None if value is None else {"depth": value}
            for key, value in (("beyond", depths.beyond), ("above", depths.above))
        }
    if (split := advice.split) is not None:
        at = {split.unknown: split.threshold}
        found["split"] = {**asdict(split), "threshold": at, "samples": list(split.samples)}
    if (seen := advice.surface) is not None:
        torque = "surface_torque_mean"
        found["surface"] = {
            **{
                key: None if value is None else {name: value}
                for key, value, name in (
                    ("torque", seen.torque, torque),
                    ("off_bottom", seen.off_bottom, torque),
                    ("sticking_at", seen.sticking_at, "rotary_speed"),
                    ("whirling_at", seen.whirling_at, "rotary_speed"),
                    ("period", seen.period, "stick_slip_period"),
                    ("least_period", seen.least_period, "stick_slip_period"),
                    ("whirling", seen.whirling, torque),
                    ("acceleration", seen.acceleration, "lateral_acceleration_rms"),
                    ("least_acceleration", seen.least_acceleration, "lateral_acceleration_rms"),
                    ("free_acceleration", seen.free_acceleration, "lateral_acceleration_rms"),
                    ("alarm_acceleration", seen.alarm_acceleration, "lateral_acceleration_rms"),
                )
            },
            "sticking": seen.sticking and {"axis": torque, "from": seen.sticking[0], "to": seen.sticking[1]},
            "swing": seen.swing and {"axis": torque, "from": seen.swing[0], "to": seen.swing[1]},
            "at": dict(seen.at),
            "above_off_bottom": seen.above_off_bottom,
        }
    found["slowly"], found["started"] = list(advice.slowly), list(advice.started)
    for key, name_of in (("stops", "response"), ("near", "grade")):
        found[key] = [
            {name_of: name, "axis": along, "from": low, "to": high} for name, low, high in getattr(advice, key)
        ]
    return found


def speed_of(value: float | None) -> Answer | None:
    """A speed up to which stick-slip may last, as plain data."""
    if value is None:
        return None
    return {"rotary_speed": value if np.isfinite(value) else None, "everywhere": bool(np.isinf(value))}


def _name(grade: Grade | None) -> str | None:
    return None if grade is None else grade.name.lower()


FLAGS = (
    "outside",
    "is_dry",
    "by_trial",
    "is_jumped",
    "is_gap",
    "is_unsettled",
    "is_started",
    "is_on_wall",
    "is_partly_known",
    "is_met_on_way_in",
    "is_unmodelled",
)  # of a border, given where they hold


def _data_of_border(axis: str, border: Border) -> Answer:
    value = {} if border.value is None else {axis: border.value}
    beside = {} if border.beside is None else dict([border.beside])
    sticking = {} if border.sticks_to is None else {"sticks_to": speed_of(border.sticks_to)}
    grade, responses = _name(border.grade), list(border.responses)
    found = {"at": {**value, **beside} or None, "grade": grade, "responses": responses, **sticking}
    flags = {name: True for name in FLAGS if getattr(border, name)}
    starts = (
        {} if border.free_from is None else {"free_from": {"starts": border.free_from[0], "of": border.free_from[1]}}
    )
    if border.not_passed:
        flags["is_not_passed"] = True
    return {**found, **flags, **starts}
