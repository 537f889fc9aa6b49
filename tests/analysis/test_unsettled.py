"""An answer that rests on runs that were short, or had not settled, says so first, wherever
it stands."""

import html
import json
import re
from dataclasses import replace

import numpy as np
import pytest

import nsdrill
from nsdrill.analysis.advice import Kind
from nsdrill.analysis.window import find_window
from nsdrill.app.answering.answers import plain_window, results_for_window
from nsdrill.app.answering.summary import summarize
from nsdrill.data import SHORT, SHORT_TO, json_text
from nsdrill.figures import cut
from nsdrill.study.load import parse_study
from nsdrill.text.show import lines as show_lines
from nsdrill.text.window_text import lines
from nsdrill.web.one_page import Sheet, one_page
from nsdrill.words.answer import answer, notes, warnings, words_of

from .grids import grid

SPEEDS, WEIGHTS = np.arange(1.0, 8.0), np.arange(10e3, 60e3, 10e3)
ROOMY = ["s.....w"] * 5
TOO_SHORT = {units: ["Short: the torsional period is 6 s at most."] for units in ("si", "field")}
UNSETTLED = "Not settled, not to drill by. To confirm: bring up to "
BY_SHORT = "By short runs, not to drill by. To confirm: bring up to "


def results(rows=ROOMY, unsettled=(), short=False, up="up"):
    """A map, with the points that had not settled as (weight, speed)."""
    found = grid({up: [rows]}, SPEEDS, WEIGHTS)
    found.variables["settled"] = np.ones(found["status"].shape, dtype=np.int8)
    for weight, speed in unsettled:
        found["settled"][0, 0, weight, speed] = 0
    resolved = parse_study("sweep: {rotary_speed: [1 rad/s, 2 rad/s]}").resolved
    attrs = {**found.attrs, "study_resolved": json_text(resolved)}
    return replace(found, attrs={**attrs, SHORT: json_text(TOO_SHORT)} if short else attrs)


@pytest.mark.parametrize(
    ("unsettled", "short", "begins", "heads"),
    [
        ([], False, "Bring up to ", []),
        ([(2, 3)], False, UNSETTLED, ["NOT SETTLED"]),
        ([(1, 4), (2, 3)], True, UNSETTLED, ["NOT SETTLED", "OBSERVED TOO SHORTLY"]),
        ([(0, 5)], False, "Bring up to ", []),  # what to stay within ends before it
        ([], True, BY_SHORT, ["OBSERVED TOO SHORTLY"]),
        ([(2, 3)], True, UNSETTLED, ["NOT SETTLED", "OBSERVED TOO SHORTLY"]),
        ([(2, 0), (2, 6)], False, "Bring up to ", []),  # they vibrate, and bound it on the safe side
    ],
)
def test_it_comes_first_in_sentence_order_warnings_data_and_picture(unsettled, short, begins, heads):
    found = find_window(results(unsettled=unsettled, short=short))
    assert answer(found, "si").startswith(begins)
    assert ("(" in words_of(found, "si").order().partition("rpm)")[2]) == bool(heads)
    first = list(warnings(found, "si"))[: len(heads)]
    assert [one.partition(":")[0] for one in first] == heads
    assert [one.partition(":")[0] for one in notes(found, "si")][: len(heads)] == heads
    plain = plain_window(found, "si")["answer"]
    assert plain["sentence"].startswith(begins)
    assert (plain["unsettled"] is not None) == bool(heads)
    printed = " ".join(lines(found, "si"))
    assert begins in printed
    assert all(f"{head}: " in printed for head in heads)


