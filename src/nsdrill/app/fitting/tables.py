"""A table as rigs export it, as text: its encoding, its separator, its heads with their
units, and the numbers of its columns.

A head has its unit in brackets (``WOB [klbf]``, ``Torque (kft_lb)``), behind a comma, a
slash, a blank or an underscore (``Averaged WOB kkgf``, ``F / kN``, ``time_s``), or in a
second line. What stands without brackets may be a unit or a word, so it counts only if it is
a unit of what the column is.
"""

from __future__ import annotations

import csv
import math
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path

import numpy as np

from nsdrill.app.fitting.times import is_time
from nsdrill.data import Array
from nsdrill.errors import FileError, count, option
from nsdrill.records import dataclass
from nsdrill.units import is_unit

MAX_BYTES = 200_000_000
WIDE = 0.3  # share of bytes of zero in UTF-16
CONTROLS = bytes(set(range(32)) - set(b"\t\n\r\f\x1a"))  # bytes that no text has
MOST_CONTROLS = 0.01  # share of them in what is read as text
LOOKED_AT = 50  # first lines, of which the separator is guessed
NULLS = frozenset(("", "nan", "null", "na", "n/a", "#n/a", "none", "nil", "-", "--", "---", "*"))
NO_VALUES = (-999.0, -999.25, -9999.0, -9999.25, -99999.0)  # what rigs write where nothing was measured
PASSED_OVER = ("", "-")  # names in ``--columns`` of columns that are not used
_SEPARATORS = {"tab": "\t", "\\t": "\t"}
_BRACKETED = re.compile(r"\s*(?P<name>.*?)\s*[\[({<](?P<unit>[^\])}>]*)[\])}>]\s*")
_PARTS = re.compile(r"(?:\s+in\s+|\s*[,/|]\s*|[\s_]+)")
_NUMBER_WITH_COMMA = re.compile(r"[-+]?\d*,\d+(?:[eE][-+]?\d+)?")
_WITH_COMMAS = re.compile(r"[-+]?[1-9]\d{0,2}(?:,\d{3})+")
_OF_THOUSANDS = re.compile(r"[-+]?\d{1,3}(?:\.\d{3})+(?:,\d+)?")
# the first bytes of files that are no text
_OTHERS = {
    b"PK\x03\x04": "an Excel workbook or another archive; save the sheet as CSV",
    b"\xd0\xcf\x11\xe0": "an old Excel workbook; save the sheet as CSV",
    b"\x89HDF": "an HDF5 file; a table in CSV is needed here",
    b"%PDF": "a PDF; a table in CSV is needed here",
    b"\x1f\x8b": "compressed; unpack it",
}


@dataclass(frozen=True)
class Head:
    """The head of a column: its whole ``text``, its ``name``, its ``unit`` in brackets and
    that in the line ``below``, where they are, and the (name, unit) that it may mean
    otherwise."""

    text: str
    name: str
    unit: str | None = None
    below: str | None = None
    guesses: tuple[tuple[str, str], ...] = ()

    @classmethod
    def of(cls, text: str) -> Head:
        text = on_one_line(text)
        if match := _BRACKETED.fullmatch(text):
            return cls(text, match["name"], match["unit"].strip())
        guesses = [(text, text)] if is_unit(text) else []
        for separator in _PARTS.finditer(text):
            name, unit = text[: separator.start()], text[separator.end() :]
            if name and is_unit(unit):
                guesses.append((name, unit))
        return cls(text, text, guesses=tuple(guesses))

    @property
    def names(self) -> tuple[str, ...]:
        """What the column may be called, the whole text first."""
        return tuple(dict.fromkeys((self.text, self.name, *(name for name, _ in self.guesses))))


@dataclass(frozen=True)
class Table:
    """The ``heads`` of a table, in ``line`` of its file, and its ``cells``, column by column;
    of each row its line (``lines``) and its number of cells (``widths``). ``notes`` say how it
    was read."""

    path: str
    line: int
    heads: tuple[Head, ...]
    cells: tuple[list[str], ...]
    lines: Array
    widths: Array
    notes: tuple[str, ...] = ()
    separator: str = ","

    @property
    def where(self) -> str:
        return f"{self.path}, line {self.line}"

    @property
    def long(self) -> Array:
        """Which rows have more cells than there are heads."""
        return np.asarray(self.widths > len(self.heads))

    def only(self, rows: Array) -> Table:
        """The table of these ``rows``, a mask or their numbers."""
        numbers = np.arange(len(self.lines))[rows]
        cells = tuple([column[row] for row in numbers.tolist()] for column in self.cells)
        return replace(self, cells=cells, lines=self.lines[rows], widths=self.widths[rows])

    @cached_property
    def with_commas(self) -> bool:
        """Whether numbers have decimal commas. Between commas the cells that have them are in
        quotes, and one of them tells that they do not stand between thousands, and no number
        of the table has a decimal point."""
        if self.separator != ",":
            return True
        cells = [cell for column in self.cells for cell in column if "," in cell]
        if not any(_NUMBER_WITH_COMMA.fullmatch(cell) and not _WITH_COMMAS.fullmatch(cell) for cell in cells):
            return False
        return not any("." in cell and number(cell) is not None for column in self.cells for cell in column)

    def numbers(self, place: int) -> Numbers:
        """The numbers of a column."""
        cells = self.cells[place]
        if self.with_commas and any("," in cell for cell in cells):
            cells = _with_points(cells)
        text = "".join(cells)
        values = np.full(len(cells), np.nan)
        wrong = np.zeros(len(cells), dtype=bool)
        try:
            if not text.isascii() or "_" in text:
                raise ValueError
            values = np.array([float(cell) if cell else math.nan for cell in cells])
        except ValueError:
            for row, cell in enumerate(cells):
                value = number(cell)
                values[row], wrong[row] = (math.nan, cell.lower() not in NULLS) if value is None else (value, False)
        wrong |= np.isinf(values)
        values[np.isin(values, NO_VALUES) | wrong] = np.nan
        return Numbers(values, wrong)


