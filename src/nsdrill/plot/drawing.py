"""One picture, from its kind and data to a figure that is laid out, and to a file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from nsdrill.data import Results
from nsdrill.errors import InputError, option
from nsdrill.plot.into import draw_panel
from nsdrill.plot.kinds.branches import check_same_string, draw_branch_curves
from nsdrill.plot.look import Look, apply_limits, limit_y_axes
from nsdrill.plot.maps import Planes
from nsdrill.plot.page import freeze_layout, limit_x_axes, panels_of, write_in_largest_panel
from nsdrill.plot.registry import Kind
from nsdrill.plot.style import house_style, marks_of, on_dark_page, using_look, without_glyph_warnings
from nsdrill.variables import INFERRED, OK, has_failed

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Drawing:
    """A picture of a ``kind``: what it is drawn of, in which units, with which options
    of that kind, and how the user wants it to look; ``curves`` are branches whose
    curves are drawn over it."""

    def __init__(
        self, kind: Kind, data: Any, units: str, options: Mapping[str, Any], look: Look, curves: Any = None
    ) -> None:
        self.kind, self.units, self.options, self.look, self.curves = kind, units, options, look, curves
        self.data, self.ends = apply_limits(data, kind, look)

    def draw(self, panel: str | None, axes: Axes | None) -> Figure:
        """The figure; or that with one ``panel`` alone, into ``axes`` if given."""
        alone = panel is not None or axes is not None
        with using_look(self.look), house_style(), without_glyph_warnings():
            figure = self._picture(limits_y=not alone)
            freeze_layout(figure)
            earlier = set(axes.findobj()) if isinstance(axes, Artist) else set()
            if alone:
                figure = draw_panel(lambda: self._picture(limits_y=True), figure, panel, axes)
            marks = marks_of(figure, panels_of(figure))
            on_dark_page(figure, [mark for mark in marks if mark not in earlier])
            if alone and axes is None:
                freeze_layout(figure)
        return figure

    def _picture(self, *, limits_y: bool) -> Figure:
        """The picture as its kind draws it, with what can be on pictures of all
        kinds."""
        data, across = self.data, self.kind.across(self.data)
        figure = self.kind.draw(data, self.units, **self.options)
        if isinstance(data, Results) and (message := no_data_message(data)):
            write_in_largest_panel(figure, message)
        if (finish := getattr(figure, "finish", None)) is not None:  # one panel alone
            finish(across, self.units)
        if self.ends is not None:
            limit_x_axes(figure, str(across), self.ends, self.units)
        if self.curves is not None:
            self._draw_curves(figure)
        if self.look.ylim is not None and limits_y:
            limit_y_axes(panels_of(figure), self.look.ylim, self.units, getattr(data, "axes", ()))
        return figure

    def _draw_curves(self, figure: Figure) -> None:
        """Curves of branches over the map of a sweep over two axes."""
        if len(self.data.swept) != 2:
            raise InputError(
                f"{option('over')}: found branches, with a sweep over one axis; allowed: a map over two axes, over "
                "which their curves are drawn. For branches over the peaks of this sweep, give the file of "
                f"branches first and the sweep with {option('over')}."
            )
        held = [name for name in self.data.held if name in self.curves]
        fixed = {name: float(self.curves[name].values.ravel()[0]) for name in held}
        check_same_string(self.curves, self.data, fixed)
        draw_branch_curves(figure, self.curves, Planes.of(self.data, self.units))


def no_data_message(data: Results) -> str:
    """The message on a picture of results in which no point ended well; empty where one
    did."""
    status = data.variables["status"]
    if np.any((status == OK) | (status == INFERRED)):
        return ""
    failed, points = int(np.count_nonzero(has_failed(status))), status.size
    waiting = f", {points - failed} not run yet" if failed < points else ""
    return f"Nothing to show: no point ended well\n({failed} of {points} failed{waiting})"
