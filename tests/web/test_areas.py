"""Areas of a report: the cells are the numbers of the analysis, turned as the axes of
the page say."""

from __future__ import annotations

import numpy as np
import pytest

from nsdrill.analysis import window
from nsdrill.analysis.probability import SAFE, probabilities_of
from nsdrill.analysis.window import SAFE as WINDOW_SAFE
from nsdrill.analysis.window import classes, find_window
from nsdrill.app.run import run_in_memory
from nsdrill.data import Results
from nsdrill.errors import InputError
from nsdrill.plot.style import BAD_TO_GOOD, RESPONSES, SAFE_COLOUR
from nsdrill.study import parse_study
from nsdrill.web.areas import (
    basin_area,
    evenly_spaced,
    probability_areas,
    probability_lines,
    verdict_areas,
    window_areas,
)
from nsdrill.web.maps import area, area_choices

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
def uncertain() -> Results:
    return run(UNCERTAIN + "sweep: {wob: [20 kN, 60 kN, 100 kN], rotary_speed: [4 rad/s, 12 rad/s]}\n")


@pytest.fixture(scope="module")
def cube() -> Results:
    axes = "depth: [1000 m, 3000 m, 5000 m], wob: [20 kN, 80 kN], rotary_speed: [1 rad/s, 3 rad/s, 6 rad/s, 9 rad/s]"
    return run(f"sweep: {{{axes}, procedure: up-down, along: rotary_speed}}\n")


def test_probabilities_over_two_axes(uncertain: Results) -> None:
    found = probabilities_of(uncertain)
    areas = dict(probability_areas(uncertain, "field", "rotary_speed", "wob"))
    head, columns = areas["Probability: safe"]
    assert np.allclose(columns["values"][0], 100 * found.of(SAFE)[0][0])  # [y, x] is wob, speed
    assert (head["x"]["unit"], head["y"]["unit"], head["limits"]) == ("rpm", "klbf", [0.0, 100.0])
    # the scale of the picture: good is 100 % of safe and 0 % of a response
    assert tuple(head["scale"]) == BAD_TO_GOOD
    assert all(
        tuple(one["scale"]) == BAD_TO_GOOD[::-1] for words, (one, _) in areas.items() if words != "Probability: safe"
    )
    occurring = [name for name in found.outcomes[1:] if found.of(name)[0].any()]
    assert len(areas) == 1 + len(occurring) > 1
    turned = dict(probability_areas(uncertain, "si", "wob", "rotary_speed"))["Probability: safe"][1]
    assert np.array_equal(turned["values"][0], columns["values"][0].T)


def test_probabilities_along_one_axis() -> None:
    results = run(UNCERTAIN + "sweep: {rotary_speed: [4 rad/s, 8 rad/s, 12 rad/s]}\n")
    head, columns = probability_lines(results, "si", "rotary_speed")
    found = probabilities_of(results)
    assert head["procedures"][0] == "safe"
    assert np.allclose(columns["values"][0, :, 0], 100 * found.of(SAFE)[0].ravel())
    assert columns["outcome"][0].tolist() == [0, 0, 0]  # the colour of no critical response
    assert columns["values"].shape[0] == len(head["procedures"]) > 1
    opened, again = area(results, "si", "probability", {})
    assert (opened["dimension"], opened["joined"]) == (results.grid.index("rotary_speed"), True)
    assert np.array_equal(again["values"], columns["values"])


