"""`clpt devices`: what there is to run on, what would be taken, and why."""

from __future__ import annotations

import json

import click
from rich.table import Table

from .. import device
from ..device import runtimes
from ..device.context import DeviceInfo, selection, trial
from ..errors import DeviceError
from .output_console import output_console


@click.command()
@click.option("--json", "as_json", is_flag=True, help="Write JSON instead of a table.")
def devices(as_json: bool) -> None:
    """List the OpenCL devices, with the one that would be taken and why.

    Each is tried with a trivial kernel. Another one is taken with --device NAME-OR-INDEX or the
    environment variable CLPT_DEVICE, where a part of the name is enough.
    """
    there = device.devices()
    if not there:
        raise DeviceError(f"no OpenCL device: {runtimes.ADVICE}")
    failures = {info.index: trial(info) for info in there}
    if as_json:
        click.echo(json.dumps(_as_json(there, failures), indent=2))
        return
    console = output_console()
    try:
        choice = selection()
    except DeviceError:
        console.print(_table(there, failures, None))
        raise
    console.print(_table(there, failures, choice.info.index))
    console.print(
        f"Taken: [{choice.info.index}] {choice.info.label} ({choice.reason})", markup=False
    )


def _as_json(there: tuple[DeviceInfo, ...], failures: dict[int, str | None]) -> dict[str, object]:
    choice = selection()
    hidden = ("cl_device",)
    rows = []
    for info in there:
        row = {name: value for name, value in vars(info).items() if name not in hidden}
        rows.append({**row, "lanes": info.lanes, "failure": failures[info.index]})
    return {"devices": rows, "taken": choice.info.index, "reason": choice.reason}


def _table(
    there: tuple[DeviceInfo, ...], failures: dict[int, str | None], taken: int | None
) -> Table:
    table = Table(box=None, pad_edge=False)
    for heading in (
        "",
        "platform",
        "device",
        "kind",
        "units",
        "memory",
        "lanes",
        "driver",
        "state",
    ):
        right = heading in ("units", "memory", "lanes")
        table.add_column(heading, justify="right" if right else "left", overflow="fold")
    for info in there:
        failure = failures[info.index]
        table.add_row(
            f"{'*' if info.index == taken else ' '} {info.index}",
            info.platform,
            info.name,
            info.kind.upper() if info.kind != "accelerator" else info.kind,
            str(info.compute_units),
            f"{info.global_mem / 2**30:.1f} GiB",
            str(info.lanes),
            info.driver,
            "works" if failure is None else f"fails: {failure}",
            style="bold" if info.index == taken else None,
        )
    return table
