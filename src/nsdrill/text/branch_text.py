"""A file of branches as plain data and in words."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from nsdrill.analysis.bifurcations import (
    BIFURCATIONS,
    CIRCLE,
    CRITICALITY,
    CRITICALITY_NAMES,
    END,
    EQUILIBRIUM,
    NOT_DECIDED,
    SPRING_NAMES,
    TOUCHES,
    Meaning,
    meaning_beside,
    meanings_of,
    motion_text,
)
from nsdrill.data import Answer, Array, Attributes, edited_together, edited_words, overrides
from nsdrill.errors import count, printable
from nsdrill.models.registry import model_in
from nsdrill.text.words import label_of, point_text, rest, value_text

if TYPE_CHECKING:
    from xarray import Dataset


def summarize_branches(data: Dataset) -> Answer:
    """The summary that ``show`` prints of a Dataset of branches, as plain data."""
    attrs = data.attrs
    along = str(attrs["along"])
    numbers = data[along].values
    meanings = meanings_of(model_in(attrs))
    branches = [
        _branch(data, number, part, numbers, meanings) for number, part in enumerate(_parts(data["row_size"].values))
    ]
    fixed = {
        name: float(data[name].values[0])
        for name in model_in(attrs).operation.names()
        if name in data and name != along and data.sizes["point"]
    }
    return {
        "kind": "branches",
        **{name: str(attrs.get(name, "")) for name in ("title", "created", "nsdrill_version", "study_sha256")},
        **edited_together(attrs),
        "overrides": overrides(attrs),
        "along": along,
        "from": float(attrs.get("continue_from", numbers.min())),
        "to": float(attrs.get("continue_to", numbers.max())),
        "operation": fixed,
        "points": int(data.sizes["point"]),
        "unfinished": str(attrs.get("unfinished", "")),
        "seeds": _seeds(attrs),
        "not_followed": _counted(branches, "not_followed"),
        "not_known_whether_followed": _counted(branches, "not_known"),
        "branches": branches,
        "curves": _curves(data, meanings),
    }


def _counted(branches: Sequence[Answer], springs: str) -> dict[str, int]:
    """How many special points of each label have this word of the branch that springs from them."""
    return dict(Counter(one["label"] for branch in branches for one in branch["special"] if one["springs"] == springs))


def _seeds(attrs: Attributes) -> dict[str, int]:
    try:
        found = json.loads(attrs.get("seeds", "{}"))
    except ValueError:
        return {}
    return {str(word): int(count) for word, count in found.items()} if isinstance(found, dict) else {}


def _parts(sizes: Array) -> list[slice]:
    """The places of the points of each branch, which follow each other."""
    ends = np.cumsum(sizes).tolist()
    return [slice(end - size, end) for size, end in zip(sizes.tolist(), ends, strict=True)]


def _branch(data: Dataset, number: int, part: slice, numbers: Array, meanings: Mapping[int, Meaning]) -> Answer:
    values, unstable, attrs = numbers[part], data["unstable"].values[part], data.attrs
    labels, notes = data["label"].values[part], data["label_note"].values[part]
    springs = data["springs"].values[part]
    criticality, form, error = (data[name].values[part] for name in ("criticality", "normal_form", "normal_form_error"))
    motion, lobes = str(data["motion"].values[number]), int(data["lobes"].values[number])
    is_closed = bool(data["closed"].values[number])
    is_vertical = motion != EQUILIBRIUM and _is_vertical(values, attrs)
    parts, ways = _ways([] if is_vertical else stable_parts(unstable, labels), len(values), is_closed)
    bent = data["bends"].values[part] != 0 if "bends" in data else np.zeros(len(values), bool)
    open_parts = [] if is_vertical else _runs((unstable == NOT_DECIDED) & ~bent)
    special = []
    for place in np.flatnonzero((labels != 0) & (labels != END)).tolist():
        meaning = meanings.get(int(labels[place]))
        before, after = _beside(unstable, labels, place, -1), _beside(unstable, labels, place, 1)
        special.append(
            {
                "point": int(part.start + place),
                "label": meaning.name if meaning else str(int(labels[place])),
                "letters": meaning.letters if meaning else "",
                "value": float(values[place]),
                "meaning": meaning_beside(meaning, before, after) if meaning else "",
                "note": str(notes[place]),
                "unstable_before": before,
                "unstable_after": after,
                "criticality": CRITICALITY_NAMES.get(int(criticality[place]), "not_known"),
                "springs": SPRING_NAMES.get(int(springs[place]), "not_known"),
                "normal_form": float(form[place]),
                "normal_form_error": float(error[place]),
            }
        )
    return {
        "branch": number,
        "motion": motion,
        "words": motion_text(motion, lobes, model_in(attrs)),
        "lobes": lobes,
        "points": len(values),
        "min": float(values.min()),
        "max": float(values.max()),
        "parent": int(data["parent"].values[number]),
        "parent_point": int(data["parent_point"].values[number]),
        "closed": is_closed,
        "end_reason": str(data["end_reason"].values[number]),
        "stable": [[float(values[a]), float(values[b])] for a, b in parts],
        "stable_ends": [[_end(labels, end) for end in ends] for ends in parts],
        "stable_turns": [turns(values[way]) for way in ways],
        "not_decided": [[float(values[a]), float(values[b])] for a, b in open_parts],
        "bends": [[float(np.min(values[a : b + 1])), float(np.max(values[a : b + 1]))] for a, b in _runs(bent)],
        "looked_between": motion != CIRCLE,
        "at_one_value": is_vertical,
        "special": special,
    }


def _is_vertical(values: Array, attrs: Attributes) -> bool:
    """Whether the motions of a branch are a family at one value of its number: each neither attracts nor repels its
    neighbours, whatever the rounding of its multipliers says."""
    span = abs(float(attrs.get("continue_to", np.nan)) - float(attrs.get("continue_from", np.nan)))
    return len(values) >= LEAST_VERTICAL and float(np.ptp(values)) < SLACK_VERTICAL * span


def _ways(parts: list[tuple[int, int]], points: int, is_closed: bool) -> tuple[list[tuple[int, int]], list[Array]]:
    """The stable parts of a branch of so many points, and all points of each of them. On a
    closed branch the first one goes on from the last one, through the point at which the
    branch begins and ends."""
    ways = [np.arange(first, last + 1) for first, last in parts]
    if is_closed and len(parts) > 1 and parts[0][0] == 0 and parts[-1][1] == points - 1:
        ways = [np.concatenate([ways[-1], ways[0][1:]]), *ways[1:-1]]
    return [(int(way[0]), int(way[-1])) for way in ways], ways


def _beside(unstable: Array, labels: Array, place: int, step: int) -> int | None:
    """The number of unstable multipliers at the nearest regular point in the direction
    ``step`` (1 or -1); None where there is none."""
    at = place + step
    while 0 <= at < len(labels):
        if labels[at] in (0, END):
            return int(unstable[at])
        at += step
    return None


def _end(labels: Array, place: int) -> str:
    """What the end of a stable part is: a located ``bifurcation``, the end of the
    ``branch``, or only the last ``point`` that is stable."""
    if labels[place] in BIFURCATIONS:
        return "bifurcation"
    return "branch" if place in (0, len(labels) - 1) else "point"


def stable_parts(unstable: Array, labels: Array) -> list[tuple[int, int]]:
    """The first and last points of the stable parts of a branch, which end at located
    bifurcations where such points are next to them."""
    begins, ends = np.array(_runs(unstable == 0), int).reshape(-1, 2).T
    # touches of the wall may move several multipliers at once
    is_located = np.isin(np.pad(labels, 1), BIFURCATIONS)
    begins = begins - (~is_located[begins + 1] & is_located[begins])
    ends = ends + (~is_located[ends + 1] & is_located[ends + 2])
    return [(int(a), int(b)) for a, b in zip(begins, ends, strict=True) if b > a]


def _runs(is_there: Array) -> list[tuple[int, int]]:
    """The first and the last of each run of places where something is there."""
    change = np.diff(np.concatenate([[0], is_there.astype(int), [0]]))
    return [*zip(np.flatnonzero(change == 1).tolist(), (np.flatnonzero(change == -1) - 1).tolist(), strict=True)]


def turns(values: Array) -> list[float]:
    """The values between the first and the last at which they turn back."""
    signs = np.sign(np.diff(values))
    places = np.flatnonzero(signs) + 1  # the last of equal values
    turned = np.flatnonzero(np.diff(signs[places - 1]))
    return [float(value) for value in values[places[turned]]]


def _curves(data: Dataset, meanings: Mapping[int, Meaning]) -> list[Answer]:
    if "curve_row_size" not in data:
        return []
    curves = []
    along, over = str(data.attrs["along"]), str(data.attrs["over"])
    for number, part in enumerate(_parts(data["curve_row_size"].values)):
        meaning = meanings[int(data["curve_label"].values[number])]
        ends = {name: data[f"curve_{name}"].values[part] for name in (along, over)}
        curves.append(
            {
                "curve": number,
                "label": meaning.name,
                "points": part.stop - part.start,
                "lobes": int(data["curve_lobes"].values[number]),
                "words": motion_text(
                    str(data["curve_motion"].values[number]),
                    int(data["curve_lobes"].values[number]),
                    model_in(data.attrs),
                ),
                "end_reason": str(data["curve_end_reason"].values[number]),
                **{name: [float(values.min()), float(values.max())] for name, values in ends.items()},
            }
        )
    return curves


LEAST_VERTICAL = 5  # points of a family at one value of the number
SLACK_VERTICAL = 1e-8  # of the range that is followed, within which that is one value
AT_ONE_VALUE = "nowhere: a family at one value, as where energy is conserved; none attracts or repels its neighbours"
BENT = "the equations bend at this equilibrium; bifurcations of it are not looked for, and runs beside it tell"
ENDINGS_CUT = "as many points as"  # how it is said that a branch is cut off
NOT_TOLD = "a multiplier lies on the unit circle within its error"
MAX_SPECIAL = 40
MAX_LINES = 36  # of paragraphs; longer ones become a line for each branch
MAX_ROWS, MAX_PARTS = 20, 4  # lines, and stable parts named in each
# after the end of a stable part, by what it is
END_WORDS = {"bifurcation": "", "branch": " (end of the branch)", "point": " (its last point)"}


def lines(file: str, s: Answer, units: str, everything: bool = False) -> Iterator[str]:
    """The summary of a file of branches, in words: a paragraph for each, with a sentence
    on every special point, where that is short or ``everything`` is wanted; else a line
    for each."""
    branches = list(_paragraphs(s, units))
    if not everything and len(branches) > MAX_LINES:
        branches = list(_rows(s, units))
    yield from _head(file, s, units)
    yield from branches
    yield from _curve_lines(s, units)


def _head(file: str, s: Answer, units: str) -> Iterator[str]:
    along = s["along"]

    def text(value: float) -> str:
        return value_text(along, value, units)

    kind = "the branches so far of an unfinished continuation" if s.get("unfinished") else "branches of motions"
    yield printable(f"{file}: {kind}. {s['title']}".rstrip())
    if told := edited_words(s):
        yield printable(f"  {told}")
    yield f"  made           {s['created']} by nsdrill {s['nsdrill_version']}"
    for key, value in s["overrides"].items():
        yield printable(f"  with           {key} = {value}")
    yield f"  {label_of(along):14s} {text(s['from'])} to {text(s['to'])}"
    if s["operation"]:
        yield f"  at             {point_text(s['operation'], units)}"
    noun = "branch" if len(s["branches"]) == 1 else "branches"
    yield f"  points         {s['points']} on {len(s['branches'])} {noun}"
    for word, number in s["seeds"].items():
        yield f"  seeds          {number}: {word}"
    yield from _not_followed(s)
    # steps stay short where the equations bend, however many there are
    reasons = [one["end_reason"] for one in (*s["branches"], *s["curves"]) if not one.get("bends")]
    for what, key in (("branch", "continue.points"), ("curve", "continue.curves.points")):
        if cut := sum(f"as {key} allows" in one for one in reasons):
            goes = "goes" if cut == 1 else "go"
            yield f"  cut off        {count(cut, what)} {goes} on beyond as many points as {key} allows: raise it"
    if s.get("unfinished"):
        yield "  Go on with the command that began it and --resume; some branches may turn out to be parts of others."


def _not_followed(s: Answer) -> Iterator[str]:
    """The lines on special points of which the branch that springs there is not in the file, or may not be."""
    for head, key, rest_of_it in (
        ("NOT FOLLOWED", "not_followed", "what springs there is missing here"),
        ("not known", "not_known_whether_followed", "whether what springs there is here"),
    ):
        if found := s[key]:
            points = ", ".join(f"{number} {label.replace('_', ' ')}" for label, number in found.items())
            yield f"  {head:14s} {count(sum(found.values()), 'special point')} ({points}): {rest_of_it}"


def _rows(s: Answer, units: str) -> Iterator[str]:
    """A line for each branch: its motion, where it is stable, its special points; and
    what these mean."""

    def interval(low: float, high: float, between: Sequence[float] = ()) -> str:
        words = [value_text(s["along"], value, units).split(" ") for value in (low, *between, high)]
        numbers = [f"{float(one[0]):.4g}" for one in words]
        return f"{_way(numbers)} {' '.join(words[-1][1:])}"

    meanings: dict[str, str] = {}
    yield ""
    for branch in s["branches"][:MAX_ROWS]:
        counts: dict[str, int] = {}
        for special in branch["special"]:
            name = special["label"].replace("_", " ")
            meanings[name] = special["meaning"]
            if (side := special["criticality"]) != "none":
                name += f" ({side.replace('_', ' ')})"
                meanings[name] = CRITICALITY[side]
            counts[name] = counts.get(name, 0) + 1
        stable = ", ".join(interval(first, last, between) for first, between, last, _ in _stable(branch)[:MAX_PARTS])
        if (more := len(branch["stable"]) - MAX_PARTS) > 0:
            stable += f" and {more} more"
        looked = "" if branch["looked_between"] or not stable else " (at its points)"
        bent = _intervals(branch.get("bends", []), lambda value: value_text(s["along"], value, units))
        bent_text = f"stability not known {bent}: {BENT}" if bent else ""
        special_text = ", ".join(f"{number} {name}" for name, number in counts.items())
        otherwise = (
            f"stable {AT_ONE_VALUE}"
            if branch["at_one_value"]
            else ""
            if branch["not_decided"] or branch.get("bends")
            else "unstable"
        )
        open_parts = _intervals(branch["not_decided"], lambda value: value_text(s["along"], value, units))
        open_text = f"stability not decided {open_parts}: {NOT_TOLD}" if open_parts else ""
        yield (
            f"  {branch['branch']:3d}  {branch['words']}, {interval(branch['min'], branch['max'])}: "
            + "; ".join(
                filter(None, (f"stable {stable}{looked}" if stable else otherwise, open_text, bent_text, special_text))
            )
        )
    yield from rest(s["branches"], MAX_ROWS, "branches")
    yield ""
    for name, meaning in meanings.items():
        yield f"  {name}: {meaning}"
    yield "  Every special point, and why each branch ends: --all, or --json."


def _stable(branch: Answer) -> list[tuple[float, list[float], float, list[str]]]:
    """Each stable part of a branch from its lower end on: that end, the values at which it
    turns back, its other end, and what both ends are."""
    parts = []
    for (first, last), between, ends in zip(
        branch["stable"], branch["stable_turns"], branch["stable_ends"], strict=True
    ):
        part = (first, between, last, ends) if first <= last else (last, between[::-1], first, ends[::-1])
        parts.append(part)
    return parts


def _way(values: list[str], ends: Sequence[str] = ("", "")) -> str:
    """The way from the first of some ``values`` to the last, through those where it turns;
    not those that read as one before them. Words on its ``ends`` follow these."""
    between = [one for before, one in pairwise(values[:-1]) if one != before]
    if between and between[-1] == values[-1]:
        between.pop()
    through = "".join(f" through {one}" for one in between)
    return f"{values[0]}{ends[0]}{through} to {values[-1]}{ends[1]}"


def _paragraphs(s: Answer, units: str) -> Iterator[str]:
    def text(value: float) -> str:
        return value_text(s["along"], value, units)

    for branch in s["branches"]:
        origin = f", springs from branch {branch['parent']}" if branch["parent"] >= 0 else ""
        yield (
            f"\nBranch {branch['branch']}: {branch['words']}, {text(branch['min'])} to {text(branch['max'])}{origin}"
        )
        stable = ", ".join(
            _way([text(first), *map(text, between), text(last)], [END_WORDS[end] for end in ends])
            for first, between, last, ends in _stable(branch)
        )
        nowhere = AT_ONE_VALUE if branch["at_one_value"] else "not known" if branch.get("bends") else "nowhere"
        yield f"  stable         {stable or nowhere}"
        if branch["not_decided"]:
            yield f"  not decided    {_intervals(branch['not_decided'], text)}: {NOT_TOLD}"
        if branch.get("bends"):
            yield f"  not known      {_intervals(branch['bends'], text)}: {BENT}"
        if stable and not branch["looked_between"]:
            yield "                 at its points; bifurcations between them are not looked for"
        elif any("point" in ends for ends in branch["stable_ends"]):
            yield "                 what ends it at its last point was not located, as at a kink of the equations"
        short = "; steps stay short where the equations bend" if branch.get("bends") else ""
        yield f"  ends           {branch['end_reason']}{short if ENDINGS_CUT in branch['end_reason'] else ''}"
        for special in branch["special"][:MAX_SPECIAL]:
            note = f" ({special['note']})" if special["note"] else ""
            name = special["label"].replace("_", " ")
            is_count = special["note"].endswith(TOUCHES)
            meaning = "how often it touches in a period changes" if is_count else special["meaning"]
            meaning += _change(special["unstable_before"], special["unstable_after"])
            if words := CRITICALITY[special["criticality"]]:
                meaning += f"; {words}"
            if special["springs"] == "not_followed":
                meaning += "; not followed from here"
            yield (f"  {text(special['value']):14s} {name}{note}: {meaning} [point {special['point']}]")
        if (more := len(branch["special"]) - MAX_SPECIAL) > 0:
            yield f"  ... {more} more; --json has all"


def _curve_lines(s: Answer, units: str) -> Iterator[str]:
    along = s["along"]
    for curve in s["curves"]:
        over = next(
            name for name in curve if name not in (along, "curve", "label", "points", "lobes", "words", "end_reason")
        )
        low, high = (value_text(over, value, units) for value in curve[over])
        first, last = (value_text(along, value, units) for value in curve[along])
        name = curve["label"].replace("_", " ")
        where = f"{low} to {high}, at {first} to {last}"
        if low == high:
            where = f"lost beside its first point, {low} and {first}"
        yield f"\nCurve {curve['curve']}: {name} of {curve['words']}, {where}; ends: {curve['end_reason']}"


def _intervals(parts: Sequence[Sequence[float]], text: Callable[[float], str]) -> str:
    """Stretches of a branch in words."""
    told = [" to ".join(dict.fromkeys(map(text, sorted(part)))) for part in parts[:MAX_PARTS]]
    more = len(parts) - len(told)
    return ", ".join(told) + (f" and {more} more" if more else "")


def _change(before: int | None, after: int | None) -> str:
    """The change of stability at a special point, in words."""
    if before is None or after is None or before == after:
        return ""
    if NOT_DECIDED in (before, after):
        return "; stable to one side, not decided on the other" if 0 in (before, after) else ""
    if before == 0 or after == 0:
        return "; stable to one side" if before * after == 0 else ""
    return f"; {before} and {after} unstable directions to its sides"
