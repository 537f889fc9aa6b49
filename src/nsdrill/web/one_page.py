"""One printed sheet for the rig: the answer of a window as orders, three numbers, the map, and
the limits by weight. Without scripts, and it loads nothing."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np

from nsdrill.analysis.advice import RECOMMENDED, Advice, First, Kind, is_dry, only_unstable
from nsdrill.analysis.graded import Graded, graded
from nsdrill.analysis.grades import lasting
from nsdrill.analysis.histories import Grade, Label
from nsdrill.analysis.limits import (
    SPEED,
    Limit,
    Scatter,
    Step,
    allowed_over_samples,
    end_in_runs,
    end_of_sticking,
    limits_of_starts,
    next_limits,
    open_to_starts,
    past_jumps,
    started_only,
    sticking_over_samples,
)
from nsdrill.analysis.trials import Change, Effort, Robust, Trials
from nsdrill.analysis.untried import jumps_of, stretches_run
from nsdrill.analysis.window import find_window
from nsdrill.app.answering.answers import results_for_window
from nsdrill.app.answering.foreseen import deciding_in
from nsdrill.app.answering.window_trials import tried
from nsdrill.app.running.stages import Watch
from nsdrill.data import (
    DAMPING_RATIOS,
    ENDS_EARLY,
    Answer,
    Array,
    Attributes,
    Results,
    drive_kind,
    edited_words,
    evenly_spaced,
    overrides,
    resolved_study,
)
from nsdrill.errors import InputError, Refusal, count
from nsdrill.figures import draw, svg
from nsdrill.figures.look import Look
from nsdrill.models.damped import KEY as DAMPING_KEY
from nsdrill.models.registry import model_in, responses_in
from nsdrill.models.responses import STICK_SLIP, Response
from nsdrill.quantity import find
from nsdrill.records import dataclass
from nsdrill.study.write import changes
from nsdrill.text.string_parts import IN_ASSEMBLY, STRING
from nsdrill.text.studied import ALWAYS_SHOWN, OF_LOBES, studied
from nsdrill.web.html_page import escaped, image, sheet, without_keys
from nsdrill.web.server import static
from nsdrill.web.shown import plain, value_at
from nsdrill.words.answer import (
    headlines,
    needed_for_words,
    of_drag,
    of_lumped,
    of_unmodelled,
    shown_first,
    warnings,
    would_help,
)
from nsdrill.words.deciding_words import deciding_words
from nsdrill.words.labels import quantity, written
from nsdrill.words.orders import MOST, NOT_FREE, UNTIL_CHANGED, Orders
from nsdrill.words.trial_words import (
    best_trials,
    best_words,
    change_words,
    changed_part,
    corner_words,
    ended_in,
    ways_words,
)
from nsdrill.words.values import ORDER, Formatter, in_order, of_severity, reached

PAPERS = {"A4": 297.0, "letter": 279.4}  # heights [mm]
MARGIN = 9.0  # mm, above and below
OF_A_RIG = ("Well", "Rig")  # fields that what does not drill leaves out where they are empty
CONFIRM = "TO CONFIRM, {}"  # a heading, with what the setting is not for
KEPT = 2  # warnings, which are printed on the fullest sheet too
MAX_ROWS = 9  # of the table of limits
SAME = 1e-9  # by how much, relatively, equal values of an axis differ
CHANGED = " (changed for this run)"
MAX_STUDIED = 330  # characters of what was studied, but for what is never cut
SWITCHED = ("soft_torque", "equal_damping", "z_torque", "lqr")  # kinds of control that a driller turns on and off
NO_WORDS_OF_A_RIG = ("drive kind ideal",)  # a drive that holds its speed, as rigs assume
LIMITS = "Computed by nsdrill, not validated against {}.{} Points between those of the map were not run."
# Where what differs is not a kind of drive: sections of a study that do not set two strings apart.
NO_NAMES = ("sweep", "simulation", "record", "units", "title", "check", "initial", "output")


@dataclass(frozen=True)
class Sheet:
    """What is printed of one file: its ``results``, in ``units``, under its ``label``."""

    results: Results
    units: str
    path: str
    severity: int | None = None
    confidence: float | None = None
    label: str = ""
    watch: Watch | None = None
    """Of trials of the answer; None without trials."""

    @cached_property
    def window(self) -> Answer:
        found = find_window(self.results, self.severity, self.confidence)
        return found if self.watch is None else tried(found, self.results, self.path, watch=self.watch)

    @cached_property
    def maps(self) -> Graded:
        return graded(self.results, self.level, self.window["confidence"])

    @property
    def level(self) -> int | None:
        """The severity by which the page tells what is allowed: that of the answer, which may be stricter than what
        was asked, so that the table and the map beside it do not allow more."""
        return self.severity if self.advice.cell is None else self.advice.severity

    @cached_property
    def whole(self) -> Graded:
        """The maps with what is not drilled, too: a limit that was met there is one."""
        return replace(self.maps, outside=None)

    @cached_property
    def orders(self) -> Orders:
        return Orders(*needed_for_words(self.window, self.units))

    @property
    def responses(self) -> Mapping[str, Response]:
        """Those of the model, by name."""
        return responses_in(self.results.attrs)

    @property
    def drills(self) -> bool:
        """Whether its model is a string that drills, of which a rig speaks."""
        return model_in(self.results.attrs).drills

    @property
    def is_brought_up(self) -> bool:
        """Whether the speed was raised from point to point on the way in."""
        return self.maps.way_in == "up" and self.maps.along == "rotary_speed"

    @property
    def advice(self) -> Advice:
        found: Advice = self.window["answer"]
        return found

    @property
    def fmt(self) -> Formatter:
        return Formatter(self.units, self.window["model"])

    @property
    def plane(self) -> int:
        """The number of the map that is printed: that of the answer."""
        if self.advice.cell is not None:
            return self.advice.cell[0]
        return int(np.argmax(self.maps.allowed.sum(axis=(1, 2))))

    @property
    def title(self) -> str:
        return " ".join(str(self.results.attrs.get("title") or "").split()) or "Operating window"


def sheet_of(
    path: str,
    outline: object,
    units: str,
    severity: int | None,
    confidence: float | None,
    watch: Watch | None = None,
    within: object = None,
) -> Sheet:
    """The sheet of a file with this ``outline``, ``within`` where one drills, with trials of
    its answer where something is to ``watch`` them. InputError where it has no window."""
    if not isinstance(outline, Results) or not outline.swept:
        found = "a single operating point" if isinstance(outline, Results) else "no sweep"
        raise InputError(f"{path}: found {found}; allowed for one page: a sweep over weight, speed or depth.")
    data = results_for_window(path, severity, within)
    return Sheet(data, units, path, severity, confidence, watch=watch)


def one_page(
    sheets: Sequence[Sheet], paper: str, fields: Mapping[str, str], labels: Sequence[str] | None = None
) -> str:
    """The page as HTML, for this ``paper``, of one file, or of two, of which the first is
    answered and drawn. ``fields`` are printed above, empty ones as lines for the pen.
    ``labels`` name the files, by default what differs between them."""
    if len(sheets) > 2:
        raise Refusal("one_page", f"with {len(sheets)} files", "with one or two")
    names = _names(sheets, labels)
    first = sheets[0]
    given = [_given(one) for one in sheets]
    do, confirm = given[0].do, given[0].confirm
    below = _of_model(first)  # told there in any case
    told = [in_rig_words(text) for text in warnings(first.window, first.units) if text not in below]
    told = [text for text in told if not text.startswith("FEW WAYS IN")]  # which the trials tell
    is_ordered = any("after a disturbance, as in trials: " in text for text in (*do, *confirm))
    told = [text for text in told if not (is_ordered and text.startswith("DISTURBED IN TRIALS"))]
    of_others = [(name, edited_words(one.results.attrs)) for name, one in zip(names[1:], sheets[1:], strict=True)]
    told = [*(f"{name}: {text}" for name, text in of_others if text), *told]
    rows = list(_rows(sheets))
    others = [f"{name}: {one.orders.sentence()}" for one, name in zip(sheets[1:], names[1:], strict=True)]
    beside = "".join(f"<div class='beside'>{escaped(text)}</div>" for text in others)

    def small_print(shown: int) -> list[str]:
        return [*_told_of_trials(first), *told[:shown], *_told_of_others(sheets, names), _rest(told, first, shown)]

    is_named_hint = first.orders.is_to_confirm and not first.orders.caveat  # the caveat says so itself
    above = [*([names[0], *others] if len(sheets) > 1 else []), *([CONFIRM] if is_named_hint else [])]
    switched = _switched(sheets, names)
    above += [*names, *([switched] if switched else [])]  # headings of orders, and what stands below them
    head = _studied(sheets, names)
    cells, others_too = (
        [["", *len(sheets) * _headings(sheets)], *_cells(sheets, rows)],
        [*above, *_notes(sheets, names)],
    )
    for shown in range(shown_first(told), -1, -1):  # what has no room is counted: a second sheet is not read
        small = small_print(shown)
        scale, room = _scale(paper, [one.columns for one in given], [*small, head[MAX_STUDIED:]], cells, others_too)
        if room >= LEAST_MAP or shown <= KEPT:
            break
    now = first.orders.as_it_is
    beside_now = f" ({now})" if now else ""
    is_setting = _is_setting(first)
    whose = f"<div class='whose'>{escaped(names[0])}</div>" if len(sheets) > 1 else ""
    if is_named_hint:
        whose += f"<div class='whose'>{escaped(CONFIRM.format(first.orders.not_yet))}</div>"
    of_what = " for vibration" if first.drills else ""
    if first.level:
        allowed = f"{of_severity(first.level, first.window['model'])} vibration allowed"
        of_what += f": {allowed}"
        whose += f"<div class='whose'>{escaped(allowed.upper())}</div>"
    filled = {name: value for name, value in fields.items() if value or first.drills or name not in OF_A_RIG}
    body = [
        f"<main class='s{scale}'><header><div><h1>{escaped(first.title)}</h1>",
        f"<p>{escaped(head)}</p></div><p>operating limits{of_what}</p></header>",
        "<div class='fields'>",
        *(f"<div><b>{escaped(name)}</b> {escaped(value)}</div>" for name, value in filled.items()),
        f"</div><div class='answer {'yes' if is_setting else 'no'}'>{whose}",
        f"{escaped(first.orders.sentence())}{beside}</div>",
        *(_lists(one, mark) for one, mark in zip(given, _marks(names), strict=True)),
        f"<p class='switched'>{escaped(switched)}</p>" if switched else "",
        f"<p class='note'>The three numbers and the map: {escaped(names[0])} only.</p>" if len(sheets) > 1 else "",
        "<div class='numbers'>",
        *(f"<div><b>{escaped(value)}</b>{escaped(words + beside_now)}</div>" for value, words in _numbers(first)),
        f"</div><div class='map'>{_map(first, room)}</div>",
        _table(sheets, names, rows),
        "<div class='small'>",
        *(f"<p>{_bold(text)}</p>" for text in small),
        f"</div><footer><span>{escaped(_footer(sheets, names, labels))}</span><span>page 1 of 1</span></footer></main>",
    ]
    style = f"{static('one_page.css').decode()}@page {{ size: {paper}; }}\n"
    return sheet(first.title, style, "\n".join(body), paper.lower())


@dataclass(frozen=True)
class Given:
    """What is ordered of one file, what is to be confirmed under which heading, and what is not to be done; with the
    string ``as_it_is`` where a change of it is ordered."""

    do: list[str]
    heading: str
    confirm: list[str]
    do_not: list[str]
    as_it_is: str

    @property
    def columns(self) -> tuple[list[str], list[str]]:
        """The lines of both columns."""
        return [*self.do, *([self.heading, *self.confirm] if self.confirm else [])], self.do_not


def _given(one: Sheet) -> Given:
    """What is ordered of a file; of one that orders nothing, what is to be done before it can be."""
    do, do_not = one.orders.do(_with_control(one)), one.orders.do_not()
    helps = _helps(one)
    if one.orders.is_withdrawn:
        do = [*helps[: MOST - len(do)], *do]
    if one.advice.kind == Kind.UNKNOWN:
        before = " before drilling" if one.drills else ""
        do = [f"Have the runs that failed or are missing run again{before}{_failed(one)}."]
        do_not = [f"Do not {'drill' if one.drills else 'work'} by this page: it names no limit."]
    if do and one.advice.kind == Kind.HINT and not one.orders.is_withdrawn:  # whose orders have it
        do = [do[0], *helps[:1], *do[1:]][:MOST]
    changed = "assembly, the drive or the map changed and run again before drilling"
    have = f"Have the {changed if one.drills else 'model or the map changed and run again'}."
    if not do:
        do = [*(helps or [have])[: MOST - 1], *([UNTIL_CHANGED] if one.drills else [])]
    if one.orders.is_withdrawn and not helps:
        do = [have, *do]
    confirm = one.orders.to_confirm(_with_control(one), MOST - len(do))
    return Given(do, CONFIRM.format(one.orders.not_yet), confirm, do_not, one.orders.as_it_is)


def _failed(one: Sheet) -> str:
    """How many runs failed or are missing, and of which file: whoever runs them again needs no command here."""
    found = one.window
    told = [f"{found[key]} {words}" for key, words in (("failed", "failed"), ("pending", "are missing")) if found[key]]
    return f": of {found['of']} in {Path(one.path).name} {' and '.join(told)}" if told else ""


def _marks(names: Sequence[str]) -> list[str]:
    """For which file orders hold, as a heading says it; of one file alone nothing."""
    return [f" \N{EN DASH} {name} only" for name in names] if len(names) > 1 else [""]


def _lists(given: Given, mark: str) -> str:
    """The orders of a file, with the ``mark`` of what they hold for."""
    confirm = _list("try", f"{given.heading}{mark}", given.confirm, len(given.do)) if given.confirm else ""
    heading = ", ".join(filter(None, ("DO NOT", given.as_it_is)))
    do, do_not = _list("do", f"DO{mark}", given.do), _list("dont", f"{heading}{mark}", given.do_not)
    return f"<div class='cols'><div>{do}{confirm}</div>{do_not}</div>"


def _is_setting(one: Sheet) -> bool:
    """Whether a page recommends a setting, which is more than a hint."""
    is_named = one.advice.kind in RECOMMENDED and not one.advice.is_lax
    return is_named and not one.orders.is_to_confirm and not one.orders.is_withdrawn


def _switched(sheets: Sequence[Sheet], names: Sequence[str]) -> str:
    """What holds when a control is switched that one of two drives has; "" where none is."""
    kinds = [drive_kind(one.results.attrs) for one in sheets]
    control = next((written(kind) for kind in reversed(kinds) if kind in SWITCHED), "")
    if len(set(kinds)) < 2 or not control:
        return ""
    when = f"When the {control} is switched off or on, or fails"
    unlike = [name for one, name in zip(sheets, names, strict=True) if not _is_setting(one)]
    if unlike:
        return (
            f"{when}: nothing is ordered to drill by with the {' or the '.join(unlike)}. Pick up and stop the rotation."
        )
    ends = [one.advice.ends for one in sheets]
    shared = (
        {axis: (max(one[axis][0] for one in ends), min(one[axis][1] for one in ends)) for axis in ends[0]}
        if all(one.keys() == ends[0].keys() for one in ends)
        else {}
    )
    if not shared or any(low > high for low, high in shared.values()):
        return f"{when}: no setting is ordered with both. Pick up, stop the rotation, and come in by the other orders."
    fmt = sheets[0].fmt
    within = " and ".join(fmt.range_inwards(axis, *shared[axis]) for axis in in_order(shared))
    return (
        f"{when}: from then on the other orders hold. Only {within} is ordered with both; outside that pick up, stop "
        "the rotation, and come in by the other orders. No run switches it while drilling."
    )


def _with_control(one: Sheet) -> str:
    """That the control of the drive is on, where it has one that a driller can switch; else ""."""
    kind = drive_kind(one.results.attrs)
    return f"{written(kind)[:1].upper()}{written(kind)[1:]} on." if kind in SWITCHED else ""


def _helps(one: Sheet) -> list[str]:
    """What would allow a setting, without options of the command; a hint is not ordered."""
    tests = best_trials(one.advice.trials, one.maps.x, one.fmt)  # which stand below
    found = [re.sub(r" \(--[^)]*\)", "", text) for text in would_help(one.window, one.units) if text != tests]
    tried = one.advice.trials
    if tried is not None and tried.best is not None and tried.best.key:
        best = best_words(tried, one.maps.x, one.fmt)
        what = changed_part(tried)
        easier = _without_trip(tried)
        without_trip = "; or without a trip, " + change_words(easier, tried, one.maps.x, one.fmt) if easier else ""
        told = f"Have the {what} changed and run again: {best}{without_trip}."
        found = list(dict.fromkeys(told if best.lower() in text.lower() else text for text in found))
    milder = one.window["milder"]
    return found[:-1] if milder is not None and milder["answer"].kind == Kind.HINT else found


def _without_trip(tried: Trials) -> Change | None:
    """Of the changes that take none, where the best takes one, that of the highest rank; None where trials do not
    bear it, as those of the best bear that."""
    best = tried.best
    if best is None or best.effort == Effort.SURFACE:
        return None
    easy = [one for one in tried.helping if one.effort == Effort.SURFACE and (one.trials or not best.trials)]
    found = [one for one in easy if one.is_sound and one.promised > Robust.POOR]
    return max(found, key=lambda one: one.rank, default=None)


OF_KEYS = {"beam.modes": "beam.modes", "simulation.observe": "the observation", "simulation.transient": "the transient"}
KEY = re.compile(r"\b[a-z]{3,}(?:\.[a-z_]+)+\b")
DIGEST = re.compile(r"model digest \S+ there, \S+ here")


def in_rig_words(text: str) -> str:
    """A warning for a rig, where no one knows the keys of a study or what tells two versions of a model apart: both
    in words. The long report has them."""

    def words(key: re.Match[str]) -> str:
        if key[0] in OF_KEYS:
            return OF_KEYS[key[0]]
        found = find(key[0])
        return found.words if found is not None else key[0].rpartition(".")[2].replace("_", " ")

    return KEY.sub(words, DIGEST.sub("the equations of the model have changed", without_keys(text)))


def _names(sheets: Sequence[Sheet], labels: Sequence[str] | None) -> list[str]:
    """The names of the files: the ``labels``, else what differs, else the title; never that
    of a file."""
    if labels:
        return list(labels)
    if len(sheets) == 1:
        return [sheets[0].title]
    a, b = (one.results.attrs for one in sheets)
    if drive_kind(a) != drive_kind(b):
        return [f"{written(drive_kind(attrs))} drive" for attrs in (a, b)]
    for key, *values in changes(resolved_study(a), resolved_study(b)):
        if key.partition(".")[0] not in NO_NAMES:
            found = find(key)
            words = plain(found.words) if found else key.replace(".", " ").replace("_", " ")
            if found is not None:  # in the units of the page
                numbers = (value_at(resolved_study(attrs), key) for attrs in (a, b))
                values = [
                    found.text(number, one.units) if isinstance(number, float) else text
                    for number, text, one in zip(numbers, values, sheets, strict=True)
                ]
            return [f"{words} {value or 'none'}" for value in values]
    titles = [one.title for one in sheets]
    return titles if titles[0] != titles[1] else [f"{title} ({number})" for number, title in enumerate(titles, 1)]


def _studied(sheets: Sequence[Sheet], names: Sequence[str]) -> str:
    """What was run, in common."""
    common = _common(sheets)
    common = [text for text in common if text not in NO_WORDS_OF_A_RIG]
    names_first, changed = _named_first(), _changed(sheets)
    order = (*names_first, *changed)
    common.sort(key=lambda text: next((at for at, name in enumerate(order) if text.startswith(name)), len(order)))
    shown: list[str] = []
    for text in common:
        if len("; ".join([*shown, text])) > MAX_STUDIED and not text.startswith((*names_first, *changed)):
            break
        ratio = _ratio(sheets[0]) if text.startswith(_words_of_key(DAMPING_KEY)) else ""
        shown.append(f"{text}{ratio}{CHANGED}" if text.startswith(changed) else f"{text}{ratio}")
    left = len(common) - len(shown)
    shown += _changed_without_words(sheets, common)
    rest = f"; {count(left, 'other number')} as in the study" if left else ""
    which = f" {names[0][:1].upper()}{names[0][1:]}." if len(sheets) > 1 or names[0] != sheets[0].title else ""
    return f"{'; '.join(shown)}{rest}.{which}"


def _ratio(one: Sheet) -> str:
    """The damping ratio, by which an engineer judges the damping of torsion: `` (ratio 0.039)``."""
    ends = dict.fromkeys(f"{ratio:.2g}" for ratio in one.window[DAMPING_RATIOS])
    return f" (ratio {' to '.join(ends)})" if ends else ""


def _common(sheets: Sequence[Sheet]) -> list[str]:
    """What of all files was the same: the parts of the string together, where they are."""
    found = [
        [studied(one.results.attrs, one.results, one.units, composed=yes) for one in sheets] for yes in (True, False)
    ]
    whole = [[text for text in texts[0] if all(text in other for other in texts[1:])] for texts in found]
    return whole[0] if any(text.startswith(f"{STRING} ") for text in whole[0]) else whole[1]


def _changed_without_words(sheets: Sequence[Sheet], told: Sequence[str]) -> list[str]:
    """What was changed for the runs, in all files alike, and is not ``told``: a key that has no words, as it is."""
    first, *others = (overrides(one.results.attrs) for one in sheets)
    found = {key: value for key, value in first.items() if all(other.get(key) == value for other in others)}
    left = [key for key in found if key.partition(".")[0] not in NO_NAMES and not any(map(_is_of(key), told))]
    return [f"{_words_of_key(key)} {found[key]}{CHANGED}" for key in left]


def _is_of(key: str) -> Callable[[str], bool]:
    """Whether a text of what was studied is of the number with this ``key``."""
    return lambda text: text.startswith(_words_of_change(key))


def _words_of_key(key: str) -> str:
    found = find(key)
    return plain(found.words) if found is not None else key.replace(".", " ").replace("_", " ")


def _words_of_change(key: str) -> tuple[str, ...]:
    """With which words what was studied begins of the number with this ``key``: alone, or with the string."""
    of_string = key in IN_ASSEMBLY or key.startswith("drillstring.sections")
    return (_words_of_key(key), *([f"{STRING} "] if of_string else []))


def _changed(sheets: Sequence[Sheet]) -> tuple[str, ...]:
    """The words of the numbers that were changed for the runs, by which one page of a well differs from another: they
    are never cut. How a map was swept and run stands there in any case."""
    keys = [key for one in sheets for key in overrides(one.results.attrs) if key.partition(".")[0] not in NO_NAMES]
    return tuple(words for key in dict.fromkeys(keys) for words in _words_of_change(key))


def _named_first() -> tuple[str, ...]:
    """The words of the quantities that a rig looks for first, which are never cut."""
    keys = (
        "depth",
        "wob",
        "rotary_speed",
        "well.diameter",
        "bit.lobes",
        "bit.rock.blades",
        "bit.rock.law",
        "bit.surface_amplitude",
        "well.inclination",
        "mud.density",
        "mud.added_mass",
        "drive.kind",
        "drillstring.collar.span",
        "modes.lateral",
        *ALWAYS_SHOWN,
        *OF_LOBES,
    )
    return (*(found.words for key in keys if (found := find(key)) is not None), f"{STRING} ")


def _list(style: str, heading: str, texts: Sequence[str], after: int = 0) -> str:
    """A list of orders, numbered ``after`` so many others."""
    items = "".join(f"<li>{escaped(text)}</li>" for text in texts)
    return f"<div class='{style}'><h2>{escaped(heading)}</h2><ol start='{after + 1}'>{items}</ol></div>"


def _map(one: Sheet, room: float) -> str:
    """The map as vectors, for so much room [mm]."""
    height = float(np.clip(room / 25.4, *MAP_HEIGHTS)) if one.maps.y else STRIP_HEIGHT
    look = Look(title=False, warnings=False, width=MAP_WIDTH, height=height)
    third = {one.maps.third: float(one.maps.values(one.maps.third)[one.plane])} if one.maps.third else None
    how: dict[str, Any] = {"severity": one.level, "confidence": one.confidence}
    if (cell := one.advice.cell) is not None and one.advice.trials is not None:
        how["tried"] = replace(one.advice, cell=(0, *cell[1:])) if third else one.advice
    return image(svg(draw(one.results, "window", units=one.units, at=third, look=look, **how)), "The map")


# Three numbers.


def _numbers(one: Sheet) -> Iterator[tuple[str, str]]:
    """Where stick-slip ends, or begins, what never to exceed, and what to pass quickly, each with
    its words; where nothing is allowed, what stops it."""
    if one.advice.kind in (Kind.NOTHING, Kind.UNKNOWN):
        yield from _stops(one)
        return
    cell, maps, fmt = one.advice.cell, one.maps, one.fmt
    row = cell[1] if cell is not None else 0
    at = f" at {fmt.named(maps.y, _row_name(one, row))}" if maps.y else ""
    axis = maps.x
    if _sticks(one) and maps.confidence is not None and axis == SPEED:
        ends = sticking_over_samples(maps, one.plane, row)
        if ends is not None and ends.values[-1] == float(maps.values(axis)[0]):
            yield "none", f"stick-slip{at}: none in 95 % of {ends.of} samples"
        else:
            yield _over_samples(fmt, axis, ends, f"stick-slip ends{at}")
    elif _sticks(one):
        yield _sticking(one, row, at)
    limit, why = _exceed(one)
    if maps.confidence is not None and cell is not None and (last := allowed_over_samples(maps, cell)) is not None:
        scatter = fmt.range(axis, [last.values[0], last.values[-1]])  # whatever else bounds what is never exceeded
        why += f"; the last that is allowed{at} in 5 to 95 % of {last.of} samples: {scatter}"
    yield limit, why
    if "whirl" in one.responses:
        yield _pass(one)


def _sticks(one: Sheet) -> bool:
    """Whether the model can stick and slip."""
    return "stick_slip" in one.responses


def _sticking(one: Sheet, row: int, at: str) -> tuple[str, str]:
    """Where stick-slip ends in a row ``at`` these words."""
    cell, maps, fmt, axis = one.advice.cell, one.maps, one.fmt, one.maps.x
    step = end_of_sticking(maps, one.plane, row, None if cell is None else cell[2])
    in_runs = end_in_runs(maps, one.plane, row) if axis == SPEED else None
    if in_runs is not None and (step is None or _is_untold(one) or not step.is_known):
        met = "in the runs it goes on to the end of the map"
        met = met if in_runs.next is None else f"in the runs it ended at {_step(fmt, axis, in_runs)}"
        alone = _by_torsion_alone(one, row).replace("by torsion alone at", "torsion alone gives")
        return "not known", f"to which speed stick-slip, once started, lasts{at}; {met}{alone}"
    if step is None:
        begins = fmt.value(axis, float(maps.values(axis)[0]))
        if _is_untold(one) and axis == SPEED:
            return "not known", f"to which speed stick-slip, once started, lasts{at}; none was met from {begins} up"
        return _without_sticking(one, row), f"no stick-slip is known{at}, from {begins} up"
    words = f"stick-slip {'ends' if axis == SPEED else 'begins'}, {_on_the_way(one)}{at}"
    if not _is_met(one, row, step):
        of = " of dry friction" if _is_dry(one, row, step) else ""
        words = f"stick-slip{of}, once started, {'lasts to here' if axis == SPEED else 'may last'}{at}"
    return _step(fmt, axis, step), words + _by_torsion_alone(one, row)


def _without_sticking(one: Sheet, row: int) -> str:
    """To which speed stick-slip lasts in a row of which no run sticks: where the way in is known and others are not,
    the model tells it."""
    maps = one.maps
    if not _is_open(one, row):
        return "none"
    is_run = bool(np.all(maps.labels[maps.ways.index(maps.way_in), one.plane, row] > Label.UNKNOWN))
    is_modelled = maps.x == SPEED and maps.modelled is not None and bool(maps.modelled[one.plane, row].all())
    return "none by the model" if is_run and is_modelled else "not known"


def _is_untold(one: Sheet) -> bool:
    """Whether it is not known to which speed stick-slip lasts, which a warning tells as well."""
    return bool(one.window["stick_slip"]["untried"])


def _is_untold_in(one: Sheet, row: int) -> bool:
    """Whether neither the model nor a start with the bit at rest tells at every point of a row whether stick-slip,
    once started, lasts there."""
    tried = one.maps.tried
    return tried is not None and not bool(tried[one.plane, row].all())


def _by_torsion_alone(one: Sheet, row: int) -> str:
    """To which speed stick-slip lasts in a row by torsion alone, where it ends earlier there, and the model does not
    tell it."""
    maps = one.maps
    if maps.modelled is not None and maps.modelled[one.plane, row].all():
        return ""
    here = {} if maps.y is None else {maps.y: float(maps.values(maps.y)[row])}
    for early in one.window[ENDS_EARLY] or ():
        if all(math.isclose(early["at"].get(axis, value), value, rel_tol=1e-9) for axis, value in here.items()):
            ends = early["alone"]["value"]
            dry = early.get("dry", {"value": ends[1]})["value"]  # by which the map is graded
            ends = [ends[0], math.inf if dry is None else dry]
            alone = "every speed" if dry is None else one.fmt.range(SPEED, ends)
            return f"; by torsion alone at {alone}{_taken_away(early)}{_is_below(one, ends)}"
    return ""


def _taken_away(early: Answer) -> str:
    """What ended stick-slip in the runs below where torsion alone ends it: why there are two numbers."""
    if early["surface_amplitude"]["value"] > 0.0:
        return ", before which in the runs the lobes shake it off"
    if early["contact"]:
        return ", before which in the runs the collar at the wall may take it away"
    return ", before which a step of the sweep ended it"


def _is_below(one: Sheet, ends: Sequence[float]) -> str:
    """That the setting lies below where torsion alone ends stick-slip."""
    speed = one.advice.point.get(SPEED)
    if speed is None or speed >= max(ends):
        return ""
    what = "hint" if one.orders.is_to_confirm else "setting"
    return f"; the {what}, {one.fmt.value(SPEED, speed)}, lies below that"


def _is_met(one: Sheet, row: int, step: Step) -> bool:
    """Whether the way in sticks at the end of this ``step`` that does."""
    maps = one.maps
    sticks = step.last if maps.x == SPEED else step.next
    place = int(np.searchsorted(maps.values(maps.x), sticks if sticks is not None else np.inf))
    bits = maps.bits_on(maps.way_in)[one.plane, row, place : place + 1]
    return bool(np.all(bits & STICK_SLIP > 0))


def _is_dry(one: Sheet, row: int, step: Step) -> bool:
    """Whether stick-slip lasts to the end of this ``step`` that sticks by dry friction alone."""
    if one.maps.x != SPEED or step.last is None:
        return False
    return is_dry(one.maps, (one.plane, row, int(np.searchsorted(one.maps.values(SPEED), step.last))))


def _met_on(one: Sheet, row: int, step: Step) -> str:
    """On which other ways it sticks at the end of this ``step`` where the way in is free: beside what is free there
    a bare number contradicts it."""
    maps = one.maps
    if step.last is None or _is_met(one, row, step):
        return ""
    place = int(np.searchsorted(maps.values(maps.x), step.last))
    sticks = [way for way in maps.ways if bool(np.any(maps.bits_on(way)[one.plane, row, place] & STICK_SLIP))]
    told = [reached((way,), maps.along, from_rest=one.advice.from_rest) for way in sticks]
    return f" when {' or '.join(dict.fromkeys(told))}" if told else ""


def _bound(one: Sheet) -> str:
    """What stick-slip does with more speed, or with more of another axis."""
    return "lasts to" if one.maps.x == SPEED else "begins"


def _on_the_way(one: Sheet) -> str:
    """On which way the points were reached."""
    maps = one.maps
    if maps.way_in != "same" and maps.along in (None, SPEED):
        return f"on the way {maps.way_in}"
    return reached((maps.way_in,), maps.along, from_rest=one.advice.from_rest)


def _is_open(one: Sheet, row: int) -> bool:
    """Whether something is not known in a row."""
    return bool(np.any(one.maps.grade[one.plane, row] == Grade.UNKNOWN))


MOST_STOPS = 3


def _stops(one: Sheet) -> Iterator[tuple[str, str]]:
    """What stops the way in, over all rows of the map."""
    if one.advice.kind == Kind.UNKNOWN:
        yield "not known", "of no point is enough known: its runs failed, are missing or tell nothing"
        return
    rows = ", at one weight or another" if one.maps.y == "wob" else ""
    found = [
        *((ends, f"{one.responses[name].words} {_on_the_way(one)}") for name, *ends in one.advice.stops),
        *((ends, NOT_FREE[name]) for name, *ends in one.advice.near if name in NOT_FREE),
    ]
    for ends, words in found[:MOST_STOPS]:
        yield one.fmt.named(one.maps.x, one.fmt.range(one.maps.x, ends)), f"{words}{rows}"


def _over_samples(fmt: Formatter, axis: str, found: Scatter | None, words: str) -> tuple[str, str]:
    if found is None:
        return "not known", words
    low, middle, high = found.values
    ends = fmt.named(axis, fmt.range(axis, [low, high]))
    return ends, f"{words}: 5 to 95 % of {found.of} samples, half by {fmt.value(axis, middle)}"


def _step(fmt: Formatter, axis: str, step: Step) -> str:
    if step.next is None:
        return f"above {fmt.named(axis, fmt.value(axis, step.last or 0.0))}"
    return fmt.named(axis, fmt.range(axis, [step.next if step.last is None else step.last, step.next]))


def _exceed(one: Sheet) -> tuple[str, str]:
    """What never to exceed, and why; none is told where trials withdraw the setting, of which alone they tell."""
    if one.orders.is_withdrawn:
        doing = "to drill by" if one.drills else "recommended"
        return "none", f"of this map is {doing}: at {one.orders.setting()} {one.orders.why_withdrawn()}"
    if one.advice.vibrates is not None:
        doing = "to drill by" if one.drills else "recommended"
        return "none", f"of this map is {doing}: at {one.orders.setting()} {one.orders.vibrating()}"
    if one.advice.is_without_way_in:
        return "not known", f"a way in to {one.orders.setting()}"
    if (most := one.orders.exceed(one.maps.x)) is not None:
        return one.fmt.named(one.maps.x, most[0]), f"never exceed: {most[1]}"
    last = one.fmt.value(one.maps.x, float(one.maps.values(one.maps.x)[-1]))
    return one.fmt.named(one.maps.x, last), "the map ends there"  # of a depth


def _pass(one: Sheet) -> tuple[str, str]:
    """The speeds at which a collar off bottom reaches the wall, and whether they are passed on
    the way in."""
    way, orders = one.advice.way_in, one.orders
    told = one.window["wall_off_bottom"]
    if told is not None and told["low_side"] is not None:
        part = ", in a part of the study" if told["low_side"] == "part" else ""
        return "at every speed", f"the collar lies on the low side of the hole{part}"
    if way is None or way.wall is None:
        found = next((speed for speed in lasting(one.results) if speed["name"] == "wall_speed"), None)
        if told is not None and told["range"] is not None:
            low, high = told["range"]["from"], told["range"]["to"]
            at = one.fmt.above(SPEED, [low]) if high is None else one.fmt.range_outwards(SPEED, low, high)
            return at, "off bottom the collar reaches the wall"
        if told is None and found is None:
            return "not known", "at which speeds off bottom the collar reaches the wall"
        if found is None or found["range"] is None:
            return "none", "off bottom the collar reaches the wall at no speed that is known"
        ends = sorted((found["range"]["from"], found["range"]["to"]))
        return _wall(one, *ends), "with weight on, the collar may reach the wall"
    wall = _wall(one, *way.wall)
    if one.maps.x == SPEED and way.wall[0] > one.maps.values(SPEED)[-1]:
        end = one.fmt.value(SPEED, float(one.maps.values(SPEED)[-1]))
        return wall, f"off bottom the collar reaches the wall: above the map, which ends at {end}"
    if orders.is_withdrawn:  # to which nothing is raised
        return wall, "off bottom the collar reaches the wall"
    if way.crosses and way.first == First.SPEED and (rates := orders.rates(way)):
        return wall, f"off bottom, pass at {rates}: the collar reaches the wall"
    return wall, "off bottom, do not raise the speed through: the collar reaches the wall"


TOLD_WHOLE = (
    1.5  # the greatest over the least speed of a range that is passed; of a wider one the least alone is of use
)


def _wall(one: Sheet, low: float, high: float) -> str:
    """Speeds at which the collar reaches the wall; of so many that they say nothing, from which on."""
    if high <= TOLD_WHOLE * low:
        return one.fmt.range_outwards(SPEED, low, high)
    least, _ = one.fmt.outwards(SPEED, low, low)
    return f"from {one.fmt.value(SPEED, least)} up"


# The limits by weight.


def _row_name(one: Sheet, row: int) -> str:
    if one.maps.y is None:
        held = one.window["fixed"]
        return one.fmt.setting(held, [axis for axis in in_order(held) if axis != "depth"]) or "all"
    return quantity(one.maps.y, one.units).value(float(one.maps.values(one.maps.y)[row]))


def _rows(sheets: Sequence[Sheet]) -> Iterator[tuple[int, list[int | None]]]:
    """The rows of the table, the greatest value first: the row of the first file, and for
    each file that of the same value, None where it has none."""
    first = sheets[0].maps
    values = first.values(first.y)
    shown = set(evenly_spaced(range(len(values)), MAX_ROWS))
    if sheets[0].advice.cell is not None and len(values) > MAX_ROWS:
        shown = {*sorted(shown)[:-1], sheets[0].advice.cell[1]}
    for row in sorted(shown, reverse=True):
        places: list[int | None] = []
        for one in sheets:
            if (one.maps.x, one.maps.y) != (first.x, first.y):
                places.append(None)
                continue
            others = one.maps.values(one.maps.y)
            near = int(np.argmin(np.abs(others - values[row])))
            places.append(near if math.isclose(others[near], values[row], rel_tol=1e-9, abs_tol=1e-12) else None)
        yield row, places


def _table(sheets: Sequence[Sheet], names: Sequence[str], rows: Sequence[tuple[int, list[int | None]]]) -> str:
    """Where stick-slip ends, and the next limit above, by weight and file."""
    first = sheets[0]
    headings = _headings(sheets)
    columns = "".join(f"<th>{escaped(heading)}</th>" for heading in headings)
    heads = "".join(f"<th class='g' colspan='{len(headings)}'>{escaped(name)}</th>" for name in names)
    top = f"<tr><th></th>{heads}</tr>" if len(sheets) > 1 else ""
    best = first.advice.cell[1] if first.advice.cell is not None and _has_orders(first) else None
    body = ""
    for (row, _), texts in zip(rows, _cells(sheets, rows), strict=True):
        cells = "".join(f"<td>{escaped(text)}</td>" for text in texts)
        mark = " class='at'" if row == best else ""
        body += f"<tr{mark}>{cells}</tr>"
    total = len(first.maps.values(first.maps.y))
    more = f" ({len(rows)} of {total})" if total > len(rows) else ""
    way = "brought up at" if first.is_brought_up else "at"
    way = ", ".join(filter(None, (first.orders.as_it_is, way)))
    way += "" if first.maps.y is None or first.maps.y in ORDER else f" {first.fmt.name(first.maps.y)}"
    note = "".join(f"<p class='note'>{escaped(text)}</p>" for text in _notes(sheets, names))
    return f"<table>{top}<tr><th>{escaped(way)}{more}</th>{len(sheets) * columns}</tr>{body}</table>{note}"


def _cells(sheets: Sequence[Sheet], rows: Sequence[tuple[int, list[int | None]]]) -> list[list[str]]:
    """The texts of each row of the table, of which the first is its name."""
    columns = 3 if _sticks(sheets[0]) else 2
    return [
        [
            _row_name(sheets[0], row),
            *(
                text
                for one, place in zip(sheets, places, strict=True)
                for text in (_limits(one, place) if place is not None else ("not run",) * 3)[-columns:]
            ),
        ]
        for row, places in rows
    ]


def _jumps(sheets: Sequence[Sheet], names: Sequence[str]) -> Iterator[str]:
    """What the mark of the table means: across what the steps of the maps may jump."""
    for one, name in zip(sheets, names, strict=True):
        if past_jumps(one.maps)[one.plane].any():
            told = " and ".join(dict.fromkeys(one.orders.over(jump) for jump in jumps_of(one.maps)))
            text = f"not known to be free when brought up: {told}"
            yield f"{name}: {text}" if len(sheets) > 1 else text


def _notes(sheets: Sequence[Sheet], names: Sequence[str]) -> Iterator[str]:
    """What stands below the table: what its mark means, and why trials have other limits than its rows."""
    yield from (f"{JUMPED} {text}." for text in _jumps(sheets, names))
    for one, name in zip(sheets, names, strict=True):
        found = one.advice.trials
        if found is None or not found.bad_corners or not _has_orders(one):
            continue
        corners = " and ".join(dict.fromkeys(corner_words(trial, one.fmt) for trial in found.bad_corners[:2]))
        whose = f"{name}: s" if len(sheets) > 1 else "S"
        marked = " (\N{MULTIPLICATION SIGN} in the map)" if one is sheets[0] else ""  # whose map it is
        bad = "vibrate" if any(trial.responses for trial in found.bad_corners) else "stall"
        yield (
            f"{whose}tick-slip and next limit: each point of the map held. Trials raise and lower the speed or the "
            f"weight, and {bad} where the map is free, as at {corners}{marked}; what is ordered leaves both out."
        )
    for one, name in zip(sheets, names, strict=True):
        if reasons := _reasons(one):
            yield f"{f'{name}: ' if len(sheets) > 1 else ''}{reasons}."


def _reasons(one: Sheet) -> str:
    """Why what to stay within ends where it does, of the ends that no order tells: each limit has its reason."""
    if not _has_orders(one):
        return ""
    orders, told, fmt = one.orders, [], one.fmt
    ordered = " ".join(orders.do_not())
    for axis, ends in one.advice.stay_within.items():
        inwards = fmt.inwards(axis, ends.low, ends.high)
        for way, end, border in zip(("below", "above"), inwards, (ends.below, ends.above), strict=True):
            why = orders.beyond(axis, border)
            if ends.low < ends.high and border is not None and not (why and why in ordered):
                is_told = not why and way == "above" and axis in one.advice.most  # nothing is known above
                told += [] if is_told else [f"{way} {fmt.value(axis, end)}, {why or 'nothing was run'}"]
    return f"Limits: {'; '.join(told)}" if told else ""


def _headings(sheets: Sequence[Sheet]) -> list[str]:
    """The headings of the columns of each file, with their unit."""
    first = sheets[0]
    sign = quantity(first.maps.x, first.units).unit
    unit = f" [{sign}]" if sign else ""
    name = "" if first.maps.x in ORDER else f", {first.fmt.name(first.maps.x)}"
    sticks = [f"stick-slip {_bound(first)}"] if _sticks(first) else []
    return [f"{text}{name}{unit}" for text in (*sticks, "next limit above", _ordered_heading(sheets))]


def _ordered_heading(sheets: Sequence[Sheet]) -> str:
    """The heading of the last column, which a rig reads as leave: of what is ordered, of what is to be confirmed
    or of neither."""
    if not any(_has_orders(one) for one in sheets):
        return "allowed, not ordered" if any(one.level for one in sheets) else "free, not ordered"
    if any(one.orders.is_to_confirm for one in sheets):
        return "to confirm" if all(one.orders.is_to_confirm for one in sheets) else "ordered, or to confirm"
    return "ordered"


def _has_orders(one: Sheet) -> bool:
    """Whether the page of a file names what to stay within."""
    is_named = one.advice.kind not in (Kind.NOTHING, Kind.UNKNOWN) and not one.orders.is_withdrawn
    is_named &= one.advice.vibrates is None
    return is_named and one.maps.x in one.advice.stay_within


def _is_ordered(one: Sheet, row: int) -> bool:
    """Whether what to stay within holds at the value of a row."""
    if not _has_orders(one) or one.advice.cell is None:
        return False
    axis, depths = one.maps.y, one.advice.depths
    if axis is None or row == one.advice.cell[1]:
        return True
    value = float(one.maps.values(axis)[row])
    if axis in one.advice.stay_within:
        ends = one.advice.stay_within[axis].low, one.advice.stay_within[axis].high
    elif axis == "depth" and depths is not None:
        ends = depths.first, depths.last
    else:
        return False
    return min(ends) * (1.0 - SAME) <= value <= max(ends) * (1.0 + SAME)


def _ordered(one: Sheet, row: int, in_map: str) -> str:
    """What to stay within, the same as in the orders; of other rows that they are not ordered, and what is free
    ``in_map`` there."""
    if _is_ordered(one, row):
        ends = one.advice.stay_within[one.maps.x]
        numbers = (one.fmt.number(one.maps.x, end) for end in one.fmt.inwards(one.maps.x, ends.low, ends.high))
        way = "started at rest" if one.advice.from_rest else "quick start"
        return " to ".join(dict.fromkeys(numbers)) + (f" ({way} only)" if _is_quick_at(one, row) else "")
    if in_map == "none" or not _has_orders(one):
        return in_map
    return f"not ordered; {'allowed' if one.level else 'free'} in the map {in_map}"


def _is_quick_at(one: Sheet, row: int) -> bool:
    """Whether something of what to stay within in a row is free from a quick start only."""
    ends, values = one.advice.stay_within[one.maps.x], one.maps.values(one.maps.x)
    within = (values >= ends.low * (1.0 - SAME)) & (values <= ends.high * (1.0 + SAME))
    quick = started_only(one.maps)[one.plane, row] & within
    return bool(quick.any())


OF_GRADES = {
    Grade.UNKNOWN: "not known",
    Grade.BORDERLINE: "borderline",
    Grade.STALLED: "stalls",
    Grade.STICKS_ON: "stick-slip may last",
    Grade.FROM_SOME: "only some starts free,",
}
NO_TRIALS = "NO TRIALS: ways in and disturbances were not tried."
JUMPED = "(?)"  # before what is brought up by steps that may jump across a vibration


def _limits(one: Sheet, row: int) -> tuple[str, str, str]:
    """Where stick-slip ends, the next limit above, and what is ordered, or free when brought up where nothing is, in
    the unit of the heading."""
    maps, number = one.maps, one.plane

    def span(step: Step) -> str:
        ends = [value for value in (step.last, step.next) if value is not None]
        return " to ".join(one.fmt.number(maps.x, value) for value in ends)

    step, limits = end_of_sticking(one.whole, number, row), next_limits(one.whole, number, row)
    none = "not known" if _is_open(one, row) else "none"
    is_untold = maps.x == SPEED and (_is_untold(one) or _is_untold_in(one, row))
    ends = "none met" if is_untold and none == "none" else _without_sticking(one, row)
    if step is not None:
        ends = span(step) if step.next is not None else f"above {span(step)}"
        ends = f"from {ends}" if step.last is None else ends
    if step is not None and maps.x == SPEED and (is_untold or not step.is_known):
        met_to = end_in_runs(one.whole, number, row) or step
        ends = f"not known, met at {one.fmt.number(maps.x, met_to.last or 0.0)}{_met_on(one, row, met_to)}"
    values = maps.values(maps.x)

    def spans(chosen: Array) -> str:
        ends = (one.fmt.inwards(maps.x, *values[[first, last]]) for first, last in stretches_run(maps, chosen))
        return ", ".join(" to ".join(dict.fromkeys(one.fmt.number(maps.x, end) for end in pair)) for pair in ends)

    quick = started_only(maps)[number, row]
    past = past_jumps(maps)[number, row]
    parts = [spans(maps.allowed[number, row] & ~quick & ~past)]
    if past.any():
        parts.append(f"{JUMPED} {spans(past)}")
    # what is free from a quick start alone is left out: beside what is ordered it would read as leave
    allowed = _ordered(one, row, "; ".join(filter(None, parts)) or none)

    def met(limit: Limit) -> str:
        found = " + ".join(one.responses[name].words for name in limit.responses)
        # what the map paints there first; what is met there is known, whatever else is not
        text = (
            found if found and limit.grade in (Grade.STICKS_ON, Grade.UNKNOWN) else OF_GRADES.get(limit.grade) or found
        )
        return text or "critical"

    unstable = [float(value) for value in values[only_unstable(one.whole)[number, row]]]

    def words(limit: Limit) -> str:
        if limit.step.next in unstable:
            return f"steady drilling unstable {'from ' if limit.step.last is None else ''}{span(limit.step)}"
        return f"{met(limit)} {'from ' if limit.step.last is None else ''}{span(limit.step)}"

    told, place = [], int(np.flatnonzero(past)[0]) if past.any() else len(values)
    told += [words(limit) for limit in limits if place == len(values) or (limit.step.next or 0.0) <= values[place]]
    if place < len(values):
        sure = np.flatnonzero((maps.allowed[number, row] & ~quick & ~past)[:place])
        is_bounded = told and sure.size and limits[len(told) - 1].step.last == values[sure[-1]]
        begins = f" above {one.fmt.number(maps.x, float(values[sure[-1]]))}" if sure.size and not is_bounded else ""
        told.append(f"{JUMPED} not known{begins}")
    open_ended = f"none up to {one.fmt.number(maps.x, float(values[-1]))}"
    is_open, sticks_on = _is_open(one, row), step is not None and step.next is None  # to the end of the map
    if sticks_on and (not limits or not (is_open or maps.allowed[number, row].any())):
        told, is_free = [], "not free" if not quick.any() else "not free when brought up"
        last = one.fmt.number(maps.x, float(values[-1]))
        open_ended = "not known" if is_open else f"{is_free} up to {last}, where the map ends"
    text = ", ".join(told) or open_ended
    # of a quick start, what lies above what bounds what is brought up
    of_starts, begin = limits_of_starts(one.whole, number, row), open_to_starts(one.whole, number, row)
    same = [(text, [span(limit.step) for limit in those]) for text, those in groupby(of_starts, met)]
    started = [f"{named} {', '.join(spans)}" for named, spans in same]
    if begin is not None and not started:
        started = [f"none from {one.fmt.number(maps.x, begin)} up to {one.fmt.number(maps.x, float(values[-1]))}"]
    if started:
        way = "started at rest" if one.advice.from_rest else "after a quick start"
        text = f"{text}; {way}, {', '.join(started)}"
    return ends, text, allowed


# What stands below.


def _rest(told: Sequence[str], one: Sheet, shown: int) -> str:
    """The limits of validity, how many runs it rests on, and how many warnings are left
    out."""
    left = len(told) - shown
    more = f" {count(left, 'more warning')} in the report." if left > 0 else ""
    decide = deciding_words(deciding_in(one.results.attrs), one.responses)
    estimates = f" {decide}" if decide else ""
    against = "field data" if one.drills else "measurements"
    unseen = "".join(f" {text}" for text in _of_model(one))
    limits = LIMITS.format(against, estimates)
    rests = f" {rests}" if (rests := one.orders.rests_on().replace("Rests on", "What to stay within rests on")) else ""
    inferred = one.window["inferred_runs"]
    runs = count(one.window["runs"] - inferred, "run") + (f", and {inferred} inferred" if inferred else "")
    return f"{limits}{rests}{unseen} {runs}.{more}"


def _of_model(one: Sheet) -> list[str]:
    """What the model leaves out of the string, which the page always tells."""
    of_string = [*of_drag(one.window), *of_lumped(one.window, one.units)]
    return [*of_unmodelled(one.window, one.fmt), *of_string]


def _told_of_trials(one: Sheet) -> list[str]:
    """How the ways in of the trials ended."""
    found = one.advice.trials
    if found is None and one.advice.kind not in (Kind.NOTHING, Kind.UNKNOWN) and not one.advice.is_no_order:
        return [NO_TRIALS]
    ended = f"; not free: {ended}" if found is not None and (ended := ended_in(found)) else ""
    ways = [f"TRIALS: {ways_words(found)}{ended}."] if found is not None and found.trials else []
    return [*ways, *filter(None, [best_trials(found, one.maps.x, one.fmt)])]


def _told_of_others(sheets: Sequence[Sheet], names: Sequence[str]) -> Iterator[str]:
    """How the trials of the second file ended, and of what its report warns."""
    for one, name in zip(sheets[1:], names[1:], strict=True):
        told = [
            *(text for text in _told_of_trials(one) if text not in _told_of_trials(sheets[0])),  # once that none were
            *([f"WARNINGS: {'; '.join(found)}."] if (found := headlines(one.window, one.units)) else []),
        ]
        yield from (f"{name[:1].upper()}{name[1:]}: {text}" for text in told)


def _bold(text: str) -> str:
    """A warning with its words in capitals in bold."""
    head, colon, rest = text.partition(":")
    if colon and head.isupper():
        return f"<b>{escaped(head)}:</b>{escaped(rest)}"
    return escaped(text)


def _footer(sheets: Sequence[Sheet], names: Sequence[str], labels: Sequence[str] | None) -> str:
    """Which files these are; by their labels where they have some."""
    return "; ".join(
        f"{name if labels else Path(one.path).name}, {_origin(one.results.attrs)}"
        for one, name in zip(sheets, names, strict=True)
    )


def _origin(attrs: Attributes) -> str:
    version = attrs.get("nsdrill_version", "")
    return (
        f"study {str(attrs.get('study_sha256', ''))[:12]}, run {str(attrs.get('created', ''))[:10]}, nsdrill {version}"
    )


# What is largest that fits on the sheet: heights in mm of lines at the first scale, and
# how many characters they have.
SCALES = (1.0, 0.92, 0.84, 0.76, 0.72)
LINE, COLUMN = 4.4, 51
SMALL_LINE, WIDE = 3.2, 128
ROW_LINE, ROW_GAP = 3.9, 0.7  # of the table and of what stands above it
ROW_WIDE, CELL_GAP = 104, 3  # characters, and those that the edge of a cell takes
OF_WORDS = 1.2  # how much longer a text is in lines that are broken between words
HEADINGS = 1  # line, of the names of files, above the headings of the columns
HEAD, LEAST_MAP = 69.0, 60.0
MAP_WIDTH, MAP_HEIGHTS, STRIP_HEIGHT = 7.4, (2.2, 4.8), 1.9  # inches


def _scale(
    paper: str,
    orders: Sequence[tuple[Sequence[str], Sequence[str]]],
    small: Sequence[str],
    cells: Sequence[Sequence[str]],
    others: Sequence[str],
) -> tuple[int, float]:
    """The number of the largest type with which the map keeps its least height beside the two columns of ``orders`` of
    each file, the ``cells`` of the table, of which the first row is its headings, and ``others``, whole lines; and the
    room of the map [mm]."""
    for number, scale in enumerate(SCALES):  # noqa: B007, as it is the answer
        lines = sum(
            max(sum(-(-len(text) // int(COLUMN / scale)) for text in texts) for texts in columns) for columns in orders
        )
        below = sum(-(-len(text) // int(WIDE / scale)) for text in small)
        more = sum(-(-len(text) // int(ROW_WIDE / scale)) for text in others)
        table = sum(ROW_LINE * rows + ROW_GAP for rows in (HEADINGS, *_row_lines(cells, ROW_WIDE / scale)))
        words = HEAD + LINE * lines + SMALL_LINE * below + ROW_LINE * more + table
        room = PAPERS[paper] - 2 * MARGIN - scale * words
        if room >= LEAST_MAP or scale == SCALES[-1]:
            break
    return number, room


def _row_lines(cells: Sequence[Sequence[str]], wide: float) -> list[int]:
    """How many lines each row of ``cells`` has in a table of so many characters: a column that is longer is wider."""
    longest = [max(map(len, column)) for column in zip(*cells, strict=True)]
    share = min((wide - CELL_GAP * len(longest)) / max(sum(longest), 1) / OF_WORDS, 1.0)
    return [
        max(math.ceil(len(text) / max(share * one, 1.0)) for text, one in zip(row, longest, strict=True))
        for row in cells
    ]
