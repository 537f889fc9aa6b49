"""What follows from what is typed: the system of units, a default that depends on another
key, and the bore of a pipe that is given by weight."""

import math

import pytest

from nsdrill.app.check import check
from nsdrill.errors import StudyError
from nsdrill.study import parse_study
from nsdrill.study.schema import study_form
from nsdrill.study.write import study_text, template_text
from nsdrill.units import system_of

FIELD = """
drillstring: {collar: {outer_diameter: 8 1/2 in, inner_diameter: 2.8125 in, length: 600 ft}, eccentricity: 2 mm}
mud: {density: 10.5 ppg}
operation: {depth: 9500 ft, wob: 15 klbf, rotary_speed: 100 rpm}
"""


@pytest.mark.parametrize(
    ("text", "system"),
    [
        *(
            (text, "field")
            for text in ("8 1/2 in", '8.5"', "15 klbf", "10.5 ppg", "7 ft*lbf/rad", "19.5 lb/ft", "3 psi")
        ),
        *((text, "si") for text in ("3 rad/s", "25 MN/m", "22 kN", "2 g/cm^3", "500 s/m", "1.5 mm")),
        *((text, None) for text in ("60 rpm", "2 min", "30 deg", "2 Hz", "0.5", "hertz", "up-down", "a = 3")),
    ],
)
def test_the_system_of_a_quantity(text, system):
    assert system_of(text) == system


@pytest.mark.parametrize(
    ("text", "overrides", "units"),
    [
        (FIELD, [], "field"),
        (f"units: si\n{FIELD}", [], "si"),
        ("operation: {wob: 5 klbf, depth: 2000 m}", [], "si"),  # equal
        ("operation: {wob: 5 klbf}\nsweep: {rotary_speed: [60 rpm, 80 rpm]}", [], "field"),
        ("operation: {wob: 22 kN}", ["operation.depth=9500 ft", "well.diameter=12 in"], "field"),
        ("operation: {rotary_speed: 60 rpm}", [], "si"),
        ("title: 5 in\nsweep: {depth: [500 m]}", [], "si"),
        ("uncertain: {drillstring.eccentricity: {uniform: [0.1 in, 0.2 in]}}", [], "field"),
    ],
)
def test_a_study_answers_in_the_units_in_which_it_is_typed(text, overrides, units):
    study = parse_study(text, "s.yaml", overrides)
    assert study.units == units
    again = parse_study(study_text(study.resolved))
    assert (again.units, again.sha256) == (units, study.sha256)


def test_units_change_no_digest():
    assert parse_study(FIELD).sha256 == parse_study(f"units: si\n{FIELD}").sha256


@pytest.mark.parametrize(
    ("text", "overrides", "height"),
    [
        ("bit: {lobes: 1}", [], 0.0),
        ("bit: {lobes: 3}", [], 1e-3),
        ("", ["bit.lobes=1"], 0.0),
        ("bit: {lobes: 1}", ["bit.lobes=3"], 1e-3),
        ("bit: {lobes: 1, surface_amplitude: 1 mm}", [], 1e-3),
        ("model: beam\nbit: {lobes: 1}", [], 0.0),
        ("model: segments", [], 1e-3),  # the published string: 1 mm with one lobe
    ],
)
def test_the_height_of_the_lobes_follows_their_number(text, overrides, height):
    study = parse_study(f"{text}\ntitle: Lobes", "s.yaml", overrides)
    assert study.parameters.bit.surface_amplitude == height
    assert parse_study(study_text(study.resolved)).sha256 == study.sha256


def test_its_default_is_told_everywhere():
    text = next(line for line in template_text().splitlines() if "surface_amplitude" in line)
    assert text.endswith("; 0 m with lobes 1")
    about = str(study_form().schema({}))
    parts = {}
    study_form().schema(parts)
    assert "Default 1 mm, 0 m with lobes 1" in about + str(parts)
    warned = check(parse_study("bit: {lobes: 1}\nsweep: {rotary_speed: [60 rpm, 90 rpm]}")).warnings
    assert any("bit.surface_amplitude is 0 (the default with lobes 1)" in one for one in warned)
    bored = check(parse_study("bit: {lobes: 3}\nsweep: {rotary_speed: [60 rpm, 90 rpm]}")).warnings
    assert not any("surface_amplitude is 0" in one for one in bored)


