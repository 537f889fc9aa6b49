"""How the user wants a picture to look: size, type, title, style; and the part of the data
that is drawn where an axis or the time is limited. matplotlib is imported only where a
style is read."""

from __future__ import annotations

import difflib
import logging
import math
import os
import re
from collections.abc import Iterable, Mapping
from contextvars import ContextVar
from typing import TYPE_CHECKING, SupportsFloat, cast

import numpy as np

from nsdrill.data import Array, Results, Trace
from nsdrill.errors import InputError, Refusal, option
from nsdrill.figures.picture_kinds import Kind, load_matplotlib
from nsdrill.figures.slices import edges, taken
from nsdrill.models.choices import words_along
from nsdrill.quantity import quantity as base_quantity
from nsdrill.records import dataclass
from nsdrill.units import QuantityError, parse_with_unit
from nsdrill.words.labels import quantity

if TYPE_CHECKING:
    from nsdrill.figures.picture_kinds import Drawable

INCH = 0.0254  # m
WIDTH_RANGE = (1.0, 40.0)  # inches
FONT_SIZE_RANGE = (3.0, 40.0)  # points

End = float | str | None
Ends = tuple[End, End]  # numbers in SI, texts with a unit, or None for an open end


@dataclass(frozen=True)
class Look:
    """How the user wants a picture to look; what is None is chosen by the kind.

    ``width`` and ``height`` in inches, ``font_size`` in points, ``title`` a text or
    False for none; ``warnings`` whether a window has its own, which a page that has them
    besides does not need; ``alone`` is True where one panel is drawn without its page; ``style``
    holds settings of matplotlib. ``xlim`` and ``ylim``: the ends of the axes; ``time``: the part
    of a trace that is drawn.
    """

    width: float | None = None
    height: float | None = None
    font_size: float | None = None
    title: str | bool | None = None
    style: Mapping[str, object] | None = None
    xlim: Ends | None = None
    time: Ends | None = None
    ylim: Ends | None = None
    warnings: bool = True
    alone: bool = False


look: ContextVar[Look] = ContextVar("look", default=Look())  # noqa: B039, as a Look is frozen


def look_of(
    width: object = None,
    height: object = None,
    font_size: object = None,
    title: object = None,
    style: object = None,
    xlim: object = None,
    time: object = None,
    ylim: object = None,
) -> Look:
    """The look that the user asks for: lengths as texts with a unit or numbers in m,
    ``font_size`` in points, as a number or "8 pt", ``style`` the name of a style file
    or of a style of matplotlib, or a mapping of settings."""
    return Look(
        _length("width", width),
        _length("height", height),
        _font_size(font_size),
        _title(title),
        _style(style),
        _two_ends("xlim", xlim),
        _two_ends("time", time),
        _two_ends("ylim", ylim),
    )


def value_of(name: str, value: object, units: str) -> float:
    """A quantity in SI ``units`` from a number or a text with a unit."""
    if isinstance(value, str) and units not in ("", "1"):
        try:
            return float(parse_with_unit(value, units))
        except QuantityError as error:
            raise InputError(f"{option(name)}: {error}") from error
    try:
        number = float(value) if isinstance(value, str | SupportsFloat) and not isinstance(value, bool) else math.nan
    except (TypeError, ValueError):
        number = math.nan
    if not math.isfinite(number):
        allowed = "a number in SI units, or a text with its unit"
        allowed = "a number, as this axis has no unit" if isinstance(value, str) else allowed
        raise InputError(f"{option(name)}: found {value!r}; allowed: {allowed}.")
    return number


def _length(name: str, value: object) -> float | None:
    if value is None:
        return None
    inches = value_of(name, value, "m") / INCH
    low, high = WIDTH_RANGE
    if not low <= inches <= high:
        raise InputError(
            f"{option(name)}: found {inches:.4g} in; allowed: {low:g} in to {high:g} in, say 3.3in or 84mm."
        )
    return inches


