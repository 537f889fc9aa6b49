"""Whether the values of a study go together: by the rules of every study, which stand here,
and by those of its model. Each fault names the key that the user wrote."""

from __future__ import annotations

import copy
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise, product

import numpy as np

from nsdrill.data import Array, Resolved, found_at
from nsdrill.errors import Fault
from nsdrill.models.choices import is_compiled_in, words_of
from nsdrill.models.rules import Order, Reads, Rule
from nsdrill.ranges import MAX_POINTS, bound_text
from nsdrill.records import dataclass
from nsdrill.study.forms import Reading, axis_values, size
from nsdrill.study.keys import SLICE, Value, shown
from nsdrill.study.read import KeyPath, dotted
from nsdrill.study.study import refined_axes
from nsdrill.unit_table import USUAL
from nsdrill.variables import long_key, short_key, ways_of

MAX_STARTS = 10**5  # of one operating point: they are compared with each other


@dataclass(frozen=True)
class Unread(Fault):
    """A value or an axis that nothing reads; along an axis over words it is a fault
    where no word reads it."""


class Checker:
    """What the rules ask of one study: ``at`` says what was read and what is known to be
    wrong (these values are stand-ins, so nothing is said about them), ``resolved`` is
    complete. An uncertain number, with its samples in ``drawn``, is to them an axis with
    these values."""

    def __init__(self, at: Reading, resolved: Resolved, drawn: Mapping[str, Array] | None = None) -> None:
        self.document, self.faulty, self.resolved = at.document, tuple(at.faulty), resolved
        self.keys, self.model, self.leaves = at.keys, at.keys.model, at.keys.leaves
        self.drawn = drawn or {}
        self.words: Resolved = {}  # of the axes over words, where one of each is looked at

    def faults(self) -> Iterator[Fault]:
        """Those by all rules."""
        yield from self.order()
        yield from self.broken(STARTS)
        yield from self._of_model()
        yield from self.broken(SWEEP)

    def broken(self, rules: Iterable[Rule | Reads]) -> Iterator[Fault]:
        """The faults by those of the ``rules`` that can be asked."""
        for rule in rules:
            if self.sound(*rule.needs):
                yield from rule.faults(self)

    def _of_model(self) -> Iterator[Fault]:
        """Those that the model tells. Where words are an axis they hold for every word;
        but what one word does not read another may."""
        found = [list(one.broken(self.model.rules)) for one in self._with_words()]
        unread = [{one.key: one for one in faults if isinstance(one, Unread)} for faults in found]
        for faults in found:
            yield from (one for one in faults if not isinstance(one, Unread))
        for key, one in unread[0].items():
            if all(key in other for other in unread):
                yield one

    def _with_words(self) -> Iterator[Checker]:
        """This study with one word of each axis over words, each with each; itself
        where there is no such axis."""
        sweep = self.resolved["sweep"]
        axes = {key: sweep[key] for key in sweep if words_of(key) and self.sound(f"sweep.{key}")}
        if not axes:
            yield self
            return
        chosen = [dict(zip(axes, words, strict=True)) for words in product(*axes.values())]
        if any(map(self.given, axes)):  # a single simulation takes these
            chosen.append({key: self.value(key) for key in axes})
        for words in chosen:
            one = copy.copy(self)
            one.words = words
            one.resolved = copy.deepcopy(self.resolved)
            for key, word in words.items():
                section, _, name = key.rpartition(".")
                one.value(section)[name] = word
                del one.resolved["sweep"][key]
            yield one

    def _ascending(self) -> Iterator[Order]:
        """Of the thresholds; those of its own a model tells."""
        for response in self.model.critical.values():
            for lower, upper in pairwise(response.bounds):
                yield Order(f"classify.{response.name}.{lower}", f"classify.{response.name}.{upper}")

    def order(self, section: str = "") -> Iterator[Fault]:
        """Pairs of values of which one must be the smaller; only those of ``section``
        where it is given."""
        for one in (*self._ascending(), *self.model.orders):
            if (
                one.lower not in self.leaves
                or not one.lower.startswith(section)
                or not self.sound(one.lower, one.upper)
            ):
                continue
            if one.unless is None:
                yield from self._ordered(one)
            else:  # which may depend on words of the sweep: the first of them with which it does not hold is told
                asked = (check for check in self._with_words() if not one.unless(check))
                yield from next((faults for check in asked if (faults := list(check._in_words(one)))), [])

    def replaced(self) -> dict[str, Value]:
        """The defaults that no point has, as an axis replaces them, where they do not go with the
        values that are given: by their keys the values of the axis that are nearest. Of a
        study without faults, whose axes all go with these."""
        found: dict[str, Value] = {}
        for one in self.model.orders:
            if one.lower not in self.leaves or (one.unless is not None and one.unless(self)):
                continue
            if _below(one, self.value(one.lower), self.value(one.upper)):
                continue
            for key in (one.lower, one.upper):
                if self.axis(key) and not self.given(key):
                    low, high = self.ends(key)
                    found[key] = min(max(self.value(key), low), high)
        return found

    def _in_words(self, one: Order) -> Iterator[Fault]:
        """Those of :meth:`_ordered`, with the words of axes that are looked at."""
        at = "".join(f", with {key} {word}" for key, word in self.words.items())
        for fault in self._ordered(one):
            yield replace(fault, allowed=f"{fault.allowed}{at}")

    def _ordered(self, one: Order) -> Iterator[Fault]:
        """The values of their own sections, but for a default that an axis replaces; then
        the axes' ends."""
        lower, upper = one.lower, one.upper
        if knots := self.resolved.get("ramps", {}).get(short_key(upper)):
            yield from self._along_ramp(one, knots[1])
        elif not any(self.axis(key) and not self.given(key) for key in (lower, upper)):
            yield from self._in_order(one, swept=False)
        if self.axis(lower) or self.axis(upper):
            yield from self._in_order(one, swept=True)

    def _along_ramp(self, one: Order, values: Sequence[float]) -> Iterator[Fault]:
        """Whether the lower is less than each of the ``values`` of the upper's ramp."""
        low = self.ends(one.lower)[1]
        words = "at least" if one.equal else "more than"
        if one.factor != 1.0:
            words += f" {1 / one.factor:.4g} times"
        allowed = f"{words} {one.words or one.lower}, {self.text(one.lower, 1)}"
        wrong = [number for number, value in enumerate(values) if not _below(one, low, value)]
        for number in wrong[:10]:
            path: KeyPath = (*one.upper.split("."), "ramp", number, 1)
            yield self.fault(dotted(path), shown(self.document.value(path)), allowed, path)

    def _in_order(self, one: Order, swept: bool) -> Iterator[Fault]:
        """Whether the lower is less than the upper; with ``swept`` at all values of
        their axes."""
        lower, upper, factor = one.lower, one.upper, one.factor
        # they go together, sample by sample
        if swept and lower in self.drawn and upper in self.drawn:
            room = factor * self.drawn[upper] - self.drawn[lower]
            if np.all(room >= 0.0 if one.equal else room > 0.0):
                return
        small = self.ends(lower)[1] if swept else self.value(lower)
        if _below(one, small, self.ends(upper)[0] if swept else self.value(upper)):
            return
        first, second = (lower, upper) if one.blamed == "lower" else (upper, lower)
        mine = self.axis if swept else self.given
        if not mine(first) and mine(second):
            first, second = second, first
        words = ("at most" if one.equal else "below") if first == lower else ("at least" if one.equal else "above")
        if factor != 1.0:
            words += f" {factor if first == lower else 1 / factor:.4g} times"
        ends = {lower: 1, upper: 0} if swept else {lower: None, upper: None}
        other = f"{second} ({one.words})" if one.words and second == lower else second
        allowed = f"{words} {other}, which is {self.text(second, ends[second])}"
        axis = self.axis(first) if swept else None
        path = self._end_of(axis, ends[first]) if axis else None
        yield self.fault(dotted(path) if path else first, self.text(first, ends[first]), allowed, path)

    def _end_of(self, axis: str, end: int | None) -> KeyPath:
        """Where the least (``end`` 0) or the greatest value of an axis is written."""
        leaf, path = self.leaves[long_key(axis)], ("sweep", axis)
        raw = self.document.value(path)
        if axis in self.drawn or not isinstance(raw, dict | list):
            return path
        written = {name: raw[name] for name in ("from", "to")} if isinstance(raw, dict) else dict(enumerate(raw))
        read: dict[str | int, float] = {place: leaf.read(value) for place, value in written.items()}
        return (*path, (max if end else min)(read, key=read.__getitem__))

    def axis(self, key: str) -> str | None:
        """The axis of the sweep that varies ``key``, or the unknown that it is, if it
        is one of them."""
        name = short_key(key)
        if name in self.drawn:
            return name
        return name if name in self.resolved.get("sweep", {}) and self.sound(f"sweep.{name}") else None

    def ends(self, key: str) -> tuple[float, float]:
        """The least and the greatest value of ``key``, which are one where it is not
        swept."""
        axis = self.axis(key)
        if axis is None:
            return self.value(key), self.value(key)
        if axis in self.drawn:
            return float(self.drawn[axis].min()), float(self.drawn[axis].max())
        values = self.resolved["sweep"][axis]
        return (values["from"], values["to"]) if isinstance(values, dict) else (values[0], values[-1])

    def fault(self, key: str, found: str, allowed: str, path: KeyPath | None = None) -> Fault:
        """A fault at the place of ``key``, if no other ``path`` is given; what a rule says of
        an axis, of an unknown where it is one."""
        if path is None:
            section, _, rest = key.partition(".")
            path = ("sweep", rest) if section == "sweep" and rest else tuple(key.split("."))
        if path[0] == "sweep" and path[-1] in self.drawn:
            table = path[-1] in self.resolved["uncertain"]["table"]
            path = ("uncertain", "table", path[-1]) if table else ("uncertain", path[-1])
            key, found = dotted(path), _of_unknown(found)
        if key in self.words:
            key, path = f"sweep.{key}", ("sweep", key)
        return self.document.fault(path, found, allowed, key=key)

    def swept(self, key: str) -> str:
        """The key of the axis over ``key``, where there is one, else the key itself."""
        return f"sweep.{axis}" if (axis := self.axis(key)) else key

    def unread(self, key: str, why: str, allowed: str) -> Iterator[Fault]:
        """A fault where ``key``, which nothing reads, is an axis or has another value
        than its default; ``why`` says what it is that does not read it."""
        if self.axis(key):
            yield self.idle(self.fault(f"sweep.{key}", f"an axis over {key}, {why}", allowed))
        elif self.value(key) != self.default(key):
            yield self.idle(self.fault(key, f"{self.text(key)}, {why}", allowed))

    def idle(self, fault: Fault) -> Fault:
        """``fault`` as one that says of a value or an axis that nothing reads it."""
        if self.words:
            allowed = f"a value that one of the words of {' and '.join(f'sweep.{key}' for key in self.words)} reads"
            return Unread(**{**vars(fault), "allowed": allowed})
        return Unread(**vars(fault))

    def sound(self, *keys: str) -> bool:
        return not self.faulty or not any(
            key == bad or key.startswith((f"{bad}.", f"{bad}[")) for key in keys for bad in self.faulty
        )

    @property
    def axes(self) -> list[str]:
        """The axes of the sweep by their names in it."""
        return [axis for axis in self.resolved["sweep"] if axis not in ("procedure", "along", "refine")]

    @property
    def starts(self) -> int:
        """The number of starts of each operating point."""
        plane = self.value(SLICE)
        if not self.sound("initial"):
            return 1
        return math.prod(size(axis) for axis in plane.values()) if plane else max(1, self.value("initial.ensemble"))

    def given(self, key: str) -> bool:
        return self.document.has(tuple(key.split(".")))

    def value(self, key: str) -> Value:
        return found_at(self.resolved, key)

    def default(self, key: str) -> Value:
        """The default of ``key`` in this study."""
        return self.leaves[key].default_in(self.resolved)

    def text(self, key: str, end: int | None = None) -> str:
        """The value of ``key`` in words; of a swept one, if ``end`` is 0 or 1, the
        least or the greatest."""
        if end is not None and (axis := self.axis(key)):
            leaf = self.leaves[key]
            text = leaf.text(self.ends(key)[end]) if leaf.units in USUAL else f"{self.ends(key)[end]:g}"
            of = f"the samples of {axis}" if axis in self.drawn else f"sweep.{axis}"
            return f"{text} at {'the greatest' if end else 'the least'} of {of}"
        if key in self.words:
            return self.leaves[key].text(self.words[key])
        if self.given(key):
            return shown(self.document.value(key.split(".")))
        leaf = self.leaves[key]
        value = self.value(key)
        text = f"{value:g}" if leaf.units not in USUAL else leaf.text(value)
        if value != self.default(key):
            return text
        if leaf.follows is None:
            return f"{text} (the default)"
        return f"{text} (the default with {leaf.follows.of} {self.value(leaf.follows.of)})"


