"""The report holds what was asked and found, loads nothing, is there whole or not at all, and
prints; the explorer from Python."""

import base64
import hashlib
import html
import json
import re
import shutil
import subprocess
import urllib.parse
import urllib.request
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree

import h5py
import numpy as np
import pytest
from click.testing import CliRunner, Result

import nsdrill
from nsdrill.analysis.window import find_window
from nsdrill.app.answering.answers import results_for_window, sensitivity
from nsdrill.cli.main import group
from nsdrill.data import Answer, Results
from nsdrill.store import read_results
from nsdrill.text.uncertainty_text import conclusion
from nsdrill.web.diagrams import choices
from nsdrill.web.html_page import without_keys
from nsdrill.web.one_page import in_rig_words
from nsdrill.web.report import motion_of, representatives
from nsdrill.web.report_head import LIMITS, file_answer
from nsdrill.web.session import Session
from nsdrill.words.answer import answer, needed_for_words, warnings
from nsdrill.words.orders import Orders

from .browser import BROWSER
from .pdf_words import pages

pytestmark = pytest.mark.usefixtures("words_only")


def made(*arguments: str | Path) -> Result:
    return CliRunner().invoke(group, ["report", *map(str, arguments)])


@pytest.fixture(scope="module")
def page(shared, tmp_path_factory):
    out = tmp_path_factory.mktemp("report") / "report.html"
    done = made(shared / "small.h5", "-o", out, "--motions", "2")
    assert done.exit_code == 0, done.output
    return out.read_text(encoding="utf-8")


def test_it_says_what_was_asked(page, shared):
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
        "Operating window",
        "Responses, up:",
        "procedure: up-down",
        f"nsdrill report {shared / 'small.h5'} -o",
    ):
        assert wanted in text, wanted


def test_python_writes_the_same_page(shared, tmp_path):
    file, page = str(shared / "small.h5"), str(tmp_path / "page.html")
    assert nsdrill.report([file, shared / "map.h5"], page, motions=1, units="field") == page
    written = Path(page).read_text(encoding="utf-8")
    given = (shared / "small.h5", shared / "map.h5")
    assert nsdrill.report(given, page, motions=1, units="field", overwrite=True) == page
    done = made(file, shared / "map.h5", "-o", page, "--motions", "1", "--units", "field", "--overwrite")
    assert done.exit_code == 0, done.output
    assert Path(page).read_text(encoding="utf-8") == written


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({}, "page.html: the file exists"),
        ({"path": "page.pdf"}, "page.pdf: found another ending; allowed: .html"),
        ({"results": []}, "results: found no file; allowed: one or more"),
        ({"results": "dataset"}, "results: found results in memory; allowed: names of files"),
        ({"results": "trace.h5"}, "trace.h5: found a trace; allowed: results or branches"),
        ({"motions": 9}, "motions: found 9; allowed: 0 to 8"),
        ({"severity": 5}, "severity: found 5; allowed: 0 to 4"),
        ({"units": "metric"}, "units: found 'metric'; allowed: si or field"),
    ],
)
def test_what_python_cannot_write_is_refused(shared, tmp_path, monkeypatch, given, words):
    monkeypatch.chdir(tmp_path)
    Path("page.html").write_text("there")
    nsdrill.save(nsdrill.simulate(shared / "small.yaml", duration="1 s"), "trace.h5")
    given = {"results": shared / "small.h5", "path": "page.html" if not given else "other.html"} | given
    if given["results"] == "dataset":
        given["results"] = nsdrill.open_results(shared / "small.h5")
    with pytest.raises(nsdrill.NsdrillError, match=re.escape(words)):
        nsdrill.report(**given)
    assert sorted(map(str, Path().iterdir())) == ["page.html", "trace.h5"]


# The ways of a sweep to reach its points, and what a study has for it.
WAYS = {
    **{way: {"sweep.procedure": way} for way in ("same", "up", "down", "up-down", "all")},
    "many starts": {"sweep.procedure": "same", "initial.ensemble": 2, "initial.seed": 1},
}


