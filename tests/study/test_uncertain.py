"""The section uncertain: distributions, samples, and what is refused."""

import itertools
import math

import numpy as np
import pytest
from scipy import stats

import nsdrill
from nsdrill.errors import StudyError
from nsdrill.models.registry import NAMES
from nsdrill.sampling import Uncertain, distribution, draw, quantile
from nsdrill.study.keys import keys_named
from nsdrill.study.load import parse_study
from nsdrill.study.write import changes, study_text

KEY = "bit.friction.static"
ROCK = "bit.rock_stiffness"

# Distributions with their mean, from textbooks.
MEANS = {
    "uniform": ({"uniform": [0.3, 0.6]}, 0.45),
    "triangular": ({"triangular": [0.1, 0.2, 0.9]}, 0.4),
    "normal": ({"normal": {"mean": 0.7, "deviation": 0.1}}, 0.7),
    "lognormal": ({"lognormal": {"median": 2.0, "factor": 1.5}}, 2.0 * math.exp(math.log(1.5) ** 2 / 2)),
    "values": ({"values": [1.0, 2.0, 6.0, 3.0]}, 3.0),
    # A normal cut off at its mean is a half-normal one.
    "cut": ({"normal": {"mean": 0.0, "deviation": 1.0, "low": 0.0}}, math.sqrt(2 / math.pi)),
}


@pytest.mark.parametrize("name", MEANS)
def test_samples_follow_their_distribution(name):
    numbers, mean = MEANS[name]
    drawn = draw(Uncertain({"a": numbers, "b": {"uniform": [0.0, 1.0]}}, samples=4096))
    assert np.mean(drawn["a"]) == pytest.approx(mean, rel=2e-3)
    assert abs(stats.spearmanr(drawn["a"], drawn["b"]).statistic) < 0.02


@pytest.mark.parametrize("name", ["uniform", "triangular", "normal", "lognormal"])
def test_each_part_of_the_distribution_has_its_share(name):
    numbers, _ = MEANS[name]
    drawn = draw(Uncertain({"a": numbers}, samples=1024))["a"]
    # 0.04 of independent draws
    assert stats.kstest(drawn, distribution(numbers).cdf).statistic < 2e-3


def test_factor_is_one_deviation_of_the_logarithm():
    numbers = {"lognormal": {"median": 25e6, "factor": 2.0}}
    low, middle, high = quantile(numbers, stats.norm.cdf([-1.0, 0.0, 1.0]))
    assert (low, middle, high) == pytest.approx((12.5e6, 25e6, 50e6))


def test_rank_correlation_is_the_one_asked_for():
    shapes = {"a": MEANS["lognormal"][0], "b": MEANS["triangular"][0], "c": MEANS["uniform"][0]}
    found = draw(Uncertain(shapes, samples=4096, correlations=(("a", "b", 0.6), ("c", "b", -0.5))))
    for one, two in itertools.combinations("abc", 2):
        wanted = {"ab": 0.6, "bc": -0.5, "ac": 0.0}[one + two]
        assert stats.spearmanr(found[one], found[two]).statistic == pytest.approx(wanted, abs=0.02)
    alone = draw(Uncertain(shapes, samples=4096))
    # its own distribution is as before
    assert np.mean(found["a"]) == pytest.approx(np.mean(alone["a"]), rel=0.01)


def test_saltelli_exchanges_one_column_at_a_time():
    shapes = {"a": MEANS["uniform"][0], "b": MEANS["uniform"][0]}
    found = draw(Uncertain(shapes, samples=8, design="saltelli"))
    a, b, first, second = (np.column_stack([found["a"], found["b"]])[8 * i : 8 * i + 8] for i in range(4))
    assert np.array_equal(first, np.column_stack([b[:, 0], a[:, 1]]))
    assert np.array_equal(second, np.column_stack([a[:, 0], b[:, 1]]))
    assert len(np.unique(a)) == 16


def study(section: str, sweep: str = "sweep: {wob: [10 kN, 20 kN]}") -> nsdrill.Study:
    return parse_study(f"{sweep}\nuncertain: {section}\n", "s.yaml")


