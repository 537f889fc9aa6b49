"""What the equations of a script may call besides Python and numpy: contacts with and
without friction, and laws of friction."""

from __future__ import annotations

import ast
import inspect
from collections.abc import Callable, Mapping
from numbers import Real
from types import FunctionType
from typing import Any, NoReturn, overload

import numpy as np

from nsdrill.compiler.language import definition
from nsdrill.equations import library, plain
from nsdrill.equations.graph import Graph, Node, Number, text_of
from nsdrill.equations.trace import Inputs, Named, check_text, evaluated, part, refuse_to_change
from nsdrill.errors import InputError
from nsdrill.models.friction import (
    LAWS,
    SLIP_UNITS,
    KeyedLaw,
    Numbers,
    ScriptLaw,
    law_keys_taken,
    laws,
    own_law,
    register_law,
)
from nsdrill.models.own_parts import remember
from nsdrill.origin import origin_of
from nsdrill.script.signature import NAME_FORM, Signature, called_from, is_name, number, number_in

LawFunction = Callable[[Any, Any], Any]


def friction(
    name: str,
    *,
    slip: Number,
    normal: Number,
    law: str = "hyperbolic",
    smoothing: Number,
    static: Number,
    dynamic: Number | None = None,
    decay: Number | None = None,
    **numbers: Number,
) -> Any:
    """The load against a slip, from a contact with friction: a coefficient that falls as the
    slip grows, times the normal load. Observed is how long the contact is stuck.

    Parameters
    ----------
    name : str
        The name of the contact.
    slip : value
        The slip [m/s], or [rad/s] where the load is a torque.
    normal : value
        The normal load [N], of a torque with its arm [N m].
    law : str, default "hyperbolic"
        One of the laws of friction, or one of :func:`law`.
    smoothing : value
        The steepness of the direction through zero [s/m].
    static, dynamic : value
        The coefficient at small and at large slips; ``dynamic`` is by default as
        ``static``.
    decay : value, default 0
        The rate of the fall [s/m].
    numbers : value
        Those that a ``law`` of :func:`law` has of its own, by default its defaults.

    Returns
    -------
    value
        The load [N], with the sign of the slip.

    Raises
    ------
    InputError
        Where there is no such law, it does not read a number, one is below zero, or
        ``dynamic`` is above ``static``.

    Examples
    --------
    >>> round(nsdrill.friction("belt", slip=-1.0, normal=2.0, static=0.5, smoothing=1e9), 6)
    -1.0
    """
    known = laws()
    if law not in known:
        raise InputError(
            f"nsdrill.friction({name!r}): found the law {law!r}; allowed: {', '.join(known)}, or one of nsdrill.law."
        )
    least = static if dynamic is None else dynamic
    judged = {
        "smoothing": smoothing,
        "normal": normal,
        "static": static,
        "dynamic": least,
        "decay": 0.0 if decay is None else decay,
    }
    for what, value in judged.items():
        if not isinstance(value, Node) and not value >= 0.0:
            place = "" if isinstance(slip, Node) else f"{called_from(__name__)}: "  # else the equations have one
            raise InputError(
                f"{place}nsdrill.friction({name!r}): found {what}={value!r}; allowed: a number of at least 0."
            )
    _check_read(name, law, known[law], numbers | ({} if decay is None else {"decay": decay}))
    if dynamic is not None and "static" not in known[law].keys:
        raise InputError(
            f"nsdrill.friction({name!r}): found static and dynamic, and the law {law} has one coefficient at all "
            "slips; allowed: static alone."
        )
    if law in LAWS and dynamic is None and decay is not None and (isinstance(decay, Node) or decay):
        raise InputError(
            f"nsdrill.friction({name!r}): found decay without dynamic, so that nothing falls; allowed: dynamic as "
            "well, the coefficient to which the law falls from static, or neither."
        )
    if not isinstance(static, Node) and not isinstance(least, Node) and least > static:
        raise InputError(
            f"nsdrill.friction({name!r}): found dynamic={least!r} above static={static!r}; allowed: at most static, as "
            "the coefficient falls as the slip grows."
        )
    if isinstance(smoothing, Node) and smoothing.graph.changes(smoothing):
        smoothing.graph.refuse(
            f"found a smoothing of the friction {name!r} that changes in time; allowed: a number, or one of "
            "parameters, as whether the contact is stuck is told by it"
        )
    own = {one: float(value) for one, value in known[law].own.items()} | numbers
    given = Named(smoothing=smoothing, decay=0.0 if decay is None else decay, rise=static - least, dynamic=least, **own)
    if isinstance(slip, Node) and any(one.name == name for one in slip.graph.frictions):
        _refuse_another(slip.graph, name)
    return library.friction(_name(name), slip=slip, normal=normal, law=known[law], numbers=given)


