"""The torque of a bit that is unusual for its kind: a warning of ``check``.

The aggressiveness 36 T/(D W) is the coefficient of sliding friction of a bit as Pessier &
Fear (SPE 24584, 1992) define it. The ranges that are usual here are judgement, wide on
purpose: no published table covers roller cones, and those of PDC bits depend on cutters and
rock."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

from nsdrill.models.drilling import Drilling
from nsdrill.models.leaves import Values, chosen_at
from nsdrill.models.numbers import FormatValue
from nsdrill.models.operation import Operation

LOBES_OF_CONES = 3
BY_FRICTION = "multiply {keys} by {most} {factor:.2g}, or fit them to a torque that was measured."
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


def operated(study: Any, corners: Sequence[Values]) -> tuple[Any, Operation]:
    """The parameters and the operating point of a ``study`` with these ``corners``, at a
    depth that its axes have."""
    parameters, _, _ = chosen_at(study.parameters, study.initial, {})
    return parameters, replace(study.operation, depth=corners[0].point.depth)


def aggressive(
    here: tuple[Usual, Drilling],
    found: Sequence[tuple[Usual, Drilling]],
    format_value: FormatValue,
    remedy: str = BY_FRICTION,
    keys: str = FRICTION,
) -> str | None:
    """The warning of a torque of the bit that is unusual at the operating point of a study
    (``here``), or at each end of its axes (``found``); None where it is not."""
    usual, one = here
    value = one.aggressiveness
    where = f" at {format_value(one.wob, 'N', 'kN')} and {format_value(one.set_speed, 'rad/s', 'rad/s')}"
    ends = "" if value is None else f"{value:.2g}{where}"
    if value is None or value <= 0.0 or usual.off(value) <= 1.0:
        pairs = [(kind, its) for kind, each in found if (its := each.aggressiveness)]
        if not pairs or any(kind.off(its) <= 1.0 for kind, its in pairs):
            return None
        usual, value = min(pairs, key=lambda pair: pair[0].off(pair[1]))
        values = [its for _, its in pairs]
        ends = " to ".join(dict.fromkeys(f"{end(values):.2g}" for end in (min, max)))
    is_high = value > usual.high
    factor, most = (usual.high / value, "at most") if is_high else (usual.low / value, "at least")
    return (
        f"{'Aggressive' if is_high else 'Blunt'}: the torque of the bit, 36 T/(D W), is {ends}, and usual of "
        f"{usual.bits} is {usual.low:g} to {usual.high:g}, a judgement: what was measured in an offset well counts "
        f"more. It decides where stick-slip ends: {remedy.format(keys=keys, most=most, factor=factor)}"
    )
