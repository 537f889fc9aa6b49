"""Measurements of a well, from a table as rigs export it: CSV with a name and a unit
for every column.

There are two forms. In a table over *operating points* a row is one setting (``wob``,
``rotary_speed``, ``depth`` or any key of the study) with the features and severities
measured there. In a table over *time*, with a column ``time``, the columns are signals.
Rows with constant settings form a stretch, and every stretch is an operating point
whose features follow from its signals: ``surface_torque`` gives surface_torque_mean,
surface_torque_min and surface_torque_max.
"""

from __future__ import annotations

import csv
import difflib
import math
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from nsdrill.analysis.fitting import Array, Measured
from nsdrill.errors import FileError, InputError, Refusal, count, option
from nsdrill.models.leaves import values_in_parts
from nsdrill.models.registry import of_all
from nsdrill.quantity import SHOWN
from nsdrill.ranges import bound_text, range_text
from nsdrill.study.keys import Keys
from nsdrill.study.study import Study
from nsdrill.units import QuantityError, kind_of, plain_units, to_si
from nsdrill.variables import AXES, Variable, dimension_of

MAX_BYTES = 200_000_000
# assumed error: share of the value, and of the size of its signal
RELATIVE, ABSOLUTE = 0.05, 0.02
GRADE, GRADES = 0.5, (0.0, 4.0)  # assumed error of a severity, and its range
NULLS = ("", "nan", "null", "-999", "-999.25", "-9999", "na", "n/a")
SAME = 0.05  # of its mean, within which a setting is constant
SLOWEST = 2.0  # s between samples, beyond which extremes are missed
TIME = "time"
ERROR = "_error"
NOISE = 0.1  # of a value: extremes that are further in the wrong order are refused
MEAN, CHANGE = "_mean", "_change"
# What rigs call a setting or a result: its name here, over operating points and over time.
_RIG_NAMES = {
    name: (point, signal)
    for names, point, signal in (
        ("rpm rpma rpm_avg rotary_rpm surface_rpm td_rpm", "rotary_speed", "rotary_speed"),
        ("swob wob_avg woba weight_on_bit", "wob", "wob"),
        ("md dmea dbtm bit_depth hole_depth measured_depth", "depth", "depth"),
        ("torque trq tqa tor stor surface_tq", "surface_torque_mean", "surface_torque"),
        ("rop ropa rop_avg", "rate_of_penetration", "rate_of_penetration"),
        ("mse", "mechanical_specific_energy", "mechanical_specific_energy"),
        ("ssi stick_slip", "stick_slip_index", "stick_slip_index"),
    )
    for name in names.split()
}
_HEAD = re.compile(r"\s*(?P<name>.*?)\s*(?:\[(?P<square>[^\]]*)\]|\((?P<round>[^)]*)\))?\s*")
# kft.lbf and kft-lbf, as rigs write kft*lbf
_JOINED = re.compile(r"(?<=[A-Za-z])[.\-·](?=[A-Za-z])")


@dataclass(frozen=True)
class Reading:
    """Options for reading a table.

    ``rename`` maps headings of the file to names of nsdrill; ``ignore`` lists headings
    to skip, ``*`` for all unknown ones; ``errors`` maps names to standard deviations,
    as texts (``0.5 kft*lbf``, ``10 percent``) or as numbers in SI; ``gaps`` says
    whether rows with gaps are skipped. In a table over time a stretch lasts at least
    ``shortest`` [s], and its first ``settle`` [s] are not used."""

    rename: Mapping[str, str] = field(default_factory=dict)
    ignore: Sequence[str] = ()
    errors: Mapping[str, str | float] = field(default_factory=dict)
    gaps: bool = False
    shortest: float = 120.0
    settle: float = 60.0


@dataclass(frozen=True)
class Column:
    """A column: its place, its heading, its name in nsdrill and its unit in SI
    (``scale``)."""

    place: int
    head: str
    name: str
    scale: float


def read_measured(path: str | os.PathLike[str], study: Study, options: Reading | None = None) -> Measured:
    """The measurements in the CSV file ``path``, for comparison with runs of ``study``;
    FileError, with the line, where a cell or a column is invalid."""
    return _Table(path, _Names.of(study), options or Reading()).measured()


