"""Equations in lanes, with their tangent, and what they may not be."""

import math
from collections.abc import Callable
from inspect import signature
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from nsdrill.abi import RATES, Layout
from nsdrill.compiler.language import LanguageError
from nsdrill.equations.library import direction, sincos, sqrt, tanh, touching
from nsdrill.equations.motion import Motion
from nsdrill.equations.plain import followed
from nsdrill.equations.trace import part
from nsdrill.kernel.batch import Batch, Compiled, FinishedRuns, Runs, unobserved
from nsdrill.kernel.settings import Simulation
from nsdrill.kernel.steppers import STEPPERS

ROWS = Layout(2, 0, 1, 0)


def made(equations: Callable[..., Any], options: Any = None) -> Any:
    motion = Motion(equations, options, ("position", "speed"), ("damping",), ("speed",))
    function = motion.right_hand_side(8, ROWS)
    assert function.py_func
    return function


def state(t, phase, s, p, o):
    return {"speed": -s.positon}


def parameter(t, phase, s, p, o):
    return {"speed": -p.dampin * s.speed}


def new_value(t, phase, s, p, o):
    s.speed = 2.0 * s.speed
    return {"speed": s.speed}


def sign(x):
    return 1.0 if x > 0.0 else -1.0


def condition(t, phase, s, p, o):
    return {"speed": -sign(s.speed)}


def returning(t, phase, s, p, o):
    if s.speed > 0.0:
        return {"speed": 1.0}
    return {"speed": -1.0}


def loop(t, phase, s, p, o):
    while s.speed > 0.0:
        pass
    return {"speed": 1.0}


def sine(t, phase, s, p, o):
    return {"speed": math.sin(s.position)}


def numpy_log(t, phase, s, p, o):
    return {"speed": np.log(s.position)}


def root(t, phase, s, p, o):
    return {"speed": s.position**0.5}


def remainder(t, phase, s, p, o):
    return {"speed": s.position % 2.0}


def one_side(t, phase, s, p, o):
    if s.speed > 0.0:
        share = 2.0
    return {"speed": 3.0 * share}


def text(t, phase, s, p, o):
    return {"speed": s.speed + "1"}


def unknown_name(t, phase, s, p, o):
    return {"speed": undefined(s.speed)}  # noqa: F821


def option(t, phase, s, p, o):
    return {"speed": o.kind * s.speed}


def nothing(t, phase, s, p, o):
    pass


def no_number(t, phase, s, p, o):
    return {"speed": None}


def other_slopes(t, phase, s, p, o):
    return {"position": s.speed}


def too_many(t, phase, s, p, o):
    return {"speed": s.speed}, {"force": 1.0}


@pytest.mark.parametrize(
    ("equations", "source", "words"),
    [
        (state, "-s.positon", "none of the states; did you mean position\\? allowed: position, speed"),
        (parameter, "-p.dampin", r"none of the lane parameters; did you mean damping\?"),
        (new_value, "s.speed = 2.0", "a new value of speed.* allowed: another name"),
        (condition, "if x > 0.0", "condition on a value.* marked with `part`"),
        (returning, "return {'speed': 1.0}", "condition on a value.* `if` without `return`"),
        (loop, "while s.speed", "condition on a value.* in a loop, conditions on options"),
        (sine, "math.sin", "a value where a number is wanted.*library sqrt, sincos"),
        (numpy_log, "np.log", "np.log of a value.*library sqrt, sincos"),
        (root, r"\*\*0.5", "the power 0.5; allowed: 1, 2, 3"),
        (remainder, "% 2.0", "unsupported operand.* allowed on values: "),
        (one_side, "3.0 . share", "only one side of an `if`.* allowed: a value before"),
        (text, 's.speed . "1"', "'1' where a number is wanted"),
        (unknown_name, "undefined", "NameError: name 'undefined'"),
        (option, "o.kind", "no attribute 'kind'"),
        (nothing, "", "None as what it returns; allowed: a dictionary of the slopes"),
        (no_number, "", "None as speed; allowed: a number or a value"),
        (other_slopes, "", "found slopes of position; allowed: of speed, all of them"),
        (too_many, "", "found outputs of force; allowed: of nothing"),
    ],
    ids=lambda value: getattr(value, "__name__", ""),
)
def test_the_place_and_the_remedy_are_said(equations, source, words):
    first = equations.__code__.co_firstlineno if equations is not condition else sign.__code__.co_firstlineno
    with pytest.raises(LanguageError, match=f"{source}.*{words}") as refusal:
        made(equations)
    place, name = str(refusal.value).split(": ")[:2]
    file, line = place.rsplit(", line ", 1)
    assert file == __file__
    assert first <= int(line) <= first + 3
    assert name == ("sign" if equations is condition else equations.__name__)


@part
def smoothed(x, kind):
    """Conditions on options and on values, and a function that is defined below."""
    if kind == "none":
        return 0.0
    if x > 0.0:
        size, side = x, 1.0
    else:
        size, side = -x, -1.0
    return side * halved(size) if not (size < 1.0 or size > 3.0) else direction(x)


