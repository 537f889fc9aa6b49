"""nsdrill schema."""

from __future__ import annotations

from typing import Annotated

from nsdrill.cli.building import Given, command_of, model_name, say, write
from nsdrill.late import deferred
from nsdrill.operations.arguments import Model, Overwrite, Stream

with deferred():
    from nsdrill import data, study


@command_of(examples=("schema -o study.schema.json", "schema | less"))
def command(
    given: Given,
    output: Annotated[Stream, "Schema file to write. Default, and -: standard output."] = None,
    model: Model = None,
    overwrite: Overwrite = False,
) -> int:
    """Print the JSON Schema of the study file, for editors and other programs."""
    text = data.json_text(study.json_schema(model_name(model)), indent=2)
    write(output, f"{text}\n", overwrite)
    if output not in (None, "-"):
        say(f"{output}: written. A study names it in its first line: # yaml-language-server: $schema={output}")
    return 0
