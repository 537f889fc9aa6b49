"""The right-hand side of the elastic collar, for all lanes at once.

Collar: simply supported, deflection X = sum x_n sin(n pi xi), Y alike, n = 1 ... N;
modal mass m and stiffness k_n (Ghasemloonia, Rideout & Butt for m and P; the torque as
in Christoforou & Yigit). Walls and mud act at stations j, with phi_jn = sin(n pi
xi_j)::

    k_n = E I (n pi)^4 / (2 l^3) - P (n pi)^2 / (2 l) - T (n pi)^3 / (2 l^2)
    N_j = k_j max(r_j - c_j, 0)^(1 or 3/2),   T_j = N_j f(omega R + theta_j' r_j)
    f_j = -N_j e_r - T_j e_theta - d_j |v_j| v_j
    F_n = -k_n (x_n, y_n) - c_n (x_n', y_n') + sum_j phi_jn f_j

    J_e phi'' = -T_ob - c_t omega - k_t psi - sum_j T_j R
                - sum_n q_n (F_yn cos phi - F_xn sin phi)
    x_n'' = q_n (omega^2 cos phi + phi'' sin phi) + F_xn / m
    y_n'' = q_n (omega^2 sin phi - phi'' cos phi) + F_yn / m

with q_n = m_e e_n / m and J_e = J + sum_n m_e e_n (e_n - q_n): Lagrange's equations of
the kinetic energy that :func:`nsdrill.models.beam.forces.energy` gives. Bit, rock and
twist are those of the lumped model. The text is written out over modes and stations,
because a loop over them inside the one over the lanes would not compile to packed
instructions.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from nsdrill.abi import Rows
from nsdrill.compiler.functions import BUFFER, compiled
from nsdrill.compiler.words import fma
from nsdrill.elementary import sincos
from nsdrill.generate import define
from nsdrill.kernel.slip import first_slip, hyperbolic, kept
from nsdrill.models.beam import implicit
from nsdrill.models.beam.options import Options, lateral, slopes_of, states_of
from nsdrill.models.christoforou_yigit.friction import slip_factors
from nsdrill.models.christoforou_yigit.lobes import multiple_sine

STEP = 2.0**-20  # of a deviation, at whose ends a difference is taken

# Auxiliary outputs for the observer: cosine and sine of the bit angle, force and torque
# of the rock; the sum of friction over the stations on the wall, their number, and the
# sum of their slips.
SHARED = ("cosine", "sine", "force", "torque", "friction", "wall_contacts", "slip_sum")
# Auxiliary outputs of each station: position, radius, radius times radial velocity,
# slip times radius, and forces.
LOCAL = ("px", "py", "radius", "outward", "slip", "fx", "fy")
PARAMETERS = (
    "drive_speed",
    "wob",
    "per_lateral_mass",
    "per_inertia",
    "per_axial_mass",
    "bending",
    "softening_constant",
    "softening_force",
    "softening_torque",
    "structural",
    "axial_damping",
    "axial_stiffness",
    "torsional_damping",
    "torsional_stiffness",
    "gap",
    "wall_stiffness",
    "collar_radius",
    "wall_smoothing",
    "wall_decay",
    "wall_rise",
    "wall_dynamic",
    "rock_stiffness",
    "surface_amplitude",
    "bit_smoothing",
    "bit_decay",
    "bit_rise",
    "bit_dynamic",
    "stuck_below",
    "torque_scale",
)
# Lane parameters of each station: the gap, the stiffness of the wall, the drag, and the
# factor from a penetration of this wall to that of the well's wall under the same
# force, for comparing penetrations of different walls.
STATION = ("gap", "wall_stiffness", "drag", "penetration_factor")


def columns_of(options: Options) -> tuple[str, ...]:
    """The names of the lane parameters: those of every collar, the arms of unbalanced
    modes, the mode shapes at the watched place, the parameters of each station, and the
    mode shapes there."""
    modes, stations = range(1, options.modes + 1), range(1, options.stations + 1)
    arms = (f"unbalance_arm_{n}" for n in options.eccentric)
    of_stations = (f"{name}_{j}" for j in stations for name in STATION)
    shapes = (f"phi_{j}_{n}" for j in stations for n in modes)
    return (*PARAMETERS, *arms, *(f"watched_{n}" for n in modes), *of_stations, *shapes)


def aux_of(options: Options) -> tuple[str, ...]:
    """The names of the auxiliary outputs."""
    local = (f"{name}_{j}" for j in range(1, options.stations + 1) for name in LOCAL)
    return (*SHARED, *local, *(implicit.aux_of(options) if options.implicit else ()))


def rows_of(
    options: Options, observed: int = 0, *, tangent: bool = False, columns: int | None = None
) -> Rows:
    """The layout of the lane buffer for an observer with ``observed`` rows, with a
    deviation beside the states if ``tangent``."""
    states = 4 * options.modes + 4
    tangent_states = states if tangent else 0
    width = len(columns_of(options)) if columns is None else columns
    pushed = implicit.pushed(options) if options.implicit else 0
    return Rows(
        states + tangent_states,
        len(aux_of(options)),
        width,
        observed,
        tangent_states,
        implicit=pushed,
    )


@lru_cache
def make_right_hand_side(lanes: int, options: Options, *, tangent: bool = False) -> Any:
    """The compiled right-hand side for a number of lanes and these options; with
    ``tangent`` also that of a deviation: the central difference of the slopes at two
    states, ``STEP`` times the deviation to either side of the motion, as in
    a central difference."""
    helpers = {
        "np": np,
        "fma": fma,
        "sincos": sincos,
        "slip_factors": slip_factors,
        "multiple_sine": multiple_sine,
    }
    if options.implicit:
        helpers |= {"first_slip": first_slip, "hyperbolic": hyperbolic, "kept": kept}
    function = define("right_hand_side", text(lanes, options, tangent=tangent), **helpers)
    return compiled(BUFFER)(function)


def text(lanes: int, options: Options, *, tangent: bool = False) -> str:
    """The source of the right-hand side."""
    rows = rows_of(options, tangent=tangent)
    lines = ["def right_hand_side(b):"]
    pushes = len(rows.pushed) // 2
    for sign in ("+", "-") if tangent else ():
        lines += Writer(lanes, options, rows, sign).lines()
        pairs = [
            (rows.acceleration + k, rows.acceleration + rows.own_slopes + k)
            for k in range(rows.own_slopes)
        ]
        pairs += [(rows.push + k, rows.push + pushes + k) for k in range(pushes)]
        for slope_row, tangent_row in pairs:
            value, follows = (f"b[{lanes * n} + i]" for n in (slope_row, tangent_row))
            result = value if sign == "+" else f"({follows} - {value}) * {0.5 / STEP!r}"
            lines += [f"    for i in packed({lanes}):", f"        {follows} = {result}"]
    if tangent and options.implicit:
        aux, names = aux_of(options), states_of(options.modes)
        for k, name in enumerate(implicit.velocities(options)):
            places = (
                *(rows.aux_now + aux.index(f"{word}_{k}") for word in ("above", "below")),
                rows.own + names.index(name),
            )
            above, below, deviation = (f"b[{lanes * n} + i]" for n in places)
            lines += [
                f"    for i in packed({lanes}):",
                f"        {deviation} = ({above} - {below}) * {0.5 / STEP!r}",
            ]
    return "\n".join([*lines, *Writer(lanes, options, rows).lines(), ""])


def total(terms: list[tuple[str, str]], last: str = "") -> str:
    """The sum of products and of ``last``, fused: the text of the expression."""
    expression = last or f"{terms[-1][0]} * {terms[-1][1]}"
    for first, second in reversed(terms if last else terms[:-1]):
        expression = f"fma({first}, {second}, {expression})"
    return expression


class Writer:
    """Writes the loops of the right-hand side at the states, or, with a ``sign``, at
    the states plus or minus ``STEP`` times the deviation."""

    def __init__(self, lanes: int, options: Options, rows: Rows, sign: str = "") -> None:
        modes = options.modes
        self.lanes, self.options = lanes, options
        self.modes, self.stations = range(1, modes + 1), range(1, options.stations + 1)
        place = {name: rows.stage + k for k, name in enumerate(states_of(modes))}
        place |= {name: rows.acceleration + k for k, name in enumerate(slopes_of(modes))}
        place |= {name: rows.aux_now + k for k, name in enumerate(aux_of(options))}
        place |= {name: rows.parameter + k for k, name in enumerate(columns_of(options))}
        place |= {"time": rows.stage_time, "phase": rows.phase}
        if options.implicit:
            place |= {"relax": rows.relax, "falling": rows.falling}
            moved = dict(enumerate(implicit.velocities(options)))
            place |= {f"push_{k}": rows.push + k for k in moved}
            kept = {"+": "above", "-": "below"}
            place |= {
                f"moved_{k}": place[f"{kept[sign]}_{k}" if sign else name]
                for k, name in moved.items()
            }
        self.row = {name: f"b[{lanes * number} + i]" for name, number in place.items()}
        self.sign = sign
        if sign:
            deviation = lanes * rows.own
            for name in states_of(modes):
                number = lanes * place[name]
                self.row[name] = f"(b[{number} + i] {sign} {STEP!r} * b[{number + deviation} + i])"

    def lines(self) -> list[str]:
        if self.options.implicit:
            lines = implicit.Solve(self, for_tangent=bool(self.sign)).lines()
            # All that follows is evaluated at the velocities after the pushes.
            for k, name in enumerate(implicit.velocities(self.options)):
                self.row[name] = self.row[f"moved_{k}"]
        else:
            flags = " = ".join(f"touching_{j}" for j in self.stations)
            lines = [f"    {flags} = 0", *self.loop(self._bit())]
        for j in self.stations:
            lines += [
                *self.loop(self._station(j)),
                f"    if touching_{j} != 0:",
                *(f"    {line}" for line in self.loop(self._wall(j))),
            ]
        return lines + self.loop([*self._bending(self.modes), *self._rotation()])

    total = staticmethod(total)

    def loop(self, body: list[str]) -> list[str]:
        return [f"    for i in packed({self.lanes}):", *(f"        {line}" for line in body)]

    def load(self, *names: str) -> list[str]:
        return [f"{name} = {self.row[name]}" for name in names]

    def store(self, **values: str) -> list[str]:
        return [f"{self.row[name]} = {value}" for name, value in values.items()]

    def rock(self) -> list[str]:
        """Interference with the lobed surface and force."""
        return [
            *self.load(
                "drive_speed",
                "time",
                "phase",
                "twist",
                "z",
                "bit_speed",
                "rock_stiffness",
                "surface_amplitude",
                "bit_smoothing",
                "bit_decay",
                "bit_rise",
                "bit_dynamic",
            ),
            "s, c = sincos(twist + fma(drive_speed, time, phase))",
            f"lobe = multiple_sine(s, c, {self.options.lobes})",
            "force = rock_stiffness * max(fma(surface_amplitude, lobe, -z), 0.0)",
        ]

    def _bit(self) -> list[str]:
        """Force and torque of the rock; sets the sums over the stations to zero."""
        return [
            *self.rock(),
            "g, decayed, _ = slip_factors(bit_speed, 1.0, bit_smoothing, bit_decay)",
            *self.store(
                cosine="c",
                sine="s",
                force="force",
                friction="0.0",
                wall_contacts="0.0",
                slip_sum="0.0",
                torque="force * (g * fma(bit_rise, decayed, bit_dynamic))",
            ),
        ]

    def _station(self, j: int) -> list[str]:
        """Position and velocity of the station, and the drag of the mud there."""
        shapes = {n: f"phi_{j}_{n}" for n in self.modes}
        lines = self.load(*shapes.values(), *(name for n in self.modes for name in lateral(n)))
        for k, name in enumerate(("px", "vx", "py", "vy")):
            lines.append(f"{name} = {total([(shapes[n], lateral(n)[k]) for n in self.modes])}")
        return [
            *lines,
            *self.load(f"gap_{j}", f"drag_{j}", "collar_radius", "bit_speed"),
            # The floor matters only at the centre of the hole, where there is no force.
            "radius = np.sqrt(max(fma(px, px, py * py), 1e-60))",
            *([] if self.options.implicit else [f"touching_{j} |= 1 if radius > gap_{j} else 0"]),
            f"drag = drag_{j} * np.sqrt(fma(vx, vx, vy * vy))",
            *self.store(
                **{
                    f"px_{j}": "px",
                    f"py_{j}": "py",
                    f"radius_{j}": "radius",
                    f"outward_{j}": "fma(px, vx, py * vy)",
                    f"slip_{j}": "fma(bit_speed * collar_radius, radius, fma(px, vy, -(py * vx)))",
                    f"fx_{j}": "-(drag * vx)",
                    f"fy_{j}": "-(drag * vy)",
                }
            ),
        ]

    def _wall(self, j: int) -> list[str]:
        """Penetration, normal force, friction against the slip of the collar's
        surface."""
        px, py, radius, slip, fx, fy = (
            f"{name}_{j}" for name in ("px", "py", "radius", "slip", "fx", "fy")
        )
        law = [
            f"penetration = max({radius} - gap_{j}, 0.0)",
            f"normal = wall_stiffness_{j} * penetration",
            *(["normal = normal * np.sqrt(penetration)"] if self.options.hertz else []),
            f"g, decayed, per_radius = slip_factors({slip}, {radius}, wall_smoothing, wall_decay)",
            "rubbing = normal * (g * fma(wall_rise, decayed, wall_dynamic))",
        ]
        if self.options.implicit:
            names = (f"normal_{j}", f"load_{j}")
            law = [
                *self.load(*names),
                f"normal, rubbing, per_radius = {', '.join(names)}, 1.0 / {radius}",
            ]
        return [
            *self.load(
                px,
                py,
                radius,
                slip,
                fx,
                fy,
                f"gap_{j}",
                f"wall_stiffness_{j}",
                "wall_smoothing",
                "wall_decay",
                "wall_rise",
                "wall_dynamic",
                "friction",
                "wall_contacts",
                "slip_sum",
            ),
            f"touches = 1.0 if {radius} > gap_{j} else 0.0",
            *law,
            "radial, tangential = normal * per_radius, rubbing * per_radius",
            *self.store(
                **{
                    fx: f"fma(tangential, {py}, fma(-radial, {px}, {fx}))",
                    fy: f"fma(-tangential, {px}, fma(-radial, {py}, {fy}))",
                    "friction": "friction + rubbing",
                    "wall_contacts": "wall_contacts + touches",
                    "slip_sum": f"fma(touches * per_radius, {slip}, slip_sum)",
                }
            ),
        ]

    def _bending(self, modes: Sequence[int]) -> list[str]:
        """The accelerations of these modes; for eccentric ones the forces, in the rows
        of the accelerations."""
        torque = bool(self.options.torque)
        lines = [
            *self.load(
                "bending",
                "softening_constant",
                "softening_force",
                "force",
                "structural",
                "per_lateral_mass",
            ),
            "softened = fma(softening_force, force, softening_constant)",
            *(self.load("softening_torque", "torque") if torque else []),
            *(["twisted = softening_torque * torque"] if torque else []),
            *self.load(*(f"f{axis}_{j}" for j in self.stations for axis in "xy")),
        ]
        for n in modes:
            x, vx, y, vy = lateral(n)
            softer = total(
                [(repr(float(n**2)), "softened")], f"{float(n**3)!r} * twisted" if torque else ""
            )
            lines += [
                *self.load(x, vx, y, vy, *(f"phi_{j}_{n}" for j in self.stations)),
                f"stiffness = fma({float(n**4)!r}, bending, -({softer}))",
                f"damping = {float(n**2)!r} * structural",
            ]
            for axis, position, velocity in (("x", x, vx), ("y", y, vy)):
                elastic = f"-fma(stiffness, {position}, damping * {velocity})"
                force = total([(f"phi_{j}_{n}", f"f{axis}_{j}") for j in self.stations], elastic)
                mass = "" if n in self.options.eccentric else " * per_lateral_mass"
                lines += self.store(**{f"a{axis}_{n}": f"{force}{mass}"})
        return lines

    def _rotation(self) -> list[str]:
        """The moment, the bit's acceleration, the accelerations of the eccentric modes,
        whose rows hold forces so far, and the axial motion."""
        lines = self.load(
            "cosine",
            "sine",
            "twist",
            "bit_speed",
            "z",
            "vz",
            "force",
            "torque",
            "friction",
            "per_inertia",
            "per_lateral_mass",
            "per_axial_mass",
            "torsional_damping",
            "torsional_stiffness",
            "collar_radius",
            "axial_damping",
            "axial_stiffness",
            "wob",
        )
        lines.append(
            "moment = fma(torsional_damping, bit_speed, fma(torsional_stiffness, twist, "
            "fma(friction, collar_radius, torque)))"
        )
        for n in self.options.eccentric:
            lines += [
                *self.load(f"ax_{n}", f"ay_{n}", f"unbalance_arm_{n}"),
                f"moment = fma(unbalance_arm_{n}, fma(ay_{n}, cosine, -(ax_{n} * sine)), moment)",
            ]
        lines += ["angular = -moment * per_inertia", "centripetal = bit_speed * bit_speed"]
        for n in self.options.eccentric:
            forward, across = (
                "fma(centripetal, cosine, angular * sine)",
                "fma(centripetal, sine, -(angular * cosine))",
            )
            lines += self.store(
                **{
                    f"ax_{n}": f"fma(unbalance_arm_{n}, {forward}, ax_{n} * per_lateral_mass)",
                    f"ay_{n}": f"fma(unbalance_arm_{n}, {across}, ay_{n} * per_lateral_mass)",
                }
            )
        axial = "(force - fma(axial_damping, vz, fma(axial_stiffness, z, wob))) * per_axial_mass"
        return lines + self.store(az=axial, bit_acceleration="angular")
