"""Probabilities and Sobol indices from samples, against counts and functions whose
answers are known."""

import math
from dataclasses import replace

import numpy as np
import pytest
from figures.test_wording import WALL, with_samples
from scipy import stats

import nsdrill
from analysis.grids import told
from nsdrill.analysis.advice import Kind, Share
from nsdrill.analysis.probability import EVERY, interval, probabilities_of, samples_for, window_state
from nsdrill.analysis.sensitivity import indices, sensitivity
from nsdrill.analysis.trials import Trials
from nsdrill.analysis.untried import Jump
from nsdrill.analysis.window import find_window
from nsdrill.app.answering.answers import contrast as app_contrast
from nsdrill.data import Array, Results
from nsdrill.errors import InputError
from nsdrill.figures.slices import ordered
from nsdrill.models.responses import BIT_BOUNCE, SEVERITIES, STALLED, STICK_SLIP, WHIRL
from nsdrill.sampling import Uncertain, draw
from nsdrill.text.contrast_text import difference, notes, sentence, side_by_side, thresholds
from nsdrill.variables import DIVERGED, OK, Unknown
from nsdrill.words.answer import answer, warnings, words_of, would_help

ROCK = Unknown("bit.rock_stiffness", "N/m", "Contact stiffness of the rock")


def made_up(response: Array, status: Array | None = None, attrs: dict[str, str] | None = None) -> Results:
    """Results with ``response`` [procedure, weight on bit, speed, sample]."""
    procedures, weights, speeds, samples = response.shape
    coords = {
        "procedure": np.array([["same"], ["up", "down"]][procedures - 1]),
        "depth": np.array([1500.0]),
        "wob": 10e3 * np.arange(1.0, weights + 1),
        "rotary_speed": np.arange(1.0, speeds + 1),
        "sample": np.arange(samples, dtype=np.int32),
    }
    response = response[:, None].astype(np.int8)
    status = np.full(response.shape, OK, np.int8) if status is None else status[:, None].astype(np.int8)
    drawn = {ROCK: np.linspace(1e7, 2e7, samples)}
    return Results(coords, {"status": status, "response": response}, attrs or {}, (), drawn)


def test_shares_are_counted_for_each_history_and_for_all():
    response = np.zeros((2, 1, 1, 8), int)
    response[0, 0, 0, :3] = STICK_SLIP
    response[1, 0, 0, 2:6] = WHIRL | BIT_BOUNCE
    found = probabilities_of(made_up(response))
    assert found.histories == ("up", "down", EVERY)
    assert found.outcomes == ("safe", "bit_bounce", "stick_slip", "whirl", "stalled")
    assert found.total == 8
    assert found.count[..., 0, 0, 0].tolist() == [[5, 0, 3, 0, 0], [4, 4, 0, 4, 0], [2, 4, 3, 4, 0]]
    # at the only speed no vibration was met above it: what whirls on the way down is borderline
    assert float(found.of("safe")[0].ravel()[0]) == 2 / 8
    assert float(found.of("safe", "up")[0].ravel()[0]) == 5 / 8


def test_a_failed_run_is_not_safe_and_leaves_open_what_it_might_be():
    response, status = np.zeros((2, 1, 3, 10), int), np.full((2, 1, 3, 10), OK)
    # safe downwards, whirling downwards: what is brought up decides, and was lost there
    status[0, 0, 0, :2] = DIVERGED
    status[0, 0, 1, :2], response[1, 0, 1, :2] = DIVERGED, WHIRL
    found = probabilities_of(made_up(response, status))
    assert found.count[-1, 0].ravel().tolist() == [8, 8, 8]
    assert found.open[-1, 0].ravel().tolist() == [2, 2, 2]
    inside, might = window_state(found, 0.9)
    assert not inside.any()
    assert might.all()
    note = find_window(made_up(response, status), confidence=0.9)
    # the way up says what is allowed, and nothing was carried on from the first point
    assert (note["safe"], note["unknown"], note["critical"]) == (0, 3, 0)


