"""What follows from the slopes of all states as a graph: in which of them friction acts
and how fast it brakes, how they change with the states, where they jump."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property, lru_cache, reduce
from typing import Any

import numpy as np

from nsdrill.data import Array
from nsdrill.equations import plain
from nsdrill.equations.graph import Graph, Node
from nsdrill.equations.passes import Tangents
from nsdrill.equations.trace import check_given, traced
from nsdrill.records import dataclass

Given = Callable[[Mapping[str, Any]], dict[str, Any]]  # the inputs of a graph, from the states by name


@dataclass(frozen=True, eq=False)
class Consequences:
    """The ``slopes`` of the ``states``, which are in the order of lanes, as values of a
    ``graph``; of those that are ``moved`` the equations say the slope, which of a
    position is its velocity."""

    graph: Graph
    slopes: Mapping[str, Node]
    states: tuple[str, ...]
    moved: tuple[str, ...]

    @cached_property
    def read(self) -> set[str]:
        """The inputs on which the slopes depend."""
        return self.graph.inputs_of(self.slopes.values())

    @cached_property
    def free(self) -> tuple[int, ...]:
        """The indices of the states on which some slope depends."""
        return tuple(k for k, name in enumerate(self.states) if f"s.{name}" in self.read)

    # Friction.

    @cached_property
    def rubbing(self) -> tuple[str, ...]:
        """The velocities in whose slopes friction acts: those in the slips; none where some
        slip has none, as friction can then not be integrated implicitly."""
        found: set[str] = set()
        for contact in self.graph.frictions:
            slips = [slip for slip in contact.slips if type(slip) is Node]
            read = {name.removeprefix("s.") for name in self.graph.inputs_of(slips)} if slips else set()
            if read.isdisjoint(self.moved):
                return ()
            found |= read
        return tuple(name for name in self.moved if name in found)

    @property
    def why_explicit(self) -> str | None:
        """Why friction cannot be integrated implicitly, None where it can."""
        if self.rubbing:
            return None
        if not self.graph.frictions:
            return "this model has no friction"
        return "a slip of this model has no state whose slope friction acts in"

    @cached_property
    def _braked(self) -> dict[tuple[str, str], Node]:
        """How the slope of a velocity changes with it by the load of a contact alone,
        (contact, velocity)."""
        found: dict[tuple[str, str], Node] = {}
        for contact in self.graph.frictions:
            loads = [load for load in contact.loads if type(load) is Node and load.op != "const"]
            for name in self.rubbing:
                terms = []
                for load in loads:
                    change = Tangents(self.graph, {self.graph.input(f"s.{name}"): 1.0}).of({"": load})[""]
                    slope = Tangents(self.graph, {load: 1.0}).of({"": self.slopes[name]})[""]
                    terms.append(slope * change)
                found[contact.name, name] = self.graph.sum(terms)
        return found

    def braking(self, given: Given) -> dict[str, Any]:
        """How fast each contact with friction brakes a slip at rest [1/s], by its name: the
        fastest of what a velocity in the slip loses by its load. All other states are
        zero."""
        rates: dict[str, Any] = {}
        for name, changes in self._at_rest(given):
            rates[name] = reduce(np.maximum, map(np.abs, changes), rates.get(name, np.asarray(0.0)))
        return rates

    def driven(self, given: Given) -> tuple[str, ...]:
        """The contacts whose friction makes a slip at rest grow, as where its load has the
        wrong sign. All other states are zero."""
        return tuple(name for name, changes in self._at_rest(given) if sum(changes) > 0.0)

    def _at_rest(self, given: Given) -> Iterator[tuple[str, list[Array]]]:
        """Each contact, and what the velocities in slips gain by its load [1/s], where its own
        slip is at rest."""
        for contact in self.graph.frictions:
            states = {**dict.fromkeys(self.states, 0.0), **self._without_slip(contact.slips, given)}
            nodes = {name: node for (of, name), node in self._braked.items() if of == contact.name}
            yield contact.name, [np.asarray(one, float) for one in plain.values(nodes, given(states)).values()]

    @cached_property
    def unread_loads(self) -> tuple[str, ...]:
        """The contacts with friction whose load no slope reads."""
        read = set(self.graph.live(self.slopes.values()))
        return tuple(one.name for one in self.graph.frictions if read.isdisjoint(one.loads))

    def _without_slip(self, slips: Sequence[Any], given: Given) -> dict[str, Any]:
        """Values of one velocity of each slip at which that is zero, if it is linear in
        it."""
        found: dict[str, Any] = {}
        for slip in slips:
            if type(slip) is not Node:
                continue
            name = next((n for n in self.rubbing if f"s.{n}" in self.graph.inputs_of([slip])), None)
            if name is None or name in found:
                continue
            states = dict.fromkeys(self.states, 0.0)
            at = [plain.values({"": slip}, given({**states, name: v}))[""] for v in (0.0, 1.0)]
            gradient = np.asarray(at[1] - at[0], float)
            found[name] = np.where(gradient == 0.0, 0.0, -at[0] / np.where(gradient == 0.0, 1.0, gradient))
        return found

    # The Jacobian.

    @cached_property
    def jacobian(self) -> dict[tuple[str, str], Node]:
        """How the slope of a state changes with a state, (slope, state)."""
        found: dict[tuple[str, str], Node] = {}
        for column in self.states:
            changes = Tangents(self.graph, {self.graph.input(f"s.{column}"): 1.0}).of(self.slopes)
            found |= {(row, column): change for row, change in changes.items()}
        return found

    def matrix(self, given: Mapping[str, Any]) -> Array:
        """The Jacobian at inputs of the graph, shape (..., n, n), in the order of states."""
        nodes = {f"{row} {column}": node for (row, column), node in self.jacobian.items()}
        found = plain.values(nodes, given)
        n = len(self.states)
        flat = [np.asarray(found[f"{r} {c}"], float) for r in self.states for c in self.states]
        values = np.stack(np.broadcast_arrays(*flat), axis=-1)
        return values.reshape(*values.shape[:-1], n, n)

    def rates(self, given: Mapping[str, Any]) -> Array:
        """The sizes of the eigenvalues [1/s] of the Jacobian, shape (..., n); those of an
        entry that is no number count as without it."""
        matrix = self.matrix(given)
        return np.asarray(np.abs(np.linalg.eigvals(np.where(np.isfinite(matrix), matrix, 0.0))))


@lru_cache(maxsize=64)
def consequences_of(
    equations: Callable[..., Any],
    states: tuple[str, ...],
    moved: tuple[str, ...],
    frames: tuple[str, ...],
    set_speed: str,
    parameters: tuple[str, ...],
    options: object,
) -> Consequences:
    """What follows from equations of a lane: pairs of position and velocity, then states of
    first order. Positions in ``frames`` are measured from an angle that advances at the
    lane parameter ``set_speed``."""
    graph, slopes, _ = traced(equations, states, parameters, options)
    check_given(equations, "slopes", slopes, moved)
    pairs = 2 * (len(states) - len(moved))
    found: dict[str, Node] = {}
    for x, v in zip(states[:pairs:2], states[1:pairs:2], strict=True):
        velocity = graph.input(f"s.{v}")
        found |= {x: velocity - graph.input(f"p.{set_speed}") if x in frames else velocity, v: slopes[v]}
    return Consequences(graph, found | {name: slopes[name] for name in states[pairs:]}, states, moved)
