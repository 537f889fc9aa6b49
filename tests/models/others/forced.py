"""A Duffing oscillator: a mass on a spring with two rest positions under a periodic force.
Its operating point is the force and the ratio of its frequency to that of the spring; it
has no other words of its own."""

from dataclasses import dataclass, field

import numpy as np

from nsdrill.equations.library import sincos
from nsdrill.models.base import Model
from nsdrill.models.model_description import Description, Drawn, Panel
from nsdrill.models.operation import ModelParameters, OperatingPoint
from nsdrill.models.starts import Starts, state
from nsdrill.observe.channels import Channel, Declaration, Extremes, Mean, Section
from nsdrill.ranges import Checked, parameter
from nsdrill.variables import at_section, feature, in_trace, last_peaks


@dataclass(frozen=True)
class Forcing(OperatingPoint):
    force: float = parameter(0.3, "N", high=100.0, meaning="Amplitude of the force")
    ratio: float = parameter(1.2, low=1e-3, high=100.0, meaning="Frequency ratio")


@dataclass(frozen=True)
class Oscillator(Checked):
    damping: float = parameter(0.15, "N s/m", high=100.0, meaning="Viscous damping")
    cubic: float = parameter(1.0, high=100.0, meaning="Cubic stiffness in N/m^3")


@dataclass(frozen=True)
class Parameters(ModelParameters):
    point = Forcing
    oscillator: Oscillator = field(default_factory=Oscillator)


@dataclass(frozen=True)
class Initial(Starts):
    place: float = state(0.1, "m", 1e3, "any", "Place of the mass")
    pace: float = state(0.0, "m/s", 1e3, "any", "Velocity of the mass")
    drive_angle: float = state(0.0, "rad", 1e9, "any", "Phase of the force")


def angle(phase, time, forcing):
    return phase + forcing * time


DECLARATION = Declaration(
    channels=(
        Channel("place", "place", "pace", "pace_rate"),
        Channel("pace", "pace", "pace_rate", rate_of="place"),
        Channel("angle", angle, "forcing", 0.0),
    ),
    features=(
        Extremes("place", greatest="place_max", least="place_min", peaks="place_peaks"),
        Mean("place", "place_mean"),
        Extremes("pace", greatest="pace_max", least="pace_min"),
    ),
    section=Section("angle", 2.0 * np.pi),
)


def equations(t, phase, s, p, o):
    _, cosine = sincos(phase + p.forcing * t)
    return {"pace": p.force * cosine - p.damping * s.pace + s.place - p.cubic * s.place**3}


class Forced(Model):
    name = "forced"
    equations = staticmethod(equations)
    declared = DECLARATION
    set_speed = "forcing"

    def columns(self, points, thresholds):
        (force, ratio), own = points.operation, points.parameters.oscillator
        return {"damping": own.damping, "cubic": own.cubic, "force": force, "forcing": ratio}

    def natural_scales(self, table, o):
        return 0.1, 0.1

    def drawn(self, points, shape):
        q = points.initial.spread
        return {
            "place": 2.0 * q * (2.0 * shape[:, 0] - 1.0),
            "pace": 2.0 * q * (2.0 * shape[:, 1] - 1.0),
            "drive_angle": 0.0 * shape[:, 2],
        }

    def still(self, features, state_scales, absolute):
        return features["place_max"] - features["place_min"] <= absolute * state_scales[..., 0]

    def scales(self, table):
        return {"size": np.ones(len(table))}


MODEL = Forced
DESCRIPTION = Description(
    name="forced",
    title="Duffing's oscillator",
    parameters=Parameters,
    initial=Initial,
    meanings={"oscillator": "The oscillator"},
    features=(
        feature("place_max", "m", "greatest place"),
        feature("place_min", "m", "least place"),
        feature("place_mean", "m", "mean place"),
        feature("pace_max", "m s-1", "greatest velocity"),
        feature("pace_min", "m s-1", "least velocity"),
    ),
    peaks=(last_peaks("place_peaks", "m", "last local maxima of the place"),),
    section=(at_section("place", "m", "place"), at_section("pace", "m s-1", "velocity")),
    own_trace=(in_trace("place", "m", "place of the mass"), in_trace("pace", "m s-1", "velocity of the mass")),
    shown=("place_max", "place_mean"),
    compared={"place_max": "size", "place_min": "size", "place_mean": "size"},
    distinguishing=("place_mean", "place_max"),
    drawn=Drawn(
        panels=(Panel("place", "place", "place_peaks", "place_max"),),
        histories=("place", "pace"),
        planes=(("place", "pace"),),
        section=("section_place", "section_pace"),
        section_planes=(("section_place", "section_pace"),),
        summary=("place_max", "place_mean"),
        attractors=(("place_min", "place_max", "place"),),
        speed="",
        radius="",
        angle=(),
    ),
)
