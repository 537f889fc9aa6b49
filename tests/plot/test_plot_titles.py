"""Long titles are broken, not clipped."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import pytest
from made_up import make_results, make_trace

from nsdrill import plot
from nsdrill.data import Results, Trace
from nsdrill.plot.style import MOTIONS, RESPONSES

LONG: dict[str, Any] = {
    "title": "A STRING WITH MUCH TO SAY ABOUT ITSELF " * 6,
    "study_overrides": json.dumps(["drillstring.axial_damping=5 kN*s/m", "mud.density=1400 kg/m^3", "bit.lobes=1"] * 9),
    "study_resolved": json.dumps({"drive": {"kind": "soft_torque"}, "modes": {"axial": "frozen"}}),
    "at": json.dumps({"bit.rock_stiffness": 25e6, "mud.density": 1400.0, "well.friction.static": 0.3}),
}


@pytest.mark.parametrize(
    ("make", "kind"),
    [*((make_trace, kind) for kind in ("trace", "histories", "orbit", "phase", "section")),
     *((make_results, kind) for kind in ("bifurcation", "summary", "window"))],
)  # fmt: skip
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
    """Pictures of the kind of motion have the responses in the same legend. Black is a dash at an equilibrium."""
    colours = [style.colour for style in (*RESPONSES, *MOTIONS) if style.marker != "_"]
    assert len(set(colours)) == len(colours)
