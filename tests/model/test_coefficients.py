"""The lumped coefficients: the check numbers of the theory page, published ones, and
the independent reference."""

from __future__ import annotations

import math
from dataclasses import asdict, fields

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from reference import Case

from model.cases import parameters_of, random_case
from nsdrill.models.christoforou_yigit.coefficients import Coefficients, derive
from nsdrill.models.christoforou_yigit.parameters import Collar, Drillstring, Parameters

# Theory page, "Check": depth 2000 m, 22.24 kN, 3 rad/s; computed there with ten digits.
CHECK = {
    "m_l": 3941.120735,
    "c_h": 1441.487328,
    "k_bend": 174186.7573,
    "m_a": 73314.5033,
    "k_a": 397218.7863,
    "J": 471.7007221,
    "k_t": 525.5269838,
    "depth_of_cut": 6.912151728e-4,
    "cutting_arm": 0.01147503771,
}


@pytest.mark.parametrize("name", CHECK)
def test_coefficients_have_the_check_numbers(name: str) -> None:
    k = derive(Parameters(), 2000.0, 22240.0, 3.0)
    # half a unit in the tenth digit
    assert getattr(k, name) == pytest.approx(CHECK[name], rel=5e-10)


def test_inertia_and_stiffness_of_jansen_and_van_den_steen() -> None:
    """Jansen & van den Steen 1995: 2000 m of 5 in pipe over 150 m of 9 in collar: J 374
    kg m2, k 473 N m/rad."""
    k = derive(Parameters(Drillstring(Collar(length=150.0))), 2150.0, 0.0, 1.0)
    found = k.J, k.k_t
    assert found == pytest.approx((373.99, 472.97), abs=0.005)


@pytest.mark.parametrize("seed", range(20))
def test_coefficients_equal_the_reference(seed: int) -> None:
    c = random_case(np.random.default_rng(seed))
    k = derive(parameters_of(c), c.depth, c.wob, c.speed)
    for name in (
        "m_c",
        "m_l",
        "m_e",
        "k_bend",
        "c_h",
        "m_a",
        "k_a",
        "J",
        "k_t",
        "gap",
        "depth_of_cut",
        "bit_radius",
        "collar_radius",
    ):
        assert getattr(k, name) == pytest.approx(getattr(c, name), rel=1e-13), name
    assert k.cutting_arm == pytest.approx(c.zeta * math.sqrt(c.bit_radius * c.depth_of_cut), rel=1e-13)
    # a difference of near numbers
    assert k.m_f == pytest.approx(c.m_l - c.m_c, rel=1e-11, abs=1e-9)


def test_buckling_load_is_eulers() -> None:
    """pi^2 E I / l^2; there the static bending stiffness k_bend - W pi^2/(2 l)
    vanishes."""
    k = derive(Parameters(), 2000.0, 22240.0, 3.0)
    assert k.buckling_load * math.pi**2 / (2 * Collar().span) == pytest.approx(k.k_bend, rel=1e-14)


def test_arrays_give_the_bits_of_scalars() -> None:
    rng = np.random.default_rng(5)
    depth, wob, speed = (rng.uniform(300, 9000, 50), rng.uniform(0, 1e5, 50), rng.uniform(0.1, 20, 50))
    many = derive(Parameters(), depth, wob, speed)
    for i in range(50):
        one = derive(Parameters(), depth[i], wob[i], speed[i])
        assert asdict(one) == {
            name: np.ravel(value)[i if np.ndim(value) else 0] for name, value in asdict(many).items()
        }


@pytest.mark.parametrize("depth", [200.0, 199.9, 0.0, -5.0])
def test_a_depth_within_the_collars_is_refused(depth: float) -> None:
    with pytest.raises(ValueError, match="more than the collar length, 200 m"):
        derive(Parameters(), np.array([3000.0, depth]), 1e4, 3.0)


@given(st.floats(300, 9000), st.floats(0, 2e5), st.floats(0.01, 50))
@settings(max_examples=100, deadline=None)
def test_depth_of_cut_is_never_negative(depth: float, wob: float, speed: float) -> None:
    """The printed law of the rate of penetration is negative at low weight."""
    k = derive(Parameters(), depth, wob, speed)
    assert k.depth_of_cut >= 0
    assert (k.depth_of_cut == 0) == (1.35e-8 * wob * math.sqrt(speed) <= 1.9e-4)


def test_deeper_is_softer_and_heavier() -> None:
    shallow, deep = derive(Parameters(), 1000.0, 1e4, 3.0), derive(Parameters(), 8000.0, 1e4, 3.0)
    assert deep.k_a < shallow.k_a
    assert deep.k_t < shallow.k_t
    assert deep.m_a > shallow.m_a
    assert deep.J > shallow.J
    assert deep.k_bend == shallow.k_bend


def test_every_coefficient_says_its_unit() -> None:
    assert all(item.metadata["units"] for item in fields(Coefficients))


def test_steel_alone_is_eccentric_where_the_user_says_so() -> None:
    case = Case(eccentric_mass="steel")
    k = derive(parameters_of(case), 2000.0, 1e4, 3.0)
    assert k.m_e == k.m_c < k.m_l
