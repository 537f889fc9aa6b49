"""Axes over any number of the study: how they are asked for, and what is said of those
that cannot be."""

import json

import numpy as np
import pytest

from nsdrill.app.refinement import summary
from nsdrill.app.run import run_in_memory, run_study
from nsdrill.errors import StudyError
from nsdrill.models.leaves import further_axes
from nsdrill.models.registry import described
from nsdrill.plot.labels import quantity
from nsdrill.store import open_results, read_results
from nsdrill.study import parse_study, study_from_resolved
from nsdrill.study.keys import keys_named
from nsdrill.study.write import study_text
from nsdrill.unit_table import CF
from nsdrill.units import readable
from nsdrill.variables import MODEL

ROCK = """\
sweep:
  bit.rock_stiffness: {from: 10 MN/m, to: 90 MN/m, points: 3, spacing: log}
  rotary_speed: [3 rad/s, 5 rad/s]
simulation: {transient: 0.2 s, observe: 0.2 s}
record: {peaks: 0}
"""


def test_every_number_of_the_string_is_an_axis():
    """By the same keys in the study and in the model, but for those of the operation."""
    further = {key for key, _ in further_axes(described(MODEL)).values()}
    assert further | {"depth", "wob", "rotary_speed"} == set(keys_named().axes)
    assert all(keys_named().axes[key].units == units for key, units in further_axes(described(MODEL)).values())


def test_spacing_is_linear_or_logarithmic():
    axes = parse_study(ROCK).axes
    np.testing.assert_allclose(axes["bit.rock_stiffness"], [10e6, 30e6, 90e6], rtol=1e-15)
    assert axes["bit.rock_stiffness"][[0, -1]].tolist() == [10e6, 90e6]
    fine = parse_study(ROCK, overrides=["sweep.refine=2"]).axes["bit.rock_stiffness"]
    assert fine[::4].tobytes() == axes["bit.rock_stiffness"].tobytes(), "a refined axis keeps its values"
    flat = parse_study(ROCK, overrides=["sweep.bit.rock_stiffness.spacing=linear"]).axes["bit.rock_stiffness"]
    assert flat.tolist() == [10e6, 50e6, 90e6]


def test_a_study_with_axes_is_built_and_written_again():
    study = parse_study(ROCK)
    again = study_from_resolved(json.loads(json.dumps(study.resolved)))
    assert again.sha256 == study.sha256
    assert parse_study(study_text(study.resolved)).sha256 == study.sha256
    replaced = parse_study(ROCK, overrides=["bit.rock_stiffness=70 MN/m"])
    assert replaced.sha256 == study.sha256, "the axis takes its place"


def test_an_override_may_name_an_axis():
    study = parse_study("sweep: {depth: 3000 m}", overrides=["sweep.well.friction.static=[0.3, 0.4]"])
    assert study.axes["well.friction.static"].tolist() == [0.3, 0.4]


def test_the_wall_stiffness_is_an_axis_of_the_linear_law():
    """That of Hertz's law has another unit, and names of axes tell one."""
    text = "well: {{law: {}}}\nsweep: {{well.stiffness: [10 {}, 20 {}]}}\n"
    assert parse_study(text.format("linear", "MN/m", "MN/m")).more[0].units == "N/m"
    with pytest.raises(StudyError, match=r"line 2: sweep\.well\.stiffness: found an axis with law: hertz"):
        parse_study(text.format("hertz", "MN/m^1.5", "MN/m^1.5"))
    with pytest.raises(StudyError, match=r"in N/m\^1.5.*law: hertz takes"):
        parse_study(text.format("linear", "MN/m^1.5", "MN/m^1.5"))


