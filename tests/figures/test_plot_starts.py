"""Pictures of several starts: shares that add up, markers that mean a share, basins in
their places."""

import json
from itertools import combinations, pairwise

import numpy as np
import pytest
from made_up import make_results
from matplotlib.colors import to_hex
from seen import legend_words

from nsdrill import figures
from nsdrill.analysis.attractors import wilson
from nsdrill.data import Results
from nsdrill.errors import InputError
from nsdrill.figures.kinds.bifurcation import with_greatest
from nsdrill.figures.kinds.start_pictures import LARGEST_MARKER
from nsdrill.figures.kinds.start_pictures import marker_diameter as size
from nsdrill.figures.style import RESPONSES
from nsdrill.models.responses import BIT_BOUNCE, WHIRL
from nsdrill.variables import OK, STEP_LIMIT

STARTS = 20
SPEEDS = np.linspace(2.0, 8.0, 7)


def with_starts(results: Results, starts: int = STARTS, plane: dict[str, object] | None = None) -> Results:
    """Starts beside each other: the first few smooth, then bouncing in two ways, with
    whirl at high speed."""
    rng = np.random.default_rng(4)
    variables = {}
    for name, values in results.variables.items():
        variables[name] = np.repeat(np.expand_dims(values, 4), starts, axis=4)
    variables["attractor"] = np.zeros(variables["status"].shape, np.int16)
    k = np.arange(starts)
    for place in np.ndindex(*results.variables["status"].shape):
        calm = int(starts * (0.6 - 0.08 * place[3]))
        other = calm + (starts - calm) // 3
        response = np.where(k < calm, 0, BIT_BOUNCE | (WHIRL if place[3] > 4 else 0))
        groups = np.where(k < calm, 0, np.where(k < other, 1, 2))
        # one of a whole sweep need not be here
        variables["attractor"][place] = np.array([1, 5, 2])[groups]
        variables["response"][place], variables["whirl_kind"][place] = (response, np.where(response & WHIRL, 3, 0))
        variables["settled"][place] = groups < 2
        variables["radius_max"][place] = 0.005 + 0.03 * groups
        variables["axial_max"][place], variables["axial_min"][place] = 1e-3 + 8e-3 * groups, -2e-3
        variables["stick_slip_index"][place] = 5 + 8 * groups
        variables["initial_state"][place] = rng.uniform(-1e-2, 1e-2, (starts, 9))
    study = {"initial": {"slice": plane or {}}, "classify": {"attractors": {"tolerance": 0.05, "matching": 0.25}}}
    attrs = results.attrs | {"study_resolved": json.dumps(study)}
    return Results(results.coords | {"start": np.arange(starts)}, variables, attrs)


@pytest.fixture(scope="module")
def ensemble():
    return with_starts(make_results(rotary_speed=SPEEDS))


@pytest.fixture(scope="module")
def basins():
    plane = {"x": {"from": -0.07, "to": 0.07, "points": 5}, "vx": {"from": -1.0, "to": 1.0, "points": 4}}
    return with_starts(make_results(rotary_speed=[3.0]), plane=plane)


def test_the_kinds(ensemble, basins):
    assert figures.kinds_for(ensemble) == ("shares", "attractors", "basin", "window")
    assert figures.kinds_for(basins) == ("basin",)
    assert "status" in figures.needed(ensemble)
    assert "initial_state" in figures.needed(basins)


def test_columns_are_the_shares(ensemble):
    figure = figures.draw(ensemble)
    (axes,) = figure.axes
    for column, speed in enumerate(SPEEDS):
        heights = {}
        for area in axes.collections:
            x, y = area.get_paths()[0].vertices.T
            if x.min() < speed < x.max():
                code = int(str(area.get_gid()).split(":")[2])
                heights[code] = heights.get(code, 0.0) + y.max() - y.min()
                assert to_hex(area.get_facecolor()[0]) == RESPONSES[code].colour.lower()
        found = ensemble["response"][0, 0, 0, column]
        expected = {int(code): 100 * float(np.mean(found == code)) for code in np.unique(found)}
        assert heights == pytest.approx(expected)
        assert sum(heights.values()) == pytest.approx(100)
    assert {"no critical response", "bit-bounce", "bit-bounce + whirl", "95 % interval", "between attractors"} == set(
        legend_words(figure)
    )


