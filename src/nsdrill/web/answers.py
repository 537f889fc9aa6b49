"""The head of a report: the answer of each file, what bounds it, what to know before
relying on it, and the comparison of two files."""

from __future__ import annotations

import base64
import html
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from nsdrill.app.contrast import border_rows, contrast, difference, notes, onset_rows, sentence, thresholds
from nsdrill.app.contrast import rows as contrast_rows
from nsdrill.app.sensitivity import sensitivity
from nsdrill.app.window import window_of, with_passed_over
from nsdrill.data import Results
from nsdrill.errors import InputError, NsdrillError
from nsdrill.plot import draw
from nsdrill.plot.answer import (
    Formatter,
    answer,
    chosen_map,
    drilling,
    explained,
    in_order,
    is_hint,
    limit,
    percent,
    warnings,
)
from nsdrill.plot.kinds.window import draw_two
from nsdrill.plot.look import Look
from nsdrill.plot.saving import svg
from nsdrill.variables import SAMPLE

MAX_ROWS = 40  # of a table of the comparison


# the limits of validity that the reader of a report must know, who has no documentation
LIMITS = (
    "Not validated against field data: use this to compare, to understand and to ask, not as "
    "settings. The rate of penetration has default constants, of one bit in one rock, unless the "
    "study sets them: use its ratios, not its feet per hour. The hole is straight; motors, reamers, "
    "jars, changes of formation and the surface that the bit cut before are left out, and "
    "estimates of eccentricity, bit friction and rock stiffness change the answer. Points between "
    "those of the map were not run; nothing is known beyond its edge."
)


def file_answer(
    results: Results,
    units: str,
    is_drawn: bool = True,
    letter: str = "",
    severity: int | None = None,
    confidence: float | None = None,
    limits: bool = True,
) -> str:
    """The answer of one file as HTML: the sentence after the ``letter`` of the file, the
    warnings, the ``limits`` of validity, the borders, and if ``is_drawn`` the picture."""
    try:
        window = window_of(results, severity, confidence)
    except NsdrillError as error:  # a single point, four axes, a part of a design
        reason = paragraph(f"No window: {str(error).removeprefix('window: ')}", "answer")
        return reason + (paragraph(LIMITS, "limits") if limits else "")
    sentence = answer(window, units)
    drawing = {"severity": severity, "confidence": confidence}
    pieces = [
        paragraph(f"{letter}: {sentence}" if letter else sentence, "answer"),
        warning_list(warnings(window, units)),
        paragraph(LIMITS, "limits") if limits else "",
        _borders(window, units),
        _doubt(results, window, units),
        picture(results, "window", sentence, units, **drawing) if is_drawn else "",
    ]
    if SAMPLE in results.coords and 0 < len(results.swept) < 3:
        words, level = "How probable each outcome is", window["confidence"]
        pieces.append(picture(results, "probability", words, units, confidence=level))
    return "".join(pieces)


def warning_list(texts: Iterable[str]) -> str:
    """Warnings as a list that cannot be overlooked; "" where there are none."""
    items = "".join(f"<li>{escaped(text)}</li>" for text in texts)
    return f'<ul class="warnings">{items}</ul>' if items else ""


def picture(results: Results, kind: str | None, words: str, units: str, **drawing: Any) -> str:
    """A picture of the program as vectors, by default that which fits, without the title and the warnings, which the
    page has; a sentence where it cannot be drawn."""
    try:
        drawn = draw(with_passed_over(results), kind, units=units, look=Look(title=False, warnings=False), **drawing)
        return image(svg(drawn), words)
    except NsdrillError as error:
        return paragraph(str(error))


def image(text: str, words: str) -> str:
    """The text of an SVG file as an image, which keeps its styles and names to itself."""
    data = base64.b64encode(text.encode()).decode()
    return f'<img class="vectors" alt="{escaped(words)}" src="data:image/svg+xml;base64,{data}">'


