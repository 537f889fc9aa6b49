"""The right-hand side of the string of segments, for all lanes at once.

Nodes i = 0 (surface) .. n (bit); u_i [m] up from the string's shape off bottom, th_i
the angle less that of the set speed [rad], I the current [A]. With the numbers of
:mod:`nsdrill.models.segments.string`, the damping times beta_a and beta_t, and D_i the
mud's drag on a node::

    S_i = k_i (u_{i+1} - u_i + beta_a (v_{i+1} - v_i))
    M_i = kt_i (th_{i+1} - th_i + beta_t (w_{i+1} - w_i))

    m_0 v_0' = -k_top u_0 - c_top v_0 + S_0 + D_0
    m_i v_i' = S_i - S_{i-1} + D_i
    m_n v_n' = F - W - S_{n-1} + D_n

    J_0 w_0' = nK I - (c_rt + cw_0) w_0 + M_0
    J_i w_i' = M_i - M_{i-1} - cw_i w_i
    J_n w_n' = -T - M_{n-1} - cw_n w_n
    L I' = V - R I - nK w_0

A drive by torque has T_m of :mod:`nsdrill.models.segments.drive` in place of nK I -
c_rt w_0, and no current.

The bit, with phi = th_n + the drive's angle, omega = w_n, d = s0 sin(b phi) - u_n,
chi = c_c / W, and w_c the bit speed or the set speed (``bit.cutting.speed``)::

    F = k_c max(d, 0) max(1 + chi d', 0)
    T = F r_b [mu0 (tanh omega + alpha omega / (1 + beta omega^2) + nu omega)
               + on g zeta sqrt(delta / r_b)]
    ROP = max(c1 W sqrt|w_c| + c2, 0)
    delta = 2 pi ROP / sqrt(w_c^2 + w_s^2)
    g = (2/pi) atan(eps omega)
    on = (F - W_fs) / (0.1 W_fs), at least 0 and at most 1

Sources: Sarker, Rideout & Butt 2012 for the structure and the numbers, with the
friction's fifth number gamma = 1; its equations are reconstructed from the legible part
of the text. The rock's force is Hunt and Crossley's (1975): it has the printed damping
c_c at the working load, does not jump when the bit touches, and never pulls, unlike a
spring and a damper in parallel.

The text is generated: one loop over the lanes for each node, whose rows in the buffer
are constants. The compiler does not pack a loop over nodes, because the distance
between the rows differs from place to place.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from nsdrill.abi import RATES, Rows
from nsdrill.compiler.functions import BUFFER, compiled, inlined
from nsdrill.compiler.words import fma, packed
from nsdrill.elementary import (
    TWO_OVER_PI,
    direction,
    direction_joined,
    direction_reduced,
    exp2,
    sincos,
)
from nsdrill.generate import constants, define
from nsdrill.kernel.slip import first_slip
from nsdrill.models.segments.names import AUX, BY_TORQUE, PARAMETERS

ITERATIONS = 4  # for the speed of a bit whose cutting torque is implicit

# Acceleration of a node: the second difference along the chain times stiffness over
# mass, and the drag. The drag v |v| holds for flow in either direction. The bit's tanh
# w is 1 - 2 / (1 + 2^(2 w log2 e)). In this text ``b`` is the lane buffer; u, a and the
# names that end in an underscore are offsets of rows in it.
HELPERS = """
def axial_node(b, u, a, K_, time_, annulus_, bore_, up_, down_, mean_):
    for i in packed(W):
        position, v = b[u + i], b[u + W + i]
        second_difference = (b[u - 2 * W + i] - position) + (b[u + 2 * W + i] - position)
        second_difference_rate = (b[u - W + i] - v) + (b[u + 3 * W + i] - v)
        x, y = b[up_ + i] - v, b[down_ + i] + v
        drag = fma(b[annulus_ + i], x * abs(x), -fma(b[bore_ + i], y * abs(y), b[mean_ + i]))
        b[a + i] = fma(b[K_ + i], fma(b[time_ + i], second_difference_rate, second_difference), drag)

