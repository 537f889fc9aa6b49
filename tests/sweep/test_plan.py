"""Points, chains and their order; any number of the study as an axis; several starts of every
operating point."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from model_tables import VARIABLES
from reference import Case
from strings import MAIN, pack

import nsdrill
from nsdrill.kernel.settings import Simulation
from nsdrill.models.christoforou_yigit.coefficients import power
from nsdrill.models.christoforou_yigit.parameters import Initial, Parameters
from nsdrill.models.contents import Contents
from nsdrill.models.parts import values_at
from nsdrill.models.tree import leaves, with_values
from nsdrill.models.variant import variant_of
from nsdrill.sweep.plan import Plan
from nsdrill.variables import OK
from sweep.runs import collect, finish, run_work, same_bits, work_for

AXES = ("depth", "wob", "rotary_speed", "bit.rock_stiffness")
SIZES = st.tuples(*[st.integers(1, 5)] * 4)
PROCEDURES = st.sampled_from(["same", "up", "down", "up-down", "all"])


def plan_of(sizes: tuple[int, ...], procedure: str, along: str) -> Plan:
    axes = {name: np.arange(n, dtype=float) * 10 + i for i, (name, n) in enumerate(zip(AXES, sizes, strict=True))}
    return Plan(axes, procedure, None if procedure == "same" else along)


def all_points(plan: Plan) -> np.ndarray:
    """[chains along which a state is carried, or all, places]"""
    return plan.points_of(np.arange(plan.carried_chains or plan.chains)[:, None], np.arange(plan.chain_length))


def each_place(plan: Plan) -> list[int]:
    """The points at all places of all chains, chain by chain."""
    chains = np.arange(plan.chains)
    lengths = np.broadcast_to(plan.lengths(chains), chains.shape)
    places = np.concatenate([np.arange(length) for length in lengths])
    return plan.points_of(np.repeat(chains, lengths), places).tolist()


@given(SIZES, PROCEDURES, st.sampled_from(AXES))
@settings(max_examples=200)
def test_every_point_is_visited_once(sizes, procedure, along):
    plan = plan_of(sizes, procedure, along)
    assert sorted(each_place(plan)) == list(range(plan.points))


@given(SIZES, st.sampled_from(AXES))
@settings(max_examples=100)
def test_all_is_up_and_down_and_then_every_point_by_itself(sizes, along):
    plan, both = plan_of(sizes, "all", along), plan_of(sizes, "up-down", along)
    assert plan.procedures == ("up", "down", "same")
    assert np.array_equal(all_points(plan), all_points(both))
    assert plan.chains == both.chains + both.points // 2
    alone = plan.points_of(np.arange(both.chains, plan.chains), 0)
    assert np.array_equal(alone, np.arange(both.points, plan.points))
    for name, values in plan.values(alone).items():
        assert np.array_equal(values, both.values(np.arange(both.points // 2))[name])


@given(SIZES, PROCEDURES, st.sampled_from(AXES))
@settings(max_examples=100)
def test_a_refinement_runs_units_that_hold_every_point_once(sizes, procedure, along):
    plan = plan_of(sizes, procedure, along)
    units = plan.units()
    assert sorted(units.ravel().tolist()) == list(range(plan.points))
    for other in set(AXES) - ({along} if plan.carried else set()):
        assert np.all(np.ptp(plan.values(units)[other], axis=1) == 0)
    some = np.arange(0, len(units), 2)
    chains = plan.chains_of(some)
    places = [(chain, place) for chain in chains for place in range(int(plan.lengths(chain)))]
    assert sorted(plan.points_of(*np.array(places).T).tolist()) == sorted(units[some].ravel().tolist())


@given(SIZES, st.sampled_from(["up", "down"]), st.sampled_from(AXES))
@settings(max_examples=100)
def test_a_carried_axis_runs_one_way_and_the_others_stand_still(sizes, procedure, along):
    plan = plan_of(sizes, procedure, along)
    values = plan.values(all_points(plan))
    steps = np.diff(values[along], axis=1)
    assert np.all(steps == (10 if procedure == "up" else -10))
    for other in set(AXES) - {along}:
        assert np.all(np.diff(values[other], axis=1) == 0)


@given(SIZES, st.sampled_from(AXES))
@settings(max_examples=100)
def test_up_down_goes_up_and_comes_back(sizes, along):
    plan = plan_of(sizes, "up-down", along)
    points = all_points(plan)
    values = plan.values(points)[along]
    n = len(plan.axes[along])
    assert values.shape[1] == 2 * n
    assert np.array_equal(values[:, :n], np.broadcast_to(plan.axes[along], (plan.chains, n)))
    assert np.array_equal(values, values[:, ::-1]), "the way back is the way there"
    procedure = np.unravel_index(points, plan.shape)[0]
    assert np.array_equal(procedure, np.broadcast_to(np.repeat([0, 1], n), points.shape))


@given(SIZES, PROCEDURES, st.sampled_from(AXES), st.data())
@settings(max_examples=100)
def test_a_point_is_found_by_its_values(sizes, procedure, along, data):
    plan = plan_of(sizes, procedure, along)
    number = data.draw(st.integers(0, plan.points - 1))
    values = {name: float(value) for name, value in plan.values(np.array(number)).items()}
    name = plan.procedures[int(np.unravel_index(number, plan.shape)[0])]
    off = data.draw(st.floats(-4.9, 4.9))
    assert plan.find({axis: value + off for axis, value in values.items()}, name) == (number, values)


def test_single_points_are_numbered_with_the_last_axis_fastest():
    plan = plan_of((2, 2, 1, 3), "same", "depth")
    assert plan.chain_length == 1
    assert plan.chains == 12
    assert plan.values(np.arange(12))["bit.rock_stiffness"].tolist() == [3, 13, 23] * 4
    assert plan.values(np.arange(12))["depth"].tolist() == [0] * 6 + [10] * 6


def test_a_procedure_that_was_not_run_is_refused():
    with pytest.raises(ValueError, match=r"found down; allowed: up"):
        plan_of((2, 1, 1, 1), "up", "depth").find(dict.fromkeys(AXES, 0.0), "down")


def test_a_million_points_are_numbered_without_listing_them():
    plan = plan_of((1000, 10, 1000, 1), "up", "rotary_speed")
    assert plan.points == 10_000_000
    last = plan.points_of(plan.chains - 1, plan.chain_length - 1)
    assert int(last) == 9_999_999


OPERATION = {"depth": 5000.0, "wob": 22.24e3, "rotary_speed": 3.0}
SHORT_RUNS = Simulation(transient=1.0, observe=2.0)


def numbers() -> dict[str, float]:
    return {key: value for key, value, _ in leaves(Parameters()) if isinstance(value, float)}


@pytest.mark.parametrize("key", list(numbers()))
def test_points_along_any_axis_have_the_coefficients_of_single_points(key):
    """Bit for bit, whatever numpy makes of powers of arrays; of what is off by default
    (0), around 1."""
    values = (numbers()[key] or 1.0) * np.random.default_rng(1).uniform(0.7, 1.3, 300)
    operation = {name: np.full(300, value) for name, value in OPERATION.items()}
    together = values_at(Parameters(), Initial(), {**operation, key: values})
    table = pack(together.parameters, *together.operation)
    alone = np.concatenate(
        [pack(with_values(Parameters(), {key: value}), *OPERATION.values()) for value in values.tolist()]
    )
    assert table.tobytes() == alone.tobytes()
    variant = variant_of(MAIN)
    for made in (variant.state_scales, variant.first_step):
        assert made(table).tobytes() == np.concatenate([made(row) for row in alone[:, None]]).tobytes()


def test_powers_of_arrays_are_those_of_their_numbers():
    values = np.random.default_rng(2).uniform(0.01, 1.0, (40, 25))
    for exponent in (2, 3, 4):
        assert power(values, exponent).tolist() == [[v**exponent for v in row] for row in values.tolist()]


@pytest.mark.parametrize("procedure", ["same", "up-down"])
def test_a_sweep_over_the_rock_has_the_bits_of_single_runs(procedure):
    """Each point from the state in which it began."""
    rocks = np.array([15e6, 25e6, 60e6])
    axes = {name: np.array([value]) for name, value in OPERATION.items()} | {"bit.rock_stiffness": rocks}
    base = work_for(Case(), SHORT_RUNS)
    work = replace(base, plan=Plan(axes, procedure, None if procedure == "same" else "bit.rock_stiffness"))
    out = run_work(work)
    for point in range(work.plan.points):
        rock = work.plan.values(np.array([point]))["bit.rock_stiffness"]
        single = replace(
            base,
            parameters=with_values(base.parameters, {"bit.rock_stiffness": float(rock[0])}),
            plan=Plan({name: np.array([value]) for name, value in OPERATION.items()}, "same", None),
        )
        runs = single.prepare(np.array([0]))
        if procedure == "same":
            assert runs.initial.tobytes() == out["initial_state"][point][None].tobytes()
        batch = single.new_batch(8, 1)
        batch.add(np.array([0]), replace(runs, initial=out["initial_state"][point][None]))
        alone = collect(single, finish(single, batch))
        assert same_bits(alone, {name: values[[point]] for name, values in out.items()})


OF_STARTS = {"depth": np.array([1.0, 2.0]), "wob": np.array([5.0]), "rotary_speed": np.array([7.0, 8.0, 9.0])}
SHORT = Simulation(transient=4.0, observe=8.0)


def test_starts_run_fastest():
    plan = Plan(OF_STARTS, "same", None, 4)
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
    with pytest.raises(ValueError, match="start: found 4; allowed: 0 to 3"):
        plan.find(wanted, "same", 4)


def test_starts_are_not_carried():
    with pytest.raises(ValueError, match="with procedure up, allowed: with same"):
        Plan(OF_STARTS, "up", "depth", 4)


def ensemble(count: int = 6, **more: object):
    work = work_for(Case(), SHORT, initial=Initial(ensemble=count, seed=5), rotary_speed=[2.0, 5.0, 8.0], peaks=4)
    return replace(work, plan=replace(work.plan, starts=count), **more)


@pytest.fixture(scope="module")
def six():
    return run_work(ensemble(), lanes=8)


@pytest.mark.parametrize(("lanes", "workers", "quantum_seconds"), [(1, 1, 0.25), (16, 1, 0.25), (8, 2, 0.002)])
def test_the_bits_do_not_depend_on_lanes_or_workers(six, lanes, workers, quantum_seconds):
    assert same_bits(run_work(ensemble(), lanes, workers, quantum_seconds), six)


def test_all_starts_have_all_variables_and_states_of_their_own(six):
    assert set(six) == {v.name for v in VARIABLES if Contents(4, starts=6, options=("drilled", "method")).has(v)}
    assert np.all(six["status"] == OK)
    assert len(np.unique(six["initial_state"], axis=0)) == 18


SECONDS = "simulation: {transient: 2 s, observe: 5 s}\n"
SMALL_STRING = "model: segments\nsegments: {pipe: 2, collar: 2}\nsimulation: {transient: 1 s, observe: 1 s}\n"
BEAM = "model: beam\nbeam: {modes: 3, stations: [{at: 0.1}, {at: 0.5}, {at: 0.9}]}\n"
# A study, and its axes.
SWEPT = {
    "law": (f"{SECONDS}bit: {{friction: {{law: rational}}}}\n", {"bit.friction.b1": ["1.5 s/rad", "3 s/rad"]}),
    "limit": (
        f"{SECONDS}drive: {{kind: stiff, torque_limit: 9 kN m}}\n",
        {"drive.torque_limit": ["2 kN*m", "60 kN*m"]},
    ),
    "options that are off": (
        f"{SECONDS}operation: {{rotary_speed: 5 rad/s}}\n",
        {"well.inclination": ["0 rad", "0.4 rad", "1.2 rad"], "mud.swirl": [0.0, 0.5]},
    ),
    "load of the beam": (f"{BEAM}{SECONDS}", {"beam.axial_load": ["0 kN", "300 kN"]}),
    "lobes": (SMALL_STRING, {"bit.lobes": [1, 3]}),
    "kinds of drives": (f"{SMALL_STRING}initial: {{start: rest}}\n", {"drive.kind": ["soft_torque", "dc_motor"]}),
}


@pytest.mark.parametrize("name", SWEPT)
def test_points_of_a_sweep_have_the_bits_of_runs_of_their_own(name):
    """Also those at which an option is off, and where a run alone has fewer variables:
    there the sweep has none of their values."""
    text, axes = SWEPT[name]
    swept = nsdrill.run(text, set={"sweep": axes})
    assert not np.all(np.ptp(swept.surface_torque_mean.values.ravel()) == 0.0)
    for values in itertools.product(*axes.values()):
        alone = nsdrill.run(text, set=dict(zip(axes, values, strict=True)))
        places = [axes[key].index(value) for key, value in zip(axes, values, strict=True)]
        here = swept.isel(dict(zip((key.replace(".", "_") for key in axes), places, strict=True)))
        for variable in here.data_vars:
            if variable not in alone:
                assert np.all(np.isnan(here[variable])), variable
            elif "state" not in here[variable].dims:
                assert here[variable].values.tobytes() == alone[variable].values.tobytes(), (variable, values)
