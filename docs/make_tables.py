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
from collections.abc import Callable, Iterable
from pathlib import Path

import nsdrill
from nsdrill import api
from nsdrill.cli.main import COMMANDS, group
from nsdrill.models.christoforou_yigit.checks import MEANINGS as COEFFICIENTS
from nsdrill.models.christoforou_yigit.coefficients import UNITS
from nsdrill.models.christoforou_yigit.further_quantities import further_quantities
from nsdrill.models.christoforou_yigit.parameters import Parameters
from nsdrill.models.operation import Operation
from nsdrill.models.registry import NAMES, described
from nsdrill.models.segments.checks import COEFFICIENTS as OF_SEGMENTS
from nsdrill.plot.kinds.value import ALIASES
from nsdrill.plot.registry import GROUPS, VALUE, all_kinds
from nsdrill.study.continuation import (
    BORDERS,
    CURVE_KEYS,
    CURVE_POINTS,
    KEYS,
    LOBES,
    MOTIONS,
    SEEDS,
)
from nsdrill.study.continuation import POINTS as POINTS_OF_BRANCH
from nsdrill.study.keys import MANY, MEANINGS, MODEL_LEAF, RAMP, SLICE, Leaf, keys_of
from nsdrill.study.schema import LONGEST_TITLE, POINTS, PROCEDURE, REFINE, along
from nsdrill.study.uncertain import DESIGN, EXAMPLES, SAMPLES, SEED
from nsdrill.units import USUAL
from nsdrill.variables import COORDINATES, MODEL, Variable

HERE = Path(__file__).parent
BLOCK = re.compile(r"(<!-- table: ([\w ]+) -->\n).*?(<!-- end of table -->)", re.DOTALL)

SYMBOLS = {
    "drillstring.collar.outer_diameter": "D_co",
    "drillstring.collar.inner_diameter": "D_ci",
    "drillstring.collar.length": "L_c",
    "drillstring.collar.span": "l",
    "drillstring.material.density": "rho",
    "drillstring.material.young_modulus": "E",
    "drillstring.material.shear_modulus": "G",
    "drillstring.eccentricity": "e0",
    "drillstring.axial_damping": "c_a",
    "drillstring.torsional_damping": "c_t",
    "mud.density": "rho_f",
    "mud.added_mass": "C_A",
    "mud.drag": "C_D",
    "well.diameter": "D_well",
    "well.stiffness": "k_w",
    "well.friction.static": "mu_s",
    "well.friction.dynamic": "mu_d",
    "well.friction.smoothing": "eps",
    "well.friction.decay": "tau",
    "bit.lobes": "n_b",
    "bit.surface_amplitude": "s0",
    "bit.rock_stiffness": "k_c",
    "bit.cutting.zeta": "zeta",
    "bit.cutting.c1": "c1",
    "bit.cutting.c2": "c2",
    "bit.friction.static": "mu_s",
    "bit.friction.dynamic": "mu_d",
    "bit.friction.smoothing": "eps",
    "bit.friction.decay": "tau",
    "bit.friction.dynamic_from": "V0",
    "bit.friction.b0": "b0",
    "bit.friction.b1": "b1",
    "bit.friction.b2": "b2",
    "bit.friction.b3": "b3",
    "operation.wob": "W",
    "operation.rotary_speed": "Omega",
}


def table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """A Markdown table; bars within cells are escaped."""
    head = list(head)
    lines = [
        head,
        ["---"] * len(head),
        *([str(cell).replace("|", "\\|") for cell in row] for row in rows),
    ]
    return "".join("| " + " | ".join(line) + " |\n" for line in lines)


def code(text: str) -> str:
    return f"`{text}`" if text else ""


