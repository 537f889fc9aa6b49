"""Orbits, bifurcations and curves of special points that others have published or that have
closed forms."""

import re
from functools import partial

import numpy as np
import pytest
from reference import disc_torque
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import mathieu_a

import nsdrill
from nsdrill.analysis.bifurcations import CYCLE, DOUBLING, FOLD, HOPF, NONE, PERIODIC, SUBCRITICAL, SUPERCRITICAL
from nsdrill.orbit.arclength import Rules, follow
from nsdrill.orbit.branch import Branch, end_reason
from nsdrill.orbit.explore import _doubled_cycle, first_point_on
from nsdrill.orbit.flow import Legs, advance
from nsdrill.orbit.newton import DENSE, Evaluation, newton, sign_of_determinant, solve
from nsdrill.orbit.normal_form import normal_forms
from nsdrill.orbit.periodic import Cycle, Periodic, corotating_rates
from nsdrill.orbit.shooting import shooting_jacobian
from nsdrill.orbit.sides import crossing_of
from nsdrill.orbit.special import test_functions_of as functions_of

from .flows import at, duffing, flow_of, lorenz, mathieu, roessler, van_der_pol


def cycle(flow, state, period, number, segments=6):
    problem = Cycle.at(flow, period, np.array([number]), np.array(state, dtype=float), segments)
    starts = [np.array(state, dtype=float)]
    for _ in range(segments - 1):
        starts.append(flow.run(Legs(starts[-1][None], 0.0, period / segments, np.array([number]))).state[0])
    return at(flow, problem, problem.unknowns(np.stack(starts), period, number)).found


def least_trivial(orbit):
    """The largest multiplier but for the trivial one."""
    return orbit.nontrivial[np.argmax(np.abs(orbit.nontrivial))].real


@pytest.mark.parametrize(
    ("start", "period", "segments", "wanted", "multiplier"),
    [
        ((0.0, 6.0918, 1.2997), 5.88, 6, 5.88108845586, -2.403953527),
        ((0.0, 3.9158, 3.6928), 11.76, 12, 11.7586260717, -3.512006980),
    ],
)
def test_cycles_of_roessler(start, period, segments, wanted, multiplier):
    """Cvitanovic et al., Chaos: Classical and Quantum (chaosbook.org), the shortest
    cycles."""
    found = cycle(flow_of(roessler, 3, singles=3), start, period, 5.7, segments)
    assert found.period == pytest.approx(wanted, rel=1e-9)
    assert least_trivial(found) == pytest.approx(multiplier, rel=2e-8)


def test_cycle_ab_of_lorenz():
    """Viswanath 2003, Nonlinearity 16:1035-1056."""
    found = cycle(flow_of(lorenz, 3, singles=3), (-13.7636, -19.5788, 27.0), 1.5586, 28.0)
    assert found.period == pytest.approx(1.5586522107162, rel=1e-11)
    assert least_trivial(found) == pytest.approx(4.712947, rel=1e-6)
    # Liouville: the product of all multipliers is that of the divergence, -(10 + 1 +
    # 8/3).
    assert np.prod(found.multipliers).real == pytest.approx(0.0, abs=1e-7)
    assert np.log(abs(least_trivial(found))) / found.period == pytest.approx(0.994647, rel=1e-5)


def test_van_der_pol():
    found = cycle(flow_of(van_der_pol, 2), (2.0086, 0.0), 6.66, 1.0)
    assert found.period == pytest.approx(6.6632868593, abs=1e-9)
    assert found.unstable == 0


@pytest.mark.parametrize("order", [1, 2])
def test_mathieu_characteristic_values(order):
    """x'' + (a - 2 q cos 2t) x = 0 has a periodic solution where a is a characteristic
    value: a multiplier of the rest of 1 or, over half of that period, of -1."""
    flow = flow_of(mathieu, 2, forced=True)
    number = float(mathieu_a(order, 1.0))
    (monodromy,) = flow.run(Legs(np.zeros((1, 2)), 0.0, np.pi, np.array([number]), True)).monodromy
    multipliers = np.linalg.eigvals(monodromy)
    wanted = -1.0 if order % 2 else 1.0
    assert np.trace(monodromy) == pytest.approx(2.0 * wanted, abs=1e-8)
    assert np.prod(multipliers).real == pytest.approx(1.0, abs=1e-9)


