"""Studies as people write them: a resolved one as YAML that reads back the same, values
with their units; the commented one that ``nsdrill new`` writes, every key with its
default, its unit and its meaning; and those that come with nsdrill.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import groupby
from pathlib import Path

from nsdrill.data import Resolved, differences
from nsdrill.models.sections import SHORT_KEYS, SHORT_VALUES
from nsdrill.quantity import LONG, quantity
from nsdrill.sampling import KINDS, NUMBERS_OF
from nsdrill.study.assembly import is_replaced
from nsdrill.study.continuation import SECTION as CONTINUE
from nsdrill.study.continuation import example_of
from nsdrill.study.keys import MEANINGS, SLICE, TIME, UNITS_LEAF, Keys, Leaf, Value, keys_named, model_leaf
from nsdrill.study.study import IN_WORDS_ONLY
from nsdrill.study.torques import PAIR, by_torque
from nsdrill.study.uncertain import FACTOR, HOW
from nsdrill.study.weight import BORE, is_weighed
from nsdrill.units import from_si
from nsdrill.variables import MODEL, long_key, short_key

MAX_TOLD = 6  # keys in a message


def study_text(resolved: Resolved, head: Iterable[str] = ()) -> str:
    """The study ``resolved`` as YAML with every key, below the comments ``head``; read
    again it has the same digest."""
    keys = _keys(resolved)
    comments = ["# " + " ".join("".join(c if c.isprintable() else " " for c in words).split()) for words in head]
    parts = [[*comments, line("", "title", _title(resolved), MEANINGS["title"])]]
    if "units" in resolved:  # which a study states that was typed in others
        parts.append([line("", "units", resolved["units"], MEANINGS["units"])])
    parts.append([line("", "model", keys.model.name, keys.meanings["model"])])
    for name in keys.sections:
        if name == "simulation":
            parts.append(_sweep(keys, resolved))
            if "uncertain" in resolved:
                parts.append(_uncertain(keys, resolved))
        parts.append([*section_lines(keys, name, lambda leaf: _needed(resolved, leaf))])
        if name == "initial" and (plane := resolved["initial"].get("slice")):
            parts[-1].append(line("  ", "slice", "", keys.meanings[SLICE]))
            states = [state for state in keys.slices if state in plane]
            parts[-1] += [f"    {state}: {value_text(resolved, f'{SLICE}.{state}')}" for state in states]
    if resolved.get(CONTINUE):
        parts.append([*_continued(keys, resolved[CONTINUE])])
    return "\n".join("".join(f"{text}\n" for text in part) for part in parts)


def _sweep(keys: Keys, resolved: Resolved) -> list[str]:
    """The section of the sweep: the axes, then how they are run."""
    last = ("procedure", "along", "refine")
    names = [*(key for key in resolved["sweep"] if key not in last), *(key for key in last if key in resolved["sweep"])]
    lines = [line("", "sweep", "", MEANINGS["sweep"])]
    for key in names:
        meaning = MEANINGS.get(f"sweep.{key}") or keys.axes[key].meaning
        lines.append(line("  ", key, value_text(resolved, f"sweep.{key}") or "", meaning))
    return lines


def _continued(keys: Keys, found: Resolved, prefix: str = CONTINUE, indent: str = "") -> Iterator[str]:
    """The lines of the section ``continue``, or of its curves."""
    yield line(indent, prefix.rpartition(".")[2], "", keys.meanings[prefix])
    leaf = keys.axes[found["over" if "over" in found else "along"]]
    for name, value in found.items():
        key = f"{prefix}.{name}"
        if isinstance(value, dict) and name == "curves":
            yield from _continued(keys, value, key, indent + "  ")
            continue
        if isinstance(value, dict):
            text = ", ".join(f"{axis}: [{', '.join(map(leaf.text, values))}]" for axis, values in value.items())
            text = f"{{{text}}}"
        elif isinstance(value, list):
            text = f"[{', '.join(map(str, value))}]"
        elif name in ("from", "to"):
            text = leaf.text(value)
        else:
            text = value if name_like(value) else json.dumps(value, ensure_ascii=False, allow_nan=False)
        yield line(indent + "  ", name, text, keys.meanings[key])


def name_like(value: object) -> bool:
    """Whether a value is a plain word in YAML."""
    return isinstance(value, str) and value.replace("_", "").replace(".", "").isalpha() and value.isascii()


def changes(a: Resolved, b: Resolved) -> list[tuple[str, str | None, str | None]]:
    """(key, value in ``a``, value in ``b``) where two resolved studies differ, the
    values as :func:`value_text`."""
    keys = dict.fromkeys(_key_of(entry) for entry, _, _ in differences(a, b))
    return [(key, value_text(a, key), value_text(b, key)) for key in keys]


def changes_text(a: Resolved, b: Resolved, keys: Sequence[str] | None = None) -> str:
    """The ``keys`` in which two resolved studies differ, all but the title and the units if None, as
    a part of a message: ``bit.friction.static: 0.5 there, 0.6 here; ...``."""
    if keys is None:
        keys = [key for key, _, _ in changes(a, b) if key not in IN_WORDS_ONLY]
    told = [f"{key}: {value_text(a, key) or 'nothing'} there, {value_text(b, key) or 'nothing'} here" for key in keys]
    return "; ".join(told[:MAX_TOLD]) + (f" and {len(told) - MAX_TOLD} more" if len(told) > MAX_TOLD else "")


def value_text(resolved: Resolved, key: str) -> str | None:
    """The value of ``key`` as it may stand in a study file, None where the study has no
    such key."""
    name, keys = key.rpartition(".")[2], _keys(resolved)
    if key == "title":
        return _title(resolved)
    if key.startswith("operation.") and name in resolved.get("ramps", {}):
        knots = zip(*resolved["ramps"][name], strict=True)
        leaf = keys.leaf(key, resolved)
        return f"{{ramp: [{', '.join(f'[{TIME.text(time)}, {leaf.text(value)}]' for time, value in knots)}]}}"
    if key.startswith("uncertain."):
        return _of_unknowns(keys, resolved, key.removeprefix("uncertain."))
    value: Value = resolved
    section, _, axis = key.partition(".")
    for part in (section, axis) if section == "sweep" else key.split("."):
        if not isinstance(value, dict) or part not in value:
            return None
        value = value[part]
    if (section == "sweep" and axis in keys.axes) or key.startswith(f"{SLICE}."):
        leaf = keys.leaf(keys.axes[axis].key if section == "sweep" else f"initial.{name}", resolved)
        if isinstance(value, list):
            return f"[{', '.join(map(leaf.text, value))}]"
        spacing = f", spacing: {value['spacing']}" if "spacing" in value else ""
        return f"{{from: {leaf.text(value['from'])}, to: {leaf.text(value['to'])}, points: {value['points']}{spacing}}}"
    if key in keys.leaves:
        return keys.leaf(key, resolved).text(value)
    return value if isinstance(value, str) else json.dumps(value, allow_nan=False)


def _uncertain(keys: Keys, resolved: Resolved) -> list[str]:
    """The section of the unknowns."""
    found, told = resolved["uncertain"], {name: MEANINGS[f"uncertain.{name}"] for name in HOW}
    names = [key for key in found if key not in HOW]
    names += [] if found["table"] else ["samples"]
    names += [name for name in ("seed", "design", "correlations", "doubts") if found.get(name, []) != []]
    lines = [line("", "uncertain", "", MEANINGS["uncertain"])]
    for name in names:
        meaning = told.get(name) or keys.axes[name].meaning
        lines.append(line("  ", long_key(name), _of_unknowns(keys, resolved, name) or "", meaning))
    if found["table"]:
        lines.append(line("  ", "table", "", told["table"]))
        lines += [f"    {long_key(key)}: {_of_unknowns(keys, resolved, f'table.{key}')}" for key in found["table"]]
    return lines


def _of_unknowns(keys: Keys, resolved: Resolved, name: str) -> str | None:
    """What the section of the unknowns says of ``name``, in flow style; None where it
    has no such key."""
    table, _, column = name.partition(".")
    name, column = short_key(name), short_key(column)
    found = resolved.get("uncertain", {})
    if table == "table" and column:
        return _values(keys, resolved, column, found["table"][column]) if column in found.get("table", {}) else None
    if name not in found:
        return None
    if name in HOW:
        return json.dumps(found[name], allow_nan=False).replace('"', "") if name != "table" else None
    ((kind, numbers),) = found[name].items()
    if isinstance(numbers, list):
        return f"{{{kind}: {_values(keys, resolved, name, numbers)}}}"
    leaf = keys.leaf(keys.axes[name].key, resolved)
    whole = {"low": leaf.low, "high": leaf.high}  # a bound there cuts off nothing that may be drawn
    texts = (
        f"{of}: {FACTOR.text(v) if of == 'factor' else leaf.text(v)}" for of, v in numbers.items() if v != whole.get(of)
    )
    return f"{{{kind}: {{{', '.join(texts)}}}}}"


def _values(keys: Keys, resolved: Resolved, key: str, values: list[float]) -> str:
    return f"[{', '.join(map(keys.leaf(keys.axes[key].key, resolved).text, values))}]"


def _key_of(entry: str) -> str:
    """The key of a study file whose value holds the ``entry`` of a resolved study."""
    parts = entry.split(".")
    if parts[0] == "ramps":
        return f"operation.{parts[1]}"
    if parts[0] == "sweep":
        return entry.removesuffix(".from").removesuffix(".to").removesuffix(".points").removesuffix(".spacing")
    if parts[0] == "uncertain":
        section, _, key = _unknown_of(entry).partition(".")
        table, dot, column = key.rpartition("table.")
        return f"{section}.{table}{dot}{long_key(column)}"
    return ".".join(parts[:3] if entry.startswith(f"{SLICE}.") else parts)


def _unknown_of(entry: str) -> str:
    """Without the kind and the numbers of a distribution."""
    head, _, last = entry.rpartition(".")
    if last in KINDS and not entry.startswith("uncertain.table."):
        return head
    above, _, kind = head.rpartition(".")
    return above if kind in NUMBERS_OF else entry


def _keys(resolved: Resolved) -> Keys:
    return keys_named(str(resolved.get("model", model_leaf().default)))


def _needed(resolved: Resolved, leaf: Leaf) -> str | None:
    """The value of ``leaf``, but for a default that the sweep replaces: as a given
    value it might be refused, a depth above the end of the collars say."""
    prefix, _, name = leaf.key.rpartition(".")
    if prefix == "operation" and name in resolved["sweep"] and resolved["operation"][name] == leaf.default:
        return None
    if (leaf.key == BORE and is_weighed(resolved)) or is_replaced(resolved, leaf.key):
        return None
    if leaf.key in PAIR and by_torque(resolved):
        return None
    return value_text(resolved, leaf.key)


def _title(resolved: Resolved) -> str:
    """The title in quotes that YAML reads back as it was."""
    text = json.dumps(resolved.get("title", ""), ensure_ascii=False, allow_nan=False)
    return "".join(sign if sign.isprintable() else f"\\U{ord(sign):08x}" for sign in text)


_INDENT = "  "
_COLUMN = 44  # where the comments begin

_HEAD = """\
# A study: a drill string, an operating point, and what to sweep.
#
# Every physical quantity is a number with its unit: 15 in, 22.24 kN, 5 klbf, 60 rpm, 3 rad/s, 25 MN/m.
# All keys may be left out; the values below are the defaults, but for the title and the sweep. Run it with
#     nsdrill check STUDY.yaml
#     nsdrill run STUDY.yaml -o OUT.h5
"""

_SWEEP = """\
sweep:                                      # {sweep}; without it one operating point is run
  # Each axis is {{from, to, points}}, a list of values, or one value. Axes left out
  # come from `operation`.
  depth: {{from: 500 m, to: 9000 m, points: 86}}
  # wob: [22.24 kN, 66.72 kN]
  # rotary_speed: {{from: 10 rpm, to: 120 rpm, points: 111}}
  # {axis}: {{from: {low}, to: {high}, points: 20, spacing: log}}  # or any number by its key
  procedure: same                           # same | up | down | up-down | all: all but the first carry the state
  # along: depth                            # {along}
  refine: 0                                 # {refine}

