"""From the equations of a model to its compiled functions.

Equations are one function of plain Python (:mod:`.trace`)::

    equations(t, phase, s, p, o) -> slopes by name, or (slopes, further outputs)

of the time, the drive's angle at time zero, the states, lane parameters and options by
their names. A slope is that of a velocity, or of a state of first order. A further
output is written for the observer. Right-hand side and tangent, explicit and implicit,
follow from it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import lru_cache
from typing import Any

from nsdrill.abi import RATES, RIGHT_HAND_SIDE, Layout
from nsdrill.compiler.functions import BUFFER, LaneFunction, Source, generated
from nsdrill.equations.dependence import dependences
from nsdrill.equations.graph import Graph, Node, Number
from nsdrill.equations.lanes import lane_code
from nsdrill.equations.passes import Tangents, closed, settled
from nsdrill.equations.stage import RELAX, Further, Stage
from nsdrill.equations.trace import Course, check_given, traced
from nsdrill.records import dataclass


@dataclass(frozen=True)
class Motion:
    """Equations, and the names of their inputs and outputs in the order of their rows.

    ``pushed`` are the velocities in whose slopes friction acts, where it is implicit;
    ``sides`` the unilateral contacts whose side a deviation is told; ``solved`` gives
    further outputs of an implicit stage; ``quick`` is for how many slips two tangents of
    Newton's method are enough; ``course`` has a method ``moved(t, phase, s, p)`` that
    gives what equations read in place of these, along a ramp.
    """

    equations: Callable[..., Any]
    options: tuple[object, ...]
    states: tuple[str, ...]
    parameters: tuple[str, ...]
    slopes: tuple[str, ...]
    aux: tuple[str, ...] = ()
    pushed: tuple[str, ...] = ()
    sides: tuple[str, ...] = ()
    solved: Further | None = None
    quick: int = 2
    course: Course | None = None

    def right_hand_side(self, lanes: int, rows: Layout) -> LaneFunction:
        """The compiled right-hand side for a number of lanes in a buffer of these
        ``rows``."""

        def make() -> Source:
            graph, outputs, _ = self._graph(())
            return lane_code("right_hand_side", graph, outputs, self.places(rows), lanes)

        return generated("right_hand_side", RIGHT_HAND_SIDE, make)

    def tangent(self, lanes: int, rows: Layout, place: int) -> LaneFunction:
        """The compiled right-hand side of the motion and of one deviation from it.

        The deviation follows the states, in their order, and its slopes follow theirs.
        The functions of the contacts in ``sides`` at the start of the step are among
        the observer's rows, from ``place`` on: within a step each contact is as it was
        then, and a step in which one changes is repeated for the deviation
        (:mod:`nsdrill.observe.contacts`). Where a contact closes or opens, the Jacobian
        jumps but not the vector field, so the deviation does not (di Bernardo et al.,
        Piecewise-smooth Dynamical Systems, 2008, chapter 2).
        """

        def make() -> Source:
            graph, outputs, instead = self._graph(self.sides)
            seeds: dict[Node, Number] = {graph.input(f"s.{name}"): graph.input(f"d.{name}") for name in self.states}
            followed = {
                name: node for name, node in outputs.items() if name.partition(".")[0] in ("slope", "push", "moved")
            }
            changes = Tangents(graph, seeds, self.sides, instead).of(followed)
            outputs = outputs | {f"d{name}": node for name, node in changes.items()}
            graph, outputs = settled(graph, outputs)
            where = self.places(rows)
            where |= {closed(name): rows.observer + place + RATES * k for k, name in enumerate(self.sides)}
            return lane_code("tangent", graph, outputs, where, lanes)

        return generated("tangent", RIGHT_HAND_SIDE, make)

    def contact_functions(self, lanes: int, rows: Layout, place: int) -> LaneFunction:
        """The compiled function that writes the gap of each contact in ``sides``, its
        rate and its second derivative at the end of the step to the observer's rows
        from ``place`` on: by differentiation along the motion."""

        def make() -> Source:
            graph, _, _ = traced(self.equations, self.states, self.parameters, self.options)
            rates: dict[Node, Number] = {graph.input("time"): 1.0}
            for k, (x, v) in enumerate(zip(self.states[::2], self.states[1::2], strict=False)):
                if k < rows.pairs:
                    rates[graph.input(f"s.{x}")] = graph.input(f"s.{v}") + graph.input(f"frame.{x}")
            for name in self.slopes:
                rates[graph.input(f"s.{name}")] = graph.input(f"slope.{name}")
            found = {f"0.{name}": graph.gaps[name] for name in self.sides}
            for order in range(RATES - 1):
                last = {name: found[f"{order}.{name}"] for name in self.sides}
                changes = Tangents(graph, rates).of(last)
                found |= {f"{order + 1}.{name}": node for name, node in changes.items()}
            graph, found = settled(graph, found)
            where = self.places(rows)
            for k in range(rows.pairs):
                where[f"frame.{self.states[2 * k]}"] = rows.frame_rate + k
            for k, name in enumerate(self.sides):
                for order in range(RATES):
                    where[f"{order}.{name}"] = rows.observer + place + RATES * k + order
            return lane_code("contact_functions", graph, found, where, lanes)

        return generated("contact_functions", BUFFER, make)

    @lru_cache  # noqa: B019  # motions live as long as the process
    def named(self) -> Mapping[str, Node]:
        """What the equations call by a name."""
        return traced(self.equations, self.states, self.parameters, self.options)[0].names

    def slopes_named(self) -> Mapping[str, Node]:
        """The slopes by their names."""
        return traced(self.equations, self.states, self.parameters, self.options)[1]

    @lru_cache  # noqa: B019  # motions live as long as the process
    def dimension(self, held: frozenset[str], zeros: frozenset[str]) -> int:
        """The dimension of the flow where the states in ``held`` do not move and the
        parameters in ``zeros`` are zero: how many states move and have an effect on what
        moves, and one more if time or the phase has. With less than three there is no
        chaos (Poincare and Bendixson)."""
        _, slopes, _ = traced(self.equations, self.states, self.parameters, self.options)
        found = dependences(slopes.values(), {f"p.{name}" for name in zeros})
        reads: dict[str, frozenset[str]] = {}
        pairs = len(self.states) - len(self.slopes)
        for k, name in enumerate(self.slopes):
            if (read := found[slopes[name]]) is not None and name not in held:
                reads[f"s.{name}"] = read
            if k < pairs and self.states[2 * k] not in held:
                reads[f"s.{self.states[2 * k]}"] = frozenset({f"s.{name}"})
        # What is held is read, but it is no state that moves.
        while idle := reads.keys() - frozenset().union(*reads.values()):
            reads = {name: read for name, read in reads.items() if name not in idle}
        forced = any(not read.isdisjoint(("time", "phase")) for read in reads.values())
        return len(reads) + forced

    @lru_cache  # noqa: B019  # motions live as long as the process
    def _graph(self, sides: tuple[str, ...]) -> tuple[Graph, dict[str, Node], dict[Node, Node]]:
        """(graph, outputs, nodes and what changes instead of them), with friction that is
        solved for if it is implicit. ``sides`` are contacts that a deviation may see
        closed."""
        implicit = bool(self.pushed)
        graph, slopes, outputs = traced(
            self.equations, self.states, self.parameters, self.options, self.course, with_slopes=implicit
        )
        wanted = {f"slope.{name}": node for name, node in slopes.items()}
        wanted |= {f"aux.{name}": node for name, node in outputs.items()}
        pairs: list[tuple[Node, Node]] = []
        if implicit:
            stage = Stage(graph, wanted, self.pushed, sides, self.quick)
            wanted = stage.run(self._further)
            pairs = stage.instead
        self._check(slopes, [name[4:] for name in wanted if name.startswith("aux.")])
        others = {f"{side}.{k}": pair[side] for k, pair in enumerate(pairs) for side in (0, 1)}
        graph, found = settled(graph, wanted | others)
        instead = {found[f"0.{k}"]: found[f"1.{k}"] for k in range(len(pairs))}
        return graph, {name: found[name] for name in wanted}, instead

    def _further(self, stage: Stage, slips: Mapping[int, Node], steps: Mapping[int, Node]) -> Mapping[str, Node]:
        found = {} if self.solved is None else self.solved(stage, slips, steps)
        return {f"aux.{name}": node for name, node in found.items()}

    def _check(self, slopes: Mapping[str, Node], outputs: Iterable[str]) -> None:
        check_given(self.equations, "slopes", slopes, self.slopes)
        check_given(self.equations, "outputs", outputs, self.aux)

    def places(self, rows: Layout) -> dict[str, int]:
        """The row of each input and output of the equations."""
        place = {
            "time": rows.stage_time,
            "phase": rows.phase,
            **{f"s.{name}": rows.stage + k for k, name in enumerate(self.states)},
            **{f"d.{name}": rows.stage + rows.own + k for k, name in enumerate(self.states)},
            **{f"p.{name}": rows.parameter + k for k, name in enumerate(self.parameters)},
            **{f"aux.{name}": rows.aux_now + k for k, name in enumerate(self.aux)},
        }
        for k, name in enumerate(self.slopes):
            place[f"slope.{name}"] = rows.acceleration + k
            place[f"dslope.{name}"] = rows.acceleration + rows.own_slopes + k
        if self.pushed:
            place |= {RELAX: rows.relax, "falling": rows.falling}
        for k, name in enumerate(self.pushed):
            place[f"moved.{name}"] = place[f"s.{name}"]
            place[f"dmoved.{name}"] = place[f"d.{name}"]
            place[f"push.{name}"] = rows.push + k
            place[f"dpush.{name}"] = rows.push + len(self.pushed) + k
        return place
