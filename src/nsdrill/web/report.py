"""The report: results as one self-contained page of HTML, to send, to read and to
print.

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

from nsdrill.analysis.outcome import outcome
from nsdrill.app.overrides import study_of
from nsdrill.data import Array, Results, json_text
from nsdrill.errors import InputError, NsdrillError
from nsdrill.models.leaves import words_along
from nsdrill.models.registry import drawn_in
from nsdrill.plot.labels import quantity
from nsdrill.plot.slices import Line, edges
from nsdrill.variables import AXES, INFERRED, OK, SAMPLE
from nsdrill.web.areas import (
    MAX_MAPS,
    TitledReply,
    basin_area,
    evenly_spaced,
    probability_areas,
    probability_lines,
    verdict_areas,
    window_areas,
)
from nsdrill.web.branches import END_POINT, REGULAR, Branches
from nsdrill.web.diagrams import Reply, axis_data, longest, member_dimension, plane
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

    def add_drawing(
        self, kind: str, replies: Sequence[Reply], more: Mapping[str, Any], words: str
    ) -> None:
        """An element in which the script draws ``replies``; ``words`` are its label for
        screen readers."""
        first = len(self.bodies)
        self.bodies.extend(packed(*reply) for reply in replies)
        data = json_text({"kind": kind, "bodies": list(range(first, len(self.bodies))), **more})
        self.add(
            f'<div class="drawing" role="group" aria-label="{_text(words)}" '
            f'data-draw="{_text(data)}"></div>'
        )


def report(parts: Sequence[Part], command: str, motions: int) -> str:
    """The page as HTML. ``command`` is the command line that writes it again; of each
    file up to ``motions`` points are drawn moving."""
    page = _Page()
    titles = [part.session.title for part in parts]
    page.add(
        f"<header><div><h1>{_text(titles[0] if len(titles) == 1 else 'Results of nsdrill')}</h1>"
    )
    if len(titles) > 1:
        rows = [f'<li><a href="#file{i}">{_text(title)}</a></li>' for i, title in enumerate(titles)]
        page.add(f"<ol>{''.join(rows)}</ol>")
    page.add("</div></header><main>")
    stems = _stems([part.session.path for part in parts])
    for number, part in enumerate(parts):
        page.add(f'<section id="file{number}">')
        if len(parts) > 1:
            page.add(f"<h2>{_text(titles[number])}</h2>")
        _add_file(page, part, motions, stems[number])
        page.add("</section>")
    page.add(
        "<section><h2>How to reproduce this page</h2>",
        f"<p><code>{_text(command)}</code></p></section></main>",
    )
    return _document(titles[0], page)


def _stems(paths: Sequence[str]) -> list[str]:
    """The beginnings of the file names in the command lines: the name of each file,
    with a number where two are equal."""
    names = [Path(path).name.partition(".")[0] or "results" for path in paths]
    return [
        name if names.count(name) == 1 else f"{name}{number}"
        for number, name in enumerate(names, start=1)
    ]


def _add_file(page: _Page, part: Part, motions: int, stem: str) -> None:
    """The section of one file; the names of the files that its command lines write
    begin with ``stem``."""
    session = part.session
    results = session.results
    if results is None:
        if session.branches is None:
            raise InputError(
                f"{session.path}: found a study; allowed: results. Run it first: nsdrill run."
            )
        _add_branches(page, session, session.branches, stem)
        return
    places = representatives(results, motions)
    _add_origin(page, session, results)
    page.add("<h3>Diagrams</h3>", '<p class="screen">Point at a diagram for its numbers.</p>')
    _add_diagrams(page, session, results)
    for heading, lines in part.summaries:
        page.add(f"<h3>{_text(heading)}</h3>", f"<pre>{_text(chr(10).join(lines))}</pre>")
    study, again = (shlex.quote(f"{stem}_{name}") for name in ("study.yaml", "again.h5"))
    commands = [
        f"nsdrill show {shlex.quote(session.path)} --study > {study}",
        f"nsdrill run {study} -o {again}",
    ]
    if places:
        page.add("<h3>Motions</h3>", "<p>One point of each kind that is common, run once more.</p>")
        for number, place in enumerate(places, start=1):
            trace = shlex.quote(f"{stem}_trace{number}.h5")
            commands.append(
                _add_motion(page, session, place).replace(" -o trace.h5", f" -o {trace}")
            )
    page.add("<h3>From the command line</h3>")
    page.add(
        f"<p>Study, results, and the motions above:</p><pre>{_text(chr(10).join(commands))}</pre>"
    )
    _add_study(page, session, results.attrs)


def _add_study(page: _Page, session: Session, attrs: Mapping[str, Any]) -> None:
    text = _text(study_of(session.path, attrs))
    page.add(f"<details><summary>The study, every key</summary><pre>{text}</pre></details>")


def _add_origin(page: _Page, session: Session, results: Results) -> None:
    """The sweep, and what computed it."""
    meta, attrs = session.meta(), results.attrs
    rows = [("File", session.path), ("Model", meta["model"])]
    for name in results.axes:
        axis = quantity_data(name, session.units)
        values = results.coords[name] / quantity(name, session.units).scale
        if words_along(name):
            rows.append(
                (
                    axis["words"],
                    ", ".join(quantity(name).value(value) for value in results.coords[name]),
                )
            )
            continue
        span = f"{values[0]:.6g} to {values[-1]:.6g}" if len(values) > 1 else f"{values[0]:.6g}"
        ends = f"{span} {axis['unit']}".strip() + (
            f", {len(values)} values" if len(values) > 1 else ""
        )
        rows.append((axis["words"], ends))
    procedures = [str(name) for name in results.coords["procedure"]]
    rows.append(
        (
            "State",
            "carried " + " and ".join(procedures)
            if procedures != ["same"]
            else "the same at every start",
        )
    )
    if member := member_dimension(results):
        rows.append(
            (f"{member.capitalize()}s", f"{len(results.coords[member])} of every operating point")
        )
    simulation = session.study.simulation
    rows.append(
        ("Each run", f"{simulation.transient:g} s, then observed for {simulation.observe:g} s")
    )
    rows.append(("Changed by --set", "; ".join(meta["overrides"]) or "nothing"))
    rows.append(
        ("Made", f"{attrs.get('created', '')} by nsdrill {attrs.get('nsdrill_version', '')}")
    )
    versions = (
        "python_version",
        "numpy_version",
        "llvmlite",
        "h5py_version",
        "processor",
        "model_digest",
    )
    software = [
        f"{name.removesuffix('_version').replace('_', ' ')} {attrs[name]}"
        for name in versions
        if name in attrs
    ]
    rows.append(("With", ", ".join(software)))
    rows.append(("Study", f"SHA-256 {attrs.get('study_sha256', '')}"))
    page.add("<h3>What was run</h3>", _table(rows))


def _add_diagrams(page: _Page, session: Session, results: Results) -> None:
    units = session.units
    names = sorted(
        results.swept, key=lambda name: (bool(words_along(name)), -len(results.coords[name]))
    )
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
                    [
                        "Responses",
                        *([procedure] if len(procedures) > 1 else []),
                        *([where] if where else []),
                    ]
                )
                page.add(f"<h4>{_text(words)}</h4>")
                page.add_drawing(
                    "map",
                    [plane(results, units, "response", x, y, held)],
                    {**more, "procedure": number},
                    words,
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
    if SAMPLE not in results.coords:
        _add_maps(page, window_areas(results, units))
    if len(names) == 2 and not member_dimension(results):
        _add_maps(page, verdict_areas(results, units, names[0], names[1]))


def _add_maps(page: _Page, areas: Iterable[TitledReply]) -> None:
    """Maps with their titles."""
    for words, reply in areas:
        page.add(f"<h4>{_text(words)}</h4>")
        page.add_drawing("map", [reply], {"responses": response_styles(), "procedure": 0}, words)


def _add_branches(page: _Page, session: Session, branches: Branches, stem: str) -> None:
    """The section of a file of branches: their curves and special points."""
    x, meta = quantity(branches.along, session.units), session.meta()
    rows = [("File", session.path), ("Model", meta["model"])]
    ends = [float(branches.attrs.get(name, np.nan)) for name in ("continue_from", "continue_to")]
    ends = (
        ends
        if np.all(np.isfinite(ends))
        else [float(branches.numbers.min()), float(branches.numbers.max())]
    )
    rows.append((f"Along {plain(x.words).lower()}", " to ".join(map(x.value, ends))))
    for name in AXES:
        if name != branches.along and name in branches.features:
            shown = quantity(name, session.units)
            rows.append((plain(shown.words), shown.value(float(branches.features[name][0]))))
    rows.append(("Points", f"{len(branches.label)} on {len(branches.sizes)} branches"))
    rows.append(("Changed by --set", "; ".join(meta["overrides"]) or "nothing"))
    version = str(branches.attrs.get("nsdrill_version", ""))
    rows.append(("Made", f"{branches.attrs.get('created', '')} by nsdrill {version}"))
    rows.append(("Study", f"SHA-256 {branches.attrs.get('study_sha256', '')}"))
    page.add("<h3>What was run</h3>", _table(rows), "<h3>Branches</h3>")
    panels = [p for p in drawn_in(branches.attrs).panels if p.greatest in branches.features]
    replies = [session.diagram({"y": p.peaks}) for p in panels]
    page.add_drawing(
        "lines", replies, {"responses": response_styles()}, f"Branches along {branches.along}"
    )
    first = 0
    branch_rows: list[tuple[str, str]] = []
    for number, (size, name, end) in enumerate(
        zip(branches.sizes.tolist(), branches.names, branches.ends, strict=True)
    ):
        part = branches.numbers[first : first + size]
        branch_rows.append(
            (
                f"Branch {number}",
                f"{name}, {x.value(part.min())} to {x.value(part.max())}; ends: {end}",
            )
        )
        for point in range(first, first + size):
            if (label := int(branches.label[point])) not in (REGULAR, END_POINT):
                words = (
                    f"{branches.meanings.get(label, str(label))} at "
                    f"{x.value(float(branches.numbers[point]))}"
                )
                branch_rows.append(("", f"{words} (point {point})"))
        first += size
    page.add(_table(branch_rows), "<h3>From the command line</h3>")
    file, study, again, orbit = map(
        shlex.quote,
        (session.path, *(f"{stem}_{name}" for name in ("study.yaml", "again.h5", "orbit.h5"))),
    )
    commands = [
        f"nsdrill show {file} --study > {study}",
        f"nsdrill continue {study} -o {again}",
        f"nsdrill simulate {study} --orbit {file} --point 0 -o {orbit}",
    ]
    words = (
        "Study, branches, and the motion of a point, whose number may be any of the table. Where "
        "branches were seeded "
        "from a results file, continue needs it again: --seeds FILE."
    )
    page.add(f"<p>{words}</p><pre>{_text(chr(10).join(commands))}</pre>")
    _add_study(page, session, branches.attrs)


def _held_values(
    results: Results, others: Sequence[str], units: str
) -> Iterator[tuple[dict[str, int], str]]:
    """All combinations of some values of the ``others`` of the axes, as indices by axis
    and in words."""
    values = [evenly_spaced(len(results.coords[name])) for name in others]
    for index in product(*values):
        words = [
            f"{plain(quantity(name, units).words)}: "
            f"{quantity(name, units).value(float(results.coords[name][i]))}"
            for name, i in zip(others, index, strict=True)
        ]
        yield dict(zip(others, (int(i) for i in index), strict=True)), ", ".join(words)


def _thinned(reply: Reply) -> Reply:
    """A diagram with at most about :data:`MAX_PEAKS` peaks: of each point the last
    ones, or the first ones where some motions are constant."""
    head, columns = reply
    values = columns["values"]
    keep = max(1, int(MAX_PEAKS / max(1, values.shape[0] * values.shape[1])))
    return head, {
        **columns,
        "values": values[..., :keep] if columns["constant"].any() else values[..., -keep:],
    }


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
        page.add_drawing(
            "lines",
            [probability_lines(results, units, axis)],
            {"responses": response_styles()},
            words,
        )
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
        "lines",
        replies,
        {"responses": response_styles()},
        f"Greatest values along {axis}, of every {member}",
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
    page.add(
        f"<figure><figcaption><strong>{_text(title)}</strong><br>{_text(', '.join(head['labels']))}<br>"
    )
    if head["ended"]:
        page.add(_text(f"It ended early: {head['ended']}."))
    else:
        ending = (
            "the stored state, bit for bit"
            if head["same_bits"]
            else f"not the stored state: {head['differing']}"
        )
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
    scripts = [
        static(name).decode() for name in ("uplot/uPlot.iife.min.js", "charts.js", "report.js")
    ]
    style = (
        static("uplot/uPlot.min.css").decode()
        + static("style.css").decode()
        + static("report.css").decode()
    )
    licence = static("uplot/LICENSE").decode()
    bodies = "".join(
        f'<script type="application/octet-stream" '
        f'id="body{i}">{base64.b64encode(body).decode()}</script>\n'
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
            f'<body class="report">\n{chr(10).join(page.pieces)}\n',
            "<noscript>The diagrams need JavaScript; all text is here without.</noscript>\n",
            bodies,
            f"<!-- uPlot, which draws the axes:\n{licence.replace('--', '- -')}\n-->\n",
            *(f"<script>{script}</script>\n" for script in scripts),
            "</body>\n</html>\n",
        ]
    )


def _digest(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"
