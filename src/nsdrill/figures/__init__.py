"""Pictures of sweeps and traces: from data in memory to a matplotlib figure, and that
to a file: equal figures give equal bytes, and a file is complete or not written at all.
No data file is opened here.

matplotlib is imported only when something is drawn, and pyplot never: no window system,
no global state.
"""

from __future__ import annotations

import io
import os
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import IO, TYPE_CHECKING, TypeVar, cast

import numpy as np

from nsdrill.analysis.counts import of_scripts
from nsdrill.data import Results, Trace
from nsdrill.errors import InputError, Refusal, option
from nsdrill.figures.look import Look, look_of, refuse_with_axes
from nsdrill.figures.picture_kinds import (
    all_kinds,
    check_options,
    choose_kind,
    describe,
    is_branches,
    kinds_for,
    variables_for,
)
from nsdrill.figures.slices import ordered, select
from nsdrill.files import CheckedFile, replacing
from nsdrill.models.registry import model_in
from nsdrill.variables import AXES, SAMPLE, dimension_of
from nsdrill.words.labels import UNIT_SYSTEMS, check_units

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from nsdrill.figures.picture_kinds import Drawable

D = TypeVar("D", bound="Drawable")

__all__ = [
    "FORMATS",
    "UNIT_SYSTEMS",
    "all_kinds",
    "check_suffix",
    "cut",
    "draw",
    "kinds_for",
    "look_of",
    "needed",
    "save",
    "svg",
]


def draw(
    data: Drawable,
    kind: str | None = None,
    *,
    units: str = "si",
    at: Mapping[str, float] | None = None,
    start: int | None = None,
    look: Look | None = None,
    panel: str | None = None,
    ax: Axes | None = None,
    **options: object,
) -> Figure:
    """Draw ``data`` in one of its :func:`kinds_for`, the first of them if ``kind`` is
    None.

    ``units`` are ``si`` (as engineers write it: kN, mm) or ``field``. ``at`` fixes axes
    of a sweep at one of their values, in SI: ``{"wob": 22240.0}`` draws the cut of a
    map. ``start`` draws one start of every operating point, where there are several.
    ``look`` is how the user wants it to look. ``panel`` draws one panel alone, ``ax``
    into axes of the caller. Other ``options`` are those that the kind takes (None has
    no effect): ``over``, a sweep to draw a ``ramp`` or ``branches`` over, or branches
    whose curves are drawn over a map; ``states``, the two over which an ensemble's
    ``basin`` is drawn; ``severity`` of a ``window`` or ``tornado``, ``confidence`` (0
    to 1) of a ``window`` or of ``probability``, where numbers are uncertain.
    """
    check_units(units)
    asked = {name: value for name, value in options.items() if value is not None}
    if panel is not None and not isinstance(panel, str):
        raise InputError(f"panel: found a value of the type {type(panel).__name__}; allowed: the name of one panel.")
    curves = asked.pop("over") if isinstance(data, Results) and is_branches(asked.get("over")) else None
    if not isinstance(data, Results):
        _refuse_choices(data, [name for name in _CHOICES if name in asked])
    data = cut(data, at, start)
    if kind is None and "over" in asked and "ramp" in kinds_for(data):
        kind = "ramp"
    chosen_kind, rest = choose_kind(data, kind, panel)
    of_kind = f"{chosen_kind.name} " if panel != rest else ""
    check_options(chosen_kind, asked)
    if ax is not None and look is not None:
        refuse_with_axes(look)
    from nsdrill.figures.drawing import Drawing

    return Drawing(chosen_kind, data, units, asked, look or Look(), curves).draw(rest, ax, of_kind)


def needed(
    outline: Results,
    kind: str | None = None,
    at: Mapping[str, float] | None = None,
    start: int | None = None,
    panel: str | None = None,
) -> tuple[str, ...]:
    """The variables that :func:`draw` uses of a sweep with the coordinates of
    ``outline``, which has no numbers in it."""
    chosen_kind, _ = choose_kind(cut(outline, at, start), kind, panel)
    names = variables_for(chosen_kind.name, model_in(outline.attrs))
    if chosen_kind.name == "window":  # with its warnings
        names = (*names, *of_scripts(outline.attrs))
    return tuple(name for name in names if name in outline.variables)