@pytest.mark.parametrize("way", WAYS)
def test_every_kind_of_report_of_every_way_to_its_points(tmp_path, way):
    study = {"model": "torsion", "sweep": {"rotary_speed": ["3 rad/s", "8 rad/s"]}}
    study |= {"simulation": {"transient": "2 s", "observe": "2 s"}}
    a, b = tmp_path / "a.h5", tmp_path / "b.h5"
    nsdrill.run(study, a, set=WAYS[way], progress=False, workers=1).close()
    shutil.copy(a, b)
    kinds = {"one": [a], "two": [a, b], "sheet": [a, "--one-page"], "sheets": [a, b, "--one-page"]}
    for kind, given in kinds.items():
        done = made(*given, "-o", tmp_path / f"{kind}.html")
        assert done.exit_code == 0, (kind, done.output)
    whole = html.unescape((tmp_path / "one.html").read_text(encoding="utf-8"))
    assert "Operating window" in whole
    assert "allowed: the run" in whole or "allowed: none, as nothing was brought up" in whole


def test_it_loads_nothing_and_runs_no_script(page):
    outside = re.sub(r"<style>.*?</style>|<img[^>]*>", "", page, flags=re.DOTALL)
    assert not re.search(r"""(src|href)=["'](?!data:|#)""", outside)
    for picture in pictures(page).values():
        assert not re.search(r"""href=["'](?!data:|#)|url\((?!#)""", picture)
    assert " style=" not in outside
    assert not re.search(r"\son\w+=", outside)
    assert "<script" not in page
    policy = html.unescape(re.search(r'Content-Security-Policy" content="(.*?)"', page)[1])
    assert "default-src 'none'" in policy
    assert "script-src" not in policy
    assert "unsafe" not in policy
    style = re.search(r"<style>(.*?)</style>", page, re.DOTALL)[1]
    assert f"'sha256-{base64.b64encode(hashlib.sha256(style.encode()).digest()).decode()}'" in policy


def pictures(page: str) -> dict[str, str]:
    """The pictures of a page as the texts of SVG files, by their words."""
    found = re.findall(r"""<img class="vectors" alt="([^"]*)" src='data:image/svg\+xml;charset=utf-8,([^']*)'""", page)
    assert len(found) == page.count("<img")
    for _, data in found:
        ElementTree.fromstring(urllib.parse.unquote(data))
    return {html.unescape(words): urllib.parse.unquote(data) for words, data in found}


def test_the_motions_are_those_of_the_file(page, shared):
    """One of each common response, run again to the same bits; its picture says what it
    shows."""
    session = Session(shared / "small.h5")
    results = read_results(shared / "small.h5")
    moving = [text for words, text in pictures(page).items() if words.startswith("The motion at ")]
    assert len(moving) == 2
    assert page.count("it ends in the stored state, bit for bit.") == 2
    for text in moving:
        for words in ("Time [s]", "Bit speed [rad/s]", "Bit force [kN]"):
            assert words in text
    for place in representatives(results, 2):
        motion, trace = motion_of(session, place)
        assert motion.same_bits
        state = list(results.coords["state"]).index("bit_speed")
        assert trace["bit_speed"][-1] == pytest.approx(results["final_state"][place][state], rel=1e-5)


def test_the_diagrams_are_those_of_plot(page, shared):
    (along,) = (text for words, text in pictures(page).items() if words.startswith("Peaks along rotary_speed"))
    for panel in ("axial_peaks", "bit_speed_peaks", "radius_peaks"):
        assert f'id="{panel}:' in along
    assert "Radial peaks" in along


def test_the_title_cannot_leave_its_place(shared, tmp_path):
    (tmp_path / "bad.yaml").write_text(
        "title: '</script><script>alert(1)</script><img src=x onerror=alert(2)>'\n"
        "sweep: {rotary_speed: [3 rad/s, 4 rad/s]}\nsimulation: {transient: 1 s, observe: 1 s}\n"
    )
    runner = CliRunner()
    assert runner.invoke(group, ["run", str(tmp_path / "bad.yaml"), "-o", str(tmp_path / "bad.h5")]).exit_code == 0
    assert made(tmp_path / "bad.h5", "-o", tmp_path / "bad.html").exit_code == 0
    text = (tmp_path / "bad.html").read_text()
    assert "<script>alert" not in text
    own = '<img class="vectors" alt="'
    assert all(one.startswith(own) for one in re.findall("<img.{30}", text))


def test_representatives_are_settled_points_of_the_commonest_responses():
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


