"""The blades of a drag bit and the rock that they cut, as a study gives them, once for every
model that has such a rock (:mod:`nsdrill.models.surface`)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import fields
from typing import Any, Literal

from nsdrill.errors import Fault
from nsdrill.models.rules import Reads, Rule
from nsdrill.ranges import Checked, choice, parameter
from nsdrill.records import dataclass

MOST_STATES = 40
SURFACES = range(2, MOST_STATES + 1)  # numbers of states that a surface may have
WIDEST_FLAT = 0.016  # m, the diameter of a common cutter


@dataclass(frozen=True)
class Blades(Checked):
    """The blades of a drag bit and the rock that they cut."""

    blades: int = parameter(
        6, "", "a common bit", "modelling choice", low=1, high=20, usual="3 to 8", meaning="Number of blades"
    )
    specific_energy: float = parameter(
        60e6,
        "Pa",
        "Richard, Germay & Detournay 2007",
        "low: sweep it",
        low=1e3,
        high=1e11,
        usual="5 to 200 MPa",
        meaning="Intrinsic specific energy of the rock: the work of cutting per volume",
    )
    zeta: float = parameter(
        0.6,
        "",
        "Richard, Germay & Detournay 2007",
        "medium",
        low=1e-3,
        high=10.0,
        usual="0.5 to 0.8",
        meaning="Force along the hole over the cutting force",
    )
    contact_stress: float = parameter(
        60e6,
        "Pa",
        "Richard, Germay & Detournay 2007",
        "low",
        high=1e11,
        usual="that of the specific energy",
        meaning="Contact stress under the wear flats",
    )
    wear_length: float = parameter(
        1.5e-3,
        "m",
        "a bit that is little worn",
        "low: sweep it",
        high=10.0,
        usual="0 (sharp) to 10 mm",
        meaning="Length of the wear flats of all blades together",
    )
    friction: float = parameter(
        0.6,
        "",
        "Richard, Germay & Detournay 2007",
        "medium",
        high=10.0,
        usual="0.2 to 0.8",
        meaning="Coefficient of friction under the wear flats",
    )
    geometry: float = parameter(
        1.0,
        "",
        "Richard, Germay & Detournay 2007",
        "medium",
        high=10.0,
        usual="1 (flat) to 1.3",
        meaning="Lever of the wear flats over half the radius of the bit",
    )
    states: int = parameter(
        12,
        "",
        "R: a bounce to 0.5 %",
        "modelling choice",
        low=2,
        high=MOST_STATES,
        usual="8 to 24: check says how many",
        meaning="Number of states of the surface between two blades",
    )
    smoothing: float = parameter(
        50.0,
        "s/rad",
        "R",
        "low",
        low=1e-3,
        high=1e9,
        usual="10 to 1000 s/rad",
        meaning="Steepness of the sign change of the torque at zero bit speed; larger is steeper",
    )
    wear_smoothing: float = parameter(
        20.0,
        "",
        "R",
        "modelling choice",
        low=5.0,
        high=1e6,
        usual="10 to 100",
        meaning="Steepness of the force under the wear flats, per rate of penetration",
    )
    contact_smoothing: float = parameter(
        25.0,
        "",
        "R",
        "modelling choice",
        low=2.0,
        high=1e6,
        usual="10 to 100",
        meaning="Steepness with which the wear flats begin to bear, per depth of cut",
    )


@dataclass(frozen=True)
class RockLaw(Checked):
    """What the bit meets: lobes on an elastic rock, or the surface that its blades leave."""

    law: Literal["lobed", "regenerative"] = choice("lobed", "P")


@dataclass(frozen=True)
class Rock(Blades, RockLaw):
    """The rock, and the blades of a bit that cuts what its last blade left."""

    @property
    def regenerative(self) -> bool:
        """Whether the bit cuts what its last blade left."""
        return self.law == "regenerative"


# The keys of the rock that each law reads.
ROCK = Reads(
    "bit.rock.law",
    "the rock",
    "a rock that is",
    {"lobed": (), "regenerative": tuple(item.name for item in fields(Blades))},
)


def of_the_rock(lobed: Iterable[str]) -> tuple[Rule | Reads, ...]:
    """No value and no axis that the rock of a study does not read: on the surface that the
    blades leave none of the ``lobed`` keys either."""

    def faults(check: Any) -> Iterator[Fault]:
        allowed = "left out: force and torque follow from the keys of bit.rock"
        for key in lobed if check.value(ROCK.choice) == "regenerative" else ():
            yield from check.unread(key, f"which {ROCK.choice}: regenerative does not read", allowed)

    return ROCK, Rule(faults, ROCK.needs)


def of_wear_flats(key: str, wide: str, radii: float) -> Rule:
    """The wear flats, whose length is at ``key``, are no longer than the face of the bit, so
    many times the length at the key ``wide``."""

    def faults(check: Any) -> Iterator[Fault]:
        cuts = ROCK.choice not in check.leaves or check.value(ROCK.choice) == "regenerative"
        if cuts and check.ends(key)[1] > radii * check.ends(wide)[0]:
            allowed = "at most three radii of the bit, with which its whole face is worn flat"
            yield check.fault(check.swept(key), check.text(key, 1), allowed)

    return Rule(faults, (key, wide, *ROCK.needs))
