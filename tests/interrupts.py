"""A user who presses Ctrl-C."""

from __future__ import annotations


class Interrupt:
    """For ``watch``: interrupts at the ``after``-th look."""

    def __init__(self, after: int = 1) -> None:
        self.left = after

    def __call__(self, progress: object) -> None:
        self.left -= 1
        if self.left == 0:
            raise KeyboardInterrupt
