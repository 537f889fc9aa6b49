"""A model of another package with two critical responses of its own: bits, thresholds,
words and colours follow its declaration in every command, and nothing of a drill string is
said."""

import csv
import json
import pickle

import h5py
import pytest

from models.installed import HERE, install, python
from models.test_own_axes import SCRIPT, drilling, written
from nsdrill.figures.style import SAFE_COLOUR
from nsdrill.models.responses import RESPONSES, Response, own, severity_levels, severity_words
from nsdrill.variables import feature, fraction

STUDIES = {
    "line.yaml": """title: Up and down
model: slammed
sweep: {force: {from: 0.1 N, to: 0.4 N, points: 4}, procedure: up-down}
simulation: {transient: 30 s, observe: 60 s}
""",
    "map.yaml": """model: slammed
sweep: {force: {from: 0.05 N, to: 0.4 N, points: 4}, ratio: [1.0, 1.2], procedure: up-down, along: force}
simulation: {transient: 30 s, observe: 30 s, verify: true}
""",
    "unknown.yaml": """model: slammed
sweep: {force: [0.02 N, 0.3 N]}
uncertain: {oscillator.damping: {uniform: [0.1 N*s/m, 0.2 N*s/m]}, samples: 16}
simulation: {transient: 30 s, observe: 30 s}
""",
    "starts.yaml": "model: slammed\ninitial: {ensemble: 4}\nsimulation: {transient: 30 s, observe: 30 s}\n",
    "plain.yaml": "model: forced\nsweep: {force: [0.1 N, 0.2 N]}\nsimulation: {transient: 30 s, observe: 30 s}\n",
    "rough.yaml": "model: rough\nsweep: {force: [0.1, 0.2]}\nsimulation: {transient: 30 s, observe: 30 s}\n",
    "rubbed.yaml": """model: rubbed
sweep: {force: {from: 0.1, to: 0.4, points: 4}, procedure: up-down}
simulation: {transient: 30 s, observe: 60 s}
""",
}
FILES = ("line", "map", "unknown", "starts", "plain", "rough", "rubbed")
COMMANDS = [
    ["new", "--model", "slammed", "--all", "-o", "all.yaml"],
    *(["run", f"{name}.yaml", "-o", f"{name}.h5"] for name in FILES),
    *(["show", f"{name}.h5", *more] for name in FILES for more in ([], ["--json"])),
    ["classify", "line.h5", "--set", "classify.fast.pace_max=1.1 m/s", "-o", "other.h5"],
    *(["window", name, *more] for name in ("line.h5", "map.h5", "unknown.h5", "other.h5") for more in ([], ["--json"])),
    *(["window", "line.h5", "--severity", grade, "--json"] for grade in ("0", "1")),
    ["diff", "line.h5", "other.h5"],
    ["run", "rubbed.yaml", "-o", "wider.h5", "--set", "sweep.force.to=0.5"],
    *(["window", "rubbed.h5", *more] for more in ([], ["--json"], ["wider.h5"])),
    ["diff", "rubbed.h5", "wider.h5"],
    ["sensitivity", "unknown.h5"],
    ["export", "line.h5", "-o", "line.csv"],
    ["report", "line.h5", "map.h5", "-o", "page.html"],
    ["report", "plain.h5", "-o", "plain.html"],
]
ACCESSOR = """
import nsdrill, json
data = nsdrill.open_results("line.h5")
shown = {name: data.nsdrill.shows(name).values.ravel().tolist() for name in ("fast", "leaning")}
print(json.dumps([shown, data["response"].values.ravel().tolist(), repr(data.nsdrill),
    data.nsdrill.safe(severity=4).values.ravel().tolist()]))
try:
    data.nsdrill.shows("whirl")
except nsdrill.InputError as error:
    print(error)
"""
STYLES = """
from nsdrill.models.registry import described
from nsdrill.figures.style import styles_of
import json, pickle
kind = described("slammed").thresholds
made = pickle.loads(pickle.dumps(kind()))
styles = styles_of({"model": "slammed"})
print(json.dumps([[styles[i].name, styles[i].colour, styles[i].letters] for i in (0, 16, 32, 48)]))
print(json.dumps([[one.name, one.colour] for one in styles_of({"model": "forced"})]))
print(made == kind(), made.fast.hard)
"""


