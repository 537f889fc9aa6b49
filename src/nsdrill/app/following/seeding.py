"""The motions from which a continuation sets out: the study and the numbers that are free,
the equations, and the seeds, settled at some values of the continued number or points of a
results file."""

from __future__ import annotations

import copy
import os
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from nsdrill import interrupt, store
from nsdrill.analysis.bifurcations import CIRCLE, motion_text
from nsdrill.analysis.comparison import string_differences
from nsdrill.app.experiment import unlike
from nsdrill.app.following.orbits import check_study, orbit_point, settings_for
from nsdrill.app.telling import Telling
from nsdrill.data import Array, Attributes, Results, edited_together, found_at, resolved_study
from nsdrill.errors import FileError, InputError, count, option
from nsdrill.models.base import Model, Symmetry
from nsdrill.models.choices import as_value, word_or_number
from nsdrill.models.operation import Values
from nsdrill.models.own_parts import places_of_parts
from nsdrill.models.parts import values_at
from nsdrill.models.registry import model_named
from nsdrill.models.variant import Variant, variant_at
from nsdrill.orbit.explore import Wave
from nsdrill.orbit.flow import Flow, Legs, equations_of
from nsdrill.orbit.seeds import Seed
from nsdrill.records import dataclass
from nsdrill.store import read_results
from nsdrill.study import parse_study
from nsdrill.study.continuation import SECTION, Continuation, example_of
from nsdrill.study.study import Study
from nsdrill.study.write import changes_text, study_text
from nsdrill.units import readable
from nsdrill.variables import OK, dimension_of

if TYPE_CHECKING:
    from xarray import Dataset

RANGE_PARTS = 10  # the range of a continued number over its natural scale


@dataclass(frozen=True)
class ContinuationSetup:
    """The inputs of a continuation: the study, its section ``continue``, and the variant
    and the symmetry of the model that are compiled."""

    study: Study
    continuation: Continuation
    variant: Variant
    symmetry: Symmetry

    @property
    def model(self) -> Model:
        return self.variant.model

    def values(self, numbers: Array, keys: tuple[str, ...]) -> Values:
        """The values of n points at ``numbers`` [n, keys] (SI) of the ``keys``."""
        study = self.study
        fixed = {name: np.full(len(numbers), value) for name, value in vars(study.operation).items()}
        return values_at(study.parameters, study.initial, fixed | dict(zip(keys, numbers.T, strict=True)))

    def flow(self, keys: tuple[str, ...], scales: tuple[float, ...], workers: int, without: str = "") -> Flow:
        """The flow in which the numbers at ``keys``, with these natural ``scales``, are
        free; ``without`` names a contact to leave out where the model supports it."""

        def pack(numbers: Array) -> Array:
            with np.errstate(invalid="ignore"):  # Newton's method may leave the range of a number
                table = self.model.pack(self.values(numbers, keys), self.study.thresholds, len(numbers))
            released = self.model.released(table, without) if without else None
            return table if released is None else released

        return Flow(equations_of(self.variant, self.symmetry, pack, scales), workers=workers)


def continuation_setup(study: Study) -> ContinuationSetup:
    """The setup of the continuation of ``study``; InputError where it cannot be
    continued."""
    source = study.source or "the study"
    continuation = study.continuation
    if continuation is None:
        raise InputError(
            f"{source}: found no section continue; allowed: one that says what is followed, as "
            f"{example_of(study.keys)}."
        )
    if study.ramped:
        raise InputError(
            f"{source}: found a ramp in operation.{study.ramped[0]}; allowed: a constant value, of which motions can "
            "repeat."
        )
    model = model_named(study.model.name)
    ranges = _ranges(study, continuation)
    _check_ends(study, ranges)
    structures = []
    for corner in product(*ranges.values()):
        operation = vars(study.operation)
        values = values_at(study.parameters, study.initial, operation | dict(zip(ranges, corner, strict=True)))
        if places := places_of_parts(values.parameters):
            model.refuse_jumps(values, places)
        try:
            structures.append((variant_at(model, values.parameters), model.symmetry(values)))
        except NotImplementedError:
            raise InputError(
                f"{source}: found the model {study.model.name}, which does not say how its motions repeat, or has no "
                "linearised equations; allowed: a model that does, as christoforou_yigit, torsion or beam. A sweep "
                "up and down (sweep.procedure: up-down) follows the stable motions of any model."
            ) from None
    if any(structure != structures[0] for structure in structures):
        raise InputError(
            f"{source}: found a range of {' and '.join(ranges)} at whose ends the equations have different "
            "symmetries, such as a hole that is vertical at one end and inclined at the other, or lobes of no "
            "height at one end; allowed: a range that leaves such an end out."
        )
    if structures[0][1].folds and {*continuation.motions} == {"stick_slip"}:
        raise InputError(
            f"{source}: continue.motions: found stick_slip alone, over lobes; allowed: a smooth rock, on which "
            "stick-slip is a cycle, or other motions. Over lobes it is a torus that is not followed: a sweep up and "
            "down (sweep.procedure: up-down) tells where it is stable."
        )
    return ContinuationSetup(study, continuation, *structures[0])


