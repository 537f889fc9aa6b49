"""The gains of a speed controller from a log of its own speed and torque.

A drive with proportional gain K_p and integral gain K_i that is to turn at the set speed
gives the torque

    T = c - K_p (w - w_set) - K_i integral of (w - w_set) dt

with a constant c in each stretch, the torque of the integral at its beginning. With torque
measured in the string below a machine of inertia J it is T_string = T - J w'. At each
frequency s = i 2 pi f of the swing the ratio of torque to speed is then

    T / w = -(K_p + K_i / s + J s) exp(-s tau + beta s^2)

where tau is the time by which the log has the torque later than the speed, and beta the
square by which either is smoothed. The numbers are fitted to the ratios that a log shows
at its fundamental and its harmonics. Ratios take neither differences nor integrals of
samples, so they are right at any sampling that has the harmonics; noise between the
harmonics does not count; and noise of the speed, which would make the ratios too small, is
taken off. Delay and smoothing are unknowns with a wide prior, so the errors contain what
they may do to the gains.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from nsdrill.data import Array
from nsdrill.records import dataclass

LEAST_ROWS = 30  # of a stretch
LEAST_SHARE = 0.9  # of the variance of the torque in the lines, that the law must explain
DETERMINED = 0.25  # the greatest error of a gain, over the gain, that is determined
LEAST_SWING = 1e-3  # of the set speed: a top that swings less says nothing of its gains
LEAST_PERIODS = 5.0  # of the fundamental in a stretch
WINDOW_PERIODS = 12.0  # of the fundamental in a window
HARMONICS = 12  # the spectrum is taken up to this multiple of the fundamental
SAMPLES_OF_LINES = 4.0  # in a period, with which a log has the fundamental and a harmonic
HALF_WIDTH = 3  # bins from the middle of a line of the window sin^4 to its first zero
BANDWIDTH = 1.94  # bins of noise that the window lets through
LEAST_LINE = 1e-4  # power of a line over that of the greatest one; less may be leakage
ABOVE_NOISE = 10.0  # power of a line over that of the noise in its bins
GAP = 2.5  # times the usual step
GAP_PERIODS = 0.15  # of the fundamental; a gap is longer than both
GRID_ERROR = 0.05  # amplitude of the error of a line, over the step to which values are rounded
MODEL_ERROR = 0.01  # relative error of a ratio that no log is without
MOST_MODEL_ERROR = 0.05  # with which gains are told
MISSING = 4.0  # times the power that the speed has at a line, if the law gives the torque
DELAY_PRIOR = 1.0  # [s] standard deviation of tau before the log
SMOOTHING_PRIOR = 0.04  # [s^2] of beta: a mean over 1 s
ALSO_RIGHT = 3.0  # half the rise of chi^2 up to which another minimum may be the right one
SAME = 1e-3  # relative distance up to which two minima are one
MOST_SMOOTHING = 0.06  # [s^2] of beta that is corrected: a mean over 1.2 s
TOLD_DELAY = 3.0  # standard deviations from which a delay is told


class Stretch(NamedTuple):
    """Samples of a stretch of a log at one set speed [rad/s]: times [s], the speed of the
    top [rad/s] and the torque [N m], arrays [rows]; ``set_speed`` may be an array
    too."""

    time: Array
    speed: Array
    torque: Array
    set_speed: float | Array


@dataclass(frozen=True)
class DriveGains:
    """``damping`` K_p [N m s/rad] and ``stiffness`` K_i [N m/rad] with their standard
    ``errors`` (in this order, then that of the inertia), the ``inertia`` [kg m^2] of the
    machine where it was an unknown, else None; the ``delay`` [s] of the torque against the
    speed in the log and its standard error, for which the gains are corrected; the ``share``
    of the variance of the torque at the ``periods`` [s] of the swing that the law explains;
    the ``rows`` that were used, and ``doubts``, in words, why the numbers should not be
    used."""

    damping: float
    stiffness: float
    inertia: float | None
    errors: tuple[float, ...]
    delay: tuple[float, float]
    share: float
    periods: tuple[float, ...]
    rows: int
    doubts: tuple[str, ...]

    @property
    def sure(self) -> bool:
        """Whether nothing speaks against the gains."""
        return not self.doubts

    def study(self) -> str:
        """The section of a study with these gains, YAML; a comment where they should not be
        used."""
        if self.doubts:
            return "# drive: its gains are not determined"
        inertia = "" if self.inertia is None else f", inertia: {self.inertia:.4g} kg*m^2"
        return (
            f"drive: {{kind: pi, damping: {self.damping:.4g} N*m*s/rad, stiffness: {self.stiffness:.4g} N*m/rad"
            f"{inertia}}}"
        )

    def sentences(self) -> list[str]:
        """What was found, in words; without numbers where they should not be used."""
        if self.doubts:
            return [f"Gains of the drive from {self.rows} rows are not determined: {doubt}." for doubt in self.doubts]
        gains = [("K_p", self.damping, "N m s/rad"), ("K_i", self.stiffness, "N m/rad")]
        if self.inertia is not None:
            gains.append(("inertia", self.inertia, "kg m^2"))
        told = [
            f"{name} {float(f'{value:.4g}'):g} +- {float(f'{error:.2g}'):g} {unit}"
            for (name, value, unit), error in zip(gains, self.errors, strict=True)
        ]
        periods = ", ".join(f"{one:.3g}" for one in self.periods)
        found = f"Gains of the drive from {self.rows} rows: {', '.join(told)}; the law explains "
        found += f"{100 * self.share:.0f} % of the variance of the torque at periods of {periods} s."
        return [found, *self._of_the_delay()]

    def _of_the_delay(self) -> list[str]:
        delay, error = self.delay
        if abs(delay) < TOLD_DELAY * error:
            return []
        late, other = ("torque", "speed") if delay > 0 else ("speed", "torque")
        return [
            f"The log has the {late} {abs(delay):.2g} +- {error:.1g} s later than the {other}; the gains are "
            "corrected for it."
        ]


class _Part(NamedTuple):
    """Rows of a stretch without a gap: times, speed less set speed and torque, both less
    their trends, arrays [rows]; the steps to which both are rounded (0 where they are not
    seen to be)."""

    time: Array
    speed: Array
    torque: Array
    grids: tuple[float, float]

    @property
    def span(self) -> float:
        """Its length [s]."""
        return float(self.time[-1] - self.time[0])


class _Spectra(NamedTuple):
    """Amplitudes of the speed, arrays [3, windows, bins], and of the torque, [windows, bins],
    at ``frequency`` [rad/s], and the greatest steps to which both are rounded. The speed has
    those with the window g, with -g' and with g''."""

    frequency: Array
    speed: Array
    torque: Array
    grids: tuple[float, float]


