"""The string with its drive in steady drilling, of a collar that is straight, from the
equations; and the lane parameters of both."""

from __future__ import annotations

from collections.abc import Mapping

from nsdrill.models import top
from nsdrill.models.beam.columns import as_lumped, names_of, of_string, options_of
from nsdrill.models.beam.equations import equations
from nsdrill.models.beam.parameters import Parameters
from nsdrill.models.christoforou_yigit.coefficients import derive
from nsdrill.models.christoforou_yigit.drives import impedance
from nsdrill.models.drive_laws import Seen
from nsdrill.models.operation import Numeric, Values
from nsdrill.models.responses import Thresholds
from nsdrill.models.steady import String

# What has an effect on nothing but where a straight collar and its bit are.
STRAIGHT = {"surface_amplitude": 0.0, "rock_stiffness": 1.0}


def turning_string(parameters: Parameters, wob: Numeric, table: top.Table) -> String:
    """String and drive in steady drilling under a weight on bit [N], with the lane
    parameters that ``table`` gives at set speeds [rad/s]."""
    o = options_of(parameters)._replace(modes=1, stations=1, unbalanced=0)  # none of them moves
    return top.steady_string(equations, o, names_of(o), lambda speed: {**table(speed), **STRAIGHT}, {"z": -wob})


def below(parameters: Parameters, depth: Numeric) -> top.Below:
    """The string below the drive, to a depth [m]."""
    lumped = as_lumped(parameters)
    k = derive(lumped, depth, 0.0, 1.0)  # its inertia and stiffness at any weight and speed
    seen = Seen(parameters.drive.inertia, k.J, k.k_t, impedance(lumped))

    def straight(points: Values[Parameters], thresholds: Thresholds) -> Mapping[str, Numeric]:
        return {**of_string(points, thresholds), "per_inertia": 1.0 / k.J}

    return top.Below(parameters, depth, seen, straight, turning_string, {"per_inertia": 1.0})


def values_of(points: Values[Parameters], thresholds: Thresholds) -> Mapping[str, Numeric]:
    """The lane parameters by name, numbers or arrays over the points."""
    parameters, (depth, wob, speed) = points.parameters, points.operation
    values = of_string(points, thresholds)
    if parameters.drive.ideal:
        return values
    return {**below(parameters, depth).columns(wob, speed), **values}
