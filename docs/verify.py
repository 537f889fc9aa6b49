"""Seven cases with known answers, measured through the public interface; prints the
table of the verification page.

    python docs/verify.py              # about half a minute
    python docs/verify.py --markdown   # the same as a Markdown table
    python docs/verify.py string table # only these cases

Exit code 1 where an error exceeds what is allowed. The tests run the quick cases.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import nsdrill
from nsdrill.app.running.run import run_in_memory
from nsdrill.app.simulating.trajectory import simulate
from nsdrill.models.operation import Operation
from nsdrill.study import parse_study

TESTS = Path(__file__).resolve().parents[1] / "tests"
if not (TESTS / "energies.py").exists():
    print(
        f"{TESTS / 'energies.py'}: there is no such file; this script needs a checkout of nsdrill, with the tests: "
        "python docs/verify.py",
        file=sys.stderr,
    )
    sys.exit(2)
sys.path.insert(0, str(TESTS))
from energies import energy, powers  # noqa: E402


@dataclass(frozen=True)
class Row:
    """One line of the table; ``error`` is relative unless ``absolute``."""

    case: str
    quantity: str
    expected: float
    measured: float
    allowed: float
    absolute: bool = False

    @property
    def error(self) -> float:
        size = 1.0 if self.absolute else abs(self.expected)
        return abs(self.measured - self.expected) / size

    @property
    def good(self) -> bool:
        return self.error <= self.allowed


def study(text: str, *settings: str) -> nsdrill.Study:
    return parse_study(text if "sweep:" in text else text + "\nsweep: {depth: 2000 m}\n", "<verify>", settings)


def string() -> Iterator[Row]:
    """Coefficients of a string from the literature, and of the default string to ten
    digits."""
    jansen = study("drillstring: {collar: {length: 150 m}}", "operation.depth=2150 m", "sweep.depth=2150 m")
    k = nsdrill.check(jansen).coefficients
    yield Row("1 string", "J of 2000 m of pipe over 150 m of collar [kg m²]", 373.99, k.J, 2e-5)
    yield Row("1 string", "k_t of the same [N m/rad]", 472.97, k.k_t, 2e-5)
    k = nsdrill.check(study("operation: {depth: 2000 m, wob: 22.24 kN, rotary_speed: 3 rad/s}")).coefficients
    by_hand = {
        "m_l": 3941.120735,
        "c_h": 1441.487328,
        "k_bend": 174186.7573,
        "m_a": 73314.5033,
        "k_a": 397218.7863,
        "J": 471.7007221,
        "k_t": 525.5269838,
        "depth_of_cut": 6.912151728e-4,
        "cutting_arm": 0.01147503771,
    }
    for name, value in by_hand.items():
        yield Row("1 string", f"{name}, default string at 2000 m", value, float(getattr(k, name)), 1e-9)


STICKING = """
drillstring: {eccentricity: 0 mm, torsional_damping: 0 N*m*s/rad}
bit:
  surface_amplitude: 0 mm
  cutting: {zeta: 0}
  friction: {static: 0.5, dynamic: 0.2, smoothing: 1e6 s/rad, decay: 300 s/rad}
