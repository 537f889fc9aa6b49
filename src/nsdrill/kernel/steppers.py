"""The steppers by their names in a study. A new one is a file of numbers beside these
and a line here."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

from nsdrill.abi import STEPPER, Rows
from nsdrill.compiler.functions import compiled, define, fma
from nsdrill.kernel.controller import decide
from nsdrill.kernel.kennedy_carpenter import KENNEDY_CARPENTER
from nsdrill.kernel.step import Pair, private_rows, step_text
from nsdrill.kernel.tableau import DORMAND_PRINCE, TSITOURAS


@dataclass(frozen=True)
class Stepper:
    """A method, from the numbers of a pair.

    Its compiled function ``step(buffer, right_hand_side, observer, store)``

    1. commits the accepted step in the lanes with ``moves`` set;
    2. tries one step in every lane from (``time``, ``start``, ``start_acceleration``);
    3. writes the end of the step to ``stage`` and ``acceleration``, and the
       controller's decision to the rows of ``CONTROL``;
    4. calls the observer;
    5. returns whether some lane needs attention.
    """

    tableau: Pair

    @property
    def name(self) -> str:
        return self.tableau.name

    @property
    def order(self) -> int:
        return self.tableau.order

    def rows(self, rows: Rows) -> Rows:
        """The row layout with the stepper's rows added."""
        return replace(rows, private=private_rows(self.tableau, rows))

    def make(self, lanes: int, rows: Rows) -> Any:
        """The compiled function for a number of lanes and a row layout returned by
        :meth:`rows`."""
        return _make(self.tableau, lanes, rows)


@lru_cache
def _make(pair: Pair, lanes: int, rows: Rows) -> Any:
    return compiled(STEPPER)(define("step", step_text(pair, lanes, rows), fma=fma, decide=decide))


IMPLICIT = "kennedy_carpenter"
"""The name of the stepper for right-hand sides with implicit friction."""

STEPPERS = {
    "tsitouras": Stepper(TSITOURAS),
    "dormand_prince": Stepper(DORMAND_PRINCE),
    IMPLICIT: Stepper(KENNEDY_CARPENTER),
}
