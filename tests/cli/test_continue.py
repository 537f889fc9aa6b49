"""nsdrill continue, and what the other commands do with its file."""

import csv
import json
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray

import nsdrill
from nsdrill.app.following import branch_data
from nsdrill.app.running.unfinished import Part, summary
from nsdrill.data import EDITED_SOURCE
from nsdrill.figures import draw
from nsdrill.orbit import explore
from nsdrill.store import open_branches, write_branches
from nsdrill.store.hdf5 import seal, unseal
from nsdrill.text.branch_text import _curve_lines, lines, stable_parts, turns

from .helpers import finish, start, unwrapped
from .test_fit_resume import has_state

STUDY = """\
title: Steady drilling and stick-slip
model: torsion
operation: {depth: 5000 m, wob: 22.24 kN}
simulation: {transient: 50 s, observe: 50 s}
continue:
  along: rotary_speed
  from: 1.5 rad/s
  to: 6 rad/s
  seeds: {rotary_speed: [5 rad/s]}
  points: 300
"""


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A file of branches beside its study."""
    folder = tmp_path_factory.mktemp("branches")
    (folder / "study.yaml").write_text(STUDY)
    nsdrill.continue_branches(folder / "study.yaml", folder / "b.h5")
    return folder


def test_the_file_is_read_by_xarray(made):
    with xarray.open_dataset(made / "b.h5", engine="h5netcdf") as data:
        assert data.attrs["nsdrill_kind"] == "branches"
        assert list(data["motion"].values) == ["equilibrium", "limit_cycle"]
        assert int(data["row_size"].sum()) == data.sizes["point"]
        for name in ("rotary_speed", "wob", "depth", "period", "unstable", "label", "arclength", "residual"):
            assert data[name].dims == ("point",)
        assert data["state"].shape == (data.sizes["point"], 2)
        assert list(data["state_name"].values) == ["twist", "bit_speed"]
        words = dict(zip(data["label"].attrs["flag_values"], data["label"].attrs["flag_meanings"].split(), strict=True))
        assert {words[code] for code in data["label"].values} >= {"hopf", "fold", "end"}
        assert float(data["residual"].max()) < 1e-6
        # Along a branch of steady drilling the bit turns at the set speed.
        steady = data["branch_of_point"].values == 0
        assert data["bit_speed_max"].values[steady] == pytest.approx(data["rotary_speed"].values[steady], rel=1e-6)


def test_show_says_what_special_points_mean(made, call):
    text = call("show", made / "b.h5").out
    assert "Branch 0: steady drilling" in text
    assert "hopf: steady drilling meets an oscillation" in text
    assert "fold: two motions, at most one of them stable, meet and vanish" in text
    assert "springs from branch 0" in text
    found = json.loads(call("show", made / "b.h5", "--json").out)
    assert found["kind"] == "branches"
    assert all(branch["end_reason"] for branch in found["branches"])
    (hopf,) = [one for one in found["branches"][0]["special"] if one["label"] == "hopf"]
    assert {hopf["unstable_before"], hopf["unstable_after"]} == {0, 2}
    assert hopf["criticality"] == "subcritical"
    assert hopf["normal_form"] > 4.0 * hopf["normal_form_error"]
    assert "small disturbances grow; stable to one side; subcritical: jumps" in text
    # Steady drilling is stable from the Hopf point on, stick-slip up to the fold.
    steady, cycle = found["branches"]
    (part,), (ends,) = steady["stable"], steady["stable_ends"]
    assert (min(part), {*ends}) == (hopf["value"], {"bifurcation", "branch"})
    (fold,) = [one for one in cycle["special"] if one["label"] == "fold"]
    assert max(max(part) for part in cycle["stable"]) == fold["value"]
    assert f"{hopf['value']:.4g} rad/s to {max(part):.4g} rad/s (end of the branch)" in text
    assert "rpm" in call("show", made / "b.h5", "--units", "field").out
    assert "continue:" in call("show", made / "b.h5", "--study").out


def test_a_file_without_normal_forms(made, tmp_path, call):
    """Another program may leave them out: what emanates is then not known."""
    data = open_branches(made / "b.h5").drop_vars(["criticality", "normal_form", "normal_form_error"])
    write_branches(tmp_path / "b.h5", data)
    assert "sub- or supercritical is not known" in call("show", tmp_path / "b.h5").out


def test_a_subcritical_point_is_hollow(made):
    figure = draw(open_branches(made / "b.h5"))
    points = {line.get_gid(): line for axes in figure.axes for line in axes.lines if line.get_gid()}
    assert points["special:hopf, subcritical"].get_markerfacecolor() == "white"
    assert points["special:fold"].get_markerfacecolor() != "white"


def test_what_emanates_is_said():
    """Of every Hopf point and doubling, in sentences and in lines."""
    sides = {
        "subcritical": "subcritical: jumps",
        "supercritical": "supercritical: grows from zero",
        "not_known": "sub- or supercritical is not known",
    }
    for side, words in sides.items():
        doubling = {**SPECIAL, "label": "doubling", "criticality": side}
        assert f"doubling: two motions meet; stable to one side; {words} [point 3]" in "\n".join(
            told({**PART, "special": [doubling]})
        )
        many = "\n".join(told(*[{**PART, "branch": k, "special": [doubling] * 2} for k in range(15)]))
        name = f"doubling ({side.replace('_', ' ')})"
        assert f"2 {name}" in many
        assert f"{name}: {words}" in many


def test_stable_parts_end_at_bifurcations():
    for labels, unstable, expected in (
        ([9, 0, 8, 0, 9], [0, 0, 0, 2, 2], [(0, 2)]),
        # Two multipliers leave between a touch of the wall and the doubling beside it.
        ([9, 0, 102, 7, 0], [0, 0, 0, 1, 1], [(0, 3)]),
        ([0, 7, 102, 0, 9], [1, 1, 0, 0, 0], [(1, 4)]),
        # Bifurcations of circles are not located.
        ([9, 0, 0, 0, 9], [0, 0, 2, 0, 0], [(0, 1), (3, 4)]),
        ([0, 8, 0, 8, 0], [0, 0, 2, 0, 0], [(0, 1), (3, 4)]),
        ([0, 5, 0], [1, 0, 2], []),
    ):
        assert stable_parts(np.array(unstable), np.array(labels)) == expected


PART = {
    "branch": 0,
    "words": "periodic over 1 lobe",
    "min": 4.0,
    "max": 5.0,
    "parent": -1,
    "stable": [[4.5, 4.0]],
    "stable_ends": [["point", "branch"]],
    "stable_turns": [[]],
    "not_decided": [],
    "looked_between": True,
    "at_one_value": False,
    "end_reason": "the end of the range",
    "special": [],
}
SPECIAL = {
    "label": "fold",
    "meaning": "two motions meet",
    "value": 4.2,
    "note": "",
    "unstable_before": 0,
    "unstable_after": 1,
    "criticality": "none",
    "springs": "none",
    "point": 3,
}


def told(*branches, everything=False):
    """The lines on these branches."""
    head = {"title": "", "created": "", "nsdrill_version": "", "overrides": {}, "operation": {}}
    along = {"along": "rotary_speed", "from": 4.0, "to": 5.0, "points": 9, "seeds": {}}
    along |= {"not_followed": {}, "not_known_whether_followed": {}}
    return list(lines("b.h5", {**head, **along, "branches": branches, "curves": []}, "si", everything=everything))


def test_show_says_where_a_stable_part_is_only_one_of_points():
    text = "\n".join(told({**PART, "words": "whirl on an invariant circle", "looked_between": False}))
    assert "4 rad/s (end of the branch) to 4.5 rad/s (its last point)" in text
    assert "bifurcations between them are not looked for" in text
    assert "was not located, as at a kink" in "\n".join(told(PART))
    assert "not located" not in "\n".join(told({**PART, "stable_ends": [["bifurcation", "branch"]]}))


def test_a_stable_part_that_turns_back_is_said_with_both_arms():
    """Where stability is not lost at the turn, as on arms that meet at a shrunken cycle."""
    assert turns(np.array([1.5, 1.2, 1.0, 1.0, 1.1, 1.4])) == [1.0]
    assert turns(np.array([1.0, 1.2, 1.5])) == []
    assert turns(np.array([1.0])) == []
    both = {**PART, "stable": [[4.5, 4.6]], "stable_ends": [["branch", "point"]], "stable_turns": [[4.1]]}
    text = "\n".join(told(both))
    assert "stable         4.5 rad/s (end of the branch) through 4.1 rad/s to 4.6 rad/s (its last point)" in text
    turned = {**both, "stable": [[4.6, 4.5]], "stable_turns": [[4.1, 4.8]]}
    assert "4.5 rad/s (its last point) through 4.8 rad/s through 4.1 rad/s to 4.6" in "\n".join(told(turned))
    brief = told(*[{**both, "branch": k, "special": [SPECIAL] * 2} for k in range(15)])
    assert any("stable 4.5 through 4.1 to 4.6 rad/s" in line for line in brief)
    # a turn that reads as an end is none
    tiny = {**PART, "stable": [[4.0, 4.5]], "stable_turns": [[4.500001]], "stable_ends": [["branch", "branch"]]}
    assert "4 rad/s (end of the branch) to 4.5 rad/s (end" in "\n".join(told(tiny))


def test_show_of_many_branches_fits_a_screen():
    """A line for each, what its special points mean once, and the rest with --all."""
    branches = [{**PART, "branch": k, "special": [SPECIAL] * 5} for k in range(30)]
    brief = told(*branches)
    assert len(brief) <= 40
    assert "    7  periodic over 1 lobe, 4 to 5 rad/s: stable 4 to 4.5 rad/s; 5 fold" in brief
    assert brief.count("  fold: two motions meet") == 1
    assert "  and 10 more branches" in brief
    assert "\n".join(told(*branches, everything=True)).count("two motions meet; stable to one side") == 150
    assert "\n".join(told(*branches[:2])).count("two motions meet") == 10


def test_a_point_where_the_touches_change_in_number_says_so():
    special = {**SPECIAL, "label": "lift_off", "meaning": "the bit begins to leave the rock"}
    counted, begins = (
        "\n".join(told({**PART, "special": [{**special, "note": note}]})) for note in ("1 to 2 touches a period", "")
    )
    assert "lift off (1 to 2 touches a period): how often it touches in a period changes" in counted
    assert "begins to leave" not in counted
    assert "lift off: the bit begins to leave the rock" in begins


def test_plot_export_and_orbit(made, call):
    call("plot", made / "b.h5", "-o", "b.png")
    assert Path("b.png").stat().st_size > 10_000
    call("plot", made / "b.h5", "--kind", "map", "-o", "c.png", code=2)
    call("export", made / "b.h5", "-o", "b.csv")
    rows = Path("b.csv").read_text().splitlines()
    with xarray.open_dataset(made / "b.h5", engine="h5netcdf") as data:
        points, last = data.sizes["point"], data.isel(point=-1).load()
        fold = int(np.argmax(data["label"].values == 5))
    assert len(rows) == points + 1
    assert rows[0].startswith("point,branch,motion,lobes,label_words")
    assert rows[fold + 1].startswith(f"{fold},")
    assert ",fold," in rows[fold + 1]
    call("export", made / "b.h5", "-o", "b.nc")
    call("simulate", made / "study.yaml", "--orbit", made / "b.h5", "--point", points - 1, "-o", "o.h5")
    trace = nsdrill.open_results("o.h5")
    assert float(trace["time"][-1]) == pytest.approx(float(last["period"]), rel=1e-2)
    for name, value in zip(last["state_name"].values, last["state"].values, strict=True):
        assert float(trace[str(name)][0]) == pytest.approx(value, rel=1e-9, abs=1e-9)
    again = nsdrill.simulate(made / "study.yaml", orbit=made / "b.h5", point=points - 1)
    np.testing.assert_array_equal(again["twist"], trace["twist"])


def test_an_orbit_is_of_the_string_of_its_branches(made, call):
    """The operating point comes from the file; everything else of the string has to be
    the study's."""
    study = made / "study.yaml"
    words = ("simulate", study, "--orbit", made / "b.h5", "--point", 3)
    call(*words, "-o", "a.h5")
    call(*words, "--set", "operation.wob=30 kN", "-o", "b.h5")
    np.testing.assert_array_equal(nsdrill.open_results("a.h5")["twist"], nsdrill.open_results("b.h5")["twist"])
    other = call(*words, "--set", "bit.friction.static=0.6", "-o", "c.h5", code=2)
    assert "made from another string than that of the study (bit.friction.static: 0.5 there, 0.6 here)" in other.err
    assert "nsdrill show --study prints it" in other.err
    assert not Path("c.h5").exists()


