"""A user who presses Ctrl-C."""

import pytest

from nsdrill.sweep.engine import Progress


class Interrupt:
    """For ``watch``: interrupts at the ``after``-th look at points."""

    def __init__(self, after: int = 1) -> None:
        self.left = after

    def __call__(self, progress: Progress) -> None:
        self.left -= progress.note != "compiling"
        if self.left == 0:
            raise KeyboardInterrupt


def look_often(patch: pytest.MonkeyPatch, steps: int = 20_000) -> None:
    """Let the engine look up after so few packed steps that even a small study is
    interrupted in its middle. (With fewer than a run takes, a study that is interrupted
    at every look would never end.)"""
    patch.setattr("nsdrill.sweep.engine.QUANTUM", 1e-6)
    patch.setattr("nsdrill.kernel.batch.STEPS_PER_CALL", steps)
