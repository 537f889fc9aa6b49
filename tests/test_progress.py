"""What a run says of its progress: a bar, lines, a call, or nothing."""

import json
import os
import re
import subprocess
import sys
import threading
import time
from itertools import pairwise

import pytest

import nsdrill
from nsdrill import progress
from nsdrill.app.following import seeding
from nsdrill.cli.main import group
from nsdrill.compiler.functions import compiling
from nsdrill.orbit.explore import Going, Wave
from nsdrill.progress import Progress, pace, reporting, seconds_left
from nsdrill.sweep.engine import Progress as Counts


def test_without_a_terminal_a_short_run_says_nothing(small, capsys):
    nsdrill.run(small)
    assert capsys.readouterr() == ("", "")


def test_without_a_terminal_a_line_now_and_then(small, capsys, monkeypatch):
    monkeypatch.setattr(progress, "LINE_SECONDS", 0.0)
    nsdrill.run(small)
    out, lines = capsys.readouterr()
    assert out == ""
    assert lines.splitlines()[-1].startswith("16 of 16 points; ")
    nsdrill.run(small, progress=False)
    assert capsys.readouterr() == ("", "")


def test_lines_name_failures_and_the_pass(capsys, monkeypatch):
    monkeypatch.setattr(progress, "LINE_SECONDS", 0.0)
    with reporting(True) as watch:
        watch(Counts(total=40, before=10, done=0, failed=0))
        watch(Counts(total=40, before=10, done=5, failed=2, note="check: tight"))
    first, second = capsys.readouterr().err.splitlines()
    assert first == "10 of 40 points; starting"
    assert second.startswith("15 of 40 points, 2 failed; ")
    assert second.endswith(" left (check: tight)")


@pytest.mark.parametrize(("procedure", "words"), [("same", "/s, 0:00 left"), ("up", "/s, at least 0:00 left")])
def test_where_the_state_is_carried_the_time_left_is_the_least(small, capsys, monkeypatch, procedure, words):
    """The rate falls as the chains end: measured, half to four fifths of the time in the
    first half of a run. The checks of the points are no chains."""
    monkeypatch.setattr(progress, "LINE_SECONDS", 0.0)
    nsdrill.run(small, set={"sweep.procedure": procedure, "simulation.verify": True})
    lines = [line for line in capsys.readouterr().err.splitlines() if " points; " in line]
    assert [line.endswith(words) for line in lines if line.startswith("8 of 8 ")] == [True]
    assert lines[-1].startswith("24 of 24 ")
    assert lines[-1].endswith("/s, 0:00 left (check: long)")


def test_compiling_is_told_and_is_no_part_of_an_estimate(capsys, monkeypatch):
    """A second of compiling before 10 points in 0.1 s: the other 30 take 0.3 s."""
    monkeypatch.setattr(progress, "LINE_SECONDS", 0.0)
    monkeypatch.setattr(progress, "COMPILING_SECONDS", 0.0)
    now, seen, told = 0.0, [], threading.Event()
    monkeypatch.setattr(time, "monotonic", lambda: now)
    tell = progress.telling_compiling
    monkeypatch.setattr(progress, "telling_compiling", lambda line: tell(lambda text: (line(text), told.set())))
    with reporting(True) as watch, reporting(seen.append) as record:
        watch(Counts(total=40, note="compiling"))
        with compiling.function():
            assert told.wait(60.0)
            now += 1.0
        now += 0.1
        watch(Counts(total=40, done=10))
        record(Counts(total=40, done=10))
    first, second, third = capsys.readouterr().err.splitlines()
    assert first == "compiling the equations ..."
    assert second == "compiled in 1.0 s; kept for the next run"
    assert third == "10 of 40 points; 100/s, 0:00 left"
    assert seen[0].seconds_left == pytest.approx(0.3)


def test_loading_code_is_not_told(capsys):
    with reporting(True) as watch:
        with compiling.function():
            pass
        watch(Counts(total=40, done=40))
    assert capsys.readouterr().err == ""


