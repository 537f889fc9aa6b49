"""What equations of scripts add, compare and return has one dimension, as far as their
numbers have units; what has none is not checked."""

import re

import pytest

import nsdrill
from nsdrill.errors import NsdrillError
from nsdrill.models.registry import described, model_named
from nsdrill.script.dimensions import check_dimensions, dimension_in, words
from nsdrill.script.signature import number

TEXT = """
import numpy as np
import nsdrill
from nsdrill import number

@nsdrill.model
def block(
    t, x=number(0.1, "m"), v=number(0.0, "m/s"), angle=number(0.0, "rad"), spin=number(1.0, "rad/s"), free=0.0,
    *, mass=number(2.0, "kg"), stiffness=number(8.0, "N/m"), push=number(3.0, "N"), arm=number(0.2, "m"),
    omega=number(2.0, "rad/s"), inertia=number(0.3, "kg m^2"), steep=number(50.0, "s/m"), loose=0.7,
):
    first = {first}
    if x > {limit}:
        first = {inside}
    return {{"x": v, "v": ({force}) / mass, "angle": spin, "spin": {turn}, "free": first}}
"""
RIGHT = {"first": "stiffness * x", "limit": "arm", "inside": "push", "force": "push", "turn": "arm * push / inertia"}
HEAD = 4  # lines that stand before a script
LINES = {"first": 13 + HEAD, "limit": 14 + HEAD, "inside": 14 + HEAD, "force": 16 + HEAD, "turn": 16 + HEAD}
# What stands in the place of what is right, and what is said of it.
CERTAIN = [
    ("first", "x + push", "a sum of values in m and in N"),
    ("first", "push - 3.0 * push + x", "a sum of values in N and in m"),
    ("limit", "push", "a comparison of values in m and in N"),
    ("inside", "x", "a choice of values in m and in N"),
    ("first", "np.tanh(x / arm) + push", "a sum of values without a dimension and in N"),
    ("first", "np.maximum(x, push)", "the greater or lesser of values in m and in N"),
    ("first", "np.sqrt(x * x + v * v)", "a sum of values in m^2 and in m^2/s^2"),
    ("force", "push * arm", "the slope of v in m^2/s^2; allowed: in m/s^2"),
    ("turn", "push / inertia", "the slope of spin in 1/m/s^2; allowed: in 1/s^2"),
]
# What may be right: a number without a unit, or a literal, may stand for anything.
UNKNOWN = [
    ("first", "stiffness * x + 3.0 * push + 2.0"),
    ("first", "x + loose * push"),
    ("first", "push + 9.81 * mass"),
    ("first", "np.cos(omega * t) * push + stiffness * x * np.sin(angle)"),
    ("first", "np.cos(t)"),
    ("first", "np.tanh(v) * push"),
    ("first", "np.sqrt(x * x + 1e-6) * stiffness"),
    ("first", "np.maximum(x, 0.0) * stiffness"),
    ("first", "np.tanh(steep * v) * push"),
    ("first", "x if x > 0.1 else 0.0"),
    ("first", "nsdrill.touching('wall', x - arm) * stiffness"),
    (
        "force",
        "-nsdrill.friction('belt', slip=v, normal=push, smoothing=steep, static=loose, dynamic=loose, decay=steep)",
    ),
    ("force", "-nsdrill.friction('belt', slip=v, normal=push, law='rational', smoothing=9.0, static=0.3)"),
    ("turn", "(arm * push - 0.1 * spin) / inertia"),
]


@pytest.mark.parametrize(("place", "wrong", "said"), CERTAIN)
def test_what_contradicts_itself_is_refused_in_its_line(script, place, wrong, said):
    with pytest.raises(NsdrillError, match=rf"dims\.py, line {LINES[place]}: block: .*{re.escape(said)}"):
        script(TEXT.format(**{**RIGHT, place: wrong}), "dims")


@pytest.mark.parametrize(("place", "open_one"), [("first", "push"), *UNKNOWN])
def test_what_may_be_right_is_silent(script, place, open_one):
    script(TEXT.format(**{**RIGHT, "inside": "first", place: open_one}), "dims")


def test_a_load_has_the_dimension_of_its_normal_load(script):
    belt = "nsdrill.friction('belt', slip=v, normal=push, smoothing=steep, static=0.3)"
    with pytest.raises(NsdrillError, match="a sum of values in N and in m"):
        script(TEXT.format(**{**RIGHT, "first": f"{belt} + x"}), "dims")


