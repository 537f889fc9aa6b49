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
    "found embedded weights too close to b: the error of a step is 1e+06 times the one": {
        "embedded": [b + 1e-6 * (e - b) for b, e in zip(B, SHAMPINE["embedded"], strict=True)]
    },
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


# Of the literature, each with a last stage that is the first of the next step: Fehlberg 1969, Merson 1957, Cash & Karp
# 1990, Zonneveld 1963 and Shu & Osher 1988, the order of b, and its weights and those of the embedded formula.
FEHLBERG = [
    [1 / 4], [3 / 32, 9 / 32], [1932 / 2197, -7200 / 2197, 7296 / 2197], [439 / 216, -8, 3680 / 513, -845 / 4104],
    [-8 / 27, 2, -3544 / 2565, 1859 / 4104, -11 / 40],
]  # fmt: skip
FIFTH = [16 / 135, 0, 6656 / 12825, 28561 / 56430, -9 / 50, 2 / 55]
FOURTH = [25 / 216, 0, 1408 / 2565, 2197 / 4104, -1 / 5, 0]
KARP = [
    [1 / 5], [3 / 40, 9 / 40], [3 / 10, -9 / 10, 6 / 5], [-11 / 54, 5 / 2, -70 / 27, 35 / 27],
    [1631 / 55296, 175 / 512, 575 / 13824, 44275 / 110592, 253 / 4096],
]  # fmt: skip
MERSON = [[1 / 3], [1 / 6, 1 / 6], [1 / 8, 0, 3 / 8], [1 / 2, 0, -3 / 2, 2]]
LITERATURE = {
    "heun": (2, [[1.0]], [1 / 2, 1 / 2], [1, 0]),
    "midpoint": (2, [[1 / 2]], [0, 1], [1, 0]),
    "fehlberg_1": (
        2, [[1 / 2], [1 / 256, 255 / 256]], [1 / 512, 255 / 256, 1 / 512], [1 / 256, 255 / 256, 0],
    ),
    "shu_osher": (3, [[1], [1 / 4, 1 / 4]], [1 / 6, 1 / 6, 2 / 3], [1 / 2, 1 / 2, 0]),
    "merson": (4, MERSON, [1 / 6, 0, 0, 2 / 3, 1 / 6], [1 / 10, 0, 3 / 10, 2 / 5, 1 / 5]),
    "zonneveld": (
        4, [[1 / 2], [0, 1 / 2], [0, 0, 1], [5 / 32, 7 / 32, 13 / 32, -1 / 32]], [1 / 6, 1 / 3, 1 / 3, 1 / 6, 0],
        [-1 / 2, 7 / 3, 7 / 3, 13 / 6, -16 / 3],
    ),
    "fehlberg_5": (5, FEHLBERG, FIFTH, FOURTH),
    "fehlberg_4": (4, FEHLBERG, FOURTH, FIFTH),
    "karp": (
        5, KARP, [37 / 378, 0, 250 / 621, 125 / 594, 0, 512 / 1771],
        [2825 / 27648, 0, 18575 / 48384, 13525 / 55296, 277 / 14336, 1 / 4],
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", LITERATURE)
def test_a_pair_of_the_literature_passes_and_a_thousandth_of_its_estimate_does_not(name):
    order, rows, b, embedded = LITERATURE[name]
    rows, b, embedded = [*rows, b], [*b, 0.0], [*embedded, 0.0]
    assert own_pairs.fault_of(rows, b, embedded, order) == ""
    near = [one + 1e-3 * (other - one) for one, other in zip(b, embedded, strict=True)]
    assert own_pairs.fault_of(rows, b, near, order).startswith("embedded weights too close to b")


def test_the_conditions_are_those_of_the_table():
    """Of Hairer, Norsett & Wanner: 1, 1, 2, 4, 9 and 20 trees."""
    assert [len(own_pairs.trees_of(order)) for order in range(1, 7)] == [1, 1, 2, 4, 9, 20]
    condition = own_pairs.fault_of([[0.5], [0.0, 0.5]], [0.0, 0.5, 0.0], [1.0, 0.0, 0.0], 2)
    assert condition == "b that is off by 0.5 in sum b = 1, of order 1; allowed: at most 1e-13"


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
