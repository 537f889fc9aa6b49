"""The drag bit in every part of nsdrill: continuation, implicit friction, deviations, chains
that are resumed, drives, starts and commands."""

import json
import math

import numpy as np
import pytest
from cli.helpers import call_here
from deviations import followed_and_quotient, tangent_and_difference

import nsdrill
from nsdrill.analysis.bifurcations import HOPF
from nsdrill.analysis.graded import graded
from nsdrill.analysis.histories import Grade
from nsdrill.app.answering.answers import results_for_window
from nsdrill.app.experiment import prepare
from nsdrill.app.running.run import work_of
from nsdrill.data import STICKS_TO
from nsdrill.models import surface
from nsdrill.models.operation import Values
from nsdrill.models.registry import described, model_named
from nsdrill.models.responses import Thresholds
from nsdrill.models.variant import variant_at
from nsdrill.study import parse_study
from regenerative.test_surface import RPM, text

STICKING = text(rpm=60, wear=6, wob=55.08, D=0, states=6)
BOUNCING = text(rpm=100, wear=0, wob=8.1, states=6)


def test_continuation_finds_the_hopf_point():
    """15.07742 rad/s, where the exact characteristic equation has it (``test_surface``), and a
    cycle below it."""
    branch = nsdrill.continue_branches(
        text(states=8, lines="simulation: {rtol: 1.0e-8, transient: 20 s, observe: 10 s}\n")
        + "continue: {along: rotary_speed, from: 160 rpm, to: 140 rpm, points: 40}\n",
        progress=False,
    )
    found = branch["rotary_speed"].values[branch["label"].values == HOPF]
    assert len(found) == 1
    assert found[0] == pytest.approx(15.07742, abs=2e-4)


@pytest.mark.parametrize("study", [STICKING, BOUNCING], ids=["sticking", "bouncing"])
def test_implicit_friction_gives_the_same_cycle(study):
    lines = "simulation: {{transient: 60 s, observe: 60 s, rtol: 1.0e-9, method: {}}}\n"
    explicit, implicit = (
        nsdrill.run(study + lines.format(method), progress=False) for method in ("explicit", "implicit")
    )
    for name in ("bit_speed_max", "surface_torque_mean", "bit_force_max"):
        assert float(implicit[name].squeeze()) == pytest.approx(float(explicit[name].squeeze()), rel=1e-4)
    swings = [float((one["axial_max"] - one["axial_min"]).squeeze()) for one in (explicit, implicit)]
    assert swings[0] == pytest.approx(swings[1], rel=1e-4)


@pytest.mark.parametrize(
    ("study", "seconds", "parts"),
    [
        (STICKING, 3.0, ("twist", "surface_3")),
        (BOUNCING + "initial: {vz: 5 mm/s}\n", 2.0, ("z", "surface_5")),
        (STICKING + "drive: {kind: soft_torque}\n", 3.0, ("lag", "drive_speed", "surface_0")),
    ],
    ids=["sticking", "bouncing", "soft torque"],
)
def test_the_deviation_is_the_derivative_of_the_motion(study, seconds, parts):
    """Through sticking, and through landing and lift-off."""
    parsed = parse_study(f"{study}simulation: {{transient: 0 s, observe: {seconds} s, rtol: 1.0e-10}}\n")
    work = work_of(prepare(parsed))
    followed, quotient = followed_and_quotient(work, 1e-12)
    names = work.program.variant.states
    assert np.all(np.abs(quotient[[names.index(part) for part in parts]]) > 1e-9)
    assert np.linalg.norm(followed - quotient) < 2e-4 * np.linalg.norm(quotient)


def test_a_chain_has_the_same_bits_with_other_workers_and_in_a_replay(tmp_path):
    chain = "simulation: {transient: 5 s, observe: 5 s}\n"
    chain += "sweep: {rotary_speed: {from: 60 rpm, to: 90 rpm, points: 4}, procedure: up-down}\n"
    whole = nsdrill.run(STICKING + chain, tmp_path / "whole.h5", progress=False)
    lanes = nsdrill.run(STICKING + chain, tmp_path / "lanes.h5", workers=1, progress=False)
    for name in ("final_state", "bit_speed_max", "axial_min"):
        assert whole[name].values.tobytes() == lanes[name].values.tobytes()
    assert list(whole["state"].values[-7:-1]) == list(surface.names(6))
    # a run from a state of the file goes on as the chain does
    trace = nsdrill.replay(tmp_path / "whole.h5", rotary_speed="80 rpm", procedure="down")
    at = whole.sel(procedure="down").isel(rotary_speed=2)
    assert float(trace["bit_speed"][-1]) == float(at["final_state"].sel(state="bit_speed").squeeze())