def torsional_node(b, u, a, K_, time_, drag_):
    for i in packed(W):
        angle, v = b[u + i], b[u + W + i]
        second_difference = (b[u - 2 * W + i] - angle) + (b[u + 2 * W + i] - angle)
        second_difference_rate = (b[u - W + i] - v) + (b[u + 3 * W + i] - v)
        b[a + i] = fma(b[K_ + i], fma(b[time_ + i], second_difference_rate, second_difference), -(b[drag_ + i] * v))
"""

BIT = """        lobes, omega = b[lobes_ + i], b[w_n + i]
        phi = b[th_n + i] + fma(b[set_speed + i], b[time_ + i], b[phase_ + i])
        sine, cosine = sincos(lobes * phi)
        amplitude = b[surface_amplitude + i]
        interference = fma(amplitude, sine, -b[u_n + i])
        closing = fma(amplitude * lobes * cosine, omega, -b[v_n + i])
        force = b[rock_stiffness + i] * max(interference, 0.0) * max(fma(b[closing_factor + i], closing, 1.0), 0.0)
        b[sine_ + i] = sine
        b[cosine_ + i] = cosine
        b[interference_ + i] = interference
        b[closing_ + i] = closing
        b[force_ + i] = force
    for i in packed(W):
        omega, force, live = b[w_n + i], b[force_ + i], b[live_ + i]
        cutting_speed = fma(live, omega - b[set_speed + i], b[set_speed + i])
        advance = max(fma(b[advance_ + i], np.sqrt(abs(cutting_speed)), b[advance_offset + i]), 0.0)
        depth = b[cutting_factor + i] * advance / np.sqrt(fma(cutting_speed, cutting_speed, b[slow_square + i]))
        on = min(max((force - b[threshold + i]) * b[per_threshold_width + i], 0.0), 1.0)
        clipped = min(max(omega, -20.0), 20.0)
        rubbing = 1.0 - 2.0 / (1.0 + exp2(2.885390081777926814719849 * clipped))
        rubbing = rubbing + b[hump + i] * omega / fma(b[narrowing + i] * omega, omega, 1.0)
        rubbing = fma(b[viscous + i], omega, rubbing)
        cutting = on * direction(b[smoothing + i] * omega) * np.sqrt(depth)
        b[torque_ + i] = force * fma(b[friction_arm + i], rubbing, b[cutting_arm + i] * cutting)
