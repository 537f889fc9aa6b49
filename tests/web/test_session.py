"""Diagrams and areas hold the numbers of the file, in the units that are shown; wrong requests
are told."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from nsdrill.analysis.maps import SAFE as WINDOW_SAFE
from nsdrill.analysis.maps import classes
from nsdrill.analysis.probability import SAFE, probabilities_of
from nsdrill.analysis.window import find_window
from nsdrill.app.experiment import prepare
from nsdrill.app.running.run import run_in_memory
from nsdrill.data import Results
from nsdrill.errors import FileError, InputError
from nsdrill.figures.style import BAD_TO_GOOD, RESPONSES
from nsdrill.figures.zones import ONLY_FROM_ABOVE, codes_of, lowered, zones
from nsdrill.models.responses import STALLED
from nsdrill.study import parse_study
from nsdrill.variables import INFERRED
from nsdrill.web.asked import packed
from nsdrill.web.diagrams import plane
from nsdrill.web.explorer_maps import area, area_choices
from nsdrill.web.session import Session
from nsdrill.web.shown import label_words, plain


def test_a_diagram_has_the_peaks_of_the_file(session):
    results = session.results
    head, columns = session.diagram({"y": "radius_peaks"})
    assert columns["values"].shape == (2, 8, 4)
    stored = results["radius_peaks"][:, 0, 0] * 1e3
    there = np.isfinite(stored)
    assert np.allclose(columns["values"][there], stored[there])
    assert np.array_equal(columns["outcome"], results["response"][:, 0, 0])
    assert head["x"]["values"].tolist() == results["rotary_speed"].tolist()
    assert (head["y"]["unit"], head["place"], head["dimension"]) == ("mm", [0, 0, 0, 0], 3)


def test_what_is_no_quantity_of_the_results_is_told_with_what_is(session):
    """By name: also the features that stand for the names of peaks."""
    with pytest.raises(InputError) as caught:
        session.diagram({"y": "peaks"})
    said = str(caught.value)
    assert said.startswith("y: found peaks; allowed: ")
    for name in ("radius_peaks", "bit_speed_max", "stick_slip_index"):
        assert name in said
        session.diagram({"y": name})


def test_field_units(shared):
    session = Session(shared / "small.h5", "field")
    head, columns = session.diagram({"y": "radius_peaks"})
    si = Session(shared / "small.h5").diagram({"y": "radius_peaks"})[1]
    assert head["y"]["unit"] == "in"
    assert np.allclose(columns["values"] * 25.4, si["values"], equal_nan=True)
    assert head["x"]["values"][0] == pytest.approx(60 / (2 * np.pi))
    told, _ = session.replay({"place": [0, 0, 0, 0], "seconds": 1.0})
    assert ["Rotary speed", "9.549 rpm"] in told["from"]


def test_the_title_is_in_the_words_of_the_user(shared):
    session = Session(shared / "small.h5", "field")
    depth = session.study.axes["depth"][0]
    title = f"Up and down, {depth:g} m, 22.24 kN, 3 m"
    session.experiment = prepare(replace(session.study, title=title))
    assert session.title == title
    assert Session(shared / "small.h5").title == "Small"


def test_another_drive_goes_on_from_the_state_that_there_is(session):
    """The states that both strings have keep their bits; those of the new drive begin
    as in a study."""
    told, _ = session.replay({"place": [0, 0, 0, 3], "seconds": 1.0})
    asked = {"place": [0, 0, 0, 3], "state": told["state"].tolist(), "states": told["states"], "seconds": 1.0}
    study = session.motions.at(session.motions.values([0, 0, 0, 3]), {"drive.kind": "stiff"})
    state = session.start_state(asked, study)
    names = session.motions.states(study)
    assert set(told["states"]) < set(names)
    fitted = dict(zip(names, state, strict=True))
    assert all(fitted[name] == value for name, value in zip(told["states"], told["state"], strict=True))
    own = dict(zip(names, session.motions.start(study), strict=True))
    assert all(fitted[name] == own[name] for name in set(names) - set(told["states"]))
    head, _ = session.live({**asked, "changes": {"drive.kind": "stiff"}})
    assert head["values"]["drive.kind"] == "stiff"
    assert head["states"] == names
    with pytest.raises(InputError, match="states: found something else"):
        session.live({**asked, "states": ["x"]})
    with pytest.raises(InputError, match="found none of"):
        session.live({**asked, "states": ["a"] * len(told["state"])})


def test_a_map_is_turned_as_asked(of_map):
    results = of_map.results
    one, columns = of_map.plane({"colour": "response", "x": "rotary_speed", "y": "wob"})
    assert columns["values"].shape == (1, 5, 4)
    assert np.array_equal(columns["values"][0], results["response"][0, 0])
    _, turned = of_map.plane({"colour": "response", "x": "wob", "y": "rotary_speed"})
    assert np.array_equal(turned["values"][0], results["response"][0, 0].T)
    assert one["x_edges"].shape == (5,)
    feature, values = of_map.plane({"colour": "radius_max", "x": "wob", "y": "rotary_speed"})
    assert np.allclose(values["values"][0], 1e3 * results["radius_max"][0, 0].T)
    assert feature["limits"][0] < feature["limits"][1]


def test_a_map_of_the_index_says_where_the_bit_is_stalled(of_map):
    """The map of the tests has two such points, of slow stick-slip observed for less
    than a pause."""
    stalled = of_map.results["response"][0, 0] == STALLED
    assert stalled.sum() == 2
    head, columns = of_map.plane({"colour": "stick_slip_index", "x": "rotary_speed", "y": "wob"})
    assert head["silent"]["name"] == "stalled"
    assert head["silent"]["colour"] == RESPONSES[STALLED].colour
    assert np.array_equal(np.isnan(columns["values"][0]), stalled)
    head, columns = of_map.plane({"colour": "lift_off_fraction", "x": "rotary_speed", "y": "wob"})
    assert head["silent"] is None
    assert np.isfinite(columns["values"]).all()


def test_a_point_that_was_not_run_has_a_response_and_no_other_label(of_map):
    status = of_map.results["status"].copy()
    status[0, 0, 1, 2] = INFERRED
    results = replace(of_map.results, variables={**of_map.results.variables, "status": status})
    for label, is_there in (("response", True), ("settled", False)):
        _, columns = plane(results, "si", label, "rotary_speed", "wob", {}, 0)
        assert np.isfinite(columns["values"][0, 1, 2]) == is_there
        assert np.isfinite(columns["values"]).sum() == status.size - (not is_there)


def test_a_cut_of_a_map(of_map):
    results = of_map.results
    head, columns = of_map.diagram({"y": "bit_speed_max", "x": "wob", "held": {"rotary_speed": 2}})
    assert np.allclose(columns["values"][0, :, 0], results["bit_speed_max"][0, 0, :, 2])
    assert head["place"] == [0, 0, 0, 2]
    assert head["dimension"] == 2


BAD: list[tuple[str, dict[str, Any], str]] = [
    ("replay", {}, "place"),
    ("replay", {"place": [0, 0, 0]}, "place"),
    ("replay", {"place": [0, 0, 0, 8]}, "place"),
    ("replay", {"place": [0, 0, 0, -1]}, "place"),
    ("replay", {"place": [0, 0, 0, True]}, "place"),
    ("replay", {"place": [0, 0, 0, 1], "seconds": "20"}, "seconds"),
    ("replay", {"place": [0, 0, 0, 1], "seconds": float("nan")}, "seconds"),
    ("replay", {"place": [0, 0, 0, 1], "seconds": 1e9}, "seconds"),
    ("replay", {"place": [0, 0, 0, 1], "seconds": True}, "seconds"),
    ("diagram", {}, "y"),
    ("diagram", {"y": "study"}, "y"),
    ("diagram", {"y": "status"}, "y"),
    ("diagram", {"y": "radius_peaks", "x": "time"}, "x"),
    ("diagram", {"y": "radius_peaks", "held": {"wob": 5}}, "wob"),
    ("diagram", {"y": "radius_peaks", "held": [1]}, "held"),
    ("plane", {"colour": "response", "x": "wob", "y": "wob"}, "x, y"),
    ("plane", {"colour": "radius_peaks", "x": "wob", "y": "depth"}, "colour"),
    ("live", {"changes": {"record.peaks": 3}}, "record.peaks"),
    ("live", {"changes": {"title": "x"}}, "title"),
    ("live", {"changes": {"wob": None}}, "wob"),
    ("live", {"changes": {"wob": -5.0}}, "wob"),
    ("live", {"changes": {"wob": 1e400}}, "wob"),
    ("live", {"changes": {"wob": "30 mm"}}, "wob: found '30 mm', in units of length; allowed: a number with its"),
    ("live", {"changes": {"wob": "5,5 klbf"}}, "Write a decimal point: 5.5 klbf."),
    ("live", {"changes": {"wob": "5 Klbf"}}, "Did you mean klbf? (Capitals matter.)"),
    ("live", {"changes": {"depth": "11,482 ft"}}, "Write 11482 ft without a thousands separator"),
    ("live", {"changes": {"wob": "{ramp: [[0 s, 1 kN]]}"}}, "wob"),
    ("live", {"changes": {"well.diameter": "100 mm"}}, "collar"),
    ("live", {"changes": [1]}, "changes"),
    ("live", {"state": [1, 2, 3]}, "state"),
    ("live", {"state": "0"}, "state"),
    ("live", {"state": [1e300] * 9}, "state"),
    ("section", {"place": [9, 9, 9, 9]}, "place"),
    ("saved", {"state": [None]}, "state"),
]


@pytest.mark.parametrize(("name", "asked", "word"), BAD)
def test_wrong_requests_are_refused_in_words(session, name, asked, word):
    with pytest.raises(InputError) as caught:
        getattr(session, name)(asked)
    assert word in str(caught.value)
    assert "allowed" in str(caught.value)


@pytest.mark.parametrize(
    ("key", "text", "value"),
    [("well.diameter", '15"', 0.381), ("well.diameter", "15 1/2 in", 0.3937), ("rotary_speed", "60 RPM", 2 * np.pi)],
)
def test_quantities_are_taken_as_people_write_them(session, key, text, value):
    head, _ = session.live({"changes": {key: text}, "seconds": 0.1})
    assert head["values"][key] == pytest.approx(value, rel=1e-12)


def test_other_files_are_refused(shared, tmp_path):
    (tmp_path / "text.h5").write_text("no HDF5")
    with pytest.raises(FileError):
        Session(tmp_path / "text.h5")
    (tmp_path / "field.csv").write_text("a,b")
    with pytest.raises(FileError, match="Measurements are for nsdrill fit") as caught:
        Session(tmp_path / "field.csv")
    assert "simulate" not in str(caught.value)  # a trace would be refused here
    with pytest.raises(FileError):
        Session(tmp_path / "nothing.h5")
    with pytest.raises(InputError, match="set: found"):
        Session(shared / "small.h5", overrides=["operation.wob=1 kN"])
    from nsdrill.app.simulating import trajectory
    from nsdrill.store import read_results, write_trace

    trace = trajectory.replay(read_results(shared / "small.h5"), at={"rotary_speed": 3.0}, procedure="up").trace
    write_trace(tmp_path / "trace.h5", trace)
    with pytest.raises(FileError, match="nsdrill plot"):
        Session(tmp_path / "trace.h5")


def test_words():
    assert plain("$\\dot r$ [m/s]") == "r\u0307 [m/s]"
    assert plain("Axial peaks $z$") == "Axial peaks z"
    assert label_words({"status": 3}, {}) == ["step limit"]
    said = label_words({"status": 1, "response": 5, "whirl_kind": 3, "settled": 0, "whirl_severity": 2}, {})
    assert said == ["bit-bounce + whirl (moderate)", "backward rolling whirl", "unsettled"]
    assert label_words({"status": 1, "response": 2, "stick_slip_severity": 4}, {}) == ["stick-slip (severe)"]
    assert label_words({"status": 1, "response": 0, "stick_slip_severity": 1}, {})[1].startswith("stick-slip: ")
    assert "not run" in label_words({"status": 5, "response": 0}, {})[0]
    assert label_words({"status": 6, "response": 0}, {}) == ["unmeasured"]
    said = label_words({"status": 1, "response": 8, "stick_slip_severity": 0, "whirl_severity": 2}, {})
    assert said == ["stalled", "whirl: moderate"], "what happens beside a stall is told"


def test_a_body_is_aligned_and_complete():
    values = np.arange(6.0).reshape(2, 3)
    body = packed({"word": "ä", "none": float("nan")}, {"a": values, "b": values[0]})
    size = int.from_bytes(body[:4], "little")
    assert size % 4 == 0
    import json

    head = json.loads(body[4 : 4 + size])
    assert (head["word"], head["none"]) == ("ä", None)
    floats = np.frombuffer(body[4 + size :], "<f4")
    for name, wanted in (("a", values), ("b", values[0])):
        place = head["columns"][name]
        count = int(np.prod(place["shape"]))
        assert np.array_equal(floats[place["at"] : place["at"] + count].reshape(place["shape"]), wanted)


def test_an_axis_of_words_has_a_list(tmp_path):
    (tmp_path / "words.yaml").write_text(
        "sweep: {modes.axial: [free, frozen], rotary_speed: [3 rad/s]}\nsimulation: {transient: 1 s, observe: 1 s}\n"
    )
    meta = Session(tmp_path / "words.yaml").meta()
    assert "modes.axial" in meta["usual"]
    (one,) = [one for one in meta["sliders"] if one["key"] == "modes.axial"]
    assert one["choices"] == ["free", "frozen"]


SHORT = "simulation: {transient: 5 s, observe: 5 s}\nrecord: {peaks: 0}\n"
UNCERTAIN = """
operation: {depth: 2000 m}
bit: {lobes: 1, surface_amplitude: 0.5 mm}
uncertain:
  bit.friction.static: {uniform: [0.3, 0.6]}
  samples: 8
