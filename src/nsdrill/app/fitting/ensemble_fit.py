"""Adjust the unknown numbers of a study to measurements: run an ensemble, weight it,
and assess what the data determine."""

from __future__ import annotations

import copy
import math
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from dataclasses import field, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import ndtr
from scipy.stats import chi2

from nsdrill.analysis.counts import FIT_DOUBTS
from nsdrill.analysis.fitting import (
    GOOD_GAIN,
    LEAST_GAIN,
    SURE,
    TIGHT,
    Array,
    Measured,
    Posterior,
    end_pressed,
    posterior,
)
from nsdrill.app.check import check_large
from nsdrill.app.fitting.headings import SEVERAL
from nsdrill.app.fitting.history import two_motions
from nsdrill.app.fitting.names import PERIOD
from nsdrill.app.running.place import place_for
from nsdrill.app.running.run import check_sweep, checked_workers
from nsdrill.app.running.stages import Watch, compiling
from nsdrill.app.running.unfinished import Rounds
from nsdrill.data import Answer
from nsdrill.errors import ENDINGS, WITHOUT, FileError, InputError, count, option
from nsdrill.files import amount
from nsdrill.kernel.batch import choose_lanes, widened
from nsdrill.models.registry import BY_NAME
from nsdrill.observe.channels import LEAST_CYCLES
from nsdrill.observe.thresholds import LEAST_PEAKS, Record
from nsdrill.quantity import quantity
from nsdrill.records import dataclass
from nsdrill.sampling import Numbers, Pair, in_order, quantile, rounded
from nsdrill.study.keys import Leaf
from nsdrill.study.load import parse_study
from nsdrill.study.study import Study
from nsdrill.study.uncertain import HOW
from nsdrill.study.write import study_text
from nsdrill.sweep.engine import Engine, Progress
from nsdrill.sweep.plan import Rows
from nsdrill.sweep.work import Work, compiled_parts
from nsdrill.units import plain_units
from nsdrill.variables import OK

if TYPE_CHECKING:
    from matplotlib.figure import Figure

QUANTILES = (0.05, 0.5, 0.95)
SHORT = 12  # characters of the text of a round setting, at most
SETTLED = "settled"
MIN_EFFECTIVE = 50  # samples; the intervals of fewer are rough
NO_CREDIT = {"failed", "unmatched", "unsettled", "unfinished"}  # doubts with which what is determined is not known
ON_THE_BRANCH = "on_this_branch"  # what is told where the history decides: determined if the well was in that motion
MOST_UNSETTLED = 0.05  # of the weight of the samples
TORQUE_OR_SHARE = {"1", "", "N m"}  # the units of friction that is in proportion to its torque
FAR = 3.0  # factor beyond the ends of the sweep from which a unit may be wrong


@dataclass(frozen=True)
class Fit:
    """The result of :func:`fit`.

    Attributes
    ----------
    note : dict
        The summary in plain data (SI), as ``nsdrill fit --json`` prints it.
    study : str
        The text of the study, with the samples after the fit in its section
        ``uncertain``.
    prior, samples : dict of arrays
        The samples [samples] of each unknown by key before and after the fit, in SI.
    predicted : dict of arrays
        The values [samples, points] that these give, by name.

    Examples
    --------
    >>> found = nsdrill.fit("uncertain.yaml", "field.csv", batch=16, progress=False)
    >>> found.samples["bit.friction.static"].shape
    (128,)
    >>> figure = found.picture(units="field")
    """

    note: Answer
    study: str
    measured: Measured
    prior: dict[str, Array]
    samples: dict[str, Array]
    predicted: dict[str, Array]

    def picture(self, units: str = "si") -> Figure:
        """A figure of the unknowns before and after the fit and of measured and
        predicted values, in ``units`` "si" or "field"."""
        from nsdrill.figures.measured_overlay import draw_fit

        note = self.note
        about = note["effective"], note["failed"], units, note["doubts"]
        return draw_fit(note["title"], self.measured, self.prior, self.samples, self.predicted, *about)