def _below(one: Order, lower: float, upper: float) -> bool:
    """Whether these values are in order."""
    return lower < one.factor * upper or (one.equal and lower == one.factor * upper)


def _starts(check: Checker) -> Iterator[Fault]:
    """An ensemble or a slice, not both, without carried state, and nothing given
    that it would not use."""
    plane, count = check.value(SLICE), check.value("initial.ensemble")
    if check.drawn and (plane or count > 1):
        found = "with uncertain numbers, whose samples are then several runs of every operating point too"
        names = list(plane) if plane else [n for n in check.model.all_states if f"initial.{n}" in check.leaves]
        allowed = (
            "several starts or samples, not both. A state of the start may itself be uncertain "
            f"(uncertain.initial.{names[0]}: each sample then has a start of its own, and a probability is one "
            f"over both) or swept (sweep.initial.{names[0]}: every sample from every start)"
        )
        yield check.fault(SLICE if plane else "initial.ensemble", found, allowed)
        return
    if any(bad.startswith((SLICE, "initial.ensemble")) for bad in check.faulty) or (not plane and count < 2):
        return
    key = SLICE if plane else "initial.ensemble"
    if plane and count > 1:
        yield check.fault("initial.ensemble", f"{count} beside initial.slice", "one of the two")
        return
    if plane and len(plane) != 2:
        yield check.fault(SLICE, f"{len(plane)} of them ({', '.join(plane)})", "two states")
        return
    if check.starts > MAX_STARTS:
        found = f"{check.starts:.3g} starts of every operating point"
        yield check.fault(key, found, f"at most {bound_text(MAX_STARTS)}")
    procedure = check.resolved["sweep"]["procedure"]
    if procedure != "same" and check.sound("sweep.procedure"):
        found = f"starts of their own at every point, with sweep.procedure: {procedure}, which carries the state on"
        yield check.fault(key, found, "with sweep.procedure: same")
    states = check.model.sliced or check.model.all_states
    drawn = plane if plane else [name for name in states if f"initial.{name}" in check.leaves]
    for name in drawn:
        leaf = check.leaves[f"initial.{name}"]
        if check.given(leaf.key) and check.sound(leaf.key) and check.value(leaf.key) != leaf.default:
            what = "which initial.slice varies" if plane else "with an ensemble, which draws all states"
            yield check.fault(leaf.key, f"{check.text(leaf.key)}, {what}", "left out")


