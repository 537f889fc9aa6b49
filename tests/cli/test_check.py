"""nsdrill check: the coefficients, the warnings, and the JSON that scripts rely on."""

import json
import math
import re
from pathlib import Path

import pytest

import nsdrill
from nsdrill.app.check import _amount_text
from nsdrill.models.christoforou_yigit.coefficients import derive
from nsdrill.models.christoforou_yigit.parameters import Parameters
from nsdrill.models.contents import Contents
from nsdrill.store import record_dtype

from .helpers import changed, unwrapped

NAMES = ["m_c", "m_f", "m_l", "m_e", "k_bend", "c_h", "m_a", "k_a", "J", "k_t"]
NAMES += ["gap", "depth_of_cut", "cutting_arm", "buckling_load"]


def test_json(call, small):
    answer = call("check", small, "--json")
    assert answer.err == ""
    report = json.loads(answer.out)
    assert list(report["coefficients"]) == NAMES
    assert report["size"]["disk"] == {
        "value": 16 * record_dtype(Contents(4, options=("drilled",))).itemsize,
        "units": "B",
    }
    for coefficient in report["coefficients"].values():
        assert set(coefficient) == {"value", "units"}
    k = derive(Parameters(), 2000.0, 22240.0, 3.0)
    for name in NAMES:
        assert report["coefficients"][name]["value"] == pytest.approx(getattr(k, name), rel=1e-12)
    assert report["coefficients"]["k_t"]["units"] == "N m/rad"
    # gap and Euler load from their definitions: (0.381 - 0.2286)/2, and 2 l^2/pi^2 of
    # k_bend with l = 19.81 m.
    assert report["coefficients"]["gap"]["value"] == pytest.approx(0.0762, rel=1e-12)
    assert report["points"] == 16
    assert report["chains"] == 1


def test_what_a_run_would_refuse_is_said(call, small, monkeypatch):
    """1001 x 1000 runs need --large; 40 bytes * 1001000 are more than 20 MB of memory."""
    more = ["--set", "sweep.wob={from: 1 kN, to: 9 kN, points: 1001}", "--set", "sweep.procedure=same"]
    axis = ["--set", "sweep.rotary_speed={from: 1 rad/s, to: 9 rad/s, points: 1000}"]
    answer = call("check", small, *more, *axis)
    assert "Large: 1 001 000 points; nsdrill run takes up to 1 000 000, or more with --large." in unwrapped(answer.err)
    assert "memory" not in answer.err
    monkeypatch.setattr("nsdrill.app.check.memory_free", lambda: 2e7)
    monkeypatch.setattr("nsdrill.app.check.BASE", 1e6)
    assert "Too large for the memory: found a sweep of 1 001 000 points" in unwrapped(
        call("check", small, *more, *axis).err
    )


def test_the_time_is_told_where_it_is_asked_for(call, small):
    assert "Time:" not in call("check", small).out
    text = call("check", small, "--price").out
    assert re.search(
        r"^Time: about [\d.]+ to [\d.]+ (s|min) on \d+ processors? \(\d+ runs timed for 16 points\)\.$", text, re.M
    )
    found = json.loads(call("check", small, "--price", "--json").out)["price"]
    assert found["low"]["value"] < found["seconds"]["value"] < found["high"]["value"]
    assert {found[name]["units"] for name in ("low", "seconds", "high", "took")} == {"s"}
    assert found["runs"] == 16
    assert nsdrill.check(small).price is None
    assert nsdrill.check(small, price=True).price.runs == 16


def test_text(call, small):
    # without lobes nothing makes the bit bounce, and without a fall of the friction it does not stick
    even = ("bit.friction.static=0.3", "bit.friction.dynamic=0.3")
    answer = call(
        "check",
        small,
        *changed(
            "simulation.observe=200 s",
            "simulation.transient=10 s",
            "bit.surface_amplitude=0 mm",
            "record.peaks=6",
            *even,
        ),
    )
    # the friction that has no fall is not known to have none, nor the mud to rest
    assert answer.err.startswith("Warning: Sensitive")
    assert answer.err.count("Warning: ") == 1
    lines = answer.out.splitlines()
    assert lines[0] == f"{small}: valid. Small"
    assert lines[1] == (
        "16 points: speed 1 rad/s to 8 rad/s (8 values); the state carried up and back down along the speed, in 1 "
        "chain."
    )
    for name in (*NAMES, "torsional", "wall_speed", "lift_off_wob"):
        assert any(line.split()[:1] == [name] for line in lines)


