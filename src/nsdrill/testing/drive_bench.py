"""A drive at the top of a string against itself: its torque and its gains, the steady drilling
and the small deviations that ``check`` finds with it, and its motion; with no number at its
default, and for a bit that turns and one that is at rest."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache, cached_property
from typing import Any

import numpy as np

from nsdrill.data import Array
from nsdrill.equations import plain
from nsdrill.equations.graph import Node
from nsdrill.errors import InputError
from nsdrill.models.drilling import Drilling
from nsdrill.models.drive_laws import UNLIMITED, goes_by_torque, growing, is_limited
from nsdrill.models.own_drives import MOTION, SERVED, OwnDrive, listed, own_drive, row_of
from nsdrill.models.registry import checks_of
from nsdrill.models.tree import with_values
from nsdrill.models.variant import variant_at
from nsdrill.testing.bench import FAR, Bench, bench_of
from nsdrill.testing.check_report import Report
from nsdrill.testing.computed import machine_code, python, tangent, unread_of
from nsdrill.testing.observed_motion import methods

STEP = 1e-6  # of a natural scale, of differences
SWITCHED_ON = 1e4  # s, when a drive that is switched on late is on; later, angles have fewer digits
LONG = 20.0  # periods of the motion in which its states are looked at
INERTIA: tuple[str, ...] = ("per_drive_inertia", "drive_share")  # lane parameters
NO_TORQUE = dict.fromkeys(("drive_stiffness", "drive_damping", "twist_gain", "speed_gain"), 0.0)
NO_LIMIT = {"torque_least": -UNLIMITED, "torque_most": UNLIMITED}


class DriveBench(Bench):
    """The bench of a model with a drive."""

    @property
    def drive(self) -> Any:
        parameters: Any = self.study.parameters
        return parameters.drive

    @property
    def own(self) -> OwnDrive | None:
        return own_drive(self.drive.kind)

    @property
    def by_torque(self) -> bool:
        """Whether the torque follows from the motion, and is no state."""
        return goes_by_torque(self.drive.kind) or (self.drive.kind == "lqr" and "drive_stiffness" in self.columns)

    @cached_property
    def inputs(self) -> dict[str, Any]:
        """The inputs of the graph, of a string that turns at the set speed and, at every
        other state, of one at rest; and around them."""
        start, turns = self.model.starts(self.points, 0)[0], np.arange(self.count) % 2 == 0
        given: dict[str, Any] = {"time": np.full(self.count, SWITCHED_ON), "phase": np.zeros(self.count)}
        for k, name in enumerate(self.motion.states):
            around = FAR * self.scales[name] * self.rng.uniform(-1.0, 1.0, self.count)
            given[f"s.{name}"] = np.where(turns, start[k], 0.0) + around
        return given | _lanes(self.columns)

    # The torque of the motor

    def torque(self, given: dict[str, Any], limit: float | None = None) -> Array:
        """The torque of the motor [N m] with inputs of the graph, and a limit: by how much the
        drive speeds up beyond one whose motor has none."""
        slope, columns = self._drive_speed("pi", None)
        kept = {name: self.columns[name] for name in INERTIA if name in columns}
        none = plain.values({"": slope}, given | _lanes({**columns, **kept, **NO_TORQUE, **NO_LIMIT}))[""]
        slope, columns = self._drive_speed(self.drive.kind, limit)
        some = plain.values({"": slope}, given | _lanes(columns))[""]
        return np.asarray((some - none) / self.columns["per_drive_inertia"])

    @cache  # noqa: B019  # a bench lives as long as its check
    def _drive_speed(self, kind: str, limit: float | None) -> tuple[Node, dict[str, float]]:
        """(the slope of the drive's speed, the lane parameters) with a drive of this kind."""
        parameters = with_values(self.study.parameters, {"drive.kind": kind, "drive.torque_limit": limit})
        variant = variant_at(self.model, parameters)
        table = self.model.pack(replace(self.points, parameters=parameters), self.study.thresholds)
        columns = {name: float(value[0]) for name, value in variant.by_name(table).items()}
        return variant.motion.slopes_named()["drive_speed"], columns

    def called(self, given: dict[str, Any]) -> dict[str, Array]:
        """The torque [N m] and the slopes of its states that the function of a script gives,
        called with numbers, with inputs of the graph."""
        own, rows = self.own, []
        assert own is not None
        points = {name: np.ravel(value) for name, value in given.items()}
        for k in range(max(map(len, points.values()))):
            here = {name: float(value[min(k, len(value) - 1)]) for name, value in points.items()}
            words = {name: here["p.set_speed" if name == "set_speed" else f"s.{name}"] for name in own.reads}
            words |= {name: here[f"s.{row_of(name)}"] for name in own.states}
            words |= {name: here[f"p.{lane}"] for name, lane in zip(own.numbers, own.lanes, strict=True)}
            found = own.function(**words)
            torque, slopes = found if own.states else (found, ())
            named = slopes if isinstance(slopes, Mapping) else dict(zip(own.states, listed(slopes), strict=True))
            rows.append([torque, *(named[name] for name in own.states)])
        return dict(zip(("torque", *own.rows), np.array(rows, dtype=float).T, strict=True))

    def change(self, value: Callable[[dict[str, Any]], Any], given: dict[str, Any], *states: str) -> Any:
        """By differences, how a value changes with states that change together."""
        step = STEP * self.scales[states[0]]
        ends = [value({**given, **{f"s.{n}": given[f"s.{n}"] + way * step for n in states}}) for way in (1, -1)]
        return (ends[0] - ends[1]) / (2 * step)

    # Steady drilling

    @cached_property
    def drilling(self) -> Drilling:
        """That of the numbers of ``check``."""
        found: Drilling = checks_of(self.study.model).drilling_at(self.study.parameters, self.study.operation)
        return found

    @cached_property
    def balance(self) -> dict[str, Any]:
        """The inputs of the graph there."""
        at = self.drilling.at
        given = self.drilling.string.given(at.speed, at.set_speed, at)
        return {name: float(np.ravel(value)[0]) for name, value in given.items()}

    @cached_property
    def coordinates(self) -> tuple[str, ...]:
        """What turns: angles, speeds, and further states of the drive."""
        turning = self.drilling.string.turning
        return (*turning.angles, *turning.speeds, *turning.others)

    def rates(self, given: dict[str, Any]) -> Array:
        """The slopes of those, but for the angles."""
        slopes = self.drilling.string.motion.slopes_named()
        angles = len(self.drilling.string.turning.angles)
        found = plain.values({name: slopes[name] for name in self.coordinates[angles:]}, dict(given))
        return np.array([float(np.ravel(value)[0]) for value in found.values()])

    @cached_property
    def matrix(self) -> Array:
        """That of small deviations of the coordinates, with friction, by differences."""
        angles, size = len(self.drilling.string.turning.angles), len(self.coordinates)
        found = np.zeros((size, size))
        found[:angles, angles : 2 * angles] = np.eye(angles)
        found[angles:] = np.array([self.change(self.rates, self.balance, name) for name in self.coordinates]).T
        return found


def _lanes(columns: Mapping[str, Any]) -> dict[str, Any]:
    return {f"p.{name}": value for name, value in columns.items()}


def _most(difference: Any, size: Any) -> float:
    """The greatest difference over the greatest size; infinite where one is no number."""
    found = float(np.max(np.abs(difference), initial=0.0) / max(np.max(np.abs(size), initial=0.0), 1e-12))
    return found if math.isfinite(found) else math.inf


def torque(bench: DriveBench, report: Report) -> None:
    """The torque, against the function of a script, or a linear law with the gains that
    ``check`` tells; with a limit; and at rest, where a drive pushes forward, and the more
    the farther it is behind."""
    if not bench.by_torque:
        return  # the torque is a state
    _law(bench, report)
    found = bench.torque(bench.inputs)
    if is_limited(bench.drive.kind):
        limit = 0.5 * float(np.max(np.abs(found)))
        kept = np.clip(found, 0.0, limit)
        report.add("torque with a limit", _most(bench.torque(bench.inputs, limit) - kept, found), 1e-9)
    rest = bench.balance | {f"s.{name}": 0.0 for name in bench.motion.states} | {"time": SWITCHED_ON}
    rest |= _lanes(bench.columns) | {
        f"s.{name}": value for name, value in (bench.own.start if bench.own else {}).items()
    }
    now, behind = (float(bench.torque(rest | {"s.lag": lag, "s.twist": lag})) for lag in (0.0, -1.0))
    report.add("backwards at rest", max(-now, now - behind, 0.0), 1e-9 * abs(bench.drilling.torque), f"{now:.4g} N m")


def _law(bench: DriveBench, report: Report) -> None:
    found = bench.torque(bench.inputs)
    if bench.own is not None:
        called = bench.called(bench.inputs)
        off = [_most(found - called["torque"], found)]
        for name, slope in plain.values({name: bench.slopes[name] for name in bench.own.rows}, bench.inputs).items():
            off.append(_most(slope - called[name], slope))
        report.add("torque and rates against its function", max(off), 1e-9)
        return
    gains = [
        -float(np.median(bench.change(bench.torque, bench.inputs, *states)))
        for states in (("lag", "twist"), ("drive_speed",), ("twist",), ("bit_speed",))
    ]
    lag, speed, twist, bit = (bench.inputs[f"s.{name}"] for name in MOTION)
    set_speed = bench.columns["set_speed"]
    deviations = (lag, speed - set_speed, twist - lag, bit - set_speed)
    linear = -sum(gain * deviation for gain, deviation in zip(gains, deviations, strict=True))
    report.add("torque against its law", _most(found - linear, found), 1e-7)
    told = checks_of(bench.study.model).every_derived_quantity(bench.study.parameters, bench.study.operation)
    for gain, name in zip(gains, ("drive_stiffness", "drive_damping"), strict=False):
        report.add(f"{name} of check", _most(gain - told[name].value, gains), 1e-7)


def gains(bench: DriveBench, report: Report) -> None:
    """How torque and slopes of a drive of a script change in steady drilling, as the linear
    theory has it, against differences of its function."""
    if (own := bench.own) is None:
        return
    states = {name.removeprefix("s."): value for name, value in bench.balance.items() if name.startswith("s.")}
    linear = own.linear({**states, "set_speed": bench.balance["p.set_speed"]}, bench.columns)
    told = np.block([[-linear.gains, linear.torque], [linear.motion, linear.states]])
    columns = [
        bench.change(lambda given: np.array([v[0] for v in bench.called(given).values()]), bench.balance, name)
        for name in (*MOTION, *own.rows)
    ]
    for row, name, found in zip(told, ("torque", *own.rows), np.array(columns).T, strict=True):
        what = "gains" if name == "torque" else f"rate of {name}"
        report.add(f"{what} against differences", _most(row - found, found), 1e-5)


def steady(bench: DriveBench, report: Report) -> None:
    """In steady drilling nothing accelerates; small deviations from it are those of the
    equations; and they do not grow by themselves, of a bit that turns without friction and
    of one that is held."""
    string, angles = bench.drilling.string, len(bench.drilling.string.turning.angles)
    if not np.all(np.isfinite([*bench.balance.values()])):
        report.add("slopes in steady drilling", math.inf, 1e-9, "no balance of drive and bit is found")
        return
    reach = np.abs(bench.matrix) @ [bench.scales[name] for name in bench.coordinates]
    worst = int(np.argmax(np.abs(rates := bench.rates(bench.balance)) / reach[angles:]))
    off = _most(rates[worst], reach[angles + worst])
    report.add("slopes in steady drilling", off, 1e-9, f"of {bench.coordinates[angles + worst]}")
    if off > 1e-3:
        return  # nothing is steady there
    matrix, column = string.linear(bench.drilling.at)
    fall = float(string.fall(bench.drilling.at.speed, bench.drilling.at.set_speed))
    matrix[:, string.bit] -= fall * column
    found = bench.matrix.copy()
    if not string.holds:
        found[:angles, angles] -= 1.0  # angles are behind the top
        found = found[1:, 1:]
    report.add("small deviations against differences", _most(matrix - found, found), 1e-5)
    turned = np.abs(bench.matrix[angles:, :angles].sum(axis=1)).max()
    holds = turned > 1e-7 * np.abs(bench.matrix[angles:, :angles]).max()
    report.add("whether it holds its angle", string.holds != holds, 0, "yes" if holds else "no")
    kept = [k for k in range(len(bench.coordinates)) if k not in (angles - 1, 2 * angles - 1)]
    for words, part in (("turns", bench.drilling.matrix), ("is held", bench.matrix[np.ix_(kept, kept)])):
        root = growing(part)
        report.add(f"growth where the bit {words} [1/s]", 0.0 if root is None else root.real, 0.0)


def motion(bench: DriveBench, report: Report) -> None:
    """States of its own are not negligible beside their natural scales, with which the steps
    are taken; and explicit and implicit friction end alike, of a bit that turns."""
    if bench.own is not None and bench.own.states:
        trace = bench.simulate(LONG * max(bench.period, bench.turn))
        for name in bench.own.rows:
            swing, scale = float(np.ptp(trace[name].values)), bench.scales[name]
            words = f"{scale:.3g}, and it varies by {swing:.3g}"
            report.add(f"scale of {name} over its swing", scale / swing if swing else 0.0, 10.0, words)
    methods(bench, report)


CHECKS = (python, machine_code, tangent, torque, gains, steady)


def compare_drive(kind: str, model: str, text: str, seed: int, count: int, report: Report) -> None:
    """The comparisons of the drive of this kind in a model. InputError where it has no torque,
    or the model has no drive."""
    if model not in SERVED:
        raise InputError(f"check_drive: found the model {model}; allowed: {', '.join(SERVED)}.")
    if kind == "ideal":
        raise InputError("check_drive: found ideal, which turns at the set speed; allowed: any other kind of drive.")
    words = {"drive.kind": kind}
    bench = bench_of(DriveBench, model, text, seed, count, words=words)
    for check in CHECKS:
        check(bench, report)
    unread_of(bench, report, [key for key in bench.numbers if key.startswith("drive.")])
    if report.failed:
        return  # a motion with a torque that jumps takes steps without end
    motion(bench, report)
    at_rest = bench_of(DriveBench, model, text, seed, count, words=words | {"initial.bit_speed": "0 rad/s"})
    methods(at_rest, report, ", bit at rest")
