"""What the compilers of GPUs that are not here make of every program of the scenes.

`GPU_COMPILERS` names the folder into which bench/gpu_compilers/unpack.sh has unpacked them; without
it those are taken that are installed. A compiler that is missing is told and left out. --json keeps
a row a program; texts that stand there are not compiled again.
"""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from pathlib import Path

import click
from rich.table import Table

from bench import machine
from bench.gpu_compilers import programs, results
from bench.gpu_compilers.results import Row
from bench.gpu_compilers.vendors import VENDORS, CompilerError, Vendor, fits

NAMES = ("stage", "scene", "mode")


def compiled(vendor: Vendor, device: str, program: programs.Program) -> Row:
    """A row: what became of a program, or the error."""
    row: Row = {"device": device, "digest": program.digest, "stage": program.stage}
    row |= {"scene": program.scene, "mode": program.mode}
    try:
        return row | vars(vendor.figures(program.text, device, program.registers))
    except CompilerError as error:
        return row | {"error": str(error)}


def measure(
    vendors: list[Vendor], selected: list[programs.Program], known: list[Row]
) -> Iterator[Row]:
    """Yield a row for each device and program that is not known; devices of each vendor in turn."""
    done = {(row["device"], row["digest"]) for row in known}
    for number in range(max(len(vendor.devices) for vendor in vendors)):
        for vendor in vendors:
            for device in vendor.devices[number : number + 1]:
                for program in selected:
                    if (device, program.digest) not in done:
                        yield compiled(vendor, device, program)


def present() -> list[Vendor]:
    """Vendors whose compilers are here; others are told."""
    compiled = []
    for vendor in VENDORS:
        if vendor.missing:
            click.echo(
                f"{vendor.name} is left out: {', '.join(vendor.missing)} not found", err=True
            )
        else:
            compiled.append(vendor)
    return compiled


@click.command(help=__doc__)
@click.option("--json", "json_file", type=click.Path(path_type=Path), help="a row a program")
@click.option("--device", "devices", multiple=True, help="these alone")
@click.option("--scene", "names", multiple=True, help="these alone")
@click.option(
    "--longest",
    type=int,
    help="so many of each stage and mode alone, the longest texts, and those that took most before",
)
@click.option("--seconds", type=float, help="after which no further program is compiled")
@click.option("--fits", "fewest", is_flag=True, help="tell how few registers would do on NVIDIA's")
@click.option("--keep", is_flag=True, help="write the page and the picture in bench/results")
def main(
    json_file: Path | None,
    devices: tuple[str, ...],
    names: tuple[str, ...],
    longest: int | None,
    seconds: float | None,
    fewest: bool,
    keep: bool,
) -> None:
    os.nice(5)
    selected = programs.of_scenes(p for p in programs.scenes() if not names or p.name in names)
    if longest:
        most = {tuple(row.get(name) for name in NAMES) for row in results.read(results.STAGES)}
        former = [p for p in selected if (p.stage, p.scene, p.mode) in most]
        selected = list(dict.fromkeys([*programs.longest(selected, longest), *former]))
    if fewest:
        for program in selected:
            count = fits(program.text, devices[0] if devices else "sm_89")
            click.echo(f"{program.stage} {program.scene} {program.mode}: {count}")
        return
    known = results.read(json_file) if json_file else []
    digests = {program.digest for program in selected}
    rows = [row for row in known if row["digest"] in digests]
    end = time.monotonic() + seconds if seconds else float("inf")
    vendors = [vendor.only(devices) for vendor in present()]
    for row in measure([vendor for vendor in vendors if vendor.devices], selected, rows):
        rows.append(row)
        if "error" in row:
            click.echo(f"{row['device']} {row['scene']} {row['stage']}: {row['error']}", err=True)
        machine.append(json_file, "gpu_compilers", [row])
        if time.monotonic() > end:
            break
    stages = results.of_stages(rows)
    if keep:
        results.keep(stages, longest)
    machine.console().print(_summary(stages))


def _summary(stages: list[Row]) -> Table:
    columns = (
        "device",
        "stage",
        "programs",
        "registers",
        "occupancy",
        "stack",
        "spilled",
        "seconds",
    )
    table = Table(*columns)
    for row in stages:
        table.add_row(*(str(row.get(name, "")) for name in columns))
    return table


if __name__ == "__main__":
    main()
