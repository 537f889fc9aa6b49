"""Pictures of samples of uncertain numbers: the probability of a safe run and of each
response, which unknown moves what how far, and what safety costs.

All maps of probability have one colour scale, from bad to good: that of a safe run, and
of a run without each response. Its lightness rises all the way, so that it is read in
grey and by colour-blind readers. A line surrounds the operating window at the
confidence."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from itertools import pairwise
from textwrap import fill
from typing import TypeGuard

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import Normalize

from nsdrill.analysis.counts import open_words
from nsdrill.analysis.graded import Graded, graded
from nsdrill.analysis.histories import Grade
from nsdrill.analysis.maps import USES
from nsdrill.analysis.planes import UNJUDGED, judges
from nsdrill.analysis.probability import (
    EVERY,
    SAFE,
    Probabilities,
    effective_number,
    independent,
    probabilities_of,
    safe_in_words,
    samples_text,
    window_state,
)
from nsdrill.analysis.sensitivity import PART, sensitivity
from nsdrill.analysis.sensitivity import SAFE as SAFE_RUN
from nsdrill.analysis.window import USUAL_CONFIDENCE
from nsdrill.data import Answer, Array, Attributes, Results
from nsdrill.figures.cells import draw_outline, hatch, outline_entry
from nsdrill.figures.look import BESIDE
from nsdrill.figures.map_panels import COLUMNS_OF_PANELS, Planes, lies_across
from nsdrill.figures.page import area_entry, labelled, line_entry, tiles, write
from nsdrill.figures.painters import Bar, Page, Paint
from nsdrill.figures.picture_kinds import SAMPLES, Kind, has_samples, longest, needs_samples
from nsdrill.figures.slices import edges, lay_along, positions
from nsdrill.figures.style import (
    ANY_HISTORY_COLOUR,
    BLACK,
    BLUE,
    GOODNESS,
    GREY,
    ORANGE,
    REFERENCE,
    Dashes,
    Properties,
    cell_style,
    font_size,
    page_width,
    styles_of,
)
from nsdrill.models.registry import responses_in
from nsdrill.quantity import quantity as base_quantity
from nsdrill.variables import SAMPLE
from nsdrill.words.labels import heading, operating_point, quantity, sweep_title, way_word
from nsdrill.words.variance import without_indices

OPEN_HATCH, UNKNOWN_HATCH = "////", "xxxxxx"
PERCENT = Normalize(0.0, 100.0)
ANY_HISTORY = "safe after any history"
BAND_STYLE: Properties = {"alpha": 0.16, "linewidth": 0}
EDGE_DASHES: tuple[Dashes, ...] = ("-", (0, (4, 2)), (0, (1, 1.5)), (0, (6, 2, 1, 2)))
CONFIDENCE_STYLE: Properties = {"color": REFERENCE, "linewidth": 0.6, "linestyle": (0, (4, 2))}


def _samples_in(results: Results) -> str:
    """How many samples there are, and what they are worth where some are the same."""
    counted = independent(results)
    return _samples_words(
        len(results.coords[SAMPLE]), len(results.coords[SAMPLE][counted]), effective_number(results, counted)
    )


def _samples_words(samples: int, counted: int, effective: float) -> str:
    return samples_text(counted, effective) if effective < counted - 0.5 else f"{samples} samples"


def probability(results: Results, units: str = "si", confidence: float = USUAL_CONFIDENCE) -> Page:
    probabilities = probabilities_of(results)
    history = "responses whatever the history" if EVERY in probabilities.histories else ""
    title = sweep_title(results, units, _samples_in(results), history, width=80)
    if len(results.swept) == 2:
        return _maps(results, probabilities, units, confidence, title)
    if results.swept:
        return _lines(results, probabilities, units, confidence, title)
    return _points(results, probabilities, title)


def _style(outcome: str, attrs: Attributes) -> tuple[str, str, str]:
    """Label, colour and marker of an outcome of a file with these root attributes."""
    if outcome == SAFE:
        return "safe", BLACK, "o"
    style = styles_of(attrs)[responses_in(attrs)[outcome].bit]
    return style.name, style.colour, style.marker


def _maps(results: Results, probabilities: Probabilities, units: str, confidence: float, title: str) -> Page:
    planes, outcomes = Planes.of(results, units), probabilities.outcomes
    after_any = _after_any_history(results, confidence)
    inside = planes.arranged(window_state(probabilities, confidence)[0][np.newaxis])[0, 0]
    is_open = probabilities.open[-1] > 0  # outcome, axes

    def paint(outcome: str, axes: Axes) -> None:
        share = probabilities.of(outcome)[0]
        good = planes.arranged((share if outcome == SAFE else 1.0 - share)[np.newaxis])[0, 0]
        planes.frame(axes, headings[outcome], 3)
        axes.pcolormesh(
            *planes.cells,
            100.0 * good,
            cmap=GOODNESS,
            norm=PERCENT,
            gid=f"probability:{outcome}",
            **cell_style(good.size),
        )
        place = probabilities.place(outcome)[1]
        unknown = planes.arranged(np.isnan(share)[np.newaxis])[0, 0]
        partly = planes.arranged(is_open[place][np.newaxis])[0, 0] & ~unknown
        # black over white, which is visible on every colour
        hatch(axes, planes.cells, partly, OPEN_HATCH, "white", f"open:{outcome}:ground", width=2.2)
        hatch(axes, planes.cells, partly, OPEN_HATCH, BLACK, f"open:{outcome}", width=0.8)
        hatch(axes, planes.cells, unknown, UNKNOWN_HATCH, BLACK, f"unknown:{outcome}", face=GREY)
        draw_outline(axes, planes.cells, inside)

    critical = responses_in(results.attrs)
    headings = {one: _label(results, one) if one == SAFE else critical[one].absence for one in outcomes}
    painters: list[tuple[str, Paint]] = [(headings[outcome], partial(paint, outcome)) for outcome in outcomes]
    if after_any is not None:
        painters.insert(1, (ANY_HISTORY, partial(_draw_after_any_history, planes, after_any, inside)))
    columns = COLUMNS_OF_PANELS.get(len(painters), 4)
    safe_share = 100.0 * np.count_nonzero(inside) / inside.size
    label = f"safe with {100 * confidence:g} % or more ({safe_share:.1f} % of the points)"
    entries = [*([outline_entry(label)] if inside.any() else []), *_open_entries(probabilities)]
    style = {"aspect": 30, "pad": 0.01, "ticks": range(0, 101, 20)}
    return Page(
        dict(painters),
        title,
        page_width(),
        1.3 + -(-len(painters) // columns) * 2.4,
        planes.arrange(len(painters), columns),
        lambda panels: entries,
        1,
        bars=[Bar(GOODNESS, PERCENT, "Probability [%]", style=style)],
    )


def _label(results: Results, outcome: str) -> str:
    """The name of an outcome in the legend."""
    return safe_in_words(results.procedures) if outcome == SAFE else _style(outcome, results.attrs)[0]


def _after_any_history(results: Results, confidence: float) -> Graded | None:
    """The grades of results that were brought up and lowered, None of others."""
    return graded(results, confidence=confidence) if {"up", "down"} <= set(results.procedures) else None


def _on_plane(grades: Graded, planes: Planes, array: Array) -> Array:
    """An ``array`` [third, y, x] of grades as [y, x] of the planes."""
    return array[0] if planes.x == grades.x else array[0].T


def _draw_after_any_history(planes: Planes, grades: Graded, inside: Array, axes: Axes) -> None:
    """The probability of being safe after any history, as a map."""
    planes.frame(axes, ANY_HISTORY, 3)
    share = _on_plane(grades, planes, grades.probability(any_history=True)[0])
    style = cell_style(share.size)
    axes.pcolormesh(*planes.cells, 100.0 * share, cmap=GOODNESS, norm=PERCENT, gid="probability:any history", **style)
    is_open = _on_plane(grades, planes, (grades.grades == Grade.UNKNOWN).any(axis=-1)) & np.isfinite(share)
    hatch(axes, planes.cells, is_open, OPEN_HATCH, "white", "open:any history:ground", width=2.2)
    hatch(axes, planes.cells, is_open, OPEN_HATCH, BLACK, "open:any history", width=0.8)
    hatch(axes, planes.cells, np.isnan(share), UNKNOWN_HATCH, BLACK, "unknown:any history", face=GREY)
    draw_outline(axes, planes.cells, inside)


def _open_entries(probabilities: Probabilities) -> Iterator[Artist]:
    """The legend entries of the operating points of which not all, or no, samples are
    known, with the numbers of points and of samples."""
    unknown, is_open = np.isnan(probabilities.share[-1]), probabilities.open[-1] > 0
    points, words = probabilities.open[-1, 0].size, open_words(probabilities.in_all, "samples")
    style: Properties = {"facecolor": "white", "edgecolor": BLACK, "linewidth": 0.4}
    for label, chosen, own in (
        ("some samples are not known", is_open & ~unknown, {"hatch": OPEN_HATCH}),
        ("no sample is known", unknown, {"hatch": UNKNOWN_HATCH, "facecolor": GREY}),
    ):
        if number := int(np.count_nonzero(chosen.any(axis=0))):
            yield area_entry(label=f"{label}: {number} of {points} points ({words})", **{**style, **own})


def _lines(results: Results, probabilities: Probabilities, units: str, confidence: float, title: str) -> Page:
    band = line_entry(color=REFERENCE, linewidth=5, alpha=BAND_STYLE["alpha"], label="95 % interval")
    reference = line_entry(label=f"{100 * confidence:g} %", **CONFIDENCE_STYLE)
    entries = [band, reference]
    if words := open_words(probabilities.in_all, "samples"):
        style: Properties = {"facecolor": "white", "edgecolor": REFERENCE, "hatch": UNKNOWN_HATCH, "linewidth": 0.4}
        entries.append(area_entry(f"no sample known; in all {words}", **style))
    return Page(
        {"panel": partial(_draw_lines, results, probabilities, units, confidence)},
        title,
        page_width(),
        3.2,
        entries=lambda panels: [*labelled(panels), *entries],
        columns=6,
    )


def _draw_lines(results: Results, probabilities: Probabilities, units: str, confidence: float, axes: Axes) -> None:
    """Draw each outcome along the axis with its band, and label its line."""
    axis = results.swept[0]
    x = positions(results, axis) / quantity(axis, units).scale
    if (grades := _after_any_history(results, confidence)) is not None:
        share, low, high = (100.0 * part.ravel() for part in grades.probability(any_history=True))
        axes.fill_between(x, low, high, facecolor=ANY_HISTORY_COLOUR, gid="band:any history", **BAND_STYLE)
        wide: Properties = {"linewidth": 2.4, "marker": "o", "markersize": 5.0, "label": ANY_HISTORY}
        axes.plot(x, share, color=ANY_HISTORY_COLOUR, gid="line:any history", **wide)
    for place, outcome in enumerate(probabilities.outcomes):
        label, (_, colour, marker) = _label(results, outcome), _style(outcome, results.attrs)
        share, low, high = (100.0 * part.ravel() for part in probabilities.of(outcome))
        axes.fill_between(x, low, high, facecolor=colour, gid=f"band:{outcome}", **BAND_STYLE)
        edge_style: Properties = {"linewidth": 0.7, "linestyle": EDGE_DASHES[place % len(EDGE_DASHES)]}
        for edge in (low, high):  # overlapping bands are distinguished by their edges
            axes.plot(x, edge, color=colour, gid=f"edge:{outcome}", **edge_style)
        # of coinciding lines the lower one is wider
        above = len(probabilities.outcomes) - 1 - place
        sizes: Properties = {"markersize": 2.6 + 0.8 * above, "linewidth": 0.9 + 0.4 * above}
        axes.plot(x, share, color=colour, marker=marker, label=label, gid=f"line:{outcome}", **sizes)
    for history, dashes in zip(probabilities.histories[:-1], ("--", ":"), strict=False):
        share = 100.0 * probabilities.of(SAFE, history)[0].ravel()
        own: Properties = {"label": f"safe, {way_word(history, results.attrs)} by itself", "gid": f"alone:{history}"}
        axes.plot(x, share, color=BLACK, linestyle=dashes, linewidth=0.9, **own)
    axes.axhline(100.0 * confidence, zorder=0, gid="confidence", **CONFIDENCE_STYLE)
    axes.set(ylim=(-2.0, 102.0), ylabel="Probability [%]")
    lay_along(axes, results, axis, units, margins=True)
    for left, right in pairwise(edges(x)):
        here = (x > left) & (x < right)
        if np.isnan(probabilities.share[-1].reshape(len(probabilities.outcomes), -1)[:, here]).any():
            ground: Properties = {"facecolor": "none", "edgecolor": REFERENCE, "linewidth": 0, "zorder": 0}
            axes.axvspan(left, right, hatch=UNKNOWN_HATCH, gid="unknown", **ground)


def _points(results: Results, probabilities: Probabilities, title: str) -> Page:
    painters = {"panel": partial(_draw_points, results, probabilities)}
    return Page(painters, title, page_width(5.0), 0.9 + 0.3 * len(probabilities.outcomes))


def _draw_points(results: Results, probabilities: Probabilities, axes: Axes) -> None:
    """Draw each outcome of one operating point with its interval."""
    count = len(probabilities.outcomes)
    labels = []
    for row, outcome in enumerate(probabilities.outcomes):
        _, colour, marker = _style(outcome, results.attrs)
        labels.append(_label(results, outcome))
        share, low, high = (100.0 * float(part.ravel()[0]) for part in probabilities.of(outcome))
        place = probabilities.place(outcome)
        lacking = int(probabilities.open[place].sum())
        text = f"{share:.1f} %" if np.isfinite(share) else "not known"
        text += f"; {lacking} of {probabilities.total} not known" if lacking and np.isfinite(share) else ""
        share = share if np.isfinite(share) else 0.5 * (low + high)
        style: Properties = {"color": colour, "marker": marker, "markersize": 5, "linestyle": "none"}
        point, *_ = axes.errorbar([share], [row], xerr=[[share - low], [high - share]], capsize=3, **style)
        point.set_gid(f"point:{outcome}")
        if lacking == probabilities.total:
            style = style | {"marker": "none"}
        write(axes, text, (high, row), (5, 0), 7, va="center")
    axes.set_yticks(range(count), labels)
    room = 115.0 if not probabilities.open.any() else 160.0  # right of the interval, for the text
    axes.set(
        ylim=(count - 0.5, -0.5),
        xlim=(-2.0, room),
        xticks=range(0, 101, 20),
        xlabel="Probability [%], with its 95 % interval",
    )


LOW_COLOUR, HIGH_COLOUR = BLUE, ORANGE
BAR_HEIGHT = 0.62
WHISKER: Properties = {"color": BLACK, "linewidth": 0.8, "marker": "|", "markersize": 4}


def tornado(results: Results, units: str = "si", severity: int | None = None) -> Page:
    """A bar extends from the mean of the answer where an unknown is low to the mean
    where it is high; the widest is at the top."""
    numbers = sensitivity(results, severity)
    answers = numbers["answers"]
    columns = min(2, len(answers))
    rows = -(-len(answers) // columns)
    lacking = open_words(numbers, "samples")
    entries = [
        area_entry(facecolor=LOW_COLOUR, label=f"the lowest {100 * PART:g} % of the samples of the unknown"),
        area_entry(facecolor=HIGH_COLOUR, label=f"the highest {100 * PART:g} %"),
        line_entry(
            color=REFERENCE, linewidth=0.8, label=f"mean of all {'samples' if not lacking else 'known samples'}"
        ),
    ]
    if lacking and answers[0]["deviation"] is not None:
        entries.append(line_entry(label="what a share may be with those not known", **WHISKER))
    over = f"mean over {numbers['points']} operating points" if numbers["swept"] else ""
    parts = (
        operating_point(numbers["at"], units),
        over,
        _samples_words(numbers["samples"], numbers["counted"], numbers["effective"]),
        lacking,
    )
    return Page(
        {answer["name"]: partial(_draw_answer, answer, units) for answer in answers},
        heading(results.attrs, "; ".join(filter(None, parts)), width=80),
        page_width(),
        0.9 + rows * (0.75 + 0.24 * len(answers[0]["unknowns"])),
        lambda figure: tiles(figure, len(answers), columns),
        lambda panels: entries,
        3,
    )


def _draw_answer(answer: Answer, units: str, axes: Axes) -> None:
    """Draw the bars of one answer, or write why it has none."""
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    shown = quantity(answer["name"], units) if answer["name"] != SAFE_RUN else None
    axes.set_xlabel(f"{shown.label}, mean" if shown else "Probability of a safe run [%]")
    if answer["deviation"] is not None:
        _draw_bars(axes, answer, shown.scale if shown else 0.01)
        return
    words = "not known"
    if answer["mean"] is not None:
        amount = f"{answer['mean'] / (shown.scale if shown else 0.01):.4g} {shown.unit if shown else '%'}"
        words = fill(f"{amount} {without_indices(answer)}", 34)
    if answer["missing"]:
        words += f";\n{answer['missing']} of {answer['missing'] + answer['present']} are not known"
    axes.text(0.5, 0.5, words, ha="center", va="center", transform=axes.transAxes, fontsize=font_size(7))
    axes.set(xticks=[], yticks=[])


def _draw_bars(axes: Axes, answer: Answer, scale: float) -> None:
    """Draw the bars of one answer, and beside each its first-order index, and its total
    index where the samples yield it."""
    rows = [row for row in answer["unknowns"] if None not in (row["low"]["answer"], row["high"]["answer"])]
    rows.sort(key=lambda row: -abs(row["high"]["answer"] - row["low"]["answer"]))
    middle = answer["mean"] / scale
    for number, row in enumerate(rows):
        ends = (("low", LOW_COLOUR), ("high", HIGH_COLOUR))
        bars = [(row[end]["answer"] / scale - middle, end, colour) for end, colour in ends]
        # Where both bars extend to the same side, the shorter one lies in front and
        # is thinner, so that both are visible even if they are equal.
        bars.sort(key=lambda bar: -abs(bar[0]))
        heights = (BAR_HEIGHT, 0.5 * BAR_HEIGHT if bars[0][0] * bars[1][0] > 0.0 else BAR_HEIGHT)
        for (extent, end, colour), height in zip(bars, heights, strict=True):
            axes.barh(number, extent, height, middle, color=colour, gid=f"{end}:{row['key']}")
            least, most = (row[end].get(name) for name in ("least", "most"))
            if answer["missing"] and least is not None:
                place = number + (0.5 - BAR_HEIGHT if end == "low" else BAR_HEIGHT - 0.5)
                axes.plot([least / scale, most / scale], [place] * 2, gid=f"open:{end}:{row['key']}", **WHISKER)
        indices = [index for index in ("first", "total") if row[index] is not None]
        texts = [f"{100 * row[index]:.0f} \u00b1 {100 * row[f'{index}_error']:.0f} %" for index in indices]
        text = "\n".join(texts) if row["varies"] else "not varied"
        write(axes, text, (1.0, number), (4, 0), 7, xycoords=BESIDE, va="center", annotation_clip=False)
    axes.axvline(middle, color=REFERENCE, linewidth=0.8, gid="mean")
    axes.set_yticks(range(len(rows)), [base_quantity(row["key"]).label for row in rows])
    axes.set_ylim(len(rows) - 0.4, -0.6)
    axes.margins(x=0.08)
    words = "first-order\nindex" + (", total" if any(row["total"] is not None for row in rows) else "")
    above: Properties = {"xycoords": "axes fraction", "va": "bottom", "ha": "left", "annotation_clip": False}
    write(axes, words, (1.0, 1.0), (4, 2), color=BLACK, **above)


def _has_judged_samples(data: object) -> TypeGuard[Results]:
    """Whether there are samples, of which something tells the safe ones from others."""
    return has_samples(data) and judges(data)


def needs_judged_samples(data: object) -> str:
    """Why pictures of what is safe do not fit the data."""
    return needs_samples(data) or (UNJUDGED if isinstance(data, Results) and not judges(data) else "")


KINDS = (
    Kind(
        "probability",
        "how probable a safe run and each response are: maps over two axes, with bands along one",
        of=SAMPLES,
        place=lambda data: 10 if _has_judged_samples(data) and len(data.swept) < 3 else None,
        page=probability,
        uses=lambda model: USES,
        takes=("confidence",),
        across=lambda data: lies_across(data) if len(data.swept) > 1 else longest(data),
        advice=needs_judged_samples,
    ),
    Kind(
        "tornado",
        "which uncertain number moves the safe run, stick-slip, lift-off, contact and the time stuck how far",
        general="which uncertain number moves what counts how far",
        of=SAMPLES,
        place=lambda data: 55 if _has_judged_samples(data) else None,
        page=tornado,
        uses=lambda model: model.check_features,
        takes=("severity",),
        advice=needs_judged_samples,
    ),
)
