"""Branches that set out from one motion of a file, in one direction."""

import numpy as np
import pytest
import xarray

import nsdrill
from nsdrill.store import open_branches

from .test_continue import STUDY


def over_weight(speed: float, direction: str) -> str:
    return (
        f"model: torsion\noperation: {{depth: 5000 m, wob: 22.24 kN, rotary_speed: {speed!r} rad/s}}\n"
        f"continue: {{along: wob, from: 19 kN, to: 26 kN, direction: {direction}}}\n"
    )


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Branches along the speed, and a sweep over it, beside their study."""
    folder = tmp_path_factory.mktemp("chosen")
    (folder / "study.yaml").write_text(STUDY)
    nsdrill.continue_branches(folder / "study.yaml", folder / "b.h5")
    swept = {"sweep": {"rotary_speed": ["3 rad/s", "4 rad/s", "5 rad/s"], "procedure": "up-down"}}
    swept["simulation"] = {"transient": "400 s"}
    nsdrill.run(folder / "study.yaml", folder / "sweep.h5", set=swept, progress=False)
    return folder


def unstable_cycle(data) -> int:
    """The number of an unstable point in the middle of the branch of cycles."""
    return int(np.flatnonzero((data["branch_of_point"].values == 1) & (data["unstable"].values == 1))[30])


@pytest.mark.parametrize("direction", ["up", "down"])
def test_a_branch_sets_out_in_one_direction(made, direction):
    found = nsdrill.continue_branches(
        made / "study.yaml",
        seeds=made / "sweep.h5",
        at={"rotary_speed": "5 rad/s"},
        procedure="up",
        set={"continue.direction": direction, "continue.switch": False},
    )
    speeds, own = found.rotary_speed.values, 5.0
    assert found.sizes["branch"] == 1
    assert speeds[0] == pytest.approx(own, rel=1e-9)
    end = 6.0 if direction == "up" else 1.5
    assert speeds[-1] == pytest.approx(end, rel=1e-6)
    assert "the motion from which it set out" in str(found.end_reason.values[0])
    both = open_branches(made / "b.h5")
    steady = both["branch_of_point"].values == 0
    order = np.argsort(both["rotary_speed"].values[steady])
    twist = np.interp(speeds, both["rotary_speed"].values[steady][order], both["state"].values[steady][order, 0])
    assert found.state.values[:, 0] == pytest.approx(twist, rel=1e-3)


def test_an_unstable_motion_is_followed_in_another_number_and_back(made):
    along_speed = open_branches(made / "b.h5")
    number = unstable_cycle(along_speed)
    speed, period = float(along_speed["rotary_speed"].values[number]), float(along_speed["period"].values[number])
    over = nsdrill.continue_branches(over_weight(speed, "down"), seeds=made / "b.h5", point=number)
    assert list(over.motion.values) == ["limit_cycle"]
    assert over.period.values[0] == pytest.approx(period, rel=1e-7)
    assert over.wob.values[0] == pytest.approx(22.24e3, rel=1e-9)
    assert (np.diff(over.wob.values[:5]) < 0.0).all()
    assert over.unstable.values[0] == 1
    # the same family, crossed by the branch along the speed at another weight
    other = nsdrill.continue_branches(made / "study.yaml", set={"operation.wob": "20 kN"})
    cycle = (other.branch_of_point.values == 1) & (other.unstable.values == 1)
    order = np.argsort(other.rotary_speed.values[cycle])
    there = np.interp(speed, other.rotary_speed.values[cycle][order], other.period.values[cycle][order])
    order = np.argsort(over.wob.values)
    here = np.interp(20e3, over.wob.values[order], over.period.values[order])
    assert here == pytest.approx(there, rel=1e-3)


def test_a_point_that_has_not_settled_is_no_motion(made, tmp_path):
    nsdrill.run(made / "study.yaml", tmp_path / "short.h5", set={"sweep.rotary_speed": ["5 rad/s"]}, progress=False)
    with pytest.raises(nsdrill.FileError, match="the point at rotary_speed 5 rad/s has not settled; allowed: results"):
        nsdrill.continue_branches(made / "study.yaml", seeds=tmp_path / "short.h5", at={"rotary_speed": "5 rad/s"})


def test_the_nearest_settled_points_are_named(made):
    sweep = nsdrill.open_results(made / "sweep.h5").load()
    is_five, is_up = sweep.rotary_speed == 5.0, sweep.procedure == "up"
    sweep["settled"] = xarray.where(is_five & is_up, 0, xarray.ones_like(sweep["settled"])).astype(int)
    chosen = {"at": {"rotary_speed": "4.9 rad/s"}, "procedure": "up", "set": {"continue.switch": False}}
    with pytest.raises(nsdrill.FileError, match=r"speed 5 rad/s, up has not settled.*\(the nearest, up: 4 rad/s\)"):
        nsdrill.continue_branches(made / "study.yaml", seeds=sweep, **chosen)
    # the other run there has
    assert nsdrill.continue_branches(made / "study.yaml", seeds=sweep, **{**chosen, "procedure": None}).sizes["branch"]


def test_seeds_in_memory_are_those_of_a_file(made):
    chosen = {"at": {"rotary_speed": "5 rad/s"}, "procedure": "up", "set": {"continue.switch": False}}
    sweep = nsdrill.open_results(made / "sweep.h5")
    here, there = (
        nsdrill.continue_branches(made / "study.yaml", seeds=one, **chosen) for one in (sweep, made / "sweep.h5")
    )
    assert np.array_equal(here.state, there.state)
    branches = open_branches(made / "b.h5")
    number = unstable_cycle(branches)
    study = over_weight(float(branches["rotary_speed"].values[number]), "down")
    here, there = (nsdrill.continue_branches(study, seeds=one, point=number) for one in (branches, made / "b.h5"))
    assert np.array_equal(here.state, there.state)
    with pytest.raises(
        nsdrill.InputError, match="seeds: found a value of the type int; allowed: the name of a file, or"
    ):
        nsdrill.continue_branches(study, seeds=3)
    with pytest.raises(nsdrill.FileError, match="the Dataset: "):
        nsdrill.continue_branches(study, seeds=branches.drop_vars("motion"), point=number)


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (("--seeds", "b.h5"), "found branches as seeds; allowed: with the number of one of their points, --point N"),
        (("--seeds", "b.h5", "--point", "9999"), "--point: found 9999; allowed: 0 to"),
        (("--seeds", "sweep.h5", "--point", "3"), "found --point 3 with results"),
        (("--at", "rotary_speed=3rad/s"), "without a file that has it; allowed: with --seeds FILE.h5"),
        (("--seeds", "sweep.h5", "--at", "wob=20kN"), "--at: found wob; allowed: rotary_speed, which is followed"),
        (("--seeds", "sweep.h5", "--at", "rotary_speed=5.9rad/s"), "allowed: 3 to 5, as the sweep"),
        (("--seeds", "sweep.h5", "--procedure", "same"), "--procedure: found same; allowed: up, down"),
        (("--seeds", "sweep.h5", "--start", "2"), "--start: found 2; allowed: results that have several"),
        (("--seeds", "b.h5", "--point", "3", "--procedure", "up"), "found a choice of a point of results"),
    ],
)
def test_a_choice_that_is_none_is_refused(made, call, monkeypatch, more, message):
    monkeypatch.chdir(made)
    assert message in call("branches", "study.yaml", "-o", "none.h5", *more, code=2).err
    assert not (made / "none.h5").exists()


def test_a_point_of_branches_belongs_to_the_operating_point_of_the_study(made, call, tmp_path):
    (tmp_path / "other.yaml").write_text(over_weight(3.0, "both"))
    number = unstable_cycle(open_branches(made / "b.h5"))
    err = call(
        "branches", tmp_path / "other.yaml", "-o", "none.h5", "--seeds", made / "b.h5", "--point", number, code=2
    ).err
    assert "and 3 in the study; allowed: the study at that point, --set operation.rotary_speed=2.0896" in err
