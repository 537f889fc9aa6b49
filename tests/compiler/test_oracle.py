"""The same bits: native code against that of numba, of one width of vectors against another,
of other platforms; programs drawn at random; what is vectors."""

import os
import platform
import re
import subprocess
import sys
from collections.abc import Callable
from itertools import count
from pathlib import Path
from typing import Any

import llvmlite.binding as llvm
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from machine_code import instructions, machine, packed_and_single, text_of
from pythons import SRC
from strings import MAIN

from nsdrill.compiler import native
from nsdrill.compiler.functions import LaneFunction, define, lowest_bit
from nsdrill.compiler.native import Module
from nsdrill.kernel.loop import make_advance
from nsdrill.kernel.steppers import STEPPERS, make_step, with_step
from nsdrill.models.beam.columns import Options as Beam
from nsdrill.models.christoforou_yigit.columns import Options
from nsdrill.models.registry import model_named
from nsdrill.models.variant import variant_of
from nsdrill.observe import motion_kinds
from nsdrill.store import read_results
from nsdrill.variables import MODEL

from .oracle import CASES, functions_of, outcomes, run, works
from .running import WIDTHS, bits, floats, machine_code, same, whole

ALL = bool(os.environ.get("NSDRILL_TEST_ORACLE"))
QUICK = ["torsional_speed"]


def same_bits(one: np.ndarray, two: np.ndarray) -> bool:
    return bits(one) == bits(two)


@pytest.mark.timeout(3600)
@pytest.mark.parametrize("lanes", [1, 8, 16, 32] if ALL else [8])
@pytest.mark.parametrize("names", [[name] for name in CASES] if ALL else [QUICK], ids=" ".join)
def test_native_code_has_the_bits_of_numbas(names, lanes, tmp_path):
    file = tmp_path / "numba.npz"
    program = [sys.executable, Path(__file__).with_name("oracle.py"), file, str(lanes), *names]
    subprocess.run(program, env={**os.environ, "NSDRILL_COMPILER": "numba", "PYTHONPATH": str(SRC)}, check=True)
    with np.load(file) as made:
        wanted = dict(made)
    found = {
        f"{name}|{part}|{number}": buffer
        for name in names
        for part, (work, points) in enumerate(works(name))
        for number, buffer in enumerate(outcomes(work, points, lanes))
    }
    assert found.keys() == wanted.keys()
    assert len(found) > 80
    for key, buffer in found.items():
        assert same_bits(buffer, wanted[key]), key
    assert np.isfinite(np.concatenate(list(found.values()))).mean() > 0.9, "few numbers are NaN"

    run(tmp_path / "native.h5")
    native, numba = (read_results(tmp_path / f"{way}.h5") for way in ("native", "numba"))
    assert list(native.variables) == list(numba.variables)
    for name in native.variables:
        assert native[name].tobytes() == numba[name].tobytes(), name
    assert native["steps"].max() > 1000
    assert np.isfinite(native["zero_one"]).any()
    assert native["period"].max() == 1


@pytest.mark.parametrize("name", list(CASES) if ALL else ["exponent"])
@pytest.mark.parametrize("lanes", [1, 8, 32] if ALL else [8])
def test_the_bits_are_those_of_any_width(name, lanes):
    for work, points in works(name):
        runs = [
            outcomes(work, points, lanes, lambda f, width=width: machine_code(f.py_func, f.kinds, width))
            for width in (WIDTHS if lanes > 1 else (2, 16))
        ]
        for number, buffers in enumerate(zip(*runs, strict=True)):
            assert all(same_bits(buffers[0], other) for other in buffers[1:]), number


@pytest.mark.parametrize(
    "name",
    ["torsional_speed", "exponent", "implicit", "beam_wob_contact", "segments_speed_100kN", "exponent of torsion"],
)
def test_nothing_is_asked_of_the_c_library(name):
    """Its last bits depend on the system; a fused multiply-add is one everywhere."""
    functions = {"advance": make_advance()}
    for work, _ in works(name):
        functions |= functions_of(work, 8)
    for kind, function in functions.items():
        assert not re.search(r"declare .* @(?!llvm\.)", text_of(function)), kind


