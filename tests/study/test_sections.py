"""The string by sections, and friction as torques, in the text of a study: what is taken, and
every fault with its key, what was found and what is allowed."""

import numpy as np
import pytest

import nsdrill
from nsdrill.app.check import lumped_string
from nsdrill.sampling import Pair, Uncertain, draw, in_order
from nsdrill.study import parse_study
from nsdrill.study.schema import json_schema
from nsdrill.study.write import study_text

from .refused import faults

HEAVY = "{length: 300 m, outer_diameter: 5 in, inner_diameter: 3 in}"
COLLAR = "{length: 150 m, outer_diameter: 8 in, inner_diameter: 2.8125 in}"
PIPE = "{outer_diameter: 5 in, inner_diameter: 4.276 in}"


def study(*rows: str, rest: str = "", depth: str = "2500 m") -> str:
    return f"drillstring:\n  sections: [{', '.join(rows)}]\noperation: {{depth: {depth}}}\n{rest}"


def test_values_come_out_in_si_with_the_defaults_of_the_steel():
    made = parse_study(
        study(PIPE, HEAVY, "{length: 500 ft, outer_diameter: 8 in, inner_diameter: 0 mm, density: 8 g/cm^3}")
    )
    first, _, last = made.parameters.drillstring.sections
    assert (first.length, first.outer_diameter, first.inner_diameter) == (None, 0.127, 0.1086104)
    assert (last.length, last.density, last.shear_modulus) == (152.4, 8000.0, None)


@pytest.mark.parametrize("model", ["christoforou_yigit", "torsion", "segments", "beam"])
def test_the_text_of_a_study_reads_back_the_same(model):
    text = study(PIPE, HEAVY, COLLAR, rest=f"model: {model}\n")
    text += "well: {diameter: 12.25 in}\n" if model != "torsion" else ""
    made = parse_study(text)
    again = parse_study(study_text(made.resolved))
    assert (again.sha256, again.parameters) == (made.sha256, made.parameters)


def test_the_collar_that_bends_and_the_impedance_follow_from_the_sections():
    made = parse_study(study(PIPE, HEAVY, COLLAR, "{length: 2 m, outer_diameter: 9 in, inner_diameter: 3 in}"))
    collar, pipe = made.parameters.drillstring.collar, made.parameters.drillstring.pipe
    assert (collar.outer_diameter, collar.inner_diameter, collar.length) == (8 * 0.0254, 2.8125 * 0.0254, 150.0)
    assert (pipe.outer_diameter, pipe.inner_diameter) == (0.127, 0.1086104)
    said = parse_study(study(PIPE, HEAVY, COLLAR), "s.yaml", ["drillstring.collar.outer_diameter=7 in"])
    assert said.parameters.drillstring.collar.outer_diameter == 0.1778


def test_lengths_make_the_depth_where_it_is_not_given():
    first = "{length: 2000 m, outer_diameter: 5 in, inner_diameter: 4.276 in}"
    made = parse_study(f"drillstring: {{sections: [{first}, {COLLAR}]}}\n")
    assert made.operation.depth == 2150.0
    assert parse_study(study(first, COLLAR, depth="2151 m")).operation.depth == 2151.0  # within 0.1 %


def test_along_a_depth_the_length_of_the_first_is_not_read_which_is_said():
    first = "{length: 2000 m, outer_diameter: 5 in, inner_diameter: 4.276 in}"
    made = parse_study(f"drillstring: {{sections: [{first}, {COLLAR}]}}\nsweep: {{depth: [500 m, 900 m]}}\n")
    (note,) = made.notes
    assert "reaches to the surface at every depth" in note
    assert "2000 m" in note


def test_a_section_by_weight_has_the_bore_of_an_even_tube():
    made = parse_study(study("{outer_diameter: 5 in, weight: 17.93 lb/ft}", COLLAR))
    assert made.parameters.drillstring.pipe.inner_diameter == pytest.approx(4.276 * 0.0254, rel=1e-3)  # API RP 7G
    assert "bore of" in made.notes[0]


