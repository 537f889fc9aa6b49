"""Continuation of a study: from its section ``continue`` and seeds to a file of
branches."""

from __future__ import annotations

import hashlib
import os
import time
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from nsdrill import interrupt
from nsdrill.analysis.bifurcations import CIRCLE, DOUBLING, FOLD, HOPF, TORUS, meanings_of
from nsdrill.analysis.equations import string_differences
from nsdrill.app.following import Following, dropped_words
from nsdrill.app.provenance import provenance
from nsdrill.app.run import processors
from nsdrill.app.unfinished import Part
from nsdrill.data import Array, json_text, resolved_study
from nsdrill.errors import FileError, InputError
from nsdrill.kernel.batch import Batch, choose_lanes
from nsdrill.kernel.settings import Simulation
from nsdrill.models.base import Model, Symmetry, Variant
from nsdrill.models.leaves import OPERATION, Values, as_value, values_at, word_or_number
from nsdrill.observe.thresholds import Record
from nsdrill.orbit.borders import borders
from nsdrill.orbit.branch import ENDINGS, Branch
from nsdrill.orbit.curve import Condition
from nsdrill.orbit.explore import Explorer, Found, Orders, Seed
from nsdrill.orbit.flow import Flow, Legs, equations_of
from nsdrill.orbit.kept import from_arrays, to_arrays
from nsdrill.orbit.labels import Graze, unstable_beside
from nsdrill.orbit.multipliers import finer_multipliers
from nsdrill.orbit.newton import Point
from nsdrill.store import open_branches, part_path, read_results, write_branches
from nsdrill.study.continuation import SECTION, Continuation
from nsdrill.study.study import Study
from nsdrill.study.write import changes_text
from nsdrill.sweep.work import Variant as Compiled
from nsdrill.sweep.work import compiled_parts
from nsdrill.units import CF
from nsdrill.variables import OK, dimension_of

RANGE_PARTS = 10  # the range of the continued number over its natural scale
CIRCLE_PERIODS = 200  # of a motion on an invariant circle, over which its features are measured
UNSTABLE = 1e6  # largest multiplier of a motion that an integration still follows
WHAT = "continuation"
Say = Callable[[str], object]


@dataclass(frozen=True)
class ContinuationResult:
    """The result of a continuation: the Dataset of branches, the number of seeds by
    their outcome in words, and the wall time in seconds."""

    data: Any
    seeds: dict[str, int]
    seconds: float


@dataclass(frozen=True)
class ContinuationSetup:
    """The inputs of a continuation: the study, its section ``continue``, the model, and
    the options and symmetry that are compiled in."""

    study: Study
    continuation: Continuation
    model: Model
    variant: Variant
    symmetry: Symmetry

    def values(self, numbers: Array, keys: tuple[str, ...]) -> Values:
        """The values of n points at ``numbers`` [n, keys] (SI) of the ``keys``."""
        study = self.study
        by_key: dict[str, Any] = {name: np.full(len(numbers), getattr(study.operation, name)) for name in OPERATION}
        by_key |= {key: numbers[:, place] for place, key in enumerate(keys)}
        return values_at(study.parameters, study.initial, by_key)

    def flow(self, keys: tuple[str, ...], scales: tuple[float, ...], workers: int, without: str = "") -> Flow:
        """The flow in which the numbers at ``keys``, with these natural ``scales``, are
        free; ``without`` names a contact to leave out where the model supports it."""

        def pack(numbers: Array) -> Array:
            with np.errstate(invalid="ignore"):  # Newton's method may leave the range of a number
                table = self.model.pack(self.values(numbers, keys), self.study.thresholds)
            released = self.model.released(table, without) if without else None
            return table if released is None else released

        return Flow(equations_of(self.model, self.variant, self.symmetry, pack, scales), workers=workers)