def _returns(check: Checker) -> Iterator[Fault]:
    """Returns to a section only of a model that has one."""
    if not check.model.section and check.value("record.poincare") > 0:
        found = f"{check.text('record.poincare')}, with the model {check.model.name}, which has no Poincare section"
        yield check.fault("record.poincare", found, "0")


def _sweep(check: Checker) -> Iterator[Fault]:
    """Those :data:`OF_AXES`, of axes that are sound and have not too many points."""
    sweep = check.resolved["sweep"]
    if any(key == "sweep" or key.startswith("sweep.") for key in check.faulty):
        return
    if not check.axes and sweep["procedure"] != "same":
        allowed = f"at least one axis to sweep: {check.keys.numbers()}"
        yield check.fault("sweep", f"no axis along which the state is carried {sweep['procedure']}", allowed)
    if not check.axes and not sweep["refine"] and sweep["along"] is None and not check.drawn:
        return
    if too_many := list(_points(check)):
        yield from too_many  # by their number, before an axis is made
    else:
        yield from check.broken(OF_AXES)


def _points(check: Checker) -> Iterator[Fault]:
    """At most :data:`MAX_POINTS`."""
    sweep, starts = check.resolved["sweep"], check.starts
    samples = len(next(iter(check.drawn.values()))) if check.drawn else 1
    refined, ways = refined_axes(sweep), ways_of(sweep["procedure"])
    total = math.prod(size(sweep[axis], sweep["refine"] if axis in refined else 0) for axis in check.axes)
    total *= starts * samples * len(ways)
    if total > MAX_POINTS:
        also = [word for word, is_so in (("starts", starts > 1), ("samples", samples > 1)) if is_so]
        of = " and ".join(["over all axes", *also]) + (", refined" if refined else "")
        of += ", " + " and ".join(ways) if len(ways) > 1 else ""
        allowed = f"at most {bound_text(MAX_POINTS)}, whose results take some 10 GB"
        hint = "Divide the sweep into studies, and join their results: nsdrill combine."
        yield replace(check.fault("sweep", f"{bound_text(total)} points {of}", allowed), suggestion=hint)


