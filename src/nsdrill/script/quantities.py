"""Quantities that a script measures of its own model, or of another
(:mod:`nsdrill.models.own_quantities`), as it declares them."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from types import FunctionType

from nsdrill.errors import InputError
from nsdrill.models.own_features import measure, read_again
from nsdrill.models.own_parts import remember
from nsdrill.models.own_quantities import MEASURED, Measured
from nsdrill.origin import origin_of
from nsdrill.script.dimensions import check_measured_of
from nsdrill.script.signature import NAME_FORM, fault_of_scale, fault_of_units, is_name, number


def measured(
    function: object,
    name: str,
    units: str,
    meaning: str,
    ends: Sequence[str],
    known: Sequence[Measured],
    scale: float | None = None,
) -> Measured:
    """A quantity as a script declares it; InputError where it is none."""
    if not isinstance(function, FunctionType):
        raise InputError(
            f"feature {name!r}: found {function!r:.80}; allowed: a function, as a decorator above its def."
        )
    found = Measured(name, function, None, tuple(ends or MEASURED), origin_of(function))
    if not is_name(name):
        found.refuse(f"the name {name!r}", NAME_FORM)
    kinds = {one.kind for one in inspect.signature(function).parameters.values()}
    if kinds - {inspect.Parameter.POSITIONAL_OR_KEYWORD}:
        found.refuse(f"the arguments {inspect.signature(function)}", "names alone, as (v, rub)")
    if any(one.name == name for one in known):
        found.refuse("another of this name", "one of each name")
    for fault in (fault_of_units(units), fault_of_scale(scale)):
        if fault is not None:
            found.refuse(*fault)
    return replace(found, about=number(0.0, units, meaning, scale=scale))


def ends_of(where: str, name: object, **wanted: bool) -> list[str]:
    """The ends of the features of a quantity that are wanted. InputError where they are no
    truths, or the decorator has a function in place of a name, which it would never measure."""
    if not isinstance(name, str):
        raise InputError(f"{where}: found {name!r:.80}; allowed: the name of a quantity, as @{where}('power', 'W').")
    for word, value in wanted.items():
        if not isinstance(value, bool):
            raise InputError(f"{where}({name!r}): found {word}={value!r:.60}; allowed: True or False.")
    ends = {"max": "greatest", "min": "least", "mean": "mean"}
    return [end for end, word in ends.items() if wanted[word]]


def feature(
    model: str,
    name: str,
    units: str = "",
    meaning: str = "",
    *,
    greatest: bool = False,
    least: bool = False,
    mean: bool = False,
    scale: float | None = None,
) -> Callable[[FunctionType], FunctionType]:
    """Measure a quantity of a model of nsdrill or of a package, as a decorator above a
    function. Of a model of a script it is that model's own ``feature``.

    Parameters
    ----------
    model : str
        The name of the model.
    name : str
        Of the quantity, which is in traces; features are ``name_max``, ``name_min`` and
        ``name_mean``.
    units, meaning : str, optional
        SI units, and what it is in words.
    greatest, least, mean : bool
        The features that there are; all of them unless one is true.
    scale : float, optional
        Its natural scale; by default a tenth of what it reaches at the model's defaults.

    Returns
    -------
    function
        A decorator. The arguments of its function are states, lane parameters and names of
        the equations.

    Raises
    ------
    InputError
        Where there is no such model or argument, or the name is taken.

    Examples
    --------
    >>> @nsdrill.feature("torsion", "power", "W", "power of the bit", mean=True)
    ... def power(bit_speed, bit_torque):
    ...     return bit_speed * bit_torque
    >>> short = {"model": "torsion", "simulation": {"transient": "0 s", "observe": "5 s"}}
    >>> bool(nsdrill.run(short, progress=False).power_mean > 0.0)
    True
    """

    ends = ends_of("nsdrill.feature", name, greatest=greatest, least=least, mean=mean)

    def decorated(function: FunctionType) -> FunctionType:
        made = measured(function, name, units, meaning, ends, (), scale)
        measure(model, made, check_measured_of)
        remember(f"features {model}", partial(read_again, model))
        return function

    return decorated