WRONG = [
    (study(PIPE, COLLAR.replace("150 m", "0 m")), "drillstring.sections[1].length", "at least 1 mm"),
    (study(PIPE, COLLAR.replace("150 m", "-3 m")), "drillstring.sections[1].length", "at least 1 mm"),
    (study(PIPE, COLLAR.replace("length: 150 m, ", "")), "drillstring.sections[1].length", "only the first"),
    (study(PIPE, COLLAR.replace("2.8125 in", "8 in")), "drillstring.sections[1].inner_diameter", "8 in"),
    (study("{outer_diameter: 5 in, weight: 90 lb/ft}"), "drillstring.sections[0].weight", "(a rod)"),
    (study("{outer_diameter: 5 in, weight: 0.01 lb/ft}"), "drillstring.sections[0].weight", "(a wall)"),
    (study("{outer_diameter: 5 in}"), "drillstring.sections[0]", "one of the two"),
    (study("{inner_diameter: 3 in}"), "drillstring.sections[0].outer_diameter", "a value"),
    (study(PIPE, COLLAR, depth="150 m"), "operation.depth", "more than the sections below the first"),
    (study(PIPE.replace("{", "{length: 900 m, "), COLLAR), "drillstring.sections[0].length", "2500 m"),
    (f"drillstring: {{sections: [{PIPE}]}}\n", "drillstring.sections[0].length", "operation.depth"),
    (study(PIPE, COLLAR, rest="well: {diameter: 8 in}\n"), "drillstring.sections[1].outer_diameter", "well.diameter"),
    (study(PIPE, COLLAR.replace("150 m", "9 m")).replace("operation", "  collar: {span: 3000 m}\noperation"),
     "drillstring.collar.span", "at most"),
    (study(PIPE, COLLAR).replace("operation", "  pipe: {outer_diameter: 5 in}\noperation"), "drillstring.pipe", "win"),
    (study(PIPE, COLLAR).replace("operation", "  collar: {length: 80 m}\noperation"),
     "drillstring.collar.length", "win"),
    (study(PIPE, COLLAR, rest="sweep: {drillstring.pipe.outer_diameter: [4 in, 5 in]}\n"),
     "sweep.drillstring.pipe.outer_diameter", "win"),
    (study(PIPE, COLLAR, rest="sweep: {depth: [100 m, 900 m]}\n"), "sweep.depth", "more than the sections"),
    ("drillstring: {sections: []}\n", "drillstring.sections", "one to 40"),
    ("drillstring: {torsional_stiffness: 400 N*m/rad}\nsweep: {depth: [1 km, 2 km]}\n", "sweep.depth", "one depth"),
    ("drillstring: {rotary_inertia: 0 kg*m^2}\n", "drillstring.rotary_inertia", "at least"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "key", "allowed"), WRONG)
def test_each_fault_has_its_key_and_what_is_allowed(text, key, allowed):
    (found, *others) = faults(text)
    assert found.key == key
    assert not others
    assert allowed in found.allowed
    assert found.line is not None


def test_a_span_longer_than_all_sections_does_not_matter_where_nothing_bends():
    short = "drillstring: {sections: [{length: 3 m, outer_diameter: 60 mm, inner_diameter: 0 mm}]}\n"
    assert faults(short)[0].key == "drillstring.collar.span"
    assert parse_study(short + "modes: {lateral: frozen}\n").operation.depth == 3.0


def test_the_schema_knows_sections_and_torques():
    schema = str(json_schema())
    assert "drillstring.sections" in schema or "DrillstringSections" in schema
    friction = json_schema()["$defs"]["BitFriction"]["properties"]["static"]
    assert [one["type"] for one in friction["anyOf"]] == ["number", "string"]


# Friction as torques


TORQUES = "bit: {friction: {static: 12 kN*m, dynamic: 7 kN*m}}\n"


@pytest.mark.parametrize("model", ["christoforou_yigit", "torsion", "beam", "segments"])
def test_a_friction_with_a_unit_of_torque_is_one(model):
    friction = parse_study(f"model: {model}\n{TORQUES}operation: {{wob: 0 kN}}\n").parameters.bit.friction
    assert (friction.static_torque, friction.dynamic_torque, friction.by_torque) == (12e3, 7e3, True)


