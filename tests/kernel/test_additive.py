"""The additive pair: order conditions, the solve of the slips, bits over lanes; with friction
of stabilisers, along the hole, of an elastic collar and of cutting."""

from dataclasses import replace

import numpy as np
import pytest
from reference import disc_torque
from scipy.integrate import solve_ivp
from sweep.runs import run_from

from nsdrill.app.experiment import prepare
from nsdrill.app.running.run import work_of
from nsdrill.equations.plain import on_arrays
from nsdrill.equations.stage import first_slip, kept, solved
from nsdrill.equations.trace import Named
from nsdrill.kernel.pairs import KENNEDY_CARPENTER
from nsdrill.kernel.settings import Simulation
from nsdrill.models.christoforou_yigit.coefficients import bit_numbers, derive
from nsdrill.models.christoforou_yigit.parameters import Initial, Parameters
from nsdrill.models.friction import Numbers, hyperbolic, values
from nsdrill.models.registry import described
from nsdrill.models.responses import Thresholds
from nsdrill.models.torsion import Initial as TorsionStart
from nsdrill.models.torsion import Parameters as TorsionParameters
from nsdrill.models.torsion import rotating
from nsdrill.models.variant import variant_at
from nsdrill.observe.thresholds import Record
from nsdrill.study import parse_study
from nsdrill.sweep.plan import Plan
from nsdrill.sweep.work import Work
from nsdrill.variables import MODEL

FROZEN = ("axial", "lateral")


def matrices() -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    pair, n = KENNEDY_CARPENTER, len(KENNEDY_CARPENTER.matrix)
    explicit, implicit = np.zeros((n, n)), np.zeros((n, n))
    for i, (one, two) in enumerate(zip(pair.matrix[:-1], pair.implicit, strict=True), start=1):
        explicit[i, : len(one)], implicit[i, : len(two)] = one, two
    b = np.array(pair.matrix[-1])
    return explicit, implicit, b, b - np.array(pair.error)


def test_every_order_condition_to_four_holds_for_all_mixtures():
    """The coupling conditions of Kennedy & Carpenter 2003: each matrix of a tree may be
    that of either part."""
    explicit, implicit, b, embedded = matrices()
    c, one = np.array(KENNEDY_CARPENTER.nodes[:-1]), np.ones(7)
    parts = (explicit, implicit)
    for matrix in parts:
        assert matrix.sum(axis=1) == pytest.approx(c, abs=1e-14)
    conditions = [(one, 1), (c, 1 / 2), (c * c, 1 / 3), *((p @ c, 1 / 6) for p in parts)]
    conditions4 = [
        (c**3, 1 / 4),
        *((c * (p @ c), 1 / 8) for p in parts),
        *((p @ c**2, 1 / 12) for p in parts),
        *((p @ q @ c, 1 / 24) for p in parts for q in parts),
    ]
    for vector, value in conditions:
        assert b @ vector == pytest.approx(value, abs=1e-14)
        assert embedded @ vector == pytest.approx(value, abs=1e-14)
    for vector, value in conditions4:
        assert b @ vector == pytest.approx(value, abs=1e-14)
    assert any(abs(embedded @ vector - value) > 1e-4 for vector, value in conditions4), "else there is no estimate"
    assert implicit[6] == pytest.approx(b, abs=0.0), "stiffly accurate"


