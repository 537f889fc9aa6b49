"""That stick-slip ends earlier than torsion alone explains, in words."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Sequence

from nsdrill.data import Answer
from nsdrill.errors import count
from nsdrill.plot.values import Formatter
from nsdrill.quantity import quantity

WIDTH = 100


def early_lines(ends: Sequence[Answer], units: str) -> Iterator[str]:
    """The lines of a warning of settings at which stick-slip ends early, in the units
    ``si`` or ``field``; none where there are none."""
    if not ends:
        return
    yield from textwrap.wrap(early_text(ends, units), WIDTH, initial_indent="  ", subsequent_indent="  ")


def early_text(ends: Sequence[Answer], units: str) -> str:
    """The warning of these settings, of which it names the first."""
    fmt, first = Formatter(units), ends[0]
    where = ", ".join(fmt.value(name, value) for name, value in first["at"].items())
    where = f"at {where} " if where else ""
    by, alone = fmt.value("rotary_speed", first["by"]["value"]), fmt.range("rotary_speed", first["alone"]["value"])
    others = f", as at {count(len(ends) - 1, 'other setting')}" if len(ends) > 1 else ""
    text = f"STICK-SLIP ENDS EARLY: {where}by {by}{others}; torsion alone gives {alone}. "
    amplitude = first["surface_amplitude"]["value"]
    if amplitude > 0.0:
        height = quantity("bit_surface_amplitude").text(amplitude, units, 4)
        return text + (
            f"Lobes of {height} (bit.surface_amplitude) shake the bit, which dithers its friction away. A bit without "
            "them, as most PDC bits are, sticks up to the higher speeds: 0 mm shows it."
        )
    if first["only"]:
        return text + (
            "Nothing beside torsion moves here, so the sweep itself ended it: its steps, or motions that had not "
            "settled. Finer steps and a longer simulation.transient show it."
        )
    return text + "Something beside torsion takes it away, as contact with the wall does: its numbers decide."