def test_only_what_one_is_to_stay_within_counts_and_what_bounds_it_is_told():
    """A free point elsewhere is told of as before, not first."""
    apart = ["s.....w"] * 3 + ["sssssss", "sssss.s"]
    found = find_window(results(apart, unsettled=[(4, 5)]))
    assert found["answer"].unsettled is None
    told = list(warnings(found, "si"))
    assert not told[0].startswith("NOT SETTLED")
    assert any(one.startswith("NOT SETTLED: at 1 of 16 allowed points a motion") for one in told)
    both = find_window(results(unsettled=[(2, 3), (2, 0)]))["answer"].unsettled
    assert (both.points, both.of, both.here, both.beside) == (1, 25, True, 1)
    nothing = find_window(results(["s" * 7] * 5, unsettled=[(2, 3)], short=True))
    assert nothing["answer"].unsettled is None
    assert answer(nothing, "si").startswith("Nothing is safe")


def test_what_had_not_settled_is_left_out_where_the_rest_has_as_good_a_setting():
    """The column at 6 rad/s: one stays below it, is told why, and no worse setting is taken for it."""
    found = find_window(results(unsettled=[(weight, 5) for weight in range(5)]))
    one = found["answer"]
    assert (one.unsettled, one.settled_only, one.point["rotary_speed"]) == (None, True, 3.0)
    assert one.stay_within["rotary_speed"].high == 5.0
    assert one.most["rotary_speed"].value == 5.0
    words = words_of(found, "si")
    assert "at 6 rad/s (57.3 rpm) a motion was still changing. Never exceed 5 rad/s" in " ".join(words.lines())
    assert plain_window(found, "si")["answer"]["stay_within"]["rotary_speed"]["above"]["is_unsettled"]
    assert any(text.startswith("NOT SETTLED: at 5 of 25 allowed points") for text in warnings(found, "si"))
    # around the middle nothing else has room, so that the answer rests on it and says so
    assert find_window(results(unsettled=[(2, 3)]))["answer"].unsettled is not None
    # what is left out of one map is a setting of the other
    both = grid({"up": [["s.....w"] * 5], "down": [["s.....w"] * 5]}, SPEEDS, WEIGHTS)
    both.variables["settled"] = np.ones(both["status"].shape, dtype=np.int8)
    both["settled"][1, 0, :, 1:5] = 0  # only on the way down: brought up from below it is known
    kind = find_window(both)["answer"]
    assert (kind.kind, kind.settled_only) == (Kind.ANY_HISTORY, False)


@pytest.mark.parametrize(("unsettled", "short", "why"), [([(2, 3)], False, "not settled"), ([], True, "were short")])
def test_the_sheet_orders_nothing_without_a_word_of_it(unsettled, short, why):
    page = one_page([Sheet(results(unsettled=unsettled, short=short), "si", "x.h5")], "A4", {})
    said = " ".join(html.unescape(re.sub(r"<[^>]+>", " ", page.partition("</style>")[2])).split())
    assert "<div class='answer no'>" in page
    assert re.search(r"(Not settled|By short runs), not to drill by\. To confirm: bring up to ", said)
    first = "DO Have the map run again, with longer runs, and do not drill by this page before: its runs"
    assert first in said
    assert why in said
    assert said.index(first) < said.index("TO CONFIRM, not to drill by") < said.index(" Try ")
    assert "Drill at" not in said
    assert "to confirm [rad/s]" in said
    settled = one_page([Sheet(results(), "si", "x.h5")], "A4", {})
    assert "<div class='answer yes'>" in settled
    assert "by this page before" not in settled
    assert "TO CONFIRM" not in settled
    assert "Drill at" in settled
    assert "ordered [rad/s]" in settled


@pytest.mark.parametrize(("limit", "begins"), [(0.5, "Bring up to "), (3.0, BY_SHORT)])
def test_slow_speeds_of_a_run_up_make_no_answer_short(limit, begins):
    """The observation holds few revolutions of the drive below the ``limit``; one is to stay
    above 1 rad/s."""
    found = results(short=True)
    assert answer(find_window(replace(found, attrs={**found.attrs, SHORT_TO: limit})), "si").startswith(begins)


def of(**sections):
    """The warnings of a map whose study has these sections as well."""
    found = results()
    resolved = {**json.loads(found.attrs["study_resolved"]), **sections}
    return list(
        warnings(find_window(replace(found, attrs={**found.attrs, "study_resolved": json_text(resolved)})), "si")
    )


