"""GPUs of NVIDIA, through their driver alone: the library libcuda, called by ctypes, so
that nothing has to be installed besides the driver. It compiles PTX for its GPU and keeps
the result in a cache of its own.

Nothing is loaded before :func:`open_gpu` is called. The names, numbers and orders of
arguments are those of the CUDA driver API (NVIDIA, CUDA Driver API Reference Manual).
"""

from __future__ import annotations

import ctypes
import sys
import threading
from collections.abc import Sequence
from contextlib import suppress
from ctypes import byref, c_char_p, c_int, c_size_t, c_uint, c_uint64, c_void_p
from functools import cache
from typing import Any

import numpy as np

from nsdrill.compiler.functions import LaneFunction, compiling
from nsdrill.data import Array
from nsdrill.errors import DeviceError, DeviceMemoryError, option

LIBRARIES = {"win32": ("nvcuda.dll",), "linux": ("libcuda.so.1", "libcuda.so", "/usr/lib/wsl/lib/libcuda.so.1")}
OLDEST = (7, 0)  # compute capability, as in nsdrill.compiler.threads
# Attributes of a device.
_MULTIPROCESSORS, _COMPUTE_MODE, _MAJOR, _MINOR = 16, 20, 75, 76
_SINGLE_OVER_DOUBLE = 87  # the performance of single over that of double precision
_PROHIBITED = 2  # the compute mode in which nobody may use it
_WAITS = 4  # a process that waits for its device leaves the processor to others
_BESIDE = 1  # a stream whose launches run beside those of others
# Options for the compiler in the driver.
_LOG, _LOG_SIZE = 5, 6
# What went wrong, by the number that the driver gives, and what to do.
OUT_OF_MEMORY = 2
REASONS = {
    3: ("the driver did not start", "Restart the machine, or reinstall the driver"),
    35: ("the driver is too old for its library", "Update the driver"),
    46: ("another program holds it", "Wait for that, or let it go: nvidia-smi shows it"),
    100: ("there is no GPU of NVIDIA, or this process may not see it", "Look at nvidia-smi and $CUDA_VISIBLE_DEVICES"),
    101: ("the GPU is not there", "Look at nvidia-smi"),
    201: ("its context was lost", "Run again"),
    214: ("its memory has an error that cannot be corrected", "Reset it: nvidia-smi --gpu-reset"),
    218: ("its driver cannot compile the code", "Update the driver"),
    222: ("its driver is older than the code", "Update the driver"),
    304: ("the operating system refuses it", "Look at the rights of /dev/nvidia*"),
    700: ("the code left its memory, which is a fault of nsdrill", "Report it with the study"),
    701: ("a thread needs more registers or stack than it has", "Report it with the study"),
    702: ("the system ended a launch that took too long", "Take a GPU that draws no screen"),
    719: ("a launch failed, which is a fault of nsdrill or of the GPU", "Run again, and report it with the study"),
    802: ("it is not ready yet", "Wait for its fabric manager"),
    803: ("the driver and its library are of different versions", "Restart the machine after an update of the driver"),
}


