"""The study that ``nsdrill new`` writes: every key with its default, its unit and its
meaning."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from nsdrill.study.keys import MODEL_LEAF, SLICE, Keys, Leaf, keys_of
from nsdrill.study.meanings import MEANINGS
from nsdrill.variables import MODEL

_INDENT = "  "
_COLUMN = 44  # where the comments begin

_HEAD = """\
# A study: a drill string, an operating point, and what to sweep.
#
# Every physical quantity is a number with its unit: 15 in, 22.24 kN, 5 klbf, 60 rpm, 3 rad/s, 25 MN/m.
# All keys may be left out; the values below are the defaults, but for the title and the sweep. Run it with
#     nsdrill check STUDY.yaml
#     nsdrill run STUDY.yaml -o OUT.h5
"""

_SWEEP = """\
sweep:                                      # {sweep}; without it one operating point is run
  # Each axis is {{from, to, points}}, a list of values, or one value. Axes left out come from `operation`.
  depth: {{from: 500 m, to: 9000 m, points: 86}}
  # wob: [22.24 kN, 66.72 kN]
  # rotary_speed: {{from: 10 rpm, to: 120 rpm, points: 111}}
  # {axis}: {{from: {low}, to: {high}, points: 20, spacing: log}}  # or any number by its key
  procedure: same                           # same | up | down | up-down: the last three carry the state
  # along: depth                            # {along}
  refine: 0                                 # {refine}

# uncertain:                                # {uncertain}
#   {axis}: {{uniform: [{low}, {high}]}}
#   # or normal: {{mean, deviation}}, lognormal: {{median, factor}}, triangular: [low, mode, high], values: [...]
#   samples: 256                            # {samples}
#   seed: 1                                 # {seed}
"""


def template_text(model: str = MODEL) -> str:
    """The text of a complete, commented study of the model of this name that loads as
    it stands."""
    keys = keys_of(model)
    parts = [_HEAD, line("", "title", "Depth sweep, same initial state", MEANINGS["title"])]
    parts.append(line("", "model", model, _comment(MODEL_LEAF)))
    for name in keys.sections:
        if name == "simulation":
            told = {key: MEANINGS[f"sweep.{key}"] for key in ("along", "refine")}
            told |= {key: MEANINGS[f"uncertain.{key}"] for key in ("samples", "seed")}
            told["uncertain"] = MEANINGS["uncertain"].partition(";")[0]
            axis, low, high = keys.model.example_axis
            parts.append(
                _SWEEP.format(sweep=MEANINGS["sweep"], axis=axis, low=low, high=high, **told)
            )
        parts.append("\n".join(section(keys, name, lambda leaf: leaf.default_text)))
        if name == "initial":
            parts[-1] += f"\n  # {keys.meanings[SLICE]}:\n  # slice: {keys.model.example_slice}"
    parts.append(
        f"# continue: {{along: rotary_speed, from: 2 rad/s, to: 8 rad/s}}  # {MEANINGS['continue']}"
    )
    return "\n".join(part.rstrip("\n") + "\n" for part in parts)


def section(keys: Keys, prefix: str, text: Callable[[Leaf], str | None]) -> Iterator[str]:
    """The lines of one section: every key whose ``text`` is not None, with its meaning
    beside it."""
    yield line("", prefix, "", keys.meanings[prefix])
    told = {prefix}
    for leaf in keys.of(prefix):
        value = text(leaf)
        if value is None:
            continue
        *groups, name = leaf.key.split(".")
        group = ".".join(groups)
        if group not in told:
            told.add(group)
            yield line(_INDENT * (len(groups) - 1), groups[-1], "", keys.meanings[group])
        yield line(_INDENT * len(groups), name, value, _comment(leaf))


def _comment(leaf: Leaf) -> str:
    """Meaning and unit or choices of one key; sources are in the schema and in the
    documentation."""
    units = "" if not leaf.units else f" [{leaf.units}]"
    choices = f": {' | '.join(leaf.choices)}" if leaf.choices else ""
    return f"{leaf.meaning}{choices}{units}"


def line(indent: str, name: str, value: str, comment: str) -> str:
    """``name: value  # comment``, the comments in one column."""
    return f"{indent}{name}: {value}".rstrip().ljust(_COLUMN - 1) + f" # {comment}"
