"""The kind of whirl over two axes, as colours with names."""

from __future__ import annotations

from matplotlib.figure import Figure

from nsdrill.data import Results
from nsdrill.plot.maps import draw_categories_map, lies_across
from nsdrill.plot.registry import PLANE, Kind, is_plane


def draw(results: Results, units: str = "si") -> Figure:
    return draw_categories_map(results, "whirl_kind", units)


KINDS = (
    Kind(
        "whirl_kind",
        "the kind of whirl over two axes",
        of=PLANE,
        place=lambda data: 41 if is_plane(data) and "whirl_kind" in data.variables else None,
        draw=draw,
        uses=lambda model: ("whirl_kind",),
        across=lies_across,
        part_of="map",
    ),
)
