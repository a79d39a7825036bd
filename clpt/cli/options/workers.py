"""The options `--cluster` and `--keys`: workers that render in the place of this machine."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import click

from .records import Command, with_options

LOCAL = "local:"


class Where(click.ParamType):
    """The address of a scheduler, or local:N."""

    name = "ADDRESS"

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> str:
        text = str(value)
        if not re.fullmatch(rf"{LOCAL}[1-9]\d{{0,2}}|tls://.+:\d+", text):
            self.fail(f"{text!r} is neither tls://HOST:PORT nor local:N")
        return text


@dataclass(frozen=True)
class Workers:
    """Where workers are, None for none, and the folder of their cluster's keys."""

    cluster: str | None = None
    keys: Path | None = None

    @property
    def number(self) -> int | None:
        """The number of workers to start on this machine; None where an address has its own."""
        where = self.cluster or ""
        return int(where.removeprefix(LOCAL)) if where.startswith(LOCAL) else None


def worker_options(text: str) -> Callable[[Command], Command]:
    """Return what gives a command the options of which `Workers` is the record.

    text: the help of --cluster.
    """
    options = (
        click.option("--cluster", type=Where(), help=text),
        click.option(
            "--keys", type=click.Path(path_type=Path),
            help="Folder of the cluster's keys.  "
            "[default: that of clpt cluster start on this machine]",
        ),
    )  # fmt: skip
    return lambda command: with_options(command, options)
