"""The observer made from declarations, on models of one trajectory through the real
kernel: against closed forms and against SciPy."""

import math
import re
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
import pytest
from machine_code import packed_and_single, text_of
from scipy.integrate import solve_ivp

from nsdrill.abi import Layout
from nsdrill.compiler.functions import BUFFER, compiled, packed
from nsdrill.compiler.language import LanguageError
from nsdrill.equations.library import direction, sincos
from nsdrill.kernel.batch import Batch, Compiled, Runs
from nsdrill.kernel.settings import Simulation
from nsdrill.kernel.steppers import STEPPERS, with_step
from nsdrill.observe.channels import (
    Channel,
    Declaration,
    Derived,
    Extremes,
    Mean,
    Names,
    Outputs,
    Section,
    TimeAbove,
    check,
)
from nsdrill.observe.declared import make_observer, observed_rows
from nsdrill.observe.findings import measured, new_store, outcome_width
from observe.declared_runs import Model, Observed, observe, with_feature
from observe.sampled import above, integral, lowest, slips

TWO_PI = 2.0 * math.pi


# A harmonic oscillator, damped: x'' = -w^2 x - 2 d x'.
def swing(t, phase, s, p, o):
    return {"v": -p.w * p.w * s.x - 2.0 * p.d * s.v}


SWING = Model(swing, Names(("x", "v"), ("a",), ("w", "d")))


def energy(x, v, w):
    return 0.5 * (v * v + w * w * x * x)


def power(x, v, a, w):
    return v * a + w * w * x * v


SWINGING = Declaration(
    (
        Channel("x", "x", "v", "a", level=0.5),
        Channel("v", "v", "a", rate_of="x", level=-0.25),
        Channel("v by a cubic", "v", "a", level=-0.25),
        Channel("energy", energy, power, scale=1.0),
    ),
    (
        Extremes("x", greatest="x_max", least="x_min", peaks="x_peaks"),
        TimeAbove("x", "x_above"),
        Mean("x", "x_mean"),
        Extremes("v", greatest="v_max", least="v_min"),
        TimeAbove("v", "v_above"),
        Mean("v", "v_mean"),
        Extremes("v by a cubic", greatest="cubic_max", least="cubic_min"),
        TimeAbove("v by a cubic", "cubic_above"),
        Mean("v by a cubic", "cubic_mean"),
        Extremes("energy", least="energy_min"),
        Derived("v_max_by_w", lambda v_max, w: v_max / w),
        Derived("twice", lambda v_max_by_w: 2.0 * v_max_by_w),
    ),
)
SPEEDS = np.linspace(1.0, 3.0, 21)


@lru_cache
def swung(lanes: int) -> Observed:
    """Whole periods of every speed's own from x = 1, v = 0, undamped; after a transient
    of 1 s."""
    return observe(
        SWING,
        SWINGING,
        np.column_stack([SPEEDS, 0.0 * SPEEDS]),
        [1.0, 0.0],
        Simulation(1.0, 10.0 * TWO_PI, 1e-9),
        lanes,
        peaks=4,
    )


def test_an_oscillator_has_its_closed_form():
    """x = cos w t, w = 1, 1.1, ... 3, over 10 units of 2 pi: for w = 1, 1.1, 1.2 ...
    whole periods. The integration at rtol 1e-9 over 200 periods at most leaves 1e-6 of
    energy; a cubic adds its own (h^4 / 384 x''''), 1e-6 here."""
    o, w = swung(1).found, SPEEDS
    for name, wanted in {
        "x_max": 1.0,
        "x_min": -1.0,
        "x_above": 1.0 / 3.0,
        "x_mean": 0.0,
        "v_max": w,
        "v_min": -w,
        "v_above": 0.5 + np.arcsin(0.25 / w) / math.pi,
        "v_mean": 0.0,
        "cubic_max": w,
        "cubic_min": -w,
        "cubic_above": 0.5 + np.arcsin(0.25 / w) / math.pi,
        "cubic_mean": 0.0,
        "energy_min": 0.5 * w * w,
        "v_max_by_w": 1.0,
        "twice": 2.0,
    }.items():
        assert o[name] == pytest.approx(wanted * np.ones(21), abs=1e-6), name
    assert swung(1).peaks["x_peaks"] == pytest.approx(np.ones((21, 4)), abs=1e-6)
    assert list(o) == [name for name, _ in SWINGING.named_features] + ["half_difference"]


