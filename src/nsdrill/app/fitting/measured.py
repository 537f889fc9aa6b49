"""Measurements of a well, from a table as rigs export it: CSV with a name and a unit
for every column.

There are two forms. In a table over *operating points* a row is one setting (``wob``,
``rotary_speed``, ``depth`` or any key of the study) with the features and severities
measured there. In a table over *time*, with a column of time, the columns are signals.
Rows with constant settings form a stretch, and every stretch is an operating point
whose features follow from its signals: ``surface_torque`` gives surface_torque_mean,
surface_torque_min and surface_torque_max.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from functools import partial

import numpy as np

from nsdrill.analysis.fitting import Array, Measured
from nsdrill.app.check import shortest_period
from nsdrill.app.fitting.deviations import assumed_errors, given_errors, words_of_assumed, words_of_repeated
from nsdrill.app.fitting.headings import Column, Columns, Heads, unit_words
from nsdrill.app.fitting.logged import of_stretches
from nsdrill.app.fitting.names import CHANGE, ERROR, MEAN, Names
from nsdrill.app.fitting.sensors import contradictions, faults
from nsdrill.app.fitting.stretches import Unusable, longest_part, stretches_of
from nsdrill.app.fitting.tables import Table, is_gap, read_table
from nsdrill.app.fitting.times import kind_of_time, seconds
from nsdrill.errors import FileError, Refusal, StudyError, count, option
from nsdrill.quantity import quantity
from nsdrill.ranges import range_text
from nsdrill.records import dataclass
from nsdrill.study.load import parse_study
from nsdrill.study.study import Study
from nsdrill.study.write import study_text
from nsdrill.units import QuantityError, rig_unit, to_si
from nsdrill.variables import long_key

SLOWEST = 2.0  # s between samples, beyond which extremes are missed
NOISE = 0.1  # of a value: extremes that are further in the wrong order are refused
MIDDLE = (0.05, 0.95)  # quantiles of the middle of a signal
FAR = 3.0  # widths of the middle of a signal beyond it, from which a value may be a fault of a sensor
MOST_KNOTS = 20_000  # of the ramp of a log


@dataclass(frozen=True)
class Reading:
    """Options for reading a table.

    ``rename`` maps headings of the file to names of nsdrill; ``ignore`` lists headings
    to skip, ``*`` for all unknown ones; ``errors`` maps names to standard deviations,
    as texts (``0.5 kft*lbf``, ``10 percent``) or as numbers in SI; ``gaps`` says
    whether rows with gaps are skipped. In a table over time a stretch lasts at least
    ``shortest`` [s], and its first ``settle`` [s] are not used. ``only`` maps headings to
    what a row that is used has there. ``unit`` maps headings to
    units, ``times`` are the headings of the time, and ``columns`` those of a table without
    any. ``surface_torque`` says whether that of the string was logged, or that of the
    motor."""

    rename: Mapping[str, str] = field(default_factory=dict)
    ignore: Sequence[str] = ()
    errors: Mapping[str, str | float] = field(default_factory=dict)
    gaps: bool = False
    shortest: float = 120.0
    settle: float = 60.0
    unit: Mapping[str, str] = field(default_factory=dict)
    times: Sequence[str] = ()
    columns: str | Sequence[str] = ()
    surface_torque: str = "string"
    only: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("shortest", "settle"):
            if not (seconds := getattr(self, name)) >= 0.0:
                raise Refusal(name, f"{seconds:g} s", "at least 0 s")

    @property
    def heads(self) -> Heads:
        return Heads(self.rename, self.ignore, self.unit, self.times, self.only)


def read_measured(path: str | os.PathLike[str], study: Study, options: Reading | None = None) -> Measured:
    """The measurements in the CSV file ``path``, for comparison with runs of ``study``;
    FileError, with the line, where a cell or a column is invalid."""
    options = options or Reading()
    table = read_table(str(path), options.columns)
    reader = _Reader(table, study, options)
    return reader.over_time() if reader.columns.timed else reader.over_points()


def ramps_in(path: str | os.PathLike[str], study: Study, options: Reading) -> tuple[dict[str, str], list[str], float]:
    """The settings of the log ``path`` over its longest part without an interruption, as texts
    of ramps by the keys of ``study``, what is to be told, and how long that part is [s].
    FileError where it has none."""
    table = read_table(str(path), options.columns)
    return _Reader(table, study, options).ramps()


class _Reader:
    """What reads a ``table``: its ``columns`` and what is to be told (``notes``)."""

    def __init__(self, table: Table, study: Study, options: Reading) -> None:
        names = Names.of(study)
        self.table, self.study, self.names, self.options = table, study, names, options
        self.path = table.path
        self.columns = Columns(table, names, options.heads)
        self.table = self.columns.table
        self.notes = [*table.notes, *self.columns.notes]
        if table.separator == "," and table.with_commas:
            self.notes.append("numbers in quotes are read with decimal commas")

    # Over operating points

    def over_points(self) -> Measured:
        """The measurements of a table whose rows are operating points."""
        columns, names = self.columns.used, self.names
        at, table = self.numbers(columns)
        self.check_values(columns, table, at)
        self.check_order(table, at)
        given = {column.name for column in columns}
        settings = {names.settings[name]: table[name] for name in table if name in names.settings}
        values = {name: table[name] for name in names.results if name in given}
        if not values:
            raise FileError(f"{self.table.where}: found no measured value; allowed: {names.some_results()}.")
        if self.options.surface_torque == "motor" and any(names.signal(one) == "surface_torque" for one in values):
            raise Refusal(
                "surface_torque",
                "motor with a table over operating points",
                "with a log over time, which has the speed",
            )
        self.check_settings(settings, at)
        errors = {name: table[name + ERROR] for name in values if name + ERROR in given}
        for name, error in errors.items():
            if np.any(bad := np.isfinite(values[name]) & ~(error > 0)):
                raise FileError(
                    f"{self.path}, line {at[int(np.argmax(bad))]}: {name + ERROR}: found an error of 0 or less, or "
                    "none beside a value; allowed: one above 0."
                )
        return self.with_errors(settings, values, errors, [f"line {line}" for line in at])

    def numbers(self, columns: list[Column]) -> tuple[Array, dict[str, Array]]:
        """The lines of the rows that are used, and the columns in SI, by name."""
        table, rows = self.table, len(self.table.lines)
        self.check_cells(np.ones(rows, dtype=bool))
        with np.errstate(over="ignore"):
            values = {column.name: table.numbers(column.place).values * column.scale for column in columns}
        lacking = {name: np.isnan(column) for name, column in values.items()}
        measured = [lacking[name] for name in values if name in self.names.results]
        others = [lacking[name] for name in values if name not in self.names.results and not name.endswith(ERROR)]
        gaps = np.any(list(lacking.values()), axis=0) if lacking else np.zeros(rows, dtype=bool)
        if gaps.any() and not self.options.gaps:
            row = int(np.argmax(gaps))
            head = next(column.head for column in columns if lacking[column.name][row])
            raise FileError(
                f"{self.path}, line {table.lines[row]}: {head}: found a gap; allowed: a number. {option('skip_gaps')} "
                "passes over rows with gaps, and of operating points over the values that are not there."
            )
        left_out = np.zeros(rows, dtype=bool)
        for one in others:
            left_out |= one
        if measured:
            left_out |= np.all(measured, axis=0)
        if left_out.any():
            self.notes.append(f"{left_out.sum()} of {count(rows, 'row')} left out: with gaps")
        if some := int((gaps & ~left_out).sum()):
            self.notes.append(f"in {some} of {count(rows, 'row')} some values are not measured")
        if left_out.all():
            raise FileError(
                f"{self.path}: found no row of numbers{' without gaps' if gaps.any() else ''}; allowed: at least one."
            )
        return table.lines[~left_out], {name: column[~left_out] for name, column in values.items()}

    def check_cells(self, rows: Array) -> None:
        """FileError for the first cell among ``rows`` (a mask) that is no number, or that has
        no column."""
        table = self.table
        if (long := table.long & rows).any():
            raise FileError(f"{self.path}, line {table.lines[np.argmax(long)]}: {self.too_long(int(np.argmax(long)))}")
        for column in self.columns.used:
            if (wrong := table.numbers(column.place).wrong & rows).any():
                row = int(np.argmax(wrong))
                raise FileError(f"{self.path}, line {table.lines[row]}: {self.no_number(column, row)}")

    def too_long(self, row: int) -> str:
        width = len(self.table.heads)
        return (
            f"found {count(int(self.table.widths[row]), 'cell')} under {count(width, 'column')}; allowed: a cell for "
            "each column. Write a decimal point in place of a comma and no thousands separators, or separate the "
            "columns by semicolons."
        )

    def no_number(self, column: Column, row: int) -> str:
        cell = self.table.cells[column.place][row]
        hint = " Write a decimal point and no thousands separators." if "," in cell else ""
        return f"{column.head}: found {cell!r}; allowed: a number.{hint}"

    def check_settings(self, settings: dict[str, Array], lines: Array) -> None:
        """FileError where a setting lies outside the range of its key."""
        for key, values in settings.items():
            if (bad := self.outside(key, values)).any():
                row = int(np.argmax(bad))
                raise FileError(
                    f"{self.path}, line {lines[row]}: {self.setting(key, values[row])}; allowed: "
                    f"{self.names.keys.axes[key].range()}. Is the unit in the head right?"
                )

    def outside(self, key: str, values: Array) -> Array:
        """Which ``values`` of a setting are outside its range."""
        leaf = self.names.keys.axes[key]
        return np.asarray(~((values >= leaf.low) & (values <= leaf.high)))

    def setting(self, key: str, value: float) -> str:
        return f"{key}: found {self.names.keys.axes[key].text(float(f'{value:.6g}'))}"

    def check_values(self, columns: list[Column], table: dict[str, Array], lines: Array) -> None:
        """FileError where a measured value is impossible."""
        for column in columns:
            if column.name in self.names.settings:
                continue
            if (bad := self.impossible(column.name, table[column.name])).any():
                row = int(np.argmax(bad))
                found = self.in_words(column.name, table[column.name][row])
                where = f"{self.path}, line {lines[row]}: {column.head}"
                allowed = f"{self.allowed(column.name)}. Is the unit in the head right?"
                raise FileError(f"{where}: found {found}; allowed: {allowed}")

    def check_order(self, table: dict[str, Array], lines: Array) -> None:
        """FileError where a least value is above the mean or the greatest of its signal, by
        more than the noise of either explains."""
        for low, high in ((low, high) for low in table for high in table if low != high):
            signal, _, end = low.rpartition("_")
            above = {"min": ("mean", "max"), "mean": ("max",)}.get(end, ())
            if high not in [f"{signal}_{one}" for one in above]:
                continue
            size = np.maximum(np.abs(table[low]), np.abs(table[high]))
            if (bad := np.flatnonzero(table[low] > table[high] + NOISE * size)).size:
                raise FileError(
                    f"{self.path}, line {lines[bad[0]]}: {low}: found {table[low][bad[0]]:.6g}, above {high}, "
                    f"{table[high][bad[0]]:.6g} (SI); allowed: at most that. Are the columns exchanged?"
                )

    def impossible(self, name: str, values: Array) -> Array:
        """Which ``values`` of a result or a signal are beyond its bounds."""
        low, high = self.names.bounds(name)
        return np.asarray(~np.isnan(values) & ~((values >= low) & (values <= high)))

    def in_words(self, name: str, value: float) -> str:
        return f"{value:.6g} {self.names.units(name, self.columns.timed) or ''}".rstrip()

    def allowed(self, name: str) -> str:
        return f"{range_text(*self.names.bounds(name))} {self.names.units(name, self.columns.timed) or ''}".rstrip()

    # Over time

    def over_time(self) -> Measured:
        """The features of the stretches in which the settings are constant."""
        names, options = self.names, self.options
        used = self.columns.used
        signals_used = [column.name for column in used if column.name not in names.settings]
        if not signals_used:
            raise FileError(
                f"{self.path}: found no signal ({', '.join(names.signals)}) beside the time; allowed: at least one."
                f"{self.ignored_words()}"
            )
        time, table, unusable = self.usable()
        good = ~unusable.bad
        if good.sum() < 2:
            raise FileError(
                f"{self.path}: found no two rows that can be used, of {len(good)}; allowed: more."
                f"{''.join(f' {note}.' for note in (*unusable.notes, unusable.told()) if note)}"
            )
        lines, time = self.table.lines[good], time[good]
        table = {name: values[good] for name, values in table.items()}
        settings = {names.settings[name]: table[name] for name in table if name in names.settings}
        signals = {name: table[name] for name in signals_used}
        step = float(np.median(steps)) if (steps := np.diff(time)[np.diff(time) > 0.0]).size else math.inf
        coarse = step > SLOWEST
        found = stretches_of(
            self.path, time, settings, lines, unusable, shortest=options.shortest, settle=options.settle
        )
        kept = found.kept
        self.notes += found.notes
        if coarse:
            self.notes.append(f"a sample every {step:g} s: only means are used, as extremes are missed")
        if "surface_torque" in signals:
            signals["surface_torque"] = self.torque_of_string(time, table, kept)
        points = {key: np.array([values[a:b].mean() for a, b in kept]) for key, values in settings.items()}
        features: dict[str, Array] = {}
        for name, values in signals.items():
            parts = [values[a:b] for a, b in kept]
            means, low, high = (
                np.array([statistic(part) for part in parts]) for statistic in (np.mean, np.min, np.max)
            )
            statistics = {f"{name}{MEAN}": means}
            if not coarse:
                statistics |= {f"{name}_min": low, f"{name}_max": high}
                statistics |= {f"{name}{CHANGE}_min": low - means, f"{name}{CHANGE}_max": high - means}
            features |= {full: one for full, one in statistics.items() if full in names.results}
        for name, values in signals.items():
            self.tell_outliers(name, values, lines, kept)
            if not coarse:
                self.notes += faults(name, time, values, kept, SLOWEST, partial(self.in_words, name))
        shortest = shortest_period(self.study, points)
        more, told = of_stretches(time, signals, settings, kept, options.ignore, shortest)
        features |= {name: values for name, values in more.items() if name in names.results}
        self.notes += told
        if not features:
            if coarse and signals:
                seen = f"{', '.join(signals)} with a sample every {step:g} s, which misses extremes"
                raise FileError(
                    f"{self.path}: found {seen}, and no mean of it in the model {names.keys.model.name}; allowed: a "
                    f"sample every {SLOWEST:g} s or more often."
                )
            raise FileError(f"{self.path}: found signals of which no feature follows; allowed: others.")
        where = [f"lines {lines[a]} to {lines[b - 1]} ({time[a]:g} to {time[b - 1]:g} s)" for a, b in kept]
        return self.with_errors(points, features, {}, where)

    def tell_outliers(self, name: str, values: Array, lines: Array, kept: Sequence[tuple[int, int]]) -> None:
        """A note where a signal has values far outside all others of their stretch, which
        least and greatest values and their errors follow from."""
        rows = [row for a, b in kept for row in (a + outliers(values[a:b])).tolist()]
        if rows:
            known = np.concatenate([values[a:b] for a, b in kept])
            low, high = (float(one) for one in np.quantile(known, MIDDLE))
            self.notes.append(
                f"FAR OUTSIDE: {name} has {count(len(rows), 'value')} far from all others (line {lines[rows[0]]}: "
                f"{self.in_words(name, values[rows[0]])}; most are {low:.4g} to {high:.4g}). The features "
                f"follow from them all; where that is a fault, empty the cell and give {option('skip_gaps')}"
            )

    def ramps(self) -> tuple[dict[str, str], list[str], float]:
        """The settings over the longest part without an interruption, as texts of ramps, what
        is to be told, and how long that part is [s]."""
        if not self.columns.timed:
            maybe = self.columns.may_be_time()
            hint = f" {option('times', maybe[0])} says that {maybe[0]} is it." if maybe else ""
            raise FileError(f"{self.table.where}: found no time; allowed: a log, with a column of time.{hint}")
        operated = self.names.study.operation.names()
        settings = [column.name for column in self.columns.used if self.names.settings.get(column.name) in operated]
        if not operated:
            model = self.names.keys.model.name
            raise FileError(
                f"{self.path}: found the model {model}, which has no operating value that could vary in time."
            )
        if not settings:
            *first, last = operated
            found = f"{self.path}: found no {' or '.join(filter(None, (', '.join(first), last)))} beside the time; "
            raise FileError(f"{found}allowed: one or more.{self.ignored_words()}")
        time, table, unusable = self.usable()
        good = ~unusable.bad
        lines, time = self.table.lines[good], time[good]
        begin, end = longest_part(time, lines, unusable) if len(time) else (0, 0)
        if end - begin < 2:
            why = "".join(f" {note}." for note in (*unusable.notes, unusable.told()) if note)
            raise FileError(f"{self.path}: found no two rows in sequence that can be used; allowed: more.{why}")
        notes = [
            f"lines {lines[begin]} to {lines[end - 1]} are followed, {time[end - 1] - time[begin]:g} s",
            *unusable.notes,
        ]
        if unusable.reasons:
            notes.append(f"{count(int(unusable.bad.sum()), 'row')} not drilling or not usable: {unusable.told()}")
        since = time[begin:end] - time[begin]
        ramps: dict[str, str] = {}
        for name in settings:
            values, key = table[name][good][begin:end], self.names.settings[name]
            steady = np.ptp(values) == 0.0
            # a run lasts until its last knot: where nothing varies, one ramp has the length of the log
            lasts = (
                steady and name == settings[0] and all(np.ptp(table[one][good][begin:end]) == 0.0 for one in settings)
            )
            knots = [0, len(values) - 1] if lasts else _corners(values)
            if len(knots) > MOST_KNOTS:
                found = f"{self.path}: {name}: found {len(knots)} knots"
                raise FileError(f"{found}; allowed: at most {MOST_KNOTS}. Take a part of the log.")
            leaf = self.names.keys.axes[key]
            if steady and not lasts:
                ramps[f"operation.{key}"] = leaf.text(float(values[0]))
            else:
                pairs = (f"[{since[i]:.9g} s, {leaf.text(float(values[i]))}]" for i in knots)
                ramps[f"operation.{key}"] = f"{{ramp: [{', '.join(pairs)}]}}"
        read = [note for note in self.notes if not note.startswith("ignored: ")]  # signals, which no ramp needs
        return ramps, [*self.unused_settings(settings), *read, *notes], float(since[-1])

    def unused_settings(self, settings: list[str]) -> list[str]:
        """The settings beside these that the log may have under heads that are not known, and
        which so stay those of the study."""
        used = {column.place for column in self.columns.used} | set(self.columns.times)
        found = []
        for name in self.names.study.operation.names():
            si = self.names.units(name, True)
            if name in settings or si is None:
                continue
            heads = [
                self.columns.called(place)
                for place in range(len(self.table.heads))
                if place not in used
                and (self.columns.rig(place) == name or rig_unit(self.columns.unit_of(place, si) or "", si))
            ]
            if heads:
                found.append(
                    f"NOT FOLLOWED: {', '.join(heads)}. {name} is that of the study; "
                    f"{option('rename', (heads[0], name))} follows it"
                )
        return found

    def ignored_words(self) -> str:
        """What was ignored, as it may be what is needed."""
        ignored = next((note for note in self.columns.notes if note.startswith("ignored: ")), "")
        return f" I{ignored[1:]}." if ignored else ""

    def usable(self) -> tuple[Array, dict[str, Array], Unusable]:
        """The time [s] of all rows, the columns in SI by name, and the rows that cannot be
        used. Rows with gaps are left out before where options say so."""
        self.reversed_where_it_falls()
        table = self.table
        time, wrong_time = self.times()
        unusable = Unusable(table.lines, time)
        gap = np.zeros(len(time), dtype=bool)
        values: dict[str, Array] = {}
        wrong: list[tuple[Column, Array]] = []
        for column in self.columns.used:
            numbers = table.numbers(column.place)
            with np.errstate(over="ignore"):
                values[column.name] = numbers.values * column.scale
            wrong.append((column, numbers.wrong))
            gap |= np.isnan(values[column.name]) & ~numbers.wrong
        gap |= wrong_time & np.array([is_gap(self.time_cell(row)) for row in range(len(time))], dtype=bool)
        unusable.gaps = bool(gap.any())
        if self.options.gaps and gap.any():
            left = ~gap
            skipped = f"{np.count_nonzero(~left)} of {count(len(left), 'row')} left out: with gaps"
            self.table = table = table.only(left)
            time = time[left]
            unusable = Unusable(table.lines, time, [skipped])
            values = {name: column[left] for name, column in values.items()}
            wrong = [(column, cells[left]) for column, cells in wrong]
            wrong_time = wrong_time[left]
        unusable.add(table.long, "with too many cells", self.too_long)
        unusable.add(wrong_time, "without a time", lambda row: repr(self.time_cell(row)))
        for column, cells in wrong:
            unusable.add(cells, f"with no number in {column.head}", partial(self.no_number, column))
        for column in self.columns.used:
            unusable.add(np.isnan(values[column.name]), f"with a gap in {column.head}")
        for column in self.columns.used:
            self.leave_out_impossible(unusable, column, values[column.name])
        good = np.flatnonzero(~unusable.bad)
        equal = np.zeros(len(time), dtype=bool)
        equal[good[1:][np.diff(time[good]) == 0.0]] = True
        unusable.add(equal, "with the time of the row before", lambda row: f"{time[row]:g} s")
        good = np.flatnonzero(~unusable.bad)
        if (back := good[1:][np.diff(time[good]) < 0.0]).size:
            before = good[np.searchsorted(good, back[0]) - 1]
            unusable.notes.append(
                f"the time goes back in {count(back.size, 'row')} (line {table.lines[back[0]]}: {time[back[0]]:g} s "
                f"after {time[before]:g} s), where a stretch ends"
            )
        return time, values, unusable

    def leave_out_impossible(self, unusable: Unusable, column: Column, values: Array) -> None:
        """Leave out the rows with a value of a column that no run can have."""
        if (key := self.names.settings.get(column.name)) is None:
            unusable.add(
                self.impossible(column.name, values),
                f"with an impossible {column.head}",
                lambda row: (
                    f"found {self.in_words(column.name, values[row])}; allowed: {self.allowed(column.name)}; is the "
                    "unit right?"
                ),
            )
            return
        outside, low = self.outside(key, values), self.names.keys.axes[key].low
        below = outside & (values <= max(low, 0.0))
        what = f"with {key} {'below 0' if low <= 0.0 else 'of 0 or less'}"
        unusable.add(below, what, lambda row: self.setting(key, values[row]))
        unusable.add(
            outside, f"with an impossible {key}", lambda row: f"{self.setting(key, values[row])}; is the unit right?"
        )

    def reversed_where_it_falls(self) -> None:
        """A log with the latest row first is read from its end."""
        time, _ = self.times(noted=False)
        steps = np.diff(time[np.isfinite(time)])
        if len(steps) > 1 and np.count_nonzero(steps < 0.0) > 0.9 * len(steps):
            self.table = self.table.only(np.arange(len(time))[::-1])
            self.notes.append("the latest row is the first of the file: read from its end")

    def time_cell(self, row: int) -> str:
        return " ".join(self.table.cells[place][row] for place in self.columns.times)

    def times(self, noted: bool = True) -> tuple[Array, Array]:
        """The time [s] of the rows, and which have none."""
        table, places = self.table, self.columns.times
        heads = " and ".join(table.heads[place].name for place in places)
        if len(places) > 2:
            raise FileError(
                f"{table.where}: found {len(places)} columns of time; allowed: one, or a date and a time of day."
            )
        cells = table.cells[places[0]]
        if len(places) == 1 and not any(kind_of_time(cell) for cell in cells[:50]):
            numbers, head = table.numbers(places[0]), table.heads[places[0]]
            if not np.isfinite(numbers.values).any():
                found = next((cell for cell in cells if cell), "")
                raise FileError(
                    f"{table.where}: {head.name}: found {found!r} first; allowed: a number with its unit, a time of "
                    "day (23:58:20), a date and time (2024-03-01T23:58:20), or a date and a time of day in two columns."
                )
            unit = self.columns.unit_of(places[0], "s")
            scale = rig_unit(unit or "", "s")
            if scale is None:
                try:
                    to_si(f"1 {unit}", "s")
                except QuantityError as error:
                    raise FileError(f"{table.where}: {head.name}: {unit_words(error)}") from error
            assert scale is not None
            return numbers.values * scale[0], numbers.wrong | np.isnan(numbers.values)
        if len(places) == 2:
            if kind_of_time(next((cell for cell in cells if cell), "")) == "clock":
                places = places[::-1]
            cells = [f"{a} {b}" for a, b in zip(*(table.cells[place] for place in places), strict=True)]
        time, first, assumed = seconds(cells)
        if not np.isfinite(time).any() or all(kind_of_time(cell) == "date" for cell in cells[:50] if cell):
            raise FileError(
                f"{table.where}: {heads}: found {cells[0]!r}; allowed: a time of day, or a date and a time. "
                f"{option('times', 'HEAD')} names the column, or both by two of it."
            )
        if noted:
            self.notes.append(f"time: {heads}, from {first}{f'; {assumed}' if assumed else ''}")
        return time, np.isnan(time)

    def torque_of_string(self, time: Array, table: Mapping[str, Array], kept: Sequence[tuple[int, int]]) -> Array:
        """The torque of the string [N m] in every stretch. That of the motor also accelerates
        the drive: it is more by the drive's inertia times its acceleration."""
        torque = table["surface_torque"]
        inertia = float(getattr(getattr(self.names.study.parameters, "drive", None), "inertia", 0.0) or 0.0)
        kind = self.names.study.resolved.get("drive", {}).get("kind", "ideal")
        moves = kind != "ideal"
        if self.options.surface_torque != "motor":
            if moves:
                self.notes.append(
                    f"surface_torque is taken as that of the string; {option('surface_torque', 'motor')} where that of "
                    "the motor was logged, which also accelerates the drive"
                )
            return torque
        if not moves or inertia <= 0.0:
            raise Refusal(
                "surface_torque",
                f"motor with drive.kind: {kind}",
                "a drive with an inertia in the study, as drive: {kind: stiff, inertia: 2900 kg*m^2}",
            )
        speed = next((table[name] for name in ("drive_speed", "rotary_speed") if name in table), None)
        if speed is None:
            raise FileError(
                f"{self.path}: found no speed of the drive (drive_speed or rotary_speed); allowed: one, with "
                f"{option('surface_torque', 'motor')}."
            )
        corrected = torque.copy()
        for a, b in kept:
            corrected[a:b] -= inertia * np.gradient(speed[a:b], time[a:b], edge_order=2)
        change = max(float(np.max(np.abs(corrected[a:b] - torque[a:b]))) for a, b in kept)
        self.notes.append(
            f"surface_torque is that of the motor: less {quantity('drive.inertia').text(inertia, 'si', 4)} times the "
            f"acceleration of the drive, up to {change:.3g} N m"
        )
        return corrected

    def check_points(self, settings: dict[str, Array], where: list[str]) -> None:
        """FileError where the study is not valid at the extremes of a setting, such as a
        depth less than the length of the collars."""
        study, leaves = self.names.study, self.names.keys.axes
        text = study_text(study.resolved)
        for place in sorted({int(end(values)) for values in settings.values() for end in (np.argmin, np.argmax)}):
            point = {key: leaves[key].text(float(values[place])) for key, values in settings.items()}
            sets = [f"{long_key(key)}={value}" for key, value in point.items()]
            try:
                parse_study(text, study.source, ["sweep={}", *sets])
            except StudyError as error:
                fault = error.faults[0]
                raise FileError(
                    f"{self.path}, {where[place]}: {fault.key}: found {fault.found}; allowed: {fault.allowed}."
                ) from error

    def with_errors(
        self, settings: dict[str, Array], values: dict[str, Array], errors: dict[str, Array], where: list[str]
    ) -> Measured:
        """The measurements, with the ``errors`` of the options and those assumed of the others."""
        if unknown := [name for name in self.options.errors if name not in values]:
            raise Refusal("errors", f"{unknown[0]}, which is not measured", f"{', '.join(values)}")
        self.check_points(settings, where)
        assumed = [name for name in values if name not in self.options.errors and name not in errors]
        for name, given in self.options.errors.items():
            most, units = self.names.bounds(name + ERROR)[1], self.names.results[name]
            errors[name] = given_errors(name, given, units, values[name], most)
        errors |= assumed_errors(self.names, settings, values, assumed)
        if dead := [name for name in assumed if np.any(errors[name] == 0.0)]:
            in_si = (self.names.results[name].replace(" ", "*") for name in dead)
            remedies = (option("errors", f"{name}=1 {unit}".rstrip()) for name, unit in zip(dead, in_si, strict=True))
            raise FileError(
                f"{self.path}: {', '.join(dead)}: found 0 at every operating point, of which no error can be assumed; "
                f"allowed: an error, as {' '.join(remedies)}, or a file without that column. Was the sensor connected?"
            )
        if assumed:
            self.notes.append(words_of_assumed(assumed))
        operation, axes = self.names.study.operation, self.names.keys.axes
        if lacking := [name for name in operation.names() if name not in settings]:
            texts = (f"{name} {axes[name].text(getattr(operation, name))}" for name in lacking)
            self.notes.append(f"not measured, and so as in the study: {', '.join(texts)}")
        found = Measured(self.path, settings, values, errors, tuple(where), tuple(self.notes), frozenset(assumed))
        speed = settings.get("rotary_speed")
        if speed is None and (own := getattr(operation, "rotary_speed", None)) is not None:
            speed = np.full(found.points, float(own))
        return replace(found, notes=(*found.notes, *contradictions(speed, found), *words_of_repeated(found)))


def outliers(values: Array) -> Array:
    """The places of ``values`` that are far outside the middle nine tenths of them."""
    low, high = np.quantile(values, MIDDLE)
    width = max(high - low, NOISE * abs(float(np.median(values))))
    return np.flatnonzero((values < low - FAR * width) | (values > high + FAR * width))


def _corners(values: Array) -> list[int]:
    """The rows that a ramp needs: all but those whose value is that of both neighbours."""
    inner = (values[1:-1] != values[:-2]) | (values[1:-1] != values[2:])
    return [0, *(np.flatnonzero(inner) + 1).tolist(), len(values) - 1]