def touching(name: str, gap: Number) -> Any:
    """How far a unilateral contact is closed. A force that begins at zero there, as a
    stiffness times it, does not jump, and exponent and branches are followed across.
    Observed is how long the contact is closed.

    Parameters
    ----------
    name : str
        The name of the contact.
    gap : value
        How deep it is [m]: positive where it is closed.

    Returns
    -------
    value
        The depth [m], 0 where it is open.

    Raises
    ------
    InputError
        Where the name is no word.

    Examples
    --------
    >>> nsdrill.touching("wall", -0.1), nsdrill.touching("wall", 0.2)
    (0.0, 0.2)
    """
    if isinstance(gap, Node) and gap.graph.gaps.get(name, gap) is not gap:
        _refuse_another(gap.graph, name)
    return library.touching(_name(name), gap)


def _check_read(name: str, word: str, law: KeyedLaw, given: Mapping[str, object]) -> None:
    """InputError where a law does not read one of the numbers that it is ``given``."""
    # keys of a study have other names than the numbers of these two
    reads = {"linear": ("decay",), "rational": ("decay",)}.get(word, law.keys)
    if idle := [one for one in given if one not in reads]:
        allowed = [one for one in ("decay", *law.own) if one in reads]
        raise InputError(
            f"nsdrill.friction({name!r}): found {idle[0]}, which the law {word} does not read; allowed: smoothing, "
            f"static, dynamic{''.join(f', {one}' for one in allowed)}."
        )


def _refuse_another(graph: Graph, name: str) -> NoReturn:
    graph.refuse(f"found a second contact with the name {name!r}; allowed: one of each name, as results have its name")


def _name(name: object) -> str:
    if not is_name(name):
        raise InputError(f"found a contact with the name {name!r}; allowed: {NAME_FORM}.")
    return str(name)


@overload
def law(function: LawFunction, *, fall: Callable[[Any], Any]) -> LawFunction: ...
@overload
def law(*, fall: Callable[[Any], Any]) -> Callable[[LawFunction], LawFunction]: ...
def law(function: Any = None, *, fall: Callable[[Any], Any] | None = None) -> Any:
    """Make a law of friction of a function, as a decorator above its ``def``. Its name is
    that of the function.

    Parameters
    ----------
    function : function
        ``law(v, n)``: the coefficient, with its sign, at a slip ``v``, from the numbers
        ``n.smoothing``, ``n.decay``, ``n.rise`` and ``n.dynamic``; after ``*`` numbers of its
        own with their defaults, keys of a study beside these. It is a multiple of rise and
        dynamic, as a bit has these times an arm.
    fall : function
        Of the numbers, its own among them: the steepest fall of the coefficient with the slip [s/m],
        without smoothing, or a bound of it.

    Returns
    -------
    function
        The function itself.

    Raises
    ------
    InputError
        Where there is a law of this name already, or at usual numbers the coefficient is
        not odd in the slip, no multiple of rise and dynamic, below 0, or falls more than
        ``fall`` says.

    Examples
    --------
    >>> from nsdrill.equations.library import tanh
    >>> @nsdrill.law(fall=lambda n: 0.0)
    ... def coulomb(v, n):
    ...     return n.dynamic * tanh(n.smoothing * v)
    >>> nsdrill.friction("belt", slip=1.0, normal=2.0, law="coulomb", static=0.5, smoothing=1e3)
    1.0
    """
    if function is None:
        return lambda one: law(one, fall=fall)  # type: ignore[arg-type]  # None is refused there
    name = getattr(function, "__name__", "")
    if not isinstance(function, FunctionType):
        raise InputError(f"nsdrill.law: found {function!r:.80}; allowed: a function, as a decorator above its def.")
    if name in LAWS:
        raise InputError(f"nsdrill.law: found the law {name}, which there is; allowed: another name.")
    own = _own_numbers(function)
    if fall is None:
        Signature(function, {}, {}, timed=False).refuse("no fall", "@nsdrill.law(fall=lambda n: n.rise * n.decay)")
    _check(function, fall, own)
    register_law(name, ScriptLaw(part(function), fall, origin_of(function), own))

    def again() -> None:
        before = own_law(name)
        assert before is not None
        made = ScriptLaw(part(function), fall, before.origin, own)
        if made.digest != before.digest:
            _check(function, fall, own)
            register_law(name, made)

    remember(f"law {name}", again)
    return function


