"""What a script says of its model beside the function: critical responses, each of a
feature and a threshold, and orders of its numbers."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from nsdrill.models.model_description import Description
from nsdrill.models.responses import Response
from nsdrill.models.rules import Order
from nsdrill.script.reading import Reading
from nsdrill.script.signature import NAME_FORM, Signature, is_name
from nsdrill.study.keys import did_you_mean
from nsdrill.units import QuantityError, plain_units, to_si
from nsdrill.variables import Variable

ORDER = re.compile(r"\s*(\w+)\s*(<=|<)\s*(?:([0-9.]+(?:[eE][-+]?[0-9]+)?)\s*\*\s*)?(\w+)\s*")
COLOUR = re.compile(r"#[0-9A-Fa-f]{6}")
MARKERS = "^sDPXvp*<>hd"  # of matplotlib, filled; a run without a response has the round one
WORDS = ("words", "letter", "verb", "limit", "measured", "absent")  # of a response
FORM = "responses={'sticking': ('slider_stuck_fraction', 0.01)}: a name, with a feature and the threshold of it"


def response_of(
    read: Signature,
    name: str,
    feature: str,
    threshold: float | str,
    limits: Mapping[str, float | str],
    looks: Mapping[str, str],
) -> Response:
    """A critical response as a script declares it, its numbers as they were written;
    ``looks`` are its words, letter, colour and marker. InputError where it cannot be one."""

    def refuse(found: str, allowed: str) -> None:
        read.refuse(f"the response {name!r} with {found}", allowed)

    if not is_name(name):
        read.refuse(f"the response {name!r}", f"{FORM}; the name of {NAME_FORM}")
    if not isinstance(feature, str):
        refuse(f"the feature {feature!r}", "the name of a feature, as 'x_max'")
    if not isinstance(limits, Mapping) or not all(map(is_name, limits)):
        refuse(
            f"limits={limits!r:.60}", f"words with their lower bounds, as {{'mild': 0.6, 'hard': 1.0}}; of {NAME_FORM}"
        )
    if len(limits) > 4 or feature in limits:
        refuse(f"the limits {', '.join(limits)}", "up to four words, none of them the feature")
    if not all(isinstance(value, str) for value in looks.values()):
        refuse(f"{looks!r:.80}", "words, letter, colour and marker as texts")
    if looks["colour"] and not COLOUR.fullmatch(looks["colour"]):
        refuse(f"colour={looks['colour']!r}", "six hexadecimal digits after #, as '#AA3377'")
    if looks["marker"] and (looks["marker"] not in MARKERS or len(looks["marker"]) > 1):
        refuse(f"marker={looks['marker']!r}", f"one of {' '.join(MARKERS)}")
    if looks["letter"] and not re.fullmatch("[A-Z]", looks["letter"]):
        refuse(f"letter={looks['letter']!r}", "one capital letter")
    return Response(name, feature=feature, threshold=threshold, limits=dict(limits), **looks)  # type: ignore[arg-type]


def with_numbers(read: Signature, declared: Response, features: Mapping[str, Variable]) -> Response:
    """A response with its numbers in SI, which its feature has. InputError where that is no
    feature of the model, or a number none of its units and range."""
    if declared.feature not in features:
        hint = did_you_mean(declared.feature, features)
        read.refuse(
            f"the response {declared.name} of {declared.feature}, which is no feature of it",
            f"{', '.join(features)}. One of @{read.name}.feature is known below it: there write "
            f"{read.name}.response(...){f'. {hint}' if hint else ''}",
        )
    variable = features[declared.feature]

    def number(value: Any) -> float:
        units = plain_units(variable.units).removeprefix("1")
        try:
            if isinstance(value, str):
                value = to_si(value, units or "1")
            found = float(value) if not isinstance(value, bool) else float("nan")
        except (QuantityError, TypeError, ValueError):
            found = float("nan")
        low, high = variable.bounds
        if not low <= found <= high:
            read.refuse(
                f"the response {declared.name} with {declared.feature} above {value!r:.40}",
                f"a number {f'[{units}] ' if units else ''}from {low:g} to {high:g}"
                f"{', or a text with a unit' if units else ''}",
            )
        return found

    threshold = number(declared.threshold)
    limits = {word: number(value) for word, value in declared.limits.items()}
    mildest = min(limits.values(), default=threshold)
    if mildest > threshold:
        read.refuse(
            f"the response {declared.name} above {threshold:g}, whose mildest limit is {mildest:g}, so that what is "
            "between them has no severity",
            "a first limit that is the threshold or below it",
        )
    return replace(declared, threshold=threshold, limits=limits)


def check_threshold(reading: Reading, declared: Response) -> None:
    """InputError where every motion has the response: the greatest velocity of a position
    that stays within bounds is not negative."""
    within = [
        velocity
        for position, velocity in reading.pairs.items()
        if position not in {*reading.angles, *reading.unread, *reading.frames}
    ]
    threshold = declared.threshold
    if threshold is not None and threshold < 0.0 and declared.feature in {f"{name}_max" for name in within}:
        reading.signature.refuse(
            f"the response {declared.name} with {declared.feature} above {threshold:g}, as every motion has",
            f"a threshold of 0 or more, as {declared.feature} is the greatest velocity of what moves to and fro",
        )


def check_again(read: Signature, before: Response, again: Response) -> None:
    """InputError where a response is declared a second time with another feature or other
    numbers; other words and signs may replace the first."""
    if (before.feature, before.threshold, before.limits) != (again.feature, again.threshold, again.limits):
        read.refuse(
            f"a second response {again.name}, of {again.feature} above {again.threshold:g}, beside that of "
            f"{before.feature} above {before.threshold:g}",
            f"another name for it; a study moves a threshold by classify.{before.name}.{before.feature}",
        )


def orders_of(reading: Reading, section: str, texts: Sequence[str]) -> tuple[Order, ...]:
    """Orders of parameters as a script writes them, ``"dynamic <= static"`` or ``"a < 2 *
    b"``. InputError where one is none, or the defaults are against it."""
    read = reading.signature
    if isinstance(texts, str) or not all(isinstance(text, str) for text in texts):
        read.refuse(f"orders={texts!r:.80}", "a tuple of texts, as orders=('dynamic <= static',)")
    found = []
    for text in texts:
        match = ORDER.fullmatch(text)
        if match is None:
            read.refuse(
                f"the order {text!r}",
                "two parameters, as 'dynamic <= static', 'low < high' or 'low < 2 * high'; a bound that is a number is "
                "low= or high= of nsdrill.number",
            )
        lower, sign, factor, upper = match.groups()
        for name in (lower, upper):
            if name not in read.parameters:
                read.refuse(f"the order {text!r} of {name}, which is no parameter", ", ".join(read.parameters))
        small, large = read.parameters[lower], read.parameters[upper]
        if lower == upper:
            read.refuse(f"the order {text!r} of {lower} with itself", "two parameters")
        if small.units != large.units:
            units = f"{small.units or 'no unit'} and {large.units or 'no unit'}"
            read.refuse(f"the order {text!r} of {units}", "two parameters with the same unit")
        times = float(factor or 1.0)
        if not (small < times * large or (sign == "<=" and small == times * large)):
            told = f"{lower} = {float(small):g} and {upper} = {float(large):g}"
            read.refuse(f"defaults against the order {text!r}, {told}", "defaults in this order")
        found.append(Order(f"{section}.{lower}", f"{section}.{upper}", equal=sign == "<=", factor=times))
    return tuple(found)


