"""The runs of a fit, saved next to its output after every round until the output is
written.

A fit is a fixed sequence of calls of the model: the samples of a round follow from the
seed and from the earlier rounds. So the samples and values of every call are saved. A
resumed fit makes the same calls and takes the first values from the file; its bits are
those of an uninterrupted fit.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, field

import numpy as np

from nsdrill import interrupt
from nsdrill.analysis.fitting import Array, Measured, Simulate
from nsdrill.app.unfinished import Part
from nsdrill.errors import FileError, again, option
from nsdrill.study.study import Study

WHAT = "fit"


@dataclass
class Rounds:
    """The calls of the model so far, samples [n, unknowns] and values [n, values], of
    which the first ``known`` were read from a file. Without ``part`` no file is
    written."""

    part: Part | None = None
    digest: str = ""
    points: int = 1
    calls: list[tuple[Array, Array]] = field(default_factory=list)
    known: int = 0
    _next_call: int = 0

    @classmethod
    def beside(
        cls,
        path: str | os.PathLike[str],
        study: Study,
        measured: Measured,
        batch: int,
        *,
        overwrite: bool = False,
        resume: bool = False,
    ) -> Rounds:
        """The calls of the fit that writes ``path``; with ``resume`` those that were
        saved. FileError where ``path`` may not be written, or where the saved calls
        belong to another fit."""
        part = Part.claim(path, WHAT, study.model.name, overwrite=overwrite, resume=resume)
        rounds = cls(part, _digest(study, measured, batch), measured.points)
        try:
            if part.kept:
                inputs = f"another study, from other data or with another {option('batch')}"
                count, arrays = part.read(rounds.digest, inputs)
                rounds.calls = [(arrays[f"samples_{i}"], arrays[f"answers_{i}"]) for i in range(count)]
                rounds.known = count
        except BaseException:
            part.close()
            raise
        return rounds

    @property
    def runs(self) -> int:
        """The number of saved runs."""
        return self.points * sum(len(samples) for samples, _ in self.calls)

    def recording(self, simulate: Simulate) -> Simulate:
        """The model ``simulate`` with its calls recorded, or answered by recorded
        ones."""

        def recorded(z: Array) -> Array:
            place, self._next_call = self._next_call, self._next_call + 1
            if place < len(self.calls):
                samples, answers = self.calls[place]
                if not np.array_equal(samples, z):
                    assert self.part is not None
                    raise FileError(
                        f"{self.part.path}: its samples are not those that these versions of NumPy and "
                        f"SciPy draw. Finish "
                        f"it with the versions that it was made with, or start anew by {option('overwrite')}."
                    )
                return answers
            answers = simulate(z)
            self.calls.append((z, answers))
            self._save()
            return answers

        return recorded

    @contextmanager
    def guarding(self) -> Iterator[None]:
        """A context in which the text of a KeyboardInterrupt says what is saved, and at
        whose end another process may go on with it."""
        with self.part or nullcontext(), interrupt.with_end_message(self._end_message):
            try:
                yield
            except KeyboardInterrupt:
                raise KeyboardInterrupt(self._end_message()) from None

    def recovery_text(self) -> str:
        """What is saved and how to resume, in a sentence or two."""
        assert self.part is not None
        return f"{self.part.kept} are safe in {self.part.path}. Go on with {again('resume')}."

    def _end_message(self) -> str:
        if self.part is None or not self.part.kept:
            return interrupt.NOTHING
        return f"Interrupted: {self.recovery_text()}"

    def discard(self) -> None:
        """Remove the saved calls, once the output is written."""
        if self.part is not None:
            self.part.discard()

    def _save(self) -> None:
        if self.part is None:
            return
        arrays = {f"samples_{i}": samples for i, (samples, _) in enumerate(self.calls)}
        arrays |= {f"answers_{i}": answers for i, (_, answers) in enumerate(self.calls)}
        self.part.write(self.digest, len(self.calls), arrays, f"{self.runs} runs")


def _digest(study: Study, measured: Measured, batch: int) -> str:
    """Digest of all inputs that decide the samples and values, but not of the number of
    rounds, which may grow."""
    digest = hashlib.sha256(f"{study.sha256} {batch}".encode())
    for table in (measured.at, measured.values, measured.errors):
        for name, values in table.items():
            digest.update(name.encode() + np.ascontiguousarray(values, dtype=float).tobytes())
    return digest.hexdigest()
