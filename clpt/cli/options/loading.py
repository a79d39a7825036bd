"""Options of commands that load a scene: its variables, and limits of the load."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable, Iterable
from typing import Any

import click

from clpt.files import budget

from .records import Command, with_options

RESERVED = ("kinds", "progress", "missing_textures", "budget")  # parameters of clpt.load


class Bytes(click.ParamType):
    """A number of bytes, such as 500M or 2G."""

    name = "SIZE"

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> Any:
        form, text = r"(\d{1,15}(?:\.\d+)?)\s*([KMGT]?)i?B?", str(value).strip()
        match = re.fullmatch(form, text, re.IGNORECASE)
        if match is None:
            self.fail(f"{value!r} is no size in memory; write 500M or 2G", param, ctx)
        return int(float(match[1]) * 1024 ** " KMGT".index(match[2].upper() or " "))


def _limit(name: str) -> Callable[[Any, Any, Any], None]:
    """Return the callback of an option that limits all loads of the command."""

    def set_limit(_: click.Context, __: click.Parameter, value: Any) -> None:
        budget.set_usual(dataclasses.replace(budget.usual, **{name: value}))

    return set_limit


def _parse(_: click.Context, __: click.Parameter, definitions: Iterable[str]) -> dict[str, Any]:
    """Return NAME=VALUE options as a dictionary. Raises click.BadParameter."""
    pairs = [definition.partition("=") for definition in definitions]
    wrong = next((name for name, equals, _ in pairs if not (name and equals)), None)
    if wrong is not None:
        raise click.BadParameter(f"{wrong!r} does not look like NAME=VALUE", param_hint="-D")
    for name in RESERVED:
        if any(name == known for known, _, _ in pairs):
            raise click.BadParameter(f"no variable can be called {name}", param_hint="-D")
    return {name: value for name, _, value in pairs}


def _add_variants(ctx: click.Context, _: click.Parameter, variants: tuple[str, ...]) -> None:
    """Make the variants a variable of the scene."""
    if variants:
        ctx.params["variables"]["variant"] = ",".join(variants)


_OPTIONS = (
    click.option(
        "-D", "variables", multiple=True, metavar="NAME=VALUE", callback=_parse,
        is_eager=True,  # before --camera, which adds to it
        help="Set a $name of an .xml; of glTF scene, animation or time. See --frames for {frame}.",
    ),
    click.option(
        "--variant", multiple=True, metavar="SET=NAME", expose_value=False, callback=_add_variants,
        help="Select a variant of USD, or by its NAME of glTF.",
    ),
    click.option(
        "--load-memory", type=Bytes(), metavar="SIZE", expose_value=False,
        callback=_limit("memory"),
        help="Memory that reading the scene may take, such as 8G, if you trust its files.  "
        "[default: half the free, and what fits the size of its files]",
    ),
    click.option(
        "--load-seconds", type=click.FloatRange(0.0, min_open=True), metavar="SECONDS",
        expose_value=False, callback=_limit("seconds"),
        help=f"Time that it may take.  [default: {budget.SECONDS:g}]",
    ),
    click.option(
        "--load-parts", type=click.IntRange(1), metavar="N", expose_value=False,
        callback=_limit("parts"), help="Elements, shapes and instances that it may have.  "
        "[default: what fits the size of its files]",
    ),
)  # fmt: skip


def loading_options(command: Command) -> Command:
    """Give a command the parameter `variables`, and options that limit loads."""
    return with_options(command, _OPTIONS)
