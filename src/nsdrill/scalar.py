"""Right-hand sides written for one trajectory, compiled for all lanes.

The right-hand side of a model can be a plain function of time, states and parameters,
over tuples. It is inlined into a loop over the lanes, which compiles to packed
instructions. The function must not branch on values but select (``a if condition else
b``), and may call only what vectorises: arithmetic, ``np.sqrt``, ``np.floor`` and the
functions of :mod:`nsdrill.elementary`.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

from nsdrill.abi import MARKER, OBSERVER, Rows
from nsdrill.compiler.functions import BUFFER, compiled, inlined
from nsdrill.generate import constants, define

# The step of the difference quotient: a power of two, so that scaling by it is exact.
STEP = 2.0**-20
Slopes = Callable[..., Sequence[float]]


@lru_cache
def unobserved(lanes: int) -> tuple[Any, Any]:
    """A compiled observer and a marker that do nothing, for runs of which only the
    final state is needed."""

    @compiled(OBSERVER)
    def observe_nothing(b, store):  # type: ignore[no-untyped-def]
        pass

    @compiled(MARKER)
    def mark_nothing(b, store, i, mark, outcome, column):  # type: ignore[no-untyped-def]
        pass

    return observe_nothing, mark_nothing


def in_lanes(slopes: Slopes, lanes: int, rows: Rows, deviation: Slopes | None = None) -> Any:
    """The compiled right-hand side of a model whose slopes are ``slopes(t, y, p)``.

    ``t`` is the time, ``y`` the tuple of the own states and ``p`` that of the
    parameters, in the order of ``rows``. The result is the tuple of the slopes: for
    each pair of position and velocity that of the velocity, then those of the states of
    first order. Where the layout has tangent states, ``deviation(t, y, d, p)`` gives
    the slopes of a deviation ``d`` from the motion: the Jacobian times ``d``. Without
    it, the central difference of the slopes at the states ``STEP`` times ``d`` on
    either side of the motion is used: as ``d`` has natural scales, its error is about
    1e-8 of them.

    Either function may have one more argument, the last, which is the phase: the angle
    of the drive at time zero, less whole revolutions. With the drive's speed among the
    parameters the present angle is ``phase + speed * t``.
    """
    W, own = lanes, rows.own
    state = _row("stage", range(own))
    deviation_states = _row("stage", range(own, 2 * own))
    parameters = _row("parameter", range(rows.parameters))
    slope = _row("acceleration", range(rows.own_slopes))
    tangent_slopes = _row("acceleration", range(rows.own_slopes, rows.slopes))
    places = {
        name: W * getattr(rows, name)
        for name in ("stage", "acceleration", "stage_time", "phase", "parameter")
    }
    lines = [
        constants(W=W, **places),
        "def right_hand_side(b):",
        "    for i in packed(W):",
        "        t = b[stage_time + i]",
        f"        y = ({state})",
        f"        p = ({parameters})",
        f"        ({slope}) = slopes(t, y, p{_phase(slopes, 3)})",
    ]
    namespace = {"slopes": inlined(slopes)}
    if rows.tangent_states:
        if deviation is not None:
            lines.append(
                f"        ({tangent_slopes}) = deviation(t, y, ({deviation_states}), p{_phase(deviation, 4)})"
            )
            namespace["deviation"] = inlined(deviation)
        else:
            for name, sign in (("above", "+"), ("below", "-")):
                shifted = (
                    f"b[stage + {n} * W + i] {sign} {STEP!r} * b[stage + {own + n} * W + i], "
                    for n in range(own)
                )
                lines.append(
                    f"        {name} = slopes(t, ({''.join(shifted)}), p{_phase(slopes, 3)})"
                )
            parts = (
                f"(above[{n}] - below[{n}]) * {0.5 / STEP!r}, " for n in range(rows.own_slopes)
            )
            lines.append(f"        ({tangent_slopes}) = ({''.join(parts)})")
    function = define("right_hand_side", "\n".join(lines) + "\n", **namespace)
    return compiled(BUFFER)(function)


def _phase(function: Slopes, others: int) -> str:
    """The last argument of a function that has more than ``others``."""
    arguments = inspect.signature(getattr(function, "py_func", function)).parameters
    return ", b[phase + i]" if len(arguments) > others else ""


def _row(name: str, numbers: Sequence[int]) -> str:
    """The values of lane i in these rows, as the inside of a tuple."""
    return "".join(f"b[{name} + {number} * W + i], " for number in numbers)
