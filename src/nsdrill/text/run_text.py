"""A study, its runs and what can be drawn of them, in words."""

from __future__ import annotations

import json
import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from nsdrill.analysis.bifurcations import stability_text
from nsdrill.app.check import Report
from nsdrill.app.experiment import coarse_length
from nsdrill.data import NOT_CARRIED_RUN, NOT_CARRIED_WORDS, Answer, Array, Attributes, edited_words
from nsdrill.errors import count, from_to, printable
from nsdrill.files import amount
from nsdrill.models.choices import as_value, word_or_number, words_of
from nsdrill.models.numbers import GROUPS
from nsdrill.quantity import quantity
from nsdrill.study.study import Study
from nsdrill.text.words import HELD, cell, in_unit_of, knots_text, label_of, point_text, refinement_text, value_text
from nsdrill.variables import AXES, OPERATED, SAMPLE, dimension_of

if TYPE_CHECKING:
    from nsdrill.app.following.continuing import ContinuationResult
    from nsdrill.app.following.orbits import OrbitPoint
    from nsdrill.app.running.run import RunResult

Row = tuple[str, float | None, str, str]  # name, number, unit in SI, meaning


def check_lines(study: Study, report: Report, source: str, units: str, everything: bool) -> Iterator[str]:
    """The report on the ``study`` from ``source``, with ``everything`` also the further
    quantities."""
    yield f"{source}: valid. {printable(' '.join(study.title.split()))}".rstrip()
    yield from _size_lines(study, report, units)
    yield from _method_lines(study, report, units)
    if report.measured:
        yield f"Measured besides: {', '.join(f'{name} ({maker})' for name, maker in report.measured.items())}."
    if report.scales:
        scales = ", ".join(f"{name} {value:g}" for name, value in report.scales.items())
        yield (
            f"Natural scales, of a trial run at the defaults or nsdrill.number(..., scale=): {scales}. Tolerances and "
            "comparisons use them."
        )
    shown = {name: derived for name, derived in report.figures.items() if everything or not derived.further}
    operation = report.operation
    told = [
        quantity(name).text(value, units)
        if name == "depth"
        else value_text(name, value, units, both=True)
        if name in AXES
        else point_text({name: value}, units)
        for name, value in vars(operation).items()
    ]
    start = "At the start of the ramp: " if study.ramped else "At "
    if told:
        yield f"\n{start}{', '.join(told)}{':' if shown else '.'}"
    if report.coefficients is not None:
        coefficients: list[Row] = [
            (name, float(getattr(report.coefficients, name)), *unit_and_meaning)
            for name, unit_and_meaning in report.explained.items()
        ]
        yield from _table("Coefficients", coefficients, units, shown)
    for group, title in GROUPS.items():
        rows = [(name, one.value, one.units, one.meaning) for name, one in shown.items() if one.group == group]
        if rows:
            words = {name: "every speed" for name, one in shown.items() if one.everywhere}
            words |= {name: "not known" for name, one in shown.items() if not one.known}
            yield from _table(title, rows, units, shown, words)
    if more := len(report.figures) - len(shown):
        yield f"\n{more} further quantities with --all: buckling, higher lateral modes, standing waves."


def _size_lines(study: Study, report: Report, units: str) -> Iterator[str]:
    """The sweep, and what it takes."""
    if not report.points:
        return
    points = count(report.points, "point")
    if study.refined:
        points = (
            f"{count(report.coarse_points, 'point')}, refined where the responses differ to at most {report.points}"
        )
    yield f"{points}: {_sweep_text(study, report.chains, units)}."
    yield (
        f"Size: up to {amount(report.disk)} on the disk, and as much again while the results "
        f"file is written; about {amount(report.memory)} of memory."
    )
    if report.device:
        yield f"Device: {report.device}."
        if report.price is None:
            yield "Time: on a GPU not known before it has run; on the processor: nsdrill check --price."
    if report.price is not None:
        yield f"Time: {report.price.text}."


def _method_lines(study: Study, report: Report, units: str) -> Iterator[str]:
    """How friction is integrated, ramps, and a continuation."""
    if report.method != ("explicit",):
        where = " at the points where it is steep, explicitly at the others" if len(report.method) > 1 else ""
        yield f"Friction: integrated implicitly{where} (simulation.method: {study.simulation.method})."
    for name, ramp in report.ramps.items():
        replaced = "; the sweep takes its place in nsdrill run" if name in study.swept else ""
        knots = knots_text(name, ramp.times, ramp.values, units)
        yield f"Ramp, for nsdrill simulate: {label_of(name)} {knots}{replaced}."
    if study.continuation is not None and not study.swept:
        yield "Section continue: nsdrill branches follows it; nsdrill run runs the one point."


