"""From seeds to motions that may be followed: which kind of motion a seed has settled on,
and the motion of that kind nearby."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import field, replace

import numpy as np

from nsdrill.analysis.bifurcations import CIRCLE, CYCLE, EQUILIBRIUM, PERIODIC
from nsdrill.data import Array
from nsdrill.errors import count
from nsdrill.orbit.branch import Key
from nsdrill.orbit.circle import MAX_TAIL, Circle, fitted_circle, harmonic_tail
from nsdrill.orbit.flow import Flow, Legs, Task
from nsdrill.orbit.newton import Point, corrected_at_parameter
from nsdrill.orbit.periodic import (
    Cycle,
    Periodic,
    corotating_rates,
    cycle_starts,
    lobe_starts,
    sampled_cycle,
    segment_starts,
    states_on_cycle,
)
from nsdrill.orbit.shooting import Orbit, map_angle, rotated
from nsdrill.orbit.special import Graze
from nsdrill.records import dataclass

# distances in natural scales:
RETURN_TOLERANCE = 0.05  # between the ends of one period of a settled motion
UNSETTLED_TOLERANCE = 2.0  # the same of a motion that may not have settled
MAX_CORRECTION = 3000.0  # by Newton's method, from such a motion
DUPLICATE_DISTANCE = 1e-4  # between equal starts of a motion
GROUP_DISTANCE = 1.5  # between seeds that are likely to lie on one branch
CYCLE_REVOLUTIONS, SAMPLES_PER_REVOLUTION = 24, 96  # of the search for a cycle
CYCLE_PARTS = (2, 3, 5, 7, 11, 13)  # equal parts of a cycle that are looked for: products of these as well


Kind = tuple[str, int]  # of a motion, and its period in lobes


@dataclass(frozen=True)
class Seed:
    """A settled motion: its ``state`` [states] at the drive angle ``phase`` [rad], and
    the ``values`` [parameters] of the continuation parameters. ``near``: it may not
    have settled, and the nearest motion is searched for. ``steady``: it is a guess of
    steady drilling or of the motion over one lobe, which may be unstable. Where its
    ``kind`` and, of a cycle, its ``period`` [s] are known, it is a motion of that kind,
    stable or not."""

    state: Array
    phase: float
    values: Array
    near: bool = False
    steady: bool = False
    kind: Kind | None = None
    period: float = 0.0


@dataclass(frozen=True)
class Orders:
    """The settings of a continuation:

    - ``lobes``, the periods to try, shortest first; doublings are followed up to the
      longest;
    - ``bounds`` of the continuation parameter, in SI;
    - ``points``, the greatest number of points of a branch;
    - ``switch``, whether emanating branches are followed;
    - ``periodic``, ``cycles`` and ``circles``, whether these motions are followed;
    - ``grazes``, the grazing events of the contacts, by place;
    - ``bends``, whether the equations bend at an equilibrium;
    - ``direction`` of the parameter in which the branches of seeds set out, 1 or -1, or 0
      for both.
    """

    lobes: tuple[int, ...]
    bounds: tuple[float, float]
    points: int = 400
    switch: bool = True
    periodic: bool = True
    cycles: bool = True
    circles: bool = True
    grazes: dict[int, Graze] = field(default_factory=dict)
    direction: int = 0
    bends: Callable[[Orbit], bool] = lambda orbit: False


@dataclass(frozen=True)
class Guess:
    """The motion of a ``kind`` that the seed ``number`` seems to have settled on: its
    ``problem``, the unknowns ``x`` nearby, its ``signatures``, and the greatest
    correction of the unknowns by Newton's method, ``max_correction``."""

    number: int
    kind: Kind
    problem: Periodic | Cycle | Circle
    x: Array
    signatures: list[Array]
    max_correction: float


@dataclass(frozen=True)
class Candidate:
    """A converged motion of a ``kind`` from which a branch may be followed, to one side
    only where ``one_side``. ``other`` is the first point on the other side of a branch
    point. ``signatures`` are those of ``point``. Where it ``crosses`` its parent at a branch point it
    begins beside it, and is another branch however near."""

    key: Key
    kind: Kind
    problem: Periodic | Cycle | Circle
    point: Point
    signatures: list[Array]
    parent: int = -1
    parent_point: int = -1
    one_side: bool = False
    other: Point | None = None
    crosses: bool = False


