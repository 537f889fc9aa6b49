"""Refusals of arguments, made from what is said of them: every argument of every operation,
with what it may not have, in Python and on the command line."""

import inspect
import io
import math
import re
from pathlib import Path
from typing import Any

import click
import pytest

import nsdrill
from nsdrill import api
from nsdrill.cli.main import group
from nsdrill.cli.overview import COMMANDS
from nsdrill.errors import naming_options, option
from nsdrill.operations.argument import Argument, Choice, File, Flag, Number, Percent, Texts, Units, Whole, arguments_of

PUBLIC = {name: one for name, one in vars(api).items() if hasattr(one, "__signature__")}
OTHER_NAMES = {"continue_branches": "branches", "lyapunov_spectrum": "spectrum", "chart": "plot", "animate": "plot"}
COMMAND_OF = {name: OTHER_NAMES.get(name, name) for name in PUBLIC if OTHER_NAMES.get(name, name) in COMMANDS}


def wrong(argument: Argument) -> list[tuple[Any, str]]:
    """Values that an argument may not have in Python, each with what is allowed."""
    match argument.kind:
        case Choice(words):
            return [(value, ", ".join(words)) for value in ("sideways", words[0].swapcase())]
        case Units():
            return [("metric", "si or field")]
        case Flag(off=False):  # a text is true: overwrite="no" would replace a file
            return [(value, "True or False") for value in ("no", 1)]
        case Whole(low=None):
            return [("x", "a whole number, from 0"), ("3", "a whole number, from 0")]
        case Whole(low, None):
            return [(value, f"a whole number, {low} or more") for value in (low - 1, f"{low}", low + 0.5, True)]
        case Whole(low, high):
            allowed = f"{low} to {high:_}, a whole number".replace("_", " " if high > 9999 else "")
            return [(value, allowed) for value in (low - 1, high + 1, f"{low}", low + 0.5, True)]
        case Percent(low, high):
            allowed = f"{low / 100:g} to {high / 100:g}, as 0.9"
            return [(value, allowed) for value in (low / 200, high / 50, f"{low}", True, math.nan)]
        case Number():
            return [("x", "a number"), (True, "a number")]
    return []


def word_of(kind: object, value: Any) -> str | None:
    """The ``value`` as a command line has it; None where it has no such value, or one that is
    allowed: digits are a number there, and a share is in percent."""
    typed = isinstance(value, bool | float) or (str(value).isdigit() and isinstance(value, str))
    match kind:
        case Whole() | Number() if not typed:
            return str(value)
        case Choice():
            return str(value)
        case Units() if value not in ("SI", "FIELD"):
            return str(value)
    return None


ARGUMENTS = [
    (name, argument, value, allowed)
    for name, one in PUBLIC.items()
    for argument, about in arguments_of(one.__wrapped__).items()
    for value, allowed in wrong(about)
]


def needed(name: str) -> list[str]:
    """The arguments that the function cannot do without."""
    return [one.name for one in inspect.signature(PUBLIC[name]).parameters.values() if one.default is one.empty]


def call_of(name: str, **given: object) -> None:
    """Call the function; what it needs besides is the name of a file that is not there."""
    PUBLIC[name](**{**dict.fromkeys(needed(name), "missing.h5"), **given})


def command_of(name: str) -> click.Command:
    command = group.get_command(click.Context(group), COMMAND_OF[name])
    assert command is not None
    return command


def options_of(name: str, argument: str) -> list[str]:
    """The option of an argument of this function, the value after it to be; none where the
    command line has none."""
    about = arguments_of(PUBLIC[name].__wrapped__)[argument]
    known = {text for one in command_of(name).params for text in one.opts} if name in COMMAND_OF else ()
    return [text for text in about.option.split()[-1:] if text in known]


def line_of(name: str) -> list[object]:
    """A command line of the command of this function, with all that it needs."""
    words: list[object] = [COMMAND_OF[name]]
    for one in command_of(name).params:
        if one.required:
            words += [one.opts[0], "new.h5"] if isinstance(one, click.Option) else ["missing.h5"]
    return words


def test_there_is_something_to_refuse():
    kinds = {type(arguments_of(PUBLIC[name].__wrapped__)[argument].kind) for name, argument, _, _ in ARGUMENTS}
    assert kinds == {Choice, Units, Flag, Whole, Percent, Number}
    assert len(ARGUMENTS) > 150


def test_a_share_is_a_percentage_on_the_command_line(call):
    names = [
        (name, argument, about.kind)
        for name in COMMAND_OF
        for argument, about in arguments_of(PUBLIC[name].__wrapped__).items()
        if isinstance(about.kind, Percent) and options_of(name, argument)
    ]
    assert {name for name, _, _ in names} == {"window", "report", "plot"}
    for name, argument, kind in names:
        for word in (f"{kind.low / 2:g}", f"{kind.high + 1:g} %", "much"):
            said = call(*line_of(name), *options_of(name, argument), word, code=2).err
            allowed = f"a percentage from {kind.low:g} to {kind.high:g}."
            assert said.startswith(f"Error: --{argument}: found {word}; allowed: {allowed}")