def _table(
    title: str,
    rows: Sequence[tuple[str, float | None, str, str]],
    units: str,
    shown: Collection[str],
    words: Mapping[str, str] = MappingProxyType({}),
) -> Iterator[str]:
    """Quantities with their units and meanings below a title, aligned with all
    quantities that are ``shown``. What has no number is none, or what these ``words`` say."""
    name_width, unit_width = max(17, *map(len, shown)), 9 if units == "si" else 13
    yield f"\n{title}"
    for name, number, si, meaning in rows:
        value, unit = cell(0.0 if number is None else number, si, units)
        text = f"{value:12.6g}" if number is not None else f"{words.get(name, 'none'):>12s}"
        equivalent = ""
        if si == "rad/s" and number is not None:
            other = f"{number * 30 / math.pi:.4g} rpm" if units == "si" else f"{number:.4g} rad/s"
            equivalent = f" ({other}, {number / (2 * math.pi):.4g} Hz)"
        elif name.endswith("_half_wave") and units == "field":
            equivalent = f" ({value / 12:.4g} ft)"
        elif name.endswith("_inclination") and number is not None:
            equivalent = f" ({math.degrees(number):.3g} degrees)"
        yield f"  {name:{name_width}s} {text} {unit:{unit_width}s}  {meaning}{equivalent}"


def _sweep_text(study: Study, chains: int, units: str) -> str:
    """The sweep in words."""
    axes = []
    for name in study.swept:
        label = label_of(name)
        first, last = (value_text(name, float(study.axes[name][i]), units) for i in (0, -1))
        length = len(study.axes[name])
        if words_of(name):
            axes.append(f"{label} {', '.join(str(word_or_number(name, value)) for value in study.axes[name])}")
            continue
        values = f"{length} values"
        if name in study.refined:
            values = f"{coarse_length(study, name)} values, refined to {length}"
        axes.append(f"{label} {first} to {last} ({values})" if length > 1 else f"{label} {first}")
    most = "at most " if study.refined else ""
    if starts := study.initial.starts:
        kind = (
            f"a slice over {' and '.join(study.initial.slice)}"
            if study.initial.slice
            else (f"an ensemble, seed {study.initial.seed}")
        )
        start = f"every operating point from {starts} states, {kind}"
    elif study.procedure == "same" or study.along is None:
        start = "every point from the same initial state"
    else:
        direction = {"up": "up", "down": "down"}.get(study.procedure, "up and back down")
        along = label_of(study.along)
        start = f"the state carried {direction} along the {along}, in {most}{count(chains, 'chain')}"
        if study.procedure == "all":
            start += ", and every point from the same initial state"
    samples = ""
    if study.samples:
        unknowns = ", ".join(label_of(unknown.key) for unknown in study.unknowns)
        samples = f"{count(study.samples, 'sample')} of {unknowns}, in place of the values in their own sections"
    return "; ".join(filter(None, (", ".join(axes), samples, start)))


def outcome_text(outcome: RunResult, units: str) -> str:
    """How many points were run, how many failed, and what to do about them."""
    text = f"{outcome.path}: {count(outcome.points, 'point')}"
    if outcome.refinement:
        text = f"{outcome.path}: {refinement_text(outcome.refinement, units)}"
    if outcome.already:
        text += f" ({outcome.already} were there already)"
    if outcome.steps:
        text += f", {outcome.steps:,} steps in {outcome.seconds:.1f} s"
    text += "."
    if outcome.failed:
        failed = f"{count(outcome.failed, 'point')} failed and {'is' if outcome.failed == 1 else 'are'} marked"
        text += f" {failed}; `nsdrill show {outcome.path}` lists them, and `nsdrill replay` runs one again."
    if outcome.advice:
        text += f" Where the limit of steps was reached: {outcome.advice}."
    return " ".join((text, *outcome.notes))


def continuation_text(found: ContinuationResult) -> str:
    """``3 branches, 812 points, in 4.1 s``, and which seeds were not followed."""
    branches, points = found.data.sizes["branch"], found.data.sizes["point"]
    text = f"{count(branches, 'branch')}, {count(points, 'point')}, in {found.seconds:.1f} s."
    if not_followed := [f"{number}: {word}" for word, number in found.seeds.items() if word != "followed"]:
        seeds = count(sum(found.seeds.values()), "seed")
        text += f" Of {seeds} some were not followed ({'; '.join(not_followed)})."
    return text


