"""Points, chains and their order."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nsdrill.sweep.plan import Plan

AXES = ("depth", "wob", "rotary_speed", "bit.rock_stiffness")
SIZES = st.tuples(*[st.integers(1, 5)] * 4)
PROCEDURES = st.sampled_from(["same", "up", "down", "up-down"])


def plan_of(state_scales: tuple[int, ...], procedure: str, along: str) -> Plan:
    axes = {
        name: np.arange(n, dtype=float) * 10 + i for i, (name, n) in enumerate(zip(AXES, state_scales, strict=True))
    }
    return Plan(axes, procedure, None if procedure == "same" else along)


def all_points(plan: Plan) -> np.ndarray:
    """[chains, places]"""
    return plan.points_of(np.arange(plan.chains)[:, None], np.arange(plan.chain_length))


@given(SIZES, PROCEDURES, st.sampled_from(AXES))
@settings(max_examples=200, deadline=None)
def test_every_point_is_visited_once(state_scales: tuple[int, ...], procedure: str, along: str) -> None:
    plan = plan_of(state_scales, procedure, along)
    assert sorted(all_points(plan).ravel().tolist()) == list(range(plan.points))


@given(SIZES, st.sampled_from(["up", "down"]), st.sampled_from(AXES))
@settings(max_examples=100, deadline=None)
def test_a_carried_axis_runs_one_way_and_the_others_stand_still(
    state_scales: tuple[int, ...], procedure: str, along: str
) -> None:
    plan = plan_of(state_scales, procedure, along)
    values = plan.values(all_points(plan))
    steps = np.diff(values[along], axis=1)
    assert np.all(steps == (10 if procedure == "up" else -10))
    for other in set(AXES) - {along}:
        assert np.all(np.diff(values[other], axis=1) == 0)


@given(SIZES, st.sampled_from(AXES))
@settings(max_examples=100, deadline=None)
def test_up_down_goes_up_and_comes_back(state_scales: tuple[int, ...], along: str) -> None:
    plan = plan_of(state_scales, "up-down", along)
    points = all_points(plan)
    values = plan.values(points)[along]
    n = len(plan.axes[along])
    assert values.shape[1] == 2 * n
    assert np.array_equal(values[:, :n], np.broadcast_to(plan.axes[along], (plan.chains, n)))
    assert np.array_equal(values, values[:, ::-1]), "the way back is the way there"
    procedure = np.unravel_index(points, plan.shape)[0]
    assert np.array_equal(procedure, np.broadcast_to(np.repeat([0, 1], n), points.shape))


@given(SIZES, PROCEDURES, st.sampled_from(AXES), st.data())
@settings(max_examples=100, deadline=None)
def test_a_point_is_found_by_its_values(
    state_scales: tuple[int, ...], procedure: str, along: str, data: st.DataObject
) -> None:
    plan = plan_of(state_scales, procedure, along)
    number = data.draw(st.integers(0, plan.points - 1))
    values = {name: float(value) for name, value in plan.values(np.array(number)).items()}
    name = plan.procedures[int(np.unravel_index(number, plan.shape)[0])]
    off = data.draw(st.floats(-4.9, 4.9))
    assert plan.find({axis: value + off for axis, value in values.items()}, name) == (number, values)


def test_single_points_are_numbered_with_the_last_axis_fastest() -> None:
    plan = plan_of((2, 2, 1, 3), "same", "depth")
    assert plan.chain_length == 1
    assert plan.chains == 12
    assert plan.values(np.arange(12))["bit.rock_stiffness"].tolist() == [3, 13, 23] * 4
    assert plan.values(np.arange(12))["depth"].tolist() == [0] * 6 + [10] * 6


def test_a_procedure_that_was_not_run_is_refused() -> None:
    with pytest.raises(ValueError, match=r"found down, allowed: up"):
        plan_of((2, 1, 1, 1), "up", "depth").find(dict.fromkeys(AXES, 0.0), "down")


def test_a_million_points_are_numbered_without_listing_them() -> None:
    plan = plan_of((1000, 10, 1000, 1), "up", "rotary_speed")
    assert plan.points == 10_000_000
    last = plan.points_of(plan.chains - 1, plan.chain_length - 1)
    assert int(last) == 9_999_999
