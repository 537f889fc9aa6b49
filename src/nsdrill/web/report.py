"""The report: results as one self-contained page of HTML, to send, to read and to
print. The answer stands first, then what it rests on; at the end how it was made.
"""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Sequence
from itertools import product
from pathlib import Path

import numpy as np

from nsdrill.analysis.bifurcations import END, REGULAR
from nsdrill.analysis.planes import stretches
from nsdrill.analysis.safety import known_runs
from nsdrill.app.experiment import provenance
from nsdrill.app.simulating.motions import SimulatedMotion
from nsdrill.data import Answer, Array, Results, Trace, edited_words, evenly_spaced
from nsdrill.errors import InputError, NsdrillError, count
from nsdrill.figures import cut
from nsdrill.figures.kinds.branch_diagram import parts_of
from nsdrill.figures.picture_kinds import longest
from nsdrill.models.choices import words_along
from nsdrill.models.registry import model_in, showing
from nsdrill.records import dataclass
from nsdrill.store import open_branches
from nsdrill.variables import OK, SAMPLE
from nsdrill.web.branch_curves import Branches, mismatch
from nsdrill.web.diagrams import map_axes, member_dimension, place_of
from nsdrill.web.html_page import Page, escaped, paragraph, table, warning_list
from nsdrill.web.moving import command, differing, ended, point_rows, stored_outcome, stored_values
from nsdrill.web.report_head import (
    comparison,
    file_answer,
    limits_of,
    origin_rows,
    picture,
    studied_line,
    study_details,
)
from nsdrill.web.session import Session
from nsdrill.web.shown import label_words, plain
from nsdrill.words.labels import quantity

MOTION_SECONDS, MOTION_SAMPLE = 15.0, 0.01
MAX_DIAGRAMS = 4  # one for each value of a second axis; with more values a map is drawn


@dataclass(frozen=True)
class Part:
    """One file of the report: its ``session``, and ``summaries``: headings with lines
    of text; and its ``window`` where trials of it were run."""

    session: Session
    summaries: Sequence[tuple[str, Sequence[str]]]
    window: Answer | None = None


def report(
    parts: Sequence[Part],
    command: str,
    motions: int,
    severity: int | None = None,
    confidence: float | None = None,
    labels: Sequence[str] | None = None,
) -> str:
    """The page as HTML. ``command`` is the command line that writes it again; of each
    file up to ``motions`` points are drawn moving. ``severity`` and ``confidence`` are
    those of the windows; ``labels`` are names in place of those of the files."""
    page = Page()
    names = list(labels) if labels else _names([part.session.path for part in parts])
    letters = "ab" if len(parts) == 2 else [str(i) for i in range(1, len(parts) + 1)]
    titles = [part.session.title for part in parts]
    is_one = len(set(titles)) == 1
    page.add(
        f"<header><div><h1>{escaped(titles[0] if is_one else ' and '.join(titles))}</h1>",
        f"<p>{escaped(', '.join(map(': '.join, zip(letters, names, strict=True))))}</p>"
        if len(parts) > 1
        else f"<p>{escaped(names[0])}</p>",
        f"</div></header><main>{studied_line([part.session for part in parts])}",
    )
    tables = _add_common(page, parts, names, severity, confidence) if len(parts) > 1 else ""
    for number, part in enumerate(parts):
        page.add(f'<section class="first" id="answer{number}">')
        if len(parts) > 1:
            page.add(f"<h2>{letters[number]}: {escaped(names[number])}</h2>")
            page.add("" if is_one else f"<p>{escaped(titles[number])}</p>")
        with showing(part.session.attrs):
            _add_answer(page, part, bool(tables), severity, confidence, len(parts) == 1)
        page.add("</section>")
    page.add(tables)
    if len(parts) > 1:
        rows = [
            f'<li><a href="#file{i}">{escaped(name)}: {escaped(title)}</a></li>'
            for i, (name, title) in enumerate(zip(names, titles, strict=True))
        ]
        page.add(f"<h2>What it rests on</h2><ol>{''.join(rows)}</ol>")
    stems = _stems([part.session.path for part in parts])
    made: list[tuple[str, list[str]]] = []
    for number, part in enumerate(parts):
        page.add(f'<section id="file{number}">')
        if len(parts) > 1:
            page.add(f"<h2>{escaped(names[number])}: {escaped(titles[number])}</h2>")
        with showing(part.session.attrs):
            made.append((names[number], _add_file(page, part, motions, stems[number])))
        page.add("</section>")
    _add_made(page, parts, made)
    page.add(f"<p>This page: <code>{escaped(command)}</code></p></section></main>")
    return page.document(titles[0])


