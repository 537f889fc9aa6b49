"""What is observed of the string of segments."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from types import FunctionType

import numpy as np

from nsdrill.equations.graph import Graph, Node
from nsdrill.equations.passes import Tangents
from nsdrill.equations.plain import Rows, followed, function_of
from nsdrill.equations.trace import Named, part
from nsdrill.models import on_surface
from nsdrill.models.own_drives import numbered
from nsdrill.models.segments.equations import change_of_hook_load, torque_at_surface, torque_by_law
from nsdrill.models.segments.rock import bit_on_rock
from nsdrill.models.turning import TURN, turning_channels, turning_features
from nsdrill.observe.channels import Channel, Declaration, Derived, Extremes, Feature, Mean, Outputs, TimeAbove


def _outputs_on_surface(count: int) -> FunctionType:
    """The function of the interference of blade and rock [m] with its rate, and of the
    force of the rock [N] with its rate."""
    n = Rows(Graph())
    accelerations = {n.vz: n.bit_axial_acceleration, n.bit_speed: n.bit_acceleration}
    return function_of("outputs", on_surface.on_surface(n, count, accelerations)[:4])


def _outputs() -> FunctionType:
    """The function of the interference of bit and rock [m], its rate and second
    derivative; the force [N] and its rate: with the values of the right-hand side."""
    n = Rows(Graph())
    sine, cosine, interference, closing, force, _ = map(n.graph.node, bit_on_rock(n.phase, n, n))
    turning = n.lobes * n.bit_speed
    rates = {sine: cosine * turning, cosine: -(sine * turning), n.z: n.vz}
    rates |= {n.vz: n.bit_axial_acceleration, n.bit_speed: n.bit_acceleration}
    changes = Tangents(n.graph, rates).of({"closing": closing, "force": force})
    known = {"sine_": sine, "cosine_": cosine, "interference_": interference, "closing_": closing, "force_": force}
    return function_of("outputs", [interference, closing, changes["closing"], force, changes["force"]], known)


@part
def _motor_torque(n: Named, drive: int) -> Node:
    """The torque of the motor [N m]; while the top keeps the set speed, the torque that
    this takes."""
    torque, _ = torque_by_law(n, n, drive)
    return torque if n.time >= n.on_at else torque_at_surface(n, n) + n.top_drag * n.drive_speed


def _rates(n: Named) -> dict[str, Node]:
    """How fast what these quantities read changes."""
    return {
        "lag": n.drive_speed - n.set_speed,
        "angle_1": n.speed_1 - n.set_speed,
        "twist": n.bit_speed - n.set_speed,
        "drive_speed": n.drive_acceleration,
        "speed_1": n.angular_acceleration_1,
        "bit_speed": n.bit_acceleration,
        "u_0": n.v_0,
        "v_0": n.top_acceleration,
    }


# Of the top; as many channels and features of a motor as of a drive by torque, so that
# outcomes have the same columns.
MOTOR = Channel("current", "current", "current_rate"), Extremes("current", greatest="current_max", least="current_min")
POSITION = Channel("bit position", "z", "vz", "bit_axial_acceleration")
TURNING = turning_channels()
LOBED = (
    (POSITION, Channel("interference", "interference", "closing", "closing_rate", level=0.0)),
    (Channel("force", "force", "force_rate", scale="wob"),),
)
ON_SURFACE = (
    (POSITION, Channel("axial velocity", "vz", "bit_axial_acceleration", rate_of="bit position")),
    on_surface.CHANNELS,
)


def _by_torque(drive: int) -> tuple[Channel, Extremes]:
    """That of a drive by torque, that of a script with this number unless it is 0."""
    own = dict(zip(numbered(drive).rows, numbered(drive).slopes, strict=True)) if drive else {}

    def rates(n: Named) -> dict[str, Node]:
        return _rates(n) | {row: getattr(n, rate) for row, rate in own.items()}

    return (
        Channel("drive torque", *followed(lambda n: _motor_torque(n, drive), rates), scale="steady_torque"),
        Extremes("drive torque", greatest="drive_torque_max", least="drive_torque_min"),
    )


@lru_cache
def declaration_of(by_torque: int, count: int, drive: int) -> Declaration:
    """The declaration of a string with a drive by torque or a motor, with so many states of
    the surface that the blades leave, 0 on a lobed rock, and with the ``drive`` of a script
    with this number, 0 for another."""
    (channel, extremes), (first, second) = _by_torque(drive) if by_torque else MOTOR, ON_SURFACE if count else LOBED
    names = ("interference", "closing", "closing_rate", "force", "force_rate")
    outputs = Outputs(names, _outputs())
    position = Extremes("bit position", greatest="axial_max", least="axial_min", peaks="axial_peaks")
    force: tuple[Feature, ...] = (Extremes("force", greatest="bit_force_max"),)
    if count:
        outputs = Outputs(tuple(name for name in names if name != "closing_rate"), _outputs_on_surface(count))
        position, force = replace(position, compared=None), ()
    return Declaration(
        outputs=outputs,
        channels=(
            *first,
            *TURNING,
            *second,
            Channel("surface torque", *followed(lambda n: torque_at_surface(n, n), _rates), scale="steady_torque"),
            Channel("drive speed", "drive_speed", "drive_acceleration"),
            channel,
            Channel("hook load", *followed(lambda n: change_of_hook_load(n, n), _rates), scale="wob"),
        ),
        features=(
            position,
            TimeAbove("interference", "touching"),
            # without a weight on bit it is off bottom, where nothing lifts it off
            Derived("lift_off_fraction", lambda touching, wob: np.where(wob > 0.0, 1.0 - touching, 0.0)),
            *turning_features(),
            *force,
            Extremes("surface torque", greatest="surface_torque_max", least="surface_torque_min"),
            Mean("surface torque", "surface_torque_mean"),
            Extremes("drive speed", greatest="drive_speed_max", least="drive_speed_min"),
            Mean("drive speed", "drive_speed_mean"),
            extremes,
            Extremes("hook load", greatest="hook_load_change_max", least="hook_load_change_min"),
            *((*on_surface.axial_velocity("axial velocity"), *on_surface.FEATURES) if count else ()),
        ),
        section=TURN,
    )
