"""Deviations and implicit friction of every model, against neighbouring runs and
differences; and that neither lanes nor the exponent change a run."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from deviations import followed_and_quotient, tangent_and_difference

import nsdrill
from nsdrill.app.experiment import prepare
from nsdrill.app.running.run import work_of
from nsdrill.models.friction import LAWS
from nsdrill.models.operation import Values
from nsdrill.models.registry import model_named
from nsdrill.models.responses import Thresholds
from nsdrill.models.variant import variant_at
from nsdrill.observe.thresholds import Record
from nsdrill.store import from_dataset
from nsdrill.study import parse_study

STABILIZERS = """
operation: {wob: 40 kN, rotary_speed: 5 rad/s}
stabilizer: {clearance: 5 mm, friction: {static: 0.3, dynamic: 0.2, smoothing: 50 s/m}}
initial: {x: 6 mm, vx: 0.1 m/s, vy: 0.2 m/s}
"""
ALONG = """
operation: {wob: 40 kN, rotary_speed: 4 rad/s}
well: {inclination: 60 deg, axial_friction: true, friction: {smoothing: 20 s/m}}
initial: {x: 5 mm, y: -76 mm, vx: 0.3 m/s}
"""
SEGMENTS = """
model: segments
segments: {pipe: 2, collar: 2}
operation: {wob: 100 kN, rotary_speed: 13 rad/s}
initial: {bit_speed: 9 rad/s}
"""
IDEAL = SEGMENTS + "drive: {kind: ideal}\n"


BOUNCING = "operation: {wob: 10 kN, rotary_speed: 4 rad/s}\n"
HITTING = f"{BOUNCING}initial: {{x: 70 mm, vy: -0.6 m/s}}\n"
STICKING = "operation: {wob: 66.72 kN, rotary_speed: 2 rad/s}\nbit: {friction: {smoothing: 20 s/rad}}\n"
MOTOR = """\
kind: dc_motor, table_inertia: 500 kg*m^2, motor_inertia: 0 kg*m^2, gear: 1, torque_constant: 4 V*s/rad,
  resistance: 0.02 ohm, inductance: 6 mH"""
PLACING = """\
kind: pi, inertia: 500 kg*m^2, stiffness: 300 N*m/rad, damping: 200 N*m*s/rad, twist_gain: -50 N*m/rad,
  speed_gain: 40 N*m*s/rad, shaft_damping: 30 N*m*s/rad"""
LAW = "operation: {{wob: 40 kN, rotary_speed: 1 rad/s}}\nbit: {{surface_amplitude: 0 mm, friction: {{law: {}}}}}\n"
# The study, seconds, its tolerance, that of the neighbours, the bound, and states that
# are to have their part in it.
#
# Steps land on rock and wall, but not where the cutters begin to bite: in half a second
# of a bouncing bit on segments a deviation misses by 1e-2 at 1e-8, the neighbouring runs
# themselves by 2e-3. At looser tolerances than 1e-10 the error of hits on the wall is
# amplified, to 1e-3 at 1e-8.
MOTIONS = {
    "stabilizers": (STABILIZERS, 2.0, 1e-8, 1e-11, 1e-3, ()),
    "along": (ALONG, 2.0, 1e-8, 1e-11, 1e-3, ()),
    "touch": (SEGMENTS, 0.1, 1e-8, 1e-11, 5e-4, ()),
    "segments": (SEGMENTS, 0.5, 1e-10, 1e-11, 1e-2, ()),
    "ideal": (IDEAL, 0.5, 1e-10, 1e-11, 1e-2, ()),
    "swirl": (f"{HITTING}mud: {{swirl: 0.5}}\n", 3.0, 1e-10, 1e-12, 5e-5, ()),
    "weight": (f"{HITTING}well: {{inclination: 0.7 rad}}\n", 3.0, 1e-10, 1e-12, 5e-5, ()),
    "both": (f"{HITTING}mud: {{swirl: 0.5}}\nwell: {{inclination: 0.7 rad}}\n", 3.0, 1e-10, 1e-12, 5e-5, ()),
    "linear law": (LAW.format("linear, smoothing: 20 s/rad"), 6.0, 1e-8, 1e-12, 1e-3, ()),
    "exponential law": (LAW.format("exponential, smoothing: 20 s/rad"), 6.0, 1e-8, 1e-12, 1e-3, ()),
    "rational law": (LAW.format("rational"), 6.0, 1e-8, 1e-12, 1e-3, ()),
    "placing": (f"{BOUNCING}drive: {{{PLACING}}}\n", 3.0, 1e-8, 1e-12, 2e-4, ("lag", "drive_speed")),
    "limited": (
        f"{STICKING}drive: {{kind: stiff, torque_limit: 2500 N*m}}\n", 10.0, 1e-8, 1e-12, 2e-4, ("lag", "drive_speed")
    ),
    "motor": (f"{STICKING}drive: {{{MOTOR}}}\n", 5.0, 1e-8, 1e-12, 2e-4, ("lag", "drive_speed", "motor_torque")),
    "regulated motor": (
        f"{STICKING}drive: {{{MOTOR}, gains: [0.01, 2.0, 0.5, -1.0, 0.7]}}\n",
        5.0, 1e-8, 1e-12, 2e-4, ("lag", "drive_speed", "motor_torque"),
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", MOTIONS)
def test_the_deviation_is_the_derivative_of_the_motion(name):
    """Through bounces, hits and stick-slip, with motors that reach both limits."""
    text, seconds, rtol, fine, within, parts = MOTIONS[name]
    study = parse_study(f"{text}simulation: {{transient: 0 s, observe: {seconds} s, rtol: {rtol}}}\n")
    work = work_of(prepare(study))
    followed, quotient = followed_and_quotient(work, fine)
    names = work.program.variant.states
    assert np.all(np.abs(quotient[[names.index(part) for part in parts]]) > 1e-3)
    assert np.linalg.norm(followed - quotient) < within * np.linalg.norm(quotient)


@pytest.mark.parametrize("cut", ["c2: -0.00019", "c2: 0.001", "speed: mean"])
@pytest.mark.parametrize("drive", ["dc_motor", "soft_torque"])
@pytest.mark.parametrize("implicit", [False, True])
def test_the_tangent_of_segments_is_the_derivative_of_their_slopes(cut, drive, implicit):
    """At random states, on the rock and off it, after the rock's side at the start of a
    step: slopes, pushes and moved velocities, against differences of fourth order."""
    study = parse_study(
        "model: segments\nsegments: {pipe: 2, collar: 3}\noperation: {wob: 100 kN}\n"
        f"bit: {{lobes: 3, cutting: {{{cut}}}}}\ndrive: {{kind: {drive}}}\n"
    )
    model, at, lanes, step = model_named("segments"), study.operation, 16, 1e-4
    variant = variant_at(model, study.parameters)
    variant = variant.implicit if implicit else variant
    speeds = tuple(np.full(lanes, v) for v in (at.depth, at.wob, at.rotary_speed))
    points = Values(study.parameters, study.initial, speeds)
    table, rng = model.pack(points, Thresholds()), np.random.default_rng(7)
    size = variant.state_scales(table).T
    state = model.starts(points, 0)[:, : len(variant.states)].T + rng.normal(size=size.shape) * size
    z = variant.states.index("z")
    state[z] += np.where(np.arange(lanes) % 2, 15.0, -15.0) * size[z]
    deviation = rng.normal(size=size.shape) * size
    phase, time = rng.uniform(0.0, 6.0, lanes), rng.uniform(0.0, 3.0, lanes)
    angle = state[variant.states.index("twist")] + at.rotary_speed * time + phase
    contact = study.parameters.bit.surface_amplitude * np.sin(3 * angle) - state[z]
    found, exact = tangent_and_difference(
        variant, table, state, deviation, contact, step=step, implicit=implicit, phase=phase, time=time
    )
    # Newton's method leaves 1e-10 of a load, and a difference in the last bits of slopes.
    bound = (1e-6 if implicit else 1e-9) * np.abs(exact).max(axis=1, keepdims=True)
    assert np.all(np.abs(found - exact) <= bound)


BRIEF = "sweep: {wob: [40 kN, 60 kN, 90 kN]}\nsimulation: {transient: 0.5 s, observe: 1 s}\n"
SPEEDS = "sweep: {rotary_speed: {from: 1 rad/s, to: 8 rad/s, points: 9}}\nsimulation: {transient: 5 s, observe: 10 s}\n"
SAME = {
    "stabilizers": f"{STABILIZERS}{BRIEF}",
    "segments": f"{SEGMENTS}{BRIEF}",
    "soft torque on segments": "model: segments\nsegments: {pipe: 2, collar: 2}\ninitial: {start: rest}\n"
    "drive: {kind: soft_torque, torque_limit: 4 kN*m}\nsimulation: {transient: 1 s, observe: 2 s}\n",
    "beam": "model: beam\nbeam: {modes: 3, stations: [{at: 0.1}, {at: 0.5}, {at: 0.9}]}\n"
    "sweep: {rotary_speed: [4 rad/s, 7 rad/s], procedure: up}\nsimulation: {transient: 2 s, observe: 4 s}\n",
    "all forces": f"{SPEEDS}mud: {{swirl: 0.4}}\nstabilizer: {{clearance: 10 mm}}\n"
    "well: {inclination: 0.5 rad, axial_friction: true}\n",
    "swirl, hertz": f"{SPEEDS}mud: {{swirl: 0.5}}\nwell: {{law: hertz}}\n",
    "weight": f"{SPEEDS}well: {{inclination: 1 rad}}\n",
    "impedance": f"{SPEEDS}drive: {{kind: z_torque}}\n",
    "motor": f"{SPEEDS}drive: {{kind: dc_motor}}\n",
    **{law: f"{SPEEDS}bit: {{friction: {{law: {law}}}}}\n" for law in list(LAWS)[1:]},
}


@pytest.mark.parametrize("name", SAME)
def test_neither_lanes_nor_workers_nor_the_exponent_change_a_bit(name, monkeypatch):
    plain, told = (nsdrill.run(SAME[name], set={"record.exponent": switch}) for switch in (False, True))
    monkeypatch.setenv("NSDRILL_LANES", "1")
    alone = nsdrill.run(SAME[name], workers=2)
    for variable in plain.data_vars:
        for other in (told, alone):
            assert plain[variable].values.tobytes() == other[variable].values.tobytes(), variable
    assert np.all(np.isfinite(told.lyapunov_exponent))
    assert from_dataset(told).variables["lyapunov_error"].shape[-1] > 0


def test_steady_rotation_of_segments_decays_as_its_slowest_eigenvalue():
    """On low lobes and without pulsation a string that begins a little slower swings
    about steady drilling and comes to rest; its deviations decay with the slowest
    eigenvalue of the string on flat rock, linear about steady drilling."""
    text = """
