"""A batch: slots, queue, statuses. What the numbers are is tested with the engine."""

import pickle
from dataclasses import replace

import numpy as np
import pytest
from reference import Case
from sweep.runs import collect, finish, run_from, same_bits, work_for

from kernel.motions import BOUNCING, RUBBING, SMOOTH, start_of
from nsdrill.kernel import batch as batch_module
from nsdrill.kernel.batch import widened
from nsdrill.kernel.settings import Simulation
from nsdrill.sweep.work import compiled_parts
from nsdrill.variables import DIVERGED, OK, STEP_LIMIT

BRIEF = Simulation(transient=1.0, observe=2.0)
SPEEDS = np.linspace(1.0, 9.0, 13)


def test_an_empty_batch_is_idle_and_gives_nothing():
    work = work_for(Case(), BRIEF)
    batch = work.new_batch(8, 4)
    assert batch.idle
    assert batch.free == 4
    assert len(batch.advance(compiled_parts(8, work.variant), 0.01, True).job) == 0


def test_slots_are_taken_and_given_back():
    work = work_for(Case(), BRIEF, rotary_speed=SPEEDS)
    batch = work.new_batch(8, 20)
    points = np.arange(13)
    batch.add_many(points, work.prepare(points))
    assert batch.free == 7
    assert not batch.idle
    done = finish(work, batch)
    assert batch.free == 20
    assert batch.idle
    assert batch.waiting == 0
    assert sorted(np.concatenate([d.job for d in done]).tolist()) == points.tolist()


def test_more_runs_than_slots_are_refused():
    work = work_for(Case(), BRIEF, rotary_speed=SPEEDS)
    batch = work.new_batch(8, 12)
    with pytest.raises(ValueError, match="13 runs for 12 free slots"):
        batch.add_many(np.arange(13), work.prepare(np.arange(13)))


def test_steps_tried_are_accepted_and_rejected_ones():
    work = work_for(Case(), BRIEF, rotary_speed=SPEEDS)
    batch = work.new_batch(8, 13)
    batch.add_many(np.arange(13), work.prepare(np.arange(13)))
    done = finish(work, batch)
    assert batch.lane_steps == sum(int(np.sum(d.accepted + d.rejected)) for d in done)
    assert batch.lane_steps <= 8 * batch.packed_steps


def test_four_registers_to_a_row_where_steps_wait_for_themselves(monkeypatch):
    """With implicit friction, with runs for all lanes, in a cache that nearly holds them;
    unless the user has chosen."""
    monkeypatch.delenv("NSDRILL_LANES", raising=False)
    rows = {method: work_for(Case(), replace(BRIEF, method=method)).variant.rows for method in ("explicit", "implicit")}
    needed = rows["implicit"].total * 32 * 8
    for cache, lanes in ((needed, 32), (needed // 2, 16), (0, 16)):
        monkeypatch.setattr(batch_module, "first_level_cache", lambda cache=cache: cache)
        assert widened(16, 1000, rows["implicit"]) == lanes
    monkeypatch.setattr(batch_module, "first_level_cache", lambda: needed)
    assert widened(16, 1000, rows["explicit"]) == 16
    assert widened(16, 40, rows["implicit"]) == 16
    assert widened(8, 1000, rows["implicit"]) == 8
    monkeypatch.setenv("NSDRILL_LANES", "16")
    assert widened(16, 1000, rows["implicit"]) == 16


def test_lanes_are_refilled_at_once():
    """Runs that differ tenfold in length: with fixed blocks of eight, lanes would idle
    half of the time."""
    work = work_for(Case(), Simulation(transient=5.0, observe=5.0), rotary_speed=np.tile(SPEEDS, 10))
    batch = work.new_batch(8, 130)
    batch.add_many(np.arange(130), work.prepare(np.arange(130)))
    done = finish(work, batch)
    steps = np.concatenate([d.accepted + d.rejected for d in done])
    assert np.max(steps) > 3 * np.min(steps)
    assert batch.lane_steps > 0.85 * 8 * batch.packed_steps


def test_a_refilled_slot_keeps_nothing_of_its_last_run():
    """A batch with one slot more than lanes, used over and over, gives the bits of one
    with room for all."""
    work = work_for(Case(), BRIEF, rotary_speed=SPEEDS)
    batch = work.new_batch(8, 9)
    parts, done, left = compiled_parts(8, work.variant), [], list(range(13))
    while left or not batch.idle:
        points = np.array([left.pop(0) for _ in range(min(batch.free, len(left)))], dtype=np.int64)
        if len(points):
            batch.add_many(points, work.prepare(points))
        done.append(batch.advance(parts, 0.0, False))
    assert same_bits(collect(work, done), run_from(work, work.prepare(np.arange(13)).initial))


def test_a_batch_goes_on_after_a_journey_to_another_process():
    """Pickled in the middle of its work, as a remote executor does."""
    work = work_for(Case(), Simulation(transient=50.0, observe=50.0), rotary_speed=SPEEDS)
    batch = work.new_batch(8, 13)
    batch.add_many(np.arange(13), work.prepare(np.arange(13)))
    done, parts = [], compiled_parts(8, work.variant)
    while not batch.idle:
        batch = pickle.loads(pickle.dumps(batch))
        assert batch._buffer.ctypes.data % 64 == 0
        done.append(batch.advance(parts, 0.0, True))
    assert len(done) > 2
    assert same_bits(collect(work, done), run_from(work, work.prepare(np.arange(13)).initial))


def test_a_velocity_that_overflows_is_divergence():
    work = work_for(Case(), BRIEF, rotary_speed=[3.0, 4.0])
    states = work.prepare(np.arange(2)).initial
    states[0, 5] = np.inf
    out = run_from(work, states)
    assert out["status"].tolist() == [DIVERGED, OK]
    assert out["steps"][0] == 0


def test_the_limit_counts_rejected_steps_too():
    limit = 150
    work = work_for(RUBBING, Simulation(transient=0.0, observe=20.0, max_steps=limit))
    out = run_from(work, start_of(RUBBING)[None])
    assert out["status"][0] == STEP_LIMIT
    assert out["steps"][0] + out["rejected"][0] == limit
    assert out["rejected"][0] > 0


def test_a_run_ends_on_time():
    """Marks at the opening, the middle and the end of the window cut steps: the end is
    met exactly."""
    for case in (SMOOTH, BOUNCING, RUBBING):
        out = run_from(work_for(case, Simulation(0.3, 1.7)), start_of(case)[None])
        assert out["final_state"][0, 8] == case.speed * 2.0


def test_marks_change_a_run_by_no_more_than_its_tolerance():
    """The window's marks cut steps; the state at the end differs by the tolerance, the
    steps by a few."""
    start = start_of(SMOOTH)[None]
    one = run_from(work_for(SMOOTH, Simulation(0.0, 6.0, rtol=1e-9)), start)
    other = run_from(work_for(SMOOTH, Simulation(5.0, 1.0, rtol=1e-9)), start)
    assert other["final_state"][0] == pytest.approx(one["final_state"][0], rel=1e-6, abs=1e-9)
    assert abs(int(one["steps"][0]) - int(other["steps"][0])) < 10
