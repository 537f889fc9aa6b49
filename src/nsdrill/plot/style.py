"""How the pictures look: palette, type, sizes. Nothing here reads data or draws a
curve.

Colours are Okabe and Ito's, which stay apart for colour-blind readers; each response
also has a marker of its own, so that a picture survives a grey printer.
"""

from __future__ import annotations

import io
import re
import textwrap
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass
from functools import cache
from typing import Any, Literal, cast

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.layout_engine import ConstrainedLayoutEngine

from nsdrill.errors import InputError
from nsdrill.plot.labels import quantity
from nsdrill.plot.look import Look, look
from nsdrill.variables import BIT_BOUNCE, STICK_SLIP, WHIRL

FULL_WIDTH = 7.0  # inches: two columns of a journal page
NOTEBOOK_DPI = 110
SHORTEST_LINE = 20  # characters of a title
UNTITLED = 0.3  # inches that a page without a title is lower
BESIDE = 0.7  # inches beside a panel: the axis at its left, and what stands over its right end
RASTER_DPI = 300  # for PNG, and for the markers that are rasterised inside PDF and SVG
# above this a vector file is slow to open, so its markers become an image; the text
# stays text
MANY_MARKERS = 20_000

BLUE, SKY, GREEN, ORANGE, VERMILLION = "#0072B2", "#56B4E9", "#009E73", "#E69F00", "#D55E00"
WINE, GREY, BLACK = "#882255", "#ABABAB", "#000000"
SHADE, SHADE_EDGE = "#FFF3B8", "#C8B560"  # hysteresis: pale enough to carry every marker colour
REFERENCE = "#4D4D4D"  # lines that are not data: the wall, the set speed
# colours belong to the responses
DIRECTION_COLOURS = {"same": BLACK, "up": BLACK, "down": "#808080"}

FONT_SIZE = 8.0  # points, of which the sizes of TYPE are parts
TYPE = {
    "axes.titlesize": 1.0,
    "axes.labelsize": 1.0,
    "figure.titlesize": 1.125,
    "legend.fontsize": 0.875,
    "xtick.labelsize": 0.875,
    "ytick.labelsize": 0.875,
}
RC: dict[str, Any] = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],  # comes with matplotlib: the same picture on every machine
    "font.size": FONT_SIZE,
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

# Indexed by the response bits. One response: a light, strong colour; two: a darker one;
# all three: black.
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
# Indexed by the kind of whirl. Paul Tol's light colours: none of them stands for a
# response or a kind of motion.
WHIRLS: tuple[tuple[str, str], ...] = (
    ("no whirl", "#DDDDDD"),
    ("forward", "#77AADD"),
    ("backward", "#EEDD88"),
    ("backward rolling", "#EE8866"),
    ("irregular", "#FFAABB"),
    ("low side", "#BBCC33"),
)
# Indexed by the kind of motion. Paul Tol's muted colours: none of them stands for a
# response.
MOTIONS: tuple[ResponseStyle, ...] = (
    ResponseStyle("undetermined", "#999933", "."),
    ResponseStyle("equilibrium", BLACK, "_"),
    ResponseStyle("periodic", "#332288", "o"),
    ResponseStyle("quasi-periodic", "#44AA99", "D"),
    ResponseStyle("chaotic", "#CC6677", "^"),
    ResponseStyle("unsettled", "#DDCC77", "s"),
)
assert RESPONSES[BIT_BOUNCE | STICK_SLIP | WHIRL].name.count("+") == 2


@cache
def further_fonts() -> list[str]:
    """Fonts of this machine with characters that the usual one lacks: Chinese,
    Japanese, Korean."""
    from matplotlib.font_manager import fontManager

    there = sorted({font.name for font in fontManager.ttflist})
    return [name for name in there if name.startswith(_FURTHER)]


_FURTHER = (
    "Noto Sans CJK",
    "Noto Sans SC",
    "Noto Sans JP",
    "Noto Sans KR",
    "Source Han Sans",
    "WenQuanYi",
    "IPAGothic",
    "IPAexGothic",
    "TakaoGothic",
    "VL Gothic",
    "Droid Sans Fallback",
    "NanumGothic",
    "Hiragino Sans",
    "PingFang",
    "Microsoft YaHei",
    "MS Gothic",
    "Malgun Gothic",
    "SimHei",
    "Arial Unicode MS",
)


def settings(wanted: Look) -> dict[str, Any]:
    """The settings of matplotlib for a picture: the house's, then those that the user
    has changed from matplotlib's defaults, then those of a style file, then the
    options."""
    rc, usual = (cast("dict[str, Any]", one) for one in (mpl.rcParams, mpl.rcParamsDefault))
    users = {
        name: rc[name] for name in rc if not name.startswith(_NOT_TAKEN) and rc[name] != usual[name]
    }
    own = {**users, **(wanted.style or {})}
    house = {**RC, "font.sans-serif": [*RC["font.sans-serif"], *further_fonts()]}
    size = float(wanted.font_size or own.get("font.size", FONT_SIZE))
    sizes = {"font.size": size, **{name: part * size for name, part in TYPE.items()}}
    return {**house, **own, **sizes} if wanted.font_size else {**house, **sizes, **own}


