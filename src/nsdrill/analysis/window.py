"""The operating window: the answer of a sweep, and the numbers behind it: the points that
are allowed, their grades, the stretches in which one may stay, and what bounds them.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from nsdrill.analysis.advice import (
    Advice,
    Kind,
    advise,
    best_of,
    is_dry,
    only_unstable,
    passed_over,
    speed_of,
    sticks_to,
)
from nsdrill.analysis.chains import Chain, chain_of
from nsdrill.analysis.counts import TOP_SPEED, after_failure, beyond, known
from nsdrill.analysis.doubts import doubts_in
from nsdrill.analysis.graded import Graded, drilled_runs, graded
from nsdrill.analysis.grades import BOUNCE, driven_by_mud, spread_of
from nsdrill.analysis.histories import Grade, Label, is_allowed
from nsdrill.analysis.hysteresis import response_text
from nsdrill.analysis.limits import past_jumps
from nsdrill.analysis.maps import SAFE, STATES, UNKNOWN, YIELDS, Classes, classes, regions
from nsdrill.analysis.off_bottom import wall_off_bottom
from nsdrill.analysis.planes import Cell, check_judged, planes_of, stretches
from nsdrill.analysis.probability import check_samples, effective_number, independent
from nsdrill.analysis.room import Kind as Room
from nsdrill.analysis.safety import counts_of, needed, run_safety, told_responses, unseen_responses
from nsdrill.analysis.sticking import ends_by_smoothed_alone, from_rest
from nsdrill.analysis.unsettled import unsettled_of
from nsdrill.analysis.untried import data_of_jump, first_on_the_way, gaps_of, jumps_of, stretches_run, stuck_past
from nsdrill.analysis.vibrating import vibration_at
from nsdrill.data import (
    BENT,
    DAMPING,
    DAMPING_RATIOS,
    DECIDING,
    EDITED_SOURCE,
    ENDS_EARLY,
    FEW,
    LASTING_MOTIONS,
    LASTING_UNTOLD,
    LEFT_OUT,
    LUMPED_STRING,
    PULSES,
    SHORT,
    UNCUT,
    UNREAD,
    UNUSUAL_NUMBERS,
    WITHIN,
    Answer,
    Array,
    Results,
    drive_kind,
    estimates_wall,
    frozen_modes,
    leaves_out_drag,
    overrides,
    resolved_study,
    rubs_at_collar,
)
from nsdrill.errors import option
from nsdrill.models.choices import in_words, words_along
from nsdrill.models.in_force import moved_thresholds
from nsdrill.models.numbers import OFF_SPEED
from nsdrill.models.registry import model_in, responses_in
from nsdrill.models.responses import STICK_SLIP, VIBRATIONS, severity_levels
from nsdrill.variables import INFERRED, PENDING, SAMPLE, has_failed

USUAL_CONFIDENCE = 0.9
LEAST = 3  # of the safety of a map: the share of samples that are known to be safe
MILD = 2  # the greatest severity that is named where nothing is free of vibration
NO_POINT = (Kind.NOTHING, Kind.UNKNOWN)  # the answers that name no allowed point
LEVELS = (0.5, 0.8, 0.9, 0.95, 0.99)  # of confidence whose costs are listed


def find_window(results: Results, severity: int | None = None, confidence: float | None = None) -> Answer:
    """The operating window of a sweep with ascending axes, as plain data in SI units; its
    keys are described on the page on the window. For results with samples the window
    has a ``confidence``, by default 0.9; InputError for a ``confidence`` without
    samples."""
    check_judged(results, "window")
    confidence = usual_confidence(results, confidence)
    maps = classes(results, severity, confidence)
    found, at = _answer(results, severity, confidence, maps), maps.values(maps.third)
    found = replace(found, unsettled=unsettled_of(maps, found))
    told: Answer = {
        "kind": "window",
        "title": str(results.attrs.get("title") or ""),
        "model": model_in(results.attrs).name,
        "overrides": overrides(results.attrs, thresholds=True),
        "moved_thresholds": moved_thresholds(results.attrs),
        **_runs(maps, severity, found),
        **_counts(maps.state, _inside(maps)),
        **_outcomes(maps),
        "confidence": confidence,
        "within": _within(maps),
        "answer": found,
        "severities": _levels(results) if severity is None else None,
        "milder": _milder(results, severity, confidence, found),
        "grades": _grades(maps),
        **_samples(results),
        "most_probable": _most_probable(maps),
        "price": _confidence_costs(maps),
        "maps": [
            {"at": {maps.third: float(at[number])} if maps.third else {}, **_map(maps, number, found)}
            for number in range(len(maps.state))
        ],
        "depth": _over_depth(maps),
        "stick_slip": _stick_slip(maps),
        "stuck_through": _stuck_through(maps, found.cell),
        "jumped_points": int(np.count_nonzero(past_jumps(maps.grades))),
        "wall_off_bottom": wall_off_bottom(results.attrs),
    }
    # to look for words takes the descriptions of all models
    return dict(in_words(told)) if any(map(words_along, results.swept)) else told


def _runs(maps: Classes, severity: int | None, found: Advice) -> Answer:
    """What was run, and how."""
    results, axes = maps.results, [axis for axis in (maps.x, maps.y) if axis]
    status, counts = results["status"], counts_of(results, severity)
    after = int(np.count_nonzero(after_failure(results) & known(status)))
    # an inferred point has no severity, and is told of by its class
    all_inferred = int(np.count_nonzero(status == INFERRED))
    inferred = all_inferred if severity is not None else 0
    others = counts["of"] - counts["known"] - counts["failed"] - counts["pending"]
    lasting = json.loads(results.attrs.get(LASTING_MOTIONS, "[]"))
    simulation = resolved_study(results.attrs).get("simulation")
    return {
        "procedures": list(results.procedures),
        "along": maps.grades.along,
        "chain": None if (chain := chain_of(results)) is None else chain.as_data(),
        "histories": maps.histories,
        "history_examined": maps.histories > 1,
        "starts": len(results.coords["start"]) if "start" in results.coords else None,
        "severity": severity,
        "axes": axes,
        "third": maps.third,
        "fixed": results.held,
        "runs": int(results["status"].size),
        "after_failure": after,
        "beyond": beyond(results),
        "bounce_untold": _bounce_untold(results),
        "turns": _slower(maps, found),
        "spread": spread_of(results),
        **doubts_in(results),
        "undecided_runs": max(others - after - inferred, 0),
        **counts,
        "failed_points": int(np.count_nonzero(maps.failed)),
        "points_with_failed": int(np.count_nonzero(maps.counts.failed)),
        "distrusted_points": int(np.count_nonzero(maps.distrusted)),
        "inferred_runs": all_inferred,
        "pending_runs": int(np.count_nonzero(results["status"] == PENDING)),
        "unsettled_points": int(np.count_nonzero(maps.unsettled & (maps.state == SAFE))),
        "unsettled_in_all": int(np.count_nonzero(maps.unsettled & _inside(maps))),
        "ranges": {axis: [float(maps.values(axis)[end]) for end in (0, -1)] for axis in axes},
        "passed_over": passed_over(maps.grades, found.cell),
        "drag_left_out": model_in(results.attrs).drills and leaves_out_drag(results.attrs),
        "rubs_at_collar": rubs_at_collar(results.attrs),
        "wall_estimated": estimates_wall(results.attrs),
        "gaps": [data_of_jump(one) for one in gaps_of(results)],
        "lasting_motions": lasting,
        "driven_by_mud": _driven_by_mud(results),
        "one_damping": "depth" in results.swept and _has_one_damping(results),
        "frozen": list(frozen_modes(results.attrs)),
        "not_in_model": _not_in_model(results),
        "rtol": simulation.get("rtol") if isinstance(simulation, dict) else None,
        "peaks_kept": results.peaks_kept,
        **{name: json.loads(results.attrs.get(name, "{}")) for name in (SHORT, UNCUT, FEW, LUMPED_STRING, LEFT_OUT)},
        UNUSUAL_NUMBERS: str(results.attrs.get(UNUSUAL_NUMBERS, "")),
        BENT: str(results.attrs.get(BENT, "")),
        PULSES: str(results.attrs.get(PULSES, "")),
        DAMPING: json.loads(results.attrs.get(DAMPING, "null")),
        DAMPING_RATIOS: json.loads(results.attrs.get(DAMPING_RATIOS, "[]")),
        DECIDING: json.loads(results.attrs.get(DECIDING, "{}")),
        UNREAD: str(results.attrs.get(UNREAD, "")),
        EDITED_SOURCE: str(results.attrs.get(EDITED_SOURCE, "")),
        ENDS_EARLY: json.loads(results.attrs.get(ENDS_EARLY, "[]")),
    }


def _driven_by_mud(results: Results) -> Answer | None:
    """How many ``runs``, ``of`` those where one drills, turn faster than the speed above which
    rotating mud drives whirl by itself, and of these runs that speed, ``from`` the least ``to`` the
    greatest [rad/s]; None where no run does."""
    driven, above = driven_by_mud(results)
    drilled = drilled_runs(results)
    driven &= drilled
    if not driven.any():
        return None
    ends = {"from": float(above[driven].min()), "to": float(above[driven].max())}
    counts = {"runs": int(np.count_nonzero(driven)), "of": int(np.count_nonzero(drilled))}
    return {"axis": "rotary_speed", **ends, **counts}


def _not_in_model(results: Results) -> list[str]:
    """The vibrations of a string that its model cannot show; none of what is no string."""
    model = model_in(results.attrs)
    return [name for name in VIBRATIONS if name not in model.critical] if model.drills else []


def _within(maps: Classes) -> Answer | None:
    """Where one drills, and how many other points are free but run-up only; None where that is
    not given."""
    if (outside := maps.grades.outside) is None:
        return None
    ranges = json.loads(maps.results.attrs[WITHIN])
    ends = {axis: {"axis": axis, "from": low, "to": high} for axis, (low, high) in ranges.items()}
    return {"ranges": ends, "run_up": int(np.count_nonzero(outside & is_allowed(maps.grades.grade)))}


def _has_one_damping(results: Results) -> bool:
    """Whether torsion has the same damping at every depth, and nothing else damps it."""
    string = resolved_study(results.attrs).get("drillstring")
    is_lumped = isinstance(string, dict) and "torsional_damping" in string
    return is_lumped and drive_kind(results.attrs) == "ideal" and "torsional" not in frozen_modes(results.attrs)


def _stick_slip(maps: Classes) -> Answer:
    """Where a point is free on the way up, but stick-slip that was met below lasts once it is
    there: at how many ``points``; whether the model tells to which speed it lasts, or the
    runs alone (``modelled``), or at some allowed point neither (``untried``), or somewhere by smoothed friction
    alone (``by_smoothed``); and the
    ``settings`` with such points: from which to which value of the first axis the last of them
    lie side by side, the greatest ``step`` of the axis up to there, to which speed it lasts, and to which the
    smoothed friction of the runs can have shown it, at none of them where ``is_dry``; or where it
    begins by itself (``unstable``), and at how many of these points runs have ``shown`` a vibration."""
    grades, values, found = maps.grades, maps.values(maps.x), []
    chain = chain_of(maps.results)
    is_known = grades.modelled is not None and bool(grades.modelled.all())
    up = maps.grades.ways.index("up") if "up" in maps.grades.ways and grades.share is None else None
    untried = up is not None and "stick_slip" in model_in(grades.results.attrs).critical
    untried = untried and grades.tried is not None and bool(np.any(~grades.tried.all(axis=-1) & grades.allowed))
    is_met = up is not None and bool(np.any(maps.bits_in[up] & STICK_SLIP))
    for number, row in np.ndindex(*grades.grade.shape[:2]):
        ends = stretches(grades.grade[number, row] == Grade.STICKS_ON)
        if not ends:
            continue
        first, last = ends[-1]
        at = np.arange(first, last + 1)
        to = sticks_to(grades, (number, row, last))
        others = ((maps.third, number), (maps.y, row))
        found.append(
            {
                "at": {axis: float(maps.values(axis)[place]) for axis, place in others if axis},
                "axis": maps.x,
                "from": float(values[first]),
                "to": float(values[last]),
                "step": _step(chain, maps.x, values, first, last),
                "lasts_to": speed_of(to),
                "shown_to": speed_of(sticks_to(grades, (number, row, last), shown=True)),
                "is_dry": all(is_dry(grades, (number, row, int(place))) for place in at),
                "met": up is not None and bool(np.any(maps.bits_in[up][number, row, :first] & STICK_SLIP)),
                "unstable": grades.unstable is not None and bool(grades.unstable[number, row, at].all()),
                "shown": int(np.count_nonzero(grades.bits[:, number, row, at].any(axis=(0, -1)))),
            }
        )
    return {
        "points": int(np.count_nonzero(grades.grade == Grade.STICKS_ON)),
        "started": _started_only(maps, up),
        "sticking": _sticking(maps, up),
        "modelled": is_known,
        "met": is_met,
        "untried": untried,
        "by_smoothed": ends_by_smoothed_alone(grades.results),
        "settings": found,
    }


def _started_only(maps: Classes, up: int | None) -> int:
    """At how many of the points at which stick-slip may last something else is met on the way up, so that they are
    free when started there only: of samples in each in which it may last."""
    if up is None or "same" not in maps.grades.ways:
        return 0
    return _lasting_where(maps, maps.grades.bars[up] != 0)


def _sticking(maps: Classes, up: int | None) -> int:
    """At how many of them the way up sticks itself, at a severity that is allowed."""
    if up is None:
        return 0
    grades = maps.grades
    return _lasting_where(maps, (grades.bits[up] & STICK_SLIP > 0) & (grades.bars[up] == 0))


def _lasting_where(maps: Classes, chosen: Array) -> int:
    """How many of the points at which stick-slip may last are ``chosen``, of samples in each in which it may."""
    lasts = maps.grades.grades == Grade.STICKS_ON
    every = (~lasts | chosen).all(axis=-1)
    return int(np.count_nonzero((maps.grades.grade == Grade.STICKS_ON) & lasts.any(axis=-1) & every))


def _stuck_through(maps: Classes, cell: Cell | None) -> Answer | None:
    """Where the way up passes the speeds at which the collar reaches the wall in stick-slip,
    which keeps it from whirling: a string that does not stick there, as one with more
    damping, may whirl from there on, and at the ``points`` allowed above nothing shows what
    it does. They are at the weights ``wob``, the least and the greatest; ``from`` and ``to`` are
    these speeds [rad/s], ``at_point`` is whether the recommended point, a ``cell``, is among
    them. None where there are no such points."""
    past = stuck_past(maps.grades)
    if past is None:
        return None
    found = past.points
    rows = np.flatnonzero(found.any(axis=(0, 2)))
    return {
        "points": int(np.count_nonzero(found)),
        "wob": [float(maps.values(maps.y)[row]) for row in (rows[0], rows[-1])] if maps.y == "wob" else None,
        "axis": "rotary_speed",
        "from": past.low,
        "to": past.high,
        "at_point": cell is not None and bool(found[cell]),
    }


def _step(chain: Chain | None, axis: str, values: Array, first: int, last: int) -> float:
    """The greatest step of an axis up to its values of these numbers: of a ``chain`` that it
    had, also where values of it are left out; 0 where the chain is along another one."""
    if chain is not None:
        return chain.step(float(values[first]), float(values[last])) if chain.along == axis else 0.0
    return float(np.max(np.diff(values[max(first - 1, 0) : last + 1]), initial=0.0))


def _outcomes(maps: Classes) -> Answer:
    """What prevents that points are safe: at how many each response occurs, None of one that these
    results cannot show."""
    unseen, inside = unseen_responses(maps.results.attrs), _inside(maps)
    untold = (maps.state == UNKNOWN) & maps.grades.unmodelled & ~maps.failed
    unknown = (maps.state == UNKNOWN) & (maps.failed | maps.grades.was_run) & ~untold
    return {
        "unknown_unmodelled": int(np.count_nonzero(untold & inside)),
        "unknown_failed": int(np.count_nonzero(unknown & inside)),
        "unknown_elsewhere": int(np.count_nonzero(unknown & maps.grades.was_run & _is_known(maps.grades) & inside)),
        "obstacles": {
            name: None if name in unseen else int(np.count_nonzero((maps.bits & one.bit > 0) & inside))
            for name, one in told_responses(maps.results.attrs).items()
        },
    }


def _is_known(grades: Graded) -> Array:
    """Where every run of a point is known, [third, y, x], so that only runs elsewhere leave it open; nowhere of
    samples or starts."""
    if grades.confidence is not None or grades.share is not None:
        return np.zeros(grades.grade.shape, dtype=bool)
    return np.asarray((grades.labels > Label.UNKNOWN).all(axis=(0, -1)))


def _answer(results: Results, severity: int | None, confidence: float | None, maps: Classes) -> Advice:
    """The answer of the strictest level up to ``severity`` that has a setting, else of the
    strictest that has a hint: what is free of vibration is not given up for what merely
    is allowed. What this severity does not allow no stricter level does: a mild vibration that a
    way down met no longer shows there that a motion ends."""
    stricter = [] if not severity else [None, *range(1, severity)]
    here, answers = maps.grades.grades, []
    for level in stricter:
        strict = graded(results, level, confidence)
        both = replace(strict, grades=np.where(is_allowed(here), strict.grades, np.minimum(strict.grades, here)))
        answers.append(replace(advise(both), severity=level))
    answers.append(replace(advise(maps.grades), severity=severity))
    return _as_hint(results, _strictest(answers, maps), confidence)


def _strictest(answers: Sequence[Advice], maps: Classes) -> Advice:
    """That of the first of the ``answers`` which has a setting, else of the first that has a hint."""
    for refused in ((Kind.HINT, *NO_POINT), NO_POINT):
        found = [one for one in answers if one.kind not in refused]
        # what a stricter level allows may be unknown at this one, as a severity is not known
        found = [one for one in found if one.cell is None or maps.grades.allowed[one.cell]]
        if found:
            return found[0]
    return answers[-1]


def _as_hint(results: Results, advice: Advice, confidence: float | None) -> Advice:
    """The ``advice`` by its severity: no more than a hint where its own runs vibrate, as no order leads into a
    vibration; and not free after any history where only the severity allows what was lowered to it."""
    if not advice.severity or advice.cell is None or advice.kind in NO_POINT:
        return advice
    plain = graded(results, None, confidence)
    if (found := vibration_at(plain, advice.cell)) is not None:
        return replace(advice, kind=Kind.HINT, vibrates=found, tried_kind=None, is_unreached=False)
    is_free_from_all = confidence is not None or plain.grade[advice.cell] == Grade.ANY_HISTORY
    if advice.kind == Kind.ANY_HISTORY and plain.allowed[advice.cell] and not is_free_from_all:
        return replace(advice, kind=Kind.FROM_BELOW)
    return advice


def _milder(results: Results, severity: int | None, confidence: float | None, found: Advice) -> Answer | None:
    """The least severity that allows a setting where nothing is free of vibration, and the
    setting; None where there is none, or where one is ``found`` without."""
    if severity is not None or found.kind not in NO_POINT:
        return None
    has_them = all(name in results.variables for name in needed(0, results.attrs))
    levels = severity_levels(responses_in(results.attrs).values()) if has_them else ()
    for level in (one for one in levels if one <= MILD):
        maps = classes(results, level, confidence)
        milder = _as_hint(results, replace(advise(maps.grades), severity=level), confidence)
        if milder.kind not in NO_POINT:
            return {"severity": level, "answer": replace(milder, unsettled=unsettled_of(maps, milder))}
    return None


def _levels(results: Results) -> list[int] | None:
    """The levels of severity that allow some run more, but for the greatest, which allows all that have one; None of
    results that have no severities, of which that is not known."""
    if not all(name in results.variables for name in needed(0, results.attrs)):
        return None
    levels = severity_levels(responses_in(results.attrs).values())
    free = run_safety(results).safe
    return [level for level in levels if np.any(run_safety(results, level).safe & ~free)]


def _bounce_untold(results: Results) -> float | None:
    """The greatest step of the speed [rad/s], where the model does not tell at which speeds its
    bit bounces; None where it tells, has no bounce, or the speed is not swept."""
    is_untold = int(results.attrs.get(LASTING_UNTOLD, 0)) and BOUNCE in responses_in(results.attrs)
    if not is_untold or "rotary_speed" not in results.swept:
        return None
    return float(np.diff(results.coords["rotary_speed"]).max())


def _slower(maps: Classes, answer: Advice) -> Answer | None:
    """The mean speed of the ``drive`` at the setting, and the one that is ``set`` [rad/s], where it
    turns slower by more than :data:`nsdrill.models.numbers.OFF_SPEED` of that: one that droops,
    or has not enough torque. None where it does not, and where a file does not say."""
    if answer.cell is None or TOP_SPEED not in maps.results.variables:
        return None
    at = {**maps.results.held, **answer.point, **answer.at}
    drive, set_speed = float(maps.grades.yields(TOP_SPEED)[answer.cell]), at.get("rotary_speed")
    if set_speed is None or not drive < (1.0 - OFF_SPEED) * float(set_speed):
        return None
    return {"drive": drive, "set": float(set_speed)}


def _grades(maps: Classes) -> dict[str, int]:
    """How many points have each grade."""
    held, inside = from_rest(maps.results), _inside(maps)
    grades, unstable = maps.grades.grade[inside], only_unstable(maps.grades)[inside]
    found = {grade.words(held): int(np.count_nonzero((grades == grade) & ~unstable)) for grade in Grade}
    found["steady drilling unstable"] = int(np.count_nonzero(unstable))
    return {words: number for words, number in found.items() if number}


def _samples(results: Results) -> Answer:
    """How many samples there are, and how many of them count; None without samples."""
    if SAMPLE not in results.coords:
        return dict.fromkeys(("samples", "counted", "effective"))
    samples, counted = results.coords[SAMPLE], independent(results)
    effective = effective_number(results, counted)
    return {"samples": len(samples), "counted": len(samples[counted]), "effective": effective}


def usual_confidence(results: Results, confidence: float | None) -> float | None:
    """The confidence of a window: for results with samples by default 0.9; InputError
    for one without samples."""
    if SAMPLE in results.coords:
        return USUAL_CONFIDENCE if confidence is None else confidence
    if confidence is not None:
        check_samples(results, option("confidence"))
    return None


def unknown_words(summary: Answer) -> str:
    """Why points of a window's ``summary`` are unknown: ``3 failed``, ``3 failed or not
    carried``, ``3 off speed``, ``3 failed, 30 left open by such runs at other points, 12 inferred, without a
    severity``."""
    elsewhere = summary["unknown_elsewhere"]
    failed = summary["unknown_failed"] - elsewhere
    untold = summary["unknown_unmodelled"]
    inferred = summary["unknown"] - summary["unknown_failed"] - untold
    causes = {
        "failed": summary["failed"],
        "not run yet": summary["pending"],
        "not carried": summary["after_failure"],
        "off speed": summary["off_speed"],
        "an unstable motion": summary["unstable_motion"],
    }
    *head, last = [word for word, told in causes.items() if told] or ["failed"]
    why = f"{', '.join(head)} or {last}" if head else last
    others = f"{elsewhere} left open by runs at other points" + ("" if failed else f" ({why})")
    told = [f"{failed} {why}"] * bool(failed) + [others] * bool(elsewhere)
    told += [f"{untold} with a motion that the model leaves out"] * bool(untold)
    return ", ".join(told + [f"{inferred} inferred, without a severity"] * bool(inferred))


def _inside(maps: Classes) -> Array:
    """Which points, [third, y, x], are where one drills: those that are counted."""
    outside = maps.grades.outside
    return np.ones(maps.state.shape, dtype=bool) if outside is None else ~outside


def _counts(state: Array, inside: Array) -> Answer:
    counted = state[inside]
    counts = {word: int(np.count_nonzero(counted == value)) for value, word in STATES.items()}
    share = {word: n / max(counted.size, 1) for word, n in counts.items()}
    return {"points": int(counted.size), **counts, "share": share}


def _map(maps: Classes, number: int, answer: Advice) -> Answer:
    """The numbers of one map: shares, connected safe regions, the largest first, the
    stretches of allowed points in each row, the recommended point and the fastest one."""
    x, y, state, connected = maps.values(maps.x), maps.values(maps.y), maps.state[number], []
    counts = _counts(state, _inside(maps)[number])
    for cells, (top, bottom, left, right) in regions(state == SAFE):
        area: Answer = {"points": cells, "share": cells / counts["points"], maps.x: [float(x[left]), float(x[right])]}
        if maps.y:
            area[maps.y] = [float(y[top]), float(y[bottom])]
        else:
            area["sides"] = _limits(maps, (number, 0, left), 2)
        connected.append(area)
    is_here = (np.arange(len(maps.state)) == number)[:, None, None]
    fastest = _best(maps, (maps.state == SAFE) & is_here)
    return {
        **counts,
        "regions": connected,
        "rows": [_row(maps, number, row) for row in range(len(y))],
        "recommended": _recommended(maps, number, answer),
        "fastest": None if fastest is None else {**_at(maps, fastest, (maps.x, maps.y)), **_yields(maps, fastest)},
    }


def _row(maps: Classes, number: int, row: int) -> Answer:
    """The stretches of allowed points of one row of a map."""
    x, state = maps.values(maps.x), maps.state[number, row]
    at = {maps.y: float(maps.values(maps.y)[row])} if maps.y else {}
    return {
        "at": at,
        "axis": maps.x,
        "safe": x[np.array(stretches_run(maps.grades, state == SAFE), dtype=int).reshape(-1, 2)].tolist(),
    }


def _best(maps: Classes, allowed: Array) -> Cell | None:
    """The cell with the greatest rate of penetration among those ``allowed``
    [third, y, x]; None where no rate is known."""
    rate = maps.yields.get(YIELDS[0])
    if rate is None or not np.any(allowed & np.isfinite(rate)):
        return None
    return _cell(np.where(allowed & np.isfinite(rate), rate, -np.inf))


def _cell(values: Array) -> Cell:
    """The first cell with the greatest of ``values`` [third, y, x]."""
    third, y, x = (int(place) for place in np.unravel_index(np.argmax(values), values.shape))
    return third, y, x


def _at(maps: Classes, cell: Cell, axes: tuple[str | None, ...]) -> dict[str, float]:
    """The values of some axes at a cell."""
    places = dict(zip((maps.third, maps.y, maps.x), cell, strict=True))
    return {axis: float(maps.values(axis)[places[axis]]) for axis in axes if axis}


def _yields(maps: Classes, cell: Cell) -> dict[str, float]:
    """The yields of a cell that are known."""
    return {name: float(array[cell]) for name, array in maps.yields.items() if np.isfinite(array[cell])}


def _safety(maps: Classes, cell: Cell) -> Answer:
    """The probability of a safe run in a cell, None where it is not known of any sample,
    its interval, and of how many samples it is known; nothing without samples."""
    if not maps.safety:
        return {}
    names = ("probability", "probability_low", "probability_high")
    found = {name: float(part[cell]) for name, part in zip(names, maps.safety, strict=False)}
    counts = maps.counts.at(cell)
    return {name: value if np.isfinite(value) else None for name, value in found.items()} | {"samples_of": counts}


def _everything(maps: Classes, cell: Cell) -> Answer:
    """Where a cell is, its safety and its yields."""
    return {**_at(maps, cell, (maps.third, maps.y, maps.x)), **_safety(maps, cell), **_yields(maps, cell)}


def _recommended(maps: Classes, number: int, answer: Advice) -> Answer | None:
    """The setting of one map, or its best hint (:mod:`nsdrill.analysis.room`), that of the
    ``answer`` in its map; None where no point is allowed."""
    if answer.grade == Grade.FROM_SOME:  # a hint that is not allowed
        return None
    if answer.kind not in NO_POINT and answer.cell is not None and answer.cell[0] == number:
        cell, is_hint = answer.cell, answer.kind == Kind.HINT
    elif (choice := best_of(maps.grades, number)) is not None:
        cell = choice.cell
        is_hint = choice.how != Room.RUN or first_on_the_way(maps.grades, jumps_of(maps.grades), cell) is not None
    else:
        return None
    return {
        **_at(maps, cell, (maps.x, maps.y)),
        **_safety(maps, cell),
        **_yields(maps, cell),
        "hint": is_hint,
        "margins": {axis: _limits(maps, cell, place) for axis, place in ((maps.x, 2), (maps.y, 1)) if axis},
        "settled": not maps.unsettled[cell],
    }


def _most_probable(maps: Classes) -> Answer | None:
    """The point at which most samples are known to be safe; of several the one with the
    greatest rate of penetration, or the first where no rate is known. None where no
    sample is safe at any point."""
    if not maps.safety or not (greatest := np.max(maps.safety[LEAST])):
        return None
    is_best = maps.safety[LEAST] >= greatest
    cell = _best(maps, is_best) or _cell(is_best)
    return {**_everything(maps, cell), "ties": int(is_best.sum()) - 1}


def _confidence_costs(maps: Classes) -> list[Answer]:
    """What a confidence costs: for each of several the number of safe points, over all
    maps, and the fastest of these."""
    rows = []
    for level in sorted({*LEVELS, maps.confidence}) if maps.confidence is not None else ():
        is_safe = maps.safety[LEAST] >= level - 1e-9
        fastest = _best(maps, is_safe)
        share = float(is_safe.sum()) / max(int(_inside(maps).sum()), 1)
        row: Answer = {"confidence": level, "safe": int(is_safe.sum()), "share": share}
        rows.append(row | {"fastest": None if fastest is None else _everything(maps, fastest)})
    return rows


def _limits(maps: Classes, start: Cell, place: int) -> Answer:
    """How far one axis, that at this ``place`` of a cell, may change to either side of
    ``start``, with the others fixed: to the last safe point, and what lies behind it."""
    values, sides = maps.values((maps.third, maps.y, maps.x)[place]), {}

    def cell(index: int) -> Cell:
        third, y, x = (index if axis == place else at for axis, at in enumerate(start))
        return third, y, x

    for side, step in (("less", -1), ("more", 1)):
        last = start[place]
        while 0 <= last + step < len(values) and maps.state[cell(last + step)] == SAFE:
            last += step
        beyond: Answer = {"first_not_safe": None, **obstacle(maps, cell(last + step))}
        if beyond["why"] != "edge":
            beyond["first_not_safe"] = float(values[last + step])
        margin = abs(float(values[last] - values[start[place]]))
        sides[side] = {"margin": margin, "safe_to": float(values[last]), **beyond}
    return sides


def obstacle(maps: Classes, cell: Cell) -> Answer:
    """What prevents that a cell is safe: ``why``, and its ``responses``. A cell beyond
    the end of its row or column is at the edge; one is open where its runs ended well and
    it is not known all the same."""
    if not all(0 <= place < length for place, length in zip(cell, maps.state.shape, strict=True)):
        return {"why": "edge", "responses": []}
    bits, why = int(maps.stops[cell]), STATES[int(maps.state[cell])]
    if maps.grades.outside is not None and maps.grades.outside[cell]:
        why = "outside"
    elif why == "unknown" and maps.grades.unmodelled[cell] and not maps.failed[cell]:
        why = "unmodelled"
    elif why == "unknown" and (maps.failed[cell] or maps.grades.was_run[cell]):
        why = _why_unknown(maps, cell)
    elif bits == 0 and maps.distrusted[cell]:
        why = "distrusted"
    return {"why": why, "responses": response_text(bits, maps.results.attrs).split("+") if bits else []}


def _why_unknown(maps: Classes, cell: Cell) -> str:
    """Why the runs of a cell do not tell what it is: one failed, there or before them in
    their chain, or was not made; else it is open."""
    results = maps.results
    if maps.counts.failed[cell]:
        return "failed"
    if maps.counts.pending[cell]:
        return "pending"
    follows = planes_of(results, maps.x, maps.y, maps.third)(after_failure(results))[cell].any()
    if follows or maps.counts.known[cell] == maps.counts.of[cell]:  # its history decides
        failed, pending = has_failed(results["status"]).any(), (results["status"] == PENDING).any()
        return "failed" if failed else "pending" if pending else "open"
    return "open"


def _over_depth(maps: Classes) -> Answer | None:
    """How the window changes with depth, downwards: the counts at each depth, and the
    spans of depth in which it is open. None where depth is not swept."""
    if "depth" not in maps.results.swept:
        return None
    place = (maps.third, maps.y, maps.x).index("depth")
    levels, inside = np.moveaxis(maps.state, place, 0), np.moveaxis(_inside(maps), place, 0)
    depths = maps.values("depth").tolist()
    rows = [{"depth": depth, **_counts(*level)} for depth, *level in zip(depths, levels, inside, strict=True)]
    spans = stretches(np.array([row["safe"] > 0 for row in rows]))
    is_closed_below = bool(spans) and spans[0][1] + 1 < len(depths)
    return {
        "open": [[depths[first], depths[last]] for first, last in spans],
        "closes": depths[spans[0][1] + 1] if is_closed_below else None,
        "reopens": depths[spans[1][0]] if len(spans) > 1 else None,
        "rows": rows,
    }