def test_bad_input_is_said_and_writes_nothing(shared, tmp_path):
    for arguments, word in (
        (["nothing.h5", "-o", tmp_path / "a.html"], "nothing.h5"),
        ([shared / "small.yaml", "-o", tmp_path / "a.html"], "a study, it seems. Run it first"),
        ([shared / "small.h5", "-o", tmp_path / "a.pdf"], ".html"),
        ([shared / "small.h5", "-o", tmp_path / "no" / "a.html"], "no"),
        ([], "RESULTS"),
    ):
        done = made(*arguments)
        assert done.exit_code != 0
        said = str(done.exception) if done.exception and not isinstance(done.exception, SystemExit) else done.output
        assert word in said, (arguments, said)
        assert not list(tmp_path.iterdir())
    (tmp_path / "there.html").write_text("mine")
    assert made(shared / "small.h5", "-o", tmp_path / "there.html").exit_code != 0
    assert (tmp_path / "there.html").read_text() == "mine"


def test_failed_points_are_in_the_report(shared, tmp_path):
    assert made(shared / "failing.h5", "-o", tmp_path / "a.html").exit_code == 0
    assert "Failed points" in (tmp_path / "a.html").read_text()


def words_of(page: str) -> str:
    """The words of a page without its pictures and scripts, in order."""
    text = re.sub(r"<script.*?</script>|<style>.*?</style>|<!--.*?-->|<img[^>]*>", "", page, flags=re.S)
    return " ".join(html.unescape(re.sub(r"<[^>]+>", " ", text)).split())


def window_of(results: Results, severity: int | None = None) -> Answer:
    """The window of results, as a page has it."""
    return find_window(results_for_window(results, severity), severity)


def first_lines(path: Path) -> str:
    """What stands before the diagrams."""
    return words_of(path.read_text(encoding="utf-8")).partition("Diagrams")[0]


def test_the_answer_is_first_and_how_it_was_made_last(page, shared):
    """The sentence of ``nsdrill window``, then diagrams, motions, numbers, digests."""
    text, attrs = words_of(page), read_results(shared / "small.h5").attrs
    sentence = answer(window_of(read_results(shared / "small.h5")), "si")
    places = [
        text.index(wanted)
        for wanted in (sentence, "Diagrams", "Motions", "Numbers", "How this was made", str(attrs["study_sha256"]))
    ]
    assert places == sorted(places)
    assert text.startswith("Small – nsdrill Small small.h5 Studied: speed 1 to 8 rad/s (")
    assert text.partition("depth ")[2].partition(". ")[2].startswith(sentence)


def test_every_warning_of_the_text_stands_once_in_the_first_lines(page, shared):
    """Neither below the numbers nor in the picture a second time."""
    drawn = "".join(pictures(page).values())
    said = list(warnings(window_of(read_results(shared / "small.h5")), "si"))
    assert said
    for one in said:
        words = without_keys(" ".join(one.split()))
        assert words in words_of(page).partition("Diagrams")[0]
        assert words_of(page).count(words) == 1
        assert one.partition(":")[0].partition(" at ")[0] not in drawn


def test_what_limits_the_answer_stands_beside_it(page):
    """The recipient of a page has no documentation."""
    text = words_of(page)
    assert text.count(LIMITS) == 1
    assert text.index(LIMITS) < text.index("Diagrams")
    for wanted in ("Not validated against field data", "rate of penetration has default constants"):
        assert wanted in LIMITS


def test_the_window_of_a_page_is_by_severity_or_confidence(shared, tmp_path):
    """As in ``nsdrill window``, and in the command that writes the page again."""
    assert made(shared / "map.h5", "-o", tmp_path / "a.html", "--severity", "4").exit_code == 0
    page = (tmp_path / "a.html").read_text(encoding="utf-8")
    window = window_of(read_results(shared / "map.h5"), 4)
    assert window["safe"] > window_of(read_results(shared / "map.h5"))["safe"]
    assert answer(window, "si") in words_of(page)
    assert "--severity 4</code>" in page
    done = made(shared / "map.h5", "-o", tmp_path / "b.html", "--confidence", "80")
    assert "confidence: found results without samples" in str(done.exception)
    assert not (tmp_path / "b.html").exists()


def test_the_title_is_that_of_the_user(shared, tmp_path):
    """A weight in a title stays as it was written, whatever the units of the page."""
    source = tmp_path / "own.h5"
    shutil.copy(shared / "small.h5", source)
    with h5py.File(source, "r+") as file:
        study = json.loads(file.attrs["study_resolved"])
        study["title"] = "My well at 15 klbf and 60 rpm"
        file.attrs["study_resolved"] = json.dumps(study)
        file.attrs["title"] = study["title"]
    assert made(source, "-o", tmp_path / "own.html").exit_code == 0
    assert "<h1>My well at 15 klbf and 60 rpm</h1>" in (tmp_path / "own.html").read_text()


