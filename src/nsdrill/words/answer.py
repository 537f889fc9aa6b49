"""The answer of an operating window in words: where to run, what bounds it and why, and what
one must know before relying on it.

The text of ``nsdrill window``, its picture and the report have the same words. The data
are those of :func:`nsdrill.analysis.window.find_window`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence

import numpy as np

from nsdrill.analysis.advice import Advice, First, Kind, Unsettled
from nsdrill.analysis.counts import beyond_words
from nsdrill.analysis.doubts import told_in_capitals
from nsdrill.analysis.grades import lasts_above
from nsdrill.analysis.probability import interval, samples_for
from nsdrill.analysis.trials import HELD, HELD_IN_CORNER, OFF_ROCK, Trials
from nsdrill.analysis.window import unknown_words
from nsdrill.data import (
    BENT,
    DAMPING,
    ENDS_EARLY,
    FEW,
    LUMPED_STRING,
    PULSES,
    SHORT,
    UNCUT,
    UNREAD,
    UNUSUAL_NUMBERS,
    Answer,
    edited_words,
)
from nsdrill.errors import count
from nsdrill.kernel.settings import Simulation
from nsdrill.models.begin import begin_below
from nsdrill.models.damped import HIGH, LOW, USUAL
from nsdrill.models.numbers import BENDS, DULL, FEW_PEAKS, FEW_STATES, LATE, LOOSE, LUMPED, PULSE, TOO_SHORT, few_peaks
from nsdrill.models.registry import described
from nsdrill.models.responses import RESPONSES, Response
from nsdrill.quantity import quantity
from nsdrill.variables import MODEL
from nsdrill.words import trial_words
from nsdrill.words.left_out import left_out_texts
from nsdrill.words.stick_slip_words import early_text, sticking_texts, stuck_through_text, unknown_end_text
from nsdrill.words.values import Formatter, in_order, of_severity, response_words
from nsdrill.words.wording import Words

FEW_SAMPLES = 0.1  # half of the interval of a probability, from which a warning says so


def words_of(summary: Answer, units: str) -> Words:
    """The words of the answer of a window, the ``summary``."""
    return Words(*needed_for_words(summary, units))


def needed_for_words(
    summary: Answer, units: str
) -> tuple[
    Advice,
    tuple[str, ...],
    str,
    tuple[str, ...],
    int | None,
    float | None,
    str,
    str | None,
    int,
    float,
    Answer | None,
    str,
    Answer | None,
]:
    """What :class:`Words` are made of, for a window, the ``summary``."""
    passed = summary["passed_over"]
    return (
        summary["answer"],
        tuple(summary["axes"]),
        units,
        tuple(summary["procedures"]),
        summary["answer"].severity,
        summary["confidence"],
        passed[0]["words"] if passed else "",
        summary["along"],
        summary["unknown"],
        summary["fixed"].get("rotary_speed", math.inf),
        summary["chain"],
        summary["model"],
        summary["within"],
    )


def answer(summary: Answer, units: str) -> str:
    """The answer in one sentence."""
    return words_of(summary, units).sentence()


def would_help(summary: Answer, units: str, sentence: str = "") -> list[str]:
    """What would allow a setting, where none is free of vibration: to measure the unknown on
    which that turns, to change the string, or to allow a mild vibration; without what the
    ``sentence`` says already."""
    milder, split, fmt = summary["milder"], summary["answer"].split, Formatter(units, summary["model"])
    told = []
    if split is not None:
        at = fmt.value(split.unknown, split.threshold)
        told.append(
            f"It turns on {quantity(split.unknown).words}: below {at} {100 * split.below:.0f} %, above "
            f"{100 * split.above:.0f} % ({split.samples[0]} and {split.samples[1]} samples): measure it."
        )
    tried, along = summary["answer"].trials, summary["axes"][0]
    helps = trial_words.best_words(tried, along, fmt)
    if helps and helps.lower() not in sentence.lower():
        told.append(f"{helps[0].upper()}{helps[1:]}.")
    if tests := trial_words.best_trials(tried, along, fmt):
        told.append(tests)
    if milder is None:
        return told
    level = milder["severity"]
    words = Words(
        milder["answer"],
        tuple(summary["axes"]),
        units,
        tuple(summary["procedures"]),
        level,
        carried=summary["along"],
        held_speed=summary["fixed"].get("rotary_speed", math.inf),
        chain=summary["chain"],
        model=summary["model"],
    )
    where = f"{words.setting()}{words.and_within()}"
    allowed = of_severity(level, summary["model"])
    if milder["answer"].kind == Kind.HINT:
        return [*told, f"With {allowed} vibration allowed (--severity {level}) there is a hint only: {where}."]
    return [*told, f"Where {allowed} vibration is allowed (--severity {level}), run at {where}."]


def is_hint(summary: Answer, best: Answer) -> bool:
    """Whether the best point of a map is a hint, not a setting: it has less than a
    tolerance of room, or the sweep begins above a critical speed."""
    return bool(best["hint"] or summary["passed_over"])


def chosen_map(summary: Answer) -> Answer | None:
    """The map that the answer is about; of none that with the most safe points."""
    maps = summary["maps"]
    cell = summary["answer"].cell
    best: Answer = maps[cell[0]] if cell is not None else max(maps, key=lambda one: one["safe"])
    return best


def obstacle_words(why: str, responses: Iterable[str], model: str = MODEL) -> str:
    """What prevents that a point is safe; see :func:`nsdrill.analysis.window.obstacle`."""
    words = {
        "edge": "edge of the map",
        "failed": "a run failed",
        "pending": "not run yet",
        "open": "nothing is known",
        "unknown": "no severity is known",
        "outside": "not drilled",
        "unmodelled": "a motion that the model leaves out",
    }
    if why == "outside":
        return ", ".join(filter(None, (words[why], response_words(responses, model))))
    otherwise = {"distrusted": "the checks disagree", "rim": "near a limit"}.get(why, "critical")
    return words.get(why) or response_words(responses, model) or otherwise


def limit(axis: str, side: Answer, fmt: Formatter) -> str:
    """What lies beyond one side of the window: ``at 65 rpm stick-slip``."""
    if side["why"] == "edge":
        return "the edge of the map, nothing is known beyond"
    return f"at {fmt.value(axis, side['first_not_safe'])} {obstacle_words(side['why'], side['responses'], fmt.model)}"


def of_both(a: Iterable[str], b: Iterable[str]) -> list[str]:
    """Texts on two files, each after the letter of its file; those on both once."""
    left, right = list(a), list(b)
    return [
        *(f"a and b: {text}" for text in left if text in right),
        *(f"a: {text}" for text in left if text not in right),
        *(f"b: {text}" for text in right if text not in left),
    ]


MOST_WARNINGS = 3  # beside an answer, unless all are asked for
DRILLED = "DRILLED WITHIN"
FAR = "NUMBERS FAR FROM USUAL"
ASIDE = (DRILLED, FAR)  # where one drills, which was asked for, and slips of units


def shown_first(told: Sequence[str]) -> int:
    """How many of the warnings stand beside an answer: those :data:`ASIDE` take the place of no
    other."""
    counted = 0
    for place, text in enumerate(told):
        if not text.startswith(ASIDE):
            if counted == MOST_WARNINGS:
                return place
            counted += 1
    return len(told)


def warnings(summary: Answer, units: str) -> Iterator[str]:
    """All that one must know before relying on the answer, a sentence or two each, what may
    make it wrong first."""
    fmt, plane = Formatter(units, summary["model"]), chosen_map(summary) or {}
    best = plane.get("recommended")
    point = {**plane.get("at", {}), **best} if best else None
    is_decided = _is_decided_by_damping(summary, point)
    damping = list(_of_damping(summary, point, fmt))
    yield from _of_file(summary, fmt)
    yield from told_in_capitals(summary)
    yield from _of_model(summary, units)
    yield from [] if is_decided else _of_frozen(summary)  # on purpose, and so after a number that decides
    yield from _of_what_was_asked(summary, fmt)
    yield from _of_setting(summary, point, fmt, [*damping, *_of_frozen(summary)] if is_decided else [])
    yield from left_out_texts(summary, fmt, units)
    yield from _of_missing_runs(summary, fmt)
    yield from _of_stick_slip(summary, units)
    yield from _of_map(summary, best, point, fmt, [] if is_decided else damping)
    yield from [] if summary["answer"].unsettled or _is_late(summary) else _of_observation(summary, units)
    yield from _of_edges(summary, best, fmt)
    yield from of_drag(summary)
    yield from of_lumped(summary, units)


def _of_file(summary: Answer, fmt: Formatter) -> Iterator[str]:
    """Whether the numbers are those of the runs, and the trials those of the file, before what they say."""
    tried = summary["answer"].trials
    if told := edited_words(summary):
        yield told
    if numbers := summary[UNUSUAL_NUMBERS]:
        yield f"{FAR}: {numbers}"
    yield from _of_severity(summary)
    yield from trial_words.other_code(tried)
    yield from trial_words.after_connection(tried)
    if bend := summary[BENT]:
        yield f"BENDS: {bend.removeprefix(BENDS).strip()}"
    if pulse := summary[PULSES]:
        yield f"PULSE: {pulse.removeprefix(PULSE).strip()}"
    if (spread := summary["spread"]) is not None:
        yield (
            f"THE STARTS ARE CLOSE TOGETHER: initial.spread is {spread:g}, and 1 draws from a bit at rest to one at "
            "twice the speed, and as far as the wall. They show one motion, disturbed a little, and not what another "
            "start does: no point is allowed. Draw wider ones."
        )
    if (turns := summary["turns"]) is not None:
        yield (
            f"THE DRIVE TURNS SLOWER THAN IT IS SET: at the setting at {fmt.value('rotary_speed', turns['drive'])} on "
            f"average, not {fmt.value('rotary_speed', turns['set'])}. All speeds here are those that are set."
        )


def _of_model(summary: Answer, units: str) -> Iterator[str]:
    """What runs of the model, as they were made, cannot show."""
    fmt = Formatter(units, summary["model"])
    yield from _of_mud(summary, fmt)
    yield from _of_short_runs(summary, units)
    yield from _of_tolerance(summary)
    yield from _of_peaks(summary)
    yield from _of_cutting(summary, units)
    yield from of_unmodelled(summary, fmt)


def _of_what_was_asked(summary: Answer, fmt: Formatter) -> Iterator[str]:
    """Thresholds that are moved, where one drills, and a study that this version does not read."""
    yield from _of_thresholds(summary["moved_thresholds"], described(summary["model"]).critical)
    if (within := summary["within"]) is not None:
        drilled = " and ".join(fmt.span(axis, [one["from"], one["to"]]) for axis, one in within["ranges"].items())
        yield (
            f"{DRILLED} {drilled} only: {count(within['run_up'], 'other point')} free of vibration "
            f"{'is' if within['run_up'] == 1 else 'are'} run-up, and not allowed."
        )
    if summary[UNREAD]:
        yield (
            "THE STUDY IN THE FILE IS NOT ONE OF THIS VERSION: critical speeds, motions that may last and to which "
            "speed stick-slip does are left out here, as they follow from it. Run the study again."
        )


def _is_held(tried: Trials | None) -> bool:
    """Whether trials held the bit at the setting, and in the corners of its limits where they tried these."""
    return tried is not None and tried.is_tried(HELD) and (not tried.corners or tried.is_tried(HELD_IN_CORNER))


def _is_across(summary: Answer) -> bool:
    """Whether some allowed point lies beyond a step that may jump across a vibration."""
    return summary["answer"].tried_kind is not None or summary["jumped_points"] > 0


def _is_stuck_through(summary: Answer) -> bool:
    """Whether the setting lies above speeds that were passed in stick-slip."""
    return bool(summary["stuck_through"] and summary["stuck_through"]["at_point"])


def _of_setting(summary: Answer, point: Answer | None, fmt: Formatter, decisive: Iterable[str]) -> Iterator[str]:
    """What concerns the setting itself, and no trial has shown; with what decides on it."""
    advice, tried = summary["answer"], summary["answer"].trials
    yield from trial_words.of_setting(tried, fmt)
    if advice.started and tried is None:
        did = words_of(summary, fmt.system).verbs_of(advice.started)
        yield (
            f"STARTED AT THE POINT IT {did.upper()}: there it is free only on the slow way from below. "
            "Trials show which ways in are free (--trials)."
        )
    if advice.is_unreached and tried is None:
        known = "IS KNOWN" if advice.way_in is None or advice.way_in.first == First.NONE else "WAS RUN"
        yield (
            f"NO WAY IN {known}: started at the setting it is free, but nothing that was run shows how it is reached. "
            "Trials show whether a fast way in ends free (--trials)."
        )
    is_jumped, is_across = advice.tried_kind is not None, _is_across(summary)
    yield from _of_jumps(summary, fmt) if is_across else ()
    yield from _of_gaps(summary, fmt) if is_jumped else ()
    yield from [] if _is_held(tried) else unknown_end_text(summary)
    is_told = advice.vibrates is not None or (tried is not None and tried.is_tried(OFF_ROCK))
    yield from [] if is_told else _of_bounces(summary, point, fmt)
    yield from decisive
    yield from _of_low_side(summary)
    yield from _of_gaps(summary, fmt) if is_across and not is_jumped else ()
    yield from stuck_through_text(summary, fmt) if _is_stuck_through(summary) else ()


def _of_bounces(summary: Answer, point: Answer | None, fmt: Formatter) -> Iterator[str]:
    """Bit-bounce that may last at the point, once it begins."""
    yield from _of_lasting_motions(summary, point, fmt, ("lobe_resonance",)) if point else ()


def _of_missing_runs(summary: Answer, fmt: Formatter) -> Iterator[str]:
    """Points at which the bit stalls, and runs that are missing, that failed or that are not known."""
    if stalls := summary["obstacles"].get("stalled"):
        yield (
            f"THE BIT STALLS at {count(stalls, 'point')}: the drive cannot turn it there, or the rock holds it"
            f"{', or it sticks for longer than was observed' if summary[SHORT] else ''}. These points are not safe."
        )
    if summary["pending_runs"]:
        yield (
            f"NOT ALL HAS RUN: {summary['pending_runs']} of {summary['runs']} runs are missing, "
            "and their points are unknown."
        )
    yield from _of_part(summary["chain"], fmt)
    yield from trial_words.warnings(summary["answer"].trials)
    yield from _of_unknown_runs(summary)


def _of_stick_slip(summary: Answer, units: str) -> Iterator[str]:
    """Where stick-slip may last, and where it ends too early."""
    fmt = Formatter(units, summary["model"])
    yield from sticking_texts(summary, fmt)
    yield from () if _is_stuck_through(summary) else stuck_through_text(summary, fmt)
    if _is_held(summary["answer"].trials):
        told = unknown_end_text(summary)
        yield from (f"{text} Trials started the setting and the corners of its limits so." for text in told)
    ends = summary[ENDS_EARLY]
    if summary["stick_slip"]["settings"]:  # which says so of what a step ended
        ends = [one for one in ends if one["contact"] or one["surface_amplitude"]["value"] > 0.0]
    if ends:
        yield early_text(ends, units)


def _of_map(
    summary: Answer, best: Answer | None, point: Answer | None, fmt: Formatter, damping: Iterable[str]
) -> Iterator[str]:
    """What holds of all points of the map; with what is said of ``damping``."""
    tried = summary["answer"].trials
    if summary["safe"] or summary["most_probable"]:
        yield from _of_critical_speeds(summary, fmt)
        yield from () if _is_across(summary) else (*_of_jumps(summary, fmt), *_of_gaps(summary, fmt))
    yield from damping
    if summary["one_damping"]:
        yield (
            "DEPTH DOES NOT CHANGE THE ONSET of stick-slip here: drillstring.torsional_damping is one number for all "
            "depths. In a well a longer string sticks up to higher speeds: deep settings may look safer than they are."
        )
    if point:
        yield from _of_lasting_motions(summary, point, fmt, ("wall_speed",))
    yield from _of_bounces(summary, point, fmt) if tried is not None and tried.is_tried(OFF_ROCK) else []
    yield from _of_samples(summary, best or summary["most_probable"] or {})
    yield from [] if summary["answer"].unsettled else _of_motions(summary)
    if distrusted := summary["distrusted_points"]:
        is_one = distrusted == 1
        yield (
            f"CHECKS DISAGREE at {count(distrusted, 'point')}, which {'is' if is_one else 'are'} not to be trusted and "
            f"{'counts' if is_one else 'count'} as not safe."
        )
    if inferred := summary["unknown"] - summary["unknown_failed"] - summary["unknown_unmodelled"]:
        yield (f"NOT KNOWN at {count(inferred, 'point')} ({unknown_words(dict(summary))}); no window goes there.")
    if not summary["history_examined"]:
        yield (
            f"HISTORY WAS NOT EXAMINED: the file holds one procedure only ({summary['procedures'][0]}). Run the study "
            "with procedure: up-down to learn whether a vibration, once started, ends."
        )
    yield from _of_one_value(summary, fmt)


def _of_one_value(summary: Answer, fmt: Formatter) -> Iterator[str]:
    """That a setting has one value in all of the file, whatever else is swept: words, as kinds of drives, are no
    settings, and no more are the depth and numbers of the string."""
    if len(summary["axes"]) == 1:
        held = fmt.setting(summary["fixed"], summary["fixed"])
        yield (
            f"ONE AXIS ONLY: the {quantity(summary['axes'][0]).words} was swept"
            f"{f', at {held}' if held else ''}. Of other settings nothing is known."
        )
        return
    for axis, words in (("wob", "weight"), ("rotary_speed", "speed")):
        if axis in summary["fixed"]:
            at = fmt.value(axis, summary["fixed"][axis])
            yield f"ONE {words.upper()} ONLY: all runs are at {at}. Of other {words}s nothing is known."


def of_lumped(summary: Answer, units: str) -> Iterator[str]:
    """That the lumped string is far from its first standing wave of torsion."""
    yield from (f"LUMPED: {text.removeprefix(LUMPED).strip()}" for text in summary[LUMPED_STRING].get(units, ()))


def of_drag(summary: Answer) -> Iterator[str]:
    """That the string of an inclined hole rubs nowhere along it, or its collar alone does."""
    if summary["drag_left_out"]:
        weights = "weights hold at the bit, where less comes than is slacked off, and " * bool(summary["answer"].point)
        what = "NO DRAG OF THE STRING ABOVE THE COLLAR" if summary["rubs_at_collar"] else "NO DRAG ALONG THE HOLE"
        yield (
            f"{what} is in the model, though the hole is inclined: {weights}the torque at the surface "
            "is more by what rubs there."
        )


def _of_low_side(summary: Answer) -> Iterator[str]:
    """That the weight of the collar holds it on the wall."""
    told = summary["wall_off_bottom"]
    if told is not None and told["low_side"] is None and summary["wall_estimated"]:
        yield (
            "THE SPEEDS OF THE WALL ARE AN ESTIMATE: in an inclined hole the collar sags, and its stabilisers have "
            "clearance or the mud rotates. At which speeds off bottom it reaches the wall is then known roughly."
        )
    if told is not None and told["low_side"] is not None:
        part = ", in a part of the study" if told["low_side"] == "part" else ""
        yield (
            f"THE COLLAR LIES ON THE LOW SIDE of the hole at every speed{part}: it is on the wall without whirl, which "
            "is not critical. What rolls along the wall or strikes it is."
        )


def _of_severity(summary: Answer) -> Iterator[str]:
    """That the answer allows less than was asked for, as a setting with less there is."""
    asked, level, model = summary["severity"], summary["answer"].severity, summary["model"]
    if summary["answer"].vibrates is not None and summary["answer"].point:
        words = words_of(summary, "si")
        yield (
            f"THE SETTING VIBRATES: {words.vibrating()}. It is allowed by severity alone (--severity {level}), and "
            f"{words.not_yet}."
        )
    elif asked and level == asked and summary["answer"].point:
        yield (
            f"THE SETTING MAY VIBRATE: {of_severity(asked, model)} vibration is allowed (--severity {asked}), at the "
            "setting and within its limits too. Free of vibration is what is allowed without that."
        )
    if asked is not None and level != asked and summary["answer"].point:
        own = f"{of_severity(level, model)} vibration at most" if level else "free of vibration"
        yield (
            f"STRICTER THAN ASKED: the setting and its limits are {own}. Maps and counts by what was asked allow "
            f"{of_severity(asked, model)} vibration."
        )


MISSED = {"lateral": "whirl", "axial": "bit-bounce", "torsional": "stick-slip"}  # what a frozen motion cannot show


def _of_cutting(summary: Answer, units: str) -> Iterator[str]:
    """What an answer of a bit that cuts what its last blade left is worth."""
    if found := summary["beyond"]:
        yield f"BEYOND THE MODEL: {beyond_words(found, summary['runs'])}."
    yield from (f"NOTHING IS CUT: {text.removeprefix(DULL).strip()}" for text in summary[UNCUT].get(units, ()))
    yield from (f"COARSE ROCK SURFACE: {text.removeprefix(FEW_STATES).strip()}" for text in summary[FEW].get(units, ()))


def _of_mud(summary: Answer, fmt: Formatter) -> Iterator[str]:
    """That mud which rotates drives whirl at speeds of the map, which runs need not show."""
    if found := summary["driven_by_mud"]:
        yield (
            f"ROTATING MUD DRIVES WHIRL above {fmt.range(found['axis'], [found['from'], found['to']])}, in "
            f"{found['runs']} of {count(found['of'], 'run')}: there a collar off the axis goes to the wall by "
            "itself, the more slowly the less it is off. Runs need not show it, and count as not settled."
        )


def _of_tolerance(summary: Answer) -> Iterator[str]:
    """That errors of the steps may decide on responses."""
    rtol = summary["rtol"]
    if isinstance(rtol, int | float) and rtol > LOOSE:
        yield (
            f"COMPUTED TOO ROUGHLY: simulation.rtol is {rtol:g}, and above {LOOSE:g} errors of the steps decide "
            f"responses. Run again with {Simulation.rtol:g}, the default."
        )


def _of_peaks(summary: Answer) -> Iterator[str]:
    """That slow growth is not seen."""
    kept = summary["peaks_kept"]
    if kept is not None and (text := few_peaks(kept)):
        yield f"SLOW GROWTH MAY BE MISSED: {text.removeprefix(FEW_PEAKS).strip()}"


def _of_frozen(summary: Answer) -> Iterator[str]:
    """What frozen motions cannot show."""
    if frozen := summary["frozen"]:
        missed = " and ".join(MISSED[name] for name in frozen if name in MISSED)
        yield f"FROZEN MOTION: the study has no {' and no '.join(frozen)} motion, so that {missed} cannot be seen."


def of_unmodelled(summary: Answer, fmt: Formatter) -> Iterator[str]:
    """The vibrations of a string that its model cannot show, or shows at speeds that it does not
    tell."""
    if names := summary["not_in_model"]:
        missing = " and no ".join(RESPONSES[name].words for name in names)
        yield f"NOT IN THE MODEL: {summary['model']} has no {missing}, so none was looked for."
    if (step := summary["bounce_untold"]) is not None:
        yield (
            f"AT WHICH SPEEDS THE BIT BOUNCES is not known of {summary['model']}: steps of up to "
            f"{fmt.value('rotary_speed', step)} may jump across some. Between two free speeds it may bounce: "
            "make the steps smaller."
        )


def headlines(summary: Answer, units: str) -> list[str]:
    """The words in capitals of all warnings, each once."""
    found = (re.match(r".*\b[A-Z][A-Z-]+\b", text.partition(". ")[0]) for text in warnings(summary, units))
    return list(dict.fromkeys(one[0] for one in found if one))


def _of_short_runs(summary: Answer, units: str) -> Iterator[str]:
    """Of an answer that rests on runs that were short or had not settled all that is known
    of that: it makes everything else that is said of the setting uncertain."""
    found, late = summary["answer"].unsettled, _is_late(summary)
    if late:
        yield from _of_observation(summary, units)
    if found is not None:
        yield from _of_motions(summary, found)
        yield from [] if late else _of_observation(summary, units)


def _is_late(summary: Answer) -> bool:
    """Whether control of the drive begins after the observation has."""
    return any(LATE in text for text in summary[SHORT].get("si", ()))


def _of_observation(summary: Answer, units: str) -> Iterator[str]:
    """That the runs are short beside the slowest motion, as one warning."""
    found, told = summary["answer"].unsettled, summary[SHORT].get(units, ())
    means = " A vibration that grows slowly is not seen in that." if found is not None and not found.points else ""
    if told:
        first, *others = (text.removeprefix(TOO_SHORT).strip() for text in told)
        also = "".join(f" And {text}" for text in others)
        yield f"OBSERVED TOO SHORTLY: {first}{also}{means}"


def _of_thresholds(moved: Iterable[Answer], responses: Mapping[str, Response]) -> Iterator[str]:
    """Thresholds that are not the defaults, those from which a response counts first."""
    starts, defaults, others = [], [], []
    for one in moved:
        if one["response"] is None:
            others.append(f"{one['key']} = {one['value']:g} (by default {one['default']:g})")
            continue
        response = responses[one["response"]]
        value, default = (response.percent(one[name]) for name in ("value", "default"))
        when = "ONLY" if value > default else "ALREADY"
        starts.append(f"{response.words.upper()} COUNTS {response.above.format(value).upper()} {when}")
        defaults.append(f"{response.words} {response.limit.format(default)}")
    also = f" Moved as well: {'; '.join(others)}." if others else ""
    if starts:
        yield f"{' and '.join(starts)}: by default {', '.join(defaults)}.{also}"
    elif others:
        yield f"OTHER THRESHOLDS than the defaults: {'; '.join(others)}."


def _of_part(chain: Answer | None, fmt: Formatter) -> Iterator[str]:
    """A part of the chains along which the state was carried."""
    if chain is not None and chain["part"]:
        held, whole = chain["held"], chain["whole"]
        yield (
            f"A PART OF A SWEEP: {held['points']} of the {whole['points']} values of the {fmt.name(held['axis'])}, "
            f"along which the state was carried from {fmt.range(whole['axis'], [whole['from'], whole['to']])}. What "
            "was met at the others is not known here: ask the whole file."
        )


AGAIN = "nsdrill run --retry-failed STUDY -o FILE runs them again."


def _of_unknown_runs(summary: Answer) -> Iterator[str]:
    """Runs that failed, those that came after one in a chain, and those whose checks
    failed."""
    if failed := summary["failed"]:
        points = count(summary["points_with_failed"], "point")
        meaning = f". No window goes there. {AGAIN}"
        if summary["confidence"] is not None:
            meaning = (
                ", unknown: they count neither as safe nor as unsafe in shares; a setting needs its confidence "
                f"without them. {AGAIN}"
            )
        yield f"FAILED: {failed} of {summary['of']} runs failed, at {points}{meaning}"
    if after := summary["after_failure"]:
        yield (
            f"NOT CARRIED to {count(after, 'run')}: a run before them in their chain failed, so they began at the "
            "start of the study and their history is not known. Run them again (--retry-failed, with a larger "
            "simulation.max_steps)."
        )
    if others := summary["undecided_runs"]:
        over, left = (summary[one].get("runs", 0) for one in ("off_speed", "unstable_motion"))
        causes = [
            *(["the drive is off its speed"] if over else []),
            *(["the motion is unstable"] if left else []),
            *(["a check of the answer failed"] if others > over + left else []),
        ]
        yield f"NOT KNOWN in {count(others, 'run')} that ended well, as {' or '.join(causes)}."


def _of_critical_speeds(summary: Answer, fmt: Formatter) -> Iterator[str]:
    """Critical speeds that the sweep passes over, or may jump across."""
    over = summary["passed_over"]
    # where each speed is swept by itself, the setting may lie below, and other points above
    others = [one for one in summary["lasting_motions"] if one.get("each") and one["from"] is not None]
    over = [*over, *(one for one in others if one["name"] not in {each["name"] for each in over})]
    least = fmt.value("rotary_speed", begin_below(over)) if over else ""
    for speed in over:
        axis, begins = speed["axis"], "THE SWEEP BEGINS at"
        if speed["each"]:
            begins = "EACH SPEED IS SWEPT BY ITSELF, up to"
        yield (
            f"{begins} {fmt.value(axis, speed['from'])}, above {speed['words']}, "
            f"{fmt.range(axis, [speed['min'], speed['max']])}"
            f"{'' if speed['everywhere'] else ' (in a part of the study)'}. A string that is brought up to speed "
            f"passes through that: a point {'above it ' if speed['each'] else ''}that is safe here need not be safe "
            f"then.{'' if speed['each'] else f' Begin the sweep below {least}.'}"
        )


def _of_jumps(summary: Answer, fmt: Formatter) -> Iterator[str]:
    """Critical speeds across which the steps of the sweep may jump."""
    found: Advice = summary["answer"]
    told = ""
    if found.tried_kind is not None and found.trials is None:
        told = " Trials go through all of these speeds (--trials)."
    elif found.jump is not None and found.trials is not None and not found.trials.withdraws:
        told = " Trials went through them at the weight of the setting only."
    for speed in summary["lasting_motions"]:
        if jumped := speed["jumped"]:
            axis = speed["axis"]
            yield (
                f"STEPS OF {fmt.value(axis, jumped['step'])} MAY JUMP across {speed['words']}, anywhere from "
                f"{fmt.range(axis, [jumped['from'], jumped['to']])}: a point that is safe here need not be safe with "
                f"finer steps. There steps of {fmt.step_down(axis, jumped['enough'])} are fine enough."
                f"{told}"
            )


def _of_gaps(summary: Answer, fmt: Formatter) -> Iterator[str]:
    """Gaps of the axes, in which nothing was run."""
    for gap in summary["gaps"]:
        ends = fmt.named(gap["axis"], fmt.range(gap["axis"], [gap["from"], gap["to"]]))
        yield (
            f"A GAP OF THE SWEEP at {ends}: nothing was run in it, and the other steps are smaller. Between free "
            f"points it may vibrate: give the {fmt.name(gap['axis'])} values there."
        )


def _lasts(summary: Answer, point: Answer | None) -> Answer | None:
    """Up to which speed stick-slip lasts by torsion alone with the damping of the study and
    with a usual one, at the weight nearest to that of the ``point``."""
    found = summary[DAMPING]
    if not found or not found["lasts"]:
        return None
    lasts: list[Answer] = found["lasts"]
    wob = {**summary["fixed"], **(point or {})}.get("wob", lasts[len(lasts) // 2]["wob"])
    nearest = min(lasts, key=lambda one: (round(abs(one["wob"] - wob)), -one["wob"]))
    return {**nearest, **{end: math.inf if nearest[end] is None else nearest[end] for end in ("now", "usual")}}


def _is_decided_by_damping(summary: Answer, point: Answer | None) -> bool:
    """Whether with a usual damping stick-slip, once started, lasts at the setting or at a speed
    at which one may stay, and with that of the study it does not."""
    lasts = _lasts(summary, point)
    if lasts is None or point is None:
        return False
    one = summary["answer"].stay_within.get("rotary_speed")
    speed = {**summary["fixed"], **point}.get("rotary_speed", math.inf)
    return bool(lasts["now"] < lasts["usual"] > (speed if one is None else min(speed, one.low)))


def _of_damping(summary: Answer, point: Answer | None, fmt: Formatter) -> Iterator[str]:
    """Damping of torsion that is unusual of a string, where it decides up to which speed
    stick-slip lasts."""
    found, lasts = summary[DAMPING], _lasts(summary, point)
    if lasts is None or lasts["now"] == lasts["usual"]:
        return
    now, then = (
        "every speed"
        if math.isinf(lasts[end])
        else fmt.value("rotary_speed", fmt.outwards("rotary_speed", 0.0, lasts[end])[1])
        for end in ("now", "usual")
    )
    whose = "THE DEFAULT DAMPING" if found["is_default"] else "THE DAMPING"
    where = ", ".join(
        fmt.value(axis, lasts[axis] if axis == "wob" else lasts["at"][axis]) for axis in ("wob", *lasts["at"])
    )
    samples = " in the sample where it lasts longest" if "sample" in found else ""
    yield (
        f"{whose} OF TORSION IS UNUSUAL: its ratio is {found['ratio']:.2g}, and strings have {LOW:g} to {HIGH:g}. "
        f"With {USUAL:g}, {quantity(found['key']).text(found['usual'], fmt.system, 3)} ({found['key']}), stick-slip by "
        f"torsion alone lasts up to {then} at {where}, with that of the study up to {now}{samples}. "
        "Run the study with it."
    )


def _of_motions(summary: Answer, rests: Unsettled | None = None) -> Iterator[str]:
    """Motions that had not settled, over the safe points; over all where none is safe. What
    that means of an answer that ``rests`` on them comes first."""
    plane = chosen_map(summary)
    best = plane and plane["recommended"]
    which, of, points = "", "point", summary["points"]
    unsettled = summary["unsettled_in_all"]
    if summary["safe"]:
        unsettled, of, points = summary["unsettled_points"], "allowed point", summary["safe"]
        which = "" if not best or best["settled"] or points == 1 else ", the best one among them,"
    if unsettled:
        means = ""
        if rests is not None and rests.points:
            beside = f", and {rests.beside} of those beside it" if rests.beside else ""
            means = (
                f" Within the limits they are {rests.points} of {count(rests.of, 'point')}{beside}: a vibration "
                "that grows slowly is not seen there."
            )
        yield (
            f"NOT SETTLED: at {unsettled} of {count(points, of)}{which} a motion was still "
            f"changing when it was observed.{means} Run with a longer transient (simulation.transient)."
        )


def _of_edges(summary: Answer, best: Answer | None, fmt: Formatter) -> Iterator[str]:
    """The edges of the map at which the allowed points around the ``best`` end."""
    if not best:
        ends = " and ".join(
            fmt.named(axis, fmt.range(axis, summary["ranges"][axis])) for axis in in_order(summary["axes"])
        )
        yield f"THE MAP ENDS: only {ends} was examined, and nothing is known beyond."
        return
    edges = [
        fmt.named(axis, fmt.value(axis, side["safe_to"]))
        for axis in in_order(summary["axes"])
        for side in best["margins"][axis].values()
        if side["why"] == "edge"
    ]
    if edges:
        yield f"THE MAP ENDS at {' and '.join(edges)}: nothing is known beyond."


def _of_lasting_motions(summary: Answer, point: Answer, fmt: Formatter, names: Iterable[str]) -> Iterator[str]:
    """The motions of these ``names`` that may last at a point, once they begin, and whose
    critical speeds the sweep does not pass over."""
    at = {**summary["fixed"], **point}
    speed = at.get("rotary_speed", -math.inf)
    for one in summary["lasting_motions"]:
        lasts = lasts_above(one, at.get("wob"))
        if one["name"] in names and one["from"] is None and lasts and lasts[0] < speed:
            unsafe = summary["answer"].is_no_order  # beside which nothing may be called safe
            which = "what runs show there holds only while" if unsafe else "the best point is safe only while"
            yield (
                f"{one['told']} {fmt.above(one['axis'], lasts)}: {which} {one['safe_while']}. "
                "Many starts of every point (--set sweep.procedure=same --set initial.ensemble=64) show how likely "
                "that is."
            )


def _of_samples(summary: Answer, point: Answer) -> Iterator[str]:
    """Too few samples for the confidence, or for the probability of this ``point``."""
    told = list(_too_few_samples(summary))
    yield from told
    if "probability" in point and not told:
        half, level = (point["probability_high"] - point["probability_low"]) / 2, summary["confidence"]
        is_shown = not point["probability_low"] < level <= point["probability"]
        if half > FEW_SAMPLES or not is_shown:
            yield (
                f"FEW SAMPLES: {summary['counted']} give the probability to about {100 * half:.0f} %"
                f"{'' if is_shown else f', and do not show that it reaches {100 * level:g} %'}; four times as many "
                "halve that."
            )


def _too_few_samples(summary: Answer) -> Iterator[str]:
    """So few samples that the interval of a point at which all are safe reaches below the
    confidence."""
    confidence, count = summary["confidence"], summary["effective"]
    if confidence is None or count >= (needed := samples_for(confidence)):
        return
    low = float(interval(np.asarray(count), count)[0])
    text = f"{summary['counted']}"
    if count < summary["counted"]:
        text += f" samples, which count as {count:.3g},"
    yield (
        f"TOO FEW SAMPLES to show a confidence of {100 * confidence:g} %: where all of {text} are safe, the "
        f"probability may be as low as {100 * low:.1f} %. {needed} samples are needed, better more (uncertain.samples)."
    )


def before_trials(summary: Answer) -> list[str]:
    """That no trial was run of the setting, for what runs none; nothing where trials cannot be."""
    found: Advice = summary["answer"]
    can_be = described(summary["model"]).drills and "rotary_speed" in (*summary["axes"], summary["third"])
    if found.cell is None or found.trials is not None or found.kind == Kind.NOTHING or not can_be:
        return []
    return ["BEFORE TRIALS: no way in, connection or disturbance of the setting was run."]


def notes(summary: Answer, units: str) -> list[str]:
    """The warnings without their advice, for a picture."""
    return [f"{text.partition('. ')[0].rstrip('.')}." for text in warnings(summary, units)]


def first_notes(summary: Answer, units: str) -> list[str]:
    """Those of :func:`notes` that stand beside an answer."""
    told = notes(summary, units)
    return told[: shown_first(told)]
