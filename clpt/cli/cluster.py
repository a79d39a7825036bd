"""`clpt cluster`: the process that workers and clients meet at."""

from __future__ import annotations

from pathlib import Path

import click

from .options.records import verbose_option
from .process import terminal


@click.group()
def cluster() -> None:
    """Render on several machines; see also `clpt worker`."""


@cluster.command()
@click.option(
    "--host", default="127.0.0.1", show_default=True,
    help="Address to listen at; that of this machine in a network lets other machines connect.",
)  # fmt: skip
@click.option("--port", type=click.IntRange(0, 65535), default=8786, show_default=True)
@click.option(
    "--keys", type=click.Path(path_type=Path),
    help="Folder of the keys, which are made if it has none.  [default: one of your own]",
)  # fmt: skip
@verbose_option("Log more; twice for everything.")
def start(host: str, port: int, keys: Path | None, verbose: int) -> int:
    """Run the scheduler of a cluster, until Ctrl-C.

    It prints its address, for `clpt worker` and `clpt render --cluster`. Who has the folder of its
    keys may use the cluster, as you may: copy it to other machines, and to nobody else. On this
    machine commands of yours find it by themselves.
    """
    from ..cluster import processes
    from ..cluster.processes import default_folder

    def tell(address: str) -> None:
        keyed = "" if keys is None else f" --keys {keys}"
        terminal.say(address, err=False)
        terminal.say(f"keys:     {default_folder() if keys is None else keys}")
        terminal.say(f"workers:  clpt worker {address}{keyed}")
        terminal.say(f"pictures: clpt render SCENE --cluster {address}{keyed}")

    return processes.run_scheduler(host, port, folder=keys, tell=tell)
