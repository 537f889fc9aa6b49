"""Branches of the drill string against closed forms, differences, Liouville, Lyapunov
and the brute-force sweep."""

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, minimize_scalar

import nsdrill
from nsdrill.analysis.bifurcations import BRANCH, DOUBLING, FOLD, HOPF, SUBCRITICAL
from nsdrill.app.following.continuing import grazes_of
from nsdrill.app.following.seeding import continuation_setup
from nsdrill.models.christoforou_yigit.coefficients import derive
from nsdrill.orbit import explore
from nsdrill.orbit.explore import Explorer
from nsdrill.orbit.flow import Flow, Legs, advance
from nsdrill.orbit.newton import corrected_at_parameter
from nsdrill.orbit.normal_form import normal_forms
from nsdrill.orbit.periodic import Periodic
from nsdrill.orbit.seeds import Orders, Seed
from nsdrill.orbit.shooting import rotated

AT = {"operation": {"depth": "5000 m", "wob": "22.24 kN"}}
SMOOTH = {**AT, "bit": {"surface_amplitude": "0 mm"}}


UNITS = {"x": "m", "y": "m", "z": "m", "vx": "m/s", "vy": "m/s", "vz": "m/s", "twist": "rad", "bit_speed": "rad/s"}


def initial_of(one):
    """The section initial of a study that starts from the state of a point."""
    states = zip(one["state_name"].values, one["state"].values, strict=True)
    return {str(name): f"{float(value)!r} {UNITS[str(name)]}" for name, value in states}


def multipliers_of(data):
    """The multipliers of a point, or of all points."""
    return data["multiplier_real"].values + 1j * data["multiplier_imag"].values


def numbers_at(data, label):
    return np.sort(data["rotary_speed"].values[data["label"].values == label])


def continued(base, begin, end, seeds, transient, *, observe=None, points, **more):
    """The study of branches along the set speed [rad/s], and its branches."""
    keys = {"seeds": {"rotary_speed": [f"{seed} rad/s" for seed in seeds]}, "points": points, **more}
    span = {"along": "rotary_speed", "from": f"{begin} rad/s", "to": f"{end} rad/s"}
    simulation = {"transient": f"{transient} s", "observe": f"{observe or transient} s"}
    study = nsdrill.load_study({**base, "simulation": simulation, "continue": {**span, **keys}})
    return study, nsdrill.continue_branches(study)


def run_from(one, base, transient, observe, speed=None, **more):
    """The results of a run from a point of a branch, at its set speed or at ``speed``."""
    speed = float(one["rotary_speed"]) if speed is None else speed
    frozen = base.get("modes", {}).get("lateral") == "frozen"
    names = ("z", "twist", "bit_speed") if frozen else tuple(UNITS)
    study = {
        **base,
        "initial": {name: value for name, value in initial_of(one).items() if name in names},
        "simulation": {"transient": f"{transient} s", "observe": f"{observe} s", "rtol": 1e-9},
        "sweep": {"rotary_speed": f"{float(speed)!r} rad/s"},
    }
    return nsdrill.run({**study, **more}, progress=False)


def friction(law, omega):
    """The law of friction at a speed, without its coefficient at rest taken out."""
    return (
        2
        / math.pi
        * math.atan(law.smoothing * omega)
        * ((law.static - law.dynamic) / (1 + law.decay * omega) + law.dynamic)
    )


def bit_torque(study, omega, force, set_speed=None):
    """Of the bit at a speed; the cutting arm goes with the depth of cut of the set
    speed, which the bit's own speed does not change."""
    arm = derive(study.parameters, 5000.0, 22240.0, set_speed or omega).cutting_arm
    bit = study.parameters.bit
    cutting = arm * 2 / math.pi * math.atan(bit.friction.smoothing * omega)
    return force * (2 / 3 * study.parameters.well.diameter / 2 * friction(bit.friction, omega) + cutting)


def force_of(study, k):
    """Of the bit in steady drilling [N]."""
    stiffness = study.parameters.bit.rock_stiffness
    return 22240.0 * stiffness / (stiffness + k.k_a)


