"""A picture before it is drawn: the painters of its panels by name, how these lie on a
page, and the words around them. A painter draws its panel into any axes, complete with
limits and labels, so that one panel alone needs nothing of the others."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import field
from typing import Any

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import Colormap, Normalize
from matplotlib.figure import Figure

from nsdrill.records import dataclass

Paint = Callable[[Axes], object]
Entries = Callable[[Mapping[str, Axes]], Iterable[Artist]]


def one_panel(figure: Figure) -> Sequence[Axes]:
    """The panel of a page with one."""
    return [figure.add_subplot()]


@dataclass(frozen=True)
class Bar:
    """The colour bar of some ``panels``, of all if None, with its ``colours`` and
    ``label``; ``lines`` are values with a line across it, and ``style`` what else
    :meth:`matplotlib.figure.Figure.colorbar` takes."""

    colours: str | Colormap
    norm: Normalize
    label: str
    panels: Collection[str] | None = None
    lines: Sequence[float] = ()
    style: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Page:
    """A picture before it is drawn.

    ``panels``
        the painters by the names of their panels, as a user asks for one of them.
    ``title``
        of the figure.
    ``width``, ``height``
        of the figure in inches; it is higher where its type is larger.
    ``arrange(figure)``
        makes the empty panels in their order. Panels that share an axis have labels at
        those of its ticks that have numbers (``tick_params``) alone.
    ``entries(panels)``
        those of the legend, for the panels that are drawn, all or one; those with a
        ``gid`` are there where their marks are seen.
    ``columns``
        of the legend, at most.
    ``warnings``
        those above the legend of a window.
    ``bars``
        the colour bars.
    ``within``
        painters of words that fit into a panel that has its size, by its name.
    ``complete(panels)``
        what is on the whole page alone.
    """

    panels: Mapping[str, Paint]
    title: str
    width: float
    height: float
    arrange: Callable[[Figure], Sequence[Axes]] = one_panel
    entries: Entries = lambda panels: ()
    columns: int = 4
    warnings: list[str] | None = None
    bars: Sequence[Bar] = ()
    within: Mapping[str, Paint] = field(default_factory=dict)
    complete: Callable[[Mapping[str, Axes]], object] = lambda panels: None


def numbered(names: Iterable[str]) -> list[str]:
    """The names of panels, each once: the second of a name ends in 2, and so on."""
    counts: dict[str, int] = {}
    unique = []
    for name in names:
        counts[name] = counts.get(name, 0) + 1
        unique.append(name if counts[name] == 1 else f"{name} {counts[name]}")
    return unique
