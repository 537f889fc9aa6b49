"""Declarations of what is observed of a model: channels, which are followed inside each
step, and features of them.

From a declaration an observer is made for any number of lanes
(:mod:`nsdrill.observe.declared`). The two halves of the observation are measured
separately. The observer's outcome of a run, in its columns of the outbox, becomes
feature arrays in plain numpy (:mod:`nsdrill.observe.findings`).

A *row* is a name among those of the model (:class:`Names`) and its outputs; ``time``
[s] and ``phase`` [rad], the angle that advances at a constant rate, are rows too. An
*expression* is the name of a row, a number, or a scalar function whose argument names
are the rows that it reads. Such a function must not branch but select, and may call
arithmetic, ``np.sqrt``, ``np.floor`` and the functions of :mod:`nsdrill.elementary`, as
a right-hand side may.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Collection, Iterable
from dataclasses import replace
from functools import cached_property
from typing import Any, TypeVar

import numpy as np

from nsdrill.records import dataclass
from nsdrill.variables import Variable

Expression = str | float | Callable[..., object]
NATURAL = "natural"  # the scale of a channel itself
ALWAYS = ("time", "phase")  # rows of every model
HALF_DIFFERENCE = "half_difference"  # reserved: no feature may have this name
LEAST_CYCLES = 3  # of which a period is the mean


@dataclass(frozen=True)
class Names:
    """The names of a model's rows in their order: own states, their slopes, parameters
    and auxiliary outputs."""

    states: tuple[str, ...]
    slopes: tuple[str, ...]
    parameters: tuple[str, ...] = ()
    aux: tuple[str, ...] = ()

    @property
    def first_order(self) -> int:
        """How many states of first order follow the pairs: there is a slope for each pair and
        for each of these."""
        return 2 * len(self.slopes) - len(self.states)

    @property
    def moved(self) -> tuple[str, ...]:
        """The states of which equations give the slopes: velocities, then those of first
        order."""
        return moved(self.states, self.first_order)


def moved(states: tuple[str, ...], singles: int) -> tuple[str, ...]:
    """The velocities of the pairs, then the last states, so many ``singles`` of first
    order."""
    pairs = len(states) - singles
    return (*states[1:pairs:2], *states[pairs:])


@dataclass(frozen=True)
class Channel:
    """A quantity that is followed inside each step by the Hermite polynomial through
    its value, slope and, if there is one, curvature at both ends: of fifth degree, else
    of third.

    ``frame`` names a parameter that is subtracted from the slope: the slope of a twist
    is the bit speed minus the drive speed. ``rate_of`` names a channel with a
    curvature: this one is then followed by the slope of that channel's polynomial, plus
    its frame. ``level`` is a parameter or a number. ``scale``, the name of a state or
    of a parameter or a number, is the natural scale of the quantity; by default that of
    the state which is the channel's value.

    A ``squared`` channel is the square of the quantity, such as of a radius, which is
    not smooth at zero while its square is. Levels, scale, extremes and peaks are those
    of the quantity itself.

    ``inside`` is for a quantity that no polynomial follows, as it changes within a part
    of a step: a function of the channels ``of`` and of parameters. It takes the value
    and the slope of each of these channels, in order, then parameters by their names,
    and returns its own value and slope; before a kink the slope after it. Only
    ``Extremes`` with ``maxima`` may use it, without peaks.

    ``within`` is for a quantity that may bend and jump within a step: a function of rows,
    as the value, that returns the value, its slope, and what is watched
    (:func:`nsdrill.equations.plain.followed_within`). It is evaluated on the continuous
    solution, not only at the ends of the step (:mod:`nsdrill.observe.within`). Only
    ``Mean``, ``Outrun`` and ``Extremes`` of every value, without peaks, may use it.

    ``watched`` is the same function of a quantity whose polynomial does for all else: with it
    ``Stepped`` looks at the continuous solution.
    """

    name: str
    value: Expression
    slope: Expression
    curvature: Expression | None = None
    frame: str | None = None
    rate_of: str | None = None
    level: str | float | None = None
    scale: str | float | None = None
    squared: bool = False
    of: tuple[str, ...] = ()
    inside: Callable[..., object] | None = None
    within: Callable[..., Any] | None = None
    watched: Callable[..., Any] | None = None


@dataclass(frozen=True)
class Outputs:
    """Quantities computed once per step, at its end, and stored for the start of the
    next: rows like the states. Only ``function``, and ``unless`` of
    :class:`Extremes`, may read auxiliary outputs. It returns a tuple of one number for
    each of the names."""

    names: tuple[str, ...]
    function: Callable[..., object]


@dataclass(frozen=True)
class Extremes:
    """The greatest and the least value during the observation, and the last local
    maxima. Only those with a name become features. A maximum counts if its prominence
    is at least ten tolerances.

    ``slip``, a parameter or a number, is for the speed of a bit that may stick: once it
    has been at or below the channel's level, only the greatest maximum between two such
    instants counts, and only if it is above ``slip``.

    A ``smooth`` quantity has its extremes where its slope changes sign, and at the ends
    of the observation, so the ends of steps need not be compared, which is faster. With
    ``maxima`` least values are not looked for, and every maximum is a peak.

    ``unless`` holds two expressions, of which the first may be None: where they are
    positive at the start and at the end of a step, the polynomial does not follow the
    quantity, and is not looked at inside that step. The second one may read auxiliary
    outputs.

    ``compared`` is the scale by which the extremes of the two halves of the observation
    are compared: a parameter, a number or a function of parameters, plain numpy; None
    for not at all. Of an angle they are not where it has gone further than ``revolution``
    [rad]: it turns."""

    channel: str
    greatest: str | None = None
    least: str | None = None
    peaks: str | None = None
    slip: str | float | None = None
    smooth: bool = False
    maxima: bool = False
    unless: tuple[Expression | None, Expression] | None = None
    compared: str | float | Callable[..., Any] | None = NATURAL
    revolution: float | None = None

    @property
    def ends(self) -> tuple[str, ...]:
        """The extremes that are measured."""
        return ("greatest",) if self.maxima else ("least", "greatest")


@dataclass(frozen=True)
class TimeAbove:
    """The fraction of the observation time in which the channel is above its level, or
    above another ``level``. Excursions inside one step count."""

    channel: str
    name: str = ""
    level: str | float | None = None


@dataclass(frozen=True)
class Mean:
    """The mean over the observation, exact for the interpolant. With ``compared``, a
    scale, the means of the two halves are compared too."""

    channel: str
    name: str = ""
    compared: str | float | None = None


@dataclass(frozen=True)
class MeanAbove:
    """The mean over the observation of the channel, counted as zero except while that
    of the ``TimeAbove`` of the name ``above`` is above its level. Steps in which it
    crosses the level are divided there, and the channel then follows its values and
    slopes."""

    channel: str
    above: str
    name: str


@dataclass(frozen=True)
class RmsOfSlopes:
    """The root mean square over the observation of a vector, the slopes of these
    channels, such as an acceleration, whose own slope is not known: by Simpson's rule,
    with the middle of the step from the values of the channels."""

    channels: tuple[str, ...]
    name: str = ""


@dataclass(frozen=True)
class Passages:
    """How often per second [1/s] the channel rises above its level. Excursions inside
    one step count only if the time above the level is measured too."""

    channel: str
    name: str = ""


@dataclass(frozen=True)
class Outrun:
    """How far per second a channel ``within`` steps goes, by its slopes and values at the
    places where it is evaluated; with ``beyond`` that part of it in which cubics do not
    follow it, however near these are. It is nothing of what they resolve, and of kinks and
    jumps, and half and more of the whole of what oscillates between them, or has a pole: there
    extremes and means are those of samples. Both are NaN or infinite of what is no number
    somewhere."""

    channel: str
    name: str
    beyond: bool = False


@dataclass(frozen=True)
class Stepped:
    """The fraction of the observation time in which the channel, one that is ``watched``, is
    above its level between two ends of one step, at which it is below: what the steps may
    have jumped over. The channel must have ``TimeAbove``."""

    channel: str
    name: str = ""


@dataclass(frozen=True)
class Period:
    """The mean time [s] between two rises of the channel above the middle of its range,
    each after a fall below the lower quarter; NaN where fewer than
    :data:`LEAST_CYCLES` are counted. The range is that from the beginning of the
    observation on; where it grows by more than a twentieth, counting begins again. A
    swing of less than the natural scale is not counted. The channel must have
    ``Extremes``, with minima."""

    channel: str
    name: str = ""


@dataclass(frozen=True)
class Winding:
    """The mean speed [rad/s] at which the vector of the channels ``x`` and ``y``
    rotates, from the angles between its values at the ends of the steps. In a step it
    rotates by less than half a revolution. ``counted``: half revolutions are counted
    instead, where y changes its sign, which is faster and differs by rounding only."""

    x: str
    y: str
    name: str = ""
    counted: bool = False


@dataclass(frozen=True)
class Derived:
    """A feature computed from other features and from parameters, whose names are the
    arguments of ``function``: plain numpy over arrays [runs]. It may read a ``Derived``
    that precedes it."""

    name: str
    function: Callable[..., Any]


@dataclass(frozen=True)
class Section:
    """A Poincare section: all states whenever the channel, an angle, first reaches the
    next multiple of ``spacing``, a parameter or a positive number [rad], or of a part of
    it: the observer's store says into how many parts it is divided. An angle that
    reverses and reaches it again is not counted twice."""

    channel: str
    spacing: str | float


Feature = (
    Extremes | TimeAbove | Mean | MeanAbove | RmsOfSlopes | Passages | Outrun | Stepped | Period | Winding | Derived
)
# What is measured for the features of a kind, in the order of the observer's rows.
MEASURES: dict[type[Any], str] = {
    TimeAbove: "above",
    Mean: "integral",
    MeanAbove: "part",
    RmsOfSlopes: "slopes",
    Passages: "passages",
    Outrun: "outrun",
    Stepped: "stepped",
    Period: "cycle_time",
    Winding: "angle",
}
T = TypeVar("T", Extremes, TimeAbove, Mean, MeanAbove, RmsOfSlopes, Passages, Outrun, Stepped, Period, Winding, Derived)


@dataclass(frozen=True)
class Declaration:
    """What is observed of a model."""

    channels: tuple[Channel, ...]
    features: tuple[Feature, ...]
    outputs: Outputs | None = None
    section: Section | None = None

    def of_kind(self, kind: type[T]) -> list[T]:
        """The features of type ``kind``, in order."""
        return [feature for feature in self.features if isinstance(feature, kind)]

    @cached_property
    def extremes(self) -> dict[str, Extremes]:
        """The first ``Extremes`` of each channel, which says how they are looked for."""
        found: dict[str, Extremes] = {}
        for extremes in self.of_kind(Extremes):
            found.setdefault(extremes.channel, extremes)
        return found

    @cached_property
    def channels_with_peaks(self) -> list[str]:
        """The channels whose peaks are recorded."""
        return list(dict.fromkeys(feature.channel for feature in self.of_kind(Extremes) if feature.peaks))

    @cached_property
    def measured_per_half(self) -> list[tuple[str, str]]:
        """What is measured in each half of the observation: (what, name of the
        channel); for what has a level or several channels, the name of the feature."""
        ends = [(end, name) for name, extremes in self.extremes.items() for end in extremes.ends]
        measures = dict.fromkeys(measure_of(feature) for kind in MEASURES for feature in self.of_kind(kind))
        return [*ends, *measures, *(("cycles", name) for name in self.counted)]

    @cached_property
    def counted(self) -> list[str]:
        """The channels whose cycles are counted."""
        return list(dict.fromkeys(feature.channel for feature in self.of_kind(Period)))

    @cached_property
    def named_features(self) -> list[tuple[str, Feature]]:
        """The names of the feature arrays, each with its feature, in order; those that
        are derived last."""
        pairs: list[tuple[str, Feature]] = []
        for feature in self.features:
            names = (feature.greatest, feature.least) if isinstance(feature, Extremes) else (feature.name,)
            pairs += [(name, feature) for name in names if name]
        return sorted(pairs, key=lambda pair: isinstance(pair[1], Derived))


def measured_by(
    variables: Iterable[Variable], declared: Iterable[Feature], only: Collection[str] = ()
) -> list[Feature]:
    """What the records of ``variables`` are measured by (``measure``), of those that every
    string has or that are for one of the options ``only``, and that are not among the
    features ``declared``."""
    names = {getattr(feature, "name", "") for feature in declared}
    return [
        replace(variable.measure, name=variable.name)
        for variable in variables
        if variable.measure and (variable.only is None or variable.only in only) and variable.name not in names
    ]


def measure_of(feature: Any) -> tuple[str, str]:
    """What is measured for a feature of one of the kinds of MEASURES: (what, name of
    the channel), of which several features may be made; for what has a level or several
    channels, the name of the feature."""
    shared = isinstance(feature, Mean | Passages | Stepped | Period)
    return MEASURES[type(feature)], feature.channel if shared else feature.name


def check(names: Names, declaration: Declaration) -> None:
    """ValueError, with what is wrong and what is allowed, if a declaration does not fit
    a model's rows."""
    outputs = declaration.outputs.names if declaration.outputs else ()
    rows = {*names.states, *names.slopes, *names.parameters, *outputs, *ALWAYS}
    _check_unique("row", (*names.states, *names.slopes, *names.parameters, *names.aux, *outputs, *ALWAYS))
    _check_unique("channel", [channel.name for channel in declaration.channels])
    peaks = [feature.peaks for feature in declaration.of_kind(Extremes) if feature.peaks]
    features = [name for name, _ in declaration.named_features]
    _check_unique("feature or parameter", [*features, *peaks, HALF_DIFFERENCE, *names.parameters])
    if declaration.outputs:
        readable = {*names.states, *names.slopes, *names.parameters, *names.aux, *ALWAYS}
        _check_known("outputs", arguments(declaration.outputs.function), readable)
    channels = {channel.name: channel for channel in declaration.channels}
    for channel in declaration.channels:
        _check_channel(channel, channels, names, rows)
    for feature in declaration.features:
        if not isinstance(feature, Derived):
            _check_measured(feature, declaration, channels, names, rows)
    defined = {name for name, feature in declaration.named_features if not isinstance(feature, Derived)}
    for derived in declaration.of_kind(Derived):
        _check_known(f"Derived {derived.name!r}", arguments(derived.function), {*defined, *names.parameters})
        defined.add(derived.name)
    if section := declaration.section:
        _check_known("section: channel", [section.channel], channels)
        _check_known("section: spacing", _reads(section.spacing), names.parameters)
        if not isinstance(section.spacing, str) and not 0.0 < section.spacing < np.inf:
            raise ValueError(f"section: spacing is {section.spacing}; allowed: a parameter or a positive number [rad]")


