"""How runs are counted: known, failed, pending, of how many.

Every share, probability, index, map, picture and table counts the runs here. The response
of a run that failed or has not run is not known: it counts neither as a response nor as
none, and failure is not taken as independent of the response. A share is that of the
known runs; its interval covers every response that the other runs may have.

Runs that come after a failed one in a chain are not known either: nothing was carried to
them, the next run began at the start of the study, and so their history is another one.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np

from nsdrill.analysis.own_contacts import of_contacts
from nsdrill.analysis.planes import along_axis
from nsdrill.data import GUESSED_SCALES, INEXACT, NATURAL_SCALES, Answer, Array, Attributes, Results, resolved_study
from nsdrill.errors import count
from nsdrill.models.numbers import NOT_EXACT, OFF_SPEED
from nsdrill.models.registry import model_in
from nsdrill.records import dataclass
from nsdrill.variables import (
    DRIVES,
    DRIVING,
    INFERRED,
    OK,
    OUTRUN,
    PENDING,
    SAMPLE,
    UNMEASURED,
    Variable,
    dimension_of,
    flag,
    has_failed,
)

NOT_CARRIED = (  # of a run that ended well
    "not known: a run before it in its chain failed, its drive is off its speed, or its motion is unstable"
)
# what is known of a run, the worst last
EXPONENT = "lyapunov_exponent"
KNOWN, UNDECIDED, NOT_RUN, FAILED = range(4)


def known(status: Array) -> Array:
    """Whether the response of a point is known: it was run to its end, or inferred from
    its neighbours."""
    return np.isin(status, (OK, INFERRED))


BEYOND = "beyond_validity"  # the label of a model that tells what takes a run beyond it


def beyond(results: Results) -> dict[str, int]:
    """How many of the runs that ended well are beyond the validity of their model, by what
    takes them there; empty where none is, or where the model does not tell."""
    if BEYOND not in results.variables:
        return {}
    values, counts = np.unique(results[BEYOND][results["status"] == OK], return_counts=True)
    about = next(one for one in model_in(results.attrs).labels if one.name == BEYOND)
    return {about.words(int(value)): int(number) for value, number in zip(values, counts, strict=True) if value}


def beyond_parts(found: Mapping[str, int]) -> str:
    """What takes how many runs beyond, of what :func:`beyond` has found."""
    return ", ".join(f"{number} {word.replace('_', ' ')}" for word, number in found.items())


def beyond_words(found: Mapping[str, int], of: int) -> str:
    """What :func:`beyond` has found, in words, among so many runs."""
    number = f"{sum(found.values())} of {count(of, 'run')} ({beyond_parts(found)})"
    return f"{number}; there they tell the kind of motion, not its size"


TURNED_BACK = "turned_back"  # the angle by which a bit on the surface that its blades leave turns back
RECUT = 1e-3  # spacings of the blades, from which on the step that this leaves in the surface counts


def turned_back(results: Results) -> Answer:
    """In how many (``runs``) of the runs that ended well (``of``) the bit turns back over
    the surface that its blades leave, and the ``greatest`` angle, in spacings of the
    blades; empty where none does."""
    if TURNED_BACK not in results.variables:
        return {}
    angles = np.asarray(results[TURNED_BACK])[np.asarray(results["status"]) == OK]
    back = angles[angles > RECUT]
    return {"runs": back.size, "of": angles.size, "greatest": float(back.max())} if back.size else {}


def turned_back_words(found: Answer) -> str:
    """What :func:`turned_back` has found, in words."""
    return (
        f"in {found['runs']} of {count(found['of'], 'run')} the bit turns back, by up to {found['greatest']:.2g} "
        "spacings of its blades; depths of cut are wrong there by 10 to 16 % of the greatest (rms) with 12 states of "
        "the surface, by 4 to 9 % with 40, the most that there can be, and their mean by up to 5 %"
    )


def of_scripts(attrs: Attributes) -> tuple[str, ...]:
    """The variables of what is told of scripts (:mod:`nsdrill.analysis.doubts`) of results with
    these root attributes, where the model has them."""
    outruns = (name for one in _outruns(attrs) for name in (one.name, *_ends(one, attrs)))
    return (*_of_states(attrs), *outruns, *(one.name for one in _drivings(attrs)), *of_contacts(attrs))


def _of_states(attrs: Attributes) -> tuple[str, ...]:
    scales = _natural_scales(attrs)
    return (*_extremes(scales), *((STARTS, "settled") if scales else ()))


def _natural_scales(attrs: Attributes) -> dict[str, float]:
    """Those of the states of a script's model; empty of another."""
    found: dict[str, float] = json.loads(attrs.get(NATURAL_SCALES, "{}"))
    return found


