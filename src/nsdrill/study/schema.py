"""The pydantic models of the study file, built from the dataclasses: their keys, units,
ranges and defaults; and its JSON Schema, for editors that complete and check YAML while
it is written.

They check one value at a time; what constrains several values together is in
``constraints.py``. Values come out in SI.
"""

from __future__ import annotations

import typing
from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass, replace
from functools import lru_cache
from typing import Annotated, Any

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    PlainValidator,
    Tag,
    ValidationInfo,
    WithJsonSchema,
    create_model,
)

from nsdrill.models.leaves import is_compiled_in
from nsdrill.sampling import BOUNDS, NUMBERS_OF
from nsdrill.study.continuation import BORDERS, CURVE_POINTS, MOTIONS
from nsdrill.study.continuation import POINTS as POINTS_OF_BRANCH
from nsdrill.study.keys import (
    MEANINGS,
    MODEL_LEAF,
    SLICE,
    TIME,
    UNITS_LEAF,
    Keys,
    Leaf,
    keys_of,
    shown,
)
from nsdrill.study.read import odd_character
from nsdrill.study.study import Procedure
from nsdrill.study.uncertain import CUT_WORDS, DESIGN, EXAMPLES, FACTOR, SAMPLES, SEED, correlation
from nsdrill.units import USUAL, QuantityError
from nsdrill.variables import MODEL

QUANTITY = (
    r"^\s*[-+]?((\d+[ -])?\d+/\d+|(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?)"
    r"\s*[A-Za-zµμ°1½¼¾⅛⅜⅝⅞\"'″′”’].*$"
)
LONGEST_TITLE = 500  # characters

POINTS = Leaf("points", "whole", 2, low=2, high=10**8)
PROCEDURE = Leaf(
    "sweep.procedure",
    "choice",
    "same",
    choices=typing.get_args(Procedure),
    meaning=MEANINGS["sweep.procedure"],
)
REFINE = Leaf("sweep.refine", "whole", 0, low=0, high=6, meaning=MEANINGS["sweep.refine"])
SPACING = Leaf("spacing", "choice", "linear", choices=("linear", "log"))

# a value in the JSON Schema of an unknown, whose key tells the rest elsewhere
SHORT = {"type": ["string", "number"]}
DISTRIBUTION = {
    "type": "object",
    "additionalProperties": False,
    "minProperties": 1,
    "maxProperties": 1,
    "properties": {
        kind: {"type": "object" if kind in NUMBERS_OF else "array", "description": form}
        for kind, form in EXAMPLES.items()
    },
}

_STRICT = ConfigDict(extra="forbid", populate_by_name=False, defer_build=True)


@lru_cache(maxsize=8)
def study_model(model: str = MODEL, asked: frozenset[str] | None = None) -> type[BaseModel]:
    """The pydantic model of a whole study file of the model of this name; with
    ``asked`` of one that has no other keys than these dotted ones, which is made
    several times as fast. A study says few of them."""
    keys = keys_of(model)
    text = WithJsonSchema({"type": "string", "maxLength": LONGEST_TITLE})
    sections: dict[str, Any] = {
        "title": (
            Annotated[Any, PlainValidator(_title), text],
            Field(default="", description=MEANINGS["title"]),
        )
    }
    sections["units"] = _leaf(UNITS_LEAF)
    sections["model"] = _leaf(MODEL_LEAF, keys)
    for name, cls in keys.sections.items():
        if name == "simulation":  # these two stand before it in the file
            for around, make in (("sweep", _sweep_model), ("uncertain", _uncertain_model)):
                if _is_asked(around, asked):
                    sections[around] = (
                        Annotated[make(keys, asked), BeforeValidator(_empty)],
                        Field(default=None, description=MEANINGS[around]),
                    )
        if _is_asked(name, asked):
            sections[name] = _section(name, cls, keys, asked)
    # Read with the places of its values, in study/continuation.py.
    sections["continued"] = (
        Annotated[Any, PlainValidator(lambda raw: raw), WithJsonSchema(_continue_schema(keys))],
        Field(default=None, alias="continue", description=MEANINGS["continue"]),
    )
    return create_model("Study", __config__=_STRICT, **sections)


def _is_asked(key: str, asked: frozenset[str] | None) -> bool:
    return asked is None or key in asked


