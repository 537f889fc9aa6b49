"""Small equations in many forms of Python. Each gives one number from the states x, y
and z, which a lane each has, and from the option k, 2.

``ALLOWED`` have the values of plain Python in every lane. ``REFUSED`` would not, and name
what the refusal says.
"""

# ruff: noqa

from __future__ import annotations

import contextlib
import functools
import itertools
import math
import random
import sys
import time
from collections import Counter, deque, namedtuple
from types import SimpleNamespace

import numpy as np

from nsdrill.equations.library import expm1, fma, sincos, sqrt, tanh
from nsdrill.equations.trace import part

GAINS = [1.5, 2.5]
TABLE = {"a": 2.0, "b": 3.0}
STATE = SimpleNamespace(calls=0.0, last=None)
HISTORY = []
Pair = namedtuple("Pair", "one two")


def plain_helper(a, b=2.0):
    return a * b + 1.0


@part
def sign(a):
    if a > 0.0:
        side = 1.0
    else:
        side = -1.0
    return side


@part
def is_equal(a, b):
    return 3.0 if a == b else 4.0


def appending(into, value):
    into.append(value)
    return value


def remembering(value):
    HISTORY.append(value)
    return value


class Counting:
    def __init__(self):
        self.count = 0.0

    def add(self, value):
        self.count = self.count + value
        return value


class Doubled:
    """A property with an effect."""

    def __init__(self):
        self.asked = 0

    @property
    def value(self):
        self.asked += 1
        return 2.0


ALLOWED, REFUSED = {}, {}


def allowed(function):
    ALLOWED[function.__name__] = function
    return function


def refused(words):
    def add(function):
        REFUSED[function.__name__] = function, words
        return function

    return add


# What has the values of Python.


@allowed
def circular_of_numpy(s, k):
    return np.sin(s.x) + 2.0 * np.cos(s.y) + np.arctan(s.z) + np.tanh(s.x)


@allowed
def powers_of_numpy(s, k):
    return np.exp(s.x) + np.exp(-20.0 * np.abs(s.y)) * 1e3 + np.expm1(s.z) + np.sqrt(np.square(s.x) + 1.0)


@allowed
def extremes_of_numpy(s, k):
    return np.maximum(s.x, 0.5) + np.minimum(s.y, s.z)


@allowed
def arithmetic(s, k):
    return s.x + 2.0 * s.y - s.z / 3.0 + -s.x + +s.y


@allowed
def chained(s, k):
    return (1.0 if 0.0 < s.x < 1.0 else 2.0) + (4.0 if s.x <= s.y + 1.0 < s.z else 8.0)


@allowed
def powers(s, k):
    return s.x**2 + s.y**3 - s.z**1


@allowed
def comparisons(s, k):
    return (1.0 if s.x < s.y else 2.0) + (4.0 if s.y >= s.z else 8.0)


@allowed
def truth_as_a_number(s, k):
    return (s.x > 0.0) * 3.0 + (s.y > 0.0) - 2.0 * (s.z > 0.0)


@allowed
def sum_of_truths(s, k):
    return sum([s.x > 0.0, s.y > 0.0, s.z > 0.0])


@allowed
def truth_of_a_number(s, k):
    return (1.0 if s.x else 2.0) + (4.0 if not s.y else 8.0)


@allowed
def number_as_a_condition(s, k):
    force = 0.0
    if s.z:
        force = 3.0
    return force


@allowed
def and_of_numbers(s, k):
    return (s.x and s.y) + (s.y or s.z)


@allowed
def and_of_truth_and_number(s, k):
    return (s.x > 0.0 and 3.0) + (s.x > 0.0 and s.y) + (s.y > 0.0 or 5.0) + (s.z > 0.0 or s.x)


@allowed
def and_with_options(s, k):
    return (1.0 if k > 1 and s.x > 0.0 else 2.0) + (4.0 if s.x > 0.0 and k > 5 else 8.0) + (s.y if k and s.y > 0 else 0)


@allowed
def or_of_truths(s, k):
    return 1.0 if s.x > 0.0 or s.y > 0.0 or not s.z > 0.0 else 0.0


