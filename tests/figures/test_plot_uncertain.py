"""Pictures of uncertain numbers: the shades, bands and bars are the numbers of the
analysis."""

import numpy as np
import pytest
from seen import artists, legend_words

from nsdrill import figures
from nsdrill.analysis.graded import graded
from nsdrill.analysis.probability import one_procedure, probabilities_of
from nsdrill.analysis.sensitivity import sensitivity
from nsdrill.analysis.window import find_window
from nsdrill.app.running.run import run_in_memory
from nsdrill.errors import InputError
from nsdrill.figures.look import apply_limits, look_of
from nsdrill.figures.picture_kinds import choose_kind
from nsdrill.models.responses import RESPONSES
from nsdrill.study import parse_study

STUDY = """
operation: {depth: 2000 m}
bit: {lobes: 1, surface_amplitude: 0.5 mm}
sweep:
  wob: {from: 20 kN, to: 100 kN, points: 3}
  rotary_speed: {from: 4 rad/s, to: 12 rad/s, points: 4}
  procedure: up-down
  along: rotary_speed
uncertain:
  bit.rock_stiffness: {lognormal: {median: 25 MN/m, factor: 2}}
  bit.friction.static: {uniform: [0.3, 0.6]}
  samples: 16
simulation: {transient: 10 s, observe: 10 s}
record: {peaks: 0}
"""


@pytest.fixture(scope="module")
def both():
    return run_in_memory(parse_study(STUDY))


def test_maps_show_the_probability_of_each_outcome_in_one_scale(both):
    figure = figures.draw(both, "probability")
    found = probabilities_of(both)
    for number, outcome in enumerate(found.outcomes):
        gid = f"probability:{outcome}"
        mesh = artists(figure, gid)[0]
        is_safe = outcome == "safe"
        assert mesh.axes.get_title() == ("safe brought up from below" if is_safe else RESPONSES[outcome].absence)
        share = found.share[-1, number, 0]
        assert np.allclose(mesh.get_array(), 100.0 * (share if is_safe else 1.0 - share))
        assert (mesh.norm.vmin, mesh.norm.vmax) == (0.0, 100.0)
    assert figure.axes[-1].get_ylabel() == "Probability [%]"
    assert figures.kinds_for(both)[0] == "probability"


def test_the_line_surrounds_the_window_at_the_confidence(both):
    for confidence in (0.5, 0.99):
        figure = figures.draw(both, "probability", confidence=confidence)
        inside = graded(both, confidence=confidence).allowed[0]
        padded = np.pad(inside, 1).astype(int)
        borders = np.abs(np.diff(padded, axis=0)).sum() + np.abs(np.diff(padded, axis=1)).sum()
        line = artists(figure, "confidence")[0]
        assert len(line.get_segments()) == borders
        label = f"allowed with {100 * confidence:g} % or more ({100 * inside.mean():.1f} % of the points)"
        doubts = [one for one in legend_words(figure) if one.startswith("NOT SETTLED")]
        assert len(doubts) == 1, "most of these runs are short"
        assert legend_words(figure) == ([label] if inside.any() else []) + doubts


def test_along_an_axis_the_bands_are_the_intervals(both):
    figure = figures.draw(both, "probability", at={"wob": 60e3})
    one = figures.cut(both, {"wob": 60e3})
    found = probabilities_of(one)
    axes = artists(figure, "line:safe")[0].axes
    for outcome in found.outcomes:
        share, low, high = (100 * part.ravel() for part in found.of(outcome))
        assert np.allclose(artists(axes, f"line:{outcome}")[0].get_ydata(), share)
        band = artists(axes, f"band:{outcome}")[0].get_paths()[0].vertices
        for x, bottom, top in zip(one.coords["rotary_speed"], low, high, strict=True):
            here = band[np.isclose(band[:, 0], x), 1]
            assert here.min() == pytest.approx(bottom, abs=1e-9)
            assert here.max() == pytest.approx(top, abs=1e-9)
    assert np.allclose(artists(axes, "alone:up")[0].get_ydata(), 100 * found.of("safe", "up")[0].ravel())


