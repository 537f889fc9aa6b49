"""The friction laws, each once: the coefficient, with its sign, at a slip.

With the smoothed direction g(v) = (2/pi) atan(smoothing v) and the four ``numbers`` of
a law (smoothing, decay, rise, dynamic):

    hyperbolic   g [ rise / (1 + decay |v|) + dynamic ]
    linear       g [ rise max(1 - decay |v|, 0) + dynamic ]
    exponential  g [ rise exp(-decay |v|) + dynamic ]
    rational     dynamic tanh(smoothing v) + rise v / (1 + decay v^2)

Sources: hyperbolic in the form of Leine 1998; linear Dawson, Lin & Spanos 1987, SPE
16660; exponential and rational as public codes of drill-string models have them.
"""

from __future__ import annotations

from typing import Any

from nsdrill.compiler.contacts import Law
from nsdrill.compiler.library import direction, expm1, slip_factors
from nsdrill.compiler.trace import Named, part


def _hyperbolic(v: Any, numbers: Any) -> tuple[Any, Any]:
    return slip_factors(v, numbers.smoothing, numbers.decay)


@part
def _linear(v: Any, numbers: Any) -> tuple[Any, Any]:
    return direction(numbers.smoothing * v), max(1.0 - numbers.decay * abs(v), 0.0)


def _exponential(v: Any, numbers: Any) -> tuple[Any, Any]:
    return direction(numbers.smoothing * v), 1.0 + expm1(-(numbers.decay * abs(v)))


@part
def _rational(v: Any, numbers: Any) -> tuple[Any, Any]:
    e = expm1(-2.0 * abs(numbers.smoothing * v))
    tanh = -e / (2.0 + e)
    return -tanh if v < 0.0 else tanh, 1.0 / (1.0 + numbers.decay * v * v)


def _falling(v: Any, factors: tuple[Any, Any], numbers: Any) -> Any:
    direction, weakened = factors
    return direction * (numbers.rise * weakened + numbers.dynamic)


def _humped(v: Any, factors: tuple[Any, Any], numbers: Any) -> Any:
    tanh, weakened = factors
    return numbers.dynamic * tanh + numbers.rise * v * weakened


def _without_hump(numbers: Any) -> Named:
    """The numbers of a hyperbolic law that is like the rational one without its hump."""
    return Named(smoothing=numbers.smoothing, decay=0.0, rise=0.0, dynamic=numbers.dynamic)


def _fall(numbers: Any) -> Any:
    """Without smoothing."""
    return numbers.rise * numbers.decay


hyperbolic = Law(_hyperbolic, _falling, _fall)
LAWS = {
    "hyperbolic": hyperbolic,
    "linear": Law(_linear, _falling, _fall),
    "exponential": Law(_exponential, _falling, _fall),
    "rational": Law(_rational, _humped, lambda n: 0.125 * n.rise, _without_hump),
}


def numbers_of(p: Any, contact: str) -> Named:
    """The numbers of the law of a contact, among the lane parameters ``p``."""
    names = ("smoothing", "decay", "rise", "dynamic")
    return Named(**{name: getattr(p, f"{contact}_{name}") for name in names})
