"""`clpt info`: what a scene file holds, without rendering it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..errors import SceneError
from ..formats import errors_of, locate
from .options.scene_options import Loading, loading_options
from .options.values import ScenePath
from .process import terminal

if TYPE_CHECKING:
    from ..scene import Scene


def read_scene(scene: Path, loading: Loading) -> Scene:
    """Return the scene of a file. Raises SceneError behind the list of all its errors."""
    try:
        return loading.read(scene)
    except SceneError as error:
        raise all_of(error, errors_of(locate(scene), **loading.variables)) from None


def all_of(first: SceneError, errors: list[SceneError]) -> SceneError:
    """Print all errors of a file, if there are several; return the error to end with."""
    if len(errors) < 2:
        return first
    for error in errors:
        terminal.say(error)
    return SceneError(f"{len(errors)} things above keep it from being read", file=first.file)


@click.command()
@click.argument("scene", type=ScenePath())
@loading_options
@click.option("--json", "as_json", is_flag=True, help="Write JSON instead of a table.")
def info(scene: Path, variables: dict[str, Any], as_json: bool) -> None:
    """Show what the file or folder SCENE holds, without rendering it.

    Of a scene of Mitsuba or PBRT that cannot be read, all reasons are listed, with file and line.
    Of a film, a checkpoint or an image, what it says of itself: see `clpt inspect` for its values.
    """
    locate(scene)
    # Imported where they are needed: help needs none of them, and some bring OpenCL.
    from ..images import READERS
    from .files.targets import is_film

    contents: dict[str, Any]
    if is_film(scene):
        from .files.image_contents import film_summary

        contents = film_summary(scene)
    elif scene.suffix.lower() in READERS:
        from .files.image_contents import read_contents

        contents = dict(read_contents(scene).facts)
    else:
        loaded = read_scene(scene, Loading(variables))
        from .files.scene_contents import summary, tidy

        contents = summary(loaded)
        contents = contents if as_json else tidy(contents)
    if as_json:
        terminal.write(json.dumps(contents, indent=2))
        return
    from rich.table import Table

    from .console import output_console, shown

    console, table = output_console(), Table(show_header=False)
    for name, value in contents.items():
        table.add_row(name.replace("_", " "), shown(value))
    console.print(shown(scene))
    console.print(table)