def test_means_are_those_of_any_part_of_a_period():
    """Over a window that is no whole period: from t = 1 to 4, w = 2, at rtol 1e-11. The
    cubic's own error is of fourth order in steps of some 0.05 s: h^4 / 384 of the
    fourth derivative, 1e-8."""
    o = observe(SWING, SWINGING, [2.0, 0.0], [1.0, 0.0], Simulation(1.0, 3.0, 1e-11)).found
    x_mean = (math.sin(8.0) - math.sin(2.0)) / 6.0
    v_mean = (math.cos(8.0) - math.cos(2.0)) / 3.0
    assert o["x_mean"] == pytest.approx([x_mean], abs=1e-10)
    for name in ("v", "cubic"):
        assert o[f"{name}_mean"] == pytest.approx([v_mean], abs=1e-8 if name == "cubic" else 1e-10)


@pytest.mark.parametrize("lanes", [8, 16])
def test_the_bits_depend_on_no_lanes(lanes):
    assert swung(lanes).report.tobytes() == swung(1).report.tobytes()


def test_the_bits_depend_on_no_neighbours():
    order = np.random.default_rng(1).permutation(len(SPEEDS))
    mixed = observe(
        SWING,
        SWINGING,
        np.column_stack([SPEEDS, 0.0 * SPEEDS]),
        [1.0, 0.0],
        Simulation(1.0, 10.0 * TWO_PI, 1e-9),
        8,
        peaks=4,
        order=order,
    )
    assert mixed.report.tobytes() == swung(1).report.tobytes()


def test_each_run_of_a_chain_begins_anew():
    """The second run measures what one by itself does that starts where the first
    ended."""
    parameters = [[2.0, 0.05], [1.5, 0.05]]
    chain = observe(SWING, SWINGING, parameters, [1.0, 0.0], Simulation(1.0, 10.0, 1e-9), 8, chained=True)
    second = observe(SWING, SWINGING, parameters[1:], chain.final[0], Simulation(1.0, 10.0, 1e-9), 8)
    assert second.report[0].tobytes() == chain.report[1].tobytes()


def test_a_feature_more_leaves_the_others_as_they_are():
    """And one whose channel, outputs and section are new as well."""
    more = replace(
        with_feature(SWINGING, Extremes("square of v", greatest="most", peaks="tops"), TimeAbove("square of v", "q")),
        channels=(Channel("square of v", "square", "rate", level=0.25, scale=1.0), *SWINGING.channels),
        outputs=Outputs(("square", "rate"), lambda v, a: (v * v, 2.0 * v * a)),
        section=Section("x", 0.7),
    )
    other = observe(
        SWING,
        more,
        np.column_stack([SPEEDS, 0.0 * SPEEDS]),
        [1.0, 0.0],
        Simulation(1.0, 10.0 * TWO_PI, 1e-9),
        8,
        peaks=4,
        returns=3,
    )
    for name, values in swung(1).found.items():
        assert name == "half_difference" or other.found[name].tobytes() == values.tobytes(), name
    assert other.peaks["x_peaks"].tobytes() == swung(1).peaks["x_peaks"].tobytes()
    assert other.found["most"] == pytest.approx(SPEEDS**2, rel=1e-6)
    assert other.peaks["tops"] == pytest.approx(np.tile(SPEEDS[:, None] ** 2, 4), rel=1e-6)


# The torsional string of one degree of freedom: its bit sticks and slips under a
# smoothed friction torque, and the last of its runs has a periodic torque besides.
def torsion(t, phase, s, p, o):
    falling = p.torque / (1.0 + 3.0 * abs(s.bit_speed)) + 0.5 * p.torque
    friction = direction(p.smoothing * s.bit_speed) * falling
    forced = p.wobble * sincos(1.7 * t)[0]
    torque = forced - p.damping * s.bit_speed - p.stiffness * s.twist - friction
    return {"bit_speed": torque / p.inertia}


TORSION = Model(
    torsion,
    Names(
        ("twist", "bit_speed"),
        ("bit_acceleration",),
        ("inertia", "stiffness", "damping", "torque", "smoothing", "drive_speed", "stuck_below", "wobble"),
    ),
)


def kinetic(inertia, bit_speed):
    return 0.5 * inertia * bit_speed * bit_speed


def kinetic_rate(inertia, bit_speed, bit_acceleration):
    return inertia * bit_speed * bit_acceleration