@allowed
def truth_kept_under_a_name(s, k):
    falls = s.x > 0.0
    if s.y > 0.0:
        falls = s.z > 0.0
    return 2.0 if falls else 3.0


@allowed
def truth_chosen(s, k):
    falls = s.x > 0.0 if s.y > 0.0 else s.z > 0.0
    return 2.0 if falls else 3.0


@allowed
def truth_or_a_constant(s, k):
    falls = False
    if s.y > 0.0:
        falls = s.z > 0.0
    return 2.0 if falls and s.x > -3.0 else 3.0


@allowed
def branch(s, k):
    force = 0.0
    if s.x > 0.0:
        force = 3.0 * s.x
        force = force * force
    elif s.y > 0.0:
        force = s.y
    else:
        force -= 1.0
    return force


@allowed
def nested_branches(s, k):
    a, b = 0.0, 1.0
    if s.x > 0.0:
        a = 2.0
        if s.y > 0.0:
            b = a + s.y
        else:
            a += s.z
    return a + 10.0 * b


@allowed
def augmented(s, k):
    total = s.x
    total += s.y
    total *= 2.0
    total -= s.z
    total /= 4.0
    total **= 2
    return total


@allowed
def annotated(s, k):
    total: float = s.x
    more: float
    more = total + 1.0
    return total + more


@allowed
def walrus(s, k):
    return (twice := 2.0 * s.x) + twice


@allowed
def walrus_in_a_test(s, k):
    return (twice if (twice := 2.0 * s.x) > 1.0 else -twice) + twice


@allowed
def walrus_under_an_option(s, k):
    a = 1.0
    b = (a := 2.0) if k > 1 else 3.0
    return a + b * s.x


@allowed
def chosen_tuple(s, k):
    a, (b, c) = (s.x, (1.0, 2.0)) if s.y > 0.0 else (s.z, (3.0, s.x))
    return a + b * c


@allowed
def joined_tuple(s, k):
    pair = (1.0, s.x)
    if s.y > 0.0:
        pair = (s.z, 2.0)
    return pair[0] * 10.0 + pair[1]


@allowed
def chosen_named_tuple(s, k):
    pair = Pair(s.x, 1.0) if s.y > 0.0 else Pair(2.0, s.z)
    return pair.one - pair.two


@allowed
def swapped(s, k):
    a, b = s.x, s.y
    if s.z > 0.0:
        a, b = b, a
    return a - 2.0 * b


@allowed
def starred(s, k):
    first, *rest = [s.x, s.y, s.z]
    return first * rest[0] - rest[-1]


@allowed
def less_of_nothing(s, k):
    return (0.0 - s.x) * s.y + (s.z - 0.0)


@allowed
def extremes(s, k):
    return max(s.x, s.y, 0.5) + min(s.z, s.x) + max([s.x, s.z]) + min(v for v in (s.x, s.y)) + max(k, 1)


@allowed
def extremes_of_plain_numbers(s, k):
    return max([1, 2, 3], default=0) + max("ab", key=len, default="").count("a") + min(3, k) + s.x


@allowed
def loops(s, k):
    total = 0.0
    for n in range(4):
        if n == 3:
            break
        if n == 1:
            continue
        total = total + n * s.x
    else:
        total = 100.0
    return total


@allowed
def breaking_beside_values(s, k):
    total = 0.0
    for n in range(5):
        if n > k:
            total = total + (s.x if s.y > 0.0 else s.z)
            break
        if s.x > 0.0:
            total = total + n
    return total


@allowed
def loop_in_a_side(s, k):
    total = 0.0
    if s.x > 0.0:
        for n in range(5):
            if n == 3:
                break
            total += n * s.y
    return total


@allowed
def while_on_options(s, k):
    n, total = 0, s.x
    while n < k:
        total, n = total * s.y, n + 1
    return total


@allowed
def return_under_an_option(s, k):
    if k > 1:
        return s.x * 2.0
    return s.y


@allowed
def comprehensions(s, k):
    weights = {name: value * s.x for name, value in TABLE.items()}
    return sum(w for w in weights.values()) + sum([v * v for v in (s.x, s.y) for _ in range(2)])


