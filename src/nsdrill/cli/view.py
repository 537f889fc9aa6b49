"""nsdrill view."""

from __future__ import annotations

import webbrowser
from contextlib import ExitStack
from typing import Annotated

import click

from nsdrill import interrupt
from nsdrill.cli.building import Given, command_of, say
from nsdrill.operations import pictures
from nsdrill.operations.argument import Argument, Whole
from nsdrill.operations.arguments import Switch


@command_of(
    pictures.view,
    examples=("view out.h5", "view study.yaml --set 'operation.wob=30 kN'", "view out.h5 --no-browser --port 8123"),
)
def command(
    given: Given,
    port: Annotated[
        int | None, Argument("Port to listen on. Default: any that is free.", metavar="N", kind=Whole())
    ] = None,
    no_browser: Annotated[Switch, "Print the address only; open no browser."] = False,
) -> int:
    """Explore FILE in the browser: results, the .part file of a run that goes on,
    branches, or a study.

    A click on a point runs it again, bit for bit, and shows its motion; sliders run on
    from there. The page is served on this machine only, to those who have its address,
    and ends with its tab or with Ctrl-C.
    """
    explorer = pictures.explorer(**given, port=port or 0)
    try:
        with interrupt.interruptible(), ExitStack() as stack:
            explorer.start()
            click.echo(explorer.url)
            say("The explorer stops with its page, or with Ctrl-C.")
            if not no_browser and not webbrowser.open(stack.enter_context(explorer.private_page())):
                say("No browser could be opened: open the address above in one.")
            reason = explorer.wait(interrupt.check)
    except KeyboardInterrupt:
        reason = "Stopped."
    finally:
        explorer.close()
    say(reason)
    return 0