class Gpu:
    """One GPU, a :class:`nsdrill.kernel.launcher.Launcher`."""

    def __init__(self, driver: Driver, number: int = 0) -> None:
        self._driver = driver
        self.name = f"GPU {number}"
        device = c_int()
        self._ask("cuDeviceGet", byref(device), number)
        name = ctypes.create_string_buffer(128)
        self._ask("cuDeviceGetName", name, len(name), device)
        self.name = name.value.decode(errors="replace")
        major, minor, mode, self.multiprocessors = (
            self._attribute(device, which) for which in (_MAJOR, _MINOR, _COMPUTE_MODE, _MULTIPROCESSORS)
        )
        self.capability = (major, minor)
        self.ratio = self._attribute(device, _SINGLE_OVER_DOUBLE)
        if self.capability < OLDEST:
            raise DeviceError(
                f"{self.name}: found compute capability {major}.{minor}; allowed: {OLDEST[0]}.{OLDEST[1]} or newer, "
                f"as GPUs have it since 2017. Run with {option('device', 'cpu')}."
            )
        if mode == _PROHIBITED:
            raise DeviceError(
                f"{self.name}: its compute mode lets no program use it. Change that (nvidia-smi -c DEFAULT), or run "
                f"with {option('device', 'cpu')}."
            )
        with_flags = getattr(driver.library, "cuDevicePrimaryCtxSetFlags_v2", driver.library.cuDevicePrimaryCtxSetFlags)
        with_flags(device, c_uint(_WAITS))  # refused where another part of this process uses the device already
        self._context = c_void_p()
        self._ask("cuDevicePrimaryCtxRetain", byref(self._context), device)
        self._current = threading.local()
        self._kernels: dict[LaneFunction, GpuKernel] = {}

    def _attribute(self, device: c_int, which: int) -> int:
        found = c_int()
        self._ask("cuDeviceGetAttribute", byref(found), which, device)
        return found.value

    def _ask(self, function: str, *given: Any, what: str = "") -> None:
        """Call a function of the driver; DeviceError where it fails."""
        if error := getattr(self._driver.library, function)(*given):
            raise self._driver.error(error, function, self.name, what)

    def ask(self, function: str, *given: Any, what: str = "") -> None:
        """As ``_ask``, for this device, from any thread."""
        if getattr(self._current, "is_set", False) is False:
            self._ask("cuCtxSetCurrent", self._context)
            self._current.is_set = True
        self._ask(function, *given, what=what)

    def free_memory(self) -> int:
        free, total = c_size_t(), c_size_t()
        self.ask("cuMemGetInfo_v2", byref(free), byref(total))
        return free.value

    def zeros(self, size: int, dtype: type = np.float64) -> GpuMemory:
        return GpuMemory(self, size, dtype)

    def load(self, function: LaneFunction) -> GpuKernel:
        if function not in self._kernels:  # loading takes seconds where the driver keeps no compiled code
            self._kernels[function] = GpuKernel(self, function)
        return self._kernels[function]

    def wait(self) -> None:
        self.ask("cuCtxSynchronize")


class GpuMemory:
    """Numbers in the memory of a GPU."""

    def __init__(self, gpu: Gpu, size: int, dtype: type) -> None:
        self._gpu, self.size, self._dtype = gpu, size, np.dtype(dtype)
        self.address = c_uint64()
        self.bytes = max(size, 1) * self._dtype.itemsize
        gpu.ask("cuMemAlloc_v2", byref(self.address), c_size_t(self.bytes), what=f"{self.bytes / 1e6:,.0f} MB")
        gpu.ask("cuMemsetD8_v2", self.address, 0, c_size_t(self.bytes))

    def _at(self, first: int) -> c_uint64:
        return c_uint64(self.address.value + first * self._dtype.itemsize)

    def write(self, numbers: Array, first: int = 0) -> None:
        numbers = np.ascontiguousarray(numbers, self._dtype)
        assert 0 <= first <= self.size - numbers.size
        if numbers.size:
            self._gpu.ask("cuMemcpyHtoD_v2", self._at(first), c_void_p(numbers.ctypes.data), c_size_t(numbers.nbytes))

    def read(self, count: int, first: int = 0) -> Array:
        assert 0 <= first <= self.size - count
        numbers = np.empty(count, self._dtype)
        if count:
            self._gpu.ask("cuMemcpyDtoH_v2", c_void_p(numbers.ctypes.data), self._at(first), c_size_t(numbers.nbytes))
        return numbers

    def free(self) -> None:
        address, self.address = self.address, c_uint64()
        with suppress(DeviceError):  # after a launch that failed nothing is left to free
            if address.value:
                self._gpu.ask("cuMemFree_v2", address)


