"""diffrax on the processor: Dopri5 and its PID controller, one vmap over the points,
compiled by XLA, in doubles.

Tried and kept for being the fastest: eight separate states (nearly twice as fast as one
array of eight), batches of 256 (64: a fifth slower, 8: half), no saved steps but the
last, contact forces with selects (under vmap a branch computes both sides anyway). The
states are in units of their scales, so that one scalar tolerance is the vector one. The
lanes of a batch go on together until the last has ended.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmarks.peers import NO_OBSERVERS, MissingPeer, Result, Stopwatch
from benchmarks.workload import Problem


class Diffrax:
    def __init__(self, batch: int = 256) -> None:
        try:
            import diffrax
            import jax
        except ImportError as error:
            raise MissingPeer("pip install jax diffrax") from error
        jax.config.update("jax_enable_x64", True)
        self.batch = batch
        self.name = f"diffrax Dopri5, vmap of up to {batch}"
        self.lacks = f"{NO_OBSERVERS}; compile time left out; integral controller"
        self._solve = _compile(jax, diffrax)
        self._warm: set[int] = set()

    def run(self, problem: Problem, rtol: float) -> Result:
        n = len(problem)
        order = np.resize(np.arange(n), -(-n // self.batch) * self.batch) if n > self.batch else np.arange(n)
        groups = order.reshape(-1, min(self.batch, n))
        scaled = problem.initial / problem.state_scales
        args = [
            (tuple(problem.constants[g].T), tuple(problem.state_scales[g].T), problem.first_step[g], tuple(scaled[g].T))
            for g in groups
        ]
        if groups.shape[1] not in self._warm:
            self._solve(*args[0], 1e-3, rtol)[1].block_until_ready()
            self._warm.add(groups.shape[1])
        with Stopwatch() as watch:
            out = [self._solve(*a, problem.duration, rtol) for a in args]
            for _, count in out:
                count.block_until_ready()
        # The last group is filled up with points done before: they cost, but are
        # counted once.
        ends = np.concatenate([np.stack(end, axis=1) for end, _ in out])[:n] * problem.state_scales
        steps = int(np.concatenate([np.asarray(count) for _, count in out])[:n].sum())
        share = n / len(order)
        return Result(watch.wall * share, watch.cpu * share, 6 * steps, steps, ends)


def _compile(jax: Any, diffrax: Any) -> Any:
    jnp = jax.numpy

    def coefficient(speed: Any, smoothing: Any, decay: Any, rise: Any, dynamic: Any) -> Any:
        return 2 / np.pi * jnp.arctan(smoothing * speed) * (rise / (1.0 + decay * jnp.abs(speed)) + dynamic)

    def derivative(t: Any, scaled: Any, given: Any) -> Any:
        k, state_scales = given
        x, vx, y, vy, z, vz, twist, omega = (value * size for value, size in zip(scaled, state_scales, strict=True))
        (
            phase,
            drive,
            wob,
            per_m_l,
            per_J,
            per_m_a,
            q,
            k_bend,
            soft_F,
            soft_T,
            c_h,
            c_a,
            k_a,
            c_t,
            k_t,
            gap,
            k_w,
            R_c,
            eps_w,
            tau_w,
            rise_w,
            mu_w,
            k_c,
            s0,
            eps_b,
            tau_b,
            rise_b,
            mu_b,
            _,
        ) = k
        phi = twist + phase + drive * t
        s, c = jnp.sin(phi), jnp.cos(phi)
        force = k_c * jnp.maximum(s0 * s * (4.0 * c * c - 1.0) - z, 0.0)
        torque = force * coefficient(omega, eps_b, tau_b, rise_b, mu_b)
        r = jnp.sqrt(x * x + y * y)
        per_r = 1.0 / jnp.maximum(r, 1e-30)
        normal = k_w * jnp.maximum(r - gap, 0.0)
        slip = omega * R_c + (x * vy - y * vx) * per_r
        friction = normal * coefficient(slip, eps_w, tau_w, rise_w, mu_w)
        radial = normal * per_r + k_bend - soft_F * force - soft_T * torque
        tangential = friction * per_r
        drag = c_h * jnp.sqrt(vx * vx + vy * vy)
        fx = tangential * y - radial * x - drag * vx
        fy = -tangential * x - radial * y - drag * vy
        moment = c_t * omega + k_t * twist + friction * R_c + torque
        alpha = -(moment + q * (fy * c - fx * s)) * per_J
        slopes = (
            vx,
            q * (omega * omega * c + alpha * s) + fx * per_m_l,
            vy,
            q * (omega * omega * s - alpha * c) + fy * per_m_l,
            vz,
            (force - wob - c_a * vz - k_a * z) * per_m_a,
            omega - drive,
            alpha,
        )
        return tuple(slope / size for slope, size in zip(slopes, state_scales, strict=True))

    term = diffrax.ODETerm(derivative)

    def one(constants: Any, state_scales: Any, first: Any, scaled: Any, duration: Any, rtol: Any) -> Any:
        controller = diffrax.PIDController(rtol=rtol, atol=rtol)
        solution = diffrax.diffeqsolve(
            term,
            diffrax.Dopri5(),
            0.0,
            duration,
            jnp.minimum(first, duration),
            scaled,
            args=(constants, state_scales),
            stepsize_controller=controller,
            saveat=diffrax.SaveAt(t1=True),
            max_steps=None,
            throw=False,
        )
        return tuple(y[0] for y in solution.ys), solution.stats["num_steps"]

    return jax.jit(jax.vmap(one, in_axes=(0, 0, 0, 0, None, None)))
