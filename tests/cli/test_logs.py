"""Logs on the command line: along them, over a picture, and in a fit."""

import json
from pathlib import Path

import numpy as np
import pytest

import nsdrill

from .helpers import unwrapped

RPM = np.pi / 30
STUDY = """\
model: torsion
operation: {depth: 2500 m, wob: 60 kN}
simulation: {transient: 5 s, observe: 5 s}
sweep: {rotary_speed: {from: 60 rpm, to: 100 rpm, points: 3}}
"""
UNKNOWN = "{bit.friction.static: {uniform: [0.3, 0.5]}}"
NAMED = ("--rename", "WOBA=wob", "--rename", "RPMA=rotary_speed", "--rename", "TQA=surface_torque")


@pytest.fixture(autouse=True)
def files(call):
    """Ten rows of drilling, three of a connection, thirty of drilling."""
    Path("study.yaml").write_text(STUDY, encoding="utf-8")
    rows = [f"12:00:{i:02d},50,{70 + i % 2},9.{i % 10}" for i in range(10)]
    rows += [f"12:00:{i:02d},-1,0,0" for i in range(10, 13)]
    rows += [f"12:00:{i:02d},50,{80 + i % 2},9.{i % 10}" for i in range(13, 43)]
    Path("rig.csv").write_text("\n".join(["clock,WOBA (kN),RPMA (c/min),TQA (kN.m)", *rows]) + "\n", encoding="utf-8")


def test_a_run_follows_the_longest_part_of_a_log(call):
    answer = call("simulate", "study.yaml", "-o", "trace.h5", "--data", "rig.csv", *NAMED[:4])
    assert "rig.csv: time: clock, from 12:00:00; lines 15 to 44 are followed, 29 s; 3 rows not drilling" in answer.err
    trace = nsdrill.open_results("trace.h5")
    times, values = json.loads(trace.attrs["ramps"])["rotary_speed"]
    np.testing.assert_allclose(times, np.arange(30.0))
    np.testing.assert_allclose(values, [(80 + i % 2) * RPM for i in range(13, 43)])
    assert float(trace.attrs["wob"]) == 50e3  # a column that does not change is no ramp
    told = trace.attrs["followed"]
    assert "3 rows not drilling or not usable: 3 with wob below 0" in told
    assert f"  log            {told}" in call("show", "trace.h5").out
    assert json.loads(call("show", "trace.h5", "--json").out)["followed"] == told
    np.testing.assert_allclose(trace.drive_speed[::100], values[: len(trace.drive_speed[::100])], rtol=1e-9)


@pytest.mark.parametrize("speed", ["70", "moving"])
def test_a_run_beyond_the_end_of_its_log_says_that_the_last_values_are_held(call, speed):
    """A log of a minute; one of constant settings, which is no ramp, is as long."""
    rows = [f"{i},{60 + i if speed == 'moving' else speed},50" for i in range(61)]
    Path("log.csv").write_text("\n".join(["time [s],rotary_speed [rpm],wob [kN]", *rows]) + "\n", encoding="utf-8")
    run = ("simulate", "study.yaml", "--data", "log.csv", "-o")
    for name, more in (("a.h5", ()), ("b.h5", ("--duration", "60 s"))):
        assert "held" not in call(*run, name, *more).err
        trace = nsdrill.open_results(name)
        assert float(trace.time[-1]) == 60.0
        assert "held_from" not in trace.attrs
    told = call(*run, "c.h5", "--duration", "90 s").err
    assert "Warning: log.csv: it lasts 60 s; from there to 90 s its last values are held." in unwrapped(told)
    assert "held: the last values from 60 s" in told
    trace = nsdrill.open_results("c.h5")
    assert float(trace.attrs["held_from"]) == 60.0
    assert np.all(trace.drive_speed[6000:] == trace.drive_speed[-1])
    assert "the last values from 60 s, where the ramps end, to 90 s" in call("show", "c.h5").out
    assert json.loads(call("show", "c.h5", "--json").out)["held_from"] == 60.0


@pytest.mark.parametrize("head", ["tme", "Elapsed", "t", "Rig Time"])
def test_a_time_under_another_head_is_suggested(call, head):
    rows = [f"{i},{60 + i},50,9" for i in range(9)]
    heads = f"{head} [s],rotary_speed [rpm],wob [kN],surface_torque [kN*m]"
    Path("log.csv").write_text("\n".join([heads, *rows]) + "\n", encoding="utf-8")
    run = ("simulate", "study.yaml", "--data", "log.csv", "-o")
    assert f"--time '{head}' says that {head} is it." in call(*run, "a.h5", code=2).err
    assert f"Did you mean '{head}'?" in call(*run, "a.h5", "--time", "time", code=2).err
    call(*run, "a.h5", "--time", head)
    fit = call("fit", "study.yaml", "--data", "log.csv", "--set", f"uncertain={UNKNOWN}", code=2).err
    assert "Did you mean time?" in fit or f"'{head}=time'" in fit