def test_two_files_are_compared_and_named(shared, tmp_path):
    """Of one title and one name: told apart by their folders."""
    (tmp_path / "other").mkdir()
    other = tmp_path / "other" / "map.h5"
    shutil.copy(shared / "map.h5", other)
    assert made(shared / "map.h5", other, "-o", tmp_path / "two.html").exit_code == 0
    text = first_lines(tmp_path / "two.html")
    assert "common points safe; " in text
    assert text.count(LIMITS) == 1
    assert text.index("THE MAP ENDS") < text.index(LIMITS) < text.index("a: ", text.index(LIMITS))
    assert text.count("THE MAP ENDS") == 1, "of both, and not again with the answer of each"
    assert "The studies are the same." in text
    for name in (f"a: {shared / 'map.h5'}", f"b: {other}"):
        assert name in text
    assert "The two compared" in text


def test_files_that_cannot_be_compared_say_so_first(shared, tmp_path):
    assert made(shared / "map.h5", shared / "small.h5", "-o", tmp_path / "two.html").exit_code == 0
    text = first_lines(tmp_path / "two.html")
    assert "The two windows are not compared: " in text
    assert text.index("not compared") < text.index("Nothing is safe")


def test_what_is_wrong_with_the_input_is_in_the_first_lines(shared, tmp_path):
    """One axis, one history, failed runs, no safe point, runs that are missing, a single
    point."""
    data = read_results(shared / "small.h5")
    assert made(shared / "small.h5", "-o", tmp_path / "a.html").exit_code == 0
    assert "ONE AXIS ONLY" in first_lines(tmp_path / "a.html")
    assert made(shared / "map.h5", "-o", tmp_path / "b.html").exit_code == 0
    assert "HISTORY WAS NOT EXAMINED" in first_lines(tmp_path / "b.html")
    assert made(shared / "failing.h5", "-o", tmp_path / "c.html").exit_code == 0
    assert "runs failed, at" in first_lines(tmp_path / "c.html")
    data["response"][:] = 4
    assert "Nothing is safe: whirl at 1 to 8 rad/s" in words_of(file_answer(data, "si", False))
    data["status"][:, :, :, 2] = 0
    text = words_of(file_answer(data, "si", False))
    assert "NOT ALL HAS RUN: 2 of 16 runs are missing" in text
    lone = {name: values[:1] for name, values in data.coords.items() if name in data.grid}
    point = Results(
        {**data.coords, **lone},
        {name: values[tuple(slice(0, 1) for _ in data.grid)] for name, values in data.variables.items()},
        data.attrs,
    )
    text = words_of(file_answer(point, "si"))
    assert text.startswith("2000 m, 22.2 kN, 1 rad/s (9.55 rpm): whirl. ONE SETTING ONLY")


UNKNOWN = """
title: Unknown
drillstring: {eccentricity: 12.7 mm}
bit: {lobes: 1, surface_amplitude: 1 mm}
operation: {depth: 3000 m, wob: 40 kN, rotary_speed: 8 rad/s}
simulation: {transient: 10 s, observe: 1 s}
uncertain:
  drillstring.eccentricity: {triangular: [1 mm, 2 mm, 40 mm]}
  bit.rock_stiffness: {lognormal: {median: 25 MN/m, factor: 1.6}}
  samples: 32
"""
SWEEP = {"sweep": {"rotary_speed": ["3 rad/s", "8 rad/s"], "wob": ["20 kN", "40 kN"]}}


@pytest.fixture(scope="module")
def unknown(tmp_path_factory):
    """Files with samples: of one point, and of two speeds and weights."""
    folder = tmp_path_factory.mktemp("unknown")
    for name, change in (("point", {}), ("map", SWEEP)):
        nsdrill.run(UNKNOWN, folder / f"{name}.h5", set=change, progress=False)
    return folder


def test_the_outcome_of_a_single_point_is_its_answer(unknown, tmp_path):
    """With samples the probabilities that ``nsdrill probability`` has, and what had not
    settled; without the brackets of a program."""
    found = nsdrill.probability(unknown / "point.h5")
    shares = {name: float(found.probability.sel(outcome=name)) for name in found.outcome.values.tolist()}
    settled = read_results(unknown / "point.h5")["settled"]
    assert 0.0 < shares["whirl"] < 1.0
    assert made(unknown / "point.h5", "-o", tmp_path / "point.html").exit_code == 0
    text = first_lines(tmp_path / "point.html")
    assert f"3000 m, 40 kN, 8 rad/s (76.4 rpm): safe with a probability of {100 * shares['safe']:.1f} % (" in text
    assert f"; whirl {100 * shares['whirl']:.1f} % (" in text
    assert f"NOT SETTLED: in {np.count_nonzero(settled == 0)} of 32 runs " in text
    assert "No window" not in text
    assert "Run with a longer transient." in text


