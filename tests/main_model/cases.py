"""From a reference case to the package's parameters, and random cases and states."""

from typing import Any

import numpy as np
from reference import Case
from strings import pack

from nsdrill.app.running.run import run_in_memory
from nsdrill.models.christoforou_yigit.parameters import Bit, BitFriction, Collar, Drillstring, Mud, Parameters, Well
from nsdrill.models.operation import Operation
from nsdrill.models.sections import Cutting, Material, Pipe, WallFriction
from nsdrill.study import Study, parse_study


def parameters_of(c: Case) -> Parameters:
    return Parameters(
        Drillstring(
            Collar(c.collar_od, c.collar_id, c.collar_length, c.span),
            Pipe(c.pipe_od, c.pipe_id),
            Material(c.density, c.young, c.shear),
            c.eccentricity,
            c.eccentric_mass,
            c.softening,
            c.axial_damping,
            c.torsional_damping,
        ),
        Mud(c.mud_density, c.added_mass, c.mud_drag),
        Well(
            c.well_diameter,
            c.wall_stiffness,
            c.wall_law,
            WallFriction(c.wall_static, c.wall_dynamic, c.wall_smoothing, c.wall_decay),
        ),
        Bit(
            c.lobes,
            c.amplitude,
            c.rock_stiffness,
            Cutting(c.zeta, c.c1, c.c2),
            BitFriction(
                c.bit_static,
                c.bit_dynamic,
                c.bit_smoothing,
                c.bit_decay,
                law=c.bit_law,
                dynamic_from=c.bit_from,
                b0=c.b0,
                b1=c.b1,
                b2=c.b2,
                b3=c.b3,
            ),
        ),
    )


def operation_of(c: Case) -> Operation:
    return Operation(c.depth, c.wob, c.speed)


def table_of(c: Case) -> np.ndarray:
    """The lane parameters of the case, shape (1, parameters)."""
    return pack(parameters_of(c), c.depth, c.wob, c.speed)


def random_case(rng: np.random.Generator, **fixed: object) -> Case:
    """Anything a user may ask for, every option included."""
    u = rng.uniform
    static_w, static_b = u(0.05, 0.6), u(0.05, 0.8)
    chosen = {
        "depth": u(400, 9000),
        "wob": u(0, 1e5),
        "speed": u(0.3, 12),
        "wall_stiffness": 10 ** u(6, 9),
        "wall_law": str(rng.choice(["linear", "hertz"])),
        "wall_static": static_w,
        "wall_dynamic": u(0.3, 1) * static_w,
        "wall_smoothing": 10 ** u(1, 4),
        "wall_decay": u(0, 10),
        "eccentricity": u(0, 0.03),
        "eccentric_mass": str(rng.choice(["total", "steel"])),
        "softening": str(rng.choice(["live", "static", "none"])),
        "axial_damping": u(0, 2e4),
        "torsional_damping": u(0, 200),
        "mud_density": u(0, 2200),
        "added_mass": u(0, 3),
        "mud_drag": u(0, 2),
        "lobes": int(rng.integers(1, 9)),
        "amplitude": u(0, 3e-3),
        "rock_stiffness": 10 ** u(6, 9),
        "zeta": u(0, 2),
        "c1": u(0, 3e-8),
        "c2": u(-3e-4, 1e-4),
        "bit_static": static_b,
        "bit_dynamic": u(0.2, 1) * static_b,
        "bit_smoothing": 10 ** u(1, 4),
        "bit_decay": u(0, 10),
        "well_diameter": u(0.3, 0.45),
        "span": u(8, 25),
        "collar_length": u(100, 300),
        "density": u(7000, 8000),
        "young": u(190e9, 220e9),
        "shear": u(70e9, 85e9),
    }
    return Case(**{**chosen, **fixed})


def random_state(rng: np.random.Generator, case: Case) -> np.ndarray:
    """A state in or out of each contact, moving or nearly at rest."""
    r = case.gap * rng.choice([rng.uniform(0, 1), 1 + 10 ** rng.uniform(-6, -1.5)])
    angle = rng.uniform(-np.pi, np.pi)
    z = rng.normal(0, case.amplitude + case.wob / case.rock_stiffness + 1e-4)
    speed = case.speed * rng.choice([rng.normal(0, 2), 10 ** rng.uniform(-8, -1)])
    vx, vy = rng.normal(0, 0.3, 2)
    return np.array([r * np.cos(angle), vx, r * np.sin(angle), vy, z, rng.normal(0, 0.05), rng.normal(0, 5), speed])


# The torsional model: the axial and the lateral motion are frozen.
TORSION = """
modes: {{axial: frozen, lateral: frozen}}
drillstring: {{{string}}}
bit: {{cutting: {{zeta: {zeta}}}, friction: {{{friction}}}}}
operation: {{depth: {depth} m, wob: {wob} kN, rotary_speed: {speed} rad/s}}
initial: {{twist: {twist} rad, bit_speed: {bit_speed} rad/s}}
simulation: {{transient: {transient} s, observe: {observe} s, rtol: 1.0e-8}}
"""
DEEP = {"string": "torsional_damping: 50 N*m*s/rad", "zeta": 1, "depth": 5000, "friction": "law: hyperbolic"}


def torsion(**keys: Any) -> Study:
    return parse_study(TORSION.format(**{"twist": 0, "bit_speed": 0, "transient": 300, "observe": 100, **DEEP, **keys}))


def features(study: Study) -> dict[str, float]:
    """What is measured of the only point of a study."""
    found = run_in_memory(study, workers=1)
    return {
        name: float(np.ravel(values)[0])
        for name, values in found.variables.items()
        if values.dtype.kind in "fi" and values.size == 1
    }
