"""The operating window, readable at a glance: where one may run, and how one comes there;
and the windows of two studies side by side.

There is a panel for each value of a third axis, or a strip where only one axis is
swept. Colour is what happens on the way in (:mod:`nsdrill.figures.zones`), a dark line
surrounds what is allowed, and words in capitals name the regions. With samples the
colour is the probability of being allowed.
"""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Sequence
from functools import partial
from itertools import pairwise

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.transforms import Bbox

from nsdrill.analysis.advice import Advice
from nsdrill.analysis.advice import Kind as Answered
from nsdrill.analysis.limits import past_jumps
from nsdrill.analysis.maps import USES, classes
from nsdrill.analysis.planes import axes_of, judges
from nsdrill.analysis.window import find_window, unknown_words
from nsdrill.data import Answer, Array, Results, evenly_spaced
from nsdrill.figures.area_names import name_regions
from nsdrill.figures.cells import (
    RATE_OF_PENETRATION,
    UNSETTLED_HATCH,
    cover,
    draw_equal_rates,
    draw_field,
    draw_outline,
    equal_rates_entry,
    hatch,
    hatch_unsettled,
    outline_entry,
    unsettled_entry,
)
from nsdrill.figures.legend import put_legend
from nsdrill.figures.look import Look
from nsdrill.figures.map_panels import COLUMNS_OF_PANELS, PANEL_WIDTH, Plane, height_of_maps, lies_across
from nsdrill.figures.page import (
    SHORTEST_LINE,
    area_entry,
    draw_page,
    freeze_layout,
    has_title,
    line_entry,
    panels_per_row,
)
from nsdrill.figures.painters import Bar, Page, numbered
from nsdrill.figures.panels import draw_codes
from nsdrill.figures.picture_kinds import MAX_PANELS, PLANE, Kind, longest
from nsdrill.figures.style import (
    BLACK,
    FIELD_BORDER,
    FULL_WIDTH,
    GOODNESS,
    GREY,
    Properties,
    cell_style,
    font_size,
    halo,
    house_style,
    page_width,
    using_look,
    without_glyph_warnings,
)
from nsdrill.figures.zones import ONLY_FROM_ABOVE, STARTED, UNKNOWN, codes_of, in_order, lowered, zones
from nsdrill.records import dataclass
from nsdrill.words.answer import answer, before_trials, first_notes, headlines, is_hint, of_both, words_of
from nsdrill.words.labels import describe_overrides, operating_point, sweep_title
from nsdrill.words.values import Formatter

LOWERED_HATCH, STARTED_HATCH, UNKNOWN_HATCH, JUMPED_HATCH = "////", "...", "xxxxxx", "----"
HATCH_WIDTH = 1.8  # points
REVOKED, REVOKED_HATCH, REVOKED_EDGE, REVOKED_VEIL = -2, "\\\\\\\\", "#9B2226", 0.55  # a code, and how it looks
BORDER: Properties = {"edgecolor": "#3A3A3A", "linewidth": 0.4}
VIBRATED: Properties = {
    "marker": "X",
    "markersize": 8,
    "color": BLACK,
    "markeredgecolor": "white",
    "linestyle": "none",
    "zorder": 5.1,
    "clip_on": False,
}


@dataclass(frozen=True)
class Spot:
    """A point of a map, in SI: the ``point``; the ends of the bar, ``stay_within`` along
    the first axis, None where there is none; whether it ``is_hint``; the probability of a
    point that is only the most probable one; and the ends of the rectangle to ``stay_within``
    along the second axis, ``across``."""

    point: dict[str, float]
    stay_within: tuple[float, float] | None
    is_hint: bool
    probability: float | None = None
    across: tuple[float, float] | None = None


