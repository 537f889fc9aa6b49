"""The options of a collar, which are compiled in."""

from __future__ import annotations

from typing import NamedTuple

from nsdrill.models.beam.parameters import MAX_MODES, Parameters

FIRST_MODE = ("x", "vx", "y", "vy")  # of the first mode, as named in the study's start
COMMON = ("z", "vz", "twist", "bit_speed")


class Options(NamedTuple):
    """Whole numbers, as they go into the names of compiled functions: the numbers of
    ``modes`` and ``stations``; whether the law of the wall is Hertz's; the ``lobes`` of
    the rock; the ``unbalanced`` modes as a sum of bits, 1 for the first, 2 for the
    second, 4 for the third; whether the ``torque`` softens the collar; whether friction
    is ``implicit``."""

    modes: int = 5
    stations: int = 5
    hertz: int = 0
    lobes: int = 3
    unbalanced: int = 1
    torque: int = 0
    implicit: int = 0

    @property
    def eccentric(self) -> tuple[int, ...]:
        """The numbers of the modes that are eccentric."""
        return tuple(n for n in range(1, self.modes + 1) if self.unbalanced >> (n - 1) & 1)


def options_of(parameters: Parameters) -> Options:
    """The options of a collar."""
    beam = parameters.beam
    return Options(
        modes=beam.modes,
        stations=len(beam.stations),
        hertz=int(parameters.well.law == "hertz"),
        lobes=parameters.bit.lobes,
        unbalanced=sum(1 << (n - 1) for n in unbalanced_modes(parameters)),
        torque=int(beam.torque == "cy"),
    )


def unbalanced_modes(parameters: Parameters) -> list[int]:
    """The numbers of the modes whose mass centre is off the axis; with a swept
    eccentricity all modes that may be."""
    distances, modes = parameters.beam.eccentricity_modes, range(1, parameters.beam.modes + 1)
    if distances is not None:
        return [n for n, value in zip(modes, distances, strict=False) if value != 0.0]
    return [n for n in modes if n % 2] if parameters.drillstring.eccentricity_shape == "uniform" else [1]


def lateral(n: int) -> tuple[str, str, str, str]:
    """The names of the states of mode ``n``."""
    return f"x_{n}", f"vx_{n}", f"y_{n}", f"vy_{n}"


def states_of(modes: int) -> tuple[str, ...]:
    """The names of the states; those that the lumped model also has come first, in its
    order."""
    return (*lateral(1), *COMMON, *(name for n in range(2, modes + 1) for name in lateral(n)))


def slopes_of(modes: int) -> tuple[str, ...]:
    """The names of the accelerations, in the order of the states."""
    higher = (name for n in range(2, modes + 1) for name in (f"ax_{n}", f"ay_{n}"))
    return ("ax_1", "ay_1", "az", "bit_acceleration", *higher)


STATE_SETS = {n: (*states_of(n), "drive_angle") for n in range(1, MAX_MODES + 1)}
