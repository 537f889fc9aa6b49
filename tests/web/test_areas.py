"""Areas of a page: the cells are the numbers of the analysis, turned as the axes of
the page say."""

import numpy as np
import pytest

from nsdrill.analysis import window
from nsdrill.analysis.maps import SAFE as WINDOW_SAFE
from nsdrill.analysis.maps import classes
from nsdrill.analysis.probability import SAFE, probabilities_of
from nsdrill.analysis.window import find_window
from nsdrill.app.run import run_in_memory
from nsdrill.data import Results
from nsdrill.errors import InputError
from nsdrill.plot.style import BAD_TO_GOOD, RESPONSES, SAFE_COLOUR
from nsdrill.study import parse_study
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
    assert np.allclose(columns["values"][0, :, 0], 100 * found.of(SAFE)[0].ravel())
    assert columns["outcome"][0].tolist() == [0, 0, 0]  # the colour of no critical response
    assert columns["values"].shape[0] == len(head["procedures"]) > 1
    assert (head["dimension"], head["joined"]) == (results.grid.index("rotary_speed"), True)


def test_the_window_has_a_map_of_each_value_of_a_third_axis(cube):
    found = classes(cube)
    for number in range(3):
        head, columns = area(cube, "si", "window", {"depth": number})
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