@pytest.mark.parametrize("severity", [None, 1])
def test_what_is_safe_is_what_the_window_allows(severity):
    """Free of vibration on the way up, whirling on the way down after whirl above: allowed,
    "safe from below only", in the window, and so in every number and picture."""
    response = np.zeros((2, 2, 6, 32), int)
    response[0, :, 5], response[1, :, 2:] = WHIRL, WHIRL
    response[0, :, 3, 8:] = STICK_SLIP
    data = made_up(response)
    severe = 4 * (response[:, None] > 0)
    data.variables |= dict.fromkeys(SEVERITIES, severe.astype(np.int8))
    window = find_window(data, severity, confidence=0.9)
    inside = window_state(probabilities_of(data, severity), 0.9)[0]
    assert window["safe"] == np.count_nonzero(inside) == 8
    share = probabilities_of(data, severity).of("safe")[0]
    assert share[0, 0].tolist() == [1, 1, 1, 0.25, 1, 0]
    safe = sensitivity(data, severity)["answers"][0]
    assert safe["mean"] == pytest.approx(share.mean())
    # a part of the sweep knows what was met above it
    cut = ordered(data, {"rotary_speed": 3.0, "wob": 10e3})
    assert probabilities_of(cut, severity).of("safe")[0].ravel().tolist() == [1.0]
    assert sensitivity(cut, severity)["answers"][0]["mean"] == 1.0


def test_the_index_of_a_stalled_bit_is_no_number_of_its_stick_slip():
    """That of its creep is arbitrary; the samples without one are counted."""
    response = np.zeros((1, 1, 1, 32), int)
    response[..., :8] = STALLED
    data = made_up(response)
    data.variables["stick_slip_index"] = np.where(response[:, None] == STALLED, 900.0, 20.0)
    rows = {row["name"]: row for row in sensitivity(data)["answers"]}
    assert (rows["stick_slip_index"]["mean"], rows["stick_slip_index"]["missing"]) == (20.0, 8)
    assert rows["safe"]["missing"] == 0


@pytest.mark.parametrize("probability", [0.02, 0.1, 0.5, 0.9, 0.97])
@pytest.mark.parametrize("samples", [64, 256])
def test_intervals_hold_as_often_as_they_say(probability, samples):
    counts = np.random.default_rng(1).binomial(samples, probability, 20_000)
    low, high = interval(counts, samples)
    held = np.mean((low <= probability) & (probability <= high))
    # Of few counts no interval holds exactly: that of Wilson between 92 and 98 %
    # (Brown, Cai and DasGupta 2001).
    assert 0.92 < held < 0.985


@pytest.mark.parametrize(("count", "samples"), [(0, 32), (1, 32), (17, 32), (256, 256), (250, 256)])
def test_intervals_are_those_of_scipy(count, samples):
    theirs = stats.binomtest(count, samples).proportion_ci(0.95, method="wilson")
    assert [float(end) for end in interval(np.array(count), samples)] == pytest.approx([theirs.low, theirs.high])


def test_rows_of_a_table_that_are_the_same_count_as_fewer():
    """Samples that a fit has drawn again by weight: of 5, 2 and 1 of three rows, 64/30
    are worth as much."""
    response = np.zeros((1, 1, 2, 8), int)
    response[..., :5] = WHIRL
    attrs = {"study_resolved": '{"uncertain": {"table": {"bit.rock_stiffness": [1]}}}'}
    plain, results = made_up(response), made_up(response, attrs=attrs)
    for data in (plain, results):
        data.drawn[ROCK] = np.repeat([1e7, 2e7, 3e7], [5, 2, 1])
    # a list of values: draws that happen to be the same are independent
    assert probabilities_of(plain).effective == 8.0
    found = probabilities_of(results)
    assert found.effective == pytest.approx(64 / 30)
    share, low, high = (float(part.ravel()[0]) for part in found.of("safe"))
    assert share == 3 / 8
    assert (low, high) == pytest.approx(tuple(map(float, interval(np.array(3 / 8 * 64 / 30), 64 / 30))))
    assert high - low > 1.3 * (probabilities_of(plain).of("safe")[2] - probabilities_of(plain).of("safe")[1]).ravel()[0]
    assert find_window(results, confidence=0.3)["effective"] == pytest.approx(64 / 30)


