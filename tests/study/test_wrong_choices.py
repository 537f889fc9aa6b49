"""A wrong choice is blamed alone: what it decides of other keys is not known."""

from __future__ import annotations

from pathlib import Path

import pytest

from nsdrill.errors import StudyError
from nsdrill.study import load_study


@pytest.mark.parametrize(
    ("text", "key"),
    [
        ("drive: {kind: soft_torqe, matching: 5, a: 0.3}\ninitial: {lag: 1 rad}", "drive.kind"),
        ("sweep: {drive.matching: [1, 2]}\ndrive: {kind: soft}", "drive.kind"),
        ("bit: {friction: {law: rationall, b0: 20 mm}}", "bit.friction.law"),
        ("modes: {lateral: frozn, axial: frozen}\ndrive: {kind: stiff}\ninitial: {z: 1 mm}", "modes.lateral"),
    ],
)
def test_the_choice_alone_is_blamed(tmp_path: Path, text: str, key: str) -> None:
    (tmp_path / "study.yaml").write_text(text)
    with pytest.raises(StudyError) as caught:
        load_study(tmp_path / "study.yaml")
    assert [fault.key for fault in caught.value.faults] == [key]
