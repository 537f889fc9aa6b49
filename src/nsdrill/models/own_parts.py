"""What a study uses of scripts beside its model: drives and laws of friction, by what they
are and their names, as files, messages and other processes need them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import reduce
from typing import Protocol, get_args, get_type_hints

from nsdrill.data import Resolved, found_at
from nsdrill.kernel.own_pairs import own_pair, own_pair_names
from nsdrill.kernel.settings import Simulation
from nsdrill.models.choices import words_of
from nsdrill.models.friction import CONTACTS, own_law, own_laws
from nsdrill.models.own_drives import own_drive
from nsdrill.models.registry import (
    import_additions,
    import_modules,
    model_names,
    own_features,
    scripted,
    take_for_model,
)
from nsdrill.origin import Origin
from nsdrill.variables import MODEL

PAIR = "simulation.pair"
CHOICES = {PAIR: "pair", "drive.kind": "drive", **{f"{contact}.law": "law" for contact in CONTACTS}}


class Part(Protocol):
    """What a script makes: its origin, and the digest of what it computes."""

    @property
    def origin(self) -> Origin: ...
    @property
    def digest(self) -> str: ...


FIND: dict[str, Callable[[str], Part | None]] = {"drive": own_drive, "law": own_law, "pair": own_pair}


def own_part(name: str) -> Part | None:
    """The drive or the law of a script by this name, ``drive unwinding``, None where it is
    unknown."""
    what, _, word = name.partition(" ")
    return FIND[what](word) if what in FIND else None


_again: dict[str, Callable[[], None]] = {}


def remember(name: str, again: Callable[[], None]) -> None:
    """Keep what reads ``again`` what a script made by this name, ``model duffing``, ``features
    torsion`` or that of a part: what its functions read from around them may have another
    value when it is used."""
    _again[name] = again


def read_again(model: str, parts: Iterable[str]) -> None:
    """Read what scripts made again, as a study of this model with these parts is used."""
    laws = [f"law {word}" for word in own_laws()] if scripted(model) is not None else []  # its equations name them
    known = [name for name in dict.fromkeys((*laws, *parts)) if own_part(name) is not None]
    known += [f"features {model}"] if own_features(model) else []
    known += [f"model {model}"] if scripted(model) is not None else []
    for name in known:
        if name in _again:
            _again[name]()


def parts_of_string(parameters: object) -> list[Part]:
    """The drive and the laws of scripts that a string with these parameters has."""
    words = ((what, reduce(_or_none, key.split("."), parameters)) for key, what in CHOICES.items() if key != PAIR)
    found = (FIND[what](word) for what, word in words if isinstance(word, str))
    return [part for part in found if part is not None]


def places_of_parts(parameters: object) -> list[str]:
    """Where the drive and the laws of scripts that a string has stand, in words."""
    return [str(part.origin) for part in parts_of_string(parameters)]


def _or_none(section: object, name: str) -> object:
    return getattr(section, name, None)


def find_words(study: object) -> None:
    """Import what packages add to the model of a study, as it was read, and all that they make
    where it names a model, a drive or a law that is not known yet. What scripts made of it is
    read again."""
    named = [("model", study["model"])] if isinstance(study, dict) and "model" in study else []
    for key in CHOICES:
        words = [found_at(study, key) if isinstance(study, dict) else None]
        sweep = found_at(study, "sweep") if isinstance(study, dict) else None
        along = sweep.get(key) if isinstance(sweep, dict) else None
        words += along if isinstance(along, list) else []
        named += [(key, word) for word in words]
    for key, word in named:
        if isinstance(word, str) and word not in _words(key):
            import_modules()
            if key == "model" and word not in _words(key):
                take_for_model(word)
            break
    model = study.get("model", MODEL) if isinstance(study, dict) else MODEL
    if isinstance(model, str):
        import_additions(model)
        read_again(model, [f"{CHOICES[key]} {word}" for key, word in named if key in CHOICES])


def _words(key: str) -> tuple[str, ...]:
    """The words that a choice may have now."""
    if key == "model":
        return model_names()
    return (*get_args(get_type_hints(Simulation)["pair"]), *own_pair_names()) if key == PAIR else words_of(key)


def parts_in(resolved: Resolved) -> dict[str, Part]:
    """What a resolved study uses of scripts, by name."""
    found: dict[str, Part] = {}
    for key, what in CHOICES.items():
        along = resolved.get("sweep", {}).get(key, [])
        for word in (found_at(resolved, key), *(along if isinstance(along, list) else [])):
            if isinstance(word, str) and (part := FIND[what](word)) is not None:
                found[f"{what} {word}"] = part
    return found
