"""What a model wants observed, as declarations: channels that are followed inside each
step, and features of them.

From a declaration an observer is made for any number of lanes
(:mod:`nsdrill.observe.declared`). The observed window has two halves, measured apart;
what the observer leaves of a run in its columns of the outbox becomes feature arrays
here, in plain numpy.

A *row* is a name among those of the model (:class:`Names`) and its outputs; ``time``
[s] and ``phase`` [rad], the angle that advances at a constant rate, are rows too. An
*expression* is the name of a row, a number, or a scalar function whose argument names
are the rows that it reads. Such a function must not branch but select, and may call
arithmetic, ``np.sqrt``, ``np.floor`` and the functions of :mod:`nsdrill.elementary`, as
a right-hand side may.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

Expression = str | float | Callable[..., Any]
ALWAYS = ("time", "phase")  # rows of every model
MOST = 61  # channels: one bit of a number each, and one for the section
HALF_DIFFERENCE = "half_difference"  # a name that no feature may have


@dataclass(frozen=True)
class Names:
    """The names of a model's rows in their order: own states, their slopes, auxiliary
    outputs and parameters."""

    states: tuple[str, ...]
    slopes: tuple[str, ...]
    parameters: tuple[str, ...] = ()
    aux: tuple[str, ...] = ()


@dataclass(frozen=True)
class Channel:
    """A quantity that is followed inside each step by the Hermite polynomial through
    its value, slope and, if there is one, curvature at both ends: of fifth degree, else
    of third.

    ``frame`` names a parameter that is taken off the slope: the slope of a twist is the
    bit speed less the drive speed. ``rate_of`` names a channel with a curvature: this
    one is then followed by the slope of that one's polynomial, plus its frame.
    ``level`` is a parameter or a number. ``scale``, the name of a state or of a
    parameter or a number, is the natural scale of the quantity; a channel whose value
    is a state has that of the state.
    """

    name: str
    value: Expression
    slope: Expression
    curvature: Expression | None = None
    frame: str | None = None
    rate_of: str | None = None
    level: str | float | None = None
    scale: str | float | None = None


@dataclass(frozen=True)
class Outputs:
    """Quantities computed once a step, at its end, and kept for the start of the next:
    rows like the states. Only ``function`` may read auxiliary outputs. It returns a
    tuple of as many numbers as there are names."""

    names: tuple[str, ...]
    function: Callable[..., Any]


@dataclass(frozen=True)
class Extremes:
    """The greatest and the least value in the window, and the last local maxima: each
    is measured under the name it is given. A maximum counts if it stands out by ten
    tolerances from what is before and after it."""

    channel: str
    greatest: str | None = None
    least: str | None = None
    peaks: str | None = None


@dataclass(frozen=True)
class TimeAbove:
    """The fraction of the window in which the channel is above its level. Visits inside
    one step count."""

    channel: str
    name: str


@dataclass(frozen=True)
class Mean:
    """The mean over the window, exact for the interpolant."""

    channel: str
    name: str


@dataclass(frozen=True)
class Rms:
    """The root of the mean square over the window, exact for the interpolant."""

    channel: str
    name: str


@dataclass(frozen=True)
class Passages:
    """How often per second the channel rises above its level. A visit inside one step
    counts where the time above is measured, too."""

    channel: str
    name: str


@dataclass(frozen=True)
class Winding:
    """The mean speed [rad/s] at which the vector of the channels ``x`` and ``y`` turns,
    by the angles between its values at the ends of the steps: a step turns it by less
    than half a turn."""

    x: str
    y: str
    name: str


@dataclass(frozen=True)
class Derived:
    """What follows from other features and from parameters, whose names are the
    arguments of ``function``: plain numpy over arrays [runs]. It may read a ``Derived``
    that stands before it."""

    name: str
    function: Callable[..., Any]


@dataclass(frozen=True)
class Section:
    """A Poincare section: all states whenever the channel, an angle, first reaches the
    next multiple of ``spacing``, a parameter or a positive number [rad]. An angle that
    turns back and comes again is not counted twice."""

    channel: str
    spacing: str | float


Feature = Extremes | TimeAbove | Mean | Rms | Passages | Winding | Derived
T = TypeVar("T", Extremes, TimeAbove, Mean, Rms, Passages, Winding, Derived)


@dataclass(frozen=True)
class Declaration:
    """What a model wants observed."""

    channels: tuple[Channel, ...]
    features: tuple[Feature, ...]
    outputs: Outputs | None = None
    section: Section | None = None

    def those(self, kind: type[T]) -> list[T]:
        """The features of one kind, in order."""
        return [feature for feature in self.features if isinstance(feature, kind)]

    def channels_of(self, *kinds: type[Any]) -> list[str]:
        """The channels that features of these kinds look at, each once, in order."""
        found = (
            feature.channel
            for kind in kinds
            for feature in self.features
            if isinstance(feature, kind)
        )
        return list(dict.fromkeys(found))

    @property
    def peaking(self) -> list[str]:
        """The channels whose maxima are kept."""
        return list(
            dict.fromkeys(feature.channel for feature in self.those(Extremes) if feature.peaks)
        )

    @property
    def half(self) -> list[tuple[str, str]]:
        """What is measured in each half: (what, of which channel); of a winding, which
        has two, under its name."""
        return [
            *((end, name) for name in self.channels_of(Extremes) for end in ("least", "greatest")),
            *(("above", name) for name in self.channels_of(TimeAbove)),
            *(("integral", name) for name in self.channels_of(Mean)),
            *(("square", name) for name in self.channels_of(Rms)),
            *(("passages", name) for name in self.channels_of(Passages)),
            *(("angle", winding.name) for winding in self.those(Winding)),
        ]

    @property
    def named(self) -> list[tuple[str, Feature]]:
        """The names of the feature arrays, each with its feature, in order."""
        found: list[tuple[str, Feature]] = []
        for feature in self.features:
            names = (
                (feature.greatest, feature.least)
                if isinstance(feature, Extremes)
                else (feature.name,)
            )
            found += [(name, feature) for name in names if name]
        return found


def check(names: Names, declaration: Declaration) -> None:
    """ValueError, which says what is wrong and what is allowed, where a declaration
    does not fit a model's rows."""
    outputs = declaration.outputs.names if declaration.outputs else ()
    rows = {*names.states, *names.slopes, *names.parameters, *outputs, *ALWAYS}
    _unique("row", (*names.states, *names.slopes, *names.parameters, *names.aux, *outputs, *ALWAYS))
    _unique("channel", [channel.name for channel in declaration.channels])
    peaks = [feature.peaks for feature in declaration.those(Extremes) if feature.peaks]
    features = [name for name, _ in declaration.named]
    _unique("feature or parameter", [*features, *peaks, HALF_DIFFERENCE, *names.parameters])
    if len(declaration.channels) > MOST:
        raise ValueError(f"channels: found {len(declaration.channels)}; allowed: at most {MOST}")
    if declaration.outputs:
        read = {*names.states, *names.slopes, *names.parameters, *names.aux, *ALWAYS}
        _known("outputs", arguments(declaration.outputs.function), read)
    known = {channel.name: channel for channel in declaration.channels}
    for channel in declaration.channels:
        where = f"channel {channel.name!r}"
        for part in ("value", "slope", "curvature", "level", "scale"):
            found = getattr(channel, part)
            if not (callable(found) and part not in ("level", "scale")):
                _name_or_number(f"{where}: {part}", found)
        for part in ("value", "slope", "curvature"):
            read_by = _reads(getattr(channel, part))
            if aux := sorted({*read_by} & {*names.aux}):
                raise ValueError(
                    f"{where}: {part} reads {aux[0]!r}, an auxiliary output, which is known at "
                    f"the end of a step only; "
                    "let a function of Outputs pass it on under another name"
                )
            _known(f"{where}: {part}", read_by, rows)
        for part, allowed in (
            ("frame", names.parameters),
            ("level", names.parameters),
            ("scale", (*names.parameters, *names.states)),
        ):
            _known(f"{where}: {part}", _reads(getattr(channel, part)), allowed)
        if channel.rate_of is not None:
            _known(f"{where}: rate_of", [channel.rate_of], known)
            base = known[channel.rate_of]
            if base.curvature is None or base.rate_of is not None:
                raise ValueError(
                    f"{where}: rate_of is {base.name!r}, which must have a curvature and no rate_of"
                )
            if (channel.value, channel.slope, channel.curvature, channel.frame) != (
                base.slope,
                base.curvature,
                None,
                None,
            ):
                raise ValueError(
                    f"{where}: as it is the rate of {base.name!r}, its value and slope must be "
                    f"that one's "
                    "slope and curvature, without a curvature and a frame of its own"
                )
    for feature in declaration.features:
        if isinstance(feature, Winding):
            _known("Winding", [feature.x, feature.y], known)
        elif not isinstance(feature, Derived):
            _known(type(feature).__name__, [feature.channel], known)
        if isinstance(feature, TimeAbove | Passages) and known[feature.channel].level is None:
            raise ValueError(
                f"{type(feature).__name__} {feature.name!r}: the channel {feature.channel!r} has "
                f"no level; "
                "give it a parameter or a number"
            )
        if isinstance(feature, Extremes):
            scale_of(known[feature.channel], names)
    known_by_now = {name for name, feature in declaration.named if not isinstance(feature, Derived)}
    for derived in declaration.those(Derived):
        _known(
            f"Derived {derived.name!r}",
            arguments(derived.function),
            {*known_by_now, *names.parameters},
        )
        known_by_now.add(derived.name)
    if section := declaration.section:
        _known("section: channel", [section.channel], known)
        _known("section: spacing", _reads(section.spacing), names.parameters)
        if not isinstance(section.spacing, str) and not 0.0 < section.spacing < np.inf:
            raise ValueError(
                f"section: spacing is {section.spacing}; allowed: a parameter or a "
                f"positive number [rad]"
            )


