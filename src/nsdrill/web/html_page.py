"""Pages of HTML: pieces of text and pictures, and a page that needs no other file and runs
no script."""

from __future__ import annotations

import base64
import hashlib
import html
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from urllib.parse import quote

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
    data = quote(" ".join(text.split("\n")), safe=' ":/=;,.()[]{}+*!?@$|^')
    return f'<img class="vectors" alt="{escaped(words)}" src=\'data:image/svg+xml;charset=utf-8,{data}\'>'


@dataclass
class Page:
    """The page of a report under construction: pieces of HTML."""

    pieces: list[str] = field(default_factory=list)

    def add(self, *pieces: str) -> None:
        self.pieces.extend(pieces)

    def document(self, title: str) -> str:
        """The whole page."""
        return sheet(
            title, static("style.css").decode() + static("report.css").decode(), "\n".join(self.pieces), "report"
        )


def sheet(title: str, style: str, body: str, kind: str) -> str:
    """A page without scripts: a ``body`` of the class ``kind`` in a ``style``. Its policy
    allows only that style, and loads nothing."""
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