# uncertain:                                # {uncertain}
#   {axis}: {{uniform: [{low}, {high}]}}
#   # or normal: {{mean, deviation}}, lognormal: {{median, factor}}, triangular: [low, mode, high], values: [...]
#   samples: 256                            # {samples}
#   seed: 1                                 # {seed}
"""

# Of a model that is no drill string.
_HEAD_OF_ANY = """\
# A study: a model, its numbers, and what to sweep.
#
# A quantity with a unit is a number with its unit: {axis}: {low}.
# All keys may be left out; the values below are the defaults, but for the title and the sweep. Run it with
#     nsdrill check STUDY.yaml
#     nsdrill run STUDY.yaml -o OUT.h5
"""
_SHORT_OF_ANY = """\
# nsdrill new --all shows every key.
title: {words} up and down
units: {units}
"""
_SHORT_SWEEP_OF_ANY = """\
sweep:
  {axis}: {{from: {low}, to: {high}, points: 61}}
  procedure: up-down                        # carry the state up and back down: history matters
simulation: {{transient: 100 s, observe: 100 s}}
"""


def _sweep_of(keys: Keys) -> str:
    """The template of the sections of the sweep and the unknowns."""
    if keys.model.drills:
        return _SWEEP
    own, rest = _SWEEP.partition("  # Each axis")[0], _SWEEP.partition("  procedure:")[2]
    rest = rest.replace("# along: depth ", "# along: {axis} ", 1)
    each = "  # Each axis is {{from, to, points}}, a list of values, or one value.\n"
    return own + each + "  {axis}: {{from: {low}, to: {high}, points: 61}}\n  procedure:" + rest


_SCHEMA_LINE = "# yaml-language-server: $schema=study.schema.json  (for editors; nsdrill schema -o study.schema.json)\n"
_SHORT_HEAD = """\
# Each quantity has its unit: 9 in, 8 1/2 in, 15 klbf, 60 rpm. nsdrill new --all shows every key.
title: Rotary speed up and down
units: {units}
"""
_SHORT_SWEEP = """\
sweep:
  rotary_speed: {{from: {low}, to: {high}, points: 61}}
  procedure: up-down                        # carry the state up and back down: history matters