FULL = """
  bit.rock_stiffness: {lognormal: {median: 25 MN/m, factor: 2}}
  bit.friction.static: {normal: {mean: 0.4, deviation: 0.05, low: 0.25}}
  drillstring.eccentricity: {triangular: [1 mm, 5 mm, 13 mm]}
  rotary_speed: {values: [60 rpm, 90 rpm]}
  correlations: [[bit.friction.static, bit.rock_stiffness, 0.5]]
  samples: 100
  seed: 7
"""


def test_same_study_gives_the_same_samples_and_another_seed_others():
    one, two, other = study(FULL), study(FULL), study(FULL.replace("seed: 7", "seed: 8"))
    assert one.samples == 100
    assert set(one.drawn) == {"rotary_speed", "drillstring.eccentricity", ROCK, KEY}
    for key, values in one.drawn.items():
        assert np.array_equal(values, two.drawn[key])
    assert not np.array_equal(one.drawn[ROCK], other.drawn[ROCK])
    assert one.sha256 != other.sha256
    assert {axis.key for axis in one.unknowns} == {"operation.rotary_speed", "drillstring.eccentricity", ROCK, KEY}


def test_table_is_taken_row_by_row():
    found = study("{table: {bit.friction.static: [0.3, 0.4, 0.35], bit.rock_stiffness: [10 MN/m, 30 MN/m, 20 MN/m]}}")
    assert found.samples == 3
    assert found.drawn[KEY].tolist() == [0.3, 0.4, 0.35]
    assert found.drawn[ROCK].tolist() == [10e6, 30e6, 20e6]


def test_joint_rows_may_overlap_where_each_row_is_in_order():
    rows = "{{table: {{bit.friction.static: [0.3, 0.4], bit.friction.dynamic: [0.25, {}]}}}}"
    assert study(rows.format(0.35)).samples == 2
    with pytest.raises(
        StudyError, match=r"line 2: uncertain\.table\.bit\.friction\.dynamic: found 0\.45 at the greatest"
    ):
        study(rows.format(0.45))


@pytest.mark.parametrize("factor", [1.1, 2])
def test_an_end_of_the_range_is_no_bound(factor):
    """Written or not, and whether or not a number tells it from none, the study is the same."""
    text = f"{{{ROCK}: {{lognormal: {{median: 25 MN/m, factor: {factor}%s}}}}}}"
    one, other = study(text % ""), study(text % ", low: 1 N/m")
    assert one.resolved == other.resolved == parse_study(study_text(one.resolved), "s.yaml").resolved
    assert "low" not in study_text(one.resolved).partition("uncertain:")[2].partition("samples")[0]


@pytest.mark.parametrize("model", NAMES)
def test_a_deviation_beyond_its_range_is_told_the_range(model):
    """Of every number of a study: it is at most as wide as the range of the number."""
    for key, leaf in keys_named(model).axes.items():
        if leaf.kind not in ("quantity", "number"):
            continue
        one, wide = (f"{number!r} {leaf.units.replace(' ', '*')}".strip() for number in (leaf.high, 1e300))
        text = f"uncertain: {{{key}: {{normal: {{mean: {one}, deviation: {wide}}}}}, samples: 4}}"
        with pytest.raises(StudyError, match=r"normal\.deviation: found .*; allowed: .*at least 0 .*and at most"):
            parse_study(f"model: {model}\n{text}\n", "s.yaml")


def test_differences_name_the_unknown():
    one, two = (study(FULL), study(FULL.replace("factor: 2", "factor: 3").replace("samples: 100", "samples: 64")))
    told = {key: (a, b) for key, a, b in changes(one.resolved, two.resolved)}
    assert told["uncertain.samples"] == ("100", "64")
    before, after = told[f"uncertain.{ROCK}"]
    assert "factor: 2}" in str(before), "the range of the key cuts off nothing"
    assert "factor: 3}" in str(after)
    assert len(told) == 2


