"""What the explorer knows of one file, and what it answers: no HTTP here.

A session holds a results file (or the ``.part`` of a run that goes on) or a study. It
has no memory of what was asked: a page sends the state from which to go on, so several
pages of one session do not disturb each other. Requests are mappings of plain data from
outside: nothing in them is trusted, and a wrong one is an :class:`InputError` in words.
"""

from __future__ import annotations

import math
import os
import shlex
import threading
import time
from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from nsdrill.data import Array, Results, Trace, frozen_modes, overrides
from nsdrill.errors import FileError, InputError
from nsdrill.models.leaves import as_told, words_of
from nsdrill.models.registry import described, drawn_in
from nsdrill.models.vocabulary import BY_NAME
from nsdrill.plot.labels import operating_point, quantity, retold
from nsdrill.plot.registry import is_study
from nsdrill.quantity import find
from nsdrill.variables import OK, POINT, dimension_of
from nsdrill.web.branches import Branches, curves, fits, is_branches, read_branches
from nsdrill.web.diagrams import Reply, choices, diagram, members, plane
from nsdrill.web.shown import in_words, response_styles, rows, told, verdict_words

if TYPE_CHECKING:
    from nsdrill.app.motions import Motion, Motions
    from nsdrill.study.keys import Leaf
    from nsdrill.study.study import Study

NUMBERS = ("quantity", "number")  # kinds of leaves that vary without a step
USUAL = ("rotary_speed", "wob", "depth")  # the numbers with a slider from the beginning
SHOWN_SECONDS, LONGEST = 20.0, 2000.0  # of a motion
SAMPLE = 0.005  # s
SAMPLES = 40_000  # of one motion on a page
# Of a local diagram: how many points, and how long each is run. A slow string has fewer
# points.
POINTS, FEWEST = 96, 12
SETTLE, OBSERVE = 60.0, 40.0
WORTH = 1.2e6  # steps of a string of eight states in a second, on few and old processors
WIDE = 0.2  # of the value on both sides