def _add_made(page: Page, parts: Sequence[Part], made: Sequence[tuple[str, list[str]]]) -> None:
    """How each file was made, and the command lines that make it again, by its name."""
    page.add('<section id="made"><h2>How this was made</h2>')
    for part, (name, commands) in zip(parts, made, strict=True):
        page.add(f"<h3>{escaped(name)}</h3>" if len(parts) > 1 else "")
        page.add(
            table((), origin_rows(part.session)),
            f"<p>To make it again:</p><pre>{escaped(chr(10).join(commands))}</pre>",
            study_details(part.session),
        )


def _add_answer(
    page: Page, part: Part, compared: bool, severity: int | None, confidence: float | None, limits: bool
) -> None:
    session = part.session
    if session.results is not None:
        page.add(file_answer(session.results, session.units, compared, severity, confidence, limits, part.window))
    elif (branches := session.branches) is not None:
        page.add(warning_list(filter(None, [edited_words(branches.attrs)])))
        x = quantity(branches.along, session.units)
        ends = " to ".join(x.value(float(end(branches.numbers))) for end in (np.min, np.max))
        special = int(np.count_nonzero((branches.label != REGULAR) & (branches.label != END)))
        drills = model_in(branches.attrs).drills
        has = "a string has: for a window run a sweep" if drills else "is there: for that run a sweep"
        page.add(
            f'<p class="answer">{count(len(branches.sizes), "branch")} of motions along the '
            f"{escaped(plain(x.words).lower())}, {escaped(ends)}, with {count(special, 'special point')}. "
            f"Branches say which motions there are and where they lose their stability, not "
            f"which of them {has}.</p>"
        )


def _add_common(
    page: Page, parts: Sequence[Part], names: Sequence[str], severity: int | None, confidence: float | None
) -> str:
    """The comparison of two sweeps, or why there is none, with the limits of validity;
    returns its long tables, "" where there is none."""
    results = [part.session.results for part in parts if part.session.results is not None]
    first, tables = "", paragraph("Two sweeps are compared; other files stand side by side, each with its answer.")
    if len(results) == len(parts) == 2:
        first, tables = comparison(results, names, parts[0].session.units, severity, confidence)
    limits = paragraph(limits_of(parts[0].session.attrs), "limits")
    page.add(f'<section class="first" id="common">{first or tables + limits}</section>')
    return first and f'<section id="compared"><h2>The two compared, line by line</h2>{tables}</section>'


def _names(paths: Sequence[str]) -> list[str]:
    """The names of the files; where two are equal, with their folders."""
    names = [Path(path).name for path in paths]
    return [name if names.count(name) == 1 else path for name, path in zip(names, paths, strict=True)]


def _stems(paths: Sequence[str]) -> list[str]:
    """The beginnings of the file names in the command lines: the name of each file,
    with a number where two are equal."""
    names = [Path(path).name.partition(".")[0] or "results" for path in paths]
    return [name if names.count(name) == 1 else f"{name}{number}" for number, name in enumerate(names, start=1)]


