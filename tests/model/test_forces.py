"""Forces of given states, as traces report them, against the reference and against the
compiled right-hand side."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from main_model import STATES
from reference import Case, contacts

from model.buffers import slopes
from model.cases import operation_of, parameters_of, random_case, random_state, table_of
from nsdrill.models.christoforou_yigit.equations import forces
from nsdrill.models.christoforou_yigit.parameters import BitFriction
from nsdrill.models.friction import hyperbolic, stribeck, values


def as_state(states: np.ndarray, drive_angle: np.ndarray) -> dict[str, np.ndarray]:
    return {**{name: states[:, i] for i, name in enumerate(STATES)}, "drive_angle": drive_angle}


def drawn(seed: int, **fixed: object) -> tuple[Case, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    case = random_case(rng, **fixed)
    return case, np.array([random_state(rng, case) for _ in range(40)]), rng.uniform(0, 5, 40)


@pytest.mark.parametrize("seed", range(8))
def test_forces_equal_the_reference(seed: int) -> None:
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
def test_forces_add_up_to_the_compiled_accelerations(law: str) -> None:
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


def test_friction_opposes_and_falls_from_static_to_dynamic() -> None:
    """f(v) = (2/pi) atan(eps v) [(mu_s - mu_d)/(1 + tau |v|) + mu_d], theory page."""
    law = BitFriction()
    numbers = stribeck(law)

    def friction(v: Any) -> Any:
        return values(hyperbolic, "coefficient", v, numbers)

    v = np.linspace(-20, 20, 4001)
    f = friction(v)
    assert np.array_equal(np.sign(f), np.sign(v))
    assert np.array_equal(friction(-v), -f)
    assert np.max(f) < law.static
    assert friction(1e9) == pytest.approx(law.dynamic, rel=1e-6)
    assert friction(1.0) == pytest.approx(2 / np.pi * np.arctan(500) * (0.3 / 4 + 0.2), rel=1e-14)


def test_cutting_torque_does_not_drive_a_stuck_bit() -> None:
    """The paper's cutting torque does not depend on the direction of rotation; gated by
    g(omega) it only resists."""
    c = Case()
    states = np.zeros((41, 8))
    states[:, 4], states[:, 7] = -2e-3, np.linspace(-2, 2, 41)
    f = forces(parameters_of(c), operation_of(c), as_state(states, np.zeros(41)))
    assert np.all(f["bit_torque"] * states[:, 7] >= 0)
    assert f["bit_torque"][20] == 0


def test_whirl_angle_is_unwrapped() -> None:
    c = Case()
    angle = np.linspace(0, 20, 400)
    states = np.zeros((400, 8))
    states[:, 0], states[:, 2] = 0.01 * np.cos(angle), 0.01 * np.sin(angle)
    f = forces(parameters_of(c), operation_of(c), as_state(states, np.zeros(400)))
    assert f["whirl_angle"] == pytest.approx(angle, abs=1e-13)


def test_at_the_centre_of_the_hole_nothing_is_infinite() -> None:
    c = Case()
    f = forces(parameters_of(c), operation_of(c), as_state(np.zeros((3, 8)), np.zeros(3)))
    assert all(np.all(np.isfinite(values)) for values in f.values())
