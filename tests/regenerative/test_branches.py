"""Branches of the cycles that spring from the Hopf point of cutting over a surface."""

import numpy as np
import pytest

import nsdrill
from nsdrill.analysis.bifurcations import FOLD, HOPF

STRING = "axial_damping: 15.6 kN*s/m, torsional_stiffness: 938 N*m/rad, torsional_damping: 32.9 N*m*s/rad"
ROCK = "blades: 4, specific_energy: 60 MPa, zeta: 0.6, contact_stress: 60 MPa, wear_length: 1.2 mm, friction: 0.6"
RUN = "simulation: {transient: 80 s, observe: 40 s, rtol: 1.0e-8}\n"
OWN = (
    f"model: regenerative\nbit: {{radius: 108 mm, geometry: 1, {ROCK}}}\ndrillstring: "
    f"{{axial_mass: 34000 kg, axial_stiffness: 0.7 MN/m, rotary_inertia: 116 kg*m^2, {STRING}}}\n"
    f"operation: {{wob: 15.876 kN, rotary_speed: 120 rpm}}\n{RUN}"
)
MAIN = (
    f"bit: {{rock: {{law: regenerative, geometry: 1, {ROCK}}}}}\nmodes: {{lateral: frozen}}\n"
    "well: {diameter: 216 mm}\n"
    f"drillstring: {{rotary_inertia: 116 kg*m^2, {STRING}, "
    "collar: {outer_diameter: 165 mm, inner_diameter: 64.65 mm, length: 200 m}, "
    "pipe: {outer_diameter: 127 mm, inner_diameter: 112.84 mm}}\n"
    f"operation: {{depth: 1000 m, wob: 15.876 kN, rotary_speed: 120 rpm}}\n{RUN}"
)


@pytest.mark.parametrize("text", [OWN, MAIN], ids=["own", "main"])
def test_a_branch_of_cycles_from_seeds_ends_at_the_hopf_point(text):
    """The cycles are born supercritically there: they shrink to steady drilling, with no
    fold, and are one branch."""
    data = nsdrill.continue_branches(text + "continue: {along: rotary_speed, from: 110 rpm, to: 160 rpm}\n")
    assert list(data.motion.values) == ["equilibrium", "limit_cycle"]
    labels, speeds = data["label"].values, data["rotary_speed"].values
    assert not np.any(labels == FOLD)
    (hopf,) = speeds[labels == HOPF]
    cycles = data.isel(point=slice(int(data["row_size"][0]), None))
    assert "shrinks to a steady motion" in str(data["end_reason"].values[1])
    assert not bool(data["closed"].values[1])
    assert float(cycles["rotary_speed"].min()) == pytest.approx(110 * np.pi / 30, rel=1e-9)
    assert float(cycles["rotary_speed"].max()) == pytest.approx(hopf, rel=1e-5)
    assert np.all(cycles["unstable"] == 0)
    swing = cycles["bit_speed_max"].values - cycles["bit_speed_min"].values
    smallest = int(np.argmin(swing))
    assert smallest in (0, len(swing) - 1)  # the end, not a turn
