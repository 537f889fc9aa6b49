"""Further derived quantities at one operating point, of effects that the lumped model
leaves out: buckling of collars and pipe, higher lateral modes, damping by the mud,
standing waves of the string, and contact of the collar with the low side."""

from __future__ import annotations

import math

import numpy as np

from nsdrill.models.christoforou_yigit import buckling, tubes
from nsdrill.models.christoforou_yigit.coefficients import Coefficients, derive
from nsdrill.models.christoforou_yigit.derived_quantities import lateral_stiffness
from nsdrill.models.christoforou_yigit.parameters import Parameters
from nsdrill.models.christoforou_yigit.tubes import Tube
from nsdrill.models.christoforou_yigit.waves import axial_waves, rising_root, torsional_waves
from nsdrill.models.numbers import HELIX, DerivedQuantity
from nsdrill.models.operation import Operation

WAVES = 4  # standing waves that are listed
HALF_WAVES = 3  # lateral modes
HORIZONTAL = math.pi / 2
ENDS = {
    "fixed_free": "one end fixed, one free",
    "fixed_pinned": "fixed and pinned",
    "fixed_fixed": "fixed at both ends",
}


def further_quantities(parameters: Parameters, operation: Operation) -> dict[str, DerivedQuantity]:
    """The further quantities by name."""
    k = derive(parameters, operation.depth, operation.wob, operation.rotary_speed)
    quantities = {
        **_buckling(parameters, operation),
        **_lateral(parameters, operation, k),
        **_waves(parameters, operation),
    }
    return {
        name: DerivedQuantity(value, units, words, group, True)
        for name, (value, units, words, group) in quantities.items()
    }


Row = tuple[float | None, str, str, str]


def _buckling(parameters: Parameters, operation: Operation) -> dict[str, Row]:
    collar, pipe = tubes.collars(parameters), tubes.pipe(parameters, operation.depth)
    span = parameters.drillstring.collar.span
    quantities: dict[str, Row] = {
        f"euler_{ends}": (
            buckling.euler(collar.bending, span, ends),
            "N",
            f"Euler load of the span, {words}",
            "buckling",
        )
        for ends, words in ENDS.items()
    }
    quantities["collar_vertical"] = (
        buckling.vertical(collar),
        "N",
        "WOB at which the collars, hinged, buckle in a vertical hole",
        "buckling",
    )
    for name, tube in (("collar", collar), ("pipe", pipe)):
        load = float(buckling.sinusoidal(tube, HORIZONTAL))
        quantities |= {
            f"{name}_sinusoidal": (
                _finite(load),
                "N",
                f"load at which the {name} buckles in a horizontal hole",
                "buckling",
            ),
            f"{name}_helical": (_finite(HELIX * load), "N", "load at which that becomes a helix", "buckling"),
            f"{name}_half_wave": (buckling.half_wave(tube, HORIZONTAL), "m", "half wave of the sinusoid", "buckling"),
        }
    return quantities


def _lateral(parameters: Parameters, operation: Operation, k: Coefficients) -> dict[str, Row]:
    quantities: dict[str, Row] = {}
    in_mud, without_mud = (lateral_frequencies(parameters, operation, k, mass) for mass in (float(k.m_l), float(k.m_c)))
    for number in range(2, HALF_WAVES + 1):
        words = f"lateral frequency of {number} half waves, which the model leaves out"
        quantities[f"lateral_{number}"] = (_finite(in_mud[number - 1]), "rad/s", words, "lateral")
    for number in range(1, HALF_WAVES + 1):
        words = f"lateral frequency of {number} half wave{'s' * (number > 1)}, without mud"
        quantities[f"lateral_dry_{number}"] = (_finite(without_mud[number - 1]), "rad/s", words, "lateral")
    gap = float(k.gap)
    for name, words in (("plane", "in a plane"), ("circular", "on a circle")):
        ratio = mud_damping(k, gap, circular=name == "circular")
        text = f"damping ratio by the mud, {words} as wide as the clearance; falls with the amplitude"
        quantities[f"mud_{name}"] = (ratio, "1", text, "lateral")
    quantities["wall_inclination"] = (
        wall_inclination(parameters, operation, k),
        "rad",
        "least inclination of the hole at which the collar rests on the wall",
        "lateral",
    )
    quantities["low_side_swing"] = (
        low_side_swing(parameters, operation, k),
        "rad/s",
        "swing of the collar on the low side of a horizontal hole",
        "lateral",
    )
    return quantities


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _waves(parameters: Parameters, operation: Operation) -> dict[str, Row]:
    rows: tuple[tuple[str, np.ndarray, str, str], ...] = (
        ("torsional_wave", torsional_waves(parameters, operation.depth, WAVES), "torsional wave", "rotation"),
        ("axial_wave", axial_waves(parameters, operation.depth, WAVES), "axial wave, bit off the rock", "axial"),
        (
            "axial_rock_wave",
            axial_waves(parameters, operation.depth, WAVES, on_rock=True),
            "axial wave, bit on the rock",
            "axial",
        ),
    )
    return {
        f"{name}_{number}": (float(value), "rad/s", f"standing {words}, mode {number}", group)
        for name, values, words, group in rows
        for number, value in enumerate(values, start=1)
    }