initial: {x: 0 mm}
operation: {depth: 2000 m, wob: 22.24 kN, rotary_speed: 1 rad/s}
simulation: {rtol: 1e-8}
"""


def stick_slip() -> Iterator[Row]:
    """Dry friction of two values on a torsional spring: the classical stick-slip cycle."""
    s = study(STICKING)
    report = nsdrill.check(s)
    k, omega = report.coefficients, s.operation.rotary_speed
    law = s.parameters.bit.friction
    force = s.operation.wob * s.parameters.bit.rock_stiffness / (k.k_a + s.parameters.bit.rock_stiffness)
    # the greatest value of the smoothed law is its static friction
    speed = np.geomspace(1e-8, 1.0, 200_001)
    peak = np.max(
        2
        / math.pi
        * np.arctan(law.smoothing * speed)
        * ((law.static - law.dynamic) / (1 + law.decay * speed) + law.dynamic)
    )
    arm = 2 / 3 * k.bit_radius
    drop = force * arm * (peak - law.dynamic)
    w = math.sqrt(k.k_t / k.J)
    a = drop / (k.J * w)
    trace = simulate(s, duration=60.0, sample=5e-4).trace
    time, spin = trace.time, trace["bit_speed"]
    stuck = spin < 0.02 * omega
    starts, ends = np.flatnonzero(~stuck[1:] & stuck[:-1]), np.flatnonzero(stuck[1:] & ~stuck[:-1])
    ends = ends[ends > starts[0]]
    slip, stick = time[ends[1]] - time[starts[1]], time[starts[2]] - time[ends[1]]
    yield Row(
        "2 stick-slip",
        "greatest bit speed, Ω + √(Ω² + A²) [rad/s]",
        omega + math.hypot(omega, a),
        float(spin[starts[1] : ends[1]].max()),
        0.01,
    )
    slipping = 2 / w * (math.pi - math.atan(a / omega))
    yield Row("2 stick-slip", "slip time, (2/ω)(π − atan(A/Ω)) [s]", slipping, slip, 0.02)
    yield Row("2 stick-slip", "stick time, 2(T_s − T_d)/(k_t Ω) [s]", 2 * drop / (k.k_t * omega), stick, 0.03)


LIFTING = """
drillstring: {eccentricity: 0 mm, torsional_damping: 0 N*m*s/rad, axial_damping: 20 kN*s/m}
bit: {cutting: {zeta: 0}, friction: {static: 0, dynamic: 0}}
initial: {x: 0 mm}
simulation: {transient: 400 s, observe: 50 s, rtol: 1e-9}
classify: {bit_bounce: {lift_off_fraction: 0}}
record: {peaks: 0}
"""


def lift_off() -> Iterator[Row]:
    """Linear steady contact over the lobes ends where the bit force first touches zero."""
    for depth, speed in ((2000.0, 3.0), (5000.0, 3.0), (5000.0, 12.0)):
        head = f"operation: {{depth: {depth} m, rotary_speed: {speed} rad/s}}\n" + LIFTING
        expected = nsdrill.check(study(head)).figures["lift_off_wob"].value
        assert expected is not None
        # Each step down halves the distance to the expected weight, so that its
        # transient keeps the bit on the rock: the bouncing motion that exists at the
        # same weights is not to be met. The last weights lie below.
        steps = [2.0**-k for k in range(-2, 18)]
        weights = sorted([expected * (1 + s) for s in steps] + [expected * (1 - s) for s in steps[-3:]])
        axis = ", ".join(f"{weight!r} N" for weight in weights)
        found = run_in_memory(study(f"{head}sweep: {{wob: [{axis}], procedure: down}}\n"))
        weights = found.coords["wob"]
        last = int(np.flatnonzero(found["lift_off_fraction"].ravel() > 0.0)[-1])
        low, high = float(weights[last]), float(weights[last + 1])
        yield Row(
            "3 lift-off",
            f"WOB at which contact is lost, {depth:g} m, {speed:g} rad/s [N]",
            expected,
            0.5 * (low + high),
            1e-5,
        )


WHIRLING = """
drillstring: {lateral_softening: none}
bit: {surface_amplitude: 0 mm, cutting: {zeta: 0}, friction: {static: 0, dynamic: 0}}
operation: {depth: 2000 m}
initial: {x: 10 mm}
simulation: {transient: 4000 s, observe: 100 s, rtol: 1e-10}
record: {peaks: 0}
sweep: {rotary_speed: [3 rad/s, 4.5 rad/s, 6 rad/s]}
"""


def whirl() -> Iterator[Row]:
    """Synchronous forward whirl inside the hole, held by the quadratic drag of the mud."""
    for mass in ("total", "steel"):
        s = study(WHIRLING, f"drillstring.eccentric_mass={mass}")
        k = nsdrill.check(s).coefficients
        found = run_in_memory(s)
        for i, speed in enumerate(found.coords["rotary_speed"]):
            # (k_r - m_l W²)² r² + (c_h W² r²)² = (m_e e0 W²)²: a quadratic in r²
            a = (k.c_h * speed**2) ** 2
            b = (k.k_bend - k.m_l * speed**2) ** 2
            c = (k.m_e * s.parameters.drillstring.eccentricity * speed**2) ** 2
            radius = math.sqrt(2 * c / (b + math.sqrt(b * b + 4 * a * c)))
            yield Row(
                "4 whirl",
                f"radius at {speed:g} rad/s, eccentric mass {mass} [mm]",
                1e3 * radius,
                1e3 * float(found["radius_mean"][0, 0, 0, i]),
                1e-6,
            )


def balance() -> Iterator[Row]:
    """Work done on the string equals the change of its energy, through bounces,
    stick-slip and wall contact."""
    cases = (
        ("bit-bounce, 5000 m, 22.24 kN, 3 rad/s", "", 5000.0, 22240.0, 3.0),
        ("stick-slip with impacts, 66.72 kN, 2.5 rad/s", "", 5000.0, 66720.0, 2.5),
        ("backward rolling, 22.24 kN, 8 rad/s", "initial: {x: 76 mm}", 5000.0, 22240.0, 8.0),
        (
            "the same, Hertz wall, static softening",
            "initial: {x: 76 mm}\nwell: {law: hertz, stiffness: 200 MN/m^1.5}\n"
            "drillstring: {lateral_softening: static}",
            5000.0,
            22240.0,
            8.0,
        ),
    )
    for name, text, depth, wob, speed in cases:
        s = study(text + "\nsimulation: {rtol: 1e-10}")
        operation = Operation(depth, wob, speed)
        trace = simulate(s, depth=depth, wob=wob, rotary_speed=speed, duration=40.0, sample=1e-4).trace
        stored = energy(s.parameters, operation, trace.variables)
        flows = powers(s.parameters, operation, trace.variables)
        work = sum(_integral(power, 1e-4) for power in flows.values())
        turnover = sum(_integral(np.abs(power), 1e-4) for power in flows.values())
        rest = (stored[-1] - stored[0] - work) / turnover
        yield Row("5 energy", f"(ΔE − work) / turnover, {name}", 0.0, rest, 1e-6, True)

    # Nothing dissipates and next to nothing is fed in: the energy stays.
    s = study("""
