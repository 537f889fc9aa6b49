"""The registry of quantities: complete, consistent with what files hold, and readable
back."""

import pytest
from model_tables import TRACE_VARIABLES, VARIABLES

from nsdrill.models.choices import further_axes
from nsdrill.models.registry import described
from nsdrill.quantity import SHOWN, SYSTEMS, amount, find, in_system, quantity
from nsdrill.units import plain_units, to_si
from nsdrill.variables import COORDINATES, MODEL

HELD = {v.name: v.units for v in (*VARIABLES, *TRACE_VARIABLES) if v.units} | {k: v[0] for k, v in COORDINATES.items()}


@pytest.mark.parametrize("name", HELD)
def test_every_variable_of_a_file_is_there_with_its_units(name):
    one = quantity(name)
    assert one.units == ("" if HELD[name] == "1" else plain_units(HELD[name]))
    assert one.words
    assert one.label
    for system in SYSTEMS:
        if one.unit(system) not in ("", "percent"):
            assert to_si(f"1 {one.unit(system)}", one.units) > 0.0


def test_every_number_of_a_study_has_field_units():
    for name, (key, units) in further_axes(described(MODEL)).items():
        assert find(key) is find(name)
        assert quantity(key).units == units
        # Seconds, plain numbers, s/rad and the units of electricity are the same on
        # both sides of the ocean.
        same = ("", "s", "s/rad", "s^2/rad^2", "1/s", "Hz", "H", "ohm", "V s/rad")
        assert units in SHOWN or units in same, key


def test_a_power_is_shown_in_kilowatts_and_horsepower():
    """As a feature of somebody's own may be: 1 hp = 550 ft lbf/s = 745.6999 W (NIST SP 811)."""
    assert in_system(745.69987158, "W", "field") == (pytest.approx(1.0, rel=1e-9), "hp")
    assert amount(12300.0, SHOWN["W"][0]) == "12.3 kW"


def test_there_is_no_quantity_of_another_name():
    assert find("points") is None
    assert find("operation_wob") is find("operation.wob") is find("wob")  # the samples of an uncertain value
    with pytest.raises(KeyError):
        quantity("points")


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (5000.0, "ft", "16404 ft"),
        (500000.0, "ft", "1640420 ft"),
        (2000.0, "ft", "6561.68 ft"),
        (22241.1080763025, "klbf", "5 klbf"),
        (13558.179483314004, "kft*lbf", "10 kft-lbf"),
        (9.80665, "gravity", "1 g"),
        (80.0, "percent", "80 %"),
        (3.0, "", "3"),
    ],
)
def test_amounts_have_no_powers_of_ten(value, unit, text):
    assert amount(value, unit) == text


def test_values_for_programs():
    assert in_system(22241.1080763025, "N", "field") == (5.0, "klbf")
    assert in_system(22241.1080763025, "N", "si") == (22241.1080763025, "N")
    assert in_system(13558.179483314004, "N m", "field") == (pytest.approx(10.0), "kft*lbf")
    assert in_system(0.5, "1", "field") == (0.5, "1")
    assert in_system(10.0, "s", "field") == (10.0, "s")


def test_an_amount_beside_another_is_short():
    assert [amount(metres, "ft", 4) for metres in (5000.0, 3047.99, 2000.0, 12.5)] == [
        "16404 ft",
        "10000 ft",
        "6562 ft",
        "41.01 ft",
    ]


def test_a_long_length_is_in_feet_to_either_side_of_zero():
    of = quantity("radius_max")
    assert [of.text(metres, "field") for metres in (2.0, 3.048, -3.048)] == ["78.7402 in", "10 ft", "-10 ft"]
