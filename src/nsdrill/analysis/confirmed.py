"""An answer that trials confirm or withdraw."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from nsdrill.analysis.advice import RECOMMENDED, Advice, First, Kind, Recover, Recovery, WayIn
from nsdrill.analysis.histories import Grade
from nsdrill.analysis.trials import (
    SLOWED,
    SPEED_FIRST,
    TO_CORNER,
    WEIGHT_FIRST,
    Outcome,
    Trial,
    Trials,
    Way,
    free_stretches,
)

EASY = 3.0 * np.pi / 30  # rad/s^2, 3 rpm/s: a rate at which any drive raises the speed


def confirmed(advice: Advice, trials: Trials) -> Advice:
    """The ``advice`` with its ``trials``. Where no way in ended free on which one can rely, the setting
    is no more than a hint; one that was a hint as no way in was known, or as the steps of the sweep may
    have jumped across a vibration, is a setting where one did;
    where any trial at it ended in a vibration, it is not safe after any history; and where one
    did after a pick up and tag with the rotation on, or trials of it were interrupted that may have
    withdrawn it, it is no more than a hint."""
    kind, grade, share = advice.kind, advice.grade, advice.share
    ended = (one.outcome for one in trials.trials if one.name != SLOWED and one.way != Way.CORNER)
    if any(one.is_bad for one in ended) and grade == Grade.ANY_HISTORY:
        kind, grade = Kind.FROM_BELOW if kind == Kind.ANY_HISTORY else kind, Grade.FROM_BELOW_ONLY
        share = None if share is None else replace(share, any_history=0.0)
    jumped = advice.tried_kind
    if jumped is not None and trials.sure_ways and not trials.is_cut_short:
        # ramps go through the speeds that the steps of the map jump across
        kind, jumped = Kind.FROM_BELOW if grade == Grade.FROM_BELOW_ONLY else jumped, None
    way = came_in(advice.way_in, trials)
    end = bounded(without_promise(advice.recover, recovered(advice.recover, trials), way, trials))
    is_unreached = advice.is_unreached and (way is None or way.first == First.NONE)
    if advice.is_unreached and not is_unreached:
        kind = Kind.QUICK_START
    is_withdrawn = trials.withdraws or trials.bad_tag is not None or trials.is_cut_short
    if is_withdrawn and kind in RECOMMENDED:
        kind = Kind.HINT
    return replace(
        advice,
        kind=kind,
        grade=grade,
        recover=end,
        way_in=way,
        trials=trials,
        share=share,
        is_unreached=is_unreached,
        tried_kind=jumped,
    )


def came_in(found: WayIn | None, trials: Trials) -> WayIn | None:
    """The way in as trials ended free on it, the :func:`best_stretch` of those that can be relied on. Where
    none can, as it was ``found``."""
    best = best_stretch(trials, dict.fromkeys(ORDERS, free_stretches))
    if best is None:
        return found
    name, *_ = best
    least, most = ordered(found, *best)
    return replace(found or WayIn(), first=ORDERS[name], rate=least, most=most)


def ordered(found: WayIn | None, name: str, slowest: Trial, fastest: Trial) -> tuple[float, float]:
    """The rates to order, of ways in of a ``name`` that ended free from the ``slowest`` to the ``fastest``: what
    passes the wall by a hair in a trial, or swings back to it by a hair less, has not the margin of the estimates
    of the way in that was ``found``, and eccentricity is rarely known. As tried, where these leave nothing."""
    least, most = slowest.rate or 0.0, fastest.rate or 0.0
    if found is None or ORDERS[name] != First.SPEED or not found.crosses:
        return least, most
    least = max(least, found.rate or 0.0) if (found.rate or 0.0) <= most else least
    clear = most if found.swing_rate is None else found.swing_rate
    return least, min(most, clear) if clear >= least else most


ORDERS = {SPEED_FIRST: First.SPEED, WEIGHT_FIRST: First.WEIGHT}
Stretches = Callable[[Sequence[Trial]], list[tuple[int, int]]]


def best_stretch(trials: Trials, stretches: Mapping[str, Stretches]) -> tuple[str, Trial, Trial] | None:
    """The name of the ways in to choose, and the slowest and the fastest of those side by side, of the
    ``stretches`` of each name: the speed first, unless that asks for a rate above :data:`EASY` and the
    weight first does not; where neither is free up to the fastest rate, over the most rates. None where
    there are none."""
    free = []
    for name, found in stretches.items():
        ways = trials.rates(name)
        free += [(name, ways, *ends) for ends in found(ways)]

    def worth(one: tuple[str, list[Trial], int, int]) -> tuple[float, ...]:
        name, tried, low, high = one
        if high < len(tried) - 1:
            return False, 0.0, False, high - low
        return True, -max(tried[low].rate or 0.0, EASY), name == SPEED_FIRST, high - low

    if not free:
        return None
    name, tried, low, high = max(free, key=worth)
    return name, tried[low], tried[high]


def without_promise(before: Recover | None, end: Recover | None, way: WayIn | None, trials: Trials) -> Recover | None:
    """How a vibration ends, with what another trial met at the speed to which it is lowered, and
    the way up where no way down of the map was there: the worst of them holds."""
    if end is None or end.outcome != Recovery.ENDS or end.at is None or end.then or end.axis != "rotary_speed":
        return end
    met = [
        name
        for one in trials.bad_corners
        if one.name == TO_CORNER  # a bit that is held sticks by that
        and one.speed is not None
        and np.isclose(one.speed, end.at, rtol=1e-6)
        for name in one.responses
    ]
    is_of_map, is_met = before is not None and before.at == end.at, bool(met)
    if not is_of_map and way is not None and way.through is not None and end.at <= way.through * (1.0 + 1e-6):
        met.append("stick_slip")
    then = [name for name in met if name not in end.responses] or met
    return replace(end, then=tuple(dict.fromkeys(then)), may=not is_met)


def bounded(end: Recover | None) -> Recover | None:
    """How a vibration ends, where trials moved the speed to which it is lowered: below its bound of the map one
    comes to what that map met there. Below where its runs that were lowered end nothing is known."""
    if end is not None and (end.at is None or end.by_trial):
        reaches = end.at is not None and end.free_to is not None and end.free_to <= end.at
        end = end if reaches else replace(end, free_to=None, raised=())
    if end is None or end.bound is None or end.bound.value is None:
        return end
    if end.at is None:
        return replace(end, bound=None)
    if end.at > end.bound.value:
        return end
    may = {} if end.then or not end.bound.responses else {"then": end.bound.responses, "may": True}
    return replace(end, bound=None, **may)  # type: ignore[arg-type]


def recovered(found: Recover | None, trials: Trials) -> Recover | None:
    """What becomes of a vibration, from the way down in the map, ``found``, and from the
    knocks of the trials. The worst of them holds: what lasts in one of them lasts."""
    knocks = trials.knocks
    for knock, slowed in knocks:
        if knock.outcome.is_bad and slowed is not None and slowed.outcome != Outcome.UNKNOWN:
            found = _worse(found or Recover(Recovery.NOT_MET), knock, slowed)
    if knocks and all(knock.outcome == Outcome.FREE for knock, _ in knocks):
        before = found or Recover(Recovery.NOT_MET)
        return replace(before, outcome=Recovery.STOPS) if before.outcome == Recovery.NOT_MET else before
    return found


def _worse(before: Recover, knock: Trial, slowed: Trial) -> Recover:
    """The worse of what was known ``before`` and of what a knock started, as it was
    ``slowed``. Trials lower the speed: what the way down along another axis showed is not told beside it."""
    if before.axis != "rotary_speed":
        was = Recovery.LASTS if before.outcome == Recovery.LASTS else Recovery.NOT_MET
        before = Recover(was, None, before.responses, before.lasts_above, elsewhere=before.elsewhere)
    lasts, was_lasting = slowed.outcome == Outcome.STALLED, before.outcome == Recovery.LASTS
    if lasts or set(slowed.responses) & set(knock.responses):
        responses = (*(before.responses if was_lasting else ()), *knock.responses)
        return replace(before, outcome=Recovery.LASTS, at=None, responses=tuple(dict.fromkeys(responses)), then=())
    if was_lasting:
        return before
    if before.outcome == Recovery.ENDS and bool(before.then) != bool(slowed.responses):
        # what ends in another vibration is worse than what ends free, however low
        if before.then:
            return before
        return replace(before, at=slowed.speed, responses=knock.responses, then=slowed.responses, by_trial=True)
    ends = slowed.speed if before.at is None or slowed.speed is None else min(before.at, slowed.speed)
    by_trial = ends is not None and (before.at is None or ends < before.at or before.by_trial)
    then = slowed.responses if ends == slowed.speed else before.then
    met = before.responses if before.outcome == Recovery.ENDS else ()
    responses = tuple(dict.fromkeys((*met, *knock.responses)))
    return replace(before, outcome=Recovery.ENDS, at=ends, responses=responses, then=then, by_trial=by_trial)
