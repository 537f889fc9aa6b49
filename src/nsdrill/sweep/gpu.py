"""A GPU as the worker of an engine: how many batches it advances, of how many threads and
runs."""

from __future__ import annotations

import os
from functools import cache

from nsdrill.kernel.device import open_gpu
from nsdrill.kernel.device_batch import DeviceBatch
from nsdrill.kernel.launcher import Host, Launcher
from nsdrill.records import dataclass
from nsdrill.sweep.work import Work

HOST = "host"  # in NSDRILL_GPU: this processor in place of a GPU
SEVERAL = 2  # batches: the runs of one are prepared and stored while the other advances
WAITING = 4  # times its threads for how many runs a batch has room
OUTBOX_FLOATS = 1 << 26  # 512 MB: with many returns to the section a batch has fewer slots


@dataclass(frozen=True)
class Gpu:
    """The GPU that the ``launcher`` drives."""

    launcher: Launcher

    @classmethod
    def found(cls) -> Gpu:
        """The GPU of this machine; DeviceError where there is none."""
        return cls(_host() if os.environ.get("NSDRILL_GPU") == HOST else open_gpu())

    @property
    def name(self) -> str:
        return self.launcher.name

    def check(self, work: Work) -> None:
        """Compile the code of ``work`` for the GPU. NsdrillError with the construct that it
        does not have."""
        work.device_batch(self.launcher, 1, 1).close()

    def batches(self, work: Work, chains: int, length: int) -> list[DeviceBatch]:
        """Empty batches for so many ``chains``, of which parts of ``length`` points are
        added at once."""
        resident, width = self._resident(work), work.observed(1)[1]
        count = 1 if chains <= resident else SEVERAL
        own = -(-chains // count)
        threads = min(own, resident)
        room = WAITING * threads if length == 1 else 2 * threads * length
        slots = min(own * length, room, max(threads, OUTBOX_FLOATS // width))
        return [work.device_batch(self.launcher, threads, slots) for _ in range(count)]

    def _resident(self, work: Work) -> int:
        """How many threads run at the same time."""
        with work.device_batch(self.launcher, 1, 1) as batch:
            return batch.resident


@cache
def _host() -> Host:
    return Host()
