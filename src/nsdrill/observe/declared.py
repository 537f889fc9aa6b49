"""The observer of a declaration (:mod:`nsdrill.observe.channels`), for any model and
any number of lanes.

Every packed step is examined in all lanes at once: the extremes so far are updated by the
values at the ends of the step, integrals over time are accumulated, and for each channel
the set of lanes is found with an event inside the step: an extremum (the slope changes
its sign) or a level crossing. Events occur in few lanes only, which are then handled one
by one (:mod:`nsdrill.observe.events`). What few lanes need, such as integrals while a
quantity is above its level, is passed over in steps where none does. The results of a
lane do not depend on the other lanes.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

from nsdrill.abi import OBSERVER, Layout
from nsdrill.compiler.functions import LaneFunction, compiled, fma, inlined, masks, packed
from nsdrill.elementary import angle_between
from nsdrill.observe.channels import Channel, Declaration, MeanAbove, Names, RmsOfSlopes, Winding, check
from nsdrill.observe.events import Event, events_of, make_handler
from nsdrill.observe.findings import RETURNS
from nsdrill.observe.inside import CYCLE_LOW, FALLS, HIGH, LOW, MARGIN, NONE, RISES, has_extremum, lower_estimate
from nsdrill.observe.marker import make_marker
from nsdrill.observe.placed import Placed, add_where, always, observed_rows, unbounded
from nsdrill.observe.within import make_follower

__all__ = ["make_observer", "observed_rows"]

# What is done in all lanes for a channel or for several together: of the buffer, the sets
# of lanes, the lane, the step and the ends of the channels so far, to which it may add.
# The step is (whether it is observed, its length, that if it is observed, else 0, one over
# its length).
Measure = Callable[..., tuple[tuple[float, ...], ...]]


@lru_cache
def make_observer(
    lanes: int, rows: Layout, names: Names, declaration: Declaration
) -> tuple[LaneFunction, LaneFunction]:
    """The compiled (observer, marker) of a declaration for a number of lanes and a row
    layout, whose rows have these ``names``. The observer's own rows are the first of
    ``rows.observed``; the layout may be without the rows of the stepper.

    ValueError if declaration, names and layout do not fit together, or a function of
    the declaration cannot be compiled.
    """
    check(names, declaration)
    for what, found, wanted in (
        ("states", len(names.states), rows.own),
        ("slopes", len(names.slopes), rows.own_slopes),
        # further auxiliary outputs may follow those that are named
        ("aux", len(names.aux), min(len(names.aux), rows.aux)),
        ("parameters", len(names.parameters), rows.parameters),
    ):
        if found != wanted:
            raise ValueError(f"names.{what}: found {found} names for {wanted} rows")
    if rows.observed < (least := observed_rows(declaration)):
        raise ValueError(f"rows.observed: found {rows.observed}; allowed: at least {least}, see observed_rows")
    placed = Placed(lanes, rows, names, declaration)
    return _Packed(placed).make(), make_marker(placed)


class _Packed:
    """Makes the observer, which is called every step: all lanes at once."""

    def __init__(self, placed: Placed) -> None:
        self.placed, self.declaration = placed, placed.declaration
        self.events = events_of(placed)
        # The sets of lanes: with each event, returning to the section, above a level for
        # the whole step (a gate, by the name of the TimeAbove), observed.
        self.returning = len(self.events)
        due = self.returning + (self.declaration.section is not None)
        gates = dict.fromkeys(part.above for part in self.declaration.of_kind(MeanAbove))
        self.gates = {name: due + number for number, name in enumerate(gates)}
        self.due, self.observed = tuple(range(due)), due + len(gates)

    def make(self) -> LaneFunction:
        """The compiled observer."""
        placed, rows, W = self.placed, self.placed.rows, self.placed.lanes
        step_, moves_, observing_ = W * rows.step, W * rows.moves, W * rows.observing
        observed, due = self.observed, self.due
        compute_outputs, keep_outputs = self._outputs()
        measures = (
            *(self._channel(channel) for channel in self.declaration.channels),
            *(self._winding(winding) for winding in self.declaration.of_kind(Winding)),
            *(self._slopes(slopes) for slopes in self.declaration.of_kind(RmsOfSlopes)),
        )
        find_returns = self._returns()
        handle_events = make_handler(placed, self.events)
        followers = tuple(make_follower(placed, one) for one in self.declaration.channels if one.within)
        gates = tuple((gate, self._parts(name)) for name, gate in self.gates.items())

        @compiled(OBSERVER)
        def observer(b, store):
            sets = masks(observed + 1)
            for i in packed(W):
                compute_outputs(b, i)
                sets[observed] |= (1 << i) if b[moves_ + i] * b[observing_ + i] != 0.0 else 0
            if sets[observed] != 0:
                for i in packed(W):
                    is_observed, h = b[moves_ + i] * b[observing_ + i] != 0.0, b[step_ + i]
                    step = is_observed, h, h if is_observed else 0.0, 1.0 / h if h > 0.0 else 0.0
                    ends = ()
                    for measure in measures:
                        ends = measure(b, sets, i, step, ends)
                for follow in followers:
                    follow(b)
            find_returns(b, store, sets)
            some = 0
            for number in due:
                some |= sets[number]
            if some & sets[observed] != 0:
                handle_events(b, store, *tuple(sets[number] & sets[observed] for number in due))
            for gate, parts in gates:
                above = sets[gate] & sets[observed]
                if above != 0:
                    for i in packed(W):
                        for part in parts:
                            part(b, i, (above >> i) & 1 != 0)
            keep_outputs(b)

        return observer

    def _outputs(self) -> tuple[Callable[..., None], Callable[..., None]]:
        """The functions that compute the outputs at the end of a step, of one lane, and
        keep them for the start of the next, of all lanes."""
        outputs, W, moves_ = self.declaration.outputs, self.placed.lanes, self.placed.lanes * self.placed.rows.moves
        names = outputs.names if outputs else ()
        results = self.placed.read(outputs.function) if outputs else always
        count, numbered = len(names), tuple((k, self.placed.offset("now", name)) for k, name in enumerate(names))
        kept = tuple((self.placed.offset("before", name), self.placed.offset("now", name)) for name in names)

        @inlined
        def compute(b, i):
            if numbered:
                found = results(b, i)
                assert len(found) == count, "another number of values than the outputs have names"
                for k, now_ in numbered:
                    b[now_ + i] = found[k]

        @inlined
        def keep(b):
            if kept:
                for i in packed(W):
                    moves = b[moves_ + i] != 0.0
                    for before_, now_ in kept:
                        before, now = b[before_ + i], b[now_ + i]
                        b[before_ + i] = now if moves else before

        return compute, keep

    def _returns(self) -> Callable[..., None]:
        """Finds the lanes that return to the section."""
        placed, section, observed, returning = self.placed, self.declaration.section, self.observed, self.returning
        has_section, W, level_ = section is not None, placed.lanes, placed.offset("level")
        angle = placed.read(placed.channel(section.channel).value) if section else unbounded

        @inlined
        def find_returns(b, store, sets):
            if has_section and sets[observed] != 0 and store[RETURNS] > 0.0:
                for i in packed(W):
                    sets[returning] |= (1 << i) if angle(b, i) >= b[level_ + i] else 0

        return find_returns

    # Channels. (Each adds its ends to those of the channels before it.)
    def _channel(self, channel: Channel) -> Measure:
        """Updates the measurements of one channel."""
        if channel.within:
            return _unmeasured
        placed, name, base = self.placed, channel.name, self.placed.base(channel)
        ends_of, detect, integral = placed.ends(channel), self._detection(channel), placed.integral(channel)
        base_ends_of, level = placed.ends(base or channel), placed.level(channel)
        known = placed.number_of[base.name] if base else -1
        is_base_known, is_rate = 0 <= known < placed.number_of[name], base is not None
        passages_, integral_ = (placed.offset(what, name) for what in ("passages", "integral"))

        @inlined
        def measure(b, sets, i, step, others):
            is_observed, h, _, _ = step
            ends = ends_of(b, i)
            detect(b, sets, i, step, ends)
            if passages_ != NONE:
                rises = ends[0] <= level(b, i) and ends[3] > level(b, i)
                add_where(b, passages_ + i, is_observed, 1.0 if rises else 0.0)
            base_ends = ends
            if is_rate:
                base_ends = others[known] if is_base_known else base_ends_of(b, i)
            if integral_ != NONE:
                add_where(b, integral_ + i, is_observed, integral(b, i, h, ends, base_ends))
            return (*others, ends)

        return measure

    def _detection(self, channel: Channel) -> Callable[..., None]:
        """Finds the events of a channel, and updates what steps without an event add."""
        found = [(number, event) for number, event in enumerate(self.events) if event.channel is channel]
        if not found:
            return _nothing
        first = found[0][0]
        if channel.inside:
            return self._maxima(channel, first)
        is_followed, extremes = self.placed.is_followed(channel.name), self._extremes(channel)
        crossings = [(number, self._crossing(event)) for number, event in found if event.above]
        cross = crossings[0][1] if crossings else _never
        further = tuple(crossings[1:])

        @inlined
        def detect(b, sets, i, step, ends):
            g0, d0, _, g1, d1, _ = ends
            extremum_inside = has_extremum(d0, d1) and is_followed(b, i)
            happens = extremes(b, i, step, g0, d0, g1, d1, extremum_inside)
            crosses = cross(b, sets, i, step, g0, d0, g1, d1, extremum_inside)
            sets[first] |= (1 << i) if happens or crosses else 0
            for number, cross_other in further:
                crosses = cross_other(b, sets, i, step, g0, d0, g1, d1, extremum_inside)
                sets[number] |= (1 << i) if crosses else 0

        return detect

    def _extremes(self, channel: Channel) -> Callable[..., bool]:
        """Updates the extremes of a channel; whether one inside the step matters, or the
        end of a maximum or of a cycle."""
        placed, name, W = self.placed, channel.name, self.placed.lanes
        found = self.declaration.extremes.get(name)
        if found is None:
            return _never
        maxima, smooth, may_jump = found.maxima, found.smooth, placed.is_followed(name) is not always
        has_bounds = smooth and name not in self.declaration.channels_with_peaks  # others change nothing
        least_, greatest_, low_ = (placed.offset(what, name) for what in ("least", "greatest", LOW))
        growth_, high_, margin_ = placed.offset("growth"), low_ + HIGH * W, low_ + MARGIN * W
        is_counted, cycles_ = name in self.declaration.counted, placed.offset("cycle", CYCLE_LOW, name)
        rises_, falls_ = cycles_ + RISES * W, cycles_ + FALLS * W

        @inlined
        def extremes(b, i, step, g0, d0, g1, d1, extremum_inside):
            is_observed, h, _, _ = step
            happens = extremum_inside and d0 > 0.0 if maxima else extremum_inside
            if has_bounds:
                reach = h * max(abs(d0), abs(d1))
                may_exceed = max(g0, g1) + reach > b[greatest_ + i]
                if not maxima:
                    may_exceed = may_exceed or min(g0, g1) - reach < b[least_ + i]
                happens = happens and may_exceed
            if not smooth:
                if least_ != NONE:
                    least = b[least_ + i]
                    b[least_ + i] = min(least, g1) if is_observed else least
                if greatest_ != NONE:
                    greatest = b[greatest_ + i]
                    b[greatest_ + i] = max(greatest, g1) if is_observed else greatest
                if low_ != NONE:
                    low, high = b[low_ + i], b[high_ + i]
                    margin = fma(b[growth_ + i], abs(g1), b[margin_ + i])
                    fallen = high - g1 > margin
                    plain = is_observed and not extremum_inside and not fallen
                    rises = plain and g1 - low > margin
                    b[high_ + i] = max(high, g1) if rises else high
                    b[low_ + i] = min(low, g1) if plain else low
                    happens = happens or fallen
            if is_counted:
                happens = happens or g1 > b[rises_ + i]
                if may_jump:  # a minimum shows a fall, but for one that is not followed
                    happens = happens or g1 < b[falls_ + i]
            return happens

        return extremes

    def _crossing(self, event: Event) -> Callable[..., bool]:
        """Compares a channel with a level, and adds the time above it of steps without a
        crossing; whether there may be one."""
        placed, channel, above = self.placed, event.channel, event.above
        assert above is not None
        found, level, above_ = (
            self.declaration.extremes.get(channel.name),
            placed.level(channel, above),
            placed.offset("above", above.name),
        )
        gate, maxima = self.gates.get(above.name, NONE), found is not None and found.maxima
        # An excursion from above is noticed as any other minimum is, or, where minima are
        # not looked for, where the channel could reach the level.
        may_graze = found is None or maxima or not event.has_extremes

        @inlined
        def crosses(b, sets, i, step, g0, d0, g1, d1, extremum_inside):
            _, h, observed_h, _ = step
            limit = level(b, i)
            above0, above1 = g0 > limit, g1 > limit
            b[above_ + i] += observed_h if above0 and above1 else 0.0
            if gate != NONE:
                sets[gate] |= (1 << i) if above0 and above1 else 0
            happens = above0 != above1
            if may_graze:
                grazes = extremum_inside and (d0 > 0.0) != above0
                if maxima:
                    grazes = grazes and (not above0 or lower_estimate(g0, g1, d0, d1, h) < limit)
                happens = happens or grazes
            return happens

        return crosses

    def _maxima(self, channel: Channel, number: int) -> Callable[..., None]:
        """Finds the maxima of a channel that no polynomial follows: only those that may
        exceed the greatest value so far."""
        is_followed, greatest_ = self.placed.is_followed(channel.name), self.placed.offset("greatest", channel.name)

        @inlined
        def detect(b, sets, i, step, ends):
            _, h, _, _ = step
            g0, d0, _, g1, d1, _ = ends
            rises = d0 > 0.0 or (d0 == 0.0 and g1 > g0)
            highest = fma(0.5 * h, max(d0, -d1), max(g0, g1))
            matters = rises and d1 <= 0.0 and highest > b[greatest_ + i] and is_followed(b, i)
            sets[number] |= (1 << i) if matters else 0

        return detect

    # What several channels give together.
    def _winding(self, winding: Winding) -> Measure:
        """Adds the angle by which a vector rotates in the step, or its half
        revolutions."""
        x, y = (self.placed.number_of[name] for name in (winding.x, winding.y))
        angle_, is_counted = self.placed.offset("angle", winding.name), winding.counted

        @inlined
        def measure(b, sets, i, step, ends):
            is_observed, _, _, _ = step
            x0, x1, y0, y1 = ends[x][0], ends[x][3], ends[y][0], ends[y][3]
            if is_counted:
                turn = 1.0 if fma(x0, y1, -(y0 * x1)) > 0.0 else -1.0
                angle = turn if (y0 < 0.0) != (y1 < 0.0) else 0.0
            else:
                angle = angle_between(x0, y0, x1, y1)
            add_where(b, angle_ + i, is_observed, angle)
            return ends

        return measure

    def _slopes(self, slopes: RmsOfSlopes) -> Measure:
        """Adds the integral of the square of a vector of slopes."""
        numbers = tuple(reversed([self.placed.number_of[name] for name in slopes.channels]))
        slopes_ = self.placed.offset("slopes", slopes.name)

        @inlined
        def measure(b, sets, i, step, ends):
            is_observed, h, _, per_h = step
            at_ends = at_middle = 0.0
            for k in numbers:
                g0, d0, _, g1, d1, _ = ends[k]
                middle = fma(1.5 * per_h, g1 - g0, -0.25 * (d0 + d1))
                at_middle = fma(middle, middle, at_middle)
                at_ends = fma(d0, d0, fma(d1, d1, at_ends))
            add_where(b, slopes_ + i, is_observed, h * (1.0 / 6.0) * fma(4.0, at_middle, at_ends))
            return ends

        return measure

    def _parts(self, gate: str) -> tuple[Callable[..., None], ...]:
        """Add the integrals over a step that is above the level as a whole."""
        return tuple(self._part(part) for part in self.declaration.of_kind(MeanAbove) if part.above == gate)

    def _part(self, part: MeanAbove) -> Callable[..., None]:
        placed, channel, step_ = (
            self.placed,
            self.placed.channel(part.channel),
            self.placed.lanes * self.placed.rows.step,
        )
        part_, integral, ends_of = (
            placed.offset("part", part.name),
            placed.integral(channel),
            placed.ends(placed.base(channel) or channel),
        )

        @inlined
        def add(b, i, is_above):
            ends = ends_of(b, i)
            add_where(b, part_ + i, is_above, integral(b, i, b[step_ + i], ends, ends))

        return add


@inlined
def _unmeasured(b, sets, i, step, others):
    return (*others, ())


@inlined
def _nothing(b, sets, i, step, ends):
    pass


@inlined
def _never(b, *given):
    return False
