"""The models of the scripts: against SciPy's integrators, published numbers and linear
theory, and each derivation against another."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import nsdrill
from nsdrill.orbit.special import BRANCH, DOUBLING, HOPF
from nsdrill.testing import check_model
from script.conftest import EXAMPLES, example

# what is compared with SciPy: how long [s], and what a state may differ by over its greatest
# value; a trace of Lorenz's equations loses a factor e in 1.1 s
TRACES = {
    "duffing": (40.0, 1e-8, {}),
    "brake": (3.0, 1e-7, {}),
    "impact": (0.4, 1e-6, {}),
    "rotor": (15.0, 1e-7, {"omega": 1.2}),
    "lorenz": (5.0, 1e-6, {}),
    "three_inertias": (10.0, 1e-7, {}),
    "planet": (12.0, 1e-7, {}),
}


@pytest.mark.parametrize("script", TRACES)
def test_a_trace_is_that_of_scipy(script):
    duration, allowed, numbers = TRACES[script]
    model = example(script)
    study = model.study(transient=0, observe=duration, rtol=1e-10, **numbers)
    trace = nsdrill.simulate(study, sample=duration / 200)
    read = model.reading.signature
    parameters = {name: float(value) for name, value in read.parameters.items()} | numbers

    def slopes(t, y):
        found = read.called(model, t, dict(zip(read.start, map(float, y), strict=True)), parameters)
        return [found[name] for name in read.start]

    start = [float(value) for value in read.start.values()]
    exact = solve_ivp(slopes, (0.0, duration), start, "LSODA", trace.time.values, rtol=1e-11, atol=1e-13)
    for k, name in enumerate(read.start):
        off = np.abs(trace[name].values - exact.y[k]).max()
        assert off < allowed * np.abs(exact.y[k]).max(), name


@pytest.mark.parametrize("script", EXAMPLES)
def test_each_derivation_is_checked_against_another(script):
    check_model(example(script), "simulation: {transient: 0 s, observe: 5 s}")


def test_the_exponent_of_lorenz_is_the_published_one():
    """0.9056 at rho = 28: Sprott, Chaos and Time-Series Analysis, 2003, p. 431."""
    study = example("lorenz").study(rho=28.0, transient=50, observe=1500, exponent=True)
    data = nsdrill.run(study, progress=False)
    assert abs(data.lyapunov_exponent.item() - 0.9056) < 3 * data.lyapunov_error.item() < 0.06


def hopf_points(branches, along):
    return branches[along].values[branches.label.values == HOPF].tolist()


def test_lorenz_has_its_hopf_point():
    """rho = sigma (sigma + beta + 3) / (sigma - beta - 1), Lorenz 1963."""
    study = example("lorenz").study(
        continued={"rho": (20.0, 27.0), "seeds": [22.0], "switch": False}, transient=100, observe=20
    )
    branches = nsdrill.continue_branches(study, progress=False)
    sigma, beta = 10.0, 8 / 3
    known = sigma * (sigma + beta + 3) / (sigma - beta - 1)
    assert hopf_points(branches, "parameters_rho") == pytest.approx([known], rel=1e-4)


def test_the_cycle_of_lorenz_ends_at_its_homoclinic_connection():
    """Its period grows without bound towards rho = 13.926, Sparrow, The Lorenz Equations, 1982,
    p. 22, and so does that of its mirror image, from the other Hopf point. Multipliers beyond 1e6
    hide the others, and would count as bifurcations."""
    study = example("lorenz").study(continued={"rho": (13.0, 24.74), "seeds": [20.0]}, transient=50, observe=20)
    branches = nsdrill.continue_branches(study, progress=False)
    cycles = np.flatnonzero(branches.motion.values == "limit_cycle")
    sides = []
    for cycle in cycles:
        assert branches.end_reason.values[cycle].endswith("its period grows without bound (homoclinic)")
        of_cycle = branches.branch_of_point.values == cycle
        rho, period = branches.parameters_rho.values[of_cycle], branches.period.values[of_cycle]
        assert 13.926 < rho.min() < 13.93
        assert (np.diff(period) > 0.0).all()
        assert not set(branches.label.values[of_cycle]) & {DOUBLING, BRANCH}
        sides.append(float(np.sign(branches.x_mean.values[of_cycle][0])))
    assert sorted(sides) == [-1.0, 1.0]


def test_the_string_of_three_inertias_loses_its_balance_where_linear_theory_says():
    """Eigenvalues of the matrix, written by hand, from below and above the set speed at which
    friction that falls outweighs all damping."""
    model = example("three_inertias")
    p = {name: float(value) for name, value in model.reading.signature.parameters.items()} | {"weight": 50e3}

    def growth(speed):
        arm, fall = p["weight"] * p["radius"], p["decay"] * (p["static"] - p["dynamic"]) * np.exp(-p["decay"] * speed)
        smoothed = 2 / np.pi * np.arctan(p["smoothing"] * speed)
        level = p["dynamic"] + (p["static"] - p["dynamic"]) * np.exp(-p["decay"] * speed)
        direction = 2 / np.pi * p["smoothing"] / (1 + (p["smoothing"] * speed) ** 2)
        bit = arm * (direction * level - smoothed * fall)
        k1, k2, c1, c2 = p["upper"], p["lower"], p["c_upper"], p["c_lower"]
        stiffness = np.array([[p["K_i"] + k1, -k1, 0], [-k1, k1 + k2, -k2], [0, -k2, k2]])
        damping = np.array(
            [[p["K_p"] + p["c_table"] + c1, -c1, 0], [-c1, c1 + c2, -c2], [0, -c2, c2 + p["c_bit"] + bit]]
        )
        inverse = np.diag([1 / p["J_drive"], 1 / p["J_pipe"], 1 / p["J_bit"]])
        whole = np.block([[np.zeros((3, 3)), np.eye(3)], [-inverse @ stiffness, -inverse @ damping]])
        return np.linalg.eigvals(whole).real.max()

    low, high = 1.0, 4.0
    assert growth(low) > 0.0 > growth(high)
    for _ in range(40):
        middle = (low + high) / 2
        low, high = (middle, high) if growth(middle) > 0.0 else (low, middle)
    along = {"speed": (1.2, 4.0), "seeds": [3.5], "switch": False}
    branches = nsdrill.continue_branches(
        model.study(weight=50e3, continued=along, transient=200, observe=20), progress=False
    )
    assert max(hopf_points(branches, "parameters_speed")) == pytest.approx(low, rel=1e-4)


def test_the_belt_sticks_up_to_the_speed_that_scipy_finds():
    """Stick-slip of the block: at every speed of the belt, its greatest deflection is that of
    an independent integration."""
    model = example("brake")
    belts = [0.1, 0.3, 0.8]
    data = nsdrill.run(model.study(belt=belts, transient=40, observe=20, rtol=1e-8), progress=False)
    read = model.reading.signature
    for belt, greatest in zip(belts, data.x_max.values.ravel(), strict=True):
        numbers = {name: float(value) for name, value in read.parameters.items()} | {"belt": belt}

        def slopes(t, y, numbers=numbers):
            return read.function(*y, **numbers)

        times = np.linspace(40, 60, 20001)
        found = solve_ivp(slopes, (0.0, 60.0), [0.0, 0.1, 0.0], "LSODA", times, rtol=1e-9, atol=1e-11)
        assert greatest == pytest.approx(found.y[0].max(), rel=1e-4)
