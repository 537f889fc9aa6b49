"""How the pictures look: palette, fonts, sizes. Nothing here reads data or draws a
curve.

Colours are Okabe and Ito's, which colour-blind readers can distinguish, and a pale
green for safe; each response also has a marker and a letter of its own, so that a
picture can be read in grey. The pages in a browser have the same colours.
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
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.layout_engine import ConstrainedLayoutEngine

from nsdrill.errors import Refusal
from nsdrill.plot.labels import quantity
from nsdrill.plot.look import Look
from nsdrill.plot.look import look as look
from nsdrill.variables import BIT_BOUNCE, STICK_SLIP, WHIRL

FULL_WIDTH = 7.0  # inches: two columns of a journal page
NOTEBOOK_DPI = 110
SHORTEST_LINE = 20  # characters of a title
TITLE_HEIGHT = 0.3  # inches by which a page without a title is lower
PANEL_MARGINS = 0.7  # inches beside a panel: the axis at its left, and overhang at its right
RASTER_DPI = 300  # for PNG, and for the markers that are rasterised inside PDF and SVG
# Above this number a vector file is slow to open, so its markers become an image; the
# text stays text.
MANY_MARKERS = 20_000

BLUE, SKY, GREEN, ORANGE, VERMILLION = "#0072B2", "#56B4E9", "#009E73", "#E69F00", "#D55E00"
PURPLE, WINE, GREY, BLACK = "#CC79A7", "#882255", "#ABABAB", "#000000"
# Safe has one colour in every picture, and grey is what is not known.
SAFE_COLOUR = "#A3D58A"
# From the worst to the best, which is the colour of safe; the lightness rises all the
# way, so that the scale can be read in grey. A probability has this scale: of a safe
# run from 0 to 100 %, of a response from 100 % to 0.
WARNING = "#8A1C00"  # text of a warning: dark, so that it is read in grey as well
BAD_TO_GOOD = ("#3F1030", "#93394A", "#C9714B", "#D9A95B", SAFE_COLOUR)
SHADE, SHADE_EDGE = "#FFF3B8", "#C8B560"  # hysteresis: pale behind every marker colour
REFERENCE = "#4D4D4D"  # lines that are not data: the wall, the rotary speed
# colours belong to the responses
DIRECTION_COLOURS = {"same": BLACK, "up": BLACK, "down": "#808080"}

FONT_SIZE = 8.0  # points
RELATIVE_FONT_SIZES = {  # in units of font.size
    "axes.titlesize": 1.0,
    "axes.labelsize": 1.0,
    "figure.titlesize": 1.125,
    "legend.fontsize": 0.875,
    "xtick.labelsize": 0.875,
    "ytick.labelsize": 0.875,
}
RC: dict[str, Any] = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],  # part of matplotlib: the same picture on every machine
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
    """How one combination of critical responses, or one kind of motion, is drawn.
    ``letters`` stand for a response where there is no room for its name."""

    name: str
    colour: str
    marker: str
    letters: str = ""


NO_RESPONSE = "no critical response"

# Indexed by the response bits. One response: a light, strong colour; two: a darker one;
# all three: black. Whirl is not green, which readers take for safe.
RESPONSES: tuple[ResponseStyle, ...] = (
    ResponseStyle(NO_RESPONSE, SAFE_COLOUR, "o"),
    ResponseStyle("bit-bounce", SKY, "^", "B"),
    ResponseStyle("stick-slip", ORANGE, "s", "S"),
    ResponseStyle("bit-bounce + stick-slip", WINE, "p", "BS"),
    ResponseStyle("whirl", PURPLE, "D", "W"),
    ResponseStyle("bit-bounce + whirl", BLUE, "P", "BW"),
    ResponseStyle("stick-slip + whirl", VERMILLION, "X", "SW"),
    ResponseStyle("bit-bounce + stick-slip + whirl", BLACK, "*", "BSW"),
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


GOODNESS = LinearSegmentedColormap.from_list("goodness", BAD_TO_GOOD)


def ink_on(colour: str) -> str:
    """Black or white, whichever is easier to read on ``colour``."""
    red, green, blue = (int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5))
    return BLACK if 0.299 * red + 0.587 * green + 0.114 * blue > 0.5 else "#FFFFFF"


@cache
def fallback_fonts() -> list[str]:
    """Fonts installed here that have the Chinese, Japanese and Korean characters that
    the standard one lacks."""
    from matplotlib.font_manager import fontManager

    installed = sorted({font.name for font in fontManager.ttflist})
    return [name for name in installed if name.startswith(_FALLBACK_FONTS)]


_FALLBACK_FONTS = (
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


def settings(picture_look: Look) -> dict[str, Any]:
    """The settings of matplotlib for a picture, later ones before earlier ones: the
    house style, what the user has changed from matplotlib's defaults, a style file, the
    options."""
    rc, defaults = (cast("dict[str, Any]", mapping) for mapping in (mpl.rcParams, mpl.rcParamsDefault))
    users_settings = {
        name: rc[name] for name in rc if not name.startswith(_IGNORED_SETTINGS) and rc[name] != defaults[name]
    }
    chosen = {**users_settings, **(picture_look.style or {})}
    house_settings = {**RC, "font.sans-serif": [*RC["font.sans-serif"], *fallback_fonts()]}
    size = float(picture_look.font_size or chosen.get("font.size", FONT_SIZE))
    sizes = {"font.size": size, **{name: part * size for name, part in RELATIVE_FONT_SIZES.items()}}
    return {**house_settings, **chosen, **sizes} if picture_look.font_size else {**house_settings, **sizes, **chosen}


# Settings that do not affect a picture.
_IGNORED_SETTINGS = ("backend", "interactive", "toolbar", "webagg", "tk.", "docstring", "date.", "animation", "keymap")


@contextmanager
def house_style(rc: Mapping[str, Any] | None = None) -> Iterator[None]:
    """:func:`settings` of the current look, or the settings ``rc`` of an existing
    picture, while the block runs; those of the caller afterwards."""
    settings_in_force = settings(look.get()) if rc is None else rc
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(cast("Any", settings_in_force))
        yield


def font_size(points: float) -> float:
    """The size [points] that corresponds, in this picture, to ``points`` in a picture
    of :data:`FONT_SIZE`."""
    return float(points / FONT_SIZE * mpl.rcParams["font.size"])


def page_width(default: float = FULL_WIDTH) -> float:
    """The width of the page [inches]: the user's, else ``default``."""
    if (drawing_target := target.get()) is not None:
        return float(drawing_target.bbox.width / drawing_target.dpi)
    width = look.get().width
    if width is None and (figsize := mpl.rcParams["figure.figsize"]) != mpl.rcParamsDefault["figure.figsize"]:
        width = float(figsize[0])
    return default if width is None else width


