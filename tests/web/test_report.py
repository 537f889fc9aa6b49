"""The report holds what was asked and found, loads nothing, and is there whole or not
at all."""

from __future__ import annotations

import base64
import hashlib
import html
import re
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from nsdrill.cli.main import group
from nsdrill.data import Results
from nsdrill.store import read_results
from nsdrill.web.report import representatives


def made(*arguments: str | Path) -> Result:
    return CliRunner().invoke(group, ["report", *map(str, arguments)])


@pytest.fixture(scope="module")
def page(shared: Path, tmp_path_factory: pytest.TempPathFactory) -> str:
    out = tmp_path_factory.mktemp("report") / "report.html"
    done = made(shared / "small.h5", "-o", out, "--motions", "2")
    assert done.exit_code == 0, done.output
    return out.read_text(encoding="utf-8")


def test_it_says_what_was_asked(page: str, shared: Path) -> None:
    attrs = read_results(shared / "small.h5").attrs
    text = html.unescape(re.sub(r"<script.*?</script>", "", page, flags=re.DOTALL))
    for wanted in (
        "<h1>Small</h1>",
        "1 to 8 rad/s, 8 values",
        "carried up and down",
        "2 s, then observed for 2 s",
        str(attrs["study_sha256"]),
        str(attrs["model_digest"]),
        "--study > small_study.yaml",
        "nsdrill run small_study.yaml -o small_again.h5",
        "nsdrill replay",
        "Safe window",
        "Responses, up:",
        "procedure: up-down",
        f"nsdrill report {shared / 'small.h5'} -o",
    ):
        assert wanted in text, wanted


def test_it_loads_nothing_and_runs_only_its_own_scripts(page: str) -> None:
    outside = re.sub(
        r"<script.*?</script>|<style>.*?</style>|<!--.*?-->", "", page, flags=re.DOTALL
    )
    assert not re.search(r"""(src|href)=["'](?!data:|#)""", outside)
    assert " style=" not in outside
    assert not re.search(r"\son\w+=", outside)
    policy = html.unescape(re.search(r'Content-Security-Policy" content="(.*?)"', page)[1])  # type: ignore[index]
    assert "default-src 'none'" in policy
    assert "unsafe" not in policy
    scripts = re.findall(r"<script>(.*?)</script>", page, re.DOTALL)
    assert len(scripts) >= 3
    for script in scripts:
        digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
        assert f"'sha256-{digest}'" in policy


def test_the_motions_are_those_of_the_file(page: str, shared: Path) -> None:
    results = read_results(shared / "small.h5")
    bodies = re.findall(
        r'<script type="application/octet-stream" id="body\d+">(.*?)</script>', page
    )
    import json

    heads = []
    for body in map(base64.b64decode, bodies):
        size = int.from_bytes(body[:4], "little")
        heads.append((json.loads(body[4 : 4 + size]), np.frombuffer(body[4 + size :], "<f4")))
    moving = [(head, data) for head, data in heads if "place" in head and "same_bits" in head]
    assert len(moving) == 2
    for head, data in moving:
        assert head["same_bits"] is True
        place = tuple(head["place"])
        column = head["columns"]["bit_speed"]
        last = data[column["at"] : column["at"] + column["shape"][0]][-1]
        state = list(results.coords["state"]).index("bit_speed")
        assert last == pytest.approx(results["final_state"][place][state], rel=1e-5)


def test_the_title_cannot_leave_its_place(shared: Path, tmp_path: Path) -> None:
    (tmp_path / "bad.yaml").write_text(
        "title: '</script><script>alert(1)</script><img src=x onerror=alert(2)>'\n"
        "sweep: {rotary_speed: [3 rad/s, 4 rad/s]}\nsimulation: {transient: 1 s, observe: 1 s}\n"
    )
    runner = CliRunner()
    assert (
        runner.invoke(
            group, ["run", str(tmp_path / "bad.yaml"), "-o", str(tmp_path / "bad.h5")]
        ).exit_code
        == 0
    )
    assert made(tmp_path / "bad.h5", "-o", tmp_path / "bad.html").exit_code == 0
    text = (tmp_path / "bad.html").read_text()
    assert "<script>alert" not in text
    assert "<img" not in text


def test_representatives_are_settled_points_of_the_commonest_responses() -> None:
    response = np.array([[[[0, 0, 0, 1, 1, 4, 0, 0]]]], np.int8)
    settled = np.array([[[[1, 1, 1, 0, 1, 1, 1, 1]]]], np.int8)
    coords = {
        "procedure": np.array(["same"]),
        "depth": np.ones(1),
        "wob": np.ones(1),
        "rotary_speed": np.arange(8.0),
        "state": np.array(["x"]),
    }
    variables = {"status": np.ones_like(response), "response": response, "settled": settled}
    found = representatives(Results(coords, variables), 3)
    assert found == [(0, 0, 0, 1), (0, 0, 0, 4), (0, 0, 0, 5)]
    assert representatives(Results(coords, variables), 1) == [(0, 0, 0, 1)]


def test_bad_input_is_said_and_writes_nothing(shared: Path, tmp_path: Path) -> None:
    for arguments, word in (
        (["nothing.h5", "-o", tmp_path / "a.html"], "nothing.h5"),
        ([shared / "small.yaml", "-o", tmp_path / "a.html"], "found a study; allowed: results"),
        ([shared / "small.h5", "-o", tmp_path / "a.pdf"], ".html"),
        ([shared / "small.h5", "-o", tmp_path / "no" / "a.html"], "no"),
        ([], "RESULTS"),
    ):
        done = made(*arguments)
        assert done.exit_code != 0
        said = (
            str(done.exception)
            if done.exception and not isinstance(done.exception, SystemExit)
            else done.output
        )
        assert word in said, (arguments, said)
        assert not list(tmp_path.iterdir())
    (tmp_path / "there.html").write_text("mine")
    assert made(shared / "small.h5", "-o", tmp_path / "there.html").exit_code != 0
    assert (tmp_path / "there.html").read_text() == "mine"


def test_failed_points_are_in_the_report(shared: Path, tmp_path: Path) -> None:
    assert made(shared / "failing.h5", "-o", tmp_path / "a.html").exit_code == 0
    assert "Failed points" in (tmp_path / "a.html").read_text()
