"""Pictures of sweeps and traces: data in memory in, a matplotlib figure out; opens no
file of data.

matplotlib is imported when something is drawn or asked for, and pyplot never: no
window, no global state.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from inspect import Signature, signature
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np

from nsdrill.data import Results
from nsdrill.errors import InputError
from nsdrill.models.registry import model_in
from nsdrill.plot.labels import UNIT_SYSTEMS, check_units
from nsdrill.plot.limits import within
from nsdrill.plot.look import Look, look_of
from nsdrill.plot.registry import all_kinds, check_options, choose_kind, kinds_for, variables_for
from nsdrill.plot.saving import FORMATS, check_suffix, save
from nsdrill.variables import INFERRED, OK, has_failed

if TYPE_CHECKING:
    from matplotlib.figure import Figure

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
]


def draw(
    data: Any,
    kind: str | None = None,
    *,
    units: str = "si",
    at: Mapping[str, float] | None = None,
    start: int | None = None,
    look: Look | None = None,
    **options: Any,
) -> Figure:
    """Draw ``data`` in one of its :func:`kinds_for`, the first of them if ``kind`` is
    None.

    ``units`` are ``si`` (as engineers write it: kN, mm) or ``field``. ``at`` holds axes
    of a sweep at one of their values, in SI: ``{"wob": 22240.0}`` draws the cut of a
    map. ``start`` draws one start of every operating point, where there are several.
    ``look`` is how the user wants it to look. Other ``options`` are those that the kind
    takes (None is as not given): ``over``, a sweep to draw a ``ramp`` over, or branches
    whose curves are drawn over a map; ``states``, the two over which an ensemble's
    ``basin`` is drawn; ``severity`` of a ``window`` or ``tornado``, ``confidence`` (0
    to 1) of a ``window`` or of ``probability``, where numbers are uncertain.
    """
    check_units(units)
    given = {name: value for name, value in options.items() if value is not None}
    look = look or Look()
    curves = None
    if isinstance(data, Results) and "over" in given and not isinstance(given["over"], Results):
        curves = given.pop("over")
    if isinstance(data, Results):
        data = cut(data, at, start)
    if kind is None and "over" in given and "ramp" in kinds_for(data):
        kind = "ramp"
    chosen = choose_kind(data, kind)
    check_options(chosen, given)
    data, ends = within(data, chosen, look)
    from nsdrill.plot.style import (
        house_style,
        looking,
        quiet_glyphs,
        say_inside,
        settle,
        show_between,
    )

    with looking(look), house_style(), quiet_glyphs():
        figure = chosen.draw(data, units, **given)
        if isinstance(data, Results) and (words := nothing_words(data)):
            say_inside(figure, words)
        if ends is not None:
            show_between(figure, str(chosen.across(data)), ends, units)
        if curves is not None:
            _draw_borders(figure, data, curves, units)
        settle(figure)
    return figure


def nothing_words(data: Results) -> str:
    """What is to be said of results in which no point ended well; empty where one did."""
    status = data.variables["status"]
    if np.any((status == OK) | (status == INFERRED)):
        return ""
    failed, points = int(np.count_nonzero(has_failed(status))), status.size
    waiting = f", {points - failed} not run yet" if failed < points else ""
    return f"Nothing to show: no point ended well\n({failed} of {points} failed{waiting})"


def needed(
    outline: Results,
    kind: str | None = None,
    at: Mapping[str, float] | None = None,
    start: int | None = None,
) -> tuple[str, ...]:
    """The variables that :func:`draw` uses of a sweep with these coordinates;
    ``outline`` has no numbers in it."""
    names = variables_for(choose_kind(cut(outline, at, start), kind).name, model_in(outline.attrs))
    return tuple(name for name in names if name in outline.variables)


def cut(data: Results, at: Mapping[str, float] | None, start: int | None = None) -> Results:
    """A sweep with every axis ascending, cut at the values ``at`` of some (SI), and at
    one of its starts."""
    from nsdrill.plot.slices import one_sample, one_start, ordered
    from nsdrill.variables import SAMPLE, dimension_of

    given = at or {}
    at = {dimension_of(key): value for key, value in given.items()}
    if SAMPLE in at:
        data = one_sample(data, at.pop(SAMPLE))
    if unknown := set(at) - set(data.axes):
        keys = {dimension_of(key): key for key in given}
        found, allowed = (
            ", ".join(keys.get(name, name) for name in names)
            for names in (sorted(unknown), data.axes)
        )
        raise InputError(f"--at: found {found}; allowed: {allowed}.")
    return ordered(data if start is None else one_start(data, start), at)


class _Room(ModuleType):
    """Python gives the name ``nsdrill.plot`` to this room once it is imported, and
    users know it as a function."""

    def __call__(self, data: Any, kind: str | None = None, **options: Any) -> Figure:
        """Draw a file or a Dataset: see :func:`nsdrill.api.plot`."""
        import nsdrill

        figure: Figure = nsdrill.api.plot(data, kind, **options)
        return figure

    @property
    def __signature__(self) -> Signature:
        """What editors and notebooks show of the call."""
        import nsdrill

        return signature(nsdrill.api.plot)


sys.modules[__name__].__class__ = _Room


def _draw_borders(figure: Figure, data: Results, over: Any, units: str) -> None:
    """Curves of branches over the map of a sweep over two axes."""
    from nsdrill.plot.branches import check_same_string, draw_borders
    from nsdrill.plot.maps import Planes

    if len(data.swept) != 2:
        raise InputError(
            "--over: found curves with no map over two axes; allowed: the map of a sweep over two."
        )
    planes = Planes.of(data)
    held = {name: float(over[name].values.ravel()[0]) for name in data.held if name in over}
    check_same_string(over, data, held)
    draw_borders(figure, over, planes.x, planes.y, units)
