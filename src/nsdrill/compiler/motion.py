"""From the equations of a model to its compiled functions.

Equations are one function of plain Python (:mod:`.trace`)::

    equations(t, phase, s, p, o) -> slopes by name, or (slopes, further outputs)

of the time, the drive's angle at time zero, the states, lane parameters and options by
their names. A slope is that of a velocity, or of a state of first order. A further
output is written for the observer. Right-hand side and tangent, explicit and implicit,
follow from it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from nsdrill.abi import RATES, Rows
from nsdrill.compiler.derivative import Tangents, closed
from nsdrill.compiler.functions import BUFFER, generated, identity
from nsdrill.compiler.graph import Graph, Node
from nsdrill.compiler.lanes import lane_code
from nsdrill.compiler.stage import RELAX, Stage
from nsdrill.compiler.sums import settled
from nsdrill.compiler.trace import traced

# The further outputs of an implicit stage: function(graph, stage, options).
Solved = Callable[[Graph, Stage, Any], Mapping[str, Node]]


@dataclass(frozen=True)
class Motion:
    """Equations, and the names of their inputs and outputs in the order of their rows.

    ``pushed`` are the velocities in whose slopes friction acts, where it is implicit;
    ``sides`` the unilateral contacts whose side a deviation is told; ``solved`` gives
    further outputs of an implicit stage; ``quick`` is for how many slips two tangents of
    Newton's method are enough.
    """

    equations: Callable[..., Any]
    options: Any
    states: tuple[str, ...]
    parameters: tuple[str, ...]
    slopes: tuple[str, ...]
    aux: tuple[str, ...] = ()
    pushed: tuple[str, ...] = ()
    sides: tuple[str, ...] = ()
    solved: Solved | None = None
    quick: int = 2

    def right_hand_side(self, lanes: int, rows: Rows) -> Any:
        """The compiled right-hand side for a number of lanes in a buffer of these
        ``rows``."""

        def make() -> Any:
            graph, outputs, _ = self._graph(())
            return lane_code("right_hand_side", graph, outputs, self._place(rows), lanes)

        return generated("right_hand_side", BUFFER, self._key(rows, lanes), make)

    def tangent(self, lanes: int, rows: Rows, place: int) -> Any:
        """The compiled right-hand side of the motion and of one deviation from it.

        The deviation follows the states, in their order, and its slopes follow theirs.
        The functions of the contacts in ``sides`` at the start of the step are among
        the observer's rows, from ``place`` on: within a step each contact is as it was
        then, and a step in which one changes is repeated for the deviation
        (:mod:`nsdrill.observe.landing`). Where a contact closes or opens, the Jacobian
        jumps but not the vector field, so the deviation does not (di Bernardo et al.,
        Piecewise-smooth Dynamical Systems, 2008, chapter 2).
        """

        def make() -> Any:
            graph, outputs, fixed = self._graph(self.sides)
            seeds: dict[Node, Any] = {
                graph.input(f"s.{name}"): graph.input(f"d.{name}") for name in self.states
            }
            seeds |= dict.fromkeys(fixed, 0.0)
            followed = {
                name: node
                for name, node in outputs.items()
                if name.partition(".")[0] in ("slope", "push", "moved")
            }
            changes = Tangents(graph, seeds, self.sides).of(followed)
            outputs = outputs | {f"d{name}": node for name, node in changes.items()}
            graph, outputs = settled(graph, outputs)
            where = self._place(rows)
            where |= {
                closed(name): rows.observer + place + RATES * k for k, name in enumerate(self.sides)
            }
            return lane_code("tangent", graph, outputs, where, lanes)

        return generated("tangent", BUFFER, (*self._key(rows, lanes), place), make)

    def _key(self, rows: Rows, lanes: int) -> tuple[Any, ...]:
        solved = self.solved and identity(self.solved)
        names = (
            self.states,
            self.parameters,
            self.slopes,
            self.aux,
            self.pushed,
            self.sides,
            self.quick,
        )
        return identity(self.equations), solved, self.options, names, rows, lanes

    @lru_cache
    def _graph(self, sides: tuple[str, ...]) -> tuple[Graph, dict[str, Node], list[Node]]:
        """(graph, outputs, what a deviation does not change), with friction that is
        solved for if it is implicit. ``sides`` are contacts that a deviation may see
        closed."""
        implicit = bool(self.pushed)
        graph, slopes, outputs = traced(
            self.equations, self.states, self.parameters, self.options, with_slopes=implicit
        )
        wanted = {f"slope.{name}": node for name, node in slopes.items()}
        wanted |= {f"aux.{name}": node for name, node in outputs.items()}
        fixed: dict[str, Node] = {}
        if implicit:
            stage = Stage(graph, wanted, self.pushed, sides)
            wanted = stage.run(turns=stage.count > self.quick) | {"falling": stage.falling()}
            if self.solved is not None:
                more = self.solved(graph, stage, self.options)
                wanted |= {f"aux.{name}": node for name, node in more.items()}
                outputs |= more
            fixed = {f"fixed.{k}": node for k, node in enumerate(stage.fixed)}
        self._check(slopes, outputs)
        graph, found = settled(graph, wanted | fixed)
        return graph, {name: found[name] for name in wanted}, [found[name] for name in fixed]

    def _check(self, slopes: Mapping[str, Node], outputs: Mapping[str, Node]) -> None:
        for what, found, wanted in (
            ("slopes", set(slopes), set(self.slopes)),
            ("outputs", set(outputs), set(self.aux)),
        ):
            if found != wanted:
                raise TypeError(
                    f"{self.equations.__name__}: found the {what} {sorted(found)}; allowed: "
                    f"{sorted(wanted)}"
                )

    def _place(self, rows: Rows) -> dict[str, int]:
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
