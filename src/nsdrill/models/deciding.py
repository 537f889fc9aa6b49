"""Numbers that no sheet of an assembly has, and on which it depends whether a string vibrates."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from operator import attrgetter
from typing import Any

from nsdrill.models.uncertain_onset import FRICTION

# of a bit that cuts the surface which its blades leave, below the section of its rock
OF_SURFACE = ("specific_energy", "zeta", "contact_stress", "wear_length", "friction")


def of_surface(section: str) -> tuple[str, ...]:
    """The keys of a bit that cuts, in the ``section`` of its rock."""
    return tuple(f"{section}.{name}" for name in OF_SURFACE)


def deciding(study: Any, by_response: Mapping[str, Iterable[str]]) -> dict[str, list[str]]:
    """Of the keys that act on each response those that the string of a ``study`` reads, and the study does not vary;
    of the friction of the bit those that its law has."""
    unasked = {*study.axes, *study.drawn, *getattr(study.parameters, "unread", ())}
    found = {
        name: [key for key in keys if key in study.keys.leaves and key not in unasked and _has(study, key)]
        for name, keys in by_response.items()
    }
    return {name: keys for name, keys in found.items() if keys}


def _has(study: Any, key: str) -> bool:
    """Whether a number stands in the study; one of friction may be none."""
    return key not in FRICTION or attrgetter(key)(study.parameters) is not None
