"""The numbers and words of a study that a page may change: their sliders, and the
changes and the state that a request has of them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from nsdrill.data import Answer, Array, Resolved
from nsdrill.errors import InputError
from nsdrill.quantity import find
from nsdrill.study.keys import Keys, Leaf
from nsdrill.study.study import Study
from nsdrill.variables import dimension_of
from nsdrill.web import asked
from nsdrill.web.asked import Request
from nsdrill.web.shown import in_words, quantity_data

if TYPE_CHECKING:
    from nsdrill.web.session import Session

CONTINUOUS = ("quantity", "number")  # kinds of leaves that vary without a step
DEFAULT_SLIDERS = ("rotary_speed", "wob", "depth")  # the sliders that a page opens with


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


def changes(session: Session, request: Request) -> dict[str, str]:
    """The changed keys with their values as a study writes them. In a request,
    numbers are in SI and texts have a unit."""
    wanted = request.get("changes") or {}
    if not isinstance(wanted, dict):
        raise InputError("changes: found something else; allowed: a mapping by keys.")
    texts = {}
    for key, value in wanted.items():
        leaf = session.adjustable.get(key)
        if leaf is None:
            raise InputError(f"{str(key)[:60]}: found an unknown key; allowed: a number or a word of the study.")
        if leaf.kind == "whole" and isinstance(value, float) and value.is_integer():
            value = int(value)
        if isinstance(value, str) and len(value) <= 60 and not set(value) & set("{}[]&*!|>%@`#:,\"'\n"):
            texts[key] = value
        elif (number := asked.finite(value)) is not None and leaf.low <= number <= leaf.high:
            texts[key] = leaf.text(value if leaf.kind == "whole" else number)
        else:
            raise InputError(f"{key}: found {str(value)[:60]}; allowed: {leaf.allowed()}.")
    return texts


def start_state(session: Session, request: Request, study: Study) -> Array | None:
    """The state of the request in the states of the string of ``study``, which may
    differ from those of the page: another drive has others. None where the request
    has no state."""
    state, names = asked.state(request), request.get("states")
    if state is None or names is None:
        return state
    if not isinstance(names, list) or len(names) != len(state) or not all(isinstance(name, str) for name in names):
        raise InputError("states: found something else; allowed: the names of the state.")
    return session.motions.fitted(study, dict(zip(names, state.tolist(), strict=True)))


def value_at(resolved: Resolved, key: str) -> float | str | None:
    """The number or the word at a dotted key; None where there is neither."""
    value: object = resolved
    for part in key.split("."):
        value = value.get(part) if isinstance(value, dict) else None
    if isinstance(value, str):
        return value
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else None
