"""A drive that does not turn as it is set: what such a run shows is not what the setting does."""

from dataclasses import replace

import numpy as np
import pytest
from cli.helpers import call_here

import nsdrill
from nsdrill.analysis.graded import graded
from nsdrill.analysis.histories import Grade
from nsdrill.analysis.window import find_window
from nsdrill.words.answer import warnings

from .grids import grid

SET = np.arange(6.0, 12.0)
RUNAWAY = """
model: torsion
operation: {depth: 3000 m, rotary_speed: 12 rad/s}
drillstring: {torsional_damping: 25 N*m*s/rad}
drive: {kind: stiff, torque_limit: 2.6 kN*m}
sweep: {wob: [40 kN, 95 kN], procedure: up-down}
simulation: {transient: 200 s, observe: 40 s}
"""


def results(mean, settled=1):
    """Settled, as a drive that has much to give back does not change its speed for a long time."""
    found = grid({"up": ["......"]}, SET)
    settling = np.full(found.shape, settled, np.int8)
    driven = {"drive_speed_mean": np.asarray(mean).reshape(found.shape), "settled": settling}
    return replace(found, variables={**found.variables, **driven})


def test_what_is_too_fast_and_shows_nothing_is_not_known():
    """The drive gives back the turns that it lagged: 20 % too fast at 9 rad/s."""
    mean = SET.copy()
    mean[3] *= 1.2
    maps = graded(results(mean))
    assert maps.grade.ravel()[3] == Grade.UNKNOWN
    assert np.count_nonzero(maps.grade == Grade.FROM_BELOW) == len(SET) - 1
    window = find_window(results(mean))
    assert window["off_speed"] == {"runs": 1, "of": 6, **dict.fromkeys(("least", "greatest"), pytest.approx(10.8))}
    assert window["known"] == 5
    assert any(one.startswith("OFF SPEED: in 1 of 6 runs") for one in warnings(window, "si"))


@pytest.mark.parametrize(("factor", "settled"), [(1.09, 0), (0.91, 0), (0.5, 1)])
def test_a_drive_that_keeps_near_its_speed_or_droops_is_judged(factor, settled):
    assert find_window(results(SET * factor, settled))["off_speed"] == {}


def test_a_drive_that_is_slowing_down_is_not_known():
    """On the way to a stall that no run of this length reaches."""
    window = find_window(results(SET * 0.5, settled=0))
    assert window["off_speed"]["runs"] == len(SET)
    assert window["known"] == 0


def test_after_a_stall_a_limited_drive_runs_away(tmp_path, capfd, monkeypatch):
    """Its integral has wound up for 240 s. Everything that is said of the file knows it."""
    (tmp_path / "study.yaml").write_text(RUNAWAY)
    path, out = tmp_path / "study.yaml", tmp_path / "out.h5"
    with pytest.warns(nsdrill.RunWarning, match=r"OFF SPEED: in 1 of 4 runs") as told:
        data = nsdrill.run(path, progress=False)
    said = call_here(capfd, monkeypatch, "run", path, "-o", out, "--workers", "1").err
    assert all(str(one.message) in " ".join(said.split()) for one in told)  # what a command says
    with pytest.warns(nsdrill.RunWarning, match="OFF SPEED"):  # and of what is finished
        nsdrill.run(path, out, resume=True, progress=False)
    down = data.sel(procedure="down", wob=40e3).squeeze()
    assert float(down["bit_speed_mean"]) > 30.0
    assert int(down["response"]) == 0
    assert not bool(data.nsdrill.safe().sel(procedure="down", wob=40e3).squeeze())
    assert bool(data.nsdrill.safe().sel(procedure="up", wob=40e3).squeeze())
    found = nsdrill.window(data)
    assert found["off_speed"]["runs"] == 1
    assert found["grades"].get("safe after any history", 0) == 0
    assert not any("free from there" in line for line in found["answer"]["lines"])
    assert "OFF SPEED" in nsdrill.show(data)


def test_a_drive_that_droops_is_told_of_at_the_setting():
    window = find_window(results(SET * 0.75))
    drive, set_speed = window["turns"]["drive"], window["turns"]["set"]
    assert drive == pytest.approx(0.75 * set_speed)
    assert set_speed == window["answer"].point["rotary_speed"]
    assert any(one.startswith("THE DRIVE TURNS SLOWER THAN IT IS SET") for one in warnings(window, "si"))
    assert find_window(results(SET))["turns"] is None


@pytest.mark.parametrize(("spread", "grade"), [(1.0, "safe after any history"), (0.01, "free from some starts only")])
def test_starts_that_are_close_together_are_no_other_histories(spread, grade):
    """At 24 to 30 rad/s no start of this string sticks; but three that hardly differ do not show it."""
    data = nsdrill.run(
        "{model: torsion, operation: {depth: 1000 m}, sweep: {rotary_speed: [24 rad/s, 26 rad/s, 28 rad/s, 30 rad/s]}, "
        f"initial: {{ensemble: 3, spread: {spread}}}, simulation: {{transient: 20 s, observe: 20 s}}}}",
        progress=False,
    )
    found = nsdrill.window(data)
    assert grade in found["grades"]
    assert found["spread"] == (None if spread == 1.0 else spread)
    told = "THE STARTS ARE CLOSE TOGETHER: initial.spread is 0.01"
    assert any(one.startswith(told) for one in found["answer"]["warnings"]) == (spread < 1.0)
