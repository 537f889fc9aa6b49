"""Words and units on the pictures: SI as engineers write it (kN, mm), or field
units."""

from __future__ import annotations

import math
import re
import textwrap
from collections.abc import Mapping
from typing import cast

from nsdrill import quantity as quantities
from nsdrill.data import Attributes, Results, drive_kind, frozen_modes, overrides, resolved_study
from nsdrill.errors import InputError
from nsdrill.models.choices import as_value
from nsdrill.quantity import SYSTEMS
from nsdrill.records import dataclass
from nsdrill.variables import AXES, OPERATED

UNIT_SYSTEMS = SYSTEMS
# words of a study as people write them, where that is not the word with blanks
WRITTEN = {"z_torque": "Z-torque", "lqr": "LQR", "pi": "PI", "dc_motor": "DC motor"}
DEPTH_WAYS = {"up": "deeper", "down": "shallower"}  # of a sweep that was carried along the depth
CHOSEN = "chosen"  # the attribute of results of one start or one sample that names it
LETTER = 0.48  # its mean width, in font sizes
LABEL_WIDTH = 28  # characters of a line beside a panel 1.7 inches high


@dataclass(frozen=True)
class Shown:
    """How a variable is shown: its words, its unit, and the SI value of one such
    unit."""

    words: str
    unit: str
    scale: float
    choices: tuple[str, ...] = ()

    @property
    def label(self) -> str:
        return f"{self.words} [{self.unit}]" if self.unit else self.words

    def in_lines(self, width: int = LABEL_WIDTH) -> str:
        """The label in lines of ``width`` characters at most."""
        return textwrap.fill(self.label, width, break_long_words=False, break_on_hyphens=False)

    def number(self, si: float) -> str:
        """A number without its unit."""
        return quantities.short(si / self.scale)

    def value(self, si: float) -> str:
        """A number with its unit for titles: ``22.24 kN``; or a word."""
        if self.choices:
            return written(self.choices[int(si)])
        return f"{self.number(si)} {self.unit}".strip()


def written(word: str) -> str:
    """A word of a study as people write it: ``LQR``, ``soft torque``."""
    return WRITTEN.get(word, word.replace("_", " "))


def way_word(procedure: str, attrs: Attributes) -> str:
    """The word for a procedure of a sweep with these ``attrs``: ``deeper`` for up where
    the state was carried along the depth, which increases downwards."""
    sweep = resolved_study(attrs).get("sweep") or {}
    return DEPTH_WAYS.get(procedure, procedure) if sweep.get("along") == "depth" else procedure


def carried(procedure: str, attrs: Attributes) -> str:
    """``carried up``; of a procedure in which nothing is carried its name."""
    word = way_word(procedure, attrs)
    return f"carried {word}" if procedure in DEPTH_WAYS else word


def both_ways(attrs: Attributes) -> str:
    """``up and down``, in the words for a sweep with these ``attrs``."""
    return " and ".join(way_word(procedure, attrs) for procedure in DEPTH_WAYS)


def check_units(units: str) -> None:
    if units not in UNIT_SYSTEMS:
        raise InputError(f"unit system: found {units!r}; allowed: {', '.join(UNIT_SYSTEMS)}.")


def setting(key: str, value: object, units: str = "si") -> str:
    """The value (SI) of a key of a study as it is shown: a number with its unit, any
    other as it is."""
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    known = quantities.find(key) if is_number else None
    return str(value) if known is None else known.text(cast("float", value), units)


def quantity(name: str, units: str = "si") -> Shown:
    """How a variable or coordinate of a results or trace file is shown in the ``units``
    "si" or "field"."""
    check_units(units)
    record = quantities.quantity(name)
    if name.endswith("_fraction"):
        return Shown(record.label, "%", 0.01)
    unit = record.unit(units)
    scale = 1.0 if unit in ("", "percent") else quantities.shown_scale(unit, record.units)
    return Shown(record.label, quantities.sign(unit), scale, record.choices)


def operating_point(values: Mapping[str, float | None], units: str) -> str:
    """The operating values among ``values``, in the order usual among drillers:
    ``5000 m, 22.24 kN, 3 rad/s``; then other values, each with its name."""
    texts = []
    for name in AXES:
        if (value := values.get(name)) is not None:
            texts.append(quantity(name, units).value(float(value)))
    for name, value in values.items():
        if name not in AXES and value is not None:
            shown = quantity(name, units)
            texts.append(f"{shown.words.lower()} {shown.value(as_value(name, value))}")
    return ", ".join(texts)


