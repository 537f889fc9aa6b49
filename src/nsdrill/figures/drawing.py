"""One picture, from its kind and data to a figure that is laid out; and one panel of it
alone, in a figure of its own or in axes of the caller.

For one panel the picture is drawn twice: whole, to learn the names and sizes of its
panels, and again into a stand-in for its figure, which puts the wanted panel where it is
wanted and the others on a figure that nobody sees.
"""

from __future__ import annotations

import difflib
import itertools
import textwrap
from collections.abc import Callable, Iterator, Mapping, Sequence
from copy import copy
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal, NoReturn, cast
from weakref import WeakKeyDictionary

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colorbar import Colorbar
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure, SubFigure
from matplotlib.gridspec import SubplotSpec
from matplotlib.legend import Legend
from matplotlib.text import Text
from matplotlib.ticker import FixedLocator
from matplotlib.transforms import Bbox, ScaledTranslation, blended_transform_factory

from nsdrill.data import Array, Results, Trace
from nsdrill.errors import InputError, option
from nsdrill.figures.kinds.branches import check_same_string, draw_branch_curves
from nsdrill.figures.legend import put_legend
from nsdrill.figures.look import Look, apply_limits, look
from nsdrill.figures.maps import Planes
from nsdrill.figures.page import (
    Below,
    fit_y_axes,
    freeze_layout,
    limit_x_axes,
    limit_y_axes,
    panels_of,
    single_panel,
    write_in_largest_panel,
)
from nsdrill.figures.registry import Kind
from nsdrill.figures.style import (
    Properties,
    house_style,
    luminance,
    page_width,
    target,
    using_look,
    without_glyph_warnings,
)
from nsdrill.quantity import showing
from nsdrill.variables import INFERRED, OK, has_failed
from nsdrill.words.labels import LETTER, quantity

if TYPE_CHECKING:
    from xarray import Dataset

    from nsdrill.figures.registry import Drawable


DARK = 0.2  # greatest luminance of a page on which marks would be lost


def _refuse_dark(argument: str, *grounds: Figure | Axes) -> None:
    """InputError where the page of a picture, or the axes of a user, are dark."""
    for ground in grounds:
        *rgb, alpha = to_rgba(ground.get_facecolor())
        if luminance(alpha * np.array(rgb) + 1.0 - alpha) <= DARK:
            raise InputError(
                f"{argument}: found a dark page; allowed: a light one, as the colours of responses are chosen for "
                "paper. In Python, draw with plt.style.context('default')."
            )


class Drawing:
    """A picture of a ``kind``: what it is drawn of, in which units, with which options
    of that kind, and how the user wants it to look; ``curves`` are branches whose
    curves are drawn over it."""

    def __init__(
        self,
        kind: Kind,
        data: Drawable,
        units: str,
        options: Mapping[str, object],
        look: Look,
        curves: Dataset | None = None,
    ) -> None:
        self.kind, self.units, self.options, self.look, self.curves = kind, units, options, look, curves
        self.data, self.ends = apply_limits(data, kind, look)

    def draw(self, panel: str | None, axes: Axes | None, of_kind: str = "") -> Figure:
        """The figure; or that with one ``panel`` alone, into ``axes`` if given. For
        ``of_kind`` see :func:`draw_panel`."""
        alone, chosen = panel is not None or axes is not None, self.look
        if isinstance(axes, Axes) and chosen.font_size is None:  # the size that the axes have
            chosen = replace(chosen, style={"font.size": axes.xaxis.label.get_fontsize()})
        with showing(self.data.attrs), using_look(chosen), house_style(), without_glyph_warnings():
            figure = self._picture(limits_y=not alone)
            if isinstance(axes, Axes):
                _refuse_dark("ax", axes)
            else:
                _refuse_dark(option("style"), figure, *figure.axes)
            freeze_layout(figure, whole=not alone)
            if alone:
                figure = draw_panel(lambda: self._picture(limits_y=True), figure, panel, axes, of_kind)
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
            if not isinstance(data, Results | Trace):  # of branches nothing is left out
                fit_y_axes(figure)
        if self.curves is not None and isinstance(data, Results):
            self._draw_curves(figure, self.curves, data)
        if self.look.ylim is not None and limits_y:
            limit_y_axes(panels_of(figure), self.look.ylim, self.units, getattr(data, "axes", ()))
        put_legend(figure)
        return figure

    def _draw_curves(self, figure: Figure, curves: Dataset, data: Results) -> None:
        """Curves of branches over the map of a sweep over two axes."""
        if len(data.swept) != 2:
            raise InputError(
                f"{option('over')}: found branches, with a sweep over one axis; allowed: a map over two axes, over "
                "which their curves are drawn. For branches over the peaks of this sweep, give the file of "
                f"branches first and the sweep with {option('over')}."
            )
        fixed = {name: float(curves[name].values.ravel()[0]) for name in data.held if name in curves}
        check_same_string(curves, data, fixed, self.units)
        draw_branch_curves(figure, curves, Planes.of(data, self.units))


