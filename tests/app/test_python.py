"""Sweeps run from Python: the same bits however they are run, interrupts, and what is
refused before it begins."""

import subprocess
import sys

import numpy as np
import pytest
from same_bits import different

import nsdrill
from nsdrill.app.running.run import Interrupted, run_study
from nsdrill.store import read_results


@pytest.mark.parametrize("workers", [1, 2, 5])
@pytest.mark.parametrize("name", ["small", "map"])
def test_workers_and_lanes_change_no_bit(shared, tmp_path, name, workers):
    study = nsdrill.load_study(shared / f"{name}.yaml")
    run_study(study, tmp_path / "out.h5", workers=workers, lanes=1)
    assert not different(tmp_path / "out.h5", shared / f"{name}.h5")


def test_interrupt_while_the_results_are_written(small, tmp_path, monkeypatch):
    def interrupt(path, log):
        raise KeyboardInterrupt

    study = nsdrill.load_study(small)
    with monkeypatch.context() as patch:
        patch.setattr("nsdrill.app.running.run.write_results", interrupt)
        with pytest.raises(Interrupted) as stop:
            run_study(study, tmp_path / "out.h5")
    assert stop.value.done == stop.value.total == 16
    assert run_study(study, tmp_path / "out.h5", resume=True).already == 16


def test_dask_that_is_not_installed(monkeypatch):
    from nsdrill.app.running.cluster import dask_executor

    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(nsdrill.InputError, match=r"pip install 'nsdrill\[dask\]'"), dask_executor():
        pass


def test_a_carried_chain_hands_on_its_state(shared):
    results = read_results(shared / "small.h5")
    initial, final = results["initial_state"], results["final_state"]
    assert np.array_equal(initial[0, 0, 0, 1:], final[0, 0, 0, :-1])  # up
    assert np.array_equal(initial[1, 0, 0, -1], final[0, 0, 0, -1])  # the turn
    assert np.array_equal(initial[1, 0, 0, :-1], final[1, 0, 0, 1:])  # down


def test_importing_nsdrill_is_cheap():
    code = "import sys, nsdrill; print([m for m in ('numba', 'h5py', 'numpy', 'pint') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"
    assert set(nsdrill.__all__) <= set(dir(nsdrill))
    assert all(getattr(nsdrill, name) is not None for name in nsdrill.__all__)
    with pytest.raises(AttributeError, match="no attribute 'lod_study'"):
        nsdrill.lod_study  # noqa: B018


HUGE = """
sweep:
  depth: {from: 1 km, to: 3 km, points: 204}
  wob: {from: 1 kN, to: 9 kN, points: 204}
  rotary_speed: {from: 1 rad/s, to: 9 rad/s, points: 204}
"""


def test_a_sweep_too_large_for_the_memory_is_refused_before_it_begins(tmp_path, monkeypatch):
    # 204^3 points: 340 MB at 40 bytes, beside 300 MB, and 9 GB at the 1100 bytes of a record
    study = nsdrill.load_study(HUGE)
    monkeypatch.setattr("nsdrill.app.check.memory_free", lambda: 5e8)
    with pytest.raises(
        nsdrill.InputError, match="8 489 664 points, which takes 640 MB of memory; allowed: up to 500 MB"
    ):
        nsdrill.run(study, tmp_path / "out.h5")
    assert not list(tmp_path.iterdir())
    monkeypatch.setattr("nsdrill.app.check.memory_free", lambda: 7e8)
    with pytest.raises(nsdrill.InputError, match="Give the name of a results file"):
        nsdrill.run(study)


def test_very_many_runs_are_asked_for(tmp_path, monkeypatch):
    class Begun(Exception):
        pass

    def begin(*inputs, **more):
        raise Begun

    monkeypatch.setattr("nsdrill.app.running.run.RunLog.create", begin)
    most = {"sweep.depth.points": 2, "sweep.wob.points": 1001, "sweep.rotary_speed.points": 500}
    few = {**most, "sweep.wob.points": 1000}
    out = tmp_path / "out.h5"
    # 1001000 * 500 s / (2 processors * 1e5 s/s * 3600 s/h) = 0.695 h; 3e8 + 40 * 1001000 bytes
    cost = (
        r"found a sweep: 1 001 000 runs of 500 s, which take roughly 0.7 hours on 2 processors, up to "
        r"1.1\d GB on the disk and 340 MB of memory; allowed: up to 1 000 000 runs, .*: large=True"
    )
    monkeypatch.setattr("nsdrill.app.check.memory_free", lambda: 1e12)
    for path in (out, None):
        with pytest.raises(nsdrill.InputError, match=cost if path else "of memory for the results"):
            nsdrill.run(nsdrill.load_study(HUGE, most), path, workers=2)
    for changes in ({"set": most, "large": True}, {"set": few}):
        with pytest.raises(Begun):
            nsdrill.run(nsdrill.load_study(HUGE), out, **changes)


@pytest.mark.parametrize("procedure", ["up", "down", "up-down"])
def test_where_chains_go_on_however_they_are_looked_at(procedure, monkeypatch):
    from nsdrill.app.running import stages
    from nsdrill.sweep.plan import Plan

    axes = {"depth": np.array([1e3]), "wob": np.arange(1.0, 6.0), "rotary_speed": np.arange(1.0, 8.0)}
    plan = Plan(axes, procedure, "wob")
    pending, length = np.ones(plan.points, bool), plan.chain_length
    wanted = np.arange(plan.chains) * 2 % (length + 1)
    for chain, place in enumerate(wanted):
        pending[plan.points_of(chain, np.arange(place))] = False
    for block in (1, 3, length, 2 * length, 1000):
        monkeypatch.setattr(stages, "_BLOCK", block)
        assert stages._first_pending(plan, pending, np.arange(plan.chains)).tolist() == wanted.tolist()