def continuation_setup(study: Study) -> ContinuationSetup:
    """The setup of the continuation of ``study``; InputError where it cannot be
    continued."""
    source = study.source or "the study"
    continuation = study.continuation
    if continuation is None:
        raise InputError(
            f"{source}: found no section continue; allowed: one that says what is followed, as "
            "continue: {along: rotary_speed, from: 2 rad/s, to: 8 rad/s}."
        )
    if study.ramped:
        raise InputError(
            f"{source}: found a ramp in operation.{study.ramped[0]}; allowed: a "
            f"constant value, of which "
            "motions can repeat."
        )
    model = study.model.dynamics
    if model.switches(study.parameters) is not None:
        raise InputError(f"{source}: found drive.on_at; allowed: nothing that is switched on within the run.")
    keys = (continuation.along, *((continuation.curves.over,) if continuation.curves else ()))
    if (curves := continuation.curves) is not None:
        start = _number_of(study, dimension_of(curves.over))
        if not curves.low <= start <= curves.high:
            raise InputError(
                f"{source}: continue.curves: found {curves.over} from {curves.low:g} to "
                f"{curves.high:g} (SI); allowed: a range that has the study's own value, "
                f"{start:g}, from where the "
                "curves set out."
            )
    ends = [
        (continuation.low, continuation.high),
        *(((continuation.curves.low, continuation.curves.high),) if continuation.curves else ()),
    ]
    corners = np.array(np.meshgrid(*ends)).reshape(len(keys), -1).T
    setup = ContinuationSetup(study, continuation, model, (), Symmetry(0, ()))
    structures = []
    for corner in corners:
        values = setup.values(corner[None], keys)
        single = values_at(values.parameters, values.initial, dict(zip(OPERATION, values.operation, strict=True)))
        scalar = _scalar_values(single, keys, corner)
        try:
            structures.append((model.variant(scalar.parameters), model.symmetry(scalar)))
        except NotImplementedError:
            raise InputError(
                f"{source}: found the model {study.model.name}, which does not say how its motions "
                f"repeat, or has no "
                "linearised equations; allowed: a model that does, as christoforou_yigit, torsion "
                "or beam. A sweep "
                "up and down (sweep.procedure: up-down) follows the stable motions of any model."
            ) from None
    if any(structure != structures[0] for structure in structures):
        raise InputError(
            f"{source}: found a range of {' and '.join(keys)} at whose ends the equations have "
            f"different symmetries, "
            "such as a hole that is vertical at one end and inclined at the other, or lobes of no "
            "height at one end; "
            "allowed: a range that leaves such an end out."
        )
    if structures[0][1].folds and {*continuation.motions} == {"stick_slip"}:
        raise InputError(
            f"{source}: continue.motions: found stick_slip alone, over lobes; allowed: a smooth "
            f"rock, on which "
            "stick-slip is a cycle, or other motions. Over lobes it is a torus that is not "
            "followed: a sweep up and "
            "down (sweep.procedure: up-down) tells where it is stable."
        )
    return ContinuationSetup(study, continuation, model, *structures[0])


def _finished(study: Study, path: str | os.PathLike[str]) -> ContinuationResult:
    """The result in the finished file ``path``. FileError where it was made from
    another study."""
    data = open_branches(path)
    if listed := changes_text(resolved_study(data.attrs), study.resolved):
        raise FileError(f"{path}: finished, and made from another study ({listed}). Start anew by --overwrite.")
    return ContinuationResult(data, {}, 0.0)


def _scalar_values(values: Values, keys: tuple[str, ...], numbers: Array) -> Values:
    """``values`` with scalars at ``keys``, from which the options of a string
    follow."""
    by_key = {key: float(number) for key, number in zip(keys, numbers, strict=True)}
    operation = {name: float(np.ravel(one)[0]) for name, one in zip(OPERATION, values.operation, strict=True)}
    return values_at(values.parameters, values.initial, {**operation, **by_key})


