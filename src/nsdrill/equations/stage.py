"""A stage of an implicit step: friction solved for from the contacts that equations
declare (:mod:`.library`).

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

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import reduce
from operator import or_
from typing import Any, TypeAlias

from nsdrill.equations.graph import Graph, Loop, Node, Number
from nsdrill.equations.library import Friction, LawNumbers, SteepLaw, choose, fma, greater, sqrt
from nsdrill.equations.passes import Tangents, closed

SATURATION = 0.8  # from 0.64, right for large slips, to 1.57, right for small ones
LEAST = 1e-300
TOLERANCE, MOST = 1e-5, 12  # of the loads, relative; turns of Newton's method
RELAX = "relax"  # the input c [s]


def first_slip(free: Node, relaxed: Node, law: LawNumbers) -> Node:
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
    return choose(following * slip < 0.0, 0.0, following)


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


Key: TypeAlias = Any  # of what was found: the number of a load, a name, or the node that it replaces
# function(stage, slips, steps) -> nodes by name
Further = Callable[["Stage", Mapping[int, Node], Mapping[int, Node]], Mapping[str, Node]]


class Stage:
    """The stage of a traced model, whose slopes, and whatever else the loads or the
    moved velocities change, are ``values``. Numbers count the components of all
    contacts: one of each, or two of a slip in a plane."""

    def __init__(
        self, graph: Graph, values: Mapping[str, Node], pushed: Sequence[str], sides: Sequence[str] = (), quick: int = 2
    ) -> None:
        self.graph, self.pushed, self.sides = graph, tuple(pushed), tuple(sides)
        self.instead: list[tuple[Node, Node]] = []  # residuals, and how they change
        self.zero = graph.node(0.0)
        self.relax = graph.input(RELAX)
        self.contacts: list[Friction] = graph.frictions
        self.contact_of = [contact for contact in self.contacts for _ in contact.loads]  # of each component
        self.count = len(self.contact_of)
        # The components of each contact.
        self.own = [[k for k in range(self.count) if self.contact_of[k] is contact] for contact in self.contacts]
        # Whether two tangents of Newton's method are not enough.
        self.turns = self.count > quick or any(isinstance(contact.law, SteepLaw) for contact in self.contacts)
        self.loads = [graph.input(f"load.{k}") for k in range(self.count)]
        every = [load for contact in self.contacts for load in contact.loads]
        given: dict[Node, Number] = dict(zip(every, self.loads, strict=True))
        self.normal = self._normals(given)
        # Where a normal load depends on no other, its product with what it pushes is taken
        # once: the load is then that of a unit.
        factors = [None if set(self.loads) & set(graph.live([normal])) else normal for normal in self.normal]
        for factor, own in zip(factors, self.own, strict=True):
            if factor is not None:
                given |= {every[k]: self.loads[k] * factor for k in own}
        self.normal = [
            normal if factor is None else graph.node(1.0)
            for factor, normal in zip(factors, self._normals(given), strict=True)
        ]
        free = graph.substituted(values.values(), given, {})
        self.values = dict(zip(values, free, strict=True))
        self.slip: dict[int, Node] = {}  # without friction, of each component
        self.unit: dict[int, dict[str, Node]] = {}  # what a load pushes
        self.K: dict[tuple[int, int], Node] = {}
        self.relaxed: dict[tuple[int, int], Node] = {}  # c K
        self._along: dict[int, dict[str, Node]] = {}  # how a slip follows the velocities
        self.always = [k for k in range(self.count) if not self.contact_of[k].region]
        self._couple(self.always)

    def _normals(self, given: Mapping[Node, Number]) -> list[Node]:
        wanted = [contact.normal for contact in self.contacts]
        found = self.graph.substituted(wanted, given, {})
        return [self._outside(node, contact) for node, contact in zip(found, self.contacts, strict=True)]

    def _couple(self, these: Sequence[int]) -> None:
        """What the components ``these`` need, made in the present region."""
        graph = self.graph
        pushes = {name: self.values[f"slope.{name}"] for name in self.pushed}
        for contact, own in zip(self.contacts, self.own, strict=True):
            if own[0] not in these:
                continue
            for k, slip in zip(own, contact.slips, strict=True):
                self.slip[k] = self._outside(slip, contact)
                self.unit[k] = Tangents(graph, {self.loads[k]: 1.0}).of(pushes)
                self._along[k] = {
                    name: Tangents(graph, {graph.input(f"s.{name}"): 1.0}).of({"": self.slip[k]})[""]
                    for name in self.pushed
                }
        for k, along in self._along.items():
            for i, unit in self.unit.items():
                if (k, i) not in self.K:
                    self.K[k, i] = -self._dot((along[name], unit[name]) for name in self.pushed)
                    self.relaxed[k, i] = self._product(self.relax, self.K[k, i])

    def _product(self, a: Node, b: Node) -> Node:
        return self.zero if a.zero or b.zero else a * b

    def _dot(self, pairs: Iterable[tuple[Node, Node]]) -> Node:
        """The sum of products; those with a zero are left out."""
        return self.graph.sum(a * b for a, b in pairs if not (a.zero or b.zero))

    def _outside(self, node: Node, contact: Friction) -> Node:
        """A value of the contact's region outside of it, 0 where that is not needed."""
        condition = self.graph.condition[contact.region]
        if node.region == 0 or condition is None:
            return node
        return self.graph.make("join", condition, node, 0.0, extra=node.region)

    def _without(self, number: int, given: Mapping[Node, Number]) -> Node:
        """The normal load of a contact with these loads of others."""
        (normal,) = self.graph.substituted([self.normal[number]], given, {})
        return normal

    def at_rest(self, number: int) -> Node:
        """The size of the normal load of a contact while no other has friction."""
        return abs(self._without(number, dict.fromkeys(self.loads, 0.0)))

    def _loads(self, unknowns: Mapping[int, Node]) -> tuple[dict[int, Node], dict[int, Node]]:
        """(slips, loads) of the components ``unknowns``; others are absent. An unknown
        is the slip, but for a :class:`SteepLaw`."""
        given: dict[Node, Number] = {}
        slips, found = dict(unknowns), dict[int, Node]()
        for number, (contact, own) in enumerate(zip(self.contacts, self.own, strict=True)):
            if own[0] in unknowns:
                normal, law, k = self._without(number, given), contact.law, own[0]
                if isinstance(law, SteepLaw):
                    slips[k], value = law.at(unknowns[k], self.slip[k], contact.numbers)
                    found[k] = normal * value
                else:
                    values = contact.loads_at(tuple(slips[k] for k in own), normal)
                    found |= dict(zip(own, values, strict=True))
            given |= {self.loads[k]: found.get(k, self.zero) for k in own}
        return slips, found

    def bounds(self, these: Sequence[int]) -> dict[int, Node]:
        """By how much the residual of each component may be off, from the greatest loads;
        that of a :class:`SteepLaw` is not known."""
        loads: dict[int, Node] = {}
        for number, (contact, own) in enumerate(zip(self.contacts, self.own, strict=True)):
            if own[0] in these and not isinstance(contact.law, SteepLaw):
                greatest = contact.numbers.rise + contact.numbers.dynamic
                loads |= dict.fromkeys(own, self.at_rest(number) * greatest)
        return {k: 1e-14 * abs(self.slip[k]) + self._share(k, loads) for k in these}

    def _share(self, k: int, loads: Mapping[int, Node]) -> Node:
        """What the tolerance of these ``loads`` is worth as a slip."""
        return self._dot((abs(self.relaxed[k, i]), TOLERANCE * load) for i, load in loads.items())

    def newton(
        self, unknowns: Mapping[int, Node], bounds: Mapping[int, Node]
    ) -> tuple[dict[int, Node], dict[int, Node], Node]:
        """(steps of the unknowns, loads on the tangent after them, by how much the
        residual is too large)."""
        graph, these = self.graph, list(unknowns)
        slips, loads = self._loads(unknowns)
        named = {f"load.{k}": load for k, load in loads.items()}
        named |= {f"slip.{k}": slip for k, slip in slips.items()}
        slope = {
            m: {name: graph.fixed(change) for name, change in Tangents(graph, {unknowns[m]: 1.0}).of(named).items()}
            for m in these
        }
        residual = [self.slip[k] - slips[k] - self._dot((self.relaxed[k, i], loads[i]) for i in these) for k in these]
        matrix = [
            [
                self._dot((self.relaxed[k, i], slope[m][f"load.{i}"]) for i in these) + slope[m][f"slip.{k}"]
                for m in these
            ]
            for k in these
        ]
        matrix = [[graph.fixed(entry) for entry in row] for row in matrix]
        steps = dict(zip(these, solved(matrix, residual), strict=True))
        after = {i: loads[i] + self._dot((slope[m][f"load.{i}"], steps[m]) for m in these) for i in these}
        # The loads of the solution change with what they slow down, and with their normal
        # loads.
        for k, r in zip(these, residual, strict=True):
            change = self.slip[k] - slips[k]
            change = change - self._dot((self.relaxed[k, i], graph.fixed(after[i])) for i in these)
            change = change - self._dot((graph.fixed(self.relaxed[k, i]), loads[i]) for i in these)
            self.instead.append((r, change))
        steep = {i: abs(loads[i]) for i in these if isinstance(self.contact_of[i].law, SteepLaw)}
        over = [abs(r) - bounds[k] - self._share(k, steep) for k, r in zip(these, residual, strict=True)]
        return steps, after, reduce(lambda a, b: graph.make("max", a, b), over)

    def guesses(self, these: Sequence[int]) -> dict[int, Node]:
        """The slips from which Newton's method begins: of each contact beside the
        loads that the others have, those in regions first; of each alone where more
        than two are in regions, as the work for all pairs exceeds the turns it saves."""
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
                    sticking = free[0] / greater(self.K[own[0], own[0]], LEAST)
                    at = [self.slip[k] - self.K[k, own[0]] * sticking for k in theirs]
                elif theirs[0] in found:
                    at = [found[k] for k in theirs]
                else:
                    continue
                loads = self.contacts[other].loads_at(tuple(at), self.at_rest(other))
                free = [
                    f - self._dot((self.relaxed[k, o], v) for o, v in zip(theirs, loads, strict=True))
                    for k, f in zip(own, free, strict=True)
                ]
            found |= dict(zip(own, self._guess(number, free), strict=True))
        return {k: found[k] for k in these}

    def _guess(self, number: int, free: Sequence[Node]) -> list[Node]:
        contact, own = self.contacts[number], self.own[number]
        relaxed = [self.relaxed[k, k] * self.at_rest(number) for k in own]
        if isinstance(contact.law, SteepLaw):
            return [contact.law.begin(free[0], relaxed[0], contact.numbers)]
        law = contact.law.guess(contact.numbers)
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

    def solve(self, these: Sequence[int], further: Further) -> dict[Key, Node]:
        """The loads on the last tangent of Newton's method by their numbers, and what
        is ``further`` found there, by name. It is the second tangent, or, with
        :attr:`turns`, the first that is exact enough in all lanes."""
        graph = self.graph
        slips, bounds = self.guesses(these), self.bounds(these)
        if not self.turns:
            steps, _, _ = self.newton(slips, bounds)
            slips = {k: graph.fixed(kept(slips[k], slips[k] + steps[k])) for k in these}
            steps, loads, _ = self.newton(slips, bounds)
            return {**self._found(loads), **further(self, slips, steps)}
        region = graph.new_region(None)
        with graph.inside(region):
            now = {k: graph.make("variable", slips[k], extra=(region, k)) for k in these}
            steps, loads, excess = self.newton(now, bounds)
            others = further(self, now, steps)
            unfinished = excess > 0.0
            following = [choose(unfinished, kept(now[k], now[k] + steps[k]), now[k]) for k in these]
        graph.loops[region] = Loop([now[k] for k in these], following, unfinished, MOST)
        return {**self._found(loads), **others}

    def _found(self, loads: Mapping[int, Node]) -> dict[Key, Node]:
        """The loads, the pushes by them and the growth rate of the slip where friction
        falls with speed [1/s]."""
        growths = []
        for number, (contact, own) in enumerate(zip(self.contacts, self.own, strict=True)):
            if own[0] in loads:
                K = self.K[own[0], own[0]]
                for k in own[1:]:
                    K = greater(K, self.K[k, k])
                growths.append(K * self.at_rest(number) * contact.law.steepest_fall(contact.numbers))
        return {
            **loads,
            **{
                f"push.{name}": self._dot((self.unit[k][name], load) for k, load in loads.items())
                for name in self.pushed
            },
            "falling": self.graph.sum(growths),
        }

    def _leaving(self, conditions: Sequence[Node], found: Mapping[Key, Node], outside: bool = False) -> dict[Key, Node]:
        """The values that leave regions with these ``conditions`` with the loads of the
        solution, where the moved velocities do not change them; ``outside`` where no
        lane needs the regions."""
        graph = self.graph
        given: dict[Node, Number] = {load: found.get(k, self.zero) for k, load in enumerate(self.loads)}
        moved = {graph.input(f"s.{name}") for name in self.pushed}
        here = dict.fromkeys(range(len(graph.parent)), graph.region)
        depends: dict[Node, tuple[bool, bool]] = {}
        values: dict[Key, Node] = {}
        for node in graph.live(self.values.values()):
            loaded, moves = (any(depends[arg][side] for arg in node.args) for side in (0, 1))
            depends[node] = loaded or node in given, moves or node in moved
            if node.op == "join" and node.args[0] in conditions and depends[node] == (True, False):
                part = node.args[2] if outside else node
                (values[node],) = graph.substituted([part], given | values, here)
        return values

    def run(self, further: Further = lambda *_: {}) -> dict[str, Node]:
        """The values at the solution, pushes, moved velocities and ``falling`` by name; what
        ``further(stage, slips, steps)`` makes of the last tangent, at these slips and
        the steps from them."""
        graph, c, every = self.graph, self.relax, range(self.count)
        always = self.always
        if len(always) == self.count:
            found = self.solve(always, further)
        else:
            theirs = (graph.condition[contact.region] for contact in self.contacts)
            closing = [condition for condition in theirs if condition is not None]
            conditions = list(dict.fromkeys([*closing, *(graph.input(closed(side)) > 0.0 for side in self.sides)]))
            some = reduce(or_, conditions)
            region, other = graph.new_region(some), graph.new_region(None)
            graph.otherwise[region] = other
            with graph.inside(region):
                self._couple([k for k in every if k not in always])
                touching = self.solve(every, further)
                touching |= self._leaving(conditions, touching)
            with graph.inside(other):
                alone = self.solve(always, further) if always else {}
                alone |= self._leaving(conditions, alone, outside=True)
            found = {
                name: graph.make("either", value, alone.get(name, self.zero), extra=region)
                for name, value in touching.items()
            }
        loads = {self.loads[k]: found.pop(k) for k in every}
        moved = {name: fma(c, found[f"push.{name}"], graph.input(f"s.{name}")) for name in self.pushed}
        given: dict[Node, Number] = {graph.input(f"s.{name}"): v for name, v in moved.items()}
        given |= loads
        given |= {node: found.pop(node) for node in [*found] if isinstance(node, Node)}
        new = graph.substituted(self.values.values(), given, {})
        return {
            **dict(zip(self.values, new, strict=True)),
            **{f"moved.{name}": node for name, node in moved.items()},
            **found,
        }
