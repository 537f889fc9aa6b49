"""How the pictures look: palette, type, sizes. Nothing here reads data or draws a curve.

Colours are Okabe and Ito's, which stay apart for colour-blind readers; each response also has a marker of its own, so
that a picture survives a grey printer.
"""

from __future__ import annotations

import io
import textwrap
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Any, cast

import matplotlib as mpl
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

from nsdrill.variables import BIT_BOUNCE, STICK_SLIP, WHIRL

FULL_WIDTH = 7.0  # inches: two columns of a journal page
NOTEBOOK_DPI = 110
SHORTEST_LINE = 20  # characters of a title
RASTER_DPI = 300  # for PNG, and for the markers that are rasterised inside PDF and SVG
MANY_MARKERS = 20_000  # above this a vector file is slow to open, so its markers become an image; the text stays text

BLUE, SKY, GREEN, ORANGE, VERMILLION = "#0072B2", "#56B4E9", "#009E73", "#E69F00", "#D55E00"
WINE, GREY, BLACK = "#882255", "#ABABAB", "#000000"
SHADE, SHADE_EDGE = "#FFF3B8", "#C8B560"  # hysteresis: pale enough to carry every marker colour
# Cells reach a hair over their borders: else viewers of PDF and SVG show the page between neighbours.
SEAMLESS: dict[str, Any] = {"edgecolors": "face", "linewidth": 0.6}
REFERENCE = "#4D4D4D"  # lines that are not data: the wall, the set speed
DIRECTION_COLOURS = {"same": BLACK, "up": BLACK, "down": "#808080"}  # colours belong to the responses

RC: dict[str, Any] = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],  # comes with matplotlib: the same picture on every machine
    "font.size": 8.0,
    "axes.titlesize": 8.0,
    "axes.labelsize": 8.0,
    "figure.titlesize": 9.0,
    "xtick.labelsize": 7.0,
    "ytick.labelsize": 7.0,
    "legend.fontsize": 7.0,
    "axes.linewidth": 0.6,
    "axes.formatter.useoffset": False,
    "axes.formatter.limits": (-4, 5),
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.major.size": 2.5,
    "ytick.major.size": 2.5,
    "xtick.direction": "out",
    "ytick.direction": "out",
    "lines.linewidth": 0.8,
    "lines.solid_capstyle": "round",
    "hatch.linewidth": 0.5,
    "legend.frameon": False,
    "legend.handletextpad": 0.4,
    "legend.columnspacing": 1.4,
    "savefig.dpi": RASTER_DPI,
    "figure.dpi": 100,
    "pdf.fonttype": 42,  # TrueType: text in the PDF can be searched and edited
    "svg.fonttype": "none",  # text as text
    "svg.hashsalt": "nsdrill",  # else the identifiers in an SVG are random
    "path.simplify": True,
    "text.usetex": False,
}


@dataclass(frozen=True)
class ResponseStyle:
    """How one combination of critical responses, or one kind of motion, is drawn."""

    name: str
    colour: str
    marker: str


NO_RESPONSE = "no critical response"

# Indexed by the response bits. One response: a light, strong colour; two: a darker one; all three: black.
RESPONSES: tuple[ResponseStyle, ...] = (
    ResponseStyle(NO_RESPONSE, GREY, "o"),
    ResponseStyle("bit-bounce", SKY, "^"),
    ResponseStyle("stick-slip", ORANGE, "s"),
    ResponseStyle("bit-bounce + stick-slip", WINE, "p"),
    ResponseStyle("whirl", GREEN, "D"),
    ResponseStyle("bit-bounce + whirl", BLUE, "P"),
    ResponseStyle("stick-slip + whirl", VERMILLION, "X"),
    ResponseStyle("bit-bounce + stick-slip + whirl", BLACK, "*"),
)
# Indexed by the kind of motion. Paul Tol's muted colours: none of them stands for a response.
MOTIONS: tuple[ResponseStyle, ...] = (
    ResponseStyle("undetermined", "#999933", "."),
    ResponseStyle("equilibrium", BLACK, "_"),
    ResponseStyle("periodic", "#332288", "o"),
    ResponseStyle("quasi-periodic", "#44AA99", "D"),
    ResponseStyle("chaotic", "#CC6677", "^"),
    ResponseStyle("unsettled", "#DDCC77", "s"),
)
assert RESPONSES[BIT_BOUNCE | STICK_SLIP | WHIRL].name.count("+") == 2


@contextmanager
def house_style() -> Iterator[None]:
    """matplotlib's defaults with :data:`RC` on top, whatever the caller has set, and the caller's settings after."""
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(cast("Any", RC))
        yield


class Picture(Figure):
    """A figure that a notebook shows by itself, without pyplot."""

    def _repr_png_(self) -> bytes:
        image = io.BytesIO()
        with house_style():
            self.savefig(image, format="png", dpi=NOTEBOOK_DPI)
        return image.getvalue()


target: ContextVar[Figure | None] = ContextVar("target", default=None)
"""What is drawn into, where that is not a figure of its own: see :mod:`nsdrill.plot.into`."""


def new_figure(width: float, height: float) -> Figure:
    """A figure in inches that no window system and no pyplot knows of."""
    if (given := target.get()) is not None:
        return given
    figure = Picture(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    engine = figure.get_layout_engine()
    assert isinstance(engine, ConstrainedLayoutEngine)
    engine.set(w_pad=0.03, h_pad=0.03, hspace=0.02, wspace=0.02)
    return figure


def put_title(figure: Figure, text: str) -> None:
    """Give the figure a title, its lines broken where they are wider than the figure."""
    title = figure.suptitle(text, parse_math=False)
    if title is None:  # drawn into the axes of others, whose title it is
        return
    room, lines = figure.bbox.width - 6.0 * figure.dpi / 72, []
    for line in text.split("\n"):
        count = len(line)
        title.set_text(line)
        while (width := title.get_window_extent().width) > room and count > SHORTEST_LINE:
            count = max(SHORTEST_LINE, min(count - 1, int(count * room / width) + 2))
            title.set_text(textwrap.fill(line, count))
        lines.append(title.get_text())
    title.set_text("\n".join(lines))


def settle(figure: Figure) -> None:
    """Lay the figure out and keep it so: the same geometry in every format and at every saving.

    More than one pass, because the space for aligned labels is known only after the axes have found their places.
    """
    for _ in range(2):
        figure.draw_without_rendering()
    figure.set_layout_engine("none")
    # The layout's solver orders its variables by their addresses, and its places differ in the last bits from one call
    # to the next: enough for a pixel. Rounded, they are the same every time.
    for axes in figure.axes:
        left, bottom, width, height = (round(value, 6) for value in axes.get_position(original=True).bounds)
        axes.set_position((left, bottom, width, height))