LINUX = "x86_64-unknown-linux-gnu"
# The triple, the processor, and what the object files begin with.
PLATFORMS = {
    "arm, Linux": ("aarch64-unknown-linux-gnu", "cortex-a72", b"\x7fELF"),
    "arm, macOS": ("arm64-apple-darwin", "apple-m1", b"\xcf\xfa\xed\xfe"),
    "x86, Windows": ("x86_64-pc-windows-msvc-elf", "x86-64-v3", b"\x7fELF"),
    "any x86": (LINUX, "x86-64", b"\x7fELF"),
    "x86 with AVX2": (LINUX, "x86-64-v3", b"\x7fELF"),
    "x86 with AVX-512": (LINUX, "x86-64-v4", b"\x7fELF"),
}
NEEDED = {"x86-64": (), "x86-64-v3": ("avx2", "fma"), "x86-64-v4": ("avx512f", "avx512dq", "avx512vl")}
# Loops over arrays.
PLAIN = {
    "advance": make_advance(),
    "period": motion_kinds._make_period(),
    "displacement": motion_kinds._make_displacement(),
}
_numbers = count()


@pytest.mark.parametrize("name", PLATFORMS)
def test_there_is_code_for_every_platform(name):
    triple, processor, start = PLATFORMS[name]
    try:
        target = machine(triple, processor)
    except RuntimeError as error:  # LLVM may be built without it
        pytest.skip(str(error))
    ((work, _),) = works("torsional_speed")
    for kind, function in {**functions_of(work, 8), **PLAIN}.items():
        code = native.object_code(text_of(function), target)
        assert code.startswith(start), kind
        assert b"entry" in code


@pytest.mark.skipif(
    platform.machine().lower() not in ("x86_64", "amd64") or platform.system() != "Linux",
    reason="code of x86 for Linux is run",
)
@pytest.mark.parametrize("processor", NEEDED)
def test_every_processor_has_the_same_bits(processor):
    """Also one without a fused multiply-add, for which there is a function."""
    features = llvm.get_host_cpu_features()
    if missing := [name for name in NEEDED[processor] if not features.get(name)]:
        pytest.skip(f"this processor has no {missing[0]}")

    def made(function, target):
        symbol = f"portable_{next(_numbers)}"
        text = Module(native.WIDTH).text(function.py_func, function.kinds, symbol)
        one = LaneFunction(function.py_func, function.kinds)
        one._address = native.address_of(native.object_code(text, target), symbol)
        return one

    target = machine(LINUX, processor)
    ((work, points),) = works("torsional_speed")
    here = outcomes(work, points, 8, lambda function: made(function, None))
    there = outcomes(work, points, 8, lambda function: made(function, target))
    for number, (one, other) in enumerate(zip(here, there, strict=True)):
        assert bits(one) == bits(other), number


LAYOUT = variant_of(MAIN, Options()).rows(variant_of(MAIN, Options()).observed)
SPLIT = Options(implicit=1)


def step(name: str, lanes: int, rows: Any) -> Any:
    return make_step(STEPPERS[name], lanes, with_step(STEPPERS[name], rows))


def slopes(model: str, *variant: int) -> Any:
    options = Beam(*variant) if model == "beam" else variant
    return variant_of(model_named(model), options).right_hand_side(8)


