"""A stage of an implicit step: friction solved for from the contacts that equations
declare (:mod:`.contacts`).

A stage moves the velocities by c times the push, the part of the slopes that is due to
friction. All slopes are linear in the loads L of the contacts::

    push = u L,    slip = slip* - c K L(slip),    K = -w u

with u = d slopes / d loads and w = d slips / d velocities, both by differentiation, and
the slips slip* without friction. Newton's method solves for the slips of all contacts
jointly, from guesses of each beside the others. The loads are those of its last tangent,
so that they agree with the velocities to rounding. A deviation from the solution is
the derivative of that tangent, in which slips, matrix and slopes are ``fixed``.

The contacts in a region (the wall) are solved for where some lane needs them, the
others alone where none does. What a lane does not touch adds zeros to its solution,
whose bits therefore do not depend on its neighbours.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from nsdrill.compiler.contacts import Friction
from nsdrill.compiler.derivative import Tangents, closed
from nsdrill.compiler.graph import Graph, Loop, Node
from nsdrill.compiler.library import choose, fma, greater, sqrt

SATURATION = 0.8  # from 0.64, right for large slips, to 1.57, right for small ones
LEAST = 1e-300
TOLERANCE, MOST = 1e-5, 12  # of the loads, relative; turns of Newton's method
RELAX = "relax"  # the input c [s]


def first_slip(free: Node, relaxed: Node, law: Any) -> Node:
    """The guess of a slip of which ``free`` is left without friction and ``relaxed``
    times the coefficient of the ``law`` is taken: with x / (0.8 + |x|) in place of
    (2/pi) atan x the equation is quadratic."""
    speed = abs(free)
    sliding = greater(speed - relaxed * (law.rise + law.dynamic), 0.0)
    weakening = fma(law.decay, sliding, 1.0)  # all terms times this: one division less
    level = relaxed * fma(weakening, law.dynamic, law.rise)
    linear = fma(law.smoothing, fma(-weakening, speed, level), SATURATION * weakening)
    constant = (2.0 * SATURATION) * weakening * speed
    twice = (2.0 * law.smoothing) * weakening
    root = sqrt(fma(linear, linear, twice * constant))
    positive = linear > 0.0
    guess = choose(positive, constant, root - linear) / choose(positive, linear + root, twice)
    return choose(free < 0.0, -guess, guess)


def kept(slip: Node, following: Node) -> Node:
    """The next slip of Newton's method, or zero where it has the other sign: from zero
    the iteration does not overshoot."""
    return choose(following * slip < 0.0, slip.graph.node(0.0), following)


def solved(matrix: Sequence[Sequence[Node]], right: Sequence[Node]) -> list[Node]:
    """The solution of a small linear system whose diagonal is 1 and what is positive:
    without pivoting, with one division a row."""
    count = len(right)
    a, r = [list(row) for row in matrix], list(right)
    if count == 2:
        per = 1.0 / (a[0][0] * a[1][1] - a[0][1] * a[1][0])
        return [(a[1][1] * r[0] - a[0][1] * r[1]) * per, (a[0][0] * r[1] - a[1][0] * r[0]) * per]
    inverse = []
    for k in range(count):
        inverse.append(1.0 / a[k][k])
        for i in range(k + 1, count):
            factor = a[i][k] * inverse[k]
            for j in range(k + 1, count):
                a[i][j] = a[i][j] - factor * a[k][j]
            r[i] = r[i] - factor * r[k]
    x: list[Node] = []
    for k in reversed(range(count)):
        known = zip(a[k][k + 1 :], reversed(x), strict=True)
        x.append((r[k] - sum((f * v for f, v in known), r[k].graph.node(0.0))) * inverse[k])
    return x[::-1]


class Stage:
    """The stage of a traced model, whose slopes, and whatever else the loads or the
    moved velocities change, are ``values``. Numbers count the components of all
    contacts: one of each, or two of a slip in a plane."""

    def __init__(
        self,
        graph: Graph,
        values: Mapping[str, Node],
        pushed: Sequence[str],
        sides: Sequence[str] = (),
    ) -> None:
        self.graph, self.pushed, self.sides = graph, tuple(pushed), tuple(sides)
        self.fixed: list[Node] = []  # what a deviation does not change
        self.zero = graph.node(0.0)
        self.relax = graph.input(RELAX)
        self.contacts: list[Friction] = graph.frictions
        self.own: list[list[int]] = []  # the components of each contact
        for contact in self.contacts:
            begin = sum(map(len, self.own))
            self.own.append(list(range(begin, begin + len(contact.loads))))
        self.count = sum(map(len, self.own))
        self.loads = [graph.input(f"load.{k}") for k in range(self.count)]
        every = [load for contact in self.contacts for load in contact.loads]
        wanted = [*values.values(), *(contact.normal for contact in self.contacts)]
        free = graph.substituted(wanted, dict(zip(every, self.loads, strict=True)), {})
        self.values = dict(zip(values, free, strict=False))
        self.normal = [
            self._outside(node, contact)
            for node, contact in zip(free[len(values) :], self.contacts, strict=True)
        ]
        self.slip = [
            self._outside(slip, contact) for contact in self.contacts for slip in contact.slips
        ]
        pushes = {name: self.values[f"slope.{name}"] for name in self.pushed}
        self.unit = [Tangents(graph, {load: 1.0}).of(pushes) for load in self.loads]
        slips = {str(k): slip for k, slip in enumerate(self.slip)}
        along = {
            name: Tangents(graph, {graph.input(f"s.{name}"): 1.0}).of(slips) for name in self.pushed
        }
        self.K = [
            [
                -graph.sum(along[name][str(k)] * unit[name] for name in self.pushed)
                for unit in self.unit
            ]
            for k in range(self.count)
        ]

    def _outside(self, node: Node, contact: Friction) -> Node:
        """A value of the contact's region outside of it, 0 where that is not needed."""
        condition = self.graph.condition[contact.region]
        if node.region == 0 or condition is None:
            return node
        return self.graph.make("join", condition, node, 0.0, extra=node.region)

    def _without(self, number: int, given: Mapping[Node, Any]) -> Node:
        """The normal load of a contact with these loads of others."""
        (normal,) = self.graph.substituted([self.normal[number]], given, {})
        return normal

    def at_rest(self, number: int) -> Node:
        """The size of the normal load of a contact while no other has friction."""
        return abs(self._without(number, dict.fromkeys(self.loads, 0.0)))

    def _loads(self, slips: Mapping[int, Node]) -> dict[int, Node]:
        """The loads of the components ``slips`` at these slips; others are absent."""
        given: dict[Node, Any] = {}
        found: dict[int, Node] = {}
        for number, (contact, own) in enumerate(zip(self.contacts, self.own, strict=True)):
            if own[0] in slips:
                normal = self._without(number, given)
                values = contact.loads_at(tuple(slips[k] for k in own), normal)
                found |= dict(zip(own, values, strict=True))
            given |= {self.loads[k]: found.get(k, self.zero) for k in own}
        return found

    def bounds(self, these: Sequence[int]) -> dict[int, Node]:
        """By how much the residual of each component may be off."""
        loads = {i: TOLERANCE * self._greatest(i) for i in these}
        return {
            k: 1e-14 * abs(self.slip[k])
            + self.relax * self.graph.sum(abs(self.K[k][i]) * loads[i] for i in these)
            for k in these
        }

    def newton(
        self, slips: Mapping[int, Node], bounds: Mapping[int, Node]
    ) -> tuple[dict[int, Node], dict[int, Node], Node]:
        """(steps of the slips, loads on the tangent after them, by how much the
        residual is too large)."""
        graph, c, these = self.graph, self.relax, list(slips)
        loads = self._loads(slips)
        named = {str(k): load for k, load in loads.items()}
        slope = {m: Tangents(graph, {slips[m]: 1.0}).of(named) for m in these}
        residual = [
            self.slip[k] - slips[k] - c * graph.sum(self.K[k][i] * loads[i] for i in these)
            for k in these
        ]
        matrix = [
            [
                c * graph.sum(self.K[k][i] * slope[m][str(i)] for i in these)
                + (1.0 if k == m else 0.0)
                for m in these
            ]
            for k in these
        ]
        self.fixed += [entry for row in matrix for entry in row]
        self.fixed += [change for changes in slope.values() for change in changes.values()]
        steps = dict(zip(these, solved(matrix, residual), strict=True))
        after = {i: loads[i] + graph.sum(slope[m][str(i)] * steps[m] for m in these) for i in these}
        excess: Any = None
        for row, k in enumerate(these):
            over = abs(residual[row]) - bounds[k]
            excess = over if excess is None else graph.make("max", excess, over)
        return steps, after, excess

    def _greatest(self, k: int) -> Node:
        """The greatest size of a load, without those of other contacts."""
        number = self._contact(k)
        law = self.contacts[number].numbers
        return self.at_rest(number) * (law.rise + law.dynamic)

    def _contact(self, k: int) -> int:
        return next(number for number, own in enumerate(self.own) if k in own)

    def guesses(self, these: Sequence[int]) -> dict[int, Node]:
        """The slips from which Newton's method begins: of each contact beside the
        loads that the others have, those in regions first; of each alone where more
        than two are in regions, as the work for all pairs exceeds the turns it saves."""
        graph, c = self.graph, self.relax
        found: dict[int, Node] = {}
        present = [number for number, own in enumerate(self.own) if own[0] in these]
        present.sort(key=lambda number: not self.contacts[number].region)
        optional = [number for number in present if self.contacts[number].region]
        for number in present:
            contact, own = self.contacts[number], self.own[number]
            free = [self.slip[k] for k in own]
            for other in present if len(optional) == 2 else ():
                theirs = self.own[other]
                if other == number:
                    continue
                if contact.region and self.contacts[other].region:  # where this one sticks
                    sticking = free[0] / greater(self.K[own[0]][own[0]], LEAST)
                    at = [self.slip[k] - self.K[k][own[0]] * sticking for k in theirs]
                elif theirs[0] in found:
                    at = [found[k] for k in theirs]
                else:
                    continue
                loads = self.contacts[other].loads_at(tuple(at), self.at_rest(other))
                free = [
                    f - c * graph.sum(self.K[k][o] * v for o, v in zip(theirs, loads, strict=True))
                    for k, f in zip(own, free, strict=True)
                ]
            found |= dict(zip(own, self._guess(number, free), strict=True))
        return {k: found[k] for k in these}

    def _guess(self, number: int, free: Sequence[Node]) -> list[Node]:
        contact, own = self.contacts[number], self.own[number]
        law = getattr(contact.law, "guess", lambda numbers: numbers)(contact.numbers)
        relaxed = [self.relax * self.K[k][k] * self.at_rest(number) for k in own]
        if len(own) == 1:
            return [first_slip(free[0], relaxed[0], law)]
        # In a plane: the size, then the components, whose masses may differ.
        stiff = law.smoothing * (law.rise + law.dynamic)
        ratio = fma(relaxed[0], stiff, 1.0) / fma(relaxed[1], stiff, 1.0)
        for _ in range(2):
            size = sqrt(free[0] * free[0] + free[1] * free[1] * ratio * ratio)
            size = greater(first_slip(size, relaxed[0], law), 1e-12)
            f = contact.law(size, law)
            ratio = fma(relaxed[0], f, size) / fma(relaxed[1], f, size)
        return [v * size / fma(r, f, size) for v, r in zip(free, relaxed, strict=True)]

    def solve(self, these: Sequence[int], turns: bool) -> tuple[dict[int, Node], ...]:
        """(slips, steps, loads) of the last tangent of Newton's method: its second, or,
        with ``turns``, the first that is exact enough in all lanes."""
        graph = self.graph
        slips, bounds = self.guesses(these), self.bounds(these)
        if not turns:
            steps, _, _ = self.newton(slips, bounds)
            slips = {k: kept(slips[k], slips[k] + steps[k]) for k in these}
            self.fixed += slips.values()
            steps, loads, _ = self.newton(slips, bounds)
            return slips, steps, loads
        region = graph.new_region(None)
        with graph.inside(region):
            now = {k: graph.make("variable", slips[k], extra=(region, k)) for k in these}
            self.fixed += now.values()
            steps, loads, excess = self.newton(now, bounds)
            unfinished = excess > 0.0
            following = [choose(unfinished, kept(now[k], now[k] + steps[k]), now[k]) for k in these]
        graph.loops[region] = Loop([now[k] for k in these], following, unfinished, MOST)
        return now, steps, loads

    def run(self, turns: bool) -> dict[str, Node]:
        """The values at the solution, pushes and moved velocities by name."""
        graph, c, every = self.graph, self.relax, range(self.count)
        always = [k for k in every if not self.contacts[self._contact(k)].region]
        if len(always) == self.count:
            slips, steps, loads = self.solve(always, turns)
        else:
            conditions = dict.fromkeys(
                graph.condition[contact.region] for contact in self.contacts if contact.region
            )
            some: Any = None
            conditions |= {graph.input(closed(side)) > 0.0: None for side in self.sides}
            for condition in conditions:
                some = condition if some is None else some | condition
            region, other = graph.new_region(some), graph.new_region(None)
            graph.otherwise[region] = other
            with graph.inside(region):
                touching = self.solve(every, turns)
            with graph.inside(other):
                alone = self.solve(always, turns) if always else ({}, {}, {})
            slips, steps, loads = (
                {
                    k: graph.make("either", one[k], two.get(k, self.zero), extra=region)
                    for k in every
                }
                for one, two in zip(touching, alone, strict=True)
            )
        self.solution = slips, steps
        push = {
            name: graph.sum(unit[name] * loads[k] for k, unit in enumerate(self.unit))
            for name in self.pushed
        }
        moved = {name: fma(c, push[name], graph.input(f"s.{name}")) for name in self.pushed}
        given: dict[Node, Any] = {graph.input(f"s.{name}"): v for name, v in moved.items()}
        given |= {self.loads[k]: loads[k] for k in every}
        new = graph.substituted(self.values.values(), given, {})
        return {
            **dict(zip(self.values, new, strict=True)),
            **{f"push.{name}": node for name, node in push.items()},
            **{f"moved.{name}": node for name, node in moved.items()},
        }

    def falling(self) -> Node:
        """The growth rate of the slip where friction falls with speed [1/s]."""
        terms = []
        for number, (contact, own) in enumerate(zip(self.contacts, self.own, strict=True)):
            K = self.K[own[0]][own[0]]
            for k in own[1:]:
                K = greater(K, self.K[k][k])
            terms.append(K * self.at_rest(number) * contact.law.steepest_fall(contact.numbers))
        return self.graph.sum(terms)
