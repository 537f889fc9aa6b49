"""Words in the regions of a map, each where it has most room, and none where it has not
enough."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

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
        regions, _ = ndimage.label(shown == code)
        forms = [(form, _needed(axes, form, ground, step)) for form in (_forms(words) if np.any(regions) else ())]
        for number, (rows, columns) in enumerate(ndimage.find_objects(regions), start=1):
            region = (regions[rows, columns] == number) & free[rows, columns]
            if found := _place(region, forms):
                form, row, column = found
                at = across[columns][column], up[rows][row]
                _text(axes, form, ground).set(position=at, gid=f"area:{code}")


def _within(y: Array, x: Array, boxes: Sequence[Bbox]) -> Array:
    """Which pixels [y, x] lie in one of the boxes."""
    inside = np.zeros((len(y), len(x)), dtype=bool)
    for box in boxes:
        inside |= ((y > box.y0) & (y < box.y1))[:, None] & ((x > box.x0) & (x < box.x1))
    return inside


class _Form(NamedTuple):
    words: str
    size: float
    rotation: int


def _forms(words: str) -> Iterator[_Form]:
    """The words of each size in their lines, in one line, and upright."""
    one_line = words.replace("\n", " ")
    for size in SIZES:
        for text, rotation in dict.fromkeys(((words, 0), (one_line, 0), (one_line, 90))):
            yield _Form(text, size, rotation)


def _text(axes: Axes, form: _Form, ground: str) -> Text:
    """The words as a text in the middle of the axes."""
    style: Properties = {"ha": "center", "va": "center", "zorder": 4.5, "clip_on": True, "fontweight": "bold"}
    x, y = (float(np.mean(ends)) for ends in (axes.get_xlim(), axes.get_ylim()))
    return axes.text(
        x,
        y,
        form.words,
        fontsize=font_size(form.size),
        rotation=form.rotation,
        color=ink_on(ground),
        path_effects=halo(2.0, ground),
        linespacing=1.1,
        **style,
    )


def _needed(axes: Axes, form: _Form, ground: str, step: float) -> tuple[int, int]:
    """The room of a text, in pixels [y, x]."""
    text = _text(axes, form, ground)
    extent = text.get_window_extent()
    text.remove()
    height, width = (int(np.ceil(length / step)) + 2 * MARGIN for length in (extent.height, extent.width))
    return height, width


def _place(region: Array, forms: Sequence[tuple[_Form, tuple[int, int]]]) -> tuple[_Form, int, int] | None:
    """The first form that has room in a region of pixels, with the row and the column of its
    middle; None where none has."""
    from scipy import ndimage

    for form, size in forms:
        if size[0] > region.shape[0] or size[1] > region.shape[1]:
            continue
        room = ndimage.minimum_filter(region.astype(np.uint8), size, mode="constant")
        if np.any(room):
            deep = ndimage.distance_transform_edt(np.pad(region, 1))[1:-1, 1:-1]
            row, column = np.unravel_index(int(np.argmax(np.where(room, deep, -1.0))), region.shape)
            return form, int(row), int(column)
    return None