def json_of(found: Leaf) -> dict[str, Any]:
    """The JSON Schema of one value."""
    if found.kind == "choice":
        return {"enum": list(found.choices)}
    if found.kind == "switch":
        return {"type": "boolean"}
    if found.kind == "list":
        many: dict[str, Any] = {
            "type": "array",
            "items": json_of(found.each),
            "minItems": 1,
            "maxItems": found.most,
        }
        return {"anyOf": [many, {"type": "null"}]} if found.nullable else many
    if found.words:
        return {
            "anyOf": [{"enum": list(found.words)}, json_of(replace(found, words=(), default=None))]
        }
    if found.kind == "quantity":
        usual = USUAL.get(found.units, USUAL["N/m"])
        example = found.text(found.default if found.default is not None else 1.0)
        schema: dict[str, Any] = {
            "type": "string",
            "pattern": QUANTITY,
            "examples": list(dict.fromkeys([example, f"1 {usual[0]}"])),
        }
    else:
        schema = {"type": "integer" if found.kind == "whole" else "number"}
        schema |= {"minimum": found.low, "maximum": found.high}
    return {"anyOf": [schema, {"type": "null"}]} if found.nullable else schema


def description(found: Leaf) -> str:
    """Meaning, unit, default and source in one paragraph."""
    parts = [found.meaning]
    if found.units and found.kind != "table":
        parts.append(f"In {found.units}")
    if found.kind in ("quantity", "number", "whole"):
        parts.append(
            f"Range: {found.range()}" + (f" (in the field: {found.usual})" if found.usual else "")
        )
    parts.append(f"Default {found.default_text}")
    if found.source:
        parts.append(
            f"Source: {found.source}"
            + (f" (confidence: {found.confidence})" if found.confidence else "")
        )
    return ". ".join(parts) + "."


def _continue_schema(keys: Keys) -> dict[str, Any]:
    """The JSON Schema of the section ``continue``."""
    number = {"anyOf": [{"type": "string", "pattern": QUANTITY}, {"type": "number"}]}
    axes = [
        name
        for name in keys.axes
        if not name.startswith("initial.") and not is_compiled_in(keys.model.name, name)
    ]

    def several(one: dict[str, Any]) -> dict[str, Any]:
        return {"anyOf": [one, {"type": "array", "items": one, "minItems": 1}]}

    def described(name: str, schema: dict[str, Any]) -> dict[str, Any]:
        return {**schema, "description": f"{MEANINGS[f'continue.{name}']}."}

    curves: dict[str, dict[str, Any]] = {
        "over": {"enum": axes},
        "from": number,
        "to": number,
        "of": several({"enum": list(BORDERS)}),
        "points": json_of(CURVE_POINTS),
    }
    members: dict[str, dict[str, Any]] = {
        "along": {"enum": axes},
        "from": number,
        "to": number,
        "seeds": {
            "anyOf": [{"type": "string"}, {"type": "null"}, {"type": "object", "maxProperties": 1}]
        },
        "motions": several({"enum": list(MOTIONS)}),
        "lobes": several({"type": "integer", "minimum": 1}),
        "switch": {"type": "boolean", "default": True},
        "points": json_of(POINTS_OF_BRANCH),
        "curves": {
            "anyOf": [
                {"type": "null"},
                {
                    "type": "object",
                    "additionalProperties": False,
                    "required": ["over", "from", "to"],
                    "properties": {
                        name: described(f"curves.{name}", one) for name, one in curves.items()
                    },
                },
            ]
        },
    }
    return {
        "anyOf": [
            {"type": "null"},
            {
                "type": "object",
                "additionalProperties": False,
                "required": ["along", "from", "to"],
                "properties": {name: described(name, one) for name, one in members.items()},
            },
        ]
    }


