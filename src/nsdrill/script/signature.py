"""What the signature of a model's function says: its states with their values at the
start, its parameters with their defaults, and whether it reads the time."""

from __future__ import annotations

import ast
import inspect
import keyword
import math
import re
import sys
from collections.abc import Mapping
from numbers import Real
from types import FunctionType
from typing import Any, NoReturn

import numpy as np

from nsdrill.compiler.language import definition
from nsdrill.equations.graph import Node
from nsdrill.errors import InputError
from nsdrill.records import dataclass
from nsdrill.units import QuantityError, plain_units, si_factor

TIME = "t"
FORM = "t if the time is read, the states with their values at the start, and after * the parameters with defaults"
LARGE = 1e12  # the greatest magnitude of a number without a range of its own


def fault_of_units(units: object) -> tuple[str, str] | None:
    """(what was found, what is allowed) of what cannot be the units of a number in SI; None
    of what can."""
    allowed = "SI units, as 'kg m^2', 'rad/s', '1', or none"
    if not isinstance(units, str):
        return f"units={units!r:.60}", allowed
    try:
        factor = si_factor(plain_units(units)) if units not in ("", "1") else 1.0
    except QuantityError:
        return f"the unit {units!r}, which is not known", allowed
    if factor != 1.0:
        return f"the unit {units!r}, of which one is {factor:g} in SI: numbers are in SI", allowed
    return None


def fault_of_scale(scale: float | None) -> tuple[str, str] | None:
    """As :func:`fault_of_units`, of a natural scale."""
    if scale is None or (isinstance(scale, Real) and 0.0 < scale < math.inf):
        return None
    return f"scale={scale!r:.60}", "a finite number above 0"


class number(float):
    """A default of a state or a parameter that says more than its value.

    Parameters
    ----------
    default : float
        The value [SI].
    units : str, optional
        SI units, as ``"kg m^2"``, or ``"1"`` of a ratio. Equations that add metres to
        newtons are refused; a number without units may stand for anything.
    meaning : str, optional
        In words.
    low, high : float
        The range, both ends included.
    scale : float, optional
        Of a state: its natural scale, a tenth of what it usually reaches; by default
        from a trial run.

    Returns
    -------
    number
        A float.

    Raises
    ------
    InputError
        Where the default is outside its range, or the unit is not known.

    Examples
    --------
    >>> nsdrill.number(0.1, "kg", "mass of the ball", low=1e-3) + 0.2
    0.30000000000000004
    """

    units: str
    is_ratio: bool  # known to have no dimension; its units are none
    meaning: str
    low: float
    high: float
    scale: float | None

    def __new__(
        cls,
        default: float,
        units: str = "",
        meaning: str = "",
        *,
        low: float = -LARGE,
        high: float = LARGE,
        scale: float | None = None,
    ) -> number:
        for name, value in {"default": default, "low": low, "high": high}.items():
            if isinstance(value, bool) or not isinstance(value, Real):
                _refuse_number(
                    f"{name}={value!r:.60}", "a number in SI, whose unit is a text of its own, as (5.0, 'm')"
                )
        made = super().__new__(cls, default)
        made.units, made.is_ratio = ("", True) if units == "1" else (units, False)
        made.meaning, made.low, made.high, made.scale = meaning, float(low), float(high), scale
        made._check()
        return made

    def _check(self) -> None:
        def refuse(found: str, allowed: str) -> NoReturn:
            _refuse_number(found, allowed, f"{float(self):g}, ...")

        if not isinstance(self.meaning, str):
            refuse(f"meaning={self.meaning!r:.60}", "a text")
        if not self.low <= self <= self.high:
            refuse(f"{float(self):g}, and a range from {self.low:g} to {self.high:g}", "a default within its range")
        if (fault := fault_of_scale(self.scale)) is not None:
            refuse(*fault)
        if (fault := fault_of_units(self.units)) is not None:
            refuse(*fault)

    def measured_in(self, units: str) -> number:
        """The same number in other units."""
        return number(self, units or "1", self.meaning, low=self.low, high=self.high, scale=self.scale)

    @property
    def told(self) -> tuple[object, ...]:
        """All of it, for a digest."""
        return float(self), self.units, self.low, self.high, self.scale


def called_from(module: str) -> str:
    """The file and the line from which a function of the module is called."""
    frame = sys._getframe(1)
    while frame.f_back is not None and frame.f_globals.get("__name__") in (module, __name__):
        frame = frame.f_back
    return f"{frame.f_code.co_filename}, line {frame.f_lineno}"


def _refuse_number(found: str, allowed: str, given: str = "...") -> NoReturn:
    """InputError with the line of the script that makes the number."""
    raise InputError(f"{called_from(__name__)}: nsdrill.number({given}): found {found}; allowed: {allowed}.")


