"""Options of commands as records."""

from __future__ import annotations

from dataclasses import dataclass

import click
import pytest

from clpt.cli import COMMANDS, cli
from clpt.cli.options.records import record_of, with_options, with_records


@dataclass(frozen=True)
class Size:
    width: int = 3
    height: int = 4


@dataclass(frozen=True)
class Film:
    size: Size
    mode: str | None
    seed: int | None = None


def test_a_record_takes_what_its_fields_name():
    given = {"width": 7, "mode": "rgb", "other": 1}
    assert record_of(Film, given) == Film(Size(7, 4), "rgb")
    with pytest.raises(TypeError, match="mode"):
        record_of(Film, {})


def test_a_command_takes_records_and_the_rest(capsys):
    options = [click.option("--width", type=int, default=9), click.option("--mode")]

    @click.command()
    @lambda command: with_options(command, [*options, click.option("--quiet", is_flag=True)])
    @with_records(film=Film, size=Size)
    def show(film: Film, size: Size, quiet: bool) -> None:
        """Show records."""
        click.echo(f"{film} {size} {quiet}")

    show.main(["--mode", "rgb", "--quiet"], standalone_mode=False)
    told = capsys.readouterr().out
    size = "Size(width=9, height=4)"
    assert told == f"Film(size={size}, mode='rgb', seed=None) {size} True\n"
    with click.Context(show) as context:
        shown = show.get_help(context)
    assert shown.index("--width") < shown.index("--mode") < shown.index("--quiet")
    assert "Show records." in shown


def test_every_option_of_a_command_has_one_name():
    """Records take options by the names of parameters: two of one name would be one."""
    with click.Context(cli) as context:
        for name in COMMANDS:
            command = cli.get_command(context, name)
            names = [parameter.name for parameter in command.params if parameter.expose_value]
            assert len(names) == len({*names}), name