def test_an_elastic_collar_off_bottom_turns_as_the_string_that_only_turns():
    """A collar on its axis, whose friction at the bit is two torques: the same stick-slip as in
    the model of torsion, by either way of integration, and whatever the weight on bit."""
    names = ("bit_speed_max", "stuck_fraction", "surface_torque_max", "stick_slip_period")
    run = "simulation: {transient: 20 s, observe: 40 s, method: %s}\n"
    run += "operation: {depth: 2000 m, wob: %s, rotary_speed: 5 rad/s}\n"
    collar = "model: beam\ndrillstring: {eccentricity: 0 mm}\n"
    axis = "modes: {axial: frozen, lateral: frozen}\n"
    text = "bit: {friction: {static: 12 kN*m, dynamic: 7 kN*m}, surface_amplitude: 0 mm}\n"
    found = {
        key: nsdrill.run(head + text + run % (method, wob), progress=False)
        for key, head, method, wob in (
            ("lumped", axis, "auto", "0 kN"),
            ("beam", collar, "implicit", "0 kN"),
            ("explicit", collar, "explicit", "0 kN"),
            ("loaded", collar, "implicit", "50 kN"),
        )
    }
    values = {key: [one[name].item() for name in names] for key, one in found.items()}
    assert values["lumped"][1] > 0.2
    for key in ("beam", "explicit", "loaded"):
        np.testing.assert_allclose(values[key], values["lumped"], rtol=5e-3)


def test_torques_are_axes_and_unknowns_and_settings():
    made = parse_study(TORQUES, "s", ["sweep.bit.friction.static=[9 kN*m, 12 kN*m]", "bit.friction.dynamic=6 kft*lbf"])
    assert made.axes["bit.friction.static_torque"].tolist() == [9e3, 12e3]
    assert made.more[0].units == "N m"
    assert made.parameters.bit.friction.dynamic_torque == pytest.approx(8134.9, rel=1e-4)
    drawn = parse_study(TORQUES, "s", ["uncertain.bit.friction.static={uniform: [9 kN*m, 12 kN*m]}"])
    assert [unknown.units for unknown in drawn.unknowns] == ["N m"]


def test_a_torque_that_only_varies_needs_no_value():
    made = parse_study(
        "bit: {friction: {dynamic: 7 kN*m}}\nsweep: {bit.friction.static: {from: 8 kN*m, to: 12 kN*m, points: 5}}\n"
    )
    assert made.parameters.bit.friction.static_torque == 12e3
    assert parse_study(study_text(made.resolved)).sha256 == made.sha256


MIXED = [
    ("bit: {friction: {static: 12 kN*m, dynamic: 0.3}}\n", "bit.friction.dynamic", "as static has"),
    ("bit: {friction: {static: 0.5, dynamic: 7 kN*m}}\n", "bit.friction.static", "as dynamic has"),
    ("bit: {friction: {static: 12 kN*m}}\n", "bit.friction.dynamic", "as static has"),
    (TORQUES + "sweep: {bit.friction.static: [0.4, 0.5]}\n", "sweep.bit.friction.static", "as dynamic has"),
    (TORQUES.replace("12", "6"), "bit.friction.dynamic_torque", "at most bit.friction.static_torque"),
    (TORQUES.replace("static: 12 kN*m", "law: rational, static: 12 kN*m"), "bit.friction.static_torque", "b0, b1"),
    ("bit: {friction: {static: 12 kN}}\n", "bit.friction.static", "a number"),
    (TORQUES + "sweep: {bit.cutting.zeta: [0, 1]}\n", "sweep.bit.cutting.zeta", "reads"),
]


@pytest.mark.parametrize(("text", "key", "allowed"), MIXED)
def test_a_torque_beside_a_coefficient_is_refused_by_name(text, key, allowed):
    found = faults(text)[0]
    assert found.key == key
    assert allowed in found.allowed


def test_at_takes_a_torque_by_the_key_of_the_coefficient():
    text = f"modes: {{axial: frozen, lateral: frozen}}\n{TORQUES}operation: {{wob: 0 kN}}\n"
    trace = nsdrill.simulate(text, at={"bit.friction.static": "2 kN*m", "bit.friction.dynamic": "1 kN*m"})
    assert float(np.abs(trace.bit_torque).max()) < 2e3


# Unknowns in order


ORDERED = (
    "uncertain: {bit.friction.static: {uniform: [0.2, 0.8]}, bit.friction.dynamic: {uniform: [0.05, 0.5]}, "
    "samples: 64, seed: 3}\n"
)


def test_draws_against_the_order_are_left_out_and_that_is_said():
    made = parse_study(ORDERED)
    static, dynamic = made.drawn["bit.friction.static"], made.drawn["bit.friction.dynamic"]
    assert static.shape == (64,)
    assert np.all(dynamic <= static)
    assert dynamic.max() > static.min()  # the ranges do overlap
    (note,) = made.notes
    assert "against the order" in note
    assert np.array_equal(parse_study(ORDERED).drawn["bit.friction.static"], static)


