"""A validated study: plain frozen data in SI units; and the resolved study, complete plain
data, from which a :class:`Study` is built, always in this one way.

The resolved study is kept in results files; a replay builds the very same study from
it, bit for bit. No units, no YAML.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import field, fields, is_dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, TypeVar, get_args

import numpy as np

from nsdrill.data import Resolved, found_at
from nsdrill.errors import FileError
from nsdrill.kernel.settings import Simulation
from nsdrill.models.choices import words_of
from nsdrill.models.model_description import Description
from nsdrill.models.operation import OperatingPoint, Ramp
from nsdrill.models.registry import speak_of
from nsdrill.models.responses import Thresholds
from nsdrill.models.starts import Starts
from nsdrill.models.tree import marked, value_of
from nsdrill.observe.thresholds import Record
from nsdrill.ranges import MAX_POINTS, check_fields
from nsdrill.records import dataclass
from nsdrill.study.continuation import SECTION, Continuation, continuation_of
from nsdrill.study.forms import axis_values
from nsdrill.study.keys import Keys, Leaf, keys_named, model_leaf
from nsdrill.study.uncertain import draws, uncertain_of, unknown_keys
from nsdrill.variables import AXES, Axis, Unknown, long_key

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

T = TypeVar("T", bound="DataclassInstance")
Procedure = Literal["same", "up", "down", "up-down", "all"]


class Studied:
    """What has a study of its own, as a model of a script: taken where a study is."""

    def study(self) -> Study:
        """That study."""
        raise NotImplementedError


@dataclass(frozen=True, eq=False)
class Study:
    """One study, which :func:`load_study` makes.

    Two are equal that have the same ``sha256``: their sweeps have the same numbers,
    whatever their title and units.

    Attributes
    ----------
    title, text, sha256 : str
        The title; the YAML as read; the digest of the complete study.
    model, keys
        The model of the string, whose name is ``model.name``, and the keys of its studies.
    axes : dict of arrays
        The values of the operating point, of a drill string depth [m], wob [N] and
        rotary_speed [rad/s], each a 1-D ascending float array, of length one (from
        ``operation``) where it is not swept, and the other numbers that are swept by their
        dotted keys. ``more`` describes those but for the three of a drill string.
    swept : tuple of str
        The names that the file sweeps.
    along : str or None
        The axis along which the state is carried; None for procedure ``same``.
    ramps : dict
        Those of the operation that follow time in a single run; their values at time
        zero are in ``operation``.
    overrides, resolved : tuple of str, dict
        The ``--set`` texts; the complete study, defaults filled in and in SI, as plain
        data.
    refined, refine : tuple of str, int
        The axes whose values are those of a grid refined ``refine`` times, of which
        every ``2**refine``-th is run first.
    drawn, unknowns : dict of arrays, tuple
        The samples [samples] of the uncertain numbers by key, and their description; a
        single simulation takes the values of their own sections.
    continuation
        The section ``continue``, None where there is none.
    notes : tuple of str
        What is right in the text and yet may not be meant.

    Examples
    --------
    >>> study = nsdrill.load_study("study.yaml")
    >>> study.swept, study.axes["rotary_speed"].size
    (('rotary_speed',), 5)
    """

    title: str
    keys: Keys
    parameters: Any
    operation: Any
    initial: Starts
    axes: dict[str, np.ndarray]
    swept: tuple[str, ...]
    procedure: Procedure
    along: str | None
    simulation: Simulation
    thresholds: Thresholds
    record: Record
    text: str = ""
    source: str = ""
    overrides: tuple[str, ...] = ()
    resolved: Resolved = field(default_factory=dict)
    sha256: str = ""
    refine: int = 0
    refined: tuple[str, ...] = ()
    more: tuple[Axis, ...] = ()
    ramps: dict[str, Ramp] = field(default_factory=dict)
    continuation: Continuation | None = None
    drawn: Mapping[str, np.ndarray] = field(default_factory=dict)
    unknowns: tuple[Unknown, ...] = ()
    notes: tuple[str, ...] = ()

    def __eq__(self, other: object) -> bool:
        return self.sha256 == other.sha256 if isinstance(other, Study) else NotImplemented

    def __hash__(self) -> int:
        return hash(self.sha256)

    @property
    def model(self) -> Description:
        """The model of the string."""
        return self.keys.model

    @property
    def units(self) -> str:
        """The system of units in which commands answer, "si" or "field"."""
        return str(self.resolved.get("units", "si"))

    @property
    def samples(self) -> int:
        """With how many samples of the uncertain numbers each point is run; 0 where no
        number is uncertain."""
        return len(next(iter(self.drawn.values()))) if self.drawn else 0

    @property
    def varied(self) -> dict[str, np.ndarray]:
        """The values of all numbers that differ from run to run, by key: of the axes
        and of the unknowns."""
        return {**self.axes, **self.drawn}

    @property
    def ramped(self) -> tuple[str, ...]:
        """The names of ``ramps`` that no sweep replaces."""
        return tuple(name for name in self.ramps if name not in self.swept)


IN_WORDS_ONLY = ("title", "units")  # keys that change no number


def study_from_resolved(
    resolved: Resolved, text: str = "", source: str = "", overrides: Sequence[str] = (), *, most: int = MAX_POINTS
) -> Study:
    """The study that ``resolved`` describes, with at most ``most`` values of an axis
    and as many samples. :class:`FileError` where it is not a resolved study of this
    version."""
    try:
        speak_of(str(resolved.get("model", "")))
        return replace(_made(resolved, most), text=text, source=source, overrides=tuple(overrides))
    except (KeyError, TypeError, ValueError, AttributeError, IndexError, OverflowError, RecursionError) as error:
        name = source or "the resolved study"
        raise FileError(
            f"{name}: does not hold a study that this version can use ({type(error).__name__}: {error})."
        ) from error


def _made(resolved: Resolved, most: int) -> Study:
    keys = keys_named(model_leaf().read(resolved["model"]))
    resolved = _completed(resolved, keys.model)
    model, sweep = keys.model, resolved["sweep"]
    operation = build(model.point, resolved.get("operation", {}))
    if unknown := set(sweep) - {"procedure", "along", "refine", *keys.axes}:
        raise ValueError(f"sweep: found {', '.join(sorted(unknown))}, which are no axes")
    # The order in which a file names its axes is no part of a study: points are
    # numbered alike in every order.
    swept = tuple(axis for axis in keys.axes if axis in sweep)
    if sweep["procedure"] not in get_args(Procedure) or sweep["along"] not in (None, *swept):
        raise ValueError(f"sweep: found {sweep['procedure']} along {sweep['along']}")
    ramps = {name: Ramp(tuple(times), tuple(values)) for name, (times, values) in resolved.get("ramps", {}).items()}
    if unknown := set(ramps) - set(operation.names()):
        raise ValueError(f"ramps: found {', '.join(sorted(unknown))}, allowed: {', '.join(operation.names())}")
    refined = refined_axes({axis: sweep[axis] for axis in swept} | sweep)
    axes = _axes(keys, sweep, swept, refined, operation, most)
    drawn = _drawn(resolved, keys, axes, most)
    initial = build(model.initial, resolved["initial"])
    if initial.starts and (drawn or sweep["procedure"] != "same"):
        raise ValueError(f"initial: found {initial.starts} starts, with {sweep['procedure']} or uncertain numbers")
    sections: dict[str, object] = {name: build(cls, resolved[name]) for name, cls in model.sections.items()}
    return Study(
        title=str(resolved.get("title", "")),
        keys=keys,
        parameters=model.parameters(**sections),
        operation=operation,
        initial=initial,
        axes=axes,
        swept=swept,
        procedure=sweep["procedure"],
        along=sweep["along"],
        simulation=Simulation(**vars(build(keys.sections["simulation"], resolved["simulation"]))),
        thresholds=build(model.thresholds, resolved["classify"]),
        record=build(Record, resolved["record"]),
        resolved=resolved,
        sha256=digest(as_kept(resolved, model)),
        ramps=ramps,
        continuation=continuation_of(resolved, keys.axes),
        refine=sweep["refine"],
        refined=refined,
        more=tuple(_axis(keys.axes[axis], keys, resolved, axis) for axis in axes if axis not in AXES),
        drawn=drawn,
        unknowns=tuple(Unknown(**vars(_axis(keys.axes[key], keys, resolved, long_key(key)))) for key in drawn),
    )


def _completed(resolved: Resolved, model: Description) -> Resolved:
    """A resolved study with the defaults of numbers that only drives and laws of scripts read,
    which may be unknown where it was made."""
    made = resolved
    for key, (choice, _) in marked(model.parameters, "read_by").items():
        section, _, name = key.rpartition(".")
        if name not in (values := found_at(made, section)):
            follows = marked(model.parameters, "follows").get(key)
            default = value_of(model.parameters(), key) if follows is None else follows.at(values[choice])
            made = _with(made, section, {**values, name: default})
    return made


def as_kept(resolved: Resolved, model: Description) -> Resolved:
    """A resolved study without the numbers of drives and laws of scripts that it does not
    name, as it is kept: what else is known to a process does not change it."""
    kept = resolved
    for key, (choice, words) in marked(model.parameters, "read_by").items():
        section, _, name = key.rpartition(".")
        values, along = found_at(kept, section), resolved["sweep"].get(f"{section}.{choice}", [])
        if not {values[choice], *(along if isinstance(along, list) else [])} & set(words):
            kept = _with(kept, section, {other: value for other, value in values.items() if other != name})
    return kept


def _with(resolved: Resolved, section: str, values: Resolved) -> Resolved:
    """A resolved study with other values of the section at this dotted key."""
    name, _, rest = section.partition(".")
    return {**resolved, name: _with(resolved[name], rest, values) if rest else values}


def _axes(
    keys: Keys, sweep: Resolved, swept: tuple[str, ...], refined: tuple[str, ...], operation: OperatingPoint, most: int
) -> dict[str, np.ndarray]:
    """The values of the axes of the operation, then of the others that are swept.
    ValueError where they are beyond their range."""
    axes = {}
    for axis in dict.fromkeys((*operation.names(), *swept)):
        given, leaf = sweep[axis] if axis in swept else [getattr(operation, axis)], keys.axes[axis]
        values = axis_values(given, sweep["refine"] if axis in refined else 0, most, axis if words_of(axis) else "")
        if not leaf.low <= values[0] <= values[-1] <= leaf.high:
            raise ValueError(f"{axis}: found {values[0]} to {values[-1]}, allowed: {leaf.range()}")
        axes[axis] = values
    return axes


def _drawn(resolved: Resolved, keys: Keys, axes: dict[str, np.ndarray], most: int) -> Mapping[str, np.ndarray]:
    """The samples of the unknowns by key; none where the study has none. ValueError
    where they are not such."""
    if "uncertain" not in resolved:
        return {}
    unknown = uncertain_of(resolved["uncertain"])
    swept = [key for key in unknown.keys if len(axes.get(key, ())) > 1]
    if unknown.runs > most or unknown.samples < 1 or swept:
        raise ValueError(f"uncertain: found {unknown.runs} samples of {', '.join(unknown.keys)}")
    return Drawn(unknown_keys(resolved["uncertain"], keys), lambda: draws(resolved["uncertain"], keys))


class Drawn(Mapping[str, np.ndarray]):
    """The samples of unknowns by key, drawn when one is first read: SciPy's sequences take
    longer to import than all else that most answers need."""

    def __init__(self, keys: Sequence[str], draw: Callable[[], dict[str, np.ndarray]]) -> None:
        self._keys, self._draw = keys, draw

    @cached_property
    def _values(self) -> dict[str, np.ndarray]:
        try:
            return self._draw()
        except ValueError as error:
            raise FileError(f"The resolved study: found unknowns that this version cannot draw ({error}).") from error

    def __getitem__(self, key: str) -> np.ndarray:
        return self._values[key]

    def __iter__(self) -> Iterator[str]:
        return iter(self._keys)

    def __len__(self) -> int:
        return len(self._keys)

    def __reduce__(self) -> tuple[type[dict[str, np.ndarray]], tuple[dict[str, np.ndarray]]]:
        return dict, (self._values,)


def _axis(leaf: Leaf, keys: Keys, resolved: Resolved, key: str) -> Axis:
    return Axis(key, keys.leaf(leaf.key, resolved).units, f"{leaf.meaning} ({leaf.key})")


def build(cls: type[T], data: Resolved) -> T:
    """A tree of dataclasses from nested data with exactly their keys."""
    names = {item.name for item in fields(cls)}
    if set(data) != names:
        raise ValueError(f"{cls.__name__}: found the keys {sorted(data)}, allowed: {sorted(names)}")
    values = {}
    for item in fields(cls):
        made = item.default_factory() if callable(item.default_factory) else None
        value = data[item.name]
        if is_dataclass(made) and not isinstance(made, type):
            value = build(type(made), value)
        elif value is not None and (record := item.metadata.get("record")):
            value = tuple(build(record, one) for one in value)
        elif value is not None and "most" in item.metadata:
            value = tuple(value)
        values[item.name] = value
    made = cls(**values)
    check_fields(made)  # not every class does so itself
    return made


def refined_axes(sweep: Resolved) -> tuple[str, ...]:
    """The axes of a resolved sweep that are refined: those given as {from, to, points},
    but for the one along which the state is carried."""
    if not sweep["refine"]:
        return ()
    return tuple(axis for axis, values in sweep.items() if isinstance(values, dict) and axis != sweep["along"])


def digest(resolved: Resolved) -> str:
    """SHA-256 of what influences the numbers of a sweep: all but the title, the units,
    the continuation, and the values and ramps that swept axes replace."""
    apart = (*IN_WORDS_ONLY, SECTION)
    parts = {name: value for name, value in resolved.items() if name not in apart}
    for key in parts["sweep"]:
        *sections, name = key.split(".") if "." in key else ("operation", key)
        parts = _without(parts, sections, name)
    ramps = {name: ramp for name, ramp in parts.pop("ramps", {}).items() if name not in parts["sweep"]}
    if ramps:
        parts["ramps"] = ramps
    text = json.dumps(parts, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()


def _without(data: Resolved, sections: Sequence[str], name: str) -> Resolved:
    """Nested ``data`` without ``name`` of a section; as it was where it has none."""
    if not sections:
        return {key: value for key, value in data.items() if key != name}
    first, *rest = sections
    return {**data, first: _without(data[first], rest, name)} if first in data else dict(data)
