"""Friction laws by themselves."""

from __future__ import annotations

import numpy as np
import pytest

from nsdrill.equations.trace import Named
from nsdrill.models.friction import LAWS, Numbers, values


@pytest.mark.parametrize("name", LAWS)
def test_no_slip_falls_more_steeply_than_the_law_says(name: str) -> None:
    """And one falls as steeply: a scan of the slips without smoothing."""
    numbers = {"smoothing": 1e12, "decay": 3.0, "rise": 0.7, "dynamic": 0.2}
    slips = np.concatenate([[1e-9], np.linspace(1e-3, 10.0, 200_001)])
    falls = values(LAWS[name], "fall", slips, Numbers(**numbers))
    assert np.max(falls) == pytest.approx(LAWS[name].steepest_fall(Named(**numbers)), rel=1e-6)