def at_angle_zero(flow: Flow, seeds: list[Seed]) -> list[Seed | None]:
    """The seeds at the drive angle 0; None where the motion cannot be integrated. Those
    of a model with lobes are run on to the next fold of a revolution."""
    symmetry = flow.symmetry
    if not seeds or not symmetry.folds:
        return [replace(seed, state=rotated(symmetry, seed.state, -seed.phase), phase=0.0) for seed in seeds]
    angle, phases = map_angle(flow), np.array([seed.phase for seed in seeds])
    folds = np.ceil(phases / angle - 1e-9)
    values = np.stack([seed.values for seed in seeds])
    durations = np.maximum((folds * angle - phases) / flow.phase_rate(values), 1e-9)
    ends = flow.run(Legs(np.stack([seed.state for seed in seeds]), phases, durations, values))
    states = rotated(symmetry, ends.state, -folds * angle)
    return [
        replace(seed, state=state, phase=0.0) if ok else None
        for seed, state, ok in zip(seeds, states, ends.ok, strict=True)
    ]


def guess_of(flow: Flow, orders: Orders, number: int, seed: Seed | None) -> Task[Guess | str]:
    """The motion that a seed at the drive angle 0 seems to have settled on; a reason
    where it is of no kind that is followed."""
    if seed is None:
        return "the motion could not be integrated"
    if seed.kind is not None:
        return (yield from _known_guess(flow, number, seed, seed.kind))
    if not flow.symmetry.folds:
        return (yield from _smooth_guess(flow, orders, number, seed))
    free, angle = list(flow.symmetry.free), map_angle(flow)
    state_scales = flow.state_scales(seed.values)[0]
    duration = angle / flow.phase_rate(seed.values)
    starts, states, misses = [seed.state], [seed.state], dict[int, float]()

    def guess(lobes: int, max_correction: float) -> Guess:
        problem = Periodic.at(flow, lobes, seed.values, seed.state)
        found = [signature(flow, PERIODIC, seed.values, start[free]) for start in starts[:lobes]]
        x = problem.unknowns(np.stack(states[:lobes]), seed.values[-1])
        return Guess(number, (PERIODIC, lobes), problem, x, found, max_correction)

    for lobes in range(1, max(orders.lobes) + 1) if orders.periodic else ():
        ends = yield Legs(states[-1][None], (lobes - 1) * angle, duration, seed.values)
        if not ends.ok[0]:
            return "the motion could not be integrated"
        states.append(ends.state[0])
        starts.append(rotated(flow.symmetry, ends.state, -lobes * angle)[0])
        if seed.steady:
            return guess(1, MAX_CORRECTION)
        if lobes in orders.lobes:
            misses[lobes] = float(np.max(np.abs((starts[-1] - seed.state) / state_scales)[free]))
            if misses[lobes] < RETURN_TOLERANCE:
                return guess(lobes, 10.0 * RETURN_TOLERANCE)
    if orders.circles and flow.symmetry.turned:
        fitted = yield from fitted_circle(flow, seed.state, seed.values, orders.lobes)
        if fitted is not None:
            problem, x, means = fitted
            rotation = math.remainder(x[-2], 2.0 * math.pi)
            found = [signature(flow, CIRCLE, seed.values, mean[free], rotation) for mean in means]
            return Guess(number, (CIRCLE, problem.lobes), problem, x, found, 1.0)
    if seed.near and misses and min(misses.values()) < UNSETTLED_TOLERANCE:
        return guess(min(misses, key=lambda lobes: misses[lobes]), MAX_CORRECTION)
    reason = "chaotic, stick-slip (a torus over lobes), or not settled"
    return f"neither a period of the lobes asked for nor a circle: {reason}"


def _known_guess(flow: Flow, number: int, seed: Seed, kind: Kind) -> Task[Guess | str]:
    """The motion of a known ``kind`` that a seed lies on."""
    motion, lobes = kind
    if motion == CYCLE:
        cycle = Cycle.at(flow, seed.period, seed.values, seed.state)
        starts = yield from cycle_starts(cycle, seed.state, seed.period, seed.values)
        if starts is None:
            return "the motion could not be integrated"
        x = cycle.unknowns(starts, seed.period, seed.values[-1])
        return Guess(
            number, kind, cycle, x, [signature(flow, CYCLE, seed.values, seed.state, seed.period)], UNSETTLED_TOLERANCE
        )
    problem = Periodic.at(flow, lobes, seed.values, seed.state)
    states = yield from segment_starts(problem, seed.state, seed.values)
    if states is None:
        return "the motion could not be integrated"
    found = [signature(flow, motion, seed.values, seed.state[list(flow.symmetry.free)])]
    x = problem.unknowns(states, seed.values[-1])
    return Guess(number, kind, problem, x, found, UNSETTLED_TOLERANCE)


