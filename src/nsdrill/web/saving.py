"""What a page keeps: the present point as a study file, and the command line that makes
the same."""

from __future__ import annotations

import os
import shlex
from typing import TYPE_CHECKING

from nsdrill.app.trajectory import option_of
from nsdrill.data import Answer
from nsdrill.errors import InputError
from nsdrill.models.leaves import word_or_number, words_of
from nsdrill.plot.labels import operating_point
from nsdrill.quantity import quantity
from nsdrill.study import parse_study
from nsdrill.study.write import study_text
from nsdrill.units import from_si
from nsdrill.web.asked import Request
from nsdrill.web.diagrams import member_dimension
from nsdrill.web.shown import value_rows
from nsdrill.web.sliders import DEFAULT_SLIDERS, changes, start_state

if TYPE_CHECKING:
    from nsdrill.web.session import Session


def saved(session: Session, request: Request) -> Answer:
    """The present point as a study file: its ``text``, and a ``name`` to
    propose."""
    study = session.motions.at(session.values(request), changes(session, request))
    head = [f"One operating point, saved from the explorer of {os.path.basename(session.path)}"]
    operation = {name: getattr(study.operation, name) for name in DEFAULT_SLIDERS}
    title = f"One operating point, {operating_point(operation, session.units)}"
    state, resolved = start_state(session, request, study), {**study.resolved, "title": title}
    plain_text = study_text(resolved, head)
    if state is None:
        return {"text": plain_text, "name": "point.yaml"}
    with_start = session.motions.with_start(study, state)
    if with_start is not None:
        text = study_text({**with_start, "title": title}, [*head, "Its start is the state that the page showed"])
        try:
            parse_study(text, "point.yaml")
        except InputError:
            pass  # a study may not start there, for example deep in the wall
        else:
            return {"text": text, "name": "point.yaml"}
    parse_study(plain_text, "point.yaml")
    head.append("Its start is that of the study: the state that the page showed cannot be written as one")
    return {"text": study_text(resolved, head), "name": "point.yaml"}


def point_rows(session: Session, place: tuple[int, ...]) -> list[list[str]]:
    """The axes of a point and their values, in words."""
    results = session.sweep()
    point: list[list[str]] = []
    for name, i in zip(results.grid, place, strict=True):
        value = results.coords[name][i]
        if name == "procedure":
            if len(results.coords[name]) > 1 or str(value) != "same":
                point.append(["Carried", str(value)])
        elif name == member_dimension(results):
            point.append([name.capitalize(), str(int(value))])
        else:
            point += value_rows([name], {name: float(value)}, session.units)
    return point


def command(session: Session, place: tuple[int, ...]) -> str:
    """The command line that writes the trace of a point, which is the nearest to the
    values in it."""
    results = session.sweep()
    parts = ["nsdrill replay", shlex.quote(session.path)]
    keys = {axis.name: axis.key for axis in results.more}
    for name in results.swept:
        key = keys.get(name, name)
        value = float(results.coords[name][place[results.grid.index(name)]])
        unit = quantity(key).unit(session.units)
        number = f"{from_si(value, unit):.9g}" if unit else repr(value)
        parts.append(option_of(key, str(word_or_number(key, value)) if words_of(key) else f"{number}{unit}"))
    if len(results.coords["procedure"]) > 1:
        parts.append(f"--procedure {results.coords['procedure'][place[0]]}")
    if member := member_dimension(results):
        parts.append(f"--start {place[-1]}" if member == "start" else f"--at {member}={place[-1]}")
    return " ".join([*parts, "-o trace.h5"])
