"""Kinds of picture are found by their files, and what each declares is true."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from made_up import make_results

import nsdrill.plot.kinds
from nsdrill import plot
from nsdrill.data import Results, Trace
from nsdrill.plot.registry import GROUPS, all_kinds

PAGE = Path(__file__).parents[2] / "docs" / "dev" / "extending.md"


@pytest.fixture
def another(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """The kind of the page on extending, in a file beside the others."""
    (block,) = (b for b in re.findall(r"^```python\n(.*?)^```", PAGE.read_text(), re.M | re.S) if "KINDS = " in b)
    (tmp_path / "effort.py").write_text(block)
    monkeypatch.setattr(nsdrill.plot.kinds, "__path__", [*nsdrill.plot.kinds.__path__, str(tmp_path)])
    all_kinds.cache_clear()
    yield
    all_kinds.cache_clear()
    sys.modules.pop("nsdrill.plot.kinds.effort", None)


@pytest.mark.usefixtures("another")
def test_one_more_file_is_one_more_kind() -> None:
    data = make_results(rotary_speed=np.linspace(1, 8, 9))
    data.variables["steps"] = np.arange(9.0).reshape(1, 1, 1, 9)
    assert "effort" in plot.kinds_for(data)
    assert "steps" in plot.needed(data, "effort")
    (axes,) = plot.draw(data, "effort").axes
    assert axes.lines[0].get_ydata() == pytest.approx(np.arange(9.0))
    assert axes.get_xlabel() == "Rotary speed [rad/s]"


def test_every_kind_is_drawn_of_something_known() -> None:
    for kind in all_kinds().values():
        assert kind.of in GROUPS
        assert kind.words


def test_what_is_across_is_on_the_x_axis(speeds: Results, plane: Results, trace: Trace) -> None:
    """Every kind that names the variable along x has panels with that label."""
    from nsdrill.plot.labels import quantity

    seen = set()
    for data in (speeds, plane, trace):
        for name in plot.kinds_for(data)[:8]:
            if across := all_kinds()[name].across(data):
                figure = plot.draw(data, name)
                panels = [*figure.axes, *(axes for part in figure.subfigs for axes in part.axes)]
                assert quantity(across).label in {axes.get_xlabel() for axes in panels}, name
                seen.add(name)
    assert {"bifurcation", "value", "map", "window", "histories", "trace"} <= seen
