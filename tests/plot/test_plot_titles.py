"""Long titles are broken, not clipped."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from made_up import make_results, make_trace

from nsdrill import plot
from nsdrill.data import Results, Trace
from nsdrill.plot.style import MOTIONS, RESPONSES
from nsdrill.variables import DIVERGED, OK, PENDING

LONG: dict[str, Any] = {
    "title": "A STRING WITH MUCH TO SAY ABOUT ITSELF " * 6,
    "study_overrides": json.dumps(["drillstring.axial_damping=5 kN*s/m", "mud.density=1400 kg/m^3", "bit.lobes=1"] * 9),
    "study_resolved": json.dumps({"drive": {"kind": "soft_torque"}, "modes": {"axial": "frozen"}}),
    "at": json.dumps({"bit.rock_stiffness": 25e6, "mud.density": 1400.0, "well.friction.static": 0.3}),
}


@pytest.mark.usefixtures("laid_out")
@pytest.mark.parametrize(
    ("make", "kind"),
    [
        *((make_trace, kind) for kind in ("trace", "histories", "orbit", "phase", "section")),
        *((make_results, kind) for kind in ("bifurcation", "summary", "window")),
    ],
)
def test_no_line_is_wider_than_its_figure(make: Callable[..., Trace | Results], kind: str) -> None:
    data = make(rotary_speed=(2.0, 3.0)) if make is make_results else make()
    data.attrs |= LONG
    figure: Any = plot.draw(data, kind)
    extent = figure._suptitle.get_window_extent()
    assert 0.0 <= extent.x0 < extent.x1 <= figure.bbox.width
    words = " ".join(figure.get_suptitle().split())
    assert words.startswith(LONG["title"].strip())
    assert "soft torque drive; axial motion frozen" in words


def test_a_short_title_stays_as_it_is() -> None:
    assert plot.draw(make_trace(), "orbit").get_suptitle().splitlines() == [
        "Speed sweep, state carried",
        "5000 m, 66.72 kN, 3 rad/s, carried down",
    ]


def test_each_colour_of_a_legend_means_one_thing() -> None:
    """Pictures of the kind of motion have the responses in the same legend. Black is a
    dash at an equilibrium."""
    colours = [style.colour for style in (*RESPONSES, *MOTIONS) if style.marker != "_"]
    assert len(set(colours)) == len(colours)


def test_what_the_title_says_is_not_said_again() -> None:
    data = make_results(rotary_speed=(2.0, 3.0))
    data.attrs["title"] = "Speeds at 5000 m, state carried"
    assert plot.draw(data).get_suptitle().splitlines() == ["Speeds at 5000 m, state carried", "22.24 kN"]
    data.attrs["title"] = "Speeds at 15000 m and 22.24 kN/m"
    assert plot.draw(data).get_suptitle().splitlines()[1] == "5000 m, 22.24 kN", "other values are no repetition"


@pytest.mark.parametrize("units", ["si", "field"])
def test_the_words_of_the_user_are_never_changed(units: str) -> None:
    """Values of a title stay in its units, and are known to be those of the sweep."""
    data = make_results(rotary_speed=(2.0, 3.0))
    data.attrs["title"] = "My study at 5 klbf and 16404.2 ft, and 15 klbf"
    title, *more = plot.draw(data, units=units).get_suptitle().splitlines()
    assert title == data.attrs["title"]
    assert not more, "5 klbf is 22.24 kN, and 16404.2 ft are 5000 m"


def test_what_the_axes_show_is_no_line_of_the_title() -> None:
    data = make_results(rotary_speed=(2.0, 3.0))
    data.attrs["study_overrides"] = json.dumps(["sweep.wob.points=5", "bit.lobes=1"])
    assert plot.draw(data).get_suptitle().splitlines()[1] == "bit.lobes = 1"


def test_characters_that_no_font_has_are_known_and_warned_of_once(recwarn: pytest.WarningsRecorder) -> None:
    trace = make_trace(5.0)
    assert plot.draw(trace, "orbit").missing == ""  # type: ignore[attr-defined]
    trace.attrs["title"] = "A title with \U0001f9e8\u5fd9 and words"
    figure: Any = plot.draw(trace, "orbit")
    assert "\U0001f9e8" in figure.missing
    assert "A" not in figure.missing
    assert figure._repr_png_()
    assert not [one for one in recwarn if "Glyph" in str(one.message)]


@pytest.mark.parametrize(("status", "words"), [(DIVERGED, "9 of 9 failed)"), (PENDING, "0 of 9 failed, 9 not run yet")])
def test_a_picture_with_nothing_on_it_says_so(status: int, words: str) -> None:
    data = make_results(rotary_speed=np.linspace(1, 8, 9))
    data["status"][:] = status
    for kind in ("bifurcation", "summary", "lift_off", "window"):
        found = [text.get_text() for axes in plot.draw(data, kind).axes for text in axes.texts]
        assert any("no point ended well" in text and words in text for text in found), kind
    data["status"][..., 0] = OK
    assert not any("ended well" in t.get_text() for axes in plot.draw(data).axes for t in axes.texts)