def test_a_loose_tolerance_and_frozen_motions_are_told():
    """At 1e-3 the main model whirls at 76 points of a map where it does at 37 with 1e-4 to 1e-6."""
    assert not any("TOLERANCE" in one or "FROZEN" in one for one in of(simulation={"rtol": 1e-4}))
    assert of(simulation={"rtol": 1e-3})[0].startswith("COMPUTED TOO ROUGHLY: simulation.rtol is 0.001")
    frozen = {"lateral": "frozen", "axial": "free", "torsional": "free"}
    assert "no lateral motion, so that whirl cannot be seen" in of(modes=frozen)[0]


def test_how_short_a_run_up_is_does_not_matter_where_one_does_not_drill():
    """At 1 rad/s 100 s hold 16 revolutions, and the point beside what is drilled has not settled."""
    resolved = parse_study("sweep: {rotary_speed: [1 rad/s, 2 rad/s]}\nsimulation: {observe: 100 s}").resolved
    whole, some = (
        find_window(
            results_for_window(replace(one, attrs={**one.attrs, "study_resolved": json_text(resolved)}), within=within)
        )
        for one, within in (
            (results(["......."] * 5), None),
            (results(["......."] * 5, unsettled=[(2, 1)]), {"rotary_speed": ("3 rad/s", "5 rad/s")}),
        )
    )
    assert "OBSERVED TOO SHORTLY" in " ".join(warnings(whole, "si"))
    assert whole["answer"].unsettled.short
    assert "OBSERVED TOO SHORTLY" not in " ".join(warnings(some, "si"))
    assert some["answer"].unsettled is None


def test_what_turns_above_the_speed_at_which_rotating_mud_drives_whirl_is_not_settled():
    """There a collar off the axis leaves it, however slowly: from 0.1 mm it is free for hours."""
    text = (
        "modes: {axial: frozen, torsional: frozen}\ndrillstring: {eccentricity: 0 mm}\nmud: {swirl: 0.6}\n"
        "initial: {x: 0 mm}\nsweep: {rotary_speed: [11 rad/s, 12 rad/s, 14 rad/s], procedure: up-down}\n"
        "simulation: {transient: 30 s, observe: 60 s}\n"
    )
    limit = nsdrill.check(text).figures["fluid_whirl"].value
    assert 12.0 < limit < 14.0
    found = find_window(results_for_window(nsdrill.run(text, progress=False)))
    (told,) = [one for one in warnings(found, "si") if one.startswith("ROTATING MUD DRIVES WHIRL above 12.8")]
    numbers, first, *_ = warnings(found, "si")
    assert numbers.startswith("NUMBERS FAR FROM USUAL: drillstring.eccentricity 0 mm")
    assert first == told
    still = find_window(results_for_window(nsdrill.run(text, set={"mud.swirl": 0}, progress=False)))
    assert "MUD" not in " ".join(warnings(still, "si"))
    assert found["unsettled_in_all"] == still["unsettled_in_all"] + 1, "that at 14 rad/s"
    assert any("fluid_whirl" in one for one in nsdrill.check(text).warnings)