def heading(attrs: Attributes, point: str, *, width: int = 100) -> str:
    """The title of the study in the words of the user; on lines of their own what
    ``--set`` changed, in ``width`` characters, and the operating values that the title
    does not give."""
    title = " ".join(str(attrs.get("title") or "").split())
    parts = [_values_not_in_title(point, title)]
    # what sets the string apart
    if (drive := drive_kind(attrs)) != "ideal":
        parts.append(f"{written(drive)} drive")
    if frozen := frozen_modes(attrs):
        parts.append(f"{' and '.join(frozen)} motion frozen")
    point_line = "; ".join(filter(None, parts))
    return "\n".join(line for line in (title, describe_overrides(attrs, width), point_line) if line)


def sweep_title(results: Results, units: str, *parts: str, width: int = 100) -> str:
    """The heading of a sweep: the values that it does not change, the start or sample
    of which it is, and further ``parts``."""
    point = operating_point(results.held, units)
    return heading(results.attrs, "; ".join(filter(None, (point, results.attrs.get(CHOSEN), *parts))), width=width)


SAME_VALUE = 5e-4  # relative: values are written with four digits
_SCALES = {
    quantities.sign(unit): (name, quantities.shown_scale(unit, record.units))
    for name in AXES
    for record in [quantities.quantity(name)]
    for unit in map(record.unit, SYSTEMS)
}
_VALUE = re.compile(rf"(?<![\w.])(\d+(?:\.\d+)?)\s?({'|'.join(map(re.escape, _SCALES))})(?![\w/])")


def _parse_value(match: re.Match[str]) -> tuple[str, str, float]:
    """The text of a matched value, its axis, and its SI value."""
    axis, scale = _SCALES[match[2]]
    return match[0], axis, float(match[1]) * scale


def _values_not_in_title(point: str, title: str) -> str:
    """The operating values that do not stand in the title already, in any unit."""
    in_title = [_parse_value(match) for match in _VALUE.finditer(title)]

    def missing(value: str) -> bool:
        if not (match := _VALUE.fullmatch(value)):
            return not re.search(rf"(?<![\w.]){re.escape(value)}(?![\w/])", title)
        _, axis, number = _parse_value(match)
        return not any(
            axis == other and math.isclose(number, given, rel_tol=SAME_VALUE) for _, other, given in in_title
        )

    head, semicolon, rest = point.partition(";")
    values = ", ".join(filter(missing, head.split(", ")))
    return values + semicolon + rest if values else rest.strip()


# numbers with more digits than a title needs
_LONG_NUMBER = re.compile(r"(?<![\w.])-?\d+\.\d{6,}(?:e[-+]?\d+)?", re.IGNORECASE)


# sections of a study that say nothing of the string, the rock, the rig, or of what counts
NOT_PHYSICAL = ("sweep", "simulation", "uncertain", "check", "output", "units")


def describe_overrides(attrs: Attributes, width: int) -> str:
    """What ``--set`` of run and classify changed, in one line:
    ``bit.lobes = 1 and 3 more``. The title and the operating point, which stand in the
    heading anyway, and the sweep, which the axes show, are left out; where something
    physical changed, how it was simulated as well."""
    changes = overrides(attrs, thresholds=True)
    in_title = ("title", *OPERATED, *(f"operation.{name}" for name in OPERATED))
    # what is physical alone, where there is something
    physical = [key for key in changes if key.partition(".")[0] not in (*in_title, *NOT_PHYSICAL)]
    texts = [
        f"{key} = {_LONG_NUMBER.sub(lambda number: f'{float(number[0]):.6g}', value)}"
        for key, value in changes.items()
        if (key in physical if physical else key.partition(".")[0] != "sweep") and key not in in_title
    ]
    line = ""
    for remaining, text in zip(reversed(range(len(texts))), texts, strict=True):
        available = width - (len(f" and {remaining} more") if remaining else 0)
        if not line:
            line = text if len(text) <= available else f"{text[: available - 4].rstrip()} ..."
        elif len(line) + 2 + len(text) <= available:
            line += f", {text}"
        else:
            return f"{line} and {remaining + 1} more"
    return line