def _check_ends(study: Study, ranges: dict[str, tuple[float, float]]) -> None:
    """InputError where the study is none with the free numbers at the ends of their ``ranges``,
    as one that lacks what such a number needs beside it."""
    for corner in product(*ranges.values()):
        resolved = copy.deepcopy({key: part for key, part in study.resolved.items() if key != SECTION})
        resolved["sweep"] = {"procedure": "same", "along": None, "refine": 0}
        for key, value in zip(ranges, corner, strict=True):
            *sections, name = key.split(".") if "." in key else ("operation", key)
            found_at(resolved, ".".join(sections))[name] = value
        try:
            parse_study(study_text(resolved), study.source or "the study")
        except InputError as error:
            told = " and ".join(f"{key} = {value:g} (SI)" for key, value in zip(ranges, corner, strict=True))
            _, _, found = str(error).partition(": ")  # after the place in a text that no one wrote
            raise InputError(f"continue: with {told}: {found}") from error


def _ranges(study: Study, continuation: Continuation) -> dict[str, tuple[float, float]]:
    """The ranges of the numbers that are free, by key; InputError where curves do not
    set out from the study's own value."""
    ranges = {continuation.along: (continuation.low, continuation.high)}
    if (curves := continuation.curves) is not None:
        start = number_of(study, dimension_of(curves.over))
        if not curves.low <= start <= curves.high:
            raise InputError(
                f"{study.source or 'the study'}: continue.curves: found {curves.over} from {curves.low:g} to "
                f"{curves.high:g} (SI); allowed: a range that has the study's own value, {start:g}, from where the "
                "curves set out."
            )
        ranges[curves.over] = (curves.low, curves.high)
    return ranges


def number_of(study: Study, name: str) -> float:
    """The value in the study [SI] along the axis whose dimension has this name."""
    if name in study.operation.names():
        return float(getattr(study.operation, name))
    key = next(key for key in study.keys.axes if dimension_of(key) == name)
    value = found_at(study.resolved, key)
    if value is None:
        raise InputError(
            f"{study.source or 'the study'}: found no value of {key}, whose default is another number; allowed: the "
            "study with a value of it."
        )
    return as_value(key, value)


def number_text(study: Study, key: str, value: float) -> str:
    """A ``value`` [SI] of the number of a ``study`` at ``key``, an axis, with its unit."""
    leaf = study.keys.axes[key].key
    return study.keys.leaf(leaf, study.resolved).text(float(f"{value:.4g}"))


FEW = 3  # branches that are told one by one


@dataclass
class Following:
    """Lines on the waves of branches, through ``told``. They tell no time that is left:
    how long branches get, and which spring from them, is not known before."""

    told: Telling
    setup: ContinuationSetup
    number: int = 0
    told_kept: str = ""

    def watch(self, wave: Wave) -> None:
        """Tell how many branches a wave has at its beginning, then which of them go on, how
        many points they have, and where they are."""
        if wave.number != self.number:
            self.number = wave.number
            self.told.begins(
                f"round {self.number}: {count(wave.branches, 'branch')} followed side by side; {_seeds_left(wave)}"
            )
        else:
            self.told.goes(f"{self._going(wave)}; round {self.number}, kept: {self.told_kept or 'none'}")

    def _going(self, wave: Wave) -> str:
        """The branches that go on: each with its points and where its sides are, of more than
        :data:`FEW` all together."""
        name, model = self.setup.continuation.along.removeprefix("parameters."), self.setup.study.model
        if len(wave.running) <= FEW:
            return "; ".join(
                f"{motion_text(*one.kind, model)}, {count(one.points, 'point')}, {name} "
                + " and ".join(self._at(value) for value in sorted(one.at))
                for one in wave.running
            )
        ends, points = [value for one in wave.running for value in one.at], sum(one.points for one in wave.running)
        return (
            f"{len(wave.running)} of {count(wave.branches, 'branch')} go on, {count(points, 'point')}, {name} "
            f"from {self._at(min(ends))} to {self._at(max(ends))}"
        )

    def _at(self, value: float) -> str:
        return number_text(self.setup.study, self.setup.continuation.along, value)

    def kept(self, text: str) -> None:
        """Take what is kept, in words, for the next line."""
        self.told_kept = text


