"""What is observed of the main model.

Values, slopes and second derivatives of what is no state are functions of the rows; the
interference, the torque and the radius are computed once a step, as they share terms
with the right-hand side.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import lru_cache
from types import FunctionType

import numpy as np

from nsdrill.compiler.functions import fma
from nsdrill.data import Array
from nsdrill.equations.graph import Graph, Node
from nsdrill.equations.library import Law, choose, flat
from nsdrill.equations.passes import Tangents, closed
from nsdrill.equations.plain import Rows, followed, followed_twice, function_of
from nsdrill.equations.stage import Stage
from nsdrill.equations.trace import Named
from nsdrill.models import on_surface
from nsdrill.models.christoforou_yigit.columns import Options, aux_of, columns_of, pairs_of, states_of
from nsdrill.models.christoforou_yigit.description import FEATURES as RECORDED
from nsdrill.models.christoforou_yigit.equations import bit_on_rock, loads_of_rock, multiple_sine
from nsdrill.models.friction import KeyedLaw, law_numbered, numbers_of, per_flat
from nsdrill.models.operation import Numeric
from nsdrill.models.own_drives import numbered
from nsdrill.models.turning import (
    PEAK_RATIO,
    STICK_SLIP_INDEX,
    STICK_SLIP_PERIOD,
    STUCK_FRACTION,
    SURFACE_TORQUES,
    TURN,
)
from nsdrill.observe.channels import (
    Channel,
    Declaration,
    Derived,
    Extremes,
    Feature,
    Mean,
    MeanAbove,
    Names,
    Outputs,
    TimeAbove,
    measured_by,
)

LEAST_HOLD = 1.0  # least c f', stage length over the time constant of friction, of a held bit
CREEP_RANGE = 20.0  # of eps |v|; at lower speeds friction has not reached its full size
REVOLUTION = 2.0 * math.pi
# The last bit of numpy's arctan2 differs between processors with and without AVX-512.
_arctan2 = np.vectorize(math.atan2, otypes=[float])
SLOPES = ("ax", "ay", "az", "alpha", "drive_acceleration", "motor_torque_rate")
OUTPUTS = (
    "interference",
    "interference_rate",
    "interference_curvature",
    "torque",
    "torque_rate",
    "r",
    "r_rate",
    "per_r",
)


def lobe(sine: Node, cosine: Node, lobes: int) -> tuple[Node, Node]:
    """(sin(lobes phi), its slope with phi) from sine and cosine of phi."""
    value = sine.graph.node(multiple_sine(sine, cosine, lobes))
    return value, Tangents(sine.graph, {sine: cosine, cosine: -sine}).of({"": value})[""]


def solved(stage: Stage, slips: Mapping[int, Node], steps: Mapping[int, Node]) -> dict[str, Node]:
    """What the observer reads of the bit where friction is solved for: the factors of
    its law on the last tangent of Newton's method, as the load is, the slope of the
    law, and by how much a load relaxes the bit speed."""
    place = next(k for k, contact in enumerate(stage.contact_of) if contact.name == "bit")
    contact, omega = stage.contact_of[place], slips[place]
    assert isinstance(contact.law, Law)
    direction, decay = contact.law.factors(omega, contact.numbers)
    factors = {"direction_now": stage.graph.node(direction), "decay_now": stage.graph.node(decay)}
    rates = Tangents(stage.graph, {omega: 1.0})
    changes = rates.of(factors | {"slope_now": contact.law(omega, contact.numbers)})
    return {
        **{name: node + changes[name] * steps[place] for name, node in factors.items()},
        "slope_now": changes["slope_now"],
        "bb_now": stage.relaxed[place, place] * stage.at_rest(place),
    }


@lru_cache
def names_of(options: Options) -> Names:
    """The names of the rows."""
    states = states_of(options)
    slopes = (*SLOPES[: len(pairs_of(options)) // 2], *on_surface.rates(options.surface))
    if options.drive:
        slopes += numbered(options.drive).slopes
    return Names(states, slopes, columns_of(options), aux_of(options))


ON_SURFACE = ("interference", "closing", "force", "force_rate", *OUTPUTS[3:])


def on_rock(n: Rows, lobes: int, law: KeyedLaw, torques: int = 0) -> tuple[Node, Node, Node, Node, Tangents]:
    """(sine and cosine of the bit's angle, interference and torque of bit and rock, as
    the equations have them, and how these change along the motion)."""
    sine, cosine, _, torque = map(n.graph.node, bit_on_rock(n.phase, n, n, lobes, law, torques))
    surface, slope = lobe(sine, cosine, lobes)
    rates = {surface: slope * n.bit_speed, slope: -(lobes**2) * n.bit_speed * surface}
    along = Tangents(n.graph, rates | {n.z: n.vz, n.vz: n.az, n.bit_speed: n.alpha})
    return sine, cosine, n.graph.gaps["rock"], torque, along


@lru_cache
def outputs_of(options: Options) -> FunctionType:
    """The function of the quantities that are computed once a step, with the values of
    the right-hand side."""
    n, law = Rows(Graph(with_slopes=True)), law_numbered(options.friction)
    known: dict[str, Node] = {}
    if options.surface:
        *bit, torque, torque_rate = on_surface.on_surface(n, options.surface, {n.vz: n.az, n.bit_speed: n.alpha})
    else:
        sine, cosine, interference, torque, along = on_rock(n, options.lobes, law, options.torques)
        closing, torque_rate = along.of({"": interference})[""], along.of({"": torque})[""]
        bit, known = [interference, closing, along.of({"": closing})[""]], {"sine_now": sine, "cosine_now": cosine}
    # One division serves two quotients: of the slope of the law, and by the radius.
    direction, weakened = law.factors(n.bit_speed, numbers_of(n, "bit", law))
    unit = flat(n.bit_speed, n.bit_smoothing)
    inverse = 1.0 / (unit * n.radius_now)
    per_r = unit * inverse
    if isinstance(weakened, Node):
        (torque_rate,) = n.graph.substituted([torque_rate], {per_flat(direction, unit): n.radius_now * inverse}, {})
    radius_rate = (n.x * n.vx + n.y * n.vy) * per_r
    found = (*bit, torque, torque_rate, n.radius_now, radius_rate, per_r)
    if isinstance(weakened, Node):  # of a law of a script nothing is shared
        known |= {"direction_now": direction, "decay_now": weakened}
    return function_of("outputs", found, known)


@lru_cache
def _torque_inside(friction: int, torques: int = 0) -> FunctionType:
    """The function of the torque of the rock and its rate inside a step; of a bit that
    comes to touch it the rate after that."""
    n = Rows(Graph(with_slopes=True))
    given = {"interference": n.interference, "closing": n.closing, "speed": n.speed, "acceleration": n.acceleration}
    torque = n.graph.node(loads_of_rock(n.interference, n.speed, n, law_numbered(friction), torques)[1])
    along = Tangents(n.graph, {n.interference: n.closing, n.speed: n.acceleration}, ("rock",))
    touches = choose((n.interference > 0.0) | (n.closing > 0.0), 1.0, 0.0)
    (rate,) = n.graph.substituted([along.of({"": torque})[""]], {getattr(n, closed("rock")): touches}, {})
    return function_of("torque", [torque, rate], given)


def _hold(bb_now, slope_now):
    return bb_now * slope_now - LEAST_HOLD


def _slowness(bit_smoothing, bit_speed):
    return CREEP_RANGE - abs(bit_smoothing * bit_speed)


def _bit_angle(twist, set_speed, time, phase):
    return twist + fma(set_speed, time, phase)


def _square(n: Named) -> Node:
    return n.x * n.x + n.y * n.y


def _rolling(n: Named) -> Node:
    """The tangential speed of the collar's centre around the hole [m/s]."""
    return (n.x * n.vy - n.y * n.vx) * n.per_r