def test_the_window_has_a_map_of_each_value_of_a_third_axis(cube: Results) -> None:
    found = classes(cube)
    areas = list(window_areas(cube, "si"))
    assert [words for words, _ in areas] == [
        f"Operating window, measured depth {depth} m" for depth in (1000, 3000, 5000)
    ]
    for number, (_, (head, columns)) in enumerate(areas):
        shown = [head["classes"][int(code)] for code in columns["values"].ravel()]
        state, bits = found.state[number].ravel(), found.bits[number].ravel()
        for one, is_what, response in zip(shown, state, bits, strict=True):
            style = RESPONSES[response]
            assert (
                one
                == {
                    window.SAFE: {"name": "safe", "colour": SAFE_COLOUR},
                    window.CRITICAL: {"name": style.name, "colour": style.colour},
                    window.HISTORY_DEPENDENT: {
                        "name": f"{style.name}, by the history",
                        "colour": SAFE_COLOUR,
                        "stripes": style.colour,
                    },
                }[is_what]
            )
        assert columns["values"].shape == (1, 2, 4)
    assert len(np.unique(found.state)) > 1
    assert list(window_areas(run("sweep: {rotary_speed: [4 rad/s, 8 rad/s]}\n"), "si")) == []


def test_checks_over_two_axes() -> None:
    text = "sweep: {wob: [20 kN, 80 kN], rotary_speed: [1 rad/s, 3 rad/s, 6 rad/s]}\n"
    results = run_in_memory(parse_study(text + SHORT.replace("5 s}", "5 s, verify: true}")))
    ((words, (head, columns)),) = verdict_areas(results, "si", "rotary_speed", "wob")
    agree = [one["name"] for one in head["classes"]].index("checks agree")
    assert words == "Checks"
    assert np.array_equal(columns["values"][0] == agree, results["trusted"][0, 0] == 1)
    assert not list(verdict_areas(run(text), "si", "rotary_speed", "wob"))


def test_a_basin_has_each_start_in_its_place() -> None:
    states = "x: {from: -20 mm, to: 20 mm, points: 3}, vx: {from: -0.1 m/s, to: 0.1 m/s, points: 4}"
    results = run(f"initial: {{slice: {{{states}}}}}\n")
    _, (head, columns) = basin_area(results, "si")
    assert np.allclose(head["x"]["values"], [-20, 0, 20])
    names = results["state"].tolist()
    begun, response = results["initial_state"].reshape(12, -1), results["response"].ravel()
    for start in range(12):
        i = np.argmin(np.abs(head["x"]["values"] * 1e-3 - begun[start, names.index("x")]))
        j = np.argmin(np.abs(head["y"]["values"] - begun[start, names.index("vx")]))
        assert columns["values"][0, j, i] == response[start]


def test_of_many_maps_some_are_shown_evenly() -> None:
    assert evenly_spaced(3) == [0, 1, 2]
    assert evenly_spaced(18) == [0, 6, 11, 17]


def test_a_window_knows_its_points_and_its_best_one(cube: Results) -> None:
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


def test_probabilities_are_one_area_with_a_border(uncertain: Results) -> None:
    found = probabilities_of(uncertain)
    head, columns = area(uncertain, "si", "probability", {})
    assert head["procedures"][0] == "Probability: safe"
    assert columns["values"].shape == (len(head["procedures"]), 3, 2)
    share = found.of(SAFE)[0][0]
    assert np.array_equal(columns["safe"] == 1, share >= 0.9)
    assert np.allclose(columns["values"][0], 100 * share)


def test_a_cell_of_a_basin_is_its_start() -> None:
    states = "x: {from: -20 mm, to: 20 mm, points: 3}, vx: {from: -0.1 m/s, to: 0.1 m/s, points: 4}"
    results = run(f"initial: {{slice: {{{states}}}}}\n")
    head, columns = area(results, "si", "basin", {})
    names, across = results["state"].tolist(), head["x"]["dimension"]
    for i, x in enumerate(head["x"]["values"]):
        for j, vx in enumerate(head["y"]["values"]):
            place = list(head["place"])
            place[across] += i * head["x"]["step"] + j * head["y"]["step"]
            begun = results["initial_state"][tuple(place)]
            assert begun[names.index("x")] * 1e3 == pytest.approx(x)
            assert begun[names.index("vx")] == pytest.approx(vx)
            assert columns["values"][0, j, i] == results["response"][tuple(place)]