@pytest.mark.parametrize("near", [None, 1e-1, 1e-2, 1e-4])
def test_two_iterations_solve_the_slip_near_break_away(near):
    """Against bisection: the load that comes back is within 1e-5 of that of the exact
    slip, whatever the steepness."""
    rng = np.random.default_rng(7)
    worst = 0.0
    for _ in range(2000):
        eps, tau = 10 ** rng.uniform(2, 6), rng.uniform(0, 5)
        dynamic, rise, c = rng.uniform(0.2, 1), rng.uniform(0, 0.8), 10 ** rng.uniform(-5, -1.3)
        most = c * (rise + dynamic)
        free = most * (10 ** rng.uniform(-2, 2) if near is None else 1 + near * rng.uniform(-1, 1))
        free *= rng.choice([-1.0, 1.0])

        def law(v, eps=eps, tau=tau, rise=rise, dynamic=dynamic):
            return 2 / np.pi * np.arctan(eps * v) * (rise / (1 + tau * abs(v)) + dynamic)

        low, high = 0.0, abs(free)
        for _ in range(120):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if middle + c * law(middle) < abs(free) else (low, middle)
        numbers = Numbers(eps, tau, rise, dynamic)

        def with_slope(v, numbers=numbers):
            return [float(values(hyperbolic, name, v, numbers)) for name in ("coefficient", "slope")]

        named = Named(smoothing=eps, decay=tau, rise=rise, dynamic=dynamic)
        v = first_slip(free, c, named)
        f, df = with_slope(v)
        v = kept(v, v + (free - v - c * f) / (1 + c * df))
        f, df = with_slope(v)
        f += df * (free - v - c * f) / (1 + c * df)
        worst = max(worst, abs(f - np.sign(free) * law(low)) / (rise + dynamic))
    assert worst < 1e-5


@pytest.mark.parametrize("smoothing", [500.0, 1e4, 1e6])
def test_newtons_method_converges_from_a_guess_far_too_large(smoothing):
    """Beyond the bend of a steep law the tangents of both sides lead to one another for
    ever; from rest they do not."""
    numbers, free, c = Numbers(smoothing, 2.0, 0.3, 0.5), 0.1, 1.0

    def residual(following):
        slip = free
        for _ in range(12):
            load, slope = (float(values(hyperbolic, name, slip, numbers)) for name in ("coefficient", "slope"))
            slip = following(slip, slip + (free - slip - c * load) / (1 + c * slope))
        return abs(free - slip - c * float(values(hyperbolic, "coefficient", slip, numbers)))

    assert residual(kept) < 1e-12
    assert residual(lambda _, following: following) > 1.0


def torsion_work(smoothing: float, method: str, duration: float, rtol: float, pair: str = "tsitouras") -> Work:
    parameters = TorsionParameters()
    friction = replace(parameters.bit.friction, smoothing=smoothing)
    parameters = replace(parameters, bit=replace(parameters.bit, friction=friction))
    axes = {"depth": np.array([5000.0]), "wob": np.array([60e3]), "rotary_speed": np.array([2.0])}
    simulation = Simulation(0.0, duration, rtol=rtol, method=method, pair=pair)
    start = TorsionStart(twist=-3.0, bit_speed=1.0)
    model = described("torsion")
    return Work(Plan(axes, "same", None), parameters, start, simulation, Thresholds(), Record(peaks=0), model)


@pytest.mark.parametrize("count", [1, 2, 3, 4])
def test_small_linear_systems_are_solved(count):
    rng = np.random.default_rng(count)
    matrix, right = np.eye(count) + rng.uniform(0.0, 2.0, (count, count)), rng.normal(size=count)

    def solution(n):
        rows = [[getattr(n, f"a{i}{j}") for j in range(count)] for i in range(count)]
        return {str(k): x for k, x in enumerate(solved(rows, [getattr(n, f"r{i}") for i in range(count)]))}

    given = {f"a{i}{j}": matrix[i, j] for i in range(count) for j in range(count)}
    given |= {f"r{i}": value for i, value in enumerate(right)}
    assert list(on_arrays(solution, given).values()) == pytest.approx(np.linalg.solve(matrix, right), rel=1e-12)


@pytest.mark.parametrize("smoothing", [50.0, 5e3])
def test_end_states_equal_radau(smoothing):
    """A stick-slip cycle of the string that only twists, against Radau at 1e-11: within
    some hundred tolerances."""
    parameters = torsion_work(smoothing, "implicit", 1.0, 1e-6).parameters
    inertia, stiffness = rotating(parameters.drillstring, 5000.0)

    def slopes(_, y):
        return [
            y[1] - 2.0,
            (
                -parameters.drillstring.torsional_damping * y[1]
                - stiffness * y[0]
                - disc_torque(parameters.bit, 60e3, y[1])
            )
            / inertia,
        ]

    exact = solve_ivp(slopes, (0.0, 12.0), [-3.0, 1.0], "Radau", rtol=1e-11, atol=1e-12).y[:, -1]
    for rtol in (1e-6, 1e-8):
        found = run_from(torsion_work(smoothing, "implicit", 12.0, rtol))["final_state"][0, :2]
        assert np.max(np.abs(found - exact) / (np.array([0.1, 0.2]) + np.abs(exact))) < 300 * rtol