def test_further_figures(call, small):
    further = ("pipe_sinusoidal", "lateral_2", "axial_rock_wave_4")
    short, full = (call("check", small, *words).out for words in ([], ["--all"]))
    figures = json.loads(call("check", small, "--json").out)["figures"]
    assert "further quantities with --all" in short
    assert "with --all" not in full
    for name in further:
        assert name not in short
        (line,) = (line.split() for line in full.splitlines() if line.split()[:1] == [name])
        assert float(line[1]) == pytest.approx(figures[name]["value"], rel=1e-5)
    headings = ("Coefficients", "Axial motion", "Rotation and drive", "Lateral motion", "Buckling")
    assert [line for line in full.splitlines() if line in headings] == list(headings)
    shown = {line.split()[0] for line in full.splitlines() if line.startswith("  ")}
    assert set(figures) <= shown
    field = call("check", small, "--all", "--units", "field").out
    # 1820.93 kN, 17.3607 m and 24.8 or so degrees in other units.
    assert re.search(r"collar_sinusoidal +409\.36\d* klbf", field)
    assert re.search(r"collar_half_wave +683\.49\d* in .*\(56\.96 ft\)", field)
    assert re.search(r"wall_inclination .*\(26\.\d degrees\)", field)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        # The buckling load of a span of 40 m is 171.5 kN; 500 kN is far above.
        (["drillstring.collar.span=40 m", "operation.wob=500 kN"], "Buckled: at 500 kN"),
        (["bit.friction.smoothing=50000 s/rad", "simulation.method=explicit"], "Slow: "),
        (["drillstring.eccentricity=10 cm"], "Eccentric: the eccentricity (100 mm) exceeds the clearance (76.2 mm)"),
        (
            ["drive={kind: pi, stiffness: 900 N m/rad, damping: 1500 N m s/rad, speed_gain: -3000 N m s/rad}"],
            "Unstable: without any friction at the bit the string and its drive do not come to rest: an eigenvalue is",
        ),
        # 50 N m s/rad, of a pipe of 197 N m/rad at 5000 m and an inertia of 565 kg m^2; here 20 times as much
        (
            ["drillstring.torsional_damping=1000 N*m*s/rad", "depth=5000 m"],
            "Damped: with drillstring.torsional_damping 1000 N*m*s/rad the torsional mode has a damping ratio of",
        ),
        (["bit.friction.dynamic=0.4", "bit.friction.static=0.9"], "Aggressive: the torque of the bit, 36 T/(D W), is"),
        (
            ["bit.friction.dynamic=0.01", "bit.friction.static=0.02", "bit.lobes=1"],
            "Blunt: the torque of the bit, 36 T/(D W), is",
        ),
        # no collars of the defaults weigh so much
        (["operation.wob=900 kN"], "Heavy: 900 kN on the bit are more than the collars weigh in mud along the hole"),
        (["sweep.rotary_speed.to=19 rad/s"], "Fast: at 19 rad/s the whole string turns with the bit here."),
        ([], "Bounce: the 3 lobes excite the axial resonance on the rock at"),
        (
            ["sweep.depth=[2000 m, 4000 m]", "sweep.along=rotary_speed"],
            "Depth: drillstring.torsional_damping is one number for all depths, so with an ideal drive",
        ),
        (
            [],
            "Sensitive to uncertain inputs: at 1 rad/s to 8 rad/s the answer depends on numbers that are rarely known "
            "well. Of the critical speeds at 22.24 kN: the speed at which the collar reaches the wall is",
        ),
        (["simulation.observe=20 s"], "Short: at 1 rad/s the observation of 20 s holds only 3.18 revolutions"),
        (["simulation.observe=20 s"], "Short: the torsional period is 5.95 s"),
        (["simulation.rtol=2e-4"], "Loose: simulation.rtol is 0.0002, and above 0.0001 errors of the steps decide"),
        # 4000 points of 10 000 returns of 8 numbers of 8 bytes each.
        (["record.poincare=10000", "sweep.rotary_speed.points=2000"], "Large: the results take up to 2.56 GB"),
    ],
)
def test_warnings(call, small, changes, said):
    words = ("check", small, *changed("simulation.observe=200 s", *changes))
    assert f"Warning: {said}" in unwrapped(call(*words).err)
    warnings = json.loads(call(*words, "--json").out)["warnings"]
    assert any(warning.startswith(said) for warning in warnings)


