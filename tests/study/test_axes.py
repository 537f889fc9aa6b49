"""Axes, starts and ramps in the study file: how they are asked for, and what is wrong with
what."""

import tracemalloc
from contextlib import suppress

import numpy as np
import pytest

from nsdrill.app.running.refinement import summary
from nsdrill.app.running.run import run_in_memory, run_study
from nsdrill.data import value_at
from nsdrill.errors import FileError, StudyError
from nsdrill.models.choices import further_axes
from nsdrill.models.operation import Ramp
from nsdrill.models.registry import described
from nsdrill.models.rules import Order
from nsdrill.store import open_results, read_results
from nsdrill.study import json_schema, parse_study, study_from_resolved, template_text
from nsdrill.study.keys import keys_named
from nsdrill.unit_table import CF
from nsdrill.units import readable
from nsdrill.variables import MODEL
from nsdrill.words.labels import quantity

from .refused import faults

ROCK = """\
sweep:
  bit.rock_stiffness: {from: 10 MN/m, to: 90 MN/m, points: 3, spacing: log}
  rotary_speed: [3 rad/s, 5 rad/s]
simulation: {transient: 0.2 s, observe: 0.2 s}
record: {peaks: 0}
"""


@pytest.mark.parametrize(("given", "axis", "base"), [
    ("drillstring: {pipe: {outer_diameter: 0.1 m}}", "drillstring.pipe.inner_diameter: [0.05 m, 0.06 m]", 0.06),
    ("drillstring: {pipe: {inner_diameter: 0.14 m}}", "drillstring.pipe.outer_diameter: [0.16 m, 0.18 m]", 0.16),
    ("bit: {friction: {dynamic: 0.6}}", "bit.friction.static: [0.7, 0.9]", 0.7),
])  # fmt: skip
def test_a_default_that_an_axis_replaces_does_not_count(given, axis, base):
    """The default, a bore of 108.6 mm in a pipe of 100 mm, was refused although no point has it."""
    key = axis.partition(":")[0]
    study = parse_study(f"{given}\nsweep: {{{axis}, rotary_speed: 60 rpm}}\n")
    assert value_at(study.resolved, key) == base  # the nearest that a point has
    assert study.axes[key].tolist() == sorted(study.axes[key])


def test_values_that_points_have_are_refused_as_before():
    text = "drillstring: {pipe: {outer_diameter: 0.1 m}}\nsweep: {drillstring.pipe.inner_diameter: [0.05 m, 0.12 m]}\n"
    with pytest.raises(StudyError, match=r"at most 0\.999 times drillstring\.pipe\.outer_diameter"):
        parse_study(text)


def test_every_number_of_the_string_is_an_axis():
    """By the same keys in the study and in the model, but for those of the operation."""
    further = {key for key, _ in further_axes(described(MODEL)).values()}
    assert further | {"depth", "wob", "rotary_speed"} == set(keys_named().axes)
    assert all(keys_named().axes[key].units == units for key, units in further_axes(described(MODEL)).values())


def test_what_two_ranges_have_in_common_is_one_value():
    """Though their ways to it differ in the last bits."""
    parts = np.linspace(0.0, 0.7, 8), np.linspace(0.1, 0.5, 5)
    assert len({*np.concatenate(parts).tolist()}) > 8
    study = parse_study("sweep: {wob: [{from: 0 N, to: 0.7 N, points: 8}, {from: 0.1 N, to: 0.5 N, points: 5}]}")
    assert study.axes["wob"] == pytest.approx(parts[0], rel=1e-15)


def test_spacing_is_linear_or_logarithmic():
    axes = parse_study(ROCK).axes
    np.testing.assert_allclose(axes["bit.rock_stiffness"], [10e6, 30e6, 90e6], rtol=1e-15)
    assert axes["bit.rock_stiffness"][[0, -1]].tolist() == [10e6, 90e6]
    fine = parse_study(ROCK, overrides=["sweep.refine=2"]).axes["bit.rock_stiffness"]
    assert fine[::4].tobytes() == axes["bit.rock_stiffness"].tobytes(), "a refined axis keeps its values"
    flat = parse_study(ROCK, overrides=["sweep.bit.rock_stiffness.spacing=linear"]).axes["bit.rock_stiffness"]
    assert flat.tolist() == [10e6, 50e6, 90e6]


def test_an_axis_takes_the_place_of_its_number():
    assert parse_study(ROCK, overrides=["bit.rock_stiffness=70 MN/m"]).sha256 == parse_study(ROCK).sha256


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


SWEEP = "sweep: {depth: [1 km, 2 km]}\n"
PLANE = "{vx: {from: 1 m/s, to: -1 m/s, points: 4}, x: {from: -7 mm, to: 70 mm, points: 3}}"