def _pipe_twist(n: Named) -> Node:
    return n.twist - n.lag


def _rates(n: Named) -> dict[str, Node]:
    """How fast what these quantities read changes."""
    return {
        "x": n.vx,
        "vx": n.ax,
        "y": n.vy,
        "vy": n.ay,
        "per_r": -(n.per_r * (n.per_r * n.r_rate)),
        "twist": n.bit_speed,
        "bit_speed": n.alpha,
        "lag": n.drive_speed,
        "drive_speed": n.drive_acceleration,
    }


CHANNELS: tuple[Channel, ...] = (
    Channel("twist", "twist", "bit_speed", "alpha", frame="set_speed"),
    Channel("bit speed", "bit_speed", "alpha", rate_of="twist", level="stuck_below"),
    Channel("bit angle", _bit_angle, "bit_speed", "alpha"),
    Channel("bit position", "z", "vz", "az"),
    Channel("interference", "interference", "interference_rate", "interference_curvature", level=0.0, scale="z"),
    Channel("reach", *followed_twice(_square, _rates), level="gap", scale="gap", squared=True),
    Channel("radius", "r", "r_rate"),
    Channel("x", "x", "vx"),
    Channel("y", "y", "vy"),
    Channel("vx", "vx", "ax"),
    Channel("vy", "vy", "ay"),
    Channel("vz", "vz", "az"),
    Channel("rolling speed", *followed(_rolling, _rates)),
)


