"""Branches of motions over the peaks of a sweep: solid where stable, dashed where
unstable, dotted where that is not decided, with markers at special points; above the panels
a row of ticks for each kind of them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import Normal, Stroke
from matplotlib.transforms import ScaledTranslation

from nsdrill.analysis.bifurcations import (
    BRANCH,
    CIRCLE,
    CRITICALITY_NAMES,
    CYCLE,
    DOUBLING,
    END,
    EQUILIBRIUM,
    FAILED,
    FOLD,
    HOPF,
    NONE,
    NOT_DECIDED,
    PERIODIC,
    SUBCRITICAL,
    TORUS,
    meanings_of,
)
from nsdrill.analysis.comparison import other_string
from nsdrill.data import Array, Results
from nsdrill.errors import InputError, Refusal, option
from nsdrill.figures.look import look, value_of
from nsdrill.figures.map_panels import Planes
from nsdrill.figures.page import lay_up, line_entry, marker_entry, page_height, stack
from nsdrill.figures.painters import Page
from nsdrill.figures.panels import (
    draw_dots,
    draw_wall,
    greatest_of,
    hysteresis_entry,
    is_open,
    shade_hysteresis,
    wall_entry,
)
from nsdrill.figures.picture_kinds import BRANCHES, Kind, is_branches
from nsdrill.figures.slices import Line, taken
from nsdrill.figures.style import (
    BLACK,
    BLUE,
    FONT_SIZE,
    GREEN,
    ORANGE,
    REFERENCE,
    SKY,
    VERMILLION,
    WINE,
    Dashes,
    Properties,
    ResponseStyle,
    font_size,
    page_width,
)
from nsdrill.models.model_description import Panel
from nsdrill.models.registry import drawn_in, model_in
from nsdrill.quantity import quantity as base_quantity
from nsdrill.words.labels import LETTER, heading, operating_point, quantity, setting, way_word

if TYPE_CHECKING:
    from xarray import Dataset

HEIGHT, TEXT_HEIGHT = 5.6, 1.4  # inches
SWEEP = ResponseStyle("all peaks of the sweep", "#94B6D6")  # pale: lines lie above them
# Marker and colour of each label; those of grazing take the rest in order.
MARKERS: dict[int, tuple[str, str]] = {
    FOLD: ("s", VERMILLION),
    DOUBLING: ("^", BLUE),
    TORUS: ("D", GREEN),
    BRANCH: ("P", WINE),
    HOPF: ("o", ORANGE),
    FAILED: ("x", BLACK),
}
# Rings a little larger and thinner than alone, to stay open beside each other.
DOTS: Properties = {"scale": 1.3, "edge": 0.3, "rasterise": True}
OPEN = "stability not decided"
STABILITY: dict[str, Properties] = {
    "stable": {"linestyle": "-", "linewidth": 1.3},
    "unstable": {"linestyle": (0, (3, 2)), "linewidth": 0.8},
    OPEN: {"linestyle": (0, (1, 1.5)), "linewidth": 1.3},
}
# Of curves over a map: none is a plain dash, which lines of equal rate of penetration are.
CURVE_DASHES: dict[int, Dashes] = {FOLD: "-", DOUBLING: (0, (7, 1.2, 1, 1.2, 1, 1.2))}
GRAZING_DASHES = ((0, (1, 1)), (0, (4, 1, 1, 1)), (0, (2, 1, 2, 3)))
MARK_EVERY = (0.04, 0.18)  # of the diagonal of a map: the first marker of a curve, and the next ones
GRAZING_MARKERS = (("v", SKY), ("<", "#7A5195"), (">", "#8C6D31"))
COLOURS = {PERIODIC: BLACK, EQUILIBRIUM: BLACK, CYCLE: "#7A3B00", CIRCLE: "#00634A"}
# Motions with a second frequency: wider by so many points, with a core, to be told in grey.
CORED, WIDER, CORE = (CYCLE, CIRCLE), 0.9, 0.7
MOTION_NAMES = {
    EQUILIBRIUM: "steady drilling",
    PERIODIC: "periodic motions",
    CYCLE: "limit cycles",
    CIRCLE: "invariant circles (whirl)",
}
OF_ANY = {EQUILIBRIUM: "equilibria", CIRCLE: "invariant circles"}  # of a model that is no drill string
MARKER_SIZE = 4.0  # points in type of the usual size: special points of a branch that are closer share a marker
SEVERAL = ("several special points", "o", BLACK, False)  # name, marker, colour, whether it is hollow
ROW_HEIGHT = 0.13  # inches, of the ticks of one kind of special points
MARKER_BESIDE = 5.0  # points from the ticks to the marker of their kind


def branches(data: Dataset, units: str = "si", over: Results | None = None) -> Page:
    """The branches of a Dataset: of each motion the greatest values over its period, in
    the panels that its model declares. ``over`` is a sweep whose peaks are drawn
    beneath."""
    along = str(data.attrs["along"])
    shown = [panel for panel in drawn_in(data.attrs).panels if panel.greatest in data]
    if not shown:
        raise InputError("the branches: found no feature that a panel shows; allowed: a file of nsdrill branches.")
    x = quantity(along, units)
    fixed = held_in(data)
    if over is not None:
        check_same_string(data, over, fixed, units)
        check_along(over, along)
    ends = [float(data.attrs.get(name, np.nan)) / x.scale for name in ("continue_from", "continue_to")]
    if (xlim := look.get().xlim) is not None:
        ends = [value_of("xlim", end, base_quantity(along).units) / x.scale for end in xlim]
    line = None if over is None else _between(over, along, units, ends)
    special = _SpecialPoints(data, data[along].values / x.scale, ends)
    panel_height, strip_height = (HEIGHT - TEXT_HEIGHT) * max(2.0 / len(shown), 1.0) / 3, ROW_HEIGHT * len(special.rows)
    heights = [*([strip_height] if special.rows else []), *[panel_height] * len(shown)]
    height = TEXT_HEIGHT + sum(heights)
    panel_height *= (page_height(height) - TEXT_HEIGHT) / sum(heights)
    letters = max(8, int(72.0 * panel_height / (LETTER * font_size(FONT_SIZE))))
    drawn = {panel.greatest: _Panel(data, along, panel, units) for panel in shown}

    def frame(axes: Axes) -> None:
        axes.set_xlabel(x.label)
        if np.all(np.isfinite(ends)):
            axes.set_xlim(*ends)

    def paint(panel: _Panel, axes: Axes) -> None:
        if line is not None:
            panel.draw_sweep(axes, line)
        panel.draw_branches(axes)
        lay_up(axes, panel.feature, panel.y_shown.in_lines(letters))
        frame(axes)
        special.mark(axes, panel)
        if panel.mode == "lateral":
            values = data[panel.feature].values
            greatest = float(np.max(values, initial=0.0, where=np.isfinite(values)))
            swept = greatest_of(line.results, (panel.peaks, panel.feature)) if line is not None else 0.0
            draw_wall(axes, data.attrs, max(greatest, swept), units)

    def paint_strip(axes: Axes) -> None:
        frame(axes)
        special.draw_rows(axes)

    def arrange(figure: Figure) -> list[Axes]:
        panels = stack(figure, len(heights), heights=heights)
        figure.align_ylabels(panels[-len(shown) :])
        return panels

    entries = [*(() if line is None else _sweep_entries(line, shown)), *next(iter(drawn.values())).entries()]
    # the rows above the panels name the kinds, but of one panel alone
    entries += special.entries(with_kinds=look.get().alone)
    strip = {"strip": paint_strip} if special.rows else {}
    return Page(
        {**strip, **{name: partial(paint, panel) for name, panel in drawn.items()}},
        heading(data.attrs, operating_point(fixed, units)),
        page_width(),
        height,
        arrange,
        lambda panels: [*entries, wall_entry()],
    )


def held_in(data: Dataset) -> dict[str, float]:
    """The operating values [SI] that branches hold fixed."""
    names, along = model_in(data.attrs).operation.names(), str(data.attrs["along"])
    return {name: float(data[name].values[0]) for name in names if name in data and name != along}


def check_same_string(data: Dataset, over: Results, fixed: dict[str, float], units: str) -> None:
    """InputError where a sweep and branches, one of which is drawn over the other, are
    of different strings."""
    ignored = {str(data.attrs.get(name, "")) for name in ("along", "along_key", "over", "over_key")}
    differences = other_string(data.attrs, over, fixed, ignored)
    if differences:
        listing = "; ".join(
            f"{key}: {setting(key, of_branches, units)} of the branches, {setting(key, of_sweep, units)} of the sweep"
            for key, of_branches, of_sweep in differences[:4]
        )
        raise Refusal("over", f"another string ({listing})", "results of the same string")


def check_along(over: Results, along: str) -> None:
    """InputError where a sweep is not one along the number that is continued."""
    if along not in over.axes:
        raise InputError(
            f"{option('over')}: found a sweep without {along}; allowed: a sweep along the number that is continued."
        )
    if [name for name in over.swept if name != along]:
        raise InputError(
            f"{option('over')}: found a sweep over {' and '.join(over.swept)}; allowed: one over {along} "
            "alone. Run a study of that axis."
        )


class _Panel:
    """One panel of branches: the greatest values of a motion along the number that is
    continued, in the units that are shown."""

    def __init__(self, data: Dataset, along: str, panel: Panel, units: str) -> None:
        self.data, self.peaks, self.feature, self.mode = data, panel.peaks, panel.greatest, panel.mode
        self.y_shown = quantity(self.feature, units)
        self.x = data[along].values / quantity(along, units).scale
        self.y = data[self.feature].values / self.y_shown.scale
        self.motions = [str(one) for one in data["motion"].values]

    def draw_sweep(self, axes: Axes, line: Line) -> None:
        """All peaks of a sweep and its greatest values, open on the way down, and where
        up and down differ in response."""
        for name, gid in ((self.peaks, "sweep"), (self.feature, "sweep greatest")):
            if name in line.results.variables:
                values = line[name].reshape(*line.outcome.shape, -1)
                draw_dots(axes, line, name, np.zeros_like(line.outcome), [SWEEP], values, gid=gid, **DOTS)
        shade_hysteresis(axes, line)

    def draw_branches(self, axes: Axes) -> None:
        """Every branch, in the colour of its motion, solid or dashed by its
        stability."""
        unstable = self.data["unstable"].values
        for number, part in enumerate(parts_of(self.data["row_size"].values)):
            x, y, of_piece = self.x[part], self.y[part], pieces(unstable[part])
            for name in STABILITY:
                drawn = of_piece == name
                # Every run of pieces is one line, as the dash pattern restarts after a break.
                breaks = np.flatnonzero(~drawn) + 1
                path = np.insert(x, breaks, np.nan), np.insert(y, breaks, np.nan)
                order, gid = 2.5 if name == "unstable" else 3, f"branch {number} {name}:{self.motions[number]}"
                axes.plot(*path, zorder=order, gid=gid, **_line_style(self.motions[number], name))

    def entries(self) -> list[Artist]:
        """The entries of the legend for the branches."""
        entries = [
            line_entry(label=name, color=REFERENCE, gid=f"branch * {name}", **style)
            for name, style in STABILITY.items()
            if name != OPEN or np.any(self.data["unstable"].values == NOT_DECIDED)
        ]
        for motion in dict.fromkeys(self.motions):
            own = {} if model_in(self.data.attrs).drills else OF_ANY
            words = own.get(motion) or MOTION_NAMES.get(motion, motion.replace("_", " "))
            entries.append(line_entry(label=words, gid=f"branch *:{motion}", **_line_style(motion, "stable")))
        return entries


def pieces(unstable: Array) -> Array:
    """The name in ``STABILITY`` of each piece between two points with these numbers of unstable
    directions: a piece is stable where both points are, and not decided where one is not, but
    for a point beside an unstable one."""
    before, after = unstable[:-1], unstable[1:]
    is_unstable = (before > 0) | (after > 0)
    is_open = (before == NOT_DECIDED) | (after == NOT_DECIDED)
    return np.where(is_unstable, "unstable", np.where(is_open, OPEN, "stable"))


def _sweep_entries(line: Line, panels: Sequence[Panel]) -> Iterator[Artist]:
    """The entries of the legend for a sweep below branches."""
    has_peaks = panels[0].peaks in line.results.variables
    for procedure in line.procedures:
        way = "" if procedure == "same" else f", {way_word(procedure, line.results.attrs)}"
        yield marker_entry(
            f"{'all peaks' if has_peaks else 'greatest values'} of the sweep{way}",
            SWEEP.marker,
            SWEEP.colour,
            hollow=is_open(procedure, line.procedures),
            gid=f"sweep*:{procedure}",
        )
    yield hysteresis_entry(line.results.attrs)


def _line_style(motion: str, stability: str) -> Properties:
    """The line of a branch of this motion, ``stable`` or ``unstable``."""
    style = {"color": COLOURS.get(motion, BLACK), **STABILITY[stability]}
    if motion in CORED:
        style["linewidth"] += WIDER
        style["path_effects"] = [Normal(), Stroke(linewidth=CORE, foreground="white")]
    return style


def _between(over: Results, along: str, units: str, ends: Sequence[float]) -> Line | None:
    """The points of a sweep between these ``ends``, where they are known: others would
    set the limits of the panels. None where it has no such points."""
    low, high = sorted(ends) if np.all(np.isfinite(ends)) else (-np.inf, np.inf)
    x = over.coords[along] / quantity(along, units).scale
    order = np.argsort(x, kind="stable")
    inside = order[(x[order] >= low) & (x[order] <= high)]
    return Line.along(taken(over, along, inside), along, units) if inside.size else None


class _SpecialPoints:
    """The special points of branches between these ``ends`` of x, where they are known:
    a row of ticks for each kind of them above the panels, and markers in the
    panels."""

    def __init__(self, data: Dataset, x: Array, ends: Sequence[float]) -> None:
        low, high = sorted(ends) if np.all(np.isfinite(ends)) else (-np.inf, np.inf)
        self.x, self.labels, sizes = x, data["label"].values, data["row_size"].values
        self.branches = np.repeat(np.arange(len(sizes)), sizes)
        self.numbers = np.flatnonzero((self.labels != 0) & (self.labels != END) & (x >= low) & (x <= high))
        meanings = meanings_of(model_in(data.attrs))
        looks = _looks(meanings)
        sides = data["criticality"].values if "criticality" in data else np.full(len(x), NONE)
        self.kinds = [*zip(self.labels.tolist(), sides.tolist(), strict=True)]
        found = {self.kinds[number] for number in self.numbers}
        kinds = sorted(found, key=lambda kind: (kind[0] < 0, [*meanings].index(kind[0]), kind[1]))
        # of each kind, a label with what emanates: its name, marker, colour and face, from the row at the top
        self.rows = {
            kind: (_name(meanings[kind[0]].name, kind[1]), *looks.get(kind[0], ("o", BLACK)), kind[1] == SUBCRITICAL)
            for kind in kinds
        }

    def draw_rows(self, axes: Axes) -> None:
        """A tick for every special point, in the row of its kind, which has its name
        and its marker at the left."""
        places = [np.array([self.x[one] for one in self.numbers if self.kinds[one] == kind]) for kind in self.rows]
        names, _, colours, _ = zip(*self.rows.values(), strict=True)
        rows = np.arange(len(places))
        axes.eventplot(places, lineoffsets=rows.tolist(), linelengths=0.7, linewidths=0.7, colors=colours)
        for collection, name in zip(axes.collections, names, strict=True):
            collection.set_gid(f"ticks:{name}")
        left = ScaledTranslation(-MARKER_BESIDE / 72, 0, axes.figure.dpi_scale_trans)
        beside: Properties = {"transform": axes.get_yaxis_transform() + left, "clip_on": False}
        for row, (_, *look_of) in zip(rows, self.rows.values(), strict=True):
            axes.plot([0.0], [row], **_marker_style(*look_of), **beside)
        axes.set(ylim=(rows[-1] + 0.5, -0.5))
        axes.set_yticks(rows, names)
        axes.tick_params(axis="y", length=0, pad=2 * MARKER_BESIDE)
        axes.tick_params(axis="x", length=0)
        axes.grid(visible=False)  # a grid of the user's style would look like more ticks
        for spine in axes.spines.values():
            spine.set_visible(False)

    def mark(self, axes: Axes, panel: _Panel) -> None:
        """Markers at the special points of a panel: one where several of a branch would
        lie on each other, a black dot if they are of several kinds."""
        for members in self._groups(axes, panel):
            kinds = {self.kinds[member] for member in members}
            name, *look_of = self.rows[kinds.pop()] if len(kinds) == 1 else SEVERAL
            place = members[0]
            axes.plot(panel.x[place], panel.y[place], zorder=4, gid=f"special:{name}", **_marker_style(*look_of))

    def entries(self, *, with_kinds: bool) -> list[Artist]:
        """The entries of the legend for the markers."""
        return [
            line_entry(label=name, gid=f"special:{name}", **_marker_style(*look_of))
            for name, *look_of in (*(self.rows.values() if with_kinds else ()), SEVERAL)
        ]

    def _groups(self, axes: Axes, panel: _Panel) -> list[Array]:
        """The numbers of the special points, those of a branch together that would lie
        on each other; the first of each has the marker."""
        places = self.numbers[np.isfinite(panel.y[self.numbers])]
        branches, points = self.branches[places], np.column_stack((panel.x, panel.y))[places]
        steps = axes.transData.transform(points) / axes.figure.dpi * 72.0 / font_size(MARKER_SIZE)
        groups: list[list[int]] = []  # of numbers in places
        for number, branch in enumerate(branches):
            own = [group for group in groups if branches[group[0]] == branch]
            distances = [float(np.hypot(*(steps[group[0]] - steps[number]))) for group in own]
            if distances and min(distances) < 1.0:
                own[int(np.argmin(distances))].append(number)
            else:
                groups.append([number])
        return [places[group] for group in groups]


def _looks(meanings: Mapping[int, object]) -> dict[int, tuple[str, str]]:
    """Marker and colour of each label of a model with these ``meanings``."""
    grazing = [code for code in meanings if code > 100]
    return MARKERS | {code: GRAZING_MARKERS[i % 3] for i, code in enumerate(grazing)}


def _name(label: str, criticality: int) -> str:
    """A label in running text, with which side what emanates is on."""
    name = label.replace("_", " ")
    return name if criticality == NONE else f"{name}, {CRITICALITY_NAMES[criticality].replace('_', ' ')}"


def _marker_style(marker: str, colour: str, is_hollow: bool = False) -> Properties:
    """The marker of a special point; ``is_hollow``: what emanates is unstable beside it."""
    is_cross = marker == "x"
    if is_hollow:
        width = {"markersize": font_size(MARKER_SIZE), "markeredgewidth": 1.0}
        return {"marker": marker, "color": colour, "linestyle": "none", "markerfacecolor": "white", **width}
    style: Properties = {"marker": marker, "color": colour, "linestyle": "none"}
    style["markersize"] = font_size(MARKER_SIZE)
    return style | {"markeredgecolor": colour if is_cross else "white", "markeredgewidth": 0.9 if is_cross else 0.4}


def parts_of(sizes: Array) -> list[slice]:
    """The parts of these sizes, one after the other."""
    ends = np.cumsum(sizes).tolist()
    return [slice(end - size, end) for end, size in zip(ends, sizes.tolist(), strict=True)]


def draw_branch_curves(panels: Iterable[Axes], data: Dataset, plane: Planes) -> list[Artist]:
    """The curves of a file of branches over the panels of a map; returns the entries of
    the legend."""
    along, over, x, y = str(data.attrs.get("along", "")), str(data.attrs.get("over", "")), plane.x, plane.y
    if "curve_row_size" not in data or {along, over} != {x, y}:
        available = f"curves over {along} and {over}" if over else "no curves"
        raise InputError(
            f"{option('over')}: found branches with {available}; allowed: curves over {x} and {y}, for which "
            "continue.curves of a study asks."
        )
    meanings = meanings_of(model_in(data.attrs))
    codes = data["curve_label"].values.tolist()
    looks, grazing = _looks(meanings), [code for code in dict.fromkeys(codes) if code not in CURVE_DASHES]
    dashes = CURVE_DASHES | {code: GRAZING_DASHES[i % 3] for i, code in enumerate(grazing)}
    handles: dict[str, Artist] = {}
    paths = [data[f"curve_{name}"].values / quantity(name, plane.units).scale for name in (x, y)]
    for number, (code, part) in enumerate(zip(codes, parts_of(data["curve_row_size"].values), strict=True)):
        marker: Properties = {
            "marker": looks[code][0],
            "markersize": font_size(MARKER_SIZE),
            "markerfacecolor": "white",
        }
        style = {"linestyle": dashes[code], "color": BLACK, "linewidth": 1.3, **marker}
        curve = [path[part] for path in paths]
        for axes in panels:
            limits = {"xlim": axes.get_xlim(), "ylim": axes.get_ylim()}
            # below the names of areas and the labels of lines
            axes.plot(*curve, color="white", linewidth=2.6, zorder=4.2)
            axes.plot(*curve, gid=f"curve {number}:{code}", markevery=MARK_EVERY, zorder=4.3, **style)
            axes.set(**limits)
        name = meanings[code].title
        handles.setdefault(name, line_entry(label=name, gid=f"curve *:{code}", **style))
    return [*handles.values()]


KINDS = (
    Kind(
        "branches",
        "stable and unstable motions along the number that is continued",
        of=BRANCHES,
        place=lambda data: 0 if is_branches(data) else None,
        page=branches,
        takes=("over",),
        across=lambda data: str(data.attrs["along"]),
    ),
)