def _extremes(states: Iterable[str]) -> list[str]:
    return [f"{name}_{end}" for name in states for end in ("max", "min")]


def _outruns(attrs: Attributes) -> list[Variable]:
    """The features that tell of quantities of scripts how far they vary faster than the steps."""
    return [one for one in model_in(attrs).features if one.name == OUTRUN.format(one.signal)]


def _drivings(attrs: Attributes) -> list[Variable]:
    """The features that tell of contacts of scripts how long their friction drives."""
    return [one for one in model_in(attrs).features if one.name.endswith(DRIVING.format(""))]


def _ends(outrun: Variable, attrs: Attributes) -> list[str]:
    """The other features of the quantity that such a feature is about."""
    return [one.name for one in model_in(attrs).features if one.signal == outrun.signal and one.name != outrun.name]


MOST_OUTRUN = 0.25  # of the changes of a quantity: kinks and jumps give none, and what no step resolves 0.4 and more


def outrun(results: Results) -> Answer:
    """In how many (``runs``) of the runs that ended well (``of``) a quantity that a script
    measures varies faster than the steps, has a pole, or is no number somewhere, and in how
    many of them a feature is none (``no_number``), by its name; empty where none does."""
    ended, found = np.asarray(results["status"]) == OK, {}
    for variable in _outruns(results.attrs):
        if variable.name in results.variables:
            shares = np.asarray(results[variable.name])[ended]
            if runs := int(np.count_nonzero(shares > MOST_OUTRUN)):
                is_none = np.zeros(shares.shape, dtype=bool)
                for name in _ends(variable, results.attrs):
                    if name in results.variables:
                        is_none |= np.isnan(np.asarray(results[name])[ended])
                no_number = int(np.count_nonzero(is_none & (shares > MOST_OUTRUN)))
                found[str(variable.signal)] = {"runs": runs, "of": int(shares.size), "no_number": no_number}
    return found


def outrun_words(found: Answer) -> str:
    """What :func:`outrun` has found, in words."""
    parts = [f"{name} in {one['runs']} of {count(one['of'], 'run')}{_no_number(one)}" for name, one in found.items()]
    return (
        f"{', '.join(parts)}. Within a step the motion is followed and such a quantity is not: its extremes and means "
        "are those of samples there, also near a pole, where it has no greatest value. Measure one that varies as the "
        "states do and divides by nothing that passes zero, or make simulation.rtol smaller until none is named"
    )


def driving(results: Results) -> Answer:
    """In how many (``runs``) of the runs that ended well (``of``) a contact with friction of a
    script drives, by its name: for which part of the observed time at most (``longest``), and
    the words of that (``about``); empty where none does."""
    ended = np.asarray(results["status"]) == OK
    variables = results.variables
    return driving_in_parts(results.attrs, {name: np.asarray(variables[name])[ended] for name in variables})


def driving_in_parts(attrs: Attributes, parts: Mapping[str, Array]) -> Answer:
    """As :func:`driving`, of the ``parts`` of the time in which each contact drives, by the
    names of features; what is no number is not known, and does not count."""
    found = {}
    for variable in _drivings(attrs):
        known = parts.get(variable.name, np.zeros(0))
        known = known[np.isfinite(known)]
        if runs := int(np.count_nonzero(known > 0.0)):
            longest, about = float(known.max()), variable.long_name
            contact = variable.name.removesuffix(DRIVING.format(""))
            found[contact] = {"runs": runs, "of": int(known.size), "longest": longest, "about": about}
    return found


def driving_in_trace(attrs: Attributes, samples: Mapping[str, Array]) -> Answer:
    """As :func:`driving`, of the one run with these ``samples`` of a trace."""
    parts = {}
    for variable in _drivings(attrs):
        name = variable.name.removesuffix(DRIVING.format(""))
        if (sampled := samples.get(DRIVES.format(name))) is not None and sampled.size:
            parts[variable.name] = np.array([np.nanmean(sampled)])
    return driving_in_parts(attrs, parts)