def test_a_table_in_field_units_has_those_of_each_column(made, call):
    call("export", made / "b.h5", "--units", "field", "-o", "b.csv")
    with open("b.csv", newline="") as file:
        row = next(csv.DictReader(file))
    with xarray.open_dataset(made / "b.h5", engine="h5netcdf") as data:
        assert float(row["depth [ft]"]) == pytest.approx(float(data["depth"][0]) / 0.3048, rel=1e-12)
        assert float(row["rotary_speed [rpm]"]) == pytest.approx(float(data["rotary_speed"][0]) * 30 / np.pi, rel=1e-12)


def test_a_picture_is_limited_along_the_number_that_is_continued(made):
    figure = nsdrill.plot(made / "b.h5", xlim=("2 rad/s", 4.0))
    assert figure.axes[-1].get_xlim() == pytest.approx((2.0, 4.0))


def test_two_files_of_branches_are_compared(made, call):
    """To the bit; and with fewer points, of which none corresponds to one of the other."""
    for name in ("short.h5", "again.h5"):
        nsdrill.continue_branches(made / "study.yaml", name, set=["continue.points=20"])
    same = call("diff", "short.h5", "again.h5", "--exit-code").out
    few = nsdrill.open_results("again.h5").sizes["point"]
    # within a second they are made at the same time too, and the whole files are the same
    assert re.search(rf"The (numbers|files) are the same to the bit: {few} points, ", same)
    data = nsdrill.open_results(made / "b.h5").load()
    points = data.sizes["point"]
    data["period"][7] = np.nextafter(data["period"][7], np.inf)
    data["motion"][1] = "circle"
    nsdrill.save(data, "other.h5")
    told = call("diff", made / "b.h5", "other.h5", "--exit-code", "--bits", code=1).out
    assert re.search(r"^  motion  +1 +branch 1$", told, re.MULTILINE)
    assert re.search(r"^  period  +1 .* point 7$", told, re.MULTILINE)
    found = json.loads(call("diff", made / "b.h5", "other.h5", "--json").out)
    assert found == nsdrill.diff(made / "b.h5", "other.h5")
    assert [row["name"] for row in found["variables"] if not row["same"]] == ["motion", "period"]
    told = call("diff", made / "b.h5", "short.h5", "--exit-code", code=1).out
    assert f"point: {points} and {few}" in told
    assert "numbered by each file and not paired." in told
    assert "The branches have other points, so their numbers are not compared one by one." in told
    assert "One is branches, the other a trace" in call("diff", made / "b.h5", _trace(made), "--exit-code", code=1).out