def smooth_work(friction: float, method: str, rtol: float) -> Work:
    """The bit stays on the rock and the collar off the wall: every derivative is
    smooth."""
    work = main_work(5.0, method, rtol, frozen=False, depth=[2000.0], wob=[60e3], rotary_speed=[3.0])
    parameters = work.parameters
    law = replace(parameters.bit.friction, static=friction, dynamic=friction / 2)
    bit = replace(parameters.bit, friction=law, surface_amplitude=3e-4)
    bit = replace(bit, cutting=replace(bit.cutting, zeta=0.0))
    parameters = replace(parameters, bit=bit, drillstring=replace(parameters.drillstring, eccentricity=5e-3))
    return replace(
        work,
        parameters=parameters,
        initial=Initial(x=1e-3),
        simulation=replace(work.simulation, transient=0.0, observe=10.0),
    )


@pytest.mark.parametrize(("friction", "least"), [(0.0, 3.75), (0.02, 3.0)])
def test_error_falls_as_the_fourth_power_of_the_step_where_nothing_is_stiff(friction, least):
    """Order four without friction. With it the end that is solved once more has an
    error of third order, which is a small part of it."""
    exact = run_from(smooth_work(friction, "explicit", 1e-12))["final_state"][0, :8]
    work = smooth_work(friction, "implicit", 1e-6)
    size = work.program.variant.state_scales(work.prepare(np.arange(1)).parameters)[0]
    errors, steps = [], []
    for rtol in (1e-5, 1e-6, 1e-7, 1e-8, 1e-9):
        out = run_from(smooth_work(friction, "implicit", rtol))
        errors.append(np.max(np.abs(out["final_state"][0, :8] - exact) / (size + np.abs(exact))))
        steps.append(out["steps"][0])
    order = -np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert least < order < 4.75


def main_work(smoothing: float, method: str, rtol: float = 1e-6, frozen: bool = True, **axes: list[float]) -> Work:
    parameters = Parameters()
    bit = replace(parameters.bit, friction=replace(parameters.bit.friction, smoothing=smoothing))
    well = replace(parameters.well, friction=replace(parameters.well.friction, smoothing=smoothing))
    parameters = replace(parameters, bit=bit, well=well)
    if frozen:
        modes = replace(parameters.modes, axial="frozen", lateral="frozen")
        parameters = replace(parameters, modes=modes, bit=replace(bit, surface_amplitude=0.0))
    values = {"depth": [5000.0], "wob": [66.72e3], "rotary_speed": [1.0], **axes}
    simulation = Simulation(20.0, 25.0, rtol=rtol, method=method)
    plan = Plan({name: np.array(value) for name, value in values.items()}, "same", None)
    return Work(plan, parameters, Initial(twist=-8.0), simulation, Thresholds(), Record(peaks=4), described(MODEL))


def test_peaks_of_stick_slip_are_those_of_the_friction_law_as_it_steepens():
    """While the bit breaks loose or comes to rest it passes every speed, so the
    greatest torque is the greatest of the law; at the limit of Coulomb's friction that
    at rest. The steps hardly grow in number, and nothing turns back."""
    speed = np.geomspace(1e-9, 10, 200_001)
    steps = {}
    for smoothing in (1e3, 1e4, 1e6):
        work = main_work(smoothing, "implicit")
        law = bit_numbers(work.parameters, derive(work.parameters, 5000.0, 66.72e3, 1.0))
        arm = 2 / np.pi * np.arctan(smoothing * speed)
        arm = arm * (law.rise / (1 + law.decay * speed) + law.dynamic)
        found = run_from(work)
        assert found["bit_torque_max"][0] == pytest.approx(66.72e3 * arm.max(), rel=1e-6)
        assert found["bit_speed_min"][0] > -1e-6
        steps[smoothing] = int(found["steps"][0])
    assert found["bit_torque_max"][0] == pytest.approx(66.72e3 * (law.rise + law.dynamic), rel=3e-3)
    assert steps[1e6] < 1.5 * steps[1e3]


