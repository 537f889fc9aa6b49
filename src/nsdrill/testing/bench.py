"""A model as it is checked: with no number at its default, at states of a motion and
around it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from typing import Any, TypeVar

import numpy as np

from nsdrill import api
from nsdrill.app.conversion import study_in
from nsdrill.app.running.run import run_in_memory
from nsdrill.app.simulating.integration import points_of
from nsdrill.data import Array
from nsdrill.equations.graph import Graph, Node
from nsdrill.equations.motion import Motion
from nsdrill.equations.trace import traced
from nsdrill.errors import InputError, StudyError
from nsdrill.models.base import Model
from nsdrill.models.operation import Values
from nsdrill.models.registry import BY_NAME, model_named
from nsdrill.models.tree import with_values
from nsdrill.models.variant import Variant, variant_at
from nsdrill.records import dataclass
from nsdrill.script.declared_model import Declared
from nsdrill.store.dataset import to_dataset
from nsdrill.study.load import parse_study
from nsdrill.study.study import Study
from nsdrill.testing.check_report import Report
from nsdrill.variables import has_failed

SOURCE = "the study of the check"
PERIODS = 60.0  # of the trace from which states are taken
NEAR, FAR = 0.01, 10.0  # natural scales by which half of the states each are moved away from it


@dataclass(frozen=True)
class Bench:
    """The model of a ``study`` whose numbers are off their defaults; ``rng`` draws
    ``count`` states."""

    study: Study
    rng: np.random.Generator
    count: int

    @property
    def name(self) -> str:
        return self.study.model.name

    @property
    def model(self) -> Model[Any]:
        return model_named(self.study.model.name)

    @cached_property
    def points(self) -> Values[Any]:
        return points_of(self.study, self.study.operation)

    @cached_property
    def variant(self) -> Variant:
        return variant_at(self.model, self.study.parameters)

    @property
    def motion(self) -> Motion:
        return self.variant.motion

    @cached_property
    def traced(self) -> tuple[Graph, dict[str, Node], dict[str, Node]]:
        motion = self.motion
        return traced(motion.equations, motion.states, motion.parameters, motion.options)

    @property
    def slopes(self) -> dict[str, Node]:
        return self.traced[1]

    @cached_property
    def table(self) -> Array:
        return self.model.pack(self.points, self.study.thresholds)

    @cached_property
    def columns(self) -> dict[str, float]:
        """The lane parameters."""
        return {name: float(value[0]) for name, value in self.variant.by_name(self.table).items()}

    @cached_property
    def scales(self) -> dict[str, float]:
        """The natural scale of each state."""
        return dict(zip(self.motion.states, self.variant.state_scales(self.table)[0].tolist(), strict=True))

    @cached_property
    def period(self) -> float:
        """About a period of the fastest motion [s]."""
        table = self.variant.by_name(self.table)
        fastest = float(np.ravel(self.model.fastest(table, self.variant.options))[0])
        return 2.0 * math.pi / max(fastest, 1e-3)

    @cached_property
    def turn(self) -> float:
        """A revolution of the phase [s]."""
        rate = abs(float(self.variant.phase_rate(self.table)[0]))
        return 2.0 * math.pi / rate if rate else self.period

    @cached_property
    def inputs(self) -> dict[str, Any]:
        """The inputs of the graph at states of a motion, and around it."""
        start = self.model.starts(self.points, 0)[0]
        names = self.motion.states
        states = {name: np.full(self.count, start[k]) for k, name in enumerate(names)}
        phase = self.rng.uniform(0.0, 2.0 * math.pi, self.count)
        trace = self.simulate(PERIODS * min(self.period, self.turn))
        at = self.rng.integers(0, trace.sizes["time"], self.count)
        states |= {name: trace[name].values[at] for name in names if name in trace}
        reach = np.where(np.arange(self.count) % 2, FAR, NEAR)
        for name in names:
            states[name] = states[name] + self.scales[name] * reach * self.rng.uniform(-1.0, 1.0, self.count)
        given: dict[str, Any] = {f"s.{name}": value for name, value in states.items()}
        given |= {f"p.{name}": value for name, value in self.columns.items()}
        return given | {"time": self.rng.uniform(0.0, self.period, self.count), "phase": phase}

    def simulate(self, duration: float, **settings: Any) -> Any:
        """A trace of this duration [s]."""
        changes = {"simulation.transient": "0 s", "simulation.observe": f"{duration!r} s"}
        keys = {f"simulation.{name}": value for name, value in settings.items() if name != "sample"}
        return api.simulate(self.study, set=changes | keys, sample=settings.get("sample", f"{duration / 2000!r} s"))

    def run(self, duration: float, report: Report, **settings: Any) -> Any:
        """Results of a run that is observed for this duration [s]; one that fails is in the
        report. What a user is told after a run, as of a drive that is still far from its
        speed, is of this short one without transient, and not told."""
        changes = {"simulation.transient": "0 s", "simulation.observe": f"{duration!r} s"}
        keys = {f"simulation.{name}": value for name, value in settings.items()}
        data = to_dataset(run_in_memory(study_in(self.study, changes | keys)))
        if has_failed(status := np.ravel(data["status"].values)).any():
            report.add(f"a run of {duration:.3g} s to its end", math.inf, 0.0, BY_NAME["status"].words(int(status[0])))
        return data

    def columns_with(self, key: str, value: float) -> dict[str, float]:
        """The lane parameters with another value of a number of the study."""
        points = replace(self.points, parameters=with_values(self.study.parameters, {key: value}))
        table = self.model.pack(points, self.study.thresholds)
        return {name: float(one[0]) for name, one in self.variant.by_name(table).items()}

    @cached_property
    def numbers(self) -> dict[str, float]:
        """The numbers of the model that its equations may read, by key."""
        return {key: float(value) for key, value in _numbers(self.study).items()}


def _numbers(study: Study) -> dict[str, float]:
    """The numbers of a study's model, by key, without those that it does not read."""
    sections, found = (*study.model.sections,), {}
    for key, leaf in study.keys.leaves.items():
        if leaf.kind not in ("quantity", "number") or key.partition(".")[0] not in sections:
            continue
        value: Any = study.resolved
        for name in key.split("."):
            value = value.get(name) if isinstance(value, Mapping) else None
        if isinstance(value, float) and key not in study.parameters.unread:
            found[key] = value
    return found


