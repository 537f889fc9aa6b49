"""The features of a run as anybody would compute them: from a finely sampled solution
by SciPy, with plain NumPy."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from reference import Case, contacts, derivative, solve

from nsdrill.analysis.cycles import period_of


@dataclass
class Sampled:
    """Samples of a window: times, states [8, n], contact forces and accelerations."""

    case: Case
    t: np.ndarray
    y: np.ndarray
    stuck_below: float

    def __post_init__(self) -> None:
        self.f = contacts(self.case, self.t, self.y)
        self.slope = derivative(self.case, self.t, self.y)

    def features(self) -> dict[str, float]:
        c, t, y, f = self.case, self.t, self.y, self.f
        x, vx, py, vy, z, _, twist, omega = y
        length = t[-1] - t[0]
        angle = np.unwrap(np.arctan2(py, x))
        mean_speed = c.speed + (twist[-1] - twist[0]) / length
        whirl = (angle[-1] - angle[0]) / length
        on_wall_turn = integral_above(t, f["radius"] - c.gap, omega)
        on_wall_slide = integral_above(t, f["radius"] - c.gap, (x * vy - py * vx) / f["radius"])
        torque = -c.k_t * twist
        return {
            "bit_speed_min": lowest(omega),
            "bit_speed_max": -lowest(-omega),
            "bit_speed_mean": mean_speed,
            "stick_slip_index": 50 * (-lowest(-omega) - lowest(omega)) / abs(mean_speed),
            "stick_slip_period": period_of(t, omega),
            "peak_ratio": -lowest(-omega) / c.speed,
            "stuck_fraction": 1 - above(t, omega - self.stuck_below) / length,
            "axial_min": lowest(z),
            "axial_max": -lowest(-z),
            "lift_off_fraction": 1 - above(t, f["interference"]) / length,
            "bit_force_max": -lowest(-f["bit_force"]),
            "bit_torque_max": -lowest(-f["bit_torque"]),
            "radius_max": -lowest(-f["radius"]),
            "radius_mean": integral(t, f["radius"]) / length,
            "wall_contact_fraction": above(t, f["radius"] - c.gap) / length,
            "wall_force_max": -lowest(-f["wall_force"]),
            "whirl_speed_mean": whirl,
            "whirl_ratio": whirl / mean_speed,
            "rolling_ratio": -on_wall_slide / (on_wall_turn * c.collar_radius) if on_wall_turn else 0.0,
            "surface_torque_min": lowest(torque),
            "surface_torque_max": -lowest(-torque),
            "surface_torque_mean": integral(t, torque) / length,
            "lateral_acceleration_rms": np.sqrt(integral(t, self.slope[1] ** 2 + self.slope[3] ** 2) / length),
            "axial_acceleration_rms": np.sqrt(integral(t, self.slope[5] ** 2) / length),
        }

    def peaks(self) -> dict[str, np.ndarray]:
        return {
            "axial_peaks": maxima(self.y[4]),
            "bit_speed_peaks": slips(self.y[7], self.stuck_below, self.case.speed),
            "radius_peaks": maxima(self.f["radius"]),
        }


def sample(case: Case, start: np.ndarray, transient: float, observe: float, stuck_below: float, step: float) -> Sampled:
    """The window of a run, sampled every ``step`` seconds from DOP853 at rtol 1e-12."""
    solution = solve(case, start[:8], transient + observe, rtol=1e-12, phase=0.0, dense=True)
    t = transient + np.linspace(0.0, observe, round(observe / step) + 1)
    return Sampled(case, t, solution.sol(t), stuck_below)


def integral(t: np.ndarray, v: np.ndarray) -> float:
    return float(np.trapezoid(v, t))


def above(t: np.ndarray, v: np.ndarray) -> float:
    """Time with v > 0, v taken as linear between samples."""
    a, b = v[:-1], v[1:]
    with np.errstate(divide="ignore", invalid="ignore"):
        part = np.where((a > 0) & (b > 0), 1.0, np.where((a <= 0) & (b <= 0), 0.0, np.maximum(a, b) / np.abs(a - b)))
    return float(np.sum(part * np.diff(t)))


def integral_above(t: np.ndarray, level: np.ndarray, v: np.ndarray) -> float:
    """Integral of v over the time with level > 0, both taken as linear between samples."""
    a, b = level[:-1], level[1:]
    with np.errstate(divide="ignore", invalid="ignore"):
        cross = np.where((a > 0) != (b > 0), a / (a - b), 0.0)
    begin, end = (np.where(a > 0, 0.0, np.where(b > 0, cross, 1.0)), np.where(b > 0, 1.0, np.where(a > 0, cross, 1.0)))
    middle = 0.5 * (begin + end)
    return float(np.sum(np.diff(t) * (end - begin) * (v[:-1] + middle * np.diff(v))))


def vertex(v: np.ndarray, i: np.ndarray) -> np.ndarray:
    """The extreme of the parabola through samples i - 1, i, i + 1."""
    before, here, after = v[i - 1], v[i], v[i + 1]
    bend = before - 2 * here + after
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(bend != 0, here - (after - before) ** 2 / (8 * bend), here)


def maxima(v: np.ndarray) -> np.ndarray:
    """Interior local maxima, refined."""
    i = np.flatnonzero((v[1:-1] > v[:-2]) & (v[1:-1] >= v[2:])) + 1
    return vertex(v, i)


def slips(v: np.ndarray, stuck: float, slip: float) -> np.ndarray:
    """The greatest value of each stretch above ``stuck`` that begins and ends there, if
    it is above ``slip``; all maxima of a bit that does not stick."""
    at = np.flatnonzero(v <= stuck)
    if len(at) == 0:
        return maxima(v)
    pieces = [v[a : b + 1] for a, b in pairwise(at) if b > a + 1]
    tops = np.array([-lowest(-piece) for piece in pieces])
    return tops[tops > slip]


def lowest(v: np.ndarray) -> float:
    """The least value, refined where it lies inside."""
    i = int(np.argmin(v))
    return float(v[i]) if i in (0, len(v) - 1) else float(vertex(v, np.array([i]))[0])