class GpuKernel:
    """A function of one thread, loaded into a GPU."""

    def __init__(self, gpu: Gpu, function: LaneFunction) -> None:
        from nsdrill.compiler import threads

        self._gpu, self._block = gpu, threads.BLOCK
        text = threads.assembly(function).encode()
        log = ctypes.create_string_buffer(4096)
        names = (c_int * 2)(_LOG, _LOG_SIZE)
        values = (c_void_p * 2)(ctypes.cast(log, c_void_p), c_void_p(len(log)))
        module = c_void_p()
        self._module = module
        try:
            with compiling.function():
                gpu.ask("cuModuleLoadDataEx", byref(module), c_char_p(text), 2, names, values)
        except DeviceError as error:
            said = log.value.decode(errors="replace").strip()
            raise type(error)(
                f"{error} The compiler of the driver said: {said.splitlines()[0]}" if said else str(error)
            ) from None
        self._function = c_void_p()
        gpu.ask("cuModuleGetFunction", byref(self._function), module, c_char_p(threads.ENTRY.encode()))
        self._stream = c_void_p()
        gpu.ask("cuStreamCreate", byref(self._stream), c_uint(_BESIDE))
        blocks = c_int()
        gpu.ask("cuOccupancyMaxActiveBlocksPerMultiprocessor", byref(blocks), self._function, self._block, c_size_t(0))
        self.resident = max(blocks.value, 1) * self._block * gpu.multiprocessors

    def attribute(self, which: int) -> int:
        """An attribute of the function: 3 bytes of local memory, 4 registers."""
        found = c_int()
        self._gpu.ask("cuFuncGetAttribute", byref(found), which, self._function)
        return found.value

    def launch(self, threads: int, given: Sequence[Any]) -> None:
        numbers: list[Any] = []
        for one in given:
            numbers += [c_uint64(one)] if isinstance(one, int) else [one.address, c_uint64(one.size)]
        places = (c_void_p * len(numbers))(*(ctypes.cast(byref(n), c_void_p) for n in numbers))
        blocks = -(-threads // self._block)
        self._gpu.ask("cuLaunchKernel", self._function, blocks, 1, 1, self._block, 1, 1, 0, self._stream, places, None)


class Driver:
    """The library of the driver."""

    def __init__(self, library: Any) -> None:
        self.library = library

    def error(self, number: int, function: str, device: str, what: str = "") -> DeviceError:
        """The error that the driver's ``number`` stands for, for people."""
        name = c_char_p()
        self.library.cuGetErrorName(number, byref(name))
        called = (name.value or b"").decode() or f"error {number}"
        if number == OUT_OF_MEMORY:
            return DeviceMemoryError(
                f"{device}: its memory has no room for {what or 'this'} more ({called}). End other programs that use "
                f"it (nvidia-smi shows them), record less, or run with {option('device', 'cpu')}."
            )
        reason, remedy = REASONS.get(number, (f"{function} failed", "Look at nvidia-smi"))
        return DeviceError(f"{device}: {reason} ({called}). {remedy}, or run with {option('device', 'cpu')}.")


@cache
def _driver() -> Driver:
    """The driver, if there is one."""
    library = None
    for name in LIBRARIES.get(sys.platform, ()):
        try:
            library = ctypes.CDLL(name)
            break
        except OSError:
            continue
    if library is None:
        why = (
            f"the driver of NVIDIA's GPUs is not installed ({LIBRARIES[sys.platform][0]} is not found)"
            if sys.platform in LIBRARIES
            else "there is no driver of NVIDIA's GPUs for this system; allowed: Linux, and Windows"
        )
        raise DeviceError(f"{option('device', 'gpu')}: {why}. Run with {option('device', 'cpu')}.")
    driver = Driver(library)
    if error := library.cuInit(0):
        raise driver.error(error, "cuInit", option("device", "gpu"))
    return driver


@cache
def open_gpu(number: int = 0) -> Gpu:
    """The GPU with this number, among those that this process may see. DeviceError where
    there is none that can be used, with the reason."""
    driver = _driver()
    found = c_int()
    if error := driver.library.cuDeviceGetCount(byref(found)):
        raise driver.error(error, "cuDeviceGetCount", option("device", "gpu"))
    if found.value <= number:
        raise driver.error(100, "cuDeviceGetCount", option("device", "gpu"))
    return Gpu(driver, number)
