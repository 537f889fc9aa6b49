"""``data.nsdrill`` of a Dataset: what its arrays say of themselves."""

import json

import numpy as np
import pytest
from xarray import Dataset

import nsdrill
import nsdrill.accessor  # by which xarray knows the name
from nsdrill.models.responses import BIT_BOUNCE, STALLED, WHIRL
from nsdrill.variables import OK


@pytest.fixture
def results():
    flags = {"long_name": "a code", "flag_masks": [1, 2, 4], "flag_values": [0, 1], "flag_meanings": "one other"}
    return Dataset(
        {
            "status": ("rotary_speed", [OK] * 3, flags),
            "response": ("rotary_speed", [0, BIT_BOUNCE, WHIRL], flags),
            "stick_slip_severity": ("rotary_speed", [0, 1, 3], flags),
            "bounce_severity": ("rotary_speed", [0, 3, 1], flags),
        },
        {"rotary_speed": ("rotary_speed", [1.0, 2.0, 3.0], {"units": "rad/s"})},
    )


@pytest.mark.parametrize(
    ("ask", "words", "expected"),
    [
        (lambda data: data.bouncing, "whether the bit bounces", [False, True, False]),
        (lambda data: data.whirling, "whether the collar whirls", [False, False, True]),
        (lambda data: data.safe(), "whether the run is safe", [True, False, False]),
        (
            lambda data: data.safe(1),
            "whether no severity of the run exceeds 1, and the bit is not stalled",
            [True, False, False],
        ),
    ],
)
def test_an_array_of_bool_says_what_it_is(results, ask, words, expected):
    found = ask(results.nsdrill)
    assert found.values.tolist() == expected
    assert found.attrs == {"long_name": words}, "no flags of the variables from which it was found"
    assert found.rotary_speed.attrs == {"units": "rad/s"}


def test_a_bit_that_is_stalled_is_safe_at_no_severity(results):
    stalled = results.assign(response=results.response * 0 + STALLED)
    assert not stalled.nsdrill.safe(3).any()
    assert results.nsdrill.safe(3).all()


def test_it_says_what_it_holds(results):
    text = repr(results.nsdrill)
    assert "object at 0x" not in text
    assert text.startswith(f"nsdrill: {results.status.size} runs over ")
    assert f"bouncing  {int(results.nsdrill.bouncing.sum()):8d}" in text
    assert f"safe()    {int(results.nsdrill.safe().sum()):8d}" in text
    assert results.nsdrill._repr_html_().startswith("<pre>nsdrill: ")
    assert "without the responses" in repr(results[["stick_slip_severity"]].nsdrill)
    failed = results.assign(status=results.status * 0 + 3)
    assert f"not known {results.status.size:8d}" in repr(failed.nsdrill)


def test_what_the_model_cannot_show_is_not_false(results):
    """Torsion has neither whirl nor bit-bounce: no answer says that none occurs."""
    torsion = results.drop_vars("bounce_severity").assign_attrs({**results.attrs, "model": "torsion"})
    assert np.isnan(torsion.nsdrill.whirling).all()
    assert np.isnan(torsion.nsdrill.bouncing).all()
    with pytest.raises(nsdrill.InputError, match="response: found 'whirl'; allowed: stick_slip, stalled"):
        torsion.nsdrill.shows("whirl")
    assert "whirling  not known: the model torsion has none" in repr(torsion.nsdrill)
    assert torsion.nsdrill.sticking.dtype == bool


def test_what_a_frozen_motion_would_show_is_not_known(results):
    study = json.dumps({"modes": {"lateral": "frozen", "axial": "free", "torsional": "free"}})
    frozen = results.assign_attrs({**results.attrs, "study_resolved": study})
    assert np.isnan(frozen.nsdrill.whirling).all()
    assert frozen.nsdrill.bouncing.values.tolist() == [False, True, False]
    assert "whirling  not known: the lateral motion is frozen" in repr(frozen.nsdrill)
