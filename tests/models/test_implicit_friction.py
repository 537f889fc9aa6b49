"""Implicit friction in models of several masses: the same slopes to rounding,
velocities that agree with loads."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from nsdrill.models.leaves import Values
from nsdrill.models.registry import model_named
from nsdrill.models.responses import Thresholds
from nsdrill.study import parse_study

W, RELAX = 8, 1e-3

BEAM = "model: beam\nwell: {friction: {smoothing: EPS s/m}}\nbit: {friction: {smoothing: EPS s/rad}}"
NINE = ", ".join(f"{{at: {place / 10}}}" for place in range(1, 10))
SEGMENTS = "model: segments\nbit: {cutting: {smoothing: EPS s/rad, speed: live, c2: C2}}"
CASES = {
    "beam": BEAM,
    "beam, few modes": f"{BEAM}\nbeam: {{modes: 2, stations: [{{at: 0.3}}, {{at: 0.5}}, {{at: 0.6}}], torque: cy}}",
    "beam, nine stations": f"{BEAM}\nbeam: {{modes: 2, stations: [{NINE}]}}",
    "beam, one station": f"{BEAM}\nbeam: {{modes: 1, stations: [{{at: 0.5}}]}}",
    "cutting from rest": SEGMENTS.replace("C2", "0.001"),
    "cutting from a speed on": SEGMENTS.replace("C2", "-0.00019"),
}


WALL = "well: {friction: {smoothing: EPS s/m}"
MIXED = {
    **CASES,
    "stabilisers": f"stabilizer: {{clearance: 5 mm}}\n{WALL}}}",
    "friction along the hole": f"{WALL}, axial_friction: true}}",
}


def buffer_of(text: str, implicit: bool, seed: int, relax: float = 0.0) -> Any:
    """(buffer, rows, variant) of random states, about a half of the contacts closed."""
    study = parse_study(text)
    model, rng, at = study.model.dynamics, np.random.default_rng(seed), study.operation
    variant = model.variant(study.parameters)
    variant = model.implicit(variant) if implicit else variant
    rows = model.rows(variant)
    points = Values(study.parameters, study.initial, tuple(np.full(W, v) for v in (at.depth, at.wob, at.rotary_speed)))
    table = model.pack(points, Thresholds())
    b = np.zeros((rows.total, W))
    b[rows.parameter : rows.parameter + rows.parameters] = table.T
    size = model.state_scales(table, variant)
    start = model.starts(points, 0)[:, : rows.own]
    b[rows.stage : rows.stage + rows.own] = (start + rng.normal(size=(W, rows.own)) * size).T
    if study.model.name != "segments":
        b[rows.stage] += rng.choice([0.0, 0.09], W)
    else:
        z = model.states(variant).index("z")
        b[rows.stage + z] -= 15.0 * size[:, z]
    b[rows.phase], b[rows.stage_time] = 1.0, 0.3
    if implicit:
        b[rows.relax] = relax
    return b, rows, model.right_hand_side(W, variant)


def slopes_of(b: np.ndarray, rows: Any) -> np.ndarray:
    return b[rows.acceleration : rows.acceleration + rows.slopes]


@pytest.mark.parametrize("smoothing", ["500", "1e5"])
@pytest.mark.parametrize("case", CASES)
def test_slopes_are_the_same_to_rounding_where_nothing_is_relaxed(case: str, smoothing: str) -> None:
    found = []
    for implicit in (False, True):
        b, rows, function = buffer_of(CASES[case].replace("EPS", smoothing), implicit, 3)
        function(b.ravel())
        found.append(slopes_of(b, rows).copy())
    assert found[1] == pytest.approx(found[0], rel=1e-11, abs=1e-12 * np.abs(found[0]).max())


@pytest.mark.parametrize("smoothing", ["500", "1e5"])
@pytest.mark.parametrize("case", CASES)
def test_the_velocities_of_a_stage_agree_with_its_loads(case: str, smoothing: str) -> None:
    """They have moved by ``relax`` times the push, and at these velocities the ordinary
    slopes are those found, but for what Newton's method leaves of the greatest push."""
    text = CASES[case].replace("EPS", smoothing)
    # The load of a bit that creeps falls with its speed, which bounds the length of a
    # stage (``falling``).
    relax = 0.1 * RELAX if case == "cutting from a speed on" else RELAX
    b, rows, function = buffer_of(text, True, 5, relax)
    free = b.copy()
    function(b.ravel())
    pushed = [2 * slope + 1 for slope in rows.pushed]
    pushes = b[rows.push : rows.push + len(pushed)]
    for push, state in zip(pushes, pushed, strict=True):
        assert b[rows.stage + state] == pytest.approx(free[rows.stage + state] + relax * push, rel=1e-12, abs=1e-13)
    plain, ordinary, function = buffer_of(text, False, 5)
    plain[ordinary.stage : ordinary.stage + rows.own] = b[rows.stage : rows.stage + rows.own]
    function(plain.ravel())
    assert np.abs(pushes).max() > 0.0
    # The slip is as exact as the velocities; steepness amplifies what rounding leaves
    # of it.
    noise = 1e-15 * float(smoothing) * 10
    assert slopes_of(b, rows) == pytest.approx(slopes_of(plain, ordinary), abs=(3e-5 + noise) * np.abs(pushes).max())