def _borders(window: Mapping[str, Any], units: str) -> str:
    """The recommended point, how far each axis may change, and what lies beyond."""
    fmt, plane = Formatter(units), chosen_map(window)
    best = plane and plane["recommended"]
    if not best:
        return ""
    word = "best hint" if is_hint(window, best) else "recommended"
    rows = []
    for axis in in_order(window["axes"]):
        sides = best["margins"][axis]
        rows.append(
            (
                fmt.name(axis).capitalize(),
                fmt.value(axis, best[axis]),
                fmt.range(axis, [sides[side]["safe_to"] for side in ("less", "more")]),
                *(limit(axis, sides[side], fmt) for side in ("less", "more")),
            )
        )
    pieces = [table(("", word, "safe", "below that", "above that"), rows)]
    if yields := drilling(best, fmt):
        pieces.append(paragraph(f"There: {yields}."))
    pieces += [paragraph(text) for text in explained(window, units)]
    return "".join(pieces)


def _doubt(results: Results, window: Mapping[str, Any], units: str) -> str:
    """The probability of the recommended point, and the unknown on which it depends."""
    if window["confidence"] is None:
        return ""
    plane = chosen_map(window)
    best = (plane and plane["recommended"]) or window["most_probable"]
    texts = []
    if best:
        texts.append(
            f"A run there is safe with a probability of {percent(best)}: in brackets the 95 % "
            f"interval from {window['counted']} samples."
        )
    try:
        found = sensitivity(results)
    except NsdrillError as error:
        reason = str(error).removeprefix("sensitivity: ")
        return paragraph(" ".join([*texts, f"On which unknown it depends most is not known: {reason}"]))
    fmt = Formatter(units)
    if first := found["measure_first"]:
        texts.append(
            f"It depends most on {fmt.name(first['key'])}, which alone causes "
            f"{100 * first['first']:.0f} % of the variance: measure that first."
        )
    else:
        texts.append("These samples are too few to say on which unknown it depends most.")
    return paragraph(" ".join(texts))


def comparison(
    results: Sequence[Results],
    names: Sequence[str],
    units: str,
    severity: int | None = None,
    confidence: float | None = None,
) -> tuple[str, str]:
    """Two files against each other: the first lines, and the tables, as HTML; ("", the
    reason) where they cannot be compared."""
    try:
        found = contrast(results[0], results[1], severity, confidence, names)
    except InputError as error:
        return "", paragraph(f"The two windows are not compared: {error}")
    body, head = contrast_rows(found, units)[1:], ("", f"a: {names[0]}", f"b: {names[1]}")
    axis = Formatter(units).name(found["windows"][0]["axes"][0])
    first = "".join(
        [
            paragraph(sentence(found, units), "answer"),
            paragraph(difference(found)),
            warning_list(text for text in notes(found, units) if not text.startswith(("a: ", "b: "))),
        ]
    )
    data = [with_passed_over(one) for one in results]
    look = Look(warnings=False)  # the page has them
    drawn = draw_two(data[0], data[1], names, units, severity, confidence, look)
    pieces = [table(head, body), image(svg(drawn), sentence(found, units))]
    for heading, columns, rows in (
        (
            f"Safe intervals along the {axis}, and how far their ends moved",
            ("", "a", "b", "lower end", "upper end"),
            border_rows(found, units),
        ),
        (
            f"Where along the {axis} a response occurs, where that changed ({thresholds(found)})",
            ("", "way", "response", "a", "b"),
            onset_rows(found, units),
        ),
    ):
        if rows:
            pieces.append(f"<h3>{escaped(heading)}</h3>{table(columns, rows[:MAX_ROWS])}")
            if len(rows) > MAX_ROWS:
                pieces.append(paragraph(f"And {len(rows) - MAX_ROWS} more: nsdrill window A.h5 B.h5 --json."))
    return first, "".join(pieces)


# ---- HTML


def escaped(text: str) -> str:
    return html.escape(str(text), quote=True)


def paragraph(text: str, style: str = "") -> str:
    return f"<p{f' class={chr(34)}{style}{chr(34)}' if style else ''}>{escaped(text)}</p>"


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table; with the names of its columns its rows become blocks on a narrow page."""
    top = "".join(f"<th scope='col'>{escaped(name)}</th>" for name in head)
    body = ""
    for first, *others in rows:
        columns = [f" data-column='{escaped(name)}'" for name in head[1:]] or [""] * len(others)
        cells = [f"<td{column}>{escaped(cell)}</td>" for column, cell in zip(columns, others, strict=True)]
        body += f"<tr><th scope='row'>{escaped(first)}</th>{''.join(cells)}</tr>"
    if not head:
        return f"<table>{body}</table>"
    return f"<table class='blocks'><thead><tr>{top}</tr></thead><tbody>{body}</tbody></table>"