COMMANDS = {
    "run": "run study.yaml -o out.h5",
    "simulate": "simulate study.yaml -o trace.h5",
    "branches": "branches study.yaml -o branches.h5",
    "fit": "fit study.yaml --data field.csv --batch 16 --rounds 2",
}


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_tells_its_compiling(name, tmp_path):
    (tmp_path / "study.yaml").write_text(
        "model: torsion\noperation: {rotary_speed: 5 rad/s}\n"
        "simulation: {transient: 5 s, observe: 5 s}\n"
        "continue: {along: rotary_speed, from: 4 rad/s, to: 6 rad/s, seeds: {rotary_speed: [5 rad/s]}, points: 6}\n"
        + (name == "fit")
        * "uncertain: {bit.friction.static: {uniform: [0.2, 0.8]}}\n"
    )
    (tmp_path / "field.csv").write_text("rotary_speed [rad/s], bit_speed_max [rad/s]\n4, 6\n5, 7\n6, 8\n")
    program = (
        "import sys, nsdrill.progress as p; p.COMPILING_SECONDS = 0.0; "
        "from nsdrill.cli.main import group; group(sys.argv[1:], standalone_mode=False)"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, *COMMANDS[name].split()],
        cwd=tmp_path,
        env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cold")},
        capture_output=True,
        text=True,
        check=True,
    )
    lines = [line.strip() for line in done.stderr.splitlines()]
    told = lines.index("compiling the equations ...")
    assert re.fullmatch(r"compiled in \d+\.\d s; kept for the next run", lines[told + 1])


def test_branches_say_how_far_they_are(monkeypatch):
    """Which branches go on, their points and where they are, and what is kept; the time so
    far, and not that which is left, which nobody knows."""
    study = nsdrill.load_study({"model": "torsion", **FOLLOWED})
    now, said = 0.0, []
    monkeypatch.setattr(progress.time, "monotonic", lambda: now)
    with progress.telling(said.append) as told:
        lines = seeding.Following(told, seeding.continuation_setup(study))
        steady, cycle = Going(("equilibrium", 1), 40, (3.0, 2.0)), Going(("limit_cycle", 1), 20, (4.123456,))
        for now, wave in (  # noqa: B007
            (0.0, Wave(1, 4, (steady, steady, cycle, cycle), 50, 60)),
            (5.0, Wave(1, 4, (steady, steady, cycle, cycle), 50, 60)),
            (70.0, Wave(1, 4, (steady, steady, cycle, cycle), 50, 60)),
            (100.0, Wave(1, 4, (steady, cycle), 50, 60)),
            (101.0, Wave(2, 1, (cycle,), 20, 60)),
        ):
            lines.watch(wave)
            lines.kept("1 branch, 30 points")
    assert said == [
        "round 1: 4 branches followed side by side; 10 of 60 seeds lie on a branch or are given up",
        "4 of 4 branches go on, 120 points, rotary_speed from 2 rad/s to 4.123 rad/s; round 1, "
        "kept: 1 branch, 30 points; 1:10 so far",
        "steady drilling, 40 points, rotary_speed 2 rad/s and 3 rad/s; a limit cycle, 20 points, rotary_speed "
        "4.123 rad/s; round 1, kept: 1 branch, 30 points; 1:40 so far",
        "round 2: 1 branch followed side by side; 40 of 60 seeds lie on a branch or are given up",
    ]
    assert seeding.dropped_words(22, 22) == ""
    assert seeding.dropped_words(32, 22).startswith("32 branches were followed; 10 of them")


FOLLOWED = {
    "operation": {"rotary_speed": "5 rad/s"},
    "simulation": {"transient": "5 s", "observe": "5 s"},
    "continue": {
        "along": "rotary_speed",
        "from": "4 rad/s",
        "to": "6 rad/s",
        "seeds": {"rotary_speed": ["5 rad/s"]},
        "points": 6,
    },
}


@pytest.fixture(params=["python", "command"])
def follow(request, tmp_path, monkeypatch):
    """Follow the branches of a study, as Python and the command line do."""
    monkeypatch.chdir(tmp_path)
    study = {"model": "torsion", **FOLLOWED}
    if request.param == "python":
        return lambda: nsdrill.continue_branches(study)
    (tmp_path / "study.yaml").write_text(json.dumps(study))
    return lambda: group(["branches", "study.yaml", "-o", "b.h5", "--overwrite"], standalone_mode=False)


def test_without_a_terminal_short_branches_say_nothing(follow, capsys, monkeypatch):
    monkeypatch.setattr(progress, "LINE_SECONDS", 1e3)
    monkeypatch.setattr(progress, "COMPILING_SECONDS", 1e3)
    follow()
    told = capsys.readouterr().err.splitlines()
    assert [line for line in told if not line.startswith("b.h5: ")] == []


