"""Two sets of numbers of which the differences are put in by hand."""

import numpy as np
import pytest
from model_tables import TRACE_VARIABLES

from nsdrill.analysis.comparison import ROUNDING, common_places, compare_results, compare_traces, string_differences
from nsdrill.data import Results, Trace
from nsdrill.models.christoforou_yigit.columns import STATE_NAMES
from nsdrill.models.responses import STICK_SLIP
from nsdrill.variables import OK, PENDING, Unknown

from .grids import grid

UP, DOWN = ["s..w", "b..."], ["s.xw", "b..."]


def made() -> Results:
    data = grid({"up": [UP], "down": [DOWN]}, [1, 2, 3, 4], [10e3, 20e3])
    data.variables["radius_max"] = np.arange(16.0).reshape(2, 1, 2, 4)
    data.variables["steps"] = np.full((2, 1, 2, 4), 100)
    data.coords["state"] = np.array(STATE_NAMES)
    data.variables["final_state"] = np.ones((2, 1, 2, 4, len(STATE_NAMES)))
    data.variables["axial_peaks"] = np.ones((2, 1, 2, 4, 3))
    return data


def row(found: dict, name: str) -> dict:
    return next(row for row in found["variables"] if row["name"] == name)


def test_nothing_differs_from_itself():
    a, b = made(), made()
    for data in (a, b):
        data["radius_max"][0, 0, 0, 0] = np.nan
        data["radius_max"][0, 0, 0, 1] = np.inf
    found = compare_results(a, b)
    assert found["points"] == 16
    assert all(one["same"] for one in (*found["axes"], *found["variables"]))
    assert found["responses"] == {"changed": 0, "unchanged": 15, "unknown": 1, "changes": [], "at": []}
    assert len([one for one in found["variables"] if one["name"].startswith("final_state[")]) == 9


def test_differences_are_measured_and_placed():
    a, b = made(), made()
    b["radius_max"][1, 0, 1, 2] += 0.5  # 14 and 14.5
    b["radius_max"][0, 0, 0, 1] += 0.25  # 1 and 1.25: relatively larger
    b["radius_max"][0, 0, 1, 0] = np.nan
    b["steps"][0, 0, 0, 0] = 90
    b["final_state"][0, 0, 0, 0, STATE_NAMES.index("twist")] = 3.0
    b["axial_peaks"][0, 0, 1, 3, 1:] = 2.0
    found = compare_results(a, b)
    assert row(found, "radius_max") == {
        "name": "radius_max",
        "units": "m",
        "same": False,
        "points": 3,
        "largest": 0.5,
        "relative": 0.2,
        "undefined": 1,
        "at": {"procedure": "down", "depth": 5000.0, "wob": 20e3, "rotary_speed": 3.0},
    }
    assert (row(found, "steps")["largest"], row(found, "steps")["relative"]) == (10.0, 0.1)
    assert [one["name"] for one in found["variables"] if one["name"].startswith("final") and not one["same"]] == [
        "final_state[twist]"
    ]
    assert row(found, "final_state[twist]")["units"] == "rad"
    assert row(found, "axial_peaks")["points"] == 1, "two peaks of one point"


def test_the_sign_of_zero_is_a_bit():
    a, b = made(), made()
    b["radius_max"][0, 0, 0, 0] = -0.0
    found = row(compare_results(a, b), "radius_max")
    assert (found["points"], found["largest"]) == (1, 0.0)


def test_changed_responses_are_counted_and_named():
    """A run that failed has none: it is told by how it ended."""
    a, b = made(), made()
    b["response"][0, 0, 0, 1:3] = 4
    b["status"][1, 0, 0, 2] = 1  # the failed one now ends well
    found = compare_results(a, b)["responses"]
    assert found["changed"] == 3
    assert found["changes"] == [
        {"from": "none", "to": "whirl", "points": 2},
        {"from": "diverged", "to": "none", "points": 1},
    ]
    assert found["at"][0] == {
        "procedure": "up",
        "depth": 5000.0,
        "wob": 10e3,
        "rotary_speed": 2.0,
        "from": "none",
        "to": "whirl",
    }


