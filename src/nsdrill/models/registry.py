"""The models by the names that a study gives them. A new one is a folder beside these and a line here."""

from __future__ import annotations

from functools import lru_cache
from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from nsdrill.models.base import Model

DEFAULT = "christoforou_yigit"
# Where each is found: imported when it is asked for.
_HOME = {DEFAULT: "nsdrill.models.christoforou_yigit:ChristoforouYigit"}
NAMES = tuple(_HOME)


@lru_cache
def model_named(name: str) -> Model:
    """The model of this name. KeyError where there is none."""
    module, _, made = _HOME[name].partition(":")
    model: Model = getattr(import_module(module), made)()
    return model
