"""What is observed of a motion: the rate of each channel against its change, features
against a dense trace, explicit against implicit friction."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from nsdrill.data import Array
from nsdrill.equations import plain
from nsdrill.models.friction import why_explicit
from nsdrill.observe.channels import Channel, Extremes, Mean, arguments
from nsdrill.testing.bench import Bench
from nsdrill.testing.check_report import Report
from nsdrill.variables import DRIVING

LONG = 20.0  # periods of a run whose features are compared
SAMPLES = 100_000  # of its trace


def channels(bench: Bench, report: Report) -> None:
    """The rate of each channel is how fast it changes along the vector field. One with the
    rate 0 is declared to be taken at the ends of steps."""
    step = 1e-6 * bench.period
    now, ahead, behind = (_rows(bench, shift) for shift in (0.0, step, -step))
    names, declaration = bench.variant.names, bench.variant.declaration
    known = {*now, *names.parameters}
    for channel in declaration.channels:
        if not _reads(channel) <= known or channel.inside is not None or channel.slope == 0.0:
            continue  # of outputs that are made once a step
        difference = (_value(bench, channel.value, ahead) - _value(bench, channel.value, behind)) / (2 * step)
        told = _value(bench, channel.slope, now) - (bench.columns[channel.frame] if channel.frame else 0.0)
        rounding = 1e-16 * float(np.max(np.abs(_value(bench, channel.value, now)))) / step
        size = float(np.max(np.abs(difference))) + 1e5 * rounding + 1e-12
        off = float(np.median(np.abs(told - difference))) / size
        report.add(f"rate of the channel {channel.name}", off, 1e-4)


def _reads(channel: Channel) -> set[str]:
    parts = (channel.value, channel.slope)
    return {
        n for part in parts for n in ([part] if isinstance(part, str) else arguments(part) if callable(part) else [])
    }


def _rows(bench: Bench, shift: float) -> dict[str, Any]:
    """The rows of the observer a little later along the vector field."""
    names, variant = bench.variant.names, bench.variant
    slopes = plain.values(bench.slopes, bench.inputs)
    frames = variant.frame_rates(bench.table)[0]
    rates: dict[str, Any] = {}
    pairs = len(names.states) - variant.names.first_order
    for k, name in enumerate(names.states):
        is_position = k < pairs and k % 2 == 0
        rates[name] = bench.inputs[f"s.{names.states[k + 1]}"] + frames[k // 2] if is_position else slopes[name]
    states = {name: bench.inputs[f"s.{name}"] + shift * rates[name] for name in names.states}
    time = bench.inputs["time"] + shift
    there = bench.inputs | {f"s.{name}": value for name, value in states.items()} | {"time": time}
    found = plain.values(bench.slopes, there)
    rows = dict(zip(names.slopes, (found[name] for name in variant.slope_names), strict=True))
    return {**states, **rows, **bench.columns, "time": time, "phase": bench.inputs["phase"]}


def _value(bench: Bench, expression: Any, rows: dict[str, Any]) -> Array:
    """An expression of rows, at each state."""
    if isinstance(expression, str):
        return np.broadcast_to(np.asarray(rows[expression], float), bench.count)
    if not callable(expression):
        return np.full(bench.count, float(expression))
    function: Callable[..., Any] = getattr(expression, "py_func", expression)
    columns = [np.broadcast_to(np.asarray(rows[name], float), bench.count) for name in arguments(expression)]
    if not columns:  # a rate that is a number
        return np.full(bench.count, float(function()))
    return np.array([float(function(*map(float, row))) for row in zip(*columns, strict=True)])


def features(bench: Bench, report: Report) -> None:
    """Greatest, least and mean values of states, against a dense trace."""
    duration = LONG * max(bench.period, bench.turn)
    trace = bench.simulate(duration, rtol=1e-9, method="explicit", sample=f"{duration / SAMPLES!r} s")
    data = bench.run(duration, report, rtol=1e-9, method="explicit")
    worst, where = 0.0, ""
    time = trace["time"].values
    declaration = bench.variant.declaration
    states = {channel.name: channel.value for channel in declaration.channels if not channel.squared}
    for feature in declaration.features:
        state = states.get(feature.channel) if isinstance(feature, (Extremes, Mean)) else None
        if not isinstance(state, str) or state not in trace or state not in bench.scales:
            continue
        values = trace[state].values
        expected = {getattr(feature, "greatest", None): values.max(), getattr(feature, "least", None): values.min()}
        if isinstance(feature, Mean):
            expected = {feature.name: np.trapezoid(values, time) / (time[-1] - time[0])}
        size = max(float(np.ptp(values)), bench.scales[state])
        for name, value in expected.items():
            if name and name in data:
                off = abs(float(np.ravel(data[name].values)[0]) - value) / size
                if off > worst:
                    worst, where = off, name
    report.add("features against a trace", worst, 2e-3, where)
    for name in data:
        if str(name).endswith(DRIVING.format("")):  # of the motion: states around it are no states of it
            report.add(f"friction of {str(name).removesuffix(DRIVING.format(''))} brakes", data[name].item(), 0.0)


def methods(bench: Bench, report: Report, words: str = "") -> None:
    """Explicit and implicit friction end in the same state, with ``words`` on where they
    begin."""
    if why_explicit(bench.study.model, bench.study.parameters) is not None:
        return
    duration = 10.0 * bench.period
    ends = [bench.run(duration, report, rtol=1e-10, method=method) for method in ("explicit", "implicit")]
    names = [str(name) for name in ends[0]["state"].values]
    first, second = (np.ravel(one["final_state"].values) for one in ends)
    off = {
        name: abs(first[k] - second[k]) / (10 * bench.scales[name])
        for k, name in enumerate(names)
        if name in bench.scales
    }
    where = max(off, key=off.__getitem__)
    report.add(f"explicit against implicit{words}", off[where], 1e-4, where)


OBSERVED = (channels, features, methods)
