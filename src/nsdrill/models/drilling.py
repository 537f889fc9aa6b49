"""Steady drilling at an operating point, as ``check`` shows it of every model of a
string: at which speed motor and bit balance, what torque that takes, below which speeds
the bit sticks and slips, and whether the drive can break the bit away. All of it is of
the equations of the model (:mod:`nsdrill.models.steady`).

**Stick-slip.** Up to which speed it lasts once it is there is found from its cycle
(:mod:`nsdrill.models.cycle`), on a straight string without lobes.

**Estimates of its period and greatest speed.** A bit whose friction falls by D as it breaks away, on a
string of stiffness k and frequency w whose top turns at the speed v, slips and sticks
as::

    omega = v (1 - cos w t) + a sin w t,   a = D w / k
    greatest speed v + sqrt(v^2 + a^2)
    period 2 (pi - atan(a / v)) / w + 2 D / (k v)
    sticks for 2 D / (k v) of it

with the friction of a slip at its mean speed, 2 v. The period of free torsional motion,
2 pi / w, is less than this wherever v is less than D w / k, and a bit that sticks for
long has one of a multiple of it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import product
from typing import Any, NamedTuple, TypeAlias, TypeVar

import numpy as np

from nsdrill.data import Array
from nsdrill.errors import from_to
from nsdrill.models.begin import begin_below
from nsdrill.models.drive_laws import AT_BEND, growing, unknown_by_bend
from nsdrill.models.lockstep import results
from nsdrill.models.numbers import FOLD_ERROR, OFF_SPEED, DerivedQuantity, FormatValue
from nsdrill.models.operation import Values
from nsdrill.models.own_drives import numbered, own_drive
from nsdrill.models.parts import values_at
from nsdrill.models.steady import SPEEDS, TRIED, Ask, Balance, Fold, Search, String, refined
from nsdrill.records import dataclass

S = TypeVar("S")
T = TypeVar("T")

SLOW = np.geomspace(1e-4, 1.0, 101)  # of a speed: those on the way up to it from rest
SLOW_FOLD = 0.5  # rad/s: below it the end of stick-slip by its cycle lies up to 56 % below that of runs with a drive
SWING_ERROR = 0.05  # of the swing of the motor's torque in the cycle of stick-slip: it is off by up to 2 %
LEAST_EXCESS = 1e-6  # relative; a torque that exceeds another one by less does not


class Stall(NamedTuple):
    """A bit at rest that the drive does not break away: the torque that it takes, and
    the torque that the drive has where it lacks most [N m]; and the least set speed
    [rad/s] at which it would have it, None where a limit of torque is in the way."""

    needed: float
    available: float
    set_speed: float | None


class Estimates(NamedTuple):
    """Of stick-slip: its period [s], the greatest bit speed [rad/s], and the part of the
    time in which the bit sticks."""

    period: float
    peak: float
    stuck: float


Limits: TypeAlias = tuple[float, float | None] | None


@dataclass(frozen=True, eq=False)
class Drilling:
    """Steady drilling of a ``string`` at a set speed [rad/s] under a weight on bit [N].

    ``frequency`` [rad/s] and ``stiffness`` [N m/rad] are those of the first torsional
    mode below a held top; ``limit`` is the torque limit of the drive [N m], None
    without one; ``top_drag`` [N m s/rad] brakes the top beside the string.
    """

    string: String
    set_speed: float
    wob: float
    bit_diameter: float
    frequency: float
    stiffness: float
    limit: float | None = None
    top_drag: float = 0.0

    @property
    def period(self) -> float:
        """The period [s] of the first torsional mode below a held top."""
        return 2.0 * math.pi / self.frequency

    @cached_property
    def at(self) -> Balance:
        """Of several kinds of steady drilling the fastest; where no balance turns, the
        bit that creeps. Within a limit or not."""
        find_balances([self])
        return self.at

    @property
    def speed(self) -> float:
        """The speed of the bit [rad/s] there."""
        return float(self.at.speed)

    @cached_property
    def turns(self) -> bool:
        """Whether the bit turns in steady drilling, with a torque within the limit."""
        within = self.limit is None or self.torque <= self.limit * (1 + LEAST_EXCESS)
        return within and self.string.turns(self.at, self.set_speed)

    @property
    def holds_or_turns(self) -> bool:
        """Whether it tells something that a drive may lack the torque to break the bit away: where no
        balance turns, that is told instead."""
        return self.string.holds or self.turns

    @cached_property
    def droops(self) -> bool:
        """Whether the drive turns slower than the set speed under this torque."""
        return not self.string.holds and abs(self.set_speed - self.speed) > LEAST_EXCESS * self.set_speed

    def torque_at(self, at: Balance) -> Array:
        """The torque that the drive gives the string and the top [N m]."""
        return np.asarray(self.string.value("surface_torque", at) + self.top_drag * at.speed)

    @cached_property
    def torque(self) -> float:
        """That of steady drilling."""
        return float(self.torque_at(self.at))

    @cached_property
    def rock_torque(self) -> float:
        """That of the rock on the bit."""
        find_balances([self])
        return self.rock_torque

    @cached_property
    def twist(self) -> float:
        """The angle of the bit less that of the drive [rad]."""
        return float(self.twist_at(self.at))

    def twist_at(self, at: Balance) -> Array:
        """The same in other steady drilling."""
        angles = at.angles
        below_top = len(self.string.turning.angles) > 1 and self._top
        return np.asarray(angles[..., -1] - angles[..., 0] if below_top else angles[..., -1])

    def torques_below(self, speeds: Array) -> Array:
        """The torques that twist the string in steady drilling at bit speeds [rad/s], at
        this set speed, as torques on the bit: of a string that rubs elsewhere each with
        the share of the twist that it makes [N m]."""
        set_speeds = np.full(np.shape(speeds), self.set_speed)
        if not self.string.rubs:
            return self.string.bit_torque(speeds, set_speeds)
        return -self.stiffness * self.twist_at(self.string.balance(speeds, set_speeds))

    @property
    def _top(self) -> bool:
        """Whether the first angle is that of the top."""
        return self.string.turning.angles[0] == "lag"

    @cached_property
    def matrix(self) -> Array:
        """That of small deviations from it, without friction at the bit."""
        return self.string.linear(self.at)[0]

    @property
    def slope_held(self) -> float:
        """That for a chart: NaN where the drive bends there, so that it is not known."""
        return math.nan if self.bends else self.withstood

    @cached_property
    def withstood(self) -> float:
        """The steepest fall of the torque on the bit with its speed [N m s/rad] with
        which steady drilling is stable."""
        return float(self.string.withstood(self.at))

    @cached_property
    def bends(self) -> bool:
        """Whether the drive bends at it: its derivative there is that of one side, and nothing that
        is linear is known of small deviations."""
        return self.known and self.string.bends(self.at)

    @cached_property
    def onset(self) -> Balance | None:
        find_onsets([self])
        return self.onset

    @cached_property
    def onset_known(self) -> bool:
        """Whether it is known: not where the search for it finds no balance of motor and bit, and
        not where the drive bends at the steady drilling that it finds."""
        find_onsets([self])
        return self.onset_known

    @cached_property
    def _bends_at_onset(self) -> bool:
        find_onsets([self])
        return self._bends_at_onset

    def bends_at_onset(self, onset: Balance | None) -> bool:
        """Whether the drive bends at the steady drilling of an ``onset``; where that is at no finite
        speed, at this one."""
        is_there = onset is not None and np.isfinite(onset.speed) and np.isfinite(onset.set_speed)
        return self.string.bends(onset) if onset is not None and is_there else self.bends

    @cached_property
    def unstable_ranges(self) -> list[tuple[float, float]]:
        """The ranges of bit speeds [rad/s] at which steady drilling is unstable to stick-slip,
        between which it is stable: several of a law that falls again at faster slip, to
        the 1 % of the speeds that are tried. Empty where it is stable at every speed, and where no
        steady drilling is known."""
        string, onset = self.string, self.onset
        if onset is None or not self.known:
            return []
        held = float(string.withstood(onset if np.isfinite(onset.speed) else self.at))

        def grows(speeds: Array) -> Array:
            if string.rubs:
                return string.grows(speeds)
            return np.asarray(string.fall(speeds, None if string.holds else string.balance(speeds).set_speed) > held)

        def is_stable(speeds: Array) -> Array:
            return ~grows(speeds)

        tried = (TRIED if string.rubs else SPEEDS).tolist()
        ends = np.flatnonzero(np.diff(np.concatenate([[False], grows(np.array(tried)), [False]]))).reshape(-1, 2)
        return [
            (
                refined(is_stable, tried[first - 1], tried[first], 9, 8)[1] if first else 0.0,
                refined(grows, tried[end - 1], tried[end], 9, 8)[0] if end < len(tried) else math.inf,
            )
            for first, end in ends.tolist()
        ]

    @cached_property
    def missed(self) -> tuple[float, float, float]:
        """By how much of its greatest magnitude the torque of the bit falls at most between two
        neighbours of the speeds that are tried, up to :data:`FAST`, beyond what its slopes show,
        and these speeds [rad/s]."""
        speeds = SPEEDS[SPEEDS <= FAST]
        torque, fall = self.string.bit_torque(speeds), self.string.fall(speeds)
        unseen = -np.diff(torque) - 0.5 * np.diff(speeds) * (fall[1:] + fall[:-1])
        place = int(np.argmax(unseen))
        return float(unseen[place] / np.max(np.abs(torque))), float(speeds[place]), float(speeds[place + 1])

    @cached_property
    def fold(self) -> Balance | None:
        """The fastest steady drilling beside which stick-slip, once it is there, lasts, at least
        the :attr:`onset`, below which a swing lasts that does not stop the bit; at an
        infinite speed where it lasts at every speed."""
        find_folds([self])
        return self.fold

    @cached_property
    def fold_known(self) -> bool:
        """Whether the :attr:`fold` is that of all stick-slip. Of a drive that is not linear it is
        that of one cycle of several: from another start stick-slip may last to higher speeds, as
        with a limit of torque that the string was wound up against, or to lower ones. Where the
        torque of its cycle stays within the limit it is known."""
        return self.fold_sought and (self.limit is None or self._is_free or self._is_within(self.limit))

    @cached_property
    def fold_sought(self) -> bool:
        """Whether it is known if no limit of torque is in the way."""
        return self.known and (self._is_free or (self.rock_torque > 0.0 and self.onset_known and not self._is_curved))

    @property
    def _is_free(self) -> bool:
        """Whether the rock takes no torque, so that nothing sticks: a bit that rests at this set
        speed takes none of a drive with hardly any, but has an onset at another."""
        return self.rock_torque <= 0.0 and (self.turns or (self.onset is None and self.onset_known))

    def _is_within(self, limit: float) -> bool:
        """Whether the motor's torque is between 0 and a ``limit`` [N m] in the cycle of the
        :attr:`fold`. False where there is none, so that nothing tells."""
        find_folds([self])
        if self.cycle is None or not np.isfinite(self.cycle.at.set_speed):
            return False
        low, high = self.string.motor_torques(self.cycle, self.period, self.stiffness)
        margin = SWING_ERROR * (high - low)
        return low >= margin and high <= limit - margin

    @cached_property
    def cycle(self) -> Fold | None:
        """The cycle of stick-slip at the greatest speed at which it lasts, None where it does at
        none."""
        find_folds([self])
        return self.cycle

    @property
    def lasts_below(self) -> float | None:
        """The set speed of the :attr:`fold` [rad/s], infinite where stick-slip lasts at every
        speed; None where it lasts at none, and NaN where it is not known."""
        if not self.fold_known:
            return math.nan
        return None if self.fold is None else float(self.fold.set_speed)

    def may_last_at(self, set_speed: float) -> bool:
        """Whether stick-slip, once it is there, goes on at a ``set_speed`` [rad/s], or whether
        that is not known."""
        return not self.fold_known or (self.fold is not None and bool(set_speed < self.fold.set_speed))

    @cached_property
    def lasts_to(self) -> float:
        """The set speed [rad/s] up to which stick-slip, once it is there, may last, with the
        error of the :attr:`fold`; 0 where it does not last, infinite where it lasts at
        every speed."""
        return 0.0 if self.fold is None else FOLD_ERROR * float(self.fold.set_speed)

    @cached_property
    def unstable_to(self) -> float:
        """The set speed [rad/s] below which steady drilling is unstable to stick-slip; 0 where
        it is stable, infinite where it is stable at no speed."""
        return 0.0 if self._is_free or self.onset is None else float(self.onset.set_speed)

    def as_set_speed(self, speed: float) -> float:
        """The set speed at which the bit turns at a ``speed`` in steady drilling
        [rad/s]."""
        if self.string.holds or not 0.0 < speed < math.inf:
            return speed
        return float(self.string.balance(speed).set_speed)

    @cached_property
    def _on_the_way(self) -> Balance:
        """The balances of motor and bit at speeds on the way up from rest, at this set speed."""
        speeds = SLOW * (self.speed if self.turns and self.speed > 0.0 else self.set_speed)
        return self.string.balance(speeds, np.full(len(speeds), self.set_speed))

    @cached_property
    def known(self) -> bool:
        """Whether a balance of motor and bit is found, at which the bit turns or does not: none
        is of a drive at a limit of its own, nor of one without any torque."""
        if self._may_lack or (self._is_curved and self.speed == 0.0):
            return self.string.is_settled(self.at)
        return self.string.holds or math.isfinite(self.string.balance(self.speed, self.set_speed).set_speed)

    @cached_property
    def _may_lack(self) -> bool:
        """Whether it is a drive that holds its angle, of a script, and not linear: it may have
        less torque than the bit takes, however far it lags behind."""
        return self.string.holds and self._is_curved

    @property
    def _is_curved(self) -> bool:
        """Whether it is a drive of a script that is not linear."""
        drive = getattr(self.string.motion.options, "drive", 0)
        return bool(drive) and not numbered(drive).is_linear

    @cached_property
    def _supply(self) -> tuple[Array, Array] | None:
        """The torque that the bit takes at the speeds on the way up from rest, and the greatest
        that such a drive has [N m]; None of another, and where it is not known, as with states
        of its own, or a drive that cannot have as little."""
        if not self._may_lack or self.string.turning.others or self.string.rubs:
            return None
        taken, least, most = self.string.demand_and_supply(SLOW * self.set_speed, self.set_speed)
        taken = taken + self.top_drag * SLOW * self.set_speed
        is_known = np.all(np.isfinite(taken) & np.isfinite(most)) and np.all(least <= taken)
        return (taken, most if self.limit is None else np.minimum(most, self.limit)) if is_known else None

    @cached_property
    def breaks_known(self) -> bool:
        """The same at all speeds on the way up from rest."""
        if self._may_lack:
            return self._supply is not None
        return self.string.holds or bool(np.all(np.isfinite(self._on_the_way.set_speed)))

    @cached_property
    def stall(self) -> Stall | None:
        """What the drive lacks to break the bit away from rest, None where it does not, or
        where that is not known. The bit is brought up to speed as slowly as one likes."""
        if self.string.holds and self.limit is None and not self._may_lack:
            return None
        if not self.breaks_known:
            return None
        if self._supply is not None:
            needed, available = self._supply
            worst = int(np.argmax(needed - available))
            lacks = needed[worst] > available[worst] * (1 + LEAST_EXCESS)
            return Stall(float(needed[worst]), float(available[worst]), None) if lacks else None
        at = self._on_the_way
        speeds, needed = at.speed, self.torque_at(at)
        available, least = np.full(len(speeds), math.inf), None
        if not self.string.holds:
            short = at.set_speed - self.set_speed  # of the set speed
            slower = self.string.speed_per_torque(at)
            # one that turns faster under load winds the string up until the bit breaks away
            droops = slower > 0.0
            available = np.where(droops, needed - short / np.where(droops, slower, 1.0), math.inf)
            least = float(np.max(at.set_speed))
        if self.limit is not None and np.any(available > self.limit):
            available = np.minimum(available, self.limit)
            least = None if np.max(needed) > self.limit else least
        worst = int(np.argmax(needed - available))
        if needed[worst] <= available[worst] * (1 + LEAST_EXCESS):
            return None
        return Stall(float(needed[worst]), float(available[worst]), least)

    @cached_property
    def runs_away(self) -> bool:
        """Whether the drive turns faster under load, and at no speed of the bit as fast as
        the load lets it."""
        return not self.string.holds and not self.turns and float(self.string.speed_per_torque(self.at)) < 0.0

    @cached_property
    def least_set_speed(self) -> float:
        """Of a drive that droops, the least set speed at which the bit can turn
        [rad/s]."""
        speeds = SLOW * max(self.set_speed, 1.0) * 10.0
        taken = self.string.balance(speeds).set_speed
        turning = np.array([self.string.turns(_at_speed(w), s) for w, s in zip(speeds, taken, strict=True)])
        taken = taken[turning & (taken > 0.0)]  # one that gives more torque than the load takes any
        return float(np.min(taken)) if taken.size else math.inf

    @cached_property
    def estimates(self) -> Estimates | None:
        """Those of stick-slip; None where friction does not fall, or no bit turns."""
        v = self.speed
        if not self.turns or (self.rock_torque <= 0.0 and not self.string.rubs):
            return None
        greatest = float(np.max(self.torques_below(SLOW * v)))
        fall = greatest - float(self.torques_below(np.array([2.0 * v]))[0])
        if fall <= 0.0:
            return None
        a = fall * self.frequency / self.stiffness
        sticking = 2.0 * fall / (self.stiffness * v)
        period = 2.0 * (math.pi - math.atan(a / v)) / self.frequency + sticking
        return Estimates(period, v + math.hypot(v, a), sticking / period)

    @property
    def aggressiveness(self) -> float | None:
        """36 T/(D W) with the torque of the rock in ft lbf, the bit's diameter in in
        and the weight on it in lbf; None without a weight."""
        return 3.0 * self.rock_torque / (self.bit_diameter * self.wob) if self.wob > 0.0 else None

    def quantities(self, *, fold: bool = True) -> dict[str, DerivedQuantity]:
        """What ``check`` says of this, by name; with the ``fold``, which takes longer."""
        estimates = self.estimates
        onset = "speed below which steady drilling is unstable to stick-slip"
        if len(self.unstable_ranges) > 1:
            onset = "greatest speed at which steady drilling is unstable to stick-slip; it is stable at some below"
        quantities = {
            "balance_speed": DerivedQuantity(
                self.speed if self.turns else None, "rad/s", "bit speed in steady drilling at this set speed"
            ),
            **(
                {"droop": DerivedQuantity(self.set_speed - self.speed, "rad/s", "set speed less that of the bit")}
                if self.droops
                else {}
            ),
            "mean_torque": DerivedQuantity(
                self.torque, "N m", "steady torque at the surface, with what turns the string off bottom at this speed"
            ),
            "static_twist": DerivedQuantity(self.twist, "rad", "steady twist of the string"),
            "aggressiveness": DerivedQuantity(
                self.aggressiveness, "1", "aggressiveness of the bit, 36 T/(D W) in ft lbf, in and lbf"
            ),
            "slope_held": DerivedQuantity(
                self.withstood,
                "N m s/rad",
                "steepest fall of the bit's torque with speed that steady drilling withstands",
            ),
            **self.critical("stick_slip_onset", self.onset, onset),
        }
        if fold:
            meaning = "up to this speed stick-slip, once started, persists "
            meaning += self._how_well if self.fold_known else self._why_unknown
            quantities |= self.critical(FOLD, self.fold if self.fold_known else None, meaning)
        period, peak, stuck = estimates or (None, None, None)
        if not self.known:
            quantities |= {name: replace(quantities[name], value=None) for name in quantities.keys() & {*OF_BALANCE}}
        if self.bends:
            quantities |= unknown_by_bend({name: quantities[name] for name in ("slope_held",)})
        if self._bends_at_onset:
            quantities |= unknown_by_bend(
                {name: one for name, one in quantities.items() if name.startswith(STICK_SLIP_ONSET)}
            )
        lacking = self._unknown
        quantities |= {
            name: replace(one, known=False)
            for name, one in quantities.items()
            if one.value is None and any(name.startswith(part) for part in lacking)
        }
        return quantities | {
            "stick_slip_period": DerivedQuantity(period, "s", "period of stick-slip at this speed, an estimate"),
            "stick_slip_peak": DerivedQuantity(peak, "rad/s", "greatest bit speed in stick-slip, an estimate"),
            "stick_slip_stuck": DerivedQuantity(stuck, "1", "part of the time with the bit stuck, an estimate"),
            "free_period": DerivedQuantity(
                self.period, "s", "period of free torsion, top held: stick-slip takes longer unless the drive is soft"
            ),
        }

    @property
    def _how_well(self) -> str:
        """To how much the :attr:`fold` is that of runs: of 310 random strings, and of those with a drive that answers
        the torque mostly from 2.3 % below to 5 % above, once 12 % below, and at slow speeds worse."""
        if self.string.holds:
            return "(by its cycle, to 2 %)"
        if self.fold is not None and self.fold.set_speed < SLOW_FOLD:
            return f"(by its cycle, rough below {SLOW_FOLD:g} rad/s)"
        return "(by its cycle, to 5 % with most drives)"

    @property
    def _unknown(self) -> tuple[str, ...]:
        """Which quantities are not known rather than absent."""
        if not self.known:
            return (*OF_BALANCE, STICK_SLIP_ONSET, FOLD)
        if not self._is_free and not self.onset_known:
            return (STICK_SLIP_ONSET, FOLD)
        return () if self.fold_known else (FOLD,)

    @property
    def _why_unknown(self) -> str:
        """Why the :attr:`fold` is not known."""
        if self._bends_at_onset:
            return AT_BEND
        if not self.known or not self.onset_known:
            return "(no balance of motor and bit is found)"
        if self.rock_torque <= 0.0:
            return "(the bit rests at this set speed, with a drive that has no torque to turn it)"
        if not self.fold_sought:
            return "(with a drive that is not linear it depends on the start)"
        reached = self.cycle is not None and np.isfinite(self.cycle.at.set_speed)
        return f"(with a torque limit {'that its cycle reaches ' if reached else ''}it depends on the start)"

    def critical(self, name: str, at: Balance | None, meaning: str) -> dict[str, DerivedQuantity]:
        """A critical speed, as a set speed; with a drive that droops as a speed of the
        bit as well."""
        return self._speeds(name, None if at is None else (float(at.set_speed), float(at.speed)), meaning)

    def critical_speed(self, name: str, speed: float | None, meaning: str, group: str) -> dict[str, DerivedQuantity]:
        """As :meth:`critical`, of a critical ``speed`` of the bit [rad/s]."""
        return self._speeds(name, None if speed is None else (self.as_set_speed(speed), speed), meaning, group)

    def _speeds(
        self, name: str, speeds: tuple[float, float] | None, meaning: str, group: str = "rotation"
    ) -> dict[str, DerivedQuantity]:
        set_speed, bit = speeds or (None, None)
        everywhere = set_speed == bit == math.inf
        if set_speed is not None and not math.isfinite(set_speed):  # at every speed, or no balance is found
            set_speed = bit = None
        found = {name: DerivedQuantity(set_speed, "rad/s", meaning, group, everywhere=everywhere)}
        if self.droops:
            found[f"{name}_at_bit"] = DerivedQuantity(
                bit, "rad/s", "the same as a speed of the bit", group, everywhere=everywhere
            )
        return found


def find_balances(found: Sequence[Drilling]) -> None:
    """Finds :attr:`Drilling.at` and the :attr:`Drilling.rock_torque` of many, together, which
    takes less time than one by one."""
    for one, at in _searched(found, "at", lambda one: one.string.at_set_speed(one.set_speed)):
        if one.string.holds and not np.isfinite(at.set_speed):  # none is found, which `known` tells
            at = at._replace(set_speed=np.asarray(one.set_speed))
        vars(one)["at"] = at  # where a cached property is kept
    for one, torque in _searched(found, "rock_torque", lambda one: _asked("bit_torque", one.speed, one.set_speed)):
        vars(one)["rock_torque"] = float(torque)


def _asked(method: str, *arguments: float) -> Search[Array]:
    return (yield Ask(method, arguments))


def find_onsets(found: Sequence[Drilling]) -> None:
    """Finds the :attr:`Drilling.onset` of many likewise."""
    for one, onset in _searched(found, "onset", lambda one: one.string.onset(one.set_speed)):
        known = onset is None or not np.isnan(onset.set_speed)
        vars(one)["_bends_at_onset"] = one.bends_at_onset(onset)
        known = known and not one._bends_at_onset
        vars(one).update(onset=onset if known else None, onset_known=known)


def folds(drilling_at: Callable[[Any, Any], Drilling], settings: Sequence[Values]) -> list[float | None]:
    """The :attr:`Drilling.lasts_below` [rad/s] of many settings together, each the
    :class:`Drilling` that ``drilling_at`` gives of its parameters and its operating point."""
    found = [drilling_at(one.parameters, one.point) for one in settings]
    _find_known_folds(found)
    return [one.lasts_below for one in found]


def limits(found: Sequence[Drilling | Limits]) -> list[Limits]:
    """The speeds :attr:`Drilling.unstable_to` and :attr:`Drilling.lasts_to` of many, with
    limits that are known between them; None where the onset is not known, and of the second
    where the fold is not."""
    _find_known_folds([one for one in found if isinstance(one, Drilling)])

    def told(one: Drilling) -> Limits:
        if one.fold_known:
            return one.unstable_to, one.lasts_to
        return (one.unstable_to, None) if one.known and one.onset_known else None

    return [told(one) if isinstance(one, Drilling) else one for one in found]


def limits_unless_shaken(
    settings: Sequence[S], found_at: Callable[[S], Drilling | Limits], is_shaken: Callable[[S, float], bool]
) -> list[Limits]:
    """The :func:`limits` of what is ``found_at`` each of the ``settings``; None where lobes may
    shake the bit loose, at rest or at one of these speeds."""
    found = limits([None if is_shaken(one, 0.0) else found_at(one) for one in settings])
    return [
        None if any(is_shaken(one, speed) for speed in ends or () if speed is not None) else ends
        for one, ends in zip(settings, found, strict=True)
    ]


def find_folds(found: Sequence[Drilling]) -> None:
    """Finds the :attr:`Drilling.fold` of many likewise."""
    find_balances(found)
    drilled = [one for one in found if one.rock_torque > 0.0]
    find_onsets(drilled)
    for one, cycle in _searched(drilled, "cycle", lambda one: one.string.fold(one.period, one.stiffness)):
        fold = None if cycle is None else cycle.at
        above = one.onset is not None and (fold is None or one.onset.set_speed > fold.set_speed)
        vars(one).update(cycle=cycle, fold=one.onset if above else fold)
    for one in found:
        vars(one).setdefault("cycle", None)
        vars(one).setdefault("fold", None)


def _find_known_folds(found: Sequence[Drilling]) -> None:
    """The same of those whose :attr:`Drilling.fold` may be known."""
    find_balances(found)
    find_onsets([one for one in found if one.rock_torque > 0.0])
    find_folds([one for one in found if one.fold_sought])


def _searched(
    found: Sequence[Drilling], name: str, search: Callable[[Drilling], Search[T]]
) -> Iterator[tuple[Drilling, T]]:
    """The results of searches for what of this ``name`` is not known yet."""
    unknown = [one for one in found if name not in vars(one)]
    return zip(unknown, results([(one.string, search(one)) for one in unknown]), strict=True)


def _at_speed(speed: float) -> Balance:
    return Balance(np.asarray(speed), np.asarray(speed), np.zeros(0), np.zeros(0))


FAST = 300.0  # rad/s: no bit turns faster
STICK_SLIP_ONSET, FOLD = "stick_slip_onset", "stick_slip_fold"
OF_BALANCE = ("balance_speed", "droop", "mean_torque", "static_twist", "aggressiveness", "slope_held")
MOST_WEIGHTS = 9  # at which it is looked whether a sweep begins above the onset


def _never_shaken(at: Values, speed: float) -> bool:
    return False


def begins_above_onset(
    study: Any, drilling_at: Callable[[Any, Any], Drilling], is_shaken: Callable[[Values, float], bool] = _never_shaken
) -> list[dict[str, Any]]:
    """The onset of stick-slip where a sweep up in speed begins above it and below the fold, or
    where that is not known, as where lobes may shake the bit (``is_shaken``, as of
    :func:`limits_unless_shaken`): a string that is brought up from below sticks and slips there,
    and goes on with it, or may. One entry as those of
    :func:`nsdrill.models.christoforou_yigit.critical_speeds.lasting_motions`, with the
    ``weights`` on bit [N] at which that is so, from and to, whether it only ``may`` at one of
    them, and whether the bit ``turns`` from the start on at one of them, so that a run need
    not stick at the first speed; none where it
    is so at no weight, or with many starts. Of uncertain numbers the nominal ones count."""
    is_up = study.procedure in ("up", "up-down", "all") and study.along == "rotary_speed" in study.swept
    if study.initial.starts or not is_up:
        return []
    first, axes = float(study.axes["rotary_speed"][0]), dict(study.axes)
    weights = np.asarray(axes["wob"], dtype=float)
    places = sorted({round(place) for place in np.linspace(0, len(weights) - 1, MOST_WEIGHTS).tolist()})
    ends = {name: list(dict.fromkeys((values[0], values[-1]))) for name, values in axes.items()}
    ends |= {"rotary_speed": [first], "wob": weights[places].tolist()}
    tried = [
        (at, drilling_at(at.parameters, at.point))
        for values in product(*ends.values())
        for at in [values_at(study.parameters, study.initial, dict(zip(ends, values, strict=True)))]
    ]
    find_balances([one for _, one in tried])
    find_onsets([one for _, one in tried])
    above = [(at, one) for at, one in tried if 0.0 < one.unstable_to < first]
    _find_known_folds([one for _, one in above])
    unknown = [not one.fold_known or _is_shaken_in(at, one, is_shaken) for at, one in above]
    lasts = [is_open or one.may_last_at(first) for is_open, (_, one) in zip(unknown, above, strict=True)]
    found = [each for each, is_there in zip(above, lasts, strict=True) if is_there]
    if not found:
        return []
    speeds, looked_at = [one.unstable_to for _, one in found], weights[places].tolist()
    low, high = (end(looked_at.index(one.wob) for _, one in found) for end in (min, max))
    if len(looked_at) < len(weights):  # those up to the next weight that was looked at count too
        low, high = max(low - 1, 0), min(high + 1, len(looked_at) - 1)
    return [
        {
            "axis": "rotary_speed",
            "name": STICK_SLIP_ONSET,
            "words": "the speed below which the bit sticks and slips",
            "min": min(speeds),
            "max": max(speeds),
            "lasts": None,
            "told": "",
            "safe_while": "",
            "from": first,
            "everywhere": len(found) == len(tried),
            "each": False,
            "range": None,
            "jumped": None,
            "passing_rate": None,
            "weights": [looked_at[low], looked_at[high]],
            "may": any(unknown),
            "turns": any(_turns_from_the_start(*one) for one in found),
        }
    ]


def _is_shaken_in(at: Values, one: Drilling, is_shaken: Callable[[Values, float], bool]) -> bool:
    """Whether lobes may shake a bit whose fold is known, so that it does not tell to which speed stick-slip lasts."""
    return any(is_shaken(at, speed) for speed in (0.0, one.unstable_to, one.lasts_to))


def _turns_from_the_start(at: Values, steady: Drilling) -> bool:
    """Whether the bit turns from the start on: the swing about steady drilling with which it
    begins, without damping, does not stop it. Else the string winds up, and the bit sticks."""
    start: Any = at.initial
    speed, twist = getattr(start, "bit_speed", None), getattr(start, "twist", None)
    if twist is None or not steady.turns:
        return False
    slower = steady.speed - (steady.set_speed if speed is None else speed)
    return math.hypot(slower, steady.frequency * (twist - steady.twist)) < steady.speed


def begun_above(lasting: Sequence[dict[str, Any]], format_value: FormatValue, shaken: bool = False) -> str | None:
    """The warning of a sweep that begins above the onset of stick-slip, of those of
    :func:`begins_above_onset`, and of which the bit need not stick at the first speed: it turns
    from the start on, or it is ``shaken`` by lobes. None else: what sticks, the window shows."""
    one = next((one for one in lasting if one["name"] == STICK_SLIP_ONSET), None)
    if one is None or not (shaken or one["turns"]):
        return None
    weights = from_to(format_value(wob, "N", "kN") for wob in one["weights"])
    first, *ends = (format_value(one[end], "rad/s", "rad/s") for end in ("from", "min", "max"))
    goes_on = "and may go on with it (stick_slip_fold is not known)" if one["may"] else "and goes on with it"
    return (
        f"Start: the sweep begins at {first}, which lies at {weights} above {one['words']} "
        f"({from_to(ends)}). A string that is brought up to speed sticks and slips there, "
        f"{goes_on} at {first}; a run that does not stick at {first} shows points as safe that may not be. "
        f"Begin the sweep below {format_value(begin_below([one]), 'rad/s', 'rad/s')}, even if the bit never "
        "drills there."
    )


Find = Callable[[Values], Drilling | None]
Found = tuple[Values, Drilling]


def drillings(corners: Iterable[Values], find: Find) -> list[Found]:
    """The corners of a study at which something is drilled that turns, with that."""
    return [(corner, one) for corner in corners if (one := find(corner)) is not None]


def overloaded(found: list[Found], format_value: FormatValue) -> str | None:
    """The warning of a motor whose limit is below the steady torque, for the worst corner
    of a study, None where there is none."""
    pairs = [(one.torque, one.limit) for _, one in found if one.limit is not None]
    torque, limit = max(pairs, key=lambda pair: pair[0] - pair[1], default=(0.0, 0.0))
    if torque <= limit:
        return None
    return (
        f"Overloaded: steady drilling takes {format_value(torque, 'N m', 'kN*m')}, and the drive has "
        f"{format_value(limit, 'N m', 'kN*m')} at most (drive.torque_limit). It cannot keep the set speed; the string "
        "stops or turns slower, and lags behind more and more."
    )


def interrupted(found: list[Found], format_value: FormatValue) -> str | None:
    """The warning of steady drilling that is unstable in several ranges of speeds, at the first
    corner of a study of which that is so; None where there is none."""
    one = next((one for _, one in found if len(one.unstable_ranges) > 1), None)
    if one is None:
        return None
    (_, first), *others = one.unstable_ranges
    ranges = [f"up to {format_value(first, 'rad/s', 'rad/s')}"]
    for low, high in others:
        above = f"above {format_value(low, 'rad/s', 'rad/s')}"
        ends = " to ".join(format_value(end, "rad/s", "rad/s") for end in (low, high))
        ranges.append(ends if math.isfinite(high) else above)
    return (
        f"Unstable in several ranges: at {format_value(one.wob, 'N', 'kN')} steady drilling is unstable to stick-slip "
        f"at bit speeds {' and '.join(ranges)}, and stable between them, as the torque of the bit falls again there. "
        "stick_slip_onset is the end of the last one, and a window allows nothing below it."
    )


MOST_MISSED = 0.005  # of the greatest torque: with the laws of nsdrill it is 1e-3 at most


def narrow(found: list[Found], format_value: FormatValue) -> str | None:
    """The warning of a torque that falls between two neighbours of the speeds that are tried by
    more than its slopes there show, at the corner of a study of which that is so most; None
    where it is nowhere."""
    worst = max((one for _, one in found if one.rock_torque > 0.0), key=lambda one: one.missed[0], default=None)
    if worst is None or worst.missed[0] <= MOST_MISSED:
        return None
    share, *ends = worst.missed
    low, high = (format_value(end, "rad/s", "rad/s") for end in ends)
    return (
        f"Narrow: at {format_value(worst.wob, 'N', 'kN')} the torque of the bit falls by {100.0 * share:.2g} % of its "
        f"greatest between {low} and {high}, and steady drilling is looked at in steps of 1 %: stick_slip_onset may be "
        "wrong, and a window allow what is unstable there. Let the law fall over a wider range."
    )


def swinging(study: Any, found: list[Found], format_value: FormatValue) -> str | None:
    """The warning of a drive that makes the string oscillate by itself, as gains of the
    wrong sign do, for the worst corner of a study, None where there is none."""
    grown = [(root, corner) for corner, one in found if not one.bends and (root := growing(one.matrix)) is not None]
    if not grown:
        return None
    root, corner = max(grown, key=lambda entry: entry[0].real)
    depth, kind = corner.point.depth, corner.parameters.drive.kind
    swing = f" and swings at {abs(root.imag):.4g} rad/s" if abs(root.imag) > 1e-9 * abs(root) else ""
    where = f" at {format_value(depth, 'm', 'm')}" if "depth" in study.swept else ""
    return (
        f"Unstable: without any friction at the bit the string and its drive{where} do not come to rest: an eigenvalue "
        f"is {root.real:.4g}{f' +- {abs(root.imag):.4g}i' if swing else ''} 1/s, so a deviation grows e-fold in "
        f"{1 / root.real:.3g} s{swing}. Look at the signs and sizes of the gains of drive: {kind}."
    )


def resting(found: list[Found], format_value: FormatValue) -> str | None:
    """The warning of set speeds at which motor and bit balance only at rest, for the
    worst corner of a study; None where there is none."""
    still = [(corner, one) for corner, one in found if not one.string.holds and not one.turns]
    if not still:
        return None
    corner, one = max(still, key=lambda pair: pair[1].least_set_speed - pair[1].set_speed)
    speed = format_value(one.set_speed, "rad/s", "rad/s")
    if one.runs_away:
        return (
            f"No balance: at a set speed of {speed}{_where(one, format_value)} motor and bit balance at no "
            f"speed: the drive ({corner.parameters.drive.kind}) turns faster under load, and the bit speeds up without "
            "end. Lower the gains that raise its torque with the load (drive.twist_gain)."
        )
    kind = corner.parameters.drive.kind
    if own_drive(kind) is not None and not one.known:
        return (
            f"Not known: at a set speed of {speed}{_where(one, format_value)} no balance of motor and bit is found "
            f"with the drive {kind}, as where its torque is at a limit of its own. Whether the bit drills there is not "
            "known, and what is shown of steady drilling and stick-slip does not hold. A run from rest and one from "
            "the set speed tell."
        )
    least = one.least_set_speed
    remedy = f" It turns from a set speed of {format_value(least, 'rad/s', 'rad/s')} on." if least < math.inf else ""
    return (
        f"At rest: at a set speed of {speed}{_where(one, format_value)} the only balance of motor and bit is "
        f"the resting bit, with {format_value(one.torque, 'N m', 'kN*m')}: the drive ({corner.parameters.drive.kind}) "
        f"turns slower under load, and nothing brings it back to the set speed.{remedy} Raise the set speed, or give "
        "the drive more damping or an integral gain."
    )


def drooping(found: list[Found], format_value: FormatValue) -> str | None:
    """The warning of a drive that turns slower under load than it is set by more than
    :data:`OFF_SPEED`, for the worst corner of a study; None where there is none."""
    slow = [
        (corner, one)
        for corner, one in found
        if not one.string.holds and one.turns and one.speed < (1.0 - OFF_SPEED) * one.set_speed
    ]
    if not slow:
        return None
    corner, one = min(slow, key=lambda pair: pair[1].speed / pair[1].set_speed)
    speed = format_value(one.set_speed, "rad/s", "rad/s")
    needed = one.as_set_speed(one.set_speed)
    remedy = f"To turn at {speed}, set {format_value(needed, 'rad/s', 'rad/s')}, or g" if needed < math.inf else "G"
    return (
        f"Slower than set: at a set speed of {speed}{_where(one, format_value)} the drive "
        f"({corner.parameters.drive.kind}) turns at {format_value(one.speed, 'rad/s', 'rad/s')}: under load, or by its "
        "own law, and nothing brings it back to the set speed. The speeds in answers and pictures are those that are "
        "set. "
        f"{remedy}ive the drive more damping or an integral gain."
    )


def stalling(found: list[Found], format_value: FormatValue) -> str | None:
    """The warning of a drive that cannot break the bit away, for the worst corner of a
    study; None where there is none."""
    # where no balance turns there is another warning
    moving = [one for _, one in found if one.holds_or_turns]
    stalls = [(one, stall) for one in moving if (stall := one.stall) is not None]
    if not stalls and (unknown := [one for one in moving if not one.breaks_known]):
        return (
            "Not known: whether the drive breaks the bit away"
            f"{_where(max(unknown, key=lambda one: one.wob), format_value)}: at some speeds of a bit on its way up "
            "from rest no balance of motor and bit is found, as where the drive has not the torque that they take. A "
            "run from rest tells (initial.bit_speed and the speed of the drive 0)."
        )
    if not stalls:
        return None
    one, stall = max(stalls, key=lambda entry: entry[1].needed - entry[1].available)
    what, remedy = "drive.torque_limit", "Raise the limit"
    if one.string.holds and (one.limit is None or stall.available < one.limit):
        what, remedy = "at any angle behind the set point", "Give the drive more torque"
    if stall.set_speed is not None:
        what = "it turns slower under load"
        remedy = f"Set {format_value(stall.set_speed, 'rad/s', 'rad/s')} or more"
    return (
        f"Stalls: to break the bit away takes {format_value(stall.needed, 'N m', 'kN*m')}"
        f"{_where(one, format_value)}, and the drive has {format_value(stall.available, 'N m', 'kN*m')} at "
        f"most ({what}). A bit at rest stays at rest unless a swing of the string frees it, and one that comes to rest "
        f"may stay there. {remedy}, or lower the weight on bit."
    )


def _where(one: Drilling, format_value: FormatValue) -> str:
    return f" under {format_value(one.wob, 'N', 'kN')}"
