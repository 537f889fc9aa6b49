"""The right-hand side of a scalar model with its friction apart, for a stepper that
treats it implicitly.

One friction contact acts on one velocity v: it takes load f(v) from the slope, f(v) =
g(v) [rise / (1 + decay |v|) + dynamic] with g(v) = (2/pi) atan(smoothing v). A model
says so with a :class:`Contact`, and its own slopes serve for all else: with the lane
parameter that the load is proportional to at zero.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import astuple, dataclass
from typing import Any

from numba import types

from nsdrill.abi import BUFFER, Rows, compiled
from nsdrill.elementary import fma
from nsdrill.generate import constants, define
from nsdrill.kernel.slip import first_slip, hyperbolic, kept
from nsdrill.observe.channels import Names
from nsdrill.scalar import STEP, embedded


@dataclass(frozen=True)
class Contact:
    """``velocity``: the name of the state that is the slip; ``proportional``: of the
    lane parameter without which there is no friction; ``load(t, y, p)``: (load [slope],
    smoothing, decay, rise, dynamic) from time, states and lane parameters, of which it
    uses no velocity."""

    velocity: str
    proportional: str
    load: Callable[..., Sequence[float]]


def apart_in_lanes(
    slopes: Callable[..., Sequence[float]], contact: Contact, names: Names, lanes: int, rows: Rows
) -> Any:
    """The compiled right-hand side, beside a deviation where the layout has one;
    ``slopes`` are the model's."""
    W, own = lanes, rows.own
    place = names.states.index(contact.velocity)
    slope = place // 2
    without = names.parameters.index(contact.proportional)
    load, told = embedded(contact.load)
    rest, also = embedded(slopes)

    def row(name: str, numbers: Sequence[int]) -> list[str]:
        return [f"b[{name} + {number} * W + i]" for number in numbers]

    def tuple_of(parts: Sequence[str]) -> str:
        return f"({''.join(f'{part}, ' for part in parts)})"

    states, parameters = row("stage", range(own)), row("parameter", range(rows.parameters))
    moved = [*states]
    moved[place] = "v"
    free = [*parameters]
    free[without] = "0.0"
    found = [f"s{k}" for k in range(rows.own_slopes)]
    names_of_rows = ("stage", "acceleration", "stage_time", "parameter", "push", "relax", "falling")
    lines = [
        f"# {told}, {also}",
        constants(W=W, **{name: W * getattr(rows, name) for name in names_of_rows}),
        "def right_hand_side(b):",
        "    for i in range(min(W, len(b))):",
        "        t, relax_now = b[stage_time + i], b[relax + i]",
        f"        p, without = {tuple_of(parameters)}, {tuple_of(free)}",
        f"        load, smoothing, decay, rise, dynamic = load_of(t, {tuple_of(states)}, p)",
        f"        given, relaxed = {states[place]}, relax_now * load",
        "        v = first_slip(given, relaxed, smoothing, decay, rise, dynamic)",
        "        f, df = hyperbolic(v, smoothing, decay, rise, dynamic)",
        "        v = kept(v, v + (given - fma(relaxed, f, v)) / fma(relaxed, df, 1.0))",
        "        f, df = hyperbolic(v, smoothing, decay, rise, dynamic)",
        "        f = fma(df, (given - fma(relaxed, f, v)) / fma(relaxed, df, 1.0), f)",
        "        v = fma(-relaxed, f, given)",
        f"        {tuple_of(found)} = rest(t, {tuple_of(moved)}, without)",
        f"        {states[place]} = v",
        "        b[push + i] = -load * f",
        "        b[falling + i] = load * rise * decay",
        *(
            f"        b[acceleration + {k} * W + i] = {one}" + (" - load * f" if k == slope else "")
            for k, one in enumerate(found)
        ),
    ]
    if rows.tangent_states:
        deviation = row("stage", range(own, 2 * own))
        parts = []
        for name, sign in (("above", "+"), ("below", "-")):
            places = [
                f"{state} {sign} {STEP!r} * {one}"
                for state, one in zip(states, deviation, strict=True)
            ]
            lines.append(f"        load_{name} = load_of(t, {tuple_of(places)}, p)[0]")
        lines.append(f"        dload = (load_above - load_below) * {0.5 / STEP!r}")
        lines.append(
            f"        dv = ({deviation[place]} - relax_now * f * dload) / fma(relaxed, df, 1.0)"
        )
        for name, sign in (("above", "+"), ("below", "-")):
            places = [
                f"{state} {sign} {STEP!r} * {one}"
                for state, one in zip(states, deviation, strict=True)
            ]
            places[place] = f"v {sign} {STEP!r} * dv"
            lines.append(f"        {name} = rest(t, {tuple_of(places)}, without)")
        parts = [f"(above[{k}] - below[{k}]) * {0.5 / STEP!r}" for k in range(rows.own_slopes)]
        lines += [
            "        dpush = -fma(load * df, dv, f * dload)",
            f"        {deviation[place]} = dv",
            "        b[push + W + i] = dpush",
            *(
                f"        b[acceleration + {rows.own_slopes + k} * W + i] = {part}"
                + (" + dpush" if k == slope else "")
                for k, part in enumerate(parts)
            ),
        ]
    known = {
        "load_of": load,
        "rest": rest,
        "first_slip": first_slip,
        "hyperbolic": hyperbolic,
        "kept": kept,
        "fma": fma,
    }
    function = define("right_hand_side", "\n".join(lines) + "\n", **known)
    return compiled(types.void(BUFFER), W, *astuple(rows))(function)
