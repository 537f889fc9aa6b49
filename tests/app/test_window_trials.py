"""Trials of a window as they are run: with the study of the file, by its thresholds, with the
same bits, and with what ended before an interrupt."""

import json
import math
import re
import time
from dataclasses import replace
from threading import Event

import numpy as np
import pytest
from interrupts import Interrupt

import nsdrill
from nsdrill.analysis.advice import First, WayIn
from nsdrill.analysis.confirmed import came_in
from nsdrill.analysis.trials import (
    HELD,
    HELD_IN_CORNER,
    OFF_ROCK,
    ON_WALL,
    SPEED_FIRST,
    TAGGED,
    TAGGED_IN_CORNER,
    TO_CORNER,
    WEIGHT_FIRST,
    Change,
    Effort,
    Outcome,
    Trial,
    Trials,
    Way,
    data_of,
)
from nsdrill.analysis.untried import Jump
from nsdrill.analysis.window import find_window
from nsdrill.app.answering import remedies, window_trials
from nsdrill.app.answering import trial_runs as runs
from nsdrill.app.answering.answers import plain_window, results_for_window
from nsdrill.app.check import lasting_motions
from nsdrill.app.experiment import prepare
from nsdrill.app.running.run import run_in_memory, run_study
from nsdrill.app.simulating.motions import Motions
from nsdrill.cli.main import main
from nsdrill.errors import Refusal
from nsdrill.interrupt import EXIT_CODE
from nsdrill.models.parts import values_at
from nsdrill.models.registry import checks_of
from nsdrill.study import parse_study
from nsdrill.study.load import default_study
from nsdrill.words import trial_words
from nsdrill.words.answer import warnings
from nsdrill.words.values import Formatter
from nsdrill.words.wording import is_short

pytestmark = pytest.mark.usefixtures("words_only")

RPM, KLBF = math.pi / 30, 4448.2216152605
# Free from 9.4 rad/s on: the example torsional_speed.
TORSION = """\
model: torsion
title: Torsion
operation: {depth: 5000 m, wob: 66.72 kN}
sweep: {rotary_speed: {from: 4 rad/s, to: 16 rad/s, points: 7}, procedure: up-down}
simulation: {transient: 60 s, observe: 30 s}
"""
# The assembly of the example rotary_assembly, at one weight and in few steps.
ROTARY = """\
title: Rotary assembly
units: field
drillstring:
  collar: {outer_diameter: 8 in, inner_diameter: 2.8125 in, length: 600 ft, span: 60 ft}
  pipe: {outer_diameter: 5 in, inner_diameter: 4.276 in}
  eccentricity: 2 mm
mud: {density: 10.5 ppg}
well: {diameter: 12.25 in}
bit: {lobes: 1, surface_amplitude: 1 mm}
operation: {depth: 9500 ft, wob: 25 klbf, rotary_speed: 100 rpm}
sweep: {rotary_speed: {from: 40 rpm, to: 140 rpm, points: 6}, procedure: up-down}
simulation: {transient: 60 s, observe: 60 s}
"""

# Free on the way up from 120 rpm on at 20 klbf; from rest it sticks there.
PDC = """\
title: PDC
units: field
drillstring:
  collar: {outer_diameter: 8 in, inner_diameter: 2.8125 in, length: 540 ft, span: 60 ft}
  pipe: {outer_diameter: 5 in, inner_diameter: 4.276 in}
  eccentricity: 3 mm
  torsional_damping: 27 N*m*s/rad
mud: {density: 10 ppg}
well: {diameter: 12.25 in}
bit: {lobes: 1, surface_amplitude: 0.05 mm}
drive: {kind: ideal}
operation: {depth: 9000 ft, wob: 20 klbf, rotary_speed: 145 rpm}
sweep: {rotary_speed: {from: 40 rpm, to: 165 rpm, points: 26}, procedure: up, along: rotary_speed}
simulation: {transient: 60 s, observe: 30 s}
"""

# One lobe of half a millimetre, with the bit in the middle of the hole.
LOBE = """\
title: Lobe
drillstring: {torsional_damping: 100 N*m*s/rad}
bit: {lobes: 1, surface_amplitude: 0.5 mm, rock_stiffness: 60 MN/m, friction: {static: 0.2, dynamic: 0.15}}
modes: {lateral: frozen}
operation: {depth: 1500 m, wob: 60 kN, rotary_speed: 100 rpm}
sweep: {rotary_speed: {from: 40 rpm, to: 240 rpm, points: 6}, procedure: up-down}
simulation: {transient: 60 s, observe: 60 s}
"""


def bench(text: str, *texts: str) -> runs.Bench:
    """The trials of the operating point of a study."""
    study = parse_study(text, "the test", list(texts))
    motions = Motions(prepare(study))
    point = {key: float(values[0]) for key, values in motions.plan.axes.items()}
    values = {**point, "rotary_speed": float(study.operation.rotary_speed)}
    return runs.Bench(motions, values, study.axes["rotary_speed"])


def all_of(one: runs.Bench, workers: int = 1) -> Trials:
    return one.all(Trials(), workers, runs.Told(lambda progress: None))


def outcomes(found: Trials) -> list[tuple[str, str]]:
    return [(one.name, str(one.outcome)) for one in found.trials]


@pytest.fixture(scope="module")
def torsion(tmp_path_factory):
    path = tmp_path_factory.mktemp("trials") / "torsion.h5"
    run_study(parse_study(TORSION), path, workers=1)
    return path


@pytest.fixture(scope="module")
def assembly():
    """At 25 klbf and 100 rpm, collars straight to 2 mm."""
    return all_of(bench(ROTARY))


def test_the_trials_of_an_assembly(assembly):
    """25 klbf and 100 rpm, 2 mm: speed first at 0.5 rpm/s and slower ends in whirl, 0 of 6 are
    free; faster some are, by how the bit meets the crest of its lobe. Weight first, 1.8 rpm/s is free
    after waits of 0 and 20 s and not after 61 s, so that too few rates are left. A knock lasts. The passing rate is
    0.9 rpm/s."""
    speed_first = [
        one for one in assembly.ways_in(SPEED_FIRST) if one.rate in runs.SPEED_RATES
    ]  # before others between
    assert [one.rate for one in speed_first] == pytest.approx([0.2 * RPM, RPM, 3 * RPM, 5 * RPM, 10 * RPM])
    assert [str(one.outcome) for one in speed_first] == ["vibrates", "vibrates", "free", "vibrates", "free"]
    assert speed_first[0].responses == ("whirl",)
    assert sum(one.outcome == Outcome.FREE for one in assembly.ways_in(WEIGHT_FIRST)) >= 2
    by_wait = {one.held: one.outcome for one in assembly.ways_in(WEIGHT_FIRST) if 1.7 < one.rate / RPM < 1.8}
    assert by_wait == {20.0: Outcome.FREE, 0.0: Outcome.FREE, 61.1: Outcome.VIBRATES}
    assert assembly.withdraws
    knocks = {one.name: (one, slowed) for one, slowed in assembly.knocks}
    assert list(knocks) == [HELD, OFF_ROCK, ON_WALL]
    assert knocks[ON_WALL][0].responses == ("whirl",)
    assert knocks[ON_WALL][1].after == ON_WALL


def test_the_way_that_is_ordered_has_trials_between_its_own_rates():
    """Soft torque in 8 1/2 in: the weight first is free at 1 and 10 rpm/s, the speed first at 5 and 10 rpm/s alone.
    Further ways of the weight first end at 4.6 rpm/s in whirl, so that the speed first, free up to the fastest rate,
    would be ordered at 5 to 10 rpm/s, where 5.6 to 6.4 rpm/s whirl: it has further trials before, and is not."""
    one = bench(TORSION)
    ended = [(WEIGHT_FIRST, rate, rate > 0.5) for rate in (0.2, 1.0, 10.0)]
    ended += [(SPEED_FIRST, rate, rate > 4.0) for rate in (0.2, 1.0, 3.0, 5.0, 10.0)]

    def trials() -> list[Trial]:
        return [
            Trial(name, Way.IN, Outcome.FREE if is_free else Outcome.VIBRATES, rate=rate * RPM)
            for name, rate, is_free in ended
        ]

    seen = []
    while more := one.more_ways_in(trials()):  # before they are repeated
        seen.append({plan.name for plan in more})
        rates = [plan.rate / RPM for plan in more]
        assert len(rates) == runs.MORE
        tongue = (4.5, 5.0) if WEIGHT_FIRST in seen[-1] else (5.6, 6.4)
        ended += [(more[0].name, rate, not tongue[0] < rate < tongue[1]) for rate in rates]
    assert seen == [{WEIGHT_FIRST}, {SPEED_FIRST}]
    way = came_in(None, Trials(tuple(trials())))
    assert way.first == First.WEIGHT
    assert way.rate == pytest.approx(10 ** (1 / 9) * RPM), "not the one beside 0.2 rpm/s"
    assert way.most < 4.5 * RPM
    assert not Trials(tuple(trials())).withdraws