def _section(
    prefix: str,
    cls: type,
    keys: Keys,
    asked: frozenset[str] | None,
    off: Mapping[str, Any] | None = None,
) -> tuple[Any, Any]:
    """The field of a section with the keys that are ``asked``: an empty one (null) is
    one with all its defaults, or with the values ``off``."""
    hints = typing.get_type_hints(cls)
    if off is not None:  # which are given by null
        asked = None
    members: dict[str, Any] = {}
    for item in fields(cls):
        key, hint = f"{prefix}.{item.name}", hints[item.name]
        if not (_is_asked(key, asked) or key in keys.model.deciding):
            continue
        if key == SLICE:
            members[item.name] = _slice_model(keys)
        elif is_dataclass(hint) and isinstance(hint, type):
            members[item.name] = _section(key, hint, keys, asked, item.metadata.get("off"))
        elif "record" in item.metadata:
            members[item.name] = _table(keys.leaves[key], keys)
        elif prefix == "operation":
            members[item.name] = _operating(keys.leaves[key])
        else:
            members[item.name] = _leaf(keys.leaves[key], keys)
    for choice, _ in keys.model.units_by.values():  # first: it decides the units of another key
        section, _, name = choice.rpartition(".")
        if section == prefix:
            members = {name: members.pop(name), **members}
    model = create_model(cls.__name__, __config__=_STRICT, **members)
    annotated = Annotated[model, BeforeValidator(lambda raw: (off or {}) if raw is None else raw)]  # type: ignore[valid-type]
    return annotated, Field(default=None, description=keys.meanings[prefix])


def _table(found: Leaf, keys: Keys) -> tuple[Any, Any]:
    """A list of records, each with its defaults."""
    members: dict[str, Any] = {}
    for part in found.parts:
        members[part.key.rpartition(".")[2]] = _leaf(part, keys)
    record = create_model(
        "".join(word.title() for word in found.key.split(".")), __config__=_STRICT, **members
    )
    many = Annotated[list[record], BeforeValidator(found.read)]  # type: ignore[valid-type]
    extra: dict[str, Any] = {"default": found.default_text}
    return many, Field(default=None, description=description(found), json_schema_extra=extra)


def _leaf(found: Leaf, keys: Keys | None = None) -> tuple[Any, Any]:
    validator: Callable[..., Any] = found.read
    if keys is not None and found.key in keys.model.units_by:
        choice, units = keys.model.units_by[found.key]
        beside = found.key.rpartition(".")[0] == choice.rpartition(".")[0]

        def validator(raw: Any, info: ValidationInfo) -> float | None:
            if raw is None and found.nullable:
                return None
            word = (
                info.data.get(choice.rpartition(".")[2])
                if beside
                else (info.context or {}).get(choice)
            )
            return _in_units_of(found, raw, word, choice, units)

    extra = {"default": _json_default(found)}
    annotated = Annotated[Any, PlainValidator(validator), WithJsonSchema(json_of(found))]
    return annotated, Field(
        default=found.default, description=description(found), json_schema_extra=extra
    )


def _operating(found: Leaf) -> tuple[Any, Any]:
    """An operating value, or {ramp: [[time, value], ...]}."""
    one = Annotated[Any, PlainValidator(found.read), WithJsonSchema(json_of(found))]
    time = Annotated[Any, PlainValidator(TIME.read), WithJsonSchema(json_of(TIME))]
    knot = Annotated[tuple[time, one], BeforeValidator(_knot)]
    text = "Knots [time, value], the first at 0 s; linear between them, constant after the last"
    ramp = create_model(
        f"Ramp_{found.key.rpartition('.')[2]}",
        __config__=_STRICT,
        ramp=(Annotated[list[knot], BeforeValidator(_knots)], Field(description=text)),
    )
    annotated = Annotated[
        Annotated[ramp, Tag("ramp")] | Annotated[one, Tag("value")],  # type: ignore[valid-type]
        Discriminator(_value_or_mapping),
    ]
    extra = {"default": _json_default(found)}
    return annotated, Field(
        default=found.default, description=description(found), json_schema_extra=extra
    )


def _knot(raw: Any) -> Any:
    """``raw`` if it may be a knot; :class:`QuantityError` otherwise."""
    if not isinstance(raw, list):
        raise QuantityError(shown(raw), "a knot: [time, value]")
    if len(raw) != 2:
        raise QuantityError(f"a list of {len(raw)}", "a knot: [time, value]")
    return raw


def _knots(raw: Any) -> Any:
    """``raw`` if it may be a list of knots; :class:`QuantityError` otherwise."""
    if not isinstance(raw, list):
        raise QuantityError(shown(raw), "a list of knots: [[0 s, VALUE], [600 s, VALUE]]")
    return raw


def _json_default(found: Leaf) -> Any:
    """As it would stand in the file: quantities as text."""
    if found.kind in ("list", "table"):
        return None if found.default is None else found.default_text
    return (
        found.default_text
        if found.kind == "quantity" and found.default is not None
        else found.default
    )


