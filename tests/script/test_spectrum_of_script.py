"""All Lyapunov exponents of a model of a script."""

import numpy as np
import pytest

import nsdrill
from script.conftest import example


@pytest.fixture
def squealing():
    brake = example("brake")
    return nsdrill.run(brake.study(transient=60, observe=60, exponent=True), progress=False)


def test_the_heat_of_a_brake_decays_at_its_own_rate(squealing):
    found = nsdrill.lyapunov_spectrum(squealing)
    assert found["exponents"][1] == pytest.approx(-0.5, abs=1e-4)  # the belt cools so, whatever the block does
    assert abs(found["exponents"][0]) < 1e-3
    assert found["signs"] == ["zero", "negative", "negative"]
    assert found["settled"] is True
    largest = float(squealing.lyapunov_exponent.values.ravel()[0])
    error = float(squealing.lyapunov_error.values.ravel()[0])
    assert abs(found["exponents"][0] - largest) < 3.0 * np.hypot(error, found["errors"][0]) + 1e-3
    assert found == nsdrill.lyapunov_spectrum(squealing, workers=2)  # the same bits


def test_exponents_are_refused_where_slopes_jump(script):
    """With the numbers of the run, not with those that the script gives."""
    text = (
        "@nsdrill.model\ndef stop(t, x=0.1, v=0.0, *, preload=0.0, omega=1.0):\n"
        "    closed = nsdrill.touching('end', x)\n    push = 9.0 * closed + (preload if closed > 0.0 else 0.0)\n"
        "    return v, np.cos(omega * t) - x - 0.1 * v - push\n"
    )
    stop = script(text, "preloaded").stop
    found = nsdrill.run(stop.study(preload=[0.0, 0.5], transient=20, observe=20), progress=False)
    assert len(nsdrill.lyapunov_spectrum(found, at={"parameters.preload": 0.0})["exponents"]) == 2
    with pytest.raises(nsdrill.InputError, match="slopes of the model stop that jump at a condition on x"):
        nsdrill.lyapunov_spectrum(found, at={"parameters.preload": 0.5})
