"""The commands that read a file: show, plot, replay, export, classify; and simulate,
which makes a trace."""

import csv
import json
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray
from ruamel.yaml import YAML

import nsdrill
from nsdrill.analysis.safety import known_runs
from nsdrill.app import citing
from nsdrill.figures import kinds_for
from nsdrill.models.registry import NAMES
from nsdrill.store import log_from_results, read_attributes, read_results, read_trace

from .helpers import finish, start

LABELS = ("response", "whirl_kind", "stick_slip_severity", "bounce_severity", "whirl_severity", "settled")


@pytest.fixture
def copy(shared, tmp_path):
    """A results file that may be changed."""
    return Path(shutil.copy(shared / "small.h5", tmp_path / "copy.h5"))


# -- show


def test_show_json_agrees_with_the_file(call, shared):
    answer = call("show", shared / "failing.h5", "--json")
    summary = json.loads(answer.out)
    results = read_results(shared / "failing.h5")
    assert summary["points"] == 16
    assert summary["finished"] is True
    assert sum(summary["status"].values()) == 16
    failed = np.argwhere(results["status"] == 3)
    assert len(failed) > 0
    assert summary["status"]["step_limit"] == len(failed)
    assert [(point["procedure"], point["rotary_speed"]) for point in summary["failed"]] == [
        (results["procedure"][p], results["rotary_speed"][s]) for p, _, _, s in failed
    ]
    assert sum(sum(counts.values()) for counts in summary["responses"].values()) == summary["runs"]["known"]
    assert summary["runs"]["known"] == 16 - len(failed) - summary["not_carried"]
    assert sum(row["points"] for row in summary["intervals"]) == 16


def test_show_lists_failed_points(call, shared):
    out = call("show", shared / "failing.h5").out
    assert "Failed points (" in out
    # after the first that failed nothing is carried
    before = int(np.argmax(read_results(shared / "failing.h5")["status"][0].ravel() != 1))
    assert 0 < before < 8
    assert f"Responses, up, of the {before} of 8 points that are known:" in out
    assert "  step limit: 2000 m, 22.24 kN, " in out


def test_show_trace(call, shared):
    call("simulate", shared / "small.yaml", "-o", "trace.h5", "--duration", "1s")
    out = call("show", "trace.h5").out
    for text in ("trace of one run. Small", "22.24 kN (4.99975 klbf)", "101 over 1 s", "ended ok", "bit_torque", "N m"):
        assert text in out
    summary = json.loads(call("show", "trace.h5", "--json").out)
    assert summary["samples"] == 101
    assert summary["ranges"]["bit_speed"]["units"] == "rad s-1"


@pytest.mark.parametrize("command", [["show"], ["plot", "-o", "x.png"], ["export", "-o", "x.csv"], ["classify"]])
@pytest.mark.parametrize(
    ("name", "said"),
    [("missing.h5", "there is no such file"), ("text.h5", "not an HDF5 file"), (".", "no file"), ("cut.h5", "damaged")],
)
def test_files_that_cannot_be_read(call, shared, command, name, said):
    Path("text.h5").write_text("no HDF5")
    Path("cut.h5").write_bytes((shared / "small.h5").read_bytes()[:30_000])
    answer = call(command[0], name, *command[1:], code=2)
    assert answer.out == ""
    assert said in answer.err
    assert not Path("x.png").exists()
    assert not Path("x.csv").exists()


def test_show_points_at_the_unfinished_run(call, shared):
    log_from_results(shared / "small.h5", Path("out.h5.part")).close()
    for words in (("show", "out.h5"), ("diff", "out.h5", shared / "small.h5")):
        assert "out.h5.part can be shown" in call(*words, code=2).err
    call("show", "out.h5.part")


# -- plot


@pytest.mark.parametrize(("name", "suffix"), [("small", "png"), ("small", "pdf"), ("map", "svg"), ("failing", "svg")])
def test_plot_default(call, shared, name, suffix):
    answer = call("plot", shared / f"{name}.h5", "-o", f"x.{suffix}")
    assert (answer.out, answer.err) == ("", f"x.{suffix}: drawn.\n")
    start = {"png": b"\x89PNG", "pdf": b"%PDF", "svg": b"<?xml"}[suffix]
    assert Path(f"x.{suffix}").read_bytes().startswith(start)


def test_plot_lists_its_kinds_and_draws_them(call, shared):
    listed = call("plot", shared / "map.h5", "--kind", "list")
    names = [line.split()[0] for line in listed.out.partition(" --panel:")[0].splitlines()[:-1]]
    assert names == list(kinds_for(read_results(shared / "map.h5")))
    assert call("plot", shared / "map.h5", "--kind", "list", "--wob", "40kN").out.split()[0] == "bifurcation"
    for name in names[:3]:
        call("plot", shared / "map.h5", "--kind", name, "--units", "field", "-o", f"{name}.svg")