def cut(data: D, at: Mapping[str, float] | None, start: int | None = None) -> D:
    """A sweep with every axis ascending, cut at the values ``at`` of some (SI), and at
    one of its starts; other data as they are."""
    if not isinstance(data, Results):
        _refuse_choices(data, [*(at or ()), *(["start"] if start is not None else [])])
        return data
    results: Results = data
    values_by_key = at or {}
    at = {dimension_of(key): value for key, value in values_by_key.items()}
    if SAMPLE in at:
        results = select(results, SAMPLE, at.pop(SAMPLE))
    if unknown := set(at) - set(results.axes):
        keys = {dimension_of(key): key for key in values_by_key}
        unknown_keys, allowed = (
            ", ".join(keys.get(name, name) for name in names) for names in (sorted(unknown), results.axes)
        )
        raise InputError(f"{option('at')}: found {unknown_keys}; allowed: {allowed}.")
    return cast("D", ordered(results if start is None else select(results, "start", start), at))


def _refuse_choices(data: object, names: Iterable[str]) -> None:
    """InputError where a choice of points was given for a trace or branches."""
    for name in names:
        argument = name if name in (*AXES, *_CHOICES) else "at"
        which = ", which is of one point" if isinstance(data, Trace) else ""
        raise Refusal(argument, f"with {describe(data)}{which}", "with the results of a sweep")


_CHOICES = ("start", "states", "severity", "confidence")


# A date in the file would make two equal figures differ.
FORMATS: dict[str, dict[str, None]] = {
    ".png": {},
    ".pdf": {"CreationDate": None, "ModDate": None},
    ".svg": {"Date": None},
}


def check_suffix(path: str | os.PathLike[str], allowed: Iterable[str] = FORMATS, of: str = "picture") -> str:
    """The suffix of ``path``, in lower case. InputError where it is none of those
    ``allowed``; called before anything is drawn."""
    if (suffix := Path(path).suffix.lower()) not in allowed:
        found = suffix or "no suffix"
        raise InputError(f"{os.fspath(path)}: found {found!r} as the kind of {of}; allowed: {', '.join(allowed)}.")
    return suffix


def save(figure: Figure, path: str | os.PathLike[str], *, overwrite: bool = True) -> None:
    """Write the figure as PNG (300 dpi where no style says otherwise), PDF or SVG, by
    the suffix of ``path``, in one step.

    InputError where ``path`` cannot be that of a picture, FileError where another
    process is writing it or, without ``overwrite``, it exists already; NsdrillError
    where it cannot be written.
    """
    suffix, target = check_suffix(path), Path(path)
    if not target.parent.is_dir():
        raise InputError(f"{target}: found no folder {str(target.parent)!r}; allowed: a folder that exists.")
    if target.is_dir():
        raise InputError(f"{target}: cannot be written, as it is a folder; allowed: the name of a file.")
    with replacing(target, overwrite=overwrite) as file:
        _write(figure, file, suffix)


def _write(figure: Figure, file: IO[bytes] | CheckedFile, suffix: str) -> None:
    """Write the figure in the style in which it was drawn."""
    from nsdrill.figures.style import house_style, without_glyph_warnings

    with house_style(getattr(figure, "settings", None)), without_glyph_warnings():
        figure.savefig(file, format=suffix[1:], metadata=FORMATS[suffix])


MAX_CELLS, MAX_DOTS = 1500, 2000  # of a figure in a page; more of them become an image


def svg(figure: Figure) -> str:
    """The figure as the text of an SVG file for a page: its words are text, the cells of
    its maps and its dots an image where they are many, and its places hundredths of a
    point."""
    from matplotlib.collections import QuadMesh
    from matplotlib.lines import Line2D

    meshes = [mesh for mesh in figure.findobj(QuadMesh) if isinstance(mesh, QuadMesh)]
    if sum(np.asarray(mesh.get_array()).size for mesh in meshes) > MAX_CELLS:
        for mesh in meshes:
            mesh.set_rasterized(True)
    marked = [line for line in figure.findobj(Line2D) if isinstance(line, Line2D) and line.get_linestyle() == "None"]
    if sum(len(np.atleast_1d(line.get_xdata())) for line in marked) > MAX_DOTS:
        for line in marked:
            line.set_rasterized(len(np.atleast_1d(line.get_xdata())) > 1)
    text = io.BytesIO()
    _write(figure, text, ".svg")
    return re.sub(r'\b(?:d|x|y)="[^"]*"', _rounded, text.getvalue().decode())


def _rounded(places: re.Match[str]) -> str:
    """The places of an element in hundredths, and without the blanks before a command."""
    return re.sub(r"\s+(?=[A-Z])", "", re.sub(r"(\.\d\d)\d+", r"\1", places[0]))
