"""Duffing's oscillator with dry friction."""

import numpy as np

import nsdrill


@nsdrill.model
def duffing(t, x=0.1, v=0.0, *, damping=0.15, cubic=1.0, force=0.3, omega=1.2, dry=0.02, steep=200.0):
    """Duffing's oscillator with dry friction"""
    rub = nsdrill.friction("slider", slip=v, normal=dry, static=1.0, smoothing=steep)
    return {"x": v, "v": force * np.cos(omega * t) - damping * v + x - cubic * x**3 - rub}


if __name__ == "__main__":
    study = duffing.study(force=(0.1, 0.5, 42), procedure="up-down", transient=300, observe=200, peaks=16)
    nsdrill.plot(nsdrill.run(study)).savefig("duffing.png")
