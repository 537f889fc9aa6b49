"""The models. ``Model`` is the class of all of them (:mod:`.base`), imported late."""

from typing import Any


def __getattr__(name: str) -> Any:
    if name == "Model":
        from nsdrill.models.base import Model

        return Model
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