def allowed(leaf: Leaf) -> str:
    """The range or the choices of a key."""
    if leaf.choices and len(leaf.choices) >= MANY:
        return "the key of a swept axis, or `null`"
    if leaf.choices:
        return ", ".join(map(code, leaf.choices)) + (", or `null`" if leaf.nullable else "")
    if leaf.kind == "switch":
        return "`true`, `false`"
    if leaf.kind == "table":
        return (
            f"1 to {leaf.most} records of "
            f"{', '.join(code(part.key.rpartition('.')[2]) for part in leaf.parts)}"
        )
    if leaf.kind == "list":
        return (
            f"1 to {leaf.most} values, {leaf.bound(leaf.low)} to {leaf.bound(leaf.high)} each"
            + (", or `null`" if leaf.nullable else "")
        )
    if leaf.words:
        return (
            f"{', '.join(map(code, leaf.words))}, or {leaf.bound(leaf.low)} to "
            f"{leaf.bound(leaf.high)}"
        )
    ends = (
        [leaf.bound(leaf.low)]
        if leaf.low == leaf.high
        else [leaf.bound(leaf.low), leaf.bound(leaf.high)]
    )
    return " to ".join(ends) + (", or `null`" if leaf.nullable else "")


def unit(leaf: Leaf) -> str:
    if leaf.kind == "whole":
        return "whole number"
    return leaf.units or ("" if leaf.kind in ("choice", "switch", "table") else "bare number")


def parameters() -> str:
    sections = ("drillstring", "mud", "well", "bit", "operation")
    found = [leaf for section in sections for leaf in keys_of().of(section)]
    rows = (
        [
            code(leaf.key),
            code(SYMBOLS.get(leaf.key, "")),
            leaf.default_text,
            leaf.source,
            leaf.confidence,
        ]
        for leaf in found
    )
    return table(["key", "symbol", "default", "source", "confidence"], rows)


def segments_keys() -> str:
    """The keys of the string of segments, with their sources."""
    keys = keys_of("segments")
    rows = (
        [
            code(leaf.key),
            leaf.default_text,
            allowed(leaf),
            leaf.meaning,
            leaf.source,
            leaf.confidence,
        ]
        for section in (*keys.model.sections, "initial")
        for leaf in keys.of(section)
    )
    return table(["key", "default", "allowed", "meaning", "source", "confidence"], rows)


def study_keys() -> str:
    """All sections in file order; the sweep, which is no dataclass, by hand from its
    own leaves."""
    text = (
        "| key | unit | default | allowed | in the field | meaning |\n| --- | --- | --- | --- | "
        "--- | --- |\n"
    )
    text += (
        f"| `title` | text | empty | at most {LONGEST_TITLE} characters | | {MEANINGS['title']} |\n"
    )
    text += (
        f"| `model` | | {code(MODEL_LEAF.default_text)} | {allowed(MODEL_LEAF)} | | "
        f"{MEANINGS['model']} |\n"
    )
    told: set[str] = set()
    for section in keys_of().sections:
        if section == "simulation":
            text += sweep_keys()
        for leaf in keys_of().of(section):
            groups = leaf.key.split(".")[:-1]
            for i in range(1, len(groups) + 1):
                name = ".".join(groups[:i])
                if name not in told:
                    told.add(name)
                    text += f"| **`{name}`** | | | | | *{keys_of().meanings[name]}* |\n"
            default = leaf.default_text
            ramp = (
                f", or [a ramp](ramps.md) of such values, `{RAMP}`"
                if section == "operation"
                else ""
            )
            cells = [
                code(leaf.key),
                unit(leaf),
                default,
                allowed(leaf) + ramp,
                leaf.usual,
                leaf.meaning,
            ]
            text += "| " + " | ".join(cells) + " |\n"
        if section == "initial":  # the slice is no leaf
            states = ", ".join(map(code, keys_of().slices))
            form = f"two of {states}, each `{{from, to, points}}`, in its unit"
            text += f"| `{SLICE}` | | none | {form} | | {keys_of().meanings[SLICE]} |\n"
    return text


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
    names = [*KEYS, *(f"curves.{name}" for name in CURVE_KEYS)]
    rows = (
        [
            code(f"continue.{name}"),
            "needed" if name in needed else defaults.get(name, "none"),
            MEANINGS[f"continue.{name}"],
        ]
        for name in names
    )
    return table(("key", "default", "meaning"), rows)


