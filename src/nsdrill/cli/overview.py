"""The help of ``nsdrill`` itself. It imports neither a command nor click, which takes
longer than all the rest."""

from __future__ import annotations

import os
import sys
import textwrap

GROUPS = {
    "Run": {
        "new": "Write a short study to start from, or one of the examples.",
        "check": "Validate a study and print its derived coefficients.",
        "run": "Run a study: sweep, classify, and write the results file.",
        "simulate": "Simulate one operating point and write its trajectory.",
        "replay": "Run one point of a results file again, with its trajectory.",
        "branches": "Follow motions, stable or not, along a number of the study: branches and bifurcations.",
        "spectrum": "Measure all Lyapunov exponents of one point of a results file, and its dimension.",
    },
    "Look": {
        "show": "Summarise a file of results, a trace or branches in words and numbers.",
        "plot": "Draw a file of results, a trace or branches.",
        "view": "Explore results or a study in the browser.",
        "report": "Write results as one file of HTML to send.",
    },
    "Decide": {
        "window": "Find the operating window: where every run is safe, whatever its history.",
        "sensitivity": "Rank the uncertain numbers: which matters most, and which to measure first.",
        "fit": "Adjust unknown numbers of a study to measurements.",
    },
    "Files": {
        "diff": "Compare two results or trace files.",
        "combine": "Join results that differ in one number into one file.",
        "export": "Write results as CSV or netCDF.",
        "classify": "Give a results file new labels with other thresholds; nothing is run again.",
        "cite": "Print what to cite: nsdrill, the results of a file, and their model.",
        "schema": "Print the JSON Schema of the study file.",
    },
}
COMMANDS = {name: line for group in GROUPS.values() for name, line in group.items()}

QUANTITIES = """\b
Q in the help of a command is a number with its unit, in quotes where there is a blank:
3000m, '10 klbf', 60rpm, 3rad/s, '8 1/2 in', 0.5s."""
SCRIPTS_GIVEN = "nsdrill.scripts"  # where the context of a command keeps the files of --with
EXIT_CODES = """\b
Exit codes:
  0    done
  1    the run failed for a reason other than its input: a full disk, too little memory
  2    the command line, the study or an input file is wrong; nothing was written
  3    finished, but some points failed; they are marked in the file
  130  interrupted; --resume continues run, branches and fit"""
HEAD = """\
Usage: nsdrill [OPTIONS] COMMAND [ARGS]...

  A bifurcation explorer for drill-string vibration: bit-bounce, stick-slip and whirl
  over depth, weight on bit and rotary speed, and where history decides.

  Start with:
    nsdrill new -o study.yaml
    nsdrill run study.yaml -o out.h5
    nsdrill plot out.h5 -o out.png

Options:
  -V, --version  Show the version and exit.
  --with FILE    Execute a Python script first, for its models; of every command.
  -h, --help     Show this message and exit.
"""
END = """\
Messages go to standard error, data to standard output.
`nsdrill COMMAND --help` says more."""
WIDEST = 110


def overview(width: int) -> str:
    """The help of ``nsdrill`` in lines of this ``width``."""
    parts, column = [HEAD], max(map(len, COMMANDS)) + 4
    for title, commands in GROUPS.items():
        parts.append(f"\n{title}:\n")
        for name, line in commands.items():
            text = f"  {name}".ljust(column) + line
            parts.append(textwrap.fill(text, width, subsequent_indent=" " * column) + "\n")
    for text in (QUANTITIES, EXIT_CODES, END):
        parts.append("\n" + textwrap.indent(text.removeprefix("\b\n"), "  ") + "\n")
    return "".join(parts)


def printed() -> bool:
    """Whether the help could be printed in the width of the terminal."""
    try:
        wide = int(os.environ.get("COLUMNS", 0)) or os.get_terminal_size().columns
    except (OSError, ValueError):
        wide = 80
    try:
        sys.stdout.write(overview(max(min(wide, WIDEST) - 2, 50)))
        sys.stdout.flush()
    except (OSError, AttributeError, ValueError):
        return False
    return True
