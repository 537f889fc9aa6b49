"""Write the tables of the documentation from the code, so that the two cannot disagree.

    python docs/make_tables.py           # writes them into the pages
    python docs/make_tables.py --check   # says which pages are stale, exit code 1 if any

A table stands between two comments, ``<!-- table: NAME -->`` and
``<!-- end of table -->``. The tests run the check.
"""

from __future__ import annotations

import inspect
import re
import sys
import textwrap
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import nsdrill
from nsdrill.cli.main import COMMANDS, group
from nsdrill.figures.picture_kinds import GROUPS, VALUE, all_kinds
from nsdrill.models.beam.columns import Options as Collar
from nsdrill.models.christoforou_yigit.columns import Options
from nsdrill.models.christoforou_yigit.further_quantities import further_quantities
from nsdrill.models.christoforou_yigit.parameters import Parameters
from nsdrill.models.friction import law_numbered
from nsdrill.models.operation import Operation
from nsdrill.models.own_drives import numbered
from nsdrill.models.registry import NAMES, described, model_named
from nsdrill.models.variant import variant_of
from nsdrill.study.continuation import BORDERS, CURVE_POINTS, LOBES, MOTIONS, SEEDS
from nsdrill.study.continuation import POINTS as POINTS_OF_BRANCH
from nsdrill.study.keys import MANY, MEANINGS, SLICE, UNITS_LEAF, Leaf, keys_named, model_leaf
from nsdrill.study.schema import PROCEDURE, REFINE, along
from nsdrill.study.uncertain import DESIGN, EXAMPLES, SAMPLES, SEED
from nsdrill.unit_table import USUAL
from nsdrill.variables import MODEL, Variable

HERE = Path(__file__).parent
BLOCK = re.compile(r"(<!-- table: ([\w ]+) -->\n).*?(<!-- end of table -->)", re.DOTALL)


def table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """A Markdown table; bars within cells are escaped."""
    head = list(head)
    lines = [head, ["---"] * len(head), *([str(cell).replace("|", "\\|") for cell in row] for row in rows)]
    return "".join("| " + " | ".join(line) + " |\n" for line in lines)


def code(text: str) -> str:
    return f"`{text}`" if text else ""


def forms(leaf: Leaf, more: Iterable[str] = ()) -> str:
    """What a key may be where that is more than a number in its range."""
    words = [*leaf.choices, *more]
    if len(words) >= MANY:
        return "the key of a swept axis"
    if leaf.kind == "table":
        parts = ", ".join(code(part.key.rpartition(".")[2]) for part in leaf.parts)
        return f"1 to {leaf.most} records of {parts}"
    if leaf.kind == "list":
        return f"1 to {leaf.most} values"
    return ", ".join(map(code, [word for word in words if word != leaf.default] or leaf.words))


def parameters() -> str:
    """Where the numbers of the main model are from."""
    found: dict[tuple[str, str], list[str]] = {}
    for leaf in keys_named().leaves.values():
        if leaf.source and leaf.key.partition(".")[0] not in ("classify", "record", "simulation"):
            found.setdefault((leaf.source, leaf.confidence), []).append(leaf.key)
    rows = ([*of, ", ".join(map(code, keys))] for of, keys in found.items())
    return table(["source", "confidence", "keys"], rows)


def all_keys() -> dict[str, dict[str, Leaf]]:
    """Every leaf, by its key and by the models that have it, in file order."""
    found: dict[str, dict[str, Leaf]] = {}
    for name in (MODEL, *(name for name in NAMES if name != MODEL)):
        for key, leaf in keys_named(name).leaves.items():
            found.setdefault(key, {})[name] = leaf
    return found


# Groups of keys whose meaning is more than their name.
SAID = ("bit.cutting", "bit.friction", "well.friction", "stabilizer.friction")