@pytest.mark.parametrize("model", ["christoforou_yigit", "beam", "torsion", "regenerative"])
@pytest.mark.parametrize("units", ["si", "field"])
def test_damping_that_is_unusual_of_a_string_is_remarked_on(call, tmp_path, model, units):
    """In every model with a string and one number for its damping; the value that is named has
    the ratio that is named, in the units of the study, and silences it."""
    study = tmp_path / "study.yaml"
    study.write_text(f"model: {model}\nunits: {units}\nsweep: {{rotary_speed: [8 rad/s, 12 rad/s]}}\n")

    def found(*changes):
        told = json.loads(call("check", study, *changed(*changes), "--json", "--units", units).out)
        return [one for one in told["warnings"] if one.startswith("Damped:")], told["coefficients"]

    (said,), k = found("drillstring.torsional_damping=50 N*m*s/rad")
    usual, unit = re.search(r"strings have 0.02 to 0.05: 0.03 would be ([\d.]+) (.+?)\. With too much", said).groups()
    if units == "si":
        assert float(usual) == pytest.approx(0.06 * (k["k_t"]["value"] * k["J"]["value"]) ** 0.5, rel=1e-3)
    assert found(f"drillstring.torsional_damping={usual} {unit.replace('-', '*').replace(' ', '*')}")[0] == []
    assert "With too little" in found("drillstring.torsional_damping=1 N*m*s/rad")[0][0]


@pytest.mark.parametrize(
    "changes",
    [
        ["bit.lobes=3", "bit.surface_amplitude=1 mm", "bit.friction={static: 0.5, dynamic: 0.3}"],
        ["bit.lobes=1", "bit.friction={static: 0.05, dynamic: 0.04}"],
    ],
)
def test_the_friction_that_is_advised_is_usual_in_one_step(call, small, changes):
    """What cuts takes its part of the torque whatever the friction is."""

    def aggressive(*more):
        told = json.loads(call("check", small, *changed(*changes, "operation.wob=60 kN", *more), "--json").out)
        return [one for one in told["warnings"] if one.startswith(("Aggressive", "Blunt"))]

    (said,) = aggressive()
    factor = float(re.search(r"by at (?:most|least) ([\d.]+)", said)[1])
    static, dynamic = (float(one) for one in re.search(r"static: ([\d.]+), dynamic: ([\d.]+)", changes[-1]).groups())
    assert aggressive(f"bit.friction={{static: {static * factor}, dynamic: {dynamic * factor}}}") == []


def test_what_is_usual_is_not_remarked_on(call, small):
    """A PDC bit on collars that are heavy enough, with a damping of 2 per cent."""
    usual = changed(
        *("simulation.observe=200 s", "bit.lobes=1", "bit.surface_amplitude=0 mm", "operation.wob=20 kN"),
        *("drillstring.torsional_damping=17 N*m*s/rad", "depth=3000 m", "simulation.rtol=1e-4"),
    )
    warnings = json.loads(call("check", small, *usual, "--json").out)["warnings"]
    remarks = ("Damped", "Aggressive", "Blunt", "Heavy", "Fast", "Bounce", "Depth", "Loose")
    assert [one for one in warnings if one.startswith(remarks)] == []
    assert not any("rock_stiffness" in one for one in warnings)  # nothing lifts the bit
    figures = json.loads(call("check", small, *usual, "--json").out)["figures"]
    k = json.loads(call("check", small, *usual, "--json").out)["coefficients"]
    ratio = 17.0 / (2.0 * (k["k_t"]["value"] * k["J"]["value"]) ** 0.5)
    assert figures["torsional_damping"]["value"] == pytest.approx(ratio, rel=1e-12)


# Collars of 6 3/4 in in a hole of 8 1/2 in: (8.5^2 + 6.75^2)/(8.5^2 - 6.75^2) by hand.
NARROW = ("well.diameter=8.5 in", "drillstring.collar={outer_diameter: 6.75 in, inner_diameter: 2.8125 in}")
IN_NARROW = 117.8125 / 26.6875


@pytest.mark.parametrize("model", ["christoforou_yigit", "beam"])
def test_added_mass_that_is_not_that_of_the_hole_is_told_with_the_speeds_of_both(call, tmp_path, model):
    study = tmp_path / "study.yaml"
    study.write_text(f"model: {model}\nsweep: {{rotary_speed: [1 rad/s, 8 rad/s]}}\n")

    def found(*changes):
        told = json.loads(call("check", study, *changed("drillstring.eccentricity=2 mm", *changes), "--json").out)
        return [one for one in told["warnings"] if one.startswith("Added mass")], told

    (said,), given = found(*NARROW)
    (silent, in_hole) = found(*NARROW, "mud.added_mass=clearance")
    assert silent == []
    assert given["figures"]["added_mass_hole"]["value"] == pytest.approx(IN_NARROW, rel=1e-12)
    assert "is 1.7, and potential flow round a collar in the middle of this hole gives 4.41" in said
    mass, more = (one["coefficients"]["m_l"]["value"] for one in (given, in_hole))
    k = given["coefficients"]["m_f"]["value"], in_hole["coefficients"]["m_f"]["value"]
    inside = 2.8125**2
    assert k[1] / k[0] == pytest.approx((inside + IN_NARROW * 6.75**2) / (inside + 1.7 * 6.75**2), rel=1e-9)
    before, after = (
        float(one)
        for one in re.search(
            r"frequency is ([\d.]+) rad/s with the one and ([\d.]+) rad/s with the other", said
        ).groups()
    )
    assert after / before == pytest.approx((mass / more) ** 0.5, rel=1e-3)
    assert found(*NARROW, f"mud.added_mass={IN_NARROW}")[0] == []
    assert found("mud.added_mass=1.7")[0] == []  # in the hole of the paper it moves the frequency by 3 per cent


