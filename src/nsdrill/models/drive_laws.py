"""The controllers of a drive at the top of a string, for every model of the string: the
law of the drive's torque as numbers, one function for each kind; and string and drive
as a linear system x' = A x: what grows, what oscillates, how steep a fall of the bit's
friction steady drilling withstands, and what ``check`` says of these.

With lag = phi_d - Omega t, the angle by which the top is ahead of the set point
(negative: behind), omega_d its speed, psi the angle of the bit and omega its speed, in
the same frame as those of the top, the torque of the motor is

    T_m = -K_i lag - K_p (omega_d - Omega) - G_t (psi - lag) - G_w (omega - Omega)

and J omega_d' = T_m less the torque of the string. The integral of a PI controller's
speed error is -lag, so K_i is its integral gain. With a ``torque_limit`` T_m stays
between 0 and that limit: the motor does not brake. (The controller of **O** has 60 kN
m.) That is the torque of the machine only where J is the machine's own inertia. The
integral winds up at the limit, as in **O**: it is the angle by which the top lags
behind.

Sources: **O** Simulator4nDOF of the Open Source Drilling Community (top-drive
controller and its configuration); **K** Kyllingstad & Nessjoen 2009, SPE/IADC 119660,
as cited there. Equal damping places both modes of drive and string at one frequency
with one damping: J_d J s^4 + ... = J J_d (s^2 + 2 z w s + w^2)^2 without bit damping.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, Literal, NamedTuple

import numpy as np

from nsdrill.data import Array
from nsdrill.errors import Fault, InputError
from nsdrill.models.numbers import DerivedQuantity, DriveCard
from nsdrill.models.operation import Numeric
from nsdrill.models.own_drives import Linear, own_drive
from nsdrill.models.rules import Reads, Rule

STIFF = 50.0  # speed gain of a stiff controller, in pipe impedances (O)
UNLIMITED = 1e30  # N m, in place of a torque limit that is none
DIGITS = 9  # of numbers that come from LAPACK, whose last digits depend on the processor

# The kinds of drive: those of LAWS, an ideal one, and those of each model.
Kind = Literal["ideal", "stiff", "soft_torque", "equal_damping", "z_torque", "lqr", "pi", "dc_motor"]


class Gains(NamedTuple):
    """Numbers, or arrays over operating points: the effective inertia of the drive with
    its controller [kg m^2], then K_i [N m/rad], K_p [N m s/rad], G_t [N m/rad], G_w
    [N m s/rad], c_s [N m s/rad]."""

    inertia: Numeric
    stiffness: Numeric
    damping: Numeric
    twist_gain: Numeric = 0.0
    speed_gain: Numeric = 0.0
    shaft_damping: Numeric = 0.0


# The lane parameters of a law: the reciprocal of its inertia, then the others of Gains.
LAW_LANES = ("per_drive_inertia", "drive_stiffness", "drive_damping", "twist_gain", "speed_gain", "shaft_damping")


class Seen(NamedTuple):
    """The quantities that a controller is tuned to, numbers or arrays over operating
    points: the inertia that rotates with the drive [kg m^2]; the string's lumped
    inertia [kg m^2] and stiffness [N m/rad], both of its first torsional mode; and its
    impedance at the top [N m s/rad]: a drive with this impedance reflects no waves."""

    top: Numeric
    inertia: Numeric
    stiffness: Numeric
    impedance: Numeric


def impedance_of(polar: Numeric, density: Numeric, shear_modulus: Numeric) -> Numeric:
    """The torsional impedance of a pipe, Ip sqrt(rho G) [N m s/rad], from its polar
    moment [m^4]."""
    return polar * np.sqrt(density * shear_modulus)


def motor_torque(
    law: Gains,
    limit: Numeric | None,
    lag: Numeric,
    drive_speed: Numeric,
    twist: Numeric,
    bit_speed: Numeric,
    rotary_speed: Numeric,
) -> Numeric:
    """The torque of the motor [N m] that the controller demands, between 0 and
    ``limit`` [N m] unless that is None."""
    torque = -(
        law.stiffness * lag
        + law.damping * (drive_speed - rotary_speed)
        + law.twist_gain * (twist - lag)
        + law.speed_gain * (bit_speed - rotary_speed)
    )
    return torque if limit is None else np.clip(torque, 0.0, limit)


def columns_of_law(law: Gains, limit: Numeric | None) -> dict[str, Numeric]:
    """The lane parameters of the torque of the motor, of a law and its limit [N m]."""
    return {
        "drive_stiffness": law.stiffness,
        "drive_damping": law.damping,
        "twist_gain": law.twist_gain,
        "speed_gain": law.speed_gain,
        "torque_least": -UNLIMITED if limit is None else 0.0,
        "torque_most": UNLIMITED if limit is None else limit,
    }


class Circuit(NamedTuple):
    """A DC motor as part of the string: its damping K [N m s/rad], the time constant T
    of the circuit [s], the stiffness S of its angle control [N m/rad], and whether it
    has gains on the motion of the bit."""

    damping: float
    time: float
    stiffness: float = 0.0
    of_bit: bool = False

    def impedance(self, frequency: Numeric) -> Wave:
        """(K + S / (i w)) / (1 + i w T) [N m s/rad] at frequencies w [rad/s]."""
        stiffness = self.stiffness / (1j * frequency) if self.stiffness else 0.0
        return (self.damping + stiffness) / (1.0 + 1j * frequency * self.time)


Wave = complex | Array  # of one frequency, or of several


def reflection(law: Gains, pipe: float, frequency: Numeric, motor: Circuit | Linear | None = None) -> Wave | None:
    """The reflection coefficient of the drive, complex, for the velocity of a torsional
    wave from below at a ``frequency`` w [rad/s], a number or an array.

    It is (z - Z) / (z + Z) with the impedance z of the ``pipe`` [N m s/rad] and that of
    the drive, Z = K_p + i (w J - K_i / w), to which a DC ``motor`` with this circuit, or a
    drive with states, adds its own. None where the law has gains on the motion of the bit: the
    drive is then not described by an impedance. Source: continuity of speed and torque
    of the wave at the top, where the drive's torque is Z times its speed."""
    if law.twist_gain or law.speed_gain or (motor is not None and motor.of_bit):
        return None
    drive = law.damping + 1j * (frequency * law.inertia - law.stiffness / frequency)
    if motor is not None:
        drive = drive + motor.impedance(frequency)
    return (pipe - drive) / (pipe + drive)


