"""Implicit friction: the deviation of a stage. Its slopes and velocities are in
``models/test_deviations.py``, beside those of other models."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from strings import MAIN, PARAMETERS, pack

from nsdrill.models.christoforou_yigit.columns import Options, options_of
from nsdrill.models.christoforou_yigit.parameters import Parameters
from nsdrill.models.variant import variant_of

W, SPREAD = 8, np.array([0.08, 0.3, 0.08, 0.3, 2e-3, 0.05, 1.0, 3.0, 0.3, 0.5, 1.0, 500.0])


def string(**changes: Any) -> Parameters:
    base = Parameters()
    return replace(
        base,
        well=replace(base.well, law=changes.get("wall", "linear"), axial_friction=changes.get("along", False)),
        stabilizer=replace(base.stabilizer, clearance=changes.get("clearance")),
        drive=replace(base.drive, **changes.get("drive", {})),
    )


def buffer_of(parameters: Parameters, options: Options, seed: int, relax: float, tangent: bool = False) -> Any:
    """A buffer with random states, some of them on the wall, and its rows."""
    rows = variant_of(MAIN, options).rows(6 if tangent else 0, tangent=tangent)
    b = np.zeros((rows.total, W))
    rng = np.random.default_rng(seed)
    table = pack(parameters, np.full(W, 2000.0), np.full(W, 60e3), np.full(W, 5.0))
    b[rows.parameter : rows.parameter + table.shape[1]] = table.T
    own = len(variant_of(MAIN, options).states)
    b[rows.stage : rows.stage + own] = rng.normal(size=(own, W)) * SPREAD[:own, None]
    b[rows.phase], b[rows.stage_time] = 1.0, 0.3
    if tangent:
        b[rows.stage + own : rows.stage + 2 * own] = rng.normal(size=(own, W)) * SPREAD[:own, None]
    b[rows.relax] = relax
    return b, rows


@pytest.mark.parametrize(
    "case",
    [
        {},
        {"wall": "hertz"},
        {"drive": {"kind": "soft_torque"}},
        {"clearance": 0.03},
        {"along": True},
        {"along": True, "clearance": 0.03},
    ],
    ids=["main", "hertz", "drive", "stabilisers", "along", "stabilisers along"],
)
def test_the_deviation_of_a_stage_is_its_derivative(case):
    """Velocities, slopes and pushes of the deviation, against differences of two stages
    1e-6 of it apart, on rock and wall and off them. Newton's method leaves 1e-5 of a
    load, and up to a thousandth of how it changes."""
    parameters = string(**case)
    options = options_of(parameters)._replace(implicit=1)
    b, rows = buffer_of(parameters, options, 11, relax=2e-3, tangent=True)
    own, slopes, pushes, step = rows.own, rows.own_slopes, len(rows.pushed) // 2, 1e-6
    moved = []
    for sign in (1.0, -1.0):
        other, plain = buffer_of(parameters, options, 11, relax=2e-3)
        other[plain.stage : plain.stage + own] = b[rows.stage : rows.stage + own]
        other[plain.stage : plain.stage + own] += sign * step * b[rows.stage + own : rows.stage + 2 * own]
        variant_of(MAIN, options).right_hand_side(W)(other.ravel())
        moved.append(other)
    exact = (moved[0] - moved[1]) / (2 * step)
    # Contacts as they are now.
    angle = b[rows.stage + 6] + 1.0 + 5.0 * 0.3
    rock, wall = rows.observer, rows.observer + 3
    b[rock] = parameters.bit.surface_amplitude * np.sin(parameters.bit.lobes * angle) - b[rows.stage + 4]
    gap = b[rows.parameter + PARAMETERS.index("gap")]
    b[wall] = b[rows.stage] ** 2 + b[rows.stage + 2] ** 2 - gap**2
    for function in (b[wall], b[rock]):
        assert np.any(function > 0.0)
        assert np.any(function < 0.0)
    assert len(MAIN.contacts) == 2
    variant_of(MAIN, options).tangent(W, 0)(b.ravel())
    for mine, theirs in (
        (b[rows.stage + own : rows.stage + 2 * own], exact[plain.stage : plain.stage + own]),
        (
            b[rows.acceleration + slopes : rows.acceleration + 2 * slopes],
            exact[plain.acceleration : plain.acceleration + slopes],
        ),
        (b[rows.push + pushes : rows.push + 2 * pushes], exact[plain.push : plain.push + pushes]),
    ):
        for one, two in zip(mine, theirs, strict=True):
            assert one == pytest.approx(two, rel=3e-3, abs=2e-4 * max(np.abs(two).max(), 1e-6))
