"""Pictures of strings with frozen motions: these are left out."""

from __future__ import annotations

import json
from typing import Any

import pytest
from made_up import make_results, make_trace

from nsdrill import plot
from nsdrill.data import Results, Trace
from nsdrill.errors import InputError
from nsdrill.models.registry import described, drawn_in
from nsdrill.plot.kinds.returns import section_of


def frozen(*modes: str) -> dict[str, Any]:
    return {"study_resolved": json.dumps({"modes": {mode: "frozen" for mode in modes}})}


def labels(figure: Any) -> list[str]:
    return [axes.get_ylabel().partition(" [")[0] for axes in figure.axes if axes.get_ylabel()]


def returns(*modes: str) -> Results:
    """A sweep with the section of a trace at every point."""
    results = make_results(rotary_speed=(2.0, 3.0, 4.0))
    for name, values in section_of(make_trace()).items():
        results.variables[name] = values + 0.0 * results["bit_speed_max"][..., None]
    results.variables["motion"] = results["status"] * 0 + 2
    results.variables["period"] = results["status"] * 0 + 1
    results.attrs.update(frozen(*modes))
    return results


@pytest.fixture(scope="module")
def trace() -> Trace:
    return make_trace()


@pytest.mark.parametrize(
    ("mode", "kind", "shown"),
    [
        ("lateral", "histories", ["$z$", "Bit speed", "Bit force", "Bit torque"]),
        ("axial", "histories", ["Bit speed", "$r$", "Bit torque", "Wall force"]),
        ("torsional", "histories", ["$z$", "$r$", "Bit force", "Bit torque", "Wall force"]),
        ("lateral", "phase", ["$\\dot z$", "Bit speed"]),
        ("axial", "phase", ["Bit speed", "$\\dot r$"]),
        ("lateral", "section", ["$\\dot z$", "Bit speed"]),
        ("torsional", "section", ["across", "$\\dot z$", "$\\dot r$"]),
        ("lateral", "trace", ["$z$", "Bit speed", "Bit force", "Bit torque", "$\\dot z$", "Bit speed"]),
    ],
)
def test_of_a_trace(trace: Trace, mode: str, kind: str, shown: list[str]) -> None:
    figure = plot.draw(Trace(trace.time, trace.variables, trace.attrs | frozen(mode)), kind)
    assert labels(figure) == shown


@pytest.mark.parametrize(
    ("modes", "kind", "shown"),
    [
        (("lateral",), "bifurcation", ["Axial peaks $z$", "Bit speed peaks"]),
        (("axial", "lateral"), "bifurcation", ["Bit speed peaks"]),
        (("torsional",), "summary", ["Time off the rock", "Time on the wall", "Whirl ratio"]),
        (("lateral",), "poincare", ["$z$", "Bit speed"]),
        (("axial",), "poincare", ["$r$", "Whirl angle from bit", "Bit speed"]),
    ],
)
def test_of_a_sweep(modes: tuple[str, ...], kind: str, shown: list[str]) -> None:
    assert labels(plot.draw(returns(*modes), kind)) == shown


def test_of_a_ramp() -> None:
    trace = make_trace()
    trace.variables["drive_speed"] = trace.time / 20.0
    trace.attrs |= frozen("torsional")
    assert labels(plot.draw(trace, "ramp")) == ["Axial peaks $z$", "Radial peaks $r$"]


def test_the_orbit_of_a_string_without_lateral_motion_is_refused(trace: Trace) -> None:
    alone = Trace(trace.time, trace.variables, trace.attrs | frozen("lateral"))
    assert "orbit" not in plot.kinds_for(alone)
    with pytest.raises(InputError, match=r"'orbit', which does not fit a trace \(the lateral motion is frozen"):
        plot.draw(alone, "orbit")


def test_every_variable_that_is_drawn_has_a_mode_or_moves_with_several() -> None:
    drawn = described("christoforou_yigit").drawn
    names = {*drawn.histories, *sum(drawn.planes, ()), *drawn.section, *sum(drawn.section_planes, ()), *drawn.summary}
    names |= {one[1] for one in drawn.attractors}
    assert names - set(drawn.modes) == {"bit_torque"}
    assert drawn_in(frozen("axial", "lateral")).attractors == ((None, "stick_slip_index", "Stick-slip index"),)
    assert drawn_in({}) is drawn