@pytest.mark.parametrize("changes", [(), ("modes.lateral=frozen",), ("uncertain={mud.added_mass: {uniform: [1, 4]}}",)])
def test_the_added_mass_is_among_the_numbers_that_decide_where_it_is_not_chosen(call, small, changes):
    told = json.loads(call("check", small, *changed(*NARROW, *changes), "--json").out)["warnings"]
    sensitive = next(one for one in told if one.startswith("Sensitive"))
    assert ("with mud.added_mass 4.41 (clearance)" in sensitive) == (not changes)
    assert any(one.startswith("Added mass") for one in told) == (not changes)


def test_the_numbers_that_decide_are_named_of_an_elastic_collar_as_well(call, tmp_path):
    """By its first mode, and only those that it has: its mud rests."""
    study = tmp_path / "study.yaml"
    study.write_text("model: beam\nsweep: {rotary_speed: [1 rad/s, 8 rad/s]}\n")
    told = json.loads(call("check", study, *changed(*NARROW), "--json").out)["warnings"]
    (said,) = [one for one in told if one.startswith("Sensitive")]
    assert "with mud.added_mass 4.41 (clearance)" in said
    assert "mud.swirl" not in said


def test_a_short_study_has_the_added_mass_of_its_own_hole(call, tmp_path):
    call("new", "-o", "short.yaml")
    told = json.loads(call("check", "short.yaml", *changed(*NARROW), "--json").out)
    assert not any(one.startswith("Added mass") for one in told["warnings"])
    assert "mud.added_mass" not in " ".join(told["warnings"])


def test_no_speed_brings_a_collar_to_the_wall_that_lies_on_the_low_side(call, small):
    """A hole of 8 1/2 in and 30 degrees, in which check says that the collar lies on the wall: all else that it
    says of the speed that brings it there is of a collar in the middle."""
    slow = "sweep.rotary_speed={from: 5 rad/s, to: 8 rad/s, points: 4}"
    upright, inclined = (
        json.loads(call("check", small, *changed(*NARROW, slow, f"well.inclination={one} deg"), "--json").out)[
            "warnings"
        ]
        for one in (0, 30)
    )
    assert any(one.startswith("Low side") for one in inclined)
    assert any(one.startswith("Wall") for one in upright)
    assert any("reaches the wall" in one for one in upright if one.startswith("Added mass"))
    assert not any(one.startswith("Wall") or "reaches the wall" in one for one in inclined)
    assert any(one.startswith("Added mass") for one in inclined)


def test_steady_contact_at_the_resonance_takes_less_with_the_damping_of_a_wave(call, small):
    """At the resonance about s0 K^2/(c w), c = A sqrt(E rho) of 5-inch pipe."""
    found = json.loads(call("check", small, "--json").out)
    (said,) = [one for one in found["warnings"] if one.startswith("Bounce")]
    given, with_wave = (
        float(one) for one in re.search(r"takes ([\d.]+) kN on the bit, or ([\d.]+) kN with", said).groups()
    )
    contact = found["figures"]["axial_contact"]["value"]
    wave = math.pi / 4 * (0.127**2 - 0.1086**2) * (210e9 * 7850.0) ** 0.5
    stiffness = 25e6 + found["coefficients"]["k_a"]["value"]
    assert with_wave == pytest.approx(1e-6 * stiffness**2 / (wave * contact), rel=0.05)
    assert given == pytest.approx(1e-6 * stiffness**2 / (4000.0 * contact), rel=0.05)


