"""The pages in a real browser: Debian's chromium, driven by Playwright. Skipped by name
where one is missing."""

import json
import time
from pathlib import Path

import numpy as np
import pytest

import nsdrill
from nsdrill.study import parse_study
from nsdrill.web.explorer import Explorer

from .browser import WAIT, WIDTHS, clicked, head_of, opened, place, running
from .test_motions import write


@pytest.mark.parametrize("page", WIDTHS, indirect=True)
def test_a_click_replays_that_very_point(page, explorer, session):
    results = session.results
    opened(page, explorer.url)
    page.mouse.move(*place(page, 0.45))
    assert "Rotary speed" in page.locator("#hover").inner_text()
    said = clicked(page, 0.45)
    stored = results["final_state"][tuple(said["place"])]
    assert np.array_equal(np.array(said["state"]), stored)  # 17 digits come through JSON
    assert "bit for bit" in page.locator("#bits").inner_text()
    assert page.locator("#which .name").inner_text().count("rad/s") == 1
    assert "nsdrill replay" in page.locator("#command").inner_text()
    hole, collar = (float(page.locator(".orbit canvas").get_attribute(f"data-{name}")) for name in ("hole", "collar"))
    parameters = session.study.parameters
    assert collar / hole == pytest.approx(parameters.drillstring.collar.outer_diameter / parameters.well.diameter)
    box = page.locator(".orbit canvas").bounding_box()
    assert box["width"] == pytest.approx(box["height"], abs=1)  # equal scales
    assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")


def test_the_private_file_leads_to_the_page(page, explorer):
    with explorer.private_page() as address:
        assert address.startswith("file:///")
        assert explorer.token not in address
        opened(page, address)
        page.wait_for_url(f"http://127.0.0.1:{explorer.port}/#show=*")


def test_a_run_that_a_newer_one_replaces_is_given_up(page, explorer):
    """The first click is never answered; the second one gives it up, and nothing is said
    of that."""
    opened(page, explorer.url)
    page.route("**/api/replay", lambda route: None, times=1)
    with page.expect_event("requestfailed") as failed:
        with page.expect_request("**/api/replay"):
            page.mouse.click(*place(page, 0.2))
        page.mouse.click(*place(page, 0.8))
    assert failed.value.url.endswith("/api/replay")
    page.locator("#bits").wait_for(timeout=WAIT)
    assert "bit for bit" in page.locator("#bits").inner_text()
    assert page.locator("#banner").is_hidden()


def test_ticks_have_the_decimals_of_their_step(page, explorer):
    """Each number on an axis is the number of its place: 2.5, 5, 7.5 and not 3, 5, 8."""
    opened(page, explorer.url)
    for step in (5, 2500, 2.5, 0.5, 0.25, 0.1, 0.02, 0.0002):
        places = [step * k for k in range(4)]
        told = page.evaluate("([s, v]) => v.map((one) => Number(one.toFixed(nsdrill.decimals(s))))", [step, places])
        assert told == pytest.approx(places, rel=1e-12)
    assert page.evaluate("[1, 20, 0.1].map(nsdrill.decimals)") == [0, 0, 1]


def test_a_slider_runs_on_from_there(page, explorer):
    opened(page, explorer.url)
    before = clicked(page, 0.6)
    slider = page.locator("#s-rotary_speed")
    slider.focus()
    with page.expect_response("**/api/live", timeout=WAIT) as answer:
        page.keyboard.press("ArrowRight")
    asked = json.loads(answer.value.request.post_data)
    assert asked["state"] == before["state"]
    assert list(asked["changes"]) == ["rotary_speed"]
    after = head_of(answer.value)
    assert after["values"]["rotary_speed"] == asked["changes"]["rotary_speed"] > before["values"]["rotary_speed"]
    assert "with changed numbers" in page.locator("#bits").inner_text()
    text = page.locator(".slider", has=page.locator("#s-wob")).locator("input[type=text]")
    text.fill("7 klbf")
    with page.expect_response("**/api/live", timeout=WAIT) as answer:
        text.press("Enter")
    assert head_of(answer.value)["values"]["wob"] == pytest.approx(7 * 4448.2216152605)


