"""What a declaration measures of a motion with contacts: several levels, means while a
quantity is above one, squares, maxima of what no polynomial follows; against closed
forms."""

import math
import re
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from nsdrill.kernel.settings import Simulation
from nsdrill.observe.channels import (
    Channel,
    Declaration,
    Extremes,
    Mean,
    MeanAbove,
    Names,
    RmsOfSlopes,
    TimeAbove,
    Winding,
    check,
)
from observe.declared_runs import Model, Observed, observe

TWO_PI = 2.0 * math.pi


# x = cos w t, y = sin w t / 2, in the one sense or the other.
def ellipse(t, phase, s, p, o):
    return {"vx": -p.w * p.w * s.x, "vy": -p.w * p.w * s.y}


ELLIPSE = Model(ellipse, Names(("x", "vx", "y", "vy"), ("ax", "ay"), ("w", "near", "far")))


def square(x, y):
    return x * x + y * y


def square_slope(x, vx, y, vy):
    return 2.0 * (x * vx + y * vy)


def square_curvature(x, vx, ax, y, vy, ay):
    return 2.0 * (vx * vx + vy * vy + x * ax + y * ay)


def x_squared(x):
    return x * x


def x_squared_slope(x, vx):
    return 2.0 * x * vx


def product(x, y):
    return max(x, 0.0) * y


def product_slope(x, vx, y, vy):
    return vx * y + x * vy if x > 0.0 else 0.0


def product_inside(x, vx, y, vy, near):
    slope = (vx if x > 0.0 else max(vx, 0.0)) * y + max(x, 0.0) * vy
    return max(x, 0.0) * y, slope


CHANNELS = (
    Channel("x", "x", "vx", "ax", level=0.5),
    Channel("y", "y", "vy", "ay"),
    Channel("vx", "vx", "ax", rate_of="x"),
    Channel("vy", "vy", "ay", rate_of="y"),
    Channel("radius", square, square_slope, square_curvature, level="near", scale=1.0, squared=True),
    Channel("x squared", x_squared, x_squared_slope),
    Channel("product", product, product_slope, scale=1.0, of=("x", "y"), inside=product_inside),
)
AROUND = Declaration(
    CHANNELS,
    (
        Extremes("x", "x_max", "x_min", "x_peaks", smooth=True),
        Extremes("radius", "radius_max", peaks="radius_peaks", smooth=True, maxima=True),
        Extremes("product", "product_max", smooth=True, maxima=True),
        TimeAbove("x", "x_above"),
        TimeAbove("radius", "near_fraction"),
        TimeAbove("radius", "far_fraction", level="far"),
        MeanAbove("vy", "x_above", "vy_beyond"),
        MeanAbove("x squared", "near_fraction", "near_square"),
        MeanAbove("x squared", "far_fraction", "far_square"),
        RmsOfSlopes(("vx", "vy"), "acceleration_rms"),
        RmsOfSlopes(("vy",), "ay_rms"),
        Winding("x", "y", "turning"),
        Winding("x", "y", "counted_turning", counted=True),
        Mean("x", "x_mean", compared="w"),
    ),
)
SPEEDS = np.array([1.0, 1.5, -2.0, 3.0])
NEAR, FAR = 0.6, 0.9


@lru_cache
def went(lanes: int, observe_for: float = 4.0 * TWO_PI) -> Observed:
    parameters = np.column_stack([SPEEDS, 0 * SPEEDS + NEAR, 0 * SPEEDS + FAR])
    start = np.column_stack([0 * SPEEDS + 1.0, 0 * SPEEDS, 0 * SPEEDS, 0.5 * SPEEDS])
    return observe(ELLIPSE, AROUND, parameters, start, Simulation(0.0, observe_for, 1e-10), lanes, peaks=3)