def test_what_is_recommended_is_tried_in_several_manners():
    """The weight first at 1 to 1.3 rpm/s whirls after long waits alone. Every rate that is left has been run in all
    manners; that beside the rates that whirl is ordered no more."""
    one = bench(TORSION)
    ran: list[Trial] = []

    def end(plan: runs.Plan) -> Trial:
        slow = plan.name == WEIGHT_FIRST and plan.rate < 1.4 * RPM and plan.held > 60.0
        whirls = plan.rate < 0.9 * RPM or plan.name == SPEED_FIRST or slow
        outcome = Outcome.VIBRATES if whirls else Outcome.FREE
        return Trial(plan.name, Way.IN, outcome, rate=plan.rate, held=plan.held, set_in=plan.set_in)

    more = one.ways_in()
    while more:
        ran += map(end, more)
        more = one.further(ran)
    assert len(ran) < 75
    way = came_in(None, Trials(tuple(ran)))
    assert way.first == First.WEIGHT
    tried = sorted({trial.rate for trial in ran if trial.name == WEIGHT_FIRST})
    assert way.rate == min(rate for rate in tried if rate > 1.4 * RPM * 1.2)
    assert way.most == tried[-1]
    ordered = [rate for rate in tried if way.rate <= rate]
    assert len(ordered) > 5
    for rate in ordered:
        same = [trial for trial in ran if trial.name == WEIGHT_FIRST and trial.rate == rate]
        assert len({(trial.set_in, trial.held) for trial in same}) == len(same) == 8
    assert {trial.set_in for trial in ran} == set(runs.SET_DOWN)
    assert (min(one.held for one in ran), max(one.held for one in ran)) == runs.WAITS


@pytest.mark.parametrize("name", [WEIGHT_FIRST, SPEED_FIRST])
def test_a_way_in_begins_off_bottom_sets_the_weight_and_waits(name):
    one = bench(TORSION)
    plan = one._way_in(name, RPM, (5.0, 61.1))
    (_, off), (begin, weight), (down, on) = plan.knots["wob"]
    (_, low), (up, still), (top, speed) = plan.knots["rotary_speed"]
    assert (off, weight, on) == (0.0, 0.0, one.point.wob)
    assert (low, still, speed) == (one.first, one.first, one.point.rotary_speed)
    assert down - begin == pytest.approx(5.0)
    assert (top - up) * RPM == pytest.approx(speed - low)
    assert (up - down if name == WEIGHT_FIRST else begin - top) == pytest.approx(61.1)


def test_an_order_of_which_few_further_ways_are_free_is_not_taken():
    """Two of five are not half, and two of them alone show nothing of what lies between."""
    for free in ((5.0, 10.0), (0.2, 1.0), (3.0,)):
        tried = tuple(
            Trial(SPEED_FIRST, Way.IN, Outcome.FREE if rate in free else Outcome.VIBRATES, rate=rate * RPM)
            for rate in (0.2, 1.0, 3.0, 5.0, 10.0)
        )
        assert Trials(tried).withdraws
        assert came_in(None, Trials(tried)) is None


def test_a_bent_collar_withdraws():
    """For 12.7 mm the passing rate is 35 rpm/s: none of the ways in ends free."""
    found = all_of(bench(ROTARY, "drillstring.eccentricity=12.7 mm"))
    assert len(found.ways_in()) == 8
    assert {one.outcome for one in found.ways_in()} == {Outcome.VIBRATES}
    assert found.withdraws
    assert all(one.way == Way.IN for one in found.trials), "what is not free is not disturbed"


def heights(one: runs.Bench, plan: runs.Plan, first: float, last: float) -> np.ndarray:
    """The heights of the bit [m] from ``first`` to ``last`` [s] of a ``plan``."""
    seen, samples = [], int(100 * last)
    run = runs.run_schedule

    def watched(along, schedule, duration, state, *rest):
        seen.append(run(along, schedule, last, state, samples, 0.01))
        return run(along, schedule, duration, state, *rest)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(runs, "run_schedule", watched)
        one.run(plan, Event())
    motion = seen[0]
    place = one.motions.states(one.study).index("z")
    return motion.states[motion.time >= first, place]


@pytest.mark.parametrize("texts", [(), ("model=beam",)])
def test_a_bit_off_bottom_is_clear_of_the_lobes(texts):
    """A roller cone with three lobes of 1 mm: as the speed is raised off bottom, and after a pick up, no crest
    reaches the bit."""
    cone = bench(ROTARY, "bit.lobes=3", "bit.friction.static=0.3", "bit.friction.dynamic=0.15", *texts)
    plan = cone.ways_in()[len(runs.WEIGHT_RATES) + 3]
    assert plan.name == SPEED_FIRST
    down = plan.knots["wob"][1][0]
    assert heights(cone, plan, 0.0, down).min() > 1e-3
    tag = next(one for one in cone.disturbances(cone.motions.start(cone.study)) if one.name == TAGGED)
    assert heights(cone, tag, 1.5 * runs.PAUSE, 2 * runs.PAUSE).min() > 1e-3
    assert cone.run(plan, Event())[0].outcome != Outcome.UNKNOWN


def test_the_rates_that_are_ordered_are_tried_and_from_several_speeds():
    """Where a rise begins decides in which phase the bit comes to the wall, and to the stop."""
    way = WayIn(wall=(60 * RPM, 68 * RPM), crosses=True, rate=2.1 * RPM, swing_rate=4.6 * RPM)
    one = replace(bench(ROTARY), advised=way)
    rates = [plan.rate / RPM for plan in one.ways_in() if plan.name == SPEED_FIRST]
    assert rates == pytest.approx([0.2, 1.0, 2.1, 3.0, 4.6, 5.0, 10.0])
    ran, more = [], one.ways_in()
    while more:
        ran += [
            Trial(plan.name, Way.IN, Outcome.FREE, rate=plan.rate, held=plan.held, set_in=plan.set_in, begun=plan.begun)
            for plan in more
        ]
        more = one.further(ran)
    found = came_in(way, Trials(tuple(ran)))
    assert (found.rate, found.most) == (way.rate, way.swing_rate)
    for rate in (way.rate, way.swing_rate):
        same = [trial for trial in ran if trial.name == SPEED_FIRST and trial.rate == rate]
        assert len({trial.begun for trial in same}) >= 6


def test_without_lobes_nothing_is_lifted():
    """Off bottom is no weight, as before, in strings with even rock, and in one whose bit does not move up and
    down."""
    for texts in (["bit.surface_amplitude=0 mm"], ["modes.axial=frozen"]):
        assert bench(ROTARY, *texts).off_bottom == 0.0
    assert bench(TORSION).hanging == 0.0


def test_a_torque_that_stays_off_bottom_is_told():
    """Friction given as torques acts without weight, too: the trials say so."""
    texts = ["bit.friction={static: 9 kN*m, dynamic: 6 kN*m}"]
    one = bench(TORSION, "operation.rotary_speed=12 rad/s", *texts)
    assert one.hanging is None
    found = all_of(one)
    assert not found.is_clear
    assert any(text.startswith("OFF BOTTOM THE BIT MAY STILL RUB") for text in trial_words.warnings(found))
    assert not any("OFF BOTTOM" in text for text in trial_words.warnings(replace(found, is_clear=True)))


def test_verdicts_follow_the_thresholds_of_the_study(assembly):
    """The same motions, with contact for up to all the time allowed: no whirl is left."""
    loose = all_of(bench(ROTARY, "classify.whirl.wall_contact_fraction=1"))
    assert all("whirl" not in one.responses for one in loose.trials)
    slowest = loose.ways_in(SPEED_FIRST)[0]
    assert slowest.outcome == Outcome.FREE
    assert assembly.ways_in(SPEED_FIRST)[0].outcome == Outcome.VIBRATES


def test_severity_in_verdicts():
    found = {"status": 1, "response": 4, "whirl_severity": 2, "bounce_severity": 0, "stick_slip_severity": 0}
    columns = {name: np.array(value) for name, value in found.items()}
    assert runs.verdict(columns, None)[:2] == (Outcome.VIBRATES, ("whirl",))
    assert runs.verdict(columns, 1)[0] == Outcome.VIBRATES
    assert runs.verdict(columns, 2)[:2] == (Outcome.FREE, ())
    assert runs.verdict({**columns, "response": np.array(8)}, 4)[0] == Outcome.STALLED
    assert runs.verdict({**columns, "status": np.array(2)}, 4)[0] == Outcome.UNKNOWN


