"""Trials of a setting, and what would help where none is allowed, in words."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from math import isclose

from nsdrill.analysis.trials import (
    HELD,
    HELD_IN_CORNER,
    OFF_ROCK,
    OTHER_BIT,
    SLOWED,
    SPEED_FIRST,
    TAGGED,
    TAGGED_IN_CORNER,
    WEIGHT_FIRST,
    Change,
    Outcome,
    Robust,
    Trial,
    Trials,
    Way,
    bad_tag,
    free_from,
)
from nsdrill.errors import count
from nsdrill.models.damped import LOW
from nsdrill.models.responses import RESPONSES
from nsdrill.quantity import quantity
from nsdrill.units import from_si
from nsdrill.words.values import Formatter

_WIDTH = 40
_IN_CORNER = {HELD_IN_CORNER: ", the bit held and let go", TAGGED_IN_CORNER: ", picked up and tagged again"}
_CUT = "one way up, less what vibrates in trials near this weight,"
MOST_TOLD = 3  # corners


def rate_words(rate: float) -> str:
    """``1 rpm/s``, which drillers say in all units."""
    return f"{from_si(rate, 'rpm'):.2g} rpm/s"


def ways_words(found: Trials) -> str:
    """How the ways in ended: ``weight first: 3 of 3 free; speed first: 3 of 3 free at
    1 rpm/s or faster, 0 of 1 slower``."""
    parts = []
    for name in (WEIGHT_FIRST, SPEED_FIRST):
        ways = found.ways_in(name)
        if not ways:
            continue
        rates = found.rates(name)
        place = free_from(rates)
        text = f"{name}: {_free(ways)} free"
        if 0 < place < len(rates) - 1 and (rate := rates[place].rate) is not None:
            slower = [one for one in ways if (one.rate or 0.0) < rate]
            faster = ways[len(slower) :]
            text = f"{name}: {_free(faster)} free at {rate_words(rate)} or faster, {_free(slower)} slower"
        unknown = sum(one.outcome == Outcome.UNKNOWN for one in ways)
        parts.append(f"{text}, {unknown} not known" if unknown else text)
    return "; ".join(parts)


def _free(ways: list[Trial]) -> str:
    return f"{sum(one.outcome == Outcome.FREE for one in ways)} of {len(ways)}"


def slowed_to(found: Trials | None, fmt: Formatter) -> str:
    """To where a vibration was lowered without an end: ``when lowered to 40 rpm``; "" where
    no trial tells it."""
    for knock, one in found.knocks if found is not None else ():
        if one is not None and one.speed is not None and set(one.responses) & set(knock.responses):
            return f"when lowered to {fmt.value('rotary_speed', one.speed)}"
    return ""


def disturbed(found: Trials | None, verbs_of: Callable[[Iterable[str]], str]) -> str:
    """By what trial but of ways in the setting vibrates, in a few words: ``knocked off the rock in a trial it
    bounces``; "" where by none."""
    bad = [one for one in found.trials if one.outcome.is_bad] if found is not None else []
    others = [one for one in bad if one.way not in (Way.IN, Way.CORNER) and one.name != SLOWED]
    return f"{others[0].name} in a trial it {verbs_of(others[0].responses) or 'stalls'}" if others else ""


def ended_in(found: Trials) -> str:
    """In what the ways in ended that did not end free, with how many: ``whirl (7), stick-slip (1)``; "" of none."""
    ends = Counter(outcome_words(one).replace(", ", " + ") for one in found.ways_in() if one.outcome.is_bad)
    return ", ".join(f"{words} ({number})" for words, number in ends.most_common())


def outcome_words(one: Trial) -> str:
    """``free``, ``whirl``, ``not known: interrupted``."""
    if one.outcome == Outcome.UNKNOWN:
        return f"not known{f': {one.why}' if one.why else ''}"
    names = (RESPONSES[name].words for name in one.responses)
    return "free" if one.outcome == Outcome.FREE else ", ".join(names) or "critical"


def best_words(found: Trials | None, along: str, fmt: Formatter, *, brief: bool = False) -> str:
    """The change that helps most: ``stabilisers 30 ft apart would free 90 to 160 rpm at 20 klbf, tried
    there only``; "" where none does. In ``brief`` without what it takes, and why it is poor."""
    best = found.best if found is not None else None
    return "" if found is None or best is None else change_words(best, found, along, fmt, brief=brief)


def change_words(change: Change, found: Trials, along: str, fmt: Formatter, *, brief: bool = False) -> str:
    """What a ``change`` frees, and at which weight alone it was tried, or that it was not where others were; "" where
    it frees nothing. In ``brief`` without what it takes, and why it is poor."""
    wob, poor = _weight_of(change, found), _poor(change)
    change = (change.less_with_low if brief else None) or change
    if change.widest is None:
        return ""
    where = f" at {fmt.value('wob', wob)}" if wob is not None and change.name != "weight" else ""
    where += ", untried elsewhere" if where and change.key and len(found.wobs) < 2 else ""
    tried = any(one.trials for each in found.changes for one in each.every)
    where += ", untried" if change.key and tried and not change.trials else ""
    if change.weights is not None and change.weights[1] > change.weights[0]:
        where = f" at {fmt.range_inwards('wob', *change.weights)}"
    passed = f", not {fmt.range_outwards(along, *change.passed)}" if change.passed is not None else ""
    free = f"{fmt.range_inwards(along, *change.widest)}{where}{passed}"
    if not change.key:
        return f"one run brought up from below was free at {free}: have the map run along the speed"
    is_sure = (
        bool(change.trials)
        and change.jump is None
        and change.holds_usual is not False
        and (change.low is None or change.low.has_room)
        and all(one.outcome == Outcome.FREE for one in change.inside if one.name != SLOWED)
    )
    does = f"{'would' if is_sure else 'may'} free {free}"
    nothing = f" (nothing with damping {LOW:g})" if change.low is not None and not change.low.has_room else ""
    if brief:  # what holds with either damping
        return f"{change.words} {does}{' (poor)' if poor else ''}{nothing}"
    effort = "" if change.name == OTHER_BIT else f", {change.effort.words},"
    return f"{change.words}{effort} {does}{_with_damping(change, along, fmt)}{poor}"


def changed_part(found: Trials | None) -> str:
    """What the change that helps most is one of: the string, the drive, the weight or the bit; "" where none helps."""
    best = found.best if found is not None else None
    if best is None or not best.key:
        return ""
    return {"drive": "drive", "weight": "weight", OTHER_BIT: "bit"}.get(best.name, "string")


def _with_damping(change: Change, along: str, fmt: Formatter) -> str:
    """On which damping ratio a ``change`` rests, and what it frees with the least that is usual where that is less."""
    if change.ratio is None:
        return ""
    rests = f"damping ratio {change.ratio:.2g}"
    if (less := change.less_with_low) is not None:
        return f" ({rests}; with {LOW:g} only {_range_of(less, change, along, fmt)})"
    if change.low is not None and not change.low.has_room:
        return f" ({rests}; nothing with {LOW:g})"
    return f" ({rests}{f', the same with {LOW:g}' if change.low is not None else ''})"


def _range_of(less: Change, change: Change, along: str, fmt: Formatter) -> str:
    """What is left of a ``change``: the speeds, and the weights where they are others."""
    assert less.widest is not None
    at = f" at {fmt.range_inwards('wob', *less.weights)}" if less.weights and less.weights != change.weights else ""
    return f"{fmt.range_inwards(along, *less.widest)}{at}"


def _poor(change: Change) -> str:
    """That a ``change`` is graded poor, and why; "" of a better one, and of one without trials."""
    if change.robust != Robust.POOR:
        return ""
    return f" (poor: {', '.join(change.why_poor)})"


def _weight_of(change: Change, found: Trials | None) -> float | None:
    """The weight [N] at which a ``change`` was run; None where it is not known."""
    return change.wob if change.wob is not None or found is None else found.wob


def elsewhere(change: Change, found: Trials, along: str, fmt: Formatter) -> str:
    """What a ``change`` frees at the other weights at which it was run: ``At other weights: one way up 66 to 140 rpm at
    10 klbf, nothing at 30 klbf.``; "" where at none."""
    whole = _whole(change, found)
    parts: dict[str, list[str]] = {"by trials": [], "one way up": [], _CUT: []}
    for one in whole.every:
        if one.wob is None or one.wob == change.wob:
            continue
        by, ends = "one way up", whole.left_beside(one)
        if one.trials:
            by, ends = "by trials", (one.widest,) if one.has_room and one.is_sound and one.widest is not None else ()
        elif ends != one.free:
            by = _CUT
        free = ", ".join(fmt.range_inwards(along, *each) for each in ends) or "nothing"
        told = "not known" if one.room is None else free
        parts[by].append(f"{told} at {fmt.value('wob', one.wob)}{_poor(one) if ends else ''}")
    listed = [f"{by} {', '.join(those)}" for by, those in parts.items() if those]
    return f" At other weights: {'; '.join(listed)}." if listed else ""


def _whole(change: Change, found: Trials) -> Change:
    """The ``change`` with all weights at which it was run."""
    return next((one for one in found.changes if one.is_of(change)), change)


def _of_map(change: Change, along: str, fmt: Formatter) -> str:
    """Which other speeds below what a ``change`` allows the map of it may recommend; "" where it is free at none."""
    if change.passed is None:
        return ""
    below = [(low, high) for low, high in change.free if low < high <= change.passed[0]]
    if not below:
        return ""
    free = ", ".join(fmt.range_inwards(along, *ends) for ends in below)
    return f" At {free} it is free as well when brought up, untried in trials: have a map of it run before using that."


def best_trials(found: Trials | None, along: str, fmt: Formatter) -> str:
    """How the trials of the change that helps most ended: ``In trials with 9.5 in collars at 100 rpm 7
    of 7 ways in were free; knocked off the rock: bit-bounce``; "" where no change helps."""
    best = found.best if found is not None else None
    if found is None or best is None or not best.key:
        return ""
    friction = " Another bit may have another friction: run the study with that." if best.name == OTHER_BIT else ""
    more = f"{friction}{_of_map(best, along, fmt)}{elsewhere(best, found, along, fmt)}"
    if not best.trials or best.speed is None:
        return f"What {best.words} would free is of one way up; no trial of that was run.{more}"
    ways = [one for one in best.trials if one.way == Way.IN]
    bad = [one for one in best.inside if one.outcome.is_bad and one.way != Way.IN and one.name != SLOWED]
    told = "; ".join(f"{place(one, fmt)}: {outcome_words(one)}" for one in bad)
    unknown = sum(one.outcome == Outcome.UNKNOWN for one in best.trials)
    parts = [f"{_free(ways)} ways in were free", told, f"{unknown} not known" if unknown else ""]
    return f"In trials with {best.words} at {_tried_at(best, found, fmt)} {'; '.join(filter(None, parts))}.{more}"


def _tried_at(change: Change, found: Trials | None, fmt: Formatter) -> str:
    """Where a change was tried: ``20 klbf and 100 rpm``; of another weight, which its words name, the speed."""
    speed = fmt.value("rotary_speed", change.speed or 0.0)
    wob = _weight_of(change, found) if change.name != "weight" else None
    return speed if wob is None else f"{fmt.value('wob', wob)} and {speed}"


def place(one: Trial, fmt: Formatter) -> str:
    """What a trial did; of one in a corner of the limits also where."""
    return f"{one.name} at {corner_words(one, fmt)}" if one.way == Way.CORNER else one.name


def lines(found: Trials, along: str, fmt: Formatter) -> Iterator[str]:
    """A row for each trial, and for each change."""
    if found.trials:
        where = "" if found.depth is None else f" at {fmt.value('depth', found.depth)}"
        after = f"judged over {found.observed:g} s after {found.settled:g} s at its last setting"
        yield f"Trials{where}, each {after}{_numbers(found)}:"
        yield from _rows(found.trials, fmt)
    if found.changes:
        at = f" at {', '.join(fmt.value('wob', wob) for wob in found.wobs)}" if found.wobs else ""
        begins = "" if found.begins is None else f" from {fmt.value('rotary_speed', found.begins)}"
        own = "" if found.steps is None else f" in steps of at most {fmt.value('rotary_speed', found.steps[0])}"
        yield f"One change at a time, each run one way up{begins}{own}{at}, not back down{_numbers(found)}:"
        if found.by_map is not None and found.steps is not None and not isclose(*found.steps, rel_tol=1e-6):
            step = fmt.value("rotary_speed", found.steps[1])
            yield f"  The map has steps of {step}: compare the changes with the string as it is, run in their steps,"
            yield "  not with the map."
        if found.by_map is not None:
            yield from _change_rows(replace(found.by_map, words=f"{found.by_map.words}, by the map"), found, along, fmt)
        for change in found.changes:
            yield from _change_rows(change, found, along, fmt)
        for change in (one for each in found.changes for one in each.every):
            if change.trials and change.speed is not None:
                yield f"Trials with {change.words}, at {_tried_at(change, found, fmt)}:"
                yield from _rows(change.trials, fmt)


def _rows(trials: Iterable[Trial], fmt: Formatter) -> Iterator[str]:
    """A row for each of the ``trials``, of ways in one for each rate."""
    rows: dict[object, list[Trial]] = {}
    for number, one in enumerate(trials):
        rows.setdefault((one.name, one.rate) if one.way == Way.IN else number, []).append(one)
    for same in rows.values():
        told = [_outcome(one, fmt) for one in same]
        if len(told) > 1:
            others = "; ".join(dict.fromkeys(text for text in told if text != "free"))
            told = [f"{_free(same)} free{f', else {others}' if others else ''}"]
        yield _row(_name(same[0]), told[0])


def _change_rows(change: Change, found: Trials, along: str, fmt: Formatter) -> Iterator[str]:
    """What a ``change`` does: a row, or one for each of its weights."""
    if not change.others:
        yield _row(change.words, _freed(change, found, along, fmt))
        return
    yield f"  {change.words}"
    for one in change.every:
        yield _row(f"  at {fmt.value('wob', one.wob or 0.0)}", _freed(one, found, along, fmt))


def _row(name: str, told: str) -> str:
    """A row of a table; a name that is too long for its column ends in a space as well."""
    return f"  {name:{_WIDTH - 1}s} {told}"


def _numbers(found: Trials) -> str:
    return ", with the numbers of the study itself in place of samples" if found.samples else ""


def _name(one: Trial) -> str:
    return f"{one.name}, {rate_words(one.rate)}" if one.rate is not None else one.name


def _outcome(one: Trial, fmt: Formatter) -> str:
    text = outcome_words(one)
    if one.name == SLOWED and one.speed is not None and one.outcome != Outcome.UNKNOWN:
        return f"{outcome_words(one)} at {fmt.value('rotary_speed', one.speed)}, after that: {one.after}"
    if one.way == Way.CORNER and one.speed is not None and one.wob is not None:
        return f"{text} at {corner_words(one, fmt)}"
    return text


def corner_words(one: Trial, fmt: Formatter) -> str:
    """``40 klbf and 120 rpm``, where a trial ended in a corner of the limits."""
    return f"{fmt.value('wob', one.wob or 0.0)} and {fmt.value('rotary_speed', one.speed or 0.0)}"


def _freed(change: Change, found: Trials, along: str, fmt: Formatter) -> str:
    if change.room is None and not change.trials:
        return f"not known: {change.why}"
    text = ", ".join(fmt.range_inwards(along, *ends) for ends in change.free)
    of = quantity(along).words
    told = f"; {change.why}" if change.why and change.room is not None else ""
    if (jump := change.jump) is not None:
        at = fmt.range_outwards(jump.axis, jump.low, jump.high)
        told += f"; steps of {fmt.value(jump.axis, jump.step)} may jump across {jump.motion} at {at}"
    if change.sticks_past:
        told += "; stick-slip takes it past whirl there, and begun above that it may whirl"
    if change.holds_usual is False:
        told += "; not with a usual damping of torsion"
    if not text:
        wob = None if change.name == "weight" or len(found.wobs) > 1 else _weight_of(change, found)  # the row has it
        at = f" at {fmt.value('wob', wob)}" if wob is not None else ""
        return f"free at no {of} that was run{at}{told}"
    room = f"; {_room(change, along)}" if change.room is not None and not change.trials else ""  # trials cut it
    return f"free at {text}{room}{told}{_by_trials(change, _whole(change, found), along, fmt)}"


def _by_trials(change: Change, whole: Change, along: str, fmt: Formatter) -> str:
    """What trials left of what a ``change`` frees."""
    if change.key and change.has_room and not change.trials:
        left = whole.left_beside(change)
        free = ", ".join(fmt.range_inwards(along, *ends) for ends in left) or "nothing"
        return "; untried" if left == change.free else f"; untried, and of that trials near this weight leave {free}"
    if change.weights is None or change.widest is None:
        return ""
    at = fmt.value(along, change.speed or 0.0)
    if change.room is None:
        return f"; by trials not known: {change.why}"
    if not change.is_reached:
        return f"; by trials not reached: {ways_words(Trials(change.trials))} at {at}"
    if (tagged := bad_tag(change.trials)) is not None:
        return f"; by trials not at {at}: {tagged.name} {outcome_words(tagged)}"
    if not change.has_room:
        return "; by trials no room"
    ends = f"{fmt.range_inwards(along, *change.widest)}, {fmt.range_inwards('wob', *change.weights)}"
    poor = f"poor ({', '.join(change.why_poor)})"
    grade = f"{poor if change.why_poor else change.promised.name.lower()}, {change.effort.words}"
    return f"; by trials {ends}{_with_damping(change, along, fmt)}, {_room(change, along)}: {grade}"


def _room(change: Change, along: str) -> str:
    return f"along the {quantity(along).words} room for {change.room or 0.0:.1f} tolerances"


def other_code(found: Trials | None) -> Iterator[str]:
    """That trials were not run by what ran the file, for what that means."""
    if found is not None and found.differing:
        yield (
            f"TRIALS BY ANOTHER VERSION than the runs: {'; '.join(found.differing)}. Run the study again, so that both "
            "have the same equations."
        )


def after_connection(found: Trials | None) -> Iterator[str]:
    """That the setting vibrates after a pick up and tag."""
    if found is not None and (one := found.bad_tag) is not None:
        yield (
            f"TAGGED WITH THE ROTATION ON IT VIBRATES: {one.name} in a trial, the setting ended in "
            f"{outcome_words(one)}. At a connection stop the rotation and come in anew."
        )


def of_setting(found: Trials | None, fmt: Formatter) -> Iterator[str]:
    """In what trials the setting, or a corner of its limits, vibrates."""
    if found is None:
        return
    if found.bad_corners:
        told = "; ".join(
            f"{corner_words(one, fmt)}{_IN_CORNER.get(one.name, '')}: {outcome_words(one)}"
            for one in found.bad_corners[-MOST_TOLD:]
        )
        more = len(found.bad_corners) - MOST_TOLD
        told += f"; and {more} more" if more > 0 else ""
        yield f"IN A CORNER of what the map allows it vibrates in trials. Keep away from {told}."
    if found.untried:
        told = ", ".join(
            f"{fmt.value('wob', wob)} and {fmt.value('rotary_speed', speed)}" for speed, wob in found.untried
        )
        yield f"CORNERS NOT TRIED: {told}, as others of what to stay within vibrated in trials. Keep away from them."
    if bad := disturbances(found):
        told = "; ".join(f"{one.name}: {outcome_words(one)}" for one in bad)
        yield f"DISTURBED IN TRIALS it vibrates afterwards. From the free setting, {told}."


def disturbances(found: Trials | None) -> list[Trial]:
    """Those after which the setting vibrates; a pick up and tag, and the wall, have lines of their own."""
    return [
        one
        for one in (found.trials if found is not None else ())
        if one.outcome.is_bad
        and found is not None
        and one is not found.bad_tag
        and (one.way == Way.EXCURSION or one.name in (HELD, OFF_ROCK))
    ]


def of_rock(found: Trials) -> Iterator[str]:
    """That the rock stays at a bit off bottom, where trials pick it up."""
    if not found.is_clear and any(one.name in (SPEED_FIRST, TAGGED) for one in found.trials):
        yield (
            "OFF BOTTOM THE BIT MAY STILL RUB in these trials: the weight is off, but the model does not say that the "
            "bit is clear of the rock then. Raising the speed off bottom may come out worse than on the rig."
        )


def warnings(found: Trials | None) -> Iterator[str]:
    """What trials say that the sentence does not."""
    if found is None:
        return
    ways = found.ways_in()
    known = [one for one in ways if one.outcome != Outcome.UNKNOWN]
    free = sum(one.outcome == Outcome.FREE for one in ways)
    if 0 < free < len(known) / 2:
        yield f"FEW WAYS IN ARE FREE: {free} of {len(known)} in trials. {ways_words(found).capitalize()}."
    yield from of_rock(found)
    if found.interrupted:
        ended = sum(one.outcome != Outcome.UNKNOWN for one in found.trials)
        changes = "" if found.wob is None else f" and {count(len(found.changes), 'change')}"
        yield f"TRIALS INTERRUPTED after {count(ended, 'trial')}{changes}: of the others nothing is known."
    elif failed := [one for one in found.trials if one.outcome == Outcome.UNKNOWN]:
        yield f"TRIALS FAILED: {len(failed)} of {len(found.trials)}, of which nothing is known."
