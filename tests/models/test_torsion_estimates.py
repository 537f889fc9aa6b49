"""The estimates of stick-slip that ``check`` gives, against integrated runs of the
torsional model over a range of speeds, weights and depths."""

import math

import numpy as np

import nsdrill
from nsdrill.models.torsion_checks import drilling_at

# Without damping and with a friction that falls at once the estimate is exact.
EXACT = "drillstring: {torsional_damping: 0 N*m*s/rad}\nbit: {friction: {smoothing: 20000 s/rad, decay: 100 s/rad}}\n"
RANGE = "sweep: {depth: [1500 m, 3000 m, 5000 m], wob: [60 kN, 120 kN], rotary_speed: [2 rad/s, 3 rad/s, 5 rad/s]}\n"
WINDOW = "initial: {bit_speed: 0 rad/s}\nsimulation: {transient: 60 s, observe: 150 s}\n"


def compared(more):
    """(period, greatest speed, part of the time stuck) of runs over those estimated, of
    the points that stick, the last one less; and the runs' periods over the free one."""
    text = f"model: torsion\n{more}{RANGE}{WINDOW}"
    found, study = nsdrill.run(text).squeeze(), nsdrill.load_study(text)
    rows = []
    for depth in found.depth.values:
        for wob in found.wob.values:
            for speed in found.rotary_speed.values:
                one = found.sel(depth=depth, wob=wob, rotary_speed=speed)
                drilling = drilling_at(
                    study.parameters, study.operation.__class__(float(depth), float(wob), float(speed))
                )
                estimates = drilling.estimates
                if float(one.stuck_fraction) > 0.02 and estimates is not None:
                    rows.append(
                        (
                            float(one.stick_slip_period) / estimates.period,
                            float(one.bit_speed_max) / estimates.peak,
                            float(one.stuck_fraction) - estimates.stuck,
                            float(one.stick_slip_period) * drilling.frequency / (2 * math.pi),
                        )
                    )
    assert len(rows) >= 9
    return np.array(rows).T


def test_the_estimates_are_exact_where_they_should_be():
    """To 2 %: the bit counts as stuck below 5 rpm, and is smoothed."""
    period, peak, stuck, free = compared(EXACT)
    assert np.abs(period - 1).max() < 0.02
    assert np.abs(peak - 1).max() < 0.02
    assert np.abs(stuck).max() < 0.06
    assert (free > 1).all()


def test_with_damping_and_a_slow_fall_they_are_near():
    """The default string. Found: period 0.96 to 1.03 and greatest speed 0.94 to 1.04
    times the estimates, part of the time 0.02 below to 0.08 above."""
    period, peak, stuck, free = compared("")
    assert 0.94 < period.min() <= period.max() < 1.05
    assert 0.92 < peak.min() <= peak.max() < 1.06
    assert np.abs(stuck).max() < 0.09
    assert (free > 1).all()


def test_check_tells_them():
    told = nsdrill.check("model: torsion\noperation: {depth: 3000 m, wob: 60 kN, rotary_speed: 2.5 rad/s}").figures
    for name in ("stick_slip_period", "stick_slip_peak", "stick_slip_stuck", "free_period"):
        assert told[name].value > 0
