"""Words and units on the pictures: SI as engineers write it (kN, mm), or field units."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from nsdrill.data import Results, overrides
from nsdrill.errors import InputError
from nsdrill.model.leaves import further_axes, words_of
from nsdrill.units import ENGINEERING, FIELD, to_si
from nsdrill.variables import AXES, COORDINATES, TRACE_VARIABLES, VARIABLES

UNIT_SYSTEMS = ("si", "field")

FOOT, INCH, POUND_FORCE, STANDARD_GRAVITY = 0.3048, 0.0254, 4.4482216152605, 9.80665
RPM = math.pi / 30

# From the units of a variable to (shown unit, SI per shown unit), SI system then field.
_SHOWN: dict[str, tuple[tuple[str, float], tuple[str, float]]] = {
    "m": (("mm", 1e-3), ("in", INCH)),
    "N": (("kN", 1e3), ("klbf", 1e3 * POUND_FORCE)),
    "N m": (("kN m", 1e3), ("ft-lbf", FOOT * POUND_FORCE)),
    "rad s-1": (("rad/s", 1.0), ("rpm", RPM)),
    "m s-1": (("m/s", 1.0), ("ft/s", FOOT)),
    "m s-2": (("m/s²", 1.0), ("g", STANDARD_GRAVITY)),
    "rad": (("rad", 1.0), ("rev", 2 * math.pi)),
    "s": (("s", 1.0), ("s", 1.0)),
    "percent": (("%", 1.0), ("%", 1.0)),
    "s-1": (("1/s", 1.0), ("1/s", 1.0)),
    "1": (("", 1.0), ("", 1.0)),
}
_DEPTH = (("m", 1.0), ("ft", FOOT))
_FRACTION = (("%", 0.01), ("%", 0.01))

# Where the long name of the file is too long for an axis, or field practice has a better one.
_WORDS = {
    "depth": "Measured depth",
    "wob": "Weight on bit",
    "rotary_speed": "Rotary speed",
    "axial_peaks": "Axial peaks $z$",
    "bit_speed_peaks": "Bit speed peaks",
    "radius_peaks": "Radial peaks $r$",
    "stick_slip_index": "Stick-slip index",
    "lift_off_fraction": "Time off the rock",
    "wall_contact_fraction": "Time on the wall",
    "stuck_fraction": "Time stuck",
    "whirl_ratio": "Whirl ratio",
    "rolling_ratio": "Rolling ratio",
    "lateral_acceleration_rms": "Lateral acceleration, r.m.s.",
    "axial_acceleration_rms": "Axial acceleration, r.m.s.",
    "radius_max": "Greatest radius",
    "radius_mean": "Mean radius",
    "half_difference": "Disagreement of halves",
    "section_radius": "$r$",
    "section_whirl_angle": "Whirl angle from bit",
    "section_radial_velocity": "$\\dot r$",
    "section_whirl_speed": "Whirl speed",
    "section_axial": "$z$",
    "section_axial_velocity": "$\\dot z$",
    "section_twist": "Twist",
    "section_bit_speed": "Bit speed",
    "lyapunov_exponent": "Lyapunov exponent",
    "zero_one": "0-1 test $K$",
    "period": "Period",
    "x": "$x$",
    "y": "$y$",
    "vx": "$\\dot x$",
    "vy": "$\\dot y$",
    "z": "$z$",
    "vz": "$\\dot z$",
    "radius": "$r$",
    "radial_velocity": "$\\dot r$",
    "twist": "Twist",
    "drive_angle": "Drive angle",
    "bit_speed": "Bit speed",
    "drive_speed": "Drive speed",
    "bit_force": "Bit force",
    "bit_torque": "Bit torque",
    "wall_force": "Wall force",
    "time": "Time",
}

_UNITS = {v.name: v.units for v in (*VARIABLES, *TRACE_VARIABLES)} | {k: v[0] for k, v in COORDINATES.items()}
_LONG = {v.name: v.long_name for v in (*VARIABLES, *TRACE_VARIABLES)} | {k: v[1] for k, v in COORDINATES.items()}


@dataclass(frozen=True)
class Quantity:
    """How a variable is shown: its words, its unit, and the SI value of one such unit."""

    words: str
    unit: str
    scale: float

    @property
    def label(self) -> str:
        return f"{self.words} [{self.unit}]" if self.unit else self.words

    def value(self, si: float) -> str:
        """A number with its unit for titles: ``22.24 kN``."""
        number = si / self.scale
        return f"{number:.0f} {self.unit}" if abs(number) >= 1e4 else f"{number:.4g} {self.unit}".strip()


def check_units(units: str) -> None:
    if units not in UNIT_SYSTEMS:
        raise InputError(f"unit system: found {units!r}; allowed: {', '.join(UNIT_SYSTEMS)}.")


def quantity(name: str, units: str = "si") -> Quantity:
    """The quantity of a variable or coordinate of a results or trace file."""
    check_units(units)
    if name not in _UNITS:
        return _further(name, units)
    if name == "depth":
        pair = _DEPTH
    elif name.endswith("_fraction"):
        pair = _FRACTION
    else:
        pair = _SHOWN[_UNITS[name]]
    unit, scale = pair[UNIT_SYSTEMS.index(units)]
    long = _LONG[name]
    return Quantity(_WORDS.get(name, long[:1].upper() + long[1:]), unit, scale)


def _further(name: str, units: str) -> Quantity:
    """The quantity of an axis beside those of the operation."""
    si = further_axes()[name][1]
    system = FIELD if units == "field" else ENGINEERING
    unit = "mm" if si == "m" and units == "si" else "in" if si == "m" else system.get(si, si)
    words = words_of(name)
    return Quantity(words[:1].upper() + words[1:], unit, to_si(f"1 {unit}", si) if unit else 1.0)


def operating_point(values: Mapping[str, Any], units: str) -> str:
    """The operating values that are there, in the order in which a driller says them: ``5000 m, 22.24 kN, 3 rad/s``;
    then other values that were chosen, each with its name."""
    names = [name for name in AXES if values.get(name) is not None]
    found = [quantity(name, units).value(float(values[name])) for name in names]
    for name in values:
        if name not in AXES:
            one = quantity(name, units)
            found.append(f"{one.words.lower()} {one.value(float(values[name]))}")
    return ", ".join(found)


def fixed_values(results: Results) -> dict[str, float]:
    """The operating values that the sweep does not change."""
    return {name: float(results.coords[name][0]) for name in results.axes if len(results.coords[name]) == 1}


def heading(attrs: Mapping[str, Any], point: str, *, width: int = 100) -> str:
    """The title of the study and, on lines of their own, what ``--set`` changed and the operating values."""
    title = textwrap.fill(" ".join(str(attrs.get("title") or "").split()), width)
    return "\n".join(line for line in (title, changed(attrs, width), point) if line)


def changed(attrs: Mapping[str, Any], width: int) -> str:
    """What ``--set`` of run and classify changed, but for the title, in one line: ``bit.lobes = 1, and 3 more``."""
    found = overrides(attrs, thresholds=True)
    texts = [f"{key} = {value}" for key, value in found.items() if key != "title"]
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
