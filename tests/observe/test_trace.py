"""The trajectory of one run, its Poincare section, and the polynomials of its steps."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from kernel.motions import BOUNCING, RUBBING, SMOOTH, start_of
from machine_code import of_numbers
from model_tables import SECTION, TRACE_VARIABLES
from reference import Case, contacts, solve
from scipy.optimize import brentq
from strings import STATES
from sweep.runs import finish, run_work, same_bits, work_for

import nsdrill
from nsdrill.app.running.run import run_in_memory
from nsdrill.app.simulating.trajectory import replay, simulate
from nsdrill.kernel.settings import Simulation
from nsdrill.models.christoforou_yigit.observed import coordinates
from nsdrill.observe.inside import above, crossings, extreme, has_extremum, lowered, quintic, value
from nsdrill.observe.thresholds import Record
from nsdrill.study import parse_study
from nsdrill.sweep.work import Work
from nsdrill.variables import OK, STEP_LIMIT

TEXT = """
operation: {depth: 2000 m, wob: 6 kN, rotary_speed: 3 rad/s}
bit: {friction: {smoothing: 20 s/rad}}
initial: {x: 30 mm, vy: 0.2 m/s, twist: -2 rad, drive_angle: 0.7 rad}
sweep: {rotary_speed: [2 rad/s, 3 rad/s, 8 rad/s], procedure: PROCEDURE, along: rotary_speed}
simulation: {transient: 2 s, observe: 3 s, rtol: 1e-10}
"""
CASE = Case(depth=2000.0, wob=6e3, speed=3.0, bit_smoothing=20.0)
STUDY = parse_study(TEXT.replace("PROCEDURE", "up"))


def test_samples_equal_scipy():
    """Every state and force, in and out of contact, every 10 ms for 3 s. The error
    depends on where steps meet the kinks of contact: from 5e-8 to 1e-6 of the scale at
    rtol 1e-10, below 1e-7 at 1e-11."""
    fine = replace(STUDY, simulation=replace(STUDY.simulation, rtol=1e-11))
    trace = simulate(fine, duration=3.0).trace
    z = -CASE.wob / (CASE.k_a + CASE.rock_stiffness)
    start = np.array([0.03, 0.0, 0.0, 0.2, z, 0.0, -2.0, 3.0])
    exact = solve(CASE, start, 3.0, phase=0.7, dense=True).sol(trace.time)
    scale = np.max(np.abs(exact), axis=1)
    for name, values, size in zip(STATES, exact, scale, strict=True):
        assert trace[name] == pytest.approx(values, abs=1e-6 * size), name
    force = contacts(CASE, trace.time, exact, phase=0.7)
    for name in ("bit_force", "bit_torque", "wall_force", "wall_friction", "radius"):
        assert trace[name] == pytest.approx(force[name], abs=1e-5 * max(np.max(np.abs(force[name])), 1.0)), name
    assert np.any(force["bit_force"] == 0)


def test_a_trace_has_all_its_variables_at_even_times():
    trajectory = simulate(STUDY, duration=1.0, sample=0.01)
    trace = trajectory.trace
    assert trajectory.status == OK
    assert set(trace.variables) == {v.name for v in TRACE_VARIABLES}
    assert trace.time == pytest.approx(np.arange(101) * 0.01, abs=1e-12)
    assert all(len(values) == 101 and np.all(np.isfinite(values)) for values in trace.variables.values())


def test_the_first_sample_is_the_initial_state():
    trace = simulate(STUDY, duration=1.0).trace
    initial = trace.attrs["initial_state"]
    assert [trace[name][0] for name in STATES] == pytest.approx(initial[:8], rel=1e-15)
    assert trace["drive_angle"][0] == initial[8] == 0.7


def test_the_last_sample_is_the_final_state():
    trace = simulate(STUDY, duration=1.0, sample=0.25).trace
    final = trace.attrs["final_state"]
    assert [trace[name][-1] for name in STATES] == pytest.approx(final[:8], rel=1e-12)
    assert trace["drive_angle"][-1] == pytest.approx(final[8], rel=1e-15)


def test_sampling_does_not_change_the_run():
    ends = [simulate(STUDY, duration=2.0, sample=sample).trace.attrs for sample in (1e-4, 0.01, 0.3, 2.0)]
    for attrs in ends[1:]:
        assert attrs["final_state"].tobytes() == ends[0]["final_state"].tobytes()
        assert attrs["steps"] == ends[0]["steps"]


def test_coarse_samples_are_among_the_fine_ones():
    fine = simulate(STUDY, duration=2.0, sample=1 / 256).trace
    coarse = simulate(STUDY, duration=2.0, sample=1 / 16).trace
    for name in STATES:
        assert np.array_equal(fine[name][::16], coarse[name]), name


@pytest.mark.parametrize("procedure", ["same", "up-down"])
def test_replay_has_the_stored_bits(procedure, tmp_path):
    """Of each point of a sweep, carried or not, from the file."""
    text = TEXT.replace("PROCEDURE", procedure)
    study = parse_study(text if procedure != "same" else text.replace(", along: rotary_speed", ""))
    path = tmp_path / "out.h5"
    nsdrill.run(study, path, workers=2).close()
    for way in ("up", "down") if procedure == "up-down" else ("same",):
        for speed in (2.0, 3.0, 8.0):
            again = replay(path, rotary_speed=speed, procedure=way, sample=0.05)
            assert again.same_bits, (way, speed)


def test_simulate_is_the_run_of_that_point():
    """With its transient and window the marks fall alike, and so do the bits."""
    study = parse_study(TEXT.replace("PROCEDURE", "same").replace(", along: rotary_speed", ""))
    results = run_in_memory(study)
    for i, speed in enumerate((2.0, 3.0, 8.0)):
        end = simulate(study, rotary_speed=speed).trace.attrs["final_state"]
        assert end.tobytes() == results["final_state"][0, 0, 0, i].tobytes()


def test_a_run_that_stops_early_gives_the_samples_it_reached():
    study = parse_study(TEXT.replace("PROCEDURE", "up").replace("rtol: 1e-10", "rtol: 1e-12, max_steps: 1000"))
    trajectory = simulate(study, rotary_speed=8.0)
    assert trajectory.status == STEP_LIMIT
    assert 0 < len(trajectory.trace.time) < 501
    assert all(len(values) == len(trajectory.trace.time) for values in trajectory.trace.variables.values())


TIGHT = Simulation(transient=3.0, observe=12.0, rtol=1e-10, max_steps=10**7)


def with_section(case: Case, returns: int = 40, section: str = "revolution", simulation: Simulation = TIGHT) -> Work:
    return replace(work_for(case, simulation), record=Record(peaks=2, poincare=returns, section=section))


def crossings_of(work: Work, start: np.ndarray) -> dict[str, np.ndarray]:
    """The section of one run from ``start``, NaN left out."""
    runs = work.prepare(np.array([0]))
    work.begin(runs.initial[0], start)
    batch = work.new_batch(8, 1)
    batch.add(np.array([0]), runs)
    columns = work.columns(finish(work, batch)[-1])
    return {name: columns[name][0][np.isfinite(columns[name][0])] for name in SECTION}


def exact(case: Case, start: np.ndarray, lobes: int) -> list[dict[str, float]]:
    """The same from SciPy's solution of the reference equations at 1e-12, with its own
    event location."""
    end = TIGHT.transient + TIGHT.observe
    solution = solve(case, start[:8], end, dense=True).sol
    spacing = 2 * np.pi / lobes

    def angle(t: float) -> float:
        return float(solution(t)[6] + case.speed * t)

    first, last = np.floor(angle(TIGHT.transient) / spacing) + 1, np.floor(angle(end) / spacing)
    grid = np.linspace(TIGHT.transient, end, 4001)
    reached = np.array([angle(t) for t in grid])
    found = []
    for level in np.arange(first, last + 1) * spacing:
        after = int(np.argmax(reached >= level))
        t = brentq(lambda t, level=level: angle(t) - level, grid[after - 1], grid[after], xtol=1e-14)
        x, vx, y, vy, z, vz, twist, speed = solution(t)
        r = np.hypot(x, y)
        found.append(
            {
                "section_radius": r,
                "section_whirl_angle": (np.arctan2(y, x) - level + np.pi) % (2 * np.pi) - np.pi,
                "section_radial_velocity": (x * vx + y * vy) / r,
                "section_whirl_speed": (x * vy - y * vx) / r**2,
                "section_axial": z,
                "section_axial_velocity": vz,
                "section_twist": twist,
                "section_bit_speed": speed,
            }
        )
    return found


@pytest.mark.parametrize(
    ("case", "section", "within"),
    [(SMOOTH, "revolution", 1e-6), (BOUNCING, "lobe", 1e-4), (RUBBING, "revolution", 1e-4)],
    ids=["smooth", "bouncing", "rubbing"],
)
def test_returns_are_those_of_the_exact_solution(case, section, within):
    """Interpolation is of sixth order: at these steps below 1e-7 of the state_scales.
    Every contact adds an error of the order of the tolerance, 1e-10, and the next ones
    make it grow: some 1e-5 after forty bounces."""
    start = start_of(case)
    mine = crossings_of(with_section(case, section=section), start)
    expected = exact(case, start, case.lobes if section == "lobe" else 1)
    assert len(mine["section_radius"]) == len(expected)
    state_scales = {
        "section_radius": 0.01,
        "section_radial_velocity": 0.1,
        "section_whirl_speed": 5.0,
        "section_axial": 1e-3,
        "section_axial_velocity": 0.02,
    }
    for name in SECTION:
        values = np.array([one[name] for one in expected])
        assert mine[name] == pytest.approx(values, rel=within, abs=within * state_scales.get(name, 1.0)), name


def test_a_bit_that_swings_back_is_counted_once_a_turn():
    """Off the rock the string unwinds from twenty radians of twist, and the bit swings
    back by whole turns."""
    case, end = Case(wob=0.0, speed=2.0, amplitude=0.0), 40.0
    start = np.array([1e-3, 0.0, 0.0, 0.0, 0.1, 0.0, 20.0, 2.0, 0.0])
    work = with_section(case, simulation=Simulation(0.0, end, rtol=1e-9))
    solution = solve(case, start[:8], end, dense=True).sol
    time = np.linspace(0.0, end, 40001)
    angle = solution(time)[6] + case.speed * time
    reached = np.maximum.accumulate(angle)
    assert np.max(reached - angle) > 4 * np.pi, "else it does not swing back by whole turns"
    expected = np.floor(reached[-1] / (2 * np.pi)) - np.floor(angle[0] / (2 * np.pi))
    assert len(crossings_of(work, start)["section_radius"]) == expected


def test_recording_returns_changes_no_other_bit_and_lanes_change_none():
    work = work_for(Case(), Simulation(5.0, 20.0), rotary_speed=np.linspace(2.0, 7.0, 13))
    recorded = replace(work, record=Record(poincare=9))
    plain, one, eight = run_work(work), run_work(recorded, lanes=1), run_work(recorded, lanes=8)
    assert same_bits(one, eight)
    assert all(plain[name].tobytes() == one[name].tobytes() for name in plain)
    assert set(one) - set(plain) == {*SECTION, "motion", "period", "zero_one"}


def test_the_whirl_angle_is_counted_from_the_bit():
    entry = np.zeros((1, 9))
    entry[0, :3], entry[0, 3], entry[0, 8] = (0.0, 0.3, 2.0), 0.4, 2 * np.pi * 7 + 0.5
    found = coordinates(entry)
    assert found["section_radius"][0] == pytest.approx(2.0)
    assert found["section_whirl_angle"][0] == pytest.approx(np.pi / 2 - 0.5)
    assert found["section_radial_velocity"][0] == pytest.approx(0.4)
    assert found["section_whirl_speed"][0] == pytest.approx(-0.15)


def time_above(g0: float, d0: float, c0: float, g1: float, d1: float, c1: float, level: float) -> float:
    p = quintic(g0, d0, c0, g1, d1, c1)
    theta = extreme(p, d1) if has_extremum(d0, d1) else 1.0
    start, end = g0 > level, g1 > level
    top = value(p, theta) > level
    first, second = crossings(lowered(p, level), theta, start, top, end)
    return above(first, second, 1.0, start, top, end)


share = of_numbers(time_above)


def exact_share(ends: tuple[float, ...], level: float) -> float:
    """The same from all roots of the polynomial."""
    g0, d0, c0, g1, d1, c1 = ends
    rise = g1 - g0
    polynomial = np.polynomial.Polynomial(
        [
            g0 - level,
            d0,
            0.5 * c0,
            10 * rise - 6 * d0 - 4 * d1 - 1.5 * c0 + 0.5 * c1,
            -15 * rise + 8 * d0 + 7 * d1 + 1.5 * c0 - c1,
            6 * rise - 3 * (d0 + d1) - 0.5 * c0 + 0.5 * c1,
        ]
    )
    roots = polynomial.roots()
    real = roots[(abs(roots.imag) < 1e-9) & (roots.real > 0) & (roots.real < 1)].real
    cuts = np.concatenate([[0.0], np.sort(real), [1.0]])
    middles = 0.5 * (cuts[:-1] + cuts[1:])
    return float(np.sum(np.diff(cuts)[polynomial(middles) > 0]))


@settings(max_examples=400)
@given(
    step=st.floats(0.01, 2.0),
    phase=st.floats(0.0, 2 * math.pi),
    overtone=st.floats(-0.05, 0.05),
    height=st.floats(-0.3, 1.3),
)
# a graze: both ends below, the top above
@example(step=1.0, phase=math.pi / 2 - 0.5, overtone=0.0, height=1.1)
@example(step=1.0, phase=0.3, overtone=0.0, height=0.5)  # no turn
@example(step=2.0, phase=1.5707, overtone=0.0, height=0.3)  # the turn is next to the beginning
# the turn is just before the step
@example(step=1.0, phase=math.pi / 2 + 1e-6, overtone=0.0, height=0.9999)
@example(step=1.0, phase=math.pi / 2 - 1 - 1e-6, overtone=0.0, height=0.9999)  # just after
def test_time_above_a_level_is_that_of_the_polynomials_roots(step, phase, overtone, height):
    angles = np.array([phase, phase + step])
    g = np.sin(angles) + overtone * np.sin(2 * angles)
    d = step * (np.cos(angles) + 2 * overtone * np.cos(2 * angles))
    c = -(step**2) * (np.sin(angles) + 4 * overtone * np.sin(2 * angles))
    ends = (g[0], d[0], c[0], g[1], d[1], c[1])
    inside = np.sin(np.linspace(angles[0], angles[1], 1001)) + overtone * np.sin(
        2 * np.linspace(angles[0], angles[1], 1001)
    )
    low, high = inside.min(), inside.max()
    level = low + height * (high - low)
    # Within a millionth of the top it is the top itself, found to 1e-4 of the step,
    # that decides.
    if min(abs(level - low), abs(level - high)) < 1e-6 * (high - low):
        return
    assert share(*ends, level) == pytest.approx(exact_share(ends, level), abs=1e-8)
