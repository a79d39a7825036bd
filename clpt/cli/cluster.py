"""`clpt cluster`: the process that workers and clients meet at."""

from __future__ import annotations

from pathlib import Path

import click

from .verbosity import verbose_option


@click.group()
def cluster() -> None:
    """Render on several machines; see also `clpt worker`."""


@cluster.command()
@click.option(
    "--host", default="127.0.0.1", show_default=True,
    help="Address to listen at; another than this machine's own needs --keys.",
)  # fmt: skip
@click.option("--port", type=click.IntRange(0, 65535), default=8786, show_default=True)
@click.option(
    "--keys", type=click.Path(path_type=Path),
    help="Folder of the keys; they are made if it has none. Connections are encrypted then.",
)  # fmt: skip
@verbose_option("Log more; twice for everything.")
def start(host: str, port: int, keys: Path | None, verbose: int) -> int:
    """Run the scheduler of a cluster, until Ctrl-C.

    It prints its address, for `clpt worker` and `clpt render --cluster`. With --keys, who has the
    folder may render; copy it to the other machines.
    """
    from ..cluster import processes

    def tell(address: str) -> None:
        keyed = "" if keys is None else f" --keys {keys}"
        click.echo(address)
        click.echo(f"workers:  clpt worker {address}{keyed}", err=True)
        click.echo(f"pictures: clpt render SCENE --cluster {address}{keyed}", err=True)

    return processes.run_scheduler(host, port, folder=keys, tell=tell)
