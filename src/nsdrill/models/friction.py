"""The friction laws, each once: the coefficient, with its sign, at a slip, and what a
study gives of it; and whether friction is so steep that it is better integrated
implicitly, from the parameters alone.

With the smoothed direction g(v) = (2/pi) atan(smoothing v) and the four ``numbers`` of
a law (smoothing, decay, rise, dynamic):

    hyperbolic   g [ rise / (1 + decay |v|) + dynamic ]
    linear       g [ rise max(1 - decay |v|, 0) + dynamic ]
    exponential  g [ rise exp(-decay |v|) + dynamic ]
    rational     dynamic tanh(smoothing v) + rise v / (1 + decay v^2)

Sources: hyperbolic in the form of Leine 1998; linear Dawson, Lin & Spanos 1987, SPE
16660; exponential and rational as public codes of drill-string models have them.

A law of a bit gives its torque over its force, an arm [m]. With the arms of friction
(two thirds of the bit's radius) and of the cutting torque, which share g, rise and
dynamic are those of one law. The key ``dynamic_from`` of the linear law is V0, its
decay 1/V0. The rational law is that of the whole torque, b0 [tanh(b1 v) + b2 v / (1 +
b3 v^2)], without the arm of cutting.

Friction of steepness eps brakes a slip at a rate of about (2/pi) eps mu N / m, which
bounds the steps of an explicit method. An implicit step costs about three explicit ones
and is bounded by accuracy alone: measured on stick-slip and on rolling, the two methods
take the same time where that rate is about 3000 1/s. The threshold is twice that, so
that a string with the default smoothing is explicit under usual loads.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import field, fields, replace
from functools import lru_cache, partial
from types import MappingProxyType
from typing import Any, Literal, NamedTuple

import numpy as np

from nsdrill.data import Array
from nsdrill.equations import plain
from nsdrill.equations.graph import Graph, Node, Number, text_of
from nsdrill.equations.library import Law, direction, expm1, slip_factors, tanh
from nsdrill.equations.passes import Tangents
from nsdrill.equations.trace import Inputs, Named, part
from nsdrill.errors import InputError
from nsdrill.models.model_description import Description
from nsdrill.models.operation import Numeric, Values
from nsdrill.models.own import number_rows, section_at, sharing_fault, with_rows, with_words
from nsdrill.models.registry import described, extend_models, model_named, sources_of
from nsdrill.models.rules import Order, Reads
from nsdrill.origin import Origin, check_new_name
from nsdrill.records import dataclass
from nsdrill.variables import MODEL

# The words of the laws, which are those of LAWS in its order.
LawOfBit = Literal["hyperbolic", "linear", "exponential", "rational"]


SHARP = 1e12  # the smoothing of a law of a script that stands for none
TORQUES = ("static_torque", "dynamic_torque")  # in place of the coefficients


class Numbers(NamedTuple):
    """The four numbers of a law, or arrays over operating points."""

    smoothing: Numeric
    decay: Numeric
    rise: Numeric
    dynamic: Numeric

    def columns(self, contact: str) -> dict[str, Numeric]:
        """The lane parameters of a contact with this law."""
        return {f"{contact}_{name}": value for name, value in self._asdict().items()}


def columns_of(contact: str) -> tuple[str, ...]:
    """The names of the lane parameters of a contact with friction."""
    return tuple(f"{contact}_{name}" for name in Numbers._fields)


def numbers_of(p: Named, contact: str, law: KeyedLaw | None = None) -> Named:
    """The numbers of the ``law`` of a contact, among the lane parameters ``p``; without one
    those that every law has."""
    own = {name: getattr(p, lane_of(contact, name)) for name in law.own} if law is not None else {}
    return Named(**{name: getattr(p, f"{contact}_{name}") for name in Numbers._fields}, **own)


def lane_of(contact: str, number: str) -> str:
    """The name of a number of its own of a contact's law among the lane parameters."""
    return f"{contact}_law_{number}"


def own_columns_of(contact: str, law: int) -> tuple[str, ...]:
    """The names of those lane parameters of a contact that only the law with this option
    reads."""
    return tuple(lane_of(contact, name) for name in law_numbered(law).own)


def own_columns(contact: str, section: Any) -> dict[str, Numeric]:
    """The lane parameters of a contact that only the law of its ``section`` reads."""
    return {lane_of(contact, name): value for name, value in own_numbers(section).items()}


