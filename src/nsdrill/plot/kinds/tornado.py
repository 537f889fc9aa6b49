"""Which unknown matters: a tornado for the safe run and for each feature.

A bar reaches from the mean of the answer where an unknown is low to the mean where it
is high; the widest stands on top.
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
from nsdrill.plot.style import (
    BLACK,
    BLUE,
    ORANGE,
    REFERENCE,
    new_figure,
    page_width,
    put_title,
    type_size,
)
from nsdrill.quantity import quantity as described

LOW, HIGH = BLUE, ORANGE
BAR = 0.62


def draw(results: Results, units: str = "si", severity: int | None = None) -> Figure:
    note = sensitivity(results, severity)
    answers = [answer for answer in note["answers"] if answer["mean"] is not None]
    wide = min(2, len(answers))
    deep = -(-len(answers) // wide)
    count = len(note["answers"][0]["unknowns"])
    figure = new_figure(page_width(), 0.9 + deep * (0.75 + 0.24 * count))
    grid = figure.add_gridspec(deep, wide)
    for place, answer in enumerate(answers):
        _panel(figure.add_subplot(grid[divmod(place, wide)]), answer, units)
    handles = [
        Patch(facecolor=LOW, label=f"the lowest {100 * PART:g} % of the samples of the unknown"),
        Patch(facecolor=HIGH, label=f"the highest {100 * PART:g} %"),
        Line2D([], [], color=REFERENCE, linewidth=0.8, label="mean of all samples"),
    ]
    legend_below(figure, handles, 3)
    over = f"mean over {note['points']} operating points" if note["swept"] else ""
    told = "; ".join(
        filter(None, (operating_point(note["at"], units), over, f"{note['samples']} samples"))
    )
    put_title(figure, heading(results.attrs, told, width=80))
    return figure


def _panel(axes: Axes, answer: dict[str, Any], units: str) -> None:
    """The bars of one answer, and beside each the first-order index, and the total one
    where the samples tell it."""
    scale, label = _shown(answer["name"], units)
    if answer["deviation"] is None:
        unit = label.partition("[")[2].partition("]")[0]
        words = f"{answer['mean'] / scale:.4g} {unit} in every sample,\nwhatever the unknowns are"
        axes.text(
            0.5,
            0.5,
            words,
            ha="center",
            va="center",
            transform=axes.transAxes,
            fontsize=type_size(7),
        )
        axes.set_xticks([])
        axes.set_yticks([])
        axes.set_xlabel(label)
        for side in ("top", "right"):
            axes.spines[side].set_visible(False)
        return
    rows = [
        row
        for row in answer["unknowns"]
        if None not in (row["low"]["answer"], row["high"]["answer"])
    ]
    rows.sort(key=lambda row: -abs(row["high"]["answer"] - row["low"]["answer"]))
    middle = answer["mean"] / scale
    for number, row in enumerate(rows):
        ends = sorted(
            (("low", LOW), ("high", HIGH)),
            key=lambda end: -abs(row[end[0]]["answer"] / scale - middle),
        )
        reach = [row[end]["answer"] / scale - middle for end, _ in ends]
        thick = (BAR, 0.5 * BAR if reach[0] * reach[1] > 0.0 else BAR)
        for (end, colour), far, tall in zip(ends, reach, thick, strict=True):
            # Where both reach to one side the shorter one stands in front, and is
            # thinner: equal ends show both.
            axes.barh(number, far, tall, middle, color=colour, gid=f"{end}:{row['key']}")
        if row["first"] is not None:
            known = [which for which in ("first", "total") if row[which] is not None]
            told = [
                f"{100 * row[which]:.0f} \u00b1 {100 * row[f'{which}_error']:.0f} %"
                for which in known
            ]
            axes.annotate(
                "\n".join(told),
                (1.0, number),
                (4, 0),
                xycoords=("axes fraction", "data"),
                textcoords="offset points",
                va="center",
                fontsize=type_size(7),
                annotation_clip=False,
            )
    axes.axvline(middle, color=REFERENCE, linewidth=0.8, gid="mean")
    axes.set_yticks(range(len(rows)), [described(row["key"]).label for row in rows])
    axes.set_ylim(len(rows) - 0.4, -0.6)
    axes.margins(x=0.08)
    axes.set_xlabel(label)
    head = (
        "first-order\nindex, total"
        if any(row["total"] is not None for row in rows)
        else "first-order\nindex"
    )
    axes.annotate(
        head,
        (1.0, 1.0),
        (4, 2),
        xycoords="axes fraction",
        textcoords="offset points",
        fontsize=type_size(6),
        color=BLACK,
        va="bottom",
        ha="left",
        annotation_clip=False,
    )
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def _shown(name: str, units: str) -> tuple[float, str]:
    if name == SAFE:
        return 0.01, "Probability of a safe run [%]"
    one = quantity(name, units)
    return one.scale, f"{one.label}, mean"


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
