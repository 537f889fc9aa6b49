"""The report: results as one self-contained page of HTML, to send, to read and to
print. The answer stands first, then what it rests on; at the end how it was made.

Text and tables are plain HTML. The scripts of the explorer draw diagrams and motions in
the browser, from the same bodies (:mod:`nsdrill.web.packet`), which the page holds in
base64.
"""

from __future__ import annotations

import base64
import hashlib
import html
import shlex
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from nsdrill.analysis.bifurcations import END, REGULAR
from nsdrill.analysis.outcome import outcome
from nsdrill.data import Array, Results, json_text
from nsdrill.errors import InputError, NsdrillError
from nsdrill.models.leaves import words_along
from nsdrill.models.registry import drawn_in
from nsdrill.plot.labels import quantity
from nsdrill.plot.slices import Line, edges
from nsdrill.variables import INFERRED, OK, SAMPLE
from nsdrill.web.answers import LIMITS, comparison, file_answer, paragraph
from nsdrill.web.areas import (
    MAX_MAPS,
    TitledReply,
    basin_area,
    evenly_spaced,
    probability_areas,
    probability_lines,
    verdict_areas,
)
from nsdrill.web.branches import Branches
from nsdrill.web.diagrams import Reply, axis_data, longest, member_dimension, plane
from nsdrill.web.origin import origin_rows, study_details
from nsdrill.web.packet import packed
from nsdrill.web.server import static
from nsdrill.web.session import Session
from nsdrill.web.shown import plain, quantity_data, response_styles

MOTION_SECONDS, MOTION_SAMPLE = 15.0, 0.01
MAX_DIAGRAMS = MAX_MAPS  # one for each value of a second axis; with more values a map is drawn
MAX_PEAKS = 60_000  # of one diagram


@dataclass(frozen=True)
class Part:
    """One file of the report: its ``session``, and ``summaries``: headings with lines
    of text."""

    session: Session
    summaries: Sequence[tuple[str, Sequence[str]]]


@dataclass
class _Page:
    """The page under construction: pieces of HTML, and the bodies that its drawings
    refer to by number."""

    pieces: list[str] = field(default_factory=list)
    bodies: list[bytes] = field(default_factory=list)

    def add(self, *pieces: str) -> None:
        self.pieces.extend(pieces)

    def add_drawing(self, kind: str, replies: Sequence[Reply], more: Mapping[str, Any], words: str) -> None:
        """An element in which the script draws ``replies``; ``words`` are its label for
        screen readers."""
        first = len(self.bodies)
        self.bodies.extend(packed(*reply) for reply in replies)
        data = json_text({"kind": kind, "bodies": list(range(first, len(self.bodies))), **more})
        self.add(f'<div class="drawing" role="group" aria-label="{_text(words)}" data-draw="{_text(data)}"></div>')


