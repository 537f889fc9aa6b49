"""The JSON Schema of the study file, for editors that complete and check YAML while it
is written."""

from __future__ import annotations

from typing import Any

from nsdrill.study.schema import study_model
from nsdrill.variables import MODEL


def json_schema(model: str = MODEL) -> dict[str, Any]:
    """JSON Schema (draft 2020-12) of a study of the model of this name, as plain data
    for ``json.dumps``."""
    schema = _tidy(study_model(model=model).model_json_schema(by_alias=True))
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "$id": "urn:nsdrill:study",
        "title": "nsdrill study",
        "description": "A sweep of the coupled axial, torsional and lateral vibration of a drill "
        "string.",
        **schema,
    }


def _tidy(schema: Any) -> Any:
    """Without the titles that pydantic makes of key names, and without defaults of
    null, which say nothing."""
    if isinstance(schema, list):
        return [_tidy(item) for item in schema]
    if not isinstance(schema, dict):
        return schema
    return {
        name: _tidy(value)
        for name, value in schema.items()
        if not (name == "title" and isinstance(value, str))
        and not (name == "default" and value is None)
    }
