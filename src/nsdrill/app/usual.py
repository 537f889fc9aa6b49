"""Numbers of a study that are far from what is met in the field and in laboratories. Mostly the
slip of a unit, and every answer is then that of another string."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping
from functools import lru_cache
from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np

from nsdrill.models.registry import checks_of
from nsdrill.models.tree import leaves
from nsdrill.quantity import short
from nsdrill.study.study import Study
from nsdrill.units import QuantityError, to_si

FAR = 2.0  # times the greatest usual number, or the least over it: from there on one is told
NUMBER = r"-?\d+(?:\.\d+)?(?:e-?\d+)?(?: \d+/\d+)?"


class UsualRange(NamedTuple):
    """The least and the greatest usual number [SI], and the units in which they are told."""

    low: float
    high: float
    told_in: tuple[str, ...]

    def is_far(self, value: float) -> bool:
        """Whether a number [SI] is far outside; 0 is, below a range that begins above it."""
        return value > FAR * max(self.high, 0.0) or value < (self.low / FAR if self.low > 0.0 else FAR * self.low)

    def text(self, value: float, units: str) -> str:
        """A number [SI] in that of the units in which it is readable best."""
        numbers = {unit: value / to_si(f"1 {unit}", units) if unit else value for unit in self.told_in}
        unit = min(numbers, key=lambda one: abs(math.log10(abs(numbers[one]) or 1.0) - 1.0))
        return f"{short(numbers[unit])} {unit}".strip()


@lru_cache(maxsize=512)
def usual_range(text: str, units: str) -> UsualRange | None:
    """The range of a ``text`` such as "3 to 40 m; laboratory rigs 0.1 m", from the least of all
    its numbers to the greatest; None where it has no two of them in these ``units``. What
    follows a colon explains."""
    plain = re.sub(r"\([^)]*\)", "", text).partition(":")[0]
    plain = re.sub(r"(?<=\d) (?=\d{3}\b)", "", plain)
    found = [one for piece in re.split(r"[;,]| or ", plain) for one in _values(piece, units)]
    low, high = (end((value for value, _ in found), default=0.0) for end in (min, max))
    return UsualRange(low, high, tuple(dict.fromkeys(unit for _, unit in found))) if low < high else None


def _values(piece: str, units: str) -> Iterator[tuple[float, str]]:
    """The numbers [SI] of a piece, one or those at both ends, with their units; the first may leave
    out its unit."""
    unit = ""
    for end in reversed(piece.split(" to ")):
        match = re.search(rf"(?<![\w.])({NUMBER})(?: (.*))?$", end.strip())
        if match is None:
            continue
        unit = _unit(match[2] or "", units) or unit
        if units and unit:
            yield to_si(f"{match[1]} {unit}", units), unit
        elif not units:
            yield float(match[1]), ""


def _unit(words: str, units: str) -> str:
    """The unit that the ``words`` begin with; empty where there is none."""
    listed = words.split() if units else []
    for length in range(len(listed), 0, -1):
        candidate = " ".join(listed[:length])
        try:
            to_si(f"1 {candidate}", units)
        except QuantityError:
            continue
        return candidate
    return ""


@lru_cache(maxsize=32)
def _numbers(parameters: Callable[[], Any]) -> list[tuple[str, Callable[[Any], Any], float | None, Mapping[str, Any]]]:
    """The numbers of a model that have a usual range: key, what reads it, default and metadata. Counts and
    switches have no unit to slip."""
    return [
        (key, attrgetter(key), default, about)
        for key, default, about in leaves(parameters())
        if about.get("usual") and isinstance(default, float | None)
    ]


def far_from_usual(study: Study) -> str:
    """In words the numbers of the string of a ``study`` that are far from usual and are not the
    defaults of its model, of an uncertain number its median; empty where there are none. Numbers
    that are swept are looked for, not known."""
    model = study.model
    found = list[str]()
    some_zero = False
    told = getattr(checks_of(model), "unread", None)
    unread = told(study.parameters) if told is not None else ()
    for key, read, default, about in _numbers(model.parameters):
        if key in study.axes or key in unread:
            continue
        value = float(np.median(study.drawn[key])) if key in study.drawn else read(study.parameters)
        if value == default or not isinstance(value, float):
            continue
        units = about.get("units", "")
        if key in model.units_by:
            choice, by_word = model.units_by[key]
            units = by_word[attrgetter(choice)(study.parameters)]
        usual = usual_range(about["usual"], units)
        if usual is not None and usual.is_far(value):
            found.append(f"{key} {usual.text(value, units)} (usual: {about['usual']})")
            some_zero |= value == 0.0
    zero = ", and is what is 0 meant to be left out" if some_zero else ""
    return f"{'; '.join(found)}. Are the units right{zero}? Every answer is one of these numbers." if found else ""
