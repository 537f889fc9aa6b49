"""How the user wants a picture to look: size, type, title, style, limits. matplotlib
is imported only where a style is read."""

from __future__ import annotations

import difflib
import logging
import math
import os
import re
from collections.abc import Mapping
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Any, cast

from nsdrill.errors import InputError
from nsdrill.units import QuantityError, parse_with_unit

INCH = 0.0254  # m
WIDTH_RANGE = (1.0, 40.0)  # inches
FONT_SIZE_RANGE = (3.0, 40.0)  # points

Ends = tuple[Any, Any]  # numbers in SI, texts with a unit, or None for an open end


@dataclass(frozen=True)
class Look:
    """How the user wants a picture to look; what is None is chosen by the kind.

    ``width`` and ``height`` in inches, ``font_size`` in points, ``title`` a text or
    False for none; ``style`` holds settings of matplotlib. ``xlim`` and ``ylim``: the
    ends of the axes; ``time``: the part of a trace that is drawn.
    """

    width: float | None = None
    height: float | None = None
    font_size: float | None = None
    title: str | bool | None = None
    style: Mapping[str, Any] | None = None
    xlim: Ends | None = None
    time: Ends | None = None
    ylim: Ends | None = None


look: ContextVar[Look] = ContextVar("look", default=Look())  # noqa: B039, as a Look is frozen


def look_of(
    width: Any = None,
    height: Any = None,
    font_size: Any = None,
    title: Any = None,
    style: Any = None,
    xlim: Any = None,
    time: Any = None,
    ylim: Any = None,
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


def value_of(name: str, value: Any, units: str) -> float:
    """A quantity in SI ``units`` from a number or a text with a unit."""
    if isinstance(value, str):
        if units in ("", "1"):
            return _plain_number(name, value)
        try:
            return float(parse_with_unit(value, units))
        except QuantityError as error:
            raise InputError(f"--{name}: {error}") from error
    if isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value):
        return float(value)
    try:
        number = float(value)  # a number of numpy, for example
    except (TypeError, ValueError):
        number = math.nan
    if isinstance(value, bool) or not math.isfinite(number):
        raise InputError(
            f"--{name}: found {value!r}; allowed: a number in SI units, or a text with its unit."
        )
    return number


def _plain_number(name: str, text: str) -> float:
    """The value of a quantity without a unit."""
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise InputError(f"--{name}: found {text!r}; allowed: a number, as this axis has no unit.")
    return number


def _length(name: str, value: Any) -> float | None:
    if value is None:
        return None
    inches = value_of(name, value, "m") / INCH
    low, high = WIDTH_RANGE
    if not low <= inches <= high:
        raise InputError(
            f"--{name}: found {inches:.4g} in; allowed: {low:g} in to {high:g} in, "
            f"say 3.3in or 84mm."
        )
    return inches


def _font_size(value: Any) -> float | None:
    if value is None:
        return None
    text = str(value).strip().lower().removesuffix("pt").strip()
    low, high = FONT_SIZE_RANGE
    if not re.fullmatch(r"\d+(\.\d*)?|\.\d+", text) or not low <= float(text) <= high:
        raise InputError(
            f"--font-size: found {value!r}; allowed: points, {low:g} to {high:g}, say 8 or 8pt."
        )
    return float(text)


def _title(value: Any) -> str | bool | None:
    if value is None or value is True:
        return None
    if value is False or isinstance(value, str):
        return value
    raise InputError(f"--title: found {value!r}; allowed: a text, or False for none.")


def _two_ends(name: str, value: Any) -> Ends | None:
    if value is None:
        return None
    if isinstance(value, str) or not hasattr(value, "__len__") or len(value) != 2:
        raise InputError(
            f"--{name}: found {value!r}; allowed: two values, the lower and the upper end."
        )
    return value[0], value[1]


def _style(value: Any) -> Mapping[str, Any] | None:
    """The settings of a style, from a mapping, a file or the name of a style of
    matplotlib. The InputError of a faulty file names all its faults."""
    if value is None or isinstance(value, Mapping):
        return _checked_settings(value) if value else None
    import matplotlib as mpl
    from matplotlib import style as mpl_style

    name = os.fspath(value) if isinstance(value, str | os.PathLike) else ""
    if not os.path.isfile(name):
        if name in mpl_style.available:
            return {**cast("dict[str, Any]", mpl_style.library[name])}
        names = [style_name for style_name in mpl_style.available if not style_name.startswith("_")]
        near = difflib.get_close_matches(str(value), names, 3, 0.4) or [
            "ggplot",
            "grayscale",
            "tableau-colorblind10",
        ]
        raise InputError(
            f"--style: found {value!r}, which is no file; allowed: a style file of matplotlib "
            f"(.mplstyle), or one of "
            f"its {len(names)} styles, say {', '.join(near)}. All of them: "
            "python -c 'import matplotlib.style as s; print(s.available)'"
        )
    messages = _LogMessages()
    log = logging.getLogger("matplotlib")
    log.addHandler(messages)
    propagate, log.propagate = log.propagate, False
    try:
        settings = mpl.rc_params_from_file(name, use_default_template=False)
    except (UnicodeDecodeError, OSError) as error:
        raise InputError(
            f"--style {name}: found no text ({error}); allowed: a style file of matplotlib."
        ) from error
    finally:
        log.propagate = propagate
        log.removeHandler(messages)
    if messages.texts:
        raise InputError(f"--style {name}: " + "; ".join(messages.texts) + ".")
    if not settings:
        raise InputError(
            f"--style {name}: found no setting; allowed: lines like 'font.size: 9' "
            f"(a .mplstyle file)."
        )
    return {**cast("dict[str, Any]", settings)}


def _checked_settings(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Settings given as a mapping, each known to matplotlib and valid."""
    import matplotlib as mpl

    try:
        return {**cast("dict[str, Any]", mpl.RcParams(settings))}
    except (KeyError, ValueError) as error:
        raise InputError(
            f"--style: {error.args[0]}; allowed: settings of matplotlib, {{'font.size': 9}}."
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
