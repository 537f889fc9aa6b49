"""What the lane language does not have is refused with file, line and statement, and
with what is allowed; above all every silent conversion."""

import math
from collections.abc import Iterator

import numpy as np
import pytest

from nsdrill.compiler.functions import (
    BUFFER,
    FLOAT,
    FUNCTION,
    INTEGER,
    INTEGERS,
    bits_float,
    compiled,
    define,
    float_bits,
    fma,
    lowest_bit,
    masks,
)
from nsdrill.compiler.language import LanguageError
from nsdrill.compiler.native import Module

TABLE, GRID = np.arange(4.0), np.ones((2, 2))


@compiled(BUFFER, INTEGER, FLOAT)
def known(b, n, x):
    return n


@compiled(BUFFER, FUNCTION)
def taking(b, f):
    return 0


def helper(x, y=1.0):
    return x * y


def early(x):
    if x > 0.0:
        return 1.0
    return 2.0


def itself(x):
    return itself(x)


NAMES = {name: globals()[name] for name in ("TABLE", "GRID", "known", "taking", "helper", "early", "itself", "np")} | {
    "math": math,
    "fma": fma,
    "lowest_bit": lowest_bit,
    "masks": masks,
    "float_bits": float_bits,
    "bits_float": bits_float,
}


def compile_text(body: str) -> str:
    """The module of a function of a buffer b, an integer n, a float x, a function g and
    a buffer of integers m."""
    lines = "".join(f"    {line}\n" for line in body.splitlines())
    function = define("f", f"def f(b, n, x, g, m):\n{lines}", **NAMES)
    return Module(8).text(function, BUFFER + INTEGER + FLOAT + FUNCTION + INTEGERS, "entry")


# Kinds. Where an expression of each kind is wanted: a float, an integer, a truth.
HOLES = {
    "d": [
        "b[0] = {}",
        "b[0] += {}",
        "b[0] = x + {}",
        "b[0] = {} * x",
        "b[0] = x / {}",
        "b[0] = min(x, {})",
        "b[0] = max({}, x, x)",
        "b[0] = x if n > 0 else {}",
        "b[0] = {} if n > 0 else x",
        "b[0] = fma(x, x, {})",
        "n = 1 if x < {} else 0",
        "n = 1 if {} == x else 0",
        "n = 1 if x > 0.0 and x != {} else 0",
        "y = 0.5\nif n > 0:\n    y = {}",
        "y = 0.5\nfor j in range(20):\n    y = {}",
        "y = 0.5\nwhile y < 1.0:\n    y = {}",
        "if n > 0:\n    y = 0.5\nelse:\n    y = {}",
        "known(b, n, {})",
        "for i in packed(8):\n    b[i] = {}",
        "for i in packed(8):\n    b[i] = b[i] - {}",
        "for i in packed(8):\n    b[i] = b[i] if b[i] > {} else 0.0",
    ],
    "i": [
        "b[{}] = 1.0",
        "x = b[{}]",
        "m[0] = {}",
        "m[0] += {}",
        "n = m[n] - {}",
        "for i in packed(8):\n    m[i] = m[8 + i] + {}",
        "n = n + {}",
        "n = {} & n",
        "n = n << {}",
        "n = n // {}",
        "n |= {}",
        "n = max(n, {})",
        "n = n if x > 0.0 else {}",
        "x = 1.0 if n == {} else 0.0",
        "k = 1\nif x > 0.0:\n    k = {}",
        "known(b, {}, x)",
        "return {}",
        "for i in packed(8):\n    b[i] = float(int(b[i]) + {})",
    ],
    "b": [
        "y = 1.0 if (x > 0.0) == {} else 0.0",
        "y = 1.0 if (x > 0.0) & {} else 0.0",
        "t = x > 0.0\nif n > 1:\n    t = {}",
    ],
}
# Constants here are what Python makes of them.
RUNTIME_HOLES = {
    "d": ["b[0] = np.sqrt({})", "b[0] = abs({})", "b[0] = math.sin({})", "n = float_bits({})"],
    "i": ["x = TABLE[{}]", "x = bits_float({})", "n = lowest_bit({})", "for j in range({}):\n    pass"],
    "b": [
        "if {}:\n    pass",
        "while {}:\n    pass",
        "y = 1.0 if {} else 0.0",
        "y = 1.0 if not {} else 0.0",
        "y = 1.0 if x > 0.0 and {} else 0.0",
        "for i in packed(8):\n    b[i] = 1.0 if b[i] > 0.0 or {} else 0.0",
    ],
}  # fmt: skip
VALUES = {"d": "x", "i": "n", "b": "(x > 1.0)"}
CONSTANTS = {"d": "1.5", "i": "2", "b": "True"}


