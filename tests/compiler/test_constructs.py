"""Every construct of the lane language does in machine code what it does in the
interpreter, to the bit, whatever the number of lanes and the width of vectors."""

import ast
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from nsdrill.compiler.functions import (
    BUFFER,
    FLOAT,
    FUNCTION,
    INTEGER,
    INTEGERS,
    bits_float,
    call,
    compiled,
    float_bits,
    fma,
    inlined,
    lowest_bit,
    masks,
    packed,
)
from nsdrill.compiler.language import carried

from .running import LANES, WIDTHS, bits, floats, machine_code, same, whole

# The buffer: three rows of any numbers, two of whole ones, then rows that are written.
ROWS = 14
TABLE = np.array([0.5, -0.0, np.inf, 3.0, 7.5, -2.0, 1e-300, 4.0, 9.0, 10.0])
GRID = np.array([[1.5, 2.5, 3.5], [4.5, 5.5, 6.5]])
WHOLE = (3, -1, 4, -1, 5, -9, 2, 6, 5, 3)
FLAGS = (True, False, True, True, False, True, False, True, True, False)


def buffer(rng: np.random.Generator, W: int) -> np.ndarray:
    made = [floats(rng, 3 * W), whole(rng, 2 * W), floats(rng, (ROWS - 5) * W)]
    return np.concatenate(made)


CONSTRUCTS: dict[str, Callable[[int], Any]] = {}


def construct(make: Callable[[int], Any]) -> Callable[[int], Any]:
    CONSTRUCTS[make.__name__] = make
    return make


# Loops over lanes.
@construct
def arithmetic(W):
    def f(b):
        for i in packed(W):
            x, y = b[i], b[W + i]
            b[5 * W + i], b[6 * W + i], b[7 * W + i] = x + y, x - y, x * y
            b[8 * W + i], b[9 * W + i] = x / y, -x
            b[10 * W + i] += 2 * x
            b[11 * W + i] = +3 - y
            b[12 * W + i] -= 1.0 / x

    return f


@construct
def comparisons(W):
    def f(b):
        for i in packed(W):
            x, y, z = b[i], b[W + i], b[2 * W + i]
            b[5 * W + i] = 1.0 if x < y else 0.0
            b[6 * W + i] = 1.0 if x <= y else 0.0
            b[7 * W + i] = 1.0 if x > y else 0.0
            b[8 * W + i] = 1.0 if x >= y else 0.0
            b[9 * W + i] = 1.0 if x == y else 0.0
            b[10 * W + i] = 1.0 if x != y else 0.0
            b[11 * W + i] = x if x < y <= z else z
            b[12 * W + i] = float(x > 0.0) + float(y >= 0)

    return f


@construct
def truths(W):
    def f(b):
        for i in packed(W):
            low, high, same = b[i] < b[W + i], b[W + i] > b[2 * W + i], b[i] == b[2 * W + i]
            b[5 * W + i] = 1.0 if (low and high) or same else 0.0
            b[6 * W + i] = 1.0 if not (low or not high) and not same else 0.0
            b[7 * W + i] = 1.0 if low == high else 0.0
            b[8 * W + i] = 1.0 if low != same else 0.0
            b[9 * W + i] = 1.0 if (low & high) | (low ^ same) else 0.0
            both = (1.0 if high else 2.0) if low else (3.0 if high else 4.0)
            b[10 * W + i], b[11 * W + i] = both, float(low) + float(int(high))

    return f


@construct
def extremes(W):
    """The first of equal ones, as Python has it: it decides on the sign of zero and on
    NaN."""

    def f(b):
        for i in packed(W):
            x, y, z = b[i], b[W + i], b[2 * W + i]
            b[5 * W + i], b[6 * W + i] = min(x, y), max(x, y)
            b[7 * W + i], b[8 * W + i] = min(x, y, z), max(z, 0.0, x, y)
            b[9 * W + i], b[10 * W + i] = max(min(1.0, x), 0.0), abs(y)
            m, n = int(b[3 * W + i]), int(b[4 * W + i])
            b[11 * W + i] = float(min(m, n, 3) - max(m, -2))

    return f