class _Lines(NamedTuple):
    """Ratios of torque to speed [N m s/rad] at ``frequency`` [rad/s], their relative
    standard errors by noise, rounding and sampling, and the power of the torque with that
    part of it which is coherent with the speed, arrays [lines]."""

    frequency: Array
    ratio: Array
    errors: Array
    power: Array
    coherent: Array


class _Fit(NamedTuple):
    """K_p, K_i, with inertia J, then tau and beta, with their covariance; the relative
    deviations of the ratios from the law [lines], complex, and the relative error of the
    law that accounts for them."""

    numbers: Array
    covariance: Array
    left: Array
    model: float


def gains_of_drive(stretches: Sequence[Stretch], *, inertia: bool = False) -> DriveGains:
    """The gains from stretches of a log. ``inertia``: the torque is that in the string, so
    the inertia of the machine is found as well.

    ValueError where no stretch has :data:`LEAST_ROWS` rows of numbers.
    """
    known = [one for stretch in stretches if len((one := _known(stretch)).time) >= LEAST_ROWS]
    if not known:
        raise ValueError(f"found no stretch with {LEAST_ROWS} rows of numbers; allowed: at least one")
    rows = sum(len(one.time) for one in known)
    swing = max(_swing(one) for one in known)
    if swing < LEAST_SWING:
        return _none(
            inertia,
            rows,
            f"the top swings by {100 * swing:.2g} % of the set speed only, as under a very stiff drive, and its gains "
            "do not show; take stretches with stick-slip",
        )
    period = _fundamental(max(known, key=lambda one: float(one.time[-1] - one.time[0])))
    parts = [part for one in known for part in _parts(one, period)]
    if not parts:
        slow = f"the speed swings once in {period:.3g} s, and no stretch without a gap has {LEAST_PERIODS:g} periods"
        return _none(inertia, rows, slow)
    spectra = _spectra(parts, period)
    lines = _lines(spectra, None, inertia)
    if not len(lines.frequency) or not any(np.ptp(one.torque) for one in known):
        alone = "the torque does not follow from the speed: no period rises above the noise of both"
        return _none(inertia, rows, alone)
    if len(lines.frequency) == 1:
        return _none(inertia, rows, _of_one_line(lines, inertia))
    lines = _lines(spectra, _fitted(lines, inertia).numbers, inertia)
    fit = _fitted(lines, inertia)
    missing = _missing(spectra, np.abs(_law(fit.numbers, spectra.frequency, inertia)))
    return _found(lines, fit, inertia, sum(len(part.time) for part in parts), missing)


