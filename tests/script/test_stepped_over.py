"""Contacts that are thinner than a step, whose force begins at zero, so that no slope jumps."""

import json

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import nsdrill

from .conftest import command
from .test_natural_scales import quiet

BUMP = """
@nsdrill.model(responses={"swing": ("x_max", 1.5)})
def bump(x=2.0, v=0.0, *, width=0.1, brake=0.1):
    closed = nsdrill.touching("brake", width - abs(x - 1.0))
    return v, -x - brake / width**2 * closed * v


@nsdrill.model(responses={"swing": ("x_max", 1.5)})
def round_bump(x=2.0, v=0.0, *, width=0.1, brake=0.1):
    closed = nsdrill.touching("brake", 1.0 - ((x - 1.0) / width) ** 2)
    return v, -x - brake / width * closed * v


@nsdrill.model
def wall(t, x=0.0, v=0.0, *, gap=1.0, k=1e4, f=0.3, omega=0.85):
    return v, f * np.cos(omega * t) - 0.05 * v - x - k * nsdrill.touching("stop", x - gap)
"""


def swing(width):
    """The greatest x from 100 s to 150 s, by SciPy with steps that are a quarter of the layer."""

    def slopes(t, y):
        return [y[1], -y[0] - 0.1 / width**2 * max(width - abs(y[0] - 1.0), 0.0) * y[1]]

    found = solve_ivp(slopes, (0, 150), [2, 0], rtol=1e-8, atol=1e-10, max_step=width / 4)
    return found.y[0][found.t > 100.0].max()


@pytest.mark.parametrize(("width", "rtol"), [(0.1, 1e-6), (0.01, 1e-6), (0.01, 1e-8), (0.01, 1e-10), (0.001, 1e-6)])
def test_where_the_motion_is_wrong_it_is_told(script, width, rtol):
    """Each pass takes the same momentum from it, but where steps jump over the layer."""
    study = script(BUMP, "thin").bump.study(width=width, transient=100, observe=50, rtol=rtol)
    data, told = quiet(nsdrill.run, study, progress=False, workers=1)
    is_right = abs(data.x_max.item() - (swing(width) if width > 0.001 else 1.0)) < 0.01
    assert is_right == (width == 0.1 or rtol == 1e-10)
    assert any(one.startswith("CONTACT STEPPED OVER: brake in 1 of 1 run") for one in told) != is_right


@pytest.mark.parametrize("name", ["bump", "round_bump"])
def test_the_part_of_the_time_is_that_of_the_contact(script, name):
    """All of it of a layer that no step ends in, none of one that the steps resolve."""
    model = getattr(script(BUMP, "thin"), name)
    thin, _ = quiet(nsdrill.run, model.study(width=1e-4, transient=0, observe=6, brake=0.0), progress=False, workers=1)
    thick = nsdrill.run(model.study(width=0.4, transient=0, observe=6, brake=0.0), progress=False, workers=1)
    assert thin.brake_stepped_over.item() == pytest.approx(1.0)
    assert thick.brake_stepped_over.item() == 0.0
    # two passes in 6 s, at the speed sqrt(3)
    assert thick.brake_contact_fraction.item() == pytest.approx(2 * 0.8 / np.sqrt(3.0) / 6.0, rel=0.05)


def test_a_stiff_stop_is_not_stepped_over(script):
    """Also near those amplitudes at which it grazes, but at one point."""
    study = script(BUMP, "thin").wall.study(gap=(0.5, 1.6, 45), transient=100, observe=100, procedure="up-down")
    data, _ = quiet(nsdrill.run, study, progress=False, workers=1)
    assert np.count_nonzero(data.stop_contact_fraction > 0.0) > 40
    assert np.count_nonzero(data.stop_stepped_over > 0.02) <= 2


def test_every_answer_tells_it(script, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "study.yaml").write_text(
        "model: bump\nsweep: {parameters.width: [0.001, 0.1]}\nsimulation: {transient: 20 s, observe: 30 s}\n"
    )
    script(BUMP, "thin")
    for line in (("run", "study.yaml", "-o", "r.h5"), ("show", "r.h5"), ("window", "r.h5")):
        told = " ".join("".join(command(tmp_path, *line, "--with", "thin.py")).split())
        assert "CONTACT STEPPED OVER" in told, line
        assert "brake in 1 of 2 runs" in told, line
    found = json.loads(command(tmp_path, "show", "r.h5", "--json", "--with", "thin.py")[0])
    assert found["stepped_over"] == {"brake": {"runs": 1, "of": 2}}
