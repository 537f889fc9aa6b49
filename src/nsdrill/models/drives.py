"""What a controller makes of a drive at the top of a string, whatever the model of the
string: the law of its torque as numbers, one function for each kind.

With lag = phi_d - Omega t, the angle by which the top is ahead of the set point
(negative: behind), omega_d its speed, psi the angle of the bit and omega its speed,
both counted as those of the top, the torque of the motor is

    T_m = -K_i lag - K_p (omega_d - Omega) - G_t (psi - lag) - G_w (omega - Omega)

and J omega_d' = T_m less the torque of the string. The integral of a PI controller's
speed error is -lag, so K_i is its integral gain. With a ``torque_limit`` T_m stays
between 0 and that limit: the motor does not brake. (The controller of **O** has 60 kN
m.) That is the torque of the machine only where J is the machine's own inertia. The
integral winds up meanwhile, as in **O**: it is the angle that the top lags behind.

Sources: **O** Simulator4nDOF of the Open Source Drilling Community (top-drive
controller and its configuration); **K** Kyllingstad & Nessjoen 2009, SPE/IADC 119660,
as cited there. Equal damping places both modes of drive and string at one frequency
with one damping: J_d J s^4 + ... = J J_d (s^2 + 2 z w s + w^2)^2 without bit damping.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from nsdrill.errors import Fault, InputError
from nsdrill.models.numbers import DriveCard

STIFF = 50.0  # speed gain of a stiff controller, in pipe impedances (O)
DIGITS = 9  # of numbers that come from LAPACK, whose last digits depend on the processor

# The keys of a study that tune each kind, and the kinds whose motor may have a limit,
# as the inertia is the machine's.
TUNING: dict[str, tuple[str, ...]] = {
    "ideal": (),
    "stiff": (),
    "soft_torque": ("matching", "frequency", "compensated_inertia"),
    "equal_damping": (),
    "z_torque": ("a", "high_pass"),
    "pi": ("stiffness", "damping", "twist_gain", "speed_gain"),
}
LIMITED = ("stiff", "soft_torque", "equal_damping", "pi")


class Gains(NamedTuple):
    """Numbers, or arrays over operating points: the drive's inertia [kg m^2] as its
    controller makes it felt, then K_i [N m/rad], K_p [N m s/rad], G_t [N m/rad], G_w
    [N m s/rad], c_s [N m s/rad]."""

    inertia: Any
    stiffness: Any
    damping: Any
    twist_gain: Any = 0.0
    speed_gain: Any = 0.0
    shaft_damping: Any = 0.0


class Seen(NamedTuple):
    """What a controller is tuned to, numbers or arrays over operating points: the
    inertia that turns with the drive [kg m^2], and of the string its lumped inertia
    [kg m^2], its stiffness [N m/rad], both of its first torsional mode, and its
    impedance at the top [N m s/rad], in which a wave from below meets nothing."""

    top: Any
    inertia: Any
    stiffness: Any
    impedance: Any


def impedance_of(polar: Any, density: Any, shear_modulus: Any) -> Any:
    """The torsional impedance of a pipe, Ip sqrt(rho G) [N m s/rad], from its polar
    moment [m^4]."""
    return polar * np.sqrt(density * shear_modulus)


def motor_torque(
    law: Gains,
    limit: Any,
    lag: Any,
    drive_speed: Any,
    twist: Any,
    bit_speed: Any,
    rotary_speed: Any,
) -> Any:
    """The torque of the motor [N m] as the controller asks for it, within 0 and
    ``limit`` [N m] where that is given."""
    asked = -(
        law.stiffness * lag
        + law.damping * (drive_speed - rotary_speed)
        + law.twist_gain * (twist - lag)
        + law.speed_gain * (bit_speed - rotary_speed)
    )
    return asked if limit is None else np.clip(asked, 0.0, limit)


class Circuit(NamedTuple):
    """A DC motor seen from the string: its damping K [N m s/rad], the time constant T
    of the circuit [s], the stiffness S with which it holds its angle [N m/rad], and
    whether it acts on the motion of the bit."""

    damping: float
    time: float
    stiffness: float = 0.0
    of_bit: bool = False


def reflection(law: Gains, pipe: float, frequency: Any, motor: Circuit | None = None) -> Any:
    """What share of the velocity of a torsional wave from below comes back from the
    drive, complex, at a ``frequency`` w [rad/s], a number or an array: (z - Z) / (z +
    Z) with the impedance z of the ``pipe`` [N m s/rad] and Z = K_p + i (w J - K_i / w)
    of the drive; of a DC ``motor`` with this circuit it is i w J + (K + S / (i w)) / (1
    + i w T). None where the law has gains on the motion of the bit: the drive is no
    impedance then. Source: continuity of speed and torque of the wave at the top, where
    the drive's torque is Z times its speed."""
    if law.twist_gain or law.speed_gain or (motor is not None and motor.of_bit):
        return None
    drive = law.damping + 1j * (frequency * law.inertia - law.stiffness / frequency)
    if motor is not None:
        stiffness = motor.stiffness / (1j * frequency) if motor.stiffness else 0.0
        drive = drive + (motor.damping + stiffness) / (1.0 + 1j * frequency * motor.time)
    return (pipe - drive) / (pipe + drive)


def stiff(drive: Any, seen: Seen) -> Gains:
    """A fast speed controller (O)."""
    return Gains(seen.top, 5.0 * seen.top, STIFF * seen.impedance)


def soft_torque(drive: Any, seen: Seen) -> Gains:
    """A controller that is, at one frequency, a damper of ``matching`` impedances (O)."""
    inertia = seen.top - drive.compensated_inertia
    rate = (
        np.sqrt(seen.stiffness / seen.inertia)
        if drive.frequency is None
        else 2 * math.pi * drive.frequency
    )
    return Gains(inertia, rate * rate * inertia, drive.matching * seen.impedance)


