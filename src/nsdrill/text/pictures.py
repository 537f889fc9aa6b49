"""What can be drawn, in words."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from nsdrill.plot.registry import STUDY, all_kinds, kinds_for, kinds_of
from nsdrill.text.words import in_unit_of, point_text
from nsdrill.variables import dimension_of


def kinds(data: Any) -> Iterator[str]:
    """The kinds of picture of the data with their panels; of None those of a study."""
    if data is None:
        for name, chart in kinds_of(STUDY).items():
            yield f"{name:<24} {chart.words}"
        return
    names = kinds_for(data)
    for name in names:
        yield f"{name:<24} {all_kinds()[name].words}"
    for name in names:
        panels = [part.name for part in all_kinds().values() if part.part_of == name and part.place(data) is not None]
        if panels:
            yield textwrap.fill(f"{name} --panel: {', '.join(panels)}", 100, subsequent_indent="  ")


def nearest(data: Any, point: Mapping[str, float]) -> str:
    """The values of the sweep that are drawn in place of requested ones."""
    drawn = {}
    for key, value in point.items():
        name = dimension_of(key)
        values = np.asarray(data.coords.get(name, [value]), dtype=float)
        found = float(values[np.argmin(np.abs(values - value))])
        if abs(found - value) > 1e-3 * abs(value):
            drawn[name] = in_unit_of(key, found, point)
    return point_text(drawn)