def _font_size(value: object) -> float | None:
    if value is None:
        return None
    text = str(value).strip().lower().removesuffix("pt").strip()
    low, high = FONT_SIZE_RANGE
    if not re.fullmatch(r"\d+(\.\d*)?|\.\d+", text) or not low <= float(text) <= high:
        raise Refusal("font_size", f"{value!r}", f"points, {low:g} to {high:g}, say 8 or 8pt")
    return float(text)


def _title(value: object) -> str | bool | None:
    if value is None or value is True:
        return None
    if value is False or isinstance(value, str):
        return value
    raise Refusal("title", f"{value!r}", "a text, or False for none")


def _two_ends(name: str, value: object) -> Ends | None:
    if value is None:
        return None
    ends = tuple(value) if isinstance(value, Iterable) and not isinstance(value, str) else ()
    if len(ends) != 2:
        raise InputError(f"{option(name)}: found {value!r}; allowed: two values, the lower and the upper end.")
    return ends[0], ends[1]


def _style(value: object) -> Mapping[str, object] | None:
    """The settings of a style, from a mapping, a file or the name of a style of
    matplotlib. The InputError of a faulty file names all its faults."""
    if value is None or isinstance(value, Mapping):
        return _without_latex(_checked_settings(value)) if value else None
    load_matplotlib()
    import matplotlib as mpl
    from matplotlib import style as mpl_style

    name = os.fspath(value) if isinstance(value, str | os.PathLike) else ""
    if not os.path.isfile(name):
        if name in mpl_style.available:
            return _without_latex(dict(cast("Mapping[str, object]", mpl_style.library[name])))
        names = [style_name for style_name in mpl_style.available if not style_name.startswith("_")]
        near = difflib.get_close_matches(str(value), names, 3, 0.4) or ["ggplot", "grayscale", "tableau-colorblind10"]
        raise InputError(
            f"{option('style')}: found {value!r}, which is no file; allowed: a style file of matplotlib (.mplstyle), "
            f"or one of its {len(names)} styles, say {', '.join(near)}. All of them: python -c 'import "
            "matplotlib.style as s; print(s.available)'"
        )
    messages = _LogMessages()
    log = logging.getLogger("matplotlib")
    log.addHandler(messages)
    propagate, log.propagate = log.propagate, False
    try:
        settings = mpl.rc_params_from_file(name, use_default_template=False)
    except (UnicodeDecodeError, OSError) as error:
        raise InputError(
            f"{option('style')} {name}: found no text ({error}); allowed: a style file of matplotlib."
        ) from error
    finally:
        log.propagate = propagate
        log.removeHandler(messages)
    if messages.texts:
        raise InputError(f"{option('style')} {name}: " + "; ".join(messages.texts) + ".")
    if not settings:
        raise InputError(
            f"{option('style')} {name}: found no setting; allowed: lines like 'font.size: 9' (a .mplstyle file)."
        )
    return _without_latex(dict(cast("Mapping[str, object]", settings)))


def _without_latex(settings: Mapping[str, object]) -> Mapping[str, object]:
    """``settings``; InputError where they ask for LaTeX."""
    if settings.get("text.usetex"):
        raise InputError(
            f"{option('style')}: found text.usetex: True; allowed: False, as the words of pictures are not written for "
            "LaTeX. Its letters without it: font.family: serif, mathtext.fontset: cm."
        )
    return settings


def _checked_settings(settings: Mapping[str, object]) -> Mapping[str, object]:
    """Settings given as a mapping, each known to matplotlib and valid."""
    load_matplotlib()
    import matplotlib as mpl

    try:
        return dict(cast("Mapping[str, object]", mpl.RcParams(settings)))
    except (KeyError, ValueError) as error:
        raise InputError(
            f"{option('style')}: {error.args[0]}; allowed: settings of matplotlib, {{'font.size': 9}}."
        ) from error


class _LogMessages(logging.Handler):
    """Collects what matplotlib logs about a style file: it warns of bad lines, and
    skips them."""

    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self.texts: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        lines = [line.strip() for line in record.getMessage().splitlines() if line.strip()]
        if lines:
            self.texts.append(re.sub(r"in file .*?,? (?=line \d)", "in ", lines[0]).rstrip(".,:("))


