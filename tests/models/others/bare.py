"""Van der Pol's oscillator, whose numbers have no units: a model without an operating
point and without a section. The names of its rows, its first step and its symmetry follow
from its start, its lane parameters and its equations."""

from dataclasses import dataclass, field

import numpy as np

from nsdrill.models.base import Model
from nsdrill.models.model_description import Description, Drawn, Panel
from nsdrill.models.operation import ModelParameters
from nsdrill.models.starts import Starts, state
from nsdrill.observe.channels import Channel, Declaration, Extremes
from nsdrill.ranges import Checked, parameter
from nsdrill.variables import feature, in_trace, last_peaks


@dataclass(frozen=True)
class Own(Checked):
    mu: float = parameter(1.0, high=20.0, meaning="Strength of the damping")


@dataclass(frozen=True)
class Parameters(ModelParameters):
    parameters: Own = field(default_factory=Own)


@dataclass(frozen=True)
class Initial(Starts):
    u: float = state(0.1, "", 1e3, "any", "Voltage")
    w: float = state(0.0, "", 1e3, "any", "Rate of the voltage")
    drive_angle: float = state(0.0, "rad", 1e9, "any", "Phase")


DECLARATION = Declaration(
    channels=(Channel("u", "u", "w", "w_rate"),),
    features=(Extremes("u", greatest="u_max", least="u_min", peaks="u_peaks"),),
)


def equations(t, phase, s, p, o):
    return {"w": p.mu * (1.0 - s.u**2) * s.w - s.u}


class Bare(Model):
    name = "bare"
    equations = staticmethod(equations)
    declared = DECLARATION
    set_speed = "clock"

    def columns(self, points, thresholds):
        return {"mu": points.parameters.parameters.mu, "clock": 1.0}

    def natural_scales(self, table, o):
        return 0.1, 0.1

    def drawn(self, points, shape):
        q = points.initial.spread
        return {
            "u": q * (2.0 * shape[:, 0] - 1.0),
            "w": q * (2.0 * shape[:, 1] - 1.0),
            "drive_angle": 0.0 * shape[:, 2],
        }

    def scales(self, table):
        return {"size": np.ones(len(table))}


MODEL = Bare
DESCRIPTION = Description(
    name="bare",
    title="Van der Pol's oscillator",
    parameters=Parameters,
    initial=Initial,
    meanings={"parameters": "The parameters"},
    features=(feature("u_max", "1", "greatest voltage"), feature("u_min", "1", "least voltage")),
    peaks=(last_peaks("u_peaks", "1", "last local maxima of the voltage"),),
    own_trace=(in_trace("u", "1", "voltage"), in_trace("w", "1", "rate of the voltage")),
    shown=("u_max",),
    compared={"u_max": "size", "u_min": "size"},
    distinguishing=("u_max",),
    drawn=Drawn(
        panels=(Panel("voltage", "u", "u_peaks", "u_max"),),
        histories=("u", "w"),
        planes=(("u", "w"),),
        summary=("u_max",),
        attractors=(("u_min", "u_max", "voltage"),),
        speed="",
        radius="",
        angle=(),
    ),
)
