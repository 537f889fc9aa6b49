"""The study: what a user asks for, read from YAML, validated, in SI.

Imported lazily, so that ``import nsdrill.study.study`` brings neither pydantic nor ruamel.yaml with it.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from nsdrill.study.editor_schema import json_schema
    from nsdrill.study.load import change_thresholds, load_study, parse_study
    from nsdrill.study.resolved import differences, study_from_resolved
    from nsdrill.study.study import Study
    from nsdrill.study.template import template_text

__all__ = [
    "Study",
    "change_thresholds",
    "differences",
    "json_schema",
    "load_study",
    "parse_study",
    "study_from_resolved",
    "template_text",
]

_HOME = {
    "Study": "study",
    "change_thresholds": "load",
    "differences": "resolved",
    "json_schema": "editor_schema",
    "load_study": "load",
    "parse_study": "load",
    "study_from_resolved": "resolved",
    "template_text": "template",
}


def __getattr__(name: str) -> Any:
    if name in _HOME:
        return getattr(import_module(f"nsdrill.study.{_HOME[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