# What has no effect in axes of the user, and what has instead.
OF_A_FIGURE = {
    "width": "The figure has its size from plt.subplots(figsize=(width, height)), in inches.",
    "height": "The figure has its size from plt.subplots(figsize=(width, height)), in inches.",
    "style": "Make the axes in a style: with plt.style.context(...): figure, ax = plt.subplots().",
    "title": "Give it to the axes: ax.set_title(...).",
}


def refuse_with_axes(look: Look) -> None:
    """A Refusal of what belongs to the figure where axes of the user are given; no title
    is what they have."""
    for name, hint in OF_A_FIGURE.items():
        if getattr(look, name) not in (None, False):
            raise Refusal(name, "with ax, whose figure has its own", "without ax", hint)


# Kinds that say something of the whole sweep keep all its points; only their axes are
# limited.
UNCUT_KINDS = ("window",)
BESIDE = ("axes fraction", "data")  # the place of words beside a panel, at a height


def apply_limits(data: Drawable, kind: Kind, look: Look) -> tuple[Drawable, tuple[float, float] | None]:
    """``data`` without what lies outside the limits, so that the other axes fit what is
    shown, and the ends of the x axis in SI, None where the picture chooses them."""
    if look.time is not None:
        if not isinstance(data, Trace):
            raise Refusal("time", "with results", "with a trace", f"{option('xlim')} limits an axis.")
        data = between(data, look.time)
    if look.xlim is None:
        return data, None
    across = kind.across(data)
    if across is None:
        raise InputError(
            f"{option('xlim')}: found with {option('kind', kind.name)}, whose panels have no x axis in common; "
            "allowed: with kinds along an axis or over time, and with maps."
        )
    if isinstance(data, Trace) and across == "time":
        data = between(data, look.xlim, "xlim")
        return data, None
    low, high = resolve_ends("xlim", look.xlim, base_quantity(across).units)
    if isinstance(data, Results) and kind.name not in UNCUT_KINDS:
        data = _cells_between(data, across, low, high)
    return data, (low, high)


def resolve_ends(
    name: str, ends: Ends, units: str, least: float = -np.inf, greatest: float = np.inf
) -> tuple[float, float]:
    """The two ``ends`` as numbers in SI ``units``, an open one as ``least`` or
    ``greatest``. InputError where an end is not a number, or they do not ascend."""
    low, high = (
        open_end if value is None else value_of(name, value, units)
        for value, open_end in zip(ends, (least, greatest), strict=True)
    )
    if None not in ends and not low < high:
        found = (
            " to ".join(map(str, ends)) if all(isinstance(end, str) for end in ends) else f"{low:g} to {high:g} {units}"
        )
        raise InputError(f"{option(name)}: found {found}; allowed: the lower end first.")
    return low, high


def between(trace: Trace, ends: Ends, name: str = "time") -> Trace:
    """The samples of a trace between two times."""
    if not len(trace.time):
        return trace
    first, last = float(trace.time[0]), float(trace.time[-1])
    low, high = resolve_ends(name, ends, "s", first, last)
    chosen = (trace.time >= low - 1e-9) & (trace.time <= high + 1e-9)
    if np.count_nonzero(chosen) < 2:
        raise InputError(
            f"{option(name)}: found {low:g} s to {high:g} s; allowed: times with two samples or more between them, of "
            f"{first:g} s to {last:g} s."
        )
    variables = {key: values[chosen] for key, values in trace.variables.items()}
    return Trace(trace.time[chosen], variables, trace.attrs)


def _cells_between(data: Results, axis: str, low: float, high: float) -> Results:
    """The points whose cells reach into the limits."""
    if words_along(axis):
        raise Refusal("xlim", f"limits of {axis}, which has words", f"{option('at')} to select one of them")
    values: Array = np.asarray(data.coords[axis], dtype=float)
    borders = edges(values)
    chosen = np.flatnonzero((borders[1:] > low) & (borders[:-1] < high))
    if len(chosen) < 2:
        x = quantity(axis)
        raise InputError(
            f"{option('xlim')}: found {x.value(low)} to {x.value(high)}; allowed: limits with two points of the sweep "
            f"or more between them, of {x.value(values[0])} to {x.value(values[-1])}."
        )
    return taken(data, axis, chosen)
