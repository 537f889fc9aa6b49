"""What the pictures of one trajectory have in common: the title, the part that is
shown, the height of the page."""

from __future__ import annotations

from math import pi

import numpy as np

from nsdrill.data import Trace
from nsdrill.errors import InputError
from nsdrill.models.registry import drawn_in
from nsdrill.plot.decimation import last_part
from nsdrill.plot.labels import heading, quantity
from nsdrill.plot.look import look
from nsdrill.plot.schedule import moving_values, operating_point_text

HISTORY_HEIGHT = 1.2  # inches
SCHEDULE_HEIGHT = 0.7  # inches, for each value that moves
LAST_SAMPLES = 60_000  # of orbit and phase planes
# range of a constant history, relative to its size or to the unit in which it is shown
CONSTANT_TOLERANCE = 1e-9
LAST_REVOLUTIONS = 20  # of the drive: more of them overlap and hide the shape


def check_length(trace: Trace) -> None:
    if len(trace.time) < 2:
        raise InputError(f"trace: found {len(trace.time)} samples; allowed: two or more.")


def varies(trace: Trace, name: str) -> bool:
    """Whether a history varies by more than rounding; one with NaN does."""
    values = trace[name]
    size = max(float(np.max(np.abs(values))), abs(quantity(name).scale))
    return not (np.ptp(values) <= CONSTANT_TOLERANCE * size)


def planes_of(trace: Trace) -> list[tuple[str, str]]:
    """The phase planes of the model in which something moves; all of them where nothing
    does."""
    planes = drawn_in(trace.attrs).planes
    return [pair for pair in planes if any(varies(trace, name) for name in pair)] or list(planes)


def extra_height(trace: Trace) -> float:
    """The height [inches] that the histories need beyond those of six motions at one
    operating point."""
    return SCHEDULE_HEIGHT * len(moving_values(trace)) - HISTORY_HEIGHT * (
        6 - len(drawn_in(trace.attrs).histories)
    )


def title_of(trace: Trace, units: str, width: int = 100) -> str:
    """The title of the study and the operating point."""
    return heading(trace.attrs, _point_and_procedure(trace, units), width=width)


def _point_and_procedure(trace: Trace, units: str) -> str:
    procedure = str(trace.attrs.get("procedure") or "")
    words = {"up": "carried up", "down": "carried down", "same": ""}.get(procedure, procedure)
    return ", ".join(part for part in (operating_point_text(trace, units), words) if part)


def is_chosen() -> bool:
    """Whether the user has chosen the part of the trace that is drawn."""
    return look.get().time is not None or look.get().xlim is not None


def shown_part(trace: Trace) -> tuple[slice, str]:
    """The part of the trace for orbit and phase planes, and its description (empty if
    it is the whole trace)."""
    if is_chosen():
        return slice(None), f"{trace.time[0]:.4g} to {trace.time[-1]:.4g} s"
    speed = float(
        trace["drive_speed"][-1]
        if "rotary_speed" in moving_values(trace)
        else trace.attrs.get("rotary_speed") or 0
    )
    part = last_part(
        trace.time, LAST_SAMPLES, LAST_REVOLUTIONS * 2 * pi / speed if speed > 0 else None
    )
    if part.start == 0:
        return part, ""
    return part, f"last {trace.time[-1] - trace.time[part.start]:.3g} s"
