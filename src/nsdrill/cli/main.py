"""The group of commands, the standard streams, and the messages of errors."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from importlib import import_module
from typing import NoReturn, TextIO

import click

from nsdrill import __version__, errors, interrupt
from nsdrill.cli.overview import COMMANDS, GROUPS, QUANTITIES, SCRIPTS_GIVEN, overview
from nsdrill.errors import CacheWarning, FileWarning, NsdrillError, RunWarning, naming_options


class CommandExit(Exception):
    """End the command with this message and exit code. click would choose its own for
    an interrupt or a closed pipe."""

    def __init__(self, message: str, code: int) -> None:
        super().__init__(message)
        self.message, self.code = message, code


class _Stream:
    """A standard stream whose errors go to ``on_error``, so that they are not mistaken
    for those of a file."""

    def __init__(self, stream: TextIO, on_error: Callable[[OSError], None]) -> None:
        self._stream, self._on_error = stream, on_error

    def write(self, text: str) -> int:
        try:
            self._stream.write(text)
        except OSError as error:
            self._on_error(error)
        return len(text)

    def flush(self) -> None:
        try:
            self._stream.flush()
        except OSError as error:
            self._on_error(error)

    def __getattr__(self, name: str) -> object:
        return getattr(self._stream, name)


@contextmanager
def standard_streams() -> Iterator[None]:
    """Data that cannot be written raise :class:`CommandExit`; a message that cannot be
    written is dropped. Warnings of nsdrill become messages."""
    _open_closed()
    data, messages = sys.stdout, sys.stderr
    errors.file_warnings.clear()
    with (
        redirect_stdout(_Stream(data, _output_failed)),
        redirect_stderr(_Stream(messages, lambda error: None)),
        warnings.catch_warnings(),
    ):
        for category in (CacheWarning, FileWarning, RunWarning):
            warnings.simplefilter("always", category)
        original = warnings.showwarning

        def show(
            message: Warning | str,
            category: type[Warning],
            filename: str,
            lineno: int,
            file: TextIO | None = None,
            line: str | None = None,
        ) -> None:
            if issubclass(category, FileWarning):
                errors.file_warnings.append(str(message))
            if os.environ.get("NSDRILL_DEBUG"):
                original(message, category, filename, lineno, file, line)
            else:
                other = (
                    "" if issubclass(category, CacheWarning | FileWarning | RunWarning) else f"{category.__name__}: "
                )
                click.echo(f"Warning: {other}{errors.message(str(message))}", err=True)

        warnings.showwarning = show
        try:
            yield
        finally:
            for stream in (data, messages):
                try:
                    stream.flush()
                except OSError:  # or the interpreter fails with it at its end
                    os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def _open_closed() -> None:
    """Open closed streams under their numbers: else the next file to be opened gets
    one, and what a library prints goes into it. Output is opened for reading only, so
    that writing data is still an error."""
    for name in ("stdin", "stdout", "stderr"):
        if getattr(sys, name) is None:
            # takes the lowest free number
            null = os.open(os.devnull, os.O_RDWR if name == "stderr" else os.O_RDONLY)
            os.set_inheritable(null, True)
            setattr(sys, name, open(null, "r" if name == "stdin" else "w", encoding="utf-8"))  # noqa: SIM115


def _output_failed(error: OSError) -> NoReturn:
    if isinstance(error, BrokenPipeError):
        raise CommandExit("", 0) from error  # the reader has closed the pipe (`| head`)
    raise CommandExit(f"Error: standard output: cannot be written: {error.strerror}.", 1) from error


SETTINGS = {"help_option_names": ["-h", "--help"], "max_content_width": 110}


def _execute(ctx: click.Context, param: click.Parameter, files: tuple[str, ...]) -> None:
    """Execute the scripts that a command is given, before its other options are read: their
    words may be those of a model. No study and no file of results executes one."""
    if files and not ctx.resilient_parsing:
        from nsdrill.script.executed import execute

        for file in files:
            execute(file)
        ctx.meta[SCRIPTS_GIVEN] = (*ctx.meta.get(SCRIPTS_GIVEN, ()), *files)


# Of the group and of every command.
SCRIPTS = click.Option(
    ["--with"],
    metavar="FILE",
    multiple=True,
    is_eager=True,
    expose_value=False,
    callback=_execute,
    help="Execute a Python script first, for its models; may be repeated.",
)


class LazyGroup(click.Group):
    """A group that imports a command when it is called."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in COMMANDS:
            return None
        room = next(title.lower() for title, commands in GROUPS.items() if cmd_name in commands)
        command: click.Command = getattr(import_module(f"nsdrill.cli.{room}_group"), cmd_name)
        if SCRIPTS not in command.params:
            command.params.append(SCRIPTS)
        takes_quantities = any("Q" in (one.metavar or "").split() for one in command.params)
        if takes_quantities and QUANTITIES not in (command.epilog or ""):
            command.epilog = f"{command.epilog}\n\n{QUANTITIES}"
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        try:
            return super().resolve_command(ctx, args)
        except click.UsageError:
            import difflib

            near = difflib.get_close_matches(args[0], COMMANDS, n=1)
            hint = f" Did you mean {near[0]}?" if near else ""
            text = f"There is no command {args[0]!r}.{hint} Commands: {', '.join(COMMANDS)}."
            raise click.UsageError(text, ctx) from None

    def format_help(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        formatter.write(overview(formatter.width))

    def invoke(self, ctx: click.Context) -> object:
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt as error:
            raise CommandExit(str(error) or interrupt.NOTHING, interrupt.EXIT_CODE) from error
        except EOFError as error:  # click treats it as an interrupt
            raise RuntimeError(f"EOFError: {error}") from error


@click.group(cls=LazyGroup, context_settings=SETTINGS)
@click.version_option(__version__, "-V", "--version", prog_name="nsdrill", message="%(prog)s %(version)s")
def group() -> None:
    """The commands; :func:`overview` is their help."""


group.params.append(SCRIPTS)


def main() -> NoReturn:
    """Run the command of the arguments of the process, and exit with its code."""
    # That of a notebook, which its cells hand on, may not exist here, and files need none.
    os.environ["MPLBACKEND"] = "agg"
    with naming_options(), standard_streams():
        interrupt.listen()
        try:
            _run_command()
        finally:
            interrupt.ignore_signals()


def _run_command() -> NoReturn:
    if sys.stdout is not None and hasattr(sys.stdout, "reconfigure"):
        # as on standard error: a name or title that cannot be encoded is no error
        sys.stdout.reconfigure(errors="backslashreplace")
    try:
        code = group.main(prog_name="nsdrill", standalone_mode=False)
        sys.stdout.flush()
        sys.exit(code if isinstance(code, int) else 0)
    except CommandExit as end:
        _leave(end.message, end.code)
    except (click.exceptions.Abort, KeyboardInterrupt):
        _leave(interrupt.NOTHING, interrupt.EXIT_CODE)
    except click.ClickException as error:
        error.show()
        sys.exit(error.exit_code)
    except NsdrillError as error:
        _leave(f"Error: {error}", error.exit_code)
    except MemoryError:
        _leave("Error: out of memory. Sweep fewer points at once, or sample a trace more coarsely.", 1)
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        _leave(f"Error: {where}{error.strerror or error}.", 1)
    except Exception as error:
        if os.environ.get("NSDRILL_DEBUG"):
            raise
        _leave(_unexpected(error), 1)


def _unexpected(error: Exception) -> str:
    """The message for an unexpected error, which may be one of a model in another
    package."""
    description = errors.message(f"{type(error).__name__}: {error}")
    registry = sys.modules.get("nsdrill.models.registry")
    others = registry.other_packages() if registry is not None else ()
    if registry is not None and others:
        which = f"The model {others[0]} comes from another package"
        if len(others) > 1:
            which = f"The models {', '.join(others)} come from other packages"
        return (
            f"Error: {description}{registry.place_in_other_packages(error)}. {which}, and the fault may be there: the "
            "same command under NSDRILL_DEBUG=1 says where it was found. If it is in nsdrill, please report it."
        )
    return (
        f"Error: this should not happen and is a bug of nsdrill ({description}). Please report it "
        "with the output of the same command under NSDRILL_DEBUG=1."
    )


def _leave(message: str, code: int) -> NoReturn:
    if code == interrupt.EXIT_CODE and interrupt.requested():
        interrupt.end(message)
    interrupt.wait_if_ending()
    if message:
        click.echo(message, err=True)
    sys.exit(code)
