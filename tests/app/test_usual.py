"""Numbers far from usual are told: each text of what is usual is read, no default is far, and a
slip of a unit reaches check, window and JSON."""

import numpy as np
import pytest

import nsdrill
from nsdrill.app.check import check
from nsdrill.app.usual import FAR, far_from_usual, usual_range
from nsdrill.models.registry import NAMES, described
from nsdrill.models.tree import leaves
from nsdrill.study import parse_study

WITHOUT = ("times the inertia", "that of the specific energy", "0 or 40 s")  # texts that say no range
ONE = ("0.5", "1")


def usual_of_all():
    for name in NAMES:
        model = described(name)
        for key, default, about in leaves(model.parameters()):
            if text := about.get("usual"):
                units = next(iter(model.units_by[key][1].values())) if key in model.units_by else about["units"]
                yield pytest.param(text, units, default, id=f"{name}-{key}")


@pytest.mark.parametrize(("text", "units", "default"), [*usual_of_all()])
def test_each_usual_range_is_read(text, units, default):
    found = usual_range(text, units)
    if found is None:
        assert text in ONE or any(part in text for part in WITHOUT), f"no range in {text!r}"
        return
    assert found.low < found.high
    for value in (found.low, found.high, (found.low + found.high) / 2):
        assert not found.is_far(value)
    if found.high > 0.0:
        assert found.is_far(1.01 * FAR * found.high)
    if found.low > 0.0:
        assert found.is_far(0.99 * found.low / FAR)
        assert found.is_far(0.0)


@pytest.mark.parametrize(
    ("text", "units", "low", "high"),
    [
        ("3 to 40 m; laboratory rigs 0.1 m", "m", 0.1, 40.0),
        ("1 MN/m to 10 GN/m; Hertz 1 to 1000 GN/m^1.5", "N/m", 1e6, 1e10),
        ("1 MN/m to 10 GN/m; Hertz 1 to 1000 GN/m^1.5", "N/m^1.5", 1e9, 1e12),
        ("composite 1600 to tungsten 19 300 kg/m^3", "kg/m^3", 1600.0, 19300.0),
        ("1 1/4 to 4 in; a rod 0", "m", 0.03175, 0.1016),
        ("1e-9 to 1e-7: 1 to 100 m/h", "", 1e-9, 1e-7),
        ("-1e-3 to 0", "", -1e-3, 0.0),
        ("500 to 5000 kg m^2 at the string", "kg m^2", 500.0, 5000.0),
    ],
)
def test_a_range_is_from_the_least_to_the_greatest(text, units, low, high):
    found = usual_range(text, units)
    assert (found.low, found.high) == (pytest.approx(low), pytest.approx(high))


SLIPS = {
    "mud: {density: 10.5 g/cm^3}": "mud.density 10500 kg/m^3",
    "mud: {drag: 20}": "mud.drag 20",
    "drillstring: {eccentricity: 0 mm}": "drillstring.eccentricity 0 mm",
    "well: {stiffness: 25 kN/m}": "well.stiffness 0.025 MN/m",
    "well: {law: hertz, stiffness: 24 MN/m^1.5}": "well.stiffness 0.024 GN/m^1.5",
    "bit: {rock_stiffness: 25 kN/m}": "bit.rock_stiffness 0.025 MN/m",
    "uncertain: {mud.drag: {uniform: [10, 30]}}": "mud.drag 2",
}


@pytest.mark.parametrize("name", ["christoforou_yigit", "beam", "torsion", "regenerative", "segments"])
def test_the_defaults_of_a_model_are_not_far(name):
    assert far_from_usual(parse_study(f"model: {name}\n")) == ""


@pytest.mark.parametrize(("text", "told"), SLIPS.items())
def test_a_slip_of_a_unit_is_told(text, told):
    found = far_from_usual(parse_study(text))
    assert found.startswith(told)
    assert ("meant to be left out" in found) == (" 0 mm" in told)


def test_what_only_a_frozen_motion_depends_on_is_not_told():
    assert far_from_usual(parse_study("drillstring: {eccentricity: 0 mm}\nmodes: {lateral: frozen}\n")) == ""


def test_what_is_swept_is_looked_for():
    assert far_from_usual(parse_study("sweep: {drillstring.eccentricity: {from: 0 mm, to: 90 mm, points: 4}}")) == ""


def test_check_window_and_json_tell_it(tmp_path):
    text = (
        "drillstring: {eccentricity: 0 mm}\nsimulation: {transient: 1 s, observe: 1 s}\n"
        "sweep: {rotary_speed: {from: 8 rad/s, to: 9 rad/s, points: 2}}\n"
    )
    study = parse_study(text)
    assert any(one.startswith("Far from usual: drillstring.eccentricity 0 mm") for one in check(study).warnings)
    data = nsdrill.run(study, tmp_path / "out.h5")
    found = nsdrill.window(data)
    assert found["unusual_numbers"].startswith("drillstring.eccentricity 0 mm")
    assert any("NUMBERS FAR FROM USUAL: drillstring.eccentricity 0 mm" in one for one in found["answer"]["warnings"])
    assert np.isfinite(data["radius_max"].values).all()