def continue_study(
    study: Study,
    path: str | os.PathLike[str] | None = None,
    *,
    seeds: str | os.PathLike[str] | None = None,
    workers: int | None = None,
    overwrite: bool = False,
    resume: bool = False,
    say: Say = lambda text: None,
) -> ContinuationResult:
    """Continue ``study``, from the results file ``seeds`` in place of its own seeds if
    given, into ``path`` if given.

    Finished branches are saved next to ``path`` until the file is written, and
    ``resume`` continues from them; the text of a KeyboardInterrupt says so. A finished
    file of the same study is returned as it is. InputError where the study cannot be
    continued.
    """
    setup = continuation_setup(study)
    if path is not None and resume and not overwrite and os.path.lexists(path) and not part_path(path).exists():
        return _finished(study, path)
    if path is None:
        return _continue(setup, None, None, seeds, workers, overwrite, say)
    with Part.claim(path, WHAT, study.model.name, overwrite=overwrite, resume=resume) as part:
        return _continue(setup, path, part, seeds, workers, overwrite, say)


def _continue(
    setup: ContinuationSetup,
    path: str | os.PathLike[str] | None,
    part: Part | None,
    seeds: str | os.PathLike[str] | None,
    workers: int | None,
    overwrite: bool,
    say: Say,
) -> ContinuationResult:
    study, continuation = setup.study, setup.continuation
    started_at = time.perf_counter()
    keys = (continuation.along,)
    scale = (continuation.high - continuation.low) / RANGE_PARTS
    flow = setup.flow(keys, (scale,), workers or processors())
    grazes = _grazes(study, flow)
    orders = Orders(
        continuation.lobes,
        (continuation.low, continuation.high),
        continuation.points,
        continuation.switch,
        "periodic" in continuation.motions,
        bool({"rolling", "stick_slip"} & {*continuation.motions}),
        "rolling" in continuation.motions,
        grazes,
    )
    seed_points = _seeds(setup, flow, seeds, say)
    digest = _digest(study, seed_points)
    known = _load_branches(part, digest) if part is not None and part.kept else {}
    branches = dict(known)

    def save(finished: dict[Any, Branch]) -> None:
        branches.update(finished)
        number, points = len(branches), sum(map(len, branches.values()))
        kept = f"{number} branch{'' if number == 1 else 'es'}, {points} points"
        if part is not None:
            arrays, data = to_arrays(branches)
            part.write(digest, data, arrays, kept)
        say(f"so far {kept}")

    explorer = Explorer(flow, orders, known, save, interrupt.check, Following(say).watch)
    try:
        with interrupt.interruptible():
            found = explorer.run(seed_points)
    except KeyboardInterrupt:
        raise KeyboardInterrupt(_interrupted(part, branches)) from None
    if not found.branches:
        raise InputError(_no_branch(study, found, seed_points))
    try:
        if words := dropped_words(len(branches), len(found.branches)):
            say(words)
        with interrupt.interruptible():
            say(f"measuring {sum(map(len, found.branches))} points")
            data = dataset_of(setup, flow, found)
            if continuation.curves is not None:
                say("curves")
                data = with_curves(setup, data, found, workers or processors())
    except KeyboardInterrupt:
        raise KeyboardInterrupt(_interrupted(part, branches)) from None
    if path is not None:
        remedy = "" if part is None else f"{part.kept} are safe in {part.path}. Go on with --resume."
        write_branches(path, data, lambda: remedy, overwrite=overwrite or bool(known))
        if part is not None:
            part.discard()
    return ContinuationResult(data, dict(Counter(found.seeds)), time.perf_counter() - started_at)


def _grazes(study: Study, flow: Flow) -> dict[int, Graze]:
    """The labels for reaching and losing each contact and level, by its place."""
    codes = {(one.contact, one.when): one.code for one in study.model.grazing}
    equations = flow.equations
    return {
        place: Graze(codes.get((name, "reached")), codes.get((name, "lost")), place < len(equations.contacts))
        for place, name in enumerate((*equations.contacts, *equations.levels))
    }