def _in_units_of(
    found: Leaf, raw: Any, word: str | None, choice: str, units: Mapping[str, str]
) -> float:
    """The value in the units that the ``word`` at the key ``choice`` asks for, a
    stiffness in those of its contact law; in any of them, where the choice itself is at
    fault."""
    right = units[word or next(iter(units))]
    wrong = next(other for other in units.values() if other != right)
    try:
        return float(Leaf(**{**vars(found), "units": right}).read(raw))
    except QuantityError as error:
        try:
            value = Leaf(**{**vars(found), "units": wrong}).read(raw)
        except QuantityError:
            raise error from None
        if word is None:
            return float(value)
        other = next(name for name, unit in units.items() if unit == wrong)
        what, of = found.key.rpartition(".")[2], choice.rpartition(".")[2]
        hint = f"With {of}: {word} the {what} is in {right}; {of}: {other} takes {wrong}."
        raise QuantityError(f"{shown(raw)}, in {wrong}", error.allowed, hint) from None


def _sweep_model(keys: Keys, asked: frozenset[str] | None) -> type[BaseModel]:
    members: dict[str, Any] = {}
    for name, found in keys.axes.items():
        if _is_asked(f"sweep.{name}", asked):
            members[name.replace(".", "_")] = _axis(name, found, keys)
    members["procedure"] = _leaf(PROCEDURE)
    members["along"] = _leaf(along(keys))
    members["refine"] = _leaf(REFINE)
    return create_model("Sweep", __config__=_STRICT, **members)


def along(keys: Keys) -> Leaf:
    """The key that names the axis along which the state is carried."""
    meaning = keys.meanings["sweep.along"]
    return Leaf(
        "sweep.along", "choice", None, choices=tuple(keys.axes), nullable=True, meaning=meaning
    )


def _axis(name: str, value: Leaf, keys: Keys) -> tuple[Any, Any]:
    """An axis: {from, to, points}, a list of quantities, or one quantity; of words a
    list of these."""
    one = _number(value, keys)
    meaning = MEANINGS.get(f"sweep.{name}") or f"{value.meaning} ({name})"
    if value.kind in ("choice", "switch"):
        words = Annotated[
            Annotated[list[one], Tag("list")] | Annotated[one, Tag("value")],  # type: ignore[valid-type]
            Discriminator(_form_of_words),
        ]
        return words, Field(default=None, alias=name, description=f"{meaning}: a list of words.")
    span = _range(name.replace(".", "_"), one, spacing=True)
    annotated = Annotated[
        Annotated[span, Tag("range")]  # type: ignore[valid-type]
        | Annotated[list[one], Tag("list")]  # type: ignore[valid-type]
        | Annotated[one, Tag("value")],  # type: ignore[valid-type]
        Discriminator(_form),
    ]
    units = f", in {value.units}" if value.units else ""
    text = f"{meaning}{units}: {{from, to, points}}, a list, or one value."
    return annotated, Field(default=None, alias=name, description=text)


def _number(value: Leaf, keys: Keys, schema: dict[str, Any] | None = None) -> Any:
    """The type of one value of an axis or an unknown, in the JSON Schema as that of the
    leaf or as ``schema``."""
    validator: Callable[..., Any] = value.read
    if value.key in keys.model.units_by:
        choice, words = keys.model.units_by[value.key]

        def validator(raw: Any, info: ValidationInfo) -> float:
            return _in_units_of(value, raw, (info.context or {}).get(choice), choice, words)

    return Annotated[Any, PlainValidator(validator), WithJsonSchema(schema or json_of(value))]


def _uncertain_model(keys: Keys, asked: frozenset[str] | None) -> type[BaseModel]:
    """The section of the unknowns: their distributions by key, a joint table of
    samples, and how they are drawn."""
    members: dict[str, Any] = {}
    columns: dict[str, Any] = {}
    for name, value in keys.axes.items():
        either = any(_is_asked(f"uncertain.{place}{name}", asked) for place in ("", "table."))
        if either and not is_compiled_in(keys.model.name, name):
            place, one = name.replace(".", "_"), _number(value, keys, SHORT)
            units = f", in {value.units}" if value.units else ""
            told = Field(
                default=None,
                alias=name,
                description=f"{value.meaning} ({name}){units}: its distribution.",
            )
            made = _distribution_model(place, value, one, keys)
            members[place] = (Annotated[made, WithJsonSchema(DISTRIBUTION)], told)
            column: Any = list[one]  # type: ignore[valid-type]
            columns[place] = (column, Field(default=None, alias=name, description=value.meaning))
    table = create_model("Table", __config__=_STRICT, **columns)
    told = Field(default=None, description=MEANINGS["uncertain.table"])
    members["table"] = (Annotated[table, BeforeValidator(_empty)], told)
    pairs = list[Annotated[Any, PlainValidator(correlation)]]
    text = WithJsonSchema(
        {"type": "array", "items": {"type": "array", "minItems": 3, "maxItems": 3}}
    )
    told = Field(default=None, description=MEANINGS["uncertain.correlations"])
    members["correlations"] = (Annotated[pairs, text], told)
    for found in (SAMPLES, SEED, DESIGN):
        members[found.key.partition(".")[2]] = _leaf(found)
    return create_model("Uncertain", __config__=_STRICT, **members)


