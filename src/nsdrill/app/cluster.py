"""Workers of a Dask cluster, as an executor for the engine: the numbers are those of the threads."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from contextlib import contextmanager
from typing import Any

from nsdrill.app.provenance import unlike, versions
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
            yield _Cluster(client), count
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
        for worker, found in client.run(versions, on_error="return").items():
            if differing := _differing(found):
                raise NsdrillError(
                    f"--scheduler: the worker {worker} has other versions, whose numbers may differ ({differing}). "
                    "Nothing has run. Install the same versions everywhere, and start the workers anew.")
        yield _Cluster(client), workers or threads


class _Cluster(Executor):
    """The executor of a client, which on its own would wait for ever for a scheduler that is gone."""

    def __init__(self, client: Any) -> None:
        self._client, self._executor = client, client.get_executor(pure=False)

    def submit(self, function: Callable[..., Any], /, *args: Any, **more: Any) -> Future[Any]:
        future: Future[Any] = self._executor.submit(_compared, versions(), function, *args, **more)
        return future

    def check(self) -> None:
        """NsdrillError where nothing can come any more; the engine asks when nothing has come for a while."""
        if self._client.status == "closed":
            raise NsdrillError(
                "The Dask scheduler is gone. Finished points are safe: look after the cluster, then give the same "
                "command with --resume.")


def _differing(found: Any) -> str:
    """In words, what differs between this process and the one whose :func:`versions` are ``found``, or which could not
    tell them; numpy too, as what goes to and fro holds its arrays."""
    return "; ".join(unlike(found, "numpy_version")) if isinstance(found, dict) else f"it does not tell them: {found}"


def _compared(expected: dict[str, str], function: Callable[..., Any], /, *args: Any, **more: Any) -> Any:
    """The call, in a worker, which may have joined after the others were compared."""
    if differing := _differing(expected):
        raise NsdrillError(f"the worker has other versions ({differing})")
    return function(*args, **more)


def _ignore_interrupts() -> None:
    """A terminal sends Ctrl-C to the workers as well; it is for us to hear it, and to close them in order."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