def test_trials_by_other_code_than_the_file_say_so(torsion, monkeypatch):
    """The files of a model may have changed since the file was run: what its digest says."""
    monkeypatch.setattr(runs.Bench, "all", lambda bench, found, workers, told: found)
    results = results_for_window(torsion)
    summary = find_window(results)
    same = window_trials.tried(summary, results, str(torsion), workers=1)
    assert not any(text.startswith("TRIALS BY ANOTHER VERSION") for text in warnings(same, "si"))
    other = replace(results, attrs={**results.attrs, "model_digest": "0123456789abcdef"})
    found = window_trials.tried(summary, other, str(torsion), workers=1)
    first = next(warnings(found, "si"))
    assert first.startswith("TRIALS BY ANOTHER VERSION than the runs: model digest 0123456789abcdef there, ")
    assert plain_window(found, "si")["answer"]["trials_differing"][0].startswith("model digest 0123456789abcdef")


def test_a_trial_that_fails_is_unknown(torsion, monkeypatch):
    """All trials reach their limit of steps: nothing is known, so nothing is recommended."""
    monkeypatch.setattr(runs, "MAX_STEPS", 50)
    results = results_for_window(torsion)
    found = window_trials.tried(find_window(results), results, str(torsion), workers=1)["answer"]
    assert {one.outcome for one in found.trials.trials} == {Outcome.UNKNOWN}
    assert all(one.why for one in found.trials.trials)
    assert found.kind == "hint"


def test_the_same_bits_whatever_the_workers(torsion):
    results = results_for_window(torsion)
    summary = find_window(results)
    plans = {}
    for workers in (1, 2):
        answer = window_trials.tried(summary, results, str(torsion), workers=workers)["answer"]
        plans[workers] = answer.trials
    assert plans[1] == plans[2]
    one = bench(TORSION, "operation.rotary_speed=12 rad/s")
    plan = one.ways_in()[0]
    first, second = (one.run(plan, Event())[1] for _ in range(2))
    assert first.tobytes() == second.tobytes()


def test_only_the_bit_is_held_where_no_collar_moves(torsion):
    found = nsdrill.window(str(torsion), trials=True)["answer"]
    assert [one["name"] for one in found["trials"] if one["way"] == "knock"] == ["the bit held and let go"]
    frozen = bench(ROTARY, "modes.lateral=frozen")
    assert [name for name, _ in frozen.knocks(frozen.motions.start(frozen.study))] == [HELD, OFF_ROCK]
    lateral = bench(ROTARY, "modes.torsional=frozen", "modes.axial=frozen")
    assert [name for name, _ in lateral.knocks(lateral.motions.start(lateral.study))] == [ON_WALL]


def test_interrupted_it_has_what_ended(torsion):
    results = results_for_window(torsion)
    answer = window_trials.tried(find_window(results), results, str(torsion), workers=1, watch=Interrupt(3))["answer"]
    found = answer.trials
    assert found.interrupted
    ended = [one for one in found.trials if one.outcome != Outcome.UNKNOWN]
    assert 0 < len(ended) < len(found.trials)
    assert {one.why for one in found.trials if one.outcome == Outcome.UNKNOWN} == {"interrupted"}
    assert answer.kind == "hint", "what is missing may withdraw it"
    told = plain_window({**find_window(results), "answer": answer}, "si")["answer"]
    assert (told["trials_interrupted"], told["trials_cut_short"]) == (True, True)
    assert any(text.startswith("TRIALS INTERRUPTED") for text in told["warnings"])


def test_where_changes_alone_are_interrupted_the_answer_is_that_of_all_trials(torsion, monkeypatch):
    """A hint that complete trials leave is not a setting where the table of changes is cut short."""
    monkeypatch.setattr(remedies, "SPEEDS", 3)
    bad = iter("free" if number in (6, 7) else "vibrates" for number in range(8))  # the speed first, at 5 and 10 rpm/s

    def verdict(found, severity, critical):
        return Outcome(next(bad, "vibrates")), ("stick_slip",), ""

    def interrupted(changed, told, workers):
        raise KeyboardInterrupt
        yield

    monkeypatch.setattr(runs, "verdict", verdict)
    monkeypatch.setattr(window_trials, "changed_all", interrupted)
    results = results_for_window(torsion)
    answer = window_trials.tried(find_window(results), results, str(torsion), workers=1)["answer"]
    assert answer.trials.interrupted
    assert not answer.trials.is_cut_short
    assert sum(one.outcome == Outcome.FREE for one in answer.trials.ways_in()) == 2
    assert answer.kind == "hint"


def test_the_price_is_told_before(torsion):
    seen = []
    results = results_for_window(torsion)
    window_trials.tried(find_window(results), results, str(torsion), workers=1, watch=seen.append)
    priced = next(number for number, one in enumerate(seen) if one.price)
    price = seen[priced].price
    assert price.startswith("137 trials, about "), "with eight further ways in, and all in other manners"
    assert "; where they withdraw the setting 3 changes, about " in price
    assert price.endswith(" more, on this machine as it is loaded now")
    assert seen[priced].done == 2


def test_the_time_of_changes_is_told_again_as_it_was_measured(monkeypatch):
    """Ways up that took three times as long as foreseen: so do the trials of those that help, and those that follow as
    long as the first did. On a machine that leaves a thread less than its time, threads gain nothing."""
    now, used = [100.0], [0.0]
    monkeypatch.setattr(runs.time, "monotonic", lambda: now[0])
    monkeypatch.setattr(runs.time, "process_time", lambda: used[0])
    one = bench(TORSION)
    changed = remedies.Changed(one.motions, one.values, one.speeds)

    def rate(changed):
        now[0], used[0] = now[0] + 10.0, used[0] + share * 10.0
        return 1e-3

    monkeypatch.setattr(remedies.Changed, "rate", rate)
    foreseen = {}
    for share in (1.0, 0.3):
        told = runs.Told(lambda progress: None, 2)
        told.foresee(changed, is_sure=True, is_first=True)
        foreseen[share] = told.of_ways_up
        assert told.price.startswith("3 changes, about ")
        assert told.price.endswith("on this machine as it is loaded now")
    assert foreseen[0.3] == pytest.approx(2.0 * foreseen[1.0], rel=0.6)
    assert foreseen[0.3] > foreseen[1.0]
    before = told.of_one
    told.begin()
    now[0] += 3.0 * told.of_ways_up
    told.ran_changes(2)
    assert told.price == f"trials of 2 changes at most, about {6.0 * before:.0f} s more, as measured"
    told.begin()
    now[0] += 40.0
    told.ran_one(1)
    assert told.price == "trials of 1 change at most, about 40 s more, as measured"


def test_the_command(torsion, monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["nsdrill", "window", str(torsion), "--trials", "--json"])
    with pytest.raises(SystemExit) as end:
        main()
    out, err = capsys.readouterr()
    assert end.value.code == 0
    found = json.loads(out)["answer"]
    assert found == json.loads(json.dumps(nsdrill.window(str(torsion), trials=True)["answer"]))
    assert {one["outcome"] for one in found["trials"] if one["way"] == "in"} == {"free"}
    assert "137 trials, about" in err


def test_an_interrupted_command_answers(torsion, monkeypatch, capsys):
    def interrupted(*args, **more):
        raise KeyboardInterrupt

    monkeypatch.setattr(runs.Bench, "disturbances", interrupted)
    monkeypatch.setattr("sys.argv", ["nsdrill", "window", str(torsion), "--trials", "--all"])
    with pytest.raises(SystemExit) as end:
        main()
    out, err = capsys.readouterr()
    assert end.value.code == EXIT_CODE
    assert "TRIALS INTERRUPTED after 2 trials" in " ".join(out.split())
    assert "the answer has the trials that ended" in err


def test_trials_are_of_one_file(torsion):
    with pytest.raises(Refusal, match="two files"):
        nsdrill.window(str(torsion), str(torsion), trials=True)


def test_what_would_help_a_bent_collar(tmp_path, monkeypatch):
    """7 to 11 klbf and 12.7 mm, without lobes: soft torque and larger collars leave no room, stabilisers closer
    together and a straight collar do. At 15 klbf the way up begins at 160 rpm, which leaves no room below 195 rpm,
    where a bit that is held starts whirl. Over lobes of 1 mm neither keeps room at 18 to 22 klbf: both are free on the
    way up, but in the corners, 2 klbf and some rpm away, the bit bounces on after a tag."""
    monkeypatch.setattr(remedies, "SPEEDS", 19)
    bent = ["drillstring.eccentricity=12.7 mm", "operation.wob=9 klbf", "bit.surface_amplitude=0 mm"]
    bent += ["drillstring.torsional_damping=20 N*m*s/rad", "sweep.rotary_speed={from: 40 rpm, to: 220 rpm, points: 7}"]
    study = parse_study(ROTARY, "the test", [*bent, "simulation.transient=30 s", "simulation.observe=30 s"])
    run_study(study, tmp_path / "bent.h5", workers=1)
    found = nsdrill.window(str(tmp_path / "bent.h5"), trials=True)["answer"]
    assert found["kind"] == "nothing"
    assert found["trials"] == []
    by_name = {f"{one['key']}={one['set']}": one for one in found["changes"]}
    assert by_name["="]["free"] == []
    assert by_name["drive.kind=soft_torque"]["room"] == 0.0
    assert by_name["drillstring.collar.outer_diameter=9.5 in"]["free"] == []
    assert by_name["drillstring.collar.span=30 ft"]["room"] > 1
    assert by_name["drillstring.eccentricity=2 mm"]["room"] > 1
    assert found["changes_at"]["wob"] == pytest.approx(9 * KLBF)
    assert "Stabilisers 30 ft apart may free" in found["sentence"]
    assert "(nothing with damping 0.02)" in found["sentence"]
    assert {one["name"] for one in by_name["drillstring.collar.span=30 ft"]["trials"]} >= {HELD, OFF_ROCK, ON_WALL}
    assert len(found["sentence"].split()) <= 30


