"""Where the observer keeps what: its rows of the lane buffer, its store, its columns of
the outbox."""

from __future__ import annotations

import numpy as np

from nsdrill.abi import CACHE_LINE, aligned_zeros
from nsdrill.models.christoforou_yigit.section import REVOLUTION, section_width
from nsdrill.observe.exponent import GROWTH_HEADER

# Quantities at an end of a step that are not states: interference u of bit and rock
# with its rates, bit torque and its rate, radius with its rate and its inverse.
ENDS = ("u", "du", "ddu", "torque", "dtorque", "radius", "dradius", "per_radius")
# Measured in each half. Extremes first, then sums over time, then anchors at the half's
# start.
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
    "half_turns",
    "rolled",
    "turned",
    "on_stabilizer",
    "x_sum",
    "y_sum",
)
ANCHORS = ("twist_start", "angle_start", "lag_start")
HALF = EXTREMES + SUMS + ANCHORS
# Of the times above a level what comes from steps with a crossing and, apart from it,
# from grazes; and the same of what the collar rolls and the string turns at the wall.
PARTS = (
    "rock_crossings",
    "stuck_crossings",
    "wall_crossings",
    "stabilizer_crossings",
    "rock_grazes",
    "wall_grazes",
    "stabilizer_grazes",
)
SLIDES = ("rolled_crossings", "turned_crossings", "rolled_grazes", "turned_grazes")
# Of what may have peaks that are ripples of the error, and once more for all else: the
# least value since the last peak, the greatest since then, if it may become one, and
# how far a peak stands out at a value of zero. How much farther per unit of value is
# the same for all.
PEAK = ("low", "high", "margin")
PEAKING = ("z", "speed", "else")
# After these a torque that the bit torque has certainly reached, the bit angle of the
# next return to the section, and a row that nobody reads.
OBSERVED = (
    *(f"{name}_before" for name in ENDS),
    *(f"{name}_now" for name in ENDS),
    *HALF,
    *PARTS,
    *SLIDES,
    *(f"{name}_{what}" for what in PEAKING for name in PEAK),
    "margin_growth",
    "torque_floor",
    "level",
    "spare",
)
# Tolerances by which a maximum stands out from what is before and after it, to be a
# peak and no ripple of the error.
PROMINENCE = 10.0
# What a half leaves in the outbox: the sums so far, its length and the state of the
# slow angles at its end.
HALF_REPORT = (*HALF, "twist_end", "angle_end", "lag_end")

# A list of events (:mod:`.events`): as many columns of as many rows, then the number of
# events. Every column begins on a cache line.
COLUMNS = 24
SIDE_BY_SIDE = 2 * CACHE_LINE  # two vector registers: one works while the other waits
COUNT = COLUMNS * SIDE_BY_SIDE
LIST = COUNT + CACHE_LINE

# The store begins with the numbers of peaks and of returns to the section that are
# kept, the angle between returns, room for what measures the growth of a deviation (two
# numbers), and, as a bit for every lane, whether the bit speed rose in the last step
# and whether it turned inside it. Then the lists of turns, of crossings and of tops of
# the bit torque, a ring that nobody reads, and the rings of the lanes.
PEAKS, RETURNS, SPACING = range(GROWTH_HEADER)
CLIMBED, SPEED_TURNED = range(GROWTH_HEADER + 2, GROWTH_HEADER + 4)
TURNS = CACHE_LINE
CROSSINGS = TURNS + LIST
TOPS = CROSSINGS + LIST
SPARE = TOPS + LIST
RINGS = SPARE + 1 + SIDE_BY_SIDE
# Rings of peaks in each lane: z, bit speed, radius.
RINGS_OF_PEAKS = 3


def report_width(peaks: int, returns: int = 0) -> int:
    """Columns that the observer fills in the outbox: two halves, count and ring of the
    peaks of z, speed and r, and those of the section."""
    return 2 * len(HALF_REPORT) + RINGS_OF_PEAKS * (peaks + 1) + section_width(returns)


def new_store(
    lanes: int, peaks: int, returns: int = 0, spacing: float = REVOLUTION, more: int = 0
) -> np.ndarray:
    """The observer's store: its header, the lists of events, then for each lane the
    rings of the peaks, then for each that of the section, then room for ``more``
    numbers of other observers."""
    store = aligned_zeros(
        RINGS + lanes * (RINGS_OF_PEAKS * (peaks + 1) + section_width(returns)) + more
    )
    store[PEAKS], store[RETURNS], store[SPACING] = peaks, returns, spacing
    return store
