"""What plain readers of files are told of runs that are not known: xarray without nsdrill."""

import numpy as np
import pytest
import xarray
from strings import FAILS_FIRST

import nsdrill
import nsdrill.store

UNSETTLED = """
modes: {axial: frozen, lateral: frozen}
operation: {wob: 22 kN}
sweep: {rotary_speed: [3 rad/s, 30 rad/s]}
simulation: {transient: 0 s, observe: 5 s}
"""


def words(variable):
    """The words of a flag variable by CF alone."""
    meanings = dict(zip(variable.attrs["flag_values"].tolist(), variable.attrs["flag_meanings"].split(), strict=True))
    return [meanings[value] for value in variable.values.ravel().tolist()]


@pytest.fixture(scope="module")
def fails_first(tmp_path_factory):
    folder = tmp_path_factory.mktemp("fails_first")
    (folder / "study.yaml").write_text(FAILS_FIRST)
    with pytest.warns(nsdrill.RunWarning):
        nsdrill.run(folder / "study.yaml", folder / "out.h5", progress=False)
    return folder / "out.h5"


def test_plain_xarray_tells_which_runs_are_not_known(fails_first, tmp_path):
    nsdrill.store.to_netcdf(fails_first, tmp_path / "out.nc")
    nsdrill.open_results(fails_first).to_netcdf(tmp_path / "xarray.nc", engine="h5netcdf")
    nsdrill.save(nsdrill.open_results(fails_first), tmp_path / "saved.nc")
    for path in (fails_first, *(tmp_path / name for name in ("out.nc", "xarray.nc", "saved.nc"))):
        with xarray.open_dataset(path, engine="h5netcdf") as data:
            assert words(data.knowledge) == ["failed", *["not_carried"] * 3]
            assert data.knowledge.dims == data.response.dims
            assert data.knowledge.rotary_speed.values.tolist() == data.rotary_speed.values.tolist()


def test_a_part_keeps_what_was_not_known(fails_first, tmp_path):
    nsdrill.save(nsdrill.open_results(fails_first).isel(rotary_speed=slice(1, None)), tmp_path / "part.nc")
    with xarray.open_dataset(tmp_path / "part.nc", engine="h5netcdf") as data:
        assert words(data.knowledge) == ["not_carried"] * 3


def test_an_unfinished_run_tells_what_was_not_run(fails_first):
    with nsdrill.open_results(fails_first) as data:
        pending = data.copy(deep=True)
    pending["status"] = pending.status * 0
    found = nsdrill.store.to_dataset(nsdrill.store.from_dataset(pending.drop_vars("not_carried")))
    assert words(found.knowledge) == ["not_run"] * 4


def test_what_had_not_settled_is_told_and_new_labels_are_followed(tmp_path):
    data = nsdrill.run(UNSETTLED, tmp_path / "out.h5", progress=False)
    assert words(data.knowledge) == ["unsettled" if one == 0 else "known" for one in data.settled.values]
    assert "unsettled" in words(data.knowledge)
    nsdrill.classify(tmp_path / "out.h5", ["classify.settled.tolerance=100"])
    with xarray.open_dataset(tmp_path / "out.h5", engine="h5netcdf") as again:
        assert np.array_equal(again.knowledge == 0, again.settled == 1)


def test_the_flag_says_what_the_accessor_says(fails_first):
    with nsdrill.open_results(fails_first) as data:
        assert np.array_equal(data.knowledge.isin((0, 1)), data.nsdrill.known)