def _trace(made):
    nsdrill.save(nsdrill.simulate(made / "study.yaml", duration="1 s"), "trace.h5")
    return "trace.h5"


def test_nothing_is_left_of_a_finished_file(made, call):
    before = (made / "b.h5").read_bytes()
    call("branches", made / "study.yaml", "-o", made / "b.h5", "--resume")
    other = call(
        "branches", made / "study.yaml", "-o", made / "b.h5", "--resume", "--set", "continue.points=200", code=2
    )
    assert "finished, and made from another study (continue.points: 300 there, 200 here)" in other.err
    unasked = call("branches", made / "study.yaml", "-o", made / "b.h5", code=2)
    assert "b.h5: the file exists. Choose another name" in unasked.err
    assert (made / "b.h5").read_bytes() == before


def test_what_leaves_its_motion_has_no_features():
    from nsdrill.app.following.branch_data import stays_on_motion

    growth, circles = (np.array([1.24, 1.24, 2e6, 1.0001, 1e5]), np.array([True, False, False, True, False]))
    assert stays_on_motion(growth, circles).tolist() == [False, True, False, True, True]


def test_curves_over_a_map_are_asked_for_by_name(made, call):
    study = {
        "model": "torsion",
        "simulation": {"transient": "1 s", "observe": "1 s"},
        "sweep": {
            "rotary_speed": ["2 rad/s", "3 rad/s", "4 rad/s", "5 rad/s"],
            "wob": ["10 kN", "20 kN", "30 kN", "40 kN"],
        },
    }
    nsdrill.run(study, "map.h5", progress=False)
    assert "no curves" in call("plot", "map.h5", "--over", made / "b.h5", "-o", "m.png", code=2).err
    assert not Path("m.png").exists()


