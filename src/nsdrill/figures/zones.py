"""The classes of an operating window as they are drawn: the colour is what happens on the
way in. Pictures and pages have them from here, with one colour and one name for each.

White hatching lies over points that are free only when lowered from above.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nsdrill.analysis.advice import only_unstable
from nsdrill.analysis.graded import Graded
from nsdrill.analysis.histories import Grade, is_allowed
from nsdrill.analysis.sticking import from_rest
from nsdrill.data import Array
from nsdrill.figures.style import (
    ANY_HISTORY_COLOUR,
    BAD_TO_GOOD,
    BORDERLINE_COLOUR,
    GREY,
    RESPONSES,
    SAFE_COLOUR,
    SOME_STARTS_COLOUR,
    STARTED_COLOUR,
    STICKS_ON_COLOUR,
    ResponseStyle,
    styles_of,
)
from nsdrill.models.responses import STALLED
from nsdrill.records import dataclass
from nsdrill.words.values import reached

# Codes of the cells: below these the response bits on the way in, 0 for a point that is
# critical without a response, by a severity or as its checks disagree.
ANY_HISTORY, ALLOWED, STARTED, SOME_STARTS, BORDERLINE, STICKS_ON, NOT_RUN, RUN_UP, UNKNOWN = range(
    len(RESPONSES), len(RESPONSES) + 9
)
# The bits of a model's own responses, which begin where those codes do, come after them.
OWN = UNKNOWN + 1 - len(RESPONSES)
ONLY_FROM_ABOVE = "free only when lowered from above"


@dataclass(frozen=True)
class Zone:
    """A class: its ``name``, what is written in ``capitals`` where it has room, and its
    colour."""

    name: str
    capitals: str
    colour: str


def codes_of(grades: Graded) -> Array:
    """The code of every point, [third, y, x]."""
    grade, bits = grades.grade, grades.bits_on(grades.way_in)
    bits = np.where(bits < len(RESPONSES), bits, bits + OWN)
    if "up" not in grades.ways and grades.share is None:  # the way in was not run
        bits = np.where(grade == Grade.ONLY_FROM_ABOVE, NOT_RUN, bits)
    is_outside = np.zeros(grade.shape, dtype=bool) if grades.outside is None else grades.outside
    codes = np.select(
        [
            is_outside & is_allowed(grade),
            grade == Grade.ANY_HISTORY,
            grade == Grade.FROM_START,
            grades.allowed,
            grade == Grade.FROM_SOME,
            grade == Grade.BORDERLINE,
            (grade == Grade.STICKS_ON) & (grades.bits_on(grades.way_in) == 0),
            grade == Grade.UNKNOWN,
            grade == Grade.STALLED,
        ],
        [RUN_UP, ANY_HISTORY, STARTED, ALLOWED, SOME_STARTS, BORDERLINE, STICKS_ON, UNKNOWN, STALLED],
        bits,
    )
    return np.asarray(codes)


def in_order(found: Sequence[Zone]) -> tuple[int, ...]:
    """The codes of the classes as in a legend: what is allowed first."""
    responses = (*range(len(RESPONSES)), *range(UNKNOWN + 1, len(found)))
    return (ANY_HISTORY, ALLOWED, STARTED, SOME_STARTS, BORDERLINE, STICKS_ON, *responses, NOT_RUN, RUN_UP, UNKNOWN)


def lowered(grades: Graded) -> Array:
    """Which points are free only when lowered from above, [third, y, x]."""
    return np.asarray(grades.grade == Grade.ONLY_FROM_ABOVE)


def zones(grades: Graded, severity: int | None = None) -> tuple[Zone, ...]:
    """The classes by their codes."""
    free = "free" if severity is None else f"no severity above {severity}"
    every = _every(grades, free) if grades.share is None else f"{free} from all starts"
    quick, styles, held = "up" in grades.ways, styles_of(grades.results.attrs), from_rest(grades.results)
    started = Grade.FROM_START.started(held) if quick else reached(["same"], None, from_rest=held)
    return (
        *(_critical(bits, styles, severity) for bits in range(len(RESPONSES))),
        Zone(every, "SAFE", ANY_HISTORY_COLOUR),
        Zone(f"{free}, {_way_in(grades)}", _capitals(grades), SAFE_COLOUR),
        Zone(
            f"{free} {started}{'' if held else ': at once, off bottom'}" if quick else f"{free}, {started}",
            "STARTED\nAT REST" if held else "QUICK START" if quick else "STARTED THERE",
            STARTED_COLOUR if quick else SAFE_COLOUR,
        ),
        Zone(f"{free} from some starts only", "SOME STARTS\nONLY", SOME_STARTS_COLOUR),
        Zone("borderline: touches, or near a limit", "BORDERLINE", BORDERLINE_COLOUR),
        Zone(*_sticking(grades), STICKS_ON_COLOUR),
        Zone("the way in was not run", "", GREY),
        Zone("free, but not drilled: run-up only", "RUN-UP ONLY", GREY),
        Zone("unknown", "UNKNOWN", GREY),
        *(_critical(bits, styles, severity) for bits in range(len(RESPONSES), len(styles))),
    )


def _sticking(grades: Graded) -> tuple[str, str]:
    """What is said of points that are free where stick-slip lasts, or where steady drilling is unstable."""
    unstable, every = only_unstable(grades), grades.grade == Grade.STICKS_ON
    if not unstable.any():
        return "free, but stick-slip, once started, lasts", "STICK-SLIP\nMAY LAST"
    if np.array_equal(unstable, every):
        return "free, but steady drilling is unstable", "UNSTABLE"
    return "free, but stick-slip, once started, lasts, or steady drilling is unstable", "STICK-SLIP\nOR UNSTABLE"


def _every(grades: Graded, free: str) -> str:
    """Without the speed up to which stick-slip lasts by the model, only what was run counts."""
    is_known = grades.modelled is not None and bool(grades.modelled.all())
    return f"{free} after any history" if is_known else f"{free} after every history that was run"


def _critical(bits: int, styles: Sequence[ResponseStyle], severity: int | None) -> Zone:
    """The class of points with these responses on the way in."""
    style = styles[bits]
    if bits & STALLED:
        return Zone(style.name, "BIT STALLS", style.colour)
    if not bits:
        name = "checks disagree" if severity is None else f"severity above {severity}"
        return Zone(name, name.upper(), BAD_TO_GOOD[0])
    return Zone(style.name, style.name.upper().replace(" + ", "\n+ "), style.colour)


_LOW = {"wob": "lighter", "depth": "shallower"}


def _way_in(grades: Graded) -> str:
    return f"coming from {_LOW[grades.along]}" if grades.along in _LOW else "brought up from below"


def _capitals(grades: Graded) -> str:
    return f"FROM {_LOW[grades.along].upper()}" if grades.along in _LOW else "BRING UP\nFROM BELOW"