def test_a_drive_gives_a_torque(script):
    text = """
import nsdrill
from nsdrill import number

@nsdrill.drive
def spring_drive(lag, drive_speed, set_speed, *, spring=number(900.0, "N m/rad"), brake=number(9.0, {units!r})):
    return -spring * lag - brake * (drive_speed - set_speed)
"""
    script(text.format(units="N m s/rad"), "driven")
    with pytest.raises(NsdrillError, match=r"driven\.py, line 12: spring_drive: .*a sum of values in N m and in N"):
        script(text.format(units="N s/rad"), "driven")


FEATURE = """

@block.feature("own", {unit!r}, mean=True)
def own(x, v, push, first):
    return {value}
"""


@pytest.mark.parametrize(
    ("unit", "value", "said"),
    [
        ("kg", "v + x", "return v + x: found a sum of values in m/s and in m"),
        ("kg", "push * v", "found a value in W; allowed: in kg, as its unit is"),
        ("N", "first * v", "found a value in W; allowed: in N, as its unit is"),
    ],
)
def test_a_feature_has_the_dimension_of_its_unit(script, unit, value, said):
    with pytest.raises(NsdrillError, match=rf"dims\.py, line \d+: .*{re.escape(said)}"):
        script(TEXT.format(**RIGHT) + FEATURE.format(unit=unit, value=value), "dims")


@pytest.mark.parametrize(("unit", "value"), [("W", "push * v"), ("W", "first * v"), ("", "x * v"), ("kg", "x * loose")])
def test_a_feature_that_may_be_right_is_silent(script, unit, value):
    right = {**RIGHT, "inside": "first"}
    script(TEXT.format(**right) + FEATURE.format(unit=unit, value=value).replace("x, v", "x, v, loose"), "dims")


TURNING = """
import numpy as np
import nsdrill
from nsdrill import number

@nsdrill.model
def turning(
    t, a=number(0.1, "rad"), w=number(1.0, "rad/s"), x=number(0.1, "m"),
    *, decay=number(0.1, {unit!r}), fast=number(2.0, {unit!r}),
):
    return {{"a": {angle}, "w": -0.1 * w, "x": {slope}}}
"""
OF_OWN = """

@turning.feature("own", {unit!r}, mean=True)
def own(w, fast):
    return {value}
"""
OF_BIT = """
import numpy as np
import nsdrill

@nsdrill.feature("torsion", "turns_of_bit", "Hz", mean=True)
def turns_of_bit(bit_speed):
    return {value}
"""
CYCLES = r"Hz counts cycles of 2 \* np\.pi rad"


@pytest.mark.parametrize(
    ("angle", "slope", "said"),
    [
        ("w", "-decay * x", "found the slope of x in m cycles/s; allowed: in m/s"),
        ("w", "-fast**2 * x / decay", "found the slope of x in m cycles/s; allowed: in m/s"),
        ("fast", "0.0 * x", "found the slope of a in Hz; allowed: in 1/s"),
        ("w + fast", "0.0 * x", "found a sum of values in 1/s and in Hz"),
        ("w if w > decay else 0.0", "0.0 * x", "found a comparison of values in 1/s and in Hz"),
    ],
)
def test_cycles_are_no_rate_of_an_angle(script, angle, slope, said):
    with pytest.raises(NsdrillError, match=rf"turns\.py, line \d+: .*{re.escape(said)}.*{CYCLES}"):
        script(TURNING.format(unit="Hz", angle=angle, slope=slope), "turns")
    script(TURNING.format(unit="1/s", angle=angle, slope=slope), "turns")
    script(TURNING.format(unit="Hz", angle="2 * np.pi * fast", slope="-2 * np.pi * decay * x"), "turns")


@pytest.mark.parametrize(
    ("given", "unit", "value", "is_right"),
    [
        ("1/s", "Hz", "w", False),
        ("1/s", "Hz", "fast", False),
        ("Hz", "rad/s", "fast", False),
        ("Hz", "1/s", "fast", False),
        ("Hz", "Hz", "fast", True),
        ("Hz", "rad/s", "2 * np.pi * fast + w", True),
        ("1/s", "Hz", "w / (2 * np.pi)", True),
        ("1/s", "1/s", "w", True),
    ],
)
def test_a_feature_in_hertz_counts_cycles(script, given, unit, value, is_right):
    text = TURNING.format(unit=given, angle="w", slope="0.0 * x") + OF_OWN.format(unit=unit, value=value)
    if is_right:
        script(text, "turns")
        return
    with pytest.raises(NsdrillError, match=rf"turns\.py, line \d+: feature own: found a value in .*{CYCLES}"):
        script(text, "turns")


