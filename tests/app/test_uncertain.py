"""Studies with uncertain numbers: every sample is a run of its own, and probabilities
are those of a closed form."""

from typing import Any

import numpy as np
import pytest
import xarray
from scipy import integrate

import nsdrill
from nsdrill.app.running.run import run_study
from nsdrill.errors import FileError, InputError
from nsdrill.operations.questions import show
from nsdrill.study.load import parse_study

SHORT: dict[str, Any] = {
    "sweep": {"wob": ["20 kN", "60 kN"], "rotary_speed": {"from": "3 rad/s", "to": "9 rad/s", "points": 3}},
    "uncertain": {
        "bit.rock_stiffness": {"lognormal": {"median": "25 MN/m", "factor": 2}},
        "depth": {"uniform": ["1000 m", "2000 m"]},
        "drillstring.eccentricity": {"triangular": ["1 mm", "5 mm", "13 mm"]},
        "samples": 8,
    },
    "simulation": {"transient": "4 s", "observe": "8 s"},
    "record": {"peaks": 2},
}
CARRIED = {**SHORT, "sweep": {**SHORT["sweep"], "procedure": "up-down", "along": "rotary_speed"}}


@pytest.fixture(scope="module")
def carried(tmp_path_factory):
    path = tmp_path_factory.mktemp("uncertain") / "carried.h5"
    nsdrill.run(CARRIED, path, progress=False, workers=1).close()
    return path


def of_one(study: dict[str, Any], data: xarray.Dataset, number: int) -> dict[str, Any]:
    """The study whose numbers are those of one sample."""
    one = {key: value for key, value in study.items() if key != "uncertain"}
    values = {name: float(data[name][number]) for name in data["status"].coords if data[name].dims == ("sample",)}
    return {
        **one,
        "bit": {"rock_stiffness": f"{values['bit_rock_stiffness']!r} N/m"},
        "drillstring": {"eccentricity": f"{values['drillstring_eccentricity']!r} m"},
        "operation": {"depth": f"{values['operation_depth']!r} m"},
    }


def same(a: xarray.Dataset, b: xarray.Dataset) -> None:
    assert set(a.data_vars) == set(b.data_vars)
    for name in a.data_vars:
        assert a[name].dims == b[name].dims
        assert np.array_equal(a[name].values, b[name].values, equal_nan=a[name].dtype.kind == "f"), name


def test_each_sample_has_the_bits_of_a_study_of_its_own(carried):
    with nsdrill.open_results(carried) as data:
        assert data["status"].dims == ("procedure", "wob", "rotary_speed", "sample")
        assert data["bit_rock_stiffness"].attrs["key"] == "bit.rock_stiffness"
        assert data["operation_depth"].attrs["units"] == "m"
        for number in (0, 5):
            alone = nsdrill.run(of_one(CARRIED, data, number), progress=False)
            same(alone, data.isel(sample=number)[list(data.data_vars)])


def test_numbers_do_not_depend_on_workers_or_neighbours(carried):
    with nsdrill.open_results(carried) as data:
        same(data.load(), nsdrill.run(CARRIED, progress=False, workers=3))
        alone = nsdrill.run({**CARRIED, "sweep": {**CARRIED["sweep"], "wob": ["60 kN"]}}, progress=False)
        same(data.isel(wob=1), alone)


def test_a_sample_that_is_there_twice_is_refused(carried):
    """Its runs are not independent, and an interval of a probability would take them so."""
    with nsdrill.open_results(carried) as data:
        part = data.isel(sample=[3] * 8)
        for call in (nsdrill.probability, nsdrill.window, nsdrill.show):
            with pytest.raises(InputError, match="some values of sample more than once"):
                call(part)
        assert nsdrill.window(data.isel(sample=[5, 1, 2]))["samples"] == 3


