"""What checkpoints cost: processor time of a render with them beside one without, in turns.

The same samples in passes of some seconds, in one process; with checkpoints each pass is followed
by a copy of the film on the device, and every `period` seconds a file is written by a thread. The
parts are measured by themselves too, and tell the share at the default period. Processor time
includes the threads of the driver and of the writer.
"""

from __future__ import annotations

import dataclasses
import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import click
from rich.table import Table

import clpt
from bench import machine
from clpt.cli.checkpoints import PERIOD, Checkpoints, path_of
from clpt.cli.rendering import PASS_SECONDS
from clpt.render import film_file


def spent(work: Callable[[], object]) -> float:
    """Processor time of some work [s]."""
    start = time.process_time()
    work()
    return time.process_time() - start


def parts(renderer: clpt.Renderer, path: Path, times: int) -> dict[str, float]:
    """Medians of what a copy on the device, one to the host, and a file take [s]."""

    def hold() -> None:
        renderer.hold()
        renderer.wavefronts[0].stream.wait()

    hold()
    saved = renderer.saved_film(held=True)
    works = {
        "copy": hold,
        "to_host": lambda: renderer.saved_film(held=True),
        "file": lambda: film_file.write(path, saved),
    }
    return {
        name: statistics.median(spent(work) for _ in range(times)) for name, work in works.items()
    }


def passes(renderer: clpt.Renderer, samples: int, count: int, after: Callable[[], None]) -> float:
    """Processor time of some passes from the first sample on [s]."""
    renderer.reset().wait()

    def work() -> None:
        for _ in range(count):
            renderer.run(samples)
            after()

    return spent(work)


def compare(size: tuple[int, int], period: float, rounds: int, folder: Path) -> dict[str, object]:
    """A record of a scene at some size."""
    scene = clpt.load(machine.ROOT / "scenes" / "three_spheres")
    film = dataclasses.replace(scene.film, width=size[0], height=size[1])
    target = folder / "a.png"
    with clpt.Renderer(dataclasses.replace(scene, film=film)) as renderer:
        renderer.run(1)
        start = time.perf_counter()
        renderer.run(2)
        samples = max(1, int(2 * PASS_SECONDS / (time.perf_counter() - start)))
        count = max(2, round(2.0 * period / PASS_SECONDS))
        shares = []
        for _ in range(rounds):
            without = passes(renderer, samples, count, lambda: None)
            renderer.reset().wait()
            saving = Checkpoints(renderer, path_of(target), period, False, [target], print)
            began = time.perf_counter()
            with_them = passes(renderer, samples, count, saving.after_pass)
            seconds = time.perf_counter() - began
            shares.append(with_them / without - 1.0)
        each = parts(renderer, path_of(target), 5)
        size_of_file = path_of(target).stat().st_size
    cores = without / seconds
    total = each["copy"] * PERIOD / PASS_SECONDS + each["to_host"] + each["file"]
    return {
        "size": f"{size[0]}x{size[1]}",
        "period": period,
        "share": round(statistics.median(shares), 4),
        "shares": [round(share, 4) for share in shares],
        **{f"{name}_ms": round(1e3 * value, 1) for name, value in each.items()},
        "file_mb": round(size_of_file / 1e6, 1),
        "share_at_default": round(total / (PERIOD * max(cores, 1.0)), 5),
    }


@click.command(help=__doc__)
@click.option("--size", "sizes", multiple=True, default=("640x360", "1920x1080"))
@click.option("--period", default=20.0, help="Seconds between checkpoints of the renders.")
@click.option("--rounds", default=3)
@click.option("--json", "path", help="Append records to this file.")
def main(sizes: tuple[str, ...], period: float, rounds: int, path: str | None) -> None:
    rows = []
    for size in sizes:
        width, height = (int(side) for side in size.split("x"))
        with tempfile.TemporaryDirectory() as folder:
            rows.append(compare((width, height), period, rounds, Path(folder)))
    table = Table(*rows[0])
    for row in rows:
        table.add_row(*(str(value) for value in row.values()))
    machine.console().print(table)
    machine.append(path, "checkpoints", [{**machine.circumstances(), **row} for row in rows])


if __name__ == "__main__":
    main()
