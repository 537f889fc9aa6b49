"""Energies of the elastic collar and the powers that change them."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from strings import forces

from nsdrill.models.beam.columns import as_lumped, coefficients, drags, eccentricities, places, walls
from nsdrill.models.beam.model import at_place
from nsdrill.models.beam.parameters import Initial, Parameters
from nsdrill.models.operation import Values
from nsdrill.models.registry import model_named
from nsdrill.models.tree import with_values
from nsdrill.models.variant import variant_at

Array = np.ndarray[Any, np.dtype[np.float64]]
State = Mapping[str, Array]


def stations_of(parameters: Parameters, point: Any, state: State) -> list[dict[str, Array]]:
    """The forces of the lumped model at each station, with position and velocity."""
    rest = {name: state[name] for name in ("z", "vz", "twist", "bit_speed", "drive_angle")}
    stations = []
    for station in parameters.beam.stations:
        motion = at_place(parameters, state, station.at)
        own = {}
        if station.gap is not None:
            own["well.diameter"] = parameters.drillstring.collar.outer_diameter + 2 * station.gap
        if station.stiffness is not None:
            own["well.stiffness"] = station.stiffness
        at_station = with_values(as_lumped(parameters), own)
        stations.append({**motion, **forces(at_station, point, {**rest, **motion})})
    return stations


def _constants(parameters: Parameters, point: Any) -> tuple[Any, float, list[float]]:
    """The lumped coefficients, the factor of mass and stiffness, and the eccentricity
    of each mode."""
    k = coefficients(parameters, point.depth, point.wob, point.rotary_speed)
    distances = eccentricities(parameters)
    arms = [distances.get(n, 0.0) for n in range(1, parameters.beam.modes + 1)]
    return k, parameters.beam.modal_mass_factor, arms


def energy(parameters: Parameters, point: Any, state: State) -> Array:
    """Kinetic plus potential energy [J]: of the collar, sum_n 1/2 m_e |v_Gn|^2 + 1/2 (m
    - m_e) |v_n|^2 with v_Gn = v_n + e_n omega (-sin phi, cos phi), its bending and the
    elastic energy of the walls; of twist and bit; and the potential energy of the
    weight on bit. The work of rock, softening and damping is in :func:`powers`."""
    k, factor, arms = _constants(parameters, point)
    well, phi, omega = parameters.well, state["twist"] + state["drive_angle"], state["bit_speed"]
    total = 0.5 * (k.J * omega**2 + k.m_a * state["vz"] ** 2 + k.k_t * state["twist"] ** 2 + k.k_a * state["z"] ** 2)
    total = total + point.wob * state["z"]
    for n, e in enumerate(arms, start=1):
        x, vx, y, vy = (state[f"{name}_{n}"] for name in ("x", "vx", "y", "vy"))
        gx, gy = vx - e * omega * np.sin(phi), vy + e * omega * np.cos(phi)
        total = total + 0.5 * factor * (
            k.m_e * (gx**2 + gy**2) + (k.m_l - k.m_e) * (vx**2 + vy**2) + n**4 * k.k_bend * (x**2 + y**2)
        )
    exponent = 2.5 if well.law == "hertz" else 2.0
    for place, (gap, stiffness) in zip(places(parameters.beam), walls(parameters, k.gap), strict=True):
        at = at_place(parameters, state, place)
        depth = np.maximum(np.hypot(at["x"], at["y"]) - gap, 0.0)
        total = total + stiffness * depth**exponent / exponent
    return np.asarray(total)


def powers(parameters: Parameters, point: Any, state: State) -> dict[str, Array]:
    """Power [W] that each agent adds to :func:`energy`, under the names of
    :func:`energies.powers`; ``structure`` is the
    damping of the modes. Their sum is the rate of the energy."""
    k, factor, _ = _constants(parameters, point)
    string, beam = parameters.drillstring, parameters.beam
    omega, vz, span = state["bit_speed"], state["vz"], string.collar.span
    operation = (point.depth, point.wob, point.rotary_speed)
    outputs = variant_at(model_named("beam"), parameters).outputs(Values(parameters, Initial(), operation), state)
    stations = stations_of(parameters, point, state)
    load = beam.axial_load
    force = {"static": point.wob, "live": outputs["bit_force"]}[load] if isinstance(load, str) else load
    torque = outputs["bit_torque"] if beam.torque == "cy" else 0.0
    softening: Any = 0.0
    structure: Any = 0.0
    for n in range(1, beam.modes + 1):
        x, vx, y, vy = (state[f"{name}_{n}"] for name in ("x", "vx", "y", "vy"))
        load_factor = force * (n * math.pi) ** 2 / (2 * span) + torque * (n * math.pi) ** 3 / (2 * span**2)
        softening = softening + factor * load_factor * (x * vx + y * vy)
        critical = 2 * factor * np.sqrt(k.m_l * k.k_bend) * n**2
        structure = structure - beam.damping_ratio * critical * (vx**2 + vy**2)
    return {
        "drive": -k.k_t * state["twist"] * point.rotary_speed,
        "bit": outputs["bit_force"] * vz - outputs["bit_torque"] * omega,
        "drag": -np.asarray(
            sum(
                drag * np.hypot(at["vx"], at["vy"]) ** 3
                for drag, at in zip(drags(parameters, k.c_h), stations, strict=True)
            )
        ),
        "damping": -string.axial_damping * vz**2 - string.torsional_damping * omega**2,
        "structure": np.asarray(structure),
        "wall": np.asarray(
            sum(-at["wall_friction"] * (omega * k.collar_radius + at["whirl_speed"] * at["radius"]) for at in stations)
        ),
        "softening": np.asarray(softening),
    }
