"""The string with its drive in steady drilling, of a collar that is straight, from the
equations; and the lane parameters of both."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from nsdrill.equations.motion import Motion
from nsdrill.models import top
from nsdrill.models.base import moved
from nsdrill.models.beam.columns import as_lumped, columns_of, of_string, options_of, states_of
from nsdrill.models.beam.equations import equations
from nsdrill.models.beam.parameters import Initial, Parameters
from nsdrill.models.christoforou_yigit.coefficients import derive
from nsdrill.models.christoforou_yigit.drives import impedance
from nsdrill.models.drive_laws import Seen
from nsdrill.models.operation import Numeric, Values
from nsdrill.models.responses import Thresholds
from nsdrill.models.steady import String
from nsdrill.models.tree import with_values

# What has an effect on nothing but where a straight collar and its bit are.
STRAIGHT = {"surface_amplitude": 0.0, "rock_stiffness": 1.0}


def turning_string(parameters: Parameters, wob: Numeric, table: Callable[[Numeric], Mapping[str, Numeric]]) -> String:
    """String and drive in steady drilling under a weight on bit [N], with the lane
    parameters that ``table`` gives at set speeds [rad/s]."""
    options = options_of(parameters)._replace(modes=1, stations=1, unbalanced=0)  # none of them moves
    states = states_of(options)
    velocities = moved(states, len(top.others_of(options)))
    motion = Motion(equations, options, states, columns_of(options), velocities)
    return String(motion, top.turning(options), "set_speed", lambda speed: {**table(speed), **STRAIGHT}, {"z": -wob})


def below(parameters: Parameters, depth: Numeric) -> top.Below:
    """The string below the drive, to a depth [m]."""
    lumped = as_lumped(parameters)
    k = derive(lumped, depth, 0.0, 1.0)  # its inertia and stiffness at any weight and speed

    def string(kind: str, wob: Numeric, more: Mapping[str, Numeric]) -> String:
        one = with_values(parameters, {"drive.kind": kind})

        def table(speed: Numeric) -> Mapping[str, Numeric]:
            values = of_string(Values(one, Initial(), (depth, wob, speed)), Thresholds().stuck_below)
            return {**values, "per_inertia": 1.0 / k.J, **more}

        return turning_string(one, wob, table)

    seen = Seen(parameters.drive.inertia, k.J, k.k_t, impedance(lumped))
    return top.Below(parameters.drive, seen, string, {"per_inertia": 1.0})


def values_of(points: Values[Parameters], thresholds: Thresholds) -> Mapping[str, Numeric]:
    """The lane parameters by name, numbers or arrays over the points."""
    parameters, (depth, wob, speed) = points.parameters, points.operation
    values = of_string(points, thresholds.stuck_below)
    if parameters.drive.ideal:
        return values
    return {**below(parameters, depth).columns(parameters, wob, speed), **values}
