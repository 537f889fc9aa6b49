"""An answer as orders: what to do and what not to do, five each at most, the most important
first. Only what is known is ordered."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice

from nsdrill.analysis.advice import Border, Kind, Recovery
from nsdrill.analysis.histories import Grade
from nsdrill.models.responses import RESPONSES
from nsdrill.plot.wording import Words

MOST = 5
AGAIN = "pick up, stop the rotation, start again"


class Orders(Words):
    """The orders of an answer."""

    def do(self) -> list[str]:
        """What to do."""
        return list(islice(self._do(), MOST))

    def do_not(self) -> list[str]:
        """What not to do."""
        return list(islice(self._do_not(), MOST))

    def _do(self) -> Iterator[str]:
        if self.advice.kind in (Kind.NOTHING, Kind.UNKNOWN):
            return
        if self.advice.kind == Kind.HINT:
            yield f"Take {self.setting()} as a hint only: have a finer map run around it."
        yield self._enter()
        if self.advice.kind != Kind.HINT:
            yield self._drill()
        yield from self._watch()
        yield self._recover()

    def _enter(self) -> str:
        """How one comes to the point."""
        way, point, fmt, begin = self.advice.way_in, self.advice.point, self.fmt, self.bring()
        weight = fmt.value("wob", point["wob"]) if "wob" in point else "the weight"
        if self.advice.grade == Grade.FROM_START:
            if way is None or way.wall is None:
                return f"Go to {self.setting()} quickly." if "up" in self.ways else f"Start at {self.setting()}."
            rate = f" at {fmt.value('rotary_speed', 2 * way.passing_rate)}/s or faster" if way.passing_rate else ""
            wall = fmt.range("rotary_speed", list(way.wall))
            return f"Off bottom, take the speed through {wall}{rate}. Then set {weight}."
        if way is None or way.begins is None:
            return f"{begin[0].upper()}{begin[1:]}."
        through = "" if way.through is None else f", through stick-slip up to {fmt.value('rotary_speed', way.through)}"
        begins, speed = (fmt.value("rotary_speed", value) for value in (way.begins, point["rotary_speed"]))
        return f"Set {weight} at {begins} or less. Then raise the speed to {speed}{through}."

    def _drill(self) -> str:
        within = [self.fmt.range(axis, [one.low, one.high]) for axis, one in self.advice.stay_within.items()]
        return f"Drill at {self.setting()}. Stay within {' and '.join(within)}."

    def _watch(self) -> Iterator[str]:
        """What is seen at the surface and downhole."""
        seen, fmt = self.advice.surface, self.fmt
        if seen is None or seen.torque is None:
            return
        torque = fmt.value("surface_torque_mean", seen.torque)
        text = f"Watch the torque: steady near {torque}."
        if seen.swing is not None:
            text = f"Watch the torque: it swings {fmt.range('surface_torque_mean', list(seen.swing))} there."
        if seen.sticking is not None:
            swings = fmt.range("surface_torque_mean", list(seen.sticking))
            period = f" every {seen.period:.2g} s" if seen.period is not None else ""
            end = self.advice.never_exceed if self.advice.never_exceed is not None else self.advice.known_to
            most = f", to {fmt.value(self.along, end)} at most" if end is not None else ""
            text += f" If it swings ({swings}{period}) it is stick-slip: raise the speed{most}."
        yield text
        if seen.whirling is not None and seen.acceleration is not None:
            yield (
                f"Watch the shocks downhole: {seen.acceleration / 9.80665:.1f} g r.m.s. is whirl. The torque does not "
                f"show it ({fmt.value('surface_torque_mean', seen.whirling)})."
            )

    def _recover(self) -> str:
        found = self.advice.recover
        if found is None:
            return f"If it vibrates: {AGAIN}. What ends it was not run."
        if found.outcome == Recovery.LASTS:
            return f"If it vibrates: {AGAIN}."
        if found.outcome == Recovery.NOT_MET or found.at is None:
            return f"If it vibrates: {AGAIN}. Whether it ends otherwise was not met."
        at = self.fmt.value(found.axis, found.at)
        if self._wall_may_hold():
            return f"If it vibrates: lower to {at}. If it whirls: {AGAIN}."
        return f"If it vibrates: lower to {at}. The way down was free from there."

    def _do_not(self) -> Iterator[str]:
        fmt, advice = self.fmt, self.advice
        if advice.kind in (Kind.NOTHING, Kind.UNKNOWN):
            for name, low, high in advice.stops:
                yield f"Do not run at {fmt.range(self.along, [low, high])}: there it {RESPONSES[name].verb}s."
            return
        if self.along in advice.stay_within:
            yield self._exceed()
        way, found = advice.way_in, advice.recover
        if way is not None and way.first_speed_touches is not None and advice.grade != Grade.FROM_START:
            yield (
                "Do not raise the speed before the weight: at the lightest weight the collar goes to the wall at "
                f"{fmt.value('rotary_speed', way.first_speed_touches)}."
            )
        if found is not None and found.outcome == Recovery.LASTS:
            rolls = ""
            if found.lasts_above is not None and "whirl" in found.responses:
                rolls = f"; rolling lasts above {fmt.value('rotary_speed', found.lasts_above)}"
            lower = "take weight off" if found.axis == "wob" else "slow down"
            yield f"Do not {lower} to cure {self._motion(found.responses, None)}: in the map it did not stop{rolls}."
        for axis in self.axes[1:]:
            below, above = self._borders(axis)
            yield from self._beyond_end(axis, above, "above")
            yield from self._beyond_end(axis, below, "below")
        yield from self._beyond_end(self.along, self._borders(self.along)[0], "below")
        if way is not None and way.wall is not None and way.first_speed_touches is None:
            yield f"Do not stay at {fmt.range('rotary_speed', list(way.wall))} off bottom: the collar goes to the wall."

    def _exceed(self) -> str:
        """The last value that is allowed, and what lies beyond it."""
        advice, fmt = self.advice, self.fmt
        if advice.never_exceed is None:
            end = advice.known_to if advice.known_to is not None else advice.stay_within[self.along].high
            return f"Do not exceed {fmt.value(self.along, end)}: nothing is known above."
        one = advice.stay_within[self.along]
        what = self._beyond(self.along, one.above) if one.high == advice.never_exceed else ""
        return f"Do not exceed {fmt.value(self.along, advice.never_exceed)}{f': {what}' if what else ''}."

    def _beyond_end(self, axis: str, border: Border | None, way: str) -> Iterator[str]:
        """Not to go beyond an end of what is allowed."""
        if axis not in self.advice.stay_within or border is None:
            return
        one = self.advice.stay_within[axis]
        end = self.fmt.value(axis, one.high if way == "above" else one.low)
        what = self._beyond(axis, border)
        if not what and way == "below":  # the map begins there
            return
        yield f"Do not go {way} {end}: {what or 'nothing is known beyond'}."
