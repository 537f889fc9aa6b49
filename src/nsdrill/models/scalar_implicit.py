"""The right-hand side of a scalar model with implicit friction.

One friction contact acts on one velocity v: its slope is less by load f(v), with f(v) =
g(v) [rise / (1 + decay |v|) + dynamic] and g(v) = (2/pi) atan(smoothing v). The model
describes it by a :class:`Contact`. The rest of the right-hand side is the model's own
slopes with the lane parameter that the load is proportional to set to zero.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from nsdrill.abi import Rows
from nsdrill.compiler.functions import BUFFER, compiled, inlined
from nsdrill.compiler.words import fma
from nsdrill.generate import constants, define
from nsdrill.kernel.slip import first_slip, hyperbolic, kept
from nsdrill.observe.channels import Names
from nsdrill.scalar import STEP


@dataclass(frozen=True)
class Contact:
    """``velocity`` is the name of the state that slips, ``proportional`` that of the
    lane parameter to which the load is proportional. ``load(t, y, p)`` gives (load [the
    slope's unit], smoothing, decay, rise, dynamic) from time, states other than
    velocities, and lane parameters."""

    velocity: str
    proportional: str
    load: Callable[..., Sequence[float]]


def implicit_in_lanes(
    slopes: Callable[..., Sequence[float]], contact: Contact, names: Names, lanes: int, rows: Rows
) -> Any:
    """The compiled right-hand side, with that of a deviation where ``rows`` has one;
    ``slopes`` are the model's."""
    W, own = lanes, rows.own
    place = names.states.index(contact.velocity)
    slope = place // 2
    proportional = names.parameters.index(contact.proportional)

    def row(name: str, numbers: Sequence[int]) -> list[str]:
        return [f"b[{name} + {number} * W + i]" for number in numbers]

    def tuple_of(parts: Sequence[str]) -> str:
        return f"({''.join(f'{part}, ' for part in parts)})"

    states, parameters = row("stage", range(own)), row("parameter", range(rows.parameters))
    moved = [*states]
    moved[place] = "v"
    smooth = [*parameters]
    smooth[proportional] = "0.0"
    accelerations = [f"s{k}" for k in range(rows.own_slopes)]
    names_of_rows = ("stage", "acceleration", "stage_time", "parameter", "push", "relax", "falling")
    lines = [
        constants(W=W, **{name: W * getattr(rows, name) for name in names_of_rows}),
        "def right_hand_side(b):",
        "    for i in packed(W):",
        "        t, relax_now = b[stage_time + i], b[relax + i]",
        f"        p, p_smooth = {tuple_of(parameters)}, {tuple_of(smooth)}",
        f"        load, smoothing, decay, rise, dynamic = load_of(t, {tuple_of(states)}, p)",
        f"        v_free, relaxed = {states[place]}, relax_now * load",
        "        v = first_slip(v_free, relaxed, smoothing, decay, rise, dynamic)",
        "        f, df = hyperbolic(v, smoothing, decay, rise, dynamic)",
        "        v = kept(v, v + (v_free - fma(relaxed, f, v)) / fma(relaxed, df, 1.0))",
        "        f, df = hyperbolic(v, smoothing, decay, rise, dynamic)",
        "        f = fma(df, (v_free - fma(relaxed, f, v)) / fma(relaxed, df, 1.0), f)",
        "        v = fma(-relaxed, f, v_free)",
        f"        {tuple_of(accelerations)} = frictionless(t, {tuple_of(moved)}, p_smooth)",
        f"        {states[place]} = v",
        "        b[push + i] = -load * f",
        "        b[falling + i] = load * rise * decay",
        *(
            f"        b[acceleration + {k} * W + i] = {acceleration}"
            + (" - load * f" if k == slope else "")
            for k, acceleration in enumerate(accelerations)
        ),
    ]
    if rows.tangent_states:
        deviation = row("stage", range(own, 2 * own))
        for name, sign in (("above", "+"), ("below", "-")):
            arguments = [
                f"{state} {sign} {STEP!r} * {part}"
                for state, part in zip(states, deviation, strict=True)
            ]
            lines.append(f"        load_{name} = load_of(t, {tuple_of(arguments)}, p)[0]")
        lines.append(f"        dload = (load_above - load_below) * {0.5 / STEP!r}")
        lines.append(
            f"        dv = ({deviation[place]} - relax_now * f * dload) / fma(relaxed, df, 1.0)"
        )
        for name, sign in (("above", "+"), ("below", "-")):
            arguments = [
                f"{state} {sign} {STEP!r} * {part}"
                for state, part in zip(states, deviation, strict=True)
            ]
            arguments[place] = f"v {sign} {STEP!r} * dv"
            lines.append(f"        {name} = frictionless(t, {tuple_of(arguments)}, p_smooth)")
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
        "load_of": inlined(contact.load),
        "frictionless": inlined(slopes),
        "first_slip": first_slip,
        "hyperbolic": hyperbolic,
        "kept": kept,
        "fma": fma,
    }
    function = define("right_hand_side", "\n".join(lines) + "\n", **known)
    return compiled(BUFFER)(function)