def _check_channel(channel: Channel, channels: dict[str, Channel], names: Names, rows: set[str]) -> None:
    where = f"channel {channel.name!r}"
    numbers: tuple[str, ...] = (*names.parameters, *names.states)
    if channel.within:
        given = {*names.states, *names.slopes, *names.parameters, *ALWAYS}
        _check_known(f"{where}: within", arguments(channel.within), given)
    allowed = {**dict.fromkeys(("value", "slope", "curvature"), rows), "level": names.parameters, "scale": numbers}
    for part, readable in allowed.items():
        expression = getattr(channel, part)
        if readable is not rows or not callable(expression):
            _check_name_or_number(f"{where}: {part}", expression)
        if readable is rows and (aux := sorted({*_reads(expression)} & {*names.aux})):
            raise ValueError(
                f"{where}: {part} reads {aux[0]!r}, an auxiliary output, which is known at the end of a step only; let "
                "a function of Outputs return it under another name"
            )
        _check_known(f"{where}: {part}", _reads(expression), readable)
        constant: frozenset[str] = getattr(expression, "constant", frozenset())  # of one that is followed
        if missing := sorted(constant - {*names.parameters, "phase"}):
            raise ValueError(
                f"{where}: found no rate of {', '.join(missing)}, which its value reads and which may change; allowed: "
                "how fast it does among the rates of `followed`, 0.0 where it does not"
            )
    _check_known(f"{where}: frame", _reads(channel.frame), names.parameters)
    if channel.inside:
        _check_known(f"{where}: of", channel.of, channels)
        _check_known(f"{where}: inside", arguments(channel.inside)[2 * len(channel.of) :], names.parameters)
    if channel.rate_of is not None:
        _check_known(f"{where}: rate_of", [channel.rate_of], channels)
        base = channels[channel.rate_of]
        if base.curvature is None or base.rate_of is not None:
            raise ValueError(f"{where}: rate_of is {base.name!r}, which must have a curvature and no rate_of")
        rates = (channel.value, channel.slope, channel.curvature, channel.frame)
        if rates != (base.slope, base.curvature, None, None):
            raise ValueError(
                f"{where}: as it is the rate of {base.name!r}, its value and slope must be the slope and curvature of "
                "that channel, and it may have neither a curvature nor a frame"
            )


