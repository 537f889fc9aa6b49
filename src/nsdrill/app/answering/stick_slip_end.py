"""Up to which speeds stick-slip of results may last by their model, and above which rotating
mud drives whirl; and what another damping of torsion changes."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from itertools import product
from math import isinf, isnan, nan, prod
from operator import attrgetter
from typing import Any

import numpy as np

from nsdrill.analysis.early_end import SPEED
from nsdrill.analysis.sticking import EVERY
from nsdrill.app.check import damping_of_torsion as unusual_damping
from nsdrill.app.check import sticking_limits
from nsdrill.app.experiment import with_samples
from nsdrill.data import MUD_DRIVES, Answer, Array, Results, evenly_spaced, resolved_study
from nsdrill.models.choices import word_at
from nsdrill.models.damped import KEY, Damping, with_usual
from nsdrill.models.dry import by_dry
from nsdrill.models.numbers import FOLD_ERROR
from nsdrill.models.operation import Values
from nsdrill.models.own_drives import own_drive
from nsdrill.models.parts import values_at, values_in_parts
from nsdrill.models.registry import checks_of
from nsdrill.study.study import Study, study_from_resolved
from nsdrill.variables import SAMPLE

KIND, LIMIT = "drive.kind", "drive.torque_limit"
MOST_SETTINGS = 256  # at which it is found; it takes some 30 ms
MOST_WEIGHTS = 3  # at which it is asked to which speed stick-slip lasts with another damping
MOST_DRAWN = 8  # samples in which it is asked where it is not known in which it lasts longest


def stick_slip_lasts(results: Results) -> Answer | None:
    """Up to which set speeds [rad/s] stick-slip may last, once it is there, at the settings of
    the results, by the checks of their model, of dry friction where that is known; of many starts the same for each
    of them.

    ``over`` names the dimensions of the settings, and ``unstable_to``, ``lasts_to`` and ``shown_to``, up to which
    runs with smoothed friction may show it, have a number for each setting, the last dimension fastest, ``every``
    where there is no end, and null where it is not known: nowhere where the checks do not tell it, and of
    very many settings; ``lasts_to`` alone is null where the end is known of smoothed friction only. ``from_rest``
    says whether the bit is held at the start, and ``by_start``, which stands only where it is so, that one that
    came free tells nothing of others."""
    if SPEED not in results.axes:
        return None
    others = [name for name in results.grid if name not in ("procedure", SPEED, "start")]
    over = [name for name in others if len(results.coords[name]) > 1]
    study = _study(str(results.attrs.get("study_resolved") or ""))
    is_drawn = "start" in results.grid or any(axis.key.startswith("initial.") for axis in results.more)
    from_rest = _is_at_rest(study.initial) and not is_drawn
    held: Answer = {"from_rest": from_rest} | ({"by_start": True} if _depends_on_start(study, results) else {})
    limits = sticking_limits(study.model)
    is_many = prod(len(results.coords[name]) for name in over) > MOST_SETTINGS
    if limits is None or is_many or SPEED in results.uncertain:
        return {"over": [], "unstable_to": [None], "lasts_to": [None], "shown_to": [None], **held}
    keys, settings = {axis.name: axis.key for axis in results.more}, []
    for place in product(*(range(len(results.coords[name])) for name in others)):
        at = {name: float(results.coords[name][k]) for name, k in zip(others, place, strict=True) if name != SAMPLE}
        at = {keys.get(name, name): value for name, value in at.items()} | {SPEED: float(results.coords[SPEED][0])}
        if SAMPLE in others:
            drawn = {unknown.key.removeprefix("operation."): one for unknown, one in results.drawn.items()}
            at |= {key: float(values[place[-1]]) for key, values in drawn.items()}
        settings.append(tuple(at.items()))
    found = _lasts_at(str(results.attrs["study_resolved"]), tuple(settings))

    def told(value: float | None) -> float | str | None:
        return EVERY if value is not None and isinf(value) else value

    names = ("unstable_to", "lasts_to", "shown_to")
    return {"over": over, **{name: [told(one[name]) for one in found] for name in names}, **held}


def _depends_on_start(study: Study, results: Results) -> bool:
    """Whether stick-slip may last after some starts only, as a drive has a limit of torque or is
    not linear."""
    drive: Any = getattr(study.parameters, "drive", None)
    if drive is None:
        return False
    along = {axis.key: results.coords[axis.name].tolist() for axis in results.more}
    kinds = [str(word_at(KIND, value)) for value in along.get(KIND, ())] or [getattr(drive, "kind", "")]
    drawn = [unknown.key for unknown in results.drawn]
    if getattr(drive, "torque_limit", None) is not None or LIMIT in (*along, *drawn):
        return True
    return not all(own.is_linear for own in map(own_drive, kinds) if own is not None)


def mud_drives_whirl(results: Results) -> dict[str, Array]:
    """Above which set speed [rad/s] rotating mud drives whirl by itself at the setting of each
    run, infinite where it does not, by the checks of their model, as a variable of the results,
    so that a part of them knows of it too; none where they do not tell it, and where it does
    nowhere."""
    study = _study(str(results.attrs.get("study_resolved") or ""))
    limits = getattr(checks_of(study.model), "driven_by_mud_above", None)
    if limits is None:
        return {}
    over = [
        name for name in results.grid if name not in ("procedure", SPEED, "start") and len(results.coords[name]) > 1
    ]
    lengths = [len(results.coords[name]) for name in over]
    place = dict(zip(over, np.indices(lengths).reshape(len(over), prod(lengths)), strict=True))
    first, keys = np.zeros(prod(lengths), dtype=int), {axis.name: axis.key for axis in results.more}
    values = {
        keys.get(name, name): np.asarray(results.coords[name], float)[place.get(name, first)] for name in results.axes
    }
    if SPEED in values:  # where the search for it begins
        values[SPEED] = np.full(len(first), np.max(results.coords[SPEED]))
    for unknown, drawn in results.drawn.items():
        values[unknown.key.removeprefix("operation.")] = np.asarray(drawn, float)[place.get(SAMPLE, first)]
    above = np.empty(len(first))
    for part, there in values_in_parts(study.model, study.parameters, study.initial, values):
        above[there] = limits(part)
    if not np.isfinite(above).any():
        return {}
    lengths = [len(results.coords[name]) if name in over else 1 for name in results.grid]
    return {MUD_DRIVES: np.broadcast_to(above.reshape(lengths), results.shape)}


@lru_cache(maxsize=4)
def _study(text: str) -> Study:
    return study_from_resolved(resolved_study({"study_resolved": text}))


@lru_cache(maxsize=4)  # every answer of a file asks for the same ones
def _lasts_at(text: str, settings: tuple[tuple[tuple[str, float], ...], ...]) -> list[dict[str, float | None]]:
    """The speeds of these settings of the resolved study of this ``text``."""
    study = _study(text)
    limits = sticking_limits(study.model)
    assert limits is not None
    unstable: list[float | None] = []

    def lasting(values: Sequence[Values]) -> list[float | None]:
        found = limits(values)
        unstable.extend(ends and ends[0] for ends in found)
        return [nan if ends is None or ends[1] is None else ends[1] for ends in found]

    shown, lasts = by_dry(lasting, [values_at(study.parameters, study.initial, dict(at)) for at in settings])
    ends = zip(unstable, lasts, shown, strict=False)  # behind them those of dry friction
    names = ("unstable_to", "lasts_to", "shown_to")
    return [
        {name: None if end is None or isnan(end) else end for name, end in zip(names, one, strict=True)} for one in ends
    ]


def damping_of_torsion(results: Results) -> Answer | None:
    """The damping of torsion of results, where it is unusual of a string: its ``key``, ``value``
    and the ``usual`` one [N m s/rad], the ``ratio``, whether it ``is_default``, and up to which
    speeds [rad/s] stick-slip ``lasts`` by torsion alone at some weights ``wob`` [N], ``now`` and
    with the ``usual`` one, with the error of its fold as :func:`stick_slip_lasts`, null where it
    lasts at every speed, and the values ``at`` which that is of the other axes that are swept;
    of uncertain numbers in the ``sample`` in which it lasts longest, of which the study has none.
    None where it is usual."""
    text = str(results.attrs.get("study_resolved") or "")
    study = with_samples(_study(text), results)
    found = unusual_damping(study)
    if found is None:
        return None
    weights = results.coords["wob"].tolist() if "wob" in results.certain_axes else [float(study.operation.wob)]
    others = [name for name in results.swept if name not in ("wob", SPEED)]
    at = {name: float(results.coords[name][0]) for name in others if name in results.certain_axes}
    longest = _longest(results)
    numbers = tuple(
        tuple((unknown.short, float(values[place])) for unknown, values in results.drawn.items()) for place in longest
    )
    return {
        "key": KEY,
        **found._asdict(),
        "is_default": found.value == attrgetter(KEY)(study.model.parameters()),
        "lasts": [
            {"wob": wob, "at": at, **{name: None if isinf(speed) else speed for name, speed in ends.items()}}
            for wob, ends in _folds(text, found, tuple(evenly_spaced(weights, MOST_WEIGHTS)), numbers or ((),))
        ],
        **({"sample": longest[0] if len(longest) == 1 else None} if longest else {}),
    }


def _longest(results: Results) -> list[int]:
    """The sample of uncertain numbers in which stick-slip lasts to the highest speed; some of them
    where that is not known, none where no number is uncertain."""
    if not results.drawn or SAMPLE not in results.grid:
        return []
    samples, found = len(results.coords[SAMPLE]), stick_slip_lasts(results)
    if found is None or SAMPLE not in found["over"] or None in found["lasts_to"]:
        return evenly_spaced(range(samples), MOST_DRAWN)
    lengths = [len(results.coords[name]) for name in found["over"]]
    speeds = np.array([np.inf if one == EVERY else one for one in found["lasts_to"]], float).reshape(lengths)
    by_sample = np.moveaxis(speeds, found["over"].index(SAMPLE), 0).reshape(samples, -1).max(axis=1)
    return [int(np.argmax(by_sample))]


@lru_cache(maxsize=4)
def _folds(
    text: str, found: Damping, weights: tuple[float, ...], numbers: tuple[tuple[tuple[str, float], ...], ...]
) -> list[tuple[float, dict[str, float]]]:
    """Up to which speed stick-slip lasts at each weight with either damping, in the one of the
    samples, which have these ``numbers``, where that is highest; none where the model does not
    tell it, or where it is not known."""
    study = _study(text)
    folds: Any = getattr(checks_of(study.model), "stick_slip_folds", None)
    if folds is None:
        return []
    first = {name: float(values[0]) for name, values in study.axes.items()}
    depth = {"depth": float(study.operation.depth), SPEED: float(study.operation.rotary_speed)}
    now = [
        values_at(study.parameters, study.initial, {**depth, **first, "wob": wob, **dict(drawn)})
        for wob in weights
        for drawn in numbers
    ]
    _, found_at = by_dry(folds, [*now, *(with_usual(values, found) for values in now)])
    speeds = FOLD_ERROR * np.array([float(one or 0.0) for one in found_at]).reshape(2, len(weights), len(numbers))
    highest: list[list[float]] = speeds.max(axis=2).tolist()  # NaN where one is not known
    return [
        (wob, {"now": one, "usual": other})
        for wob, one, other in zip(weights, *highest, strict=True)
        if not isnan(one) and not isnan(other)
    ]


def _is_at_rest(start: object) -> bool:
    """Whether the bit does not turn at a start."""
    speed = getattr(start, "bit_speed", None)
    return speed == 0.0 or (speed is None and getattr(start, "start", None) == "rest")
