"""Names that Python keeps for itself are refused with their line, wherever a script names what
becomes a key, a variable or a field."""

import re

import pytest

import nsdrill

MODEL = """
import nsdrill

@nsdrill.model
def swing(x=0.1, v=0.0, *, k=1.0):
    return v, -k * x - 0.1 * v{force}
"""
PLACES = {
    "response": "swing.response({0!r}, 'x_max', 0.05)",
    "severity": "swing.response('far', 'x_max', 0.05, limits={{{0!r}: 0.05}})",
    "feature": "@swing.feature({0!r})\ndef other(x):\n    return x",
    "feature of torsion": "@nsdrill.feature('torsion', {0!r})\ndef other(bit_speed):\n    return bit_speed",
    "pair": "nsdrill.pair({0!r}, a=[[0.5]], b=[0.0, 1.0], embedded=[1.0, 0.0], order=2)",
}
FORCES = {
    "friction": " - nsdrill.friction({0!r}, slip=v, normal=0.1, smoothing=50.0, static=0.2)",
    "contact": " - nsdrill.touching({0!r}, x - 0.01)",
}


@pytest.mark.parametrize("name", ["pass", "None", "class", "lambda", "_", "__dict__", "x__y", "x_"])
@pytest.mark.parametrize("place", [*PLACES, *FORCES])
def test_a_word_of_python_is_no_name(script, place, name):
    force = FORCES.get(place, "").format(name)
    text = MODEL.format(force=force) + "\n" + PLACES.get(place, "").format(name)
    with pytest.raises(
        nsdrill.NsdrillError, match=rf"named\.py, line \d+.*{re.escape(repr(name))}.*allowed: .*no keyword of Python"
    ):
        script(text, "named")


def test_a_response_of_a_package_is_no_word_of_python():
    from nsdrill.models.responses import Response, own
    from nsdrill.variables import feature

    about = feature("x_max", "m", "greatest x", signal="x")
    for declared in (
        Response("pass", feature="x_max", threshold=0.1),
        Response("far", feature="x_max", threshold=0.1, limits={"pass": 0.1}),
    ):
        with pytest.raises(ValueError, match="pass"):
            own(declared, about, 0, ())
