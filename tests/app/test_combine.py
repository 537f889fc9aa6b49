"""Files that differ in one number become the file that a sweep of it would have
made."""

from typing import Any

import numpy as np
import pytest
import xarray

import nsdrill
from nsdrill.errors import InputError

STUDY: dict[str, Any] = {
    "sweep": {"rotary_speed": ["3 rad/s", "6 rad/s"]},
    "simulation": {"transient": "4 s", "observe": "8 s"},
    "record": {"peaks": 2},
}


def run(**changes: Any) -> xarray.Dataset:
    return nsdrill.run({**STUDY, **changes}, progress=False)


def same(a: xarray.Dataset, b: xarray.Dataset) -> None:
    assert a.sizes == b.sizes
    for name in (*a.data_vars, *a.coords):
        assert a[name].dims == b[name].dims, name
        assert np.array_equal(a[name].values, b[name].values, equal_nan=a[name].dtype.kind == "f"), name
    assert a.attrs["study_sha256"] == b.attrs["study_sha256"]


def test_a_number_becomes_an_axis_whatever_the_order(tmp_path):
    parts = []
    for stiffness in ("30 MN/m", "10 MN/m", "20 MN/m"):
        parts.append(tmp_path / f"{stiffness[:2]}.h5")
        nsdrill.run({**STUDY, "bit": {"rock_stiffness": stiffness}}, parts[-1], progress=False).close()
    whole = nsdrill.combine(parts, tmp_path / "all.h5")
    swept = run(sweep={**STUDY["sweep"], "bit.rock_stiffness": ["10 MN/m", "20 MN/m", "30 MN/m"]})
    same(whole, swept)
    with nsdrill.open_results(tmp_path / "all.h5") as data:
        same(data.load(), swept)
    at = {"rotary_speed": "6 rad/s", "bit.rock_stiffness": "20 MN/m"}
    assert nsdrill.replay(tmp_path / "all.h5", at=at).attrs["same_bits"] == 1
    assert nsdrill.load_study(str(whole.attrs["study"])).sha256 == swept.attrs["study_sha256"]
    assert "nsdrill 0" in whole.attrs["history"]
    assert "combine" in whole.attrs["history"].splitlines()[-1]


def test_an_operating_value_becomes_an_axis():
    parts = [run(operation={"depth": depth}) for depth in ("2000 m", "1000 m")]
    swept = run(sweep={"depth": ["1000 m", "2000 m"], **STUDY["sweep"]})
    made = nsdrill.combine(parts)
    same(made.transpose(*swept["status"].dims, ...), swept)


def test_an_axis_of_all_gets_the_values_of_all():
    parts = [run(sweep={"rotary_speed": values}) for values in (["3 rad/s", "9 rad/s"], ["6 rad/s"])]
    same(nsdrill.combine(parts), run(sweep={"rotary_speed": ["3 rad/s", "6 rad/s", "9 rad/s"]}))


def test_carried_states_and_samples_stay_as_they_are():
    both = {
        "sweep": {**STUDY["sweep"], "procedure": "up-down", "along": "rotary_speed"},
        "uncertain": {"bit.rock_stiffness": {"uniform": ["10 MN/m", "40 MN/m"]}, "samples": 3},
    }
    parts = [run(**both, operation={"wob": wob}) for wob in ("20 kN", "40 kN")]
    swept = run(**{**both, "sweep": {"wob": ["20 kN", "40 kN"], **both["sweep"]}})
    same(nsdrill.combine(parts).transpose(*swept["status"].dims, ...), swept)
    drawn = parts[1]["bit_rock_stiffness"]
    other = parts[1].assign_coords(bit_rock_stiffness=drawn.copy(data=drawn.values * 1.001))
    with pytest.raises(InputError, match=r"found other samples of bit\.rock_stiffness"):
        nsdrill.combine([parts[0], other])


def test_a_state_of_the_start_becomes_an_axis():
    parts = [run(initial={"x": x}) for x in ("1 mm", "40 mm")]
    same(nsdrill.combine(parts), run(sweep={**STUDY["sweep"], "initial.x": ["1 mm", "40 mm"]}))


def test_what_is_compiled_in_becomes_an_axis():
    parts = [run(bit={"lobes": lobes, "surface_amplitude": "1 mm"}) for lobes in (1, 3)]
    same(nsdrill.combine(parts), run(bit={"surface_amplitude": "1 mm"}, sweep={**STUDY["sweep"], "bit.lobes": [1, 3]}))


