"""Which numbers that no sheet has decide on an answer, in a sentence for a rig."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence

from nsdrill.data import Answer
from nsdrill.quantity import find

# where a rig has other words for them: by section, by name below the section of a bit, or by key
WORDS = {
    "bit.friction": "bit friction",
    "bit.surface_amplitude": "lobe height",
    "bit.rock_stiffness": "rock stiffness",
    "mud.added_mass": "added mass of the mud",
    "mud.swirl": "rotation of the mud",
    "segments.material_damping": "damping of the steel",
    "segments.rock_damping": "damping of the rock",
    "segments.top": "damping at the top",
    "specific_energy": "strength of the rock",
    "zeta": "direction of the cutting force",
    "contact_stress": "wear",
    "wear_length": "wear",
    "friction": "friction of the wear flats",
}


def deciding_words(found: Mapping[str, Answer], responses: Container[str]) -> str:
    """The numbers that act on the ``responses`` of a model, those that the study gives first; "" where none is known
    to."""
    of_these = [each for name, each in found.items() if name in responses]
    given, default = (
        dict.fromkeys(_words_of(key) for each in of_these for key in each[which]) for which in ("given", "default")
    )
    estimates = f"Estimates of {_listed([*given])} decide." if given else ""
    others = _listed([words for words in default if words not in given])
    so = "So do these, as by default:" if given else "These decide, as by default:"
    return " ".join(filter(None, (estimates, f"{so} {others}." if others else "")))


def _listed(texts: Sequence[str]) -> str:
    head, _, last = ", ".join(texts).rpartition(", ")
    return f"{head} and {last}" if head else last


def _words_of(key: str) -> str:
    """What a rig calls a number of a study."""
    section, _, name = key.rpartition(".")
    names = (section, *([name] if section in ("bit", "bit.rock") else []), key)
    shown = find(key)
    plain = name.replace("_", " ") if shown is None else shown.words
    return next((WORDS[one] for one in names if one in WORDS), plain)
