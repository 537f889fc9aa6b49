"""Times of a log as people write them: a time of day, a date, or both, in one column or
in two, as seconds."""

from __future__ import annotations

import datetime
import math
import re
from collections.abc import Sequence

import numpy as np

from nsdrill.data import Array

DAY = 86400.0
HALF_A_DAY = 0.5 * DAY  # a time of day that falls by more has passed midnight
_NAMED = "jan feb mar apr may jun jul aug sep oct nov dec"
_MONTHS = {name: number for number, name in enumerate(_NAMED.split(), start=1)}
_MONTHS |= {"mai": 5, "okt": 10, "dez": 12, "des": 12, "mrz": 3, "mär": 3}
_MONTH = r"(?:\d{1,2}|[^\W\d]{3,9}\.?)"
_DATE = (
    rf"(?P<date>\d{{4}}(?P<mark>[-/.]){_MONTH}(?P=mark)\d{{1,2}}"
    rf"|\d{{1,2}}(?P<other>[-/.]){_MONTH}(?P=other)(?:\d{{4}}|\d{{2}})|\d{{8}}(?=[T ]))"
)
_CLOCK = r"(?P<hour>\d{1,2}):(?P<minute>\d{2})(?::(?P<second>\d{2}(?:[.,]\d+)?))?\s*(?P<half>[AaPp]\.?[Mm]\.?)?"
_ZONE = r"\s*(?P<zone>Z|z|UTC|GMT|[-+]\d{2}(?::?\d{2})?)?"
_TIME = re.compile(rf"(?:{_DATE})?(?:[T\s]\s*|(?=\d)|$)(?:{_CLOCK}{_ZONE})?")


def is_time(cell: str) -> bool:
    """Whether a cell has a date, a time of day, or both."""
    return kind_of_time(cell) is not None


def kind_of_time(cell: str) -> str | None:
    """``date``, ``clock`` or ``both``; None for what is no time."""
    match = _TIME.fullmatch(cell.strip())
    if match is None or not (match["date"] or match["hour"]):
        return None
    return "both" if match["date"] and match["hour"] else "date" if match["date"] else "clock"


def seconds(cells: Sequence[str]) -> tuple[Array, str, str | None]:
    """The times of ``cells`` as seconds since the first one, NaN where a cell has none;
    the first one as text; and what was assumed. A time of day goes on past midnight;
    zones are counted; of 01/02/2024 that order of day and month is taken in which the
    log is shorter."""
    dates: dict[str, tuple[int, int, int] | None] = {}
    days: list[str] = []
    clock = np.full(len(cells), np.nan)
    for row, cell in enumerate(cells):
        match = _TIME.fullmatch(cell.strip())
        days.append((match["date"] or "") if match else "")
        if match is None or not (match["date"] or match["hour"]):
            continue
        clock[row] = _clock(match) if match["hour"] else 0.0
        if days[-1] not in dates:
            dates[days[-1]] = _parts(days[-1])
    number, assumed = _numbered(dates)
    day = np.array([number.get(one, math.nan) for one in days])
    if set(dates) <= {""}:
        day = np.where(np.isfinite(clock), 0.0, np.nan)
        there = np.flatnonzero(np.isfinite(clock))
        falls = np.diff(clock[there], prepend=clock[there[:1]]) < -HALF_A_DAY
        day[there] += np.cumsum(falls)
        if falls.any():
            assumed = f"midnight passed {int(falls.sum())} times" if falls.sum() > 1 else "midnight passed"
    there = np.flatnonzero(np.isfinite(day) & np.isfinite(clock))
    if not there.size:
        return np.full(len(cells), np.nan), "", assumed
    first = there[0]
    return (day - day[first]) * DAY + (clock - clock[first]), cells[first], assumed


def _clock(match: re.Match[str]) -> float:
    """The seconds of a time of day, in universal time where it has a zone; NaN where there
    is no such time."""
    hour, minute = int(match["hour"]), int(match["minute"])
    second = float((match["second"] or "0").replace(",", "."))
    if half := (match["half"] or "").lower():
        if not 1 <= hour <= 12:
            return math.nan
        hour = hour % 12 + (12 if half.startswith("p") else 0)
    if hour > 24 or minute > 59 or second >= 61.0:
        return math.nan
    offset = 0
    if (zone := match["zone"] or "")[:1] in ("+", "-"):
        digits = zone[1:].replace(":", "").ljust(4, "0")
        offset = (int(digits[:2]) * 60 + int(digits[2:])) * (60 if zone[0] == "+" else -60)
    return hour * 3600.0 + minute * 60.0 + second - offset


def _parts(date: str) -> tuple[int, int, int] | None:
    """The three numbers of a date in their order, with that of a named month negative;
    None where there is no such month."""
    if not date:
        return None
    if re.fullmatch(r"\d{8}", date):
        return int(date[:4]), int(date[4:6]), int(date[6:])
    first, middle, last = re.split(r"[-/.]+", date.strip("."))
    if not middle.isdigit():
        if (month := _MONTHS.get(middle[:3].lower())) is None:
            return None
        return int(first), -month, int(last)
    return int(first), int(middle), int(last)


def _numbered(dates: dict[str, tuple[int, int, int] | None]) -> tuple[dict[str, float], str | None]:
    """The number of the day of each date, and what was assumed of their order."""
    orders = {}
    for month_first in (False, True):
        numbers = {text: _day(parts, month_first) for text, parts in dates.items() if parts is not None}
        orders[month_first] = {text: day for text, day in numbers.items() if day is not None}
    day_first, month_first_ = orders[False], orders[True]
    if len(day_first) != len(month_first_):
        return max(day_first, month_first_, key=len), None
    if day_first == month_first_ or len(day_first) < 2:
        return day_first, None
    spans = [max(found.values()) - min(found.values()) for found in (day_first, month_first_)]
    chosen, words = (day_first, "the day") if spans[0] <= spans[1] else (month_first_, "the month")
    return chosen, f"dates begin with {words}, with which the log is shorter"


def _day(parts: tuple[int, int, int], month_first: bool) -> float | None:
    first, middle, last = parts
    if middle < 0:
        year, month, day = (first, -middle, last) if first > 31 else (last, -middle, first)
    elif first > 31:
        year, month, day = first, middle, last
    else:
        year, month, day = (last, first, middle) if month_first else (last, middle, first)
    year += 2000 if year < 100 else 0
    try:
        return float(datetime.date(year, month, day).toordinal())
    except ValueError:
        return None
