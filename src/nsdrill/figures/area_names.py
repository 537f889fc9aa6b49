"""Words in the regions of a map, each where it has most room, and none where it has not
enough."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.text import Text
from matplotlib.transforms import Bbox

from nsdrill.data import Array
from nsdrill.figures.cells import Cells
from nsdrill.figures.style import Properties, font_size, halo, ink_on

PIXEL = 2.0  # points of a panel, in which room is measured
MARGIN = 2  # pixels around a word
SIZES = (8.0, 6.5)  # points of words, the larger ones first
Named = Mapping[int, tuple[str, str]]  # by code: the words, and the colour of their ground


def name_regions(axes: Axes, cells: Cells, codes: Array, named: Named, clear: Sequence[Bbox] = ()) -> None:
    """Write into every region of equal ``codes`` [y, x] its words, in two lines or one,
    across or upright, as large as they fit; none over the boxes ``clear`` [pixels of the
    figure]. The panel has its size. The names of the texts are ``area:CODE``."""
    from scipy import ndimage

    box = axes.get_window_extent()
    step = PIXEL * axes.figure.dpi / 72
    x, y = (np.arange(low + 0.5 * step, high, step) for low, high in ((box.x0, box.x1), (box.y0, box.y1)))
    if not x.size or not y.size:
        return
    to_data = axes.transData.inverted()
    across = to_data.transform(np.column_stack([x, np.full(x.size, y[0])]))[:, 0]
    up = to_data.transform(np.column_stack([np.full(y.size, x[0]), y]))[:, 1]
    place_x, place_y = (
        np.clip(np.searchsorted(ends, at) - 1, 0, len(ends) - 2) for ends, at in zip(cells, (across, up), strict=True)
    )
    shown, free = codes[np.ix_(place_y, place_x)], ~_within(y, x, clear)
    for code, (words, ground) in named.items():
        regions, count = ndimage.label(shown == code)
        for number in range(1, count + 1):
            _write(axes, (regions == number) & free, (across, up), words, ground, f"area:{code}", step)


def _within(y: Array, x: Array, boxes: Sequence[Bbox]) -> Array:
    """Which pixels [y, x] lie in one of the boxes."""
    inside = np.zeros((len(y), len(x)), dtype=bool)
    for box in boxes:
        inside |= ((y > box.y0) & (y < box.y1))[:, None] & ((x > box.x0) & (x < box.x1))
    return inside


def _write(
    axes: Axes, region: Array, places: tuple[Array, Array], words: str, ground: str, gid: str, step: float
) -> None:
    """Write the words into one region of pixels, in the first form that has room."""
    from scipy import ndimage

    if not np.any(region):
        return
    deep = ndimage.distance_transform_edt(np.pad(region, 1))[1:-1, 1:-1]
    for text in _forms(axes, words, ground, gid):
        extent = text.get_window_extent()
        size = tuple(int(np.ceil(length / step)) + 2 * MARGIN for length in (extent.height, extent.width))
        room = ndimage.minimum_filter(region.astype(np.uint8), size, mode="constant")
        if np.any(room):
            row, column = np.unravel_index(int(np.argmax(np.where(room, deep, -1.0))), region.shape)
            text.set_position((places[0][column], places[1][row]))
            return
        text.remove()


def _forms(axes: Axes, words: str, ground: str, gid: str) -> Iterator[Text]:
    """The words as texts of the axes: of each size in their lines, in one line, and
    upright."""
    style: Properties = {"ha": "center", "va": "center", "zorder": 4.5, "clip_on": True, "fontweight": "bold"}
    one_line = words.replace("\n", " ")
    x, y = (float(np.mean(ends)) for ends in (axes.get_xlim(), axes.get_ylim()))
    for size in SIZES:
        for text, rotation in dict.fromkeys(((words, 0), (one_line, 0), (one_line, 90))):
            yield axes.text(
                x,
                y,
                text,
                fontsize=font_size(size),
                rotation=rotation,
                color=ink_on(ground),
                path_effects=halo(2.0, ground),
                linespacing=1.1,
                gid=gid,
                **style,
            )