def damping_of(study, omega):
    """Of the twist about steady drilling: its own, and the slope of the bit's torque."""
    force, h = force_of(study, derive(study.parameters, 5000.0, 22240.0, omega)), 1e-5
    rise = bit_torque(study, omega + h, force, omega) - bit_torque(study, omega - h, force, omega)
    return study.parameters.drillstring.torsional_damping + rise / (2 * h)


FROZEN = {**SMOOTH, "modes": {"lateral": "frozen"}}


def test_hopf_of_steady_drilling_and_the_fold_of_stick_slip():
    """Without lobes and lateral motion steady drilling is lost where c_t + F dT/domega
    vanishes; the cycles that spring there are unstable up to a fold: between the two
    speeds steady drilling and stick-slip coexist."""
    study, data = continued(FROZEN, 1.8, 5, [3.5], 10, points=500)

    def damping(omega):
        return damping_of(study, omega)

    assert numbers_at(data, HOPF) == pytest.approx([brentq(damping, 1.5, 3.0)], abs=1e-6)
    (fold,) = numbers_at(data, FOLD)
    row_sizes = data["row_size"].values
    assert list(data["motion"].values) == ["equilibrium", "limit_cycle"]
    assert "Hopf" in str(data["end_reason"].values[1])
    cycles = data.isel(point=slice(row_sizes[0], None))
    at_fold = int(np.argmax(cycles["label"].values == FOLD))
    # The side of the fold that shrinks to the Hopf point is unstable, the other is
    # stick-slip.
    swing = cycles["bit_speed_max"].values - cycles["rotary_speed"].values
    sides = [slice(1, at_fold), slice(at_fold + 1, -1)]
    small, large = sorted(sides, key=lambda side: float(np.min(swing[side])))
    assert set(cycles["unstable"].values[small]) == {1}
    assert set(cycles["unstable"].values[large]) == {0}
    # A run from a point of the stable side goes on as it is there; beyond the fold it
    # ends in steady drilling.
    side = cycles.isel(point=large)
    one = side.isel(point=int(np.argmin(np.abs(side["rotary_speed"].values - (fold - 0.05)))))
    for speed, sticks in ((float(one["rotary_speed"]), True), (fold + 0.1, False)):
        run = run_from(one, FROZEN, 600, 100, speed)
        fastest = float(run["bit_speed_max"].squeeze())
        if sticks:
            assert fastest == pytest.approx(float(one["bit_speed_max"]), rel=1e-4)
        else:
            assert fastest < speed + 0.1


def test_fold_of_backward_rolling():
    """Without lobes and eccentricity backward rolling is a balance of forces: it folds
    at the least speed at which the friction of some slip can carry the drag."""
    base = {
        **SMOOTH,
        "drillstring": {"eccentricity": "0 mm"},
        "initial": {"x": "76.63 mm", "vy": "-0.686 m/s", "twist": "-5.8 rad"},
    }
    study, data = continued(base, 4.3, 6.5, [6], 20, points=120)
    (fold,) = numbers_at(data, FOLD)
    parameters = study.parameters

    def speed_of(slip):
        """The set speed at which the collar rolls with this slip [m/s]."""

        def excess(omega):
            k = derive(parameters, 5000.0, 22240.0, omega)
            force = force_of(study, k)
            torque = bit_torque(study, omega, force)
            span = parameters.drillstring.collar.span
            k_r = k.k_bend - force * math.pi**2 / (2 * span) - torque * math.pi**3 / (2 * span**2)
            law = parameters.well.friction

            def radial(r):
                whirl = (slip - omega * k.collar_radius) / r
                return k.m_l * whirl**2 * r - k_r * r - parameters.well.stiffness * (r - k.gap)

            r = brentq(radial, k.gap, k.gap + 0.01) if radial(k.gap) > 0.0 else k.gap
            whirl = (slip - omega * k.collar_radius) / r
            normal = parameters.well.stiffness * (r - k.gap)
            # Friction at the wall against the slip, drag against the whirl.
            return normal * friction(law, slip) - k.c_h * (whirl * r) ** 2

        return brentq(excess, 3.9, 6.5)

    least = minimize_scalar(speed_of, bounds=(1e-3, 0.2), method="bounded", options={"xatol": 1e-10})
    assert fold == pytest.approx(least.fun, abs=1e-6)
    assert fold == pytest.approx(4.65372612, abs=1e-7)
    at = int(np.argmax(data["label"].values == FOLD))
    assert float(data["whirl_ratio"].values[at]) == pytest.approx(-1.48073, abs=1e-5)


