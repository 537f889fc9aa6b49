"""A few motions that many tests look at, and the size of an error."""

import numpy as np
from main_model.cases import table_of
from reference import Case
from strings import MAIN

from nsdrill.models.christoforou_yigit.columns import Options
from nsdrill.models.variant import variant_of

# The bit stays on the rock, the collar off the wall, no slip comes to rest: every
# derivative is smooth.
SMOOTH = Case(
    depth=2000.0,
    wob=60e3,
    speed=3.0,
    eccentricity=0.005,
    bit_smoothing=5.0,
    bit_static=0.02,
    bit_dynamic=0.01,
    zeta=0.1,
    amplitude=3e-4,
)
# The bit leaves the rock: axial contact with a kink every lobe.
BOUNCING = Case(depth=5000.0, wob=6e3, speed=3.0, eccentricity=0.005, bit_smoothing=20.0)
# The collar rolls along the wall and bounces off it.
RUBBING = Case(depth=2000.0, wob=60e3, speed=8.0, bit_smoothing=5.0, wall_smoothing=20.0, wall_stiffness=5e6)


def start_of(case: Case) -> np.ndarray:
    """On the rock, turning with the drive, a little off the middle (theory page) or
    flung at the wall."""
    z = -case.wob / (case.k_a + case.rock_stiffness)
    x, vx = (0.07, 0.5) if case is RUBBING else (1e-3, 0.0)
    return np.array([x, vx, 0.0, 0.0, z, 0.0, 0.0, case.speed, 0.0])


def scaled_error(case: Case, found: np.ndarray, exact: np.ndarray) -> float:
    """The largest error of a state, each in units of its natural scale plus its value:
    the integrator's own measure."""
    return float(
        np.max(np.abs(found - exact) / (variant_of(MAIN, Options()).state_scales(table_of(case))[0] + np.abs(exact)))
    )