class Window:
    """The operating window of a sweep, as it is drawn: its ``numbers`` and its
    ``maps``, one for each value of a third axis, over a ``plane``. Its answer is the one with
    trials that is given, ``tried``."""

    def __init__(
        self,
        results: Results,
        units: str,
        severity: int | None = None,
        confidence: float | None = None,
        rates: bool = False,
        tried: Advice | None = None,
    ) -> None:
        self.units, self.rates, self.numbers = units, rates, find_window(results, severity, confidence)
        if tried is not None:
            self.numbers = {**self.numbers, "answer": tried}
        self.maps = classes(results, severity, self.numbers["confidence"])
        self.codes, self.zones = codes_of(self.maps.grades), zones(self.maps.grades, severity)
        self.lowered = lowered(self.maps.grades)
        self.jumped = past_jumps(self.maps.grades)
        self.plane = Plane(results, self.maps.x, self.maps.y, units)

    @property
    def advice(self) -> Advice:
        """The answer of the window."""
        found: Advice = self.numbers["answer"]
        return found

    @property
    def has_samples(self) -> bool:
        """Whether colours are probabilities."""
        return self.maps.confidence is not None

    def where(self, number: int) -> str:
        """The value of the third axis of a map; empty where there is none."""
        third = self.maps.third
        return operating_point({third: self.maps.values(third)[number]}, self.units) if third else ""

    def spot(self, number: int) -> Spot | None:
        """The point of a map: that of the answer where it is here, else the best one of the
        map; None where there is none."""
        advice, maps = self.advice, self.maps
        depths = advice.depths if maps.third == "depth" else None
        everywhere = depths is not None and depths.first <= maps.values("depth")[number] <= depths.last
        if advice.cell is not None and (advice.cell[0] == number or everywhere):
            places = zip((maps.y, maps.x), advice.cell[1:], strict=True)
            point = {axis: float(maps.values(axis)[place]) for axis, place in places if axis}
            within = advice.stay_within.get(maps.x)
            ends = (within.low, within.high) if within and not advice.is_withdrawn else None
            is_none = advice.kind == Answered.NOTHING
            share = advice.share.probability if is_none and advice.share is not None else None
            beside = advice.stay_within.get(maps.y) if maps.y else None
            across = (
                (beside.low, beside.high) if ends and beside and beside.low < beside.high and not everywhere else None
            )
            return Spot(point, ends, is_none or advice.kind == Answered.HINT, share, across)
        best = self.numbers["maps"][number]["recommended"]
        if best is None:
            return None
        sides = best["margins"][maps.x]
        ends = sides["less"]["safe_to"], sides["more"]["safe_to"]
        return Spot({axis: best[axis] for axis in (maps.x, maps.y) if axis}, ends, is_hint(self.numbers, best))

    def draw(self, axes: Axes, number: int) -> None:
        """Draw a map into a panel: its regions, the border of what is allowed, and the
        point. The words follow when the panel has its size (:meth:`write_words`)."""
        cells, codes, spot = self.plane.cells, self.codes[number], self.spot(number)
        if self.has_samples:
            self._draw_probability(axes, number)
        else:
            colours = [zone.colour for zone in self.zones]
            draw_codes(axes, cells, codes, colours, "window", "cells")
            started = codes == STARTED
            if self.revoked:
                started &= ~self.maps.grades.allowed[number]
            hatch(axes, cells, started, STARTED_HATCH, FIELD_BORDER, "started")
            hatch(axes, cells, codes == UNKNOWN, UNKNOWN_HATCH, BLACK, "unknown")
            hatch(axes, cells, self.lowered[number], LOWERED_HATCH, "white", "lowered", width=HATCH_WIDTH)
            hatch(axes, cells, self.jumped[number], JUMPED_HATCH, BLACK, "jumped")
        unsettled = self.maps.unsettled[number]
        if self.revoked:  # each cell has one hatch: two over each other are a grey texture that nobody reads
            allowed = self.maps.grades.allowed[number]
            cover(axes, cells, allowed, "revoked:veil", facecolors=(1.0, 1.0, 1.0, REVOKED_VEIL))
            hatch(axes, cells, allowed & ~unsettled, REVOKED_HATCH, REVOKED_EDGE, "revoked")
            hatch(axes, cells, allowed & unsettled, UNSETTLED_HATCH, REVOKED_EDGE, "revoked:unsettled")
            unsettled = unsettled & ~allowed
        hatch_unsettled(axes, cells, unsettled)
        draw_field(axes, cells, self.maps.grades.allowed[number])
        if self._has_rates:
            rates, centres = self.maps.yields[RATE_OF_PENETRATION][number], self.plane.centres
            clear = [self.plane.shown(spot.point)] if spot else []
            draw_equal_rates(axes, centres, rates, self.units, clear)
        if spot:
            self._draw_spot(axes, spot)
        for point in self._vibrated(number):
            axes.plot(*self.plane.shown(point), **VIBRATED, gid="vibrated")

    @property
    def revoked(self) -> str:
        """Why nobody may take what the map allows as leave: the heads of what the answer says; "" where one may."""
        if self.advice.kind in (Answered.NOTHING, Answered.UNKNOWN):
            return ""
        said = words_of(self.numbers, self.units)
        return "Withdrawn by trials" if said.is_withdrawn else said.caveat

    def _vibrated(self, number: int) -> list[dict[str, float]]:
        """The corners of what the map allows that vibrated in trials, as points of a map."""
        tried, cell, spot = self.advice.trials, self.advice.cell, self.spot(number)
        if tried is None or spot is None or cell is None or cell[0] != number:
            return []
        found = ({"rotary_speed": one.speed, "wob": one.wob} for one in tried.bad_corners)
        return [{axis: float(at.get(axis) or value) for axis, value in spot.point.items()} for at in found]

    @property
    def _has_rates(self) -> bool:
        return bool(self.rates and self.maps.y and RATE_OF_PENETRATION in self.maps.yields)

    def write_words(self, axes: Axes, number: int) -> None:
        """The setting at the point, and the words of the regions, of a panel that has its
        size."""
        spot = self.spot(number)
        if spot and not axes.viewLim.contains(*self.plane.shown(spot.point)):  # of a picture of a part
            for mark in axes.lines:
                mark.set_clip_on(True)
            spot = None
        clear = [text.get_window_extent() for text in axes.texts]
        clear += self._label(axes, spot) if spot else []
        pad = 6.0 * axes.figure.dpi / 72
        for point in self._vibrated(number):
            at = axes.transData.transform(self.plane.shown(point))
            clear.append(Bbox([at - pad, at + pad]))
        if not self.has_samples:
            codes = np.where(self.lowered[number] | self.jumped[number], -1, self.codes[number])
            is_hint = self.advice.trials is not None and self.advice.kind == Answered.HINT
            allowed = self.maps.grades.allowed[number]
            if is_hint or self.revoked:  # no word calls it free
                codes = np.where(allowed, REVOKED if self.revoked else -1, codes)
            named = {code: (zone.capitals, zone.colour) for code, zone in enumerate(self.zones) if code in codes}
            named |= {REVOKED: (self.revoked.upper(), "#FFFFFF")} if self.revoked and allowed.any() else {}
            name_regions(axes, self.plane.cells, codes, named, clear)

    def _draw_probability(self, axes: Axes, number: int) -> None:
        """Colour the cells by the probability of being allowed, in percent."""
        share = self.maps.safety[0][number]
        cells, style = self.plane.cells, cell_style(share.size)
        axes.pcolormesh(*cells, 100.0 * share, cmap=GOODNESS, norm=Normalize(0.0, 100.0), gid="cells", **style)
        hatch(axes, cells, np.isnan(share), UNKNOWN_HATCH, BLACK, "unknown", face=GREY)

    def _bar(self, spot: Spot) -> tuple[float, float]:
        """The ends of the bar of a point, in the units that are shown."""
        ends = spot.stay_within or (spot.point[self.maps.x],) * 2
        low, high = (self.plane.shown({**spot.point, self.maps.x: end})[0] for end in ends)
        return low, high

    def _frame(self, spot: Spot) -> list[tuple[float, float]]:
        """The corners of the rectangle of a point, the first once more at the end, in the
        units that are shown; none where there is no rectangle."""
        low, high = self._bar(spot)
        if not spot.across or low >= high:
            return []
        top, bottom = (self.plane.shown({**spot.point, str(self.maps.y): end})[1] for end in spot.across)
        return [(low, top), (high, top), (high, bottom), (low, bottom), (low, top)]

    def _draw_spot(self, axes: Axes, spot: Spot) -> None:
        """Draw the point with the bar *stay within*; hollow where it is a hint, a diamond
        where it is only the most probable one."""
        (x, y), (low, high), frame = self.plane.shown(spot.point), self._bar(spot), self._frame(spot)
        gid, marker = ("recommended", "o") if spot.probability is None else ("most_probable", "D")
        for colour, width, size in (("white", 3.2, 7.5), (BLACK, 1.6, 6.0)):
            name = gid if colour == BLACK else "halo"
            bar: Properties = {"color": colour, "linewidth": width, "marker": "|", "markeredgewidth": width}
            if spot.stay_within:
                axes.plot([low, high], [y, y], markersize=size + 2, zorder=4.8, gid=f"{name}:within", **bar)
            if frame:
                line: Properties = {"color": colour, "linewidth": width * 0.6, "linestyle": (0, (4, 2)), "zorder": 4.7}
                axes.plot(*zip(*frame, strict=True), gid=f"{name}:frame", **line)
            face = "white" if spot.is_hint or colour == "white" else BLACK
            own: Properties = {"color": colour, "marker": marker, "linestyle": "none", "zorder": 5, "clip_on": False}
            [mark] = axes.plot([x], [y], markersize=size, markerfacecolor=face, gid=name, **own)
            mark.set_in_layout(False)

    def _settable(self, spot: Spot) -> dict[str, float]:
        """The point as it can be set, within its limits."""
        fmt = Formatter(self.units, self.numbers["model"])
        ends = {self.maps.x: spot.stay_within, self.maps.y: spot.across}
        return {axis: fmt.settable(axis, value, *(ends.get(axis) or ())) for axis, value in spot.point.items()}

    def _label(self, axes: Axes, spot: Spot) -> list[Bbox]:
        """Write the setting in bold above the point, below it at the top of the map, moved to
        the side where the frame would cut it. Returns what is to be kept clear of words
        [pixels]."""
        text = operating_point(self._settable(spot), self.units)
        if spot.probability is not None and np.isfinite(spot.probability):
            text += f": {100 * spot.probability:.0f} %"
        panel, place, point = axes.get_window_extent(), self.plane.shown(spot.point), 72 / axes.figure.dpi
        is_high = axes.transData.transform(place)[1] > panel.y0 + 0.75 * panel.height
        aside = -8.0 if is_high else 8.0
        style: Properties = {"fontsize": font_size(8.5), "fontweight": "bold", "zorder": 5.2, "gid": "setting"}
        style |= {"ha": "center", "va": "top" if is_high else "bottom", "path_effects": halo(2.5)}
        words = axes.annotate(text, place, (0.0, aside), textcoords="offset points", parse_math=False, **style)
        if (wide := words.get_window_extent().width / (panel.width - 6.0 / point)) > 1.0:
            words.set_fontsize(font_size(8.5) / wide)
        box = words.get_window_extent()
        over = max(panel.x0 + 3.0 / point - box.x0, 0.0) - max(box.x1 - panel.x1 + 3.0 / point, 0.0)
        words.set_position((over * point, aside))
        pad = 6.0 / point
        low, high = self._bar(spot)
        lines = [((low, place[1]), (high, place[1])), *pairwise(self._frame(spot))]
        ends = [axes.transData.transform(line) for line in lines]
        clear = [Bbox([line.min(axis=0) - pad, line.max(axis=0) + pad]) for line in ends]
        return [*clear, Bbox.from_extents(*words.get_window_extent().extents)]

    def entries(self) -> Iterator[Artist]:
        """The legend entries of the classes that occur, and of the points drawn."""
        numbers, codes = self.numbers, self.codes
        if self.has_samples:
            label = f"allowed with {100 * numbers['confidence']:g} % or more"
            if self.maps.grades.allowed.any():
                yield line_entry(label, color=FIELD_BORDER, linewidth=1.8)
            if np.isnan(self.maps.safety[0]).any():
                yield area_entry("no sample is known", facecolor=GREY, hatch=UNKNOWN_HATCH, **BORDER)
        else:
            hatches = {STARTED: STARTED_HATCH, UNKNOWN: UNKNOWN_HATCH}
            for code in in_order(self.zones):
                if np.any(codes == code):
                    words = f" ({unknown_words(numbers)})" if code == UNKNOWN else ""
                    zone = self.zones[code]
                    yield area_entry(zone.name + words, facecolor=zone.colour, hatch=hatches.get(code), **BORDER)
            if np.any(self.lowered):
                style: Properties = {"facecolor": "#8A8A8A", "edgecolor": "white", "linewidth": 0}
                yield area_entry(f"hatched white: {ONLY_FROM_ABOVE}", hatch=LOWERED_HATCH, **style)
            if np.any(self.jumped):
                how = "not known when brought up: steps may jump across a vibration"
                yield area_entry(how, facecolor="white", hatch=JUMPED_HATCH, **BORDER)
        if self.revoked:
            yield from self._entries_of_revoked()
        if unsettled := int(np.count_nonzero(self.maps.unsettled)):
            yield unsettled_entry(unsettled, self.maps.unsettled.size)
        yield from self._entries_of_points()

    def _entries_of_revoked(self) -> Iterator[Artist]:
        """The entries of what nobody may take as leave, with the hatch of each."""
        allowed, unsettled = self.maps.grades.allowed, self.maps.unsettled
        words = f"{self.revoked.lower()}: {words_of(self.numbers, self.units).not_yet}"
        style: Properties = {"facecolor": "white", "edgecolor": REVOKED_EDGE, "linewidth": 0.4}
        if np.any(allowed & ~unsettled):
            yield area_entry(words, hatch=REVOKED_HATCH, **style)
        if np.any(allowed & unsettled):
            yield area_entry(f"{words}, itself not settled", hatch=UNSETTLED_HATCH, **style)

    def lines(self) -> list[Artist]:
        """The legend entry of lines of equal rate."""
        return [equal_rates_entry(self.units)] if self._has_rates else []

    def bars(self) -> list[Bar]:
        """The scale of the probabilities, where colours are these."""
        if not self.has_samples:
            return []
        style = {"aspect": 30, "pad": 0.01, "ticks": range(0, 101, 20)}
        return [Bar(GOODNESS, Normalize(0.0, 100.0), "Probability of being allowed [%]", style=style)]

    def _entries_of_points(self) -> Iterator[Artist]:
        shown = evenly_spaced(range(len(self.codes)), MAX_PANELS)
        spots = [spot for spot in map(self.spot, shown) if spot]
        style: Properties = {"color": BLACK, "markersize": 5, "marker": "o"}
        probable = any(spot.probability is not None for spot in spots)
        for of_hints, words, face in ((False, "run here", BLACK), (True, "a hint, not a setting", "white")):
            own = [spot for spot in spots if spot.is_hint == of_hints and spot.probability is None]
            if own:
                bar, frame = any(spot.stay_within for spot in own), any(spot.across for spot in own)
                label = f"{words}; the bar{' and the frame' if frame else ''}: stay within" if bar else words
                yield line_entry(label, linewidth=1.6 if bar else 0.0, markerfacecolor=face, **style)
        if any(map(self._vibrated, shown)):
            yield line_entry("vibrated in a trial: keep away", **VIBRATED)
        if probable:
            yield line_entry("most probably allowed", **{**style, "marker": "D", "linestyle": "none"})
        if (count := len(self.codes)) > MAX_PANELS:
            yield line_entry(linestyle="none", label=f"{MAX_PANELS} of {count} panels shown")