def test_one_start_by_default():
    assert parse_study(SWEEP).initial.starts == 0
    assert parse_study(SWEEP + "initial: {ensemble: 1, x: 2 mm}").initial.starts == 0
    assert parse_study(SWEEP + "initial: {slice: null}").initial.starts == 0


def test_an_ensemble():
    study = parse_study(SWEEP + "initial: {ensemble: 64, seed: 3, spread: 0.5}")
    assert (study.initial.starts, study.initial.seed, study.initial.spread) == (64, 3, 0.5)
    assert study.sha256 != parse_study(SWEEP + "initial: {ensemble: 64, seed: 4, spread: 0.5}").sha256


def test_a_slice_in_the_order_of_the_states_ascending():
    study = parse_study(SWEEP + f"initial: {{y: 1 mm, slice: {PLANE}}}")
    assert study.initial.slice == {
        "x": {"from": -7e-3, "to": 70e-3, "points": 3},
        "vx": {"from": -1.0, "to": 1.0, "points": 4},
    }
    assert list(study.initial.slice) == ["x", "vx"]
    assert (study.initial.starts, study.initial.y) == (12, 1e-3)


def test_the_template_may_become_an_ensemble():
    """It gives every state its default, which is no wish for a state."""
    assert parse_study(template_text(), overrides=["initial.ensemble=8"]).initial.starts == 8


@pytest.mark.parametrize(
    ("initial", "key", "found", "allowed"),
    [
        ("{ensemble: 8, x: 2 mm}", "initial.x", "with an ensemble, which draws all states", "left out"),
        ("{ensemble: 8, bit_speed: 3 rad/s}", "initial.bit_speed", "an ensemble", "left out"),
        ("{ensemble: -1}", "initial.ensemble", "-1", "at least 0"),
        ("{ensemble: 2, spread: 0}", "initial.spread", "0", "at least 1e-06 and at most 1"),
        ("{ensemble: 2, spread: 10 mm}", "initial.spread", "'10 mm'", "a number"),
        ("{ensemble: 2, seed: -3}", "initial.seed", "-3", "at least 0"),
        (f"{{ensemble: 8, slice: {PLANE}}}", "initial.ensemble", "8 beside initial.slice", "one of the two"),
        ("{slice: {x: {from: 0 mm, to: 1 mm, points: 2}}}", "initial.slice", "1 of them (x)", "two states"),
        ("{slice: 5}", "initial.slice", "5", "x, vx, y, vy, z, vz, twist, bit_speed, drive_angle"),
        ("{slice: {q: {from: 0 mm, to: 1 mm, points: 2}}}", "initial.slice.q", "an unknown key", "x, vx, y"),
        ("{slice: {x: {from: 0, to: 1 mm, points: 2}}}", "initial.slice.x.from", "without a unit", "mm"),
        ("{slice: {x: {from: 0 mm, points: 2}}}", "initial.slice.x.to", "nothing", "all of from, to and points"),
        ("{slice: {x: {from: 0 mm, to: 0 mm, points: 2}}}", "initial.slice.x", "the same", "that differ"),
        ("{slice: {x: {from: 0 mm, to: 1 mm, points: 1}}}", "initial.slice.x.points", "1", "at least 2"),
        (f"{{slice: {PLANE.replace('4', '400000')}}}", "initial.slice", "1.2e+06 starts", "at most 100 000"),
        (f"{{vx: 1 m/s, slice: {PLANE}}}", "initial.vx", "which initial.slice varies", "left out"),
        (f"{{y: 600 mm, slice: {PLANE}}}", "initial.slice", "604", "the gap"),
    ],
)
def test_faults(initial, key, found, allowed):
    fault = faults(SWEEP + f"initial: {initial}")[0]
    assert fault.key == key
    assert found in fault.found
    assert allowed in fault.allowed


@pytest.mark.parametrize("initial", ["ensemble: 8", f"slice: {PLANE}"])
@pytest.mark.parametrize("procedure", ["up", "down", "up-down"])
def test_starts_of_their_own_and_a_carried_state_exclude_each_other(initial, procedure):
    (fault,) = faults(SWEEP + f"initial: {{{initial}}}", f"sweep.procedure={procedure}")
    assert "carries the state on" in fault.found
    assert fault.allowed == "with sweep.procedure: same"


def test_starts_count_among_the_points():
    (fault,) = faults("sweep: {wob: {from: 1 N, to: 1 kN, points: 10001}}\ninitial: {ensemble: 10000}")
    assert "100 010 000 points over all axes and starts" in fault.found


