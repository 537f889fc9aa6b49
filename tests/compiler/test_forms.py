"""Equations in plain Python have the values of plain Python in every lane, or are refused
with file, line and remedy: forms of Python of every kind."""

import re
import sys
import threading
from types import SimpleNamespace

import numpy as np
import pytest

from nsdrill.abi import Layout
from nsdrill.compiler.language import LanguageError
from nsdrill.equations import effects, trace
from nsdrill.equations.motion import Motion
from nsdrill.equations.plain import values
from nsdrill.equations.trace import check_text, part, traced
from nsdrill.models.registry import described, model_named
from nsdrill.models.variant import variant_at

from . import forms

# Of each sign, zero, equal ones, and values beyond those in the forms.
POINTS = [
    (0.5, -1.5, 2.0), (-0.75, 1.25, 0.0), (1.0, 1.0, -1.0), (-2.0, -2.0, -0.5), (0.0, 2.5, 1.0), (3.0, 0.0, 0.25),
    (2.0, 2.0, 2.0), (-0.0, -3.0, -4.0),
]  # fmt: skip
NAMES = ("x", "y", "z")
OPTION = 2


def equations_of(function):
    form = part(function)

    def equations(t, phase, s, p, o):
        return {"v": form(s, o)}

    return equations


def wanted(function):
    """In the interpreter, with floats, point by point."""
    return [float(function(SimpleNamespace(**dict(zip(NAMES, point, strict=True))), OPTION)) for point in POINTS]


@pytest.mark.parametrize("name", forms.ALLOWED)
def test_every_lane_has_the_value_of_python(name):
    function = forms.ALLOWED[name]
    _, slopes, _ = traced(equations_of(function), NAMES, (), OPTION)
    given = {f"s.{n}": column for n, column in zip(NAMES, np.transpose(POINTS), strict=True)}
    found = np.broadcast_to(values(slopes, given)["v"], len(POINTS))
    assert found == pytest.approx(wanted(function), rel=1e-13, abs=1e-13)


def test_compiled_lanes_have_the_values_of_python():
    """All forms in one function, in lanes of one vector."""
    made = [part(function) for function in forms.ALLOWED.values()]
    names = tuple(f"out_{k}" for k in range(len(made)))

    def equations(t, phase, s, p, o):
        at = SimpleNamespace(x=s.x, y=s.y, z=p.z)
        return {"y": 0.0}, {name: form(at, o) for name, form in zip(names, made, strict=True)}

    rows = Layout(2, len(names), 1, 0)
    motion = Motion(equations, OPTION, NAMES[:2], NAMES[2:], ("y",), names)
    buffer = np.zeros((rows.total, len(POINTS)))
    buffer[rows.stage], buffer[rows.stage + 1], buffer[rows.parameter] = np.transpose(POINTS)
    flat = buffer.ravel()
    motion.right_hand_side(len(POINTS), rows)(flat)
    found = flat.reshape(buffer.shape)[rows.aux_now : rows.aux_now + len(names)]
    for name, function, lanes in zip(forms.ALLOWED, forms.ALLOWED.values(), found, strict=True):
        assert lanes == pytest.approx(wanted(function), rel=1e-13, abs=1e-13), name


@pytest.mark.parametrize("name", forms.REFUSED)
def test_what_would_have_other_values_is_refused_with_its_place(name, capsys, monkeypatch):
    monkeypatch.setattr(effects, "SECONDS", 0.5)
    function, words = forms.REFUSED[name]
    with pytest.raises(LanguageError) as caught:
        traced(equations_of(function), NAMES, (), OPTION)
    said = str(caught.value)
    assert re.search(words, said), said
    file, line = re.match(r"(.*?), line (\d+): ", said).groups()
    assert file in (forms.__file__, __file__)
    if file == forms.__file__ and "read again" not in said:
        first = function.__code__.co_firstlineno
        helpers = [forms.appending, forms.remembering, forms.dividing, forms.remembered_division.__wrapped__]
        helpers += [forms.Dividing.over, forms.is_equal.py_func]
        lines = {n for each in (function, *helpers) for _, _, n in each.__code__.co_lines() if n}
        assert int(line) in lines or int(line) > first + 1  # not that of the decorator or the name
    assert "allowed" in said or "of its own" in said
    assert capsys.readouterr() == ("", "")