TURNING = Declaration(
    (
        Channel("twist", "twist", "bit_speed", "bit_acceleration", frame="drive_speed"),
        Channel("bit speed", "bit_speed", "bit_acceleration", rate_of="twist", level="stuck_below"),
        Channel("energy", kinetic, kinetic_rate, scale=1000.0),
    ),
    (
        Extremes("twist", greatest="twist_max", least="twist_min"),
        Mean("twist", "twist_mean"),
        Extremes("bit speed", greatest="speed_max", least="speed_min", peaks="speed_peaks", slip="drive_speed"),
        TimeAbove("bit speed", "free"),
        Mean("bit speed", "speed_mean"),
        Extremes("energy", greatest="energy_max"),
        Mean("energy", "energy_mean"),
        Derived("stuck", lambda free: 1.0 - free),
        Derived("surface_torque_max", lambda stiffness, twist_min: -stiffness * twist_min),
    ),
)
STICKING = np.array(
    [
        [565.0, 197.0, 50.0, torque, 20.0, 3.0, 0.05, wobble]
        for torque, wobble in ((500.0, 0.0), (2000.0, 0.0), (4000.0, 0.0), (1500.0, 400.0))
    ]
)


@lru_cache
def turned(lanes: int) -> Observed:
    return observe(TORSION, TURNING, STICKING, [0.0, 3.0], Simulation(5.0, 25.0, 1e-9), lanes, frame_rates=-3.0)


@pytest.mark.parametrize("run", range(len(STICKING)))
def test_a_torsional_string_measures_as_scipy_samples(run):
    """DOP853 at 1e-11, sampled 20 times a millisecond. Of the fraction of time the
    run's own error counts, as friction makes the speed creep through the level; the
    rest is 1e-6 of the speed (some 10 rad/s) or energy."""
    p = STICKING[run]

    def rates(t, y):
        friction = 2 / np.pi * np.arctan(p[4] * y[1]) * (p[3] / (1 + 3 * abs(y[1])) + 0.5 * p[3])
        return [y[1] - p[5], (p[7] * np.sin(1.7 * t) - p[2] * y[1] - p[1] * y[0] - friction) / p[0]]

    t = np.linspace(5.0, 30.0, 500_001)
    twist, speed = solve_ivp(
        rates, (0.0, 30.0), [0.0, 3.0], "DOP853", rtol=1e-11, atol=1e-11, max_step=0.02, dense_output=True
    ).sol(t)
    o = {name: values[run] for name, values in turned(1).found.items()}
    energies = 0.5 * p[0] * speed * speed
    for name, wanted in {
        "twist_max": -lowest(-twist),
        "twist_min": lowest(twist),
        "twist_mean": integral(t, twist) / 25.0,
        "speed_max": -lowest(-speed),
        "speed_min": lowest(speed),
        "speed_mean": integral(t, speed) / 25.0,
        "free": above(t, speed - p[6]) / 25.0,
        "energy_max": -lowest(-energies),
        "energy_mean": integral(t, energies) / 25.0,
        "stuck": 1.0 - above(t, speed - p[6]) / 25.0,
        "surface_torque_max": -p[1] * lowest(twist),
    }.items():
        assert o[name] == pytest.approx(wanted, abs=2e-6, rel=2e-6), name
    high = slips(speed, p[6], p[5])[-8:]
    assert len(high) >= 1
    found = turned(1).peaks["speed_peaks"][run]
    assert found[~np.isnan(found)] == pytest.approx(high, abs=2e-6)


@pytest.mark.parametrize("lanes", [8, 16])
def test_a_torsional_string_has_the_same_bits_in_any_lanes(lanes):
    assert turned(lanes).report.tobytes() == turned(1).report.tobytes()


def rippled(t, phase, s, p, o):
    return {"v": -10.0 * sincos(t)[1] - 1.5 * 81.0 * sincos(9.0 * t)[1]}


@pytest.mark.parametrize("smooth", [False, True])
@pytest.mark.parametrize(
    ("stuck", "slip", "until", "expected"),
    [
        # at its lowest x has small slips from -9 up to -7.9, on its way many maxima
        (-9.0, 0.0, 41.0, [11.5] * 6),
        (-9.0, 0.0, 39.0, [11.5] * 5),  # it has not come back to rest
        (-9.0, 0.0, 40.16, [11.5] * 6),  # it is falling through the level
        (-9.0, 12.0, 41.0, []),  # turns faster in none of its slips
        (-20.0, 0.0, 41.0, None),  # never sticks
    ],
)
def test_a_bit_that_sticks_has_one_peak_a_slip(stuck, slip, until, expected, smooth):
    """x = 10 cos t + 1.5 cos 9t from t = 1 on, whose greatest values are 11.5."""
    channel = Channel("x", "x", "v", "a", level="stuck")
    model = Model(rippled, Names(("x", "v"), ("a",), ("stuck", "slip")))

    def tops(**more):
        extremes = Extremes("x", "high", peaks="tops", smooth=smooth, **more)
        declaration = Declaration((channel,), (extremes,))
        simulation = Simulation(1.0, until - 1.0, 1e-10)
        o = observe(model, declaration, [stuck, slip], [11.5, 0.0], simulation, peaks=100)
        return o.peaks["tops"][0][~np.isnan(o.peaks["tops"][0])]

    every = tops()
    assert len(every) > 40
    assert every.min() < -5
    assert tops(slip="slip") == pytest.approx(every if expected is None else expected, abs=1e-7)


