"""Two sweeps of which all runs of one failed: what it lacks is not known, neither lost nor
none."""

import warnings

import pytest

import nsdrill
from nsdrill.app.answering.answers import diff
from nsdrill.text.diff import lines

STUDY = {
    "operation": {"depth": "2000 m"},
    "sweep": {
        "wob": {"from": "20 kN", "to": "100 kN", "points": 3},
        "rotary_speed": ["30 rpm", "60 rpm", "75 rpm", "120 rpm"],
    },
    "simulation": {"transient": "20 s", "observe": "5 s", "max_steps": 1_000_000},
    "record": {"peaks": 0},
}


@pytest.fixture(scope="module")
def pair(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pair")
    failing = {**STUDY, "simulation": {**STUDY["simulation"], "max_steps": 1000}}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that runs failed, which is meant
        for name, study in (("whole", STUDY), ("failed", failing)):
            nsdrill.run(study, folder / f"{name}.h5", progress=False, workers=1).close()
    return [str(folder / f"{name}.h5") for name in ("whole", "failed")]


@pytest.mark.parametrize("order", [1, -1])
def test_what_is_not_known_is_not_lost_and_not_none(pair, order):
    text = " ".join(" ".join(lines(diff(*pair[::order]), "si", False)).split())
    known, unknown = ("a", "b") if order == 1 else ("b", "a")
    assert "0 gained, 0 lost, 12 not known in one of them" in text
    assert f"not known (a run failed in {unknown})" in text
    assert "lost (" not in text
    assert "gained (" not in text
    assert f"points of {known}, not known of {unknown}" in text
    assert "0 points instead" not in text
    assert "instead of 0" not in text
