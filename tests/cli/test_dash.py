"""- as a file name, the schema as a file, and completion: what stands between nsdrill
and other programs."""

from __future__ import annotations

import io
import json
import subprocess
from pathlib import Path

import pytest

from nsdrill.study import json_schema, short_text

from .helpers import SCRIPT, Answer, Call


def piped(text: str, *words: object, cwd: Path) -> Answer:
    done = subprocess.run([SCRIPT, *map(str, words)], cwd=cwd, input=text, capture_output=True, text=True, timeout=120)
    assert "Traceback" not in done.stderr
    return Answer(done.returncode, done.stdout, done.stderr)


def test_new_writes_to_standard_output(call: Call) -> None:
    assert call("new", "-o", "-").out == call("new").out == short_text()
    assert not list(Path().iterdir())


@pytest.fixture
def fed(call: Call, monkeypatch: pytest.MonkeyPatch) -> Call:
    """Gives a command with this text on standard input."""

    def give(text: str, *words: object, code: int = 0) -> Answer:
        monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(text.encode())))
        return call(*words, code=code)

    return give


def test_a_study_on_standard_input(shared: Path, tmp_path: Path, fed: Call) -> None:
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
def test_faults_on_standard_input(tmp_path: Path, text: str, said: str, fed: Call) -> None:
    answer = fed(text, "run", "-", "-o", "out.h5", code=2)
    assert answer.out == ""
    assert said in answer.err
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "words",
    [
        ["show", "-"],
        ["plot", "-", "-o", "x.png"],
        ["window", "-"],
        ["diff", "-", "-"],
        ["classify", "-"],
        ["export", "-", "-o", "x.csv"],
        ["replay", "-", "-o", "x.h5"],
        ["run", "study.yaml", "-o", "-"],
        ["simulate", "study.yaml", "-o", "-"],
        ["plot", "out.h5", "-o", "-"],
    ],
)
def test_results_and_pictures_are_files(call: Call, words: list[str]) -> None:
    answer = call(*words, code=2)
    assert answer.out == ""
    assert "found '-'; allowed: the name of a file" in answer.err
    assert not list(Path().iterdir())


@pytest.mark.parametrize("units", ["si", "field"])
def test_csv_on_standard_output(call: Call, shared: Path, units: str) -> None:
    more = ["--units", units, "--peaks"]
    answer = call("export", shared / "map.h5", "-o", "-", *more)
    assert answer.err == ""
    call("export", shared / "map.h5", "-o", "table.csv", *more)
    assert answer.out == Path("table.csv").read_bytes().decode()
    assert [path.name for path in Path().iterdir()] == ["table.csv"]


def test_a_full_standard_output(shared: Path) -> None:
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [SCRIPT, "export", shared / "map.h5", "-o", "-"],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            timeout=120,
        )
    assert done.returncode == 1
    assert "standard output: cannot be written" in done.stderr


def test_the_schema_as_a_file(call: Call) -> None:
    assert call("schema").out == call("schema", "-o", "-").out
    assert "# yaml-language-server: $schema=study.schema.json" in call("schema", "-o", "study.schema.json").err
    assert json.loads(Path("study.schema.json").read_text()) == json_schema()
    assert json_schema()["$id"].startswith("urn:nsdrill:")
    call("schema", "-o", "study.schema.json", code=2)


@pytest.mark.parametrize(
    ("words", "found"),
    [
        ("nsdrill wi", "plain,window"),
        ("nsdrill show --un", "plain,--units"),
        ("nsdrill show sm", "file,sm"),
        ("nsdrill plot -o pi", "file,pi"),
    ],
)
def test_completion(words: str, found: str, call: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("_NSDRILL_COMPLETE", "bash_complete")
    monkeypatch.setenv("COMP_WORDS", words)
    monkeypatch.setenv("COMP_CWORD", str(len(words.split()) - 1))
    assert found in call().out.splitlines()
