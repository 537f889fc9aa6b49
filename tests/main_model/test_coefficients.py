"""The lumped coefficients and the forces of given states, against the reference. Numbers by
hand and from the literature: ``docs/verify.py``."""

import math
from dataclasses import fields

import numpy as np
import pytest
from reference import Case, contacts
from strings import STATES, forces

from main_model.buffers import slopes
from main_model.cases import operation_of, parameters_of, random_case, random_state, table_of
from nsdrill.models.christoforou_yigit.coefficients import Coefficients, derive
from nsdrill.models.christoforou_yigit.parameters import Parameters


@pytest.mark.parametrize("seed", range(20))
def test_coefficients_equal_the_reference(seed):
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


@pytest.mark.parametrize("depth", [200.0, 199.9, 0.0, -5.0])
def test_a_depth_within_the_collars_is_refused(depth):
    with pytest.raises(ValueError, match="more than the collar length, 200 m"):
        derive(Parameters(), np.array([3000.0, depth]), 1e4, 3.0)


def test_every_coefficient_says_its_unit():
    assert all(item.metadata["units"] for item in fields(Coefficients))


def as_state(states: np.ndarray, drive_angle: np.ndarray) -> dict[str, np.ndarray]:
    return {**{name: states[:, i] for i, name in enumerate(STATES)}, "drive_angle": drive_angle}


def drawn(seed: int, **fixed: object) -> tuple[Case, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    case = random_case(rng, **fixed)
    return case, np.array([random_state(rng, case) for _ in range(40)]), rng.uniform(0, 5, 40)


@pytest.mark.parametrize("seed", range(8))
def test_forces_equal_the_reference(seed):
    c, states, t = drawn(seed)
    mine = forces(parameters_of(c), operation_of(c), as_state(states, c.speed * t))
    theirs = contacts(c, t, states.T)
    # The radius is rounded at its own size: eps R k in the wall force.
    eps = 4 * np.finfo(float).eps * c.well_diameter * c.wall_stiffness
    assert mine["radius"] == pytest.approx(theirs["radius"], rel=1e-14)
    # sin(n phi) with n phi up to 8 x 80 rad
    lobe = c.rock_stiffness * c.amplitude * 1e-12
    assert mine["bit_force"] == pytest.approx(theirs["bit_force"], rel=1e-12, abs=lobe)
    assert mine["bit_torque"] == pytest.approx(theirs["bit_torque"], rel=1e-11, abs=lobe)
    assert mine["wall_force"] == pytest.approx(theirs["wall_force"], rel=1e-10, abs=eps)
    assert mine["wall_friction"] == pytest.approx(theirs["wall_friction"], rel=1e-10, abs=eps)
    assert mine["whirl_speed"] * mine["radius"] == pytest.approx(theirs["tangential_speed"], rel=1e-12)
    assert mine["surface_torque"] == pytest.approx(-c.k_t * states[:, 6], rel=1e-14)


@pytest.mark.parametrize("law", ["linear", "hertz"])
def test_forces_add_up_to_the_compiled_accelerations(law):
    """Without eccentricity and softening each acceleration is a sum of the reported
    forces."""
    c, states, t = drawn(21, wall_law=law, lobes=3, eccentricity=0.0, softening="none")
    f = forces(parameters_of(c), operation_of(c), as_state(states, c.speed * t))
    a = slopes(8, law == "hertz", np.repeat(table_of(c), 40, axis=0), t, states)
    x, vx, y, vy, z, vz, _, omega = states.T
    r, drag = f["radius"], c.c_h * np.hypot(vx, vy)
    outward = -c.k_bend * r - f["wall_force"] - drag * (x * vx + y * vy) / r
    around = -f["wall_friction"] - drag * (x * vy - y * vx) / r
    size = c.k_bend * c.gap + np.max(np.abs(f["wall_force"])) + c.wall_stiffness * 1e-9
    assert c.m_l * (x * a[:, 1] + y * a[:, 3]) / r == pytest.approx(outward, rel=1e-9, abs=1e-12 * size)
    assert c.m_l * (x * a[:, 3] - y * a[:, 1]) / r == pytest.approx(around, rel=1e-9, abs=1e-12 * size)
    assert c.m_a * a[:, 5] == pytest.approx(
        f["bit_force"] - c.wob - c.axial_damping * vz - c.k_a * z, rel=1e-9, abs=1e-9 * c.wob
    )
    moment = -f["bit_torque"] - f["wall_friction"] * c.collar_radius - c.torsional_damping * omega + f["surface_torque"]
    assert c.J * a[:, 7] == pytest.approx(moment, rel=1e-9, abs=1e-12 * np.max(np.abs(moment)))


def test_whirl_angle_is_unwrapped():
    c = Case()
    angle = np.linspace(0, 20, 400)
    states = np.zeros((400, 8))
    states[:, 0], states[:, 2] = 0.01 * np.cos(angle), 0.01 * np.sin(angle)
    f = forces(parameters_of(c), operation_of(c), as_state(states, np.zeros(400)))
    assert f["whirl_angle"] == pytest.approx(angle, abs=1e-13)


def test_at_the_centre_of_the_hole_nothing_is_infinite():
    c = Case()
    f = forces(parameters_of(c), operation_of(c), as_state(np.zeros((3, 8)), np.zeros(3)))
    assert all(np.all(np.isfinite(values)) for values in f.values())