def no_data_message(data: Results) -> str:
    """The message on a picture of results in which no point ended well; empty where one
    did."""
    status = data.variables["status"]
    if np.any((status == OK) | (status == INFERRED)):
        return ""
    failed, points = int(np.count_nonzero(has_failed(status))), status.size
    waiting = f", {points - failed} not run yet" if failed < points else ""
    return f"Nothing to show: no point ended well\n({failed} of {points} failed{waiting})"


LEGEND_BELOW = 12.0  # points: room for the ticks and gaps, beside two lines of words below the x axis
LINE_HEIGHT = 1.25  # of the size of the type
TEXT_HEIGHT = 1.3  # inches of title, axis labels and legend of one panel
PANEL_HEIGHT = (2.0, 3.4)  # inches: least and greatest
# The caller's layout takes the room of a legend from the panel.
ROOM_BETWEEN = 0.06  # inches: half of what is left free between the legends of neighbours
COMPACT: Properties = {"handlelength": 1.2, "columnspacing": 0.8, "labelspacing": 0.2, "borderpad": 0.0}
ENLARGED = 1.6  # a panel alone is higher than one of several


def names_of(figure: Figure) -> list[str]:
    """The names of the panels in the order in which they were made: those of a second
    column end in 2, and so on."""
    names: list[str] = []
    for axes in _panels(figure):
        name = str(axes.get_label() or axes.get_title() or "panel")
        repeats = sum(other.partition(" ")[0] == name for other in names)
        names.append(f"{name} {repeats + 1}" if repeats else name)
    return names


def _panels(figure: Figure) -> list[Axes]:
    return [axes for axes in panels_of(figure) if axes.get_label() != "<colorbar>"]


def draw_panel(
    picture: Callable[[], Figure], whole: Figure, panel: str | None, axes: Axes | None, of_kind: str = ""
) -> Figure:
    """Draw the ``panel`` of a ``picture`` alone, into ``axes`` if given, and return the
    figure that contains it. ``whole`` is the picture with all its panels. Without a
    name it is the only panel beside a strip, of a map in several ways the first one.
    InputError where there is no such panel, or several; nothing is drawn then. Its
    names begin with ``of_kind``, which leads from the names of all panels to these."""
    number = _number(names_of(whole), panel, of_kind)
    if axes is not None and not isinstance(axes, Axes):
        raise InputError(f"ax: found a value of the type {type(axes).__name__}; allowed: axes of matplotlib.")
    place, title = axes, "" if axes is None else axes.get_title()
    if place is None:
        place = _alone(_panels(whole)[number])
    width, height = whole.get_size_inches()
    stand_in = _StandIn(place, number, Figure(figsize=(width, height)), own=axes is None)
    token = target.set(cast("Figure", stand_in))
    try:
        picture()
    finally:
        target.reset(token)
    if axes is not None:
        stand_in.break_label()
        axes.set_title(title)
    figure = place.get_figure(root=True)
    assert figure is not None
    return figure


def _number(names: list[str], panel: str | None, of_kind: str) -> int:
    """The place of the wanted panel among those with these names; a name may be
    shortened where it remains clear."""
    fitting = [name for name in names if name == panel] or [name for name in names if panel and panel in name]
    if panel is None:
        fitting = [name for name in names if name != "strip"]
        if set(fitting) <= {"same", "up", "down", "compared"}:
            fitting = fitting[:1]
    if len(fitting) == 1:
        return names.index(fitting[0])
    allowed = ", ".join(repr(of_kind + name) for name in (fitting if panel and fitting else names))
    if panel is None:
        raise InputError(
            f"ax: found a picture with {len(names)} panels; allowed: one of them, by {option('panel')}: "
            f"{allowed}. Without ax it is a figure of its own."
        )
    near = difflib.get_close_matches(panel, names, n=1, cutoff=0.5) if not fitting else []
    hint = f" Did you mean {of_kind + near[0]!r}?" if near else ""
    semicolon = f".{hint} Allowed" if hint else "; allowed"
    raise InputError(f"{option('panel')}: found {of_kind + panel!r}{semicolon} here: {allowed}.")


