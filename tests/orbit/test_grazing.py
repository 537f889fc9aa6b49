"""Grazing: of an oscillator at a stop, in closed form; of the drill string's rock; and
corners of branches there."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

import nsdrill
from nsdrill.abi import RATES, Layout
from nsdrill.analysis.bifurcations import PERIODIC
from nsdrill.compiler.functions import BUFFER, compiled
from nsdrill.equations.library import sincos, touching
from nsdrill.equations.motion import Motion
from nsdrill.kernel.batch import Compiled, Runs
from nsdrill.kernel.steppers import STEPPERS, with_step
from nsdrill.models.base import Symmetry
from nsdrill.models.christoforou_yigit.coefficients import derive
from nsdrill.models.christoforou_yigit.derived_quantities import lift_off_wob
from nsdrill.models.operation import Operation
from nsdrill.observe.contacts import make_touches, touch_rows
from nsdrill.orbit import arclength, special
from nsdrill.orbit.arclength import Rules, follow
from nsdrill.orbit.branch import Branch
from nsdrill.orbit.flow import Equations, Flow, Legs, advance
from nsdrill.orbit.newton import Evaluation, Point, orientation_of
from nsdrill.orbit.periodic import Periodic
from nsdrill.orbit.special import Graze, kink_predicate
from nsdrill.orbit.special import test_functions_of as functions_of

from .flows import at

ZETA, STIFF, FORCE, GAP = 0.05, 20.0, 0.5, 1.0
REACHED = 102


def stop(t, phase, s, p, o):
    """A damped oscillator that is forced, and meets a spring at a gap."""
    _, cosine = sincos(phase + p.w * t)
    spring = STIFF * touching("stop", s.x - GAP)
    return {"v": FORCE * cosine - 2.0 * ZETA * s.v - s.x - spring}


MOTION = Motion(stop, None, ("x", "v"), ("w",), ("v",), sides=("stop",))


def flow_at_a_stop() -> Flow:
    observed = 2 * RATES + touch_rows(1)
    rows = with_step(STEPPERS["tsitouras"], Layout(4, 0, 1, observed, 2, judged=True))

    def runs(values, initial):
        n = len(values)
        return Runs(
            np.asarray(values, dtype=float).reshape(n, 1),
            np.ones((n, 2)),
            np.zeros((n, rows.own_slopes)),
            np.asarray(values)[:, 0],
            np.full(n, 1e-4),
            initial,
        )

    def parts(lanes):
        touches, marker = make_touches(lanes, rows, 2 * RATES, 0, 1)
        W, first = lanes, lanes * rows.observer
        moves_ = W * rows.moves
        gap = MOTION.contact_functions(lanes, rows, RATES)

        @compiled(BUFFER, BUFFER)
        def watch(b, store):
            now = first + RATES * W
            gap(b)
            touches(b, store)
            for i in range(W):
                if b[moves_ + i] != 0.0:
                    for k in range(0, RATES * W, W):
                        b[first + k + i] = b[now + k + i]

        return Compiled(MOTION.tangent(lanes, rows, 0), watch, marker)

    return Flow(Equations(rows, Symmetry(1, (0, 1)), (1.0,), runs, parts, contacts=("stop",)), rtol=1e-12)


@pytest.mark.parametrize(("start", "sense", "wanted"), [(0.5, 1, 0.7106873691), (1.5, -1, 1.2185743569)])
def test_oscillator_at_a_stop_grazes_where_its_amplitude_is_the_gap(start, sense, wanted):
    """Without touching the amplitude is F / |1 - w^2 + 2 i zeta w|, which is the gap at
    these frequencies."""
    amplitude = abs(FORCE / complex(1.0 - wanted**2, 2.0 * ZETA * wanted))
    assert amplitude == pytest.approx(GAP, abs=1e-9)
    flow = flow_at_a_stop()
    motion = FORCE / complex(1.0 - start**2, 2.0 * ZETA * start)
    state = np.array([[motion.real, -start * motion.imag]])
    problem = Periodic.at(flow, 1, np.array([start]), state[0])
    point = at(flow, problem, problem.unknowns(state, start))
    test_functions = functions_of({0: Graze(REACHED, None)}, PERIODIC)
    rules = Rules((0.4, 1.6), 40, test_functions, has_kink=kink_predicate(1), max_step=0.1)
    half = advance(flow, {0: follow(problem, point, sense, rules)})[0]
    labels = [one.label for one in half.points]
    first = labels.index(REACHED)
    assert not any(labels[:first])
    assert half.points[first].point.found.values[0] == pytest.approx(wanted, abs=1e-8)
    assert half.points[first - 1].point.found.touches[0, 2] == 0.0
    assert half.points[first + 1].point.found.touches[0, 2] == 1.0


def test_lift_off_of_a_bit_that_turns_evenly():
    """Without friction and damping in torsion the bit turns evenly, and leaves the rock
    where the law of linear contact says."""
    study = {
        "operation": {"depth": "5000 m", "wob": "22.24 kN"},
        "modes": {"lateral": "frozen"},
        "drillstring": {"torsional_damping": "0 N m s/rad"},
        "bit": {"friction": {"static": 0.0, "dynamic": 0.0}, "cutting": {"zeta": 0.0}},
        "simulation": {"transient": "0.1 s", "observe": "0.1 s"},
        "continue": {
            "along": "rotary_speed",
            "from": "3.55 rad/s",
            "to": "3.7 rad/s",
            "lobes": 1,
            "switch": False,
            "motions": "periodic",
            "seeds": {"rotary_speed": ["3.58 rad/s"]},
            "points": 90,
        },
    }
    parameters = nsdrill.load_study(study).parameters
    k = derive(parameters, 5000.0, 22240.0, 3.58)
    rock, w, damping = parameters.bit.rock_stiffness, 3 * 3.58, parameters.drillstring.axial_damping
    both = k.k_a + rock
    swing = rock * parameters.bit.surface_amplitude / complex(both - k.m_a * w * w, damping * w)
    study["initial"] = {
        "z": f"{float(-22240.0 / both + swing.imag)!r} m",
        "vz": f"{float(w * swing.real)!r} m/s",
        "twist": "0 rad",
    }
    data = nsdrill.continue_branches(study)
    (found,) = data["rotary_speed"].values[data["label"].values == 101]

    def excess(speed):
        at = Operation(5000.0, 22240.0, speed)
        return lift_off_wob(parameters, at, derive(parameters, 5000.0, 22240.0, speed)) - 22240.0

    limit = brentq(excess, 3.5, 3.7, xtol=1e-12)
    assert limit == pytest.approx(3.632675, abs=1e-6)
    assert found == pytest.approx(limit, abs=1e-6)


class Corner:
    """The branch number = u - 1000 u^(3/2) for u > 0, u below: what a stiff contact
    makes of a branch that grazes. It turns within 1e-6 of the origin, and goes back."""

    tolerance_factor = 1.0

    def evaluate(self, x):
        u, number = x
        deep = max(u, 0.0)
        residual = number - u + 1000.0 * deep**1.5
        return Evaluation(
            np.array([residual]), np.array([[-1.0 + 1500.0 * deep**0.5, 1.0]]), lambda: (float(u), float(number))
        )
        yield

    def updated(self, x):
        return self


def test_a_branch_is_followed_around_a_corner():
    def has_kink(one, two):
        return (one[0] > 0.0) != (two[0] > 0.0)

    def test_functions(previous, current):
        if (previous.tangent[-1] > 0.0) != (current.tangent[-1] > 0.0):
            return [special.TestFunction(5, lambda point: float(point.tangent[-1]))]
        return []

    tangent = np.array([1.0, 1.0]) / 2**0.5
    start = Point(np.array([-0.5, -0.5]), tangent, (-0.5, -0.5), 1, 0.0)
    orientation = float(np.linalg.slogdet(np.vstack([[-1.0, 1.0], tangent]))[0])
    rules = Rules((-0.9, 1.0), 200, test_functions, has_kink=has_kink)
    half = advance(None, {0: follow(Corner(), replace(start, orientation=orientation), 1, rules)})[0]
    assert half.ended == "from"
    (fold,) = (one.point for one in half.points if one.label)
    exact = (2.0 / 3000.0) ** 2  # u of the fold
    assert fold.x[1] == pytest.approx(exact - 1000.0 * exact**1.5, abs=1e-6)
    assert half.points[-1].point.x == pytest.approx([(0.9 / 1000.0) ** (2 / 3), -0.9], abs=1e-4)
    every = [one.point.x for one in half.points]
    assert max(x[1] for x in every) < 1e-6


def start_of(problem, x, tangent):
    """A point of a problem without legs, which is followed along ``tangent``."""
    evaluation = advance(None, {0: problem.evaluate(np.array(x))})[0]
    tangent = np.array(tangent) / np.linalg.norm(tangent)
    orientation = orientation_of(evaluation.jacobian, tangent)
    return Point(np.array(x), tangent, evaluation.solution(), 1, 0.0, orientation=orientation)


class Arms:
    """Two lines side by side, w = 0 and w = ``apart`` + number, of which the second is
    followed the other way: they cross in a branch point."""

    tolerance_factor = 1.0

    def __init__(self, apart):
        self.apart = apart

    def evaluate(self, x):
        w, number = x
        other = w - self.apart - number
        jacobian = np.array([[w + other, -w]])
        return Evaluation(np.array([w * other]), jacobian, lambda: (float(w), float(number)))
        yield

    def updated(self, x):
        return self


def test_a_branch_point_is_passed_and_a_leap_to_an_arm_beside_it_is_none():
    """A step may reach the other line, where the orientation differs as well: beyond a
    branch point a branch goes on, from there it would be followed back."""
    arms = Arms(0.3)
    start = start_of(arms, (0.0, -0.5), (0.0, 1.0))
    half = advance(None, {0: follow(arms, start, 1, Rules((-0.6, 0.6), 50))})[0]
    assert half.ended == "to"
    assert half.points[-1].point.orientation == -start.orientation
    assert max(abs(one.point.x[0]) for one in half.points) < 1e-12
    for number, passes in ((-0.2, True), (-0.45, False)):
        w = 0.0 if passes else 0.3 + number
        there = start_of(arms, (w, number), (0.0, 1.0))
        assert there.orientation == -start.orientation
        task = arclength._crosses_branch_point(arms, start, there)
        assert advance(None, {0: task})[0] == passes


def test_a_branch_that_turns_beyond_a_kink_that_was_passed():
    """The corner again, with its kink behind: within a step the branch turns about, and
    its tangent is one against the way that it came."""
    start = start_of(Corner(), (4e-8, 4e-8 - 1000.0 * 4e-8**1.5), (1.0, 0.7))
    tangent = np.array([1.0, 1.0 - 1500.0 * 4e-8**0.5])
    start = replace(start, tangent=tangent / np.linalg.norm(tangent))
    half = advance(None, {0: follow(Corner(), start, 1, Rules((-0.9, 1.0), 200, has_kink=lambda one, two: False))})[0]
    assert half.ended == "from"
    assert half.points[-1].point.x == pytest.approx([(0.9 / 1000.0) ** (2 / 3), -0.9], abs=1e-4)


class Hairpin:
    """number = -10¹³ u²: two arms nearer than equal motions are."""

    tolerance_factor = 1.0

    def evaluate(self, x):
        u, number = x
        jacobian = np.array([[2e13 * u, 1.0]])
        return Evaluation(np.array([number + 1e13 * u * u]), jacobian, lambda: (float(u), float(number)))
        yield

    def updated(self, x):
        return self


def test_a_branch_that_turns_back_over_itself_ends_at_the_turn():
    start = start_of(Hairpin(), (-((2.0 / 1e13) ** 0.5), -2.0), (0.0, 1.0))
    half = advance(None, {0: follow(Hairpin(), start, 1, Rules((-3.0, 1.0), 200))})[0]
    assert half.ended == "turned"
    assert Branch("periodic", 1, half.points, ("seed", half.ended)).end_reason.endswith("it turns back over itself")
    numbers = [one.point.x[1] for one in half.points]
    assert numbers == sorted(numbers)
    assert -2.0 * arclength.MAX_STEP < numbers[-1] < 0.0


def test_legs_of_an_impossible_angle_do_not_run():
    flow = flow_at_a_stop()
    legs = Legs(
        np.zeros((2, 2)), np.zeros(2), np.full(2, 6.0), np.array([[0.0], [1.0]]), np.zeros(2, bool), angular=True
    )
    ends = flow.run(legs)
    assert list(ends.ok) == [False, True]
