"""From text to a study: values, and every fault with its line, key, what was found and what
is allowed."""

import numpy as np
import pytest

from nsdrill.errors import StudyError, naming_options
from nsdrill.models.christoforou_yigit.parameters import Collar, Parameters, Well
from nsdrill.models.responses import Thresholds
from nsdrill.models.sections import Friction, Pipe
from nsdrill.study import change_thresholds, load_study, parse_study

from .refused import faults

SWEEP = "sweep: {depth: [1000 m, 2000 m]}\n"


def test_only_the_sweep_is_needed():
    study = parse_study(SWEEP)
    assert study.parameters == Parameters()
    assert study.thresholds == Thresholds()
    assert study.swept == ("depth",)
    assert {name: axis.tolist() for name, axis in study.axes.items()} == {
        "depth": [1000.0, 2000.0],
        "wob": [22240.0],
        "rotary_speed": [3.0],
    }
    assert (study.procedure, study.along, study.title) == ("same", None, "")


def test_values_come_out_in_si():
    study = parse_study(
        "title: T\n"
        "drillstring: {collar: {outer_diameter: 8 in}, lateral_softening: static}\n"
        "well: {law: hertz, stiffness: 2 GN/m^1.5}\nbit: {lobes: 1, cutting: {c1: 1e-6}}\n"
        "operation: {wob: 5 klbf}\ninitial: {z: -1 mm, bit_speed: 60 rpm, drive_angle: 0 rad}\n"
        "sweep: {rotary_speed: {from: 60 rpm, to: 1 rev/s, points: 2}}\n".replace("1 rev/s", "2 rev/s")
        + "simulation: {transient: 2 min, rtol: 1.0e-9, max_steps: 1e6}\n"
        "classify: {stuck_below: 1 rpm, whirl: {direction: 0.2}}\nrecord: {peaks: 0}\n"
    )
    assert study.parameters.drillstring.collar == Collar(outer_diameter=8 * 0.0254)
    assert study.parameters.drillstring.lateral_softening == "static"
    assert study.parameters.well == Well(stiffness=2e9, law="hertz")
    assert (study.parameters.bit.lobes, study.parameters.bit.cutting.c1) == (1, 1e-6)
    assert study.initial.z == -1e-3
    assert study.initial.bit_speed == 2 * np.pi
    assert study.axes["rotary_speed"].tolist() == [2 * np.pi, 4 * np.pi]
    assert study.axes["wob"].tolist() == [22241.1080763025]
    assert (study.simulation.transient, study.simulation.max_steps, study.record.peaks) == (120.0, 1_000_000, 0)
    assert isinstance(study.simulation.max_steps, int)
    assert study.thresholds.whirl.direction == 0.2


@pytest.mark.parametrize(
    ("axis", "values"),
    [
        ("{from: 500 m, to: 900 m, points: 3}", [500.0, 700.0, 900.0]),
        ("{from: 900 m, to: 500 m, points: 3}", [500.0, 700.0, 900.0]),
        ("[900 m, 500 m]", [500.0, 900.0]),
        ("1 km", [1000.0]),
        # the ranges meet at 500 m, whose sum of steps has another last bit; 450 m stands twice
        (
            "[{from: 500 m, to: 900 m, points: 3}, {from: 0.3 km, to: 500 m, points: 5}, 450 m, 1 km]",
            [300.0, 350.0, 400.0, 450.0, 500.0, 700.0, 900.0, 1000.0],
        ),
    ],
)
def test_axes_ascend(axis, values):
    assert parse_study(f"sweep: {{depth: {axis}}}").axes["depth"].tolist() == values


def test_a_carried_state_needs_its_axis():
    assert parse_study("sweep: {depth: [1 km, 2 km], procedure: up}").along == "depth"
    two = "sweep: {depth: [1 km, 2 km], wob: [1 kN, 2 kN], procedure: up-down"
    assert parse_study(two + ", along: wob}").along == "wob"
    (fault,) = faults(two + "}")
    assert fault.key == "sweep.along"
    assert "depth or wob" in fault.allowed
    (fault,) = faults(two + ", along: rotary_speed}")
    assert "not swept" in fault.found
    assert parse_study("sweep: {depth: [1 km, 2 km], along: wob}").along is None


