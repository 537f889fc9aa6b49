"""The page of a picture: the figure with its panels, titles and legend, and its
layout."""

from __future__ import annotations

import io
import re
import textwrap
import warnings
from collections.abc import Iterable, Mapping, Sequence
from typing import Literal

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.figure import Figure, SubFigure
from matplotlib.font_manager import FontProperties
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.text import Annotation

from nsdrill import quantity as quantities
from nsdrill.data import Attributes
from nsdrill.errors import InputError, Refusal, option
from nsdrill.figures.look import BESIDE, End, Ends, look, resolve_ends, value_of
from nsdrill.figures.painters import Page
from nsdrill.figures.style import (
    FONT_SIZE,
    REFERENCE,
    Properties,
    Property,
    ResponseStyle,
    font_size,
    house_style,
    missing_characters,
    page_width,
    settings,
    without_glyph_warnings,
)
from nsdrill.words.labels import Shown, quantity, way_word

NOTEBOOK_DPI = 110
SHORTEST_LINE = 20  # characters of a title
TITLE_HEIGHT = 0.3  # inches by which a page without a title is lower
LOWEST_PANEL = 0.15  # inches
PANEL_MARGINS = 0.7  # inches beside a panel: the axis at its left, and overhang at its right


class Picture(Figure):
    """A figure that a notebook shows without pyplot. It keeps the settings with which
    it was drawn, and the characters of its title that no font has."""

    settings: Mapping[str, Property] | None = None
    missing: str = ""

    def _repr_png_(self) -> bytes:
        image = io.BytesIO()
        with house_style(self.settings), without_glyph_warnings():
            self.savefig(image, format="png", dpi=NOTEBOOK_DPI)
        return image.getvalue()


def page_height(height: float) -> float:
    """The height of the page [inches]: the user's, else ``height``, and more where the
    font is larger than :data:`FONT_SIZE`, as room for the labels of panels above each
    other."""
    label_size = FontProperties(size=mpl.rcParams["axes.labelsize"]).get_size_in_points()
    return look.get().height or height * max(1.0, label_size / FONT_SIZE)


def new_figure(width: float, height: float) -> Figure:
    """A figure of this width [inches] and :func:`page_height`, unknown to pyplot and to
    any window system."""
    figure = Picture(figsize=(width, page_height(height)), layout="constrained")
    figure.settings = settings(look.get())
    FigureCanvasAgg(figure)
    engine = figure.get_layout_engine()
    assert isinstance(engine, ConstrainedLayoutEngine)
    engine.set(w_pad=0.03, h_pad=0.03, hspace=0.02, wspace=0.02)
    return figure


def draw_page(page: Page) -> tuple[Figure, dict[str, Axes]]:
    """The figure of a page with its title and all its panels, and these by name; not yet
    what stands below them."""
    figure = new_figure(page.width, page.height)
    panels = dict(zip(page.panels, page.arrange(figure), strict=True))
    for name, axes in panels.items():
        axes.set_label(name)
        page.panels[name](axes)
        for axis, side, unlabel in (
            (axes.xaxis, "labelbottom", axes.set_xlabel),
            (axes.yaxis, "labelleft", axes.set_ylabel),
        ):
            if not axis.get_tick_params().get(side, True):
                unlabel("")
    page.complete(panels)
    draw_bars(figure, page, panels)
    put_title(figure, page.title)
    return figure, panels


def draw_bars(figure: Figure | SubFigure, page: Page, panels: Mapping[str, Axes]) -> None:
    """The colour bars of these panels of a page."""
    for bar in page.bars:
        beside = [axes for name, axes in panels.items() if bar.panels is None or name in bar.panels]
        if not beside:
            continue
        scale = ScalarMappable(bar.norm, bar.colours)
        drawn = figure.colorbar(scale, ax=beside if len(beside) > 1 else beside[0], label=bar.label, **bar.style)
        if bar.lines:
            drawn.ax.hlines(bar.lines, 0, 1, colors="white", linewidths=0.7)


def stack(
    figure: Figure | SubFigure, rows: int, *, shared: bool = True, heights: Sequence[float] = (), below: float = 0.0
) -> list[Axes]:
    """Panels one below the other, of these relative ``heights``, which share the x axis
    where ``shared``; ``below`` them there is an empty room."""
    ratios = [*(heights or [1.0] * rows), *([below] if below else [])]
    grid = figure.add_gridspec(len(ratios), 1, height_ratios=ratios)
    panels: list[Axes] = []
    for row in range(rows):
        first = panels[0] if shared and panels else None
        panels.append(figure.add_subplot(grid[row, 0], sharex=first))
        panels[-1].tick_params(labelbottom=not shared or row == rows - 1)
    return panels


