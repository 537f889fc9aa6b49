"""Every kind of run in every output: the words agree, and what is not known stands nowhere as free."""

import re
import warnings
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest
from analysis.grids import grid
from figures.seen import legend_words

import nsdrill
from nsdrill.analysis.counts import NOT_CARRIED
from nsdrill.analysis.early_end import ends_early
from nsdrill.analysis.maps import classes
from nsdrill.analysis.planes import UNJUDGED
from nsdrill.analysis.window import find_window, obstacle
from nsdrill.app.answering.answers import diff
from nsdrill.app.saving import table
from nsdrill.models.registry import forget_known
from nsdrill.models.responses import STALLED, STICK_SLIP
from nsdrill.store import read_results
from nsdrill.text.diff import lines as diff_lines
from nsdrill.variables import DIVERGED, INFERRED, PENDING, PERIODIC, UNSETTLED
from nsdrill.web.diagrams import diagram
from nsdrill.web.session import Session
from nsdrill.web.shown import label_words
from nsdrill.words.answer import obstacle_words, words_of

pytestmark = [
    pytest.mark.usefixtures("words_only"),
    pytest.mark.filterwarnings("ignore::nsdrill.RunWarning", "ignore::nsdrill.FileWarning"),
]

STUDY = """
model: torsion
drive: {kind: stiff, torque_limit: 100 kN*m}
sweep:
  wob: [20 kN, 30 kN, 40 kN, 50 kN, 60 kN, 70 kN, 80 kN, 90 kN]
  rotary_speed: [10 rad/s, 11 rad/s, 12 rad/s, 13 rad/s]
  along: rotary_speed
  procedure: up-down
simulation: {transient: 5 s, observe: 5 s}
record: {exponent: true, poincare: 16}
"""
# Each kind at some runs of a weight of its own: up from 10 to 13 rad/s, and down again.
KINDS = ("known", "failed", "pending", "inferred", "not settled", "off speed", "unstable", "stalled")
MIDDLE = np.array([False, True, True, False])
AFTER = np.array([[0, 0, 0, 1], [1, 1, 1, 1]], bool)  # of the failed one, at 12 rad/s on the way up
NOWHERE = np.zeros((2, 4), bool)
BOTH = np.array([MIDDLE, MIDDLE])
AT_ONE = {"failed": (0, 2), "pending": (1, 0)}  # the last run of the chain is not made yet
# which runs of each kind are not known
UNKNOWN = {
    "failed": AFTER | (np.arange(8).reshape(2, 4) == 2),
    "pending": np.arange(8).reshape(2, 4) == 4,
    "off speed": BOTH,
    "unstable": BOTH,
}


def lose(data: Any, place: tuple[int, int, int], status: int) -> None:
    """Make a run one without values."""
    for values in data.variables.values():
        if values.dims[:3] == ("procedure", "wob", "rotary_speed"):
            values.values[place] = np.nan if values.dtype.kind == "f" else 0
    data.status.values[place] = status


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """A file of each kind, and one of all."""
    folder = tmp_path_factory.mktemp("kinds")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that runs are short, which does not matter here
        data = nsdrill.run(STUDY, progress=False, workers=1).load()
        for name in ("response", "stick_slip_severity", "period"):
            data[name].values[:] = 0
        data.settled.values[:], data.motion.values[:] = 1, PERIODIC
        data.lyapunov_exponent.values[:], data.lyapunov_error.values[:] = -1.0, 0.01
        data.drive_speed_mean.values[:] = data.rotary_speed.values
        row = {kind: number for number, kind in enumerate(KINDS)}
        for kind, status in (("failed", DIVERGED), ("pending", PENDING)):
            way, speed = AT_ONE[kind]
            lose(data, (way, row[kind], speed), status)
        for way in (0, 1):
            for speed in (1, 2):
                lose(data, (way, row["inferred"], speed), INFERRED)
        data.settled.values[:, row["not settled"], MIDDLE] = 0
        data.motion.values[:, row["not settled"], MIDDLE] = UNSETTLED
        data.drive_speed_mean.values[:, row["off speed"], MIDDLE] *= 1.5
        data.lyapunov_exponent.values[:, row["unstable"], MIDDLE] = 2.0
        data.response.values[:, row["stalled"], MIDDLE] = STALLED
        for kind, number in row.items():
            nsdrill.save(data.isel(wob=[number]), folder / f"{kind}.h5")
        nsdrill.save(data, folder / "all.h5")
    return folder