def test_an_interrupted_run_goes_on_to_the_same_bits(tmp_path):
    """From the log of a chain up and down whose last points are missing."""
    chain = "simulation: {transient: 5 s, observe: 5 s}\n"
    chain += "sweep: {rotary_speed: {from: 60 rpm, to: 90 rpm, points: 4}, procedure: up-down}\n"
    whole, cut = tmp_path / "whole.h5", tmp_path / "cut.h5"
    nsdrill.run(STICKING + chain, whole, progress=False)

    def stopped(progress):
        if progress.done >= 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        nsdrill.run(STICKING + chain, cut, progress=stopped)
    assert cut.with_name("cut.h5.part").exists()
    nsdrill.run(STICKING + chain, cut, progress=False, resume=True)
    first, second = nsdrill.open_results(whole), nsdrill.open_results(cut)
    for name in ("final_state", "bit_speed_max", "axial_min", "blade_depth_max", "steps"):
        assert first[name].values.tobytes() == second[name].values.tobytes(), name


def test_a_run_says_what_is_beyond_the_model(tmp_path, capfd, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "study.yaml").write_text(BOUNCING + "simulation: {transient: 20 s, observe: 10 s}\n")
    told = call_here(capfd, monkeypatch, "run", "study.yaml", "-o", "out.h5")
    assert "BEYOND the validity of the model: 1 of 1 run (1 off bottom)" in told.out + told.err


@pytest.mark.parametrize(
    "study",
    [
        "model: regenerative\nbit: {{{}}}\n",
        "bit: {{rock: {{law: regenerative, {}}}}}\n",
        "model: segments\nsegments: {{pipe: 1, collar: 1}}\nbit: {{rock: {{law: regenerative, {}}}}}\n",
    ],
    ids=["own", "main", "segments"],
)
def test_what_makes_a_window_worthless_is_among_its_first_warnings(tmp_path, study, capfd, monkeypatch):
    """Too few states, which damp the vibration that is looked for, and a bit that does not cut; in
    the window and in ``show``, as text and as JSON."""
    monkeypatch.chdir(tmp_path)
    lines = "sweep: {rotary_speed: [20 rpm, 25 rpm], procedure: same}\nsimulation: {transient: 0 s, observe: 0.1 s}\n"
    for number, (bit, key, words) in enumerate(
        [("states: 2", "few_states", "COARSE ROCK"), ("wear_length: 20 mm, states: 40", "nothing_cut", "NOTHING ")]
    ):
        nsdrill.run(study.format(bit) + lines, f"{number}.h5", progress=False)
        told = call_here(capfd, monkeypatch, "window", f"{number}.h5").out
        assert f"\n  {words}" in told
        assert f"\n  {words}" in call_here(capfd, monkeypatch, "show", f"{number}.h5").out
        for command in ("window", "show"):
            found = json.loads(call_here(capfd, monkeypatch, command, f"{number}.h5", "--json").out)
            assert [name for name in ("few_states", "nothing_cut") if found[name]] == [key]


# at 45 and 75 rpm the bit comes off bottom within these seconds, from 90 rpm on it does not
AROUND = (
    "model: regenerative\nbit: {{states: 6}}\noperation: {{depth: 5000 m, wob: 44.48 kN}}\n"
    "sweep: {{rotary_speed: [45 rpm, 75 rpm, 90 rpm, 105 rpm], {}procedure: same}}\n"
    "simulation: {{transient: 10 s, observe: 10 s}}\n"
)