def test_what_a_wave_up_the_pipe_takes_decides_where_a_bounce_lasts(call, small):
    """A sqrt(E rho) of 5-inch pipe, more than thirty times the default."""
    area = math.pi / 4 * (0.127**2 - 0.1086**2)
    told = json.loads(call("check", small, "--json").out)["warnings"]
    sensitive = next(one for one in told if one.startswith("Sensitive"))
    (said,) = re.findall(r"with drillstring.axial_damping ([\d.]+) kN\*s/m \(a wave up the pipe\)", sensitive)
    assert 1e3 * float(said) == pytest.approx(area * (210e9 * 7850.0) ** 0.5, rel=1e-3)


@pytest.mark.parametrize(
    ("model", "changes", "bits"),
    [
        ("christoforou_yigit", ["bit.lobes=3"], "roller cones (3 lobes and more) is 0.1 to 0.35"),
        ("beam", ["bit.lobes=3"], "roller cones (3 lobes and more) is 0.1 to 0.35"),
        (
            "christoforou_yigit",
            ["bit.lobes=1", "bit.friction.dynamic=1.6", "bit.friction.static=1.9"],
            "PDC bits is 0.25",
        ),
        ("torsion", ["bit.friction.dynamic=1.6", "bit.friction.static=1.9"], "bits of any kind is 0.1 to 1.5"),
        ("segments", ["bit.friction.level=2"], "PDC bits is 0.25 to 1.5"),
        ("regenerative", ["bit.zeta=0.1"], "PDC bits is 0.25 to 1.5"),
    ],
)
def test_a_torque_that_is_unusual_of_the_bit_is_remarked_on_in_every_model(call, tmp_path, model, changes, bits):
    """At the operating point that check shows, though the ends of the sweep reach into the usual range, as
    friction falls with speed."""
    study = tmp_path / "study.yaml"
    falling = "sweep: {rotary_speed: [3 rad/s, 40 rad/s]}\noperation: {wob: 66.72 kN, rotary_speed: 3 rad/s}"
    study.write_text(f"model: {model}\n{falling}\n")
    found = json.loads(call("check", str(study), *changed(*changes), "--json").out)
    (said,) = [one for one in found["warnings"] if one.startswith(("Aggressive", "Blunt"))]
    value = found["figures"]["aggressiveness"]["value"]
    assert f"36 T/(D W), is {value:.3g} at 66.72 kN and 3 rad/s, and usual of {bits}" in said
    assert "a judgement" in said


def test_the_weight_of_the_collars_is_that_in_mud_along_the_hole(call, small):
    """Steel of 7850 kg/m^3 in mud of 1500 kg/m^3, 0.2 m by 0.1 m and 100 m long, at 60 degrees: half of
    9.80665 (7850 - 1500) (pi/4) (0.2^2 - 0.1^2) 100 N."""
    collar = "drillstring.collar={outer_diameter: 0.2 m, inner_diameter: 0.1 m, length: 100 m}"
    mud = ("mud.density=1500 kg/m^3", "drillstring.material.density=7850 kg/m^3", "well.inclination=60 deg")
    figures = json.loads(call("check", small, *changed(collar, *mud), "--json").out)["figures"]
    expected = 9.80665 * (7850 - 1500) * math.pi / 4 * (0.2**2 - 0.1**2) * 100 * 0.5
    assert figures["collar_weight"]["value"] == pytest.approx(expected, rel=1e-9)


def test_the_weight_of_heavy_sections_is_that_in_mud_and_less_than_the_bit_may_have(call, tmp_path):
    """200 m of heavy-weight pipe of 5 by 3 in and 100 m of collars of 8 by 3 in; the pipe above, in
    two sizes, does not count."""
    rows = (
        "{outer_diameter: 5.5 in, inner_diameter: 4.778 in}, {length: 1 km, outer_diameter: 5 in, weight: 17.93 lb/ft}"
    )
    heavy = "{length: 200 m, outer_diameter: 5 in, inner_diameter: 3 in}, "
    heavy += "{length: 100 m, outer_diameter: 8 in, inner_diameter: 3 in}"
    text = "operation: {depth: 3000 m, wob: 300 kN}\nmud: {density: 1500 kg/m^3}\n"
    path = tmp_path / "sections.yaml"
    path.write_text(f"drillstring: {{sections: [{rows}, {heavy}]}}\n{text}")
    found = json.loads(call("check", path, "--json", "--units", "si").out)
    steel = (math.pi / 4) * 0.0254**2 * (200 * (5**2 - 3**2) + 100 * (8**2 - 3**2))
    density = nsdrill.load_study(path).parameters.drillstring.material.density
    assert found["figures"]["collar_weight"]["value"] == pytest.approx(9.80665 * (density - 1500) * steel, rel=1e-9)
    assert any(one.startswith("Heavy: 300 kN on the bit are more than the collars weigh") for one in found["warnings"])
    path.write_text(f"drillstring: {{sections: [{rows}]}}\n{text}")
    assert json.loads(call("check", path, "--json").out)["figures"]["collar_weight"]["value"] is None


