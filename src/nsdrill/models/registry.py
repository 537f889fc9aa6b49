"""The models by the names that a study gives them.

A new one is a folder or a file beside these and a line here; or a module of another package that has an entry point of
the group ``nsdrill.models``: its name is that of the model, and the module holds a ``DESCRIPTION`` and a ``MODEL``.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from importlib import import_module
from importlib.metadata import entry_points
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
    "segments": ("nsdrill.models.segments.description:DESCRIPTION", "nsdrill.models.segments.model:Segments"),
    "beam": ("nsdrill.models.beam.description:DESCRIPTION", "nsdrill.models.beam.model:ElasticCollar"),
    "torsion": ("nsdrill.models.torsion:DESCRIPTION", "nsdrill.models.torsion:Torsion"),
}


def _installed() -> dict[str, tuple[str, str]]:
    """The models of other packages; none replaces one of these."""
    found = entry_points(group="nsdrill.models")
    return {one.name: (f"{one.value}:DESCRIPTION", f"{one.value}:MODEL") for one in found if one.name not in _HOME}


_HOME |= _installed()
NAMES = tuple(_HOME)


def _at(place: str) -> Any:
    module, _, name = place.partition(":")
    return getattr(import_module(module), name)


@lru_cache
def described(name: str) -> Description:
    """The description of the model of this name. KeyError where there is none, InputError where it names variables that
    the model has not."""
    found: Description = _at(_HOME[name][0])
    if unknown := found.unknown():
        raise InputError(
            f"the model {name}: found {'; '.join(unknown)} in its description; allowed: what stands there among its "
            "features, labels, peaks, section and own_trace."
        )
    return found


@lru_cache
def model_named(name: str) -> Model:
    """The model of this name. KeyError where there is none."""
    made: Model = _at(_HOME[name][1])()
    return made


def model_in(attrs: Mapping[str, Any]) -> Description:
    """The description of the model that a file with the root attributes ``attrs`` was made with; of files that name
    none the default one."""
    return described(str(attrs.get("model") or MODEL))


def drawn_in(attrs: Mapping[str, Any]) -> Drawn:
    """What pictures show of a file with the root attributes ``attrs``: nothing of motions that are frozen."""
    return model_in(attrs).drawn.without(frozen_modes(attrs))