def _distribution_model(place: str, value: Leaf, one: Any, keys: Keys) -> type[BaseModel]:
    spread = _number(replace(value, low=0.0, high=value.high - value.low), keys, SHORT)
    factor = Annotated[Any, PlainValidator(FACTOR.read), WithJsonSchema({"type": "number"})]
    numbers = {"mean": one, "deviation": spread, "median": one, "factor": factor}
    kinds: dict[str, Any] = {}
    for kind, form in EXAMPLES.items():
        if kind in NUMBERS_OF:
            given: dict[str, Any] = {
                name: (numbers[name], Field(description=name)) for name in NUMBERS_OF[kind]
            }
            given |= {
                end: (one, Field(default=None, description=f"Cut off {CUT_WORDS[end]} this"))
                for end in BOUNDS
            }
            made: Any = create_model(f"{kind.capitalize()}_{place}", __config__=_STRICT, **given)
        else:
            made = list[one]
        kinds[kind] = (made, Field(default=None, description=form))
    return create_model(f"Unknown_{place}", __config__=_STRICT, **kinds)


def _value_or_mapping(raw: Any) -> str:
    return "ramp" if isinstance(raw, dict | BaseModel) else "value"


def _range(name: str, one: Any, spacing: bool = False) -> type[BaseModel]:
    """{from, to, points}, the ends of the type ``one``; with ``spacing`` where it may
    be chosen."""
    whole = Annotated[Any, PlainValidator(POINTS.read), WithJsonSchema(json_of(POINTS))]
    ends: dict[str, Any] = {
        "from_": (one, Field(alias="from", description="One end")),
        "to": (one, Field(description="The other end")),
        "points": (
            whole,
            Field(description="Number of equally spaced values, both ends among them"),
        ),
    }
    if spacing:
        kind = Annotated[Any, PlainValidator(SPACING.read), WithJsonSchema(json_of(SPACING))]
        ends["spacing"] = (
            kind,
            Field(default="linear", description="linear, or log for equal ratios"),
        )
    return create_model(f"Range_{name}", __config__=_STRICT, **ends)


def _slice_model(keys: Keys) -> tuple[Any, Any]:
    """The slice: ranges of states by their names."""
    members: dict[str, Any] = {}
    for key, found in keys.leaves.items():
        name = key.removeprefix("initial.")
        if name != key and name in keys.slices:
            number = replace(found, nullable=False)
            one = Annotated[Any, PlainValidator(number.read), WithJsonSchema(json_of(number))]
            members[name] = (
                _range(f"initial_{name}", one),
                Field(default=None, description=found.meaning),
            )
    model = create_model("Slice", __config__=_STRICT, **members)
    annotated = Annotated[model, BeforeValidator(_empty)]  # type: ignore[valid-type]
    return annotated, Field(default=None, description=keys.meanings[SLICE])


def _form(raw: Any) -> str:
    if isinstance(raw, list):
        return "list"
    return "range" if isinstance(raw, dict | BaseModel) else "value"


def _form_of_words(raw: Any) -> str:
    return "list" if isinstance(raw, list) else "value"


def _empty(raw: Any) -> Any:
    return {} if raw is None else raw


def _title(raw: Any) -> str:
    if raw is None:
        return ""
    if not isinstance(raw, str):
        raise QuantityError(shown(raw), "text; put it in quotes")
    if odd := odd_character(raw, allowed="\t\n"):
        raise QuantityError(odd, "text that can be printed")
    if len(raw) > LONGEST_TITLE:
        raise QuantityError(f"{len(raw)} characters", f"at most {LONGEST_TITLE}")
    return raw


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
