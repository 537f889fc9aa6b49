"""Parts of branches that two of them have are there once, of a gear pair with backlash, whose
branches fold many times; and a branch keeps to its period where others graze a stop beside it."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import nsdrill
from nsdrill.analysis.bifurcations import DOUBLING
from nsdrill.app.following import continuing
from nsdrill.models import registry


def gears(t, x=0.1, v=0.0, *, damping=0.02, gap=1.0, mean=0.2, force=0.3, omega=0.9):
    over = nsdrill.touching("drive_side", x - gap) - nsdrill.touching("back_side", -x - gap)
    return v, mean + force * np.cos(omega * t) - 2 * damping * v - over


@pytest.fixture(scope="module")
def model():
    yield nsdrill.model(gears)
    registry.withdraw("gears")


def branches_of(model, **continued):
    return nsdrill.continue_branches(model.study(continued=continued, transient=300), progress=False)


def test_two_branches_that_meet_share_one_point(model):
    """One ended where it met the other, which went on over it and ended within, as it had as
    many points as it may have: what lay between was there twice, with its special points."""
    data = branches_of(model, omega=(0.5, 2.2), seeds=[0.6, 2.0], lobes=[1], points=320)
    first, second = (data["parameters_omega"].values[data["branch_of_point"].values == k] for k in (0, 1))
    assert data["end_reason"].values[1].endswith("it goes on as a branch that is there already")
    # both go on monotonically there, the first one down from 2.2 and the second one up from 0.5
    assert abs(second[-1] - first[0]) < 0.001
    assert second.max() < 0.911  # and no longer to the fold at 0.9211
    assert np.all(np.diff(data["arclength"].values[data["branch_of_point"].values == 1]) >= 0.0)


def test_what_two_branches_have_is_kept_once_too(model, tmp_path, monkeypatch):
    """Of a branch that ended on another one, and was cut there, only its own points are shown
    while those that emanate from it are followed into a file."""
    shown, write = [], continuing.write_branches

    def written(path, *args, **named):
        shown.append(continuing.branches_kept(continuing.part_path(path)))
        write(path, *args, **named)

    monkeypatch.setattr(continuing, "write_branches", written)
    continued = {"omega": (0.5, 2.2), "seeds": [0.6, 2.0], "lobes": [1, 2], "points": 320}
    study = model.study(continued=continued, transient=300)
    data = nsdrill.continue_branches(study, tmp_path / "branches.h5", progress=False)
    (kept,), of = shown, [one["branch_of_point"].values for one in (data, *shown)]
    assert sum(of[0] > 1) > 0  # a later round than that of the cut
    for name in ("parameters_omega", "arclength", "label"):
        assert np.array_equal(kept[name].values[of[1] < 2], data[name].values[of[0] < 2])


def test_a_branch_between_two_doublings_is_followed_from_one_of_them(model):
    """From the other one its first six points were kept as a branch of their own."""
    data = branches_of(model, omega=(0.4, 0.6), seeds=[0.45, 0.5], lobes=[1, 2, 4])
    assert sorted(data["lobes"].values) == [1, 2, 4, 4, 4]
    assert "there already" not in "".join(data["end_reason"].values)


SOFT = """@nsdrill.model
def soft(t, x=0.0, v=0.0, *, omega=0.81):
    stop = 29.0 * nsdrill.touching("stop", x - 1.26)
    return {"x": v, "v": 0.7 * omega**2 * np.sin(omega * t) - 0.02 * v - x - stop}
"""


def miss(omega, state, periods):
    """By how much the soft oscillator misses its start after so many periods, by SciPy."""

    def slopes(t, y):
        stop = 29.0 * max(y[0] - 1.26, 0.0)
        return [y[1], 0.7 * omega**2 * np.sin(omega * t) - 0.02 * y[1] - y[0] - stop]

    time = periods * 2.0 * np.pi / omega
    path = solve_ivp(slopes, (0.0, time), state, "DOP853", rtol=1e-10, atol=1e-11, max_step=0.05)
    return float(np.max(np.abs(path.y[:, -1] - state)))


def test_a_branch_does_not_leap_to_a_motion_of_a_shorter_period(script):
    """The motions over two and over four periods come near that over one, where all graze the
    stop."""
    study = script(SOFT, "stopped").soft.study(
        continued={"omega": (0.8015, 0.808), "seeds": [0.807], "lobes": [1, 2, 4]}, transient=1500, observe=10
    )
    data = nsdrill.continue_branches(study)
    lobes, branch, omegas = data["lobes"].values, data["branch_of_point"].values, data["parameters_omega"].values
    assert list(lobes) == [2, 1, 4]
    for number in (0, 2):
        (points,) = np.nonzero(branch == number)
        for point in points[[0, len(points) // 2, -2, -1]]:
            state, periods = data["state"].values[point][:2], int(lobes[number])
            assert miss(omegas[point], state, periods) < 1e-6
            assert miss(omegas[point], state, periods // 2) > 5e-6
    # The motion over two periods joins that over one where this doubles, and not before.
    (doubling,) = omegas[(branch == 1) & (data["label"].values == DOUBLING)]
    ends = [str(reason) for reason in data["end_reason"].values]
    assert ["half its period" in reason for reason in ends] == [True, False, False]
    assert np.min(omegas[branch == 0]) == pytest.approx(doubling, abs=1e-5)
