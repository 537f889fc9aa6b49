"""Values, settings and probabilities of an answer as text, in SI or in field units."""

from __future__ import annotations

import math
from collections.abc import Iterable

from nsdrill.analysis.counts import open_words
from nsdrill.data import Answer
from nsdrill.models.registry import described
from nsdrill.models.responses import severity_words
from nsdrill.quantity import quantity
from nsdrill.units import from_si, to_si
from nsdrill.variables import MODEL
from nsdrill.words.labels import quantity as shown_quantity

ORDER = ("depth", "wob", "rotary_speed")  # the order in which drillers name them
WAYS = {"up": "coming up", "down": "coming down"}


_RAISED = {"wob": "with the weight raised", "depth": "coming from shallower depths"}
_LOWERED = {"wob": "with the weight lowered", "depth": "coming from greater depths"}


def reached(ways: Iterable[str], along: str | None, *, moved: bool = True, from_rest: bool = False) -> str:
    """How points were reached along the axis along which the state was carried, of several
    ``ways`` on the way in: ``brought up from below``; with the name of an axis that was not
    ``moved`` here, as all points have one value of it. ``from_rest`` says whether the bit of a
    start was at rest."""
    ways = tuple(ways)
    if "up" not in ways and "same" in ways:
        return "started there with the bit at rest" if from_rest else "started there"
    words, way = (_RAISED, "brought up from below") if "up" in ways else (_LOWERED, "lowered from above")
    if along not in (None, *ORDER):  # no driller brings it up
        return f"with the {quantity(along).words} {'raised' if 'up' in ways else 'lowered'}"
    return words.get(along or "", way if moved or along is None else f"with the {quantity(along).words} {way}")


def in_order(axes: Iterable[str | None]) -> list[str]:
    """The axes in the order in which drillers name them, further ones by name."""
    return sorted(
        (axis for axis in axes if axis), key=lambda axis: (ORDER.index(axis) if axis in ORDER else len(ORDER), axis)
    )


# What a driller can set, in the unit that he reads [SI].
_STEPS = {
    ("rotary_speed", "rpm"): math.pi / 30,
    ("wob", "klbf"): 0.5 * 4448.2216152605,
    ("rotary_speed", "rad/s"): 0.1,
    ("wob", "kN"): 1e3,
}
TORQUE = "surface_torque_mean"
_DECIMALS = {"rpm": 1, "klbf": 1, "rad/s": 2, "kN": 1, "kN m": 2, "kft-lbf": 2}  # a gauge on a rig has no more
_DIGITS = {TORQUE: 3, "rate_of_penetration": 3, "mechanical_specific_energy": 3}
_SLACK = 1e-6  # of a step: the last bits of a value


def _number_of_rate(value: float, is_most: bool = False) -> str:
    """A rate in rpm/s, to two digits, rounded up; one that ``is_most`` rounded down."""
    number = from_si(value, "rpm/s")
    size = 10.0 ** (math.floor(math.log10(number)) - 1) if number > 0.0 else 1.0
    steps = math.floor(number / size + _SLACK) if is_most else math.ceil(number / size - _SLACK)
    rounded = steps * size
    return f"{rounded:.2g}" if rounded < 100 else f"{rounded:.0f}"