def test_all_faults_are_told_at_once_in_the_order_of_the_file():
    found = faults(
        SWEEP
        + "operatoin: {}\n"
        + "operation:\n  wbo: 3 kN\n  wob: 5 t\n  depth: 30\n  rotary_speed: 2 Hz\n"
        + "mud: {density: -3 kg/m^3, drag: true}\n"
        + "bit:\n  lobes: 3.5\n  cutting: {c1: .nan}\n"
        + "drillstring: {pipe: {inner_diameter: 6 in}}\n"
    )
    assert [(fault.line, fault.key) for fault in found] == [
        (2, "operatoin"),
        (4, "operation.wbo"),
        (5, "operation.wob"),
        (6, "operation.depth"),
        (7, "operation.rotary_speed"),
        (8, "mud.density"),
        (8, "mud.drag"),
        (10, "bit.lobes"),
        (11, "bit.cutting.c1"),
        (12, "drillstring.pipe.inner_diameter"),
    ]
    by_key = {fault.key: fault for fault in found}
    assert by_key["operatoin"].suggestion == "Did you mean operation?"
    assert by_key["operation.wbo"].suggestion == "Did you mean operation.wob?"
    assert by_key["operation.wbo"].allowed == "depth, wob, rotary_speed"
    assert by_key["operation.depth"].found == "the number 30 without a unit"
    assert "m, mm, in or ft" in by_key["operation.depth"].allowed
    assert by_key["operation.wob"].column == 8


@pytest.mark.parametrize(
    ("text", "line", "key", "says"),
    [
        ("drillstring:\n  collar: {outer_diameter: 16 in}", 3, "drillstring.collar.outer_diameter", "well.diameter"),
        ("well:\n  diameter: 5 in\n", 3, "well.diameter", "9 in (the default)"),
        ("drillstring:\n  collar:\n    span: 300 m\n", 4, "drillstring.collar.span", "at most"),
        (
            "drillstring:\n  pipe:\n    outer_diameter: 4 in\n",
            4,
            "drillstring.pipe.outer_diameter",
            "at least 1.001 times drillstring.pipe.inner_diameter",
        ),
        ("well: {friction: {static: 0.1}}", 2, "well.friction.static", "at least"),
        ("bit:\n  friction:\n    static: 0.3\n    dynamic: 0.4\n", 5, "bit.friction.dynamic", "at most"),
        ("initial: {x: 400 mm, y: 300 mm}", 2, "initial.x", "76.2 mm, and as deep into the wall as 10 MN press"),
        ("classify: {stick_slip: {medium_index: 30}}", 2, "classify.stick_slip.medium_index", "above"),
        ("classify: {bit_bounce: {strong_fraction: 0.05}}", 2, "classify.bit_bounce.strong_fraction", "above"),
        ("classify: {whirl: {severe_acceleration: 0.5 gravity}}", 2, "classify.whirl.severe_acceleration", "above"),
        ("well: {stiffness: 25 MN/m^1.5}", 2, "well.stiffness", "law: hertz takes N/m^1.5"),
        ("well: {law: hertz, stiffness: 25 MN/m}", 2, "well.stiffness", "law: linear takes N/m"),
        ("well: {law: herz, stiffness: 25 MN/m^1.5}", 2, "well.law", "Did you mean hertz?"),
        ("simulation: {rtol: 1}", 2, "simulation.rtol", "at most 0.01"),
        ("simulation: {observe: 0 s}", 2, "simulation.observe", "at least 0.001 s"),
        ("simulation: {max_steps: 10}", 2, "simulation.max_steps", "at least 1000"),
        ("record: {poincare: 10001}", 2, "record.poincare", "at most 10 000"),
        ("record: {peaks: 1001}", 2, "record.peaks", "at most 1000"),
        ("operation: {depth: .inf}", 2, "operation.depth", "inf"),
        ("operation: {depth: 150 m}", 2, "operation.depth", "above drillstring.collar.length"),
        ("operation: {wob: -1 kN}", 2, "operation.wob", "at least 0"),
        ("operation: 5", 2, "operation", "a mapping with the keys depth, wob, rotary_speed"),
        ("initial: {vx: null}", 2, "initial.vx", "nothing"),
        ("mud: {drag: '1'}", 2, "mud.drag", "without quotes or unit"),
        ("mud: {drag: 1_000}", 2, "mud.drag", "1_000"),
        ("title: 5", 2, "title", "in quotes"),
        ("mud:\n  drag: 1\n  5:\n", 4, "mud.5", "an unknown key"),
        ("mud: {drag: 1,5}", 2, "mud.drag", "Write a decimal point: 1.5."),
        ("bit:\n  friction:\n    static: 0,5", 4, "bit.friction.static", "Write a decimal point: 0.5."),
        (
            "operation: {depth: 11,482 ft}",
            2,
            "operation.depth",
            "Write 11482 ft without a thousands separator, or 11.482",
        ),
        ("operation: {depth: 1,234,567 mm}", 2, "operation.depth", "Write no thousands separators: 1234567 mm."),
        ("operation: {wob: 5,5 klbf}", 2, "operation.wob", "Write a decimal point: 5.5 klbf."),
        (
            "operation: {wob: {ramp: [[0 s, 5,5 klbf]]}}",
            2,
            "operation.wob.ramp[0][1]",
            "Write a decimal point: 5.5 klbf.",
        ),
        ("operation:\n\u00a0\u00a0wob: 5 kN", 3, "\\xa0\\xa0wob", "the character \\xa0 (U+00A0)"),
        ("operation:\n  wob: 5 kN,", 3, "operation.wob", "Leave out the , at the end."),
        ("operation: {wob: 5 kN#now}", 2, "operation.wob", "A comment begins with a blank and #."),
        ("operation: {wob: 5\u200b kN}", 2, "operation.wob", "the character \\u200b (U+200B)"),
        ("classify: {whirl: {wall_contact_fraction: 50 %}}", 2, "classify.whirl.wall_contact_fraction", "Write 0.5."),
        ("drive: soft_torque", 2, "drive", "Did you mean {kind: soft_torque}?"),
        ("units: SI", 2, "units", "Did you mean si?"),
        ("bit.friction.static: 0.5", 2, "bit.friction.static", "keys are nested: bit: {friction: {static: ...}}"),
        (
            "well: {diameter: 9 in}\ndrillstring: {collar: {outer_diameter: 9 in}}",
            2,
            "well.diameter",
            "above drillstring",
        ),
        ("bit: {friction.static: 0.5}", 2, "bit.friction.static", "keys are nested: friction: {static: ...}"),
        ("wob: 3 kN", 2, "wob", "operation.wob or sweep.wob"),
        ("mud: {drag: 1, drag: 2}", 2, "mud.drag", "a second time"),
        ("<<: {mud: 3}", 2, "<<", "unknown"),
    ],
)
def test_one_fault(text, line, key, says):
    (fault,) = faults(SWEEP + text)
    assert (fault.line, fault.key) == (line, key)
    assert says in f"{fault.found} {fault.allowed} {fault.suggestion}"


