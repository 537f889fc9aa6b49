"""What the commands say of further axes, several starts, ramps and uncertain numbers."""

import csv
import json
from pathlib import Path

import h5py
import numpy as np
import pytest
from app.test_starts import TEXT

import nsdrill
from nsdrill.figures import draw
from nsdrill.figures.traces import title_of
from nsdrill.store import read_results, read_trace
from nsdrill.study import parse_study

from .helpers import changed

SWEEP = """\
operation: {depth: 2000 m, wob: 20 kN, rotary_speed: 5 rad/s}
sweep:
  bit.rock_stiffness: {from: 10 MN/m, to: 40 MN/m, points: 2, spacing: log}
  refine: 1
simulation: {transient: 0.1 s, observe: 0.1 s}
"""


@pytest.fixture(scope="module")
def rock(tmp_path_factory):
    folder = tmp_path_factory.mktemp("rock")
    nsdrill.run(parse_study(SWEEP), folder / "rock.h5", workers=1)
    return folder / "rock.h5"


def test_a_refined_sweep_is_shown(call, rock):
    answer = call("show", rock)
    assert "bit rock stiffness 10 MN/m to 40 MN/m, 3 values" in answer.out
    assert "borders known to 20 MN/m" in answer.out


def test_a_table_has_the_axis_with_its_units(call, rock):
    call("export", rock, "-o", "rock.csv")
    with open("rock.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["bit_rock_stiffness [N m-1]"]) for row in rows] == pytest.approx([10e6, 20e6, 40e6])


def test_a_replay_tells_its_value_of_the_axis(call, rock):
    call("replay", rock, "--at", "bit.rock_stiffness=40 MN/m", "-o", "trace.h5")
    assert "bit rock stiffness 40 MN/m" in call("show", "trace.h5").out
    assert json.loads(call("show", "trace.h5", "--json").out)["at"] == {"bit.rock_stiffness": 40e6}
    assert title_of(read_trace("trace.h5"), "si").endswith("5 rad/s, bit rock stiffness 40 MN/m")


def test_a_study_without_a_sweep_is_told_in_full(call):
    Path("one.yaml").write_text("operation: {depth: 3000 m}\n")
    assert "\n1 point: every point from the same initial state.\n" in call("check", "one.yaml").out


def test_pictures_name_what_is_held(tmp_path):
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


def test_the_window_over_three_axes_has_rows_in_field_units(call, tmp_path):
    text = """
sweep: {rotary_speed: [5 rad/s, 6 rad/s], well.friction.dynamic: [0.1, 0.2], bit.rock_stiffness: [10 MN/m, 80 MN/m]}
simulation: {transient: 0.1 s, observe: 0.1 s}
"""
    nsdrill.run(parse_study(text), tmp_path / "three.h5", workers=1)
    rows = call("window", tmp_path / "three.h5", "--units", "field", "--all").out.splitlines()
    [row] = [row for row in rows if row.lstrip().startswith("57101 lbf/in   ")]
    assert "100.0 %" in row
    assert "57.3 rpm" in row or "47.75 rpm" in row
    assert "well friction dynamic 0." in row


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    path = tmp_path_factory.mktemp("starts") / "out.h5"
    nsdrill.run(parse_study(TEXT), path, workers=1)
    return path


def test_check_counts_the_starts(call):
    Path("s.yaml").write_text(TEXT)
    answer = call("check", "s.yaml")
    assert "14 points: depth 2000 m to 3000 m (2 values); every operating point from 7 states, an" in answer.out


def test_show(call, made):
    answer = call("show", made)
    assert "7 of every operating point, drawn at random" in answer.out
    assert "Attractors, by their share of the starts (95 % interval):" in answer.out
    table = answer.out.partition("Attractors")[2].partition("\n\n")[0]
    assert "2000 m" in table
    assert "3000 m" in table
    assert "unsettled" in table
    assert "Along the sweep" not in answer.out, "one start has intervals, several have shares"


def test_show_for_programs(call, made):
    summary = json.loads(call("show", made, "--json").out)
    assert summary["starts"] == 7
    shares = [one["share"] for point in summary["operating_points"] for one in point["attractors"]]
    assert sum(shares) == pytest.approx(2.0)


def test_a_long_table_is_cut(call, made, monkeypatch):
    monkeypatch.setattr("nsdrill.text.show.MAX_ROWS", 1)
    short, whole = call("show", made).out, call("show", made, "--all").out
    assert "more lines (all with --all)" in short
    assert "more lines" not in whole
    assert len(whole.splitlines()) > len(short.splitlines())


def test_plot(call, made):
    for kind in ("shares", "attractors"):
        call("plot", made, "--kind", kind, "-o", f"{kind}.png")
    call("plot", made, "--depth", "2 km", "--states", "x,vx", "-o", "basin.png")
    call("plot", made, "--kind", "summary", "--start", 2, "-o", "one.png")
    assert "with --start, 0 to 6" in call("plot", made, "--kind", "summary", "-o", "two.png", code=2).err
    assert not Path("two.png").exists()


def test_classify(call, made):
    Path("copy.h5").write_bytes(made.read_bytes())
    assert "attractor: " in call("classify", "copy.h5", "--set", "classify.attractors.tolerance=100").err
    assert read_results("copy.h5")["attractor"].max() <= read_results(made)["attractor"].max()
    assert "at least 1e-09" in call("classify", "copy.h5", "--set", "classify.attractors.tolerance=0", code=2).err


RAMP = """\
title: Slowly up
operation:
  depth: 2000 m
  rotary_speed: {ramp: [[0 s, 3 rad/s], [2 s, 5 rad/s], [3 s, 5 rad/s], [4 s, 4 rad/s]]}
"""


@pytest.fixture
def ramp(tmp_path):
    (tmp_path / "ramp.yaml").write_text(RAMP)
    return tmp_path / "ramp.yaml"


def test_check_says_what_moves(call, ramp):
    answer = call("check", ramp)
    assert "Ramp, for nsdrill simulate: speed 3 rad/s at 0 s, 5 rad/s at 2 s" in answer.out
    assert "At the start of the ramp: 2000 m, 22.24 kN (4.99975 klbf), 3 rad/s" in answer.out
    data = json.loads(call("check", ramp, "--json").out)
    assert data["ramps"]["rotary_speed"] == {"time": [0.0, 2.0, 3.0, 4.0], "value": [3.0, 5.0, 5.0, 4.0]}
    assert data["points"] == 0


def test_check_looks_at_the_whole_ramp(call, ramp):
    assert "Buckled: at 2000 kN" in call("check", ramp, "--set", "operation.wob={ramp: [[0 s, 0 N], [9 s, 2 MN]]}").err


def test_simulate_follows_the_ramp_to_its_last_knot(call, ramp):
    answer = call("simulate", ramp, "-o", "t.h5", "--units", "field")
    assert "speed 28.65 rpm at 0 s, 47.75 rpm at 2 s" in answer.err
    with h5py.File("t.h5") as file:
        assert file["time"][-1] == pytest.approx(4.0)
        assert file["drive_speed"][[0, 100, 250, -1]] == pytest.approx([3, 4, 5, 4])
        assert np.ptp(file["wob"]) == np.ptp(file["depth"]) == 0.0
        assert file.attrs["rotary_speed"] == 3.0
    told = call("show", "t.h5").out
    assert "ramp: 3 rad/s at 0 s, 5 rad/s at 2 s, 5 rad/s at 3 s, 4 rad/s at 4 s" in told
    assert json.loads(call("show", "t.h5", "--json").out)["ramps"]["rotary_speed"]["time"][-1] == 4.0


def test_options_replace_the_ramp_and_the_duration(call, ramp):
    call("simulate", ramp, "-o", "a.h5", "--duration", "1 s")
    call("simulate", ramp, "-o", "b.h5", "--duration", "5 s", "--rotary-speed", "6 rad/s")
    with h5py.File("a.h5") as short, h5py.File("b.h5") as constant:
        assert short["drive_speed"][-1] == pytest.approx(4.0)
        assert constant["time"][-1] == pytest.approx(5.0)
        assert np.all(constant["drive_speed"][()] == 6.0)
        assert "ramps" not in constant.attrs


def test_a_sweep_replaces_the_ramp_of_its_axis(call, ramp):
    words = changed("sweep={rotary_speed: [3 rad/s, 4 rad/s]}", "simulation.transient=1 s", "simulation.observe=1 s")
    call("run", ramp, "-o", "out.h5", *words)
    # which follows the ramp all the same
    call("simulate", ramp, "-o", "t.h5", *words)
    assert "ramp: 3 rad/s" in call("show", "t.h5").out


def test_pictures_of_a_ramp(call, ramp):
    call("simulate", ramp, "-o", "t.h5")
    sweep = "sweep={rotary_speed: [3 rad/s, 4 rad/s, 5 rad/s]}"
    call("run", ramp, "-o", "out.h5", *changed(sweep, "simulation.transient=1 s", "simulation.observe=5 s"))
    call("plot", "t.h5", "-o", "a.png")
    call("plot", "t.h5", "-o", "b.png", "--kind", "ramp", "--over", "out.h5")


UNCERTAIN = """
title: Not known
operation: {depth: 2000 m}
sweep: {rotary_speed: {from: 4 rad/s, to: 12 rad/s, points: 3}}
uncertain:
  bit.rock_stiffness: {lognormal: {median: 25 MN/m, factor: 2}}
  wob: {uniform: [20 kN, 40 kN]}
  samples: 16
simulation: {transient: 5 s, observe: 5 s}
record: {peaks: 0}
"""


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """Results with samples, beside their study; to be read only."""
    folder = tmp_path_factory.mktemp("uncertain")
    (folder / "study.yaml").write_text(UNCERTAIN)
    nsdrill.run(folder / "study.yaml", folder / "out.h5", progress=False).close()
    return folder / "out.h5"


def test_from_the_study_to_the_answers(call, results):
    assert "16 samples of weight on bit, bit rock stiffness" in call("check", results.with_name("study.yaml")).out
    shown = call("show", results).out
    for said in ("weight on bit", "nine in ten lie in", "Probability, in brackets its 95 % interval from 16 samples:"):
        assert said in shown
    plain = json.loads(call("show", results, "--json").out)
    assert (plain["samples"], len(plain["probabilities"])) == (16, 3)
    assert 20e3 < plain["unknowns"]["operation.wob"]["value"] < 40e3
    window = call("window", results, "--confidence", "75", "--all").out
    assert call("window", results, "--confidence", "75 %", "--all").out == window
    assert "75 % or more of 16 samples" in window
    assert "What the confidence costs:" in window
    assert json.loads(call("window", results, "--json").out)["confidence"] == 0.9
    assert "first" in call("sensitivity", results, "--picture", "t.png").out
    assert Path("t.png").stat().st_size > 1000
    call("plot", results, "-o", "p.png", "--confidence", "80")
    call("plot", results, "--at", "sample=3", "--kind", "summary", "-o", "s.png")


def test_one_sample_is_replayed(call, results):
    done = call("replay", results, "--rotary-speed", "8rad/s", "--at", "sample=5", "-o", "t.h5")
    assert "sample 5" in done.err
    assert "bit for bit" in done.err
    said = call("simulate", results.with_name("study.yaml"), "--at", "sample=5", "-o", "u.h5").err
    for word in ("Point: 2000 m", "bit rock stiffness", "sample 5"):
        assert word in said