def _seeds_left(wave: Wave) -> str:
    return f"{wave.seeds - wave.open} of {count(wave.seeds, 'seed')} lie on a branch or are given up"


def dropped_words(followed: int, kept: int) -> str:
    """Why there are fewer branches than were followed; "" where there are not."""
    if followed == kept:
        return ""
    return (
        f"{count(followed, 'branch')} were followed; {followed - kept} of them turned out to be parts of "
        f"others, which other seeds had led to, and count once"
    )


SEEDED = ("status", "settled", "final_state")  # the variables of results that seeds take
PIECE = 20.0  # of the time in which seeds settle, between two looks at the clock [s]


@dataclass(frozen=True)
class Chosen:
    """The one motion of a file from which branches set out: of results that with this
    ``value`` [SI] of the continued number, this ``procedure`` and this ``start``, where these
    are given; of branches that with the number ``point``."""

    value: float | None = None
    procedure: str | None = None
    start: int | None = None
    point: int | None = None


ALL = Chosen()


Source: TypeAlias = "str | os.PathLike[str] | Results | Dataset"  # of seeds: results or branches


def seeds_of(
    setup: ContinuationSetup, flow: Flow, given: Source | None, told: Telling, chosen: Chosen = ALL
) -> list[Seed]:
    """The seeds of a continuation, from results or branches where these are ``given``, of
    which one motion may be ``chosen``."""
    source = setup.continuation.seeds if given is None else given
    if isinstance(source, str | os.PathLike):
        if store.kind_of(source) == "branches":
            return [_seed_on_branch(setup, source, chosen)]
        return _seeds_in(setup, read_results(source, SEEDED), Path(source), told, chosen)
    if isinstance(source, Results):
        return _seeds_in(setup, source, "the Dataset", told, chosen)
    if not isinstance(source, dict):
        return [_seed_on_branch(setup, source, chosen)]
    if chosen != ALL:
        raise InputError(
            f"found a choice of one motion without a file that has it; allowed: with {option('seeds', 'FILE.h5')}."
        )
    return _settled(setup, flow, np.array(source[setup.continuation.along], dtype=float), told)


def edited_seeds(setup: ContinuationSetup, given: Source | None) -> Attributes:
    """The root attribute of what is made from the seeds of :func:`seeds_of`: that these, or
    what they were made from, were changed outside of nsdrill; empty where they were not."""
    source = setup.continuation.seeds if given is None else given
    if isinstance(source, str | os.PathLike):
        is_branches = store.kind_of(source) == "branches"
        return edited_together(store.open_branches(source).attrs if is_branches else read_results(source, ()).attrs)
    attrs: Attributes = getattr(source, "attrs", {})  # of values at which seeds settle there are none
    return edited_together(attrs)


def _settled(setup: ContinuationSetup, flow: Flow, numbers: Array, told: Telling) -> list[Seed]:
    """The motions on which the starts of the study settle at ``numbers`` [n] (SI) of
    the continued number, preceded by one start of each as a seed of a steady motion."""
    study, model = setup.study, setup.model
    starts = max(1, study.initial.starts)
    at = np.repeat(numbers, starts)[:, None]
    values = setup.values(at, (setup.continuation.along,))
    state = model.starts(values, np.tile(np.arange(starts), len(numbers)))
    states, phase = state[:, :-1], state[:, -1]
    duration = study.simulation.transient + study.simulation.observe
    first = [Seed(*one, steady=True) for one in zip(states[::starts], phase[::starts], at[::starts], strict=True)]
    told.begins(f"{count(len(at), 'motion')} settle{'s' if len(at) == 1 else ''} for {duration:g} s")
    ok = np.ones(len(at), dtype=bool)
    pieces = max(1, int(np.ceil(duration / PIECE)))
    for piece in range(pieces):
        interrupt.check()
        told.goes(f"{piece * duration / pieces:.0f} of {duration:g} s settled")
        ends = flow.run(Legs(states, phase, duration / pieces, at))
        ok &= ends.ok
        states = np.where(ok[:, None], ends.state, states)
        phase = phase + flow.phase_rate(at) * (duration / pieces)
    return [*first, *(Seed(*one, near=True) for one in zip(states[ok], phase[ok], at[ok], strict=True))]


