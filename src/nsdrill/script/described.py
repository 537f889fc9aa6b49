"""The words and tables of the model of a function: its sections of a study, its
variables, its pictures."""

from __future__ import annotations

import inspect
from collections.abc import Iterator, Sequence
from dataclasses import field, make_dataclass
from functools import partial
from itertools import islice, product
from typing import Any

from nsdrill.data import GUESSED_SCALES, NATURAL_SCALES, json_text
from nsdrill.errors import Fault
from nsdrill.models.base import SMOOTH
from nsdrill.models.model_description import Description, Drawn, Panel
from nsdrill.models.operation import ModelParameters
from nsdrill.models.responses import Response
from nsdrill.models.rules import Rule
from nsdrill.models.starts import Starts, state
from nsdrill.observe.channels import Declaration
from nsdrill.ranges import Checked, parameter
from nsdrill.script.critical import check_responses, check_threshold, orders_of, with_numbers
from nsdrill.script.function_channels import ENDS, creep_words, driving_words, fractions, stepped_words
from nsdrill.script.function_model import SECTION, FunctionModel, scale_name
from nsdrill.script.reading import Reading
from nsdrill.script.rubbing import brakes
from nsdrill.script.signature import LARGE, number
from nsdrill.units import cf_units
from nsdrill.variables import DRIVES, Variable, at_section, feature, fraction, in_trace, last_peaks

MOST_CORNERS = 64  # of the values of a study at which jumps are looked for


def words_of(value: number, name: str) -> str:
    """The meaning of a number in words."""
    return value.meaning or name.replace("_", " ")


def units_of(value: number) -> str:
    """The units of a number as files have them."""
    return cf_units(value.units)


def _parameters(reading: Reading) -> type[ModelParameters]:
    """The section of the study with the numbers of the function."""
    rows: list[tuple[str, type, Any]] = [
        (name, float, parameter(float(v), v.units, low=v.low, high=v.high, meaning=words_of(v, name)))
        for name, v in reading.signature.parameters.items()
    ]
    section = _record("Section", rows, Checked)
    return _record("Parameters", [(SECTION, section, field(default_factory=section))] if rows else [], ModelParameters)


def _start(reading: Reading) -> type[Starts]:
    """The state at the start."""
    start = reading.signature.start
    rows: list[tuple[str, type, Any]] = [
        (name, float, state(float(start[name]), start[name].units, LARGE, "any", words_of(start[name], name)))
        for name in reading.states
    ]
    angle = state(0.0, "rad", 1e9, "any", "Phase of the forcing at the start")
    return _record("Initial", [*rows, ("drive_angle", float, angle)], Starts)


def _record(name: str, rows: list[tuple[str, type, Any]], base: type) -> Any:
    made = make_dataclass(name, rows, bases=(base,), frozen=True)
    made.__module__ = __name__
    return made


def _features(reading: Reading) -> Iterator[Variable]:
    for name in reading.states:
        value = reading.signature.start[name]
        for end, word in ENDS.items():
            yield feature(f"{name}_{end}", units_of(value), f"{word} {words_of(value, name)}", signal=name)
    told = fractions(reading) | driving_words(reading) | creep_words(reading) | stepped_words(reading)
    for name, words in told.items():
        yield fraction(name, words)
    for one in reading.quantities:
        yield from one.variables(units_of(one.about), words_of(one.about, one.name))


def _trace(reading: Reading) -> Iterator[Variable]:
    for name in reading.states:
        value = reading.signature.start[name]
        yield in_trace(name, units_of(value), words_of(value, name), label=value.meaning or name)
    yield in_trace("drive_angle", "rad", "phase of the forcing")
    for name in reading.named:
        yield in_trace(name, "1", name.replace("_", " "), label=name)
    for name in reading.driving:
        yield in_trace(DRIVES.format(name), "1", f"whether the friction of {name} drives", label=f"{name} drives")


def _planes(reading: Reading) -> tuple[tuple[str, str], ...]:
    states = reading.states
    return tuple(reading.pairs.items()) or (((states[0], states[1]),) if len(states) > 1 else ())


