"""What can be done on the explorer's page, in a real browser."""

import csv
import io
import itertools
import json
import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from nsdrill.cli.main import group

from .browser import WAIT, clicked, head_of, opened, place, running
from .test_motions import write

SHORT = "simulation: {transient: 2 s, observe: 6 s}\n"
# Mild enough at 5000 N to be safe at some speed, whatever the history.
MAP = """title: A window
operation: {depth: 1000 m}
bit: {lobes: 1, surface_amplitude: 0.1 mm}
sweep: {wob: [5 kN, 30 kN, 90 kN], rotary_speed: [4 rad/s, 7 rad/s, 9 rad/s, 12 rad/s],
  procedure: up-down, along: rotary_speed}
"""
UNCERTAIN = """title: Not known
operation: {depth: 2000 m}
bit: {lobes: 1, surface_amplitude: 0.5 mm}
sweep: {wob: [20 kN, 60 kN], rotary_speed: [4 rad/s, 12 rad/s, 15 rad/s]}
uncertain: {bit.friction.static: {uniform: [0.3, 0.6]}, samples: 4}
"""
BASIN = """title: Starts
initial: {slice: {x: {from: -60 mm, to: 60 mm, points: 5},
  vx: {from: -0.5 m/s, to: 0.5 m/s, points: 4}}}
"""


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """A map up and down, results with samples, and a slice of starts."""
    folder = tmp_path_factory.mktemp("pages")
    for name, text in (("map", MAP), ("uncertain", UNCERTAIN), ("basin", BASIN)):
        (folder / f"{name}.yaml").write_text(text + SHORT)
        arguments = ["run", str(folder / f"{name}.yaml"), "-o", str(folder / f"{name}.h5")]
        done = CliRunner().invoke(group, [*arguments, "--quiet"])
        assert done.exit_code == 0, done.output
    return folder


def boxes(page: Any, selector: str) -> list[dict[str, float]]:
    return [one.bounding_box() for one in page.locator(selector).all()]


def titles(page: Any) -> str:
    """What the hover says of a cell: the title of each map, and its value."""
    page.mouse.move(*place(page, 0.4, 0.4))
    said: str = page.locator("#hover").inner_text()
    return said


def test_a_map_opens_on_its_window(page, files):
    """The window, and the responses of both procedures beside it; the point that the
    window recommends is chosen and run."""
    from nsdrill.app.answering.answers import window

    with running(files / "map.h5") as made:
        results = made.session.results
        opened(page, made.url)
        assert page.locator("#channel").input_value() == "area window"
        maps = boxes(page, "#diagram .uplot")
        assert len(maps) == 3
        assert len({round(box["y"]) for box in maps}) == 1  # side by side
        said = titles(page)
        assert all(word in said for word in ("Operating window:", "Responses, up:", "Responses, down:"))
        found = window(results)
        best = found["maps"][0]["recommended"]
        told = page.locator("#answer")
        assert told.locator("p").inner_text() == found["answer"]["sentence"]
        names = told.locator("summary").inner_text().split(" · ")
        texts = found["answer"]["warnings"]
        assert names[0] == "BEFORE TRIALS"
        assert len(names) == 1 + len(texts) > 1
        assert all(re.match(rf"{one}[: ]", text) and one.isupper() for one, text in zip(names[1:], texts, strict=True))
        told.locator("summary").click()
        assert told.locator("details li").all_inner_texts()[1:] == texts
        assert told.locator("> ul li").all_inner_texts() == found["answer"]["lines"]
        with page.expect_download() as saved:
            page.locator("#save-svg").click()
        assert all(
            word in saved.value.path().read_text() for word in (names[0], found["answer"]["sentence"].split()[0])
        )
        name = page.locator("#which .name").inner_text()
        assert f"Rotary speed {best['rotary_speed']:g} rad/s" in name
        assert f"Weight on bit {best['wob'] / 1e3:g} kN" in name
        assert "border of the operating window" in page.locator("#legend").inner_text()
        page.locator("#channel").select_option("map radius_max")
        page.locator("#legend", has_text="down less up").wait_for()
        assert told.is_hidden()
        assert len(boxes(page, "#diagram .uplot")) == 3
        assert "down less up:" in titles(page)
        # a click in the second map runs down
        with page.expect_response("**/api/replay", timeout=WAIT) as answer:
            box = boxes(page, "#diagram .uplot .u-over")[1]
            page.mouse.click(box["x"] + 0.6 * box["width"], box["y"] + 0.5 * box["height"])
        assert head_of(answer.value)["place"][0] == 1