def test_swept_depth_replaces_a_default_inside_the_collars(call, small):
    answer = call(
        f"check {small} --json --set 'operation={{}}' --set 'drillstring.collar.length=6 km' --set "
        f"'sweep={{depth: [7000 m, 9000 m]}}'"
    )
    assert json.loads(answer.out)["operation"]["depth"]["value"] == 7000.0


def test_a_model_of_a_string_that_only_turns(call):
    """Its coefficients are stiffness and inertia; what is known of every string that turns is
    said."""
    Path("twist.yaml").write_text("model: torsion\nsimulation: {transient: 10 s, observe: 5 s}\n")
    answer = call("check", "twist.yaml")
    assert answer.out.startswith("twist.yaml: valid.")
    assert "Short: at 3 rad/s" in answer.err
    report = json.loads(call("check", "twist.yaml", "--json").out)
    assert list(report["coefficients"]) == ["J", "k_t"]
    assert report["figures"]["stick_slip_onset"]["value"] == pytest.approx(2.038, abs=1e-3)  # as of the main model
    assert report["figures"]["balance_speed"]["value"] == 3.0
    answer = call("plot", "twist.yaml", "--kind", "drive-card", "-o", "a.png", code=2)
    assert "found a study of the model torsion; allowed: christoforou_yigit" in answer.err


CONFIGS = sorted((Path(__file__).parents[2] / "configs").glob("*.yaml"))
assert CONFIGS


@pytest.mark.parametrize("study", CONFIGS, ids=[path.stem for path in CONFIGS])
def test_studies_of_the_paper_are_valid(study, call):
    call("check", study)


@pytest.fixture
def told(call):
    """Gives what ``check`` says of the rotary assembly with changed keys."""
    call("new", "--example", "rotary-assembly", "-o", "rotary.yaml")

    def tell(*changes, units="field"):
        return unwrapped(call("check", "rotary.yaml", *changed(*changes), "--units", units).err)

    return tell


@pytest.fixture
def wall_speed(call, told):
    """Gives the speed [rpm] at which the collar reaches the wall, with changed keys; None
    where there is none."""

    def figure(*changes):
        words = ("check", "rotary.yaml", *changed("sweep={}", *changes), "--json", "--units", "si")
        found = json.loads(call(*words).out)["figures"]["wall_speed"]["value"]
        return None if found is None else found * 30 / math.pi

    return figure


def test_a_collar_on_the_wall_below_the_slowest_speed_is_told(told, wall_speed):
    """The eccentricities that are named have their wall speed at the ends of the
    sweep."""
    sweep = "sweep.rotary_speed={from: 60 rpm, to: 140 rpm, points: 17}"
    wide = ("drillstring.eccentricity=12.7 mm", sweep)
    said = told(*wide)
    below = re.search(r"Warning: Wall: .*to stay off the wall it must be below ([\d.]+) in", said)
    assert below is not None  # nearly the same at both ends, said once
    assert said.count("Warning: Wall: ") == 1
    for speed in (60, 140):
        for factor in (1.005, 0.995):
            offset = f"drillstring.eccentricity={factor * 25.4 * float(below[1])} mm"
            at = (offset, f"operation.rotary_speed={speed} rpm")
            speeds = [wall_speed(*at, f"operation.wob={wob} klbf") for wob in (5, 25)]
            assert any(one is not None and one <= speed for one in speeds) == (factor > 1)
    assert "Wall:" not in told(sweep)  # 2 mm: 62 rpm
    for change in ("drillstring.collar.span=30 ft", "modes.lateral=frozen"):
        assert "Wall:" not in told(*wide, change)
    assert "The eccentricity is 0.5 in" in said
    # Of one system of units each, without and with it: 60 rpm, 140 rpm, 0.5 in.
    si = told(*wide, units="si")
    assert not re.search(r"\d (rpm|in|klbf|ft)\b", si)
    assert not re.search(r"\d (rad/s|mm|m|kN)\b", said)
    assert "to stay off the wall it must be below 1.063 mm. A shorter" in si