@pytest.fixture(scope="module")
def bounce():
    """Bounces over one lobe of the main study, and their setting."""
    # whether a seed settles on this motion or on another depends on its last bits
    return continued(AT, 3.3, 4.6, [3.5, 3.6, 3.7], 400, observe=100, lobes=1, points=80)


def orbit_at(data, number):
    place = int(np.argmin(np.abs(data["rotary_speed"].values - number)))
    return data.isel(point=place)


def test_multipliers_across_contacts(bounce):
    """The bit leaves the rock in every period. The monodromy is that of central
    differences; smaller tolerances change it by 1e-8; the product of the multipliers is
    the integral of the divergence (Liouville); of three periods they are the third
    powers."""
    study, data = bounce
    setup = continuation_setup(study)
    one = orbit_at(data, 3.6)
    assert float(one["touches"].sel(contact=data["contact"] == "rock").values.item()) == 1.0
    assert float(one["lift_off_fraction"]) > 0.0
    number, state = float(one["rotary_speed"]), one["state"].values
    fold = 2 * math.pi / 3
    values = np.array([[number]])

    def flow(rtol):
        base = setup.flow(("rotary_speed",), (0.2,), 1)
        return Flow(base.equations, rtol=rtol)

    def monodromy(rtol, periods=1):
        legs = Legs(state[None], 0.0, periods * fold / number, values, True)
        ends = flow(rtol).run(legs)
        return rotated(setup.symmetry, ends.monodromy[0].T, -periods * fold).T

    state_scales = flow(1e-11).state_scales(values)[0]
    scaled = [monodromy(rtol) * state_scales / state_scales[:, None] for rtol in (1e-11, 1e-12, 1e-13)]
    assert np.max(np.abs(scaled[0] - scaled[2])) < 1e-7
    own = np.sort_complex(np.linalg.eigvals(scaled[0]))
    stored = multipliers_of(data)
    place = int(np.argmin(np.abs(data["rotary_speed"].values - number)))
    fine, finer = (np.sort_complex(np.linalg.eigvals(one)) for one in scaled[1:])
    assert np.max(np.abs(own - finer)) < 2e-8
    assert np.max(np.abs(fine - finer)) < 1e-8
    # Those of the file, at the default tolerance, against the finest; and all along the
    # branch.
    assert np.max(np.abs(np.sort_complex(stored[place]) - finer)) < 1e-9
    states, speeds = data["state"].values, data["rotary_speed"].values
    legs = Legs(states, 0.0, fold / speeds, speeds[:, None], True)
    worst = []
    for matrix, there in zip(flow(1e-14).run(legs).monodromy, stored, strict=True):
        finest = np.linalg.eigvals(rotated(setup.symmetry, matrix.T, -fold).T * state_scales / state_scales[:, None])
        worst.append(max(np.min(np.abs(finest - one)) for one in there))
    assert max(worst) < 1e-8
    cubes = np.linalg.eigvals(monodromy(1e-11, 3))
    assert np.sort_complex(cubes) == pytest.approx(np.sort_complex(own**3), abs=1e-5)

    differences = np.zeros((8, 8))
    for j in range(8):
        h = 1e-3 * state_scales[j]
        sides = state + np.array([[h], [-h]]) * np.eye(8)[j]
        legs = Legs(sides, 0.0, fold / number, values)
        ends = rotated(setup.symmetry, flow(1e-13).run(legs).state, -fold)
        differences[:, j] = (ends[0] - ends[1]) / (2 * h)
    assert np.max(np.abs(differences * state_scales / state_scales[:, None] - scaled[0])) < 1e-4