def _smooth_guess(flow: Flow, orders: Orders, number: int, seed: Seed) -> Task[Guess | str]:
    """The same for equations that are equal at every drive angle: an equilibrium or a
    cycle."""
    free, value = list(flow.symmetry.free), seed.values[-1]
    rates = corotating_rates(flow, seed.state[None], seed.values)[0][free] / flow.state_scales(seed.values)[0][free]
    revolution = 2.0 * math.pi / float(flow.phase_rate(seed.values)[0])
    if np.linalg.norm(rates) * revolution < RETURN_TOLERANCE or seed.steady:
        if not orders.periodic:
            return "a steady motion, which the study does not ask for"
        steady = Periodic.at(flow, 1, seed.values, seed.state)
        found = [signature(flow, EQUILIBRIUM, seed.values, seed.state[free])]
        x = steady.unknowns(seed.state[None], value)
        return Guess(number, (EQUILIBRIUM, 1), steady, x, found, MAX_CORRECTION)
    if not orders.cycles:
        return "a motion that does not stand still, which the study does not ask for"
    interval, samples = revolution / SAMPLES_PER_REVOLUTION, CYCLE_REVOLUTIONS * SAMPLES_PER_REVOLUTION
    sampled = yield from sampled_cycle(flow, seed.state, seed.values, interval, samples)
    if sampled is None:
        return "no cycle: the motion does not come back to its start"
    starts, period = sampled
    cycle = Cycle.at(flow, period, seed.values, starts[0])
    found = [signature(flow, CYCLE, seed.values, starts[0], period)]
    return Guess(number, (CYCLE, 1), cycle, cycle.unknowns(starts, period, value), found, math.inf)


def candidate_of(flow: Flow, guess: Guess) -> Task[Candidate | Guess | str]:
    """The motion near a guess, by Newton's method; a reason where there is none. A motion
    that repeats several times in the period of the guess is no candidate but a guess of that
    motion, over its least period: it may lie on a branch already."""
    point = yield from corrected_at_parameter(guess.problem, guess.x)
    motion, lobes = guess.kind
    if point is None and motion == EQUILIBRIUM and isinstance(guess.problem, Periodic):
        at_rest = _at_rest(flow, guess.problem, guess.x)
        point = None if at_rest is None else (yield from corrected_at_parameter(guess.problem, at_rest))
    if point is None or np.linalg.norm(point.x - guess.x) > guess.max_correction:
        words = f"motion of {count(lobes, 'lobe')}" if motion == PERIODIC else motion.replace("_", " ")
        return f"Newton's method finds no {words} near the seed"
    found, problem = [], guess.problem
    if isinstance(problem, Circle):
        if harmonic_tail(point.found) > MAX_TAIL:
            return "the circle that the motion fills is not smooth"
        circles = yield from problem.images(point.found)
        found = [signature_of_circle(flow, point.found, w) for w in circles]
    elif (parts := (yield from equal_parts(flow, guess.kind, point.found))) > 1:
        return (yield from _part_of(flow, guess, point.found, parts))
    own = found or signatures(flow, guess.kind, point.found)
    return Candidate((0, guess.number), guess.kind, problem, point, own)


def _at_rest(flow: Flow, problem: Periodic, x: Array) -> Array | None:
    """Unknowns near ``x`` at which the rates vanish; None where none are found. They change
    less with the state than the map over a revolution, which rotates it and draws it to
    cycles."""
    from scipy.optimize import root

    values, start = problem.values_at(x), problem.states(x)[0]

    def rates(scaled: Array) -> Array:
        state = problem.states(np.append(scaled, x[-1]))
        return corotating_rates(flow, state, values)[0][problem.free] / problem.state_scales

    found = root(rates, start[problem.free] / problem.state_scales)
    return np.append(found.x, x[-1]) if found.success and np.isfinite(found.x).all() else None


