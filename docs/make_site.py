"""What MkDocs does to the pages: formulas become pictures of vectors, no page asks a
network for anything, and the changes of the versions are a page too.

A formula is a fenced block of the language ``math`` in TeX, which GitHub shows by
itself; matplotlib draws it here.
"""

from __future__ import annotations

import html
import io
import re
from functools import cache
from pathlib import Path
from typing import Any

from matplotlib import rc_context
from matplotlib.figure import Figure

BLOCK = re.compile(r"^```math\n(.*?)^```$", re.MULTILINE | re.DOTALL)
# What matplotlib's TeX calls otherwise.
OTHERWISE = {r"\frac": r"\dfrac", r"\lvert": "|", r"\rvert": "|", r"\!": "", r"\;": r"\ "}
FETCHED = re.compile(
    r"<script\b[^>]*\bsrc=\"(?:https?:)?//[^>]*>\s*</script>"
    r"|<link\b[^>]*\bhref=\"(?:https?:)?//[^>]*\brel=\"(?:stylesheet|preconnect)\"[^>]*>"
    r"|<link\b[^>]*\brel=\"(?:stylesheet|preconnect)\"[^>]*\bhref=\"(?:https?:)?//[^>]*>"
)


@cache
def drawn(tex: str) -> str:
    """The formula ``tex`` as SVG, with its own text for screen readers."""
    text = " ".join(tex.split())
    plain = text
    for name, other in OTHERWISE.items():
        plain = plain.replace(name, other)
    with rc_context({"mathtext.fontset": "stix", "svg.fonttype": "path", "svg.hashsalt": "nsdrill"}):
        figure = Figure()
        figure.text(0, 0, f"${plain}$", fontsize=12)
        image = io.StringIO()
        figure.savefig(
            image,
            format="svg",
            bbox_inches="tight",
            pad_inches=0.02,
            transparent=True,
            metadata={"Date": None, "Creator": None, "Format": None, "Type": None},
        )
    svg = image.getvalue()
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg[svg.index("<svg") :], flags=re.DOTALL)
    label = html.escape(text, quote=True)
    style = "display:block;max-width:100%;height:auto;margin:1em 0"
    return svg.replace("<svg", f'<svg role="img" aria-label="{label}" style="{style}"', 1)


def on_files(files: Any, config: Any, **_: Any) -> Any:
    """CHANGELOG.md lies beside the folder of the pages; its links begin there."""
    from mkdocs.structure.files import File  # only mkdocs calls this

    text = (Path(config["docs_dir"]).parent / "CHANGELOG.md").read_text(encoding="utf-8").replace("](docs/", "](")
    files.append(File.generated(config, "changes.md", content=text))
    return files


def on_page_markdown(markdown: str, **_: Any) -> str:
    return BLOCK.sub(lambda found: "\n" + " ".join(drawn(found[1]).split()) + "\n", markdown)


def on_post_page(output: str, **_: Any) -> str:
    return FETCHED.sub("", output)
