"""Questions that a value cannot answer while equations are read, as which object it is: they are
refused in their line, also in helpers and on sides that do not hold at the start; what a value
answers means the same as with numbers."""

import pytest

import nsdrill
from nsdrill.equations import plain
from nsdrill.errors import NsdrillError

IMPORTS = """import enum
import math
import operator
import statistics
from numbers import Real


def hot(x):
    z = 1.0 if (x > 5.0) is False else -1.0
    return z


def kind(x):
    return -1.0 if isinstance(x, float) else 1.0


def matched(x):
    match x:
        case True:
            return 1.0
    return 2.0


class Kind:
    def __init__(self):
        self.law = hot


class Mode(enum.Enum):
    SLOW, FAST = 1, 2


LAWS, KIND = {"a": hot}, Kind()


"""
MODEL = "@nsdrill.model\ndef asks(x=1.0, *, k=1.0):\n    {}\n    return {{'x': k * z * (x + 0.1)}}\n"
SIDE = "z = -1.0 if x > 5.0 and {} else 1.0"
BY_OBJECT = {
    "z = -1.0 if (x > 5.0) is True else 1.0": "`is` or `is not`",
    "h = x > 5.0\n    z = 1.0\n    if h is not False: z = -1.0": "`is` or `is not`",
    "y = min(x, 5.0)\n    z = -1.0 if y is not x else 1.0": "`is` or `is not`",
    "match x > 5.0:\n        case True: z = -1.0\n        case _: z = 1.0": "`case` of `match`",
    "match (x > 5.0, x < 9.0):\n        case (True, _): z = -1.0\n        case _: z = 1.0": "`case` of `match`",
    "match x:\n        case float() if x > 5.0: z = -1.0\n        case _: z = 1.0": "`case` of `match`",
    SIDE.format("type(x) == float"): "`type`",
    SIDE.format("isinstance(x > 5.0, bool)"): "the type of a number",
    "z = -1.0 if isinstance(max(0, x - 5.0), float) else 1.0": "the type of a number",
    "z = kind(max(0, x - 5.0))": "the type of a number",
    "z = matched(x > 5.0)": "`case` of `match`",
    SIDE.format("not hasattr(x, 'graph')"): "`hasattr`",
    SIDE.format("getattr(x, 'op', 0) == 0"): "`getattr`",
    SIDE.format("operator.is_(x, x)"): "`operator.is_`",
    SIDE.format("(x > 5.0).__class__ == bool"): "`.__class__`",
    SIDE.format("np.asarray(x).dtype == float"): "`.dtype`",
    SIDE.format("len(locals()) > 3"): "`locals`",
    "z = hot(x)": "`is` or `is not`",
    "z = LAWS['a'](x)": "`is` or `is not`",
    "z = KIND.law(x)": "`is` or `is not`",
}  # fmt: skip
ASKED = {
    "z = {True: -1.0}.get(x > 5.0, 1.0)": "looked up in a dictionary",
    "z = -1.0 if (x > 5.0) in (True,) else 1.0": "found ==, != or `in`",
    "z = [x, 5.0].index(min(x, 5.0)) - 1.0": "found ==, != or `in`",
    "z = sorted([x, 5.0])[0]": "a condition on a value",
    "z = min([x, 5.0], key=abs)": "a condition on a value",
    "z = statistics.median([x, 1.0, 5.0])": "a condition on a value",
    SIDE.format("bool(x)"): "a condition on a value",
    SIDE.format("f'{x}' == '5'"): "where a text is wanted",
    SIDE.format("f'{x!r}' == '5'"): "where a text is wanted",
    SIDE.format("'%r' % x == '5'"): "where a text is wanted",
    SIDE.format("len(repr((x,))) < 5"): "where a text is wanted",
    SIDE.format("int(x)"): "where a whole number is wanted",
    SIDE.format("round(x)"): "a value that is rounded",
    SIDE.format("math.isclose(x, 7.0)"): "where a number is wanted",
    SIDE.format("np.isreal(x)"): "imag of a value",
    "try:\n        z = x\n    except ValueError:\n        z = 1.0": "found `try`",
}
SAME = (
    "z = 1.0 if x is None else -1.0",
    SIDE.format("isinstance(x, float)"),
    SIDE.format("Mode.FAST is not Mode.SLOW"),
    "match Mode.FAST:\n        case Mode(): z = 2.0 * x",
    SIDE.format("isinstance(x, (int, float))"),
    SIDE.format("isinstance(x, Real)"),
    SIDE.format("not isinstance(x, np.ndarray)"),
    SIDE.format("np.isscalar(x)"),
    SIDE.format("not hasattr(x, 'shape')"),
    SIDE.format("callable(x)"),
    "z = 1.0 - 2.0 * (x > 5.0)",
    "z = 1.0 - 2.0 * max(x > 5.0, 0)",
    "z = -1.0 if (x > 5.0) & (x < 9.0) else 1.0",
    "z = -1.0 if (x > 5.0) + (x > 6.0) > 1 else 1.0",
)


@pytest.mark.parametrize("body", [*BY_OBJECT, *ASKED])
def test_what_a_value_cannot_answer_is_refused(script, body):
    words = f"found {BY_OBJECT[body]}" if body in BY_OBJECT else ASKED[body]
    with pytest.raises(NsdrillError) as error:
        script(IMPORTS + MODEL.format(body), "asking")
    said = str(error.value)
    assert words in said
    assert "allowed" in said
    assert "asking.py, line " in said
    if body in BY_OBJECT:
        assert "which Python decides by the object and not by its number" in said


@pytest.mark.parametrize("body", SAME)
def test_what_a_value_answers_is_the_same_with_numbers(script, body):
    made = script(IMPORTS + MODEL.format(body), "asking").asks
    for x in (1.0, 5.5, 20.0):
        (slope,) = plain.values(made.reading.slopes, made.reading.given({"x": x}, {"k": 1.0})).values()
        assert float(slope) == pytest.approx(made(x)["x"], rel=1e-12)


@pytest.mark.parametrize("level", [0.5, 5.0, 50.0])
def test_equations_are_compared_with_numbers_away_from_the_start(script, level):
    """An int that Python divides by // where no text is read: what gives other slopes past a level
    is found at one of the places compared."""
    body = f"z = chosen(x > {level})"
    hidden = "chosen = eval('lambda c: -1.0 if c is True else 1.0')\n\n\n"
    with pytest.raises(NsdrillError, match=r"the slope of x -?\d\S* of numbers, and -?\d\S* in the equations"):
        script(hidden + MODEL.format(body), "asking")


def test_options_and_objects_of_a_model_may_be_asked(script):
    """Of a class its own methods ask what they are compared with: no number."""
    text = """class Rock:
    def __init__(self, hard):
        self.hard, self.kind = hard, type(self).__name__

    def __eq__(self, other):
        return isinstance(other, Rock) and self.hard == other.hard

    __hash__ = None


ROCK = Rock(2.0)


def force(x, scale=None):
    return x * (1.0 if scale is None else scale)


@nsdrill.model
def drilled(x=1.0, *, k=1.0):
    return (-k * (3.0 if ROCK == Rock(2.0) else 1.0) * force(x),)
"""
    made = script(text, "drilling").drilled
    assert made(2.0) == (-6.0,)
    assert isinstance(made.study(), nsdrill.study.study.Study)
