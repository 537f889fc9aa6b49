"""What the graph of a model's function says: which states are pairs of a position and its
velocity, which contacts there are, and how the slopes change with the states."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from nsdrill.compiler.language import definition
from nsdrill.equations import plain
from nsdrill.equations.changes import stored
from nsdrill.equations.consequences import Consequences
from nsdrill.equations.graph import Graph, Node, text_of
from nsdrill.equations.library import Friction
from nsdrill.equations.trace import Named, check_text, prepared, traced
from nsdrill.models.own_quantities import Measured
from nsdrill.records import dataclass
from nsdrill.script.angles import turning_in, unread_in
from nsdrill.script.clock import CLOCK, Forcing, cycles_as_radians, forcing_in, repeat, values_read
from nsdrill.script.dimensions import check_dimensions, check_measured, dimension_of
from nsdrill.script.driving import driving_in
from nsdrill.script.pulses import forces_of
from nsdrill.script.signature import Signature, signature_of

Equations = Callable[..., dict[str, Node]]

SAME = 1e-3  # of a slope: far above rounding, also of what cancels
AWAY_FROM_START = (0.0123, 0.123, 0.123, 1.23, 1.23, 1.23, 1.23, 12.3, 12.3, 12.3, 12.3, 123.0, 123.0, 123.0, 123.0)


def equations_of(read: Signature, forcing: Forcing | None, wanted: tuple[str, ...]) -> Equations:
    """The equations ``(t, phase, s, p, o)`` of a model: the slopes of the states that are
    ``wanted``."""
    function, states, parameters = read.function, tuple(read.start), tuple(read.parameters)

    def equations(t: Node, phase: Node, s: Named, p: Named, o: object) -> dict[str, Node]:
        given = {name: getattr(p, name) for name in parameters}
        slopes = read.called(prepared(function), t, {name: getattr(s, name) for name in states}, given)
        slopes = {name: t.graph.number(slope) for name, slope in slopes.items()}
        turned = slopes if forcing is None else forcing.turned(t.graph, slopes, phase, t, p.clock)
        return {name: turned[name] for name in wanted}

    equations.__module__ = function.__module__  # that of a script: what it does besides is looked for
    equations.__qualname__ = function.__qualname__
    equations.written = function  # type: ignore[attr-defined]  # for messages
    return equations


@dataclass(frozen=True, eq=False)
class Reading:
    """A model's function as it was read: its ``signature``, its ``forcing`` if it has one,
    its ``graph`` and the ``slopes`` of all states in it, in which an angle of the forcing
    is one of the phase. The angle of ``forcing`` advances at the value ``rate`` of
    parameters. ``quantities`` are what the script measures besides, each with its value. The
    states ``judged`` are those that a response is about."""

    signature: Signature
    forcing: Forcing | None
    rate: Node | None
    graph: Graph
    slopes: Mapping[str, Node]
    quantities: Mapping[Measured, Node]
    judged: frozenset[str] = frozenset()

    # Pairs and states of first order.

    @cached_property
    def _pairs(self) -> dict[str, tuple[str, Node | None]]:
        """The velocity of each position, and what its slope is less than that, a value of
        parameters."""
        found: dict[str, tuple[str, Node | None]] = {}
        taken: set[str] = set()
        for name, slope in self.slopes.items():
            velocity, frame = self._velocity(slope)
            if velocity and velocity != name and not {name, velocity} & taken:
                found[name] = velocity, frame
                taken |= {name, velocity}
        return found

    def _velocity(self, slope: Node) -> tuple[str, Node | None]:
        for one, frame in self._differences(slope):
            name = str(one.extra).removeprefix("s.") if one.op == "input" else ""
            if name in self.signature.start and (frame is None or self._is_constant(frame)):
                return name, frame
        return "", None

    def _differences(self, slope: Node) -> list[tuple[Node, Node | None]]:
        """(a, b) of a slope a - b."""
        if slope.op == "sub":
            return [(slope.args[0], slope.args[1])]
        if slope.op == "add":
            return [(slope.args[0], -slope.args[1]), (slope.args[1], -slope.args[0])]
        return [(slope, None)]

    def _is_constant(self, node: Node) -> bool:
        return all(str(one.extra).startswith("p.") for one in node.graph.live([node]) if one.op == "input")

    @property
    def pairs(self) -> dict[str, str]:
        return {name: velocity for name, (velocity, _) in self._pairs.items()}

    @property
    def frames(self) -> dict[str, Node]:
        """By how much the slope of a position is less than its velocity, where it is."""
        return {name: frame for name, (_, frame) in self._pairs.items() if frame is not None}

    @property
    def singles(self) -> tuple[str, ...]:
        """The states of first order."""
        paired = {*self.pairs, *self.pairs.values()}
        return tuple(name for name in self.signature.start if name not in paired)

    @property
    def states(self) -> tuple[str, ...]:
        """All states, in the order of lanes."""
        return (*(name for pair in self.pairs.items() for name in pair), *self.singles)

    @property
    def moved(self) -> tuple[str, ...]:
        """The states whose slopes the equations of a lane give."""
        return (*self.pairs.values(), *self.singles)

    @cached_property
    def equations(self) -> Equations:
        return equations_of(self.signature, self.forcing, self.moved)

    # Time, contacts, names.

    @property
    def repeats(self) -> bool:
        """Whether the equations are the same after a while: none of them reads the time but
        as an angle."""
        return self.forcing is not None or "time" not in self.consequences.read

    @property
    def clocked(self) -> bool:
        """Whether the time is a value of the equations, or of what is measured: what it is at
        another time no run tells."""
        if self.forcing is None:
            outputs = [*values_read(self.graph, self.slopes), *self.quantities.values()]
            return "time" in self.graph.inputs_of(outputs)
        return not repeat(self.signature, {one.name: node for one, node in self.quantities.items()})

    @property
    def gaps(self) -> dict[str, Node]:
        return self.graph.gaps

    @cached_property
    def rubs(self) -> dict[str, Friction]:
        """The contacts with friction in one direction, by name."""
        return {one.name: one for one in self.graph.frictions if len(one.slips) == 1}

    @cached_property
    def driving(self) -> dict[str, tuple[Node, tuple[str, ...]]]:
        """Of contacts with friction that may drive in a run: whether they do, as 1 or 0, and
        which numbers of theirs are below 0 then."""
        ranges = {name: (value.low, value.high) for name, value in self.signature.parameters.items()}
        return driving_in(self.graph, ranges)

    @cached_property
    def named(self) -> dict[str, Node]:
        """What the equations give a name to, beside what they are given."""
        return {
            name: node
            for name, node in self.graph.names.items()
            if name not in self.signature.start and node.op not in ("const", "input") and not name.startswith("_")
        }

    @cached_property
    def unread(self) -> tuple[str, ...]:
        """The states that no slope, no contact and no response reads."""
        states = [name for name in self.states if name not in self.judged]
        return unread_in(self.graph, values_read(self.graph, self.slopes), states)

    @property
    def uncounted(self) -> tuple[str, ...]:
        """Of these those that are no angles by their unit: what they do says nothing of whether
        a motion has settled."""
        return tuple(name for name in self.unread if self.signature.start[name].units != "rad")

    @cached_property
    def idle(self) -> tuple[str, ...]:
        """The parameters that no slope, contact, quantity or name reads."""
        outputs = [*values_read(self.graph, self.slopes), *self.quantities.values(), *self.named.values()]
        inputs = self.graph.inputs_of([*outputs, *([] if self.rate is None else [self.rate])])
        return tuple(name for name in self.signature.parameters if f"p.{name}" not in inputs)

    @cached_property
    def forces(self) -> list[Node]:
        """What depends on the time alone."""
        return forces_of(self.graph, values_read(self.graph, self.slopes))

    @cached_property
    def turned(self) -> dict[str, list[Node]]:
        """What depends on an angle that may turn alone, by its name."""
        read = values_read(self.graph, self.slopes)
        found = {name: forces_of(self.graph, read, (f"s.{name}",)) for name in self.angles}
        return {name: forces for name, forces in found.items() if forces}

    @cached_property
    def angles(self) -> tuple[str, ...]:
        """The states of which a revolution more is the same."""
        return turning_in(self.graph, values_read(self.graph, self.slopes), self.states)

    # Numbers.

    def given(self, states: Mapping[str, Any], parameters: Mapping[str, Any], **others: Any) -> dict[str, Any]:
        """The inputs of the graph; the time and the phase are zero unless given."""
        inputs = {f"s.{name}": value for name, value in states.items()}
        inputs |= {f"p.{name}": value for name, value in parameters.items()}
        return {f"p.{CLOCK}": 1.0, "time": 0.0, "phase": 0.0, **inputs, **others}

    @cached_property
    def consequences(self) -> Consequences:
        """What follows from the slopes."""
        return Consequences(self.graph, self.slopes, self.states, self.moved)

    @cached_property
    def told_by_part(self) -> dict[str, str]:
        """What is computed, as the text of each part by its words: the equations with their
        contacts, every number with its units and range, and what is measured."""
        contacts = {f"gap {name}": gap for name, gap in self.graph.gaps.items()}
        contacts |= {f"slip {one.name}": slip for one in self.graph.frictions for slip in one.slips}
        read = self.signature
        found = {"the equations": text_of({**self.slopes, **contacts})}
        found |= {f"the number {name}": repr(one.told) for name, one in (*read.start.items(), *read.parameters.items())}
        return found | {
            f"the feature {one.name}": repr((one.told, text_of({one.name: node})))
            for one, node in self.quantities.items()
        }

    @cached_property
    def digest(self) -> str:
        """Digest of what is computed: of the graph, its contacts and the numbers with their
        units and ranges, not of the text of a file."""
        contacts = {f"gap {name}": gap for name, gap in self.graph.gaps.items()}
        contacts |= {f"slip {one.name}": slip for one in self.graph.frictions for slip in one.slips}
        contacts |= {f"feature {one.name}": node for one, node in self.quantities.items()}
        read = self.signature
        numbers = [(name, value.told) for name, value in (*read.start.items(), *read.parameters.items())]
        told = [one.told for one in self.quantities]
        text = repr((read.name, numbers, text_of({**self.slopes, **contacts}), *told))
        return hashlib.sha256(text.encode()).hexdigest()[:16]


def read(function: object, measures: Sequence[Measured] = ()) -> Reading:
    """A model's function, and what is measured besides, read. InputError where its signature is none of a model,
    LanguageError where its equations do what lanes cannot."""
    signature = signature_of(function)
    _check_given(signature)
    states, columns = tuple(signature.start), (*signature.parameters, CLOCK)
    plain_time = equations_of(signature, None, states)
    graph, slopes, _ = traced(plain_time, states, columns, ())
    named = check_dimensions(plain_time, signature.start, signature.parameters, signature.returned)
    forcing = forcing_in(signature, graph, slopes)
    rate = None
    if name := cycles_as_radians(signature, graph, slopes):
        signature.refuse(
            f"an angle that grows by {name} * t, of which {name} is in Hz, cycles in a second, so that one is a radian",
            f"2 * np.pi * {name} * t, or {name} in rad/s",
        )
    if forcing is not None:
        rate = forcing.rate(graph, slopes)
        turned = equations_of(signature, forcing, states)
        graph, slopes, _ = traced(turned, states, columns, ())
    quantities = {one: one.node(graph, signature.start, signature.parameters) for one in measures}
    given = named | {name: dimension_of(v) for name, v in (*signature.parameters.items(), *signature.start.items())}
    for one in measures:
        check_measured(one, given)
    made = Reading(signature, forcing, rate, graph, slopes, quantities)
    _check_called(made)
    return made


def _check_called(made: Reading) -> None:
    """InputError where the function gives other slopes of numbers than the graph that was read
    of it, as one that asks what its arguments are does: near the start, and away from it, where
    other sides of its conditions hold."""
    for k, away in enumerate(AWAY_FROM_START):
        signs = [away if (k >> place) % 2 == 0 else -away for place in range(len(made.signature.start))]
        values = made.signature.start.items()
        _check_called_at(
            made, {name: 1.1 * float(value) + sign for (name, value), sign in zip(values, signs, strict=True)}
        )


def _check_called_at(made: Reading, states: Mapping[str, float]) -> None:
    read = made.signature
    numbers = {name: float(value) for name, value in read.parameters.items()}
    try:
        with np.errstate(all="ignore"):
            called = read.called(read.function, 0.0, states, numbers)
            found = plain.values(made.slopes, made.given(states, numbers))
    except Exception:  # of numbers that it refuses, as it divides by zero
        return
    size = max((abs(float(value)) for value in called.values()), default=0.0)
    for name, value in called.items():
        one, other = float(value), float(np.ravel(found[name])[0])
        if np.isfinite([one, other]).all() and abs(one - other) > SAME * max(abs(one), abs(other), 1e-6 * size):
            read.refuse(
                f"the slope of {name} {one:.6g} of numbers, and {other:.6g} in the equations that are read of it, at "
                f"{', '.join(f'{state} = {at:.4g}' for state, at in states.items())}",
                "what does the same with any value",
            )


def _check_given(signature: Signature) -> None:
    """InputError where a function gives a state or a parameter another value: a state
    moves by its slope, and does not jump."""
    check_text(signature.function)
    given = {*signature.start, *signature.parameters, "t"}
    if again := [name for name in stored(definition(signature.function).body) if name in given]:
        what = "state" if again[0] in signature.start else "parameter" if again[0] != "t" else "time"
        jump = ". A state does not jump: for an impact there is a stiff contact, nsdrill.touching"
        signature.refuse(
            f"a new value of the {what} {again[0]}",
            f"another name for it, as it is given{jump if what == 'state' else ''}",
        )