simulation: {{transient: 100 s, observe: 100 s}}
"""
_SHORT_ENDS = {"si": ("2 rad/s", "14 rad/s"), "field": ("20 rpm", "140 rpm")}


def short_text(model: str = MODEL, units: str = "si") -> str:
    """The text of a short study of the model of this name to start from, in the
    ``units`` "si" or "field": what differs from well to well, and a sweep of the rotary
    speed up and down."""
    keys = keys_named(model)
    axis, low, high = keys.example_axis
    head = _SHORT_HEAD if keys.model.drills else _SHORT_OF_ANY
    parts = [_SCHEMA_LINE, head.format(units=units, words=quantity(axis).label if axis in keys.axes else axis)]
    if model != MODEL:
        parts.append(line("", "model", model, keys.meanings["model"]) + "\n")
    sections = keys.model.sections if keys.model.drills else (*keys.model.sections, "operation")
    own = [leaf for section in sections for leaf in keys.of(section)]
    known = {leaf.key for leaf in own} & {*SHORT_KEYS}
    # of a model of another package all
    names = SHORT_KEYS if known else [*(leaf.key for leaf in own), *SHORT_KEYS]
    chosen = [keys.leaves[key] for key in names if key in keys.leaves]
    section = ""
    for group, found in groupby(chosen, lambda leaf: leaf.key.rpartition(".")[0]):
        if group.partition(".")[0] != section:
            section = group.partition(".")[0]
            parts.append(line("", section, "", keys.meanings[section]) + "\n")
        values = [(leaf, leaf.key.rpartition(".")[2], _value_in(leaf, units)) for leaf in found]
        if group == section:
            parts += [line(_INDENT, name, text, leaf.meaning) + "\n" for leaf, name, text in values]
        else:
            text = f"{{{', '.join(f'{name}: {text}' for _, name, text in values)}}}"
            name = group.rpartition(".")[2]
            parts.append(line(_INDENT, name, text, keys.meanings[group]) + "\n")
    if keys.model.drills:
        low, high = _SHORT_ENDS[units]
        parts.append(_SHORT_SWEEP.format(low=low, high=high))
    else:
        parts.append(_SHORT_SWEEP_OF_ANY.format(axis=axis, low=low, high=high))
    return "".join(parts)


def _value_in(leaf: Leaf, units: str) -> str:
    """The value of ``leaf`` in a short study, mostly the default, in the ``units`` "field" a value of
    four digits."""
    if leaf.key in SHORT_VALUES:
        return SHORT_VALUES[leaf.key]
    if leaf.kind != "quantity" or units != "field":
        return leaf.default_text
    unit = quantity(leaf.key).unit(units)
    if unit == leaf.units:
        return leaf.default_text
    unit = "ft" if unit == "in" and leaf.default >= LONG else unit
    return f"{float(f'{from_si(leaf.default, unit):.4g}'):g} {unit}"


def template_text(model: str = MODEL, units: str = "si") -> str:
    """The text of a complete, commented study of the model of this name that loads as
    it stands; ``units`` is its key of this name."""
    keys = keys_named(model)
    axis, low, high = keys.example_axis
    if keys.model.drills:
        head, title = _HEAD, "Depth sweep, same initial state"
    else:
        head, title = _HEAD_OF_ANY.format(axis=axis, low=low), f"Sweep of {axis}, same initial state"
    parts = [_SCHEMA_LINE + head, line("", "title", title, MEANINGS["title"])]
    parts.append(line("", "units", units, _comment(UNITS_LEAF)))
    parts.append(line("", "model", model, _comment(keys.leaves["model"])))
    for name in keys.sections:
        if name == "simulation":
            told = {key: MEANINGS[f"sweep.{key}"] for key in ("along", "refine")}
            told |= {key: MEANINGS[f"uncertain.{key}"] for key in ("samples", "seed")}
            told["uncertain"] = MEANINGS["uncertain"].partition(";")[0]
            parts.append(_sweep_of(keys).format(sweep=MEANINGS["sweep"], axis=axis, low=low, high=high, **told))
        parts.append("\n".join(section_lines(keys, name, lambda leaf: leaf.default_text)))
        if name == "initial":
            parts[-1] += f"\n  # {keys.meanings[SLICE]}:\n  # slice: {keys.example_slice}"
    parts.append(f"# {example_of(keys)}  # {MEANINGS['continue']}")
    return "\n".join(part.rstrip("\n") + "\n" for part in parts)


def section_lines(keys: Keys, prefix: str, text: Callable[[Leaf], str | None]) -> Iterator[str]:
    """The lines of one section: every key whose ``text`` is not None, with its meaning
    beside it."""
    yield line("", prefix, "", keys.meanings[prefix])
    told = {prefix}
    for leaf in keys.of(prefix):
        value = text(leaf)
        if value is None:
            continue
        *groups, name = leaf.key.split(".")
        group = ".".join(groups)
        if group not in told:
            told.add(group)
            yield line(_INDENT * (len(groups) - 1), groups[-1], "", keys.meanings[group])
        yield line(_INDENT * len(groups), name, value, _comment(leaf))


def _comment(leaf: Leaf) -> str:
    """Meaning and unit or choices of one key; sources are in the schema and in the
    documentation."""
    units = "" if not leaf.units else f" [{leaf.units}]"
    choices = f": {' | '.join(leaf.choices)}" if leaf.choices else ""
    others = f"; {leaf.other_defaults}" if leaf.other_defaults else ""
    return f"{leaf.meaning}{choices}{units}{others}"


def line(indent: str, name: str, value: str, comment: str) -> str:
    """``name: value  # comment``, the comments in one column."""
    return f"{indent}{name}: {value}".rstrip().ljust(_COLUMN - 1) + f" # {comment}"


_INSTALLED = Path(__file__).parents[1] / "examples"
# in place of them, where the package is not installed
_CHECKOUT = Path(__file__).parents[3] / "configs"


def examples() -> dict[str, Path]:
    """The files by name, in alphabetical order."""
    folder = _INSTALLED if _INSTALLED.is_dir() else _CHECKOUT
    return {path.stem: path for path in sorted(folder.glob("*.yaml"))}


def title_of(path: Path) -> str:
    """The title that a study's file begins with, or its name."""
    lines = path.read_text(encoding="utf-8").splitlines()
    found = next((line.partition(":")[2].strip() for line in lines if line.startswith("title:")), "")
    return found.strip("\"'") or path.stem
