"""The command line: parse, call a use case, print. One file a command, imported when it
is used."""
