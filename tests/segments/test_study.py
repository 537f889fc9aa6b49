"""The string of segments from study to files: what a user sees."""

import math

import numpy as np
import pytest
from observe.sampled import maxima, slips

from nsdrill import api
from nsdrill.errors import RunWarning, StudyError
from nsdrill.kernel.settings import Simulation
from nsdrill.models.segments.columns import states_of
from nsdrill.models.segments.description import are_states
from nsdrill.models.segments.parameters import Initial
from nsdrill.observe.thresholds import Record
from nsdrill.study.load import parse_study
from nsdrill.variables import EQUILIBRIUM, PERIODIC
from segments.lanes import MODEL, SPEED, Slopes, run, string
from segments.plain import Plain, plain_of

STUDY = """\
model: segments
segments: {pipe: 2, collar: 2}
operation: {depth: 2200 m, wob: 100 kN}
initial: {twist: 0 rad, bit_speed: 0 rad/s}
sweep: {rotary_speed: [13 rad/s, 30 rad/s]}
simulation: {transient: 20 s, observe: 20 s}
record: {peaks: 8, poincare: 20}
"""


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    path = tmp_path_factory.mktemp("segments") / "results.h5"
    api.run(STUDY, path, progress=False)
    return path


def test_a_sweep_is_stored_read_and_replayed_to_the_bit(results):
    """Another number of segments than usual has other states; the file is read by them."""
    data = api.open_results(results)
    assert data["initial_state"].shape[-1] == 4 * 5 + 2
    trace = api.replay(results, rotary_speed="30 rad/s", sample="1 ms")
    assert trace.attrs["status"] == "ok"
    np.testing.assert_array_equal(
        trace.attrs["final_state"], data["final_state"].sel(rotary_speed=30.0).to_numpy().ravel()
    )


def test_features_are_those_of_a_dense_trace(results):
    """Sampled every millisecond. The bit turns at up to 80 rad/s and 100 rad/s^2, so
    that between samples extremes of the speed differ by 1e-4 rad/s; the force rises
    within milliseconds, to a few percent. Fractions of 20 s differ by a sample at every
    passage."""
    data = api.open_results(results).sel(rotary_speed=30.0)
    trace = api.replay(results, rotary_speed="30 rad/s", sample="1 ms")
    seen = {name: trace[name].to_numpy()[20_000:] for name in trace.data_vars}

    def measured(name):
        return float(data[name].to_numpy().item())

    assert measured("bit_speed_max") == pytest.approx(seen["bit_speed"].max(), abs=2e-3)
    assert measured("bit_speed_mean") == pytest.approx(np.trapezoid(seen["bit_speed"]) / 20_000, rel=1e-4)
    assert measured("stuck_fraction") == pytest.approx(np.mean(seen["bit_speed"] < 5 * math.pi / 30), abs=2e-3)
    off = 1e-3 * np.sin(seen["twist"] + seen["drive_angle"]) - seen["z"] <= 0.0
    assert 0.0 < measured("lift_off_fraction") == pytest.approx(np.mean(off), abs=2e-3)
    assert measured("axial_max") == pytest.approx(seen["z"].max(), abs=1e-6)
    assert measured("bit_force_max") == pytest.approx(seen["bit_force"].max(), rel=0.03)
    for name in ("surface_torque", "drive_speed", "current", "hook_load_change"):
        span = np.ptp(seen[name])
        assert measured(f"{name}_max") == pytest.approx(seen[name].max(), abs=2e-3 * span)
        assert measured(f"{name}_min") == pytest.approx(seen[name].min(), abs=2e-3 * span)


def test_a_trace_has_the_forces_of_the_equations(results):
    """At the end of a trace, whose whole state is kept."""
    trace = api.replay(results, rotary_speed="30 rad/s", sample="1 ms")
    state, plain = np.asarray(trace.attrs["final_state"]), Plain(speed=30.0, pipes=2, collars=2)
    parts = plain_of(state[:-1], 4)
    _, force, torque = plain.bit((state[-1]) / 30.0, parts)
    u, _, th, w, current = plain.parts(parts)
    wound = plain.kt[0] * (th[0] - th[1] + plain.beta_t * (w[0] - w[1]))
    found = {name: float(trace[name][-1]) for name in trace.data_vars}
    assert found["bit_force"] == pytest.approx(force, rel=1e-6, abs=1e-3)
    assert found["bit_torque"] == pytest.approx(torque, rel=1e-6, abs=1e-3)
    assert found["surface_torque"] == pytest.approx(wound, rel=1e-9)
    assert found["hook_load_change"] == pytest.approx(-plain.k_top * u[0], rel=1e-9)
    assert found["current"] == pytest.approx(current, rel=1e-9)


