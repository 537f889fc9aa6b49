"""What the study of results says of them, whatever the runs were: the motions that may last,
how short the observation is, up to which speeds stick-slip may last, what the damping does."""

from __future__ import annotations

import json
import math
from contextlib import suppress
from dataclasses import replace

from nsdrill.analysis.counts import carried_axis
from nsdrill.analysis.graded import SLACK
from nsdrill.app.answering.stick_slip_end import damping_of_torsion, mud_drives_whirl, stick_slip_lasts
from nsdrill.app.check import (
    ShortObservation,
    bent,
    dampings_of_torsion,
    deciding_numbers,
    few_states,
    lasting_motions,
    left_out,
    lumped_string,
    nothing_cut,
    pulses,
    short_observation,
    string_by_depth,
    study_of_part,
    tells_what_lasts,
    wall_off_bottom,
)
from nsdrill.app.experiment import with_samples
from nsdrill.app.usual import far_from_usual
from nsdrill.data import (
    BENT,
    DAMPING,
    DAMPING_RATIOS,
    DECIDING,
    FEW,
    LASTING_MOTIONS,
    LASTING_UNTOLD,
    LEFT_OUT,
    LUMPED_STRING,
    PULSES,
    SHORT,
    SHORT_TO,
    STICKS_TO,
    STRING_BY_DEPTH,
    UNCUT,
    UNREAD,
    UNUSUAL_NUMBERS,
    WALL_OFF_BOTTOM,
    WITHIN,
    Answer,
    Attributes,
    Resolved,
    Results,
    json_text,
    resolved_study,
)
from nsdrill.errors import NsdrillError
from nsdrill.study.load import default_study
from nsdrill.study.study import Study, study_from_resolved
from nsdrill.study.write import value_text
from nsdrill.variables import dimension_of


def of_study(results: Results) -> tuple[dict[str, str | int | float], bool]:
    """The root attributes that :func:`nsdrill.app.answering.answers.with_lasting_motions` adds
    of the study alone, of results of which no variable is read; and whether rotating mud drives
    whirl by itself anywhere."""
    speeds: list[Answer] = []
    lasts: Answer | None = None
    driven = False
    short, untold = ShortObservation({}, 0.0), False
    uncut: dict[str, list[str]] = {}
    few: dict[str, list[str]] = {}
    damping: Answer | None = None
    ratios: list[float] = []
    decisive: Answer = {}
    of_string: list[dict[str, float]] = []
    wall: Answer | None = None
    beyond: Answer = {}
    lumped: dict[str, list[str]] = {}
    pulse = unread = unusual = bend = ""
    try:
        study = with_samples(study_from_resolved(resolved_study(results.attrs)), results)
    except NsdrillError as error:
        unread = str(error) if results.attrs.get("study_resolved") else ""
    else:
        part = study_of_part(study, results)
        unusual = far_from_usual(study)
        with suppress(NsdrillError):
            # a motion may begin below the part of a chain that these results are
            speeds = lasting_motions(study_of_part(study, results, whole=carried_axis(results)))
            untold = not tells_what_lasts(study)
            short = short_observation(_where_drilled(part, results))
            uncut, few, pulse = nothing_cut(part), few_states(part), pulses(part)
            bend = bent(part)
        with suppress(NsdrillError):
            damping = damping_of_torsion(results)
            ratios, decisive = damping_ratios(part), _deciding(part)
            of_string = string_by_depth(part)
            lumped = lumped_string(part)
            wall = wall_off_bottom(part)
            beyond = left_out(part)
    with suppress(NsdrillError):
        lasts = stick_slip_lasts(results)
    with suppress(NsdrillError):
        driven = bool(mud_drives_whirl(results))
    found: dict[str, str | int | float] = {
        LASTING_MOTIONS: json_text(speeds),
        LASTING_UNTOLD: int(untold),
        UNREAD: unread,
        UNUSUAL_NUMBERS: unusual,
        LEFT_OUT: json_text(beyond),
        DAMPING: json_text(damping),
        DAMPING_RATIOS: json_text(ratios),
        DECIDING: json_text(decisive),
        STRING_BY_DEPTH: json_text(of_string),
        LUMPED_STRING: json_text(lumped),
        WALL_OFF_BOTTOM: json_text(wall),
        STICKS_TO: json_text(lasts),
        PULSES: pulse,
        BENT: bend,
        SHORT: json_text(short.told),
        SHORT_TO: short.to,
        UNCUT: json_text(uncut),
        FEW: json_text(few),
    }
    return found, driven


def damping_ratios(study: Study) -> list[float]:
    """The least and the greatest damping ratio of torsion of a ``study``; none where it has none, or many."""
    found = [one.ratio for one in dampings_of_torsion(study)]
    return [min(found), max(found)] if found else []


def deciding_in(attrs: Attributes) -> Answer:
    """The numbers that decide, of a file with these root attributes; none of one without a study of this version."""
    with suppress(NsdrillError):
        return _deciding(study_from_resolved(resolved_study(attrs)))
    return {}


def _deciding(study: Study) -> Answer:
    """The numbers that no sheet has and that act on each response of a ``study``, by key: those that are ``given`` and
    those that are as by ``default``, which are of no well."""
    default = default_study(study.model.name).resolved
    return {
        name: {
            "given": [key for key in keys if not _is_default(study, default, key)],
            "default": [key for key in keys if _is_default(study, default, key)],
        }
        for name, keys in deciding_numbers(study).items()
    }


def _is_default(study: Study, default: Resolved, key: str) -> bool:
    return value_text(study.resolved, key) == value_text(default, key)


def _where_drilled(study: Study, results: Results) -> Study:
    """The ``study`` of results with the values at which one drills alone: how short the runs of
    a run-up are does not matter."""
    axes = dict(study.axes)
    for key, values in study.axes.items():
        low, high = json.loads(results.attrs.get(WITHIN, "{}")).get(dimension_of(key), (-math.inf, math.inf))
        chosen = (values >= low - SLACK * abs(low)) & (values <= high + SLACK * abs(high))
        axes[key] = values[chosen] if chosen.any() else values
    return replace(study, axes=axes)
