"""Legends: the entries that several pictures share, and their placement."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Sequence
from typing import Any

from matplotlib.artist import Artist
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from nsdrill.plot.style import MOTIONS, REFERENCE, RESPONSES, SHORTEST_LINE


def marker_entry(
    label: str,
    marker: str = "o",
    colour: str = REFERENCE,
    *,
    size: float = 4.5,
    edge: float = 0.0,
    hollow: bool = False,
) -> Line2D:
    """An entry with a marker, filled or open."""
    style: dict[str, Any] = {"color": colour, "marker": marker, "markersize": size, "markeredgewidth": edge}
    if hollow:
        style |= {"markerfacecolor": "none", "markeredgewidth": edge or 0.7}
    return Line2D([], [], linestyle="none", label=label, **style)


def response_entries(codes: Iterable[int]) -> list[Artist]:
    """An entry for each response, by colour and marker."""
    return [marker_entry(style.name, style.marker, style.colour) for style in (RESPONSES[code] for code in codes)]


def motion_entries(codes: Iterable[int]) -> list[Artist]:
    """An entry for each kind of motion, by colour."""
    return [marker_entry(style.name, "o", style.colour, size=4) for style in (MOTIONS[code] for code in sorted(codes))]


def direction_entries(procedures: Sequence[str]) -> list[Artist]:
    """What filled and open markers mean; no entries where the state was not carried
    both up and down."""
    if not {"up", "down"} <= set(procedures):
        return []
    return [marker_entry("up: filled", size=4, edge=0.7), marker_entry("down: open", size=4, hollow=True)]


def legend_below(figure: Figure, handles: Sequence[Artist], columns: int) -> None:
    """A legend below the panels, in ``columns`` columns or as many as fit the width of
    the figure; its texts are broken where a single column is too wide."""
    for count in range(min(columns, len(handles)), 0, -1):
        legend = figure.legend(handles=list(handles), loc="outside lower center", ncols=count)
        width = legend.get_window_extent().width
        if width <= figure.bbox.width:
            return
        if count == 1:
            for text in legend.get_texts():
                characters = int(len(text.get_text()) * 0.95 * figure.bbox.width / width)
                if len(text.get_text()) > characters:
                    text.set_text(textwrap.fill(text.get_text(), max(characters, SHORTEST_LINE)))
            return
        legend.remove()
