"""The head of a report: the answer of each file, what bounds it, what to know before
relying on it, and the comparison of two files."""

from __future__ import annotations

import html
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from nsdrill.analysis.window import find_window
from nsdrill.app.answering.answers import (
    contrast,
    results_for_window,
    sensitivity,
    with_lasting_motions,
    with_samples_counted,
)
from nsdrill.app.answering.foreseen import deciding_in
from nsdrill.app.experiment import leaves_a_surface, own_keys, study_of
from nsdrill.data import Answer, Attributes, Results, edited_words
from nsdrill.errors import InputError, NsdrillError, count
from nsdrill.figures import draw, svg
from nsdrill.figures.kinds.window_map import draw_two
from nsdrill.figures.look import Look
from nsdrill.models.choices import as_value, words_along
from nsdrill.models.registry import model_in, responses_in
from nsdrill.text.contrast_text import difference, notes, sentence, side_by_side, tables, thresholds
from nsdrill.text.point import outcome, point_notes
from nsdrill.text.studied import studied
from nsdrill.text.uncertainty_text import conclusion
from nsdrill.variables import SAMPLE
from nsdrill.web.branch_curves import Branches
from nsdrill.web.diagrams import member_dimension
from nsdrill.web.html_page import escaped, image, item_list, paragraph, table, warning_list, without_keys
from nsdrill.web.session import Session
from nsdrill.web.shown import plain, quantity_data
from nsdrill.words import trial_words
from nsdrill.words.answer import chosen_map, is_hint, limit, shown_first, warnings, words_of, would_help
from nsdrill.words.deciding_words import deciding_words
from nsdrill.words.labels import quantity, way_word
from nsdrill.words.values import Formatter, drilling, in_order, percent

if TYPE_CHECKING:
    from nsdrill.figures.picture_kinds import Drawable

MAX_ROWS = 40  # of a table of the comparison


# the limits of validity that the reader of a report must know, who has no documentation
_OF_THE_RATE = (
    "The rate of penetration has default constants, of one bit in one rock, unless the study sets them: use its "
    "ratios, not its feet per hour."
)
_LIMITS = (
    "Not validated against field data: use this to compare, to understand and to ask, not as settings. {rate} "
    "The hole is straight; motors, reamers, jars{without} are left out. Points between those of the map were not run; "
    "nothing is known beyond its edge."
)
LIMITS = _LIMITS.format(rate=_OF_THE_RATE, without=", changes of formation and the surface that the bit cut before")
LIMITS_ON_SURFACE = _LIMITS.format(
    rate="The rate of penetration and the torque follow from the strength of the rock and the wear of the bit.",
    without=" and changes of formation",
)
LIMITS_OF_ANY = (
    "Nothing here says how well the model describes what it stands for. Points between those of the map were not run; "
    "nothing is known beyond its edge."
)


def limits_of(attrs: Attributes) -> str:
    """The limits of validity of a file with these root attributes."""
    if not model_in(attrs).drills:
        return LIMITS_OF_ANY
    limits = LIMITS_ON_SURFACE if leaves_a_surface(attrs) else LIMITS
    return " ".join(filter(None, (limits, deciding_words(deciding_in(attrs), responses_in(attrs)))))


def studied_line(sessions: Sequence[Session]) -> str:
    """What all files have in common of what was studied, as HTML."""
    first, *others = (studied(one.attrs, one.results, one.units) for one in sessions)
    common = [text for text in first if all(text in other for other in others)]
    where = f" in {'both' if len(others) == 1 else 'all'}" if others else ""
    return paragraph(f"Studied{where}: {'; '.join(common)}.") if common else ""