def _check_measured(
    feature: Any, declaration: Declaration, channels: dict[str, Channel], names: Names, rows: set[str]
) -> None:
    kind = type(feature).__name__
    if isinstance(feature, Winding):
        found: tuple[str, ...] = (feature.x, feature.y)
    else:
        found = feature.channels if isinstance(feature, RmsOfSlopes) else (feature.channel,)
    _check_known(kind, found, channels)
    if isinstance(feature, Extremes):
        _check_extremes(feature, declaration, channels[feature.channel], names, rows)
        return
    if any(channels[name].inside for name in found):
        raise ValueError(f"{kind} {feature.name!r}: found a channel with a function inside; allowed: Extremes only")
    if any(channels[name].within for name in found) and not isinstance(feature, Mean | Outrun):
        raise ValueError(f"{kind} {feature.name!r}: found a channel within steps; allowed: Extremes, Mean and Outrun")
    if isinstance(feature, TimeAbove):
        _check_known(f"TimeAbove {feature.name!r}: level", _reads(feature.level), names.parameters)
    if isinstance(feature, Stepped) and channels[feature.channel].watched is None:
        raise ValueError(f"Stepped {feature.name!r}: found a channel that is not watched; allowed: one that is")
    if isinstance(feature, Passages) or (isinstance(feature, TimeAbove) and feature.level is None):
        _check_level(f"{kind} {feature.name!r}", channels[feature.channel])
    if isinstance(feature, Period):
        extremes = declaration.extremes.get(feature.channel)
        if extremes is None or extremes.maxima:
            raise ValueError(
                f"Period {feature.name!r}: found no Extremes of {feature.channel!r} with minima; allowed: a channel "
                "with both extremes, between which its levels are"
            )
        scale_of(channels[feature.channel], names)
    if isinstance(feature, MeanAbove):
        levels = [above.name for above in declaration.of_kind(TimeAbove)]
        _check_known(f"MeanAbove {feature.name!r}: above", [feature.above], levels)