def _interrupted(part: Part | None, branches: Mapping[Any, Branch]) -> str:
    """The text of an interrupt."""
    if part is None:
        return interrupt.NOTHING
    if not branches:
        return "Interrupted before the first branches had ended: nothing is kept. The same command begins anew."
    return f"Interrupted: {len(branches)} branches are safe in {part.path}. Go on with --resume."


def _no_branch(study: Study, found: Found, seeds: list[Seed]) -> str:
    """The error where no seed led to a branch."""
    outcomes = (
        "; ".join(f"{count} of {len(seeds)}: {word}" for word, count in Counter(found.seeds).items())
        or "no seeds at all"
    )
    return (
        f"{study.source or 'the study'}: found no motion to follow from its seeds ({outcomes}); "
        f"allowed: seeds that have "
        "settled on a motion that repeats. Give others (continue.seeds or --seeds), let them "
        "settle for longer "
        "(simulation.transient), or try longer periods (continue.lobes)."
    )


# Seeds


def _seeds(setup: ContinuationSetup, flow: Flow, path: str | os.PathLike[str] | None, say: Say) -> list[Seed]:
    continuation = setup.continuation
    source = path if path is not None else continuation.seeds
    if isinstance(source, str | os.PathLike):
        return _seeds_in(setup, Path(source))
    return _settled(setup, flow, np.array(source[continuation.along], dtype=float), say)


def _settled(setup: ContinuationSetup, flow: Flow, numbers: Array, say: Say) -> list[Seed]:
    """The motions on which the starts of the study settle at ``numbers`` [n] (SI) of
    the continued number, preceded by one start of each as a seed of a steady motion."""
    study, model = setup.study, setup.model
    starts = max(1, study.initial.starts)
    at = np.repeat(numbers, starts)[:, None]
    values = setup.values(at, (setup.continuation.along,))
    state = model.starts(values, np.tile(np.arange(starts), len(numbers)))
    states, phase = state[:, :-1], state[:, -1]
    first = [Seed(one, float(angle), value, steady=True) for one, angle, value in zip(states, phase, at, strict=True)]
    duration = study.simulation.transient + study.simulation.observe
    say(f"{len(at)} motions settle for {duration:g} s")
    ok = np.ones(len(at), dtype=bool)
    pieces, following = max(1, int(np.ceil(duration / 20.0))), Following(say)
    for piece in range(pieces):
        interrupt.check()
        following.settled(piece * duration / pieces, duration)
        span = np.full(len(at), duration / pieces)
        ends = flow.run(Legs(states, phase, span, at, np.zeros(len(at), dtype=bool)))
        ok &= ends.ok
        states = np.where(ok[:, None], ends.state, states)
        phase = phase + flow.phase_rate(at) * span
    settled = [
        Seed(one, float(angle), value, near=True)
        for one, angle, value, is_ok in zip(states, phase, at, ok, strict=True)
        if is_ok
    ]
    return [*first[::starts], *settled]