def test_attractors_are_numbered_alike_along_the_new_axis():
    drawn = {"ensemble": 4, "spread": 0.1}
    parts = [run(initial=drawn, operation={"wob": wob}) for wob in ("20 kN", "40 kN")]
    swept = run(initial=drawn, sweep={"wob": ["20 kN", "40 kN"], **STUDY["sweep"]})
    same(nsdrill.combine(parts).transpose(*swept["status"].dims, ...), swept)


@pytest.mark.parametrize("carried", [False, True])
def test_refined_sweeps_are_the_refined_sweep_of_all(tmp_path, carried):
    """Each value of the new axis is refined by itself, also in one study."""
    sweep = {"rotary_speed": {"from": "1 rad/s", "to": "9 rad/s", "points": 3}, "refine": 3}
    if carried:
        sweep |= {"wob": ["20 kN", "60 kN"], "procedure": "up", "along": "wob"}
    torsion = {"model": "torsion", "sweep": sweep}
    dampings = ["20 N*m*s/rad", "400 N*m*s/rad"]
    parts = [run(**torsion, drillstring={"torsional_damping": one}) for one in dampings]
    swept = run(**torsion | {"sweep": {**sweep, "drillstring.torsional_damping": dampings}})
    made = nsdrill.combine(parts, tmp_path / "all.h5")
    same(made.transpose(*swept["status"].dims, ...), swept)
    for name in ("refine", "points_run", "points_inferred", "border_spacing"):
        assert made.attrs[name] == swept.attrs[name], name
    assert made.attrs["points_inferred"] > 0
    assert (parts[0]["status"].values != parts[1]["status"].values).any(), "each has borders of its own"
    assert nsdrill.classify(made, {}).sizes == made.sizes


def test_a_refined_axis_is_not_put_together():
    parts = [
        run(model="torsion", sweep={"rotary_speed": {"from": low, "to": high, "points": 2}, "refine": 1})
        for low, high in (("1 rad/s", "3 rad/s"), ("5 rad/s", "9 rad/s"))
    ]
    with pytest.raises(InputError, match=r"rotary_speed.*which is refined: where it is divided depends on all"):
        nsdrill.combine(parts)


@pytest.fixture(scope="module")
def plain():
    return run()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({}, "found the same study"),
        (
            {"operation": {"wob": "30 kN", "depth": "2000 m"}},
            "operation.depth: .*; operation.wob: .* differ in one num",
        ),
        ({"well": {"law": "hertz", "stiffness": "25 MN/m^1.5"}}, "well.law"),
        ({"simulation": {**STUDY["simulation"], "pair": "dormand_prince"}}, "a number that a sweep may vary"),
        ({"sweep": {"rotary_speed": ["6 rad/s", "9 rad/s"]}}, "a value of rotary_speed in two files"),
        ({"record": {"peaks": 3}}, "record.peaks"),
        (
            {"sweep": {**STUDY["sweep"], "procedure": "up"}},
            r"sweep.procedure: same in .*, up in .*begins where its way up ends",
        ),
        (
            {"uncertain": {"bit.friction.static": {"uniform": [0.3, 0.6]}, "samples": 2}},
            r"uncertain.bit.friction.static: nothing in .*; allowed: the same samples in all",
        ),
        ({"initial": {"ensemble": 2}}, "allowed: the same starts in all"),
        ({"simulation": {"transient": "5 s", "observe": "8 s"}}, "simulation.transient"),
    ],
)
def test_what_differs_in_anything_else_is_refused(plain, changes, message):
    with pytest.raises(InputError, match=message):
        nsdrill.combine([plain, run(**changes)])


def test_files_of_other_versions_and_labels_are_refused(plain):
    other = run(operation={"wob": "30 kN"})
    with pytest.raises(InputError, match="other versions"):
        nsdrill.combine([plain, other.assign_attrs(model_digest="of another time")])
    with pytest.raises(InputError, match="labels with other thresholds"):
        nsdrill.combine([plain, nsdrill.classify(other, {"classify.stick_slip.stick_slip_index": 50})])
    with pytest.raises(InputError, match="two or more"):
        nsdrill.combine([plain])
    with pytest.raises(InputError, match="a list of two or more"):
        nsdrill.combine(plain)
