"""What a run says of its progress: a bar, lines, a call, or nothing."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import pytest

import nsdrill
from nsdrill import progress
from nsdrill.progress import Progress, reporting
from nsdrill.sweep.engine import Progress as Counts


def test_without_a_terminal_a_short_run_says_nothing(
    small: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    nsdrill.run(small)
    assert capsys.readouterr() == ("", "")


def test_without_a_terminal_a_line_now_and_then(
    small: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(progress, "LINE_SECONDS", 0.0)
    nsdrill.run(small)
    out, lines = capsys.readouterr()
    assert out == ""
    assert lines.splitlines()[-1].startswith("16 of 16 points; ")
    nsdrill.run(small, progress=False)
    assert capsys.readouterr() == ("", "")


def test_lines_name_failures_and_the_pass(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(progress, "LINE_SECONDS", 0.0)
    with reporting(True) as watch:
        watch(Counts(total=40, before=10, done=0, failed=0))
        watch(Counts(total=40, before=10, done=5, failed=2, note="check: tight"))
    first, second = capsys.readouterr().err.splitlines()
    assert first == "10 of 40 points; starting"
    assert second.startswith("15 of 40 points, 2 failed; ")
    assert second.endswith(" left (check: tight)")


@pytest.mark.parametrize(
    ("way", "line"),
    [("native", "compiled in 11 s; kept for the next run"), ("numba", "compiled in 11 s")],
)
def test_a_line_says_whether_the_code_is_kept(
    way: str, line: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """numba's is not."""
    monkeypatch.setattr(progress, "route", lambda: way)
    with reporting(True) as watch:
        watch(Counts(total=40, before=0, done=0, failed=0, compiling=11.0))
    assert capsys.readouterr().err.splitlines() == [line]


def test_a_bar_in_a_terminal(
    small: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rich.console.Console.is_terminal", True)
    nsdrill.run(small)
    out, shown = capsys.readouterr()
    assert out == ""
    assert "16/16" in shown


def test_a_notebook_without_widgets_has_lines(
    small: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rich.console._is_jupyter", lambda: True)
    monkeypatch.setattr(progress, "find_spec", lambda name: None)
    monkeypatch.setattr(progress, "LINE_SECONDS", 0.0)
    nsdrill.run(small)
    assert "16 of 16 points" in capsys.readouterr().err


def test_a_function_is_told_how_far_the_run_is(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = iter([100.0, 101.0, 104.0])
    monkeypatch.setattr(progress.time, "monotonic", lambda: next(clock))
    seen: list[Progress] = []
    with reporting(seen.append) as watch:
        watch(Counts(total=40, before=10, done=0, failed=0))
        watch(Counts(total=40, before=10, done=10, failed=1, note="check: long"))
    # 10 in 4 s, 20 are left
    assert seen == [Progress(10, 40, 0, None), Progress(20, 40, 1, 8.0, "check: long")]


def test_a_refined_and_checked_run_ends_at_its_total() -> None:
    seen: list[Progress] = []
    nsdrill.run(
        {
            "operation.depth": "2 km",
            "simulation": {"transient": "1 s", "observe": "1 s", "verify": True},
            "sweep": {
                "wob": {"from": "20 kN", "to": "60 kN", "points": 3},
                "rotary_speed": {"from": "2 rad/s", "to": "6 rad/s", "points": 3},
                "refine": 1,
            },
        },
        progress=seen.append,
    )
    assert seen[-1].done == seen[-1].total > 9
    assert all(a.done <= b.done for a, b in pairwise(seen))


def test_a_fault_in_the_function_is_not_hidden(small: Path, tmp_path: Path) -> None:
    def broken(now: Progress) -> None:
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        nsdrill.run(small, tmp_path / "out.h5", progress=broken)
    with nsdrill.run(small, tmp_path / "out.h5", resume=True, progress=False) as data:
        assert int((data.status == 1).sum()) == 16
