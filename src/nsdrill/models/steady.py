"""Steady drilling of string and drive, and the linearised string about it, from the
equations of a model: everything here is a value or a derivative of the graph that the
integration is compiled from (:mod:`nsdrill.equations.trace`).

What turns are *angles* from the surface to the bit, relative to the set point, with
their speeds, and further coordinates of the drive, as the torque of a motor. In steady
drilling all turn at one speed w and none accelerates. Two kinds of drives:

- one that *holds* its angle, as an ideal drive or one with integral gain does: w is the
  set speed, and the lag gives the torque;
- one that *droops*: nothing depends on the angle of the top, w is lower than the set
  speed, and to each w belongs the set speed at which motor and bit balance.

The torque of the rock on the bit is what the equations call ``bit_torque``. With the
bit's speed omega, the linearised string is

    x' = A x + b T,   T = T(w) - fall (omega - w)

with ``A`` as it is while that torque does not change, so that the ``fall`` of the
torque with speed is what makes steady drilling unstable. It is stable up to the
steepest fall that the string *withstands*; where the fall is as steep, stick-slip
begins.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Mapping
from functools import cached_property, lru_cache
from typing import Any, NamedTuple, TypeAlias, TypeVar

import numpy as np

from nsdrill.data import Array
from nsdrill.equations import plain
from nsdrill.equations.graph import Node, Number
from nsdrill.equations.motion import Motion
from nsdrill.equations.passes import Tangents
from nsdrill.equations.trace import traced
from nsdrill.errors import InputError
from nsdrill.models.bends import Sides, on_all_sides
from nsdrill.models.cycle import POINTS, Cycles, lasting
from nsdrill.models.drive_laws import steepest_fall
from nsdrill.models.operation import Numeric
from nsdrill.models.own_drives import numbered
from nsdrill.records import dataclass

FASTEST = 1e4  # rad/s, up to which bit speeds are searched
SLOWEST = 1e-9  # rad/s, the least set speed of a study
BEYOND = 1.25  # each speed beyond the set speed that is tried is so many times the one before
SPEEDS = np.geomspace(1e-3, FASTEST, 1401)
TRIED = np.geomspace(1e-2, 1e3, 101)  # of a string that rubs elsewhere than at the bit
TURNS = 0.1  # of the set speed: a bit that is slower in steady drilling creeps, and does not turn
CREEP = 0.5  # rad/s, 5 rpm: one that is faster turns in any case
ROUNDS = 60  # of a refinement, at most
HELD = 1e-12  # relative: a drive on which a turn of all angles has less effect holds none
NEWTON = 30  # iterations at most; equations that are linear but for the bit take two
CLOSE = 1e-13  # relative
SETTLED = 1e-6  # of the torque on the bit: what is not balanced of it at most
LAGS = np.concatenate([-np.geomspace(1e4, 1e-4, 81), [0.0], np.geomspace(1e-4, 1e4, 81)])  # rad, of a drive
STARTS = (1.0, -1.0, 0.1, -0.1, 10.0, -10.0)  # of the further coordinates of a drive at its limit
# The cycle of stick-slip: the slowest and the fastest bit speed at which it is looked for
# first, of the swing of a bit that breaks away; how many at once, and how close together
# at last; how often the bit must come to rest again where the drive remembers what was
# before; and the bit speeds of the tables of torque [rad/s], to so many times that of
# steady drilling.
SLOWEST_CYCLE, FASTEST_CYCLE = 1e-3, 50.0
CYCLES, CLOSE_CYCLE = 28, 0.003
AGAIN = 12
LEAST, REACH = 1e-6, 20.0


T = TypeVar("T")


class Ask(NamedTuple):
    """What a search asks of its string (:mod:`nsdrill.models.lockstep`): a method and its
    arguments: numbers, arrays or tuples of arrays whose first axis is that of set speeds,
    or None."""

    method: str
    arguments: tuple[Any, ...]


Search: TypeAlias = Generator[Ask, Any, T]


class Turning(NamedTuple):
    """The states that turn, by name: ``angles`` from the surface to the bit, their
    ``speeds``, and ``others``, of which the equations give the slopes too."""

    angles: tuple[str, ...]
    speeds: tuple[str, ...]
    others: tuple[str, ...] = ()


class Balance(NamedTuple):
    """Steady drilling at bit speeds [rad/s], an array: the ``set_speed`` [rad/s] that it
    takes, and the ``angles`` [rad] and ``others`` (shape [..., n])."""

    speed: Array
    set_speed: Array
    angles: Array
    others: Array


class Fold(NamedTuple):
    """Steady drilling ``at`` the greatest set speed at which stick-slip lasts, and the
    deviations at the ``end`` of its cycle, from which it went on there; None where it began
    with a bit that is held."""

    at: Balance
    end: Array | None


class Lasting(NamedTuple):
    """Whether stick-slip ``lasts`` at set speeds [m], and the deviations at the ``end`` of
    its cycle [m, n]."""

    lasts: Array
    end: Array


class Weighted(NamedTuple):
    """A string under a weight on bit [N]: ``table_under`` gives the table under others, one
    for each lane, and is the same object for strings that differ in their weight alone."""

    table_under: Callable[[Numeric], Callable[[Numeric], Mapping[str, Numeric]]]
    wob: float


@dataclass(frozen=True)
class String:
    """A string with its drive, as the equations of a model have it.

    ``table`` gives the lane parameters at set speeds [rad/s]; in steady drilling the
    drive is switched on and has no limit, and no lobe and no pulsation disturbs it.
    ``rest`` are the states that do not turn, by name; those left out are 0.
    """

    motion: Motion
    turning: Turning
    set_speed: str
    """The lane parameter that is the set speed."""
    table: Callable[[Numeric], Mapping[str, Numeric]]
    rest: Mapping[str, Numeric]
    driven: tuple[str, ...] = ()
    """The speeds that are the set speed whatever the torque."""
    rubs: bool = False
    """Whether the string has friction elsewhere than at the bit, so that it may be
    unstable by itself."""
    lanes: tuple[int, ...] = ()
    """Of strings side by side (:mod:`nsdrill.models.lockstep`): how many lanes each has."""
    weighted: Weighted | None = None
    """By what its table is found together with those of others."""

    # The equations

    @cached_property
    def _nodes(self) -> _Nodes:
        return _differentiated(self.motion, self.turning, self.set_speed)

    def given(self, speed: Numeric, set_speed: Numeric, at: Balance | None = None) -> dict[str, Any]:
        """The states and the lane parameters, as inputs of the equations, at bit speeds and
        set speeds [rad/s]."""
        given: dict[str, Any] = {"time": 0.0, "phase": 0.0}
        given |= {f"s.{name}": 0.0 for name in self.motion.states}
        beyond = (1,) * (np.ndim(speed) - 1)  # the lanes of strings side by side come first
        given |= {
            f"s.{name}": np.reshape(value, (*np.shape(value), *beyond)) if self.lanes and np.ndim(value) else value
            for name, value in self.rest.items()
        }
        given |= {f"s.{name}": speed for name in (*self.driven, *self.turning.speeds)}
        if at is not None:
            given |= {f"s.{name}": at.angles[..., k] for k, name in enumerate(self.turning.angles)}
            given |= {f"s.{name}": at.others[..., k] for k, name in enumerate(self.turning.others)}
        return given | self._parameters(set_speed)

    def _parameters(self, set_speed: Numeric) -> dict[str, Any]:
        """The lane parameters as inputs; the last ones are kept."""
        last = self._last
        if not last or not np.array_equal(last[0][0], set_speed) or np.shape(last[0][0]) != np.shape(set_speed):
            # gains of the wrong sign may take a speed below zero, at which nothing is drilled
            table = {**self.table(np.maximum(set_speed, SLOWEST)), self.set_speed: set_speed}
            last[:] = [(np.array(set_speed), {f"p.{name}": table[name] for name in self.motion.parameters})]
        return last[0][1]

    @cached_property
    def _last(self) -> list[tuple[Array, dict[str, Any]]]:
        return []

    def states(self, at: Balance) -> dict[str, Any]:
        """The states of what turns in steady drilling by name, with the ``set_speed``."""
        given = self.given(at.speed, at.set_speed, at)
        turning = (*self.turning.angles, *self.turning.speeds, *self.turning.others, *self.driven)
        return {"set_speed": at.set_speed, **{name: given[f"s.{name}"] for name in turning}}

    def value(self, name: str, at: Balance) -> Array:
        """What the equations call by this name, in steady drilling."""
        found = plain.values({"": self._nodes.named[name]}, self.given(at.speed, at.set_speed, at))[""]
        return np.broadcast_to(found, np.shape(at.speed))

    def bit_torque(self, speed: Numeric, set_speed: Numeric | None = None) -> Array:
        """The torque of the rock on the bit [N m] at bit speeds [rad/s], at set speeds
        that are these unless they are given."""
        return self._of_bit("torque", speed, set_speed)

    def fall(self, speed: Numeric, set_speed: Numeric | None = None) -> Array:
        """How steeply that falls with the speed of the bit [N m s/rad]."""
        return -self._of_bit("slope", speed, set_speed)

    def _of_bit(self, which: str, speed: Numeric, set_speed: Numeric | None) -> Array:
        given = self.given(speed, speed if set_speed is None else set_speed)
        return np.asarray(plain.values({"": self._nodes.bit[which]}, given)[""] + 0.0 * np.asarray(speed))

    def _slopes(self, given: Mapping[str, Any], shape: tuple[int, ...]) -> tuple[Array, Array]:
        """(slopes [..., m], their derivatives [..., m, d]) of speeds and others, with
        respect to angles, speeds, others, set speed and bit torque, in this order."""
        nodes, size = self._nodes, len(self._nodes.directions)
        unit = np.eye(size).reshape(size, size, *(1,) * max(len(shape), 1))
        directions = {name: unit[k] for k, name in enumerate(nodes.directions)}
        whole = shape or (1,)
        with_axis = {name: np.asarray(value)[None] if np.ndim(value) else value for name, value in given.items()}
        found = plain.values(nodes.wanted, with_axis | directions)
        m = len(nodes.wanted) // 2
        rates = [np.broadcast_to(found[f"slope.{k}"], (1, *whole))[0] for k in range(m)]
        changes = [np.broadcast_to(found[f"change.{k}"], (size, *whole)) for k in range(m)]
        slopes = np.stack(rates, axis=-1)
        matrix = np.moveaxis(np.stack(changes, axis=0), (0, 1), (-2, -1))
        return slopes.reshape(*shape, m), matrix.reshape(*shape, m, size)

    def untwisted(self, speed: Numeric) -> Balance:
        """A string that turns at these speeds [rad/s], which are the set speeds, without
        any twist: no steady drilling, but linear about it alike."""
        shapes = (np.shape(value) for value in (speed, *self.table(speed).values()))
        speed = np.broadcast_to(np.asarray(speed, dtype=float), np.broadcast_shapes(*shapes))
        n, others = len(self.turning.angles), len(self.turning.others)
        return Balance(speed, speed, np.zeros((*speed.shape, n)), np.zeros((*speed.shape, others)))

    def load(self, speed: Numeric) -> tuple[Array, Array]:
        """(the torque at the top, the torsional stiffness) of a string with one speed
        that is turned at a set speed [rad/s], times what divides its inertia."""
        at = self.untwisted(speed)
        rates, matrix = self._slopes(self.given(at.speed, at.set_speed, at), at.speed.shape)
        return -rates[..., -1], -matrix[..., -1, 0]

    @property
    def _of_script(self) -> bool:
        """Whether the drive is one of a script."""
        return bool(getattr(self.motion.options, "drive", 0))

    @cached_property
    def holds(self) -> bool:
        """Whether the drive holds the angle of the top to that of the set point."""
        at = self.untwisted(1.0)
        # a drive with a limit of its own may be at it where nothing twists the string yet
        for lag in (0.0, *(STARTS if self._of_script else ())):
            turned = at._replace(angles=at.angles + lag)
            _, matrix = self._slopes(self.given(at.speed, at.set_speed, turned), at.speed.shape)
            of_angles = matrix[..., : len(self.turning.angles)]
            if np.any(np.abs(of_angles.sum(axis=-1)) > HELD * np.abs(of_angles).sum(axis=-1)):
                return True
        return False

    # Steady drilling

    def balance(self, speed: Numeric, set_speed: Numeric | None = None) -> Balance:
        """Steady drilling at bit speeds [rad/s], by Newton's method. ``set_speed`` are
        the set speeds at which the lane parameters are taken and, with a drive that
        holds its angle, those that it turns with; else the speed and, with a drive that
        droops, the one that belongs to it: infinite where none is found, as with a drive
        without any torque, or with one at its limit."""
        try:
            return self._balance(speed, set_speed)
        except np.linalg.LinAlgError:
            if self.lanes:
                raise
        # a drive with a limit of its own may be at it where nothing twists the string yet
        for start in STARTS if self.turning.others or self._of_script else ():
            try:
                return self._balance(speed, set_speed, start)
            except np.linalg.LinAlgError:
                continue
        speed = np.asarray(speed, dtype=float)
        angles, others = len(self.turning.angles), len(self.turning.others)
        none = np.full(speed.shape, math.inf)
        return Balance(speed, none, np.zeros((*speed.shape, angles)), np.zeros((*speed.shape, others)))

    def _balance(self, speed: Numeric, set_speed: Numeric | None, start: float | None = None) -> Balance:
        """The :meth:`balance` by Newton's method from no twist, with a ``start`` from set speeds
        that are the speeds, and from an angle that is held and further coordinates of the drive
        of this size; LinAlgError where the equations do not decide on a step."""
        speed = np.asarray(speed, dtype=float)
        shape, n, others = speed.shape, len(self.turning.angles), len(self.turning.others)
        own = set_speed is None
        asked = speed if set_speed is None else np.broadcast_to(np.asarray(set_speed, dtype=float), shape)
        at = Balance(speed, asked, np.zeros((*shape, n)), np.zeros((*shape, others)))
        further = np.zeros(shape)  # of the set speed, beyond that of the table
        if start is not None:
            at, further = at._replace(others=at.others + start), speed - asked
            if self.holds:
                at = at._replace(angles=at.angles + start)
        angles = slice(0, n) if self.holds else slice(1, n)
        columns = [
            *range(*angles.indices(n)),
            *range(2 * n, 2 * n + others),
            *(() if self.holds else (2 * n + others,)),
        ]
        found = np.zeros(shape, dtype=bool)
        for _ in range(NEWTON):
            given = self.given(speed, at.set_speed, at)
            given[f"p.{self.set_speed}"] = given[f"p.{self.set_speed}"] + further
            slopes, matrix = self._slopes(given, shape)
            step = np.linalg.solve(matrix[..., columns], -slopes[..., None])[..., 0]
            if self.lanes:
                step = np.where(found[..., None], 0.0, step)
            turned, gained = np.array(at.angles), step[..., -1] if not self.holds else np.zeros(shape)
            size = n if self.holds else n - 1
            turned[..., angles] += step[..., :size]
            at = at._replace(angles=turned, others=at.others + step[..., size : size + others])
            if own:
                at = at._replace(set_speed=at.set_speed + gained)
            else:
                further = further + gained
            known = np.concatenate([turned, at.others, (at.set_speed + further)[..., None]], axis=-1)
            close = np.all(np.abs(step) <= CLOSE * (np.abs(known).max(axis=-1, keepdims=True) + 1e-300), axis=-1)
            found |= self._of_all_lanes(close)
            if np.all(found):
                break
        return at._replace(set_speed=at.set_speed + further)

    def is_settled(self, at: Balance) -> bool:
        """Whether nothing changes in this steady drilling: where no balance is found, it does."""
        if not np.all(np.isfinite(at.set_speed)):
            return False
        given = self.given(at.speed, at.set_speed, at)
        slopes, changes = self._slopes(given, np.shape(at.speed))
        needed = np.abs(changes[..., -1]).max() * np.abs(self.bit_torque(at.speed, at.set_speed))
        return bool(np.all(np.abs(slopes) <= SETTLED * needed))

    def demand_and_supply(self, speeds: Array, set_speed: float) -> tuple[Array, Array, Array]:
        """(the torque that the string takes from a drive by torque, the least, and the greatest
        that this has, at any angle behind the set point) [N m], at bit speeds [m] that are the
        speeds of the drive and the set speeds; lane parameters are those at ``set_speed``."""
        n = len(self.turning.angles)
        given = self.given(speeds, np.full(len(speeds), set_speed)) | {f"p.{self.set_speed}": speeds}
        slopes, matrix = self._slopes(given, speeds.shape)
        below = np.linalg.solve(matrix[..., 1:n, 1:n], -slopes[..., 1:n, None])[..., 0]  # the string is linear
        names = self.turning.angles
        given |= {f"s.{name}": below[:, k] for k, name in enumerate(names[1:])}
        taken = plain.values({"": self._nodes.named["surface_torque"]}, given)[""] + 0.0 * speeds
        behind = {f"s.{name}": given[f"s.{name}"] + LAGS[:, None] for name in names}
        had = plain.values({"": self._nodes.named["drive_torque"]}, given | behind)[""] + 0.0 * (LAGS[:, None] + speeds)
        return taken, had.min(axis=0), had.max(axis=0)

    def _of_all_lanes(self, true: Array) -> Array:
        """Whether this is true of all lanes of a string, per lane."""
        if not self.lanes:
            return np.asarray(np.all(true))
        return np.repeat(np.logical_and.reduceat(true, np.cumsum((0, *self.lanes[:-1]))), self.lanes)

    def at_set_speed(self, set_speed: float) -> Search[Balance]:
        """Steady drilling at a set speed [rad/s]. Of several the fastest."""
        if self.holds:
            return (yield Ask("balance", (set_speed, set_speed)))

        def surplus(speeds: Array) -> Array:
            """Of the set speed over the one that bit speeds take."""
            surplus: Array = set_speed - self.balance(speeds, np.full(np.shape(speeds), set_speed)).set_speed
            return surplus

        # with a motor whose voltage has been set for the load, the bit turns at the set speed
        if abs(surplus(np.array([set_speed]))[0]) <= HELD * set_speed:
            return self.balance(set_speed, set_speed)
        speeds = np.append(np.geomspace(1e-7, 1.0, 141), [1.001, 1.1, 2.0]) * set_speed
        # Most bits turn slower than the set speed. A drive that gives more torque than the load
        # takes, as one with a gain on the twist above the stiffness of the string, overshoots it.
        while surplus(speeds[-1:])[0] >= 0.0 and speeds[-1] < FASTEST:
            speeds = np.append(speeds, BEYOND * speeds[-1])
        gains = np.flatnonzero(surplus(speeds) >= 0.0)
        if len(gains) == 0 or gains[-1] == len(speeds) - 1:
            return self.balance(0.0, set_speed)._replace(set_speed=np.asarray(set_speed))
        near = speeds[gains[-1] : gains[-1] + 2].tolist()
        low, high = refined(lambda trial: surplus(trial) >= 0.0, near[0], near[1], 9)
        return self.balance(0.5 * (low + high), set_speed)

    def turns(self, at: Balance, set_speed: float) -> bool:
        """Whether the bit turns in steady drilling, and does not creep."""
        return bool(at.speed >= min(CREEP, TURNS * set_speed))

    # The linearised string

    def linear(self, at: Balance) -> tuple[Array, Array]:
        """(A, b): the matrix of deviations from steady drilling [..., k, k] while the
        torque on the bit does not change, and the column of that torque [..., k].
        Deviations are of the angles, the speeds and the others; of a drive that droops
        the angles are those behind the top, whose own angle affects nothing."""
        n, others = len(self.turning.angles), len(self.turning.others)
        shape = np.shape(at.speed)
        if self._may_bend:
            found = self._sides(at).derivative
        else:
            _, found = self._slopes(self.given(at.speed, at.set_speed, at), shape)
        size = 2 * n + others
        matrix = np.zeros((*shape, size, size))
        matrix[..., range(n), range(n, 2 * n)] = 1.0
        matrix[..., n:, :] = found[..., :size]
        column = np.concatenate([np.zeros((*shape, n)), found[..., -1]], axis=-1)
        if self.holds:
            return matrix, column
        matrix[..., :n, n] -= 1.0  # behind the top
        return matrix[..., 1:, 1:], column[..., 1:]

    @cached_property
    def _may_bend(self) -> bool:
        """Whether the drive is one of a script that may bend somewhere."""
        return self._of_script and numbered(getattr(self.motion.options, "drive", 0)).may_bend

    def _sides(self, at: Balance) -> Sides:
        """The derivatives of :meth:`_slopes` on all sides of steady drilling, in what the drive reads."""
        shape = np.shape(at.speed)
        return self._on_all_sides(lambda beside: self._slopes(beside, shape)[1], self.given(at.speed, at.set_speed, at))

    def _on_all_sides(self, derivative: Callable[[Mapping[str, Any]], Array], given: Mapping[str, Any]) -> Sides:
        read = numbered(getattr(self.motion.options, "drive", 0)).moving
        return on_all_sides(derivative, given, [one for one in read if one in given])

    def of_sides(self, derivative: Callable[[Mapping[str, Any]], Array], given: Mapping[str, Any]) -> Array:
        """A ``derivative`` of the equations at inputs ``given``; where a condition has another one at a
        point than on all its sides, that on these."""
        return self._on_all_sides(derivative, given).derivative if self._may_bend else derivative(given)

    def bends(self, at: Balance) -> bool:
        """Whether the drive bends at this steady drilling, so that no linear theory holds there."""
        return self._may_bend and bool(np.any(self._sides(at).bends))

    @property
    def bit(self) -> int:
        """The place of the bit's speed among the deviations."""
        return 2 * len(self.turning.angles) - 1 - (not self.holds)

    def withstood(self, at: Balance) -> Array:
        """The steepest fall of the torque on the bit with its speed [N m s/rad] with
        which steady drilling is stable; negative where the drive itself is unstable."""
        matrix, column = self.linear(at)
        bit, twist = self.bit, len(self.turning.angles) - 1 - (not self.holds)
        return _withstood(matrix.shape, matrix.tobytes(), column.tobytes(), bit, twist)

    def onset(self, speed: float) -> Search[Balance | None]:
        """The fastest steady drilling that is not stable to stick-slip: below it the bit
        sticks and slips; None where it is stable at every speed, at an infinite speed where it
        is at none, and without a finite set speed, NaN, where no balance of motor and bit is found,
        so that it is not known. ``speed`` [rad/s] is where the search begins."""
        if self.rubs:
            return self._onset_by_growth()
        found, held = (yield Ask("balance", (speed,))), math.nan
        for _ in range(NEWTON):
            if not np.isfinite(found.set_speed):
                return found
            # what the string withstands may depend on how fast it turns
            before, held = held, float(self.withstood(found))
            if abs(held - before) <= 1e-12 * abs(held):
                return found
            unstable = np.flatnonzero((yield Ask("fall", (SPEEDS,))) > held)
            if len(unstable) == 0:
                return None
            if unstable[-1] == len(SPEEDS) - 1:
                return found._replace(speed=np.asarray(math.inf), set_speed=np.asarray(math.inf))
            # the fall at the set speed that drilling takes is nearly that at the bit speed
            near = SPEEDS[max(unstable[-1] - 1, 0) : unstable[-1] + 3]

            low, high = float(near[0]), float(near[-1])
            for _ in range(ROUNDS):  # as refined does
                trial = np.linspace(low, high, 41 if self.holds else 9)
                set_speeds = () if self.holds else ((yield Ask("balance", (trial,))).set_speed,)
                low, high = _end(trial, (yield Ask("fall", (trial, *set_speeds))) > held)
                if not low < 0.5 * (low + high) < high:
                    break
            found = yield Ask("balance", (0.5 * (low + high),))
        return found

    def _onset_by_growth(self) -> Balance | None:
        """The :meth:`onset` of a string whose own matrix depends on how fast it turns: the
        fastest of these speeds at which a deviation grows."""
        grown = np.flatnonzero(self.grows(TRIED))
        if len(grown) == 0:
            return None
        if grown[-1] == len(TRIED) - 1:
            return self.balance(1.0)._replace(speed=np.asarray(math.inf), set_speed=np.asarray(math.inf))
        low, high = refined(self.grows, float(TRIED[grown[-1]]), float(TRIED[grown[-1] + 1]), 9, rounds=8)
        return self.balance(0.5 * (low + high))

    def grows(self, speeds: Array) -> Array:
        """Whether a deviation from steady drilling at bit speeds [rad/s] grows."""
        at = self.balance(speeds)
        matrix, column = self.linear(at)
        fall = self.fall(speeds, None if self.holds else at.set_speed)
        matrix[..., :, self.bit] -= fall[..., None] * column
        rates = np.linalg.eigvals(matrix).real.max(axis=-1)
        return np.asarray(rates > HELD * np.abs(matrix).max(axis=(-2, -1)))

    def sticks_at(self, at: Balance, period: Array, stiffness: Array, start: Array | None = None) -> Lasting:
        """(whether stick-slip, once it is there, lasts [m], the deviations at the end
        [m, n]) at set speeds with this steady drilling, arrays [m]: by its cycle
        (:mod:`nsdrill.models.cycle`), from a bit that is held, or from the ``start``.
        ``period`` [s] and ``stiffness`` [N m/rad], arrays [m], are those of torsion."""
        cycles = self._cycles(at, period, stiffness)
        return Lasting(*lasting(cycles, AGAIN, start))

    def _cycles(self, at: Balance, period: Array, stiffness: Array) -> Cycles:
        matrix, column = self.linear(at)
        matrix = np.broadcast_to(matrix, (*column.shape, column.shape[-1])).copy()
        lanes = self.lanes or (len(at.speed),)
        fastest = np.maximum.reduceat(at.speed, np.cumsum((0, *lanes[:-1])))
        speeds = np.repeat(np.geomspace(LEAST, REACH * fastest, POINTS, axis=-1), lanes, axis=0)
        torques = self.bit_torque(speeds, at.set_speed[:, None])
        return Cycles(matrix, column, self.bit, at.speed, speeds, torques, period, stiffness, lanes)

    def motor_torques(self, of: Fold, period: float, stiffness: float) -> tuple[float, float]:
        """The least and the greatest torque of the motor [N m] in the cycle of a :meth:`fold` at
        a finite speed, of a drive by torque without a limit."""
        at = Balance(*(np.asarray(part)[None] for part in of.at))
        went: list[Array] = []
        cycles = self._cycles(at, np.array([period]), np.array([stiffness]))
        lasting(cycles, AGAIN, None if of.end is None else of.end[None], watch=went.append)
        away = np.concatenate(went)
        if not self.holds:  # the angle of the top affects nothing
            away = np.concatenate([np.zeros((len(away), 1)), away], axis=1)
        names = (*self.turning.angles, *self.turning.speeds, *self.turning.others)
        given = self.given(at.speed, at.set_speed, at)
        given |= {f"s.{name}": given[f"s.{name}"] + away[:, k] for k, name in enumerate(names)}
        torques = plain.values({"": self._nodes.named["drive_torque"]}, given)[""]
        return float(np.min(torques)), float(np.max(torques))

    def fold(self, period: float, stiffness: float) -> Search[Fold | None]:
        """Steady drilling at the greatest set speed at which stick-slip lasts; None where
        it lasts at none. Where it lasts at every speed, it is infinite."""
        torques = yield Ask("bit_torque", (SPEEDS,))
        swing = (np.max(torques) - np.min(torques[np.argmax(torques) :])) / stiffness * 2.0 * math.pi / period
        if swing <= 0.0:
            return None
        found: Balance | None = None
        start: Array | None = None
        alone = False
        low, ratio = SLOWEST_CYCLE * swing, FASTEST_CYCLE / SLOWEST_CYCLE
        while ratio - 1.0 > CLOSE_CYCLE:
            speeds = low * np.geomspace(1.0, ratio, CYCLES)
            if found is not None and not alone:
                speeds = speeds[1:]
            at = yield Ask("balance", (speeds,))
            of_torsion = np.full(len(speeds), period), np.full(len(speeds), stiffness)
            starts = None if start is None else np.tile(start, (len(speeds), 1))
            lasts, ends = yield Ask("sticks_at", (at, *of_torsion, starts))
            good = np.flatnonzero(lasts)
            if len(good) == 0:
                if found is None:
                    return None
                ratio = ratio ** (1.0 / (CYCLES - 1))
                continue
            k = int(good[-1])
            found, low = Balance(*(part[k] for part in at)), float(speeds[k])
            alone = ends.shape[-1] == 2
            start = None if alone else ends[k]
            if k < len(speeds) - 1 and (alone or ratio > 2.0):
                ratio = ratio ** (1.0 / (CYCLES - 1))
            elif low > FASTEST:
                return Fold(found._replace(speed=np.asarray(math.inf), set_speed=np.asarray(math.inf)), start)
        return None if found is None else Fold(found, start)

    def speed_per_torque(self, at: Balance) -> Array:
        """By how much the set speed must rise for a torque on the bit that is greater
        [rad/s / (N m)], with a drive that droops: infinite where no set speed changes its
        torque, as at its limit."""
        n, others = len(self.turning.angles), len(self.turning.others)
        _, found = self._slopes(self.given(at.speed, at.set_speed, at), np.shape(at.speed))
        columns = [*range(1, n), *range(2 * n, 2 * n + others + 1)]
        try:
            return np.asarray(np.linalg.solve(found[..., columns], -found[..., -1:])[..., -1, 0])
        except np.linalg.LinAlgError:
            return np.full(np.shape(at.speed), math.inf)


