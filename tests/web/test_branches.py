"""Branches in the explorer and the report: the numbers of their file, their motions,
and files that are no such."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner

from nsdrill.analysis.bifurcations import CYCLE, PERIODIC
from nsdrill.cli.main import group
from nsdrill.errors import FileError, InputError
from nsdrill.models.registry import IN_TRACE
from nsdrill.plot.kinds.branches import COLOURS
from nsdrill.store import hdf5, read_results, write_branches
from nsdrill.web.branches import read_branches
from nsdrill.web.session import Session

FEATURES = ("axial_max", "bit_speed_max", "radius_max", "bit_speed_min")


def write(path: Path, shared: Path, **changes: Any) -> Path:
    """A file of two branches of four points each, whose motions are those that a sweep
    ended in."""
    results = read_results(shared / "small.h5")
    names = [str(name) for name in results.coords["state"][:-1]]
    speeds = np.tile(results.coords["rotary_speed"][:4], 2)
    points = [(p, 0, 0, i) for p in (0, 1) for i in range(4)]
    data: dict[str, Any] = {
        "row_size": np.array([4, 4]),
        "lobes": np.array([1, 2]),
        "rotary_speed": speeds,
        "depth": np.full(8, 2000.0),
        "wob": np.full(8, 22240.0),
        "period": 2 * np.pi / (3 * speeds),
        "unstable": np.array([0, 0, 1, 1, 0, 0, 0, 0], np.int16),
        "label": np.array([9, 0, 5, 9, 9, 102, 0, 9], np.int16),
        "state": np.array([results["final_state"][place][:-1] for place in points]),
        **{name: np.array([results[name][place] for place in points]) for name in FEATURES},
        **changes,
    }
    data |= {"motion": ["periodic", "limit_cycle"], "end_reason": ["end of the range", "a fold"]}
    per_branch = ("row_size", "lobes", "motion", "end_reason", "parent", "parent_point", "closed")
    data |= {name: np.zeros(2, int) for name in per_branch[4:]}
    data |= {name: np.zeros(8) for name in ("multiplier_real", "multiplier_imag", "branch_of_point", "arclength")}
    attrs = {**results.attrs, "along": "rotary_speed", "along_key": "rotary_speed", "rtol": 1e-9}
    variables = {
        name: (("branch",) if name in per_branch else ("point", "component")[: np.ndim(values)], values)
        for name, values in data.items()
        if values is not None
    }
    write_branches(path, xr.Dataset(variables, attrs=attrs))
    assert names[0] in IN_TRACE
    return path


@pytest.fixture
def branches(shared, tmp_path):
    return write(tmp_path / "branches.h5", shared)


def test_they_are_drawn_over_a_sweep(branches, shared):
    session = Session(shared / "small.h5", over=branches)
    head, columns = session.diagram({"y": "radius_peaks"})
    results = read_results(shared / "small.h5")
    assert np.allclose(columns["curve y"][:4], 1e3 * results["radius_max"][0, 0, 0, :4])
    assert columns["curve x"].tolist() == [1.0, 2.0, 3.0, 4.0] * 2
    assert head["curves"]["sizes"].tolist() == [4, 4]
    drawn = head["curves"]
    words = [[point, drawn["marks"][mark]["name"]] for point, mark in drawn["special"]]
    assert words == [[2, "fold"], [5, "wall reached"]]
    kinds = [drawn["kinds"][kind] for kind in drawn["kind"]]
    assert [kind["name"] for kind in kinds] == ["periodic over 1 lobe", "limit cycle"]
    assert [kind["colour"] for kind in kinds] == [COLOURS[PERIODIC], COLOURS[CYCLE]]
    other, _ = session.diagram({"y": "bit_torque_max"})
    assert other["note"] == "The branches have no such feature."


def test_they_are_not_drawn_where_they_are_not(shared, tmp_path):
    session = Session(shared / "small.h5", over=write(tmp_path / "b.h5", shared, wob=np.full(8, 30e3)))
    head, columns = session.diagram({"y": "radius_peaks"})
    assert "curve x" not in columns
    assert head["note"] == "The branches are at Weight on bit 30 kN."


def test_another_string_is_told_and_units_are_those_of_the_page(shared, tmp_path):
    session = Session(shared / "small.h5", "field", over=write(tmp_path / "b.h5", shared, wob=np.full(8, 30e3)))
    assert session.diagram({"y": "radius_peaks"})[0]["note"] == "The branches are at Weight on bit 6.744 klbf."
    other = write(tmp_path / "c.h5", shared)
    with hdf5.writing(other, copy_of=other) as file:
        resolved = json.loads(file.attrs["study_resolved"])
        resolved["bit"]["lobes"] = 7
        file.attrs["study_resolved"] = json.dumps(resolved)
    head, columns = Session(shared / "small.h5", over=other).diagram({"y": "radius_peaks"})
    assert "curve x" not in columns
    assert "bit.lobes is 7 there" in head["note"]


def test_a_click_runs_the_motion_of_a_branch(branches):
    session = Session(branches)
    assert session.meta()["kind"] == "branches"
    found = read_branches(branches)
    for point in (1, 2):
        head, columns = session.orbit({"point": point})
        period = found.period[point]
        seconds = head["samples"] * head["interval"]
        assert seconds == pytest.approx(period if found.unstable[point] else 20.0, rel=0.05)
        first = [columns[name][0] * IN_SI[name] for name in IN_SI]
        names = ("x", "vx", "y", "vy", "z", "vz", "twist", "bit_speed")
        assert np.allclose(first, [found.state[point][names.index(name)] for name in IN_SI], rtol=1e-12)
        assert head["values"]["rotary_speed"] == found.numbers[point]
        assert head["changes"]["rotary_speed"] == found.numbers[point]
    assert "branch 0, periodic over 1 lobe, unstable in 1 direction, fold" in head["begins"]
    live, _ = session.live({"state": head["state"].tolist(), "changes": {"rotary_speed": 3.5}, "seconds": 1.0})
    assert live["values"]["rotary_speed"] == 3.5


IN_SI = {"x": 1e-3, "z": 1e-3, "bit_speed": 1.0, "vz": 1.0}


@pytest.mark.parametrize("point", [-1, 8, True, "1", None])
def test_a_point_that_is_not_there(branches, session, point):
    with pytest.raises(InputError, match="point"):
        Session(branches).orbit({"point": point})
    with pytest.raises(InputError, match="point"):
        session.orbit({"point": 0})


@pytest.mark.parametrize(
    "changes",
    [{"row_size": np.array([4, 5])}, {"state": None}, {"period": None}, {"rotary_speed": None}, {"lobes": None}],
)
def test_a_damaged_file_is_said(shared, tmp_path, changes):
    path = write(tmp_path / "b.h5", shared, **changes)
    with pytest.raises(FileError, match=r"is missing|as many points as they say"):
        Session(path)


def test_other_files_are_no_branches(shared, branches):
    with pytest.raises(FileError, match="results file; a file of branches"):
        Session(shared / "small.h5", over=shared / "map.h5")
    with pytest.raises(InputError, match="over: found"):
        Session(shared / "small.yaml", over=branches)


def test_the_report_has_them(branches, shared, tmp_path):
    out = tmp_path / "r.html"
    arguments = ["report", str(shared / "small.h5"), str(branches), "-o", str(out), "--motions", "0"]
    done = CliRunner().invoke(group, arguments)
    assert done.exit_code == 0, done.output
    text = out.read_text()
    for wanted in (
        "Branch 0",
        "fold at 3 rad/s (point 2)",
        "wall reached at 2 rad/s (point 5)",
        "ends: a fold",
        "1 rad/s to 4 rad/s",
        "8 on 2 branches",
        "nsdrill branches branches_study.yaml -o branches_again.h5",
        f"nsdrill show {branches} --study &gt; branches_study.yaml",
    ):
        assert wanted in text, wanted
