"""What answers say of the models of scripts: hysteresis without responses, natural scales, a
fit, workers and clusters."""

import json

import numpy as np
import pytest

import nsdrill
from nsdrill.errors import InputError
from script.conftest import SCRIPTS, command


def test_hysteresis_of_a_model_without_responses_is_in_its_motions(duffing):
    """Between the folds of Duffing's oscillator at a small force two motions are stable: with
    a hardening spring the large one, up in frequency, and the small one, down."""
    hardening = {"cubic": 1.0, "force": 0.3, "damping": 0.1, "dry": 0.0, "transient": 200, "observe": 60, "x": 1.0}
    data = nsdrill.run(duffing.study(omega=(1.4, 2.4, 11), procedure="up-down", **hardening), progress=False)
    (row,) = nsdrill.hysteresis(data)
    up, down = (data.x_max.sel(procedure=way).values for way in ("up", "down"))
    apart = data.parameters_omega.values[np.abs(up - down) > 0.5 * json.loads(data.natural_scales)["x"]]
    assert (row["from"], row["to"]) == (apart.min(), apart.max())
    assert "x_max" in row["differs"]
    assert (row["up"], row["down"]) == ("not_judged", "not_judged")
    same = nsdrill.run(duffing.study(omega=(3.0, 3.4, 3), procedure="up-down", **hardening), progress=False)
    assert nsdrill.hysteresis(same) == []


@pytest.mark.parametrize(
    "of", [{"procedure": "up-down"}, {"uncertain": {"damping": (0.1, 0.2), "samples": 16}}, {"ensemble": 4}]
)
def test_without_responses_nothing_is_safe_or_none(duffing, tmp_path, of):
    nsdrill.run(duffing.study(force=[0.1, 0.3], transient=5, observe=5, **of), tmp_path / "out.h5", progress=False)
    (tmp_path / "duffing.py").write_text((SCRIPTS / "duffing.py").read_text())
    given = ("out.h5", "--with", "duffing.py")
    told, _ = command(tmp_path, "show", *given)
    assert "Responses: not known, as its model declares no responses, so that no run is safe or critical." in told
    assert not any(
        word in told.replace("is safe or", "") for word in ("none", "safe", "Along the sweep", "Probability")
    )
    found = json.loads(command(tmp_path, "show", *given, "--json")[0])
    assert (found["declares_responses"], found["responses"], found.get("probabilities", [])) == (False, {}, [])
    assert '"none"' not in json.dumps({name: found.get(name) for name in ("hysteresis", "attractors")})
    command(tmp_path, "export", "out.h5", "-o", "out.csv", "--with", "duffing.py")
    assert "not_judged" in (tmp_path / "out.csv").read_text()
    assert found.get("intervals", []) == []
    assert ",none," not in command(tmp_path, "export", *given, "-o", "-")[0]
    for words in (
        ("sensitivity",),
        ("plot", "-o", "a.png", "--kind", "probability"),
        ("plot", "-o", "a.png", "--kind", "tornado"),
    ) * ("uncertain" in of):
        assert "declares no responses" in command(tmp_path, words[0], *given, *words[1:], code=2)[1]


def test_without_scales_hysteresis_says_what_it_lacks(duffing):
    data = nsdrill.run(duffing.study(force=[0.1, 0.2], procedure="up-down", transient=5, observe=5), progress=False)
    del data.attrs["natural_scales"]
    with pytest.raises(InputError, match="the model duffing, which has no responses, without the natural scales"):
        nsdrill.hysteresis(data)


def test_natural_scales_are_told_and_kept(folder, duffing):
    told, _ = command(folder, "check", "study.yaml", "--with", "duffing.py")
    assert "Natural scales, of a trial run at the defaults or nsdrill.number(..., scale=): x 0.125, v 0.0625." in told
    told, _ = command(folder, "check", "study.yaml", "--with", "duffing.py", "--json")
    command(folder, "run", "study.yaml", "-o", "out.h5", "--with", "duffing.py")
    kept = json.loads(nsdrill.open_results(folder / "out.h5").natural_scales)
    assert kept == json.loads(told)["natural_scales"] == duffing.model.scale


def test_a_fit_finds_the_number_that_made_the_data(duffing, tmp_path):
    numbers = {"dry": 0.0, "transient": 60, "observe": 60}
    made = nsdrill.run(duffing.study(force=[0.02, 0.05, 0.08], damping=0.2, **numbers), progress=False)
    rows = zip(made.parameters_force.values, made.v_max.values.ravel(), strict=True)
    data = tmp_path / "data.csv"
    data.write_text("parameters.force [1],v_max [1]\n" + "".join(f"{force},{v}\n" for force, v in rows))
    study = {
        "model": "duffing",
        "parameters": {"dry": 0.0},
        "simulation": {"transient": "60 s", "observe": "60 s"},
        "uncertain": {"parameters.damping": {"uniform": [0.1, 0.3]}},
    }
    note = nsdrill.fit(study, data, errors={"v_max": "2%"}, batch=16, rounds=3, progress=False).note
    print(note)


def test_workers_and_a_cluster_give_the_same_bits(folder, duffing):
    pytest.importorskip("distributed")
    for name, more in {"one": ["-j", 1], "two": ["-j", 2], "dask": ["--engine", "dask", "-j", 1]}.items():
        command(folder, "run", "study.yaml", "-o", f"{name}.h5", "--with", "duffing.py", *more)
    one, two, dask = (nsdrill.open_results(folder / f"{name}.h5") for name in ("one", "two", "dask"))
    assert one.equals(two)
    assert one.equals(dask)
