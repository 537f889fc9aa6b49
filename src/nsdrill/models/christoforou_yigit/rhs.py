"""The right-hand side of the 4-DOF equations of motion, for all lanes at once.

Derived from the Lagrangian of the coupled system (theory page of the documentation), as
the printed equations of the paper have sign and index errors. States: x, vx, y, vy, z,
vz, twist, bit_speed, all SI.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

import numpy as np

from nsdrill.abi import Rows
from nsdrill.compiler.functions import BUFFER, compiled, generated, identity
from nsdrill.compiler.lanes import lane_code
from nsdrill.compiler.sums import settled
from nsdrill.compiler.trace import traced
from nsdrill.compiler.words import fma, packed
from nsdrill.elementary import sincos
from nsdrill.models.christoforou_yigit.coefficients import Coefficients, derive, power
from nsdrill.models.christoforou_yigit.equations import motion
from nsdrill.models.christoforou_yigit.drives import Regulator, gains, regulator
from nsdrill.models.christoforou_yigit.friction import (
    bit_arm,
    bit_factors,
    friction_per_slip,
    slip_factors,
)
from nsdrill.models.christoforou_yigit.implicit import SOLVE_AUX, make_solve
from nsdrill.models.christoforou_yigit.implicit_along import AXIAL_AUX
from nsdrill.models.christoforou_yigit.implicit_held import STABILIZER_AUX
from nsdrill.models.christoforou_yigit.lateral import (
    AXIAL_PARAMETERS,
    STABILIZER_PARAMETERS,
    SWIRL_PARAMETERS,
    WEIGHT_PARAMETERS,
    lane_parameters,
)
from nsdrill.models.christoforou_yigit.laws import bit_numbers
from nsdrill.models.christoforou_yigit.lobes import multiple_sine
from nsdrill.models.christoforou_yigit.options import Options, options_of
from nsdrill.models.christoforou_yigit.parameters import Initial, Parameters
from nsdrill.models.differences import rows_to_keep

STATES = ("x", "vx", "y", "vy", "z", "vz", "twist", "bit_speed")
# Auxiliary outputs. The observer reads cosine and sine of the bit angle, the smoothed
# direction of the bit speed, its decay factor and the radius. The others carry results
# from one loop of the right-hand side to the next.
AUX = (
    "cosine",
    "sine",
    "direction",
    "decay",
    "force",
    "torque",
    "radius",
    "slip",
    "radial",
    "tangential",
    "friction",
)
PARAMETERS = (
    "drive_speed",
    "wob",
    "per_lateral_mass",
    "per_inertia",
    "per_axial_mass",
    "unbalance_arm",
    "bending",
    "softening_force",
    "softening_torque",
    "drag",
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
)
INDEX = {name: i for i, name in enumerate(PARAMETERS)}
# Further states and parameters of a drive that is not ideal.
DRIVE_STATES = ("lag", "drive_speed")
DRIVE_PARAMETERS = (
    "per_drive_inertia",
    "drive_stiffness",
    "drive_damping",
    "twist_gain",
    "speed_gain",
    "shaft_damping",
)


# Further states and parameters of a DC motor.
MOTOR_STATES = ("motor_impulse", "motor_torque")
MOTOR_PARAMETERS = ("motor_damping", "per_circuit_time")
# The law of the motor's voltage, where it has gains.
REGULATOR_PARAMETERS = tuple(f"regulator_{name}" for name in Regulator._fields)
CONTACTS = 2  # rock and wall
# Bit masks of the slopes in which friction acts: those of vx, vy and the bit speed;
# with friction along the axis that of vz as well.
PUSHED, PUSHED_ALONG = 0b1011, 0b1111
IGNORED_SCALE = 1e30  # the scale of a state that does not affect the step size


def states_of(options: Options) -> tuple[str, ...]:
    """The names of the states."""
    drive = (*DRIVE_STATES, *MOTOR_STATES) if options.motor else DRIVE_STATES
    return (*STATES, *drive) if options.driven else STATES


def columns_of(options: Options) -> tuple[str, ...]:
    """The names of the lane parameters."""
    drive = (*DRIVE_PARAMETERS, "torque_limit") if options.limited else DRIVE_PARAMETERS
    drive = (*drive, *MOTOR_PARAMETERS) if options.motor else drive
    drive = (*drive, *REGULATOR_PARAMETERS) if options.regulated else drive
    return (
        *PARAMETERS,
        *(drive if options.driven else ()),
        *(SWIRL_PARAMETERS if options.swirl else ()),
        *(STABILIZER_PARAMETERS if options.stabilizer else ()),
        *(WEIGHT_PARAMETERS if options.weight else ()),
        *(AXIAL_PARAMETERS if options.axial_friction else ()),
    )


def aux_of(options: Options) -> tuple[str, ...]:
    """The names of the auxiliary outputs."""
    if not options.implicit:
        return AUX
    return (
        *AUX,
        *SOLVE_AUX,
        *(STABILIZER_AUX if options.stabilizer else ()),
        *(AXIAL_AUX if options.axial_friction else ()),
    )


def rows_of(
    options: Options, observed: int = 0, *, tangent: bool = False, columns: int | None = None
) -> Rows:
    """The lane buffer for an observer with so many ``observed`` rows, with a deviation
    beside the states if ``tangent``, and with so many ``columns`` of parameters where
    there are more than those of the model."""
    states = len(states_of(options))
    tangent_states = states if tangent else 0
    width = len(columns_of(options)) if columns is None else columns
    implicit = (PUSHED_ALONG if options.axial_friction else PUSHED) if options.implicit else 0
    aux = len(aux_of(options))
    if tangent and options.differenced:
        aux += rows_to_keep(states, states // 2, implicit, CONTACTS)
    return Rows(states + tangent_states, aux, width, observed, tangent_states, implicit=implicit)


MAIN = Options()


def places_of(options: Options, rows: Rows) -> dict[str, int]:
    """The row of each input and output of the equations."""
    states = states_of(options)
    return {
        "time": rows.stage_time,
        "phase": rows.phase,
        **{f"s.{name}": rows.stage + k for k, name in enumerate(states)},
        **{f"p.{name}": rows.parameter + k for k, name in enumerate(columns_of(options))},
        **{
            f"slope.{name}": rows.acceleration + k
            for k, name in enumerate(states[1 : rows.own : 2])
        },
        **{f"aux.{name}": rows.aux_now + k for k, name in enumerate(aux_of(options))},
    }


def _right_hand_side(lanes: int, options: Options, rows: Rows) -> Any:
    graph, slopes, outputs = traced(motion, states_of(options), columns_of(options), options)
    wanted = {f"slope.{name}": node for name, node in slopes.items()}
    wanted |= {f"aux.{name}": node for name, node in outputs.items()}
    graph, wanted = settled(graph, wanted)
    return lane_code("right_hand_side", graph, wanted, places_of(options, rows), lanes)


@lru_cache
def make_right_hand_side(lanes: int, options: Options = MAIN, *, tangent: bool = False) -> Any:
    """The compiled right-hand side for a number of lanes and these options; with
    ``tangent`` for a buffer with a deviation, which it does not change."""
    rows = rows_of(options, tangent=tangent)
    if not options.implicit:
        return generated(
            "right_hand_side",
            BUFFER,
            (identity(motion), options, rows, lanes),
            lambda: _right_hand_side(lanes, options, rows),
        )
    W, hertz, lobes, driven = lanes, options.hertz, options.lobes, options.driven
    law_of_bit = options.friction
    x_, vx_, y_, vy_, z_, vz_, twist_, speed_ = (W * (rows.stage + i) for i in range(8))
    ax_, ay_, az_, alpha_ = (W * (rows.acceleration + i) for i in range(4))
    time_ = W * rows.stage_time
    (
        cosine_,
        sine_,
        direction_,
        decay_,
        force_,
        torque_,
        radius_,
        slip_,
        radial_,
        tangential_,
        friction_,
    ) = (W * (rows.aux_now + i) for i in range(len(AUX)))
    P = {name: W * (rows.parameter + i) for i, name in enumerate(columns_of(options))}
    phase_, set_speed_, wob_ = W * rows.phase, P["drive_speed"], P["wob"]
    iml_, iJ_, ima_, q_ = (
        P["per_lateral_mass"],
        P["per_inertia"],
        P["per_axial_mass"],
        P["unbalance_arm"],
    )
    bend_, soft_F_, soft_T_, drag_ = (
        P["bending"],
        P["softening_force"],
        P["softening_torque"],
        P["drag"],
    )
    c_a_, k_a_, c_t_, k_t_ = (
        P["axial_damping"],
        P["axial_stiffness"],
        P["torsional_damping"],
        P["torsional_stiffness"],
    )
    gap_, k_w_, R_c_ = P["gap"], P["wall_stiffness"], P["collar_radius"]
    eps_w_, tau_w_, rise_w_, mu_w_ = (
        P["wall_smoothing"],
        P["wall_decay"],
        P["wall_rise"],
        P["wall_dynamic"],
    )
    k_c_, s0_ = P["rock_stiffness"], P["surface_amplitude"]
    eps_b_, tau_b_, rise_b_, mu_b_ = (
        P["bit_smoothing"],
        P["bit_decay"],
        P["bit_rise"],
        P["bit_dynamic"],
    )
    # The rows of the drive; an ideal one has none.
    lag_, omega_d_, alpha_d_ = (
        W * (rows.stage + 8),
        W * (rows.stage + 9),
        W * (rows.acceleration + 4),
    )
    iJ_d_, K_i_, K_p_, G_t_, G_w_, c_s_, torque_limit_ = (
        W * (rows.parameter + len(PARAMETERS) + i) for i in range(7)
    )
    limited, motor = options.limited, options.motor
    T_m_, T_m_rate_ = W * (rows.stage + 11), W * (rows.acceleration + 5)
    motor_damping_, per_time_ = (
        W * (rows.parameter + len(PARAMETERS) + len(DRIVE_PARAMETERS) + i) for i in range(2)
    )
    regulated = options.regulated
    T_0_, psi_0_, g_T_, g_lag_, g_drive_, g_twist_, g_speed_ = (
        P.get(name, 0) for name in REGULATOR_PARAMETERS
    )
    # The rows of further options; 0 without them.
    swirl, stabilizer, weight, axial_friction = (
        options.swirl,
        options.stabilizer,
        options.weight,
        options.axial_friction,
    )
    sigma_, momentum_ = (P.get(name, 0) for name in SWIRL_PARAMETERS)
    clearance_, R_s_, arm_s_, eps_s_, tau_s_, rise_s_, mu_s_ = (
        P.get(name, 0) for name in STABILIZER_PARAMETERS
    )
    weight_, eccentric_ = (P.get(name, 0) for name in WEIGHT_PARAMETERS)
    (rop_,) = (P.get(name, 0) for name in AXIAL_PARAMETERS)
    # the radius at which a contact begins: stabilisers touch before the collar does
    contact_radius_ = clearance_ if stabilizer else gap_
    axial_ = slip_  # friction along the axis overwrites the slip, which is not needed any more
    implicit = options.implicit
    solve = (
        make_solve(lanes, options, rows, columns_of(options), aux_of(options)) if implicit else None
    )

    @compiled(BUFFER)
    def right_hand_side(b):  # type: ignore[no-untyped-def]
        # Bit: interference with the lobed surface, force, torque. Cutting and friction
        # share their direction. The collar's radius and slip are computed here, so that
        # other instructions overlap with the square root.
        touching = 0
        for i in packed(W):
            x, vx, y, vy = b[x_ + i], b[vx_ + i], b[y_ + i], b[vy_ + i]
            # The floor has an effect at the hole's centre only, where no force acts.
            r = np.sqrt(max(fma(x, x, y * y), 1e-60))
            b[radius_ + i] = r
            touching |= 1 if r > b[contact_radius_ + i] else 0
            b[slip_ + i] = fma(b[speed_ + i] * b[R_c_ + i], r, fma(x, vy, -(y * vx)))
            s, c = sincos(b[twist_ + i] + fma(b[set_speed_ + i], b[time_ + i], b[phase_ + i]))
            force = b[k_c_ + i] * max(fma(b[s0_ + i], multiple_sine(s, c, lobes), -b[z_ + i]), 0.0)
            b[cosine_ + i] = c
            b[sine_ + i] = s
            b[force_ + i] = force
            if not implicit:
                omega = b[speed_ + i]
                g, decayed = bit_factors(law_of_bit, omega, b[eps_b_ + i], b[tau_b_ + i])
                b[direction_ + i] = g
                b[decay_ + i] = decayed
                b[torque_ + i] = force * bit_arm(
                    law_of_bit, omega, g, decayed, b[rise_b_ + i], b[mu_b_ + i]
                )

        # Wall, if some lane touches: penetration, normal force, friction against the
        # slip of the collar's surface (the row has slip times radius).
        if implicit:
            solve(b, touching)
        elif touching != 0:
            for i in packed(W):
                r = b[radius_ + i]
                penetration = max(r - b[gap_ + i], 0.0)
                normal = b[k_w_ + i] * penetration
                if hertz:
                    normal = normal * np.sqrt(penetration)
                if axial_friction:
                    slip, along = b[slip_ + i], b[vz_ + i] - b[rop_ + i]
                    share, per_r = friction_per_slip(
                        slip,
                        along * r,
                        r,
                        b[eps_w_ + i],
                        b[tau_w_ + i],
                        b[rise_w_ + i],
                        b[mu_w_ + i],
                    )
                    friction = normal * (share * slip)
                    b[axial_ + i] = normal * (share * (along * r))
                else:
                    g, decayed, per_r = slip_factors(b[slip_ + i], r, b[eps_w_ + i], b[tau_w_ + i])
                    friction = normal * (g * fma(b[rise_w_ + i], decayed, b[mu_w_ + i]))
                b[radial_ + i] = normal * per_r
                b[tangential_ + i] = friction * per_r
                b[friction_ + i] = friction
        else:
            for i in packed(W):
                b[radial_ + i] = 0.0
                b[tangential_ + i] = 0.0
                b[friction_ + i] = 0.0
                if axial_friction:
                    b[axial_ + i] = 0.0

        # The stabilisers carry the restoring force of the bent span, whose size is the
        # normal load of their friction. Its torque on the bit is added to the wall's
        # friction, as a force at the surface of the collar.
        if stabilizer and not implicit and touching != 0:
            for i in packed(W):
                x, vx, y, vy, r = b[x_ + i], b[vx_ + i], b[y_ + i], b[vy_ + i], b[radius_ + i]
                stiffness = fma(
                    -b[soft_F_ + i],
                    b[force_ + i],
                    fma(-b[soft_T_ + i], b[torque_ + i], b[bend_ + i]),
                )
                normal = stiffness * max(r - b[clearance_ + i], 0.0)
                unit = r * r
                slip = fma(
                    b[speed_ + i] * b[R_s_ + i], unit, b[clearance_ + i] * fma(x, vy, -(y * vx))
                )
                if axial_friction:
                    along = (b[vz_ + i] - b[rop_ + i]) * unit
                    share, per_unit = friction_per_slip(
                        slip,
                        along,
                        unit,
                        b[eps_s_ + i],
                        b[tau_s_ + i],
                        b[rise_s_ + i],
                        b[mu_s_ + i],
                    )
                    friction = abs(normal) * (share * slip)
                    b[axial_ + i] += abs(normal) * (share * along)
                else:
                    g, decayed, per_unit = slip_factors(slip, unit, b[eps_s_ + i], b[tau_s_ + i])
                    friction = abs(normal) * (g * fma(b[rise_s_ + i], decayed, b[mu_s_ + i]))
                b[radial_ + i] += normal * (r * per_unit)
                b[tangential_ + i] += friction * (r * per_unit)
                b[friction_ + i] += friction * b[arm_s_ + i]

        # Motion: lateral forces at the collar's centre, softened by axial force and
        # torque; the moment; the slopes.
        for i in packed(W):
            x, vx, y, vy = b[x_ + i], b[vx_ + i], b[y_ + i], b[vy_ + i]
            z, vz, twist, omega = b[z_ + i], b[vz_ + i], b[twist_ + i], b[speed_ + i]
            c, s, force, torque, friction = (
                b[cosine_ + i],
                b[sine_ + i],
                b[force_ + i],
                b[torque_ + i],
                b[friction_ + i],
            )
            radial = b[radial_ + i]
            if not stabilizer:
                stiffness = fma(-b[soft_F_ + i], force, fma(-b[soft_T_ + i], torque, b[bend_ + i]))
                radial = radial + stiffness
            tangential = b[tangential_ + i]
            ux, uy = vx, vy
            if swirl:  # relative to the mud
                ux, uy = fma(b[sigma_ + i], y, vx), fma(-b[sigma_ + i], x, vy)
            drag = b[drag_ + i] * np.sqrt(fma(ux, ux, uy * uy))
            F_x = fma(tangential, y, -fma(radial, x, drag * ux))
            F_y = -fma(tangential, x, fma(radial, y, drag * uy))
            if swirl:
                F_x = fma(b[momentum_ + i], fma(b[sigma_ + i], x, -2.0 * vy), F_x)
                F_y = fma(b[momentum_ + i], fma(b[sigma_ + i], y, 2.0 * vx), F_y)
            if weight:
                F_y = F_y - b[weight_ + i]

            if driven:
                lag, omega_d, set_speed = b[lag_ + i], b[omega_d_ + i], b[set_speed_ + i]
                twist = twist - lag  # of the pipe
                shaft_torque = b[c_s_ + i] * (omega_d - omega)
                minus_T_m = fma(
                    b[K_i_ + i],
                    lag,
                    fma(
                        b[K_p_ + i],
                        omega_d - set_speed,
                        fma(b[G_t_ + i], twist, b[G_w_ + i] * (omega - set_speed)),
                    ),
                )
                if motor:
                    minus_T_m = -b[T_m_ + i]
                    b[T_m_rate_ + i] = (
                        fma(b[motor_damping_ + i], set_speed - omega_d, minus_T_m)
                        * b[per_time_ + i]
                    )
                    if regulated:
                        feedback = fma(
                            b[g_lag_ + i],
                            lag,
                            fma(
                                b[g_drive_ + i],
                                omega_d - set_speed,
                                b[g_speed_ + i] * (omega - set_speed),
                            ),
                        )
                        feedback = fma(b[g_twist_ + i], b[twist_ + i] - b[psi_0_ + i], feedback)
                        feedback = fma(b[g_T_ + i], b[T_m_ + i] - b[T_0_ + i], feedback)
                        b[T_m_rate_ + i] += (b[T_0_ + i] - feedback) * b[per_time_ + i]
                if limited:
                    minus_T_m = min(max(minus_T_m, -b[torque_limit_ + i]), 0.0)
                b[alpha_d_ + i] = (fma(b[k_t_ + i], twist, -shaft_torque) - minus_T_m) * b[
                    iJ_d_ + i
                ]
                torque = torque - shaft_torque
            q = b[q_ + i]
            moment = fma(
                b[c_t_ + i], omega, fma(b[k_t_ + i], twist, fma(friction, b[R_c_ + i], torque))
            )
            if weight:
                moment = fma(b[eccentric_ + i], c, moment)
            if axial_friction:
                force = force - b[axial_ + i]
            angular = -fma(q, fma(F_y, c, -(F_x * s)), moment) * b[iJ_ + i]
            omega_squared = omega * omega
            b[ax_ + i] = fma(q, fma(omega_squared, c, angular * s), F_x * b[iml_ + i])
            b[ay_ + i] = fma(q, fma(omega_squared, s, -(angular * c)), F_y * b[iml_ + i])
            b[az_ + i] = (force - fma(b[c_a_ + i], vz, fma(b[k_a_ + i], z, b[wob_ + i]))) * b[
                ima_ + i
            ]
            b[alpha_ + i] = angular

    return right_hand_side


def pack(
    parameters: Parameters, depth: Any, wob: Any, rotary_speed: Any, stuck_below: float = 0.0
) -> np.ndarray:
    """Lane parameters of operating points, shape (points, columns), from 1-D arrays
    depth [m], wob [N] and rotary_speed [rad/s] of one length."""
    depth, wob, rotary_speed = _broadcast(depth, wob, rotary_speed)
    k: Coefficients = derive(parameters, depth, wob, rotary_speed)
    string, well, bit = parameters.drillstring, parameters.well, parameters.bit
    span = string.collar.span
    q = k.m_e * string.eccentricity / k.m_l
    force_softening, torque_softening = math.pi**2 / (2 * span), math.pi**3 / (2 * power(span, 2))
    live = string.lateral_softening == "live"
    values: dict[str, Any] = {
        "drive_speed": rotary_speed,
        "wob": wob,
        "per_lateral_mass": 1 / k.m_l,
        "per_inertia": 1 / (k.J + k.m_e * string.eccentricity * (string.eccentricity - q)),
        "per_axial_mass": 1 / k.m_a,
        "unbalance_arm": q,
        "bending": k.k_bend
        - (force_softening * wob if string.lateral_softening == "static" else 0.0),
        "softening_force": force_softening if live else 0.0,
        "softening_torque": torque_softening if live else 0.0,
        "drag": k.c_h,
        "axial_damping": string.axial_damping,
        "axial_stiffness": k.k_a,
        "torsional_damping": string.torsional_damping,
        "torsional_stiffness": k.k_t,
        "gap": k.gap,
        "wall_stiffness": well.stiffness,
        "collar_radius": k.collar_radius,
        "wall_smoothing": well.friction.smoothing,
        "wall_decay": well.friction.decay,
        "wall_rise": well.friction.static - well.friction.dynamic,
        "wall_dynamic": well.friction.dynamic,
        "rock_stiffness": bit.rock_stiffness,
        "surface_amplitude": bit.surface_amplitude,
        **bit_numbers(parameters, k)._asdict(),
        "stuck_below": stuck_below,
    }
    modes = parameters.modes
    # Zero reciprocals of mass and inertia freeze a mode.
    if modes.axial == "frozen":
        values |= {"per_axial_mass": 0.0, "surface_amplitude": 0.0}
    if modes.lateral == "frozen":
        values |= {"per_lateral_mass": 0.0, "unbalance_arm": 0.0, "per_inertia": 1 / k.J}
    if modes.torsional == "frozen":
        values["per_inertia"] = 0.0
    options = options_of(parameters)
    if options.driven:
        inertia, *law = gains(parameters, k)
        values |= dict(zip(DRIVE_PARAMETERS, (1 / inertia, *law), strict=True))
        drive = parameters.drive
        values |= {
            "torque_limit": drive.torque_limit,
            "motor_damping": drive.motor_damping,
            "per_circuit_time": 1 / drive.circuit_time,
        }
        if options.regulated:
            law_of_voltage = regulator(parameters, k, wob, rotary_speed)
            values |= dict(zip(REGULATOR_PARAMETERS, law_of_voltage, strict=True))
    values |= lane_parameters(parameters, k, rotary_speed)
    names = columns_of(options)
    table = np.zeros((depth.size, len(names)))
    for i, name in enumerate(names):
        table[:, i] = values[name]
    return table


def _broadcast(*values: Any) -> list[np.ndarray]:
    return list(np.broadcast_arrays(*(np.atleast_1d(value).astype(float) for value in values)))


def state_scales(table: np.ndarray, options: Options = MAIN) -> np.ndarray:
    """Natural scales of each state at operating points, (points, states): the absolute
    tolerance is rtol times this.

    Lateral: a tenth of the gap; axial: the static penetration of the rock under the
    weight on bit, at least a tenth of the lobe amplitude; twist and bit speed: a tenth
    of a radian, a tenth of the drive speed. Velocities: the position's size times the
    frequency of the free mode, bending for the lateral one and in contact for the axial
    one. A drive's lag and speed have the scales of twist and bit speed, the torque of a
    motor that of a twist of that size.
    """
    p = {name: table[:, i] for name, i in INDEX.items()}
    lateral = 0.1 * p["gap"]
    contact = p["axial_stiffness"] + p["rock_stiffness"]
    axial = np.maximum(p["wob"] / contact, np.maximum(0.1 * p["surface_amplitude"], 1e-6))
    bending_rate, axial_rate = (
        np.sqrt(np.where(per_mass > 0.0, square, 1.0))  # any scale will do for a frozen mode
        for per_mass, square in (
            (p["per_lateral_mass"], np.abs(p["bending"]) * p["per_lateral_mass"]),
            (p["per_axial_mass"], contact * p["per_axial_mass"]),
        )
    )
    columns: tuple[np.ndarray, ...] = (
        lateral,
        lateral * bending_rate,
        lateral,
        lateral * bending_rate,
        axial,
        axial * axial_rate,
        np.full(len(table), 0.1),
        0.1 * p["drive_speed"],
    )
    if options.driven:
        columns = (*columns, *columns[-2:])
    if options.motor:
        columns = (*columns, np.full(len(table), IGNORED_SCALE), 0.1 * p["torsional_stiffness"])
    return np.stack(columns, axis=1)


def frame_rates(table: np.ndarray, options: Options = MAIN) -> np.ndarray:
    """The difference of each position's rate and its velocity, shape (points, slopes):
    twist and lag are measured from the set point, which rotates."""
    frame_rate = np.zeros((len(table), len(states_of(options)) // 2))
    frame_rate[:, 3:5] = -table[:, [INDEX["drive_speed"]]]
    return frame_rate


def phase_rate(table: np.ndarray) -> np.ndarray:
    """The rate of the phase, which is the drive's angle [rad/s], shape (points,)."""
    return table[:, INDEX["drive_speed"]]


