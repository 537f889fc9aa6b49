"""YAML as text: what is read, where it stood, and files that mean no good."""

import math
import time
from pathlib import Path

import pytest

from nsdrill.errors import FileError, StudyError
from nsdrill.study import load_study, parse_study
from nsdrill.study.read import parse

BOMB = "a: &a [x,x,x,x,x,x,x,x,x,x]\n" + "".join(
    f"{chr(98 + i)}: &{chr(98 + i)} [{','.join(['*' + chr(97 + i)] * 10)}]\n" for i in range(12)
)


def test_scalars_follow_yaml_1_2() -> None:
    text = "[1, 010, 0x10, 0o17, 1_000, 1e4, 1.0e-6, .5, -3, no, yes, true, null, ~, '3', .inf, '', 1:30, 2020-01-01]"
    assert parse(text, "s").data == [
        1,
        10,
        16,
        15,
        "1_000",
        1e4,
        1e-6,
        0.5,
        -3,
        "no",
        "yes",
        True,
        None,
        None,
        "3",
        math.inf,
        "",
        "1:30",
        "2020-01-01",
    ]
    assert math.isnan(parse(".nan", "s").data)


def test_places_are_those_of_the_file() -> None:
    document = parse("sweep:\n  depth: [1 m,\n    2 m]\nmud:\n", "s")
    assert document.place(("sweep", "depth", 1)).line == 3
    assert document.place(("sweep", "depth", 1)).column == 5
    assert document.place(("sweep", "depth"), of_key=True).column == 3
    assert document.place(("mud",)).line == 4
    assert document.place(("mud", "drag")).line == 4  # not there: what is around it


def test_aliases_serve_within_bounds() -> None:
    study = parse_study("sweep: {wob: &w [1 kN, 2 kN], rotary_speed: [1 rad/s]}\noperation: {depth: &d 900 m}\n")
    assert study.operation.depth == 900.0
    assert parse("a: &a [1, 2]\nb: *a\nc: &s 3\nd: *s", "s").data == {"a": [1, 2], "b": [1, 2], "c": 3, "d": 3}


@pytest.mark.parametrize(
    ("text", "line", "says"),
    [
        ("- a", 1, "a mapping"),
        ("just text", 1, "a mapping"),
        ("sweep:\n\tdepth: 3 m", 2, "spaces, not tabs"),
        ("sweep: {depth: 3 m", 1, "allowed"),
        ("sweep: 'depth", 1, "unexpected end"),
        ("sweep: \x00", 1, "#x0000"),
        ("sweep: 1\n---\nsweep: 2", 2, "second document"),
        ("sweep: !!python/object:os.system x", 1, "without tags"),
        ("sweep: !mine x", 1, "without tags"),
        ("a: *nowhere", 1, "earlier anchor"),
        ("a: &x [*x]", 1, "earlier anchor"),
        ("? [a, b]\n: 3", 1, "as a key"),
        ("[" * 5000, 1, "20 levels"),
        ("{a: " * 5000, 1, "20 levels"),
        ("- " * 5000, 1, "20 levels"),
        (BOMB, 5, "50000 values"),
        ("a: b: c", 1, "mapping values"),
        ("a: |\n  x\n b\n", 3, "allowed"),
    ],
)
def test_broken_documents(text: str, line: int, says: str) -> None:
    start = time.process_time()
    with pytest.raises(StudyError) as caught:
        parse_study(text, "s.yaml")
    assert time.process_time() - start < 5.0
    assert says in str(caught.value)
    assert f"s.yaml, line {line}" in str(caught.value)


@pytest.mark.parametrize("text", ["", "\n", "# nothing\n", "---\n", "null", "{}"])
def test_an_empty_file_is_no_study(text: str) -> None:
    with pytest.raises(StudyError, match="found an empty document; allowed: a study"):
        parse_study(text)


def test_byte_order_mark_is_accepted(tmp_path: Path) -> None:
    path = tmp_path / "s.yaml"
    path.write_bytes(b"\xef\xbb\xbfsweep: {wob: [1 kN]}\r\ntitle: M\xc3\xbcll\r\n")
    assert load_study(path).title == "Müll"
    assert load_study(str(path)).axes["wob"].tolist() == [1000.0]


def test_files_that_are_no_text(tmp_path: Path) -> None:
    path = tmp_path / "s.yaml"
    with pytest.raises(FileError, match=r"no such file. `nsdrill new"):
        load_study(path)
    with pytest.raises(FileError, match="is a folder"):
        load_study(tmp_path)
    with pytest.raises(FileError, match="not a file name"):
        load_study("a\0b")
    path.write_bytes(b"sweep: 1\ntitle: M\xfcll\n")
    with pytest.raises(FileError, match="line 2: found the byte 0xfc, which is not UTF-8"):
        load_study(path)
    path.write_text("sweep: 1\n", encoding="utf-16")
    with pytest.raises(FileError, match="not UTF-8"):
        load_study(path)
    path.write_bytes(b"#" * 1_000_001)
    with pytest.raises(FileError, match="larger than 1 MB"):
        load_study(path)
    path.write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(100))
    with pytest.raises(FileError, match="HDF5 file"):
        load_study(path)