def report(
    parts: Sequence[Part], command: str, motions: int, severity: int | None = None, confidence: float | None = None
) -> str:
    """The page as HTML. ``command`` is the command line that writes it again; of each
    file up to ``motions`` points are drawn moving. ``severity`` and ``confidence`` are
    those of the windows."""
    page, units = _Page(), parts[0].session.units
    names = _names([part.session.path for part in parts])
    letters = "ab" if len(parts) == 2 else [str(i) for i in range(1, len(parts) + 1)]
    titles = [_title(part.session) for part in parts]
    is_one = len(set(titles)) == 1
    page.add(
        f"<header><div><h1>{_text(titles[0] if is_one else ' and '.join(titles))}</h1>",
        f"<p>{_text(', '.join(map(': '.join, zip(letters, names, strict=True))))}</p>"
        if len(parts) > 1
        else f"<p>{_text(names[0])}</p>",
        "</div></header><main>",
    )
    tables = _add_comparison(page, parts, names, units, severity, confidence)
    for number, part in enumerate(parts):
        page.add(f'<section class="first" id="answer{number}">')
        if len(parts) > 1:
            page.add(f"<h2>{letters[number]}: {_text(names[number])}</h2>")
            page.add("" if is_one else f"<p>{_text(titles[number])}</p>")
        letter = letters[number] if len(parts) > 1 else ""
        is_first = number == 0 and not tables
        _add_answer(page, part.session, units, not tables, letter, severity, confidence, is_first)
        page.add("</section>")
    page.add(tables)
    if len(parts) > 1:
        rows = [
            f'<li><a href="#file{i}">{_text(name)}: {_text(title)}</a></li>'
            for i, (name, title) in enumerate(zip(names, titles, strict=True))
        ]
        page.add(f"<h2>What it rests on</h2><ol>{''.join(rows)}</ol>")
    stems = _stems([part.session.path for part in parts])
    made: list[tuple[str, list[str]]] = []
    for number, part in enumerate(parts):
        page.add(f'<section id="file{number}">')
        if len(parts) > 1:
            page.add(f"<h2>{_text(names[number])}: {_text(titles[number])}</h2>")
        made.append((names[number], _add_file(page, part, motions, stems[number])))
        page.add("</section>")
    page.add('<section id="made"><h2>How this was made</h2>')
    for part, (name, commands) in zip(parts, made, strict=True):
        page.add(f"<h3>{_text(name)}</h3>" if len(parts) > 1 else "")
        page.add(
            _table(origin_rows(part.session)),
            f"<p>To make it again:</p><pre>{_text(chr(10).join(commands))}</pre>",
            study_details(part.session),
        )
    page.add(f"<p>This page: <code>{_text(command)}</code></p></section></main>")
    return _document(titles[0], page)


def _add_answer(
    page: _Page,
    session: Session,
    units: str,
    is_drawn: bool,
    letter: str,
    severity: int | None,
    confidence: float | None,
    limits: bool,
) -> None:
    if session.results is not None:
        results = session.results
        page.add(file_answer(results, units, is_drawn, letter, severity, confidence, limits))
    elif (branches := session.branches) is not None:
        x = quantity(branches.along, units)
        ends = " to ".join(x.value(float(end(branches.numbers))) for end in (np.min, np.max))
        special = np.count_nonzero((branches.label != REGULAR) & (branches.label != END))
        page.add(
            f'<p class="answer">{len(branches.sizes)} branches of motions along the '
            f"{_text(plain(x.words).lower())}, {_text(ends)}, with {special} special points. "
            "Branches say which motions there are and where they lose their stability, not "
            "which of them a string has: for a window run a sweep.</p>"
        )


def _add_comparison(
    page: _Page, parts: Sequence[Part], names: Sequence[str], units: str, severity: int | None, confidence: float | None
) -> str:
    """The first lines of the comparison of two results, and the limits of validity;
    returns its tables."""
    results = [part.session.results for part in parts]
    if len(results) != 2 or results[0] is None or results[1] is None:
        return ""
    pair = [results[0], results[1]]
    first, tables = comparison(pair, names, units, severity, confidence)
    if not first:
        page.add(tables)
        return ""
    page.add(f'<section class="first">{first}{paragraph(LIMITS, "limits")}</section>')
    return f'<section id="compared"><h2>The two compared</h2>{tables}</section>'


def _title(session: Session) -> str:
    """The title of the study in the words of the user; of one without a title the name
    of the file."""
    return " ".join(session.study.title.split()) or Path(session.path).name


def _names(paths: Sequence[str]) -> list[str]:
    """The names of the files; where two are equal, with their folders."""
    names = [Path(path).name for path in paths]
    return [name if names.count(name) == 1 else path for name, path in zip(names, paths, strict=True)]


def _stems(paths: Sequence[str]) -> list[str]:
    """The beginnings of the file names in the command lines: the name of each file,
    with a number where two are equal."""
    names = [Path(path).name.partition(".")[0] or "results" for path in paths]
    return [name if names.count(name) == 1 else f"{name}{number}" for number, name in enumerate(names, start=1)]