def halved(x):
    return 0.5 * x


def allowed(t, phase, s, p, o):
    weights = [k * p.damping for k in range(3)]
    total = sum(w * s.position**2 for w in weights)
    biggest = max(total, 0.0, s.speed)
    return {"speed": smoothed(s.speed, o) + biggest + np.float64(2.0) * sqrt(abs(s.position))}


def test_conditions_loops_and_powers_have_the_values_of_python():
    rng = np.random.default_rng(5)
    x, v, d = rng.normal(size=8), np.linspace(-4.0, 4.0, 8), rng.normal(size=8)
    for kind in ("none", "some"):
        buffer = np.zeros((ROWS.total, 8))
        buffer[ROWS.stage], buffer[ROWS.stage + 1], buffer[ROWS.parameter] = x, v, d
        flat = buffer.ravel()
        made(allowed, kind)(flat)
        law = np.where((abs(v) < 1) | (abs(v) > 3), 2 / np.pi * np.arctan(v), 0.5 * v)
        wanted = np.maximum(np.maximum(3 * d * x * x, 0.0), v) + 2 * np.sqrt(abs(x))
        wanted += law if kind == "some" else 0.0
        assert flat.reshape(buffer.shape)[ROWS.acceleration] == pytest.approx(wanted, abs=1e-14)


def test_another_law_is_another_function():
    """What a law is made of is a part of what names the compiled code, as far as it is
    compiled: an explicit step needs no guess."""
    from nsdrill.compiler.identity import key
    from nsdrill.equations.library import SteepLaw, friction

    def equations_with(value, begin=lambda free, relaxed, n: free):
        law = SteepLaw(value, lambda x, free, n: (x, direction(x)), begin, lambda n: 0.0)

        def equations(t, phase, s, p, o):
            return {"speed": -friction("wall", slip=s.speed, normal=1.0, law=law, numbers=None)}

        return key(made(equations))

    one, same, other = (
        equations_with(value)
        for value in (lambda v, n: direction(v), lambda v, n: direction(v), lambda v, n: 0.5 * direction(v))
    )
    assert one == same == equations_with(lambda v, n: direction(v), lambda free, relaxed, n: 0.5 * free)
    assert one != other


LAYOUT = Layout(2, 0, 4, 0)
INERTIA, STIFFNESS, DAMPING = 565.0, 197.0, 50.0
STATIC, DYNAMIC, SMOOTHING = 6000.0, 3000.0, 20.0


def torsion(t, phase, s, p, o):
    """The twist and the bit's speed under a smoothed friction torque that falls with
    speed."""
    falling = p.torque / (1.0 + 3.0 * abs(s.speed)) + 0.5 * p.torque
    friction = direction(SMOOTHING * s.speed) * falling
    return {"speed": (-p.damping * s.speed - p.stiffness * s.twist - friction) / p.inertia}


TORSION = Motion(torsion, None, ("twist", "speed"), ("inertia", "stiffness", "damping", "torque"), ("speed",))


TORQUES = (500.0, 2000.0, 4000.0)


def run(lanes: int, stepper: str = "tsitouras", torques: Any = TORQUES, rtol: float = 1e-10) -> FinishedRuns:
    """From rest behind a drive at 3 rad/s, 20 s for each friction torque."""
    n = len(torques)
    batch = Batch(lanes, n, LAYOUT, np.zeros(1), 0, Simulation(5.0, 15.0, rtol, pair=stepper))
    table = np.column_stack([np.full(n, INERTIA), np.full(n, STIFFNESS), np.full(n, DAMPING), torques])
    batch.add_many(
        np.arange(n),
        Runs(
            table,
            state_scales=np.ones((n, 2)),
            frame_rates=np.full((n, 1), -3.0),
            phase_rate=np.full(n, 3.0),
            first_step=np.full(n, 1e-3),
            initial=np.zeros((n, 3)),
        ),
    )
    done = batch.advance(Compiled(TORSION.right_hand_side(lanes, LAYOUT), *unobserved()), 60.0, True)
    assert batch.idle
    order = np.argsort(done.job)
    done.final, done.accepted = done.final[order], done.accepted[order]
    return done


@pytest.mark.parametrize("stepper", list(STEPPERS))
def test_a_scalar_model_follows_its_equations(stepper):
    """Against SciPy's DOP853 at 1e-12. Twenty seconds at rtol 1e-10, a few thousand
    steps: 1e-6."""
    done = run(1, stepper)
    for torque, final in zip(TORQUES, done.final, strict=True):

        def slopes(t, y, torque=torque):
            twist, speed = y
            direction = 2 / np.pi * np.arctan(SMOOTHING * speed)
            friction = direction * (torque / (1 + 3 * abs(speed)) + 0.5 * torque)
            return [speed - 3.0, (-DAMPING * speed - STIFFNESS * twist - friction) / INERTIA]

        exact = solve_ivp(slopes, (0.0, 20.0), [0.0, 0.0], "DOP853", rtol=1e-12, atol=1e-12, max_step=0.01).y[:, -1]
        assert final[:2] == pytest.approx(exact, abs=1e-6)
        assert final[2] == 60.0


