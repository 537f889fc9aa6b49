"""What the surface shows is told of one run each, at the weight and the depth that it is of: the answer may hold over
several, at which the torque and the period are others."""

import random
from dataclasses import replace

import numpy as np
import pytest

from analysis.grids import grid
from nsdrill.analysis.window import find_window
from nsdrill.app.answering.answers import results_for_window
from nsdrill.models.responses import STICK_SLIP, WHIRL
from nsdrill.words.answer import needed_for_words
from nsdrill.words.orders import Orders

SPEEDS = [8.0 + place for place in range(9)]
WEIGHTS = [20e3, 40e3, 60e3]
DEPTHS = [1000.0, 3000.0, 5000.0]
SEEN = ("surface_torque_mean", "surface_torque_min", "surface_torque_max", "stick_slip_period")


def drawn(draw, weights, depths):
    """A map in which some speeds are free at most settings; each run shows numbers of its own."""

    def line():
        sticks, free = draw.randint(1, 3), draw.randint(4, 6)
        return ("s" * sticks + "." * free + draw.choice("wb.") * len(SPEEDS))[: len(SPEEDS)]

    ways = draw.choice((("up",), ("up", "down"), ("same",)))
    one = grid({way: [[line() for _ in weights] for _ in depths] for way in ways}, SPEEDS, weights, depths)
    values = np.arange(1.0, 1.0 + one["response"].size).reshape(one["response"].shape)
    swings = (one["response"] & STICK_SLIP) > 0
    seen = {
        "surface_torque_mean": values,
        "surface_torque_min": np.where(swings, values - 0.5, values),
        "surface_torque_max": np.where(swings, values + 0.5, values),
        "stick_slip_period": np.where(swings, values, np.nan),
        "lateral_acceleration_rms": values,
    }
    return results_for_window(replace(one, variables={**one.variables, **seen}))


def run_at(results, name, at, speed):
    """What each way of the file shows at a setting."""
    place = [
        slice(None) if axis == "procedure" else int(np.argmin(np.abs(results.coords[axis] - value)))
        for axis, value in ((axis, {**results.held, **at, "rotary_speed": speed}.get(axis)) for axis in results.grid)
    ]
    return np.atleast_1d(results[name][tuple(place)]).tolist()


@pytest.mark.parametrize("seed", range(80))
def test_every_number_of_the_surface_is_that_of_a_run_at_the_weight_and_depth_that_are_named(seed):
    draw = random.Random(seed)
    weights, depths = draw.choice(((WEIGHTS, DEPTHS[:1]), (WEIGHTS[:1], DEPTHS), (WEIGHTS, DEPTHS)))
    results = drawn(draw, weights, depths)
    window = find_window(results)
    advice = window["answer"]
    seen = advice.surface
    if seen is None:
        return
    assert set(seen.at) == {axis for axis, values in (("wob", weights), ("depth", depths)) if len(values) > 1}
    speed = advice.point["rotary_speed"]
    assert seen.torque in run_at(results, "surface_torque_mean", seen.at, speed)
    if seen.sticking is not None:
        for end, value in zip(("min", "max"), seen.sticking, strict=True):
            assert value in run_at(results, f"surface_torque_{end}", seen.at, seen.sticking_at)
        assert seen.period in run_at(results, "stick_slip_period", seen.at, seen.sticking_at)
    if seen.whirling is not None:
        at = seen.whirling_at if seen.whirling_at is not None else speed
        assert seen.whirling in run_at(results, "surface_torque_mean", seen.at, at)
    # where the answer holds over several, each text of these numbers says of which they are
    words = Orders(*needed_for_words(window, "si"))
    ranges = {axis: one.low < one.high for axis, one in advice.stay_within.items()}
    ranges["depth"] = advice.depths is not None and advice.depths.first < advice.depths.last
    lines = [text for text in words.lines() if text.startswith("Surface")]
    orders = [text for text in (*words.do(""), *words.to_confirm("", 9)) if text.startswith("Watch the torque")]
    for text in (*lines, *orders):
        for axis, value in seen.at.items():
            named = f"{value:g} m" if axis == "depth" else f"{value / 1e3:g} kN"
            assert (named in text) == ranges.get(axis, False), text


@pytest.mark.parametrize("seed", range(40))
def test_the_least_shocks_tell_whirl_at_every_weight_and_depth_of_the_answer(seed):
    draw = random.Random(seed)
    free = [[["." * 7 + "ww"] * 3] * 3, [[draw.choice(("." * 5 + "wwww", "ww" + "." * 7)) for _ in WEIGHTS]] * 3]
    one = grid({"up": free[0], "down": [list(lines) for lines in free[1]]}, SPEEDS, WEIGHTS, DEPTHS)
    shocks = np.array([draw.uniform(1.0, 50.0) for _ in range(one["response"].size)]).reshape(one["response"].shape)
    seen = {"surface_torque_mean": np.ones(shocks.shape), "lateral_acceleration_rms": shocks}
    results = results_for_window(replace(one, variables={**one.variables, **seen}))
    advice = find_window(results)["answer"]
    if advice.surface is None or advice.surface.least_acceleration is None:
        return
    inside = (results["response"] & WHIRL) > 0
    for axis, (low, high) in advice.ends.items():
        values = results.coords[axis]
        shape = [-1 if name == axis else 1 for name in results.grid]
        inside = inside & np.reshape((values >= low) & (values <= high), shape)
    down = inside[list(results.procedures).index("down")]
    if down.any():
        met = shocks[list(results.procedures).index("down")][down]
        assert advice.surface.least_acceleration == pytest.approx(min(met))
