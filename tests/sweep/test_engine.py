"""The engine: the same bits whatever the lanes, the workers and the slices; chains;
failures; interrupts."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest
from model_tables import FEATURES, PEAKS, VARIABLES
from reference import Case

from nsdrill.kernel.settings import Simulation
from nsdrill.models.christoforou_yigit.parameters import Initial
from nsdrill.models.contents import Contents
from nsdrill.observe.thresholds import Record
from nsdrill.sweep.engine import ChainStarts, Engine, Progress
from nsdrill.sweep.work import Work
from nsdrill.variables import DIVERGED, OK, STEP_LIMIT, STEP_UNDERFLOW
from sweep.runs import SHORT, collect, finish, run_from, run_work, same_bits, work_for

# from stick-slip to rolling on the wall: run lengths differ tenfold
SPEEDS = np.linspace(1.0, 9.0, 11)
GRID = work_for(Case(), SHORT, rotary_speed=SPEEDS, wob=[22.24e3, 66.72e3])


@pytest.fixture(scope="module")
def grid():
    return run_work(GRID, lanes=8)


def test_all_points_get_all_variables(grid):
    assert set(grid) == {
        variable.name for variable in VARIABLES if Contents(peaks=32, options=("drilled", "method")).has(variable)
    }
    assert np.all(grid["status"] == OK)
    always = set(FEATURES) - {"stick_slip_period"}  # of three cycles or more
    assert all(np.all(np.isfinite(grid[name])) for name in always)
    assert np.ptp(grid["steps"]) > 1000, "the runs are to differ in length"


@pytest.mark.parametrize(
    ("lanes", "workers", "quantum_seconds"), [(1, 1, 0.25), (16, 1, 0.25), (8, 2, 0.001), (1, 2, 0.02)]
)
def test_numbers_do_not_depend_on_lanes_workers_or_slices(grid, lanes, workers, quantum_seconds):
    assert same_bits(run_work(GRID, lanes, workers, quantum_seconds), grid)


def test_numbers_do_not_depend_on_the_neighbours_or_the_order(grid):
    backwards = run_work(GRID, 8, pending=np.arange(GRID.plan.points)[::-1])
    assert same_bits(backwards, grid)


def test_only_pending_points_are_run(grid):
    some = np.array([3, 17, 4])
    out = run_work(GRID, 8, pending=some)
    assert np.flatnonzero(out["status"] == OK).tolist() == [3, 4, 17]
    assert all(out[name][some].tobytes() == grid[name][some].tobytes() for name in grid)


CHAINS = {
    procedure: work_for(
        Case(),
        replace(SHORT, transient=2.0, observe=4.0),
        procedure=procedure,
        along="rotary_speed",
        rotary_speed=SPEEDS,
        wob=[22.24e3, 44e3, 66.72e3],
    )
    for procedure in ("up", "down", "up-down", "all")
}


@pytest.mark.parametrize("procedure", list(CHAINS))
def test_chains_have_the_same_bits_for_any_lanes_and_workers(procedure):
    work = CHAINS[procedure]
    first = run_work(work, 8)
    assert np.all(first["status"] == OK)
    assert same_bits(run_work(work, 1, 2, 0.001), first)
    assert same_bits(run_work(work, 8, 2, 0.01), first)


@pytest.mark.parametrize("procedure", list(CHAINS))
def test_a_chain_is_a_sequence_of_single_runs(procedure):
    """Each from the state that the one before reached, the drive angle going on: bit
    for bit."""
    work = CHAINS[procedure]
    out = run_work(work, 8)
    plan = work.plan
    for chain in range(plan.chains):
        state = None
        for place in range(int(plan.lengths(chain))):
            point = plan.points_of(chain, place)[None]
            runs = work.prepare(point)
            batch = work.new_batch(8, 1)
            batch.add(point, runs if state is None else replace(runs, initial=state[None]))
            single = collect(work, finish(work, batch))
            assert all(single[n][0].tobytes() == out[n][point[0]].tobytes() for n in single), (chain, place)
            state = single["final_state"][0]


def test_up_down_and_same_of_one_sweep_have_the_bits_of_sweeps_of_their_own():
    found = run_work(CHAINS["all"], 8, 2, 0.01)
    both = CHAINS["up-down"]
    alone = replace(both, plan=replace(both.plan, procedure="same", along=None))
    for name, values in run_work(both, 8).items():
        assert found[name].tobytes() == np.concatenate([values, run_work(alone, 8)[name]]).tobytes(), name


def test_the_drive_angle_goes_on_along_a_chain():
    work = CHAINS["up"]
    out = run_work(work, 8)
    points = work.plan.points_of(1, np.arange(work.plan.chain_length))
    angles = out["final_state"][points, 8]
    assert angles == pytest.approx(np.cumsum(SPEEDS * 6.0), rel=1e-14)
    assert np.array_equal(out["initial_state"][points[1:]], out["final_state"][points[:-1]])


def test_a_long_chain_is_handed_over_in_segments_without_a_seam():
    """150 points: more than two segments of the engine."""
    work = work_for(
        Case(),
        Simulation(transient=0.5, observe=0.5),
        procedure="up-down",
        along="depth",
        depth=np.linspace(1000, 3000, 75),
    )
    out = run_work(work, 1)
    points = work.plan.points_of(0, np.arange(150))
    assert np.array_equal(out["initial_state"][points[1:]], out["final_state"][points[:-1]])
    assert same_bits(run_work(work, 8, 2, 0.001), out)


def test_many_long_chains_take_turns_in_a_batch():
    """More chains than a batch has room for, whose segments end one after the other:
    each finds its place again."""
    work = work_for(
        Case(),
        Simulation(transient=5.0, observe=5.0),
        procedure="up",
        along="depth",
        depth=np.linspace(1000, 3000, 140),
        wob=np.linspace(20e3, 90e3, 10),
    )
    out = run_work(work, 2, 1, 0.001)
    assert np.all(out["status"] == OK)
    assert same_bits(run_work(work, 8, 2, 0.001), out)


def test_segments_are_short_where_the_results_of_a_run_are_large():
    """With many returns to the section few runs fit into a batch; all its lanes shall
    have work all the same."""
    work = work_for(
        Case(),
        Simulation(transient=0.5, observe=0.5),
        procedure="up",
        along="depth",
        depth=np.linspace(1000, 3000, 75),
        wob=np.linspace(20e3, 40e3, 10),
    )
    few = replace(work, record=replace(work.record, poincare=4000))
    batch = few.new_batch(8, 1024)
    assert batch.slots < 1024
    out = run_work(few, 8, 1, 0.001)
    assert same_bits(
        {name: out[name] for name in ("status", "final_state", "axial_max")},
        {name: run_work(work, 8)[name] for name in ("status", "final_state", "axial_max")},
    )


def test_a_chain_goes_on_from_a_stored_state():
    """Resuming: start a chain in its middle from the state the point before has
    reached."""
    work = CHAINS["up-down"]
    whole = run_work(work, 8)
    plan = work.plan
    starts = ChainStarts(
        np.arange(3), np.array([5, 0, 21]), lambda chain, place: whole["final_state"][plan.points_of(chain, place - 1)]
    )
    out = run_work(work, 8, starts=starts)
    ran = out["status"] == OK
    assert np.count_nonzero(ran) == (22 - 5) + 22 + 1
    assert all(out[name][ran].tobytes() == whole[name][ran].tobytes() for name in whole)


def test_a_run_that_reaches_its_limit_of_steps_says_so_and_leaves_its_neighbours_alone(grid):
    """The limit lies between the shortest and the longest run."""
    tried = grid["steps"] + grid["rejected"]
    limit = int(np.median(tried))
    out = run_work(replace(GRID, simulation=replace(SHORT, max_steps=limit)), 8)
    over = tried > limit
    assert np.all(out["status"][over] == STEP_LIMIT)
    assert np.all(out["status"][~over] == OK)
    assert np.all((out["steps"] + out["rejected"])[over] == limit)
    assert all(out[name][~over].tobytes() == grid[name][~over].tobytes() for name in grid)
    for name in FEATURES + PEAKS:
        assert np.all(np.isnan(out[name][over])), name
    assert not out["response"][over].any()


@pytest.mark.parametrize("lanes", [1, 8])
def test_a_run_that_blows_up_is_marked_and_leaves_its_neighbours_alone(grid, lanes):
    """Every third run starts with an infinite or absurd velocity."""
    points = np.arange(GRID.plan.points)
    states = GRID.prepare(points).initial
    bad = points % 3 == 1
    states[bad, 3] = np.where(points[bad] % 2, np.inf, 1e200)
    out = run_from(GRID, states, lanes)
    assert np.all(np.isin(out["status"][bad], [DIVERGED, STEP_UNDERFLOW]))
    assert np.any(out["status"] == DIVERGED)
    assert np.all(out["status"][~bad] == OK)
    assert all(out[name][~bad].tobytes() == grid[name][~bad].tobytes() for name in grid)


def test_nan_in_a_state_is_divergence():
    work = work_for(Case())
    states = work.prepare(np.array([0])).initial
    states[0, 1] = np.nan
    assert run_from(work, states)["status"][0] == DIVERGED


def test_a_chain_goes_on_after_a_failed_point_from_the_study_s_initial_state():
    """Rolling on the wall needs many steps: at high speed the run reaches its limit."""
    work = work_for(
        Case(), replace(SHORT, max_steps=2000), procedure="up-down", along="rotary_speed", rotary_speed=SPEEDS
    )
    out = run_work(work, 8)
    points = work.plan.points_of(0, np.arange(work.plan.chain_length))
    status = out["status"][points]
    assert np.any(status == STEP_LIMIT)
    assert np.any(status == OK)
    fresh = work.prepare(points).initial
    for place in range(1, len(points)):
        expected = out["final_state"][points[place - 1]] if status[place - 1] == OK else fresh[place]
        assert np.array_equal(out["initial_state"][points[place]], expected), place
    assert same_bits(run_work(work, 1), out)


def test_no_peaks_may_be_kept(grid):
    out = run_work(replace(GRID, record=Record(peaks=0)), 8)
    assert out["axial_peaks"].shape == (GRID.plan.points, 0)
    assert all(out[name].tobytes() == grid[name].tobytes() for name in grid if name not in PEAKS)


def test_without_a_transient_the_window_opens_at_once():
    work = work_for(Case(), Simulation(transient=0.0, observe=3.0), initial=Initial(x=0.02), rotary_speed=SPEEDS)
    out = run_work(work, 8)
    assert np.all(out["status"] == OK)
    assert np.all(out["radius_max"] >= 0.02 * (1 - 1e-12))
    assert same_bits(run_work(work, 1), out)


def test_hertz_runs_beside_linear_ones():
    work = work_for(Case(wall_law="hertz", wall_stiffness=1e8), SHORT, rotary_speed=SPEEDS)
    out = run_work(work, 8)
    assert np.any(out["wall_contact_fraction"] > 0)
    assert same_bits(run_work(work, 1), out)


class _Interrupting:
    """Watches like a user who presses Ctrl-C once some points are there."""

    def __init__(self, after: int) -> None:
        self.after = after

    def __call__(self, progress: Progress) -> None:
        if progress.done >= self.after:
            raise KeyboardInterrupt


def interrupted(work: Work, workers: int, after: int) -> dict[int, bytes]:
    found: dict[int, bytes] = {}

    def deliver(points: np.ndarray, columns: dict[str, np.ndarray]) -> None:
        for i, point in enumerate(points.tolist()):
            assert point not in found
            found[point] = columns["final_state"][i].tobytes()

    with ThreadPoolExecutor(workers) as threads, pytest.raises(KeyboardInterrupt):
        Engine(work, threads, workers, 8, deliver, _Interrupting(after), quantum_seconds=0.002).run()
    return found


@pytest.mark.parametrize("workers", [1, 2])
def test_an_interrupt_delivers_what_is_finished(workers):
    work = work_for(Case(), replace(SHORT, observe=30.0), rotary_speed=np.linspace(1, 9, 200))
    found = interrupted(work, workers, after=5)
    assert 5 <= len(found) < 200
    rest = np.setdiff1d(np.arange(200), list(found))
    whole, later = run_work(work, 8), run_work(work, 8, pending=rest)
    for point, state in found.items():
        assert state == whole["final_state"][point].tobytes()
    assert later["final_state"][rest].tobytes() == whole["final_state"][rest].tobytes()


def test_an_interrupt_delivers_all_slices_under_way():
    """Also those of many workers, and also when the watcher insists."""
    work = work_for(Case(), replace(SHORT, observe=30.0), rotary_speed=np.linspace(1, 9, 200))
    ended = []

    class Counting(ThreadPoolExecutor):
        def submit(self, function, *args):
            def counted():
                batch, done = function(*args)
                ended.extend(done.job.tolist())
                return batch, done

            return super().submit(counted)

    delivered = []
    with Counting(4) as threads, pytest.raises(KeyboardInterrupt):
        Engine(
            work,
            threads,
            4,
            8,
            lambda points, columns: delivered.extend(points.tolist()),
            _Interrupting(1),
            quantum_seconds=0.05,
        ).run()
    assert sorted(delivered) == sorted(ended)


def test_an_interrupt_of_chains_leaves_whole_beginnings():
    """What is delivered of each chain is its beginning, without holes: so it can be
    taken up again."""
    work = work_for(
        Case(),
        Simulation(transient=1.0, observe=2.0),
        procedure="up",
        along="rotary_speed",
        rotary_speed=np.linspace(1, 9, 100),
        wob=np.linspace(2e4, 6e4, 9),
    )
    found = interrupted(work, 2, after=50)
    for chain in range(work.plan.chains):
        done = [int(p) in found for p in work.plan.points_of(chain, np.arange(100))]
        assert done == sorted(done, reverse=True)


def test_progress_counts_points_and_failures():
    seen = []
    work = replace(GRID, simulation=replace(SHORT, max_steps=3000))
    with ThreadPoolExecutor(1) as threads:
        final = Engine(
            work,
            threads,
            1,
            8,
            lambda points, columns: None,
            lambda progress: seen.append((progress.done, progress.failed)),
            0.002,
        ).run()
    assert final.done == final.total == GRID.plan.points
    assert final.before == 0
    assert 0 < final.failed < final.total
    assert seen == sorted(seen)
    assert final.lane_steps > 0


def test_a_failing_executor_is_not_swallowed():
    class Broken(ThreadPoolExecutor):
        def submit(self, *args, **kwargs):
            return super().submit(lambda: 1 / 0)

    with Broken(1) as threads, pytest.raises(ZeroDivisionError):
        run_work(GRID, 8, executor=threads)
