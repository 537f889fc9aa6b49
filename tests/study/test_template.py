"""What `nsdrill new` and `nsdrill schema` give: complete, and true to the dataclasses."""

import json
import re

import pytest

from nsdrill.kernel.settings import Simulation
from nsdrill.models.christoforou_yigit.parameters import Initial, Parameters
from nsdrill.models.operation import Operation
from nsdrill.models.responses import Thresholds
from nsdrill.models.sections import MEANINGS as OF_MODELS
from nsdrill.observe.thresholds import Record
from nsdrill.study import json_schema, parse_study, template_text
from nsdrill.study.continuation import Continue
from nsdrill.study.keys import MEANINGS, SLICE, keys_named
from nsdrill.study.read import parse
from nsdrill.study.uncertain import HOW

SWEEP_KEYS = {f"sweep.{name}" for name in ("depth", "wob", "rotary_speed", "procedure", "along", "refine")}


def test_the_template_is_the_defaults() -> None:
    study = parse_study(template_text())
    assert study.parameters == Parameters()
    assert study.operation == Operation()
    assert study.initial == Initial()
    assert study.simulation == Simulation()
    assert study.thresholds == Thresholds()
    assert study.record == Record()
    assert study.sha256 == parse_study("sweep: {depth: {from: 500 m, to: 9000 m, points: 86}}").sha256


def test_the_template_has_every_key_with_its_meaning() -> None:
    text = template_text()
    lines = {".".join(map(str, path)): place.line for path, place in parse(text, "t").keys.items()}
    assert set(keys_named().leaves) <= set(lines)
    for key, leaf in keys_named().leaves.items():
        line = text.splitlines()[(lines[key] or 0) - 1]
        assert leaf.meaning in line
        assert not leaf.units or f"[{leaf.units}]" in line
    assert max(map(len, text.splitlines())) < 140


def test_every_key_has_a_meaning_and_every_meaning_a_key() -> None:
    groups = {key.rpartition(".")[0] for key in keys_named().leaves}
    groups = (groups | {group.rpartition(".")[0] for group in groups}) - {""}
    sections = set(keys_named().sections)
    unknowns = {"uncertain", *(f"uncertain.{name}" for name in HOW)}
    own = {key for key in MEANINGS if key.partition(".")[0] == "continue"}
    form = Continue(keys_named())
    assert own == {
        "continue",
        *(f"continue.{key}" for key in form.members),
        *(f"continue.curves.{key}" for key in form.members["curves"].form.mapping.members),
    }
    every = set(keys_named().leaves) | groups | sections | SWEEP_KEYS | unknowns | {"title", "units", "sweep", SLICE}
    assert (set(MEANINGS) | set(OF_MODELS)) - own <= every
    assert every == {key for key, words in keys_named().meanings.items() if words} - own


def test_defaults_as_text_read_back_exactly() -> None:
    for leaf in keys_named().leaves.values():
        raw = parse(leaf.default_text, "t").data
        assert leaf.read(raw) == leaf.default, leaf.key


def objects(schema: dict) -> list[dict]:  # type: ignore[type-arg]
    return [schema, *schema["$defs"].values()]


def test_the_json_schema() -> None:
    schema = json.loads(json.dumps(json_schema(), allow_nan=False))
    assert schema["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    assert "required" not in schema  # without a sweep a study is one operating point
    assert set(schema["properties"]) == {
        "title",
        "units",
        "model",
        "sweep",
        "uncertain",
        "continue",
        *keys_named().sections,
    }
    for part in objects(schema):
        assert part["additionalProperties"] is False
        assert all("description" in value for value in part["properties"].values())
    well = schema["$defs"]["Well"]["properties"]
    assert well["law"]["enum"] == ["linear", "hertz"]
    assert well["diameter"]["default"] == "15 in"
    assert re.search(well["diameter"]["pattern"], "15 in")
    assert "In m" in well["diameter"]["description"]
    assert schema["$defs"]["Bit"]["properties"]["lobes"]["maximum"] == 8
    assert set(schema["$defs"]["Range_depth"]["required"]) == {"from", "to", "points"}


def test_the_template_meets_the_json_schema() -> None:
    jsonschema = pytest.importorskip("jsonschema")
    jsonschema.Draft202012Validator.check_schema(json_schema())
    jsonschema.Draft202012Validator(json_schema()).validate(parse(template_text(), "t").data)
