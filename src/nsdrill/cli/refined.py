"""The result of a refinement in words."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from nsdrill.cli.words import value_text


def refinement_text(refinement: Mapping[str, Any], units: str = "si") -> str:
    """ "1,204 of 3,721 points run, 68 % saved; borders known to 0.7 kN and 0.05 rad/s"."""
    run, points = refinement["points_run"], refinement["points_run"] + refinement["points_inferred"]
    steps = refinement["border_spacing"].items()
    spacing = " and ".join(value_text(key, step, units) for key, step in steps)
    return f"{run:,} of {points:,} points run, {100 * (points - run) / points:.0f} % saved; borders known to {spacing}"