def test_common_points_of_different_axes():
    """The second file has every second speed of the first, one of its own, one
    procedure, and rounds otherwise."""
    a = made()
    b = grid({"down": [["w.s", "..b"]]}, [1.0, 3.0 * (1 + ROUNDING / 10), 5.0], [10e3, 20e3])
    b.variables["radius_max"] = a["radius_max"][1:, :, :, [0, 2, 3]].copy()
    found = compare_results(a, b)
    assert [(axis["name"], axis["a"], axis["b"], axis["common"], axis["same"]) for axis in found["axes"]] == [
        ("procedure", 2, 1, 1, False),
        ("depth", 1, 1, 1, True),
        ("wob", 2, 2, 2, True),
        ("rotary_speed", 4, 3, 2, False),
    ]
    assert found["points"] == 4
    assert row(found, "radius_max")["same"]
    # down, 10 kN: s and w, diverged and none; 20 kN: b and none, none and none
    assert found["responses"]["changed"] == 3
    assert found["only_a"] == ["steps", "final_state", "axial_peaks"]


def test_what_cannot_be_compared_is_said():
    a, b = made(), made()
    b.variables["axial_peaks"] = np.ones((2, 1, 2, 4, 5))
    found = compare_results(a, b)
    assert row(found, "axial_peaks")["not_compared"] == {"a": 3, "b": 5, "of": "peak"}
    assert not row(found, "axial_peaks")["same"]
    b.coords["start"] = np.arange(2)
    b.variables = {name: np.repeat(values[:, :, :, :, None], 2, axis=4) for name, values in b.variables.items()}
    found = compare_results(a, b)
    assert (found["points"], found["variables"], found["responses"]) == (0, [], None)
    assert found["axes"][-1] == {"name": "start", "a": 0, "b": 2, "common": 0, "same": False}


@pytest.mark.parametrize(
    ("a", "b", "i", "j", "same"),
    [
        ([1.0, 2.0], [1.0, 2.0], [0, 1], [0, 1], True),
        ([1.0, 2.0, 3.0], [0.0, 3.0, 1.0], [0, 2], [2, 1], False),
        ([1.0], [1.1], [], [], False),
        ([], [1.0], [], [], False),
        (["up", "down"], ["down"], [1], [0], False),
    ],
)
def test_common_values(a, b, i, j, same):
    found = common_places(np.array(a), np.array(b))
    assert (found[0].tolist(), found[1].tolist(), found[2]) == (i, j, same)


def trace(samples: int, interval: float = 0.1) -> Trace:
    time = np.arange(samples) * interval
    return Trace(time, {variable.name: np.sin(time) for variable in TRACE_VARIABLES}, {})


def test_traces_part_at_a_time():
    a, b = trace(50), trace(40)
    b["z"][20:] += 0.01
    b["z"][30] += 1.0
    found = compare_traces(a, b)
    assert (found["points"], found["axes"][0]["common"]) == (40, 40)
    z = row(found, "z")
    assert (z["points"], z["first"], z["at"]) == (20, pytest.approx(2.0), pytest.approx(3.0))
    assert z["largest"] == pytest.approx(1.01)
    assert row(found, "x")["same"]
    assert compare_traces(a, trace(5, 0.037))["points"] == 1, "time zero"