def test_a_feature_in_hertz_of_a_model_of_nsdrill_counts_cycles(script):
    with pytest.raises(NsdrillError, match=rf"bits\.py, line \d+: feature turns_of_bit: found .* in 1/s.*{CYCLES}"):
        script(OF_BIT.format(value="bit_speed"), "bits")


@pytest.mark.parametrize("name", ["christoforou_yigit", "segments", "beam", "regenerative", "torsion"])
def test_no_model_of_nsdrill_contradicts_the_units_of_its_states(name):
    about, model = described(name), model_named(name)
    for options in {model.options_of(about.parameters()), model.options(*model.widest)}:
        names = model.names(options)
        units = {one.name: re.sub(r"(?<=[a-z])-", "^-", one.units) for one in about.trace_and_states}
        states = {one: number(0.0, units[one]) for one in names.states if one in units}
        assert {"twist", "bit_speed"} <= states.keys()
        every = states | {one: number(0.0) for one in names.states if one not in units}

        check_dimensions(model.equations, every, dict.fromkeys(names.parameters, number(0.0)), name, options=options)


def test_dimensions_are_told_in_units():
    assert [words(dimension_in(units)) for units in ("kg m/s^2", "N m/rad", "m^(1/2)/s", "rad", "A s")] == [
        "in N",
        "in N m",
        "in m^(1/2)/s",
        "without a dimension",
        "in s A",
    ]
    assert dimension_in("") is None


@pytest.mark.parametrize("units", ["N/m^3", "1/s^2", "m^(1/2)/s", "kg·m²/s²", "s^2*A/m^1.5", "1"])
def test_a_number_with_any_unit_is_an_axis_and_an_unknown_of_a_file(script, tmp_path, units):
    made = script(
        f"@nsdrill.model\ndef spring(x=1.0, v=0.0, *, k=number(1.0, {units!r}, low=0.3, high=3.3)):\n"
        "    return v, -k * x\n",
        "any_unit",
    ).spring
    for k, more in enumerate(({"k": [0.5, 1.0]}, {"uncertain": {"k": (0.5, 1.0), "samples": 2}})):
        file = tmp_path / f"{k}.h5"
        nsdrill.run(made.study(transient=1, observe=1, **more), file, progress=False)
        with nsdrill.open_results(file) as data:
            found = next(value for value in data.coords.values() if value.attrs.get("key") == "parameters.k")
            assert found.attrs["units"] == units
            for system in ("si", "field"):
                if k == 0:
                    nsdrill.plot(data, units=system)
                else:  # one setting, of which nothing is safe or critical
                    with pytest.raises(nsdrill.InputError, match="no picture of it: nothing was swept, and its model"):
                        nsdrill.plot(data, units=system)
            for name in ("again.nc", "again.csv"):
                nsdrill.save(data, tmp_path / f"{k}{name}")
        with nsdrill.open_results(tmp_path / f"{k}again.nc") as again:
            assert again.attrs["study_resolved"] == data.attrs["study_resolved"]


def test_a_ratio_is_known_to_have_no_dimension(script):
    ratio = TEXT.replace("loose=0.7", 'loose=number(0.7, "1")')
    script(ratio.format(**{**RIGHT, "inside": "first", "first": "loose + x / arm"}), "dims")
    with pytest.raises(NsdrillError, match="a sum of values without a dimension and in m"):
        script(ratio.format(**{**RIGHT, "inside": "first", "first": "loose + x"}), "dims")


@pytest.mark.parametrize(
    ("angle", "units", "is_refused"),
    [
        ("f * t", "Hz", True),
        ("3 * t * f", "Hz", True),
        ("f * t + 0.5", "Hz", True),
        ("2 * np.pi * f * t", "Hz", False),
        ("2 * np.pi * (f * t)", "Hz", False),
        ("f * t", "rad/s", False),
        ("f * t", "1/s", False),
    ],
)
def test_cycles_that_are_radians_are_refused(script, angle, units, is_refused):
    """A frequency in Hz in a cosine of f * t is wrong by 2 pi."""
    text = f'''
@nsdrill.model
def shaken(t, x=0.1, v=0.0, *, f=number(2.0, "{units}")):
    return v, -x - v + np.cos({angle})
'''
    if not is_refused:
        assert script(text, "cycles").shaken.study(f=f"3 {units}").parameters.parameters.f == 3.0
        return
    with pytest.raises(nsdrill.InputError, match=r"f is in Hz.*allowed: 2 \* np\.pi \* f \* t, or f in rad/s"):
        script(text, "cycles")
