"""The steppers by their names in a study. A new one is a file beside these and a line
here."""

from __future__ import annotations

from typing import Any, Protocol

from nsdrill.abi import Rows
from nsdrill.kernel.additive import AdditivePair
from nsdrill.kernel.dormand_prince import DORMAND_PRINCE
from nsdrill.kernel.explicit import ExplicitPair
from nsdrill.kernel.kennedy_carpenter import KENNEDY_CARPENTER
from nsdrill.kernel.scheme import Scheme
from nsdrill.kernel.tableau import TSITOURAS


class Stepper(Protocol):
    """What the kernel requires of a method.

    Its compiled function ``step(buffer, right_hand_side, observer, store)``

    1. commits the accepted step in the lanes with ``moves`` set;
    2. tries one step in every lane from (``time``, ``start``, ``start_acceleration``);
    3. writes the end of the step to ``stage`` and ``acceleration``, and the
       controller's decision to the rows of ``CONTROL``;
    4. calls the observer;
    5. returns whether some lane needs attention.
    """

    @property
    def name(self) -> str: ...

    @property
    def order(self) -> int: ...

    def rows(self, rows: Rows) -> Rows:
        """The row layout with the stepper's rows added."""
        ...

    def scheme(self, rows: Rows) -> Scheme:
        """The numbers of a step, in a buffer with these rows."""
        ...

    def make(self, lanes: int, rows: Rows) -> Any:
        """The compiled function for a number of lanes and a row layout returned by
        :meth:`rows`."""
        ...


IMPLICIT = "kennedy_carpenter"
"""The name of the stepper for right-hand sides with implicit friction."""

STEPPERS: dict[str, ExplicitPair | AdditivePair] = {
    "tsitouras": ExplicitPair(TSITOURAS),
    "dormand_prince": ExplicitPair(DORMAND_PRINCE),
    IMPLICIT: AdditivePair(KENNEDY_CARPENTER),
}
