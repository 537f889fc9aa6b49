"""Made-up maps, drawn as text: what the analyses read, and nothing else."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from nsdrill.data import STICKS_TO, Results
from nsdrill.models.responses import BIT_BOUNCE, STALLED, STICK_SLIP, WHIRL
from nsdrill.variables import DIVERGED, OK, PENDING

# One character a point: its responses, or why it has none.
RESPONSES = {
    ".": 0,
    "b": BIT_BOUNCE,
    "s": STICK_SLIP,
    "w": WHIRL,
    "t": STALLED,
    "B": BIT_BOUNCE | WHIRL,
    "S": STICK_SLIP | WHIRL,
    "x": 0,
    "?": 0,
    "i": 0,
}
STATUS = {"x": DIVERGED, "?": PENDING, "i": 5}  # 5: inferred from its neighbours


def grid(
    maps: Mapping[str, Sequence[str | Sequence[str]]],
    rotary_speed: Sequence[float],
    wob: Sequence[float] = (20e3,),
    depth: Sequence[float] = (5000.0,),
) -> Results:
    """A sweep from drawings: for each procedure one for each depth, each of lines (a
    weight on bit each, the lowest first) of characters (a speed each). A single line
    may stand for a drawing of one."""
    names = list(maps)
    drawings = [[[one] if isinstance(one, str) else list(one) for one in maps[name]] for name in names]
    signs = np.array([[[list(line) for line in one] for one in drawn] for drawn in drawings])
    coords = {
        "procedure": np.array(names),
        "depth": np.array(depth, float),
        "wob": np.array(wob, float),
        "rotary_speed": np.array(rotary_speed, float),
    }
    assert signs.shape == tuple(len(values) for values in coords.values()), signs.shape
    response = np.vectorize(lambda sign: RESPONSES[sign])(signs).astype(np.int8)
    status = np.vectorize(lambda sign: STATUS.get(sign, OK))(signs).astype(np.int8)
    kind = np.where(response & WHIRL, 3, 0).astype(np.int8)
    return Results(coords, {"status": status, "response": response, "whirl_kind": kind}, {"title": "Made up"})


def told(
    results: Results,
    lasts_to: list,
    unstable_to: list | None = None,
    from_rest: bool = False,
    shown_to: list | None = None,
) -> Results:
    """With what the model says of the settings of a map over speed and weight."""
    over = ["wob"] if len(results.coords["wob"]) > 1 else []
    found = {"over": over, "lasts_to": lasts_to, "unstable_to": unstable_to or [0.0] * len(lasts_to)}
    found |= {"shown_to": lasts_to if shown_to is None else shown_to}
    return replace(results, attrs={**results.attrs, STICKS_TO: json.dumps({**found, "from_rest": from_rest})})
