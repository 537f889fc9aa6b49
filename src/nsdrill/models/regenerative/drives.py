"""The string below the drive of a string on a drag bit, in steady drilling, from the equations;
and the lane parameters of both."""

from __future__ import annotations

from collections.abc import Mapping

from nsdrill.models import surface, top
from nsdrill.models.drive_laws import Seen
from nsdrill.models.operation import Numeric, Values
from nsdrill.models.regenerative import columns
from nsdrill.models.regenerative.equations import equations
from nsdrill.models.regenerative.parameters import Parameters
from nsdrill.models.responses import Thresholds
from nsdrill.models.steady import String


def turning_string(parameters: Parameters, wob: Numeric, table: top.Table) -> String:
    """String and drive in steady drilling under a weight on bit [N], with the lane
    parameters that ``table`` gives at set speeds [rad/s]."""
    o, depth = columns.options_of(parameters), columns.cut_of(parameters.bit, wob, 1.0).depth
    return top.steady_string(equations, o, columns.names_of(o), table, surface.steady(depth, o.surface))


def below(parameters: Parameters, depth: Numeric) -> top.Below:
    """The string below the drive, to a depth [m]."""
    string = parameters.drillstring
    whole = columns.string_of(string, depth)
    seen = Seen(parameters.drive.inertia, whole.inertia, whole.torsional, columns.impedance(string))
    return top.Below(parameters, depth, seen, columns.of_string, turning_string, {"per_inertia": 1.0})


def values_of(points: Values[Parameters], thresholds: Thresholds) -> Mapping[str, Numeric]:
    """The lane parameters by name, numbers or arrays over the points."""
    depth, wob, speed = points.operation
    return {**below(points.parameters, depth).columns(wob, speed), **columns.of_string(points, thresholds)}