def _add_file(page: Page, part: Part, motions: int, stem: str) -> list[str]:
    """The section of one file: diagrams, motions, numbers. Returns the command lines
    that make it again; the names of the files that they write begin with ``stem``."""
    session = part.session
    results = session.results
    if results is None:
        if session.branches is None:
            raise InputError(f"{session.path}: found a study; allowed: results. Run it first: nsdrill run.")
        return _add_branches(page, session, session.branches, stem)
    places = representatives(results, motions)
    page.add("<h3>Diagrams</h3>")
    _add_diagrams(page, session, results)
    study, again = (shlex.quote(f"{stem}_{name}") for name in ("study.yaml", "again.h5"))
    commands = [f"nsdrill show {shlex.quote(session.path)} --study > {study}", f"nsdrill run {study} -o {again}"]
    if places:
        page.add("<h3>Motions</h3>", "<p>One point of each kind that is common, run once more.</p>")
        for number, place in enumerate(places, start=1):
            trace = shlex.quote(f"{stem}_trace{number}.h5")
            commands.append(_add_motion(page, session, place).replace(" -o trace.h5", f" -o {trace}"))
    for heading, lines in part.summaries:
        page.add(f"<h3>{escaped(heading)}</h3>", f"<pre>{escaped(chr(10).join(lines))}</pre>")
    return commands


def _add_diagrams(page: Page, session: Session, results: Results) -> None:
    """The diagrams or maps of the responses, along or over the axes that are swept; of
    several starts or samples the picture that fits. Along the number of branches, these
    over the peaks."""
    names = sorted(results.swept, key=lambda name: (bool(words_along(name)), -len(results.coords[name])))
    units, member = session.units, member_dimension(results)
    if member == SAMPLE and 0 < len(names) < 3:
        page.add("<p>The probabilities are with the answer, above.</p>")
    elif member:
        page.add(picture(results, None, f"All {member}s", units))
    elif not names:
        page.add("<p>A single operating point.</p>")
    elif len(names) > 1 and len(results.coords[names[1]]) > MAX_DIAGRAMS:
        x, y, *others = map_axes(results)
        for held, where in _held_values(results, others, units):
            page.add(f"<h4>{escaped(where)}</h4>" if where else "")
            words = f"Responses over {x} and {y} {where}"
            page.add(picture(results, "map", words, units, at=_values(results, held)))
    else:
        for held, where in _held_values(results, names[1:], units):
            page.add(f"<h4>{escaped(where)}</h4>" if where else "")
            page.add(_along(session, results, names[0], held, f"Peaks along {names[0]} {where}"))


def _along(session: Session, results: Results, axis: str, held: dict[str, int], words: str) -> str:
    """The diagram along an axis; and below it branches of the file that lies over the
    results, with the peaks between their ends, or why they do not belong there."""
    branches, units, at = session.branches, session.units, _values(results, held)
    drawn = picture(results, None, words, units, at=at)
    if branches is None:
        return drawn
    if why := mismatch(branches, results, axis, place_of(results, held, 0), units):
        return drawn + paragraph(why)
    data = open_branches(branches.path)
    return drawn + picture(data, None, f"Branches over the {words.lower()}", units, over=cut(results, at))


def _values(results: Results, held: dict[str, int]) -> dict[str, float]:
    """The values [SI] of the axes that are held at these points."""
    return {name: float(results.coords[name][point]) for name, point in held.items()}


def _add_branches(page: Page, session: Session, branches: Branches, stem: str) -> list[str]:
    """The section of a file of branches: their curves and special points. Returns the
    command lines that make it again."""
    x = quantity(branches.along, session.units)
    page.add("<h3>Branches</h3>")
    page.add(picture(open_branches(branches.path), None, f"Branches along {branches.along}", session.units))
    rows: list[tuple[str, str]] = []
    special = ~np.isin(branches.label, (REGULAR, END))
    for number, (part, name, end) in enumerate(
        zip(parts_of(branches.sizes), branches.names, branches.ends, strict=True)
    ):
        numbers = branches.numbers[part]
        rows.append((f"Branch {number}", f"{name}, {x.value(numbers.min())} to {x.value(numbers.max())}; ends: {end}"))
        for point in (part.start + np.flatnonzero(special[part])).tolist():
            label = int(branches.label[point])
            words = f"{branches.meanings.get(label, str(label))} at {x.value(float(branches.numbers[point]))}"
            rows.append(("", f"{words} (point {point})"))
    page.add(table((), rows))
    file, study, again, orbit = map(
        shlex.quote, (session.path, *(f"{stem}_{name}" for name in ("study.yaml", "again.h5", "orbit.h5")))
    )
    return [
        f"nsdrill show {file} --study > {study}",
        "# where the branches were seeded from results, with --seeds FILE",
        f"nsdrill branches {study} -o {again}",
        "# the motion of a point, whose number may be any of the table",
        f"nsdrill simulate {study} --orbit {file} --point 0 -o {orbit}",
    ]