def tiles(figure: Figure | SubFigure, count: int, columns: int) -> list[Axes]:
    """So many panels, ``columns`` in a row."""
    grid = figure.add_gridspec(-(-count // columns), columns)
    return [figure.add_subplot(grid[divmod(place, columns)]) for place in range(count)]


def lay_up(axes: Axes, name: str, label: str = "") -> None:
    """Let a variable lie along y of a panel, whose unit limits of this axis have;
    ``label`` is that of the axis, where it has none yet."""
    axes.yaxis.set_gid(name)
    if label:
        axes.set_ylabel(label)


def has_title() -> bool:
    """Whether pictures have titles, of the figure and of panels; not where the user
    wants none."""
    return look.get().title is not False


def put_title(figure: Figure, text: str) -> None:
    """Give the figure the title of the user, else ``text``; its lines are broken where
    they are wider than the figure."""
    title_of_user = look.get().title
    if title_of_user is False:
        # no empty strip in place of the title
        if isinstance(figure, Picture) and look.get().height is None:
            figure.set_figheight(max(0.5 * figure.get_figheight(), figure.get_figheight() - TITLE_HEIGHT))
        return
    text = title_of_user if isinstance(title_of_user, str) else text
    title = figure.suptitle(text, parse_math=False)
    if isinstance(figure, Picture):
        figure.missing = missing_characters(text)
    available, lines = figure.bbox.width - 6.0 * figure.dpi / 72, []
    for line in text.split("\n"):
        count = len(line)
        title.set_text(line)
        while (width := title.get_window_extent().width) > available and count > SHORTEST_LINE:
            count = max(SHORTEST_LINE, min(count - 1, int(count * available / width) + 2))
            title.set_text(textwrap.fill(line, count))
        lines.append(title.get_text())
    title.set_text("\n".join(lines))


def set_panel_title(
    axes: Axes, text: str, loc: Literal["left", "center"] = "center", notes: Sequence[str] = ()
) -> None:
    """Give a panel a title and ``notes`` on what is drawn, broken after semicolons and
    commas where they are wider than its part of the figure or subfigure. Where the user
    wants no titles, the notes alone."""
    if not (text := "; ".join(filter(None, (text if has_title() else "", *notes)))):
        return
    parent, place = axes.figure, axes.get_subplotspec()
    columns = place.get_gridspec().ncols if place else 1
    title = axes.set_title(text, loc=loc)
    width, available = title.get_window_extent().width, parent.bbox.width / columns - PANEL_MARGINS * parent.dpi
    if width > available:
        unbroken = re.sub(r"(?<![;,]) ", "\u00a0", text)
        lines = textwrap.fill(unbroken, max(SHORTEST_LINE, int(len(text) * available / width)), break_long_words=False)
        title.set_text(lines.replace("\u00a0", " "))


def write(
    axes: Axes,
    text: str,
    place: tuple[float, float],
    offset: tuple[float, float] = (0.0, 0.0),
    size: float = 6.0,
    **style: Property,
) -> None:
    """Write a small text at a place of a panel, moved by ``offset`` [points]; ``size`` is
    that of :func:`font_size`. ``style`` may have ``xycoords``, as :data:`BESIDE`."""
    axes.annotate(text, place, offset, textcoords="offset points", fontsize=font_size(size), **style)


def panels_per_row(count: int, min_width: float) -> int:
    """How many of ``count`` panels fit in a row, each ``min_width`` inches wide or
    more."""
    return max(1, min(count, int(page_width() / min_width)))


def labelled(panels: Mapping[str, Axes]) -> list[Artist]:
    """The entries of a legend by the labels of what is drawn in panels."""
    return [artist for axes in panels.values() for artist in axes.get_legend_handles_labels()[0]]


def line_entry(label: str, **style: Property) -> Artist:
    """An entry of a legend with a line, or a marker, of this style; ``gid`` as the name
    of the marks for which it stands, where a panel may have none of them, or a pattern
    for it (:func:`nsdrill.figures.legend.is_seen_of`)."""
    return Line2D([], [], label=label, **style)


def area_entry(label: str, **style: Property) -> Artist:
    """An entry of a legend with an area of this style; ``gid`` as of a line."""
    return Patch(label=label, **style)


def marker_entry(
    label: str,
    marker: str = "o",
    colour: str = REFERENCE,
    *,
    size: float = 4.5,
    edge: float = 0.0,
    hollow: bool = False,
    gid: str | None = None,
) -> Artist:
    """An entry with a marker, filled or open; ``gid`` as of a line."""
    style: Properties = {"color": colour, "marker": marker, "markersize": size, "markeredgewidth": edge, "gid": gid}
    if hollow:
        style |= {"markerfacecolor": "none", "markeredgewidth": edge or 0.7}
    return line_entry(label, linestyle="none", **style)


def response_entries(codes: Iterable[int], styles: Sequence[ResponseStyle], of: str = "") -> list[Artist]:
    """An entry for each response, by colour and marker; it stands for the marks with the
    names ``of`` and its code, if given."""
    return [
        marker_entry(styles[code].name, styles[code].marker, styles[code].colour, gid=_coded(of, code))
        for code in codes
    ]


def style_areas(styles: Sequence[ResponseStyle], codes: Iterable[int], of: str = "") -> list[Artist]:
    """An entry for each of these ``codes``, by the colour of its style; it stands for the
    marks with the names ``of`` and its code, if given."""
    return [area_entry(facecolor=styles[i].colour, label=styles[i].name, gid=_coded(of, i)) for i in codes]


def _coded(of: str, code: int) -> str | None:
    return f"{of}:{code}" if of else None


def direction_entries(procedures: Sequence[str], attrs: Attributes) -> list[Artist]:
    """What filled, open and small markers mean; no entries where the state was not carried
    both up and down."""
    if not {"up", "down"} <= set(procedures):
        return []
    up, down = (way_word(procedure, attrs) for procedure in ("up", "down"))
    entries = [
        marker_entry(f"{up}: filled", size=4, edge=0.7, gid="*:up"),
        marker_entry(f"{down}: open", size=4, hollow=True, gid="*:down"),
    ]
    return [*entries, *([marker_entry("same: small", size=2, gid="*:same")] if "same" in procedures else [])]


def limit_x_axes(panels: Iterable[Axes], across: str, ends: tuple[float, float], units: str) -> None:
    """Limit the x axes that show the variable ``across`` to these values, in SI."""
    x = quantity(across, units)
    low, high = (end / x.scale for end in ends)
    for axes in panels:
        if axes.get_xlabel() == x.label:
            if axes.get_xscale() == "log" and low <= 0.0:
                raise InputError(
                    f"{option('xlim')}: found {x.value(ends[0])} on a logarithmic axis; allowed: above zero."
                )
            axes.set_xlim(low, high)


def limit_y_axes(panels: Sequence[Axes], ends: Ends, units: str, axes_of_data: Sequence[str] = ()) -> None:
    """Limit the y axes of the ``panels`` that show a quantity of the unit of ``ends``,
    among them the axes of a sweep, one of which maps have along y. InputError where no
    panel does, or panels of several quantities: then one is to be drawn alone."""
    for axes in panels:
        for axis in axes_of_data:
            if axes.get_ylabel() == quantity(axis, units).label:
                axes.yaxis.set_gid(axis)
    panels = [axes for axes in panels if axes.yaxis.get_gid()]
    names = dict.fromkeys(str(axes.yaxis.get_gid()) for axes in panels)
    limits: dict[str, list[float]] = {}
    error = InputError(f"{option('ylim')}: found a picture whose panels have no limits of their own.")
    for name in names:
        try:
            limits[name] = [_shown_end(end, name, quantity(name, units)) for end in ends]
        except InputError as other_unit:
            error = other_unit
    if not limits:
        raise error
    if len(limits) > 1:
        raise Refusal(
            "ylim", f"panels of {', '.join(limits)} with this unit", "one of them", f"Choose it with {option('panel')}."
        )
    ((name, (low, high)),) = limits.items()
    resolve_ends("ylim", (low, high), quantity(name, units).unit)
    for axes in panels:
        if axes.yaxis.get_gid() == name:
            for arrow in [line for line in axes.lines if "beyond" in str(line.get_gid())]:
                arrow.remove()  # at the border that was chosen before
            for words in [text for text in axes.texts if isinstance(text, Annotation)]:
                if words.xycoords == BESIDE and not low <= words.xy[1] <= high:
                    words.remove()
            top_first = axes.yaxis_inverted()
            axes.set_ylim((high, low) if top_first else (low, high))


def _shown_end(end: End, name: str, shown: Shown) -> float:
    """A limit in the unit in which a variable is shown; of a share also in per cent."""
    text = str(end).strip()
    if shown.unit == "%" and text.endswith("%"):
        return value_of("ylim", text.rstrip("% "), "1")
    units = quantities.quantity(name).units
    return value_of("ylim", end, "1" if units == "percent" else units) / shown.scale


def fit_y_axes(panels: Iterable[Axes]) -> None:
    """Limit the y axis of every panel to the lines within its limits along x."""
    for axes in panels:
        low, high = axes.get_xlim()
        seen = [np.empty(0)]
        for line in axes.lines:
            x, y = np.asarray(line.get_xdata(), float), np.asarray(line.get_ydata(), float)
            if line.get_transform() == axes.transData:  # not a line at a value, across the panel
                seen.append(y[(x >= low) & (x <= high) & np.isfinite(y)])
        if (values := np.concatenate(seen)).size and (span := float(np.ptp(values))) > 0.0:
            axes.set_ylim(values.min() - 0.05 * span, values.max() + 0.05 * span)


def write_in_the_middle(axes: Axes, text: str) -> None:
    """Write ``text`` in the middle of a panel."""
    axes.text(
        0.5,
        0.5,
        text,
        transform=axes.transAxes,
        ha="center",
        va="center",
        gid="nothing",
        bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.85},
    )


def panels_of(figure: Figure | SubFigure) -> list[Axes]:
    """All axes of a figure and of its subfigures."""
    panels = figure.axes or [axes for subfigure in getattr(figure, "subfigs", ()) for axes in panels_of(subfigure)]
    return list(dict.fromkeys(panels))


CONSTANT_TOLERANCE = 1e-6  # relative range below which values are shown as constant


def _widen_constant_axes(figure: Figure) -> None:
    """Widen the limits of axes whose values are constant but for rounding, so that they
    appear as a line with plain ticks: otherwise rounding fills the panel, and every
    tick has ten digits."""
    for axes in panels_of(figure):
        if axes.get_label() == "<colorbar>":
            continue
        for axis in (axes.xaxis, axes.yaxis):
            name = axis.axis_name
            if axis.get_scale() != "linear" or not getattr(axes, f"get_autoscale{name}_on")():
                continue
            ends = getattr(axes, f"get_{name}lim")()
            low, high = min(ends), max(ends)
            size = max(abs(low), abs(high))
            if high - low < max(CONSTANT_TOLERANCE * size, 1e-9):
                middle, half = 0.5 * (low + high), 0.05 * size if size > 1e-6 else 0.05
                limits = (middle - half, middle + half)
                getattr(axes, f"set_{name}lim")(*(limits if ends[0] <= ends[1] else limits[::-1]))


def lay_out(figure: Figure) -> None:
    """Give the panels the sizes that they have beside all words, where there is room."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="constrained_layout not applied")
        _place(figure)


def _place(figure: Figure) -> None:
    """Compute the layout alone: to draw the figure for it, as matplotlib does, takes longer
    and gives the same."""
    engine = figure.get_layout_engine()
    if engine is not None and figure.axes:
        engine.execute(figure)


def freeze_layout(figure: Figure, *, whole: bool = True) -> None:
    """Lay out the figure and fix its layout: the same geometry in every format, each
    time it is saved.

    The layout is computed twice, as the space for aligned labels is known only once the
    axes have their positions. InputError where words leave no room for the panels of
    a ``whole`` picture, not of one of which a panel is drawn alone.
    """
    _widen_constant_axes(figure)
    with warnings.catch_warnings():
        warnings.filterwarnings("error" if whole else "ignore", message="constrained_layout not applied")
        try:
            for _ in range(2):
                _place(figure)
            highest = max((axes.get_position().height * figure.get_figheight() for axes in figure.axes), default=1.0)
        except UserWarning:
            highest = 0.0
    if whole and highest < LOWEST_PANEL:
        width, height = figure.get_size_inches()
        raise InputError(
            f"{option('width' if look.get().height is None else 'height')}: found a picture of {width:.3g} by "
            f"{height:.3g} in, in which title, labels and legend leave no room for the panels; allowed: more. "
            f"Smaller type ({option('font_size')}) or one panel alone ({option('panel')}) need less."
        )
    figure.set_layout_engine("none")
    # The layout solver orders its variables by memory address, so positions differ in
    # the last bits from one call to the next: enough for a pixel. Rounding makes them
    # the same every time.
    for axes in figure.axes:
        left, bottom, width, height = (round(value, 6) for value in axes.get_position(original=True).bounds)
        axes.set_position((left, bottom, width, height))
    for axes in panels_of(figure):
        _drop_cut_labels(axes)


LABEL_OF_LINE = ":label"  # the end of the gid of the labels of contours


def _drop_cut_labels(axes: Axes) -> None:
    """Remove the labels of lines that the frame would cut, as by limits of the user."""
    box = axes.get_window_extent()
    for text in [text for text in axes.texts if str(text.get_gid()).endswith(LABEL_OF_LINE)]:
        x0, y0, x1, y1 = text.get_window_extent().extents
        if not (box.x0 <= x0 and x1 <= box.x1 and box.y0 <= y0 and y1 <= box.y1):
            text.remove()
