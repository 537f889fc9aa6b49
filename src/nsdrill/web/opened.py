"""The file that an explorer opened: its motions, which run one at a time, and what a page
chose of it.

Nothing of a page is kept between its requests: a page sends the state from which a motion
continues, so that several pages of one session do not disturb each other.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path

from nsdrill import interrupt
from nsdrill.app.datasets import is_branches, is_study, read_any
from nsdrill.app.experiment import Experiment, prepare, stored_experiment
from nsdrill.app.simulating.motions import Motions
from nsdrill.data import Array, Attributes, Results, Trace, json_text
from nsdrill.errors import FileError, InputError, option
from nsdrill.store import kind_of, variables_in
from nsdrill.study import load_study
from nsdrill.study.keys import Leaf
from nsdrill.study.study import Study
from nsdrill.units import QuantityError
from nsdrill.variables import POINT
from nsdrill.web import asked
from nsdrill.web.asked import Request
from nsdrill.web.branch_curves import Branches, read_branches
from nsdrill.web.shown import adjustable

_READ = ("run", "feature", "label", "trust", "peaks", "section", "states")


class Opened:
    """The file ``path``: results, an unfinished run, branches, or a study with
    ``overrides`` applied. Over the diagrams of results lie the branches of the file
    ``over``, if given.

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
        self.results: Results | None = None
        self.experiment: Experiment
        if is_study(path):
            self.experiment = prepare(load_study(Path(path), overrides or []))
        else:
            if overrides:
                raise InputError(
                    f"{option('set')}: found with {self.path}; allowed: with a study, which ends in .yaml or .yml."
                )
            self._open()
        self.units = units or self.study.units
        if over is not None and self.results is None:
            raise InputError(f"{option('over')}: found with {self.path}; allowed: with results of a sweep.")
        if self.branches is not None and self.branches.study.model is not self.study.model:
            raise InputError(
                f"{option('over')}: found branches of the model {self.branches.study.model.name}; "
                f"allowed: of {self.study.model.name}."
            )

    def _open(self) -> None:
        if is_branches(self.path):
            self.branches = read_branches(self.path)
            self.experiment = prepare(self.branches.study)
            return
        self.results = self._read()
        self.experiment = stored_experiment(self.path, self.results)

    def _read(self) -> Results:
        if os.path.lexists(self.path) and kind_of(self.path) == "trace":
            raise FileError(f"{self.path}: found a trace; allowed: results, or a study. Draw it with nsdrill plot.")
        names = None
        if os.path.lexists(self.path):
            names = [v.name for v in variables_in(self.path) if v.origin in _READ or v.dims == POINT]
        results = read_any(self.path, names)
        assert not isinstance(results, Trace)
        return results

    @property
    def study(self) -> Study:
        """The study whose motions are explored."""
        return self.experiment.study

    @property
    def kind(self) -> str:
        """``results``, ``branches`` or ``study``."""
        if self.results is not None:
            return "results"
        return "study" if self.branches is None else "branches"

    @property
    def attrs(self) -> Attributes:
        """The attributes of the file, or those that a study would give it."""
        if (file := self.results or self.branches) is not None:
            return file.attrs
        return {
            "model": self.study.model.name,
            "study_resolved": json_text(self.study.resolved),
            "study_overrides": json_text(list(self.study.overrides)),
        }

    @property
    def title(self) -> str:
        """The title of the study; the name of the file where it has none."""
        return " ".join(self.study.title.split()) or os.path.basename(self.path)

    def sweep(self) -> Results:
        """The results; InputError where there are none."""
        if self.results is None:
            raise InputError("found a study, which has no points; allowed: with results.")
        return self.results

    def place(self, request: Request) -> tuple[int, ...]:
        """The place of a point in the grid of the results, from a request."""
        return asked.place(request, self.sweep().shape)

    def values(self, request: Request) -> dict[str, float]:
        """The values of the axes at the point that the page started from."""
        if self.results is None or request.get("place") is None:
            return self.motions.own
        return self.motions.values(self.place(request))

    def changes(self, request: Request) -> dict[str, str]:
        """The changed keys with their values as a study writes them. In a request,
        numbers are in SI and texts have a unit."""
        wanted = request.get("changes") or {}
        if not isinstance(wanted, dict):
            raise InputError("changes: found something else; allowed: a mapping by keys.")
        texts = {}
        for key, value in wanted.items():
            leaf = self.adjustable.get(key)
            if leaf is None:
                raise InputError(f"{str(key)[:60]}: found an unknown key; allowed: a number or a word of the study.")
            if leaf.kind == "whole" and isinstance(value, float) and value.is_integer():
                value = int(value)
            if isinstance(value, str) and len(value) <= 60 and leaf.kind == "quantity":
                try:
                    texts[key] = leaf.text(leaf.read(value))
                except QuantityError as error:
                    raise InputError(f"{key}: {error}") from None
            elif isinstance(value, str) and len(value) <= 60 and not set(value) & set("{}[]&*!|>%@`#:,\"'\n"):
                texts[key] = value
            elif (number := asked.finite(value)) is not None and leaf.low <= number <= leaf.high:
                texts[key] = leaf.text(value if leaf.kind == "whole" else number)
            else:
                raise InputError(f"{key}: found {str(value)[:60]}; allowed: {leaf.allowed()}.")
        return texts

    def start_state(self, request: Request, study: Study) -> Array | None:
        """The state of the request in the states of the string of ``study``, which may
        differ from those of the page: another drive has others. None where the request
        has no state."""
        state, names = asked.state(request), request.get("states")
        if state is None or names is None:
            return state
        if not isinstance(names, list) or len(names) != len(state) or not all(isinstance(name, str) for name in names):
            raise InputError("states: found something else; allowed: the names of the state.")
        return self.motions.fitted(study, dict(zip(names, state.tolist(), strict=True)))

    # Motions

    @cached_property
    def adjustable(self) -> dict[str, Leaf]:
        """The keys of the study that may change while the string rotates."""
        return adjustable(self.study.keys)

    @cached_property
    def motions(self) -> Motions:
        """The motions of the string; imported at first use, as this loads the
        compiler."""
        return Motions(self.experiment, self.results)

    @contextmanager
    def computing(self) -> Iterator[None]:
        """One run at a time; KeyboardInterrupt where nobody waits for it any more."""
        while not self._compute_lock.acquire(timeout=0.1):
            interrupt.check()
        try:
            interrupt.check()
            yield
        finally:
            self._compute_lock.release()

    def warm(self) -> None:
        """Load or compile the machine code that a first click and slider need, which a
        short run does."""
        study = self.motions.at(self.motions.own)
        with self.computing():
            self.motions.run_from(study, self.motions.start(study), 0.1, asked.SAMPLE)
