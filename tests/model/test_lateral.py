"""Mud that turns, stabilisers, weight and friction along the axis: the equations, their energy, and known answers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from reference import Case

from model.cases import operation_of, random_case, random_state
from model.lateral import Lateral, derivative, parameters
from nsdrill.abi import Rows
from nsdrill.models.christoforou_yigit.forces import energy, powers
from nsdrill.models.christoforou_yigit.options import Options, options_of
from nsdrill.models.christoforou_yigit.parameters import Parameters  # noqa: F401
from nsdrill.models.christoforou_yigit.rhs import STATES, drifts, make_right_hand_side, pack, rows_of
from nsdrill.models.leaves import with_values

FORMS = {
    "swirl": {"swirl": 0.5},
    "stabilizer": {"clearance": 0.02},
    "weight": {"inclination": 1.0},
    "axial": {"axial_friction": True},
    "heavy and rubbing": {"inclination": 1.4, "axial_friction": True, "eccentric_weight": False},
    "all": {"swirl": 0.4, "clearance": 0.01, "inclination": 0.5, "axial_friction": True},
}


def slopes(options: Options, tables: np.ndarray, times: np.ndarray, states: np.ndarray, lanes: int = 1) -> np.ndarray:
    """d(state)/dt [n, 8] by the compiled equations, so many lanes at once."""
    rows: Rows = rows_of(options)
    out = np.empty_like(states)
    out[:, 0::2] = states[:, 1::2] + drifts(tables, options)
    for first in range(0, len(states), lanes):
        here = np.resize(np.arange(first, min(first + lanes, len(states))), lanes)
        buffer = np.zeros((rows.total, lanes))
        buffer[rows.stage : rows.stage + rows.states] = states[here].T
        buffer[rows.stage_time] = times[here]
        buffer[rows.parameter : rows.parameter + rows.parameters] = tables[here].T
        flat = buffer.ravel()
        make_right_hand_side(lanes, options)(flat)
        made = flat.reshape(rows.total, lanes)[rows.acceleration : rows.acceleration + 4].T
        out[here, 1::2] = made
    return out


def cases(form: str, count: int, seed: int, law: str = "linear") -> list[tuple[Case, Lateral, float, np.ndarray]]:
    rng = np.random.default_rng(seed)
    found = []
    for _ in range(count):
        c = random_case(rng, wall_law=law, lobes=3)
        o = replace(
            Lateral(**FORMS[form]),
            static=rng.uniform(0.3, 0.6),
            dynamic=rng.uniform(0.1, 0.3),
            smoothing=10 ** rng.uniform(1, 3),
            decay=rng.uniform(0, 5),
        )
        found.append((c, o, rng.uniform(0, 5), random_state(rng, c)))
    return found


def packed(c: Case, o: Lateral) -> np.ndarray:
    return pack(parameters(c, o), c.depth, c.wob, c.speed)


@pytest.mark.parametrize("law", ["linear", "hertz"])
@pytest.mark.parametrize("form", FORMS)
def test_derivatives_equal_the_reference(form: str, law: str) -> None:
    """To 4e-13 of the terms summed, at 100 random states of 100 random strings."""
    found = cases(form, 100, 3, law)
    options = options_of(parameters(*found[0][:2]))
    mine = slopes(
        options,
        np.concatenate([packed(c, o) for c, o, *_ in found]),
        np.array([t for *_, t, _ in found]),
        np.array([s for *_, s in found]),
    )
    for (c, o, t, s), row in zip(found, mine, strict=True):
        size = derivative(c, o, t, s, terms=True)
        assert np.all(np.abs(row - derivative(c, o, t, s)) <= 4e-13 * size), (c, o, t, s)


def energies(c: Case, o: Lateral, states: np.ndarray, times: np.ndarray) -> np.ndarray:
    named = {name: states[..., i] for i, name in enumerate(STATES)} | {"drive_angle": c.speed * times}
    return energy(parameters(c, o), operation_of(c), named)


@pytest.mark.parametrize("form", FORMS)
def test_energy_changes_by_the_powers(form: str) -> None:
    """dE/dt by Richardson-extrapolated central differences along the compiled slope, against the sum of the powers."""
    compared = 0
    for c, o, t, s in cases(form, 24, 5):
        c = replace(c, wall_stiffness=5e6)
        p = parameters(c, o)
        f = slopes(options_of(p), packed(c, o), np.array([t]), s[None])[0]

        def change(h: float, c: Case = c, o: Lateral = o, s: np.ndarray = s, f: np.ndarray = f, t: float = t) -> float:
            ends = energies(c, o, np.array([s - h * f, s + h * f]), t + np.array([-h, h]))
            return float(ends[1] - ends[0]) / (2 * h)

        h, r, v = 1e-5, np.hypot(s[0], s[2]), np.hypot(s[1], s[3])
        if min(abs(r - c.gap), abs(r - (o.clearance or 0.0))) < 2 * h * v:
            continue  # the energy has a jump in its second derivative there
        named = {name: s[None, i] for i, name in enumerate(STATES)} | {"drive_angle": np.array([c.speed * t])}
        fed = powers(p, operation_of(c), named)
        size = sum(abs(float(power[0])) for power in fed.values()) + abs(float(energies(c, o, s, np.array(t))))
        rate = (4 * change(h / 2) - change(h)) / 3
        assert rate == pytest.approx(sum(float(power[0]) for power in fed.values()), abs=1e-7 * size)
        compared += 1
    assert compared >= 20


@pytest.mark.parametrize("form", ["swirl", "stabilizer", "weight", "all"])
@pytest.mark.parametrize("law", ["linear", "hertz"])
def test_lanes_do_not_change_a_bit(form: str, law: str) -> None:
    found = cases(form, 16, 8, law)
    options = options_of(parameters(*found[0][:2]))
    tables = np.concatenate([packed(c, o) for c, o, *_ in found])
    times, states = np.array([t for *_, t, _ in found]), np.array([s for *_, s in found])
    one = slopes(options, tables, times, states)
    for lanes in (8, 16):
        assert one.tobytes() == slopes(options, tables, times, states, lanes).tobytes()


@pytest.mark.parametrize("key", ["mud.swirl", "well.inclination"])
def test_an_option_that_is_zero_somewhere_changes_no_bit_there(key: str) -> None:
    """A point of a sweep that begins at zero has the bits of a run without the option."""
    found = cases("swirl", 16, 9)
    plain = [(c, replace(o, swirl=0.0)) for c, o, *_ in found]
    times, states = np.array([t for *_, t, _ in found]), np.array([s for *_, s in found])
    without = np.concatenate([packed(c, o) for c, o in plain])
    zero = [with_values(parameters(c, o), {key: np.zeros(1)}) for c, o in plain]
    swept = np.concatenate([pack(p, c.depth, c.wob, c.speed) for p, (c, _) in zip(zero, plain, strict=True)])
    on = options_of(zero[0])
    assert on != Options() and swept.shape[1] == without.shape[1] + 2
    assert slopes(on, swept, times, states).tobytes() == slopes(Options(), without, times, states).tobytes()
