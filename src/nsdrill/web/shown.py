"""Words, units, colours and shapes for a page: those of the pictures, as plain text and
plain data."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from nsdrill.analysis.outcome import FAILED_POINT, PENDING_POINT
from nsdrill.models.vocabulary import BY_NAME
from nsdrill.plot.labels import Shown, quantity
from nsdrill.quantity import find
from nsdrill.variables import INFERRED, OK, has_failed

_DOT = "\u0307"  # over the letter before it


def plain(text: str) -> str:
    """A label of a picture without the marks of its mathematics: ``$\\dot r$`` is an r
    with a dot."""
    text = re.sub(r"\\dot\s*(\w)", lambda found: found[1] + _DOT, text)
    return text.replace("$", "")


def told(name: str, units: str) -> dict[str, Any]:
    """Of a quantity its ``name``, ``words``, ``unit``, the ``label`` of an axis and its
    ``long`` name, and how many SI units one ``unit`` is."""
    shown, found = quantity(name, units), find(name)
    return {
        "name": name,
        "words": plain(shown.words),
        "unit": shown.unit,
        "label": plain(shown.label),
        "scale": shown.scale,
        "long": found.long_name if found else name,
    }


def in_words(key: str) -> str:
    """A key of a study in words: ``drive.kind`` is the drive kind."""
    return key.replace(".", " ").replace("_", " ").capitalize()


def number(shown: Shown, value: float) -> str:
    """An SI value as people see it, with its unit."""
    if value != value:  # not measured
        return "–"
    return shown.value(value).strip()


def rows(names: Any, values: Mapping[str, Any], units: str) -> list[list[str]]:
    """Words and values of those quantities that there are."""
    return [
        [plain(quantity(name, units).words), number(quantity(name, units), float(values[name]))]
        for name in names
        if name in values
    ]


def response_styles() -> list[dict[str, str]]:
    """Of each combination of critical responses its name, colour and marker; see
    :mod:`nsdrill.plot.style`."""
    from nsdrill.plot.style import RESPONSES

    return [{"name": one.name, "colour": one.colour, "marker": one.marker} for one in RESPONSES]


def outcome_words(code: int) -> str:
    """What became of a point, by its outcome (:mod:`nsdrill.analysis.outcome`)."""
    from nsdrill.plot.style import RESPONSES

    return {PENDING_POINT: "not run yet", FAILED_POINT: "failed"}.get(code) or RESPONSES[code].name


def classes(name: str) -> list[dict[str, str]]:
    """Of each value of a label its words and a colour."""
    from nsdrill.plot import style

    if name == "motion":
        return [{"name": one.name, "colour": one.colour} for one in style.MOTIONS]
    words = (BY_NAME[name].flag_meanings or "").split()
    colours = (
        style.GREY,
        style.SKY,
        style.GREEN,
        style.ORANGE,
        style.VERMILLION,
        style.WINE,
        style.BLUE,
        style.BLACK,
    )
    return [
        {"name": word.replace("_", " "), "colour": colours[i % 8]} for i, word in enumerate(words)
    ]


def verdict_words(values: Mapping[str, Any]) -> list[str]:
    """In words what a point with these labels is: its responses first."""
    status = int(values.get("status", OK))
    if status == INFERRED:
        return [f"{outcome_words(int(values['response']))} (inferred from its neighbours, not run)"]
    if has_failed(status) or status != OK:
        return [(BY_NAME["status"].flag_meanings or "").split()[status].replace("_", " ")]
    said = [outcome_words(int(values["response"]))]
    for name, value in values.items():
        variable = BY_NAME.get(name)
        if (
            variable is None
            or variable.room != "label"
            or name in ("response", "attractor", "trusted")
        ):
            continue
        words, code = (variable.flag_meanings or "").split(), int(value)
        if name == "period":
            if code:
                said.append(f"period {code}")
        elif name == "settled":
            said.append(words[code].replace("_", " "))
        elif code and code < len(words):
            told_ = words[code].replace("_", " ")
            if name.endswith("_severity"):  # beside the response that it is of, where that is said
                grade, parts = (
                    name.removesuffix("_severity").replace("_", "-"),
                    said[0].split(" + "),
                )
                if there := [i for i, part in enumerate(parts) if part.endswith(grade)]:
                    parts[there[0]] += f" ({told_})"
                    said[0] = " + ".join(parts)
                else:
                    said.append(f"{grade}: {told_}")
            else:
                said.append(f"{told_} whirl" if "whirl" in name else told_)
    if "trusted" in values:
        said.append("checks agree" if int(values["trusted"]) else "checks disagree")
    return list(dict.fromkeys(said))  # two labels may have one word