def equal_damping(drive: Any, seen: Seen) -> Gains:
    """Both modes of drive and string at one frequency, with one damping."""
    return Gains(
        seen.top, seen.stiffness * seen.top / seen.inertia, 2.0 * np.sqrt(seen.stiffness * seen.top)
    )


def z_torque(drive: Any, seen: Seen) -> Gains:
    """A stiff controller whose set point gives way to the torque of the pipe (O, its
    small filters left out)."""
    softer = 1.0 + STIFF * drive.a
    damping = STIFF * seen.impedance / softer
    return Gains(seen.top / softer, damping / drive.high_pass, damping)


def pi(drive: Any, seen: Seen) -> Gains:
    """The law itself."""
    return Gains(seen.top, drive.stiffness, drive.damping, drive.twist_gain, drive.speed_gain)


LAWS: dict[str, Callable[[Any, Seen], Gains]] = {
    "stiff": stiff,
    "soft_torque": soft_torque,
    "equal_damping": equal_damping,
    "z_torque": z_torque,
    "pi": pi,
}


def check_inertia(drive: Any) -> None:
    """ValueError where a limit, or what a controller compensates, does not go with the
    ``drive``'s inertia."""
    if drive.torque_limit is not None and drive.kind == "soft_torque" and drive.compensated_inertia:
        raise ValueError(
            f"torque_limit: found {drive.torque_limit:g} N m with a compensated_inertia, allowed: "
            f"one of the two"
        )
    if drive.kind == "soft_torque" and not drive.compensated_inertia < drive.inertia:
        raise ValueError(
            f"compensated_inertia: found {drive.compensated_inertia:g} kg m^2, allowed: less than "
            f"the inertia, "
            f"{drive.inertia:g} kg m^2"
        )


def inertia_faults(check: Any) -> Iterator[Fault]:
    """As :func:`check_inertia`, of a study; ``check`` is its Checker."""
    kind = check.value("drive.kind")
    taken, inertia, limit = "drive.compensated_inertia", "drive.inertia", "drive.torque_limit"
    if kind != "soft_torque" or not check.sound(taken, inertia, limit):
        return
    if check.ends(taken)[1] > 0.0:
        allowed = (
            f"none with {taken}, which is {check.text(taken, 1)}: the motor's torque is then "
            f"another one"
        )
        if check.axis(limit):
            yield check.fault(f"sweep.{limit}", f"an axis over {limit}", allowed, ("sweep", limit))
        elif check.value(limit) is not None:
            yield check.fault(limit, check.text(limit), allowed)
    if check.ends(taken)[1] >= check.ends(inertia)[0]:
        yield check.fault(
            taken, check.text(taken, 1), f"below {inertia}, which is {check.text(inertia, 0)}"
        )


def overloaded(pairs: Sequence[tuple[float, float]], told: Any) -> str | None:
    """The warning of a motor whose limit is below the steady torque, of the worst of
    ``pairs`` (torque, limit) [N m]; ``told`` puts values in words."""
    torque, limit = max(pairs, key=lambda pair: pair[0] - pair[1], default=(0.0, 0.0))
    if torque <= limit:
        return None
    return (
        f"Overloaded: steady drilling takes {told(torque, 'N m', 'kN*m')}, and the drive has "
        f"{told(limit, 'N m', 'kN*m')} at most (drive.torque_limit). It cannot keep the set "
        f"speed; the string "
        "stops or turns slower, and lags behind more and more."
    )


def swinging(found: Sequence[tuple[complex, float, str]], several: bool, told: Any) -> str | None:
    """The warning of a drive that swings the string by itself, of the worst of these
    (eigenvalue [1/s], depth [m], kind); with the depth where there are ``several``."""
    if not found:
        return None
    root, depth, kind = max(found, key=lambda one: one[0].real)
    swing = (
        f" and swings at {abs(root.imag):.4g} rad/s" if abs(root.imag) > 1e-9 * abs(root) else ""
    )
    where = f" at {told(depth, 'm', 'm')}" if several else ""
    return (
        f"Unstable: without any friction at the bit the string and its drive{where} do not come "
        f"to rest: an eigenvalue "
        f"is {root.real:.4g}{f' +- {abs(root.imag):.4g}i' if swing else ''} 1/s, so a deviation "
        f"grows e-fold in "
        f"{1 / root.real:.3g} s{swing}. Look at the signs and sizes of the gains of drive: {kind}."
    )


def drive_card(
    kinds: Sequence[str],
    own: str,
    waves: np.ndarray,
    seen: Callable[[str, np.ndarray], tuple[float, Any]],
) -> DriveCard:
    """The chart ``drive-card`` of these ``kinds`` of drive and of the study's ``own``,
    below whose string stand ``waves`` [rad/s]. ``seen`` gives of a kind, at frequencies
    [rad/s], the slope of friction that it holds and its :func:`reflection`, None where
    it has none; an InputError of it says that the kind has no gains for this string."""
    frequency = np.geomspace(0.2 * waves[0], 1.3 * waves[-1], 400)
    reflected, held = {}, {}
    for kind in dict.fromkeys((*kinds, own)):
        if kind == "pi" != own:
            continue  # it is whatever its numbers are, so the study has to give them
        try:
            held[kind], found = seen(kind, frequency)
        except InputError:
            if kind == own:
                raise
            continue
        if kind == "ideal":
            found = np.ones_like(frequency)
        if found is not None:
            reflected[kind] = np.abs(found)
    return DriveCard(frequency, reflected, held, waves, own)