def rows_of(path: Any) -> list[dict[str, Any]]:
    head, *rows = table(read_results(path))
    return [dict(zip(map(str, head), row, strict=True)) for row in rows]


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_not_known_is_free_in_no_output(files, kind):
    path = files / f"{kind}.h5"
    unknown = UNKNOWN.get(kind, NOWHERE)
    stalls = BOTH if kind == "stalled" else NOWHERE
    number, asked = int(unknown.sum()), nsdrill.open_results(path).nsdrill
    # Python
    assert np.array_equal(np.squeeze(asked.known.values), ~unknown)
    assert np.array_equal(np.squeeze(asked.safe().values), ~unknown & ~stalls)
    assert np.array_equal(np.isnan(np.squeeze(asked.stalled.values.astype(float))), unknown)
    told = re.search(r"not known +(\d+): (.*)", repr(asked))
    assert int(told[1] if told else 0) == number
    # the table
    rows = rows_of(path)
    for name in ("response_words", "stick_slip_severity_words"):
        words = np.array([row[name] for row in rows]).reshape(2, 4)
        lacks = unknown | (BOTH if kind == "inferred" and name != "response_words" else NOWHERE)
        assert np.array_equal(words == "unknown", lacks), name
    # show
    shown = nsdrill.show(path)
    counted = sum(int(one) for one in re.findall(r"^  none +(\d+) ", shown, re.MULTILINE))
    assert counted == 8 - number - int(stalls.sum())
    # window
    found = find_window(read_results(path))
    assert found["known"] == 8 - number
    assert found["unknown"] == int(unknown.any(axis=0).sum())
    # the explorer
    _, columns = diagram(read_results(path), "si", "bit_speed_max")
    assert np.array_equal(columns["outcome"] < 0, unknown)
    # a difference from what is known
    compared = diff(str(files / "known.h5"), str(path))
    if compared["responses"] is not None and compared["points"]:
        assert compared["responses"]["unknown"] == number


WORDS = {  # of the accessor, of a window, of a strip, of the border of what is safe
    "failed": ("failed, not carried", "failed or not carried", NOT_CARRIED, "a run failed"),
    "pending": ("not run yet", "not run yet", "blank: not run yet", "not run yet"),
    "off speed": ("off speed", "off speed", NOT_CARRIED, "nothing is known"),
    "unstable": ("an unstable motion", "an unstable motion", NOT_CARRIED, "nothing is known"),
}


@pytest.mark.parametrize("kind", WORDS)
def test_each_output_says_why(files, kind):
    path = files / f"{kind}.h5"
    of_python, of_window, of_strip, of_border = WORDS[kind]
    unknown = UNKNOWN[kind]
    assert f"not known {int(unknown.sum()):8d}: {of_python}" in repr(nsdrill.open_results(path).nsdrill)
    points = int(unknown.any(axis=0).sum())
    assert f"unknown ({points} {of_window})" in legend_words(nsdrill.plot(path, "window"))
    number = 5 if kind == "failed" else int(unknown.sum())
    assert f"{of_strip} ({number} of 8)" in legend_words(nsdrill.plot(path, "bifurcation"))
    plt.close("all")
    results = read_results(path)
    maps = classes(results)
    speed = int(np.flatnonzero(unknown.any(axis=0))[0])
    assert obstacle_words(**obstacle(maps, (0, 0, speed))) == of_border
    # the explorer: its words of the outcome, of a click on the point, and its legend
    way, speed = np.argwhere(unknown)[-1].tolist()
    code = int(diagram(results, "si", "bit_speed_max")[1]["outcome"][way, speed])
    words = of_strip.removeprefix("blank: ")
    assert Session(files / "all.h5").meta()["unknown"][str(code)] == words
    values = {name: one[(way, 0, 0, speed)] for name, one in results.variables.items() if one.ndim == 4}
    assert label_words(values, results.attrs, code)[0] in (words, "pending")