def test_what_to_measure_first_is_that_of_the_point_of_the_answer(unknown):
    """Not on average over the map, and by the severity of the page."""
    results = read_results(unknown / "map.h5")
    for severity in (None, 3):
        best = window_of(results, severity)
        point = best["maps"][0]["recommended"] or best["most_probable"]
        at = {axis: point[axis] for axis in ("rotary_speed", "wob")}
        told = without_keys(conclusion(sensitivity(results, severity, at)))
        assert "At this point " + told[0].lower() + told[1:] in words_of(file_answer(results, "si", severity=severity))


def test_what_was_studied_is_said_in_words_and_units(unknown, shared, tmp_path):
    assert made(unknown / "map.h5", "-o", tmp_path / "a.html", "--units", "field").exit_code == 0
    text = first_lines(tmp_path / "a.html").partition("Studied: ")[2]
    for wanted in (
        "weight on bit 4.5 to 9 klbf (2 values); speed 28.6 to 76.4 rpm (2 values); ",
        "; bit lobes 1; ",
        "; depth 9843 ft; ",
        "; eccentricity assumed triangular 0.03937 in, 0.07874 in, 1.575 in; ",
        "bit rock stiffness assumed lognormal median 142754 lbf/in, factor 1.6. ",
    ):
        assert wanted in text, wanted
    assert "drillstring." not in text


def test_of_three_files_it_is_said_that_two_are_compared(unknown, shared, tmp_path):
    files = (unknown / "map.h5", shared / "map.h5", shared / "small.h5")
    assert made(*files, "-o", tmp_path / "a.html", "--motions", "0").exit_code == 0
    text = first_lines(tmp_path / "a.html")
    assert text.index("other files stand side by side") < text.index(LIMITS) < text.index("1: ", text.index(LIMITS))


def test_the_window_is_a_picture_of_vectors_with_words(page):
    [text] = [text for words, text in pictures(page).items() if words.startswith("Nothing is safe: ")]
    assert "Rotary speed [rad/s]" in text
    assert "<image" not in text  # nothing is made of pixels


def sheet_of(*arguments: str | Path) -> str:
    """The text of one page that was written."""
    done = made(*arguments, "--one-page")
    assert done.exit_code == 0, done.output
    return Path(arguments[list(arguments).index("-o") + 1]).read_text(encoding="utf-8")


@pytest.mark.parametrize(("paper", "size"), [("A4", "A4"), ("letter", "letter")])
def test_one_page_has_all_fields(shared, tmp_path, paper, size):
    """The answer, its orders, three numbers, the map, the limits by weight, the warnings, and
    whose page it is."""
    given = ("--paper", paper, "--well", "A-7", "--rig", "R <12>", "--author", "B & C")
    text = sheet_of(shared / "map.h5", "-o", tmp_path / "one.html", *given)
    assert f"@page {{ size: {size}; }}" in text
    results = results_for_window(shared / "map.h5")
    found = find_window(results)
    orders = Orders(*needed_for_words(found, "si"))
    words = html.unescape(re.sub(r"<style>.*?</style>|<[^>]*>", " ", text, flags=re.DOTALL))
    assert orders.sentence() in words
    for order in (*orders.do(), *orders.do_not()):
        assert order in words
    assert 0 < len(orders.do_not()) <= 5
    for warning in list(warnings(found, "si"))[:3]:
        assert in_rig_words(warning).partition(":")[2] in words
    for wanted in ("Well A-7", "Rig R <12>", "Prepared by B & C", "Date 20", "DO NOT", "page 1 of 1"):
        assert wanted in " ".join(words.split()), wanted
    assert "<12>" not in text
    assert str(results.attrs["study_sha256"])[:12] in words
    assert len(re.findall(r"<div><b>[^<]+</b>[^<]+</div>", text.partition("class='numbers'")[2])) == 3
    rows = re.findall(r"<tr[^>]*><td>([^<]+)</td>", text)
    assert rows == [f"{value / 1e3:g} kN" for value in np.sort(results["wob"])[::-1]]
    assert text.count('class="vectors"') == 1
    assert "<script" not in text
    assert "default-src 'none'" in html.unescape(text)


