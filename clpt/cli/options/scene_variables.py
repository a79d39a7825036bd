"""The option `-D NAME=VALUE` of the commands that load a scene."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import click

RESERVED = (
    "kinds",
    "progress",
    "missing_textures",
    "budget",
)  # parameters of clpt.load that are no variables


def _parse(_: click.Context, __: click.Parameter, definitions: Iterable[str]) -> dict[str, Any]:
    """Return NAME=VALUE options as a dictionary. Raises click.BadParameter."""
    pairs = [definition.partition("=") for definition in definitions]
    wrong = next((name for name, equals, _ in pairs if not (name and equals)), None)
    if wrong is not None:
        raise click.BadParameter(f"{wrong!r} does not look like NAME=VALUE", param_hint="-D")
    for name in RESERVED:
        if any(name == given for given, _, _ in pairs):
            raise click.BadParameter(f"no variable can be called {name}", param_hint="-D")
    return {name: value for name, _, value in pairs}


# Gives a command the parameter `variables`, for `clpt.load`.
scene_variables = click.option(
    "-D",
    "variables",
    multiple=True,
    metavar="NAME=VALUE",
    callback=_parse,
    is_eager=True,  # before --camera, which adds to it
    help="Set a $name of an .xml; of glTF scene, animation or time. See --frames for {frame}.",
)
