"""Pulses of a forcing that lie within a step."""

import re

import pytest

import nsdrill
from nsdrill.models.registry import model_named

PULSES = """
@nsdrill.model
def pulsed(t, x=0.0, *, width=0.01, height=100.0):
    return {"x": -0.05 * x + (height if np.sin(2 * np.pi * t / 100) > 1 - width * 1e-3 else 0.0)}


@nsdrill.model
def knocked(t, x=0.0, *, at=300.0, half=0.1):
    return {"x": -0.05 * x + (1.0 if abs(t - at) < half else 0.0)}


@nsdrill.model
def driven(t, x=0.0, v=0.0, *, f=1.0):
    return {"x": v, "v": -x - 0.1 * v + f * np.cos(t) + (1.0 if np.sin(t) > 0.9 else 0.0)}
"""


@pytest.mark.parametrize(
    ("model", "said"),
    [("pulsed", "for 0.142 s in each 100 s"), ("knocked", "for 0.2 s in each 600 s"), ("driven", None)],
)
def test_pulses_that_steps_may_jump_over_are_told(script, model, said):
    """Of sin > 1 - 1e-5, arccos(1 - 1e-5) / pi = 0.001424 of 100 s; of a single knock its 0.2 s in 600 s, which
    makes the motion no periodic one; a tenth of a period is noticed by steps."""
    script(PULSES, "pulses")
    study = {"model": model, "simulation": {"transient": "300 s", "observe": "300 s"}}
    told = [one for one in nsdrill.check(study).warnings if one.startswith("Pulse:")]
    found = [re.search(r"changes for ([\d.]+) s in each (\d+) s", one).groups() for one in told]
    wanted = re.findall(r"for ([\d.]+) s in each (\d+) s", said or "")
    assert len(found) == len(wanted)
    for one, other in zip(found, wanted, strict=True):
        assert float(one[0]) == pytest.approx(float(other[0]), rel=0.06)  # of 21 samples
        assert one[1] == other[1]
    assert (model_named(model).reading.rate is None) == (model == "knocked")