def _ratio(numerator: Numeric, denominator: Numeric) -> Numeric:
    with np.errstate(divide="ignore", invalid="ignore"):
        return numerator / denominator


def _least_amplitude(surface_amplitude: Array) -> Numeric:
    return np.maximum(surface_amplitude, 1e-6)


# Derived features that the elastic collar has as well.
SHARED: tuple[Derived, ...] = (
    # without a weight on bit it is off bottom, where nothing lifts it off
    Derived("lift_off_fraction", lambda on_rock, wob: np.where(wob > 0.0, 1.0 - on_rock, 0.0)),
    Derived(
        "bit_force_max", lambda rock_stiffness, interference_max: rock_stiffness * np.maximum(interference_max, 0.0)
    ),
    *SURFACE_TORQUES,
)
FEATURES: tuple[Feature, ...] = (
    Extremes("bit position", "axial_max", "axial_min", "axial_peaks", smooth=True, compared=_least_amplitude),
    Extremes("twist", "twist_max", "twist_min", smooth=True, compared=None),
    Extremes("interference", "interference_max", maxima=True, smooth=True, compared=None),
    Extremes("reach", "radius_max", peaks="radius_peaks", maxima=True, smooth=True, compared="gap"),
    TimeAbove("bit speed", "unstuck"),
    TimeAbove("interference", "on_rock"),
    Mean("twist", "twist_mean"),
    MeanAbove("rolling speed", "wall_contact_fraction", "rolled"),
    MeanAbove("bit speed", "wall_contact_fraction", "rotated"),
    STICK_SLIP_INDEX,
    STUCK_FRACTION,
    STICK_SLIP_PERIOD,
    PEAK_RATIO,
    Derived("whirl_ratio", lambda whirl_speed_mean, bit_speed_mean: _ratio(whirl_speed_mean, bit_speed_mean)),
    Derived(
        "rolling_ratio",
        lambda rolled, rotated, collar_radius: np.where(rotated != 0.0, _ratio(-rolled, rotated * collar_radius), 0.0),
    ),
    *SHARED,
)


def wall_force(hertz: int, stiffness: Numeric, penetration: Numeric) -> Numeric:
    """The force of the wall [N] at these penetrations [m], 0 where they are negative."""
    depth = np.maximum(penetration, 0.0)
    # as in the right-hand side; the bits of numpy's power depend on the processor
    return stiffness * depth * (np.sqrt(depth) if hertz else 1.0)


def _wall_force_max(hertz: int) -> Callable[..., Numeric]:
    return lambda wall_stiffness, gap, radius_max: wall_force(hertz, wall_stiffness, radius_max - gap)


# Of a bit on the surface that it leaves, in place of those that lobes have.
CHANNELS_ON_SURFACE = (
    *(channel for channel in CHANNELS if channel.name != "interference"),
    *on_surface.CHANNELS,
    Channel("bit torque", "torque", "torque_rate", scale=1.0),
)
FEATURES_ON_SURFACE: tuple[Feature, ...] = (
    Extremes("bit position", "axial_max", "axial_min", "axial_peaks", smooth=True, compared=None),
    *(
        feature
        for feature in FEATURES
        if not (isinstance(feature, Extremes) and feature.channel in ("bit position", "interference"))
        and not (isinstance(feature, Derived) and feature.name == "bit_force_max")
    ),
    *on_surface.axial_velocity("vz"),
    *on_surface.FEATURES,
)