def study_keys() -> str:
    """All sections in file order, of all models; the sweep, which is no dataclass, by
    hand from its own leaves."""
    meanings: dict[str, str] = {}
    for name in reversed((MODEL, *(name for name in NAMES if name != MODEL))):
        meanings |= keys_named(name).meanings
    every = all_keys()
    sections = list(dict.fromkeys(key.partition(".")[0] for key in every if key != "model"))
    last = ("operation", "initial", "simulation", "classify", "record")
    sections = [name for name in sections if name not in last] + list(last)
    rows = [
        [code("title"), "empty", MEANINGS["title"]],
        [code("units"), f"{UNITS_LEAF.default_text}; {forms(UNITS_LEAF)}", MEANINGS["units"]],
        [code("model"), f"{model_leaf().default_text}; {forms(model_leaf())}", MEANINGS["model"]],
    ]
    told: set[str] = set()
    for section in sections:
        if section == "simulation":
            rows += sweep_keys()
        for key, leaves in every.items():
            if not key.startswith(f"{section}."):
                continue
            groups = key.split(".")[:-1]
            for i in range(1, len(groups) + 1):
                name = ".".join(groups[:i])
                if name not in told and (i == 1 or name in SAID):
                    told.add(name)
                    rows.append([f"**{code(name)}**", "", f"*{meanings[name]}*"])
            rows.append(key_row(leaves))
        if section == "initial":  # the slice is no leaf
            states = ", ".join(map(code, keys_named().slices))
            rows.append([code(SLICE), f"none; two of {states}", keys_named().meanings[SLICE]])
    return table(["key", "default; others", "meaning"], rows)


def key_row(leaves: dict[str, Leaf]) -> list[str]:
    """A key with what its models have of their own: which have it, other defaults,
    other choices."""
    name, leaf = next(iter(leaves.items()))
    meaning = leaf.meaning
    defaults = {other: ", ".join(filter(None, (its.default_text, its.other_defaults))) for other, its in leaves.items()}
    default = told = defaults[name]
    for other, its in defaults.items():
        if its != default:
            told += f"; `{other}`: {its}"
    more = [word for its in leaves.values() for word in its.choices if word not in leaf.choices]
    others = "" if leaf.kind == "switch" else forms(leaf, dict.fromkeys(more))
    if name != MODEL:
        meaning += f" ({', '.join(map(code, leaves))})"
    return [code(leaf.key), "; ".join(filter(None, (told, others))), meaning]


def continuation_keys() -> str:
    defaults = {
        "motions": f"[{', '.join(MOTIONS)}]",
        "lobes": str(list(LOBES)),
        "switch": "true",
        "points": POINTS_OF_BRANCH.default_text,
        "curves.of": f"[{', '.join(BORDERS)}]",
        "curves.points": CURVE_POINTS.default_text,
        "seeds": f"{SEEDS} values of the range",
    }
    needed = ("along", "from", "to", "curves.over", "curves.from", "curves.to")
    names = [key.removeprefix("continue.") for key in MEANINGS if key.startswith("continue.")]
    rows = (
        [
            code(f"continue.{name}"),
            "needed" if name in needed else defaults.get(name, "none"),
            MEANINGS[f"continue.{name}"],
        ]
        for name in names
    )
    return table(("key", "default", "meaning"), rows)


def sweep_keys() -> list[list[str]]:
    rows = [["**`sweep`**", "", f"*{MEANINGS['sweep']}*"]]
    span = "`{from, to, points}` (and `spacing: log`), a list, or a value"
    names = ", ".join(code(f"sweep.{axis}") for axis in ("depth", "wob", "rotary_speed"))
    rows.append([names, f"as in `operation`; {span}", "Depths, weights on bit, rotary speeds"])
    sections = ", ".join(map(code, keys_named().physical))
    rows.append(["`sweep.KEY`", "its own; the same forms", f"Any number or word of {sections}"])
    for leaf in (PROCEDURE, along(keys_named()), REFINE):
        default = "null" if leaf.default is None else str(leaf.default)
        rows.append([code(leaf.key), "; ".join(filter(None, (default, forms(leaf)))), leaf.meaning])
    rows.append(["**`uncertain`**", "", f"*{MEANINGS['uncertain']}*"])
    kinds = "; ".join(f"`{{{kind}: {form}}}`" for kind, form in EXAMPLES.items())
    rows.append(["`uncertain.KEY`", f"none; {kinds}", "Distribution of a number"])
    for leaf in (SAMPLES, SEED, DESIGN):
        others = "; ".join(filter(None, (leaf.default_text, forms(leaf))))
        rows.append([code(leaf.key), others, leaf.meaning])
    for name, form in (("correlations", "`[[KEY, KEY, correlation], ...]`"), ("table", "`{KEY: [value, ...], ...}`")):
        rows.append([f"`uncertain.{name}`", f"none; {form}", MEANINGS[f"uncertain.{name}"]])
    return rows


def units() -> str:
    return "; ".join(", ".join(map(code, names)) for names in USUAL.values()) + ".\n"