def test_divergence():
    """Liouville, of steady drilling on a smooth rock: the sum of the exponents is the
    divergence, in closed form."""
    study, data = continued(FROZEN, 4, 5, [4.5], 10, switch=False, points=20)
    for point in range(data.sizes["point"]):
        one = data.isel(point=point)
        omega = float(one["rotary_speed"])
        k = derive(study.parameters, 5000.0, 22240.0, omega)
        divergence = -study.parameters.drillstring.axial_damping / k.m_a - damping_of(study, omega) / k.J
        multipliers = multipliers_of(one)
        found = np.log(np.abs(np.prod(multipliers[np.isfinite(multipliers)]))) / float(one["period"])
        assert found == pytest.approx(divergence, abs=1e-8)


def test_exponent_of_a_settled_bounce(bounce):
    """The largest Floquet exponent is the Lyapunov exponent of the same motion, within
    its error."""
    _, data = bounce
    one = orbit_at(data, 3.8)
    largest = max(np.abs(multipliers_of(one)))
    assert int(one["unstable"]) == 0
    run = run_from(one, AT, 200, 400, record={"exponent": True})
    found, error = float(run["lyapunov_exponent"].squeeze()), float(run["lyapunov_error"].squeeze())
    assert found == pytest.approx(math.log(largest) / float(one["period"]), abs=max(3 * error, 2e-3))


def test_branches_against_the_sweep(bounce):
    """Where the sweep settles on a motion over one lobe, its peaks are those of the
    branch; the torus bifurcations of the branch bound the interval in which the sweep
    finds something else."""
    _, data = bounce
    for number in (3.4, 4.5):
        one = orbit_at(data, number)
        run = run_from(one, AT, 100, 50)
        for name in ("axial_max", "bit_speed_max", "radius_max", "bit_force_max"):
            assert float(run[name].squeeze()) == pytest.approx(float(one[name]), rel=1e-3)
    torus = numbers_at(data, 8)
    assert torus[-2:] == pytest.approx([4.30586, 4.42646], abs=1e-4)
    assert not np.any(data["label"].values == DOUBLING)


def test_torus_bifurcation_against_the_sweep(bounce):
    """A sweep that carries the bounce along finds that it no longer repeats from within
    one step of the torus bifurcation on."""
    _, data = bounce
    torus = numbers_at(data, 8)[-2]
    one = orbit_at(data, 4.2)
    step, points = 0.02, 7
    run = nsdrill.run(
        {
            **AT,
            "initial": initial_of(one),
            "simulation": {"transient": "400 s", "observe": "30 s"},
            "sweep": {
                "procedure": "up",
                "rotary_speed": {"from": "4.24 rad/s", "to": f"{4.24 + step * (points - 1)!r} rad/s", "points": points},
            },
        },
        progress=False,
    )
    speeds, peaks = run["rotary_speed"].values, run["axial_peaks"].squeeze().values
    # peaks in a period
    misses = [np.nanmax(np.abs(peaks[:, k:] - peaks[:, :-k]), axis=1) for k in (1, 2, 3)]
    repeats = np.min(misses, axis=0) < 1e-5
    lost = speeds[~repeats][0]
    assert repeats[speeds < lost].all()
    assert lost - step <= torus <= lost + step


