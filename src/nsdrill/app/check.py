"""Check a study without running it: the derived coefficients, what an engineer reads off them, and warnings."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import product
from operator import itemgetter
from typing import Any

from nsdrill.app.planned import kept_of, plan_of
from nsdrill.app.size import disk, memory
from nsdrill.models.christoforou_yigit.coefficients import UNITS, Coefficients, derive
from nsdrill.models.christoforou_yigit.figures import Figure, figures, growth_at_rest, lateral_stiffness, mean_torque
from nsdrill.models.christoforou_yigit.further import further_figures
from nsdrill.models.christoforou_yigit.laws import steepest
from nsdrill.models.leaves import Values, values_at
from nsdrill.models.operation import Operation
from nsdrill.models.schedule import Ramp
from nsdrill.quantity import amount, unit_in
from nsdrill.study.study import Study
from nsdrill.variables import MODEL

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
MOST_STEPS_A_SECOND = 2000  # a point of 500 s then takes a million steps
LEAST_TURNS = 20
LEAST_PERIODS = 4
SHARP = 500.0  # smoothing times dynamic_from
LARGE = 2e9  # bytes of results


@dataclass(frozen=True)
class Report:
    """What ``check`` finds at the study's ``operation``: coefficients (None of a model that has others), figures, and
    warnings in plain sentences. Of a
    refined sweep ``points`` are those of the finest grid, ``coarse_points`` those that are run in any case. A run takes
    ``disk`` [bytes] at most and ``memory`` [bytes] about; both are 0 where a ramp stands in place of a sweep."""

    operation: Operation
    coefficients: Coefficients | None
    figures: dict[str, Figure]
    warnings: list[str]
    points: int
    chains: int
    ramps: dict[str, Ramp]
    coarse_points: int
    disk: int
    memory: float

    def as_json(self) -> dict[str, Any]:
        """Plain data for ``--json``."""
        return {
            "operation": {
                "depth": {"value": self.operation.depth, "units": "m"},
                "wob": {"value": self.operation.wob, "units": "N"},
                "rotary_speed": {"value": self.operation.rotary_speed, "units": "rad/s"},
            },
            "coefficients": {
                name: {"value": float(getattr(self.coefficients, name)), "units": UNITS[name]}
                for name in (MEANINGS if self.coefficients else ())
            },
            "figures": {
                name: {"value": figure.value, "units": figure.units, "meaning": figure.meaning}
                for name, figure in self.figures.items()
            },
            **(
                {
                    "ramps": {
                        name: {"time": list(ramp.times), "value": list(ramp.values)}
                        for name, ramp in self.ramps.items()
                    }
                }
                if self.ramps
                else {}
            ),
            "points": self.points,
            "chains": self.chains,
            "coarse_points": self.coarse_points,
            "size": {"disk": {"value": self.disk, "units": "B"}, "memory": {"value": self.memory, "units": "B"}},
            "warnings": self.warnings,
        }


def check(study: Study, units: str = "si") -> Report:
    """Coefficients and figures at the operating point of ``study``, for a ramp that at its start, and warnings over its
    whole sweep and its ramps, whose sentences are in the ``units`` "si" or "field". ``points`` and ``chains`` are 0
    where a ramp stands in place of a sweep."""
    plan = plan_of(study)
    operation = operation_of(study)
    k, shown = None, {}
    if study.model == MODEL:
        k = derive(study.parameters, operation.depth, operation.wob, operation.rotary_speed)
        shown = {**figures(study.parameters, operation), **further_figures(study.parameters, operation)}
    points, chains = (0, 0) if study.ramped and not study.swept else (plan.points, plan.chains)
    coarse = points
    for axis in study.refined:
        coarse = coarse // len(study.axes[axis]) * coarse_length(study, axis)
    return Report(
        operation,
        k,
        shown,
        _warnings(study, units),
        points,
        chains,
        study.ramps,
        coarse,
        disk(plan, kept_of(study)) if points else 0,
        memory(plan) if points else 0.0,
    )


def operation_of(study: Study) -> Operation:
    """The operating point of a study; at the least depth of a sweep where its own does not reach below the collars."""
    operation = study.operation
    if (
        study.model == MODEL
        and "depth" in study.swept
        and not operation.depth > study.parameters.drillstring.collar.length
    ):
        operation = replace(operation, depth=float(study.axes["depth"][0]))
    return operation


def coarse_length(study: Study, axis: str) -> int:
    """How many values of an axis are run before it is refined."""
    values = len(study.axes[axis])
    return (values - 1) // 2**study.refine + 1 if axis in study.refined else values


def _warnings(study: Study, units: str) -> list[str]:
    own = study.model == MODEL
    found = (
        [
            _buckled(study, units),
            _slow(study),
            _rounded(study),
            _overloaded(study, units),
            _eccentric(study, units),
            _unstable(study, units),
        ]
        if own
        else []
    )
    if study.swept or not study.ramped:  # else there is no observed window
        found += [_few_turns(study, units), _few_periods(study) if own else None, _verified(study), _large(study)]
    return [warning for warning in found if warning is not None]


def _told(value: float, si: str, shown: str, units: str) -> str:
    """A value in the units ``si`` in a warning: in ``shown`` units, or in field units."""
    return amount(value, unit_in(si, units) or shown, 4)


def _verified(study: Study) -> str | None:
    if not study.simulation.verify:
        return None
    from nsdrill.app.trust import checks  # late: it brings the compiler, which nothing else here needs

    tight, _ = checks(study.simulation)
    return (
        f"Verify: every point is run again with the tolerance {tight.simulation.rtol:g} and continued for another "
        f"{study.simulation.transient + study.simulation.observe:g} s. The study takes about 4 times as long."
    )


def _large(study: Study) -> str | None:
    size = disk(plan_of(study), kept_of(study))
    if size < LARGE:
        return None
    most = ", all points run," if study.refined else ""
    return (
        f"Large: the results take up to {size / 1e9:.3g} GB on the disk{most} and as much again while the file is "
        "written. record.poincare and record.peaks say how much is kept of each point."
    )


def ends_of(study: Study, axis: str) -> tuple[float, float]:
    """The least and the greatest value that an axis, or the ramp in its place, takes."""
    if axis in study.ramped:
        return min(study.ramps[axis].values), max(study.ramps[axis].values)
    return float(study.axes[axis][0]), float(study.axes[axis][-1])


def _corners(study: Study) -> list[Values]:
    """What the points have at the ends of all axes and ramps, each with each."""
    ends = [sorted(set(ends_of(study, axis))) for axis in study.axes]
    return [
        values_at(study.parameters, study.initial, dict(zip(study.axes, values, strict=True)))
        for values in product(*ends)
    ]


def _buckled(study: Study, units: str) -> str | None:
    least, worst, load = min(
        (
            (
                float(lateral_stiffness(at.parameters, Operation(*at.operation), k)),
                at.operation[1],
                float(k.buckling_load),
            )
            for at in _corners(study)
            for k in [derive(at.parameters, *at.operation)]
        ),
        key=itemgetter(0),
    )
    if least >= 0:
        return None
    return (
        f"Buckled: at {_told(worst, 'N', 'kN', units)} the lateral stiffness of the span is negative "
        f"({_told(least, 'N/m', 'N/m', units)}; Euler load {_told(load, 'N', 'kN', units)}). The collar leans on the "
        "wall there; that is allowed, but no whirl inside the hole exists. Shorten the span or "
        "lower the weight on bit if it is not meant."
    )


def _slow(study: Study) -> str | None:
    """An explicit method takes about (slope of the friction) / 3.3 steps a second while the bit sticks."""

    def steps(at: Values) -> tuple[float, str, float]:
        k = derive(at.parameters, *at.operation)
        law = at.parameters.bit.friction
        key = "b1" if law.law == "rational" else "smoothing"
        return float(steepest(at.parameters, k) * at.operation[1] / k.J / 3.3), key, float(getattr(law, key))

    rate, key, value = max(map(steps, _corners(study)))
    if rate <= MOST_STEPS_A_SECOND:
        return None
    return (
        f"Slow: the friction at the bit is so steep ({key} {value:g} s/rad) that a stuck bit takes about "
        f"{rate:.3g} steps per simulated second. A smaller {key} is faster in proportion."
    )


def _rounded(study: Study) -> str | None:
    """The smoothing takes the peak off the linear law, which has all its fall below the speed dynamic_from."""
    law = study.parameters.bit.friction
    if law.law != "linear":
        return None
    laws = [at.parameters.bit.friction for at in _corners(study)]
    sharpness, law = min(((law.smoothing * law.dynamic_from, law) for law in laws), key=itemgetter(0))
    if sharpness >= SHARP:
        return None
    return (
        f"Rounded: with smoothing {law.smoothing:g} s/rad and dynamic_from {law.dynamic_from:g} rad/s their product is "
        f"{sharpness:.3g}. Below {SHARP:g} the smoothing takes off the peak of the linear law, and stick-slip ends at "
        f"a lower speed than it should. Raise bit.friction.smoothing to {SHARP / law.dynamic_from:.3g} s/rad."
    )


def _overloaded(study: Study, units: str) -> str | None:
    """A motor at its limit does not keep the set speed."""
    if study.parameters.drive.torque_limit is None:
        return None
    torque, limit = max(
        (
            (mean_torque(at.parameters, Operation(*at.operation), derive(at.parameters, *at.operation)), limit)
            for at in _corners(study)
            if (limit := at.parameters.drive.torque_limit) is not None
        ),
        key=lambda pair: pair[0] - pair[1],
    )
    if torque <= limit:
        return None
    return (
        f"Overloaded: steady drilling takes {_told(torque, 'N m', 'kN*m', units)}, and the drive has "
        f"{_told(limit, 'N m', 'kN*m', units)} at most (drive.torque_limit). It cannot keep the set speed; the string "
        "stops or turns slower, and lags behind more and more."
    )


def _eccentric(study: Study, units: str) -> str | None:
    gap, offset = min(
        (
            (float(derive(at.parameters, *at.operation).gap), at.parameters.drillstring.eccentricity)
            for at in _corners(study)
        ),
        key=lambda pair: pair[0] - pair[1],
    )
    if offset <= gap:
        return None
    return (
        f"Eccentric: the eccentricity ({_told(offset, 'm', 'mm', units)}) exceeds the clearance "
        f"({_told(gap, 'm', 'mm', units)}): the collar is on the wall at almost any speed."
    )


def _unstable(study: Study, units: str) -> str | None:
    """A drive that swings the string by itself, as gains of the wrong sign make it."""
    if study.parameters.drive.ideal or study.parameters.modes.torsional == "frozen":
        return None
    found = [
        (root, at)
        for at in _corners(study)
        if (root := growth_at_rest(at.parameters, derive(at.parameters, *at.operation))) is not None
    ]
    if not found:
        return None
    root, at = max(found, key=lambda pair: pair[0].real)
    swing = f" and swings at {abs(root.imag):.4g} rad/s" if abs(root.imag) > 1e-9 * abs(root) else ""
    depth = f" at {_told(at.operation[0], 'm', 'm', units)}" if "depth" in study.swept else ""
    return (
        f"Unstable: without any friction at the bit the string and its drive{depth} do not come to rest: an eigenvalue "
        f"is {root.real:.4g}{f' +- {abs(root.imag):.4g}i' if swing else ''} 1/s, so a deviation grows e-fold in "
        f"{1 / root.real:.3g} s{swing}. Look at the signs and sizes of the gains of drive: "
        f"{study.parameters.drive.kind}."
    )


def _few_turns(study: Study, units: str) -> str | None:
    slowest = ends_of(study, "rotary_speed")[0]
    turns = slowest * study.simulation.observe / (2 * math.pi)
    if turns >= LEAST_TURNS:
        return None
    return (
        f"Short: at {_told(slowest, 'rad/s', 'rad/s', units)} the observed window of {study.simulation.observe:g} s "
        f"holds only {turns:.3g} turns of the drive. Extremes and fractions will be rough; lengthen simulation.observe."
    )


def _few_periods(study: Study) -> str | None:
    coefficients = [derive(at.parameters, *at.operation) for at in _corners(study)]
    period = max(2 * math.pi * math.sqrt(float(k.J) / float(k.k_t)) for k in coefficients)
    if study.simulation.observe >= LEAST_PERIODS * period:
        return None
    return (
        f"Short: the torsional period at the greatest depth is {period:.3g} s; the observed window of "
        f"{study.simulation.observe:g} s holds fewer than {LEAST_PERIODS}. Lengthen simulation.observe."
    )
