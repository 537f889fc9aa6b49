"""Studies and overrides given as Python mappings, written as the YAML that says the
same."""

from __future__ import annotations

from collections.abc import Mapping
from io import StringIO
from typing import Any

from nsdrill.errors import Fault, StudyError
from nsdrill.study.document import dotted
from nsdrill.study.overrides import path_of

ALLOWED = "text, numbers, True, False, None, and lists and mappings of these"
_DEEPEST = 20  # levels; a study has five


def yaml_text(mapping: Mapping[Any, Any], name: str) -> str:
    """The study ``mapping`` as YAML; its keys may be nested or dotted, as
    ``well.friction.static``, or both. StudyError about the study ``name`` where a key
    is given twice or a value is none that a study has."""
    faults: list[Fault] = []
    nested: dict[str, Any] = {}
    try:
        _take(mapping, (), nested, faults)
    except RecursionError:
        faults.append(Fault("", "a list or mapping that holds itself", ALLOWED))
    if faults:
        raise StudyError(name, faults)
    return _dumped(nested)


def override_texts(changes: Mapping[Any, Any], name: str) -> list[str]:
    """``changes`` by dotted keys as texts ``key=value``, the values in YAML."""
    faults: list[Fault] = []
    texts = []
    for key, value in changes.items():
        plain = _plain(value, (str(key),), faults)
        if not isinstance(key, str) or not key.strip() or "=" in key:
            faults.append(
                Fault("", f"{key!r} as a key", "dotted keys, as in {'operation.wob': '30 kN'}")
            )
        elif not faults:
            texts.append(f"{key}={_value_text(plain)}")
    if faults:
        raise StudyError(name, faults)
    return texts


def _value_text(value: Any) -> str:
    """The value in YAML on one line."""
    return _dumped({"v": value}, lines=False).removeprefix("{v: ").removesuffix("}\n")


def _take(
    mapping: Mapping[Any, Any], above: tuple[str, ...], into: dict[str, Any], faults: list[Fault]
) -> None:
    for key, value in mapping.items():
        if not isinstance(key, str) or not all(key.split(".")):
            faults.append(
                Fault(
                    dotted(above),
                    f"{key!r} as a key",
                    "names, nested or dotted, as 'operation.wob'",
                )
            )
            continue
        path = tuple(map(str, path_of(".".join((*above, key)))))
        if len(path) > _DEEPEST:
            faults.append(
                Fault(dotted(path), f"more than {_DEEPEST} levels", "the five levels of a study")
            )
            continue
        if isinstance(value, Mapping) and value:
            _take(value, path, into, faults)
            continue
        inside: Any = into
        for part in path[:-1]:
            inside = inside.setdefault(part, {}) if isinstance(inside, dict) else None
        if not isinstance(inside, dict) or path[-1] in inside:
            faults.append(
                Fault(dotted(path), "the key a second time", "each key once, nested or dotted")
            )
            continue
        inside[path[-1]] = _plain(value, path, faults)


def _plain(value: Any, path: tuple[str, ...], faults: list[Fault]) -> Any:
    """``value`` as YAML has it; what numpy made becomes Python's own."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, str):
        return str(value)
    if value is None or isinstance(value, bool | int | float):
        return value
    if isinstance(value, list | tuple):
        return [_plain(item, path, faults) for item in value]
    if isinstance(value, Mapping):
        return {str(name): _plain(item, (*path, str(name)), faults) for name, item in value.items()}
    faults.append(Fault(dotted(path), f"a value of the type {type(value).__name__}", ALLOWED))
    return None


def _dumped(nested: dict[str, Any], *, lines: bool = True) -> str:
    from ruamel.yaml import YAML

    yaml = YAML()
    # None: the innermost lists and mappings on lines of their own
    yaml.default_flow_style = None if lines else True
    yaml.width = 120 if lines else 1_000_000
    out = StringIO()
    yaml.dump(nested, out)
    return out.getvalue()