"""

# The same with an implicit cutting torque, T(omega) = c F on(F) g(omega) r(omega), r =
# sqrt(delta / r_b). The force F depends on the bit speed too, as the rock is damped.
# Two kinds of lanes:
#
# - Where the depth of cut follows the bit speed and begins at a speed x_0 > 0 (ROP
#   offset below zero), r rises from zero there with an infinite slope, and a bit that
#   creeps is held by that slope. All of r is implicit. With |omega| = (sqrt(x_0) +
#   tau^2)^2 the advance is proportional to tau^2 and r to tau, so that Newton's method
#   in tau meets no square root. Its first guess takes x and r / tau at the speed
#   without friction, or at twice the slow speed where that is less.
# - Elsewhere r is that of the set speed, or of rest. The rest of r is zero at rest, so
#   its product with g is not steep and stays explicit. Newton's method is in |omega|,
#   with the first guess of the other models.
#
# The load is that of the last tangent, which agrees with the velocity to rounding.
# After four iterations its error is below 1e-8 in all but some thousandths of random
# stages as long as steps may be; in the worst of them it is some hundredths.
BIT_IMPLICIT = """        phi = b[th_n + i] + fma(b[set_speed + i], b[time_ + i], b[phase_ + i])
        sine, cosine = sincos(b[lobes_ + i] * phi)
        b[sine_ + i] = sine
        b[cosine_ + i] = cosine
        b[interference_ + i] = fma(b[surface_amplitude + i], sine, -b[u_n + i])
    for i in packed(W):
        omega_free, eps, sqrt_start = b[w_n + i], b[smoothing + i], b[creep_start + i]
        relaxed, speed_free = b[relax + i] * b[per_bit_inertia + i] * b[cutting_arm + i], abs(omega_free)
        elastic = b[rock_stiffness + i] * max(b[interference_ + i], 0.0)
        surface_slope = b[surface_amplitude + i] * b[lobes_ + i] * b[cosine_ + i]
        surface_slope = -surface_slope if omega_free < 0.0 else surface_slope
        load, _ = cutting_load(
            speed_free, elastic, surface_slope, b[v_n + i], b[closing_factor + i], b[threshold + i],
            b[per_threshold_width + i],
        )
        flat_guess = first_slip(speed_free, relaxed * b[flat_root + i] * load, eps, 0.0, 0.0, 1.0)
        # Of a bit that creeps; x / (0.8 + x) stands for (2/pi) atan x.
        slow_speed_square = b[slow_square + i]
        low_speed = min(speed_free, b[creep_speed + i])
        scaled = eps * low_speed
        linear = relaxed * load * b[creep_root + i] * scaled
        linear = linear / ((0.8 + scaled) * np.sqrt(np.sqrt(fma(low_speed, low_speed, slow_speed_square))))
        excess = max(fma(-sqrt_start, sqrt_start, speed_free), 0.0)
        tau = 2.0 * excess / (linear + np.sqrt(fma(linear, linear, 8.0 * sqrt_start * excess)) + 1e-300)
        tau = min(tau, np.sqrt(max(np.sqrt(speed_free) - sqrt_start, 0.0)))
        b[force_ + i] = elastic
        b[torque_ + i] = tau if sqrt_start > 0.0 else flat_guess
ITERATIONS    for i in packed(W):
        load, load_slope, g, r, slope, step = newton_step(
            b[torque_ + i], b[w_n + i], b[relax + i] * b[per_bit_inertia + i] * b[cutting_arm + i], b[force_ + i],
            b[surface_amplitude + i] * b[lobes_ + i] * b[cosine_ + i], b[v_n + i], b[closing_factor + i],
            b[threshold + i], b[per_threshold_width + i], b[slow_square + i], b[smoothing + i], b[creep_start + i],
            b[creep_root + i], b[flat_root + i],
        )
        omega_free, sqrt_start, inertia = b[w_n + i], b[creep_start + i], b[per_bit_inertia + i]
        torque = b[cutting_arm + i] * max(fma(slope, step, load * g * r), 0.0)
        torque = torque if abs(omega_free) > sqrt_start * sqrt_start else 0.0
        torque = -torque if omega_free < 0.0 else torque
        b[torque_ + i] = torque
        b[push + i] = -(torque * inertia)
        fall = fma(load, b[creep_fall + i], abs(load_slope) * r)
        b[falling + i] = inertia * b[cutting_arm + i] * fall
        b[w_n + i] = fma(-b[relax + i] * inertia, torque, omega_free)
    for i in packed(W):
        omega, live = b[w_n + i], b[live_ + i]
        cutting_speed = fma(live, omega - b[set_speed + i], b[set_speed + i])
        advance = max(fma(b[advance_ + i], np.sqrt(abs(cutting_speed)), b[advance_offset + i]), 0.0)
        depth = b[cutting_factor + i] * advance / np.sqrt(fma(cutting_speed, cutting_speed, b[slow_square + i]))
        explicit_part = live * (np.sqrt(depth) - b[flat_root + i]) * direction(b[smoothing + i] * omega)
        explicit_part = 0.0 if b[creep_start + i] > 0.0 else explicit_part
        closing = fma(b[surface_amplitude + i] * b[lobes_ + i] * b[cosine_ + i], omega, -b[v_n + i])
        force = b[force_ + i] * max(fma(b[closing_factor + i], closing, 1.0), 0.0)
        clipped = min(max(omega, -20.0), 20.0)
        rubbing = 1.0 - 2.0 / (1.0 + exp2(2.885390081777926814719849 * clipped))
        rubbing = rubbing + b[hump + i] * omega / fma(b[narrowing + i] * omega, omega, 1.0)
        rubbing = fma(b[viscous + i], omega, rubbing)
        on = min(max((force - b[threshold + i]) * b[per_threshold_width + i], 0.0), 1.0)
        cutting = b[cutting_arm + i] * on * explicit_part
        b[closing_ + i] = closing
        b[force_ + i] = force
        b[torque_ + i] = fma(force, fma(b[friction_arm + i], rubbing, cutting), b[torque_ + i])