def test_any_sample_is_replayed_bit_for_bit(carried):
    for number, procedure in ((0, "up"), (7, "down")):
        at = {"wob": "60 kN", "rotary_speed": "9 rad/s", "sample": number}
        trace = nsdrill.replay(carried, at=at, procedure=procedure)
        assert trace.attrs["same_bits"] == 1
        assert trace.attrs["sample"] == number


def test_one_sample_is_simulated_from_the_study(carried):
    at = {"wob": "20 kN", "rotary_speed": "3 rad/s", "sample": 4}
    trace = nsdrill.simulate(SHORT, at=at)
    with nsdrill.open_results(carried) as data:
        assert trace.attrs["depth"] == float(data["operation_depth"][4])
        final = data["final_state"].sel(procedure="up").isel(wob=0, rotary_speed=0, sample=4).values
    # Beyond the marks of a sweep the steps differ: the motion is the same to the
    # tolerance.
    assert trace.attrs["final_state"][:-1] == pytest.approx(final[:-1], rel=0.05, abs=0.05)


def test_an_interrupted_run_goes_on_to_the_same_numbers(tmp_path, carried):
    class Enough(Exception):
        pass

    def stop(progress):
        if progress.done >= 20:
            raise Enough

    path = tmp_path / "out.h5"
    many = {**CARRIED, "uncertain": {**CARRIED["uncertain"]}}
    with pytest.raises(Enough):
        nsdrill.run(many, path, progress=stop)
    same(nsdrill.run(many, path, resume=True, progress=False), nsdrill.open_results(carried).load())


def test_a_log_with_other_samples_is_not_gone_on_with(tmp_path, monkeypatch):
    class Enough(Exception):
        pass

    def stop(progress):
        raise Enough

    with pytest.raises(Enough):
        nsdrill.run(SHORT, tmp_path / "out.h5", progress=stop)
    real = nsdrill.sampling.rounded
    monkeypatch.setattr("nsdrill.sampling.rounded", lambda values: real(values * (1 + 1e-6)))
    with pytest.raises(FileError, match="not those that this version of SciPy draws"):
        run_study(nsdrill.load_study(SHORT), tmp_path / "out.h5", resume=True)


def test_files_bring_their_own_samples(carried, monkeypatch):
    real = nsdrill.sampling.rounded
    monkeypatch.setattr("nsdrill.sampling.rounded", lambda values: real(values * (1 + 1e-6)))
    at = {"wob": "60 kN", "rotary_speed": "9 rad/s", "sample": 3}
    assert nsdrill.replay(carried, at=at, procedure="down").attrs["same_bits"] == 1


def test_files_go_out_and_in(carried, tmp_path):
    with nsdrill.open_results(carried) as data:
        nsdrill.save(data, tmp_path / "again.h5")
        nsdrill.save(data, tmp_path / "table.csv")
        relabelled = nsdrill.classify(data.load(), {"classify.whirl.wall_contact_fraction": 0.5})
        assert np.any(relabelled["response"] != data["response"])
        same(nsdrill.classify(relabelled), data)
    found = nsdrill.diff(carried, tmp_path / "again.h5")
    assert found["same_numbers"]
    assert found["same_study"]
    lines = (tmp_path / "table.csv").read_text().splitlines()
    assert len(lines) == 1 + 2 * 2 * 3 * 8
    assert lines[0].split(",")[:7] == [
        "procedure",
        "wob [N]",
        "rotary_speed [rad s-1]",
        "sample",
        "operation_depth [m]",
        "drillstring_eccentricity [m]",
        "bit_rock_stiffness [N m-1]",
    ]


