"""The operating window as a user asks for it: the note, the JSON, the picture, and what is
no sweep."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from analysis.grids import grid

import nsdrill
from nsdrill import figures
from nsdrill.analysis.confirmed import confirmed
from nsdrill.analysis.trials import SPEED_FIRST, Outcome, Trial, Trials, Way
from nsdrill.analysis.window import find_window
from nsdrill.store import log_from_results, part_path
from nsdrill.text.window_text import lines

LINES = ["sssssww", "s....ww", "s...www", "s...www", "bbbbbbb"]
SPEEDS = np.arange(1.0, 8.0)
WEIGHTS = np.arange(10e3, 60e3, 10e3)


def note(units: str = "si", everything: bool = True, **maps: list) -> str:
    made = grid({name: [one] for name, one in (maps or {"up": LINES, "down": LINES}).items()}, SPEEDS, WEIGHTS)
    return " ".join("\n".join(lines(find_window(made), units, everything)).split())


def test_the_note():
    text = note()
    for said in (
        "Run at 30 kN and 3 rad/s (28.6 rpm): free of vibration at 2 to 4 rad/s (19.1 to 38.2 rpm), 20 to 40 kN, "
        "brought up from below or back down after vibration.",
        "Slower: at 1 rad/s (9.55 rpm) it sticks. Faster: at 5 rad/s (47.7 rpm) it whirls. Never exceed 4 rad/s",
        "Lighter: at 10 kN it sticks. Heavier: at 50 kN it bounces.",
        "allowed: the run, brought up from below, ends well without a critical response",
        "At 5000 m, 35 points: 25 critical, 10 safe after any history.",
        "Allowed along the speed: 20 kN: 2 to 5 rad/s (19.1 to 47.7 rpm) 30 kN: 2 to 4 rad/s",
    ):
        assert said in text


def test_of_many_rows_some_are_told_and_how_many_there_are(monkeypatch):
    monkeypatch.setattr("nsdrill.text.window_text.MAX_ROWS", 2)
    text = note()
    assert "30 kN: 2 to" not in text
    assert "40 kN: 2 to 4 rad/s (19.1 to 38.2 rpm) (2 of 3; all with --json)" in text


def test_the_numbers_are_told_when_they_are_asked_for():
    text = note(everything=False)
    assert "of 35 points" not in text
    assert text.endswith("the numbers with --all)")


def test_the_note_in_field_units():
    text = note("field")
    # 30 kN / 4.448 kN/klbf = 6.744; 3 rad/s = 28.65 rpm; 5000 m = 16404 ft
    assert "Run at 6.5 klbf and 29 rpm: " in text
    assert "At 16404 ft" in text
    assert "rad/s" not in text
    assert "kN" not in text


def test_what_whirls_coming_down_is_allowed_from_below():
    text = note(up=[LINES[0], *["s....ww"] * 3, LINES[4]], down=[LINES[0], *["s...www"] * 3, LINES[4]])
    assert "Faster: at 5 rad/s (47.7 rpm) it is free from below only: coming down it whirls." in text
    assert "23 critical, 3 safe from below only, 9 safe after any history." in text


def test_one_procedure_is_said_plainly():
    text = note(up=LINES)
    assert "HISTORY WAS NOT EXAMINED: the file holds one procedure only (up)." in text
    assert "No run tells what a disturbance does." in text


def test_no_room_is_said():
    assert "No setting has room. Narrow hint: " in note(up=["wwwwwww", "ww.wwww", "www.www", "wwwwwww", "wwwwwww"])
    assert "hint" not in note()


def test_failed_runs_are_counted():
    """Of the first weight; after the second one nothing was carried on."""
    text = note(up=[LINES[0], "s....xx", *LINES[2:]], down=LINES)
    assert "2 of 70 runs failed, at 2 points." in text
    assert "23 critical, 10 safe after any history, 2 unknown (2 failed)." in text
    assert "unknown" not in note()


def test_a_failed_map_is_not_critical(call, shared):
    """Of the study that fails with 1000 steps: what failed going up or down is in none
    of the shares."""
    out = " ".join(call("window", shared / "failing.h5", "--all").out.split())
    found = json.loads(call("window", shared / "failing.h5", "--json").out)
    assert found["unknown"] == found["unknown_failed"] > 0
    assert found["safe"] + found["rim"] + found["critical"] + found["unknown"] == found["points"]
    why = "failed or not carried" if found["after_failure"] else "failed"
    assert f"{found['unknown']} unknown ({found['unknown']} {why})" in out
    assert "overrides simulation.max_steps = 1000" in out
    assert found["overrides"] == {"simulation.max_steps": "1000"}


def test_nothing_safe_says_what_is_in_the_way():
    text = note(up=["sssssww"] * 5, down=["wwwwwww"] * 5)
    assert text.startswith("Nothing is safe: stick-slip at 1 to 5 rad/s (9.55 to 47.7 rpm), whirl at 6 to 7 rad/s")
    assert "Critical responses, on any way: stick-slip at 25, whirl at 35 points." in text


@pytest.mark.parametrize(
    ("sequence", "said"),
    [
        ("..w.", "Going down, the window is open from the first depth and closes at 3000 m; it reopens at 4000 m."),
        ("..ww", "Going down, the window is open from the first depth and closes at 3000 m for good"),
        ("w...", "Going down, the window opens at 2000 m and stays open to the last, 4000 m."),
        ("wwww", "Going down, the window is closed at every depth."),
    ],
)
def test_the_closing_depth(sequence, said):
    maps = [[f"{sign}{sign}w", "www"] for sign in sequence]
    data = grid({"up": maps, "down": maps}, [1, 2, 3], [10e3, 20e3], [1000, 2000, 3000, 4000])
    text = "\n".join(lines(find_window(data), "si", everything=True))
    assert said in text
    assert "best point, and how far from there" in text


def test_a_real_run(call, shared):
    answer = call("window", shared / "small.h5", "--picture", "window.png")
    assert answer.err == "window.png: drawn.\n"
    assert "small.h5: operating window. Small" in answer.out
    assert Path("window.png").stat().st_size > 5000
    found = json.loads(call("window", shared / "small.h5", "--json").out)
    assert found["axes"] == ["rotary_speed"]
    assert found["points"] == 8
    assert json.loads(call("window", shared / "map.h5", "--json", "--units", "field").out)["axes"] == [
        "rotary_speed",
        "wob",
    ], "JSON is in SI units"
    found = json.loads(call("window", shared / "map.h5", "--severity", "4", "--json").out)
    assert found["grades"]["stalled"] == 2, "which no severity allows"
    assert set(found["answer"]) >= {
        *("kind", "sentence", "point", "way_in", "stay_within", "never_exceed", "recover", "surface"),
        *("warnings", "would_help"),
    }
    call("plot", shared / "small.h5", "--kind", "window", "-o", "again.png")
    assert Path("again.png").read_bytes() == Path("window.png").read_bytes()


def test_an_unfinished_run(call, shared):
    log_from_results(shared / "small.h5", part_path("out.h5")).close()
    assert "unfinished run" in call("window", part_path("out.h5"), code=2).err
    assert "--resume" in call("window", "out.h5", code=2).err


def test_two_studies_are_compared(call, shared, tmp_path):
    """A file with its copy: nothing is gained; with one of other axes: refused."""
    map_file, copy = shared / "map.h5", shutil.copy(shared / "map.h5", tmp_path / "copy.h5")
    out = call("window", map_file, copy, "--units", "field").out
    assert "The studies are the same." in out
    assert "common points safe; " in out
    assert "a and b: THE MAP ENDS" in out, "what holds for both stands once"
    found = json.loads(call("window", map_file, copy, "--json").out)
    assert (found["gained"], found["lost"], found["both"]) == (0, 0, found["windows"][0]["safe"])
    assert all(row["lower"]["moved"] == row["upper"]["moved"] == 0.0 for row in found["borders"])
    picture = tmp_path / "two.svg"
    call("window", map_file, copy, "--picture", picture)
    text = picture.read_text()
    assert "safe in a" not in text, "nothing is"
    assert "map.h5" in text
    assert "the same axes" in call("window", map_file, shared / "small.h5", code=2).err


ABOVE_THE_WALL = """
title: Above the wall
drillstring: {eccentricity: 12.7 mm}
modes: {torsional: frozen}
bit: {lobes: 1, surface_amplitude: 0 mm}
operation: {depth: 3000 m}
sweep: {wob: [40 kN, 80 kN], rotary_speed: [12 rad/s, 13 rad/s], procedure: up, along: rotary_speed}
simulation: {transient: 100 s, observe: 20 s}
"""


def test_every_picture_of_a_window_says_where_the_sweep_begins(call):
    """The warning of the text, by ``window``, by ``plot`` and in Python, as the picture is what is
    sent: in capitals, and with ``--text`` in words, with the speed. Of a study that settles."""
    Path("above.yaml").write_text(ABOVE_THE_WALL)
    call("run", "above.yaml", "-o", "above.h5", "--quiet")
    assert "THE SWEEP BEGINS at 12 rad/s" in " ".join(call("window", "above.h5", "--all").out.split())
    assert "NOT SETTLED" not in call("window", "above.h5", "--all").out
    for more, said in ((), "THE SWEEP BEGINS"), (("--text",), "THE SWEEP BEGINS at 12 rad/s"):
        call("window", "above.h5", "--picture", "one.svg", "--overwrite", *more)
        call("plot", "above.h5", "--kind", "window", "-o", "two.svg", "--overwrite", *more)
        figure = nsdrill.plot("above.h5", "window", text=bool(more))
        texts = [*(Path(name).read_text() for name in ("one.svg", "two.svg")), figure.legends[0].get_title().get_text()]
        for text in texts:
            assert said in text


def test_every_number_of_a_field_study_has_field_units(call, tmp_path):
    """What is safe, torques and rates alike; and no digits of the conversion."""
    study = tmp_path / "study.yaml"
    study.write_text(
        "units: field\noperation: {wob: 20 klbf, depth: 5000 ft}\nmodes: {lateral: frozen}\n"
        "sweep: {wob: [10 klbf, 20 klbf], rotary_speed: [60 rpm, 140 rpm, 150 rpm, 160 rpm], procedure: up, "
        "along: rotary_speed}\n"
        "simulation: {transient: 30 s, observe: 20 s}\n"
    )
    call("run", study, "-o", tmp_path / "field.h5")
    found = json.loads(call("window", tmp_path / "field.h5", "--json").out)
    spans = [end for row in found["maps"][0]["rows"] for ends in row["safe"] for end in ends]
    assert spans
    assert set(spans) <= {60.0, 140.0, 150.0, 160.0}
    assert found["answer"]["surface"]["torque"]["surface_torque_mean"] < 100.0  # kft lbf
    assert found["units"] | {"rotary_speed": "rpm", "wob": "klbf", "surface_torque_mean": "kft*lbf"} == found["units"]
    for one in found["lasting_motions"]:
        assert one["passing_rate"] is None or one["passing_rate"]["units"] == "rpm/s"


def test_the_picture_of_a_window_with_trials_is_that_of_the_answer_with_them(call, shared, monkeypatch):
    """What it looks like is tested with the pictures."""
    drawn = []

    def draw(data, kind, tried=None, **how):
        drawn.append(tried)
        return figures.draw(data, kind, tried=tried, **how)

    way = Trial(SPEED_FIRST, Way.IN, Outcome.VIBRATES, rate=1.0)
    given = lambda found, *_, **__: {**found, "answer": confirmed(found["answer"], Trials((way,)))}  # noqa: E731
    monkeypatch.setattr("nsdrill.app.answering.window_trials.tried", given)
    monkeypatch.setattr("nsdrill.app.picture_making.draw", draw)
    for trials in (["--trials"], []):
        call("window", shared / "map.h5", *trials, "--picture", "window.svg", "--overwrite")
    assert drawn[0].trials.trials == (way,)
    assert drawn[1] is None
