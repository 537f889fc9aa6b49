"""The responses over two axes, as colours with names."""

from __future__ import annotations

from matplotlib.figure import Figure

from nsdrill.data import Results
from nsdrill.plot.isolines import line_variables
from nsdrill.plot.maps import draw_categories_map, lies_across
from nsdrill.plot.registry import PLANE, Kind, is_plane


def draw(results: Results, units: str = "si") -> Figure:
    return draw_categories_map(results, "response", units)


KINDS = (
    Kind(
        "map",
        "the responses over two axes",
        of=PLANE,
        place=lambda data: 40 if is_plane(data) else None,
        draw=draw,
        uses=line_variables,
        across=lies_across,
    ),
)