def _none(inertia: bool, rows: int, doubt: str) -> DriveGains:
    nan = math.nan
    return DriveGains(nan, nan, nan if inertia else None, (nan,) * (2 + inertia), (nan, nan), 0.0, (), rows, (doubt,))


def _found(lines: _Lines, fit: _Fit, inertia: bool, rows: int, missing: Sequence[float]) -> DriveGains:
    errors = np.sqrt(np.diag(fit.covariance)).tolist()
    missed = float(np.sum(lines.coherent * np.abs(fit.left) ** 2))
    share = max(0.0, (float(np.sum(lines.coherent)) - missed) / float(np.sum(lines.power)))
    size = 2 + inertia
    values = fit.numbers.tolist()
    return DriveGains(
        values[0],
        values[1],
        values[2] if inertia else None,
        tuple(errors[:size]),
        (values[size], errors[size]),
        share,
        tuple((2.0 * math.pi / np.sort(lines.frequency)).tolist()),
        rows,
        tuple(_doubts(lines, values[:size], errors[:size], share) or _of_the_log(fit, errors[size], missing)),
    )


def _known(stretch: Stretch) -> Stretch:
    """The rows of a stretch in which all is a number and time goes on."""
    time = np.asarray(stretch.time, dtype=float)
    columns = [np.broadcast_to(np.asarray(values, dtype=float), time.shape) for values in stretch]
    known = np.flatnonzero(np.isfinite(columns).all(axis=0))
    known = known[np.diff(np.maximum.accumulate(time[known]), prepend=-np.inf) > 0.0]
    return Stretch(*(values[known] for values in columns))


def _swing(known: Stretch) -> float:
    """The standard deviation of the speed over the set speed."""
    error = _level(known.time, known.speed - known.set_speed)
    return float(np.std(error) / max(float(np.abs(known.set_speed).max()), 1e-9))


def _parts(known: Stretch, period: float) -> Iterator[_Part]:
    """The parts of a stretch without gaps that are long enough. The trend of both signals is
    what an offset of the set speed and a drift of the string add."""
    grids = (_grid(known.speed), _grid(known.torque))
    steps = np.diff(known.time)
    gaps = np.flatnonzero(steps > max(GAP * float(np.median(steps)), GAP_PERIODS * period)) + 1
    error = known.speed - known.set_speed
    for rows in np.split(np.arange(len(known.time)), gaps):
        time = known.time[rows]
        if len(rows) >= LEAST_ROWS and time[-1] - time[0] >= LEAST_PERIODS * period:
            yield _Part(time, _level(time, error[rows]), _level(time, known.torque[rows]), grids)


