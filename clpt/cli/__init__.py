"""The command line: one module for each of COMMANDS, imported when it is used."""

from __future__ import annotations

import importlib
import logging

import click

COMMANDS = ("render", "devices", "info", "inspect", "kernels", "bench")


class _Commands(click.Group):
    """A group whose commands are `clpt.cli.<name>.<name>`."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in COMMANDS:
            return None
        return getattr(importlib.import_module(f"{__name__}.{cmd_name}"), cmd_name)


@click.group(cls=_Commands, invoke_without_command=True)
@click.option("-v", "--verbose", count=True, help="Log more; twice for everything.")
@click.version_option(package_name="clpt")
@click.pass_context
def cli(ctx: click.Context, verbose: int) -> None:
    """clpt, a spectral path tracer in OpenCL."""
    level = (logging.WARNING, logging.INFO, logging.DEBUG)[min(verbose, 2)]
    logging.basicConfig(format="clpt: %(levelname)s: %(message)s")
    logging.getLogger("clpt").setLevel(level)
    if ctx.invoked_subcommand is None:
        click.echo(ctx.get_help())
