"""What is in a file of results, an unfinished run or a trace, in words."""

from __future__ import annotations

from collections.abc import Iterator

from nsdrill.analysis.counts import beyond_words, open_words, turned_back_words
from nsdrill.analysis.doubts import ALL
from nsdrill.analysis.grades import unsettled_words
from nsdrill.analysis.planes import UNJUDGED
from nsdrill.analysis.probability import EVERY, safe_in_words, samples_text
from nsdrill.data import (
    BENT,
    ENDS_EARLY,
    FEW,
    NOT_CARRIED_RUN,
    NOT_CARRIED_WORDS,
    PULSES,
    SHORT,
    UNCUT,
    Answer,
    edited_words,
    evenly_spaced,
)
from nsdrill.errors import count, printable
from nsdrill.models.numbers import BENDS, DULL, FEW_PEAKS, FEW_STATES, PULSE, TOO_SHORT, few_peaks
from nsdrill.models.registry import described, showing
from nsdrill.models.responses import RESPONSE_KINDS
from nsdrill.quantity import amount, quantity, short, sign
from nsdrill.text.branch_text import lines as branch_lines
from nsdrill.text.words import (
    HELD,
    in_words,
    knots_text,
    label_of,
    overrides_text,
    point_text,
    refinement_text,
    rest,
    value_text,
)
from nsdrill.units import from_si
from nsdrill.variables import AXES

MAX_FAILED = 20
MAX_INTERVALS = 40
MAX_CHANGED = 12
MAX_POINTS = 24
MAX_ROWS = 48  # of attractors
MAX_ATTRACTORS = 5  # of one point; one line sums up the others


def lines(name: str, summary: Answer, units: str, everything: bool = False) -> Iterator[str]:
    """A summary of the file or data called ``name``, in words."""
    with showing(summary):
        return iter([*_lines(name, summary, units, everything)])


def _lines(name: str, summary: Answer, units: str, everything: bool) -> Iterator[str]:
    if summary["kind"] == "branches":
        return branch_lines(name, summary, units, everything)
    if summary["kind"] == "unfinished":
        return _unfinished_lines(name, summary)
    if summary["kind"] == "trace":
        return _trace_lines(name, summary, units)
    return _result_lines(name, summary, units, everything)


def _edited_lines(s: Answer) -> Iterator[str]:
    if told := edited_words(s):
        yield printable(f"  {told}")


def _unfinished_lines(name: str, s: Answer) -> Iterator[str]:
    yield printable(f"{name}: an unfinished {s['what']}.")
    yield f"  made           {s['created']} by nsdrill {s['nsdrill_version']}"
    yield f"  model          {s['model']}"
    yield f"  kept           {s['kept'] or 'nothing yet'}"
    yield "  Go on with the command that began it and --resume."


def _result_lines(file: str, s: Answer, units: str, everything: bool) -> Iterator[str]:
    yield from _sweep_lines(file, s, units)
    yield from _known_lines(s, units, everything)
    yield from _found_lines(s, units, everything)
    if s["ranges"] or s["infinite"]:
        run, points = s["measured"], s["points"]
        which = "all points" if run == points else f"the {run} of {count(points, 'point')} that were run and are known"
        yield f"\nLeast and greatest over {which}:"
        yield from _range_lines(s["ranges"], units, run)
        for name, one in s["infinite"].items():
            told = f"infinite in {one['runs']} of {count(one['of'], 'run')}"
            yield f"  {name:27s} {told:31s} {one['meaning']}"
        for name, meaning in s["without"].items():
            yield f"  {name:27s} {'no run has it':31s} {meaning}"
    if failed := s["failed"]:
        yield f"\nFailed points ({len(failed)}), to look at with nsdrill replay:"
        most = len(failed) if everything else MAX_FAILED
        for point in failed[:most]:
            where = point_text({name: point[name] for name in s["axes"]}, units)
            where += "".join(f", {name} {point[name]}" for name in ("sample", "start") if name in point)
            yield f"  {in_words(point['status'])}: {where}, {point['procedure']}"
        yield from rest(failed, most)