def test_what_was_inferred_and_what_did_not_settle_say_so(files):
    inferred, unsettled = files / "inferred.h5", files / "not settled.h5"
    assert "no value: inferred, not run (4 of 8)" in legend_words(nsdrill.plot(inferred, "bifurcation"))
    plt.close("all")
    assert diagram(read_results(inferred), "si", "bit_speed_max")[0]["inferred"].endswith("not run: 4 of 8")
    assert diagram(read_results(files / "known.h5"), "si", "bit_speed_max")[0]["inferred"] == ""
    plane = {"colour": "response", "x": "rotary_speed", "y": "wob"}
    head, columns = Session(files / "all.h5").plane(plane)
    assert head["inferred"].endswith("not run: 4 of 64")
    assert np.count_nonzero(columns["outcome"] < 0) == sum(int(one.sum()) for one in UNKNOWN.values())
    assert "4 ok, 4 inferred" in nsdrill.show(inferred)
    found = find_window(read_results(inferred))
    assert "2 inferred, not run" in " ".join(words_of(found, "si").lines())
    assert found["inferred_runs"] == 4
    assert "8 ok; 4 settled" in nsdrill.show(unsettled)
    assert find_window(read_results(unsettled))["unsettled_points"] == 2
    assert sum(row["settled_words"] == "unsettled" for row in rows_of(unsettled)) == 4


def test_stick_slip_does_not_end_in_a_run_that_is_not_known():
    """It sticks to 11 rad/s; at 12 rad/s the drive is too fast, so that a run without stick-slip says nothing."""
    speeds = np.arange(10.0, 14.0)
    results = grid({"up": ["ss.."]}, speeds)
    assert ends_early(results, lambda lines: [20.0])[0]["by"]["value"] == 12.0
    mean = speeds * np.array([1.0, 1.0, 1.5, 1.0])
    results.variables["drive_speed_mean"] = mean.reshape(results.shape)
    results.variables["settled"] = np.ones(results.shape, np.int8)
    assert int(results["response"][..., 1].ravel()[0]) == STICK_SLIP
    assert ends_early(results, lambda lines: [20.0] * len(lines)) == []


def test_what_nothing_judges_is_known_in_no_output(tmp_path):
    @nsdrill.model()
    def swing(t, x=0.5, v=0.0, *, damping=0.1, stiffness=1.0):
        return v, -stiffness * x - damping * v

    try:
        study = swing.study(damping=(0.1, 0.4, 3), transient=5, observe=20)
        data = nsdrill.run(study, tmp_path / "a.h5", progress=False, workers=1)
        assert not data.nsdrill.known.any()
        assert not data.nsdrill.safe().any()
        assert np.isnan(data.nsdrill.stalled).all()
        assert f"not known        3: {UNJUDGED}" in repr(data.nsdrill)
        assert f"Responses: not known, as {UNJUDGED}." in nsdrill.show(data)
        assert {row["response_words"] for row in rows_of(tmp_path / "a.h5")} == {"not_judged"}
        other = swing.study(damping=(0.1, 0.4, 3), stiffness=2.0, transient=5, observe=20)
        nsdrill.run(other, tmp_path / "b.h5", progress=False, workers=1).close()
        found = diff(str(tmp_path / "a.h5"), str(tmp_path / "b.h5"))
        assert found["responses"] is None
        assert f"Responses: not known, as {UNJUDGED}." in list(diff_lines(found, "si", False))
        data.close()
    finally:
        forget_known()
