"""The main model on the surface that the blades leave, in place of lobes."""

import json

import numpy as np
import pytest
from cli.helpers import call_here
from deviations import followed_and_quotient

import nsdrill
from nsdrill.analysis.bifurcations import HOPF
from nsdrill.app.experiment import prepare
from nsdrill.app.running.run import work_of
from nsdrill.errors import InputError
from nsdrill.models.operation import Values
from nsdrill.models.registry import model_named
from nsdrill.models.responses import Thresholds
from nsdrill.study import parse_study
from regenerative.reference import measured


def text(rpm=80, wob=44.48, rock="", frozen="modes: {lateral: frozen}\n", lines=""):
    rock = f"{{law: regenerative{rock and ', ' + rock}}}"
    return (
        f"bit: {{rock: {rock}}}\n{frozen}drillstring: {{axial_damping: 139 kN*s/m}}\n"
        f"operation: {{rotary_speed: {rpm} rpm, wob: {wob} kN}}\n{lines}"
    )


# the own model, with the numbers of the main one's string
OWN = (
    "model: regenerative\ndrillstring: {{axial_damping: 139 kN*s/m, torsional_damping: 50 N*m*s/rad}}\n"
    "operation: {{rotary_speed: {rpm} rpm, wob: {wob} kN}}\n{lines}"
)
START = "initial: {{twist: {twist} rad, vz: {vz} mm/s}}\n"


@pytest.mark.parametrize("rpm", [80, 60], ids=["clipped", "sticking"])
def test_without_a_lateral_mode_it_is_the_model_of_its_own(rpm):
    lines = START.format(twist=-29, vz=1) + "simulation: {transient: 0 s, observe: 6 s, rtol: 1.0e-10}\n"
    main = nsdrill.run(text(rpm, lines=lines), progress=False)
    own = nsdrill.run(OWN.format(rpm=rpm, wob=44.48, lines=lines), progress=False)
    names = ("axial_min", "axial_max", "bit_speed_min", "bit_speed_max", "bit_force_max", "blade_depth_max")
    for name in (*names, "lift_off_fraction", "rate_of_penetration", "surface_torque_max", "turned_back"):
        assert float(main[name].squeeze()) == pytest.approx(float(own[name].squeeze()), rel=1e-6, abs=1e-9), name
    assert float((main["axial_max"] - main["axial_min"]).squeeze()) > 1e-4


def test_check_speaks_of_the_surface_and_not_of_lobes():
    found = nsdrill.check(text(60, frozen="", rock="states: 4"))
    assert not [name for name in found.figures if name.startswith(("lobe", "lift_off", "stick_slip"))]
    # in closed form for the default string, 15 in, six blades
    assert found.figures["axial_threshold"].value == pytest.approx(9.2715, abs=1e-4)
    assert found.figures["states_needed"].value > 4
    told = " ".join(found.warnings)
    assert "lobe" not in told
    assert "bit.rock.states: " in told
    assert "Undamped" not in told
    thin = nsdrill.check(text(60).replace("139 kN*s/m", "4 kN*s/m"))
    assert any("Undamped" in one and "138" in one for one in thin.warnings)


@pytest.mark.parametrize("drive", ["ideal", "soft_torque"])
def test_small_deviations_are_those_of_the_model_of_its_own(drive):
    lines = f"drive: {{kind: {drive}}}\n"
    main, own = (
        nsdrill.check(text(95, frozen="", lines=lines)),
        nsdrill.check(OWN.format(rpm=95, wob=44.48, lines=lines)),
    )
    for name in ("growth", "growth_frequency", "steady_threshold", "axial_threshold", "theta"):
        assert main.figures[name].value == pytest.approx(own.figures[name].value, rel=1e-5), name
    assert main.figures["growth"].value < 0.0


def test_what_the_rock_does_not_read_is_refused():
    for line, key in (
        ("bit: {rock: {law: regenerative}, friction: {static: 0.6}}", "bit.friction.static"),
        ("bit: {rock: {law: regenerative}, friction: {static: 9 kN*m, dynamic: 5 kN*m}}", "bit.friction.static_torque"),
        ("bit: {rock: {law: regenerative}, lobes: 2}", "bit.lobes"),
        ("bit: {rock: {law: regenerative}, cutting: {c1: 2.0e-8}}", "bit.cutting.c1"),
        ("bit: {rock: {blades: 4}}", "bit.rock.blades"),
        ("bit: {rock: {law: regenerative}}\nmodes: {axial: frozen}", "bit.rock.law"),
        ("bit: {rock: {law: regenerative}}\nsweep: {bit.rock_stiffness: [10 MN/m, 20 MN/m]}", "bit.rock_stiffness"),
        ("bit: {rock: {law: regenerative, wear_length: 1 m}}", "bit.rock.wear_length"),
    ):
        with pytest.raises(InputError, match=key.replace(".", "[.]")):
            parse_study(line + "\n")


