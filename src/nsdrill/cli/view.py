"""nsdrill view."""

from __future__ import annotations

import click

from nsdrill.cli import options


@click.command(
    "view",
    epilog=options.examples(
        "view out.h5", "view study.yaml --set 'operation.wob=30 kN'", "view out.h5 --no-browser --port 8123"
    ),
)
@options.file_argument("file")
@click.option("--port", type=int, default=0, metavar="N", help="Port to listen on. Default: any that is free.")
@click.option("--no-browser", is_flag=True, help="Print the address only; open no browser.")
@click.option(
    "--set",
    "overrides",
    multiple=True,
    type=options.Word(options.changes),
    metavar="KEY=VALUE",
    help="With a study: change a key of it, e.g. --set 'operation.wob=30 kN'. May be given more than once.",
)
@click.option(
    "--over", type=options.FileName(), metavar="BRANCHES.h5", help="With results: draw these branches over their peaks."
)
@options.units
def command(
    file: str, port: int, no_browser: bool, overrides: tuple[str, ...], over: str | None, units: str | None
) -> int:
    """Explore FILE in the browser: results, the .part file of a run that goes on,
    branches, or a study.

    A click on a point runs it again, bit for bit, and shows its motion; sliders run on
    from there. The page is served on this machine only, to those who have its address,
    and ends with its tab or with Ctrl-C.
    """
    import webbrowser
    from contextlib import ExitStack

    from nsdrill import interrupt
    from nsdrill.web.server import Explorer
    from nsdrill.web.session import Session

    explorer = Explorer(Session(file, units, list(overrides), over), port)
    try:
        with interrupt.interruptible(), ExitStack() as stack:
            explorer.start()
            click.echo(explorer.url)
            click.echo("The explorer stops with its page, or with Ctrl-C.", err=True)
            if not no_browser and not webbrowser.open(stack.enter_context(explorer.private_page())):
                click.echo("No browser could be opened: open the address above in one.", err=True)
            reason = explorer.wait(interrupt.check)
    except KeyboardInterrupt:
        reason = "Stopped."
    finally:
        explorer.close()
    click.echo(reason, err=True)
    return 0