def driving_words(found: Answer, what: str = "run") -> str:
    """What :func:`driving` has found, in words; each is of ``what``."""
    parts = [
        f"in {one['runs']} of {count(one['of'], what)} {one['about'].removeprefix('fraction of time in which ')} for "
        f"up to {100 * one['longest']:.2g} % of the observed time"
        for one in found.values()
    ]
    return (
        f"{'; '.join(parts)}: a friction pushes along the slip there, which none does. Bound what it is given, as "
        "normal=np.maximum(load, 0.0)"
    )


def _no_number(found: Answer) -> str:
    """That a quantity is no number in some runs, in words."""
    if not found["no_number"]:
        return ""
    return f" ({found['no_number']} of them with NaN: it is no number somewhere, as the root of a negative value)"


# of a step: errors alone make swings of up to 550 of these where damping is 0.001 of critical, and of 0.01 below
# what is forced by more there; what swings by more is known to a per mille or so
TOLERANCES = 2000.0
AT_REST = 1e-4  # likewise: what swings by less rests
# likewise, of a part beside one that moves: errors have moved one by 84, and one that friction holds creeps by 150
PART = 100.0
STARTS = "initial_state"  # the variable of the states from which runs start


def too_small(results: Results) -> Answer:
    """In how many (``runs``) of the runs that ended well (``of``) no state of a model of a script
    moves by :data:`TOLERANCES` of a step, and the ``most`` that one moves by in the run where
    it is least; empty where there is none. What is forced is to swing by as much; what is not
    may come to rest from further away. ``parts`` are position and velocity together, or one
    state, that move by less than :data:`PART` while another part moves, or that grow from a start
    below one tolerance and had not settled, each with its runs. Errors that add up over many
    cycles, as with little damping, it does not see (docs/trust.md)."""
    scales = _natural_scales(results.attrs)
    if not scales or not all(name in results.variables for name in _of_states(results.attrs)):
        return {}
    is_forced, study = model_in(results.attrs).section, resolved_study(results.attrs)
    rtol, ended = float(study["simulation"]["rtol"]), np.asarray(results["status"]) == OK
    moves, grown = dict[str, Array](), dict[str, Array]()
    for name, scale in scales.items():
        high, low = np.asarray(results[f"{name}_max"]), np.asarray(results[f"{name}_min"])
        away = np.maximum(np.abs(high), np.abs(low))
        start, tolerance = _started(results, name), rtol * (scale + away)
        moves[name] = (high - low if is_forced else 2.0 * np.maximum(away, start)) / tolerance
        is_tiny = (start > 0.0) & (start < rtol * scale) & (away > PART * rtol * scale)
        grown[name] = is_tiny & (results["settled"] == 0) & (not is_forced) & (results.procedures == ("same",))
    most = np.max(list(moves.values()), axis=0)
    least = AT_REST if is_forced else 0.0
    small = ended & (most < TOLERANCES) & (most > least)
    parts = {}
    for names in _parts(results.attrs, scales):
        moved = np.max([moves[name] for name in names], axis=0)
        is_small = (moved < PART) & (moved > AT_REST) & (most >= TOLERANCES)
        if is_forced:  # one that comes to rest from further away rests
            began = [_started(results, name) > 0.5 * PART * rtol * scales[name] for name in names]
            is_small &= ~np.any(began, axis=0)
        grows = np.any([grown[name] for name in names], axis=0)
        grows &= np.all([grown[name] | (moves[name] == 0.0) for name in names], axis=0)
        is_told = ended & (is_small | grows)
        if is_told.any():
            parts[", ".join(names)] = int(is_told.sum())
    if not small.any() and not parts:
        return {}
    found: Answer = {"runs": int(small.sum()), "of": int(ended.sum()), "rtol": rtol}
    return found | ({"most": float(most[small].min())} if small.any() else {}) | ({"parts": parts} if parts else {})


def _parts(attrs: Attributes, states: Iterable[str]) -> list[tuple[str, ...]]:
    """Positions with their velocities, and the other states alone; without any velocity the first
    two states, which are drawn over one another, are together."""
    pairs = [(x, v) for x, v in model_in(attrs).drawn.planes]
    paired = {name for pair in pairs for name in pair}
    return [*pairs, *((name,) for name in states if name not in paired)]