def test_pictures_and_answers_say_what_is_beyond_the_model(tmp_path):
    out = tmp_path / "out.h5"
    nsdrill.run(AROUND.format(""), out, progress=False)
    note = "beyond the validity of the model (2 of 4: 2 off bottom)"
    for kind in ("bifurcation", "value", "window"):
        figure = nsdrill.plot(out, kind)
        assert note in [one.get_text() for one in figure.legends[0].get_texts()], kind
        if kind != "window":
            strip = figure.axes[0]
            [marks] = [one for one in strip.collections if one.get_gid() == "beyond_validity"]
            # the cells of 45 and of 75 rpm, up to half way to the next
            ends = np.array([segment[:, 0] for segment in marks.get_segments()]) / RPM
            np.testing.assert_allclose(ends, [[37.5, 60], [60, 82.5]])
    alone = nsdrill.plot(out, panel="bit_speed")
    assert note in [one.get_text() for one in alone.legends[0].get_texts()]
    slow = nsdrill.plot(out, xlim=("88 rpm", "110 rpm"))
    assert not [one for one in slow.legends[0].get_texts() if "beyond" in one.get_text()]
    plane = nsdrill.plot(nsdrill.run(AROUND.format("wob: [40 kN, 44.48 kN], "), progress=False), "map")
    assert [one for one in plane.legends[0].get_texts() if "of 8: " in one.get_text() and "beyond" in one.get_text()]
    found = nsdrill.window(out)
    assert found["beyond"] == {"off_bottom": 2}
    for name, one_page in (("page.html", True), ("whole.html", False)):
        nsdrill.report(out, tmp_path / name, one_page=one_page)
        assert note in (tmp_path / name).read_text()


def test_the_exponent_of_a_cycle_is_zero_and_its_section_repeats():
    data = nsdrill.run(
        STICKING.replace("states: 6", "states: 8")
        + "simulation: {transient: 150 s, observe: 150 s, rtol: 1.0e-8}\nrecord: {exponent: true, poincare: 40}\n",
        progress=False,
    )
    assert float(data["lyapunov_exponent"].squeeze()) == pytest.approx(0.0, abs=0.02)


@pytest.mark.parametrize("kind", ["stiff", "soft_torque", "equal_damping", "z_torque", "pi"])
def test_every_drive_keeps_the_set_speed_above_the_threshold(kind):
    """Twist and torque of steady drilling do not depend on the drive."""
    steady = text(rpm=200, states=4, lines="simulation: {transient: 60 s, observe: 20 s}\n")
    data = nsdrill.run(f"{steady}drive: {{kind: {kind}}}\n", progress=False)
    torque = nsdrill.check(steady).figures["mean_torque"].value
    assert float(data["bit_speed_mean"].squeeze()) == pytest.approx(200 * RPM, rel=1e-5)
    assert float(data["drive_speed_mean"].squeeze()) == pytest.approx(200 * RPM, rel=1e-5)
    assert float(data["surface_torque_mean"].squeeze()) == pytest.approx(torque, rel=1e-4)
    assert int(data["response"].squeeze()) == 0


def test_drives_are_an_axis_and_a_file_has_the_states_of_all():
    data = nsdrill.run(
        text(rpm=200, states=4, lines="simulation: {transient: 5 s, observe: 5 s}\n")
        + "sweep: {drive.kind: [ideal, soft_torque], procedure: same}\n",
        progress=False,
    )
    lag = data["final_state"].sel(state="lag").values.squeeze()
    assert np.isnan(lag[0])
    assert abs(lag[1]) > 0.0


def test_blades_are_an_axis_and_starts_are_drawn():
    data = nsdrill.run(
        text(states=4, lines="simulation: {transient: 5 s, observe: 5 s}\n").replace("blades: 4, ", "")
        + "sweep: {bit.blades: [3, 6], procedure: same}\ninitial: {ensemble: 3}\n",
        progress=False,
    )
    first = data["initial_state"].sel(state="surface_0").values.squeeze()
    assert first.shape == (2, 3)
    assert first[0] / first[1] == pytest.approx(np.full(3, 2.0))  # half the blades cut twice as deep
    assert np.ptp(data["initial_state"].sel(state="twist").values.squeeze()[0]) > 0.1