def _add_file(page: _Page, part: Part, motions: int, stem: str) -> list[str]:
    """The section of one file: diagrams, motions, numbers. Returns the command lines
    that make it again; the names of the files that they write begin with ``stem``."""
    session = part.session
    results = session.results
    if results is None:
        if session.branches is None:
            raise InputError(f"{session.path}: found a study; allowed: results. Run it first: nsdrill run.")
        return _add_branches(page, session, session.branches, stem)
    places = representatives(results, motions)
    page.add("<h3>Diagrams</h3>", '<p class="screen">Point at a diagram for its numbers.</p>')
    _add_diagrams(page, session, results)
    study, again = (shlex.quote(f"{stem}_{name}") for name in ("study.yaml", "again.h5"))
    commands = [f"nsdrill show {shlex.quote(session.path)} --study > {study}", f"nsdrill run {study} -o {again}"]
    if places:
        page.add("<h3>Motions</h3>", "<p>One point of each kind that is common, run once more.</p>")
        for number, place in enumerate(places, start=1):
            trace = shlex.quote(f"{stem}_trace{number}.h5")
            commands.append(_add_motion(page, session, place).replace(" -o trace.h5", f" -o {trace}"))
    for heading, lines in part.summaries:
        page.add(f"<h3>{_text(heading)}</h3>", f"<pre>{_text(chr(10).join(lines))}</pre>")
    return commands


def _add_diagrams(page: _Page, session: Session, results: Results) -> None:
    units = session.units
    names = sorted(results.swept, key=lambda name: (bool(words_along(name)), -len(results.coords[name])))
    more = {"responses": response_styles()}
    if results.slice and not names:
        _add_maps(page, [basin_area(results, units)])
        return
    if not names:
        page.add("<p>A single operating point.</p>")
        return
    if member_dimension(results):
        _add_members(page, session, results)
    elif len(names) > 1 and len(results.coords[names[1]]) > MAX_DIAGRAMS:
        x, y = names[0], names[1]
        procedures = [str(name) for name in results.coords["procedure"]]
        for held, where in _held_values(results, names[2:], units):
            for number, procedure in enumerate(procedures):
                words = ", ".join(
                    ["Responses", *([procedure] if len(procedures) > 1 else []), *([where] if where else [])]
                )
                page.add(f"<h4>{_text(words)}</h4>")
                page.add_drawing(
                    "map", [plane(results, units, "response", x, y, held)], {**more, "procedure": number}, words
                )
    else:
        for held, words in _held_values(results, names[1:], units):
            if words:
                page.add(f"<h4>{_text(words)}</h4>")
            panels = drawn_in(results.attrs).panels
            replies = [
                _thinned(session.diagram({"y": p.peaks, "x": names[0], "held": held}))
                for p in panels
                if p.greatest in results.variables
            ]
            page.add_drawing("lines", replies, more, f"Peaks along {names[0]} {words}")
    if len(names) == 2 and not member_dimension(results):
        _add_maps(page, verdict_areas(results, units, names[0], names[1]))


def _add_maps(page: _Page, areas: Iterable[TitledReply]) -> None:
    """Maps with their titles."""
    for words, reply in areas:
        page.add(f"<h4>{_text(words)}</h4>")
        page.add_drawing("map", [reply], {"responses": response_styles(), "procedure": 0}, words)


def _add_branches(page: _Page, session: Session, branches: Branches, stem: str) -> list[str]:
    """The section of a file of branches: their curves and special points. Returns the
    command lines that make it again."""
    x = quantity(branches.along, session.units)
    page.add("<h3>Branches</h3>")
    panels = [p for p in drawn_in(branches.attrs).panels if p.greatest in branches.features]
    replies = [session.diagram({"y": p.peaks}) for p in panels]
    page.add_drawing("lines", replies, {"responses": response_styles()}, f"Branches along {branches.along}")
    first = 0
    branch_rows: list[tuple[str, str]] = []
    for number, (size, name, end) in enumerate(
        zip(branches.sizes.tolist(), branches.names, branches.ends, strict=True)
    ):
        part = branches.numbers[first : first + size]
        branch_rows.append((f"Branch {number}", f"{name}, {x.value(part.min())} to {x.value(part.max())}; ends: {end}"))
        for point in range(first, first + size):
            if (label := int(branches.label[point])) not in (REGULAR, END):
                words = f"{branches.meanings.get(label, str(label))} at {x.value(float(branches.numbers[point]))}"
                branch_rows.append(("", f"{words} (point {point})"))
        first += size
    page.add(_table(branch_rows))
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
    values = [evenly_spaced(len(results.coords[name])) for name in others]
    for index in product(*values):
        words = [
            f"{plain(quantity(name, units).words)}: {quantity(name, units).value(float(results.coords[name][i]))}"
            for name, i in zip(others, index, strict=True)
        ]
        yield dict(zip(others, (int(i) for i in index), strict=True)), ", ".join(words)


