"""The replies with a motion: a stored point run again, a motion that goes on from any
state, that of a point of the branches, and the section of a point. And what a page
keeps: the present point as a study file, and the command line that makes the same."""

from __future__ import annotations

import math
import os
import shlex
from dataclasses import replace

import numpy as np

from nsdrill.analysis.bifurcations import EQUILIBRIUM
from nsdrill.analysis.safety import known_outcome
from nsdrill.app.experiment import unlike
from nsdrill.app.simulating.integration import SimulatedMotion
from nsdrill.app.simulating.trajectory import option_of
from nsdrill.data import Answer, Trace
from nsdrill.errors import ENDINGS, InputError
from nsdrill.figures.kinds.returns import section_of
from nsdrill.models.choices import word_or_number, words_of
from nsdrill.models.registry import BY_NAME, drawn_in, named_in
from nsdrill.quantity import quantity as base_quantity
from nsdrill.study import parse_study
from nsdrill.study.study import Study
from nsdrill.study.write import study_text
from nsdrill.units import from_si
from nsdrill.variables import OK, dimension_of
from nsdrill.web import asked
from nsdrill.web.asked import Request
from nsdrill.web.diagrams import Reply, member_dimension
from nsdrill.web.opened import Opened
from nsdrill.web.shown import first_sliders, label_words, quantity_data, value_at, value_rows
from nsdrill.words.labels import operating_point, quantity


def orbit(session: Opened, request: Request) -> Reply:
    """The motion of a ``point`` of the branches: over one period where it is
    unstable, else over whole periods of :data:`asked.DEFAULT_SECONDS` or more."""
    branches, point = session.branches, asked.integer(request, "point", -1)
    if branches is None or not 0 <= point < len(branches.label):
        raise InputError(f"point: found {point}; allowed: a point of the branches.")
    values = {name: float(branches.features[name][point]) for name in branches.operated if name in branches.features}
    values[branches.key] = float(branches.numbers[point])
    period = float(branches.period[point])
    repeats = f", its period is {period:.4g} s"
    if branches.motions[branches.branch_of(point)] == EQUILIBRIUM:  # over one lobe, or none
        repeats = ""
    if not 0.0 < period < asked.MAX_SECONDS:
        repeats, period = "", asked.DEFAULT_SECONDS
    seconds = period * (1 if branches.unstable[point] else max(1, math.ceil(asked.DEFAULT_SECONDS / period)))
    with session.computing():
        study = session.motions.at(session.motions.own | values)
        simulation = replace(study.simulation, rtol=float(branches.attrs.get("rtol", study.simulation.rtol)))
        study = replace(study, simulation=simulation)
        state = np.append(branches.state[point], 0.0)
        motion = session.motions.run_from(study, state, seconds, min(asked.SAMPLE, period / 400))
    # "settled" compares the halves of the observation, which says nothing of a
    # motion with another period.
    labels = {name: value for name, value in motion.found.items() if name != "settled"}
    head, columns = motion_reply(session, motion, study, {"status": motion.status, **labels})
    if motion.status == OK:
        head["features"] = value_rows(study.model.shown, motion.found, session.units)
    file = shlex.quote(branches.path)
    head |= {
        "begins": f"Point {point}, {branches.name_of(point)}: run for {seconds:.4g} s{repeats}.",
        "changes": values,
        "command": f"nsdrill show {file} --study > branches_study.yaml && nsdrill simulate "
        f"branches_study.yaml "
        f"--orbit {file} --point {point} -o trace.h5",
    }
    return head, columns


def replay(session: Opened, request: Request) -> Reply:
    """The last ``seconds`` of the stored point at ``place``, run again."""
    place, seconds = session.place(request), asked.seconds(request)
    with session.computing():
        motion = session.motions.replay(place, seconds, asked.sample(seconds))
        study = session.motions.stored(place)
    stored = stored_values(session, place)
    head, columns = motion_reply(session, motion, study, stored, stored_outcome(session, place))
    named = named_in(session.sweep().attrs)
    names = [name for name in stored if named[name].dtype == "f8" and math.isfinite(stored[name])]
    head |= {
        "place": list(place),
        "same_bits": motion.same_bits,
        "command": command(session, place),
        "features": value_rows(names, stored, session.units),
        "differing": differing(session, motion),
        "from": point_rows(session, place),
        "begins": "stored",
    }
    return head, columns


