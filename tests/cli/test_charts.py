"""nsdrill plot with a study: charts, for which nothing is run."""

from __future__ import annotations

from pathlib import Path

import pytest

from .helpers import Call

KINDS = ("critical-speeds", "buckling", "drive-card", "drive-tuning")


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_is_drawn(call: Call, small: Path, tmp_path: Path, kind: str) -> None:
    answer = call("plot", small, "--kind", kind, "-o", "chart.png", "--units", "field")
    assert (answer.out, answer.err) == ("", "chart.png: drawn.\n")
    assert (tmp_path / "chart.png").read_bytes().startswith(b"\x89PNG")
    call("plot", small, "--kind", kind, "-o", "chart.png", code=2)
    call("plot", small, "--kind", kind.replace("-", "_"), "-o", "other.png")


def test_kinds_of_a_study_are_listed(call: Call, small: Path) -> None:
    answer = call("plot", small, "--kind", "list")
    assert [line.split()[0] for line in answer.out.splitlines()] == sorted(KINDS)


def test_along_an_axis_of_the_study(call: Call, small: Path) -> None:
    call("plot", small, "--kind", "critical-speeds", "--along", "rotary_speed", "-o", "a.svg")
    call(
        f"plot {small} --kind buckling --along drillstring.collar.span --set "
        f"'sweep={{drillstring.collar.span: {{from: 10 m, to: 40 m, points: 3}}}}' -o b.svg"
    )
    assert "Collar span [m]" in Path("b.svg").read_text()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--kind", "buckling", "--along", "wob"], "--along: found wob, which the study does not sweep; allowed: "),
        (["--kind", "drive-card", "--along", "depth"], "--along: found with --kind drive-card, which is of one point"),
        (["--kind", "buckling", "--wob", "30 kN"], "--wob: found with a study; allowed: with results."),
        (["--kind", "buckling", "--start", "0"], "--start: found with a study"),
        (["--kind", "bucklin"], "found 'bucklin' with a study. Did you mean 'buckling'?"),
        (["--kind", "map"], "found 'map' with a study. Allowed of a study, which is not run:"),
        ([], "plot kind: found a study without a kind."),
        (["--kind", "drive-tuning", "--set", "modes.torsional=frozen"], "found modes.torsional: frozen"),
        (["--kind", "buckling", "--set", "operation.wob=30"], "operation.wob"),
        (
            ["--kind", "critical-speeds", "--along", "initial.x", "--set", "sweep={initial.x: [1 mm, 2 mm]}"],
            "found initial.x, on which no chart depends",
        ),
        (["--kind", "critical-speeds", "--set", "sweep={depth: [3000 m]}"], "found one value of depth in the sweep"),
    ],
)
def test_what_does_not_fit_is_told(call: Call, small: Path, tmp_path: Path, words: list[str], said: str) -> None:
    assert said in call("plot", small, *words, "-o", "chart.png", code=2).err
    assert not (tmp_path / "chart.png").exists()


def test_results_and_studies_are_kept_apart(call: Call, small: Path, shared: Path) -> None:
    results = shared / "small.h5"
    answer = call("plot", results, "--kind", "buckling", "-o", "a.png", code=2)
    assert "allowed: with a study, a YAML file" in answer.err
    for option, value in (("--along", "depth"), ("--set", "operation.wob=30 kN")):
        assert f"{option}: found with" in call("plot", results, option, value, "-o", "a.png", code=2).err
    assert "none.yaml" in call("plot", "none.yaml", "--kind", "buckling", "-o", "a.png", code=2).err
    call("plot", small, "--kind", "buckling", "-o", small, code=2)
