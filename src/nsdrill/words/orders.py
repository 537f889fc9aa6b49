"""An answer as orders: what to do and what not to do, five each at most, the most important
first. Only what is known is ordered."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import islice

from nsdrill.analysis.advice import STICKS_ON, UNSTABLE, Border, First, Kind, Recovery, WayIn
from nsdrill.analysis.histories import Grade
from nsdrill.analysis.trials import SPEED_FIRST, WEIGHT_FIRST, Outcome, Trial
from nsdrill.words.trial_words import corner_words, disturbances, ended_in, slowed_to, ways_words
from nsdrill.words.values import TORQUE, in_order
from nsdrill.words.wording import CUT_SHORT, Words, listed, period_words

MOST = 5
UNTIL_CHANGED = "Until then do not drill ahead: pick up, or circulate, as the office decides."
FAR = 1.5  # times the highest speed of a setting: a critical speed above that is of no concern
G = 9.80665  # m/s^2
FAINT = 0.8 * G  # m/s^2: shocks that drilling without whirl gives as well
BIT_BOUNCE = "bit_bounce"
NOT_FREE = {  # of points that are free in the runs, why they are not
    STICKS_ON: "stick-slip, once started, may last",
    UNSTABLE: "steady drilling is unstable",
}
_OTHER_ORDER = {SPEED_FIRST: WEIGHT_FIRST, WEIGHT_FIRST: SPEED_FIRST}


def _share_of_bad(ways: Sequence[Trial]) -> float:
    """The share of these ways in that ended in vibration; 0 of none."""
    return sum(one.outcome.is_bad for one in ways) / max(len(ways), 1)


class Orders(Words):
    """The orders of an answer."""

    def do(self, before: str = "") -> list[str]:
        """What to do, of a setting to confirm what comes first; ``before`` the way in what it needs, ``Soft torque
        on.``"""
        steps = () if self.is_to_confirm else self._steps(before)
        return list(islice((*self._first(), *steps), MOST))

    def to_confirm(self, before: str = "", room: int = MOST) -> list[str]:
        """How a setting is tried that is to be confirmed, which is not to be used by that, in ``room`` for so many;
        none of another one."""
        return list(islice(self._steps(before), room)) if self.is_to_confirm else []

    def do_not(self) -> list[str]:
        """What not to do."""
        return list(islice(self._do_not(), MOST))

    def _first(self) -> Iterator[str]:
        """What comes before all that is done at the setting."""
        if self.advice.kind in (Kind.NOTHING, Kind.UNKNOWN):
            return
        if self.is_withdrawn:
            yield from self._until_changed()
            return
        if self.advice.vibrates is not None:
            yield f"Take {self.setting()} as a hint only: {self.vibrating()}."
            return
        if self.advice.unsettled is not None:
            these = "had not settled" if self.advice.unsettled.points else "were short"
            doing = "drill" if self.drills else "work"
            unseen = "a vibration that grows slowly is not seen in them"
            again = f"Have the map run again, with longer runs, and do not {doing} by this page before"
            yield f"{again}: its runs {these}, and {unseen}."
        if self.is_jumped:
            yield f"Take {self.setting()} as a hint only: {self.over_jump()}."
        elif self.advice.kind == Kind.HINT and self.is_cut_short:
            yield f"Take {self.setting()} as a hint only: {CUT_SHORT}."
        elif self.advice.kind == Kind.HINT and (tagged := self.after_tag()):
            yield f"Take {self.setting()} as a hint only: {tagged}. At a connection stop the rotation and come in anew."
        elif self.advice.kind == Kind.HINT and self.advice.grade == Grade.FROM_SOME:
            yield f"Take {self.setting()} as a hint only: it is free from {self._percent()}."
        elif self.advice.kind == Kind.HINT and self.advice.is_unreached:
            yield f"Take {self.setting()} as a hint only: it is free when started there, but no way in was run."
        elif self.advice.kind == Kind.HINT and self.is_above:
            yield f"Take {self.setting()} as a hint only: nothing was brought up through {self.begun_above}."
        elif self.advice.kind == Kind.HINT and self.advice.by_request:
            room = "the range asked for leaves no room around it, though the map allows more beyond"
            yield f"Take {self.setting()} as a hint only: {room}."
        elif self.advice.kind == Kind.HINT:
            change = "of weight or speed may make it vibrate" if self.drills else "may end that"
            yield f"Take {self.setting()} as a hint only: a small change {change}."

    def _until_changed(self) -> Iterator[str]:
        """What a rig does now whose setting trials withdrew, and what they found of the ways in."""
        if not self.drills:
            return
        found = self.advice.trials
        ways = found.ways_in() if found is not None else []
        told = ""
        if found is not None and ways:
            is_any = any(one.outcome == Outcome.FREE for one in ways)
            ends = f": they ended in {ended}" if (ended := ended_in(found)) else ""
            told = f" In trials: {ways_words(found)}." if is_any else f" No way in ended free in trials{ends}."
        yield f"{UNTIL_CHANGED}{told}"

    def _steps(self, before: str) -> Iterator[str]:
        """The way in, what to stay within, what to watch, and what ends a vibration."""
        if self.advice.kind in (Kind.NOTHING, Kind.UNKNOWN) or self.is_withdrawn or self.advice.vibrates is not None:
            return
        yield f"{before} {self._enter()}".strip()
        is_told = self.drills or self.advice.recover is not None or bool(self.goes_on())
        recover = [f"{self._recover()}{self._disturbed()}"] if is_told else []
        if self.advice.kind == Kind.HINT:  # beside which what would help is told, so that the last are left out
            yield from [*recover, *self._watch()]
            return
        yield self._drill()
        watched = list(self._watch())
        yield from [*watched[:1], *recover, *watched[1:]]

    def _enter(self) -> str:
        """How one comes to the point."""
        way, begin = self.advice.way_in, self.bring()
        if self.is_of_starts:
            return f"Find a way in first: no run was brought up to {self.setting()}. Have a map run that is brought up."
        if way is None:
            if self.advice.is_unreached:
                return f"Find a way in first: to {self.setting()} none was run."
            if self.advice.grade == Grade.FROM_START:
                return f"Start at {self.setting()}."
            return f"{begin[0].upper()}{begin[1:].rstrip(',')}."
        text = self.way(way)
        if way.first == First.NONE:
            return f"Find a way in first. {text}."
        head, comma, tail = text.rpartition(", then ")
        return (f"{head}. Then {tail}." if comma else f"{text}.") + self._otherwise()

    def _otherwise(self) -> str:
        """What to do where the drive is slower than the way in asks."""
        way = self.advice.way_in
        if way is None or self._rate(way) is None:
            return ""
        free = self._slower_ways()
        if free and free[-1].rate:
            rate = self.fmt.rates(free[0].rate or 0.0, free[-1].rate)
            return f" If the drive is slower: weight first, then the speed at {rate}."
        return " If the drive is slower: do not use this setting."

    def _slower_ways(self) -> list[Trial]:
        """The trials of the weight first at rates below that which the speed first asks for."""
        way, found = self.advice.way_in, self.advice.trials
        least = self._rate(way)
        if way is None or way.first != First.SPEED or least is None or found is None:
            return []
        return found.slower_ways(least)

    def _drill(self) -> str:
        within = [self.ends(axis) for axis in self.advice.stay_within]
        tried = self.advice.trials
        bad = [one for one in tried.bad_corners if self._is_within(one)] if tried is not None else []
        but = f", but not at {listed([corner_words(one, self.fmt) for one in bad], 'or')}" if bad else ""
        doing = "Try" if self.is_to_confirm else "Drill at" if self.drills else "Run at"
        return f"{doing} {self.setting() or 'the setting'}." + (
            f" Stay within {' and '.join(within)}{but}." if within else ""
        )

    def _watch(self) -> Iterator[str]:
        """What is seen at the surface and downhole."""
        seen, fmt = self.advice.surface, self.fmt
        if seen is None or seen.torque is None:
            return
        torque = fmt.on_gauge(TORQUE, seen.torque)
        watch = f"Watch the torque{' above that off bottom' if seen.above_off_bottom else ''}:"
        if where := self.seen_at().removeprefix(" "):
            watch += f" {where},"
        text = f"{watch} steady near {torque}."
        if seen.swing is not None:
            text = f"{watch} it swings {fmt.on_gauge(TORQUE, *seen.swing)} there."
        if seen.sticking is not None:
            swings = fmt.on_gauge(TORQUE, *seen.sticking)
            period = period_words(seen)
            cure = f"first {remedy}; if it goes on, {self.again}" if (remedy := self._remedy()) else self.again
            at = self.met_at(seen.sticking_at)
            met = at + (self.seen_at().replace(" at ", " and ", 1) if at else self.seen_at())
            text += f" If it swings ({swings}{period}, as met{met}) it is stick-slip: {cure}."
        yield text
        if seen.whirling is not None and seen.least_acceleration is not None:
            shocks, torque = f"{seen.least_acceleration / G:.1f} g r.m.s.", fmt.on_gauge(TORQUE, seen.whirling)
            torque += f" at {fmt.value('rotary_speed', seen.whirling_at)}" if seen.whirling_at is not None else ""
            text = f"Watch the shocks downhole: {self._shocks(shocks)}. The torque does not show it ({torque})."
            if seen.least_acceleration < FAINT:
                text = (
                    f"Watch the shocks downhole: light whirl, as it was met, shows neither in them ({shocks} and more) "
                    f"nor in the torque ({torque})."
                )
            yield text

        if self._bounces():
            yield "Watch the weight indicator and top drive: if they shake, the bit bounces. At depth they may not."

    def _shocks(self, whirl: str) -> str:
        """What shocks are there free of vibration and in ``whirl``, and between both above which to pick up, as
        far as the runs tell it: the least of whirl alone is late for an alarm."""
        seen = self.advice.surface
        if seen is None or seen.free_acceleration is None:
            return f"{whirl} or more is whirl"
        free, alarm = seen.free_acceleration / G, (seen.alarm_acceleration or 0.0) / G
        text = f"free of vibration {free:.2g} g r.m.s., in whirl {whirl.removesuffix(' r.m.s.')} or more"
        if free < alarm < (seen.least_acceleration or 0.0) / G:
            text += f"; above {alarm:.1f} g pick up"
        return text

    def _bounces(self) -> bool:
        """Whether the map met bit-bounce beside the limits, or on the way to the setting."""
        advice, way = self.advice, self.advice.way_in
        borders = [one for ends in (advice.stay_within, advice.lines) for one in ends.values()]
        met = [border.responses for one in borders for border in (one.below, one.above) if border is not None]
        met += [advice.recover.responses] if advice.recover is not None else []
        met += [tuple(name for name, *_ in way.crossed)] if way is not None else []
        return any(BIT_BOUNCE in names for names in met)

    def _remedy(self) -> str:
        """What ends stick-slip within the limits: less weight, or more speed; "" where they leave
        neither, or where no way in is known."""
        if self.advice.is_without_way_in:
            return ""
        weight, speed = (self.advice.stay_within.get(axis) for axis in ("wob", "rotary_speed"))
        parts = [] if weight is not None else ["take weight off"]
        if weight is not None and weight.low < self.advice.point["wob"]:
            least, _ = self.fmt.inwards("wob", weight.low, weight.high)
            parts = [f"take weight off, not below {self.fmt.value('wob', least)}"]
        if speed is not None and speed.high > self.advice.point["rotary_speed"]:
            parts.append(f"raise the speed, not above {self.last('rotary_speed', speed.high)}")
        return ", or ".join(parts)

    def _disturbed(self) -> str:
        """After what disturbances of trials the setting vibrates: where these are met, it is to be expected."""
        found = disturbances(self.advice.trials)
        if not found:
            return ""
        told = "; ".join(f"{one.name}, it {self.verbs_of(one.responses) or 'vibrates'}" for one in found)
        return f" Expect it after a disturbance, as in trials: {told}."

    def _recover(self) -> str:
        """What ends a vibration. What lowering the speed ends is named, as it never ends
        stick-slip. Of a hint this comes before what is watched, which tells the cure of that."""
        found, seen = self.advice.recover, self.advice.surface
        is_told = seen is not None and seen.torque is not None and seen.sticking is not None
        is_told &= self.advice.kind != Kind.HINT
        other = f"If it vibrates{' otherwise' if is_told else ''}: {self.again}."
        if self.advice.is_without_way_in:
            return other
        lowered = self.lowered()
        lasts = found is not None and (found.outcome == Recovery.LASTS or (found.at is not None and not lowered))
        if lasts or self.may_not_slow():
            return other
        if found is None and (goes_on := self.goes_on()):
            return f"If it vibrates: {goes_on}; {self.again}."
        if found is None or found.at is None:
            return f"{other} No run tells what else ends it."
        at, verbs = self.lowered_to(), self.verbs_of(lowered, "or")
        if found.then:
            return f"{other} Do not lower it: at {at} the {self._motion(lowered)} ends, but then {self.comes(found)}."
        if self._wall_may_hold():
            return f"If it {verbs}: lower to {at}{self.not_below()}.{self.raise_again()} {other}"
        above = " above the setting" if self.ends_at_setting() else ""
        free = f"lower to {at}{self.below_limits()}{self.not_below()}; {self.was_free()}.{self.raise_again()}"
        return f"If it {verbs}{above}: {free} If any vibration goes on: {self.again}."

    def _is_lowered_below(self, axis: str) -> bool:
        """Whether it is ordered to end a vibration below what to stay within along an axis."""
        found = self.advice.recover
        is_below = found is not None and found.axis == axis and bool(self.below_limits())
        return is_below and "lower to" in self._recover()

    def _do_not(self) -> Iterator[str]:
        fmt, advice = self.fmt, self.advice
        if advice.kind in (Kind.NOTHING, Kind.UNKNOWN):
            orders = list(self._forbidden())[:MOST]
            if orders and self._is_among_forbidden():
                orders[-1] += f" The one exception, as a hint, is {self.setting()}."
            yield from orders
            return
        if self.is_withdrawn:
            doing = "drill at" if self.drills else "use"
            best, why = f"at {self.setting()}, the best", self.why_withdrawn()
            yield f"Do not {doing} any setting of this map: {best}, {why}."
            return  # its limits are none
        if advice.vibrates is not None:
            yield f"Do not {'drill at' if self.drills else 'use'} {self.setting()} by this page: {self.vibrating()}."
            return
        if advice.grade == Grade.FROM_SOME:
            doing = "drill" if self.drills else "work"
            yield f"Do not {doing} by this page: at no setting do all starts end free of vibration."
            return
        if advice.is_without_way_in:
            yield f"Do not {'drill at' if self.drills else 'use'} {self.setting()}: no way in to it is known."
            return
        if advice.trials is not None and (tag := advice.trials.bad_tag) is not None:
            yield f"Do not tag with the rotation on: in a trial it then {self.verbs_of(tag.responses) or 'vibrates'}."
        is_hint = advice.kind == Kind.HINT  # which is not told what to stay within
        if self.along in advice.stay_within:
            yield from self._exceed(self.along)
            if is_hint:
                yield from self._beyond_end(self.along, advice.stay_within[self.along].below, "below")
        for axis in self.axes[1:]:
            if axis in advice.stay_within:
                ends = advice.stay_within[axis]
                if ends.low < ends.high:
                    yield from self._exceed(axis)
                else:
                    yield from self._beyond_end(axis, ends.above, "above")
        for one in filter(self._is_within, advice.trials.bad_corners if advice.trials is not None else ()):
            verbs = self.verbs_of(one.responses) or "vibrates"
            yield f"Do not run at {corner_words(one, fmt)}: in trials it {verbs} there."
        way, found = advice.way_in, advice.recover
        yield from self._not_first(way)
        yield from self._not_slowly()
        if found is not None and found.outcome == Recovery.LASTS:
            rolls = self.may_stay() if "whirl" in found.responses else ""
            lower = "take weight off" if found.axis == "wob" else "slow down" if self.drills else "lower it"
            where = "in a trial" if slowed_to(advice.trials, fmt) else "in the map"
            yield f"Do not {lower} to cure {self._motion(found.responses)}: {where} it did not stop{rolls}."
        elif self.may_not_slow():
            how, at = "slow down" if self.drills else "lower it", self.lowered_to()
            yield f"Do not {how} to cure whirl: in the map it ended only at {at}, below the limits{self.may_stay()}."
        if way is not None and way.first == First.SPEED and way.wall is not None and self._is_near(way.wall):
            if way.crosses and "rotary_speed" in advice.point:
                yield (
                    f"Do not stop between {self.begin_of_wall(way)} and {self.setting_of('rotary_speed')} off bottom: "
                    f"the collar goes to the wall at {self.wall_range(way)}."
                )
            else:
                how = "stay at" if way.crosses else "raise the speed through"
                yield f"Do not {how} {self.wall_range(way)} off bottom: the collar goes to the wall."
        for axis in self.axes[1:]:
            if axis in advice.stay_within:
                yield from self._beyond_end(axis, advice.stay_within[axis].below, "below")
        if self.along in advice.stay_within and not is_hint:
            yield from self._beyond_end(self.along, advice.stay_within[self.along].below, "below")

    def _forbidden(self) -> Iterator[str]:
        """Where not to run, where nothing is safe."""
        others = f" at one {self.fmt.name(self.axes[1])} or another" if len(self.axes) > 1 else ""
        for name, low, high in self.advice.stops:
            at = self.fmt.named(self.along, self.fmt.range(self.along, [low, high]))
            yield f"Do not run at {at}: there it {self.responses[name].does}{others}."
        for name, low, high in self.advice.near:
            if name in NOT_FREE:
                at = self.fmt.named(self.along, self.fmt.range(self.along, [low, high]))
                yield f"Do not run at {at}: {NOT_FREE[name]} there{others}."

    def _is_among_forbidden(self) -> bool:
        """Whether the best of what is not safe, which the answer names as a hint, lies among what is forbidden at one
        value or another of the other axis."""
        value, advice = self.advice.point.get(self.along), self.advice
        found = [*advice.stops, *(one for one in advice.near if one[0] in NOT_FREE)]
        return value is not None and any(low <= value <= high for _, low, high in found)

    def _is_near(self, wall: tuple[float, float]) -> bool:
        """Whether one who drills at the setting comes near these speeds."""
        one = self.advice.stay_within.get("rotary_speed")
        highest = one.high if one is not None else self.advice.held.get("rotary_speed", 0.0)
        return wall[0] < FAR * highest

    def _not_first(self, way: WayIn | None) -> Iterator[str]:
        """Not to set first what the way in sets last, where a reason for that holds at the
        point: more trials of it vibrate, or without trials the wall lies on the way."""
        tried = self.advice.trials
        if way is None or way.first == First.NONE:
            return
        other, order = SPEED_FIRST, "raise the speed before the weight"
        if way.first == First.SPEED:
            other, order = WEIGHT_FIRST, "set the weight before the speed"
        if self._slower_ways():  # a slower drive is ordered to
            return
        if tried is not None and (ways := tried.ways_in(other)):
            bad, own = (_share_of_bad(those) for those in (ways, tried.ways_in(_OTHER_ORDER[other])))
            if bad == 1.0:
                yield f"Do not {order}: in trials none of {len(ways)} such ways in ended free."
            elif bad > own:
                number = sum(one.outcome.is_bad for one in ways)
                yield f"Do not {order}: in trials {number} of {len(ways)} such ways in ended in vibration."
        elif way.first == First.WEIGHT and way.wall is not None and way.crosses:
            yield f"Do not {order}: off bottom the collar goes to the wall at {self.wall_range(way)}."

    def _not_slowly(self) -> Iterator[str]:
        """Of a quick start not to raise slowly what the map raised, from where, and what is not known of that."""
        advice = self.advice
        if advice.kind != Kind.QUICK_START or not advice.slowly or not (advice.slowly_at or advice.trials is None):
            return
        raising, first = ("weight", "wob") if self.carried == "wob" else ("speed", self.carried)
        begun, within = self.begun(), advice.stay_within.get(first)
        it = f"it {self.verbs_of(advice.slowly)}"
        if advice.slowly_at:
            at = advice.slowly_at
            where = " and ".join(self.fmt.named(axis, self.fmt.value(axis, at[axis])) for axis in in_order(at))
            it += f" at {where}"
        if begun and within is not None and advice.slowly_from[first] <= within.low:
            it += "; from the limits up no slow way was run"
        # a way in that is ordered may be as slow, but does not stop
        way = advice.way_in
        is_slow = advice.trials is not None and (self._slower_ways() or (way is not None and way.first == First.WEIGHT))
        how = "from step to step" if is_slow else "slowly"
        yield f"Do not raise the {raising} {how}{begun}: {it}."

    def _is_within(self, one: Trial) -> bool:
        """Whether a trial ended within the limits."""
        at = {"rotary_speed": one.speed, "wob": one.wob}
        ends = ((at.get(axis), stretch) for axis, stretch in self.advice.stay_within.items())
        return all(value is None or stretch.low <= value <= stretch.high for value, stretch in ends)

    def _exceed(self, axis: str) -> Iterator[str]:
        """What never to exceed along an axis, and why."""
        if (most := self.exceed(axis)) is None:
            return
        within, limit = self.advice.stay_within.get(axis), self.advice.most[axis]
        less = ""
        if within is not None and within.high < limit.value:  # as within is what is free after any history
            less = f"; {self.beyond(axis, within.above)}"
        yield f"Do not exceed {self.fmt.named(axis, most[0])}: {most[1]}{less}."

    def _beyond_end(self, axis: str, border: Border | None, way: str) -> Iterator[str]:
        """Not to go beyond an end of what is allowed; of a single value there is one end
        only, and one says so."""
        if border is None:
            return
        one = self.advice.stay_within[axis]
        low, high = self.fmt.inwards(axis, one.low, one.high)
        what = self.beyond(axis, border)
        if low == high:
            if way == "above" or axis == self.along:
                beside = f": {what}, and nothing between was run" if what else ""
                single = self.fmt.named(axis, self.fmt.value(axis, low))
                yield f"Stray as little as you can from {single}{beside}."
            return
        if not what and way == "below":  # the map begins there
            return
        end = self.fmt.named(axis, self.fmt.value(axis, high if way == "above" else low))
        # the way in, and a pick up, lead through what lies below
        text = f"Do not go {way} {end}" if way == "above" else f"Once there, do not go {way} {end}"
        text += " but to end a vibration as ordered" if way == "below" and self._is_lowered_below(axis) else ""
        yield f"{text}: {what or 'nothing is known beyond'}."