def test_friction_of_bit_and_flats_is_implicit_too():
    lines = "simulation: {transient: 40 s, observe: 20 s, rtol: 1.0e-9, method: WORD}\n"
    study = text(80, lines=START.format(twist=-29, vz=1) + lines)
    explicit, implicit = (nsdrill.run(study.replace("WORD", word), progress=False) for word in ("explicit", "implicit"))
    for name in ("bit_speed_max", "surface_torque_mean", "bit_force_max", "bit_torque_max"):
        assert float(implicit[name].squeeze()) == pytest.approx(float(explicit[name].squeeze()), rel=1e-4), name


def test_a_bit_that_sticks_is_that_of_the_exact_delay_by_both_methods():
    """From a bit at rest on a string that is wound up in part: it sticks for more than a
    tenth of the time, and breaks away."""
    lines = "initial: {twist: -22 rad, bit_speed: 0 rad/s, vz: 1 mm/s}\n"
    lines += "simulation: {transient: 0 s, observe: 6 s, rtol: 1.0e-9, method: WORD}\n"
    study = text(60, lines=lines)
    explicit, implicit = (
        {name: float(one[name].squeeze()) for name in one.data_vars if one[name].size == 1}
        for one in (nsdrill.run(study.replace("WORD", word), progress=False) for word in ("explicit", "implicit"))
    )
    names = ("bit_speed_max", "axial_max", "axial_min", "surface_torque_mean", "bit_force_max", "stuck_fraction")
    for name in names:
        assert implicit[name] == pytest.approx(explicit[name], rel=1e-4), name
    assert explicit["stuck_fraction"] > 0.1
    parsed = parse_study(study.replace("WORD", "explicit"))
    at = parsed.operation
    points = Values(parsed.parameters, parsed.initial, (at.depth, at.wob, at.rotary_speed))
    table = model_named(parsed.model.name).columns(points, Thresholds())
    named = {"per_mass": table["per_axial_mass"], "torsional_damping": parsed.parameters.drillstring.torsional_damping}
    exact = measured({**table, **named}, 0.0, 6.0, 1e-3, twist=-22.0, speed=0.0)
    assert explicit["axial_max"] - explicit["axial_min"] == pytest.approx(exact.swing, rel=0.03)
    assert explicit["bit_speed_max"] == pytest.approx(exact.bit_speed_max, rel=0.01)
    assert explicit["surface_torque_mean"] == pytest.approx(exact.surface_torque_mean, rel=0.01)


def test_the_deviation_is_the_derivative_of_the_motion():
    """With the collar on the wall, through lift-off."""
    lines = "simulation: {transient: 0 s, observe: 3 s, rtol: 1.0e-10}\n"
    lines += "initial: {x: 70 mm, vz: 5 mm/s, twist: -29 rad}\n"
    work = work_of(prepare(parse_study(text(60, frozen="", lines=lines))))
    followed, quotient = followed_and_quotient(work, 1e-12)
    names = work.program.variant.states
    assert np.all(np.abs(quotient[[names.index(part) for part in ("x", "z", "bit_speed", "surface_5")]]) > 1e-9)
    assert np.linalg.norm(followed - quotient) < 1e-3 * np.linalg.norm(quotient)


def test_rocks_are_an_axis_and_every_drive_takes_the_surface():
    lines = "simulation: {transient: 2 s, observe: 3 s}\nsweep: {bit.rock.law: [lobed, regenerative]}\n"
    both = nsdrill.run(text(lines=lines).replace("law: regenerative", "law: lobed"), progress=False)
    off = both["beyond_validity"].values.ravel() if "beyond_validity" in both else None
    assert off is None or len(off) == 2
    assert both["bit_force_max"].size == 2
    few = text(rock="states: 5", lines=lines).replace("law: regenerative", "law: lobed", 1)
    some = nsdrill.run(few.replace("law: lobed, states: 5", "law: regenerative, states: 5"), progress=False)
    assert [name for name in some["state"].values if name.startswith("surface")][-1] == "surface_4"
    for kind in ("soft_torque", "lqr", "dc_motor"):
        lines = f"drive: {{kind: {kind}}}\nsimulation: {{transient: 20 s, observe: 5 s}}\ninitial: {{twist: -29 rad}}\n"
        found = nsdrill.run(text(100, lines=lines), progress=False)
        assert int(found["status"].squeeze()) == 1
        assert found["state"].values[-2] == "surface_11"