@allowed
def list_made_in_a_side(s, k):
    force = 0.0
    if s.x > 0.0:
        terms = []
        terms.append(s.x)
        terms.append(s.y)
        terms[0] = terms[0] * 2.0
        force = sum(terms)
    return force


@allowed
def stores_outside_of_conditions(s, k):
    forces = [0.0, 0.0]
    for n in range(2):
        forces[n] = GAINS[n] * s.x
    forces.append(s.y)
    forces += [s.z]
    out = {"a": sum(forces)}
    out["b"] = 1.0
    out |= {"c": s.x}
    out.update(d=2.0)
    return sum(out.values())


@allowed
def stores_under_an_option(s, k):
    forces = []
    if k > 1:
        forces.append(s.x)
        forces[0] = forces[0] * 2.0
    del k
    return sum(forces)


@allowed
def functions_within(s, k):
    gain = 2.0

    def scaled(v):
        return gain * v

    gain = 3.0
    return scaled(s.x) + (lambda v: v - gain)(s.y)


@allowed
def function_under_an_option(s, k):
    gain = 2.0
    if k > 1:
        import math as mathematics

        def scaled(v):
            return gain * v * mathematics.pi
    else:
        scaled = None
    gain = 5.0
    return scaled(s.x)


@allowed
def closure_that_counts(s, k):
    count = 0

    def next_gain():
        nonlocal count
        count += 1
        return float(count)

    return next_gain() * s.x + next_gain() * s.y


@allowed
def helpers(s, k):
    return plain_helper(s.x) + plain_helper(s.y, b=0.5) + sign(s.z) * 3.0


@allowed
def helper_in_a_side(s, k):
    force = 0.0
    if s.x > 0.0:
        force = plain_helper(s.y) * sign(s.z)
    return force


@allowed
def recursion(s, k):
    def power(v, n):
        return v if n == 1 else v * power(v, n - 1)

    return power(s.x, 4)


@allowed
def defaults_of_the_definition(s, k, gains=tuple(GAINS)):
    return gains[0] * s.x + gains[1] * s.y


@allowed
def functions_of_the_library(s, k):
    sine, cosine = sincos(s.x)
    return sine + cosine * tanh(s.y) + sqrt(s.z * s.z + 1.0) + expm1(-(s.x * s.x)) + fma(s.x, s.y, s.z)


@allowed
def numbers_of_numpy(s, k):
    return np.float64(2.0) * s.x + s.y * np.float64(0.5) - np.pi + np.float64(1.0) / (2.0 + s.z * s.z)


@allowed
def compared_with_numbers_of_numpy(s, k):
    return 1.0 if np.float64(0.25) < s.x else np.float64(2.0) - s.y


@allowed
def arrays_of_values(s, k):
    v = np.array([s.x, s.y, s.z])
    return (v * v).sum() + v @ np.array([1.0, 2.0, 3.0])


@allowed
def is_a_float(s, k):
    return (s.x if isinstance(s.x, float) else 100.0) + (s.y if not isinstance(s.y, (int, str)) else 50.0)


@allowed
def matched(s, k):
    match k:
        case 1:
            gain = 1.0
        case int(n):
            gain = 10.0 * n
    return gain * s.x


@allowed
def absolute(s, k):
    return abs(s.x) * abs(-2.0) - abs(s.y - s.z)


@allowed
def own_name_like_a_function(s, k):
    max = 3.0
    select, branch = 2.0, 4.0
    return max * s.x + select * branch


@allowed
def compared_with_no_number(s, k):
    return s.x if s.x is not None and s.y != None else 7.0


@allowed
def unpacked_arguments(s, k):
    return plain_helper(*(s.x,), **{"b": s.y})


@allowed
def deep_condition(s, k):
    return 1.0 if s.x > 0 else 2.0 if s.y > 0 else 3.0 if s.z > 0 else 4.0


@allowed
def conditions_in_comprehensions(s, k):
    return sum([v if v > 0.0 else -2.0 * v for v in (s.x, s.y, s.z) if k])


# What has not, or would run in every lane.

AT_VALUE = "under a condition on a value"


@refused(AT_VALUE)
def appends(s, k):
    extra = []
    if s.x > 0.0:
        extra.append(3.0)
    return sum(extra)


