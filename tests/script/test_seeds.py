"""Seeds of scripts whose map over a revolution leads away from the equilibrium."""

import pytest

import nsdrill
from nsdrill.analysis.bifurcations import HOPF


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