@pytest.mark.parametrize("case", MIXED)
def test_the_bits_of_a_lane_do_not_depend_on_its_neighbours(case: str) -> None:
    """Lanes with and without contact, and each of them among copies of itself. Where
    the bit is about to stick, the number of iterations would differ."""
    for seed in range(20):
        b, rows, function = buffer_of(MIXED[case].replace("EPS", "1e4"), True, seed, 100 * RELAX)
        b[rows.stage + rows.own - 1] *= 0.1  # the bit speed, but of a string of segments
        start = b.copy()
        function(b.ravel())
        places = [
            *range(rows.stage, rows.stage + rows.own),
            *range(rows.acceleration, rows.acceleration + rows.slopes),
            *range(rows.push, rows.push + len(rows.pushed)),
        ]
        for lane in range(W):
            alone = np.repeat(start[:, [lane]], W, axis=1)
            function(alone.ravel())
            np.testing.assert_array_equal(b[places, lane], alone[places, lane])


@pytest.mark.parametrize("implicit", [False, True])
@pytest.mark.parametrize("case", ["beam", "beam, few modes", "beam, one station"])
def test_the_deviation_is_the_derivative(case: str, implicit: bool) -> None:
    """Of an elastic collar: moved velocities, slopes and pushes of the deviation, against
    a difference of eighth order. That of a stage is as exact as its loads, in the worst
    of lanes; of explicit slopes to 1e-10."""
    text, step = CASES[case].replace("EPS", "500"), 2.0**-12
    study = parse_study(text)
    model = model_named("beam")
    variant = model.variant(study.parameters)
    variant = model.implicit(variant) if implicit else variant
    plain, ordinary, function = buffer_of(text, implicit, 7, RELAX)
    rows = model.rows(variant, tangent=True)
    b, own, slopes = np.zeros((rows.total, W)), rows.own, rows.own_slopes
    inputs = [("stage", own), ("phase", 1), ("stage_time", 1), ("parameter", rows.parameters)]
    for name, count in [*inputs, ("relax", 1)] if implicit else inputs:
        to, source = getattr(rows, name), getattr(ordinary, name)
        b[to : to + count] = plain[source : source + count]
    deviation = (
        np.random.default_rng(3).normal(size=(own, W))
        * model.state_scales(b[rows.parameter :][: rows.parameters].T, variant).T
    )
    b[rows.stage + own : rows.stage + 2 * own] = deviation
    exact = np.zeros_like(plain)
    for distance, weight in enumerate((4 / 5, -1 / 5, 4 / 105, -1 / 280), start=1):
        for sign in (1.0, -1.0):
            other = plain.copy()
            other[ordinary.stage : ordinary.stage + own] += sign * distance * step * deviation
            function(other.ravel())
            exact += sign * weight / step * other
    pushes = len(ordinary.pushed)
    model.tangent(W, variant, 0)(b.ravel())
    tolerance = 1e-4 if implicit else 1e-10
    for mine, theirs in (
        (b[rows.stage + own : rows.stage + 2 * own], exact[ordinary.stage : ordinary.stage + own]),
        (b[rows.acceleration + slopes :][:slopes], exact[ordinary.acceleration : ordinary.acceleration + slopes]),
        (b[rows.push + pushes :][:pushes], exact[ordinary.push : ordinary.push + pushes]),
    ):
        for one, two in zip(mine, theirs, strict=True):
            assert one == pytest.approx(two, rel=tolerance, abs=tolerance * np.abs(two).max())
