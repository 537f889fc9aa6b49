"""What runs threads: the interface of a device, and this processor in place of one, on
which threads run one after the other.

On the processor there is nothing to gain but the bits: it shows, without a GPU, what
one computes.
"""

from __future__ import annotations

import ctypes
import os
from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np

from nsdrill.compiler.functions import BUFFERS, LaneFunction
from nsdrill.data import Array


class Memory(Protocol):
    """Numbers of eight bytes in the memory of a device: floats or integers."""

    size: int

    def write(self, numbers: Array, first: int = 0) -> None:
        """Copy ``numbers`` there, from the place ``first`` on."""

    def read(self, count: int, first: int = 0) -> Array:
        """Copy ``count`` numbers from there, those from the place ``first`` on."""

    def free(self) -> None:
        """Give the memory back."""


class Kernel(Protocol):
    """A function of one thread, compiled for a device and loaded into it."""

    resident: int
    """How many threads run at the same time."""

    def launch(self, threads: int, given: Sequence[Memory | int]) -> None:
        """Begin to run so many threads with these arguments, but for the last, the number
        of the thread. The launches of different kernels may run at the same time, until
        :meth:`Launcher.wait`."""


class Launcher(Protocol):
    """A device that runs threads."""

    name: str
    ratio: int
    """How many times as fast as in double precision it computes in single precision."""

    def free_memory(self) -> int:
        """Bytes."""

    def zeros(self, size: int, dtype: type = np.float64) -> Memory:
        """Memory for so many floats, or integers with ``np.int64``, all zero."""

    def load(self, function: LaneFunction) -> Kernel:
        """Compile a function of one thread."""

    def wait(self) -> None:
        """Wait until all launches have ended."""


class HostMemory:
    """Memory of this process."""

    def __init__(self, size: int, dtype: type) -> None:
        self.numbers: Array = np.zeros(size, dtype)
        self.size = size

    def write(self, numbers: Array, first: int = 0) -> None:
        self.numbers[first : first + numbers.size] = numbers.ravel()

    def read(self, count: int, first: int = 0) -> Array:
        return self.numbers[first : first + count].copy()

    def free(self) -> None:
        self.numbers = self.numbers[:0]


class HostKernel:
    """A function of one thread as machine code of this processor."""

    def __init__(self, function: LaneFunction, resident: int) -> None:
        from nsdrill.compiler import threads

        self.resident = resident
        places = (
            t
            for kind in function.kinds
            for t in ((ctypes.c_void_p, ctypes.c_int64) if kind in BUFFERS else (ctypes.c_int64,))
        )
        self._function = ctypes.CFUNCTYPE(ctypes.c_int64, *places)(threads.address(function))

    def launch(self, threads: int, given: Sequence[Any]) -> None:
        passed: list[int] = []
        for one in given:
            passed += [one] if isinstance(one, int) else [one.numbers.ctypes.data, one.size]
        for number in range(threads):
            self._function(*passed, number)


class Host:
    """This processor as a device of ``threads`` threads."""

    name, ratio = "this processor as a GPU", 2

    def __init__(self, threads: int = 32) -> None:
        self.threads = threads
        self._kernels: dict[LaneFunction, HostKernel] = {}

    def free_memory(self) -> int:
        try:
            return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_AVPHYS_PAGES")
        except (AttributeError, ValueError, OSError):
            return 1 << 32

    def zeros(self, size: int, dtype: type = np.float64) -> HostMemory:
        return HostMemory(size, dtype)

    def load(self, function: LaneFunction) -> HostKernel:
        if function not in self._kernels:
            self._kernels[function] = HostKernel(function, self.threads)
        return self._kernels[function]

    def wait(self) -> None:
        pass
