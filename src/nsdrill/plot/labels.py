"""Words and units on the pictures: SI as engineers write it (kN, mm), or field units."""

from __future__ import annotations

import math
import re
import textwrap
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from nsdrill import quantity as quantities
from nsdrill.data import Results, drive_kind, frozen_modes, overrides
from nsdrill.errors import InputError
from nsdrill.models.leaves import as_value
from nsdrill.quantity import SYSTEMS
from nsdrill.variables import AXES

UNIT_SYSTEMS = SYSTEMS
LONGEST = 28  # letters of a line beside a panel of 1.7 inches


@dataclass(frozen=True)
class Shown:
    """How a variable is shown: its words, its unit, and the SI value of one such unit."""

    words: str
    unit: str
    scale: float
    choices: tuple[str, ...] = ()

    @property
    def label(self) -> str:
        return f"{self.words} [{self.unit}]" if self.unit else self.words

    @property
    def upright(self) -> str:
        """The label beside a low panel, in lines of at most :data:`LONGEST` letters."""
        return textwrap.fill(self.label, LONGEST, break_long_words=False, break_on_hyphens=False)

    def value(self, si: float) -> str:
        """A number with its unit for titles: ``22.24 kN``; or a word."""
        if self.choices:
            return self.choices[int(si)].replace("_", " ")
        number = si / self.scale
        return (
            f"{number:.0f} {self.unit}"
            if abs(number) >= 1e4
            else f"{number:.4g} {self.unit}".strip()
        )


def check_units(units: str) -> None:
    if units not in UNIT_SYSTEMS:
        raise InputError(f"unit system: found {units!r}; allowed: {', '.join(UNIT_SYSTEMS)}.")


def quantity(name: str, units: str = "si") -> Shown:
    """How a variable or coordinate of a results or trace file is shown in the ``units``
    "si" or "field"."""
    check_units(units)
    found = quantities.quantity(name)
    if name.endswith("_fraction"):
        return Shown(found.label, "%", 0.01)
    unit = found.unit(units)
    scale = 1.0 if unit in ("", "percent") else quantities.shown_scale(unit, found.units)
    return Shown(found.label, quantities.sign(unit), scale, found.choices)


def operating_point(values: Mapping[str, Any], units: str) -> str:
    """The operating values that are there, in the order in which a driller says them:
    ``5000 m, 22.24 kN, 3 rad/s``; then other values that were chosen, each with its
    name."""
    names = [name for name in AXES if values.get(name) is not None]
    found = [quantity(name, units).value(float(values[name])) for name in names]
    for name in values:
        if name not in AXES:
            one = quantity(name, units)
            found.append(f"{one.words.lower()} {one.value(as_value(name, values[name]))}")
    return ", ".join(found)


def fixed_values(results: Results) -> dict[str, float]:
    """The operating values that the sweep does not change."""
    return results.held


def heading(attrs: Mapping[str, Any], point: str, *, width: int = 100) -> str:
    """The title of the study, with the operating values in the units of ``point``, and,
    on lines of their own, what ``--set`` changed, in ``width`` characters, and the
    operating values."""
    title = retold(" ".join(str(attrs.get("title") or "").split()), point)
    last = "; ".join(part for part in (_unsaid(point, title), *_kind(attrs)) if part)
    return "\n".join(line for line in (title, changed(attrs, width), last) if line)


def retold(title: str, point: str) -> str:
    """A title in which the values of the operating ``point`` stand as they stand there:
    of 5000 m beside 16404 ft one would not see that they are the same."""
    told = list(map(_read, _VALUE.finditer(point)))

    def instead(found: re.Match[str]) -> str:
        own = _read(found)
        same = [
            text for text, of, si in told if of == own[1] and math.isclose(si, own[2], rel_tol=SAME)
        ]
        return same[0] if same else found[0]

    return _VALUE.sub(instead, title)


SAME = 5e-4  # relative: values are written with four digits
_SCALES = {
    quantities.sign(unit): (name, quantities.shown_scale(unit, one.units))
    for name in AXES
    for one in [quantities.quantity(name)]
    for unit in map(one.unit, SYSTEMS)
}
_VALUE = re.compile(rf"(?<![\w.])(\d+(?:\.\d+)?)\s?({'|'.join(map(re.escape, _SCALES))})(?![\w/])")


def _read(found: re.Match[str]) -> tuple[str, str, float]:
    """The text of a value, of which axis it is, and its SI value."""
    axis, scale = _SCALES[found[2]]
    return found[0], axis, float(found[1]) * scale


def _unsaid(point: str, title: str) -> str:
    """The operating values that the title does not say already."""
    head, semicolon, rest = point.partition(";")
    told = [
        one
        for one in head.split(", ")
        if not re.search(rf"(?<![\w.]){re.escape(one)}(?![\w/])", title)
    ]
    return ", ".join(told) + semicolon + rest if told else rest.strip()


# digits that nobody reads
_LONG = re.compile(r"(?<![\w.])-?\d+\.\d{6,}(?:e[-+]?\d+)?", re.IGNORECASE)


def _rounded(found: re.Match[str]) -> str:
    return f"{float(found[0]):.6g}"


def _kind(attrs: Mapping[str, Any]) -> list[str]:
    """What is not as usual about the string: its drive, and the motions that it does
    without."""
    drive, frozen = drive_kind(attrs), frozen_modes(attrs)
    return [
        *([f"{drive.replace('_', ' ')} drive"] if drive != "ideal" else []),
        *([f"{' and '.join(frozen)} motion frozen"] if frozen else []),
    ]


def changed(attrs: Mapping[str, Any], width: int) -> str:
    """What ``--set`` of run and classify changed, but for the title and the operating
    point, which are told anyway, in one line: ``bit.lobes = 1, and 3 more``."""
    found = overrides(attrs, thresholds=True)
    told = ("title", *AXES, *(f"operation.{name}" for name in AXES))
    texts = [
        f"{key} = {_LONG.sub(_rounded, value)}" for key, value in found.items() if key not in told
    ]
    line = ""
    for left, text in zip(reversed(range(len(texts))), texts, strict=True):
        room = width - (len(f" and {left} more") if left else 0)
        if not line:
            line = text if len(text) <= room else f"{text[: room - 4].rstrip()} ..."
        elif len(line) + 2 + len(text) <= room:
            line += f", {text}"
        else:
            return f"{line} and {left + 1} more"
    return line
