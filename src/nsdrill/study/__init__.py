"""The study: what a user asks for, read from YAML, validated, in SI.

Imported lazily, so that ``import nsdrill.study.study`` does not bring
ruamel.yaml with it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from nsdrill.late import late

if TYPE_CHECKING:
    from nsdrill.study.load import change_thresholds, load_study, parse_study
    from nsdrill.study.schema import json_schema
    from nsdrill.study.study import Study, study_from_resolved
    from nsdrill.study.write import short_text, template_text

__all__ = [
    "Study",
    "change_thresholds",
    "json_schema",
    "load_study",
    "parse_study",
    "short_text",
    "study_from_resolved",
    "template_text",
]

__getattr__ = late(
    __name__,
    {
        "Study": "nsdrill.study.study",
        "change_thresholds": "nsdrill.study.load",
        "json_schema": "nsdrill.study.schema",
        "load_study": "nsdrill.study.load",
        "parse_study": "nsdrill.study.load",
        "short_text": "nsdrill.study.write",
        "study_from_resolved": "nsdrill.study.study",
        "template_text": "nsdrill.study.write",
    },
)