class _Nodes(NamedTuple):
    directions: tuple[str, ...]  # inputs that say of what the derivatives are
    wanted: Mapping[str, Node]  # slopes and their derivatives
    bit: Mapping[str, Node]  # the torque on the bit, and its slope with the bit's speed
    named: Mapping[str, Node]  # what the equations call by a name


@lru_cache
def _differentiated(motion: Motion, turning: Turning, set_speed: str) -> _Nodes:
    graph, slopes, _ = traced(motion.equations, motion.states, motion.parameters, motion.options, with_slopes=True)
    if (torque := graph.names.get("bit_torque")) is None:
        raise InputError(
            f"{motion.equations.__module__}: found no bit_torque in the equations, whose fall with speed decides on "
            "stick-slip; allowed: equations that call the torque of the rock on the bit by this name."
        )
    coordinates = (*turning.angles, *turning.speeds, *turning.others)
    seeds: dict[Node, Number] = {graph.input(f"s.{name}"): graph.input(f"d.{name}") for name in coordinates}
    seeds |= {graph.input(f"p.{set_speed}"): graph.input("d.set_speed"), torque: graph.input("d.bit_torque")}
    rates = {f"slope.{k}": slopes[name] for k, name in enumerate((*turning.speeds, *turning.others))}
    changes = Tangents(graph, seeds).of(rates)
    changes = {name.replace("slope", "change"): node for name, node in changes.items()}
    bit = graph.input(f"s.{turning.speeds[-1]}")
    slope = Tangents(graph, {bit: 1.0}).of({"": torque})[""]
    directions = (*(f"d.{name}" for name in coordinates), "d.set_speed", "d.bit_torque")
    return _Nodes(directions, rates | changes, {"torque": torque, "slope": slope}, graph.names)


