"""The resolved study: complete, rebuilt bit for bit, and a digest that knows what
matters."""

import copy
import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nsdrill.data import differences
from nsdrill.errors import FileError
from nsdrill.study import parse_study, study_from_resolved, template_text
from nsdrill.units import from_si

SWEEP = "sweep: {depth: {from: 500 m, to: 9000 m, points: 86}}\n"


def test_from_resolved_is_the_same_study() -> None:
    overrides = ["sweep.wob=[1 lbf, 3.3 kN]", "sweep.procedure=up", "sweep.along=wob"]
    study = parse_study(template_text(), overrides=overrides)
    again = study_from_resolved(json.loads(json.dumps(study.resolved)), study.text, study.source, study.overrides)
    assert again.resolved == study.resolved
    assert again.sha256 == study.sha256
    for name in vars(study).keys() - {"axes"}:
        assert getattr(again, name) == getattr(study, name), name
    for name, axis in study.axes.items():
        assert axis.tobytes() == again.axes[name].tobytes()
        assert axis.dtype == np.float64


@given(
    st.lists(st.floats(201.0, 1e4), min_size=1, max_size=5, unique=True),
    st.floats(0.0, 1e6),
    st.sampled_from(["m", "ft", "in"]),
)
@settings(max_examples=30, deadline=None)
def test_any_study_is_rebuilt_bit_for_bit(depths: list[float], wob: float, unit: str) -> None:
    listed = ", ".join(f"{from_si(depth, unit)!r} {unit}" for depth in depths)
    study = parse_study(f"sweep: {{depth: [{listed}]}}\noperation: {{wob: {wob!r} N}}")
    again = study_from_resolved(json.loads(json.dumps(study.resolved)))
    assert again.resolved == study.resolved
    assert again.axes["depth"].tobytes() == study.axes["depth"].tobytes()
    np.testing.assert_allclose(study.axes["depth"], sorted(depths), rtol=1e-12)


def test_a_long_axis_stays_short() -> None:
    study = parse_study("sweep: {wob: {from: 0 N, to: 1 MN, points: 1000000}}")
    assert study.resolved["sweep"]["wob"] == {"from": 0.0, "to": 1e6, "points": 1_000_000}
    assert len(study.axes["wob"]) == 1_000_000


def test_the_digest_knows_what_matters() -> None:
    base = parse_study(SWEEP + "mud: {density: 1500 kg/m^3, drag: 1}\noperation: {wob: 10 kN}")
    same = (
        "operation: {wob: 10000 N}\nmud: {drag: 1.0, density: 1.5 g/cm^3}\n" + SWEEP,
        "title: other\n" + SWEEP + "operation: {wob: 10 kN, depth: 4000 m}",  # the depth is swept
        "sweep: {depth: {points: 86, to: 500 m, from: 9 km}}\noperation: {wob: 10 kN}",
    )
    for text in same:
        assert parse_study(text).sha256 == base.sha256
    other = (SWEEP + "operation: {wob: 10.1 kN}", SWEEP + "operation: {wob: 10 kN}\nrecord: {peaks: 3}")
    for text in other:
        assert parse_study(text).sha256 != base.sha256


def test_differences_name_the_keys() -> None:
    a = parse_study(SWEEP).resolved
    b = parse_study("sweep: {depth: [1 km]}\nmud: {drag: 2}\n").resolved
    assert differences(a, a) == []
    assert differences(a, b) == [
        ("mud.drag", 1.0, 2.0),
        ("sweep.depth.from", 500.0, None),
        ("sweep.depth.to", 9000.0, None),
        ("sweep.depth.points", 86, None),
        ("sweep.depth", None, [1000.0]),
    ]


def test_a_study_of_an_older_version_has_defaults_for_what_that_did_not_know() -> None:
    study = parse_study(SWEEP)
    old = copy.deepcopy(study.resolved)
    del (old["sweep"]["refine"], old["record"]["poincare"], old["classify"]["motion"], old["initial"]["ensemble"])
    again = study_from_resolved(old)
    assert again.refine == 0
    assert (again.record, again.thresholds, again.initial) == (study.record, study.thresholds, study.initial)
    assert all((again.axes[axis] == study.axes[axis]).all() for axis in study.axes)


@pytest.mark.parametrize("path", [("mud",), ("mud", "drag"), ("sweep",), ("sweep", "along")])
def test_a_damaged_resolved_study_is_a_file_error(path: tuple[str, ...]) -> None:
    resolved = copy.deepcopy(parse_study(SWEEP).resolved)
    inside = resolved
    for part in path[:-1]:
        inside = inside[part]
    del inside[path[-1]]
    with pytest.raises(FileError, match=r"out\.h5"):
        study_from_resolved(resolved, source="out.h5")
