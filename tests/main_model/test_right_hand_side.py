"""The compiled right-hand side against the independent reference, across lanes, and
against plain Python."""

from dataclasses import replace

import numpy as np
import pytest
from machine_code import of_numbers
from reference import Case, contacts, derivative, quick
from strings import MAIN, pack

from main_model.buffers import ROWS, buffer_of, slopes
from main_model.cases import random_case, random_state, table_of
from nsdrill.equations.graph import Graph
from nsdrill.equations.plain import Rows, function_of
from nsdrill.models.christoforou_yigit.columns import Options
from nsdrill.models.christoforou_yigit.observed import lobe
from nsdrill.models.christoforou_yigit.parameters import Drive, Parameters
from nsdrill.models.variant import variant_of


def terms(c: Case, t: float, s: np.ndarray) -> np.ndarray:
    """How large the terms are that sum up to each derivative: cancellation loses bits
    against these, not the sum."""
    f = contacts(c, t, s)
    _, vx, _, vy, z, vz, twist, omega = np.abs(s)
    speed = np.hypot(vx, vy)
    stiffness = c.k_bend + f["bit_force"] * np.pi**2 / c.span + abs(f["bit_torque"]) * np.pi**3 / c.span**2
    lateral = stiffness * f["radius"] + c.c_h * speed**2 + f["wall_force"] + abs(f["wall_friction"])
    s_e = c.m_e * c.eccentricity
    inertia = c.J + s_e * (c.eccentricity - s_e / c.m_l)
    angular = (
        abs(f["bit_torque"])
        + c.torsional_damping * omega
        + c.k_t * twist
        + abs(f["wall_friction"]) * c.collar_radius
        + s_e / c.m_l * lateral
    ) / inertia
    a = lateral / c.m_l + s_e / c.m_l * (omega**2 + angular)
    axial = (
        f["bit_force"]
        + c.rock_stiffness * (c.amplitude + z) * (f["bit_force"] > 0)
        + c.wob
        + c.axial_damping * vz
        + c.k_a * z
    ) / c.m_a
    return np.array([vx, a, vy, a, vz, axial, omega + c.speed, angular])


def wall_terms(c: Case, s: np.ndarray) -> float:
    """What a rounding of the radius does to the wall's acceleration: k_w r eps / m_l,
    relative to eps."""
    r = np.hypot(s[0], s[2])
    if r <= c.gap * (1 - 1e-12):
        return 0.0
    rise = 1.5 * np.sqrt(max(r - c.gap, 1e-14)) if c.wall_law == "hertz" else 1.0
    return c.wall_stiffness * r * rise / c.m_l


def points(options: dict, count: int, seed: int) -> list[tuple[Case, float, np.ndarray]]:
    rng = np.random.default_rng(seed)
    found = []
    for _ in range(count):
        case = random_case(rng, **options)
        found.append((case, rng.uniform(0, 5), random_state(rng, case)))
    return found


@pytest.mark.parametrize("wall_law", ["linear", "hertz"])
@pytest.mark.parametrize("softening", ["live", "static", "none"])
@pytest.mark.parametrize("eccentric_mass", ["total", "steel"])
def test_derivatives_equal_the_reference(wall_law, softening, eccentric_mass):
    """To 2e-13 of the terms summed, at 200 random states of 200 random strings, all
    contacts and, with a linear wall, lobe numbers, each of which is compiled separately."""
    options = {"wall_law": wall_law, "softening": softening, "eccentric_mass": eccentric_mass}
    if wall_law == "hertz":
        options |= law(True)
    cases = points(options, 200, 7)
    table = np.concatenate([table_of(c) for c, _, _ in cases])
    times, states = np.array([t for _, t, _ in cases]), np.array([s for *_, s in cases])
    found = slopes(8, wall_law == "hertz", table, times, states, np.array([c.lobes for c, _, _ in cases]))
    for (c, t, s), mine in zip(cases, found, strict=True):
        scale = terms(c, t, s)
        scale[[1, 3, 7]] += wall_terms(c, s)
        assert np.all(np.abs(mine - derivative(c, t, s)) <= 2e-13 * scale), (c, t, s)
    in_rock = np.mean([contacts(c, t, s)["bit_force"] > 0 for c, t, s in cases])
    on_wall = np.mean([contacts(c, t, s)["wall_force"] > 0 for c, t, s in cases])
    assert 0.2 < in_rock < 0.9, "the states are to be in and out of the rock"
    assert 0.2 < on_wall < 0.9, "and on and off the wall"


