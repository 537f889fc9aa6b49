"""Runge-Kutta pairs of scripts."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from nsdrill.errors import InputError
from nsdrill.kernel.own_pairs import OwnPair, fault_of, made_of, own_pair, register_pair
from nsdrill.kernel.steppers import STEPPERS
from nsdrill.models.registry import forget_known
from nsdrill.origin import check_new_name, origin_at
from nsdrill.script.signature import NAME_FORM, is_name


def pair(name: str, *, a: Sequence[Sequence[float]], b: Sequence[float], embedded: Sequence[float], order: int) -> None:
    """Make an explicit Runge-Kutta pair known, for ``simulation.pair`` of a study.

    Parameters
    ----------
    name : str
        Its name.
    a : sequence of rows
        The coefficients of stages 2, 3, ..., each row as long as there are stages before.
    b, embedded : sequence of float
        The weights of the formula of this ``order`` (2 to 5), which are the last row of
        ``a`` and 0, so that the last stage is the first of the next step; and those of one
        of an order less, for the error.
    order : int
        The order of ``b``.

    Returns
    -------
    None
        It is known by its name from then on.

    Raises
    ------
    InputError
        Where a condition of the order does not hold to 1e-13, the estimate is more than 10
        times too small, or the name is taken.

    Examples
    --------
    >>> nsdrill.pair(
    ...     "bogacki_shampine",  # Bogacki & Shampine 1989, Appl. Math. Lett. 2:321-325
    ...     a=[[1 / 2], [0, 3 / 4], [2 / 9, 1 / 3, 4 / 9]],
    ...     b=[2 / 9, 1 / 3, 4 / 9, 0],
    ...     embedded=[7 / 24, 1 / 4, 1 / 3, 1 / 8],
    ...     order=3,
    ... )
    >>> study = nsdrill.load_study({"simulation.pair": "bogacki_shampine"})
    """
    origin = origin_at(sys._getframe(1))
    where = f"{origin}: nsdrill.pair({name!r})"
    if not is_name(name) or name in STEPPERS:
        raise InputError(f"{where}: found the name {name!r}; allowed: {NAME_FORM}, and no pair of nsdrill.")
    if isinstance(order, bool) or not isinstance(order, int):
        raise InputError(f"{where}: found order={order!r:.60}; allowed: a whole number.")
    if fault := fault_of(a, b, embedded, order):
        raise InputError(f"{where}: found {fault}.")
    if (before := own_pair(name)) is not None:
        check_new_name("a pair", name, before.origin, origin)
    register_pair(name, OwnPair(made_of(name, a, embedded, order), origin))
    forget_known()
