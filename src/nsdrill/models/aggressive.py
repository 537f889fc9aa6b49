"""The torque of a bit that is unusual for its kind: a warning of ``check``.

The aggressiveness 36 T/(D W) is the coefficient of sliding friction of a bit as Pessier &
Fear (SPE 24584, 1992) define it. The ranges that are usual here are judgement, wide on
purpose: no published table covers roller cones, and those of PDC bits depend on cutters and
rock."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from operator import itemgetter
from typing import Any, NamedTuple

from nsdrill.errors import from_to
from nsdrill.models.drilling import Drilling
from nsdrill.models.numbers import FormatValue
from nsdrill.models.operation import Operation, Values
from nsdrill.models.parts import chosen_at
from nsdrill.models.tree import with_values

LOBES_OF_CONES = 3
BY_FRICTION = "multiply {keys} by {most} {factor:g}, or fit them to a torque that was measured."
CUT_ALONE = "what cuts alone takes more than that: fit bit.cutting to a torque that was measured."
HALF = 0.5
BY_CUTTING = "change bit.rock.zeta, or bit.rock.friction and wear_length, or measure the torque."
FRICTION = "bit.friction.static and dynamic"


class Usual(NamedTuple):
    """The usual range of the aggressiveness of a kind of ``bits``."""

    bits: str
    low: float
    high: float

    def off(self, value: float) -> float:
        """By which factor a ``value`` lies outside, at most 1 of one inside."""
        return max(self.low / value, value / self.high)


ROLLER_CONE = Usual("roller cones (3 lobes and more)", 0.1, 0.35)
PDC = Usual("PDC bits", 0.25, 1.5)
OF_ANY_KIND = Usual("bits of any kind", ROLLER_CONE.low, PDC.high)  # of a model that does not say which


def usual_of(bit: Any) -> Usual:
    """What is usual of a ``bit``: one with lobes that lift it is a roller cone from three
    of them on, unless its blades cut what the one before them left."""
    rock = getattr(bit, "rock", None)
    if rock is not None and rock.regenerative:
        return PDC
    return ROLLER_CONE if bit.lobes >= LOBES_OF_CONES and float(bit.surface_amplitude) != 0.0 else PDC


class Found(NamedTuple):
    """A bit at a point: what is ``usual`` of it, steady drilling there, and the same with
    half the friction (``halved``), None of a bit without friction to multiply."""

    usual: Usual
    drilling: Drilling
    halved: Drilling | None = None

    @property
    def value(self) -> float | None:
        """The aggressiveness."""
        return self.drilling.aggressiveness

    def factor(self, target: float) -> float:
        """By what to multiply the friction for this ``target`` of the aggressiveness; what
        cuts takes its part of the torque whatever the friction. To two digits, towards
        the usual; 0 or less where what cuts alone exceeds it."""
        value = self.value or 0.0
        half = None if self.halved is None else self.halved.aggressiveness
        friction = value if half is None else (value - half) / (1.0 - HALF)
        factor = (target - (value - friction)) / friction if friction > 0.0 else 0.0
        return (math.floor if target < value else math.ceil)(100.0 * factor) / 100.0


def found_at(usual: Usual, parameters: Any, operation: Operation, at: Callable[[Any, Operation], Drilling]) -> Found:
    """What is found of a bit with friction, ``at`` that finds steady drilling."""
    law = parameters.bit.friction
    rock = getattr(parameters.bit, "rock", None)
    names = ("static", "dynamic", "static_torque", "dynamic_torque", "level", "hump")
    less = {f"bit.friction.{one}": HALF * value for one in names if (value := getattr(law, one, None)) is not None}
    if not less or (rock is not None and rock.regenerative):  # a law of another package has other numbers
        return Found(usual, at(parameters, operation))
    return Found(usual, at(parameters, operation), at(with_values(parameters, less), operation))


def operated(study: Any, corners: Sequence[Values]) -> tuple[Any, Operation]:
    """The parameters and the operating point of a ``study`` with these ``corners``, at a
    depth that its axes have."""
    parameters, _, _ = chosen_at(study.parameters, study.initial, {})
    return parameters, replace(study.operation, depth=corners[0].point.depth)


def aggressive(
    here: Found, found: Sequence[Found], format_value: FormatValue, remedy: str = BY_FRICTION, keys: str = FRICTION
) -> str | None:
    """The warning of a torque of the bit that is unusual at the operating point of a study
    (``here``), or at each end of its axes (``found``); None where it is not."""
    usual, one, value = here.usual, here.drilling, here.value
    where = f" at {format_value(one.wob, 'N', 'kN')} and {format_value(one.set_speed, 'rad/s', 'rad/s')}"
    ends = "" if value is None else f"{value:.3g}{where}"
    if value is None or value <= 0.0 or usual.off(value) <= 1.0:
        pairs = [(each.usual.off(its), its, each) for each in found if (its := each.value)]
        if not pairs or any(off <= 1.0 for off, _, _ in pairs):
            return None
        _, value, here = min(pairs, key=itemgetter(0))
        usual, values = here.usual, [its for _, its, _ in pairs]
        ends = from_to(f"{end(values):.3g}" for end in (min, max))
    is_high = value > usual.high
    factor, most = here.factor(usual.high if is_high else usual.low), "at most" if is_high else "at least"
    remedy = CUT_ALONE if remedy == BY_FRICTION and factor <= 0.0 else remedy
    return (
        f"{'Aggressive' if is_high else 'Blunt'}: the torque of the bit, 36 T/(D W), is {ends}, and usual of "
        f"{usual.bits} is {usual.low:g} to {usual.high:g}, a judgement: what was measured in an offset well counts "
        f"more. It decides where stick-slip ends: {remedy.format(keys=keys, most=most, factor=factor)}"
    )