def test_an_ideal_drive_turns_with_the_set_speed_of_each_point_of_a_chain():
    """The motion is carried on, the speed of the drive is not. It has a torque, and no
    current."""
    text = STUDY.replace("13 rad/s, 30 rad/s]", "30 rad/s, 31 rad/s], procedure: up").replace("20 s", "1 s")
    done = api.run(f"{text}drive: {{kind: ideal}}\n", progress=False)
    for name in ("drive_speed_min", "drive_speed_max"):
        np.testing.assert_array_equal(done[name].to_numpy().ravel(), [30.0, 31.0])
    np.testing.assert_allclose(done["drive_speed_mean"].to_numpy().ravel(), [30.0, 31.0], rtol=1e-14)
    assert "current_max" not in done
    assert np.all(done["drive_torque_max"].to_numpy() > done["surface_torque_mean"].to_numpy())
    np.testing.assert_array_equal(
        done["final_state"].sel(state="twist").to_numpy().ravel()[0],
        done["initial_state"].sel(state="twist").to_numpy().ravel()[1],
    )


def test_a_string_at_rest_and_one_without_flow():
    """Words for what the numbers say as well."""
    head = STUDY.partition("initial:")[0] + "operation: {depth: 2200 m}\nsimulation: {transient: 1 s, observe: 1 s}\n"
    head = head.replace("operation: {depth: 2200 m, wob: 100 kN}\n", "")
    word = parse_study(f"{head}initial: {{start: rest}}\n").initial
    assert (word.twist, word.bit_speed) == (None, None)
    still = [
        api.run(f"{head}initial: {text}\n", progress=False)["initial_state"].to_numpy()
        for text in ("{start: rest}", "{twist: 0 rad, bit_speed: 0 rad/s}")
    ]
    np.testing.assert_array_equal(*still)
    off = parse_study(head.replace("collar: 2}", "collar: 2, hydraulics: null}")).parameters.segments.hydraulics
    assert (off.annulus_factor, off.bore_factor, off.flow) == (0.0, 0.0, 0.022)


def test_steady_drilling_returns_once_a_revolution():
    """The section is a whole turn of the bit. Without pulsation steady drilling on a
    low lobe repeats with each turn, and on flat rock it is an equilibrium."""
    quiet = {"segments__pipe": 2, "segments__collar": 2, "segments__hydraulics__pulsation": 0.0}
    keep, simulation = Record(peaks=4, poincare=16), Simulation(150.0, 20.0)
    done = run(string(**quiet, bit__surface_amplitude=2e-4), simulation, record=keep, rotary_speed=60.0)
    assert (done["motion"][0], done["period"][0]) == (PERIODIC, 1)
    still = run(string(**quiet, bit__surface_amplitude=0.0), simulation, record=keep, rotary_speed=60.0)
    assert still["motion"][0] == EQUILIBRIUM
    assert np.all(np.isfinite(done["section_bit_speed"][0]))


def test_a_bit_that_sticks_shows_its_slips(results):
    """The greatest speed of each slip, as a trace sampled every millisecond has it, and
    none of the ripples between the slips."""
    found = api.open_results(results)["bit_speed_peaks"].sel(rotary_speed=13.0).to_numpy().ravel()
    speed = api.replay(results, rotary_speed="13 rad/s", sample="1 ms")["bit_speed"].to_numpy()
    seen = speed[20_000:]
    expected = slips(seen, 5 * np.pi / 30, 13.0)
    assert len(expected) >= 2
    assert len(maxima(seen)) > 8 * len(expected)
    assert found[np.isfinite(found)] == pytest.approx(expected, rel=1e-4)


def test_results_get_new_labels(results):
    """With a bound above every index and fraction nothing is critical."""
    data = api.open_results(results)
    assert np.all(data["response"] != 0)
    bounds = {"classify.stick_slip.stick_slip_index": 1000.0, "classify.bit_bounce.lift_off_fraction": 1.0}
    assert np.all(api.classify(data, bounds)["response"] == 0)


def test_starts_follow_from_the_bit():
    """A string at rest below a table that turns: no twist to speak of, speeds that fall
    to that of the bit."""
    points = Slopes(string()).points
    rest = MODEL.starts(type(points)(points.parameters, Initial(twist=0.0, bit_speed=0.0), points.operation), 0)[0]
    _, _, th, w, current = Plain().parts(plain_of(rest[:-1], 20))
    assert w[0] == SPEED
    assert w[-1] == th[-1] == th[0] == 0.0
    assert np.all(np.diff(w) < 0.0)
    # of 11.3 rad in steady drilling: drag to the wall bends the shape
    assert np.abs(th).max() < 0.1
    assert current == pytest.approx(53.362710, rel=1e-7)