def test_unknown_numbers_open_on_their_probability(page, files):
    with running(files / "uncertain.h5") as made:
        opened(page, made.url)
        assert page.locator("#channel").input_value() == "area probability"
        assert "Probability: safe:" in titles(page)
        assert "Sample 0" in page.locator("#which .name").inner_text()
        assert "100 %" in page.locator("#legend").inner_text()


def test_a_start_of_a_basin_can_be_clicked(page, files):
    with running(files / "basin.h5") as made:
        results = made.session.results
        opened(page, made.url)
        with page.expect_response("**/api/replay", timeout=WAIT) as answer:
            page.mouse.click(*place(page, 0.1, 0.1))  # the least x, the greatest vx
        head = head_of(answer.value)
        names = results["state"].tolist()
        begun = results["initial_state"][tuple(head["place"])]
        assert begun[names.index("x")] == pytest.approx(-0.06)
        assert begun[names.index("vx")] == pytest.approx(0.5)
        assert head["same_bits"]


@pytest.mark.parametrize("page", [1280], indirect=True)
def test_the_histories_are_beside_the_hole(page, explorer):
    """At the start, above the fold, with three ticks each."""
    opened(page, explorer.url)
    (hole,) = boxes(page, "#motion .orbit canvas")
    histories = boxes(page, "#motion .orbitrow > div:last-child .uplot")
    assert len(histories) == 6
    for box in histories:
        assert box["x"] > hole["x"] + 0.99 * hole["width"]
        assert box["y"] + box["height"] < 900
    ticks = page.locator("#motion .orbitrow > div:last-child .chart").evaluate_all(
        "all => all.map(one => Number(one.dataset.ticks))"
    )
    assert min(ticks) >= 3


def test_two_motions_are_pinned_side_by_side(page, explorer):
    opened(page, explorer.url)
    clicked(page, 0.2)
    page.locator("#pin").click()
    before = page.locator("#pinned-which").inner_text()
    clicked(page, 0.9)
    assert page.locator("#pinned-which").inner_text() == before
    assert before.split(":")[0] != page.locator("#which .name").inner_text()
    left, right = boxes(page, "#motions .orbit canvas")
    assert left["x"] + left["width"] < right["x"]
    assert abs(left["width"] - right["width"]) < 1
    page.locator("#pin").click()
    assert page.locator("#pinned").is_hidden()