def stiff(drive: Any, string: Seen) -> Gains:
    """A fast speed controller (O)."""
    return Gains(string.top, 5.0 * string.top, STIFF * string.impedance)


def soft_torque(drive: Any, string: Seen) -> Gains:
    """A controller that is, at one frequency, a damper of ``matching`` impedances
    (O)."""
    inertia = string.top - drive.compensated_inertia
    rate = np.sqrt(string.stiffness / string.inertia) if drive.frequency is None else 2 * math.pi * drive.frequency
    return Gains(inertia, rate * rate * inertia, drive.matching * string.impedance)


def equal_damping(drive: Any, string: Seen) -> Gains:
    """Both modes of drive and string have the same frequency and the same damping."""
    return Gains(
        string.top, string.stiffness * string.top / string.inertia, 2.0 * np.sqrt(string.stiffness * string.top)
    )


def z_torque(drive: Any, string: Seen) -> Gains:
    """A stiff controller whose set point yields to the torque of the pipe (O, without
    its small filters)."""
    softening = 1.0 + STIFF * drive.a
    damping = STIFF * string.impedance / softening
    return Gains(string.top / softening, damping / drive.high_pass, damping)


def pi(drive: Any, string: Seen) -> Gains:
    """The gains of the study."""
    return Gains(string.top, drive.stiffness, drive.damping, drive.twist_gain, drive.speed_gain)