def own_numbers(section: Any) -> dict[str, Numeric]:
    """The numbers of a ``section`` of the study that only its law reads, by name."""
    return {name: getattr(section, name) for name in law_named(section.law).own}


def stribeck(section: Any, arm: Numeric = 1.0, cutting: Numeric = 0.0, decay: Numeric | None = None) -> Numbers:
    """The numbers of a law that falls from ``static`` to ``dynamic``, those of a
    ``section`` of the study, times an ``arm``, with what does not fall added."""
    rise, dynamic = arm * (section.static - section.dynamic), arm * section.dynamic + cutting
    return Numbers(section.smoothing, section.decay if decay is None else decay, rise, dynamic)


@dataclass(frozen=True, eq=False)
class KeyedLaw(Law):
    """A law that a study may give the bit: the ``keys`` of its section that it reads,
    with the one that makes it ``steep``; and functions of that section and the arms of
    friction and of cutting [m]: its ``numbers``, and the greatest arm ``at_rest``."""

    keys: tuple[str, ...] = ("static", "dynamic", "smoothing", "decay", *TORQUES)
    steep: str = "smoothing"
    cuts: bool = True
    """Whether the torque of cutting is added to that of the law."""
    own: Mapping[str, Any] = field(default_factory=dict)
    """The numbers that only it reads, of a law of a script."""
    numbers: Callable[[Any, Numeric, Numeric], Numbers] = stribeck
    at_rest: Callable[[Any, Numeric, Numeric], Numeric] = lambda section, arm, cutting: arm * section.static + cutting


# What a number of its own of a law may be measured in: at the wall, and at the bit, whose slip
# is an angle.
SLIP_UNITS = {"": "", "m/s": "rad/s", "s/m": "s/rad", "m^2/s^2": "rad^2/s^2", "s^2/m^2": "s^2/rad^2"}


class ScriptLaw(KeyedLaw):
    """A law of a script, of an ``origin``, of which ``digest`` is that of what it computes,
    with ``own`` numbers: floats with units, range and meaning by name. Its direction is no
    factor of its own."""

    origin: Origin
    digest: str

    def __init__(
        self, function: Callable[..., Any], steepest_fall: Callable[[Any], Any], origin: Origin, own: Mapping[str, Any]
    ) -> None:
        factors, graph = _once(function, tuple(own)), Graph()
        v, numbers = graph.input("v"), Inputs(graph, (*Numbers._fields, *own), "n")
        coefficient = graph.node(factors(v, numbers)[0])
        keys = (*keys_read(graph.inputs_of([coefficient])), *own)
        super().__init__(factors, _product, steepest_fall, keys=keys, own=own)
        object.__setattr__(self, "origin", origin)
        text = text_of({"coefficient": coefficient, "fall": graph.node(steepest_fall(numbers))})
        told = repr([(name, value.told) for name, value in own.items()]) if own else ""
        object.__setattr__(self, "digest", hashlib.sha256((text + told).encode()).hexdigest()[:16])

    @property
    def number(self) -> int:
        """A whole number for what it computes, an option of a model."""
        return len(LAWS) + int(self.digest[:12], 16)


def keys_read(inputs: Collection[str]) -> tuple[str, ...]:
    """The keys of a study that a law reads with these ``inputs`` of its graph."""
    reads = {"static": {"n.rise"}, "dynamic": {"n.rise", "n.dynamic"}, "smoothing": {"n.smoothing"}}
    reads |= {"decay": {"n.decay"}, **{key: {"n.rise", "n.dynamic"} for key in TORQUES}}
    return tuple(key for key, names in reads.items() if names & set(inputs))


def _once(function: Callable[..., Any], own: tuple[str, ...]) -> Callable[[Number, Any], tuple[Any, Any]]:
    return lambda v, numbers: (function(v, numbers, **{name: getattr(numbers, name) for name in own}), 1.0)


def _product(v: Number, factors: tuple[Any, Any], numbers: Any) -> Any:
    return factors[0] * factors[1]


def _hyperbolic(v: Number, numbers: Named) -> tuple[Number, Number]:
    return slip_factors(v, numbers.smoothing, numbers.decay)


@part
def _linear(v: Number, numbers: Named) -> tuple[Number, Number]:
    return direction(numbers.smoothing * v), max(1.0 - numbers.decay * abs(v), 0.0)


def _exponential(v: Number, numbers: Named) -> tuple[Number, Number]:
    return direction(numbers.smoothing * v), 1.0 + expm1(-(numbers.decay * abs(v)))


