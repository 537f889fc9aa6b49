"""Friction that steepens approaches Coulomb's: against a Filippov system that SciPy
integrates with events."""

import numpy as np
import pytest


def test_stick_slip_approaches_the_limit_cycle_of_coulombs_friction():
    """Smoothing takes the top off friction that falls with speed: what is lacking of
    the greatest torque falls as 1/sqrt(eps), by the square root of a hundred from 1e4
    to 1e6, and so do the features that follow from it."""
    from benchmarks.limit import filippov, stick_slip

    limit = filippov()
    found = {smoothing: stick_slip(smoothing) for smoothing in (1e4, 1e6)}
    for name in ("bit_speed_max", "bit_torque_max", "surface_torque_min", "surface_torque_max"):
        far, near = ((found[smoothing][name] - limit[name]) / limit[name] for smoothing in (1e4, 1e6))
        assert abs(near) < 5e-3, name
        assert far / near == pytest.approx(10.0, rel=0.3), name
    assert found[1e6]["stuck_fraction"] == pytest.approx(limit["stuck_fraction"], abs=0.01)
    assert np.sign(found[1e6]["bit_torque_max"] - limit["bit_torque_max"]) == -1.0, "from below"