@dataclass(frozen=True)
class _Names:
    """The valid names of columns of a ``study``: ``settings`` maps them to its keys,
    ``results`` (features and severities of a run) and ``signals`` (of a trace) to SI
    units; ``features`` are the variables of results that are no severities."""

    study: Study
    keys: Keys
    settings: dict[str, str]
    results: dict[str, str]
    signals: dict[str, str]
    features: dict[str, Variable]

    @classmethod
    def of(cls, study: Study) -> _Names:
        keys, model = study.keys, study.model
        options = (*model.states(study.parameters), *model.options(study.parameters), "drilled")
        settings = {name: key for key in keys.axes for name in (key, keys.axes[key].key, dimension_of(key))}
        present = [v for v in (*model.features, *model.derived) if v.only is None or v.only in options]
        results = {v.name: v.units for v in present} | {name: "" for name in model.severities}
        signals = {v.signal: v.units for v in present if v.signal}
        return cls(
            study,
            keys,
            settings,
            {name: "" if u == "1" else plain_units(u) for name, u in results.items()},
            {name: "" if u == "1" else plain_units(u) for name, u in signals.items()},
            {v.name: v for v in present},
        )

    def bounds(self, name: str) -> tuple[float, float]:
        """The least and the greatest value of a result, of its error, or of a signal,
        whose noise may go below zero."""
        if name in self.features:
            return self.features[name].bounds
        if name in self.results:
            return GRADES
        if name.endswith(ERROR) and name.removesuffix(ERROR) in self.results:
            low, high = self.bounds(name.removesuffix(ERROR))
            return 0.0, high - low
        greatest = max(v.bounds[1] for v in self.features.values() if v.signal == name)
        return -greatest, greatest

    def sizes(self, settings: dict[str, Array], values: dict[str, Array]) -> dict[str, float]:
        """The size that counts of each result in ``values``: the greatest value of all
        that come from one signal, and not less than the natural scale at these
        ``settings``, as that of a speed is the set speed."""
        study, model = self.study, self.study.model
        operation = {name: getattr(study.operation, name) for name in AXES} | settings
        points = dict(zip(operation, np.broadcast_arrays(*map(np.atleast_1d, operation.values())), strict=True))
        natural: dict[str, float] = {}
        for at, _ in values_in_parts(model, study.parameters, study.initial, points):
            for scale, column in model.dynamics.scales(model.dynamics.pack(at, study.thresholds)).items():
                natural[scale] = max(natural.get(scale, 0.0), float(np.max(column)))
        of_signals: dict[str, float] = {}
        for name, column in values.items():
            signal = self._signal(name)
            of_signals[signal] = max(of_signals.get(signal, 0.0), float(np.nanmax(np.abs(column))))
        return {
            name: max(
                of_signals[self._signal(name)],
                natural.get(model.compared.get(name) or "", 0.0),
                self.features[name].scale if name in self.features else 0.0,
            )
            for name in values
        }

    def _signal(self, name: str) -> str:
        """The signal of a result, or itself."""
        return (name in self.features and self.features[name].signal) or name

    def units(self, name: str, timed: bool) -> str | None:
        """The SI units of the column ``name``; None where the name is unknown."""
        if name in self.settings:
            return self.keys.axes[self.settings[name]].units
        if timed:
            return "s" if name == TIME else self.signals.get(name)
        return self.results.get(name.removesuffix(ERROR))

    def known(self, timed: bool) -> list[str]:
        return [*self.settings, *([TIME, *self.signals] if timed else self.results)]

    def some_results(self) -> str:
        return f"a feature that a run has, as {', '.join(list(self.results)[:6])}"