def test_the_date_of_one_page_is_that_of_the_run_or_given(shared, tmp_path):
    """Not of the day on which it is printed; the run has its date at the end too."""
    run = str(results_for_window(shared / "map.h5").attrs["created"])[:10]
    for number, (given, date) in enumerate((((), run), (("--date", "1 May 2031"), "1 May 2031"))):
        text = sheet_of(shared / "map.h5", "-o", tmp_path / f"{number}.html", *given)
        assert f"<div><b>Date</b> {date}</div>" in text
        assert f"run {run}" in text
    with pytest.raises(nsdrill.InputError, match="date: found with a report of several pages; allowed: with one_page"):
        nsdrill.report(shared / "map.h5", tmp_path / "x.html", date="1 May 2031")


def test_one_page_of_what_is_not_given_has_lines_for_the_pen(shared, tmp_path):
    text = sheet_of(shared / "map.h5", "-o", tmp_path / "one.html")
    for name in ("Well", "Rig", "Prepared by"):
        assert f"<div><b>{name}</b> </div>" in text


def test_one_page_names_files_by_labels_or_by_what_differs(shared, tmp_path):
    """Never by their own names, which stand below where there are no labels."""
    nsdrill.run(shared / "map.yaml", tmp_path / "other_file.h5", set={"drive.kind": "stiff"}, progress=False)
    files = (shared / "map.h5", tmp_path / "other_file.h5")
    text = sheet_of(*files, "-o", tmp_path / "two.html")
    heads = re.findall(r"<th class='g' colspan='3'>([^<]*)</th>", text)
    assert heads == ["ideal drive", "stiff drive"]
    assert text.count("other_file") == 1, "with its digest, below"
    text = sheet_of(*files, "-o", tmp_path / "named.html", "--label", "old <rig>", "--label", "new rig")
    assert re.findall(r"<th class='g' colspan='3'>([^<]*)</th>", text) == ["old &lt;rig&gt;", "new rig"]
    assert "other_file" not in text
    assert "map.h5" not in text


def test_python_writes_the_same_page_for_the_rig(rendered, shared, tmp_path):
    text = sheet_of(shared / "map.h5", "-o", tmp_path / "one.html", "--paper", "letter", "--label", "A", "--well", "W")
    again = nsdrill.report(
        shared / "map.h5", tmp_path / "again.html", one_page=True, paper="letter", label="A", well="W"
    )
    assert Path(again).read_text(encoding="utf-8") == text


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"well": "A-7"}, "well: found with a report of several pages; allowed: with one_page"),
        ({"paper": "letter"}, "paper: found with a report of several pages"),
        ({"one_page": True, "paper": "A5"}, "paper: found 'A5'; allowed: A4, letter"),
        ({"one_page": True, "motions": 1}, "motions: found with one_page"),
        ({"one_page": True, "label": ["a", "b"]}, "label: found 2 names; allowed: 1, one for each file"),
        ({"one_page": True, "results": "three"}, "one_page: found with 3 files; allowed: with one or two"),
        ({"one_page": True, "results": "study"}, "found a study; allowed: results"),
    ],
)
def test_what_one_page_cannot_be_is_refused(shared, tmp_path, given, words):
    """And nothing is written."""
    which = given.pop("results", None)
    results = {None: shared / "map.h5", "three": 3 * [shared / "map.h5"], "study": shared / "map.yaml"}[which]
    with pytest.raises(nsdrill.NsdrillError, match=re.escape(words)):
        nsdrill.report(results, tmp_path / "x.html", **given)
    assert not (tmp_path / "x.html").exists()


def test_one_page_of_samples_has_intervals_over_them(unknown, tmp_path):
    text = sheet_of(unknown / "map.h5", "-o", tmp_path / "one.html")
    numbers = text.partition("class='numbers'")[2].partition("class='map'")[0]
    assert re.search(r"5 to 95 % of \d+ samples|none in 95 % of \d+ samples", numbers)
    assert f"<div class='answer {'no' if 'Nothing' in text or 'hint' in text else 'yes'}'>" in text
    with pytest.raises(nsdrill.InputError, match="found a single operating point"):
        nsdrill.report(unknown / "point.h5", tmp_path / "x.html", one_page=True)


