"""How runs ended, in words."""

from __future__ import annotations

import json
from collections.abc import Mapping

from nsdrill.app.continuing import ContinuationResult
from nsdrill.app.orbit import OrbitPoint
from nsdrill.app.run import RunResult
from nsdrill.data import Attributes
from nsdrill.models.leaves import as_value
from nsdrill.quantity import quantity
from nsdrill.study.study import Study
from nsdrill.text.show import refinement_text
from nsdrill.text.words import count, in_unit_of, knots_text, label_of, point_text
from nsdrill.variables import AXES, SAMPLE, dimension_of


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
    return text


def continuation_text(found: ContinuationResult) -> str:
    """``3 branches, 812 points, in 4.1 s``, and which seeds were not followed."""
    branches, points = found.data.sizes["branch"], found.data.sizes["point"]
    text = (
        f"{branches} {'branch' if branches == 1 else 'branches'}, {count(points, 'point')}, in {found.seconds:.1f} s."
    )
    if not_followed := [f"{number}: {word}" for word, number in found.seeds.items() if word != "followed"]:
        seeds = count(sum(found.seeds.values()), "seed")
        text += f" Of {seeds} some were not followed ({'; '.join(not_followed)})."
    return text


def simulated_text(attrs: Attributes, study: Study, requested: Mapping[str, float], units: str) -> str:
    """The operating values of a trace; of a ramp its knots; and the requested sample,
    with its values except those of the operation."""
    ramps = json.loads(attrs.get("ramps", "{}"))
    fixed = {name: in_unit_of(name, float(attrs[name]), requested) for name in AXES if name not in ramps}
    moving = [f"{label_of(name)} {knots_text(name, times, values, units)}" for name, (times, values) in ramps.items()]
    text = "; ".join(part for part in (point_text(fixed, units), *moving) if part)
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
    point = {name: attrs[name] for name in AXES} | further
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


def orbit_text(point: OrbitPoint) -> str:
    """A point of a file of branches."""
    numbers = ", ".join(quantity(dimension_of(key)).text(value, "si", 10) for key, value in point.values.items())
    stable = "stable"
    if point.unstable:
        stable = f"unstable in {count(point.unstable, 'direction')}"
    return f"Point {point.number}: {numbers}; period {point.period:.6g} s; {stable}."
