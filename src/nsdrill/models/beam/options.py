"""What of the parameters is compiled in."""

from __future__ import annotations

from typing import NamedTuple

from nsdrill.models.beam.parameters import MOST_MODES, Parameters

COMMON = ("z", "vz", "twist", "bit_speed")


class Options(NamedTuple):
    """Whole numbers, as they go into the names of compiled functions: the numbers of ``modes`` and ``stations``;
    whether the law of the wall is Hertz's; the ``lobes`` of the rock; whether all odd modes are eccentric (``uniform``)
    or the first one alone; whether the torque softens the collar."""

    modes: int = 5
    stations: int = 5
    hertz: int = 0
    lobes: int = 3
    uniform: int = 0
    torque: int = 0

    @property
    def eccentric(self) -> tuple[int, ...]:
        """The numbers of the modes that are eccentric."""
        return tuple(range(1, self.modes + 1, 2)) if self.uniform else (1,)


def options_of(parameters: Parameters) -> Options:
    """The options of a collar."""
    string = parameters.drillstring
    return Options(
        modes=parameters.beam.modes,
        stations=parameters.stations.number,
        hertz=int(parameters.well.law == "hertz"),
        lobes=parameters.bit.lobes,
        uniform=int(string.eccentricity_shape == "uniform"),
        torque=int(string.lateral_softening == "live"),
    )


def lateral(n: int) -> tuple[str, str, str, str]:
    """The names of the states of mode ``n``."""
    return f"x_{n}", f"vx_{n}", f"y_{n}", f"vy_{n}"


def states_of(modes: int) -> tuple[str, ...]:
    """The names of the states: those that the lumped model has too come first, in its order."""
    return (*lateral(1), *COMMON, *(name for n in range(2, modes + 1) for name in lateral(n)))


def slopes_of(modes: int) -> tuple[str, ...]:
    """The names of the accelerations, in the order of the states."""
    higher = (name for n in range(2, modes + 1) for name in (f"ax_{n}", f"ay_{n}"))
    return ("ax_1", "ay_1", "az", "bit_acceleration", *higher)


STATE_SETS = {n: (*states_of(n), "drive_angle") for n in range(1, MOST_MODES + 1)}