def _seeds_in(setup: ContinuationSetup, path: Path) -> list[Seed]:
    """The settled points of a results file with the same string and, except for the
    continued number, the same operating point as the study, from all of its starts."""
    study, continuation = setup.study, setup.continuation
    results = read_results(path, ("status", "settled", "final_state"))
    if str(results.attrs.get("model", study.model.name)) != study.model.name:
        raise FileError(
            f"{path}: made with the model {results.attrs['model']}, the study has "
            f"{study.model.name}. Choose "
            "results of the same model as seeds."
        )
    source = resolved_study(results.attrs)
    free = {continuation.along, *source.get("sweep", {})}
    keys = [key for key, _, _ in string_differences(source, study.resolved, free)]
    if source.get("uncertain") != study.resolved.get("uncertain"):
        keys.append("uncertain")
    if keys:
        changes = changes_text(source, study.resolved, keys)
        raise FileError(f"{path}: made with another string ({changes}). Choose results of the same string as seeds.")
    selected = np.ones(results.shape, dtype=bool)
    name_along = dimension_of(continuation.along)
    if name_along not in results.axes and continuation.along in OPERATION:
        raise FileError(f"{path}: found no {continuation.along}. Choose results of a sweep as seeds.")
    from_other_starts = {one.name for one in results.more if one.key.startswith("initial.")}
    for place, name in enumerate(results.grid):
        if name in ("procedure", "start", "sample", name_along) or name in from_other_starts:
            continue
        wanted = _number_of(study, name)
        values = results.coords[name]
        near = int(np.argmin(np.abs(values - wanted)))
        if abs(values[near] - wanted) > 1e-6 * max(abs(wanted), 1e-300):
            low, high, own = (word_or_number(name, one) for one in (values[0], values[-1], wanted))
            raise FileError(
                f"{path}: found {name} from {low} to {high}, of which none is {own}, as in the "
                f"study; allowed: results that have the study's {name}, or --set a value that "
                f"they have."
            )
        shape = [1] * len(results.shape)
        shape[place] = len(values)
        selected &= (np.arange(len(values)) == near).reshape(shape)
    numbers = results.coords[name_along] if name_along in results.grid else np.array([_number_of(study, name_along)])
    good = selected & (results["status"] == OK) & (results["settled"] == 1)
    seeds = []
    for index in np.argwhere(good):
        number = float(numbers[index[results.grid.index(name_along)]] if name_along in results.grid else numbers[0])
        if continuation.low <= number <= continuation.high:
            state = results["final_state"][tuple(index)]
            seeds.append(Seed(state[:-1], float(state[-1]), np.array([number])))
    if not seeds:
        raise FileError(
            f"{path}: found no settled point between the ends of continue.from and continue.to; "
            f"allowed: results with "
            "some. Run the sweep for longer (simulation.transient), or widen the range."
        )
    return seeds


def _number_of(study: Study, name: str) -> float:
    """The value in the study [SI] along the axis whose dimension has this name."""
    if name in OPERATION:
        return float(getattr(study.operation, name))
    key = next(key for key in study.keys.axes if dimension_of(key) == name)
    value: Any = study.resolved
    for part in key.split("."):
        value = value[part]
    return as_value(key, value)


# The branches of an unfinished continuation


def _digest(study: Study, seeds: list[Seed]) -> str:
    """Digest of all inputs that decide the branches."""
    digest = hashlib.sha256(study.sha256.encode())
    digest.update(json_text(study.resolved.get(SECTION)).encode())
    for one in seeds:
        digest.update(one.state.tobytes() + one.values.tobytes() + np.float64(one.phase).tobytes())
    return digest.hexdigest()


def _load_branches(part: Part, digest: str) -> dict[Any, Branch]:
    """The branches in ``part``; FileError where they are of another continuation."""
    data, arrays = part.read(digest, "another study or from other seeds")
    try:
        return from_arrays(arrays, data)
    except (ValueError, KeyError, TypeError, IndexError) as error:
        raise part.damaged(error) from error


# The Dataset


