"""Pictures on a dark page: the colours are chosen for a white one, and those that would
be lost on the ground of the user's style, or in axes of the user, are exchanged."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import Collection
from matplotlib.colors import ListedColormap, to_rgb, to_rgba
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.text import Text

from nsdrill.data import Array
from nsdrill.plot.page import panels_of
from nsdrill.plot.style import contrast, halo, luminance

if TYPE_CHECKING:
    from matplotlib.typing import ColorType

CONTRAST = 4.5  # least ratio of luminances of a mark and the page (WCAG 2.1)
DARK = 0.2  # greatest luminance of a ground that is dark
PALE = 0.6  # least part of a colour that is a ground behind marks rather than a mark


def on_dark_page(figure: Figure, artists: Iterable[Artist]) -> None:
    """Exchange the colours of ``artists`` that are lost on the page of the ``figure``, or
    in a panel of it, where that is dark: white, the paper, becomes the ground, and marks
    become lighter."""
    page = _over(np.ones(3), figure.get_facecolor())
    in_legends = {artist for legend in figure.findobj(Legend) for artist in legend.findobj()}
    for artist in artists:
        axes = None if artist in in_legends else artist.axes
        ground = _over(page, axes.get_facecolor()) if isinstance(axes, Axes) else page
        if luminance(ground) <= DARK:
            _exchange_all(artist, ground)


def _over(ground: Array, colour: ColorType) -> Array:
    """A colour [red, green, blue] that is laid over a ground, which shows where it is
    transparent."""
    *rgb, alpha = to_rgba(colour)
    return alpha * np.array(rgb) + (1.0 - alpha) * ground


def _exchange_all(artist: Artist, ground: Array) -> None:
    """Exchange the colours of an artist that are lost on the ``ground``."""

    def shown(colour: ColorType, *, is_mark: bool = False) -> ColorType:
        if isinstance(colour, str) and colour in ("none", "auto", "None", "inherit", "face"):
            return colour
        *rgb, alpha = to_rgba(colour)
        return (*visible(np.array(rgb), ground, is_mark=is_mark), alpha)

    if isinstance(artist, Line2D):
        _exchange(artist, partial(shown, is_mark=True), "color", "markerfacecolor", "markeredgecolor")
    elif isinstance(artist, Patch):
        _exchange(artist, shown, "facecolor", "edgecolor")
    elif isinstance(artist, Text):
        text = np.array(to_rgb(artist.get_color()))
        if contrast(text, ground) < CONTRAST:  # else of the style, which may be white
            artist.set_color(shown(artist.get_color()))
        if artist.get_path_effects():
            artist.set_path_effects(halo(2.0, tuple(ground)))
    elif isinstance(artist, Collection) and artist.get_array() is None:
        for name in ("facecolor", "edgecolor"):
            colours = getattr(artist, f"get_{name}")()
            if len(colours) and not isinstance(colours, str):
                getattr(artist, f"set_{name}")([shown(colour) for colour in colours])
    elif isinstance(artist, Collection) and isinstance(scale := artist.cmap, ListedColormap) and scale.N < 32:
        artist.set_cmap(ListedColormap(list(map(shown, np.asarray(scale.colors).tolist())), name=scale.name))


def marks_of(figure: Figure) -> list[Artist]:
    """What is drawn on a figure, without the frames, ticks and grids of its panels,
    which have the colours of the style."""
    frames: set[Artist] = {figure.patch}
    for axes in panels_of(figure):
        frames.update({axes.patch, *axes.xaxis.findobj(), *axes.yaxis.findobj()})
        frames.update(axes.spines.values())
    return [artist for artist in figure.findobj() if artist not in frames]


def visible(colour: Array, ground: Array, *, is_mark: bool = False) -> Array:
    """The colour [red, green, blue] that stands for ``colour`` on this ground. White is
    paper; a pale colour is that of a ground too, but of a mark that of one behind others:
    it becomes as dark as can be seen."""
    start, end = colour, np.ones(3)
    if np.min(colour) > PALE and np.max(colour) > 0.82:
        if not is_mark or np.min(colour) == 1.0:
            return np.clip(ground + (0.25 * colour if np.ptp(colour) >= 0.05 else 1.0 - colour), 0, 1)
        start, end = ground, colour
    elif np.ptp(colour) < 0.05 and contrast(colour, ground) < CONTRAST:
        return 1.0 - colour
    share = 0.0
    while share < 1.0 and contrast(start + share * (end - start), ground) < CONTRAST:
        share = min(share + 0.05, 1.0)
    return start + share * (end - start)


def _exchange(artist: Artist, shown: Callable[[ColorType], ColorType], *names: str) -> None:
    """Exchange the colours of these names, those that are equal for equal ones."""
    colours = [getattr(artist, f"get_{name}")() for name in names]  # before one is set
    for name, colour in zip(names, map(shown, colours), strict=True):
        getattr(artist, f"set_{name}")(colour)