def test_no_output_has_the_value_of_the_study_of_an_uncertain_operating_value(carried):
    with nsdrill.open_results(carried) as data:
        assert "depth" not in data.coords
        one = data.isel(sample=3, wob=0, rotary_speed=0)
        assert show(one).summary["axes"]["depth"]["from"] == float(one["operation_depth"])
    shown = show(carried).summary
    assert {"depth", "operation_depth"}.isdisjoint({*shown["axes"], *shown["probabilities"][0]})
    assert "operation.depth" in shown["unknowns"]
    assert "depth" not in nsdrill.probability(carried).coords
    assert "depth" not in nsdrill.window(carried)["fixed"]
    with pytest.raises(InputError, match="depth: found 1500 m; allowed: nothing, as it is uncertain"):
        nsdrill.plot(carried, depth="1500 m")
    title = nsdrill.plot(carried, at={"sample": 3}, wob="20 kN").get_suptitle()
    assert f"{float(one['operation_depth']):.4g} m" in title


def test_diff_names_another_distribution(carried):
    other = {**CARRIED, "uncertain": {**CARRIED["uncertain"], "seed": 2}}
    found = nsdrill.diff(carried, nsdrill.run(other, progress=False))
    assert [row["key"] for row in found["study"]] == ["uncertain.seed"]
    assert not found["same_numbers"]


def test_failed_points_are_run_again(tmp_path):
    few = {**SHORT, "simulation": {**SHORT["simulation"], "max_steps": 1000}}
    with pytest.warns(nsdrill.RunWarning):
        nsdrill.run(few, tmp_path / "out.h5", progress=False)
    more = {**SHORT, "simulation": {**SHORT["simulation"], "max_steps": 1_000_000}}
    same(nsdrill.run(more, tmp_path / "out.h5", retry_failed=True, progress=False), nsdrill.run(SHORT, progress=False))


def test_a_table_of_samples_is_run_row_by_row():
    table = {"bit.rock_stiffness": ["10 MN/m", "40 MN/m", "20 MN/m"], "bit.friction.static": [0.3, 0.5, 0.4]}
    data = nsdrill.run({**SHORT, "uncertain": {"table": table}}, progress=False)
    assert data["bit_rock_stiffness"].values.tolist() == [10e6, 40e6, 20e6]
    one = {**SHORT, "bit": {"rock_stiffness": "20 MN/m", "friction": {"static": 0.4}}}
    del one["uncertain"]
    same(nsdrill.run(one, progress=False), data.isel(sample=2)[list(data.data_vars)])


def test_each_sample_is_refined_by_itself():
    speed = {"from": "3 rad/s", "to": "9 rad/s", "points": 4}
    fine = {**SHORT, "sweep": {"rotary_speed": speed, "refine": 2}, "operation": {"wob": "60 kN"}}
    data = nsdrill.run(fine, progress=False)
    assert int(data["status"].max()) == 5  # some were inferred
    assert data.sizes["rotary_speed"] == 13
    for number in (1, 6):
        one = of_one(fine, data, number)
        one["operation"]["wob"] = "60 kN"
        alone = nsdrill.run(one, progress=False)
        same(alone, data.isel(sample=number)[list(data.data_vars)])
    assert nsdrill.probability(data)["unknown"].max() == 0.0


AXIAL = """
modes: {torsional: frozen, lateral: frozen}
operation: {depth: 1500 m, rotary_speed: 4 rad/s}
drillstring: {axial_damping: 600000 N*s/m}
uncertain:
  wob: {uniform: [5 kN, 40 kN]}
  bit.rock_stiffness: {triangular: [10 MN/m, 20 MN/m, 60 MN/m]}
  samples: 1024
  design: sobol
simulation: {transient: 40 s, observe: 10 s}
record: {peaks: 0}
classify: {bit_bounce: {lift_off_fraction: 1.0e-3}}
"""


@pytest.fixture(scope="module")
def lift_off():
    study = parse_study(AXIAL, "axial.yaml")
    return study, nsdrill.run(study, progress=False)