@pytest.mark.parametrize("extra", [{"stabilizer": {"clearance": "5 mm"}}, {"well": {"axial_friction": True}}])
def test_multipliers_where_equations_are_not_linearised(extra):
    """With stabilisers, or friction along the hole, deviations are differences of the
    equations: the multipliers are those of central differences of the flow."""
    study, data = continued({**SMOOTH, **extra}, 3, 3.5, [3.2], 20, observe=5, switch=False, points=4)
    assert list(data["motion"].values) == ["equilibrium"]
    setup = continuation_setup(study)
    flow = Flow(setup.flow(("rotary_speed",), (0.2,), 1).equations, rtol=1e-12)
    one = data.isel(point=1)
    number, state, period = float(one["rotary_speed"]), one["state"].values, float(one["period"])
    states, values = len(state), np.array([[number]])
    h = 1e-4 * flow.state_scales(values)[0]
    sides = np.concatenate([state + np.diag(h), state - np.diag(h)])
    legs = Legs(sides, 0.0, period, values)
    ends = rotated(setup.symmetry, flow.run(legs).state, -number * period)
    differences = ((ends[:states] - ends[states:]) / (2.0 * h[:, None])).T
    free = list(setup.symmetry.free)
    wanted = np.sort_complex(np.linalg.eigvals(differences[np.ix_(free, free)]))
    stored = multipliers_of(one)
    assert np.sort_complex(stored) == pytest.approx(wanted, abs=1e-6)


def test_a_regulated_motor_against_shooting_by_scipy():
    """A DC motor whose voltage follows the motion: a limit cycle closes on SciPy's
    DOP853 of circuit, springs and friction, and its multipliers are those of
    differences of such runs."""
    gains = (0.0272, 22.2, 1.138, -13.03, 15.6)
    base = {
        "operation": {"depth": "5000 m", "wob": "66.72 kN"},
        "bit": {"surface_amplitude": "0 mm"},
        "modes": {"lateral": "frozen", "axial": "frozen"},
        "drive": {"kind": "dc_motor", "gains": list(gains)},
    }
    study, data = continued(base, 1.5, 3, [2], 20, observe=10, points=40)
    cycle = list(data["motion"].values).index("limit_cycle")
    one = data.isel(point=int(np.flatnonzero(data["branch_of_point"].values == cycle)[10]))
    speed, period = float(one["rotary_speed"]), float(one["period"])
    names = [str(name) for name in data["state_name"].values]
    state = dict(zip(names, one["state"].values, strict=True))
    k, p, n_k, wob = (derive(study.parameters, 5000.0, 66720.0, speed), study.parameters, 7.2 * 6.0, 66720.0)
    damping, force = p.drillstring.torsional_damping, -p.bit.rock_stiffness * float(state["z"])

    def torque(omega, load):
        cutting = k.cutting_arm * 2 / math.pi * math.atan(p.bit.friction.smoothing * omega)
        return load * (2 / 3 * p.well.diameter / 2 * friction(p.bit.friction, omega) + cutting)

    steady = torque(speed, wob) + damping * speed

    def slopes(t, y):
        lag, top_speed, twist, bit_speed, current = y
        pipe = k.k_t * (lag - twist)
        deviations = (current - steady / n_k, lag, top_speed - speed, twist + steady / k.k_t, bit_speed - speed)
        voltage = n_k * speed + 0.01 * steady / n_k - sum(K * off for K, off in zip(gains, deviations, strict=True))
        return [
            top_speed - speed,
            (n_k * current - pipe) / 2122.32,
            bit_speed - speed,
            (pipe - damping * bit_speed - torque(bit_speed, force)) / k.J,
            (voltage - n_k * top_speed - 0.01 * current) / 0.005,
        ]

    def end(start):
        return solve_ivp(slopes, (0.0, period), start, "DOP853", rtol=1e-11, atol=1e-11).y[:, -1]

    start = np.array([float(state[name]) for name in ("lag", "drive_speed", "twist", "bit_speed", "motor_torque")])
    start[-1] /= n_k
    swing = float(one["bit_speed_max"]) - float(one["bit_speed_min"])
    assert swing > 0.1
    assert end(start) == pytest.approx(start, abs=1e-6)
    matrix = np.zeros((5, 5))
    for j in range(5):
        h = 1e-4 * np.eye(5)[j]
        matrix[:, j] = (end(start + h) - end(start - h)) / 2e-4
    wanted = np.linalg.eigvals(matrix)
    stored = multipliers_of(one)
    for multiplier in wanted:
        assert np.min(np.abs(stored[np.isfinite(stored)] - multiplier)) < 1e-5
    assert np.sum(np.abs(wanted) > 1.001) == int(one["unstable"])


