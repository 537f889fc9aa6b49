"""Compiled code is that of the present sources: in whatever way equations and compiled
functions hold a number, an edit is seen by the next process, and an unchanged source
compiles nothing."""

import ast
import compileall
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from py_compile import PycInvalidationMode

import numpy as np
import pytest
from pythons import SRC

from nsdrill import cache
from nsdrill.compiler import functions
from nsdrill.compiler.functions import BUFFER, compiled, define

# How a model may hold the number 40: lines of its file, and what gives the number.
WAYS = {
    "a number of the module": ("K = 40.0", "K"),
    "a default": ("def k(x=40.0):\n    return x", "k()"),
    "a default of a part": ("@part\ndef k(x=40.0):\n    return x", "k()"),
    "the body of a part": ("@part\ndef k():\n    return 40.0 if True else 3.0", "k()"),
    "a function of a function": ("def inner():\n    return 40.0\ndef k():\n    return inner()", "k()"),
    "a closure": ("def made(x):\n    def k():\n        return x\n    return k\nk = made(40.0)", "k()"),
    "a partial function": ("k = functools.partial(operator.mul, 40.0)", "k(1.0)"),
    "an attribute of a class": ("class Rock:\n    k = 40.0", "Rock.k"),
    "an attribute of an instance": ("class Rock:\n    def __init__(self):\n        self.k = 40.0\nR = Rock()", "R.k"),
    "the body of a method": ("class Rock:\n    def k(self):\n        return 40.0\nR = Rock()", "R.k()"),
    "a method of a base": (
        "class Base:\n    def k(self):\n        return 40.0\nclass Rock(Base):\n    pass\nR = Rock()",
        "R.k()",
    ),
    "a call of an instance": ("class Rock:\n    def __call__(self):\n        return 40.0\nR = Rock()", "R()"),
    "a property": ("class Rock:\n    @property\n    def k(self):\n        return 40.0\nR = Rock()", "R.k"),
    "a static method": ("class Rock:\n    @staticmethod\n    def k():\n        return 40.0", "Rock.k()"),
    "a class method": ("class Rock:\n    @classmethod\n    def k(cls):\n        return 40.0", "Rock.k()"),
    "an operator of an instance": (
        "class Rock:\n    def __mul__(self, x):\n        return 40.0 * x\nR = Rock()",
        "R * 1.0",
    ),
    "a field of a dataclass": ("@dataclasses.dataclass\nclass Rock:\n    k: float = 40.0\nR = Rock()", "R.k"),
    "a method of a named tuple": (
        "class Rock(typing.NamedTuple):\n    a: float\n    def k(self):\n        return 40.0 * self.a\nR = Rock(1.0)",
        "R.k()",
    ),
    "a set": ("K = {40.0}", "sum(K)"),
    "a fraction": ("K = fractions.Fraction(40)", "float(K)"),
    "an enumeration": ("class Rock(enum.Enum):\n    HARD = 40.0", "Rock.HARD.value"),
    "a remembered function": ("@functools.lru_cache\ndef k():\n    return 40.0", "k()"),
    "an attribute by its name": ("class Rock:\n    hard = 40.0\nNAME = 'hard'", "getattr(Rock, NAME)"),
    "a variable by its name": ("K = 40.0\nNAME = 'K'", "globals()[NAME]"),
    "a table in an object": (
        "class Rock:\n    def __init__(self):\n        self.table = {'k': np.array([1.0, 40.0])}\nR = Rock()",
        "R.table['k'][1]",
    ),
    "a table of objects": ("K = np.array([None, 40.0], dtype=object)", "K[1]"),
    "an attribute of a function": ("def f():\n    return 1.0\nf.k = 40.0", "f.k"),
    "a number of another file": ("import other", "other.K"),
    "an import inside": ("def k():\n    from other import K\n    return K", "k()"),
    "a data file": ("K = float((pathlib.Path(__file__).parent / 'other.py').read_text()[4:])", "K"),
    "a lambda": ("k = lambda: 40.0", "k()"),
    "the key of a dictionary": ("k = lambda: K['40.0']\nK = {'40.0': 3.0, '4.0': 5.0}", "k()"),
}
# The language of compiled functions has no imports and no variables by their names.
NOT_IN_THE_LANGUAGE = ("an import inside", "a variable by its name")
MODEL = """
import dataclasses, enum, fractions, functools, operator, pathlib, typing
import numpy as np
from nsdrill.compiler.functions import BUFFER, compiled
from nsdrill.equations.trace import part
{lines}

def equations(t, phase, s, p, o):
    return {{"speed": s.angle * ({number})}}

@compiled(BUFFER)
def function(b):
    b[0] = b[0] * ({number})
"""
PROGRAM = """
import importlib, json, sys
import numpy as np
from nsdrill.abi import Layout
from nsdrill.compiler import functions
from nsdrill.equations.motion import Motion

made, make, found = [], functions._made, {}
functions._made = lambda function, symbol: made.append(function.__name__) or make(function, symbol)
rows = Layout(2, 0, 0, 0)
for name in sys.argv[1:]:
    model = importlib.import_module(name)
    b = np.ones(rows.total)
    Motion(model.equations, (), ("angle", "speed"), (), ("speed",)).right_hand_side(1, rows)(b)
    found[name] = [b[rows.acceleration]]
    if hasattr(model, "function"):
        b = np.ones(1)
        model.function(b)
        found[name].append(b[0])
print(json.dumps([found, made]))
"""


