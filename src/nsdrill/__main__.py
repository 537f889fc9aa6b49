"""The start of the command ``nsdrill``, and of ``python -m nsdrill``: signals are
received before anything is imported."""

from typing import NoReturn

from nsdrill import interrupt


def main() -> NoReturn:
    """Entry point of the console script."""
    interrupt.listen()
    from nsdrill.cli import main as command

    command()


if __name__ == "__main__":
    main()
