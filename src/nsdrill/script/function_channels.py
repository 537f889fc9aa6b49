"""What is observed of the model of a function: each state, the gap of each unilateral
contact, the slip of each contact with friction, and the angle of the forcing."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from nsdrill.data import Array
from nsdrill.equations import plain
from nsdrill.models.own_quantities import on_rows, quantity_channel
from nsdrill.observe.channels import (
    Channel,
    Declaration,
    Derived,
    Extremes,
    Feature,
    Mean,
    MeanAbove,
    Names,
    Section,
    Stepped,
    TimeAbove,
)
from nsdrill.script.angles import REVOLUTION
from nsdrill.script.clock import CLOCK
from nsdrill.script.driving import WORDS
from nsdrill.script.reading import Reading
from nsdrill.variables import CREEP, DRIVING, STEPPED

# Lane parameters and rows of a model beside its own numbers: two underscores are in no name
# that a function may have.
RATE, FRAME, STUCK, SLIPPING, SIZE = "{}__rate", "{}__frame", "{}__stuck", "{}__slipping", "{}__size"
# The natural scale of a slip, the mean of its square, and that but for the time in which it is stuck
SLIP, SQUARE, SLID = "{}__slip", "{}__square", "{}__slid"
INSIDE = "{}__inside"  # the fraction of time for which a contact is closed within single steps
AT_REST = 0.01  # of its natural scale, by which a contact that is stuck may slip
ENDS = {"max": "greatest", "min": "least", "mean": "mean"}  # of each state, with words


def names_of(reading: Reading) -> Names:
    """The rows of the model."""
    columns = (*reading.signature.parameters, CLOCK)
    frames, stuck = (
        map(FRAME.format, reading.frames),
        [one.format(name) for name in reading.rubs for one in (STUCK, SLIP)],
    )
    sizes = [SIZE.format(one.name) for one in reading.quantities]
    return Names(reading.states, tuple(map(RATE.format, reading.moved)), (*columns, *frames, *stuck, *sizes))


def declaration_of(reading: Reading) -> Declaration:
    """Greatest, least and mean value with last maxima of each state, the fraction of time
    in which each contact is closed, stuck or driving, what the script measures besides, and a
    section once a revolution of the forcing."""
    channels = [*_states(reading), *_contacts(reading), *_driving(reading), *_quantities(reading)]
    features: list[Feature] = []
    for name in reading.states:
        features += [_extremes(reading, name), Mean(name, f"{name}_mean")]
    for name in reading.gaps:
        closed, inside = f"{name}_contact_fraction", INSIDE.format(name)
        features += [TimeAbove(_gap(name), closed), Stepped(_gap(name), inside)]
        features.append(Derived(STEPPED.format(name), _part(inside, closed)))
    for name in reading.rubs:
        features += [
            TimeAbove(_slip(name), SLIPPING.format(name)),
            Derived(f"{name}_stuck_fraction", _rest(SLIPPING.format(name))),
            Mean(_slip(name), SQUARE.format(name)),
            MeanAbove(_slip(name), SLIPPING.format(name), SLID.format(name)),
            Derived(CREEP.format(name), _share(SQUARE.format(name), SLID.format(name), SLIP.format(name))),
        ]
    features += [Mean(_drive(name), DRIVING.format(name)) for name in reading.driving]
    features += [part for one in reading.quantities for part in one.measures]
    if reading.forcing is None:
        return Declaration(tuple(channels), tuple(features))
    channels.append(Channel("forcing", _angle, CLOCK, 0.0))
    return Declaration(tuple(channels), tuple(features), section=Section("forcing", 2.0 * math.pi))


def _extremes(reading: Reading, name: str) -> Extremes:
    """Of a state that nothing reads they say nothing of whether a motion has settled, and of
    an angle only where it does not turn."""
    made = Extremes(name, greatest=f"{name}_max", least=f"{name}_min", peaks=f"{name}_peaks")
    if name in reading.unread:
        return replace(made, compared=None)
    return replace(made, revolution=REVOLUTION) if name in reading.angles else made


def fractions(reading: Reading) -> dict[str, str]:
    """The features that are fractions of time, with their words."""
    closed = {f"{name}_contact_fraction": f"fraction of time in which {name} is closed" for name in reading.gaps}
    return closed | {f"{name}_stuck_fraction": f"fraction of time in which {name} is stuck" for name in reading.rubs}


def driving_words(reading: Reading) -> dict[str, str]:
    """The features that tell how long a contact with friction drives, with their words."""
    found = {}
    for name, (_, numbers) in reading.driving.items():
        below = " or ".join(WORDS[what].removeprefix("a ") for what in numbers)
        found[DRIVING.format(name)] = f"fraction of time in which {below} of {name} is below 0"
    return found


def stepped_words(reading: Reading) -> dict[str, str]:
    """The features that tell which part of the time of a contact lies within single steps, with their words."""
    words = "share of the time in which {} is closed that lies within single steps, which may have jumped over it"
    return {STEPPED.format(name): words.format(name) for name in reading.gaps}


def creep_words(reading: Reading) -> dict[str, str]:
    """The features that tell which part of the slip of a contact counts as stuck, with their words."""
    words = "share of the mean square slip of {} that counts as stuck; 0 of less than a hundredth of its natural scale"
    return {CREEP.format(name): words.format(name) for name in reading.rubs}


def _drive(name: str) -> str:
    return f"driving of {name}"


def _gap(name: str) -> str:
    return f"gap of {name}"


def _slip(name: str) -> str:
    return f"slip of {name}"


def _states(reading: Reading) -> list[Channel]:
    channels = []
    for x, v in reading.pairs.items():
        frame = FRAME.format(x) if x in reading.frames else None
        channels.append(Channel(x, x, v, RATE.format(v), frame=frame))
        channels.append(Channel(v, v, RATE.format(v), rate_of=x))
    return channels + [Channel(name, name, RATE.format(name)) for name in reading.singles]


def _contacts(reading: Reading) -> list[Channel]:
    rates = rates_of(reading)
    channels = []
    for name, gap in reading.gaps.items():
        value, rate = plain.followed_node(on_rows(gap), rates)
        watched = plain.followed_within(on_rows(gap), rates)
        channels.append(Channel(_gap(name), value, rate, level=0.0, watched=watched))
    for name, contact in reading.rubs.items():
        slip = on_rows(reading.graph.node(contact.slips[0]))
        value, rate = plain.followed_node(slip * slip, rates)
        channels.append(Channel(_slip(name), value, rate, level=STUCK.format(name), squared=True))
    return channels


def _driving(reading: Reading) -> list[Channel]:
    rates = rates_of(reading)
    return [quantity_channel(_drive(name), node, rates, 1.0) for name, (node, _) in reading.driving.items()]


def _quantities(reading: Reading) -> list[Channel]:
    rates = rates_of(reading)
    named = [(one.name, node) for one, node in reading.quantities.items()]
    return [quantity_channel(name, node, rates, SIZE.format(name)) for name, node in named]


def rates_of(reading: Reading) -> Callable[[plain.Rows], Mapping[str, Any]]:
    """How fast the rows of the model change."""

    def rates(rows: plain.Rows) -> dict[str, Any]:
        found: dict[str, Any] = {"time": 1.0}
        for x, v in reading.pairs.items():
            velocity = getattr(rows, v)
            found[x] = velocity - getattr(rows, FRAME.format(x)) if x in reading.frames else velocity
        constant = dict.fromkeys((*reading.signature.parameters, CLOCK, "phase"), 0.0)
        return found | {name: getattr(rows, RATE.format(name)) for name in reading.moved} | constant

    return rates


def _angle(phase, time, clock):  # type: ignore[no-untyped-def]
    return phase + clock * time


def _rest(name: str) -> Callable[[Array], Array]:
    """What is left to 1 of the feature of this name."""

    def rest(fraction: Array) -> Array:
        return 1.0 - fraction

    reads = inspect.Parameter(name, inspect.Parameter.POSITIONAL_OR_KEYWORD)
    rest.__signature__ = inspect.Signature([reads])  # type: ignore[attr-defined]
    return rest


def _share(square: str, slid: str, scale: str) -> Callable[[Array, Array, Array], Array]:
    """The part of the mean ``square`` of a slip beside what it has while it slides, 0 of one that rests."""

    def share(square: Array, slid: Array, scale: Array) -> Array:
        creep = np.where(square > (AT_REST * scale) ** 2, square - slid, 0.0)
        return np.clip(np.divide(creep, square, out=np.zeros_like(square), where=creep > 0.0), 0.0, 1.0)

    reads = [inspect.Parameter(name, inspect.Parameter.POSITIONAL_OR_KEYWORD) for name in (square, slid, scale)]
    share.__signature__ = inspect.Signature(reads)  # type: ignore[attr-defined]
    return share


def _part(inside: str, closed: str) -> Callable[[Array, Array], Array]:
    """The part of the time of a contact that lies ``inside`` steps, of which some does not count as ``closed``."""

    def part(inside: Array, closed: Array) -> Array:
        whole = np.maximum(inside, closed)
        return np.divide(inside, whole, out=np.zeros_like(whole), where=whole > 0.0)

    reads = [inspect.Parameter(name, inspect.Parameter.POSITIONAL_OR_KEYWORD) for name in (inside, closed)]
    part.__signature__ = inspect.Signature(reads)  # type: ignore[attr-defined]
    return part