def _check_extremes(
    feature: Extremes, declaration: Declaration, channel: Channel, names: Names, rows: set[str]
) -> None:
    where = f"Extremes of {channel.name!r}"
    if feature.slip is not None:
        _check_level("Extremes with slip", channel)
    _check_name_or_number("Extremes: slip", feature.slip)
    _check_known("Extremes: slip", _reads(feature.slip), names.parameters)
    scale_of(channel, names)
    if feature.unless:
        at_start, at_end = feature.unless
        _check_known(f"{where}: unless", _reads(at_start), rows)
        _check_known(f"{where}: unless", _reads(at_end), {*rows, *names.aux})
    if feature.compared != NATURAL:
        _check_known(f"{where}: compared", _reads(feature.compared), names.parameters)
    first = declaration.extremes[channel.name]
    if any(getattr(first, how) != getattr(feature, how) for how in ("smooth", "maxima", "unless")):
        raise ValueError(f"{where}: found smooth, maxima or unless that differ; allowed: the same for one channel")
    if feature.maxima and feature.least:
        raise ValueError(f"{where}: found least, {feature.least!r}, with maxima; allowed: one of the two")
    if channel.inside and not (feature.maxima and feature.smooth and not feature.peaks):
        raise ValueError(f"{where}: it has a function inside; allowed: smooth and maxima, without peaks")
    if channel.within and (feature.smooth or feature.maxima or feature.peaks or feature.unless):
        raise ValueError(f"{where}: it is a channel within steps; allowed: greatest and least alone")


