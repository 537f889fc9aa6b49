"""What is seen of a point that is free from a quick start only is that of the start: the way up
whirls there."""

from dataclasses import replace

import numpy as np
import pytest
from figures.test_wording import FREE, ROLLS, SPEEDS, WALL, WEIGHTS, made

from nsdrill.analysis.advice import without
from nsdrill.analysis.graded import graded
from nsdrill.analysis.trials import HELD, Outcome, Trial, Way
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


def test_the_torque_of_stick_slip_is_that_of_a_run_that_stuck():
    """Not that of the speed at which only a trial stuck, where the map has a free run."""
    one = made(WALL, up=["ss....."] * 5, down=ROLLS)
    torque = np.broadcast_to(np.arange(len(SPEEDS), dtype=float), one["response"].shape)
    seen = {"surface_torque_mean": torque, "surface_torque_min": torque - 0.5, "surface_torque_max": torque + 0.5}
    results = results_for_window(replace(one, variables={**one.variables, **seen}))
    advice = find_window(results)["answer"]
    assert advice.surface.sticking_at == SPEEDS[1]
    trial = Trial(HELD, Way.CORNER, Outcome.VIBRATES, ("stick_slip",), speed=SPEEDS[2], wob=advice.point["wob"])
    found = without(graded(results), advice, [trial])
    assert found.stay_within["rotary_speed"].low > SPEEDS[2]
    assert (found.surface.sticking_at, found.surface.sticking) == (SPEEDS[1], (0.5, 1.5))


def test_the_least_shocks_within_the_limits_tell_whirl():
    one = made(WALL, up=FREE, down=["wwwwwww"] * 5)
    shape = one["response"].shape
    grows = np.broadcast_to(np.arange(1.0, 1.0 + len(SPEEDS)), shape)
    seen = {"surface_torque_mean": np.ones(shape), "lateral_acceleration_rms": grows}
    found = find_window(results_for_window(replace(one, variables={**one.variables, **seen})))["answer"]
    low = list(SPEEDS).index(found.stay_within["rotary_speed"].low)
    assert found.surface.least_acceleration == low + 1.0
    # torque and shocks of one line are those of one run
    assert found.surface.whirling_at is None
    assert found.surface.acceleration == list(SPEEDS).index(found.point["rotary_speed"]) + 1.0 > low + 1.0
