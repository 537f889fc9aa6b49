"""The axial, torsional and lateral oscillator of Christoforou and Yigit: four degrees
of freedom, rock, wall, lobes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from nsdrill.errors import InputError
from nsdrill.models import motor, on_surface, surface
from nsdrill.models.base import Array, Symmetry
from nsdrill.models.christoforou_yigit import observed
from nsdrill.models.christoforou_yigit.coefficients import cut_of, derive
from nsdrill.models.christoforou_yigit.collar import (
    CollarInHole,
    hanging,
    reach_of_collar,
    resting_height,
    string_and_bit,
)
from nsdrill.models.christoforou_yigit.columns import (
    IGNORED_SCALE,
    PARAMETERS,
    STATE_NAMES,
    STATES,
    Options,
    axial_scale,
    is_used,
    options_of,
    states_of,
)
from nsdrill.models.christoforou_yigit.equations import equations
from nsdrill.models.christoforou_yigit.parameters import Parameters
from nsdrill.models.christoforou_yigit.table import values_of
from nsdrill.models.operation import History, Numeric, Values
from nsdrill.models.own_drives import numbered
from nsdrill.models.responses import Thresholds
from nsdrill.models.starts import in_the_disc
from nsdrill.observe.thresholds import Record

STATES_OF_MODE = {"lateral": STATES[:4], "axial": STATES[4:6], "torsional": STATES[6:8]}


class ChristoforouYigit(CollarInHole[Parameters]):
    """The main model."""

    name = "christoforou_yigit"
    equations = staticmethod(equations)
    solved = staticmethod(observed.solved)
    contacts = ("rock", "wall")
    options, options_of, names = Options, staticmethod(options_of), staticmethod(observed.names_of)
    declaration = staticmethod(observed.declaration_of)
    widest = Options(driven=1, stabilizer=1, weight=1, implicit=1, surface=2)

    def released(self, table: Array, contact: str) -> Array | None:
        if contact != "wall":
            return None
        changed = table.copy()
        changed[:, PARAMETERS.index("wall_stiffness")] = 0.0
        return changed

    def symmetry(self, points: Values[Parameters]) -> Symmetry:
        """The lobes repeat after a revolution over their number, the weight of an
        inclined collar after a whole revolution; without either the equations are the
        same at every angle."""
        parameters = points.parameters
        options = options_of(parameters)
        if options.surface and parameters.modes.torsional == "frozen":  # its bit speed would not follow
            raise InputError(
                "bit.rock.law: found regenerative with modes.torsional: frozen in a continuation; allowed: torsional "
                "free. A sweep up and down (sweep.procedure: up-down) takes frozen modes."
            )
        if options.driven:
            motor.check_holds(parameters.drive, self.columns(points, Thresholds()))
        smooth = options.surface or parameters.modes.axial == "frozen" or not is_used(parameters.bit.surface_amplitude)
        folds = 1 if options.weight else 0 if smooth else options.lobes
        constant = {*self.held(parameters), "motor_impulse"}
        names = states_of(options)
        free = tuple(index for index, name in enumerate(names) if name not in constant)
        return Symmetry(folds, free, ((0, 2), (1, 3)))

    # What differs from run to run

    def columns(self, points: Values[Parameters], thresholds: Thresholds) -> Mapping[str, Numeric]:
        depth, wob, speed = points.operation
        return values_of(points.parameters, depth, wob, speed, thresholds.stuck_below)

    def natural_scales(self, table: Mapping[str, Array], o: Options) -> Sequence[Numeric]:
        """The natural scale of each state.

        Lateral: a tenth of the gap; axial: :func:`axial_scale`; twist and bit speed: a
        tenth of a radian, a tenth of the drive speed. Velocities: the position's size times the
        frequency of the free mode, bending for the lateral one and in contact for the axial
        one. A drive's lag and speed have the scales of twist and bit speed, the torque of a
        motor that of a twist of that size.
        """
        lateral = 0.1 * table["gap"]
        contact = table["axial_stiffness"] + table["rock_stiffness"]
        axial = axial_scale(table)
        bending_rate, axial_rate = (
            np.sqrt(np.where(per_mass > 0.0, square, 1.0))  # any scale will do for a frozen mode
            for per_mass, square in (
                (table["per_lateral_mass"], np.abs(table["bending"]) * table["per_lateral_mass"]),
                (table["per_axial_mass"], contact * table["per_axial_mass"]),
            )
        )
        across, along = [lateral, lateral * bending_rate], [axial, axial * axial_rate]
        rotating: list[Numeric] = [0.1, 0.1 * table["set_speed"]]
        scales = [*across, *across, *along, *rotating]
        if o.driven:
            scales += rotating
        if o.motor:
            scales += [IGNORED_SCALE, 0.1 * table["torsional_stiffness"]]
        scales += [table["blade_depth"]] * o.surface if o.surface else []
        if o.drive:
            scales += numbered(o.drive).scales(table, 0.1 * table["torsional_stiffness"])
        return scales

    def fastest(self, table: Mapping[str, Array], o: Options) -> Array:
        """The inverse of the shortest natural time [rad/s]."""
        rates = [table["wall_stiffness"] * table["per_lateral_mass"]]
        rates += [
            (table["axial_stiffness"] + table["rock_stiffness"]) * table["per_axial_mass"],
            table["set_speed"] ** 2,
        ]
        if o.surface:
            rates += [np.square(surface.fastest(o.surface, table["per_spacing"], table["set_speed"]))]
        if o.driven:
            per_inertia = table["per_drive_inertia"]
            rates += [table["drive_stiffness"] * per_inertia, (table["drive_damping"] * per_inertia) ** 2]
        if o.drive:
            rates += [np.square(numbered(o.drive).fastest(table))]
        if o.motor:
            rates += motor.fastest(table, o.regulated)
        return np.asarray(np.sqrt(np.max(np.broadcast_arrays(*rates), axis=0)))

    def held(self, parameters: Parameters) -> tuple[str, ...]:
        """The states of frozen modes."""
        return tuple(
            name
            for mode, names in STATES_OF_MODE.items()
            if getattr(parameters.modes, mode) == "frozen"
            for name in names
        )

    def resting(self, parameters: Parameters, operation: History) -> Mapping[str, Array]:
        """A bit that does not move up and down follows the weight."""
        if "z" not in self.held(parameters) or parameters.bit.rock.regenerative:
            return {}
        return {"z": np.asarray(_carried(parameters, operation.wob))}

    # The start

    def steady(self, points: Values[Parameters]) -> Mapping[str, Numeric]:
        turning = super().steady(points)
        if points.parameters.bit.rock.regenerative:  # z is that above steady drilling
            return {**turning, "z": 0.0}
        k = derive(points.parameters, *points.operation)
        return {**turning, "z": resting_height(points.operation[1], k.k_a, points.parameters.bit.rock_stiffness)}

    def hanging(self, points: Values[Parameters]) -> float | None:
        return hanging(points.parameters, derive(points.parameters, *points.operation).k_a)

    def drawn(self, points: Values[Parameters], shape: Array) -> Mapping[str, Numeric]:
        """The states by name, from numbers ``shape`` [starts, 9] that are uniform in [0, 1):
        of x, y, vx, vy, z, vz, twist, bit speed and the angle of the drive. A drive that is
        not ideal begins with the set speed."""
        parameters, (depth, wob, speed), q = points.parameters, points.operation, points.initial.spread
        k = derive(parameters, depth, wob, speed)
        reach, fastest = reach_of_collar(k, speed, q)
        place, velocity = in_the_disc(shape[:, 0:2]), in_the_disc(shape[:, 2:4])
        return {
            "x": reach * place[:, 0],
            "y": reach * place[:, 1],
            "vx": fastest * velocity[:, 0],
            "vy": fastest * velocity[:, 1],
            **string_and_bit(parameters, k, wob, speed, q, *shape[:, 4:8].T),
            "drive_angle": 2 * math.pi * shape[:, 8],
            "lag": 0.0,
            "drive_speed": speed,
        }

    def complete_states(self, points: Values[Parameters], values: Mapping[str, Numeric]) -> Mapping[str, Numeric]:
        """All states from those of the start. Those of frozen modes replace it: there
        the bit carries the whole weight, and the pipe's spring none."""
        parameters, (_, wob, speed) = points.parameters, points.operation
        others: dict[str, Numeric] = {"motor_impulse": 0.0}
        frozen: dict[str, Numeric] = dict.fromkeys(self.held(parameters), 0.0)
        if parameters.bit.rock.regenerative:
            cut = cut_of(parameters, wob, points.operation[2])
            others |= surface.steady(cut.depth, options_of(parameters).surface)
        elif "z" in frozen:
            frozen["z"] = _carried(parameters, wob)
        if "bit_speed" in frozen:
            frozen["bit_speed"] = speed
        return super().complete_states(points, {**others, **values, **frozen})

    # What is observed

    def section_parts(self, parameters: Parameters, record: Record) -> int:
        lobed = record.section == "lobe" and not parameters.bit.rock.regenerative
        return parameters.bit.lobes if lobed else 1

    def derived(self, features: Mapping[str, Array], points: Values[Parameters]) -> dict[str, Array]:
        parameters, (_, wob, speed) = points.parameters, points.operation
        derived = super().derived(features, points)
        if parameters.bit.rock.regenerative:
            rate, turned = cut_of(parameters, wob, speed).rate, "drive_speed_mean"
            turned = turned if turned in features else "bit_speed_mean"
            derived |= on_surface.drilled(rate, parameters.well.diameter / 2, wob, features, turned)
        if points.parameters.modes.torsional == "frozen":  # the torque at the surface is not known
            derived["mechanical_specific_energy"] = np.full(len(derived["mechanical_specific_energy"]), np.nan)
        return derived

    def labels(self, features: Mapping[str, Array], response: Array, thresholds: Thresholds) -> dict[str, Array]:
        """Those of the collar; on the surface that the blades leave what takes a run beyond the
        model."""
        return super().labels(features, response, thresholds) | on_surface.labels(features, thresholds)

    def section(self, returns: Mapping[str, Array], table: Mapping[str, Array], o: Options) -> dict[str, Array]:
        # without those of a drive
        return observed.coordinates(np.stack([returns[name] for name in STATE_NAMES], axis=-1))


def _carried(parameters: Parameters, wob: Numeric) -> Numeric:
    """The height of a bit at rest that carries the whole weight [m]."""
    return -wob / parameters.bit.rock_stiffness