def pipe_of(text: str, *overrides: str, model: str = "christoforou_yigit"):
    return parse_study(f"model: {model}\ndrillstring: {{pipe: {{{text}}}}}\n", "s.yaml", overrides)


@pytest.mark.parametrize("model", ["christoforou_yigit", "beam", "segments"])
def test_a_pipe_by_weight(model):
    """API RP 7G: 5 in drill pipe with a bore of 4.276 in weighs 17.93 lb/ft without its
    joints. The density there is 490 lb/ft^3, here 7850 kg/m^3: 0.01 %."""
    pipe = pipe_of("outer_diameter: 5 in, weight: 17.93 lb/ft", model=model).parameters.drillstring.pipe
    assert pipe.inner_diameter == pytest.approx(4.276 * 0.0254, rel=5e-4)
    weight = math.pi / 4 * (pipe.outer_diameter**2 - pipe.inner_diameter**2) * 7850.0
    assert weight == pytest.approx(17.93 * 0.45359237 / 0.3048, rel=1e-12)


def test_the_bore_follows_the_density_and_a_written_study_reads_back():
    study = pipe_of("outer_diameter: 5 in, weight: 30 kg/m", "drillstring.material.density=8000 kg/m^3")
    pipe = study.parameters.drillstring.pipe
    assert math.pi / 4 * (0.127**2 - pipe.inner_diameter**2) * 8000.0 == pytest.approx(30.0, rel=1e-12)
    again = parse_study(study_text(study.resolved))
    assert again.parameters == study.parameters
    assert again.sha256 == study.sha256
    plain = pipe_of(
        f"outer_diameter: 5 in, inner_diameter: {pipe.inner_diameter!r} m", "drillstring.material.density=8000 kg/m^3"
    )
    assert plain.parameters.drillstring.pipe.inner_diameter == pipe.inner_diameter


def test_a_nominal_weight_is_warned_of():
    (note,) = pipe_of("outer_diameter: 5 in, weight: 19.5 lb/ft").notes
    assert "bore of 4.208 in" in note
    assert "tool joints" in note
    assert "%" in note


@pytest.mark.parametrize(
    ("text", "more", "key", "words"),
    [
        ("weight: 19.5 lb/ft, inner_diameter: 4.276 in", "", "drillstring.pipe.weight", "one of the two"),
        ("outer_diameter: 5 in, weight: 90 lb/ft", "", "drillstring.pipe.weight", "the weight of a rod"),
        ("outer_diameter: 5 in, weight: 0.01 kg/m", "", "drillstring.pipe.weight", "has a wall"),
        ("weight: 19.5 lb", "", "drillstring.pipe.weight", "kg/m or lb/ft"),
        ("", "sweep: {drillstring.pipe.weight: [20 lb/ft]}", "sweep.drillstring.pipe.weight", "inner_diameter"),
        (
            "weight: 19.5 lb/ft",
            "sweep: {drillstring.pipe.outer_diameter: [5 in, 5.5 in]}",
            "sweep.drillstring.pipe.outer_diameter",
            "follows once",
        ),
        (
            "weight: 19.5 lb/ft",
            "uncertain: {drillstring.material.density: {uniform: [7800 kg/m^3, 7900 kg/m^3]}}",
            "uncertain.drillstring.material.density",
            "follows once",
        ),
    ],
)
def test_what_goes_not_with_a_weight(text, more, key, words):
    with pytest.raises(StudyError) as error:
        parse_study(f"drillstring: {{pipe: {{{text}}}}}\n{more}")
    fault = error.value.faults[0]
    assert fault.key == key
    assert words in f"{fault.found} {fault.allowed}"
