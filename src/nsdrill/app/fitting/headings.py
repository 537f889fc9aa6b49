"""What the columns of a table of measurements are: names of nsdrill, with their units."""

from __future__ import annotations

import difflib
import re
from collections.abc import Mapping, Sequence
from dataclasses import field

import numpy as np

from nsdrill.app.fitting.names import ERROR, PERIOD, RIG_NAMES, TIME, TIMES, Names, models_with, plain
from nsdrill.app.fitting.tables import NULLS, Head, Table, number, on_one_line
from nsdrill.app.fitting.times import kind_of_time
from nsdrill.errors import FileError, count, option
from nsdrill.quantity import SHOWN
from nsdrill.records import dataclass
from nsdrill.units import USUAL, QuantityError, kind_of, rig_unit, to_si

NEAR = 0.72  # likeness from which a name is suggested
SEVERAL = "DIFFERENT ROWS"  # of several wells, taken as of one
LISTED = 8  # names that a message lists


@dataclass(frozen=True)
class Heads:
    """What is said of the heads of a table: ``rename`` maps them to names of nsdrill, ``unit``
    to units, ``ignore`` lists those to skip, ``*`` for all unknown ones, and ``times`` are
    those of the time. ``only`` maps them to what a row has there that is used."""

    rename: Mapping[str, str] = field(default_factory=dict)
    ignore: Sequence[str] = ()
    unit: Mapping[str, str] = field(default_factory=dict)
    times: Sequence[str] = ()
    only: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Column:
    """A column: its place, its heading, its name in nsdrill and its unit in SI
    (``scale``)."""

    place: int
    head: str
    name: str
    scale: float


