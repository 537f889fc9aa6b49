"""The drives of a string on a drag bit: the law of the controller
(:mod:`nsdrill.models.drives`) for this string, the regulator and the circuit of a DC motor
(:mod:`nsdrill.models.motor`); the lane parameters of string and drive; and both in steady
drilling, from the equations."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from nsdrill.equations.motion import Motion
from nsdrill.models import motor, surface
from nsdrill.models.drives import LAWS, Circuit, Gains, Seen, columns_of_law
from nsdrill.models.leaves import lane_values, with_values
from nsdrill.models.operation import Numeric, Values
from nsdrill.models.regenerative import columns
from nsdrill.models.regenerative.equations import equations
from nsdrill.models.regenerative.parameters import Initial, Parameters
from nsdrill.models.responses import Thresholds
from nsdrill.models.steady import String, Turning

Table = Callable[[Numeric], Mapping[str, Numeric]]


def turning_string(parameters: Parameters, wob: Numeric, table: Table) -> String:
    """String and drive in steady drilling under a weight on bit [N], with the lane
    parameters that ``table`` gives at set speeds [rad/s]."""
    options = columns.options_of(parameters)
    names, driven, others = columns.names_of(options), options.driven, columns.others_of(options)
    pairs = len(names.states) - options.surface - len(others)
    velocities = (*names.states[1:pairs:2], *names.states[pairs:])
    turning = Turning(
        ("lag", "twist") if driven else ("twist",), ("drive_speed", "bit_speed") if driven else ("bit_speed",), others
    )
    depth = columns.cut_of(parameters.bit, wob, 1.0).depth
    motion = Motion(equations, options, names.states, names.parameters, velocities)
    return String(motion, turning, "set_speed", table, surface.steady(depth, options.surface))


def law_of(parameters: Parameters, depth: Numeric, speed: Numeric = 0.0) -> Gains:
    """The law of a drive that is not ideal, at a depth [m]; that of an LQR is tuned to the
    string at this rotary speed [rad/s]. InputError where an LQR has no gains."""
    drive, whole = parameters.drive, columns.string_of(parameters.drillstring, depth)
    if drive.kind == "lqr":
        law = _lqr(parameters, depth, speed)
    elif drive.kind in LAWS:
        seen = Seen(drive.inertia, whole.inertia, whole.torsional, columns.impedance(parameters.drillstring))
        law = LAWS[drive.kind].gains(drive, seen)
    else:
        law = Gains(drive.top_inertia, 0.0, 0.0)  # the torque is a state, or that of a script
    return law._replace(shaft_damping=drive.shaft_damping)


def _lqr(parameters: Parameters, depth: Numeric, speed: Numeric) -> Gains:
    """The gains of the regulator: the drive of its string has no torque, and nothing rubs at
    the bit, which bears no weight."""
    drive, whole = parameters.drive, columns.string_of(parameters.drillstring, depth)
    free = with_values(parameters, {"drive.kind": "pi"})
    without = Gains(drive.inertia, 0.0, 0.0, shaft_damping=drive.shaft_damping)

    def table(speed: Numeric) -> Mapping[str, Numeric]:
        return _of_string(free, depth, 0.0, speed) | _of_law(without, None)

    return motor.optimal(drive, whole.inertia, whole.torsional, turning_string(free, 0.0, table), speed)


def regulator(parameters: Parameters, depth: Numeric, wob: Numeric, speed: Numeric) -> motor.Regulator:
    """The law of the voltage of a DC motor with gains, at an operating point."""
    alone = with_values(parameters, {"drive.kind": "ideal"})

    def table(speed: Numeric) -> Mapping[str, Numeric]:
        return _of_string(alone, depth, wob, speed) | {"per_inertia": 1.0}

    return motor.regulator(parameters.drive, turning_string(alone, wob, table), speed)


def circuit_of(parameters: Parameters, depth: Numeric) -> Circuit | None:
    """The circuit of a DC motor, with its gains if it has any; None for other drives."""
    if parameters.drive.kind != "dc_motor":
        return None
    return motor.circuit(parameters.drive, regulator(parameters, depth, 0.0, 1.0))  # at any speed


def _of_string(parameters: Parameters, depth: Numeric, wob: Numeric, speed: Numeric) -> dict[str, Numeric]:
    return columns.of_string(Values(parameters, Initial(), (depth, wob, speed)), Thresholds())


def _of_law(law: Gains, limit: Numeric | None) -> dict[str, Numeric]:
    """The lane parameters of a drive with this law and limit [N m]."""
    inertia = {"per_drive_inertia": 1.0 / law.inertia, "shaft_damping": law.shaft_damping}
    return {**inertia, **columns_of_law(law, limit)}


def values_of(points: Values[Parameters], thresholds: Thresholds) -> Mapping[str, Numeric]:
    """The lane parameters by name, numbers or arrays over the points."""
    parameters, (depth, wob, speed) = points.parameters, points.operation
    values, drive = columns.of_string(points, thresholds), parameters.drive
    if drive.ideal:
        return values
    limit = drive.torque_limit if drive.limited else None
    values |= _of_law(law_of(parameters, depth, speed), limit)
    if drive.kind == "dc_motor":
        values |= motor.motor_columns(drive)
    if drive.regulated:
        values |= motor.regulator_columns(regulator(parameters, depth, wob, speed))
    return {**lane_values(parameters), **values}
