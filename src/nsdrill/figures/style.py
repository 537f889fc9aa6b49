"""How the pictures look: palette, fonts, sizes. Nothing here reads data or draws a
curve.

Colours are Okabe and Ito's, which colour-blind readers can distinguish, and a pale
green for safe; each response also has a marker and a letter of its own, so that a
picture can be read in grey. The pages in a browser have the same colours.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from functools import cache
from typing import Any, cast

import matplotlib as mpl
import numpy as np
from matplotlib.colors import LinearSegmentedColormap, to_hex, to_rgb
from matplotlib.font_manager import FontProperties, findfont, fontManager, get_font
from matplotlib.patheffects import AbstractPathEffect, withStroke
from matplotlib.typing import ColorType

from nsdrill.data import Array, Attributes
from nsdrill.figures.look import Look, look
from nsdrill.models.model_description import Description
from nsdrill.models.registry import model_in
from nsdrill.models.responses import RESPONSE_KINDS, STALLED, Response
from nsdrill.models.responses import RESPONSES as CRITICAL
from nsdrill.records import dataclass

Property = Any  # what an artist of matplotlib, or a setting, takes by a name
Properties = dict[str, Property]
Dashes = str | tuple[float, tuple[float, ...]]  # the name of a style of lines, or where it starts and its lengths

FULL_WIDTH = 7.0  # inches: two columns of a journal page
RASTER_DPI = 300  # for PNG, and for the markers that are rasterised inside PDF and SVG
# Above this number a vector file is slow to open, so its markers become an image; the
# text stays text.
MANY_MARKERS = 20_000

BLUE, SKY, GREEN, ORANGE, VERMILLION = "#0072B2", "#56B4E9", "#009E73", "#E69F00", "#D55E00"
WINE, GREY, BLACK = "#882255", "#ABABAB", "#000000"
STALLED_GREY = "#2E2E2E"  # dark, and yet neither black nor what colour-blind readers see as wine
# Safe has one colour in every picture, and grey is what is not known.
SAFE_COLOUR = "#A3D58A"
ANY_HISTORY_COLOUR = "#3F9B57"  # deeper: safe whatever came before
STARTED_COLOUR = "#DDF0D2"  # paler: free, but not by the way in
BORDERLINE_COLOUR = "#F3E9C0"  # sand
SOME_STARTS_COLOUR = "#D9CDE6"  # of no response: free from some starts, and not from others
STICKS_ON_COLOUR = "#F7C97A"  # of stick-slip, paler: it may last
FIELD_BORDER = "#14462A"  # around what is allowed
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
    marker: str = "o"
    letters: str = ""


NO_RESPONSE = "no critical response"

NONE_DEFINED = "no response is defined for this model"
NONE_DEFINED_COLOUR = "#C9C9C9"  # nothing is said of safe or critical

# By the response bits. One response has its own colour, light and strong; two: a darker
# one; three: black. None is green, which readers take for safe. Stalled is dark grey, also
# where other histories or samples of a point have other responses.
_LOOKS = {0: (SAFE_COLOUR, "o"), 3: (WINE, "p"), 5: (BLUE, "P"), 6: (VERMILLION, "X")}
_DARKER = 0.6  # of the mean of two colours


def _look(bits: int, present: Sequence[Response]) -> tuple[str, str]:
    """The colour and the marker of these responses, which have the ``bits``."""
    if bits & STALLED:
        return STALLED_GREY, "v"
    if bits in _LOOKS:
        return _LOOKS[bits]
    if len(present) == 1:
        return present[0].colour, present[0].marker
    if len(present) > 2:
        return BLACK, "*"
    return to_hex(_DARKER * np.mean([to_rgb(one.colour) for one in present], axis=0)).upper(), "p"


def _styled(bits: int, responses: Mapping[str, Response]) -> ResponseStyle:
    """The style of those of the ``responses`` with these bits."""
    present = [response for response in responses.values() if response.bit & bits]
    name = " + ".join(response.words for response in present)
    look = _look(bits, present) if present else _LOOKS[0]
    return ResponseStyle(name or NO_RESPONSE, *look, "".join(response.letter for response in present))


# Those of a drill string, indexed by the response bits.
RESPONSES: tuple[ResponseStyle, ...] = tuple(_styled(bits, CRITICAL) for bits in range(16))


def styles_of(attrs: Attributes) -> tuple[ResponseStyle, ...]:
    """The styles of the combinations of responses of the model of a file with the root
    attributes ``attrs``, indexed by the response bits."""
    return _styles_of(model_in(attrs))


@cache
def _styles_of(model: Description) -> tuple[ResponseStyle, ...]:
    if not model.critical:
        return (ResponseStyle(NONE_DEFINED, NONE_DEFINED_COLOUR),)
    if not any(one.is_own for one in model.critical.values()):
        return RESPONSES
    return tuple(_styled(bits, model.critical) for bits in range(1 + sum(one.bit for one in model.critical.values())))


def lettered(styles: Iterable[ResponseStyle]) -> tuple[ResponseStyle, ...]:
    """The ``styles`` with their letters before the names, for the legends of pictures that
    have letters."""
    return tuple(replace(style, name=f"{style.letters} {style.name}".lstrip()) for style in styles)


# Of the kinds of a response, the first for none. Paul Tol's light colours: none of them
# stands for a response or a kind of motion.
KIND_COLOURS = ("#DDDDDD", "#77AADD", "#EEDD88", "#EE8866", "#FFAABB", "#BBCC33")
KIND_STYLES = {
    name: tuple(ResponseStyle(*look) for look in zip(response.words_of_kinds, KIND_COLOURS, strict=True))
    for name, response in RESPONSE_KINDS.items()
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


# Colours of what has the same response as something that has its colour already. Most
# are Paul Tol's.
FURTHER_COLOURS = (
    "#CCBB44", "#AA3377", "#EE6677", "#117733", "#332288", "#DDCC77", "#F0E442", "#7A5230",
)  # fmt: skip
GOODNESS = LinearSegmentedColormap.from_list("goodness", BAD_TO_GOOD)


def ink_on(colour: str) -> str:
    """Black or white, whichever is easier to read on ``colour``."""
    red, green, blue = (int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5))
    return BLACK if 0.299 * red + 0.587 * green + 0.114 * blue > 0.5 else "#FFFFFF"


@cache
def fallback_fonts() -> list[str]:
    """Fonts installed here that have the Chinese, Japanese and Korean characters that
    the standard one lacks."""
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


def settings(picture_look: Look) -> Properties:
    """The settings of matplotlib for a picture, later ones before earlier ones: the
    house style, what the running program has set in ``rcParams``, a style file, the
    options. What a matplotlibrc says does not count, so that a study has one picture on
    all machines."""
    rc, defaults, file = (cast("Properties", one) for one in (mpl.rcParams, mpl.rcParamsDefault, mpl.rcParamsOrig))
    users_settings = {
        name: rc[name]
        for name in rc
        if not name.startswith(_IGNORED_SETTINGS) and rc[name] not in (defaults[name], file[name])
    }
    chosen = {**users_settings, **(picture_look.style or {})}
    house_settings = {**RC, "font.sans-serif": [*RC["font.sans-serif"], *fallback_fonts()]}
    size = float(picture_look.font_size or chosen.get("font.size", FONT_SIZE))
    sizes = {"font.size": size, **{name: part * size for name, part in RELATIVE_FONT_SIZES.items()}}
    return {**house_settings, **chosen, **sizes} if picture_look.font_size else {**house_settings, **sizes, **chosen}


# Settings that do not affect a picture, and LaTeX, for which the texts are not written.
_IGNORED_SETTINGS = (
    "backend",
    "interactive",
    "toolbar",
    "webagg",
    "tk.",
    "docstring",
    "date.",
    "animation",
    "keymap",
    "text.usetex",
    "text.latex",
    "pgf.",
)


@contextmanager
def house_style(rc: Mapping[str, Property] | None = None) -> Iterator[None]:
    """:func:`settings` of the current look, or the settings ``rc`` of an existing
    picture, while the block runs; those of the caller afterwards."""
    settings_in_force = settings(look.get()) if rc is None else rc
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(cast("Property", settings_in_force))
        yield


def font_size(points: float) -> float:
    """The size [points] that corresponds, in this picture, to ``points`` in a picture
    of :data:`FONT_SIZE`."""
    return float(points / FONT_SIZE * mpl.rcParams["font.size"])


def halo(width: float, colour: ColorType = "white") -> list[AbstractPathEffect]:
    """The effect on words and lines that are to be read on every ground: a border
    ``width`` points wide."""
    return [withStroke(linewidth=width, foreground=colour)]


def page_width(default: float = FULL_WIDTH) -> float:
    """The width of the page [inches]: the user's, else ``default``."""
    width = look.get().width
    if width is None and (figsize := mpl.rcParams["figure.figsize"]) != mpl.rcParamsDefault["figure.figsize"]:
        width = float(figsize[0])
    return default if width is None else width


