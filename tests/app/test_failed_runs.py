"""Runs that reach the limit of steps, which are those that whirl most: every answer says how
many they are, and none takes them for runs without a response."""

import warnings
from typing import Any

import numpy as np
import pytest

import nsdrill
from nsdrill.app.answering.answers import diff
from nsdrill.app.answering.summary import needed, summarize
from nsdrill.app.datasets import read_any
from nsdrill.figures import cut, draw
from nsdrill.store import read_results
from nsdrill.text.diff import lines as diff_lines
from nsdrill.text.show import lines as show_lines
from nsdrill.text.uncertainty_text import conclusion, sensitivity_lines
from nsdrill.variables import STEP_LIMIT
from nsdrill.web.explorer_maps import area

pytestmark = pytest.mark.usefixtures("words_only")

MAP: dict[str, Any] = {
    "operation": {"depth": "1500 m"},
    "sweep": {
        "wob": {"from": "10 kN", "to": "60 kN", "points": 3},
        "rotary_speed": {"from": "4 rad/s", "to": "16 rad/s", "points": 5},
    },
    "uncertain": {
        "bit.friction.static": {"uniform": [0.3, 0.6]},
        "drillstring.eccentricity": {"triangular": ["1 mm", "5 mm", "13 mm"]},
        "samples": 16,
    },
    "simulation": {"transient": "5 s", "observe": "5 s", "max_steps": 1000},
    "record": {"peaks": 0},
}
ENOUGH = {**MAP, "simulation": {**MAP["simulation"], "max_steps": 100_000}}
SLICE = {
    **{key: value for key, value in MAP.items() if key not in ("sweep", "uncertain")},
    "operation": {"depth": "1500 m", "wob": "60 kN", "rotary_speed": "9 rad/s"},
    "simulation": {**MAP["simulation"], "transient": "4 s", "observe": "4 s"},
    "initial": {
        "slice": {
            "x": {"from": "-10 mm", "to": "10 mm", "points": 8},
            "vx": {"from": "-0.3 m/s", "to": "0.3 m/s", "points": 8},
        }
    },
}


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("failed")
    for name, study in (("limited", MAP), ("enough", ENOUGH), ("slice", SLICE)):
        with warnings.catch_warnings():  # that runs failed, which is meant
            warnings.simplefilter("ignore")
            nsdrill.run(study, folder / f"{name}.h5", progress=False, workers=1).close()
    return folder


@pytest.fixture(scope="module")
def results(files):
    return read_results(files / "limited.h5")


@pytest.fixture(scope="module")
def lost(results):
    """The settings of which no sample is known, [weight on bit, speed]."""
    failed = np.asarray(results["status"])[0, 0] == STEP_LIMIT
    assert failed.all(axis=-1).any(), "of some settings all fail"
    assert (failed.any(axis=-1) & ~failed.all(axis=-1)).any(), "of others some"
    return failed.all(axis=-1)


def gids(figure) -> set[str]:
    return {str(artist.get_gid()) for artist in figure.findobj() if artist.get_gid()}


def test_where_all_samples_fail_no_probability_is_told(files, results, lost):
    summary = summarize(read_results(files / "limited.h5", needed(files / "limited.h5")))
    runs = summary["runs"]
    assert runs["failed"] == np.count_nonzero(results["status"] == STEP_LIMIT)
    assert (runs["known"] + runs["failed"], runs["pending"], runs["of"]) == (240, 0, 240)
    rows = [row for row in summary["probabilities"] if row["known"] == 0]
    assert len(rows) == np.count_nonzero(lost)
    for row in rows:
        assert (row["failed"], row["of"]) == (16, 16)
        for outcome in ("safe", "bit_bounce", "whirl"):
            assert row[outcome] == {"probability": None, "low": 0.0, "high": 1.0, "known": 0}
    text = "\n".join(show_lines("limited.h5", summary, "si"))
    assert text.count("16 of 16 failed") == len(rows)
    assert f"{runs['failed']} of 240 runs failed" in text


def test_what_would_have_come_lies_in_the_intervals(files):
    limited, enough = (nsdrill.probability(files / f"{name}.h5") for name in ("limited", "enough"))
    truth = enough.probability
    assert bool(((limited.low <= truth + 1e-12) & (truth <= limited.high + 1e-12)).all())
    assert bool((limited.known == 0).any())
    assert bool(limited.probability.isnull().equals(limited.known == 0))
    assert int(limited.failed.max()) == limited.attrs["of"] == 16