def test_any_number_can_be_moved_and_the_point_started_over(page, explorer):
    opened(page, explorer.url)
    before = clicked(page, 0.6)
    page.locator("#more").select_option("bit.rock_stiffness")
    slider = page.locator("#s-bit-rock_stiffness")
    slider.focus()
    with page.expect_response("**/api/live", timeout=WAIT):
        page.keyboard.press("ArrowLeft")
    with page.expect_response("**/api/replay", timeout=WAIT) as answer:
        page.locator("#again").click()
    assert head_of(answer.value)["state"] == before["state"]


def test_whole_numbers_and_words_can_be_changed(page, explorer):
    opened(page, explorer.url)
    clicked(page, 0.6)
    # its stiffness has other units then
    assert page.locator("#more option", has_text="Well law").count() == 0
    page.locator("#more").select_option("bit.lobes")
    page.locator("#s-bit-lobes").focus()
    with page.expect_response("**/api/live", timeout=WAIT) as answer:
        page.keyboard.press("ArrowLeft")
    assert head_of(answer.value)["values"]["bit.lobes"] == 2
    page.locator("#more").select_option("modes.axial")
    with page.expect_response("**/api/live", timeout=WAIT) as answer:
        page.locator("#s-modes-axial").select_option("frozen")
    assert head_of(answer.value)["values"]["modes.axial"] == "frozen"
    assert {"bit.lobes", "modes.axial"}.isdisjoint(
        page.locator("#around option").evaluate_all("a => a.map(o => o.value)")
    )


def test_a_change_that_is_refused_is_taken_back(page, explorer):
    opened(page, explorer.url)
    clicked(page, 0.6)
    text = page.locator(".slider", has=page.locator("#s-wob")).locator("input[type=text]")
    for refused in ("7 mm", "-7 klbf"):
        text.fill(refused)
        text.press("Enter")
        page.locator("#banner", has_text=f"found '{refused}'").wait_for()
    page.locator("#s-rotary_speed").focus()
    with page.expect_response("**/api/live", timeout=WAIT) as answer:
        page.keyboard.press("ArrowRight")
    assert answer.value.status == 200
    assert list(json.loads(answer.value.request.post_data)["changes"]) == ["rotary_speed"]
    page.expected = ["error: Failed to load resource: the server responded with a status of 400 (Bad Request)"] * 2


def test_keyboard_alone(page, explorer):
    opened(page, explorer.url)
    for _ in range(20):
        page.keyboard.press("Tab")
        if page.evaluate("document.activeElement.id") == "diagram":
            break
    assert page.evaluate("document.activeElement.id") == "diagram"
    outline = page.evaluate("getComputedStyle(document.activeElement).outlineStyle")
    assert outline != "none"
    for key in ("ArrowRight", "ArrowRight", "ArrowUp", "ArrowDown"):
        page.keyboard.press(key)
    with page.expect_response("**/api/replay", timeout=WAIT) as answer:
        page.keyboard.press("Enter")
    assert head_of(answer.value)["same_bits"] is True
    unnamed = page.evaluate(
        "[...document.querySelectorAll('input, select, button')].filter(e => !(e.labels?.length || "
        "e.getAttribute('aria-label') || e.textContent.trim())).length"
    )
    assert unnamed == 0


def test_the_arrows_choose_the_procedure_that_they_are_named_for(page, explorer):
    opened(page, explorer.url)
    page.locator("#diagram").focus()
    for key in ("Down", "Up"):
        page.keyboard.press(f"Arrow{key}")
        assert f", {key.lower()}:" in page.locator("#hover").inner_text()


def test_arrows_go_along_branches(page, shared, tmp_path):
    with running(write(tmp_path / "branches.h5", shared)) as made:
        opened(page, made.url)
        page.locator("#diagram").focus()
        for key, words in (("Right", "branch 0"), ("Right", "4 rad/s: branch 0"), ("Down", "4 rad/s: branch 1")):
            page.keyboard.press(f"Arrow{key}")
            assert words in page.locator("#hover").inner_text()
        with page.expect_response("**/api/orbit", timeout=WAIT) as answer:
            page.keyboard.press("Enter")
        assert json.loads(answer.value.request.post_data)["point"] == 7
        assert "unsettled" not in " ".join(head_of(answer.value)["labels"])


