"""The code of one thread: one lane as scalars, with the bits of the interpreter and so of
vectors; what its language has besides that of lanes."""

import math
from typing import Any

import numpy as np
import pytest

from nsdrill.compiler import threads
from nsdrill.compiler.functions import (
    BUFFER,
    FLOAT,
    INTEGER,
    INTEGERS,
    LaneFunction,
    anew,
    call,
    claim,
    compiled,
    define,
)
from nsdrill.compiler.language import LanguageError

from .running import bits, interpreted
from .test_constructs import CONSTRUCTS, buffer


def thread_code(function: Any, *kinds: str) -> LaneFunction:
    """The code of one thread, as a function of arrays and numbers."""
    made = LaneFunction(function, "".join(kinds))
    made._address = threads.address(made)
    return made


@pytest.mark.parametrize("name", [name for name in CONSTRUCTS if name != "library"])
def test_one_lane_does_what_the_interpreter_does(name):
    function, rng = CONSTRUCTS[name](1), np.random.default_rng(5)
    made, run = thread_code(function, BUFFER), interpreted(function)
    for _ in range(40):
        before = buffer(rng, 1)
        found, wanted = before.copy(), before.copy()
        made(found)
        run(wanted)
        assert bits(found) == bits(wanted)


@compiled(BUFFER, INTEGER, FLOAT)
def stored(b, place, x):
    b[place] = x
    return place + 1


def test_a_function_that_is_known_is_called():
    """Whether its name stands for it or it is given to a helper."""

    def helper(f, b, place):
        return call(f, b, place, 0.5)

    def outer(b, place):
        first = call(stored, b, place, b[0])
        return helper(stored, b, first) + 10

    b = np.arange(1.0, 6.0)
    assert thread_code(outer, BUFFER, INTEGER)(b, 2) == 14
    assert b.tolist() == [1.0, 2.0, 1.0, 0.5, 5.0]


def taken(m, place, count):
    first = claim(m, place, count)
    return 100 * first + claim(m, place + 1, anew(1))


def test_counters_that_threads_share():
    """What a counter was before something was added to it; in the interpreter too."""
    for run in (thread_code(taken, INTEGERS, INTEGER, INTEGER), taken):
        m = np.array([3, 4, 5])
        assert run(m, 1, 7) == 405
        assert m.tolist() == [3, 11, 6]


def test_an_integer_anew_has_all_its_bits():
    def passed(m):
        m[1] = anew(m[0]) + 1

    m = np.array([(1 << 62) + 7, 0])
    thread_code(passed, INTEGERS)(m)
    assert m[1] == (1 << 62) + 8


@pytest.mark.parametrize(
    ("body", "said"),
    [
        ("claim(b, 0, 1)", "claim is of a counter in a buffer of integers"),
        ("claim(m, 0, 1.5)", "a float, 1.5, stands where an integer is needed"),
        ("b[0] = math.exp(b[0])", "exp is a function of the C library, which a GPU does not have"),
        ("b[0] = math.atan2(b[0], 1.0)", "allowed: the functions of nsdrill.elementary"),
    ],
)
def test_what_a_thread_cannot_do_is_refused_with_its_place(body, said):
    function = define("f", f"def f(b, m):\n    {body}\n", claim=claim, math=math)
    with pytest.raises(LanguageError, match=f"line 2: f: .*{said}"):
        thread_code(function, BUFFER, INTEGERS)