def test_folds_of_duffing():
    """d = 0.05, F = 0.1: harmonic balance with nine odd harmonics has the folds at
    these frequencies."""
    flow = flow_of(duffing, 2, forced=True)
    state, number = np.zeros((1, 2)), np.array([[0.6]])
    for _ in range(60):
        state = flow.run(Legs(state, 0.0, 2 * np.pi / 0.6, number)).state
    problem = Periodic.at(flow, 1, number[0], state[0])
    point = at(flow, problem, problem.unknowns(state, 0.6))
    jobs = {0: follow(problem, point, 1, Rules((0.5, 1.6), 400, functions_of({}, PERIODIC)))}
    half = advance(flow, jobs)[0]
    folds = [one.point.found.values[0] for one in half.points if one.label == 5]
    assert half.ended == "to"
    assert folds == pytest.approx([1.228735491, 1.157951712], abs=1e-8)
    # Between the folds the motion is unstable, elsewhere it is stable.
    labels = [one.label for one in half.points]
    first, last = (k for k, label in enumerate(labels) if label == 5)
    unstable = [one.point.found.unstable for one in half.points]
    assert set(unstable[:first]) == {0}
    assert set(unstable[first + 1 : last]) == {1}
    assert set(unstable[last + 1 :]) == {0}


def test_the_doubling_of_roessler():
    """On the cycle of one turn, from 2.5 to 3.2: where it is located, the monodromy
    matrix by SciPy has the multiplier -1."""
    flow, state = flow_of(roessler, 3, singles=3), (0.0, -3.6, 0.02)

    def slopes(t, y, a=2.5):
        jacobian = np.array([[0.0, -1.0, -1.0], [1.0, 0.2, 0.0], [y[2], 0.0, y[0] - a]])
        slope = [-y[1] - y[2], y[0] + 0.2 * y[1], 0.2 + y[2] * (y[0] - a)]
        return np.concatenate([slope, (jacobian @ y[3:].reshape(3, 3)).ravel()])

    def end(start, time, a, **options):
        whole = np.concatenate([start, np.eye(3).ravel()])
        return solve_ivp(slopes, (0.0, time), whole, "DOP853", rtol=1e-12, atol=1e-13, args=(a,), **options)

    def returns(t, y, a):
        return y[0]

    returns.direction = 1.0
    path = end(state, 600.0, 2.5, events=returns)
    start, period = path.y_events[0][-1][:3], np.diff(path.t_events[0])[-1]
    problem = Cycle.at(flow, period, np.array([2.5]), start, 1)
    point = at(flow, problem, problem.unknowns(start[None], period, 2.5))
    jobs = {0: follow(problem, point, 1, Rules((2.0, 3.2), 200, functions_of({}, CYCLE)))}
    half = advance(flow, jobs)[0]
    found = [one.point.found for one in half.points if one.label]
    assert [one.label for one in half.points if one.label] == [DOUBLING]
    monodromy = end(found[0].state, found[0].period, found[0].values[0]).y[3:, -1].reshape(3, 3)
    assert np.min(np.abs(np.linalg.eigvals(monodromy) + 1.0)) < 1e-6
    # The cycle of two turns springs to the side where it is stable; with -1 - e the multiplier
    # of that of one turn there, and c the coefficient, its turns are 2 (e / c)**0.5 apart.
    onset = found[0]
    forms = normal_forms(flow, [Branch(CYCLE, 1, half.points, ("seed", "to"))])
    (form,) = [form for form, one in zip(forms, half.points, strict=True) if one.label == DOUBLING]
    assert form.criticality(DOUBLING) == SUPERCRITICAL
    assert form.error < 1e-3 * form.coefficient
    doubled = advance(flow, {0: first_point_on(*_doubled_cycle(flow, onset))})[0].found
    a = float(doubled.values[0])
    single = cycle(flow, onset.state, onset.period, a, 1)
    e = -1.0 - least_trivial(single)
    assert e > 0.0
    assert doubled.unstable == 0
    along = corotating_rates(flow, single.state[None], single.values)[0]
    apart = doubled.mesh_states[1] - doubled.mesh_states[0]
    apart -= along * (along @ apart) / (along @ along)
    assert form.coefficient == pytest.approx(e / (np.linalg.norm(apart) / 2.0) ** 2, rel=0.05)


