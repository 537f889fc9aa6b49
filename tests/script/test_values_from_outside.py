"""What a function takes from outside its arguments and constants: the environment, the time of
day, the command line, random numbers, and what differs between two processes. Each is refused
in its line, whatever name it goes by. What Python reads late is in the graph what it is in a
call."""

import re
import sys

import pytest

import nsdrill
from nsdrill.equations import plain
from nsdrill.errors import InputError

AROUND = """import importlib
import os
import random
import sys
import time
from datetime import datetime
from os import environ as held
from os import getenv

from scipy import stats

ENV, DATA, drawn = os.environ, [1.0, 2.0, 3.0, 5.0], stats.norm.rvs
ASKED = {"now": time.time}


def deep():
    return float(os.environ["HELD_OUTSIDE"])


"""
MODEL = "@nsdrill.model\ndef m(x=0.1, v=0.0, *, k=1.0):\n    a = {}\n    return v, -k * x - a * v\n"
OUTSIDE = (
    "float(os.environ['HELD_OUTSIDE'])", "float(os.environ.get('HELD_OUTSIDE', 1.0))", "float(held['HELD_OUTSIDE'])",
    "float(ENV['HELD_OUTSIDE'])", "2.0 if 'HELD_OUTSIDE' in os.environ else 1.0", "float(os.getenv('HELD_OUTSIDE'))",
    "float(getenv('HELD_OUTSIDE'))", "deep()", "float(os.path.expandvars('$HELD_OUTSIDE'))",
    "float(getattr(os, 'environ')['HELD_OUTSIDE'])", "len(os.path.abspath('.'))",
    "(lambda now: round(now(), -9))(time.time)", "[now := time.time, round(now(), -9)][1]", "int(time.strftime('%H'))",
    "len(time.ctime())", "time.perf_counter_ns() // 10**15", "round(time.process_time(), -3)",
    "round(getattr(time, 'time')(), -9)", "round(importlib.import_module('time').time(), -9)",
    "round(__import__('time').time(), -9)", "eval('round(time.time(), -9)')", "exec('import time') or 1.0",
    "(lambda now: now().year)(datetime.now)", "np.datetime64('today').astype(int) * 1.0",
    "len(sys.argv)", "len(sys.stdin.read())", "float(input())", "hash('abc') % 7", "id(nsdrill) % 7",
    "(lambda draw: draw(1).random())(random.Random)",
    "stats.norm.rvs()", "stats.norm(0, 1).rvs()", "drawn()", "stats.gaussian_kde(DATA).resample(1)[0, 0]",
    "stats.bootstrap((DATA,), np.mean).standard_error", "len(__file__)", "2.0 if __name__ == '__main__' else 1.0",
    "len(nsdrill.__version__)", "len(np.__file__)", "1.0 if sys.platform == 'linux' else 2.0", "len(os.name)",
    "float(sys.version_info[1])", "len(sys.path)", "float(sys.maxsize)", "time.timezone / 3600.0",
    "float(sys.getrecursionlimit())", "len(getattr(sys, 'platform'))",
)  # fmt: skip


@pytest.mark.parametrize("read", OUTSIDE)
def test_what_comes_from_outside_is_refused_in_its_line(script, monkeypatch, read):
    monkeypatch.setenv("HELD_OUTSIDE", "1.5")
    with pytest.raises(InputError, match=r"found what is read anew in every run, .*allowed: what follows") as error:
        script(AROUND + MODEL.format(read), "outside_of_it")
    place = re.match(r"\S*outside_of_it.py, line (\d+): (m|deep): ", str(error.value))
    assert place is not None
    lines = ("import numpy as np\nimport nsdrill\nfrom nsdrill import number\n\n\n" + AROUND + MODEL).splitlines()
    assert lines[int(place[1]) - 1].lstrip().startswith(("a = ", "return float(os.environ"))


IMPORTED = (
    ("from sys import platform", "2.0 if platform == 'linux' else 1.0", "platform, which is sys.platform"),
    ("from sys import maxsize as most", "float(most)", "most, which is sys.maxsize"),
    ("from os import *", "len(sep)", "sep, which is os.sep"),
    ("from time import timezone", "h()", "timezone, which is time.timezone"),
    ("from sys import getrecursionlimit", "float(getrecursionlimit())", "which is sys.getrecursionlimit"),
)


