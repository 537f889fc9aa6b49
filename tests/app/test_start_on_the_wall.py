"""A run that rolls along the wall ends in it, a little deeper than the gap; another run
may begin there."""

from __future__ import annotations

import numpy as np
import pytest

from nsdrill import StudyError
from nsdrill.app.run import run_in_memory
from nsdrill.models.christoforou_yigit.columns import STATE_NAMES
from nsdrill.study import parse_study

# 67 kN buckle the span, so the collar leans on the wall, and at 10 rad/s it rolls all
# the time.
ROLLING = """\
operation: {depth: 3000 m, wob: 66.72 kN}
sweep: {rotary_speed: [10 rad/s]}
simulation: {transient: 20 s, observe: 5 s}
record: {peaks: 4}
"""
UNITS = {
    "x": "m",
    "y": "m",
    "z": "m",
    "vx": "m/s",
    "vy": "m/s",
    "vz": "m/s",
    "twist": "rad",
    "drive_angle": "rad",
    "bit_speed": "rad/s",
}


def test_the_final_state_of_a_rolling_run_is_the_start_of_another() -> None:
    first = run_in_memory(parse_study(ROLLING))
    assert first["wall_contact_fraction"].item() == 1.0
    final = first["final_state"].ravel()
    gap = (0.381 - 0.2286) / 2
    assert np.hypot(final[0], final[2]) > gap + 1e-3
    given = [f"initial.{name}={value!r} {UNITS[name]}" for name, value in zip(STATE_NAMES, final.tolist(), strict=True)]
    second = run_in_memory(parse_study(ROLLING, "s", [*given, "simulation.transient=0 s"]))
    assert second["initial_state"].tobytes() == first["final_state"].tobytes()
    assert second["wall_contact_fraction"].item() == 1.0
    assert second["rolling_ratio"].item() == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize(
    ("wall", "deepest"),
    # The gap, 76.2 mm, and what 10 MN press: F/k, or (F/k)^(2/3) with the Hertz law.
    [("stiffness: 1 GN/m", 0.0762 + 0.01), ("law: hertz, stiffness: 1e10 N/m^1.5", 0.0762 + 0.01)],
)
def test_how_deep_in_the_wall(wall: str, deepest: float) -> None:
    parse_study(f"{ROLLING}well: {{{wall}}}\ninitial: {{x: 0 m, y: {deepest - 1e-6} m}}")
    with pytest.raises(StudyError, match=r"at most 86.2 mm: the gap between collar and wall, 76.2 mm"):
        parse_study(f"{ROLLING}well: {{{wall}}}\ninitial: {{x: 0 m, y: {deepest + 1e-6} m}}")