# A state of first order that follows a sine: x' = r (sin w t - x).
def lag(t, phase, s, p, o):
    # sin t by its own two states would be a pair; here a parabola drives it.
    return {"x": p.r * (t * t - s.x)}


def test_states_of_first_order_are_followed_by_a_cubic():
    """x' = r (t^2 - x) from x(0) = x0: x = t^2 - 2 t / r + 2 / r^2 + C exp(-r t), which
    falls and then rises."""
    names = Names(("x",), ("dx",), ("r",))
    declaration = Declaration(
        (Channel("x", "x", "dx", level=2.0),),
        (Extremes("x", greatest="high", least="low", peaks="tops"), TimeAbove("x", "share"), Mean("x", "mean")),
    )
    rate = np.linspace(1.0, 2.0, 11)
    o = observe(Model(lag, names, singles=1), declaration, rate[:, None], [3.0], Simulation(0.0, 3.0, 1e-11), 8)
    t = np.linspace(0.0, 3.0, 300_001)
    for k, r in enumerate(rate):
        x = t * t - 2.0 * t / r + 2.0 / r**2 + (3.0 - 2.0 / r**2) * np.exp(-r * t)
        for name, wanted in {
            "high": max(x[0], x[-1]),
            "low": lowest(x),
            "share": above(t, x - 2.0) / 3.0,
            "mean": integral(t, x) / 3.0,
        }.items():
            assert o.found[name][k] == pytest.approx(wanted, abs=1e-8), name
    assert np.isnan(o.peaks["tops"]).all()
    one = observe(Model(lag, names, singles=1), declaration, rate[:, None], [3.0], Simulation(0.0, 3.0, 1e-11), 1)
    assert one.report.tobytes() == o.report.tobytes()


# A body that is thrown up, or, with a negative weight, falls up: x'' = -g.
def throw(t, phase, s, p, o):
    return {"v": -p.g}


THROW = Model(throw, Names(("x", "v"), ("a",), ("g", "level")))
ABOVE_LEVEL = Declaration((Channel("x", "x", "v", "a", level="level"),), (TimeAbove("x", "share"),))


@pytest.mark.parametrize("curved", [True, False])
@pytest.mark.parametrize("weight", [2.0, -2.0])
def test_a_visit_inside_one_step_is_found(weight, curved):
    """x = g (t - t^2 / 2) in one step of 2 s: its top, g / 2 = 1, is above the level
    0.75 for 1 s, though both ends are below; turned over, it dips below -0.75 for as
    long. The second half of the window is a step of its own."""
    channel = Channel("x", "x", "v", "a" if curved else None, level=math.copysign(0.75, weight))
    declaration = Declaration(
        (channel,),
        (Extremes("x", greatest="high", least="low", peaks="tops"), TimeAbove("x", "share"), Mean("x", "mean")),
    )
    o = observe(THROW, declaration, [weight, 0.0], [0.0, weight], Simulation(0.0, 4.0, 1e-3), first_step=2.0)
    width = len(declaration.measured_per_half)
    first = dict(zip([what for what, _ in declaration.measured_per_half], o.report[0, :width], strict=True))
    assert first["above"] == pytest.approx(1.0, abs=1e-12)
    assert first["greatest" if weight > 0 else "least"] == pytest.approx(math.copysign(1.0, weight), abs=1e-13)
    assert first["integral"] == pytest.approx(weight * (2.0 - 4.0 / 3.0), abs=1e-13)
    assert o.found["high" if weight < 0 else "low"] == pytest.approx([-4.0 * weight], abs=1e-12)
    found = o.peaks["tops"][0]
    assert found[~np.isnan(found)] == pytest.approx([1.0] if weight > 0 else [])


@pytest.mark.parametrize(("level", "share"), [(1.0 + 1e-9, 0.0), (1.0 - 1e-6, 5e-4), (-3.0, 0.75), (-9.0, 1.0)])
def test_a_touch_is_told_from_a_visit(level, share):
    """x = 2 t - t^2 for 4 s: its top is 1, and it is above the level for 2 sqrt(1 -
    level), from 0 on at the least."""
    o = observe(THROW, ABOVE_LEVEL, [2.0, level], [0.0, 2.0], Simulation(0.0, 4.0, 1e-3), first_step=2.0)
    assert o.found["share"] == pytest.approx([share], abs=1e-9)


