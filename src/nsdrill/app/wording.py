"""Texts that the command line, Python and the explorer share; and the conversion of
messages with command-line options into the terms of Python calls."""

from __future__ import annotations

import re
from collections.abc import Callable

# How a run can end early, and the remedy.
ENDINGS = {
    "diverged": "the motion grew without bound; the values of the study are far from any drill string",
    "step_limit": "the run took more than simulation.max_steps steps",
    "step_underflow": "the step became too small to move time on; raise simulation.rtol, or lower the stiffnesses",
}


def _setting(found: re.Match[str]) -> str:
    """An override as a mapping, with numbers, true, false and null as in Python."""
    key, value = found.groups()
    bare = {"true": "True", "false": "False", "null": "None"}.get(value)
    if bare is None:
        bare = value if re.fullmatch(r"[-+]?[\d.]+(?:e[-+]?\d+)?", value) else repr(value)
    return f"set={{'{key}': {bare}}}"


# Applied in this order. Text that is not an option, such as a path with two hyphens,
# has no blank before the hyphens.
_RULES: tuple[tuple[str, str | Callable[[re.Match[str]], str]], ...] = (
    (r"the same command (with|and) (?=--)", r"the same call \1 "),
    (r"`nsdrill show [^`]*`", "nsdrill.show"),
    (r"nsdrill run --resume", "nsdrill.run and resume=True"),
    (r"(?<![\w.`])nsdrill (run|simulate|replay|plot|window|fit|show|check|classify)\b", r"nsdrill.\1"),
    (r"--set key=value, as in --set operation\.wob=30kN", "a mapping by dotted keys, as {'operation.wob': '30 kN'}"),
    (r"(?<=\()--set ([\w.]+)=([^()]*)(?=\))", _setting),
    (r"(?<![\w-])--set ([\w.]+)=([^\s,;)]*[^\s,;.)])(?=[\s,;.)]|$)", _setting),
    (r"(?<![\w-])--set(?![\w-])", "set"),
    (r"(?<![\w-])--from and --to(?![\w-])", "time"),
    (r"(?<![\w-])--(?:from|to)(?![\w-])", "time"),
    (r"(?<![\w-])--animate: ", "trace: "),
    (r"(?<![\w-])--font-size(?![\w-])", "font_size"),
    (r"(?<![\w-])--(overwrite|resume|large)(?![\w-])", r"\1=True"),
    (r"(?<![\w-])--retry-failed(?![\w-])", "retry_failed=True"),
    (r"(?<![\w-])--(engine|kind) (\w+(?:-\w+)*)", r"\1='\2'"),
    (r"(?<![\w-])--at ([\w.]+)=([-\d.][^\s;,]*[^\s;,.])", r"at={'\1': '\2'}"),
    (r"(?<![\w-])--at ([\w.]+)=\.\.\.", r"at={'\1': ...}"),
    (r"(?<![\w-])--(depth|wob) ([-\d.]\S*[^\s;,.])", r"\1='\2'"),
    (r"(?<![\w-])--rotary-speed ([-\d.]\S*[^\s;,.])", r"rotary_speed='\1'"),
    (r"(?<![\w-])--rotary-speed(?![\w-])", "rotary_speed"),
    (r"(?<![\w-])--(rename|error) '?([^'=\s]+)=([^'\s]+)'?", r"\1={'\2': '\3'}"),
    (r"(?<![\w-])--ignore ('[^']*')", r"ignore=[\1]"),
    (r"(?<![\w-])--skip-gaps(?![\w-])", "skip_gaps=True"),
    (r"(?<![\w-])--error(?![\w-])", "errors"),
    (r"(?<![\w-])--([a-z]+)(?![\w-])", r"\1"),
    (r"(?<!nsdrill new) with -o(?![\w-])", " as path"),
    (r"(?<!nsdrill new) -o(?![\w-])", " path"),
)


def python_words(text: str) -> str:
    """``text`` with the arguments of Python functions in place of options."""
    for pattern, words in _RULES:
        text = re.sub(pattern, words, text)
    return text