def test_intervals_of_sobol_samples_hold_more_often():
    """The answer depends on three unknowns at once; its probability is known."""
    shapes = {name: {"uniform": [0.0, 1.0]} for name in "abc"}
    exact, held, far = 1.0 - 1.0 / 6.0, 0, []
    for seed in range(200):
        x = np.column_stack([*draw(Uncertain(shapes, samples=64, seed=seed)).values()])
        count = np.count_nonzero(x.sum(axis=1) > 1.0)  # outside of a corner of the cube
        low, high = interval(np.array(count), 64)
        held += bool(low <= exact <= high)
        far.append(count / 64 - exact)
    assert held >= 196
    assert np.std(far) < 0.6 * np.sqrt(exact * (1 - exact) / 64)


def test_interval_is_whole_without_samples_and_closed_at_the_ends():
    low, high = interval(np.array([0, 0, 10]), np.array([0, 10, 10]))
    assert (low[0], high[0]) == (0.0, 1.0)
    assert low[1] == 0.0
    assert 0.2 < high[1] < 0.4
    assert high[2] == 1.0
    assert 0.6 < low[2] < 0.8


def map_of_safety(safe: list[list[float]], samples: int = 20) -> Array:
    """Responses [1, y, x, sample] with these shares of samples without a response, the
    others with whirl."""
    share = np.array(safe)
    return np.where(np.arange(samples) < np.round(share * samples)[..., None], 0, WHIRL)[None]


def test_window_is_where_the_confidence_is_reached_and_the_point_inside_is_recommended():
    share = [[0.50, 0.85, 0.90, 0.85, 0.10], [0.60, 0.90, 1.00, 0.95, 0.20], [0.70, 0.85, 0.90, 0.90, 0.30]]
    results = made_up(map_of_safety(share))
    note = find_window(results, confidence=0.9)
    assert note["confidence"] == 0.9
    assert note["samples"] == 20
    assert note["safe"] == 6
    best = note["maps"][0]["recommended"]
    assert (best["wob"], best["rotary_speed"]) == (20e3, 3.0)
    assert best["probability"] == 1.0
    assert best["probability_low"] == pytest.approx(1 / (1 + 1.959963984540054**2 / 20))
    assert best["margins"]["rotary_speed"]["less"]["first_not_safe"] == 1.0
    assert best["margins"]["rotary_speed"]["less"]["responses"] == ["whirl"]
    assert find_window(results)["safe"] == 6  # 90 % where none is given
    assert find_window(results, confidence=0.85)["safe"] == 9
    assert find_window(results, confidence=0.99)["safe"] == 1
    assert note["most_probable"]["probability"] == 1.0
    price = {row["confidence"]: row["safe"] for row in note["price"]}
    assert price == {0.5: 12, 0.8: 9, 0.9: 6, 0.95: 2, 0.99: 1}


def test_the_way_down_grades_what_is_allowed_from_below():
    """Of 20 samples 19 are free coming up; of these coming down at the last speed all but one
    vibrate, without having met that above: near a limit. At the others one vibrates."""
    up, down = map_of_safety([[0.95, 0.95, 0.95]]), map_of_safety([[0.95, 0.95, 0.10]])[..., ::-1]
    note = find_window(told(made_up(np.concatenate([up, down])), [0.0]), confidence=0.9)
    assert note["safe"] == 2
    assert note["answer"].share.probability == 0.95
    assert note["answer"].share.any_history == 0.9
    assert note["most_probable"]["probability"] == 0.95


def test_the_unknown_that_divides_the_samples_best_is_told():
    """The first point is free in the 12 samples with the least stiffness. The threshold lies
    between the twelfth and the next one, 11 1/2 steps of 10/19 MN/m above 10 MN/m."""
    response = np.full((1, 1, 2, 20), WHIRL)
    response[..., 0, :12] = 0
    results = made_up(response)
    results.drawn[ROCK] = np.linspace(1e7, 2e7, 20)
    note = find_window(results, confidence=0.9)
    split = note["answer"].split
    assert (split.unknown, split.below, split.above, split.samples) == (ROCK.name, 1.0, 0.0, (12, 8))
    assert split.threshold == pytest.approx(np.linspace(1e7, 2e7, 20)[11:13].mean())
    [told] = [text for text in would_help(note, "si") if "turns on" in text]
    assert told.startswith("It turns on bit rock stiffness: below 16.05 MN/m 100 %, above 0 % (12 and 8 samples)")
    assert answer(note, "si").startswith("Nothing is 90 % safe. Best: ")
    response[...] = WHIRL
    assert find_window(made_up(response), confidence=0.9)["answer"].split is None


