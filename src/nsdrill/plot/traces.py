"""What the pictures of one trajectory have in common: the title, the part that is
shown, the size of a page."""

from __future__ import annotations

from math import pi

import numpy as np

from nsdrill.data import Trace
from nsdrill.errors import InputError
from nsdrill.models.registry import drawn_in
from nsdrill.plot.decimation import last_part
from nsdrill.plot.labels import heading, quantity
from nsdrill.plot.look import look
from nsdrill.plot.schedule import moving, point_words

ROOM_FOR_HISTORY = 1.2  # inches of page
ROOM_FOR_SCHEDULE = 0.7  # inches of page for each value that moves
LAST_SAMPLES = 60_000  # of orbit and phase planes
STILL = 1e-9  # part of its size, or of one unit in which it is shown, that a constant varies by
LAST_TURNS = 20  # of the drive: more lie over each other and hide the shape


def check_length(trace: Trace) -> None:
    if len(trace.time) < 2:
        raise InputError(f"trace: found {len(trace.time)} samples; allowed: two or more.")


def moves(trace: Trace, name: str) -> bool:
    """Whether a history is more than one value with its rounding."""
    values = trace[name]
    size = max(float(np.max(np.abs(values))), abs(quantity(name).scale))
    return not (np.ptp(values) <= STILL * size)  # so that NaN is no rest


def planes_of(trace: Trace) -> list[tuple[str, str]]:
    """The phase planes of the model in which something moves; all of them where nothing
    does."""
    planes = drawn_in(trace.attrs).planes
    return [pair for pair in planes if any(moves(trace, name) for name in pair)] or list(planes)


def room_for(trace: Trace) -> float:
    """Inches of page that the histories need beyond those of six motions at one
    operating point."""
    return ROOM_FOR_SCHEDULE * len(moving(trace)) - ROOM_FOR_HISTORY * (
        6 - len(drawn_in(trace.attrs).histories)
    )


def title_of(trace: Trace, units: str, width: int = 100) -> str:
    """The title of the study and the operating point."""
    return heading(trace.attrs, _point(trace, units), width=width)


def _point(trace: Trace, units: str) -> str:
    procedure = str(trace.attrs.get("procedure") or "")
    words = {"up": "carried up", "down": "carried down", "same": ""}.get(procedure, procedure)
    return ", ".join(part for part in (point_words(trace, units), words) if part)


def shown_part(trace: Trace) -> tuple[slice, str]:
    """The part of the trace for orbit and phase planes, and the words for it (none if
    it is all)."""
    if look.get().time is not None or look.get().xlim is not None:  # as the user has chosen
        return slice(None), f"{trace.time[0]:.4g} to {trace.time[-1]:.4g} s"
    speed = float(
        trace["drive_speed"][-1]
        if "rotary_speed" in moving(trace)
        else trace.attrs.get("rotary_speed") or 0
    )
    part = last_part(trace.time, LAST_SAMPLES, LAST_TURNS * 2 * pi / speed if speed > 0 else None)
    if part.start == 0:
        return part, ""
    return part, f"last {trace.time[-1] - trace.time[part.start]:.3g} s"
