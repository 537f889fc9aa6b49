"""One picture, from its kind and data to a figure that is laid out; and one panel of it
alone, in a figure of its own or in axes of the caller, by its painter."""

from __future__ import annotations

import difflib
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, cast
from weakref import WeakKeyDictionary

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.transforms import Bbox, ScaledTranslation, blended_transform_factory

from nsdrill.analysis.clocked import CLOCKED, clocked, clocked_short
from nsdrill.analysis.counts import BEYOND, beyond, beyond_parts, doubtful_fit, fit_words, inexact_exponents
from nsdrill.analysis.grades import unsettled_in, unsettled_words
from nsdrill.data import NOT_CARRIED_RUN, NOT_CARRIED_WORDS, Results, Trace, edited_words
from nsdrill.errors import InputError, option
from nsdrill.figures.kinds.branch_diagram import check_same_string, draw_branch_curves
from nsdrill.figures.legend import put_legend, put_words, seen_entries, seen_names
from nsdrill.figures.look import Look, apply_limits, look
from nsdrill.figures.map_panels import Planes
from nsdrill.figures.page import (
    Picture,
    draw_bars,
    draw_page,
    fit_y_axes,
    freeze_layout,
    lay_out,
    limit_x_axes,
    limit_y_axes,
    line_entry,
    panels_of,
    write_in_the_middle,
)
from nsdrill.figures.painters import Page, one_panel
from nsdrill.figures.picture_kinds import Kind
from nsdrill.figures.style import Properties, house_style, luminance, page_width, using_look, without_glyph_warnings
from nsdrill.models.registry import showing
from nsdrill.variables import INFERRED, OK, has_failed
from nsdrill.words.labels import LETTER, quantity