model: segments
segments: {pipe: 1, collar: 1, material_damping: {axial: 5 ms, torsional: 20 ms}, hydraulics: {pulsation: 0 L/s}}
bit: {surface_amplitude: 0.1 mm}
drive: {kind: ideal}
operation: {wob: 50 kN, rotary_speed: 30 rad/s}
initial: {bit_speed: 29 rad/s}
simulation: {transient: 5 s, observe: 60 s}
record: {exponent: true}
"""
    found = nsdrill.run(text)
    steady = text.replace("initial: {bit_speed: 29 rad/s}\n", "").replace("0.1 mm", "0 mm")
    work = replace(work_of(prepare(parse_study(steady))), record=Record())
    fixed = work.program.variant
    runs, rows = work.prepare(np.array([0])), fixed.rows()
    slopes = fixed.right_hand_side(8)
    n, names = work.state_count, fixed.states
    free = [i for i, name in enumerate(names) if name not in ("lag", "drive_speed", "current")]

    def rates(state):
        lanes = np.zeros((rows.total, 8))
        lanes[:n] = state[:, None]
        lanes[rows.parameter : rows.parameter + rows.parameters] = runs.parameters[0][:, None]
        slopes(lanes.reshape(-1))
        b = lanes[:, 0]
        made = np.empty(n)
        for order, count, first, slope in rows.blocks:
            for k in range(count):
                if order == 2:
                    made[first + 2 * k] = state[first + 2 * k + 1]
                    made[first + 2 * k + 1] = b[rows.acceleration + slope + k]
                else:
                    made[first + k] = b[rows.acceleration + slope + k]
        return made

    rest = runs.initial[0, :n]
    matrix = np.empty((len(free), len(free)))
    for j, i in enumerate(free):
        step = 1e-6 * runs.state_scales[0, i]
        up, down = rest.copy(), rest.copy()
        up[i], down[i] = rest[i] + step, rest[i] - step
        matrix[:, j] = (rates(up) - rates(down))[free] / (2 * step)
    slowest = np.linalg.eigvals(matrix).real.max()
    assert slowest < -0.01
    assert float(found.lyapunov_exponent) == pytest.approx(slowest, rel=0.05)


W, RELAX = 8, 1e-3

BEAM = "model: beam\nwell: {friction: {smoothing: EPS s/m}}\nbit: {friction: {smoothing: EPS s/rad}}"
NINE = ", ".join(f"{{at: {place / 10}}}" for place in range(1, 10))
STRINGS = "model: segments\nbit: {cutting: {smoothing: EPS s/rad, speed: live, c2: C2}}"
CASES = {
    "beam": BEAM,
    "beam, few modes": f"{BEAM}\nbeam: {{modes: 2, stations: [{{at: 0.3}}, {{at: 0.5}}, {{at: 0.6}}], torque: cy}}",
    "beam, nine stations": f"{BEAM}\nbeam: {{modes: 2, stations: [{NINE}]}}",
    "beam, one station": f"{BEAM}\nbeam: {{modes: 1, stations: [{{at: 0.5}}]}}",
    "cutting from rest": STRINGS.replace("C2", "0.001"),
    "cutting from a speed on": STRINGS.replace("C2", "-0.00019"),
}


MAIN = "operation: {depth: 2000 m, wob: 60 kN, rotary_speed: 5 rad/s}\n"
ROOM = "stabilizer: {clearance: 30 mm}\n"
HERTZ = "well: {law: hertz}\n"
AXIAL = "well: {axial_friction: true}\n"
OF_MAIN = {
    "main": MAIN,
    "hertz": f"{MAIN}{HERTZ}",
    "linear": f"{MAIN}bit: {{friction: {{law: linear}}}}\n",
    "exponential": f"{MAIN}bit: {{friction: {{law: exponential}}}}\n",
    "rational": f"{MAIN}bit: {{friction: {{law: rational}}}}\n",
    "swirl and weight": f"{MAIN}mud: {{swirl: 0.5}}\nwell: {{inclination: 0.5 rad}}\n",
    "soft torque": f"{MAIN}drive: {{kind: soft_torque}}\n",
    "motor": f"{MAIN}drive: {{kind: dc_motor}}\n",
    "limit": f"{MAIN}drive: {{kind: stiff, torque_limit: 60 kN*m}}\n",
    "held": f"{MAIN}{ROOM}",
    "held, hertz, rational": f"{MAIN}{ROOM}{HERTZ}bit: {{friction: {{law: rational}}}}\n",
    "along": f"{MAIN}{AXIAL}",
    "along, hertz, linear": f"{MAIN}well: {{axial_friction: true, law: hertz}}\nbit: {{friction: {{law: linear}}}}\n",
    "held along": f"{MAIN}{AXIAL}{ROOM}",
}
STEEP = "steep, main"
CASES[STEEP] = f"{MAIN}well: {{friction: {{smoothing: EPS s/m}}}}\nbit: {{friction: {{smoothing: EPS s/rad}}}}\n"
EVERY = [*((case, "500") for case in OF_MAIN), *((case, smoothing) for case in CASES for smoothing in ("500", "1e5"))]
WALL = "well: {friction: {smoothing: EPS s/m}"
MIXED = {
    **CASES,
    "stabilisers": f"stabilizer: {{clearance: 5 mm}}\n{WALL}}}",
    "friction along the hole": f"{WALL}, axial_friction: true}}",
}


def buffer_of(text: str, implicit: bool, seed: int, relax: float = 0.0) -> Any:
    """(buffer, rows, variant) of random states, about a half of the contacts closed."""
    study = parse_study(text)
    model, rng, at = model_named(study.model.name), np.random.default_rng(seed), study.operation
    variant = variant_at(model, study.parameters)
    variant = variant.implicit if implicit else variant
    rows = variant.rows()
    points = Values(study.parameters, study.initial, tuple(np.full(W, v) for v in (at.depth, at.wob, at.rotary_speed)))
    table = model.pack(points, Thresholds())
    b = np.zeros((rows.total, W))
    b[rows.parameter : rows.parameter + rows.parameters] = table.T
    size = variant.state_scales(table)
    start = model.starts(points, 0)[:, : rows.own]
    b[rows.stage : rows.stage + rows.own] = (start + rng.normal(size=(W, rows.own)) * size).T
    if study.model.name != "segments":
        b[rows.stage] += rng.choice([0.0, 0.09], W)
    else:
        z = variant.states.index("z")
        b[rows.stage + z] -= 15.0 * size[:, z]
    b[rows.phase], b[rows.stage_time] = 1.0, 0.3
    if implicit:
        b[rows.relax] = relax
    return b, rows, variant.right_hand_side(W)


def slopes_of(b: np.ndarray, rows: Any) -> np.ndarray:
    return b[rows.acceleration : rows.acceleration + rows.slopes]


@pytest.mark.parametrize(("case", "smoothing"), EVERY)
def test_slopes_are_the_same_to_rounding_where_nothing_is_relaxed(case, smoothing):
    found, text = [], {**OF_MAIN, **CASES}[case].replace("EPS", smoothing)
    for implicit in (False, True):
        b, rows, function = buffer_of(text, implicit, 3)
        function(b.ravel())
        found.append(slopes_of(b, rows).copy())
    within = 1e-12 if case in OF_MAIN else 1e-11
    assert found[1] == pytest.approx(found[0], rel=within, abs=1e-12 * np.abs(found[0]).max())


@pytest.mark.parametrize(("case", "smoothing"), EVERY)
def test_the_velocities_of_a_stage_agree_with_its_loads(case, smoothing):
    """They have moved by ``relax`` times the push, and at these velocities the ordinary
    slopes are those found, but for what Newton's method leaves of the greatest push."""
    text = {**OF_MAIN, **CASES}[case].replace("EPS", smoothing)
    # The load of a bit that creeps falls with its speed, which bounds the length of a
    # stage (``falling``).
    relax = 0.1 * RELAX if case == "cutting from a speed on" else 2.0 * RELAX if case in OF_MAIN else RELAX
    within = 1e-13 if case in OF_MAIN else 1e-12
    b, rows, function = buffer_of(text, True, 5, relax)
    free = b.copy()
    function(b.ravel())
    pushed = [2 * slope + 1 for slope in rows.pushed]
    pushes = b[rows.push : rows.push + len(pushed)]
    for push, state in zip(pushes, pushed, strict=True):
        assert b[rows.stage + state] == pytest.approx(free[rows.stage + state] + relax * push, rel=within, abs=1e-13)
    plain, ordinary, function = buffer_of(text, False, 5)
    plain[ordinary.stage : ordinary.stage + rows.own] = b[rows.stage : rows.stage + rows.own]
    function(plain.ravel())
    assert np.abs(pushes).max() > 0.0
    # The slip is as exact as the velocities; steepness amplifies what rounding leaves
    # of it.
    noise = 1e-15 * float(smoothing) * 10
    assert slopes_of(b, rows) == pytest.approx(slopes_of(plain, ordinary), abs=(3e-5 + noise) * np.abs(pushes).max())


