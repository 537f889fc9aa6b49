"""The Dataset of branches: their points with stability, special points and features, and
curves of special points in a second number."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from nsdrill import interrupt
from nsdrill.analysis.bifurcations import (
    CIRCLE,
    CRITICALITY_NAMES,
    DOUBLING,
    EQUILIBRIUM,
    FOLD,
    FOLLOWED,
    HOPF,
    NOT_DECIDED,
    NOT_FOLLOWED,
    NOTHING_SPRINGS,
    SPRING_NAMES,
    SPRING_NOT_KNOWN,
    SPRINGS,
    TORUS,
    meanings_of,
    seed_text,
)
from nsdrill.app.experiment import provenance
from nsdrill.app.following.bending import bending_of
from nsdrill.app.following.seeding import RANGE_PARTS, ContinuationSetup, number_of
from nsdrill.app.telling import Telling
from nsdrill.data import Array, Attributes, json_text
from nsdrill.kernel.batch import Batch, choose_lanes
from nsdrill.kernel.settings import Simulation
from nsdrill.observe.thresholds import Record
from nsdrill.orbit.borders import Condition, Frame, borders
from nsdrill.orbit.branch import end_reason, finer_multipliers
from nsdrill.orbit.explore import Found
from nsdrill.orbit.flow import Flow
from nsdrill.orbit.normal_form import NormalForm, normal_forms
from nsdrill.orbit.special import unstable_beside
from nsdrill.study.study import Study
from nsdrill.sweep.work import Program, compiled_parts
from nsdrill.units import cf_units
from nsdrill.variables import OK, dimension_of

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, DTypeLike
    from xarray import Dataset


Variable = tuple[str | tuple[str, ...], Array, Attributes]  # dimensions, values and attributes
CIRCLE_PERIODS = 200  # of a motion on an invariant circle, over which its features are measured
BENT = "1 for an equilibrium at which the equations bend, whose stability no linear theory tells"
UNSTABLE = 1e6  # largest multiplier of a motion that an integration still follows


def _numbers(dims: str | tuple[str, ...], values: ArrayLike, meaning: str, units: str = "1", **attrs: Any) -> Variable:
    """A variable of numbers."""
    return dims, np.asarray(values), {"units": units, "long_name": meaning, **attrs}


def _counts(dim: str, values: Iterable[int], meaning: str, dtype: DTypeLike = np.int64, **attrs: Any) -> Variable:
    """A variable of whole numbers."""
    return _numbers(dim, np.array([*values], dtype), meaning, **attrs)


def _words(dim: str, values: Iterable[str], meaning: str) -> Variable:
    """A variable of words."""
    return dim, np.array([*values], dtype=object), {"long_name": meaning}


def _periods(setup: ContinuationSetup) -> str:
    """That in which periods are counted."""
    return "lobes" if setup.study.model.drills else "periods"


def dataset_of(setup: ContinuationSetup, flow: Flow, found: Found, *, as_kept: bool = False) -> Dataset:
    """The Dataset of branches. With ``as_kept`` multipliers are those with which branches
    were followed, and coefficients of normal forms, which take long, are not known."""
    import xarray

    study, continuation, branches = setup.study, setup.continuation, found.branches
    orbits = [entry.point.found for branch in branches for entry in branch.marked]
    numbers = np.array([orbit.values[-1] for orbit in orbits])
    keys = dict.fromkeys((*study.operation.names(), continuation.along))
    at = {
        dimension_of(key): numbers if key == continuation.along else np.full(len(orbits), number_of(study, key))
        for key in keys
    }
    contacts = (*flow.equations.contacts, *flow.equations.levels)
    coordinates = {
        **{dimension_of(key): ("point", at[dimension_of(key)], _axis_attrs(study, key)) for key in keys},
        "state_name": _words("state_name", setup.variant.states, "state name"),
        **({"contact": _words("contact", contacts, "contact")} if contacts else {}),
    }
    data = {**_branch_variables(setup, found), **_point_variables(setup, flow, found, as_kept)}
    if contacts:
        touches = np.stack([orbit.touches[:, 2] for orbit in orbits])
        data["touches"] = _numbers(("point", "contact"), touches, "how often in a period a contact begins")
    circles = np.repeat([one.motion == CIRCLE for one in branches], [len(one) for one in branches])
    largest = np.nanmax(np.abs(data["multiplier_real"][1] + 1j * data["multiplier_imag"][1]), axis=1)
    features = _features(setup, data["state"][1], data["period"][1], numbers, circles, largest)
    known = {variable.name: variable for variable in study.model.features}
    data |= {
        name: _numbers("point", values, known[name].long_name, known[name].units)
        for name, values in features.items()
        if name in known
    }
    attrs = {
        **provenance(study, "branches"),
        "nsdrill_kind": "branches",
        "along": dimension_of(continuation.along),
        "along_key": continuation.along,
        "continue_from": continuation.low,
        "continue_to": continuation.high,
        "seeds": json_text(dict(Counter(seed_text(one, study.model) for one in found.seeds))),
        "rtol": flow.rtol,
    }
    return xarray.Dataset(data, coordinates, attrs)


def _branch_variables(setup: ContinuationSetup, found: Found) -> dict[str, Variable]:
    """The variables of whole branches, and to which branch each point belongs."""
    branches = found.branches
    sizes = [len(one) for one in branches]
    springs = "number of the branch from which it springs, -1 for none"
    place = "point of the parent, counted within it, at which it springs; -1 for none"
    size = "number of points of the branch"
    of_point = np.repeat(np.arange(len(branches)), sizes)
    return {
        "motion": _words("branch", (one.motion for one in branches), "kind of motion"),
        "lobes": _counts("branch", (one.lobes for one in branches), f"period in {_periods(setup)}"),
        "parent": _counts("branch", (one.parent for one in branches), springs),
        "parent_point": _counts("branch", (one.parent_point for one in branches), place),
        "closed": _counts("branch", (one.closed for one in branches), "1 for a closed branch", np.int8),
        "end_reason": _words("branch", (one.end_reason for one in branches), "why the branch ends"),
        "row_size": _counts("branch", sizes, size, sample_dimension="point"),
        "branch_of_point": _counts("point", of_point, "number of the branch"),
    }


def _point_variables(setup: ContinuationSetup, flow: Flow, found: Found, as_kept: bool) -> dict[str, Variable]:
    """The variables of points that continuation itself knows."""
    entries = [entry for branch in found.branches for entry in branch.marked]
    points = [entry.point for entry in entries]
    orbits = [point.found for point in points]
    kept = [orbit.multipliers for orbit in orbits]
    finer = kept if as_kept else finer_multipliers(flow, found.branches, interrupt.check)
    multipliers = np.full((len(points), max(map(len, finer))), np.nan + 0j)
    for place, values in enumerate(finer):
        multipliers[place, : len(values)] = values[np.argsort(-np.abs(values), kind="stable")]
    meanings = meanings_of(setup.study.model)
    flags = {
        "flag_values": np.array([*meanings], np.int16),
        "flag_meanings": " ".join(one.name for one in meanings.values()),
    }
    period = f"period; of circles the time between two {_periods(setup)}"
    rotation = f"rotation of an invariant circle over a {_periods(setup).removesuffix('s')}"
    outside = (
        "number of multipliers outside the unit circle; 0: stable; -1: not decided, as one lies on the circle within "
        "its error; at a bifurcation that of its more stable side"
    )
    iterations, of_multiplier = (point.iterations for point in points), ("point", "multiplier")
    states = np.stack([orbit.state for orbit in orbits])
    unknown = [NormalForm()] * len(points)
    forms = unknown if as_kept else normal_forms(flow, found.branches, interrupt.check)
    sides = [form.criticality(entry.label) for form, entry in zip(forms, entries, strict=True)]
    side_flags = {
        "flag_values": np.array([*CRITICALITY_NAMES], np.int8),
        "flag_meanings": " ".join(CRITICALITY_NAMES.values()),
    }
    spring_flags = {"flag_values": np.array([*SPRING_NAMES], np.int8), "flag_meanings": " ".join(SPRING_NAMES.values())}
    is_bent = bending_of(setup, flow)
    bent = np.array(
        [
            branch.motion == EQUILIBRIUM and is_bent(entry.point.found)
            for branch in found.branches
            for entry in branch.marked
        ]
    )
    unstable = np.where(bent, NOT_DECIDED, [*map(unstable_beside, entries, finer)])
    form = "coefficient of the normal form, in natural scales: of a Hopf bifurcation the first Lyapunov coefficient"
    return {
        "label": _counts("point", (entry.label for entry in entries), "kind of special point", np.int16, **flags),
        "label_note": _words("point", (entry.words for entry in entries), "what the label means here beyond its kind"),
        "criticality": _counts(
            "point", sides, "what emanates at a Hopf bifurcation or doubling", np.int8, **side_flags
        ),
        "springs": _counts(
            "point", _springs(found), "whether the branch that springs there was followed", np.int8, **spring_flags
        ),
        "normal_form": _numbers("point", [one.coefficient for one in forms], f"{form}, of a doubling c of -x + c x^3"),
        "normal_form_error": _numbers("point", [one.error for one in forms], "error of the coefficient"),
        "period": _numbers("point", [orbit.period for orbit in orbits], period, "s"),
        "rotation_number": _numbers("point", [orbit.rotation for orbit in orbits], rotation, "rad"),
        "multiplier_real": _numbers(of_multiplier, multipliers.real, "Floquet multipliers, real parts"),
        "multiplier_imag": _numbers(of_multiplier, multipliers.imag, "Floquet multipliers, imaginary parts"),
        "unstable": _counts("point", unstable, outside, np.int16),
        # only where there are any: files of other equations are as they were
        **({"bends": _counts("point", bent, BENT, np.int8)} if bent.any() else {}),
        "arclength": _numbers("point", [point.s for point in points], "arclength from the branch's begin"),
        "iterations": _counts("point", iterations, "iterations of Newton's method", np.int16),
        "residual": _numbers("point", [point.residual for point in points], "residual in natural scales"),
        "state": (("point", "state_name"), states, {"long_name": "state at the drive angle 0, in SI"}),
    }


def _springs(found: Found) -> Iterator[int]:
    """Of each point whether the branch that springs from it was followed."""
    for number, branch in enumerate(found.branches):
        for index, entry in enumerate(branch.marked):
            if entry.label not in SPRINGS:
                yield NOTHING_SPRINGS
            elif found.sprung is None:
                yield SPRING_NOT_KNOWN
            else:
                yield FOLLOWED if (number, index) in found.sprung else NOT_FOLLOWED


def _axis_attrs(study: Study, key: str) -> Attributes:
    """The attributes of the coordinate of an axis."""
    leaf = study.keys.axes[key]
    resolved = study.keys.leaf(leaf.key, study.resolved)
    return {"units": cf_units(resolved.units), "long_name": resolved.meaning or key, "key": leaf.key}


def _features(
    setup: ContinuationSetup, states: Array, periods: Array, numbers: Array, circles: Array, largest: Array
) -> dict[str, Array]:
    """The features of every point, as in a results file, observed over one period, on a
    circle over many; NaN where the motion is too unstable to be followed that long.

    ``states`` [n, states] and ``periods`` [s] are those of the motions at ``numbers``
    (SI) of the continued number, ``circles`` those on invariant circles, and
    ``largest`` their largest multipliers in absolute value; all but ``states`` [n]."""
    study, variant = setup.study, setup.variant
    record = Record(peaks=1)
    lanes = choose_lanes(1000)
    program = Program(variant)
    rows, width = program.rows, variant.outcome_width(record)
    n = len(states)
    durations = np.where(circles, CIRCLE_PERIODS * periods, periods)
    values = setup.values(numbers[:, None], (setup.continuation.along,))
    table = variant.model.pack(values, study.thresholds)
    runs = variant.runs(table, np.concatenate([states, np.zeros((n, 1))], axis=1))
    runs = replace(runs, transient=np.zeros(n), observe=durations)
    store = variant.store(lanes, record)
    batch = Batch(lanes, n, rows, store, width, Simulation(0.0, 1.0, rtol=1e-9, max_steps=50_000_000))
    batch.add_many(np.arange(n), runs)
    outcome, ok, parameters = np.zeros((n, width)), np.zeros(n, dtype=bool), np.zeros_like(table)
    parts = compiled_parts(lanes, program)
    remaining = n
    while remaining:
        interrupt.check()
        done = batch.advance(parts, 1.0, True)
        outcome[done.job], ok[done.job] = done.outcome, done.status == OK
        parameters[done.job] = done.parameters
        remaining -= len(done.job)
    features = variant.features(outcome, parameters, durations)
    good = ok & stays_on_motion(largest, circles)
    return {name: np.where(good, value, np.nan) for name, value in features.items()}


def stays_on_motion(largest: Array, circles: Array) -> Array:
    """Whether a run stays on the motion for the observation time: bool [n]. ``largest``
    [n] is the largest multiplier over a period in absolute value; motions on
    ``circles`` (bool [n]) are observed over many periods."""
    with np.errstate(over="ignore"):
        return ~(largest ** np.where(circles, CIRCLE_PERIODS, 1) > UNSTABLE)


def conditions_of(setup: ContinuationSetup) -> dict[int, Condition]:
    """The conditions that hold along the curves of the study, by the label of the
    points that the curves continue."""
    curves, contacts = setup.continuation.curves, setup.model.contacts
    assert curves is not None
    of_multipliers = {
        "fold": (FOLD, Condition(multiplier=1.0)),
        "doubling": (DOUBLING, Condition(multiplier=-1.0)),
        "torus": (TORUS, Condition(pair=True)),
        "hopf": (HOPF, Condition(pair=True)),
    }
    grazing = {
        one.code: Condition(contact=contacts.index(one.contact), which=1 if one.when == "reached" else 0)
        for one in setup.study.model.grazing
        if one.border in curves.of
    }
    return dict(condition for name, condition in of_multipliers.items() if name in curves.of) | grazing


def with_curves(setup: ContinuationSetup, data: Dataset, found: Found, workers: int, told: Telling) -> Dataset:
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

    start = number_of(study, dimension_of(curves.over))
    frame = Frame(start, ((continuation.low, continuation.high), (curves.low, curves.high)), curves.points)
    lines = borders(flows, found.branches, conditions_of(setup), frame, interrupt.check, told.begins)
    points = [point for one in lines for point in one.points]
    numbers = np.array([point.found.values for point in points]).reshape(-1, 2)
    along, over = dimension_of(continuation.along), dimension_of(curves.over)
    size, outside = "number of points of the curve", "number of multipliers outside the unit circle"
    return data.assign(
        curve_label=("curve", np.array([one.label for one in lines], np.int16), dict(data["label"].attrs)),
        curve_motion=_words("curve", (one.motion for one in lines), "kind of motion"),
        curve_lobes=_counts("curve", (one.lobes for one in lines), f"period in {_periods(setup)}"),
        curve_branch=_counts("curve", (one.branch for one in lines), "a branch that it passes"),
        curve_end_reason=_words(
            "curve", (end_reason(one.ended, "continue.curves.points") for one in lines), "why the curve ends"
        ),
        curve_row_size=_counts("curve", (len(one.points) for one in lines), size, sample_dimension="curve_point"),
        curve_unstable=_counts("curve_point", (point.found.unstable for point in points), outside, np.int16),
        **{
            f"curve_{along}": ("curve_point", numbers[:, 0], _axis_attrs(study, continuation.along)),
            f"curve_{over}": ("curve_point", numbers[:, 1], _axis_attrs(study, curves.over)),
        },
    ).assign_attrs(over=over, over_key=curves.over)