"""
ITERATION = """    for i in packed(W):
        load, load_slope, g, r, slope, step = newton_step(
            b[torque_ + i], b[w_n + i], b[relax + i] * b[per_bit_inertia + i] * b[cutting_arm + i], b[force_ + i],
            b[surface_amplitude + i] * b[lobes_ + i] * b[cosine_ + i], b[v_n + i], b[closing_factor + i],
            b[threshold + i], b[per_threshold_width + i], b[slow_square + i], b[smoothing + i], b[creep_start + i],
            b[creep_root + i], b[flat_root + i],
        )
        b[torque_ + i] = max(b[torque_ + i] + step, 0.0)
"""


@inlined
def newton_step(  # type: ignore[no-untyped-def]
    x,
    omega_free,
    relaxed,
    elastic,
    surface_slope,
    v,
    closing_factor,
    threshold,
    per_threshold_width,
    slow_square,
    eps,
    creep_start,
    creep_root,
    flat_root,
):
    """One Newton iteration for the bit speed at ``x``, which is tau where the bit
    creeps (``creep_start`` > 0) and |omega| elsewhere.

    ``omega_free`` is the bit speed without this torque [rad/s], ``relaxed`` the stage's
    relaxation time times the arm of cutting over the bit's inertia, ``elastic`` the
    rock's elastic force [N], ``surface_slope`` d(surface height)/d(bit angle) [m/rad],
    ``v`` the bit's axial velocity [m/s], ``eps`` the smoothing [s/rad]; the other
    arguments are lane parameters. Returns the load on the cutters, its derivative by
    |omega|, g, r, the derivative of load g r by x, and the step of x."""
    creeps = creep_start > 0.0
    sqrt_speed = fma(x, x, creep_start)
    speed = sqrt_speed * sqrt_speed if creeps else x
    dspeed = 4.0 * x * sqrt_speed if creeps else 1.0
    square = fma(speed, speed, slow_square)
    # g, its slope and 1 / square, with one division.
    scaled = eps * speed
    one_plus_square = fma(scaled, scaled, 1.0)
    numerator, denominator, base = direction_reduced(scaled, 1.0)
    inverse = 1.0 / (denominator * one_plus_square * square)
    g = direction_joined(scaled, numerator * one_plus_square * square * inverse, base)
    dg = TWO_OVER_PI * eps * (denominator * square * inverse)
    per_square = denominator * one_plus_square * inverse
    per_tau = creep_root * np.sqrt(np.sqrt(per_square))
    r = per_tau * x if creeps else flat_root
    dr = per_tau * fma(-0.5 * x * speed, dspeed * per_square, 1.0) if creeps else 0.0
    load, load_slope = cutting_load(
        speed,
        elastic,
        -surface_slope if omega_free < 0.0 else surface_slope,
        v,
        closing_factor,
        threshold,
        per_threshold_width,
    )
    slope = fma(r * dspeed, fma(load, dg, load_slope * g), load * g * dr)
    residual = fma(-relaxed, load * g * r, abs(omega_free) - speed)
    derivative = fma(relaxed, slope, dspeed)
    # The slope is left out where the load falls too fast with speed for the step.
    derivative = derivative if derivative > 0.1 * dspeed else dspeed
    return load, load_slope, g, r, slope, residual / max(derivative, 1e-300)


@inlined
def cutting_load(  # type: ignore[no-untyped-def]
    omega, elastic, surface_slope, v, closing_factor, threshold, per_threshold_width
):
    """The load on the cutters [N], the rock's force times the share that cuts, at a bit
    speed ``omega`` [rad/s], and its derivative by that speed. The other arguments are
    those of :func:`newton_step`."""
    damped = fma(closing_factor, fma(surface_slope, omega, -v), 1.0)
    force, slope = (
        elastic * max(damped, 0.0),
        elastic * closing_factor * surface_slope if damped > 0.0 else 0.0,
    )
    share = (force - threshold) * per_threshold_width
    cutting = min(max(share, 0.0), 1.0)
    return force * cutting, fma(
        slope,
        cutting,
        force * (per_threshold_width * slope if (share > 0.0) and (share < 1.0) else 0.0),
    )


MAIN = """
    # The flow of the mud; the bit's contact with the rock.
    for i in packed(W):
        pulse, _ = sincos(b[pulsation_rate + i] * b[time_ + i])
        flow = fma(b[pulsation + i], pulse, b[flow_ + i])
        b[pipe_up + i] = flow * b[per_pipe_annulus + i]
        b[pipe_down + i] = flow * b[per_pipe_bore + i]
        b[collar_up + i] = flow * b[per_collar_annulus + i]
        b[collar_down + i] = flow * b[per_collar_bore + i]
        BIT
    # The ends and the junction of pipe and collars: their masses and inertias differ
    # from those of the nodes within.
    for i in packed(W):
        u, v = b[u_0 + i], b[v_0 + i]
        x, y = b[pipe_up + i] - v, b[pipe_down + i] + v
        drag = fma(b[pipe_annulus + i], x * abs(x), -fma(b[pipe_bore + i], y * abs(y), b[pipe_mean + i]))
        pull = b[pipe_axial + i] * fma(b[axial_time + i], b[v_0 + 2 * W + i] - v, b[u_0 + 2 * W + i] - u)
        hoist = fma(b[top_stiffness + i], u, b[top_damping + i] * v) * b[per_top_mass + i]
        b[a_0 + i] = fma(b[top_share + i], fma(2.0, pull, drag), -hoist)
    for i in packed(W):
        u, v = b[u_j + i], b[v_j + i]
        x, y = b[pipe_up + i] - v, b[pipe_down + i] + v
        drag = fma(b[pipe_annulus + i], x * abs(x), -fma(b[pipe_bore + i], y * abs(y), b[pipe_mean + i]))
        pull = b[pipe_axial + i] * fma(b[axial_time + i], b[v_j - 2 * W + i] - v, b[u_j - 2 * W + i] - u)
        above = b[joint_pipe_share + i] * fma(2.0, pull, drag)
        x, y = b[collar_up + i] - v, b[collar_down + i] + v
        drag = fma(b[collar_annulus + i], x * abs(x), -fma(b[collar_bore + i], y * abs(y), b[collar_mean + i]))
        pull = b[collar_axial + i] * fma(b[axial_time + i], b[v_j + 2 * W + i] - v, b[u_j + 2 * W + i] - u)
        b[a_j + i] = fma(b[joint_collar_share + i], fma(2.0, pull, drag), above)
    for i in packed(W):
        u, v = b[u_n + i], b[v_n + i]
        x, y = b[collar_up + i] - v, b[collar_down + i] + v
        drag = fma(b[collar_annulus + i], x * abs(x), -fma(b[collar_bore + i], y * abs(y), b[collar_mean + i]))
        pull = b[collar_axial + i] * fma(b[axial_time + i], b[v_n - 2 * W + i] - v, b[u_n - 2 * W + i] - u)
        bit_load = (b[force_ + i] - b[wob + i]) * b[per_bit_mass + i]
        b[a_n + i] = fma(b[bit_share + i], fma(2.0, pull, drag), bit_load)
    DRIVE
    for i in packed(W):
        th, w = b[th_j + i], b[w_j + i]
        above = b[pipe_torsional + i] * fma(b[torsional_time + i], b[w_j - 2 * W + i] - w, b[th_j - 2 * W + i] - th)
        above = fma(2.0, above, -(b[pipe_drag + i] * w))
        below = b[collar_torsional + i] * fma(b[torsional_time + i], b[w_j + 2 * W + i] - w, b[th_j + 2 * W + i] - th)
        below = fma(2.0, below, -(b[collar_drag + i] * w))
        b[alpha_j + i] = fma(b[joint_pipe_inertia_share + i], above, b[joint_collar_inertia_share + i] * below)
    for i in packed(W):
        th, w = b[th_n + i], b[w_n + i]
        pull = b[collar_torsional + i] * fma(b[torsional_time + i], b[w_n - 2 * W + i] - w, b[th_n - 2 * W + i] - th)
        rock = b[torque_ + i] * b[per_bit_inertia + i]
        b[alpha_n + i] = fma(b[bit_inertia_share + i], fma(2.0, pull, -(b[collar_drag + i] * w)), -rock)