@pytest.mark.parametrize(
    ("sweep", "key", "says"),
    [
        ("{procedure: up}", "sweep", "at least one axis"),
        ("{depth: [100 m, 500 m]}", "sweep.depth[0]", "collars"),
        ("{depth: {from: 500 m, to: 100 m, points: 3}}", "sweep.depth.to", "collars"),
        ("{depth: {from: 500 m, to: 500 m, points: 3}}", "sweep.depth", "the same"),
        ("{depth: {from: 500 m, to: 600 m, points: 1}}", "sweep.depth.points", "at least 2"),
        ("{depth: {from: 500 m, to: 600 m}}", "sweep.depth.points", "from, to and points"),
        ("{depth: [1 km, 1000 m]}", "sweep.depth[1]", "each value once"),
        ("{depth: [{from: 1 m, to: 2 m, points: 100001}]}", "sweep.depth", "at most 100 000 in the ranges of a list"),
        ("{depth: [{from: 1 m, to: 2 m}]}", "sweep.depth[0].points", "all of from, to and points"),
        ("{depth: [1 km, {from: 1 m, to: 2 N, points: 3}]}", "sweep.depth[1].to", "in units of force"),
        ("{depth: [1 km, 30]}", "sweep.depth[1]", "without a unit"),
        ("{rotary_speed: 20 rpm, 30 rpm}", "sweep.rotary_speed", "stands in brackets: [20 rpm, 30 rpm]."),
        ("{wob: [5,5 klbf, 6 klbf]}", "sweep.wob[0]", "Write a decimal point: 5.5 klbf."),
        ("{depth: [2 km,1,234,567 mm]}", "sweep.depth[1]", "Write no thousands separators: 1234567 mm."),
        ("{depth: [5, 6 km]}", "sweep.depth[0]", "the number 5 without a unit"),
        ("{depth: {from: 1,5 km, to: 3 km, points: 3}}", "sweep.depth.from", "Write a decimal point: 1.5 km."),
        ("{bit: {rock_stiffness: [1 MN/m]}}", "sweep.bit", "a key stands as a whole: bit.rock_stiffness."),
        ("{drive.kind: ideal, stiff}", "sweep.stiff", "stands in brackets: drive.kind: [ideal, stiff]."),
        ("{depth: []}", "sweep.depth", "at least one value"),
        ("{depth: null}", "sweep.depth", "null"),
        ("{rotary_speed: [0 rpm]}", "sweep.rotary_speed[0]", "at least 1e-09 rad/s"),
        (
            "{wob: {from: 0 N, to: 1 N, points: 9999}, depth: {from: 1 km, to: 2 km, points: 20000}}",
            "sweep",
            "199 980 000 points",
        ),
        ("{wob: {from: 0 N, to: 1 kN, points: 1000000000}}", "sweep.wob.points", "10 000 000"),
        ("{wob: [1 kN], procedure: sideways}", "sweep.procedure", "same, up, down, up-down or all"),
        ("{wob: [1 kN], along: dpth}", "sweep.along", "Did you mean depth?"),
    ],
)
def test_one_fault_of_the_sweep(sweep, key, says):
    (fault,) = faults(f"sweep: {sweep}")
    assert fault.key == key
    assert fault.line == 1
    assert says in f"{fault.found} {fault.allowed} {fault.suggestion}"