def test_touches_of_circles_are_located():
    """The circle near 4.3 rad/s reaches the wall where the motion on it does, as long
    runs from points of the circle tell."""
    speed = 4.326224415773544
    study = {**AT, "continue": {"along": "rotary_speed", "from": "2.5 rad/s", "to": "8 rad/s"}}
    setup = continuation_setup(nsdrill.load_study(study))
    flow = setup.flow(("rotary_speed",), (0.55,), 1)
    orders = Orders((1,), (speed - 1e-4, speed + 3e-4), 9, grazes=grazes_of(setup.study, flow))
    state = (
        *(0.07363280195621423, -0.0020926217974525, 0.006426533364160703, 0.03447728526398614),
        *(-0.0011745910398276295, 0.03054500254797737, -5.486643488093639, 4.08058883863123),
    )
    seed = Seed(np.array(state), 0.0, np.array([speed]))
    (branch,) = Explorer(flow, orders).run([seed]).branches
    (reached,) = [one.point.found for one in branch.marked if one.label == 102]
    for shift, touches in ((-5e-5, False), (5e-5, True)):
        (side,) = reached.values + shift
        depths = []
        state = reached.mesh_states
        angles = 2 * math.pi * np.arange(len(state)) / len(state)
        state = rotated(setup.symmetry, state, angles)
        fold = 2 * math.pi / 3
        for _ in range(250):
            ends = flow.run(Legs(state, 0.0, fold, np.array([side]), angular=True))
            state = rotated(setup.symmetry, ends.state, -fold)
            depths.append(ends.touches[:, 1, 1].max())
        assert (max(depths[-20:]) > 0.0) == touches


def test_a_branch_is_not_followed_back_at_grazing_corners():
    """Where the collar comes to touch the wall a second time in a period, at 6.15965 and
    6.13791 rad/s, this branch turns within 1e-6 of the arclength. It has no branch point
    there, and no motion lies on it twice. The start is a point of it, as in a
    continuation from the sweep of figure 4."""
    numbers = 0.07610381132, 0.02466262057, -0.004872420004, 0.4682262282, -0.0009966944258, -0.01740201768
    state = dict(zip(("x", "vx", "y", "vy", "z", "vz"), numbers, strict=True)) | {"twist": -6.090657192}
    initial = {name: f"{value!r} {UNITS[name]}" for name, value in state.items()} | {"bit_speed": "6.307716461 rad/s"}
    keys = {"lobes": 1, "switch": False, "motions": "periodic"}
    _, data = continued({**AT, "initial": initial}, 3.0, 7.0, [6.191872991], 0.05, points=150, **keys)
    assert not len(numbers_at(data, BRANCH))
    assert numbers_at(data, FOLD) == pytest.approx([6.137913, 6.159650, 6.202638], abs=2e-6)
    assert numbers_at(data, DOUBLING) == pytest.approx([6.137913, 6.159650, 6.166629, 6.197131], abs=2e-6)
    x = data["state"].values / np.std(data["state"].values, axis=0)
    speeds = data["rotary_speed"].values
    place = np.arange(len(x))
    apart = np.linalg.norm(x[:, None] - x[None], axis=-1) + 10.0 * np.abs(speeds[:, None] - speeds[None])
    assert np.min(apart[np.abs(place[:, None] - place[None]) > 30]) > 1e-3


