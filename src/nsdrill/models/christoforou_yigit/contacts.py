"""The functions of the contacts that a deviation follows, with rock and wall: positive
while the contact is closed."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from nsdrill.abi import RATES
from nsdrill.compiler.functions import BUFFER, compiled
from nsdrill.compiler.words import fma, packed
from nsdrill.models.christoforou_yigit.lobes import multiple_cosine, multiple_sine
from nsdrill.models.christoforou_yigit.options import Options
from nsdrill.models.christoforou_yigit.rhs import AUX, PARAMETERS, SIDES, STATES, rows_of


@lru_cache
def make_contacts(lanes: int, options: Options, place: int) -> Any:
    """The compiled ``contacts(buffer)``, which writes value, slope and second
    derivative of each contact's function at the end of the step to the observer's rows
    from ``place`` on: the interference with the rock, and the squared radius of the
    collar's centre less the squared gap, which is smooth at the hole's centre too."""
    rows = rows_of(options, tangent=True)
    W, lobes = lanes, options.lobes
    x_, vx_, y_, vy_, z_, vz_, _, speed_ = (W * (rows.stage + i) for i in range(len(STATES)))
    ax_, ay_, az_, alpha_ = (W * (rows.acceleration + i) for i in range(4))
    cosine_, sine_ = (W * (rows.aux_now + AUX.index(name)) for name in ("cosine", "sine"))
    s0_, gap_ = (
        W * (rows.parameter + PARAMETERS.index(name)) for name in ("surface_amplitude", "gap")
    )
    u_, du_, ddu_, rho_, drho_, ddrho_ = (
        W * (rows.observer + place + k) for k in range(RATES * len(SIDES))
    )

    @compiled(BUFFER)
    def contacts(b):  # type: ignore[no-untyped-def]
        for i in packed(W):
            x, vx, y, vy, omega, c = (
                b[x_ + i],
                b[vx_ + i],
                b[y_ + i],
                b[vy_ + i],
                b[speed_ + i],
                b[cosine_ + i],
            )
            sine, cosine = multiple_sine(b[sine_ + i], c, lobes), multiple_cosine(c, lobes)
            steepness = b[s0_ + i] * lobes
            b[u_ + i] = fma(b[s0_ + i], sine, -b[z_ + i])
            b[du_ + i] = fma(steepness * omega, cosine, -b[vz_ + i])
            b[ddu_ + i] = fma(
                steepness, fma(b[alpha_ + i], cosine, -(lobes * omega * omega * sine)), -b[az_ + i]
            )
            b[rho_ + i] = fma(x, x, fma(y, y, -(b[gap_ + i] * b[gap_ + i])))
            b[drho_ + i] = 2.0 * fma(x, vx, y * vy)
            b[ddrho_ + i] = 2.0 * fma(vx, vx, fma(vy, vy, fma(x, b[ax_ + i], y * b[ay_ + i])))

    return contacts