@pytest.mark.parametrize(
    ("study", "words"),
    [
        (f"{STUDY.partition('continue:')[0]}continue: null\n", "continue.along: found nothing"),
        (f"{STUDY}  lobes: []\n", "an empty list"),
        (STUDY.replace("22.24 kN}", "22.24 kN, rotary_speed: {ramp: [[0 s, 3 rad/s], [60 s, 4 rad/s]]}}"), "ramp"),
        (
            "continue: {along: well.inclination, from: 0 deg, to: 5 deg, seeds: {well.inclination: [2 deg]}}\n",
            "different symmetries",
        ),
        ("model: segments\ncontinue: {along: wob, from: 50 kN, to: 100 kN}\n", "segments"),
        ("continue: {along: wob, from: 10 kN, to: 30 kN, motions: [stick_slip]}\n", "Over lobes it is a torus"),
        ("drive: {kind: dc_motor}\ncontinue: {along: wob, from: 10 kN, to: 30 kN}\n", "found dc_motor"),
    ],
)
def test_what_cannot_be_continued_is_said(study, words, call):
    Path("study.yaml").write_text(study)
    assert words in unwrapped(call("branches", "study.yaml", "-o", "b.h5", code=2).err)
    assert [path.name for path in Path().iterdir()] == ["study.yaml"]


