"""What needs no integration: buckling, standing waves, lateral modes, drives; against
closed forms, other discretisations and values computed beforehand by other code."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigh_tridiagonal

from nsdrill.models import motor
from nsdrill.models.christoforou_yigit import table
from nsdrill.models.christoforou_yigit.charts import (
    CELLS,
    critical_speeds,
    drive_card,
    drive_tuning,
    slopes_held_by_soft_torque,
)
from nsdrill.models.christoforou_yigit.coefficients import derive
from nsdrill.models.christoforou_yigit.derived_quantities import derived_quantities
from nsdrill.models.christoforou_yigit.drives import gains, impedance
from nsdrill.models.christoforou_yigit.further_quantities import (
    axial_waves,
    collar_tube,
    further_quantities,
    half_wave,
    lateral_frequencies,
    pipe_tube,
    sinusoidal_load,
    torsional_waves,
    wall_inclination,
)
from nsdrill.models.christoforou_yigit.parameters import Collar, Drive, Parameters
from nsdrill.models.christoforou_yigit.table import drilling_at
from nsdrill.models.drive_laws import LAWS, growing, reflection
from nsdrill.models.numbers import HELIX
from nsdrill.models.operation import Operation
from nsdrill.models.sections import Pipe

STATIC = replace(Parameters(), drillstring=replace(Parameters().drillstring, lateral_softening="static"))
HEAVY = Operation(5000.0, 66.72e3, 3.0)


def driven(**keys: object) -> Parameters:
    return replace(Parameters(), drive=Drive(**keys))


# Buckling


def test_buckling_on_the_low_side():
    """Collars and 5 in pipe at 15, 30, 60, 90 degrees, in kN; computed beforehand."""
    collar, pipe = collar_tube(Parameters()), pipe_tube(Parameters(), 5000.0)
    assert (collar.weight, pipe.weight, pipe.bending) == pytest.approx((2271.87, 212.02, 1.2478e6), rel=2e-5)
    angles = np.radians([15.0, 30.0, 60.0, 90.0])
    collar_loads, pipe_loads = ([sinusoidal_load(tube, angle) / 1e3 for angle in angles] for tube in (collar, pipe))
    assert collar_loads == pytest.approx([926.4, 1287.6, 1694.6, 1820.9], abs=0.06)
    assert pipe_loads == pytest.approx([46.4, 64.6, 85.0, 91.3], abs=0.06)
    assert HELIX * pipe_loads[-1] == pytest.approx(129.1, abs=0.06)
    assert half_wave(collar, math.pi / 2) == pytest.approx(17.36, abs=6e-3)
    assert half_wave(pipe, math.pi / 2) == pytest.approx(16.43, abs=6e-3)
    assert half_wave(pipe, 0.0) is None
    wide = replace(pipe, clearance=-0.1)
    assert math.isnan(sinusoidal_load(wide, 1.0))
    assert half_wave(wide, 1.0) is None
    floating = replace(pipe, weight=-1.0)
    assert sinusoidal_load(floating, 1.0) == 0.0
    assert half_wave(floating, 1.0) is None


def test_the_half_wave_takes_the_least_load():
    """The sinusoid of half wave L on an elastic floor w sin(alpha)/c needs E I (pi/L)^2
    + (w/c) (L/pi)^2."""
    pipe = pipe_tube(Parameters(), 5000.0)
    length = half_wave(pipe, math.pi / 2)
    assert length is not None

    def load(half):
        q = math.pi / half
        return pipe.bending * q * q + pipe.weight / pipe.clearance / (q * q)

    assert load(length) == pytest.approx(sinusoidal_load(pipe, math.pi / 2), rel=1e-12)
    assert min(load(0.99 * length), load(1.01 * length)) > load(length)


# Waves


def test_standing_waves_known_beforehand():
    p = Parameters()
    assert torsional_waves(p, 5000.0, 4) == pytest.approx([0.5862, 2.284, 4.276, 6.323], rel=2e-4)
    assert axial_waves(p, 5000.0, 4) == pytest.approx([1.196, 3.970, 7.115, 10.389], rel=5e-4)
    assert torsional_waves(p, 2000.0, 2) == pytest.approx([1.053, 5.766], rel=5e-4)
    assert axial_waves(p, 2000.0, 2) == pytest.approx([2.314, 9.696], rel=2e-4)


def test_a_uniform_string_has_the_frequencies_of_a_rod():
    pipe, collar = Pipe(0.127, 0.1), Collar(0.127, 0.1, length=200.0)
    string = replace(Parameters().drillstring, pipe=pipe, collar=collar)
    p = replace(Parameters(), drillstring=string)
    steel = string.material
    number = np.arange(1, 6)
    c = math.sqrt(steel.shear_modulus / steel.density)
    assert torsional_waves(p, 3000.0, 5) == pytest.approx((number - 0.5) * math.pi * c / 3000.0, rel=1e-10)
    c = math.sqrt(steel.young_modulus / steel.density)
    stiff = replace(p, bit=replace(p.bit, rock_stiffness=1e13))
    assert axial_waves(stiff, 3000.0, 5, on_rock=True) == pytest.approx(number * math.pi * c / 3000.0, rel=1e-4)


@pytest.mark.parametrize("depth", [210.0, 700.0, 5000.0, 9000.0])
def test_no_standing_wave_is_missed(depth):
    """The frequencies are all sign changes of z_p cos cos - z_c sin sin."""
    p = Parameters()
    collar, pipe = collar_tube(p), pipe_tube(p, depth)
    steel = p.drillstring.material
    c = math.sqrt(steel.shear_modulus / steel.density)
    found = torsional_waves(p, depth, 8)

    def closed(w):
        a, b = w * pipe.length / c, w * collar.length / c
        return pipe.torsional * np.cos(a) * np.cos(b) - collar.torsional * np.sin(a) * np.sin(b)

    w = np.linspace(0.0, found[-1] * (1 + 1e-6), 200_001)
    changes = np.flatnonzero(np.diff(np.sign(closed(w))))
    assert len(changes) == 8
    assert found == pytest.approx(w[changes], abs=w[1] * 1.01)
    assert np.abs(closed(found)) == pytest.approx(np.zeros(8), abs=1e-8 * collar.torsional)


def test_axial_waves_on_the_rock_are_those_of_a_chain_of_masses():
    """5000 m in 2500 elements of 2 m, on the spring of the rock; second order, so to
    1e-3 for the first modes."""
    p, n, step = Parameters(), 2500, 2.0
    collar, pipe = p.drillstring.collar, p.drillstring.pipe
    steel = p.drillstring.material

    def area(part):
        return math.pi / 4 * (part.outer_diameter**2 - part.inner_diameter**2)

    areas = np.where(np.arange(n) * step < 4800.0, area(pipe), area(collar))
    # nodes below the top
    mass = steel.density * step * np.append(0.5 * (areas[1:] + areas[:-1]), 0.5 * areas[-1])
    spring = steel.young_modulus * areas / step
    diagonal = spring + np.append(spring[1:], p.bit.rock_stiffness)
    root = np.sqrt(mass)
    squares = eigh_tridiagonal(
        diagonal / mass, -spring[1:] / (root[1:] * root[:-1]), eigvals_only=True, select="i", select_range=(0, 5)
    )
    assert axial_waves(p, 5000.0, 6, on_rock=True) == pytest.approx(np.sqrt(squares), rel=1e-3)


# Lateral motion


def test_lateral_frequencies_of_higher_modes():
    """66.72 kN with static softening, with the mass of mud and without; computed
    beforehand."""
    k = derive(STATIC, *(5000.0, 66.72e3, 3.0))
    assert lateral_frequencies(STATIC, HEAVY, k, k.m_l) == pytest.approx([6.323, 26.27, 59.51], rel=2e-4)
    assert lateral_frequencies(STATIC, HEAVY, k, k.m_c) == pytest.approx([7.453, 30.97, 70.15], rel=1e-4)
    # Each half wave of n is a span of its own of 1/n of the length, with its own load
    # of Euler.
    buckled = Operation(5000.0, 5.0 * k.buckling_load, 3.0)
    found = lateral_frequencies(STATIC, buckled, derive(STATIC, 5000.0, buckled.wob, 3.0), k.m_l)
    assert np.isnan(found[:2]).all()
    assert found[2] > 0.0


def test_where_the_collar_lies_down():
    """24.8 degrees at 66.72 kN, 27.6 without WOB."""
    k = derive(STATIC, 5000.0, 66.72e3, 3.0)
    found = [wall_inclination(STATIC, Operation(5000.0, wob, 3.0), k) for wob in (66.72e3, 0.0)]
    assert np.degrees(np.array(found, float)) == pytest.approx([24.8, 27.6], abs=0.05)
    short = replace(STATIC, drillstring=replace(STATIC.drillstring, collar=Collar(span=8.0)))
    k = derive(short, 5000.0, 66.72e3, 3.0)
    assert wall_inclination(short, HEAVY, k) is None


def test_further_figures_are_all_there_and_finite():
    found = further_quantities(Parameters(), HEAVY)
    assert {"pipe_helical", "collar_half_wave", "lateral_3", "torsional_wave_4"} <= set(found)
    assert all(f.further and f.value is not None and math.isfinite(f.value) for f in found.values())
    assert not set(found) & set(derived_quantities(Parameters(), HEAVY))


# Drives


@pytest.mark.parametrize(
    ("keys", "share"),
    [
        ({"kind": "stiff"}, 0.988),
        ({"kind": "soft_torque", "matching": 1.0}, 0.0),
        ({"kind": "soft_torque"}, 0.600),
        ({"kind": "equal_damping"}, 0.672),
        ({"kind": "z_torque"}, 0.629),
        ({"kind": "z_torque", "a": 1.0}, 0.202),
    ],
)
def test_share_of_a_wave_that_drives_throw_back(keys, share):
    """At the torsional frequency, 5000 m; computed beforehand."""
    found = derived_quantities(driven(**keys), HEAVY)["drive_reflection"].value
    assert found == pytest.approx(share, abs=6e-4)


def test_a_drive_that_feels_the_bit_is_no_impedance():
    assert derived_quantities(driven(kind="lqr"), HEAVY)["drive_reflection"].value is None
    card = drive_card(driven(kind="lqr"), HEAVY)
    assert "lqr" not in card.reflected
    assert card.held["lqr"] == pytest.approx(193.3, abs=0.06)


def test_reflection_is_that_of_a_wave_at_a_boundary():
    """Speeds and torques of the wave and of its echo meet the drive's: z (v - R v) = Z
    (v + R v)."""
    p = driven(kind="pi", inertia=1500.0, stiffness=900.0, damping=1500.0)
    law, z, w = gains(p, derive(p, 5000.0, 22e3, 3.0)), float(impedance(p)), 0.8
    back = reflection(law, z, w)
    drive = 1500.0 + 1j * (w * 1500.0 - 900.0 / w)
    assert z * (1 - back) == pytest.approx(drive * (1 + back), rel=1e-12)
    assert abs(reflection(law, z, 1e-6)) == pytest.approx(1.0)


def test_drive_card():
    card = drive_card(driven(kind="soft_torque"), HEAVY)
    assert set(card.held) == {"ideal", "lqr", *LAWS} - {"pi"}  # whose gains are the study's own
    assert card.own == "soft_torque"
    assert card.held["soft_torque"] == pytest.approx(136.4, abs=0.06)
    assert (card.reflected["ideal"] == 1.0).all()
    assert all(((share >= 0.0) & (share <= 1.0)).all() for share in card.reflected.values())
    assert "pi" in drive_card(driven(kind="pi"), HEAVY).reflected


def test_tuning_of_a_soft_torque_drive():
    """Columns: gain in impedances; rows: frequency over the string's. Computed
    beforehand by other code."""
    p = driven(kind="soft_torque")
    k = derive(p, 5000.0, 66.72e3, 3.0)
    w = math.sqrt(k.k_t / k.J)
    known = {
        0.7: (77.8, 111.1, 112.4, 108.3),
        0.85: (97.1, 149.8, 136.3, 121.8),
        1.0: (86.8, 139.7, 136.4, 123.2),
        1.2: (64.9, 88.2, 94.0, 95.8),
    }
    held = slopes_held_by_soft_torque(p, HEAVY, np.array([1.0, 3.0, 4.0, 5.0]), w * np.array(list(known)))
    assert held == pytest.approx(np.array(list(known.values())), abs=0.06)
    for compensated, matching, ratio, best in ((1900.0, 2.0, 0.7, 250.0), (2600.0, 1.0, 0.5, 291.0)):
        soft = driven(kind="soft_torque", compensated_inertia=compensated)
        held = slopes_held_by_soft_torque(soft, HEAVY, np.array([matching]), np.array([ratio * w]))
        assert held[0, 0] == pytest.approx(best, abs=0.5)


def test_the_best_tuning_is_the_best_of_the_map():
    p = driven(kind="soft_torque", matching=3.0, frequency=0.08)
    chart = drive_tuning(p, HEAVY)
    matching, frequency, held = chart.best
    assert chart.held.shape == (CELLS, CELLS)
    assert held >= chart.held.max()
    assert chart.own == (3.0, pytest.approx(2 * math.pi * 0.08))
    around = slopes_held_by_soft_torque(p, HEAVY, matching * np.array([0.9, 1.1]), frequency * np.array([0.95, 1.05]))
    assert held > around.max()
    # The same drive, asked for by its keys, holds what the map says.
    asked = driven(kind="soft_torque", matching=matching, frequency=frequency / (2 * math.pi))
    assert derived_quantities(asked, HEAVY)["slope_held"].value == pytest.approx(held, rel=1e-6)


def test_figures_solve_for_the_gains_once(monkeypatch):
    calls = []
    solve = motor.regulated
    monkeypatch.setattr(motor, "regulated", lambda *numbers: calls.append(numbers) or solve(*numbers))
    table._drilling.cache_clear()  # another test may have asked for this string
    motor._feedback.cache_clear()
    derived_quantities(driven(kind="lqr"), HEAVY)
    assert len(calls) == 1


def test_a_drive_that_swings_the_string_by_itself():
    for kind in ("ideal", "stiff", "soft_torque", "lqr"):
        p = driven(kind=kind)
        assert growing(drilling_at(p, HEAVY).matrix) is None
    p = driven(kind="pi", stiffness=900.0, damping=1500.0, speed_gain=-3000.0)
    matrix = drilling_at(p, HEAVY).matrix
    root = growing(matrix)
    assert root is not None
    assert root.real > 0.0
    # It is a root of the characteristic polynomial.
    assert abs(np.polyval(np.poly(matrix), root)) < 1e-9
    assert derived_quantities(p, HEAVY)["slope_held"].value < 0.0


# Charts


def test_critical_speeds_along_depth():
    x = np.array([2000.0, 5000.0])
    chart = critical_speeds("depth", x, [(STATIC, replace(HEAVY, depth=float(depth))) for depth in x])
    assert chart.lateral[:, 1] == pytest.approx([6.323, 26.27, 59.51], rel=2e-4)
    assert chart.torsional[:, 1] == pytest.approx([0.5862, 2.284, 4.276, 6.323], rel=2e-4)
    assert 3 * chart.axial[:, 1] == pytest.approx([1.196, 3.970, 7.115, 10.389], rel=5e-4)
    # 3 rad/s with three lobes, 9 rad/s, lies between the third and the fourth axial
    # wave at 5000 m.
    assert chart.axial[2, 1] < 3.0 < chart.axial[3, 1]
    assert (chart.axial[:, 0] > chart.axial[:, 1]).all()
