"""Contacts that count as stuck while they slide on the rising branch of a law that is smoothed."""

import json

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import nsdrill

from .conftest import command
from .test_natural_scales import quiet

BELT = """
@nsdrill.model(responses={"sticking": ("belt_stuck_fraction", 0.05)})
def block(x=0.0, v=0.1, *, u=0.2, load=10.0, steep=500.0, pushed=0.0):
    return v, pushed - 100 * x - 0.1 * v - nsdrill.friction(
        "belt", slip=v - u, normal=load, law="exponential", static=0.4, dynamic=0.25, decay=10.0, smoothing=steep
    )


@nsdrill.model
def struck(t, x=0.0, v=0.0, *, every=0.06, push=1.0, steep=500.0):
    return v, push * np.exp(-4000.0 * (1.0 - np.cos(every * t))) - nsdrill.friction(
        "floor", slip=v, normal=1.0, static=0.4, smoothing=steep
    )
"""


def creep(u, steep):
    """The share of the mean square slip below 6.3 / steep, by SciPy with the arctangent law."""

    def slopes(t, y):
        slip = y[1] - u
        rub = 10.0 * (2.0 / np.pi) * np.arctan(steep * slip) * (0.25 + 0.15 * np.exp(-10.0 * abs(slip)))
        return [y[1], -100.0 * y[0] - 0.1 * y[1] - rub]

    found = solve_ivp(slopes, (0, 60), [0, 0.1], method="LSODA", rtol=1e-8, atol=1e-10, max_step=0.01)
    times = np.linspace(30.0, 60.0, 60001)
    slip = np.interp(times, found.t, found.y[1]) - u
    return np.mean(np.where(np.abs(slip) < 6.3 / steep, slip**2, 0.0)) / np.mean(slip**2)


@pytest.mark.parametrize(("u", "steep"), [(0.05, 100.0), (0.01, 500.0), (0.2, 20.0), (0.1, 100.0), (0.2, 500.0)])
def test_the_share_of_the_slip_that_counts_as_stuck_is_that_of_scipy(script, u, steep):
    study = script(BELT, "creeps").block.study(u=u, steep=steep, transient=30, observe=30)
    data, told = quiet(nsdrill.run, study, progress=False, workers=1)
    expected = creep(u, steep)
    assert data.belt_creep.item() == pytest.approx(expected, rel=0.1, abs=1e-4)
    assert data.belt_stuck_fraction.item() == pytest.approx(1.0 if expected > 0.1 else 0.3, abs=0.15)
    assert any(one.startswith("NO STICK: belt in 1 of 1 run") for one in told) == (expected > 0.1)


def test_what_rests_or_sticks_between_rare_slips_sticks(script):
    """A block at rest, and one that is struck for a hundredth of the time."""
    made = script(BELT, "creeps")
    for study in (
        made.block.study(u=0.0, load=100.0, transient=100, observe=30),
        made.struck.study(transient=0, observe=1000),
    ):
        data, told = quiet(nsdrill.run, study, progress=False, workers=1)
        name = next(str(one) for one in data.data_vars if str(one).endswith("_stuck_fraction"))
        assert data[name].item() > 0.95
        assert not [one for one in told if "NO STICK" in one]
        assert data[name.replace("stuck_fraction", "creep")].item() < 0.1


def test_every_answer_tells_it(script, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "study.yaml").write_text(
        "model: block\nparameters: {steep: 100}\nsweep: {parameters.u: [0.05, 0.2]}\n"
        "simulation: {transient: 60 s, observe: 30 s}\n"
    )
    script(BELT, "creeps")
    for line in (("run", "study.yaml", "-o", "r.h5"), ("show", "r.h5"), ("window", "r.h5")):
        told = " ".join("".join(command(tmp_path, *line, "--with", "creeps.py")).split())
        assert "NO STICK" in told, line
        assert "belt in 1 of 2 runs" in told, line
    found = json.loads(command(tmp_path, "show", "r.h5", "--json", "--with", "creeps.py")[0])
    assert found["creeping"] == {"belt": {"runs": 1, "of": 2}}
