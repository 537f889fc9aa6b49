"""Whatever the text, a study or a message for people; every number has a finite range."""

import math
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nsdrill.app.check import check
from nsdrill.data import json_text
from nsdrill.errors import FileError, StudyError
from nsdrill.models.christoforou_yigit.parameters import Collar
from nsdrill.models.operation import Operation
from nsdrill.models.responses import Whirl
from nsdrill.ranges import like
from nsdrill.study import json_schema, parse_study, template_text
from nsdrill.study.forms import POINTS
from nsdrill.study.keys import Leaf, keys_named
from nsdrill.study.schema import REFINE
from nsdrill.units import QuantityError


def test_a_field_like_one_that_there_is_not_names_those_there_are():
    with pytest.raises(ValueError, match=r"like: found 'wieght'.* Collar; allowed: .*outer_diameter"):
        like(Collar, "wieght")


SWEEP = "sweep: {rotary_speed: [3 rad/s]}\n"
NUMBERS = {key: leaf for key, leaf in keys_named().leaves.items() if leaf.kind in ("quantity", "number", "whole")}


def raw(leaf: Leaf, value: float) -> object:
    return f"{value!r} {leaf.units.replace(' ', '*')}" if leaf.kind == "quantity" else value


@pytest.mark.parametrize("leaf", [*NUMBERS.values(), POINTS, REFINE], ids=lambda leaf: leaf.key)
def test_the_ends_of_a_range(leaf):
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


def test_what_is_usual_in_the_field_is_told_of_all_that_is_measured_there():
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
def test_a_number_beyond_its_range_is_named_wherever_it_stands(key, value):
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
def test_the_dataclasses_have_the_same_ranges(make, name):
    with pytest.raises(ValueError, match=f"{name}: found .*, allowed: at least .* and at most "):
        make()


def test_the_schema_has_the_ranges():
    parts = json_schema()["$defs"]
    drag = parts["Mud"]["properties"]["drag"]
    assert (drag["minimum"], drag["maximum"]) == (0.0, 1000.0)
    assert (
        "Range: at least 0 and at most 10 000 kN (in the field: 0 to 500 kN)"
        in (parts["Operation"]["properties"]["wob"]["description"])
    )


def test_a_bore_leaves_a_wall():
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
def test_text_that_cannot_be_printed(text, line, key, found):
    with pytest.raises(StudyError) as caught:
        parse_study(SWEEP + text)
    (fault,) = caught.value.faults
    assert (fault.line, fault.key) == (line, key)
    assert found in fault.found
    assert all(part.isprintable() for part in str(caught.value).split("\n"))


def test_a_title_may_have_lines_and_a_key_of_an_override_may_not():
    assert parse_study(SWEEP + "title: |\n  one\n  two\tdone\n").title == "one\ntwo\tdone\n"
    with pytest.raises(StudyError, match=r"set=\{'key': 'value'\}"):
        parse_study(SWEEP, "s", ["mud.\udcff=1"])


TEMPLATE = template_text()
QUICK = settings(max_examples=100)
YAMLISH = st.text(alphabet="sweepdth: {}[]&*!|>'\"\n\t-#%@,?~\\0159.mkN\u2028\x85", max_size=80)


def attempt(text: str, overrides: tuple[str, ...] = ()) -> None:
    error: StudyError | FileError | None = None
    try:
        parse_study(text, "f.yaml", overrides)
    except (StudyError, FileError) as caught:
        error = caught
    if isinstance(error, StudyError):
        assert error.faults
        assert all(fault.found and fault.allowed for fault in error.faults)


@given(st.text(max_size=200) | YAMLISH)
@QUICK
def test_any_text(text):
    attempt(text)


@given(st.text(max_size=40) | YAMLISH)
@QUICK
def test_any_value(text):
    attempt(f"sweep: {{depth: [1 km, 2 km]}}\noperation: {{wob: {text}}}")
    attempt(f"sweep:\n  depth: {text}\n")
    attempt("sweep: {depth: [1 km, 2 km]}", (f"operation.wob={text}", text, f"{text}=3 kN"))


# short, so that the pure-Python parser does not make this slow
LINES = [line.partition(" #")[0].rstrip() for line in TEMPLATE.splitlines()]
CORE = "\n".join(line for line in LINES if line and not line.startswith("#"))


@given(st.integers(0, len(CORE)), st.integers(0, 12), YAMLISH | st.text(max_size=5))
@settings(QUICK, max_examples=60)
def test_mutations_of_a_good_study(start, length, text):
    attempt(CORE[:start] + text + CORE[start + length :])


VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text("abc 159.mkN", max_size=8),
    lambda inner: st.lists(inner) | st.dictionaries(st.sampled_from(["from", "to", "ramp", "x"]), inner, max_size=2),
    max_leaves=5,
)
PATHS = st.sampled_from(
    [
        "sweep",
        "sweep.depth",
        "sweep.wob",
        "sweep.along",
        "well",
        "well.law",
        "well.stiffness",
        "bit.lobes",
        "title",
        "initial.z",
        "classify",
        "classify.stick_slip",
        "record",
        "mud.drag",
        "drillstring.collar",
        "simulation.max_steps",
        "operation.wob",
        "operation.depth.ramp",
    ]
)


@given(st.dictionaries(PATHS, VALUES, max_size=4))
@QUICK
def test_any_structure(values):
    attempt("sweep: {depth: [1 km, 2 km]}", tuple(f"{path}={yaml(value)}" for path, value in values.items()))


def yaml(value: object) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {yaml(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(yaml, value)) + "]"
    return "null" if value is None else str(value).lower() if isinstance(value, bool | float) else str(value)


@pytest.mark.parametrize("size", ["1e300", "1e-300"])
def test_absurd_sizes_are_a_study_or_a_message(size):
    for key in ("well.diameter", "drillstring.collar.outer_diameter", "sweep.depth", "initial.x"):
        attempt("sweep: {wob: [1 kN]}", (f"{key}={size} m",))
