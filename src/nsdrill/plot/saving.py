"""Writes a figure to a file: equal figures give equal bytes, and a file is complete or
not written at all."""

from __future__ import annotations

import io
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from nsdrill.errors import InputError
from nsdrill.files import replacing

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# A date in the file would make two equal figures differ.
FORMATS: dict[str, dict[str, Any]] = {
    ".png": {},
    ".pdf": {"CreationDate": None, "ModDate": None},
    ".svg": {"Date": None},
}


def check_suffix(path: str | os.PathLike[str]) -> str:
    """The suffix of ``path``, in lower case. InputError where it is that of no format of
    pictures; called before anything is drawn."""
    suffix = Path(path).suffix.lower()
    if suffix not in FORMATS:
        raise InputError(
            f"{os.fspath(path)}: found {suffix or 'no suffix'!r} as the kind of picture; allowed: {', '.join(FORMATS)}."
        )
    return suffix


def save(figure: Figure, path: str | os.PathLike[str], *, overwrite: bool = True) -> None:
    """Write the figure as PNG (300 dpi where no style says otherwise), PDF or SVG, by
    the suffix of ``path``, in one step.

    InputError where ``path`` cannot be that of a picture, FileError where another
    process is writing it or, without ``overwrite``, it exists already; NsdrillError
    where it cannot be written.
    """
    from nsdrill.plot.style import house_style, without_glyph_warnings

    suffix, target = check_suffix(path), Path(path)
    if not target.parent.is_dir():
        raise InputError(f"{target}: found no folder {str(target.parent)!r}; allowed: a folder that exists.")
    if target.is_dir():
        raise InputError(f"{target}: cannot be written, as it is a folder; allowed: the name of a file.")
    settings = getattr(figure, "settings", None)
    with replacing(target, overwrite=overwrite) as file, house_style(settings), without_glyph_warnings():
        figure.savefig(file, format=suffix[1:], metadata=FORMATS[suffix])


MAX_CELLS = 1500  # of the maps of a figure in a page; of more the cells become an image


def svg(figure: Figure) -> str:
    """The figure as the text of an SVG file for a page: its words are text, and the
    cells of its maps an image where they are many."""
    from matplotlib.collections import QuadMesh

    from nsdrill.plot.style import house_style, without_glyph_warnings

    meshes: list[Any] = figure.findobj(QuadMesh)
    if sum(int(np.size(mesh.get_array())) for mesh in meshes) > MAX_CELLS:
        for mesh in meshes:
            mesh.set_rasterized(True)
    text = io.StringIO()
    with house_style(getattr(figure, "settings", None)), without_glyph_warnings():
        figure.savefig(text, format="svg", metadata=FORMATS[".svg"])
    return text.getvalue()
