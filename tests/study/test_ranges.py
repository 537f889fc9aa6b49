"""Every number of a study has a finite range, which stands once and holds wherever the
number comes from."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from nsdrill.app.check import check
from nsdrill.data import json_text
from nsdrill.errors import StudyError
from nsdrill.models.christoforou_yigit.parameters import Collar
from nsdrill.models.operation import Operation
from nsdrill.models.responses import Whirl
from nsdrill.study import json_schema, parse_study
from nsdrill.study.forms import POINTS
from nsdrill.study.keys import Leaf, keys_named
from nsdrill.study.schema import REFINE
from nsdrill.units import QuantityError

SWEEP = "sweep: {rotary_speed: [3 rad/s]}\n"
NUMBERS = {key: leaf for key, leaf in keys_named().leaves.items() if leaf.kind in ("quantity", "number", "whole")}


def raw(leaf: Leaf, value: float) -> object:
    return f"{value!r} {leaf.units.replace(' ', '*')}" if leaf.kind == "quantity" else value


@pytest.mark.parametrize("leaf", [*NUMBERS.values(), POINTS, REFINE], ids=lambda leaf: leaf.key)
def test_the_ends_of_a_range(leaf: Leaf) -> None:
    assert math.isfinite(leaf.low)
    assert math.isfinite(leaf.high)
    if leaf.default is not None:
        assert leaf.low <= leaf.default <= leaf.high
    for end, sign in ((leaf.low, -1), (leaf.high, 1)):
        outside = end + sign * (1 if leaf.kind == "whole" else 1e-9 * max(1.0, abs(end)))
        assert leaf.read(raw(leaf, end)) == end
        with pytest.raises(QuantityError) as caught:
            leaf.read(raw(leaf, outside))
        assert leaf.range() in caught.value.allowed


def test_what_is_usual_in_the_field_is_told_of_all_that_is_measured_there() -> None:
    told = {key for key, leaf in NUMBERS.items() if leaf.usual}
    assert told == {key for key in NUMBERS if not key.startswith(("classify.", "record."))}


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("initial.x", "1e308 m"),
        ("drillstring.collar.span", "1e-110 m"),
        ("drillstring.eccentricity", "1e200 m"),
        ("drillstring.material.young_modulus", "1e300 Pa"),
        ("operation.wob", "1e252 kN"),
        ("operation.depth", "1e308 m"),
        ("bit.cutting.c1", "1e300"),
        ("well.stiffness", "1e100 N/m"),
        ("simulation.observe", "1e300 s"),
        ("operation.rotary_speed.ramp", "[[0 s, 3 rad/s], [9 s, 1e9 rad/s]]"),
        ("operation.rotary_speed.ramp", "[[0 s, 3 rad/s], [1e99 s, 4 rad/s]]"),
        ("sweep.wob", "{from: 1 kN, to: 1e250 kN, points: 3}"),
        ("sweep.depth", "[1 km, 1e300 km]"),
        ("initial.slice.vx", "{from: 0 m/s, to: 1e99 m/s, points: 3}"),
    ],
)
def test_a_number_beyond_its_range_is_named_wherever_it_stands(key: str, value: str) -> None:
    found = []
    nested = value
    for part in reversed(key.split(".")):
        nested = f"{{{part}: {nested}}}"
    for text, overrides in ((f"{SWEEP if 'sweep' not in key else ''}{nested[1:-1]}", ()), (SWEEP, (f"{key}={value}",))):
        with pytest.raises(StudyError) as caught:
            parse_study(text, "s", overrides)
        found.append([fault for fault in caught.value.faults if fault.key.startswith(key)])
    for faults in found:
        assert "at most" in faults[0].allowed


@pytest.mark.parametrize(
    ("make", "name"),
    [
        (lambda: Operation(depth=1e308), "depth"),
        (lambda: Collar(span=1e-110), "span"),
        (lambda: replace(Operation(), wob="5"), "wob"),
        (lambda: replace(Operation(), wob=10**400), "wob"),
        (lambda: Whirl(direction=math.nan), "direction"),
        (lambda: replace(Operation(), wob=True), "wob"),
    ],
)
def test_the_dataclasses_have_the_same_ranges(make, name: str) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(ValueError, match=f"{name}: found .*, allowed: at least .* and at most "):
        make()


def test_the_schema_has_the_ranges() -> None:
    parts = json_schema()["$defs"]
    drag = parts["Mud"]["properties"]["drag"]
    assert (drag["minimum"], drag["maximum"]) == (0.0, 1000.0)
    assert (
        "Range: at least 0 and at most 10 000 kN (in the field: 0 to 500 kN)"
        in (parts["Operation"]["properties"]["wob"]["description"])
    )


def test_a_bore_leaves_a_wall() -> None:
    """With almost no wall the string weighs nothing and bears nothing, and quotients of
    both have no meaning."""
    for part in ("collar", "pipe"):
        thin = f"drillstring: {{{part}: {{outer_diameter: 100 mm, inner_diameter: 99.95 mm}}}}"
        with pytest.raises(StudyError, match=r"inner_diameter: found '99.95 mm'; allowed: at most 0.999 times"):
            parse_study(SWEEP + thin)
    json_text(check(parse_study(SWEEP + thin.replace("99.95", "99.9"))).as_json())


@pytest.mark.parametrize(
    ("text", "line", "key", "found"),
    [
        ('title: "a\\0b"', 2, "title", "\\x00 (place 2 of the text)"),
        ('title: "a\\ud800b"', 2, "title", "\\ud800"),
        ('title: "\\x1b[31m"', 2, "title", "\\x1b"),
        (f"title: {'x' * 501}", 2, "title", "501 characters"),
        ('mud:\n  "dr\\0ag": 1', 3, "mud", "\\x00"),
        ('"\\udfff": 1', 2, "", "\\udfff"),
    ],
)
def test_text_that_cannot_be_printed(text: str, line: int, key: str, found: str) -> None:
    with pytest.raises(StudyError) as caught:
        parse_study(SWEEP + text)
    (fault,) = caught.value.faults
    assert (fault.line, fault.key) == (line, key)
    assert found in fault.found
    assert all(part.isprintable() for part in str(caught.value).split("\n"))


def test_a_title_may_have_lines_and_a_key_of_an_override_may_not() -> None:
    assert parse_study(SWEEP + "title: |\n  one\n  two\tdone\n").title == "one\ntwo\tdone\n"
    with pytest.raises(StudyError, match=r"set=\{'key': 'value'\}"):
        parse_study(SWEEP, "s", ["mud.\udcff=1"])