def dataset_of(setup: ContinuationSetup, flow: Flow, found: Found) -> Any:
    """The Dataset of branches."""
    import xarray

    study, continuation, model = setup.study, setup.continuation, setup.model
    branches = found.branches
    points: list[Point] = [one.point for branch in branches for one in branch.marked]
    labels = np.array([one.label for branch in branches for one in branch.marked], dtype=np.int16)
    rows = np.array([len(branch) for branch in branches], dtype=np.int64)
    numbers = np.array([point.found.values[-1] for point in points])
    names = model.states(setup.variant)
    finer = finer_multipliers(flow, branches, interrupt.check)
    widest = max(map(len, finer))
    multipliers = np.full((len(points), widest), np.nan + 0j)
    for place, values in enumerate(finer):
        multipliers[place, : len(values)] = values[np.argsort(-np.abs(values), kind="stable")]
    states = np.stack([point.found.state for point in points])
    periods = np.array([point.found.period for point in points])
    coordinates: dict[str, Any] = {}
    for name in OPERATION:
        value = numbers if name == continuation.along else np.full(len(points), getattr(study.operation, name))
        coordinates[name] = ("point", value, _axis_attrs(study, name))
    if continuation.along not in OPERATION:
        coordinates[dimension_of(continuation.along)] = ("point", numbers, _axis_attrs(study, continuation.along))
    meanings = meanings_of(study.model)
    flags = {
        "flag_values": np.array([*meanings], np.int16),
        "flag_meanings": " ".join(one.name for one in meanings.values()),
    }
    contacts = (*flow.equations.contacts, *flow.equations.levels)
    touches = np.stack([point.found.touches[:, 2] for point in points]) if contacts else None
    data: dict[str, Any] = {
        "motion": ("branch", np.array([one.motion for one in branches], dtype=object), {"long_name": "kind of motion"}),
        "lobes": ("branch", np.array([one.lobes for one in branches], np.int64), _dimensionless("period in lobes")),
        "parent": (
            "branch",
            np.array([one.parent for one in branches], np.int64),
            _dimensionless("number of the branch from which it springs, -1 for none"),
        ),
        "parent_point": (
            "branch",
            np.array([one.parent_point for one in branches], np.int64),
            _dimensionless("point of the parent, counted within it, at which it springs; -1 for none"),
        ),
        "closed": (
            "branch",
            np.array([one.closed for one in branches], np.int8),
            _dimensionless("1 for a closed branch"),
        ),
        "end_reason": (
            "branch",
            np.array([one.end_reason for one in branches], dtype=object),
            {"long_name": "why the branch ends"},
        ),
        "row_size": ("branch", rows, {**_dimensionless("number of points of the branch"), "sample_dimension": "point"}),
        "branch_of_point": ("point", np.repeat(np.arange(len(branches)), rows), _dimensionless("number of the branch")),
        "label": ("point", labels, {**_dimensionless("kind of special point"), **flags}),
        "label_note": (
            "point",
            np.array([one.words for b in branches for one in b.marked], dtype=object),
            {"long_name": "what the label means here beyond its kind"},
        ),
        "period": ("point", periods, {"units": "s", "long_name": "period; of circles the time between two lobes"}),
        "rotation_number": (
            "point",
            np.array([point.found.rotation for point in points]),
            {"units": "rad", "long_name": "rotation of an invariant circle over a lobe"},
        ),
        "multiplier_real": (
            ("point", "multiplier"),
            multipliers.real,
            _dimensionless("Floquet multipliers, real parts"),
        ),
        "multiplier_imag": (
            ("point", "multiplier"),
            multipliers.imag,
            _dimensionless("Floquet multipliers, imaginary parts"),
        ),
        "unstable": (
            "point",
            np.array([unstable_beside(one) for b in branches for one in b.marked], np.int16),
            _dimensionless(
                "number of multipliers outside the unit circle; 0: stable; at a bifurcation that "
                "of its more stable side"
            ),
        ),
        "arclength": (
            "point",
            np.array([point.s for point in points]),
            _dimensionless("arclength from the branch's begin"),
        ),
        "iterations": (
            "point",
            np.array([point.iterations for point in points], np.int16),
            _dimensionless("iterations of Newton's method"),
        ),
        "residual": (
            "point",
            np.array([point.residual for point in points]),
            _dimensionless("residual in natural scales"),
        ),
        "state": (("point", "state_name"), states, {"long_name": "state at the drive angle 0, in SI"}),
        **(
            {"touches": (("point", "contact"), touches, _dimensionless("how often in a period a contact begins"))}
            if touches is not None
            else {}
        ),
    }
    circles = np.repeat([one.motion == CIRCLE for one in branches], rows)
    features = _features(setup, states, periods, numbers, circles, np.nanmax(np.abs(multipliers), axis=1))
    known = {variable.name: variable for variable in study.model.features}
    for name, values in features.items():
        if name in known:
            data[name] = ("point", values, {"units": known[name].units, "long_name": known[name].long_name})
    coords = {
        **coordinates,
        "state_name": ("state_name", np.array(names, dtype=object), {"long_name": "state name"}),
        **({"contact": ("contact", np.array(contacts, dtype=object), {"long_name": "contact"})} if contacts else {}),
    }
    attrs = {
        **provenance(study, "continue"),
        "nsdrill_kind": "branches",
        "along": dimension_of(continuation.along),
        "along_key": continuation.along,
        "continue_from": continuation.low,
        "continue_to": continuation.high,
        "seeds": json_text(dict(Counter(found.seeds))),
        "rtol": flow.rtol,
    }
    return xarray.Dataset(data, coords, attrs)