def flags(variable: Variable) -> str:
    words = (variable.flag_meanings or "").split()
    values = variable.flag_masks or variable.flag_values or ()
    kind = "bits: " if variable.flag_masks else ""
    listed = ", ".join(f"{value} {word}" for value, word in zip(values, words, strict=True))
    return f" ({kind}{listed})" if words else ""


ROOMS = {
    "run": "bookkeeping",
    "feature": "feature",
    "label": "label",
    "peaks": "peaks",
    "section": "section",
    "states": "states",
    "trust": "check",
}
ONLY = {
    "peaks": "record.peaks",
    "returns": "record.poincare",
    "exponent": "record.exponent",
    "starts": "initial.ensemble",
    "verify": "simulation.verify",
    "method": "simulation.method",
    "drive_speed": "drive.kind",
    "stabilizers": "stabilizer.clearance",
    "inclined": "well.inclination",
    "drilled": "bit.cutting",
    "regenerative": "bit.rock.law",
}


EXTREME = re.compile(r"^(least|greatest|mean|lowest|highest) ")
CHECK = re.compile(r" (?:with a smaller tolerance|when continued for longer)")
PLANE = re.compile(r", (?:x|y)(?=,|$)(?:, across it|, the low side at -y)?")
NUMBER = re.compile(r"(?<=mode )\d+|(?<=frequency )\d\b|(?<=of )\d(?= half)")


def in_families(rows: Iterable[list[str]]) -> list[list[str]]:
    """Rows of a name, further cells and a meaning; those of a family in one: least,
    greatest and mean; the two checks; x and y; numbered ones."""
    found: dict[tuple[str, ...], list[tuple[str, str]]] = {}
    for name, *cells, meaning in rows:
        alike = PLANE.sub("", NUMBER.sub("N", EXTREME.sub("", CHECK.sub("", meaning))))
        if "that becomes" in meaning or "of the sinusoid" in meaning:  # of what is before
            alike = name
        found.setdefault((alike.replace("waves", "wave"), *cells), []).append((name, meaning))
    return [
        [named([name for name, _ in members]), *cells, told([words for _, words in members])]
        for (_, *cells), members in found.items()
    ]


def named(names: list[str]) -> str:
    return ", ".join(names if len(names) < 4 else [names[0], "...", names[-1]])


def told(meanings: list[str]) -> str:
    """What the meanings of a family have in common, and in what they differ."""
    first, *others = meanings
    if not others:
        return first
    if CHECK.search(first):
        return CHECK.sub("", first) + ", of the two checks"
    leads = list(dict.fromkeys(match[1] for one in meanings if (match := EXTREME.match(one))))
    if len(leads) > 1:
        return f"{', '.join(leads)} {EXTREME.sub('', first)}"
    return PLANE.sub(", x and y", NUMBER.sub("N", first))


def results_variables() -> str:
    """The variables of a sweep, by rooms."""
    text: list[list[str]] = []
    rooms: dict[str, list[list[str]]] = {}
    for v in described(MODEL).variables:
        extra = "".join(f", on {code(name)}" for name in v.dims[4:])
        only = f" ({code(ONLY[v.only])})" if v.only else ""
        row = [code(v.name), v.units or "`state_units`", extra, only, v.long_name + flags(v)]
        rooms.setdefault(v.origin, []).append(row)
    for room, rows in rooms.items():
        text.append([f"**{ROOMS[room]}**", "", ""])
        for names, units, extra, only, meaning in in_families(rows):
            text.append([names, units, meaning + extra + only])
    return table(["variable", "units", "meaning"], text)


def trace_variables() -> str:
    rows = ([code(v.name), v.units, v.long_name] for v in described(MODEL).trace)
    return table(["variable", "units", "meaning"], in_families(rows))


def other_variables() -> str:
    """What only other models than the usual one have in results and traces."""
    usual = {v.name for v in (*described(MODEL).variables, *described(MODEL).trace)}
    rows = [
        [code(v.name), code(name), v.units, v.long_name]
        for name in NAMES
        if name != MODEL
        for v in dict.fromkeys((*described(name).variables, *described(name).trace))
        if v.name not in usual
    ]
    return table(["variable", "model", "units", "meaning"], in_families(rows))


