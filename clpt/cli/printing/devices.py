"""Lists of OpenCL devices, as JSON and as a table."""

from __future__ import annotations

from rich.table import Table

from ...device.context import DeviceInfo, selection
from .console import shown
from .names import device_name


def as_json(listed: tuple[DeviceInfo, ...], failures: dict[int, str | None]) -> dict[str, object]:
    """Return what is known of devices, and which is taken. Raises DeviceError."""
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

    taken: the index of the one that would be used; verbose: whether it has their full names and
    their drivers.
    """
    made = Table(box=None, pad_edge=False)
    names = ("platform", "device", "driver") if verbose else ("device",)
    for heading in ("", *names, "kind", "units", "memory", "lanes", "state"):
        right = heading in ("units", "memory", "lanes")
        made.add_column(heading, justify="right" if right else "left", overflow="fold")
    for info in listed:
        failure = failures[info.index]
        own = (info.platform, info.name, info.driver) if verbose else (device_name(info),)
        made.add_row(
            f"{'*' if info.index == taken else ' '} {info.index}",
            *map(shown, own),
            info.kind.upper() if info.kind != "accelerator" else info.kind,
            str(info.compute_units),
            f"{info.global_mem / 2**30:.1f} GiB",
            str(info.lanes),
            "works" if failure is None else shown(f"fails: {failure}"),
            style="bold" if info.index == taken else None,
        )
    return made