def _sweep_lines(file: str, s: Answer, units: str) -> Iterator[str]:
    """What was run: the study, its axes and starts, and how."""
    # A .part file may hold every point already, before the results file is written.
    kind = "results of a sweep" if s["finished"] and not file.endswith(".part") else "an unfinished sweep"
    yield printable(f"{file}: {kind}. {s['title']}".rstrip())
    yield from _edited_lines(s)
    yield f"  made           {s['created']} by nsdrill {s['nsdrill_version']}"
    yield from _override_lines(s["overrides"])
    for name, axis in s["axes"].items():
        label = label_of(name)
        if "values" in axis:  # words
            yield f"  {label:14s} {', '.join(axis['values'])}"
            continue
        text = value_text(name, axis["from"], units, both=axis["points"] == 1)
        if axis["points"] > 1:
            text += f" to {value_text(name, axis['to'], units)}, {axis['points']} values"
        yield f"  {label:14s} {text}"
    if (chain := s.get("chain")) is not None:
        held, whole = chain["held"], chain["whole"]
        span = " to ".join(value_text(whole["axis"], whole[end], units) for end in ("from", "to"))
        yield (
            f"  a part         {held['points']} of the {whole['points']} values of the {label_of(whole['axis'])}, "
            f"along which the state was carried: {span}"
        )
    yield from _string_lines(s)
    yield from _method_lines(s["method"])
    if s["device"] != "cpu":
        yield f"  device         {s['device']}: the numbers are those of the processor"
    if starts := s.get("starts"):
        origin = f"a slice over {' and '.join(s['slice'])}" if s["slice"] else "drawn at random"
        yield f"  starts         {starts} of every operating point, {origin}"
    yield from _unknown_lines(s, units)


def _known_lines(s: Answer, units: str, everything: bool) -> Iterator[str]:
    """How the runs ended, and what is not known from them, or not to be relied on."""
    status = ", ".join(f"{count} {word}" for word, count in s["status"].items())
    yield f"  points         {s['points']}: {status}; {s['settled']} settled"
    for text in s[SHORT].get(units, ()):
        yield f"  observed too shortly: {text.removeprefix(TOO_SHORT).strip()}"
    for text in s[UNCUT].get(units, ()):
        yield f"  NOTHING CUT    {text.removeprefix(DULL).strip()}"
    for text in s[FEW].get(units, ()):
        yield f"  COARSE ROCK    {text.removeprefix(FEW_STATES).strip()}"
    if s["peaks_kept"] is not None and (few := few_peaks(s["peaks_kept"])):
        yield f"  SLOW GROWTH    {few.removeprefix(FEW_PEAKS).strip()}"
    if beyond := s["beyond"]:
        yield f"  BEYOND the validity of the model: {beyond_words(beyond, sum(s['status'].values()))}"
    if back := s["turned_back"]:
        yield f"  TURNED BACK    {turned_back_words(back)}"
    if bend := s[BENT]:
        yield f"  BENDS          {bend.removeprefix(BENDS).strip()}"
    if pulse := s[PULSES]:
        yield f"  PULSE          {pulse.removeprefix(PULSE).strip()}"
    for one in ALL:
        if found := s[one.key]:
            rest = f"{one.rest}: " if one.rest else ""
            yield f"  {one.name:13s}  {rest}{one.words(found)}."
    if words := open_words(s["runs"], "runs"):
        yield f"  not known      {words}: they count neither as a response nor as none"
    if exponents := s.get("exponents"):
        yield (
            f"  exponents      not known of {exponents['unknown']} of {exponents['of']} runs, in which a deviation was "
            "not followed: undetermined where the returns do not repeat"
        )
    if after := s["not_carried"]:
        yield f"  not carried    to {count(after, 'run')}: a run before them in their chain failed"
    if refinement := s.get("refinement"):
        yield f"  refined        {refinement_text(refinement, units)}"
    if trust := s.get("trust"):
        yield from _trust_lines(trust, everything)
    if s["thresholds"]:
        yield printable(f"  labels         with {', '.join(s['thresholds'])}")


