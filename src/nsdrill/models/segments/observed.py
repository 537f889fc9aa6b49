"""What is observed of the string of segments."""

from __future__ import annotations

import math
from functools import lru_cache
from types import FunctionType

import numpy as np

from nsdrill.equations.graph import Graph, Node
from nsdrill.equations.passes import Tangents
from nsdrill.equations.plain import Rows, followed, function_of
from nsdrill.equations.trace import Named, part
from nsdrill.models.own_drives import numbered
from nsdrill.models.segments.equations import change_of_hook_load, drive_torque, torque_at_surface
from nsdrill.models.segments.rock import bit_on_rock
from nsdrill.models.turning import turning_channels, turning_features
from nsdrill.observe.channels import Channel, Declaration, Derived, Extremes, Mean, Outputs, Section, TimeAbove


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
    torque, _ = drive_torque(n, n, drive)
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


def _declaration(drive: tuple[Channel, Extremes]) -> Declaration:
    """The declaration with this channel of the drive, and its extremes."""
    return Declaration(
        outputs=Outputs(("interference", "closing", "closing_rate", "force", "force_rate"), _outputs()),
        channels=(
            Channel("bit position", "z", "vz", "bit_axial_acceleration"),
            Channel("interference", "interference", "closing", "closing_rate", level=0.0),
            *turning_channels(
                "set_speed", "stuck", lambda twist, set_speed, time, phase: twist + (phase + set_speed * time)
            ),
            Channel("force", "force", "force_rate", scale="wob"),
            Channel("surface torque", *followed(lambda n: torque_at_surface(n, n), _rates), scale="steady_torque"),
            Channel("drive speed", "drive_speed", "drive_acceleration"),
            drive[0],
            Channel("hook load", *followed(lambda n: change_of_hook_load(n, n), _rates), scale="wob"),
        ),
        features=(
            Extremes("bit position", greatest="axial_max", least="axial_min", peaks="axial_peaks"),
            TimeAbove("interference", "touching"),
            # without a weight on bit it is off bottom, where nothing lifts it off
            Derived("lift_off_fraction", lambda touching, wob: np.where(wob > 0.0, 1.0 - touching, 0.0)),
            *turning_features("set_speed"),
            Extremes("force", greatest="bit_force_max"),
            Extremes("surface torque", greatest="surface_torque_max", least="surface_torque_min"),
            Mean("surface torque", "surface_torque_mean"),
            Extremes("drive speed", greatest="drive_speed_max", least="drive_speed_min"),
            Mean("drive speed", "drive_speed_mean"),
            drive[1],
            Extremes("hook load", greatest="hook_load_change_max", least="hook_load_change_min"),
        ),
        section=Section("bit angle", 2.0 * math.pi),
    )


DECLARATION = _declaration(
    (Channel("current", "current", "current_rate"), Extremes("current", greatest="current_max", least="current_min"))
)


@lru_cache
def by_torque(drive: int) -> Declaration:
    """The declaration with a drive by torque, that of a script with this number unless it
    is 0; with as many channels of the same kinds, so that outcomes have the same
    columns."""
    own = dict(zip(numbered(drive).rows, numbered(drive).slopes, strict=True)) if drive else {}

    def rates(n: Named) -> dict[str, Node]:
        return _rates(n) | {row: getattr(n, rate) for row, rate in own.items()}

    return _declaration(
        (
            Channel("drive torque", *followed(lambda n: _motor_torque(n, drive), rates), scale="steady_torque"),
            Extremes("drive torque", greatest="drive_torque_max", least="drive_torque_min"),
        )
    )
