"""A model with its options: there is one of each, and what follows from the two is found
once."""

import pickle
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from nsdrill.app.experiment import prepare
from nsdrill.app.running.run import work_of
from nsdrill.models import registry
from nsdrill.models.christoforou_yigit.columns import Options
from nsdrill.models.registry import NAMES, described, model_named
from nsdrill.models.torsion import Torsion
from nsdrill.models.variant import variant_at, variant_of
from nsdrill.study.load import parse_study
from nsdrill.variables import MODEL


@pytest.mark.parametrize("name", NAMES)
def test_there_is_one_of_each(name):
    model = model_named(name)
    usual = variant_at(model, described(name).parameters())
    assert usual is variant_of(model, tuple(usual.options)) is variant_of(model, usual.options)
    assert variant_of(model) is variant_of(model, model.options())
    assert usual.implicit.options == usual.options._replace(implicit=1)
    assert usual.implicit is usual.implicit.implicit is not usual
    assert usual.model.description is described(name)


def test_a_model_that_is_described_anew_is_another(monkeypatch):
    before = variant_of(model_named("torsion"))
    monkeypatch.setitem(registry._described, "torsion", replace(described("torsion"), title="Another"))
    after = variant_of(model_named("torsion"))
    assert after is not before
    assert after.model.description.title == "Another" != before.model.description.title


def test_options_that_are_left_out_have_their_defaults():
    main = model_named(MODEL)
    assert variant_of(main, (1,)).options == Options(*(1,))
    assert variant_of(main, (1,)) is variant_of(main, Options(*(1,)))


def test_a_model_is_asked_once():
    asked = Counter()

    class Asked(Torsion):
        def names(self, o):
            asked["names"] += 1
            return super().names(o)

        def declaration(self, o):
            asked["declaration"] += 1
            return super().declaration(o)

    model = Asked()
    model.description = described("torsion")
    variant = variant_of(model)
    table = np.ones((3, len(variant.names.parameters)))
    for _ in range(5):
        variant.rows(), variant.motion, variant.phase_rate(table), variant.state_scales(table), variant.declaration
    assert asked["names"] <= 2  # once of the positions that turn with the drive
    assert asked["declaration"] == 1


@pytest.mark.parametrize("name", NAMES)
def test_what_is_compiled_is_known_by_its_name_in_another_process(name):
    """A worker finds the same variant, so that it compiles nothing twice."""
    program = work_of(prepare(parse_study(f"model: {name}\nsweep: {{rotary_speed: [13 rad/s]}}\n"))).program
    assert program.rows.states
    again = pickle.loads(pickle.dumps(program))
    assert (again, hash(again)) == (program, hash(program))
    assert again.variant is program.variant