def test_existing_files_and_wrong_seeds(made, call):
    Path("study.yaml").write_text(STUDY)
    Path("b.h5").write_text("mine")
    call("branches", "study.yaml", "-o", "b.h5", code=2)
    assert Path("b.h5").read_text() == "mine"
    call("branches", "study.yaml", "-o", "c.h5", "--seeds", made / "b.h5", code=2)
    nsdrill.run(
        {
            "model": "torsion",
            "simulation": {"transient": "1 s", "observe": "1 s"},
            "sweep": {"rotary_speed": ["2 rad/s", "3 rad/s"]},
            "bit": {"friction": {"static": 0.3}},
        },
        "other.h5",
        progress=False,
    )
    answer = call("branches", "study.yaml", "-o", "c.h5", "--seeds", "other.h5", code=2)
    assert "another string (bit.friction.static" in answer.err


@pytest.mark.parametrize(
    "axis",
    [
        {},
        {"initial.bit_speed": ["0 rad/s", "9 rad/s"]},  # both are starts of the same string
        {"bit.friction.static": [0.3, nsdrill.load_study(STUDY).resolved["bit"]["friction"]["static"]]},
    ],
    ids=lambda axis: next(iter(axis), "speed alone"),
)
def test_seeds_of_a_sweep(call, axis):
    """Settled points of a sweep, from whatever start, seed the same branches, and those
    on one branch already are dropped."""
    sweep = {
        "model": "torsion",
        "simulation": {"transient": "400 s", "observe": "50 s"},
        "sweep": {"rotary_speed": {"from": "2.5 rad/s", "to": "6 rad/s", "points": 8}, **axis},
    }
    with nsdrill.run(sweep, "out.h5", progress=False) as results:
        settled = results["settled"]
        if "bit_friction_static" in settled.dims:
            settled = settled.isel(bit_friction_static=-1)
        seeds = int((settled == 1).sum())
    Path("study.yaml").write_text(STUDY)
    call("branches", "study.yaml", "-o", "b.h5", "--seeds", "out.h5", "--set", "continue.from=2.4 rad/s")
    data = nsdrill.open_results("b.h5")
    assert list(data["motion"].values) == ["equilibrium", "limit_cycle"]
    assert sum(json.loads(data.attrs["seeds"]).values()) == seeds
    for operation in (nsdrill.attractors, nsdrill.window, nsdrill.hysteresis):
        with pytest.raises(nsdrill.InputError, match="found branches; allowed here: results of a sweep"):
            operation(data)


def test_seeds_of_a_sweep_of_a_choice(call):
    """Its rows are told by their words."""
    study = (
        "operation: {depth: 2000 m, wob: 22.24 kN}\nmodes: {axial: frozen, lateral: frozen}\n"
        "simulation: {transient: 1 s, observe: 1 s}\n"
    )
    sweep = "sweep: {rotary_speed: [5 rad/s], drive.kind: [ideal, stiff]}\n"
    Path("sweep.yaml").write_text(study + sweep)
    Path("study.yaml").write_text(f"{study}continue: {{along: rotary_speed, from: 3 rad/s, to: 8 rad/s, points: 20}}\n")
    nsdrill.run("sweep.yaml", "out.h5", progress=False)
    for kind, said in (
        ("ideal", "1 of 1 point had not settled: no seeds"),
        ("ideal", "found no settled point"),
        ("pi", "found drive_kind from ideal to stiff, of which none is pi"),
    ):
        answer = call(
            "branches", "study.yaml", "-o", "b.h5", "--seeds", "out.h5", "--set", f"drive.kind={kind}", code=2
        )
        assert said in answer.err


