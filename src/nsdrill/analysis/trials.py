"""What trials say of a setting: ramps by which it is reached and disturbed, and runs with one
change of the string each.

Trials confirm or withdraw what a map says, and never add a setting to it. A trial that
failed, or was not run, is unknown; it is never counted as free.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from enum import IntEnum, StrEnum
from itertools import takewhile

import numpy as np

from nsdrill.analysis.planes import stretches
from nsdrill.analysis.room import tolerance
from nsdrill.analysis.untried import Jump, data_of_jump
from nsdrill.data import Answer
from nsdrill.records import dataclass

WEIGHT_FIRST, SPEED_FIRST = "weight first", "speed first"
TO_CORNER, HELD_IN_CORNER = "to a corner of the limits", "in a corner, the bit held and let go"
ON_WALL, OFF_ROCK, HELD = "knocked on to the wall", "knocked off the rock", "the bit held and let go"
SLOWED = "then slowed"
TAGGED = "picked up and tagged again"
TAGGED_IN_CORNER = "in a corner, picked up and tagged again"
_OF_WALL = (ON_WALL, SLOWED)
RESOLVED = 1.2  # the ratio of two rates of which both are free, up to which what lies between needs no trial
PONY_SPAN = "span with pony collars"
OTHER_BIT = "lobes"  # the change that no rig can make of its bit, so that every other one comes before it


HOLDS_SPEED, HOLDS_WEIGHT = 5.0 * np.pi / 30, 8896.443230521  # to what a driller holds them: 5 rpm, 2 klbf


class Effort(IntEnum):
    """What a change takes, the least first."""

    SURFACE = 0
    TRIP = 1
    PONY = 2
    """A trip with collars cut to half a joint, which not every rig has."""
    ORDER = 3
    BIT = 4
    """One that no rig can make of its bit."""

    @property
    def words(self) -> str:
        return ("at the surface", *("at the next trip",) * 2, "to be ordered", "with another bit")[self]


EFFORTS = {
    "none": Effort.SURFACE,
    "weight": Effort.SURFACE,
    "drive": Effort.SURFACE,
    "span": Effort.TRIP,
    PONY_SPAN: Effort.PONY,
    "collar": Effort.ORDER,
    "eccentricity": Effort.ORDER,
    OTHER_BIT: Effort.BIT,
}


class Robust(IntEnum):
    """How much a change may be relied on."""

    POOR = 0
    FAIR = 1
    GOOD = 2


# the least width of the speeds, in what a driller holds; margin, in tolerances; and share of the trials free
LEAST_OF = {Robust.GOOD: (6.0, 2.0, 0.9), Robust.FAIR: (4.0, 1.0, 0.75)}


class Outcome(StrEnum):
    """How a trial ended."""

    FREE = "free"
    VIBRATES = "vibrates"
    STALLED = "stalled"
    UNKNOWN = "unknown"
    """It failed, or was not run."""

    @property
    def is_bad(self) -> bool:
        """Whether it is known not to be free."""
        return self in (Outcome.VIBRATES, Outcome.STALLED)


class Way(StrEnum):
    """What a trial tries."""

    IN = "in"
    EXCURSION = "excursion"
    KNOCK = "knock"
    CORNER = "corner"


@dataclass(frozen=True)
class Trial:
    """One trial: its ``name``, and how it ended by the thresholds of the study, with the
    ``responses`` that were there at the end. A way in has the ``rate`` [rad/s^2] at which
    the speed was raised. ``speed`` [rad/s] is that at the end; that of a string that was
    slowed until its vibration ended is where it ended. ``wob`` [N] is the weight at a corner
    of what to stay within. ``why`` says why the outcome is not known. One that was slowed comes
    ``after`` the knock of this name."""

    name: str
    way: Way
    outcome: Outcome
    responses: tuple[str, ...] = ()
    rate: float | None = None
    speed: float | None = None
    why: str = ""
    wob: float | None = None
    after: str = ""
    there: float | None = None
    """To which speed an excursion went before it came back [rad/s]."""
    set_in: float | None = None
    """In what time the weight was set on a way in [s]."""
    held: float | None = None
    """For how long a way in was held between its two parts [s]."""
    begun: float | None = None
    """From which speed a way in was raised [rad/s]."""


@dataclass(frozen=True)
class Change:
    """One change of the string, run as one way up: the ``key`` of the study with its new
    ``value`` as text, both empty for the string as it is; in ``words``; over which
    ``free`` stretches of the first axis it is free from below; and the greatest ``room``
    in tolerances, None where it is not known, with ``why``; all at the weight ``wob`` [N]. ``trials`` are those of the
    string as it is changed, at ``speed`` [rad/s], where the room is; none where they were not run."""

    name: str
    key: str
    value: str
    words: str
    free: tuple[tuple[float, float], ...] = ()
    room: float | None = None
    widest: tuple[float, float] | None = None
    """The stretch with the most room."""
    why: str = ""
    speed: float | None = None
    trials: tuple[Trial, ...] = ()
    jump: Jump | None = None
    """What its steps may still jump across; None where they are fine enough."""

    sticks_past: bool = False
    """Whether stick-slip takes its way up past the speeds at which the collar reaches the wall, so that one that begins
    higher, without stick-slip, may whirl at what this one allows."""
    weights: tuple[float, float] | None = None
    """The least and the greatest weight [N] at which trials in the corners of :attr:`widest` were free; None where
    there were none."""
    holds_usual: bool | None = None
    """Whether it is free as well with a usual, lower damping of torsion; None where that was not tried."""
    ratio: float | None = None
    """The damping ratio of torsion with which it was run; None where it is not one number."""
    low: Change | None = None
    """It with what it allows as well with the least damping of torsion that is usual; without room where that is
    nothing. None where that was not tried, or is not known."""
    also: tuple[tuple[str, str], ...] = ()
    """Further keys of the study, each with its value as text, that come with the change."""
    wob: float | None = None
    others: tuple[Change, ...] = ()
    """The same at the other weights at which it was run."""

    @property
    def every(self) -> list[Change]:
        """It at each weight at which it was run, the lightest first."""
        return sorted((replace(self, others=()), *self.others), key=lambda one: one.wob or 0.0)

    def at(self, wob: float | None) -> Change:
        """It at one of its weights; as it is where it was not run at that."""
        return next((one for one in self.every if one.wob == wob), self)

    def left_beside(self, one: Change) -> tuple[tuple[float, float], ...]:
        """What ``one`` of its weights is free over on its way up, without what trials at its other weights showed to
        vibrate as near to it as a driller holds the weight: what such a trial leaves lies on the side of the setting
        from which it was run."""
        bad = [
            (speed, other.speed)
            for other in self.every
            if other.speed is not None and one.wob is not None
            for speed in other.vibrates_near(one.wob)
        ]
        left = []
        for low, high in one.free:
            within = [each for each in bad if low * (1.0 - 1e-9) <= each[0] <= high * (1.0 + 1e-9)]
            least = max([low, *(speed + HOLDS_SPEED for speed, setting in within if speed <= setting)])
            most = min([high, *(speed - HOLDS_SPEED for speed, setting in within if speed > setting)])
            if least < most or not within:
                left.append((least, most))
        return tuple(left)

    def vibrates_near(self, wob: float) -> list[float]:
        """The speeds [rad/s] at which its trials vibrate, or after going there, as near to a weight ``wob`` [N] as a
        driller holds that; trials on the wall apart."""
        bad = [one for one in self.trials if one.outcome.is_bad and one.name not in _OF_WALL]
        spots = [(one.wob, one.speed if one.way == Way.CORNER else one.there) for one in bad]
        found = [(self.wob if at is None else at, speed) for at, speed in spots]
        near = HOLDS_WEIGHT * (1.0 + 1e-9)
        return [speed for at, speed in found if at is not None and speed is not None and abs(at - wob) <= near]

    @property
    def passed(self) -> tuple[float, float] | None:
        """The speeds that are not free on its way up just below the stretch that it allows; None where it is free
        nowhere below that."""
        if self.widest is None:
            return None
        middle = sum(self.widest) / 2.0
        begins = next((low for low, high in self.free if low <= middle <= high), None)
        ended = [high for _, high in self.free if begins is not None and high < begins]
        return (max(ended), begins) if ended and begins is not None else None

    def is_of(self, other: Change) -> bool:
        """Whether an ``other`` is the same, maybe at another weight."""
        return (self.key, self.value) == (other.key, other.value)

    def with_one(self, other: Change) -> Change:
        """It with an ``other`` in place of that at the same weight; itself where the other is no such one."""
        if not self.is_of(other):
            return self
        if other.wob == self.wob:
            return replace(other, others=self.others)
        return replace(self, others=tuple(other if one.wob == other.wob else one for one in self.others))

    @property
    def has_room(self) -> bool:
        """Whether it has room for a tolerance."""
        return (self.room or 0.0) >= 1.0 - 1e-9

    @property
    def holds_setting(self) -> bool:
        """Whether its setting lies in what it allows."""
        return self.widest is not None and self.widest[0] <= (self.speed or 0.0) <= self.widest[1]

    @property
    def effort(self) -> Effort:
        return EFFORTS[self.name]

    @property
    def share(self) -> float:
        """The share of its trials that ended free, but for those on the wall, and in corners that were left out
        since; 1 where none were run."""
        inside = [one for one in self.inside if one.name not in _OF_WALL]
        return _free_share(inside) if inside else 1.0

    @property
    def robust(self) -> Robust | None:
        """How much it may be relied on; None without trials, which alone grade it."""
        return self.promised if self.trials else None

    @property
    def promised(self) -> Robust:
        """How much it may be relied on, before trials at best: by the speeds that it allows, its margin and the share
        of its trials; poor where the weight cannot be held, or where a usual damping undoes it."""
        if self.widest is None or self._is_of_one_damping or self._is_narrow_in_weight:
            return Robust.POOR
        for grade, least in LEAST_OF.items():
            if all(one >= need - 1e-9 for one, need in zip(self._has, least, strict=True)):
                return grade
        return Robust.POOR

    @property
    def why_poor(self) -> tuple[str, ...]:
        """What makes it poor, in words; none of one that is not."""
        lacks = ("narrow in speed", "little room", "few trials free")
        pairs = zip(self._has, LEAST_OF[Robust.FAIR], lacks, strict=True)
        found = [words for one, need, words in pairs if one < need - 1e-9]
        one_damping = ("with the assumed damping only",) * self._is_of_one_damping
        return (*("narrow in weight",) * self._is_narrow_in_weight, *found, *one_damping)

    @property
    def _is_of_one_damping(self) -> bool:
        """Whether a usual damping of torsion leaves it no room where that of the study is unusual."""
        return self.holds_usual is False

    @property
    def less_with_low(self) -> Change | None:
        """It with the least damping that is usual, where that frees less; else None."""
        if self.low is None or not self.low.has_room:
            return None
        same = (self.low.widest, self.low.weights) == (self.widest, self.weights)
        return None if same else self.low

    @property
    def _is_narrow_in_weight(self) -> bool:
        """Whether a driller cannot hold the weight in what it allows."""
        return self.weights is not None and self.weights[1] - self.weights[0] < 2.0 * HOLDS_WEIGHT * (1.0 - 1e-9)

    @property
    def _has(self) -> tuple[float, float, float]:
        """What of it is compared with :data:`LEAST_OF`."""
        low, high = self.widest or (0.0, 0.0)
        return (high - low) / HOLDS_SPEED, self.room or 0.0, self.share

    @property
    def rank(self) -> tuple[float, ...]:
        """The greater, the better: the most robust, then the least effort, then the most trials and room."""
        return (self.promised, -self.effort, self.share, self.room or 0.0)

    @property
    def inside(self) -> list[Trial]:
        """Its trials, without corners and excursions that lie outside of what it allows now."""
        return [one for one in self.trials if self._is_inside(one)]

    def _is_inside(self, one: Trial) -> bool:
        if self.weights is None or self.widest is None or not one.outcome.is_bad:
            return True
        spans = []
        if one.way == Way.CORNER and one.speed is not None and one.wob is not None:
            spans = [(one.speed, self.widest), (one.wob, self.weights)]
        elif one.there is not None:
            spans = [(one.there, self.widest)]
        return all(low * (1.0 - 1e-9) <= value <= high * (1.0 + 1e-9) for value, (low, high) in spans)

    @property
    def bad(self) -> list[Trial]:
        """What disturbs it in trials: not the wall, on which a collar may stay at every setting
        that is recommended as well."""
        return [one for one in self.inside if one.way != Way.IN and one.outcome.is_bad and one.name not in _OF_WALL]

    @property
    def free_ways(self) -> float:
        """The share of its ways in that ended free; 0 where none was tried."""
        return _free_share(one for one in self.trials if one.way == Way.IN)

    @property
    def is_reached(self) -> bool:
        """Whether a way in ended free that can be relied on, or none was tried."""
        return bool(sure_ways(self.trials)) or not any(one.way == Way.IN for one in self.trials)

    @property
    def is_sound(self) -> bool:
        """Whether trials reach it, and it does not vibrate after a pick up and tag, which would leave
        it no more than a hint as well."""
        return self.is_reached and bad_tag(self.trials) is None


@dataclass(frozen=True)
class Trials:
    """The trials of a setting, and the changes that were run where none is allowed: at
    the weight ``wob`` [N], and some at others. ``settled`` and ``observed`` [s] are how long a trial was held
    at its last speed, and over how long of that it was judged."""

    trials: tuple[Trial, ...] = ()
    changes: tuple[Change, ...] = ()
    settled: float = 0.0
    observed: float = 0.0
    wob: float | None = None
    interrupted: bool = False
    is_cut_short: bool = False
    """Whether trials of the setting itself were interrupted, so that what may withdraw it is missing."""
    samples: bool = False
    """Whether the file has samples: trials have the values that the study gives."""
    depth: float | None = None
    """The depth [m] at which they were run, where the answer is for several."""
    untried: tuple[tuple[float, float], ...] = ()
    """The corners of the limits, speeds [rad/s] and weights [N], that were not tried after cuts."""
    nothing: bool = False
    """Whether the map of the file allows nothing: what one run of the string as it is shows, and its row of the map as
    well, is no room."""
    begins: float | None = None
    """At which speed [rad/s] the ways up of the changes begin, the lowest of the file."""
    steps: tuple[float, float] | None = None
    """The greatest step [rad/s] of these ways up, and that of the file: what is free in one need not be in the
    other."""
    by_map: Change | None = None
    """The string as it is on the way up of the file, in the steps and from the histories of that. None where the file
    has none."""
    mapped: bool = False
    """Whether the file has the way up itself: that of the string as it is, among the changes, is what these are
    compared with, in their steps, and shows no setting."""
    set_down: tuple[float, float] | None = None
    """In what times [s] the weight was set on the ways in, the shortest and the longest."""
    held: tuple[float, float] | None = None
    """For how long [s] the ways in were held between the weight and the speed, or the other way round."""
    is_clear: bool = True
    """Whether a bit off bottom hangs clear of the rock in them."""
    differing: tuple[str, ...] = ()
    """What differs, in words, between what ran them and what ran the file."""

    @property
    def knocks(self) -> list[tuple[Trial, Trial | None]]:
        """The trials of a knock at the point, each with that of lowering what it started; None
        where there was none."""
        slowed = {one.after: one for one in self.trials if one.name == SLOWED}
        knocks = (one for one in self.trials if one.way == Way.KNOCK and one.name != SLOWED)
        return [(one, slowed.get(one.name)) for one in knocks]

    def is_tried(self, name: str) -> bool:
        """Whether trials of this ``name`` were run, and how they ended is known."""
        found = [one.outcome for one in self.trials if one.name == name]
        return bool(found) and Outcome.UNKNOWN not in found

    @property
    def corners(self) -> list[Trial]:
        """Those in a corner of the limits."""
        return [one for one in self.trials if one.way == Way.CORNER]

    @property
    def bad_corners(self) -> list[Trial]:
        """Those in a corner of the limits that ended in a vibration."""
        return [one for one in self.corners if one.outcome.is_bad]

    @property
    def bad_excursions(self) -> list[Trial]:
        """Those to another speed and back after which the setting vibrated."""
        return [one for one in self.trials if one.there is not None and one.outcome.is_bad]

    @property
    def bad_tag(self) -> Trial | None:
        """The :func:`bad_tag` of the setting."""
        return bad_tag(self.trials)

    def ways_in(self, name: str = "") -> list[Trial]:
        """The ways in, of one ``name`` the slower first."""
        return _ways_in(self.trials, name)

    def rates(self, name: str) -> list[Trial]:
        """The ways in of a ``name``, one for each rate, the slower first: :func:`worst_of_rates`."""
        return worst_of_rates(self.ways_in(name))

    def slower_ways(self, rate: float) -> list[Trial]:
        """Those of the weight first, for a drive that does not reach a ``rate`` [rad/s^2]: one for each rate below it
        from the slowest on that ended free; none where too few were tried to tell what lies between."""
        sure = self.sure_ways
        slower = (one for one in self.rates(WEIGHT_FIRST) if 0.0 < (one.rate or 0.0) < rate)
        free = list(takewhile(lambda one: one in sure, slower))
        return free if are_resolved(free) else []

    @property
    def sure_ways(self) -> list[Trial]:
        """The ways in that ended free and can be relied on, one for each rate; what was not run is not free."""
        return sure_ways(self.trials)

    @property
    def withdraws(self) -> bool:
        """Whether no way in ended free that can be relied on, where ways in were run; of those that were
        interrupted this is not known, unless all of them ended."""
        ways = self.ways_in()
        is_open = self.is_cut_short and any(one.outcome == Outcome.UNKNOWN for one in ways)
        return bool(ways) and not is_open and not self.sure_ways

    @property
    def as_it_is(self) -> Change | None:
        """The string without a change, where changes were run: in the steps of these."""
        return next((one for one in self.changes if not one.key), None)

    def _now(self, wob: float | None) -> Change | None:
        """The string as it is at a weight, as a change is run there; by the map where that is not known."""
        run = self.as_it_is and self.as_it_is.at(wob)
        return self.by_map.at(wob) if self.by_map is not None and (run is None or run.room is None) else run

    @property
    def wobs(self) -> list[float]:
        """The weights [N] at which changes were run, but for those of the weight."""
        found = {one.wob for change in self.changes if change.name != "weight" for one in change.every} - {None}
        return sorted(one for one in found or {self.wob} if one is not None)

    @property
    def helping(self) -> list[Change]:
        """The changes, each at each of its weights, with room for a tolerance, and more than the string has as it is at
        that weight, run in the same steps: a tolerance more where it has so much already, of which less is no gain that
        a driller can hold, unless the map, or trials, take that away. What trials cut is not compared with what none
        was run of; nor is what they show to hold the weight as well, as the setting has no room where changes are
        run."""
        return [one for change in self.changes if change.key for one in change.every if self._helps(one)]

    def _helps(self, one: Change) -> bool:
        now, mapped = self._now(one.wob), self.by_map and self.by_map.at(one.wob)
        is_here = now is not None and now.wob in (None, self.wob)  # to what the map and its trials say
        if one.trials and (one.promised > Robust.POOR or not (is_here and self.trials)):
            return one.has_room
        # room that the row of the map has not is of the steps, and the same of a change as well
        is_of_steps = now is not None and now.has_room and mapped is not None and not mapped.has_room
        least = (now.room or 0.0) if now is not None and (is_of_steps or not self.nothing) else 0.0
        is_taken = is_here and self._is_poor and not is_of_steps
        gain = 1.0 - 1e-9 if now is not None and now.has_room and not is_taken else 0.0
        return one.has_room and (one.room or 0.0) > least + gain

    @property
    def _is_poor(self) -> bool:
        """Whether the map, or trials of the setting as it is, take its room away."""
        return self.nothing or self.withdraws or self.bad_tag is not None

    @property
    def best(self) -> Change | None:
        """Of the changes that are :attr:`helping` that of the highest :attr:`Change.rank`, or the string as it is
        where it has room brought up from below, and the file did not show that. What none of its ways in
        reaches, or vibrates after a tag, helps nothing, nor, of a string that has room, what fewer ways in reach.
        None where no change helps, or where only some samples need one."""
        now = self.as_it_is
        has_room = any(one is not None and one.has_room for one in (now, self.by_map))
        if now is not None and not self.mapped and (free := [one for one in (now, *now.every) if one.has_room]):
            return None if self.samples else free[0]
        share = _free_share(self.ways_in()) if has_room and not self._is_poor else 0.0
        # where some were tried, of the others nothing more is known than of those that failed
        tried = [one for one in self.helping if one.trials] or self.helping
        found = [one for one in tried if one.is_sound and (not one.trials or one.free_ways >= share)]
        return max(found, key=lambda one: one.rank, default=None)

    def nearest_first(self, changes: Iterable[Change]) -> list[Change]:
        """``changes`` in the order in which trials of them promise most: of those as robust that take as much effort
        what is free at the weights nearest to those that are drilled with."""
        here = self.wob or 0.0
        return sorted(changes, key=lambda one: (*one.rank[:2], -abs((one.wob or here) - here), one.room), reverse=True)


def narrowed(change: Change, low: float, high: float) -> Change:
    """The ``change`` that allows no more than the speeds from ``low`` to ``high`` [rad/s], with the room that this
    leaves at its setting."""
    return replace(change, widest=(low, high), room=_room_at(change.speed or 0.0, low, high))


def deepest(change: Change) -> Change:
    """The ``change`` with its setting at the speed that has the most room in what it allows."""
    if change.widest is None:
        return change
    speed = sum(change.widest) / 2.0  # as a tolerance is a share of the speed, or a least one
    return replace(change, speed=speed, room=_room_at(speed, *change.widest))


def _room_at(speed: float, low: float, high: float) -> float:
    margin = min(speed - low, high - speed)
    return max(margin / float(tolerance("rotary_speed", np.array([speed, speed]))[0]), 0.0)


def _ways_in(trials: Iterable[Trial], name: str = "") -> list[Trial]:
    found = (one for one in trials if one.way == Way.IN and name in ("", one.name))
    return sorted(found, key=lambda one: one.rate or 0.0)


def worst_of_rates(ways: Sequence[Trial]) -> list[Trial]:
    """Of the ``ways`` at each rate, the slower first, the worst: a rate is free where all that were run at it were, as
    how long one waits, and where the bit then meets the rock, may decide."""
    found: dict[float, Trial] = {}
    for one in ways:
        rate = one.rate or 0.0
        if rate not in found or _BADNESS[one.outcome] > _BADNESS[found[rate].outcome]:
            found[rate] = one
    return list(found.values())


_BADNESS = {Outcome.FREE: 0, Outcome.UNKNOWN: 1, Outcome.VIBRATES: 2, Outcome.STALLED: 3}


def bad_tag(trials: Iterable[Trial]) -> Trial | None:
    """That of a pick up and tag with the rotation on, after which it vibrated; else None."""
    return next((one for one in trials if one.name == TAGGED and one.outcome.is_bad), None)


def free_stretches(ways: Sequence[Trial]) -> list[tuple[int, int]]:
    """The first and last place of each stretch of ``ways``, the slower first, on which one can rely: those that ended
    free at half of all rates at least, as what is free at a few of many rates is so by chance, and
    :func:`are_resolved`; without the rate beside one that did not, as such a rate vibrates in some manners in which it
    was not tried. What that leaves is more than one rate, which no one holds."""
    found = [
        (first + (first > 0), last - (last < len(ways) - 1))
        for first, last in hopeful(ways)
        if 2 * (last - first + 1) >= len(ways) and (len(ways) == 1 or are_resolved(ways[first : last + 1]))
    ]
    return [(first, last) for first, last in found if first < last or len(ways) == 1]


def are_resolved(ways: Sequence[Trial]) -> bool:
    """Whether ``ways`` side by side that ended free, the slower first, tell what lies between them: three or more,
    or two at rates as near as :data:`RESOLVED`."""
    return len(ways) > 2 or (len(ways) == 2 and (ways[1].rate or 0.0) <= RESOLVED * (ways[0].rate or 0.0))


def hopeful(ways: Sequence[Trial]) -> list[tuple[int, int]]:
    """The first and last place of each stretch of ``ways``, the slower first, of which two or more side by side
    ended free: further ones between them show whether it can be relied on."""
    found = stretches(np.array([one.outcome == Outcome.FREE for one in ways], dtype=bool))
    return [(first, last) for first, last in found if last - first + 1 >= min(len(ways), 2)]


def sure_ways(trials: Sequence[Trial]) -> list[Trial]:
    """The ways in that ended free and can be relied on, one for each rate: those of the :func:`free_stretches` of
    each order."""
    orders = [worst_of_rates(_ways_in(trials, name)) for name in (WEIGHT_FIRST, SPEED_FIRST)]
    return [one for ways in orders for first, last in free_stretches(ways) for one in ways[first : last + 1]]


def _free_share(ways: Iterable[Trial]) -> float:
    """The share of ``ways`` that ended free; 0 where there are none."""
    free = [one.outcome == Outcome.FREE for one in ways]
    return sum(free) / len(free) if free else 0.0


def free_from(ways: Sequence[Trial]) -> int:
    """From which place on all trials of ``ways``, the slower first, ended free."""
    place = len(ways)
    while place and ways[place - 1].outcome == Outcome.FREE:
        place -= 1
    return place


def counted(trials: Sequence[Trial]) -> list[Answer]:
    """How many trials of each kind ended in which way, in the order in which they were run."""
    found = []
    for name, way in dict.fromkeys((one.name, one.way) for one in trials):
        ended = [one.outcome for one in trials if (one.name, one.way) == (name, way)]
        counts = {str(outcome): ended.count(outcome) for outcome in Outcome}
        found.append({"name": name, "way": str(way), "of": len(ended), **counts})
    return found


def _plain(trials: Sequence[Trial]) -> list[Answer]:
    return [
        {
            "name": one.name,
            "way": str(one.way),
            "outcome": str(one.outcome),
            "responses": list(one.responses),
            "rate": None if one.rate is None else {"value": one.rate, "units": "rad/s^2"},
            "speed": None if one.speed is None else {"rotary_speed": one.speed},
            "wob": None if one.wob is None else {"wob": one.wob},
            "after": one.after,
            "there": None if one.there is None else {"rotary_speed": one.there},
            "why": one.why,
            "set_in": None if one.set_in is None else {"value": one.set_in, "units": "s"},
            "held": None if one.held is None else {"value": one.held, "units": "s"},
            "begun": None if one.begun is None else {"rotary_speed": one.begun},
        }
        for one in trials
    ]


def _stay_within(one: Change) -> Answer | None:
    if one.widest is None or one.weights is None:
        return None
    ends = (("rotary_speed", one.widest), ("wob", one.weights))
    return {axis: {"from": low, "to": high} for axis, (low, high) in ends}


def _plain_change(one: Change, along: str, whole: Change) -> Answer:
    left = whole.left_beside(one)
    return {
        "name": one.name,
        "key": one.key,
        "set": one.value,
        "also_set": dict(one.also),
        "wob": None if one.wob is None else {"wob": one.wob},
        "free": [{"axis": along, "from": low, "to": high} for low, high in one.free],
        "free_beside_trials": None if one.trials else [{"axis": along, "from": low, "to": high} for low, high in left],
        "room": one.room,
        "effort": one.effort.words if one.key else None,
        "robust": None if one.robust is None or not (one.key and one.has_room) else one.robust.name.lower(),
        "share_free": one.share if one.trials else None,
        "stay_within": _stay_within(one),
        "holds_with_usual_damping": one.holds_usual,
        "damping_ratio": one.ratio,
        "with_low_damping": None if one.low is None else _stay_within(one.low) if one.low.has_room else {},
        "why": one.why,
        "jump": one.jump and data_of_jump(one.jump),
        "sticks_past_wall": one.sticks_past,
        "trials_at": None if one.speed is None else {"rotary_speed": one.speed},
        "trials": _plain(one.trials),
    }


def _plain_whole(change: Change, along: str) -> Answer:
    others = [_plain_change(one, along, change) for one in change.every if one.wob != change.wob]
    return {**_plain_change(change, along, change), "at_other_weights": others}


def data_of(found: Trials, along: str) -> Answer:
    """Trials and changes as plain data: values stand under the name of their quantity."""
    return {
        "trials": _plain(found.trials),
        "trials_counted": counted(found.trials),
        "changes": [_plain_whole(change, along) for change in found.changes],
        "as_it_is_by_map": None if found.by_map is None else _plain_whole(found.by_map, along),
        "changes_begin": None if found.begins is None else {"rotary_speed": found.begins},
        "changes_step": None if found.steps is None else {"rotary_speed": found.steps[0]},
        "changes_at": None if found.wob is None else {"wob": found.wob},
        "corners_untried": [{"rotary_speed": speed, "wob": wob} for speed, wob in found.untried],
        "weight_set_in": None if found.set_down is None else dict(zip(("from", "to"), found.set_down, strict=True)),
        "held_for": None if found.held is None else dict(zip(("from", "to"), found.held, strict=True)),
        "off_bottom_clear": found.is_clear,
        "trials_interrupted": found.interrupted,
        "trials_cut_short": found.is_cut_short,
        "trials_differing": list(found.differing),
    }
