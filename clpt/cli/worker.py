"""`clpt worker`: render for a cluster."""

from __future__ import annotations

from pathlib import Path

import click

from .options.records import verbose_option, with_records
from .options.scene_options import Machine
from .process import terminal


@click.command()
@click.argument("address")
@click.option(
    "--device", metavar="NAME-OR-INDEX",
    help="Where to render: see `clpt devices`; all, gpu, or several as 0,2.",
)  # fmt: skip
@click.option("--threads", type=click.IntRange(1), help="Cores of a CPU to use, at most.")
@click.option("--host", metavar="ADDRESS", help="Address of this machine for the others.")
@click.option(
    "--keys", type=click.Path(path_type=Path),
    help="Folder of the cluster's keys.  [default: that of clpt cluster start on this machine]",
)  # fmt: skip
@click.option("--name", help="What the worker is called.  [default: its address]")
@verbose_option("Log more; twice for everything.")
@click.option("--quiet", is_flag=True, help="Print nothing.")
@with_records(machine=Machine)
def worker(
    address: str,
    machine: Machine,
    host: str | None,
    keys: Path | None,
    name: str | None,
    verbose: int,
    quiet: bool,
) -> int:
    """Render for the scheduler at ADDRESS, such as tls://192.168.1.5:8786, until it ends.

    It renders with a single device, or with several: --device all, gpu, or 0,2. Who has the keys of
    the cluster can run any program here, as you can.
    """
    from ..cluster import processes, tasks

    chosen = " and ".join(
        on.info.label for on in tasks.choose_devices(machine.device, machine.threads)
    )

    def tell(text: str) -> None:
        if not quiet:
            terminal.say(f"{text}, on {chosen}")

    return processes.run_worker(address, host=host, folder=keys, name=name, tell=tell)
