"""The summary: the features that a model counts as its most telling, along one axis."""

from __future__ import annotations

from matplotlib.figure import Figure

from nsdrill.data import Results
from nsdrill.models.registry import drawn_in
from nsdrill.plot.curves import draw_curves
from nsdrill.plot.registry import LINE, Kind, fits_columns, longest, needs_one_axis


def draw(results: Results, units: str = "si") -> Figure:
    return draw_curves(results, drawn_in(results.attrs).summary, units)


KINDS = (
    Kind(
        "summary",
        "stick-slip index, lift-off, wall contact and whirl ratio along one axis",
        of=LINE,
        place=lambda data: 31 if fits_columns(data) else None,
        draw=draw,
        uses=lambda model: model.drawn.summary,
        across=longest,
        advice=needs_one_axis,
    ),
)