def test_the_hopf_point_of_a_continuation_is_the_threshold():
    """That of axial and torsional motion together, by the matrix of the model of its own."""
    lines = START.format(twist=-29, vz=0.1) + "simulation: {rtol: 1.0e-8, transient: 60 s, observe: 10 s}\n"
    threshold = nsdrill.check(OWN.format(rpm=95, wob=44.48, lines="")).figures["steady_threshold"].value
    branch = nsdrill.continue_branches(
        text(95, rock="states: 8", lines=lines)
        + "continue: {along: rotary_speed, from: 95 rpm, to: 86 rpm, points: 60}\n",
        progress=False,
    )
    found = branch["rotary_speed"].values[branch["label"].values == HOPF]
    assert len(found) > 0
    assert found == pytest.approx(threshold, rel=1e-4)
    with pytest.raises(InputError, match="torsional"):
        nsdrill.continue_branches(
            text(95, frozen="modes: {torsional: frozen}\n")
            + "continue: {along: rotary_speed, from: 95 rpm, to: 90 rpm, points: 4}\n",
            progress=False,
        )


def test_what_is_shown_speaks_of_blades_and_not_of_lobes(tmp_path, capfd, monkeypatch):
    """The report and the sheet, the chart of critical speeds, and a trace."""
    monkeypatch.chdir(tmp_path)
    lines = START.format(twist=-29, vz=0.1) + "simulation: {transient: 2 s, observe: 2 s}\n"
    (tmp_path / "one.yaml").write_text(
        text(90, lines=f"{lines}sweep: {{rotary_speed: {{from: 85 rpm, to: 100 rpm, points: 3}}}}\n")
    )
    call_here(capfd, monkeypatch, "run", "one.yaml", "-o", "one.h5")
    for options in ([], ["--one-page"]):
        call_here(capfd, monkeypatch, "report", "one.h5", "-o", "one.html", "--overwrite", *options)
        words = (tmp_path / "one.html").read_text()
        assert "bit rock law regenerative" in words
        assert "bit lobes" not in words
        assert "strength of the rock" in words
        assert "rock stiffness" not in words
        assert "the surface that the bit cut before" not in words
    study = nsdrill.load_study("one.yaml")
    drawn = nsdrill.chart(study, "critical-speeds")
    labels = [line.get_label() for line in drawn.axes[0].get_lines()]
    assert "axial vibration by regeneration: none above" in labels
    trace = nsdrill.simulate(study, duration="2 s")
    assert float(trace["interference"].mean()) == pytest.approx(6.6e-4, rel=0.1)


def test_the_list_of_charts_is_that_of_the_model(tmp_path, capfd, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "own.yaml").write_text("model: regenerative\n")
    (tmp_path / "segments.yaml").write_text("model: segments\n")
    assert "has no charts" in call_here(capfd, monkeypatch, "plot", "own.yaml", "--list").out
    listed = call_here(capfd, monkeypatch, "plot", "segments.yaml", "--list").out
    assert "drive-card" in listed
    assert "critical-speeds" not in listed


def test_how_far_the_bit_turns_back_is_told(tmp_path, capfd, monkeypatch):
    """One that starts backward, and one that starts at its speed: at the end of the run, of a
    file and of a single point, in words and as JSON."""
    monkeypatch.chdir(tmp_path)
    lines = "simulation: {transient: 0 s, observe: 6 s}\ninitial: {bit_speed: -2 rad/s}\n"
    (tmp_path / "back.yaml").write_text(text(60, lines=f"{lines}sweep: {{rotary_speed: [60 rpm, 120 rpm]}}\n"))
    (tmp_path / "on.yaml").write_text(text(120, lines=lines.replace("-2", "13")))
    ran = call_here(capfd, monkeypatch, "run", "back.yaml", "-o", "back.h5")
    angles = nsdrill.open_results("back.h5")["turned_back"].values
    assert (angles > 0.01).all()
    words = f"in 2 of 2 runs the bit turns back, by up to {angles.max():.2g} spacings of its blades"
    assert f"TURNED BACK: {words}" in ran.out + ran.err
    shown = call_here(capfd, monkeypatch, "show", "back.h5").out
    assert f"TURNED BACK    {words}" in shown
    assert "  turned_back  " in shown
    told = json.loads(call_here(capfd, monkeypatch, "show", "back.h5", "--json").out)
    assert told["turned_back"] == {"runs": 2, "of": 2, "greatest": pytest.approx(angles.max())}
    (tmp_path / "one.yaml").write_text(text(60, lines=lines))
    call_here(capfd, monkeypatch, "run", "one.yaml", "-o", "one.h5")
    call_here(capfd, monkeypatch, "report", "one.h5", "-o", "one.html")
    assert "TURNED BACK: in 1 of 1 run" in (tmp_path / "one.html").read_text()
    ran = call_here(capfd, monkeypatch, "run", "on.yaml", "-o", "on.h5")
    assert "TURNED BACK" not in ran.out + ran.err + call_here(capfd, monkeypatch, "show", "on.h5").out
