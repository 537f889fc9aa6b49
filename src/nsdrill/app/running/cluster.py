"""Workers of a Dask cluster as an executor for the engine, with the same numbers as
threads."""

from __future__ import annotations

import logging
import os
import signal
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from contextlib import AbstractContextManager, contextmanager, nullcontext
from typing import TYPE_CHECKING, ParamSpec, TypeVar

from nsdrill.app.experiment import unlike, versions
from nsdrill.app.running.run import processors
from nsdrill.errors import InputError, NsdrillError, Refusal, option
from nsdrill.models.registry import other_packages, sources_of

if TYPE_CHECKING:
    from distributed import Client, LocalCluster

CONNECT_SECONDS = 10
P = ParamSpec("P")
T = TypeVar("T")
_TERMINAL_SIGNALS = {signal.SIGINT, signal.SIGHUP}


def executor_of(
    engine: str, scheduler: str | None, workers: int | None
) -> AbstractContextManager[tuple[Executor | None, int | None]]:
    """A context with the executor of the ``engine`` "threads" or "dask", None for threads
    of this process, and the number of workers."""
    if scheduler is not None and engine != "dask":
        raise Refusal("scheduler", f"with {option('engine', 'threads')}", f"with {option('engine', 'dask')}")
    return nullcontext((None, workers)) if engine == "threads" else dask_executor(scheduler, workers)


@contextmanager
def dask_executor(scheduler: str | None = None, workers: int | None = None) -> Iterator[tuple[Executor, int]]:
    """An executor on the cluster of the ``scheduler`` at this address, or on a
    temporary cluster on this machine; and the number of parallel runs (``workers``, by
    default the number of its threads). InputError or NsdrillError where no cluster can
    be used."""
    try:
        from distributed import Client, LocalCluster
    except ImportError as error:
        raise InputError(
            f"{option('engine', 'dask')}: the package `distributed` is not installed. Install it with pip install "
            f"'nsdrill[dask]', or use {option('engine', 'threads')}."
        ) from error
    if scheduler is None:
        count = workers or processors()
        with _local_cluster(LocalCluster, count) as cluster, Client(cluster) as client:
            yield _Cluster(client), count
        return
    try:
        client = Client(scheduler, timeout=CONNECT_SECONDS)
    except ValueError as error:
        found = f"{scheduler!r} ({error})"
        raise Refusal("scheduler", found, "an address as tcp://host:8786") from error
    except OSError as error:
        raise NsdrillError(
            f"{option('scheduler')}: no Dask scheduler answers at {scheduler} within {CONNECT_SECONDS} s. Nothing has "
            "run. Is it running, and can this machine reach it?"
        ) from error
    with client:
        threads = sum(client.nthreads().values())
        if threads == 0:
            raise NsdrillError(
                f"{option('scheduler')}: the Dask scheduler at {scheduler} has no workers. Nothing has run."
            )
        for worker, found in client.run(versions, on_error="return").items():
            if differing := _version_differences(found):
                raise NsdrillError(
                    f"{option('scheduler')}: the worker {worker} has other versions, whose numbers may differ "
                    f"({differing}). Nothing has run. Install the same versions everywhere, and start the workers anew."
                )
        yield _Cluster(client), workers or threads


def _local_cluster(make: type[LocalCluster], count: int) -> LocalCluster:
    """A temporary cluster on this machine; NsdrillError where it does not start."""
    with _terminal_signals_blocked():
        # Without its warnings, that a busy worker is killed at the end.
        try:
            return make(n_workers=count, threads_per_worker=1, dashboard_address=None, silence_logs=logging.ERROR)
        except RuntimeError as error:
            raise NsdrillError(
                f"The Dask workers on this machine did not start ({error}). Nothing has run. A Python script is "
                'read again by each of them: put its calls below `if __name__ == "__main__":`.'
            ) from error


class _Cluster(Executor):
    """The executor of a client, with a check of the connection: without it, futures
    wait for a lost scheduler forever."""

    def __init__(self, client: Client) -> None:
        self._client, self._executor = client, client.get_executor(pure=False)

    def submit(self, function: Callable[P, T], /, *args: P.args, **more: P.kwargs) -> Future[T]:
        """As of any executor; NsdrillError where the scheduler is lost."""
        try:
            future: Future[T] = self._executor.submit(
                _call_on_same_versions, versions(), _model_sources(), function, *args, **more
            )
        except Exception:
            # A client that has lost its scheduler cancels all futures, and refuses new
            # ones once it has tried in vain to connect again.
            self.check()
            raise
        return future

    def check(self) -> None:
        """NsdrillError where the scheduler is lost; the engine calls this when no
        result has arrived for a while."""
        if self._client.status == "closed":
            raise NsdrillError(
                "The Dask scheduler is gone. Finished points are kept: look after the cluster, then give the same "
                f"command with {option('resume')}."
            )


def _version_differences(versions_there: object) -> str:
    """The differences, in words, between the versions of this process and
    ``versions_there`` of another, or the error with which it failed to give them. numpy
    is included, as its arrays are sent between the processes."""
    return (
        "; ".join(unlike(versions_there, "numpy_version"))
        if isinstance(versions_there, dict)
        else f"it does not tell them: {versions_there}"
    )


def _model_sources() -> dict[str, str]:
    """Digests of the models of other packages that are registered in this process."""
    return {name: sources_of(name) for name in other_packages()}


def _call_on_same_versions(
    expected: dict[str, str], models: dict[str, str], function: Callable[P, T], /, *args: P.args, **more: P.kwargs
) -> T:
    """Call ``function`` in a worker, after a comparison of versions, as a worker may
    join after the first comparison."""
    if differing := _version_differences(expected):
        raise NsdrillError(f"the worker has other versions ({differing})")
    if other := [name for name, digest in models.items() if sources_of(name) != digest]:
        raise NsdrillError(f"the worker has another version of the model {other[0]}, or none")
    return function(*args, **more)


@contextmanager
def _terminal_signals_blocked() -> Iterator[None]:
    """Block the signals of a terminal, Ctrl-C and hangup, for processes that are
    started in this context, also by threads that are started in it. The main process
    receives them and closes the workers."""
    from multiprocessing import resource_tracker

    old_mask = signal.pthread_sigmask(signal.SIG_BLOCK, _TERMINAL_SIGNALS)
    try:
        # Python's resource tracker, which would warn of semaphores, and remove them,
        # where this process ends at once.
        old_warnings = os.environ.get("PYTHONWARNINGS")
        os.environ["PYTHONWARNINGS"] = "ignore"
        resource_tracker.ensure_running()
        del os.environ["PYTHONWARNINGS"]
        if old_warnings is not None:
            os.environ["PYTHONWARNINGS"] = old_warnings
        signal.pthread_sigmask(signal.SIG_BLOCK, _TERMINAL_SIGNALS)  # Python 3.11 unblocks some
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, old_mask)
