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
from reference import Case
from scipy.integrate import simpson
from strings import MAIN, STATES, pack
from sweep.runs import run_from, work_for

from main_model.buffers import slopes_with
from main_model.cases import operation_of, parameters_of, random_case, random_state
from main_model.lateral import FORMS, KEYS, cases, parameters
from nsdrill.app.simulating.trajectory import simulate
from nsdrill.kernel.settings import Simulation
from nsdrill.models.christoforou_yigit.columns import options_of
from nsdrill.models.christoforou_yigit.parameters import Drive, Parameters
from nsdrill.models.friction import LAWS
from nsdrill.models.operation import Operation
from nsdrill.models.variant import variant_of
from nsdrill.study import parse_study

OPTIONS = list(itertools.product(["linear", "hertz"], ["live", "static", "none"], ["total", "steel"]))


def drawn_options(rng, law, softening, mass):
    """Any string, with a wall so soft that its energy bends gently."""
    c = random_case(rng, wall_law=law, softening=softening, eccentric_mass=mass, lobes=3, wall_stiffness=5e6)
    return parameters_of(c), operation_of(c), random_state(rng, c), rng.uniform(0, 5)


def drawn_form(rng, form):
    ((c, o, t, s),) = cases(form, 1, int(rng.integers(10**6)))
    return parameters(replace(c, wall_stiffness=5e6), o), operation_of(c), s, t


def drawn_around(rng, given, operation):
    """About one string, with the states of a drive where it has them."""
    sizes = np.array([0.05, 0.2, 0.05, 0.2, 2e-3, 0.02, 20.0, 3.0, 4.0, 3.0, 1e3, 4e3])
    count = len(variant_of(MAIN, options_of(given)).states)
    return given, operation, rng.normal(size=count) * sizes[:count], rng.uniform(0, 5)


def law_of_bit(law):
    case = Case(bit_law=law, wob=40e3)
    return drawn_around, parameters_of(case), operation_of(case)


def drive(**keys):
    return drawn_around, replace(Parameters(), drive=Drive(**keys)), Operation()


PLACING = {"inertia": 1500.0, "stiffness": 900.0, "damping": 1500.0, "twist_gain": -300.0, "speed_gain": 70.0}
# What is drawn, and the part of the energy and powers within which they agree.
STRINGS = {
    **{" ".join(one): ((drawn_options, *one), 1e-8) for one in OPTIONS},
    **{form: ((drawn_form, form), 1e-7) for form in FORMS},
    **{f"law {law}": (law_of_bit(law), 1e-6) for law in list(LAWS)[1:]},
    "stiff drive": (drive(kind="stiff"), 1e-6),
    "impedance": (drive(kind="z_torque", shaft_damping=90.0), 1e-6),
    "placing": (drive(kind="pi", shaft_damping=40.0, **PLACING), 1e-6),
    "limited": (drive(kind="stiff", torque_limit=30e3, shaft_damping=20.0), 1e-6),
    "motor": (drive(kind="dc_motor", shaft_damping=20.0), 1e-6),
    "regulated": (drive(kind="dc_motor", shaft_damping=20.0, gains=(0.03, 42.0, 2.2, -33.0, 14.0)), 1e-6),
}


@pytest.mark.parametrize("name", STRINGS)
def test_energy_changes_by_the_powers_at_any_state(name):
    """dE/dt by Richardson-extrapolated central differences along the compiled slope,
    against the sum of powers.

    Steps so that every coordinate moves by less than 1e-5 of its size: truncation h^4,
    rounding eps E / h.
    """
    (draw, *given), within = STRINGS[name]
    rng, compared = np.random.default_rng(31), 0
    for _ in range(32):
        p, operation, state, t = draw(rng, *given)
        point = operation.depth, operation.wob, operation.rotary_speed
        options = options_of(p)
        names, table = variant_of(MAIN, options).states, pack(p, *point)
        slope = slopes_with(options, table, np.array([t]), state[None])[0]

        def named(states, times, names=names, speed=operation.rotary_speed):
            return {**dict(zip(names, states.T, strict=True)), "drive_angle": speed * times}

        def change(h, p=p, operation=operation, state=state, slope=slope, t=t, named=named):
            steps = np.array([-h, h])
            ends = energy(p, operation, named(state + np.outer(steps, slope), t + steps))
            return float(ends[1] - ends[0]) / (2 * h)

        h, r = 1e-5, np.hypot(state[0], state[2])
        gap = (p.well.diameter - p.drillstring.collar.outer_diameter) / 2
        edges = np.array([gap, p.stabilizer.clearance or 0.0])
        if np.min(np.abs(r - edges)) < 2 * h * np.hypot(state[1], state[3]):
            continue  # the energy has a jump in its second derivative there
        here = named(state[None], np.array([t]))
        fed = [float(power[0]) for power in powers(p, operation, here).values()]
        size = sum(map(abs, fed)) + abs(float(energy(p, operation, here)[0]))
        assert (4 * change(h / 2) - change(h)) / 3 == pytest.approx(sum(fed), abs=within * size)
        compared += 1
    assert compared >= 20


def balance(trajectory: object, study: object) -> tuple[float, float]:
    """The defect of the energy balance at the worst moment, and the work that went
    through."""
    trace = trajectory.trace
    op = study.operation
    state = dict(trace.variables)
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


WALL = "initial: {x: 70 mm, vy: -0.6 m/s}\nsimulation: {rtol: 1.0e-9}\n"
FROZEN = "operation: {wob: 66.72 kN, rotary_speed: 2 rad/s}\nsimulation: {rtol: 1.0e-9}\n"
# The text, seconds, the time between samples, the part of the work.
RUNS = {
    **{form: (f"{KEYS[form]}\n{WALL}", 5.0, 1.25e-4, 1e-6) for form in KEYS},
    "torsion": (f"{FROZEN}modes: {{axial: frozen, lateral: frozen}}", 10.0, 5e-4, 2e-4),
    "no axial motion": (f"{FROZEN}modes: {{axial: frozen}}", 10.0, 5e-4, 2e-4),
    "no lateral motion": (f"{FROZEN}modes: {{lateral: frozen}}", 10.0, 5e-4, 2e-4),
}


@pytest.mark.parametrize("name", RUNS)
def test_energy_balances_with_further_forces_and_frozen_motions(name):
    text, seconds, sample, within = RUNS[name]
    study = parse_study(text)
    trajectory = simulate(study, duration=seconds, sample=sample)
    defect, through = balance(trajectory, study)
    assert defect < within * through
    assert name not in KEYS or np.any(trajectory.trace["wall_force"] > 0.0)


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
        held = energy(par, op, dict(zip((*STATES, "drive_angle"), states.T, strict=True)))
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
