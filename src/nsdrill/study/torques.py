"""Numbers that a study may give with a unit: the friction of a bit as torques in place of
coefficients. Such a number is another key, ``static_torque`` for ``static``, wherever it
stands."""

from __future__ import annotations

from collections.abc import Iterator

from nsdrill import units as si
from nsdrill.data import Resolved, found_at
from nsdrill.models.registry import of_known_models
from nsdrill.study.forms import Reading
from nsdrill.study.keys import Plain, keys_named, model_leaf, shown
from nsdrill.study.read import Document, KeyPath
from nsdrill.units import QuantityError

AROUND: tuple[KeyPath, ...] = (("sweep",), ("uncertain",), ("uncertain", "table"))
STATIC, DYNAMIC = "bit.friction.static", "bit.friction.dynamic"
PAIR = {STATIC: f"{STATIC}_torque", DYNAMIC: f"{DYNAMIC}_torque"}


@of_known_models
def keys_with_units(model: str) -> dict[str, tuple[str, str]]:
    """The keys of a model whose values with a unit are those of another key: that and its
    units."""
    leaves = keys_named(model).leaves
    found = {key: (one.with_unit, leaves[one.with_unit].units) for key, one in leaves.items() if one.with_unit}
    # a law without these coefficients has the torques by the same keys
    short = {key: (other, leaves[other].units) for key, other in PAIR.items() if other in leaves and key not in leaves}
    return found | short


def _of(document: Document) -> dict[str, tuple[str, str]]:
    named = document.value(("model",))
    return keys_with_units(named if named in model_leaf().choices else model_leaf().default)


def path_with_unit(document: Document, path: KeyPath, raw: Plain) -> KeyPath:
    """The place of a value ``raw`` that is given at ``path``: that of the other key where it
    has the unit of that."""
    for key, (other, units) in _of(document).items():
        itself = path == tuple(key.split("."))
        around = key in path and path[0] in ("sweep", "uncertain")
        if (itself or around) and has_unit(raw, units):
            return tuple(other.split(".")) if itself else tuple(other if part == key else part for part in path)
    return path


def use_keys_with_units(document: Document) -> None:
    """Put every value that has the unit of another key where that belongs."""
    moved = {}
    for key, (other, units) in _of(document).items():
        *section, name = key.split(".")
        if has_unit(document.value((*section, name)), units):
            _rename(document, tuple(section), name, other.rpartition(".")[2])
        for around in AROUND:
            if has_unit(document.value((*around, key)), units):
                _rename(document, around, key, other)
                moved[key] = other
        if has_unit(document.value(("continue", "from")), units) and document.value(("continue", "along")) == key:
            document.data["continue"]["along"] = other
    along = document.value(("sweep", "along"))
    if isinstance(along, str) and along in moved:
        document.data["sweep"]["along"] = moved[along]
    pairs = document.value(("uncertain", "correlations"))
    for pair in pairs if isinstance(pairs, list) else ():
        if isinstance(pair, list):
            pair[:] = [moved.get(one, one) if isinstance(one, str) else one for one in pair]


def has_unit(raw: object, units: str) -> bool:
    """Whether a value, or one of several, has one of these units."""
    if isinstance(raw, dict | list):
        return any(has_unit(one, units) for one in (raw.values() if isinstance(raw, dict) else raw))
    if not isinstance(raw, str):
        return False
    try:
        si.to_si(raw, units)
    except QuantityError:
        return False
    return True


def _rename(document: Document, around: KeyPath, old: str, new: str) -> None:
    """Give a key of a mapping another name; a fault where it has that already."""
    found = document.value(around)
    if new in found:
        words = f"the key a second time, as {new}"
        document.faults.append(document.fault((*around, old), words, "each key once", of_key=True))
    for places in (document.values, document.keys):
        for path in [path for path in places if path[: len(around) + 1] == (*around, old)]:
            places[(*around, new, *path[len(around) + 1 :])] = places.pop(path)
    renamed = {new if key == old else key: value for key, value in found.items()}
    found.clear()
    found.update(renamed)


def by_torque(resolved: Resolved) -> bool:
    """Whether a study gives the friction of its bit as torques."""
    return any(found_at(resolved, key) is not None for key in PAIR.values())


def take_torques(at: Reading, resolved: Resolved, given: Resolved) -> None:
    """Check that both torques are given, or none; one that only varies has a value within
    its range, for a single run."""
    told = {key: [*_places(at, torque)] for key, torque in PAIR.items()}
    if not any(told.values()) or not {*PAIR.values()} <= at.keys.leaves.keys():
        return
    faults = len(at.faults)
    for key, other in ((STATIC, DYNAMIC), (DYNAMIC, STATIC)):
        name = other.rpartition(".")[2]
        allowed = f"a torque, as {name} has: both are torques, or both are coefficients"
        for path in _places(at, key):
            value = at.document.value(path)
            found = shown(value) if isinstance(value, int | float) else "coefficients"
            at.refuse(path, f"{found} beside a torque", allowed)
        if not told[key] and len(at.faults) == faults:
            path = tuple(key.split("."))
            if any(bad in at.faulty for bad in (key, PAIR[key])):
                return
            at.refuse(path, f"nothing, and a torque for {name}", allowed)
    if len(at.faults) > faults or {*PAIR.values()} & at.faulty:
        return
    friction = resolved["bit"]["friction"]
    for key, end in ((STATIC, max), (DYNAMIC, min)):
        torque = PAIR[key]
        if friction[torque.rpartition(".")[2]] is None:
            values = [*_numbers(given.get("sweep", {}).get(torque)), *_numbers(_of_unknown(given, torque))]
            if not values:
                return  # they are at fault
            friction[torque.rpartition(".")[2]] = end(values)
    static, dynamic = (PAIR[key].rpartition(".")[2] for key in (STATIC, DYNAMIC))
    written = [at.document.has(tuple(PAIR[key].split("."))) for key in (STATIC, DYNAMIC)]
    if friction[static] < friction[dynamic] and not all(written):
        changed, kept = (dynamic, static) if written[0] else (static, dynamic)
        friction[changed] = friction[kept]


def _places(at: Reading, key: str) -> Iterator[KeyPath]:
    """Where a study gives this key, as a value, an axis or an unknown."""
    for path in (tuple(key.split(".")), *((*around, key) for around in AROUND)):
        if at.document.has(path) and at.document.value(path) is not None:
            yield path


def _of_unknown(given: Resolved, key: str) -> Plain:
    section = given.get("uncertain", {})
    return section.get(key) or section.get("table", {}).get(key)


def _numbers(value: Plain) -> list[float]:
    """The values of an axis, or the places of a distribution."""
    if isinstance(value, dict):
        return [
            number
            for name, one in value.items()
            if name not in ("points", "spacing", "deviation", "factor")
            for number in _numbers(one)
        ]
    if isinstance(value, list):
        return [number for one in value for number in _numbers(one)]
    return [float(value)] if isinstance(value, int | float) and not isinstance(value, bool) else []
