"""The code of one thread for GPUs, read and assembled without one: what decides on the bits,
and what decides on the speed."""

import importlib.util
import re
import shutil
import subprocess
from collections import Counter
from pathlib import Path

import llvmlite.binding as llvm
import pytest

from kernel.test_device import KINDS, work_for
from nsdrill.compiler import threads
from nsdrill.compiler.functions import LaneFunction
from nsdrill.compiler.threads import AMD, ENTRY, NVIDIA, ThreadModule, assembly
from nsdrill.kernel.batch import unobserved
from nsdrill.kernel.steppers import STEPPERS
from nsdrill.kernel.thread import OBSERVATION, TRANSIENT, WHOLE, make_thread
from nsdrill.sweep.work import compiled_parts

# The model, what is recorded, and the phase; with the greatest stack [bytes] of code for
# sm_70, sm_80 and sm_90, found 2026 with ptxas 12.9 and 13.0, and some room.
MAIN = "christoforou_yigit"
PROGRAMS: dict[tuple[str, str, int], int] = {
    (MAIN, "explicit", TRANSIENT): 100,
    (MAIN, "explicit", OBSERVATION): 1100,
    (MAIN, "implicit", OBSERVATION): 1450,
    (MAIN, "exponent", WHOLE): 2900,
}


def thread_of(model: str, kind: str, phase: int) -> LaneFunction:
    work = work_for(model, **KINDS[kind])
    parts, one = compiled_parts(1, work.program), work.new_batch(1, 1)
    observed = unobserved() if phase == TRANSIENT else (parts.observer, parts.marker)
    columns, size = one._outbox.shape[1], one._store.size
    pair = STEPPERS[work.program.stepper]
    return make_thread(pair, work.program.rows, columns, size, parts.right_hand_side, *observed, phase)


@pytest.fixture(scope="module", params=PROGRAMS, ids=lambda program: " ".join(map(str, program)))
def program(request):
    """A program and its PTX."""
    return request.param, assembly(thread_of(*request.param))


# The instructions on doubles: those that round, which must round once and to the nearest;
# those that do not round; and comparisons.
ROUNDED = {"add", "sub", "mul", "fma", "div", "rcp", "sqrt"}
CONVERSIONS = r"rn\.f64\.[su](?:32|64)|rzi\.s64\.f64|r[mn]i\.f64\.f64"
EXACT = {"abs", "neg", "selp", "min", "max", "cvt", "copysign"}


def test_every_operation_on_doubles_is_rounded_correctly(program):
    _, text = program
    body = text[text.index("{") :]
    words = Counter(re.findall(r"^\s+(?:@!?%\w+ )?([a-z]\w*(?:\.\w+)+)", body, re.MULTILINE))
    doubles = {word for word in words if "f64" in word}
    for word in doubles:
        name, *parts = word.split(".")
        assert name in ROUNDED | EXACT | {"setp", "mov", "ld", "st"}, word
        assert name not in ROUNDED or parts == ["rn", "f64"], word
        if name == "cvt":  # counts are below 2^53
            assert re.fullmatch(CONVERSIONS, ".".join(parts)), word
    assert {word.split(".")[0] for word in doubles} >= {"add", "mul", "fma", "div", "setp"}
    assert sum(words.values()) > 400
    assert not [word for word in words if {"approx", "ftz", "f32", "f16", "sat"} & set(word.split("."))]
    # NaN and zeros of both signs are chosen by min and max otherwise than by a comparison,
    # unless one side is a number that is neither, or whether one of them is beyond a number
    # is all that matters.
    for made, given in re.findall(r"\b(?:min|max)\.f64\s+(%\w+), ([^;]*)", body):
        uses = re.findall(rf"^\t(\S+)[^\n]*, {made}\b", body, re.MULTILINE)
        is_number = re.search(r"0d(?!(?:0|8)0{15}\b)(?!7FF[89A-F])[0-9A-F]{16}", given)
        assert is_number or all(use.startswith("setp.") for use in uses), (made, given, uses)