def _rational(v: Number, numbers: Named) -> tuple[Number, Number]:
    return tanh(numbers.smoothing * v), 1.0 / (1.0 + numbers.decay * v * v)


def _falling(v: Number, factors: tuple[Number, Number], numbers: Named) -> Number:
    direction, weakened = factors
    return direction * (numbers.rise * weakened + numbers.dynamic)


def _humped(v: Number, factors: tuple[Number, Number], numbers: Named) -> Number:
    bounded, weakened = factors
    return numbers.dynamic * bounded + numbers.rise * v * weakened


def _without_hump(numbers: Named) -> Named:
    """The numbers of a hyperbolic law that is like the rational one without its hump."""
    return Named(smoothing=numbers.smoothing, decay=0.0, rise=0.0, dynamic=numbers.dynamic)


def _fall(numbers: Named) -> Number:
    """Without smoothing."""
    return numbers.rise * numbers.decay


hyperbolic = KeyedLaw(_hyperbolic, _falling, _fall)
LAWS = {
    "hyperbolic": hyperbolic,
    "linear": KeyedLaw(
        _linear,
        _falling,
        _fall,
        keys=("static", "dynamic", "smoothing", "dynamic_from", *TORQUES),
        numbers=lambda section, arm, cutting: stribeck(section, arm, cutting, 1 / section.dynamic_from),
    ),
    "exponential": KeyedLaw(_exponential, _falling, _fall),
    "rational": KeyedLaw(
        _rational,
        _humped,
        lambda n: 0.125 * n.rise,
        _without_hump,
        keys=("b0", "b1", "b2", "b3"),
        steep="b1",
        cuts=False,
        numbers=lambda section, arm, cutting: Numbers(section.b1, section.b3, section.b0 * section.b2, section.b0),
        # a bound: the sum of the greatest values of its terms
        at_rest=lambda section, arm, cutting: section.b0 * (1 + section.b2 / (2 * np.sqrt(section.b3))),
    ),
}


# Beside those of nsdrill; by name, and by the option of a model.
_of_scripts: dict[str, ScriptLaw] = {}
_by_number: dict[int, ScriptLaw] = {}
CONTACTS = ("bit.friction", "well.friction", "stabilizer.friction")  # with a law that a study chooses
SERVED = (MODEL, "beam", "torsion")


def laws() -> dict[str, KeyedLaw]:
    """The laws that a script may name: those of nsdrill, then those of scripts."""
    return {**LAWS, **_of_scripts}


def own_laws() -> tuple[str, ...]:
    """The names of the laws of scripts."""
    return tuple(_of_scripts)


def own_law(word: str) -> ScriptLaw | None:
    """The law of a script by this word, None where there is none."""
    return _of_scripts.get(word)


def law_named(word: str) -> KeyedLaw:
    """The law of this word."""
    return LAWS[word] if word in LAWS else _of_scripts[word]


def law_number(word: str) -> int:
    """The option of a model for the law of this word."""
    return list(LAWS).index(word) if word in LAWS else _of_scripts[word].number


def law_numbered(number: int) -> KeyedLaw:
    """The law with this option."""
    return list(LAWS.values())[number] if number < len(LAWS) else _by_number[number]


def law_keys_taken() -> set[str]:
    """The keys of a contact with friction beside the numbers of laws of scripts."""
    own = {name for law in _of_scripts.values() for name in law.own}
    keys = {*Numbers._fields, "law"}
    for contact in CONTACTS:
        section = section_at(described(MODEL).parameters, tuple(contact.split(".")))
        keys |= {item.name for item in fields(section)} - own
    return keys


def register_law(name: str, made: ScriptLaw) -> None:
    """Make a law of a script known to this process, in place of an earlier one of the same
    script. InputError where another has its name, or another number of a name of its own."""
    if (before := _of_scripts.get(name)) is not None:
        check_new_name("a law", name, before.origin, made.origin)
    others = {word: law.own for word, law in _of_scripts.items() if word != name}
    if (fault := sharing_fault(made.own, others)) is not None:
        number, other = fault
        raise InputError(
            f"{made.origin}: the law {name}: found {number} with another unit or range than in the law {other} "
            f"({_of_scripts[other].origin}), and both are one key of a contact; allowed: the same, or another name."
        )
    _of_scripts[name] = _by_number[made.number] = made
    extend_models(SERVED, _with_laws)


