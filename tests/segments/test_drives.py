"""Drives by torque at the top of the string of segments: the law of the main model on a
string with many modes."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import nsdrill
from nsdrill.app.check import check
from nsdrill.errors import InputError
from nsdrill.kernel.settings import Simulation
from nsdrill.models.drive_laws import LAWS, growing
from nsdrill.models.operation import Operation
from nsdrill.models.segments.checks import drilling_at
from nsdrill.models.segments.parameters import Initial
from nsdrill.models.segments.string import string_of
from nsdrill.models.variant import variant_at
from nsdrill.study.load import parse_study
from segments.lanes import DEPTH, MODEL, QUIET, SPEED, WOB, Slopes, run, string
from segments.plain import Driven, Plain, ours, plain_of

KINDS = tuple(LAWS)
FEW = {"segments__pipe": 2, "segments__collar": 2}


CASES = [
    *((kind, {}, {}) for kind in KINDS),
    ("soft_torque", {"drive__matching": 1.5, "drive__compensated_inertia": 800.0}, {"b": 1.5, "taken": 800.0}),
    ("pi", {"drive__twist_gain": -300.0, "drive__speed_gain": 60.0}, {"G_t": -300.0, "G_w": 60.0}),
]


@pytest.mark.parametrize(("kind", "keys", "numbers"), CASES)
def test_the_lanes_have_the_rates_of_the_law(kind, keys, numbers):
    """At random states, before and after the drive is switched on, with a limit and
    without. The gains from LAPACK are rounded to nine digits."""
    limits = (None, 3000.0) if kind != "z_torque" and "taken" not in numbers else (None,)
    for limit in limits:
        parameters = string(**FEW, drive__kind=kind, drive__torque_limit=limit, drive__on_at=2.0, **keys)
        slopes = Slopes(parameters)
        plain = Driven(pipes=2, collars=2, kind=kind, numbers=numbers, limit=limit or math.inf, on_at=2.0)
        n, generator = plain.n, np.random.default_rng(2)
        state_scales = np.repeat([1e-3, 0.05, 2.0, 3.0, 0.0], [n + 1] * 4 + [1])
        clipped = 0
        for t in (1.9, 2.3):
            states = state_scales * generator.normal(size=(8, 4 * n + 5))
            states[:, 3 * n + 3 : 4 * n + 4] += plain.speed
            found = slopes(t, np.array([ours(state, n) for state in states]))
            for state, mine in zip(states, found, strict=True):
                rates = plain.rates(t, state)
                exact = np.concatenate([rates[n + 1 : 2 * n + 2], rates[3 * n + 3 : 4 * n + 4], rates[-1:]])
                u, v, th, w, _ = plain.parts(state)
                moved = np.max(plain.k) * np.ptp(u) + plain.k_c * abs(u).max() * (
                    1 + plain.c_c / plain.wob * abs(v).max()
                )
                asked = np.abs(plain.law[1:]) @ np.abs([th[0], w[0] - 13, th[-1] - th[0], w[-1] - 13])
                turned = np.max(plain.kt) * np.ptp(th) + plain.k_c * abs(u).max() + asked
                bound = np.concatenate([moved / plain.m, turned / plain.J, [1.0]])
                assert np.max(np.abs(mine - exact) / bound) < 2e-9
                clipped += limit is not None and plain.torque(state) in (0.0, limit)
        assert clipped > 0 or limit is None


@pytest.mark.parametrize(
    ("kind", "method", "within"), [("soft_torque", "explicit", 1e-7), ("equal_damping", "implicit", 1e-6)]
)
def test_a_run_ends_where_scipy_does(kind, method, within):
    """0.4 s from a bit that turns too slowly, beside DOP853 on the plain equations.
    With a tolerance of 1e-12 the error of SciPy is 1e-9 of the natural scales, that of
    the explicit pair 7e-9, of the implicit one 2.4e-7."""
    parameters = string(**FEW, drive__kind=kind)
    done = run(parameters, Simulation(0.0, 0.4, rtol=1e-12, method=method), Initial(bit_speed=6.0))
    plain = Driven(pipes=2, collars=2, kind=kind)
    n = plain.n
    start = plain_of(done["initial_state"][0, :-1], n)
    absolute = 1e-12 * np.repeat([1e-4, 1e-2, 0.1, 1.0, 1.0], [n + 1] * 4 + [1])
    end = solve_ivp(plain.rates, (0.0, 0.4), start, method="DOP853", rtol=1e-12, atol=absolute).y[:, -1]
    size = plain_of(variant_at(MODEL, parameters).state_scales(Slopes(parameters).table[None])[0], n)
    assert np.max(np.abs(plain_of(done["final_state"][0, :-1], n) - end) / (size + np.abs(end))) < within
    assert abs(end[2 * (n + 1)] - start[2 * (n + 1)]) > 1e-3  # the top has moved


@pytest.mark.parametrize("kind", ["ideal", "soft_torque"])
def test_energy(kind):
    """The energy of springs and inertias changes with the power of drive, rock, mud and
    dampers, at random states: of the ideal drive that of the torque that keeps the top
    at the set speed."""
    parameters = string(**FEW, drive__kind=kind)
    slopes = Slopes(parameters)
    plain = Driven(pipes=2, collars=2, kind=kind) if kind != "ideal" else Plain(pipes=2, collars=2)
    n, generator = plain.n, np.random.default_rng(3)
    state_scales = np.repeat([1e-3, 0.05, 2.0, 3.0, 0.0], [n + 1] * 4 + [1])
    for _ in range(6):
        state = state_scales * generator.normal(size=4 * n + 5)
        state[3 * n + 3 : 4 * n + 4] += plain.speed
        u, v, th, w, _ = plain.parts(state)
        if kind == "ideal":
            w[0] = plain.speed
        made = slopes(0.7, ours(state, n))[0]
        acceleration, turn = made[: n + 1], made[n + 1 : 2 * n + 2]
        change = plain.m * v @ acceleration + plain.J[1:] * w[1:] @ turn[1:] + plain.wob * v[-1]
        change += (
            plain.k @ (np.diff(u) * np.diff(v)) + plain.kt @ (np.diff(th) * np.diff(w)) + plain.k_top * u[0] * v[0]
        )
        given = plain.power(0.7, state)
        if isinstance(plain, Driven):
            change += plain.J[0] * w[0] * turn[0]
            given += plain.torque(state) * w[0]
        else:  # drag of the top and torque of the first segment
            wound = plain.kt[0] * (th[0] - th[1] + plain.beta_t * (w[0] - w[1])) + plain.cw[0] * w[0]
            given += wound * w[0]
        scale = np.abs(plain.kt * np.diff(th) * np.diff(w)).sum() + np.abs(plain.k * np.diff(u) * np.diff(v)).sum()
        assert change == pytest.approx(given, abs=1e-8 * scale + 1e-8 * abs(given))


@pytest.mark.parametrize("kind", ["ideal", *KINDS, "dc_motor", "lqr"])
def test_linear_theory_is_the_derivative_of_the_lanes(kind):
    """The eigenvalues of the compiled right-hand side about steady drilling, with the
    fall of the bit's torque, beside those of the matrix that `check` has."""
    parameters = string(**QUIET, drive__kind=kind)
    slopes = Slopes(parameters)
    steady = slopes.steady()
    assert np.abs(slopes(0.0, steady)).max() < 1e-9
    compiled = slopes.torsional(slopes.jacobian(steady, 1e-4))
    one = drilling_at(parameters, Operation(DEPTH, WOB, SPEED))
    matrix, column = one.string.linear(one.at)
    matrix[:, one.string.bit] -= one.string.fall(SPEED) * column
    several = [np.linalg.eigvals(one) for one in (compiled, matrix)]
    found, exact = (np.sort_complex(roots[np.abs(roots) > 1e-4]) for roots in several)
    np.testing.assert_allclose(found, exact, rtol=2e-5, atol=2e-5)


