"""A batch: slots, queue, statuses; the control of the step; the same numbers without
compilation."""

import json
import math
import os
import pickle
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from machine_code import of_numbers
from model_tables import FEATURES
from reference import Case
from sweep.runs import collect, finish, run_from, same_bits, work_for

from kernel.motions import BOUNCING, RUBBING, SMOOTH, scaled_error, start_of
from nsdrill.abi import LIMIT, NONFINITE, NOTHING, UNDERFLOW
from nsdrill.compiler.functions import inlined
from nsdrill.kernel import batch as batch_module
from nsdrill.kernel.batch import widened
from nsdrill.kernel.settings import Simulation
from nsdrill.kernel.steppers import decide
from nsdrill.sweep.work import compiled_parts
from nsdrill.variables import DIVERGED, OK, STEP_LIMIT

BRIEF = Simulation(transient=1.0, observe=2.0)
SPEEDS = np.linspace(1.0, 9.0, 13)


def test_an_empty_batch_is_idle_and_gives_nothing():
    work = work_for(Case(), BRIEF)
    batch = work.new_batch(8, 4)
    assert batch.idle
    assert batch.free == 4
    assert len(batch.advance(compiled_parts(8, work.program), 0.01, True).job) == 0


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


def test_the_first_step_is_that_which_was_asked_for_and_the_next_one_no_longer():
    """Nothing is known of its error before: 1 us and 1 us more of 3, and not 2."""
    work = work_for(Case(), Simulation(transient=0.0, observe=3e-6))
    batch, runs = work.new_batch(8, 8), work.prepare(np.arange(1))
    batch.add_many(np.arange(1), replace(runs, first_step=np.array([1e-6]), halves=np.array([0.0])))
    assert [done.accepted.tolist() for done in finish(work, batch)] == [[3]]


def test_four_registers_to_a_row_where_steps_wait_for_themselves(monkeypatch):
    """With implicit friction, with runs for all lanes, in a cache that nearly holds them;
    unless the user has chosen."""
    monkeypatch.delenv("NSDRILL_LANES", raising=False)
    rows = {method: work_for(Case(), replace(BRIEF, method=method)).program.rows for method in ("explicit", "implicit")}
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
    parts, done, left = compiled_parts(8, work.program), [], list(range(13))
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
    done, parts = [], compiled_parts(8, work.program)
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


def test_marks_change_a_run_by_no_more_than_its_tolerance():
    """The window's marks cut steps; the state at the end differs by the tolerance, the
    steps by a few."""
    start = start_of(SMOOTH)[None]
    one = run_from(work_for(SMOOTH, Simulation(0.0, 6.0, rtol=1e-9)), start)
    other = run_from(work_for(SMOOTH, Simulation(5.0, 1.0, rtol=1e-9)), start)
    assert other["final_state"][0] == pytest.approx(one["final_state"][0], rel=1e-6, abs=1e-9)
    assert abs(int(one["steps"][0]) - int(other["steps"][0])) < 10


PROPORTIONAL, PER_ORDER = 0.17, 0.2


@inlined
def of_one_pair(squared_error, step, last_level, growth, least_step, exhausted):
    """With the numbers of a pair of order 5."""
    accepted, proposed, level, next_growth, attention = decide(
        squared_error, step, last_level, growth, least_step, exhausted > 0.0, 0.17, 0.2
    )
    return 1.0 if accepted else 0.0, proposed, level, next_growth, float(attention)


@pytest.fixture(scope="module")
def decided():
    return of_numbers(of_one_pair, 5)


@pytest.mark.parametrize(("error", "before"), [(0.9, 0.9), (0.5, 0.01), (0.2, 0.8), (0.02, 0.3)])
def test_the_next_step_is_that_of_the_two_last_errors(decided, error, before):
    accepted, step, level, growth, attention = decided(error**2, 0.01, 2 * math.log2(before), 3.0, 1e-9, 0.0)
    assert accepted
    assert attention == NOTHING
    assert step == pytest.approx(0.01 * 0.9 * error**-PROPORTIONAL * before**0.04, rel=1e-12)
    assert level == pytest.approx(2 * math.log2(error), rel=1e-12)
    assert growth == 3.0


def test_a_rejected_step_is_shrunk_by_its_own_error(decided):
    accepted, step, level, growth, attention = decided(4.0**2, 0.01, -1.0, 3.0, 1e-9, 0.0)
    assert not accepted
    assert step == pytest.approx(0.01 * 0.9 * 4.0**-PER_ORDER, rel=1e-12)
    assert (level, growth, attention) == (-1.0, 0.0, NOTHING)  # of the last accepted one; no growth after it


def test_the_step_changes_within_bounds(decided):
    """To an eighth and to eight times, and not above itself after a rejection."""
    assert decided(0.0, 0.01, -10.0, 3.0, 1e-9, 0.0)[1] == pytest.approx(0.08, rel=1e-12)
    assert decided(0.0, 0.01, -10.0, 0.0, 1e-9, 0.0)[1] == pytest.approx(0.01, rel=1e-12)
    for error in (1e15, math.inf, math.nan):
        assert decided(error, 0.01, -10.0, 3.0, 1e-9, 0.0)[1] == pytest.approx(0.01 / 8, rel=1e-12)


def test_what_asks_for_attention(decided):
    for error, least, exhausted, found in (
        (1e6, 0.01, 0.0, UNDERFLOW),
        (math.nan, 0.01, 0.0, NONFINITE),
        (0.5, 1e-9, 1.0, LIMIT),
        (0.5, 1.0, 0.0, NOTHING),
    ):
        assert decided(error, 0.01, -1.0, 3.0, least, exhausted)[4] == found


TESTS = str(Path(__file__).parents[1])


PLAIN = """
import json, sys
sys.path.insert(0, {tests!r})
from kernel.test_batch import few_steps
print(json.dumps(few_steps()))
"""


def few_steps() -> list[list[float]]:
    """State, steps and rejected of 50 ms of three motions, some steps of each, and what
    is measured of them."""
    found = []
    for case in (SMOOTH, BOUNCING, RUBBING):
        out = run_from(work_for(case, Simulation(0.0, 0.05, rtol=1e-8)), start_of(case)[None])
        found.append([*out["final_state"][0].tolist(), int(out["steps"][0]), int(out["rejected"][0])])
        found[-1] += [float(out[name][0]) for name in FEATURES]
    return found


def test_plain_python_takes_the_same_steps():
    """NUMBA_DISABLE_JIT=1: the whole kernel interpreted, so that coverage can look at
    it. Equal to rounding.

    The fused multiply-add rounds twice there. Some ten roundings of 1e-16 in each of up
    to sixty steps, in units of the natural scales, which are a tenth of the states:
    below 1e-12. Before the impact of the third motion the estimated error is little
    more than rounding, so the steps differ in length, and the error that the impact
    makes depends on where it falls in a step: equal to the tolerance only.
    """
    done = subprocess.run(
        [sys.executable, "-c", PLAIN.format(tests=TESTS)],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        check=True,
    )
    assert not done.stderr  # no warnings of numpy's numbers
    cases = ((SMOOTH, 1e-12), (BOUNCING, 1e-12), (RUBBING, 1e-8))
    for (case, bound), mine, plain in zip(cases, few_steps(), json.loads(done.stdout), strict=True):
        assert mine[9:11] == plain[9:11]
        assert mine[11:] == pytest.approx(plain[11:], rel=100 * bound, abs=100 * bound, nan_ok=True)
        assert 2 <= mine[9] < 60
        assert scaled_error(case, np.array(mine[:8]), np.array(plain[:8])) < bound