@refused(AT_VALUE)
def stores_an_element(s, k):
    extra = [0.0]
    if s.x > 0.0:
        extra[0] = 3000.0
    return extra[0]


@refused(AT_VALUE)
def stores_a_key(s, k):
    d = {}
    if s.x > 0.0:
        d["x"] = 1.0
    return d.get("x", 0.0)


@refused(AT_VALUE)
def stores_an_attribute(s, k):
    box = SimpleNamespace(x=0.0)
    if s.x > 0.0:
        box.x = 2.0
    return box.x


@refused(AT_VALUE)
def adds_to_an_element(s, k):
    d = {"x": 0.0}
    if s.x > 0.0:
        d["x"] += 1.0
    return d["x"]


@refused(AT_VALUE)
def updates(s, k):
    d = {"x": 0.0}
    if s.x > 0.0:
        d.update(x=1.0)
    return d["x"]


@refused(AT_VALUE)
def extends_in_place(s, k):
    extra = []
    if s.x > 0.0:
        extra += [3.0]
    return sum(extra)


@refused(AT_VALUE)
def merges_in_place(s, k):
    d = {"x": 0.0}
    if s.x > 0.0:
        d |= {"x": 1.0}
    return d["x"]


@refused(AT_VALUE)
def deletes(s, k):
    d = {"x": 1.0}
    if s.x > 0.0:
        del d["x"]
    return d.get("x", 5.0)


@refused(AT_VALUE)
def stores_by_unpacking(s, k):
    extra = [0.0, 0.0]
    if s.x > 0.0:
        extra[0], other = 1.0, 2.0
    return extra[0]


@refused(AT_VALUE)
def stores_by_a_loop(s, k):
    extra = [0.0]
    if s.x > 0.0:
        for extra[0] in (1.0, 2.0):
            pass
    return extra[0]


@refused(AT_VALUE)
def pops(s, k):
    extra = [1.0, 2.0]
    force = 0.0
    if s.x > 0.0:
        force = extra.pop()
    return force + sum(extra)


@refused(AT_VALUE)
def takes_the_next(s, k):
    gains = iter([1.0, 2.0])
    force = 0.0
    if s.x > 0.0:
        force = next(gains)
    return force + next(gains)


@refused(AT_VALUE)
def takes_the_next_of_a_generator(s, k):
    gains = (g for g in (1.0, 2.0))
    force = next(gains) if s.x > 0.0 else 0.0
    return force + next(gains)


@refused(AT_VALUE)
def appends_in_a_helper(s, k):
    extra = []
    force = 0.0
    if s.x > 0.0:
        force = appending(extra, 3.0)
    return force + len(extra)


@refused(AT_VALUE)
def appends_in_a_choice(s, k):
    extra = []
    force = appending(extra, 3.0) if s.x > 0.0 else 0.0
    return force + len(extra)


@refused("None where a number is wanted")
def appends_after_and(s, k):
    extra = []
    s.x > 0.0 and extra.append(3.0)
    return sum(extra)


@refused(AT_VALUE)
def appends_after_or(s, k):
    extra = []
    flag = s.x > 0.0 or appending(extra, 3.0) > 5.0
    return sum(extra) + (1.0 if flag else 0.0)


@refused(AT_VALUE)
def appends_in_a_comprehension(s, k):
    extra = []
    force = 0.0
    if s.x > 0.0:
        force = len([extra.append(g) for g in GAINS])
    return force + len(extra)


@refused(AT_VALUE)
def appends_to_what_is_outside(s, k):
    force = 0.0
    if s.x > 0.0:
        force = remembering(2.0)
    return force


@refused(AT_VALUE)
def appends_to_an_alias(s, k):
    extra = []
    if s.x > 0.0:
        mine = list()
        mine = extra
        mine.append(1.0)
    return sum(extra)


@refused(AT_VALUE)
def counts_in_a_closure(s, k):
    count = 0.0

    def counted(v):
        nonlocal count
        count = count + 1.0
        return v

    force = 0.0
    if s.x > 0.0:
        force = counted(2.0)
    return force + count


@refused(AT_VALUE)
def counts_in_an_object(s, k):
    counter = Counting()
    force = counter.add(2.0) if s.x > 0.0 else 0.0
    return force + counter.count