FORM_OF_LAW = "the slip and the numbers, and after * numbers of its own with defaults"
USUAL = Numbers(smoothing=20.0, decay=0.7, rise=0.3, dynamic=0.5)  # at which a law is tried
SLIPS = np.geomspace(1e-3, 1e3, 61)  # [m/s]
SHARP = 1e12  # a smoothing of which nothing is left
ODD = 1e-9  # of the greatest coefficient
NEAR, ENOUGH = 1e-4, 1.01  # of a slip by which it differs from another, and of a fall that is a bound


def _own_numbers(function: FunctionType) -> dict[str, number]:
    """The numbers of its own of a law, InputError where one cannot be a key beside the
    others."""
    arguments = inspect.signature(function).parameters.values()
    read = Signature(function, {}, {}, timed=False)
    keywords = [one for one in arguments if one.kind is inspect.Parameter.KEYWORD_ONLY]
    if (places := [one.name for one in arguments if one not in keywords])[2:] or len(places) < 2:
        read.refuse(f"the arguments {', '.join(places)}", f"{FORM_OF_LAW}, (v, n, *, width=1.0)")
    taken = law_keys_taken()
    for one in keywords:
        if one.name in taken or not is_name(one.name):
            read.refuse(f"the name {one.name}", "another than those of friction, of letters, digits and underscores")
    own = {one.name: number_in(read, one, FORM_OF_LAW) for one in keywords}
    for name, value in own.items():
        if value.units not in SLIP_UNITS:
            read.refuse(f"{name} in {value.units}", f"of a slip in m/s none or {', '.join(filter(None, SLIP_UNITS))}")
    return own


