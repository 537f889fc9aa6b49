"""Drives of scripts, for every model with a drive at the top of its string: a torque as a
function of the motion, with states of its own if it has any, and what follows from it:
the keys of a study, the states of a model, and the linear drive, by differentiation.

A function that gives the torque T_m of the motor [N m], and the slopes of its own states
x, reads some of

    lag, drive_speed, twist, bit_speed, set_speed

in the frame of the set point (:mod:`nsdrill.models.drive_laws`), its states, and its
numbers. In a model a state ``wound`` has the name ``drive_wound``. About steady drilling

    T_m = -K_i lag - K_p omega_d - G_t (psi - lag) - G_w omega + c x,   x' = A x + b u

where u are the deviations of the motion.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from functools import cached_property
from types import FunctionType
from typing import Any, NamedTuple

import numpy as np

from nsdrill.data import Array
from nsdrill.equations import plain
from nsdrill.equations.graph import Graph, Node
from nsdrill.equations.passes import Tangents
from nsdrill.equations.trace import Inputs, Named, part
from nsdrill.errors import InputError
from nsdrill.models.bends import SWITCHES, on_all_sides
from nsdrill.models.model_description import Description
from nsdrill.models.operation import Numeric
from nsdrill.models.own import number_rows, row_with_words, sharing_fault, with_rows
from nsdrill.models.registry import described, extend_models
from nsdrill.origin import Origin, check_new_name
from nsdrill.records import dataclass
from nsdrill.units import cf_units
from nsdrill.variables import MODEL, in_trace

SERVED = (MODEL, "beam", "segments", "regenerative", "torsion")  # the models with a drive at the top of the string
MOTION = ("lag", "drive_speed", "twist", "bit_speed")
READ = (*MOTION, "set_speed")
MOST_STATES = 3
# Names that with "drive_" before them are others.
TAKEN = ("speed", "angle", "torque", "acceleration", "stiffness", "damping", "share")
NONE = 1e30  # the scale of a state that does not affect the torque
LINEAR = {"input", "add", "sub", "neg", "mul", "div", "fma"}  # what a linear drive does with what moves
BY_NUMBERS = {"select", "join"}  # and, by a condition of numbers


def row_of(state: str) -> str:
    """The name of a state of a drive among those of a model."""
    return f"drive_{state}"


def lane_of(number: str) -> str:
    """The name of a number of a drive among the lane parameters of a model."""
    return f"drive_number_{number}"


class Linear(NamedTuple):
    """A drive about steady drilling: how its torque [N m] falls with lag, drive speed,
    twist and bit speed, ``gains`` [4]; how it changes with its own states, ``torque``
    [k]; and how the slopes of these change with the motion, ``motion`` [k, 4], and with
    themselves, ``states`` [k, k]."""

    gains: Array
    torque: Array
    motion: Array
    states: Array

    @property
    def of_bit(self) -> bool:
        """Whether the motion of the bit has an effect on it."""
        # the twist is that of the bit less the lag
        return bool(np.any(self.gains[2:]) or np.any(self.motion[:, 2:]))

    @property
    def holds(self) -> bool:
        """Whether it is another one at another angle of the whole string."""
        turned = [self.gains[0] + self.gains[2], *(self.motion[:, 0] + self.motion[:, 2])]
        return bool(np.any(np.abs(turned) > 1e-12 * np.abs(self.gains).max(initial=1e-300)))

    def impedance(self, frequency: Numeric) -> Any:
        """What its states add to its impedance [N m s/rad] at frequencies [rad/s]."""
        w = np.atleast_1d(np.asarray(frequency, dtype=float))
        given = self.motion[:, 1] + self.motion[:, 0] / (1j * w[:, None])  # of a speed
        system = 1j * w[:, None, None] * np.eye(len(self.torque)) - self.states
        found = -np.linalg.solve(system, given[..., None])[..., 0] @ self.torque
        return found if np.ndim(frequency) else found[0]


@dataclass(frozen=True, eq=False)
class OwnDrive:
    """The drive ``name`` of a script, of an ``origin``: a ``function`` that ``reads`` some of the
    motion, with its ``states`` and ``numbers`` by name, each a float with ``units``,
    ``meaning``, ``low``, ``high`` and ``scale``; ``digest`` is that of what it computes."""

    name: str
    function: FunctionType
    reads: tuple[str, ...]
    states: Mapping[str, Any]
    numbers: Mapping[str, Any]
    origin: Origin
    digest: str

    @property
    def number(self) -> int:
        """A whole number for what it computes, an option of a model."""
        return int(self.digest[:12], 16) + 1

    @property
    def place(self) -> str:
        """File, line and name, for messages."""
        return f"{self.origin}: {self.name}"

    @property
    def rows(self) -> tuple[str, ...]:
        """The names of its states in a model."""
        return tuple(map(row_of, self.states))

    @property
    def slopes(self) -> tuple[str, ...]:
        """The names of the rows of their slopes."""
        return tuple(f"{name}_rate" for name in self.rows)

    @property
    def lanes(self) -> tuple[str, ...]:
        """The names of its numbers among the lane parameters."""
        return tuple(map(lane_of, self.numbers))

    @property
    def keys(self) -> tuple[str, ...]:
        """The keys of a study for its numbers."""
        return tuple(f"drive.{name}" for name in self.numbers)

    @property
    def start(self) -> dict[str, float]:
        """Its states at the start."""
        return {row_of(name): float(value) for name, value in self.states.items()}

    def law(self, s: Named, p: Named) -> tuple[Any, dict[str, Any]]:
        """(the torque [N m], the slopes of its states by their names in a model) of the
        states ``s`` and the lane parameters ``p`` of a model."""
        given = {name: getattr(p if name == "set_speed" else s, name) for name in self.reads}
        given |= {name: getattr(s, row_of(name)) for name in self.states}
        given |= {name: getattr(p, lane_of(name)) for name in self.numbers}
        found = part(self.function)(**given)
        if not self.states:
            return found, {}
        torque, slopes = found
        named = slopes if isinstance(slopes, Mapping) else dict(zip(self.states, listed(slopes), strict=True))
        return torque, {row_of(name): named[name] for name in self.states}

    # The linear drive.

    @cached_property
    def _changes(self) -> dict[str, Node]:
        graph = Graph()
        s, p = Inputs(graph, (*MOTION, *self.rows), "s"), Inputs(graph, ("set_speed", *self.lanes), "p")
        torque, slopes = self.law(s, p)
        values = {"torque": graph.number(torque), **{name: graph.number(slope) for name, slope in slopes.items()}}
        found = dict(values)
        for name in (*MOTION, *self.rows):
            changes = Tangents(graph, {graph.input(f"s.{name}"): 1.0}).of(values)
            found |= {f"{row} {name}": change for row, change in changes.items()}
        return found

    @cached_property
    def is_linear(self) -> bool:
        """Whether torque and slopes are linear in the motion and its states, wherever they are: by
        what is done with these, and as their changes do not depend on them."""
        changes, moving = self._changes, set[Node]()
        graph = changes["torque"].graph
        for node in graph.live([changes[row] for row in ("torque", *self.rows)]):
            if not (_is_motion(node) or not moving.isdisjoint(node.args)):
                continue
            if node.op not in LINEAR and not (node.op in BY_NUMBERS and node.args[0] not in moving):
                return False
            moving.add(node)
        slopes = [node for name, node in changes.items() if " " in name]
        return not any(map(_is_motion, graph.live(slopes)))

    @cached_property
    def may_bend(self) -> bool:
        """Whether a condition, or what has one in it, may make it bend somewhere."""
        changes = self._changes
        live = changes["torque"].graph.live([changes[row] for row in ("torque", *self.rows)])
        return not self.is_linear and any(node.op in SWITCHES for node in live)

    @property
    def moving(self) -> tuple[str, ...]:
        """The inputs of its graph, and of those of models, in which it may bend."""
        return tuple(f"s.{name}" for name in (*MOTION, *self.rows))

    def _given(self, at: Mapping[str, Any], numbers: Mapping[str, Any]) -> dict[str, Any]:
        speed = at.get("set_speed", 1.0)
        motion = {"lag": 0.0, "drive_speed": speed, "twist": 0.0, "bit_speed": speed, **self.start, **at}
        given = {f"s.{name}": motion[name] for name in (*MOTION, *self.rows)}
        return {"p.set_speed": speed, **given, **{f"p.{name}": numbers[name] for name in self.lanes}}

    def torque(self, at: Mapping[str, Any], numbers: Mapping[str, Any]) -> Numeric:
        """The torque [N m] at states ``at``, those of the set point unless they are given,
        with these lane parameters."""
        found: Numeric = plain.values({"": self._changes["torque"]}, self._given(at, numbers))[""]
        return found

    def change(self, row: str, column: str, at: Mapping[str, Any], numbers: Mapping[str, Any]) -> Numeric:
        """How the torque, or the slope of a state, changes with a state."""
        found: Numeric = plain.values({"": self._changes[f"{row} {column}"]}, self._given(at, numbers))[""]
        return found

    def linear(self, at: Mapping[str, Any], numbers: Mapping[str, Any]) -> Linear:
        """The linear drive at one point; where it bends there, that of one side."""
        rows, columns = ("torque", *self.rows), (*MOTION, *self.rows)

        def changes(given: Mapping[str, Any]) -> Array:
            wanted = {f"{r} {c}": self._changes[f"{r} {c}"] for r in rows for c in columns}
            found = plain.values(wanted, given)
            return np.array([[float(np.ravel(found[f"{r} {c}"])[0]) for c in columns] for r in rows])

        given, n = self._given(at, numbers), len(MOTION)
        found = on_all_sides(changes, given, self.moving).derivative if self.may_bend else changes(given)
        return Linear(-found[0, :n], found[0, n:], found[1:, :n], found[1:, n:])

    def no_number(self, numbers: Mapping[str, Any]) -> str:
        """What of it is no number about the set point with these lane parameters, in words; empty
        where all of it is one."""
        with np.errstate(all="ignore"):
            found = plain.values(self._changes, self._given({}, numbers))
        for row, name in (("torque", "its torque"), *((row_of(one), f"the slope of {one}") for one in self.states)):
            if not all(np.all(np.isfinite(found[key])) for key in found if key.partition(" ")[0] == row):
                return name
        return ""

    def scales(self, table: Mapping[str, Array], torque: Numeric) -> list[Numeric]:
        """The natural scale of each state: its own, or what changes the torque by this one
        [N m]."""
        found: list[Numeric] = []
        for name, value in self.states.items():
            if value.scale is not None:
                found.append(value.scale)
                continue
            change = np.abs(self.change("torque", row_of(name), {"set_speed": table["set_speed"]}, table))
            found.append(np.where(change > 0.0, torque / np.where(change > 0.0, change, 1.0), NONE))
        return found

    def fastest(self, table: Mapping[str, Array]) -> Array:
        """The fastest rate [1/s] of the drive alone."""
        at, inertia = {"set_speed": table["set_speed"]}, table["per_drive_inertia"]
        stiff = np.sqrt(np.abs(self.change("torque", "lag", at, table) * inertia))
        rates = [stiff, np.abs(self.change("torque", "drive_speed", at, table) * inertia)]
        rates += [np.abs(self.change(row, row, at, table)) for row in self.rows]
        return np.asarray(np.max(np.broadcast_arrays(*rates, table["set_speed"]), axis=0))

    def lag(self, torque: Numeric, twist: Numeric, table: Mapping[str, Any], speed: Numeric) -> Numeric:
        """The lag [rad] at which it gives a torque [N m] at the set speed, the string below
        it twisted by ``twist``, by one step of Newton's method from none; 0 where the lag
        has no effect."""
        at = {"set_speed": speed, "twist": twist}
        slope = np.asarray(self.change("torque", "lag", at, table) + self.change("torque", "twist", at, table))
        return np.where(slope != 0.0, (torque - self.torque(at, table)) / np.where(slope != 0.0, slope, 1.0), 0.0)


def _is_motion(node: Node) -> bool:
    """Whether a node is a state."""
    return node.op == "input" and str(node.extra).startswith("s.")


def listed(slopes: Any) -> tuple[Any, ...]:
    """Slopes in the order of the states; a single one may stand alone."""
    return tuple(slopes) if isinstance(slopes, (tuple, list)) else (slopes,)


# The drives that are known.

_known: dict[str, OwnDrive] = {}
_by_number: dict[int, OwnDrive] = {}


def own_drive(kind: str) -> OwnDrive | None:
    """The drive of a script of this kind, None where there is none."""
    return _known.get(kind)


def own_drives() -> tuple[OwnDrive, ...]:
    """All drives of scripts."""
    return tuple(_known.values())


def number_of(kind: str) -> int:
    """The option of a model for this kind of drive, 0 for one of nsdrill."""
    return _known[kind].number if kind in _known else 0


def numbered(number: int) -> OwnDrive:
    """The drive with this option."""
    return _by_number[number]


def rows_of(number: int) -> tuple[str, ...]:
    """The names of the states of the drive with this option; none for 0."""
    return numbered(number).rows if number else ()


def register_drive(made: OwnDrive) -> None:
    """Make a drive known to this process, in place of an earlier one of the same script.
    InputError where another has its name, or a number of that name is another one."""
    if (before := _known.get(made.name)) is not None:
        check_new_name("a drive", made.name, before.origin, made.origin)
    others = {name: other.numbers for name, other in _known.items() if name != made.name}
    if (fault := sharing_fault(made.numbers, others)) is not None:
        name, other = fault
        raise InputError(
            f"{made.place}: found {name} with another unit or range than in the drive {other} "
            f"({_known[other].place}), and both are the key drive.{name}; allowed: the same, or another name."
        )
    _known[made.name] = _by_number[made.number] = made
    extend_models(SERVED, extended)


def withdraw_drives(*kinds: str) -> None:
    """Make drives of scripts unknown again; those that are not known are passed over."""
    for kind in kinds:
        _known.pop(kind, None)
    extend_models(SERVED, extended)


# What the models say of them.


def numbers_taken() -> set[str]:
    """The keys that the section ``drive`` of some model has without the drives of
    scripts."""
    own = {name for other in _known.values() for name in other.numbers}
    keys: set[str] = set()
    for model in SERVED:
        section = described(model).sections["drive"]
        keys |= {item.name for item in fields(section)} - own
    return keys


def extended(description: Description) -> Description:
    """The description of a model with the drives of scripts among its own."""
    if not _known:
        return description
    section = description.sections["drive"]
    rows = [row_with_words(section, "kind", _known)]
    rows += number_rows("kind", {name: one.numbers for name, one in _known.items()}, lane_of)
    states = {
        row: in_trace(row, cf_units(v.units), v.meaning or f"{name} of the drive", row)
        for one in _known.values()
        for row, (name, v) in zip(one.rows, one.states.items(), strict=True)
    }
    usual, allowed = description.state_sets, description.states_allowed

    def are_allowed(found: tuple[str, ...]) -> bool:
        for one in _known.values():
            end = len(found) - 1
            if one.states and found[end - len(one.rows) : end] == one.rows:
                found = (*found[: end - len(one.rows)], *found[end:])
                break
        return found in usual or (allowed is not None and allowed(found))

    return replace(
        description,
        parameters=with_rows(description.parameters, ("drive",), rows),
        own_trace=(*description.own_trace, *states.values()),
        states_allowed=are_allowed,
    )
