"""Several starts of every operating point: how they are numbered, and the same bits
whatever runs them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from model_tables import VARIABLES
from reference import Case

from nsdrill.kernel.settings import Simulation
from nsdrill.models.christoforou_yigit.parameters import Initial
from nsdrill.models.kept import Kept
from nsdrill.sweep.plan import Plan
from nsdrill.variables import OK
from sweep.runs import run_work, same_bits, work_for

AXES = {"depth": np.array([1.0, 2.0]), "wob": np.array([5.0]), "rotary_speed": np.array([7.0, 8.0, 9.0])}
SHORT = Simulation(transient=4.0, observe=8.0)


def test_starts_run_fastest() -> None:
    plan = Plan(AXES, "same", None, 4)
    assert (plan.grid, plan.shape) == ((1, 2, 1, 3, 4), (1, 2, 1, 3))
    assert (plan.points, plan.chains, plan.chain_length) == (24, 24, 1)
    points = np.arange(24)
    assert plan.starts_of(points).tolist() == [0, 1, 2, 3] * 6
    depth, wob, speed = plan.values(points).values()
    assert depth.tolist() == [1.0] * 12 + [2.0] * 12
    assert speed.tolist() == np.repeat([7.0, 8.0, 9.0] * 2, 4).tolist()
    assert wob.tolist() == [5.0] * 24
    wanted = {"depth": 2.0, "wob": 5.0, "rotary_speed": 8.0}
    assert plan.find(wanted, "same", 3) == (12 + 4 + 3, wanted)
    with pytest.raises(ValueError, match="start: found 4, allowed: 0 to 3"):
        plan.find(wanted, "same", 4)


def test_starts_are_not_carried() -> None:
    with pytest.raises(ValueError, match="with procedure up, allowed: with same"):
        Plan(AXES, "up", "depth", 4)


def ensemble(count: int = 6, **more: object):  # type: ignore[no-untyped-def]
    work = work_for(Case(), SHORT, initial=Initial(ensemble=count, seed=5), rotary_speed=[2.0, 5.0, 8.0], peaks=4)
    return replace(work, plan=replace(work.plan, starts=count), **more)


@pytest.fixture(scope="module")
def six() -> dict[str, np.ndarray]:
    return run_work(ensemble(), lanes=8)


@pytest.mark.parametrize(("lanes", "workers", "quantum_seconds"), [(1, 1, 0.25), (16, 1, 0.25), (8, 2, 0.002)])
def test_the_bits_do_not_depend_on_lanes_or_workers(
    six: dict[str, np.ndarray], lanes: int, workers: int, quantum_seconds: float
) -> None:
    assert same_bits(run_work(ensemble(), lanes, workers, quantum_seconds), six)


def test_all_starts_have_all_variables_and_states_of_their_own(six: dict[str, np.ndarray]) -> None:
    assert set(six) == {v.name for v in VARIABLES if Kept(4, starts=6, options=("drilled", "method")).has(v)}
    assert np.all(six["status"] == OK)
    assert len(np.unique(six["initial_state"], axis=0)) == 18


def test_more_starts_leave_the_first_as_they_were(six: dict[str, np.ndarray]) -> None:
    nine = run_work(ensemble(9), lanes=8)
    first = np.arange(27).reshape(3, 9)[:, :6].ravel()
    assert all(nine[name][first].tobytes() == six[name].tobytes() for name in six)


def test_another_order_and_other_neighbours(six: dict[str, np.ndarray]) -> None:
    some = np.array([17, 3, 8])
    out = run_work(ensemble(), 8, pending=some)
    assert all(out[name][some].tobytes() == six[name][some].tobytes() for name in six)
