"""The attractors of a sweep with several starts, summarised as plain data."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from nsdrill.analysis.attractors import IF_THERE, NEEDED, Attractor, describe
from nsdrill.analysis.safety import known_runs
from nsdrill.app.answering.answers import path_of
from nsdrill.app.datasets import sweep_in, with_variables
from nsdrill.data import Answer
from nsdrill.errors import FileError, option
from nsdrill.models.choices import word_or_number
from nsdrill.models.registry import model_in, named_in
from nsdrill.models.responses import RESPONSE_KINDS
from nsdrill.variables import Variable

if TYPE_CHECKING:
    from nsdrill.app.datasets import Source


def attractors(source: Source) -> list[Answer]:
    """The attractors of each operating point of a results file, or of results in
    memory, that has several starts.

    A list with one entry for each operating point in the order of the file: its values,
    ``depth`` [m], ``wob`` [N], ``rotary_speed`` [rad/s] of a drill string, the numbers of ``starts``, ``known``,
    ``failed``, ``pending``, ``unsettled``, ``doubtful`` (off speed, or on an unstable motion) and
    ``ungrouped`` ones, and ``attractors``, by falling share: ``number``, the same for one
    attractor in all entries, ``response``, its kinds, ``motion`` and ``period`` where recorded,
    ``members``, ``unsettled`` members, ``share`` of the known starts and its 95 % interval ``low`` to
    ``high`` (None in a slice, whose starts are not a sample), and the median
    ``features`` in SI (None where not finite). FileError where every operating point
    has one start.
    """
    name = path_of(source)
    results = sweep_in(source, "attractors", NEEDED, None)
    with_variables(results, name, NEEDED)
    if "start" not in results.coords:
        model, remedy = model_in(results.attrs), f"initial.ensemble, as by {option('set', 'initial.ensemble=64')}"
        if not model.drills:  # a script does not say from which states an ensemble starts
            axes = ", ".join(f"{state!r}: (from, to, points)" for state in model.all_states[:2])
            remedy = f"initial.slice, as slice={{{axes}}} of the model's study"
        raise FileError(
            f"{name}: every operating point has one start, so there are no attractors to compare. Run a study with "
            f"{remedy}."
        )
    starts = len(results.coords["start"])
    features = model_in(results.attrs).distinguishing
    names = dict.fromkeys((*NEEDED, *IF_THERE, *features, "attractor"))
    flat = {name: results[name].reshape(-1, starts) for name in names if name in {*results.variables, "attractor"}}
    sampled, without = not results.slice, () if model_in(results.attrs).drills else RESPONSE_KINDS
    is_known = known_runs(results).reshape(-1, starts)
    places, named = np.ndindex(*results.shape[1:-1]), named_in(results.attrs)
    return [
        {
            **{
                name: word_or_number(name, float(results.coords[name][i]))
                for name, i in zip(results.grid[1:-1], place, strict=True)
            },
            **counts,
            "attractors": [
                {key: value for key, value in attractor_as_data(one, sampled, named).items() if key not in without}
                for one in found
            ],
        }
        for place, (found, counts) in zip(places, describe(flat, is_known, features), strict=True)
    ]


def attractor_as_data(attractor: Attractor, sampled: bool, named: Mapping[str, Variable]) -> Answer:
    """An attractor as plain data, with its labels in words. Only starts that are
    ``sampled`` have an interval of the share."""
    data: Answer = {
        "number": attractor.number,
        "response": named["response"].words(attractor.response),
        **{name: named[name].words(value) for name, value in attractor.kinds.items()},
    }
    if attractor.motion is not None:
        data |= {"motion": named["motion"].words(attractor.motion), "period": attractor.period}
    return data | {
        "members": attractor.members,
        "unsettled": attractor.unsettled,
        "share": attractor.share,
        "low": attractor.low if sampled else None,
        "high": attractor.high if sampled else None,
        "features": {name: value if np.isfinite(value) else None for name, value in attractor.features.items()},
    }
