"""Where one drills: points outside are run up through, and never allowed."""

import html
import shlex

import pytest
from figures.test_wording import SPEEDS, WALL, WEIGHTS, made

import nsdrill
from nsdrill.analysis.advice import Kind
from nsdrill.analysis.window import find_window
from nsdrill.app.answering.answers import drilled_within, plain_window, results_for_window
from nsdrill.cli.main import main
from nsdrill.errors import InputError
from nsdrill.text.window_text import lines
from nsdrill.units import to_si
from nsdrill.words.answer import needed_for_words, obstacle_words, shown_first, warnings, words_of
from nsdrill.words.orders import Orders

from .grids import told

pytestmark = pytest.mark.usefixtures("words_only")

RPM = to_si("1 rpm", "rad/s")
LINES = {"up": ["......."] * 5, "down": ["......."] * 5}
WITHIN = {"rotary_speed": ("100 rpm", "130 rpm")}


def test_points_outside_are_not_allowed_nor_recommended():
    data = made(**LINES)
    free, found = find_window(results_for_window(data)), find_window(results_for_window(data, within=WITHIN))
    assert (free["safe"], found["safe"]) == (35, 20)
    assert free["within"] is None
    assert found["within"]["run_up"] == 15
    assert found["answer"].point["rotary_speed"] >= 100 * RPM
    ends = found["answer"].stay_within["rotary_speed"]
    assert ends.low == pytest.approx(100 * RPM)
    assert (ends.below.outside, ends.below.grade) == (True, None)
    assert all(row["safe"] == [[SPEEDS[3], SPEEDS[6]]] for row in found["maps"][0]["rows"])
    assert "the range given to drill in is 100 to 130 rpm" in " ".join(words_of(found, "field").lines())
    assert "DRILLED WITHIN speed 100 to 130 rpm only: 15 other points" in next(iter(warnings(found, "field")))
    plain = plain_window(found, "si")
    assert plain["answer"]["stay_within"]["rotary_speed"]["below"]["outside"] is True
    assert plain["maps"][0]["recommended"]["margins"]["rotary_speed"]["less"]["why"] == "outside"


def test_all_counts_are_of_the_points_where_one_drills():
    """They counted points as safe that are not allowed; the run-up has a number of its own."""
    sticks = made(up=["s......"] * 5, down=["s......"] * 5)
    found = find_window(results_for_window(sticks, within=WITHIN))
    assert (found["points"], sum(found["grades"].values())) == (20, 20)
    assert [found[name] for name in ("safe", "rim", "critical", "unknown")] == [20, 0, 0, 0]
    assert (found["share"]["safe"], found["maps"][0]["share"]["safe"]) == (1.0, 1.0)
    assert found["maps"][0]["regions"][0]["share"] == 1.0
    assert found["obstacles"]["stick_slip"] == 0
    assert ", 20 points where one drills: 20 safe from below." in " ".join(lines(found, "field", everything=True))
    whole = find_window(results_for_window(sticks))
    assert (whole["points"], whole["safe"], whole["critical"], whole["obstacles"]["stick_slip"]) == (35, 30, 5, 5)


@pytest.mark.parametrize(("line", "is_asked"), [("s......", True), ("sss.www", False)])
def test_what_was_asked_makes_nothing_vibrate(line, is_asked):
    """A hint that has no room where one drills, while the map is free beyond, is said to have none there; where it
    vibrates beyond, a small change may make it vibrate."""
    within = {"rotary_speed": ("100 rpm", "105 rpm")}
    found = find_window(results_for_window(made(up=[line] * 5, down=[line] * 5), within=within))
    assert (found["answer"].kind, found["answer"].by_request) == (Kind.HINT, is_asked)
    order = Orders(*needed_for_words(found, "field")).do()[0]
    assert ("may make it vibrate" in order) != is_asked
    assert ("the range asked for leaves no room around it" in order) == is_asked


def test_the_way_up_still_decides_inside():
    """The run-up is where the string vibrates first: what it met counts."""
    sticks = made(up=["sss...."] * 5, down=["sss...."] * 5)
    found = find_window(results_for_window(sticks, within=WITHIN))
    assert found["safe"] == 20
    assert found["answer"].way_in.through == pytest.approx(SPEEDS[2])


@pytest.mark.parametrize("within", [None, WITHIN])
def test_what_the_way_in_passes_is_told_where_one_does_not_drill(within):
    """The map's own borders: stick-slip that may last at 90 rpm, and a vibration at 75 to 78 rpm that a step may jump
    across, concern a string that is brought up through there, wherever one drills."""
    sticks = made(up=["ss....."] * 5, down=["s......"] * 5)
    found = find_window(drilled_within(told(sticks, [92 * RPM] * 5), within))
    assert "stick-slip, once started, may last to 92 rpm" in words_of(found, "field").sentence()
    assert any("STICK-SLIP MAY LAST" in text for text in warnings(found, "field"))
    assert found["answer"].stay_within["rotary_speed"].below.sticks_to == pytest.approx(92 * RPM)
    steps = {**WALL, "jumped": {"from": 75 * RPM, "to": 78 * RPM, "enough": 2 * RPM, "step": 10 * RPM}}
    found = find_window(drilled_within(made(steps, **LINES), within))
    said = list(warnings(found, "field"))
    assert any("MAY JUMP" in text for text in said[: shown_first(said)])
    assert "may jump across whirl at 75 to 78 rpm" in words_of(found, "field").sentence()


