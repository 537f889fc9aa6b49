"""Where a run computes: on this processor or on a GPU; which of them pays, and why."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from nsdrill.app.experiment import Experiment, coarse_points
from nsdrill.app.running.stages import work_of
from nsdrill.compiler.functions import route
from nsdrill.errors import InputError, NsdrillError, Refusal, count, option
from nsdrill.models.friction import METHODS
from nsdrill.records import dataclass
from nsdrill.sweep.gpu import Gpu
from nsdrill.sweep.work import Work

# Chains from which an H200 is as fast as 16 processors, and with more processors those for
# each of them: docs/gpu.md.
LEAST_CHAINS, OF_EACH = 1000, 64
SLOW = 8  # times its double precision that the single precision of a GPU may be fast


@dataclass(frozen=True)
class Place:
    """Where a run computes: on the ``gpu``, or on the processor where that is None.
    ``name`` is that of files; ``told`` says which was taken and why, where that was asked."""

    gpu: Gpu | None = None
    name: str = "cpu"
    told: str = ""


PROCESSOR = Place()


def check_device(device: str, engine: str = "threads") -> None:
    """A Refusal of a ``device`` which this ``engine`` or the compiler does not use."""
    if device != "gpu":
        return
    if engine == "dask":
        allowed = f"device cpu, or gpu with {option('engine', 'threads')}: only the process of the run uses its GPU"
        raise Refusal("device", "gpu with engine dask", allowed)
    if fault := _other_compiler():
        raise Refusal("device", f"gpu, and {fault}", "gpu with the native compiler, which alone writes code for it")


def place_of(device: str, experiment: Experiment, workers: int, *, remote: bool = False) -> Place:
    """The place of a sweep; ``remote`` says that it runs on a cluster."""
    study, plan, work = experiment.study, experiment.plan, work_of(experiment)
    parts = [replace(work, parameters=parameters, initial=initial) for parameters, initial in experiment.parts]
    works = [part.by(method) for part in parts for method in METHODS if method in experiment.methods]
    chains = -(-plan.abreast * coarse_points(study, plan.points) // plan.points)
    return place_for(device, works, chains, workers, remote=remote)


def place_for(device: str, works: Sequence[Work], chains: int, workers: int, *, remote: bool = False) -> Place:
    """The place of these ``works`` with so many ``chains`` on ``device`` cpu, gpu or auto,
    which have ``workers`` threads on the processor. InputError where a GPU is asked for
    that there is not, or one that cannot compute the works."""
    if device == "cpu":
        return PROCESSOR
    check_device(device, "dask" if remote else "threads")
    pays = max(LEAST_CHAINS, OF_EACH * workers)
    few = f"{count(chains, 'chain')}, and a GPU pays from some {pays} on" if chains < pays else ""
    if device == "auto" and (why := "a cluster uses no GPU" if remote else few or _other_compiler()):
        return _instead(why)
    try:
        gpu = Gpu.found()
        if device == "auto" and (ratio := gpu.launcher.ratio) > SLOW:
            return _instead(f"{gpu.name} has 1/{ratio} of its speed in double precision")
        for work in works:
            gpu.check(work)
    except NsdrillError as error:
        name = option("device", "gpu")
        text = str(error).removeprefix(f"{name}: ")
        if device == "auto":
            return _instead(text.partition(". ")[0].rstrip("."))
        raise InputError(f"{name}: {text}") from error
    return Place(gpu, gpu.name, f"{gpu.name}, {few or count(chains, 'chain')}")


def _instead(why: str) -> Place:
    return replace(PROCESSOR, told=f"the processor: {why}")


def _other_compiler() -> str:
    """What is found in place of the native compiler; empty where that is used."""
    return "" if route() == "native" else f"{route()} as compiler (NSDRILL_COMPILER, NUMBA_DISABLE_JIT)"
