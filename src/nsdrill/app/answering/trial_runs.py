"""The trials of one setting, as they are run.

A trial is a ramp of the speed and of the weight, held at its end for ``SETTLE`` and
observed for ``OBSERVE`` seconds. How it ended, the thresholds of the study say, by the
features of the observation. Ways in start at the lowest speed of the sweep, and some lower; what disturbs
a setting starts where a way in ended free, so that it is disturbed as it is drilled. Where
the model does not tell to which speed stick-slip lasts, the corners of what to stay within
are also started with the bit at rest.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import replace
from functools import cached_property
from math import pi
from typing import TypeVar

import numpy as np

from nsdrill import interrupt
from nsdrill.analysis.advice import FASTEST, WayIn, names_of
from nsdrill.analysis.confirmed import best_stretch, ordered
from nsdrill.analysis.trials import (
    HELD,
    HELD_IN_CORNER,
    OFF_ROCK,
    ON_WALL,
    SLOWED,
    SPEED_FIRST,
    TAGGED,
    TAGGED_IN_CORNER,
    TO_CORNER,
    WEIGHT_FIRST,
    Outcome,
    Trial,
    Trials,
    Way,
    free_from,
    free_stretches,
    hopeful,
)
from nsdrill.app.answering.remedies import AS_IT_IS, Changed
from nsdrill.app.running.stages import Watch
from nsdrill.app.simulating.integration import points_of, run_schedule
from nsdrill.app.simulating.motions import MAX_STEPS, Motions
from nsdrill.app.simulating.trajectory import is_implicit
from nsdrill.compiler.functions import compiling
from nsdrill.data import Array
from nsdrill.errors import NsdrillError, count
from nsdrill.models.friction import METHODS
from nsdrill.models.operation import Hoisted, Operation, Ramp, Schedule
from nsdrill.models.registry import BY_NAME, checks_of, model_named
from nsdrill.models.responses import RESPONSES, STALLED, Response, severity_labels
from nsdrill.records import dataclass
from nsdrill.study.study import Study
from nsdrill.sweep.engine import Progress
from nsdrill.variables import OK

RPM = pi / 30  # rad/s
WEIGHT_RATES = (0.2 * RPM, 1.0 * RPM, 10.0 * RPM)  # rad/s^2
SPEED_RATES = (0.2 * RPM, 1.0 * RPM, 3.0 * RPM, 5.0 * RPM, 10.0 * RPM)
SETTLE, OBSERVE = 60.0, 60.0  # s
FIRST = 20.0  # s at the lowest speed
PAUSE = 10.0  # s between the end of one ramp and the next
SET_DOWN = (5.0, 20.0)  # s in which the weight is set
# s in which the weight is set, and for which one waits between the weight and the speed: ways in have the first two in
# turn, and every rate that is recommended is tried in the others as well, as the phase decides in which the bit meets
# the rock: over lobes of 1 mm rates of which three such trials were free vibrate in a third of them or more
MANNERS = ((5.0, 20.0), (20.0, 20.0))
OTHERS = ((20.0, 0.0), (5.0, 61.1), (5.0, 0.0), (20.0, 120.0), (20.0, 41.7), (5.0, 93.3), (20.0, 76.9))
# of the lowest speed, where those of OTHERS begin that raise the speed past the wall's: where a rise begins decides in
# which phase of its swing the bit comes there, and to the end
BEGUN = (0.5, 0.75, 0.25, 0.6, 0.4, 0.9, 0.33)
WAITS = (0.0, 120.0)  # s, the shortest and the longest of these waits
FEW = 2  # of these others, at every rate before the rest: most rates that vibrate do so in one of these
TAG = 20.0  # s in which it is set again, carefully
MORE = 8  # ways in between those that ended free, as a few may do so by chance
EXCURSION = 0.1  # of the speed
EXCURSION_RATE = 10.0 * RPM  # rad/s^2, that of a knob which is turned
LOWERING_RATE = RPM  # rad/s^2
LIFT, LEAST_LIFT = 2.0, 5e-3  # of how deep the bit is in the rock and of the lobes; m
BELOW = 0.4  # of the speed, from which it is raised where the sweep has no lower one
INTERRUPTED = "interrupted"
TRIED, OF_TRIED = 4, 25000.0  # changes that have trials, as a rule, and s simulated in those of one
FREE_COST = 0.6  # of what a second of the string as it is costs, where most of its motions roll: that of trials

BUSY = 0.8  # of the time of a thread, below which others take the rest
SIDE_BY_SIDE = 2.0  # what chains of several weights cost by one of them
NOW = "on this machine as it is loaded now"

Knots = Mapping[str, Sequence[tuple[float, float]]]  # of each ramp the times [s] and the values


def _about(seconds: float) -> str:
    return f"about {max(seconds, 1.0):.0f} s"


class Told:
    """What is told of the progress of trials and of changes of the string, by ``watch``: how many they are and, when
    some trials have been timed, about how long all take."""

    def __init__(self, watch: Watch, workers: int = 1) -> None:
        self.watch, self.workers, self.price = watch, workers, ""
        self.changes, self.abreast = 0, workers
        self.of_ways_up, self.of_one, self.is_sure = 0.0, 0.0, False
        self.began, self.compiled = time.monotonic(), compiling.seconds
        self.begin()

    def foresee(self, changed: Changed, is_sure: bool, is_first: bool = False) -> None:
        """The changes of the string that follow for ``is_sure``, or else where trials withdraw the setting: each way
        up, and the trials of the best of them, at the cost of motions that vibrate as well. What ``is_first``,
        before any trial of the setting, is told at once."""
        found, self.is_sure = changed.all(), is_sure
        self.changes = len(found)
        began, used = time.monotonic(), time.process_time()
        rate = changed.rate()
        # what others leave of a busy machine does not grow with the threads
        is_busy = time.process_time() - used < BUSY * (time.monotonic() - began)
        self.abreast = 1 if is_busy else min(self.workers, len(found))
        ways_up = [changed.seconds(one) for one in found]
        self.of_ways_up = rate * max(sum(ways_up) / self.abreast, max(ways_up))
        alone = rate / (SIDE_BY_SIDE if len(changed.wobs(AS_IT_IS)) > 1 else 1.0)
        self.of_one = alone * OF_TRIED * FREE_COST / self.abreast
        if is_first:
            self.price = f"{self._of_changes()}, {NOW}"

    def _of_changes(self) -> str:
        trials = f"trials of those that help, {_about(TRIED * self.of_one)} more"
        return f"{count(self.changes, 'change')}, {_about(self.of_ways_up)}, and {trials}"

    def timed(self, trials: int, simulated: float, left: float) -> None:
        """Trials, of ``simulated`` [s] in all, have ended; ``left`` [s] are left of the ``trials``, beside the
        changes, of which the best has as many."""
        if self.price:  # all of it is told before
            return
        own = (time.monotonic() - self.began - (compiling.seconds - self.compiled)) * left / simulated
        if self.changes:  # how busy the machine is was seen
            own *= min(self.workers, trials) / min(self.abreast, trials)
        self.price = f"{count(trials, 'trial')}, {_about(own)}"
        if self.changes:
            joined = "; " if self.is_sure else "; where they withdraw the setting "
            self.price += f"{joined}{self._of_changes()}"
        self.price += f", {NOW}"

    def begin(self) -> None:
        """Measure what changes take from here on."""
        self.mark = time.monotonic() - compiling.seconds

    def _since(self) -> float:
        """The time since then, without that of compiling."""
        return time.monotonic() - compiling.seconds - self.mark

    def ran_changes(self, helping: int) -> None:
        """All ways up have ended since then; trials of at most so many of the changes follow, as much dearer or cheaper
        than was foreseen as these were."""
        if self.of_ways_up > 0.0:
            self.of_one *= self._since() / self.of_ways_up
        self._follows(helping)

    def ran_one(self, left: int) -> None:
        """The trials of a change have ended since then; of at most so many are ``left``."""
        self.of_one = self._since()
        self._follows(left)

    def _follows(self, left: int) -> None:
        if left:
            self.price = f"trials of {count(left, 'change')} at most, {_about(left * self.of_one)} more, as measured"

    def at(self, done: int, total: int, note: str, failed: int = 0) -> None:
        self.watch(Progress(total, done=done, failed=failed, note=note, price=self.price))


@dataclass(frozen=True)
class Plan:
    """What a trial does: it runs along the ``knots`` [s, SI], from the start of the study or
    from a ``state``, ``at`` another setting than the point's where it has one, and is then
    held."""

    name: str
    way: Way
    knots: Knots
    rate: float | None = None
    state: Array | None = None
    at: Operation | None = None
    there: float | None = None
    """The speed of an excursion [rad/s]."""
    set_in: float | None = None
    held: float | None = None
    begun: float | None = None

    @property
    def seconds(self) -> float:
        """The time until the end of the observation [s]."""
        return self.end + SETTLE + OBSERVE

    @property
    def end(self) -> float:
        return max((times[-1][0] for times in self.knots.values()), default=0.0)


class Ended(dict[int, tuple[Trial, Array | None]]):
    """The trials that ended, by their place in the plans, each with its last state."""

    @property
    def failed(self) -> int:
        """How many of them have failed."""
        return sum(trial.outcome == Outcome.UNKNOWN for trial, _ in self.values())


@dataclass(frozen=True)
class Bench:
    """The trials of the point at ``values`` of the axes, in the ``motions`` of a file that
    swept these ``speeds`` [rad/s]. The stretch in which to stay begins at ``low``."""

    motions: Motions
    values: Mapping[str, float]
    speeds: Array
    low: float | None = None
    severity: int | None = None
    corners: tuple[tuple[float, float], ...] = ()
    """The speed [rad/s] and the weight [N] of the corners of what to stay within."""
    modelled: bool = False
    """Whether the model tells to which speed stick-slip lasts."""
    advised: WayIn | None = None
    """The way in that is ordered without trials, whose rates are tried."""

    @cached_property
    def study(self) -> Study:
        """The study of the point. A trial that takes too many steps has failed."""
        study = self.motions.at(self.values)
        most = min(study.simulation.max_steps, MAX_STEPS)
        return replace(study, simulation=replace(study.simulation, max_steps=most))

    @property
    def point(self) -> Operation:
        return self.study.operation

    @property
    def first(self) -> float:
        """The speed at which the ways in begin [rad/s]."""
        lowest = float(np.min(np.asarray(self.speeds, dtype=float)))
        return lowest if lowest <= (1.0 - EXCURSION) * self.point.rotary_speed else BELOW * self.point.rotary_speed

    @cached_property
    def hanging(self) -> float | None:
        """The weight with which the bit hangs clear of the rock off bottom [N]; None where the model knows
        none."""
        return model_named(self.study.model.name).hanging(points_of(self.study, self.point))

    @property
    def off_bottom(self) -> float:
        """The weight off bottom [N]: below zero over lobes, whose crests a bit without weight touches."""
        return self.hanging or 0.0

    def _lowered(self, seconds: float, wob: float | None = None) -> float:
        """How long a bit off bottom is lowered [s] until it has the weight ``wob`` [N], by default the point's, which
        is set in these ``seconds``."""
        weight = self.point.wob if wob is None else wob
        return seconds * (1.0 - self.off_bottom / weight) if self.off_bottom < 0.0 else seconds

    # What is run

    @cached_property
    def first_rates(self) -> dict[str, tuple[float, ...]]:
        """The rates of each order that are tried before others between them: with the speed first those that are
        ordered as well."""
        way = self.advised
        asked = (way.rate, way.swing_rate) if way is not None and way.crosses else ()
        known = {rate for rate in asked if rate and rate <= FASTEST}
        return {SPEED_FIRST: tuple(sorted(known.union(SPEED_RATES))), WEIGHT_FIRST: WEIGHT_RATES}

    @property
    def _repeated(self) -> int:
        """How many ways in there are in other manners, where both orders are free at all rates."""
        return len(OTHERS) * (sum(map(len, self.first_rates.values())) + MORE)

    def ways_in(self) -> list[Plan]:
        """The weight first, then the speed; and the speed first, with no weight."""
        return [plan for name in (WEIGHT_FIRST, SPEED_FIRST) for plan in self._at_rates(name, self.first_rates[name])]

    def _at_rates(self, name: str, rates: Sequence[float]) -> list[Plan]:
        """Ways in of an order, with the weight set quickly and slowly in turn."""
        return [self._way_in(name, rate, MANNERS[number % len(MANNERS)]) for number, rate in enumerate(rates)]

    def _way_in(self, name: str, rate: float, manner: tuple[float, float]) -> Plan:
        """That of one order at one rate, in a manner of :data:`MANNERS`: it begins off bottom at the lowest speed, or
        where :data:`BEGUN` says."""
        first, speed, lifted, (set_in, held) = self.first, self.point.rotary_speed, self.off_bottom, manner
        if name == SPEED_FIRST and manner in OTHERS and self.advised is not None and self.advised.crosses:
            first *= BEGUN[OTHERS.index(manner)]
        lowered, up = self._lowered(set_in), (speed - first) / rate
        is_first = name == WEIGHT_FIRST
        set_at = PAUSE if is_first else FIRST + up + held
        raised_at = PAUSE + lowered + held if is_first else FIRST
        knots: Knots = {
            "rotary_speed": ((0.0, first), (raised_at, first), (raised_at + up, speed)),
            "wob": ((0.0, lifted), (set_at, lifted), (set_at + lowered, self.point.wob)),
        }
        return Plan(name, Way.IN, knots, rate, set_in=set_in, held=held, begun=first)

    def further(self, ended: Sequence[Trial]) -> list[Plan]:
        """The ways in that are to be run after those that ``ended``, until what is recommended is sure."""
        return self.more_ways_in(ended) or self.repeated(ended)

    def more_ways_in(self, ended: Sequence[Trial]) -> list[Plan]:
        """Further ways in, of the order that is best by those that ``ended``, between its rates that are free; none
        where it has them already, so that it was chosen after them, or where there is no such range."""
        trials = Trials(tuple(ended))
        first = self.first_rates
        tried = {name: len(trials.rates(name)) for name in first}
        judged = {name: free_stretches if tried[name] > len(rates) else hopeful for name, rates in first.items()}
        best = best_stretch(trials, judged)
        if best is None or tried[best[0]] > len(first[best[0]]):
            return []
        name, slowest, fastest = best
        assert slowest.rate is not None
        assert fastest.rate is not None
        return self._at_rates(name, np.geomspace(slowest.rate, fastest.rate, MORE + 2)[1:-1].tolist())

    def repeated(self, ended: Sequence[Trial]) -> list[Plan]:
        """Those that are recommended by what ``ended``, in other manners: a few at every rate, and where these were
        free, all; none where all of them have been run. A rate at which one of them vibrates is recommended no more,
        nor are those beside it."""
        trials = Trials(tuple(ended))
        best = best_stretch(trials, dict.fromkeys(self.first_rates, free_stretches))
        if best is None:
            return []
        name, slowest, fastest = best
        least, most = ordered(self.advised, name, slowest, fastest)
        spans = [(name, [one.rate for one in trials.rates(name) if one.rate and least <= one.rate <= most])]
        if name == SPEED_FIRST:
            ways = trials.rates(WEIGHT_FIRST)  # all of them are what the sentence orders where all are free
            slower = ways if free_from(ways) == 0 else trials.slower_ways(least)  # else a slower drive
            spans.append((WEIGHT_FIRST, [one.rate or 0.0 for one in slower]))
        done = {
            (name, rate): sum(one.rate == rate for one in trials.ways_in(name)) - 1
            for name, rates in spans
            for rate in rates
        }
        few = [(*key, OTHERS[had:FEW]) for key, had in done.items() if had < FEW]
        wanted = few or [(*key, OTHERS[had:]) for key, had in done.items()]
        return [self._way_in(name, rate, manner) for name, rate, manners in wanted for manner in manners]

    def disturbances(self, state: Array) -> list[Plan]:
        """What disturbs the point, from a ``state`` in which it is free."""
        speed, wob = self.point.rotary_speed, self.point.wob
        step = EXCURSION * speed
        found = []
        for name, there in (("10 % faster and back", speed + step), ("10 % slower and back", speed - step)):
            ramp = step / EXCURSION_RATE
            knots: Knots = {
                "rotary_speed": ((0.0, speed), (ramp, there), (ramp + PAUSE, there), (2 * ramp + PAUSE, speed))
            }
            found.append(Plan(name, Way.EXCURSION, knots, state=state, there=there))
        found.append(Plan(TAGGED, Way.EXCURSION, {"wob": self._tag(0.0, wob)}, state=state))
        for there, weight in self.corners:
            moved: Knots = {"wob": ((0.0, wob), (SET_DOWN[0], weight))}
            if there != speed:
                moved = {"rotary_speed": ((0.0, speed), (abs(there - speed) / EXCURSION_RATE, there)), **moved}
            found.append(Plan(TO_CORNER, Way.CORNER, moved, state=state))
            found.append(self._tagged_in(there, weight, state))
        if self._moves("bit_speed") and not self.modelled:
            found += [self._held_in(*corner) for corner in self.corners]
        return found + [Plan(name, Way.KNOCK, {}, state=knocked) for name, knocked in self.knocks(state)]

    def _tag(self, begin: float, weight: float) -> tuple[tuple[float, float], ...]:
        """The weight from ``begin`` on of a bit that is picked up, held off bottom and set down again."""
        above, lowered = self.off_bottom, begin + 2 * PAUSE
        return (begin, weight), (begin + PAUSE, above), (lowered, above), (lowered + self._lowered(TAG, weight), weight)

    def _tagged_in(self, there: float, weight: float, state: Array) -> Plan:
        """A pick up and tag in a corner, to which the string goes as in the trial of that."""
        speed = self.point.rotary_speed
        come = max(abs(there - speed) / EXCURSION_RATE, SET_DOWN[0])
        knots: Knots = {
            "rotary_speed": ((0.0, speed), (come, there)),
            "wob": ((0.0, self.point.wob), (SET_DOWN[0], weight), *self._tag(come + PAUSE, weight)),
        }
        return Plan(TAGGED_IN_CORNER, Way.CORNER, knots, state=state)

    def _held_in(self, speed: float, wob: float) -> Plan:
        """The start with the bit at rest in a corner."""
        corner = replace(self.point, rotary_speed=speed, wob=wob)
        state = self.motions.start(replace(self.study, operation=corner))
        state[self._place("bit_speed")] = 0.0
        return Plan(HELD_IN_CORNER, Way.CORNER, {}, state=state, at=corner)

    def _place(self, name: str) -> int:
        return self.motions.states(self.study).index(name)

    def _moves(self, *names: str) -> bool:
        """Whether the string has these states, and they are not held."""
        study = self.study
        held = model_named(study.model.name).held(study.parameters)
        return set(names) <= set(self.motions.states(study)) - set(held)

    def knocks(self, state: Array) -> list[tuple[str, Array]]:
        """The ``state`` after each knock that the string can take, with its name: the bit at
        rest; the bit above the rock; and the collar on the wall, where it rolls backwards
        without slip, of an elastic one with its first bending mode."""
        found = []
        if self._moves("bit_speed"):
            found.append((HELD, self._with(state, {"bit_speed": 0.0})))
        if self._moves("z", "vz"):
            found.append((OFF_ROCK, self._with(state, self._off_rock(state))))
        model, speed = self.study.model, self.point.rotary_speed
        mode = next(
            (end for end in ("", "_1") if self._moves(*(f"{name}{end}" for name in ("x", "y", "vx", "vy")))), None
        )
        if model.hole is not None and mode is not None:
            hole, collar = model.hole(self.study.parameters)
            rolling = {"x": hole - collar, "y": 0.0, "vx": 0.0, "vy": -speed * collar}
            found.append((ON_WALL, self._with(state, {f"{name}{mode}": value for name, value in rolling.items()})))
        return found

    def _with(self, state: Array, values: Mapping[str, float]) -> Array:
        found = np.array(state, dtype=float)
        for name, value in values.items():
            found[self._place(name)] = value
        return found

    def _off_rock(self, state: Array) -> dict[str, float]:
        """The bit above the rock: at the top of the bounce over lobes that may last, where the
        model tells it, and turned so that it comes down in step with them."""
        z, bounce_at = float(state[self._place("z")]), getattr(checks_of(self.study.model), "bounce_at", None)
        turns = self._place("bit_speed") if self._moves("bit_speed") else None
        speed = self.point.rotary_speed if turns is None else float(state[turns])
        bounce = bounce_at and bounce_at(self.study.parameters, self.point, speed)
        if not bounce or bounce.height < z + self._lift:
            return {"z": z + self._lift, "vz": 0.0}
        angle = bounce.phase / self.study.parameters.bit.lobes - float(state[self._place("twist")])
        return {"z": bounce.height, "vz": 0.0, "drive_angle": angle}

    @property
    def _lift(self) -> float:
        """How far a knock lifts the bit [m]: out of the rock, and as far above."""
        depth = abs(float(self.motions.start(self.study)[self._place("z")]))
        lobes = float(getattr(getattr(self.study.parameters, "bit", None), "surface_amplitude", 0.0) or 0.0)
        return max(LIFT * (depth + lobes), LEAST_LIFT)

    def stairs(self) -> list[float]:
        """The speeds to which a vibration is lowered until it ends [rad/s]: to the lowest at
        which the point was free, and then to the lowest of all."""
        speed, first = self.point.rotary_speed, self.first
        low = speed if self.low is None else min(max(self.low, first), speed)
        parts = (np.linspace(speed, low, 3)[1:], np.linspace(low, first, 4)[1:])
        found = np.unique(np.concatenate(parts))[::-1]
        return [float(one) for one in found if one < speed]

    # Running it

    def all(self, found: Trials, workers: int, told: Told) -> Trials:
        """``found`` with all trials of the point: the ways in, and where one of them ended
        free, what disturbs it; each knock that started a vibration is then slowed."""
        stop, plans, ended = threading.Event(), self.ways_in(), Ended()
        slowed: list[Trial] = []
        interrupted = False
        with ThreadPoolExecutor(workers) as threads:
            try:
                self._time(plans, ended, threads, told, stop, workers)
                self._batch(plans, ended, threads, told, stop)
                while more := self.further([ended[number][0] for number in range(len(plans))]):
                    plans += more
                    self._batch(plans, ended, threads, told, stop)
                if (state := self._free(plans, ended)) is not None:
                    plans += self.disturbances(state)
                    self._batch(plans, ended, threads, told, stop)
                    knocked = [ended[number] for number, plan in enumerate(plans) if plan.way == Way.KNOCK]
                    lasting = [(one, last) for one, last in knocked if one.outcome.is_bad and last is not None]
                    running = [threads.submit(self.slowed, *one, stop) for one in lasting]
                    for number, one in enumerate(running):
                        told.at(len(plans) + number, len(plans) + len(running), "trials", ended.failed)
                        slowed.append(result_of(one)[0])
            except KeyboardInterrupt:
                stop.set()
                interrupted = True
        trials = [
            ended[number][0] if number in ended else replace(self._not_run(plan), why=INTERRUPTED)
            for number, plan in enumerate(plans)
        ]
        is_clear = self.hanging is not None
        found = replace(found, interrupted=interrupted, is_cut_short=interrupted)
        return replace(found, trials=(*trials, *slowed), set_down=SET_DOWN, held=WAITS, is_clear=is_clear)

    def of_corners(self, found: Trials, workers: int, told: Told) -> Trials:
        """``found`` with the trials of these corners, as those of :meth:`all`: its first way in
        that ended free is run again."""
        stop, ended = threading.Event(), Ended()
        ways = self.ways_in()
        free = next(number for number, one in enumerate(found.trials) if one.outcome == Outcome.FREE)
        plans: list[Plan] = []
        with ThreadPoolExecutor(workers) as threads:
            try:
                _, state = result_of(threads.submit(self.run, ways[free], stop))
                if state is not None:
                    plans = [plan for plan in self.disturbances(state) if plan.way == Way.CORNER]
                    self._batch(plans, ended, threads, told, stop)
            except KeyboardInterrupt:
                stop.set()
                found = replace(found, interrupted=True, is_cut_short=True)
        return replace(found, trials=(*found.trials, *(ended[number][0] for number in sorted(ended))))

    def _time(
        self,
        plans: Sequence[Plan],
        ended: Ended,
        threads: ThreadPoolExecutor,
        told: Told,
        stop: threading.Event,
        workers: int,
    ) -> None:
        """Run the shortest two of the ``plans`` by themselves, the first as it may load the compiled code; the
        second gives the price of all, further ways in included."""
        order = sorted(range(len(plans)), key=lambda number: plans[number].seconds)[:2]
        for quick in order:
            told.at(len(ended), len(plans), "trials")
            told.began, told.compiled = time.monotonic(), compiling.seconds
            ended[quick] = result_of(threads.submit(self.run, plans[quick], stop))
        later = self.disturbances(self.motions.start(self.study))
        more = (MORE + self._repeated) * sum(plan.seconds for plan in plans) / len(plans)
        left = (sum(plan.seconds for plan in (*plans, *later)) + more) / min(workers, len(plans))
        knocks = sum(plan.way == Way.KNOCK for plan in later)
        slow = knocks * len(self.stairs()) * (SETTLE + OBSERVE) / min(workers, max(knocks, 1))
        told.timed(len(plans) + MORE + self._repeated + len(later) + knocks, plans[order[-1]].seconds, left + slow)

    def _batch(
        self, plans: Sequence[Plan], ended: Ended, threads: ThreadPoolExecutor, told: Told, stop: threading.Event
    ) -> None:
        """Run those of the ``plans`` that have not ended."""
        running = {
            threads.submit(self.run, plan, stop): number for number, plan in enumerate(plans) if number not in ended
        }
        while running:
            told.at(len(ended), len(plans), "trials", ended.failed)
            interrupt.check()
            done, _ = wait(running, timeout=0.1, return_when=FIRST_COMPLETED)
            for future in done:
                ended[running.pop(future)] = future.result()

    def _free(self, plans: Sequence[Plan], ended: Ended) -> Array | None:
        """The last state of the first way in that ended free; None where none did."""
        for number in range(len(plans)):
            trial, state = ended[number]
            if trial.outcome == Outcome.FREE:
                return state
        return None

    def slowed(self, knocked: Trial, state: Array, stop: threading.Event) -> tuple[Trial, Array | None]:
        """What becomes of the vibration of a ``knocked`` string as it is lowered in steps:
        at the first speed at which none of its responses is left, or at the last one."""
        speed, found = self.point.rotary_speed, (replace(knocked, name=SLOWED, after=knocked.name), state)
        for there in self.stairs():
            knots = {"rotary_speed": ((0.0, speed), ((speed - there) / LOWERING_RATE, there))}
            trial, last = self.run(Plan(SLOWED, Way.KNOCK, knots, state=state), stop)
            found = replace(trial, after=knocked.name), state
            left = set(trial.responses) & set(knocked.responses)
            if last is None or (trial.outcome != Outcome.STALLED and not left):
                break
            speed, state = there, last
        return found

    def run(self, plan: Plan, stop: threading.Event) -> tuple[Trial, Array | None]:
        """How a trial ended, and its last state; None where that is not known."""
        trial = self._not_run(plan)
        try:
            with interrupt.while_wanted(lambda: not stop.is_set()):
                return self._run(trial, plan)
        except KeyboardInterrupt:
            return replace(trial, why=INTERRUPTED), None
        except (NsdrillError, ValueError, ArithmeticError) as error:
            return replace(trial, why=str(error).rstrip(".")), None

    @staticmethod
    def _not_run(plan: Plan) -> Trial:
        """The trial of a ``plan``, as long as nothing is known of it."""
        more = {name: getattr(plan, name) for name in ("rate", "there", "set_in", "held", "begun")}
        return Trial(plan.name, plan.way, Outcome.UNKNOWN, **more)

    def _run(self, trial: Trial, plan: Plan) -> tuple[Trial, Array | None]:
        study = self.study if plan.at is None else replace(self.study, operation=plan.at)
        state = plan.state
        if plan.knots:
            ramps = {
                name: Ramp(tuple(at for at, _ in knots), tuple(value for _, value in knots))
                for name, knots in plan.knots.items()
            }
            point = self.point if self.off_bottom >= 0.0 else Hoisted(**vars(self.point))
            schedule = Schedule(point, ramps)
            method = METHODS[1] if is_implicit(study, schedule) else METHODS[0]
            along = replace(study, simulation=replace(study.simulation, method=method))
            if state is None:
                state = model_named(study.model.name).starts(points_of(study, schedule.start), 0)[0]
            ramped = run_schedule(along, schedule, plan.end, np.asarray(state, dtype=float), 2, plan.end)
            if ramped.status != OK:
                return replace(trial, why=BY_NAME["status"].words(ramped.status)), None
            state = ramped.final
            last = schedule.at(np.array([plan.end]))
            operation = Operation(*(float(value[0]) for value in (last.depth, last.wob, last.rotary_speed)))
            study = replace(study, operation=operation)
        assert state is not None
        found = self.motions.observed(study, state, settle=SETTLE, observe=OBSERVE)
        # what a severity allows has not ended, where it is told at which speed that ends
        severity = None if trial.name == SLOWED else self.severity
        outcome, responses, why = verdict(found, severity, study.model.critical)
        ended = replace(trial, outcome=outcome, responses=responses, speed=study.operation.rotary_speed, why=why)
        if plan.way == Way.CORNER:
            ended = replace(ended, wob=study.operation.wob)
        return ended, None if outcome == Outcome.UNKNOWN else np.asarray(found["final_state"], dtype=float)


def verdict(
    found: Mapping[str, Array], severity: int | None, responses: Mapping[str, Response] = RESPONSES
) -> tuple[Outcome, tuple[str, ...], str]:
    """How a run ended that has these status, features and labels, with its ``responses``, and
    why where that is not known; with ``severity`` it is free with responses of that
    severity at most."""
    status = int(found["status"])
    if status != OK:
        return Outcome.UNKNOWN, (), BY_NAME["status"].words(status)
    bits = int(found["response"])
    if bits & STALLED:
        return Outcome.STALLED, names_of(bits, responses), ""
    is_free = bits == 0
    if severity is not None:
        graded = severity_labels(responses.values())
        is_free = all(int(found[name]) <= severity for name in graded if name in found)
    return Outcome.FREE if is_free else Outcome.VIBRATES, () if is_free else names_of(bits, responses), ""


T = TypeVar("T")


def result_of(future: Future[T]) -> T:
    """What a run in a thread gives, unless the process is to end before."""
    while not future.done():
        interrupt.check()
        wait([future], timeout=0.1)
    return future.result()
