"""What equations may not be is refused with file, line and source, and with what is
allowed, as one who writes a model meets it."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from nsdrill.abi import Rows
from nsdrill.compiler.language import LanguageError
from nsdrill.equations.library import direction, sqrt
from nsdrill.equations.motion import Motion
from nsdrill.equations.trace import part

ROWS = Rows(2, 0, 1, 0)


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


def numpy_sine(t, phase, s, p, o):
    return {"speed": np.sin(s.position)}


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
        (returning, "if s.speed > 0.0:", "condition on a value.* `if` without `return`"),
        (loop, "while s.speed", "condition on a value.* in a loop, conditions on options"),
        (sine, "math.sin", "a value where a number is wanted.*library sqrt, sincos"),
        (numpy_sine, "np.sin", "does not support ufuncs.*library sqrt, sincos"),
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
    """What a part refers to, and what a law is made of, is a part of what names the
    compiled code."""
    from nsdrill.equations.library import SteepLaw, friction

    def equations_with(begin):
        law = SteepLaw(lambda v, n: direction(v), lambda x, free, n: (x, direction(x)), begin, lambda n: 0.0)

        def equations(t, phase, s, p, o):
            return {"speed": -friction("wall", slip=s.speed, normal=1.0, law=law, numbers=None)}

        return made(equations).identity

    one, same, other = (
        equations_with(begin) for begin in (lambda f, r, n: f, lambda f, r, n: f, lambda f, r, n: 0.5 * f)
    )
    assert one == same
    assert one != other
