"""Parts of branches that two of them have are there once, of a gear pair with backlash, whose
branches fold many times."""

import numpy as np
import pytest

import nsdrill
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


def test_a_branch_between_two_doublings_is_followed_from_one_of_them(model):
    """From the other one its first six points were kept as a branch of their own."""
    data = branches_of(model, omega=(0.4, 0.6), seeds=[0.45, 0.5], lobes=[1, 2, 4])
    assert sorted(data["lobes"].values) == [1, 2, 4, 4, 4]
    assert "there already" not in "".join(data["end_reason"].values)
