"""One motion has one number: every text, picture and page writes a value with the same
digits."""

import numpy as np
import pytest

from nsdrill.quantity import SYSTEMS, quantity
from nsdrill.text.words import value_text
from nsdrill.web import shown
from nsdrill.words import answer, labels


@pytest.mark.parametrize("units", SYSTEMS)
@pytest.mark.parametrize("name", ["depth", "wob", "rotary_speed", "bit_rock_stiffness", "well_friction_static"])
def test_every_room_writes_the_same_digits(name, units):
    scale = {"depth": 1e4, "wob": 1e5, "rotary_speed": 20.0, "bit_rock_stiffness": 1e8}.get(name, 1.0)
    for value in np.random.default_rng(1).random(200) * scale:
        text = value_text(name, float(value), units)
        pictures = labels.quantity(name, units)
        assert pictures.value(value) == text
        assert shown.value_text(pictures, float(value)) == text
        window = answer.Formatter(units).value(name, float(value)).partition(" (")[0]  # the speed in rpm follows
        if name in ("wob", "rotary_speed"):  # as a driller sets it
            (number, unit), (whole, other) = window.split(), text.split()
            assert unit == other
            assert abs(float(number) - float(whole)) <= 0.055
            continue
        assert window == text


def test_the_digits_are_four():
    assert value_text("rotary_speed", 2.684782608695652) == "2.685 rad/s"
    assert value_text("depth", 5000.0, "field") == "16404 ft"
    assert quantity("wob").in_answers(22240.0, "si") == "22.24 kN"