def test_a_sweep_that_begins_above_a_critical_speed_is_told(told, wall_speed):
    """A string that is brought up to speed passes through it; the speed that is named
    is that of the figures."""
    assert "Start:" not in told()
    wide = ("drillstring.eccentricity=12.7 mm", "sweep.rotary_speed={from: 80 rpm, to: 140 rpm, points: 4}")
    start = r"Start: .* begins at 80 rpm.* reaches the wall \(([\d.]+) rpm to ([\d.]+) rpm\)"
    found = re.search(start, told(*wide))
    assert re.search(
        r"Begin the sweep below [\d.]+ rpm, in steps of at most [\d.]+ rpm up to [\d.]+ rpm, even if", told(*wide)
    )
    for wob, said in zip((25, 5), found.groups(), strict=True):
        at = (wide[0], f"operation.wob={wob} klbf", "operation.rotary_speed=80 rpm")
        assert wall_speed(*at) == pytest.approx(float(said), rel=1e-3)
    each = told(*wide, "sweep.along=wob")
    assert re.search(
        r"Start: the state is carried along wob, each speed by itself, up to 140 rpm, which lies above", each
    )
    assert re.search(r"Carry it along rotary_speed, from below [\d.]+ rpm", each)
    for other in (
        ("sweep.procedure=same", "sweep.along=null"),  # every point from its own start
        ("initial.x=60 mm",),  # it is on the wall from the start
        ("drillstring.eccentricity=1 mm",),
    ):
        assert re.search(start, told(*wide, *other)) is None


@pytest.mark.parametrize("model", ["christoforou_yigit", "torsion", "beam"])
def test_a_sweep_that_begins_above_the_onset_is_told_of_a_bit_that_need_not_stick(call, tmp_path, model):
    """A start near the steady twist, -10.8 and -6.2 rad of ``static_twist``, does not stick where the
    window says that THE SWEEP BEGINS above the onset; one that is far from it winds up, and sticks."""
    frozen = "{axial: frozen, lateral: frozen}" if model == "christoforou_yigit" else "null"
    lines = [f"model: {model}", f"modes: {frozen}"] if frozen != "null" else [f"model: {model}"]
    lines += [
        "operation: {depth: 3000 m, wob: 66.72 kN}",
        "sweep: {rotary_speed: [6 rad/s, 9 rad/s, 12 rad/s], procedure: up}",
    ]
    lines += ["bit: {surface_amplitude: 0 mm}"] if model != "torsion" else []
    study = tmp_path / "above.yaml"
    study.write_text("\n".join(lines), encoding="utf-8")
    start = "Start: the sweep begins at 6 rad/s, which lies at 66.72 kN above the speed below which the bit sticks"
    twist = "initial.twist=-8 rad"
    assert start in unwrapped(call("check", study, "--set", twist).err)
    for other in (
        "initial.bit_speed=0 rad/s",
        "sweep.rotary_speed=[3 rad/s, 9 rad/s]",
        "sweep.rotary_speed=[11 rad/s, 12 rad/s]",
    ):
        assert start not in unwrapped(call("check", study, "--set", twist, "--set", other).err)
    assert start not in unwrapped(call("check", study, "--set", "initial.twist=20 rad").err)


def test_steps_that_may_jump_across_the_speeds_of_the_wall_are_told(told, wall_speed):
    """The range is that of the figures at the ends of the weights, and the ranges that the
    warning proposes silence it; the example has its own."""
    coarse = "sweep.rotary_speed={from: 40 rpm, to: 140 rpm, points: 21}"
    assert "Step:" not in told()
    said = told(coarse)
    found = re.search(r"Step: in steps of 5 rpm .* wall, ([\d.]+) rpm to ([\d.]+) rpm .*, ([\d.]+) rpm wide", said)
    low, high, width = map(float, found.groups())
    assert low == pytest.approx(wall_speed("operation.wob=25 klbf", "operation.rotary_speed=40 rpm"), rel=1e-3)
    assert low < wall_speed("operation.wob=5 klbf") < high
    assert width < 5.0 < high - low
    proposed = re.search(r"one of them ({from: .*?})", said)[1]
    others = "{from: 40 rpm, to: 55 rpm, points: 4}", "{from: 70 rpm, to: 140 rpm, points: 15}"
    whole = f"sweep.rotary_speed=[{others[0]}, {proposed}, {others[1]}]"
    assert "Step:" not in told(whole)
    assert low <= wall_speed("operation.wob=25 klbf", "operation.rotary_speed=40 rpm")  # rounded outwards
    for other in ("sweep.procedure=down", "drillstring.collar.span=30 ft", "sweep.along=wob", "modes.lateral=frozen"):
        assert "Step:" not in told(coarse, other)