def test_the_report_begins_with_the_answer_its_lines_and_three_warnings(shared):
    results = results_for_window(shared / "map.h5")
    found = find_window(results)
    page = file_answer(results, "si")
    words = Orders(*needed_for_words(found, "si"))
    told = list(warnings(found, "si"))
    places = [page.index(html.escape(text, quote=True)) for text in (words.sentence(), *words.lines())]
    assert places == sorted(places)
    first = re.findall(r"<li>(.*?)</li>", page.partition('class="warnings"')[2].partition("</ul>")[0])
    assert first == [html.escape(without_keys(text), quote=True) for text in told[:3]]
    for text in told:
        assert html.escape(without_keys(text), quote=True) in page, "the others further down"


if BROWSER is None:
    pytest.skip("no browser: apt-get install chromium", allow_module_level=True)


@pytest.fixture(scope="module")
def report(shared, tmp_path_factory):
    """Lines with motions, and a map."""
    out = tmp_path_factory.mktemp("print") / "report.html"
    done = made(shared / "small.h5", shared / "map.h5", "-o", out, "--motions", "1")
    assert done.exit_code == 0, done.output
    return out


@pytest.fixture(scope="module")
def printed(report):
    """As printed from the command line of the browser, without any waiting."""
    out = report.with_suffix(".pdf")
    subprocess.run(
        [
            str(BROWSER),
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--no-pdf-header-footer",
            f"--print-to-pdf={out}",
            report.as_uri(),
        ],
        check=True,
        capture_output=True,
        timeout=120,
    )
    return pages(out)


def test_every_chart_is_printed_with_its_last_label(printed):
    """The words of a chart are on one page: the axis, and its last tick."""
    text = "\n".join(printed)
    for words, last in (
        ("Rotaryspeed[rad/s]", "8"),  # the peaks of the sweep
        ("Radialpeaks", ""),
        ("Rotaryspeed[rpm]" if "Rotaryspeed[rpm]" in text else "Rotaryspeed[rad/s]", ""),
        ("Time[s]", ""),
        ("Bitforce[kN]", ""),
        ("Bitspeed[rad/s]", ""),
        ("Weightonbit[kN]", "100"),
    ):
        assert any(words in page and last in page for page in printed), words
    # the ticks of the lowest panel stand before its label: the last one is there
    assert re.search(r"7(8)?Rotaryspeed\[rad/s\]", text)


