"""The runs of a fit, round after round, kept beside its output until that is written.

A fit is a fixed sequence of calls of the model: which samples a round has follows from
the seed and from the rounds before it. So what is kept are the samples and answers of
every call, and a fit that goes on makes the same calls again and takes the first
answers from the file. Its bits are those of a fit that was not interrupted.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from nsdrill import interrupt
from nsdrill.analysis.fitting import Array, Measured, Simulate
from nsdrill.app import unfinished
from nsdrill.errors import FileError
from nsdrill.study.study import Study
from nsdrill.variables import MODEL

WHAT = "fit"


@dataclass
class Rounds:
    """The calls of the model so far, samples [n, unknowns] and answers [n, values], of
    which the first ``known`` were there before. Without ``part`` nothing is kept in a
    file."""

    part: Path | None = None
    digest: str = ""
    model: str = MODEL
    points: int = 1
    calls: list[tuple[Array, Array]] = field(default_factory=list)
    known: int = 0
    _made: int = 0

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
        """Those of the fit that writes ``path``; with ``resume`` with the calls that
        were kept. FileError where ``path`` may not be written, or where what is kept is
        of another fit."""
        part, there = unfinished.claim_part(path, WHAT, overwrite=overwrite, resume=resume)
        found = cls(part, _digest(study, measured, batch), study.model, measured.points)
        if there:
            inputs = "another study, from other data or with another --batch"
            count, arrays = unfinished.read_part(part, WHAT, found.digest, inputs)
            found.calls = [(arrays[f"samples_{i}"], arrays[f"answers_{i}"]) for i in range(count)]
            found.known = count
        elif overwrite:
            unfinished.discard(part)
        return found

    @property
    def runs(self) -> int:
        """How many runs are kept."""
        return self.points * sum(len(samples) for samples, _ in self.calls)

    def of(self, simulate: Simulate) -> Simulate:
        """The model with its answers kept."""

        def remembered(z: Array) -> Array:
            place, self._made = self._made, self._made + 1
            if place < len(self.calls):
                samples, answers = self.calls[place]
                if not np.array_equal(samples, z):
                    raise FileError(
                        f"{self.part}: its samples are not those that these versions of NumPy and "
                        f"SciPy draw. Finish "
                        "it with the versions that it was made with, or start anew by --overwrite."
                    )
                return answers
            answers = simulate(z)
            self.calls.append((z, answers))
            self._save()
            return answers

        return remembered

    @contextmanager
    def guarding(self) -> Iterator[None]:
        """Work that an interrupt ends with a KeyboardInterrupt that says what is kept."""
        with interrupt.telling(self.recovery_text):
            try:
                yield
            except KeyboardInterrupt:
                raise KeyboardInterrupt(self.recovery_text()) from None

    def recovery_text(self) -> str:
        """What an interrupt leaves, in a sentence or two."""
        if self.part is None or not self.part.exists():
            return interrupt.NOTHING
        return (
            f"Interrupted: {self.runs} runs are safe in {self.part}. Go on with the same command "
            f"and --resume."
        )

    def discard(self) -> None:
        """The output is written: what was kept is of no use any more."""
        if self.part is not None:
            unfinished.discard(self.part)

    def _save(self) -> None:
        if self.part is None:
            return
        arrays = {f"samples_{i}": samples for i, (samples, _) in enumerate(self.calls)}
        arrays |= {f"answers_{i}": answers for i, (_, answers) in enumerate(self.calls)}
        unfinished.write_part(self.part, WHAT, self.digest, len(self.calls), arrays, self.model)


def _digest(study: Study, measured: Measured, batch: int) -> str:
    """Of all that decides the samples and answers; not of the number of rounds, which
    may grow."""
    digest = hashlib.sha256(f"{study.sha256} {batch}".encode())
    for table in (measured.at, measured.values, measured.errors):
        for name, values in table.items():
            digest.update(name.encode() + np.ascontiguousarray(values, dtype=float).tobytes())
    return digest.hexdigest()