def test_the_pairs_differ_in_their_steps():
    """The pair of Dormand and Prince takes more steps at the same tolerance: an eighth
    or so."""
    tsitouras, dormand = (run(1, name).accepted.sum() for name in ("tsitouras", "dormand_prince"))
    assert 1.05 < dormand / tsitouras < 1.5


def driven(t, phase, s, p, o):
    """A mass on a spring, shaken by a drive, that meets a stop."""
    force = sincos(phase + p.speed * t)[0]
    return {"v": force - s.x - tanh(s.v) - p.stop * touching("stop", s.x - 0.2)}


def test_the_slopes_and_the_deviation_of_every_lane_are_its_own():
    """Of time, phase, states and parameters of the lane; against numpy. In every other
    lane the stop counts as it does not now."""
    motion = Motion(driven, None, ("x", "v"), ("speed", "stop"), ("v",), sides=("stop",))
    rows = Layout(4, 0, 2, 2 * RATES, 2)
    phase, time, x = np.linspace(0.0, 6.0, 8), np.linspace(0.0, 0.7, 8), np.linspace(-1.0, 1.0, 8)
    v, dx, dv = np.linspace(-30.0, 30.0, 8), np.linspace(1.0, 2.0, 8), np.linspace(2.0, -1.0, 8)
    buffer = np.zeros((rows.total, 8))
    buffer[rows.stage : rows.stage + 4] = x, v, dx, dv
    buffer[rows.stage_time], buffer[rows.phase] = time, phase
    buffer[rows.parameter], buffer[rows.parameter + 1] = 2.0, 3.0
    closed = np.where(np.arange(8) % 2, 1.0, -1.0) * (x - 0.2)
    buffer[rows.observer] = closed
    flat = buffer.ravel()
    motion.tangent(8, rows, 0)(flat)
    found = flat.reshape(rows.total, 8)
    force = np.sin(phase + 2.0 * time) - x - np.tanh(v) - 3.0 * np.maximum(x - 0.2, 0.0)
    assert found[rows.acceleration] == pytest.approx(force, abs=1e-8)
    deviation = -dx - dv / np.cosh(v) ** 2 - np.where(closed > 0.0, 3.0 * dx, 0.0)
    assert found[rows.acceleration + 1] == pytest.approx(deviation, abs=1e-8)


def test_the_function_of_a_contact_has_its_rates_along_the_motion():
    """Of a position in the frame of a drive, with a lobed surface that passes; against
    the closed form of value, rate and second derivative."""

    def lobes(t, phase, s, p, o):
        height = sincos(3.0 * (s.angle + (p.speed * t + phase)))[0]
        return {"turn": 0.0, "v": touching("rock", height - s.z)}

    motion = Motion(lobes, None, ("angle", "turn", "z", "v"), ("speed",), ("turn", "v"), sides=("rock",))
    rows = Layout(4, 0, 1, RATES)
    rng = np.random.default_rng(2)
    buffer = rng.normal(size=(rows.total, 8))
    flat = buffer.ravel().copy()
    motion.contact_functions(8, rows, 0)(flat)
    angle, turn, z, v = buffer[rows.stage : rows.stage + 4]
    speed, time, phase = buffer[rows.parameter], buffer[rows.stage_time], buffer[rows.phase]
    faster, falling = buffer[rows.acceleration : rows.acceleration + 2]
    frame = buffer[rows.frame_rate : rows.frame_rate + 2]
    at, rate = 3.0 * (angle + speed * time + phase), 3.0 * (turn + frame[0] + speed)
    found = flat.reshape(rows.total, 8)[rows.observer : rows.observer + RATES]
    assert found[0] == pytest.approx(np.sin(at) - z, abs=1e-14)
    assert found[1] == pytest.approx(np.cos(at) * rate - (v + frame[1]), abs=1e-13)
    wanted = -np.sin(at) * rate**2 + np.cos(at) * 3.0 * faster - falling
    assert found[2] == pytest.approx(wanted, abs=1e-12)


def test_a_quantity_of_rows_is_followed_along_the_motion():
    """Its slope, with conditions and functions of the library, beside differences."""

    @part
    def quantity(n):
        return sincos(n.angle)[0] * n.gain if n.time > 1.0 else min(n.gain * n.angle, n.limit)

    value, slope = followed(quantity, lambda n: {"angle": n.speed - n.set_speed, "time": 1.0})
    rows = {"angle": 0.4, "gain": 3.0, "limit": 1.5, "speed": 2.0, "set_speed": 0.5}
    for time, gain in ((0.5, 3.0), (0.5, 5.0), (2.0, 3.0)):
        rows |= {"time": time, "gain": gain}

        def at(dt, function=value, rows=rows):
            moved = rows | {"angle": rows["angle"] + dt * 1.5}
            return float(function(*(moved[name] for name in signature(function).parameters)))

        assert at(0.0, slope) == pytest.approx((at(1e-5) - at(-1e-5)) / 2e-5, rel=1e-9, abs=1e-12)