def test_an_ellipse_has_its_closed_forms():
    """The radius squared is (1 + 3 cos^2) / 4, above a level while |cos| is above that
    of an angle. Over whole turns, and half ones for w = 1.5."""
    o, w = went(1), np.abs(SPEEDS)
    near, far = (math.acos(math.sqrt((4.0 * r * r - 1.0) / 3.0)) for r in (NEAR, FAR))
    for name, wanted in {
        "x_max": 1.0,
        "x_min": -1.0,
        "radius_max": 1.0,
        "product_max": 0.25,
        "x_above": 1.0 / 3.0,
        "near_fraction": 2.0 * near / math.pi,
        "far_fraction": 2.0 * far / math.pi,
        "near_square": (near + 0.5 * math.sin(2.0 * near)) / math.pi,
        "far_square": (far + 0.5 * math.sin(2.0 * far)) / math.pi,
        "vy_beyond": 0.5 * SPEEDS * math.sin(math.pi / 3.0) / math.pi,
        "acceleration_rms": w**2 * math.sqrt(0.625),
        "ay_rms": w**2 * math.sqrt(0.125),
    }.items():
        assert o.found[name] == pytest.approx(wanted + 0.0 * SPEEDS, abs=1e-6), name
    assert o.peaks["radius_peaks"] == pytest.approx(np.ones((4, 3)), abs=1e-7)


@pytest.mark.parametrize("duration", [0.4, 5.0, 4.0 * TWO_PI])
def test_counted_half_revolutions_are_the_angle(duration):
    o = went(8, duration).found
    assert o["counted_turning"] == pytest.approx(o["turning"], abs=1e-11)
    assert np.all(np.sign(o["turning"]) == np.sign(SPEEDS))


@pytest.mark.parametrize("lanes", [8, 16])
def test_the_bits_depend_on_no_lanes(lanes):
    assert went(lanes).report.tobytes() == went(1).report.tobytes()


def test_a_smooth_quantity_has_the_extremes_and_peaks_of_any():
    plain = replace(AROUND, channels=(CHANNELS[0],), features=(Extremes("x", "x_max", "x_min", "x_peaks"),))
    parameters = np.column_stack([SPEEDS, SPEEDS, SPEEDS])
    start = np.column_stack([0 * SPEEDS + 1.0, 0 * SPEEDS, 0 * SPEEDS, 0.5 * SPEEDS])
    simulation = Simulation(0.0, 4.0 * TWO_PI, 1e-10)
    o, smooth = observe(ELLIPSE, plain, parameters, start, simulation, 8, peaks=3), went(8)
    for name in ("x_max", "x_min"):
        assert smooth.found[name] == pytest.approx(o.found[name], abs=1e-15)
    assert smooth.peaks["x_peaks"] == pytest.approx(o.peaks["x_peaks"], abs=1e-15)


def throw(t, phase, s, p, o):
    return {"v": -p.g}


THROW = Model(throw, Names(("x", "v"), ("a",), ("g", "far")))


@pytest.mark.parametrize("maxima", [True, False])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_visits_of_two_levels_inside_one_step(sign, maxima):
    """x = 2 t - t^2 in one step of 2 s: above 0.75 for 1 s and above 0.96 for 0.4 s,
    both about 1 s, which is the mean of the time there; turned over, below as long."""
    declaration = Declaration(
        (Channel("x", "x", "v", "a", level=0.75 * sign), Channel("time", "time", 1.0)),
        (
            Extremes("x", "high", smooth=True, maxima=maxima),
            TimeAbove("x", "near"),
            TimeAbove("x", "beyond", level="far"),
            MeanAbove("time", "near", "near_time"),
            MeanAbove("time", "beyond", "far_time"),
        ),
    )
    o = observe(
        THROW, declaration, [2.0 * sign, 0.96 * sign], [0.0, 2.0 * sign], Simulation(0.0, 4.0, 1e-3), first_step=2.0
    ).found
    # in the second half, from 2 to 4 s, x is below 0; turned over, above 0
    wanted = {"near": 1.0, "beyond": 0.4, "near_time": 1.0, "far_time": 0.4}
    if sign < 0:
        wanted = {"near": 3.0, "beyond": 3.6, "near_time": 7.0, "far_time": 7.6}
    for name, integral in wanted.items():
        assert o[name] == pytest.approx([integral / 4.0], abs=1e-12), name
    assert o["high"] == pytest.approx([1.0 if sign > 0 else 8.0], abs=1e-12)