@dataclass(frozen=True)
class Signature:
    """The ``function`` of a model as its signature declares it: the ``start`` of each
    state and the default of each parameter, by name and in their order, and whether the
    function is ``timed``."""

    function: FunctionType
    start: Mapping[str, number]
    parameters: Mapping[str, number]
    timed: bool

    @property
    def name(self) -> str:
        return self.function.__name__

    @property
    def where(self) -> str:
        """File, line and name, for messages."""
        code = self.function.__code__
        return f"{code.co_filename}, line {code.co_firstlineno}: {self.name}"

    def refuse(self, found: str, allowed: str) -> NoReturn:
        raise InputError(f"{self.where}: found {found}; allowed: {allowed}.")

    @property
    def returned(self) -> str:
        """File, line and name, as ``where``, of what the function returns last."""
        code = self.function.__code__
        lines = [node.lineno for node in ast.walk(definition(self.function)) if isinstance(node, ast.Return)]
        return f"{code.co_filename}, line {max(lines)}: {self.name}" if lines else self.where

    def slopes(self, found: object) -> dict[str, Any]:
        """What the function returned, by the names of the states."""
        if isinstance(found, (tuple, list)) and len(found) == len(self.start):
            found = dict(zip(self.start, found, strict=True))
        if isinstance(found, Mapping) and set(found) == set(self.start):
            return {name: found[name] for name in self.start}
        told = _slopes_found(found, self.start)
        hint = "" if self.parameters else ". A parameter stands after *, as (x=0.1, *, k=1.0)"
        raise InputError(
            f"{self.returned}: found {told}; allowed: the slope of each state, {', '.join(self.start)}, by its name or "
            f"in this order, as a dictionary or a tuple of values{hint}."
        )

    def called(
        self, function: Any, time: Any, states: Mapping[str, Any], parameters: Mapping[str, Any]
    ) -> dict[str, Any]:
        """The slopes that ``function``, this one or what was made of it, gives."""
        first = {TIME: time} if self.timed else {}
        return self.slopes(function(**first, **states, **parameters))


def _kind_of(found: object) -> str:
    if type(found) is Node:
        return "one value"
    return "an array" if isinstance(found, np.ndarray) else repr(found)[:80]


def _slopes_found(found: object, states: Mapping[str, number]) -> str:
    if not isinstance(found, Mapping):
        size = f"{len(found)} values" if isinstance(found, (tuple, list)) else _kind_of(found)
        return f"{size} as its slopes"
    lacking = [name for name in states if name not in found]
    surplus = [str(name) for name in found if name not in states]
    parts = [f"no slope of {', '.join(lacking)}"] if lacking else []
    parts += [f"a slope of {', '.join(surplus)}, which is no state"] if surplus else []
    return " and ".join(parts)


def signature_of(function: object) -> Signature:
    """The signature of a model's function; InputError where it is none."""
    if not isinstance(function, FunctionType):
        raise InputError(
            f"nsdrill.model: found {function!r:.80}; allowed: a function, as @nsdrill.model above its def."
        )
    of: dict[Any, list[inspect.Parameter]] = {}
    for one in inspect.signature(function).parameters.values():
        of.setdefault(one.kind, []).append(one)
    places, keywords = of.pop(inspect.Parameter.POSITIONAL_OR_KEYWORD, []), of.pop(inspect.Parameter.KEYWORD_ONLY, [])
    timed = bool(places) and places[0].name == TIME
    read = Signature(function, {}, {}, timed)
    states = places[1:] if timed else places
    if of or not states:
        read.refuse(f"({', '.join(map(str, inspect.signature(function).parameters.values()))})", FORM)
    _check_names(read, states, keywords)
    return Signature(
        function,
        {one.name: number_in(read, one) for one in states},
        {one.name: number_in(read, one) for one in keywords},
        timed,
    )


# Names that lanes have already, and that a trace or the start of a study has.
OF_LANES = frozenset({"time", "phase", "clock", "half_difference"})
OF_STATES = frozenset({"drive_angle", "drive_speed", "depth", "wob", "ensemble", "seed", "spread", "slice"})
NAME = re.compile(r"[A-Za-z]+(_?[A-Za-z0-9]+)*")
NAME_FORM = "letters, digits and single underscores between them, a letter first; no keyword of Python"


def is_name(name: object) -> bool:
    """Whether a script may give this name to what is then a key, a variable and a field."""
    return isinstance(name, str) and NAME.fullmatch(name) is not None and not keyword.iskeyword(name)


def _check_names(read: Signature, states: list[inspect.Parameter], keywords: list[inspect.Parameter]) -> None:
    for one in (*states, *keywords):
        if one.name == TIME:
            read.refuse("t that is not the first argument", FORM)
        if one.name in OF_LANES or (one in states and one.name in OF_STATES):
            read.refuse(f"the name {one.name}, which every run has already", "another name")
    for name in (read.name, *(one.name for one in (*states, *keywords))):
        if not is_name(name):
            read.refuse(f"the name {name}", NAME_FORM)


def number_in(read: Signature, one: inspect.Parameter, form: str = FORM) -> number:
    """The default of an argument; InputError where it has none, or no number."""
    if isinstance(one.default, number):
        return one.default
    if one.default is inspect.Parameter.empty:
        read.refuse(f"{one.name} without a default", form)
    if isinstance(one.default, bool) or not isinstance(one.default, Real) or not math.isfinite(one.default):
        read.refuse(f"{one.name} = {one.default!r:.60}", "a finite number, or nsdrill.number(value, units)")
    return number(float(one.default))