def _held_values(results: Results, others: Sequence[str], units: str) -> Iterator[tuple[dict[str, int], str]]:
    """All combinations of some values of the ``others`` of the axes, as indices by axis
    and in words."""
    values = [evenly_spaced(range(len(results.coords[name])), MAX_DIAGRAMS) for name in others]
    for index in product(*values):
        words = [
            f"{plain(quantity(name, units).words)}: {quantity(name, units).value(float(results.coords[name][i]))}"
            for name, i in zip(others, index, strict=True)
        ]
        yield dict(zip(others, (int(i) for i in index), strict=True)), ", ".join(words)


def _add_motion(page: Page, session: Session, place: tuple[int, ...]) -> str:
    """Add the motion of one point; return the command line that computes it, "" where
    the run failed."""
    try:
        motion, trace = motion_of(session, place)
    except NsdrillError as error:
        page.add(f"<p>{escaped(str(error))}</p>")
        return ""
    title = ", ".join(f"{name} {value}" for name, value in point_rows(session, place))
    labels = label_words(stored_values(session, place), trace.attrs, stored_outcome(session, place))
    page.add(f"<figure><figcaption><strong>{escaped(title)}</strong><br>{escaped(', '.join(labels))}<br>")
    if why := ended(motion):
        page.add(escaped(f"It ended early: {why}."))
    else:
        differs = "; ".join(differing(session, motion)) or "nothing that the file records"
        ending = "in the stored state, bit for bit." if motion.same_bits else f"elsewhere. What differs: {differs}."
        page.add(escaped(f"Run again for this page, it ends {ending}"))
    page.add("</figcaption>", picture(trace, None, f"The motion at {title}", session.units), "</figure>")
    return command(session, place)


def motion_of(session: Session, place: tuple[int, ...]) -> tuple[SimulatedMotion, Trace]:
    """The last :data:`MOTION_SECONDS` of the motion of a stored point, run again, and their
    trace."""
    with session.computing():
        motion = session.motions.replay(place, MOTION_SECONDS, MOTION_SAMPLE)
        study = session.motions.stored(place)
    axes = {name: getattr(study.operation, name) for name in study.model.axes}
    return motion, Trace(motion.time, motion.variables, {**provenance(study, "report"), **axes})


def representatives(results: Results, most: int) -> list[tuple[int, ...]]:
    """A point for each combination of responses, the most frequent first, at most
    ``most``. It is the middle of the longest interval of settled points with these
    responses along the longest axis."""
    response, valid = results["response"], (results["status"] == OK) & known_runs(results)
    settled = valid & (results["settled"] == 1) if "settled" in results.variables else valid
    axis = results.grid.index(longest(results)) if results.swept else len(results.grid) - 1
    codes, counts = np.unique(response[valid], return_counts=True)
    places = []
    for code in codes[np.argsort(-counts, kind="stable")][:most]:
        mask = settled & (response == code)
        mask = mask if mask.any() else valid & (response == code)
        places.append(_middle_of_longest(np.moveaxis(mask, axis, -1), axis))
    return places


def _middle_of_longest(mask: Array, axis: int) -> tuple[int, ...]:
    """The index of the middle of the longest run of True along the last axis of
    ``mask``, which is ``axis`` of the grid."""
    runs = [(row, *ends) for row in np.ndindex(*mask.shape[:-1]) for ends in stretches(mask[row])]
    others, first, last = max(runs, key=lambda run: run[2] - run[1])
    return (*others[:axis], (first + last) // 2, *others[axis:])