@pytest.mark.parametrize(
    ("speed", "more", "driven"),
    [
        ("operation: {rotary_speed: 14 rad/s}\nsweep: {wob: [20 kN, 30 kN]}", "", 2),
        ("operation: {rotary_speed: 12 rad/s}\nsweep: {wob: [20 kN, 30 kN]}", "", 0),
        (
            "operation: {rotary_speed: 13 rad/s}\nsweep: {wob: [20 kN, 30 kN]}",
            "uncertain: {operation.rotary_speed: {uniform: [13.5 rad/s, 14 rad/s]}, samples: 2}\n",
            2,
        ),
        (
            "operation: {rotary_speed: 13 rad/s}\nsweep: {wob: [20 kN, 30 kN]}",
            "uncertain: {operation.rotary_speed: {uniform: [11 rad/s, 12 rad/s]}, samples: 2}\n",
            0,
        ),
        # the more weight, the softer the collar: from 12.97 rad/s on at 10 kN, 12.48 at 60 kN, 12.08 at 100 kN
        ("sweep: {rotary_speed: [12.2 rad/s, 12.7 rad/s, 14 rad/s], wob: [10 kN, 60 kN, 100 kN]}", "", 1 + 2 + 3),
        ("operation: {rotary_speed: 12.2 rad/s}\nsweep: {wob: [10 kN, 60 kN, 100 kN], procedure: up-down}", "", 1),
        ("sweep: {rotary_speed: [12 rad/s, 14 rad/s], depth: [1 km, 5 km]}", "", 2),
        ("sweep: {rotary_speed: [12 rad/s, 14 rad/s], mud.swirl: [0, 0.3, 0.6]}", "", 1),
        (
            "sweep: {rotary_speed: [12 rad/s, 14 rad/s]}",
            "uncertain: {mud.swirl: {uniform: [0.56, 0.6]}, samples: 2}\n",
            1,
        ),
    ],
)
def test_that_holds_at_each_setting_for_itself(speed, more, driven):
    text = (
        "modes: {axial: frozen, torsional: frozen}\ndrillstring: {eccentricity: 0 mm}\nmud: {swirl: 0.6}\n"
        f"initial: {{x: 0 mm}}\n{speed}\nsimulation: {{transient: 30 s, observe: 60 s}}\n{more}"
    )
    rest = {} if "mud.swirl" in speed + more else {"mud.swirl": 0}
    found = find_window(results_for_window(nsdrill.run(text, progress=False)))
    assert any("ROTATING MUD DRIVES WHIRL" in one for one in warnings(found, "si")) == (driven > 0)
    if rest:
        still = find_window(results_for_window(nsdrill.run(text, set=rest, progress=False)))
        assert still["driven_by_mud"] is None
        driven += still["unsettled_in_all"]
    assert found["unsettled_in_all"] == driven


@pytest.mark.parametrize(("speeds", "runs"), [("[11 rad/s, 12 rad/s, 14 rad/s]", 3), ("[11 rad/s, 12 rad/s]", 0)])
def test_of_many_starts_too(speeds, runs):
    text = (
        "modes: {axial: frozen, torsional: frozen}\ndrillstring: {eccentricity: 0 mm}\nmud: {swirl: 0.6}\n"
        f"initial: {{ensemble: 3}}\nsweep: {{rotary_speed: {speeds}}}\nsimulation: {{transient: 9 s, observe: 9 s}}\n"
    )
    found = find_window(results_for_window(nsdrill.run(text, progress=False)))
    said = [one for one in warnings(found, "si") if "ROTATING MUD" in one]
    assert [", in 3 of 9 runs: there a collar" in one for one in said] == [True] * (runs > 0)
    assert (found["driven_by_mud"] or {"runs": 0})["runs"] == runs
    assert any("fluid_whirl" in one for one in nsdrill.check(text).warnings) == (runs > 0)


@pytest.mark.parametrize(
    ("within", "said"),
    [
        ("12 rad/s..14 rad/s", ", in 3 of 6 runs: there"),
        ("11 rad/s..12 rad/s", ""),
        ("14 rad/s..14 rad/s", "in 3 of 3 runs"),
    ],
)
def test_it_counts_where_one_drills_alone(within, said):
    text = (
        "modes: {axial: frozen, torsional: frozen}\ndrillstring: {eccentricity: 0 mm}\nmud: {swirl: 0.6}\n"
        "initial: {ensemble: 3}\nsweep: {rotary_speed: [11 rad/s, 12 rad/s, 14 rad/s]}\n"
        "simulation: {transient: 9 s, observe: 9 s}\n"
    )
    found = find_window(results_for_window(nsdrill.run(text, progress=False), within={"rotary_speed": within}))
    told = [one for one in warnings(found, "si") if "ROTATING MUD" in one]
    assert [said in one for one in told] == [True] * bool(said)