def stored_values(session: Opened, place: tuple[int, ...]) -> dict[str, float]:
    """The features and labels of a stored point."""
    results = session.sweep()
    named = named_in(results.attrs)
    there = {name: values for name, values in results.variables.items() if name in named}
    return {name: values[place].item() for name, values in there.items() if values.ndim == len(place)}


def stored_outcome(session: Opened, place: tuple[int, ...]) -> int | None:
    """The outcome of a stored point; None where the file has no responses."""
    results = session.sweep()
    return int(known_outcome(results)[place]) if {"status", "response"} <= {*results.variables} else None


def differing(session: Opened, motion: SimulatedMotion) -> list[str]:
    """What differs here from where the file was made; nothing where a motion that was run
    again has the same bits."""
    return [] if motion.same_bits else unlike(session.sweep().attrs, "numpy_version", "processor")


def live(session: Opened, request: Request) -> Reply:
    """The motion from ``state`` on with ``changes``; from the study's own start
    where no state is given. ``chosen`` says that the state was clicked, and nothing
    else."""
    values = session.values(request)
    seconds = asked.seconds(request)
    with session.computing():
        study = session.motions.at(values, session.changes(request))
        state, settle, observe = session.start_state(request, study), 0.0, 0.0
        if state is None:
            state = session.motions.start(study)
            settle, observe = study.simulation.transient, study.simulation.observe
        motion = session.motions.run_from(study, state, seconds, asked.sample(seconds), settle=settle, observe=observe)
    names = study.model.shown
    head, columns = motion_reply(session, motion, study, {"status": motion.status, **motion.found})
    if motion.status == OK:
        head["features"] = value_rows(names, motion.found, session.units)
    duration = f"for {motion.seconds:g} s{', with changed numbers' if request.get('changes') else ''}"
    if request.get("chosen"):
        head["begins"] = f"Run from the chosen start {duration}."
    elif request.get("state"):
        head["begins"] = f"Run on from the present state {duration}."
    else:
        head["begins"] = f"Run from the study's start {duration}.{_middle_of_sweep(session)}"
    return head, columns


def _middle_of_sweep(session: Opened) -> str:
    """The values at which the page of a study that sweeps begins, as a sentence."""
    values = session.motions.own
    swept = [name for name in session.study.swept if not words_of(name)] if session.results is None else []
    texts = value_rows(
        list(map(dimension_of, swept)), {dimension_of(name): values[name] for name in swept}, session.units
    )
    return f" The study sweeps; this is the middle: {', '.join(map(' '.join, texts))}." if texts else ""


def section(session: Opened, request: Request) -> Reply:
    """The returns of the stored point at ``place`` to the Poincare section, in the
    planes of the model."""
    place, results = session.place(request), session.sweep()
    drawn = drawn_in(results.attrs)
    stored = all(name in results.variables for name in drawn.section) and bool(drawn.section)
    if stored:
        returns = {name: results[name][place] for name in results.variables if name.startswith("section_")}
        source = "stored returns"
    else:
        simulation = session.study.simulation
        with session.computing():
            motion = session.motions.replay(
                place, simulation.observe, max(0.01, simulation.observe / asked.MAX_SAMPLES)
            )
        speed = {name: value for name, value in session.motions.values(place).items() if name == "rotary_speed"}
        attrs = {**results.attrs, "transient": motion.time[0] if len(motion.time) else 0.0, **speed}
        returns = section_of(Trace(motion.time, motion.variables, attrs))
        source = "returns in the observed time"
    columns, planes = {}, []
    for pair in drawn.section_planes:
        if not all(name in returns for name in pair):
            continue
        planes.append([quantity_data(name, session.units) for name in pair])
        for name in pair:
            columns[name] = returns[name] / quantity(name, session.units).scale
    count = int(np.isfinite(next(iter(columns.values()))).sum()) if columns else 0
    return {"planes": planes, "words": f"{count} {source}"}, columns


