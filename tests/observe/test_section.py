"""The Poincare section: located on the solution, once for each turn, the last ones
kept."""

from dataclasses import replace

import numpy as np
import pytest
from kernel.motions import BOUNCING, RUBBING, SMOOTH, start_of
from model_tables import SECTION
from reference import Case, solve
from scipy.optimize import brentq
from sweep.runs import finish, run_work, same_bits, work_for

from nsdrill.kernel.settings import Simulation
from nsdrill.models.christoforou_yigit.observed import coordinates
from nsdrill.observe.thresholds import Record
from nsdrill.sweep.work import Work

TIGHT = Simulation(transient=3.0, observe=12.0, rtol=1e-10, max_steps=10**7)


def with_section(case: Case, returns: int = 40, section: str = "revolution", simulation: Simulation = TIGHT) -> Work:
    return replace(work_for(case, simulation), record=Record(peaks=2, poincare=returns, section=section))


def crossings(work: Work, start: np.ndarray) -> dict[str, np.ndarray]:
    """The section of one run from ``start``, NaN left out."""
    runs = work.prepare(np.array([0]))
    work.begin(runs.initial[0], start)
    batch = work.new_batch(8, 1)
    batch.add(np.array([0]), runs)
    columns = work.columns(finish(work, batch)[-1])
    return {name: columns[name][0][np.isfinite(columns[name][0])] for name in SECTION}


def exact(case: Case, start: np.ndarray, lobes: int) -> list[dict[str, float]]:
    """The same from SciPy's solution of the reference equations at 1e-12, with its own
    event location."""
    end = TIGHT.transient + TIGHT.observe
    solution = solve(case, start[:8], end, dense=True).sol
    spacing = 2 * np.pi / lobes

    def angle(t: float) -> float:
        return float(solution(t)[6] + case.speed * t)

    first, last = np.floor(angle(TIGHT.transient) / spacing) + 1, np.floor(angle(end) / spacing)
    grid = np.linspace(TIGHT.transient, end, 4001)
    reached = np.array([angle(t) for t in grid])
    found = []
    for level in np.arange(first, last + 1) * spacing:
        after = int(np.argmax(reached >= level))
        t = brentq(lambda t, level=level: angle(t) - level, grid[after - 1], grid[after], xtol=1e-14)
        x, vx, y, vy, z, vz, twist, speed = solution(t)
        r = np.hypot(x, y)
        found.append(
            {
                "section_radius": r,
                "section_whirl_angle": (np.arctan2(y, x) - level + np.pi) % (2 * np.pi) - np.pi,
                "section_radial_velocity": (x * vx + y * vy) / r,
                "section_whirl_speed": (x * vy - y * vx) / r**2,
                "section_axial": z,
                "section_axial_velocity": vz,
                "section_twist": twist,
                "section_bit_speed": speed,
            }
        )
    return found


@pytest.mark.parametrize(
    ("case", "section", "within"),
    [(SMOOTH, "revolution", 1e-6), (BOUNCING, "lobe", 1e-4), (RUBBING, "revolution", 1e-4)],
    ids=["smooth", "bouncing", "rubbing"],
)
def test_returns_are_those_of_the_exact_solution(case, section, within):
    """Interpolation is of sixth order: at these steps below 1e-7 of the state_scales.
    Every contact adds an error of the order of the tolerance, 1e-10, and the next ones
    make it grow: some 1e-5 after forty bounces."""
    start = start_of(case)
    mine = crossings(with_section(case, section=section), start)
    expected = exact(case, start, case.lobes if section == "lobe" else 1)
    assert len(mine["section_radius"]) == len(expected)
    state_scales = {
        "section_radius": 0.01,
        "section_radial_velocity": 0.1,
        "section_whirl_speed": 5.0,
        "section_axial": 1e-3,
        "section_axial_velocity": 0.02,
    }
    for name in SECTION:
        values = np.array([one[name] for one in expected])
        assert mine[name] == pytest.approx(values, rel=within, abs=within * state_scales.get(name, 1.0)), name


def test_the_last_ones_are_kept_oldest_first():
    start = start_of(SMOOTH)
    many, few = (crossings(with_section(SMOOTH, returns), start) for returns in (40, 3))
    for name in SECTION:
        assert few[name].tobytes() == many[name][-3:].tobytes()


def test_a_bit_that_swings_back_is_counted_once_a_turn():
    """Off the rock the string unwinds from twenty radians of twist, and the bit swings
    back by whole turns."""
    case, end = Case(wob=0.0, speed=2.0, amplitude=0.0), 40.0
    start = np.array([1e-3, 0.0, 0.0, 0.0, 0.1, 0.0, 20.0, 2.0, 0.0])
    work = with_section(case, simulation=Simulation(0.0, end, rtol=1e-9))
    solution = solve(case, start[:8], end, dense=True).sol
    time = np.linspace(0.0, end, 40001)
    angle = solution(time)[6] + case.speed * time
    reached = np.maximum.accumulate(angle)
    assert np.max(reached - angle) > 4 * np.pi, "else it does not swing back by whole turns"
    expected = np.floor(reached[-1] / (2 * np.pi)) - np.floor(angle[0] / (2 * np.pi))
    assert len(crossings(work, start)["section_radius"]) == expected


def test_recording_returns_changes_no_other_bit_and_lanes_change_none():
    work = work_for(Case(), Simulation(5.0, 20.0), rotary_speed=np.linspace(2.0, 7.0, 13))
    recorded = replace(work, record=Record(poincare=9))
    plain, one, eight = run_work(work), run_work(recorded, lanes=1), run_work(recorded, lanes=8)
    assert same_bits(one, eight)
    assert all(plain[name].tobytes() == one[name].tobytes() for name in plain)
    assert set(one) - set(plain) == {*SECTION, "motion", "period", "zero_one"}


def test_the_whirl_angle_is_counted_from_the_bit():
    entry = np.zeros((1, 9))
    entry[0, :3], entry[0, 3], entry[0, 8] = (0.0, 0.3, 2.0), 0.4, 2 * np.pi * 7 + 0.5
    found = coordinates(entry)
    assert found["section_radius"][0] == pytest.approx(2.0)
    assert found["section_whirl_angle"][0] == pytest.approx(np.pi / 2 - 0.5)
    assert found["section_radial_velocity"][0] == pytest.approx(0.4)
    assert found["section_whirl_speed"][0] == pytest.approx(-0.15)
