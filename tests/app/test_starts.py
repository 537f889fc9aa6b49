"""An ensemble from the study to the file and back: resumed, replayed, classified,
exported, opened."""

import csv
import json

import numpy as np
import pytest
from interrupts import Interrupt, look_often

import nsdrill
from nsdrill.analysis.attractors import wilson
from nsdrill.app.answering.attractor_summary import attractors
from nsdrill.app.answering.summary import reclassify, summarize
from nsdrill.app.running.run import Interrupted, run_in_memory, run_study
from nsdrill.app.saving import table, write_rows
from nsdrill.app.simulating.trajectory import replay, simulate
from nsdrill.data import Results
from nsdrill.errors import InputError
from nsdrill.store import open_results, part_path, read_partial, read_point, read_results
from nsdrill.study import parse_study

# Near 2000 m smooth drilling and bit-bounce coexist; ten seconds do not settle them,
# but tell them apart.
TEXT = """\
title: Starts
operation: {wob: 22.24 kN, rotary_speed: 3 rad/s}
initial: {ensemble: 7, seed: 2}
sweep: {depth: [2000 m, 3000 m]}
simulation: {transient: 5 s, observe: 10 s}
record: {peaks: 3}
"""
SLICE = TEXT.replace(
    "{ensemble: 7, seed: 2}", "{slice: {z: {from: -3 mm, to: 3 mm, points: 3}, x: {from: 0 mm, to: 70 mm, points: 4}}}"
)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    path = tmp_path_factory.mktemp("starts") / "out.h5"
    run_study(parse_study(TEXT), path, workers=1)
    return path


def same(a: Results, b: Results) -> bool:
    return list(a.variables) == list(b.variables) and all(a[n].tobytes() == b[n].tobytes() for n in a.variables)


def test_the_file(made):
    results = read_results(made)
    assert results.grid == ("procedure", "depth", "wob", "rotary_speed", "start")
    assert results.shape == results["response"].shape == (1, 2, 1, 1, 7)
    assert results["start"].tolist() == list(range(7))
    assert results["axial_peaks"].shape == (1, 2, 1, 1, 7, 3)
    assert results["initial_state"].shape == (1, 2, 1, 1, 7, 9)
    assert results["attractor"].min() >= 1, "every start that ended well is on one"
    assert not results.slice


def test_the_file_opens_in_xarray(made):
    with open_results(made) as data:
        assert data.sizes["start"] == 7
        assert data["attractor"].dims == ("depth", "start")
        assert data["initial_state"].sel(depth=2000.0, start=3, state="bit_speed").size == 1


@pytest.mark.parametrize(("workers", "lanes"), [(1, 1), (2, 16)])
def test_the_same_bits(made, tmp_path, workers, lanes):
    run_study(parse_study(TEXT), tmp_path / "out.h5", workers=workers, lanes=lanes)
    assert same(read_results(tmp_path / "out.h5"), read_results(made))


def test_in_memory(made):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("nsdrill.app.running.grouping._BLOCK", 1)  # one operating point after the other
        results = run_in_memory(parse_study(TEXT), workers=1)
    assert same(results, read_results(made))
    assert attractors(results) == nsdrill.attractors(made)


def test_resumed(made, tmp_path):
    path = tmp_path / "out.h5"
    slow = parse_study(TEXT)
    with pytest.MonkeyPatch.context() as patch:
        look_often(patch, steps=5000)
        with pytest.raises(Interrupted) as caught:
            run_study(slow, path, workers=1, lanes=1, watch=Interrupt(2))
    assert 0 < caught.value.done < 14
    partial = read_partial(part_path(path))
    assert not np.any(partial["attractor"]), "not before all starts are there"
    assert sum(point["pending"] for point in summarize(partial)["operating_points"]) > 0
    run_study(slow, path, workers=2, resume=True)
    assert same(read_results(path), read_results(made))


@pytest.mark.parametrize("start", [0, 6])
def test_replay_is_bit_for_bit(made, start):
    result = replay(made, depth=3000.0, start=start)
    assert result.same_bits is True
    assert result.trace.attrs["start"] == start
    stored = read_point(made, 0, 1, 0, 0, start)["initial_state"]
    assert np.array_equal(result.trace.attrs["initial_state"], stored)
    simulated = simulate(parse_study(TEXT), depth=3000.0, start=start)
    assert np.array_equal(simulated.trace.attrs["final_state"], result.trace.attrs["final_state"])


def test_which_start_must_be_said(made, shared):
    with pytest.raises(InputError, match=r"has 7 starts. Say which one with start, 0 to 6"):
        replay(made, depth=3000.0)
    with pytest.raises(InputError, match=r"start: found 7; allowed: 0 to 6"):
        replay(made, depth=3000.0, start=7)
    with pytest.raises(InputError, match="one start"):
        replay(shared / "map.h5", wob=20e3, rotary_speed=3.1, start=0)
    with pytest.raises(InputError, match="Say which one with start"):
        simulate(parse_study(TEXT))