def lateral_frequencies(
    parameters: Parameters, operation: Operation, k: Coefficients, mass: float, count: int = HALF_WAVES
) -> np.ndarray:
    """Frequencies [rad/s] of 1, 2, ... half waves of the span with this modal ``mass``
    [kg], which is the same for all; NaN where buckled. From E I d4y/dx4 + W d2y/dx2 + m
    d2y/dt2 = 0 of a pinned beam."""
    stiffness = np.array([lateral_stiffness(parameters, operation, k, number + 1) for number in range(count)])
    return np.sqrt(np.where(stiffness >= 0.0, stiffness, np.nan) / mass)


def mud_damping(k: Coefficients, amplitude: float, *, circular: bool) -> float:
    """The ratio of the linear damping that dissipates as much energy per cycle as the
    quadratic drag c_h |v| v at this ``amplitude`` A [m]: c_h A / (2 m_l) on a circle,
    4 / (3 pi) c_h A / m_l in a plane, at any frequency."""
    ratio = float(k.c_h) * amplitude / float(k.m_l)
    return ratio / 2 if circular else ratio * 4 / (3 * math.pi)


def modal_weight(parameters: Parameters) -> float:
    """The modal force [N] of the weight in mud on the first mode of a horizontal span;
    the shape sin(pi x / l) has the integral 2 l / pi."""
    tube: Tube = tubes.collars(parameters)
    return 2 * parameters.drillstring.collar.span / math.pi * tube.weight


def wall_inclination(parameters: Parameters, operation: Operation, k: Coefficients) -> float | None:
    """Inclination [rad] of the hole at which the span sags as far as the wall, k_r (c0
    - s0) = F_g sin(alpha) with the clearance s0 of the stabilisers; None where it does
    not."""
    stiffness = lateral_stiffness(parameters, operation, k)
    force = modal_weight(parameters)
    reach = max(stiffness, 0.0) * (float(k.gap) - (parameters.stabilizer.clearance or 0.0))
    return math.asin(reach / force) if reach <= force and force > 0.0 else None


def low_side_swing(parameters: Parameters, operation: Operation, k: Coefficients) -> float | None:
    """Frequency [rad/s] of small swings along the wall about the low side of a
    horizontal hole, sqrt(F_g / (m_l r)) at the radius r of rest, k_r (r - s0) + k_w (r
    - c0)^p = F_g; None where the collar does not rest on the wall."""
    if wall_inclination(parameters, operation, k) is None:
        return None
    stiffness, force, gap = (lateral_stiffness(parameters, operation, k), modal_weight(parameters), float(k.gap))
    well = parameters.well
    power, clearance = 1.5 if well.law == "hertz" else 1.0, parameters.stabilizer.clearance or 0.0

    def excess(depth: float) -> float:
        return float(stiffness * (gap + depth - clearance) + well.stiffness * depth**power - force)

    upper = 1e-3 * gap
    while excess(upper) < 0.0:
        upper *= 2.0
        if upper > 10.0 * gap:
            return None  # a wall softer than the span is bent by the weight on bit
    return math.sqrt(force / (float(k.m_l) * (gap + rising_root(excess, 0.0, upper))))
