"""An axis over what is fixed when the model is compiled: the numbers of single studies,
in one file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import nsdrill
from nsdrill.app.trajectory import replay
from nsdrill.errors import StudyError

STUDY = """
operation: {depth: 2000 m}
sweep:
  rotary_speed: [3 rad/s, 5 rad/s]
  bit.lobes: [1, 3]
simulation: {transient: 3 s, observe: 3 s}
record: {peaks: 2}
"""


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    found = tmp_path_factory.mktemp("lobes") / "lobes.h5"
    nsdrill.run(STUDY, found)
    return found


BEAM = """
model: beam
beam: {modes: 2, stations: [{at: 0.1}, {at: 0.9}]}
operation: {depth: 2000 m}
sweep: {bit.lobes: [1, 2]}
simulation: {transient: 1 s, observe: 1 s}
"""


@pytest.mark.parametrize(
    ("study", "changes"),
    [(STUDY, {}), (STUDY, {"sweep.procedure": "up", "sweep.along": "rotary_speed"}), (BEAM, {})],
    ids=["each by itself", "chains of their own", "elastic collar"],
)
def test_each_value_has_the_bits_of_a_study_of_its_own(study: str, changes: dict[str, str]) -> None:
    both = nsdrill.run(study, set=changes)
    assert both.sizes["bit_lobes"] == 2
    for lobes in both.bit_lobes.values:
        alone = nsdrill.run(study, set={**changes, "sweep.bit.lobes": int(lobes)})
        for name in alone.data_vars:
            one = both[name].sel(bit_lobes=lobes)
            assert np.array_equal(one.values, alone[name].values, equal_nan=True), (name, lobes)


def test_its_points_are_replayed_bit_for_bit_and_checked(path: Path) -> None:
    assert replay(path, rotary_speed=5.0, at={"bit.lobes": 1.0}).same_bits
    checked = nsdrill.run(STUDY, set={"simulation.verify": True})
    assert np.all(checked.tight_status == 1)


def test_what_no_axis_of_this_kind_may_be_is_told() -> None:
    spaced = {"from": 1, "to": 4, "points": 3}
    cases = (
        ({"sweep.bit.lobes": "1.5"}, "a whole number"),
        ({"sweep.bit.lobes": spaced}, "whole numbers, as [1, 3, 5]"),
        ({"sweep.procedure": "up", "sweep.along": "bit.lobes"}, "allowed: an axis over a number"),
    )
    for change, words in cases:
        with pytest.raises(StudyError) as error:
            nsdrill.load_study(STUDY, change)
        assert words in str(error.value)