class Columns:
    """The columns of a ``table`` with what is said of its ``heads``: those that are ``used``,
    whether it is over time (``timed``) and where its times stand (``times``), and what is
    to be told of it (``notes``)."""

    def __init__(self, table: Table, names: Names, heads: Heads) -> None:
        self.table, self.names, self.heads = table, names, heads
        self.notes: list[str] = []
        self._renamed: dict[int, str] = {}
        self._renamed = self._by_place("rename", heads.rename)
        self._units = self._by_place("unit", heads.unit, with_names=True)
        # the period of a log has no column, and can be ignored all the same
        passed = ("*",) if any(plain(one.name) == PERIOD for one in table.heads) else ("*", PERIOD)
        self._ignored = {self._place("ignore", head) for head in heads.ignore if head not in passed}
        self._chosen = [self._place("times", head) for head in heads.times]
        for option_name, places in (("rename", self._renamed), ("times", self._chosen)):
            if both := self._ignored & set(places):
                head = table.heads[both.pop()].name
                raise FileError(
                    f"{table.where}: {option('ignore')}: found {head!r}, which {option(option_name)} names too; "
                    "allowed: one of both."
                )
        self._only = self._by_place("only", heads.only)
        for place, value in self._only.items():
            self._select(place, value)
        self.times = self._times()
        self.timed = bool(self.times)
        self.used = self._used()

    def _place(self, option_name: str, head: str, with_names: bool = False) -> int:
        """The place of the column with this heading; with ``with_names`` also of the one that
        has this name in nsdrill."""
        heads, where = self.table.heads, f"{self.table.where}: {option(option_name)}"
        found = self._places(head)
        if not found and with_names:
            found = [place for place, name in self._renamed.items() if plain(name) == plain(head)]
        if not found:
            texts = dict.fromkeys(one.name for one in heads if one.text)
            near = difflib.get_close_matches(head, texts, n=1, cutoff=NEAR)
            near = near or (self.may_be_time() if option_name == "times" else [])
            hint = f" Did you mean {near[0]!r}?" if near else ""
            raise FileError(f"{where}: found no column {head!r}; allowed: those of the file, {', '.join(texts)}.{hint}")
        if len(found) > 1:
            raise FileError(
                f"{where}: found {count(len(found), 'column')} {head!r}; allowed: one. {option('columns')} names the "
                "columns of a table, also in place of its heads."
            )
        return found[0]

    def _places(self, head: str) -> list[int]:
        """The places of the columns that may be meant by ``head``: those with this text, else
        with this name, else with a name nearly so."""
        heads, head = self.table.heads, on_one_line(head)
        tests = (
            lambda one: one.text == head,
            lambda one: head in one.names,
            lambda one: plain(head) in map(plain, one.names),
        )
        found: list[int] = []
        for test in tests:
            found = found or [place for place, one in enumerate(heads) if head and test(one)]
        return found

    def _by_place(self, option_name: str, given: Mapping[str, str], with_names: bool = False) -> dict[int, str]:
        """What is ``given`` by heads, by the places of their columns. A command divides
        HEAD=VALUE at the first equals sign, which may be one of the head."""
        found = {}
        for head, value in given.items():
            parts = f"{head}={value}".split("=")
            cuts = [("=".join(parts[:n]).strip(), "=".join(parts[n:]).strip()) for n in range(1, len(parts))]
            known = (cut for cut in [(head, str(value)), *cuts] if self._places(cut[0]))
            head, value = next(known, (head, value))
            found[self._place(option_name, head, with_names)] = value
        return found

    def called(self, place: int) -> str:
        """How options name a column: by its name, where no other has it, else by its head with
        its unit."""
        head = self.table.heads[place]
        return head.name if self._places(head.name) == [place] else head.text

    def _select(self, place: int, value: str) -> None:
        """Keep the rows of the table that have ``value`` in a column."""
        cells, name, wanted = self.table.cells[place], self.table.heads[place].name, str(value).strip()
        same = number(wanted)
        kept = np.array([cell == wanted or (same is not None and number(cell) == same) for cell in cells])
        if not kept.any():
            there = list(dict.fromkeys(cells))
            more = f" and {len(there) - LISTED} more" if len(there) > LISTED else ""
            raise FileError(
                f"{self.table.where}: {option('only')}: found no row with {name} {wanted!r}; allowed: those of the "
                f"file, {', '.join(there[:LISTED])}{more}."
            )
        self.notes.append(f"only the rows with {name} {wanted}: {np.count_nonzero(kept)} of {len(cells)}")
        self.table = self.table.only(kept)

    def _tells_apart(self, place: int) -> str:
        """A warning where a column of words that is not used has several, each of several
        rows, as the name of a well; empty where it has not."""
        cells = [cell for cell in self.table.cells[place] if cell.lower() not in NULLS]
        if any(number(cell) is not None or kind_of_time(cell) for cell in cells):
            return ""
        values = list(dict.fromkeys(cells))
        if len(values) < 2 or 2 * len(values) > len(cells) or 2 * len(cells) < len(self.table.lines):
            return ""
        name, more = self.table.heads[place].name, f" and {len(values) - LISTED} more" if len(values) > LISTED else ""
        return (
            f"{SEVERAL}: {name}, which is ignored, is {', '.join(values[:LISTED])}{more}, and all rows are taken "
            f"as of one string; {option('only', (self.called(place), values[0]))} takes those of one"
        )

    def _name(self, place: int, timed: bool) -> str:
        """The name in nsdrill of a column: what it was renamed to, else what is known of what
        its head may mean, else its head."""
        if place in self._renamed:
            return plain(Head.of(self._renamed[place]).name)
        candidates = [plain(name) for name in self.table.heads[place].names]
        known = [name for name in candidates if self.names.units(name, timed) is not None]
        return (known or [plain(self.table.heads[place].name)])[0]

    def _times(self) -> list[int]:
        """The places of the time: one, or that of the date and that of the time of day."""
        if self._chosen:
            return self._chosen
        heads, free = self.table.heads, [i for i in range(len(self.table.heads)) if i not in self._ignored]
        kinds = {i: kind for i in free if (kind := self._kind(i)) and i not in self._renamed}
        named = [i for i in free if self._name(i, True) == TIME]
        if not named and any(self._name(i, False).removesuffix(ERROR) in self.names.results for i in free):
            return []  # a table over operating points, which may have dates
        numeric = [i for i in free if {plain(name) for name in heads[i].names} & TIMES and i not in self._renamed]
        by_kind = {kind: [i for i in kinds if kinds[i] == kind] for kind in ("both", "clock", "date")}
        first = named or by_kind["both"] or by_kind["clock"] or [i for i in numeric if i not in kinds]
        if len(first) > 1:
            listed = " or ".join(option("times", self.called(i)) for i in first)
            raise FileError(f"{self.table.where}: found {count(len(first), 'column')} of time; allowed: one: {listed}.")
        if first and self._kind(first[0]) == "clock" and len(by_kind["date"]) == 1:
            return [by_kind["date"][0], first[0]]
        return first

    def may_be_time(self) -> list[str]:
        """The columns of a table without a time that may be it, as options name them: those in a
        unit of time, and those that are named nearly so."""
        return [
            self.called(place)
            for place, head in enumerate(self.table.heads)
            if rig_unit(head.unit or head.below or "", "s")
            or difflib.get_close_matches(plain(head.name), TIMES, n=1, cutoff=NEAR)
        ]

    def _kind(self, place: int) -> str | None:
        """The kind of time that a column has, of most of its first cells."""
        cells = [cell for cell in self.table.cells[place][:50] if cell][:20]
        kinds = [kind_of_time(cell) for cell in cells]
        found = max(set(kinds), key=kinds.count) if kinds else None
        return found if found and kinds.count(found) > 0.5 * len(kinds) else None

    def _used(self) -> list[Column]:
        """The columns that are used, beside those of the time."""
        table, names, timed = self.table, self.names, self.timed
        passed = "*" in self.heads.ignore
        named: dict[int, str] = {}
        places, unknown = sorted(self._ignored), []
        for place, head in enumerate(table.heads):
            if place in self._ignored or place in self.times:
                continue
            name = self._name(place, timed)
            if (name == TIME and timed) or names.units(name, timed) is None:
                if head.text == "" and place not in self._renamed:
                    continue
                if place in self._only:
                    continue
                if passed and place not in self._renamed:
                    places.append(place)
                else:
                    unknown.append(place)
                continue
            if name in named.values():
                other, this = self.called(next(i for i, one in named.items() if one == name)), self.called(place)
                remedy = f"{option('ignore', this)} passes over one."
                if self._places(this) != [place]:
                    remedy = f"{option('columns')} names the columns of a table, also in place of its heads."
                found = f"found two columns of {name}, {other!r} and {this!r}"
                raise FileError(f"{table.where}: {found}; allowed: one of each. {remedy}")
            named[place] = name
        if unknown:
            raise FileError(self._unknown(unknown))
        if ignored := [table.heads[place].name for place in places]:
            self.notes.append(f"ignored: {', '.join(ignored)}{self._would_be(ignored, named)}")
        self.notes += [said for place in places if place not in self._only and (said := self._tells_apart(place))]
        scales = self._scales(named)
        return [Column(place, table.heads[place].name, name, scales[place]) for place, name in named.items()]

    def _would_be(self, ignored: Sequence[str], named: Mapping[int, str]) -> str:
        """Which of the columns that ``*`` passes over have a name of rigs for something that
        is not in the table."""
        places = [i for i, one in enumerate(self.table.heads) if one.name in ignored and i not in self._ignored]
        options = [
            option("rename", (self.called(i), name))
            for i in places
            if (name := self.rig(i)) and name not in named.values()
        ]
        return f"; to use {'it' if len(options) == 1 else 'them'}: {_together(options)}" if options else ""

    def rig(self, place: int) -> str | None:
        """What a head is called here, where it is a name that rigs use."""
        for name in map(plain, self.table.heads[place].names):
            usual = RIG_NAMES.get(name, ())[self.timed :][:1]
            if usual and self.names.units(usual[0], self.timed) is not None:
                return usual[0]
        return None

    def _scales(self, named: Mapping[int, str]) -> dict[int, float]:
        """The SI values of one unit of each column; FileError where there is no unit, one of
        another quantity, or two."""
        scales: dict[int, float] = {}
        without: dict[int, str] = {}
        for place, name in named.items():
            si = self.names.units(name, self.timed) or ""
            unit = self.unit_of(place, si)
            if not unit and si not in ("", "percent"):
                without[place] = si
            else:
                scales[place] = self._scale(place, unit, si, name)
        if len(self.times) == 1 and self._kind(self.times[0]) is None and not self.unit_of(self.times[0], "s"):
            without = {self.times[0]: "s"} | without
        if without:
            heads = [self.table.heads[place] for place in without]
            if len(heads) == 1:
                (si,) = without.values()
                name = heads[0].name
                raise FileError(
                    f"{self.table.where}: {name}: found no unit; allowed: {name} [{SHOWN.get(si, (si, si))[1]}] or "
                    f"another unit of {kind_of(si)} in brackets, or in a second line. "
                    f"{option('unit', (self.called(next(iter(without))), 'UNIT'))} says it."
                )
            listed = " ".join(option("unit", (self.called(place), "UNIT")) for place in without)
            usual = "; ".join(
                f"{one.name}: {', '.join(USUAL.get(si, (si,)))}"
                for one, si in zip(heads, without.values(), strict=True)
            )
            raise FileError(
                f"{self.table.where}: found no unit of {', '.join(one.name for one in heads)}; allowed: one in "
                f"brackets behind each name, in a second line, or {listed} ({usual})."
            )
        return scales

    def unit_of(self, place: int, si: str) -> str | None:
        """The unit of a column with SI units ``si``: the one of the options, in the head, or
        below it."""
        head = self.table.heads[place]
        renamed = Head.of(self._renamed[place]).unit if place in self._renamed else None
        if given := self._units.get(place, renamed):
            if head.unit and head.unit != given:
                self.notes.append(f"{head.name}: the unit is {given}, and not {head.unit} of its head")
            return given
        if head.unit and head.below and head.unit != head.below:
            one, two = (rig_unit(unit, si) for unit in (head.unit, head.below))
            if one is None or two is None or one[0] != two[0]:
                raise FileError(
                    f"{self.table.where}: {head.name}: found two units, {head.unit} in the head and {head.below} in "
                    f"the line below; allowed: one. {option('unit', (self.called(place), head.unit))} says which."
                )
        return head.unit or head.below or next((unit for _, unit in head.guesses if rig_unit(unit, si)), None)

    def _scale(self, place: int, unit: str | None, si: str, name: str) -> float:
        """The SI value of one ``unit``. Fractions may be in percent, and percentages may be
        fractions."""
        where, head = self.table.where, self.table.heads[place].name or name
        text = (unit or "").strip().replace("%", "percent")
        if si in ("", "percent"):
            factors = {"": 1.0, "1": 1.0, "-": 1.0, "percent": 0.01} if si == "" else {"percent": 1.0, "1": 100.0}
            if text not in factors:
                found = f"the unit {unit!r}" if unit else "no unit"
                allowed = "none, or percent" if si == "" else "percent, or 1 for a part of one"
                raise FileError(f"{where}: {head}: found {found}; allowed: {allowed}.")
            return factors[text]
        if (found_unit := rig_unit(text, si)) is not None:
            scale, written = found_unit
            if (
                re.search(r"lbs?\b(?!f)|1 */ *min|^min", text, re.IGNORECASE)
                and written != text
                and "lbf" not in text.lower()
            ):
                self.notes.append(f"{head}: {text} is read as {written}")
            return scale
        try:
            return to_si(f"1 {text}", si)
        except QuantityError as error:
            meant = {"t": "tonne_force", "kg": "kgf", "ton": "tonne_force"}.get(text.lower())
            says = option("unit", (self.called(place), meant)) if meant and si == "N" else ""
            remedy = f" {says} says that a force is meant." if says else ""
            raise FileError(f"{where}: {head}: {unit_words(error)}{remedy}") from error

    def _unknown(self, places: Sequence[int]) -> str:
        """The message for columns that are not known."""
        table, names, timed = self.table, self.names, self.timed
        known, clocks = [TIME, *names.known(timed)], [] if timed else self.may_be_time()
        hints, renames, others = [], [], []
        for place in places:
            head, name = table.heads[place], self._name(place, timed)
            was_renamed = place in self._renamed
            usual = None if was_renamed else self.rig(place)
            models = models_with(name)
            elsewhere = (
                bool(models) and names.keys.model.name not in models
            )  # it means something else than what is near
            near = [usual] if usual else difflib.get_close_matches(name, known, n=3, cutoff=NEAR)
            if elsewhere:
                near = []
            elif not usual:
                of_runs = names.signals if timed else names.results
                longer = [one for one in of_runs if len(name) > 3 and one.startswith(f"{name}_") and one not in near]
                near += longer[: 3 - len(near)]
            near = near or [TIME] * (self.called(place) in clocks)
            if near:
                hints.append(f"Did you mean {' or '.join(near)}?" if len(places) == 1 else "")
                renames.append(option("rename", (self.called(place), near[0])))
            else:
                others.append(head)
            if elsewhere:
                subject = "It" if len(places) == 1 else name
                hints.append(f"{subject} is one of the model {' and of '.join(models)}; the study has another.")
            if not timed and name in names.signals:
                hints.append(f"{name} by itself is a signal over time, which needs a column time.")
        what = "signals over time" if timed else "features and severities of a run"
        examples = ", ".join(list(names.signals if timed else names.results)[:LISTED])
        settings = " or ".join(filter(None, (", ".join(names.keys.operated), "a key of the study")))
        allowed = f"Allowed: time, settings ({settings}) and {what} ({examples}, ...)."
        hint = "".join(f" {one}" for one in dict.fromkeys(hints) if one)
        if len(places) == 1:
            text = self.called(places[0])
            remedy = f"{(renames or [option('rename', (text, 'NAME'))])[0]} says what it is"
            if places[0] in self._renamed:
                found = f"{option('rename')}: found the name {self._renamed[places[0]]!r} for {text!r}"
                return f"{table.where}: {found}, which is not known.{hint} {allowed} {remedy}."
            passing = f"{option('ignore', text)} passes over it, {option('ignore', '*')} over all that are not known"
            found = f"found the column {text!r}"
            return f"{table.where}: {found}, which is not known.{hint} {allowed} {remedy}, {passing}."
        listed = ", ".join(repr(table.heads[place].name) for place in places[:LISTED])
        more = f" and {len(places) - LISTED} more" if len(places) > LISTED else ""
        remedies = f" To say what they are: {_together(renames)}." if renames else ""
        if others:
            which = "those that are not known" if len(others) > 1 or renames else "them"
            remedies += f" {option('ignore', '*')} passes over {which}."
        return f"{table.where}: found columns that are not known: {listed}{more}.{hint} {allowed}{remedies}"


def _together(options: Sequence[str]) -> str:
    """Several options of one kind, to be pasted: on the command line one behind the other, in
    Python one mapping."""
    if all(one.startswith("rename={") for one in options):
        return f"rename={{{', '.join(one[len('rename={') : -1] for one in options)}}}"
    return " ".join(options)


def unit_words(error: QuantityError) -> str:
    """The message of an ``error`` in a unit, which was read as a quantity of one of it."""
    found, allowed = error.found.replace("'1 ", "'", 1), error.allowed.replace("a number with its unit", "a unit", 1)
    return f"found {found}; allowed: {allowed}.{f' {error.suggestion}' if error.suggestion else ''}"