def _found_lines(s: Answer, units: str, everything: bool) -> Iterator[str]:
    """Which responses the runs have, where, and how they depend on starts and directions."""
    yield from _response_lines(s)
    if intervals := s.get("intervals"):
        yield from _interval_lines(intervals, units, everything, s["model"])
    if s.get("probabilities"):
        yield from _probability_lines(s, units, everything)
    if "operating_points" in s:
        yield from _attractor_lines(s, units, everything)
    if ends := s.get(ENDS_EARLY):
        from nsdrill.words.stick_slip_words import early_lines  # most files have nothing to say there

        yield from early_lines(ends, units)
    if hysteresis := s.get("hysteresis"):
        swept = [name for name, axis in s["axes"].items() if axis["points"] > 1]
        yield from _hysteresis_lines(hysteresis, swept, units, everything, s["model"])
    if (compared := s.get("compared")) and (words := open_words(compared)):
        yield f"{'  Up' if hysteresis else chr(10) + 'Up'} and down are not compared at all points: {words}."


def _response_lines(s: Answer) -> Iterator[str]:
    """How many points have each response, and how they move."""
    if not s["declares_responses"]:
        yield f"\nResponses: not known, as {UNJUDGED}."
    elif not s["responses"]:
        yield "\nResponses: not known, as the file has no variable response."
    for procedure in s["procedures"]:
        counts = s["responses"].get(procedure, {})
        total = sum(counts.values())
        if total:
            runs = s["points"] // len(s["procedures"])
            known = f", of the {total} of {count(runs, 'point')} that are known" if total < runs else ""
            yield f"\nResponses, {procedure}{known}:"
        for word, number in counts.items():
            yield f"  {in_words(word, s['model']):32s} {number:8d}  {100 * number / total:5.1f} %"
        for name, response in RESPONSE_KINDS.items():
            if kinds := s.get(f"{name}s", {}).get(procedure):
                yield f"  {response.words}: " + ", ".join(f"{count} {in_words(word)}" for word, count in kinds.items())
        if motions := s.get("motions", {}).get(procedure):
            of = "" if counts else f", {procedure}"
            yield f"  motion{of}: " + ", ".join(f"{count} {in_words(word)}" for word, count in motions.items())
        for name, grades in s["severities"][procedure].items():
            if set(grades) - {"none"}:
                graded = in_words(name).removesuffix(" severity")
                counts_text = ", ".join(f"{count} {in_words(word)}" for word, count in grades.items())
                yield f"  severity, {graded}: {counts_text}"


def _unknown_lines(s: Answer, units: str) -> Iterator[str]:
    if "unknowns" not in s:
        return
    yield (f"  samples        {s['samples']} of every operating point; of the uncertain numbers nine in ten lie in")
    for key, values in s["unknowns"].items():
        low, high = (quantity(key).text(values[end], units, 4) for end in ("from", "to"))
        yield f"    {label_of(key):26s} {low} to {high}"


def _probability_lines(s: Answer, units: str, everything: bool) -> Iterator[str]:
    """The probability of each answer at some of the operating points."""
    rows = s["probabilities"]
    histories = {row["history"]: None for row in rows}
    swept = [name for name, axis in s["axes"].items() if axis["points"] > 1]
    names = [name for name in rows[0] if isinstance(rows[0][name], dict)]
    for history in histories:
        history_rows = [row for row in rows if row["history"] == history]
        procedures = [one for one in histories if one != EVERY]
        condition = f", {history}" if len(histories) > 1 else ""
        if history == EVERY:
            condition = f" ({safe_in_words(procedures)}, a response in any procedure)"
        yield (
            f"\nProbability{condition}, in brackets its 95 % interval from "
            f"{samples_text(s['counted'], s['effective'])}:"
        )
        if any(map(open_words, history_rows)):
            yield "  Of the samples that are known; the intervals cover whatever the others would show."
        if found := s["unsettled"]:
            yield f"  NOT SETTLED: {unsettled_words(found)}."
        yield f"  {'':30s}" + "".join(f"{in_words(name, s['model']):>22s}" for name in names)
        most = len(history_rows) if everything else MAX_POINTS
        for row in evenly_spaced(history_rows, most):
            where = point_text({name: row[name] for name in swept}, units) or "the operating point"
            open_runs = open_words(row)
            numbers = "".join(f"{_probability_text(row[name]):>22s}" for name in names)
            yield f"  {where:30s}{numbers}{f'   {open_runs}' if open_runs else ''}"
        if len(history_rows) > most:
            yield f"  ({most} of {len(history_rows)} points; all with --all, or nsdrill plot --kind probability)"


