"""Seeds of scripts whose map over a revolution leads away from the equilibrium."""

import numpy as np
import pytest

import nsdrill
from nsdrill.analysis.bifurcations import HOPF

from .conftest import example


def test_an_equilibrium_inside_a_cycle_is_found_from_a_start_on_it():
    """The normal form of a supercritical Hopf point: the origin is the only equilibrium,
    and the start settles on the cycle around it."""

    @nsdrill.model
    def sheared(x=0.5, y=0.0, *, mu=0.1, w=1.0, c=0.3):
        r = x * x + y * y
        return mu * x - w * y - x * r + c * y * r, w * x + mu * y - y * r - c * x * r

    study = sheared.study(continued={"mu": (-1, 1), "seeds": [0.5]}, transient=100, observe=50)
    data = nsdrill.continue_branches(study)
    assert sorted(data.motion.values) == ["equilibrium", "limit_cycle"]
    assert data["parameters_mu"].values[data["label"].values == HOPF] == pytest.approx([0.0], abs=1e-6)


def test_a_cycle_that_is_found_after_two_periods_is_the_one_after_one():
    """At a belt speed of 0.1 samples pass the start of the squeal, which lasts 0.7327 s, unseen
    once: it was followed a second time, as a branch of motions of twice the period."""
    study = example("brake").study(continued={"belt": (0.09, 0.12), "seeds": [0.1, 0.11]}, transient=100)
    found = nsdrill.continue_branches(study, progress=False)
    (number,) = np.flatnonzero(found["motion"].values == "limit_cycle")
    periods = found["period"].values[found["branch_of_point"].values == number]
    # a little more than the 0.628 s of the free block, by the time for which it sticks
    assert np.all((periods > 0.63) & (periods < 0.76))