class _Table:
    """A table of measurements: its ``path``, the line of its headings, the (name, unit) of
    each column and the rows below, whether it is over time (``timed``), the line numbers of
    the rows that are used (``at``), and ``notes`` on what was not."""

    def __init__(self, path: str | os.PathLike[str], names: _Names, options: Reading) -> None:
        self.path, self.names, self.options = path, names, options
        self.line, self.heads, self.body = _heads(path, _rows(path))
        self.where = f"{path}, line {self.line}"
        self.timed = any(self.name(head) == TIME for head, _ in self.heads)
        self.notes: list[str] = []
        self.at: list[int] = []

    def name(self, head: str) -> str:
        """The name in nsdrill of the column with this heading."""
        name = self.options.rename.get(head, head).strip().lower()
        return re.sub(r"[\s\-]+", "_", name)

    def measured(self) -> Measured:
        """The measurements in the table."""
        columns, names = self.columns(), self.names
        table = self.numbers(columns)
        self.check_values(columns, table)
        self.check_order(table)
        if self.timed:
            return self.over_time(table)
        given = {column.name for column in columns}
        settings = {names.settings[name]: table[name] for name in table if name in names.settings}
        values = {name: table[name] for name in names.results if name in given}
        if not values:
            raise FileError(f"{self.where}: found no measured value; allowed: {names.some_results()}.")
        self.check_settings(settings)
        errors = {name: table[name + ERROR] for name in values if name + ERROR in given}
        for name, error in errors.items():
            if np.any(bad := np.isfinite(values[name]) & ~(error > 0)):
                line = self.at[int(np.argmax(bad))]
                raise FileError(
                    f"{self.path}, line {line}: {name + ERROR}: found an error of 0 or less, or none beside a value; "
                    "allowed: one above 0."
                )
        return self.with_errors(settings, values, errors, [f"line {line}" for line in self.at])

    def columns(self) -> list[Column]:
        """The columns that are used."""
        options = self.options
        in_file = {head for head, _ in self.heads}
        for name, listed_heads in (("rename", options.rename), ("ignore", options.ignore)):
            if unknown := [head for head in listed_heads if head not in in_file and head != "*"]:
                found = f"{self.where}: {option(name)}: found no column {unknown[0]!r}"
                raise FileError(f"{found}; allowed: those of the file, {', '.join(in_file)}.")
        columns: list[Column] = []
        ignored = []
        for place, (head, unit) in enumerate(self.heads):
            name = self.name(head)
            if head in options.ignore:
                ignored.append(head)
                continue
            si = self.names.units(name, self.timed)
            if si is None:
                if "*" in options.ignore:
                    ignored.append(head)
                    continue
                raise FileError(_unknown(self.where, head, name, self.names, self.timed))
            if any(column.name == name for column in columns):
                raise FileError(f"{self.where}: found two columns of {name}; allowed: one of each.")
            columns.append(Column(place, head, name, _scale(self.where, head, unit, si, name in self.names.results)))
        if ignored:
            self.notes.append(f"ignored: {', '.join(head for head in ignored if head) or 'columns without a name'}")
        return columns

    def numbers(self, columns: list[Column]) -> dict[str, Array]:
        """The columns in SI, by name; ``at`` has the line numbers of their rows."""
        rows: list[list[float]] = []
        skipped = missing = 0
        for line, row in self.body:
            values: list[float] = []
            for column in columns:
                cell = row[column.place] if column.place < len(row) else ""
                value = _number(cell)
                if cell.lower() in NULLS:
                    value = math.nan
                if value is None:
                    hint = " Write a decimal point and no thousands separators." if "," in cell else ""
                    raise FileError(
                        f"{self.path}, line {line}: {column.head}: found {cell!r}; allowed: a number.{hint}"
                    )
                values.append(value * column.scale)
            lacking = {column.name for column, value in zip(columns, values, strict=True) if math.isnan(value)}
            if lacking:
                if not self.options.gaps:
                    head = columns[[math.isnan(value) for value in values].index(True)].head
                    raise FileError(
                        f"{self.path}, line {line}: {head}: found a gap; allowed: a number. {option('skip_gaps')} "
                        "passes over rows with gaps, and of operating points over the values that are not there."
                    )
                measured = {column.name for column in columns} & self.names.results.keys()
                if self.timed or lacking - self.names.results.keys() or measured <= lacking:
                    skipped += 1
                    continue
                missing += 1
            rows.append(values)
            self.at.append(line)
        if skipped:
            self.notes.append(f"{skipped} of {count(len(self.body), 'row')} left out: with gaps")
        if missing:
            self.notes.append(f"in {missing} of {count(len(self.body), 'row')} some values are not measured")
        if not rows:
            raise FileError(
                f"{self.path}: found no row of numbers{' without gaps' if skipped else ''}; allowed: at least one."
            )
        table = np.array(rows)
        return {column.name: table[:, i] for i, column in enumerate(columns)}

    def check_settings(self, settings: dict[str, Array]) -> None:
        """FileError where a setting lies outside the range of its key."""
        for key, values in settings.items():
            leaf = self.names.keys.axes[key]
            bad = np.flatnonzero(~((values >= leaf.low) & (values <= leaf.high)))
            if bad.size:
                value = leaf.text(float(f"{values[bad[0]]:.6g}"))
                raise FileError(
                    f"{self.path}, line {self.at[bad[0]]}: {key}: found {value}; allowed: {leaf.range()}. Is the unit "
                    "in the head right?"
                )

    def check_values(self, columns: list[Column], table: dict[str, Array]) -> None:
        """FileError where a measured value is impossible."""
        for column in columns:
            if column.name in self.names.settings or column.name == TIME:
                continue
            values, (low, high) = table[column.name], self.names.bounds(column.name)
            bad = np.flatnonzero(~np.isnan(values) & ~((values >= low) & (values <= high)))
            if bad.size:
                units = self.names.units(column.name, self.timed) or ""
                found, allowed = (
                    f"{text} {units}".rstrip() for text in (f"{values[bad[0]]:.6g}", range_text(low, high))
                )
                where = f"{self.path}, line {self.at[bad[0]]}: {column.head}"
                raise FileError(f"{where}: found {found}; allowed: {allowed}. Is the unit in the head right?")

    def check_order(self, table: dict[str, Array]) -> None:
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
                    f"{self.path}, line {self.at[bad[0]]}: {low}: found {table[low][bad[0]]:.6g}, above {high}, "
                    f"{table[high][bad[0]]:.6g} (SI); allowed: at most that. Are the columns exchanged?"
                )

    def over_time(self, table: dict[str, Array]) -> Measured:
        """The features of the stretches in which the settings are constant."""
        time, names, at = table.pop(TIME), self.names, self.at
        back = np.flatnonzero(np.diff(time) <= 0)
        if back.size:
            line = at[back[0] + 1]
            raise FileError(
                f"{self.path}, line {line}: time: found {time[back[0] + 1]:g} s after {time[back[0]]:g} s; allowed: a "
                "time that goes on."
            )
        settings = {names.settings[name]: table[name] for name in table if name in names.settings}
        signals = {name: table[name] for name in table if name in names.signals and name not in names.settings}
        if not settings or not signals:
            lacking = "setting (wob, rotary_speed, depth)" if not settings else f"signal ({', '.join(names.signals)})"
            raise FileError(f"{self.path}: found no {lacking} beside the time; allowed: at least one.")
        self.check_settings(settings)
        step = float(np.median(np.diff(time))) if len(time) > 1 else math.inf
        coarse = step > SLOWEST
        kept = self.observed_stretches(time, settings, step)
        if coarse:
            self.notes.append(f"a sample every {step:g} s: only means are used, as extremes are missed")
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
        if not features:
            raise FileError(
                f"{self.path}: found signals of which no feature follows{' but extremes' * coarse}; allowed: others."
            )
        where = [f"lines {at[a]} to {at[b - 1]} ({time[a]:g} to {time[b - 1]:g} s)" for a, b in kept]
        return self.with_errors(points, features, {}, where)

    def observed_stretches(self, time: Array, settings: dict[str, Array], step: float) -> list[tuple[int, int]]:
        """The first row, and the row after the last, of what is used of each stretch that is
        long enough."""
        options, short = self.options, 0
        kept: list[tuple[int, int]] = []
        for start, stop in _stretches(time, settings, step):
            start = int(np.searchsorted(time, time[start] + options.settle)) if stop > start else start
            if stop - start < 3 or time[stop - 1] - time[start] < options.shortest - options.settle:
                short += 1
                continue
            kept.append((start, stop))
        if not kept:
            raise FileError(
                f"{self.path}: found no stretch of at least {options.shortest:g} s in which the settings stay within "
                f"{100 * SAME:g} % of their mean; allowed: at least one. {option('shortest')} takes shorter ones."
            )
        self.notes.append(
            f"{count(len(kept), 'stretch')} of constant settings, without their first {options.settle:g} s"
            + (f"; {short} shorter than {options.shortest:g} s left out" if short else "")
        )
        return kept

    def with_errors(
        self, settings: dict[str, Array], values: dict[str, Array], errors: dict[str, Array], where: list[str]
    ) -> Measured:
        """The measurements, with the ``errors`` of the options and those assumed of the others."""
        if unknown := [name for name in self.options.errors if name not in values]:
            raise Refusal("errors", f"{unknown[0]}, which is not measured", f"{', '.join(values)}")
        sizes = self.names.sizes(settings, values)
        assumed = []
        for name, column in values.items():
            if name in self.options.errors:
                most = self.names.bounds(name + ERROR)[1]
                units = self.names.results[name]
                errors[name] = _errors_from_option(name, self.options.errors[name], units, column, most)
            elif name not in errors:
                is_grade = name not in self.names.features
                errors[name] = (
                    np.full(column.shape, GRADE) if is_grade else np.hypot(RELATIVE * column, ABSOLUTE * sizes[name])
                )
                errors[name] = np.maximum(errors[name], 1e-12)
                assumed.append(name)
        if assumed:
            self.notes.append(
                f"error assumed of {', '.join(assumed)}: {100 * RELATIVE:g} % of the value and {100 * ABSOLUTE:g} % of "
                f"the greatest of its signal (of a fraction, of 1), of severities {GRADE}; {option('errors')} or a "
                "column NAME_error gives it"
            )
        return Measured(str(self.path), settings, values, errors, tuple(where), tuple(self.notes))


