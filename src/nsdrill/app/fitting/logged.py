"""What stretches of a log over time say beside means and extremes: the period of the
torsional motion, and the gains of the drive."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from nsdrill.analysis.cycles import SAMPLES, period_of, samples_a_cycle
from nsdrill.analysis.drive_gains import LEAST_ROWS, Stretch, gains_of_drive
from nsdrill.data import Array
from nsdrill.errors import count

PERIOD = "stick_slip_period"
SWINGING = ("bit_speed", "surface_torque")  # signals with the period, the best one first


def of_stretches(
    time: Array, signals: Mapping[str, Array], settings: Mapping[str, Array], kept: Sequence[tuple[int, int]]
) -> tuple[dict[str, Array], list[str]]:
    """(features by name, arrays [stretches]; notes in words) of the stretches ``kept``,
    each from a row to before another one, of a log with these columns in SI by name."""
    features: dict[str, Array] = {}
    notes = []
    if name := next((one for one in SWINGING if one in signals), None):
        periods = np.array([period_of(time[a:b], signals[name][a:b]) for a, b in kept])
        if np.isfinite(periods).any():
            features[PERIOD] = periods
        few = [samples_a_cycle(time[a:b], signals[name][a:b]) for a, b in kept]
        few = [one for one in few if one < SAMPLES]
        if few:
            notes.append(
                f"no {PERIOD} of {count(len(few), 'stretch')} of {len(kept)}: {name} swings once in {min(few):.2g} "
                f"samples, and a period needs {SAMPLES} of them"
            )
    return features, [*notes, *_drive(time, signals, settings, kept)]


def _drive(
    time: Array, signals: Mapping[str, Array], settings: Mapping[str, Array], kept: Sequence[tuple[int, int]]
) -> list[str]:
    """The gains of the drive, where the log has them: from the swing of the top about its
    mean speed in each stretch."""
    speed, torque = signals.get("drive_speed", settings.get("rotary_speed")), signals.get("surface_torque")
    if speed is None or torque is None:
        return []
    parts = [
        Stretch(time[a:b], speed[a:b], torque[a:b], float(speed[a:b].mean())) for a, b in kept if b - a >= LEAST_ROWS
    ]
    if not parts:
        return []
    found = gains_of_drive(parts, inertia=True)
    return [*found.sentences(), f"As a study has them: {found.study()}"] if found.sure else []