def test_no_unknown_divides_samples_that_it_does_not_decide():
    """The best of many thresholds divides any samples somehow: of 40 random ones that do not
    depend on the stiffness it is told in about one of 20."""
    told, random = 0, np.random.default_rng(3)
    for _ in range(40):
        response = np.where(random.random((1, 1, 2, 64)) < [[0.5], [1.0]], WHIRL, 0)
        results = made_up(response)
        results.drawn[ROCK] = random.permutation(np.linspace(1e7, 2e7, 64))
        told += find_window(results, confidence=0.9)["answer"].split is not None
    assert told <= 5


def test_of_the_saltelli_design_two_matrices_count():
    response = np.full((1, 1, 1, 30), WHIRL)  # of one unknown: 10 x (1 + 2)
    response[..., :20] = 0
    attrs = {"study_resolved": '{"uncertain": {"design": "saltelli", "samples": 10}}'}
    assert probabilities_of(made_up(response, attrs=attrs)).of("safe")[0].ravel()[0] == 1.0
    assert probabilities_of(made_up(response)).of("safe")[0].ravel()[0] == 20 / 30
    with pytest.raises(InputError, match="found 20 samples of the design saltelli; allowed: all 30"):
        probabilities_of(made_up(response[..., :20], attrs=attrs))


def test_by_severity():
    results = made_up(map_of_safety([[0.5, 0.5]]))
    grade = np.where(results["response"] > 0, 2, 0).astype(np.int8)
    for name in ("stick_slip_severity", "bounce_severity", "whirl_severity"):
        results.variables[name] = grade if name == "whirl_severity" else np.zeros_like(grade)
    assert find_window(results, severity=1)["safe"] == 0
    assert find_window(results, severity=2)["safe"] == 2


