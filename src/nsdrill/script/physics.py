"""What the equations of a script may call besides Python and numpy: contacts with and
without friction, and laws of friction."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NoReturn, overload

from nsdrill.equations import library
from nsdrill.equations.graph import Graph, Node, Number
from nsdrill.equations.trace import Inputs, Named, check_text, evaluated, part
from nsdrill.errors import InputError
from nsdrill.models.friction import LAWS, Numbers, ScriptLaw, laws, register_law

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
    decay: Number = 0.0,
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

    Returns
    -------
    value
        The load [N], with the sign of the slip.

    Raises
    ------
    InputError
        Where there is no such law, or a number is below zero.

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
    for what, value in (("smoothing", smoothing), ("normal", normal)):
        if not isinstance(value, Node) and not value >= 0.0:
            raise InputError(f"nsdrill.friction({name!r}): found {what}={value!r}; allowed: a number of at least 0.")
    least = static if dynamic is None else dynamic
    numbers = Named(smoothing=smoothing, decay=decay, rise=static - least, dynamic=least)
    if isinstance(slip, Node) and any(one.name == name for one in slip.graph.frictions):
        _refuse_another(slip.graph, name)
    return library.friction(_name(name), slip=slip, normal=normal, law=known[law], numbers=numbers)


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


def _refuse_another(graph: Graph, name: str) -> NoReturn:
    graph.refuse(f"found a second contact with the name {name!r}; allowed: one of each name, as results have its name")


def _name(name: object) -> str:
    if not isinstance(name, str) or not name.isidentifier() or "__" in name or name.startswith("_"):
        raise InputError(
            f"found a contact with the name {name!r}; allowed: letters, digits and single underscores, a letter first."
        )
    return name


@overload
def law(function: LawFunction, *, fall: Callable[[Any], Any]) -> LawFunction: ...
@overload
def law(*, fall: Callable[[Any], Any]) -> Callable[[LawFunction], LawFunction]: ...
def law(function: LawFunction | None = None, *, fall: Callable[[Any], Any]) -> Any:
    """Make a law of friction of a function, as a decorator above its ``def``. Its name is
    that of the function.

    Parameters
    ----------
    function : function
        ``law(v, n)``: the coefficient, with its sign, at a slip ``v``, from the numbers
        ``n.smoothing``, ``n.decay``, ``n.rise`` and ``n.dynamic``.
    fall : function
        Of the numbers: the steepest fall of the coefficient with the slip [s/m],
        without smoothing, or a bound of it.

    Returns
    -------
    function
        The function itself.

    Raises
    ------
    InputError
        Where there is a law of this name already.

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
        return lambda one: law(one, fall=fall)
    name = function.__name__
    if name in LAWS:
        raise InputError(f"nsdrill.law: found the law {name}, which there is; allowed: another name.")
    _check(function)
    register_law(name, ScriptLaw(part(function), fall, function.__code__.co_filename))
    return function


def _check(function: LawFunction) -> None:
    """LanguageError, with its line, where a law does what lanes cannot."""
    check_text(function)
    graph = Graph()
    evaluated(graph, function, graph.input("v"), Inputs(graph, Numbers._fields, "n"))