def test_the_pictures_hatch_it(files, results, lost):
    found = gids(draw(results, "probability"))
    assert {"unknown:safe", "unknown:whirl", "open:whirl"} <= found
    assert "unknown:whirl" not in gids(draw(read_results(files / "enough.h5"), "probability"))
    assert "unknown" in gids(draw(results, "window"))
    weight = float(results.coords["wob"][np.argwhere(lost)[0][0]])
    along = draw(cut(results, {"wob": weight}), "probability")
    assert "unknown" in gids(along)
    assert any("failed" in text.get_text() for legend in along.legends for text in legend.get_texts())


def test_differences_are_of_what_both_know(files, lost):
    found = diff(str(files / "enough.h5"), str(files / "limited.h5"))
    counts = found["probabilities"]
    assert (counts["a"]["failed"], counts["a"]["of"]) == (0, 240)
    assert counts["b"]["failed"] == found["responses"]["unknown"]
    for row in counts["outcomes"]:
        assert row["known"] == lost.size - np.count_nonzero(lost)
        assert abs(row["largest"]) < 1.0
        assert row["apart"] == 0
    text = "\n".join(diff_lines(found, "si", bits=False))
    assert f"in b {counts['b']['failed']} of 240 samples failed" in text


def test_a_sensitivity_is_not_that_of_the_runs_that_ended_well(files):
    found = nsdrill.sensitivity(files / "limited.h5")
    words = f"{found['failed']} of {found['of']} samples failed"
    assert found["failed"] > 0
    assert words in "\n".join(sensitivity_lines(found, "si"))
    truth = nsdrill.sensitivity(files / "enough.h5")
    for name, row in ((one["key"], one) for one in truth["answers"][0]["unknowns"]):
        mine = next(one for one in found["answers"][0]["unknowns"] if one["key"] == name)
        for end in ("low", "high"):
            assert mine[end]["least"] - 1e-12 <= row[end]["answer"] <= mine[end]["most"] + 1e-12
    assert "agree" not in conclusion(found)


def test_data_nsdrill_has_no_response_of_a_failed_run(files):
    with nsdrill.open_results(files / "limited.h5") as data:
        failed = data.status == STEP_LIMIT
        whirling, known = data.nsdrill.whirling, data.nsdrill.known
        assert np.array_equal(whirling.isnull(), failed)
        assert np.array_equal(known, ~failed)
        assert not (data.nsdrill.safe() & failed).any()
        share = whirling.mean("sample").squeeze()
        told = nsdrill.probability(files / "limited.h5").probability.sel(outcome="whirl")
        assert np.allclose(share, told, equal_nan=True)
    with nsdrill.open_results(files / "enough.h5") as data:
        assert data.nsdrill.whirling.dtype == bool


def test_pages_say_it(files, results, lost, tmp_path):
    head, columns = area(results, "si", "probability", {})
    unknown = np.isnan(columns["values"][0])
    assert np.count_nonzero(unknown) == np.count_nonzero(lost)
    assert np.all(columns["outcome"][0][unknown] == -2)
    assert np.any(columns["open"][0] > 0)
    assert any(text.startswith("FAILED:") for text in head["warnings"])
    page = tmp_path / "report.html"
    nsdrill.report(files / "limited.h5", page, motions=0)
    assert "FAILED:" in page.read_text()


def test_unsettled_starts_are_marked_and_counted(files):
    results = read_any(files / "slice.h5")
    counts = summarize(results)["operating_points"][0]
    assert counts["unsettled"] > 0
    figure = draw(results, "basin")
    assert {"unsettled", "unknown"} <= gids(figure)
    words = [text.get_text() for legend in figure.legends for text in legend.get_texts()]
    assert f"unsettled ({counts['unsettled']} of 64 starts)" in words
    assert f"failed, not known ({counts['failed']} of 64 starts)" in words
    assert any("unsettled" in line for line in show_lines("slice.h5", summarize(results), "si"))
    head, columns = area(results, "si", "basin", {})
    assert int(columns["open"].sum()) == counts["unsettled"]
    assert any(f"{counts['unsettled']} of 64" in text for text in head["warnings"])
