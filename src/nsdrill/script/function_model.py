"""The model of a function, as it is computed."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from nsdrill.data import Array
from nsdrill.equations import plain
from nsdrill.equations.consequences import Consequences
from nsdrill.equations.jumps import jumps_in, probes_around
from nsdrill.equations.library import Friction
from nsdrill.errors import InputError
from nsdrill.models.base import Model
from nsdrill.models.operation import ModelParameters, Numeric, Values
from nsdrill.models.own_quantities import power_of_two
from nsdrill.models.responses import Thresholds
from nsdrill.script.angles import near_last, without_revolutions
from nsdrill.script.clock import CLOCK
from nsdrill.script.function_channels import FRAME, SIZE, SLIP, STUCK, declaration_of, names_of
from nsdrill.script.pulses import Pulse, shortest_pulse
from nsdrill.script.reading import Reading
from nsdrill.script.trial import Scales, natural_scales, trial_of
from nsdrill.variables import DRIVES

SECTION = "parameters"  # of a study, with the numbers of the function
NINE_TENTHS = 6.3  # smoothing times the slip at which the smoothed direction has nine tenths of its value
SPREAD = 10.0  # of an ensemble's starts, in natural scales: as far as the motion goes
PROBES = 64  # states at which the sizes of quantities are looked at
AWAY = 1e-3  # from the start, where rates are looked at: an equilibrium may be there


class FunctionModel(Model[ModelParameters]):
    """The model of a function as it was read."""

    def __init__(self, reading: Reading) -> None:
        self.reading = reading
        self._jumps: dict[tuple[float, ...], tuple[str, ...]] = {}
        self.name = reading.signature.name
        self.set_speed = CLOCK
        self.singles = len(reading.singles)
        self.idle, self.uncounted = reading.idle, reading.uncounted
        self.contacts = tuple(reading.gaps)
        self.equations = reading.equations
        self.rows_named = names_of(reading)
        self.declared = declaration_of(reading)

    def consequences(self, o: Any) -> Consequences:
        return self.reading.consequences

    # Numbers.

    def places_of_jumps(self, numbers: Mapping[str, Numeric] | None = None) -> tuple[str, ...]:
        """The conditions at which slopes jump, across which a deviation is not followed, with
        these ``numbers`` of the function; by default with those that the script gives."""
        read = self.reading.signature
        values = {name: float((numbers or {}).get(name, value)) for name, value in read.parameters.items()}
        at = tuple(values.values())
        if at not in self._jumps:
            states, angles = probes_around({name: float(value) for name, value in read.start.items()})
            self._jumps[at] = jumps_in(
                self.reading.consequences, self.reading.given(states, values, **angles), read.where
            )
        return self._jumps[at]

    @cached_property
    def scale(self) -> dict[str, float]:
        """The natural scale of each state."""
        return dict(self._scales.of)

    @property
    def guessed(self) -> tuple[str, ...]:
        """The states of which it is a guess, as the motion at the defaults grows."""
        return self._scales.guessed

    @cached_property
    def _scales(self) -> Scales:
        return natural_scales(self.reading, self.slowest)

    def reach(self, points: Values[ModelParameters]) -> dict[str, float]:
        """How far from zero each state comes in a trial with the numbers and from the start of
        one point; of a motion that is forced, late in it. Empty where the function refuses what
        it reaches, as a normal load below 0, which runs tell of."""
        start = {name: float(getattr(points.initial, name)) for name in self.reading.signature.start}
        numbers = {name: float(value) for name, value in self.numbers(points).items()}
        try:
            trial = trial_of(self.reading, self.slowest, numbers, start)
        except InputError:
            return {}
        reached = trial.last if self.reading.forcing is not None else trial.greatest
        return dict(zip(start, reached.tolist(), strict=True))

    def steepest(self, points: Values[ModelParameters]) -> dict[str, float]:
        """The smoothing of each friction times the natural scale of its slip."""
        reading, numbers, found = self.reading, {**self.numbers(points), CLOCK: self.slowest}, {}
        given = reading.given(dict.fromkeys(reading.states, 0.0), numbers)
        for name, contact in reading.rubs.items():
            smoothing = plain.values({"": reading.graph.node(contact.numbers.smoothing)}, given)[""]
            found[name] = float(np.max(self._natural_slip(contact, numbers))) * float(np.max(smoothing))
        return found

    def _natural_slip(self, contact: Friction, numbers: Mapping[str, Numeric]) -> Numeric:
        """The natural scale of a slip: by how much those of the states change it, from rest."""
        reading, rest = self.reading, dict.fromkeys(self.reading.states, 0.0)
        slip = {"": reading.graph.node(contact.slips[0])}
        at_rest = plain.values(slip, reading.given(rest, numbers))[""]
        moved = [plain.values(slip, reading.given({**rest, one: self.scale[one]}, numbers))[""] for one in rest]
        return sum((np.abs(one - at_rest) for one in moved), np.zeros(1))

    @cached_property
    def sizes(self) -> dict[str, float]:
        """The natural scale of each quantity that the script measures: a tenth of its
        greatest value as far as the motion of the trial goes, by its lane parameter."""
        reading, rng = self.reading, np.random.default_rng(1)
        if not reading.quantities:
            return {}
        states = {name: SPREAD * size * rng.uniform(-1.0, 1.0, PROBES) for name, size in self.scale.items()}
        defaults = {name: float(value) for name, value in reading.signature.parameters.items()}
        wanted = {SIZE.format(one.name): node for one, node in reading.quantities.items()}
        found = plain.values(wanted, reading.given(states, {**defaults, CLOCK: self.slowest}))
        greatest = {name: np.max(np.nan_to_num(np.abs(value), posinf=0.0)) for name, value in found.items()}
        return {name: power_of_two(0.1 * float(value)) for name, value in greatest.items()}

    @cached_property
    def slowest(self) -> float:
        """The rate of the forcing at the defaults, else of the slowest motion or change at
        the start [1/s]."""
        reading = self.reading
        defaults = {name: float(value) for name, value in reading.signature.parameters.items()}
        if reading.rate is not None:
            return abs(float(plain.values({"": reading.rate}, reading.given({}, defaults))[""])) or 1.0
        states = {name: float(value) + AWAY for name, value in reading.signature.start.items()}
        sizes = reading.consequences.rates(reading.given(states, defaults))
        moving = sizes[sizes > 1e-6 * sizes.max()]
        return float(moving.min()) if moving.size else 1.0

    def numbers(self, points: Values[ModelParameters]) -> dict[str, Numeric]:
        """The numbers of the function at points."""
        return dict(vars(getattr(points.parameters, SECTION))) if self.reading.signature.parameters else {}

    def shortest_pulse(self, points: Values[ModelParameters], duration: float) -> Pulse | None:
        numbers = self.numbers(points)
        found = [self._pulse_of_time(numbers, duration), *self._pulses_of_angles(points, numbers)]
        return min((one for one in found if one is not None), default=None)

    def resting_pulse(self, points: Values[ModelParameters]) -> tuple[float, str] | None:
        numbers, found = self.numbers(points), []
        for name, rate, given in self._rates_of_angles(points, numbers):
            if rate == 0.0:
                forces, turn = self.reading.turned[name], 2.0 * math.pi
                pulse = shortest_pulse(forces, given, turn, repeats=True, source=f"s.{name}")
                found += [] if pulse is None else [(pulse[0], name)]
        return min(found, default=None)

    def _pulses_of_angles(
        self, points: Values[ModelParameters], numbers: Mapping[str, Numeric]
    ) -> Iterator[Pulse | None]:
        """The shortest pulse of each state that is an angle, as it turns at the start; of one that
        rests there see :meth:`resting_pulse`."""
        for name, rate, given in self._rates_of_angles(points, numbers):
            if np.isfinite(rate) and rate != 0.0:
                forces, turn = self.reading.turned[name], 2.0 * math.pi / abs(rate)
                yield shortest_pulse(forces, given, turn, repeats=True, source=f"s.{name}", rate=rate)

    def _rates_of_angles(
        self, points: Values[ModelParameters], numbers: Mapping[str, Numeric]
    ) -> Iterator[tuple[str, float, dict[str, Any]]]:
        """Each state that is an angle, its rate at the start, and what is given there."""
        reading = self.reading
        start = {name: getattr(points.initial, name) for name in reading.states}
        given = reading.given(start, {**numbers, CLOCK: self.slowest})
        for name in reading.turned:
            yield name, float(np.ravel(plain.values({"": reading.slopes[name]}, given)[""])[0]), given

    def _pulse_of_time(self, numbers: dict[str, Numeric], duration: float) -> Pulse | None:
        reading = self.reading
        if reading.rate is not None:
            rate = float(np.ravel(plain.values({"": reading.rate}, reading.given({}, numbers))[""])[0])
            numbers[CLOCK], duration = rate, 2.0 * math.pi / abs(rate)
        return shortest_pulse(reading.forces, reading.given({}, numbers), duration, repeats=reading.rate is not None)

    def columns(self, points: Values[ModelParameters], thresholds: Thresholds) -> Mapping[str, Numeric]:
        reading, numbers = self.reading, self.numbers(points)
        wanted = {FRAME.format(name): frame for name, frame in reading.frames.items()}
        for name, contact in reading.rubs.items():
            wanted[STUCK.format(name)] = NINE_TENTHS / reading.graph.node(contact.numbers.smoothing)
        if reading.rate is not None:
            wanted[CLOCK] = reading.rate
        found = plain.values(wanted, reading.given({}, numbers)) if wanted else {}
        given = {**numbers, CLOCK: self.slowest}
        slips = {SLIP.format(name): self._natural_slip(contact, given) for name, contact in reading.rubs.items()}
        return {CLOCK: self.slowest, **numbers, **found, **slips, **self.sizes}

    def outputs(self, points: Values[ModelParameters], state: Mapping[str, Array]) -> dict[str, Array]:
        """Whether friction drives at each time, as 1 or 0."""
        reading, numbers, phase = self.reading, self.numbers(points), state["drive_angle"]
        wanted = {DRIVES.format(name): node for name, (node, _) in reading.driving.items()}
        clock = self.columns(points, Thresholds())[CLOCK]
        states = {name: state[name] for name in reading.states}
        given = reading.given(states, {**numbers, CLOCK: clock}, phase=phase, time=phase / clock)
        return {name: value + np.zeros_like(phase) for name, value in plain.values(wanted, given).items()}

    def frame_rates(self, table: Mapping[str, Array], o: Any) -> Mapping[str, Numeric]:
        frames = self.reading.frames
        return {name: -table[FRAME.format(name)] for name in self.reading.pairs if name in frames}

    def natural_scales(self, table: Mapping[str, Array], o: Any) -> Sequence[Numeric]:
        return [self.scale[name] for name in self.reading.states]

    def scales(self, table: Array) -> dict[str, Array]:
        return {scale_name(name): np.full(len(table), SPREAD * self.scale[name]) for name in self.reading.states}

    def fastest(self, table: Mapping[str, Array], o: Any) -> Array:
        """The spectral radius of the Jacobian at the start, or the rate of the forcing."""
        start = {name: float(value) + AWAY * self.scale[name] for name, value in self.reading.signature.start.items()}
        numbers = {name: table[name] for name in (*self.reading.signature.parameters, CLOCK)}
        sizes = self.reading.consequences.rates(self.reading.given(start, numbers)).max(axis=-1)
        return np.maximum(np.broadcast_to(sizes, table[CLOCK].shape), np.abs(table[CLOCK]))

    # Starts, and what repeats.

    def steady(self, points: Values[ModelParameters]) -> Mapping[str, Numeric]:
        return {}

    def drawn(self, points: Values[ModelParameters], shape: Array) -> Mapping[str, Numeric]:
        """States around the start, as far as the motion of the trial goes, times the
        study's spread."""
        reach = SPREAD * points.initial.spread
        found: dict[str, Numeric] = {
            name: getattr(points.initial, name) + reach * self.scale[name] * (2.0 * shape[:, k] - 1.0)
            for k, name in enumerate(self.reading.states)
        }
        return found | {"drive_angle": 2.0 * math.pi * shape[:, len(self.reading.states)]}

    def jumping(self, points: Values[ModelParameters], parts: Sequence[str] = ()) -> tuple[str, ...]:
        return self.places_of_jumps(self.numbers(points))

    def returns(self, section: Mapping[str, Array]) -> Array:
        """Angles by whole revolutions near the last of them; what nothing reads is left out."""
        found = {name: section[f"section_{name}"] for name in self.reading.states}
        found |= {name: near_last(found[name]) for name in self.reading.angles}
        found |= {name: 0.0 * found[name] for name in self.reading.unread}
        return np.stack([found[name] for name in self.reading.states], axis=-1)

    def _comparable(self, features: Mapping[str, Array]) -> dict[str, Array]:
        found = dict(features)
        for name in self.reading.angles:
            found |= without_revolutions(features, name)
        return found

    def coordinates(self, features: Mapping[str, Array], table: Array) -> tuple[Array, Array]:
        return super().coordinates(self._comparable(features), table)

    def difference(self, first: Mapping[str, Array], second: Mapping[str, Array], units: Mapping[str, Array]) -> Array:
        return super().difference(self._comparable(first), self._comparable(second), units)

    def still(self, features: Mapping[str, Array], state_scales: Array, absolute: float) -> Array:
        ranges = [features[f"{name}_max"] - features[f"{name}_min"] for name in self.reading.states]
        within = [one <= absolute * state_scales[..., k] for k, one in enumerate(ranges)]
        return np.asarray(np.all(within, axis=0))


def scale_name(state: str) -> str:
    """The name of the scale in which differences of a state's features are measured."""
    return f"{state} scale"
