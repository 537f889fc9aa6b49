"""The race is only worth something if all run the same equations: the right-hand side
of the peers against nsdrill."""

import numpy as np
import pytest


def test_scipy_and_nsdrill_reach_the_same_state():
    workload = pytest.importorskip("benchmarks.workload")
    from benchmarks.peers.scipy_peer import Scipy

    work = workload.grid(np.array([2000.0]), np.array([1.0, 3.0, 8.0]), 0.0, 0.5, rtol=1e-9)
    columns, _ = workload.sweep(work, 8)
    problem = workload.problem_of(work)
    end = Scipy("RK45").run(problem, 1e-9).end
    # Both follow the tolerance; half a second is too short for chaos.
    np.testing.assert_array_less(np.abs(end - columns["final_state"][:, :8]) / problem.state_scales, 1e-5)