def test_a_run_that_starts_on_its_level_is_on_the_side_to_which_it_goes():
    up, down = observe(
        THROW,
        ABOVE_LEVEL,
        [[2.0, 0.0], [2.0, 0.0]],
        [[0.0, 5.0], [0.0, -1.0]],
        Simulation(0.0, 2.0, 1e-3),
        first_step=1.0,
    ).found["share"]
    assert up == pytest.approx(1.0, abs=1e-12)
    assert down == pytest.approx(0.0, abs=1e-12)


def test_the_halves_differ_where_a_motion_decays():
    """x = exp(-d t) (cos q t + d / q sin q t) from t = 2 pi to 22 pi; undamped, the
    halves, five periods each, agree."""
    settled = observe(SWING, SWINGING, [[1.0, 0.0], [1.0, 0.02]], [1.0, 0.0], Simulation(TWO_PI, 10.0 * TWO_PI, 1e-9))
    assert settled.found["half_difference"][0] == pytest.approx(0.0, abs=1e-6)
    d, q = 0.02, math.sqrt(1.0 - 0.02**2)
    lows, highs, shares = [], [], []
    for start in (TWO_PI, 6.0 * TWO_PI):
        t = np.linspace(start, start + 5.0 * TWO_PI, 200_001)
        x = np.exp(-d * t) * (np.cos(q * t) + d / q * np.sin(q * t))
        lows.append(lowest(x))
        highs.append(-lowest(-x))
        shares.append(above(t, x - 0.5) / (5.0 * TWO_PI))
    span = max(highs) - min(lows) + 0.01
    wanted = {"x_max": max(abs(np.diff(lows)[0]), abs(np.diff(highs)[0])) / span, "x_above": abs(np.diff(shares)[0])}
    for name, difference in wanted.items():
        assert difference > 0.05
        declaration = replace(
            SWINGING, features=(next(feature for n, feature in SWINGING.named_features if n == name),)
        )
        o = observe(SWING, declaration, [1.0, 0.02], [1.0, 0.0], Simulation(TWO_PI, 10.0 * TWO_PI, 1e-9))
        assert o.found["half_difference"] == pytest.approx([difference], abs=1e-6), name


def test_a_motion_at_rest_has_equal_halves_and_no_peaks():
    o = observe(SWING, SWINGING, [2.0, 0.0], [0.0, 0.0], Simulation(1.0, 5.0, 1e-6))
    assert o.found["half_difference"].tolist() == [0.0]
    assert np.isnan(o.peaks["x_peaks"]).all()
    assert o.found["x_above"].tolist() == [0.0]
    assert o.found["v_above"].tolist() == [1.0]


def test_without_extremes_and_fractions_nothing_says_how_settled_a_run_is():
    declaration = replace(SWINGING, features=(Mean("x", "x_mean"),))
    o = observe(SWING, declaration, [2.0, 0.1], [1.0, 0.0], Simulation(1.0, 5.0, 1e-6))
    assert np.isnan(o.found["half_difference"]).all()


def test_a_peak_stands_out_by_ten_tolerances():
    """rtol 1e-6, a natural scale of 1000: the margin is 0.01 and a little more. The
    rise from the least to the greatest value is twice the amplitude; four of the maxima
    after the start are left again before 4.6 periods are over."""
    channel = replace(SWINGING.channels[0], scale=1000.0)
    declaration = Declaration((channel,), (Extremes("x", greatest="high", peaks="tops"),))
    o = observe(
        SWING, declaration, [[1.0, 0.0]] * 2, [[4.9e-3, 0.0], [5.1e-3, 0.0]], Simulation(0.0, 4.6 * TWO_PI, 1e-6)
    )
    assert np.count_nonzero(~np.isnan(o.peaks["tops"]), axis=1).tolist() == [0, 4]


def test_the_ring_has_the_last_peaks_oldest_first():
    """Of a damped swing each maximum is smaller than the one before by the same
    factor."""
    many, few = (
        observe(SWING, SWINGING, [1.0, 0.01], [1.0, 0.0], Simulation(1.0, 9.6 * TWO_PI, 1e-10), peaks=n)
        for n in (20, 4)
    )
    tops = many.peaks["x_peaks"][0]
    tops = tops[~np.isnan(tops)]
    assert len(tops) == 9
    assert tops[1:] / tops[:-1] == pytest.approx(np.full(8, math.exp(-0.01 * TWO_PI / math.sqrt(1 - 1e-4))), rel=1e-7)
    assert few.peaks["x_peaks"][0].tolist() == tops[-4:].tolist()
    none = observe(SWING, SWINGING, [1.0, 0.01], [1.0, 0.0], Simulation(1.0, 9.6 * TWO_PI, 1e-10), peaks=0)
    assert none.peaks["x_peaks"].shape == (1, 0)
    assert none.found["x_max"].tobytes() == many.found["x_max"].tobytes()


