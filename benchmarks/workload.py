"""The runs that everybody computes: operating points, initial states, constants of the
equations, tolerances.

Peers see none of nsdrill's compiled code and none of its packed tables: they get the
lumped coefficients of the theory page in an order of their own (:data:`CONSTANTS`), so
that the benchmarks do not depend on how the kernel lays out its memory.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from concurrent.futures import Executor, Future
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from nsdrill.kernel.batch import Runs
from nsdrill.kernel.settings import Simulation
from nsdrill.models.christoforou_yigit.coefficients import derive
from nsdrill.models.christoforou_yigit.parameters import Initial, Parameters
from nsdrill.models.registry import described
from nsdrill.models.responses import Thresholds
from nsdrill.observe.thresholds import Record
from nsdrill.sweep.engine import Engine, Progress
from nsdrill.sweep.plan import Plan
from nsdrill.sweep.work import Work

Array = np.ndarray[Any, np.dtype[Any]]
STATES = 8
WOB = 22.24e3
CONSTANTS = (
    "phase",
    "drive",
    "wob",
    "per_m_l",
    "per_J",
    "per_m_a",
    "q",
    "k_bend",
    "soft_F",
    "soft_T",
    "c_h",
    "c_a",
    "k_a",
    "c_t",
    "k_t",
    "gap",
    "k_w",
    "R_c",
    "eps_w",
    "tau_w",
    "rise_w",
    "mu_w",
    "k_c",
    "s0",
    "eps_b",
    "tau_b",
    "rise_b",
    "mu_b",
    "lobes",
)


@dataclass(frozen=True)
class Problem:
    """Independent runs of one duration: ``constants`` [n, CONSTANTS], ``state_scales``
    [n, 8] (the absolute tolerance is rtol times these), ``first_step`` [n], ``initial``
    [n, 8]."""

    constants: Array
    state_scales: Array
    first_step: Array
    initial: Array
    duration: float

    def __len__(self) -> int:
        return len(self.initial)

    def part(self, which: Any) -> Problem:
        return Problem(
            *(
                np.ascontiguousarray(a[which])
                for a in (self.constants, self.state_scales, self.first_step, self.initial)
            ),
            self.duration,
        )


@dataclass(frozen=True)
class Started(Work):
    """Work whose points start from ``begun`` [points, 9] (the drive angle last) where
    given, not from the rule."""

    begun: Array | None = None

    def prepare(self, points: Array) -> Runs:
        runs = super().prepare(points)
        return runs if self.begun is None else replace(runs, initial=self.begun[points])


def grid(
    depths: Array,
    speeds: Array,
    transient: float,
    observe: float,
    rtol: float = 1e-6,
    wob: float = WOB,
    parameters: Parameters | None = None,
) -> Started:
    """A depth x speed grid at one weight on bit, every point from the default initial
    state."""
    plan = Plan({"depth": depths, "wob": np.array([wob]), "rotary_speed": speeds}, "same", None)
    simulation = Simulation(transient, observe, rtol)
    return Started(
        plan, parameters or Parameters(), Initial(), simulation, Thresholds(), Record(), described("christoforou_yigit")
    )


def mixed(depths: int, speeds: int, transient: float, observe: float, rtol: float = 1e-6) -> Started:
    """The race's grid: 1000 to 8000 m, 1 to 8 rad/s at 22.24 kN. From rest at the
    hole's centre this holds stick-slip (slow), free whirl with the bit on rock or
    bouncing (middle) and rolling along the wall (fast)."""
    return grid(np.linspace(1000.0, 8000.0, depths), np.linspace(1.0, 8.0, speeds), transient, observe, rtol)


def middles(side: int, duration: float) -> Started:
    """``side`` x ``side`` points over the race's range, each in the middle of its cell:
    so the mean cost of a run does not depend on how many there are, as it would with
    points on the border."""
    places = (np.arange(side) + 0.5) / side
    return grid(1000.0 + 7000.0 * places, 1.0 + 7.0 * places, 0.3 * duration, 0.7 * duration)


def with_rtol(work: Started, rtol: float) -> Started:
    return replace(work, simulation=replace(work.simulation, rtol=rtol))


def problem_of(work: Started) -> Problem:
    """The same runs for the peers."""
    points = np.arange(work.plan.points)
    runs = work.prepare(points)
    constants = constants_of(work.parameters, *work.plan.values(points).values(), runs.initial[:, STATES])
    duration = work.simulation.transient + work.simulation.observe
    return Problem(
        constants, runs.state_scales.copy(), runs.first_step.copy(), runs.initial[:, :STATES].copy(), duration
    )


def constants_of(parameters: Parameters, depth: Array, wob: Array, speed: Array, drive_angle: Array) -> Array:
    """The coefficients of the equations of motion at operating points, columns
    :data:`CONSTANTS`."""
    if parameters.well.law != "linear" or parameters.drillstring.lateral_softening != "live":
        raise ValueError("the peers know the linear wall and the live softening only")
    k = derive(parameters, depth, wob, speed)
    string, well, bit = parameters.drillstring, parameters.well, parameters.bit
    q = k.m_e * string.eccentricity / k.m_l
    span, arm = string.collar.span, 2 / 3 * k.bit_radius
    columns = (
        np.fmod(drive_angle, 2 * math.pi),
        speed,
        wob,
        1 / k.m_l,
        1 / (k.J + k.m_e * string.eccentricity * (string.eccentricity - q)),
        1 / k.m_a,
        q,
        k.k_bend,
        math.pi**2 / (2 * span),
        math.pi**3 / (2 * span**2),
        k.c_h,
        string.axial_damping,
        k.k_a,
        string.torsional_damping,
        k.k_t,
        k.gap,
        well.stiffness,
        k.collar_radius,
        well.friction.smoothing,
        well.friction.decay,
        well.friction.static - well.friction.dynamic,
        well.friction.dynamic,
        bit.rock_stiffness,
        bit.surface_amplitude,
        bit.friction.smoothing,
        bit.friction.decay,
        arm * (bit.friction.static - bit.friction.dynamic),
        arm * bit.friction.dynamic + k.cutting_arm,
        float(bit.lobes),
    )
    return np.stack([np.broadcast_to(np.asarray(c, dtype=float), depth.shape) for c in columns], axis=1)


class Inline(Executor):
    """Runs each task where it is submitted: one thread, nothing in the background."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        future.set_result(fn(*args, **kwargs))
        return future