# Studies that together have every quantity of ``check``.
CHECKED = {
    # of friction that is as good as dry: how much further stick-slip lasts by that is of each study
    "": {"model": MODEL, "bit": {"friction": {"smoothing": "1e5 s/rad"}}},
    "a drive": {"drive": {"kind": "soft_torque", "torque_limit": "20 kN*m"}},
    "`dc_motor`": {"drive": {"kind": "dc_motor"}},
    "`mud.swirl`": {"mud": {"swirl": 0.5}},
    "`well.inclination`": {"well": {"inclination": "30 deg"}},
    "`beam`": {"model": "beam"},
    "`segments`": {"model": "segments"},
}


def check_quantities() -> str:
    rows = dict.fromkeys(further_quantities(Parameters(), Operation()))  # of another table
    for where, study in CHECKED.items():
        for name, found in nsdrill.check(study).as_json()["figures"].items():
            if name not in rows:
                rows[name] = [code(name), found["units"], found["meaning"], where]
    listed = [[name, units, where, words] for name, units, words, where in filter(None, rows.values())]
    families = in_families(listed)
    return table(
        ["name", "units", "meaning"],
        ([n, u, words + (f" ({where})" if where else "")] for n, u, where, words in families),
    )


def kinds() -> str:
    every = all_kinds().values()

    listed = [
        [code(kind.name), of, kind.words]
        for of in GROUPS
        if of != VALUE
        for kind in every
        if kind.of == of and not kind.part_of
    ]
    parts = [
        [
            ", ".join(code(kind.name) for kind in every if kind.part_of == whole),
            f"{code(whole)}, with `--panel`",
            "one panel of it; also taken by `--kind`",
        ]
        for whole in ("map", "trace")
    ]
    short = ", ".join(
        f"{code(short)} for {code(long)}" for short, long in described(MODEL).drawn.values.items() if short != long
    )
    values = ["any feature by its name", "a sweep", f"one value along the axis, or as a map; short names: {short}"]
    return table(["kind", "of", "what it shows"], [*listed, *parts, values])


def options_of(name: str) -> list[tuple[str, str]]:
    """The options of a command, each as its name and its text."""
    import click

    command = group.get_command(click.Context(group), name)
    assert command is not None
    return [(option_name(o), option_text(o)) for o in command.params if isinstance(o, click.Option)]


def shared() -> dict[tuple[str, str], list[str]]:
    """The options that three commands or more have with the same words, and these
    commands."""
    found: dict[tuple[str, str], list[str]] = {}
    for name in COMMANDS:
        for option in options_of(name):
            found.setdefault(option, []).append(name)
    return {option: names for option, names in found.items() if len(names) > 2}


def common_options() -> str:
    return table(["option", "meaning"], shared())


def command_line() -> str:
    """Every command with its arguments and options, as the command line itself has
    them, less its examples."""
    import click

    common = shared()
    text = ""
    with click.Context(group, info_name="nsdrill") as parent:
        for name in COMMANDS:
            command = group.get_command(parent, name)
            assert command is not None
            context = click.Context(command, info_name=f"nsdrill {name}")
            usage = " ".join(command.collect_usage_pieces(context)[1:])
            meaning = inspect.cleandoc((command.help or "").replace("\b\n", ""))
            meaning = meaning.partition("\n\n")[0]
            text += f"\n### nsdrill {name}\n\n`nsdrill {name} [OPTIONS] {usage}".rstrip() + "`\n\n"
            text += f"{meaning}\n\n"
            own = [option for option in options_of(name) if option not in common]
            if own:
                text += table(["option", "meaning"], own) + "\n"
            known = [option for option, words in options_of(name) if (option, words) in common]
            names = [name for option in known for name in re.findall(r"`(--?[\w-]+)", option)]
            if names:
                text += f"And: {', '.join(map(code, names))}.\n"
    return text


def option_name(option: object) -> str:
    import click

    assert isinstance(option, click.Option)
    metavar = ""
    if not option.is_flag:
        choices = getattr(option.type, "choices", None)
        metavar = " " + (" or ".join(choices) if choices else option.metavar or option.type.name.split()[0].upper())
    return ", ".join(code(name + (metavar if name.startswith("--") else "")) for name in option.opts)


def option_text(option: object) -> str:
    import click

    assert isinstance(option, click.Option)
    parts = [option.help.rstrip(".") + "." if option.help else ""]
    if option.required:
        parts.append("Required.")
    if isinstance(option.default, str):
        parts.append(f"Default: `{option.default}`.")
    return " ".join(part for part in parts if part)