def _dimensionless(text: str) -> dict[str, Any]:
    """The attributes of a variable without units."""
    return {"units": "1", "long_name": text}


def _axis_attrs(study: Study, key: str) -> dict[str, Any]:
    """The attributes of the coordinate of an axis."""
    leaf = study.keys.axes[key]
    resolved = study.keys.leaf(leaf.key, study.resolved)
    return {"units": CF[resolved.units], "long_name": resolved.meaning or key, "key": leaf.key}


def _features(
    setup: ContinuationSetup, states: Array, periods: Array, numbers: Array, circles: Array, largest: Array
) -> dict[str, Array]:
    """The features of every point, as in a results file, observed over one period, on a
    circle over many; NaN where the motion is too unstable to be followed that long.

    ``states`` [n, states] and ``periods`` [s] are those of the motions at ``numbers``
    (SI) of the continued number, ``circles`` those on invariant circles, and
    ``largest`` their largest multipliers in absolute value; all but ``states`` [n]."""
    study, model = setup.study, setup.model
    record = Record(peaks=1)
    lanes = choose_lanes(1000)
    variant = Compiled(study.model, setup.variant)
    rows, width = variant.rows, model.outcome_width(record, setup.variant)
    n = len(states)
    durations = np.where(circles, CIRCLE_PERIODS * periods, periods)
    values = setup.values(numbers[:, None], (setup.continuation.along,))
    table = model.pack(values, study.thresholds)
    runs = model.runs(table, setup.variant, np.concatenate([states, np.zeros((n, 1))], axis=1))
    runs = replace(runs, transient=np.zeros(n), observe=durations)
    store = model.store(lanes, study.parameters, record)
    batch = Batch(lanes, n, rows, store, width, Simulation(0.0, 1.0, rtol=1e-9, max_steps=50_000_000))
    batch.add_many(np.arange(n), runs)
    outcome, ok, parameters = np.zeros((n, width)), np.zeros(n, dtype=bool), np.zeros_like(table)
    parts = compiled_parts(lanes, variant)
    remaining = n
    while remaining:
        interrupt.check()
        done = batch.advance(parts, 1.0, True)
        outcome[done.job], ok[done.job] = done.outcome, done.status == OK
        parameters[done.job] = done.parameters
        remaining -= len(done.job)
    features = model.features(
        outcome,
        parameters,
        durations,  # type: ignore[arg-type]
        setup.variant,
    )
    good = ok & stays_on_motion(largest, circles)
    return {name: np.where(good, value, np.nan) for name, value in features.items()}


