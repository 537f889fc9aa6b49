"""The observer of a declaration (:mod:`nsdrill.observe.channels`), for any model and
any number of lanes.

It is generated as text. Every packed step is examined in all lanes at once: the
extremes so far are updated by the values at the ends of the step, integrals over time
are accumulated, and for each channel the set of lanes is found with an event inside the
step: an extremum (the slope changes its sign) or a level crossing. Events occur in few
lanes only, which are then handled one by one (:mod:`nsdrill.observe.inside`). What
few lanes need, such as integrals while a quantity is above its level, is passed over in
steps where none does. The results of a lane do not depend on the other lanes.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

from nsdrill.abi import MARKER, OBSERVER, Rows
from nsdrill.compiler.functions import BUFFER, INTEGER, LaneFunction
from nsdrill.observe.channel_text import END, ChannelText, MarkerText, indented, noted, observed_rows, with_definitions
from nsdrill.observe.channels import (
    Channel,
    Declaration,
    MeanAbove,
    Names,
    RmsOfSlopes,
    Section,
    TimeAbove,
    Winding,
    arguments,
    check,
)
from nsdrill.observe.inside import CYCLE_LOW, FALLS, HIGH, LOW, MARGIN, NONE, RISES


class Event(NamedTuple):
    """What may happen inside a step, each with its set of lanes: extrema of a channel
    and crossings of a level (``above``), or the maximum of a channel that no polynomial
    follows."""

    channel: Channel
    above: TimeAbove | None = None
    has_extremes: bool = False


@lru_cache
def make_observer(lanes: int, rows: Rows, names: Names, declaration: Declaration) -> tuple[LaneFunction, LaneFunction]:
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
    marker = MarkerText(lanes, rows, names, declaration)
    return (
        _ObserverText(lanes, rows, names, declaration).make(),
        marker.compile("marker", (MARKER,), "b, store, i, mark, outcome, column", marker.lines()),
    )


class _ObserverText(ChannelText):
    """Lines of the observer and of the function that it calls for the events of a
    step."""

    def __init__(self, lanes: int, rows: Rows, names: Names, declaration: Declaration) -> None:
        super().__init__(lanes, rows, names, declaration)
        self.events = self._events()
        # the names in the text of the sets of lanes with an event
        self.sets = [f"lanes_{number}" for number in range(len(self.events))]
        self.sets += ["returning"] if declaration.section else []
        # those of lanes that are above a level for the whole step, by the TimeAbove
        gates = dict.fromkeys(part.above for part in declaration.of_kind(MeanAbove))
        self.gates = {name: f"above_{number}" for number, name in enumerate(gates)}

    def make(self) -> LaneFunction:
        """The compiled observer."""
        kinds = (BUFFER, BUFFER, *(INTEGER for _ in self.sets))
        handle_events = self.compile("handle_events", kinds, ", ".join(("b, store", *self.sets)), self._event_lines())
        return self.compile("observer", (OBSERVER,), "b, store", self._observer_lines(), handle_events=handle_events)

    def _events(self) -> list[Event]:
        """The events of the channels, in order; the first of a channel has its extremes
        and its first level, others have further levels."""
        events = []
        for channel in self.declaration.channels:
            levels: list[TimeAbove | None] = [
                above for above in self.declaration.of_kind(TimeAbove) if above.channel == channel.name
            ]
            has_extremes = channel.name in self.declaration.extremes
            if has_extremes and not levels:
                levels = [None]
            events += [Event(channel, above, has_extremes and number == 0) for number, above in enumerate(levels)]
        return events

    def _observer_lines(self) -> list[str]:
        """The body of the observer, which is called every step: all lanes at once."""
        rows, outputs = self.rows, self.declaration.outputs
        is_observed = f"{self._row(rows.moves)} * {self._row(rows.observing)} != 0.0"
        sets = [*self.sets, *self.gates.values(), "observed_lanes"]
        lines = [f"{' = '.join(sets)} = 0", "for i in packed(W):"]
        if outputs:
            results = "".join(f"{self._own_row('now', name)}, " for name in outputs.names)
            lines.append(f"    ({results}) = {self._code(outputs.function, self.known)}")
        lines += [f"    observed_lanes |= (1 << i) if {is_observed} else 0"]
        channels = self.declaration.channels
        lines += [
            "if observed_lanes != 0:",
            "    for i in packed(W):",
            f"        is_observed, h = {is_observed}, {self._row(rows.step)}",
            "        observed_h = h if is_observed else 0.0",
            "        per_h = 1.0 / h if h > 0.0 else 0.0",
        ]
        body = [line for channel in channels for line in self._channel_lines(channel)]
        for winding in self.declaration.of_kind(Winding):
            body += self._winding_lines(winding)
        for slopes in self.declaration.of_kind(RmsOfSlopes):
            body += self._slopes_lines(slopes)
        ends = [line for channel in channels for line in self._ends(channel)]
        lines += indented(with_definitions(body, ends), 2)
        if self.declaration.section:
            angle = self._channel(self.declaration.section.channel).value
            reached = f"{self._code(angle, self.row_texts[END])} >= {self._own_row('level')}"
            lines += [
                "if observed_lanes != 0 and store[RETURNS] > 0.0:",
                "    for i in packed(W):",
                f"        {noted('returning', reached)}",
            ]
        if self.sets:
            observed_sets = (f"{lanes} & observed_lanes" for lanes in self.sets)
            lines += [
                f"if (({' | '.join(self.sets)}) & observed_lanes) != 0:",
                f"    handle_events({', '.join(('b, store', *observed_sets))})",
            ]
        for name, lanes in self.gates.items():
            parts = [part for part in self.declaration.of_kind(MeanAbove) if part.above == name]
            lines += self._gated_lines(lanes, parts)
        if outputs:
            lines += ["for i in packed(W):", f"    moves = {self._row(rows.moves)} != 0.0"]
            for name in outputs.names:
                lines += [
                    f"    before, now = {self._own_row('before', name)}, {self._own_row('now', name)}",
                    f"    {self._own_row('before', name)} = now if moves else before",
                ]
        return lines

    def _channel_lines(self, channel: Channel) -> list[str]:
        """The lines that update the measurements of one channel in all lanes. (Both
        values are loaded and one is selected, as those of a lane that is not observed
        may be NaN.)"""
        k, name, lines = self.number_of[channel.name], channel.name, []
        lines += self._detection_lines(channel)
        if ("passages", name) in self.row_of:
            rises = f"g0_{k} <= {self._level(channel)} and g1_{k} > {self._level(channel)}"
            lines += self._accumulation("passages", name, f"1.0 if {rises} else 0.0")
        if ("integral", name) in self.row_of:
            lines += self._accumulation("integral", name, self._integral(channel))
        return lines

    def _detection_lines(self, channel: Channel) -> list[str]:
        """The lines that find the events of a channel in all lanes, and update what
        steps without an event add."""
        k, name = self.number_of[channel.name], channel.name
        sets = [(lanes, e) for lanes, e in zip(self.sets, self.events, strict=False) if e.channel is channel]
        if not sets:
            return []
        first = sets[0][0]
        if channel.inside:
            return self._inside_detection_lines(channel, first)
        found, followed = self.declaration.extremes.get(name), self._is_followed(name)
        lines = [f"extremum_inside = has_extremum(d0_{k}, d1_{k})" + (f" and {followed}" if followed else "")]
        # what brings a lane into each set
        happens: dict[str, list[str]] = {lanes: [] for lanes, _ in sets}
        if found:
            case = f"extremum_inside and d0_{k} > 0.0" if found.maxima else "extremum_inside"
            if found.smooth and name not in self.declaration.channels_with_peaks:
                # others change nothing
                reach = f"h * max(abs(d0_{k}), abs(d1_{k}))"
                may_exceed = f"max(g0_{k}, g1_{k}) + {reach} > {self._own_row('greatest', name)}"
                if not found.maxima:
                    may_exceed += f" or min(g0_{k}, g1_{k}) - {reach} < {self._own_row('least', name)}"
                case += f" and ({may_exceed})"
            happens[first].append(case)
        if found and not found.smooth:
            for what, end in (("least", "min"), ("greatest", "max")):
                if (what, name) in self.row_of:
                    row = self._own_row(what, name)
                    lines += [f"{what} = {row}", f"{row} = {end}({what}, g1_{k}) if is_observed else {what}"]
        if (LOW, name) in self.row_of and found and not found.smooth:
            low, high = self._own_row(LOW, name), self._own_row(HIGH, name)
            lines += [
                f"low, high = {low}, {high}",
                f"margin = fma({self._own_row('growth')}, abs(g1_{k}), {self._own_row(MARGIN, name)})",
                f"fallen = high - g1_{k} > margin",
                "plain = is_observed and not extremum_inside and not fallen",
                f"rises = plain and g1_{k} - low > margin",
                f"{high} = max(high, g1_{k}) if rises else high",
                f"{low} = min(low, g1_{k}) if plain else low",
            ]
            happens[first].append("fallen")
        if name in self.declaration.counted:
            # a minimum shows a fall, but for one that the polynomial does not follow
            rises, falls = (self._own_row("cycle", part, name) for part in (RISES, FALLS))
            happens[first].append(f"g1_{k} > {rises}" + (f" or g1_{k} < {falls}" if followed else ""))
        lines += self._crossing_lines(channel, sets, happens)
        lines += [noted(lanes, " or ".join(f"({x})" for x in cases)) for lanes, cases in happens.items()]
        return lines

    def _crossing_lines(
        self, channel: Channel, sets: list[tuple[str, Event]], happens: dict[str, list[str]]
    ) -> list[str]:
        """The lines that compare a channel with its levels, and add the time above
        them of steps without a crossing; what brings a lane into each set joins what
        ``happens``."""
        k, found = self.number_of[channel.name], self.declaration.extremes.get(channel.name)
        lines: list[str] = []
        for number, (lanes, event) in enumerate(sets):
            if event.above is None:
                continue
            # An excursion from above is noticed as any other minimum is, or, where
            # minima are not looked for, where the channel could reach the level.
            above0, above1 = f"above0_{number}", f"above1_{number}"
            happens[lanes].append(f"{above0} != {above1}")
            if found is None or found.maxima or number > 0:
                graze = f"extremum_inside and (d0_{k} > 0.0) != {above0}"
                if found and found.maxima:
                    estimate = f"lower_estimate(g0_{k}, g1_{k}, d0_{k}, d1_{k}, h)"
                    graze += f" and (not {above0} or {estimate} < level_{number})"
                happens[lanes].append(graze)
            lines += [
                f"level_{number} = {self._level(channel, event.above)}",
                f"{above0}, {above1} = g0_{k} > level_{number}, g1_{k} > level_{number}",
                f"{self._own_row('above', event.above.name)} += observed_h if {above0} and {above1} else 0.0",
            ]
            if gate := self.gates.get(event.above.name):
                lines.append(noted(gate, f"{above0} and {above1}"))
        return lines

    def _inside_detection_lines(self, channel: Channel, lanes: str) -> list[str]:
        """The lines that find the maxima of a channel that no polynomial follows: only
        those that may exceed the greatest value so far."""
        k, followed = self.number_of[channel.name], self._is_followed(channel.name)
        greatest = self._own_row("greatest", channel.name)
        return [
            f"rises = d0_{k} > 0.0 or (d0_{k} == 0.0 and g1_{k} > g0_{k})",
            f"highest = fma(0.5 * h, max(d0_{k}, -d1_{k}), max(g0_{k}, g1_{k}))",
            noted(
                lanes, f"rises and d1_{k} <= 0.0 and highest > {greatest}" + (f" and {followed}" if followed else "")
            ),
        ]

    def _gated_lines(self, mask: str, parts: list[MeanAbove]) -> list[str]:
        """The lines that add the integrals over a step that is above the level as a
        whole, if it is so in some lane."""
        lines = [
            f"{mask} &= observed_lanes",
            f"if {mask} != 0:",
            "    for i in packed(W):",
            f"        is_above, h = ({mask} >> i) & 1 != 0, {self._row(self.rows.step)}",
        ]
        for part in parts:
            channel = self._channel(part.channel)
            base, row = self._base(channel), self._own_row("part", part.name)
            lines += indented(self._ends(base or channel), 2)
            lines += [
                f"        total, more = {row}, {self._integral(channel)}",
                f"        {row} = total + more if is_above else total",
            ]
        return lines

    def _slopes_lines(self, slopes: RmsOfSlopes) -> list[str]:
        """The lines that add the integral of the square of a vector of slopes."""
        numbers, lines = [self.number_of[name] for name in slopes.channels], []
        ends = "0.0"
        for k in reversed(numbers):
            last = ends == "0.0"
            ends = f"fma(d1_{k}, d1_{k}, {ends})" if not last else f"d1_{k} * d1_{k}"
            ends = f"fma(d0_{k}, d0_{k}, {ends})"
        middle = ""
        for k in reversed(numbers):
            lines.append(f"middle_{k} = fma(1.5 * per_h, g1_{k} - g0_{k}, -0.25 * (d0_{k} + d1_{k}))")
            square = f"middle_{k} * middle_{k}"
            middle = f"fma(middle_{k}, middle_{k}, {middle})" if middle else square
        increment = f"h * (1.0 / 6.0) * fma(4.0, {middle}, {ends})"
        return [*lines, *self._accumulation("slopes", slopes.name, increment)]

    def _winding_lines(self, winding: Winding) -> list[str]:
        """The lines that add the angle by which a vector rotates in the step, or its
        half revolutions."""
        x, y = (self.number_of[name] for name in (winding.x, winding.y))
        angle = f"angle_between(g0_{x}, g0_{y}, g1_{x}, g1_{y})"
        if winding.counted:
            turn = f"(1.0 if fma(g0_{x}, g1_{y}, -(g0_{y} * g1_{x})) > 0.0 else -1.0)"
            angle = f"{turn} if (g0_{y} < 0.0) != (g1_{y} < 0.0) else 0.0"
        return self._accumulation("angle", winding.name, angle)

    def _accumulation(self, what: str, name: str, increment: str) -> list[str]:
        total = self._own_row(what, name)
        return [f"total, more = {total}, {increment}", f"{total} = total + more if is_observed else total"]

    def _event_lines(self) -> list[str]:
        """The body of ``handle_events``: one event and one lane after the other."""
        lines = ["peaks, returns = int(store[PEAKS]), int(store[RETURNS])"]
        bodies = [
            self._inside_lines(event.channel) if event.channel.inside else self._measuring_lines(event)
            for event in self.events
        ]
        if self.declaration.section:
            bodies.append(self._return_lines(self.declaration.section))
        for lanes, body in zip(self.sets, bodies, strict=True):
            lines += [
                f"while {lanes} != 0:",
                f"    i = lowest_bit({lanes})",
                f"    {lanes} &= {lanes} - 1",
                f"    h = {self._row(self.rows.step)}",
                *indented(body),
            ]
        return lines

    def _return_lines(self, section: Section) -> list[str]:
        """The lines that record returns to the section."""
        W, rows, entry = self.lanes, self.rows, len(self.names.states) + 1
        rings = len(self.declaration.channels_with_peaks)
        return [
            *self._polynomial(self._channel(section.channel)),
            "record_returns(",
            "    b, store, i, W, h, p, end,",
            f"    {self._spacing()}, {self._offset('level')},",
            f"    RINGS + {rings * W} * (peaks + 1) + i * (1 + {entry} * returns), returns,",
            f"    {rows.pairs}, {rows.singles}, {W * rows.start}, {W * rows.stage},",
            f"    {W * rows.start_acceleration}, {W * rows.acceleration}, {W * rows.frame_rate})",
        ]

    def _measuring_lines(self, event: Event) -> list[str]:
        """The lines that measure extrema and crossings of a channel."""
        channel, above, has_extremes = event
        name, found = channel.name, self.declaration.extremes.get(channel.name)
        with_peaks = self.declaration.channels_with_peaks
        has_peaks = has_extremes and name in with_peaks
        least, greatest, low = (
            self._offset(what, name) if has_extremes else NONE for what in ("least", "greatest", LOW)
        )
        passages = self._offset("passages", name) if above and above.level is None else NONE
        ring = with_peaks.index(name) if has_peaks else 0
        return [
            *self._polynomial(channel),
            "first, second, above0, above_inside, above1 = measure_events(",
            "    b, store, i, W, h, begin, p, end, end_slope,",
            f"    {self._level(channel, above)}, {', '.join(self._slip(channel))},",
            f"    {self._is_followed(name) or True}, {least}, {greatest},",
            f"    {self._offset('above', above.name) if above else NONE}, {passages}, {low},",
            f"    {self._offset('growth')},",
            f"    RINGS + ({len(with_peaks)} * i + {ring}) * (peaks + 1), peaks,",
            f"    {has_peaks and found is not None and found.maxima}, {found is None or not found.smooth})",
            *self._gated_event_lines(event),
            *(self._counting_lines(channel) if has_extremes and name in self.declaration.counted else ()),
        ]

    def _counting_lines(self, channel: Channel) -> list[str]:
        """The lines that count the cycles of a channel."""
        name, rows = channel.name, self.rows
        offsets = [("least", name), ("greatest", name), ("cycle", CYCLE_LOW, name), ("cycles", name)]
        return [
            f"count_cycles(b, i, W, h, {self._row(rows.time)}, p, begin, end, {self._scale_text(channel)},",
            f"    {', '.join(str(self._offset(*key)) for key in (*offsets, ('cycle_time', name)))})",
        ]

    def _gated_event_lines(self, event: Event) -> list[str]:
        """The lines that add the integrals over the part of a step above the level."""
        parts = [part for part in self.declaration.of_kind(MeanAbove) if event.above and part.above == event.above.name]
        if not parts:
            return []
        lines = ["if above0 != above_inside or above1 != above_inside:"]
        for part in parts:
            channel = self._channel(part.channel)
            number = self.number_of[part.channel]
            lines += [
                *indented(self._ends(channel)),
                f"    {self._own_row('part', part.name)} += h * integral_above(",
                f"        g0_{number}, h * d0_{number}, g1_{number}, h * d1_{number},",
                "        first, second, above0, above_inside, above1)",
            ]
        return lines

    def _inside_lines(self, channel: Channel) -> list[str]:
        """The lines that find the greatest value of a channel that no polynomial
        follows: a bracket is narrowed twice to the maximum of the cubic through the
        values and slopes at its ends. The result is never above the greatest value, and
        below it by less than the tolerance of the integration."""
        k, greatest = self.number_of[channel.name], self._own_row("greatest", channel.name)
        assert channel.inside is not None
        lines, given = [], []
        for number, name in enumerate(channel.of):
            p = f"p_{number}"
            lines += self._polynomial(self._channel(name), p)
            given += [f"value({p}, theta)", f"slope({p}, theta) / h"]
        names = arguments(channel.inside)[len(given) :]
        given += [self.row_texts[END][name] for name in names]
        return [
            *lines,
            *self._ends(channel),
            f"low, low_value, low_slope = 0.0, g0_{k}, h * d0_{k}",
            f"high, high_value, high_slope = 1.0, g1_{k}, h * d1_{k}",
            "for _ in range(2):",
            "    width = high - low",
            "    top = top_of_cubic(low_value, width * low_slope, high_value, width * high_slope)",
            "    theta = fma(width, top, low)",
            f"    now, rate = {self._function(channel.inside)}({', '.join(given)})",
            "    rising = rate > 0.0",
            "    low, high = theta if rising else low, high if rising else theta",
            "    low_value, high_value = now if rising else low_value, high_value if rising else now",
            "    low_slope, high_slope = (",
            "        h * rate if rising else low_slope, high_slope if rising else h * rate)",
            f"{greatest} = max({greatest}, max(low_value, high_value))",
        ]