def arguments(function: Callable[..., object]) -> list[str]:
    """The argument names of a function, compiled or not."""
    return list(inspect.signature(getattr(function, "py_func", function)).parameters)


def scale_of(channel: Channel, names: Names) -> str | float:
    """The natural scale of a channel: the name of a state or of a parameter, or a
    number. ValueError if it has none."""
    if channel.scale is not None:
        return channel.scale
    if isinstance(channel.value, str) and channel.value in names.states:
        return channel.value
    raise ValueError(
        f"channel {channel.name!r}: its value is not a state, so Extremes need a natural scale; "
        "give a scale: a state, a parameter or a number"
    )


def _reads(expression: Expression | None) -> list[str]:
    if callable(expression):
        return arguments(expression)
    return [expression] if isinstance(expression, str) else []


def _check_name_or_number(where: str, expression: object) -> None:
    if (
        expression is not None
        and not isinstance(expression, str)
        and not (isinstance(expression, float | int) and np.isfinite(expression))
    ):
        raise ValueError(
            f"{where}: found {expression!r}; allowed: the name of a row or a finite number "
            "(or a function, for a value and its rates)"
        )


def _check_level(where: str, channel: Channel) -> None:
    if channel.level is None:
        raise ValueError(f"{where}: the channel {channel.name!r} has no level; give it a parameter or a number")


def _check_known(where: str, names: Iterable[str], allowed: Iterable[str]) -> None:
    for name in names:
        if name not in allowed:
            raise ValueError(f"{where}: found {name!r}; allowed: {', '.join(sorted(allowed)) or 'nothing'}")


def _check_unique(what: str, names: Iterable[str]) -> None:
    seen: set[str] = set()
    for name in names:
        if name in seen:
            raise ValueError(f"{what}: {name!r} occurs twice; allowed: each name once")
        seen.add(name)