def cell_style(cells: int) -> dict[str, Any]:
    """The properties of a mesh of ``cells`` cells without seams. Few cells overlap
    their borders slightly, as viewers of PDF and SVG otherwise show the page between
    neighbours; many become an image, which has no seams."""
    if cells > MANY_MARKERS:
        return {"edgecolors": "none", "linewidth": 0.0, "rasterized": True}
    return {"edgecolors": "face", "linewidth": 0.6}


def panels_per_row(count: int, min_width: float) -> int:
    """How many of ``count`` panels fit in a row, each ``min_width`` inches wide or
    more."""
    return max(1, min(count, int(page_width() / min_width)))


class Picture(Figure):
    """A figure that a notebook shows without pyplot. It keeps the settings with which
    it was drawn, and the characters of its title that no font has."""

    settings: Mapping[str, Any] | None = None
    missing: str = ""

    def _repr_png_(self) -> bytes:
        image = io.BytesIO()
        with house_style(self.settings), without_glyph_warnings():
            self.savefig(image, format="png", dpi=NOTEBOOK_DPI)
        return image.getvalue()


@contextmanager
def without_glyph_warnings() -> Iterator[None]:
    """Suppress matplotlib's warning for every missing character; they are reported once
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
    fonts = []
    for name in names:
        with suppress(ValueError):
            fonts.append(get_font(findfont(FontProperties(family=name), fallback_to_default=False)))
    return "".join(
        dict.fromkeys(
            character
            for character in text
            if not character.isspace() and not any(font.get_char_index(ord(character)) for font in fonts)
        )
    )


target: ContextVar[Figure | None] = ContextVar("target", default=None)
"""The stand-in for a figure while a picture is drawn into axes of the caller: see
:mod:`nsdrill.plot.into`."""


def new_figure(width: float, height: float) -> Figure:
    """A figure in inches, unknown to pyplot and to any window system. It is higher
    where the font is larger than :data:`FONT_SIZE`, as room for the labels of panels
    above each other."""
    if (drawing_target := target.get()) is not None:
        return drawing_target
    label_size = FontProperties(size=mpl.rcParams["axes.labelsize"]).get_size_in_points()
    scaled_height = height * max(1.0, label_size / FONT_SIZE)
    figure = Picture(figsize=(width, look.get().height or scaled_height), layout="constrained")
    figure.settings = settings(look.get())
    FigureCanvasAgg(figure)
    engine = figure.get_layout_engine()
    assert isinstance(engine, ConstrainedLayoutEngine)
    engine.set(w_pad=0.03, h_pad=0.03, hspace=0.02, wspace=0.02)
    return figure


def stack(figure: Any, rows: int, *, shared: bool = True, **ratios: Any) -> list[Axes]:
    """Panels one below the other, which share the x axis where ``shared``."""
    grid = figure.add_gridspec(rows, 1, **ratios)
    panels: list[Axes] = []
    for row in range(rows):
        first = panels[0] if shared and panels else None
        panels.append(figure.add_subplot(grid[row, 0], sharex=first))
        panels[-1].tick_params(labelbottom=not shared or row == rows - 1)
    return panels


def name_panel(axes: Axes, name: str, y: str = "") -> None:
    """Name a panel, as the user may ask for it alone, and the variable along its y
    axis, where that has a unit for limits."""
    axes.set_label(name)
    axes.yaxis.set_gid(y)


def has_title() -> bool:
    """Whether pictures have titles, of the figure and of panels; not where the user
    wants none."""
    return look.get().title is not False


def put_title(figure: Figure, text: str) -> None:
    """Give the figure the title of the user, else ``text``; its lines are broken where
    they are wider than the figure."""
    title_of_user = look.get().title
    if title_of_user is False:
        # no empty strip in place of the title
        if isinstance(figure, Picture) and look.get().height is None:
            figure.set_figheight(max(0.5 * figure.get_figheight(), figure.get_figheight() - TITLE_HEIGHT))
        return
    text = title_of_user if isinstance(title_of_user, str) else text
    title = figure.suptitle(text, parse_math=False)
    if title is None:  # drawn into axes of the caller, who gives the title
        return
    if isinstance(figure, Picture):
        figure.missing = missing_characters(text)
    available, lines = figure.bbox.width - 6.0 * figure.dpi / 72, []
    for line in text.split("\n"):
        count = len(line)
        title.set_text(line)
        while (width := title.get_window_extent().width) > available and count > SHORTEST_LINE:
            count = max(SHORTEST_LINE, min(count - 1, int(count * available / width) + 2))
            title.set_text(textwrap.fill(line, count))
        lines.append(title.get_text())
    title.set_text("\n".join(lines))


def set_panel_title(axes: Axes, text: str, loc: Literal["left", "center"] = "center") -> None:
    """Give a panel a title, broken after semicolons and commas where it is wider than
    its figure or subfigure; no title where the user wants none."""
    parent: Any = axes.figure
    if not has_title():  # the user wants no titles
        return
    title = axes.set_title(text, loc=loc)
    width, available = (title.get_window_extent().width, parent.bbox.width - PANEL_MARGINS * parent.dpi)
    if width > available:
        unbroken = re.sub(r"(?<![;,]) ", "\u00a0", text)
        lines = textwrap.fill(unbroken, max(SHORTEST_LINE, int(len(text) * available / width)), break_long_words=False)
        title.set_text(lines.replace("\u00a0", " "))


@contextmanager
def using_look(picture_look: Look) -> Iterator[None]:
    """Make this the current look while the block runs."""
    token = look.set(picture_look)
    try:
        yield
    finally:
        look.reset(token)


def limit_x_axes(figure: Figure, across: str, ends: tuple[float, float], units: str) -> None:
    """Limit the x axes that show the variable ``across`` to these values, in SI."""
    x = quantity(across, units)
    low, high = (end / x.scale for end in ends)
    for axes in panels_of(figure):
        if axes.get_xlabel() == x.label:
            if axes.get_xscale() == "log" and low <= 0.0:
                raise Refusal("xlim", f"{x.value(ends[0])} on a logarithmic axis", "above zero")
            axes.set_xlim(low, high)


def write_in_largest_panel(figure: Figure, text: str) -> None:
    """Write ``text`` in the middle of the largest panel."""
    if not (panels := panels_of(figure) or [figure.add_subplot()]):
        return
    figure.draw_without_rendering()  # so that the panels have their sizes
    largest = max(panels, key=lambda axes: axes.get_position().width * axes.get_position().height)
    largest.text(
        0.5,
        0.5,
        text,
        transform=largest.transAxes,
        ha="center",
        va="center",
        gid="nothing",
        bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.85},
    )


def panels_of(figure: Any) -> list[Axes]:
    """All axes of a figure and of its subfigures."""
    panels = figure.axes or [axes for subfigure in getattr(figure, "subfigs", ()) for axes in panels_of(subfigure)]
    return list(dict.fromkeys(panels))


CONSTANT_TOLERANCE = 1e-6  # relative range below which values are shown as constant


def _widen_constant_axes(figure: Figure) -> None:
    """Widen the limits of axes whose values are constant but for rounding, so that they
    appear as a line with plain ticks: otherwise rounding fills the panel, and every
    tick has ten digits."""
    for axes in panels_of(figure):
        if axes.get_label() == "<colorbar>":
            continue
        for axis in (axes.xaxis, axes.yaxis):
            name = axis.axis_name
            if axis.get_scale() != "linear" or not getattr(axes, f"get_autoscale{name}_on")():
                continue
            ends = getattr(axes, f"get_{name}lim")()
            low, high = min(ends), max(ends)
            size = max(abs(low), abs(high))
            if high - low < max(CONSTANT_TOLERANCE * size, 1e-9):
                middle, half = 0.5 * (low + high), 0.05 * size if size > 1e-6 else 0.05
                limits = (middle - half, middle + half)
                getattr(axes, f"set_{name}lim")(*(limits if ends[0] <= ends[1] else limits[::-1]))


def freeze_layout(figure: Figure) -> None:
    """Lay out the figure and fix its layout: the same geometry in every format, each
    time it is saved.

    The layout is computed twice, as the space for aligned labels is known only once the
    axes have their positions.
    """
    _widen_constant_axes(figure)
    for _ in range(2):
        figure.draw_without_rendering()
    figure.set_layout_engine("none")
    # The layout solver orders its variables by memory address, so positions differ in
    # the last bits from one call to the next: enough for a pixel. Rounding makes them
    # the same every time.
    for axes in figure.axes:
        left, bottom, width, height = (round(value, 6) for value in axes.get_position(original=True).bounds)
        axes.set_position((left, bottom, width, height))
