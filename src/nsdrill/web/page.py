"""Pages of HTML: pieces of text, and the page of a report, which needs no other file. The
scripts of the explorer draw its diagrams and motions in the browser, from the same bodies
(:mod:`nsdrill.web.asked`), which the page holds in base64."""

from __future__ import annotations

import base64
import hashlib
import html
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from nsdrill.data import Answer, json_text
from nsdrill.web.asked import packed
from nsdrill.web.diagrams import Reply
from nsdrill.web.server import static


def escaped(text: str) -> str:
    return html.escape(str(text), quote=True)


def paragraph(text: str, style: str = "") -> str:
    """A paragraph; "" without a text."""
    return text and f"<p{f' class={chr(34)}{style}{chr(34)}' if style else ''}>{escaped(text)}</p>"


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


def without_keys(text: str) -> str:
    """A text for who has no program: without the keys and options of a study in
    brackets."""
    return re.sub(r" \((--[a-z][^)]*|[a-z_]+(\.[a-z_]+)+)\)", "", text)


def warning_list(texts: Iterable[str]) -> str:
    """Warnings as a list that cannot be overlooked; "" where there are none."""
    return item_list(map(without_keys, texts), "warnings")


def item_list(texts: Iterable[str], style: str) -> str:
    """A list of this style; "" where there are no texts."""
    items = "".join(f"<li>{escaped(text)}</li>" for text in texts)
    return f'<ul class="{style}">{items}</ul>' if items else ""


def image(text: str, words: str) -> str:
    """The text of an SVG file as an image, which keeps its styles and names to itself."""
    data = base64.b64encode(text.encode()).decode()
    return f'<img class="vectors" alt="{escaped(words)}" src="data:image/svg+xml;base64,{data}">'


@dataclass
class Page:
    """The page under construction: pieces of HTML, and the bodies that its drawings
    refer to by number."""

    pieces: list[str] = field(default_factory=list)
    bodies: list[bytes] = field(default_factory=list)

    def add(self, *pieces: str) -> None:
        self.pieces.extend(pieces)

    def add_drawing(self, kind: str, replies: Sequence[Reply], more: Answer, words: str) -> None:
        """An element in which the script draws ``replies``; ``words`` are its label for
        screen readers."""
        first = len(self.bodies)
        self.bodies.extend(packed(*reply) for reply in replies)
        data = json_text({"kind": kind, "bodies": list(range(first, len(self.bodies))), **more})
        self.add(f'<div class="drawing" role="group" aria-label="{escaped(words)}" data-draw="{escaped(data)}"></div>')

    def document(self, title: str) -> str:
        """The whole page. Its policy allows only its own scripts and style, and loads
        nothing."""
        scripts = [static(name).decode() for name in ("uplot/uPlot.iife.min.js", "charts.js", "motion.js", "report.js")]
        scripts[-1:-1] = [static(name).decode() for name in ("vector.js", "paper.js")]
        style = static("uplot/uPlot.min.css").decode() + static("style.css").decode() + static("report.css").decode()
        licence = static("uplot/LICENSE").decode()
        bodies = "".join(
            f'<script type="application/octet-stream" id="body{i}">{base64.b64encode(body).decode()}</script>\n'
            for i, body in enumerate(self.bodies)
        )
        policy = (
            f"default-src 'none'; script-src {' '.join(map(_digest, scripts))}; style-src {_digest(style)}; img-src "
            "data: blob:; base-uri 'none'; form-action 'none'"
        )
        return "".join(
            [
                '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n',
                f'<meta http-equiv="Content-Security-Policy" content="{escaped(policy)}">\n',
                '<meta name="viewport" content="width=device-width, initial-scale=1">\n',
                '<meta name="generator" content="nsdrill">\n',
                f'<title>{escaped(title)} – nsdrill</title>\n<link rel="icon" '
                f'href="data:,">\n<style>{style}</style>\n</head>\n',
                f'<body class="report paper">\n{chr(10).join(self.pieces)}\n',
                "<noscript>The diagrams need JavaScript; all text is here without.</noscript>\n",
                bodies,
                f"<!-- uPlot, which draws the axes:\n{licence.replace('--', '- -')}\n-->\n",
                *(f"<script>{script}</script>\n" for script in scripts),
                "</body>\n</html>\n",
            ]
        )


def sheet(title: str, style_file: str, more: str, body: str, kind: str) -> str:
    """A page without scripts: a ``body`` in the style of a file with ``more`` rules, of the
    class ``kind``. It loads nothing."""
    style = static(style_file).decode() + more
    policy = f"default-src 'none'; style-src {_digest(style)}; img-src data:; base-uri 'none'; form-action 'none'"
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{escaped(policy)}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        '<meta name="generator" content="nsdrill">\n'
        f'<title>{escaped(title)} – nsdrill</title>\n<link rel="icon" href="data:,">\n<style>{style}</style>\n'
        f'</head>\n<body class="{kind}">\n{body}\n</body>\n</html>\n'
    )


def _digest(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"
