"""Runge-Kutta pairs of scripts: those that hold are as accurate as their order says, others
are refused with what does not hold."""

import runpy

import numpy as np
import pytest

import nsdrill
from nsdrill.kernel import own_pairs
from nsdrill.kernel.pairs import DORMAND_PRINCE
from nsdrill.models.registry import forget_known
from script.conftest import SCRIPTS

# Bogacki & Shampine 1989, Appl. Math. Lett. 2:321-325, the RK23 of SciPy
A, B = [[1 / 2], [0, 3 / 4], [2 / 9, 1 / 3, 4 / 9]], [2 / 9, 1 / 3, 4 / 9, 0]
SHAMPINE = {"a": A, "b": B, "embedded": [7 / 24, 1 / 4, 1 / 3, 1 / 8], "order": 3}


@pytest.fixture(autouse=True)
def pairs_of_this_test():
    yield
    own_pairs.withdraw_pairs(*own_pairs.own_pair_names())
    forget_known()


def run(pair, rtol):
    numbers = {"transient": "0 s", "observe": "20 s", "rtol": rtol, "pair": pair, "method": "explicit"}
    return nsdrill.run({"model": "torsion", "simulation": numbers}, progress=False)


def test_a_pair_written_again_has_its_bits():
    matrix, error = DORMAND_PRINCE.matrix, DORMAND_PRINCE.error
    weights = [*matrix[-1], 0.0]
    embedded = [b - e for b, e in zip(weights, error, strict=True)]
    nsdrill.pair("again", a=matrix, b=weights, embedded=embedded, order=5)
    one, other = run("again", 1e-6), run("dormand_prince", 1e-6)
    assert one.final_state.values == pytest.approx(other.final_state.values, rel=1e-9)
    assert '"pair again"' in one.attrs["used_scripts"]
    assert one.steps == other.steps


def test_a_pair_of_third_order_converges_as_such():
    nsdrill.pair("shampine", **SHAMPINE)
    exact = run("tsitouras", 1e-12).final_state.values
    coarse, fine = (run("shampine", rtol) for rtol in (1e-5, 1e-8))
    errors = [np.max(np.abs(one.final_state.values - exact)) for one in (coarse, fine)]
    assert errors[1] < 1e-5
    # the error of a step is of third order: a thousandth takes ten times as many steps
    assert 6.0 < fine.steps.item() / coarse.steps.item() < 14.0


@pytest.mark.parametrize(("pair", "order", "coarse"), [("bogacki_shampine", 3, 1e-5), ("cash_karp", 5, 1e-6)])
def test_the_pairs_of_the_gallery_have_their_order(pair, order, coarse):
    """The planet comes back to where it began, and what it is off by falls with the steps."""
    planet = runpy.run_path(str(SCRIPTS / "planet.py"))["planet"]
    start, off, steps = np.array([0.5, 0.0, 0.0, np.sqrt(3.0)]), [], []
    for rtol in (coarse, 1e-9):
        study = planet.study(pair=pair, rtol=rtol, transient=0, observe=4.0 * np.pi)
        data = nsdrill.run(study, progress=False)
        off.append(np.max(np.abs(data.final_state.values.ravel()[:4] - start)))
        steps.append(data.steps.item())
    assert off[1] < 5e-7
    assert np.log(off[0] / off[1]) / np.log(steps[1] / steps[0]) == pytest.approx(order, abs=0.3)


FAULTY = {
    "found b that is off by 0.01 in sum b = 1": {"b": [*B[:2], 0.01 + 4 / 9, 0], "a": [*A[:2], [*B[:2], 0.01 + 4 / 9]]},
    "found a last stage that is not the first of the next step": {"b": [1 / 4, 1 / 4, 1 / 4, 1 / 4]},
    "in sum b c^3 = 1/4, of order 4": {"order": 4},
    "found embedded weights that are b": {"embedded": B},
    "found 3 numbers in embedded; allowed: 4": {"embedded": B[:3]},
    "found rows of 1, 1, 3 numbers": {"a": [[0.5], [0.75], A[2]]},
    "found what is no number": {"b": ["2/9", "1/3", "4/9", 0]},
    "found order=9; allowed: 2 to 5": {"order": 9},
}  # fmt: skip


@pytest.mark.parametrize("words", FAULTY)
def test_a_pair_that_does_not_hold_is_refused(words):
    with pytest.raises(nsdrill.InputError) as raised:
        nsdrill.pair("faulty", **{**SHAMPINE, **FAULTY[words]})
    assert words in str(raised.value)
    assert "test_pairs.py, line" in str(raised.value)


def test_the_name_of_a_pair_of_nsdrill_is_refused():
    with pytest.raises(nsdrill.InputError, match="found the name 'tsitouras'"):
        nsdrill.pair("tsitouras", **SHAMPINE)


def test_a_pair_that_no_point_is_integrated_with_is_told_of():
    study = {"model": "torsion", "simulation.pair": "dormand_prince"}
    unread = [one for one in nsdrill.check({**study, "simulation.method": "implicit"}).warnings if "Unread" in one]
    assert unread[0].startswith(
        "Unread: simulation.pair dormand_prince is that of points that are integrated explicitly"
    )
    assert not any("Unread" in one for one in nsdrill.check({**study, "simulation.method": "explicit"}).warnings)