@pytest.mark.parametrize("option", [(), ("--resume",), ("--overwrite",)])
def test_the_second_of_two_is_refused_at_once(call, option):
    Path("study.yaml").write_text(STUDY)
    with Part.claim("b.h5", "continuation", "torsion", overwrite=False, resume=False) as part:
        answer = call("branches", "study.yaml", "-o", "b.h5", *option, code=2)
        assert "b.h5.part: another process is writing these results now" in answer.err
        assert "settle" not in answer.err  # nothing is computed
        assert call("show", part.path).out.splitlines()[-2] == "  kept           nothing yet"
    assert not part.path.exists()


def test_killed_and_resumed(made, tmp_path, call):
    """A continuation that is killed when a branch is kept goes on with --resume, and
    gives the same numbers."""
    (tmp_path / "study.yaml").write_text(STUDY)
    process = start("branches", "study.yaml", "-o", "b.h5", cwd=tmp_path)
    part = tmp_path / "b.h5.part"
    deadline = time.monotonic() + 100
    while not has_state(part) and process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.005)
    process.send_signal(signal.SIGINT)
    answer = finish(process)
    if answer.code == 130:
        assert "--resume" in answer.err
        assert part.exists()
        call("branches", "study.yaml", "-o", "b.h5", code=2)
        other = call("branches", "study.yaml", "-o", "b.h5", "--resume", "--set", "operation.wob=30kN", code=2)
        assert "another study" in other.err
        call("branches", "study.yaml", "-o", "b.h5", "--resume")
    assert not part.exists()
    one, two = nsdrill.open_results(made / "b.h5"), nsdrill.open_results(tmp_path / "b.h5")
    for name in ("rotary_speed", "state", "multiplier_real", "period", "label", "bit_speed_max"):
        assert np.array_equal(one[name].values, two[name].values, equal_nan=True)


AT_ONCE = """\
import os, signal, time

from nsdrill import interrupt
from nsdrill.app.running.unfinished import Part, summary
from nsdrill.cli.main import main

write = Part.write
def slow(*state):
    write(*state)
    interrupt.PATIENCE = interrupt.SECOND_SIGNAL_SECONDS = 0.2
    os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(60.0)
Part.write = slow
main()
"""