# A compiled function, and the operations on all lanes that it has at least.
FUNCTIONS: dict[str, tuple[Callable[[], Any], int]] = {
    "slopes": (lambda: variant_of(MAIN, Options()).right_hand_side(8), 100),
    **{
        f"friction law {n}": (lambda n=n: variant_of(MAIN, Options(friction=n)).right_hand_side(8), 100)
        for n in (1, 2, 3)
    },
    "drive": (lambda: variant_of(MAIN, Options(driven=1, limited=1)).right_hand_side(8), 100),
    "many options": (
        lambda: variant_of(MAIN, Options(swirl=1, stabilizer=1, weight=1, axial_friction=1)).right_hand_side(8),
        150,
    ),
    "Hertz": (lambda: variant_of(MAIN, Options(hertz=1, stabilizer=1)).right_hand_side(8), 100),
    "tangent": (lambda: variant_of(model_named(MODEL), Options()).tangent(8, 0), 150),
    "slips": (lambda: variant_of(MAIN, SPLIT).right_hand_side(16), 300),
    "slips held": (lambda: variant_of(MAIN, SPLIT._replace(stabilizer=1)).right_hand_side(8), 300),
    "slips along": (lambda: variant_of(MAIN, SPLIT._replace(axial_friction=1)).right_hand_side(8), 300),
    "slips held along": (
        lambda: variant_of(MAIN, SPLIT._replace(stabilizer=1, axial_friction=1)).right_hand_side(8),
        300,
    ),
    "implicit step": (lambda: step("kennedy_carpenter", 16, variant_of(MAIN, SPLIT).rows()), 300),
    **{f"step {name}": (lambda name=name: step(name, 8, LAYOUT), 300) for name in STEPPERS},
    "torsion": (lambda: slopes("torsion"), 20),
    **{
        f"beam {' '.join(map(str, o))}": (lambda o=o: slopes("beam", *o), 100)
        for o in ((1, 1), (2, 1), (5, 1), (5, 5), (4, 3, 1, 3, 5, 1))
    },
    "step of the beam": (lambda: step("tsitouras", 8, variant_of(model_named("beam"), Beam(5, 5)).rows(40)), 100),
    "segments": (lambda: slopes("segments", 3, 2, 0), 100),
    "segments that creep": (lambda: slopes("segments", 3, 2, 0, 1), 100),
    "step of segments": (lambda: step("tsitouras", 8, variant_of(model_named("segments"), (10, 10, 0)).rows(40)), 100),
}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_lane_loops_are_vectors(name):
    """A loop over lanes that is one over ``range`` is compiled too, and takes several
    times as long."""
    make, least = FUNCTIONS[name]
    packed, single = packed_and_single(text_of(make()))
    assert packed >= least
    assert single == 0


@pytest.mark.parametrize(
    ("model", "variant"),
    [
        (MODEL, Options()),
        (MODEL, SPLIT),
        (MODEL, Options(driven=1, stabilizer=1, weight=1)),
        ("beam", Beam(2, 1)),
        ("torsion", ()),
    ],
)
def test_only_the_events_of_an_observer_are_on_one_lane(model, variant):
    """They are rare. Their function is called by the one that attends to every step."""
    text = text_of(variant_of(model_named(model), variant).observer(16)[0])
    events, every_step = re.split(r"(?m)^define", text)[1:]
    packed, single = packed_and_single(every_step)
    assert packed >= 10
    assert single == 0
    assert packed_and_single(events)[1] > 0


@pytest.mark.parametrize("name", ["slopes", "slips", "step tsitouras", "beam 5 5"])
def test_llvm_keeps_the_vectors(name):
    text = text_of(FUNCTIONS[name][0]())
    wide, single = instructions(text)
    assert wide >= packed_and_single(text)[0]  # of two or four registers each
    assert single <= 10


ROWS = 6  # of the buffer: three of any numbers, one of whole ones, two that are written
FLOATS = ("s0", "s1", "s2")
INTEGERS = ("n0", "n1", "n2")