@pytest.mark.parametrize(("line", "read", "told"), IMPORTED)
def test_a_name_that_is_imported_of_the_machine_is_refused_as_its_attribute_is(script, line, read, told):
    text = f"{line}\n\n\ndef h():\n    return timezone / 3600.0\n\n\n{MODEL.format(read)}"
    with pytest.raises(InputError, match=r"found what is read anew in every run") as error:
        script(text, "imported_of_it")
    assert told in str(error.value)


HELPERS = {
    "from sys import platform\n": ("from machine_of import platform", "len(platform)"),
    "from sys import platform as where\n": ("from machine_of import where as here", "len(here)"),
    "from sys import *\nfrom sys import maxsize\n": ("from machine_of import *", "float(maxsize)"),
    "from sys import platform  # an attribute\n": ("import machine_of", "len(machine_of.platform)"),
}


@pytest.mark.parametrize("helper", HELPERS)
@pytest.mark.parametrize("is_nested", [False, True])
def test_a_name_of_the_machine_is_refused_through_a_module_of_the_model(
    script, tmp_path, monkeypatch, helper, is_nested
):
    """A module beside the script, or one behind that, imports it: the equations differ by the machine alike."""
    monkeypatch.syspath_prepend(tmp_path)
    for name in ("machine_of", "machine_behind"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    (tmp_path / "machine_behind.py").write_text(helper)
    names = "*" if "*" in helper else helper.split("as ")[-1].split()[-1] if " as " in helper else "platform"
    (tmp_path / "machine_of.py").write_text(f"from machine_behind import {names}\n" if is_nested else helper)
    line, read = HELPERS[helper]
    with pytest.raises(InputError, match=r"found what is read anew in every run"):
        script(f"{line}\n\n\n{MODEL.format(read)}", "through_a_module")
    for name in ("machine_of", "machine_behind"):
        sys.modules.pop(name, None)


def test_a_constant_of_a_module_of_the_model_is_taken(script, tmp_path, monkeypatch):
    """What it makes of the machine in a line of its own is a value, as above the function."""
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "constants_of.py").write_text("from sys import platform\n\nplatform = len(platform)\n")
    script(f"from constants_of import platform\n\n\n{MODEL.format('platform')}", "constant_of_a_module")
    sys.modules.pop("constants_of", None)


WITHIN = MODEL.format("platform").replace("    a =", "    platform = 3.0\n    a =")


@pytest.mark.parametrize(
    "text",
    [
        f"from sys import platform\n\nplatform = 2.0\n\n\n{MODEL.format('platform')}",
        f"from sys import platform\n\n\n{WITHIN}",
        f"from os import path\nfrom sys import float_info\n\n\n{MODEL.format('float_info.max')}",
    ],
)
def test_a_name_of_the_model_is_not_what_an_import_gave(script, text):
    """It is given another value, by a constant or in the function, or is the same everywhere."""
    script(text, "given_again")


def test_a_constant_that_is_read_above_the_function_is_in_what_is_computed(script):
    models = [
        script(f"C = {value}\n\n\n{MODEL.format('C')}".replace(" m(", f" m{value}("), f"constant_{value}")
        for value in (1, 2)
    ]
    one, other = (
        {**getattr(made, f"m{value}").reading.told_by_part}["the equations"] for value, made in enumerate(models, 1)
    )
    assert one != other


OWN = """class Rock:
    def rvs(self):
        return 2.0

    def twice(self):
        return 2.0 * self.rvs()

    @staticmethod
    def resample(y):
        return 3.0 * y


ROCK = Rock()


"""


@pytest.mark.parametrize(
    "read", ["Rock().rvs()", "ROCK.rvs()", "Rock.resample(x)", "ROCK.twice()", "(lambda r: r.rvs())(ROCK)"]
)
def test_a_method_of_the_user_is_judged_by_what_it_does(script, read):
    script(AROUND + OWN + MODEL.format(read), "of_the_user")


@pytest.mark.parametrize("read", ["Own().rvs()", "Wild().rvs()", "(lambda d: d.rvs())(stats.norm(0, 1))"])
def test_what_draws_by_a_class_of_the_user_is_refused(script, read):
    text = "class Own(stats.rv_continuous):\n    pass\n\n\n"
    text += "class Wild:\n    def rvs(self):\n        return random.random()\n\n\n" if "Wild" in read else ""
    with pytest.raises(InputError, match=r"found what is read anew in every run"):
        script(AROUND + text + MODEL.format(read), "drawn_of_it")


TEXT = "NOW, HELD, HASH = round(time.time(), -9), deep(), hash('a') % 7\n\n\n" + MODEL.format("NOW * HELD * HASH")