def test_equality_of_what_is_given_is_that_of_python():
    """Of lane parameters, which do not change in a run."""

    def equations(t, phase, s, p, o):
        same = p.a == p.b
        return {"v": (1.0 if p.a == 2.0 else 2.0) + (4.0 if p.b != 1.0 else 8.0) + same * 16.0 + s.x}

    _, slopes, _ = traced(equations, ("x",), ("a", "b"), OPTION)
    found = values(slopes, {"s.x": 0.0, "p.a": np.array([2.0, 2.0, 1.0]), "p.b": np.array([2.0, 1.0, 1.0])})["v"]
    assert found == pytest.approx([1.0 + 4.0 + 16.0, 1.0 + 8.0, 2.0 + 8.0 + 16.0])


def test_equations_have_the_graph_of_their_text():
    """Names outside keep their meaning: a function called max, a name that the changed
    tree might have used, and constants that have changed since."""
    space = SimpleNamespace(gain=2.0)

    def max(a, b):
        return 3.0 * a + b

    def _select(a):
        return a * space.gain

    def equations(t, phase, s, p, o):
        return {"v": max(s.x, _select(s.y)) + (1.0 if s.x > 0.0 else 2.0)}

    for space.gain in (2.0, 5.0):
        _, slopes, _ = traced(equations, NAMES, (), OPTION)
        found = values(slopes, {"s.x": 1.5, "s.y": -1.0})["v"]
        assert found == 3.0 * 1.5 - space.gain + 1.0


@pytest.mark.parametrize("name", ["christoforou_yigit", "beam", "segments", "torsion"])
def test_the_models_are_read_as_those_of_other_packages_are(name, monkeypatch):
    """Twice alike, and without effects."""
    monkeypatch.setattr(trace, "is_foreign", lambda module: True)
    model = model_named(name)
    for variant in (default := variant_at(model, described(name).parameters()), default.implicit):
        motion = variant.motion
        graph, slopes, _ = traced(motion.equations, motion.states, motion.parameters, motion.options)
        assert slopes.keys() == {*motion.slopes}
        assert graph.names


def test_every_name_is_remembered_as_it_is_last():
    """However it is assigned; a trace shows it."""

    def equations(t, phase, s, p, o):
        added = 2.0 * s.x
        added += s.y
        annotated: float = s.x - s.y
        after = s.x
        if s.x > 0.0:
            after = s.y
        last = [each := 4.0 * s.x, s.y]
        for turned in last:  # noqa: B007
            pass
        return {"v": added + annotated + (bound := s.x * s.y) + bound + each + after}

    graph, _, _ = traced(equations, NAMES, (), OPTION)
    x, y = np.array([1.5, -2.0]), np.array([0.25, 3.0])
    names = ("added", "annotated", "after", "turned", "bound", "each")
    found = values({name: graph.names[name] for name in names}, {"s.x": x, "s.y": y})
    expected = (2 * x + y, x - y, np.where(x > 0, y, x), y, x * y, 4 * x)
    for name, value in zip(names, expected, strict=True):
        assert found[name] == pytest.approx(value), name


def test_what_other_threads_print_is_printed(capsys):
    """While equations are read in two threads, whichever ends first."""
    inner, outer, said = threading.Event(), threading.Event(), []

    def first():
        with effects.output_to(said.append):
            inner.set()
            outer.wait(10.0)
            print("mine", end="")

    thread = threading.Thread(target=first)
    thread.start()
    inner.wait(10.0)
    before = sys.stdout
    with effects.output_to(lambda text: said.append(text.upper())):
        print("here", end="")
    print("seen", end="")
    outer.set()
    thread.join()
    print(" too", end="")
    assert sys.stdout is not before
    assert [text for text in said if text] == ["HERE", "mine"]
    assert capsys.readouterr().out == "seen too"


@pytest.mark.parametrize("name", ["christoforou_yigit", "beam", "segments", "torsion"])
def test_the_equations_of_this_package_have_no_text_that_those_of_others_may_not_have(name):
    """They are not checked where they run, as that takes longer than all tracing."""
    check_text(model_named(name).equations)
