"""Words, units, colours and shapes for a page: those of the pictures, as plain text and
plain data; and the sliders of the numbers and words of a study that a page may
change."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping

import numpy as np

from nsdrill.analysis.counts import NOT_CARRIED
from nsdrill.analysis.safety import FAILED_POINT, NOT_CARRIED_POINT, PENDING_POINT
from nsdrill.data import Answer, Attributes, Resolved, flat
from nsdrill.figures import style
from nsdrill.models.registry import BY_NAME, named_in, responses_in
from nsdrill.models.responses import RESPONSE_KINDS
from nsdrill.quantity import find
from nsdrill.study.keys import Keys, Leaf
from nsdrill.study.study import Study
from nsdrill.variables import INFERRED, OK, dimension_of
from nsdrill.words.labels import Shown, quantity

# of outcomes that are not known
UNKNOWN_WORDS = {PENDING_POINT: "not run yet", FAILED_POINT: "failed", NOT_CARRIED_POINT: NOT_CARRIED}
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


def response_styles(attrs: Attributes) -> list[dict[str, str]]:
    """The name, colour and marker of each combination of the critical responses of the
    model of a file; see :mod:`nsdrill.figures.style`."""
    return [{"name": one.name, "colour": one.colour, "marker": one.marker} for one in style.styles_of(attrs)]


def outcome_words(code: int, attrs: Attributes) -> str:
    """The outcome of a point (:mod:`nsdrill.analysis.probability`) in words, of a file with the
    root attributes ``attrs``."""
    return UNKNOWN_WORDS.get(code) or style.styles_of(attrs)[code].name


def classes(name: str, attrs: Attributes) -> list[dict[str, str]]:
    """The words and the colour of each value of a label of a file with the root attributes
    ``attrs``."""
    if name == "response":
        return response_styles(attrs)
    if name == "motion":
        return [{"name": motion.name, "colour": motion.colour} for motion in style.MOTIONS]
    words = (named_in(attrs)[name].flag_meanings or "").split()
    if name.endswith("_severity"):  # from none to the worst
        colours: tuple[str, ...] = style.BAD_TO_GOOD[::-1]
    else:
        colours = (*style.KIND_COLOURS, style.WINE, style.BLACK)
    return [{"name": word.replace("_", " "), "colour": colours[i % len(colours)]} for i, word in enumerate(words)]


def label_words(values: Mapping[str, float], attrs: Attributes, outcome: int | None = None) -> list[str]:
    """The labels of a point in words: its responses first, or those of its ``outcome``
    (:func:`nsdrill.analysis.safety.known_outcome`) where a file tells it."""
    status = int(values.get("status", OK))
    if status == INFERRED:
        return [f"{outcome_words(int(values['response']), attrs)} (inferred from its neighbours, not run)"]
    if status != OK:
        return [BY_NAME["status"].words(status).replace("_", " ")]
    texts = [outcome_words(int(values["response"]) if outcome is None else outcome, attrs)]
    own = {one.severity.name: one.words for one in responses_in(attrs).values() if one.is_own and one.severity}
    for name, value in values.items():
        variable = named_in(attrs).get(name)
        if variable is None or variable.origin != "label" or name in ("response", "attractor", "trusted"):
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
                severity = own.get(name) or name.removesuffix("_severity").replace("_", "-")
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


CONTINUOUS = ("quantity", "number")  # kinds of leaves that vary without a step
DEFAULT_SLIDERS = ("rotary_speed", "wob", "depth")  # the sliders that a page of a drill string opens with


def first_sliders(study: Study) -> tuple[str, ...]:
    """The sliders that a page opens with: those of the operating point, or of the axes that
    are swept."""
    names = study.operation.names()
    own = tuple(name for name in names if name not in DEFAULT_SLIDERS)
    return (*(name for name in DEFAULT_SLIDERS if name in names), *own)


def adjustable(keys: Keys) -> dict[str, Leaf]:
    """The ``keys`` of a study that may change while the string rotates: numbers and
    choices of a word."""
    physical = (*keys.model.sections, "operation")
    fixed = keys.model.deciding  # another choice of these changes the units of a number
    words = {key: leaf for key, leaf in keys.leaves.items() if leaf.kind == "choice" and key not in fixed}
    return {
        name: leaf
        for name, leaf in {**keys.axes, **words}.items()
        if leaf.kind in (*CONTINUOUS, "whole", "choice") and leaf.key.partition(".")[0] in physical
    }


def sliders(study: Study, units: str, leaves: Mapping[str, Leaf]) -> list[Answer]:
    """The numbers of ``study`` among ``leaves`` that may change while the string rotates, each with
    its range, and the words, each with its ``choices``."""
    rows: list[Answer] = []
    axes = study.axes
    for name, leaf in leaves.items():
        value = value_at(study.resolved, leaf.key)
        if leaf.kind == "choice":
            if value is not None:
                rows.append(
                    {
                        "key": name,
                        "words": in_words(name),
                        "meaning": leaf.meaning,
                        "value": value,
                        "choices": list(leaf.choices),
                    }
                )
            continue
        axis = axes.get(name, np.empty(0))
        if not isinstance(value, float) or (known := find(name)) is None:
            continue
        if leaf.kind == "whole":
            low, high = leaf.low, min(leaf.high, max(4 * value, 8.0))
        elif len(axis) > 1:
            value, room = float(axis[len(axis) // 2]), 0.25 * float(axis[-1] - axis[0])
            low, high = float(axis[0]) - room, float(axis[-1]) + room
        elif value:
            low, high = sorted((0.25 * value, 2.5 * value))
        else:
            low, high = 0.0, min(leaf.high, 1.0)
        low, high = max(low, leaf.low), min(high, leaf.high)
        if low <= 0.0 < leaf.low or (name in DEFAULT_SLIDERS and low <= 0.0):
            low = max(leaf.low, 0.02 * high)
        shown = quantity_data(dimension_of(name), units)
        rows.append(
            {
                "key": name,
                "words": shown["words"],
                "unit": shown["unit"],
                "scale": shown["scale"],
                "meaning": leaf.meaning or known.long_name,
                "low": low,
                "high": high,
                "value": value,
                "whole": leaf.kind == "whole",
            }
        )
    return rows


def value_at(resolved: Resolved, key: str) -> float | str | None:
    """The number or the word at a dotted key; None where there is neither."""
    value = dict(flat(resolved)).get(key)
    if isinstance(value, str):
        return value
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else None