def test_an_ensemble_starts_within_its_bounds():
    """Twice the set speed at most, and one and a half times the twist of steady
    drilling."""
    points = Slopes(string()).points
    made = MODEL.starts(type(points)(points.parameters, Initial(ensemble=64), points.operation), np.arange(64))
    steady = MODEL.starts(points, 0)[0]
    twist, speed = made[:, -4], made[:, -3]
    assert np.all((speed >= 0.0) & (speed <= 2 * SPEED))
    assert np.ptp(speed) > SPEED
    assert np.all((twist <= 0.0) & (twist >= 1.5 * steady[-4]))


def test_names_of_states_tell_the_number_of_segments():
    for nodes in (2, 20, 80):
        assert are_states((*states_of(nodes), "drive_angle"))
    assert not are_states((*states_of(81), "drive_angle"))
    assert not are_states((*states_of(10)[1:], "drive_angle"))
    assert not are_states(("z",))


@pytest.mark.parametrize(
    ("line", "key", "words"),
    [
        ("segments: {pipe: 41}", "segments.pipe", "at least 1 and at most 40"),
        ("operation: {depth: 200 m, wob: 100 kN}", "operation.depth", "above drillstring.collar.length"),
        ("operation: {depth: 2200 m, wob: 500 N}", "operation.wob", "at least 1 kN"),
        ("well: {diameter: 150 mm}", "well.diameter", "above drillstring.collar.outer_diameter"),
        ("drive: {kind: stiff, control_weight: 3}", "drive.control_weight", "a drive of the kind stiff reads"),
        ("drive: {inductance: 5 ohm}", "drive.inductance", "H or mH"),
        ("bit: {teeth: 3}", "bit.teeth", "rock_stiffness"),
        (
            "drive: {kind: soft_torque, table_damping: 3 N*m*s/rad}",
            "drive",
            "which the drive soft_torque does not read",
        ),
        ("drive: {kind: stiff, gear: 7}", "drive", "which the drive stiff does not read"),
        ("drive: {kind: ideal, inertia: 3000 kg*m^2}", "drive", "what a drive of the kind ideal reads: nothing"),
        ("drive: {kind: z_torque, torque_limit: 60 kN*m}", "drive", "which the drive z_torque does not read"),
        (
            "drive: {kind: soft_torque, torque_limit: 60 kN*m, compensated_inertia: 9 kg*m^2}",
            "drive",
            "none with drive.compensated",
        ),
        ("drive: {kind: soft_torque, compensated_inertia: 3000 kg*m^2}", "drive", "below drive.inertia"),
        ("drive: {kind: softtorque}", "drive", "soft_torque"),
        (
            "drive: {kind: soft_torque, on_at: 5 s}\nsweep: {wob: [50 kN, 60 kN], procedure: up}",
            "drive",
            "carries the state",
        ),
        ("drive: {gains: [1, 2, 3]}", "drive", "five: K_I, K_1, K_2, K_3, K_4, or null"),
        ("drive: {on_at: 3 s}", "drive", "a time without drive.gains"),
        ("drive: {kind: lqr, gains: [1, 2, 3, 4, 5]}", "drive", "which the drive lqr does not read"),
        ("drive: {gains: 3}", "drive", "a list of one to 5"),
        ("drive: {gains: [1, 2, 3, 4, x]}", "drive", "found 'x'"),
    ],
)
def test_what_cannot_be_is_refused_by_its_key(line, key, words):
    operation = "" if line.startswith("operation") else "operation: {depth: 2200 m, wob: 50 kN}\n"
    with pytest.raises(StudyError) as told:
        parse_study(f"model: segments\n{operation}{line}\n")
    assert key in str(told.value)
    assert words in str(told.value)


LATE = """\
model: segments
segments: {pipe: 2, collar: 2}
drive: {kind: lqr, on_at: 30 s}
operation: {depth: 2200 m, wob: 100 kN}
sweep: {rotary_speed: [13 rad/s, 30 rad/s]}
"""


@pytest.mark.parametrize(
    ("seconds", "told"), [((40, 40), None), ((20, 20), "within the observation"), ((10, 10), "runs end at 20 s")]
)
def test_control_that_begins_late_is_told(seconds, told):
    """Check, results and window tell that a drive is not switched on before what is observed."""
    study = parse_study(LATE + "simulation: {{transient: {} s, observe: {} s}}\n".format(*seconds))
    words = "control of the drive begins at 30 s (drive.on_at), "
    warned = [text for text in api.check(study).warnings if words in text]
    assert len(warned) == (told is not None)
    if told is not None:
        assert told in warned[0]
        results = api.run(study, progress=False)
        assert words in api.window(results)["answer"]["warnings"][0]
        assert words in str(api.show(results)).replace("\n", " ")


def test_a_single_run_without_control_is_told():
    study = parse_study(LATE)
    with pytest.warns(RunWarning, match=r"begins at 30 s \(drive.on_at\), and the run ends at 5 s"):
        api.simulate(study, rotary_speed=13.0, duration=5.0)
