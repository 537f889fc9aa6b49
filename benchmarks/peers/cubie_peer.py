"""cubie, which integrates batches on a GPU of NVIDIA: the map of ``benchmarks.gpu`` to its
final states, with the right-hand side of the peers as its equation strings.

A warp steps together there, so runs of like length stand side by side: fast ones first, as
nsdrill has them. cubie observes nothing here.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.workload import CONSTANTS, STATES, Array, Problem, problem_of

NAMES = ("x", "vx", "y", "vy", "z", "vz", "twist", "omega")
SWEPT = ("drive", "wob", "mu_b")
EQUATIONS = (
    "phi = twist + drive*t",
    "s = sin(phi)",
    "c = cos(phi)",
    "force = k_c*max(s0*s*(4*c*c - 1) - z, 0)",
    "torque = force*per_pi*atan(eps_b*omega)*(rise_b/(1 + tau_b*abs(omega)) + mu_b)",
    "r = sqrt(max(x*x + y*y, 1e-60))",
    "per_r = 1/r",
    "normal = k_w*max(r - gap, 0)",
    "slip = omega*R_c + (x*vy - y*vx)*per_r",
    "friction = normal*per_pi*atan(eps_w*slip)*(rise_w/(1 + tau_w*abs(slip)) + mu_w)",
    "radial = normal*per_r + k_bend - soft_F*force - soft_T*torque",
    "tangential = friction*per_r",
    "drag = c_h*sqrt(vx*vx + vy*vy)",
    "fx = tangential*y - radial*x - drag*vx",
    "fy = -tangential*x - radial*y - drag*vy",
    "alpha = -(c_t*omega + k_t*twist + friction*R_c + torque + q*(fy*c - fx*s))*per_J",
    "dx = vx",
    "dvx = q*(omega*omega*c + alpha*s) + fx*per_m_l",
    "dy = vy",
    "dvy = q*(omega*omega*s - alpha*c) + fy*per_m_l",
    "dz = vz",
    "dvz = (force - wob - c_a*vz - k_a*z)*per_m_a",
    "dtwist = omega - drive",
    "domega = alpha",
)
# As documented; and what was fastest of what was tried: a PI controller and fewer registers.
VARIANTS: dict[str, dict[str, Any]] = {
    "as documented": {},
    "PI controller, 168 registers": {
        "step_controller": "pi",
        "integral_gain": 0.78,
        "proportional_gain": 0.24,
        "min_step_shrink": 0.125,
        "max_step_growth": 8.0,
        "max_registers": 168,
    },
}


def race(told: Callable[..., None], gpu: Any, quick: bool) -> None:
    """The map by cubie, in each variant, and by nsdrill: medians of three runs."""
    try:
        import cubie
    except ImportError as error:
        told(missing=f"cubie: {error}")
        return
    from benchmarks.gpu import bare, columns_of, study, work_of

    turns = range(1 if quick else 3)
    work = work_of(study(*((2, 3) if quick else (400, 340)), *((0.01, 0.01) if quick else (24.99, 0.01))))
    problem = problem_of(work)
    order = np.argsort(-problem.constants[:, CONSTANTS.index("drive")], kind="stable")
    problem = problem.part(order)
    for name, settings in VARIANTS.items():
        began = time.perf_counter()
        solver, names = _solver(cubie, problem, settings)
        solve = _solving(solver, names, problem)
        end = solve()
        first = time.perf_counter() - began
        seconds = []
        for _ in turns:
            began = time.perf_counter()
            end = solve()
            seconds.append(time.perf_counter() - began)
        told(
            variant=name,
            version=getattr(cubie, "__version__", ""),
            points=len(problem),
            first=first,
            seconds=seconds,
            median=float(np.median(seconds)),
            finite=int(np.isfinite(end).all(axis=1).sum()),
            mean=end.mean(axis=0),
            std=end.std(axis=0),
        )
        solver.close()
    seconds = [bare(work, gpu)[0] for _ in turns]
    end = columns_of(work, gpu)[0]["final_state"][:, :STATES]
    told(
        variant="nsdrill", seconds=seconds, median=float(np.median(seconds)), mean=end.mean(axis=0), std=end.std(axis=0)
    )


def _solver(cubie: Any, problem: Problem, settings: dict[str, Any]) -> tuple[Any, list[str]]:
    """A solver whose constants are compiled in, but for those that differ between runs; and
    the order in which it has the states."""
    numbers = dict(zip(CONSTANTS, problem.constants[0], strict=True))
    assert numbers["lobes"] == 3.0
    assert not problem.constants[:, CONSTANTS.index("phase")].any()
    constants = {name: float(value) for name, value in numbers.items() if name not in (*SWEPT, "phase", "lobes")}
    system = cubie.create_ODE_system(
        list(EQUATIONS),
        precision=np.float64,
        states=dict(zip(NAMES, map(float, problem.initial[0]), strict=True)),
        parameters={**{name: float(numbers[name]) for name in SWEPT}, **constants, "per_pi": 2.0 / np.pi},
        swept_parameters=list(SWEPT),
        name="drillstring",
    )
    scales = problem.state_scales[len(problem) // 2]
    names = list(system.layout.state_names)
    atol = 1e-6 * np.array([scales[NAMES.index(name)] for name in names])
    first = float(np.median(problem.first_step))
    common = {"algorithm": "tsit5", "atol": atol, "rtol": 1e-6, "dt": first, "dt_min": 1e-12, "dt_max": 1.0}
    return cubie.Solver(system, **common, output_types=["state"], **settings), names


def _solving(solver: Any, names: list[str], problem: Problem) -> Callable[[], Array]:
    """A function that integrates all runs and gives their final states [n, 8]."""
    starts = {name: problem.initial[:, i] for i, name in enumerate(NAMES)}
    swept = {name: problem.constants[:, CONSTANTS.index(name)] for name in SWEPT}
    order = [names.index(name) for name in NAMES]

    def solve() -> Array:
        found = solver.solve(
            starts, swept, duration=problem.duration, grid_type="verbatim", nan_error_trajectories=False
        )
        return np.asarray(found.state[-1])[order].T

    return solve