def check_responses(read: Signature, description: Description, responses: Sequence[Response]) -> None:
    """InputError where a name of a response or of its severity is another's, or a letter
    or a colour is there twice."""
    taken = {*read.start, *read.parameters, *(one.name for one in description.features)}
    critical = [description.critical[one.name] for one in responses]
    for one in critical:
        for name in (one.name, *((one.severity.name,) if one.severity else ())):
            if name in taken:
                read.refuse(
                    f"the name {name} of a response, which a state, a parameter or a feature has", "another name"
                )
    for what in ("name", "letter", "colour", "marker"):
        values = [getattr(one, what) for one in critical]
        if twice := [value for k, value in enumerate(values) if value in values[:k]]:
            read.refuse(f"two responses with the {what} {twice[0]}", "each once")


def parts_with(reading: Reading, responses: Sequence[Response], orders: Iterable[str]) -> dict[str, str]:
    """Digests of the same part by part, by the words of each, so that what differs in a
    changed script can be named."""
    told = dict(reading.told_by_part)
    read = reading.signature
    meanings = {f"the number {name}": one.meaning for name, one in (*read.start.items(), *read.parameters.items())}
    meanings |= {f"the feature {one.name}": one.about.meaning for one in reading.quantities}
    told = {part: f"{text} {meanings.get(part) or ''}" for part, text in told.items()}
    for place, one in enumerate(responses):
        decides = (place, one.feature, one.threshold, *one.limits.items(), *(getattr(one, name) for name in WORDS))
        told[f"the response {one.name}"] = repr(decides)
    if order := tuple(orders):
        told["the order of its numbers"] = repr(order)
    return {part: hashlib.sha256(text.encode()).hexdigest()[:8] for part, text in told.items()}


def digest_with(reading: Reading, responses: Iterable[Response], orders: Iterable[str]) -> str:
    """Digest of what is computed, with what decides on labels and samples, and with the words
    by which labels and numbers are told: in other words they say another thing."""
    told = [
        (one.name, one.feature, one.threshold, *one.limits.items(), *(getattr(one, name) for name in WORDS))
        for one in responses
    ]
    read = reading.signature
    numbers = {**read.start, **read.parameters, **{one.name: one.about for one in reading.quantities}}
    meanings = [(name, one.meaning) for name, one in numbers.items() if one.meaning]
    order = tuple(orders)
    if not told and not order and not meanings:
        return reading.digest
    return hashlib.sha256(repr((reading.digest, told, order, meanings)).encode()).hexdigest()[:16]