ROUNDS = 60  # at most


@lru_cache(maxsize=64)
def _withstood(shape: tuple[int, ...], of_matrix: bytes, of_column: bytes, bit: int, twist: int) -> Array:
    """:meth:`String.withstood` of a linear string, by its bytes: a check asks for many
    strings that differ in what is not linear alone."""
    matrix, column = (np.frombuffer(data).reshape(s) for data, s in ((of_matrix, shape), (of_column, shape[:-1])))
    per_inertia = -column[..., bit]
    # Real parts add up to the trace, which is 0 where the fall is all the damping.
    most = -np.trace(matrix, axis1=-2, axis2=-1) / per_inertia
    critical = 2.0 * np.sqrt(np.abs(matrix[..., bit, twist])) / per_inertia
    return steepest_fall(matrix, column, bit, np.minimum(most, 0.0) - 4.0 * critical, most)


def refined(
    holds: Callable[[Array], Array], low: float, high: float, points: int = 41, rounds: int = ROUNDS
) -> tuple[float, float]:
    """The neighbours between which ``holds`` ends to hold, the last time, from where it
    does, ``low``, to where it does not, ``high``, by rounds of so many ``points``."""
    for _ in range(rounds):
        trial = np.linspace(low, high, points)
        low, high = _end(trial, holds(trial))
        if not low < 0.5 * (low + high) < high:
            break
    return low, high


def _end(trial: Array, holds: Array) -> tuple[float, float]:
    """The neighbours among the values of a ``trial`` between which it ends to hold."""
    true = np.flatnonzero(holds)
    last = min(int(true[-1]), len(trial) - 2) if len(true) else 0
    low, high = trial[last : last + 2].tolist()
    return low, high
