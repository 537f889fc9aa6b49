"""An impact oscillator: a ball on a shaking table, whose contact loses energy (Hunt and
Crossley 1975)."""

import numpy as np

import nsdrill
from nsdrill import number


@nsdrill.model
def ball(
    t,
    h=number(0.0, "m", "height of the ball"),
    w=number(0.0, "m/s", "speed of the ball"),
    *,
    gravity=number(9.81, "m/s^2"),
    stiffness=number(1e4, "N/m", "stiffness of the contact", low=0.0),
    loss=number(0.5, "s/m", "loss of the contact"),
    mass=number(0.1, "kg", "mass of the ball", low=1e-3),
    amplitude=number(2e-4, "m", "amplitude of the table"),
    omega=number(120.0, "rad/s", "frequency of the table"),
):
    """A ball on a shaking table"""
    closed = nsdrill.touching("table", amplitude * np.sin(omega * t) - h)
    push = stiffness * closed * (1.0 + loss * (amplitude * omega * np.cos(omega * t) - w))
    return {"h": w, "w": push / mass - gravity}
