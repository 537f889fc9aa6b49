"""The made-up data of :mod:`made_up` as fixtures."""

import numpy as np
import pytest
from made_up import make_results, make_trace, spoil
from matplotlib.figure import Figure
from xarray import Dataset

from nsdrill.analysis.bifurcations import FOLD


@pytest.fixture
def laid_out():
    """For tests that look where things stand on the page, and that everything can be
    written there."""


@pytest.fixture(autouse=True)
def unless_laid_out(request, monkeypatch):
    """To lay out a page takes most of the time of a picture; what is drawn does not
    depend on it."""
    if "laid_out" not in request.fixturenames:
        monkeypatch.setattr(Figure, "draw_without_rendering", lambda figure: None)


@pytest.fixture
def speeds():
    """Up and down over 61 speeds, a few points failed."""
    return spoil(make_results(rotary_speed=np.linspace(1, 8, 61), procedures=("up", "down")))


@pytest.fixture
def plane():
    """Depth against speed, one procedure, unequal steps."""
    return make_results(depth=np.geomspace(500, 9000, 9), rotary_speed=np.linspace(1, 8, 15))


@pytest.fixture
def branches():
    """One branch of radii from 20 to 80 mm between 2 and 8 rad/s, stable up to 5 rad/s,
    with a fold at 3 rad/s, where the radius is 30 mm."""
    speed = np.linspace(2.0, 8.0, 601)
    return Dataset(
        {
            "rotary_speed": ("point", speed),
            "radius_max": ("point", np.linspace(0.02, 0.08, 601)),
            "unstable": ("point", (speed > 5.0).astype(int)),
            "label": ("point", np.where(np.arange(601) == 100, FOLD, 0)),
            "row_size": ("branch", np.array([601])),
            "motion": ("branch", np.array(["periodic"])),
        },
        attrs={"along": "rotary_speed", "continue_from": 2.0, "continue_to": 8.0, "gap": 0.0762},
    )


@pytest.fixture
def trace():
    return make_trace()