def test_ended_at_once_it_says_what_is_kept(tmp_path):
    """As it is where it does not look for a signal for a while, or at the second one."""
    (tmp_path / "study.yaml").write_text(STUDY)
    words = [sys.executable, "-c", AT_ONCE, "branches", "study.yaml", "-o", "b.h5", "--quiet"]
    done = subprocess.run(words, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert done.returncode == 130, done.stderr
    kept = summary(tmp_path / "b.h5.part")["kept"]
    assert f"Interrupted: {kept} are kept in b.h5.part. Go on with --resume." in done.stderr


TWO = STUDY.replace("[5 rad/s]", "[1.7 rad/s, 5 rad/s]").replace("points: 300", "points: 60\n  switch: false")


def test_every_branch_is_kept_as_it_ends(call, monkeypatch):
    """Of those that are followed side by side as well; a resumed round follows only the
    others, which end where they would have ended. What is kept can be seen."""
    followed, write = [], Part.write
    follow = explore.followed_side

    def counted(flow, orders, known, side):
        followed.append(side.candidate.key)
        return (yield from follow(flow, orders, known, side))

    def interrupted(part, *state):
        write(part, *state)
        raise KeyboardInterrupt

    monkeypatch.setattr(explore, "followed_side", counted)
    Path("study.yaml").write_text(TWO)
    nsdrill.continue_branches("study.yaml", "whole.h5")
    keys, sides = {*followed}, len(followed)
    assert len(keys) == 3  # from seeds, side by side
    followed.clear()
    with monkeypatch.context() as patched:
        patched.setattr(Part, "write", interrupted)
        with pytest.raises(KeyboardInterrupt, match=r"1 branch, \d+ points are kept in .*b.h5.part"):
            nsdrill.continue_branches("study.yaml", "b.h5")
    with monkeypatch.context() as patched:  # what takes as long as following them
        patched.delattr(branch_data, "normal_forms")
        patched.delattr(branch_data, "finer_multipliers")
        told = call("show", "b.h5.part").out
    words = rf"unfinished: 1 branch so far, \d of {2 * 2} seeds still to follow or to place"
    assert re.search(rf"an unfinished continuation. Steady drilling and stick-slip \({words}\)", told)
    assert "Branch 0:" in told
    assert json.loads(call("show", "b.h5.part", "--json").out)["unfinished"].startswith("unfinished: 1 branch")
    call("plot", "b.h5.part", "-o", "part.svg")
    assert "unfinished: 1 branch so far" in unwrapped(re.sub("<[^>]*>", "", Path("part.svg").read_text()))
    followed.clear()
    nsdrill.continue_branches("study.yaml", "b.h5", resume=True)
    assert 0 < len(followed) < sides
    assert len({*followed}) == len(keys) - 1
    assert "The numbers are the same to the bit" in call("diff", "whole.h5", "b.h5", "--exit-code").out


def test_a_curve_that_is_lost_at_once_says_so():
    lost = {"curve": 10, "label": "doubling", "words": "periodic over 2 lobes", "end_reason": "no convergence"}
    lost |= {"points": 7, "lobes": 2, "rotary_speed": [6.217854, 6.217859], "wob": [22239.98, 22240.02]}
    (line,) = _curve_lines({"along": "rotary_speed", "curves": [lost]}, "si")
    assert "periodic over 2 lobes, lost beside its first point, 22.24 kN and 6.218 rad/s; ends: no conv" in line


def test_special_points_of_two_files_are_compared_without_numbers_of_branches(made, call):
    """One that has moved by more than it is located to, and other seeds."""
    data = nsdrill.open_results(made / "b.h5").load()
    (place,) = np.flatnonzero(data["label"].values == 3)
    value = float(data["rotary_speed"].values[place])
    speeds = data["rotary_speed"].values.copy()
    speeds[place] *= 1.0 + 1e-4
    other = data.assign_coords(rotary_speed=("point", speeds, data["rotary_speed"].attrs))
    nsdrill.save(other.assign_attrs(seeds=json.dumps({"followed": 7})), "moved.h5")
    found = nsdrill.diff(made / "b.h5", "moved.h5")
    (row,) = (row for row in found["special"] if row["only_a"])
    assert (row["label"], row["a"], row["b"]) == ("hopf", 1, 1)
    assert row["only_a"] == pytest.approx([value])
    assert row["only_b"] == pytest.approx([value * (1.0 + 1e-4)])
    told = call("diff", made / "b.h5", "moved.h5").out
    assert "7 (7 followed) in b; which branches are found depends on them." in told
    assert re.search(r"^  hopf, .* 1  1  0  .*rad/s  .*rad/s$", told, re.MULTILINE)


def without(name):
    return lambda file: file.pop(name)


def with_attribute(name, value):
    return lambda file: file.attrs.__setitem__(name, value)


def with_values(name, values):
    def change(file):
        del file[name]
        file.create_dataset(name, data=values, dtype=h5py.string_dtype() if isinstance(values, list) else None)

    return change


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        (without("rotary_speed"), "the variable rotary_speed is missing or not along point"),
        (without("label"), "the variable label is missing"),
        (with_attribute("continue_from", "x" * 100_000), "the attribute continue_from should be a finite number"),
        (with_attribute("created", "x" * 25_000), "the attribute created should be text of at most 500 characters"),
        (with_attribute("along", "wob" * 9000), "the attribute along should be text of at most 500 characters"),
        (with_attribute("along", "status"), "the attribute along is 'status'"),
        (with_attribute("seeds", "[1]"), "the attribute seeds should be a JSON object"),
        (with_values("period", np.zeros((3, 3, 3))), "the variable period is"),
        (with_values("motion", np.zeros(2)), "the variable motion should have text"),
        (lambda file: file["label"].write_direct(np.full(file["label"].shape, 77, np.int16)), "label has the code 77"),
        (lambda file: file["parent"].write_direct(np.array([5, 9])), "the variable parent has numbers of no branch"),
        (
            lambda file: file["row_size"].write_direct(np.array([0, 9])),
            "the variable row_size should have whole numbers",
        ),
    ],
)
def test_a_damaged_file_is_refused_in_a_sentence(made, tmp_path, call, damage, said):
    path = Path(shutil.copy(made / "b.h5", tmp_path / "b.h5"))
    unseal(path)
    with h5py.File(path, "r+") as file:
        damage(file)
    seal(path)
    for words in (["show", path], ["plot", path, "-o", "b.png"], ["export", path, "-o", "b.csv"]):
        answer = call(*words, code=2)
        assert answer.err.startswith(f"Error: {path}: {said}")
        assert len(answer.err) < 400