def test_nothing_is_called(program):
    _, text = program
    assert not re.search(r"\bcall\b|\.extern|\.func", text)
    assert text.count(".entry") == 1
    assert f".visible .entry {ENTRY}(" in text
    assert ".target sm_70" in text


def test_the_lane_buffer_can_be_in_registers(program):
    """No place in it depends on a number that is not known, which would keep all of it in
    memory."""
    _, text = program
    assert ".local" not in text


def test_integers_keep_all_their_bits(program):
    """What LLVM is not to know of goes through a register of 64 bits."""
    _, text = program
    lines = text.splitlines()
    places = [number for number, line in enumerate(lines) if "begin inline asm" in line]
    assert len(places) == 2
    assert not [line for line in lines[places[0] - 1 : places[1] + 3] if "cvt" in line]


def assemblers() -> list[str]:
    """The paths of ``ptxas``: of a toolkit, and of the wheel of the extra gpu-test, which has
    the oldest targets."""
    spec = importlib.util.find_spec("nvidia")
    places = spec.submodule_search_locations or () if spec else ()
    wheels = [str(path) for place in places for path in sorted(Path(place).glob("*/bin/ptxas"))]
    return [*filter(None, [shutil.which("ptxas")]), *wheels]


@pytest.mark.parametrize("target", ["sm_70", "sm_80", "sm_90", "sm_100"])
def test_registers_and_stack(program, target, tmp_path):
    """What limits how many threads run together, and what they read again from memory."""
    name, text = program
    source = tmp_path / "thread.ptx"
    source.write_text(text)
    for ptxas in assemblers():
        command = [ptxas, "-v", f"-arch={target}", str(source), "-o", str(tmp_path / "thread.cubin")]
        done = subprocess.run(command, capture_output=True, text=True)
        if "is not defined for option 'gpu-name'" not in done.stderr:
            break  # older ones lack the newest targets, newer ones the oldest
    else:
        pytest.skip(f"no ptxas for {target} is found: pip install -e '.[gpu-test]'")
    assert done.returncode == 0, done.stderr
    registers = int(re.search(r"Used (\d+) registers", done.stderr)[1])
    stack = int(re.search(r"(\d+) bytes stack frame", done.stderr)[1])
    assert registers <= 255
    assert stack <= PROGRAMS[name], done.stderr


def test_a_transient_has_less_code():
    """No observer, none of its rows, none of its marks."""
    phases = (TRANSIENT, OBSERVATION, WHOLE)
    transient, observation, whole = (assembly(thread_of("torsion", "explicit", phase)) for phase in phases)
    assert len(transient) < 0.6 * len(observation)
    assert len(observation) < len(whole) * 1.02


def test_there_is_code_for_gpus_of_amd():
    """As far as a listing: it was not run."""
    text = assembly(thread_of("torsion", "explicit", WHOLE), AMD)
    assert f".amdhsa_kernel {ENTRY}" in text
    assert "v_fma_f64" in text
    assert "s_swappc" not in text  # a call


def test_the_right_hand_side_is_in_the_code_once():
    """The stages are turns of a loop, and a run begins by a step."""
    work = work_for()
    module = ThreadModule(NVIDIA)
    module.kernel(thread_of("torsion", "explicit", WHOLE))
    parts = compiled_parts(1, work.program)
    whole = next(part for part in module.parts if "@thread(" in part)
    for function in (parts.right_hand_side, parts.observer, parts.marker):
        assert whole.count(f"@{module.known[id(function)]}(") == 1, function.__name__


def test_code_is_kept_and_found_again(monkeypatch):
    """Whichever machine it was made on: it is named after what it is made of."""
    function = thread_of("torsion", "explicit", WHOLE)
    first = assembly(function)
    monkeypatch.setattr(threads, "_machine", lambda target: pytest.fail("it is compiled again"))
    assert assembly(function) == first


def test_the_module_is_what_llvm_takes():
    for target in (NVIDIA, AMD):
        llvm.parse_assembly(ThreadModule(target).kernel(thread_of("torsion", "explicit", WHOLE))).verify()
