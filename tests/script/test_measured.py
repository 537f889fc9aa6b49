"""What a script measures of its model besides its states."""

import json
import warnings

import numpy as np
import pytest

import nsdrill
from nsdrill.errors import NsdrillError
from nsdrill.testing import check_model

from .conftest import command

BLOCK = """MU = 0.3


@nsdrill.model
def block(t, x=0.1, v=0.0, *, stiffness=1.0, dry=0.02, omega=1.2):
    rub = nsdrill.friction("slider", slip=v, normal=dry, static=1.0, smoothing=200.0)
    return v, MU * np.cos(omega * t) - stiffness * x - 0.1 * v - rub


@block.feature("power", "W", "power of friction", mean=True, greatest=True)
def power(v, rub):
    return rub * v


@block.feature("pushed", mean=True)
def pushed(x, stiffness):
    return stiffness * x if x > 0.0 else 0.0
"""


def test_a_feature_is_that_of_a_dense_trace(script):
    block = script(BLOCK, "measured_block").block
    data = nsdrill.run(block.study(transient=0, observe=40, stiffness=2.0, rtol=1e-9), progress=False)
    assert "power_min" not in data
    assert (data.power_mean.attrs["units"], data.power_mean.attrs["long_name"]) == ("W", "mean power of friction")
    trace = nsdrill.simulate(block.study(transient=0, observe=40, stiffness=2.0, rtol=1e-9), sample=1e-3)
    power = trace.rub.values * trace.v.values
    pushed = 2.0 * np.maximum(trace.x.values, 0.0)
    assert data.power_mean.item() == pytest.approx(np.trapezoid(power, trace.time) / 40.0, rel=1e-5)
    assert data.power_max.item() == pytest.approx(power.max(), rel=1e-5)
    assert data.pushed_mean.item() == pytest.approx(np.trapezoid(pushed, trace.time) / 40.0, rel=1e-5)


def test_its_channel_is_checked_against_the_motion(script):
    report = str(check_model(script(BLOCK, "checked_block").block, "simulation: {transient: 0 s, observe: 5 s}"))
    assert "rate of the channel power" in report
    assert "FAIL" not in report


def test_it_is_kept_where_the_function_is_read_anew_and_enters_the_digest(script):
    module = script(BLOCK, "changed_block")
    before = module.block.reading.digest
    module.MU = 0.1
    data = nsdrill.run(module.block.study(transient=0, observe=5), progress=False)
    assert {"power_mean", "pushed_mean"} <= set(data)
    module.MU = 0.3
    module.block.study()
    assert module.block.reading.digest == before
    module.block.feature("more", mean=True)(module.pushed)
    assert module.block.reading.digest != before


REFUSED = {
    "unknown": ("power2", "def f(force):\n    return force", "the argument force; allowed: states, parameters and"),
    "constant": ("power2", "def f(v):\n    return 1.0", "found 1.0 as its value; allowed: one value that depends on"),
    "twice": ("power", "def f(v):\n    return v * v", "found another of this name"),
    "state": ("x", "def f(v):\n    return v * v", "the name of a state, a parameter or a contact"),
    "word": ("a b", "def f(v):\n    return v * v", "the name 'a b'; allowed: letters"),
    "contact": ("power2", "def f(v):\n    return nsdrill.touching('wall', v)", "a contact; allowed: contacts of the"),
    "arguments": ("power2", "def f(*v):\n    return 1.0", "names alone, as"),
    "unit": ("p', 'furlong", "def f(v):\n    return v * v", "the unit 'furlong'"),
    "prints": ("power2", "def f(v):\n    print(1)\n    return v * v", "found output, '1'"),
}  # fmt: skip


@pytest.mark.parametrize("fault", REFUSED)
def test_a_faulty_feature_is_refused_and_leaves_the_model_as_it_is(script, fault):
    name, text, words = REFUSED[fault]
    block = script(BLOCK, f"refusing_{fault}").block
    digest = block.reading.digest
    own, *units = name.split("', '")
    module = script(text + "\n", f"faulty_{fault}")
    with pytest.raises(NsdrillError, match=words):
        block.feature(own, *units)(module.f)
    assert block.study().model.name == "block"
    assert block.reading.digest == digest
    assert [one.name for one in block.measures] == ["power", "pushed"]


INFINITE = """
@nsdrill.model
def osc(x=0.1, v=0.0, *, k=1.0):
    return v, -k * x - 0.5 * v


@osc.feature("pole", greatest=True)
def pole(x, k):
    return k / max(1.0 - k, 0.0) + x


@osc.feature("large", greatest=True)
def large(x, k):
    return 1e200 * k + x


@osc.feature("everywhere", greatest=True)
def everywhere(x, k):
    return k / (x * 0.0)
"""


def test_a_feature_that_is_infinite_is_told_as_such(script, tmp_path):
    """Not as one that no run has; numbers of hundreds of digits have an exponent."""
    study = script(INFINITE, "infinite").osc.study(k=[0.5, 2.0], transient=1, observe=5)
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        nsdrill.run(study, tmp_path / "r.h5", progress=False, workers=1)
    assert not [one for one in told if issubclass(one.category, RuntimeWarning) and "invalid" in str(one.message)]
    (tmp_path / "infinite.py").write_text("import numpy as np\nimport nsdrill\n" + INFINITE, encoding="utf-8")
    found = json.loads(command(tmp_path, "show", "r.h5", "--json", "--with", "infinite.py")[0])
    assert {name: (one["runs"], one["of"]) for name, one in found["infinite"].items()} == {
        "pole_max": (1, 2),
        "everywhere_max": (2, 2),
    }
    assert not found["without"]
    shown = command(tmp_path, "show", "r.h5", "--with", "infinite.py")[0]
    assert "  everywhere_max              infinite in 2 of 2 runs         greatest everywhere\n" in shown
    assert "  pole_max                    infinite in 1 of 2 runs         greatest pole\n" in shown
    assert "no run has it" not in shown
    assert "5e+199 to    2e+200" in shown