def withdraw_laws(*names: str) -> None:
    """Make laws of scripts unknown again; those that are not known are passed over."""
    for name in names:
        _of_scripts.pop(name, None)
    extend_models(SERVED, _with_laws)


def _with_laws(description: Description) -> Description:
    """The description of a model with the laws of scripts among its own."""
    made = with_words(description, [(*contact.split("."), "law") for contact in CONTACTS], tuple(_of_scripts))
    for contact in CONTACTS:
        path, lanes = tuple(contact.split(".")), contact.partition(".")[0].replace("well", "wall")
        section = section_at(made.parameters, path)
        if section is None or "law" not in {item.name for item in fields(section)}:
            continue
        numbers = {word: _at(contact, law.own) for word, law in _of_scripts.items()}
        rows = number_rows("law", numbers, partial(lane_of, lanes))
        made = replace(made, parameters=with_rows(made.parameters, path, rows)) if rows else made
    return made


def _at(contact: str, own: Mapping[str, Any]) -> dict[str, Any]:
    """The numbers of a law at a contact, in its units."""
    return {
        name: value.measured_in(SLIP_UNITS[value.units]) if contact == "bit.friction" else value
        for name, value in own.items()
    }


class ByLaw(dict[str, tuple[str, ...]]):
    """The keys that each law reads, also one of a script."""

    def __missing__(self, word: str) -> tuple[str, ...]:
        return _of_scripts[word].keys


def reads_at(contact: str, torques: bool = False) -> Reads:
    """The keys that each law reads at a contact, also those for given ``torques``."""
    known = {word: tuple(key for key in law.keys if torques or key not in TORQUES) for word, law in LAWS.items()}
    return Reads(f"{contact}.law", "the law", "the law", ByLaw(known))


def ordered_at(contact: str) -> Order:
    """Dynamic friction is at most static friction, where the law of a contact reads both."""
    static, dynamic = f"{contact}.static", f"{contact}.dynamic"
    return Order(dynamic, static, True, "lower", unless=lambda check: not reads_static(check.value(f"{contact}.law")))


def reads_static(word: str) -> bool:
    """Whether a law reads the static coefficient."""
    return word not in _of_scripts or "static" in _of_scripts[word].keys


def laws_that_read(key: str) -> str:
    """In words which laws read a key of the bit's friction, "" where all do."""
    words = [word for word, law in LAWS.items() if key in law.keys]
    others = [word for word in LAWS if word not in words]
    if not others:
        return ""
    if len(others) == 1:
        return f"all laws but {others[0]}"
    *several, last = words
    return f"laws {', '.join(several)} and {last}" if several else f"law {last}"


def rate_at_rest(section: Any, normal: Numeric, per_mass: Numeric) -> Numeric:
    """The rate [1/s] at which friction of a ``section`` at rest decelerates a slip: (2/pi)
    eps mu N over the mass, or with the slope at rest of a law of a script."""
    if (own := own_law(section.law)) is not None:
        return values(own, "slope", 0.0, stribeck(section), own_numbers(section)) * normal * per_mass
    return 2 / math.pi * section.smoothing * section.static * normal * per_mass


@lru_cache
def _graph_of(law: KeyedLaw) -> tuple[Node, Named, tuple[Node, Node], dict[str, Node]]:
    """(slip, numbers, factors, values): the law as a graph, with its ``slope``, and
    ``unsmoothed``, as it is at positive slips without smoothing, with the ``fall`` of
    that. A law whose steep key is another one than the smoothing has none."""
    graph = Graph(with_slopes=True)
    v, numbers = graph.input("v"), Inputs(graph, (*Numbers._fields, *law.own), "n")
    factors = law.factors(v, numbers)
    values = {"coefficient": law.coefficient(v, factors, numbers)}
    if isinstance(law, ScriptLaw):
        sharp = {numbers.smoothing: graph.node(SHARP)}
        (values["unsmoothed"],) = graph.substituted([values["coefficient"]], sharp, {})
    else:
        direction = graph.node(1.0) if law.steep == "smoothing" else factors[0]
        values["unsmoothed"] = law.coefficient(v, (direction, factors[1]), numbers)
    changes = Tangents(graph, {v: 1.0}).of(values)
    values |= {"slope": changes["coefficient"], "fall": -changes["unsmoothed"]}
    return v, numbers, factors, values