def file_answer(
    results: Results,
    units: str,
    compared: bool = False,
    severity: int | None = None,
    confidence: float | None = None,
    limits: bool = True,
    tried: Answer | None = None,
) -> str:
    """The answer of one file as HTML: the sentence, what lies beside the setting, the first
    warnings, the ``limits`` of validity, the borders, and the picture; without the
    warnings and the picture of one that is ``compared``, which stand with the
    comparison. The window may be given with its trials, as ``tried``."""
    bounds = paragraph(limits_of(results.attrs), "limits") if limits else ""
    if not results.swept:
        results = with_samples_counted(results)
        words, told = paragraph(outcome(results, units, severity), "answer"), warning_list(point_notes(results))
        return words + told + bounds + paragraph(_depends(results, severity, {}))
    try:
        window = tried or find_window(results_for_window(results, severity), severity, confidence)
    except NsdrillError as error:  # four axes, a part of a design
        told = warning_list(filter(None, [edited_words(results.attrs)]))
        return paragraph(f"No window: {str(error).removeprefix('window: ')}", "answer") + told + bounds
    said, warned = words_of(window, units), list(warnings(window, units))
    first = shown_first(warned)
    sentence = said.sentence()
    answered = tried["answer"] if tried else None
    how: dict[str, Any] = {"severity": severity, "confidence": confidence, "tried": answered}
    pieces = [
        paragraph(sentence, "answer"),
        item_list([*said.lines(), *would_help(window, units)], "lines"),
        "" if compared else warning_list(warned[:first]),
        bounds,
        _borders(window, units),
        _trials(window, units),
        paragraph(_doubt(results, window)),
        "" if compared else picture(results, "window", sentence, units, **how),
    ]
    if SAMPLE in results.coords and 0 < len(results.swept) < 3:
        level = window["confidence"]
        pieces.append(picture(results, "probability", "How probable each outcome is", units, confidence=level))
    if not compared and len(warned) > first:
        pieces += [paragraph("What else one must know:"), warning_list(warned[first:])]
    return "".join(pieces)


def picture(data: Drawable, kind: str | None, words: str, units: str, **options: Any) -> str:
    """A picture of the program as vectors, by default that which fits, without the title and the warnings, which the
    page has; a sentence where it cannot be drawn. The ``options`` are those of :func:`nsdrill.figures.draw`."""
    try:
        shown = with_lasting_motions(data) if isinstance(data, Results) else data
        look = Look(title=False, warnings=False)
        return image(svg(draw(shown, kind, units=units, look=look, **options)), words)
    except NsdrillError as error:
        return paragraph(str(error))


def _trials(window: Answer, units: str) -> str:
    """The trials of the answer, and the changes that may help."""
    found = window["answer"].trials
    if found is None:
        return ""
    words = words_of(window, units)
    told = "".join(paragraph(line) for line in (*words.lines(), *would_help(window, units, words.sentence())))
    rows = "\n".join(trial_words.lines(found, words.along, words.fmt))
    return f"{told}<pre>{escaped(rows)}</pre>"


def _borders(window: Answer, units: str) -> str:
    """The recommended point, how far each axis may change, and what lies beyond."""
    fmt, plane = Formatter(units, window["model"]), chosen_map(window)
    best = plane and plane["recommended"]
    if not best:
        return ""
    word = "best hint" if is_hint(window, best) else "recommended"
    rows = []
    for axis in in_order(window["axes"]):
        sides = best["margins"][axis]
        ends = sides["less"]["safe_to"], sides["more"]["safe_to"]
        rows.append(
            (
                fmt.name(axis).capitalize(),
                fmt.value(axis, fmt.settable(axis, best[axis], *ends)),
                fmt.range_inwards(axis, *ends),
                *(limit(axis, sides[side], fmt) for side in ("less", "more")),
            )
        )
    pieces = [table(("", word, "safe", "below that", "above that"), rows)]
    if yields := drilling(best, fmt):
        pieces.append(paragraph(f"There: {yields}."))
    return "".join(pieces)


def _doubt(results: Results, window: Answer) -> str:
    """The probability of the recommended point, and the unknown on which it depends."""
    if window["confidence"] is None:
        return ""
    plane = chosen_map(window)
    recommended = plane and plane["recommended"]
    best = {**plane["at"], **recommended} if plane and recommended else window["most_probable"]
    if not best:
        return _depends(results, window["severity"], {})
    at = {axis: as_value(axis, best[axis]) for axis in (*window["axes"], window["third"]) if axis in best}
    depends = _depends(results, window["severity"], at)
    return (
        f"A run there is safe with a probability of {percent(best)}: in brackets the 95 % interval from "
        f"{window['counted']} samples. At this point {depends[0].lower()}{depends[1:]}"
    )


def _depends(results: Results, severity: int | None, at: dict[str, float]) -> str:
    """On which unknown it depends whether a run at some values of the axes is safe; ""
    without samples."""
    if SAMPLE not in results.coords:
        return ""
    try:
        return without_keys(conclusion(sensitivity(results, severity, at)))
    except NsdrillError as error:
        return f"It is not known on which unknown it depends most: {str(error).removeprefix('sensitivity: ')}"