def test_equal_damping_has_two_equal_modes_on_a_lumped_string():
    """J_d J s^4 + ... = J J_d (s^2 + 2 z w s + w^2)^2 with z = sqrt(J/J_d)/2 of one
    spring and one inertia, which the first mode of a string with a heavy bit is, to
    some percent: without damping of material and mud."""
    parameters = string(
        segments__pipe=2,
        segments__collar=1,
        drive__kind="equal_damping",
        mud__viscosity=0.0,
        bit__mass=400_000.0,
        segments__material_damping__torsional=0.0,
    )
    made = string_of(parameters, DEPTH)
    w = math.sqrt(made.torsional / (400_000.0 * 0.1**2 / 2))  # the bit's inertia alone
    roots = np.linalg.eigvals(drilling_at(parameters, Operation(DEPTH, WOB, SPEED)).matrix)
    slow = roots[np.argsort(abs(roots))][:4]
    z = math.sqrt(400_000.0 * 0.1**2 / 2 / (2900.0 + made.kelly_inertia)) / 2
    assert np.mean(abs(slow)) == pytest.approx(w, rel=0.08)
    assert np.mean(-slow.real / abs(slow)) == pytest.approx(z, rel=0.08)


@pytest.mark.parametrize("kind", ["ideal", "soft_torque", "z_torque"])
def test_stick_slip_begins_where_the_linear_loop_says(kind):
    """Without lobes and pulsation a bit that is 0.01 rad/s slow comes back to steady
    drilling above the onset of `check`, and swings more and more below it: 15 percent
    on either side, a minute. Soft torque moves the onset from 32.8 to 14.3 rad/s, which
    is what it is for."""
    study = f"model: segments\ndrive: {{kind: {kind}}}\nsegments: {{pipe: 2, collar: 2}}\n"
    onset = check(parse_study(study)).figures["stick_slip_onset"].value
    assert onset is not None
    growth = []
    for speed in (0.85 * onset, 1.15 * onset):
        swings = []
        for transient in (5.0, 65.0):
            done = run(
                string(**FEW, **QUIET, drive__kind=kind),
                Simulation(transient, 10.0, rtol=1e-8),
                Initial(bit_speed=speed - 0.01),
                rotary_speed=speed,
            )
            swings.append(float(done["bit_speed_max"][0] - done["bit_speed_min"][0]))
        growth.append(swings[1] / swings[0])
    assert growth[0] > 1.05
    assert growth[1] < 0.95


