"""The class of an operating point, from what was run of it: brought up from below, lowered
from above, and started at the point.

A string is brought up to its speed, or its weight, from below. So the way up decides
whether a setting is allowed, and the way up is known before its last point is chosen.
The way down tells what a vibration that was met higher up does here: whether it lasts.
It gives the grade of an allowed point, and it withdraws a point where the motion is
near a threshold. Stick-slip that was met on the way up, and lasts at a point once it is
there, withdraws the point too, as a step of the sweep may have ended it. Hence the end
of a sweep changes no allowed point below it, but for borderline ones and where it finds
that stick-slip lasts; and as nothing is taken for granted of a run that failed, a run that
fails never makes a point safer.
"""

from __future__ import annotations

from enum import IntEnum

import numpy as np

from nsdrill.data import Array
from nsdrill.records import dataclass


class Label(IntEnum):
    """What is known of one run, the worse first."""

    OPEN = -1
    """It ended well, and the state was carried on, but its answer is not known: its check
    failed, or it was inferred and has no severity."""
    UNKNOWN = 0
    """It failed, or is missing."""
    STALLED = 1
    """The bit stays stuck."""
    CRITICAL = 2
    """It has a response, or its checks disagree."""
    TOUCHING = 3
    """It has none, but touches the wall, leaves the rock, or oscillates in torsion."""
    CLEAR = 4


class Grade(IntEnum):
    """The class of a point."""

    UNKNOWN = 0
    STALLED = 1
    CRITICAL = 2
    ONLY_FROM_ABOVE = 3
    BORDERLINE = 4
    STICKS_ON = 5
    """Free, brought up or lowered from above, but stick-slip was met below, or begins by itself, and
    lasts here once it is there: a step of the sweep may have ended it."""
    FROM_SOME = 6
    """Free from some of many starts, and not from others: which of them a string resembles is not
    known."""
    FROM_START = 7
    FROM_BELOW_ONLY = 8
    FROM_BELOW = 9
    ANY_HISTORY = 10

    @property
    def allowed(self) -> bool:
        """Whether the point may be recommended."""
        return self >= Grade.FROM_START

    def words(self, from_rest: bool = False) -> str:
        """What the grade says; ``from_rest`` is whether the bit of a start was at rest."""
        return f"safe {self.started(from_rest)}" if self == Grade.FROM_START else _WORDS[self]

    @staticmethod
    def started(from_rest: bool) -> str:
        """From what a point is free that is so from a start at it only."""
        return "only when started there with the bit at rest" if from_rest else "from a quick start only"


_WORDS = {
    Grade.UNKNOWN: "unknown",
    Grade.STALLED: "stalled",
    Grade.CRITICAL: "critical",
    Grade.ONLY_FROM_ABOVE: "only from above",
    Grade.BORDERLINE: "borderline",
    Grade.STICKS_ON: "stick-slip may last",
    Grade.FROM_SOME: "free from some starts only",
    Grade.FROM_BELOW_ONLY: "safe from below only",
    Grade.FROM_BELOW: "safe from below",
    Grade.ANY_HISTORY: "safe after any history",
}


def is_allowed(grades: Array) -> Array:
    """Where the :class:`Grade` of points is one that is allowed."""
    return np.asarray(grades >= Grade.FROM_START)