SPELT = """\
sweep: {%rotary_speed: {from: 1 rad/s, to: 3 rad/s, points: 3}, procedure: up, along: %rotary_speed}
uncertain:
  %wob: {uniform: [20 kN, 30 kN]}
  bit.friction.static: {uniform: [0.3, 0.5]}
  samples: 4
  correlations: [[%wob, bit.friction.static, 0.5]]
"""
ROWS = "sweep: {rotary_speed: [1 rad/s, 2 rad/s]}\nuncertain: {table: {%wob: [20 kN, 30 kN]}}"
CURVES = "continue: {along: %rotary_speed, from: 2 rad/s, to: 4 rad/s, curves: {over: %wob, from: 20 kN, to: 30 kN}}"
SETS = [
    "%wob=30 kN",
    "sweep.%rotary_speed={from: 1 rad/s, to: 3 rad/s, points: 3}",
    "sweep.%rotary_speed.points=2",
    "uncertain={%depth: {uniform: [4 km, 5 km]}, samples: 4}",
    "uncertain.%depth.uniform=[3 km, 4 km]",
]


@pytest.mark.parametrize(("text", "sets"), [(SPELT, []), (ROWS, []), (CURVES, []), ("{}", SETS), (SPELT, SETS[2:3])])
def test_a_number_of_the_operation_has_one_key_in_two_spellings(text, sets):
    short, full = (
        parse_study(text.replace("%", head), "s.yaml", [one.replace("%", head) for one in sets])
        for head in ("", "operation.")
    )
    assert short.resolved == full.resolved
    assert {key: values.tolist() for key, values in short.drawn.items()} == {
        key: values.tolist() for key, values in full.drawn.items()
    }
    mixed = parse_study(text.replace("%", "operation."), "s.yaml", [s.replace("%", "") for s in sets])
    assert mixed.resolved == full.resolved


def test_a_number_of_the_operation_in_both_spellings_is_refused():
    text = "uncertain:\n  wob: {uniform: [1 kN, 2 kN]}\n  operation.wob: {uniform: [1 kN, 2 kN]}"
    with pytest.raises(StudyError, match=r"s.yaml, line 3: .*wob: found the key a second time"):
        parse_study(text, "s.yaml")
    for name in ("wob", "operation.wob"):  # both are taken, one is printed
        with pytest.raises(StudyError, match=r"line 2: uncertain.operation.wob.uniform\[0\]: found '1 mm'"):
            parse_study(f"uncertain:\n  {name}: {{uniform: [1 mm, 2 kN]}}", "s.yaml")


@pytest.mark.parametrize("name", ["wob", "operation.wob"])
def test_a_number_of_the_operation_is_written_in_one_spelling(name):
    study = parse_study(f"uncertain:\n  {name}: {{uniform: [1 kN, 2 kN]}}", "s.yaml")
    text = study_text(study.resolved)
    assert "\n  operation.wob: {uniform: [1 kN, 2 kN]}" in text
    assert parse_study(text).sha256 == study.sha256
    other = parse_study("uncertain:\n  wob: {uniform: [1 kN, 3 kN]}")
    assert changes(study.resolved, other.resolved) == [
        ("uncertain.operation.wob", "{uniform: [1 kN, 2 kN]}", "{uniform: [1 kN, 3 kN]}")
    ]


def test_overrides_reach_the_section():
    found = parse_study("{}", "s.yaml", [f"uncertain.{KEY}.uniform=[0.3, 0.4]", "uncertain.samples=16"])
    assert found.samples == 16
    assert 0.3 <= found.drawn[KEY].min() < found.drawn[KEY].max() <= 0.4
    by_dict = nsdrill.load_study({"uncertain": {KEY: {"uniform": [0.3, 0.4]}, "samples": 16}})
    assert np.array_equal(found.drawn[KEY], by_dict.drawn[KEY])


