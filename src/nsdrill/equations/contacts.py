"""Contacts, declared where they act in the equations.

The graph remembers them: a tangent needs the side on which a contact is, an implicit
stage solves for the slips of all contacts with friction, and continuation follows the
gap functions.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from nsdrill.equations.graph import Node
from nsdrill.equations.library import sqrt


@dataclass(frozen=True, eq=False)
class Law:
    """A law of friction: the coefficient at a slip, with the slip's sign.

    ``factors(v, numbers)`` are its expensive parts, of which ``coefficient(v, factors,
    numbers)`` makes it; ``steepest_fall(numbers)`` is the steepest fall with the slip;
    ``guess(numbers)`` gives the numbers with which Newton's method begins.
    """

    factors: Callable[[Any, Any], tuple[Any, Any]]
    coefficient: Callable[[Any, tuple[Any, Any], Any], Any]
    steepest_fall: Callable[[Any], Any]
    guess: Callable[[Any], Any] = lambda numbers: numbers

    def __call__(self, v: Any, numbers: Any) -> Any:
        return self.coefficient(v, self.factors(v, numbers), numbers)


@dataclass(frozen=True, eq=False)
class SteepLaw:
    """A law that may rise with an infinite slope, so that an implicit stage solves for
    another unknown in place of the slip.

    ``value(slip, numbers)`` is the coefficient; ``at(unknown, free, numbers)`` gives
    slip and coefficient, and ``begin(free, relaxed, numbers)`` the unknown from which
    Newton's method begins. ``free`` is the slip without friction, and ``relaxed`` by
    how much a coefficient of 1 would reduce it. ``steepest_fall(numbers)`` is that of
    the coefficient with the slip.
    """

    value: Callable[[Any, Any], Any]
    at: Callable[[Any, Any, Any], tuple[Any, Any]]
    begin: Callable[[Any, Any, Any], Any]
    steepest_fall: Callable[[Any], Any]

    def __call__(self, slip: Any, numbers: Any) -> Any:
        return self.value(slip, numbers)


@dataclass
class Friction:
    """A contact with friction: one component, or two for a slip in a plane."""

    name: str
    slips: tuple[Any, ...]
    normal: Any
    law: Law | SteepLaw
    numbers: Any
    loads: tuple[Any, ...] = ()
    region: int = 0

    def loads_at(self, slips: tuple[Any, ...], normal: Any) -> tuple[Any, ...]:
        """The loads against these slips."""
        if len(slips) == 1:
            return (normal * self.law(slips[0], self.numbers),)
        # The floor has an effect at rest only, where the quotient has a limit.
        size = sqrt(slips[0] * slips[0] + (slips[1] * slips[1] + 1e-60))
        share = normal * self.law(size, self.numbers) / size
        return tuple(share * slip for slip in slips)


def touching(name: str, gap: Any) -> Any:
    """How far a unilateral contact is closed, 0 where it is open; ``gap`` is positive
    where it is closed. What leaves an ``if`` on it does not jump where it closes: a
    deviation may take the other side there."""
    if not isinstance(gap, Node):
        return max(gap, 0.0)
    gap.graph.gaps[name] = gap
    return gap.graph.make("max", gap, 0.0, extra=name)


def friction(name: str, *, slip: Any, normal: Any, law: Law | SteepLaw, numbers: Any) -> Any:
    """The load against a ``slip`` under a ``normal`` load: that times the coefficient
    ``law(slip, numbers)``, which has the slip's sign."""
    return _declared(Friction(name, (slip,), normal, law, numbers))[0]


def friction_along(
    name: str, *, slip: tuple[Any, Any], normal: Any, law: Law | SteepLaw, numbers: Any
) -> tuple[Any, ...]:
    """The two components of the load against a slip in a plane."""
    return _declared(Friction(name, slip, normal, law, numbers))


def _declared(contact: Friction) -> tuple[Any, ...]:
    contact.loads = contact.loads_at(contact.slips, contact.normal)
    graph = next((slip.graph for slip in contact.slips if isinstance(slip, Node)), None)
    if graph is not None:
        contact.region = graph.region
        graph.frictions.append(contact)
    return contact.loads
