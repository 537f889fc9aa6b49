"""Read the file of a command, of whatever kind it is."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from nsdrill.data import Results, Trace
    from nsdrill.study import Study


def read(path: str, names: Iterable[str] | None = None) -> Results | Trace:
    """The results, trace or unfinished run in ``path``; of a sweep only the variables
    ``names``, if given. The attributes have the overrides also of files of older
    versions."""
    from nsdrill.app.reading import read_any

    return read_any(path, names)


def load(study: str, overrides: Sequence[str], notes: bool = True) -> Study:
    """The study in the file ``study``, or on standard input where that is ``-``; its
    ``notes`` are printed."""
    from nsdrill.study import load_study, parse_study
    from nsdrill.study.read import LARGEST_FILE, text_of

    if study == "-":
        name = "standard input"
        text = text_of(sys.stdin.buffer.read(LARGEST_FILE + 1), name)
        loaded = parse_study(text, name, overrides)
    else:
        loaded = load_study(study, overrides)
    for note in loaded.notes if notes else ():
        click.echo(f"Note: {note}", err=True)
    return loaded


def outline(path: str) -> Results | Trace:
    """As :func:`read`, but without values: the variables of a sweep are zeros, which
    take no memory."""
    from nsdrill.app.reading import outline

    return outline(path)