def _rows(path: str | os.PathLike[str]) -> list[tuple[int, list[str]]]:
    """The rows of the file with their line numbers, without empty rows and comments."""
    try:
        if Path(path).stat().st_size > MAX_BYTES:
            raise FileError(f"{path}: found a file of more than {MAX_BYTES // 10**6} MB; allowed: a part of it.")
        text = Path(path).read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise FileError(f"{path}: this is no text in UTF-8; a table in CSV is needed here.") from None
    except OSError as error:
        raise FileError(f"{path}: {error.strerror or error}.") from error
    first = next((line for line in text.splitlines() if line.strip() and not line.startswith("#")), "")
    delimiter = max(",;\t", key=first.count)
    reader = csv.reader(text.splitlines(), delimiter=delimiter, skipinitialspace=True)
    try:
        rows = [(reader.line_num, [cell.strip() for cell in row]) for row in reader]
    except csv.Error as error:
        raise FileError(f"{path}, line {reader.line_num}: no CSV: {error}.") from error
    return [(n, row) for n, row in rows if any(row) and not row[0].startswith("#")]


def _heads(
    path: str | os.PathLike[str], rows: list[tuple[int, list[str]]]
) -> tuple[int, list[tuple[str, str | None]], list[tuple[int, list[str]]]]:
    """The line of the headings, the (name, unit) of each column, and the rows below."""
    if len(rows) < 2:
        raise FileError(f"{path}: found no table; allowed: a head of names with units and at least one row of numbers.")
    number, head = rows[0]
    for line, row in rows[1:]:
        if any(row[len(head) :]):
            raise FileError(
                f"{path}, line {line}: found {count(len(row), 'cell')} under {count(len(head), 'column')}; allowed: a "
                f"cell for each column. Write a decimal point in place of a comma and no thousands "
                f"separators, or separate the columns by semicolons."
            )
    heads = []
    for cell in head:
        match = _HEAD.fullmatch(cell)
        assert match is not None
        unit = match["square"] if match["square"] is not None else match["round"]
        heads.append((match["name"], unit))
    second = rows[1][1]
    if all(unit is None for _, unit in heads) and not any(_number(cell) is not None for cell in second):
        units = [cell.strip("[]() ") for cell in second]
        units += [""] * (len(heads) - len(units))
        return (number, [(name, unit) for (name, _), unit in zip(heads, units, strict=False)], rows[2:])
    return number, heads, rows[1:]