@pytest.mark.parametrize("text", [TEXT, MODEL.format("held").replace("k=1.0", "k=1.0, held=float(getenv(NAME))")])
def test_what_is_read_once_above_the_function_is_taken(script, monkeypatch, text):
    monkeypatch.setenv("HELD_OUTSIDE", "1.5")
    script(f"{AROUND}NAME = 'HELD_OUTSIDE'\n{text}", "outside_once")


@pytest.mark.parametrize("read", ["nsdrill.open_results('f.h5').x_max.item()", "h5py.File('f.h5')['x_max'][0]"])
def test_results_are_a_file_too(script, duffing, tmp_path, monkeypatch, read):
    monkeypatch.chdir(tmp_path)
    nsdrill.run(duffing.study(transient=0, observe=1), "f.h5", progress=False)
    with pytest.raises(InputError, match=r"outside_file.py, line \d+: m: .*found what is read anew in every run, "):
        script("import h5py\n\n\n" + MODEL.format(read), "outside_file")


@pytest.mark.parametrize(
    "read",
    ["stats.norm.cdf(0.3)", "sys.float_info.epsilon", "PLATFORM", "stats.norm(0, 1).pdf(0.1)", "os.path.sep == '/'"],
)
def test_what_is_the_same_in_every_run_is_taken(script, read):
    script(f"{AROUND}PLATFORM = len(sys.platform)\n\n\n{MODEL.format(read)}", "the_same")


HEAD = "import functools\n\n\n"
OF_PYTHON = {  # what reads a little surprisingly, and does in the graph what it does in a call
    "loop_around": "fs = []\nfor a in (1.0, 2.0):\n    fs.append(lambda y: a * y)\n"
    + MODEL.format("fs[0](x) + fs[1](v)"),
    "loop_within": MODEL.format("sum(f(x) for f in [lambda y: b * y for b in (1.0, 2.0)])"),
    "loop_bound": MODEL.format("sum(f(x) for f in [lambda y, b=b: b * y for b in (1.0, 2.0)])"),
    "default_emptied": (
        "def h(y, seen=[]):\n    seen.append(2.0)\n    found = y * sum(seen)\n    seen.clear()\n    return found\n\n\n"
        + MODEL.format("h(x)")
    ),
    "defined_again": f"def h(y):\n    return y\n\n\n{MODEL.format('h(x)')}\n\ndef h(y):\n    return 2.0 * y\n",
    "changed_below": f"C = [1.0]\n\n\n{MODEL.format('C[0] * x')}\n\nC[0] = 5.0\n",
    "cached": f"@functools.cache\ndef h():\n    return 3.0\n\n\n{MODEL.format('h() * x')}",
}


@pytest.mark.parametrize("how", OF_PYTHON)
def test_what_python_reads_late_is_in_the_graph_what_it_is_in_a_call(script, how):
    made = script(HEAD + OF_PYTHON[how], f"of_python_{how}").m
    made.study()  # reads what has changed
    slopes = plain.values(made.reading.slopes, made.reading.given({"x": 0.3, "v": 0.2}, {"k": 1.0}))
    assert [float(one) for one in slopes.values()] == pytest.approx(made(0.3, 0.2))


def test_models_of_a_loop_have_a_name_each(script):
    text = "for c in (1.0, 2.0):\n    @nsdrill.model\n    def m(x=0.1, v=0.0):\n        return v, -c * x\n"
    with pytest.raises(InputError, match="found a model with the name m, as in line 7; allowed: one of each name"):
        script(text, "models_of_a_loop")


def test_a_default_that_remembers_is_refused(script):
    text = "def h(y, seen=[]):\n    seen.append(1.0)\n    return y * len(seen)\n\n\n" + MODEL.format("h(x)")
    with pytest.raises(InputError, match="found a change of `h`, which is there before and after a call"):
        script(text, "remembering")


LOOKED_UP = ("TABLE.get(x, 5.0)", "TABLE[x]", "2.0 if x in TABLE else 1.0", "2.0 if k in {1.0, 2.0} else 1.0", "h(x)")


@pytest.mark.parametrize("read", LOOKED_UP)
def test_a_value_that_is_looked_up_is_refused(script, read):
    """A node is no key of a dictionary that has its number, so that the default was taken."""
    text = "TABLE = {0.1: 2.0}\n\n\n@functools.cache\ndef h(y):\n    return 2.0 * y\n\n\n" + MODEL.format(read)
    with pytest.raises(InputError, match=r"looked_up.py, line \d+: m: a = .*: found a value that is looked up in a"):
        script(HEAD + text, "looked_up")