@pytest.mark.parametrize("smoothing", [1e3, 1e5])
def test_the_least_speed_of_a_bit_that_sticks_is_that_at_which_it_creeps(smoothing):
    """Nothing undershoots: where the string pulls least, while the bit is held, its
    speed is that at which friction is as great as the pull, by bisection of the law.
    Radau gives the pull."""
    work = main_work(smoothing, "implicit")
    k = derive(work.parameters, 5000.0, 66.72e3, 1.0)
    law, damping = bit_numbers(work.parameters, k), work.parameters.drillstring.torsional_damping

    def torque(speed):
        arm = 2 / np.pi * np.arctan(smoothing * speed)
        return 66.72e3 * arm * (law.rise / (1 + law.decay * abs(speed)) + law.dynamic)

    def slopes(_, y):
        return [y[1] - 1.0, -(damping * y[1] + k.k_t * y[0] + torque(y[1])) / k.J]

    found = solve_ivp(slopes, (0.0, 45.0), [-8.0, 1.0], "Radau", rtol=1e-9, atol=1e-12)
    there = (found.t > 20.0) & (found.y[1] < 0.01)
    pull = np.min(-k.k_t * found.y[0][there])
    low, high = 0.0, 0.01
    for _ in range(80):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if torque(middle) + damping * middle < pull else (low, middle)
    assert run_from(work)["bit_speed_min"][0] == pytest.approx(low, rel=2e-2)


def test_features_equal_those_of_the_explicit_pair():
    """Torsion alone, which has one limit cycle: extremes and fractions of two methods
    within some tolerances."""
    one, two = (run_from(main_work(2e3, method, 1e-8)) for method in ("explicit", "implicit"))
    for name, scale in (
        ("bit_speed_max", 1.0),
        ("bit_torque_max", 6e3),
        ("surface_torque_max", 6e3),
        ("surface_torque_min", 6e3),
        ("stuck_fraction", 1.0),
    ):
        assert abs(one[name][0] - two[name][0]) / scale < 1e-5


def test_bits_do_not_depend_on_lanes_or_neighbours():
    """Of lanes that roll on the wall beside lanes that do not, that stick or bounce; of
    more runs than lanes."""
    speeds = [1.0, *np.linspace(3.0, 8.0, 11)]
    work = main_work(1e4, "implicit", frozen=False, wob=[10e3, 22.24e3, 60e3], rotary_speed=speeds)
    work = replace(work, simulation=replace(work.simulation, transient=6.0, observe=4.0))
    found = {lanes: run_from(work, lanes=lanes) for lanes in (1, 8, 32)}
    assert np.any(found[1]["wall_contact_fraction"] > 0.1)
    assert np.any(found[1]["wall_contact_fraction"] == 0.0)
    assert np.any(found[1]["stuck_fraction"] > 0.1)
    assert np.any(found[1]["lift_off_fraction"] > 0.1)
    for name, numbers in found[1].items():
        for lanes in (8, 32):
            assert numbers.tobytes() == found[lanes][name].tobytes(), (name, lanes)


ROLLING = "operation: {depth: 2000 m, wob: 22.24 kN, rotary_speed: 8 rad/s}\ninitial: {x: 90 mm, vy: -3 m/s}\n"
STEEP = "bit: {friction: {smoothing: 1000 s/rad}}\n"
CASES = {
    "stabilisers": f"{ROLLING}{STEEP}well: {{friction: {{smoothing: 1000 s/m}}}}\n"
    "stabilizer: {clearance: 30 mm, friction: {smoothing: 1000 s/m}}\n",
    "along the hole": f"{ROLLING}{STEEP}well: {{friction: {{smoothing: 1000 s/m}}, axial_friction: true}}\n",
    "elastic collar": f"model: beam\n{ROLLING}{STEEP}well: {{friction: {{smoothing: 1000 s/m}}}}\n"
    "beam: {modes: 2, stations: [{at: 0.3}, {at: 0.5}, {at: 0.7}]}\n",
    "live cutting": "model: segments\nbit: {cutting: {smoothing: 1000 s/rad, c2: 0.001}}\n"
    "segments: {pipe: 2, collar: 2}\n",
}
ONE_LANE = ("along the hole", "elastic collar")  # run in one lane, too
SECONDS = {"live cutting": 1.0}
# Impacts on the lobes scatter the errors of segments by a factor of five, with an
# explicit method as well.
FINE = {"live cutting": 1e-9}