def _started(results: Results, state: str) -> Array:
    """How far from zero the motions began; those of a chain where the chain did, or further
    away, as what comes to rest there is carried on at rest."""
    began = np.abs(np.asarray(results[STARTS])[..., results.coords["state"].tolist().index(state)])
    return began if results.procedures == ("same",) else np.full(began.shape, np.nanmax(began, initial=0.0))


ERRORS_ALONE = (
    "Errors alone may move it as far, and extremes and amplitudes may be wrong by any factor: make simulation.rtol "
    "smaller, or give states their size here as nsdrill.number(..., scale=)"
)


def too_small_words(found: Answer) -> str:
    """What :func:`too_small` has found, in words."""
    of, told = count(found["of"], "run"), []
    tolerance = f"a step, which is simulation.rtol, {found['rtol']:g}, times its natural scale and magnitude"
    if found["runs"]:
        told.append(
            f"in {found['runs']} of {of} no state moves by {TOLERANCES:g} tolerances of {tolerance}, in one by "
            f"{found['most']:.2g}"
        )
    if parts := found.get("parts"):
        each = ", ".join(f"{name} in {runs} of {of}" for name, runs in parts.items())
        what = "tolerances" if found["runs"] else f"tolerances of {tolerance}"
        told.append(f"beside what moves, {each} moves by less than {PART:g} {what}, or grows from less than one")
    return f"{'; '.join(told)}. {ERRORS_ALONE}"


def guessed_scales(attrs: Attributes) -> list[str]:
    """The states of a script's model whose natural scale is a guess."""
    return list(json.loads(attrs.get(GUESSED_SCALES, "[]")))


def guessed_words(states: Sequence[str]) -> str:
    """What there is to know of natural scales that are guesses."""
    one = len(states) == 1
    return (
        f"the natural scale of {', '.join(states)} is that of the start, as the motion at the defaults grows without "
        f"bound and tells no size: the error of a step is measured by {'it' if one else 'them'}. Give "
        f"{'it' if one else 'each'} its size in the motions that you study, as {states[0]}=nsdrill.number(..., scale=)"
    )


def inexact_exponents(attrs: Attributes) -> str:
    """What was warned of the exponents of these results before their runs, which implicit steps
    may make wrong, in words; empty where nothing was."""
    return str(attrs.get(INEXACT) or "")


def inexact_words(found: str) -> str:
    """The same without its heading and its last stop."""
    return found.removeprefix(NOT_EXACT).strip().removesuffix(".")


FIT_DOUBTS = {  # of the fit that wrote the samples of a study, in words
    "failed": "samples failed, so that the truth may lie outside",
    "unmatched": "no run gives the data",
    "unsettled": "motions were still changing",
    "unfinished": "too few samples count",
    "history": "steady drilling and stick-slip are both possible at measured points, and the well may have been in the "
    "other one",
}


def doubtful_fit(attrs: Attributes) -> list[str]:
    """Why the fit that wrote the samples of these results is doubtful; empty of others."""
    section = resolved_study(attrs).get("uncertain")
    found = section.get("doubts", []) if isinstance(section, dict) else []
    return [name for name in found if name in FIT_DOUBTS]


def fit_words(doubts: Sequence[str]) -> str:
    """These doubts in words."""
    *head, last = (FIT_DOUBTS[name] for name in doubts)
    why = f"{', '.join(head)} and {last}" if head else last
    return f"the uncertain numbers are those of a fit in which {why}. Shares and limits rest on them"


TOP_SPEED = "drive_speed_mean"
TURNED = (TOP_SPEED, "settled")  # the variables that off_speed uses


def off_speed(results: Results) -> Array:
    """Which of the runs that ended well are off their speed: the drive turns on average faster
    than the set speed by more than :data:`OFF_SPEED` of it, or by as much slower and the
    motion had not settled. One whose torque is limited slows under an overload; after that,
    or after a stall, it is too fast until it has given back the turns that it lagged, which
    may take longer than any run. A drive that droops settles. Bool on the grid; nowhere in
    results that do not say."""
    ratios = _top_speeds(results)
    if ratios is None:
        return np.zeros(results.shape, dtype=bool)
    settled = results["settled"] if "settled" in results.variables else np.ones(results.shape)
    return np.asarray(is_off_speed(ratios, np.ones(1), settled) & (results["status"] == OK))