def test_the_answer_is_on_the_first_page_and_provenance_on_the_last(printed):
    assert re.search("Runat|Nothingissafe", printed[0])
    assert "HISTORYWASNOTEXAMINED" in printed[0] + printed[1]
    assert "SHA-256" not in "".join(printed[: len(printed) // 2])
    assert "SHA-256" in "".join(printed[-2:])
    assert 4 <= len(printed) <= 12


@pytest.fixture(scope="module")
def two(unknown):
    nsdrill.run(UNKNOWN, unknown / "b.h5", set={**SWEEP, "drive.kind": "soft_torque"}, progress=False)
    return Path(nsdrill.report([unknown / "map.h5", unknown / "b.h5"], unknown / "two.html", motions=0))


@pytest.mark.parametrize("paper", ["A4", "Letter"])
def test_the_first_printed_page_of_two_files_is_complete(chromium, two, tmp_path, paper):
    """What was studied, the answer, the table, the warnings, the limits."""
    page = chromium.new_page()
    page.goto(two.as_uri())
    page.pdf(path=tmp_path / "two.pdf", format=paper, print_background=True)
    page.close()
    first = pages(tmp_path / "two.pdf")[0]
    wanted = ("Studiedinboth:", "softtorquedrive(b)", "safepoints", "Aresponsecountsfromhere", "HISTORYWASNOTEXAMINED")
    places = [first.index(one) for one in (*wanted, "Notvalidatedagainstfielddata")]
    assert places == sorted(places)


@pytest.mark.parametrize("paper", ["A4", "letter"])
@pytest.mark.parametrize("files", [("map.h5",), ("map.h5", "map.h5"), ("small.h5",)])
def test_one_page_prints_on_one_sheet_with_nothing_cut(rendered, chromium, shared, tmp_path, paper, files):
    """Also with the longest names; nothing reaches beyond the sheet or lies over another
    part."""
    names = [word for _ in files for word in ("--label", "A long name of a drilling rig and its drive")]
    out = tmp_path / "one.html"
    sheet_of(*(shared / name for name in files), "-o", out, "--paper", paper, "--well", 60 * "W", "--rig", "R", *names)
    page = chromium.new_page()
    page.goto(out.as_uri())
    page.pdf(path=tmp_path / "one.pdf", prefer_css_page_size=True, print_background=True)
    [words] = pages(tmp_path / "one.pdf")
    assert "page1of1" in words
    assert "DONOT" in words
    page.emulate_media(media="print")
    boxes = page.evaluate(
        "JSON.stringify([...document.querySelectorAll('main > *')].map(e => e.getBoundingClientRect()))"
    )
    parts = json.loads(boxes)
    main = json.loads(page.evaluate("JSON.stringify(document.querySelector('main').getBoundingClientRect())"))
    assert all(main["left"] - 1 <= one["left"] and one["right"] <= main["right"] + 1 for one in parts)
    assert parts[-1]["bottom"] <= main["bottom"] + 1
    assert all(above["bottom"] <= below["top"] + 1 for above, below in pairwise(parts))
    page.close()


@pytest.mark.parametrize("paper", ["A4", "Letter"])
@pytest.mark.parametrize("width", [400, 1280, 2000])
def test_the_window_does_not_decide_what_is_printed(chromium, report, printed, tmp_path, paper, width):
    context = chromium.new_context(viewport={"width": width, "height": 900})
    page = context.new_page()
    page.goto(report.as_uri())
    page.pdf(path=tmp_path / "a.pdf", format=paper, print_background=True)
    words = "".join(pages(tmp_path / "a.pdf"))
    for label in ("Rotaryspeed[rad/s]", "Time[s]", "Bitforce[kN]", "Weightonbit[kN]"):
        assert words.count(label) == "".join(printed).count(label), label
    # on the screen the page is no wider than the window, on paper than the paper
    assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")
    page.emulate_media(media="print")
    page.set_viewport_size({"width": 690, "height": 1000})
    wide = page.evaluate(
        "JSON.stringify([...document.querySelectorAll('img, table, pre')]"
        ".map(e => e.getBoundingClientRect()).filter(r => r.width).map(r => r.right))"
    )
    assert max(json.loads(wide)) <= 690.5
    context.close()


def test_a_notebook_shows_the_explorer_in_a_frame(shared):
    with nsdrill.view(shared / "small.h5", height=700) as view:
        found = re.fullmatch(
            r'<iframe src="(http://127\.0\.0\.1:\d+/#[\w-]+)" .*height="700".*></iframe>', view._repr_html_()
        )
        assert found
        assert found[1] == view.url
        assert view.url in repr(view)
        with urllib.request.urlopen(view.url, timeout=120) as page:
            assert b"nsdrill" in page.read()
            assert "frame-ancestors" in page.headers["Content-Security-Policy"]
    assert repr(view) == "The explorer of small.h5, closed"
    assert "iframe" not in view._repr_html_()
    with pytest.raises(OSError, match="refused"):
        urllib.request.urlopen(view.url, timeout=120)


def test_wrong_arguments(shared):
    with pytest.raises(nsdrill.InputError, match="height"):
        nsdrill.view(shared / "small.h5", height=3)
    with pytest.raises(nsdrill.InputError, match="unit"):
        nsdrill.view(shared / "small.h5", units="rods")
    with pytest.raises(nsdrill.FileError):
        nsdrill.view(shared / "nothing.h5")
    with pytest.raises(nsdrill.InputError, match="Save them first"), nsdrill.open_results(shared / "small.h5") as found:
        nsdrill.view(found)
    with pytest.raises(nsdrill.InputError):
        nsdrill.view(shared / "small.yaml", set={"operation.wob": "3 mm"})


def test_a_sweep_along_the_depth_was_carried_deeper_and_shallower(rendered, tmp_path):
    study = {
        "sweep": {
            "depth": {"from": "1 km", "to": "3 km", "points": 5},
            "wob": {"from": "10 kN", "to": "40 kN", "points": 5},
            "procedure": "up-down",
            "along": "depth",
        },
        "simulation": {"transient": "1 s", "observe": "1 s"},
    }
    nsdrill.run(study, tmp_path / "deep.h5")
    page = nsdrill.report(tmp_path / "deep.h5", tmp_path / "page.html", motions=1)
    text = Path(page).read_text(encoding="utf-8")
    assert "carried deeper and shallower" in text
    (drawn,) = (shown for words, shown in pictures(text).items() if words.startswith("Responses over "))
    for wanted in ("carried deeper", "carried shallower", "deeper and shallower compared"):
        assert wanted in drawn, wanted
    assert choices(read_results(tmp_path / "deep.h5"), "si")["ways"] == ["deeper", "shallower"]
    assert "Where up (deeper) and down (shallower) differ" in nsdrill.show(tmp_path / "deep.h5")