def test_where_one_drills_takes_the_place_of_no_warning():
    said = ["DRILLED WITHIN 100 to 130 rpm only.", *(f"WARNING {number}." for number in range(5))]
    assert shown_first(said) == shown_first(said[1:]) + 1


def test_weights_and_several_axes():
    both = {"rotary_speed": (100 * RPM, 110 * RPM), "wob": (WEIGHTS[1], WEIGHTS[2])}
    assert find_window(results_for_window(made(**LINES), within=both))["safe"] == 4
    pairs = [("rotary_speed", "100rpm..110rpm"), ("wob", "15klbf..20klbf")]
    assert find_window(results_for_window(made(**LINES), within=pairs))["safe"] == 4


@pytest.mark.parametrize(
    ("within", "says"),
    [
        ({"depth": (1.0, 2.0)}, "what is set and was swept: wob or rotary_speed"),
        ({"rotary_speed": "100 rpm"}, "two values"),
        ({"rotary_speed": "130 rpm..100 rpm"}, "the lower end first"),
        ({"rotary_speed": ("100 m", "130 rpm")}, "rotary_speed"),
        (7, "a mapping"),
    ],
)
def test_what_is_no_range_is_refused(within, says):
    with pytest.raises(InputError, match="within") as error:
        results_for_window(made(**LINES), within=within)
    assert says in str(error.value)


@pytest.fixture(scope="module")
def speeds(tmp_path_factory):
    path = str(tmp_path_factory.mktemp("within") / "speeds.h5")
    nsdrill.run(
        "{model: torsion, sweep: {rotary_speed: [12 rad/s, 14 rad/s, 16 rad/s]}, "
        "simulation: {transient: 5 s, observe: 5 s}}",
        path,
        progress=False,
    )
    return path


def test_python_takes_it(speeds):
    found = nsdrill.window(speeds, within={"rotary_speed": (13.0, 20.0)})
    assert found["within"]["ranges"]["rotary_speed"] == {"axis": "rotary_speed", "from": 13.0, "to": 20.0}


@pytest.mark.parametrize(
    "within", [{"rotary_speed": (13.0, 20.0)}, [("rotary_speed", "13 rad/s..20 rad/s")]], ids=["numbers", "text"]
)
def test_a_report_takes_it_as_the_window_does(speeds, tmp_path, within, monkeypatch):
    """Its answer is that of the window, and the command line at its end makes the page again."""
    nsdrill.report(speeds, tmp_path / "all.html")
    nsdrill.report(speeds, tmp_path / "some.html", within=within)
    whole, some = ((tmp_path / f"{name}.html").read_text() for name in ("all", "some"))
    sentence = nsdrill.window(speeds, within=within)["answer"]["sentence"]
    assert sentence in some
    assert sentence not in whole
    assert ("DRILLED WITHIN" in some, "DRILLED WITHIN" in whole) == (True, False)
    again = some.split("This page: <code>")[1].split("</code>")[0]
    words = shlex.split(html.unescape(again))
    assert words[words.index("--within") + 1].split("=")[0] == "rotary_speed"
    monkeypatch.setattr("sys.argv", [*words, "--overwrite"])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 0
    assert (tmp_path / "some.html").read_text() == some


def test_two_files_are_both_drilled_within(speeds, tmp_path):
    nsdrill.report([speeds, speeds], tmp_path / "two.html", within={"rotary_speed": (13.0, 20.0)})
    assert "a and b: DRILLED WITHIN" in (tmp_path / "two.html").read_text()


def test_a_report_refuses_what_is_no_range(speeds, tmp_path):
    with pytest.raises(InputError, match="what is set and was swept"):
        nsdrill.report(speeds, tmp_path / "no.html", within={"depth": (1.0, 2.0)})


def test_a_side_where_one_does_not_drill_names_what_vibrates_there():
    found = find_window(drilled_within(made(up=["sss...."] * 5, down=["sss...."] * 5), WITHIN))
    side = found["maps"][0]["recommended"]["margins"]["rotary_speed"]["less"]
    assert (side["why"], side["responses"]) == ("outside", ["stick_slip"])
    assert obstacle_words(side["why"], side["responses"]) == "not drilled, stick-slip"
    assert "at 90 rpm, not drilled, it sticks" in " ".join(words_of(found, "field").lines())
