"""Right-hand sides written for one trajectory, put into lanes.

A model need not know lanes: a plain function of time, states and parameters, over tuples, is called in a loop over the
lanes, into which it disappears, and the loop compiles to packed instructions. The function must not branch on values
but select (``a if condition else b``), and call nothing but what vectorises: arithmetic, ``np.sqrt``, ``np.floor`` and
the functions of :mod:`nsdrill.elementary`.
"""

from __future__ import annotations

import hashlib
import inspect
from collections.abc import Callable, Sequence
from dataclasses import astuple
from pathlib import Path
from typing import Any

from numba import types

from nsdrill.abi import BUFFER, Rows, compiled, inlined
from nsdrill.generate import constants, define

Slopes = Callable[..., Sequence[float]]


def in_lanes(slopes: Slopes, lanes: int, rows: Rows, deviation: Slopes | None = None) -> Any:
    """The compiled right-hand side of a model whose slopes are ``slopes(t, y, p)``.

    ``t`` is the time, ``y`` the tuple of the own states and ``p`` that of the parameters, in the order of ``rows``. The
    result is the tuple of the slopes: for each pair of position and velocity the velocity's, then those of the states
    of first order. Where the layout has companions, ``deviation(t, y, d, p)`` gives the slopes of a deviation ``d``
    from the motion: the Jacobian times ``d``.
    """
    W, own = lanes, rows.own
    state = _row("stage", range(own))
    deviated = _row("stage", range(own, 2 * own))
    parameters = _row("parameter", range(rows.parameters))
    slope = _row("acceleration", range(rows.own_slopes))
    follows = _row("acceleration", range(rows.own_slopes, rows.slopes))
    places = {name: W * getattr(rows, name) for name in ("stage", "acceleration", "stage_time", "parameter")}
    lines = [
        f"# {_signed(slopes)}{f', {_signed(deviation)}' if deviation else ''}",
        constants(W=W, **places),
        "def right_hand_side(b):",
        # The length is nothing that the compiler knows, or it would unroll the loop of a small model before packing it.
        "    for i in range(min(W, len(b))):",
        "        t = b[stage_time + i]",
        f"        y = ({state})",
        f"        p = ({parameters})",
        f"        ({slope}) = slopes(t, y, p)",
    ]
    known = {"slopes": inlined(slopes)}
    if rows.companions:
        if deviation is None:
            raise ValueError("the layout has companions, but no function gives their slopes")
        lines.append(f"        ({follows}) = deviation(t, y, ({deviated}), p)")
        known["deviation"] = inlined(deviation)
    function = define("right_hand_side", "\n".join(lines) + "\n", **known)
    return compiled(types.void(BUFFER), W, *astuple(rows))(function)


def _row(name: str, numbers: Sequence[int]) -> str:
    """The values of lane i in these rows, as the inside of a tuple."""
    return "".join(f"b[{name} + {number} * W + i], " for number in numbers)


def _signed(function: Slopes) -> str:
    """The function's name with a digest of the file it stands in: other code must not meet machine code from before."""
    file = Path(inspect.getfile(function))
    digest = hashlib.sha256(file.read_bytes()).hexdigest() if file.exists() else "no file"
    return f"{function.__module__}.{function.__qualname__} {digest}"