def test_intervals_are_wilsons(ensemble):
    figure = figures.draw(ensemble, "shares")
    bars = [line for line in figure.axes[0].get_lines() if str(line.get_gid()) == "interval:0"]
    assert len(bars) == len(SPEEDS)
    for bar in bars:
        column = int(np.argmin(np.abs(SPEEDS - bar.get_xdata()[0])))
        calm = int(np.sum(ensemble["response"][0, 0, 0, column] == 0))
        assert np.array(bar.get_ydata()) / 100 == pytest.approx(wilson(calm, STARTS))


def test_failed_starts_are_left_out_and_counted(ensemble):
    variables = {name: values.copy() for name, values in ensemble.variables.items()}
    variables["status"][0, 0, 0, 2, :3], variables["attractor"][0, 0, 0, 2, :3] = STEP_LIMIT, 0
    figure = figures.draw(Results(ensemble.coords, variables, ensemble.attrs), "shares")
    assert "not known (3 of 140, 3 failed)" in legend_words(figure)
    (axes,) = figure.axes
    (area,) = (one for one in axes.collections if one.get_gid() == "unknown")
    assert area.get_datalim(axes.transData).y0 == pytest.approx(100 * (1 - 3 / len(ensemble.coords["start"])))


def test_attractors_by_share_and_response(ensemble):
    figure = figures.draw(ensemble, "attractors")
    assert [axes.get_ylabel() for axes in figure.axes] == [
        "Greatest radius [mm]",
        "Axial range [mm]",
        "Stick-slip index [%]",
    ]
    markers = [line for line in figure.axes[0].get_lines() if str(line.get_gid()).startswith("radius_max")]
    assert len(markers) == 3 * len(SPEEDS)
    for line in markers:
        code = int(str(line.get_gid()).split(":")[1])
        assert to_hex(line.get_color()) == RESPONSES[code].colour.lower()
        opened = line.get_markerfacecolor() == "none"
        assert opened == (line.get_ydata()[0] == pytest.approx(65)), "the second bounce is unsettled"
    column = [line for line in markers if line.get_xdata()[0] == SPEEDS[0]]
    sizes = {round(float(line.get_ydata()[0])): line.get_markersize() for line in column}
    members = {5: 12, 35: 2, 65: 6}
    least = size(0.0)
    assert (sizes[5] - least) / (sizes[65] - least) == pytest.approx((members[5] / members[65]) ** 0.5)
    assert size(0.05) > 3.0, "points: a share of 5 % is seen"


def test_one_attractor_is_one_line(ensemble):
    """Its markers in the order of the speeds, dotted over a speed where it has no
    start."""
    variables = {name: values.copy() for name, values in ensemble.variables.items()}
    gone = variables["attractor"][0, 0, 0, 3]
    gone[gone == 5] = 2
    figure = figures.draw(Results(ensemble.coords, variables, ensemble.attrs), "attractors")
    steps = [line for line in figure.axes[0].get_lines() if line.get_gid() == "branch:5"]
    assert [line.get_xdata().tolist() for line in steps] == [
        [a, b] for a, b in zip(SPEEDS[[0, 1, 2, 4, 5]], SPEEDS[[1, 2, 4, 5, 6]], strict=True)
    ]
    assert [line.get_linestyle() for line in steps] == ["-", "-", ":", "-", "-"]
    assert all(line.get_ydata() == pytest.approx([35, 35]) for line in steps)
    assert {text.get_text() for text in figure.axes[1].texts} == {"1", "2", "5"}


