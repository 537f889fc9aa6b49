"""What is seen of a point that is free from a quick start only is that of the start: the way up
whirls there."""

from dataclasses import replace

import numpy as np
import pytest
from figures.test_wording import WEIGHTS, made

from nsdrill.analysis.window import find_window
from nsdrill.app.answering.answers import results_for_window


def test_the_torque_and_the_yields_are_those_of_the_free_run():
    one = made(up=["wwwwwww"] * 5, down=["wwwwwww"] * 5, same=["......."] * 5)
    shape, ways = one["response"].shape, one.procedures
    values = {"up": 3.84, "down": 3.85, "same": 3.73}
    torque = np.zeros(shape) + np.reshape([values[way] for way in ways], [-1] + [1] * (len(shape) - 1))
    seen = {"surface_torque_mean": torque, "surface_torque_min": torque - 0.01, "surface_torque_max": torque + 0.01}
    seen |= {"lateral_acceleration_rms": np.ones(shape), "rate_of_penetration": torque}
    found = find_window(results_for_window(replace(one, variables={**one.variables, **seen})))["answer"]
    assert found.surface.torque == pytest.approx(3.73)
    assert found.surface.whirling == pytest.approx(3.85)
    assert found.yields["rate_of_penetration"] == pytest.approx(3.73)
    up_only = made(up=["wwwwwww"] * 5, same=["......."] * 5)
    part = {name: array[[ways.index("up"), ways.index("same")]] for name, array in seen.items()}
    found = find_window(results_for_window(replace(up_only, variables={**up_only.variables, **part})))["answer"]
    assert found.surface.whirling == pytest.approx(3.84)
    assert found.point["wob"] in WEIGHTS