class Formatter:
    """Values as text in one system of units; a speed in rad/s with the rpm in
    brackets. The ``model`` has the quantities and the responses."""

    def __init__(self, units: str, model: str = MODEL) -> None:
        self.system, self.model = units, model

    def unit(self, axis: str) -> str:
        """The sign of the unit of an axis."""
        return shown_quantity(axis, self.system).unit

    def name(self, axis: str) -> str:
        """The name of an axis in a sentence."""
        return quantity(axis).words

    def named(self, axis: str, text: str) -> str:
        """A ``text`` with values of an axis, with its name before it where the unit does not tell a driller which one
        it is: ``120 rpm``, but ``force 0.06``."""
        return text if axis in ORDER else f"{self.name(axis)} {text}"

    def number(self, axis: str, value: float) -> str:
        shown = shown_quantity(axis, self.system)
        number, decimals = value / shown.scale, _DECIMALS.get(shown.unit, math.inf)
        if axis in _DIGITS and number != 0.0 and math.isfinite(number):
            digits = _DIGITS[axis] - 1 - math.floor(math.log10(abs(number)))
            decimals = max(min(decimals, digits), 0)
        if not math.isfinite(decimals) or not math.isfinite(number):
            return shown.number(value)
        return f"{round(number, int(decimals)) + 0.0:.6g}"

    def value(self, axis: str, value: float | str) -> str:
        if isinstance(value, str):  # a word
            return value
        return f"{self.number(axis, value)} {self.unit(axis)}".rstrip() + self._rpm(axis, value)

    def on_gauge(self, axis: str, *ends: float) -> str:
        """As :meth:`range`, of one value or two, to the tenth that a gauge on a rig shows; of less than that whole."""
        scale = shown_quantity(axis, self.system).scale
        tenths = [round(end / scale, 1) * scale for end in ends]
        shown = ends if 0.0 in tenths else tenths
        return self.range(axis, [shown[0], shown[-1]])

    def range(self, axis: str, ends: list[float]) -> str:
        """``105 to 150 rpm``; of two equal ends one."""
        low, high = (self.number(axis, end) for end in ends)
        if low == high:
            return self.value(axis, ends[0])
        numbers = f"{low} to {high}"
        return f"{numbers} {self.unit(axis)}".rstrip() + self._rpm(axis, *ends)

    def steps(self, axis: str, least: float, most: float) -> str:
        """``2.5 to 10 rpm``, steps along an axis, each of three digits, as one may be smaller than
        what can be set; of those that differ by rounding one."""
        shown = shown_quantity(axis, self.system)
        low, high = (f"{value / shown.scale:.3g}" for value in (least, most))
        ends, numbers = ([least], low) if low == high else ([least, most], f"{low} to {high}")
        return f"{numbers} {self.unit(axis)}".rstrip() + self._rpm(axis, *ends)

    def step_down(self, axis: str, step: float) -> str:
        """A ``step`` that is small enough, to two digits, rounded down: one that is too large by little reads alike."""
        shown = step / shown_quantity(axis, self.system).scale
        digit = 10.0 ** (math.floor(math.log10(shown)) - 1)
        small = round(math.floor(shown / digit + _SLACK) * digit, 12)
        in_si = small * shown_quantity(axis, self.system).scale
        return f"{small:g} {self.unit(axis)}".rstrip() + self._rpm(axis, in_si)

    def above(self, axis: str, speeds: list[float]) -> str:
        """``above 33 rpm``, of the least and the greatest of speeds, or of one, rounded down, as what
        begins there is to keep out of; ``at any speed`` of zero."""
        low, high = (self.outwards(axis, end, end)[0] for end in (speeds[0], speeds[-1]))
        return f"above {self.range(axis, [low, high])}" if high > 0.0 else "at any speed"

    def inwards(self, axis: str, low: float, high: float) -> tuple[float, float]:
        """The ends of a range as a driller can set them, rounded inwards: to 1 rpm or 0.1 rad/s
        and half a klbf or 1 kN, by the unit. As they are where no such value lies within."""
        step = _STEPS.get((axis, self.unit(axis)))
        if step is None:
            return low, high
        least, most = math.ceil(low / step - _SLACK), math.floor(high / step + _SLACK)
        return (least * step, most * step) if least <= most else (low, high)

    def range_inwards(self, axis: str, low: float, high: float) -> str:
        """As :meth:`range`, of a range that is allowed."""
        return self.range(axis, list(self.inwards(axis, low, high)))

    def outwards(self, axis: str, low: float, high: float) -> tuple[float, float]:
        """The ends of a range to keep out of, rounded outwards as :meth:`inwards`."""
        step = _STEPS.get((axis, self.unit(axis)))
        if step is None:
            return low, high
        return math.floor(low / step + _SLACK) * step, math.ceil(high / step - _SLACK) * step

    def range_outwards(self, axis: str, low: float, high: float) -> str:
        """As :meth:`range`, of a range to keep out of."""
        return self.range(axis, list(self.outwards(axis, low, high)))

    def settable(self, axis: str, value: float, low: float | None = None, high: float | None = None) -> float:
        """A ``value`` as it can be set: the nearest one within ``low`` and ``high``."""
        step = _STEPS.get((axis, self.unit(axis)))
        if step is None:
            return value
        low, high = self.inwards(axis, value if low is None else low, value if high is None else high)
        return min(max(round(value / step) * step, low), high)

    def rate(self, value: float) -> str:
        """A rate of change of the speed that is the least, to two digits, rounded up."""
        text = f"{_number_of_rate(value)} rpm/s"
        return text if self.system == "field" else f"{to_si(text, 'rad/s^2'):.2g} rad/s² ({text})"

    def rates(self, low: float, high: float) -> str:
        """A range of these, rounded inwards: ``1 to 10 rpm/s``; of two that differ by rounding the least."""
        numbers = [_number_of_rate(low), _number_of_rate(high, is_most=True)]
        if float(numbers[1]) <= float(numbers[0]):
            return self.rate(low)
        text = f"{' to '.join(numbers)} rpm/s"
        if self.system == "field":
            return text
        ends = [f"{to_si(f'{number} rpm/s', 'rad/s^2'):.2g}" for number in numbers]
        return f"{' to '.join(ends)} rad/s² ({text})"

    def span(self, axis: str, ends: list[float]) -> str:
        """As :meth:`range`, with the name of the axis before it."""
        return f"{quantity(axis).words} {self.range(axis, ends)}"

    def setting(self, point: Answer, axes: Iterable[str | None]) -> str:
        """The values of a point, in order: ``25 klbf, 125 rpm``; further axes with
        their names."""
        return ", ".join(self.named(axis, self.value(axis, point[axis])) for axis in in_order(axes))

    def _rpm(self, axis: str, *values: float) -> str:
        if self.system == "field" or axis != "rotary_speed":
            return ""
        speeds = " to ".join(f"{from_si(value, 'rpm'):.3g}" for value in values)
        return f" ({speeds} rpm)"