@pytest.mark.parametrize(
    ("sweep", "words"),
    [
        (
            "bit.rock_stifness: [1 MN/m]",
            ["line 1: sweep.bit.rock_stifness", "unknown key", "Did you mean bit.rock_stiff"],
        ),
        ("rock_stiffness: [1 MN/m]", ["an unknown key", "Did you mean bit.rock_stiffness?"]),
        ("bit.lobes: [1.5, 3]", ["a whole number, at least 1 and at most 8"]),
        ("well.law: [linear]", ["on which the units of well.stiffness depend", "Run a study for each word"]),
        ("simulation.rtol: [1.0e-6]", ["not of the string or its operation"]),
        ("bit.rock_stiffness: [20]", ["without a unit", "MN/m"]),
        ("bit.rock_stiffness: [1 N/m, 1e30 N/m]", ["sweep.bit.rock_stiffness[1]", "at most"]),
        (
            "well.diameter: {from: 0.2 m, to: 0.4 m, points: 3}",
            ["sweep.well.diameter.from: found 200 mm at the least", "above drillstring.collar.outer_diameter"],
        ),
        ("drillstring.collar.length: [100 m, 6000 m]", ["sweep.drillstring.collar.length", "below operation.depth"]),
        ("initial.x: [0 mm, 3 m]", ["initial.x", "off the axis"]),
        ("mud.density: {from: 0 kg/m^3, to: 1 kg/m^3, points: 3, spacing: log}", ["log spacing from 0"]),
        ("mud.density: {from: 0 kg/m^3, to: 1 kg/m^3, points: 3, spacing: cubic}", ["linear or log"]),
        ("mud.density: [900 kg/m^3], procedure: up, along: mud.drag", ["mud.drag, which is not swept"]),
    ],
)
def test_what_cannot_be_an_axis_is_said(sweep, words):
    with pytest.raises(StudyError) as error:
        parse_study(f"sweep: {{{sweep}}}", "s.yaml")
    for word in words:
        assert word in str(error.value)


def test_an_axis_is_a_dimension_of_the_file(tmp_path):
    study = parse_study(ROCK)
    run_study(study, tmp_path / "rock.h5", workers=1)
    data = open_results(tmp_path / "rock.h5")
    rock = data.bit_rock_stiffness
    assert data.status.dims == ("bit_rock_stiffness", "rotary_speed"), "in the order of the study"
    assert rock.attrs["key"] == "bit.rock_stiffness"
    assert rock.attrs["units"] == "N m-1"
    assert "rock" in rock.attrs["long_name"]
    results = read_results(tmp_path / "rock.h5")
    assert results.swept == ["rotary_speed", "bit_rock_stiffness"]
    assert results["status"].shape == (1, 1, 1, 2, 3)
    assert (results["status"] == 1).all()


def test_a_study_without_a_sweep_is_one_operating_point():
    study = parse_study("operation: {depth: 3000 m}\nsimulation: {transient: 0.1 s, observe: 0.1 s}")
    results = run_in_memory(study)
    assert results["status"].shape == (1, 1, 1, 1)
    assert results.coords["depth"].tolist() == [3000.0]


def test_every_further_axis_has_units_for_files_texts_and_pictures():
    for name, (_, units) in further_axes(described(MODEL)).items():
        assert units in CF
        assert readable(2.0, units).startswith("2")
        for system in ("si", "field"):
            assert quantity(name, system).scale > 0.0


def test_a_fault_of_an_axis_over_the_start_names_the_value_of_the_axis():
    for axis, said in {
        "initial.x: [0 mm, 3 m]": "initial.x: found 3 m at the greatest of sweep.initial.x",
        "initial.y: [-3 m, 1 m]": "initial.y: found -3 m at the least of sweep.initial.y",
    }.items():
        with pytest.raises(StudyError, match=f"line 1: {said}"):
            parse_study(f"sweep: {{{axis}}}")


def test_borders_along_equal_ratios_are_known_to_the_widest_step():
    study = parse_study("sweep: {bit.rock_stiffness: {from: 1 MN/m, to: 16 MN/m, points: 3, spacing: log}, refine: 1}")
    assert summary(study, 3, 5)["border_spacing"]["bit.rock_stiffness"] == pytest.approx(8e6, rel=1e-12)
    study = parse_study("sweep: {bit.rock_stiffness: {from: 1 MN/m, to: 9 MN/m, points: 3}, refine: 1}")
    assert summary(study, 3, 5)["border_spacing"]["bit.rock_stiffness"] == 2e6


def test_the_order_of_the_axes_is_no_part_of_a_study():
    """Points have numbers, by which an interrupted run goes on: the same study has the
    same numbers."""
    axes = ["initial.x: {from: 1 mm, to: 2 mm, points: 2}", "bit.rock_stiffness: {from: 1 MN/m, to: 2 MN/m, points: 2}"]
    one, other = (parse_study(f"sweep: {{{', '.join(order)}, refine: 1}}") for order in (axes, axes[::-1]))
    assert one.sha256 == other.sha256
    assert list(one.axes) == list(other.axes)
    assert (one.swept, one.refined, one.more) == (other.swept, other.refined, other.more)
