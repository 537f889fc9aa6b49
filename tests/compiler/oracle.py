"""What lane functions do with given buffers, by the compiler of this process: run as a
program with ``NSDRILL_COMPILER=numba`` it is the oracle for the native one.

``python oracle.py FILE LANES NAME...`` writes the buffers after every call to FILE, and
beside it the results of a run, all with the functions that are compiled once.
"""

import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from nsdrill.abi import CLOSES, CONTROL, HALVES, OPENS

CONFIGS = Path(__file__).parents[2] / "configs"
# A study, and what is changed in it.
CASES: dict[str, tuple[str, dict[str, Any]]] = {
    path.stem: (path.name, {}) for path in sorted(CONFIGS.glob("*.yaml"))
} | {
    "exponent": ("fig4_speed_22kN.yaml", {"record.exponent": True}),
    "exponent of segments": ("segments_speed_100kN.yaml", {"record.exponent": True}),
    "exponent of torsion": ("torsional_speed.yaml", {"record.exponent": True}),
    "implicit": ("fig4_speed_22kN.yaml", {"simulation.method": "implicit"}),
    "implicit rotary assembly": ("rotary_assembly.yaml", {"simulation.method": "implicit"}),
    "implicit beam": ("beam_modes_speed.yaml", {"simulation.method": "implicit"}),
    "implicit segments": ("segments_speed_100kN.yaml", {"simulation.method": "implicit"}),
}
VARIANTS = 3  # of a study whose axes are compiled in
TURNS = 30  # steps of every lane


RUN = {
    "sweep.rotary_speed": ["90 rpm", "150 rpm"],
    "record.poincare": 1200,
    "simulation.transient": "5 s",
    "simulation.observe": "720 s",
}


def run(path: Path) -> None:
    """The loop over steps, periods and the 0-1 test included."""
    import nsdrill

    nsdrill.run(CONFIGS / "torsional_speed.yaml", path, set=RUN, workers=1, progress=False)


def works(name: str) -> Iterator[Any]:
    """The work of the variants of a case, each with some of its points."""
    import nsdrill
    from nsdrill.app.experiment import prepare
    from nsdrill.app.running.run import work_of

    file, changes = CASES[name]
    study = nsdrill.load_study(CONFIGS / file, [f"{key}={value}" for key, value in changes.items()])
    work = work_of(prepare(study))
    seen = set()
    for part, points in work.parts(np.arange(work.plan.points)):
        for one, mine in part.by_method(points):
            if one.program not in seen and len(seen) < VARIANTS:
                seen.add(one.program)
                yield one, mine


def functions_of(work: Any, lanes: int) -> dict[str, Any]:
    """The lane functions of a step, and those of models that take a buffer alone."""
    from nsdrill.kernel.steppers import STEPPERS, make_step
    from nsdrill.sweep.work import compiled_parts

    program, model = work.program, work.computed
    parts = compiled_parts(lanes, program)
    found = {
        "step": make_step(STEPPERS[program.stepper], lanes, program.rows),
        "right_hand_side": parts.right_hand_side,
        "observer": parts.observer,
        "marker": parts.marker,
    }
    if model.contacts and program.exponent:
        found["contacts"] = program.variant.contact_functions(lanes, program.variant.observed)
    return found


def outcomes(
    work: Any, points: np.ndarray, lanes: int, made: Callable[[Any], Any] = lambda function: function
) -> Iterator[np.ndarray]:
    """The buffers after each of many calls of the functions of ``work``, each compiled
    by ``made``: at states of its motions, and at others nearby."""
    functions = {name: made(one) for name, one in functions_of(work, lanes).items()}
    rng = np.random.default_rng(1)
    rows = work.program.rows
    batch = work.new_batch(lanes, lanes)
    runs = work.prepare(points[np.linspace(0, len(points) - 1, lanes).astype(int)])
    b, store = batch._buffer, batch._store
    grid = b.reshape(rows.total, lanes)
    fill(grid, rows, runs, batch.settings)
    outcome = np.zeros(work.program.variant.outcome_width(work.record) + 16)
    functions["right_hand_side"](b)
    grid[rows.start_acceleration : rows.start_acceleration + rows.slopes] = grid[
        rows.acceleration : rows.acceleration + rows.slopes
    ]
    for turn in range(TURNS):
        if turn == 2:
            for lane in range(lanes):
                functions["marker"](b, store, lane, OPENS, outcome, 0)
            grid[rows.observing] = 1.0
        functions["step"](b, functions["right_hand_side"], functions["observer"], store)
        yield b.copy()
        yield store.copy()
        if turn % 3 == 2:  # what the observers see is then no smooth motion
            states = grid[rows.stage : rows.stage + rows.own]
            states *= rng.normal(1.0, 0.1, states.shape)
        for name in ("right_hand_side", "contacts"):  # anywhere
            if name in functions:
                shaken = b.copy()
                some = shaken.reshape(rows.total, lanes)[: rows.stage_time]
                some += rng.normal(0.0, 0.3, some.shape) * np.abs(some)
                functions[name](shaken)
                yield shaken
        for mark in (HALVES, CLOSES) if turn == TURNS - 1 else ():
            for lane in range(lanes):
                functions["marker"](b, store, lane, mark, outcome, 0)
            yield outcome.copy()
            yield b.copy()


def fill(grid: np.ndarray, rows: Any, runs: Any, settings: dict[str, float]) -> None:
    """As the loop over steps fills the columns of new runs."""
    grid[rows.parameter : rows.parameter + rows.parameters] = runs.parameters.T
    for row in (rows.stage, rows.start):
        grid[row : row + rows.states] = runs.initial[:, :-1].T
    grid[rows.phase] = runs.initial[:, -1]
    grid[rows.frame_rate : rows.frame_rate + rows.slopes] = runs.frame_rates.T
    grid[rows.scale : rows.scale + rows.states] = runs.state_scales.T
    grid[rows.step], grid[rows.moves] = runs.first_step, 0.0
    control = {name: rows.control + number for number, name in enumerate(CONTROL)}
    grid[control["proposed"]] = runs.first_step
    grid[control["mark_time"]] = 1e9
    grid[control["per_rtol"]] = settings["per_rtol"]
    grid[control["least_step"]] = 1e-12
    grid[control["limit"]], grid[control["running"]] = 1e9, 1.0


def main(file: str, lanes: str, *names: str) -> None:
    found = {
        f"{name}|{part}|{number}": buffer
        for name in names
        for part, (work, points) in enumerate(works(name))
        for number, buffer in enumerate(outcomes(work, points, int(lanes)))
    }
    np.savez(file, **found)
    run(Path(file).with_suffix(".h5"))


if __name__ == "__main__":
    main(*sys.argv[1:])
