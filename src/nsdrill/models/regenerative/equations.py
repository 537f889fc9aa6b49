"""The equations of motion of a string on a drag bit, once.

z [m] and v = z' are those of the bit up, less steady drilling at the rate ROP; psi is
the twist and w the bit speed, phi_d and w_d are the angle and the speed of the drive,
and lag = phi_d - Omega t. With force F and torque T of the rock
(:mod:`nsdrill.models.surface`)::

    M v' = F - W - k z - c v
    J w' = -k_t (psi - lag) + c_s (w_d - w) - D w - T

The drive is that of :mod:`nsdrill.models.top`. The frame of z
advances at the rate ROP of steady drilling, so with k > 0 the top is fed at that rate,
and with k = 0 the hook load is constant.
"""

from __future__ import annotations

from nsdrill.equations.graph import Number
from nsdrill.equations.trace import Named
from nsdrill.models.regenerative.columns import Options
from nsdrill.models.surface import bit_on_rock
from nsdrill.models.top import driven


def equations(t: Number, phase: Number, s: Named, p: Named, o: Options) -> dict[str, Number]:
    """The slopes of the velocities and of the states of the surface."""
    interference, bit_force, bit_torque, slopes = bit_on_rock(s, p, o.surface)  # noqa: RUF059  traces have it
    pipe_twist = s.twist - s.lag if o.driven else s.twist
    surface_torque = -p.torsional_stiffness * pipe_twist
    slopes["vz"] = (bit_force - p.wob - p.axial_stiffness * s.z - p.axial_damping * s.vz) * p.per_mass
    turned = surface_torque - p.torsional_damping * s.bit_speed - bit_torque
    if o.driven:
        of_drive, shaft_torque, drive_torque = driven(s, p, o, pipe_twist, surface_torque)  # noqa: RUF059  check reads it
        turned, slopes = turned + shaft_torque, slopes | of_drive
    slopes["bit_speed"] = turned * p.per_inertia
    rates: dict[str, Number] = slopes
    return rates