def _thinned(reply: Reply) -> Reply:
    """A diagram with at most about :data:`MAX_PEAKS` peaks: of each point the last
    ones, or the first ones where some motions are constant."""
    head, columns = reply
    values = columns["values"]
    keep = max(1, int(MAX_PEAKS / max(1, values.shape[0] * values.shape[1])))
    return head, {**columns, "values": values[..., :keep] if columns["constant"].any() else values[..., -keep:]}


def _add_members(page: _Page, session: Session, results: Results) -> None:
    """The probabilities of samples, or the diagram of several starts with a line for
    each start."""
    units, axis, member = session.units, longest(results), member_dimension(results)
    if member == SAMPLE and len(results.swept) == 2:
        x, y = sorted(results.swept, key=lambda name: -len(results.coords[name]))
        _add_maps(page, probability_areas(results, units, x, y))
        return
    if member == SAMPLE and len(results.swept) == 1:
        words = f"Probabilities along {axis}"
        page.add_drawing("lines", [probability_lines(results, units, axis)], {"responses": response_styles()}, words)
        return
    if len(results.swept) != 1:
        page.add(f"<p>Several {member}s over several axes: see the numbers below.</p>")
        return
    place = [0 if name not in (axis, member) else slice(None) for name in results.grid]
    series = Line(results, axis, tuple(place))
    outcomes = np.swapaxes(outcome(series["status"], series["response"]), 0, 1)
    x_edges = edges(series.x) / quantity(axis, units).scale
    replies: list[Reply] = []
    for panel in drawn_in(results.attrs).panels:
        if panel.greatest not in results.variables:
            continue
        values = np.swapaxes(np.asarray(series[panel.greatest], dtype=float), 0, 1)[..., np.newaxis]
        head = {
            "x": axis_data(results, axis, units),
            "y": quantity_data(panel.greatest, units),
            "hover_quantities": [],
            "hysteresis": [],
            "procedures": [f"{member} {i}" for i in range(len(outcomes))],
            "lines": [],
            "edges": [x_edges[0], x_edges[-1]],
        }
        replies.append(
            (
                head,
                {
                    "values": values / quantity(panel.greatest, units).scale,
                    "outcome": outcomes,
                    "constant": np.zeros(outcomes.shape, bool),
                },
            )
        )
    page.add_drawing(
        "lines", replies, {"responses": response_styles()}, f"Greatest values along {axis}, of every {member}"
    )


