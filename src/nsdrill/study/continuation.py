"""The section ``continue`` of a study: what is followed by continuation, from where to
where, from which seeds."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from nsdrill.errors import Fault
from nsdrill.models.leaves import is_compiled_in, words_of
from nsdrill.study.keys import Keys, Leaf, did_you_mean, shown
from nsdrill.study.read import Document, KeyPath
from nsdrill.units import QuantityError
from nsdrill.variables import short_key

SECTION = "continue"
KEYS = ("along", "from", "to", "seeds", "motions", "lobes", "switch", "points", "curves")
CURVE_KEYS = ("over", "from", "to", "of", "points")
MOTIONS = ("periodic", "rolling", "stick_slip")
BORDERS = ("lift_off", "wall", "fold", "doubling", "torus", "hopf")
LOBES = (1, 2, 3, 4, 6)
MAX_LOBES = 24
POINTS = Leaf("continue.points", "whole", 400, low=2, high=100_000)
CURVE_POINTS = Leaf("continue.curves.points", "whole", 120, low=2, high=100_000)
SEEDS = 7  # values of the range from which a study without seeds starts
LONGEST_NAME = 4096


@dataclass(frozen=True)
class Curves:
    """Curves of special points in two numbers: ``over`` the second one, from ``low`` to
    ``high`` in SI, ``of`` which borders, with at most so many ``points`` each."""

    over: str
    low: float
    high: float
    of: tuple[str, ...]
    points: int


@dataclass(frozen=True)
class Continuation:
    """What is continued: the number ``along``, by its key, from ``low`` to ``high`` in
    SI; ``seeds`` from the results file of this name, or motions that settle at these
    values of a number, by its key; the ``motions`` that are followed, the ``lobes``
    that are tried as periods; whether to ``switch`` at doublings and branch points;
    ``points`` of a branch at most; ``curves`` in a second number, if any."""

    along: str
    low: float
    high: float
    seeds: str | Mapping[str, list[float]]
    motions: tuple[str, ...]
    lobes: tuple[int, ...]
    switch: bool
    points: int
    curves: Curves | None


def continuation_of(resolved: Mapping[str, Any]) -> Continuation | None:
    """The continuation in a resolved study, None where it has none. KeyError, TypeError
    or ValueError for what is no resolved section."""
    found = resolved.get(SECTION)
    if found is None:
        return None
    curves = found["curves"]
    made = curves and Curves(
        str(curves["over"]),
        float(curves["from"]),
        float(curves["to"]),
        tuple(curves["of"]),
        int(curves["points"]),
    )
    seeds = found["seeds"]
    if not isinstance(seeds, str):
        seeds = {str(key): [float(value) for value in values] for key, values in seeds.items()}
    return Continuation(
        str(found["along"]),
        float(found["from"]),
        float(found["to"]),
        seeds,
        tuple(map(str, found["motions"])),
        tuple(map(int, found["lobes"])),
        bool(found["switch"]),
        int(found["points"]),
        made,
    )


def take_continuation(document: Document, keys: Keys) -> tuple[dict[str, Any] | None, list[Fault]]:
    """The section ``continue`` of the document as plain data in SI, defaults filled in,
    and its faults."""
    if not isinstance(document.data, dict) or SECTION not in document.data:
        return None, []
    return _Reader(document, keys).read()


class _Reader:
    def __init__(self, document: Document, keys: Keys) -> None:
        self.document, self.keys = document, keys
        self.faults: list[Fault] = []

    def fault(
        self,
        path: KeyPath,
        found: str,
        allowed: str,
        hint: str | None = None,
        *,
        of_key: bool = False,
    ) -> None:
        self.faults.append(self.document.fault(path, found, allowed, hint, of_key=of_key))

    def mapping(self, path: KeyPath, data: Any, known: tuple[str, ...]) -> dict[str, Any] | None:
        """``data`` if it is a mapping, without keys that are not ``known``."""
        if not isinstance(data, dict):
            self.fault(path, shown(data), f"a mapping with the keys {', '.join(known)}")
            return None
        for name in data:
            if name not in known:
                hint = did_you_mean(str(name), known)
                self.fault(
                    (*path, str(name)), "an unknown key", ", ".join(known), hint, of_key=True
                )
        return {name: value for name, value in data.items() if name in known}

    def value(self, path: KeyPath, leaf: Leaf, raw: Any) -> Any:
        try:
            return leaf.read(raw)
        except QuantityError as error:
            self.fault(path, error.found, error.allowed, error.suggestion)
            return None

    def axis(self, path: KeyPath, raw: Any) -> Leaf | None:
        """The number of the study with the key ``raw``."""
        axes = {
            name: leaf for name, leaf in self.keys.axes.items() if not name.startswith("initial.")
        }
        name = short_key(raw) if isinstance(raw, str) else raw
        if not isinstance(name, str) or name not in axes:
            hint = did_you_mean(raw, axes) if isinstance(raw, str) else None
            example = self.keys.model.example_axis[0]
            self.fault(
                path,
                shown(raw),
                f"depth, wob, rotary_speed or another number by its key, as {example}",
                hint,
            )
            return None
        if is_compiled_in(self.keys.model.name, name):
            what = "a choice" if words_of(name) else "a whole number that is compiled in"
            hint = f"Make a file for each of its values, with --set {name}=..."
            self.fault(path, f"{name}, {what}", "a number that varies continuously", hint)
            return None
        return axes[name]

    def ends(
        self, path: KeyPath, data: Mapping[str, Any], leaf: Leaf
    ) -> tuple[float, float] | None:
        """The ends of the range, ascending."""
        found = []
        for name in ("from", "to"):
            if name not in data:
                self.fault(path, f"no {name}", "both from and to")
            else:
                found.append(self.value((*path, name), leaf, data[name]))
        if len(found) < 2 or None in found:
            return None
        low, high = sorted(found)
        if high - low <= 1e-6 * max(abs(low), abs(high)):
            self.fault((*path, "to"), "the same value as in from", "from and to that differ")
            return None
        return low, high

    def words(self, path: KeyPath, raw: Any, allowed: tuple[str, ...]) -> list[str]:
        """A list of some of the words ``allowed``."""
        listed = raw if isinstance(raw, list) else [raw]
        if not listed:
            self.fault(path, "an empty list", f"one or more of {', '.join(allowed)}")
        for place, word in enumerate(listed):
            if word not in allowed or not isinstance(word, str):
                hint = did_you_mean(word, allowed) if isinstance(word, str) else None
                at = (*path, place) if isinstance(raw, list) else path
                self.fault(at, shown(word), f"one or more of {', '.join(allowed)}", hint)
        return [word for word in allowed if word in listed]

    def lobes(self, path: KeyPath, raw: Any) -> list[int]:
        listed = raw if isinstance(raw, list) else [raw]
        leaf = Leaf("continue.lobes", "whole", 1, low=1, high=MAX_LOBES)
        if not listed:
            self.fault(path, "an empty list", "the periods to try, in lobes, as [1, 2, 3]")
        read = [
            self.value((*path, place) if isinstance(raw, list) else path, leaf, one)
            for place, one in enumerate(listed)
        ]
        return sorted({one for one in read if one is not None})

    def seeds(
        self, path: KeyPath, raw: Any, along: str, leaf: Leaf, ends: tuple[float, float]
    ) -> Any:
        if isinstance(raw, str):
            if not raw.strip() or "\0" in raw or len(raw) > LONGEST_NAME:
                self.fault(path, shown(raw), "the name of a results file")
            return raw
        if raw is None:
            low, high = ends
            return {along: [low + (high - low) * (k + 0.5) / SEEDS for k in range(SEEDS)]}
        allowed = (
            f"the name of a results file, or values at which a motion settles, as {{{along}: "
            f"[VALUE, VALUE]}}"
        )
        if not isinstance(raw, dict) or len(raw) != 1:
            self.fault(path, shown(raw), allowed)
            return {}
        ((key, values),) = raw.items()
        if key != along:
            self.fault(
                (*path, str(key)),
                "another number than that which is continued",
                allowed,
                of_key=True,
            )
            return {}
        listed = values if isinstance(values, list) else [values]
        made = []
        for place, one in enumerate(listed):
            at = (*path, key, place) if isinstance(values, list) else (*path, key)
            value = self.value(at, leaf, one)
            if value is not None and not ends[0] <= value <= ends[1]:
                self.fault(at, f"{shown(one)}, outside the range", "values between from and to")
            made.append(value)
        if not made:
            self.fault((*path, key), "an empty list", "at least one value")
        return {along: [value for value in made if value is not None and math.isfinite(value)]}

    def read(self) -> tuple[dict[str, Any] | None, list[Fault]]:
        path: KeyPath = (SECTION,)
        raw = self.document.data[SECTION]
        data = self.mapping(path, {} if raw is None else raw, KEYS)
        if data is None:
            return None, self.faults
        if "along" not in data:
            self.fault(
                path,
                "no along",
                "along: the number that is continued, as rotary_speed; from and to",
            )
            return None, self.faults
        leaf = self.axis((*path, "along"), data["along"])
        if leaf is None:
            return None, self.faults
        along = short_key(leaf.key)
        ends = self.ends(path, data, leaf)
        if ends is None:
            return None, self.faults
        switch = data.get("switch", True)
        if not isinstance(switch, bool):
            self.fault((*path, "switch"), shown(switch), "true or false")
        made = {
            "along": along,
            "from": ends[0],
            "to": ends[1],
            "seeds": self.seeds((*path, "seeds"), data.get("seeds"), along, leaf, ends),
            "motions": self.words((*path, "motions"), data.get("motions", list(MOTIONS)), MOTIONS),
            "lobes": self.lobes((*path, "lobes"), data.get("lobes", list(LOBES))),
            "switch": switch,
            "points": self.value((*path, "points"), POINTS, data.get("points", POINTS.default)),
            "curves": self.curves((*path, "curves"), data.get("curves"), along),
        }
        return (None if self.faults else made), self.faults

    def curves(self, path: KeyPath, raw: Any, along: str) -> dict[str, Any] | None:
        if raw is None:
            return None
        data = self.mapping(path, raw, CURVE_KEYS)
        if data is None:
            return None
        if "over" not in data:
            self.fault(path, "no over", "over: the second number, as wob; from and to")
            return None
        leaf = self.axis((*path, "over"), data["over"])
        if leaf is None:
            return None
        over = short_key(leaf.key)
        if over == along:
            self.fault(
                (*path, "over"), f"{over}, which is continued already", "another number than along"
            )
            return None
        ends = self.ends(path, data, leaf)
        if ends is None:
            return None
        return {
            "over": over,
            "from": ends[0],
            "to": ends[1],
            "of": self.words((*path, "of"), data.get("of", list(BORDERS)), BORDERS),
            "points": self.value(
                (*path, "points"), CURVE_POINTS, data.get("points", CURVE_POINTS.default)
            ),
        }
