"""The command line: a module or package for each of COMMANDS, imported when it is used.

The other packages hold what several commands share.
"""

from __future__ import annotations

import importlib
import logging

import click

from .options.verbosity import verbose_option

COMMANDS = (
    "render", "view", "merge", "warm", "worker", "cluster", "devices", "info", "inspect", "kernels",
    "mie", "lens", "bench",
)  # fmt: skip


class _Commands(click.Group):
    """A group whose commands are `clpt.cli.<name>.<name>`."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in COMMANDS:
            return None
        return getattr(importlib.import_module(f"{__name__}.{cmd_name}"), cmd_name)


@click.group(cls=_Commands, invoke_without_command=True)
@verbose_option("Log more; twice for everything.")
@click.version_option(package_name="clpt")
@click.pass_context
def cli(ctx: click.Context, verbose: int) -> None:
    """clpt, a spectral path tracer in OpenCL."""
    logging.basicConfig(format="clpt: %(levelname)s: %(message)s")
    if ctx.invoked_subcommand is None:
        click.echo(ctx.get_help())
