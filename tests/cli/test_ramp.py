"""A ramp from the command line: check, simulate, show, plot; and what refuses it."""

from __future__ import annotations

import json
from pathlib import Path

import h5py
import numpy as np
import pytest

from .helpers import Call

STUDY = """\
title: Slowly up
operation:
  depth: 2000 m
  rotary_speed: {ramp: [[0 s, 3 rad/s], [2 s, 5 rad/s], [3 s, 5 rad/s], [4 s, 4 rad/s]]}
"""


@pytest.fixture
def ramp(tmp_path: Path) -> Path:
    (tmp_path / "ramp.yaml").write_text(STUDY)
    return tmp_path / "ramp.yaml"


def test_check_says_what_moves(call: Call, ramp: Path) -> None:
    answer = call("check", ramp)
    assert "Ramp, for nsdrill simulate: speed 3 rad/s at 0 s, 5 rad/s at 2 s" in answer.out
    assert "At the start of the ramp: 2000 m, 22.24 kN (5 klbf), 3 rad/s" in answer.out
    data = json.loads(call("check", ramp, "--json").out)
    assert data["ramps"]["rotary_speed"] == {"time": [0.0, 2.0, 3.0, 4.0], "value": [3.0, 5.0, 5.0, 4.0]}
    assert data["points"] == 0


def test_check_looks_at_the_whole_ramp(call: Call, ramp: Path) -> None:
    assert "Buckled: at 2000 kN" in call("check", ramp, "--set", "operation.wob={ramp: [[0 s, 0 N], [9 s, 2 MN]]}").err


def test_simulate_follows_the_ramp_to_its_last_knot(call: Call, ramp: Path) -> None:
    answer = call("simulate", ramp, "-o", "t.h5", "--units", "field")
    assert "speed 28.6479 rpm at 0 s, 47.7465 rpm at 2 s" in answer.err
    with h5py.File("t.h5") as file:
        assert file["time"][-1] == pytest.approx(4.0)
        assert file["drive_speed"][[0, 100, 250, -1]] == pytest.approx([3, 4, 5, 4])
        assert np.ptp(file["wob"]) == np.ptp(file["depth"]) == 0.0
        assert file.attrs["rotary_speed"] == 3.0
    told = call("show", "t.h5").out
    assert "ramp: 3 rad/s at 0 s, 5 rad/s at 2 s, 5 rad/s at 3 s, 4 rad/s at 4 s" in told
    assert json.loads(call("show", "t.h5", "--json").out)["ramps"]["rotary_speed"]["time"][-1] == 4.0


def test_options_replace_the_ramp_and_the_duration(call: Call, ramp: Path) -> None:
    call("simulate", ramp, "-o", "a.h5", "--duration", "1 s")
    call("simulate", ramp, "-o", "b.h5", "--duration", "5 s", "--rotary-speed", "6 rad/s")
    with h5py.File("a.h5") as short, h5py.File("b.h5") as constant:
        assert short["drive_speed"][-1] == pytest.approx(4.0)
        assert constant["time"][-1] == pytest.approx(5.0)
        assert np.all(constant["drive_speed"][()] == 6.0)
        assert "ramps" not in constant.attrs


def test_run_refuses_a_ramp(call: Call, ramp: Path) -> None:
    answer = call("run", ramp, "-o", "out.h5", code=2)
    assert "found no sweep, only a ramp in operation.rotary_speed" in answer.err
    assert "nsdrill simulate" in answer.err
    answer = call("run", ramp, "-o", "out.h5", "--set", "sweep={wob: [1 kN, 2 kN]}", code=2)
    assert "found a ramp in operation.rotary_speed beside a sweep of wob" in answer.err
    assert not Path("out.h5").exists()
    assert not Path("out.h5.part").exists()


def test_a_sweep_replaces_the_ramp_of_its_axis(call: Call, ramp: Path) -> None:
    words = (
        "--set",
        "sweep={rotary_speed: [3 rad/s, 4 rad/s]}",
        "--set",
        "simulation.transient=1 s",
        "--set",
        "simulation.observe=1 s",
    )
    call("run", ramp, "-o", "out.h5", *words)
    # which follows the ramp all the same
    call("simulate", ramp, "-o", "t.h5", *words)
    assert "ramp: 3 rad/s" in call("show", "t.h5").out


def test_pictures_of_a_ramp(call: Call, ramp: Path) -> None:
    call("simulate", ramp, "-o", "t.h5")
    call("simulate", ramp, "-o", "plain.h5", "--rotary-speed", "3 rad/s")
    assert "ramp  " in call("plot", "t.h5", "--kind", "list").out
    assert "ramp  " not in call("plot", "plain.h5", "--kind", "list").out
    call(
        f"run {ramp} -o out.h5 --quiet --set 'sweep={{rotary_speed: [3 rad/s, 4 rad/s, 5 rad/s]}}' --set "
        "'simulation.transient=1 s' --set 'simulation.observe=5 s'"
    )
    call("plot", "t.h5", "-o", "a.png")
    call("plot", "t.h5", "-o", "b.png", "--kind", "ramp", "--over", "out.h5")
    for words, says in (
        (("plain.h5", "--kind", "ramp"), "does not fit a trace (it shows a run along a ramp)"),
        (("t.h5", "--kind", "orbit", "--over", "out.h5"), "found with --kind orbit"),
        (("out.h5", "--over", "out.h5"), "--over: found with --kind bifurcation; allowed: with --kind branches, ramp"),
        (("t.h5", "--kind", "ramp", "--over", "plain.h5"), "--over: found a trace"),
        (("t.h5", "--kind", "ramp", "--over", "none.h5"), "no such file"),
    ):
        assert says in call("plot", *words, "-o", "c.png", code=2).err
    assert not Path("c.png").exists()