def test_plot_cut_of_a_map(call, shared):
    call("plot", shared / "map.h5", "--wob", "40 kN", "--kind", "bifurcation", "-o", "cut.svg")
    near = call("plot", shared / "map.h5", "--wob", "41 kN", "--kind", "bifurcation", "-o", "near.svg")
    assert "At 40 kN, the nearest of the sweep." in near.err
    assert Path("near.svg").stat().st_size == Path("cut.svg").stat().st_size, "the nearest value is drawn"
    missed = call("plot", shared / "map.h5", "--wob", "200 kN", "-o", "missed.svg", code=2)
    assert "allowed: 20 kN to 100 kN, as the sweep, of which the nearest value is drawn" in missed.err
    assert not Path("missed.svg").exists()


# -- simulate


def test_simulate(call, small):
    answer = call(
        f"simulate {small} -o trace.h5 --depth '1000 ft' --wob 5klbf --rotary-speed '60 rpm' --duration '2 s' "
        "--sample '5 ms'"
    )
    assert answer.out == ""
    lines = [line for line in answer.err.splitlines() if "compil" not in line]  # of a busy machine
    assert lines == ["Point: 1000 ft, 5 klbf, 60 rpm.", "trace.h5: 401 samples over 2 s."]
    trace = read_trace("trace.h5")
    assert trace.attrs["depth"] == pytest.approx(304.8, rel=1e-12)
    assert trace.attrs["wob"] == pytest.approx(22241.108, rel=1e-7)  # 5000 x 0.45359237 x 9.80665
    assert trace.attrs["rotary_speed"] == pytest.approx(2 * np.pi, rel=1e-12)
    assert np.allclose(np.diff(trace.time), 0.005)


def test_simulate_that_ends_early(call, small):
    answer = call(
        "simulate", small, "-o", "trace.h5", "--duration", "100 s", "--set", "simulation.max_steps=1000", code=3
    )
    assert "step_limit" in answer.err
    assert "simulation.max_steps" in answer.err
    assert 0 < len(read_trace("trace.h5").time) < 10_001


# -- replay


@pytest.mark.parametrize("procedure", ["up", "down"])
@pytest.mark.parametrize("speed", ["1 rad/s", "5 rad/s", "76.394 rpm"])
def test_replay_bit_for_bit(call, shared, procedure, speed):
    answer = call("replay", shared / "small.h5", "--rotary-speed", speed, "--procedure", procedure, "-o", "trace.h5")
    assert "bit for bit" in answer.err
    trace, results = read_trace("trace.h5"), read_results(shared / "small.h5")
    p = ["up", "down"].index(procedure)
    s = list(results["rotary_speed"]).index(trace.attrs["rotary_speed"])
    assert trace.attrs["final_state"].tobytes() == results["final_state"][p, 0, 0, s].tobytes()
    assert trace.attrs["steps"] == results["steps"][p, 0, 0, s]
    # The trace shows what the features say: extremes of samples lie within those of the
    # continuous solution.
    window = trace.time >= 2.0
    assert trace["bit_speed"][window].max() <= results["bit_speed_max"][p, 0, 0, s] * (1 + 1e-9)
    assert trace["radius"][window].max() <= results["radius_max"][p, 0, 0, s] * (1 + 1e-9)


def test_replay_with_other_bits_says_why(call, shared, monkeypatch):
    """A stored end that is not that of the run, in a file made with another Python."""
    from nsdrill.app.simulating.trajectory import read_point, read_results

    def changed(*where):
        point = read_point(*where)
        return {**point, "final_state": np.nextafter(point["final_state"], 9.0)}

    words = ("replay", shared / "small.h5", "--rotary-speed", "3 rad/s", "--procedure", "up", "-o")
    monkeypatch.setattr("nsdrill.app.simulating.trajectory.read_point", changed)
    answer = call(*words, "one.h5")
    assert "bit for bit" not in answer.err
    assert "What differs: nothing that the file records" in answer.err
    there = read_results(shared / "small.h5", ())
    older = replace(there, attrs={**there.attrs, "python": "3.9.1"})
    monkeypatch.setattr("nsdrill.app.simulating.trajectory.read_results", lambda path, names: older)
    assert "What differs: Python 3.9 there, 3." in call(*words, "two.h5").err