def arguments(function: Callable[..., Any]) -> list[str]:
    """The argument names of a function, compiled or not."""
    return list(inspect.signature(getattr(function, "py_func", function)).parameters)


def scale_of(channel: Channel, names: Names) -> str | float:
    """The natural scale of a channel: the state or the parameter that has it, or a
    number. ValueError without one."""
    if channel.scale is not None:
        return channel.scale
    if isinstance(channel.value, str) and channel.value in names.states:
        return channel.value
    raise ValueError(
        f"channel {channel.name!r}: its value is no state, so Extremes need its natural scale; "
        "give a scale: a state, a parameter or a number"
    )


def _reads(expression: Expression | None) -> list[str]:
    if callable(expression):
        return arguments(expression)
    return [expression] if isinstance(expression, str) else []


def _name_or_number(where: str, found: Any) -> None:
    if (
        found is not None
        and not isinstance(found, str)
        and not (isinstance(found, float | int) and np.isfinite(found))
    ):
        raise ValueError(
            f"{where}: found {found!r}; allowed: the name of a row or a finite number (or a "
            f"function, for "
            "a value and its rates)"
        )


def _known(where: str, found: Iterable[str], allowed: Iterable[str]) -> None:
    for name in found:
        if name not in allowed:
            raise ValueError(
                f"{where}: found {name!r}; allowed: {', '.join(sorted(allowed)) or 'nothing'}"
            )


def _unique(what: str, names: Iterable[str]) -> None:
    seen: set[str] = set()
    for name in names:
        if name in seen:
            raise ValueError(f"{what}: {name!r} stands there twice; each needs a name of its own")
        seen.add(name)
