"""An experiment: a study with what follows from it for every run, its points and chains, the
record of each point and the method that integrates it. Imports no compiler."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

from nsdrill.errors import InputError
from nsdrill.models.kept import Kept
from nsdrill.models.leaves import is_compiled_in, parts_of, states_of_all, values_at
from nsdrill.models.starts import Starts
from nsdrill.study.study import Study
from nsdrill.sweep.method import Chosen
from nsdrill.sweep.plan import Plan


@dataclass(frozen=True)
class Experiment:
    """A ``study`` and its ``plan``: its points and chains, one point for a study without a
    sweep. What follows from these is computed once, when it is first asked for."""

    study: Study
    plan: Plan

    @cached_property
    def parts(self) -> list[tuple[Any, Starts]]:
        """The parameters and the start of each part with compiled code of its own."""
        study = self.study
        return parts_of(study.model, study.parameters, study.initial, study.axes)

    @cached_property
    def chosen(self) -> Chosen:
        """The choice of the method, implicit or explicit, for each point. InputError where
        the model does not support the method of the study."""
        self.check_method()
        study = self.study
        return Chosen(self.plan, study.parameters, study.initial, study.model, study.simulation.method)

    def check_method(self) -> None:
        """InputError where the study requires the implicit integration of friction and its
        model does not support it."""
        study = self.study
        reasons = (study.model.explicit_only(parameters) for parameters, _ in self.parts)
        reason = next((reason for reason in reasons if reason is not None), None)
        if study.simulation.method == "implicit" and reason is not None:
            source = study.source or "the study"
            raise InputError(f"{source}: simulation.method: found implicit; allowed: auto or explicit, as {reason}.")

    @cached_property
    def methods(self) -> tuple[str, ...]:
        """The methods that the points use: explicit, implicit, or both."""
        return self.chosen.words()

    @cached_property
    def kept(self) -> Kept:
        """The contents of the record of each point."""
        study, model = self.study, self.study.model
        options = [word for parameters, _ in self.parts for word in self._options(parameters)]
        derived = [one.only for one in model.derived if one.only]  # optional in files
        return Kept(
            study.record.peaks,
            study.record.poincare,
            study.record.exponent,
            study.initial.starts,
            study.simulation.verify,
            study.more,
            states_of_all([model.states(parameters) for parameters, _ in self.parts]),
            model.name,
            (*dict.fromkeys(options), *dict.fromkeys(derived)),
            study.samples,
            study.unknowns,
            len(self.methods) > 1,
        )

    def _options(self, parameters: Any) -> tuple[str, ...]:
        """The options that add features to the points of a part with these
        ``parameters``."""
        study, unread = self.study, getattr(parameters, "unread", ())
        varied = {
            key: values
            for key, values in study.varied.items()
            if not is_compiled_in(study.model, key) and key not in unread
        }
        return study.model.options(values_at(parameters, study.initial, varied).parameters)


def prepare(study: Study) -> Experiment:
    """The experiment of a study, which everything that runs or explains it takes."""
    return Experiment(study, Plan(study.axes, study.procedure, study.along, study.initial.starts, study.drawn))