@pytest.mark.parametrize(
    ("span", "closer", "units"),
    [
        ("90 ft", {"60 ft": False, "45 ft": True}, "field"),
        ("65 ft", {"45 ft": True, "30 ft": False}, "field"),
        ("60 ft", {"45 ft": True, "30 ft": False}, "field"),
        ("45 ft", {"30 ft": False, "15 ft": True}, "field"),
        ("30 ft", {"15 ft": True}, "field"),
        ("20 ft", {"15 ft": True}, "field"),
        ("19 m", {"45 ft": True, "30 ft": False}, "field"),
        ("15 ft", {}, "field"),
        ("19.8 m", {"12.5 m": True, "9.5 m": False}, "si"),
        ("28.5 m", {"19 m": False, "12.5 m": True}, "si"),
        ("9.5 m", {"3 m": True}, "si"),
        ("65 ft", {"12.5 m": True, "9.5 m": False}, "si"),
        ("3 m", {}, "si"),
    ],
)
def test_stabilisers_stand_where_joints_of_collars_end(span, closer, units):
    """Collars come in joints of 30 ft, or 9.5 m: 34 or 22 ft no rig can make up; 15 and 45 ft, or 12.5 m, it can with a
    pony collar, which takes more than whole joints do."""
    one = bench(ROTARY.replace("units: field", f"units: {units}"), f"drillstring.collar.span={span}")
    found = [each for each in remedies.Changed(one.motions, one.values, one.speeds).all() if each.key == remedies.SPAN]
    assert {each.value: "pony" in each.words for each in found} == closer
    assert all(each.words.startswith(f"stabilisers {each.value} apart") for each in found)
    assert {each.value: each.effort > Effort.TRIP for each in found} == closer
    assert {each.effort.words for each in found} <= {"at the next trip"}


def test_what_a_change_allows_lies_above_the_end_of_stick_slip_at_each_weight():
    """A PDC bit, stiff drive: the way up is free where a step shakes stick-slip off, but by the model it may last to
    108, 120 and 130 rpm at 14, 16 and 18 klbf. At 16 klbf the way up begins at 122.5 rpm; held to 2 klbf, at 135."""
    texts = ["drive.kind=stiff", "operation.depth=10000 ft", "drillstring.torsional_damping=11 ft*lbf*s/rad"]
    texts += ["bit.surface_amplitude=0 mm", "bit.friction={static: 0.6, dynamic: 0.4}"]
    one = bench(PDC, *texts, "sweep.rotary_speed={from: 60 rpm, to: 210 rpm, points: 31}")
    changed = remedies.Changed(one.motions, {**one.values, "wob": 16 * KLBF}, one.speeds)
    span = next(each for each in changed.all() if each.value == "30 ft")
    wobs = [14 * KLBF, 16 * KLBF, 18 * KLBF]
    ran = changed.at_weights(span, wobs)
    study = changed.study_of(span, wobs)
    settings = ({**vars(study.operation), "wob": wob, "rotary_speed": 60 * RPM} for wob in wobs)
    at = [values_at(study.parameters, study.initial, one) for one in settings]
    folds = checks_of(study.model).stick_slip_folds(at)
    print([f / RPM for f in folds], [(a.free[0][0] / RPM, a.free[0][1] / RPM) for a in ran])
    assert 80 * RPM < folds[0] < folds[1] < folds[2]
    for fold, here in zip(folds, ran, strict=True):
        assert here.has_room
        assert here.free[0][0] > fold
    assert ran[2].free[0][0] > ran[1].free[0][0]
    held = changed.held_in_weight(ran[1])
    assert held.weights == (pytest.approx(14 * KLBF), pytest.approx(18 * KLBF))
    assert held.widest[0] > folds[2]


def test_changes_that_are_there_already_or_not_read_are_not_run():
    soft = bench(ROTARY, "drive.kind=soft_torque", "bit.surface_amplitude=0 mm", "modes.lateral=frozen")
    keys = [one.key for one in remedies.Changed(soft.motions, soft.values, soft.speeds).all()]
    assert not {"drive.kind", "bit.surface_amplitude"} & set(keys)
    assert "operation.wob" in keys
    assert bench(TORSION).motions.study.model.name == "torsion"
    torsion = bench(TORSION)
    assert "drillstring.collar.span" not in [
        one.key for one in remedies.Changed(torsion.motions, torsion.values, torsion.speeds).all()
    ]


def test_the_price_of_changes_is_that_of_their_runs(monkeypatch):
    """Of 25 speeds, each held as long as in the file, at the cost of a second of the string as it is, vibrations
    included: a trial costs three fifths of that, as fewer do. It is told before the first of them."""
    long = bench(TORSION, "simulation.transient=300 s", "simulation.observe=60 s")
    changed = remedies.Changed(long.motions, long.values, long.speeds)
    assert [changed.seconds(one) for one in changed.all()] == [25 * 360.0] * 3
    monkeypatch.setattr(remedies.Changed, "rate", lambda changed: 0.01)
    of_changes = 0.01 * (3 * 25 * 360 + runs.TRIED * runs.OF_TRIED * runs.FREE_COST)
    for is_first, told_before in ((True, True), (False, False)):
        told = runs.Told(lambda progress: None)
        told.foresee(changed, is_sure=True, is_first=is_first)
        assert bool(told.price) == told_before
        told.began = time.monotonic() - 10.0
        told.timed(20, 100.0, 1000.0)
        seconds = [float(one) for one in re.findall(r"about (\d+) s", told.price)]
        assert told.price.startswith("3 changes, about " if is_first else "20 trials, about ")
        whole = of_changes if is_first else of_changes + 100.0
        assert sum(seconds) == pytest.approx(whole, rel=0.02)


def test_the_cost_of_a_second_counts_vibrations():
    """Bent collars roll along the wall over most of the speeds: a second of that takes several times the steps
    of steady drilling, of which quick trials alone told."""
    costs = []
    for texts in (("drillstring.eccentricity=12.7 mm",), ("modes.lateral=frozen", "operation.wob=1 klbf")):
        one = bench(ROTARY, "bit.surface_amplitude=0 mm", *texts)
        costs.append(remedies.Changed(one.motions, {**one.values, "wob": 20 * KLBF}, one.speeds).rate())
    assert costs[0] > 2.0 * costs[1] > 0.0


def test_steps_of_changes_do_not_jump_across_the_wall():
    """Every change is as fine as the file must be where the collar reaches the wall; 25 speeds over 40 to 200 rpm are
    6.7 rpm apart. What a change may still jump across is told."""
    coarse = replace(bench(ROTARY, "bit.surface_amplitude=0 mm", "operation.wob=6 klbf"))
    changed = remedies.Changed(coarse.motions, coarse.values, np.array([40.0, 200.0]) * RPM)
    study = changed.study_of(remedies.AS_IT_IS)
    speeds = study.axes["rotary_speed"]
    assert len(speeds) > remedies.SPEEDS
    assert not any(one["jumped"] for one in lasting_motions(study))
    fixed = replace(study, axes={**study.axes, "rotary_speed": np.linspace(speeds[0], speeds[-1], remedies.SPEEDS)})
    jumped = next(one["jumped"] for one in lasting_motions(fixed) if one["jumped"])
    jump = Jump("rotary_speed", jumped["from"], jumped["to"], jumped["enough"], jumped["step"], "whirl")
    free = replace(remedies.AS_IT_IS, free=((speeds[0], speeds[-1]),), room=2.0, jump=jump)
    row = list(trial_words.lines(Trials(changes=(free,)), "rotary_speed", trial_words.Formatter("field")))[1]
    assert "; steps of 6.7 rpm may jump across whirl at " in row