@pytest.mark.parametrize("segments", [1, 3])
def test_a_doubled_cycle_ends_where_it_meets_that_of_half_its_period(segments):
    """The cycle of two turns of Roessler, followed down from 2.95 to its doubling at 2.8327:
    its halves become equal there, but it stays as wide as that of one turn."""
    flow = flow_of(roessler, 3, singles=3)
    start, period, a = np.array([0.0, -3.6, 0.02]), 11.6, np.array([2.95])
    for _ in range(20):  # it is stable: on it after some turns
        start = flow.run(Legs(start[None], 0.0, period, a)).state[0]
    path = solve_ivp(
        lambda t, y: [-y[1] - y[2], y[0] + 0.2 * y[1], 0.2 + y[2] * (y[0] - 2.95)],
        (0.0, 200.0), start, "DOP853", rtol=1e-12, atol=1e-13,
        events=(lambda t, y: y[0],),
    )  # fmt: skip
    rising = [(time, y) for time, y in zip(path.t_events[0], path.y_events[0], strict=True) if y[1] < 0.0]
    period = rising[-1][0] - rising[-3][0]
    twice = cycle(flow, rising[-1][1], period, 2.95, 2 * segments)
    assert twice.period == pytest.approx(11.6, abs=0.3)
    problem = Cycle.at(flow, twice.period, twice.values, twice.state, 2 * segments)
    point = at(flow, problem, problem.unknowns(twice.mesh_states, twice.period, 2.95))
    kind = CYCLE, 1
    rules = Rules((2.0, 3.2), 200, crossing=partial(crossing_of, flow, kind))
    half = advance(flow, {0: follow(problem, point, -1, rules)})[0]
    assert half.ended == "half"
    assert "shrinks" not in end_reason(("to", half.ended))
    assert "doubling" in end_reason(("to", half.ended))
    assert half.points[-1].point.found.values[0] == pytest.approx(2.8327, abs=0.02)
    single = cycle(flow, half.points[-1].point.found.state, twice.period / 2, 2.8327, 1)
    assert half.points[-1].point.found.period == pytest.approx(2 * single.period, rel=1e-3)


STUDY = {
    "model": "torsion",
    "operation": {"depth": "5000 m", "wob": "22 kN"},
    "simulation": {"transient": "5 s", "observe": "5 s"},
    "continue": {
        "along": "rotary_speed",
        "from": "1.8 rad/s",
        "to": "6 rad/s",
        "seeds": {"rotary_speed": ["5 rad/s"]},
        "points": 400,
    },
}
STICK_ONSET = 104


@pytest.fixture(scope="module")
def continued():
    """Steady drilling and the cycles that spring from it, with the curves of Hopf
    points and folds of cycles."""
    curves = {"over": "wob", "from": "21 kN", "to": "24 kN", "of": ["hopf", "fold"], "points": 40}
    study = nsdrill.load_study({**STUDY, "continue": {**STUDY["continue"], "curves": curves}})
    said: list[str] = []
    data = nsdrill.continue_branches(study, progress=said.append)
    assert any(re.fullmatch("curves: 0 followed, at most [1-9] to follow", line) for line in said), said
    return study, data


def curve(data, label):
    """Both numbers along the only curve of a label, the second increasing."""
    (number,) = np.flatnonzero(data["curve_label"].values == label)
    ends = np.cumsum(data["curve_row_size"].values)
    part = slice(ends[number] - data["curve_row_size"].values[number], ends[number])
    order = np.argsort(data["curve_wob"].values[part])
    return data["curve_rotary_speed"].values[part][order], data["curve_wob"].values[part][order]


def test_curve_of_hopf_points(continued):
    """Steady drilling is lost where the damping and the slope of the torque add up to
    nothing, at every weight."""
    study, data = continued
    speeds, weights = curve(data, HOPF)
    assert (weights[0], weights[-1]) == pytest.approx((21e3, 24e3))
    h, bit = 1e-5, study.parameters.bit

    def damping(speed, wob):
        slope = (disc_torque(bit, wob, speed + h) - disc_torque(bit, wob, speed - h)) / (2.0 * h)
        return study.parameters.drillstring.torsional_damping + slope

    exact = [brentq(damping, 1.0, 4.0, args=(wob,)) for wob in weights]
    assert speeds == pytest.approx(exact, abs=1e-6)


def test_curve_of_folds_of_cycles(continued):
    """The curve passes the fold of the branch at another weight on bit."""
    _, data = continued
    speeds, weights = curve(data, FOLD)
    assert weights[0] < 21.9e3
    assert weights[-1] > 22.1e3
    near = int(np.argmin(np.abs(weights - 22.4e3)))
    wob = float(weights[near])
    there = nsdrill.continue_branches({**STUDY, "operation": {"depth": "5000 m", "wob": f"{wob!r} N"}})
    (fold,) = there["rotary_speed"].values[there["label"].values == FOLD]
    assert speeds[near] == pytest.approx(fold, abs=1e-6)


