"""The layout of the observer's data: its rows of the lane buffer, its store, and its
columns of the outbox."""

from __future__ import annotations

import numpy as np

from nsdrill.abi import CACHE_LINE, aligned_zeros
from nsdrill.models.christoforou_yigit.section import REVOLUTION, section_width
from nsdrill.observe.exponent import GROWTH_HEADER

# Quantities at an end of a step that are not states: interference u of bit and rock
# with its first and second derivatives, bit torque and its rate, radius with its rate
# and its inverse.
ENDS = ("u", "du", "ddu", "torque", "dtorque", "radius", "dradius", "per_radius")
# Measured in each half of the observation: extremes, then sums over time, then values
# at the start of the half.
EXTREMES = (
    "z_min",
    "z_max",
    "speed_min",
    "speed_max",
    "twist_min",
    "twist_max",
    "u_max",
    "torque_max",
    "rho_max",
    "drive_min",
    "drive_max",
)
SUMS = (
    "on_rock",
    "unstuck",
    "on_wall",
    "radius_sum",
    "twist_sum",
    "lateral_square",
    "axial_square",
    "half_revolutions",
    "rolled",
    "rotated",
    "on_stabilizer",
    "x_sum",
    "y_sum",
)
ANCHORS = ("twist_start", "angle_start", "lag_start")
HALF = EXTREMES + SUMS + ANCHORS
# The parts of the times above a level that come from steps with a crossing and,
# separately, from grazes; then the same parts of the distance that the collar rolls
# along the wall and of the angle that the string rotates meanwhile.
TIME_PARTS = (
    "rock_crossings",
    "stuck_crossings",
    "wall_crossings",
    "stabilizer_crossings",
    "rock_grazes",
    "wall_grazes",
    "stabilizer_grazes",
)
WALL_PATHS = ("rolled_crossings", "rotated_crossings", "rolled_grazes", "rotated_grazes")
# For each quantity whose peaks must be distinguished from ripples of the error, and
# once for all others, the rows of :mod:`nsdrill.observe.inside`. The prominence per
# unit of value is the same for all.
PEAK_ROWS = ("low", "high", "margin", "top")
PEAK_QUANTITIES = ("z", "speed", "else")
# The rows of the observer. The last ones: prominence per unit of value; a torque that
# the bit torque has certainly reached; the bit angle of the next return to the section;
# a row for values that are not used.
OBSERVED = (
    *(f"{name}_before" for name in ENDS),
    *(f"{name}_now" for name in ENDS),
    *HALF,
    *TIME_PARTS,
    *WALL_PATHS,
    *(f"{name}_{what}" for what in PEAK_QUANTITIES for name in PEAK_ROWS),
    "margin_growth",
    "torque_floor",
    "level",
    "spare",
)
# The prominence, in tolerances, above which a maximum is a peak and not a ripple of the
# error.
PROMINENCE = 10.0
# The columns of a half in the outbox: its measurements, and at its end the twist, the
# whirl angle within its half plane and the lag.
HALF_OUTCOME = (*HALF, "twist_end", "angle_end", "lag_end")

# A list of events (:mod:`.events`): COLUMNS columns of CAPACITY rows, then the number
# of events. Every column begins on a cache line.
COLUMNS = 24
CAPACITY = 2 * CACHE_LINE  # two vector registers, so that their latencies overlap

EVENT_COUNT = COLUMNS * CAPACITY
LIST_LENGTH = EVENT_COUNT + CACHE_LINE

# The store:
#
#   header    numbers of peaks and of returns to the section that are kept; the angle
#             between returns; two numbers for the growth of a deviation; two sets of
#             lanes, a bit for each: those whose bit speed rose in the last step, and
#             those where it had an extremum inside that step
#   lists     extrema, crossings, maxima of the bit torque
#   rings     one for peaks that are not used, then those of the lanes
PEAKS, RETURNS, SPACING = range(GROWTH_HEADER)
WAS_RISING, HAD_SPEED_EXTREMUM = range(GROWTH_HEADER + 2, GROWTH_HEADER + 4)
EXTREMA = CACHE_LINE
CROSSINGS = EXTREMA + LIST_LENGTH
TORQUE_MAXIMA = CROSSINGS + LIST_LENGTH
SPARE = TORQUE_MAXIMA + LIST_LENGTH
RINGS = SPARE + 1 + CAPACITY
# Rings of peaks in each lane: z, bit speed, radius.
RINGS_OF_PEAKS = 3


def outcome_width(peaks: int, returns: int = 0) -> int:
    """The number of columns of the observer's outcome in the outbox: two halves, count
    and ring of the last ``peaks`` of z, bit speed and radius, and those of the last
    ``returns`` to the section."""
    return 2 * len(HALF_OUTCOME) + RINGS_OF_PEAKS * (peaks + 1) + section_width(returns)


def new_store(
    lanes: int, peaks: int, returns: int = 0, spacing: float = REVOLUTION, more: int = 0
) -> np.ndarray:
    """The observer's store: its header, the lists of events, the rings of the peaks of
    each lane, the ring of the section of each lane, and ``more`` numbers for other
    observers. ``spacing`` is the bit angle between returns [rad]."""
    store = aligned_zeros(
        RINGS + lanes * (RINGS_OF_PEAKS * (peaks + 1) + section_width(returns)) + more
    )
    store[PEAKS], store[RETURNS], store[SPACING] = peaks, returns, spacing
    return store
