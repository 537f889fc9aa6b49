"""A step that is small enough is not told as the one that is too large."""

import pytest

from nsdrill.quantity import to_si
from nsdrill.words.values import Formatter


@pytest.mark.parametrize(("rpm", "told"), [(1.964, "1.9 rpm"), (2.0, "2 rpm"), (0.0734, "0.073 rpm"), (12.9, "12 rpm")])
def test_a_step_that_is_fine_enough_is_rounded_down(rpm, told):
    assert Formatter("field").step_down("rotary_speed", to_si(f"{rpm} rpm", "rad/s")) == told