def test_one_point_has_bars(both):
    figure = figures.draw(both, "probability", at={"wob": 60e3, "rotary_speed": 4.0})
    share = probabilities_of(figures.cut(both, {"wob": 60e3, "rotary_speed": 4.0})).of("safe")[0].ravel()[0]
    axes = figure.axes[0]
    point = artists(axes, "point:safe")[0]
    assert point.get_xdata()[0] == pytest.approx(100 * share)


def test_tornado_bars_reach_from_low_to_high(both):
    figure = figures.draw(both, "tornado", at={"wob": 60e3})
    note = sensitivity(figures.cut(both, {"wob": 60e3}))
    assert len(figure.axes) == len(note["answers"])
    axes = figure.axes[0]
    middle = 100 * note["answers"][0]["mean"]
    for row in note["answers"][0]["unknowns"]:
        for end in ("low", "high"):
            bar = artists(axes, f"{end}:{row['key']}")[0]
            ends = sorted((middle, 100 * row[end]["answer"]))
            assert sorted((bar.get_x(), bar.get_x() + bar.get_width())) == pytest.approx(ends)


def test_the_window_is_drawn_at_its_confidence(both):
    """The colour is the probability of being allowed."""
    figure = figures.draw(both, "window", confidence=0.6)
    [mesh] = artists(figure, "cells")
    np.testing.assert_allclose(mesh.get_array(), 100 * graded(both, confidence=0.6).probability()[0][0])
    is_allowed = graded(both, confidence=0.6).allowed.any()
    assert ("safe with 60 % or more" in legend_words(figure)) == is_allowed


def test_the_first_map_is_of_what_is_allowed_when_brought_up(both):
    """What is safe after any history stands beside it."""
    figure = figures.draw(both, "probability")
    for name, title, any_history in (
        ("safe", "safe brought up from below", False),
        ("any history", "safe after any history", True),
    ):
        [mesh] = artists(figure, f"probability:{name}")
        assert mesh.axes.get_title() == title
        share = graded(both, confidence=0.9).probability(any_history)[0][0]
        np.testing.assert_allclose(mesh.get_array(), 100 * share)
    alone = figures.draw(one_procedure(both, 1), "probability")
    assert not artists(alone, "probability:any history"), "it was not brought up"
    assert artists(alone, "probability:safe")[0].axes.get_title() == "safe lowered from above"


def test_a_sample_is_drawn_as_a_sweep_of_its_own(both):
    figures.draw(both, "map", at={"sample": 3})
    with pytest.raises(InputError, match=r"(?s)draws one sample .* 'map' with at={'sample': \.\.\.}, 0 to 15"):
        figures.draw(both, "map")
    with pytest.raises(InputError, match=r"at\['sample'\]: found 16; allowed: 0 to 15"):
        figures.draw(both, "map", at={"sample": 16})
    with pytest.raises(InputError, match="it needs samples of uncertain numbers"):
        figures.draw(figures.cut(both, {"sample": 3}), "tornado")


def test_limits_leave_the_samples_of_the_unknowns(both):
    """By which a picture knows what no run has in common with the others."""
    kind, _ = choose_kind(both, "probability")
    part, ends = apply_limits(both, kind, look_of(xlim=(5.0, 12.0)))
    assert ends == (5.0, 12.0)
    assert part.swept == both.swept
    assert part.drawn == both.drawn


@pytest.mark.parametrize("kind", ["probability", "tornado", "window"])
def test_pictures_are_in_field_units_too(both, kind):
    figure = figures.draw(both, kind, units="field")
    assert "ft" in figure.get_suptitle()


def test_where_nothing_is_safe_the_most_probable_point_is_drawn(both):
    figure = figures.draw(both, "window", confidence=0.9999)
    note = find_window(both, confidence=0.9999)
    drawn = artists(figure, "most_probable")
    assert len(drawn) == (0 if note["safe"] else 1)
    for line in drawn:
        assert line.get_xdata()[0] == pytest.approx(note["most_probable"]["rotary_speed"])


def test_an_answer_that_does_not_vary_is_told_in_words(both):
    both.variables["lift_off_fraction"] = np.zeros_like(both.variables["lift_off_fraction"])
    panels = {axes.get_xlabel().partition(" [")[0]: axes for axes in figures.draw(both, "tornado").axes}
    (said,) = panels["Time off the rock"].texts
    assert said.get_text().startswith("0 % in every sample")
    assert not panels["Time off the rock"].patches