def test_without_a_terminal_branches_have_a_line_now_and_then(follow, capsys, monkeypatch):
    monkeypatch.setattr(progress, "LINE_SECONDS", 0.0)
    follow()
    told = capsys.readouterr().err
    assert re.search(r"^round 1: 1 branch followed side by side; .*; 0:\d\d so far$", told, re.M)
    assert re.search(
        r"^steady drilling, \d+ points, rotary_speed [0-9.]+ rad/s( and [0-9.]+ rad/s)?; round 1, kept: none; "
        r"0:\d\d so far$",
        told,
        re.M,
    )
    assert nsdrill.continue_branches({"model": "torsion", **FOLLOWED}, progress=False).sizes["branch"] == 1
    assert capsys.readouterr() == ("", "")


def test_in_a_terminal_branches_show_where_they_are(follow, capsys, monkeypatch):
    monkeypatch.setattr("rich.console.Console.is_terminal", True)
    follow()
    assert "round 1: 1 branch followed side by side" in capsys.readouterr().err
    with progress.telling(True) as told:
        told.goes("here they are")
        time.sleep(0.3)  # it is drawn ten times a second
        told.begins("then this")
    *_, shown = capsys.readouterr()
    assert shown.index("0:00:00") < shown.index("here they are") < shown.index("then this")


def test_the_progress_of_branches_is_true_false_or_a_function():
    with pytest.raises(nsdrill.InputError, match="progress: found 3; allowed: True, False, or a function"):
        nsdrill.continue_branches({"model": "torsion", **FOLLOWED}, progress=3)


def test_what_is_left_follows_from_what_was_expected():
    """At first the time expected, 100 s; at last the pace of this session: 99 of 100 points
    in 198 s, so 2 s for the last one."""
    assert pace(0, 100, 0.0, expected=100.0) == "starting"
    assert seconds_left(0, 100, 0.0, 100.0) == 100.0
    assert seconds_left(99, 1, 198.0, 100.0) == pytest.approx(2.0, rel=0.01)
    assert seconds_left(0, 100, 0.0) is None
    assert pace(50, 50, 80.0, True, 100.0) == "37.5/min, about 1:05 left"  # (1 - 1/2) (100/2 + 80) s
    assert pace(50, 50, 80.0, True).endswith("at least 1:20 left")


def test_a_bar_in_a_terminal(small, capsys, monkeypatch):
    monkeypatch.setattr("rich.console.Console.is_terminal", True)
    nsdrill.run(small)
    out, shown = capsys.readouterr()
    assert out == ""
    assert "16/16" in shown


def test_a_notebook_without_widgets_has_lines(small, capsys, monkeypatch):
    monkeypatch.setattr("rich.console._is_jupyter", lambda: True)
    monkeypatch.setattr(progress, "find_spec", lambda name: None)
    monkeypatch.setattr(progress, "LINE_SECONDS", 0.0)
    nsdrill.run(small)
    assert "16 of 16 points" in capsys.readouterr().err


def test_a_function_is_told_how_far_the_run_is(monkeypatch):
    clock = iter([100.0, 101.0, 104.0])
    monkeypatch.setattr(progress.time, "monotonic", lambda: next(clock))
    seen = []
    with reporting(seen.append) as watch:
        watch(Counts(total=40, before=10, done=0, failed=0))
        watch(Counts(total=40, before=10, done=10, failed=1, note="check: long"))
    # 10 in 4 s, 20 are left
    assert seen == [Progress(10, 40, 0, None), Progress(20, 40, 1, 8.0, "check: long")]


def test_a_refined_and_checked_run_ends_at_its_total():
    seen = []
    nsdrill.run(
        {
            "operation.depth": "2 km",
            "simulation": {"transient": "1 s", "observe": "1 s", "verify": True},
            "sweep": {
                "wob": {"from": "20 kN", "to": "60 kN", "points": 3},
                "rotary_speed": {"from": "2 rad/s", "to": "6 rad/s", "points": 3},
                "refine": 1,
            },
        },
        progress=seen.append,
    )
    assert seen[-1].done == seen[-1].total > 9
    assert all(a.done <= b.done for a, b in pairwise(seen))


def test_a_fault_in_the_function_is_not_hidden(small, tmp_path):
    def broken(now):
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        nsdrill.run(small, tmp_path / "out.h5", progress=broken)
    with nsdrill.run(small, tmp_path / "out.h5", resume=True, progress=False) as data:
        assert int((data.status == 1).sum()) == 16