@construct
def rounding_and_roots(W):
    def f(b):
        for i in packed(W):
            x = b[i]
            b[5 * W + i], b[6 * W + i], b[7 * W + i] = np.sqrt(x), np.floor(x), np.rint(x)

    return f


@construct
def fused(W):
    def f(b):
        for i in packed(W):
            x, y, z = b[i], b[W + i], b[2 * W + i]
            b[5 * W + i] = fma(x, y, z)
            b[6 * W + i] = fma(x, 0.1, -z)
            b[7 * W + i] = fma(x, x, fma(-y, y, 1.0))
            b[8 * W + i] = fma(b[0], 3.0, z)

    return f


@construct
def integers(W):
    def f(b):
        for i in packed(W):
            m, n = int(b[3 * W + i]), int(b[4 * W + i])
            b[5 * W + i], b[6 * W + i] = float(m // n), float(m % n)
            b[7 * W + i] = float((m + n) * (m - 3) - -n)
            b[8 * W + i] = float((m & n) + (m | n) * 32 + (m ^ n) * 1024)
            b[9 * W + i] = float((m << 3) + (n >> 1) - m)
            b[10 * W + i] = float(m // 4) + float(-7 // n) + float(m % -4)
            b[11 * W + i] = 1.0 if m < n and m != 3 and n >= -m else b[i]

    return f


@construct
def bit_patterns(W):
    def f(b):
        for i in packed(W):
            x, y = abs(b[3 * W + i]), b[4 * W + i]
            b[5 * W + i] = bits_float(float_bits(x) ^ (float_bits(y) & -9223372036854775808))
            b[6 * W + i] = bits_float(float_bits(x) + (1 << 52))
            b[7 * W + i] = float((float_bits(y) >> 52) & 2047)

    return f


@construct
def the_index_of_the_lane(W):
    def f(b):
        for i in packed(W):
            j = 3 * W + i
            b[5 * W + i] = float(i) + float(2 * i + 1)
            b[6 * W + i] = 1.0 if i < 3 else b[j]
            b[7 * W + i] = float(i % 3) + float(1 << i)
            b[8 * W + i] = b[j + W] + b[j - W]
            b[W * 9 + i] = float(j)

    return f


@construct
def places_side_by_side(W):
    def f(b):
        for j in packed(5 * W, 8 * W - 1):
            b[j] = b[j - 5 * W] + 1.0
        for j in packed(13 * W, 13 * W + 1):
            b[j] = b[1]
        for j in packed(3):
            b[9 * W + j] = b[j]
        for j in packed(0):
            b[10 * W + j] = 1.0

    return f


@construct
def loops_in_a_loop_over_lanes(W):
    def f(b):
        for i in packed(W):
            total, x = 0.0, b[i]
            for k in range(3):
                total = total + x * b[k * W + i]
            b[5 * W + i] = total
            for k in range(20):
                total += x - float(k)
                x = x * 0.5 if total > 3.0 else x
            b[6 * W + i], b[7 * W + i] = total, x
            for k in range(20, 3, -2):
                for q in range(2, 12):
                    total = total * 0.5 + float(k * q)
            b[8 * W + i] = total
            for row, factor in ((0, 2.0), (W, 3.0)):
                b[9 * W + i] += factor * b[row + i]

    return f


@construct
def scalars_in_a_loop_over_lanes(W):
    def f(b):
        scale, limit = b[0] * 2.0, 1
        if b[1] > 0.0:
            scale = 3.0
            limit = 2
        for i in packed(W):
            b[5 * W + i] = scale * b[i] + float(limit)
            b[6 * W + i] = 4.0 if b[1] > 0.0 else b[i]
            b[7 * W + i] = b[i] if limit == 1 else scale
            first = scale
            b[8 * W + i] = first

    return f


# Sets of lanes.
@construct
def sets_of_lanes(W):
    def f(b):
        chosen, doubled, some, weight, known = 0, 0, 0, 0, 5
        for i in packed(W):
            chosen |= (1 << i) if b[i] > b[W + i] else 0
            moves = (1 << i) if b[i] > 0.0 else 0
            doubled |= moves if b[W + i] > 0.0 else 0
            some |= 1 if b[i] > 100.0 else 0
            weight |= 0 if b[i] > 500.0 else 4
            known |= 2
        doubled <<= 1
        b[5 * W], b[6 * W], b[7 * W] = float(chosen), float(doubled), float(some)
        b[8 * W], b[9 * W] = float(weight), float(known)
        while chosen != 0:
            i = lowest_bit(chosen)
            chosen &= chosen - 1
            if b[2 * W + i] < 0.0:
                continue
            if b[2 * W + i] > 800.0:
                break
            b[10 * W + i] += b[i]
            doubled ^= 1 << i
        b[11 * W] = float(doubled)

    return f


@construct
def masks_of_lanes(W):
    events = (0, 2)

    def f(b):
        sets = masks(3)
        for i in packed(W):
            sets[0] |= (1 << i) if b[i] > b[W + i] else 0
            sets[1] |= (1 << i) if b[i] > 100.0 else 0
            sets[2] |= 1 if b[W + i] > 100.0 else 0
            sets[1] |= 2
        some = 0
        if sets[1] != 0:
            found = masks(3)
            for k in events:
                some |= sets[k]
                found[k] = sets[k] & sets[1]
                b[(5 + k) * W] = float(found[k])
            b[8 * W] = float(found[1])
        b[9 * W], b[10 * W] = float(sets[0]), float(some)
        k = int(b[3 * W]) & 1
        b[11 * W] = float(sets[k])

    return f


@construct
def tuples_written_out(W):
    places, factors = (0, W, 2 * W), ((2.0, 1), (-1.0, 0))
    first, second = places[:2]

    def scaled(b, i):
        return 2.0 * b[i]

    def shifted(b, i):
        return b[i] + 1.0

    readers = (scaled, shifted)

    def added(*parts):
        total = 0.0
        for part in parts:
            total += part
        return total

    def difference(x, y):
        return x - y

    def f(b):
        for i in packed(W):
            values = tuple(b[place + i] for place in places)
            b[5 * W + i] = added(*values, 1.0)
            b[6 * W + i] = difference(*tuple(read(b, first + i) for read in readers))
            more = (*(values[1], values[2]), 3.0, b[second + i])
            total = 0.0
            for k, read in enumerate(readers):
                total = total * more[k] + read(b, second + i)
            b[7 * W + i] = total
            b[8 * W + i] = added(*tuple(factor * more[k] for factor, k in factors))
        i = int(b[3 * W]) & 1
        b[9 * W] = added(*tuple(float(k) * b[k + i] for k in range(3)))
        b[10 * W] = float(len(readers) + i)

    return f


@construct
def rows_of_lanes(W):
    def f(b):
        k = int(b[3 * W])
        row = (5 + (k & 3)) * W
        for i in packed(W):
            b[row + i] = b[(k & 1) * W + i] + 1.0
            b[row + W + i] -= b[i]
        part = b[row:]
        for i in packed(W):
            part[2 * W + i] = part[i]

    return f


# Scalars.
@construct
def loops(W):
    def f(b):
        n, total = int(b[4 * W]), 0.0
        for k in range(n):
            total += b[k] if k < 3 * W else 1.0
        b[5 * W] = total
        for k in range(n, 2, -3):
            total -= float(k)
        b[6 * W] = total
        count = 0
        for k in range(-n, n + 9, 2):
            for j in range(k):
                if j == 3:
                    continue
                if j > 5:
                    break
                count += j
            count += 1
        b[7 * W] = float(count)
        for k in range(6):
            if k == 4:
                break
            b[8 * W] = float(k)
        for k in range(8):
            b[9 * W] += float(k)
        for k in range(9):
            b[10 * W] += float(k)
        for _ in range(0):
            b[11 * W] = 1.0

    return f


@construct
def while_loops(W):
    def f(b):
        n, turns, x = int(b[3 * W]), 0, b[0]
        while turns < 20:
            turns += 1
            if turns == n:
                continue
            x = x * 0.75 + 1.0
            inner = 0
            while True:
                inner += 1
                if inner > turns or x > 3.0:
                    break
            if inner == 12:
                break
        b[5 * W], b[6 * W] = float(turns), x
        first, second = 0.0, 1.0
        while turns > 0:
            first, second = second, first + second
            turns -= 3
        b[7 * W], b[8 * W] = first, second

    return f


@construct
def branches(W):
    def f(b):
        x, k = b[0], int(b[3 * W])
        if x > 1.0:
            y, k = x, 2
        elif x < -1.0:
            y = -x
        else:
            y = 0.5
            if k > 0:
                k = 7
            else:
                pass
        b[5 * W], b[6 * W] = y, float(k)
        if k == 7:
            b[7 * W] = 3.0
        if W > 8:
            b[8 * W] = 1.0
        if not x > 1.0:
            for i in packed(W):
                b[9 * W + i] = y * b[i]
        b[10 * W] = 1.0 if 2 in (1, 2, 7) else 0.0  # known
        b[11 * W] = 1.0 if W not in (2, 7) else 0.0
        b[12 * W] = y if x > 0.0 else float(k)

    return f


@construct
def names_that_branches_and_loops_assign(W):
    def f(b):
        for k in range(20):
            last = b[k % 3]
        for k in range(3):
            b[5 * W] += last * float(k)
            last = b[k]
        b[6 * W] = last
        if b[0] > 1.0:
            if b[1] > 0.0:
                y = 1.0
            else:
                y = 2.0
        elif b[0] > 0.0:
            return
        else:
            y = 3.0
        b[7 * W] = y
        n = 0
        while True:
            z = y * 2.0
            n += 1
            if z > 3.0 or n > 3:
                break
            y = z
        b[8 * W] = z

    return f


@construct
def returns(W):
    def f(b):
        if b[0] > 1.0:
            b[5 * W] = 1.0
            return
        for k in range(12):
            if b[W] > float(k):
                b[6 * W] = float(k)
                return
        b[7 * W] = 2.0

    return f


@construct
def short_circuits(W):
    """What must not be evaluated lies outside the buffer."""

    def f(b):
        k = int(b[3 * W]) * 5
        is_inside = k >= 0 and k < len(b) and b[k] > 0.0
        b[5 * W] = 1.0 if is_inside else 0.0
        if k < 0 or k >= len(b) or (b[k] < 0.0 and b[0] > 0.0):
            b[6 * W] = 2.0
        while k >= 0 and k < len(b) and b[k] > 0.0:
            k += 3
        b[7 * W] = float(k)

    return f


@construct
def tables(W):
    pairs = ((1.0, 2), (3.0, 4))

    def f(b):
        k = (int(b[3 * W]) + 9) % 10
        b[5 * W], b[6 * W] = TABLE[k], float(WHOLE[k])
        b[7 * W] = 1.0 if FLAGS[k] else 2.0
        b[8 * W] = GRID[k & 1, k % 3] + GRID[1, 2]
        b[9 * W] = TABLE[3] + TABLE[-1] + pairs[1][0] + float(pairs[0][1])
        for i in packed(W):
            b[10 * W + i] = TABLE[k] * b[i]
        for q in range(len(WHOLE)):
            b[11 * W] += float(WHOLE[q]) * b[q % 3]
        for q in range(12):
            b[12 * W] += TABLE[q % 10]

    return f


@construct
def slices(W):
    def f(b):
        tail = b[2 * W :]
        k = int(b[4 * W]) & 3
        b[5 * W] = tail[k] + tail[W:][0] + float(len(tail)) + float(len(b[k:][1:]))
        other = b[6 * W :]
        other[0] = 4.0
        other[W] += other[0]

    return f


@construct
def conversions(W):
    def f(b):
        x = min(9.0, max(-9.0, b[0]))
        k = int(x * 1.5)
        b[5 * W], b[6 * W] = float(k), float(int(x < 0.0))
        b[7 * W] = np.float64(k) * float(x)
        b[8 * W] = 3 * b[1] + 1  # a constant integer stands for a float
        b[9 * W] = 2

    return f


@construct
def library(W):
    def f(b):
        x, y = b[3 * W] * 0.3, b[4 * W]
        b[5 * W], b[6 * W], b[7 * W] = math.sin(x), math.cos(y), math.exp(x)
        b[8 * W], b[9 * W], b[10 * W] = math.log(abs(x)), math.atan2(x, y), math.fmod(x, y)
        b[11 * W], b[12 * W] = math.sqrt(abs(x)), np.hypot(x, y)

    return f


# Calls.
@inlined
def weighed(x, y=2.0, *rest):
    """A helper with a default, more arguments and a tuple."""
    for other in rest:
        y = y + other
    return x * y, x - y


def halved(x, times=1):
    for _ in range(times):
        x = x * 0.5
    return x


@construct
def helpers(W):
    twice, thrice = lambda x: 2.0 * x, lambda x: 3.0 * x

    def clipped(x, least=0.0):
        return max(x, least)

    def choose(x, y, least=0.0):
        return clipped(x, least) if W > 1 else clipped(least=least, x=y)

    def f(b):
        k = int(b[3 * W])
        b[5 * W], b[6 * W] = weighed(b[0])
        b[7 * W], _ = weighed(b[0], b[1], b[2], 4.0)
        for i in packed(W):
            product, difference = weighed(b[i], y=b[W + i])
            b[8 * W + i] = halved(product, 3) + halved(difference)
            b[9 * W + i] = twice(b[i]) - thrice(b[W + i])
        b[10 * W] = twice(b[0]) + thrice(float(k))
        b[11 * W] = choose(b[0], b[1]) + choose(b[0], b[1], least=float(k))

    return f


@compiled(BUFFER, INTEGER, FLOAT)
def stored(b, place, x):
    b[place] = x
    return place + 1


@compiled(BUFFER)
def moved(b):
    for k in range(3):
        b[k] = b[k] + 1.0


@construct
def compiled_functions(W):
    def f(b):
        place = stored(b, 5 * W, b[0])
        place = stored(b, place, 2)
        moved(b[6 * W :])
        if b[0] > 0.0 and stored(b, 7 * W, 1.0) > 0:
            b[8 * W] = float(place)
        stored(b[9 * W :], stored(b, 10 * W, 3.0) - 10 * W - 1, -b[1])

    return f


@construct
def one_side_of_a_condition(W):
    """Of scalars the other side is not evaluated: it may lie outside the buffer, or
    change it."""

    def f(b):
        k = 5 * int(b[3 * W])
        b[5 * W] = b[k] if k >= 0 and k < len(b) else 0.5
        place = stored(b, 6 * W, 1.0) if b[0] > 0.0 else stored(b, 7 * W, 2.0)
        x, n = (b[W], 2) if place > 6 * W + 1 else (1, place if b[W] > 0.0 else 3)
        b[8 * W], b[9 * W] = x, float(n)
        b[10 * W] = (b[1] if b[1] > 1.0 else halved(b[2])) if b[0] < 0.0 else max(b[0], 3.0)

    return f


@construct
def documented(W):
    def f(b):
        """The text has no code."""
        x = b[0]
        "nor has this"
        y = z = x + 1.0
        b[5 * W] = y * z
        (b[6 * W], b[7 * W]), b[8 * W] = (1.0, 2.0), 3.0

    return f


@pytest.mark.parametrize("name", CONSTRUCTS)
@pytest.mark.parametrize("lanes", LANES)
def test_machine_code_does_what_the_interpreter_does(name, lanes):
    rng = np.random.default_rng(1)
    same(CONSTRUCTS[name](lanes), (buffer(rng, lanes) for _ in range(12)))


@compiled(INTEGERS, BUFFER)
def counted(m, b):
    m[0] += 1
    b[len(b) - 1] = float(len(m))


@compiled(BUFFER, INTEGERS, BUFFER, FUNCTION, INTEGER)
def of_integers(b, m, out, f, lanes):
    for k in range(len(m)):
        out[k] = b[m[k]] if m[k] < len(b) else -1.0
    size = m[1]
    for i in packed(16):
        m[i] = (m[16 + i] << 33) - m[i]
    m[31] //= -2
    part, rest = out[2:5], out[lanes : lanes + size]
    part[0], rest[1] = float(len(part)), float(len(rest))
    counted(m[4:], out[5:7])
    call(f, m[5 : 5 + size], out)
    return m[30] + len(m)


@pytest.mark.parametrize("width", WIDTHS)
def test_buffers_of_integers_and_parts_of_buffers(width):
    def run(function, f):
        m = np.concatenate([np.arange(16) * 3 % 8, 20 - np.arange(16)])
        out = np.zeros(32)
        given = function(np.arange(0.5, 6.0), m, out, f, 9)
        return given, m.tolist(), bits(out)

    native = machine_code(of_integers.py_func, of_integers.kinds, width)
    found = run(native, counted)
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(globals(), "counted", counted.py_func)
        assert found == run(of_integers.py_func, counted)
    assert max(found[1]) > 1 << 35


def test_a_buffer_has_the_type_that_is_asked_for():
    m, b = np.zeros(4, dtype=np.int64), np.zeros(4)
    for given in ((b, b), (m, m), (m.astype(np.int32), b), (m[::2], b), (m, b.reshape(2, 2).T)):
        with pytest.raises(TypeError, match=r"counted: a buffer is a contiguous array of \w+64"):
            counted(*given)


def test_a_function_that_is_an_argument_is_called():
    @compiled(BUFFER, FUNCTION, INTEGER)
    def twice(b, f, place):
        first = call(f, b, place, b[0])
        return call(f, b, first, 0.5) + 10

    @compiled(FUNCTION, FUNCTION, BUFFER, INTEGER)
    def outer(f, g, b, place):
        return call(g, b, f, place)

    b = np.arange(1.0, 6.0)
    assert outer(stored, twice, b, 2) == 14
    assert b.tolist() == [1.0, 2.0, 1.0, 0.5, 5.0]


@pytest.mark.parametrize("width", WIDTHS)
def test_arguments_and_results(width):
    """Numbers go in and an integer comes out, 0 where nothing is returned."""

    def added(x, k, b, y):
        b[k] = x * y
        if k > 1:
            return k + 40

    made = machine_code(added, FLOAT + INTEGER + BUFFER + FLOAT, width)
    b = np.zeros(3)
    assert [made(0.5, 2, b, 3.0), made(1, 0, b, -1.0), made(0.1, -1 + 2, b[1:], 0.2)] == [42, 0, 0]
    assert bits(b) == bits(np.array([-1.0, 0.0, 0.1 * 0.2]))


@pytest.mark.parametrize(
    ("body", "names"),
    [
        ("y = 1.0\nif c:\n    y = y + 1.0", set()),
        ("y = 1.0\nif c:\n    y = 2.0\nelse:\n    y = y + 1.0", set()),
        ("if c:\n    y = y + 1.0\nelse:\n    y = 2.0", {"y"}),
        ("y += 1.0", {"y"}),
        ("for k in (1, 2):\n    y = y + k", {"y"}),
    ],
)
def test_a_turn_carries_only_what_it_has_not_assigned(body, names):
    """What is assigned before an `if` needs no slot from the turn before."""
    assert carried(ast.parse(body).body) == names
