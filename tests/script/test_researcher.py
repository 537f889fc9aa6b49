"""What a researcher asks of a system of equations, in Python and on the command line, against
numbers that are known: the coefficient of a Hopf bifurcation, a branch from one point to one
side, a share of starts."""

import re

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import nsdrill
from nsdrill.orbit.special import HOPF
from script.conftest import command

HOPFS = """@nsdrill.model
def brusselator(x=number(1.2, scale=1.0), y=number(2.0, scale=1.0), *, a=1.0, b=2.2):
    return a - (b + 1.0) * x + x * x * y, b * x - x * x * y


@nsdrill.model
def normal(x=number(0.1, scale=1.0), y=number(0.0, scale=1.0), *, mu=0.1, rate=2.0, soft=1.0):
    r = x * x + y * y
    return mu * x - rate * y - soft * x * r, rate * x + mu * y - soft * y * r
"""
TWO_WELLS = """@nsdrill.model(responses={"right": ("x_mean", 0.0)})
def wells(t, x=0.1, v=0.0, *, force=0.05, omega=1.2, damping=0.15):
    return v, force * np.cos(omega * t) - damping * v + x - x**3
"""


def test_the_first_lyapunov_coefficient_of_the_brusselator(script):
    """-1/2 at a = 1, b = 1 + a^2, with |q| = 1 and <p, q> = 1: Kuznetsov's (5.62) by hand."""
    made = script(HOPFS, "hopfs").brusselator
    continued = {"b": (1.5, 2.2), "seeds": [1.6], "points": 40, "switch": False}
    found = nsdrill.continue_branches(made.study(transient=50, continued=continued), progress=False)
    (place,) = np.flatnonzero(found.label.values == HOPF)
    assert found.parameters_b.values[place] == pytest.approx(2.0, abs=1e-6)
    assert found.normal_form.values[place] == pytest.approx(-0.5, abs=1e-6)
    assert found.normal_form_error.values[place] < 1e-6
    assert found.criticality.values[place] == -1


def test_a_branch_from_one_point_to_one_side_and_in_another_number(script, tmp_path):
    """The radius of the cycle is sqrt(mu / soft): from a point of it in soft, down."""
    made = script(HOPFS, "hopfs").normal
    study = made.study(transient=50, continued={"mu": (-0.1, 0.3), "seeds": [-0.05], "points": 30})
    branches = nsdrill.continue_branches(study, tmp_path / "b.h5", progress=False)
    point = int(np.flatnonzero(branches.branch_of_point.values == 1)[6])
    mu = float(branches.parameters_mu[point])
    assert branches.x_max.values[point] == pytest.approx(np.sqrt(mu), rel=1e-6)
    on = {"direction": "down", "switch": False, "points": 12}
    other = made.study(mu=mu, continued={"soft": (0.5, 2.0), **on})
    for seeds in (branches, tmp_path / "b.h5"):
        found = nsdrill.continue_branches(other, seeds=seeds, point=point, progress=False)
        assert found.motion.values.tolist() == ["limit_cycle"]
        assert found.parameters_soft.values[0] == pytest.approx(1.0)
        assert (np.diff(found.parameters_soft.values) < 0.0).all()
        assert found.x_max.values == pytest.approx(np.sqrt(mu / found.parameters_soft.values), rel=1e-6)
    (tmp_path / "other.yaml").write_text(
        f"model: normal\nparameters: {{mu: {mu!r}}}\n"
        "continue: {along: parameters.soft, from: 0.5, to: 2.0, direction: down, switch: false, points: 12}\n"
    )
    words = "branches", "other.yaml", "-o", "o.h5", "--seeds", "b.h5", "--point", str(point), "--with", "hopfs.py", "-q"
    command(tmp_path, *words)
    with nsdrill.open_results(tmp_path / "o.h5") as written:
        assert written.parameters_soft.values.tolist() == found.parameters_soft.values.tolist()


def test_the_share_of_a_basin_and_its_interval(script, tmp_path):
    """Starts in a plane, one by one as SciPy has them; and drawn from it, with an interval."""
    made = script(TWO_WELLS, "wells").wells
    plane = {"x": (-1.5, 1.5, 8), "v": (-1.0, 1.0, 8)}
    data = nsdrill.run(made.study(slice=plane, transient=120, observe=60), tmp_path / "s.h5", progress=False)
    x, v = np.meshgrid(np.linspace(-1.5, 1.5, 8), np.linspace(-1.0, 1.0, 8), indexing="ij")

    def slopes(t, y):
        x, v = np.split(y, 2)
        return np.concatenate([v, 0.05 * np.cos(1.2 * t) - 0.15 * v + x - x**3])

    path = solve_ivp(slopes, (0.0, 180.0), np.r_[x.ravel(), v.ravel()], rtol=1e-9, atol=1e-11, t_eval=[175.0, 180.0])
    right = (path.y[: x.size] > 0.0).all(axis=1)
    found = nsdrill.attractors(data)[0]
    shares = {one["features"]["x_mean"] > 0.0: one["share"] for one in found["attractors"]}
    assert shares == {True: right.mean(), False: 1.0 - right.mean()}
    drawn = made.study(uncertain={"x": (-1.5, 1.5), "v": (-1.0, 1.0), "samples": 64}, transient=120, observe=60)
    share = nsdrill.probability(nsdrill.run(drawn, tmp_path / "d.h5", progress=False)).sel(outcome="right")
    assert share.low < 0.46 < share.high, "0.46 of 256 starts"
    told, _ = command(tmp_path, "show", "d.h5", "--with", "wells.py")
    assert re.search(r"Probability, in brackets its 95 % interval from 64 samples", told)


def test_what_has_one_start_is_told_how_a_script_gets_several(script):
    data = nsdrill.run(script(TWO_WELLS, "wells").wells.study(transient=1, observe=1), progress=False)
    with pytest.raises(nsdrill.InputError, match=r"one start, .*\. Run a study with initial\.slice, as slice="):
        nsdrill.attractors(data)


def test_the_spectrum_of_the_only_point_is_headed_by_what_there_is(script, tmp_path):
    made = script(HOPFS, "hopfs").normal
    nsdrill.run(made.study(transient=20, observe=5), tmp_path / "n.h5", progress=False).close()
    told, _ = command(tmp_path, "spectrum", "n.h5", "--duration", "20s", "--with", "hopfs.py", "-q")
    assert told.startswith("Lyapunov exponents, same, over 20 s from the end of its run:\n")
