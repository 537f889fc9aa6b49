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

from nsdrill.compiler.library import direction, expm1, slip_factors
from nsdrill.compiler.trace import Named, part


def hyperbolic_factors(v: Any, numbers: Any) -> Any:
    return slip_factors(v, numbers.smoothing, numbers.decay)


@part
def linear_factors(v: Any, numbers: Any) -> Any:
    return direction(numbers.smoothing * v), max(1.0 - numbers.decay * abs(v), 0.0)


def exponential_factors(v: Any, numbers: Any) -> Any:
    return direction(numbers.smoothing * v), 1.0 + expm1(-(numbers.decay * abs(v)))


@part
def rational_factors(v: Any, numbers: Any) -> Any:
    e = expm1(-2.0 * abs(numbers.smoothing * v))
    size = -e / (2.0 + e)
    return -size if v < 0.0 else size, 1.0 / (1.0 + numbers.decay * v * v)


def hyperbolic(v: Any, numbers: Any) -> Any:
    g, weakened = hyperbolic_factors(v, numbers)
    return g * (numbers.rise * weakened + numbers.dynamic)


def linear(v: Any, numbers: Any) -> Any:
    g, weakened = linear_factors(v, numbers)
    return g * (numbers.rise * weakened + numbers.dynamic)


def exponential(v: Any, numbers: Any) -> Any:
    g, weakened = exponential_factors(v, numbers)
    return g * (numbers.rise * weakened + numbers.dynamic)


def rational(v: Any, numbers: Any) -> Any:
    tanh, weakened = rational_factors(v, numbers)
    return numbers.dynamic * tanh + numbers.rise * v * weakened


def _fall(numbers: Any) -> Any:
    """The steepest fall of the coefficient with the slip, without smoothing."""
    return numbers.rise * numbers.decay


for _law in (hyperbolic, linear, exponential):
    _law.steepest_fall = _fall
rational.steepest_fall = lambda numbers: 0.125 * numbers.rise
# Newton's method begins from the law without its hump.
rational.guess = lambda numbers: Named(
    smoothing=numbers.smoothing, decay=0.0, rise=0.0, dynamic=numbers.dynamic
)

LAWS = {
    "hyperbolic": hyperbolic,
    "linear": linear,
    "exponential": exponential,
    "rational": rational,
}


def numbers_of(p: Any, contact: str) -> Named:
    """The numbers of the law of a contact, among the lane parameters ``p``."""
    names = ("smoothing", "decay", "rise", "dynamic")
    return Named(**{name: getattr(p, f"{contact}_{name}") for name in names})


FACTORS = {
    "hyperbolic": hyperbolic_factors,
    "linear": linear_factors,
    "exponential": exponential_factors,
    "rational": rational_factors,
}