"""


def run(text: str) -> Results:
    return run_in_memory(parse_study(text + SHORT))


@pytest.fixture(scope="module")
def uncertain():
    return run(UNCERTAIN + "sweep: {wob: [20 kN, 60 kN, 100 kN], rotary_speed: [4 rad/s, 12 rad/s]}\n")


@pytest.fixture(scope="module")
def cube():
    axes = "depth: [1000 m, 3000 m, 5000 m], wob: [20 kN, 80 kN], rotary_speed: [1 rad/s, 3 rad/s, 6 rad/s, 9 rad/s]"
    return run(f"sweep: {{{axes}, procedure: up-down, along: rotary_speed}}\n")


def test_probabilities_over_two_axes(uncertain):
    """One area with a map for each outcome that occurs, and the border of what is safe."""
    found = probabilities_of(uncertain)
    head, columns = area(uncertain, "field", "probability", {})
    share = found.of(SAFE)[0][0]
    assert head["procedures"][0] == "Probability: safe"
    assert np.allclose(columns["values"][0], 100 * share)  # [y, x] is wob, speed
    assert np.array_equal(columns["safe"] == 1, share >= 0.9)
    assert (head["x"]["unit"], head["y"]["unit"], head["limits"]) == ("rpm", "klbf", [0.0, 100.0])
    # the scale of the picture: good is 100 % of safe and 0 % of a response
    assert [*map(tuple, head["scales"])] == [BAD_TO_GOOD, *[BAD_TO_GOOD[::-1]] * (len(head["scales"]) - 1)]
    occurring = [name for name in found.outcomes[1:] if found.of(name)[0].any()]
    assert columns["values"].shape == (1 + len(occurring), 3, 2)
    assert len(head["procedures"]) == 1 + len(occurring) > 1


def test_probabilities_along_one_axis():
    results = run(UNCERTAIN + "sweep: {rotary_speed: [4 rad/s, 8 rad/s, 12 rad/s]}\n")
    head, columns = area(results, "si", "probability", {})
    found = probabilities_of(results)
    assert head["procedures"][0] == "safe"
    assert "THE MAP ENDS" in " ".join(head["warnings"])
    assert head["answer"].startswith("Nothing is 90 % safe. Best: ")
    assert np.allclose(columns["values"][0, :, 0], 100 * found.of(SAFE)[0].ravel())
    assert columns["outcome"][0].tolist() == [0, 0, 0]  # the colour of no critical response
    assert columns["values"].shape[0] == len(head["procedures"]) > 1
    assert (head["dimension"], head["joined"]) == (results.grid.index("rotary_speed"), True)


def test_the_window_has_a_map_of_each_value_of_a_third_axis(cube):
    """With the classes of the picture, striped white where a point is free only when
    lowered from above."""
    found = classes(cube)
    codes, only, of_picture = codes_of(found.grades), lowered(found.grades), zones(found.grades)
    for number in range(3):
        head, columns = area(cube, "si", "window", {"depth": number})
        shown = [head["classes"][int(code)] for code in columns["values"].ravel()]
        for one, code, is_only in zip(shown, codes[number].ravel(), only[number].ravel(), strict=True):
            zone = of_picture[code]
            name = f"{zone.name}, {ONLY_FROM_ABOVE}" if is_only else zone.name
            assert (one["name"], one["colour"]) == (name, zone.colour)
            if is_only:
                assert one["stripes"] == "#ffffff"
        assert np.array_equal(columns["safe"] == 1, found.grades.allowed[number])
        assert columns["values"].shape == (1, 2, 4)
        assert np.array_equal(columns["open"][0] == 1, found.unsettled[number])
        assert head["open_words"] == f"not settled ({np.count_nonzero(found.unsettled[number])} of 8)"
    assert found.unsettled.any()
    assert len(np.unique(codes)) > 1
    assert area_choices(run("sweep: {rotary_speed: [4 rad/s, 8 rad/s]}\n")) == []


def test_a_basin_has_each_start_in_its_place():
    states = "x: {from: -20 mm, to: 20 mm, points: 3}, vx: {from: -0.1 m/s, to: 0.1 m/s, points: 4}"
    results = run(f"initial: {{slice: {{{states}}}}}\n")
    head, columns = area(results, "si", "basin", {})
    assert np.allclose(head["x"]["values"], [-20, 0, 20])
    names = results["state"].tolist()
    begun, response = results["initial_state"].reshape(12, -1), results["response"].ravel()
    for start in range(12):
        i = np.argmin(np.abs(head["x"]["values"] * 1e-3 - begun[start, names.index("x")]))
        j = np.argmin(np.abs(head["y"]["values"] - begun[start, names.index("vx")]))
        assert columns["values"][0, j, i] == response[start]
        place = list(head["place"])
        place[head["x"]["dimension"]] += i * head["x"]["step"] + j * head["y"]["step"]
        assert place[results.grid.index("start")] == start


def test_a_window_knows_its_points_and_its_best_one(cube):
    """A cell of the area is a place of the grid, and the first point is that of the
    window's recommendation."""
    mild = "bit: {lobes: 1, surface_amplitude: 0.1 mm}\nsweep: {depth: [1000 m, 2000 m], "
    results = run(f"{mild} wob: [5 kN, 20 kN, 90 kN], rotary_speed: [4 rad/s, 7 rad/s, 9 rad/s]}}\n")
    found = classes(results)
    assert [one["name"] for one in area_choices(results)] == ["window"]
    head, columns = area(results, "si", "window", {"depth": 1})
    assert np.array_equal(columns["safe"] == 1, found.state[1] == WINDOW_SAFE)
    i, j = head["recommended"]
    best = find_window(results)["maps"][1]["recommended"]
    assert head["x"]["values"][i] == best["rotary_speed"]
    assert head["y"]["values"][j] * 1e3 == best["wob"]
    place = list(head["place"])
    place[head["x"]["dimension"]] += i * head["x"]["step"]
    place[head["y"]["dimension"]] += j * head["y"]["step"]
    assert results["response"][tuple(place)] == 0
    assert place[results.grid.index("depth")] == 1
    with pytest.raises(InputError, match="depth: found number 2; allowed: 0 to 1"):
        area(results, "si", "window", {"depth": 2})
    with pytest.raises(InputError, match="allowed: window"):
        area(results, "si", "basin", {})
    assert area(cube, "si", "window", {})[0]["recommended"] is None