def test_long_and_odd_texts_of_a_file_are_cut_and_shown(made, tmp_path, call):
    path = Path(shutil.copy(made / "b.h5", tmp_path / "b.h5"))
    unseal(path)
    with h5py.File(path, "r+") as file:
        file["end_reason"][...] = ["\u202eback\x1b[31m" + "x" * 100_000] * len(file["end_reason"])
        file.attrs["title"] = "\u202eback\x1b[31m" + "x" * 100_000
        file["label"].attrs["units"] = "x" * 30_000
    seal(path)
    answer = call("show", path)
    assert max(map(len, answer.out.splitlines())) < 700
    assert not {"\u202e", "\x1b"} & {*answer.out}


@pytest.mark.parametrize(
    ("section", "said"),
    [
        ("along: bit.friction.static_torque, from: 3 kN*m, to: 4 kN*m", "bit.friction.dynamic: found nothing"),
        (
            "along: rotary_speed, from: 10 rad/s, to: 12 rad/s, curves: {over: drillstring.torsional_stiffness, "
            "from: 400 N*m/rad, to: 600 N*m/rad}",
            "found no value of drillstring.torsional_stiffness",
        ),
    ],
)
def test_a_number_that_the_study_does_not_give_is_refused_in_words(section, said, tmp_path, call):
    study = tmp_path / "study.yaml"
    study.write_text(f"modes: {{axial: frozen, lateral: frozen}}\ncontinue: {{{section}}}\n")
    answer = call("branches", study, "-o", tmp_path / "b.h5", code=2)
    assert said in answer.err
    assert not (tmp_path / "b.h5").exists()


def test_a_branch_that_goes_on_beyond_its_points_says_which_key_cut_it_off(tmp_path, call):
    """Steady drilling, and the cycle below its fold, are followed with six points each of 300 that they
    take; --all has the key at each of them, and a table of many branches the number of them."""
    study = tmp_path / "study.yaml"
    study.write_text(STUDY.replace("points: 300", "points: 6").replace("transient: 50 s", "transient: 20 s"))
    call("branches", study, "-o", "short.h5")
    said = call("show", "short.h5").out
    number = said.count("ends           as many points as continue.points allows")
    assert number >= 1
    noun = "1 branch goes" if number == 1 else f"{number} branches go"
    assert f"cut off        {noun} on beyond as many points as continue.points allows: raise it" in said
    branches = [{**PART, "end_reason": "the end of the range; as many points as continue.points allows"}] * 9
    (line,) = [one for one in told(*branches) if "cut off" in one]
    assert "9 branches go on" in line


@pytest.mark.filterwarnings("ignore::nsdrill.FileWarning")
def test_branches_from_seeds_that_another_program_changed_say_so(call, tmp_path):
    """Seeds of a sweep, and a point of branches; those of untouched files say nothing."""
    short = STUDY.replace("points: 300", "points: 20")
    Path("branches.yaml").write_text(short)
    sweep = short.partition("continue:")[0] + "sweep: {rotary_speed: [5 rad/s]}\n"
    Path("sweep.yaml").write_text(sweep)
    call("run sweep.yaml --set simulation.transient=500s -o seeds.h5 -q")
    call("branches branches.yaml --seeds seeds.h5 -o clean.h5 -q")
    assert EDITED_SOURCE not in open_branches("clean.h5").attrs
    shutil.copy("seeds.h5", "edited.h5")
    with h5py.File("edited.h5", "r+") as file:
        file["stick_slip_index"][...] = 0.0
    call("branches branches.yaml --seeds edited.h5 -o b.h5 -q")
    with h5py.File("b.h5") as file:  # in the file itself, which is sealed
        assert file.attrs[EDITED_SOURCE] == "edited.h5, by another program"
    assert "NOT SEALED: changed outside of nsdrill" in call("show b.h5").err.replace("\n", " ")
    data = nsdrill.open_results("edited.h5").load()
    assert EDITED_SOURCE in nsdrill.continue_branches("branches.yaml", seeds=data).attrs
    at = f"operation.rotary_speed={float(open_branches('b.h5')['rotary_speed'][2]):.17g} rad/s"
    call("branches", "branches.yaml", "--set", at, "--seeds", "b.h5", "--point", "2", "-o", "next.h5", "-q")
    assert open_branches("next.h5").attrs[EDITED_SOURCE] == "edited.h5, by another program"