def sweep(
    work: Work, lanes: int, executor: Executor | None = None, workers: int = 1
) -> tuple[dict[str, Array], Progress]:
    """The work's results by point, one array a variable, and how it went: as
    ``nsdrill run`` computes them."""
    parts: list[tuple[Array, dict[str, Array]]] = []
    engine = Engine(work, executor or Inline(), workers, lanes, lambda points, columns: parts.append((points, columns)))
    progress = engine.run()
    order = np.argsort(np.concatenate([points for points, _ in parts]))
    columns = {name: np.concatenate([c[name] for _, c in parts])[order] for name in parts[0][1]}
    return columns, progress


def spun_up(work: Started, seconds: float, rtol: float = 1e-8) -> Started:
    """The same work, but from the states reached after ``seconds``: for cases that must
    begin in their regime."""
    long = replace(work, simulation=Simulation(seconds / 2, seconds / 2, rtol))
    columns, _ = sweep(long, 8)
    return replace(work, begun=columns["final_state"])


def regimes(columns: dict[str, Array]) -> dict[str, int]:
    """How many points are in which regime, by nsdrill's observers."""
    wall = columns["wall_contact_fraction"] > 0.5
    stick = ~wall & (columns["stuck_fraction"] > 0.0)
    bounce = ~wall & ~stick & (columns["lift_off_fraction"] > 0.01)
    return {
        "on the wall": int(wall.sum()),
        "stick-slip": int(stick.sum()),
        "bouncing": int(bounce.sum()),
        "free whirl on rock": int((~wall & ~stick & ~bounce).sum()),
    }
