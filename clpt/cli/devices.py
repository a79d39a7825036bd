"""`clpt devices`: the OpenCL devices, and the choice among them."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import click

from ..errors import DeviceError
from .options.records import verbose_option
from .process import terminal

if TYPE_CHECKING:
    from rich.table import Table

    from ..device.context import DeviceInfo


@click.command()
@click.option("--json", "json_wanted", is_flag=True, help="Write JSON instead of a table.")
@verbose_option("Show full names and drivers; log more, twice for everything.")
def devices(json_wanted: bool, verbose: int) -> None:
    """List the OpenCL devices, and the choice among them.

    Each is tried with a trivial kernel. Choose another device by --device NAME-OR-INDEX or by
    the environment variable CLPT_DEVICE; a part of the name is enough.
    """
    from .. import device  # here: help needs no OpenCL
    from ..device import runtimes
    from ..device.choosing import selection, trial
    from .console import output_console, shown
    from .display import device_name

    listed = device.devices()
    if not listed:
        raise DeviceError(f"no OpenCL device: {runtimes.advice()}")
    failures = {info.index: trial(info) for info in listed}
    if json_wanted:
        terminal.write(json.dumps(as_json(listed, failures), indent=2))
        return
    console = output_console()
    try:
        choice = selection()
    except DeviceError:
        console.print(table(listed, failures, None, bool(verbose)))
        raise
    console.print(table(listed, failures, choice.info.index, bool(verbose)))
    name = choice.info.label if verbose else device_name(choice.info)
    console.print(shown(f"Taken: [{choice.info.index}] {name} ({choice.reason})"))


def as_json(listed: tuple[DeviceInfo, ...], failures: dict[int, str | None]) -> dict[str, object]:
    """Return the facts of devices, and the chosen device. Raises DeviceError."""
    from ..device.choosing import selection

    choice = selection()
    hidden = ("cl_device",)
    rows = []
    for info in listed:
        row = {name: value for name, value in vars(info).items() if name not in hidden}
        rows.append({**row, "lanes": info.lanes, "failure": failures[info.index]})
    return {"devices": rows, "taken": choice.info.index, "reason": choice.reason}


def table(
    listed: tuple[DeviceInfo, ...],
    failures: dict[int, str | None],
    taken: int | None,
    verbose: bool = False,
) -> Table:
    """Return a table of devices, of 80 columns or less where they work.

    taken: the index of the chosen device; verbose: whether to show full names and drivers.
    """
    from rich.table import Table

    from .console import shown
    from .display import device_name

    rows = Table(box=None, pad_edge=False)
    names = ("platform", "device", "driver") if verbose else ("device",)
    for heading in ("", *names, "kind", "units", "memory", "lanes", "state"):
        right = heading in ("units", "memory", "lanes")
        rows.add_column(heading, justify="right" if right else "left", overflow="fold")
    for info in listed:
        failure = failures[info.index]
        labels = (info.platform, info.name, info.driver) if verbose else (device_name(info),)
        rows.add_row(
            f"{'*' if info.index == taken else ' '} {info.index}",
            *map(shown, labels),
            info.kind.upper() if info.kind != "accelerator" else info.kind,
            str(info.compute_units),
            f"{info.global_mem / 2**30:.1f} GiB",
            str(info.lanes),
            "works" if failure is None else shown(f"fails: {failure}"),
            style="bold" if info.index == taken else None,
        )
    return rows