def _check(function: FunctionType, fall: Callable[[Any], Any], own: Mapping[str, number]) -> None:
    """LanguageError, with its line, where a law does what lanes cannot. InputError where it
    is no coefficient of friction, or falls more than its author says, at usual numbers."""
    code = function.__code__

    def refuse(found: str, allowed: str) -> NoReturn:
        where = f"{code.co_filename}, line {code.co_firstlineno}: the law {function.__name__}"
        raise InputError(f"{where}: found {found}; allowed: {allowed}.")

    if wrong := sorted({name for name in _numbers_read(function) if name not in (*Numbers._fields, *own)}):
        known = ", ".join((*Numbers._fields, *own))
        allowed = f"those that a study gives a law, {known} (rise is static less dynamic), or after * its own"
        refuse(f"the number {wrong[0]}", allowed)
    if not callable(fall):
        refuse(f"fall={fall!r:.60}", "a function of the numbers, as fall=lambda n: n.rise * n.decay")
    check_text(function)

    def coefficient(graph: Graph) -> Node:
        n = Inputs(graph, (*Numbers._fields, *own), "n")
        found = evaluated(graph, function, graph.input("v"), n, **{name: getattr(n, name) for name in own})
        if not isinstance(found, Node):
            refuse(f"{found!r:.60} as its value", "one coefficient that depends on the slip and its smoothing")
        return graph.number(found)

    graph = Graph()
    found = coefficient(graph)
    if text_of({"": found}) != text_of({"": coefficient(Graph())}):
        refuse_to_change(function)
    inputs = graph.inputs_of([found])
    if lacking := [name for name in ("v", "n.smoothing") if name not in inputs]:
        refuse(f"a coefficient that does not depend on {lacking[0]}", "one that does, as direction(n.smoothing * v)")
    if idle := [name for name in own if f"n.{name}" not in inputs]:
        refuse(f"the number {idle[0]}, which the coefficient does not read", "numbers that it reads")

    moved = {name: float(np.clip(1.25 * value + 0.1, value.low, value.high)) for name, value in own.items()}

    def at(v: Any, numbers: Numbers, own: Mapping[str, float] = own) -> Any:
        given = {"v": v} | {f"n.{name}": value for name, value in {**numbers._asdict(), **own}.items()}
        with np.errstate(all="ignore"):
            return np.asarray(plain.values({"": found}, given)[""], float)

    one, other = at(SLIPS, USUAL), at(-SLIPS, USUAL)
    if not np.all(np.isfinite(one)) or np.any(one < 0.0):
        refuse("a coefficient below 0, or no number, at a slip above 0", "the sign of the slip: friction brakes")
    if not np.isfinite(at(0.0, USUAL)):
        refuse("a coefficient that is no number at the slip 0", "one that is: nothing of it divides by 0 there")
    if np.max(np.abs(one + other)) > ODD * np.max(np.abs(one)):
        refuse("a coefficient that is not the opposite at the opposite slip", "an odd function of the slip")
    double = USUAL._replace(rise=2 * USUAL.rise, dynamic=2 * USUAL.dynamic)
    for numbers in (own, moved):  # a term that is zero by default need not stay so
        before, twice = at(SLIPS, USUAL, numbers), at(SLIPS, double, numbers)
        if np.max(np.abs(twice - 2 * before)) > ODD * np.max(np.abs(before)):
            where = "" if numbers is own else f" where {', '.join(f'{name} is {v:.3g}' for name, v in moved.items())}"
            refuse(
                f"a coefficient that is not twice as large with twice n.rise and n.dynamic{where}",
                "a multiple of these two, as n.dynamic * (1 + drag * abs(v)): a bit has them times an arm, of which a "
                "term without them knows nothing",
            )
    steepest = fall(Named(**USUAL._asdict(), **own))
    if isinstance(steepest, bool) or not isinstance(steepest, Real) or not float(steepest) >= 0.0:
        refuse(f"the fall {steepest!r:.60}", "the steepest fall of the coefficient, a number of at least 0")
    sharp = USUAL._replace(smoothing=SHARP)
    falls = float(np.max((at(SLIPS, sharp) - at(SLIPS * (1 + NEAR), sharp)) / (SLIPS * NEAR)))
    between = -np.diff(at(SLIPS, sharp)) / np.diff(SLIPS)  # also where it jumps between two of them
    falls = max(falls, float(np.max(between)))
    if falls > ENOUGH * float(steepest) + 1e-6:
        refuse(
            f"a fall of {falls:.3g} s/m at usual numbers, and fall={float(steepest):.3g}",
            "the steepest fall, or a bound of it: friction that falls more is integrated too coarsely. A law that "
            "jumps bends instead, as with 0.5 * (1.0 - np.tanh((abs(v) - corner) / width))",
        )


def _numbers_read(function: FunctionType) -> set[str]:
    """The attributes of its numbers that the text of a law reads."""
    second = function.__code__.co_varnames[1]
    reads = (node for node in ast.walk(definition(function)) if isinstance(node, ast.Attribute))
    return {node.attr for node in reads if isinstance(node.value, ast.Name) and node.value.id == second}
