"""What Python says of the public names: their docstrings are whole, and their examples
run; help and dir show what users need."""

import doctest
import inspect
import pydoc
from typing import Any

import numpy as np
import pytest

import nsdrill
from nsdrill.accessor import Accessor
from nsdrill.analysis.safety import run_safety
from nsdrill.app.datasets import results_in
from nsdrill.kernel.own_pairs import withdraw_pairs
from nsdrill.models.friction import withdraw_laws
from nsdrill.models.own_drives import withdraw_drives
from nsdrill.models.registry import withdraw, withdraw_features

STUDY = """\
title: Five speeds
operation: {depth: 2000 m, wob: 22.24 kN}
sweep:
  rotary_speed: {from: 2 rad/s, to: 6 rad/s, points: 5}
  procedure: up-down
simulation: {transient: 2 s, observe: 2 s}
record: {peaks: 4}
"""
SHORT = """\
model: torsion
operation: {depth: 2000 m, wob: 22.24 kN}
sweep: {rotary_speed: [3 rad/s, 5 rad/s]}
simulation: {transient: 2 s, observe: 2 s}
"""
UNCERTAIN = """\
uncertain:
  bit.friction.static: {uniform: [0.2, 0.8]}
  samples: 16
"""
ENSEMBLE = "initial: {ensemble: 4, seed: 1}\n"
BRANCHES = """\
model: torsion
operation: {depth: 5000 m, wob: 22.24 kN}
simulation: {transient: 50 s, observe: 50 s}
continue: {along: rotary_speed, from: 1.5 rad/s, to: 6 rad/s, seeds: {rotary_speed: [5 rad/s]}, points: 300}
"""
FIELD = "rotary_speed [rad/s],surface_torque_max [kN*m]\n3,3.1\n5,2.9\n"
FUNCTIONS = [name for name in nsdrill.__all__ if name.islower()]
THINGS: dict[str, Any] = {
    "nsdrill": nsdrill,
    **{name: getattr(nsdrill, name) for name in nsdrill.__all__},
    "data.nsdrill": Accessor,
    "data.nsdrill.safe": Accessor.safe,
    "data.nsdrill.plot": Accessor.plot,
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The files that the examples name."""
    made = tmp_path_factory.mktemp("examples")
    for name, text in (
        ("study.yaml", STUDY),
        ("uncertain.yaml", SHORT + UNCERTAIN),
        ("ensemble.yaml", STUDY.replace("  procedure: up-down\n", "") + ENSEMBLE),
        ("branches.yaml", BRANCHES),
        ("field.csv", FIELD),
    ):
        (made / name).write_text(text)
    for name, results in (("study", "out"), ("uncertain", "uncertain"), ("ensemble", "ensemble")):
        nsdrill.run(made / f"{name}.yaml", made / f"{results}.h5", progress=False)
    return made


@pytest.fixture
def here(folder, monkeypatch):
    monkeypatch.chdir(folder)
    yield folder
    withdraw("pendulum")  # which examples make
    withdraw_drives("braking")
    withdraw_laws("coulomb")
    withdraw_pairs("bogacki_shampine")
    withdraw_features("torsion")
    for written in ("film.gif", "table.csv", "picture.pdf"):
        (folder / written).unlink(missing_ok=True)


@pytest.mark.parametrize("name", THINGS)
def test_the_examples_run(name, here):
    text = inspect.cleandoc(THINGS[name].__doc__)
    test = doctest.DocTestParser().get_doctest(text, {"nsdrill": nsdrill}, name, name, 0)
    assert test.examples, f"{name} has no example"
    said = []
    doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE).run(test, out=said.append)
    assert not said, "".join(said)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_every_parameter_is_described(name):
    function = getattr(nsdrill, name)
    text = inspect.cleandoc(function.__doc__)
    for head in ("Parameters", "Returns", "Raises", "Examples"):
        assert f"\n{head}\n{'-' * len(head)}\n" in text, head
    part = text.partition("Parameters\n----------\n")[2].partition("\n\nReturns")[0]
    described = [
        word for line in part.splitlines() if not line.startswith(" ") for word in line.partition(" : ")[0].split(", ")
    ]
    assert sorted(described) == sorted(inspect.signature(function).parameters)


def test_help_shows_the_function_that_draws():
    shown = pydoc.render_doc(nsdrill.plot, renderer=pydoc.plaintext)
    assert "function plot in " in shown
    assert "panel : str, optional" in shown


def test_dir_shows_the_public_names():
    assert dir(nsdrill) == sorted(nsdrill.__all__)
    assert {"Fit", "Report", "View"} <= set(dir(nsdrill))
    for name in dir(nsdrill):
        assert inspect.getdoc(getattr(nsdrill, name))


def test_the_responses_of_a_dataset(here):
    """The bits 1, 2, 4 and 8 of results that ended well; safe are the runs of the
    window."""
    data = nsdrill.open_results("out.h5").load()
    data["response"][0] = [0, 1, 2, 4, 7]
    data["response"][1, 0] = 8  # stalled, which no severity makes safe
    assert data.nsdrill.stalled.dtype == bool
    assert data.nsdrill.stalled.values.ravel().tolist() == [False] * 5 + [True] + [False] * 4
    data["status"][0, -1] = 2  # diverged: nothing was carried from there to the way down
    up = data.nsdrill
    assert up.known.values.tolist() == [[True] * 4 + [False], [False] * 5]
    for name, expected in (("bouncing", [0, 1, 0, 0, 0]), ("sticking", [0, 0, 1, 0, 0]), ("whirling", [0, 0, 0, 1, 0])):
        found = getattr(up, name)
        assert found.dims == data.response.dims
        assert found[0].values[:-1].tolist() == expected[:-1]
        assert np.isnan(found[0, -1]), "what a run shows that failed is not known"
        assert found.attrs["long_name"].startswith("whether the ")
    assert not up.safe(4)[1, 0]
    assert up.safe()[0].values.tolist() == [True, False, False, False, False]
    needed = ["status", "response", "stick_slip_severity", "bounce_severity", "whirl_severity"]
    results = results_in(data, "window", needed)
    for severity in (None, 0, 2, 4):
        safe = run_safety(results, severity).safe
        assert np.array_equal(data.nsdrill.safe(severity).values.ravel(), safe.ravel())
    assert data.sel(procedure="up").nsdrill.safe().dims == ("rotary_speed",)
    for wrong in (5, True, "2"):
        with pytest.raises(nsdrill.InputError, match="severity: found"):
            data.nsdrill.safe(wrong)
    with pytest.raises(nsdrill.InputError, match=r"data\.nsdrill: found a Dataset without status"):
        _ = data[["response"]].nsdrill.bouncing
    assert data.nsdrill.plot("value", panel="radius").axes