def test_torque_drives_hold_more_than_an_ideal_one():
    """The order is that of the main model's drives (docs/drives.md)."""
    held = [
        drilling_at(parameters, Operation(DEPTH, WOB, SPEED)).withstood
        for kind in ("ideal", "stiff", "soft_torque", "z_torque")
        for parameters in [string(drive__kind=kind)]
    ]
    assert held == sorted(held)
    assert held[2] > 4 * held[0]


def test_gains_that_swing_the_string_are_told():
    """The loop of a drive that pushes with the bit's speed; and no word of one that
    does not."""
    bad = "drive: {kind: pi, damping: 10 N*m*s/rad, stiffness: 3000 N*m/rad, speed_gain: 500 N*m*s/rad}"
    text = "model: segments\nsegments: {{pipe: 2, collar: 2}}\n{}\nsimulation: {{observe: 100 s}}\n"
    warnings = " ".join(check(parse_study(text.format(bad))).warnings)
    assert "Unstable" in warnings
    parameters = parse_study(text.format(bad)).parameters
    root = growing(drilling_at(parameters, Operation(DEPTH, WOB, SPEED)).matrix)
    assert root is not None
    assert f"{root.real:.4g}" in warnings
    assert "Unstable" not in " ".join(check(parse_study(text.format("drive: {kind: pi}"))).warnings)
    limited = "drive: {kind: stiff, torque_limit: 1 kN*m}"
    report = check(parse_study(text.format(limited)))
    assert "Overloaded" in " ".join(report.warnings)
    assert report.figures["torque_reserve"].value == pytest.approx(1000.0 - report.figures["mean_torque"].value)


SWEEP = """\
model: segments
segments: {pipe: 2, collar: 2}
initial: {start: rest}
drive: {kind: soft_torque, torque_limit: 4 kN*m}
sweep: {rotary_speed: [13 rad/s, 14 rad/s, 15 rad/s], procedure: up}
simulation: {transient: 6 s, observe: 6 s}
record: {peaks: 4, poincare: 8}
"""


def test_a_carried_sweep_replays_to_the_bit_and_measures_what_a_trace_shows(tmp_path):
    """The lag goes from point to point; the drive is at its limits."""
    path = tmp_path / "driven.h5"
    nsdrill.run(SWEEP, path, progress=False)
    data = nsdrill.open_results(path)
    states = {name: data[f"{name}_state"].sel(state="lag").to_numpy().ravel() for name in ("initial", "final")}
    np.testing.assert_array_equal(states["initial"][1:], states["final"][:-1])
    trace = nsdrill.replay(path, rotary_speed="14 rad/s", sample="1 ms")
    here = data.sel(rotary_speed=14.0)
    np.testing.assert_array_equal(trace.attrs["final_state"], here["final_state"].to_numpy().ravel())
    assert "current_max" not in data
    plain = Driven(pipes=2, collars=2, kind="soft_torque", speed=14.0, limit=4000.0)
    seen = {name: trace[name].to_numpy()[6000:] for name in ("lag", "drive_speed", "bit_speed", "twist")}
    asked = -(plain.law[1] * seen["lag"] + plain.law[2] * (seen["drive_speed"] - 14.0))
    torque = np.clip(asked, 0.0, 4000.0)
    for end, value in (("min", torque.min()), ("max", torque.max())):
        assert float(here[f"drive_torque_{end}"].item()) == pytest.approx(value, abs=2e-3 * np.ptp(torque))
    assert float(here["drive_speed_max"].item()) == pytest.approx(seen["drive_speed"].max(), abs=1e-4)
    assert float(here["drive_speed_mean"].item()) == pytest.approx(np.trapezoid(seen["drive_speed"], dx=1e-3) / 6.0)


def test_ensembles_and_unknowns_run():
    """Starts differ; samples are of the drive's own numbers."""
    head = SWEEP.partition("sweep:")[0] + "simulation: {transient: 1 s, observe: 2 s}\n"
    several = nsdrill.run(head, set={"initial.ensemble": 4}, progress=False)["bit_speed_max"].to_numpy()
    assert len(np.unique(several)) == 4
    unknown = f"{head}uncertain: {{drive.matching: {{uniform: [1, 6]}}, samples: 4}}\n"
    assert len(np.unique(nsdrill.run(unknown, progress=False)["drive_speed_max"].to_numpy())) == 4


def test_charts_of_the_model():
    """A card of all drives, with that of a wave that a matched one swallows; other
    charts are of other models."""
    from nsdrill.app.picture_making import chart_of

    card = chart_of(parse_study("model: segments\ndrive: {kind: soft_torque, matching: 1}\n"), "drive-card")
    assert {*card.held} == {"ideal", "dc_motor", "lqr", *LAWS} - {"pi"}  # whose gains are the study's own
    assert card.reflected["soft_torque"].min() < 0.1
    with pytest.raises(InputError, match="drive-card"):
        chart_of(parse_study("model: segments\n"), "drive-tuning")