def test_the_samples_in_order_are_the_first_of_the_sequence():
    unknown = Uncertain({"a": {"uniform": [0.0, 1.0]}, "b": {"uniform": [0.0, 1.0]}}, samples=100, seed=5)
    pair = Pair("a", "b", equal=True)
    longer = draw(Uncertain(unknown.distributions, samples=512, seed=5))
    kept = in_order(longer, [pair])
    found = draw(unknown, [pair])
    for key in ("a", "b"):
        assert np.array_equal(found[key], longer[key][kept][:100])


def test_ranges_that_do_not_overlap_keep_their_samples():
    unknown = Uncertain({"a": {"uniform": [0.0, 1.0]}, "b": {"uniform": [1.0, 2.0]}}, samples=100)
    one, other = draw(unknown), draw(unknown, [Pair("a", "b")])
    assert all(np.array_equal(one[key], other[key]) for key in one)


def test_saltelli_and_ranges_against_the_order_are_refused():
    assert "sobol" in faults(ORDERED, "uncertain.design=saltelli")[0].allowed
    hardly = faults(ORDERED, "uncertain.bit.friction.static={uniform: [0.01, 0.0502]}")
    assert "one draw in 64" in hardly[0].allowed


def test_ordered_unknowns_have_no_total_index():
    text = "model: torsion\nsimulation: {transient: 1 s, observe: 2 s}\n" + ORDERED.replace("64", "32")
    assert nsdrill.sensitivity(nsdrill.run(text, progress=False))["dependent"]


def test_a_fit_leaves_out_what_is_against_the_order(tmp_path):
    (tmp_path / "rig.csv").write_text("rotary_speed [rad/s], surface_torque_max [kN.m]\n4, 8.2\n6, 8.0\n")
    text = (
        "model: torsion\nsimulation: {transient: 10 s, observe: 15 s}\noperation: {wob: 0 kN}\n"
        "uncertain: {bit.friction.static: {uniform: [4 kN*m, 9 kN*m]}, "
        "bit.friction.dynamic: {uniform: [3 kN*m, 7 kN*m]}}\n"
    )
    found = nsdrill.fit(text, tmp_path / "rig.csv", batch=16, rounds=2, samples=16, progress=False)
    assert np.all(found.samples["bit.friction.dynamic_torque"] <= found.samples["bit.friction.static_torque"])
    assert found.note["left_out"] > 0
    assert found.note["failed"] == 0


def test_a_weight_that_fits_no_bore_is_told_in_its_unit():
    text = "drillstring:\n  sections: [{outer_diameter: 5 in, weight: 100 lb/ft}]\noperation: {depth: 2000 m}\n"
    assert "66.82 lb/ft (a rod)" in faults(text)[0].allowed
    assert "66.82 lb/ft" in faults("drillstring: {pipe: {outer_diameter: 5 in, weight: 80 lb/ft}}\n")[0].allowed


def test_a_section_by_its_places_is_told_that_it_has_a_length():
    text = "drillstring:\n  sections: [{from: 0 m, to: 900 m, outer_diameter: 5 in, inner_diameter: 4 in}]\n"
    found = faults(text + "operation: {depth: 2000 m}\n")
    assert [one.key.rpartition(".")[2] for one in found[:2]] == ["from", "to"]
    assert all("Each has its length" in one.suggestion and "continue" not in one.suggestion for one in found[:2])


SLENDER = """
drillstring:
  sections:
    - {outer_diameter: 5 in, inner_diameter: 4.276 in}
    - {length: 5000 ft, outer_diameter: 3.5 in, inner_diameter: 2.764 in}
    - {length: 700 ft, outer_diameter: 3.5 in, inner_diameter: 2.0625 in}
    - {length: 200 ft, outer_diameter: 4.75 in, inner_diameter: 2.25 in}
  collar: {span: 45 ft}
well: {diameter: 6.125 in}
operation: {depth: 16400 ft, wob: 8 klbf, rotary_speed: 120 rpm}
"""


def test_a_lumped_string_that_is_far_from_its_first_wave_is_told():
    """Thin pipe above the bit swings with it: the spring and the mass are 18 % too fast."""
    (text,) = lumped_string(parse_study(SLENDER))["field"]
    assert "13.88 rpm, is 18 % above that of its first standing wave, 11.77 rpm" in text
    assert lumped_string(parse_study("operation: {depth: 9500 ft}")) == {}