if TYPE_CHECKING:
    from xarray import Dataset

    from nsdrill.figures.picture_kinds import Drawable


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
        """The figure; or that with one ``panel`` alone, into ``axes`` if given. Without a
        name it is the only panel beside a strip, of a map in several ways the first one.
        InputError where there is no such panel, or several; nothing is drawn then. Its
        names begin with ``of_kind``, which leads from the names of all panels to these."""
        if axes is not None and not isinstance(axes, Axes):
            raise InputError(f"ax: found a value of the type {type(axes).__name__}; allowed: axes of matplotlib.")
        chosen = self.look
        if axes is not None and chosen.font_size is None:  # the size that the axes have
            chosen = replace(chosen, style={"font.size": axes.xaxis.label.get_fontsize()})
        with showing(self.data.attrs), using_look(chosen), house_style(), without_glyph_warnings():
            if axes is not None:
                return self._draw_in(axes, panel, of_kind)
            page = self._page()
            name = None if panel is None else chosen_panel([*page.panels], panel, of_kind)
            figure = self._draw_whole(page, limits_y=panel is None)
            return figure if name is None else self._draw_alone(name, self._size(figure, name))

    def _page(self) -> Page:
        return self.kind.page(self.data, self.units, **self.options)

    def _draw_whole(self, page: Page, *, limits_y: bool) -> Figure:
        figure, panels = draw_page(page)
        self._complete(figure, page, panels, limits_y=limits_y)
        _refuse_dark(option("style"), figure, *figure.axes)
        freeze_layout(figure, whole=limits_y)
        return figure

    def _size(self, whole: Figure, name: str) -> tuple[float, float]:
        """The width and the height [inches] of a figure of one panel alone, which is
        higher there than on the ``whole`` page."""
        panel = next(axes for axes in panels_of(whole) if axes.get_label() == name)
        if panel.get_aspect() == 1.0:
            side = page_width(4.0)
            return side, side + 0.5
        height = ENLARGED * panel.get_window_extent().height / panel.figure.dpi
        return page_width(), TEXT_HEIGHT + float(np.clip(height, *PANEL_HEIGHT))

    def _draw_alone(self, name: str, size: tuple[float, float]) -> Figure:
        with using_look(replace(look.get(), width=size[0], alone=True)):
            page = self._page()
            name = chosen_panel([*page.panels], name, "")
            alone = replace(page, panels={name: page.panels[name]}, width=size[0], height=size[1], arrange=one_panel)
            figure, panels = draw_page(replace(alone, complete=lambda panels: None))
            self._share(panels[name])
            self._complete(figure, alone, panels, limits_y=True)
            freeze_layout(figure)
        return figure

    def _draw_in(self, axes: Axes, panel: str | None, of_kind: str) -> Figure:
        _refuse_dark("ax", axes)
        callers = CallersAxes(axes)
        with using_look(replace(look.get(), width=callers.width / callers.dpi, alone=True)):
            page = self._page()
            name = chosen_panel([*page.panels], panel, of_kind)
            callers.begin()
            page.panels[name](axes)
            draw_bars(callers.figure, page, {name: axes})
            self._share(axes)
            callers.extend()
            entries = self._mark({name: axes}, limits_y=True)
            if name in page.within:
                page.within[name](axes)
            put_words(callers, seen_entries([*callers.entries, *page.entries({name: axes}), *entries], [axes]), page)
            callers.end()
        return callers.figure

    def _share(self, panel: Axes) -> None:
        """Give a panel alone the numbers and labels that others have for it on a
        page."""
        panel.tick_params(labelbottom=True, labelleft=True)
        across = self.kind.across(self.data)
        if across and not panel.get_xlabel():
            panel.set_xlabel(quantity(across, self.units).label)
        for axis in (panel.xaxis, panel.yaxis) if look.get().font_size else ():
            sizes = cast("Properties", mpl.rcParams)
            axis.label.set_fontsize(sizes["axes.labelsize"])
            axis.set_tick_params(which="both", labelsize=sizes[f"{axis.axis_name}tick.labelsize"])

    def _complete(self, figure: Figure, page: Page, panels: Mapping[str, Axes], *, limits_y: bool) -> None:
        """Draw what can be on pictures of all kinds, and write what stands below."""
        if isinstance(self.data, Results) and no_data_message(self.data):
            lay_out(figure)  # so that the largest panel is known
        entries = self._mark(panels, limits_y=limits_y)
        put_legend(figure, page, panels, entries)

    def _mark(self, panels: Mapping[str, Axes], *, limits_y: bool) -> list[Artist]:
        """Draw into panels what can be in those of all kinds, and limit their axes;
        returns the entries of the legend."""
        data, shown = self.data, [*panels.values()]
        entries: list[Artist] = []
        if isinstance(data, Results) and (message := no_data_message(data)):
            write_in_the_middle(max(shown, key=_area), message)
        if told := edited_words(data.attrs):
            entries.append(line_entry(told.partition(". ")[0], linestyle="none"))
        if isinstance(data, Results) and self.kind.name != "window" and (doubts := doubtful_fit(data.attrs)):
            entries.append(line_entry(f"DOUBTFUL FIT: {fit_words(doubts)}", linestyle="none"))
        if isinstance(data, Results) and inexact_exponents(data.attrs):
            entries.append(line_entry("EXPONENTS MAY BE WRONG, by more than their errors", linestyle="none"))
        if isinstance(data, Results) and (found := clocked(data.attrs)):
            entries.append(line_entry(f"{CLOCKED}: {clocked_short(found)}", linestyle="none"))
        if isinstance(data, Results) and self.kind.name == "probability" and (found := unsettled_in(data)):
            words = f"NOT SETTLED: {unsettled_words(found).partition(';')[0]}"
            entries.append(line_entry(words, linestyle="none"))
        if isinstance(data, Trace) and data.attrs.get(NOT_CARRIED_RUN):
            entries.append(line_entry(NOT_CARRIED_WORDS.partition(", ")[0], linestyle="none"))
        if isinstance(data, Results) and (found := beyond(data)):
            of = f"{sum(found.values())} of {data['status'].size}"
            words = f"beyond the validity of the model ({of}: {beyond_parts(found)})"
            style: Properties = (
                {"color": "k", "linewidth": 1.5} if BEYOND in seen_names(shown) else {"linestyle": "none"}
            )
            entries.append(line_entry(words, **style))
        if self.ends is not None:
            limit_x_axes(shown, str(self.kind.across(data)), self.ends, self.units)
            if not isinstance(data, Results | Trace):  # of branches nothing is left out
                fit_y_axes(shown)
        if self.curves is not None and isinstance(data, Results):
            entries += self._draw_curves(shown, self.curves, data)
        if self.look.ylim is not None and limits_y:
            limit_y_axes(shown, self.look.ylim, self.units, getattr(data, "axes", ()))
        return entries

    def _draw_curves(self, panels: Sequence[Axes], curves: Dataset, data: Results) -> list[Artist]:
        """Curves of branches over the map of a sweep over two axes."""
        if len(data.swept) != 2:
            raise InputError(
                f"{option('over')}: found branches, with a sweep over one axis; allowed: a map over two axes, over "
                "which their curves are drawn. For branches over the peaks of this sweep, give the file of "
                f"branches first and the sweep with {option('over')}."
            )
        fixed = {name: float(curves[name].values.ravel()[0]) for name in data.held if name in curves}
        check_same_string(curves, data, fixed, self.units)
        return draw_branch_curves(panels, curves, Planes.of(data, self.units))