@pytest.mark.parametrize("case", MIXED)
def test_the_bits_of_a_lane_do_not_depend_on_its_neighbours(case):
    """Lanes with and without contact, and each of them among copies of itself. Where
    the bit is about to stick, the number of iterations would differ."""
    for seed in range(20):
        b, rows, function = buffer_of(MIXED[case].replace("EPS", "1e4"), True, seed, 100 * RELAX)
        b[rows.stage + rows.own - 1] *= 0.1  # the bit speed, but of a string of segments
        start = b.copy()
        function(b.ravel())
        places = [
            *range(rows.stage, rows.stage + rows.own),
            *range(rows.acceleration, rows.acceleration + rows.slopes),
            *range(rows.push, rows.push + len(rows.pushed)),
        ]
        for lane in range(W):
            alone = np.repeat(start[:, [lane]], W, axis=1)
            function(alone.ravel())
            np.testing.assert_array_equal(b[places, lane], alone[places, lane])


@pytest.mark.parametrize("implicit", [False, True])
@pytest.mark.parametrize("case", ["beam", "beam, few modes", "beam, one station"])
def test_the_deviation_is_the_derivative(case, implicit):
    """Of an elastic collar: moved velocities, slopes and pushes of the deviation, against
    a difference of eighth order. That of a stage is as exact as its loads, in the worst
    of lanes; of explicit slopes to 1e-10."""
    text, step = CASES[case].replace("EPS", "500"), 2.0**-12
    study = parse_study(text)
    model = model_named("beam")
    variant = variant_at(model, study.parameters)
    variant = variant.implicit if implicit else variant
    plain, ordinary, function = buffer_of(text, implicit, 7, RELAX)
    rows = variant.rows(tangent=True)
    b, own, slopes = np.zeros((rows.total, W)), rows.own, rows.own_slopes
    inputs = [("stage", own), ("phase", 1), ("stage_time", 1), ("parameter", rows.parameters)]
    for name, count in [*inputs, ("relax", 1)] if implicit else inputs:
        to, source = getattr(rows, name), getattr(ordinary, name)
        b[to : to + count] = plain[source : source + count]
    deviation = (
        np.random.default_rng(3).normal(size=(own, W))
        * variant.state_scales(b[rows.parameter :][: rows.parameters].T).T
    )
    b[rows.stage + own : rows.stage + 2 * own] = deviation
    exact = np.zeros_like(plain)
    for distance, weight in enumerate((4 / 5, -1 / 5, 4 / 105, -1 / 280), start=1):
        for sign in (1.0, -1.0):
            other = plain.copy()
            other[ordinary.stage : ordinary.stage + own] += sign * distance * step * deviation
            function(other.ravel())
            exact += sign * weight / step * other
    pushes = len(ordinary.pushed)
    variant.tangent(W, 0)(b.ravel())
    tolerance = 1e-4 if implicit else 1e-10
    for mine, theirs in (
        (b[rows.stage + own : rows.stage + 2 * own], exact[ordinary.stage : ordinary.stage + own]),
        (b[rows.acceleration + slopes :][:slopes], exact[ordinary.acceleration : ordinary.acceleration + slopes]),
        (b[rows.push + pushes :][:pushes], exact[ordinary.push : ordinary.push + pushes]),
    ):
        for one, two in zip(mine, theirs, strict=True):
            assert one == pytest.approx(two, rel=tolerance, abs=tolerance * np.abs(two).max())
