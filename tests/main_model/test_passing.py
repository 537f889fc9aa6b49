"""From which rate on the speed, raised off bottom, passes where the collar reaches the wall, as the
bit lags behind the drive; against runs."""

import math

import pytest

import nsdrill
from nsdrill.app.check import lasting_motions
from nsdrill.study import parse_study

RPM = math.pi / 30
WELL = """
drillstring:
  torsional_damping: 13.94 N*m*s/rad
  collar: {outer_diameter: 6.5 in, inner_diameter: 2.8125 in, length: 540 ft, span: 60 ft}
  pipe: {outer_diameter: 5 in, inner_diameter: 4.276 in}
  eccentricity: 2.85 mm
mud: {density: 11 ppg, added_mass: clearance}
well: {diameter: 8.5 in}
bit: {lobes: 1}
operation: {depth: 12000 ft, wob: 15 klbf, rotary_speed: 120 rpm}
"""


def off_bottom(*changes: str) -> dict:
    """In rpm and rpm/s."""
    (wall,) = (one for one in lasting_motions(parse_study(WELL, overrides=changes)) if one["name"] == "wall_speed")
    return {name: None if value is None else value / RPM for name, value in wall["off_bottom"].items()}


def greatest_radius(rate: float, *changes: str) -> float:
    """Over the gap, of a run whose speed is raised from rest at a rate in rpm/s."""
    end = 79.5 / rate
    ramp = f"operation.rotary_speed={{ramp: [[0 s, 0.5 rpm], [{end} s, 80 rpm], [{end + 10} s, 80 rpm]]}}"
    trace = nsdrill.simulate(parse_study(WELL, overrides=[*changes, "operation.wob=0 N", ramp]), sample=0.05)
    return float(trace["radius"].values.max()) / 0.0254


def test_a_rate_at_which_the_bit_hardly_speeds_up_at_the_wall_is_none_from_which_on_it_passes():
    """Twice the estimate at a constant rate is 8.8 rpm/s; at 9.2 rpm/s the collar stays on the wall. The
    torsional period is 5.4 s, and the bit hardly speeds up near 9.2 rpm/s * 5.4 s = 50 rpm."""
    found = off_bottom()
    assert 2 * found["passing_rate"] == pytest.approx(8.76, abs=0.05)
    assert greatest_radius(9.2) > 1.0
    assert 9.4 < found["sure_rate"] < 13.0
    assert [greatest_radius(times * found["sure_rate"]) < 1.0 for times in (1.0, 1.05, 1.2, 1.5)] == [True] * 4


@pytest.mark.parametrize(
    "changes",
    [
        ("drillstring.eccentricity=1.5 mm",),
        ("drillstring.eccentricity=2 mm", "operation.depth=3000 ft"),
        ("drillstring.eccentricity=2 mm", "mud.swirl=0.3"),
        ("drillstring.eccentricity=2 mm", "drive.kind=soft_torque"),
        ("drillstring.eccentricity=1.5 mm", "well.inclination=2 deg"),
    ],
)
def test_faster_ones_pass_too(changes):
    found = off_bottom(*changes)
    assert found["sure_rate"] >= 2 * found["passing_rate"] * (1 - 1e-9)
    assert all(greatest_radius(times * found["sure_rate"], *changes) < 1.0 for times in (1.0, 1.5))


SWINGS = ("drillstring.eccentricity=2 mm", "operation.depth=3000 ft")


def stopped(above: float, rate: float, start: float, *changes: str) -> tuple[float, float]:
    """Over the gap how far the collar goes at last, and the least speed of the bit, in rpm, after a stop so far above
    the wall's speeds, of a rise that begins at ``start``; all in rpm."""
    end = off_bottom(*changes)["to"] + above
    up = (end - start) / rate
    ramp = f"operation.rotary_speed={{ramp: [[0 s, {start} rpm], [{up} s, {end} rpm], [{up + 40} s, {end} rpm]]}}"
    trace = nsdrill.simulate(parse_study(WELL, overrides=[*changes, "operation.wob=0 N", ramp]), sample=0.05)
    time, radius, speed = (trace[name].values for name in ("time", "radius", "bit_speed"))
    return float(radius[time > time[-1] - 10.0].max()) / 0.0254, float(speed[time > up].min()) / RPM


@pytest.mark.parametrize("changes", [(), ("drive.kind=soft_torque",), SWINGS])
def test_after_a_stop_the_bit_swings_below_its_speed_as_is_told(changes):
    """Far above the wall, the worst of several phases; undamped, 2/w per rate."""
    changes = ("drillstring.eccentricity=1 mm", *changes)
    swing, rate = off_bottom(*changes)["swing"] * RPM, 8.0
    end = off_bottom(*changes)["to"] + 60.0
    least = min(stopped(60.0, rate, start, *changes)[1] for start in (5.0, 15.0, 25.0, 35.0))
    assert 0.7 * swing * rate < end - least < 1.05 * swing * rate


def test_a_rise_that_stops_just_above_the_wall_leaves_the_collar_on_it_and_one_that_stops_clear_does_not():
    """The rate passes, from all starts, where the rise goes on: 4.6 rpm/s."""
    rate, swing = off_bottom(*SWINGS)["sure_rate"] * 1.001, off_bottom(*SWINGS)["swing"] * RPM
    starts = (0.5, 8.0, 16.0, 22.0)
    assert greatest_radius(rate, *SWINGS) < 1.0
    assert max(stopped(1.0, rate, start, *SWINGS)[0] for start in starts) > 1.0
    assert max(stopped(10.0 + swing * rate, rate, start, *SWINGS)[0] for start in starts) < 0.8


def test_where_no_rate_passes_none_is_told():
    """12 mm of 25 mm, and a collar that the friction of its stabilisers drives to the wall at any rate."""
    assert off_bottom("drillstring.eccentricity=12 mm")["sure_rate"] is None
    changes = ("drillstring.eccentricity=2 mm", "stabilizer.clearance=2 mm")
    assert off_bottom(*changes)["sure_rate"] is None
    assert greatest_radius(19.0, *changes) > 1.0


def test_without_imbalance_any_rate_passes():
    assert off_bottom("drillstring.eccentricity=0 mm", "mud.drag=0")["sure_rate"] == 0.0


def test_a_string_twists_where_the_study_freezes_that():
    assert off_bottom("modes.torsional=frozen")["sure_rate"] == pytest.approx(off_bottom()["sure_rate"])


def test_of_several_strings_the_rate_is_that_of_all():
    """By depth the torsional period, and so the speed at which the bit hardly speeds up, is another one."""
    eccentricity = "drillstring.eccentricity=2 mm"
    depths = ("9000 ft", "12000 ft")
    alone = [off_bottom(eccentricity, f"operation.depth={one}")["sure_rate"] for one in depths]
    both = off_bottom(eccentricity, f"sweep={{depth: [{', '.join(depths)}]}}")["sure_rate"]
    assert max(alone) * (1 - 1e-9) <= both <= 1.04 * max(alone)
