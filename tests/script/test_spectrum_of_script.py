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
