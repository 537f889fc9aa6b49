"""The sensitivity to the unknowns: a tornado diagram for the safe run and for each
feature.

A bar extends from the mean of the answer where an unknown is low to the mean where it
is high; the widest is at the top.
"""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from nsdrill.analysis.sensitivity import PART, SAFE, sensitivity
from nsdrill.data import Results
from nsdrill.plot.labels import heading, operating_point, quantity
from nsdrill.plot.legend import legend_below
from nsdrill.plot.registry import SAMPLES, Kind, has_samples, needs_samples
from nsdrill.plot.style import BLACK, BLUE, ORANGE, REFERENCE, font_size, new_figure, page_width, put_title
from nsdrill.quantity import quantity as base_quantity

LOW_COLOUR, HIGH_COLOUR = BLUE, ORANGE
BAR_HEIGHT = 0.62


def draw(results: Results, units: str = "si", severity: int | None = None) -> Figure:
    numbers = sensitivity(results, severity)
    answers = [answer for answer in numbers["answers"] if answer["mean"] is not None]
    panel_columns = min(2, len(answers))
    panel_rows = -(-len(answers) // panel_columns)
    unknowns = len(numbers["answers"][0]["unknowns"])
    figure = new_figure(page_width(), 0.9 + panel_rows * (0.75 + 0.24 * unknowns))
    grid = figure.add_gridspec(panel_rows, panel_columns)
    for place, answer in enumerate(answers):
        _draw_panel(figure.add_subplot(grid[divmod(place, panel_columns)]), answer, units)
    handles = [
        Patch(facecolor=LOW_COLOUR, label=f"the lowest {100 * PART:g} % of the samples of the unknown"),
        Patch(facecolor=HIGH_COLOUR, label=f"the highest {100 * PART:g} %"),
        Line2D([], [], color=REFERENCE, linewidth=0.8, label="mean of all samples"),
    ]
    legend_below(figure, handles, 3)
    over = f"mean over {numbers['points']} operating points" if numbers["swept"] else ""
    description = "; ".join(
        filter(None, (operating_point(numbers["at"], units), over, f"{numbers['samples']} samples"))
    )
    put_title(figure, heading(results.attrs, description, width=80))
    return figure


def _draw_panel(axes: Axes, answer: dict[str, Any], units: str) -> None:
    """Draw the bars of one answer, and beside each its first-order index, and its total
    index where the samples yield it."""
    scale, label = _scale_and_label(answer["name"], units)
    if answer["deviation"] is None:
        unit = label.partition("[")[2].partition("]")[0]
        text = f"{answer['mean'] / scale:.4g} {unit} in every sample,\nwhatever the unknowns are"
        axes.text(0.5, 0.5, text, ha="center", va="center", transform=axes.transAxes, fontsize=font_size(7))
        axes.set_xticks([])
        axes.set_yticks([])
        axes.set_xlabel(label)
        for side in ("top", "right"):
            axes.spines[side].set_visible(False)
        return
    rows = [row for row in answer["unknowns"] if None not in (row["low"]["answer"], row["high"]["answer"])]
    rows.sort(key=lambda row: -abs(row["high"]["answer"] - row["low"]["answer"]))
    middle = answer["mean"] / scale
    for number, row in enumerate(rows):
        ends = sorted(
            (("low", LOW_COLOUR), ("high", HIGH_COLOUR)), key=lambda end: -abs(row[end[0]]["answer"] / scale - middle)
        )
        extents = [row[end]["answer"] / scale - middle for end, _ in ends]
        heights = (BAR_HEIGHT, 0.5 * BAR_HEIGHT if extents[0] * extents[1] > 0.0 else BAR_HEIGHT)
        for (end, colour), extent, height in zip(ends, extents, heights, strict=True):
            # Where both bars extend to the same side, the shorter one lies in front and
            # is thinner, so that both are visible even if they are equal.
            axes.barh(number, extent, height, middle, color=colour, gid=f"{end}:{row['key']}")
        if row["first"] is not None:
            indices = [index for index in ("first", "total") if row[index] is not None]
            texts = [f"{100 * row[index]:.0f} \u00b1 {100 * row[f'{index}_error']:.0f} %" for index in indices]
            axes.annotate(
                "\n".join(texts),
                (1.0, number),
                (4, 0),
                xycoords=("axes fraction", "data"),
                textcoords="offset points",
                va="center",
                fontsize=font_size(7),
                annotation_clip=False,
            )
    axes.axvline(middle, color=REFERENCE, linewidth=0.8, gid="mean")
    axes.set_yticks(range(len(rows)), [base_quantity(row["key"]).label for row in rows])
    axes.set_ylim(len(rows) - 0.4, -0.6)
    axes.margins(x=0.08)
    axes.set_xlabel(label)
    heading_of_indices = (
        "first-order\nindex, total" if any(row["total"] is not None for row in rows) else "first-order\nindex"
    )
    axes.annotate(
        heading_of_indices,
        (1.0, 1.0),
        (4, 2),
        xycoords="axes fraction",
        textcoords="offset points",
        fontsize=font_size(6),
        color=BLACK,
        va="bottom",
        ha="left",
        annotation_clip=False,
    )
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def _scale_and_label(name: str, units: str) -> tuple[float, str]:
    if name == SAFE:
        return 0.01, "Probability of a safe run [%]"
    shown = quantity(name, units)
    return shown.scale, f"{shown.label}, mean"


KINDS = (
    Kind(
        "tornado",
        "which uncertain number moves the safe run, stick-slip, lift-off and contact how far",
        of=SAMPLES,
        place=lambda data: 55 if has_samples(data) else None,
        draw=draw,
        uses=lambda model: model.check_features,
        takes=("severity",),
        advice=needs_samples,
    ),
)
