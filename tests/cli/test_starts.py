"""Several starts of every operating point on the command line."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from nsdrill.store import read_results

from .helpers import Call

TEXT = """\
title: Starts
operation: {wob: 22.24 kN, rotary_speed: 3 rad/s}
initial: {ensemble: 7, seed: 2}
sweep: {depth: [2000 m, 3000 m]}
simulation: {transient: 5 s, observe: 10 s}
record: {peaks: 3}
"""


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    from nsdrill.app.run import run_study
    from nsdrill.study import parse_study

    path = tmp_path_factory.mktemp("starts") / "out.h5"
    run_study(parse_study(TEXT), path, workers=1)
    return path


def test_check_counts_the_starts(call: Call) -> None:
    Path("s.yaml").write_text(TEXT)
    answer = call("check", "s.yaml")
    assert "14 points: depth 2000 m to 3000 m (2 values); every operating point from 7 states, an" in answer.out


def test_show(call: Call, made: Path) -> None:
    answer = call("show", made)
    assert "7 of every operating point, drawn at random" in answer.out
    assert "Attractors, by their share of the starts (95 % interval):" in answer.out
    table = answer.out.partition("Attractors")[2].partition("\n\n")[0]
    assert "2000 m" in table
    assert "3000 m" in table
    assert "unsettled" in table
    assert "Along the sweep" not in answer.out, "one start has intervals, several have shares"


def test_show_for_programs(call: Call, made: Path) -> None:
    summary = json.loads(call("show", made, "--json").out)
    assert summary["starts"] == 7
    shares = [one["share"] for point in summary["operating_points"] for one in point["attractors"]]
    assert sum(shares) == pytest.approx(2.0)


def test_a_long_table_is_cut(call: Call, made: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("nsdrill.text.show.MAX_ROWS", 1)
    assert "more lines (all with --json)" in call("show", made).out


def test_replay_wants_the_start(call: Call, made: Path) -> None:
    answer = call("replay", made, "--depth", "2 km", "-o", "t.h5", code=2)
    assert "has 7 starts. Say which one with --start, 0 to 6." in answer.err
    answer = call("replay", made, "--depth", "2 km", "--start", 5, "-o", "t.h5")
    assert "same, start 5." in answer.err
    assert "bit for bit" in answer.err


def test_plot(call: Call, made: Path) -> None:
    for kind in ("shares", "attractors"):
        call("plot", made, "--kind", kind, "-o", f"{kind}.png")
    call("plot", made, "--depth", "2 km", "--states", "x,vx", "-o", "basin.png")
    call("plot", made, "--kind", "summary", "--start", 2, "-o", "one.png")
    assert "with --start, 0 to 6" in call("plot", made, "--kind", "summary", "-o", "two.png", code=2).err
    assert not Path("two.png").exists()


def test_classify(call: Call, made: Path) -> None:
    Path("copy.h5").write_bytes(made.read_bytes())
    assert "attractor: " in call("classify", "copy.h5", "--set", "classify.attractors.tolerance=100").err
    assert read_results("copy.h5")["attractor"].max() <= read_results(made)["attractor"].max()
    assert "at least 1e-09" in call("classify", "copy.h5", "--set", "classify.attractors.tolerance=0", code=2).err
