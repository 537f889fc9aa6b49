"""A Jeffcott rotor that rubs on its stator: a disc with an eccentric mass in the middle of
an elastic shaft. Lengths in gaps, times in periods of the shaft over 2 pi."""

import numpy as np

import nsdrill


@nsdrill.model
def rotor(
    t, x=0.5, vx=0.0, y=0.0, vy=0.0, *, damping=0.1, eccentricity=0.5, omega=0.8, stator=30.0, friction=0.1, gap=1.0
):
    """A Jeffcott rotor that rubs on its stator"""
    radius = np.sqrt(x * x + y * y + 1e-12)
    push = stator * nsdrill.touching("stator", radius - gap) / radius
    unbalance = eccentricity * omega * omega
    return {
        "x": vx,
        "vx": unbalance * np.cos(omega * t) - damping * vx - x - push * (x - friction * y),
        "y": vy,
        "vy": unbalance * np.sin(omega * t) - damping * vy - y - push * (y + friction * x),
    }
