"""Drives and models of scripts that bend exactly at steady drilling, or at an equilibrium: the
derivative on one side is no linear theory there, as SciPy shows, and nothing is claimed by it."""

import json
import math
import subprocess
import sys

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import nsdrill
from nsdrill.models.bends import directions
from nsdrill.text.branch_text import summarize_branches

from .conftest import command

DRIVE = """
@nsdrill.drive
def {0}(lag, drive_speed, set_speed, *, gain=900.0, brake={1}):
    e = drive_speed - set_speed
    return -gain * lag - {2}
"""
# Each bends at the set speed, but for the last three.
DRIVES = {
    "absbrake": (1500.0, "brake * max(e, 0.0)"),
    "optim": (3000.0, "(0.0 * e if e > 0 else brake * e)"),
    "rectified": (1500.0, "brake * abs(e)"),
    "dead0": (1500.0, "(brake * e if abs(e) > 0 else 0.0)"),
    "plain": (1500.0, "brake * e"),
    "banded": (1500.0, "0.5 * brake * (e + min(max(e, -0.5), 0.5))"),
}
STUDY = """\
modes: {axial: frozen, lateral: frozen}
drillstring: {collar: {outer_diameter: 8 in, inner_diameter: 2.8125 in, length: 200 m}}
operation: {depth: 2000 m, wob: 100 kN}
"""
LINEAR = (
    *("slope_held", "stick_slip_onset", "drive_stiffness", "drive_damping", "drive_reflection"),
    *("drive_mode_1", "drive_damping_1", "drive_mode_2", "drive_damping_2"),
)


def scripted(*names):
    return "import nsdrill\n\n" + "\n".join(DRIVE.format(name, *DRIVES[name]) for name in names)


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "d.py").write_text(scripted(*DRIVES), encoding="utf-8")
    (tmp_path / "s.yaml").write_text(STUDY, encoding="utf-8")
    return tmp_path


def checked(folder, kind, *more):
    out, told = command(folder, "check", "s.yaml", "--with", "d.py", "--set", f"drive.kind={kind}", "--json", *more)
    return json.loads(out)["figures"], told, json.loads(out)["warnings"]


@pytest.mark.parametrize("kind", ["absbrake", "optim", "rectified"])
def test_nothing_linear_is_known_of_a_drive_that_bends_at_the_set_speed(folder, kind):
    found, _, out = checked(folder, kind)
    for name in LINEAR:
        assert found[name]["value"] is None, name
        assert found[name]["known"] is False, name
        assert "the equations bend at steady drilling" in found[name]["meaning"]
    assert found["mean_torque"]["value"] == pytest.approx(5996.18, rel=1e-5)  # what is no slope is known
    assert sum(one.startswith("Bends: the equations of the drive") for one in out) == 1


def test_a_condition_that_bends_nothing_has_the_slope_of_its_sides(folder):
    """Its derivative at the set speed alone is another one, which no motion has."""
    (found, _, _), (plain, _, out) = checked(folder, "dead0"), checked(folder, "plain")
    for name in LINEAR:
        assert found[name]["value"] == pytest.approx(plain[name]["value"], rel=1e-9), name
    assert found["drive_damping"]["value"] == pytest.approx(1500.0)
    assert not any(one.startswith("Bends:") for one in out)


def test_a_bend_elsewhere_changes_nothing(folder):
    (found, _, out), (plain, _, _) = checked(folder, "banded"), checked(folder, "plain")
    for name in LINEAR:
        assert found[name]["value"] == pytest.approx(plain[name]["value"], rel=1e-12), name
    assert not any(one.startswith("Bends:") for one in out)