TEN = "rotary_speed: {from: 2 rad/s, to: 8 rad/s, points: 10000}"
MANY = "rotary_speed: {from: 2 rad/s, to: 8 rad/s, points: 9000000"


@pytest.mark.parametrize(
    ("text", "number"),
    [
        ("sweep: {rotary_speed: {from: 2 rad/s, to: 8 rad/s, points: 100000000}}", "100000000"),
        (f"sweep: {{{TEN}, wob: {{from: 1 kN, to: 9 kN, points: 10000}}}}", "100 000 000 points over all axes"),
        (f"sweep: {{{MANY}}}, procedure: up-down}}", "18 000 000 points over all axes, up and down"),
        # 8999999 * 64 + 1
        (f"sweep: {{{MANY}, spacing: log}}, refine: 6}}", "575 999 937 points over all axes, refined"),
        (f"sweep: {{{MANY}}}, bit.lobes: {{from: 1, to: 5, points: 5}}}}", "45 000 000 points"),
        (f"sweep: {{bit.lobes: {{from: 1, to: 5, points: 9000000}}, {TEN}}}", "90 000 000 000 points"),
        (f"sweep: {{{TEN}}}\ninitial: {{ensemble: 10000}}", "100 000 000 points over all axes and starts"),
        (
            f"sweep: {{{TEN}}}\nuncertain: {{bit.rock_stiffness: {{uniform: [9 MN/m, 30 MN/m]}}, samples: 8192}}",
            "81 920 000 points over all axes and samples",
        ),
        (f"sweep: {{wob: [{', '.join(['{from: 1 kN, to: 9 kN, points: 90000}'] * 200)}]}}", "18 000 000 values"),
    ],
)
def test_too_many_points_are_refused_by_their_number(text, number):
    """Before an axis is made: a million of its values take 8 MB."""
    with suppress(StudyError):
        parse_study(text.replace("0000", "2"))  # what is imported is no axis
    tracemalloc.start()
    (fault,) = faults(text)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert number in fault.found
    assert "at most" in fault.allowed
    assert peak < 8e6


OF_RAMPS = "sweep: {wob: [1 kN, 2 kN]}\n"
KNOTS = "[[0 s, 30 rpm], [1 min, 60 rpm], [100 s, 6.5 rad/s]]"


def test_a_ramp_is_read_into_si():
    study = parse_study(f"operation:\n  wob: 3 kN\n  rotary_speed: {{ramp: {KNOTS}}}\n")
    assert study.swept == ()
    assert study.ramped == ("rotary_speed",)
    ramp = study.ramps["rotary_speed"]
    assert ramp.times == (0.0, 60.0, 100.0)
    assert ramp.values == pytest.approx((3.14159265, 6.28318531, 6.5))
    assert study.operation.rotary_speed == ramp.values[0]
    assert study.operation.wob == 3000.0


def test_all_three_may_ramp_and_overrides_give_ramps():
    study = parse_study(
        OF_RAMPS,
        overrides=[
            "operation.depth={ramp: [[0 s, 1 km], [1 h, 1.1 km]]}",
            "operation.rotary_speed={ramp: [[0 s, 1 rad/s], [1 s, 2 rad/s]]}",
            "operation.wob={ramp: [[0 s, 0 N], [1 s, 5 klbf]]}",
        ],
    )
    assert set(study.ramps) == {"depth", "wob", "rotary_speed"}
    assert study.ramped == ("depth", "rotary_speed")  # the sweep replaces that of wob
    assert study.ramps["depth"] == Ramp((0.0, 3600.0), (1000.0, 1100.0))


@pytest.mark.parametrize(
    ("ramp", "key", "found", "allowed"),
    [
        ("[[0 s, 3 rad/s]]", ".ramp", "one knot", "two knots"),
        ("[]", ".ramp", "an empty list", "two knots"),
        ("3", ".ramp", "the number 3", "a list of knots"),
        ("null", ".ramp", "nothing", "a list of knots"),
        ("[[1 s, 3 rpm], [2 s, 3 rpm]]", ".ramp[0][0]", "1 s", "0 s"),
        ("[[0 s, 3 rpm], [2 s, 3 rpm], [2 s, 4 rpm]]", ".ramp[2][0]", "2 s", "ascend"),
        ("[[0 s, 3 rpm], [5, 4 rpm]]", ".ramp[1][0]", "without a unit", "s, min or h"),
        ("[[0 s, 3 rpm], [5 s, 4 m]]", ".ramp[1][1]", "units of length", "rad/s or rpm"),
        ("[[0 s, 3 rpm], [5 s, 0 rpm]]", ".ramp[1][1]", "0 rpm", "at least 1e-09 rad/s"),
        ("[[0 s, 3 rpm], [5 s]]", ".ramp[1]", "a list of 1", "[time, value]"),
        ("[[0 s, 3 rpm], 5 s]", ".ramp[1]", "5 s", "[time, value]"),
        ("[[0 s, 3 rpm], [5 s, [1 rpm]]]", ".ramp[1][1]", "a list", "rad/s or rpm"),
    ],
)
def test_one_fault_of_a_ramp(ramp, key, found, allowed):
    (fault,) = faults(f"operation:\n  rotary_speed:\n    {{ramp: {ramp}}}\n")
    assert fault.key == "operation.rotary_speed" + key
    assert fault.line == 3
    assert found in fault.found
    assert allowed in fault.allowed


