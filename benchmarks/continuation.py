"""What one evaluation of continuation costs, beside the same on SciPy's DOP853 with a
compiled right-hand side.

An evaluation of a motion over one lobe is its end, its monodromy and its derivative by
the rotary speed. In lanes it is 8 runs with tangents and 2 without; SciPy integrates
the motion and, for central differences, 18 neighbours. Both are timed in turns in one
process, as CPU time. Run it with ``python -m benchmarks.continuation``.
"""

from __future__ import annotations

import time
from statistics import median

import numpy as np
from scipy.integrate import solve_ivp

import nsdrill
from nsdrill.app.following.seeding import continuation_setup
from nsdrill.orbit.flow import DIFFERENCE_STEP, Legs, advance
from nsdrill.orbit.newton import corrected_at_parameter
from nsdrill.orbit.periodic import Periodic
from nsdrill.orbit.shooting import rotated

SPEED, ROUNDS = 3.5, 5
STUDY = {
    "operation": {"depth": "5000 m", "wob": "22.24 kN"},
    "continue": {"along": "rotary_speed", "from": "3 rad/s", "to": "4 rad/s"},
}


def main() -> None:
    setup = continuation_setup(nsdrill.load_study(STUDY))
    flow = setup.flow(("rotary_speed",), (0.1,), 1)
    values = np.array([[SPEED]])
    table = setup.model.pack(setup.values(values, ("rotary_speed",)), setup.study.thresholds)
    state = setup.model.starts(setup.values(values, ("rotary_speed",)), 0)[0, :-1]
    fold = 2 * np.pi / 3
    for _ in range(40):  # let it settle
        ends = flow.run(Legs(state[None], np.zeros(1), np.array([25 * fold / SPEED]), values, np.zeros(1, bool)))
        state = rotated(flow.symmetry, ends.state[0], -25 * fold)
    problem = Periodic.at(flow, 1, values[0], state)

    def job():  # type: ignore[no-untyped-def]
        return (yield from corrected_at_parameter(problem, problem.unknowns(state[None], SPEED)))

    point = advance(flow, {0: job()})[0]
    state = point.found.state
    around = problem.values_around(point.x, DIFFERENCE_STEP)
    legs = problem.legs(np.stack([problem.states(point.x)] * 3), around, np.zeros(0), (True, False, False))

    right_hand_side, rows = (setup.variant.right_hand_side(1), setup.variant.rows())
    buffer = np.zeros(rows.total)
    buffer[rows.parameter : rows.parameter + rows.parameters] = table[0]
    frame_rate = setup.variant.frame_rates(table)[0]

    def slopes(t, y):  # type: ignore[no-untyped-def]
        buffer[rows.stage : rows.stage + 8] = y
        buffer[rows.stage_time] = t
        right_hand_side(buffer)
        made = np.empty(8)
        made[0::2] = y[1::2] + frame_rate
        made[1::2] = buffer[rows.acceleration : rows.acceleration + 4]
        return made

    def scipy() -> np.ndarray:
        state_scales = flow.state_scales(values[0])[0]
        ends = []
        for j in range(19):  # the motion, each state and the speed to both sides
            start = state.copy()
            if 0 < j < 17:
                start[(j - 1) // 2] += (1 if j % 2 else -1) * 1e-3 * state_scales[(j - 1) // 2]
            found = solve_ivp(slopes, (0.0, fold / SPEED), start, "DOP853", rtol=1e-11, atol=1e-11 * state_scales)
            ends.append(found.y[:, -1])
        return np.array(ends)

    ours, theirs = [], []
    for _ in range(ROUNDS):
        begun = time.process_time()
        for _ in range(20):
            flow.run(legs)
        ours.append((time.process_time() - begun) / 20)
        begun = time.process_time()
        ends = scipy()
        theirs.append(time.process_time() - begun)
    own = flow.run(legs).state[0]
    print(
        f"difference of the ends, in natural scales: "
        f"{np.max(np.abs((ends[0] - own) / flow.state_scales(values[0])[0])):.1e}"
    )
    print(f"one evaluation: {1e3 * median(ours):.2f} ms; on DOP853 {1e3 * median(theirs):.0f} ms")
    print(f"ratio {median(theirs) / median(ours):.0f}")


if __name__ == "__main__":
    main()
