"""What is compiled again: all that a change may concern, and nothing else."""

import linecache
import os
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from pythons import SRC

from nsdrill import cache
from nsdrill.cache import cache_directory
from nsdrill.compiler import functions, identity, native
from nsdrill.compiler.functions import BUFFER, compiled, define
from nsdrill.compiler.language import LanguageError
from nsdrill.errors import InputError

TOY = '''
"""A module that a user may have."""
import numpy as np
import collections, enum, types
from nsdrill.compiler.functions import BUFFER, FLOAT, INTEGER, compiled, inlined
from nsdrill.compiler.functions import packed

FACTOR, PAIR, FLAG = 2.0, (1.0, (3, 4)), True
TABLE = np.arange(2000.0)
NAMED = {"gain": 5.0, "table": TABLE * 2.0}
AT = collections.namedtuple("AT", "one, two")(30.0, 31.0)
class Settings:
    gain = 7.0
    inner = types.SimpleNamespace(gain=8.0)
OTHER = types.ModuleType("other")
OTHER.gain = 9.0

@inlined
def helper(x, y=0.25):
    return x * y + second(x)

def second(x, *, scale=10.0):
    return scale * x

def made(number):
    @compiled(BUFFER)
    def scaled(b):
        """The documentation."""
        for i in packed(4):
            b[i] = number * helper(b[i]) + FACTOR
        b[0] += PAIR[1][0] * TABLE[1000] + NAMED["gain"] + NAMED["table"][1000]
        b[1] += Settings.gain + Settings.inner.gain + OTHER.gain + (1.0 if FLAG else 0.0)
        b[2] += AT.two
        inner(b, 1)
    return scaled

@compiled(BUFFER, INTEGER)
def inner(b, k):
    b[k] = b[k] * 0.5

@compiled(BUFFER)
def alone(b):
    b[0] = b[0] * 3.0

scaled = made(11.0)
'''
# Each changes what ``scaled`` computes.
CHANGES = {
    "a constant of the code": ("b[0] * 3.0", "b[0] * 3.5", "alone"),
    "a constant of the module": ("FACTOR, PAIR, FLAG = 2.0", "FACTOR, PAIR, FLAG = 2.5", "scaled"),
    "a part of a tuple": ("(3, 4)", "(2, 4)", "scaled"),
    "the order of names in a tuple": ("one, two", "two, one", "scaled"),
    "a truth": ("(3, 4)), True", "(3, 4)), False", "scaled"),
    "a number in a long table": ("np.arange(2000.0)\n", "np.arange(2000.0)\nTABLE[1000] = 0.5\n", "scaled"),
    "an entry of a dictionary": ('"gain": 5.0', '"gain": 5.5', "scaled"),
    "a table in a dictionary": ("TABLE * 2.0}", "TABLE * 2.5}", "scaled"),
    "an attribute of a class": ("gain = 7.0", "gain = 7.5", "scaled"),
    "an attribute of an object": ("gain=8.0", "gain=8.5", "scaled"),
    "an attribute of a module": ("OTHER.gain = 9.0", "OTHER.gain = 9.5", "scaled"),
    "a default of a helper": ("y=0.25", "y=0.75", "scaled"),
    "a named default": ("scale=10.0", "scale=10.5", "scaled"),
    "a helper": ("x * y +", "x * y -", "scaled"),
    "a helper of a helper": ("scale * x", "scale + x", "scaled"),
    "a compiled function that is called": ("b[k] * 0.5", "b[k] * 0.75", "scaled inner"),
    "a value of the closure": ("made(11.0)", "made(11.5)", "scaled"),
}  # fmt: skip
SAME = {
    "a comment": ("    b[k] =", "    # halved\n    b[k] ="),
    "lines before": ("FACTOR, PAIR", "\n\n\nFACTOR, PAIR"),
    "a name that is not used": ("import numpy", "unused = 3.0\nimport numpy"),
    "an attribute that is not used": ("    gain = 7.0", "    other = 1.0\n    gain = 7.0"),
}


def loaded(folder: Path, text: str) -> ModuleType:
    """The module of this text, as if it was imported."""
    path = folder / "toy.py"
    path.write_text(text)
    module = ModuleType("toy")
    exec(compile(text, str(path), "exec"), module.__dict__)
    return module


