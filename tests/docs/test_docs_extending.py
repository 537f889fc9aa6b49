"""The examples on the page for those who extend nsdrill run and give what the page says."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest


@pytest.fixture
def blocks(docs: Path, tmp_path: Path) -> list[Path]:
    """The Python blocks of the page, each in a file of its own, as numba wants its functions."""
    found = re.findall(r"^```python\n(.*?)^```", (docs / "extending.md").read_text(encoding="utf-8"), re.M | re.S)
    paths = []
    for number, text in enumerate(found):
        paths.append(tmp_path / f"block_{number}.py")
        paths[-1].write_text(text)
    return paths


def run(path: Path) -> dict[str, Any]:
    names: dict[str, Any] = {"__name__": path.stem, "__file__": str(path)}
    exec(compile(path.read_text(), str(path), "exec"), names)
    return names


def test_the_pairs_are_listed(blocks: list[Path], capsys: pytest.CaptureFixture[str]) -> None:
    run(blocks[0])
    listed = capsys.readouterr().out.splitlines()
    assert listed == ["tsitouras Tsitouras 5(4) 5", "dormand_prince Dormand-Prince 5(4) 5"]


def test_a_limit_cycle_returns_after_its_period(blocks: list[Path]) -> None:
    """Van der Pol's, mu = 1, with the published period; the multiplier of the cycle is 8.6e-4, so that 100 periods have
    forgotten the start. Some thousand steps at rtol 1e-10: 1e-7."""
    names = run(blocks[1])
    difference = names["second"].final[0, :2] - names["first"].final[names["first"].job == 0][0, :2]
    assert np.abs(difference).max() < 1e-7
    assert (names["first"].status == 1).all()