def test_null_at_the_start_is_the_natural_value():
    natural = parse_study(SWEEP + "drive: {kind: stiff}")
    given = parse_study(
        SWEEP + "drive: {kind: stiff}\ninitial: {z: null, bit_speed: null, lag: null, drive_speed: null}"
    )
    assert given.resolved == natural.resolved
    assert given.initial.lag == 0.0


def test_a_default_depth_that_is_swept_over_does_not_matter():
    study = parse_study("drillstring: {collar: {length: 6000 m}}\nsweep: {depth: [7000 m]}")
    assert study.axes["depth"].tolist() == [7000.0]


@pytest.mark.parametrize(
    ("record", "text"),
    [
        (lambda: Collar(inner_diameter=0.3), "drillstring: {collar: {inner_diameter: 0.3 m}}"),
        (lambda: Collar(span=300.0), "drillstring: {collar: {span: 300 m}}"),
        (lambda: Pipe(inner_diameter=0.2), "drillstring: {pipe: {inner_diameter: 0.2 m}}"),
        (lambda: Friction(dynamic=0.5), "well: {friction: {dynamic: 0.5}}"),
        (lambda: Parameters(well=Well(diameter=0.2)), "well: {diameter: 0.2 m}"),
    ],
)
def test_what_the_model_refuses_is_a_fault_with_a_line(record, text):
    with pytest.raises(ValueError, match="allowed"):
        record()
    (fault,) = faults(SWEEP + text)
    assert fault.line == 2


def test_overrides():
    study = parse_study(SWEEP, "s", ["operation.wob=30 kN", "sweep.depth=[3 km, 4 km, 5 km]", "mud.drag=2"])
    assert study.operation.wob == 30e3
    assert study.axes["depth"].tolist() == [3000.0, 4000.0, 5000.0]
    assert study.parameters.mud.drag == 2.0
    assert study.overrides == ("operation.wob=30 kN", "sweep.depth=[3 km, 4 km, 5 km]", "mud.drag=2")
    span = "sweep: {depth: {from: 500 m, to: 900 m, points: 3}}"
    assert len(parse_study(span, "s", ["sweep.depth.points=5"]).axes["depth"]) == 5
    assert parse_study(span, "s", ["sweep.procedure=up"]).along == "depth"
    assert parse_study("operation:\n", "s", ["sweep.wob=1 kN"]).swept == ("wob",)
    assert parse_study(SWEEP, "s", ["mud.drag=2", "mud={density: 1 kg/m^3}"]).parameters.mud.drag == 1.0


