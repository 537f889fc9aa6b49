"""Traces with too few samples: what lies between two of them is not in the trace, nor in
what is told and drawn of it."""

from __future__ import annotations

from collections.abc import Sequence

from nsdrill.data import SHORTEST_PERIOD, Array, Attributes
from nsdrill.errors import option

LEAST_SAMPLES = 10  # of a period: with fewer an extreme is off by up to a twentieth of the swing
MOST_STEPS = 10  # from a sample to the next, where no period is known; a period takes 15 and more
COARSE = "COARSE SAMPLES"


def interval_of(time: Array) -> float:
    """The time [s] from a sample to the next; 0 of fewer than two."""
    return float(time[-1] - time[0]) / (len(time) - 1) if len(time) > 1 else 0.0


def coarse_samples(attrs: Attributes, time: Array) -> str:
    """In words, where a trace with these ``attrs`` and sample times has too few samples for
    its motion, by the shortest period that is known of it or else by the steps of its run;
    empty where it has enough."""
    interval = interval_of(time)
    if period := float(attrs.get(SHORTEST_PERIOD, 0.0)):
        if interval <= period / LEAST_SAMPLES:
            return ""
        why, enough = f"the shortest period that is known of the motion is {period:.3g} s", period / LEAST_SAMPLES
    else:
        steps = float(attrs.get("steps", 0)) * interval / (simulated(attrs) or float(time[-1]) or 1.0)
        if not steps > MOST_STEPS:
            return ""
        why, enough = f"the run took {steps:.3g} steps from one to the next", interval * MOST_STEPS / steps
    return (
        f"{COARSE}: {len(time)} samples, one every {interval:.4g} s, and {why}. Between samples it may go further: "
        f"least and greatest values, and lines from sample to sample, are not those of the motion. "
        f"{option('sample', f'{_rounded_down(enough):g}s')} has enough"
    )


def simulated(attrs: Attributes) -> float:
    """The simulated time [s] of a trace; 0 where it is not known."""
    return float(attrs.get("transient", 0.0)) + float(attrs.get("observe", 0.0))


def _rounded_down(value: float) -> float:
    """A number with one digit, at most ``value``."""
    digits: Sequence[float] = [float(f"{k}e{n}") for n in range(-9, 9) for k in (1, 2, 5)]
    return max((one for one in digits if one <= value), default=value)
