"""What work tells of itself whose end is not known before, as branches and their curves."""

from __future__ import annotations

from collections.abc import Callable

from nsdrill.records import dataclass


def _nothing(text: str) -> None:
    """Tell no one."""


@dataclass(frozen=True)
class Telling:
    """What is called with lines about work: ``note`` with what its user should know whatever
    comes, once; ``begins`` with the first line of a stage; and ``goes``, often, with how far
    the stage is. By default no one is told."""

    note: Callable[[str], object] = _nothing
    begins: Callable[[str], object] = _nothing
    goes: Callable[[str], object] = _nothing
