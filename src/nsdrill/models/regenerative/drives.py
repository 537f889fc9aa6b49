"""The string below the drive of a string on a drag bit, in steady drilling, from the equations;
and the lane parameters of both."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from nsdrill.equations.motion import Motion
from nsdrill.models import surface, top
from nsdrill.models.drive_laws import Seen
from nsdrill.models.operation import Numeric, Values
from nsdrill.models.regenerative import columns
from nsdrill.models.regenerative.equations import equations
from nsdrill.models.regenerative.parameters import Initial, Parameters
from nsdrill.models.responses import Thresholds
from nsdrill.models.steady import String
from nsdrill.models.top import Below
from nsdrill.models.tree import with_values

Table = Callable[[Numeric], Mapping[str, Numeric]]


def turning_string(parameters: Parameters, wob: Numeric, table: Table) -> String:
    """String and drive in steady drilling under a weight on bit [N], with the lane
    parameters that ``table`` gives at set speeds [rad/s]."""
    options = columns.options_of(parameters)
    names, others = columns.names_of(options), top.others_of(options)
    pairs = len(names.states) - options.surface - len(others)
    velocities = (*names.states[1:pairs:2], *names.states[pairs:])
    depth = columns.cut_of(parameters.bit, wob, 1.0).depth
    motion = Motion(equations, options, names.states, names.parameters, velocities)
    return String(motion, top.turning(options), "set_speed", table, surface.steady(depth, options.surface))


def below(parameters: Parameters, depth: Numeric) -> Below:
    """The string below the drive, to a depth [m]."""
    drive, whole = parameters.drive, columns.string_of(parameters.drillstring, depth)

    def string(kind: str, wob: Numeric, more: Mapping[str, Numeric]) -> String:
        one = with_values(parameters, {"drive.kind": kind})
        return turning_string(
            one,
            wob,
            lambda speed: columns.of_string(Values(one, Initial(), (depth, wob, speed)), Thresholds()) | dict(more),
        )

    seen = Seen(drive.inertia, whole.inertia, whole.torsional, columns.impedance(parameters.drillstring))
    return Below(drive, seen, string, {"per_inertia": 1.0})


def values_of(points: Values[Parameters], thresholds: Thresholds) -> Mapping[str, Numeric]:
    """The lane parameters by name, numbers or arrays over the points."""
    parameters, (depth, wob, speed) = points.parameters, points.operation
    of_drive = below(parameters, depth).columns(parameters, wob, speed)
    return {**of_drive, **columns.of_string(points, thresholds)}
