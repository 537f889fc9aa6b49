"""Whatever the text, a study or a message for people: never anything else."""

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from nsdrill.errors import FileError, StudyError
from nsdrill.study import parse_study, template_text

TEMPLATE = template_text()
QUICK = settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.too_slow])
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
def test_any_text(text: str) -> None:
    attempt(text)


@given(st.text(max_size=40) | YAMLISH)
@QUICK
def test_any_value(text: str) -> None:
    attempt(f"sweep: {{depth: [1 km, 2 km]}}\noperation: {{wob: {text}}}")
    attempt(f"sweep:\n  depth: {text}\n")
    attempt("sweep: {depth: [1 km, 2 km]}", (f"operation.wob={text}", text, f"{text}=3 kN"))


# short, so that the pure-Python parser does not make this slow
LINES = [line.partition(" #")[0].rstrip() for line in TEMPLATE.splitlines()]
CORE = "\n".join(line for line in LINES if line and not line.startswith("#"))


@given(st.integers(0, len(CORE)), st.integers(0, 12), YAMLISH | st.text(max_size=5))
@settings(QUICK, max_examples=60)
def test_mutations_of_a_good_study(start: int, length: int, text: str) -> None:
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
def test_any_structure(values: dict[str, object]) -> None:
    attempt("sweep: {depth: [1 km, 2 km]}", tuple(f"{path}={yaml(value)}" for path, value in values.items()))


def yaml(value: object) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {yaml(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(yaml, value)) + "]"
    return "null" if value is None else str(value).lower() if isinstance(value, bool | float) else str(value)


@pytest.mark.parametrize("size", ["1e300", "1e-300"])
def test_absurd_sizes_are_a_study_or_a_message(size: str) -> None:
    for key in ("well.diameter", "drillstring.collar.outer_diameter", "sweep.depth", "initial.x"):
        attempt("sweep: {wob: [1 kN]}", (f"{key}={size} m",))