def least_weight(study: nsdrill.Study, stiffness: Any) -> Any:
    """The weight below which the bit lifts off in steady contact, from the linear
    equation of the axial motion: the force range s0 K |k_a - m_a w^2 + i c_a w| / |K -
    m_a w^2 + i c_a w|, K = k_a + k_c."""
    made = nsdrill.check(study).coefficients
    bit, w = study.parameters.bit, study.parameters.bit.lobes * study.operation.rotary_speed
    damping = study.parameters.drillstring.axial_damping
    string = made.k_a - made.m_a * w**2 + 1j * damping * w
    return bit.surface_amplitude * (made.k_a + stiffness) * abs(string) / abs(string + stiffness)


def test_probability_of_lift_off_is_that_of_the_closed_form(lift_off):
    study, data = lift_off
    low, mode, high, least, most = 10e6, 20e6, 60e6, 5e3, 40e3

    def density(k):
        return (
            2 * (k - low) / (high - low) / (mode - low) if k < mode else 2 * (high - k) / (high - low) / (high - mode)
        )

    def lifted(k):
        return float(density(k) * np.clip((least_weight(study, k) - least) / (most - least), 0.0, 1.0))

    exact, _ = integrate.quad(lifted, low, high, points=[mode], limit=200)
    assert 0.2 < exact < 0.8
    found = nsdrill.probability(data)
    bounce = found.sel(outcome="bit_bounce")
    assert float(bounce["probability"]) == pytest.approx(exact, abs=0.01)
    assert float(bounce["low"]) < exact < float(bounce["high"])
    assert float(found["probability"].sel(outcome="safe")) == pytest.approx(1.0 - exact, abs=0.01)


def test_each_sample_lifts_off_where_the_closed_form_says(lift_off):
    study, data = lift_off
    margin = data["operation_wob"].values / least_weight(study, data["bit_rock_stiffness"].values)
    clear = np.abs(margin - 1.0) > 0.02
    assert np.array_equal((data["response"].values & 1)[clear] > 0, margin[clear] < 1.0)


def test_sensitivity_of_lift_off_is_that_of_the_closed_form():
    text = AXIAL.replace("design: sobol", "design: saltelli").replace("samples: 1024", "samples: 512")
    study = parse_study(text, "axial.yaml")
    data = nsdrill.run(study, progress=False)
    assert data.sizes["sample"] == 4 * 512
    found = nsdrill.sensitivity(data)
    safe = next(answer for answer in found["answers"] if answer["name"] == "safe")
    # The closed form in place of the runs, over many more samples of the same
    # distributions.
    more = parse_study(text.replace("samples: 512", "samples: 16384"), "more.yaml").drawn
    yes = (more["wob"] > least_weight(study, more["bit.rock_stiffness"])).astype(float)
    a, b, *mixed = yes.reshape(4, -1)
    order = ["wob", "bit.rock_stiffness"]  # of the axes of a study
    variance = np.concatenate([a, b]).var()
    for key, part in zip(order, mixed, strict=True):
        row = next(row for row in safe["unknowns"] if row["key"].endswith(key))
        assert row["first"] == pytest.approx(np.mean((b - b.mean()) * (part - a)) / variance, abs=0.08)
        assert row["total"] == pytest.approx(np.mean((a - part) ** 2) / 2 / variance, abs=0.06)
    assert found["measure_first"]["key"] == "operation.wob"


def test_results_without_samples_are_refused():
    plain = {key: value for key, value in SHORT.items() if key != "uncertain"}
    data = nsdrill.run(plain, progress=False)
    for function in (nsdrill.probability, nsdrill.sensitivity):
        with pytest.raises(InputError, match="without samples; allowed: results of a study with the section uncertain"):
            function(data)
    with pytest.raises(InputError, match="confidence: found results without samples"):
        nsdrill.window(data, confidence=0.9)


def test_the_other_models_have_samples_too():
    section = {"wob": {"uniform": ["20 kN", "30 kN"]}, "samples": 4}
    study = {"model": "torsion", "uncertain": section, "simulation": {"transient": "1 s", "observe": "2 s"}}
    data = nsdrill.run(study, progress=False)
    assert data["status"].dims == ("sample",)
    assert len(np.unique(data["bit_speed_max"])) > 1