class Writer:
    """Draws a program. Integers stay below 128, so that the 64 bits of the machine hold
    what Python's hold."""

    def __init__(self, draw: Any, lanes: int) -> None:
        self.draw, self.lanes = draw, lanes
        self.lines: list[str] = []
        self.count = 0

    def pick(self, *choices: Any) -> Any:
        return self.draw(st.sampled_from(choices))

    def line(self, depth: int, text: str) -> None:
        self.lines.append("    " * depth + text)

    def new(self, letter: str) -> str:
        self.count += 1
        return f"{letter}{self.count}"

    # Expressions; ``names`` are the names of floats and of integers that have a value,
    # ``lane`` is the index of the lane in a loop over lanes.
    def real(self, names: tuple[list[str], list[str]], lane: str, deep: int = 3) -> str:
        kind = self.draw(st.integers(0, 11)) if deep else self.draw(st.integers(0, 3))
        more = deep - 1
        if kind == 0:
            return self.pick(*names[0])
        if kind == 1:
            return repr(self.pick(0.5, -2.0, 3.0, 0.1, 1e3))
        if kind == 2 or kind == 3:
            row = self.draw(st.integers(0, ROWS - 1))
            return f"b[{row} * W + {lane or self.draw(st.integers(0, self.lanes - 1))}]"
        if kind == 4:
            return f"float({self.whole(names, lane, more)})"
        if kind == 5:
            return f"{self.pick('abs', 'np.floor', 'np.sqrt', 'np.rint', '-')}({self.real(names, lane, more)})"
        if kind == 6:
            given = ", ".join(self.real(names, lane, more) for _ in range(self.pick(2, 3)))
            return f"{self.pick('min', 'max')}({given})"
        if kind <= 8:
            one, two = self.real(names, lane, more), self.real(names, lane, more)
            return f"({one} if {self.truth(names, lane, more)} else {two})"
        one, two = self.real(names, lane, more), self.real(names, lane, more)
        # what is divided by is a number of the buffer, so the interpreter does not refuse
        operation = self.pick("+", "-", "*")
        return f"({one} {operation} {two})" if kind < 11 else f"({one} / b[{lane or 0}])"

    def whole(self, names: tuple[list[str], list[str]], lane: str, deep: int = 3) -> str:
        kind = self.draw(st.integers(0, 9)) if deep else self.draw(st.integers(0, 2))
        more = deep - 1
        if kind == 0:
            return self.pick(*names[1])
        if kind == 1:
            return str(self.pick(0, 1, 3, -5, 64))
        if kind == 2:
            return lane or self.pick(*names[1])
        if kind == 3:
            return f"int(min(9.0, max(-9.0, {self.real(names, lane, more)})))"
        if kind == 4:
            return f"-({self.whole(names, lane, more)})"
        if kind == 5:
            operation, by = self.pick(("//", 3), ("//", -4), ("%", 7), ("%", -2), (">>", 2), ("<<", 1))
            return f"({self.whole(names, lane, more)} {operation} {by})"
        if kind == 6:
            divisor = self.whole(names, lane, more)
            return f"({self.whole(names, lane, more)} {self.pick('//', '%')} ({divisor} | 1))"
        one, two = self.whole(names, lane, more), self.whole(names, lane, more)
        if kind == 7:
            return f"({one} if {self.truth(names, lane, more)} else {two})"
        return f"({one} {self.pick('+', '-', '*', '&', '|', '^')} {two})"

    def truth(self, names: tuple[list[str], list[str]], lane: str, deep: int = 2) -> str:
        kind = self.draw(st.integers(0, 5)) if deep > 0 else 0
        more = deep - 1
        if kind <= 2:
            made = self.real if self.pick(True, False) else self.whole
            first, second = made(names, lane, max(more, 0)), made(names, lane, max(more, 0))
            compared = f"{first} {self.pick('<', '<=', '>', '>=', '==', '!=')} {second}"
            return f"({compared} < {made(names, lane, 0)})" if kind == 2 else f"({compared})"
        if kind == 3:
            return f"(not {self.truth(names, lane, more)})"
        joined = self.pick("and", "or", "==", "!=", "&", "|", "^")
        return f"({self.truth(names, lane, more)} {joined} {self.truth(names, lane, more)})"

    # Statements.
    def block(self, depth: int, indices: list[str], in_loop: bool, size: int = 3) -> None:
        names = list(FLOATS), [*INTEGERS, *indices]
        for _ in range(self.draw(st.integers(1, size))):
            kind = self.draw(st.integers(0, 9 if depth < 4 else 3))
            if kind <= 1:
                self.line(depth, f"{self.pick(*FLOATS)} = {self.real(names, '')}")
            elif kind == 2:
                self.line(depth, f"{self.pick(*INTEGERS)} = (({self.whole(names, '')}) & 255) - 128")
            elif kind == 3:
                self.line(depth, self.pick("s0, s1 = s1, s0 + 1.0", "s2 -= s0 * 0.5", "s1 = s2 = s0", "n0 ^= 5"))
            elif kind <= 5:
                self.line(depth, f"if {self.truth(names, '')}:")
                self.block(depth + 1, indices, in_loop)
                if in_loop and self.draw(st.integers(0, 3)) == 0:
                    self.line(depth + 1, self.pick("break", "continue"))
                elif self.pick(True, False):
                    self.line(depth, "else:")
                    self.block(depth + 1, indices, in_loop)
            elif kind == 6:
                self.for_range(depth, indices)
            elif kind == 7:
                turns = self.new("w")
                self.line(depth, f"{turns} = 0")
                more = f" and {self.truth(names, '')}" if self.pick(True, False) else ""
                self.line(depth, f"while {turns} < {self.pick(1, 3, 9)}{more}:")
                self.line(depth + 1, f"{turns} += 1")
                self.block(depth + 1, [*indices, turns], True)
            else:
                self.over_lanes(depth, names)

    def for_range(self, depth: int, indices: list[str]) -> None:
        index = self.new("j")
        turns = self.pick("2", "4", "9", "1, 14, 4", "12, 0, -5", "n0 & 7", "n1, n1 + 3", "n2 & 3, -2, -1")
        self.line(depth, f"for {index} in range({turns}):")
        self.block(depth + 1, [*indices, index], True)

    def over_lanes(self, depth: int, names: tuple[list[str], list[str]]) -> None:
        """A loop over lanes; sets of lanes, and what is done in those lanes."""
        lane, chosen = self.new("i"), self.new("m")
        self.line(depth, f"{chosen} = 0")
        self.line(depth, f"for {lane} in packed(W):")
        mine = list(names[0]), list(names[1])
        for _ in range(self.draw(st.integers(1, 4))):
            kind = self.draw(st.integers(0, 4))
            if kind == 0:
                self.line(
                    depth + 1, f"b[{self.pick(4, 5)} * W + {lane}] {self.pick('=', '+=', '*=')} {self.real(mine, lane)}"
                )
            elif kind <= 2:
                local = self.new("x")
                self.line(depth + 1, f"{local} = {self.real(mine, lane)}")
                mine[0].append(local)
                if kind == 2:
                    index = self.new("q")
                    self.line(depth + 1, f"for {index} in range({self.pick('3', '10', '1, 20, 6')}):")
                    inner = mine[0], [*mine[1], index]
                    self.line(depth + 2, f"{local} = {self.real(inner, lane, 2)}")
            elif kind == 3:
                local = self.new("k")
                self.line(depth + 1, f"{local} = ({self.whole(mine, lane)}) & 63")
                mine[1].append(local)
            else:
                self.line(depth + 1, f"{chosen} |= (1 << {lane}) if {self.truth(mine, lane)} else 0")
        if self.pick(True, False):
            one = self.new("o")
            self.line(depth, f"while {chosen} != 0:")
            self.line(depth + 1, f"{one} = lowest_bit({chosen})")
            self.line(depth + 1, f"{chosen} &= {chosen} - 1")
            place = f"b[{self.pick(4, 5)} * W + {one}]"
            self.line(depth + 1, f"{place} = {self.real((names[0], [*names[1], one]), one)}")
        else:
            self.line(depth, f"n1 = {chosen} & 127")


@st.composite
def programs(draw: Any) -> tuple[int, str]:
    lanes = draw(st.sampled_from([1, 3, 8, 12]))
    writer = Writer(draw, lanes)
    writer.line(1, "s0, s1, s2 = b[0], b[W], b[2 * W]")
    writer.line(1, "n0, n1, n2 = int(b[3 * W]), 5, -3")
    writer.block(1, [], False, 5)
    writer.line(1, "b[4 * W] = s0 + s1 * s2")
    writer.line(1, "b[5 * W] = float(n0 + 256 * n1) + float(n2)")
    return lanes, "\n".join(["def program(b):", *writer.lines, ""])


@settings(max_examples=100, suppress_health_check=[HealthCheck.data_too_large, HealthCheck.too_slow])
@given(programs(), st.sampled_from(WIDTHS), st.integers(0, 2**32 - 1))
def test_any_program(drawn, width, seed):
    lanes, text = drawn
    function = define("program", text, W=lanes, np=np, lowest_bit=lowest_bit)
    rng = np.random.default_rng(seed)
    buffers = (np.concatenate([floats(rng, 3 * lanes), whole(rng, lanes), floats(rng, 2 * lanes)]) for _ in range(4))
    same(function, buffers, (width,))