@dataclass(frozen=True)
class Numbers:
    """The numbers of a column, NaN where there is none, and whether a cell is ``wrong``: has
    something that is no number."""

    values: Array
    wrong: Array


def number(cell: str) -> float | None:
    """The number in a cell; NaN for the word, None where there is none."""
    try:
        return float(cell) if cell.isascii() and "_" not in cell else None
    except ValueError:
        return None


def on_one_line(head: str) -> str:
    """A head with single blanks and without what cannot be seen, so that a message can show
    it to be pasted: without line breaks, tabs, blanks of other kinds, byte order marks."""
    return " ".join("".join(char if char.isprintable() or char.isspace() else "" for char in head).split())


def is_gap(cell: str) -> bool:
    """Whether a cell says that nothing was measured."""
    return cell.strip().lower() in NULLS or number(cell) in NO_VALUES


def _with_points(cells: list[str]) -> list[str]:
    """Cells with a decimal point for the decimal comma. A column with both has points
    between the thousands, or its cells with a comma stay as they are, which are no
    numbers."""
    if any("." in cell and not _OF_THOUSANDS.fullmatch(cell) for cell in cells):
        return cells
    return [cell.replace(".", "").replace(",", ".") for cell in cells]


def read_table(path: str, columns: str | Sequence[str] = ()) -> Table:
    """The table in the file ``path``. ``columns`` are its heads where it has none, a text
    with commas between them or a list, with ``-`` for what is not used. FileError where
    it is no table."""
    text, notes = _text(path)
    rows, separator = _rows(path, text)
    names = columns.split(",") if isinstance(columns, str) else columns
    heads, line, rows = _headed(path, rows, [one.strip() for one in names] if columns else [], notes)
    if not rows:
        raise FileError(f"{path}: found no table; allowed: a head of names with units and at least one row of numbers.")
    width = len(heads)
    lines = np.array([number for number, _ in rows], dtype=np.int64)
    widths = np.array([len(row) if any(row[width:]) else min(len(row), width) for _, row in rows])
    full = [row if len(row) >= width else row + [""] * (width - len(row)) for _, row in rows]
    cells = tuple([row[place] for row in full] for place in range(width))
    return Table(path, line, tuple(heads), cells, lines, widths, tuple(notes), separator)


def _text(path: str) -> tuple[str, list[str]]:
    """The text of the file, and what is to be said of its encoding."""
    try:
        if Path(path).stat().st_size > MAX_BYTES:
            raise FileError(f"{path}: found a file of more than {MAX_BYTES // 10**6} MB; allowed: a part of it.")
        data = Path(path).read_bytes()
    except OSError as error:
        raise FileError(f"{path}: {error.strerror or error}.") from error
    if kind := next((kind for begin, kind in _OTHERS.items() if data.startswith(begin)), None):
        raise FileError(f"{path}: this is {kind}.")
    marked = data.startswith((b"\xff\xfe", b"\xfe\xff"))
    if marked or b"\x00" in data[:200]:
        wide = "utf-16" if marked else "utf-16-le" if data[1:2] == b"\x00" else "utf-16-be"
        is_wide = marked or data[:200].count(0) > WIDE * len(data[:200])
        try:
            text = data.decode(wide)
            if is_wide and "\x00" not in text:
                return text.removeprefix("\ufeff"), []
        except UnicodeDecodeError:
            pass
        raise FileError(f"{path}: this is no text; a table in CSV is needed here.")
    try:
        return data.decode("utf-8-sig"), []
    except UnicodeDecodeError:
        if len(data.translate(None, CONTROLS)) < (1.0 - MOST_CONTROLS) * len(data):
            raise FileError(f"{path}: this is no text; a table in CSV is needed here.") from None
        return data.decode("cp1252", errors="replace"), ["read as Latin-1, as it is no UTF-8"]


Row = tuple[int, list[str]]