def _level(time: Array, values: Array) -> Array:
    trend = np.stack([np.ones_like(time), time - time[0]], axis=1)
    return values - trend @ np.linalg.lstsq(trend, values, rcond=None)[0]


def _grid(values: Array) -> float:
    """The step to which values are rounded: the least between two of them, where most
    values occur more than once."""
    steps = np.diff(np.unique(values))
    steps = steps[steps > 1e-9 * float(np.abs(values).max())]
    return float(steps.min()) if 0 < len(steps) < len(values) / 2 else 0.0


def _fundamental(known: Stretch) -> float:
    """The period [s] at which the speed swings most."""
    even = np.linspace(known.time[0], known.time[-1], len(known.time))
    error = _level(known.time, known.speed - known.set_speed)
    power = np.abs(np.fft.rfft(np.hanning(len(even)) * np.interp(even, known.time, error))) ** 2
    return float((even[-1] - even[0]) / (int(np.argmax(power[2:])) + 2))


def _spectra(parts: Sequence[_Part], period: float) -> _Spectra:
    """The spectra of windows that overlap by a half."""
    length = min(WINDOW_PERIODS * period, *(one.span for one in parts))
    step = max(one.span / (len(one.time) - 1) for one in parts)
    bins = np.arange(HALF_WIDTH, int(min(HARMONICS * length / period, 0.5 * length / step)))
    frequency = 2.0 * np.pi * bins / length
    pairs = [pair for one in parts for pair in _windows(one, length, frequency)]
    speed, torque = np.stack([one[0] for one in pairs], axis=1), np.stack([one[1] for one in pairs])
    grids = (max(one.grids[0] for one in parts), max(one.grids[1] for one in parts))
    return _Spectra(frequency, speed, torque, grids)


def _windows(part: _Part, length: float, frequency: Array) -> Iterator[tuple[Array, Array]]:
    """Amplitudes of speed and torque at the frequencies, of each window of a part."""
    count = max(1, int(2.0 * part.span / length + 1e-6) - 1)
    widths = np.gradient(part.time)
    for start in part.time[0] + np.linspace(0.0, part.span - length, count):
        inside = (part.time >= start) & (part.time <= start + length)
        time = part.time[inside] - start
        rate, turn = np.pi / length, np.pi * time / length
        sine, cosine = np.sin(turn), np.cos(turn)
        slope, bend = 4.0 * rate * sine**3 * cosine, 4.0 * rate**2 * sine**2 * (3.0 * cosine**2 - sine**2)
        windows = np.stack([sine**4, -slope, bend]) * widths[inside]
        windows *= 2.0 / windows[0].sum()
        waves = np.exp(-1j * np.outer(frequency, time))
        speeds = (windows * part.speed[inside]) @ waves.T
        yield speeds, waves @ (windows[0] * part.torque[inside])


def _lines(spectra: _Spectra, numbers: Array | None, inertia: bool) -> _Lines:
    """The lines with the ratio of torque to speed, as a multiple of a law where ``numbers``
    of one are known."""
    asked = spectra.speed[0] if numbers is None else _answer(spectra, numbers, inertia)
    gain = np.ones_like(spectra.frequency) if numbers is None else np.abs(_law(numbers, spectra.frequency, inertia))
    powers = [np.mean(np.abs(one) ** 2, axis=0) for one in (spectra.speed[0], spectra.torque)]
    floors = [_floor(one) for one in powers]
    wrong = [_wrong(power, floor, grid) for power, floor, grid in zip(powers, floors, spectra.grids, strict=True)]
    expected = np.mean(np.abs(asked) ** 2, axis=0)
    cross = np.mean(spectra.torque * np.conj(asked), axis=0)
    windows = 1.0 + 0.9 * (len(asked) - 1)  # that overlap, as independent ones
    found = []
    for line in _places(powers, floors):
        speed, pull, whole = (float(one[line].sum()) for one in (*powers, expected))
        noise = min(floors[0] * float(np.sum(gain[line] ** 2)) / whole, 0.9)
        both = complex(cross[line].sum())
        alike = min(abs(both) ** 2 / (whole * pull), 1.0)
        count = max(windows * len(cross[line]) / BANDWIDTH, 1.5)
        error = (1.0 - alike) / max(alike, 1e-3) / (count - 1.0)  # of averages of independent values
        error += (0.5 * noise) ** 2 + BANDWIDTH * (wrong[0] / speed + wrong[1] / pull)
        middle = float(spectra.frequency[line] @ powers[0][line]) / speed
        ratio = both / (whole * (1.0 - noise))
        if numbers is not None:
            ratio *= complex(_law(numbers, np.array(middle), inertia))
        found.append((middle, ratio, math.sqrt(error), pull, min(alike / (1.0 - noise), 1.0) * pull))
    return _Lines(*(np.array(column) for column in zip(*found, strict=True))) if found else _Lines(*[np.zeros(0)] * 5)


