"""Words, units, colours and shapes for a page: those of the pictures, as plain text and
plain data."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping

from nsdrill.analysis.probability import FAILED_POINT, PENDING_POINT
from nsdrill.data import Answer
from nsdrill.models.registry import BY_NAME
from nsdrill.models.responses import RESPONSE_KINDS
from nsdrill.plot import style
from nsdrill.plot.labels import Shown, quantity
from nsdrill.plot.style import RESPONSES
from nsdrill.quantity import find
from nsdrill.variables import INFERRED, OK

_DOT = "\u0307"  # over the letter before it


def plain(text: str) -> str:
    """A label of a picture without its mathematical markup: ``$\\dot r$`` is an r with
    a dot."""
    text = re.sub(r"\\dot\s*(\w)", lambda match: match[1] + _DOT, text)
    return text.replace("$", "")


def quantity_data(name: str, units: str) -> Answer:
    """A quantity as plain data:

    * ``name``, ``words`` and the ``long`` name,
    * ``unit``, and ``label`` for an axis,
    * ``scale``: how many SI units one ``unit`` is.
    """
    shown, known = quantity(name, units), find(name)
    return {
        "name": name,
        "words": plain(shown.words),
        "unit": shown.unit,
        "label": plain(shown.label),
        "scale": shown.scale,
        "long": known.long_name if known else name,
    }


def in_words(key: str) -> str:
    """A key of a study in words: ``drive.kind`` is the drive kind."""
    return key.replace(".", " ").replace("_", " ").capitalize()


def value_text(shown: Shown, value: float) -> str:
    """An SI value in the unit that is shown, with that unit; a dash for NaN."""
    if value != value:  # not measured
        return "–"
    return shown.value(value).strip()


def value_rows(names: Iterable[str], values: Mapping[str, float], units: str) -> list[list[str]]:
    """Words and values of those ``names`` that ``values`` has."""
    return [
        [plain(quantity(name, units).words), value_text(quantity(name, units), float(values[name]))]
        for name in names
        if name in values
    ]


def response_styles() -> list[dict[str, str]]:
    """The name, colour and marker of each combination of critical responses; see
    :mod:`nsdrill.plot.style`."""
    return [{"name": style.name, "colour": style.colour, "marker": style.marker} for style in RESPONSES]


def outcome_words(code: int) -> str:
    """The outcome of a point (:mod:`nsdrill.analysis.probability`) in words."""
    return {PENDING_POINT: "not run yet", FAILED_POINT: "failed"}.get(code) or RESPONSES[code].name


def classes(name: str) -> list[dict[str, str]]:
    """The words and the colour of each value of a label."""
    if name == "motion":
        return [{"name": motion.name, "colour": motion.colour} for motion in style.MOTIONS]
    words = (BY_NAME[name].flag_meanings or "").split()
    if name.endswith("_severity"):  # from none to the worst
        colours: tuple[str, ...] = style.BAD_TO_GOOD[::-1]
    else:
        colours = (*style.KIND_COLOURS, style.WINE, style.BLACK)
    return [{"name": word.replace("_", " "), "colour": colours[i % len(colours)]} for i, word in enumerate(words)]


def label_words(values: Mapping[str, float]) -> list[str]:
    """The labels of a point in words: its responses first."""
    status = int(values.get("status", OK))
    if status == INFERRED:
        return [f"{outcome_words(int(values['response']))} (inferred from its neighbours, not run)"]
    if status != OK:
        return [BY_NAME["status"].words(status).replace("_", " ")]
    texts = [outcome_words(int(values["response"]))]
    for name, value in values.items():
        variable = BY_NAME.get(name)
        if variable is None or variable.room != "label" or name in ("response", "attractor", "trusted"):
            continue
        meanings, code = (variable.flag_meanings or "").split(), int(value)
        if name == "period":
            if code:
                texts.append(f"period {code}")
        elif name == "settled":
            texts.append(meanings[code].replace("_", " "))
        elif code and code < len(meanings):
            meaning = meanings[code].replace("_", " ")
            if name.endswith("_severity"):  # behind the name of its response, if that occurs
                severity = name.removesuffix("_severity").replace("_", "-")
                responses = texts[0].split(" + ")
                if matches := [i for i, word in enumerate(responses) if word.endswith(severity)]:
                    responses[matches[0]] += f" ({meaning})"
                    texts[0] = " + ".join(responses)
                else:
                    texts.append(f"{severity}: {meaning}")
            else:
                texts.append(f"{meaning} {RESPONSE_KINDS[name].words}" if name in RESPONSE_KINDS else meaning)
    if "trusted" in values:
        texts.append("checks agree" if int(values["trusted"]) else "checks disagree")
    return list(dict.fromkeys(texts))  # two labels may have the same words
