"""The kind of motion along one axis: panels for what there is, and no others."""

from __future__ import annotations

import numpy as np
import pytest
from made_up import make_results

from nsdrill.data import Results
from nsdrill.plot import draw
from nsdrill.variables import CHAOTIC, PERIODIC

SPEEDS = np.linspace(1.0, 8.0, 8)


@pytest.fixture
def motions() -> Results:
    """Eight points, six of period two and two chaotic, with the 0-1 test for these and
    without Lyapunov exponents."""
    made = make_results(rotary_speed=SPEEDS)
    shape = made["status"].shape
    motion, period, zero_one = np.full(shape, PERIODIC), np.full(shape, 2), np.full(shape, np.nan)
    motion[..., 3:5], period[..., 3:5], zero_one[..., 3:5] = CHAOTIC, 0, 0.9
    more = {"motion": motion, "period": period, "zero_one": zero_one}
    return Results(made.coords, {**made.variables, **more}, made.attrs)


def labels(results: Results) -> list[str]:
    return [axes.get_ylabel() for axes in draw(results, "motion").axes]


def test_a_panel_for_everything_there_is(motions: Results) -> None:
    assert labels(motions) == ["", "Motion", "0-1 test $K$", "Period\n[returns]"]


def test_no_panel_without_values(motions: Results) -> None:
    motions.variables["zero_one"][:] = np.nan
    assert labels(motions) == ["", "Motion", "Period\n[returns]"]
    motions.variables["motion"][:] = CHAOTIC
    assert labels(motions) == ["", "Motion"]


def test_only_periods_of_periodic_motions_are_drawn(motions: Results) -> None:
    motions.variables["period"][..., 4] = 7
    [line] = [line for line in draw(motions, "motion").axes[3].get_lines() if line.get_marker() == "o"]
    drawn = np.asarray(line.get_ydata(), dtype=float)
    assert np.array_equal(np.isfinite(drawn), motions["motion"].ravel() == PERIODIC)
    assert np.nanmax(drawn) == 2