def _answer(spectra: _Spectra, numbers: Array, inertia: bool) -> Array:
    """The torque in the windows, arrays [windows, bins], that a law gives to the speed: as a
    window is narrow, from the Taylor series of the law in frequency."""
    step = 1e-3 * float(spectra.frequency[0])
    low, here, high = (_law(numbers, spectra.frequency + change, inertia) for change in (-step, 0.0, step))
    first, second = (high - low) / (2j * step), -(high - 2.0 * here + low) / step**2
    answer: Array = here * spectra.speed[0] + first * spectra.speed[1] + 0.5 * second * spectra.speed[2]
    return answer


def _floor(power: Array) -> float:
    """The mean power of white noise in a bin, of which a quarter of the bins is below
    ln(4/3) of it where noise is Gaussian."""
    return float(np.quantile(power, 0.25)) / math.log(4.0 / 3.0)


def _wrong(power: Array, floor: float, grid: float) -> float:
    """The power that a line has in error, and has alike in all windows: of rounding, and of
    what is above half the sampling frequency and comes back from there."""
    folded = float(np.mean(power[-max(len(power) // 8, 1) :])) - floor
    return (GRID_ERROR * grid) ** 2 + max(folded, 0.0)


def _places(powers: Sequence[Array], floors: Sequence[float]) -> list[slice]:
    """The lines, the greatest first: speed and torque are above their noise, and the foot
    of another line is none."""
    left = powers[0].copy()
    found: list[slice] = []
    least = LEAST_LINE * float(left.max())
    while left.max() > least:
        top = int(np.argmax(left))
        line = slice(max(top - HALF_WIDTH + 1, 0), top + HALF_WIDTH)
        clear = all(np.mean(one[line]) > ABOVE_NOISE * floor for one, floor in zip(powers, floors, strict=True))
        if clear and powers[0][top] == powers[0][line].max():
            found.append(line)
        left[max(top - 2 * HALF_WIDTH, 0) : top + 2 * HALF_WIDTH + 1] = 0.0
    return found


def _missing(spectra: _Spectra, gain: Array) -> list[float]:
    """The periods [s] of harmonics of the torque at which the speed has much less than a law
    of this gain [bins] needs, though its noise would let it be seen. What is slower than the
    swing may be a drift of the torque."""
    speed, torque = (np.mean(np.abs(one) ** 2, axis=0) for one in (spectra.speed[0], spectra.torque))
    floor = _floor(speed) + (GRID_ERROR * spectra.grids[0]) ** 2
    found = []
    for line in _places((torque, speed), (_floor(torque), 0.0)):
        needed = float(np.sum(torque[line] / gain[line] ** 2))
        harmonic = line.start > int(np.argmax(speed))
        if harmonic and needed > MISSING * float(speed[line].sum()) + ABOVE_NOISE * floor * len(speed[line]):
            found.append(float(2.0 * np.pi / spectra.frequency[line][np.argmax(torque[line])]))
    return sorted(found)


def _law(numbers: Array, frequency: Array, inertia: bool) -> Array:
    s = 1j * frequency
    gains = numbers[0] + numbers[1] / s + (numbers[2] * s if inertia else 0.0)
    return -gains * np.exp(-s * numbers[-2] + numbers[-1] * s * s)


def _fitted(lines: _Lines, inertia: bool) -> _Fit:
    """The numbers that agree best with the ratios, where the law has the error that accounts
    for what is left."""
    starts = _starts(lines, inertia)
    fit = _fit(lines, inertia, MODEL_ERROR, starts)
    free = max(len(lines.frequency) - 1 - 0.5 * inertia, 0.5)
    for _ in range(3):
        extra = float(np.sum(np.abs(fit.left) ** 2 - lines.errors**2)) / free
        fit = _fit(lines, inertia, math.sqrt(max(MODEL_ERROR**2, extra)), starts)
    return fit


def _starts(lines: _Lines, inertia: bool) -> list[Array]:
    """Numbers that agree with the ratios at several delays. A greater delay than a quarter
    of a period would change the sign of K_p."""
    s = 1j * lines.frequency
    columns = [np.ones_like(s), 1.0 / s, s][: 2 + inertia]
    starts = []
    for delay in np.linspace(-1.0, 1.0, 9) * min(0.4 * math.pi / float(lines.frequency.min()), 2.5 * DELAY_PRIOR):
        rows = np.stack([-one * np.exp(-s * delay) / lines.ratio for one in columns], axis=1)
        size = np.linalg.norm(rows, axis=0)
        right = np.repeat([1.0, 0.0], len(s))
        gains = np.linalg.lstsq(np.concatenate([rows.real, rows.imag]) / size, right, rcond=1e-12)[0] / size
        starts.append(np.concatenate([gains, [delay, 0.0]]))
    return starts


def _fit(lines: _Lines, inertia: bool, model: float, starts: Sequence[Array]) -> _Fit:
    """The fit where the law has the relative error ``model``. Several laws may agree with
    few ratios: one whose gains are not negative comes first, and what others of these say
    is in the covariance by their likelihood."""
    # the errors of a ratio are shared by its real and its imaginary part
    sigma = np.sqrt((lines.errors**2 + model**2) / 2.0)
    frequency = lines.frequency
    middle, size = float(np.median(frequency)), float(np.abs(lines.ratio).max())
    scale = np.array([*[size, size * middle, size / middle][: 2 + inertia], 1.0, 1.0])
    priors = np.zeros((2, len(scale)))
    priors[0, -2], priors[1, -1] = 1.0 / DELAY_PRIOR, 1.0 / SMOOTHING_PRIOR

    def off(numbers: Array) -> Array:
        left = (_law(numbers * scale, frequency, inertia) / lines.ratio - 1.0) / sigma
        return np.concatenate([left.real, left.imag, priors @ numbers])

    def slopes(numbers: Array) -> Array:
        rows = _slopes(numbers * scale, frequency, inertia) / (lines.ratio * sigma)[:, None] * scale
        return np.concatenate([rows.real, rows.imag, priors])

    found = [least_squares(off, start / scale, slopes, method="lm") for start in starts]
    least = min(one.cost for one in found)
    usable = [one for one in found if (one.x[: 2 + inertia] >= 0.0).all() and one.cost < least + ALSO_RIGHT]
    best = min(usable or found, key=lambda one: float(one.cost))
    covariance = np.linalg.pinv(best.jac.T @ best.jac, rcond=1e-14)
    covariance = covariance + _spread(best.x, [(one.x, math.exp(best.cost - one.cost)) for one in usable])
    numbers = best.x * scale
    left = _law(numbers, frequency, inertia) / lines.ratio - 1.0
    return _Fit(numbers, covariance * np.outer(scale, scale), left, model)


def _slopes(numbers: Array, frequency: Array, inertia: bool) -> Array:
    """The derivatives of the law with respect to its numbers [frequencies, numbers]."""
    s = 1j * frequency
    law, unit = _law(numbers, frequency, inertia), -np.exp(-s * numbers[-2] + numbers[-1] * s * s)
    return np.stack([*[unit, unit / s, unit * s][: 2 + inertia], -s * law, s * s * law], axis=1)


def _spread(best: Array, others: Sequence[tuple[Array, float]]) -> Array:
    """The covariance about the best numbers of others with their likelihood over it, of
    which those that are found again count once."""
    apart: list[tuple[Array, float]] = [(best, 1.0)]
    for numbers, weight in others:
        if all(float(np.abs(numbers - known).max()) > SAME for known, _ in apart):
            apart.append((numbers, weight))
    whole = sum(weight for _, weight in apart)
    spread: Array = np.sum([weight / whole * np.outer(one - best, one - best) for one, weight in apart], axis=0)
    return spread


def _of_the_log(fit: _Fit, error: float, missing: Sequence[float]) -> list[str]:
    """Why the log is not one of the law with a little delay and smoothing, whose standard
    error of delay is ``error``."""
    delay, smoothing = fit.numbers[-2:].tolist()
    if missing:
        listed = ", ".join(f"{one:.3g} s" for one in missing)
        return [f"the torque swings at periods of {listed}, and the speed less than the law needs: it seems smoothed"]
    if fit.model > MOST_MODEL_ERROR:
        return [
            f"the ratios of torque to speed are off the law by {100 * fit.model:.2g} %, more than "
            f"{100 * MOST_MODEL_ERROR:g} %: one of both seems to be filtered, or the drive has another law"
        ]
    if abs(delay) > 2.0 * DELAY_PRIOR + error:
        late, other = ("torque", "speed") if delay > 0 else ("speed", "torque")
        return [f"the {late} seems to be {abs(delay):.2g} s later than the {other}, more than can be corrected"]
    if abs(smoothing) > MOST_SMOOTHING:
        smooth, other = ("torque", "speed") if smoothing > 0 else ("speed", "torque")
        mean = math.sqrt(24.0 * abs(smoothing))  # exp(beta s^2) is nearly the mean over this time
        return [
            f"the {smooth} seems to be smoothed over {mean:.2g} s or more and the {other} not, which can be corrected "
            f"up to {math.sqrt(24.0 * MOST_SMOOTHING):.2g} s"
        ]
    return []


def _doubts(lines: _Lines, values: Sequence[float], errors: Sequence[float], share: float) -> list[str]:
    """Why the numbers should not be used."""
    if share < LEAST_SHARE:
        return [
            f"the law explains {100 * share:.0f} % of the variance of the torque, less than {100 * LEAST_SHARE:g} %: "
            "the torque does not follow from the speed of the top; it may be of another place, limited or noisy, or "
            "the drive damps by another law"
        ]
    names = ("K_p", "K_i", "inertia")
    doubts = [
        f"{name} is negative, {value:.3g}: the torque is of the other sign, or the law is another one"
        for name, value, error in zip(names, values, errors, strict=False)
        if value < -2.0 * error
    ]
    if doubts:
        return doubts
    vague = [
        f"{name} {value:.3g} +- {error:.2g}"
        for name, value, error in zip(names, values, errors, strict=False)
        if not error <= DETERMINED * abs(value)
    ]
    if not vague:
        return []
    periods = 2.0 * math.pi / lines.frequency
    listed = ", ".join(f"{one:.3g} s" for one in np.sort(periods))
    return [
        f"{', '.join(vague)}, from the ratios of torque to speed at periods of {listed}; longer stretches, faster "
        "samples or less noise determine more"
    ]


def _of_one_line(lines: _Lines, inertia: bool) -> str:
    """What the ratio at a single period says."""
    frequency, ratio = float(lines.frequency[0]), complex(lines.ratio[0])
    both = "K_i/w - J w" if inertia else "K_i/w"
    return (
        f"speed and torque swing at a single period, {2.0 * math.pi / frequency:.3g} s (w = {frequency:.3g} rad/s), "
        f"which gives two numbers, fewer than the unknowns {'K_p, K_i, inertia' if inertia else 'K_p, K_i'} and a "
        f"delay: without a delay K_p {-ratio.real:.4g} and {both} {ratio.imag:.4g} N m s/rad; stretches with "
        "stick-slip have harmonics, which give more"
    )