def _area(axes: Axes) -> float:
    return float(axes.get_position().width * axes.get_position().height)


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


def chosen_panel(names: list[str], panel: str | None, of_kind: str) -> str:
    """The wanted one of the panels with these names; a name may be shortened where it
    remains clear."""
    fitting = [name for name in names if name == panel] or [name for name in names if panel and panel in name]
    if panel is None:
        fitting = [name for name in names if name != "strip"]
        if set(fitting) <= {"same", "up", "down", "compared"}:
            fitting = fitting[:1]
    if len(fitting) == 1:
        return fitting[0]
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


class CallersAxes:
    """Axes of the caller while a panel is drawn in them. Titles and layout are left to the
    caller, and what is drawn in them already keeps its place: the limits extend to both, and
    the legend has the ``entries`` of both. A legend stands :class:`below
    <nsdrill.figures.legend.Below>` them, in the ``width`` [pixels] that they have with their
    labels."""

    picture: Picture | None = None  # the size of the figure is the caller's

    def __init__(self, panel: Axes) -> None:
        figure = panel.get_figure(root=True)
        assert figure is not None
        self.figure, self._panel, self.dpi, self._room = figure, panel, figure.dpi, _room_of(panel)
        self.width = float(self._room.width)
        legend = panel.get_legend()
        self.entries = [] if legend is None else [*_entries.get(legend, ())]
        self._title = panel.get_title()
        # of what is drawn in the panel already: the ends of the axes and the label at the left
        self._earlier: dict[str, tuple[float, float]] = {}
        self._label = ""

    def begin(self) -> None:
        """Let the limits fit what is drawn from now on."""
        if self._panel.has_data():
            self._earlier = {"x": self._panel.get_xlim(), "y": self._panel.get_ylim()}
            self._label = self._panel.get_ylabel()
            self._panel.autoscale()

    def extend(self) -> None:
        """Let the limits fit what was drawn earlier as well."""
        for name, ends in self._earlier.items():
            first, last = getattr(self._panel, f"get_{name}lim")()
            low, high = min(*ends, first, last), max(*ends, first, last)
            getattr(self._panel, f"set_{name}lim")(*((low, high) if first < last else (high, low)))

    def legend(self, handles: Sequence[Artist], columns: int) -> Legend:
        """A legend below the panel."""
        below = ScaledTranslation(0.0, -self._below() / self.dpi, self._panel.figure.dpi_scale_trans)
        page = self._panel.figure.bbox
        middle = (0.5 * (self._room.x0 + self._room.x1) - page.x0) / page.width
        legend = self._panel.legend(
            handles=list(handles),
            ncols=columns,
            **COMPACT,
            loc="upper center",
            bbox_to_anchor=(middle, 0.0),
            borderaxespad=0.0,
            bbox_transform=blended_transform_factory(self._panel.figure.transSubfigure, self._panel.transAxes + below),
        )
        _entries[legend] = list(handles)
        return legend

    def end(self) -> None:
        """Leave the title to the caller, and break the label at the left in lines as long
        as there is room above the legend; that of what was drawn earlier stays."""
        panel = self._panel
        panel.set_title(self._title)
        if self._label:
            panel.set_ylabel(self._label)
        elif "\n" not in panel.get_ylabel():
            legend = panel.get_legend()
            below = self._below() + (0.0 if legend is None else legend.get_window_extent().height)
            letters = (self._room.height - below) / (LETTER * self._points(panel.yaxis.label.get_fontsize()))
            panel.set_ylabel(textwrap.fill(panel.get_ylabel(), max(8, int(letters)), break_long_words=False))

    def _points(self, count: float | str) -> float:
        """So many points in pixels."""
        return float(count) * self.dpi / 72.0

    def _below(self) -> float:
        """The distance [pixels] of a legend from the panel above it."""
        return self._points(LEGEND_BELOW + 2 * LINE_HEIGHT * float(self._panel.xaxis.label.get_fontsize()))