def test_samples_are_compared_where_their_values_are_the_same():
    """A number of a sample says nothing where another seed, or another distribution,
    drew it."""
    friction = Unknown("bit.friction.static", "1", "friction")

    def with_samples(values):
        data = made()
        count = len(values)
        coords = {**{name: data.coords[name] for name in data.grid}, "sample": np.arange(count)}
        variables = {"radius_max": np.arange(16.0 * count).reshape(2, 1, 2, 4, count)}
        return Results(coords, variables, {}, (), {friction: np.array(values)})

    a, b = with_samples([0.3, 0.4]), with_samples([0.3, 0.4, 0.5])
    b["radius_max"][..., :2] = a["radius_max"]
    found = compare_results(a, b)
    assert found["points"] == 32
    assert row(found, "radius_max")["same"]
    assert not all(one["same"] for one in found["axes"])
    b.drawn[friction][0] = 0.31
    found = compare_results(a, b)
    assert next(one for one in found["axes"] if one["name"] == "sample")["common"] == 1
    assert found["points"] == 16
    assert compare_results(a, with_samples([0.1, 0.2]))["points"] == 0
    other = with_samples([0.3, 0.4])
    other.drawn = {Unknown("well.friction.static", "1", "friction"): np.array([0.3, 0.4])}
    assert compare_results(a, other)["points"] == 0


def test_points_of_two_constant_values_are_compared_all_the_same():
    a, b = made(), made()
    b.coords["depth"] = b.coords["depth"] + 100.0
    found = compare_results(a, b)
    assert found["points"] == 16
    (axis,) = (one for one in found["axes"] if one["name"] == "depth")
    assert axis["values"] == [a.coords["depth"][0], b.coords["depth"][0]]
    assert not axis["same"]
    b.coords["wob"] = b.coords["wob"] + 1e6
    assert compare_results(a, b)["points"] == 0, "an axis with several values, none of them common"


def test_probabilities_of_other_samples_are_compared():
    """One operating point of which the intervals lie apart, one where they do not; the
    counts are put in by hand."""
    rock = Unknown("bit.rock_stiffness", "N/m", "stiffness")

    def results(critical, values):
        coords = {
            "procedure": np.array(["same"]),
            "depth": np.array([1e3]),
            "wob": np.array([1e4]),
            "rotary_speed": np.array([3.0, 6.0]),
            "sample": np.arange(20),
        }
        response = (np.arange(20) < np.array(critical)[:, None]).astype(np.int8) * STICK_SLIP
        variables = {"status": np.full((1, 1, 1, 2, 20), OK, np.int8), "response": response[None, None, None]}
        return Results(coords, variables, {}, (), {rock: values})

    a, b = results([1, 10], np.linspace(1e7, 2e7, 20)), results([18, 12], np.linspace(2e7, 3e7, 20))
    found = compare_results(a, b)
    assert found["points"] == 0
    safe, slipping = (
        next(one for one in found["probabilities"]["outcomes"] if one["name"] == name)
        for name in ("safe", "stick_slip")
    )
    assert (safe["a"], safe["b"]) == pytest.approx(((19 + 10) / 40, (2 + 8) / 40))
    assert safe["largest"] == pytest.approx(-17 / 20)
    assert slipping["largest"] == pytest.approx(17 / 20)
    assert safe["at"] == {"depth": 1e3, "wob": 1e4, "rotary_speed": 3.0}
    assert safe["apart"] == slipping["apart"] == 1
    b["status"][..., 0] = PENDING
    found = compare_results(a, b)["probabilities"]
    assert found["a"] == {"known": 40, "failed": 0, "pending": 0, "of": 40}
    assert found["b"] == {"known": 38, "failed": 0, "pending": 2, "of": 40}
    b["status"][..., 1, :] = PENDING
    slipping = next(one for one in compare_results(a, b)["probabilities"]["outcomes"] if one["name"] == "stick_slip")
    assert slipping["known"] == 1, "of the other point nothing is known"
    assert (slipping["a"], slipping["b"]) == pytest.approx((1 / 20, 17 / 19))


@pytest.mark.parametrize("named", [{}, {"model": ""}])
def test_a_string_whose_study_names_no_model_is_that_of_the_main_model(named):
    first, second = ({**named, "bit": {"teeth": number}} for number in (1, 2))
    assert string_differences(first, second) == [("bit.teeth", 1, 2)]