def test_numbers_on_which_the_answer_hangs_are_named(told, wall_speed):
    moved = re.search(r"reaches the wall is ([\d.]+) rpm, and no speed with half drillstring.eccentricity", told())
    at = ("operation.wob=15 klbf", "operation.rotary_speed=100 rpm")
    assert wall_speed("drillstring.eccentricity=2 mm", *at) == pytest.approx(float(moved[1]), rel=1e-3)
    assert wall_speed("drillstring.eccentricity=1 mm", *at) is None
    # What is said to be uncertain is no longer a guess.
    assert "half drillstring.eccentricity" not in told("uncertain={drillstring.eccentricity: {uniform: [1 mm, 5 mm]}}")


def test_a_collar_that_rests_on_the_low_side_is_told(told):
    """Where the hole is steeper than the inclination at which the span sags to the wall, and
    not in a vertical hole; there it reaches the wall at no speed."""
    assert "Low side:" not in told()
    said = told("well.inclination=60 deg")
    least = float(re.search(r"rests on the low side of the hole above ([\d.]+) degrees", said)[1])
    assert 0.0 < least < 60.0
    assert "the hole has 60 degrees" in said
    assert "Step:" not in said
    assert "Low side:" not in told(f"well.inclination={least - 1.0} deg")


def test_what_is_shown_in_metres_comes_in_feet_and_other_lengths_in_inches():
    """A depth of 3048 m is 10 000 ft, an eccentricity of 2 mm 0.07874 in."""
    assert _amount_text("field", 3048.0, "m", "m") == "10000 ft"
    assert _amount_text("field", 3000.0, "m", "m") == "9843 ft"
    assert _amount_text("field", 0.002, "m", "mm") == "0.07874 in"
    assert _amount_text("si", 3048.0, "m", "m") == "3048 m"


def test_friction_of_stabilisers_that_drives_whirl_is_told_of():
    """The imbalance reaches the wall at wall_speed; the friction of stabilisers with a clearance
    brings the collar there from low speeds on (docs: theory, options of the collar)."""
    study = {
        "drillstring": {"eccentric_mass": "steel"},
        "stabilizer": {"clearance": "5 mm", "friction": {"static": 0.35, "dynamic": 0.3}},
    }
    told = [text for text in nsdrill.check(study).warnings if text.startswith("Stabilisers")]
    assert len(told) == 1
    assert "0.028" in told[0]
    slight = {"stabilizer": {"clearance": "5 mm", "friction": {"static": 0.02, "dynamic": 0.02}}}
    assert not [text for text in nsdrill.check(study | slight).warnings if text.startswith("Stabilisers")]


def test_the_clearance_of_stabilisers_is_among_the_numbers_that_decide(call, small):
    """Twice of it the collar reaches the wall sooner; one that is wider than the gap is none."""
    narrow = ("well.diameter=12.25 in", "drillstring.eccentricity=2 mm", "stabilizer.clearance=12 mm")
    slow = "sweep.rotary_speed={from: 2 rad/s, to: 12 rad/s, points: 4}"

    def told(*changes: str) -> str:
        said = json.loads(call("check", small, *changed(*narrow, slow, *changes), "--json").out)["warnings"]
        return next(one for one in said if one.startswith("Sensitive"))

    assert "with twice stabilizer.clearance" in told()
    assert "stabilizer.clearance" not in told("stabilizer.clearance=null")
    assert "twice stabilizer.clearance" not in told("stabilizer.clearance=25 mm")


@pytest.mark.parametrize(
    ("model", "number", "value", "unit"),
    [("segments", "bit.friction.viscous", 0.01, "s/rad"), ("regenerative", "bit.specific_energy", 60, "MPa")],
)
def test_numbers_that_decide_are_told_of_several_inertias_and_of_a_bit_that_cuts(
    call, tmp_path, model, number, value, unit
):
    """The speed below which steady drilling is unstable with another value is that of a check with it."""
    study = tmp_path / "study.yaml"
    study.write_text(f"model: {model}\nsweep: {{rotary_speed: {{from: 2 rad/s, to: 30 rad/s, points: 8}}}}\n")

    def checked(*changes: str) -> tuple[str, dict]:
        found = json.loads(call("check", study, *changed(*changes), "--json").out)
        return next((one for one in found["warnings"] if one.startswith("Sensitive")), ""), found["figures"]

    said, figures = checked()
    how, there = re.search(rf"([\d.]+ rad/s) with (half|twice) {re.escape(number)}", said).groups()[::-1]
    name = "stick_slip_onset" if model == "segments" else "steady_threshold"
    assert f"is {figures[name]['value']:.4g} rad/s, and" in said
    changed_to = f"{number}={ {'half': 0.5, 'twice': 2.0}[how] * value } {unit}"
    assert float(there.split()[0]) == pytest.approx(checked(changed_to)[1][name]["value"], rel=2e-3)
