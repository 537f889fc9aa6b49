"""What was studied, in a line of words: the numbers of a study that another one may have
otherwise, in the units of their quantities."""

from __future__ import annotations

from collections.abc import Iterator

from nsdrill.app.experiment import own_keys, unread_keys
from nsdrill.data import Answer, Attributes, Resolved, Results, flat, resolved_study
from nsdrill.models.choices import words_along
from nsdrill.models.sections import SHORT_KEYS
from nsdrill.quantity import find, quantity
from nsdrill.sampling import BOUNDS
from nsdrill.study.uncertain import FACTOR, HOW
from nsdrill.text.string_parts import IN_ASSEMBLY, assembly
from nsdrill.words.values import Formatter, in_order

DIGITS = 4
# What decides where stick-slip, whirl and bit-bounce end, and is on no sheet of an assembly.
ALWAYS_SHOWN = (
    "drillstring.torsional_damping",
    "bit.friction.static",
    "bit.friction.dynamic",
    "drillstring.eccentricity",
    "bit.rock_stiffness",
)
OF_LOBES = ("bit.surface_amplitude", "drillstring.axial_damping")  # the same of a bit that lobes lift


def studied(attrs: Attributes, results: Results | None, units: str, *, composed: bool = False) -> list[str]:
    """The axes of a sweep, what is assumed of its unknowns, and the other numbers of a
    file with these root attributes that differ from well to well or from the defaults; ``composed`` with the parts of
    the string in one text, as :func:`assembly` has them."""
    study = resolved_study(attrs)
    axes = {} if results is None else dict(_axes(results, units))
    uncertain = study.get("uncertain", {})
    assumed = {key: _assumed(key, shape, units) for key, shape in uncertain.items() if key not in HOW}
    for key, values in uncertain.get("table", {}).items():
        assumed[key] = f"{quantity(key).words} from a table of {len(values)} rows"
    varied = {quantity(key).name for key in (*assumed, *axes)}
    string = assembly(study, units, frozenset(varied)) if composed else ""
    within = {quantity(key).name for key in IN_ASSEMBLY} if string else set()
    fixed = [text for name, text in _values(attrs, study, units) if name not in varied | within]
    return [*axes.values(), *filter(None, [string]), *fixed, *assumed.values()]


def _axes(results: Results, units: str) -> Iterator[tuple[str, str]]:
    fmt = Formatter(units)
    for name in in_order(results.swept):
        values = results.coords[name].tolist()
        if words_along(name):
            yield name, f"{quantity(name).words} {', '.join(quantity(name).text(value, units) for value in values)}"
        else:
            yield name, f"{fmt.span(name, [min(values), max(values)])} ({len(values)} values)"


def _values(attrs: Attributes, study: Resolved, units: str) -> Iterator[tuple[str, str]]:
    """The name and the words of each number or word of the study that has words."""
    own, unread = {*own_keys(attrs), *SHORT_KEYS, *ALWAYS_SHOWN, "drive.kind"}, unread_keys(attrs)
    bit = study.get("bit")
    own |= set(OF_LOBES) if isinstance(bit, dict) and bit.get("surface_amplitude") else set()
    for key, value in flat(study):
        shown = find(key)
        if shown is None or key in unread or not (key in own or key.startswith("operation.")):
            continue
        if isinstance(value, str):
            yield shown.name, f"{shown.words} {value.replace('_', ' ')}"
        elif isinstance(value, bool):
            yield shown.name, f"{shown.words} {'on' if value else 'off'}"
        elif isinstance(value, int | float):
            yield shown.name, f"{shown.words} {shown.text(value, units, DIGITS)}"


def _assumed(key: str, shape: Answer, units: str) -> str:
    """``eccentricity assumed triangular 1 mm, 2 mm, 8 mm``: a distribution in words."""
    ((kind, numbers),), shown = shape.items(), quantity(key)
    if isinstance(numbers, dict):
        texts = [
            f"{of} {FACTOR.text(value) if of == 'factor' else shown.text(value, units, DIGITS)}"
            for of, value in numbers.items()
            if of not in BOUNDS
        ]
    else:
        texts = [shown.text(value, units, DIGITS) for value in numbers]
    return f"{shown.words} assumed {kind} {', '.join(texts)}"