def _probability_text(estimate: dict[str, float]) -> str:
    ends = f"({100 * estimate['low']:.0f} to {100 * estimate['high']:.0f})"
    return f"unknown {ends}" if estimate["probability"] is None else f"{100 * estimate['probability']:.1f} % {ends}"


def _override_lines(overrides: dict[str, str]) -> Iterator[str]:
    if overrides:
        yield f"  overrides      {overrides_text(overrides)}"


def _string_lines(s: Answer) -> Iterator[str]:
    """The drive, unless it is ideal, and the frozen motions."""
    if s.get("drive", "ideal") != "ideal":
        yield f"  drive          {in_words(s['drive'])}"
    if s.get("frozen"):
        yield f"  frozen         {' and '.join(s['frozen'])} motion"


def _method_lines(method: str) -> Iterator[str]:
    """How friction was integrated, unless explicitly."""
    if method != "explicit":
        yield (f"  friction       integrated {' and '.join(f'{word}ly' for word in method.split(' and '))}")


CHECKS = {"tight": "smaller tolerance", "long": "longer run"}


def _trust_lines(trust: Answer, everything: bool) -> Iterator[str]:
    checked = trust["agree"] + trust["features_differ"] + trust["response_differs"] + trust["check_failed"]
    failed_checks = f", {trust['check_failed']} unknown, as a check failed" if trust["check_failed"] else ""
    yield (
        f"  checked        {count(checked, 'point')}: {trust['agree']} agree, {trust['features_differ']} keep their "
        f"response but not their numbers (chaotic, or not settled), {trust['response_differs']} change "
        f"response{failed_checks}"
    )
    for check, failed in trust["failed_checks"].items():
        if failed:
            yield f"    {CHECKS[check]}: {failed} did not end well"
    most = len(trust["changed"]) if everything else MAX_CHANGED
    for row in trust["changed"][:most]:
        change = f"{in_words(row['from'])} -> {in_words(row['to'])}"
        yield f"    {CHECKS[row['check']]:18s}{row['points']:6d}  {change}"
    yield from rest(trust["changed"], most, "kinds of change (all with --all)")


def _interval_lines(intervals: list[Answer], units: str, everything: bool, model: str) -> Iterator[str]:
    yield "\nAlong the sweep:"
    most = len(intervals) if everything else MAX_INTERVALS
    for row in intervals[:most]:
        yield f"  {row['procedure']:5s} {_span(row, units)}  {in_words(row['response'], model)}"
    yield from rest(intervals, most)


def _span(row: Answer, units: str) -> str:
    """The ends of an interval, and how many points it has, as two columns."""
    ends = value_text(row["axis"], row["from"], units)
    if row["points"] > 1:
        ends += f" to {value_text(row['axis'], row['to'], units)}"
    return f"{ends:32s} {count(row['points'], 'point'):>12s}"


def _hysteresis_lines(rows: list[Answer], swept: list[str], units: str, everything: bool, model: str) -> Iterator[str]:
    axis = rows[0]["axis"]
    held = [name for name in (*swept, "start") if name != axis and name in rows[0]]
    ways = "up (deeper) and down (shallower)" if axis == "depth" else "up and down"
    yield f"\nWhere {ways} differ, and in what, along the {label_of(axis)}:"
    previous, most = None, len(rows) if everything else MAX_INTERVALS
    for row in rows[:most]:
        place = ", ".join(
            f"start {row[name]}" if name == "start" else point_text({name: row[name]}, units) for name in held
        )
        if place and place != previous:
            yield f"  at {place}"
        previous = place
        is_response = row["up"] != row["down"]  # else there are none, and features differ
        words = in_words("+".join(row["differs"]), model) if is_response else ", ".join(row["differs"])
        ways_words = f"  up {in_words(row['up'], model)}; down {in_words(row['down'], model)}" if is_response else ""
        yield f"  {_span(row, units)}  {words:22s}{ways_words}{'; open end' if row['open'] else ''}"
    yield from rest(rows, most)
    steps = [row["step"] for row in rows if row["step"] is not None]
    if steps:
        step = value_text(axis, max(steps), units)
        yield f"  The runs change between such an end and the next point, up to {step} away. The true end may lie some"
        yield "  steps away on either side, as motions near a limit grow or decay slowly: branches tell it."
    yield from _by_model_lines(rows[:most], held, units)
    if any(row["open"] for row in rows):
        yield "  An end is open where the sweep ended or a point failed: no run shows a change there."