def test_the_string_as_it_is_is_run_as_the_changes_are(tmp_path, monkeypatch):
    """The map allows nothing at any of its speeds. Changes are run in other steps, and so is the string as it is: the
    row of the map stands beside it, and of all that is told before every one is run."""
    monkeypatch.setattr(remedies, "SPEEDS", 3)
    monkeypatch.setattr(window_trials, "SPEEDS", 3)
    study = parse_study(TORSION, "the test", ["sweep.rotary_speed={from: 4 rad/s, to: 9 rad/s, points: 6}"])
    run_study(study, tmp_path / "out.h5", workers=1)
    seen, told = [], []
    ran = remedies.Changed._run_at

    def run_at(changed, one, wobs):
        seen.append((one.name, changed.study_of(one, wobs)))
        return ran(changed, one, wobs)

    monkeypatch.setattr(remedies.Changed, "_run_at", run_at)
    results = results_for_window(tmp_path / "out.h5")
    path = str(tmp_path / "out.h5")
    found = window_trials.tried(find_window(results), results, path, workers=1, watch=told.append)["answer"]
    assert found.kind == "nothing"
    assert [one.name for one in found.trials.changes] == [name for name, _ in seen[:3]] == ["none", "drive", "weight"]
    for _, one in seen[:3]:
        assert (list(one.axes["rotary_speed"]), one.procedure) == ([4.0, 6.5, 9.0], "up")
    prices = [one.price for one in told if one.note == "changes"]
    assert prices[0].startswith("3 changes, about ")
    assert {one.total for one in told if one.note == "changes"} == {3}
    by_map, as_run = found.trials.by_map, found.trials.as_it_is
    assert (by_map.free, by_map.room, as_run.wob) == ((), 0.0, by_map.wob)
    assert found.trials.steps == pytest.approx((2.5, 1.0))
    assert found.trials.best is None or found.trials.best.key, "where the map has the way up, another shows no setting"
    data = data_of(found.trials, "rotary_speed")
    assert (data["changes"][0]["name"], data["as_it_is_by_map"]["free"]) == ("none", [])
    assert len(data["changes"]) == 3


def test_changes_keep_to_where_one_drills():
    """The way up of a change begins where the sweep does; what it frees outside does not help, nor
    does a weight below those that are drilled with."""
    one = bench(TORSION)
    within = {"rotary_speed": (9.0, 12.0), "wob": (60e3, 80e3)}
    free = remedies.Changed(one.motions, one.values, one.speeds)
    drilled = replace(free, within=within)
    assert "operation.wob" in [change.key for change in free.all()]
    assert "operation.wob" not in [change.key for change in drilled.all()]
    wide, narrow = (changed.run(changed.all()[0]) for changed in (free, drilled))
    assert wide.widest[1] > 13.0
    assert narrow.widest[0] >= 9.0
    assert narrow.widest[1] <= 12.0
    assert narrow.room < wide.room
    assert 9.0 <= narrow.speed <= 12.0


def test_what_a_change_allows_has_no_corner_that_vibrated():
    """Both ends vibrate at the greatest weight, and the first at the least: that weight goes, and 5 rpm."""
    ends = (90 * RPM, 150 * RPM)

    def corner(rpm: float, klbf: float, outcome: Outcome) -> Trial:
        return Trial(TO_CORNER, Way.CORNER, outcome, ("whirl",), speed=rpm * RPM, wob=klbf * KLBF)

    trials_ = [corner(rpm, 22, Outcome.VIBRATES) for rpm in (90, 150)]
    trials_ += [corner(90, 18, Outcome.VIBRATES), corner(150, 18, Outcome.FREE)]
    change = replace(
        remedies.AS_IT_IS, free=(ends,), widest=ends, room=2.5, speed=120 * RPM, weights=(18 * KLBF, 22 * KLBF)
    )
    less = window_trials._less(replace(change, trials=tuple(trials_)), 20 * KLBF)
    assert less.widest == (pytest.approx(95 * RPM), 150 * RPM)
    assert less.weights == (18 * KLBF, 20 * KLBF)
    assert less.room == pytest.approx(25 / 12)
    assert less.bad == [], "what lies outside disturbs no more"
    assert window_trials._less(less, 20 * KLBF) is less
    away = Trial("10 % slower and back", Way.EXCURSION, Outcome.VIBRATES, ("whirl",), there=108 * RPM)
    cut = window_trials._less(replace(change, trials=(away,)), 20 * KLBF)
    assert cut.widest == (pytest.approx(113 * RPM), 150 * RPM)
    assert not cut.has_room


class Faked:
    """In place of the trials of a setting: what vibrates, by the speed [rpm] of each trial, and at which speeds a
    setting was tried. ``vibrates`` tells it by the name of the trial and that speed."""

    def __init__(self, monkeypatch, vibrates):
        self.vibrates, self.settings = vibrates, []
        same = lambda changed, change, wobs: [replace(change, wob=wob) for wob in wobs]  # noqa: E731
        monkeypatch.setattr(remedies.Changed, "at_weights", same)
        monkeypatch.setattr(runs.Bench, "all", lambda one, found, workers, told: self.all(one, found))
        monkeypatch.setattr(runs.Bench, "of_corners", lambda one, found, workers, told: self.corners(one, found))

    def trial(self, name: str, way: Way, rpm: float, **more) -> Trial:
        is_bad = self.vibrates(name, rpm)
        return Trial(name, way, Outcome.VIBRATES if is_bad else Outcome.FREE, ("bit_bounce",) * is_bad, **more)

    def all(self, one: runs.Bench, found: Trials) -> Trials:
        rpm = one.point.rotary_speed / RPM
        self.settings.append(rpm)
        ways = [self.trial(WEIGHT_FIRST, Way.IN, rpm, rate=rate) for rate in runs.WEIGHT_RATES]
        tagged = self.trial(TAGGED, Way.EXCURSION, rpm)
        return self.corners(one, replace(found, trials=(*ways, tagged)))

    def corners(self, one: runs.Bench, found: Trials) -> Trials:
        tried = (self.trial(TO_CORNER, Way.CORNER, at / RPM, speed=at, wob=wob) for at, wob in one.corners)
        return replace(found, trials=(*found.trials, *tried))


def changed_from(low: float, high: float, rpm: float) -> tuple[remedies.Changed, Change]:
    """Stabilisers 30 ft apart, free from below between two speeds [rpm], with its setting at another."""
    one = bench(ROTARY, "drillstring.torsional_damping=15 N*m*s/rad")
    changed = remedies.Changed(one.motions, {**one.values, "wob": 15 * KLBF}, one.speeds)
    ends = (low * RPM, high * RPM)
    span = next(each for each in changed.all() if each.value == "30 ft")
    return changed, replace(span, free=(ends,), widest=ends, room=2.5, speed=rpm * RPM)


def test_a_setting_moves_to_where_there_is_room_in_what_trials_leave(monkeypatch):
    """Free at 70 to 140 rpm on the way up; in trials it bounces from 118 rpm on. What is left, 70 to 115 rpm, has room
    around 92 rpm, though not at 110 rpm, and the string is brought there and knocked there, too."""
    faked = Faked(monkeypatch, lambda name, rpm: rpm > 117)
    changed, span = changed_from(70, 140, 110)
    found = window_trials._tried_change(span, changed, changed.speeds, 1, runs.Told(lambda progress: None))
    assert found.widest == (pytest.approx(70 * RPM), pytest.approx(115 * RPM))
    assert faked.settings == [pytest.approx(110), pytest.approx(92.5)]
    assert found.speed == pytest.approx(92.5 * RPM)
    assert found.room == pytest.approx(22.5 / 9.25)
    assert {one.outcome for one in found.inside} == {Outcome.FREE}
    assert sum(one.way == Way.IN for one in found.trials) == len(runs.WEIGHT_RATES), "those of its own setting"


def test_what_a_way_up_owes_to_stick_slip_depends_on_where_it_begins_and_says_so():
    """From 40 rpm 8 klbf stick to 90 rpm, past the wall at 65 to 68 rpm, and are free above; from 60 rpm, where it
    drills steadily, the collar goes to the wall and stays."""
    texts = "drillstring.torsional_damping=15 N*m*s/rad", "bit.surface_amplitude=0 mm"
    ran = {}
    for begins in (40, 60):
        one = bench(ROTARY, *texts, f"sweep.rotary_speed={{from: {begins} rpm, to: 160 rpm, points: 6}}")
        changed = remedies.Changed(one.motions, {**one.values, "wob": 12 * KLBF}, one.speeds)
        ran[begins] = changed.run(next(each for each in changed.all() if each.name == "weight"))
    assert ran[40].has_room
    assert ran[40].sticks_past
    assert not ran[60].free
    assert not ran[60].sticks_past
    found = Trials(changes=(remedies.AS_IT_IS, ran[40]), wob=12 * KLBF, begins=40 * RPM)
    told = list(trial_words.lines(found, "rotary_speed", Formatter("field")))
    assert told[0].startswith("One change at a time, each run one way up from 40 rpm")
    assert any("stick-slip takes it past whirl there, and begun above that it may whirl" in one for one in told)
    assert data_of(found, "rotary_speed")["changes"][1]["sticks_past_wall"] is True