def meetings() -> Iterator[tuple[str, str, bool]]:
    """A hole, what is put into it, and whether that is of the kind that is wanted."""
    for wanted, given in ((w, g) for w in "dib" for g in "dib"):
        for hole in (*HOLES[wanted], *RUNTIME_HOLES[wanted]):
            yield hole, VALUES[given], wanted == given
        for hole in HOLES[wanted]:
            fits = wanted == given or (wanted, given) == ("d", "i")
            yield hole, CONSTANTS[given], fits


def test_no_kind_becomes_another_silently():
    for hole, given, fits in meetings():
        body = hole.format(given)
        if fits:
            assert compile_text(body)
            continue
        with pytest.raises(LanguageError, match=r"^<.*>, line \d: f: .*: .*(is needed|meet in)") as caught:
            compile_text(body)
        line = 2 + hole.partition("{")[0].count("\n")
        assert f"line {line}: " in str(caught.value), body


# A body, whose line that is refused ends in "#!" where it is not the first; facts of
# the message.
REFUSED: list[tuple[str, str]] = [
    # operations
    ("x = x ** 2", "not defined for a float; allowed: a product."),
    ("x = x ** 2.5", "allowed: np.sqrt and products, or exp2(p * log2(x)) with exp2 and log2 of nsdrill.elementary"),
    ("x **= x", "allowed: np.sqrt and products, or exp2"),
    ("x = 1.0 + (x > 0.0)", "a float and a truth meet in one operation; allowed: float(x > 0.0)."),
    ("b[0] -= x > 0.0", "a float and a truth meet in one operation; allowed: float(x > 0.0)."),
    ("n *= x > 0.0", "an integer and a truth meet in one operation; allowed: int(x > 0.0)."),
    ("n = (x > 0.0) * 3", "an integer and a truth meet in one operation; allowed: int(x > 0.0)."),
    ("if x + (n > 0) > 1.0:\n    pass", "f: if x + (n > 0) > 1.0: a float and a truth meet"),
    ("x = float(n / 2)", "allowed: a division of floats"),
    ("x = x // 2.0", "allowed: of integers; of floats np.floor"),
    ("x = x % 2.0", "allowed: of integers; of floats np.fmod"),
    ("x = -(x > 0.0)", "not defined for a truth"),
    ("x = +(x > 0.0)", "not defined for a truth"),
    ("x = ~x", "not defined for a float"),
    ("x = float((x > 0.0) + (x > 1.0))", "not defined for a truth"),
    ("x = 1.0 if (x > 0.0) < (x > 1.0) else 0.0", "not defined for a truth"),
    ("x = x @ x", "not defined for a float"),
    ("n = n + (1 << 64)", "more than 64 bits"),
    ("b[0] = 9007199254740993", "is needed"),
    ("x = 1.0 / 0.0", "division by zero"),
    ("x = x + 1j", "where a number is needed"),
    ("b[0] = 'a'", "where a number is needed"),
    ("b[0] = None", "where a number is needed"),
    ("x = 1.0 if x is None else 0.0", "where a number is needed"),
    ("x = 1.0 + b", "a buffer stands where a number is needed"),
    ("return b", "a buffer stands where a number is needed"),
    ("return 1, 2", "where a number is needed"),
    ("x = x if x > 0.0 else (1.0, 2.0)", "where a number is needed"),
    ("x, _ = (1.0, x) if x > 0.0 else (1.0, 2.0, 3.0)", "different numbers of values"),
    # names
    ("x = undefined", "undefined is not defined"),
    ("x = np.undefined", "np.undefined is not defined"),
    ("x = b.size", "b.size is not defined"),
    ("x.y = 1.0", "x.y cannot be assigned to"),
    ("np.y = 1.0", "np.y cannot be assigned to"),
    ("z += 1.0", "z has no value here; allowed"),
    ("b[0], b[1] = x", "for 2 names"),
    ("b[0], b[1] = x, x, x", "for 2 names"),
    ("k = (1.0, 2.0)\nif x > 0.0:\n    k = (2.0, 1.0)  #!", "changes in a branch or loop; allowed: numbers"),
    ("k = b\nif x > 0.0:\n    k = b[1:]  #!", "changes in a branch or loop; allowed: numbers"),
    ("for j in range(3):\n    pass\nx = float(j)  #!", "has no value after it; allowed"),
    ("for j in range(20):\n    pass\nx = float(j)  #!", "has no value after it; allowed"),
    ("for i in packed(8):\n    k = b[i]\nx = k  #!", "has no value after it; allowed"),
    ("for i in packed(8):\n    pass\nx = float(i)  #!", "has no value after it; allowed"),
    *[
        (text, "y has no value here; allowed: a name that is assigned on every way here")
        for text in (
            "if x > 0.0:\n    y = 1.0\nb[0] = y  #!",
            "if x > 0.0:\n    pass\nelse:\n    y = 1.0\nb[0] = y  #!",
            "if x > 0.0:\n    y = 1.0\nelif x > -1.0:\n    y = 2.0\nb[0] = y  #!",
            "if x > 0.0:\n    y = 1.0\nelse:\n    b[0] = y  #!",
            "if x > 0.0:\n    y = 1.0\nif x > 0.0:\n    b[0] = y  #!",
            "while x > 0.0:\n    y = x = 0.0\nb[0] = y  #!",
            "for j in range(n):\n    y = 1.0\nb[0] = y  #!",
            "for j in range(20):\n    if j > 3:\n        b[0] = y  #!\n    y = 1.0",
        )
    ],
    # memory
    ("b[-1] = 1.0", "before the beginning of a buffer; allowed"),
    ("x = b[-1]", "before the beginning of a buffer; allowed"),
    ("for i in packed(8):\n    b[i] = b[i - 8]  #!", "before the beginning of a buffer; allowed"),
    ("b = x\nb[0] = 1.0  #!", "only elements of buffers can be assigned to"),
    ("TABLE[0] = 1.0", "only elements of buffers can be assigned to"),
    ("x = x[0]", "only buffers, tuples and tables have elements"),
    ("x = TABLE[7]", "out of bounds"),
    ("x = GRID[n]", "allowed: a loop of at most"),
    ("x = ('a', 'b')[n]", "allowed: a loop of at most"),
    ("x = (x, x)[n]", "allowed: a loop of at most"),
    ("x = b[:2][0]", "allowed: b[first:] or b[first:stop]"),
    ("x = b[::2][0]", "allowed: b[first:] or b[first:stop]"),
    ("x = b[-2:][0]", "before the beginning of a buffer; allowed"),
    ("x = b[1:-1][0]", "before the beginning of a buffer; allowed"),
    ("x = m[0]\nx = x + b[0]  #!", "an integer and a float meet in one operation; allowed"),
    ("m[1] = b[1]", "a float stands where an integer is needed; allowed: int(x)"),
    ("b[1] = m[1]", "an integer stands where a float is needed; allowed: float(x)"),
    ("x = b[x:][0]", "a float stands where an integer is needed; allowed: int(x)"),
    ("x = b[1:x][0]", "a float stands where an integer is needed; allowed: int(x)"),
    # loops over lanes
    ("for i in packed(n):\n    b[i] = 0.0", "a number that is known"),
    ("for i in packed(first=8):\n    b[i] = 0.0", "have no names"),
    ("for i in packed(8):\n    for j in packed(8):  #!\n        b[i] = 0.0", "in no other loop over lanes"),
    ("for i in packed(8):\n    if b[i] > 0.0:  #!\n        b[i] = 0.0", "allowed: x = a if c else b"),
    ("for i in packed(8):\n    while b[i] > 0.0:  #!\n        b[i] = 0.0", "allowed: the other way round"),
    ("for i in packed(8):\n    break  #!", "over lanes"),
    ("for i in packed(8):\n    continue  #!", "over lanes"),
    ("for i in packed(8):\n    return  #!", "a return in a loop over lanes"),
    ("for i in packed(8):\n    for j in range(n):  #!\n        b[i] = 0.0", "turns that is known"),
    ("for i in packed(8):\n    b[0] = b[i]  #!", "in every lane; allowed: b[row + i]"),
    ("for i in packed(8):\n    b[0] += 1.0  #!", "in every lane; allowed: b[row + i]"),
    ("for i in packed(8):\n    b[2 * i] = 1.0  #!", "allowed: b[row + i]"),
    ("for i in packed(8):\n    b[i] = TABLE[i]  #!", "another number in every lane; allowed: a scalar"),
    ("for i in packed(8):\n    b[i] = b[int(b[i])]  #!", "allowed: b[row + i]"),
    ("for i in packed(8):\n    b[i] = math.sin(b[i])  #!", "allowed: the functions of nsdrill.elementary"),
    ("for i in packed(8):\n    known(b, n, x)  #!", "where helpers are inlined"),
    ("for i in packed(8):\n    call(g, b)  #!", "where helpers are inlined"),
    ("k = 0.0\nfor i in packed(8):\n    k += b[i]  #!", "accumulate only sets"),
    ("k = 0\nfor i in packed(8):\n    k += 1 if b[i] > 0.0 else 0  #!", "accumulate only sets"),
    ("k = 0\nfor i in packed(8):\n    k |= 3 if b[i] > 0.0 else 1  #!", "a set of lanes is"),
    ("k = 0\nfor i in packed(8):\n    k |= int(b[i])  #!", "a set of lanes is"),
    ("for i in packed(8):\n    x = x + b[i]  #!\n    b[8 + i] = x", "from lane to lane; allowed"),
    ("for i in packed(8):\n    b[i] = x\n    x = b[8 + i]  #!", "from lane to lane; allowed"),
    ("k = 0\nfor i in packed(8):\n    k |= 1 if b[i] > 0.0 else 0\n    b[i] = float(k)  #!", "from lane to lane"),
    ("k = 0\nfor i in packed(8):\n    b[i] = float(k)\n    k |= 1 if b[i] > 0.0 else 0  #!", "from lane to lane"),
    # other loops
    ("for j in (1, 2):\n    break", "break or continue of a loop over a tuple"),
    ("for j in range(3):\n    pass\nelse:\n    pass", "a loop with else"),
    ("for j in x:\n    pass", "a loop is over packed(W), range(...) or a tuple"),
    ("for j in b:\n    pass", "a loop is over packed(W), range(...) or a tuple"),
    ("for j, k in range(20):\n    pass", "one index"),
    ("for j, k in ((1, 2, 3),):\n    pass", "do not fit its names"),
    ("for j in range(0, 20, n):\n    pass", "the step of a range is known"),
    ("for j in range(0, 20, 0):\n    pass", "must not be zero"),
    # calls
    ("known(b, n)", "known takes 3 arguments and is given 2"),
    ("known(x, n, x)", "another kind of argument"),
    ("known(b, b, x)", "another kind of argument"),
    ("known(m, n, x)", "another kind of argument"),
    ("taking(b, n)", "another kind of argument"),
    ("taking(b, known)", "known stands where a number is needed"),
    ("call(n, b)", "a function that is an argument"),
    ("call(known, b, n, x)", "a function that is an argument"),
    ("call(g, x > 0.0)", "a truth is no argument of a function; allowed: int(x)"),
    ("x = helper()", "missing a required argument: 'x'"),
    ("x = helper(x, x, x)", "too many positional arguments"),
    ("x = helper(x, z=2.0)", "unexpected keyword argument 'z'"),
    ("x = helper(x, x=2.0)", "multiple values for argument 'x'"),
    ("x = sum((x, x))", "a call of sum is not in the language of compiled functions; allowed: a loop, or the terms"),
    ("x = np.tan(x)", "a call of tan is not in the language of compiled functions; allowed: arithmetic, np.sqrt, "),
    ("x = float(len(x))", "one value has no length; allowed: a buffer or a tuple"),
    ("assert x > 0.0", "not known before it runs; allowed: an if"),
    ("assert len((x, x)) == 3, 'three are needed'", "three are needed"),
    ("x = tuple(y for y in x)[0]", "the items of a tuple, or of a range that is known"),
    ("x = tuple(b[k] for k in range(n))[0]", "a call of range is not in the language"),
    ("x = tuple(y for y in (x, x) if y > 0.0)[0]", "of one loop, without a condition"),
    ("x = tuple(y * z for y in (x, x) for z in (x, x))[0]", "of one loop, without a condition"),
    ("x = helper(*b)", "*b is of a tuple"),
    ("x = helper(*(x, x, x))", "too many positional arguments"),
    ("s = masks(n)", "masks(n) has a number that is known"),
    ("s = masks(2)\ns[0] |= x  #!", "an integer and a float meet in one operation"),
    ("s = masks(2)\nfor i in packed(8):\n    s[0] += 1 if b[i] > 0.0 else 0  #!", "accumulate only sets"),
    ("s = masks(2)\nfor i in packed(8):\n    s[0] |= 3 if b[i] > 0.0 else 1  #!", "a set of lanes is"),
    ("s = masks(1)\nfor i in packed(8):\n    b[i] = float(s[0])  #!", "in a loop over lanes; allowed: after it"),
    ("x = float((x, x))", "where a number is needed"),
    ("print(x)", "a call of print is not in the language"),
    ("b.sum()", "b.sum is not defined"),
    # what Python has besides
    *[
        (text, "not in the language of compiled functions; allowed: assignments, calls, if, for")
        for text in (
            "del x", "try:\n    pass\nexcept ValueError:\n    pass", "raise ValueError",
            "import math", "global z", "with x:\n    pass", "def h():\n    pass", "class C:\n    pass",
            "match n:\n    case 1:\n        pass",
        )
    ],
    *[
        (f"x = {text}", f"is no expression of the language of compiled functions; allowed: {instead}")
        for text, instead in (
            ("[y for y in (1.0, 2.0)][0]", "a loop, or the terms written out"),
            ("sum(x * y for y in (1.0, 2.0))", "a loop, or the terms written out"),
            ("(lambda y: y)(x)", "a function with a name"),
            ("float(f'{n}')", "numbers, names, arithmetic"),
            ("(y := x)", "an assignment before it"),
            ("{1: 2}[n]", "numbers, names, arithmetic"),
        )
    ],
]  # fmt: skip


