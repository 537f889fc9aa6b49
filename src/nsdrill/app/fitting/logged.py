"""What stretches of a log over time say beside means and extremes: the period of the
torsional motion, and the gains of the drive."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from nsdrill.analysis.cycles import LIKENESS, SAMPLES, SCATTER, SWING, Cycles, cycles_of
from nsdrill.analysis.drive_gains import LEAST_ROWS, LEAST_SWING, SAMPLES_OF_LINES, Stretch, gains_of_drive
from nsdrill.app.fitting.names import PERIOD
from nsdrill.data import Array
from nsdrill.errors import count, option

SWINGING = ("bit_speed", "surface_torque")  # signals with the period, the best one first


def of_stretches(
    time: Array,
    signals: Mapping[str, Array],
    settings: Mapping[str, Array],
    kept: Sequence[tuple[int, int]],
    ignored: Sequence[str] = (),
    shortest: float = 0.0,
) -> tuple[dict[str, Array], list[str]]:
    """(features by name, arrays [stretches]; notes in words) of the stretches ``kept``,
    each from a row to before another one, of a log with these columns in SI by name. What
    is ``ignored`` by its name is no feature. The string swings once in ``shortest`` [s] or
    longer; samples that are further apart than half of that show another period than its own."""
    features: dict[str, Array] = {}
    notes: list[str] = []
    step = float(np.median(np.diff(time))) if len(time) > 1 else 0.0
    name = next((one for one in SWINGING if one in signals), None)
    if PERIOD not in ignored and name is not None and 0.0 < shortest < 2.0 * step:
        notes = [
            f"no {PERIOD}: {name} has a sample every {step:.4g} s, and the torsional period of the study is "
            f"{shortest:.4g} s at the shortest, which samples more than half of it apart show as a longer one; a "
            f"period needs a sample every {shortest / SAMPLES:.2g} s or more often"
        ]
    elif PERIOD not in ignored and name is not None:
        found = [cycles_of(time[a:b], signals[name][a:b]) for a, b in kept]
        periods = np.array([one.period if one.sampled and one.regular and one.large else np.nan for one in found])
        if np.isfinite(periods).any():
            features[PERIOD] = periods
        notes = _of_periods(name, found, periods)
    parts = _of_top(time, signals, settings, kept)
    if parts and 0.0 < shortest < SAMPLES_OF_LINES * step:
        notes.append(
            f"no gains of the drive: the log has a sample every {step:.4g} s, and the torsional period of the study is "
            f"{shortest:.4g} s at the shortest; its harmonic needs a sample every {shortest / SAMPLES_OF_LINES:.2g} s "
            "or more often"
        )
    elif parts:
        gains = gains_of_drive(parts, inertia=True)
        notes += [*gains.sentences(), *([f"As a study has them: {gains.study()}"] if gains.sure else [])]
    return features, notes


def _of_periods(name: str, found: Sequence[Cycles], periods: Array) -> list[str]:
    """The periods with the scatter of their cycles, and why other stretches have none."""
    notes = []
    if with_period := [one for one, period in zip(found, periods, strict=True) if np.isfinite(period)]:
        listed = ", ".join(f"{one.period:.4g} s (cycles scatter by {100 * one.scatter:.2g} %)" for one in with_period)
        notes.append(
            f"{PERIOD} of {count(len(with_period), 'stretch')} of {len(found)}, from {name}: {listed}; "
            f"{option('ignore', PERIOD)} leaves it out"
        )
    counted = [one for one in found if one.counted]
    if few := [one.samples for one in counted if not one.sampled]:
        notes.append(
            f"no {PERIOD} of {count(len(few), 'stretch')} of {len(found)}: {name} swings once in {min(few):.2g} "
            f"samples, and a period needs {SAMPLES} of them"
        )
    sampled = [one for one in counted if one.sampled]
    if noisy := [one for one in sampled if not one.regular]:
        best = max(noisy, key=lambda one: one.likeness)
        notes.append(
            f"no {PERIOD} of {count(len(noisy), 'stretch')} of {len(found)}: {name} does not repeat, as noise does "
            f"not; at best the cycles scatter by {100 * best.scatter:.0f} %, and the correlation after one is "
            f"{best.likeness:.2f} (a period needs at most {100 * SCATTER:g} % and at least {LIKENESS:g})"
        )
    if small := [one for one in sampled if one.regular and not one.large]:
        notes.append(
            f"no {PERIOD} of {count(len(small), 'stretch')} of {len(found)}: {name} swings by at most "
            f"{100 * max(one.swing for one in small):.2g} % about its mean, and a period needs {100 * SWING:g} %"
        )
    return notes


def _of_top(
    time: Array, signals: Mapping[str, Array], settings: Mapping[str, Array], kept: Sequence[tuple[int, int]]
) -> list[Stretch]:
    """The stretches with torque and speed of the top, which has its mean there as set
    speed. A log whose only speed is a set speed that is held says nothing of a drive."""
    speed, torque = signals.get("drive_speed", settings.get("rotary_speed")), signals.get("surface_torque")
    if speed is None or torque is None:
        return []
    parts = [
        Stretch(time[a:b], speed[a:b], torque[a:b], float(speed[a:b].mean())) for a, b in kept if b - a >= LEAST_ROWS
    ]
    held = all(part.speed.std() < LEAST_SWING * abs(part.speed.mean()) for part in parts)
    return [] if held and "drive_speed" not in signals else parts