@pytest.fixture(scope="module")
def driven(tmp_path_factory):
    """What each command said, with the folder of the files that they made. The model rough is
    forced in other units: its place is a plain number, its force too; and rubbed is slammed in
    these."""
    folder = tmp_path_factory.mktemp("responses")
    rough = (HERE / "forced.py").read_text().replace('"forced"', '"rough"')
    for given, plain in (('"m", ', '"1", '), ('"m s-1", ', '"1", '), ('"N", ', '"", '), ('"1", 1e3', '"", 1e3')):
        rough = rough.replace(given, plain)
    (folder / "rough.py").write_text(rough)
    slammed = (HERE / "slammed.py").read_text().replace("from forced", "from rough").replace('"slammed"', '"rubbed"')
    (folder / "rubbed.py").write_text(slammed)
    install(folder, "forced", "rough", "slammed", "rubbed")
    for name, text in STUDIES.items():
        (folder / name).write_text(text)
    script = SCRIPT.partition("for name in (")[0] + VIEW + "print(json.dumps(said))\n"
    said = json.loads(python(folder, script, json.dumps(COMMANDS), " ".join(FILES))[-1])
    return folder, {what: (code, text) for what, code, text in said}


VIEW = """
session = Session("line.h5", "si")
told = [session.meta(), session.diagram({"y": "place_peaks"})[0]]
said.append(["view line.h5", 0, json.dumps(told, default=str)])
"""


def test_every_command_takes_them_and_says_nothing_of_a_drill_string(driven):
    folder, said = driven
    failed = {what: text[-1500:] for what, (code, text) in said.items() if code not in (0, 3)}
    assert not failed
    # a window as JSON has the same keys for every model
    texts = {what: text for what, (_, text) in said.items() if not (what.startswith("window") and "--json" in what)}
    spoken = {what: found for what, text in texts.items() if (found := drilling(text))}
    files = [path for path in folder.iterdir() if path.suffix in (".svg", ".html", ".csv")]
    spoken |= {path.name: found for path in files if (found := drilling(written(path)))}
    assert not spoken


def test_bits_follow_the_thresholds_and_are_none_of_a_drill_string(driven):
    """From 16 on; 0.6 m/s and 0.2 m are in the declaration."""
    folder, _ = driven
    with h5py.File(folder / "line.h5") as file:
        bits, label = file["response"][:], file["response"].attrs
        assert label["flag_meanings"] == "fast leaning"
        assert label["flag_masks"].tolist() == [16, 32]
        assert (bits & 16 > 0).tolist() == (file["pace_max"][:] > 0.6).tolist()
        assert (bits & 32 > 0).tolist() == (file["place_mean"][:] > 0.2).tolist()
        graded = (file["pace_max"][:] > 0.6).astype(int) + (file["pace_max"][:] > 1.0)
        assert file["fast_severity"][:].tolist() == graded.tolist()
        assert len(set(bits.ravel().tolist())) > 1
    with h5py.File(folder / "other.h5") as file:
        assert (file["response"][:] & 16 > 0).tolist() == (file["pace_max"][:] > 1.1).tolist()
    with h5py.File(folder / "map.h5") as file:
        assert set(file["tight_response"][:].ravel().tolist()) <= {0, 16, 32, 48}