def fit(
    study: Study,
    measured: Measured,
    *,
    batch: int = 128,
    rounds: int = 8,
    samples: int = 128,
    workers: int | None = None,
    watch: Watch = lambda progress: None,
    kept: Rounds | None = None,
    large: bool = False,
    device: str = "cpu",
) -> Fit:
    """Adjust the unknowns of ``study`` to ``measured``; the sweep of the study is not
    run. At most ``rounds`` rounds of ``batch`` samples are run, and the adjusted study
    has ``samples`` samples. ``kept`` saves the runs, and has those of an interrupted
    fit; ``large`` says that very many runs are meant; ``device`` is cpu, gpu or auto.
    InputError where there is nothing to adjust, or where no run ends well."""
    keys = unknowns_of(study)
    if clash := [key for key in measured.at if key in keys]:
        raise InputError(f"{measured.source}: found a column of {clash[0]}, which is an unknown; allowed: one of both.")
    most = batch * (rounds + 2)
    check_large(
        f"{count(measured.points, 'operating point')}, each with up to {most} samples",
        measured.points * most,
        study.simulation.transient + study.simulation.observe,
        f"{amount(8.0 * measured.points * most * len(measured.values))} of memory and of the disk",
        checked_workers(workers),
        large=large or bool(kept and kept.known),
    )
    _check_periods(study, measured)
    calls = kept or Rounds()
    pairs = tuple(pair for pair in study.model.pairs if {pair.lower, pair.upper} <= keys.keys())
    run = _Simulator(
        study, measured, keys, checked_workers(workers), watch, most, calls.runs, pairs=pairs, device=device
    )
    simulate = calls.recording(run)
    values, errors, indices = measured.flat
    seed: int = study.resolved["uncertain"]["seed"]
    outputs: dict[bytes, Array] = {}

    def model(z: Array) -> Array:
        found = simulate(z)
        outputs.update(zip(map(bytes, z), found, strict=True))
        return np.asarray(found[:, indices])

    try:
        fitted = posterior(model, values, errors, len(keys), seed=seed, batch=batch, rounds=rounds)
    except ValueError as error:
        raise _none_known(study, measured, np.array(list(outputs.values())), run.endings) from error
    all_found = np.array([outputs[bytes(one)] for one in fitted.z])
    chosen = fitted.drawn(samples, seed)
    drawn = _unknown_values(keys, fitted.z[chosen])
    predicted = np.full((samples, measured.points * len(measured.values)), np.nan)
    predicted[:, indices] = fitted.found[chosen]
    by_name = dict(zip(measured.values, np.split(predicted, len(measured.values), axis=1), strict=True))
    rng = np.random.default_rng(0)
    prior = {key: quantile(numbers, rng.random(2000)) for key, numbers in keys.items()}
    note = _fit_summary(study, measured, keys, fitted, by_name)
    note |= _not_known(measured, fitted, all_found, note["left_out"])
    note |= _unsettled(fitted, all_found[:, -1] != 0.0)  # of a failed run it is not known
    begun = fitted.z[:batch]  # from the prior
    begun = begun[in_order(_unknown_values(keys, begun), pairs)]
    note["history"] = two_motions(study, measured, _unknown_values(keys, begun))
    note["doubts"] = _doubts(note)
    if NO_CREDIT & {*note["doubts"]}:
        note |= {"unknowns": _told_less(note["unknowns"], "unknown"), "together": []}  # nor is a combination known
    elif note["history"]:
        note["unknowns"] = _told_less(note["unknowns"], ON_THE_BRANCH)
    return Fit(note, _adjusted_text(study, measured, drawn, note), measured, prior, drawn, by_name)


def unknowns_of(study: Study) -> dict[str, Numbers]:
    """The distributions of the unknowns of ``study`` by key; InputError where a fit
    cannot adjust them."""
    section = study.resolved.get("uncertain") or {}
    keys = {key: numbers for key, numbers in section.items() if key not in HOW}
    source = study.source or "the study"
    if section.get("table"):
        raise InputError(f"{source}: found uncertain.table; allowed: distributions, which are what a fit begins with.")
    if not keys:
        raise InputError(
            f"{source}: found no unknown; allowed: a section `uncertain` that says of each number to adjust what is "
            "known of it before, e.g. uncertain: {bit.friction.static: {uniform: [0.2, 0.6]}}."
        )
    if section["correlations"]:
        raise InputError(f"{source}: found uncertain.correlations; allowed: unknowns that do not go together.")
    if listed := [key for key, numbers in keys.items() if "values" in numbers]:
        raise InputError(f"{source}: uncertain.{listed[0]}: found a list of values; allowed: a distribution.")
    return keys


