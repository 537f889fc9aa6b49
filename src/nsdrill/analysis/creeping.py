"""Contacts with friction of a script that count as stuck while they slide: the slip is on the rising
branch of a law that is smoothed too much for it, where friction is that of a damper."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from nsdrill.data import Answer, Array, Attributes, Results
from nsdrill.errors import count
from nsdrill.models.registry import model_in
from nsdrill.variables import CREEP, OK, Variable

# Of the mean square slip: one that sticks and slips, with a smoothing that tells these apart, has some
# 0.01 of it while it sticks, and one that swings by no more than 1.6 times the greatest slip that counts
# as stuck has a tenth
MOST_CREEP = 0.1


def of_creep(attrs: Attributes) -> list[Variable]:
    """The features that tell of contacts of scripts how much of their slip counts as stuck."""
    return [one for one in model_in(attrs).features if one.name.endswith(CREEP.format(""))]


def creeping(results: Results) -> Answer:
    """In how many (``runs``) of the runs that ended well (``of``) a contact with friction slides
    while it counts as stuck, by its name; empty where none does."""
    ended = np.asarray(results["status"]) == OK
    variables = results.variables
    return creeping_in_parts(results.attrs, {name: np.asarray(variables[name])[ended] for name in variables})


def creeping_in_parts(attrs: Attributes, parts: Mapping[str, Array]) -> Answer:
    """As :func:`creeping`, of the features by their names; what is no number is not known, and
    does not count."""
    found = {}
    for variable in of_creep(attrs):
        known = parts.get(variable.name, np.zeros(0))
        known = known[np.isfinite(known)]
        if runs := int(np.count_nonzero(known > MOST_CREEP)):
            found[variable.name.removesuffix(CREEP.format(""))] = {"runs": runs, "of": int(known.size)}
    return found


def creeping_words(found: Mapping[str, Answer], what: str = "run") -> str:
    """What :func:`creeping` has found, in words; each is of ``what``."""
    parts = [f"{name} in {one['runs']} of {count(one['of'], what)}" for name, one in found.items()]
    return (
        f"{', '.join(parts)}. There a contact counts as stuck, as its slip is below 6.3 / smoothing, and slides: this "
        "slip is no small part of all, and friction rises with it as that of a damper does. Make smoothing greater, "
        "until 6.3 / smoothing is far below the speeds at which the contact slides"
    )