def _seed_on_branch(setup: ContinuationSetup, source: str | os.PathLike[str] | Dataset, chosen: Chosen) -> Seed:
    """The motion at the chosen point of branches, stable or not. Its string is that of the
    study, and so is its operating point but for the continued numbers."""
    path = source if isinstance(source, str | os.PathLike) else "the Dataset"
    if chosen.point is None:
        raise InputError(
            f"{path}: found branches as seeds; allowed: with the number of one of their points, "
            f"{option('point', 'N')}, as nsdrill show {option('all')} prints it, or results of a sweep."
        )
    if replace(chosen, point=None) != ALL:
        raise InputError(f"{path}: found a choice of a point of results; allowed: {option('point', 'N')} alone.")
    point, attrs = orbit_point(source, chosen.point)
    continuation, study = setup.continuation, setup.study
    check_study(path, study, replace(point, values={**point.values, continuation.along: 0.0}), attrs)
    own = {key: value for key, value in point.values.items() if key != continuation.along}
    for key, value in own.items():
        if abs(value - (wanted := number_of(study, dimension_of(key)))) > 1e-9 * max(abs(wanted), 1e-300):
            setting = settings_for(study, replace(point, values={key: value}))[0]
            raise FileError(
                f"{path}: found {dimension_of(key)} {value:.10g} (SI) at point {point.number}, and {wanted:.10g} in "
                f"the study; allowed: the study at that point, {option('set', setting.replace(' ', ''))}."
            )
    along = dimension_of(continuation.along)
    value = point.values[continuation.along] if continuation.along in point.values else number_of(study, along)
    if not continuation.low <= value <= continuation.high:
        raise FileError(
            f"{path}: found {dimension_of(continuation.along)} {value:.10g} (SI) at point {point.number}; allowed: a "
            "point between continue.from and continue.to."
        )
    kind = None if point.motion == CIRCLE else (point.motion, point.lobes)
    return Seed(point.state[:-1], float(point.state[-1]), np.array([value]), True, False, kind, point.period)


def _seeds_in(
    setup: ContinuationSetup, results: Results, path: str | Path, told: Telling, chosen: Chosen
) -> list[Seed]:
    """The settled points of results with the same string and, except for the
    continued number, the same operating point as the study, from all of its starts. Of
    points that have not settled it is said how many there are."""
    along = dimension_of(setup.continuation.along)
    _check_string(setup, results, path)
    if differing := unlike(results.attrs):
        told.note(f"the seeds were run by other code ({'; '.join(differing)}); what is followed is of this one")
    if along not in results.axes and along in setup.study.operation.names():
        raise FileError(f"{path}: found no {along}. Choose results of a sweep as seeds.")
    usable = results["status"] == OK
    from_other_starts = {one.name for one in results.more if one.key.startswith("initial.")}
    for place, name in enumerate(results.grid):
        if name not in ("procedure", "start", "sample", along) and name not in from_other_starts:
            near = _place_of(setup, results, name, path)
            usable &= np.indices(results.shape, sparse=True)[place] == near
    good, settled = _chosen_in(results, along, path, chosen) & usable, results["settled"] == 1
    if chosen != ALL and not np.any(good & settled):
        wider = _chosen_in(results, along, path, replace(chosen, value=None)) & usable & settled
        raise FileError(f"{path}: {_unsettled(setup, results, along, chosen, wider)}")
    if unsettled := np.count_nonzero(good & (results["settled"] == 0)):
        told.note(f"{unsettled} of {count(int(np.count_nonzero(good)), 'point')} had not settled: no seeds")
    good &= settled
    if along in results.grid:
        numbers = results.coords[along][np.nonzero(good)[results.grid.index(along)]]
    else:
        numbers = np.full(np.count_nonzero(good), number_of(setup.study, along))
    seeds = [
        Seed(state[:-1], float(state[-1]), np.array([number]))
        for state, number in zip(results["final_state"][good], numbers, strict=True)
        if setup.continuation.low <= number <= setup.continuation.high
    ]
    if not seeds:
        raise FileError(
            f"{path}: found no settled point between the ends of continue.from and continue.to; allowed: results "
            "with some. Run the sweep for longer (simulation.transient), or widen the range."
        )
    return seeds