@pytest.mark.parametrize(
    ("light", "heavy", "ends", "weights"),
    [
        ((75, 140), (90, 130), (90, 130), (13, 17)),  # more weight, a later end of stick-slip
        ((70, 140), (136, 140), (70, 140), (13, 15)),
        (None, (90, 140), (90, 140), (15, 17)),
    ],
)
def test_a_change_is_offered_at_no_weight_beyond_its_way_up_there(monkeypatch, light, heavy, ends, weights):
    """Free at 70 to 140 rpm at 15 klbf, and in every trial in a corner; at the weights to which that is held the way up
    is free over less, or nothing is known."""
    Faked(monkeypatch, lambda name, rpm: False)
    told = dict(zip((13, 17), (light, heavy), strict=True))

    def ways_up(changed, change, wobs):
        free = [told[round(wob / KLBF)] for wob in wobs]
        return [
            replace(change, wob=wob, free=(), room=None)
            if one is None
            else replace(change, wob=wob, free=((one[0] * RPM, one[1] * RPM),), room=1.0)
            for wob, one in zip(wobs, free, strict=True)
        ]

    monkeypatch.setattr(remedies.Changed, "at_weights", ways_up)
    changed, span = changed_from(70, 140, 105)
    found = window_trials._tried_change(span, changed, changed.speeds, 1, runs.Told(lambda progress: None))
    assert found.widest == pytest.approx((ends[0] * RPM, ends[1] * RPM))
    assert found.weights == pytest.approx((weights[0] * KLBF, weights[1] * KLBF))
    assert {one.wob for one in found.trials if one.way == Way.CORNER} == set(found.weights)
    if weights != (13, 17):
        gone = "17 klbf its way up has no room" if weights[0] == 13 else "13 klbf its way up is not known"
        assert gone in found.why


@pytest.mark.parametrize(("bad", "settings"), [((100, 120), [110, 87.5]), ((0, 200), [110, 87.5])])
def test_a_setting_that_trials_take_away_moves_to_the_side_with_room(monkeypatch, bad, settings):
    """At 110 rpm it bounces after a pick up and tag, at 87.5 rpm it does not, and helps. Where it does there, too,
    nothing is left that has room."""
    low, high = bad
    faked = Faked(monkeypatch, lambda name, rpm: name == TAGGED and low < rpm < high)
    changed, span = changed_from(70, 140, 110)
    found = window_trials._tried_change(span, changed, changed.speeds, 1, runs.Told(lambda progress: None))
    assert faked.settings == pytest.approx(settings)
    assert found.is_sound == (high == 120)
    if found.is_sound:
        assert found.widest == (pytest.approx(70 * RPM), pytest.approx(105 * RPM))
        assert found.room == pytest.approx(2.0)


def test_many_cuts_go_on_from_another_setting(monkeypatch):
    """Free at 52 to 220 rpm on the way up, and in trials to 132 rpm: 18 cuts of 5 rpm, of which a setting has 12."""
    faked = Faked(monkeypatch, lambda name, rpm: rpm > 132 and abs(rpm - 136) > 0.1)
    changed, span = changed_from(52, 220, 136)
    found = window_trials._tried_change(span, changed, changed.speeds, 1, runs.Told(lambda progress: None))
    assert faked.settings[0] == pytest.approx(136)
    assert found.has_room
    assert found.why == ""
    assert found.widest[1] < 133 * RPM


def test_no_room_is_told_where_no_setting_of_what_is_left_has_any(monkeypatch):
    faked = Faked(monkeypatch, lambda name, rpm: rpm > 83)
    changed, span = changed_from(70, 95, 82)
    found = window_trials._tried_change(span, changed, changed.speeds, 1, runs.Told(lambda progress: None))
    assert faked.settings == [pytest.approx(82)]
    assert found.room is not None
    assert not found.has_room
    assert found.widest[1] < 86 * RPM


def test_a_change_is_run_with_a_usual_damping_where_that_of_the_study_is_higher(monkeypatch):
    """The torsion of the assembly has a ratio of 0.075 with the default; one that is usual is not run."""
    seen = []

    def run(changed, change):
        seen.append(changed.motions.study.parameters.drillstring.torsional_damping)
        return replace(change, free=((80 * RPM, 130 * RPM),), room=2.0)

    monkeypatch.setattr(remedies.Changed, "run", run)
    for texts, holds in (((), True), (("drillstring.torsional_damping=20 N*m*s/rad",), None)):
        one = bench(ROTARY, *texts)
        changed = remedies.Changed(one.motions, {**one.values, "wob": 20 * KLBF}, one.speeds)
        ends = (60 * RPM, 140 * RPM)
        change = replace(changed.all()[1], free=(ends,), widest=ends, room=3.0, speed=100 * RPM)
        found = changed.with_usual_damping(change)
        assert found.holds_usual is holds
        assert found.widest == ((80 * RPM, 130 * RPM) if holds else ends)
    assert len(seen) == 1
    assert 15.0 < seen[0] < 25.0


def test_a_change_says_what_the_least_damping_that_is_usual_leaves(monkeypatch):
    """With 0.039 times the critical damping, as strings have, it was not run with less: 0.02 leaves less than half. One
    with the least has no other run."""
    seen = []

    def run(changed, change):
        seen.append(changed.motions.study.parameters.drillstring.torsional_damping)
        return replace(change, free=((100 * RPM, 140 * RPM),), room=2.0)

    monkeypatch.setattr(remedies.Changed, "run", run)
    for damping in (26.0, 13.0):
        one = bench(ROTARY, f"drillstring.torsional_damping={damping} N*m*s/rad")
        changed = remedies.Changed(one.motions, {**one.values, "wob": 20 * KLBF}, one.speeds)
        ends = (60 * RPM, 140 * RPM)
        change = replace(changed.all()[1], free=(ends,), widest=ends, room=3.0, speed=100 * RPM)
        assert changed.with_usual_damping(change) == change
        found = changed.with_low_damping(change)
        assert found.ratio == pytest.approx(0.075 * damping / 50.0, rel=0.05)
        assert found.widest == ends
        assert (found.low and found.low.widest) == ((100 * RPM, 140 * RPM) if damping > 20.0 else None)
    assert seen == [pytest.approx(0.02 / 0.075 * 50.0, rel=0.05)]


def test_another_bit_comes_with_its_friction():
    """A PDC bit was offered for a roller cone with the friction of the cone, and sticks further with its own."""
    cone = "{lobes: 3, surface_amplitude: 1 mm, friction: {static: 0.2, dynamic: 0.1}}"
    usual = default_study("christoforou_yigit").parameters.bit.friction
    for bit, lobes, words, static in (
        (cone, 1, "a PDC bit without lobes (friction 0.5/0.2)", usual.static),
        (cone.replace("3", "1"), 1, "a bit without lobes (friction 0.2/0.1, as now)", 0.2),
    ):
        one = bench(ROTARY, f"bit={bit}")
        changed = remedies.Changed(one.motions, {**one.values, "wob": 20 * KLBF}, one.speeds)
        change = next(one for one in changed.all() if one.name == "lobes")
        assert change.words == words
        ran = changed.study_of(change).parameters.bit
        assert (ran.lobes, ran.surface_amplitude, ran.friction.static) == (lobes, 0.0, static)
        assert ran.friction.dynamic == (usual.dynamic if "PDC" in words else 0.1)
    measured = cone.replace("static: 0.2, dynamic: 0.1", "static: 10 kN*m, dynamic: 5 kN*m")
    one = bench(ROTARY, f"bit={measured}")
    changed = remedies.Changed(one.motions, {**one.values, "wob": 20 * KLBF}, one.speeds)
    assert "lobes" not in [one.name for one in changed.all()], "a torque that was measured is that of its own bit"


@pytest.mark.parametrize(("at_heavy", "held"), [(((95 * RPM, 140 * RPM),), 22), ((), 20)])
def test_a_usual_damping_is_run_at_each_weight_to_which_a_change_is_held(monkeypatch, at_heavy, held):
    """Stick-slip lasts further under more weight: what is ordered at 22 klbf is free there with that damping too, and a
    weight at which it leaves no room is none of them."""
    dampings = []

    def run(changed, change, wobs):
        dampings.append(changed.motions.study.parameters.drillstring.torsional_damping)
        free = {22: at_heavy, 20: ((80 * RPM, 140 * RPM),), 18: ((70 * RPM, 140 * RPM),)}
        return [replace(change, wob=wob, free=free[round(wob / KLBF)], room=2.0 if wob else 0.0) for wob in wobs]

    monkeypatch.setattr(remedies.Changed, "_run_at", run)
    one = bench(ROTARY)
    changed = remedies.Changed(one.motions, {**one.values, "wob": 20 * KLBF}, one.speeds)
    ends = (60 * RPM, 140 * RPM)
    change = replace(changed.all()[1], free=(ends,), widest=ends, room=3.0, speed=100 * RPM)
    found = changed.with_usual_damping(replace(change, weights=(18 * KLBF, 22 * KLBF)))
    assert found.holds_usual
    assert found.weights == pytest.approx((18 * KLBF, held * KLBF))
    assert found.widest == ((95 * RPM if held == 22 else 80 * RPM), 140 * RPM)
    assert ("at 22 klbf with a usual damping of torsion its way up has no room" in found.why) == (held == 20)
    assert len(set(dampings)) == 1
    assert 15.0 < dampings[0] < 25.0


