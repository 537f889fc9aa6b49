"""Results answer the same by the name of their file, as a Dataset and in memory: an answer is of
the runs, not of how they were handed over."""

import json
from dataclasses import replace

import numpy as np
import pytest

import nsdrill
from nsdrill.app.answering.answers import results_for_window
from nsdrill.app.datasets import data_in
from nsdrill.app.running.run import run_study
from nsdrill.operations.questions import _summary

TORSION = """
operation: {depth: 2000 m, wob: 100 kN}
modes: {axial: frozen, lateral: frozen}
sweep: {rotary_speed: {from: 8 rad/s, to: 16 rad/s, points: 9}, procedure: up-down}
simulation: {transient: 60 s, observe: 30 s}
"""


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp("same") / "torsion.h5"
    study = path.with_suffix(".yaml")
    study.write_text(TORSION)
    run_study(nsdrill.load_study(study), path, workers=1)
    return str(path)


def plain(answer) -> str:
    return json.dumps(answer, sort_keys=True, default=str)


def every_form(file):
    dataset = nsdrill.open_results(file)
    return [file, dataset, dataset.load(), data_in(file, None)]


def test_a_file_and_its_dataset_have_one_period_of_stick_slip(file):
    surfaces = [nsdrill.window(one)["answer"]["surface"] for one in (file, nsdrill.open_results(file))]
    assert surfaces[0] == surfaces[1]
    measured = nsdrill.open_results(file)["stick_slip_period"]
    assert surfaces[0]["period"]["stick_slip_period"] in measured.values, "what the runs measured is told"


def test_every_form_of_results_has_one_answer(file):
    first, *others = every_form(file)
    window, show = plain(nsdrill.window(first)), plain(_summary(first, file))
    for one in others[:2]:
        assert plain(nsdrill.window(one)) == window
        assert plain(_summary(one, file)) == show


def test_no_form_of_results_has_more_to_answer_of_than_its_file(file):
    """Whatever of the results is there, an answer reads what it reads of the file."""
    first, *others = (results_for_window(one) for one in every_form(file))
    for one in others:
        assert set(one.variables) == set(first.variables)
        assert all(np.array_equal(one[name], first[name], equal_nan=True) for name in first.variables)
    part = replace(others[-1], part_of=(data_in(file, None), "rotary_speed", np.arange(9)))
    assert set(results_for_window(part).part_of[0].variables) == set(first.variables)