@refused(AT_VALUE)
def asks_a_property_with_an_effect(s, k):
    box = Doubled()
    force = 0.0
    if s.x > 0.0:
        force = box.value
    return force + box.asked


@refused(AT_VALUE)
def counts_letters(s, k):
    counter = Counter()
    force = 0.0
    if s.x > 0.0:
        counter["a"] += 1
        force = 2.0
    return force + counter["a"]


@refused(AT_VALUE)
def changes_an_array(s, k):
    v = np.zeros(3)
    if s.x > 0.0:
        v[:] = 1.0
    return float(v.sum())


@refused(AT_VALUE)
def fills_an_array_by_name(s, k):
    v = np.zeros(3)
    force = 0.0
    if s.x > 0.0:
        force = 1.0 if v.fill(1.0) is None else 0.0
    return force + float(v.sum())


@refused(AT_VALUE)
def extends_a_queue(s, k):
    queue = deque([1.0])
    force = 0.0
    if s.x > 0.0:
        force = queue.pop()
    return force + len(queue)


@refused(AT_VALUE)
def returns_early(s, k):
    if s.x > 0.0:
        return 1.0
    return 2.0


@refused(AT_VALUE)
def breaks(s, k):
    total = 0.0
    for n in range(3):
        if s.x > n:
            break
        total = total + 1.0
    return total


@refused(AT_VALUE)
def continues(s, k):
    total = 0.0
    for n in range(3):
        if s.x > n:
            continue
        total = total + 1.0
    return total


@refused(AT_VALUE)
def raises(s, k):
    if s.x > 0.0:
        raise ValueError("positive")
    return 1.0


@refused(AT_VALUE)
def asserts_in_a_side(s, k):
    if s.x > 0.0:
        assert k
    return 1.0


@refused(AT_VALUE)
def imports(s, k):
    if s.x > 0.0:
        import math as gain
    return 1.0


@refused(AT_VALUE)
def defines(s, k):
    scaled = plain_helper
    if s.x > 0.0:

        def scaled(v):
            return 5.0

    return scaled(s.y)


@refused(AT_VALUE)
def late_generator(s, k):
    gain, terms = 2.0, ()
    if s.x > 0.0:
        terms = (gain * g for g in GAINS)
    gain = 3.0
    return sum(terms)


@refused(AT_VALUE)
def walrus_in_a_side(s, k):
    y = 1.0
    z = (y := 2.0) if s.x > 0.0 else 3.0
    return y + z


@refused(AT_VALUE)
def walrus_after_and(s, k):
    y = 1.0
    z = s.x > 0.0 and (y := 2.0) > 1.0
    return y + (1.0 if z else 0.0)


@refused("which is there before and after a call|read again")
def counts_its_calls(s, k):
    STATE.calls = STATE.calls + 1.0
    return s.x


@refused("an earlier call|before and after a call|read again")
def keeps_a_value(s, k):
    before, STATE.last = STATE.last, s.x
    return s.x + (before if before is not None else 0.0)


@refused("read anew")
def random_number(s, k):
    return random.random() * s.x


@refused("read anew in every run")
def time_of_day(s, k):
    return time.perf_counter() * s.x


@refused("`global`")
def with_a_global(s, k):
    global GAIN
    GAIN = 3.0
    return GAIN * s.x


@refused("`try`")
def tries(s, k):
    try:
        force = 1.0 / s.x
    except ZeroDivisionError:
        force = 0.0
    return force


def dividing(v):
    try:
        return 1.0 / v
    except ZeroDivisionError:
        return 0.0


@refused("`try`")
def tries_in_a_helper(s, k):
    return dividing(s.x)


@functools.lru_cache
def remembered_division(v):
    try:
        return 1.0 / v
    except ZeroDivisionError:
        return 0.0


@refused("`try`")
def tries_in_a_cached_helper(s, k):
    return remembered_division(s.x)


class Dividing:
    def over(self, v):
        try:
            return 1.0 / v
        except ZeroDivisionError:
            return 0.0


DIVIDING = Dividing()


@refused("`try`")
def tries_in_a_method(s, k):
    return DIVIDING.over(s.x)