def equal_parts(flow: Flow, kind: Kind, orbit: Orbit) -> Task[int]:
    """The number of equal parts, a prime number, of which an orbit of a ``kind`` consists: a
    motion that repeats several times in what was taken for its period. 1 where that is its
    least period."""
    motion, lobes = kind
    if motion == CYCLE:
        return (yield from _equal_parts_of_cycle(flow, orbit))
    if motion != PERIODIC:
        return 1
    starts, scales = lobe_starts(orbit, flow, lobes), flow.state_scales(orbit.values)[0][list(orbit.free)]
    for parts in (parts for parts in range(2, lobes + 1) if lobes % parts == 0):
        if np.max(np.abs((starts[lobes // parts] - starts[0]) / scales)) < DUPLICATE_DISTANCE:
            return parts
    return 1


def _equal_parts_of_cycle(flow: Flow, orbit: Orbit) -> Task[int]:
    """:func:`equal_parts` of a cycle: at which parts of its period it is at its start again,
    nearer than its size."""
    states = yield from states_on_cycle(flow, orbit, orbit.period / np.array(CYCLE_PARTS))
    if states is None:
        return 1
    free = list(orbit.free)
    offsets = (states - orbit.mesh_states[0])[:, free] / flow.state_scales(orbit.values)[0][free]
    misses = np.max(np.abs(offsets), axis=1)
    is_again = misses < DUPLICATE_DISTANCE * min(1.0, float(misses.max()))
    return CYCLE_PARTS[int(np.argmax(is_again))] if is_again.any() else 1


def _part_of(flow: Flow, guess: Guess, orbit: Orbit, parts: int) -> Task[Guess | str]:
    """The guess of the motion of which an orbit consists of so many equal ``parts``."""
    motion, lobes = guess.kind
    if motion == CYCLE:
        seed = Seed(orbit.state, 0.0, orbit.values, kind=guess.kind, period=orbit.period / parts)
    else:
        seed = Seed(orbit.state, 0.0, orbit.values, kind=(motion, lobes // parts))
    assert seed.kind is not None
    return (yield from _known_guess(flow, guess.number, seed, seed.kind))


def representatives(guesses: list[Guess]) -> list[Guess]:
    """The middle guess of every group of neighbours."""
    groups: list[list[Guess]] = []
    for guess in sorted(guesses, key=lambda guess: (*guess.kind, guess.x[-1], guess.number)):
        for group in reversed(groups):
            if group[-1].kind == guess.kind and _distance(guess, group[-1]) < GROUP_DISTANCE:
                group.append(guess)
                break
        else:
            groups.append([guess])
    return [group[len(group) // 2] for group in groups]


def _distance(guess: Guess, other: Guess) -> float:
    """The distance of two guesses of one kind, from whichever lobe the first begins."""
    return min(float(np.linalg.norm(one - other.signatures[0])) for one in guess.signatures)


# What tells a motion from others of its kind: its signatures, and whether a line of
# them passes near a motion.


def signature(flow: Flow, kind: str, values: Array, state: Array, number: float = 0.0) -> Array:
    """A vector, in natural scales, that tells a motion of a ``kind`` at ``values`` from
    others: of an orbit its start, the free ``state``, and the parameter; of a cycle the
    logarithm of the ``number`` that is its period, and the parameter; of a circle its
    rotation, the ``number``, the mean of w, the free ``state``, and the parameter."""
    parameter = values[-1] / float(flow.scales[-1])
    if kind == CYCLE:
        return np.array([10.0 * math.log(number), parameter])
    scaled = np.append(state / flow.state_scales(values)[0][list(flow.symmetry.free)], parameter)
    return np.append(10.0 * number, scaled) if kind == CIRCLE else scaled


def signatures(flow: Flow, kind: Kind, orbit: Orbit) -> list[Array]:
    """The signatures of an orbit of a kind, one for each lobe at which it may begin."""
    motion, lobes = kind
    if motion == CYCLE:
        return [signature(flow, motion, orbit.values, orbit.state, orbit.period)]
    if motion == CIRCLE:
        return [signature_of_circle(flow, orbit, orbit.mesh_states)]
    return [signature(flow, motion, orbit.values, start) for start in lobe_starts(orbit, flow, lobes)]


def signature_of_circle(flow: Flow, orbit: Orbit, w: Array) -> Array:
    """The signature of a circle, begun at the lobe where its points are ``w``."""
    return signature(flow, CIRCLE, orbit.values, w.mean(axis=0)[list(orbit.free)], orbit.rotation)


def passes_near(line: Array, signatures: list[Array], tolerance: float = 0.0) -> bool:
    """Whether a ``line`` through points [points, coordinates] passes near one of the
    ``signatures`` [coordinates]: nearer than a fifth of the length of the chord there,
    plus 1e-3, plus ``tolerance``."""
    for signature in signatures:
        distances, lengths = _distances_of_chords(line, signature)
        if np.any(distances < 0.2 * lengths + 1e-3 + tolerance):
            return True
    return False


def nearest_chord(line: Array, signatures: list[Array]) -> int:
    """The chord of a ``line`` through points [points, coordinates] that is nearest to one
    of the ``signatures``."""
    return int(np.argmin(np.min([_distances_of_chords(line, one)[0] for one in signatures], axis=0)))


def _distances_of_chords(line: Array, signature: Array) -> tuple[Array, Array]:
    """The distances of a ``signature`` [coordinates] from the chords of a ``line``
    [points, coordinates], and the lengths of these chords."""
    chords, starts = np.diff(line, axis=0), line[:-1]
    square = np.maximum(np.sum(chords**2, axis=1), 1e-300)
    offsets = signature - starts
    fraction = np.clip(np.sum(offsets * chords, axis=1) / square, 0.0, 1.0)
    return np.linalg.norm(offsets - fraction[:, None] * chords, axis=1), np.sqrt(square)