drillstring: {axial_damping: 0 N*s/m, torsional_damping: 0 N*m*s/rad, lateral_softening: none}
mud: {density: 0 kg/m^3}
well: {friction: {static: 0, dynamic: 0}}
bit: {surface_amplitude: 0 mm, cutting: {zeta: 0}, friction: {static: 0, dynamic: 0}}
initial: {x: 70 mm, vx: 0.5 m/s, vy: 0.3 m/s, z: 5 mm, twist: 2 rad}
simulation: {rtol: 1e-12}
""")
    operation = Operation(2000.0, 0.0, 0.5)
    trace = simulate(s, depth=2000.0, wob=0.0, rotary_speed=0.5, duration=100.0, sample=1e-3).trace
    rock = 0.5 * s.parameters.bit.rock_stiffness * np.minimum(trace["z"], 0.0) ** 2
    stored = energy(s.parameters, operation, trace.variables) + rock
    drive = powers(s.parameters, operation, trace.variables)["drive"]
    fed = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(trace.time) * (drive[1:] + drive[:-1]))])
    drift = np.abs(stored - fed - stored[0]).max() / stored[0]
    assert (trace["wall_force"] > 0).any()
    assert (trace["bit_force"] > 0).any()
    yield Row("5 energy", "drift in 100 s without dissipation, impacts on wall and rock", 0.0, drift, 1e-7, True)


def _integral(values: np.ndarray, step: float) -> float:
    """Trapezoidal rule."""
    return float(step * (values.sum() - 0.5 * (values[0] + values[-1])))


def order() -> Iterator[Row]:
    """The global error falls in proportion to the tolerance, steps grow with its fifth
    root; across contact too."""
    # In the smooth case the error of fifth order is so small that the sixth shows: the
    # slope lies between 1 and 6/5.
    smooth = "bit: {friction: {smoothing: 5 s/rad}}\ninitial: {x: 10 mm}\n"
    cases = (
        ("contact kept, inside the hole, 10 s", smooth, 1000.0, 60000.0, 3.0, 10.0, (-7, -12)),
        (
            "bit-bounce and wall impacts, 3 s",
            "initial: {x: 70 mm, vx: 0.5 m/s}\n",
            5000.0,
            22240.0,
            6.0,
            3.0,
            (-5, -10),
        ),
    )
    for name, text, depth, wob, speed, duration, (first, last) in cases:

        def run(rtol: float) -> nsdrill.app.simulating.trajectory.Trajectory:
            s = study(text + f"simulation: {{rtol: {rtol!r}}}")  # noqa: B023
            return simulate(s, depth=depth, wob=wob, rotary_speed=speed, duration=duration)  # noqa: B023

        exact = run(1e-13).trace
        smoothly = np.all(exact["bit_force"] > 0) and np.all(exact["wall_force"] == 0)
        assert smoothly == (text == smooth), "one case is to keep all its contacts, the other to change them"
        best = exact.attrs["final_state"][:8]
        size = np.maximum(np.abs(best), 1e-3)
        powers_of_ten = range(first, last - 1, -1)
        errors, steps = [], []
        for power in powers_of_ten:
            trace = run(10.0**power).trace
            errors.append(np.max(np.abs(trace.attrs["final_state"][:8] - best) / size))
            steps.append(trace.attrs["steps"] + trace.attrs["rejected"])
        slope = np.polyfit(list(powers_of_ten), np.log10(errors), 1)[0]
        yield Row("6 order", f"slope of log error over log tolerance, {name}", 1.0, float(slope), 0.25)
        growth = (steps[-1] / steps[0]) ** (1 / (first - last))
        yield Row("6 order", f"growth of the steps per decade of tolerance, {name}", 10**0.2, growth, 0.15)


def severity() -> Iterator[Row]:
    """The bands of the stick-slip index."""
    from nsdrill.models.registry import described, model_named
    from nsdrill.models.responses import Thresholds
    from nsdrill.variables import MODEL

    index = np.array([0.0, 40.0, 40.1, 60.0, 60.1, 80.0, 80.1, 100.0, 100.1, 300.0])
    features = {v.name: np.zeros(len(index)) for v in described(MODEL).variables if v.origin == "feature"} | {
        "stick_slip_index": index,
        "bit_speed_mean": np.full(len(index), 3.0),
    }
    ones, dimension = np.ones(len(index), dtype=int), np.full(len(index), 9)
    labels = model_named(MODEL).classify(features, ones, Thresholds(), np.ones(8), dimension)
    for value, band, found in zip(index, (0, 0, 1, 1, 2, 2, 3, 3, 4, 4), labels["stick_slip_severity"], strict=True):
        yield Row("7 severity", f"band of an index of {value:g} %", band, int(found), 0.0, True)


CASES: dict[str, Callable[[], Iterator[Row]]] = {
    "string": string,
    "stick-slip": stick_slip,
    "lift-off": lift_off,
    "whirl": whirl,
    "energy": balance,
    "order": order,
    "severity": severity,
}


def main(arguments: list[str]) -> int:
    markdown = "--markdown" in arguments
    chosen = [name for name in arguments if not name.startswith("--")] or list(CASES)
    if unknown := set(chosen) - set(CASES):
        print(f"no such case: {', '.join(sorted(unknown))}; there are {', '.join(CASES)}", file=sys.stderr)
        return 2
    bad = 0
    if markdown:
        print("| case | quantity | expected | measured | allowed |\n| --- | --- | --- | --- | --- |")
    for name in chosen:
        for row in CASES[name]():
            bad += not row.good
            cells = (
                row.case,
                row.quantity,
                f"{row.expected:.10g}",
                f"{row.measured:.10g}",
                f"{row.error:.1e}",
                f"{row.allowed:g}",
            )
            if markdown:
                print("| " + " | ".join((*cells[:4], cells[5])) + " |")
            else:
                print(
                    f"{cells[0]:12s} {cells[1]:75s} {cells[2]:>16s} {cells[3]:>16s} {cells[4]:>8s} "
                    f"{'ok' if row.good else 'EXCEEDS ' + cells[5]}"
                )
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