def test_what_a_severity_allows_stops_nothing():
    """At the first speed it whirls moderately, at the second it sticks severely."""
    whirls, sticks = (np.array([[[[bits], [other]]]]) for bits, other in ((WHIRL, 0), (0, STICK_SLIP)))
    results = made_up(whirls | sticks)
    of = {"whirl_severity": whirls // WHIRL * 2, "stick_slip_severity": sticks // STICK_SLIP * 4}
    grades = {name: grade[:, None].astype(np.int8) for name, grade in of.items()}
    results = Results(results.coords, {**results.variables, **grades}, {}, (), results.drawn)
    for severity, whirl in ((None, 1), (1, 1), (2, 0), (3, 0)):
        window = find_window(results, severity)
        assert (window["obstacles"]["whirl"], window["obstacles"]["stick_slip"]) == (whirl, 1), severity
    run = Results({**results.coords, "sample": np.arange(1)}, results.variables, {}, (), results.drawn)
    assert find_window(run, 2, 0.9)["obstacles"]["whirl"] == 0


def test_a_stalled_run_is_never_safe_whatever_severity_is_allowed():
    """In half of the samples of the first speed the bit stalls; it has no severity."""
    response = np.zeros((1, 1, 2, 8), int)
    response[..., 0, :4] = STALLED
    results = made_up(response)
    for name in SEVERITIES:
        results.variables[name] = np.zeros_like(results["response"])
    for severity in (None, 0, 4):
        found = probabilities_of(results, severity)
        assert found.of("safe")[0].ravel().tolist() == [0.5, 1.0]
        assert found.of("stalled")[0].ravel().tolist() == [0.5, 0.0]
        window = find_window(results, severity, confidence=0.9)
        assert (window["safe"], window["critical"]) == (1, 1)
        assert window["obstacles"]["stalled"] == 1


def test_results_without_samples_have_no_probability():
    results = made_up(np.zeros((1, 1, 2, 4), int))
    del results.coords["sample"]
    plain = Results(results.coords, {name: values[..., 0] for name, values in results.variables.items()})
    with pytest.raises(InputError, match="without samples"):
        probabilities_of(plain)
    with pytest.raises(InputError, match="confidence: found results without samples"):
        find_window(plain, confidence=0.9)
    assert find_window(plain)["confidence"] is None


def test_too_few_samples_to_show_the_confidence_are_told():
    """Of n samples that are all safe the interval begins at n / (n + 1.96^2): 35 reach
    90 %, 34 do not."""

    def warned(count, confidence, sign=0):
        note = find_window(made_up(np.full((1, 1, 3, count), sign)), confidence=confidence)
        return "\n".join(warnings(note, "si"))

    text = warned(16, 0.9)
    assert "TOO FEW SAMPLES to show a confidence of 90 %: where all of 16 are safe" in text
    assert "as low as 80.6 %. 35 samples are needed" in text
    assert "TOO FEW SAMPLES" in warned(34, 0.9)
    assert "TOO FEW" not in warned(35, 0.9)
    assert "TOO FEW SAMPLES" in warned(16, 0.9, WHIRL)  # where no point is safe as well
    assert [samples_for(level) for level in (0.5, 0.9, 0.95)] == [4, 35, 73]


def test_samples_that_do_not_show_the_probability_are_told():
    """Wilson's interval of 39 of 40 is 87.1 to 99.6 %, of 390 of 400 95.5 to 98.6 %, of 20 of 40
    35.2 to 64.8 %, where no point is safe."""

    def warned(safe, count):
        response = np.full((1, 1, 3, count), WHIRL)
        response[..., :safe] = 0
        note = find_window(made_up(response), confidence=0.9)
        return [text for text in warnings(note, "si") if text.startswith("FEW SAMPLES")]

    told = "FEW SAMPLES: 40 give the probability to about"
    assert warned(39, 40) == [f"{told} 6 %, and do not show that it reaches 90 %; four times as many halve that."]
    assert warned(390, 400) == []
    assert warned(20, 40) == [f"{told} 15 %; four times as many halve that."]


def test_samples_that_vibrate_coming_up_are_not_safe_whatever_comes_down():
    up, down = map_of_safety([[0.95, 0.10]]), map_of_safety([[0.10, 0.10]])
    note = find_window(told(made_up(np.concatenate([up, down])), [0.0]), confidence=0.9)
    assert note["safe"] == 1, "what vibrates coming down has met whirl at the second speed"
    assert note["answer"].share.any_history == 0.1


def test_a_window_with_samples_says_what_may_be_and_stands_beside_one_without():
    """Beyond the window some of the samples stick, and the others do not; the other map, of
    single numbers, has no probability."""
    response = np.zeros((1, 1, 3, 10), int)
    response[..., 0, :4] = STICK_SLIP
    response[..., 2, :] = WHIRL
    several = made_up(response, attrs={"study_resolved": "{}"})
    plain = replace(
        several,
        coords={name: values for name, values in several.coords.items() if name != "sample"},
        variables={name: values[..., 5] for name, values in several.variables.items()},
        drawn={},
    )
    assert "2 rad/s (19.1 rpm), started there, 100 % (72 to 100)" in answer(find_window(several), "si")
    assert "free when started there" in answer(find_window(plain), "si")
    found = app_contrast(several, plain)
    (told,) = [row[1:] for row in side_by_side(found, "si") if row[0] == "probability"]
    assert told[0].startswith("100.0 % (")
    assert "single estimates" in told[1]
    assert "in a bit-bounce" in thresholds(found)
    why = "each in 2.5 % of the samples or more, a quarter of the 10 % that need not be safe"
    assert f"{why}; in b bit-bounce" in thresholds(found)
    (told,) = [note for note in notes(found, "si") if note.startswith("ONE HAS SAMPLES, a: ")]
    assert "90 % of 10 samples" in told
    key = "uncertain.samples"
    found["study"] = [{"key": key, "a": "10", "b": None}, {"key": "bit.lobes", "a": "1", "b": "3"}]
    assert difference(found) == "What differs: bit.lobes: 1 in a, 3 in b."


@pytest.mark.parametrize(("safe", "apart"), [(4, False), (9, True)])
def test_a_comparison_without_a_safe_point_has_the_probabilities(safe, apart):
    """At the second of three speeds 4 or 9 of 10 samples of b are safe instead of 2 of a; all
    others whirl: at 3 points of both, as 1 of 10 is more than a quarter of 5 %."""
    data = []
    for number in (2, safe):
        response = np.full((1, 1, 3, 10), WHIRL)
        response[..., 1, :number] = 0
        data.append(made_up(response, attrs={"study_resolved": "{}"}))
    found = app_contrast(*data, confidence=0.95, names=["a.h5", "b.h5"])
    assert found["most_probable"]["apart"] == apart
    text = sentence(found, "si")
    assert text.startswith(
        "Neither b.h5 (b) nor a.h5 (a) makes any of 3 common points safe with a probability of 95 %; "
    )
    chance = "" if apart else ", which may be chance"
    assert f"5.7 to 51.0){chance}; whirl at all 3 points with both (each in 1.3 % of the samples or more)." in text
    assert f"; the most probable point {10 * safe}.0 % (" in text
    (told,) = [row[1:] for row in side_by_side(found, "si") if row[0] == "most probably safe"]
    assert told[0] == "2 rad/s (19.1 rpm): 20.0 % (5.7 to 51.0)"


# Ishigami and Homma (1990), a = 7, b = 0.1; exact indices from the variances of its
# parts.
A, B = 7.0, 0.1
PARTS = {"1": 0.5 * (1 + B * math.pi**4 / 5) ** 2, "2": A**2 / 8, "13": 8 * B**2 * math.pi**8 / 225}
VARIANCE = sum(PARTS.values())
FIRST = np.array([PARTS["1"], PARTS["2"], 0.0]) / VARIANCE
TOTAL = np.array([PARTS["1"] + PARTS["13"], PARTS["2"], PARTS["13"]]) / VARIANCE


def ishigami(x: Array) -> Array:
    return np.asarray(np.sin(x[:, 0]) + A * np.sin(x[:, 1]) ** 2 + B * x[:, 2] ** 4 * np.sin(x[:, 0]))[:, None]


def samples(count: int, design: str, seed: int = 1) -> Array:
    shapes = {name: {"uniform": [-math.pi, math.pi]} for name in "abc"}
    return np.column_stack([*draw(Uncertain(shapes, samples=count, seed=seed, design=design)).values()])


def test_saltelli_gives_the_indices_of_ishigami():
    x = samples(1 << 14, "saltelli")
    found = indices(x, ishigami(x), "saltelli")
    assert found.variance == pytest.approx(VARIANCE, rel=0.01)
    assert found.first == pytest.approx(FIRST, abs=0.01)
    assert found.total == pytest.approx(TOTAL, abs=0.01)


def test_saltelli_is_that_of_scipy():
    x = samples(256, "saltelli")
    y = ishigami(x)[:, 0]
    mine = indices(x, y[:, None], "saltelli")
    theirs = stats.sobol_indices(
        func={"f_A": y[:256][None], "f_B": y[256:512][None], "f_AB": y[512:].reshape(3, 1, 256)}, n=256
    )
    assert mine.first == pytest.approx(np.clip(theirs.first_order.ravel(), 0, 1), abs=1e-12)
    assert mine.total == pytest.approx(theirs.total_order.ravel(), abs=1e-12)


@pytest.mark.parametrize(("count", "within"), [(256, 0.05), (2048, 0.015)])
def test_samples_at_hand_give_the_first_order_indices(count, within):
    for seed in range(3):
        x = samples(count, "sobol", seed)
        found = indices(x, ishigami(x), "sobol")
        assert found.total is None
        assert found.first == pytest.approx(FIRST, abs=within)


def test_what_does_not_depend_on_an_unknown_has_no_index():
    rng = np.random.default_rng(3)
    x = samples(512, "sobol")
    found = indices(x, rng.normal(size=(512, 1)), "sobol")  # as of chaotic motion
    assert np.all(found.first < 0.04)


def test_yes_and_no_are_answers_too():
    # P(x0 < 0.3 and x1 < 0.5): the parts of the variance of the product of two
    # indicators are known.
    shapes = {name: {"uniform": [0.0, 1.0]} for name in "abc"}
    x = np.column_stack([*draw(Uncertain(shapes, samples=2048, design="saltelli")).values()])
    p, q = 0.3, 0.5
    variance = p * q - (p * q) ** 2
    first = np.array([q**2 * p * (1 - p), p**2 * q * (1 - q), 0.0]) / variance
    both = p * (1 - p) * q * (1 - q) / variance
    found = indices(x, ((x[:, 0] < p) & (x[:, 1] < q)).astype(float)[:, None], "saltelli")
    assert found.first == pytest.approx(first, abs=0.03)
    assert found.total == pytest.approx(first + np.array([both, both, 0.0]), abs=0.03)


def test_missing_answers_are_left_out_where_they_are_missing():
    rng = np.random.default_rng(5)
    for design, count in (("sobol", 1024), ("saltelli", 512)):
        x = samples(count, design)
        y = np.column_stack([ishigami(x), ishigami(x)])
        y[rng.choice(len(y), 40), 1] = np.nan
        found = indices(x, y, design)
        assert found.first == pytest.approx(FIRST, abs=0.06)


def test_standard_errors_tell_the_scatter():
    # Independent draws: the scatter over repetitions is what the bootstrap of one of
    # them says.
    rng = np.random.default_rng(11)
    tables = [rng.uniform(-math.pi, math.pi, (200, 3)) for _ in range(40)]
    found = [indices(x, ishigami(x), "sobol") for x in tables]
    firsts = np.array([one.first for one in found if one is not None])
    said = np.mean([one.first_error for one in found if one is not None], axis=0)
    assert said[:2] == pytest.approx(firsts.std(axis=0)[:2], rel=0.35)


def test_what_does_not_vary_has_no_indices():
    x = samples(64, "sobol")
    assert indices(x, np.ones((64, 1)), "sobol") is None
    assert indices(x, np.full((64, 1), np.nan), "sobol") is None


TRANSIENT = """
model: torsion
operation: {depth: 2000 m}
sweep: {wob: {from: 20 kN, to: 60 kN, points: 3}}
simulation: {transient: 10 s, observe: 60 s}
uncertain: {rotary_speed: {uniform: [2 rad/s, 4 rad/s]}, samples: 32}
"""


def test_a_file_gives_the_probabilities_of_the_results_and_says_that_they_may_be_those_of_a_transient(tmp_path):
    """A run that swings without sticking is not safe, whatever is read of a file."""
    path = tmp_path / "out.h5"
    data = nsdrill.run(TRANSIENT, path, progress=False)
    safe = nsdrill.probability(path).probability.sel(outcome="safe")
    np.testing.assert_array_equal(safe, nsdrill.probability(data).probability.sel(outcome="safe"))
    shown, told = nsdrill.show(path), nsdrill.sensitivity(path)
    assert f"{100 * safe.values[0]:.1f} % (" in shown.split("Probability")[1]
    assert told["answers"][0]["mean"] == pytest.approx(float(safe.mean()))
    free = (data.response == 0).mean("sample")
    assert float(safe.mean()) < float(free.mean())
    unsettled = int((data.settled == 0).sum())
    assert unsettled > 0
    assert told["unsettled"] == {"runs": unsettled, "of": 96}
    assert nsdrill.probability(path).unsettled_runs == unsettled
    assert f"NOT SETTLED: in {unsettled} of 96 runs" in shown


@pytest.mark.parametrize("narrow", [True, False])
@pytest.mark.parametrize("why", ["narrow", "above", "cut short", "no way in", "jump"])
def test_no_hint_of_samples_is_named_without_its_share(why, narrow):
    """However short the sentence is to be."""
    maps = find_window(with_samples([[0.0, 0.6, 0.6, 0.6, 0.0]] * (1 if narrow else 5)), None, 0.5)
    known, share = maps["answer"], Share(0.5, 0.254, 0.746, 0.5, 12, 0)
    jump = Jump("rotary_speed", 6.0, 7.0, 0.5, 0.1, "whirl")
    more = {
        "narrow": {},
        "above": {},
        "cut short": {"trials": Trials(is_cut_short=True)},
        "no way in": {"is_unreached": True},
        "jump": {"jump": jump, "tried_kind": None if narrow else Kind.FROM_BELOW},
    }[why]
    found = replace(known, kind=Kind.HINT, share=share, narrow=narrow, **more)
    over = [{**WALL, "from": 9.0}] if why == "above" else []
    sentence = words_of({**maps, "answer": found, "passed_over": over}, "field").sentence()
    assert "50 % (25 to 75)" in sentence