@pytest.mark.parametrize(("body", "facts"), REFUSED, ids=[body for body, _ in REFUSED])
def test_what_the_language_does_not_have_is_refused(body, facts):
    lines = body.splitlines()
    number = next((k for k, text in enumerate(lines) if text.endswith("#!")), 0)
    with pytest.raises(LanguageError) as caught:
        compile_text(body)
    message = str(caught.value)
    assert message.startswith("<f ")
    assert f">, line {number + 2}: f: " in message
    assert facts in message
    assert message.endswith(".")
    assert "Value(" not in message


def test_a_refusal_in_a_helper_names_the_place_there():
    for name, statement in (("early", "return 1.0"), ("itself", "return itself(x)")):
        with pytest.raises(LanguageError) as caught:
            compile_text(f"x = {name}(x)")
        source = NAMES[name].__code__
        line = source.co_firstlineno + (2 if name == "early" else 1)
        assert str(caught.value).startswith(f"{__file__}, line {line}: {name}: {statement}: ")
        assert "allowed: " in str(caught.value)


def test_a_function_without_a_source_is_told():
    space = {}
    exec("def f(b):\n    pass\n", space)
    with pytest.raises(LanguageError, match=r"<string>, line 1: f: the source .*allowed: .*in a file"):
        Module(8).text(space["f"], BUFFER, "entry")


def test_what_is_asserted_and_holds_is_no_code():
    assert compile_text("assert len((x, x)) == 2, 'two are needed'\nb[0] = x") == compile_text("b[0] = x")