def test_sections_and_sums_of_the_string_are_those_of_the_main_model():
    whole = nsdrill.check("operation: {depth: 3000 m}\n").coefficients
    own = nsdrill.check("model: regenerative\noperation: {depth: 3000 m}\n").coefficients
    assert (own.m_a, own.k_a, own.J, own.k_t) == (whole.m_a, whole.k_a, whole.J, whole.k_t)
    sections = (
        "operation: {depth: 5000 m}\ndrillstring: {sections: [{outer_diameter: 5 in, inner_diameter: 4.276 in}, "
        "{length: 200 m, outer_diameter: 9 in, inner_diameter: 3 in}]}\n"
    )
    found = nsdrill.check(f"model: regenerative\n{sections}").coefficients
    area = math.pi / 4 * (0.127**2 - (4.276 * 0.0254) ** 2)
    assert found.c_a == pytest.approx(area * math.sqrt(210e9 * 7850), rel=1e-9)
    assert found.m_a < nsdrill.check("model: regenerative\n").coefficients.m_a * 1.01
    with pytest.raises(nsdrill.StudyError, match="length of the collars"):
        nsdrill.load_study("model: regenerative\noperation: {depth: 150 m}\n")


def test_friction_of_the_flats_asks_for_implicit_steps_where_it_is_steep():
    described_rates = described("regenerative").friction_rates
    study = nsdrill.load_study(text(lines="").replace("wear_length", "wear_smoothing: 400, wear_length"))
    points = Values(study.parameters, study.initial, (1000.0, 15876.0, 120 * RPM))
    rates = described_rates(points)
    assert rates["bit.wear_smoothing"] == pytest.approx(400 / 0.0041667 * 7776 / 2 / 34000, rel=1e-3)
    assert nsdrill.check(study).method == ("implicit",)
    assert nsdrill.check(text()).method == ("explicit",)


def test_a_bit_that_cuts_nothing_is_told_by_a_quiet_run_and_by_show(tmp_path, capfd, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "one.yaml").write_text(text() + "simulation: {transient: 5 s, observe: 10 s}\n")
    for number, (wear, is_dull) in enumerate([("6 mm", True), ("1.2 mm", False)]):
        words = ("run", "one.yaml", "-o", f"{number}.h5", "--set", f"bit.wear_length={wear}", "--quiet")
        said = call_here(capfd, monkeypatch, *words).err
        assert ("Warning: Dull: the wear flats bear 38.88 kN" in said) == is_dull
        assert "points" not in said
        assert f"{number}.h5" not in said
        shown = call_here(capfd, monkeypatch, "show", f"{number}.h5").out
        assert ("NOTHING CUT    the wear flats bear 38.88 kN" in shown) == is_dull
        assert (
            bool(json.loads(call_here(capfd, monkeypatch, "show", f"{number}.h5", "--json").out)["nothing_cut"])
            == is_dull
        )


def test_the_depth_of_cut_of_a_blade_has_one_name_and_that_of_a_revolution_another():
    """In every model with such a bit."""
    own = nsdrill.check("model: regenerative\n")
    whole = nsdrill.check("bit: {rock: {law: regenerative}}\n")
    segments = nsdrill.check("model: segments\nbit: {rock: {law: regenerative}}\n")
    for report in (own, whole, segments):
        assert "of a blade" in report.figures["blade_depth"].meaning
        assert "depth_of_cut" not in report.figures
    blades = nsdrill.load_study("bit: {rock: {law: regenerative}}\n").parameters.bit.rock.blades
    assert whole.coefficients.depth_of_cut == pytest.approx(blades * whole.figures["blade_depth"].value)