class Controller(NamedTuple):
    """A drive by torque: its ``gains`` from the numbers of the drive and of the string,
    the ``keys`` of a study that tune it, and whether its torque may be ``limited``, as its
    inertia is the machine's."""

    gains: Callable[[Any, Seen], Gains]
    keys: tuple[str, ...] = ()
    limited: bool = True


LAWS = {
    "stiff": Controller(stiff),
    "soft_torque": Controller(soft_torque, ("matching", "frequency", "compensated_inertia")),
    "equal_damping": Controller(equal_damping),
    "z_torque": Controller(z_torque, ("a", "high_pass"), limited=False),
    "pi": Controller(pi, ("stiffness", "damping", "twist_gain", "speed_gain")),
}


def goes_by_torque(kind: str) -> bool:
    """Whether a drive of this kind is one by torque, of nsdrill or of a script."""
    return kind in LAWS or own_drive(kind) is not None


def is_limited(kind: str) -> bool:
    """Whether the torque of such a drive may have a limit."""
    return LAWS[kind].limited if kind in LAWS else own_drive(kind) is not None


class _Kinds(dict[str, tuple[str, ...]]):
    """The keys that each kind of drive reads, with the ``common`` ones of drives of
    scripts."""

    def __init__(self, common: tuple[str, ...], known: dict[str, tuple[str, ...]]) -> None:
        super().__init__(known)
        self.common = common

    def __missing__(self, kind: str) -> tuple[str, ...]:
        if (own := own_drive(kind)) is None:
            raise KeyError(kind)
        return (*self.common, "torque_limit", *own.numbers)


def kinds(common: tuple[str, ...], **others: tuple[str, ...]) -> Reads:
    """The keys that each kind of drive reads: ``common`` ones and those of its tuning,
    and what ``others`` of the model read."""
    by_torque = {kind: (*common, *(("torque_limit",) if law.limited else ()), *law.keys) for kind, law in LAWS.items()}
    return Reads("drive.kind", "the drive", "a drive of the kind", _Kinds(common, {"ideal": (), **by_torque, **others}))


def linear_drive(drive: Any, at: Mapping[str, Any], table: Mapping[str, Any]) -> Linear | None:
    """The ``drive`` of a script about states ``at``, with these lane parameters; None where
    it is one of nsdrill."""
    own = own_drive(drive.kind)
    return None if own is None else own.linear(at, table)


def about_steady(law: Gains, linear: Linear) -> Gains:
    """The ``law`` of a drive of a script with its gains about steady drilling."""
    lag, speed, twist, bit = (float(value) for value in linear.gains)
    # the gain on the twist is one on that of the string
    return law._replace(stiffness=lag + twist, damping=speed, twist_gain=twist, speed_gain=bit)


def by_rows(function: Callable[[tuple[float, ...]], Any], *columns: Numeric) -> np.ndarray:
    """A ``function`` of the numbers of each operating point, called once for points that
    have the same: the shape is that of the ``columns`` together, then that of its
    result."""
    numbers = np.broadcast_arrays(*(np.asarray(column, dtype=float) for column in columns))
    table = np.stack([column.ravel() for column in numbers], axis=1)
    distinct, row_of = np.unique(table, axis=0, return_inverse=True)
    results = np.array([function(tuple(row)) for row in distinct.tolist()])
    return results[row_of.ravel()].reshape((*numbers[0].shape, *results.shape[1:]))


def regulated(
    system: Array, force: Array, weights: Sequence[float], effort: float, about: str, change: str
) -> list[float]:
    """The gains of the linear-quadratic regulator of a ``system`` [n, n] with one
    ``force`` [n, 1], which minimise the integral of the squares of the states with these
    ``weights`` and of the force with its ``effort``. InputError where there are none."""
    from scipy.linalg import solve_continuous_are

    try:
        cost = solve_continuous_are(system, force, np.diag(weights), np.array([[effort]]))
    except (np.linalg.LinAlgError, ValueError) as error:
        raise InputError(
            f"drive.kind: lqr finds no gains{about}: the Riccati equation cannot be solved to any use. "
            f"Change {change}, or take another kind."
        ) from error
    return [float(f"{value:.{DIGITS}g}") for value in (force.T @ cost / effort)[0]]


