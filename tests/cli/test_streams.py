"""Standard streams, odd file names and inputs that are no files: what stands between
nsdrill and other programs."""

import io
import json
import os
import shutil
import socket
import subprocess
from pathlib import Path

import h5py
import pytest
from same_bits import different

from nsdrill.cache import cache_directory
from nsdrill.study import json_schema
from nsdrill.study.write import examples

from .helpers import SCRIPT, Answer, finish, start


def shell(text: str, cwd: Path) -> Answer:
    """``text`` in a shell, where $N stands for nsdrill; a command that waits for ever
    ends with TimeoutExpired."""
    env = {**os.environ, "N": SCRIPT, "PYTHONUNBUFFERED": ""}
    done = subprocess.run(
        ["/bin/bash", "-c", f"set -o pipefail; {text}"], cwd=cwd, env=env, capture_output=True, text=True, timeout=120
    )
    assert "Traceback" not in done.stderr
    assert "bug" not in done.stderr
    return Answer(done.returncode, done.stdout, done.stderr)


CLOSED = "Error: standard output: cannot be written: Bad file descriptor.\n"
FULL = "Error: standard output: cannot be written: No space left on device.\n"


@pytest.mark.parametrize(
    ("command", "code", "said"),
    [
        ("$N new >&-", 1, CLOSED),
        ("$N new > /dev/full", 1, FULL),
        ("PYTHONUNBUFFERED=1 $N --version > /dev/full", 1, FULL),
        ("$N export {shared}/map.h5 -o - > /dev/full", 1, FULL),
        ("$N new >&- 2>&- <&-", 1, ""),
        # More than the 64 KiB of a pipe, so that the writer notices that nobody reads.
        ("$N schema | head -c 1 > /dev/null", 0, ""),
        ("$N show nowhere 2> /dev/full", 2, ""),
        ("$N nothing 2>&-", 2, ""),
    ],
)
def test_output_that_reaches_nobody(tmp_path, shared, command, code, said):
    assert shell(command.format(shared=shared), tmp_path) == Answer(code, "", said)


@pytest.mark.parametrize("streams", [">&- 2>&- <&-", "2> /dev/full"])
def test_a_run_that_nobody_listens_to(small, shared, streams):
    """The file is whole, without a word of a library in it, and that is what counts."""
    assert shell(f"$N run {small} -o out.h5 {streams}", small.parent).code == 0
    assert not different(small.parent / "out.h5", shared / "small.h5")


def test_data_come_where_messages_do_not(small):
    answer = shell(f"$N check {small} 2>/dev/full <&-", small.parent)
    assert answer.code == 0
    assert "valid. Small" in answer.out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["show", "pipe"], "pipe: this is no file."),
        (["plot", "pipe", "-o", "x.png"], "pipe: this is no file."),
        (["check", "pipe"], "pipe: is a pipe, and nobody writes to it"),
        (["run", "STUDY", "-o", "old.h5", "--overwrite"], "old.h5.part: this is no run log of nsdrill"),
        (["show", "socket"], "socket: this is no file."),
        (["check", "socket"], "socket: is a socket"),
        (["show", "/dev/zero"], "/dev/zero: this is no file."),
        (["check", "/dev/zero"], "/dev/zero: is larger than 1 MB"),
    ],
)
def test_inputs_that_are_no_files(call, shared, words, said):
    os.mkfifo("pipe")
    os.mkfifo("old.h5.part")
    with socket.socket(socket.AF_UNIX) as one:
        one.bind("socket")  # a name that is short
    assert said in call(*(shared / "small.yaml" if word == "STUDY" else word for word in words), code=2).err
    assert sorted(os.listdir()) == ["old.h5.part", "pipe", "socket"]


def test_a_study_from_a_pipe(small):
    answer = shell(f"$N check <(sleep 0.2; cat {small})", small.parent)
    assert answer.code == 0
    assert "valid. Small" in answer.out


def test_the_end_of_a_file_is_no_interrupt(call, small, monkeypatch):
    """click takes EOFError for one: code 130, with which a job script would go on for
    ever."""

    def ends(*args):
        raise EOFError("Ran out of input")

    monkeypatch.setattr("nsdrill.app.check.check", ends)
    assert "Ran out of input" in call("check", small, code=1).err


def test_a_damaged_cache_is_told_once(shared, tmp_path, monkeypatch):
    """Empty files, as a power cut leaves them; one small function, to be quick."""
    study, whole = shared / "small.yaml", shared / "small.h5"  # whose functions are in the cache
    folder = Path(shutil.copytree(cache_directory(), tmp_path / "compiled"))
    damaged = [path for path in folder.iterdir() if path.name.startswith("right_hand_side")]
    assert damaged
    for path in damaged:
        path.write_bytes(b"")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    first = finish(start("run", study, "-o", "out.h5", "--workers", "1", cwd=tmp_path))
    assert first.code == 0
    # among the warnings of the study and, on a busy machine, how long compiling took
    (warning,) = [line for line in first.err.splitlines() if str(folder) in line]
    assert warning.startswith(f"Warning: {folder}")
    assert "compiled again" in warning
    assert any(line.startswith("out.h5: 16 points") for line in first.err.splitlines())
    assert not different(tmp_path / "out.h5", whole)
    assert any(path.stat().st_size for path in damaged), "what this study needs is there again"