@pytest.mark.parametrize(
    ("section", "message"),
    [
        (
            "{bit.friction.static: {normal: {mean: 0.3, deviation: 0.3}}}",
            r"line 2: uncertain\.bit\.friction\.static\.normal: found a distribution of which 16 % lie below",
        ),
        ("{bit.friction.static: {uniform: [0.3, 20]}}", r"uniform\[1\]: found the number 20; allowed: .* at most 10"),
        ("{bit.friction.static: {uniform: [0.1, 0.6]}}", r"allowed: at least bit\.friction\.dynamic, which is 0\.2"),
        ("{bit.rock_stiffness: {uniform: [1, 2]}}", r"uniform\[0\]: found the number 1 without a unit"),
        ("{bit.rock_stifness: {uniform: [1 MN/m, 2 MN/m]}}", r"Did you mean bit\.rock_stiffness"),
        ("{bit.rock_stiffness: {unifrm: [1 MN/m, 2 MN/m]}}", r"Did you mean uncertain\.bit\.rock_stiffness\.uniform"),
        ("{bit.lobes: {values: [1, 3]}}", r"bit\.lobes, which is compiled in; .* Sweep it"),
        ("{bit.friction.law: {values: [linear]}}", r"bit\.friction\.law, which is a choice; .* Sweep it: sweep"),
        ("{wob: {uniform: [1 kN, 2 kN]}}", r"found wob, which the sweep varies"),
        ("{operation.wob: {uniform: [1 kN, 2 kN]}}", r"found wob, which the sweep varies"),
        ("{bit.friction.static: {uniform: [0.6, 0.3]}}", r"values that do not ascend"),
        ("{bit.friction.static: {uniform: [0.3, 0.6], values: [0.3]}}", r"found uniform and values; allowed: one of"),
        ("{bit.friction.static: {lognormal: {median: 0.3}}}", r"found nothing; allowed: all of median and factor"),
        ("{samples: 4}", r"found no unknown"),
        ("{bit.friction.static: {uniform: [0.3, 0.6]}, samples: 1}", r"samples: found the number 1"),
        ("{drive.a: {uniform: [0.3, 0.6]}}", r"found the uncertain drive\.a, which the drive ideal does not read"),
        ("{table: {bit.friction.static: [0.3, 0.4], bit.rock_stiffness: [1 MN/m]}}", r"as many values as of"),
        ("{table: {bit.friction.static: [0.3, 0.4]}, samples: 8}", r"found 8 beside a table of 2 rows"),
        (
            "{bit.friction.static: {uniform: [0.3, 0.6]}, correlations: [[bit.friction.static, wob, 0.5]]}",
            r"correlations\[0\]: found wob; allowed: keys with a distribution",
        ),
        (
            "{bit.friction.static: {uniform: [0.3, 0.6]}, correlations: [[bit.friction.static, 0.5]]}",
            r"correlations\[0\]: found a list; allowed: two keys",
        ),
        (
            "{bit.friction.static: {uniform: [0.3, 0.6]}, bit.rock_stiffness: {uniform: [1 MN/m, 2 MN/m]}, "
            "correlations: [[bit.friction.static, bit.rock_stiffness, 0.5]], design: saltelli}",
            r"saltelli with correl",
        ),
        (
            "{bit.friction.static: {uniform: [0.3, 0.6]}, samples: 100000, design: saltelli}\n"
            "record: {peaks: 0}\noperation: {wob: 3}",
            r"operation\.wob",
        ),
    ],
)
def test_what_is_wrong_is_told_with_line_key_and_what_is_allowed(section, message):
    with pytest.raises(StudyError, match=message):
        study(section)


def test_samples_beside_several_starts_are_refused():
    friction = "bit.friction.static: {uniform: [0.3, 0.6]}"
    with pytest.raises(
        StudyError, match=r"initial\.ensemble: found with .*uncertain\.initial\.x: each .*sweep\.initial\.x:"
    ):
        study(f"{{{friction}}}\ninitial: {{ensemble: 8}}")
    # what the sentence advises
    both = study(f"{{{friction}, initial.x: {{uniform: [-9 mm, 9 mm]}}, samples: 4}}")
    assert len(set(both.drawn["initial.x"].tolist())) == 4


def test_too_many_points_with_samples():
    with pytest.raises(StudyError, match="over all axes and samples"):
        study(
            "{bit.friction.static: {uniform: [0.3, 0.6]}, samples: 100000}",
            "sweep: {wob: {from: 1 kN, to: 90 kN, points: 2000}}",
        )