def _add_motion(page: _Page, session: Session, place: tuple[int, ...]) -> str:
    """Add the motion of one point; return the command line that computes it, "" where
    the run failed."""
    try:
        head, columns = session.replay({"place": list(place), "seconds": MOTION_SECONDS})
    except NsdrillError as error:
        page.add(f"<p>{_text(str(error))}</p>")
        return ""
    step = max(1, round(MOTION_SAMPLE / head["interval"])) if head["interval"] else 1
    drawn = session.meta()["drawn"]
    needed = {
        "time",
        "x",
        "y",
        "bit angle",
        "wall_force",
        *drawn["histories"],
        *(n for pair in drawn["planes"] for n in pair),
    }
    shown = {name: values[::step] for name, values in columns.items() if name in needed}
    head |= {
        "interval": head["interval"] * step,
        "samples": len(shown["time"]),
        "features": [],
        "values": {},
        "state": None,
    }
    head["channels"] = [channel for channel in head["channels"] if channel["name"] in shown]
    title = ", ".join(f"{a} {b}" for a, b in head["from"])
    page.add(f"<figure><figcaption><strong>{_text(title)}</strong><br>{_text(', '.join(head['labels']))}<br>")
    if head["ended"]:
        page.add(_text(f"It ended early: {head['ended']}."))
    else:
        ending = "the stored state, bit for bit" if head["same_bits"] else f"not the stored state: {head['differing']}"
        page.add(_text(f"Run again for this page, it ends in: {ending}."))
    page.add("</figcaption>")
    page.add_drawing("motion", [(head, shown)], {"drawn": drawn}, f"The motion at {title}")
    page.add("</figure>")
    return str(head["command"])


def representatives(results: Results, most: int) -> list[tuple[int, ...]]:
    """A point for each combination of responses, the most frequent first, at most
    ``most``. It is the middle of the longest interval of settled points with these
    responses along the longest axis."""
    status, response = results["status"], results["response"]
    valid = (status == OK) & (status != INFERRED)
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
    best, place = 0, tuple(int(i) for i in np.argwhere(mask)[0])
    for row in np.ndindex(*mask.shape[:-1]):
        line = np.concatenate(([False], mask[row], [False]))
        begins, ends = np.flatnonzero(~line[:-1] & line[1:]), np.flatnonzero(line[:-1] & ~line[1:])
        if not len(begins):
            continue
        longest_run = int(np.argmax(ends - begins))
        if ends[longest_run] - begins[longest_run] > best:
            best = int(ends[longest_run] - begins[longest_run])
            place = (*(int(i) for i in row), int(begins[longest_run] + ends[longest_run] - 1) // 2)
    *others, last = place
    return (*others[:axis], last, *others[axis:])


# ---- HTML


def _text(text: str) -> str:
    return html.escape(str(text), quote=True)


def _table(rows: Sequence[tuple[str, str]]) -> str:
    cells = "".join(f"<tr><th scope='row'>{_text(a)}</th><td>{_text(b)}</td></tr>" for a, b in rows)
    return f"<table>{cells}</table>"


def _document(title: str, page: _Page) -> str:
    """The whole page. Its policy allows only its own scripts and style, and loads
    nothing."""
    scripts = [static(name).decode() for name in ("uplot/uPlot.iife.min.js", "charts.js", "motion.js", "report.js")]
    scripts[-1:-1] = [static(name).decode() for name in ("vector.js", "paper.js")]
    style = static("uplot/uPlot.min.css").decode() + static("style.css").decode() + static("report.css").decode()
    licence = static("uplot/LICENSE").decode()
    bodies = "".join(
        f'<script type="application/octet-stream" id="body{i}">{base64.b64encode(body).decode()}</script>\n'
        for i, body in enumerate(page.bodies)
    )
    policy = (
        f"default-src 'none'; script-src {' '.join(map(_digest, scripts))}; style-src "
        f"{_digest(style)}; "
        "img-src data: blob:; base-uri 'none'; form-action 'none'"
    )
    return "".join(
        [
            '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n',
            f'<meta http-equiv="Content-Security-Policy" content="{_text(policy)}">\n',
            '<meta name="viewport" content="width=device-width, initial-scale=1">\n',
            '<meta name="generator" content="nsdrill">\n',
            f'<title>{_text(title)} – nsdrill</title>\n<link rel="icon" '
            f'href="data:,">\n<style>{style}</style>\n</head>\n',
            f'<body class="report paper">\n{chr(10).join(page.pieces)}\n',
            "<noscript>The diagrams need JavaScript; all text is here without.</noscript>\n",
            bodies,
            f"<!-- uPlot, which draws the axes:\n{licence.replace('--', '- -')}\n-->\n",
            *(f"<script>{script}</script>\n" for script in scripts),
            "</body>\n</html>\n",
        ]
    )


def _digest(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"
