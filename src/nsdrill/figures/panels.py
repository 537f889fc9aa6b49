"""Panels over one axis: a strip of responses on top, panels below that share the axis,
a column for each value of a second axis, if any, and one legend at the bottom; and what
is drawn in them: dots, and curves over bands of severity whose bounds are the
thresholds in force in the file."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial

import numpy as np
from matplotlib import rcParams
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties

from nsdrill.analysis.counts import BEYOND, NOT_CARRIED
from nsdrill.analysis.hysteresis import differences, spans
from nsdrill.analysis.planes import stretches
from nsdrill.analysis.safety import FAILED_POINT, NOT_CARRIED_POINT, PENDING_POINT, told_responses
from nsdrill.data import Array, Attributes, Results
from nsdrill.figures.cells import (
    CHARACTER,
    hatch_unsettled,
    overlay_verdicts,
    unsettled_entry,
    verdict_handles,
    write_name,
)
from nsdrill.figures.look import BESIDE, look
from nsdrill.figures.page import area_entry, lay_up, line_entry, marker_entry, response_entries, style_areas, write
from nsdrill.figures.painters import Entries, Page, numbered
from nsdrill.figures.picture_kinds import longest
from nsdrill.figures.slices import Line, lay_along, robust_limits
from nsdrill.figures.style import (
    DASHED,
    DIRECTION_COLOURS,
    REFERENCE,
    SHADE,
    SHADE_EDGE,
    Properties,
    ResponseStyle,
    cell_style,
    lettered,
    page_width,
    styles_of,
)
from nsdrill.figures.traces import envelope, one_per_pixel
from nsdrill.models.in_force import in_force
from nsdrill.models.registry import drawn_in
from nsdrill.models.responses import STALLED, Response
from nsdrill.variables import INFERRED, OK
from nsdrill.words.labels import both_ways, quantity, sweep_title, way_word

STRIP_ROW_HEIGHT = 0.13  # inches, a row for each procedure
UNDER = 0.4  # of a row, below its middle
TEXT_HEIGHT = 1.2  # inches of title, axis labels and legend


PaintLine = Callable[[Axes, Line, str], object]  # draws a variable along a line


class Columns:
    """A page over one axis: its ``lines``, one for each column, along the longest axis of
    numbers, at every value of the other axis if that is swept; and in each column the
    strip and a panel for each of the variables ``names``, top to bottom, drawn by
    ``paint``. The ``labels`` of their y axes, where they are not those of the
    variables."""

    def __init__(
        self,
        results: Results,
        units: str,
        names: Sequence[str],
        height: float,
        paint: PaintLine,
        labels: Mapping[str, str] | None = None,
    ) -> None:
        self.results, self.units, self.names, self._paint, self._labels = results, units, names, paint, labels or {}
        self.lines = lines_of(results, units)
        strip_height = STRIP_ROW_HEIGHT * len(self.lines[0].procedures)
        self._height = height + strip_height
        self._ratios = [strip_height, *[(height - TEXT_HEIGHT) / len(names)] * len(names)]

    def page(self, entries: Entries) -> Page:
        """The page with these entries of its legend."""
        places = [(number, name) for number in range(len(self.lines)) for name in ("strip", *self.names)]
        painters = [partial(self._draw, number, name) for number, name in places]
        return Page(
            dict(zip(numbered(name for _, name in places), painters, strict=True)),
            sweep_title(self.results, self.units),
            page_width(),
            self._height,
            self._arrange,
            entries,
            complete=self._spare_labels,
        )

    def _arrange(self, figure: Figure) -> list[Axes]:
        """The empty panels, column by column."""
        grid = figure.add_gridspec(len(self._ratios), len(self.lines), height_ratios=self._ratios)
        columns: list[list[Axes]] = []
        for number in range(len(self.lines)):
            column: list[Axes] = []
            for row in range(len(self._ratios)):
                first_y = columns[0][row] if number and row else None
                axes = figure.add_subplot(grid[row, number], sharex=column[0] if column else None, sharey=first_y)
                axes.tick_params(labelbottom=row == len(self.names), labelleft=number == 0)
                column.append(axes)
            title = self._title(number)
            fits = self._fits(title, rcParams["axes.titlesize"])
            column[0].set_title(title if fits else title.replace(": ", ":\n"), pad=3)
            columns.append(column)
        figure.align_ylabels(columns[0][1:])
        return [axes for column in columns for axes in column]

    def _draw(self, number: int, name: str, axes: Axes) -> None:
        """Draw the strip, or a variable, of one column."""
        line = self.lines[number]
        lay_along(axes, self.results, line.axis, self.units)
        if look.get().alone:
            axes.set_title(self._title(number))
        if name == "strip":
            draw_strip(axes, line)
            return
        lay_up(axes, name, self._labels.get(name) or quantity(name, self.units).label)
        self._paint(axes, line, name)

    def _spare_labels(self, panels: Mapping[str, Axes]) -> None:
        """Of labels that are wider than their columns, that in the middle alone."""
        lowest = [*panels.values()][len(self.names) :: len(self._ratios)]
        for number, axes in enumerate(lowest):
            if number != len(lowest) // 2 and not self._fits(axes.get_xlabel(), rcParams["axes.labelsize"]):
                axes.set_xlabel("")

    def _title(self, number: int) -> str:
        """The value of the second axis in a column; empty where there is only one."""
        others = [name for name in self.results.swept if name != self.lines[0].axis]
        if not others:
            return ""
        shown = quantity(others[0], self.units)
        return f"{shown.words}: {shown.value(self.results.coords[others[0]][number])}"

    def _fits(self, text: str, size: float | str) -> bool:
        """Whether ``text`` in a font of this ``size`` fits the width of a column. A
        letter is taken as about half as wide as it is high."""
        points, columns = FontProperties(size=size).get_size_in_points(), len(self.lines)
        return columns == 1 or 0.55 * points / 72 * len(text) <= (page_width() - 0.5) / columns

    def outcome_entries(self, panels: Mapping[str, Axes], *, markers: bool) -> list[Artist]:
        """Legend entries for the responses that occur, with the letters that a strip among
        the ``panels`` has, and for failed and doubtful points, with their numbers."""
        outcomes = np.concatenate([line.outcome.ravel() for line in self.lines])
        styles = styles_of(self.results.attrs)
        present = [code for code in range(len(styles)) if (outcomes == code).any()]
        has_letters = any(axes.texts for name, axes in panels.items() if name.partition(" ")[0] == "strip")
        styles = lettered(styles) if has_letters else styles
        entries = response_entries(present, styles, "*:*") if markers else style_areas(styles, present, "strip:*")
        if failed := int((outcomes == FAILED_POINT).sum()):
            words = f"failed ({failed} of {outcomes.size})"
            entries.append(marker_entry(words, "x", "k", size=4, edge=1.0, gid="failed"))
        if after := int((outcomes == NOT_CARRIED_POINT).sum()):
            words = f"{NOT_CARRIED} ({after} of {outcomes.size})"
            entries.append(marker_entry(words, "_", "k", size=4, edge=1.0, gid="not_carried"))
        if unsettled := sum(int(line.unsettled.sum()) for line in self.lines):
            entries.append(unsettled_entry(unsettled, outcomes.size))
        if pending := int((outcomes == PENDING_POINT).sum()):
            words = f"blank: not run yet ({pending} of {outcomes.size})"
            entries.append(line_entry(words, linestyle="none"))
        if inferred := sum(int((line["status"] == INFERRED).sum()) for line in self.lines):
            words = f"no value: inferred, not run ({inferred} of {outcomes.size})"
            entries.append(line_entry(words, linestyle="none"))
        verdicts = [line.verdicts.ravel() for line in self.lines if line.verdicts is not None]
        return entries + (verdict_handles(np.concatenate(verdicts)) if verdicts else [])


def lines_of(results: Results, units: str = "si") -> list[Line]:
    """One line for each column."""
    axis, *others = sorted(results.swept, key=lambda name: name != longest(results)) or [longest(results)]
    if not others:
        return [Line.along(results, axis, units)]
    return [Line.along(results, axis, units, **{others[0]: number}) for number in range(len(results.coords[others[0]]))]


def draw_strip(axes: Axes, line: Line) -> None:
    """The response of every point as coloured cells with letters, a row for each
    procedure; a cross where the run failed, a dash where one before it in its chain
    did, a line below where a run is beyond the validity of its model, black hatching where it had not
    settled, and dots or white hatching where the checks of a point disagree."""
    styles = styles_of(line.results.attrs)
    rows = draw_rows(axes, line, np.ma.masked_less(line.outcome, 0), styles, "strip")
    # that a motion was still changing is seen in print and without colours
    hatch_unsettled(axes, (line.edges, rows), line.unsettled)
    _write_letters(axes, line)
    if (verdicts := line.verdicts) is not None:
        cell_size = 72 * min(STRIP_ROW_HEIGHT, page_width() / len(line.x))
        overlay_verdicts(axes, (line.edges, rows), verdicts, cell_size)
    for code, marker, gid in ((FAILED_POINT, "x", "failed"), (NOT_CARRIED_POINT, "_", "not_carried")):
        row, point = np.nonzero(line.outcome == code)
        if row.size:
            style: Properties = {"markersize": 3.5, "markeredgewidth": 0.8, "linestyle": "none", "color": "k"}
            axes.plot(line.across[point], row, marker=marker, gid=gid, **style)
    if BEYOND in line.results.variables:
        row, point = np.nonzero(line.measured & (line[BEYOND] > 0))
        axes.hlines(row + UNDER, line.edges[point], line.edges[point + 1], colors="k", linewidths=1.5, gid=BEYOND)
    axes.tick_params(length=0, labelbottom=False)
    axes.grid(visible=False)  # a grid of the user's style would look like borders of cells
    for spine in axes.spines.values():
        spine.set_visible(False)


def _write_letters(axes: Axes, line: Line) -> None:
    """The letters of the response in every stretch of cells that has room for them."""
    borders = axes.transData.transform([(edge, 0.0) for edge in line.edges])
    for row, codes in enumerate(line.outcome):
        for code, style in enumerate(styles_of(line.results.attrs)):
            for first, last in stretches(codes == code) if style.letters else ():
                room = (borders[last + 1] - borders[first])[0] / axes.figure.dpi
                if room >= CHARACTER * len(style.letters):
                    middle = axes.transData.inverted().transform((borders[first] + borders[last + 1]) / 2)[0]
                    write_name(axes, (middle, row), style.letters, style.colour, f"area:{code}")


def draw_rows(axes: Axes, line: Line, codes: Array, styles: Sequence[ResponseStyle], gid: str) -> Array:
    """Cells [procedure, point] in the colours of the ``styles`` of their codes, a row
    for each procedure, the first on top; returns the edges of the rows."""
    borders = np.arange(len(line.procedures) + 1) - 0.5
    draw_codes(axes, (line.edges, borders), codes, [style.colour for style in styles], gid, gid)
    axes.set_ylim(borders[-1], borders[0])
    names = [way_word(procedure, line.results.attrs) for procedure in line.procedures]
    axes.set_yticks(borders[1:] - 0.5, names)
    return borders


def draw_codes(
    axes: Axes, cells: tuple[Array, Array], codes: Array, colours: Sequence[str], name: str, gid: str
) -> None:
    """Cells [y, x] in the ``colours`` of their codes; ``name`` is that of the scale."""
    scale, norm = ListedColormap(list(colours), name=name), BoundaryNorm(np.arange(-0.5, len(colours)), len(colours))
    axes.pcolormesh(*cells, codes, cmap=scale, norm=norm, gid=gid, **cell_style(codes.size))


def shade_hysteresis(axes: Axes, line: Line) -> None:
    """Shade where up and down differ in response, cell by cell."""
    shaded, borders = spans(differences(line.procedures, line.outcome)), line.edges
    style: Properties = {"facecolor": SHADE, "edgecolor": "none", "linewidth": 0, "zorder": 0}
    for first, last in shaded:
        axes.axvspan(borders[first], borders[last + 1], gid="hysteresis", **style)


def hysteresis_entry(attrs: Attributes) -> Artist:
    """The entry of what :func:`shade_hysteresis` draws."""
    words = f"{both_ways(attrs)} differ in response"
    return area_entry(facecolor=SHADE, edgecolor=SHADE_EDGE, linewidth=0.5, label=words, gid="hysteresis")


def is_open(procedure: str, procedures: Sequence[str]) -> bool:
    """Whether the markers of a procedure are open. Those of the way down are, so that
    those of the way up show through; not if there is no way up."""
    return procedure == "down" and len(procedures) > 1


def is_beside(procedure: str, procedures: Sequence[str]) -> bool:
    """Whether a procedure is that of starts at the points, beside others whose markers,
    larger than its own, show around them."""
    return procedure == "same" and len(procedures) > 1


# the wall is drawn where the motion reaches this part of the gap
WALL_VISIBLE_FROM = 0.4
PIXELS = (1050, 300)  # of a panel: half those in print, as a marker covers several
# Factors that make markers of different shapes look equally large.
SMALLER = 0.55  # markers of starts at the points beside those of carried states
RELATIVE_SIZE = {"^": 1.15, "s": 0.9, "p": 1.15, "D": 0.85, "P": 1.15, "X": 1.15, "*": 1.5, "_": 1.6}


def draw_dots(
    axes: Axes,
    line: Line,
    name: str,
    codes: Array,
    styles: Sequence[ResponseStyle],
    values: Array,
    *,
    marker: str = "",
    scale: float = 1.0,
    edge: float = 0.4,
    rasterise: bool = False,
    gid: str = "",
) -> None:
    """Draw every finite one of the ``values`` [procedure, point, number] of a variable,
    an artist for each of the ``codes`` [procedure, point] and procedure in the style of
    the code. All have the ``marker`` if given; those of the way down are open, with an
    ``edge`` [points]. Neighbours on the axis just touch, within the limits of what can be
    printed and distinguished. Their ``gid`` begins with the variable, if none is
    given."""
    across, heights = np.broadcast_to(line.across[:, None], values.shape[1:]), values / quantity(name, line.units).scale
    subplot_spec = axes.get_subplotspec()
    columns = subplot_spec.get_gridspec().ncols if subplot_spec else 1
    size = scale * float(np.clip(72 * (page_width() - 0.7) / columns / max(len(line.x), 1), 1.7, 3.2))
    # By code first, so that grey lies below and the rarer combinations on top; the open
    # markers after the filled.
    for code, style in enumerate(styles):
        for row, procedure in enumerate(line.procedures):
            shown = np.isfinite(values[row]) & (codes[row] == code)[:, None]
            if not shown.any():
                continue
            hollow, shape = is_open(procedure, line.procedures), marker or style.marker
            x, y = across[shown], heights[row][shown]
            kept = one_per_pixel(x, y, PIXELS)
            axes.plot(
                x[kept],
                y[kept],
                linestyle="none",
                marker=shape,
                color=style.colour,
                markersize=size
                * RELATIVE_SIZE.get(shape, 1.0)
                * (SMALLER if is_beside(procedure, line.procedures) else 1.0),
                markerfacecolor="none" if hollow else style.colour,
                markeredgewidth=0.9 if shape == "_" else edge if hollow else 0.0,
                rasterized=rasterise,
                zorder=2 + 0.01 * code,
                gid=f"{gid or name}:{procedure}:{code}",
            )


ROTARY_SPEED: Properties = {**DASHED, "zorder": 1.5, "gid": "rotary speed"}


def draw_rotary_speed(axes: Axes, line: Line) -> None:
    """The rotary speed of the drive as a line: the speed of the bit in steady
    drilling."""
    if "rotary_speed" not in line.results.axes:
        return
    if line.axis == "rotary_speed" and len(line.x) > 1:
        axes.plot(line.across, line.across, **ROTARY_SPEED)
    else:
        place = line.place[3] if isinstance(line.place[3], int) else 0
        speed = float(line.results.coords["rotary_speed"][place]) / quantity("rotary_speed", line.units).scale
        axes.axhline(speed, **ROTARY_SPEED)


def rotary_speed_entry() -> Artist:
    """The entry of what :func:`draw_rotary_speed` draws."""
    return line_entry(label="rotary speed", **ROTARY_SPEED)


def draw_wall(axes: Axes, attrs: Attributes, greatest: float, units: str) -> None:
    """The wall of the hole as a line, where the file with these ``attrs`` has its distance;
    where the motion, whose ``greatest`` radius is in SI, stays far from it, its distance
    beside an arrow."""
    gap = attrs.get("gap")
    if gap is None:
        return
    radius = quantity(drawn_in(attrs).radius, units)
    height = float(gap) / radius.scale
    if greatest >= WALL_VISIBLE_FROM * float(gap):
        axes.axhline(height, color=REFERENCE, linewidth=0.9, zorder=1.5, gid="wall")
        return
    corner: Properties = {"xycoords": "axes fraction", "ha": "right", "va": "top", "gid": "wall afar"}
    write(axes, f"\u2191 wall at {height:.4g} {radius.unit}", (1.0, 1.0), (-3, -3), color=REFERENCE, **corner)


def wall_entry() -> Artist:
    """The entry of what :func:`draw_wall` draws."""
    return line_entry(color=REFERENCE, linewidth=0.9, label="wall of the hole", gid="wall")


def greatest_of(results: Results, names: Iterable[str]) -> float:
    """The greatest value of variables at the points of a sweep that ended well, in SI; 0
    where none has a value."""
    greatest, ran = 0.0, results["status"] == OK
    for values in (np.asarray(results.variables[name]) for name in names if name in results.variables):
        known = np.isfinite(values) & ran.reshape(ran.shape + (1,) * (values.ndim - ran.ndim))
        greatest = max(greatest, float(np.max(values, initial=0.0, where=known)))
    return greatest


def graded(name: str, attrs: Attributes) -> Response | None:
    """The response of the model of a file with the root attributes ``attrs`` whose severity
    is graded by the variable of this name."""
    return next((response for response in told_responses(attrs).values() if response.graded == name), None)


def severity_bounds(attrs: Attributes, name: str) -> tuple[float, ...]:
    """The four bounds of severity of variable ``name`` in its own units, none where it
    is not graded.

    ``attrs`` are the root attributes of a results file. The thresholds of a new
    classification come before those of the study, and these before the defaults.
    """
    response = graded(name, attrs)
    if response is None:
        return ()
    thresholds = in_force(attrs)[response.name]
    return tuple(float(thresholds[key]) for key in response.bounds)


BINS = 1500  # of a curve: about one for each pixel in print
MAX_MARKERS = 200
SEVERITY_GREYS = ("#FFFFFF", "#F5F5F5", "#EBEBEB", "#DFDFDF", "#D2D2D2")


def says_nothing(name: str, response: Array, attrs: Attributes) -> Array:
    """Where a variable says nothing: the index of how a bit turns, where it is
    stalled."""
    one = graded(name, attrs)
    return np.asarray((response & STALLED > 0) & (one is not None and one.turning))


def draw_values(axes: Axes, line: Line, name: str, style: Properties | None = None) -> None:
    """A line for each procedure, broken where a run is not known or the value says
    nothing; points that were inferred instead of run are skipped."""
    shown = np.where(says_nothing(name, line["response"], line.results.attrs), np.nan, line.shown(name))
    for row, procedure in enumerate(line.procedures):
        status = line["status"][row]
        values, was_run = np.where(line.measured[row], shown[row], np.nan), status != INFERRED
        kept_x, kept_y = envelope(line.across[was_run], values[was_run], BINS)
        own = {"gid": f"{name}:{procedure}", **curve_style(procedure, line.procedures, len(kept_x))}
        axes.plot(kept_x, kept_y, **{**own, **(style or {})})


def curve_style(procedure: str, procedures: tuple[str, ...], points: int = 0) -> Properties:
    """A line with markers; of more than :data:`MAX_MARKERS` points a line alone,
    thinner from :data:`BINS` points on."""
    colour = DIRECTION_COLOURS.get(procedure, REFERENCE)
    hollow, beside = is_open(procedure, procedures), is_beside(procedure, procedures)
    if points > MAX_MARKERS:
        return {"color": colour, "linewidth": 0.7 if points < BINS else 0.4, "zorder": 3 if hollow else 2.5}
    return {
        "color": colour,
        "linewidth": 0.7,
        "linestyle": "--" if hollow else ":" if beside else "-",
        "marker": {"down": "v", "up": "^"}.get(procedure, "o"),
        "markersize": 2.8 * (SMALLER if beside else 1.0),
        "markerfacecolor": "white" if hollow else colour,
        "markeredgewidth": 0.5,
        "zorder": 3 if hollow else 2.5,
    }


def limit_values(axes: Axes, line: Line, lines: Sequence[Line], name: str) -> None:
    """Set the limits of the panel of one of the ``lines``, which all have in common; they
    are insensitive to a few outliers, and those of this one are arrows on the border."""
    is_shown = [one.measured & ~says_nothing(name, one["response"], one.results.attrs) for one in lines]
    values = np.concatenate(
        [np.where(chosen, one.shown(name), np.nan).ravel() for chosen, one in zip(is_shown, lines, strict=True)]
    )
    low, high = robust_limits(values)
    if quantity(name, line.units).unit == "%":  # a share of time or of a mean speed: the axis begins at zero
        low, responses = 0.0, told_responses(line.results.attrs).values()
        high = max(high, max((one.axis for one in responses if one.feature == name), default=5.0))
    margin = 0.06 * (high - low)
    axes.set_ylim(low - (margin if low else 0.03 * (high - low)), high + margin)
    bottom, top = axes.get_ylim()
    arrow: Properties = {"linestyle": "none", "markersize": 4, "clip_on": False, "zorder": 5}
    chosen = line.measured & ~says_nothing(name, line["response"], line.results.attrs)
    for row, procedure in enumerate(line.procedures):
        shown, colour = line.shown(name)[row], DIRECTION_COLOURS.get(procedure, REFERENCE)
        for outside, border, marker in ((shown > top, top, "^"), (shown < bottom, bottom, "v")):
            x = line.across[outside & chosen[row]]
            if x.size:
                gid = f"{name}:{procedure}:beyond"
                axes.plot(x, np.full(x.size, border), marker=marker, color=colour, gid=gid, **arrow)


def shade_severity(axes: Axes, attrs: Attributes, name: str, units: str, *, with_names: bool) -> None:
    """The bands of severity of a variable behind its curve, where it is graded, with
    their names at the right where ``with_names``."""
    response = graded(name, attrs)
    if response is None:
        return
    bounds = [bound / quantity(name, units).scale for bound in severity_bounds(attrs, name)]
    top = axes.get_ylim()[1]
    ends = [*bounds, max(top, bounds[-1])]
    bands = zip([0.0, *bounds], ends, response.bands, SEVERITY_GREYS, strict=True)
    for number, (start, end, word, grey) in enumerate(bands):
        axes.axhspan(start, end, facecolor=grey, edgecolor="none", zorder=0, gid=f"severity:{number}")
        end = min(end, top)
        if with_names and end - start > 0.07 * top:
            write(axes, word, (1.005, 0.5 * (start + end)), xycoords=BESIDE, va="center", color=REFERENCE)
