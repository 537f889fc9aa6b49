"""Energies of the main model and the powers that change them: the balance that the
equations and the integration are tested by."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from strings import MAIN

from nsdrill.models.christoforou_yigit.coefficients import derive
from nsdrill.models.christoforou_yigit.columns import stabilizer_radius, weights
from nsdrill.models.christoforou_yigit.drives import gains, regulator
from nsdrill.models.christoforou_yigit.parameters import Initial, Parameters
from nsdrill.models.drive_laws import Gains, motor_torque
from nsdrill.models.operation import History, Operation, Values
from nsdrill.models.variant import variant_at

Array = np.ndarray[Any, np.dtype[np.float64]]


def energy(parameters: Parameters, operation: Operation | History, state: Mapping[str, Array]) -> Array:
    """Kinetic plus potential energy [J]: T + V of the theory page, with the elastic
    energy of the contact with the wall and the potential energies of the weight on bit,
    W z, and of the collar's weight in an inclined hole. The work of the rock and of the
    lateral softening is in :func:`powers`.
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
            potential = potential + 0.5 * drive.circuit_time / drive.motor_damping * state["motor_torque"] ** 2
    return np.asarray(kinetic + potential)


def _drive_power(
    law: Gains, parameters: Parameters, operation: Operation | History, state: Mapping[str, Array]
) -> Array:
    """The power [W] of the drive without that of the controller's spring, which is
    counted as energy, less the dissipation of the shaft damping."""
    drive_speed, speed, omega = state["drive_speed"], operation.rotary_speed, state["bit_speed"]
    if "motor_torque" in state:  # V i - R i^2
        torque = state["motor_torque"]
        idle_speed = speed  # over n K
        if parameters.drive.regulated:
            k = derive(parameters, operation.depth, operation.wob, speed)
            law_of_voltage = regulator(parameters, k, operation.wob, speed)
            feedback = (
                law_of_voltage.torque * (torque - law_of_voltage.steady_motor_torque)
                + law_of_voltage.lag * state["lag"]
                + law_of_voltage.drive_speed * (drive_speed - speed)
            )
            feedback = (
                feedback
                + law_of_voltage.twist * (state["twist"] - law_of_voltage.steady_twist)
                + law_of_voltage.bit_speed * (omega - speed)
            )
            idle_speed = speed + (law_of_voltage.steady_motor_torque - feedback) / parameters.drive.motor_damping
        power = torque * (idle_speed - torque / parameters.drive.motor_damping)
        return np.asarray(power - law.shaft_damping * (drive_speed - omega) ** 2)
    torque = motor_torque(law, parameters.drive.torque_limit, state["lag"], drive_speed, state["twist"], omega, speed)
    spring = law.stiffness * state["lag"] * (drive_speed - speed)
    return np.asarray(torque * drive_speed + spring - law.shaft_damping * (drive_speed - omega) ** 2)


def powers(parameters: Parameters, operation: Operation | History, state: Mapping[str, Array]) -> dict[str, Array]:
    """The powers [W] into :func:`energy`, whose sum is its rate of change; dissipation
    is negative:

    ==============  =================================================================
    ``drive``       the top drive
    ``bit``         the rock: force times velocity, less torque times speed
    ``drag``        the mud, which may be positive where it rotates
    ``damping``     axial and torsional damping
    ``wall``        friction at the wall, and along the axis at wall and stabilisers
    ``softening``   axial force and torque, by the bending of the span
    ``stabilizer``  with stabilisers, their friction as it acts on collar and string
                    (:mod:`.equations`)
    ==============  =================================================================
    """
    k = derive(parameters, operation.depth, operation.wob, operation.rotary_speed)
    string = parameters.drillstring
    point = Values(parameters, Initial(), (operation.depth, operation.wob, operation.rotary_speed))
    # 0 what equations without an option do not have
    names = ("bit_force", "bit_torque", "wall_force", "wall_friction", "stiffness")
    further = ("axial_friction", "stabilizer_friction")
    variant = variant_at(MAIN, parameters)
    present = [name for name in further if name in variant.motion.named()]
    found = dict.fromkeys(further, 0.0) | variant.quantities(point, state, *names, *present)
    x, y, vx, vy, vz, omega = (state[name] for name in ("x", "y", "vx", "vy", "vz", "bit_speed"))
    radius = np.hypot(x, y)
    divisor = np.where(radius > 0, radius, 1.0)
    tangential = (x * vy - y * vx) / divisor
    slip = omega * k.collar_radius + tangential
    bent_fraction = np.ones_like(omega)  # fraction of the radius by which the span is bent
    clearance, stabilizer_power = parameters.stabilizer.clearance, {}
    if clearance is not None:
        bent_fraction = np.maximum(radius - clearance, 0.0) / divisor
        working_speed = omega * stabilizer_radius(parameters, clearance) + tangential
        stabilizer_power = {"stabilizer": -found["stabilizer_friction"] * working_speed}
    sigma = parameters.mud.swirl * operation.rotary_speed
    ux, uy = vx + sigma * y, vy - sigma * x
    drag = -k.c_h * np.hypot(ux, uy) * (ux * vx + uy * vy) + k.m_f * sigma**2 * (x * vx + y * vy)
    return {
        # The energy of the spring, 1/2 k_t twist^2, changes at the rate k_t twist
        # (omega - drive speed), of which this is the part of the drive.
        "drive": -k.k_t * state["twist"] * operation.rotary_speed
        if "lag" not in state
        else (_drive_power(gains(parameters, k), parameters, operation, state)),
        "bit": found["bit_force"] * vz - found["bit_torque"] * omega,
        "drag": drag,
        "damping": -string.axial_damping * vz**2 - string.torsional_damping * omega**2,
        "wall": -found["wall_friction"] * slip - found["axial_friction"] * vz,
        **stabilizer_power,
        "softening": (k.k_bend - found["stiffness"]) * bent_fraction * (x * vx + y * vy),
    }
