"""The command line: a module or package for each of COMMANDS, imported when it is used.

The other packages hold what several commands share.
"""

from __future__ import annotations

import importlib
import logging

import click

from ..errors import nearest
from .options.records import Handler, verbose_option
from .process import terminal

COMMANDS = {  # with the first words of their help: the list of commands imports none of them
    "render": "Render each SCENE: a scene file, a mesh or a folder.",
    "view": "Show the scene file, mesh or folder SCENE in the browser, and let it be steered.",
    "merge": "Add FILMS, of `clpt render --samples FIRST:END -o NAME.film`, and write the picture.",
    "warm": "Compile the programs of SCENES into the caches, and render nothing.",
    "worker": "Render for the scheduler at ADDRESS, such as tls://192.168.1.5:8786, until it ends.",
    "cluster": "Render on several machines; see also `clpt worker`.",
    "devices": "List the OpenCL devices, and the choice among them.",
    "scenes": "List the scenes that come with clpt: path, size in pixels, what each shows.",
    "info": "Show what the file or folder SCENE holds, without rendering it.",
    "measure": "Measure light in SCENE at points or along rays, with standard errors.",
    "inspect": "Show what the image or film FILE holds, and the values of its pixels.",
    "convert": "Write the image or film SOURCE as TARGET, in another format or for a screen.",
    "compare": "Measure how the image or film A differs from B.",
    "kernels": "Write the OpenCL programs that render SCENE, each to its file.",
    "mie": "Make the medium of spheres of RADIUS micrometres: fog, mist, milk.",
    "lens": "Describe LENS: a file (.dat, .zmx, .txt) or a name of the library.",
    "completion": "Let the TAB key of a SHELL complete clpt's commands, options and values.",
    "bench": "Measure pictures, rays, stages of rendering, builds and starts of an OpenCL device.",
}


class _Listed(click.Group):
    """A group whose help lists commands in their own order."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(self.commands)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        name = args[0]
        missing = not name.startswith("-") and self.get_command(ctx, name) is None
        if missing and not ctx.resilient_parsing:
            ctx.fail(f"there is no command {name!r}{nearest(name, self.list_commands(ctx))}")
        return super().resolve_command(ctx, args)


class _Commands(_Listed):
    """A group whose commands are `clpt.cli.<name>.<name>`."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in COMMANDS:
            return None
        return getattr(importlib.import_module(f"{__name__}.{cmd_name}"), cmd_name)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl([*COMMANDS.items()])


def _tell_version(ctx: click.Context, _: click.Parameter, asked: bool) -> None:
    """Print the version and leave."""
    if asked:
        from clpt import version

        terminal.write(f"clpt {version.described()}")
        ctx.exit()


@click.group(cls=_Commands, invoke_without_command=True)
@verbose_option("Log more; twice for everything.")
@click.option(
    "--version", is_flag=True, is_eager=True, expose_value=False, callback=_tell_version,
    help="Print the version, and the commit that it was made from.",
)  # fmt: skip
@click.pass_context
def cli(ctx: click.Context, verbose: int) -> None:
    """clpt, a spectral path tracer in OpenCL."""
    logging.basicConfig(handlers=[Handler()], format="%(message)s")
    if ctx.invoked_subcommand is None:
        terminal.write(ctx.get_help())
