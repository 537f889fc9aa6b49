"""Areas of a report: the cells are the numbers of the analysis, turned as the axes of
the page say."""

from __future__ import annotations

import numpy as np
import pytest

from nsdrill.analysis import window
from nsdrill.analysis.probability import SAFE, probabilities_of
from nsdrill.analysis.window import classes
from nsdrill.app.run import run_in_memory
from nsdrill.data import Results
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
    return run(
        UNCERTAIN + "sweep: {wob: [20 kN, 60 kN, 100 kN], rotary_speed: [4 rad/s, 12 rad/s]}\n"
    )


@pytest.fixture(scope="module")
def cube() -> Results:
    axes = (
        "depth: [1000 m, 3000 m, 5000 m], wob: [20 kN, 80 kN], rotary_speed: [1 rad/s, 3 rad/s, 6 "
        "rad/s, 9 rad/s]"
    )
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
        tuple(one["scale"]) == BAD_TO_GOOD[::-1]
        for words, (one, _) in areas.items()
        if words != "Probability: safe"
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


def test_the_window_has_a_map_of_each_value_of_a_third_axis(cube: Results) -> None:
    found = classes(cube)
    areas = list(window_areas(cube, "si"))
    assert [words for words, _ in areas] == [
        f"Safe window, measured depth {depth} m" for depth in (1000, 3000, 5000)
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
