"""The explorer of one file, without HTTP: the data of the file, and the replies to the
requests of a page.

A session holds a results file (or the ``.part`` file of a run in progress), branches or
a study. It keeps no state between requests: a page sends the state from which a motion
continues, so that several pages of one session do not disturb each other. Requests are
mappings of plain data from outside: every value is checked, and a wrong one raises
:class:`InputError`.
"""

from __future__ import annotations

import math
import os
import shlex
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from nsdrill import interrupt
from nsdrill.data import Array, Results, Trace, frozen_modes, overrides
from nsdrill.errors import FileError, InputError
from nsdrill.models.leaves import word_or_number, words_of
from nsdrill.models.registry import described, drawn_in
from nsdrill.models.vocabulary import BY_NAME
from nsdrill.plot.labels import operating_point, quantity, retold
from nsdrill.plot.registry import is_study
from nsdrill.quantity import find
from nsdrill.variables import OK, POINT, dimension_of
from nsdrill.web.branches import Branches, curves, is_branches, mismatch, read_branches
from nsdrill.web.diagrams import Reply, choices, diagram, member_dimension, plane
from nsdrill.web.shown import in_words, label_words, quantity_data, response_styles, value_rows

if TYPE_CHECKING:
    from nsdrill.app.motions import Motion, Motions
    from nsdrill.study.keys import Leaf
    from nsdrill.study.study import Study

CONTINUOUS = ("quantity", "number")  # kinds of leaves that vary without a step
DEFAULT_SLIDERS = ("rotary_speed", "wob", "depth")  # the sliders that a page opens with
DEFAULT_SECONDS, MAX_SECONDS = 20.0, 2000.0  # of a motion
SAMPLE = 0.005  # s
MAX_SAMPLES = 40_000  # of one motion on a page
# A local diagram: the number of points, fewer where the string is slow to compute; the
# times of each point in s; and the half width of the diagram relative to the value.
MAX_POINTS, MIN_POINTS = 96, 12
SETTLE, OBSERVE = 60.0, 40.0
MAX_STEPS = 1.2e6  # of all points, of a string of eight states: about 1 s on few, old processors
HALF_WIDTH = 0.2


