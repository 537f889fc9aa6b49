"""How the user wants a picture to look: size, type, title, style, limits. No matplotlib
until a style is read."""

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
from nsdrill.units import QuantityError, asked

INCH = 0.0254  # m
WIDTHS = (1.0, 40.0)  # inches
TYPE_SIZES = (3.0, 40.0)  # points

Ends = tuple[Any, Any]  # numbers in SI, texts with a unit, or None for an open end


@dataclass(frozen=True)
class Look:
    """How the user wants a picture to look; None leaves it to the kind of picture.

    ``width`` and ``height`` in inches, ``font_size`` in points, ``title`` a text or
    False for none; ``style`` holds settings of matplotlib. ``xlim``: the ends of the x
    axis; ``time``: the part of a trace that is drawn.
    """

    width: float | None = None
    height: float | None = None
    font_size: float | None = None
    title: str | bool | None = None
    style: Mapping[str, Any] | None = None
    xlim: Ends | None = None
    time: Ends | None = None


look: ContextVar[Look] = ContextVar("look", default=Look())  # noqa: B039, as a Look is frozen


def look_of(
    width: Any = None,
    height: Any = None,
    font_size: Any = None,
    title: Any = None,
    style: Any = None,
    xlim: Any = None,
    time: Any = None,
) -> Look:
    """A look from what the user gave: lengths as texts with a unit or numbers in m,
    ``font_size`` in points, as a number or "8 pt", ``style`` the name of a style file
    or of a style of matplotlib, or a mapping of settings."""
    return Look(
        _length("width", width),
        _length("height", height),
        _type_size(font_size),
        _title(title),
        _style(style),
        _pair("xlim", xlim),
        _pair("time", time),
    )


def value_of(name: str, given: Any, units: str) -> float:
    """A quantity in SI ``units`` from a number or a text with a unit."""
    if isinstance(given, str):
        if units in ("", "1"):
            return _plain_number(name, given)
        try:
            return float(asked(given, units))
        except QuantityError as error:
            raise InputError(f"--{name}: {error}") from error
    if isinstance(given, int | float) and not isinstance(given, bool) and math.isfinite(given):
        return float(given)
    try:
        number = float(given)  # of numpy, say
    except (TypeError, ValueError):
        number = math.nan
    if isinstance(given, bool) or not math.isfinite(number):
        raise InputError(
            f"--{name}: found {given!r}; allowed: a number in SI units, or a text with its unit."
        )
    return number


def _plain_number(name: str, given: str) -> float:
    """The value of a quantity without a unit."""
    try:
        number = float(given)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise InputError(f"--{name}: found {given!r}; allowed: a number, as this axis has no unit.")
    return number


def _length(name: str, given: Any) -> float | None:
    if given is None:
        return None
    inches = value_of(name, given, "m") / INCH
    low, high = WIDTHS
    if not low <= inches <= high:
        raise InputError(
            f"--{name}: found {inches:.4g} in; allowed: {low:g} in to {high:g} in, "
            f"say 3.3in or 84mm."
        )
    return inches


def _type_size(given: Any) -> float | None:
    if given is None:
        return None
    text = str(given).strip().lower().removesuffix("pt").strip()
    low, high = TYPE_SIZES
    if not re.fullmatch(r"\d+(\.\d*)?|\.\d+", text) or not low <= float(text) <= high:
        raise InputError(
            f"--font-size: found {given!r}; allowed: points, {low:g} to {high:g}, say 8 or 8pt."
        )
    return float(text)


def _title(given: Any) -> str | bool | None:
    if given is None or given is True:
        return None
    if given is False or isinstance(given, str):
        return given
    raise InputError(f"--title: found {given!r}; allowed: a text, or False for none.")


def _pair(name: str, given: Any) -> Ends | None:
    if given is None:
        return None
    if isinstance(given, str) or not hasattr(given, "__len__") or len(given) != 2:
        raise InputError(
            f"--{name}: found {given!r}; allowed: two values, the lower and the upper end."
        )
    return given[0], given[1]


def _style(given: Any) -> Mapping[str, Any] | None:
    """The settings of a style; InputError with all that is wrong with it."""
    if given is None or isinstance(given, Mapping):
        return _checked(given) if given else None
    import matplotlib as mpl
    from matplotlib import style

    name = os.fspath(given) if isinstance(given, str | os.PathLike) else ""
    if not os.path.isfile(name):
        if name in style.available:
            return {**cast("dict[str, Any]", style.library[name])}
        names = [one for one in style.available if not one.startswith("_")]
        near = difflib.get_close_matches(str(given), names, 3, 0.4) or [
            "ggplot",
            "grayscale",
            "tableau-colorblind10",
        ]
        raise InputError(
            f"--style: found {given!r}, which is no file; allowed: a style file of matplotlib "
            f"(.mplstyle), or one of "
            f"its {len(names)} styles, say {', '.join(near)}. All of them: "
            "python -c 'import matplotlib.style as s; print(s.available)'"
        )
    faults = _Faults()
    log = logging.getLogger("matplotlib")
    log.addHandler(faults)
    passed_on, log.propagate = log.propagate, False
    try:
        found = mpl.rc_params_from_file(name, use_default_template=False)
    except (UnicodeDecodeError, OSError) as error:
        raise InputError(
            f"--style {name}: found no text ({error}); allowed: a style file of matplotlib."
        ) from error
    finally:
        log.propagate = passed_on
        log.removeHandler(faults)
    if faults.found:
        raise InputError(f"--style {name}: " + "; ".join(faults.found) + ".")
    if not found:
        raise InputError(
            f"--style {name}: found no setting; allowed: lines like 'font.size: 9' "
            f"(a .mplstyle file)."
        )
    return {**cast("dict[str, Any]", found)}


def _checked(given: Mapping[str, Any]) -> dict[str, Any]:
    """Settings given as a mapping, each known to matplotlib and valid."""
    import matplotlib as mpl

    try:
        return {**cast("dict[str, Any]", mpl.RcParams(given))}
    except (KeyError, ValueError) as error:
        raise InputError(
            f"--style: {error.args[0]}; allowed: settings of matplotlib, {{'font.size': 9}}."
        ) from error


class _Faults(logging.Handler):
    """What matplotlib says of a style file, which it tells a log and passes over."""

    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self.found: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        lines = [line.strip() for line in record.getMessage().splitlines() if line.strip()]
        if lines:
            self.found.append(re.sub(r"in file .*?,? (?=line \d)", "in ", lines[0]).rstrip(".,:("))