def test_attractors_as_plain_data(made):
    points, results = nsdrill.attractors(made), read_results(made)
    json.dumps(points, allow_nan=False)
    assert [point["depth"] for point in points] == [2000.0, 3000.0]
    for i, point in enumerate(points):
        numbers = results["attractor"][0, i, 0, 0]
        assert (point["starts"], point["failed"], point["ungrouped"]) == (7, 0, 0)
        members = [one["members"] for one in point["attractors"]]
        assert members == [int(np.sum(numbers == one["number"])) for one in point["attractors"]]
        assert members == sorted(members, reverse=True)
        assert sum(members) == 7
        for one in point["attractors"]:
            assert one["share"] == one["members"] / 7
            assert (one["low"], one["high"]) == wilson(one["members"], 7)
            chosen = numbers == one["number"]
            assert one["features"]["radius_max"] == np.median(results["radius_max"][0, i, 0, 0][chosen])
            assert len(np.unique(results["response"][0, i, 0, 0][chosen])) == 1


def test_a_file_that_lacks_the_attractors_is_refused_in_words(made, tmp_path):
    with open_results(made) as data:
        data.drop_vars("attractor").to_netcdf(tmp_path / "part.h5", engine="h5netcdf")
    with pytest.raises(InputError, match="found results without attractor"):
        nsdrill.attractors(tmp_path / "part.h5")


def test_another_tolerance_makes_other_groups_and_comes_back(made, tmp_path):
    path = tmp_path / "copy.h5"
    path.write_bytes(made.read_bytes())
    changed = reclassify(path, ["classify.attractors.tolerance=100"])
    assert changed["attractor"][0] > 0
    coarse = read_results(path)
    for i in range(2):  # then only the labels part
        labels = np.stack([coarse["response"][0, i, 0, 0], coarse["whirl_kind"][0, i, 0, 0]])
        assert len(np.unique(coarse["attractor"][0, i])) == len(np.unique(labels, axis=1).T)
    reclassify(path, [])
    assert same(read_results(path), read_results(made))


def test_numbers_are_the_same_along_the_axis(made, tmp_path):
    """With all allowed to match, each operating point has the numbers from 1, the
    motions of the other among them."""
    path = tmp_path / "copy.h5"
    path.write_bytes(made.read_bytes())
    separate = reclassify(path, ["classify.attractors.matching=1e-9"])
    apart = read_results(path)["attractor"][0, :, 0, 0]
    assert separate["attractor"][0] > 0
    assert not set(apart[0]) & set(apart[1]), "nothing matches"
    reclassify(path, ["classify.attractors.matching=100"])
    together = read_results(path)["attractor"][0, :, 0, 0]
    few, many = sorted((set(together[0]), set(together[1])), key=len)
    assert few < many or few == many
    for before, after in zip(apart, together, strict=True):
        assert len(set(zip(before, after, strict=True))) == len(set(before)) == len(set(after)), "the same groups"
    reclassify(path, [])
    assert same(read_results(path), read_results(made))


def test_the_table_has_a_column_for_the_start(made, tmp_path):
    write_rows(table(read_results(made)), tmp_path / "out.csv")
    with open(tmp_path / "out.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["start"] for row in rows] == [str(k) for k in range(7)] * 2
    assert [row["depth [m]"] for row in rows] == ["2000.0"] * 7 + ["3000.0"] * 7
    stored = read_results(made)["attractor"].ravel()
    assert [int(row["attractor"]) for row in rows] == stored.tolist()


def test_a_slice(tmp_path):
    path = tmp_path / "slice.h5"
    run_study(parse_study(SLICE), path, workers=1)
    results = read_results(path)
    assert results.shape == (1, 2, 1, 1, 12)
    assert list(results.slice) == ["x", "z"]
    states = results["initial_state"][0, 0, 0, 0]
    assert len(np.unique(states[:, [0, 4]], axis=0)) == 12
    assert len(np.unique(states[:, [1, 2, 3, 5, 6, 7, 8]], axis=0)) == 1
    first = nsdrill.attractors(path)[0]["attractors"][0]
    assert first["low"] is None, "a grid is no sample"
    assert summarize(results)["slice"] == results.slice


def test_failed_starts_are_counted_and_named(tmp_path):
    path = tmp_path / "failing.h5"
    outcome = run_study(parse_study(TEXT, overrides=["simulation.max_steps=1000"]), path, workers=1)
    failed = read_results(path)["status"] != 1
    assert outcome.failed == failed.sum() > 0
    assert np.all((read_results(path)["attractor"] == 0) == failed)
    summary = summarize(read_results(path))
    assert [(p["depth"], p["start"]) for p in summary["failed"]] == [
        (float([2000.0, 3000.0][d]), int(k)) for _, d, _, _, k in np.argwhere(failed)
    ]
    assert sum(point["failed"] for point in summary["operating_points"]) == failed.sum()
    again = run_study(parse_study(TEXT, overrides=["simulation.max_steps=1000000"]), path, workers=1, retry_failed=True)
    assert again.failed == 0
    assert read_results(path)["attractor"].min() >= 1