# What has no part in a picture.
_NOT_TAKEN = (
    "backend",
    "interactive",
    "toolbar",
    "webagg",
    "tk.",
    "docstring",
    "date.",
    "animation",
    "keymap",
)


@contextmanager
def house_style(of: Mapping[str, Any] | None = None) -> Iterator[None]:
    """:func:`settings` for the picture that is drawn, or those ``of`` one that is
    there; the caller's after."""
    chosen = settings(look.get()) if of is None else of
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(cast("Any", chosen))
        yield


def type_size(size: float) -> float:
    """A size of type for 8 point pictures, in the type of this one."""
    return float(size / FONT_SIZE * mpl.rcParams["font.size"])


def page_width(usual: float = FULL_WIDTH) -> float:
    """Inches across: as the user wants it, else the ``usual`` ones."""
    if (given := target.get()) is not None:
        return float(given.bbox.width / given.dpi)
    wanted = look.get().width
    if (
        wanted is None
        and (size := mpl.rcParams["figure.figsize"]) != mpl.rcParamsDefault["figure.figsize"]
    ):
        wanted = float(size[0])
    return usual if wanted is None else wanted


def seamless(cells: int) -> dict[str, Any]:
    """How so many cells are drawn. They reach a hair over their borders: else viewers
    of PDF and SVG show the page between neighbours. Many become an image, in which
    there is nothing between them."""
    if cells > MANY_MARKERS:
        return {"edgecolors": "none", "linewidth": 0.0, "rasterized": True}
    return {"edgecolors": "face", "linewidth": 0.6}


def side_by_side(count: int, least: float) -> int:
    """How many of ``count`` panels stand in a row where each needs ``least`` inches."""
    return max(1, min(count, int(page_width() / least)))


class Picture(Figure):
    """A figure that a notebook shows by itself, without pyplot. It keeps the settings
    with which it was drawn, and the characters of its title that no font has."""

    settings: Mapping[str, Any] | None = None
    missing: str = ""

    def _repr_png_(self) -> bytes:
        image = io.BytesIO()
        with house_style(self.settings), quiet_glyphs():
            self.savefig(image, format="png", dpi=NOTEBOOK_DPI)
        return image.getvalue()


