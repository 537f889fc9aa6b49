"""Any number of the study as an axis."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from main_model import MAIN, pack
from reference import Case

from nsdrill.kernel.settings import Simulation
from nsdrill.models.christoforou_yigit.coefficients import power
from nsdrill.models.christoforou_yigit.parameters import Initial, Parameters
from nsdrill.models.leaves import leaves, values_at, with_values
from nsdrill.sweep.plan import Plan
from sweep.runs import collect, finish, run_work, same_bits, work_for

OPERATION = {"depth": 5000.0, "wob": 22.24e3, "rotary_speed": 3.0}
SHORT = Simulation(transient=1.0, observe=2.0)


def numbers() -> dict[str, float]:
    return {key: value for key, value, _ in leaves(Parameters()) if isinstance(value, float)}


@pytest.mark.parametrize("key", list(numbers()))
def test_points_along_any_axis_have_the_coefficients_of_single_points(key: str) -> None:
    """Bit for bit, whatever numpy makes of powers of arrays; of what is off by default
    (0), around 1."""
    values = (numbers()[key] or 1.0) * np.random.default_rng(1).uniform(0.7, 1.3, 300)
    operation = {name: np.full(300, value) for name, value in OPERATION.items()}
    together = values_at(Parameters(), Initial(), {**operation, key: values})
    table = pack(together.parameters, *together.operation)
    alone = np.concatenate(
        [pack(with_values(Parameters(), {key: value}), *OPERATION.values()) for value in values.tolist()]
    )
    assert table.tobytes() == alone.tobytes()
    for made in (MAIN.state_scales, MAIN.first_step):
        assert made(table, ()).tobytes() == made(alone, ()).tobytes()


def test_powers_of_arrays_are_those_of_their_numbers() -> None:
    values = np.random.default_rng(2).uniform(0.01, 1.0, (40, 25))
    for exponent in (2, 3, 4):
        assert power(values, exponent).tolist() == [[v**exponent for v in row] for row in values.tolist()]


@pytest.mark.parametrize("procedure", ["same", "up-down"])
def test_a_sweep_over_the_rock_has_the_bits_of_single_runs(procedure: str) -> None:
    """Each point from the state in which it began."""
    rocks = np.array([15e6, 25e6, 60e6])
    axes = {name: np.array([value]) for name, value in OPERATION.items()} | {"bit.rock_stiffness": rocks}
    base = work_for(Case(), SHORT)
    work = replace(base, plan=Plan(axes, procedure, None if procedure == "same" else "bit.rock_stiffness"))
    out = run_work(work)
    for point in range(work.plan.points):
        rock = work.plan.values(np.array([point]))["bit.rock_stiffness"]
        single = replace(
            base,
            parameters=with_values(base.parameters, {"bit.rock_stiffness": float(rock[0])}),
            plan=Plan({name: np.array([value]) for name, value in OPERATION.items()}, "same", None),
        )
        runs = single.prepare(np.array([0]))
        if procedure == "same":
            assert runs.initial.tobytes() == out["initial_state"][point][None].tobytes()
        batch = single.new_batch(8, 1)
        batch.add(np.array([0]), replace(runs, initial=out["initial_state"][point][None]))
        alone = collect(single, finish(single, batch))
        assert same_bits(alone, {name: values[[point]] for name, values in out.items()})