def motion_reply(
    session: Opened, motion: SimulatedMotion, study: Study, labels: Answer, outcome: int | None = None
) -> Reply:
    """The reply with a motion, which has the ``outcome`` of a stored point, if it is one."""
    model, variables = study.model, motion.variables
    names = [v.name for v in model.trace if v.name in variables and quantity(v.name).scale]
    hole = model.hole(study.parameters) if model.hole else None
    x = quantity("x", session.units) if hole and "x" in variables else None
    head = {
        "channels": [quantity_data(name, session.units) for name in names],
        "interval": float(motion.time[1] - motion.time[0]) if len(motion.time) > 1 else 0.0,
        "begin": float(motion.time[0]) if len(motion.time) else 0.0,
        "samples": len(motion.time),
        "labels": label_words(labels, {"model": study.model.name}, outcome),
        "outcome": int(labels["response"]) if motion.status == OK and "response" in labels else -2,
        "ended": ended(motion),
        "state": motion.final if motion.status == OK else None,
        "states": session.motions.states(study),
        "values": {key: value_at(study.resolved, leaf.key) for key, leaf in session.adjustable.items()},
        "hole": [radius / x.scale for radius in hole] if hole and x else None,
        "features": [],
        "steps": motion.steps,
    }
    columns = {"time": motion.time}
    columns |= {name: variables[name] / quantity(name, session.units).scale for name in names}
    angles = model.drawn.angle
    if angles and all(name in variables for name in angles):
        columns["bit angle"] = np.mod(sum(variables[name] for name in angles), 2 * math.pi)
    return head, columns


def ended(motion: SimulatedMotion) -> str:
    """Why a motion ended early, in words; "" where it did not."""
    status = BY_NAME["status"].words(motion.status)
    return "" if motion.status == OK else f"{status.replace('_', ' ')}: {ENDINGS.get(status, status)}"


def saved(session: Opened, request: Request) -> Answer:
    """The present point as a study file: its ``text``, and a ``name`` to
    propose."""
    study = session.motions.at(session.values(request), session.changes(request))
    head = [f"One operating point, saved from the explorer of {os.path.basename(session.path)}"]
    operation = {name: getattr(study.operation, name) for name in first_sliders(study)}
    title = ", ".join(filter(None, ("One operating point", operating_point(operation, session.units))))
    state, resolved = session.start_state(request, study), {**study.resolved, "title": title}
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


def point_rows(session: Opened, place: tuple[int, ...]) -> list[list[str]]:
    """The axes of a point and their values, in words."""
    results = session.sweep()
    point: list[list[str]] = []
    for name, value in results.values_at(place).items():
        if name == "procedure":
            if len(results.coords[name]) > 1 or str(value) != "same":
                point.append(["Carried", str(value)])
        elif name == member_dimension(results):
            point.append([name.capitalize(), str(int(value))])
        else:
            point += value_rows([name], {name: float(value)}, session.units)
    return point


def command(session: Opened, place: tuple[int, ...]) -> str:
    """The command line that writes the trace of a point, which is the nearest to the
    values in it."""
    results = session.sweep()
    parts = ["nsdrill replay", shlex.quote(session.path)]
    keys = {axis.name: axis.key for axis in results.more}
    for name in results.swept:
        key = keys.get(name, name)
        value = float(results.coords[name][place[results.grid.index(name)]])
        unit = base_quantity(key).unit(session.units)
        number = f"{from_si(value, unit):.9g}" if unit else repr(value)
        parts.append(option_of(key, str(word_or_number(key, value)) if words_of(key) else f"{number}{unit}"))
    if len(results.coords["procedure"]) > 1:
        parts.append(f"--procedure {results.coords['procedure'][place[0]]}")
    if member := member_dimension(results):
        parts.append(f"--start {place[-1]}" if member == "start" else f"--at {member}={place[-1]}")
    return " ".join([*parts, "-o trace.h5"])