def test_commands_write_check_and_show_a_study(tmp_path, capfd, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def call(*words):
        return call_here(capfd, monkeypatch, *words)

    call("new", "--model", "regenerative", "--all", "-o", "new.yaml")
    assert nsdrill.load_study("new.yaml").model.name == "regenerative"
    out = call("check", "new.yaml").out
    assert "states_needed" in out
    assert "axial_threshold" in out
    (tmp_path / "one.yaml").write_text(BOUNCING + "simulation: {transient: 20 s, observe: 20 s}\n")
    call("run", "one.yaml", "-o", "one.h5")
    assert "BEYOND the validity of the model: 1 of 1 run (1 off bottom)" in call("show", "one.h5").out
    assert json.loads(call("show", "one.h5", "--json").out)["beyond"] == {"off_bottom": 1}
    call("simulate", "one.yaml", "-o", "trace.h5", "--duration", "2 s")
    call("plot", "trace.h5", "-o", "trace.png")


@pytest.mark.parametrize("drive", ["ideal", "soft_torque"])
@pytest.mark.parametrize("implicit", [False, True])
def test_the_tangent_is_the_derivative_of_the_slopes(drive, implicit):
    """At random states, cutting and off bottom, turning forward and back: slopes, pushes and
    moved velocities, against differences of fourth order."""
    study = parse_study(text(states=7) + f"drive: {{kind: {drive}}}\n")
    model, at, lanes, step = model_named("regenerative"), study.operation, 16, 1e-5
    variant = variant_at(model, study.parameters)
    variant = variant.implicit if implicit else variant
    points = Values(
        study.parameters, study.initial, tuple(np.full(lanes, v) for v in (at.depth, at.wob, at.rotary_speed))
    )
    table, rng = model.pack(points, Thresholds()), np.random.default_rng(7)
    size = variant.state_scales(table).T
    state = model.starts(points, 0)[:, : len(variant.states)].T + rng.normal(size=size.shape) * size
    names = variant.states
    state[names.index("surface_0")] += np.where(np.arange(lanes) % 2, 8.0, -8.0) * size[names.index("surface_0")]
    state[names.index("bit_speed"), ::4] *= -1.0
    # the wear flats bear in part where the bit all but stops along the hole
    state[names.index("vz"), 1::2] = 4.1667e-3 * (1.0 + 0.05 * rng.normal(size=lanes // 2))
    state[names.index("bit_speed"), 1::4] *= 1e-3
    deviation = rng.normal(size=size.shape) * size
    contact = surface.sums_of(state[[names.index(name) for name in surface.names(7)]])[2]
    found, exact = tangent_and_difference(
        variant, table, state, deviation, contact, step=step, implicit=implicit, time=0.3
    )
    # Newton's method leaves 1e-5 of a load at rest
    bound = (1e-4 if implicit else 1e-8) * np.abs(exact).max(axis=1, keepdims=True)
    assert np.all(np.abs(found - exact) <= bound)


def test_nothing_is_allowed_where_steady_drilling_is_unstable():
    """Between the speed to which vibration was met in a short run and the threshold of
    ``check``, above which alone a deviation decays."""
    base = "sweep: {rotary_speed: {from: 60 rpm, to: 160 rpm, points: 26}, procedure: up, along: rotary_speed}\n"
    words = "operation: {depth: 9000 ft, wob: 15 klbf, rotary_speed: 100 rpm}\n"
    study = nsdrill.load_study("model: regenerative\n" + words + base + "simulation: {transient: 1 s, observe: 2 s}\n")
    threshold = nsdrill.check(study).figures["steady_threshold"].value
    results = nsdrill.run(study)
    told = json.loads(results_for_window(results).attrs[STICKS_TO])
    assert told["unstable_to"] == [pytest.approx(threshold, rel=1e-6)]
    assert told["lasts_to"] == [None]
    speeds = results.coords["rotary_speed"]
    grades = graded(results_for_window(results)).grade[0, 0]
    assert np.all(grades[speeds < threshold] < Grade.FROM_START)


def test_a_limit_that_the_motor_keeps_within_changes_no_figure_of_check():
    """Steady drilling takes 8.2 kN m, tau D^2/8 times the depth of a revolution and what the
    flats rub."""
    study = "model: regenerative\noperation: {{wob: 60 kN, rotary_speed: 8 rad/s}}\ndrive: {{kind: pi{}}}\n"
    free, limited, weak = (nsdrill.check(study.format(f", torque_limit: {n} kN*m" if n else "")) for n in (0, 20, 2))
    figures = {name: figure.value for name, figure in limited.figures.items() if name != "torque_reserve"}
    assert figures == {name: figure.value for name, figure in free.figures.items()}
    assert limited.warnings == free.warnings
    assert limited.figures["balance_speed"].value == pytest.approx(8.0)
    told = " ".join(weak.warnings)
    assert "Overloaded: steady drilling takes 8." in told
    assert "At rest" not in told