@dataclass(frozen=True)
class Ways:
    """The labels of the runs of a map, arrays of :class:`Label` with the axis along
    which the state is carried first: on the way ``up`` and ``down``, and started at the
    point, ``same``; None where that was not run. ``met`` says where the motions that
    may last were met higher up on the way down, or cannot last there. Of stick-slip,
    arrays too: whether once started it ``lasts`` at the point, or might by a run that is
    not known (``open``); whether it ``stuck`` before on the way up, or ``may`` have in a run
    that is not known; whether steady drilling is ``unstable``, so that it begins by
    itself; and whether it was ``tried`` there; and whether the point lies ``between`` two that stick when they
    are started, or ``perhaps`` does. Where it was not tried, a vibration that was met
    higher up on the way down must have ended: a way down on which none was met says
    nothing of a history.
    """

    up: Array | None = None
    down: Array | None = None
    same: Array | None = None
    met: Array | bool = True
    lasts: Array | bool = False
    open: Array | bool = False
    stuck: Array | bool = False
    unstable: Array | bool = False
    tried: Array | bool = True
    may: Array | bool = False
    between: Array | bool = False
    perhaps: Array | bool = False
    allowed: Array | bool = False

    def grades(self) -> Array:
        """The :class:`Grade` of every point."""
        down = None if self.down is None else carried(self.down[::-1])[::-1]
        if self.up is None:
            grades = self._of_islands(_alone(None if self.same is None else as_known(self.same), down))
            sticks = np.asarray(self.unstable) | (np.asarray(self.stuck) & self.lasts)
            is_free = (grades >= Grade.FROM_START) | (grades == Grade.ONLY_FROM_ABOVE)
            return np.where(is_free & sticks, Grade.STICKS_ON, grades)
        up = carried(self.up)
        is_clear = up == Label.CLEAR
        grades = np.select(
            [up == Label.UNKNOWN, up == Label.STALLED, up == Label.CRITICAL, up == Label.TOUCHING],
            [Grade.UNKNOWN, Grade.STALLED, Grade.CRITICAL, Grade.BORDERLINE],
            Grade.FROM_BELOW,
        )
        if down is not None:
            after, may = excursion(up, down), excursion(up, down, (Label.UNKNOWN,))
            ends_well = (down == Label.CLEAR) & self.met & (after | self.tried)
            vibrates = (down == Label.CRITICAL) | (down == Label.STALLED)
            grades = np.select(
                [
                    is_clear & ends_well,
                    is_clear & vibrates & (after | self.allowed),
                    is_clear & vibrates & may,
                    is_clear & (down == Label.STALLED),
                    is_clear & (down == Label.UNKNOWN),
                    is_clear & (down != Label.CLEAR),
                    (up == Label.CRITICAL) & (down == Label.STALLED),
                    (up == Label.CRITICAL) & (down >= Label.TOUCHING),
                ],
                [
                    Grade.ANY_HISTORY,
                    Grade.FROM_BELOW_ONLY,
                    Grade.UNKNOWN,
                    Grade.STALLED,
                    Grade.UNKNOWN,
                    Grade.BORDERLINE,
                    Grade.STALLED,
                    Grade.ONLY_FROM_ABOVE,
                ],
                grades,
            )
        # a run that was lowered there had not left steady drilling yet
        grades = np.where((grades == Grade.ONLY_FROM_ABOVE) & self.unstable, Grade.CRITICAL, grades)
        allowed = is_allowed(grades)
        # nor does a way down that is not known take away what is known of stick-slip
        is_open = is_clear & (grades == Grade.UNKNOWN)
        grades = np.select(
            [
                (allowed | is_open) & (self.unstable | (self.stuck & self.lasts)),
                allowed & ((self.stuck & self.open) | (self.may & (self.lasts | self.open))),
                (grades == Grade.ANY_HISTORY) & (self.lasts | self.open),
            ],
            [Grade.STICKS_ON, Grade.UNKNOWN, Grade.FROM_BELOW],
            grades,
        )
        if self.same is not None:
            has_way = np.isin(grades, (Grade.CRITICAL, Grade.ONLY_FROM_ABOVE, Grade.STICKS_ON)) & ~np.asarray(
                self.unstable
            )
            is_started, is_lost = self.same == Label.CLEAR, self.same <= Label.UNKNOWN
            if down is not None:  # on which the bit may have stalled
                is_lost = is_lost | (is_started & (down == Label.UNKNOWN))
            # a bit that sticks once, in a hard streak, does not come free again
            sticks = has_way & is_started & self.lasts & ~np.asarray(self.between)
            is_lost = is_lost | (is_started & self.open & ~np.asarray(self.lasts))
            is_lost = is_lost & ~((grades == Grade.STICKS_ON) & self.lasts)  # which no start would make free
            grades = np.select(
                [sticks, has_way & is_lost, has_way & is_started],
                [Grade.STICKS_ON, Grade.UNKNOWN, Grade.FROM_START],
                grades,
            )
            clear = self.same == Label.CLEAR
            grades = np.where((grades == Grade.ANY_HISTORY) & ~clear, Grade.FROM_BELOW, grades)
        return self._of_islands(np.asarray(grades))

    def _of_islands(self, grades: Array) -> Array:
        """The ``grades``, with a start that comes free among those that stick as near a limit."""
        starts = grades == Grade.FROM_START
        return np.select([starts & self.between, starts & self.perhaps], [Grade.BORDERLINE, Grade.UNKNOWN], grades)


def _alone(same: Array | None, down: Array | None) -> Array:
    """The grades where nothing was brought up: how a point is reached was not run."""
    if same is None:
        assert down is not None, "a map has at least one way"
        grades, clear = down, Grade.ONLY_FROM_ABOVE
    else:
        grades, clear = same, Grade.FROM_START
    return np.select(
        [grades == label for label in (Label.UNKNOWN, Label.STALLED, Label.CRITICAL, Label.TOUCHING)],
        [Grade.UNKNOWN, Grade.STALLED, Grade.CRITICAL, Grade.BORDERLINE],
        clear,
    )


def carried(labels: Array) -> Array:
    """The labels of a way whose first point is the first: after a run that failed no state
    was carried, and so nothing is known of the rest of its chain."""
    lost = np.logical_or.accumulate(labels == Label.UNKNOWN, axis=0)
    return np.where(lost, Label.UNKNOWN, as_known(labels))


def as_known(labels: Array) -> Array:
    """The labels with those that are open as unknown."""
    return np.maximum(labels, Label.UNKNOWN)


def excursion(up: Array, down: Array, of: tuple[Label, ...] = (Label.CRITICAL, Label.STALLED)) -> Array:
    """Where a vibration, or a run ``of`` other labels, was met before on the way down: at a
    point higher up on it, or at the last point of the way up."""
    begins = np.isin(up[-1:], of)
    higher = np.isin(down[:0:-1], of)
    return np.asarray(np.logical_or.accumulate(np.concatenate([begins, higher]), axis=0)[::-1])


def of_starts(labels: Array, sticks: Array | bool = False, between: Array | bool = False) -> Array:
    """The grades of points that were run from many starts, the last dimension of
    ``labels``: safe after any history where every start is, and free from some only, which is not
    allowed, where some are and others are known not to be. The point itself says nothing of how
    they are reached. As of one start, stick-slip ``sticks`` where it may last by the model, and a
    point ``between`` two at which it does is near a limit, whatever the starts that were drawn
    show."""
    is_known = labels != Label.UNKNOWN
    is_safe = labels >= Label.TOUCHING
    some = is_safe.any(axis=-1) & (is_known & ~is_safe).any(axis=-1)
    stalls = (labels == Label.STALLED).any(axis=-1)
    every = is_safe.all(axis=-1)
    return np.select(
        [every & sticks, every & between, every, some, ~is_known.all(axis=-1), stalls],
        [Grade.STICKS_ON, Grade.BORDERLINE, Grade.ANY_HISTORY, Grade.FROM_SOME, Grade.UNKNOWN, Grade.STALLED],
        Grade.CRITICAL,
    )
