"""Forces, energies and powers of given states, in plain numpy: for traces, figures and
the energy balance.

The same laws as the compiled right-hand side, written as on the theory page; tests hold
the two together.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from nsdrill.models.christoforou_yigit.coefficients import Coefficients, derive
from nsdrill.models.christoforou_yigit.drives import gains, regulator
from nsdrill.models.christoforou_yigit.lateral import (
    rate_of_penetration,
    stabilizer_radius,
    weights,
)
from nsdrill.models.christoforou_yigit.laws import bit_arm, friction
from nsdrill.models.christoforou_yigit.parameters import Friction, Parameters
from nsdrill.models.drives import Gains, motor_torque
from nsdrill.models.operation import Operation
from nsdrill.models.schedule import History

Array = np.ndarray[Any, np.dtype[np.float64]]


def _shared(
    parameters: Parameters, law: Friction, normal: Any, slip: Any, along: Any
) -> tuple[Any, Any]:
    """Friction [N] around the hole and along it, of a slip [m/s] around and ``along``;
    zero along it where the well has no friction there."""
    if not parameters.well.axial_friction:
        return normal * friction(law, slip), np.zeros_like(slip)
    speed = np.hypot(slip, along)
    per_speed = normal * friction(law, speed) / np.where(speed > 0.0, speed, 1.0)
    return per_speed * slip, per_speed * along


def _contacts(
    parameters: Parameters,
    operation: Operation | History,
    k: Coefficients,
    state: Mapping[str, Array],
) -> dict[str, Any]:
    """The loads at bit, wall and stabilisers and the lateral stiffness, bending less
    softening."""
    string, well, bit = parameters.drillstring, parameters.well, parameters.bit
    x, vx, y, vy, omega = (state[name] for name in ("x", "vx", "y", "vy", "bit_speed"))
    radius = np.hypot(x, y)
    tangential = (x * vy - y * vx) / np.where(radius > 0, radius, 1.0)
    amplitude = 0.0 if parameters.modes.axial == "frozen" else bit.surface_amplitude
    surface = amplitude * np.sin(bit.lobes * (state["twist"] + state["drive_angle"]))
    bit_force = bit.rock_stiffness * np.maximum(surface - state["z"], 0.0)
    bit_torque = bit_force * bit_arm(parameters, k, omega)
    force, torque = {
        "live": (bit_force, bit_torque),
        "static": (operation.wob, 0.0),
        "none": (0.0, 0.0),
    }[string.lateral_softening]
    span = string.collar.span
    softening = (
        force * math.pi**2 / (2 * span) + torque * math.pi**3 / (2 * span**2) + np.zeros_like(omega)
    )
    along = state["vz"] - rate_of_penetration(k, operation.rotary_speed)
    penetration = np.maximum(radius - k.gap, 0.0)
    wall_force = well.stiffness * penetration ** (1.5 if well.law == "hertz" else 1.0)
    rub, rub_along = _shared(
        parameters, well.friction, wall_force, omega * k.collar_radius + tangential, along
    )
    found = {
        "radius": radius,
        "tangential": tangential,
        "bit_force": bit_force,
        "bit_torque": bit_torque,
        "wall_force": wall_force,
        "wall_friction": rub,
        "softening": softening,
        "axial_friction": rub_along,
    }
    clearance = parameters.stabilizer.clearance
    if clearance is not None:
        held = (k.k_bend - softening) * np.maximum(radius - clearance, 0.0)
        around = tangential * clearance / np.where(radius > 0, radius, 1.0)
        slip = omega * stabilizer_radius(parameters) + around
        rub, rub_along = _shared(
            parameters, parameters.stabilizer.friction, np.abs(held), slip, along
        )
        found["stabilizer_friction"] = rub
        found["axial_friction"] = found["axial_friction"] + rub_along
    return found


def forces(
    parameters: Parameters, operation: Operation | History, state: Mapping[str, Array]
) -> dict[str, Array]:
    """Contact forces and what follows from the state.

    ``state`` holds x, vx, y, vy [m, m/s], z, vz, twist [rad], bit_speed [rad/s] and
    drive_angle [rad], arrays of one shape; and, of a drive that is not ideal, lag [rad]
    and drive_speed [rad/s]. Gives radius, radial_velocity, whirl_angle (unwrapped along
    the array), whirl_speed, bit_force, bit_torque, wall_force, wall_friction,
    surface_torque, all SI. ``operation`` may change along the array.
    """
    k = derive(parameters, operation.depth, operation.wob, operation.rotary_speed)
    x, vx, y, vy = (state[name] for name in ("x", "vx", "y", "vy"))
    found = _contacts(parameters, operation, k, state)
    radius = found["radius"]
    safe = np.where(radius > 0, radius, 1.0)
    return {
        "radius": radius,
        "radial_velocity": (x * vx + y * vy) / safe,
        "whirl_angle": np.unwrap(np.arctan2(y, x)),
        "whirl_speed": found["tangential"] / safe,
        "bit_force": found["bit_force"],
        "bit_torque": found["bit_torque"],
        "wall_force": found["wall_force"],
        "wall_friction": found["wall_friction"],
        "surface_torque": -k.k_t * (state["twist"] - state.get("lag", 0.0)),
    }


def energy(
    parameters: Parameters, operation: Operation | History, state: Mapping[str, Array]
) -> Array:
    """Kinetic plus potential energy [J]: T + V of the theory page, with the elastic
    energy of the wall's contact, the work still to be had from the weight on bit, W z,
    and that of the collar's weight in an inclined hole. The rock and the lateral
    softening do their work in :func:`powers`.
    """
    k = derive(parameters, operation.depth, operation.wob, operation.rotary_speed)
    string, well = parameters.drillstring, parameters.well
    clearance = parameters.stabilizer.clearance
    e0 = 0.0 if parameters.modes.lateral == "frozen" else string.eccentricity
    phi = state["twist"] + state["drive_angle"]
    omega = state["bit_speed"]
    # Velocity of the mass centre, G = C + e0 (cos phi, sin phi).
    gx = state["vx"] - e0 * omega * np.sin(phi)
    gy = state["vy"] + e0 * omega * np.cos(phi)
    kinetic = 0.5 * (
        k.m_e * (gx**2 + gy**2)
        + (k.m_l - k.m_e) * (state["vx"] ** 2 + state["vy"] ** 2)
        + k.J * omega**2
        + k.m_a * state["vz"] ** 2
    )
    r2 = state["x"] ** 2 + state["y"] ** 2
    penetration = np.maximum(np.sqrt(r2) - k.gap, 0.0)
    bent2 = r2 if clearance is None else np.maximum(np.sqrt(r2) - clearance, 0.0) ** 2
    across, steel = weights(parameters)
    exponent = 2.5 if well.law == "hertz" else 2.0
    potential = (
        0.5 * k.k_bend * bent2
        + 0.5 * k.k_t * (state["twist"] - state.get("lag", 0.0)) ** 2
        + 0.5 * k.k_a * state["z"] ** 2
        + operation.wob * state["z"]
        + well.stiffness * penetration**exponent / exponent
        + across * state["y"]
        + (steel * e0 * np.sin(phi) if string.eccentric_weight else 0.0)
    )
    if "lag" in state:  # the drive, and its controller's spring
        law = gains(parameters, k)
        kinetic = kinetic + 0.5 * law.inertia * state["drive_speed"] ** 2
        potential = potential + 0.5 * law.stiffness * state["lag"] ** 2
        if "motor_torque" in state:  # L i^2 / 2
            drive = parameters.drive
            potential = (
                potential
                + 0.5 * drive.circuit_time / drive.motor_damping * state["motor_torque"] ** 2
            )
    return np.asarray(kinetic + potential)


def _power_of_drive(
    law: Gains, parameters: Parameters, operation: Operation | History, state: Mapping[str, Array]
) -> Array:
    """What the controller feeds in [W], but for its spring, whose energy is counted;
    less what its damping takes."""
    top, speed, omega = state["drive_speed"], operation.rotary_speed, state["bit_speed"]
    if "motor_torque" in state:  # V i - R i^2
        torque = state["motor_torque"]
        volts = speed  # over n K
        if parameters.drive.regulated:
            k = derive(parameters, operation.depth, operation.wob, speed)
            r = regulator(parameters, k, operation.wob, speed)
            asked = (
                r.torque * (torque - r.steady_motor_torque)
                + r.lag * state["lag"]
                + r.drive_speed * (top - speed)
            )
            asked = (
                asked + r.twist * (state["twist"] - r.steady_twist) + r.bit_speed * (omega - speed)
            )
            volts = speed + (r.steady_motor_torque - asked) / parameters.drive.motor_damping
        fed = torque * (volts - torque / parameters.drive.motor_damping)
        return np.asarray(fed - law.shaft_damping * (top - omega) ** 2)
    torque = motor_torque(
        law, parameters.drive.torque_limit, state["lag"], top, state["twist"], omega, speed
    )
    spring = law.stiffness * state["lag"] * (top - speed)
    return np.asarray(torque * top + spring - law.shaft_damping * (top - omega) ** 2)


def powers(
    parameters: Parameters, operation: Operation | History, state: Mapping[str, Array]
) -> dict[str, Array]:
    """Power [W] that each agent feeds into :func:`energy`; dissipation is negative.
    Their sum is its rate of change.

    ``drive`` the top drive, ``bit`` the rock (force times velocity, less torque times
    speed), ``drag`` mud, which also drives where it turns, ``damping`` axial and
    torsional, ``wall`` wall friction, ``softening`` axial force and torque working on
    the bent span; with stabilisers ``stabilizer``, their friction as it acts on collar
    and string (:mod:`.lateral`). Friction along the axis is that of wall and
    stabilisers.
    """
    k = derive(parameters, operation.depth, operation.wob, operation.rotary_speed)
    string = parameters.drillstring
    f = _contacts(parameters, operation, k, state)
    x, y, vx, vy, vz, omega = (state[name] for name in ("x", "y", "vx", "vy", "vz", "bit_speed"))
    slip = omega * k.collar_radius + f["tangential"]
    bent = np.ones_like(omega)  # how much of the radius is bent
    clearance, held = parameters.stabilizer.clearance, {}
    if clearance is not None:
        safe = np.where(f["radius"] > 0, f["radius"], 1.0)
        bent = np.maximum(f["radius"] - clearance, 0.0) / safe
        work = omega * stabilizer_radius(parameters) + f["tangential"]
        held = {"stabilizer": -f["stabilizer_friction"] * work}
    sigma = parameters.mud.swirl * operation.rotary_speed
    ux, uy = vx + sigma * y, vy - sigma * x
    drag = -k.c_h * np.hypot(ux, uy) * (ux * vx + uy * vy) + k.m_f * sigma**2 * (x * vx + y * vy)
    return {
        # The spring's energy 1/2 k_t twist^2 changes at the rate k_t twist (omega -
        # drive speed): the drive pays its part.
        "drive": -k.k_t * state["twist"] * operation.rotary_speed
        if "lag" not in state
        else (_power_of_drive(gains(parameters, k), parameters, operation, state)),
        "bit": f["bit_force"] * vz - f["bit_torque"] * omega,
        "drag": drag,
        "damping": -string.axial_damping * vz**2 - string.torsional_damping * omega**2,
        "wall": -f["wall_friction"] * slip - f["axial_friction"] * vz,
        **held,
        "softening": f["softening"] * bent * (x * vx + y * vy),
    }
