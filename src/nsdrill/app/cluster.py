"""Workers of a Dask cluster, as an executor for the engine: the numbers are those of the threads."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager

from nsdrill.app.run import processors
from nsdrill.errors import InputError, NsdrillError

CONNECT_SECONDS = 10


@contextmanager
def dask_executor(scheduler: str | None = None, workers: int | None = None) -> Iterator[tuple[Executor, int]]:
    """An executor on the cluster of the scheduler at this address, or on a cluster made on this machine for as long as
    it is needed; and how many runs go side by side on it (``workers``, or as many as it has threads)."""
    try:
        from distributed import Client, LocalCluster
    except ImportError as error:
        raise InputError(
            "--engine dask: the package `distributed` is not installed. Install it with pip install 'nsdrill[dask]', "
            "or use --engine threads."
        ) from error
    if scheduler is None:
        count = workers or processors()
        cluster = LocalCluster(n_workers=count, threads_per_worker=1, dashboard_address=None)
        with cluster, Client(cluster) as client:
            client.run(_ignore_interrupts)
            yield client.get_executor(pure=False), count
        return
    try:
        client = Client(scheduler, timeout=CONNECT_SECONDS)
    except ValueError as error:
        found = f"{scheduler!r} ({error})"
        raise InputError(f"--scheduler: found {found}; allowed: an address as tcp://host:8786.") from error
    except OSError as error:
        raise NsdrillError(
            f"--scheduler: no Dask scheduler answers at {scheduler} within {CONNECT_SECONDS} s. Nothing has run. Is it "
            "running, and can this machine reach it?"
        ) from error
    with client:
        threads = sum(client.nthreads().values())
        if threads == 0:
            raise NsdrillError(f"--scheduler: the Dask scheduler at {scheduler} has no workers. Nothing has run.")
        yield client.get_executor(pure=False), workers or threads


def _ignore_interrupts() -> None:
    """A terminal sends Ctrl-C to the workers as well; it is for us to hear it, and to close them in order."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
