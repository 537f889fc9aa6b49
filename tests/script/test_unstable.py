"""A motion that the slightest disturbance leaves: a run that rests on it says nothing of what a
real system does there."""

import math

import numpy as np
import pytest

import nsdrill
from nsdrill.analysis.unstable import is_unstable
from nsdrill.variables import CHAOTIC, EQUILIBRIUM, PERIODIC

DAMPING = 0.1


@pytest.fixture
def upright():
    """A cart that is driven, with a pendulum that stands on its head and is not touched."""

    @nsdrill.model(responses={"fallen": ("q_max", 1.0)})
    def upright(
        t,
        x=0.0,
        v=0.0,
        q=nsdrill.number(0.0, scale=0.1),
        w=nsdrill.number(0.0, scale=0.1),
        *,
        force=0.3,
        damping=DAMPING,
    ):
        return v, force * np.cos(1.2 * t) - 0.2 * v - x, w, np.sin(q) - damping * w

    return upright


def study(model, **values):
    return model.study(
        force=(0.1, 0.4, 4), procedure="up-down", transient=200, observe=200, exponent=True, poincare=64, **values
    )


def test_a_rest_on_its_head_is_not_recommended(upright):
    """Of d^2 q + c dq - q = 0 a deviation grows by (sqrt(c^2 + 4) - c) / 2."""
    with pytest.warns(nsdrill.RunWarning, match=r"AN UNSTABLE MOTION: in 8 of 8 runs"):
        data = nsdrill.run(study(upright), progress=False)
    rate = (math.sqrt(DAMPING**2 + 4.0) - DAMPING) / 2.0
    np.testing.assert_allclose(data.lyapunov_exponent, rate, rtol=1e-3)
    assert set(np.ravel(data.motion)) == {PERIODIC}
    found = nsdrill.window(data)
    assert found["known"] == 0
    assert found["unstable_motion"]["runs"] == 8
    assert not found["answer"]["point"]
    assert found["answer"]["sentence"].startswith("No answer")
    assert not bool(data.nsdrill.safe().any())
    shown = nsdrill.show(data)
    assert "AN UNSTABLE MOTION" in shown
    assert "unstable motion" in shown.split("Along the sweep:")[1]


def test_what_has_fallen_is_known(upright):
    """Beside its rest it falls, which is a response, and swings about the lower one for ever."""
    data = nsdrill.run(study(upright, q=0.01), progress=False)
    found = nsdrill.window(data)
    assert found["known"] == found["of"] == 8
    assert found["unstable_motion"] == {}


def test_chaos_and_errors_are_no_unstable_motion():
    motion = np.array([PERIODIC, EQUILIBRIUM, CHAOTIC, PERIODIC, PERIODIC, PERIODIC])
    exponent = np.array([0.1, 0.1, 0.1, 0.02, 0.1, np.nan])
    error = np.array([0.01, 0.01, 0.01, 0.01, 0.04, np.nan])
    assert is_unstable(motion, exponent, error, 100.0).tolist() == [True, True, False, False, False, False]


def test_a_start_that_rests_on_its_head_is_on_no_attractor(upright):
    """Of four starts two are upright to the last bit: they are none of a free motion."""
    plane = {"x": (0.0, 0.1, 2), "q": (0.0, 0.3, 2)}
    with pytest.warns(nsdrill.RunWarning, match="AN UNSTABLE MOTION"):
        data = nsdrill.run(
            upright.study(slice=plane, transient=200, observe=200, exponent=True, poincare=64), progress=False
        )
    (point,) = nsdrill.attractors(data)
    numbers = [point[name] for name in ("starts", "known", "failed", "doubtful", "ungrouped")]
    assert numbers == [4, 2, 0, 2, 0]
    assert {one["response"] for one in point["attractors"]} == {"fallen"}
    assert sum(one["share"] for one in point["attractors"]) == 1.0
    shown = nsdrill.show(data).split("Attractors,")[1]
    assert "no critical response" not in shown
    assert "2 of 4 starts off speed or on an unstable motion: not known" in shown
    basin = figure_words(nsdrill.plot(data, "basin"))
    assert "not known (2 of 4 starts, 0 failed)" in basin
    assert "no critical response" not in basin


def figure_words(figure):
    legends = [*figure.legends, *(axes.get_legend() for axes in figure.axes if axes.get_legend())]
    return " ".join(text.get_text() for legend in legends for text in legend.get_texts())