def test_a_polynomial_that_does_not_follow_is_not_looked_at():
    """x = 2 t - t^2 in one step of 2 s: its top is left out where ``unless`` holds."""
    found = []
    for at_start, at_end in ((None, 0.0), (None, 1.0), ("far", 1.0), ("g", 1.0)):
        declaration = Declaration(
            (Channel("x", "x", "v", "a", level=0.5),),
            (Extremes("x", "high", unless=(at_start, at_end)), TimeAbove("x", "share")),
        )
        o = observe(THROW, declaration, [2.0, -1.0], [0.0, 2.0], Simulation(0.0, 4.0, 1e-3), first_step=2.0).found
        found.append((round(o["high"][0], 12), bool(o["share"][0] > 0.0)))
    assert found == [(1.0, True), (0.0, False), (1.0, True), (0.0, False)]


def test_the_halves_are_compared_by_the_scale_that_is_given():
    """x = 2 t - t^2 over two halves of 2 s each: its means are 2/3 and -10/3."""
    channels = (Channel("x", "x", "v", "a", level=0.0, scale=1.0),)

    def differing(*features):
        o = observe(THROW, Declaration(channels, features), [2.0, 5.0], [0.0, 2.0], Simulation(0.0, 4.0, 1e-6))
        return float(o.found["half_difference"][0])

    assert differing(Mean("x", "m", compared="far")) == pytest.approx(4.0 / 5.0)
    assert math.isnan(differing(Mean("x", "m"), Extremes("x", "high", compared=None)))
    # from 0 to 1, then from -8 to 0: by 8 of 9, and a hundredth of the scale
    assert differing(Extremes("x", "high", compared="g")) == pytest.approx(8.0 / 9.02)
    twice = Extremes("x", "high", compared=lambda g: 10.0 * g)
    assert differing(twice) == pytest.approx(8.0 / 9.2)


X = Channel("x", "x", "v", "a", level=0.0)
INSIDE = replace(X, of=("x",), inside=lambda x, v, g: (x, v))


@pytest.mark.parametrize(
    ("features", "facts"),
    [
        ((TimeAbove("x", "t", level="x"),), ("TimeAbove 't': level", "'x'", "far, g")),
        ((MeanAbove("x", "t", "m"),), ("MeanAbove 'm': above", "'t'", "nothing")),
        ((RmsOfSlopes(("y",), "m"),), ("RmsOfSlopes", "'y'", "allowed: x")),
        ((Extremes("x", "high", unless=(None, "y")),), ("Extremes of 'x': unless", "'y'", "far")),
        ((Extremes("x", "high", compared="x"),), ("Extremes of 'x': compared", "'x'", "far, g")),
        ((Extremes("x", "high"), Extremes("x", "top", smooth=True)), ("Extremes of 'x'", "differ", "the same")),
        ((Extremes("x", least="low", maxima=True),), ("Extremes of 'x'", "'low'", "maxima")),
    ],
)
def test_a_wrong_feature_is_told(features, facts):
    with pytest.raises(ValueError, match=re.escape(facts[0])) as caught:
        check(THROW.names, Declaration((X,), features))
    for fact in facts[1:]:
        assert fact in str(caught.value)


@pytest.mark.parametrize(
    ("channel", "feature", "facts"),
    [
        (INSIDE, Extremes("x", "high"), ("Extremes of 'x'", "inside", "smooth and maxima")),
        (INSIDE, Mean("x", "m"), ("Mean 'm'", "inside", "Extremes only")),
        (replace(INSIDE, of=("y",)), Mean("x", "m"), ("channel 'x': of", "'y'", "allowed: x")),
        (
            replace(INSIDE, inside=lambda x, v, q: (x, v)),
            Mean("x", "m"),
            ("channel 'x': inside", "'q'", "allowed: far, g"),
        ),
    ],
)
def test_a_wrong_function_inside_is_told(channel, feature, facts):
    with pytest.raises(ValueError, match=re.escape(facts[0])) as caught:
        check(THROW.names, Declaration((channel,), (feature,)))
    for fact in facts[1:]:
        assert fact in str(caught.value)