def test_replay_of_a_failed_point(call, shared):
    results = read_results(shared / "failing.h5")
    p, _, _, s = np.argwhere(results["status"] == 3)[0]
    answer = call(
        "replay",
        shared / "failing.h5",
        "-o",
        "trace.h5",
        "--procedure",
        results["procedure"][p],
        "--rotary-speed",
        f"{results['rotary_speed'][s]} rad/s",
        code=3,
    )
    assert "ended early (step_limit)" in answer.err
    assert "bit for bit" in answer.err


def test_replay_does_not_replace_its_input(call, copy):
    before = copy.read_bytes()
    words = ["--rotary-speed", "3 rad/s", "--procedure", "up", "-o", copy, "--overwrite"]
    call("replay", copy, *words, code=2)
    assert copy.read_bytes() == before


# -- export


def test_export_csv(call, shared):
    call("export", shared / "failing.h5", "-o", "out.csv", "--peaks", "--states")
    results = read_results(shared / "failing.h5")
    with open("out.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 16
    columns = (results["status"], known_runs(results), results["bit_speed_min"])
    for row, status, is_known, least in zip(rows, *(one.ravel() for one in columns), strict=True):
        assert row["status"] == str(status)
        assert row["status_words"] == {1: "ok", 3: "step_limit"}[int(status)]
        assert (row["settled_words"] == "unknown") == (status != 1), "a failed run has no label"
        for label in ("response", "whirl_kind"):
            assert (row[f"{label}_words"] == "unknown") == (not is_known), "nor has one after it in its chain"
        assert np.array_equal(float(row["bit_speed_min [rad s-1]"]), least, equal_nan=True)
    assert "axial_peaks_3 [m]" in rows[0]
    assert "final_state_twist [rad]" in rows[0]


def test_export_netcdf(call, shared):
    call("export", shared / "small.h5", "-o", "out.nc")
    with xarray.open_dataset("out.nc", engine="h5netcdf") as data:
        assert data.sizes["rotary_speed"] == 8


# -- classify


def test_classify_and_back(call, copy):
    before = read_results(copy)
    answer = call("classify", copy, "--set", "classify.stick_slip.stick_slip_index=20")
    after = read_results(copy)
    stick_slip = (after["response"] & 2) > 0
    assert np.array_equal(stick_slip, after["stick_slip_index"] > 20)
    changed = np.count_nonzero(after["response"] != before["response"])
    assert changed > 0
    assert f"response: {changed} of 16 points changed." in answer.err
    assert all(
        np.array_equal(after[n], before[n], equal_nan=True)
        for n in before.variables
        if n not in LABELS and before[n].dtype.kind == "f"
    )
    history = after.attrs["history"].splitlines()
    assert len(history) == 2
    assert history[1].endswith("classify classify.stick_slip.stick_slip_index=20")
    assert "labels         with classify.stick_slip.stick_slip_index=20" in call("show", copy).out
    call("classify", copy)
    restored = read_results(copy)
    assert all(np.array_equal(restored[name], before[name]) for name in LABELS)
    assert len(restored.attrs["history"].splitlines()) == 3


def test_trace_is_no_results_file(call, shared):
    call("simulate", shared / "small.yaml", "-o", "trace.h5", "--duration", "1 s")
    for command, *more in (["classify"], ["window"], ["replay", "-o", "y.h5"]):
        assert "results file" in call(command, "trace.h5", *more, code=2).err
    assert "a trace, which is of one point" in call("plot", "trace.h5", "--wob", "3 kN", "-o", "x.png", code=2).err
    with h5py.File("trace.h5") as file:
        assert file.attrs["nsdrill_kind"] == "trace"


def test_a_trace_is_exported_in_either_system(call, tmp_path):
    """The table has the samples of the file, bit for bit in SI; of a window is said
    what it needs."""
    trace, study = str(tmp_path / "trace.h5"), str(tmp_path / "study.yaml")
    call("new", "-o", study)
    call("simulate", study, "--duration", "2s", "--sample", "0.5s", "-o", trace)
    rows = [row.split(",") for row in call("export", trace, "-o", "-").out.splitlines()]
    field = [row.split(",") for row in call("export", trace, "-o", "-", "--units", "field").out.splitlines()]
    kept = nsdrill.open_results(trace)
    place = [head.partition(" ")[0] for head in rows[0]].index("bit_force")
    assert [float(row[place]) for row in rows[1:]] == kept["bit_force"].values.tolist()
    assert field[0][place] == "bit_force [klbf]"
    assert float(field[1][place]) == pytest.approx(float(rows[1][place]) / 4448.2216152605)
    call("export", trace, "-o", str(tmp_path / "trace.nc"))
    assert nsdrill.open_results(str(tmp_path / "trace.nc")).equals(kept)
    assert "a trace, whose table has everything" in call("export", trace, "-o", "-", "--peaks", code=2).err
    assert "a results file is needed here, which nsdrill run makes" in call("window", trace, code=2).err
    assert f"nsdrill run {study} -o out.h5" in call("window", study, code=2).err


def test_show_prints_quantities_as_engineers_write_them(call, shared):
    """In the units of the window and the pictures, four digits each, no exponents."""
    ranges = call("show", shared / "small.h5").out.partition("Least and greatest")[2]
    units = {line.split()[0]: line.split() for line in ranges.splitlines()[1:] if line.strip()}
    for name, unit in (
        ("rate_of_penetration", "m/h"),
        ("mechanical_specific_energy", "MPa"),
        ("bit_force_max", "kN"),
        ("lift_off_fraction", "%"),
    ):
        assert unit in units[name], name
    summary = json.loads(call("show", shared / "small.h5", "--json").out)["ranges"]
    low, high = (float(units["rate_of_penetration"][i]) for i in (1, 3))
    assert low == pytest.approx(3600 * summary["rate_of_penetration"]["min"], rel=1e-3)
    assert high == pytest.approx(3600 * summary["rate_of_penetration"]["max"], rel=1e-3)
    field = call("show", shared / "small.h5", "--units", "field").out
    assert " ft/h " in field
    assert " ksi " in field
    assert not re.search(r"\de[+-]\d", ranges)


def test_a_file_that_another_program_has_open_is_shown_with_a_warning(copy, tmp_path):
    work = "import h5py, sys; file = h5py.File(sys.argv[1], 'r+'); print(1, flush=True); sys.stdin.read()"
    words = [sys.executable, "-c", work, str(copy)]
    with subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as holder:
        assert holder.stdout.readline()
        plain, shown = (finish(start("show", copy, *more)) for more in ((), ("--json",)))
        holder.stdin.close()
    for answer in (plain, shown):
        assert answer.code == 0
        assert f"(process {holder.pid}) has it open to write" in answer.err
        assert "h5clear -s" in answer.err
        assert "damaged" not in answer.err
    assert json.loads(shown.out)["file_warnings"][0] in shown.err
    (told,) = json.loads(finish(start("show", copy, "--json")).out)["file_warnings"]
    assert "has it open" not in told, "the file is closed"
    assert "NOT SEALED" in told, "HDF5 cuts what is behind its own end off a file that was open to write"


def test_cite(call, shared, monkeypatch):
    """Nothing in it is invented: what is not known of a work is left out, or said."""
    general = call("cite").out
    assert f"version {nsdrill.__version__}." in general
    assert "Fully coupled vibrations of actively controlled drillstrings" in general
    assert "Dynamic model of an oilwell drillstring" in general
    answer = call("cite", shared / "small.h5").out
    attrs = read_attributes(shared / "small.h5")
    assert attrs["study_sha256"] in answer
    assert f"by nsdrill {attrs['nsdrill_version']}" in answer
    assert "Journal of Sound and Vibration 267, 1029-1045 (2003)" in answer
    assert "Sarker" not in answer, "of another model"
    entries = call("cite", shared / "small.h5", "--bibtex").out
    assert re.findall(r"^@(\w+)\{", entries, re.MULTILINE) == ["software", "article", "misc"]
    assert entries.count("{") == entries.count("}")
    assert "christoforou\\_yigit, study" in entries
    assert nsdrill.cite(nsdrill.open_results(shared / "small.h5"), bibtex=True).startswith("@software")
    call("cite", "nowhere.h5", code=2)


def test_works_that_are_cited_are_in_the_bibliography_and_in_the_citation_file():
    root = Path(__file__).parents[2]
    page = (root / "docs" / "bibliography.md").read_text().replace("\n  ", " ")
    file = YAML(typ="safe").load((root / "CITATION.cff").read_text())
    assert file["title"] == citing.TITLE
    listed = {one["title"]: one for one in file["references"]}
    for works in citing.WORKS.values():
        for work in works:
            assert work.title in page
            assert work.year in page
            assert str(listed[work.title].get("year", "")) == work.year
            assert str(listed[work.title].get("volume", "")) == work.volume
    assert {*citing.WORKS} == {*NAMES}


def test_a_title_that_would_turn_a_line_of_the_terminal_around(call, shared, tmp_path):
    path = Path(shutil.copy(shared / "small.h5", tmp_path / "out.h5"))
    with h5py.File(path, "r+") as file:
        file.attrs["title"] = "safe\u202eevil\u2066"
    for words in (["show", path], ["show", path, "--json"], ["window", path], ["diff", path, shared / "small.h5"]):
        answer = call(*words)
        assert not {"\u202e", "\u2066"} & {*answer.out, *answer.err}