def test_changes_are_run_at_several_weights_of_the_map(monkeypatch):
    """At that of the setting first, then at the lightest, between them, and at that of the study. At 20 kN stick-slip
    ends at a lower speed than at 120 kN."""
    monkeypatch.setattr(remedies, "SPEEDS", 6)
    sweep = "sweep={wob: {from: 20 kN, to: 120 kN, points: 6}, rotary_speed: {from: 4 rad/s, to: 20 rad/s, points: 5}}"
    study = parse_study(TORSION, "the test", [sweep, "sweep.procedure=up", "sweep.along=rotary_speed"])
    results, motions = run_in_memory(study, workers=1), Motions(prepare(study))
    place = {"depth": 5000.0, "wob": 120e3, "rotary_speed": 10.0}
    weights = window_trials._weights(results, None, place, None, motions)
    assert weights == pytest.approx((20e3, 60e3, 120e3))  # that of the study is nearest to 60 kN
    assert window_trials._weights(results, None, place, (50e3, 130e3), motions)[0] == pytest.approx(60e3)
    changed = remedies.Changed(motions, place, results.coords["rotary_speed"], weights=weights)
    as_it_is = changed.run(remedies.AS_IT_IS)
    assert (as_it_is.wob, [one.wob for one in as_it_is.every]) == (120e3, pytest.approx([20e3, 60e3, 120e3]))
    light, _, heavy = as_it_is.every
    assert light.free[-1][0] < heavy.free[-1][0]
    alone = changed.run(replace(remedies.AS_IT_IS, name="weight", key="operation.wob", value="80 kN"))
    assert (alone.wob, alone.others) == (80e3, ())
    by_map = window_trials._as_it_is(results, None, changed)
    assert [one.wob for one in by_map.every] == pytest.approx([20e3, 60e3, 120e3])
    assert changed.seconds(as_it_is) == pytest.approx(6 * sum(changed.held))
    assert changed.point(replace(light, speed=12.0))[1]["wob"] == pytest.approx(20e3)


def test_a_change_is_tried_at_the_nearest_weight_and_then_where_it_has_the_most_room():
    ends = (60 * RPM, 180 * RPM)
    as_it_is = replace(remedies.AS_IT_IS, room=0.0, wob=18 * KLBF)
    span = Change("span", "k", "30 ft", "30 ft", (ends,), 2.0, ends, speed=120 * RPM, wob=18 * KLBF)
    others = tuple(replace(span, wob=wob * KLBF, room=room) for wob, room in ((6, 5.5), (10, 4.1), (14, 2.2)))
    soft = replace(span, name="drive", key="d", room=0.5)
    found = Trials(changes=(as_it_is, replace(span, others=others), soft), wob=18 * KLBF, nothing=True)
    promising = window_trials._promising(found)
    assert [(one.key, one.wob) for one in promising] == [("k", 18 * KLBF), ("k", 6 * KLBF)]
    further = window_trials._further(found, promising)
    assert [one.wob for one in further] == [14 * KLBF, 10 * KLBF], "then at the others, the nearer first"


def test_a_change_is_tried_at_its_other_weights_before_one_of_more_effort_is_named(monkeypatch):
    """Stabilisers vibrate at 18 and at 6 klbf, and are free at 12 klbf; so is a bit without lobes, that no rig has."""
    ends = (60 * RPM, 180 * RPM)
    as_it_is = replace(remedies.AS_IT_IS, room=0.0, wob=18 * KLBF)
    span = Change("span", "k", "30 ft", "30 ft", (ends,), 3.0, ends, speed=120 * RPM, wob=18 * KLBF)
    whole = replace(span, others=tuple(replace(span, wob=wob * KLBF, room=room) for wob, room in ((6, 5.5), (12, 4.1))))
    bit = replace(span, name="lobes", key="b")
    ran = []

    def tried(change, *_):
        ran.append((change.key, round(change.wob / KLBF)))
        is_bad = change.key == "k" and ran[-1][1] != 12
        way = Trial(WEIGHT_FIRST, Way.IN, Outcome.VIBRATES if is_bad else Outcome.FREE, rate=1.0)
        return replace(change, others=(), trials=(way,))

    monkeypatch.setattr(window_trials, "_tried_change", tried)
    found = Trials(changes=(as_it_is, whole, bit), wob=18 * KLBF, nothing=True)
    found = window_trials._with_changes_tried(found, None, np.zeros(1), 1, runs.Told(lambda progress: None))
    assert ran == [("k", 18), ("k", 6), ("b", 18), ("k", 12)]
    assert (found.best.key, found.best.wob) == ("k", 12 * KLBF)


def test_a_middle_is_one_of_where_one_drills():
    assert window_trials._middle(np.arange(1.0, 8.0), None) == 4.0
    assert window_trials._middle(np.arange(1.0, 8.0), (5.0, 7.0)) == 6.0
    assert window_trials._middle(np.arange(1.0, 8.0), (5.2, 5.8)) == 4.0  # no value lies there


def test_a_report_has_trials_only_where_asked(torsion, tmp_path):
    for trials_, name in ((False, "without.html"), (True, "with.html")):
        nsdrill.report(str(torsion), str(tmp_path / name), motions=0, trials=trials_)
        text = (tmp_path / name).read_text()
        assert ("picked up and tagged again" in text) == trials_
        assert (" --trials" in text) == trials_


def test_one_page_takes_trials(torsion, tmp_path):
    """With them it says how the ways in ended, and has the same order as the window."""
    pages = []
    for trials_ in (False, True):
        path = tmp_path / f"{trials_}.html"
        nsdrill.report(str(torsion), str(path), one_page=True, trials=trials_)
        pages.append(path.read_text())
    assert "<b>NO TRIALS:</b>" in pages[0]
    assert "<b>TRIALS:" not in pages[0]
    assert "<b>TRIALS:" in pages[1]
    assert "speed first: " in pages[1]


SEGMENTS = """
model: segments
segments: {pipe: 3, collar: 2}
operation: {wob: 60 kN}
drive: {kind: soft_torque}
sweep: {rotary_speed: [4 rad/s, 10 rad/s, 12 rad/s, 14 rad/s, 16 rad/s, 18 rad/s, 20 rad/s], procedure: up-down}
simulation: {transient: 20 s, observe: 20 s}
"""
BEAM = """
model: beam
operation: {wob: 30 kN, depth: 2000 m}
bit: {surface_amplitude: 0 mm, lobes: 1}
drillstring: {eccentricity: 1 mm, collar: {span: 10 m}}
sweep: {rotary_speed: [2 rad/s, 8 rad/s, 9 rad/s, 10 rad/s, 11 rad/s], procedure: up-down}
simulation: {transient: 20 s, observe: 20 s}
"""


@pytest.mark.parametrize(("text", "knock"), [(SEGMENTS, HELD), (BEAM, ON_WALL)], ids=["segments", "beam"])
def test_trials_of_other_models(text, knock, tmp_path):
    """A setting of segments, and of an elastic collar, which is knocked on to the wall."""
    run_study(parse_study(text, "the test"), tmp_path / "out.h5", workers=1)
    found = nsdrill.window(str(tmp_path / "out.h5"), trials=True)["answer"]
    assert found["point"]
    trials_ = {(one["name"], one["way"]): one["outcome"] for one in found["trials"]}
    assert {outcome for (_, way), outcome in trials_.items() if way == "in"} == {"free"}
    assert trials_[knock, "knock"] != "unknown"
    assert is_short(found["sentence"].removeprefix("Not settled, not to drill by. "))


def test_an_elastic_collar_may_stay_on_the_wall():
    """As a lumped one: a sweep that begins above the speed at which the collar reaches the
    wall, or where it rolls on, says so."""
    changes_ = ["drillstring.eccentricity=12.7 mm", "drillstring.collar.span=19.8 m"]
    bent = parse_study(BEAM, "the test", changes_)
    by_name = {one["name"]: one for one in lasting_motions(bent)}
    lumped = parse_study(
        BEAM.replace("model: beam\n", ""),
        "the test",
        ["drillstring.eccentricity=12.7 mm", "drillstring.collar.span=19.8 m"],
    )
    there = {one["name"]: one for one in lasting_motions(lumped)}
    assert by_name["wall_speed"]["min"] == pytest.approx(there["wall_speed"]["min"], rel=0.1)
    assert by_name["wall_speed"]["lasts"] == pytest.approx(there["wall_speed"]["lasts"], rel=0.1)


