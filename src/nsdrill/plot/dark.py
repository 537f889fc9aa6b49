"""Pictures on a dark page: the colours are chosen for a white one, and those that would
be lost on the page of the user's style are exchanged."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import Collection
from matplotlib.colors import ListedColormap, to_rgb, to_rgba
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.text import Text

from nsdrill.data import Array
from nsdrill.plot.style import halo

CONTRAST = 4.5  # least ratio of luminances of a mark and the page (WCAG 2.1)
PALE = 0.6  # least part of a colour that is a ground behind marks rather than a mark


def on_dark_page(figure: Figure, artists: Iterable[Artist]) -> None:
    """Exchange the colours of ``artists`` that are lost on the page of the ``figure``,
    where that is dark: white, the paper, becomes the page, and marks become lighter."""
    page = np.array(to_rgb(figure.get_facecolor()))
    if luminance(page) > 0.2:
        return

    def shown(colour: Any) -> Any:
        if isinstance(colour, str) and colour in ("none", "auto", "None", "inherit", "face"):
            return colour
        *rgb, alpha = to_rgba(colour)
        return (*visible(np.array(rgb), page), alpha)

    for artist in artists:
        if isinstance(artist, Line2D):
            _exchange(artist, shown, "color", "markerfacecolor", "markeredgecolor")
        elif isinstance(artist, Patch):
            _exchange(artist, shown, "facecolor", "edgecolor")
        elif isinstance(artist, Text):
            text = np.array(to_rgb(artist.get_color()))
            if contrast(text, page) < CONTRAST:  # else of the style, which may be white
                artist.set_color(shown(artist.get_color()))
            if artist.get_path_effects():
                artist.set_path_effects(halo(2.0, tuple(page)))
        elif isinstance(artist, Collection) and artist.get_array() is None:
            for name in ("facecolor", "edgecolor"):
                colours = getattr(artist, f"get_{name}")()
                if len(colours) and not isinstance(colours, str):
                    getattr(artist, f"set_{name}")([shown(colour) for colour in colours])
        elif isinstance(artist, Collection) and isinstance(artist.cmap, ListedColormap):
            categories: Any = artist.cmap
            if categories.N < 32:  # no scale
                colours = [shown(colour) for colour in categories.colors]
                artist.set_cmap(ListedColormap(colours, name=categories.name))


def marks_of(figure: Figure, panels: Iterable[Axes]) -> list[Artist]:
    """What is drawn on a figure, without the frames, ticks and grids of its panels,
    which have the colours of the style."""
    frames: set[Artist] = {figure.patch}
    for axes in panels:
        frames.update({axes.patch, *axes.xaxis.findobj(), *axes.yaxis.findobj()})
        frames.update(axes.spines.values())
    return [artist for artist in figure.findobj() if artist not in frames]


def visible(colour: Array, page: Array) -> Array:
    """The colour [red, green, blue] that stands for ``colour`` on this page."""
    if np.min(colour) > PALE and np.max(colour) > 0.82:  # paper and grounds
        return np.clip(page + (0.25 * colour if np.ptp(colour) >= 0.05 else 1.0 - colour), 0, 1)
    if np.ptp(colour) < 0.05 and contrast(colour, page) < CONTRAST:
        return 1.0 - colour
    share = 0.0
    while contrast(colour + share * (1.0 - colour), page) < CONTRAST:
        share += 0.05
    return colour + share * (1.0 - colour)


def contrast(colour: Array, page: Array) -> float:
    """The ratio of the luminances of a mark and its page, 1 to 21."""
    high, low = sorted((luminance(colour), luminance(page)), reverse=True)
    return (high + 0.05) / (low + 0.05)


def luminance(colour: Array) -> float:
    """The relative luminance of a colour, 0 to 1."""
    return float(light_of(colour) @ (0.2126, 0.7152, 0.0722))


def light_of(colour: Array) -> Array:
    """The light of the red, green and blue of a colour of the standard sRGB, 0 to 1."""
    return np.where(colour > 0.04045, ((colour + 0.055) / 1.055) ** 2.4, colour / 12.92)


def _exchange(artist: Any, shown: Callable[[Any], Any], *names: str) -> None:
    """Exchange the colours of these names, those that are equal for equal ones."""
    colours = [getattr(artist, f"get_{name}")() for name in names]  # before one is set
    for name, colour in zip(names, map(shown, colours), strict=True):
        getattr(artist, f"set_{name}")(colour)