def _values(check: Checker) -> Iterator[Fault]:
    """No axis over the start beside several, and whole numbers where they are compiled in."""
    sweep = check.resolved["sweep"]
    for axis in check.axes:
        if axis.startswith("initial.") and check.starts > 1:
            yield check.fault(f"sweep.{axis}", "an axis over the start", "no several starts beside it")
        if is_compiled_in(check.model, axis) and not words_of(axis):
            values = axis_values(sweep[axis], sweep["refine"] if axis in refined_axes(sweep) else 0)
            if odd := [value for value in values.tolist() if value != int(value)]:
                yield check.fault(f"sweep.{axis}", f"the value {odd[0]:g}", "whole numbers, as [1, 3, 5]")


def _refined(check: Checker) -> Iterator[Fault]:
    """Something to refine: single starts, and an axis with a spacing."""
    sweep, key = check.resolved["sweep"], "sweep.refine"
    if sweep["refine"] and check.starts > 1:
        allowed = "0 with several starts of each operating point, whose responses may all differ"
        yield check.fault(key, str(sweep["refine"]), allowed)
    if sweep["refine"] and not refined_axes(sweep):
        allowed = "0, or an axis {from, to, points}"
        if sweep["along"] is not None:
            allowed += f" beside {sweep['along']}, along which the state is carried point by point"
        yield check.fault(key, f"{sweep['refine']}, with no axis to refine", allowed)


