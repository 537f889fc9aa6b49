"""The command line: parse, call a use case, print. One file a command, imported when it
is used."""

from nsdrill.cli.main import main

__all__ = ["main"]
