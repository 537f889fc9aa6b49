"""The results of sweeps and simulations in memory: plain arrays with names, in SI
units.

The store writes and reads them, the plots draw them; neither imports the other.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import reduce
from itertools import filterfalse
from operator import getitem
from typing import Any, TypeVar

import numpy as np

from nsdrill.errors import InputError, brief
from nsdrill.variables import Axis, Unknown

Array = np.ndarray[Any, np.dtype[Any]]
Attributes = dict[str, Any]  # of a file, or of an array in it: text, numbers and arrays by name
Resolved = dict[str, Any]  # a complete study, or a part of one, as plain data in SI
Change = tuple[str, Any, Any]  # a dotted key of a study, and its values in two
Answer = dict[str, Any]  # what was found, as plain data, by the keys of its JSON
T = TypeVar("T")
NOT_CARRIED_WORDS = (
    "NOT CARRIED: a run before it in its chain failed, so this run began at the start of the study and its history is "
    "not known."
)
MOST_SOURCES = 6  # that are named of what was changed
IN_MEMORY = "the results"  # how messages name results that are not in a file
# root attributes: the changes by --set of run, and of classify
OVERRIDES, THRESHOLDS = "study_overrides", "classification"
# root attribute of results in memory: the critical speeds above which a motion may last, as JSON
LASTING_MOTIONS = "lasting_motions"
LASTING_UNTOLD = "lasting_untold"  # that the model does not tell which motions may last, 1 or 0
UNCUT = "nothing_cut"  # that the wear flats bear the whole weight on bit somewhere, by units, as JSON
FEW = "few_states"  # that the surface of a drag bit has too few states somewhere, by units, as JSON
INEXACT = "inexact_exponents"  # root attribute: what is warned of exponents that implicit steps make wrong
BENT = "bends"  # what is warned of a drive that bends at steady drilling; empty where none does
PULSES = "pulses"  # what is warned of pulses of a forcing, which steps may jump over; empty where there are none
SHORT = "short_observation"  # that what was observed is too short, by units, as JSON
SHORT_TO = "short_observation_to"  # up to which speed it is [rad/s], as a number; infinite where at every one
DAMPING = "damping_of_torsion"  # damping that is unusual of a string, as JSON
DAMPING_RATIOS = "damping_ratios"  # the least and the greatest damping ratio of torsion, as JSON
DECIDING = "deciding_numbers"  # the keys of numbers of no sheet that act on each response, as JSON
STRING_BY_DEPTH = "string_by_depth"  # drag off bottom and torsional period of the string, by depth, as JSON
LEFT_OUT = "left_out_of_model"  # from where on the string does what its model leaves out, as JSON
UNUSUAL_NUMBERS = "unusual_numbers"  # those of the string that are far from usual, in words; empty without
LUMPED_STRING = "lumped_string"  # that torsion is far from its first standing wave, by units, as JSON
WALL_OFF_BOTTOM = "wall_off_bottom"  # at which speeds the collar off bottom reaches the wall, as JSON
UNREAD = "study_unread"  # why the study of a file is none of this version
WITHIN = "drilled_within"  # root attribute of results in memory: between which values one drills, as JSON
STICKS_TO = "stick_slip_lasts_to"  # root attribute of results in memory: to which speed, by the model, as JSON
MUD_DRIVES = "mud_drives_whirl_above"  # variable of results in memory: from which speed mud drives whirl [rad/s]
MODEL_PARTS = "model_parts"  # root attribute: the digest of each part of a script's model by its words, as JSON
USED_SCRIPTS = "used_scripts"  # root attribute: script and digest of each drive and law of a script, as JSON
MEASURED_BY = "measured_by_scripts"  # root attribute: script and digest of each quantity that one measures, as JSON
NATURAL_SCALES = "natural_scales"  # root attribute: those of the states of a script's model, as JSON
GUESSED_SCALES = "guessed_scales"  # likewise: the states of which it is a guess, where there are such
EDITED_SOURCE = "unsealed_source"  # root attribute: what was changed by another program, or by hand, of data
SHORTEST_PERIOD = "shortest_period"  # root attribute of a trace: the shortest known of its motion [s]
NOT_CARRIED_RUN = "not_carried"  # root attribute of a trace: 1 where the run came after a failed one in its chain
ENDS_EARLY = "stick_slip_ends_early"  # where stick-slip ends earlier than torsion alone explains


def edited_words(attrs: Attributes) -> str:
    """That data with the root attributes ``attrs`` are, or were made from, data that were
    changed outside of nsdrill, in a sentence; empty where they were not."""
    found = attrs.get(EDITED_SOURCE)
    if not found:
        return ""
    return (
        "NOT SEALED: changed outside of nsdrill, or made from data that were, so the numbers need not be those of the "
        f"runs. What was changed: {found}."
    )


def edited_together(*sources: Attributes, further: str = "") -> Attributes:
    """The root attribute of what is made from data with these root attributes, and
    ``further`` words on what was changed: each once, and of many the first; empty where
    nothing was changed."""
    texts = [part for attrs in sources for part in str(attrs.get(EDITED_SOURCE) or "").split("; ")]
    parts = list(dict.fromkeys(filter(None, [*texts, further])))
    more = [f"and {len(parts) - MOST_SOURCES} more"] if len(parts) > MOST_SOURCES else []
    return {EDITED_SOURCE: "; ".join([*parts[:MOST_SOURCES], *more])} if parts else {}


def read_only(value: T) -> T:
    """A view of an array that cannot be written to; anything else as it is."""
    if not isinstance(value, np.ndarray):
        return value
    view = value.view()
    view.flags.writeable = False
    return view


def evenly_spaced(items: Sequence[T], most: int) -> list[T]:
    """At most so many of the items, evenly spaced, with the first and the last."""
    if len(items) <= most:
        return list(items)
    return [items[round(number * (len(items) - 1) / (most - 1))] for number in range(most)]


def json_text(data: object, indent: int | None = None) -> str:
    """JSON of plain data and numpy values; null where a number is not finite, which
    JSON cannot represent."""
    try:
        return json.dumps(data, indent=indent, allow_nan=False)
    except (TypeError, ValueError):  # not all of it is plain and finite
        return json.dumps(_plain(data), indent=indent, allow_nan=False)


def _plain(data: object) -> object:
    if isinstance(data, dict):
        return {str(name): _plain(value) for name, value in data.items()}
    if isinstance(data, np.ndarray | np.generic):
        # one look at many numbers, such as those of a log
        is_finite = data.dtype.kind == "f" and bool(np.isfinite(data).all())
        return data.tolist() if is_finite else _plain(data.tolist())
    if isinstance(data, list | tuple):
        return [_plain(value) for value in data]
    return None if isinstance(data, float) and not math.isfinite(data) else data


class LackingVariable(InputError, KeyError):
    """Results have no variable of this name: they are a part of the results."""

    def __str__(self) -> str:
        return (
            f"found results without {brief(str(self.args[0]))}; allowed: results that have it. Take the whole "
            "file, or run the study again."
        )


BESIDE_GRID = frozenset({"peak", "crossing", "state"})  # dimensions over which no points are numbered
BESIDE_AXES = frozenset({"procedure", "sample", "start"})  # those of the grid that are no axes


@dataclass
class Results:
    """The results of a sweep.

    ``coords`` holds the 1-D coordinates in the order of the dimensions: ``procedure``,
    the axes ``depth`` [m], ``wob`` [N], ``rotary_speed`` [rad/s] and those of ``more``,
    ``start`` if every operating point is started from several states, ``sample`` in its
    place if numbers are uncertain, then ``peak``, ``crossing``, ``state``.
    ``variables`` has one array for each variable that the model's description lists,
    over procedure, axes and start and its own dimension; ``attrs`` are the root
    attributes of the file.
    """

    coords: dict[str, Array]
    variables: dict[str, Array]
    attrs: Attributes = field(default_factory=dict)
    more: tuple[Axis, ...] = ()
    drawn: dict[Unknown, Array] = field(default_factory=dict)
    """The samples of the uncertain numbers, each [samples]."""
    part_of: tuple[Results, str, Array] | None = None
    """The results of which these are a part, at which indices along which axis: the class
    of a point follows from all runs of its chain."""

    def __getitem__(self, name: str) -> Array:
        if name in self.variables:
            return self.variables[name]
        if name in self.coords:
            return self.coords[name]
        raise LackingVariable(name)

    def __contains__(self, name: object) -> bool:
        return name in self.variables or name in self.coords

    def __iter__(self) -> Iterator[str]:
        return iter((*self.coords, *self.variables))

    @property
    def axes(self) -> tuple[str, ...]:
        """The names of the axes: depth, wob, rotary_speed, and the others of the
        sweep."""
        return tuple(filterfalse(BESIDE_AXES.__contains__, self.grid))

    @property
    def grid(self) -> tuple[str, ...]:
        """The dimensions over which points are numbered, the last fastest."""
        return tuple(filterfalse(BESIDE_GRID.__contains__, self.coords))

    @property
    def shape(self) -> tuple[int, ...]:
        """(procedures, values of each axis), and the number of samples or starts if
        each operating point has several."""
        return tuple(map(len, map(self.coords.__getitem__, self.grid)))

    @property
    def procedures(self) -> tuple[str, ...]:
        """The words of the procedures, which other readers of HDF5 give as bytes."""
        words = self.coords["procedure"]
        if words.dtype.kind == "U":
            return tuple(words.tolist())
        return tuple(word.decode() if isinstance(word, bytes) else str(word) for word in words.tolist())

    @property
    def slice(self) -> Resolved:
        """If the starts are a slice, its two states, {state: {from, to, points}} in SI;
        else empty."""
        return dict(resolved_study(self.attrs).get("initial", {}).get("slice", {}))

    @property
    def peaks_kept(self) -> int | None:
        """How many peaks every run keeps of a quantity; None where the file does not say."""
        record = resolved_study(self.attrs).get("record")
        kept = record.get("peaks") if isinstance(record, dict) else None
        return kept if isinstance(kept, int) else None

    @property
    def uncertain(self) -> dict[str, Array]:
        """The samples [samples] of those axes of which every sample has its own value:
        what ``coords`` has is the value of the study, which no run has."""
        return {unknown.short: values for unknown, values in self.drawn.items() if unknown.short in self.axes}

    @property
    def certain_axes(self) -> tuple[str, ...]:
        """The names of the axes but for the uncertain ones."""
        return tuple(name for name in self.axes if name not in self.uncertain)

    @property
    def held(self) -> dict[str, float]:
        """The values of the axes that are the same in all runs."""
        return {name: float(self.coords[name][0]) for name in self.certain_axes if len(self.coords[name]) == 1}

    def values_at(self, place: Sequence[int]) -> dict[str, str | float]:
        """The values of the dimensions at a ``place`` of the grid."""
        values = {name: self.coords[name][i].item() for name, i in zip(self.grid, place, strict=True)}
        return values | {name: float(samples[place[-1]]) for name, samples in self.uncertain.items()}

    @property
    def swept(self) -> list[str]:
        """The axes with more than one value, in the order of the dimensions."""
        return [name for name in self.axes if len(self.coords[name]) > 1]


@dataclass
class Trace:
    """One trajectory sampled in time: ``time`` [s] and one array [samples] for each
    quantity of a trace that the model's description lists; ``attrs`` holds the
    operating point and what is needed to draw the hole."""

    time: Array
    variables: dict[str, Array]
    attrs: Attributes = field(default_factory=dict)

    def __getitem__(self, name: str) -> Array:
        return self.time if name == "time" else self.variables[name]

    def __contains__(self, name: object) -> bool:
        return name == "time" or name in self.variables

    def __iter__(self) -> Iterator[str]:
        return iter(("time", *self.variables))


def frozen_modes(attrs: Attributes) -> tuple[str, ...]:
    """The motions that are frozen in a file with the root attributes ``attrs``, of
    axial, torsional and lateral."""
    modes = resolved_study(attrs).get("modes")
    if not isinstance(modes, dict):
        return ()
    return tuple(name for name, word in modes.items() if _word(attrs, f"modes.{name}", word) == "frozen")


def units_of(attrs: Attributes) -> str:
    """The system of units in which the study in the root attributes ``attrs`` wants
    answers, "si" or "field"."""
    return "field" if resolved_study(attrs).get("units") == "field" else "si"


def rubs_along(attrs: Attributes) -> bool:
    """Whether the string rubs along the hole in a file with the root attributes ``attrs``."""
    study = resolved_study(attrs)
    well = study.get("well")
    friction = well.get("friction_along") if isinstance(well, dict) else None
    rubs = isinstance(friction, dict) and any(friction.get(name) for name in ("static", "dynamic"))
    varied = [key for name in ("sweep", "uncertain") if isinstance(study.get(name), dict) for key in study[name]]
    return rubs or any(key.startswith("well.friction_along") for key in varied)


def leaves_out_drag(attrs: Attributes) -> bool:
    """Whether the hole is inclined, and the string does not rub along it, in a file with the root
    attributes ``attrs``."""
    well = resolved_study(attrs).get("well")
    inclination = well.get("inclination") if isinstance(well, dict) else None
    return bool(inclination) and not rubs_along(attrs)


def rubs_at_collar(attrs: Attributes) -> bool:
    """Whether of the string in a file with the root attributes ``attrs`` the collar and its stabilisers alone rub
    along the hole."""
    well = resolved_study(attrs).get("well")
    return isinstance(well, dict) and bool(well.get("axial_friction")) and not rubs_along(attrs)


def estimates_wall(attrs: Attributes) -> bool:
    """Whether the speeds at which the collar off bottom reaches the wall are an estimate in a file with the root
    attributes ``attrs``: it sags, and its stabilisers have clearance, or the mud rotates."""
    study = resolved_study(attrs)
    well, stabilizer, mud = (study.get(name) or {} for name in ("well", "stabilizer", "mud"))
    if not all(isinstance(one, dict) for one in (well, stabilizer, mud)):
        return False
    return bool(well.get("inclination")) and bool(stabilizer.get("clearance") or mud.get("swirl"))


def drive_kind(attrs: Attributes) -> str:
    """The kind of drive in a file with the root attributes ``attrs``, as in the study;
    for a sweep over kinds "ideal", the kind of most studies."""
    drive = resolved_study(attrs).get("drive")
    kind = _word(attrs, "drive.kind", drive.get("kind")) if isinstance(drive, dict) else None
    return kind if isinstance(kind, str) else "ideal"


def _word(attrs: Attributes, key: str, own: Any) -> Any:
    """The word of a choice in a file, ``own`` in its study; None if the sweep has
    several. The attribute ``at`` of a trace has the one that applies."""
    sweep = resolved_study(attrs).get("sweep")
    if not isinstance(sweep, dict) or key not in sweep:
        return own
    try:
        return json.loads(attrs.get("at") or "{}").get(key)
    except (TypeError, ValueError, AttributeError):
        return None


OF_TEXT = ("title", "model", "units")  # the keys of a resolved study that are no sections


def resolved_study(attrs: Attributes) -> Resolved:
    """The resolved study in the root attributes ``attrs``, without what is no section where another program has
    written that; empty if there is none."""
    try:
        found = json.loads(attrs.get("study_resolved") or "{}")
    except (TypeError, ValueError):
        return {}
    if not isinstance(found, dict):
        return {}
    for key in [*found]:
        if key not in OF_TEXT and not isinstance(found[key], dict):
            del found[key]
    return found


def value_at(resolved: Resolved, key: str) -> Any:
    """The value of a dotted key of a resolved study."""
    return reduce(getitem, key.split("."), resolved)


def found_at(resolved: Resolved, key: str) -> Any:
    """As :func:`value_at`; None where there is no such key, as of a number that stands in
    place of another one and is not given."""
    for name in key.split("."):
        resolved = resolved.get(name) if isinstance(resolved, dict) else None  # type: ignore[assignment]
    return resolved


def differences(a: Resolved, b: Resolved) -> list[Change]:
    """(dotted key, value in ``a``, value in ``b``) for the keys in which two resolved
    studies differ; None for a missing key."""
    left, right = dict(flat(a)), dict(flat(b))
    keys = [*left, *(key for key in right if key not in left)]
    return [(key, left.get(key), right.get(key)) for key in keys if left.get(key) != right.get(key)]


def flat(study: Resolved, prefix: str = "") -> Iterator[tuple[str, Any]]:
    """(dotted key, value) of all entries of a resolved study."""
    for name, value in study.items():
        if isinstance(value, dict):
            yield from flat(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value


def overrides(attrs: Attributes, *, thresholds: bool = False) -> dict[str, str]:
    """The keys that ``--set`` changed in the study of a file with the root attributes
    ``attrs``, with their values as given; with ``thresholds`` also those that
    ``nsdrill classify`` changed. If a key was given twice, its last value."""
    found: dict[str, str] = {}
    for name in (OVERRIDES, THRESHOLDS) if thresholds else (OVERRIDES,):
        try:
            texts = json.loads(attrs.get(name) or "[]")
        except (TypeError, ValueError):
            continue
        for text in texts if isinstance(texts, list) else ():
            key, _, value = str(text).partition("=")
            found[key.strip()] = " ".join(value.split())
    return found