def test_a_click_in_the_hole_or_a_plane_runs_from_there(page, explorer):
    opened(page, explorer.url)
    before = clicked(page, 0.5)
    box = boxes(page, "#motion .orbit canvas")[0]
    scale = float(page.locator(".orbit canvas").get_attribute("data-hole")) / (box["width"] / 2)
    radius = explorer.session.study.parameters.well.diameter / 2
    with page.expect_response("**/api/live", timeout=WAIT) as answer:
        page.mouse.click(box["x"] + 0.6 * box["width"], box["y"] + 0.45 * box["height"])
    asked = json.loads(answer.value.request.post_data)
    state = dict(zip(asked["states"], asked["state"], strict=True))
    pixel = 2 * radius / box["width"]
    assert state["x"] == pytest.approx(0.2 * radius / scale, abs=pixel)
    assert state["y"] == pytest.approx(0.1 * radius / scale, abs=pixel)
    unchanged = dict(zip(before["states"], before["state"], strict=True))
    assert all(state[name] == unchanged[name] for name in state if name not in ("x", "y"))
    page.locator("#bits", has_text="Run from the chosen start").wait_for(timeout=WAIT)
    with page.expect_response("**/api/live", timeout=WAIT) as answer:
        box = boxes(page, "#motion .planes .u-over")[0]
        page.mouse.click(box["x"] + 0.9 * box["width"], box["y"] + 0.5 * box["height"])
    again = json.loads(answer.value.request.post_data)
    changed = [
        name for name, one, two in zip(again["states"], again["state"], asked["state"], strict=True) if one != two
    ]
    assert {"z", "vz"} <= set(changed)
    # the radius is no state
    box = boxes(page, "#motion .planes .u-over")[2]
    page.mouse.click(box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"])
    page.locator("#banner", has_text="is no state of this string").wait_for()


def test_kinds_of_branches_are_switched(page, shared, tmp_path):
    """A hidden kind is neither drawn nor found by the pointer."""
    path = write(tmp_path / "branches.h5", shared)
    with running(path) as made:
        branches = made.session.branches
        kinds = list(dict.fromkeys(branches.names))
        opened(page, made.url)
        toggles = page.locator("#legend .toggle")
        words = toggles.all_inner_texts()
        assert set(kinds) <= set(words)
        curves = made.session.diagram({"y": "radius_peaks"})[0]["curves"]
        assert [one["name"] for one in curves["kinds"]] == kinds
        assert len({one["colour"] for one in curves["kinds"]}) == len(kinds)
        page.mouse.move(*place(page, 0.5))
        assert any(kind in page.locator("#hover").inner_text() for kind in kinds)
        for kind in kinds:
            toggles.nth(words.index(kind)).click()
        page.mouse.move(*place(page, 0.5))
        page.locator("#hover").evaluate("one => { one.textContent = ''; }")
        page.mouse.move(*place(page, 0.52))
        assert page.locator("#hover").inner_text() == ""
        assert toggles.nth(0).get_attribute("aria-pressed") == "false"
        toggles.nth(words.index(kinds[0])).click()
        page.mouse.move(*place(page, 0.5))
        assert kinds[0] in page.locator("#hover").inner_text()


def test_undo(page, explorer):
    """Back over a whole movement of a slider, and over a click."""
    opened(page, explorer.url)
    first = clicked(page, 0.2)
    name = page.locator("#which .name").inner_text()
    clicked(page, 0.9)
    slider = page.locator("#s-rotary_speed").bounding_box()
    middle = slider["y"] + slider["height"] / 2
    page.mouse.move(slider["x"] + 0.8 * slider["width"], middle)
    page.mouse.down()
    for part in (0.75, 0.7, 0.65, 0.6):
        with page.expect_response("**/api/live", timeout=WAIT):
            page.mouse.move(slider["x"] + part * slider["width"], middle)
    page.mouse.up()
    page.wait_for_timeout(300)
    page.locator("#undo").click()
    page.locator("#bits", has_text="bit for bit").wait_for()
    page.locator("#undo").click()
    assert page.locator("#which .name").inner_text() == name
    with page.expect_response("**/api/live", timeout=WAIT) as answer:
        page.locator("#onward").click()
    assert json.loads(answer.value.request.post_data)["state"] == first["state"]


def test_undo_marks_the_cell_before(page, files):
    with running(files / "map.h5") as made:
        opened(page, made.url)
        cells = []
        for across in (0.2, 0.8):
            clicked(page, across)
            cells.append(page.locator("#hover .name").inner_text())
        page.locator("#undo").click()
        page.locator("#hover .name", has_text=cells[0]).wait_for()
        assert cells[0] != cells[1]
        speed = cells[0].partition(",")[0]
        assert speed in page.locator("#which .name").inner_text()


SMALL_PLANE = """async () => {
    const box = document.createElement("div");
    box.style.width = "150px";
    document.body.append(box);
    const o = { x: [-0.1055, -0.1028], y: [0, 1], xlabel: "z", height: 150, low: true, narrow: true };
    const { plot } = nsdrill.chart(box, { ...o, draw() {}, over() {} }), axis = plot.axes[0];
    await new Promise((drawn) => setTimeout(drawn, 200));
    const context = document.createElement("canvas").getContext("2d");
    context.font = '11px "DejaVu Sans", Verdana, sans-serif';
    return axis._splits.map((value, k) => [plot.valToPos(value, "x"), axis._values[k]]).filter(([, text]) => text)
        .map(([at, text]) => [-0.5, 0.5].map((part) => at + part * context.measureText(text).width));
}"""


def test_numbers_below_a_small_plane_do_not_meet(page, explorer):
    """Also where they have many digits, as of a motion that hardly moves."""
    opened(page, explorer.url)
    words = page.evaluate(SMALL_PLANE)
    assert words
    assert all(left[1] + 3 < right[0] for left, right in itertools.pairwise(words)), words


def test_a_bare_number_has_the_unit_of_its_field(page, explorer):
    opened(page, explorer.url)
    text = page.locator(".slider", has=page.locator("#s-wob")).locator("input[type=text]")
    text.fill("7")
    with page.expect_response("**/api/live", timeout=WAIT) as answer:
        text.press("Enter")
    assert text.input_value() == "7 kN"
    assert head_of(answer.value)["values"]["wob"] == pytest.approx(7000)


def test_a_link_opens_the_same_view(page, explorer):
    """In another tab, without the token in it, after a slider was moved."""
    opened(page, explorer.url)
    page.locator("#channel").select_option("line radius_peaks")
    clicked(page, 0.7)
    page.locator("#s-wob").focus()
    with page.expect_response("**/api/live", timeout=WAIT) as answer:
        page.keyboard.press("ArrowRight")
    page.locator("#bits", has_text="with changed numbers").wait_for()
    page.wait_for_url("**/#*changes*")
    link = page.url
    assert explorer.token not in link
    assert link.startswith(f"http://127.0.0.1:{explorer.port}/#")
    other = page.context.new_page()
    with other.expect_response("**/api/live", timeout=WAIT) as again:
        opened(other, link)
    assert head_of(again.value)["state"] == head_of(answer.value)["state"]
    for part in ("#which .name", "#bits"):
        assert other.locator(part).inner_text() == page.locator(part).inner_text()
    assert other.locator("#channel").input_value() == "line radius_peaks"
    other.wait_for_url(link)
    other.close()


def test_the_shown_motion_is_exported(page, explorer):
    opened(page, explorer.url)
    said = clicked(page, 0.5)
    head, columns = explorer.session.replay({"place": said["place"], "seconds": 20.0})
    with page.expect_download() as offered:
        page.locator("#save-trace").click()
    rows = list(csv.reader(io.StringIO(Path(offered.value.path()).read_text())))
    names = [channel["name"] for channel in head["channels"]]
    assert rows[0][0] == "time [s]"
    assert [one.partition(" [")[0] for one in rows[0][1:]] == names
    assert "bit_force [kN]" in rows[0]
    table = np.array(rows[1:], dtype=float)
    assert len(table) == head["samples"]
    for number, name in enumerate(names, start=1):
        size = np.nanmax(np.abs(columns[name])) or 1.0
        assert np.allclose(table[:, number], columns[name], rtol=0, atol=1e-6 * size, equal_nan=True)


def test_pictures_are_vectors_or_pixels_without_gaps(page, files):
    import matplotlib.image

    with running(files / "map.h5") as made:
        opened(page, made.url)
        kept = {}
        for kind in ("png", "svg"):
            with page.expect_download() as offered:
                page.locator(f"#save-{kind}").click()
            assert offered.value.suggested_filename == f"map.{kind}"
            kept[kind] = Path(offered.value.path()).read_bytes()
    image = matplotlib.image.imread(io.BytesIO(kept["png"]), format="png")[..., :3]
    blank = np.all(image > 0.99, axis=(1, 2))
    edges = np.flatnonzero(np.diff(np.concatenate([[0], blank, [0]])))
    assert np.max(np.diff(edges)[::2], initial=0) < 60  # rows, of two to a pixel of the page
    root = ElementTree.fromstring(kept["svg"])
    space = "{http://www.w3.org/2000/svg}"
    words = [one.text for one in root.iter(f"{space}text")]
    assert {"Rotary speed [rad/s]", "Operating window", "Bit speed [rad/s]"} <= set(words)
    assert {"4", "6", "8"} & set(words)  # ticks
    fills = {one.get("fill") for one in root.iter(f"{space}path")} - {None, "none"}
    assert len(fills) > 3  # the colours of the cells
    assert not list(root.iter(f"{space}image"))
    assert b"NaN" not in kept["svg"]
    assert b"undefined" not in kept["svg"]