class Session:
    """The explorer of the file ``path``: results, an unfinished run, branches, or a
    study with ``overrides`` applied; in ``units``, by default those of the study. Over
    the diagrams of results lie the branches of the file ``over``, if given.

    FileError or InputError where it is something else.
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        units: str | None = None,
        overrides: list[str] | None = None,
        over: str | os.PathLike[str] | None = None,
    ) -> None:
        self.path = os.fspath(path)
        self.branches: Branches | None = None if over is None else read_branches(over)
        self._compute_lock = threading.Lock()
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
        self.units = units or self.study.units
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
        names = None
        if os.path.lexists(self.path):
            names = [
                v.name for v in variables_in(self.path) if v.room in _READ_GROUPS or v.dims == POINT
            ]
        results = read_any(self.path, names)
        assert not isinstance(results, Trace)
        return results

    @property
    def motions(self) -> Motions:
        """The motions of the string; imported at first use, as this loads the
        compiler."""
        if self._motions is None:
            from nsdrill.app.motions import Motions

            self._motions = Motions(self.study, self.results)
        return self._motions

    @contextmanager
    def _computing(self) -> Iterator[None]:
        """One run at a time; KeyboardInterrupt where nobody waits for it any more."""
        while not self._compute_lock.acquire(timeout=0.1):
            interrupt.check()
        try:
            interrupt.check()
            yield
        finally:
            self._compute_lock.release()

    def warm(self) -> None:
        """Load or compile the machine code that a first click, slider and local diagram
        need. The lock is released in between, so that a page is served meanwhile."""
        values = self.motions.own
        study = self.motions.at(values)
        state = self.motions.start(study)
        with self._computing():
            self.motions.short_motion(study, state)
        self.motions.compile(study, state)
        time.sleep(0.01)  # a waiting request takes the lock first
        with self._computing():
            motion = self.motions.run_from(study, state, 0.1, SAMPLE)
        if motion.status == OK:
            near = np.linspace(0.99, 1.01, MAX_POINTS) * values["rotary_speed"]
            self.motions.compile(study, motion.final, "rotary_speed", near)
            time.sleep(0.01)
            with self._computing():
                self.motions.run_along(
                    study, motion.final, "rotary_speed", near, settle=0.01, observe=0.01
                )

    # ---- the file

    def meta(self) -> dict[str, Any]:
        """What a page needs at the beginning: names, words, units, colours, sliders."""
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
            "seconds": DEFAULT_SECONDS,
            "longest": self.study.simulation.transient + self.study.simulation.observe,
            "drawn": self._motion_drawing(),
            "responses": response_styles(),
            "sliders": self._sliders(),
            "usual": list(dict.fromkeys([*DEFAULT_SLIDERS, *self.study.swept])),
            "command": f"nsdrill view {shlex.quote(self.path)}",
        }
        if self.results is not None:
            head["choices"] = choices(self.results, self.units)
            head["points"] = int(self.results["status"].size)
        elif self.branches is not None:
            head["choices"] = self._branch_choices()
            head["points"] = len(self.branches.label)
        return head

    @property
    def title(self) -> str:
        """The title of the study, in the units that are shown; the name of the file
        where it has none."""
        axes = self.study.axes
        values = {
            name: axes.get(name, np.array([getattr(self.study.operation, name)]))
            for name in DEFAULT_SLIDERS
        }
        held = {name: float(of[0]) for name, of in values.items() if len(of) == 1}
        return retold(
            " ".join(self.study.title.split()), operating_point(held, self.units)
        ) or os.path.basename(self.path)

    def _branch_choices(self) -> dict[str, Any]:
        """What can be drawn of branches without a sweep."""
        assert self.branches is not None
        features = self.branches.features
        panels = [panel for panel in drawn_in(self._attrs).panels if panel.greatest in features]
        axis = quantity_data(self.branches.along, self.units)
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
                {**quantity_data(panel.peaks, self.units), "mode": panel.mode, "trace": panel.trace}
                for panel in panels
            ],
            "features": [quantity_data(name, self.units) for name in features if name in BY_NAME],
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

    def _motion_drawing(self) -> dict[str, Any]:
        """What is drawn of a motion of this model."""
        drawn, traced = drawn_in(self._attrs), {v.name for v in described(self.study.model).trace}
        orbit = {"x", "y"} <= traced and "lateral" not in frozen_modes(self._attrs)
        return {
            "histories": list(drawn.histories),
            "planes": [list(pair) for pair in drawn.planes],
            "section": [list(pair) for pair in drawn.section_planes],
            "orbit": orbit and described(self.study.model).hole is not None,
        }

    @cached_property
    def _adjustable(self) -> dict[str, Leaf]:
        """The keys of the study that may change while the string rotates: numbers and
        choices of a word."""
        from nsdrill.study.keys import keys_of

        keys = keys_of(self.study.model)
        physical = (*keys.model.sections, "operation")
        fixed = keys.model.deciding  # another choice of these changes the units of a number
        words = {
            key: leaf
            for key, leaf in keys.leaves.items()
            if leaf.kind == "choice" and key not in fixed
        }
        return {
            name: leaf
            for name, leaf in {**keys.axes, **words}.items()
            if leaf.kind in (*CONTINUOUS, "whole", "choice")
            and leaf.key.partition(".")[0] in physical
        }

    def _sliders(self) -> list[dict[str, Any]]:
        """The numbers of the study that may change while the string rotates, each with
        its range, and the words, each with its ``choices``."""
        sliders: list[dict[str, Any]] = []
        axes = self.study.axes
        for name, leaf in self._adjustable.items():
            value = _value_at(self.study.resolved, leaf.key)
            if leaf.kind == "choice":
                if value is not None:
                    sliders.append(
                        {
                            "key": name,
                            "words": in_words(name),
                            "meaning": leaf.meaning,
                            "value": value,
                            "choices": list(leaf.choices),
                        }
                    )
                continue
            axis = axes.get(name, np.empty(0))
            if not isinstance(value, float) or (known := find(name)) is None:
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
            if low <= 0.0 < leaf.low or (name in DEFAULT_SLIDERS and low <= 0.0):
                low = max(leaf.low, 0.02 * high)
            shown = quantity_data(dimension_of(name), self.units)
            sliders.append(
                {
                    "key": name,
                    "words": shown["words"],
                    "unit": shown["unit"],
                    "scale": shown["scale"],
                    "meaning": leaf.meaning or known.long_name,
                    "low": low,
                    "high": high,
                    "value": value,
                    "whole": leaf.kind == "whole",
                }
            )
        return sliders

    # ---- requests

    def diagram(self, request: Mapping[str, Any]) -> Reply:
        """Peaks or a feature ``y`` along an axis; optional ``x``, ``held`` and
        ``member``."""
        y = _name(request, "y")
        panel = next((panel for panel in drawn_in(self._attrs).panels if panel.peaks == y), None)
        name = panel.greatest if panel else y
        if self.results is None and self.branches is not None:
            return self._branch_diagram(y, name)
        results = self._sweep_results()
        head, columns = diagram(
            results,
            self.units,
            y,
            _name(request, "x", None),
            _held_indices(request),
            _integer(request, "member", 0),
        )
        if self.branches is not None:
            reason = mismatch(self.branches, results, head["x"]["name"], head["place"], self.units)
            if not reason and name in self.branches.features:
                more, lines = curves(self.branches, name, self.units)
                return head | more, columns | lines
            head["note"] = reason or "The branches have no such feature."
        return head, columns

    def _branch_diagram(self, y: str, name: str) -> Reply:
        """The curves of branches without a sweep."""
        assert self.branches is not None
        if name not in self.branches.features or name not in BY_NAME:
            raise InputError(f"y: found {y}; allowed: peaks or a feature of these branches.")
        more, lines = curves(self.branches, name, self.units)
        x = lines["curve x"]
        head = {
            "x": self._branch_choices()["axes"][0],
            "y": quantity_data(y, self.units),
            "procedures": [""],
            "hover_quantities": [],
            "place": None,
            "hysteresis": [],
            "lines": [],
            "edges": [x.min(), x.max()],
        }
        no_points: dict[str, Array] = {
            "values": np.empty((1, 0, 1)),
            "outcome": np.empty((1, 0)),
            "constant": np.empty((1, 0)),
        }
        return head | more, no_points | lines

    def orbit(self, request: Mapping[str, Any]) -> Reply:
        """The motion of a ``point`` of the branches: over one period where it is
        unstable, else over whole periods of :data:`DEFAULT_SECONDS` or more."""
        branches, point = self.branches, _integer(request, "point", -1)
        if branches is None or not 0 <= point < len(branches.label):
            raise InputError(f"point: found {point}; allowed: a point of the branches.")
        values = {
            name: float(branches.features[name][point])
            for name in DEFAULT_SLIDERS
            if name in branches.features
        }
        values[branches.key] = float(branches.numbers[point])
        period = float(branches.period[point])
        if not 0.0 < period < MAX_SECONDS:  # steady drilling has none
            period = DEFAULT_SECONDS
        seconds = period * (
            1 if branches.unstable[point] else max(1, math.ceil(DEFAULT_SECONDS / period))
        )
        with self._computing():
            study = self.motions.at(self.motions.own | values)
            simulation = replace(
                study.simulation, rtol=float(branches.attrs.get("rtol", study.simulation.rtol))
            )
            study = replace(study, simulation=simulation)
            state = np.append(branches.state[point], 0.0)
            motion = self.motions.run_from(study, state, seconds, min(SAMPLE, period / 400))
        # "settled" compares the halves of the observation, which says nothing of a
        # motion with another period.
        labels = {name: value for name, value in motion.found.items() if name != "settled"}
        head, columns = self._motion_reply(motion, study, {"status": motion.status, **labels})
        if motion.status == OK:
            head["features"] = value_rows(described(study.model).shown, motion.found, self.units)
        file = shlex.quote(branches.path)
        head |= {
            "begins": f"Point {point}, {branches.name_of(point)}: run for {seconds:.4g} s, its "
            f"period is {period:.4g} s.",
            "changes": values,
            "command": f"nsdrill show {file} --study > branches_study.yaml && nsdrill simulate "
            f"branches_study.yaml "
            f"--orbit {file} --point {point} -o trace.h5",
        }
        return head, columns

    def plane(self, request: Mapping[str, Any]) -> Reply:
        """A label or feature ``colour`` over two axes ``x`` and ``y``; optional
        ``held`` and ``member``."""
        return plane(
            self._sweep_results(),
            self.units,
            _name(request, "colour"),
            _name(request, "x"),
            _name(request, "y"),
            _held_indices(request),
            _integer(request, "member", 0),
        )

    def replay(self, request: Mapping[str, Any]) -> Reply:
        """The last ``seconds`` of the stored point at ``place``, run again."""
        place, results = self._place(request), self._sweep_results()
        seconds = _seconds(request)
        with self._computing():
            motion = self.motions.replay(place, seconds, _sample(seconds))
            values = self.motions.values(place)
            study = self.motions.at(values)
        stored = {
            name: v[place].item() for name, v in results.variables.items() if v.ndim == len(place)
        }
        head, columns = self._motion_reply(motion, study, stored)
        names = [
            name for name in stored if BY_NAME[name].dtype == "f8" and math.isfinite(stored[name])
        ]
        head |= {
            "place": list(place),
            "same_bits": motion.same_bits,
            "command": self._command(place),
            "features": value_rows(names, stored, self.units),
            "differing": [] if motion.same_bits else self._differing(),
            "from": self._point_rows(place),
            "begins": "stored",
        }
        return head, columns

    def live(self, request: Mapping[str, Any]) -> Reply:
        """The motion from ``state`` on with ``changes``; from the study's own start
        where no state is given. ``settle`` and ``observe`` are those of a point of a
        local diagram."""
        values = self._values(request)
        seconds = _seconds(request)
        settle, observe = (
            _number(request, name, 0.0, MAX_SECONDS, 0.0) for name in ("settle", "observe")
        )
        with self._computing():
            study = self.motions.at(values, self._changes(request))
            state = self._start_state(request, study)
            if state is None:
                state = self.motions.start(study)
                settle, observe = study.simulation.transient, study.simulation.observe
            motion = self.motions.run_from(
                study, state, seconds, _sample(seconds), settle=settle, observe=observe
            )
        names = described(study.model).shown
        head, columns = self._motion_reply(motion, study, {"status": motion.status, **motion.found})
        if motion.status == OK:
            head["features"] = value_rows(names, motion.found, self.units)
        duration = (
            f"for {motion.seconds:g} s{', with changed numbers' if request.get('changes') else ''}"
        )
        if request.get("state"):
            head["begins"] = f"Run on from the present state {duration}."
        else:
            head["begins"] = f"Run from the study's start {duration}.{self._middle_of_sweep()}"
        return head, columns

    def _middle_of_sweep(self) -> str:
        """The values at which the page of a study that sweeps begins, as a sentence."""
        values = self.motions.own
        swept = (
            [name for name in self.study.swept if not words_of(name)]
            if self.results is None
            else []
        )
        texts = value_rows(
            list(map(dimension_of, swept)),
            {dimension_of(name): values[name] for name in swept},
            self.units,
        )
        return (
            f" The study sweeps; this is the middle: {', '.join(map(' '.join, texts))}."
            if texts
            else ""
        )

    def local(self, request: Mapping[str, Any]) -> Reply:
        """A diagram around the present point along ``key``; each of its points is run
        from ``state``."""
        values, key = self._values(request), _name(request, "key")
        leaf = self._adjustable.get(key)
        if leaf is None or leaf.kind not in CONTINUOUS:
            raise InputError(f"key: found {key}; allowed: a number of the study that has a slider.")
        with self._computing():
            study = self.motions.at(values, self._changes(request))
            state = self._start_state(request, study)
            state = self.motions.start(study) if state is None else state
            centre = float(_value_at(study.resolved, leaf.key) or 0.0)
            width = _number(request, "wide", 0.001, 10.0, HALF_WIDTH) * (abs(centre) or 1.0)
            low, high = max(leaf.low, centre - width), min(leaf.high, centre + width)
            for end in (low, high):  # InputError where the study is not valid there
                self.motions.at(values, {**self._changes(request), key: leaf.text(end)})
            probe = self.motions.run_from(study, state, DEFAULT_SECONDS, DEFAULT_SECONDS)
            cost = max(1.0, len(state) / 9) * probe.steps / DEFAULT_SECONDS * (SETTLE + OBSERVE)
            points = int(np.clip(MAX_STEPS / cost, MIN_POINTS, MAX_POINTS))
            x = np.linspace(low, high, points)
            columns = self.motions.run_along(study, state, key, x, settle=SETTLE, observe=OBSERVE)
        return self._local(study, key, x, columns, centre, state)

    def _local(
        self,
        study: Study,
        key: str,
        x: Array,
        point_columns: Mapping[str, Array],
        centre: float,
        state: Array,
    ) -> Reply:
        from nsdrill.analysis.outcome import outcome

        axis = quantity_data(dimension_of(key), self.units)
        head: dict[str, Any] = {
            "x": {**axis, "key": key, "values": x / axis["scale"], "log": False},
            "exact": x,
            "centre": centre / axis["scale"],
            "settle": SETTLE,
            "observe": OBSERVE,
            "panels": [],
            "procedures": ["from here"],
            "state": state,
            "states": self.motions.states(study),
        }
        columns: dict[str, Array] = {
            "outcome": outcome(point_columns["status"], point_columns["response"])[np.newaxis]
        }
        for panel in drawn_in(self._attrs).panels:
            values = point_columns[panel.peaks].copy()
            constant = np.asarray(~np.isfinite(values).any(axis=1))
            values[:, 0] = np.where(constant, point_columns[panel.greatest], values[:, 0])
            shown = quantity_data(panel.peaks, self.units)
            head["panels"].append({**shown, "mode": panel.mode, "trace": panel.trace})
            columns[panel.peaks] = values[np.newaxis] / shown["scale"]
            columns[f"{panel.peaks} constant"] = constant[np.newaxis]
        return head, columns

    def section(self, request: Mapping[str, Any]) -> Reply:
        """The returns of the stored point at ``place`` to the Poincare section, in the
        planes of the model."""
        place, results = self._place(request), self._sweep_results()
        drawn = drawn_in(results.attrs)
        stored = all(name in results.variables for name in drawn.section) and bool(drawn.section)
        if stored:
            returns = {
                name: results[name][place]
                for name in results.variables
                if name.startswith("section_")
            }
            source = "stored returns"
        else:
            from nsdrill.plot.kinds.section import section_of

            simulation = self.study.simulation
            with self._computing():
                motion = self.motions.replay(
                    place, simulation.observe, max(0.01, simulation.observe / MAX_SAMPLES)
                )
            speed = self.motions.values(place)["rotary_speed"]
            attrs = {
                "transient": motion.time[0] if len(motion.time) else 0.0,
                "rotary_speed": speed,
            }
            returns = section_of(Trace(motion.time, motion.variables, attrs))
            source = "returns in the observed time"
        columns, planes = {}, []
        for pair in drawn.section_planes:
            if not all(name in returns for name in pair):
                continue
            planes.append([quantity_data(name, self.units) for name in pair])
            for name in pair:
                columns[name] = returns[name] / quantity(name, self.units).scale
        count = int(np.isfinite(next(iter(columns.values()))).sum()) if columns else 0
        return {"planes": planes, "words": f"{count} {source}"}, columns

    def saved(self, request: Mapping[str, Any]) -> dict[str, Any]:
        """The present point as a study file: its ``text``, and a ``name`` to
        propose."""
        from nsdrill.study import parse_study
        from nsdrill.study.write import study_text

        study = self.motions.at(self._values(request), self._changes(request))
        head = [f"One operating point, saved from the explorer of {os.path.basename(self.path)}"]
        operation = {name: getattr(study.operation, name) for name in DEFAULT_SLIDERS}
        title = f"One operating point, {operating_point(operation, self.units)}"
        state, resolved = self._start_state(request, study), {**study.resolved, "title": title}
        plain_text = study_text(resolved, head)
        if state is None:
            return {"text": plain_text, "name": "point.yaml"}
        with_start = self.motions.with_start(study, state)
        if with_start is not None:
            text = study_text(
                {**with_start, "title": title},
                [*head, "Its start is the state that the page showed"],
            )
            try:
                parse_study(text, "point.yaml")
            except InputError:
                pass  # a study may not start there, for example deep in the wall
            else:
                return {"text": text, "name": "point.yaml"}
        parse_study(plain_text, "point.yaml")
        head.append(
            "Its start is that of the study: the state that the page showed cannot be "
            "written as one"
        )
        return {"text": study_text(resolved, head), "name": "point.yaml"}

    # ---- helpers

    def _start_state(self, request: Mapping[str, Any], study: Study) -> Array | None:
        """The state of the request in the states of the string of ``study``, which may
        differ from those of the page: another drive has others. None where the request
        has no state."""
        state, names = _state(request), request.get("states")
        if state is None or names is None:
            return state
        if (
            not isinstance(names, list)
            or len(names) != len(state)
            or not all(isinstance(name, str) for name in names)
        ):
            raise InputError("states: found something else; allowed: the names of the state.")
        return self.motions.fitted(study, dict(zip(names, state.tolist(), strict=True)))

    def _motion_reply(self, motion: Motion, study: Study, labels: Mapping[str, Any]) -> Reply:
        """The reply with a motion."""
        from nsdrill.app.wording import ENDINGS

        status = (BY_NAME["status"].flag_meanings or "").split()[motion.status]
        model, variables = described(study.model), motion.variables
        names = [v.name for v in model.trace if v.name in variables and quantity(v.name).scale]
        hole = model.hole(study.parameters) if model.hole else None
        x = quantity("x", self.units) if hole and "x" in variables else None
        head = {
            "channels": [quantity_data(name, self.units) for name in names],
            "interval": float(motion.time[1] - motion.time[0]) if len(motion.time) > 1 else 0.0,
            "begin": float(motion.time[0]) if len(motion.time) else 0.0,
            "samples": len(motion.time),
            "labels": label_words(labels),
            "outcome": int(labels["response"])
            if motion.status == OK and "response" in labels
            else -2,
            "ended": ""
            if motion.status == OK
            else f"{status.replace('_', ' ')}: {ENDINGS.get(status, status)}",
            "state": motion.final if motion.status == OK else None,
            "states": self.motions.states(study),
            "values": {
                key: _value_at(study.resolved, leaf.key) for key, leaf in self._adjustable.items()
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

    def _sweep_results(self) -> Results:
        if self.results is None:
            raise InputError("found a study, which has no points; allowed: with results.")
        return self.results

    def _place(self, request: Mapping[str, Any]) -> tuple[int, ...]:
        place, shape = request.get("place"), self._sweep_results().shape
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

    def _values(self, request: Mapping[str, Any]) -> dict[str, float]:
        """The values of the axes at the point that the page started from."""
        if self.results is None or request.get("place") is None:
            return self.motions.own
        return self.motions.values(self._place(request))

    def _changes(self, request: Mapping[str, Any]) -> dict[str, str]:
        """The changed keys with their values as a study writes them. In a request,
        numbers are in SI and texts have a unit."""
        changes = request.get("changes") or {}
        if not isinstance(changes, dict):
            raise InputError("changes: found something else; allowed: a mapping by keys.")
        texts = {}
        for key, value in changes.items():
            leaf = self._adjustable.get(key)
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
                texts[key] = value
            elif (number := _finite(value)) is not None and leaf.low <= number <= leaf.high:
                texts[key] = leaf.text(value if leaf.kind == "whole" else number)
            else:
                raise InputError(f"{key}: found {str(value)[:60]}; allowed: {leaf.allowed()}.")
        return texts

    def _point_rows(self, place: tuple[int, ...]) -> list[list[str]]:
        """The axes of a point and their values, in words."""
        results = self._sweep_results()
        point: list[list[str]] = []
        for name, i in zip(results.grid, place, strict=True):
            value = results.coords[name][i]
            if name == "procedure":
                if len(results.coords[name]) > 1 or str(value) != "same":
                    point.append(["Carried", str(value)])
            elif name == member_dimension(results):
                point.append([name.capitalize(), str(int(value))])
            else:
                point += value_rows([name], {name: float(value)}, self.units)
        return point

    def _command(self, place: tuple[int, ...]) -> str:
        """The command line that writes the trace of a point."""
        from nsdrill.app.trajectory import option_of
        from nsdrill.study.keys import keys_of

        results, leaves = self._sweep_results(), keys_of(self.study.model).axes
        parts = ["nsdrill replay", shlex.quote(self.path)]
        keys = {axis.name: axis.key for axis in results.more}
        for name in results.swept:
            key = keys.get(name, name)
            value = float(results.coords[name][place[results.grid.index(name)]])
            text = (
                str(word_or_number(key, value))
                if words_of(key)
                else leaves[key].text(value).replace(" ", "")
            )
            parts.append(option_of(key, text))
        if len(results.coords["procedure"]) > 1:
            parts.append(f"--procedure {results.coords['procedure'][place[0]]}")
        if member := member_dimension(results):
            parts.append(
                f"--start {place[-1]}" if member == "start" else f"--at {member}={place[-1]}"
            )
        return " ".join([*parts, "-o trace.h5"])

    def _differing(self) -> list[str]:
        from nsdrill.app.provenance import unlike

        return unlike(self._sweep_results().attrs, "numpy_version", "processor")


_READ_GROUPS = ("run", "feature", "label", "trust", "peaks", "section", "states")


def _value_at(resolved: Mapping[str, Any], key: str) -> float | str | None:
    """The number or the word at a dotted key; None where there is neither."""
    value: Any = resolved
    for part in key.split("."):
        value = value.get(part) if isinstance(value, dict) else None
    if isinstance(value, str):
        return value
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else None


def _name(request: Mapping[str, Any], name: str, default: Any = "") -> Any:
    value = request.get(name, default)
    if value is default and default != "":
        return default
    if not isinstance(value, str) or len(value) > 100:
        raise InputError(f"{name}: found {str(value)[:60]}; allowed: a name.")
    return value


def _integer(request: Mapping[str, Any], name: str, default: int) -> int:
    value = request.get(name, default)
    if isinstance(value, bool) or not isinstance(value, int):
        raise InputError(f"{name}: found {str(value)[:60]}; allowed: a whole number.")
    return value


def _number(
    request: Mapping[str, Any], name: str, low: float, high: float, default: float
) -> float:
    value = request.get(name, default)
    if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
        raise InputError(f"{name}: found {str(value)[:60]}; allowed: {low:g} to {high:g}.")
    return float(value)


def _seconds(request: Mapping[str, Any]) -> float:
    return _number(request, "seconds", 0.1, 1e6, DEFAULT_SECONDS)


def _sample(seconds: float) -> float:
    return max(SAMPLE, seconds / MAX_SAMPLES)


def _held_indices(request: Mapping[str, Any]) -> dict[str, int]:
    held = request.get("held") or {}
    if not isinstance(held, dict):
        raise InputError("held: found something else; allowed: a mapping of axes to numbers.")
    return held


def _state(request: Mapping[str, Any]) -> Array | None:
    state = request.get("state")
    if state is None:
        return None
    numbers = [*map(_finite, state)] if isinstance(state, list) and len(state) <= 1000 else [None]
    if None in numbers:
        raise InputError("state: found something else; allowed: a list of finite numbers.")
    return np.array(numbers, dtype=float)


def _finite(value: Any) -> float | None:
    """A number as a float; None for what is none, or has no finite float."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    try:
        return float(value) if math.isfinite(value) else None
    except OverflowError:  # a whole number of hundreds of digits
        return None