def comparison(
    results: Sequence[Results],
    names: Sequence[str],
    units: str,
    severity: int | None = None,
    confidence: float | None = None,
) -> tuple[str, str]:
    """Two files against each other: the answer with its warnings, table and picture, and
    the tables of every line, as HTML; ("", the reason) where they cannot be compared."""
    try:
        found = contrast(results[0], results[1], severity, confidence, names)
    except InputError as error:
        return "", paragraph(f"The two windows are not compared: {error}")
    body, head = side_by_side(found, units)[1:], ("", f"a: {names[0]}", f"b: {names[1]}")
    data = [with_lasting_motions(one) for one in results]
    look = Look(title=False, warnings=False)  # the page has the answers and the warnings
    drawn = draw_two(data[0], data[1], names, units, severity, confidence, look)
    first = [
        paragraph(sentence(found, units), "answer"),
        paragraph(difference(found)),
        table(head, body),
        paragraph(f"A response counts from here: {thresholds(found)}."),
        warning_list(notes(found, units)),
        paragraph(limits_of(data[0].attrs), "limits"),
        image(svg(drawn), sentence(found, units)),
    ]
    pieces = []
    for heading, columns, rows in tables(found, units):
        pieces.append(f"<h3>{escaped(heading)}</h3>{table(columns, rows[:MAX_ROWS])}")
        if len(rows) > MAX_ROWS:
            pieces.append(paragraph(f"And {len(rows) - MAX_ROWS} more: nsdrill window A.h5 B.h5 --json."))
    return "".join(first), "".join(pieces)


# How the results of a report were made: the sweep, the machine, versions and digests,
# and the study.


VERSIONS = ("python_version", "numpy_version", "llvmlite", "h5py_version", "compiler", "processor", "model_digest")
Rows = list[tuple[str, str]]


def origin_rows(session: Session) -> Rows:
    """What was run and what computed it, as rows of a table."""
    meta = session.meta()
    rows: Rows = [("File", session.path), ("Model", meta["model"])]
    if session.results is not None:
        rows += _sweep(session, session.results)
    elif session.branches is not None:
        rows += _branches(session, session.branches)
    attrs = session.attrs
    software = [
        f"{name.removesuffix('_version').replace('_', ' ')} {attrs[name]}" for name in VERSIONS if name in attrs
    ]
    version = attrs.get("nsdrill_version", "")
    rows += [
        ("Other than the defaults", "; ".join(map(": ".join, own_keys(attrs).items())) or "nothing"),
        ("Changed by --set", "; ".join(meta["overrides"]) or "nothing"),
        ("Made", f"{attrs.get('created', '')} by nsdrill {version}"),
        ("With", ", ".join(software)),
        ("Study", f"SHA-256 {attrs.get('study_sha256', '')}"),
    ]
    return rows


def study_details(session: Session) -> str:
    """The study with every key, as HTML that is opened with a click."""
    text = html.escape(study_of(session.path, session.attrs))
    return f"<details><summary>The study, every key</summary><pre>{text}</pre></details>"


def _sweep(session: Session, results: Results) -> Rows:
    rows: Rows = []
    for name in results.certain_axes:
        axis = quantity_data(name, session.units)
        values = results.coords[name] / quantity(name, session.units).scale
        if words_along(name):
            words = ", ".join(quantity(name).value(value) for value in results.coords[name])
            rows.append((axis["words"], words))
            continue
        span = f"{values[0]:.6g} to {values[-1]:.6g}" if len(values) > 1 else f"{values[0]:.6g}"
        count = f", {len(values)} values" if len(values) > 1 else ""
        rows.append((axis["words"], f"{span} {axis['unit']}".strip() + count))
    procedures = results.procedures
    carried = [way_word(procedure, results.attrs) for procedure in procedures if procedure != "same"]
    states = [f"carried {' and '.join(carried)}"] if carried else []
    states += ["the same at every start"] if "same" in procedures else []
    rows.append(("State", "; and ".join(states)))
    if member := member_dimension(results):
        count = f"{len(results.coords[member])} of every operating point"
        rows.append((f"{member.capitalize()}s", count))
    simulation = session.study.simulation
    times = f"{simulation.transient:g} s, then observed for {simulation.observe:g} s"
    return [*rows, ("Each run", times)]


def _branches(session: Session, branches: Branches) -> Rows:
    x = quantity(branches.along, session.units)
    ends = [float(branches.attrs.get(name, np.nan)) for name in ("continue_from", "continue_to")]
    if not np.all(np.isfinite(ends)):
        ends = [float(branches.numbers.min()), float(branches.numbers.max())]
    rows: Rows = [(f"Along {plain(x.words).lower()}", " to ".join(map(x.value, ends)))]
    for name in model_in(branches.attrs).operation.names():
        if name != branches.along and name in branches.features:
            shown = quantity(name, session.units)
            rows.append((plain(shown.words), shown.value(float(branches.features[name][0]))))
    return [*rows, ("Points", f"{len(branches.label)} on {count(len(branches.sizes), 'branch')}")]
