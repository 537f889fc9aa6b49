"""Rate of penetration and mechanical specific energy: against the formula in oilfield
units, and against a trace."""

import math

import numpy as np
import pytest

import nsdrill
from nsdrill.models.numbers import drilled
from nsdrill.models.sections import Cutting
from nsdrill.units import from_si, to_si
from nsdrill.variables import OK

RUN = {"transient": "20 s", "observe": "20 s"}


def test_the_energy_is_that_of_the_formula_in_oilfield_units():
    # Teale 1965 as rigs compute it: MSE [psi] = 4 W/(pi D^2) + 480 T N/(D^2 ROP); 480
    # is 2 pi 60 12 4/pi / 12, exact.
    wob, speed, torque, diameter = 20e3, 120.0, 5500.0, 8.5  # lbf, rpm, ft lbf, in
    found = drilled(
        np.array([to_si(f"{torque} ft*lbf", "N m")]),
        to_si(f"{speed} rpm", "rad/s"),
        Cutting(),
        to_si(f"{wob} lbf", "N"),
        to_si(f"{diameter / 2} in", "m"),
    )
    rate = from_si(found["rate_of_penetration"][0], "ft/h")
    energy = 4 * wob / (math.pi * diameter**2) + 480 * torque * speed / (diameter**2 * rate)
    assert from_si(found["mechanical_specific_energy"][0], "psi") == pytest.approx(energy, rel=1e-12)


def test_the_rate_is_that_of_the_law_and_none_where_it_is_negative():
    law = Cutting(c1=1e-8, c2=-1e-4)
    wob = np.array([0.0, 1e3, 4e4])
    found = drilled(np.full(3, 1e3), np.array([4.0, 4.0, 9.0]), law, wob, 0.1)
    np.testing.assert_allclose(found["rate_of_penetration"], [0.0, 0.0, 1e-8 * 4e4 * 3.0 - 1e-4], rtol=1e-14)
    assert np.isinf(found["mechanical_specific_energy"]).tolist() == [True, True, False]


@pytest.mark.parametrize("model", ["christoforou_yigit", "beam", "segments"])
def test_a_run_takes_the_power_of_its_trace(model, tmp_path):
    study = nsdrill.load_study({"model": model, "simulation": RUN, "operation": {"rotary_speed": "110 rpm"}})
    point = nsdrill.run(study, tmp_path / "out.h5")
    assert point.status.item() == OK
    trace = nsdrill.replay(tmp_path / "out.h5", sample="5 ms")
    late = trace.sel(time=slice(20.0, None))
    power = np.trapezoid(late.surface_torque * late.drive_speed, late.time) / 20.0
    bit_radius = study.parameters.bit.radius if model == "segments" else study.parameters.well.diameter / 2
    rate, wob = point.rate_of_penetration.item(), study.operation.wob
    energy = (power + wob * rate) / (math.pi * bit_radius**2 * rate)
    assert point.mechanical_specific_energy.item() == pytest.approx(energy, rel=0.01 if model == "segments" else 1e-4)


def test_no_energy_is_told_of_a_string_that_is_not_twisted(tmp_path):
    point = nsdrill.run({"modes": {"torsional": "frozen"}, "simulation": RUN}, tmp_path / "out.h5")
    assert np.isnan(point.mechanical_specific_energy.item())
    assert point.rate_of_penetration.item() == pytest.approx(1.35e-8 * 22.24e3 * math.sqrt(3.0) - 1.9e-4, rel=1e-12)


def test_a_motor_at_its_limit_drills_at_the_speed_that_it_keeps(tmp_path):
    drive = {"kind": "soft_torque", "torque_limit": "1 kN*m"}
    point = nsdrill.run({"drive": drive, "simulation": RUN}, tmp_path / "out.h5")
    mean = point.drive_speed_mean.item()
    assert mean < 2.9
    law = 1.35e-8 * 22.24e3 * math.sqrt(max(mean, 0.0)) - 1.9e-4
    assert point.rate_of_penetration.item() == pytest.approx(max(law, 0.0), rel=1e-9)