def _unknown(where: str, head: str, name: str, names: _Names, timed: bool) -> str:
    known = names.known(timed)
    usual = [one for one in _RIG_NAMES.get(name, ())[timed:][:1] if one in known]
    near = usual or difflib.get_close_matches(name, known, n=3, cutoff=0.5)
    if not usual:
        near += [one for one in known if name and (name in one or one in name) and one not in near][: 3 - len(near)]
    hint = f" Did you mean {' or '.join(near)}?" if near else ""
    models = _models_with(name)
    if models and names.keys.model.name not in models:
        hint = f" It is one of the model {' and of '.join(models)}; the study has another."
    if not timed and name in names.signals:
        hint += f" {name} by itself is a signal over time, which needs a column time."
    renaming = f"{head}={(*usual, 'NAME')[0]}"
    what = "signals over time" if timed else "features and severities of a run"
    examples = ", ".join(list(names.signals if timed else names.results)[:8])
    return (
        f"{where}: found the column {head!r}, which is not known.{hint} Allowed: time, settings (depth, wob, "
        f"rotary_speed or a key of the study) and {what} ({examples}, ...). {option('rename', renaming)} says what it "
        f"is, {option('ignore', head)} passes over it, {option('ignore', '*')} over all that are not known."
    )


def _models_with(name: str) -> list[str]:
    """The models whose runs or traces have this value."""
    ends = ("", MEAN, "_max", f"{CHANGE}_max")
    return [
        model
        for model, features in of_all(lambda model: model.features)
        if {f"{name}{end}" for end in ends} & {one.name for one in features}
    ]


