"""Several devices beside each alone: how much of the sum of their rates is left.

The devices are parts of a processor, of a core each, or those that are named. In each round every
device renders alone, and then all of them the same picture together, each for some seconds. What
counts is the rate together over the sum of the rates alone, the median of the rounds; beside it the
same by processor time, which other work on the machine hardly moves: it shows what dividing costs,
and not whether devices wait for each other. Both need a machine where nothing else runs.
"""

from __future__ import annotations

import dataclasses
import statistics
import time
from pathlib import Path

import click
import pyopencl as cl
from rich.table import Table

import clpt
from bench import machine
from clpt import device as dev
from clpt.cli.options.applied import changed
from clpt.cli.options.scene_options import SceneChanges

SCENES = ("scenes/cornell_box", "tests/scenes/textures.xml")


def parts(cores: int) -> list[dev.Device]:
    """Parts of a CPU with so many cores each."""
    info = dev.choose().info
    counts = [cl.device_partition_property.BY_COUNTS, *[cores] * (info.compute_units // cores), 0]
    sub_devices = info.cl_device.create_sub_devices(counts)
    return [
        dev.Device.open(dataclasses.replace(info, cl_device=part, compute_units=cores))
        for part in sub_devices
    ]


def timed(renderer: clpt.Renderer | clpt.MultiRenderer, samples: int) -> tuple[float, float]:
    """Seconds, and those of the processor, of so many samples of each pixel."""
    began, cpu = time.perf_counter(), time.process_time()
    renderer.run(samples)
    return time.perf_counter() - began, time.process_time() - cpu


def measure(path: Path, devices: list[dev.Device], seconds: float, rounds: int, size: int) -> dict:
    """The figures of a scene."""
    scene = changed(clpt.load(path), SceneChanges.of(size=(size, size)))
    alone = [clpt.Renderer(scene, device) for device in devices]
    together = clpt.MultiRenderer(scene, devices)
    for renderer in (*alone, together):
        renderer.run(4 * len(devices))
    lengths = [max(1, round(seconds * 8 / timed(renderer, 8)[0])) for renderer in alone]
    figures: dict[str, list[float]] = {"alone": [], "together": [], "efficiency": [], "by_cpu": []}
    for _ in range(rounds):
        times = [timed(*pair) for pair in zip(alone, lengths, strict=True)]
        both = timed(together, sum(lengths))
        rates = [
            length / wall_and_cpu[0] for length, wall_and_cpu in zip(lengths, times, strict=True)
        ]
        cpu = sum(wall_and_cpu[1] for wall_and_cpu in times)
        figures["alone"].append(sum(rates))
        figures["together"].append(sum(lengths) / both[0])
        figures["efficiency"].append(figures["together"][-1] / figures["alone"][-1])
        figures["by_cpu"].append(cpu / both[1])
    began = time.perf_counter()
    together.image()
    picture = time.perf_counter() - began
    shares = [round(share.share, 3) for share in together.shares]
    for renderer in (*alone, together):
        renderer.close()
    medians = {name: statistics.median(values) for name, values in figures.items()}
    return {
        "scene": path.stem, "devices": len(devices), "size": size, "seconds": seconds,
        **medians, "picture_ms": 1e3 * picture, "shares": shares,
        "load": machine.circumstances().get("load"),
    }  # fmt: skip


@click.command(help=__doc__)
@click.option("--scene", "scenes", multiple=True, default=SCENES, show_default=True)
@click.option("--device", "names", help="as of clpt render, instead of parts of a processor")
@click.option("--cores", default=1, show_default=True, help="of a part")
@click.option("--seconds", default=10.0, show_default=True)
@click.option("--rounds", default=5, show_default=True)
@click.option("--size", default=512, show_default=True, help="pixels of a side")
@click.option("--json", "json_file", type=click.Path(), help="append the figures as JSON lines")
def main(
    scenes: tuple[str, ...],
    names: str | None,
    cores: int,
    seconds: float,
    rounds: int,
    size: int,
    json_file: str | None,
) -> None:
    devices = parts(cores) if names is None else dev.choose_all(names)
    table = Table("scene", "sum of rates", "together", "efficiency", "by processor time")
    for name in scenes:
        row = measure(machine.ROOT / name, devices, seconds, rounds, size)
        machine.append(json_file, "devices", [row])
        rates = (f"{row[name] * size * size * 1e-6:.2f} M/s" for name in ("alone", "together"))
        table.add_row(row["scene"], *rates, f"{row['efficiency']:.3f}", f"{row['by_cpu']:.3f}")
    machine.console().print(table)


if __name__ == "__main__":
    main()