def _by_model_lines(rows: list[Answer], held: list[str], units: str) -> Iterator[str]:
    """What the model tells beside the ends of stick-slip, once for each setting."""
    told = {}
    for row in rows:
        if (speeds := row.get("by_model")) is not None:
            unstable, lasts, shown = (
                "every speed" if speed is None else value_text("rotary_speed", speed, units)
                for speed in speeds.values()
            )
            where = "".join(f" at {point_text({name: row[name]}, units)}" for name in held)
            unstable = f"at {unstable}" if speeds["unstable_to"] is None else f"below {unstable}"
            steady = "is stable" if speeds["unstable_to"] == 0.0 else f"is unstable {unstable}"
            sticks = "does not last" if speeds["lasts_to"] == 0.0 else f"may last up to {lasts}"
            dry = "" if shown == lasts else f" by dry friction, up to {shown} by that of the runs, which is smoothed"
            told[where] = f"  By the model{where}: steady drilling {steady}, and stick-slip {sticks}{dry}."
    yield from told.values()


def _range_lines(ranges: Answer, units: str, known: int = 0) -> Iterator[str]:
    """A line for each quantity; those say so that fewer than so many points have."""
    for name, r in ranges.items():
        shown = quantity(name)
        unit = shown.unit(units)
        scale = 100.0 if name.endswith("_fraction") else 1.0
        # Adding zero turns -0 into 0.
        low, high = (
            scale * (from_si(r[end], unit) if unit not in ("", "percent") else r[end]) + 0.0 for end in ("min", "max")
        )
        # a terminal may know ASCII only
        sign_shown = "%" if name.endswith("_fraction") else sign(unit).replace("²", "^2")
        of = f" (of {r['values']})" if r.get("values", known) < known else ""
        yield f"  {name:27s} {short(low):>9s} to {short(high):>9s} {sign_shown:8s} {r['meaning']}{of}"


def _trace_lines(file: str, s: Answer, units: str) -> Iterator[str]:
    yield printable(f"{file}: trace of one run. {s.get('title', '')}".rstrip())
    yield from _edited_lines(s)
    if s.get(NOT_CARRIED_RUN):
        yield f"  {NOT_CARRIED_WORDS}"
    yield f"  made           {s.get('created', '')} by nsdrill {s.get('nsdrill_version', '')}"
    yield from _override_lines(s["overrides"])
    for name in dict.fromkeys((*AXES, *s.get("ramps", {}))):
        label = label_of(name)
        if name in s.get("ramps", {}):
            ramp = s["ramps"][name]
            yield f"  {label:14s} ramp: {knots_text(name, ramp['time'], ramp['value'], units)}"
        elif name in s:
            yield f"  {label:14s} {value_text(name, s[name], units, both=True)}"
    if "held_from" in s:
        yield f"  held           {HELD.format(s['held_from'], s['duration'])}"
    if "followed" in s:
        yield printable(f"  log            {s['followed']}")
    for key, value in ((key, value) for key, value in s.get("at", {}).items() if key not in s.get("ramps", {})):
        yield (f"  {label_of(key):14s} {value if isinstance(value, str) else value_text(key, value, units)}")
    yield from _string_lines(s)
    yield from _method_lines(s.get("method", "explicit"))
    if "procedure" in s:
        yield f"  procedure      {s['procedure']}"
    steps = f"{count(s['steps'], 'step')}; " if "steps" in s else ""
    ended = in_words(str(s.get("status", "")))
    of = f" of {s['simulated']:g} s" if s["simulated"] - s["duration"] > 1e-9 * s["simulated"] else ""
    yield (f"  samples        {s['samples']} over {s['duration']:g} s{of}; {steps}ended {ended}")
    if s["coarse"]:
        yield printable(f"\n{s['coarse']}.")
    if s["ranges"]:
        every = f", one every {s['interval']:.4g} s" if s["interval"] else ""
        yield f"\nLeast and greatest of {count(s['samples'], 'sample')}{every}:"
        yield from _range_lines(s["ranges"], units)