@pytest.mark.parametrize(
    ("value", "key", "says"),
    [
        ("{}", "operation.wob.ramp", "{ramp: [[0 s, VALUE]"),
        ("{ramp: [[0 s, 1 N], [1 s, 2 N]], rate: 3}", "operation.wob.rate", "ramp"),
        ("[1 N, 2 N]", "operation.wob", "a number with its unit"),
        ("[[0 s, 1 N], [1 s, 2 N]]", "operation.wob", "a ramp, for nsdrill simulate, is {ramp: [[0 s, VALUE]"),
    ],
)
def test_something_else_than_a_ramp(value, key, says):
    (fault,) = faults(f"{OF_RAMPS}operation: {{wob: {value}}}")
    assert fault.key == key
    assert says in fault.allowed


def test_every_depth_of_a_ramp_lies_below_the_collars():
    (fault,) = faults("operation:\n  depth: {ramp: [[0 s, 900 m], [1 s, 200 m], [2 s, 900 m]]}")
    assert fault.key == "operation.depth.ramp[1][1]"
    assert fault.line == 2
    assert "length of the collars" in fault.allowed


def test_a_ramp_is_not_carried():
    (fault,) = faults("sweep: {procedure: up}\noperation: {wob: {ramp: [[0 s, 1 N], [1 s, 2 N]]}}")
    assert fault.key == "sweep"


def test_digests_know_only_the_ramps_that_count():
    """A study without ramps has the digest that it always had; a ramp that a sweep
    replaces does not matter."""
    assert "ramps" not in parse_study(OF_RAMPS).resolved
    replaced = parse_study(OF_RAMPS + "operation: {wob: {ramp: [[0 s, 1 N], [1 s, 2 N]]}}")
    assert replaced.sha256 == parse_study(OF_RAMPS).sha256
    one, other = (f"[[0 s, 30 rpm], [1 min, {end}]]" for end in ("60 rpm", "65 rpm"))
    digests = {parse_study(f"operation: {{rotary_speed: {{ramp: {knots}}}}}").sha256 for knots in (one, other)}
    assert len(digests) == 2


def test_damaged_ramps_are_a_file_error():
    resolved = parse_study(f"operation: {{rotary_speed: {{ramp: {KNOTS}}}}}").resolved
    for ramps in ({"mud": [[0.0, 1.0], [1.0, 2.0]]}, {"wob": [[0.0], [1.0]]}, {"wob": 3}):
        with pytest.raises(FileError, match=r"out\.h5"):
            study_from_resolved({**resolved, "ramps": ramps}, source="out.h5")


def test_the_schema_for_editors_takes_both_forms():
    jsonschema = pytest.importorskip("jsonschema")
    validator = jsonschema.Draft202012Validator(json_schema())
    good = ({"operation": {"wob": "3 kN"}}, {"operation": {"wob": {"ramp": [["0 s", "3 kN"], ["1 s", "4 kN"]]}}})
    for data in good:
        validator.validate(data)
    for data in ({"operation": {"wob": {"ramp": [["0 s", "3 kN", "1 N"]]}}}, {"operation": {"wob": {}}}):
        with pytest.raises(jsonschema.ValidationError):
            validator.validate(data)


def test_an_order_of_a_ramp_has_its_factor_and_may_be_equal(monkeypatch):
    """The length of the collars is 200 m, and the least depth 900 m."""
    text = "operation:\n  depth: {ramp: [[0 s, 900 m], [1 s, 1000 m]]}"
    for factor, equal, words in (
        (0.25, True, None),
        (200 / 900, True, None),
        (200 / 900, False, "more than 4.5 times drillstring.collar.length"),
        (0.2, True, "at least 5 times drillstring.collar.length"),
    ):
        order = Order("drillstring.collar.length", "operation.depth", equal=equal, factor=factor)
        monkeypatch.setitem(vars(described(MODEL)), "orders", (order,))
        if words is None:
            parse_study(text)
        else:
            assert words in faults(text)[0].allowed