class Session:
    """The explorer of the file ``path``: results, an unfinished run, branches, or a
    study with ``overrides`` applied; of results with the branches of the file ``over``
    above them.

    FileError or InputError where it is something else.
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        units: str = "si",
        overrides: list[str] | None = None,
        over: str | os.PathLike[str] | None = None,
    ) -> None:
        self.path, self.units = os.fspath(path), units
        self.branches: Branches | None = None if over is None else read_branches(over)
        self._turn = threading.Lock()  # to compute
        self._motions: Motions | None = None
        self.results: Results | None = None
        if is_study(path):
            from nsdrill.study import load_study

            self.study: Study = load_study(Path(path), overrides or [])
        else:
            if overrides:
                raise InputError(
                    f"--set: found with {self.path}; allowed: with a study, which "
                    f"ends in .yaml or .yml."
                )
            self._open()
        if over is not None and self.results is None:
            raise InputError(f"--over: found with {self.path}; allowed: with results of a sweep.")
        if self.branches is not None and self.branches.study.model != self.study.model:
            raise InputError(
                f"--over: found branches of the model {self.branches.study.model}; allowed: of "
                f"{self.study.model}."
            )

    def _open(self) -> None:
        if os.path.lexists(self.path) and is_branches(self.path):
            self.branches = read_branches(self.path)
            self.study = self.branches.study
            return
        self.results = self._read()
        from nsdrill.app.stored import stored_study

        self.study = stored_study(
            self.path, self.results.attrs, self.results.coords, self.results.drawn
        )

    def _read(self) -> Results:
        from nsdrill.app.reading import read_any
        from nsdrill.store import kind_of, variables_in

        if os.path.lexists(self.path) and kind_of(self.path) == "trace":
            raise FileError(
                f"{self.path}: found a trace; allowed: results, or a study. Draw it "
                f"with nsdrill plot."
            )
        wanted = None
        if os.path.lexists(self.path):
            wanted = [v.name for v in variables_in(self.path) if v.room in _READ or v.dims == POINT]
        found = read_any(self.path, wanted)
        assert not isinstance(found, Trace)
        return found

    @property
    def motions(self) -> Motions:
        """What computes; imported when it is first needed, as it brings the compiler."""
        if self._motions is None:
            from nsdrill.app.motions import Motions

            self._motions = Motions(self.study, self.results)
        return self._motions

    def warm(self) -> None:
        """Load, or make, the machine code of what a first click, slider and local
        diagram need. A page is served between these, and while what it does not need is
        compiled."""
        values = self.motions.own
        study = self.motions.at(values)
        state = self.motions.start(study)
        with self._turn:
            self.motions.glance(study, state)
        self.motions.ready(study, state)
        time.sleep(0.01)  # who waits has the turn first
        with self._turn:
            motion = self.motions.go_on(study, state, 0.1, SAMPLE)
        if motion.status == OK:
            near = np.linspace(0.99, 1.01, POINTS) * values["rotary_speed"]
            self.motions.ready(study, motion.final, "rotary_speed", near)
            time.sleep(0.01)
            with self._turn:
                self.motions.around(
                    study, motion.final, "rotary_speed", near, settle=0.01, observe=0.01
                )

    # What there is

    def meta(self) -> dict[str, Any]:
        """What a page needs to begin: names, words, units, colours, sliders."""
        model, attrs = described(self.study.model), self._attrs
        head: dict[str, Any] = {
            "kind": "results"
            if self.results is not None
            else "study"
            if self.branches is None
            else "branches",
            "file": os.path.basename(self.path),
            "title": self.title,
            "model": model.title,
            "overrides": [
                f"{key} = {value}" for key, value in overrides(attrs, thresholds=True).items()
            ],
            "units": self.units,
            "seconds": SHOWN_SECONDS,
            "longest": self.study.simulation.transient + self.study.simulation.observe,
            "drawn": self._drawn(),
            "responses": response_styles(),
            "sliders": self._sliders(),
            "usual": list(dict.fromkeys([*USUAL, *self.study.swept])),
            "command": f"nsdrill view {shlex.quote(self.path)}",
        }
        if self.results is not None:
            head["choices"] = choices(self.results, self.units)
            head["points"] = int(self.results["status"].size)
        elif self.branches is not None:
            head["choices"] = self._of_branches()
            head["points"] = len(self.branches.label)
        return head

    @property
    def title(self) -> str:
        """The title of the study, in the units that are shown; the name of the file
        where it has none."""
        axes = self.study.axes
        values = {
            name: axes.get(name, np.array([getattr(self.study.operation, name)])) for name in USUAL
        }
        held = {name: float(of[0]) for name, of in values.items() if len(of) == 1}
        return retold(
            " ".join(self.study.title.split()), operating_point(held, self.units)
        ) or os.path.basename(self.path)

    def _of_branches(self) -> dict[str, Any]:
        """What can be drawn of branches alone."""
        assert self.branches is not None
        there = self.branches.features
        panels = [one for one in drawn_in(self._attrs).panels if one.greatest in there]
        axis = told(self.branches.along, self.units)
        return {
            "axes": [
                {**axis, "key": self.branches.key, "dimension": 0, "values": [], "log": False}
            ],
            "procedures": [""],
            "members": None,
            "labels": [],
            "responses": response_styles(),
            "dimensions": 0,
            "panels": [
                {**told(one.peaks, self.units), "mode": one.mode, "trace": one.trace}
                for one in panels
            ],
            "features": [told(name, self.units) for name in there if name in BY_NAME],
        }

    @property
    def _attrs(self) -> Mapping[str, Any]:
        if self.results is not None:
            return self.results.attrs
        from nsdrill.data import json_text

        return {
            "model": self.study.model,
            "study_resolved": json_text(self.study.resolved),
            "study_overrides": json_text(list(self.study.overrides)),
        }

    def _drawn(self) -> dict[str, Any]:
        """What pictures show of a motion of this model."""
        drawn, traced = drawn_in(self._attrs), {v.name for v in described(self.study.model).trace}
        orbit = {"x", "y"} <= traced and "lateral" not in frozen_modes(self._attrs)
        return {
            "histories": list(drawn.histories),
            "planes": [list(pair) for pair in drawn.planes],
            "section": [list(pair) for pair in drawn.section_planes],
            "orbit": orbit and described(self.study.model).hole is not None,
        }

    @cached_property
    def _movable(self) -> dict[str, Leaf]:
        """The keys of the study that may be changed while the string turns: its
        numbers, and its words."""
        from nsdrill.study.keys import keys_of

        keys = keys_of(self.study.model)
        physical = (*keys.model.sections, "operation")
        # with another, a number has other units
        fixed = keys.model.deciding
        words = {
            key: leaf
            for key, leaf in keys.leaves.items()
            if leaf.kind == "choice" and key not in fixed
        }
        return {
            name: leaf
            for name, leaf in {**keys.axes, **words}.items()
            if leaf.kind in (*NUMBERS, "whole", "choice") and leaf.key.partition(".")[0] in physical
        }

    def _sliders(self) -> list[dict[str, Any]]:
        """The numbers of the study that may be moved while the string turns, each with
        its range, and the words, each with its ``choices``."""
        found = []
        own = self.study.axes
        for name, leaf in self._movable.items():
            value = _value_at(self.study.resolved, leaf.key)
            if leaf.kind == "choice":
                if value is not None:
                    found.append(
                        {
                            "key": name,
                            "words": in_words(name),
                            "meaning": leaf.meaning,
                            "value": value,
                            "choices": list(leaf.choices),
                        }
                    )
                continue
            axis = own.get(name, np.empty(0))
            if not isinstance(value, float) or (one := find(name)) is None:
                continue
            if leaf.kind == "whole":
                low, high = leaf.low, min(leaf.high, max(4 * value, 8.0))
            elif len(axis) > 1:
                value, room = float(axis[len(axis) // 2]), 0.25 * float(axis[-1] - axis[0])
                low, high = float(axis[0]) - room, float(axis[-1]) + room
            elif value:
                low, high = sorted((0.25 * value, 2.5 * value))
            else:
                low, high = 0.0, min(leaf.high, 1.0)
            low, high = max(low, leaf.low), min(high, leaf.high)
            if low <= 0.0 < leaf.low or (name in USUAL and low <= 0.0):
                low = max(leaf.low, 0.02 * high)
            shown = told(dimension_of(name), self.units)
            found.append(
                {
                    "key": name,
                    "words": shown["words"],
                    "unit": shown["unit"],
                    "scale": shown["scale"],
                    "meaning": leaf.meaning or one.long_name,
                    "low": low,
                    "high": high,
                    "value": value,
                    "whole": leaf.kind == "whole",
                }
            )
        return found

    # What is asked

    def diagram(self, asked: Mapping[str, Any]) -> Reply:
        """Peaks or a feature along an axis: ``y``, and perhaps ``x``, ``held`` and
        ``member``."""
        y = _word(asked, "y")
        panel = next((one for one in drawn_in(self._attrs).panels if one.peaks == y), None)
        name = panel.greatest if panel else y
        if self.results is None and self.branches is not None:
            return self._curves_alone(y, name)
        results = self._swept()
        head, columns = diagram(
            results,
            self.units,
            y,
            _word(asked, "x", None),
            _counts(asked),
            _whole(asked, "member", 0),
        )
        if self.branches is not None:
            why = fits(self.branches, results, head["x"]["name"], head["place"], self.units)
            if not why and name in self.branches.features:
                more, lines = curves(self.branches, name, self.units)
                return head | more, columns | lines
            head["note"] = why or "The branches have no such feature."
        return head, columns

    def _curves_alone(self, y: str, name: str) -> Reply:
        """Branches without a sweep beneath."""
        assert self.branches is not None
        if name not in self.branches.features or name not in BY_NAME:
            raise InputError(f"y: found {y}; allowed: peaks or a feature of these branches.")
        more, lines = curves(self.branches, name, self.units)
        across = lines["curve x"]
        head = {
            "x": self._of_branches()["axes"][0],
            "y": told(y, self.units),
            "procedures": [""],
            "head_told": [],
            "place": None,
            "hysteresis": [],
            "lines": [],
            "edges": [across.min(), across.max()],
        }
        none: dict[str, Array] = {
            "values": np.empty((1, 0, 1)),
            "outcome": np.empty((1, 0)),
            "still": np.empty((1, 0)),
        }
        return head | more, none | lines

    def orbit(self, asked: Mapping[str, Any]) -> Reply:
        """The motion of a ``point`` of the branches: one period where it is unstable,
        else so long as others."""
        found, point = self.branches, _whole(asked, "point", -1)
        if found is None or not 0 <= point < len(found.label):
            raise InputError(f"point: found {point}; allowed: a point of the branches.")
        here = {
            name: float(found.features[name][point]) for name in USUAL if name in found.features
        }
        here[found.key] = float(found.numbers[point])
        period = float(found.period[point])
        if not 0.0 < period < LONGEST:  # of steady drilling
            period = SHOWN_SECONDS
        seconds = period * (
            1 if found.unstable[point] else max(1, math.ceil(SHOWN_SECONDS / period))
        )
        with self._turn:
            study = self.motions.at(self.motions.own | here)
            fine = replace(
                study.simulation, rtol=float(found.attrs.get("rtol", study.simulation.rtol))
            )
            study = replace(study, simulation=fine)
            state = np.append(found.state[point], 0.0)
            motion = self.motions.go_on(study, state, seconds, min(SAMPLE, period / 400))
        # Whether both halves of a window agree says nothing of a motion that repeats
        # after another time.
        labels = {name: value for name, value in motion.found.items() if name != "settled"}
        head, columns = self._told(motion, study, {"status": motion.status, **labels})
        if motion.status == OK:
            head["features"] = rows(described(study.model).shown, motion.found, self.units)
        file = shlex.quote(found.path)
        head |= {
            "begins": f"Point {point}, {found.name_of(point)}: run for {seconds:.4g} s, its "
            f"period is {period:.4g} s.",
            "changes": here,
            "command": f"nsdrill show {file} --study > branches_study.yaml && nsdrill simulate "
            f"branches_study.yaml "
            f"--orbit {file} --point {point} -o trace.h5",
        }
        return head, columns

    def plane(self, asked: Mapping[str, Any]) -> Reply:
        """A label or feature over two axes: ``colour``, ``x``, ``y``, and perhaps
        ``held`` and ``member``."""
        return plane(
            self._swept(),
            self.units,
            _word(asked, "colour"),
            _word(asked, "x"),
            _word(asked, "y"),
            _counts(asked),
            _whole(asked, "member", 0),
        )

    def replay(self, asked: Mapping[str, Any]) -> Reply:
        """The stored point at ``place`` once more, its last ``seconds``."""
        place, results = self._place(asked), self._swept()
        seconds = _seconds(asked)
        with self._turn:
            motion = self.motions.replay(place, seconds, _sample(seconds))
            values = self.motions.values(place)
            study = self.motions.at(values)
        stored = {
            name: v[place].item() for name, v in results.variables.items() if v.ndim == len(place)
        }
        head, columns = self._told(motion, study, stored)
        names = [
            name for name in stored if BY_NAME[name].dtype == "f8" and math.isfinite(stored[name])
        ]
        head |= {
            "place": list(place),
            "same_bits": motion.same_bits,
            "command": self._command(place),
            "features": rows(names, stored, self.units),
            "differing": [] if motion.same_bits else self._differing(),
            "from": self._words(place),
            "begins": "stored",
        }
        return head, columns

    def live(self, asked: Mapping[str, Any]) -> Reply:
        """On from ``state`` with ``changes``; from the study's own start where no state
        is given. ``settle`` and ``observe`` are those of a point of a local diagram."""
        values = self._values(asked)
        seconds = _seconds(asked)
        settle, observe = (
            _number(asked, name, 0.0, LONGEST, 0.0) for name in ("settle", "observe")
        )
        with self._turn:
            study = self.motions.at(values, self._changes(asked))
            state = self._from(asked, study)
            if state is None:
                state = self.motions.start(study)
                settle, observe = study.simulation.transient, study.simulation.observe
            motion = self.motions.go_on(
                study, state, seconds, _sample(seconds), settle=settle, observe=observe
            )
        names = described(study.model).shown
        head, columns = self._told(motion, study, {"status": motion.status, **motion.found})
        if motion.status == OK:
            head["features"] = rows(names, motion.found, self.units)
        ran = f"for {motion.seconds:g} s{', with changed numbers' if asked.get('changes') else ''}"
        if asked.get("state"):
            head["begins"] = f"Run on from the present state {ran}."
        else:
            head["begins"] = f"Run from the study's start {ran}.{self._middle()}"
        return head, columns

    def _middle(self) -> str:
        """Of a study that sweeps, at which values its page begins."""
        own = self.motions.own
        swept = (
            [name for name in self.study.swept if not words_of(name)]
            if self.results is None
            else []
        )
        said = rows(
            list(map(dimension_of, swept)),
            {dimension_of(name): own[name] for name in swept},
            self.units,
        )
        return (
            f" The study sweeps; this is the middle: {', '.join(map(' '.join, said))}."
            if said
            else ""
        )

    def local(self, asked: Mapping[str, Any]) -> Reply:
        """A diagram around the present point along ``key``, each point from ``state``."""
        values, key = self._values(asked), _word(asked, "key")
        leaf = self._movable.get(key)
        if leaf is None or leaf.kind not in NUMBERS:
            raise InputError(f"key: found {key}; allowed: a number of the study that has a slider.")
        with self._turn:
            study = self.motions.at(values, self._changes(asked))
            state = self._from(asked, study)
            state = self.motions.start(study) if state is None else state
            centre = float(_value_at(study.resolved, leaf.key) or 0.0)
            width = _number(asked, "wide", 0.001, 10.0, WIDE) * (abs(centre) or 1.0)
            low, high = max(leaf.low, centre - width), min(leaf.high, centre + width)
            for end in (low, high):
                # valid at both ends
                self.motions.at(values, {**self._changes(asked), key: leaf.text(end)})
            probe = self.motions.go_on(study, state, SHOWN_SECONDS, SHOWN_SECONDS)
            cost = max(1.0, len(state) / 9) * probe.steps / SHOWN_SECONDS * (SETTLE + OBSERVE)
            points = int(np.clip(WORTH / cost, FEWEST, POINTS))
            across = np.linspace(low, high, points)
            found = self.motions.around(study, state, key, across, settle=SETTLE, observe=OBSERVE)
        return self._local(study, key, across, found, centre, state)

    def _local(
        self,
        study: Study,
        key: str,
        across: Array,
        found: Mapping[str, Array],
        centre: float,
        state: Array,
    ) -> Reply:
        from nsdrill.analysis.outcome import outcome

        axis = told(dimension_of(key), self.units)
        head: dict[str, Any] = {
            "x": {**axis, "key": key, "values": across / axis["scale"], "log": False},
            "exact": across,
            "centre": centre / axis["scale"],
            "settle": SETTLE,
            "observe": OBSERVE,
            "panels": [],
            "procedures": ["from here"],
            "state": state,
            "states": self.motions.states(study),
        }
        columns: dict[str, Array] = {
            "outcome": outcome(found["status"], found["response"])[np.newaxis]
        }
        for panel in drawn_in(self._attrs).panels:
            values = found[panel.peaks].copy()
            still = np.asarray(~np.isfinite(values).any(axis=1))
            values[:, 0] = np.where(still, found[panel.greatest], values[:, 0])
            shown = told(panel.peaks, self.units)
            head["panels"].append({**shown, "mode": panel.mode, "trace": panel.trace})
            columns[panel.peaks] = values[np.newaxis] / shown["scale"]
            columns[f"{panel.peaks} still"] = still[np.newaxis]
        return head, columns

    def section(self, asked: Mapping[str, Any]) -> Reply:
        """The returns to the Poincare section of the stored point at ``place``, in the
        planes of the model."""
        place, results = self._place(asked), self._swept()
        drawn = drawn_in(results.attrs)
        stored = all(name in results.variables for name in drawn.section) and bool(drawn.section)
        if stored:
            found = {
                name: results[name][place]
                for name in results.variables
                if name.startswith("section_")
            }
            source = "stored returns"
        else:
            from nsdrill.plot.kinds.section import section_of

            simulation = self.study.simulation
            with self._turn:
                motion = self.motions.replay(
                    place, simulation.observe, max(0.01, simulation.observe / SAMPLES)
                )
            speed = self.motions.values(place)["rotary_speed"]
            attrs = {
                "transient": motion.time[0] if len(motion.time) else 0.0,
                "rotary_speed": speed,
            }
            found = section_of(Trace(motion.time, motion.variables, attrs))
            source = "returns in the observed time"
        columns, planes = {}, []
        for across, up in drawn.section_planes:
            if across not in found or up not in found:
                continue
            planes.append([told(across, self.units), told(up, self.units)])
            for name in (across, up):
                columns[name] = found[name] / quantity(name, self.units).scale
        count = int(np.isfinite(next(iter(columns.values()))).sum()) if columns else 0
        return {"planes": planes, "words": f"{count} {source}"}, columns

    def saved(self, asked: Mapping[str, Any]) -> dict[str, Any]:
        """The present point as a study file: ``text``, and a ``name`` to offer for it."""
        from nsdrill.study import parse_study
        from nsdrill.study.write import study_text

        study = self.motions.at(self._values(asked), self._changes(asked))
        head = [f"One operating point, saved from the explorer of {os.path.basename(self.path)}"]
        operation = {name: getattr(study.operation, name) for name in USUAL}
        title = f"One operating point, {operating_point(operation, self.units)}"
        state, resolved = self._from(asked, study), {**study.resolved, "title": title}
        own = study_text(resolved, head)
        if state is None:
            return {"text": own, "name": "point.yaml"}
        begun = self.motions.with_start(study, state)
        if begun is not None:
            text = study_text(
                {**begun, "title": title}, [*head, "Its start is the state that the page showed"]
            )
            try:
                parse_study(text, "point.yaml")
            except InputError:
                pass  # a state that no study may begin in, deep in the wall say
            else:
                return {"text": text, "name": "point.yaml"}
        parse_study(own, "point.yaml")
        head.append(
            "Its start is that of the study: the state that the page showed cannot be "
            "written as one"
        )
        return {"text": study_text(resolved, head), "name": "point.yaml"}

    # Of what it is made

    def _from(self, asked: Mapping[str, Any], study: Study) -> Array | None:
        """The state from which a page goes on, as the string of ``study`` has it: with
        another drive it has others."""
        state, names = _state(asked), asked.get("states")
        if state is None or names is None:
            return state
        if (
            not isinstance(names, list)
            or len(names) != len(state)
            or not all(isinstance(name, str) for name in names)
        ):
            raise InputError("states: found something else; allowed: the names of the state.")
        return self.motions.fitted(study, dict(zip(names, state.tolist(), strict=True)))

    def _told(self, motion: Motion, study: Study, labels: Mapping[str, Any]) -> Reply:
        """A motion for a page."""
        from nsdrill.app.wording import ENDINGS

        status = (BY_NAME["status"].flag_meanings or "").split()[motion.status]
        model, variables = described(study.model), motion.variables
        names = [v.name for v in model.trace if v.name in variables and quantity(v.name).scale]
        hole = model.hole(study.parameters) if model.hole else None
        x = quantity("x", self.units) if hole and "x" in variables else None
        head = {
            "channels": [told(name, self.units) for name in names],
            "interval": float(motion.time[1] - motion.time[0]) if len(motion.time) > 1 else 0.0,
            "begin": float(motion.time[0]) if len(motion.time) else 0.0,
            "samples": len(motion.time),
            "labels": verdict_words(labels),
            "outcome": int(labels["response"])
            if motion.status == OK and "response" in labels
            else -2,
            "ended": ""
            if motion.status == OK
            else f"{status.replace('_', ' ')}: {ENDINGS.get(status, status)}",
            "state": motion.final if motion.status == OK else None,
            "states": self.motions.states(study),
            "values": {
                key: _value_at(study.resolved, leaf.key) for key, leaf in self._movable.items()
            },
            "hole": [radius / x.scale for radius in hole] if hole and x else None,
            "features": [],
            "steps": motion.steps,
        }
        columns = {"time": motion.time}
        columns |= {name: variables[name] / quantity(name, self.units).scale for name in names}
        if "twist" in variables and "drive_angle" in variables:
            columns["bit angle"] = np.mod(
                variables["twist"] + variables["drive_angle"], 2 * math.pi
            )
        return head, columns

    def _swept(self) -> Results:
        if self.results is None:
            raise InputError("found a study, which has no points; allowed: with results.")
        return self.results

    def _place(self, asked: Mapping[str, Any]) -> tuple[int, ...]:
        place, shape = asked.get("place"), self._swept().shape
        if (
            not isinstance(place, list)
            or len(place) != len(shape)
            or not all(
                isinstance(i, int) and not isinstance(i, bool) and 0 <= i < n
                for i, n in zip(place, shape, strict=True)
            )
        ):
            raise InputError(
                f"place: found {str(place)[:60]}; allowed: a point of "
                f"{' x '.join(map(str, shape))}."
            )
        return tuple(place)

    def _values(self, asked: Mapping[str, Any]) -> dict[str, float]:
        """The values of the axes at the point from which a page started."""
        if self.results is None or asked.get("place") is None:
            return self.motions.own
        return self.motions.values(self._place(asked))

    def _changes(self, asked: Mapping[str, Any]) -> dict[str, str]:
        """Changed keys with their values as a study has them: numbers are in SI, texts
        have a unit."""
        changes = asked.get("changes") or {}
        if not isinstance(changes, dict):
            raise InputError("changes: found something else; allowed: a mapping by keys.")
        found = {}
        for key, value in changes.items():
            leaf = self._movable.get(key)
            if leaf is None:
                raise InputError(
                    f"{str(key)[:60]}: found an unknown key; allowed: a number or a "
                    f"word of the study."
                )
            if leaf.kind == "whole" and isinstance(value, float) and value.is_integer():
                value = int(value)
            if (
                isinstance(value, str)
                and len(value) <= 60
                and not set(value) & set("{}[]&*!|>%@`#:,\"'\n")
            ):
                found[key] = value
            elif (
                isinstance(value, int | float)
                and not isinstance(value, bool)
                and math.isfinite(value)
            ):
                found[key] = leaf.text(value if leaf.kind == "whole" else float(value))
            else:
                raise InputError(f"{key}: found {str(value)[:60]}; allowed: {leaf.allowed()}.")
        return found

    def _words(self, place: tuple[int, ...]) -> list[list[str]]:
        """Which point it is: words and values."""
        results = self._swept()
        found = []
        for name, i in zip(results.grid, place, strict=True):
            value = results.coords[name][i]
            if name == "procedure":
                if len(results.coords[name]) > 1 or str(value) != "same":
                    found.append(["Carried", str(value)])
            elif name == members(results):
                found.append([name.capitalize(), str(int(value))])
            else:
                found += rows([name], {name: float(value)}, self.units)
        return found

    def _command(self, place: tuple[int, ...]) -> str:
        """The command line that gives the trace of a point."""
        from nsdrill.app.trajectory import option_of
        from nsdrill.study.keys import keys_of

        results, leaves = self._swept(), keys_of(self.study.model).axes
        parts = ["nsdrill replay", shlex.quote(self.path)]
        keys = {axis.name: axis.key for axis in results.more}
        for name in results.swept:
            key = keys.get(name, name)
            value = float(results.coords[name][place[results.grid.index(name)]])
            text = (
                str(as_told(key, value))
                if words_of(key)
                else leaves[key].text(value).replace(" ", "")
            )
            parts.append(option_of(key, text))
        if len(results.coords["procedure"]) > 1:
            parts.append(f"--procedure {results.coords['procedure'][place[0]]}")
        if member := members(results):
            parts.append(
                f"--start {place[-1]}" if member == "start" else f"--at {member}={place[-1]}"
            )
        return " ".join([*parts, "-o trace.h5"])

    def _differing(self) -> list[str]:
        from nsdrill.app.provenance import unlike

        return unlike(self._swept().attrs, "numpy_version", "processor")


_READ = ("run", "feature", "label", "trust", "peaks", "section", "states")


def _value_at(resolved: Mapping[str, Any], key: str) -> float | str | None:
    """The number or the word at a key."""
    value: Any = resolved
    for part in key.split("."):
        value = value.get(part) if isinstance(value, dict) else None
    if isinstance(value, str):
        return value
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else None


def _word(asked: Mapping[str, Any], name: str, default: Any = "") -> Any:
    value = asked.get(name, default)
    if value is default and default != "":
        return default
    if not isinstance(value, str) or len(value) > 100:
        raise InputError(f"{name}: found {str(value)[:60]}; allowed: a name.")
    return value


def _whole(asked: Mapping[str, Any], name: str, default: int) -> int:
    value = asked.get(name, default)
    if isinstance(value, bool) or not isinstance(value, int):
        raise InputError(f"{name}: found {str(value)[:60]}; allowed: a whole number.")
    return value


def _number(asked: Mapping[str, Any], name: str, low: float, high: float, default: float) -> float:
    value = asked.get(name, default)
    if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
        raise InputError(f"{name}: found {str(value)[:60]}; allowed: {low:g} to {high:g}.")
    return float(value)


def _seconds(asked: Mapping[str, Any]) -> float:
    return _number(asked, "seconds", 0.1, 1e6, SHOWN_SECONDS)


def _sample(seconds: float) -> float:
    return max(SAMPLE, seconds / SAMPLES)


def _counts(asked: Mapping[str, Any]) -> dict[str, int]:
    held = asked.get("held") or {}
    if not isinstance(held, dict):
        raise InputError("held: found something else; allowed: a mapping of axes to numbers.")
    return held


def _state(asked: Mapping[str, Any]) -> Array | None:
    state = asked.get("state")
    if state is None:
        return None
    if (
        not isinstance(state, list)
        or len(state) > 1000
        or not all(
            isinstance(value, int | float) and not isinstance(value, bool) for value in state
        )
    ):
        raise InputError("state: found something else; allowed: a list of numbers.")
    return np.array(state, dtype=float)