def run(program: str, folder: Path, *names: str, source: Path = SRC) -> object:
    """What another process prints, which finds modules in ``folder``, and its cache."""
    env = os.environ | {
        "PYTHONPATH": f"{source}{os.pathsep}{folder}",
        "NUMBA_CACHE_DIR": str(folder / "cache"),
        "PYTHONDONTWRITEBYTECODE": "1",
    }
    words = [sys.executable, "-W", "error::nsdrill.errors.CacheWarning", "-c", program, *names]
    done = subprocess.run(words, env=env, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """The numbers of all ways and the functions that were compiled: at first, in the
    next process, and after the edit of each from 40 to 4."""
    folder, found = tmp_path_factory.mktemp("ways"), []
    for edited in (False, False, True):
        (folder / "other.py").write_text("K = 4.0\n" if edited else "K = 40.0\n")
        for number, (way, (lines, expression)) in enumerate(WAYS.items()):
            text = MODEL.format(lines=lines, number=expression)
            if way in NOT_IN_THE_LANGUAGE:
                text = text.split("@compiled")[0]
            (folder / f"way_{number}.py").write_text(text.replace("40", "4", 1) if edited else text)
        found.append(run(PROGRAM, folder, *(f"way_{number}" for number in range(len(WAYS)))))
    return found


@pytest.mark.parametrize("way", WAYS)
def test_an_edit_is_seen_by_the_next_process(way, runs):
    name = f"way_{list(WAYS).index(way)}"
    before, after = (3.0, 5.0) if way == "the key of a dictionary" else (40.0, 4.0)
    first, _, edited = (numbers[name] for numbers, _ in runs)
    assert set(first) == {before}
    assert set(edited) == {after}


def test_an_unchanged_source_compiles_nothing(runs):
    (first, made), (second, again), _ = runs
    assert 0 < made.count("right_hand_side") < 5  # most ways are one code
    assert "function" in made
    assert second == first
    assert again == []


@pytest.mark.usefixtures("empty_cache")
def test_what_a_function_refers_to_is_looked_at_again():
    """Else the code with the new number is kept under the name of the old one."""
    space = define("helper", "K = 40.0\ndef helper(x):\n    return x * K\n").__globals__
    helper, numbers = space["helper"], []
    for k in (40.0, 4.0, 40.0):
        space["K"] = k
        b = np.ones(1)
        compiled(BUFFER)(define("f", "def f(b):\n    b[0] = helper(b[0])\n", helper=helper))(b)
        numbers.append(b[0])
    assert numbers == [40.0, 4.0, 40.0]
    assert len(list(cache.cache_directory().iterdir())) == 2


@pytest.fixture
def empty_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(functions, "_addresses", {})


# An edit of the package itself: of which file, what it changes, and the function of a
# model in which that is seen.
EDITS = {
    "a ramp": ("models/ramp.py", "rate = 2.0 *", "rate = 2.5 *", "christoforou_yigit", "ramp"),
    "equations of torsion": (
        *("models/torsion.py", "-p.damping * s.bit_speed", "-2.0 * p.damping * s.bit_speed"),
        *("torsion", "right_hand_side"),
    ),
    "a law": ("models/friction.py", "weakened + numbers.dynamic)", "weakened)", "torsion", "right_hand_side"),
    "what turns": ("models/turning.py", "level=stuck)", "level=0.5)", "torsion", "observer"),
    "equations": (
        *("models/christoforou_yigit/equations.py", "stiffness = p.bending", "stiffness = 2.0 * p.bending"),
        *("christoforou_yigit", "right_hand_side"),
    ),
    "what is solved for": (
        *("models/christoforou_yigit/observed.py", "{omega: 1.0}", "{omega: 2.0}"),
        *("christoforou_yigit", "implicit"),
    ),
    "a traced channel": (
        *("models/christoforou_yigit/observed.py", "n.x * n.x + n.y * n.y", "n.x * n.x - n.y * n.y"),
        *("christoforou_yigit", "observer"),
    ),
    "a channel": (
        *("models/christoforou_yigit/observed.py", "twist + fma(", "twist + fma(2.0 * "),
        *("christoforou_yigit", "observer"),
    ),
    "equations of segments": (
        *("models/segments/equations.py", "(2.0 * pull", "(2.5 * pull", "segments", "right_hand_side"),
    ),
    "a rock": ("models/segments/rock.py", "closing + 1.0", "closing + 2.0", "segments", "right_hand_side"),
    "what segments show": (
        *("models/segments/observed.py", "n.drive_speed - n.set_speed", "n.drive_speed - 2.0 * n.set_speed"),
        *("segments", "observer"),
    ),
    "the angle of a bit that turns": (
        *("models/turning.py", "(phase + set_speed", "(phase + 2.0 * set_speed", "segments", "observer"),
    ),
    "equations of the beam": (
        *("models/beam/equations.py", "float(n**2) * p.structural", "float(n**3) * p.structural"),
        *("beam", "right_hand_side"),
    ),
    "what the beam shows": ("models/beam/observed.py", "return az * az", "return 2.0 * az * az", "beam", "observer"),
    "a function of equations": (
        *("equations/library.py", "fma(scaled, scaled, 1.0)", "fma(scaled, scaled, 2.0)"),
        *("christoforou_yigit", "observer"),
    ),
    "a derivative": (
        *("equations/passes.py", "(0.5 / self.graph.make", "(0.25 / self.graph.make", "christoforou_yigit", "tangent"),
    ),
    "an implicit stage": ("equations/stage.py", "SATURATION = 0.8", "SATURATION = 0.9", "torsion", "implicit"),
    "the pieces of code": ("equations/lanes.py", "PIECE = 200", "PIECE = 50", "christoforou_yigit", "right_hand_side"),
    "the loop": ("kernel/loop.py", "b[places[AT.step_] + i] = 0.0", "b[places[AT.step_] + i] = 1.0", "torsion", "loop"),
    "the controller": ("kernel/steppers.py", "GROWTH = 3.0", "GROWTH = 2.0", "torsion", "step"),
    "the inside of a step": ("observe/inside.py", "0.5 * c0,", "0.25 * c0,", "torsion", "observer"),
    "the exponent": ("observe/exponent.py", "+= 0.5 * log", "+= 0.25 * log", "christoforou_yigit", "deviation"),
    "contacts": ("observe/contacts.py", "h * (nodes[n]", "h * (2.0 * nodes[n]", "christoforou_yigit", "deviation"),
    "the marker": ("observe/marker.py", "PROMINENCE = 10.0", "PROMINENCE = 20.0", "torsion", "marker"),
    "the mathematics": (
        *("elementary.py", "-2.50507602534068634195e-08", "-2.5e-08", "christoforou_yigit", "right_hand_side"),
    ),
}
NAMED = """
import hashlib, json, sys
from nsdrill.compiler import identity, native
from nsdrill.kernel.loop import make_advance
from nsdrill.kernel.steppers import STEPPERS, make_step
from nsdrill.models.ramp import Ramps
from nsdrill.models.registry import described, model_named
from nsdrill.models.variant import variant_at
from nsdrill.sweep.work import Program, make_observers

found = {}
for name, which in json.loads(sys.argv[1]):
    model = described(name)
    variant = variant_at(model_named(model.name), model.parameters())
    program = Program(variant, which == "deviation")
    function = {
        "ramp": lambda: Ramps(variant).right_hand_side(8),
        "right_hand_side": lambda: variant.right_hand_side(8),
        "implicit": lambda: variant.implicit.right_hand_side(8),
        "tangent": lambda: variant.tangent(8, 0),
        "observer": lambda: variant.observer(8)[0],
        "marker": lambda: variant.observer(8)[1],
        "deviation": lambda: make_observers(8, program)[0],
        "step": lambda: make_step(STEPPERS[program.stepper], 8, program.rows),
        "loop": make_advance,
    }[which]()
    text = native.Module(native.WIDTH).text(function.py_func, function.kinds, "entry")
    found[f"{name} {which}"] = [identity.key(function), hashlib.sha256(text.encode()).hexdigest()]
print(json.dumps(found))
"""


def named(source: Path, *functions: tuple[str, str]) -> dict[str, list[str]]:
    """The key and a digest of the text of these functions of models, in a package at
    ``source``."""
    found = run(NAMED, source.parent, json.dumps(functions), source=source)
    assert isinstance(found, dict)
    return found


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    """A copy of the package and what its functions are."""
    source = tmp_path_factory.mktemp("package") / "src"
    shutil.copytree(SRC / "nsdrill", source / "nsdrill", ignore=shutil.ignore_patterns("__pycache__", "static"))
    # to read the unchanged sources takes half of each process; an edited one is told by its hash
    compileall.compile_dir(source, quiet=1, invalidation_mode=PycInvalidationMode.CHECKED_HASH)
    return source, named(source, *dict.fromkeys(edit[3:] for edit in EDITS.values()))


@pytest.mark.parametrize("edit", EDITS)
def test_an_edit_of_the_package_is_another_function(edit, package):
    (source, before), (path, old, new, model, which) = package, EDITS[edit]
    file = source / "nsdrill" / path
    text = file.read_text()
    assert text.count(old) == 1
    file.write_text(text.replace(old, new))
    try:
        ((name, after),) = named(source, (model, which)).items()
    finally:
        file.write_text(text)
    assert after[0] != before[name][0]
    assert after[1] != before[name][1]


def test_a_remark_in_the_package_is_not(package):
    source, before = package
    texts = {path: path.read_text() for path in (source / "nsdrill").rglob("*.py") if path.parent.name != "compiler"}
    for path, text in texts.items():
        path.write_text(re.sub(r"^from __future__", "# A remark.\n\\g<0>", text, flags=re.MULTILINE))
    try:
        after = named(source, *(tuple(name.split()) for name in before))
    finally:
        for path, text in texts.items():
            path.write_text(text)
    assert after == before


def test_only_compiled_functions_have_no_types():
    """Their arguments are rows of a lane, whose types say nothing; mypy passes both."""
    untyped = []
    for file in (path for room in ("kernel", "observe") for path in (SRC / "nsdrill" / room).rglob("*.py")):
        text = file.read_text(encoding="utf-8")
        handed = set(re.findall(r"compiled\([^\n]*\)\((\w+)\)", text))
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.FunctionDef) and node.returns is None and node.name not in handed:
                marks = {ast.unparse(one).partition("(")[0] for one in node.decorator_list}
                if not marks & {"inlined", "compiled"}:
                    untyped.append(f"{file.name}, line {node.lineno}: {node.name}")
    assert untyped == []