def far_from_the_sweep(study: Study, measured: Measured, units: str = "si") -> list[str]:
    """A warning, in ``units`` "si" or "field", for each measured setting far outside
    the sweep of the study, or far from what the study gives it, whose unit may be wrong."""
    leaves = study.keys.axes
    warnings = []
    for key, values in measured.at.items():
        swept = study.axes.get(key, np.empty(0))
        own = float(getattr(study.operation, key, 0.0) or 0.0)
        is_given = own > 0.0 and own != leaves[key].default  # a default is no word of the user on the well
        if len(swept) < 2 and not is_given:
            continue
        low, high = (float(swept[0]), float(swept[-1])) if len(swept) > 1 else (own, own)
        outside = np.flatnonzero((values < low / FAR) | (values > high * FAR))
        if outside.size:
            setting, first, last = (_setting(leaves[key], float(one), units) for one in (values[outside[0]], low, high))
            study_has = f"sweeps {first} to {last}" if len(swept) > 1 else f"has {first}"
            warnings.append(
                f"{measured.source}, {measured.where[outside[0]]}: {key} is {setting}, and the study {study_has}. Is "
                "the unit in the head right?"
            )
    return warnings


def _setting(leaf: Leaf, value: float, units: str) -> str:
    """The text of a setting: in SI with the unit in which it is round, if there is
    one."""
    exact = leaf.text(value)
    return exact if units == "si" and len(exact) <= SHORT else quantity(leaf.key).text(value, units, 4)


def _check_periods(study: Study, measured: Measured) -> None:
    """FileError where a run cannot have a measured period, as it is observed too shortly."""
    if PERIOD not in measured.values:
        return
    periods, observe = measured.values[PERIOD], study.simulation.observe
    row = int(np.nanargmax(periods))
    if LEAST_CYCLES * periods[row] > observe:
        wanted = math.ceil(2 * LEAST_CYCLES * periods[row])
        raise FileError(
            f"{measured.source}, {measured.where[row]}: {PERIOD}: found {periods[row]:.4g} s; allowed: at most "
            f"{observe / LEAST_CYCLES:.4g} s, as a period needs {LEAST_CYCLES} cycles and runs are observed for "
            f"{observe:g} s (simulation.observe). {option('set', f'simulation.observe={wanted}s')} is long enough; "
            f"{option('ignore', PERIOD)} leaves it out."
        )