def test_onset_of_sticking(continued):
    """Where the bit begins to stick, the least bit speed of the cycle is the threshold;
    stability does not change."""
    study, data = continued
    place = int(np.argmax(data["label"].values == STICK_ONSET))
    assert data["label"].values[place] == STICK_ONSET
    assert data["bit_speed_min"].values[place] == pytest.approx(study.thresholds.stuck_below, abs=1e-6)
    assert data["unstable"].values[place - 1] == data["unstable"].values[place + 1]
    sticks = data["touches"].sel(contact="bit").values
    slow = data["bit_speed_min"].values < study.thresholds.stuck_below
    cycles = (data["branch_of_point"].values == 1) & (np.arange(len(slow)) != place)
    assert np.array_equal(sticks[cycles] > 0, slow[cycles])


def test_the_hopf_point_is_subcritical(continued):
    """The normal form says what the cycles do that spring from the point: they set out to
    the side where steady drilling is stable, and are unstable there."""
    _, data = continued
    numbers, unstable = data["rotary_speed"].values, data["unstable"].values
    (hopf,) = np.flatnonzero(data["label"].values == HOPF)
    cycles = np.flatnonzero(data["branch_of_point"].values == 1)
    near = cycles[np.argsort(np.abs(numbers[cycles] - numbers[hopf]))[:5]]
    steady = np.flatnonzero((data["branch_of_point"].values == 0) & (unstable == 0) & (data["label"].values != HOPF))
    is_on_stable_side = (numbers[near] > numbers[hopf]) == (numbers[steady].mean() > numbers[hopf])
    assert is_on_stable_side.all()
    assert (unstable[near] > 0).all()
    assert data["criticality"].values[hopf] == SUBCRITICAL
    assert data["normal_form_error"].values[hopf] < 1e-3 * data["normal_form"].values[hopf]
    others = np.delete(np.arange(len(numbers)), hopf)
    assert (data["criticality"].values[others] == NONE).all()
    assert np.isnan(data["normal_form"].values[others]).all()


def test_bad_curves_are_refused():
    curves = {"over": "wob", "from": "30 kN", "to": "40 kN"}
    study = nsdrill.load_study({**STUDY, "continue": {**STUDY["continue"], "curves": curves}})
    with pytest.raises(nsdrill.InputError, match="set out"):
        nsdrill.continue_branches(study)


def shooting(segments, seed):
    """The matrix of a motion of so many segments with eight states, bordered by a dense
    row and column."""
    rng = np.random.default_rng(seed)
    made = rng.normal(size=(8 * segments + 1, 8 * segments + 1))
    made[:-1, :-1] = shooting_jacobian(rng.normal(size=(segments, 8, 8)))
    return made


@pytest.mark.parametrize("segments", [1, 4, 12, 13, 32])
def test_solutions_and_signs(segments):
    signs = set()
    for seed in range(12):
        matrix = shooting(segments, seed)
        wanted = np.random.default_rng(100 + seed).normal(size=len(matrix))
        assert solve(matrix, matrix @ wanted) == pytest.approx(wanted, abs=1e-8 * np.linalg.cond(matrix))
        signs.add(sign_of_determinant(matrix))
        assert sign_of_determinant(matrix) == np.linalg.slogdet(matrix)[0]
    assert signs == {1.0, -1.0}


class Ledge:
    """x + 0.3 (1 + tanh 20 (x - 0.5)): from 0.5 a step of 0.11, as it is steep there, then one
    of 0.32."""

    tolerance_factor = 1.0

    def evaluate(self, x):
        yield from ()
        step = np.tanh(20.0 * (x[0] - 0.5))
        slope = 1.0 + 6.0 * (1.0 - step**2)
        return Evaluation(np.array([x[0] + 0.3 * (1.0 + step)]), np.array([[slope, 0.0]]), lambda: None)


def test_newtons_method_may_begin_with_a_short_step():
    with pytest.raises(StopIteration) as ended:
        next(newton(Ledge(), np.array([0.5, 0.0]), np.array([0.0, 1.0])))
    x, _, iterations, _ = ended.value.value
    assert abs(x[0]) < 1e-8
    assert iterations > 3


@pytest.mark.parametrize("size", [DENSE - 1, DENSE + 1])
def test_singular_matrices(size):
    matrix = np.eye(size)
    matrix[3] = 0.0
    assert sign_of_determinant(matrix) == 0.0
    with pytest.raises(np.linalg.LinAlgError):
        solve(matrix, np.ones(size))