def test_the_two_references_agree():
    """The 3 x 3 Lagrange system and the eliminated scalar form are one model."""
    for c, t, s in points({}, 200, 8):
        assert quick(c)(t, s) == pytest.approx(derivative(c, t, s), rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("lobes", range(1, 9))
def test_lobed_surface_is_the_sine_of_the_multiple_angle(lobes):
    """sin(n phi) by the Chebyshev recurrence, Abramowitz & Stegun 22.3.15, and its slope
    with phi, n cos(n phi); n^2 roundings."""
    rows = Rows(Graph())
    surface = function_of("surface", lobe(rows.sine, rows.cosine, lobes), {"sine": rows.sine, "cosine": rows.cosine})
    of_angle = of_numbers(lambda s, c: surface(s, c), 2)
    for phi in np.linspace(-7, 7, 501):
        s, slope = of_angle(np.sin(phi), np.cos(phi))
        assert s == pytest.approx(np.sin(lobes * phi), abs=lobes**2 * 3e-16 + 1e-15)
        assert slope == pytest.approx(lobes * np.cos(lobes * phi), abs=lobes**3 * 3e-16 + 1e-15)


def law(hertz: bool) -> dict:
    """Linear with three lobes, Hertz with eight: each is compiled separately."""
    return {"wall_law": "hertz", "lobes": 8} if hertz else {"wall_law": "linear", "lobes": 3}


def batch(hertz: bool, count: int = 32) -> tuple[np.ndarray, np.ndarray, np.ndarray, int]:
    cases = points(law(hertz), count, 9)
    return (
        np.concatenate([table_of(c) for c, _, _ in cases]),
        np.array([t for _, t, _ in cases]),
        np.array([s for *_, s in cases]),
        law(hertz)["lobes"],
    )


@pytest.mark.parametrize("hertz", [False, True])
def test_one_eight_and_sixteen_lanes_give_the_same_bits(hertz):
    case = batch(hertz)
    one = slopes(1, hertz, *case)
    assert np.array_equal(one, slopes(8, hertz, *case))
    assert np.array_equal(one, slopes(16, hertz, *case))


def test_a_lane_does_not_feel_its_neighbours():
    table, time, states, _ = batch(False, 8)
    alone = slopes(8, False, table, time, states)
    for lane in range(8):
        others = np.arange(8) != lane
        spoiled_table, spoiled_states = table.copy(), states.copy()
        spoiled_table[others], spoiled_states[others] = np.nan, np.inf
        assert np.array_equal(slopes(8, False, spoiled_table, time, spoiled_states)[lane], alone[lane])


def test_a_lane_on_the_verge_of_the_wall_does_not_feel_a_neighbour_on_it():
    """The wall is computed for all lanes once one touches: a lane within an ulp of the
    gap gets the same alone."""
    c = Case()
    rng = np.random.default_rng(15)
    for _ in range(200):
        angle = rng.uniform(-np.pi, np.pi)
        r = c.gap * (1 + rng.integers(-2, 3) * 2.0**-53)
        s = np.array([r * np.cos(angle), 0.1, r * np.sin(angle), -0.2, -1e-3, 0.0, 0.0, 3.0])
        deep = s * [1.1, 1, 1.1, 1, 1, 1, 1, 1]
        table = np.repeat(table_of(c), 8, axis=0)
        among = slopes(8, False, table, np.zeros(8), np.array([s] + [deep] * 7))[0]
        assert np.array_equal(slopes(1, False, table[:1], np.zeros(1), s[None])[0], among)


def test_only_accelerations_and_auxiliary_rows_are_written():
    table, time, states, _ = batch(False, 8)
    buffer = buffer_of(table, time, states, rest=0.123)
    before = buffer.copy()
    variant_of(MAIN, Options()).right_hand_side(8)(buffer)
    changed = np.flatnonzero(np.any((buffer != before).reshape(ROWS.total, 8), axis=1))
    accelerations = range(ROWS.acceleration, ROWS.acceleration + ROWS.pairs)
    assert set(accelerations) <= set(changed) <= {*accelerations, *range(ROWS.aux_now, ROWS.aux_now + ROWS.aux)}


def test_centre_of_the_hole_is_an_ordinary_point():
    """The polar form of the paper divides by r there."""
    c = Case()
    s = np.array([0.0, 0.0, 0.0, 0.0, -1e-4, 0.0, 0.0, 3.0])
    f = slopes(1, False, table_of(c), np.zeros(1), s[None])[0]
    assert np.all(np.isfinite(f))
    assert f == pytest.approx(derivative(c, 0.0, s), rel=1e-12)


@pytest.mark.parametrize("drive", ["ideal", "lqr"])
def test_packing_many_points_is_packing_each(drive):
    rng, p = np.random.default_rng(13), replace(Parameters(), drive=Drive(drive))
    depth, wob, speed = (rng.uniform(300, 9000, 20), rng.uniform(0, 1e5, 20), rng.uniform(0.1, 20, 20))
    each = [pack(p, *point, 0.5)[0] for point in zip(depth, wob, speed, strict=True)]
    assert np.array_equal(pack(p, depth, wob, speed, 0.5), np.array(each))


def test_natural_sizes_and_first_steps_are_positive_everywhere():
    rng = np.random.default_rng(14)
    for _ in range(50):
        table = table_of(random_case(rng))
        assert np.all(variant_of(MAIN, Options()).state_scales(table) > 0)
        assert np.all(
            (variant_of(MAIN, Options()).first_step(table) > 0) & (variant_of(MAIN, Options()).first_step(table) < 0.1)
        )
