"""`clpt devices`: the OpenCL devices, the one that would be used, and why."""

from __future__ import annotations

import json

import click
from rich.table import Table

from .. import device
from ..device import runtimes
from ..device.context import DeviceInfo, selection, trial
from ..errors import DeviceError
from .printing.console import output_console


@click.command()
@click.option("--json", "as_json", is_flag=True, help="Write JSON instead of a table.")
def devices(as_json: bool) -> None:
    """List the OpenCL devices, with the one that would be used and why.

    Each is tried with a trivial kernel. Choose another one by --device NAME-OR-INDEX or by the
    environment variable CLPT_DEVICE; a part of the name is enough.
    """
    listed = device.devices()
    if not listed:
        raise DeviceError(f"no OpenCL device: {runtimes.ADVICE}")
    failures = {info.index: trial(info) for info in listed}
    if as_json:
        click.echo(json.dumps(_as_json(listed, failures), indent=2))
        return
    console = output_console()
    try:
        choice = selection()
    except DeviceError:
        console.print(_table(listed, failures, None))
        raise
    console.print(_table(listed, failures, choice.info.index))
    console.print(
        f"Taken: [{choice.info.index}] {choice.info.label} ({choice.reason})", markup=False
    )


def _as_json(listed: tuple[DeviceInfo, ...], failures: dict[int, str | None]) -> dict[str, object]:
    choice = selection()
    hidden = ("cl_device",)
    rows = []
    for info in listed:
        row = {name: value for name, value in vars(info).items() if name not in hidden}
        rows.append({**row, "lanes": info.lanes, "failure": failures[info.index]})
    return {"devices": rows, "taken": choice.info.index, "reason": choice.reason}


def _table(
    listed: tuple[DeviceInfo, ...], failures: dict[int, str | None], taken: int | None
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
    for info in listed:
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