def _attractor_lines(summary: Answer, units: str, everything: bool) -> Iterator[str]:
    """A line for each attractor: its share of the starts, with a confidence interval
    where they are drawn at random, and its motion."""
    points, axes = summary["operating_points"], summary["axes"]
    swept = [name for name, axis in axes.items() if axis["points"] > 1]
    rows: list[str] = []
    for point in points:
        where = ", ".join(value_text(name, point[name], units) for name in swept) or "all starts"
        lines = _point_lines(point, units, summary["model"])
        rows += [f"  {where if not number else '':22s} {text}" for number, text in enumerate(lines)]
    yield (f"\nAttractors, by their share of the {'slice' if summary['slice'] else 'starts (95 % interval)'}:")
    most = len(rows) if everything else MAX_ROWS
    for row in rows[:most]:
        yield row.rstrip()
    yield from rest(rows, most, "lines (all with --all)")
    yield from _unsettled_lines(points)


def _point_lines(point: Answer, units: str, model: str) -> list[str]:
    attractors = point["attractors"]
    count_shown = len(attractors) if len(attractors) <= MAX_ATTRACTORS + 1 else MAX_ATTRACTORS
    lines = [_attractor_line(attractor, units, model) for attractor in attractors[:count_shown]]
    if others := attractors[count_shown:]:
        members, share, unsettled = (
            sum(attractor[name] for attractor in others) for name in ("members", "share", "unsettled")
        )
        lines.append(
            f"   {100 * share:5.1f} %  in {len(others)} smaller groups, {count(members, 'start')}, "
            f"{unsettled} unsettled"
        )
    for name in ("failed", "pending"):
        if point[name]:
            lines.append(f"   {point[name]} of {point['starts']} starts {name}: on which attractor is not known")
    if point["doubtful"]:
        lines.append(
            f"   {point['doubtful']} of {point['starts']} starts off speed or on an unstable motion: not known"
        )
    if point["ungrouped"]:
        lines.append(f"   {point['ungrouped']} of the starts not yet grouped")
    return lines


def _attractor_line(attractor: Answer, units: str, model: str) -> str:
    interval = "" if attractor["low"] is None else f" ({100 * attractor['low']:4.1f} to {100 * attractor['high']:5.1f})"
    response = attractor["response"]
    words = [in_words(response, model) if response != "none" else "no critical response"]
    if not described(model).critical:
        words = []
    words += [in_words(attractor[name]) for name in RESPONSE_KINDS if attractor.get(name, "none") != "none"]
    if attractor.get("motion"):
        words.append(in_words(attractor["motion"]) + (f" {attractor['period']}" if attractor["period"] else ""))
    features = attractor["features"]
    for one in described(model).critical.values():
        value = features.get(one.feature)
        if one.measured and value is not None and one.name in response:
            words.append(one.measured.format(one.percent(value)))
    if (radius := features.get("radius_max")) is not None:
        words.append(f"radius {1e3 * radius:.2f} mm" if units == "si" else f"radius {amount(radius, 'in', 3)}")
    if attractor["unsettled"]:
        words.append(f"{attractor['unsettled']} of {attractor['members']} unsettled")
    return f"{attractor['number']:2d} {100 * attractor['share']:5.1f} %{interval}  {', '.join(words)}"


def _unsettled_lines(points: list[Answer]) -> Iterator[str]:
    unsettled = sum(point["unsettled"] for point in points)
    total = sum(point["starts"] - point["failed"] - point["pending"] for point in points)
    if unsettled:
        yield (
            f"  {unsettled} of {total} starts are unsettled: chaotic, or still on their way. A "
            "motion that loses its share as simulation.transient grows is no attractor."
        )