@pytest.fixture
def made(tmp_path, monkeypatch):
    """Runs the functions of a text in an empty cache as another process would: the names
    of those that were compiled, and the numbers."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setattr(functions, "_addresses", {})
    monkeypatch.setattr(cache, "_has_warned", False)
    names = []
    make = functions._made

    def watched(function, symbol):
        names.append(function.__name__)
        return make(function, symbol)

    monkeypatch.setattr(functions, "_made", watched)

    def run(text):
        names.clear()
        functions._addresses.clear()
        toy, b = loaded(tmp_path, text), np.arange(1.0, 5.0)
        for function in (toy.scaled, toy.alone):
            function(b)
        toy.inner(b, 2)
        return sorted(names), b.tolist()

    return run


@pytest.mark.parametrize("change", CHANGES)
def test_a_change_compiles_what_it_concerns(change, made):
    old, new, concerned = CHANGES[change]
    assert TOY.count(old) == 1
    first, before = made(TOY)
    assert first == ["alone", "inner", "scaled"]
    again, after = made(TOY.replace(old, new))
    assert again == sorted(concerned.split())
    assert after != before
    assert made(TOY) == ([], before)


@pytest.mark.parametrize("change", SAME)
def test_what_does_not_matter_compiles_nothing(change, made):
    old, new = SAME[change]
    assert TOY.count(old) == 1
    _, before = made(TOY)
    assert made(TOY.replace(old, new)) == ([], before)


def test_the_key_holds_kinds_width_and_platform(tmp_path, monkeypatch):
    toy = loaded(tmp_path, TOY)
    keys = {identity.key(toy.inner, *others) for others in ((16,), (8,), (16, "avx"))}
    toy.inner.kinds = "ad"
    keys.add(identity.key(toy.inner, 16))
    assert len(keys) == 4
    before = native.versions()
    monkeypatch.setattr(native, "host", lambda: ("triple", "another", ""))
    assert native.versions() != before


KEYS = """
import sys
sys.path.insert(0, {folder!r})
import toy
from nsdrill.compiler import identity
from nsdrill.models.registry import model_named
from nsdrill.kernel.steppers import STEPPERS, make_step, with_step
from nsdrill.models.variant import variant_of
model = model_named("torsion")
rows = with_step(STEPPERS["tsitouras"], variant_of(model).rows(variant_of(model).observed))
for function in (toy.scaled, toy.alone, variant_of(model).right_hand_side(8), *variant_of(model).observer(8),
                 make_step(STEPPERS["tsitouras"], 8, rows)):
    print(identity.key(function))
"""


def test_the_key_is_that_of_any_process(tmp_path):
    (tmp_path / "toy.py").write_text(TOY)
    found = set()
    for seed in ("0", "1"):
        env = {**os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": str(SRC)}
        program = [sys.executable, "-c", KEYS.format(folder=str(tmp_path))]
        found.add(subprocess.run(program, env=env, capture_output=True, text=True, check=True).stdout)
    assert len(found) == 1
    assert len(set(found.pop().split())) == 6


AT_ONCE = """
import sys
import numpy as np
sys.path.insert(0, {folder!r})
import toy
b = np.arange(1.0, 5.0)
sys.stdin.read(1)
toy.scaled(b), toy.alone(b), toy.inner(b, 2)
print(b.tolist())
"""


def test_processes_that_compile_at_once(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    (tmp_path / "toy.py").write_text(TOY)
    program = [sys.executable, "-W", "error", "-c", AT_ONCE.format(folder=str(tmp_path))]
    env = {**os.environ, "PYTHONPATH": str(SRC)}
    pipe = subprocess.PIPE
    children = [subprocess.Popen(program, env=env, stdin=pipe, stdout=pipe, text=True) for _ in range(3)]
    told = {child.communicate("x")[0] for child in children}
    assert [child.returncode for child in children] == [0, 0, 0]
    b = np.arange(1.0, 5.0)
    toy = loaded(tmp_path, TOY)
    toy.scaled(b), toy.alone(b), toy.inner(b, 2)
    assert told == {f"{b.tolist()}\n"}
    assert len(list(cache_directory().iterdir())) == 3


@pytest.mark.usefixtures("made")
def test_a_source_that_changed_after_the_import_is_told(tmp_path):
    """Its text is not what the function is, under whose key the code would be kept; nor
    where the numbers are equal and one is an integer."""
    toy = loaded(tmp_path, TOY)
    for other in ("3.5", "3"):
        (tmp_path / "toy.py").write_text(TOY.replace("b[0] * 3.0", f"b[0] * {other}"))
        linecache.clearcache()
        with pytest.raises(LanguageError, match=r"toy.py, line \d+: alone: .* has changed since it was imported"):
            toy.alone(np.zeros(4))
    again = loaded(tmp_path, TOY.replace("b[0] * 3.0", "b[0] * 4.0"))
    b = np.ones(4)
    again.alone(b)
    assert b[0] == 4.0


@pytest.mark.usefixtures("made")
def test_functions_that_call_each_other_are_told(tmp_path):
    text = "\ndef first(x):\n    return second(x)\ndef second(x):\n    return first(x)\n"
    toy = loaded(tmp_path, TOY.split("@inlined")[0] + text + "@compiled(BUFFER)\ndef f(b):\n    b[0] = first(b[1])\n")
    with pytest.raises(InputError, match="calls itself through another function"):
        toy.f(np.zeros(2))


def test_generated_functions_are_compiled_also_when_the_cache_of_lines_is_empty():
    function = define("f", "def f(b):\n    b[0] = 2.0 * b[0]\n")
    linecache.clearcache()
    b = np.array([3.0])
    compiled(BUFFER)(function)(b)
    assert b[0] == 6.0


def test_a_division_by_zero_does_not_end_the_process():
    function = define("f", "def f(b):\n    n = int(b[0])\n    b[1] = float(7 // n)\n    b[2] = float(7 % n)\n")
    b = np.array([0.0, 5.0, 5.0])
    compiled(BUFFER)(function)(b)
    assert b.tolist() == [0.0, 7.0, 0.0]