def piped(text: str, *words: object, cwd: Path) -> Answer:
    done = subprocess.run([SCRIPT, *map(str, words)], cwd=cwd, input=text, capture_output=True, text=True, timeout=120)
    assert "Traceback" not in done.stderr
    return Answer(done.returncode, done.stdout, done.stderr)


@pytest.fixture
def fed(call, monkeypatch):
    """Gives a command with this text on standard input."""

    def give(text, *words, code=0):
        monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(text.encode())))
        return call(*words, code=code)

    return give


def test_a_study_on_standard_input(shared, tmp_path, fed):
    text = (shared / "small.yaml").read_text()
    assert fed(text, "check", "-").out.startswith("standard input: valid. Small\n16 points: ")
    assert piped(text, "run", "-", "-o", "out.h5", "--quiet", cwd=tmp_path).code == 0
    assert "the same to the bit" in fed("", "diff", "out.h5", shared / "small.h5").out
    fed(text, "simulate", "-", "-o", "t.h5", "--duration", "1 s")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "standard input, line 1: found an empty document"),
        ("titel: x", "standard input, line 1: titel: found an unknown key"),
        ("a: [", "standard input, line 1: found"),
        ("x" * 1_000_001, "standard input: is larger than 1 MB"),
    ],
)
def test_faults_on_standard_input(tmp_path, text, said, fed):
    answer = fed(text, "run", "-", "-o", "out.h5", code=2)
    assert answer.out == ""
    assert said in answer.err
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("units", ["si", "field"])
def test_csv_on_standard_output(call, shared, units):
    more = ["--units", units, "--peaks"]
    answer = call("export", shared / "map.h5", "-o", "-", *more)
    assert answer.err == ""
    call("export", shared / "map.h5", "-o", "table.csv", *more)
    assert answer.out == Path("table.csv").read_bytes().decode()
    assert [path.name for path in Path().iterdir()] == ["table.csv"]


def test_the_schema_as_a_file(call):
    assert call("schema").out == call("schema", "-o", "-").out
    assert "# yaml-language-server: $schema=study.schema.json" in call("schema", "-o", "study.schema.json").err
    assert json.loads(Path("study.schema.json").read_text()) == json_schema()
    assert json_schema()["$id"].startswith("urn:nsdrill:")
    call("schema", "-o", "study.schema.json", code=2)


NAMES = [b"\xff\xfe", b"two\nlines", "日本".encode()]


@pytest.mark.parametrize("name", NAMES)
def test_odd_names(call, small, shared, tmp_path, name):
    odd = tmp_path / os.fsdecode(name)
    study, results = f"{odd}.yaml", f"{odd}.h5"
    shutil.copyfile(small, study)
    shutil.copyfile(shared / "small.h5", results)
    told = call("check", study).out + call("show", results).out + call("window", results).out
    assert told.count(".h5: ") == 2
    assert json.loads(call("check", study, "--json").out)["points"] == 16
    call("simulate", study, "-o", f"{odd}.trace.h5", "--duration", "1 s")
    call("plot", results, "-o", f"{odd}.png")
    call("export", results, "-o", f"{odd}.csv")
    call("show", f"{odd}.nothing", code=2)
    again = call("replay", results, "-o", f"{odd}.again.h5", "--rotary-speed", "3 rad/s", "--procedure", "up")
    assert "bit for bit" in again.err
    for made, attribute in ((f"{odd}.trace.h5", "study_source"), (f"{odd}.again.h5", "replay_of")):
        with h5py.File(made) as file:
            assert file.attrs[attribute].isprintable()
    told += again.err
    assert told.isascii() or name == NAMES[2]


def test_a_run_under_an_odd_name(small, tmp_path, monkeypatch):
    """In a process of its own, whose output knows Latin letters only."""
    monkeypatch.setenv("PYTHONIOENCODING", "latin-1")
    odd = os.fsdecode(bytes(tmp_path) + b"/\xff\n")
    shutil.copyfile(small, f"{odd}.yaml")
    assert finish(start("run", f"{odd}.yaml", "-o", f"{odd}.h5", "--workers", "1", "--set", "title=\u65e5")).code == 0
    shown = finish(start("show", f"{odd}.h5"))
    assert shown.err == ""
    assert shown.out.splitlines()[0].endswith("\\xff\\n.h5: results of a sweep. \\u65e5")


def test_an_example_is_written_as_it_is(call):
    assert len(examples()) > 10
    for name, path in examples().items():
        call("new", "--example", name, "-o", f"{name}.yaml")
        assert Path(f"{name}.yaml").read_text() == path.read_text()