def _top_speeds(results: Results) -> Array | None:
    """The mean speeds of the drive over the set speeds, on the grid; None of results that do not
    say."""
    drawn = results.uncertain.get("rotary_speed")
    if TOP_SPEED not in results.variables or (drawn is None and "rotary_speed" not in results.grid):
        return None
    speeds = np.asarray(results.coords["rotary_speed"] if drawn is None else drawn, float)
    place = results.grid.index("rotary_speed" if drawn is None else SAMPLE)
    set_speed = along_axis(speeds, place, len(results.shape))
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(results[TOP_SPEED] / set_speed)


def is_off_speed(top_speed: Array, set_speed: Array, settled: Array) -> Array:
    """The rule of :func:`off_speed`, of mean and set speeds [rad/s]."""
    with np.errstate(invalid="ignore"):
        too_fast = top_speed > (1 + OFF_SPEED) * set_speed
        return too_fast | ((top_speed < (1 - OFF_SPEED) * set_speed) & (settled == 0))


def runs_off_speed(results: Results) -> Answer:
    """In how many (``runs``) of the runs that ended well (``of``) the drive is off its speed, and the
    ``least`` and ``greatest`` mean speed [rad/s] of these; empty where in none."""
    off = off_speed(results)
    if not off.any():
        return {}
    ended, speeds = np.asarray(results["status"]) == OK, np.asarray(results[TOP_SPEED])[off]
    return {
        "runs": int(off.sum()),
        "of": int(ended.sum()),
        "least": float(speeds.min()),
        "greatest": float(speeds.max()),
    }


def off_speed_words(found: Answer) -> str:
    """What :func:`runs_off_speed` has found, in words."""
    return (
        f"in {found['runs']} of {count(found['of'], 'run')} the drive turns more than {OFF_SPEED:.0%} faster than the "
        "set speed when it is observed, or as much slower and was still changing: one whose torque is limited slows "
        "under an overload, and after it, or after a stall, gives back the turns that it lagged. What such a run shows "
        "is not what its setting does, and where it shows no response it is not known. Run with a longer "
        "simulation.transient, or stop the rotation before a change of setting (sweep.procedure: up or same)"
    )


def runs_slower(results: Results) -> Answer:
    """In how many (``runs``) of the runs that ended well (``of``) the drive keeps a mean speed that
    is slower than the set speed by more than :data:`OFF_SPEED` of it, and the least of these as a
    ``share`` of it; empty where in none. Those that are off their speed are not among them."""
    ratios = _top_speeds(results)
    if ratios is None:
        return {}
    slow = (ratios < 1 - OFF_SPEED) & (np.asarray(results["status"]) == OK) & ~off_speed(results)
    ended = int(np.count_nonzero(np.asarray(results["status"]) == OK))
    return {"runs": int(slow.sum()), "of": ended, "share": float(ratios[slow].min())} if slow.any() else {}


def slower_words(found: Answer) -> str:
    """What :func:`runs_slower` has found, in words."""
    return (
        f"in {found['runs']} of {count(found['of'], 'run')} the drive keeps a speed that is slower than it is set by "
        f"more than {OFF_SPEED:.0%}, {found['share']:.0%} of it at least: the speeds in answers and pictures are those "
        "that are set"
    )


def knowledge(status: Array, is_known: Array) -> Array:
    """What is known of each run: KNOWN, FAILED, NOT_RUN, or UNDECIDED where it ended well
    and its answer is not known all the same."""
    return np.select([is_known, has_failed(status), status == PENDING], [KNOWN, FAILED, NOT_RUN], UNDECIDED)


