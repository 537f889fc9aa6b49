"""Workers of a cluster that die: what they had in hand is computed again, bit for bit;
and not for ever."""

import json
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import Executor, Future
from typing import Any

import numpy as np
import pytest
from same_bits import different

from nsdrill.app.running.cluster import dask_executor
from nsdrill.app.running.run import run_study
from nsdrill.errors import NsdrillError
from nsdrill.store import RunLog, part_path
from nsdrill.study import parse_study
from nsdrill.sweep.engine import MAX_LOSSES
from nsdrill.sweep.work import advance

GRID = """
simulation: {transient: 60 s, observe: 60 s}
record: {peaks: 4}
sweep:
  wob: {from: 10 kN, to: 100 kN, points: 24}
  rotary_speed: {from: 2 rad/s, to: 8 rad/s, points: 60}
"""
CHAINS = GRID.replace("points: 60", "points: 14") + "  procedure: all\n  along: wob\n"


@pytest.mark.parametrize("text", [GRID, CHAINS], ids=["grid", "chains"])
def test_dead_workers_cost_time_only(tmp_path, text, monkeypatch):
    distributed = pytest.importorskip("distributed")
    monkeypatch.setattr("nsdrill.sweep.engine.REMOTE_QUANTUM", 0.1)  # many slices of a short sweep
    text = text.replace("points: 24", "points: 12")
    study = parse_study(text, "s.yaml")
    run_study(study, tmp_path / "whole.h5", workers=2)
    killed = []
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster,
        distributed.Client(cluster) as client,
    ):
        own = os.getpid()

        def kill(progress):
            """Kill a worker after the first slice and after the third."""
            kill.slices += progress.note != "compiling"
            if kill.slices in (1, 3):
                pids = [pid for pid in client.run(os.getpid).values() if pid not in (own, *killed)]
                os.kill(pids[0], signal.SIGKILL)
                killed.append(pids[0])

        kill.slices = 0
        executor = client.get_executor(pure=False)
        run_study(study, tmp_path / "out.h5", workers=2, executor=executor, watch=kill)
    assert len(killed) == 2
    assert not different(tmp_path / "whole.h5", tmp_path / "out.h5")


def test_a_scheduler_that_is_gone_ends_the_run(tmp_path, monkeypatch):
    pytest.importorskip("distributed")
    library = pytest.importorskip("dask")
    monkeypatch.setattr("nsdrill.sweep.engine.POLL_SECONDS", 0.5)
    dask, address = [sys.executable, "-m", "dask"], tmp_path / "address.json"
    more = ["--no-dashboard", "--scheduler-file", str(address)]
    log = (tmp_path / "log").open("w")
    scheduler = subprocess.Popen([*dask, "scheduler", "--port", "0", *more], stderr=log, start_new_session=True)
    worker = subprocess.Popen([*dask, "worker", "--nthreads", "1", *more], stderr=log, start_new_session=True)
    try:
        while not address.exists() or not address.read_text().endswith("}"):
            time.sleep(0.1)
        where = json.loads(address.read_text())["address"]
        for _ in range(1000):
            try:
                with dask_executor(where):
                    break
            except NsdrillError:  # no workers yet
                time.sleep(0.2)

        def kill(progress):
            if scheduler.poll() is None and progress.note != "compiling":
                os.killpg(scheduler.pid, signal.SIGKILL)
                scheduler.wait()

        study, out = parse_study(GRID, "s.yaml"), tmp_path / "out.h5"
        with (
            dask_executor(where) as (executor, workers),
            library.config.set({"distributed.comm.timeouts.connect": "1s"}),
        ):
            executor._client._timeout = 1.0  # s that it tries to connect again, instead of ten
            with pytest.raises(NsdrillError, match=r"scheduler is gone.*are kept.*resume=True"):
                run_study(study, out, workers=workers, executor=executor, watch=kill)
        assert part_path(out).exists()
    finally:
        for process in (scheduler, worker):
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
        log.close()


def test_a_scheduler_that_is_gone_takes_no_task():
    """A client may be closed when lost futures are sent again, before anyone waits."""
    pytest.importorskip("distributed")
    with dask_executor(workers=1) as (executor, _):
        assert executor.submit(abs, -1).result(60) == 1
    with pytest.raises(NsdrillError, match=r"scheduler is gone.*are kept.*resume=True"):
        executor.submit(abs, -1)


class Mortal(Executor):
    """Runs every task here; those whose number is in ``deaths`` die with their
    worker."""

    def __init__(self, deaths: range | set[int]) -> None:
        self.deaths, self.count, self.lock = deaths, 0, threading.Lock()

    def submit(self, function: Any, /, *args: Any, **more: Any) -> Future[Any]:
        future: Future[Any] = Future()
        with self.lock:
            self.count += 1
            dies = self.count in self.deaths
        if dies and self.count % 2:
            future.cancel()
            future.set_running_or_notify_cancel()
        elif dies:
            future.set_exception(RuntimeError("the worker is gone"))
        else:
            # What another process would get: the batch here stays as it is.
            future.set_result(advance(*pickle.loads(pickle.dumps(args))))
        return future


@pytest.mark.parametrize("text", [GRID, CHAINS], ids=["grid", "chains"])
def test_any_slice_may_be_lost(tmp_path, text, monkeypatch):
    monkeypatch.setattr("nsdrill.sweep.engine.REMOTE_QUANTUM", 0.2)
    small = text.replace("points: 24", "points: 4").replace("points: 60", "points: 20")
    study = parse_study(small, "s.yaml")
    run_study(study, tmp_path / "whole.h5", workers=2)
    run_study(study, tmp_path / "out.h5", workers=2, executor=Mortal({1, 2, 4, 7, 8}))
    assert not different(tmp_path / "whole.h5", tmp_path / "out.h5")


def test_a_cluster_that_only_dies_is_given_up(tmp_path, monkeypatch):
    # Slices of so many packed steps, however fast the machine is.
    monkeypatch.setattr("nsdrill.sweep.engine.REMOTE_QUANTUM", 1e-9)
    monkeypatch.setattr("nsdrill.kernel.batch.STEPS_PER_CALL", 8000)
    small = GRID.replace("points: 24", "points: 4").replace("points: 60", "points: 20")
    study, out = parse_study(small, "s.yaml"), tmp_path / "out.h5"
    mortal = Mortal(range(8, 10**6))
    with pytest.raises(NsdrillError, match=r"lost 11 times with its worker .*are kept.*resume=True"):
        run_study(study, out, workers=1, lanes=8, executor=mortal)
    assert mortal.count == 7 + MAX_LOSSES + 1
    with RunLog.open(part_path(out)) as log:
        done = int(np.count_nonzero(log.done()))
    assert 0 < done < 80
    assert run_study(study, out, resume=True).already == done
    run_study(study, tmp_path / "whole.h5")
    assert not different(tmp_path / "whole.h5", out)