def first_step(table: np.ndarray, options: Options = MAIN) -> np.ndarray:
    """A first step size [s] for each operating point: a hundredth of the shortest
    natural time, shape (points,)."""
    p = {name: table[:, i] for name, i in INDEX.items()}
    squared_rate = np.maximum(
        p["wall_stiffness"] * p["per_lateral_mass"],
        (p["axial_stiffness"] + p["rock_stiffness"]) * p["per_axial_mass"],
    )
    if options.driven:
        per_inertia, stiffness, damping = table[:, len(PARAMETERS) : len(PARAMETERS) + 3].T
        squared_rate = np.maximum(
            squared_rate, np.maximum(stiffness * per_inertia, (damping * per_inertia) ** 2)
        )
    if options.motor:
        motor_damping, per_time = table[:, len(PARAMETERS) + len(DRIVE_PARAMETERS) :][:, :2].T
        squared_rate = np.maximum(
            squared_rate, np.maximum(motor_damping * per_time * per_inertia, per_time**2)
        )
    if options.regulated:
        names = columns_of(options)
        torque, lag, drive_speed = (
            table[:, names.index(f"regulator_{name}")] for name in ("torque", "lag", "drive_speed")
        )
        squared_motor_rate = np.maximum(
            ((1 + torque) * per_time) ** 2,
            np.abs(motor_damping + drive_speed) * per_time * per_inertia,
        )
        squared_rate = np.maximum(
            squared_rate,
            np.maximum(squared_motor_rate, np.abs(lag * per_time * per_inertia) ** (2 / 3)),
        )
    return 0.01 / np.sqrt(np.maximum(squared_rate, p["drive_speed"] ** 2))