# A wheel that rocks in the frame of a drive, twist' = speed - drive, and a state of
# first order that tells the time.
def rock(t, phase, s, p, o):
    return {"speed": -s.twist, "x": -0.1 * s.x}


ROCKING = Model(rock, Names(("twist", "speed", "x"), ("acceleration", "dx"), ("drive", "spacing")), singles=1)
ANGLE = Channel("angle", lambda twist, drive, phase, time: phase + drive * time + twist, "speed", "acceleration")


@pytest.mark.parametrize(("swing_of", "unique"), [(0.3, True), (2.0, False)])
def test_the_section_notes_all_states_at_multiples_of_the_angle(swing_of, unique):
    """twist = A sin t, x = exp(-t / 10), angle = 0.3 + t + A sin t: for A = 0.3 it only
    rises; for A = 2 it turns back, and the first time at each multiple of 0.5
    counts."""
    t = np.linspace(1.0, 30.0, 2_000_001)
    turned_by = 0.3 + t + swing_of * np.sin(t)
    highest = np.maximum.accumulate(turned_by)
    levels = 0.5 * np.arange(np.floor(turned_by[0] / 0.5) + 1, np.floor(highest[-1] / 0.5) + 1)
    at = t[np.searchsorted(highest, levels)]  # to 1.5e-5 s
    assert unique == bool((np.diff(turned_by) > 0).all())
    wanted = np.column_stack([swing_of * np.sin(at), 1.0 + swing_of * np.cos(at), np.exp(-0.1 * at), levels])[-20:]
    one, eight = (rocked(swing_of, [0.5] * 3, lanes) for lanes in (1, 8))
    assert one.report.tobytes() == eight.report.tobytes()
    for returns in one.returns:
        assert returns == pytest.approx(wanted, abs=1e-4)
        # To their own precision: the angle is 0.3 + t + twist, and x tells the time.
        assert returns[:, 0] - 10.0 * np.log(returns[:, 2]) + 0.3 == pytest.approx(returns[:, 3], abs=1e-7)
        assert (returns[:, 1] - 1.0) ** 2 + returns[:, 0] ** 2 == pytest.approx(np.full(20, swing_of**2), abs=1e-6)


@pytest.mark.parametrize("count", [2, 6, 8, 10])
def test_the_section_notes_any_number_of_states_of_first_order(count):
    """x_k = exp(-t (k + 1) / 10), with twist = 0 at the returns of a wheel that turns with
    its drive, t = 0.5, 1, ..."""
    names = tuple(f"x_{k}" for k in range(count))

    def decay(t, phase, s, p, o):
        return {"speed": -s.twist, **{name: -0.1 * (k + 1) * getattr(s, name) for k, name in enumerate(names)}}

    rates = tuple(f"dx_{k}" for k in range(count))
    many = Model(decay, Names(("twist", "speed", *names), ("acceleration", *rates), ("drive", "spacing")), count)
    start = [0.0, 1.0, *[1.0] * count, 0.0]
    found = observe(
        many,
        Declaration((ANGLE,), (), section=Section("angle", "spacing")),
        [[1.0, 0.5]],
        start,
        Simulation(0.0, 3.2, 1e-10),
        1,
        returns=6,
        frame_rates=[-1.0, *[0.0] * count],
    ).returns[0]
    times = 0.5 * np.arange(1, 7)
    assert found[:, 2:-1] == pytest.approx(np.exp(-0.1 * np.outer(times, np.arange(1, count + 1))), rel=1e-7)


def test_a_spacing_of_nonsense_gives_no_returns_and_an_end():
    assert np.isnan(rocked(0.3, [0.0, -0.5, np.nan], 8).returns).all()
    rocked(0.3, [1e-30] * 3, 8)  # finer than the angles that floats can tell apart


def rocked(swing_of: float, spacings: Any, lanes: int) -> Observed:
    """From 1 to 30 s behind a drive at 1 rad/s, whose angle is 0.3 at first."""
    declaration = Declaration((ANGLE,), (), section=Section("angle", "spacing"))
    return observe(
        ROCKING,
        declaration,
        [[1.0, spacing] for spacing in spacings],
        [0.0, 1.0 + swing_of, 1.0, 0.3],
        Simulation(1.0, 29.0, 1e-10),
        lanes,
        returns=20,
        frame_rates=[-1.0, 0.0],
    )