def _rows(path: str, text: str) -> tuple[list[Row], str]:
    """The rows with their line numbers, without empty rows and comments, and what separates
    their cells."""
    lines = text.splitlines()
    first = next((place for place, line in enumerate(lines) if line.strip()), None)
    separator = None
    if first is not None and (named := re.fullmatch(r'"?sep=(.+?)"?', lines[first].strip("\ufeff\r\n"), re.I)):
        separator, lines[first] = _SEPARATORS.get(named[1].lower(), named[1]), ""
        if len(separator) != 1:
            raise FileError(f"{path}, line {first + 1}: found sep={named[1]}; allowed: one character.")
    separator = separator or _separator(lines)
    if separator == " ":
        found = [(n, line.split()) for n, line in enumerate(lines, start=1)]
    else:
        reader = csv.reader(lines, delimiter=separator, skipinitialspace=separator != "\t")
        try:
            found = [(reader.line_num, [cell.strip() for cell in row]) for row in reader]
        except csv.Error as error:
            raise FileError(f"{path}, line {reader.line_num}: no CSV: {error}.") from error
    return [(n, row) for n, row in found if any(row) and not row[0].startswith("#")], separator


def _separator(lines: Sequence[str]) -> str:
    """What separates the cells: what most of the first lines have in the same number, a tab
    or a semicolon before a comma, which may be a decimal one; else blanks."""
    looked_at = [line for line in lines if line.strip() and not line.startswith("#")][:LOOKED_AT]
    found = []
    for rank, separator in enumerate(("\t", ";", "|", ",")):
        numbers = Counter(line.count(separator) for line in looked_at)
        numbers.pop(0, None)
        if numbers:
            found.append((max(numbers.values()), -rank, separator))
    if found:
        most = max(share for share, *_ in found)
        return max((rank, separator) for share, rank, separator in found if share >= 0.8 * most)[1]
    widths = Counter(len(line.split()) for line in looked_at)
    width, times = widths.most_common(1)[0] if widths else (0, 0)
    return " " if width > 1 and times >= max(2, 0.8 * len(looked_at)) else ","


def _headed(path: str, rows: list[Row], given: list[str], notes: list[str]) -> tuple[list[Head], int, list[Row]]:
    """The heads, their line, and the rows below them."""
    if given:
        return _named(path, rows, given, notes)
    above = 0  # titles: lines of one cell above a table of several columns
    while above < len(rows) - 1 and len(_filled(rows[above])) == 1 < min(
        len(_filled(one)) for one in rows[above + 1 :][:3]
    ):
        above += 1
    if above:
        notes.append(f"{count(above, 'line')} above the heads passed over")
    rows = rows[above:]
    if len(rows) < 2:
        raise FileError(f"{path}: found no table; allowed: a head of names with units and at least one row of numbers.")
    line, first = rows[0]
    if all(_is_value(cell) for cell in first if cell):
        template = ", ".join(["time [s]", *["-"] * (len(first) - 1)])
        raise FileError(
            f"{path}, line {line}: found numbers only, and no heads; allowed: a head of names with units. "
            f"{option('columns', template)} names the {count(len(first), 'column')}, each as NAME [UNIT], or - where "
            "it is not used."
        )
    heads, second = [Head.of(cell) for cell in first], rows[1][1]
    if not any(_is_value(cell) for cell in second if cell) and any(is_unit(cell.strip("[](){}<> ")) for cell in second):
        if any(second[len(heads) :]):
            found = f"{count(len(second), 'cell')} under {count(len(heads), 'column')}"
            raise FileError(f"{path}, line {rows[1][0]}: found {found}; allowed: a cell for each column.")
        units = [cell.strip("[](){}<> ") for cell in second]
        for place, (head, unit) in enumerate(zip(heads, units, strict=False)):
            heads[place] = replace(head, below=unit or None)
        return heads, line, rows[2:]
    return heads, line, rows[1:]


def _named(path: str, rows: list[Row], given: list[str], notes: list[str]) -> tuple[list[Head], int, list[Row]]:
    """The heads ``given``, which stand in place of the lines above the first numbers."""
    above = 0
    while above < len(rows) and not any(_is_value(cell) for cell in _filled(rows[above])):
        above += 1
    if above:
        notes.append(f"{option('columns')} stands in place of {count(above, 'line')} above the numbers")
    rows = rows[above:]
    if rows and len(rows[0][1]) != len(given):
        raise FileError(
            f"{path}, line {rows[0][0]}: found {count(len(rows[0][1]), 'cell')} under {count(len(given), 'name')} of "
            f"{option('columns')}; allowed: a name for each, - for one that is not used."
        )
    line = rows[0][0] if rows else 1
    return [Head.of("" if one in PASSED_OVER else one) for one in given], line, rows


def _filled(row: Row) -> list[str]:
    return [cell for cell in row[1] if cell]


def _is_value(cell: str) -> bool:
    """Whether a cell has a number, a time or a null, and so is no head."""
    return number(cell) is not None or _NUMBER_WITH_COMMA.fullmatch(cell) is not None or is_time(cell)