@pytest.mark.parametrize("head", ["RPM", "Speed", "Surface revs"])
def test_a_log_says_which_column_of_speed_it_does_not_follow(call, head):
    rows = [f"{i},{5 + i},{100 + i}" for i in range(9)]
    Path("log.csv").write_text("\n".join([f"Time [s],WOB [kN],{head} [rpm]", *rows]) + "\n", encoding="utf-8")
    told = call("simulate", "study.yaml", "-o", "trace.h5", "--data", "log.csv").err
    assert f"NOT FOLLOWED: {head}. rotary_speed is that of the study; --rename '{head}=rotary_speed' follows it" in told
    assert (
        "NOT FOLLOWED"
        not in call("simulate", "study.yaml", "-o", "b.h5", "--data", "log.csv", "--rename", f"{head}=rotary_speed").err
    )


def test_python_follows_a_log_with_the_bits_of_a_ramp():
    with pytest.warns(nsdrill.RunWarning, match="lines 15 to 44 are followed"):
        trace = nsdrill.simulate("study.yaml", data="rig.csv", rename={"RPMA": "rotary_speed"}, sample="0.1 s")
    knots = [[f"{i} s", f"{80 + (13 + i) % 2} rpm"] for i in range(30)]
    ramp = nsdrill.simulate("study.yaml", set={"operation.rotary_speed": {"ramp": knots}}, sample="0.1 s")
    np.testing.assert_array_equal(trace.bit_speed, ramp.bit_speed)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (
            ["--data", "rig.csv"],
            "found no depth, wob or rotary_speed beside the time; allowed: one or more. Ignored: WOBA",
        ),
        (["--rename", "RPMA=wob"], "--rename: found without --data; allowed: with it"),
        (["--data", "rig.csv", "--orbit", "b.h5", "--point", "1"], "--data: found with an orbit"),
    ],
)
def test_what_cannot_be_followed_is_refused(call, words, said):
    assert said in call("simulate", "study.yaml", "-o", "trace.h5", *words, code=2).err
    assert not Path("trace.h5").exists()


def test_a_log_is_drawn_over_a_picture(call):
    call("run", "study.yaml", "-o", "out.h5", "--quiet")
    words = ["plot", "out.h5", "--kind", "surface_torque_max", "--data", "rig.csv", "-o", "out.png"]
    answer = call(
        *words, "--rename", "RPMA=rotary_speed", "--rename", "TQA=surface_torque", "--shortest", "20s", "--settle", "5s"
    )
    assert "rig.csv: 1 measurement drawn." in answer.err
    assert "1 interruption, 3 rows of 43 not drilling or not usable" in answer.err
    assert Path("out.png").stat().st_size > 5000
    assert "--unit: found without --data" in call("plot", "out.h5", "--unit", "a=kN", "-o", "b.png", code=2).err


def test_a_fit_says_what_it_read(call):
    words = ["fit", "study.yaml", "--data", "rig.csv", *NAMED, "--shortest", "20s", "--settle", "5s", "--quiet"]
    more = ["--set", "uncertain={bit.friction.static: {uniform: [0.3, 0.6]}}", "--batch", "16", "--rounds", "2"]
    answer = call(*words, *more, "-o", "adjusted.yaml")
    adjusted = Path("adjusted.yaml").read_text(encoding="utf-8")
    assert "# Of the data: 1 interruption, 3 rows of 43 not drilling or not usable: 3 with wob below 0" in adjusted
    assert "1 operating point, 2 measured values" in answer.out  # the model torsion has no mean torque
    assert "1 interruption, 3 rows of 43 not drilling or not usable: 3 with wob below 0" in answer.out
    refused = call(*words, "--surface-torque", "bit", *more, code=2).err
    assert "--surface-torque: found 'bit'; allowed: string, motor" in refused


def test_a_fit_takes_the_rows_of_one_well(call):
    rows = [f"{'B' if i < 4 else 'C'},{70 + i},{9 + i % 3}" for i in range(8)]
    Path("wells.csv").write_text(
        "\n".join(["well,rotary_speed [rpm],surface_torque_max [kN*m]", *rows]) + "\n", encoding="utf-8"
    )
    words = ["fit", "study.yaml", "--data", "wells.csv", "--set", f"uncertain={UNKNOWN}", "--batch", "16"]
    words += ["--rounds", "2", "--quiet"]
    assert "--only 'well=B' takes those of one" in unwrapped(call(*words, "--ignore", "*").out)
    assert "4 operating points, 4 measured values" in call(*words, "--only", "well=B").out
    steady = Path("wells.csv").read_text(encoding="utf-8").replace("surface_torque_max [kN*m]", "stick_slip_period [s]")
    Path("wells.csv").write_text(steady, encoding="utf-8")
    none = call(*words, "--ignore", "*", "--set", "operation.wob=1 kN", "--set", "simulation.observe=60 s", code=2).err
    assert "have none; allowed: a value that runs have" in none
    assert "--only 'well=B' takes those of one" in none
    assert "--only: found without --data" in call("simulate", "study.yaml", "-o", "a.h5", "--only", "a=b", code=2).err