def simulated_text(attrs: Attributes, study: Study, requested: Mapping[str, float], units: str) -> str:
    """The operating values of a trace; of a ramp its knots; and the requested sample,
    with its values except those of the operation."""
    ramps = json.loads(attrs.get("ramps", "{}"))
    constant = [name for name in AXES if name in attrs and name not in ramps]
    fixed: dict[str, float | str] = {name: in_unit_of(name, float(attrs[name]), requested) for name in constant}
    own = {name: value for name, value in json.loads(attrs.get("at", "{}")).items() if name in OPERATED}
    fixed |= {name: value for name, value in own.items() if name not in ramps}
    moving = [f"{label_of(name)} {knots_text(name, times, values, units)}" for name, (times, values) in ramps.items()]
    held = [f"held: {HELD.format(attrs['held_from'], attrs['observe'])}"] if "held_from" in attrs else []
    text = "; ".join(part for part in (point_text(fixed, units), *moving, *held) if part)
    if SAMPLE not in requested:
        return text
    number = int(requested[SAMPLE])
    drawn = {
        unknown.name: float(study.drawn[unknown.short][number])
        for unknown in study.unknowns
        if unknown.short not in AXES
    }
    return ", ".join(filter(None, (text, point_text(drawn, units), f"sample {number}")))


def replayed_text(attrs: Attributes, start: int | None, requested: Mapping[str, float], units: str) -> str:
    """The point that was run again."""
    further = {key: as_value(key, word) for key, word in json.loads(attrs.get("at", "{}")).items()}
    point = {name: attrs[name] for name in AXES if name in attrs} | further
    is_nearest = any(abs(value - point[name]) > 1e-3 * abs(value) for name, value in requested.items() if name in point)
    shown = {name: in_unit_of(name, float(value), requested) for name, value in point.items()}
    parts = [point_text(shown, units), str(attrs["procedure"])]
    if start is not None:
        parts.append(f"start {start}")
    if SAMPLE in attrs:
        parts.append(f"sample {attrs[SAMPLE]}")
    if is_nearest:
        parts.append("the nearest of the sweep")
    return ", ".join(parts)


def spectrum_lines(found: Answer, units: str) -> Iterator[str]:
    """The Lyapunov spectrum of a point in words."""
    at = f" at {point_text(found['at'], units)}" if found["at"] else ""
    where = [found["procedure"]]
    where += [f"{name} {found[name]}" for name in ("start", SAMPLE) if found[name] is not None]
    yield f"Lyapunov exponents{at}, {', '.join(where)}, over {found['seconds']:g} s from the end of its run:"
    for value, error, sign in zip(found["exponents"], found["errors"], found["signs"], strict=True):
        yield f"  {value:10.4g} +- {error:.1g} 1/s  {sign}"
    dimension = from_to(f"{end:.3g}" for end in found["dimension"])
    yield f"Sum: {found['sum']:.6g} 1/s. Kaplan-Yorke dimension: {dimension}."
    if told := edited_words(found):
        yield told
    if found[NOT_CARRIED_RUN]:
        yield NOT_CARRIED_WORDS
    if "undetermined" in found["signs"]:
        yield "Undetermined: their errors leave open whether they are zero; a longer motion (--duration) tells."
    if found["settled"] is not True:
        what = "had not settled" if found["settled"] is False else "does not say whether it had settled"
        yield f"The run {what}: these may be exponents of the way to the motion that lasts."


def orbit_text(point: OrbitPoint) -> str:
    """A point of a file of branches."""
    numbers = ", ".join(quantity(dimension_of(key)).text(value, "si", 10) for key, value in point.values.items())
    return f"Point {point.number}: {numbers}; period {point.period:.6g} s; {stability_text(point.unstable)}."


def nearest_text(coords: Mapping[str, Array], point: Mapping[str, float]) -> str:
    """The values of a sweep with these ``coords`` that are drawn in place of those of the
    ``point``."""
    drawn = {}
    for key, value in point.items():
        name = dimension_of(key)
        values = np.asarray(coords.get(name, [value]), dtype=float)
        found = float(values[np.argmin(np.abs(values - value))])
        if abs(found - value) > 1e-3 * abs(value):
            drawn[name] = in_unit_of(key, found, point)
    return point_text(drawn)
