"""The answer in words: a sentence of at most thirty, and a few more where it rests on runs that
had not settled; and at most five lines beside it."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from math import floor, inf, isclose, isfinite, log10, pi

import numpy as np

from nsdrill.analysis.advice import (
    BORDERLINE,
    STICKS_ON,
    UNSTABLE,
    Advice,
    Border,
    First,
    Kind,
    Recover,
    Recovery,
    Surface,
    WayIn,
)
from nsdrill.analysis.histories import Grade
from nsdrill.analysis.room import ENOUGH, tolerance
from nsdrill.analysis.trials import ON_WALL, SPEED_FIRST, WEIGHT_FIRST, Outcome, Trial, free_from
from nsdrill.analysis.untried import Jump
from nsdrill.data import Answer
from nsdrill.errors import count
from nsdrill.models.registry import described
from nsdrill.quantity import quantity
from nsdrill.variables import MODEL
from nsdrill.words import trial_words
from nsdrill.words.values import ORDER, TORQUE, Formatter, in_order, of_severity, reached

MOST_WORDS, MOST_LINES = 30, 5
AGAIN_AS_ABOVE = "Then pick up and come in again as above"
AGAIN, AFRESH = "pick up, stop the rotation, start again", "start afresh, as the runs began"  # of a rig, of others
STOP, END = "pick up and stop the rotation", "stop"  # where no way in is known: of a rig, of others
SHAKEN = "not promised without trials, as bit-bounce, which runs met, may begin when the weight is set"
NOT_RUN = "with the speed first it was not run"
CUT_SHORT = "trials were interrupted, and those that are missing may withdraw it"
NOTHING_ABOVE = "nothing is known above"
SLOW = 0.5 * pi / 30  # rad/s^2: a way in at half an rpm/s or less is not quick
_NEAR = {BORDERLINE: "near a limit", STICKS_ON: "stick-slip may last", UNSTABLE: "steady drilling unstable"}
_SIDES = {"rotary_speed": ("Slower", "Faster"), "wob": ("Lighter", "Heavier")}


def is_short(text: str) -> bool:
    """Whether a sentence has no more words than one may have; a speed in rad/s has the rpm in
    brackets, which do not count."""
    return len(re.sub(r" \([^)]* rpm\)", "", text).split()) <= MOST_WORDS


def first_short(*texts: str) -> str:
    """The first of these sentences that is short; where none is, the last one."""
    return next((text for text in texts if is_short(text)), texts[-1])


def listed(words: Sequence[str], last: str = "and") -> str:
    """``a, b and c``."""
    *head, tail = words or ("",)
    return f"{', '.join(head)} {last} {tail}" if head else tail


def period_words(seen: Surface) -> str:
    """How often the torque of stick-slip swings: `` every 4.2 s``, or where no run measured it, as a bit that
    sticks for long swings too rarely and one that bounces too often, `` every 3.9 s or more``; "" where the model
    does not tell that either."""
    if seen.period is not None:
        return f" every {seen.period:.2g} s"
    if seen.least_period is None:
        return ""
    digits = 1 - floor(log10(seen.least_period))
    return f" every {floor(seen.least_period * 10.0**digits + 1e-9) / 10.0**digits:g} s or more"


def _stick_slip(border: Border) -> str:
    """Stick-slip at a border, and why the runs do not show it there."""
    return "stick-slip of dry friction" if border.is_dry else "stick-slip"


class Words:
    """The words of an answer in units: of an ``advice`` on a sweep that was ``begun_above``
    a critical speed, by the ``severity`` and the ``confidence`` of the window. Its state was
    ``carried`` along an axis, by default the first one; so many points are ``unknown``.
    The speed [rad/s] is ``held_speed`` where it is not swept. The ``chain`` is that of a
    window's summary. The ``model`` has the responses. Outside of where one has ``drilled``, the ``within`` of the
    summary, points may be free that are not allowed."""

    def __init__(
        self,
        advice: Advice,
        axes: tuple[str, ...],
        units: str,
        ways: tuple[str, ...],
        severity: int | None = None,
        confidence: float | None = None,
        begun_above: str = "",
        carried: str | None = None,
        unknown: int = 0,
        held_speed: float = inf,
        chain: Answer | None = None,
        model: str = MODEL,
        drilled: Answer | None = None,
    ) -> None:
        self.advice, self.axes, self.ways, self.fmt = advice, axes, ways, Formatter(units, model)
        self.severity, self.confidence, self.begun_above = severity, confidence, begun_above
        self.carried, self.unknown, self.held_speed = carried or axes[0], unknown, held_speed
        self.chain = chain if chain is not None and chain["part"] else None
        self.responses, self.drills = described(model).critical, described(model).drills
        self.drilled = drilled if drilled is not None and drilled["run_up"] else None
        self.moved = self.chain is None or self.chain["held"]["points"] > 1

    def verbs_of(self, responses: Iterable[str], last: str = "and") -> str:
        """What a string with these responses does: ``bounces, sticks and whirls``."""
        return listed([self.responses[name].does for name in responses], last)

    @property
    def how(self) -> str:
        """How the points were reached that are free of vibration."""
        is_started = self.advice.kind == Kind.QUICK_START or self.advice.grade == Grade.FROM_START
        ways = [way for way in self.ways if way != "up"] if is_started else self.ways
        return reached(ways, self.carried, moved=self.moved, from_rest=self.advice.from_rest)

    @property
    def _when(self) -> str:
        """What joins that to "free"."""
        return "" if self.how.startswith("with ") else "when "

    @property
    def is_brought_up(self) -> bool:
        """Whether the points were reached on the way up."""
        return self.how == reached(("up",), self.carried, moved=self.moved)

    def bring(self, brief: bool = False) -> str:
        """What to do to reach the setting on the way up; in ``brief`` without where it vibrates on
        the way."""
        if self.carried == "depth":
            return f"run at {self.setting()}"
        if not self.moved or self.carried not in ("rotary_speed", "wob"):
            return f"run at {self.setting()}, {self.how},"
        point, at = self.advice.point, self.advice.at
        crossed = f", through {self.crossed(brief)}," if self.crossed() else ""
        if self.carried != "wob" or "wob" not in point:
            if crossed and self._is_off_bottom and {"wob", "rotary_speed"} <= point.keys():
                with_ = f" with {self.fmt.setting(at, at)}" if at else ""
                return f"bring up to {self.setting_of('rotary_speed')} off bottom, set {self.setting_of('wob')}{with_}"
            return f"bring up to {self.setting()} from below{'' if self._is_off_bottom else crossed}"
        rest = {axis: value for axis, value in point.items() if axis not in ("wob", "depth")}
        where = f" at {self.fmt.setting(rest, rest)}" if rest else ""
        way = self.advice.way_in
        is_first = way is not None and way.from_weight is not None and point["wob"] <= way.from_weight * (1.0 + 1e-9)
        raised = "set" if is_first else "raise the weight to"
        return (
            f"{raised} {self.fmt.value('wob', point['wob'])}{where}"
            + (f" with {self.fmt.setting(at, at)}" if at else "")
            + crossed
        )

    @property
    def _is_off_bottom(self) -> bool:
        """Whether the speed is raised off bottom, where the rock shakes no bit."""
        way = self.advice.way_in
        return way is not None and way.first == First.SPEED

    def crossed(self, brief: bool = False) -> str:
        """``bit-bounce at 50 to 60 rpm``: what the way up of the map meets on the way; in
        ``brief`` without where."""
        way = self.advice.way_in
        return " and ".join(
            self.responses[name].words
            + ("" if brief else f" at {self.fmt.named(self.carried, self.fmt.range(self.carried, [low, high]))}")
            for name, low, high in (way.crossed if way is not None else ())
        )

    @property
    def along(self) -> str:
        """The first axis of the maps."""
        return self.axes[0]

    @property
    def free(self) -> str:
        """What an allowed point is."""
        if self.severity is None:
            return "free of vibration"
        return (
            f"with {of_severity(self.severity, self.fmt.model)} vibration at most"
            if self.severity
            else "without any vibration"
        )

    def setting(self) -> str:
        """``25 klbf and 100 rpm``, with a third axis ``with soft torque``."""
        point = {axis: self.set_value(axis) for axis in self.advice.point if axis != "depth"}
        parts = [self.fmt.named(axis, self.fmt.value(axis, point[axis])) for axis in in_order(point)]
        at = self.advice.at
        where = f" with {self.fmt.setting(at, at)}" if at else ""
        return " and ".join(parts) + where

    def set_value(self, axis: str) -> float:
        """The value of the point along an axis, as it can be set within its limits."""
        value, one = self.advice.point[axis], self.advice.stay_within.get(axis)
        return self.fmt.settable(axis, value, *((one.low, one.high) if one is not None else ()))

    def ends(self, axis: str) -> str:
        """What to stay within along an axis: ``85 to 115 rpm``."""
        one = self.advice.stay_within[axis]
        return self.fmt.named(axis, self.fmt.range_inwards(axis, one.low, one.high))

    def last(self, axis: str, value: float) -> str:
        """The last value that is allowed, as it can be set: not below that of the point."""
        return self.fmt.value(axis, self.fmt.inwards(axis, min(self.advice.point.get(axis, 0.0), value), value)[1])

    @property
    def is_cut(self) -> bool:
        """Whether not all is allowed that is allowed at the point's weight and, at another
        weight, at its speed: what to stay within is a smaller rectangle."""
        lines = self.advice.lines
        return any(
            axis in lines and (lines[axis].low, lines[axis].high) != (one.low, one.high)
            for axis, one in self.advice.stay_within.items()
        )

    def order(self) -> str:
        """``bring up to 25 klbf and 100 rpm``: what the answer says to do, in few words."""
        text = self._order()
        return f"{text} ({self.caveat.lower()})" if self.caveat else text

    def _order(self) -> str:
        kind = self.advice.kind
        if kind == Kind.UNKNOWN:
            return "no answer"
        if kind == Kind.NOTHING:
            return f"no point is {self._known()}safe"
        if self.is_withdrawn:
            return f"no setting can be recommended (at {self.setting()}, the best, {self.why_withdrawn()})"
        if kind == Kind.HINT:
            vibrates = f", where {self.vibrating()}" if self.advice.vibrates is not None else ""
            return f"no setting can be recommended (best hint {self.setting()}{vibrates})"
        if kind == Kind.QUICK_START and "up" in self.ways:
            return f"go quickly to {self.setting()}"
        is_run = kind != Kind.FROM_BELOW or not self.is_brought_up
        share = f", safe with {self._percent()}" if self.advice.share is not None and not self.is_of_starts else ""
        if self.carried == "rotary_speed" and self.moved and not is_run:
            return f"bring up to {self.setting()}{share}"
        return f"{f'run at {self.setting()}' if is_run else self.bring().rstrip(',')}{share}"

    def _known(self) -> str:
        """That nothing is safe is known of what is known only."""
        return "known to be " if self.unknown else ""

    def within(self) -> str:
        """``85 to 115 rpm, 15 to 25 klbf``, the stretches along all axes, as each holds where the others are; of a
        single weight ``85 to 115 rpm at 20 klbf``. Of a hint it says where that lies on a limit."""
        axes = dict.fromkeys((self.along, self.carried, *self.axes))
        spans = [axis for axis in axes if axis in self.advice.stay_within and not self._is_single(axis)]
        spans = spans or [self.along]
        return ", ".join(f"{self.ends(axis)}{self._on_limit(axis)}" for axis in spans) + self._at_weight()

    def _at_weight(self) -> str:
        """`` at 20 klbf``: the one weight at which what is said of the first axis holds; "" of several."""
        if "wob" in self.advice.stay_within:
            is_one = self.along != "wob" and self._is_single("wob")
            return f" at {self.setting_of('wob')}" if is_one else ""
        held = self.advice.held.get("wob") if "wob" not in self.axes else None
        return f" at {self.fmt.value('wob', held)}" if held is not None else ""

    def _on_limit(self, axis: str) -> str:
        """That a hint lies on a limit of what it is free within: `` (on the limit)``."""
        one = self.advice.stay_within[axis]
        if self.advice.kind != Kind.HINT or axis not in self.advice.point or self._is_single(axis):
            return ""
        value = self.advice.point[axis]
        return " (on the limit)" if any(isclose(value, end, rel_tol=1e-9) for end in (one.low, one.high)) else ""

    def _is_single(self, axis: str) -> bool:
        """Whether what to stay within is one value of an axis."""
        one = self.advice.stay_within[axis]
        return one.low == one.high

    def sentence(self) -> str:
        """The answer in one sentence; of one that rests on runs that had not settled, or were
        short, it begins with that."""
        text = self._sentence()
        if not self.caveat:
            return text
        if self.is_to_confirm:
            begins = "" if self.advice.kind == Kind.HINT else "To confirm: "
            text = f"{begins}{text[0].lower()}{text[1:]}" if begins else text
            return f"{self.caveat}, {self.not_yet}. {text}"
        return f"{self.caveat}. {text}"

    @property
    def is_to_confirm(self) -> bool:
        """Whether the setting is not to be used until it has been run again: a hint, or one of runs that had not
        settled or were short."""
        if self.advice.kind in (Kind.NOTHING, Kind.UNKNOWN) or self.is_withdrawn or self.advice.vibrates is not None:
            return False
        return self.advice.kind == Kind.HINT or bool(self.caveat)

    @property
    def not_yet(self) -> str:
        """What a setting is not for that is to be confirmed."""
        return "not to drill by" if self.drills else "not to rely on"

    @property
    def caveat(self) -> str:
        """On what runs an answer rests that were short or had not settled; "" where on none."""
        found = self.advice.unsettled
        return "" if found is None else "Not settled" if found.points else "By short runs"

    def _sentence(self) -> str:
        kind = self.advice.kind
        if kind == Kind.UNKNOWN:
            return "No answer: of no point is enough known, as its runs failed, are missing or tell nothing."
        if kind == Kind.NOTHING:
            return self._nothing()
        if self.is_withdrawn:
            return self._withdrawn()
        if self.advice.vibrates is not None:
            return self._vibrates()
        if self.advice.depths is not None:
            return self._over_depths()
        if kind == Kind.HINT:
            return self._hint()
        if self.advice.share is not None:
            return self._shared()
        if kind == Kind.ANY_HISTORY:
            back = "lowered" if self.carried == "wob" else "back down"
            found = self.advice.recover
            after = "after vibration"
            if found is not None and found.outcome == Recovery.NOT_MET:
                after = "(no vibration was met above)"
            if not self.moved or (found is not None and found.outcome == Recovery.LEFT_OUT):
                after = "(what was met above is not in this part)"
            return f"Run at {self.setting()}: {self.free} at {self.within()}, {self.how} or {back} {after}."
        if kind == Kind.QUICK_START:
            return self._quick_start()
        return self._from_below()

    def _shared(self) -> str:
        """Of many samples, or of many starts."""
        told = trial_words.disturbed(self.advice.trials, self.verbs_of)
        ways = [f"{text[0].lower()}{text[1:]}" for text in self._of_ways_in()]
        afters = [f"; {text}" for text in ([told] if told else ways)]
        if self.is_of_starts:
            limits = ((self.free, self.within()), ("free", self.within()), ("free", self.ends(self.along)))
            texts = [f"Run at {self.setting()}: {free} from {self._percent()}, at {within}" for free, within in limits]
            return first_short(*(f"{one}{after}." for after in afters or [""] for one in texts), f"{texts[0]}.")
        begin = self.bring().rstrip(",") if self.is_brought_up else f"run at {self.setting()}, {self.how}"
        text = f"{begin[0].upper()}{begin[1:]}; {self.free} with {self._percent()}. Stay within {self.within()}"
        return first_short(*(f"{text}{after}." for after in afters), f"{text}.")

    @property
    def is_of_starts(self) -> bool:
        """Whether the share is of starts, which are not brought up to a point."""
        return self.advice.share is not None and self.confidence is None

    def _with_share(self) -> str:
        """``, 56 % (33 to 77)``, which no setting of samples or starts is named without; "" of others."""
        return "" if self.advice.share is None else f", {self._percent()}"

    def _percent(self) -> str:
        """``56 % (33 to 77)``."""
        share = self.advice.share
        assert share is not None
        ends = f"{100 * share.low:.0f} to {100 * share.high:.0f}"
        value = f"{100 * share.probability:.0f} %" if isfinite(share.probability) else "not known"
        if self.is_of_starts:
            value = f"{round(share.probability * (share.of - share.failed))} of {share.of} starts"
            value = f"all {share.of} starts" if share.probability == 1.0 and not share.failed else value
        return f"{value} ({ends}{' %' if self.is_of_starts else ''}" + (
            f"; {share.failed} of {share.of} not known)" if share.failed else ")"
        )

    def vibrating(self) -> str:
        """What the own runs of a setting do that only a severity allows: ``it bounces in every run, strong at most``,
        or each way by itself."""
        found = self.advice.vibrates
        assert found is not None
        first, *others = found.ways
        if found.is_in_every_run and all(one.responses == first.responses for one in others):
            worst = of_severity(found.severity, self.fmt.model)
            return f"it {self.verbs_of(first.responses)} in every run, {worst} at most"
        each = []
        for one in found.ways:
            share = "" if one.runs == one.of else f" in {one.runs} of {one.of} runs"
            worst = of_severity(one.severity, self.fmt.model)
            if one.runs:
                each.append(f"{self._by(one.way)} it {self.verbs_of(one.responses)}{share}, {worst} at most")
        return "; ".join(each)

    def _by(self, way: str) -> str:
        """How the runs of a way came to a setting: ``brought up``."""
        up = "with the weight raised" if self.carried == "wob" else "brought up"
        return {"up": up, "down": self._down}.get(way, "started there")

    def _in_runs(self) -> str:
        """In which of its runs a setting vibrates that only a severity allows: ``in every run``, ``coming down``."""
        found = self.advice.vibrates
        assert found is not None
        if found.is_in_every_run:
            return "in every run"
        return listed([self._by(one.way) for one in found.ways if one.runs])

    def _vibrates(self) -> str:
        """Of a setting that only a severity allows, which is no order."""
        found = self.advice.vibrates
        assert found is not None
        told = self.vibrating()
        head = f"Hint only: at {self.setting() or 'the setting'}{'' if told.startswith('it ') else ','} {told}"
        if self.along not in self.advice.stay_within:
            return f"{head}."
        is_all = found.severity <= (self.advice.severity or 0)
        so = "So much" if is_all else "On the way in so much"
        return first_short(f"{head}. {so} is allowed at {self.within()}.", f"{head}.")

    @property
    def _free(self) -> str:
        """What a point that is allowed is in one word: by a severity that need not be free."""
        return "allowed" if self.severity else "free"

    def _withdrawn(self) -> str:
        """Where trials leave nothing of the setting: it is no hint either, as it is not to be run at. Of other
        settings, which the map may draw as free, trials say nothing."""
        why, setting = self.why_withdrawn(), self.setting()
        text = f"No setting is recommended: at {setting}, the best of the map, {why}."
        helps = self._helps()
        if not helps:
            return first_short(*([f"{text} No other was tried."] if self._has_others else []), text)
        brief = f"No setting is recommended: at {setting} {why}."
        is_tagged = not self.advice.trials or not self.advice.trials.withdraws
        least = f"Unsafe: {setting}, {'after a pick up and tag' if is_tagged else why}."
        shortest = re.sub(r"none of \d+ ways in ended free in trials", "no way in is free", least)
        begins = (text, brief, least, shortest)
        return first_short(*(f"{begin} {one}" for one in helps for begin in begins), *begins)

    @property
    def _has_others(self) -> bool:
        """Whether the map allows other settings than the point."""
        return any(one.low < one.high for one in self.advice.lines.values())

    def why_withdrawn(self) -> str:
        """``none of 8 ways in ended free in trials``, or ``picked up and tagged again it bounces``."""
        if self.advice.trials is not None and not self.advice.trials.withdraws:
            return self.after_tag()
        ways = self.advice.trials.ways_in() if self.advice.trials else []
        free = sum(one.outcome == Outcome.FREE for one in ways)
        return f"{free or 'none'} of {count(len(ways), 'way')} in ended free in trials"

    def _helps(self) -> list[str]:
        """What trials found that is better than a hint, as a sentence, whole and in brief; none where they found
        nothing. Where there are no words left for either, a line beside the answer tells it."""
        texts = [
            trial_words.best_words(self.advice.trials, self.along, self.fmt, brief=brief) for brief in (False, True)
        ]
        return [f"{text[0].upper()}{text[1:]}." for text in dict.fromkeys(texts) if text]

    def _from_below(self) -> str:
        return first_short(*(self._brought_up(self.bring(brief)) for brief in (False, True)))

    def _brought_up(self, begin: str) -> str:
        joined = f"{begin} and" if len(self.advice.stay_within) < 2 else f"{begin.rstrip(',')};"
        within = f"{self.within()}, {self.free}" if self.advice.is_lax else self.within()
        text = f"{joined[0].upper()}{joined[1:]} stay at {within}"
        if way := self._tried_way():
            text = f"Go to {self.setting()} {way}, and stay at {within}"
        found = self.advice.recover
        if self._sticks_on() and (found is None or found.outcome != Recovery.LASTS):
            wall = ", and whirl may not stop" if self._wall_may_hold() else ""
            return f"{text}: {self.sticking}{wall}."
        if "down" not in self.ways or found is None:
            tells = "No run" if self.chain is None else "No run of this part"
            return f"{text}. {tells} tells what a disturbance does."
        motion = self._motion(found.responses)
        if found.outcome == Recovery.STOPS:
            return f"{text}: knocked in a trial, it came free again."
        if found.outcome == Recovery.LASTS:
            return f"{text}: {motion}, once started, does not stop."
        on_wall = self._wall_may_hold() or self.may_stay_on_wall()
        if found.outcome == Recovery.ENDS and found.then:  # as the orders have it, which do not lower it there
            verbs = self.verbs_of(found.responses, "or") if len(found.responses) == 1 else "vibrates"
            cures = (f"if it {verbs}, {cure}" for cure in (self.again, self.again.partition(",")[0]))
            return first_short(*(f"{text}: {cure}." for cure in cures))
        if found.outcome == Recovery.ENDS and not on_wall:
            assert found.at is not None
            ends = f"{text}: {motion}, once started, ends when lowered to {self.lowered_to()}"
            bound = "" if found.bound is None else f", not to {self._at_bound(found.bound)}"
            bound = f", not below {limit[0]}" if (limit := self._nearer_limit()) else bound
            return first_short(f"{ends}{bound}.", f"{ends}.")
        return f"{text}: {self._motion(('whirl',) if on_wall else ())}, once started, may not stop."

    def _wall_may_hold(self) -> bool:
        """Whether the wall may hold a collar at the point, of which the way down said
        nothing."""
        found = self.advice.recover
        if found is None or found.lasts_above is None or "whirl" in found.responses:
            return False
        speed = self.advice.point.get("rotary_speed")
        return speed is not None and speed > found.lasts_above

    def _sticks_on(self) -> bool:
        """Whether stick-slip, once started, may last at the point."""
        speed, to = self.advice.point.get("rotary_speed"), self.advice.sticks_to
        return to is not None and (speed if speed is not None else self.held_speed) <= to

    @property
    def sticking(self) -> str:
        """To which speed it may last."""
        return f"stick-slip, once started, {self._to(self.advice.sticks_to)}"

    def _to(self, speed: float | None) -> str:
        if speed is None or not isfinite(speed):
            return "may last at every speed"
        to = self.fmt.value("rotary_speed", self.fmt.outwards("rotary_speed", speed, speed)[1])
        return f"may last to {to}" if self.advice.modelled else f"lasts at least to {to} in this sweep"

    def _motion(self, responses: Iterable[str]) -> str:
        names = list(responses)
        return self.responses[names[0]].words if len(names) == 1 else "vibration"

    def _quick_start(self) -> str:
        if "up" not in self.ways:
            rest = f"; {self.sticking}" if self._sticks_on() else ". How it is reached was not run"
            return f"Run at {self.setting()}, {self.how}: {self.free} at {self.within()}{rest}."
        rate = self.rates(self.advice.way_in)
        fast = f"quickly, {rate}" if rate else "speed first, off bottom"
        way = self.advice.way_in
        if self.advice.trials is not None and way is not None and way.first == First.WEIGHT:
            fast = ", ".join(filter(None, ("weight first", rate)))
        elif self.advice.trials is not None and not rate.endswith("faster"):
            fast = self._tried_way() or fast
        if self.advice.from_rest and not rate and self.advice.grade == Grade.FROM_START:
            fast = "with the bit at rest at first"
        found, motion = self.advice.recover, self._motion(self.advice.slowly)
        end = "does not stop" if found is not None and found.outcome == Recovery.LASTS else "may not stop"
        slowly, is_weight = "Slowly" if self.is_cut else "Brought up slowly", self.carried == "wob"
        if is_weight:
            slowly = "With the weight raised"
        elif not rate and self.carried == "rotary_speed":  # the weight is on while the speed is raised
            slowly = "Weight first,"
        go = f"Go to {self.setting()} {fast}; stay at {self.within()}."
        begun = "" if is_weight and self.advice.from_first else self.begun()  # at every weight
        if not self.advice.slowly and self.advice.grade != Grade.FROM_START:
            return go
        verbs = self.verbs_of(self.advice.slowly) or "vibrates"
        if self.advice.slowly_at:
            there = self.advice.slowly_at
            where = self.fmt.setting(there, there)
            raised = "With the weight raised" if is_weight else "Raised slowly"
            texts = [f"{go} {slowly}{begun} it {verb} at {where}." for verb in (verbs, "vibrates")]
            texts += [f"{go} Slowly{begun} it {verbs} at {where}."]
            brief = f"{raised}{begun}" if begun else f"{raised} within that"
            return first_short(*texts, f"{go} {brief} it {verbs}.", f"{go} Slowly{begun or ' within that'} it {verbs}.")
        tried = self.advice.trials.ways_in() if self.advice.trials is not None else []
        if not self.advice.slowly_at and any(one.outcome == Outcome.FREE for one in tried):
            told = self._of_ways_in()
            ends = f"; {motion} {end}"
            return first_short(*(f"{go} {text}{rest}." for text in told for rest in (ends, ""))) if told else go
        joined = f"{slowly.removesuffix(',')}{begun}{',' if slowly.endswith(',') else ''}"
        whole = f"{go} {joined} it {verbs}; {motion} {end}."
        if is_weight:
            return whole
        return first_short(
            whole,
            f"{go} Slowly{begun} it {verbs}; {motion} {end}.",
            f"{go} {joined} it {verbs}.",
            f"{go} Slowly{begun} it {verbs}.",
        )

    def _of_ways_in(self) -> tuple[str, ...]:
        """Which ways in of trials vibrate, whole and in brief: of those that are ordered none and the others in which
        manner, ``All 53 ways in as ordered ended free; weight first it whirls in 5 of 6``; none where none does."""
        found = self.advice.trials
        ways = found.ways_in() if found is not None else []
        bad = [one for one in ways if one.outcome.is_bad]
        if not bad:
            return ()
        verbs = self.verbs_of(bad[0].responses) or "stalls"
        ordered = [one for one in ways if not self._unlike_orders(one)]
        if not ordered or any(one.outcome != Outcome.FREE for one in ordered):
            return (f"In {len(bad)} of {count(len(ways), 'way')} in it {verbs}",)
        manners = listed(list(dict.fromkeys(self._unlike_orders(one) for one in bad)), "or")
        same = [one for one in ways if self._unlike_orders(one) in {self._unlike_orders(each) for each in bad}]
        free = "The one way in as ordered" if len(ordered) == 1 else f"All {len(ordered)} ways in as ordered"
        share = f"in {len(bad)} of {len(same)}"
        return (
            f"{free} ended free; {manners} it {verbs} {share}",
            f"As ordered {'all' if len(ordered) > 1 else 'it'} ended free; {manners} it {verbs} {share}",
            f"As ordered it is free; {manners} it {verbs}",
        )

    def _unlike_orders(self, one: Trial) -> str:
        """In which manner a way in of trials differs from the one that is ordered; "" of one that does not."""
        way = self.advice.way_in
        if way is None or way.first == First.NONE:
            return ""
        name = WEIGHT_FIRST if way.first == First.WEIGHT else SPEED_FIRST
        if one.name != name:
            return one.name
        rate = one.rate or 0.0
        if way.rate and rate < way.rate * (1.0 - 1e-9):
            return "slower"
        return "faster" if way.most and rate > way.most * (1.0 + 1e-9) else ""

    def begun(self) -> str:
        """From where what is raised slowly vibrates: `` from below 60 rpm``, of the first value of the sweep `` from 60
        rpm``, below which nothing was run; "" where no run tells it."""
        for axis, value in self.advice.slowly_from.items():
            begins = self.fmt.named(axis, self.fmt.value(axis, value))
            return f" from {'' if self.advice.from_first else 'below '}{begins}"
        return ""

    def _hint(self) -> str:
        if self.is_of_starts:
            return (
                f"Hint only: {self.setting()} is {self.free} from {self._percent()}. How it is brought up there was "
                "not run."
            )
        if self.is_above:
            told = trial_words.ways_words(self.advice.trials) if self.advice.trials else ""
            through = f"in trials, {told}" if told else "nothing was brought up through it"
            begins = "The sweep begins"
            if self.carried != "rotary_speed":
                begins = "Each speed is swept by itself,"
            return f"Hint only: {self.setting()}{self._with_share()}. {begins} above {self.begun_above}; {through}."
        if self.advice.is_unreached:
            return self._unreached()
        if self.is_jumped:
            return self._jumped()
        if self.is_cut_short and not self.advice.narrow:
            why = f"{CUT_SHORT[:1].upper()}{CUT_SHORT[1:]}."
            return f"Hint only: {self.setting() or 'the setting'}{self._with_share()}{self.and_within()}. {why}"
        if (tagged := self.after_tag()) and not self.advice.narrow:
            told = f"{tagged[0].upper()}{tagged[1:]}"
            return f"Hint only: {self.setting() or 'the setting'}{self._with_share()}{self.and_within()}. {told}."
        how = f"free {self._when}{self.how}"
        if way := self._tried_way():
            how = f"{way} in trials"
        elif self.advice.share is not None:
            how = self.how
        how += self._with_share()
        setting, room = f"Narrow hint: {self.setting()}", self.and_within()
        brief = f"{setting}{self._with_share()}"
        heads = [f"No setting has room. {setting}, {how}{room}", f"{setting}, {how}{room}", f"{brief}{room}"]
        if helps := self._helps():
            texts = [f"{head}. {one}" for one in helps for head in (heads[0], brief)]
            return first_short(*texts, *(f"{head}." for head in heads))
        known = self.advice.way_in
        if self.advice.jump is not None:
            over = self.over_jump()
            return first_short(*(f"{head}; {over}." for head in (heads[0], heads[2], brief)))
        tail = "no way in is known" if known is not None and known.first == First.NONE else self._tail()
        return first_short(*(f"{head}; {tail}." for head in heads))

    @property
    def is_above(self) -> bool:
        """Whether it is a hint as the sweep begins above a critical speed: of one without room only before
        trials have tried the ways in."""
        return bool(self.begun_above) and not (self.advice.narrow and self.advice.trials is not None)

    @property
    def is_cut_short(self) -> bool:
        """Whether trials of it were interrupted, so that what may withdraw it is missing."""
        return self.advice.trials is not None and self.advice.trials.is_cut_short

    def after_tag(self) -> str:
        """``picked up and tagged again in a trial it bounces``; "" where no trial showed that."""
        found = self.advice.trials
        if found is None or (one := found.bad_tag) is None:
            return ""
        return f"{one.name} with the rotation on, it {self.verbs_of(one.responses) or 'vibrates'} in a trial"

    def and_within(self) -> str:
        """What follows the setting: ``, 85 to 115 rpm``; where that is the setting itself, the weight of the file."""
        if not all(self._is_single(axis) for axis in self.advice.stay_within):
            return f", {self.within()}"
        return "" if self.advice.point.keys() >= {"wob", "rotary_speed"} else self._at_weight()

    def _unreached(self) -> str:
        """Of a setting to which no way in is known."""
        way = self.advice.way_in
        verbs = self.verbs_of(self.advice.slowly) or "vibrates"
        if way is None:
            why = "Started there with the bit at rest it is free; how it is reached was not run."
        elif way.first == First.NONE:
            stops = "no drive passes" if not way.is_fast_enough else "off bottom the bit would swing back to"
            why = f"No way in is known: slowly it {verbs}, and {stops} {self.wall_range(way)}."
        else:  # the starts say nothing of a string that turns
            why = f"Slowly it {verbs}; started with the bit at rest it is free, but no quick way in was run."
        setting = f"{self.setting()}{self._with_share()}"
        texts = [f"Hint only: {setting}{room}. {why}" for room in (f", {self.within()}", "")]
        return first_short(*texts)

    @property
    def is_jumped(self) -> bool:
        """Whether it is a hint for that alone that steps of the map may jump across a vibration, or stick-slip took the
        string past one."""
        return self.advice.tried_kind is not None

    def over_jump(self) -> str:
        """``the steps of the map may jump across whirl at 59 to 68 rpm``, or that nothing was run in
        a gap of the axis; or that stick-slip took the string past whirl."""
        if self.advice.jump is None:
            assert self.advice.stuck_past is not None
            at = self.fmt.range_outwards("rotary_speed", *self.advice.stuck_past)
            return f"on the way up stick-slip took the string past whirl at {at}, as chance had it"
        return self.over(self.advice.jump)

    def over(self, jump: Jump) -> str:
        """The same of a ``jump``."""
        if jump.motion is None:
            ends = self.fmt.range(jump.axis, [jump.low, jump.high]).replace(" to ", " and ")
            return f"nothing was run between {self.fmt.named(jump.axis, ends)}"
        at = self.fmt.range_outwards(jump.axis, jump.low, jump.high)
        return f"steps of {self.fmt.value(jump.axis, jump.step)} may jump across {jump.motion} at {at}"

    def _jumped(self) -> str:
        """Of a setting to which the map was not brought up through all speeds."""
        steps = self.over_jump()
        steps = f"{steps[0].upper()}{steps[1:]}"
        texts = [
            f"Hint only: {self.setting()}{self._with_share()}{room}. {steps}{tail}."
            for room, tail in ((f", {self.within()}", "; trials tell"), ("", "; trials tell"), ("", ""))
        ]
        return first_short(*texts)

    def _tail(self) -> str:
        """What lies beside a hint without room."""
        for axis in self.axes[1:]:
            for border, word in zip(self._borders(axis), ("at", "from"), strict=True):
                if border and border.grade == Grade.STALLED and border.value is not None:
                    return f"{word} {self.fmt.value(axis, border.value)} the bit stalls"
                if border and border.grade == Grade.UNKNOWN and border.value is not None:
                    return self.beyond(axis, border)
        if (self.advice.room or 0.0) >= ENOUGH:  # within what is allowed, but by different ways in
            return "beside it are points that are free by another way in only"
        if (one := self.advice.beside) is not None and one.beside is not None:
            return self.beyond(self.along, one)
        if len(self.axes) > 1 and "depth" not in self.axes and self.advice.narrow:
            return "the map ends beside it, extend it to learn more"
        along = self.advice.stay_within[self.along]
        low, high = along.below.value, along.above.value
        if low is None or high is None:
            return "the sweep ends beside it, extend it to learn more"
        if (high - low) / 2 < float(tolerance(self.along, np.array([low, self.advice.point[self.along]]))[1]):
            ends = " and ".join(self.fmt.value(self.along, value) for value in (low, high))
            return f"no finer map shows room between {self.fmt.named(self.along, ends)}"
        return "a finer map around it would show more"

    def _borders(self, axis: str) -> tuple[Border | None, Border | None]:
        one = (self.advice.lines or self.advice.stay_within).get(axis)
        return (one.below, one.above) if one else (None, None)

    def _over_depths(self) -> str:
        assert self.advice.depths is not None
        over, fmt = self.advice.depths, self.fmt
        where = "At" if over.first == over.last else "From"
        ends = fmt.range("depth", [over.first, over.last])
        how = self._percent() if self.is_of_starts else self.how
        if self.advice.share is not None and not self.is_of_starts:
            how += f", with {self._percent()}"
        text = f"{where} {ends} {self.setting() or 'the setting'} is {self.free}, {how}"
        if over.above is not None:
            text += f"; nothing is at {fmt.value('depth', over.above)}"
        if over.beyond is not None:
            text += f"; at {fmt.value('depth', over.beyond)} no longer"
        if told := self.after_tag() or (CUT_SHORT if self.is_cut_short else ""):
            text += f"; {told}"
        return f"Hint only: {text[0].lower()}{text[1:]}." if self.advice.kind == Kind.HINT else f"{text}."

    def _nothing(self) -> str:
        if self.confidence is not None:
            text = f"Nothing is {self._known()}{100 * self.confidence:g} % safe{self._where()}"
            if self.advice.point:
                return f"{text}. Best: {self.setting()}, {self.how}, {self._percent()}."
            return self._stopped(f"{text}, at no point in any sample:")
        if self.advice.grade == Grade.ONLY_FROM_ABOVE:
            lowered = reached(("down",), self.carried, moved=self.moved)
            raised = reached(("up",), self.carried, moved=self.moved)
            if "up" not in self.ways:
                begun = {"wob": "run with the weight raised", "depth": "run from shallower depths"}.get(
                    self.carried, "brought up from below"
                )
                return f"Hint only: {self.setting()} is {self._free} {self._when}{self.how}. Nothing was {begun}."
            free = f"{'when ' if lowered == 'lowered from above' else ''}{lowered}"
            known = f"{self._known()}safe {raised}{self._where()}"
            whole = f"Nothing is {known}. {self.setting()} is {self._free} only {free};"
            brief = f"{self._free.capitalize()} only {free}: {self.setting()}."
        else:
            whole, brief = f"Nothing is {self._known()}safe{self._where()}:", ""
        helps = self._helps()
        texts = [self._stopped(whole, one) for one in helps] + [f"{brief} {one}" for one in helps if brief]
        return first_short(*texts, self._stopped(whole))

    def _where(self) -> str:
        """Within what nothing is safe, where other points of the map are free: `` at 20 to 35 klbf``."""
        ends = [
            self.fmt.named(axis, self.fmt.range(axis, [one["from"], one["to"]]))
            for axis, one in (self.drilled or {"ranges": {}})["ranges"].items()
        ]
        return f" at {' and '.join(ends)}" if ends else ""

    def _stopped(self, text: str, after: str = "") -> str:
        """The ``text`` with what stops it, beside what comes ``after``: the first with where it does, of the last no
        more than the name, as far as there are words."""
        names = [
            _NEAR[name] if name in _NEAR else self.responses[name].words
            for name, *_ in (*self.advice.stops, *self.advice.near)
        ]
        found = [
            f"{words} at {self.fmt.named(self.along, self.fmt.range(self.along, [low, high]))}"
            for words, (_, low, high) in zip(names, (*self.advice.stops, *self.advice.near), strict=True)
        ]
        number = len(found)
        parts = [[*found[:placed], *names[placed:]] for placed in range(number, 0, -1)]
        parts += [found[:1] + names[1:told] for told in range(number - 1, 0, -1)]
        told = (", ".join(part) for part in parts) if found else ("every point is unknown",)
        return first_short(*(f"{text} {one}. {after}".rstrip() for one in told))

    # The lines beside it.

    def lines(self) -> list[str]:
        """What lies beside the setting, the way in, the way out, and what is seen at the
        surface."""
        if self.advice.kind in (Kind.NOTHING, Kind.UNKNOWN):
            return []
        told = list(self._lines())[:MOST_LINES]
        now = self.as_it_is
        return [f"{now.capitalize()}. {told[0]}", *told[1:]] if now and told else told

    @property
    def as_it_is(self) -> str:
        """``string as it is``: of which what the map tells holds, where a change of it is named beside; "" where none
        is, and of another weight, which the map has."""
        part = trial_words.changed_part(self.advice.trials)
        return f"{part} as it is" if part and part != "weight" else ""

    def _lines(self) -> Iterator[str]:
        rests = f" {self.rests_on()}"
        for axis in self.axes:
            if axis in self.advice.stay_within:
                yield f"{self._beside(axis)}{rests}".rstrip()
                rests = ""
        met = None if self.is_withdrawn else self.advice.vibrates
        if self.advice.way_in is not None and met is None:
            yield self._way_in()
        if met is not None:
            verbs = self.verbs_of(met.responses, "or")
            yield f"If it {verbs}: {self.again}; it does so {self._in_runs()}, and would again."
        elif self.advice.recover is not None:
            yield self._way_out()
        elif goes_on := self.goes_on():
            yield f"If it vibrates: {goes_on}; {self.again}."
        if self.advice.surface is not None and self.advice.surface.torque is not None:
            yield self._at_surface()

    def _beside(self, axis: str) -> str:
        """``Slower: at 80 rpm it sticks. Faster: at 120 rpm it whirls. Never exceed 115
        rpm.``"""
        below, above = self._borders(axis)
        one = (self.advice.lines or self.advice.stay_within)[axis]
        ends = "the sweep" if axis == self.along else "the map"
        if self.chain is not None and axis == self.carried:
            ends = "this part of the sweep"
        low = self.beyond(axis, below) or f"{ends} begins at {self.fmt.value(axis, one.low)}"
        last = "" if axis == self.along else f" at {self.fmt.value(axis, one.high)}"  # of that "known to" tells it
        high = self.beyond(axis, above) or f"{ends} ends{last}, extend it to learn more"
        if axis not in _SIDES:
            return f"{quantity(axis).words.capitalize()}, less: {low}. More: {high}."
        less, more = _SIDES[axis]
        if self.is_cut:  # it holds where the other setting is as it is
            others = {one: self.set_value(one) for one in self.advice.stay_within if one != axis}
            less = f"{less}, at {self.fmt.setting(others, others)}"
        text = f"{less}: {low}. {more}: {high}."
        if (most := self.exceed(axis)) is None:
            return text
        value, why = most
        if self.advice.never_exceed(axis) is None:
            return f"{text} Known to {value}." if axis == self.along else text
        return f"{text} Never exceed {value}{'' if why == high else f': {why}'}."

    def rests_on(self) -> str:
        """``Rests on 30 settings every 5 rpm and 2 klbf, none between; 12 inferred, not run.``: what
        stands behind what to stay within; "" where that is no range."""
        found = self.advice.basis
        if found is None or self.is_withdrawn or self.advice.vibrates is not None:
            return ""
        steps = [
            self.fmt.steps(axis, *found.steps[axis]) + ("" if axis in ORDER else f" of {self.fmt.name(axis)}")
            for axis in in_order(found.steps)
        ]
        every = f" every {listed(steps)}, none between" if steps else ""
        inferred = f"; {found.inferred} inferred, not run" if found.inferred else ""
        return f"Rests on {count(found.settings, 'setting')}{every}{inferred}."

    def exceed(self, axis: str) -> tuple[str, str] | None:
        """What never to exceed along an axis, as it can be set, and why; the one meaning of
        all texts. It holds at every value of the other axis within what to stay within. None of
        an axis that no one sets, and where nothing is ordered."""
        limit = self.advice.most.get(axis)
        if limit is None or self.advice.is_no_order:
            return None
        return self.last(axis, limit.value), self.beyond(axis, limit.beyond) or NOTHING_ABOVE

    def beyond(self, axis: str, border: Border | None) -> str:
        """What lies beyond an end; empty where nothing does."""
        if border is None or border.value is None:
            return ""
        at = f"at {self.fmt.value(axis, border.value)}"
        if border.beside is not None:
            at += f" and {self.fmt.named(border.beside[0], self.fmt.value(*border.beside))}"
        if border.outside and border.grade is None and not border.is_unsettled:
            return self._outside(axis, border.value)
        if border.outside:
            at += ", not drilled,"
        verbs = self.verbs_of(border.responses)
        down = "started there" if border.is_started else self._down
        if border.is_unsettled:
            return f"{at} a motion was still changing"
        if border.is_on_wall and self.advice.way_in is not None:
            return f"at {self.wall_range(self.advice.way_in)} off bottom the collar reaches the wall"
        if border.by_trial:
            return f"{at} it {verbs or 'stalls'} in a trial"
        if border.not_passed:
            return f"{at} it is not known: nothing was brought up through {border.not_passed}"
        if border.is_jumped:
            return f"{at} it is not known: a step to there may jump across a vibration"
        if border.is_gap:
            return f"{at} it is not known: nothing was run between"
        if border.grade == Grade.STALLED:
            return f"{at} the bit stalls"
        if border.grade == Grade.STICKS_ON and border.sticks_to is None:
            return f"{at} steady drilling is unstable"
        if border.grade == Grade.STICKS_ON:
            return f"{at} {_stick_slip(border)}, once started, {self._to(border.sticks_to)}"
        if border.free_from is not None:
            starts = f"{border.free_from[0]} of {count(border.free_from[1], 'start')}"
            return f"{at} it is {self._free} from {starts} only" + (f": from others it {verbs}" if verbs else "")
        if border.grade == Grade.FROM_START:
            return f"{at} it is {self._free} {Grade.FROM_START.started(self.advice.from_rest)}"
        if border.grade in (Grade.FROM_BELOW, Grade.FROM_BELOW_ONLY):
            return f"{at} it is {self._free} from below only" + (f": {down} it {verbs}" if verbs else "")
        if border.is_unmodelled:
            return f"{at} a second bending mode, which the model leaves out, is near"
        if border.grade == Grade.UNKNOWN:
            return f"{at}{self._known_of(border, verbs, down)}"
        if border.grade == Grade.BORDERLINE:
            return f"{at} it is near a limit" + (f": {down} it {verbs}" if verbs else "")
        than = " more than is allowed" if verbs and self.severity else ""
        return f"{at} it {verbs or 'is critical'}{than}"

    def _outside(self, axis: str, value: float) -> str:
        """Why what is free beyond an end is no leave: the range given to drill in, with its ends."""
        ends = (self.drilled or {"ranges": {}})["ranges"].get(axis)
        doing = "drill" if self.drills else "work"
        if ends is None or ends["from"] <= value <= ends["to"]:
            return f"{self.fmt.value(axis, value)} is outside the range given to {doing} in"
        given = self.fmt.named(axis, self.fmt.range(axis, [ends["from"], ends["to"]]))
        return f"the range given to {doing} in is {given}"

    def _known_of(self, border: Border, verbs: str, down: str) -> str:
        """What is known of a point of which not all is: `` it whirls, and a start there is not known to be safe``."""
        sticks = f"{_stick_slip(border)}, once started, {self._to(border.sticks_to)}" if border.sticks_to else ""
        if not border.is_partly_known:
            return f" nothing is known{f' but that {sticks}' if sticks else ''}"
        if verbs and border.is_met_on_way_in:
            return f" it {verbs}, and a start there is not known to be safe"
        if verbs:
            return f" {down} it {verbs}, and the rest is not known"
        return f" it is not known to be {self._free}{f', and {sticks}' if sticks else ''}"

    @property
    def _down(self) -> str:
        return {"wob": "with the weight lowered", "depth": "from below"}.get(self.carried, "coming down")

    def _way_in(self) -> str:
        """``Way in: off bottom to 100 rpm, through 59 to 68 rpm at 1.8 rpm/s or faster; then
        set 25 klbf.``"""
        way = self.advice.way_in
        assert way is not None
        told = trial_words.ways_words(self.advice.trials) if self.advice.trials else ""
        text = "none is known" if self.is_withdrawn else self.way(way)
        if NOT_RUN in text or (self.untried_rate() in text and self.untried_rate()):
            text += " (--trials tries it)"
        slowly = f" {where}." if (where := self.slowly_within()) else ""
        return f"Way in: {text[:1].lower()}{text[1:]}.{slowly}{f' Trials: {told}.' if told else ''}"

    def slowly_within(self) -> str:
        """``Brought up slowly it whirls at 12 klbf and 150 rpm``, where a point within the limits is free from a
        quick start only and the setting is not; else ""."""
        if self.advice.kind != Kind.QUICK_START or not self.advice.slowly_at:
            return ""
        there = self.advice.slowly_at
        slowly = ("With the weight raised" if self.carried == "wob" else "Brought up slowly") + self.begun()
        where = " and ".join(self.fmt.named(axis, self.fmt.value(axis, there[axis])) for axis in in_order(there))
        return f"{slowly} it {self.verbs_of(self.advice.slowly) or 'vibrates'} at {where}"

    def untried_rate(self) -> str:
        """That the map crossed a vibration slowly only, where the way in leads through one; "" where
        trials crossed it."""
        way = self.advice.way_in
        if way is None or not way.crossed or self.advice.trials:
            return ""
        it = "it" if len(way.crossed) == 1 else "them"
        return f"the map crossed {it} slowly; how it ends when crossed faster was not tried"

    @property
    def is_withdrawn(self) -> bool:
        """Whether trials leave nothing of the setting."""
        return self.advice.is_withdrawn

    def _rate(self, way: WayIn | None) -> float | None:
        """The rate at which the speed is to be raised at least [rad/s^2]: to pass the wall off
        bottom, or from which on trials ended free; None where it may be raised slowly."""
        if way is None or not way.rate:
            return None
        if way.crosses and (way.first == First.SPEED or not self.advice.trials):
            return way.rate
        tried = self.advice.trials.ways_in() if self.advice.trials is not None else []
        return way.rate if way.rate > SLOW and any(one.rate == way.rate for one in tried) else None

    def rates(self, way: WayIn | None) -> str:
        """At which rates the speed is to be raised: without trials ``3 rpm/s or faster``, or "" where at
        any, or where the bit would swing back to the wall's speeds those at which it does not; after trials
        the rates between which all were free, ``1 to 10 rpm/s``."""
        if way is None or way.most is None:
            rate = self._rate(way)
            if rate and way is not None and way.swing_rate is not None and way.can_pass:
                return self.fmt.rates(rate, way.swing_rate)
            return f"{self.fmt.rate(rate)} or faster" if rate else ""
        least = way.rate or way.most
        return self.fmt.rate(way.most) if least == way.most else self.fmt.rates(least, way.most)

    def _tried_way(self) -> str:
        """``speed first, 1 rpm/s or faster``: the way in of trials, where the weight first did
        not end free at every rate; else ""."""
        way, found = self.advice.way_in, self.advice.trials
        if way is None or found is None or found.withdraws or way.first == First.NONE:
            return ""
        slow = found.rates(WEIGHT_FIRST)
        if slow and free_from(slow) == 0:
            return ""
        name = WEIGHT_FIRST if way.first == First.WEIGHT else SPEED_FIRST
        rates = self.rates(way)
        return f"{name}, {rates}" if rates else name

    def way(self, way: WayIn) -> str:
        """The way in as an order, the same in all texts."""
        fmt, advice = self.fmt, self.advice
        speed = advice.held.get("rotary_speed") if "rotary_speed" not in advice.point else None
        if "rotary_speed" in advice.point:
            speed = self.set_value("rotary_speed")
        wob = self.set_value("wob") if "wob" in advice.point else advice.held.get("wob")
        weight = "the weight" if wob is None else fmt.value("wob", wob)
        to = "" if speed is None else f" to {fmt.value('rotary_speed', speed)}"
        if way.first == First.NONE:
            verbs = self.verbs_of(advice.slowly) or "vibrates"
            return f"None is known: with {weight} on it {verbs}, and {self._impassable(way)}"
        if way.first == First.WEIGHT:
            text = f"Set {weight}"
            if way.begins is not None:
                text += f" at {fmt.value('rotary_speed', way.begins)}"
            text += self._set_in()
            if advice.trials is not None and advice.trials.held is not None:
                text += f", hold {advice.trials.held[0]:g} to {advice.trials.held[1]:g} s"
            text += f", then raise the speed{to}"
            text += f" at {rates}" if (rates := self.rates(way) if advice.trials else "") else ""
            # the map, which stops at every speed, vibrates
            text += " without a stop" if advice.grade == Grade.FROM_START else ""
            parts = [self.crossed()] if way.crossed else []
            if way.through is not None:
                _, high = fmt.outwards("rotary_speed", way.through, way.through)
                parts = [f"stick-slip up to {fmt.value('rotary_speed', high)}", *parts]
            text += f", through {' and '.join(parts)}" if parts else ""
            text += f"; {untried}" if (untried := self.untried_rate()) else ""
            text += f"; {SHAKEN}" if self._is_shaken(way) else ""
            return (
                f"{text}; {self._impassable(way)}" if way.crosses and not way.can_pass and not advice.trials else text
            )
        through = f", through {self.wall_range(way)}" if way.crosses and way.wall else ""
        rate = f" at {rates}" if (rates := self.rates(way)) else ""
        if way.crosses and way.wall:
            rate += " without a stop"
        then = f"set {weight}"
        if way.at_once and not advice.trials:
            then += " at once"
        then += self._set_in()
        if advice.trials is not None and advice.trials.held is not None:
            then = f"within {advice.trials.held[1]:g} s {then}"
        if way.from_weight is not None and (wob is None or wob > way.from_weight * (1.0 + 1e-9)):
            then = f"raise the weight from {fmt.value('wob', way.from_weight)}"
            then += f" to {fmt.value('wob', wob)}" if wob is not None else ""
            then += f", through {self.crossed()}" if way.crossed else ""
            then += f"; {untried}" if (untried := self.untried_rate()) else ""
        elif way.crossed and not advice.trials:
            then += f"; with the weight on it comes up through {self.crossed()}; {NOT_RUN}"
        if self._is_shaken(way):
            then += f"; {SHAKEN}"
        return f"Off bottom raise the speed{to}{through}{rate}, then {then}"

    def _set_in(self) -> str:
        """In what time the weight was set in trials: `` in 5 to 20 s``."""
        found = self.advice.trials
        return "" if found is None or found.set_down is None else " in {:g} to {:g} s".format(*found.set_down)

    def _is_shaken(self, way: WayIn) -> bool:
        """Whether bit-bounce may begin on a way in that no trial tried, of which nothing else says so."""
        return way.is_shaken and not self.advice.trials and "bit_bounce" not in [name for name, *_ in way.crossed]

    def wall_range(self, way: WayIn) -> str:
        """The speeds at which a collar off bottom reaches the wall."""
        assert way.wall is not None
        return self.fmt.range_outwards("rotary_speed", *way.wall)

    def begin_of_wall(self, way: WayIn) -> str:
        """From where on the speed is raised without a stop."""
        low = way.no_stop_from
        assert low is not None
        return self.fmt.value("rotary_speed", self.fmt.outwards("rotary_speed", low, low)[0])

    def setting_of(self, axis: str) -> str:
        """The value of the point along an axis, as it can be set."""
        return self.fmt.value(axis, self.set_value(axis))

    def _impassable(self, way: WayIn) -> str:
        if way.is_fast_enough:
            return f"off bottom the bit would swing back to {self.wall_range(way)}, where the collar reaches the wall"
        return f"off bottom no drive passes {self.wall_range(way)} before the collar reaches the wall"

    def _way_out(self) -> str:
        found, fmt = self.advice.recover, self.fmt
        assert found is not None
        again = self.again
        verbs = self.verbs_of(found.responses, "or") or "vibrates"
        if self.advice.is_without_way_in:
            return f"If it {verbs}: {again}."
        if self._sticks_on() and found.outcome not in (Recovery.LASTS, Recovery.ENDS):
            return f"If it sticks: it {self._to(self.advice.sticks_to)}; {again}."
        rolls = self.may_stay()
        if found.outcome == Recovery.LASTS:
            slowed = trial_words.slowed_to(self.advice.trials, fmt)
            return f"If it {verbs}: it does not stop {slowed or 'in the map'}; {again}{rolls}."
        if found.outcome == Recovery.STOPS:
            return f"If it {verbs}: knocked in a trial it came free again; other vibrations were not met{rolls}."
        if found.outcome == Recovery.NOT_MET:
            verbs = "whirls" if self._wall_may_hold() else verbs
            if self._wall_may_hold() and "whirl" in found.elsewhere:
                return f"If it {verbs}: this sweep met that elsewhere, but no run shows what ends it; {again}{rolls}."
            met = "did not meet that above the setting" if found.elsewhere else "did not meet that"
            return f"If it {verbs}: this sweep {met}; {again}{rolls}."
        if found.outcome == Recovery.LEFT_OUT:
            return f"If it {verbs}: what the sweep met above is not in this part of it; {again}{rolls}."
        assert found.at is not None
        at, lowered = self.lowered_to(), self.lowered()
        if not lowered:
            return f"If it {verbs}: {again}{rolls}."
        verbs = self.verbs_of(lowered, "or")
        if found.then:
            motion = self._motion(lowered)
            rolls = "" if "whirl" in found.responses else rolls  # the run shows where it ends
            return f"If it {verbs}: lowered to {at} the {motion} ends, but then {self.comes(found)}; {again}{rolls}."
        if self.may_not_slow():
            return f"If it {verbs}: {again}; in the map it ended only at {at}, below the limits{rolls}."
        if self._wall_may_hold():
            whirls = f"If it whirls: not run; {again}{rolls}."
            return f"If it {verbs}: lower to {at}{self.not_below()}.{self.raise_again()} {whirls}"
        above = " above the setting" if self.ends_at_setting() else ""
        at += self.below_limits() + self.not_below()
        return f"If it {verbs}{above}: lower to {at}; {self.was_free()}.{self.raise_again()}"

    def lowered_to(self) -> str:
        """To where a vibration is lowered, as it can be set above what bounds that."""
        found = self.advice.recover
        assert found is not None
        assert found.at is not None
        at = self.fmt.inwards(found.axis, 0.0, found.at)[1]
        if found.bound is not None and at <= (found.bound.value or 0.0):
            at = found.at
        return f"{self.fmt.named(found.axis, self.fmt.value(found.axis, at))}{self._only_at()}"

    def _lowered_range(self) -> str:
        """Where runs that were lowered were free: ``20 to 24.5 rpm``, which is what was run."""
        found = self.advice.recover
        assert found is not None
        assert found.at is not None
        low = found.at if found.free_to is None else found.free_to
        at = self.fmt.range_inwards(found.axis, low, found.at) if low < found.at else self.fmt.value(found.axis, low)
        return f"{self.fmt.named(found.axis, at)}{self._only_at()}"

    def _did(self, responses: Iterable[str]) -> str:
        """What runs did with these responses: ``met bit-bounce and stick-slip``."""
        return f"met {listed([self.responses[name].words for name in responses])}"

    def _only_at(self) -> str:
        """At which value of the other axis alone a vibration ends there: `` at width 2``."""
        found = self.advice.recover
        if found is None or found.only_at is None:
            return ""
        axis = found.only_at[0]
        return f" at {self.fmt.named(axis, self.setting_of(axis))}"

    def _at_bound(self, bound: Border) -> str:
        found = self.advice.recover
        assert found is not None
        assert bound.value is not None
        beside = "" if bound.beside is None else f" at {self.fmt.named(bound.beside[0], self.fmt.value(*bound.beside))}"
        return f"{self.fmt.value(found.axis, bound.value)}{beside}"

    def not_below(self) -> str:
        """What bounds the speed to which a vibration is lowered: ``, but not to 30 rpm, where it sticks``; and where
        it leaves no room to hold that speed."""
        found = self.advice.recover
        if found is None or found.at is None:
            return ""
        held = "" if found.held_to is None else self.fmt.value(found.axis, found.held_to)
        room = f" (no room for the {held} to which it is held)" if held else ""
        if limit := self._nearer_limit():
            return f", but not below {limit[0]} ({limit[1]}){room}"
        if found.bound is not None:
            return f", but not to {self._at_bound(found.bound)}, where {self._there(found.bound)}{room}"
        if not held:
            return ""
        if found.free_to is None or found.free_to == found.at:
            return f", but not below it, as no run here was lower{room}"
        low = self.fmt.outwards(found.axis, found.free_to, found.free_to)[1]
        return f", but not below {self.fmt.value(found.axis, low)}, as no run here was lower{room}"

    def _nearer_limit(self) -> tuple[str, ...]:
        """The lower limit of what to stay within, and why it is one, where it is met sooner than what bounds the
        lowering: two numbers for one order contradict each other. Empty where it is not."""
        one = self.advice.nearer_limit
        if one is None or self.advice.recover is None:
            return ()
        axis = self.advice.recover.axis
        low, _ = self.fmt.inwards(axis, one.low, one.high)
        return self.fmt.value(axis, low), self.beyond(axis, one.below)

    def _there(self, bound: Border) -> str:
        if bound.grade == Grade.UNKNOWN:
            return "it is not known to be free"
        if bound.grade == Grade.STALLED:
            return "the bit stalls"
        verbs = self.verbs_of(bound.responses)
        return f"it {verbs}" if verbs else "it is near a limit" if bound.grade == Grade.BORDERLINE else "it is critical"

    def comes(self, found: Recover) -> str:
        """What comes where a vibration ends: ``it sticks``, or ``stick-slip may begin``."""
        if not found.may:
            return f"it {self.verbs_of(found.then)}"
        return f"{listed([self.responses[name].words for name in found.then])} may begin"

    def lowered(self) -> tuple[str, ...]:
        """The responses that lowering ends: of the speed never stick-slip, which asks for the opposite."""
        found = self.advice.recover
        names = found.responses if found is not None else ()
        is_speed = found is not None and found.axis == "rotary_speed"
        return tuple(name for name in names if not (is_speed and name == "stick_slip"))

    def was_free(self) -> str:
        """What the way down, or a trial alone, showed; no more than that where the wall may hold a collar there."""
        found = self.advice.recover
        assert found is not None
        if found.by_trial and not self.may_stay_on_wall():
            return "lowered to it a knocked string came free in a trial"
        if not self.may_stay_on_wall():
            text = f"runs lowered to {self._lowered_range()} were free"
            return f"{text}, those brought up there {self._did(found.raised)}" if found.raised else text
        who = "what a knock started in a trial" if found.by_trial else "what the map met"
        return f"{who} had ended there, but {self.may_stay().removeprefix('; ')}"

    def may_stay(self) -> str:
        """At which speeds a collar may stay on the wall; "" of one that cannot."""
        found = self.advice.recover
        if found is None or found.lasts_above is None:
            return ""
        return f"; a collar on the wall may stay there {self.fmt.above('rotary_speed', [found.lasts_above])}"

    def may_stay_on_wall(self) -> bool:
        """Whether the wall may hold a collar at the speed to which a vibration was lowered, and no
        trial knocked one on to it."""
        found, tried = self.advice.recover, self.advice.trials
        if found is None or found.at is None or found.lasts_above is None or found.axis != "rotary_speed":
            return False
        return found.at > found.lasts_above and not (tried is not None and tried.is_tried(ON_WALL))

    def may_not_slow(self) -> bool:
        """Whether whirl ended on the way down only below the limits, at a speed at which the wall may hold a collar:
        another run would not show it there, and it is nowhere to drill, so that it is no cure."""
        found = self.advice.recover
        ends = found is not None and found.outcome == Recovery.ENDS and not found.then and "whirl" in self.lowered()
        return ends and self.may_stay_on_wall() and bool(self.below_limits())

    def ends_at_setting(self) -> bool:
        """Whether what was met above the setting ends on the way down to it: what becomes of a vibration
        at the setting no run tells."""
        found = self.advice.recover
        return found is not None and found.at is not None and found.at == self.advice.point.get(found.axis)

    def goes_on(self) -> str:
        """In how many samples a vibration that began elsewhere may go on at the setting; "" where in none."""
        share = self.advice.share
        if share is None or self.is_of_starts or "down" not in self.ways:
            return ""
        lasts = share.probability - share.any_history
        return f"once started, it may go on here in {100 * lasts:.0f} % of the samples" if lasts > 0.005 else ""

    def below_limits(self) -> str:
        """That a vibration ends below what to stay within, which is left for that alone."""
        found = self.advice.recover
        if found is None or found.at is None:
            return ""
        one = self.advice.stay_within.get(found.axis)
        return ", though that is below the limits" if one is not None and found.at < one.low else ""

    @property
    def again(self) -> str:
        """What ends a vibration that nothing else does; where nothing is ordered, nothing comes after it."""
        if self.advice.is_no_order:
            return STOP if self.drills else END
        return AGAIN if self.drills else AFRESH

    def raise_again(self) -> str:
        """How one comes back from the speed to which a vibration was lowered: by the way in, which stands above,
        and not with the weight on; and that stick-slip may last there."""
        found, to = self.advice.recover, self.advice.sticks_to
        if found is None or found.at is None or self.ends_at_setting():
            return ""
        if not self.drills:
            return " Then raise it again."
        if "up" not in self.ways:  # of a way in none stands above
            return " Then pick up and start again."
        if found.axis != "rotary_speed" or found.at > (to or 0.0):
            return f" {AGAIN_AS_ABOVE}."
        if not isfinite(to or 0.0):
            return f" {AGAIN_AS_ABOVE}. But stick-slip, once started, {self._to(to)}."
        return f" {AGAIN_AS_ABOVE}: stick-slip, once started, {self._to(to)}."

    def met_at(self, speed: float | None) -> str:
        """At which speed that was met of which the torque is told."""
        return "" if speed is None else f" at {self.fmt.value('rotary_speed', speed)}"

    def seen_at(self) -> str:
        """Of an answer that holds over several weights or depths at which of them the torque was read: `` at 3000 m``;
        at others it is another one."""
        seen, depths = self.advice.surface, self.advice.depths
        assert seen is not None
        ranges = {axis: (one.low, one.high) for axis, one in self.advice.stay_within.items()}
        ranges |= {"depth": (depths.first, depths.last)} if depths is not None else {}
        told = [axis for axis in in_order(seen.at) if axis in ranges and ranges[axis][0] < ranges[axis][1]]
        return f" at {listed([self.fmt.value(axis, seen.at[axis]) for axis in told])}" if told else ""

    def _at_surface(self) -> str:
        seen, fmt = self.advice.surface, self.fmt
        assert seen is not None
        assert seen.torque is not None
        steady = "steady" if seen.swing is None else f"swinging {fmt.range(TORQUE, list(seen.swing))}"
        above = ", above the torque off bottom" if seen.above_off_bottom else ", torque off bottom included"
        where = f"Surface{self.seen_at()}{above}"
        text = f"{where}: free {fmt.value(TORQUE, seen.torque)}, {steady}"
        if (met := self.advice.vibrates) is not None:
            shown = "which swings too little to show it" if seen.swing is None else steady
            did = self.verbs_of(met.ways[0].responses) or "vibrates"
            text = f"{where}: as it {did} {fmt.value(TORQUE, seen.torque)}, {shown}"
        if seen.sticking is not None:
            text += f"; stick-slip{self.met_at(seen.sticking_at)} swings {fmt.range(TORQUE, list(seen.sticking))}"
            text += period_words(seen) or "; how often was not measured"
        if seen.whirling is not None:
            text += f"; whirl{self.met_at(seen.whirling_at)} shows {fmt.value(TORQUE, seen.whirling)}"
            if seen.acceleration is not None:
                text += f", and {seen.acceleration / 9.80665:.1f} g r.m.s. downhole"
        return f"{text}."
