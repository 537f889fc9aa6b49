"""Results compared bit for bit, and the end of one run as the start of another."""

from collections.abc import Iterable

import numpy as np
import xarray

from nsdrill.models.christoforou_yigit.columns import STATE_NAMES

UNITS = ("m", "m/s", "m", "m/s", "m", "m/s", "rad", "rad/s", "rad")


def alike(several: xarray.Dataset, one: xarray.Dataset) -> None:
    """Every variable of ``one`` is in ``several`` with its bits, whatever more states
    there are."""
    for name in one.data_vars:
        here = several[name].sel(state=one.state) if "state" in several[name].dims else several[name]
        there = one[name]
        assert np.array_equal(here.transpose(*there.dims).values, there.values, equal_nan=True), name


def starting_in(state: Iterable[float]) -> list[str]:
    """The changes of a study that then begins in this state [SI]."""
    return [f"initial.{n}={float(v)!r} {u}" for n, v, u in zip(STATE_NAMES, state, UNITS, strict=True)]