def _alone(panel: Axes) -> Axes:
    """Axes for this panel in a figure of its own."""
    if panel.get_aspect() == 1.0:
        side = page_width(4.0)
        return single_panel(side, side + 0.5)[1]
    height = ENLARGED * panel.get_window_extent().height / panel.figure.dpi
    return single_panel(page_width(), TEXT_HEIGHT + float(np.clip(height, *PANEL_HEIGHT)))[1]


def _room_of(panel: Axes) -> Bbox:
    """The part of its figure [pixels] that axes of the caller have with their labels: a
    cell of a grid, if they stand in one."""
    page, spec = panel.figure.bbox, panel.get_subplotspec()
    if spec is None:
        return panel.bbox
    columns, rows = spec.get_gridspec().ncols, spec.get_gridspec().nrows
    x0, x1 = (page.x0 + page.width * end / columns for end in (spec.colspan.start, spec.colspan.stop))
    margin = ROOM_BETWEEN * panel.figure.dpi
    return Bbox.from_extents(x0 + margin, page.y0, x1 - margin, page.y0 + page.height * len(spec.rowspan) / rows)


# The entries of the legends in axes of the caller.
_entries: WeakKeyDictionary[Legend, list[Artist]] = WeakKeyDictionary()


class _StandIn:
    """Stands in for the figure while one of its panels is drawn. Where the axes are the
    caller's, titles and layout are left to the caller, and what is drawn in them already
    keeps its place: the limits extend to both, and the legend has the entries of both."""

    def __init__(
        self, panel: Axes, number: int, hidden: Figure | SubFigure, own: bool, made: Iterator[int] | None = None
    ) -> None:
        self.axes = [panel]
        self._number, self._hidden, self._own = number, hidden, own
        self._made = made if made is not None else itertools.count()
        self._twin: Axes | None = None  # of the panel, on the figure that nobody sees
        self.legends: list[Legend] = []
        legend = panel.get_legend()
        self.below = Below([] if legend is None else [*_entries.get(legend, ())])
        # of what is drawn in the panel already: the ends of the axes and the label at the left
        self._earlier: dict[str, tuple[float, float]] = {}
        self._label = ""
        if not own and panel.has_data():
            self._earlier, self._label = {"x": panel.get_xlim(), "y": panel.get_ylim()}, panel.get_ylabel()
            panel.autoscale()
        self.bbox = panel.figure.bbox if own else _room_of(panel)
        self.dpi = panel.figure.dpi

    def __getattr__(self, name: str) -> object:
        return getattr(self._hidden, name)

    def add_subplot(self, *place: SubplotSpec, sharex: Axes | None = None, sharey: Axes | None = None) -> Axes:
        (panel,) = self.axes
        sharex, sharey = (self._twin if shared is panel else shared for shared in (sharex, sharey))
        made = self._hidden.add_subplot(*place, sharex=sharex, sharey=sharey)
        if next(self._made) != self._number:
            return made
        self._twin = made
        return panel

    def subplots(self, *_: object, **__: object) -> NoReturn:
        raise TypeError("a panel made by subplots cannot be drawn alone; make it by add_subplot")

    def subfigures(
        self, rows: int, columns: int, width_ratios: Sequence[float] = (), height_ratios: Sequence[float] = ()
    ) -> Array | _StandIn:
        (panel,) = self.axes
        made = self._hidden.subfigures(
            rows, columns, width_ratios=width_ratios or None, height_ratios=height_ratios or None
        )
        hidden = np.asarray(made, dtype=object).ravel()
        parts = np.empty(len(hidden), dtype=object)
        parts[:] = [_StandIn(panel, self._number, part, self._own, self._made) for part in hidden]
        return parts if len(parts) > 1 else parts[0]

    def legend(self, *, handles: list[Artist], ncols: int, loc: Literal["outside lower center"]) -> Legend:
        (panel,) = self.axes
        if self._own:
            # outside it takes room even where it is empty
            legend = panel.figure.legend(handles=handles, ncols=ncols, loc=loc)
        else:
            below = ScaledTranslation(0.0, -self._below() / self.dpi, panel.figure.dpi_scale_trans)
            page = panel.figure.bbox
            middle = (0.5 * (self.bbox.x0 + self.bbox.x1) - page.x0) / page.width
            legend = panel.legend(
                handles=handles,
                ncols=ncols,
                **COMPACT,
                loc="upper center",
                bbox_to_anchor=(middle, 0.0),
                borderaxespad=0.0,
                bbox_transform=blended_transform_factory(panel.figure.transSubfigure, panel.transAxes + below),
            )
            _entries[legend] = handles
        self.legends = [legend]
        return legend

    def _points(self, count: float | str) -> float:
        """So many points in pixels."""
        return float(count) * self.dpi / 72.0

    def _below(self) -> float:
        """The distance [pixels] of a legend from the panel above it."""
        return self._points(LEGEND_BELOW + 2 * LINE_HEIGHT * float(self.axes[0].xaxis.label.get_fontsize()))

    def suptitle(self, text: str, **style: bool) -> Text | None:
        return self.axes[0].figure.suptitle(text, **style) if self._own else None

    def colorbar(self, mesh: ScalarMappable, *, ax: Axes | list[Axes], **style: Any) -> Colorbar:
        (panel,) = self.axes
        if panel in np.ravel(np.array(ax, dtype=object)):
            colours = ScalarMappable(mesh.norm, mesh.cmap)  # the mesh may be of another panel
            return panel.figure.colorbar(colours, ax=panel, **style)
        return self._hidden.colorbar(mesh, ax=ax, **style)

    def finish(self, across: str | None, units: str) -> None:
        """Give the panel the limits, scales and labels that it shares with others;
        ``across`` is the variable along x."""
        (panel,) = self.axes
        panel.tick_params(labelbottom=True, labelleft=True)
        if across and not panel.get_xlabel():
            panel.set_xlabel(quantity(across, units).label)
        if (y := panel.yaxis.get_gid()) and not panel.get_ylabel():
            panel.set_ylabel(quantity(y, units).label)
        for axis in (panel.xaxis, panel.yaxis) if look.get().font_size else ():
            sizes = cast("Properties", mpl.rcParams)
            axis.label.set_fontsize(sizes["axes.labelsize"])
            axis.set_tick_params(which="both", labelsize=sizes[f"{axis.axis_name}tick.labelsize"])
        if self._twin is not None:
            self._take_limits(self._twin)
        for name, ends in self._earlier.items():
            first, last = getattr(panel, f"get_{name}lim")()
            low, high = min(*ends, first, last), max(*ends, first, last)
            getattr(panel, f"set_{name}lim")(*((low, high) if first < last else (high, low)))

    def _take_limits(self, twin: Axes) -> None:
        """Give the panel the limits and scales that its twin has from others."""
        (panel,) = self.axes
        for axis, other in ((panel.xaxis, twin.xaxis), (panel.yaxis, twin.yaxis)):
            name = axis.axis_name
            if getattr(twin, f"get_autoscale{name}_on")():
                continue
            if axis.get_scale() != other.get_scale():
                getattr(panel, f"set_{name}scale")(other.get_scale())
                axis.set_major_locator(copy(other.get_major_locator()))
                axis.set_major_formatter(copy(other.get_major_formatter()))
                axis.set_minor_formatter(copy(other.get_minor_formatter()))
            if isinstance(other.get_major_locator(), FixedLocator):
                words = [text.get_text() for text in other.get_ticklabels()]
                axis.set_ticks(list(other.get_majorticklocs()), words)
            getattr(panel, f"set_{name}lim")(getattr(twin, f"get_{name}lim")())

    def break_label(self) -> None:
        """Break the label at the left in lines as long as there is room above the legend;
        that of what was drawn earlier stays."""
        (panel,) = self.axes
        if self._label:
            panel.set_ylabel(self._label)
        elif "\n" not in panel.get_ylabel():
            below = self._below() + sum(legend.get_window_extent().height for legend in self.legends)
            letters = (self.bbox.height - below) / (LETTER * self._points(panel.yaxis.label.get_fontsize()))
            panel.set_ylabel(textwrap.fill(panel.get_ylabel(), max(8, int(letters)), break_long_words=False))

    def _ignore(self, *args: object, **kwargs: object) -> None:
        """Replaces the methods that lay out a whole figure."""

    align_ylabels = draw_without_rendering = set_layout_engine = _ignore