def _scale(where: str, head: str, unit: str | None, si: str, of_result: bool) -> float:
    """The SI value of one ``unit``. Fractions may be in percent, and percentages may be
    fractions."""
    text = (unit or "").strip().replace("%", "percent")
    if si in ("", "percent"):
        factors = {"": 1.0, "1": 1.0, "-": 1.0, "percent": 0.01} if si == "" else {"percent": 1.0, "1": 100.0}
        if text not in factors:
            found = f"the unit {unit!r}" if unit else "no unit"
            allowed = "none, or percent" if si == "" else "percent, or 1 for a part of one"
            raise FileError(f"{where}: {head}: found {found}; allowed: {allowed}.")
        return factors[text]
    if not text:
        raise FileError(
            f"{where}: {head}: found no unit; allowed: {head} [{SHOWN.get(si, (si, si))[1]}] or another unit of "
            f"{kind_of(si)} in brackets."
        )
    try:
        return to_si(f"1 {_JOINED.sub('*', text)}", si)
    except QuantityError as error:
        raise FileError(f"{where}: {head}: {error}") from error


def _number(cell: str) -> float | None:
    try:
        value = float(cell) if cell.isascii() and "_" not in cell else math.nan
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _stretches(time: Array, settings: dict[str, Array], step: float) -> list[tuple[int, int]]:
    """The first row, and the row after the last, of each stretch in which every setting
    is within :data:`SAME` of its mean and no time is missing."""
    table = np.stack(list(settings.values()), axis=1)
    size = np.maximum(np.abs(table).max(axis=0), 1e-300)
    stretches, start, total = [], 0, table[0].copy()
    for row in range(1, len(table) + 1):
        ends = row == len(table)
        if not ends:
            mean = total / (row - start)
            deviates = np.abs(table[row] - mean) > SAME * np.maximum(np.abs(mean), 0.02 * size)
            ends = bool(deviates.any()) or time[row] - time[row - 1] > max(5 * step, 1e-9)
        if ends:
            stretches.append((start, row))
            start, total = row, np.zeros(table.shape[1])
        if row < len(table):
            total = total + table[row]
    return stretches


def _errors_from_option(name: str, text: str | float, si: str, values: Array, most: float) -> Array:
    """The standard deviations of ``values`` from an option: a quantity, a percentage of
    the values, or a number in SI; none is above ``most``."""
    if not isinstance(text, str):
        if isinstance(text, bool) or not isinstance(text, int | float | np.number) or not 0 < text < math.inf:
            raise InputError(
                f"errors, {name}: found {text!r}; allowed: a number above 0 in SI{f' [{si}]' if si else ''}, or a text "
                "with its unit or in percent."
            )
        return _not_above(most, np.full(values.shape, float(text)), name, text, si)
    cleaned = text.replace("%", "percent").strip()
    try:
        is_percentage = cleaned.endswith("percent") and si != "percent"
        number = (
            _number(cleaned.removesuffix("percent"))
            if is_percentage or si in ("", "percent")
            else to_si(_JOINED.sub("*", cleaned), si)
        )
        if number is None or not 0 < number < math.inf:
            raise ValueError
    except QuantityError as error:
        raise InputError(f"{option('errors')} {name}: {error}") from error
    except ValueError:
        raise InputError(
            f"{option('errors')} {name}: found {text!r}; allowed: a number above 0 with its unit, or percent."
        ) from None
    errors = number / 100 * np.abs(values) if is_percentage else np.full(values.shape, number)
    if np.any(errors <= 0):
        raise InputError(f"{option('errors')} {name}: found {text!r} of a value of 0; allowed: an error above 0.")
    return _not_above(most, errors, name, text, si)


def _not_above(most: float, errors: Array, name: str, found: object, si: str) -> Array:
    if np.any(errors > most):
        at_most = f"{bound_text(most)} {si}".rstrip()
        raise InputError(f"{option('errors')} {name}: found {found!r}; allowed: an error of at most {at_most}.")
    return errors