def cell_style(cells: int) -> Properties:
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
    rc = cast("Properties", mpl.rcParams)
    families = list(rc["font.family"])
    names = [name for family in families for name in rc.get(f"font.{family}", [family])]
    fonts = []
    for name in names:
        with suppress(ValueError):
            fonts.append(get_font(findfont(FontProperties(family=name), fallback_to_default=False)))
    fonts = fonts or [get_font(findfont(FontProperties(family=RC["font.sans-serif"])))]
    return "".join(
        dict.fromkeys(
            character
            for character in text
            if not character.isspace() and not any(font.get_char_index(ord(character)) for font in fonts)
        )
    )


@contextmanager
def using_look(picture_look: Look) -> Iterator[None]:
    """Make this the current look while the block runs."""
    token = look.set(picture_look)
    try:
        yield
    finally:
        look.reset(token)


# Colours as an eye sees them.


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


def further_colour(used: Iterable[str]) -> str:
    """The one of :data:`FURTHER_COLOURS` that differs most from those ``used``, in
    lightness more than in hue, so that it does in grey too."""
    places = [lightness_and_hue(colour) for colour in used]

    def distance(colour: str) -> float:
        return min(float(np.linalg.norm((lightness_and_hue(colour) - place) * (2, 1, 1))) for place in places)

    return max(FURTHER_COLOURS, key=distance)


def lightness_and_hue(colour: str) -> Array:
    """The coordinates L*, a*, b* of a colour, whose distances are those that an eye
    sees; about 2 can just be told apart side by side (CIE 1976, white of D65)."""
    x, y, z = np.cbrt(
        np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
        @ light_of(np.array(to_rgb(colour)))
        / (0.9505, 1.0, 1.089)
    )
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])