def test_texts_have_their_words(driven):
    folder, said = driven
    assert "fast swing + leaning" in said["show line.h5"][1]
    counts = json.loads(said["show line.h5 --json"][1])["responses"]
    assert {word for one in counts.values() for word in one} <= {"none", "fast", "leaning", "fast+leaning"}
    window = json.loads(said["window map.h5 --json"][1])
    assert set(window["obstacles"]) == {"fast", "leaning"}
    assert window["model"] == "slammed"
    assert "fast swing at" in said["window line.h5"][1].replace("\n", " ")
    assert "FAST SWING COUNTS ABOVE 1.1 M/S ONLY" in said["window other.h5"][1].replace("\n", " ").replace("  ", " ")
    assert "fast + leaning" in said["diff line.h5 other.h5"][1]
    assert "classify" in (folder / "all.yaml").read_text()
    assert "fast:" in (folder / "all.yaml").read_text()
    with (folder / "line.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert {row["response_words"] for row in rows} <= {"none", "fast", "leaning", "fast+leaning"}
    meta = json.loads(said["view line.h5"][1])[0]
    assert [meta["responses"][code]["name"] for code in (16, 32, 48)] == [
        "fast swing",
        "leaning",
        "fast swing + leaning",
    ]


def test_a_window_by_severity_counts_their_grades(driven):
    """The swing is fast at every point of the way up, mild or hard, and where it leans besides, which has no
    grade, nothing is allowed."""
    folder, said = driven
    with h5py.File(folder / "line.h5") as file:
        grades, leans = file["fast_severity"][0], file["response"][0] & 32 > 0
    assert grades.min() == 1
    for most in (0, 1):
        found = json.loads(said[f"window line.h5 --severity {most} --json"][1])
        allowed = (grades <= most) & ~leans
        assert found["safe"] == allowed.sum()
        assert (found["safe"] == 0) == (most == 0)


def test_words_and_levels_of_severity_are_those_of_the_model():
    """A swing is mild or hard, a lean has no severity, and a drill string has its own words."""
    swing = own(Response("fast", feature="lift", threshold=1.0, limits={"mild": 1.0, "hard": 2.0}), MEASURED, 0, ())
    lean = own(Response("leaning", feature="lift", threshold=1.0), MEASURED, 1, ())
    assert [severity_words([swing, lean], level) for level in range(5)] == ["none", "mild", "hard", "hard", "hard"]
    assert list(severity_levels([swing, lean])) == [1], "hard allows all that has a severity"
    assert list(severity_levels([lean])) == []
    string = RESPONSES.values()
    assert (severity_words(string, 2), list(severity_levels(string))) == ("moderate", [1, 2, 3])


def test_data_nsdrill_tells_where_a_run_shows_them(driven):
    folder, _ = driven
    told, refused = python(folder, ACCESSOR)
    shown, bits, text, safe = json.loads(told)
    assert shown["fast"] == [bool(one & 16) for one in bits]
    assert shown["leaning"] == [bool(one & 32) for one in bits]
    assert safe == [not one & 32 for one in bits], "what has no severity is never safe"
    assert "shows('fast')" in text
    assert "sticking" not in text
    assert refused == "response: found 'whirl'; allowed: fast, leaning."


def test_colours_are_theirs_and_grey_where_none_is_defined(driven):
    folder, _ = driven
    own_styles, none, again = python(folder, STYLES)
    (nothing, *critical) = json.loads(own_styles)
    assert nothing == ["no critical response", SAFE_COLOUR, ""]
    assert [(name, letters) for name, _, letters in critical] == [
        ("fast swing", "F"),
        ("leaning", "L"),
        ("fast swing + leaning", "FL"),
    ]
    assert critical[1][1] == "#AA3377"
    assert len({colour for _, colour, _ in critical}) == 3
    [[words, colour]] = json.loads(none)
    assert words == "no response is defined for this model"
    red, green, blue = (colour[i : i + 2] for i in (1, 3, 5))
    assert red == green == blue, "grey, not the green of safe"
    assert again == "True 1.0"
    assert "no response is defined for this model" in (folder / "plain.html").read_text(encoding="utf-8")


def test_a_name_has_the_units_of_the_model_of_the_file(driven):
    """forced and slammed, which are first, give place_max metres, and rough none."""
    _, said = driven
    for name, unit in (("line", "m"), ("rough", "1")):
        ranges = json.loads(said[f"show {name}.h5 --json"][1])["ranges"]
        assert ranges["place_max"]["units"] == unit
    row = next(one for one in said["show rough.h5"][1].splitlines() if "place_max" in one)
    assert " m " not in row


def test_answers_have_the_units_of_the_model_of_the_file(driven):
    """A force of rubbed is a plain number, and one of slammed, whose windows stand beside it, has newtons."""
    _, said = driven
    for what in ("window rubbed.h5", "window rubbed.h5 --json", "window rubbed.h5 wider.h5", "diff rubbed.h5 wider.h5"):
        assert "0.1" in said[what][1]
        assert "0.1 N" not in said[what][1], what
        assert "0.4 N" not in said[what][1], what
    assert "0.4 N" in said["window line.h5"][1]


MEASURED = feature("lift", "m", "greatest lift")


@pytest.mark.parametrize(
    ("declared", "found"),
    [
        (Response("whirl", feature="lift", threshold=1.0), "the name 'whirl'"),
        (Response("settled", feature="lift", threshold=1.0), "the name 'settled'"),
        (Response("two words", feature="lift", threshold=1.0), "the name 'two words'"),
        (Response("high", bit=2, feature="lift", threshold=1.0), "with the bit 2"),
        (Response("high", bit=24, feature="lift", threshold=1.0), "with the bit 24"),
        (Response("high", feature="lift"), "no threshold"),
        (Response("high", feature="lift", threshold=1.0, limits={"b": 2.0, "a": 1.0}), "limits"),
    ],
)
def test_what_cannot_be_a_response_is_refused(declared, found):
    with pytest.raises(ValueError, match=found):
        own(declared, MEASURED, 0, ())


def test_what_is_left_out_follows_from_the_feature():
    stuck = own(Response("belt_stuck", feature="f", threshold=0.01), fraction("f", "fraction stuck"), 1, {"B"})
    assert (stuck.bit, stuck.words, stuck.letter, stuck.share) == (32, "belt stuck", "E", True)
    assert stuck.limit.format(stuck.percent(0.01)) == "fraction stuck above 1 %"
    high = own(Response("high", feature="lift", threshold=2.0), MEASURED, 0, ())
    assert high.limit.format(high.percent(2.0)) == "greatest lift above 2 m"
    assert high.does == "shows high"
    assert high.thresholds().lift == 2.0


def test_those_of_a_drill_string_are_declared_alike():
    for one in RESPONSES.values():
        assert pickle.loads(pickle.dumps(one)) == one
        assert hasattr(one.thresholds(), one.feature)
        assert one.colour
        assert not one.is_own