@pytest.mark.parametrize(("observe", "is_told"), [("44 s", True), ("63 s", True), ("65 s", False)])
def test_too_few_periods_to_see_slow_growth_are_told(observe, is_told):
    """As too few peaks are, as each period has one: the ``free_period`` at 5000 m is 10.64 s."""
    text = f"sweep: {{rotary_speed: [10 rad/s, 12 rad/s]}}\nsimulation: {{observe: {observe}}}"
    found = [one for one in nsdrill.check(text).warnings if "torsional period" in one]
    assert ["has fewer than 6, and slow growth is not seen" in one for one in found] == [True] * is_told
    followed = "continue: {along: rotary_speed, from: 10 rad/s, to: 12 rad/s}\nsimulation: {observe: 44 s}"
    assert not any("torsional period" in one for one in nsdrill.check(followed).warnings)


@pytest.mark.parametrize(("kept", "is_told"), [(0, True), (5, True), (6, False), (32, False)])
def test_too_few_peaks_to_see_slow_growth_are_told(kept, is_told):
    """In check, show, window, its JSON and on the sheet alike."""
    text = f"sweep: {{rotary_speed: [1 rad/s, 2 rad/s]}}\nrecord: {{peaks: {kept}}}"
    study = parse_study(text)
    found = results()
    found = replace(found, attrs={**found.attrs, "study_resolved": json_text(study.resolved)})
    summary = find_window(found)
    page = one_page([Sheet(found, "si", "x.h5")], "A4", {})
    said = f"record.peaks is {kept}, and of fewer than 6 it is not known whether they keep rising"
    assert any(said in one for one in nsdrill.check(study).warnings) == is_told
    assert any(one.startswith("SLOW GROWTH") for one in warnings(summary, "si")) == is_told
    assert any(one.startswith("SLOW GROWTH") for one in plain_window(summary, "si")["answer"]["warnings"]) == is_told
    assert plain_window(summary, "si")["peaks_kept"] == kept
    assert ("SLOW GROWTH" in page) == is_told
    assert any("SLOW GROWTH" in one for one in show_lines("x.h5", summarize(found), "si")) == is_told


@pytest.mark.parametrize(
    ("speed", "at", "ends"),
    [
        ("sweep: {rotary_speed: [12 rad/s, 14 rad/s], wob: [10 kN, 100 kN]}", {"wob": 1e4}, (12.966, 12.966)),
        ("sweep: {rotary_speed: [12 rad/s, 14 rad/s], wob: [10 kN, 100 kN]}", {"wob": 1e5}, (12.083, 12.083)),
        (
            "sweep: {rotary_speed: [14 rad/s, 15 rad/s], wob: [10 kN, 100 kN]}\n"
            "uncertain: {mud.density: {uniform: [1000 kg/m^3, 1500 kg/m^3]}, samples: 2}\n",
            {"sample": 1},
            (12.083, 12.966),
        ),
        (
            "sweep: {rotary_speed: [14 rad/s, 15 rad/s]}\ninitial: {ensemble: 2}\noperation: {wob: 10 kN}\n",
            {"start": 1},
            (12.966, 12.966),
        ),
    ],
)
def test_a_part_of_the_results_knows_of_it(speed, at, ends):
    """As it is drawn: at one value of an axis, of one sample, or from one start."""
    text = (
        "modes: {axial: frozen, torsional: frozen}\ndrillstring: {eccentricity: 0 mm}\nmud: {swirl: 0.6}\n"
        f"simulation: {{transient: 9 s, observe: 9 s}}\n{speed}"
    )
    whole = results_for_window(nsdrill.run(text, progress=False))
    start = at.get("start")
    part = cut(whole, {name: value for name, value in at.items() if name != "start"}, start)
    found = find_window(part)["driven_by_mud"]
    assert (found["from"], found["to"]) == pytest.approx(ends, abs=6e-4)
    assert found["runs"] == (1 if "wob" in at else 4 if "sample" in at else 2)
