"""Two Runge-Kutta pairs, and an orbit whose motion is known, on which they are tried."""

import numpy as np

import nsdrill

# Bogacki & Shampine 1989, Appl. Math. Lett. 2:321-325: its last stage is the first of the next step.
nsdrill.pair(
    "bogacki_shampine",
    a=[[1 / 2], [0, 3 / 4], [2 / 9, 1 / 3, 4 / 9]],
    b=[2 / 9, 1 / 3, 4 / 9, 0],
    embedded=[7 / 24, 1 / 4, 1 / 3, 1 / 8],
    order=3,
)

# Cash & Karp 1990, ACM Trans. Math. Softw. 16:201-222. It has no such stage: its weights are a row more.
weights = [37 / 378, 0, 250 / 621, 125 / 594, 0, 512 / 1771]
nsdrill.pair(
    "cash_karp",
    a=[
        [1 / 5],
        [3 / 40, 9 / 40],
        [3 / 10, -9 / 10, 6 / 5],
        [-11 / 54, 5 / 2, -70 / 27, 35 / 27],
        [1631 / 55296, 175 / 512, 575 / 13824, 44275 / 110592, 253 / 4096],
        weights,
    ],
    b=[*weights, 0],
    embedded=[2825 / 27648, 0, 18575 / 48384, 13525 / 55296, 277 / 14336, 1 / 4, 0],
    order=5,
)


@nsdrill.model
def planet(x=0.5, y=0.0, vx=0.0, vy=3.0**0.5, *, pull=1.0):
    """A planet on an ellipse of eccentricity 1/2, which it runs through in 2 pi s"""
    distance = np.sqrt(x**2 + y**2)
    return vx, vy, -pull * x / distance**3, -pull * y / distance**3
