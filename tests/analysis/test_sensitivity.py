"""What a sensitivity says where it has no indices: of samples that are too few, all the same
or partly failed."""

import json

import numpy as np
import pytest

from nsdrill.analysis.sensitivity import sensitivity
from nsdrill.data import Results
from nsdrill.figures import draw
from nsdrill.text.uncertainty_text import conclusion, sensitivity_lines
from nsdrill.variables import OK, STEP_LIMIT, Unknown

ROCK = Unknown("bit.rock_stiffness", "N/m", "Contact stiffness of the rock")
FRICTION = Unknown("bit.friction.static", "1", "Static friction")
PAIRS = 32


def drawn(count: int, seed: int = 0) -> np.ndarray:
    """Independent values of the two unknowns, [count, 2]."""
    return np.array([1e7, 0.3]) + np.array([2e7, 0.3]) * np.random.default_rng(seed).random((count, 2))


def saltelli(count: int = PAIRS) -> np.ndarray:
    """Two matrices of values and, for each unknown, the first with its column of the second."""
    a, b = drawn(count, 1), drawn(count, 2)
    return np.concatenate([a, b, *(np.where(np.arange(2) == k, b, a) for k in range(2))])


def results(values: np.ndarray, sticks: np.ndarray, failed: slice | None = None, *, table: bool = False) -> Results:
    """A point at which the bit sticks in some samples."""
    shape = (1, 1, 1, 1, len(values))
    status = np.full(len(values), OK, np.int8)
    if failed:
        status[failed] = STEP_LIMIT
    index = np.where(status == OK, np.where(sticks, 120.0, 10.0), np.nan)
    variables = {
        "status": status,
        "response": 2 * sticks.astype(np.int8),
        "stick_slip_severity": sticks.astype(np.int8),
        "settled": np.ones(len(values), np.int8),
        "stick_slip_index": index,
        "stuck_fraction": np.where(status == OK, 0.0, np.nan),
    }
    uncertain = {
        ROCK.key: {"uniform": [1e7, 3e7]},
        FRICTION.key: {"uniform": [0.3, 0.6]},
        "samples": len(values) // 4,
        "design": "saltelli",
    }
    if table:
        uncertain = {"table": {key: values[:, n].tolist() for n, key in enumerate((ROCK.key, FRICTION.key))}}
    coords = {
        "procedure": np.array(["same"]),
        "depth": np.array([1500.0]),
        "wob": np.array([20e3]),
        "rotary_speed": np.array([8.0]),
        "sample": np.arange(len(values)),
    }
    attrs = {"model": "torsion", "study_resolved": json.dumps({"uncertain": uncertain})}
    shaped = {name: one.reshape(shape) for name, one in variables.items()}
    return Results(coords, shaped, attrs, (), {ROCK: values[:, 0], FRICTION: values[:, 1]})


def said(given: Results) -> tuple[dict, str, str]:
    """The sensitivity as data, as text, and what the picture says in place of bars."""
    found = sensitivity(given)
    picture = draw(given, "tornado")
    written = [text.get_text() for axes in picture.axes for text in axes.texts]
    return found, "\n".join(sensitivity_lines(found, "si")), " ".join("\n".join(written).split())


def test_runs_that_failed_leave_pairs_without_an_index():
    """Ten of those with a column exchanged: their pairs are left out, and what the first-order
    index may be with them is beside it."""
    values = saltelli()
    sticks = values[:, 1] > 0.45
    found, text, _ = said(results(values, sticks, slice(2 * PAIRS, 2 * PAIRS + 10)))
    safe = found["answers"][0]
    assert (found["failed"], found["of"]) == (10, 4 * PAIRS)
    assert safe["missing"] == 10
    assert safe["pairs"] == {"known": PAIRS - 10, "of": PAIRS}
    assert "10 of 128 samples failed" in text
    assert "indices from the 22 of 32 pairs of samples of which all runs are known" in text
    rock, friction = safe["unknowns"]
    assert rock["first_least"] <= rock["first"] < rock["first_most"]
    whole = sensitivity(results(values, sticks))["answers"][0]["unknowns"]
    for one, other in zip((rock, friction), whole, strict=True):
        assert one["first_least"] - 1e-12 <= other["first"] <= one["first_most"] + 1e-12
    assert "10 of 128 samples failed" in conclusion(found)


def test_too_few_pairs_are_known():
    values = saltelli()
    found, text, picture = said(results(values, values[:, 1] > 0.45, slice(2 * PAIRS, 2 * PAIRS + 20)))
    assert "too few are known for indices; 20 of 128 not known" in text
    assert "too few are known for indices; 20 of 128 are not known" in picture
    assert "not known: 20 of 128 samples failed" in conclusion(found)


def test_samples_with_a_column_exchanged_are_samples_too():
    """Where only they differ, the answer is not the same in every sample."""
    sticks = np.zeros(4 * PAIRS, bool)
    sticks[[2 * PAIRS + 3, 3 * PAIRS + 5]] = True
    found, text, picture = said(results(saltelli(), sticks))
    assert not found["answers"][0]["alike"]
    assert "safe: 100.0 % on average; the samples are too few for indices." in text
    assert "safe: 100.0 % in every sample" not in text
    assert "100 % on average; the samples are too few for indices" in picture
    assert "agree" not in conclusion(found)
    assert "--set uncertain.samples=128" in conclusion(found), "four times those of a matrix"


@pytest.mark.parametrize("design", ["saltelli", "table"])
def test_samples_that_are_too_few_for_indices_do_not_agree(design):
    """Eight in each matrix; and 64 rows of which six are different."""
    values = saltelli(8) if design == "saltelli" else drawn(6)[np.arange(64) % 6]
    found, text, picture = said(results(values, values[:, 1] > np.median(values[:, 1]), table=design == "table"))
    assert found["failed"] == 0
    assert "known samples" not in text + picture
    assert "not known" not in picture
    assert "safe: " in text
    assert "the samples are too few for indices" in text
    assert "too few to say which unknown to measure first" in conclusion(found)
    assert ("--set" in conclusion(found)) == (design == "saltelli"), "a table has as many as it has"


def test_an_unknown_that_is_the_same_in_all_samples_has_no_index():
    values = drawn(64)
    values[:, 0] = 2e7
    found, text, picture = said(results(values, values[:, 1] > 0.45, table=True))
    rock, friction = found["answers"][0]["unknowns"]
    assert (rock["varies"], rock["first"], rock["first_error"], rock["first_most"]) == (False, None, None, None)
    assert friction["varies"]
    assert friction["first"] > 0.8
    assert "20 MN/m, the same in all samples" in text
    assert "not varied" in picture
    assert conclusion(found).endswith("bit rock stiffness is the same in all samples: its effect is not known.")
    found, text, picture = said(results(values, np.zeros(64, bool), table=True))
    assert "whatever the unknowns are" not in text + picture
    assert "no measurement would change that" not in conclusion(found)
    assert "its effect is not known" in conclusion(found)


def test_no_sample_is_both_low_and_high():
    """Where most have the same value, the others are the low or the high ones."""
    values = drawn(64)
    values[:, 0] = np.where(np.arange(64) < 8, 3e7, 1e7)
    sticks = values[:, 0] > 2e7
    rock = sensitivity(results(values, sticks, table=True))["answers"][0]["unknowns"][0]
    assert (rock["low"]["value"], rock["low"]["answer"]) == (1e7, 1.0)
    assert (rock["high"]["value"], rock["high"]["answer"]) == (3e7, 0.0)