def test_a_bit_that_cuts_knows_nothing_linear_there_either(script):
    script(scripted("absbrake", "dead0", "plain").removeprefix("import nsdrill\n\n"), "cutting")
    told = {
        kind: nsdrill.check({"model": "regenerative", "drive": {"kind": kind}}).figures
        for kind in ("absbrake", "dead0", "plain")
    }
    for name in ("steady_threshold", "growth", "drive_mode_1"):
        assert (told["absbrake"][name].value, told["absbrake"][name].known) == (None, False)
        # the sides lie 1e-7 from the point, where the forces of cutting have other slopes by as much
        assert told["dead0"][name].value == pytest.approx(told["plain"][name].value, rel=1e-6)


# The string of STUDY: inertias [kg m^2], stiffness [N m/rad] and damping [N m s/rad], as check shows them.
J, K_T, C_T, J_D = 314.74, 525.527, 50.0, 2900.0


def bit_torque(speed, set_speed, weight=100e3, radius=0.1905):
    """Of the default law."""
    depth = 2.0 * math.pi * (1.35e-8 * weight * math.sqrt(set_speed) - 1.9e-4) / set_speed
    sign = 2.0 / math.pi * math.atan(1000.0 * speed)
    friction = sign * (0.3 / (1.0 + 3.0 * abs(speed)) + 0.2)
    return weight * (2.0 / 3.0 * radius * friction + math.sqrt(radius * depth) * sign)


def swings(set_speed, brake, seconds=400.0, begin=0.02):
    """The swing of the bit speed [rad/s] at the beginning and at the end."""

    def slopes(t, y):
        lag, drive, twist, bit = y
        torque = K_T * (lag - twist)
        return [
            drive - set_speed,
            (-900.0 * lag - brake(drive - set_speed) - torque) / J_D,
            bit - set_speed,
            (torque - bit_torque(bit, set_speed) - C_T * bit) / J,
        ]

    held = bit_torque(set_speed, set_speed) + C_T * set_speed
    start = [-held / 900.0, set_speed, -held / 900.0 - held / K_T, set_speed + begin]
    found = solve_ivp(slopes, (0.0, seconds), start, rtol=1e-8, atol=1e-10, max_step=0.1)
    return [float(np.ptp(found.y[3][part])) for part in (found.t < 50.0, found.t > seconds - 50.0)]


def test_scipy_contradicts_the_derivative_of_one_side():
    """By the side without a brake ``absbrake`` is unstable below 4.690 rad/s, and by that without one ``optim``
    stable above 3.696 rad/s; ``plain`` is stable above 3.876 rad/s."""
    first, last = swings(4.4, lambda e: 1500.0 * max(e, 0.0))
    assert last < 0.3 * first
    first, last = swings(3.8, lambda e: 0.0 if e > 0 else 3000.0 * e)
    assert last > 3.0 * first


def test_a_window_claims_no_unstable_steady_drilling(folder):
    (folder / "s.yaml").write_text(
        STUDY + "drive: {kind: absbrake}\n"
        "sweep: {rotary_speed: {from: 4.2 rad/s, to: 14 rad/s, points: 3}, procedure: down}\n"
        "simulation: {transient: 200 s, observe: 40 s}\n",
        encoding="utf-8",
    )
    command(folder, "run", "s.yaml", "--with", "d.py", "-o", "o.h5", "-q")
    shown, _ = command(folder, "window", "o.h5", "--with", "d.py", "--all")
    assert "STEADY DRILLING IS UNSTABLE" not in shown
    assert "BENDS: the equations of the drive absbrake bend at steady drilling" in " ".join(shown.split())
    out, _ = command(folder, "window", "o.h5", "--with", "d.py", "--json")
    assert json.loads(out)["bends"].startswith("Bends:")
    assert json.loads(out)["stick_slip"]["settings"] == []
    shown, _ = command(folder, "show", "o.h5", "--with", "d.py")
    assert "BENDS          the equations of the drive absbrake" in shown


# Models