@pytest.mark.parametrize(("name", "argument", "value", "allowed"), ARGUMENTS)
def test_a_value_that_is_not_allowed_is_refused_in_one_sentence_alike(call, tmp_path, name, argument, value, allowed):
    """Before anything is read or written."""
    with pytest.raises(nsdrill.InputError) as refused:
        call_of(name, **{argument: value})
    assert str(refused.value) == f"{argument}: found {value!r}; allowed: {allowed}."
    word = word_of(arguments_of(PUBLIC[name].__wrapped__)[argument].kind, value)
    for text in options_of(name, argument) if word is not None else ():
        answer = call(*line_of(name), f"{text}={word}", code=2)
        found = repr(value) if word.lstrip("-").isdigit() and not isinstance(value, str) else repr(word)
        with naming_options():
            said = f"{option(argument)}: found {found}; allowed: {allowed}."
        assert (answer.out, answer.err) == ("", f"Error: {said}\n")
    assert not list(tmp_path.iterdir())


QUANTITIES = [
    (name, argument)
    for name in PUBLIC
    for argument, about in arguments_of(PUBLIC[name].__wrapped__).items()
    if about.metavar == "Q"
]
PRIOR = "model: torsion\nuncertain: {bit.friction.static: {uniform: [0.2, 0.8]}}\n"
LOG = "time [s],rotary_speed [rpm],stick_slip_index [%]\n0,60,1\n200,60,2\n400,60,2\n"


@pytest.mark.parametrize(("name", "argument"), QUANTITIES)
def test_a_quantity_of_another_kind_is_refused_alike(call, shared, name, argument):
    """Of files that are there, whose models know the ranges."""
    Path("prior.yaml").write_text(PRIOR)
    Path("log.csv").write_text(LOG)
    study = Path("prior.yaml") if name == "fit" else shared / "small.yaml"
    there = {"study": study, "results": shared / "small.h5", "trace": shared / "small.h5", "path": "new.gif"}
    there |= {"data": Path("log.csv") if name == "fit" else shared / "small.h5"}
    more = {"kind": "drive-card"} if name == "chart" else {}
    for value in ("3 kg", "3", "much"):
        with pytest.raises(nsdrill.InputError) as refused:
            call_of(name, **{key: there[key] for key in needed(name)}, **more, **{argument: value})
        said = re.sub("; a number is in [^.]*", "", str(refused.value))
        assert re.match(rf"{argument}: found '{value}'.*; allowed: a number with its unit \(", said)
        assert "\n" not in said
        if name == "animate":  # the option of plot
            continue
        words = [COMMAND_OF[name], there["study" if name in ("simulate", "fit", "chart") else "results"]]
        words += ["--data", "log.csv"] if name == "fit" else []
        words += ["--kind", "drive-card"] if name == "chart" else []
        if name not in ("sensitivity", "lyapunov_spectrum", "fit"):
            words += ["-o", "new.png" if COMMAND_OF[name] == "plot" else "new.h5"]
        said_there = call(*words, *options_of(name, argument), value, code=2).err
        with naming_options():
            assert said_there == f"Error: {said.replace(argument, option(argument), 1)}\n"
    assert {path.name for path in Path().iterdir()} == {"prior.yaml", "log.csv"}


FILES = [
    (name, argument, about.kind)
    for name in COMMAND_OF
    for argument, about in arguments_of(PUBLIC[name].__wrapped__).items()
    if isinstance(about.kind, File) and name != "chart"  # whose command reads results as well
]


@pytest.mark.parametrize(("name", "argument", "kind"), FILES)
def test_standard_streams_are_no_results_and_no_pictures(call, tmp_path, monkeypatch, name, argument, kind):
    """A study may be one: here an empty one."""
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO()))
    words = line_of(name)
    if (options := options_of(name, argument)) and options[0] in words:
        words[words.index(options[0]) + 1] = "-"
    elif options:
        words += [options[0], "-"]
    else:
        words = ["-" if word == "missing.h5" else word for word in words]
        words += ["-"] * ("-" not in words)
    answer = call(*words, code=2)
    assert answer.out == ""
    said = "found an empty document" if kind.stream else "found '-'; allowed: the name of a file. Standard input is for"
    assert said in answer.err
    assert not list(tmp_path.iterdir())


PAIRS = [
    (name, argument)
    for name in COMMAND_OF
    for argument, about in arguments_of(PUBLIC[name].__wrapped__).items()
    if isinstance(about.kind, Texts) and about.kind.pairs
]


@pytest.mark.parametrize(("name", "argument"), PAIRS)
def test_a_key_without_its_value_is_refused(call, name, argument):
    form = arguments_of(PUBLIC[name].__wrapped__)[argument].metavar
    for text in ("nonsense", "a=", "=b"):
        (found,) = options_of(name, argument)
        said = call(*line_of(name), found, text, code=2).err
        assert said == f"Error: {found}: found {text!r}; allowed: {form}, two names or values with = between them.\n"


@pytest.mark.parametrize("value", [3, None, "a.h5", iter(())])
def test_what_is_combined_is_a_list(value):
    with pytest.raises(
        nsdrill.InputError, match=r"^results: found (one of them|a value of the type \w+); allowed: a list"
    ):
        nsdrill.combine(value)