def test_a_doubling_that_jumps(monkeypatch):
    """The motion over two lobes that springs from the doubling at 6.166629 rad/s, on the wall,
    sets out to lower speeds, where the motion over one lobe has one unstable direction
    less, though it turns soon. Its distance from that motion grows as the normal form says."""
    study = {**AT, "continue": {"along": "rotary_speed", "from": "3 rad/s", "to": "7 rad/s"}}
    setup = continuation_setup(nsdrill.load_study(study))
    flow = setup.flow(("rotary_speed",), (0.4,), 1)
    orders = Orders((1,), (3.0, 7.0), 60, switch=False, grazes=grazes_of(setup.study, flow))
    state = 0.07610381132, 0.02466262057, -0.004872420004, 0.4682262282, -0.0009966944258, -0.01740201768
    seed = Seed(np.array([*state, -6.090657192, 6.307716461]), 0.0, np.array([6.191872991]))
    (branch,) = Explorer(flow, orders).run([seed]).branches
    place = next(k for k, one in enumerate(branch.marked) if abs(one.point.found.values[-1] - 6.166629) < 2e-6)
    assert branch.marked[place].label == DOUBLING
    form, orbit = normal_forms(flow, [branch])[place], branch.marked[place].point.found
    assert form.criticality(DOUBLING) == SUBCRITICAL

    doubled, found = Periodic.at(flow, 2, orbit.values, orbit.state), []
    for length in (0.005, 0.0025):
        monkeypatch.setattr(explore, "STEP_LENGTHS", (length,))
        point = advance(flow, {0: explore._switched(doubled, orbit, explore.critical_vector(orbit, -1.0))})[0]
        speed, apart = point.found.values[-1], (point.found.state - orbit.state)[doubled.free] / doubled.state_scales
        one_lobe = Periodic.at(flow, 1, np.array([speed]), orbit.state)
        unknowns = one_lobe.unknowns(orbit.state[None], speed)
        single = advance(flow, {0: corrected_at_parameter(one_lobe, unknowns)})[0].found
        assert speed < orbit.values[-1]
        assert point.found.unstable == single.unstable + 1
        multiplier = single.multipliers[np.argmin(np.abs(single.multipliers + 1.0))].real
        assert multiplier > -1.0
        amplitude = np.linalg.norm(apart)
        found.append((amplitude, (-1.0 - multiplier) / amplitude**2))
    (wide, at_wide), (close, at_close) = found
    # beside the coefficient each has a part that grows as the amplitude
    limit = (wide * at_close - close * at_wide) / (wide - close)
    assert form.coefficient == pytest.approx(limit, rel=0.1)


def test_a_curve_ends_where_its_motion_becomes_one_over_fewer_lobes():
    """The motion over two lobes that reaches the wall at 6.05404 rad/s springs from that
    over one lobe, which reaches it at 6.05796 rad/s. At greater weights both curves meet,
    and beyond there is only one motion. The start is a point of a continuation from the
    sweep of figure 4."""
    numbers = 0.07106403421, -0.1056962044, 0.01582139011, 0.435851376, -0.001557929076, 0.007025410182
    state = dict(zip(("x", "vx", "y", "vy", "z", "vz"), numbers, strict=True)) | {"twist": -5.886583518}
    initial = {name: f"{value!r} {UNITS[name]}" for name, value in state.items()} | {"bit_speed": "5.998660586 rad/s"}
    curves = {"over": "wob", "from": "21 kN", "to": "24 kN", "of": ["wall"], "points": 60}
    keys = {"lobes": 2, "switch": False, "motions": "periodic", "curves": curves}
    _, data = continued({**AT, "initial": initial}, 3.0, 7.0, [6.045350767], 0.05, points=34, **keys)
    assert data["curve_lobes"].values.tolist() == [2, 1]
    assert data["curve_end_reason"].values.tolist() == [
        "the end of the range; it joins a motion over fewer lobes",
        "the end of the range",
    ]
    double, single = (slice(*ends) for ends in pairwise([0, *np.cumsum(data["curve_row_size"].values)]))
    speeds, weights = data["curve_rotary_speed"].values, data["curve_wob"].values
    # where both curves meet, points stand to some hundredths of a newton, by the last bits of LAPACK
    assert weights[double].max() == pytest.approx(weights[double][-1], abs=0.05)
    assert weights[double][-1] < 23.5e3
    meeting = np.interp(weights[double][-1], weights[single], speeds[single])
    assert speeds[double][-1] == pytest.approx(meeting, abs=1e-5)
    before = np.interp(23e3, weights[double], speeds[double]) - np.interp(23e3, weights[single], speeds[single])
    assert abs(before) > 1e-3