"""


MOTOR = """    for i in packed(W):
        th, w, current = b[th_0 + i], b[w_0 + i], b[I_ + i]
        pull = b[pipe_torsional + i] * fma(b[torsional_time + i], b[w_0 + 2 * W + i] - w, b[th_0 + 2 * W + i] - th)
        motor_acceleration = fma(b[motor + i], current, -(b[table_damping + i] * w)) * b[per_drive_inertia + i]
        b[alpha_0 + i] = fma(b[drive_share + i], fma(2.0, pull, -(b[pipe_drag + i] * w)), motor_acceleration)
        speed = b[set_speed + i]
        law = fma(b[gain_lag + i], th, fma(b[gain_drive_speed + i], w - speed,
              fma(b[gain_twist + i], b[th_n + i] - b[steady_twist + i],
              fma(b[gain_bit_speed + i], b[w_n + i] - speed, b[gain_current + i] * (current - b[steady_current + i])))))
        law = law if b[time_ + i] >= b[on_at + i] else 0.0
        voltage_drop = fma(b[resistance + i], current - b[steady_current + i], b[motor + i] * (w - speed))
        b[current_rate + i] = -(law + voltage_drop) * b[per_inductance + i]
"""

# The top of a drive by torque, which has no current: its rate is zero.
TORQUE = """    for i in packed(W):
        th, w, speed = b[th_0 + i], b[w_0 + i], b[set_speed + i]
        pull = b[pipe_torsional + i] * fma(b[torsional_time + i], b[w_0 + 2 * W + i] - w, b[th_0 + 2 * W + i] - th)
        law = fma(b[drive_stiffness + i], th, fma(b[drive_damping + i], w - speed,
              fma(b[twist_gain + i], b[th_n + i] - th, b[speed_gain + i] * (b[w_n + i] - speed))))
        torque = min(max(-law, b[torque_least + i]), b[torque_most + i])
        rate = fma(b[half_inertia + i], fma(2.0, pull, -(b[pipe_drag + i] * w)), torque) * b[per_drive_inertia + i]
        b[alpha_0 + i] = rate if b[time_ + i] >= b[on_at + i] else 0.0
        b[current_rate + i] = 0.0