B = TypeVar("B", bound=Bench)


def bench_of(
    kind: type[B], model: Declared | str, text: str, seed: int, count: int, *, words: Mapping[str, str] | None = None
) -> B:
    """The bench of a model, with these ``words`` at keys of its study besides; InputError
    where the study cannot be made."""
    name = getattr(model, "__name__", model)
    rng = np.random.default_rng(seed)
    whole, chosen = f"model: {name}\n{text}", [f"{key}={word}" for key, word in (words or {}).items()]
    study = parse_study(whole, SOURCE, chosen)
    if study.axes and any(len(values) > 1 for values in study.axes.values()):
        raise InputError(f"{SOURCE}: found a sweep of {', '.join(study.axes)}; allowed: one point.")
    moved = {key: _moved(study, key, value, rng) for key, value in _numbers(study).items()}
    while True:
        try:
            changes = [f"{key}={text}" for key, text in moved.items()]
            return kind(parse_study(whole, SOURCE, [*chosen, *changes]), rng, count)
        except StudyError as error:  # numbers that must satisfy something together stay as they are
            wrong = [key for key in moved if any(fault.key == key for fault in error.faults)]
            if not wrong:
                raise
            moved = {key: text for key, text in moved.items() if key not in wrong}


def _moved(study: Study, key: str, value: float, rng: np.random.Generator) -> str:
    """The number off its default, within its range, as a study has it."""
    leaf = study.keys.leaf(key, study.resolved)
    other = value * rng.uniform(0.93, 0.99) if value else min(leaf.high, 1e-3)
    return leaf.text(float(np.clip(other, leaf.low, leaf.high)))
