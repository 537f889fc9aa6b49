"""A picture of a single panel, drawn into axes that the caller has made."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, cast

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.transforms import ScaledTranslation

from nsdrill.errors import InputError
from nsdrill.plot import style

LEGEND_BELOW = 32.0  # points: room for the ticks and the label of the x axis


def into_axes(picture: Callable[[], Figure], axes: Any, kind: str | None) -> Figure:
    """Draw ``picture`` into ``axes`` and return the figure that contains them. Where
    ``axes`` are not axes of matplotlib, or the picture has more than one panel, the
    error is an InputError and nothing is drawn."""
    if not isinstance(axes, Axes):
        raise InputError(
            f"ax: found a value of the type {type(axes).__name__}; allowed: axes of matplotlib."
        )
    panels = [panel for panel in picture().axes if panel.get_label() != "<colorbar>"]
    if len(panels) != 1:
        what = f"the kind {kind!r}, which has" if kind else "a picture with"
        raise InputError(
            f"ax: found {what} {len(panels)} axes here; allowed: a kind with one, as orbit of a "
            f"trace, basin, shares, "
            "or map and window of a sweep with one procedure over two axes. Without ax it is a "
            "figure of its own."
        )
    title = axes.get_title()
    with _drawing_into(axes):
        picture()
    axes.set_title(title)
    figure: Any = axes.figure
    while not isinstance(figure, Figure):  # a SubFigure
        figure = figure.figure
    return figure


@contextmanager
def _drawing_into(axes: Axes) -> Iterator[None]:
    token = style.target.set(cast("Figure", _FigureProxy(axes)))
    try:
        yield
    finally:
        style.target.reset(token)


class _SingleCellGrid:
    """A grid whose every cell is the axes of the caller."""

    def __getitem__(self, place: Any) -> None:
        return None


class _FigureProxy:
    """Stands in for the figure while its one panel is drawn. Titles and layout are left
    to the caller who made the axes."""

    axes = ()

    def __init__(self, axes: Axes) -> None:
        self._axes = axes
        self.bbox = axes.bbox

    def __getattr__(self, name: str) -> Any:
        return getattr(self._axes.figure, name)

    def add_gridspec(self, *args: Any, **kwargs: Any) -> _SingleCellGrid:
        return _SingleCellGrid()

    def add_subplot(self, *args: Any, **kwargs: Any) -> Axes:
        return self._axes

    def legend(self, *, handles: list[Any], ncols: int, loc: str) -> Any:
        below = ScaledTranslation(0.0, -LEGEND_BELOW / 72.0, self._axes.figure.dpi_scale_trans)
        return self._axes.legend(
            handles=handles,
            ncols=ncols,
            loc="upper center",
            bbox_to_anchor=(0.5, 0.0),
            borderaxespad=0.0,
            bbox_transform=self._axes.transAxes + below,
        )

    def colorbar(self, mesh: Any, *, ax: Any, **kwargs: Any) -> Any:
        return self._axes.figure.colorbar(mesh, ax=self._axes, **kwargs)

    def _ignore(self, *args: Any, **kwargs: Any) -> None:
        """Replaces the methods that lay out or name a whole figure."""

    suptitle = align_ylabels = draw_without_rendering = set_layout_engine = _ignore
