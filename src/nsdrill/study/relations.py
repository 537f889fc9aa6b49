"""What several values of a study must satisfy together. Each fault names the key that the user wrote."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import Any

from nsdrill.errors import Fault
from nsdrill.models.christoforou_yigit.parameters import WIDEST_BORE, deepest
from nsdrill.models.operation import LARGEST_FORCE
from nsdrill.ranges import bound_text
from nsdrill.study.document import Document, KeyPath, dotted
from nsdrill.study.keys import SLICE, Leaf, shown
from nsdrill.study.resolved import refined_axes
from nsdrill.units import USUAL, format_quantity
from nsdrill.variables import AXES, DRIVEN_STATE_NAMES

MOST_POINTS = 10**8
MOST_STARTS = 10**5  # of one operating point: they are compared with each other

# (lower key, upper key, True where they may be equal, the key to blame where both are given); of a bore the upper one
# counts WIDEST_BORE times
_ORDER: tuple[tuple[str, str, bool, str], ...] = (
    ("drillstring.collar.inner_diameter", "drillstring.collar.outer_diameter", True, "lower"),
    ("drillstring.collar.span", "drillstring.collar.length", True, "lower"),
    ("drillstring.pipe.inner_diameter", "drillstring.pipe.outer_diameter", True, "lower"),
    ("drillstring.collar.outer_diameter", "well.diameter", False, "upper"),
    ("well.friction.dynamic", "well.friction.static", True, "lower"),
    ("stabilizer.friction.dynamic", "stabilizer.friction.static", True, "lower"),
    ("bit.friction.dynamic", "bit.friction.static", True, "lower"),
    ("classify.stick_slip.oscillation_index", "classify.stick_slip.medium_index", False, "upper"),
    ("classify.stick_slip.medium_index", "classify.stick_slip.stall_index", False, "upper"),
    ("classify.stick_slip.stall_index", "classify.stick_slip.severe_index", False, "upper"),
    ("classify.bit_bounce.light_fraction", "classify.bit_bounce.moderate_fraction", False, "upper"),
    ("classify.bit_bounce.moderate_fraction", "classify.bit_bounce.strong_fraction", False, "upper"),
    ("classify.bit_bounce.strong_fraction", "classify.bit_bounce.severe_fraction", False, "upper"),
    ("classify.whirl.light_acceleration", "classify.whirl.moderate_acceleration", False, "upper"),
    ("classify.whirl.moderate_acceleration", "classify.whirl.strong_acceleration", False, "upper"),
    ("classify.whirl.strong_acceleration", "classify.whirl.severe_acceleration", False, "upper"),
    ("drillstring.collar.length", "operation.depth", False, "upper"),
)


_ALWAYS = ("inertia", "shaft_damping")
# The keys of the drive that each kind reads.
READ_BY: dict[str, tuple[str, ...]] = {
    "ideal": (),
    "stiff": _ALWAYS,
    "soft_torque": (*_ALWAYS, "matching", "frequency", "compensated_inertia"),
    "equal_damping": _ALWAYS,
    "z_torque": (*_ALWAYS, "a", "high_pass"),
    "lqr": (*_ALWAYS, "state_weight", "torque_weight"),
    "pi": (*_ALWAYS, "stiffness", "damping", "twist_gain", "speed_gain"),
}


# What only the motion of a mode depends on: its start, and numbers of the string.
FROZEN: dict[str, tuple[str, ...]] = {
    "axial": ("initial.z", "initial.vz", "bit.surface_amplitude", "drillstring.axial_damping"),
    "torsional": ("initial.twist", "initial.bit_speed", "drillstring.torsional_damping"),
    "lateral": (
        "initial.x",
        "initial.y",
        "initial.vx",
        "initial.vy",
        "drillstring.eccentricity",
        "drillstring.collar.span",
        "well.stiffness",
        "well.friction.static",
        "well.friction.dynamic",
        "well.friction.smoothing",
        "well.friction.decay",
        "mud.density",
        "mud.added_mass",
        "mud.drag",
        "mud.swirl",
        "well.inclination",
        "stabilizer.clearance",
    ),
}
# Switches and numbers that are nothing but forces on a collar that moves: with a frozen mode they have no meaning.
OFF: dict[str, dict[str, Any]] = {
    "axial": {"well.axial_friction": False},
    "torsional": {},
    "lateral": {
        "mud.swirl": 0.0,
        "well.inclination": 0.0,
        "well.axial_friction": False,
        "stabilizer.clearance": None,
    },
}


class Checker:
    """Checks the relations of one study: ``resolved`` is complete, ``faulty`` holds the keys already known to be wrong
    (their values are stand-ins, so nothing is said about them)."""

    def __init__(
        self, document: Document, resolved: dict[str, Any], leaves: dict[str, Leaf], faulty: Iterable[str] = ()
    ) -> None:
        self.document, self.resolved, self.leaves = document, resolved, leaves
        self.faulty = tuple(faulty)

    def faults(self) -> Iterator[Fault]:
        """All of them."""
        yield from self.order()
        yield from self._depths()
        yield from self._initial()
        yield from self._starts()
        yield from self._modes()
        yield from self._drive()
        yield from self._stabilizer()
        yield from self._exponent()
        yield from self._sweep()

    def order(self, section: str = "") -> Iterator[Fault]:
        """Pairs of values of which one must be the smaller; only those of ``section`` where it is given."""
        for lower, upper, equal, blamed in _ORDER:
            if not lower.startswith(section) or not self._sound(lower, upper):
                continue
            if upper == "operation.depth" and self._ramp_of_depth():
                continue  # every knot of it is looked at
            # The values of their own sections, but for a default that an axis replaces; then the axes' ends.
            if not any(self._axis(key) and not self._given(key) for key in (lower, upper)):
                yield from self._in_order(lower, upper, equal, blamed, swept=False)
            if (self._axis(lower) or self._axis(upper)) and self._axis(upper) != "depth":
                yield from self._in_order(lower, upper, equal, blamed, swept=True)

    def _in_order(self, lower: str, upper: str, equal: bool, blamed: str, swept: bool) -> Iterator[Fault]:
        """Whether ``lower`` is less than ``upper``; with ``swept`` at all values of their axes."""
        factor = WIDEST_BORE if lower.endswith("inner_diameter") else 1.0
        small = self._ends(lower)[1] if swept else self._value(lower)
        big = factor * (self._ends(upper)[0] if swept else self._value(upper))
        if small < big or (equal and small == big):
            return
        first, second = (lower, upper) if blamed == "lower" else (upper, lower)
        mine = self._axis if swept else self._given
        if not mine(first) and mine(second):
            first, second = second, first
        words = ("at most" if equal else "below") if first == lower else ("at least" if equal else "above")
        if factor != 1.0:
            words += f" {factor if first == lower else 1 / factor:.4g} times"
        ends = {lower: 1, upper: 0} if swept else {lower: None, upper: None}
        found = self._text(first, ends[first])
        allowed = f"{words} {second}, which is {self._text(second, ends[second])}"
        axis = self._axis(first) if swept else None
        yield (
            self.fault(f"sweep.{axis}", found, allowed, ("sweep", axis))
            if axis
            else (self.fault(first, found, allowed))
        )

    def _axis(self, key: str) -> str | None:
        """The axis of the sweep that varies ``key``, if one does."""
        name = key.removeprefix("operation.")
        return name if name in self.resolved.get("sweep", {}) and self._sound(f"sweep.{name}") else None

    def _ends(self, key: str) -> tuple[float, float]:
        """The least and the greatest value of ``key``, which are one where it is not swept."""
        axis = self._axis(key)
        if axis is None:
            return self._value(key), self._value(key)
        values = self.resolved["sweep"][axis]
        return (values["from"], values["to"]) if isinstance(values, dict) else (values[0], values[-1])

    def _depths(self) -> Iterator[Fault]:
        """Swept depths reach below the collars."""
        axis = self.resolved["sweep"].get("depth")
        yield from self._below_the_collars(
            [(("operation", "depth", "ramp", i, 1), value) for i, value in enumerate(self._ramp_of_depth())]
        )
        if axis is None or not self._sound("sweep.depth", "drillstring.collar.length"):
            return
        raw = self._raw(("sweep", "depth"))
        if isinstance(axis, dict):
            name = min(("from", "to"), key=lambda end: axis[end])
            places: list[tuple[KeyPath, float]] = [(("sweep", "depth", self._end(raw, name, axis)), axis["from"])]
        elif isinstance(raw, list):
            places = [(("sweep", "depth", index), value) for index, value in self._list_order(raw)]
        else:
            places = [(("sweep", "depth"), axis[0])]
        yield from self._below_the_collars(places)

    def _ramp_of_depth(self) -> list[float]:
        """The depths of its knots, if it has a ramp."""
        _, values = self.resolved.get("ramps", {}).get("depth", ([], []))
        return list(values)

    def _below_the_collars(self, places: list[tuple[KeyPath, float]]) -> Iterator[Fault]:
        if not self._sound("drillstring.collar.length"):
            return
        length = self._ends("drillstring.collar.length")[1]
        allowed = f"more than the length of the collars, {self._text('drillstring.collar.length', 1)}"
        for path in [path for path, value in places if value <= length][:10]:
            yield self.fault(dotted(path), shown(self._raw(path)), allowed, path)

    def _end(self, raw: Any, name: str, axis: dict[str, Any]) -> str:
        """The key under which the user wrote the smaller end: from and to may stand the other way round."""
        leaf = self.leaves["operation.depth"]
        return name if leaf.read(raw[name]) == axis[name] else "to"

    def _list_order(self, raw: list[Any]) -> list[tuple[int, float]]:
        leaf = self.leaves["operation.depth"]
        return [(index, leaf.read(item)) for index, item in enumerate(raw)]

    def _initial(self) -> Iterator[Fault]:
        """The collar starts inside the hole, or on its wall: no deeper in it than the greatest force presses."""
        keys = (
            "initial.x",
            "initial.y",
            "well.diameter",
            "drillstring.collar.outer_diameter",
            "well.stiffness",
            "well.law",
        )
        if not self._sound(*keys):
            return
        gap = (self._ends("well.diameter")[0] - self._ends("drillstring.collar.outer_diameter")[1]) / 2
        plane = self._value(SLICE)
        reach = {
            name: max(abs(plane[name]["from"]), abs(plane[name]["to"]))
            if name in plane
            else max(map(abs, self._ends(f"initial.{name}")))
            for name in ("x", "y")
        }
        radius = math.hypot(reach["x"], reach["y"])
        room = gap + deepest(self._ends("well.stiffness")[1], self._value("well.law"))
        if gap <= 0.0 or radius <= room:
            return
        allowed = (
            f"at most {format_quantity(room, 'mm')}: the gap between collar and wall, {format_quantity(gap, 'mm')}, "
            f"and as deep into the wall as {format_quantity(LARGEST_FORCE, 'MN')} press"
        )
        if not plane.keys().isdisjoint(reach):
            yield self.fault(SLICE, f"starts as far as {format_quantity(radius, 'mm')} off the axis", allowed)
        else:
            key = next((key for key in keys if self._given(key)), keys[0])
            key = next((key for key in keys if self._axis(key)), key)
            low, high = self._ends(key) if self._axis(key) else (0.0, 0.0)
            text = self._text(key, int(key != "well.diameter" and (key not in keys[:2] or abs(high) >= abs(low))))
            found = f"{text}, with which the collar starts {format_quantity(radius, 'mm')} off the axis"
            yield self.fault(key, found, allowed, ("sweep", key) if self._axis(key) else None)

    def _starts(self) -> Iterator[Fault]:
        """An ensemble or a slice, not both, without carried state, and nothing given that it would not use."""
        plane, count = self._value(SLICE), self._value("initial.ensemble")
        if any(bad.startswith((SLICE, "initial.ensemble")) for bad in self.faulty) or (not plane and count < 2):
            return
        key = SLICE if plane else "initial.ensemble"
        if plane and count > 1:
            yield self.fault("initial.ensemble", f"{count} beside initial.slice", "one of the two")
            return
        if plane and len(plane) != 2:
            yield self.fault(SLICE, f"{len(plane)} of them ({', '.join(plane)})", "two states")
            return
        if self._starts_of_a_point() > MOST_STARTS:
            found = f"{self._starts_of_a_point():.3g} starts of every operating point"
            yield self.fault(key, found, f"at most {bound_text(MOST_STARTS)}")
        procedure = self.resolved["sweep"]["procedure"]
        if procedure != "same" and self._sound("sweep.procedure"):
            found = f"starts of their own at every point, with sweep.procedure: {procedure}, which carries the state on"
            yield self.fault(key, found, "with sweep.procedure: same")
        drawn = plane if plane else [name for name in DRIVEN_STATE_NAMES if f"initial.{name}" in self.leaves]
        for name in drawn:
            leaf = self.leaves[f"initial.{name}"]
            if self._given(leaf.key) and self._sound(leaf.key) and self._value(leaf.key) != leaf.default:
                what = "which initial.slice varies" if plane else "with an ensemble, which draws all states"
                yield self.fault(leaf.key, f"{self._text(leaf.key)}, {what}", "left out")

    def _modes(self) -> Iterator[Fault]:
        """Some mode is free, and no value and no axis is of a frozen one alone."""
        if not self._sound("modes", "drive"):
            return
        stay = [name for name in FROZEN if self._value(f"modes.{name}") == "frozen"]
        if len(stay) == len(FROZEN):
            yield self.fault("modes", "all of them frozen", "at least one free")
            return
        if "torsional" in stay and self._value("drive.kind") != "ideal":
            yield self.fault("drive.kind", f"{self._value('drive.kind')} with modes.torsional: frozen", "ideal")
        for mode in stay:
            for key in FROZEN[mode]:
                what = f"which modes.{mode}: frozen does without"
                if self._axis(key):
                    yield self.fault(
                        f"sweep.{key}",
                        f"an axis over {key}, {what}",
                        "a number that changes the motion",
                        ("sweep", key),
                    )
                elif key.startswith("initial.") and self._given(key) and self._value(key) != self.leaves[key].default:
                    yield self.fault(key, f"{self._text(key)}, {what}", "left out")

            for key, off in OFF[mode].items():
                if self._sound(key) and self._value(key) != off and not self._axis(key):
                    found = "true" if self._value(key) is True else self._text(key)
                    yield self.fault(key, f"{found}, which modes.{mode}: frozen does without", "left out")

    def _stabilizer(self) -> Iterator[Fault]:
        """Stabilisers that touch before the collar does, and no friction of stabilisers without a clearance."""
        clearance = "stabilizer.clearance"
        if not self._sound("stabilizer"):
            return
        if self._value(clearance) is None and not self._axis(clearance):
            allowed = "left out, or with a stabilizer.clearance: 0 mm stands for stabilisers without room"
            for key, leaf in self.leaves.items():
                if not key.startswith("stabilizer.friction."):
                    continue
                if axis := self._axis(key):
                    found = "an axis over friction of stabilisers that stabilizer.clearance: null does without"
                    yield self.fault(f"sweep.{axis}", found, allowed, ("sweep", axis))
                elif self._value(key) != leaf.default:
                    found = f"{self._text(key)}, which stabilizer.clearance: null does without"
                    yield self.fault(key, found, allowed)
            return
        keys = ("well.diameter", "drillstring.collar.outer_diameter")
        if not self._sound(*keys) or (axis := self._axis(clearance)) and not self._sound(f"sweep.{axis}"):
            return
        gap = (self._ends(keys[0])[0] - self._ends(keys[1])[1]) / 2
        if 0.0 < gap <= self._ends(clearance)[1]:
            axis = self._axis(clearance)
            allowed = f"below the gap between collar and wall, {format_quantity(gap, 'mm')}: stabilisers touch first"
            found = self._text(clearance, 1)
            key = f"sweep.{axis}" if axis else clearance
            yield self.fault(key, found, allowed, ("sweep", axis) if axis else None)

    def _exponent(self) -> Iterator[Fault]:
        """No Lyapunov exponent of equations that have no linearised ones here."""
        if not self._sound("record", "stabilizer", "well") or not self._value("record.exponent"):
            return
        without = {
            "stabilizer.clearance": self._value("stabilizer.clearance") is not None
            or self._axis("stabilizer.clearance"),
            "well.axial_friction": self._value("well.axial_friction"),
        }
        for key, there in without.items():
            if there:
                found = f"true with {key}, whose equations are not linearised"
                yield self.fault("record.exponent", found, f"false; or without {key}")

    def _drive(self) -> Iterator[Fault]:
        """No value and no axis that the kind of drive does not read."""
        if not self._sound("drive"):
            return
        kind = self._value("drive.kind")
        allowed = f"what a drive of the kind {kind} reads: {', '.join(READ_BY[kind]) or 'nothing'}"
        for key, leaf in self.leaves.items():
            name = key.removeprefix("drive.")
            of_drive = name != key and name != "kind" and name not in READ_BY[kind]
            of_start = key in ("initial.lag", "initial.drive_speed") and kind == "ideal"
            if not (of_drive or of_start):
                continue
            if self._axis(key):
                yield self.fault(
                    f"sweep.{key}", f"an axis over a key that the drive {kind} does not read", allowed, ("sweep", key)
                )
            elif self._value(key) != leaf.default:
                yield self.fault(key, f"{self._text(key)}, which the drive {kind} does not read", allowed)
        taken, inertia = "drive.compensated_inertia", "drive.inertia"
        if kind == "soft_torque" and self._ends(taken)[1] >= self._ends(inertia)[0]:
            yield self.fault(taken, self._text(taken, 1), f"below {inertia}, which is {self._text(inertia, 0)}")

    def _sweep(self) -> Iterator[Fault]:
        """At least one axis, not too many points, and an axis along which to carry."""
        sweep = self.resolved["sweep"]
        swept = [axis for axis in sweep if axis not in ("procedure", "along", "refine")]
        if any(key == "sweep" or key.startswith("sweep.") for key in self.faulty):
            return
        if not swept and sweep["procedure"] != "same":
            allowed = f"at least one axis to sweep: {', '.join(AXES)} or another number by its key"
            yield self.fault("sweep", f"no axis along which the state is carried {sweep['procedure']}", allowed)
        if not swept and not sweep["refine"] and sweep["along"] is None:
            return
        for axis in swept:
            if axis.startswith("initial.") and self._starts_of_a_point() > 1:
                yield self.fault(
                    f"sweep.{axis}", "an axis over the start", "no several starts beside it", ("sweep", axis)
                )
        refined, starts = refined_axes(sweep), self._starts_of_a_point()
        total = math.prod(size(sweep[axis], sweep["refine"] if axis in refined else 0) for axis in swept) * starts
        if total > MOST_POINTS:
            of = "over all axes" + (" and starts" if starts > 1 else "") + (", refined" if refined else "")
            yield self.fault("sweep", f"{total:.3g} points {of}", f"at most {bound_text(MOST_POINTS)}")
        if sweep["refine"] and starts > 1:
            allowed = "0 with several starts of each operating point, whose responses may all differ"
            yield self.fault("sweep.refine", str(sweep["refine"]), allowed)
        if sweep["refine"] and not refined:
            allowed = "0, or an axis {from, to, points}"
            if sweep["along"] is not None:
                allowed += f" beside {sweep['along']}, along which the state is carried point by point"
            yield self.fault("sweep.refine", f"{sweep['refine']}, with no axis to refine", allowed)
        along = sweep["along"]
        if along is not None and along not in swept:
            yield self.fault("sweep.along", f"{along}, which is not swept", f"a swept axis: {' or '.join(swept)}")
        elif along is None and sweep["procedure"] != "same" and len(swept) > 1:
            found = f"none, with procedure {sweep['procedure']} and {len(swept)} axes"
            yield self.fault("sweep.along", found, f"the axis along which the state is carried: {' or '.join(swept)}")

    def _starts_of_a_point(self) -> int:
        plane = self._value(SLICE)
        if not self._sound("initial"):
            return 1
        return math.prod(size(axis) for axis in plane.values()) if plane else max(1, self._value("initial.ensemble"))

    def fault(self, key: str, found: str, allowed: str, path: KeyPath | None = None) -> Fault:
        """A fault at the place of ``key``."""
        place = self.document.place(path if path is not None else tuple(key.split(".")))
        if place.override:
            found = f"{found} ({place.override})"
        return Fault(key, found, allowed, place.line, place.column)

    def _sound(self, *keys: str) -> bool:
        return not any(key == bad or key.startswith((f"{bad}.", f"{bad}[")) for key in keys for bad in self.faulty)

    def _given(self, key: str) -> bool:
        return self.document.has(tuple(key.split(".")))

    def _value(self, key: str) -> Any:
        value: Any = self.resolved
        for part in key.split("."):
            value = value[part]
        return value

    def _raw(self, path: KeyPath) -> Any:
        value = self.document.data
        for part in path:
            value = value[part]
        return value

    def _text(self, key: str, end: int | None = None) -> str:
        """The value of ``key`` in words; of a swept one, if ``end`` is 0 or 1, the least or the greatest."""
        if end is not None and (axis := self._axis(key)):
            leaf = self.leaves[key]
            text = leaf.text(self._ends(key)[end]) if leaf.units in USUAL else f"{self._ends(key)[end]:g}"
            return f"{text} at {'the greatest' if end else 'the least'} of sweep.{axis}"
        if self._given(key):
            return shown(self._raw(tuple(key.split("."))))
        leaf = self.leaves[key]
        value = self._value(key)
        text = f"{value:g}" if leaf.units not in USUAL else leaf.text(value)
        return f"{text} (the default)" if value == leaf.default else text


def size(axis: Any, refine: int = 0) -> int:
    """The number of values of a resolved axis."""
    return (int(axis["points"]) - 1) * 2**refine + 1 if isinstance(axis, dict) else len(axis)