# Auxiliary outputs are the right-hand side's to write: here twice the position.
WITH_AUX = Names(("x", "v"), ("a",), (), ("doubled",))
AUX_ROWS = Layout(2, 1, 0, 0)


@pytest.mark.parametrize("lanes", [1, 8])
def test_outputs_pass_on_what_the_model_knows_at_the_end_of_a_step(lanes):
    declaration = Declaration(
        (Channel("twice", "twice", "rate", scale=2.0),),
        (Extremes("twice", greatest="high", least="low"), Mean("twice", "mean")),
        Outputs(("twice", "rate"), lambda doubled, v: (doubled, 2.0 * v)),
    )
    rows = replace(AUX_ROWS, observed=observed_rows(declaration))
    W, stage_, slope_, aux_ = (lanes, lanes * rows.stage, lanes * rows.acceleration, lanes * rows.aux_now)

    @compiled(BUFFER)
    def doubling(b):
        for i in packed(W):
            b[slope_ + i] = -b[stage_ + i]
            b[aux_ + i] = 2.0 * b[stage_ + i]

    simulation = Simulation(0.5, 10.0 * TWO_PI, 1e-9)
    store, width = new_store(lanes, WITH_AUX, declaration), outcome_width(WITH_AUX, declaration)
    batch = Batch(lanes, 1, rows, store, width, simulation)
    batch.add_many(
        np.arange(1),
        Runs(
            np.zeros((1, 0)),
            np.ones((1, 2)),
            np.zeros((1, 1)),
            np.zeros(1),
            np.full(1, 1e-3),
            np.array([[1.0, 0.0, 0.0]]),
        ),
    )
    done = batch.advance(Compiled(doubling, *make_observer(lanes, rows, WITH_AUX, declaration)), 60.0, True)
    found = measured(WITH_AUX, declaration, done.outcome, np.zeros((1, 0)), np.ones((1, 2)), simulation.observe)
    assert found["high"] == pytest.approx([2.0], abs=1e-6)
    assert found["low"] == pytest.approx([-2.0], abs=1e-6)
    assert found["mean"] == pytest.approx([0.0], abs=1e-6)


def test_equal_texts_of_other_functions_are_other_observers():
    """Functions made by a factory have one name, one file and one code; only what they
    were made with differs."""
    for factor in (2.0, 3.0):
        declaration = Declaration(
            (Channel("scaled", times(factor), slope_times(factor), scale=1.0),), (Extremes("scaled", greatest="high"),)
        )
        o = observe(SWING, declaration, [1.0, 0.0], [1.0, 0.0], Simulation(0.0, TWO_PI, 1e-9))
        assert o.found["high"] == pytest.approx([factor], abs=1e-7)


def times(factor: float) -> Any:
    return lambda x: factor * x


def slope_times(factor: float) -> Any:
    return lambda v: factor * v


def wrong(_: str, channels: Any = None, features: Any = (), **more: Any) -> Declaration:
    return Declaration(channels or (Channel("x", "x", "v", "a"),), features, **more)


