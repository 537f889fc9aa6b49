"""What is computed of equations, against the graph: Python, machine code, the tangent;
numbers that nothing reads, and slopes that jump."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from nsdrill.analysis.counts import guessed_words
from nsdrill.data import Array
from nsdrill.equations import plain
from nsdrill.equations.passes import Tangents
from nsdrill.equations.trace import Named
from nsdrill.errors import InputError
from nsdrill.script.function_model import FunctionModel
from nsdrill.testing.bench import Bench
from nsdrill.testing.check_report import Report

LANES = 8
Check = Callable[[Bench, Report], None]


def _slopes(bench: Bench, given: dict[str, Any]) -> dict[str, Array]:
    found = plain.values(bench.slopes, given)
    return {name: np.broadcast_to(np.asarray(value, float), bench.count) for name, value in found.items()}


def _off(a: Array | float, b: Array, floor: float = 1e-12) -> Array:
    """The relative difference."""
    return np.abs(a - b) / np.maximum(np.maximum(np.abs(a), np.abs(b)), floor)


def python(bench: Bench, report: Report) -> None:
    """The function itself, number by number, but where it refuses these, as friction does a
    normal load below 0; inf where it refuses all."""
    expected, worst, where, refused = _slopes(bench, bench.inputs), 0.0, "", 0
    for k in range(bench.count):
        try:
            found = _called(bench, k)
        except InputError as error:
            refused += 1
            worst, where = (np.inf, str(error)) if refused == bench.count else (worst, where)
            continue
        states = {name: float(bench.inputs[f"s.{name}"][k]) for name in bench.motion.states}
        for name, values in expected.items():
            if (off := float(_off(found[name], values[k]))) > worst:
                worst, where = off, f"slope of {name} at {', '.join(f'{n} {v:.4g}' for n, v in states.items())}"
    report.add("Python against the graph", worst, 1e-9, where)


def _called(bench: Bench, k: int) -> dict[str, float]:
    """The slopes that the function gives at a state."""
    inputs, model = bench.inputs, bench.model
    time, phase = float(inputs["time"][k]), float(inputs["phase"][k])
    states = {name: float(inputs[f"s.{name}"][k]) for name in bench.motion.states}
    if isinstance(model, FunctionModel):
        read = model.reading.signature
        rate = float(bench.variant.phase_rate(bench.table)[0])
        at = time + phase / rate if model.reading.forcing is not None else time
        numbers = {name: bench.columns[name] for name in read.parameters}
        return read.called(read.function, at, {name: states[name] for name in read.start}, numbers)
    found = bench.motion.equations(time, phase, Named(**states), Named(**bench.columns), bench.variant.options)
    return dict(found[0] if isinstance(found, tuple) else found)


def machine_code(bench: Bench, report: Report) -> None:
    """The compiled right-hand side, lane by lane."""
    rows = bench.variant.rows()
    compiled = bench.motion.right_hand_side(LANES, rows)
    place, expected = bench.motion.places(rows), _slopes(bench, bench.inputs)
    worst, where = 0.0, ""
    for first in range(0, bench.count, LANES):
        lanes = [min(first + i, bench.count - 1) for i in range(LANES)]
        buffer = np.zeros(rows.total * LANES)
        for name, value in bench.inputs.items():
            if name in place:
                at = place[name] * LANES
                buffer[at : at + LANES] = np.broadcast_to(value, bench.count)[lanes]
        compiled(buffer)
        for name, values in expected.items():
            at = place[f"slope.{name}"] * LANES
            off = float(
                np.max(_off(buffer[at : at + LANES], values[lanes], 1e-6 * float(np.median(np.abs(values))) + 1e-12))
            )
            if off > worst:
                worst, where = off, f"slope of {name}"
    report.add("machine code against the graph", worst, 1e-9, where)


def tangent(bench: Bench, report: Report) -> None:
    """How slopes change with each state; a kink may lie between the two states of a
    difference, so that the median counts."""
    graph, worst, where = bench.traced[0], 0.0, ""
    for state in bench.motion.states:
        exact = plain.values(Tangents(graph, {graph.input(f"s.{state}"): 1.0}).of(bench.slopes), bench.inputs)
        step = 1e-6 * bench.scales[state]
        sides = [
            _slopes(bench, bench.inputs | {f"s.{state}": bench.inputs[f"s.{state}"] + sign * step}) for sign in (1, -1)
        ]
        for name in bench.slopes:
            difference = (sides[0][name] - sides[1][name]) / (2 * step)
            rounding = 1e-16 * np.max(np.abs(sides[0][name])) / step
            size = np.max(np.abs(difference)) + 1e5 * rounding + 1e-12
            off = float(np.median(np.abs(exact[name] - difference)) / size)
            if off > worst:
                worst, where = off, f"d({name})/d({state})"
    report.add("tangent against differences", worst, 1e-4, where)


def unread(bench: Bench, report: Report) -> None:
    """The equations of some slope, or what is measured, read every number of a model of a
    script, also where no trial state takes their branch, as of a contact that is not
    reached."""
    if isinstance(bench.model, FunctionModel):  # others have numbers for starts, thresholds and tables, too
        reading = bench.model.reading
        measured = reading.graph.inputs_of(reading.quantities.values())
        unread_of(bench, report, [key for key in bench.numbers if f"p.{key.rpartition('.')[2]}" not in measured])


def unread_of(bench: Bench, report: Report, keys: Iterable[str]) -> None:
    """The equations of some slope read every one of these numbers."""
    read, idle = bench.traced[0].inputs_of(bench.slopes.values()), []
    for key in keys:
        columns = bench.columns_with(key, bench.numbers[key] * 1.01 + 1e-9)
        if not any(one != bench.columns[name] and f"p.{name}" in read for name, one in columns.items()):
            idle.append(key)
    report.add("numbers that nothing reads", len(idle), 0, ", ".join(idle))


def jumps(bench: Bench, report: Report) -> None:
    """No condition of a model of a script makes a slope jump."""
    if isinstance(bench.model, FunctionModel):
        found = bench.model.places_of_jumps()
        words = "; exponent and branches are refused" if found else ""
        report.add("conditions at which slopes jump", len(found), 0, ", ".join(found) + words)


def guessed_scales(bench: Bench, report: Report) -> None:
    """The trial of a script's model at its defaults tells the natural scale of every state."""
    if isinstance(bench.model, FunctionModel):
        states = bench.model.guessed
        report.add("natural scales that are guesses", len(states), 0, guessed_words(states) if states else "")


COMPUTED: tuple[Check, ...] = (python, machine_code, tangent, unread, jumps, guessed_scales)
