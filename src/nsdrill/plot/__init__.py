"""Pictures of sweeps and traces: data in memory in, a matplotlib figure out; opens no file of data.

matplotlib is imported when something is drawn, and pyplot never: no window, no global state.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from inspect import Signature, signature
from types import ModuleType
from typing import TYPE_CHECKING, Any

from nsdrill.data import Results, Trace
from nsdrill.errors import InputError
from nsdrill.models.registry import model_in
from nsdrill.plot.kinds import (
    DESCRIPTIONS,
    START_KINDS,
    SWEEP_KINDS,
    choose_kind,
    fits_columns,
    kinds_for,
    variables_for,
)  # fmt: skip
from nsdrill.plot.labels import UNIT_SYSTEMS, check_units
from nsdrill.plot.saving import FORMATS, check_suffix, save

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = [
    "DESCRIPTIONS", "FORMATS", "UNIT_SYSTEMS", "check_suffix", "cut", "draw", "draw_window", "kinds_for", "needed",
    "save",
]  # fmt: skip


def draw(
    data: Results | Trace, kind: str | None = None, *, units: str = "si", at: Mapping[str, float] | None = None,
    over: Any = None, start: int | None = None, states: Sequence[str] | None = None,
) -> Figure:  # fmt: skip
    """Draw ``data`` in one of its :func:`kinds_for`, the first of them if ``kind`` is None.

    ``units`` are ``si`` (as engineers write it: kN, mm) or ``field``. ``at`` holds axes of a sweep at one of their
    values, in SI: ``{"wob": 22240.0}`` draws the cut of a map. ``over`` is a sweep for the kind ``ramp`` to be drawn
    over, or branches whose curves are drawn over a map. ``start`` draws one start of every operating point, where there
    are several; ``states`` are the two over which an ensemble's ``basin`` is drawn.
    """
    check_units(units)
    from nsdrill.plot.style import house_style, settle

    with house_style():
        if isinstance(data, Trace):
            figure = _draw_trace(data, kind, units, over)
        else:
            if isinstance(over, Results):
                raise InputError(
                    "--over: found with a sweep; allowed: with branches, or the trace of a ramp and --kind ramp; over "
                    "a map the curves of branches."
                )
            shown = cut(data, at, start)
            figure = _draw_sweep(shown, kind, units, states)
            if over is not None:
                _draw_borders(figure, shown, over, units)
        settle(figure)
    return figure


def _draw_borders(figure: Figure, data: Results, over: Any, units: str) -> None:
    """Curves of branches over the map of a sweep over two axes."""
    from nsdrill.plot.branches import draw_borders
    from nsdrill.plot.maps import Planes

    if len(data.swept) != 2:
        raise InputError("--over: found curves with no map over two axes; allowed: the map of a sweep over two.")
    planes = Planes.of(data)
    draw_borders(figure, over, planes.x, planes.y, units)


def draw_window(data: Results, severity: int | None = None, *, units: str = "si") -> Figure:
    """The kind ``window``, by severity where that is given: see :func:`nsdrill.analysis.window.find_window`."""
    check_units(units)
    from nsdrill.plot import window
    from nsdrill.plot.style import house_style, settle

    with house_style():
        figure = window.draw(cut(data, None), units, severity)
        settle(figure)
    return figure


def needed(
    outline: Results, kind: str | None = None, at: Mapping[str, float] | None = None, start: int | None = None
) -> tuple[str, ...]:
    """The variables that :func:`draw` uses of a sweep with these coordinates; ``outline`` has no numbers in it."""
    names = variables_for(choose_kind(cut(outline, at, start), kind), model_in(outline.attrs))
    return tuple(name for name in names if name in outline.variables)


def cut(data: Results, at: Mapping[str, float] | None, start: int | None = None) -> Results:
    """A sweep with every axis ascending, cut at the values ``at`` of some (SI), and at one of its starts."""
    from nsdrill.plot.slices import one_start, ordered
    from nsdrill.variables import dimension_of

    given = at or {}
    at = {dimension_of(key): value for key, value in given.items()}
    if unknown := set(at) - set(data.axes):
        keys = {dimension_of(key): key for key in given}
        found, allowed = (", ".join(keys.get(name, name) for name in names) for names in (sorted(unknown), data.axes))
        raise InputError(f"--at: found {found}; allowed: {allowed}.")
    return ordered(data if start is None else one_start(data, start), at)


def _draw_trace(trace: Trace, kind: str | None, units: str, over: Results | None) -> Figure:
    from nsdrill.plot import poincare, ramp, traces

    kind = choose_kind(trace, "ramp" if over is not None and kind is None else kind)
    if kind == "ramp":
        return ramp.draw(trace, units, over)
    if over is not None:
        raise InputError(f"--over: found with --kind {kind}; allowed: with --kind ramp.")
    if kind == "section":
        return poincare.draw_trace(trace, units, traces.title_of(trace, units))
    return traces.draw(trace, kind, units)


def _draw_sweep(data: Results, kind: str | None, units: str, states: Sequence[str] | None) -> Figure:
    from nsdrill.plot import basin, bifurcation, coexisting, maps, motion, poincare, shares, summary, window

    kind = choose_kind(data, kind)
    if states and kind != "basin":
        raise InputError(f"--states: found with the kind {kind!r}; allowed: with basin.")
    if kind == "basin":
        return basin.draw(data, units, states)
    if kind in START_KINDS:
        return shares.draw(data, units) if kind == "shares" else coexisting.draw(data, units)
    if kind == "window":
        return window.draw(data, units)
    if kind == "bifurcation":
        return bifurcation.draw(data, units)
    if kind == "poincare":
        return poincare.draw(data, units)
    if kind == "section":
        return poincare.draw_point(data, units)
    if kind == "motion" and fits_columns(data):
        return motion.draw(data, units)
    if kind in SWEEP_KINDS or len(data.swept) < 2:
        return summary.draw(data, kind, units)
    return maps.draw(data, kind, units)


class _Room(ModuleType):
    """Python gives the name ``nsdrill.plot`` to this room once it is imported, and users know it as a function."""

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
