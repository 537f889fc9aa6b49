"""Parts of a carried sweep in which a run failed: a selection, a cut, a saved part and a
table know it as the whole does."""

import csv

import numpy as np
import pytest
from strings import FAILS_FIRST

import nsdrill
from nsdrill import figures
from nsdrill.analysis.comparison import compare_results
from nsdrill.analysis.counts import after_failure
from nsdrill.analysis.safety import known_runs
from nsdrill.app.simulating.trajectory import Trajectory
from nsdrill.store import read_results
from nsdrill.text.uncertainty_text import _answer_lines
from nsdrill.variables import has_failed
from nsdrill.web.report import representatives


@pytest.fixture(scope="module")
def fails_first(tmp_path_factory):
    """A file of a sweep carried up whose first run fails and whose others end well."""
    folder = tmp_path_factory.mktemp("fails_first")
    (folder / "study.yaml").write_text(FAILS_FIRST)
    with pytest.warns(nsdrill.RunWarning):
        nsdrill.run(folder / "study.yaml", folder / "out.h5", progress=False)
    found = nsdrill.open_results(folder / "out.h5")
    status = found.status.values.ravel()
    assert has_failed(status).tolist() == [True, False, False, False]
    return folder / "out.h5"


def test_a_part_of_a_carried_sweep_knows_that_its_chain_failed(fails_first, tmp_path):
    data = nsdrill.open_results(fails_first)
    part = data.isel(rotary_speed=slice(1, None))
    one = data.isel(rotary_speed=2)
    for selected in (data, part, one, part[["response", "status"]]):
        assert not selected.nsdrill.known.any()
        assert not selected.nsdrill.safe().any()
    assert nsdrill.window(part)["safe"] == 0
    assert nsdrill.window(part)["after_failure"] == 3
    for name in ("part.h5", "part.nc"):
        nsdrill.save(part, tmp_path / name)
        assert not nsdrill.open_results(tmp_path / name).nsdrill.known.any()
        assert nsdrill.window(tmp_path / name)["safe"] == 0
    part.to_netcdf(tmp_path / "xarray.nc", engine="h5netcdf")
    assert nsdrill.window(tmp_path / "xarray.nc")["safe"] == 0


def test_a_cut_of_a_carried_sweep_knows_that_its_chain_failed(fails_first):
    results = read_results(fails_first)
    cut = figures.cut(results, {"rotary_speed": 3.2})
    assert after_failure(cut).all()
    assert not known_runs(cut).any()


def test_tables_and_comparisons_tell_what_was_not_carried(fails_first, tmp_path):
    nsdrill.save(nsdrill.open_results(fails_first), tmp_path / "out.csv")
    rows = list(csv.DictReader((tmp_path / "out.csv").open()))
    assert [row["not_carried"] for row in rows] == ["0", "1", "1", "1"]
    results = read_results(fails_first)
    found = compare_results(results, results)["responses"]
    assert (found["unchanged"], found["unknown"]) == (0, 4)
    assert representatives(results, 4) == [], "no run whose history is known"


def test_a_mean_over_too_few_known_samples_is_not_said_of_every_sample():
    row = {"name": "safe", "mean": 0.5, "units": "1", "deviation": None, "missing": 2, "present": 4}
    row |= {"least": 0.33, "most": 0.67, "unknowns": []}
    (mixed,) = _answer_lines(row | {"alike": False}, "si")
    assert "50.0 % (33 to 67) on average over the known samples" in mixed
    assert "every sample" not in mixed
    (same,) = _answer_lines(row | {"alike": True}, "si")
    assert "in every sample that is known" in same


def test_least_and_greatest_are_over_what_is_known_and_carried(fails_first):
    text = str(nsdrill.show(fails_first))
    assert "Least and greatest" not in text, "one run failed, and nothing was carried to the others"


def test_no_line_goes_through_what_was_not_carried(fails_first):
    axes = nsdrill.plot(nsdrill.open_results(fails_first), "bit_speed_max").axes
    drawn = [line for one in axes for line in one.lines if str(line.get_gid()).startswith("bit_speed_max:")]
    assert drawn
    assert not np.isfinite(np.concatenate([line.get_ydata() for line in drawn])).any()


def test_a_selection_is_told_of_its_own_short_observation(tmp_path):
    """At 1 rad/s an observation of 60 s holds 9.5 revolutions, at 5 rad/s 48."""
    study = FAILS_FIRST.replace(", max_steps: 2500", "").replace("300 s", "10 s")
    data = nsdrill.run(nsdrill.load_study(study), tmp_path / "out.h5", progress=False)
    assert "9.55 revolutions" in str(nsdrill.show(data))
    part = data.isel(rotary_speed=slice(1, None))
    assert "9.55 revolutions" not in str(nsdrill.show(part))
    assert "9.55 revolutions" not in str(nsdrill.window(part)["short_observation"])


def test_a_replay_of_another_model_is_not_called_one_of_the_same_kind():
    other = Trajectory(None, 1, same_bits=False, differing=("model digest a there, b here",), other_code=True)
    assert "that of another model" in other.warning
    assert "same kind" not in other.warning
    assert "same kind" in Trajectory(None, 1, same_bits=False).warning
