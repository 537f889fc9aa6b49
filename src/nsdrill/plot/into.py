"""A picture of one axes drawn into axes that somebody else has made."""

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
    """Draw ``picture`` into ``axes`` and give the figure that they are in. InputError
    where they are no axes, or where the picture has more than one; then nothing is
    drawn."""
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
    with _target(axes):
        picture()
    axes.set_title(title)
    figure: Any = axes.figure
    while not isinstance(figure, Figure):  # a part of one
        figure = figure.figure
    return figure


@contextmanager
def _target(axes: Axes) -> Iterator[None]:
    token = style.target.set(cast("Figure", _Within(axes)))
    try:
        yield
    finally:
        style.target.reset(token)


class _Cells:
    """A grid of which every cell is the axes."""

    def __getitem__(self, place: Any) -> None:
        return None


class _Within:
    """What stands for the figure while its one panel is drawn. Titles and layout belong
    to whoever made the axes."""

    axes = ()

    def __init__(self, axes: Axes) -> None:
        self._axes = axes
        self.bbox = axes.bbox

    def __getattr__(self, name: str) -> Any:
        return getattr(self._axes.figure, name)

    def add_gridspec(self, *args: Any, **more: Any) -> _Cells:
        return _Cells()

    def add_subplot(self, *args: Any, **more: Any) -> Axes:
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

    def colorbar(self, mesh: Any, *, ax: Any, **more: Any) -> Any:
        return self._axes.figure.colorbar(mesh, ax=self._axes, **more)

    def _nothing(self, *args: Any, **more: Any) -> None:
        """For what lays out or names a whole figure."""

    suptitle = align_ylabels = draw_without_rendering = set_layout_engine = _nothing