def check_inertia(drive: Any) -> None:
    """ValueError where a torque limit, or the inertia that a controller compensates, is
    inconsistent with the ``drive``'s inertia."""
    if drive.torque_limit is not None and drive.kind == "soft_torque" and drive.compensated_inertia:
        raise ValueError(
            f"torque_limit: found {drive.torque_limit:g} N m with a compensated_inertia, allowed: one of the two"
        )
    if drive.kind == "soft_torque" and not drive.compensated_inertia < drive.inertia:
        raise ValueError(
            f"compensated_inertia: found {drive.compensated_inertia:g} kg m^2, allowed: less than the inertia, "
            f"{drive.inertia:g} kg m^2"
        )


_OF_SOFT_TORQUE = ("drive.compensated_inertia", "drive.inertia", "drive.torque_limit")


def _compensated(check: Any) -> Iterator[Fault]:
    """What :func:`check_inertia` checks."""
    compensated, inertia, limit = _OF_SOFT_TORQUE
    if check.value("drive.kind") != "soft_torque":
        return
    if check.ends(compensated)[1] > 0.0:
        allowed = (
            f"none with {compensated}, which is {check.text(compensated, 1)}: the motor's torque is then another one"
        )
        if check.axis(limit):
            yield check.fault(f"sweep.{limit}", f"an axis over {limit}", allowed)
        elif check.value(limit) is not None:
            yield check.fault(limit, check.text(limit), allowed)
    if check.ends(compensated)[1] >= check.ends(inertia)[0]:
        yield check.fault(
            compensated, check.text(compensated, 1), f"below {inertia}, which is {check.text(inertia, 0)}"
        )


COMPENSATED = Rule(_compensated, ("drive.kind", *_OF_SOFT_TORQUE))


def drive_card(
    kinds: Sequence[str],
    study_kind: str,
    waves: np.ndarray,
    slope_and_reflection: Callable[[str, np.ndarray], tuple[float, Wave | None]],
) -> DriveCard:
    """The chart ``drive-card`` of these ``kinds`` of drive and of the study's kind.
    ``waves`` are the standing waves of the string [rad/s].

    ``slope_and_reflection(kind, frequency)`` gives the greatest slope of friction with
    which the kind is stable, and its :func:`reflection` at these frequencies [rad/s],
    None where it has none. It raises InputError for a kind without gains for this
    string; such a kind is left out unless it is that of the study."""
    frequency = np.geomspace(0.2 * waves[0], 1.3 * waves[-1], 400)
    reflected, slopes = {}, {}
    for kind in dict.fromkeys((*kinds, study_kind)):
        if kind == "pi" != study_kind:
            continue  # a PI drive is drawn only with the gains of the study
        try:
            slopes[kind], coefficient = slope_and_reflection(kind, frequency)
        except InputError:
            if kind == study_kind:
                raise
            continue
        if kind == "ideal":
            coefficient = np.ones_like(frequency)
        if coefficient is not None:
            reflected[kind] = np.abs(coefficient)
    return DriveCard(frequency, reflected, slopes, waves, study_kind)


AT_BEND = "(the equations bend at steady drilling)"


def unknown_by_bend(quantities: Mapping[str, DerivedQuantity]) -> dict[str, DerivedQuantity]:
    """Quantities of the linear theory, which are not known where the equations bend."""
    return {
        name: replace(one, value=None, known=False, everywhere=False, meaning=f"{one.meaning} {AT_BEND}")
        for name, one in quantities.items()
    }


BISECTIONS = 60
AHEAD = 3  # bisections whose middles are tried at once


def growing(matrix: Array) -> complex | None:
    """The eigenvalue [1/s] that grows fastest; None where none grows."""
    roots = np.linalg.eigvals(matrix)
    worst = roots[np.argmax(roots.real)]
    return complex(worst) if worst.real > 1e-9 * np.abs(roots).max() else None