def test_where_trials_withdraw_a_setting_changes_are_run(torsion, monkeypatch):
    """Of a setting with room in the map of which no way in ends free."""
    monkeypatch.setattr(remedies, "SPEEDS", 5)
    monkeypatch.setattr(runs, "verdict", lambda found, severity, critical: (Outcome.VIBRATES, ("stick_slip",), ""))
    results = results_for_window(torsion)
    summary = find_window(results)
    assert not summary["answer"].narrow
    found = window_trials.tried(summary, results, str(torsion), workers=1)["answer"]
    assert found.kind == "hint"
    assert found.trials.changes[0].name == "none"
    assert found.trials.wob is not None


def test_corners_are_started_with_the_bit_at_rest_where_the_end_of_stick_slip_is_not_known():
    """12 1/4 in, PDC of 0.05 mm, 9000 ft, 3 mm: at 20 klbf a bit that is held sticks on at 120 rpm, and
    from 125 rpm it comes free, in runs of 260 s from rest. A ramp to 120 rpm is free."""
    one = bench(PDC)
    corners = tuple((rpm * RPM, 20 * KLBF) for rpm in (120, 170))
    state = one.motions.start(one.study)
    plans = replace(one, corners=corners).disturbances(state)
    names = [plan.name for plan in plans if plan.way == Way.CORNER]
    assert names == [TO_CORNER, TAGGED_IN_CORNER] * 2 + [HELD_IN_CORNER] * 2
    assert [plan.name for plan in plans][-1] == ON_WALL, "what no setting survives comes last"
    known = replace(one, corners=corners, modelled=True).disturbances(state)
    assert HELD_IN_CORNER not in [plan.name for plan in known]
    held = [one.run(plan, Event())[0] for plan in plans if plan.name == HELD_IN_CORNER]
    assert [(trial.outcome, trial.responses) for trial in held] == [
        (Outcome.VIBRATES, ("stick_slip",)),
        (Outcome.FREE, ()),
    ]
    assert [trial.speed for trial in held] == [speed for speed, _ in corners]


def test_a_corner_at_the_speed_of_the_setting_is_reached_by_its_weight_alone():
    """As where only the weight was swept: the ramp of the speed had no length, and was refused."""
    one = bench(TORSION, "operation.rotary_speed=12 rad/s")
    here = one.point
    corners = ((here.rotary_speed, 0.8 * here.wob), (1.05 * here.rotary_speed, here.wob))
    plans = replace(one, corners=corners).disturbances(one.motions.start(one.study))
    ran = [one.run(plan, Event())[0] for plan in plans if plan.name == TO_CORNER]
    assert [(trial.speed, trial.wob) for trial in ran] == [tuple(map(pytest.approx, corner)) for corner in corners]
    assert Outcome.UNKNOWN not in [trial.outcome for trial in ran], ran


def test_corners_are_tagged_as_the_setting_is():
    """Soft torque, 5 klbf: off bottom the collar reaches the wall at 66 to 70 rpm. Picked up at 69 rpm for 20 s it goes
    there, and is still there with the weight on; at 130 rpm it is not. A ramp to 69 rpm with the weight on is free."""
    texts = [
        "drive.kind=soft_torque",
        "bit.surface_amplitude=0 mm",
        "operation.wob=15 klbf",
        "operation.rotary_speed=130 rpm",
    ]
    one = replace(bench(ROTARY, *texts), corners=tuple((rpm * RPM, 5 * KLBF) for rpm in (69, 160)), modelled=True)
    state = one.motions.start(one.study)
    plans = [plan for plan in one.disturbances(state) if plan.way == Way.CORNER]
    assert [plan.name for plan in plans] == [TO_CORNER, TAGGED_IN_CORNER] * 2
    ended = [one.run(plan, Event())[0] for plan in plans]
    assert [trial.outcome for trial in ended] == [Outcome.FREE, Outcome.VIBRATES, Outcome.FREE, Outcome.FREE]
    assert ended[1].responses == ("whirl",)
    assert [(trial.speed, trial.wob) for trial in ended] == [corner for corner in one.corners for _ in range(2)]
    told = next(trial_words.of_setting(Trials(tuple(ended)), trial_words.Formatter("field")))
    assert "5 klbf and 69 rpm, picked up and tagged again: whirl" in told


def test_an_excursion_tells_to_which_speed_it_went():
    one = bench(TORSION)
    speed, plans = one.point.rotary_speed, one.disturbances(one.motions.start(one.study))
    went = {plan.name: plan.there for plan in plans if plan.there is not None}
    assert went == {
        "10 % faster and back": pytest.approx(1.1 * speed),
        "10 % slower and back": pytest.approx(0.9 * speed),
    }
    trial, _ = one.run(next(plan for plan in plans if plan.there is not None), Event())
    assert (trial.there, trial.speed) == (pytest.approx(1.1 * speed), pytest.approx(speed))


def test_what_to_stay_within_has_no_corner_that_sticks_from_rest(tmp_path, monkeypatch):
    """The map allows 105 rpm at 20 klbf on the way up; trials begin it above where a bit sticks on
    from rest, and text, JSON and page have that."""
    monkeypatch.setattr(window_trials, "MOST_CHANGES", 0)
    monkeypatch.setattr(remedies, "SPEEDS", 2)
    run_study(parse_study(PDC, "the test"), tmp_path / "pdc.h5", workers=1)
    before = nsdrill.window(str(tmp_path / "pdc.h5"))["answer"]
    found = nsdrill.window(str(tmp_path / "pdc.h5"), trials=True)["answer"]
    stuck = [one for one in found["trials"] if one["way"] == "corner" and one["outcome"] != "free"]
    low = found["stay_within"]["rotary_speed"]["from"]
    assert before["stay_within"]["rotary_speed"]["from"] < low
    assert {one["name"] for one in stuck} == {HELD_IN_CORNER}
    assert max(one["speed"]["rotary_speed"] for one in stuck) < low
    assert found["corners_untried"] == []
    assert found["warnings"][0].startswith("NOT SETTLED")  # on what it rests comes first
    told = [one for one in found["warnings"] if not one.startswith(("NOT SETTLED", "OBSERVED TOO SHORTLY"))]
    assert told[0].startswith("IN A CORNER of what the map allows it vibrates in trials.")
    assert f"{low / RPM:.0f} to " in found["sentence"]
    nsdrill.report(str(tmp_path / "pdc.h5"), str(tmp_path / "page.html"), one_page=True, trials=True)
    assert found["sentence"] in (tmp_path / "page.html").read_text()
    counts = {(one["name"], one["way"]): one for one in found["trials_counted"]}
    assert counts[HELD_IN_CORNER, "corner"]["vibrates"] == len(stuck)


def test_the_bit_is_lifted_out_of_the_rock():
    """The interference of steady drilling is the weight over the stiffness of the rock; twice that, and
    the lobes, above where it is the bit does not touch."""
    one = bench(ROTARY)
    start = one.motions.start(one.study)
    knocks, names = dict(one.knocks(start)), one.motions.states(one.study)
    z = names.index("z")
    lobes = one.study.parameters.bit.surface_amplitude
    assert start[z] < 0.0
    assert knocks[OFF_ROCK][z] > lobes
    assert knocks[OFF_ROCK][names.index("vz")] == 0.0
    assert OFF_ROCK not in dict(bench(TORSION).knocks(np.zeros(4)))


def test_a_knock_off_the_rock_finds_the_bounce_over_lobes_that_may_last():
    """At 100 rpm, where the lobe excites the bit at 324 rpm: it bounces 49 mm high, in step with the lobe. At
    70 rpm no bounce lasts."""
    for rpm, outcome in ((100, Outcome.VIBRATES), (70, Outcome.FREE)):
        one = bench(LOBE, f"operation.rotary_speed={rpm} rpm")
        start = one.motions.start(one.study)
        start[one.motions.states(one.study).index("twist")] = -0.45
        (plan,) = (plan for plan in one.disturbances(start) if plan.name == OFF_ROCK)
        found, _ = one.run(plan, Event())
        assert (found.outcome, found.responses) == (outcome, ("bit_bounce",) if outcome == Outcome.VIBRATES else ())


def test_what_would_help_is_run_as_long_as_the_file(monkeypatch):
    """A bounce that grows slowly needs the transient of the file."""
    seen = []
    monkeypatch.setattr(remedies, "run_in_memory", lambda study, workers: seen.append(study) or 1 / 0)
    long = bench(ROTARY, "simulation.transient=150 s", "simulation.observe=90 s")
    changed = remedies.Changed(long.motions, long.values, long.speeds)
    with pytest.raises(ZeroDivisionError):
        changed.run(changed.all()[0])
    assert (seen[0].simulation.transient, seen[0].simulation.observe) == (150.0, 90.0)