def test_one_attractor_is_one_band(ensemble):
    (axes,) = figures.draw(ensemble, "shares").axes
    numbers = {str(text.get_gid()): text.get_text() for text in axes.texts}
    # The response of 2 and 5 changes between the fifth and the sixth speed.
    assert numbers == {"number:1:0": "1", "number:2:1": "2", "number:5:1": "5", "number:2:5": "2", "number:5:5": "5"}
    white = [line for line in axes.get_lines() if line.get_color() == "white"]
    flat = [line for line in white if line.get_xdata()[0] != line.get_xdata()[1]]
    risers = [line for line in white if line.get_xdata()[0] == line.get_xdata()[1]]
    assert len(flat) == len(SPEEDS)
    # between the columns of one response, and none where it changes or the border goes on
    edges = [(left.get_ydata()[0], right.get_ydata()[0]) for left, right in pairwise(flat)]
    assert len(risers) == sum(left != right for left, right in [*edges[:4], edges[5]])
    for line in risers:
        left, right = (
            next(f.get_ydata()[0] for f in flat if f.get_xdata()[end] == pytest.approx(line.get_xdata()[0]))
            for end in (1, 0)
        )
        assert sorted(line.get_ydata()) == pytest.approx(sorted([left, right]))


def regrouped(results: Results, numbers: dict[int, int], column: int) -> Results:
    """The results with other numbers of the attractors at one operating point."""
    variables = {name: values.copy() for name, values in results.variables.items()}
    of_point = variables["attractor"][0, 0, 0, column]
    of_point[:] = [numbers.get(number, number) for number in of_point.tolist()]
    return Results(results.coords, variables, results.attrs)


def test_attractors_of_one_response_are_divided_where_one_follows_another(ensemble):
    """Neither has a neighbour of its response in its column: the calm one of the first
    speed is another one."""
    (axes,) = figures.draw(regrouped(ensemble, {1: 8}, 0), "shares").axes
    calm = [100 * float(np.mean(ensemble["response"][0, 0, 0, column] == 0)) for column in (0, 1)]
    first = [line for line in axes.get_lines() if list(line.get_xdata()) == [2.5, 2.5] and min(line.get_ydata()) == 0]
    assert [line.get_ydata() for line in first] == [pytest.approx([0.0, min(calm)])]


@pytest.mark.usefixtures("laid_out")
def test_no_number_lies_under_a_bar(ensemble):
    (axes,) = figures.draw(ensemble, "shares").axes
    bars = [line.get_window_extent() for line in axes.get_lines() if str(line.get_gid()).startswith("interval")]
    assert len(bars) == len(SPEEDS), "one in the middle of each column"
    for box in (text.get_window_extent() for text in axes.texts):
        assert not any(box.x0 < bar.x1 and bar.x0 < box.x1 for bar in bars)


@pytest.mark.usefixtures("laid_out")
def test_every_attractor_can_be_seen_and_has_a_number(ensemble):
    """One without a line too, and two in the same place: side by side."""
    results = regrouped(ensemble, {5: 8}, 3)
    for name in ("radius_max", "axial_max", "axial_min", "stick_slip_index"):
        results.variables[name][0, 0, 0, 0] = results.variables[name][0, 0, 0, 0, 0]
    panels = figures.draw(results, "attractors").axes
    for axes in panels:
        words = [number for text in axes.texts for number in text.get_text().split(", ")]
        assert sorted(words) == ["1", "2", "5", "8"]
        boxes = [text.get_window_extent() for text in axes.texts]
        assert not any(one.overlaps(other) for one, other in combinations(boxes, 2))
    name = "radius_max:"
    marks = [line for line in panels[0].get_lines() if str(line.get_gid()).startswith(name)]
    first = sorted(
        panels[0].transData.transform((line.get_xdata()[0], 0))[0] for line in marks if line.get_xdata()[0] < 2.4
    )
    assert len(first) == 3
    assert np.diff(first).min() > 72 / panels[0].figure.dpi * LARGEST_MARKER / 2


def test_cells_of_a_slice_lie_where_they_began(basins):
    figure = figures.draw(basins)
    (axes,) = figure.axes
    mesh = axes.collections[0]
    numbers = np.asarray(mesh.get_array()).reshape(4, 5)  # vx up, x across
    stored = basins["attractor"][0, 0, 0, 0].reshape(5, 4)  # x slow, vx fast
    assert np.array_equal(np.array([0, 1, 2, 5])[numbers], stored.T), "in the order of their shares"
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("$x$ [mm]", "$\\dot x$ [m/s]")
    assert axes.get_xlim() == pytest.approx((-87.5, 87.5))
    assert legend_words(figure)[0] == "1: no critical response, 60 %"
    turned = figures.draw(basins, states=("vx", "x")).axes[0].collections[0]
    assert np.array_equal(np.asarray(turned.get_array()).reshape(5, 4), numbers.T)