def sweep_keys() -> str:
    text = f"| **`sweep`** | | | | | *{MEANINGS['sweep']}* |\n"
    every = keys_of().leaves
    for axis in ("depth", "wob", "rotary_speed"):
        of = every[f"operation.{axis}"]
        span = f"`{{from, to, points}}` (points {allowed(POINTS)}; `spacing: log` for equal ratios)"
        form = f"{span}, a list, or one value; each {allowed(of)}"
        text += (
            f"| `sweep.{axis}` | {of.units} | from `operation` | {form} | | "
            f"{MEANINGS[f'sweep.{axis}']} |\n"
        )
    form = "as those above, in the unit and the range of the key"
    sections = "`, `".join(keys_of().physical)
    text += (
        f"| `sweep.KEY` | | from the key | {form} | | Any other number of `{sections}` by its "
        f"dotted key |\n"
    )
    for leaf in (PROCEDURE, along(keys_of()), REFINE):
        default = "null" if leaf.default is None else leaf.default
        text += (
            f"| `{leaf.key}` | {unit(leaf)} | {default} | {allowed(leaf)} | | {leaf.meaning} |\n"
        )
    return text + uncertain_keys()


def uncertain_keys() -> str:
    text = f"| **`uncertain`** | | | | | *{MEANINGS['uncertain']}* |\n"
    forms = "; ".join(f"`{{{kind}: {form}}}`" for kind, form in EXAMPLES.items())
    words = "Distribution of a number that an axis may vary, by its key"
    text += f"| `uncertain.KEY` | | none | one of {forms} | | {words} |\n"
    for leaf in (SAMPLES, SEED, DESIGN):
        text += f"| `{leaf.key}` | | {leaf.default_text} | {allowed(leaf)} | | {leaf.meaning} |\n"
    for name, form in (
        ("correlations", "`[[KEY, KEY, rank correlation], ...]`"),
        ("table", "`{KEY: [value, ...], ...}`"),
    ):
        text += f"| `uncertain.{name}` | | none | {form} | | {MEANINGS[f'uncertain.{name}']} |\n"
    return text


def thresholds() -> str:
    rows = (
        [
            code(leaf.key),
            leaf.default_text + (" %" if leaf.units == "percent" else ""),
            leaf.meaning,
            leaf.source,
        ]
        for leaf in keys_of().of("classify")
    )
    return table(["key", "default", "meaning", "source"], rows)


def units() -> str:
    return table(
        ["quantity in", "units to write (any unit of that dimension is read)"],
        ([code(si), ", ".join(map(code, names))] for si, names in USUAL.items()),
    )


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
}


def results_variables() -> str:
    def rows() -> Iterable[list[str]]:
        for v in described(MODEL).variables:
            extra = ", ".join(code(name) for name in v.dims[4:])
            yield [
                code(v.name),
                v.dtype,
                v.units or "`state_units`",
                ROOMS[v.room],
                extra,
                v.long_name + flags(v),
                code(ONLY[v.only]) if v.only else "",
            ]

    return table(
        ["variable", "type", "units", "kind", "further dimension", "meaning", "only with"], rows()
    )


def trace_variables() -> str:
    return table(
        ["variable", "type", "units", "meaning"],
        ([code(v.name), v.dtype, v.units, v.long_name] for v in described(MODEL).trace),
    )


def other_variables() -> str:
    """What only other models than the usual one have in results and traces."""
    usual = {v.name for v in (*described(MODEL).variables, *described(MODEL).trace)}
    others = [name for name in NAMES if name != MODEL]
    rows = (
        [code(v.name), code(name), ROOMS.get(v.room, "trace"), v.units, v.long_name]
        for name in others
        for v in dict.fromkeys((*described(name).variables, *described(name).trace))
        if v.name not in usual
    )
    return table(["variable", "model", "kind", "units", "meaning"], rows)


def coordinates() -> str:
    return table(
        ["dimension", "units", "meaning"],
        ([code(name), units, words] for name, (units, words) in COORDINATES.items()),
    )


def coefficients() -> str:
    rows = [[code(n), UNITS[n], words] for n, words in COEFFICIENTS.items()]
    rows += [
        [code(n), units, f"{words} (`segments`)"]
        for n, (units, words) in OF_SEGMENTS.items()
        if n not in COEFFICIENTS
    ]
    return table(["name", "units", "meaning"], rows)


