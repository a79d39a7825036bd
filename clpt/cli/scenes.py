"""`clpt scenes`: the scenes that come with clpt."""

from __future__ import annotations

import json

import click

from ..formats import own_scenes
from .process import terminal


@click.command()
@click.option("--json", "as_json", is_flag=True, help="Write JSON instead of a table.")
@click.option(
    "--schema", is_flag=True,
    help="Print the address of the JSON Schema alone, for \"$schema\" in a scene.json of your own: "
    "editors complete and check it by that.",
)  # fmt: skip
def scenes(as_json: bool, schema: bool) -> None:
    """List the scenes that come with clpt: path, size in pixels, what each shows.

    Each path works in any folder, as in `clpt render scenes/prism`.
    """
    if schema:
        terminal.write((own_scenes.scenes_folder() / "schema.json").as_uri())
        return
    rows = list(own_scenes.rows())
    if as_json:
        terminal.write(json.dumps(rows, indent=2))
        return
    from rich.table import Table

    from .console import output_console, shown

    table = Table("scene", "size", "what it shows")
    for row in rows:
        size = "" if row["size"] is None else "x".join(map(str, row["size"]))
        table.add_row(*map(shown, (row["path"], size, row["text"])))
    output_console().print(table)