MODELS = """
@nsdrill.model
def kink(x=0.01, v=0.0, *, d=0.1):
    return {"x": v, "v": -x - 0.01 * v**3 - d * v + 0.3 * max(v, 0.0)}


@nsdrill.model
def smooth(x=0.01, v=0.0, *, d=0.1):
    return {"x": v, "v": -x - 0.01 * v**3 - d * v + 0.3 * (max(v - 5.0, 0.0) + 0.5 * v)}


@nsdrill.model
def dead(x=0.01, v=0.0, *, d=0.1):
    return {"x": v, "v": -x - 0.01 * v**3 - d * v + (0.15 * v if abs(v) > 0.0 else 0.0)}
"""


def followed(model, low, high):
    continued = {"d": (low, high), "seeds": [high]}
    return nsdrill.continue_branches(model.study(continued=continued, transient=100), progress=False)


def test_an_equilibrium_at_a_bend_is_not_known_to_be_stable(script):
    model = script(MODELS, "kinked").kink
    data = followed(model, 0.05, 0.3)
    first = summarize_branches(data)["branches"][0]
    assert (first["stable"], first["special"], first["not_decided"]) == ([], [], [])
    assert first["bends"] == [pytest.approx([0.05, 0.3])]
    assert np.all(data["unstable"].values[data["branch_of_point"].values == 0] == -1)
    assert "not known      0.05 to 0.3: the equations bend at this equilibrium" in nsdrill.show(data)
    # d on one half of the cycle and d - 0.3 on the other: small motions grow below 0.15
    for d, grows in ((0.05, True), (0.25, False)):
        found = solve_ivp(
            lambda t, y, d=d: [*model(*y, d=d).values()], (0.0, 100.0), [1e-3, 0.0], rtol=1e-8, atol=1e-12
        )
        assert (np.max(np.abs(found.y[0][found.t > 90.0])) > 1e-3) == grows


def test_a_bend_beside_an_equilibrium_leaves_its_branch_as_it_is(script):
    found = script(MODELS, "beside").smooth
    data = followed(found, 0.05, 0.3)
    first = summarize_branches(data)["branches"][0]
    (hopf,) = first["special"]
    assert (hopf["label"], first["bends"]) == ("hopf", [])
    assert hopf["value"] == pytest.approx(0.15, abs=1e-6)
    assert "bends" not in data


def test_a_condition_that_bends_nothing_makes_no_bifurcation_of_its_own(script):
    first = summarize_branches(followed(script(MODELS, "with_dead").dead, 0.05, 0.3))["branches"][0]
    for one in first["special"]:
        assert one["value"] == pytest.approx(0.15, abs=1e-6)
    for low, _ in first["stable"]:  # what is said to be stable is
        assert low > 0.15 - 1e-6


@pytest.mark.parametrize("number", range(1, 9))
def test_sides_have_all_pairs_of_signs_of_any_two_inputs(number):
    sides = directions(number)
    assert np.all(np.abs(sides) >= 0.5)
    for k in range(number):
        for j in range(k):
            assert {*map(tuple, np.sign(sides[:, [j, k]]).tolist())} == {(1, 1), (1, -1), (-1, 1), (-1, -1)}


NO_NUMBER = """
import numpy as np
import nsdrill


@nsdrill.model(responses={"big": ("x_max", 1.5)})
def osc(t, x=0.1, v=0.0, *, force=0.5, omega=1.2):
    return {"x": v, "v": force * np.cos(omega * t) - 0.1 * v - x}


@osc.feature("n", "1", "no number", greatest=True)
def n(x):
    return np.sqrt(-1.0 - x * x)


if __name__ == "__main__":
    data = nsdrill.run(osc.study(force=(0.05, 1.0, 3), transient=20, observe=20), progress=False)
    nsdrill.show(data)
    nsdrill.window(data)
"""


def test_a_feature_that_is_no_number_lets_no_warning_of_numpy_out(tmp_path):
    (tmp_path / "o.py").write_text(NO_NUMBER, encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-W", "always::RuntimeWarning", "o.py"],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        timeout=200,
    )
    assert done.returncode == 0, done.stderr
    assert "RuntimeWarning" not in done.stderr
