"""Check a study without running it: the derived coefficients, what an engineer reads off them, and warnings."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from nsdrill.app.run import plan_of
from nsdrill.model.coefficients import UNITS, Coefficients, derive
from nsdrill.model.figures import Figure, figures, lateral_stiffness
from nsdrill.model.parameters import Operation
from nsdrill.study.study import Study

MEANINGS = {
    "m_c": "modal steel mass of the span",
    "m_f": "modal fluid mass, inside and added",
    "m_l": "lateral mass",
    "m_e": "eccentric mass",
    "k_bend": "bending stiffness of the span",
    "c_h": "hydrodynamic drag coefficient",
    "m_a": "axial mass",
    "k_a": "axial stiffness of the pipe",
    "J": "rotary inertia",
    "k_t": "torsional stiffness of the pipe",
    "gap": "radial clearance between collar and wall",
    "depth_of_cut": "depth of cut per revolution",
    "cutting_arm": "arm of the cutting torque",
    "buckling_load": "buckling load of the span",
}


@dataclass(frozen=True)
class Report:
    """What ``check`` finds at the study's ``operation``: coefficients, figures, and warnings in plain sentences."""

    operation: Operation
    coefficients: Coefficients
    figures: dict[str, Figure]
    warnings: list[str]
    points: int
    chains: int

    def as_json(self) -> dict[str, Any]:
        """Plain data for ``--json``."""
        return {
            "operation": {
                "depth": {"value": self.operation.depth, "units": "m"},
                "wob": {"value": self.operation.wob, "units": "N"},
                "rotary_speed": {"value": self.operation.rotary_speed, "units": "rad/s"},
            },
            "coefficients": {
                name: {"value": float(getattr(self.coefficients, name)), "units": UNITS[name]} for name in MEANINGS
            },
            "figures": {
                name: {"value": figure.value, "units": figure.units, "meaning": figure.meaning}
                for name, figure in self.figures.items()
            },
            "points": self.points,
            "chains": self.chains,
            "warnings": self.warnings,
        }


def check(study: Study) -> Report:
    """Coefficients and figures at the operating point of ``study``, and warnings over its whole sweep."""
    plan = plan_of(study)
    operation = study.operation
    if "depth" in study.swept and not operation.depth > study.parameters.drillstring.collar.length:
        operation = Operation(float(study.axes["depth"][0]), operation.wob, operation.rotary_speed)
    k = derive(study.parameters, operation.depth, operation.wob, operation.rotary_speed)
    return Report(
        operation, k, figures(study.parameters, operation), _warnings(study), plan.points, plan.chains)


def _warnings(study: Study) -> list[str]:
    found = []
    parameters, axes = study.parameters, study.axes
    corners = [
        Operation(float(depth), float(wob), float(speed))
        for depth in {axes["depth"][0], axes["depth"][-1]}
        for wob in {axes["wob"][0], axes["wob"][-1]}
        for speed in {axes["rotary_speed"][0], axes["rotary_speed"][-1]}
    ]
    stiffness = [
        lateral_stiffness(parameters, corner, derive(parameters, corner.depth, corner.wob, corner.rotary_speed))
        for corner in corners
    ]
    if min(stiffness) < 0:
        worst = corners[int(np.argmin(stiffness))]
        load = derive(parameters, worst.depth, worst.wob, worst.rotary_speed).buckling_load
        found.append(
            f"Buckled: at {worst.wob / 1e3:.4g} kN the lateral stiffness of the span is negative "
            f"({min(stiffness):.4g} N/m; Euler load {load / 1e3:.4g} kN). The collar leans on the wall there; that is "
            "allowed, but no whirl inside the hole exists. Shorten the span or lower the weight on bit if it is not meant."
        )
    fastest = max(corner.rotary_speed for corner in corners)
    slope = max(2 / np.pi * law.smoothing for law in (parameters.bit.friction,))
    rise = slope * max(corner.wob for corner in corners) * parameters.bit.friction.static * parameters.well.diameter / 3
    inertia = min(derive(parameters, float(axes["depth"][0]), 0.0, fastest).J for _ in (0,))
    rate = rise / inertia / 3.3
    if rate > 2000:
        found.append(
            f"Slow: the friction at the bit is so steep (smoothing {parameters.bit.friction.smoothing:g} s/rad) that a "
            f"stuck bit takes about {rate:.3g} steps per simulated second. A smaller smoothing is faster in proportion."
        )
    gap = derive(parameters, float(axes["depth"][0]), 0.0, fastest).gap
    if parameters.drillstring.eccentricity > gap:
        found.append(
            f"The eccentricity ({parameters.drillstring.eccentricity * 1e3:.4g} mm) exceeds the clearance "
            f"({gap * 1e3:.4g} mm): the collar is on the wall at almost any speed.")
    turns = float(axes["rotary_speed"][0]) * study.simulation.observe / (2 * np.pi)
    if turns < 20:
        found.append(
            f"Short: at {float(axes['rotary_speed'][0]):.4g} rad/s the observed window of {study.simulation.observe:g} s "
            f"holds only {turns:.3g} turns of the drive. Extremes and fractions will be rough; lengthen "
            "simulation.observe.")
    slowest = np.sqrt(derive(parameters, float(axes["depth"][-1]), 0.0, fastest).k_t
                      / derive(parameters, float(axes["depth"][-1]), 0.0, fastest).J)
    if study.simulation.observe < 4 * 2 * np.pi / slowest:
        found.append(
            f"Short: the torsional period at the greatest depth is {2 * np.pi / slowest:.3g} s; the observed window of "
            f"{study.simulation.observe:g} s holds fewer than four. Lengthen simulation.observe.")
    return found