def _following(check: Checker) -> Iterator[Fault]:
    """One value of a number whose default follows another key, where that one is an
    axis over values with several defaults."""
    for leaf in check.leaves.values():
        if leaf.follows is None or check.given(leaf.key) or check.axis(leaf.key):
            continue
        of, at = leaf.follows.of, leaf.follows.at
        if not (axis := check.axis(of)):
            continue
        values = check.resolved["sweep"][axis]
        values = values if isinstance(values, list) else axis_values(values, 0).tolist()
        if words_of(of):
            values = [word for word in values if leaf.follows.has(word)]
        first: dict[Value, float | str] = {}
        for value in values:
            first.setdefault(at(value), value)
        if len(first) > 1:
            told = ", ".join(
                f"{leaf.text(default)} with {value if isinstance(value, str) else f'{value:g}'}"
                for default, value in first.items()
            )
            found = f"an axis over {of}, on which the default of {leaf.key} depends ({told})"
            yield check.fault(f"sweep.{of}", found, f"it with {leaf.key}, one value or an axis")


def _along(check: Checker) -> Iterator[Fault]:
    """The axis along which the state is carried: one that is swept, over a number."""
    sweep, axes, key = check.resolved["sweep"], check.axes, "sweep.along"
    along, procedure = sweep["along"], sweep["procedure"]
    if along in axes and is_compiled_in(check.model, along):
        others = " or ".join(axis for axis in axes if not is_compiled_in(check.model, axis))
        found = f"{along}, whose values differ in their equations, so that no state is carried from one to another"
        allowed = f"an axis over a number: {f'{others} or another by its key' if others else check.keys.numbers()}"
        yield check.fault(key, found, allowed, None if check.given(key) else ("sweep", along))
    elif along is not None and along not in axes:
        yield check.fault(key, f"{along}, which is not swept", f"a swept axis: {' or '.join(axes)}")
    elif along is None and procedure != "same" and len(axes) > 1:
        found = f"none, with procedure {procedure} and {len(axes)} axes"
        yield check.fault(key, found, f"the axis along which the state is carried: {' or '.join(axes)}")


STARTS = Rule(_starts), Rule(_returns, ("record",))
SWEEP = (Rule(_sweep),)
OF_AXES = Rule(_values), Rule(_refined), Rule(_following), Rule(_along)


def _of_unknown(found: str) -> str:
    """What is said of an axis, of an unknown."""
    for old, new in {"the ": "an uncertain ", "a ": "an uncertain ", "": "the uncertain "}.items():
        if f"an axis over {old}" in found:
            return found.replace(f"an axis over {old}", new, 1)
    return found