def python_functions() -> str:
    """Every function of the package, as its signature and the beginning of its
    docstring have it."""
    return "".join(
        f"\n### {name}\n\n```python\n{signature(name)}\n```\n\n{summary(getattr(nsdrill, name))}\n"
        for name in nsdrill.__all__
        if name.islower()
    )


def summary(thing: object) -> str:
    """The first paragraph of a docstring, as Markdown."""
    return docstring(thing).partition("\n\n")[0]


def signature(name: str) -> str:
    """How a function is called; the kinds of its arguments are in its docstring."""
    found = inspect.signature(getattr(nsdrill, name))
    bare = [one.replace(annotation=inspect.Parameter.empty) for one in found.parameters.values()]
    text = f"nsdrill.{name}{inspect.Signature(bare)}".replace("'", '"')
    return "\n".join(textwrap.wrap(text, 100, subsequent_indent="    "))


def python_classes() -> str:
    names = [name for name in nsdrill.__all__ if not name.islower()]
    return table(
        ["class", "meaning"],
        ([code(f"nsdrill.{name}"), " ".join(summary(getattr(nsdrill, name)).split())] for name in names),
    )


def docstring(thing: object) -> str:
    """A docstring as Markdown."""
    text = re.sub(r":\w+:`(?:~?[\w.]+\.)?(\w+)`", link, inspect.cleandoc(thing.__doc__ or ""))
    return text.replace("``", "`").replace("<", "&lt;")


def link(found: re.Match[str]) -> str:
    name = found[1]
    return f"[`{name}`](#{name})" if name in nsdrill.__all__ and name.islower() else f"`{name}`"


def equations_of(model: str) -> Callable[[], str]:
    """The source of a model's equations, with what they call of its own folder."""

    def text() -> str:
        function = variant_of(model_named(model), MOTIONS_OF[model]).motion.equations
        return source(*called_by(function, function.__module__.rpartition(".")[0]), function)

    return text


def called_by(function: Any, package: str, seen: tuple[Any, ...] = ()) -> list[Any]:
    """The functions of a package that a function calls, and that these call, but for those
    that a script adds to."""
    found: list[Any] = []
    for name in function.__code__.co_names:
        helper = inspect.unwrap(function.__globals__.get(name, name))
        if not inspect.isfunction(helper) or helper in (*found, *seen, law_numbered, numbered):
            continue
        if helper.__module__.startswith(package):
            found += [one for one in (*called_by(helper, package, (*seen, function)), helper) if one not in found]
    return found


# A variant of each model.
MOTIONS_OF: dict[str, tuple[int, ...]] = {MODEL: Options(), "beam": Collar(2, 1), "segments": (3, 2, 0), "torsion": ()}


def friction_laws() -> str:
    from nsdrill.models import friction

    text = inspect.getsource(friction)
    begin, end = text.index("def _hyperbolic"), text.index("# Beside those of nsdrill; by name")
    return f"```python\n{text[begin:end].strip()}\n```\n"


def source(*functions: Any) -> str:
    return "```python\n" + "\n\n\n".join(inspect.getsource(f).strip() for f in functions) + "\n```\n"


TABLES: dict[str, Callable[[], str]] = {
    **{f"equations of {name}": equations_of(name) for name in (MODEL, "beam", "segments", "torsion")},
    "friction laws": friction_laws,
    "parameters": parameters,
    "study keys": study_keys,
    "continuation keys": continuation_keys,
    "units": units,
    "results variables": results_variables,
    "trace variables": trace_variables,
    "other variables": other_variables,
    "check quantities": check_quantities,
    "plot kinds": kinds,
    "common options": common_options,
    "command line": command_line,
    "python functions": python_functions,
    "python classes": python_classes,
}


def filled(text: str) -> str:
    """The page with all its tables made anew."""
    return BLOCK.sub(lambda match: f"{match[1]}{TABLES[match[2]]()}{match[3]}", text)


def main(arguments: list[str]) -> int:
    stale = []
    for page in sorted(HERE.rglob("*.md")):
        text = page.read_text(encoding="utf-8")
        new = filled(text)
        if new != text:
            stale.append(page.name)
            if "--check" not in arguments:
                page.write_text(new, encoding="utf-8")
    checking = "--check" in arguments
    for name in stale:
        print(f"{name}: {'stale; run python docs/make_tables.py' if checking else 'written'}")
    return 1 if checking and stale else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