def stays_on_motion(largest: Array, circles: Array) -> Array:
    """Whether a run stays on the motion for the observation time: bool [n]. ``largest``
    [n] is the largest multiplier over a period in absolute value; motions on
    ``circles`` (bool [n]) are observed over many periods."""
    with np.errstate(over="ignore"):
        return ~(largest ** np.where(circles, CIRCLE_PERIODS, 1) > UNSTABLE)


# Curves


def conditions_of(setup: ContinuationSetup) -> dict[int, Condition]:
    """The conditions that hold along the curves of the study, by the label of the
    points that the curves continue."""
    curves, model = setup.continuation.curves, setup.model
    assert curves is not None
    conditions = {}
    if "fold" in curves.of:
        conditions[FOLD] = Condition(multiplier=1.0)
    if "doubling" in curves.of:
        conditions[DOUBLING] = Condition(multiplier=-1.0)
    if "torus" in curves.of:
        conditions[TORUS] = Condition(pair=True)
    if "hopf" in curves.of:
        conditions[HOPF] = Condition(pair=True)
    for one in setup.study.model.grazing:
        if one.border in curves.of:
            place = model.contacts.index(one.contact)
            conditions[one.code] = Condition(contact=place, which=1 if one.when == "reached" else 0)
    return conditions


def with_curves(setup: ContinuationSetup, data: Any, found: Found, workers: int) -> Any:
    """``data`` with the curves along which special points continue in the plane of the
    continued number and a second one."""
    continuation, study = setup.continuation, setup.study
    curves = continuation.curves
    assert curves is not None
    scales = ((continuation.high - continuation.low) / RANGE_PARTS, (curves.high - curves.low) / RANGE_PARTS)
    contacts, known = setup.model.contacts, dict[str, Flow]()

    def flows(condition: Condition) -> Flow:
        # A motion that just reaches a contact is also a motion without that contact,
        # whose equations are smooth.
        name = "" if condition.of_monodromy or not condition.which else contacts[condition.contact]
        if name not in known:
            known[name] = setup.flow((continuation.along, curves.over), scales, workers, name)
        return known[name]

    start = _number_of(study, dimension_of(curves.over))
    ranges = ((continuation.low, continuation.high), (curves.low, curves.high))
    border_curves = borders(flows, found.branches, conditions_of(setup), start, ranges, curves.points, interrupt.check)
    points = [point for one in border_curves for point in one.points]
    numbers = np.array([point.found.values for point in points]).reshape(-1, 2)
    along, over = dimension_of(continuation.along), dimension_of(curves.over)
    ends = [" ; ".join(dict.fromkeys(ENDINGS.get(word, word) for word in one.ended)) for one in border_curves]
    return data.assign(
        curve_label=("curve", np.array([one.label for one in border_curves], np.int16), dict(data["label"].attrs)),
        curve_motion=(
            "curve",
            np.array([one.motion for one in border_curves], dtype=object),
            {"long_name": "kind of motion"},
        ),
        curve_lobes=(
            "curve",
            np.array([one.lobes for one in border_curves], np.int64),
            _dimensionless("period in lobes"),
        ),
        curve_branch=(
            "curve",
            np.array([one.branch for one in border_curves], np.int64),
            _dimensionless("a branch that it passes"),
        ),
        curve_end_reason=("curve", np.array(ends, dtype=object), {"long_name": "why the curve ends"}),
        curve_row_size=(
            "curve",
            np.array([len(one.points) for one in border_curves], np.int64),
            {**_dimensionless("number of points of the curve"), "sample_dimension": "curve_point"},
        ),
        curve_unstable=(
            "curve_point",
            np.array([point.found.unstable for point in points], np.int16),
            _dimensionless("number of multipliers outside the unit circle"),
        ),
        **{
            f"curve_{along}": ("curve_point", numbers[:, 0], _axis_attrs(study, continuation.along)),
            f"curve_{over}": ("curve_point", numbers[:, 1], _axis_attrs(study, curves.over)),
        },
    ).assign_attrs(over=over, over_key=curves.over)
