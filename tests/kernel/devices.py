"""Devices for tests without a GPU: batches of this processor in place of one, and a driver
that is none but takes the calls of one."""

import ctypes
from typing import Any

import numpy as np

from nsdrill.compiler import threads
from nsdrill.compiler.functions import BUFFERS
from nsdrill.kernel.batch import FinishedRuns
from nsdrill.kernel.device_batch import DeviceBatch
from nsdrill.kernel.launcher import Launcher
from nsdrill.sweep.work import Work, compiled_parts

COLUMNS = ("status", "accepted", "rejected", "initial", "final", "outcome", "parameters")


def device_batch(work: Work, launcher: Launcher, **given: Any) -> DeviceBatch:
    """A batch of a device for the runs of ``work``."""
    one = work.new_batch(1, 1)
    width = one._outbox.shape[1] - 3 - one.rows.states - 1
    parts = compiled_parts(1, work.program)
    return DeviceBatch(launcher, parts, work.program.rows, one._store, width, work.simulation, **given)


def runs_of(work: Work, batch: Any, points: np.ndarray, seconds: float = 0.05) -> dict[str, np.ndarray]:
    """What the runs of these points leave, by the points in ascending order, with as many
    in the batch at a time as there is room for."""
    parts, done, left = compiled_parts(1 if isinstance(batch, DeviceBatch) else batch.lanes, work.program), [], points
    while len(left) or not batch.idle:
        now, left = left[: batch.free], left[batch.free :]
        if len(now):
            batch.add_many(now, work.prepare(now))
        done.append(batch.advance(parts, seconds, not len(left)))
    return left_by(done)


def left_by(done: list[FinishedRuns]) -> dict[str, np.ndarray]:
    """The columns of these runs, by their jobs in ascending order; what an observer left
    of one that failed means nothing."""
    order = np.argsort(np.concatenate([d.job for d in done]))
    found = {name: np.concatenate([getattr(d, name) for d in done])[order] for name in COLUMNS}
    found["outcome"] = np.where(found["status"][:, None] == 1, found["outcome"], 0.0)
    return found


def differing(one: dict[str, np.ndarray], other: dict[str, np.ndarray]) -> list[str]:
    """The columns whose bits are not the same."""
    return [name for name in COLUMNS if one[name].tobytes() != other[name].tobytes()]


class DriverOfNone:
    """Takes the calls of libcuda: memory is this process's, and a launch runs the threads
    of ``function`` one after the other as machine code of this processor. The calls in
    ``faults`` fail with their numbers."""

    def __init__(self, **faults: int) -> None:
        self.faults, self.calls = faults, []
        self.capability, self.multiprocessors, self.mode = (9, 0), 2, 0
        self.room = 1 << 30
        self.memory: dict[int, Any] = {}
        self.functions: dict[int, Any] = {}
        self.text = b""

    def __getattr__(self, name: str) -> Any:
        if not name.startswith("cu"):
            raise AttributeError(name)

        def called(*given: Any) -> int:
            self.calls.append(name)
            if name in self.faults:
                return self.faults[name]
            return getattr(self, f"do_{name}", lambda *given: 0)(*given) or 0

        return called

    def do_cuDeviceGetCount(self, found: Any) -> None:
        found._obj.value = 1

    def do_cuDeviceGetName(self, name: Any, size: int, device: Any) -> None:
        name.value = b"GPU of a test"

    def do_cuDeviceGetAttribute(self, found: Any, which: int, device: Any) -> None:
        major, minor = self.capability
        found._obj.value = {16: self.multiprocessors, 20: self.mode, 75: major, 76: minor, 87: 2}[which]

    def do_cuGetErrorName(self, number: int, name: Any) -> None:
        name._obj.value = f"CUDA_ERROR_{number}".encode()

    def do_cuMemGetInfo_v2(self, free: Any, total: Any) -> None:
        free._obj.value = total._obj.value = self.room

    def do_cuMemAlloc_v2(self, address: Any, size: Any) -> int:
        if size.value > self.room:
            return 2
        self.room -= size.value
        made = ctypes.create_string_buffer(size.value + 8)
        address._obj.value = ctypes.addressof(made)
        self.memory[address._obj.value] = made
        return 0

    def do_cuMemFree_v2(self, address: Any) -> None:
        self.room += len(self.memory.pop(address.value)) - 8

    def do_cuMemcpyHtoD_v2(self, to: Any, given: Any, size: Any) -> None:
        if size.value:
            ctypes.memmove(to.value, given.value, size.value)

    def do_cuMemcpyDtoH_v2(self, to: Any, given: Any, size: Any) -> None:
        if size.value:
            ctypes.memmove(to.value, given.value, size.value)

    def do_cuModuleLoadDataEx(self, module: Any, text: Any, count: int, names: Any, values: Any) -> None:
        self.text = text.value

    def do_cuModuleGetFunction(self, function: Any, module: Any, name: Any) -> None:
        function._obj.value = len(self.functions) + 1

    def do_cuOccupancyMaxActiveBlocksPerMultiprocessor(self, blocks: Any, *given: Any) -> None:
        blocks._obj.value = 2

    def do_cuLaunchKernel(self, function: Any, blocks: int, *given: Any) -> None:
        *_, block, _, _, _, _, places, _ = given
        kinds = self.functions[function.value].kinds
        types = [
            t for kind in kinds for t in ((ctypes.c_void_p, ctypes.c_int64) if kind in BUFFERS else (ctypes.c_int64,))
        ]
        run = ctypes.CFUNCTYPE(ctypes.c_int64, *types)(threads.address(self.functions[function.value]))
        numbers = [ctypes.cast(place, ctypes.POINTER(ctypes.c_int64))[0] for place in places]
        assert len(numbers) == len(types) - 1
        assert (blocks - 1) * block < numbers[-1] <= blocks * block
        for number in range(numbers[-1]):
            run(*numbers, number)