@contextmanager
def quiet_glyphs() -> Iterator[None]:
    """Without matplotlib's warnings of every missing character, which are told once
    (:func:`missing_characters`)."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing from")
        yield


def missing_characters(text: str) -> str:
    """The characters of a text that none of the fonts has, each once."""
    from matplotlib.font_manager import FontProperties, findfont, get_font

    rc = cast("dict[str, Any]", mpl.rcParams)
    families = list(rc["font.family"])
    names = [name for family in families for name in rc.get(f"font.{family}", [family])]
    found = []
    for name in names:
        with suppress(ValueError):
            found.append(get_font(findfont(FontProperties(family=name), fallback_to_default=False)))
    return "".join(
        dict.fromkeys(
            one
            for one in text
            if not one.isspace() and not any(f.get_char_index(ord(one)) for f in found)
        )
    )


target: ContextVar[Figure | None] = ContextVar("target", default=None)
"""What is drawn into, where that is not a figure of its own: see
:mod:`nsdrill.plot.into`."""


def new_figure(width: float, height: float) -> Figure:
    """A figure in inches that no window system and no pyplot knows of; higher where
    type is larger than ours, so that the labels of panels above each other have
    room."""
    if (given := target.get()) is not None:
        return given
    labels = FontProperties(size=mpl.rcParams["axes.labelsize"]).get_size_in_points()
    room = height * max(1.0, labels / FONT_SIZE)
    figure = Picture(figsize=(width, look.get().height or room), layout="constrained")
    figure.settings = settings(look.get())
    FigureCanvasAgg(figure)
    engine = figure.get_layout_engine()
    assert isinstance(engine, ConstrainedLayoutEngine)
    engine.set(w_pad=0.03, h_pad=0.03, hspace=0.02, wspace=0.02)
    return figure


def titled() -> bool:
    """Whether the user leaves pictures their titles and the words over panels."""
    return look.get().title is not False


def put_title(figure: Figure, text: str) -> None:
    """Give the figure a title, its lines broken where they are wider than the figure;
    or that of the user."""
    wanted = look.get().title
    if wanted is False:
        # no empty strip where it would stand
        if isinstance(figure, Picture) and look.get().height is None:
            figure.set_figheight(
                max(0.5 * figure.get_figheight(), figure.get_figheight() - UNTITLED)
            )
        return
    text = wanted if isinstance(wanted, str) else text
    title = figure.suptitle(text, parse_math=False)
    if title is None:  # drawn into the axes of others, whose title it is
        return
    if isinstance(figure, Picture):
        figure.missing = missing_characters(text)
    room, lines = figure.bbox.width - 6.0 * figure.dpi / 72, []
    for line in text.split("\n"):
        count = len(line)
        title.set_text(line)
        while (width := title.get_window_extent().width) > room and count > SHORTEST_LINE:
            count = max(SHORTEST_LINE, min(count - 1, int(count * room / width) + 2))
            title.set_text(textwrap.fill(line, count))
        lines.append(title.get_text())
    title.set_text("\n".join(lines))


def say_over(axes: Axes, text: str, loc: Literal["left", "center"] = "center") -> None:
    """A title of a panel that is as wide as its figure, or the part of one that it
    stands in; where it is wider, broken after its semicolons and commas. None where the
    user wants no title."""
    part: Any = axes.figure
    if not titled():  # a caption says it
        return
    title = axes.set_title(text, loc=loc)
    width, room = title.get_window_extent().width, part.bbox.width - BESIDE * part.dpi
    if width > room:
        whole = re.sub(r"(?<![;,]) ", "\u00a0", text)
        lines = textwrap.fill(
            whole, max(SHORTEST_LINE, int(len(text) * room / width)), break_long_words=False
        )
        title.set_text(lines.replace("\u00a0", " "))


@contextmanager
def looking(wanted: Look) -> Iterator[None]:
    """While pictures are drawn that shall look like this."""
    token = look.set(wanted)
    try:
        yield
    finally:
        look.reset(token)


def show_between(figure: Figure, across: str, ends: tuple[float, float], units: str) -> None:
    """Limit the x axes that show the variable ``across`` to these values, in SI."""
    x = quantity(across, units)
    low, high = (end / x.scale for end in ends)
    for axes in panels_of(figure):
        if axes.get_xlabel() == x.label:
            if axes.get_xscale() == "log" and low <= 0.0:
                raise InputError(
                    f"--xlim: found {x.value(ends[0])} on a logarithmic axis; allowed: above zero."
                )
            axes.set_xlim(low, high)


def say_inside(figure: Figure, words: str) -> None:
    """Words in the largest panel."""
    if not (panels := panels_of(figure) or [figure.add_subplot()]):
        return
    figure.draw_without_rendering()  # so that the panels have their sizes
    largest = max(panels, key=lambda axes: axes.get_position().width * axes.get_position().height)
    largest.text(
        0.5,
        0.5,
        words,
        transform=largest.transAxes,
        ha="center",
        va="center",
        gid="nothing",
        bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.85},
    )


def panels_of(figure: Any) -> list[Axes]:
    """All axes of a figure and its parts."""
    own = figure.axes or [
        axes for part in getattr(figure, "subfigs", ()) for axes in panels_of(part)
    ]
    return list(dict.fromkeys(own))


LEVEL = 1e-6  # part of its size by which what is shown as one value varies


def _open_level(figure: Figure) -> None:
    """Give the axes whose values are one value and its last digits a range in which
    they are a line, with plain ticks: else rounding fills the panel, and every tick has
    ten digits."""
    for axes in panels_of(figure):
        if axes.get_label() == "<colorbar>":
            continue
        for one in (axes.xaxis, axes.yaxis):
            name = one.axis_name
            if one.get_scale() != "linear" or not getattr(axes, f"get_autoscale{name}_on")():
                continue
            ends = getattr(axes, f"get_{name}lim")()
            low, high = min(ends), max(ends)
            size = max(abs(low), abs(high))
            if high - low < max(LEVEL * size, 1e-9):
                middle, half = 0.5 * (low + high), 0.05 * size if size > 1e-6 else 0.05
                limits = (middle - half, middle + half)
                getattr(axes, f"set_{name}lim")(*(limits if ends[0] <= ends[1] else limits[::-1]))


def settle(figure: Figure) -> None:
    """Lay the figure out and keep it so: the same geometry in every format and at every
    saving.

    More than one pass, because the space for aligned labels is known only after the
    axes have found their places.
    """
    _open_level(figure)
    for _ in range(2):
        figure.draw_without_rendering()
    figure.set_layout_engine("none")
    # The layout's solver orders its variables by their addresses, and its places differ
    # in the last bits from one call to the next: enough for a pixel. Rounded, they are
    # the same every time.
    for axes in figure.axes:
        left, bottom, width, height = (
            round(value, 6) for value in axes.get_position(original=True).bounds
        )
        axes.set_position((left, bottom, width, height))
