"""The models by the names that a study gives them.

A new one is a folder or a file beside these and a line here; or a module of another
package that has an entry point of the group ``nsdrill.models``: its name is that of the
model, and the module holds a ``DESCRIPTION`` and a ``MODEL``.
"""

from __future__ import annotations

import hashlib
import sys
import traceback
from collections.abc import Mapping
from functools import lru_cache
from importlib import import_module
from importlib.metadata import entry_points
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nsdrill.data import frozen_modes
from nsdrill.errors import InputError
from nsdrill.variables import MODEL

if TYPE_CHECKING:
    from nsdrill.models.base import Model
    from nsdrill.models.description import Description, Drawn

# Where each has its description and what computes: imported when it is asked for.
_HOME = {
    MODEL: (
        "nsdrill.models.christoforou_yigit.description:DESCRIPTION",
        "nsdrill.models.christoforou_yigit.model:ChristoforouYigit",
    ),
    "segments": (
        "nsdrill.models.segments.description:DESCRIPTION",
        "nsdrill.models.segments.model:Segments",
    ),
    "beam": (
        "nsdrill.models.beam.description:DESCRIPTION",
        "nsdrill.models.beam.model:ElasticCollar",
    ),
    "torsion": ("nsdrill.models.torsion:DESCRIPTION", "nsdrill.models.torsion:Torsion"),
}


def _installed() -> dict[str, tuple[str, str]]:
    """The models of other packages; none replaces one of these."""
    found = entry_points(group="nsdrill.models")
    return {
        one.name: (f"{one.value}:DESCRIPTION", f"{one.value}:MODEL")
        for one in found
        if one.name not in _HOME
    }


_OWN = tuple(_HOME)
_HOME |= _installed()
NAMES = tuple(_HOME)


def _at(place: str) -> Any:
    """What stands at ``place``. InputError where that is in another package and cannot
    be had."""
    module, _, name = place.partition(":")
    try:
        return getattr(import_module(module), name)
    except Exception as error:
        if module.startswith("nsdrill."):
            raise
        where = [
            frame
            for frame in traceback.extract_tb(error.__traceback__)
            if "importlib" not in frame.filename
        ][-1]
        raise InputError(
            f"the model in {module}: {type(error).__name__}: {error} ({where.filename}, line "
            f"{where.lineno}); allowed: "
            "a module that holds a DESCRIPTION and a MODEL."
        ) from error


@lru_cache
def described(name: str) -> Description:
    """The description of the model of this name. KeyError where there is none,
    InputError where it names variables that the model has not."""
    found: Description = _at(_HOME[name][0])
    if unknown := found.unknown():
        raise InputError(
            f"the model {name}: found {'; '.join(unknown)} in its description; allowed: what "
            f"stands there among its "
            "features, labels, peaks, section and own_trace."
        )
    if name not in _OWN:
        _check_meanings(name, found)
    return found


def _check_meanings(name: str, found: Description) -> None:
    """InputError where a model of another package gives a name another meaning than it
    has in a model of this one."""
    for room in ("variables", "trace_and_states"):
        known = [(own, variable) for own in _OWN for variable in getattr(described(own), room)]
        for one in getattr(found, room):
            there = [(own, it.units, it.long_name) for own, it in known if it.name == one.name]
            if there and not any(
                tuple(meaning) == (one.units, one.long_name) for _, *meaning in there
            ):
                own, units, words = there[0]
                raise InputError(
                    f"the model {name}: found the variable {one.name}, {one.long_name} "
                    f"[{one.units}], which is {words} "
                    f"[{units}] in the model {own}; allowed: another name, or that variable as "
                    "nsdrill.models.vocabulary has it."
                )


def other_packages() -> tuple[str, ...]:
    """The models of other packages that this process has looked at: what goes wrong
    with one may be its own fault."""
    return tuple(
        name
        for name in NAMES
        if name not in _OWN and _HOME[name][0].partition(":")[0] in sys.modules
    )


@lru_cache
def sources_of(name: str) -> str:
    """Digest of the Python files of the package from which the model of this name
    comes, "" of a model of nsdrill: those are in the digest of what is compiled.
    "unknown" where it is not installed."""
    if name in _OWN:
        return ""
    top = _HOME[name][0].partition(":")[0].partition(".")[0] if name in _HOME else ""
    spec = find_spec(top) if top else None
    if spec is None:
        return "unknown"
    roots = [Path(place) for place in spec.submodule_search_locations or ()]
    files = [
        (file.relative_to(root).as_posix(), file)
        for root in roots
        for file in sorted(root.rglob("*.py"))
    ]
    if not roots and spec.origin:
        files = [(Path(spec.origin).name, Path(spec.origin))]
    digest = hashlib.sha256()
    for place, file in files:
        digest.update(place.encode() + b"\0" + file.read_bytes() + b"\0")
    return digest.hexdigest()[:16]


@lru_cache
def model_named(name: str) -> Model:
    """The model of this name. KeyError where there is none."""
    made: Model = _at(_HOME[name][1])()
    return made


def model_in(attrs: Mapping[str, Any]) -> Description:
    """The description of the model that a file with the root attributes ``attrs`` was
    made with; of files that name none the default one."""
    return described(str(attrs.get("model") or MODEL))


def drawn_in(attrs: Mapping[str, Any]) -> Drawn:
    """What pictures show of a file with the root attributes ``attrs``: nothing of
    motions that are frozen."""
    return model_in(attrs).drawn.without(frozen_modes(attrs))