def _unsettled(setup: ContinuationSetup, results: Results, along: str, chosen: Chosen, settled: Array) -> str:
    """Why no seed is chosen, and the nearest points that may be: ``settled`` are those with
    any value of the continued number."""
    study, key = setup.study, setup.continuation.along

    def at(value: float) -> str:
        return number_text(study, key, value)

    others = "" if chosen.procedure is None else f", {chosen.procedure}"
    others += "" if chosen.start is None else f", start {chosen.start}"
    if along not in results.grid or chosen.value is None:
        return "no point of that choice has settled; allowed: results with some, as of a longer simulation.transient."
    values = results.coords[along]
    here = float(values[np.argmin(np.abs(values - chosen.value))])
    found = values[np.unique(np.nonzero(settled)[results.grid.index(along)])]
    near = " and ".join(at(float(one)) for one in (*found[found < here][-1:], *found[found > here][:1]))
    allowed = f"a settled one (the nearest{others}: {near}), or" if near else "results with some that have, as of"
    return f"the point at {key} {at(here)}{others} has not settled; allowed: {allowed} a longer simulation.transient."


def _chosen_in(results: Results, along: str, path: str | Path, chosen: Chosen) -> Array:
    """Which points of results are the ``chosen`` ones; an array of booleans. FileError where
    there is none such."""
    if chosen.point is not None:
        raise InputError(
            f"{path}: found {option('point')} {chosen.point} with results; allowed: with branches. A point of results "
            f"is chosen by its {along}."
        )
    good = np.ones(results.shape, dtype=bool)
    places = np.indices(results.shape, sparse=True)
    if chosen.value is not None:
        if along not in results.grid:
            raise FileError(f"{path}: found one value of {along}; allowed: results along it, or no choice.")
        values = results.coords[along]
        near = int(np.argmin(np.abs(values - chosen.value)))
        if not values.min() - 1e-9 <= chosen.value <= values.max() + 1e-9:
            low, high = (readable(float(end), "") for end in (values.min(), values.max()))
            raise FileError(f"{path}: found {along} {chosen.value:g} (SI); allowed: {low} to {high}, as the sweep.")
        good &= places[results.grid.index(along)] == near
    for name, wanted in (("procedure", chosen.procedure), ("start", chosen.start)):
        if wanted is None:
            continue
        known = results.procedures if name == "procedure" else tuple(results.coords.get(name, ()))
        here = [index for index, one in enumerate(known) if one == wanted]
        if not here:
            allowed = ", ".join(map(str, known)) or "results that have several"
            raise FileError(f"{path}: {option(name)}: found {wanted}; allowed: {allowed}.")
        good &= places[results.grid.index(name)] == here[0]
    return good


def _check_string(setup: ContinuationSetup, results: Results, path: str | Path) -> None:
    """FileError where ``results`` are of another string than the study."""
    study = setup.study
    if str(results.attrs.get("model", study.model.name)) != study.model.name:
        raise FileError(
            f"{path}: made with the model {results.attrs['model']}, the study has {study.model.name}. Choose results "
            "of the same model as seeds."
        )
    source = resolved_study(results.attrs)
    free = {setup.continuation.along, *source.get("sweep", {})}
    keys = [key for key, _, _ in string_differences(source, study.resolved, free)]
    if source.get("uncertain") != study.resolved.get("uncertain"):
        keys.append("uncertain")
    if keys:
        changes = changes_text(source, study.resolved, keys)
        raise FileError(f"{path}: made with another string ({changes}). Choose results of the same string as seeds.")


def _place_of(setup: ContinuationSetup, results: Results, name: str, path: str | Path) -> int:
    """The place along the axis ``name`` of ``results`` of the value of the study; FileError
    where it is not there."""
    wanted, values = number_of(setup.study, name), results.coords[name]
    near = int(np.argmin(np.abs(values - wanted)))
    if abs(values[near] - wanted) > 1e-6 * max(abs(wanted), 1e-300):
        low, high, own = (word_or_number(name, one) for one in (values[0], values[-1], wanted))
        raise FileError(
            f"{path}: found {name} from {low} to {high}, of which none is {own}, as in the study; allowed: results "
            f"that have the study's {name}, or {option('set')} a value that they have."
        )
    return near
