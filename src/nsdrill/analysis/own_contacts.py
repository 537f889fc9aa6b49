"""Contacts of a script whose numbers mislead: one with friction that counts as stuck while it slides,
on the rising branch of a law that is smoothed too much for its slip, where friction is that of a
damper; and one that steps jump over."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from nsdrill.data import Answer, Array, Attributes, Results
from nsdrill.errors import count
from nsdrill.models.registry import model_in
from nsdrill.variables import CREEP, OK, STEPPED, Variable

# Of the mean square slip: one that sticks and slips, with a smoothing that tells these apart, has some
# 0.01 of it while it sticks, and one that swings by no more than 1.6 times the greatest slip that counts
# as stuck has a tenth
MOST_CREEP = 0.1
# Of the time of a contact: one whose force the steps feel lies within none, but where it grazes
MOST_STEPPED = 0.02
ENDINGS = (CREEP.format(""), STEPPED.format(""))


def of_contacts(attrs: Attributes) -> list[str]:
    """The names of the features that tell of either."""
    return [one.name for told in (CREEP, STEPPED) for one in _features(attrs, told)]


def _features(attrs: Attributes, told: str) -> list[Variable]:
    return [one for one in model_in(attrs).features if one.name.endswith(told.format(""))]


def creeping(results: Results) -> Answer:
    """In how many (``runs``) of the runs that ended well (``of``) a contact with friction slides
    while it counts as stuck, by its name; empty where none does."""
    return creeping_in_parts(results.attrs, _ended(results))


def creeping_in_parts(attrs: Attributes, parts: Mapping[str, Array]) -> Answer:
    """As :func:`creeping`, of the features by their names; what is no number is not known, and
    does not count."""
    return _above(attrs, parts, CREEP, MOST_CREEP)


def creeping_words(found: Mapping[str, Answer], what: str = "run") -> str:
    """What :func:`creeping` has found, in words; each is of ``what``."""
    return (
        f"{_told(found, what)}. There a contact counts as stuck, as its slip is below 6.3 / smoothing, and slides. "
        "This slip is no small part of all, and friction rises with it as that of a damper. Make smoothing greater, "
        "until 6.3 / smoothing is far below the speeds at which the contact slides"
    )


def stepped_over(results: Results) -> Answer:
    """In how many (``runs``) of the runs that ended well (``of``) a contact lies within single
    steps, by its name; empty where none does."""
    return _above(results.attrs, _ended(results), STEPPED, MOST_STEPPED)


def stepped_over_words(found: Mapping[str, Answer]) -> str:
    """What :func:`stepped_over` has found, in words."""
    return (
        f"{_told(found, 'run')}. There a contact closes and opens again within one step, which may not feel its force, "
        "and the motion may be that without it, whatever a check with a smaller tolerance says. Make simulation.rtol "
        "smaller until none is named, or the contact thicker"
    )


def _ended(results: Results) -> dict[str, Array]:
    variables = results.variables
    if not any([name.endswith(ENDINGS) for name in variables]):  # before the model is looked at
        return {}
    ended = np.asarray(results["status"]) == OK
    return {name: np.asarray(variables[name])[ended] for name in of_contacts(results.attrs) if name in variables}


def _above(attrs: Attributes, parts: Mapping[str, Array], told: str, most: float) -> Answer:
    found: Answer = {}
    for variable in _features(attrs, told) if parts else ():
        known = parts.get(variable.name, np.zeros(0))
        known = known[np.isfinite(known)]
        if runs := int(np.count_nonzero(known > most)):
            found[variable.name.removesuffix(told.format(""))] = {"runs": runs, "of": int(known.size)}
    return found


def _told(found: Mapping[str, Answer], what: str) -> str:
    return ", ".join(f"{name} in {one['runs']} of {count(one['of'], what)}" for name, one in found.items())