def window(
    results: Results,
    units: str = "si",
    severity: int | None = None,
    confidence: float | None = None,
    text: bool = False,
    rates: bool = False,
    tried: Advice | None = None,
) -> Page:
    drawn = Window(results, units, severity, confidence, rates, tried)
    numbers = evenly_spaced(range(len(drawn.codes)), MAX_PANELS)
    names = numbered(drawn.where(number) or "panel" for number in numbers)
    columns = panels_per_row(COLUMNS_OF_PANELS.get(len(numbers), 4), PANEL_WIDTH)
    height = height_of_maps(len(numbers), columns) if drawn.maps.y else 1.0 + 0.9 * -(-len(numbers) // columns)

    def paint(number: int, axes: Axes) -> None:
        drawn.plane.frame(axes, drawn.where(number))
        drawn.draw(axes, number)

    title = _title(results, units)
    told = _headlines(drawn.numbers, units)
    if text:
        title += f"\n{answer(drawn.numbers, units)}"
        told = [*before_trials(drawn.numbers), *first_notes(drawn.numbers, units)]
    return Page(
        {name: partial(paint, number) for name, number in zip(names, numbers, strict=True)},
        title,
        page_width(FULL_WIDTH if len(numbers) > 1 or not drawn.maps.y else 5.5),
        height,
        drawn.plane.arrange(len(numbers), columns),
        lambda panels: [*drawn.entries(), *drawn.lines()],
        3,
        told,
        drawn.bars(),
        {name: partial(drawn.write_words, number=number) for name, number in zip(names, numbers, strict=True)},
    )


def _title(results: Results, units: str) -> str:
    """The title and the depth in one line; below it what ``--set`` changed."""
    changed = describe_overrides(results.attrs, 80)
    lines = [line for line in sweep_title(results, units, width=80).split("\n") if line != changed]
    return "\n".join(filter(None, (", ".join(lines), changed)))


def _headlines(numbers: Answer, units: str) -> list[str]:
    """The headlines of all warnings, in one line."""
    untried = [text.partition(":")[0] for text in before_trials(numbers)]
    return list(filter(None, ["; ".join([*untried, *headlines(numbers, units)])]))


CHARACTERS = 15  # in an inch of the title of a panel


def draw_two(
    a: Results,
    b: Results,
    names: Sequence[str],
    units: str = "si",
    severity: int | None = None,
    confidence: float | None = None,
    look: Look | None = None,
    text: bool = False,
    rates: bool = False,
) -> Figure:
    """The windows of two results over the same axes, under the ``names`` of the two; of
    a third axis the map that the answer is about. In that of the second a line shows
    what is allowed in the first. With ``text`` each has its answer, with ``rates`` the
    lines of equal rate of penetration."""
    with using_look(look or Look()), house_style(), without_glyph_warnings():
        page = _two([Window(one, units, severity, confidence, rates) for one in (a, b)], names, units, text)
        figure, panels = draw_page(page)
        put_legend(figure, page, panels)
        freeze_layout(figure)
    return figure


def _two(windows: Sequence[Window], names: Sequence[str], units: str, text: bool) -> Page:
    columns = 2 if windows[0].maps.y else 1
    characters = max(int(CHARACTERS * page_width() / columns), SHORTEST_LINE)
    plane, places = windows[0].plane, [_answered(window) for window in windows]
    limits = [_ends(*edges) for edges in zip(*(window.plane.cells for window in windows), strict=True)]
    allowed_in_a = windows[0].maps.grades.allowed[places[0]]

    def paint(number: int, axes: Axes) -> None:
        window, place, letter = windows[number], places[number], "ab"[number]
        plane.frame(axes, "")
        plane.limit(axes, *limits)
        window.draw(axes, place)
        where = f", {window.where(place)}" if window.maps.third else ""
        words = [f"{letter}: {names[number]}{where}"]
        words += [answer(window.numbers, units)] if text and has_title() else []
        wrapped = "\n".join(textwrap.fill(line, characters) for line in words)
        axes.set_title(wrapped, loc="left", fontsize=font_size(7), parse_math=False)
        if number == 1:
            draw_outline(axes, plane.cells, allowed_in_a)

    entries = [entry for window in windows for entry in window.entries()]
    entries += [outline_entry("allowed in a")] if allowed_in_a.any() else []
    entries += windows[0].lines() or windows[1].lines()
    titles = {str(window.maps.results.attrs.get("title") or "") for window in windows}
    told = [(first_notes(one.numbers, units) if text else headlines(one.numbers, units)) for one in windows]
    both = of_both(*map(list, told))
    return Page(
        {letter: partial(paint, number) for number, letter in enumerate("ab")},
        titles.pop() if len(titles) == 1 else "a and b",
        page_width(),
        4.4 if columns == 2 else 3.6,
        plane.arrange(2, columns),
        lambda panels: entries,
        3,
        both if text else _joined(both),
        windows[0].bars(),
        {
            letter: partial(window.write_words, number=place)
            for letter, window, place in zip("ab", windows, places, strict=True)
        },
    )


def _joined(texts: Sequence[str]) -> list[str]:
    """Texts after the letters of their files, those of one file in one line."""
    found: dict[str, list[str]] = {}
    for one in texts:
        letter, _, words = one.partition(": ")
        found.setdefault(letter, []).append(words)
    return [f"{letter}: {'; '.join(words)}" for letter, words in found.items()]


def _answered(window: Window) -> int:
    """The number of the map that the answer is about, else of that with the most allowed
    points."""
    cell = window.advice.cell
    return cell[0] if cell is not None else int(np.argmax(window.maps.grades.allowed.sum(axis=(1, 2))))


def _ends(*edges: Array) -> Array:
    """The least and the greatest of all edges."""
    return np.array([min(one.min() for one in edges), max(one.max() for one in edges)])


KINDS = (
    Kind(
        "window",
        "where one may run and how one comes there, and the point to run at",
        of=PLANE,
        place=lambda data: 50 if isinstance(data, Results) and judges(data) and axes_of(data) is not None else None,
        page=window,
        uses=lambda model: USES,
        takes=("severity", "confidence", "text", "rates", "tried"),
        across=lambda data: lies_across(data) if len(data.swept) > 1 else longest(data),
    ),
)