def test_dots_of_an_ensemble(ensemble):
    figure = figures.draw(ensemble, "basin", at={"rotary_speed": 3.0}, states=("twist", "bit_speed"))
    (axes,) = figure.axes
    states = ensemble["initial_state"][0, 0, 0, 1]
    numbers = ensemble["attractor"][0, 0, 0, 1]
    settled, drawn = ensemble["settled"][0, 0, 0, 1] == 1, 0
    for line in axes.get_lines():
        kind, _, number = str(line.get_gid()).partition(":")
        if kind in ("attractor", "unsettled"):
            chosen = (numbers == int(number)) & (settled == (kind == "attractor"))
            assert line.get_xdata().tolist() == states[chosen, 6].tolist()
            assert line.get_ydata().tolist() == states[chosen, 7].tolist()
            drawn += len(line.get_xdata())
    assert drawn == len(numbers)
    assert f"open: unsettled ({np.count_nonzero(~settled)} of {len(numbers)} starts)" in legend_words(figure)
    assert axes.get_xlabel() == "Twist [rad]"
    assert "%" in legend_words(figure)[0]
    assert "to" in legend_words(figure)[0], "with its interval"


def test_one_start_is_a_sweep_as_any_other(ensemble):
    figure = figures.draw(ensemble, "bifurcation", start=3)
    lines = [line for axes in figure.axes for line in axes.get_lines()]
    markers = [line for line in lines if str(line.get_gid()).startswith("axial_peaks")]
    drawn = sum(len(line.get_xdata()) for line in markers)
    peaks, greatest = ensemble["axial_peaks"][..., 3, :], ensemble["axial_max"][..., 3]
    assert drawn == np.isfinite(with_greatest(peaks, greatest)).sum()
    for kind in ("bifurcation", "summary"):
        title = figures.draw(ensemble, kind, start=3).get_suptitle()
        assert title.splitlines()[-1].endswith("start 3 of 0 to 19"), kind


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        ({"kind": "bifurcation"}, r"draws one start.*20 starts each.*shares.*'bifurcation' with start, 0 to 19"),
        ({"kind": "nonsense"}, r"not known.*shares"),
        ({"kind": "basin"}, r"7 values of rotary_speed; allowed: one operating point.*rotary_speed"),
        ({"kind": "basin", "at": {"rotary_speed": 3.0}, "states": ("x",)}, r"states: found x; allowed: two of x, vx"),
        ({"kind": "basin", "at": {"rotary_speed": 3.0}, "states": ("x", "q")}, r"found x,q"),
        ({"kind": "shares", "states": ("x", "y")}, r"states: found with kind='shares'; allowed: with kind='basin'"),
        ({"kind": "bifurcation", "start": 20}, r"start: found 20; allowed: 0 to 19"),
        ({"kind": "shares", "at": {"rotary_speed": 3.0}}, r"needs a swept axis"),
    ],
)
def test_messages(ensemble, asked, message):
    with pytest.raises(InputError, match=f"(?s){message}"):
        figures.draw(ensemble, **asked)


def test_messages_elsewhere(basins):
    with pytest.raises(InputError, match="those of the slice, x,vx"):
        figures.draw(basins, states=("x", "y"))
    with pytest.raises(InputError, match=r"initial\.ensemble or initial\.slice"):
        figures.draw(make_results(rotary_speed=SPEEDS), "shares")
    with pytest.raises(InputError, match="every operating point has one start"):
        figures.draw(make_results(rotary_speed=SPEEDS), start=0)
    plane = with_starts(make_results(rotary_speed=SPEEDS, depth=[1000.0, 2000.0]))
    assert figures.kinds_for(plane) == ("window", "basin")
    with pytest.raises(InputError, match=r"it shows one axis: select a value of the others"):
        figures.draw(plane, "shares")
    assert figures.draw(plane, "shares", at={"depth": 1000.0}).axes
    waiting = {name: values.copy() for name, values in basins.variables.items()}
    waiting["attractor"][:] = 0
    assert np.all(waiting["status"] == OK)
    with pytest.raises(InputError, match="not grouped into attractors yet"):
        figures.draw(Results(basins.coords, waiting, basins.attrs))