@pytest.mark.parametrize(
    ("override", "key", "says"),
    [
        ("operation.wbo=30 kN", "operation.wbo", "Did you mean operation.wob?"),
        ("time=30 s", "time", "Did you mean simulation (transient and observe)?"),
        ("simulation.duration=30 s", "simulation.duration", "Did you mean simulation.transient (and observe)?"),
        ("operatoin.wob=30 kN", "operatoin", "Did you mean operation?"),
        ("bit.type=PDC", "bit.type", "Did you mean bit.lobes (1 for a PDC bit, 3 for a roller cone)?"),
        (
            "drillstring.collar.weight=19.5 lb/ft",
            "drillstring.collar.weight",
            "outer_diameter (and inner_diameter: the",
        ),
        ("mud.weight=10 ppg", "mud.weight", "Did you mean mud.density?"),
        ("drive.type=stiff", "drive.type", "Did you mean drive.kind?"),
        ("operation.RPM=60 rpm", "operation.RPM", "Did you mean operation.rotary_speed?"),
        ("sweep.wob=10-40 klbf", "sweep.wob", "under sweep: {from: 10 klbf, to: 40 klbf, points: 13}."),
        ("sweep.bit.friction.static=0.3-0.5", "sweep.bit.friction.static", "{from: 0.3, to: 0.5, points: 13}."),
        ("operation.wob=30", "operation.wob", "without a unit"),
        ("operation.wob=", "operation.wob", "nothing"),
        ("operation.wob=[", "operation.wob", "a value in YAML"),
        ("sweep.depth.points=3", "sweep.depth", "a list"),
        ("drillstring.collar.span=300 m", "drillstring.collar.span", "at most"),
        ("sweep.depth=[100 m]", "sweep.depth[0]", "collars"),
        ("operation.wob", "", "--set key=value"),
        ("=3", "", "--set key=value"),
        ("a..b=3", "", "--set key=value"),
    ],
)
def test_a_bad_override_is_named(override, key, says):
    with naming_options():
        (fault,) = faults(SWEEP, override)
    assert (fault.key, fault.line) == (key, None)
    assert f"--set {override}" in fault.found
    assert says in f"{fault.found} {fault.allowed} {fault.suggestion}"


def test_thresholds_of_a_finished_file():
    changed = change_thresholds(Thresholds(), ["classify.whirl.direction=0.2"])
    assert changed.whirl.direction == 0.2
    assert changed.stick_slip == Thresholds().stick_slip
    refused = (
        "classify.stuck_below=3 rpm",
        "operation.wob=3 kN",
        "classify.stick_slip.severe_index=3",
        "classify.whirl.light_acceleration=6 m/s^2",
        "classify.bit_bounce.severe_fraction=0.2",
        "classify=3",
    )
    for override in refused:
        with pytest.raises(StudyError):
            change_thresholds(Thresholds(), [override])
    with pytest.raises(StudyError, match=r"Did you mean classify.whirl\?"):
        change_thresholds(Thresholds(), ["whirl.direction=0.2"])


@pytest.mark.parametrize(
    ("text", "key"),
    [
        ("drive: {kind: soft_torqe, matching: 5, a: 0.3}\ninitial: {lag: 1 rad}", "drive.kind"),
        ("sweep: {drive.matching: [1, 2]}\ndrive: {kind: soft}", "drive.kind"),
        ("bit: {friction: {law: rationall, b0: 20 mm}}", "bit.friction.law"),
        ("modes: {lateral: frozn, axial: frozen}\ndrive: {kind: stiff}\ninitial: {z: 1 mm}", "modes.lateral"),
        ("model: segments\ndrive: {kind: soft_torqe, matching: 5}", "drive.kind"),
        ("drive: {kind: stiff, gains: [1, 2]}", "drive.gains"),  # too few for the gains of another kind
        ("sweep: {drive.torque_limit: [1 kN*m, 2 kN*m]}", "sweep.drive.torque_limit"),  # which an ideal drive has not
        ("model: beam\nbit: {friction: {static: 1 kN*m, dynamic: 2 kN*m}}", "bit.friction.dynamic_torque"),
    ],
)
def test_the_choice_alone_is_blamed(tmp_path, text, key):
    (tmp_path / "study.yaml").write_text(text)
    with pytest.raises(StudyError) as caught:
        load_study(tmp_path / "study.yaml")
    assert [fault.key for fault in caught.value.faults] == [key]


def test_wear_flats_of_a_bit_that_has_none_fit_any_bit():
    small = "model: segments\nbit: {radius: 0.4 mm, rock: {law: LAW}}"
    assert parse_study(small.replace("LAW", "lobed")).parameters.bit.radius == 4e-4
    assert "bit.rock.wear_length" in {fault.key for fault in faults(small.replace("LAW", "regenerative"))}
