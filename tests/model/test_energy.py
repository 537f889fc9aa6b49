"""Energy: what the agents feed in is what the string holds. One wrong sign anywhere
breaks this.

The balance is tested twice: at single states, where d(energy)/dt along the compiled
derivative is the sum of the powers to rounding, and along whole trajectories, in and
out of every contact.
"""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from energies import energy, powers
from main_model import STATES
from reference import Case
from scipy.integrate import simpson
from sweep.runs import run_from, work_for

from model.buffers import slopes
from model.cases import operation_of, parameters_of, random_case, random_state, table_of
from nsdrill.app.trajectory import simulate
from nsdrill.kernel.settings import Simulation
from nsdrill.study import parse_study

OPTIONS = list(itertools.product(["linear", "hertz"], ["live", "static", "none"], ["total", "steel"]))


def as_state(states: np.ndarray, drive_angle: np.ndarray) -> dict[str, np.ndarray]:
    return {**{name: states[..., i] for i, name in enumerate(STATES)}, "drive_angle": drive_angle}


@pytest.mark.parametrize(("law", "softening", "mass"), OPTIONS)
def test_energy_changes_by_the_powers_at_any_state(law, softening, mass):
    """dE/dt by Richardson-extrapolated central differences along the compiled slope,
    against the sum of powers.

    Steps so that every coordinate moves by less than 1e-5 of its size: truncation h^4,
    rounding eps E / h.
    """
    rng = np.random.default_rng(31)
    for _ in range(16):
        c = random_case(rng, wall_law=law, softening=softening, eccentric_mass=mass, lobes=3, wall_stiffness=5e6)
        s, t = random_state(rng, c), rng.uniform(0, 5)
        f = slopes(1, law == "hertz", table_of(c), np.array([t]), s[None])[0]
        par, op = parameters_of(c), operation_of(c)

        def change(h, c=c, s=s, t=t, f=f, par=par, op=op):
            ends = np.array([s - h * f, s + h * f])
            e = energy(par, op, as_state(ends, c.speed * (t + np.array([-h, h]))))
            return float(e[1] - e[0]) / (2 * h)

        h = 1e-5
        rate = (4 * change(h / 2) - change(h)) / 3
        fed = powers(par, op, as_state(s[None], np.array([c.speed * t])))
        total = sum(float(p[0]) for p in fed.values())
        size = sum(abs(float(p[0])) for p in fed.values()) + float(
            abs(energy(par, op, as_state(s[None], np.array([c.speed * t])))[0])
        )
        # The wall's energy has a jump in its second (linear) derivative at the gap:
        # states nearer than the step skip.
        if abs(np.hypot(s[0], s[2]) - c.gap) < 2 * h * np.hypot(s[1], s[3]):
            continue
        assert rate == pytest.approx(total, abs=1e-8 * size)


def balance(trajectory: object, study: object) -> tuple[float, float]:
    """The defect of the energy balance at the worst moment, and the work that went
    through."""
    trace = trajectory.trace
    op = study.operation
    state = {name: trace[name] for name in (*STATES, "drive_angle")}
    e = energy(study.parameters, op, state)
    fed = powers(study.parameters, op, state)
    total = sum(fed.values())
    t = trace.time
    # Simpson over pairs of samples, at every second sample
    work = np.concatenate([[0.0], np.cumsum((t[2::2] - t[:-2:2]) / 6 * (total[:-2:2] + 4 * total[1::2] + total[2::2]))])
    through = simpson(sum(np.abs(p) for p in fed.values()), x=t)
    return float(np.max(np.abs(e[::2] - e[0] - work))), float(through)


STUDY = """
operation: {{depth: {depth} m, wob: {wob} kN, rotary_speed: {speed} rad/s}}
drillstring: {{lateral_softening: {softening}, eccentric_mass: {mass}}}
well: {{law: {law}, stiffness: {stiffness}}}
sweep: {{depth: [{depth} m]}}
simulation: {{rtol: 1e-10, transient: 1 s, observe: 20 s}}
"""


def chaotic(law: str, softening: str, mass: str):
    """66.72 kN at 2 rad/s and 5000 m: stick-slip, bit-bounce and wall impacts (theory
    page)."""
    stiffness = "25 MN/m" if law == "linear" else "25e6 N/m^1.5"
    return parse_study(
        STUDY.format(depth=5000, wob=66.72, speed=2, softening=softening, mass=mass, law=law, stiffness=stiffness)
    )


@pytest.mark.parametrize(("law", "softening", "mass"), OPTIONS)
def test_energy_balances_along_trajectories_through_all_contacts(law, softening, mass):
    """To 1e-7 of the work that goes through, in 20 s of chaos at rtol 1e-10.

    The powers are continuous with kinks at the contacts; each costs Simpson's rule h^2
    times the jump of slope: some 1e-8 of the work at h = 1/8 ms (found to fall with h^2
    down to 3e-9 at 1/20 ms, whatever the tolerance below 1e-9).
    """
    study = chaotic(law, softening, mass)
    trajectory = simulate(study, duration=20.0, sample=1.25e-4)
    trace = trajectory.trace
    defect, through = balance(trajectory, study)
    assert defect < 1e-7 * through
    assert np.any(trace["bit_force"] == 0), "the bit is to leave the rock"
    assert np.any(trace["wall_force"] > 0), "the collar is to touch the wall"


def test_energy_defect_falls_with_the_tolerance():
    """What the integrator loses is of the order of rtol, and of nothing else."""
    base = chaotic("linear", "live", "total")
    defects = []
    for rtol in (1e-4, 1e-6, 1e-8):
        study = replace(base, simulation=replace(base.simulation, rtol=rtol))
        defect, through = balance(simulate(study, duration=20.0, sample=5e-5), study)
        defects.append(defect / through)
    assert defects[0] < 1e-3
    assert defects[1] < 0.1 * defects[0]
    assert defects[2] < 0.1 * defects[1]


CONSERVATIVE = Case(
    mud_drag=0.0,
    wall_static=0.0,
    wall_dynamic=0.0,
    bit_static=0.0,
    bit_dynamic=0.0,
    zeta=0.0,
    axial_damping=0.0,
    torsional_damping=0.0,
    amplitude=0.0,
    softening="none",
    speed=1e-9,
    eccentricity=0.0127,
)


@pytest.mark.parametrize("law", ["linear", "hertz"])
def test_nothing_is_lost_without_drag_friction_and_drive(law):
    """A flat rock, no friction, the drive at rest: energy is conserved to the
    integrator's tolerance.

    The bit hits the rock and the collar the wall many times; rock and wall give back
    what they took.
    """
    c = CONSERVATIVE.but(wall_law=law, wall_stiffness=25e6 if law == "linear" else 1e9)
    start = np.array([[0.05, 0.5, 0.0, 0.5, 1e-3, 0.0, 0.5, 4.0, 0.3]])
    par, op = parameters_of(c), operation_of(c)

    def total(states):
        held = energy(par, op, as_state(states[:, :8], states[:, 8]))
        return float(held[0] + 0.5 * c.rock_stiffness * max(-states[0, 4], 0.0) ** 2)

    frame_rate = []
    for rtol in (1e-7, 1e-9, 1e-11):
        out = run_from(work_for(c, Simulation(transient=10.0, observe=90.0, rtol=rtol)), start)
        frame_rate.append(abs(total(out["final_state"]) / total(start) - 1))
        assert 0 < out["lift_off_fraction"][0] < 1
        assert 0 < out["wall_contact_fraction"][0] < 1
    assert frame_rate[0] < 1e-3
    assert frame_rate[1] < 1e-5
    assert frame_rate[2] < 1e-7