"""


@lru_cache
def make_right_hand_side(lanes: int, rows: Rows, pipes: int, collars: int, by_torque: int) -> Any:
    """The compiled right-hand side for these numbers of lanes and of segments of pipe
    and collar, in a buffer of these ``rows``; the drive is one by torque, or the
    electric motor. The cutting torque is implicit where ``rows.implicit`` says so."""
    W, last = lanes, pipes + collars
    place = {
        name: W * (rows.parameter + i)
        for i, name in enumerate(BY_TORQUE if by_torque else PARAMETERS)
    }
    place |= {name: W * (rows.aux_now + i) for i, name in enumerate(AUX)}
    place |= {"time_": W * rows.stage_time, "phase_": W * rows.phase, "W": W}
    place |= {"relax": W * rows.relax, "falling": W * rows.falling, "push": W * rows.push}
    for word, node in (("0", 0), ("j", pipes), ("n", last)):
        for name, first, slope in (("u v a", 0, 0), ("th w alpha", 2 * (last + 1), last + 1)):
            position, velocity, rate = name.split()
            place[f"{position}_{word}"] = W * (rows.stage + first + 2 * node)
            place[f"{velocity}_{word}"] = W * (rows.stage + first + 2 * node + 1)
            place[f"{rate}_{word}"] = W * (rows.acceleration + slope + node)
    place["I_"] = W * (rows.stage + 4 * (last + 1))
    place["current_rate"] = W * (rows.acceleration + 2 * (last + 1))
    helpers = {
        name: inlined(define(name, f"W = {W}\n{HELPERS}", fma=fma))
        for name in ("axial_node", "torsional_node")
    }
    lines = []
    for node in range(1, last):
        if node == pipes:
            continue
        part = "pipe" if node < pipes else "collar"
        u, th = W * (rows.stage + 2 * node), W * (rows.stage + 2 * (last + 1) + 2 * node)
        a, alpha = W * (rows.acceleration + node), W * (rows.acceleration + last + 1 + node)
        words = ("axial", "annulus", "bore", "up", "down", "mean")
        K, annulus, bore, up, down, mean = (place[f"{part}_{word}"] for word in words)
        lines += [
            f"    axial_node(b, {u}, {a}, {K}, {place['axial_time']}, {annulus}, {bore}, {up}, "
            f"{down}, {mean})",
            f"    torsional_node(b, {th}, {alpha}, {place[f'{part}_torsional']}, "
            f"{place['torsional_time']}, "
            f"{place[f'{part}_drag']})",
        ]
    main = MAIN.replace(
        "        BIT\n",
        BIT_IMPLICIT.replace("ITERATIONS", ITERATIONS * ITERATION) if rows.implicit else BIT,
    )
    main = main.replace("    DRIVE\n", TORQUE if by_torque else MOTOR)
    text = f"{constants(**place)}def right_hand_side(b):{main}" + "\n".join(lines) + "\n"
    known = {"np": np, "fma": fma, "sincos": sincos, "exp2": exp2, "direction": direction}
    if rows.implicit:
        known |= {
            "first_slip": first_slip,
            "newton_step": newton_step,
            "cutting_load": cutting_load,
        }
    return compiled(BUFFER)(define("right_hand_side", text, **known, **helpers))


@lru_cache
def make_contact(
    lanes: int, rows: Rows, place: int, pipes: int, collars: int, by_torque: int, *implicit: int
) -> Any:
    """The compiled function that stores value, slope and second derivative of the
    interference of bit and rock at the end of the step in the observer's rows at
    ``place``."""
    W, last = lanes, pipes + collars
    parameter = {
        name: W * (rows.parameter + i)
        for i, name in enumerate(BY_TORQUE if by_torque else PARAMETERS)
    }
    aux = {name: W * (rows.aux_now + i) for i, name in enumerate(AUX)}
    sine_, cosine_, interference_, closing_ = (
        aux[name] for name in ("sine_", "cosine_", "interference_", "closing_")
    )
    amplitude_, lobes_ = parameter["surface_amplitude"], parameter["lobes_"]
    speed_ = W * (rows.stage + 2 * (last + 1) + 2 * last + 1)
    axial_, angular_ = W * (rows.acceleration + last), W * (rows.acceleration + 2 * last + 1)
    value_, rate_, curvature_ = (W * (rows.observer + place + k) for k in range(RATES))

    @compiled(BUFFER)
    def rock(b):  # type: ignore[no-untyped-def]
        for i in packed(W):
            lobe_rate = b[lobes_ + i] * b[speed_ + i]
            surface = (
                b[lobes_ + i] * b[cosine_ + i] * b[angular_ + i]
                - b[sine_ + i] * lobe_rate * lobe_rate
            )
            b[value_ + i] = b[interference_ + i]
            b[rate_ + i] = b[closing_ + i]
            b[curvature_ + i] = fma(b[amplitude_ + i], surface, -b[axial_ + i])

    return rock