def values(
    law: KeyedLaw, which: str, v: Numeric, numbers: Numbers, own: Mapping[str, Numeric] = MappingProxyType({})
) -> Numeric:
    """The ``coefficient`` of a law at slips, its ``slope``, the ``unsmoothed``
    coefficient at positive slips or its ``fall``, on numbers or arrays; ``own`` are the
    numbers that only it reads."""
    given = {"v": v} | {f"n.{name}": n for name, n in {**numbers._asdict(), **own}.items()}
    return plain.values({"": _graph_of(law)[3][which]}, given)[""]


def per_flat(direction: Node, unit: Node) -> Node:
    """1 / ``unit``, that is 1 / (1 + (smoothing slip)^2), where the slope of a law with
    this ``direction`` reads it."""
    function, _ = direction.extra
    if function.results > 1:  # it comes with the direction
        return direction.graph.make("result", *direction.args, extra=(function, 2))
    return 1.0 / unit


STEEP = 6000.0  # 1/s
# in the order of the values of the variable ``method``
METHODS: tuple[Literal["explicit", "implicit"], ...] = ("explicit", "implicit")


def friction_rates(model: Description, points: Values) -> Mapping[str, Numeric]:
    """The rate at which friction at its steepest brakes a slip [1/s], by the key that makes it
    steep: what the description of the model says, else what follows from its equations."""
    return (model.friction_rates or model_named(model.name).friction_rates)(points)


def why_explicit(model: Description, parameters: Any) -> str | None:
    """Why friction with these parameters cannot be integrated implicitly, None where it can:
    what the description of the model says, else what follows from its equations."""
    if model.explicit_only is not None:
        return model.explicit_only(parameters)
    if model.friction_rates is not None:
        return None
    computed = model_named(model.name)
    return computed.consequences(computed.options_of(parameters)).why_explicit


def implicit(method: str, model: Description, points: Values) -> Array:
    """Whether each point is integrated implicitly, shape (n,) or (), by a study's
    ``method``. False for every method where the model supports only the explicit
    one."""
    if method == "explicit" or why_explicit(model, points.parameters) is not None:
        return np.zeros(np.broadcast_shapes(*map(np.shape, points.operation)), dtype=bool)
    rates = [np.asarray(rate, dtype=float) for rate in friction_rates(model, points).values()]
    rate = np.broadcast_arrays(np.max(np.broadcast_arrays(0.0, *rates), axis=0), *points.operation)[0]
    return np.full(rate.shape, True) if method == "implicit" else rate > STEEP


# Natural scales of a slip times the tolerance, over the width of friction at rest: from 10^-4
# on, with 150 and 500 s/rad, the exponent of a cycle of a string of segments was found 0.005 to
# 0.04 1/s too low, up to 3 10^-5, with 50 to 500 s/rad, 0.001 1/s. From 10^-3 on that of an
# oscillator whose slip changes its sign without sticking was found too near that without
# friction, by 2 % and more.
MOST_INEXACT = 6e-5


def tolerance_of_exponent(rtol: float, steepest: float) -> float | None:
    """The tolerance with which implicit steps follow a deviation through friction whose
    smoothing times the natural scale of its slip is ``steepest``; None where ``rtol`` is
    small enough."""
    if rtol * steepest <= MOST_INEXACT:
        return None
    enough: float = 10.0 ** math.floor(math.log10(MOST_INEXACT / steepest))
    return enough


def advice(method: str, model: Description, points: Values) -> str:
    """The advice about runs that reach the limit of their steps: a sentence without its
    full stop."""
    rates = {key: float(np.max(rate)) for key, rate in friction_rates(model, points).items()}
    key, rate = max(rates.items(), key=lambda item: item[1], default=("", 0.0))
    if sources_of(model.name):
        return (
            f"raise simulation.max_steps, unless the equations of {model.name} jump where the motion stays, as a hard "
            "sign of a velocity does, or have a pole: there no number of steps is enough"
        )
    if rate <= STEEP or method == "implicit":
        return "raise simulation.max_steps"
    cause = f"the friction of {key} brakes the slip at up to {rate:.3g} 1/s, which bounds the length of explicit steps"
    if (reason := why_explicit(model, points.parameters)) is not None:
        return f"{cause}; it cannot be integrated implicitly, as {reason}: lower {key}, or raise simulation.max_steps"
    if method == "auto":  # it takes implicit steps there already
        return "raise simulation.max_steps"
    return f"{cause}; set simulation.method: auto, or raise simulation.max_steps"