@dataclass(frozen=True)
class Counts:
    """Of how many runs (``of``) how many are ``known``, ``failed`` and ``pending``: arrays
    of whole numbers of one shape. The others, if any, ended well, but their answer is not
    known: a check of them failed, or they came after a failed run in a chain."""

    known: Array
    failed: Array
    pending: Array
    of: Array

    @classmethod
    def over(cls, knowledge: Array, axis: int | tuple[int, ...] | None = None) -> Counts:
        """The counts over these axes of what is known of each run, over all by default."""

        def number(chosen: Array) -> Array:
            return np.asarray(np.count_nonzero(chosen, axis=axis))

        known, failed, pending = (number(knowledge == kind) for kind in (KNOWN, FAILED, NOT_RUN))
        return cls(known, failed, pending, number(knowledge >= KNOWN))

    def each(self, change: Callable[[Array], Array]) -> Counts:
        """The counts with each array changed."""
        return Counts(*map(change, (self.known, self.failed, self.pending, self.of)))

    def at(self, place: Sequence[int] | int | tuple[()] = ()) -> Answer:
        """The counts at one place as plain data: ``known``, ``failed``, ``pending``, ``of``."""
        return {name: int(getattr(self, name)[place]) for name in ("known", "failed", "pending", "of")}


def unknown_exponents(results: Results) -> tuple[int, int]:
    """Of how many runs that ended well the Lyapunov exponent is not known, and of how many
    it was to be measured; 0 of 0 where it was not."""
    if EXPONENT not in results.variables:
        return 0, 0
    is_run = np.asarray(results["status"]) == OK
    return int(np.count_nonzero(is_run & ~np.isfinite(results[EXPONENT]))), int(np.count_nonzero(is_run))


def open_words(counts: Mapping[str, int], what: str = "") -> str:
    """What is not known of ``counts``, plain data of :class:`Counts`, in words: ``8 of 8
    failed``, ``2 failed and 1 pending of 8 runs`` with ``what`` "runs"; "" where all is
    known."""
    others = counts["of"] - counts["known"] - counts["failed"] - counts["pending"]
    numbers = {"failed": counts["failed"], "pending": counts["pending"], "not known": others}
    parts = [(number, word) for word, number in numbers.items() if number]
    of = f" of {counts['of']}{f' {what}' if what else ''}"
    if len(parts) == 1:
        return f"{parts[0][0]}{of} {parts[0][1]}"
    return f"{' and '.join(f'{number} {word}' for number, word in parts)}{of}" if parts else ""


def carried_axis(results: Results) -> str | None:
    """The axis along which the state was carried: that of the study, or the only one
    that is swept; None where neither is given."""
    try:
        along = json.loads(results.attrs["study_resolved"])["sweep"]["along"]
    except (KeyError, TypeError, ValueError):
        along = None
    if isinstance(along, str) and dimension_of(along) in results.axes:
        return dimension_of(along)
    return results.swept[0] if len(results.swept) == 1 else None


# with what after_failure found in all, of results of which a part may be taken
AFTER_FAILURE = flag("not_carried", "whether a run before it in its chain failed", "carried not_carried")


def after_failure(results: Results) -> Array:
    """The runs to which nothing was carried, as a run before them in their chain failed, or
    was not made: bool on the grid, nowhere where the state was not carried. The way down
    goes on from the end of the way up."""
    if AFTER_FAILURE.name in results.variables:
        return np.asarray(results[AFTER_FAILURE.name], dtype=bool)
    status = np.asarray(results["status"])
    after, along = np.zeros(status.shape, dtype=bool), carried_axis(results)
    failed = ~known(status) & (status != UNMEASURED)  # which ended well, and was carried on
    ways: dict[str, int] = {}
    ways |= {name: results.procedures.index(name) for name in ("up", "down") if name in results.procedures}
    is_carried = "sweep" in resolved_study(results.attrs)  # by the study that made these runs
    if along is None or not is_carried or not ways or not failed.any():
        return after
    axis = results.axes.index(along)

    def in_order(array: Array, way: str) -> Array:
        """The runs of one way, the first in the chain first: a view."""
        there = np.moveaxis(array[ways[way]], axis, 0)
        return there if way == "up" else there[::-1]

    chain = np.concatenate([in_order(failed, way) for way in ways])
    follows = np.zeros_like(chain)
    follows[1:] = np.logical_or.accumulate(chain, axis=0)[:-1]
    for way, part in zip(ways, np.split(follows, len(ways)), strict=True):
        in_order(after, way)[...] = part
    return after


def with_failures(results: Results) -> dict[str, Array]:
    """The variables of ``results`` and, where a run failed in a chain, what
    :func:`after_failure` finds, so that a part of the results knows of it too."""
    after = after_failure(results) if "status" in results.variables else np.zeros(0, dtype=bool)
    return {**results.variables, **({AFTER_FAILURE.name: after.astype(np.int8)} if after.any() else {})}