def initial_states(
    parameters: Parameters, initial: Initial, depth: Any, wob: Any, rotary_speed: Any
) -> np.ndarray:
    """Initial states with the drive angle last, shape (points, states + 1)."""
    depth, wob, rotary_speed = _broadcast(depth, wob, rotary_speed)
    k = derive(parameters, depth, wob, rotary_speed)
    options = options_of(parameters)
    states = np.zeros((depth.size, len(states_of(options)) + 1))
    z = -wob / (k.k_a + parameters.bit.rock_stiffness) if initial.z is None else initial.z
    bit_speed = rotary_speed if initial.bit_speed is None else initial.bit_speed
    values = [initial.x, initial.vx, initial.y, initial.vy, z, initial.vz, initial.twist, bit_speed]
    if options.driven:
        values += [
            initial.lag,
            rotary_speed if initial.drive_speed is None else initial.drive_speed,
        ]
    values += [0.0] * (2 * options.motor)
    for i, value in enumerate((*values, initial.drive_angle)):
        states[:, i] = value
    return with_frozen_modes(parameters, states, wob, rotary_speed)


# The states of each mode.
_STATES_OF_MODE = {"lateral": STATES[:4], "axial": STATES[4:6], "torsional": STATES[6:8]}


def frozen_states(parameters: Parameters) -> tuple[str, ...]:
    """The names of the states of frozen modes."""
    return tuple(
        name
        for mode, names in _STATES_OF_MODE.items()
        if getattr(parameters.modes, mode) == "frozen"
        for name in names
    )


def with_frozen_modes(
    parameters: Parameters, states: np.ndarray, wob: np.ndarray, rotary_speed: np.ndarray
) -> np.ndarray:
    """``states`` (points, states + 1), in which the values of frozen modes replace the
    initial ones, in place."""
    modes = parameters.modes
    if modes.lateral == "frozen":
        states[:, :4] = 0.0
    # the bit carries the whole weight; the pipe's spring carries none
    if modes.axial == "frozen":
        states[:, 4], states[:, 5] = -wob / parameters.bit.rock_stiffness, 0.0
    if modes.torsional == "frozen":
        states[:, 6], states[:, 7] = 0.0, rotary_speed
    return states
