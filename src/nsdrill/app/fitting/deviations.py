"""How far a measured value and the model may be apart: the standard deviations of
measurements, given or assumed."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from nsdrill.analysis.fitting import ONE_SETTING, Measured
from nsdrill.app.fitting.names import Names
from nsdrill.app.fitting.tables import number as cell_number
from nsdrill.data import Array
from nsdrill.errors import InputError, count, option
from nsdrill.ranges import bound_text
from nsdrill.units import JOINED, QuantityError, to_si

# assumed error: share of the value, of the range of its signal, and of its size
RELATIVE, OF_RANGE, ABSOLUTE = 0.05, 0.05, 0.02
LEAST = 0.1  # of that of its size, the error of an extreme of a signal that does not vary
GRADE = 0.5  # assumed error of a severity


def assumed_errors(
    names: Names, settings: dict[str, Array], values: dict[str, Array], assumed: Sequence[str]
) -> dict[str, Array]:
    """The standard deviations of the values that are ``assumed``, by name. An extreme is as
    uncertain as its signal varies at that point, whatever its own size; any other value as
    its size, and that of its signal. One that is 0 throughout, of a signal without a
    natural scale, has the error 0."""
    sizes = names.sizes(settings, values)
    errors = {}
    for name in assumed:
        column = values[name]
        if name not in names.features:
            errors[name] = np.full(column.shape, GRADE)
            continue
        size = np.full(column.shape, ABSOLUTE * sizes[name])
        extremes = [values[one] for one in _extremes_beside(name) if one in values]
        if len(extremes) == 2:  # a signal that hardly varies is known no better than its sensor knows it
            varies = np.maximum(OF_RANGE * (extremes[1] - extremes[0]), LEAST * size)
            size = np.where(np.isfinite(varies), varies, size)
        errors[name] = np.hypot(RELATIVE * column, size)
    return errors


def words_of_assumed(names: Sequence[str]) -> str:
    """What was assumed of the values ``names``, in words."""
    return (
        f"error assumed of {', '.join(names)}: {100 * RELATIVE:g} % of the value and {100 * ABSOLUTE:g} % of the "
        f"greatest of its signal (of a fraction, of 1), of extremes {100 * OF_RANGE:g} % of the range of their signal "
        f"at that point, of severities {GRADE}; {option('errors')} or a column NAME_error gives it"
    )


def words_of_repeated(measured: Measured) -> list[str]:
    """Of points that share settings how many settings they are, and what of their errors."""
    settings = int(measured.settings.max(initial=0)) + 1
    if settings == measured.points:
        return []
    said = f"{measured.points} operating points are {count(settings, 'setting')}, equal within {100 * ONE_SETTING:g} %"
    if not measured.assumed:
        return [said]
    return [
        f"{said}: the error assumed is common to the points at one setting, and does not average out over them; one "
        f"that does is given by {option('errors')} or a column NAME_error"
    ]


def _extremes_beside(name: str) -> tuple[str, ...]:
    """The least and the greatest value of the signal of an extreme; none for other values."""
    for end in ("_min", "_max"):
        if name.endswith(end):
            return f"{name.removesuffix(end)}_min", f"{name.removesuffix(end)}_max"
    return ()


def given_errors(name: str, text: str | float, si: str, values: Array, most: float) -> Array:
    """The standard deviations of ``values`` from an option: a quantity, a percentage of
    the values, or a number in SI; none is above ``most``."""
    if not isinstance(text, str):
        if isinstance(text, bool) or not isinstance(text, int | float | np.number) or not 0 < text < math.inf:
            raise InputError(
                f"errors, {name}: found {text!r}; allowed: a number above 0 in SI{f' [{si}]' if si else ''}, or a text "
                "with its unit or in percent."
            )
        return _not_above(most, np.full(values.shape, float(text)), name, text, si)
    cleaned = text.replace("%", "percent").strip()
    try:
        is_percentage = cleaned.endswith("percent") and si != "percent"
        number = (
            cell_number(cleaned.removesuffix("percent"))
            if is_percentage or si in ("", "percent")
            else to_si(JOINED.sub("*", cleaned), si)
        )
        if number is None or not 0 < number < math.inf:
            raise ValueError
    except QuantityError as error:
        raise InputError(f"{option('errors')} {name}: {error}") from error
    except ValueError:
        raise InputError(
            f"{option('errors')} {name}: found {text!r}; allowed: a number above 0 with its unit, or percent."
        ) from None
    errors = number / 100 * np.abs(values) if is_percentage else np.full(values.shape, number)
    if np.any(errors <= 0):
        raise InputError(f"{option('errors')} {name}: found {text!r} of a value of 0; allowed: an error above 0.")
    return _not_above(most, errors, name, text, si)


def _not_above(most: float, errors: Array, name: str, found: object, si: str) -> Array:
    if np.any(errors > most):
        at_most = f"{bound_text(most)} {si}".rstrip()
        raise InputError(f"{option('errors')} {name}: found {found!r}; allowed: an error of at most {at_most}.")
    return errors
