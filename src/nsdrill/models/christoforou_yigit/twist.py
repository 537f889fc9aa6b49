"""The string of the main model where it only turns: the collar centred, the bit pressed
on the rock by the weight on it. Its equations are those of the model, with the other
modes frozen."""

from __future__ import annotations

from nsdrill.equations.motion import Motion
from nsdrill.models import surface, top
from nsdrill.models.christoforou_yigit.coefficients import cut_of
from nsdrill.models.christoforou_yigit.columns import columns_of, options_of, pairs_of, states_of
from nsdrill.models.christoforou_yigit.equations import equations
from nsdrill.models.christoforou_yigit.parameters import Parameters
from nsdrill.models.operation import Numeric
from nsdrill.models.steady import String
from nsdrill.models.tree import with_values

# Without further forces on the collar, and with the modes that do not turn frozen. Numbers
# that then affect nothing are set as well, so that what is known of one string is known of
# all that turn like it.
ALONE = {
    "modes.axial": "frozen",
    "modes.torsional": "free",
    "modes.lateral": "frozen",
    "mud.added_mass": 1.0,
    "mud.drag": 0.0,
    "mud.swirl": 0.0,
    "bit.rock_stiffness": 1.0,
    "well.inclination": 0.0,
    "well.axial_friction": False,
    "stabilizer.clearance": None,
    "drillstring.eccentricity": 0.0,
}


def that_only_turns(parameters: Parameters) -> Parameters:
    """These parameters, of a string that only turns."""
    return with_values(parameters, ALONE)


def turning_string(parameters: Parameters, wob: Numeric, table: top.Table) -> String:
    """A string that only turns with its drive, which has no limit, under a weight on
    bit [N], with the lane parameters that ``table`` gives at set speeds [rad/s]. The
    rock has a stiffness of 1 N/m, which affects nothing but where the bit is."""
    options = options_of(parameters)._replace(limited=0)
    states = states_of(options)
    pairs = pairs_of(options)
    velocities = (*pairs[1::2], *states[len(pairs) :])
    motion = Motion(equations, options, states, columns_of(options), velocities)
    if options.surface:
        rest = {"z": 0.0, **surface.steady(cut_of(parameters, wob, 1.0).depth, options.surface)}
        return String(motion, top.turning(options), "set_speed", table, rest)
    soft = lambda speed: {**table(speed), "rock_stiffness": 1.0}  # noqa: E731
    return String(motion, top.turning(options), "set_speed", soft, {"z": -1.0 * wob})