@refused("`with`")
def suppresses(s, k):
    force = 0.0
    with contextlib.suppress(ZeroDivisionError):
        force = 1.0 / s.x
    return force


@refused("condition on a value")
def loops_on_a_value(s, k):
    n = 0.0
    while s.x > n:
        n = n + 1.0
    return n


@refused("condition on a value")
def filters(s, k):
    return sum(v for v in (s.x, s.y) if v > 0.0)


@refused("condition on a value")
def sorts(s, k):
    return sorted([s.x, s.y])[0]


@refused("changes in time")
def equality(s, k):
    return (1.0 if s.x == s.y else 2.0) + (4.0 if s.x != 1.0 else 8.0) + (16.0 if 0.0 == s.z else 32.0)


@refused("changes in time")
def equality_without_a_condition(s, k):
    same = s.x == s.y
    return same * 3.0 + (s.z != 0.0)


@refused("changes in time")
def equality_in_a_part(s, k):
    return is_equal(s.x, s.y)


@refused("changes in time")
def finds(s, k):
    return 1.0 if s.x in (1.0, 2.0) else 0.0


@refused("condition on a value")
def asserts(s, k):
    assert s.x > -100.0
    return s.x


@refused("condition on a value")
def any_of(s, k):
    return 1.0 if any([s.x > 0.0, s.y > 0.0]) else 0.0


@refused("changes in time")
def matches_a_value(s, k):
    match s.x:
        case 0.0:
            return 1.0
        case _:
            return 2.0


@refused("a number is wanted")
def sine(s, k):
    return math.sin(s.x)


@refused("a value that is rounded")
def rounds(s, k):
    return round(s.x)


@refused("a whole number is wanted")
def whole(s, k):
    return int(s.x)


@refused("np.log of a value")
def logarithm_of_numpy(s, k):
    return np.log(s.x)


@refused("sin method; allowed on values")
def array_of_numpy(s, k):
    return np.sin(np.array([s.x, s.y]))[0]


@refused("text is wanted")
def formats(s, k):
    return 1.0 if f"{s.x}" else 2.0


@refused("text is wanted|output")
def prints(s, k):
    print("x is", s.x)
    return s.x


@refused("output")
def prints_a_word(s, k):
    print("here")
    return s.x


@refused("is_integer")
def asks_for_a_method(s, k):
    return 1.0 if s.x.is_integer() else 2.0


@refused("the power 0.5")
def root(s, k):
    return s.x**0.5


@refused("a power")
def power_of_two(s, k):
    return 2.0**s.x


@refused("found nan")
def not_a_number(s, k):
    return s.x * math.nan


@refused("found inf")
def infinite(s, k):
    return min(s.x, math.inf)


@refused("found nan")
def not_a_number_returned(s, k):
    return math.nan


@refused("found inf")
def overflows(s, k):
    return s.x * (1e308 * 10.0)


@refused("SystemExit: 7")
def leaves(s, k):
    sys.exit(7)


@refused("KeyboardInterrupt")
def interrupts(s, k):
    raise KeyboardInterrupt


@refused("ValueError: of its own")
def fails(s, k):
    raise ValueError("of its own")


@refused("one side of an `if`")
def absent(s, k):
    if s.x > 0.0:
        force = 1.0
    return force


@refused("one side of an `if`")
def absent_as_a_condition(s, k):
    if s.x > 0.0:
        force = 1.0
    return 1.0 if force else 2.0


@refused("one side of an `if`|found as")
def no_number_on_a_side(s, k):
    law = plain_helper
    if s.x > 0.0:
        law = sign
    return law(s.y)


@refused("number is wanted")
def text_chosen(s, k):
    word = "a" if s.x > 0.0 else "b"
    return TABLE[word]


@refused("outside|before and after a call|nonlocal")
def replaces_a_module_constant(s, k):
    GAINS[0] = GAINS[0] + 1.0
    return GAINS[0] * s.x


@refused("more than|do not end")
def endless_sum(s, k):
    total = s.x
    for n in itertools.count():
        total = total * s.y + n
    return total


@refused("do not end")
def endless(s, k):
    while True:
        k = 1
    return s.x
