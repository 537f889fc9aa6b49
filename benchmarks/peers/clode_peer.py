"""clODE: batches of initial value problems in OpenCL, one work item a run; here on the
processor, double precision."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks.peers import SCALAR_TOLERANCE, MissingPeer, Result, Stopwatch
from benchmarks.workload import CONSTANTS, STATES, Problem

SOURCE = Path(__file__).with_name("drillstring.cl")


class Clode:
    def __init__(self) -> None:
        try:
            import clode
        except ImportError as error:
            raise MissingPeer("pip install clode, and an OpenCL runtime (pocl-opencl-icd)") from error
        self.name = "clODE dopri5"
        self.lacks = (
            f"no observers in this mode (its own observers cost extra), no classification; {SCALAR_TOLERANCE}; maximum "
            "norm; tells no step counts"
        )
        self._clode = clode
        names = [*CONSTANTS, *(f"size_{i}" for i in range(STATES))]
        try:
            clode.set_log_level(clode.LogLevel.err)
            self._simulator = clode.Simulator(
                variables={f"y{i}": 0.0 for i in range(STATES)},
                parameters=dict.fromkeys(names, 1.0),
                src_file=str(SOURCE),
                stepper=clode.Stepper.dormand_prince,
                single_precision=False,
                dtmax=1.0,
                max_steps=2_000_000_000,
            )
        except Exception as error:  # whatever the OpenCL runtime throws
            raise MissingPeer(f"an OpenCL runtime that clODE can use: {error}") from error

    def run(self, problem: Problem, rtol: float) -> Result:
        simulator = self._simulator
        simulator.set_ensemble(
            variables=problem.initial / problem.state_scales,
            parameters=np.concatenate([problem.constants, problem.state_scales], axis=1),
        )
        simulator.set_solver_parameters(abstol=rtol, reltol=rtol, dt=float(problem.first_step.min()))
        simulator.set_tspan((0.0, problem.duration))
        with Stopwatch() as watch:
            simulator.transient(update_x0=False)
            end = simulator.get_final_state()
        return Result(
            watch.wall, watch.cpu, None, None, np.asarray(end).reshape(len(problem), STATES) * problem.state_scales
        )