@dataclass
class _Simulator:
    """The model as a function of samples of the unknowns, run at all points of the
    measurements. ``most`` is the greatest number of samples of the fit, ``before`` the
    number of runs of an interrupted fit, and ``done`` that of finished runs."""

    study: Study
    measured: Measured
    keys: dict[str, Numbers]
    workers: int
    watch: Watch
    most: int
    before: int = 0
    done: int = 0
    device: str = "cpu"
    progress: Progress = field(default_factory=lambda: Progress(0))
    pairs: tuple[Pair, ...] = ()
    endings: Counter[int] = field(default_factory=Counter)  # of runs that failed, by their status

    def __post_init__(self) -> None:
        check_sweep(replace(self.study, axes={k: v[:1] for k, v in self.study.axes.items()}))

    def __call__(self, z: Array) -> Array:
        """The values of the model at the samples ``z`` [samples, unknowns] (standard
        normal), [samples, names x points + 1]; NaN where a run failed, and of samples
        against the order of two unknowns, which are not run. The last is 1 where the
        motions at all points had settled, 0 where one had not, NaN where a run failed."""
        mask = in_order(_unknown_values(self.keys, z), self.pairs)
        if not mask.all():
            found = np.full((len(z), len(self.measured.values) * self.measured.points + 1), np.nan)
            if mask.any():
                found[mask] = self(z[mask])
            return found
        n, points = len(z), self.measured.points
        table = {name: np.full(points, value) for name, value in vars(self.study.operation).items()}
        table |= self.measured.at
        table = {key: np.tile(values, n) for key, values in table.items()}
        table |= {key: np.repeat(values, points) for key, values in _unknown_values(self.keys, z).items()}
        values = self._run(table)
        by_name = {name: one.reshape(n, points) for name, one in values.items()}
        settled = by_name.pop(SETTLED).min(axis=1, keepdims=True)
        return np.concatenate([*(by_name[name] for name in self.measured.values), settled], axis=1)

    def _run(self, table: dict[str, Array]) -> dict[str, Array]:
        study = self.study
        plan, order = Rows.of(table)
        record = Record(peaks=LEAST_PEAKS)  # else a motion that grows slowly counts as settled
        work = Work(plan, study.parameters, study.initial, study.simulation, study.thresholds, record, study.model)
        features = {name: np.full(plan.points, np.nan) for name in (*self.measured.values, SETTLED)}

        def deliver(points: Array, columns: dict[str, Array]) -> None:
            ok = columns["status"] == OK
            self.endings.update(columns["status"][~ok].tolist())
            for name, values in features.items():
                values[order[points]] = np.where(ok, columns[name], np.nan)

        def watch(now: Progress) -> None:
            progress = self.progress
            progress.done, progress.failed, progress.shortage = self.done + now.done, now.failed, now.shortage
            progress.total = max(self.most * self.measured.points, self.before + progress.done)
            self.watch(progress)

        self.progress.before, self.progress.note = self.before, "fit"
        share = -(-plan.points // self.workers)
        parts = list(work.by_method(np.arange(plan.points)))
        place = place_for(self.device, [part for part, _ in parts], plan.points, self.workers)
        self.progress.device = place.told
        with ThreadPoolExecutor(self.workers) as threads:
            for part, points in parts:
                lanes = widened(choose_lanes(share), share, part.program.rows)
                if place.gpu is None:
                    with compiling(self.progress, self.watch):
                        compiled_parts(lanes, part.program)
                Engine(part, threads, self.workers, lanes, deliver, watch, gpu=place.gpu).run(None, points)
                self.done += len(points)
        return features


def _unknown_values(keys: dict[str, Numbers], z: Array) -> dict[str, Array]:
    """The values [n] of the unknowns by key, at samples ``z`` [n, unknowns] (standard
    normal)."""
    u = np.clip(ndtr(z), 2.0**-54, 1 - 2.0**-54)
    return {key: rounded(quantile(numbers, u[:, i])) for i, (key, numbers) in enumerate(keys.items())}


def _unknown_summaries(study: Study, keys: dict[str, Numbers], fitted: Posterior) -> list[Answer]:
    """What the data tell of each unknown."""
    quantiles = ndtr(fitted.z)
    order = np.argsort(fitted.z, axis=0)
    widths = fitted.widths
    unknowns = []
    for i, (key, numbers) in enumerate(keys.items()):
        edges = np.cumsum(fitted.weights[order[:, i]])
        ranked = quantiles[order[:, i], i]
        marginal = [float(ranked[min(int(np.searchsorted(edges, q)), len(edges) - 1)]) for q in QUANTILES]
        width, unknown = float(widths[i]), next(one for one in study.unknowns if one.short == key)
        unknowns.append(
            {
                "key": unknown.key,
                "units": unknown.units,
                "prior": quantile(numbers, np.array(QUANTILES)).tolist(),
                "posterior": quantile(numbers, np.clip(np.array(marginal), 2.0**-54, 1 - 2.0**-54)).tolist(),
                "width": width,
                "told": "well" if width < GOOD_GAIN else "partly" if width < LEAST_GAIN else "not",
                "at_the_end": end_pressed(quantiles[:, i], fitted.weights, width),
            }
        )
    return unknowns


def _told_less(unknowns: list[Answer], told: str) -> list[Answer]:
    """What the data tell of each unknown where a doubt leaves only ``told`` of one that is determined: with
    one of :data:`NO_CREDIT` it is not known. Samples that failed may agree with the data better than all others,
    intervals about what does not agree, of passing motions or of few samples mean little. Where another motion
    is possible, the width is that of the values with which the runs, not the well, came to the measured one."""
    return [row if row["told"] == "not" else row | {"told": told} for row in unknowns]


def _fit_summary(
    study: Study, measured: Measured, keys: dict[str, Numbers], fitted: Posterior, predicted: dict[str, Array]
) -> Answer:
    widths, correlations = fitted.widths, fitted.correlations
    unknowns = _unknown_summaries(study, keys, fitted)
    names = [row["key"] for row in unknowns]
    in_pairs = [pair for pair in study.model.pairs if {pair.lower, pair.upper} <= keys.keys()]
    left_out = int(np.count_nonzero(~in_order(_unknown_values(keys, fitted.z), in_pairs)))
    pairs = [
        {"keys": [names[i], names[j]], "correlation": float(correlations[i, j])}
        for i in range(len(names))
        for j in range(i)
        if abs(correlations[i, j]) > TIGHT and max(widths[[i, j]]) < 1.5
    ]
    freedom = max(measured.independent - len(keys), 1)
    chance = float(chi2.sf(fitted.misfit, freedom))
    return {
        "kind": "fit",
        "title": study.title,
        "data": measured.source,
        "points": measured.points,
        "settings": int(measured.settings.max(initial=0)) + 1,
        "values": len(fitted.spread),
        "notes": list(measured.notes),
        "features": [_feature_summary(name, measured, predicted[name], fitted) for name in measured.values],
        "unknowns": unknowns,
        "together": pairs,
        "scale_not_seen": _scale_not_seen(unknowns, measured),
        "runs": fitted.runs * measured.points,
        "samples": fitted.runs,
        "left_out": left_out,
        "rounds": fitted.rounds,
        "effective": fitted.size,
        "beta": fitted.beta,
        "misfit": fitted.misfit / measured.independent,
        "chance": chance,
        "explained": chance >= SURE,
    }


def _scale_not_seen(unknowns: list[Answer], measured: Measured) -> Answer | None:
    """The ``unknowns`` of friction that a wrong scale of a measured torque moves by that share, and by more
    where a part of the torque, as that of damping, is not friction; and what ``others`` were measured, which
    alone can show it. None where no torque is measured, or no such number is sought."""
    torques = [name for name in measured.values if "torque" in name]
    scaled = [one["key"] for one in unknowns if ".friction." in one["key"] and one["units"] in TORQUE_OR_SHARE]
    if not torques or not scaled:
        return None
    return {"unknowns": scaled, "others": [name for name in measured.values if name not in torques]}


def _not_known(measured: Measured, fitted: Posterior, found: Array, left_out: int) -> Answer:
    """How many samples ``failed``, and of how many others a run ended well, but does not have
    a measured value (``undefined``, by name), as steady rotation has no period: from
    all that the model ``found`` [samples, names x points + 1]."""
    ended = np.isfinite(found[:, -1])
    lacking = {name: (~np.isfinite(found[:, places]).all(axis=1)) & ended for name, places in _places(measured).items()}
    failed = fitted.failed - left_out - int(np.count_nonzero(np.any(list(lacking.values()), axis=0)))
    return {"failed": failed, "undefined": {name: int(rows.sum()) for name, rows in lacking.items() if rows.any()}}


def _places(measured: Measured) -> dict[str, Array]:
    """The columns of what the model finds that belong to the points at which a value was
    measured, by its name."""
    return {
        name: place * measured.points + np.flatnonzero(np.isfinite(values))
        for place, (name, values) in enumerate(measured.values.items())
    }


def _none_known(study: Study, measured: Measured, found: Array, endings: Counter[int]) -> InputError:
    """The error of a fit of which no sample of the first round has all values: how the runs
    ended, or which value most of them lack, and where."""
    source, ended = study.source or "the study", np.isfinite(found[:, -1])
    if not ended.any():
        if not endings:
            return InputError(f"{source}: found no sample of the unknowns in order; allowed: distributions with some.")
        (status, number), *_ = endings.most_common(1)
        why = ENDINGS[BY_NAME["status"].words(status)]
        return InputError(
            f"{source}: with values from the distributions a run failed at some point of {measured.source} in every "
            f"sample; {count(number, 'run')} of them: {why}."
        )
    shares = {name: np.isnan(found[ended][:, places]).mean(axis=0) for name, places in _places(measured).items()}
    name = max(shares, key=lambda one: float(shares[one].max()))
    worst = int(np.argmax(shares[name]))
    point = int(np.flatnonzero(np.isfinite(measured.values[name]))[worst])
    why = WITHOUT.get(name, "as its motion is of another kind")
    where, runs = f"{measured.source}, {measured.where[point]}", count(int(ended.sum()), "run")
    several = "".join(f" {one}." for one in measured.notes if one.startswith(SEVERAL))
    return InputError(
        f"{where}: {name}: found a value, where {100 * shares[name][worst]:.0f} % of {runs} with values from the "
        f"distributions have none; allowed: a value that runs have. A run has none {why}. Widen the distributions of "
        f"{source}, or leave the point out.{several}"
    )


def _doubts(note: Answer) -> list[str]:
    """Why the fit is doubtful, as answers from the written study tell it."""
    is_so = {
        "failed": bool(note["failed"]),
        "unmatched": not note["explained"],
        "unsettled": not note["best_settled"] or note["unsettled"] > MOST_UNSETTLED,
        "unfinished": not math.isclose(note["beta"], 1.0) or note["effective"] < MIN_EFFECTIVE,
        "history": note["history"] is not None,
    }
    return [name for name in FIT_DOUBTS if is_so[name]]


def _unsettled(fitted: Posterior, settled: Array) -> Answer:
    """The part of the samples, by weight, of which a motion had not settled, and whether
    those of the best sample had."""
    return {"unsettled": float(fitted.weights @ ~settled), "best_settled": bool(settled[fitted.best])}


def _feature_summary(name: str, measured: Measured, predicted: Array, fitted: Posterior) -> Answer:
    is_measured = np.isfinite(measured.values[name])
    places = list(measured.values).index(name) * measured.points + np.flatnonzero(is_measured)
    where = np.searchsorted(measured.flat[2], places)
    error, spread = measured.errors[name][is_measured], fitted.spread[where]
    residual = np.median(predicted[:, is_measured], axis=0) - measured.values[name][is_measured]
    return {
        "name": name,
        "units": plain_units(BY_NAME[name].units),
        "points": int(is_measured.sum()),
        "error": float(np.sqrt(np.mean(error**2))),
        "spread": float(np.sqrt(np.mean(spread**2))),
        "deviation": float(np.sqrt(np.mean(residual**2 / (error**2 + 2 * spread**2)))),
    }


def _adjusted_text(study: Study, measured: Measured, drawn: dict[str, Array], note: Answer) -> str:
    """The study with the samples as a table in place of the distributions."""
    resolved = copy.deepcopy(study.resolved)
    section = {key: value for key, value in resolved["uncertain"].items() if key in HOW and key != "doubts"}
    table = {key: values.tolist() for key, values in drawn.items()}
    resolved["uncertain"] = section | {"samples": len(next(iter(table.values()))), "table": table, "correlations": []}
    if note["doubts"]:
        resolved["uncertain"]["doubts"] = list(note["doubts"])
    source = study.source or "a study"
    failed = (
        f"NOT KNOWN: {note['failed']} of {note['samples']} samples failed; they have no weight, and the truth may lie "
        "outside."
    )
    without = [
        f"WITHOUT {name}: {number} of {note['samples']} samples; they have no weight."
        for name, number in note["undefined"].items()
    ]
    passing = (
        f"NOT SETTLED: {100 * note['unsettled']:.0f} % of the samples, by weight; their motions were still changing."
    )
    unmatched = f"NO RUN GIVES THESE DATA: the best is off by {note['misfit'] ** 0.5:.2g} times the errors."
    few = f"NOT FINISHED: only {note['effective']:.0f} samples count."
    both = "HISTORY DECIDES: steady drilling and stick-slip are both possible at measured points; see nsdrill fit."
    gains = ", ".join(f"{one['key']} {one['told'].replace('_', ' ')}" for one in note["unknowns"])
    of = f"{count(note['points'], 'operating point')}, {count(note['values'], 'measured value')}"
    head = (
        f"{source}, its unknowns adjusted to {measured.source} by nsdrill fit: {of}, effective "
        f"number of samples {note['effective']:.0f}.",
        f"What the data tell: {gains}.",
        *([failed] if note["failed"] else []),
        *without,
        *([passing] if note["unsettled"] or not note["best_settled"] else []),
        *([unmatched] if "unmatched" in note["doubts"] else []),
        *([few] if "unfinished" in note["doubts"] else []),
        *([both] if note["history"] else []),
        *(f"Of the data: {one}." for one in note["notes"]),
    )
    text = study_text(resolved, head)
    parse_study(text, "the adjusted study")
    return text
