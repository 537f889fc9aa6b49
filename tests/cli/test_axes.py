"""What the commands say of a sweep over a number beside those of the operation."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest

import nsdrill
from nsdrill.plot import draw
from nsdrill.plot.traces import title_of
from nsdrill.store import read_results, read_trace
from nsdrill.study import parse_study

from .helpers import Call

STUDY = """\
operation: {depth: 2000 m, wob: 20 kN, rotary_speed: 5 rad/s}
sweep:
  bit.rock_stiffness: {from: 10 MN/m, to: 40 MN/m, points: 2, spacing: log}
  refine: 1
simulation: {transient: 0.1 s, observe: 0.1 s}
"""


@pytest.fixture(scope="module")
def rock(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("rock")
    nsdrill.run(parse_study(STUDY), folder / "rock.h5", workers=1)
    return folder / "rock.h5"


def test_a_refined_sweep_is_shown(call: Call, rock: Path) -> None:
    answer = call("show", rock)
    assert "bit rock stiffness 10 MN/m to 40 MN/m, 3 values" in answer.out
    assert "borders known to 20 MN/m" in answer.out


def test_a_table_has_the_axis_with_its_units(call: Call, rock: Path) -> None:
    call("export", rock, "-o", "rock.csv")
    with open("rock.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["bit_rock_stiffness [N m-1]"]) for row in rows] == pytest.approx([10e6, 20e6, 40e6])


def test_a_replay_tells_its_value_of_the_axis(call: Call, rock: Path) -> None:
    call("replay", rock, "--at", "bit.rock_stiffness=40 MN/m", "-o", "trace.h5")
    assert "bit rock stiffness 40 MN/m" in call("show", "trace.h5").out
    assert json.loads(call("show", "trace.h5", "--json").out)["at"] == {"bit.rock_stiffness": 40e6}
    assert title_of(read_trace("trace.h5"), "si").endswith("5 rad/s, bit rock stiffness 40 MN/m")


@pytest.mark.parametrize(
    "words",
    [
        ["--at", "rotary_speed=5 rad/s", "--rotary-speed", "4 rad/s"],
        ["--at", "bit.rock_stiffness=10 MN/m", "--at", "bit.rock_stiffness=40 MN/m"],
    ],
)
def test_a_second_value_of_an_axis_is_refused(call: Call, rock: Path, words: list[str]) -> None:
    assert "found a second value of" in call("replay", rock, *words, "-o", "trace.h5", code=2).err


def test_a_study_without_a_sweep_is_told_in_full(call: Call) -> None:
    Path("one.yaml").write_text("operation: {depth: 3000 m}\n")
    assert "\n1 point: every point from the same initial state.\n" in call("check", "one.yaml").out


def test_pictures_name_what_is_held(tmp_path: Path) -> None:
    head = (
        "operation: {depth: 2000 m, wob: 20 kN, rotary_speed: 5 rad/s}\nsimulation: {transient: 0 s, observe: 0.1 s}\n"
    )
    axes = "{bit.rock_stiffness: [10 MN/m, 20 MN/m], initial.x: [1 mm, 2 mm], mud.drag: [0.5, 1, 2]}"
    for name, study in {"one": head, "three": f"{head}sweep: {axes}\n"}.items():
        nsdrill.run(parse_study(study), tmp_path / f"{name}.h5", workers=1)
    one = draw(read_results(tmp_path / "one.h5"))
    assert one.get_suptitle() == "2000 m, 20 kN, 5 rad/s"
    three = read_results(tmp_path / "three.h5")
    for kind in ("map", "window"):
        titles = {axes.get_title() for axes in draw(three, kind=kind).axes}
        named = ("bit rock stiffness 10 MN/m", "initial x 1 mm", "mud drag 0.5")
        assert any(title.startswith(named) for title in titles)


def test_the_window_over_three_axes_has_rows_in_field_units(call: Call, tmp_path: Path) -> None:
    text = """
sweep: {rotary_speed: [5 rad/s, 6 rad/s], well.friction.dynamic: [0.1, 0.2], bit.rock_stiffness: [10 MN/m, 80 MN/m]}
simulation: {transient: 0.1 s, observe: 0.1 s}
"""
    nsdrill.run(parse_study(text), tmp_path / "three.h5", workers=1)
    rows = call("window", tmp_path / "three.h5", "--units", "field").out.splitlines()
    [row] = [row for row in rows if row.lstrip().startswith("57101 lbf/in")]
    assert "100.0 %" in row
    assert "57.3 rpm" in row or "47.75 rpm" in row
    assert "well friction dynamic 0." in row
