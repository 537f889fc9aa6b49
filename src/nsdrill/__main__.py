"""The start of the command ``nsdrill``, and of ``python -m nsdrill``: signals are
received before anything is imported."""

import gc
import sys
from typing import NoReturn

from nsdrill import interrupt


def main() -> NoReturn:
    """Entry point of the console script."""
    interrupt.listen()
    gc.set_threshold(200_000)  # the start makes that many objects that stay: a tenth of its time
    if sys.argv[1:] in (["--help"], ["-h"]):  # in half the time of importing click
        from nsdrill.cli.overview import printed

        if printed():  # else the command line says why not
            interrupt.ignore_signals()
            sys.exit(0)
    from nsdrill.cli.main import main as command

    try:
        command()
    finally:
        gc.freeze()  # the interpreter would look through all that stays before it ends: another tenth


if __name__ == "__main__":
    main()
