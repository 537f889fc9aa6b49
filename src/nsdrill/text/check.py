"""What the check of a study found, in words."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Sequence

from nsdrill.app.check import Report, coarse_length
from nsdrill.files import amount
from nsdrill.models.leaves import word_or_number, words_of
from nsdrill.models.numbers import GROUPS
from nsdrill.study.study import Study
from nsdrill.text.words import cell, count, knots_text, label_of, value_text

Row = tuple[str, float | None, str, str]  # name, number, unit in SI, meaning


def lines(study: Study, report: Report, source: str, units: str, everything: bool) -> Iterator[str]:
    """The report on the ``study`` from ``source``, with ``everything`` also the further
    quantities."""
    yield f"{source}: valid. {study.title}".rstrip()
    yield from _size_lines(study, report, units)
    yield from _method_lines(study, report, units)
    shown = {name: derived for name, derived in report.figures.items() if everything or not derived.further}
    operation = report.operation
    depth = value_text("depth", operation.depth, units)
    others = [value_text(name, getattr(operation, name), units, both=True) for name in ("wob", "rotary_speed")]
    start = "At the start of the ramp: " if study.ramped else "At "
    yield f"\n{start}{', '.join((depth, *others))}{':' if shown else '.'}"
    if report.coefficients is not None:
        coefficients: list[Row] = [
            (name, float(getattr(report.coefficients, name)), *unit_and_meaning)
            for name, unit_and_meaning in report.explained.items()
        ]
        yield from _table("Coefficients", coefficients, units, shown)
    for group, title in GROUPS.items():
        rows = [(name, one.value, one.units, one.meaning) for name, one in shown.items() if one.group == group]
        if rows:
            yield from _table(title, rows, units, shown)
    if more := len(report.figures) - len(shown):
        yield (
            f"\n{more} further quantities with --all: buckling, higher lateral modes, standing "
            f"waves, damping by the mud."
        )


def _size_lines(study: Study, report: Report, units: str) -> Iterator[str]:
    """The sweep, and what it takes."""
    if not report.points:
        return
    points = count(report.points, "point")
    if study.refined:
        points = f"{report.coarse_points} points, refined where the responses differ to at most {report.points}"
    yield f"{points}: {_sweep_text(study, report.chains, units)}."
    yield (
        f"Size: up to {amount(report.disk)} on the disk, and as much again while the results "
        f"file is written; about {amount(report.memory)} of memory."
    )


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
    title: str, rows: Sequence[tuple[str, float | None, str, str]], units: str, shown: Collection[str]
) -> Iterator[str]:
    """Quantities with their units and meanings below a title, aligned with all
    quantities that are ``shown``."""
    name_width, unit_width = max(17, *map(len, shown)), 9 if units == "si" else 13
    yield f"\n{title}"
    for name, number, si, meaning in rows:
        value, unit = cell(0.0 if number is None else number, si, units)
        text = f"{value:12.6g}" if number is not None else f"{'none':>12s}"
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
        direction = {"up": "up", "down": "down", "up-down": "up and back down"}[study.procedure]
        along = label_of(study.along)
        start = f"the state carried {direction} along the {along}, in {most}{count(chains, 'chain')}"
    samples = ""
    if study.samples:
        unknowns = ", ".join(label_of(unknown.key) for unknown in study.unknowns)
        samples = f"{count(study.samples, 'sample')} of {unknowns}, in place of the values in their own sections"
    return "; ".join(filter(None, (", ".join(axes), samples, start)))