@pytest.mark.parametrize(
    ("declaration", "facts"),
    [
        (
            wrong("row", (Channel("x", "x", "vv", "a"),)),
            ("channel 'x': slope", "'vv'", "allowed: a, d, phase, time, v,"),
        ),
        (wrong("argument", (Channel("x", lambda y: y, "v"),)), ("channel 'x': value", "'y'", "allowed: a, d,")),
        (wrong("aux", (Channel("x", "x", "helper"),)), ("channel 'x': slope", "'helper'", "Outputs")),
        (wrong("frame", (Channel("x", "x", "v", frame="v"),)), ("channel 'x': frame", "'v'", "allowed: d, w")),
        (wrong("level", (Channel("x", "x", "v", level="x"),)), ("channel 'x': level", "'x'", "allowed: d, w")),
        (wrong("twice", (Channel("x", "x", "v"), Channel("x", "v", "a"))), ("channel: 'x'", "twice")),
        (wrong("feature", features=(Mean("y", "m"),)), ("Mean", "'y'", "allowed: x")),
        (wrong("names", features=(Mean("x", "m"), TimeAbove("x", "m"))), ("'m'", "twice")),
        (wrong("taken", features=(Mean("x", "half_difference"),)), ("'half_difference'", "twice")),
        (wrong("parameter's", features=(Mean("x", "w"),)), ("'w'", "twice")),
        (
            wrong("infinite", (Channel("x", "x", "v", level=math.inf),)),
            ("channel 'x': level", "inf", "a finite number"),
        ),
        (wrong("no number", (Channel("x", ("x",), "v"),)), ("channel 'x': value", "('x',)", "the name of a row")),
        (wrong("no level", features=(TimeAbove("x", "t"),)), ("TimeAbove 't'", "'x' has no level", "a number")),
        (
            wrong("no level to stick at", features=(Extremes("x", peaks="tops", slip=1.0),)),
            ("Extremes with slip", "'x' has no level", "a number"),
        ),
        (
            wrong("scale", (Channel("x", lambda x: x, "v"),), (Extremes("x", "high"),)),
            ("channel 'x'", "scale", "a state"),
        ),
        (wrong("rate", (Channel("v", "v", "a", rate_of="y"),)), ("channel 'v': rate_of", "'y'", "allowed: v")),
        (
            wrong("rate of a cubic", (Channel("x", "x", "v"), Channel("v", "v", "a", rate_of="x"))),
            ("channel 'v'", "'x'", "must have a curvature"),
        ),
        (
            wrong("rate of another", (Channel("x", "x", "v", "a"), Channel("y", "x", "a", rate_of="x"))),
            ("channel 'y'", "rate of 'x'", "slope and curvature"),
        ),
        (
            wrong("derived", features=(Derived("q", lambda m: m), Mean("x", "m2"))),
            ("Derived 'q'", "'m'", "allowed: d, m2, w"),
        ),
        (wrong("spacing", section=Section("x", 0.0)), ("section: spacing", "0.0", "positive")),
        (wrong("section", section=Section("y", 1.0)), ("section: channel", "'y'", "allowed: x")),
        (wrong("outputs", outputs=Outputs(("o",), lambda q: (q,))), ("outputs", "'q'", "allowed: a, d, helper, phase")),
        (wrong("output named as a state", outputs=Outputs(("x",), lambda v: (v,))), ("row: 'x'", "twice")),
    ],
)
def test_a_wrong_declaration_is_told(declaration, facts):
    names = Names(("x", "v"), ("a",), ("w", "d"), ("helper",))
    with pytest.raises(ValueError, match=re.escape(facts[0])) as caught:
        check(names, declaration)
    for fact in facts[1:]:
        assert fact in str(caught.value)


def test_a_layout_that_does_not_fit_is_told():
    rows = SWING.rows(SWINGING)
    with pytest.raises(ValueError, match=r"names.parameters: found 2 names for 3 rows"):
        make_observer(1, replace(rows, parameters=3), SWING.names, SWINGING)
    least = observed_rows(SWINGING)
    with pytest.raises(ValueError, match=rf"rows.observed: found 2; allowed: at least {least}"):
        make_observer(1, replace(rows, observed=2), SWING.names, SWINGING)


def test_functions_that_cannot_be_compiled_are_told():
    declaration = replace(SWINGING, outputs=Outputs(("one", "two"), energy))
    observer, _ = make_observer(1, SWING.rows(declaration), SWING.names, declaration)
    with pytest.raises(
        LanguageError, match=r"declared.py, .*: compute: .*: one value has no length; allowed: .* a tuple"
    ):
        assert observer.address

    declaration = replace(SWINGING, outputs=Outputs(("one", "two"), lambda x: (x, x, x)))
    observer, _ = make_observer(1, SWING.rows(declaration), SWING.names, declaration)
    with pytest.raises(LanguageError, match="another number of values than the outputs have names"):
        assert observer.address


def everything(k: int) -> tuple[Any, ...]:
    """All features of channel k."""
    return (
        Extremes(f"x{k}", f"high{k}", f"low{k}", f"peaks{k}"),
        TimeAbove(f"x{k}", f"above{k}"),
        Mean(f"x{k}", f"mean{k}"),
    )


# More channels than the compiler packs in one loop.
MANY = Declaration(
    tuple(Channel(f"x{k}", "x", "v", "a", level=0.1 * k) for k in range(12)),
    tuple(feature for k in range(12) for feature in everything(k)),
)


@pytest.mark.parametrize("declaration", [SWINGING, TURNING, MANY], ids=["swinging", "turning", "many"])
def test_what_happens_in_every_step_works_on_all_lanes(declaration):
    model = TORSION if declaration is TURNING else SWING
    rows = with_step(STEPPERS["tsitouras"], model.rows(declaration))
    text = text_of(make_observer(8, rows, model.names, declaration)[0])
    # What attends to the events of one lane is a function of its own.
    packed, single = packed_and_single(text.partition("i64 @entry(")[2])
    assert packed > 30
    assert single == 0