def _drawn(reading: Reading, declaration: Declaration) -> Drawn:
    states, planes = reading.states, _planes(reading)
    has_section = declaration.section is not None
    return Drawn(
        panels=tuple(Panel(name, name, f"{name}_peaks", f"{name}_max") for name in states),
        histories=(*states, *reading.named),
        planes=planes,
        section=tuple(f"section_{name}" for name in states) if has_section else (),
        section_planes=tuple((f"section_{a}", f"section_{b}") for a, b in planes) if has_section else (),
        summary=tuple(fractions(reading)),
        attractors=tuple((f"{name}_min", f"{name}_max", f"Swing of {name}") for name in states),
        speed="",
        angle=(),
        radius="",
    )


def description_of(
    reading: Reading, model: FunctionModel, title: str, responses: Sequence[Response] = (), orders: Sequence[str] = ()
) -> Description:
    """The description of the model of a function, with its critical ``responses`` and
    ``orders`` of its numbers as the script has them. InputError where these are none."""
    start, states, features = reading.signature.start, reading.states, tuple(_features(reading))
    by_name = {one.name: one for one in features}
    critical = tuple(with_numbers(reading.signature, one, by_name) for one in responses)
    for one in critical:
        check_threshold(reading, one)
    told = [name for name in states if name not in reading.unread] or states  # of which a motion consists
    forced = model.declared.section is not None
    description = partial(
        Description,
        name=reading.signature.name,
        title=title or _first_line(reading),
        parameters=_parameters(reading),
        initial=_start(reading),
        meanings={SECTION: "The numbers of the equations"},
        features=features,
        responses=critical,
        orders=orders_of(reading, SECTION, orders),
        peaks=tuple(
            last_peaks(f"{n}_peaks", units_of(start[n]), f"last maxima of {words_of(start[n], n)}") for n in states
        ),
        section=tuple(at_section(n, units_of(start[n]), words_of(start[n], n)) for n in states) if forced else (),
        own_trace=tuple(_trace(reading)),
        shown=(
            *(f"{name}_max" for name in states),
            *fractions(reading),
            *(name for one in reading.quantities for name in one.features),
        ),
        compared={f"{n}_{end}": scale_name(n) for n in told for end in ENDS}
        | dict.fromkeys((*fractions(reading), *driving_words(reading))),
        distinguishing=tuple(f"{name}_mean" for name in told),
        attributes=lambda *study: _of_scales(model),
        clocked=reading.clocked,
        rules=(_smooth(model), brakes(reading, SECTION)),
        drawn=_drawn(reading, model.declared),
    )
    try:
        made = description()
        made.thresholds()  # a bound outside its range
    except ValueError as error:
        reading.signature.refuse(*_parted(str(error)))
    check_responses(reading.signature, made, critical)
    return made


def _parted(text: str) -> tuple[str, str]:
    """(what was found, what is allowed) of a message that says both."""
    found, _, allowed = text.removeprefix("responses: found ").partition("; allowed: ")
    return found, allowed or "another one"


def _of_scales(model: FunctionModel) -> dict[str, str]:
    """The root attributes that tell of natural scales."""
    guessed = {GUESSED_SCALES: json_text(model.guessed)} if model.guessed else {}
    return {NATURAL_SCALES: json_text(model.scale), **guessed}


def _first_line(reading: Reading) -> str:
    text = inspect.getdoc(reading.signature.function) or reading.signature.name.replace("_", " ")
    return text.splitlines()[0].rstrip(".")


def _smooth(model: FunctionModel) -> Rule:
    """The exponent is refused where slopes jump, at any end of what is swept or uncertain."""
    key, numbers = "record.exponent", {f"{SECTION}.{name}": name for name in model.reading.signature.parameters}

    def faults(check: Any) -> Iterator[Fault]:
        ends = [dict.fromkeys(check.ends(number)) for number in numbers]
        for values in islice(product(*ends), MOST_CORNERS if check.value(key) else 0):
            if places := model.places_of_jumps(dict(zip(numbers.values(), values, strict=True))):
                yield check.fault(key, f"true with slopes that jump at {places[0]}", f"false, or {SMOOTH}")
                return

    return Rule(faults, (key, *numbers))