def test_a_page_fits_every_width(page, explorer):
    opened(page, explorer.url)
    clicked(page, 0.5)
    for width in (400, 1280, 700):
        page.set_viewport_size({"width": width, "height": 900})
        drawn = "Math.max(...[...document.querySelectorAll('.uplot')].map(e => e.getBoundingClientRect().right))"
        # The page lets no text be run as code, so it is asked from outside until it has
        # settled.
        deadline = time.monotonic() + WAIT / 1000
        while max(page.evaluate("document.documentElement.scrollWidth"), page.evaluate(drawn)) > width:
            assert time.monotonic() < deadline, f"wider than {width}"
            page.wait_for_timeout(50)


def test_saving(page, explorer, session):
    opened(page, explorer.url)
    said = clicked(page, 0.5)
    with page.expect_download() as offered:
        page.locator("#save-study").click()
    assert offered.value.suggested_filename == "point.yaml"
    study = parse_study(Path(offered.value.path()).read_text())
    assert study.operation.rotary_speed == session.motions.values(said["place"])["rotary_speed"]
    # of x, vx, y, vy, z, vz, twist, bit_speed, drive_angle
    assert study.initial.bit_speed == said["state"][7]
    with page.expect_download() as offered:
        page.locator("#save-png").click()
    assert Path(offered.value.path()).read_bytes().startswith(b"\x89PNG")


def test_two_pages_do_not_disturb_each_other(page, explorer, chromium):
    opened(page, explorer.url)
    other = opened(chromium.new_page(), explorer.url)
    one, two = clicked(page, 0.3), clicked(other, 0.9)
    assert one["place"] != two["place"]
    other.close()
    assert clicked(page, 0.3)["state"] == one["state"]


def test_a_map(page, shared):
    with running(shared / "map.h5") as made:
        opened(page, made.url)
        page.mouse.move(*place(page, 0.6))
        assert "Weight on bit" in page.locator("#hover").inner_text()
        assert clicked(page, 0.6)["same_bits"] is True
        page.locator("#channel").select_option("line radius_peaks")
        page.locator("#held select").first.wait_for()
        assert clicked(page, 0.2)["same_bits"] is True


def test_a_page_says_that_the_explorer_has_stopped(page, session):
    explorer = Explorer(session)
    explorer.start()
    opened(page, explorer.url)
    explorer.close()
    page.locator("#banner", has_text="The explorer has stopped").wait_for(timeout=WAIT)


def test_a_wrong_token_is_said(page, explorer):
    page.goto(f"{explorer.url}x")
    page.locator("#banner", has_text="The token is missing or of another explorer").wait_for(timeout=WAIT)
    page.expected = ["error: Failed to load resource: the server responded with a status of 403 (Forbidden)"]


def test_a_study_is_run_from_its_start(page, tmp_path):
    (tmp_path / "study.yaml").write_text("title: Alone\nsimulation: {transient: 1 s, observe: 2 s}\n")
    with running(tmp_path / "study.yaml") as made:
        opened(page, made.url)
        page.locator("#bits", has_text="Run from the study's start for 3 s").wait_for(timeout=WAIT)
        assert page.locator("#sweep").is_hidden()


@pytest.fixture(scope="module")
def report(shared, tmp_path_factory):
    out = tmp_path_factory.mktemp("report") / "report.html"
    nsdrill.report([shared / name for name in ("small.h5", "map.h5", "failing.h5")], out, motions=1)
    return out


@pytest.mark.parametrize("page", WIDTHS, indirect=True)
def test_the_report_opens_without_a_network(page, report):
    page.goto(report.as_uri())
    assert page.locator("section h2").all_inner_texts() == [
        "1: small.h5",
        "2: map.h5",
        "3: failing.h5",
        "small.h5: Small",
        "map.h5: Small map",
        "failing.h5: Small",
        "How this was made",
    ]
    assert page.locator("figure").count() >= 2
    widths = page.evaluate("[...document.images].map(one => one.complete && one.naturalWidth)")
    assert len(widths) >= 7
    assert all(width > 300 for width in widths)  # what is no picture has none
    assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")