def work_for(text: str, method: str, rtol: float, seconds: float) -> Work:
    study = parse_study(text)
    simulation = replace(study.simulation, transient=0.0, observe=seconds, rtol=rtol, method=method)
    return replace(work_of(prepare(study)), simulation=simulation, record=Record(peaks=0))


def exact(work: Work) -> np.ndarray:
    """The final state by SciPy's DOP853 at 1e-10, of the ordinary slopes."""
    model, runs = work.computed, work.prepare(np.arange(1))
    variant = variant_at(model, work.parameters)
    rows, function = variant.rows(), variant.right_hand_side(8)
    lanes = np.zeros((rows.total, 8))
    b, own, pairs = lanes[:, 0], rows.own, rows.pairs
    lanes[rows.parameter : rows.parameter + rows.parameters] = runs.parameters[0][:, None]
    b[rows.phase], frame_rates = runs.initial[0, -1], runs.frame_rates[0, :pairs]

    def slopes(t: float, y: np.ndarray) -> np.ndarray:
        b[:own], b[rows.stage_time] = y, t
        function(lanes.reshape(-1))
        found, out = b[rows.acceleration : rows.acceleration + rows.own_slopes], np.empty(own)
        out[: 2 * pairs : 2], out[1 : 2 * pairs : 2] = (y[1 : 2 * pairs : 2] + frame_rates, found[:pairs])
        out[2 * pairs :] = found[pairs:]
        return out

    span, start = (0.0, work.simulation.observe), runs.initial[0, :own]
    done = solve_ivp(slopes, span, start, "DOP853", rtol=1e-10, atol=1e-12 * runs.state_scales[0])
    return np.asarray(done.y[:, -1])


@pytest.mark.parametrize("case", CASES)
def test_end_states_equal_those_of_another_integrator(case):
    """Within some thousand tolerances, as impacts magnify what steps leave; and a
    hundredth of the tolerance, of segments a thousandth, takes most of the error
    away."""
    errors, seconds = [], SECONDS.get(case, 0.25)
    for rtol in (1e-6, FINE.get(case, 1e-8)):
        work = work_for(CASES[case], "implicit", rtol, seconds)
        if not errors:
            end, size = (exact(replace(work, simulation=replace(work.simulation, method="explicit"))), None)
            size = work.prepare(np.arange(1)).state_scales[0] + np.abs(end)
        errors.append(np.max(np.abs(run_from(work)["final_state"][0, : len(end)] - end) / size))
    assert errors[0] < 5e-3
    assert errors[1] < 2e-4
    assert errors[1] < 0.2 * errors[0]


@pytest.mark.parametrize("case", CASES)
def test_bits_of_implicit_strings_do_not_depend_on_lanes_or_neighbours(case):
    """Each lane iterates until it is done, whatever the others do."""
    work = work_for(CASES[case], "implicit", 1e-6, 0.1)
    axes = {**work.plan.axes, "rotary_speed": work.plan.axes["rotary_speed"] * np.array([0.2, 0.7, 1.0])}
    work = replace(work, plan=replace(work.plan, axes=axes))
    together = run_from(work)
    for place, speed in enumerate(axes["rotary_speed"]):
        alone = replace(work, plan=replace(work.plan, axes={**axes, "rotary_speed": speed[None]}))
        for name, numbers in run_from(alone, lanes=1 if case in ONE_LANE else 8).items():
            assert numbers[0].tobytes() == together[name][place].tobytes(), name