@lru_cache
def declaration_of(options: Options) -> Declaration:
    """The declaration of a string with these options."""
    implicit = options.implicit
    channels, features = (CHANNELS_ON_SURFACE, FEATURES_ON_SURFACE) if options.surface else (CHANNELS, FEATURES)
    if options.driven:  # the twist of the pipe gives the torque at the surface
        pipe = Channel("pipe twist", *followed_twice(_pipe_twist, _rates), scale=0.1)
        channels += (
            pipe,
            Channel("lag", "lag", "drive_speed", "drive_acceleration", frame="set_speed"),
            Channel("drive speed", "drive_speed", "drive_acceleration", rate_of="lag"),
        )
        features = tuple(
            replace(feature, channel="pipe twist")
            if isinstance(feature, Extremes | Mean) and feature.channel == "twist"
            else feature
            for feature in features
        )
        features += (Extremes("drive speed", "drive_speed_max", "drive_speed_min", smooth=True, compared=None),)
    if options.weight:  # a vertical hole has no low side
        features += (Mean("x", "x_sum"), Mean("y", "y_sum"))
        features += (
            Derived("x_mean", lambda weight, x_sum: np.where(weight > 0.0, x_sum, np.nan)),
            Derived("y_mean", lambda weight, y_sum: np.where(weight > 0.0, y_sum, np.nan)),
        )
    # Friction holds the bit at the end of a step that is much longer than the time
    # constant of friction. The acceleration jumps inside such a step, so its polynomial
    # undershoots; and the bit creeps, so the sign of the acceleration is that of
    # rounding. The torque of a bit that is held during the whole step balances that of
    # the string and has no maximum inside.
    bit_speed = Extremes(
        "bit speed",
        "bit_speed_max",
        "bit_speed_min",
        "bit_speed_peaks",
        slip="set_speed",
        smooth=not implicit,
        unless=(None, _hold) if implicit else None,
        compared="set_speed",
    )
    torque = Extremes(
        "bit torque",
        "bit_torque_max",
        maxima=True,
        smooth=True,
        unless=(_slowness, _hold) if implicit else None,
        compared=None,
    )
    present = {"drive_speed": options.driven, "stabilizers": options.stabilizer, "inclined": options.weight}
    if not options.surface:
        channels += (
            Channel(
                "bit torque",
                "torque",
                "torque_rate",
                scale=1.0,
                of=("interference", "bit speed"),
                inside=_torque_inside(options.friction, options.torques),
            ),
        )
    recorded = measured_by(RECORDED, features, [word for word, is_present in present.items() if is_present])
    return Declaration(
        channels=channels,
        features=(bit_speed, torque, *features, *recorded, Derived("wall_force_max", _wall_force_max(options.hertz))),
        outputs=Outputs(ON_SURFACE if options.surface else OUTPUTS, outputs_of(options)),
        section=TURN,
    )


# The Poincare section in polar coordinates.
def coordinates(returns: Array) -> dict[str, Array]:
    """The variables of the section from returns (..., 9), the eight states and
    the bit angle, in polar coordinates
    with the whirl angle measured from the bit angle."""
    x, vx, y, vy, z, vz, twist, speed, angle = np.moveaxis(returns, -1, 0)
    r = np.sqrt(x * x + y * y)
    divisor = np.where(r > 0.0, r, 1.0)
    relative = _arctan2(y, x) - angle
    return {
        "section_radius": r,
        "section_radial_velocity": (x * vx + y * vy) / divisor,
        "section_whirl_angle": relative - REVOLUTION * np.round(relative / REVOLUTION),
        "section_whirl_speed": (x * vy - y * vx) / (divisor * divisor),
        "section_axial": z,
        "section_axial_velocity": vz,
        "section_twist": twist,
        "section_bit_speed": speed,
    }


def in_the_bit_frame(section: Mapping[str, Array]) -> Array:
    """The states at the section in the frame that rotates with the bit, shape (...,
    returns, 8), in the order of the states.

    A motion that repeats after some revolutions repeats in this frame, whatever the
    number of lobes and the drive angle.
    """
    r, angle = section["section_radius"], section["section_whirl_angle"]
    v_radial, v_tangential = section["section_radial_velocity"], r * section["section_whirl_speed"]
    c, s = np.cos(angle), np.sin(angle)
    return np.stack(
        [
            r * c,
            v_radial * c - v_tangential * s,
            r * s,
            v_radial * s + v_tangential * c,
            section["section_axial"],
            section["section_axial_velocity"],
            section["section_twist"],
            section["section_bit_speed"],
        ],
        axis=-1,
    )
