"""How the pictures look: palette, fonts, sizes. Nothing here reads data or draws a
curve.

Colours are Okabe and Ito's, which colour-blind readers can distinguish, and a pale
green for safe; each response also has a marker and a letter of its own, so that a
picture can be read in grey. The pages in a browser have the same colours.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass
from functools import cache
from typing import Any, cast

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import Collection
from matplotlib.colors import LinearSegmentedColormap, ListedColormap, to_rgb, to_rgba
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke
from matplotlib.text import Text

from nsdrill.data import Array
from nsdrill.models.responses import RESPONSE_KINDS
from nsdrill.models.responses import RESPONSES as CRITICAL
from nsdrill.plot.look import Look
from nsdrill.plot.look import look as look

Properties = dict[str, Any]  # of artists of matplotlib, by their names
Dashes = str | tuple[float, tuple[float, ...]]  # the name of a style of lines, or where it starts and its lengths

FULL_WIDTH = 7.0  # inches: two columns of a journal page
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
DASHED: Properties = {"color": REFERENCE, "linewidth": 0.7, "dashes": (4, 2)}
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
RC: Properties = {
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
# all three: black. None is green, which readers take for safe.
_LOOKS = (
    (SAFE_COLOUR, "o"),
    (SKY, "^"),
    (ORANGE, "s"),
    (WINE, "p"),
    (PURPLE, "D"),
    (BLUE, "P"),
    (VERMILLION, "X"),
    (BLACK, "*"),
)


def _styled(bits: int, look: tuple[str, str]) -> ResponseStyle:
    """The style of the responses with these bits."""
    present = [response for response in CRITICAL.values() if response.bit & bits]
    name = " + ".join(response.words for response in present)
    return ResponseStyle(name or NO_RESPONSE, *look, "".join(response.letter for response in present))


RESPONSES: tuple[ResponseStyle, ...] = tuple(_styled(bits, look) for bits, look in enumerate(_LOOKS))
# Of the kinds of a response, the first for none. Paul Tol's light colours: none of them
# stands for a response or a kind of motion.
KIND_COLOURS = ("#DDDDDD", "#77AADD", "#EEDD88", "#EE8866", "#FFAABB", "#BBCC33")
KIND_STYLES: dict[str, tuple[tuple[str, str], ...]] = {
    name: tuple(zip(response.words_of_kinds, KIND_COLOURS, strict=True)) for name, response in RESPONSE_KINDS.items()
}
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


def halo(width: float, colour: Any = "white") -> list[Any]:
    """The effect on words and lines that are to be read on every ground: a border
    ``width`` points wide."""
    return [withStroke(linewidth=width, foreground=colour)]


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


@contextmanager
def without_glyph_warnings() -> Iterator[None]:
    """Suppress matplotlib's warning for every missing character; they are reported once
    (:func:`missing_characters`)."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing from")
        yield


def missing_characters(text: str) -> str:
    """The characters of a text that none of the fonts has, each once."""
    from matplotlib.font_manager import findfont, get_font

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
:mod:`nsdrill.plot.drawing`."""


@contextmanager
def using_look(picture_look: Look) -> Iterator[None]:
    """Make this the current look while the block runs."""
    token = look.set(picture_look)
    try:
        yield
    finally:
        look.reset(token)


# Pictures on a dark page: the colours are chosen for a white one, and those that would
# be lost on the page of the user's style are exchanged.


CONTRAST = 4.5  # least ratio of luminances of a mark and the page (WCAG 2.1)
PALE = 0.6  # least part of a colour that is a ground behind marks rather than a mark


def on_dark_page(figure: Figure, artists: Iterable[Artist]) -> None:
    """Exchange the colours of ``artists`` that are lost on the page of the ``figure``,
    where that is dark: white, the paper, becomes the page, and marks become lighter."""
    page = np.array(to_rgb(figure.get_facecolor()))
    if luminance(page) > 0.2:
        return

    def shown(colour: Any) -> Any:
        if isinstance(colour, str) and colour in ("none", "auto", "None", "inherit", "face"):
            return colour
        *rgb, alpha = to_rgba(colour)
        return (*visible(np.array(rgb), page), alpha)

    for artist in artists:
        if isinstance(artist, Line2D):
            _exchange(artist, shown, "color", "markerfacecolor", "markeredgecolor")
        elif isinstance(artist, Patch):
            _exchange(artist, shown, "facecolor", "edgecolor")
        elif isinstance(artist, Text):
            text = np.array(to_rgb(artist.get_color()))
            if contrast(text, page) < CONTRAST:  # else of the style, which may be white
                artist.set_color(shown(artist.get_color()))
            if artist.get_path_effects():
                artist.set_path_effects(halo(2.0, tuple(page)))
        elif isinstance(artist, Collection) and artist.get_array() is None:
            for name in ("facecolor", "edgecolor"):
                colours = getattr(artist, f"get_{name}")()
                if len(colours) and not isinstance(colours, str):
                    getattr(artist, f"set_{name}")([shown(colour) for colour in colours])
        elif isinstance(artist, Collection) and isinstance(artist.cmap, ListedColormap):
            categories: Any = artist.cmap
            if categories.N < 32:  # no scale
                colours = [shown(colour) for colour in categories.colors]
                artist.set_cmap(ListedColormap(colours, name=categories.name))


def marks_of(figure: Figure, panels: Iterable[Axes]) -> list[Artist]:
    """What is drawn on a figure, without the frames, ticks and grids of its panels,
    which have the colours of the style."""
    frames: set[Artist] = {figure.patch}
    for axes in panels:
        frames.update({axes.patch, *axes.xaxis.findobj(), *axes.yaxis.findobj()})
        frames.update(axes.spines.values())
    return [artist for artist in figure.findobj() if artist not in frames]


def visible(colour: Array, page: Array) -> Array:
    """The colour [red, green, blue] that stands for ``colour`` on this page."""
    if np.min(colour) > PALE and np.max(colour) > 0.82:  # paper and grounds
        return np.clip(page + (0.25 * colour if np.ptp(colour) >= 0.05 else 1.0 - colour), 0, 1)
    if np.ptp(colour) < 0.05 and contrast(colour, page) < CONTRAST:
        return 1.0 - colour
    share = 0.0
    while contrast(colour + share * (1.0 - colour), page) < CONTRAST:
        share += 0.05
    return colour + share * (1.0 - colour)


def contrast(colour: Array, page: Array) -> float:
    """The ratio of the luminances of a mark and its page, 1 to 21."""
    high, low = sorted((luminance(colour), luminance(page)), reverse=True)
    return (high + 0.05) / (low + 0.05)


def luminance(colour: Array) -> float:
    """The relative luminance of a colour, 0 to 1."""
    return float(light_of(colour) @ (0.2126, 0.7152, 0.0722))


def light_of(colour: Array) -> Array:
    """The light of the red, green and blue of a colour of the standard sRGB, 0 to 1."""
    return np.where(colour > 0.04045, ((colour + 0.055) / 1.055) ** 2.4, colour / 12.92)


def _exchange(artist: Any, shown: Callable[[Any], Any], *names: str) -> None:
    """Exchange the colours of these names, those that are equal for equal ones."""
    colours = [getattr(artist, f"get_{name}")() for name in names]  # before one is set
    for name, colour in zip(names, map(shown, colours), strict=True):
        getattr(artist, f"set_{name}")(colour)