def steepest_fall(matrix: Array, column: Array, bit: int, low: Numeric, high: Numeric) -> Array:
    """The steepest fall of the bit's torque with its speed [N m s/rad], between ``low``,
    where drilling is stable, and ``high``, where it is not, with which steady drilling is
    stable: of matrices [..., n, n] an array [...]. ``column`` [..., n] is how a torque
    on the bit changes the rates, ``bit`` the place of the bit's speed."""
    lowest, highest = (np.broadcast_to(np.asarray(end, dtype=float), matrix.shape[:-2]) for end in (low, high))
    for _ in range(BISECTIONS // AHEAD):
        ends = np.stack([lowest, highest])
        for _ in range(AHEAD):  # the middles that bisection can come to, each of its two ends
            middles = 0.5 * (ends[:-1] + ends[1:])
            ends = np.insert(ends, range(1, len(ends)), middles, axis=0)
        falling = np.repeat(matrix[None], len(ends) - 2, axis=0)
        falling[..., bit] -= ends[1:-1, ..., None] * column  # negative damping
        stable = np.linalg.eigvals(falling).real.max(axis=-1) < 0.0
        place = np.zeros(lowest.shape, dtype=int)
        for step in 2 ** np.arange(AHEAD - 1, -1, -1):
            at = np.take_along_axis(stable, (place + step - 1)[None], axis=0)[0]
            place = np.where(at, place + step, place)
        lowest, highest = (np.take_along_axis(ends, (place + k)[None], axis=0)[0] for k in (0, 1))
    return lowest


def quantities_of_drive(
    drive: Any,
    matrix: Array,
    torque: float,
    reflected: Wave | None,
    law: Gains | None = None,
    most: int | None = None,
    *,
    bends: bool = False,
) -> dict[str, DerivedQuantity]:
    """What ``check`` says of a ``drive`` and its string: the gains of its ``law``, what it
    reflects of a wave, by its coefficient, what its limit leaves above a steady ``torque``
    [N m], and the first ``most`` modes of ``matrix``; where the drive ``bends`` at steady
    drilling, nothing of it that is linear is known."""
    quantities: dict[str, DerivedQuantity] = {}
    if law is not None:
        gain, damping = "integral gain of the drive, K_i", "proportional gain of the drive, K_p"
        own = own_drive(drive.kind)
        with_states = own is not None and bool(own.states)
        of_all = "; none of a drive with states of its own, whose gains depend on the frequency" if with_states else ""
        for name, value, units, meaning in (
            ("drive_stiffness", law.stiffness, "N m/rad", gain),
            ("drive_damping", law.damping, "N m s/rad", damping),
        ):
            shown = None if with_states else float(value)
            quantities[name] = DerivedQuantity(shown, units, meaning + of_all)
    if drive.kind != "ideal":
        share: float | None = None if reflected is None else float(np.abs(reflected))
        quantities["drive_reflection"] = DerivedQuantity(
            share, "1", "share of a wave at the torsional frequency that the drive reflects"
        )
    if drive.torque_limit is not None:
        reserve, meaning = float(drive.torque_limit) - torque, "torque limit of the drive less the steady torque"
        quantities["torque_reserve"] = DerivedQuantity(reserve, "N m", meaning)
    oscillating = sorted((complex(root) for root in np.linalg.eigvals(matrix) if root.imag > 0), key=abs)
    for number, root in enumerate(oscillating[:most], start=1):
        frequency, ratio = f"frequency {number} of string and drive", "its damping ratio, without friction at the bit"
        quantities[f"drive_mode_{number}"] = DerivedQuantity(abs(root), "rad/s", frequency)
        quantities[f"drive_damping_{number}"] = DerivedQuantity(-root.real / abs(root), "1", ratio)
    if bends:
        quantities |= unknown_by_bend({name: one for name, one in quantities.items() if name != "torque_reserve"})
    return quantities