# Studies that together have every quantity of ``check``.
CHECKED = {
    "": {"model": MODEL},
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
    return table(["name", "units", "meaning", "with"], [row for row in rows.values() if row])


def further() -> str:
    found = further_quantities(Parameters(), Operation())
    return table(
        ["name", "units", "meaning"], ([code(n), f.units, f.meaning] for n, f in found.items())
    )


def kinds() -> str:
    every = all_kinds().values()

    listed = [
        [code(kind.name), of, kind.words]
        for of in GROUPS
        if of != VALUE
        for kind in every
        if kind.of == of
    ]
    short = ", ".join(f"{code(short)} for {code(long)}" for short, long in ALIASES.items())
    values = [
        "any feature by its name",
        "a sweep",
        f"one value along the axis, or as a map; short names: {short}",
    ]
    return table(["kind", "of", "what it shows"], [*listed, values])


def command_line() -> str:
    """Every command with its arguments and options, as the command line itself has
    them."""
    import click

    text = ""
    with click.Context(group, info_name="nsdrill") as parent:
        for name in COMMANDS:
            command = group.get_command(parent, name)
            assert command is not None
            context = click.Context(command, info_name=f"nsdrill {name}")
            usage = " ".join(command.collect_usage_pieces(context)[1:])
            meaning = inspect.cleandoc((command.help or "").replace("\b\n", ""))
            text += (
                f"\n### nsdrill {name}\n\n{meaning}\n\n```\nnsdrill {name} [OPTIONS] {usage}".rstrip()
                + "\n```\n\n"
            )
            options = [p for p in command.params if isinstance(p, click.Option)]
            if options:
                text += table(
                    ["option", "meaning"], ([option_name(o), option_text(o)] for o in options)
                )
            else:
                text += "No options.\n"
            _, found, examples = (command.epilog or "").partition("Examples:\n")
            if found:
                text += f"\n```sh\n{inspect.cleandoc(examples)}\n```\n"
    return text


def option_name(option: object) -> str:
    import click

    assert isinstance(option, click.Option)
    metavar = ""
    if not option.is_flag:
        choices = getattr(option.type, "choices", None)
        metavar = " " + (
            "|".join(choices) if choices else option.metavar or option.type.name.split()[0].upper()
        )
    return ", ".join(
        code(name + (metavar if name.startswith("--") else "")) for name in option.opts
    )


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
    """Every function of the package, as its signature and its docstring have it."""
    return "".join(
        f"\n### {name}\n\n```python\n{signature(name)}\n```\n\n{docstring(getattr(api, name))}\n"
        for name in nsdrill.__all__
        if name.islower()
    )


def signature(name: str) -> str:
    """How a function is called; on several lines where it is long."""
    found = inspect.signature(getattr(api, name))
    text = f"nsdrill.{name}{found}".replace("'", "")
    for parameter in found.parameters.values():  # a text as a default is in quotes
        if isinstance(parameter.default, str):
            text = text.replace(f" = {parameter.default}", f' = "{parameter.default}"')
    if len(text) <= 100:
        return text
    head, _, tail = text.partition("(")
    words, _, result = tail.rpartition(") -> ")
    parts: list[str] = []
    for part in words.split(", "):  # a comma within brackets does not end a parameter
        if parts and parts[-1].count("[") > parts[-1].count("]"):
            parts[-1] += f", {part}"
        else:
            parts.append(part)
    return f"{head}(\n" + "".join(f"    {part},\n" for part in parts) + f") -> {result}"


def python_classes() -> str:
    names = [name for name in nsdrill.__all__ if not name.islower()]
    return table(
        ["class", "meaning"],
        (
            [code(f"nsdrill.{name}"), " ".join(docstring(getattr(nsdrill, name)).split())]
            for name in names
        ),
    )


def docstring(thing: object) -> str:
    """A docstring as Markdown."""
    text = re.sub(r":\w+:`(?:~?[\w.]+\.)?(\w+)`", link, inspect.cleandoc(thing.__doc__ or ""))
    return text.replace("``", "`").replace("<", "&lt;")


def link(found: re.Match[str]) -> str:
    name = found[1]
    return f"[`{name}`](#{name})" if name in nsdrill.__all__ and name.islower() else f"`{name}`"


TABLES: dict[str, Callable[[], str]] = {
    "parameters": parameters,
    "segments keys": segments_keys,
    "study keys": study_keys,
    "continuation keys": continuation_keys,
    "thresholds": thresholds,
    "units": units,
    "results variables": results_variables,
    "trace variables": trace_variables,
    "other variables": other_variables,
    "coordinates": coordinates,
    "coefficients": coefficients,
    "check quantities": check_quantities,
    "further quantities": further,
    "plot kinds": kinds,
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