def percent(point: Answer) -> str:
    """``97.3 % (94.4 to 98.7)``: a probability with its interval; ``not known (2.1 to 100;
    7 of 8 failed)`` where no sample tells it, and with what is not known otherwise too."""
    ends = " to ".join(f"{100 * point[f'probability_{end}']:.1f}" for end in ("low", "high"))
    words = open_words(point["samples_of"]) if "samples_of" in point else ""
    value = "not known" if point["probability"] is None else f"{100 * point['probability']:.1f} %"
    return f"{value} ({ends}{f'; {words}' if words else ''})"


def drilling(point: Answer, fmt: Formatter) -> str:
    """``rate of penetration 32 ft/h, specific energy 22 ksi``; "" where a file has
    neither."""
    words = {"rate_of_penetration": "rate of penetration", "mechanical_specific_energy": "specific energy"}
    return ", ".join(f"{word} {fmt.value(name, point[name])}" for name, word in words.items() if name in point)


def response_words(names: Iterable[str], model: str = MODEL) -> str:
    """The responses of the ``model`` with these names in words, with commas."""
    responses = described(model).critical
    return ", ".join(responses[name].words for name in names)


def of_severity(level: int, model: str = MODEL) -> str:
    """The word of the ``model`` for a level of severity: ``moderate``."""
    return severity_words(described(model).critical.values(), level)


def safe_words(severity: int | None, model: str = MODEL) -> str:
    """``safe``, with the vibration that a ``severity`` of the ``model`` allows."""
    if severity is None:
        return "safe"
    return f"safe ({f'vibration up to {of_severity(severity, model)}' if severity else 'no vibration'} allowed)"
