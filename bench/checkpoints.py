"""What checkpoints cost: processor time of a render with and without them, in turns.

The same samples in passes of some seconds, in a process; with checkpoints each pass is followed
by a copy of the film on the device, and every `period` seconds a file is written by a thread. The
parts are measured by themselves too, and tell the share at the default period. Processor time
includes the threads of the driver and of the writer.

With --workers the same of a cluster on this machine: the client holds its film with each progress,
and writes it. Processor time is of the client with its scheduler, and of the workers.
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
from bench.cluster import processor_time
from clpt.cli.display import Lines
from clpt.cli.files.checkpoints import PERIOD, Checkpoints, path_of
from clpt.cli.opening import DEVICE_SECONDS
from clpt.cluster import processes
from clpt.cluster.cluster_renderer import ClusterRenderer
from clpt.render.film import film_file

Record = dict[str, object]


def spent(work: Callable[[], object]) -> float:
    """Processor time of some work [s]."""
    start = time.process_time()
    work()
    return time.process_time() - start


def parts(renderer: clpt.Renderer, path: Path, times: int) -> dict[str, float]:
    """Return median times [s] of a copy on the device, a copy to the host, and a file, after a
    pass.
    """

    def hold() -> None:
        renderer._hold()
        renderer._wavefront.stream.wait()

    hold()
    saved = renderer.saved_film(held=True)
    works = {
        "copy": hold,
        "to_host": lambda: renderer.saved_film(held=True),
        "file": lambda: film_file.write(path, saved),
    }
    times_of: dict[str, list[float]] = {name: [] for name in works}
    for _ in range(times):
        renderer.run(1)
        for name, work in works.items():
            times_of[name].append(spent(work))
    return {name: statistics.median(each) for name, each in times_of.items()}


def passes(renderer: clpt.Renderer, samples: int, count: int, after: Callable[[], None]) -> float:
    """Processor time of some passes from the first sample on [s]."""
    renderer.reset().wait()

    def work() -> None:
        for _ in range(count):
            renderer.run(samples)
            after()

    return spent(work)


def resized(size: tuple[int, int]) -> clpt.Scene:
    """The scene that is rendered, at some size."""
    scene = clpt.load(machine.ROOT / "scenes" / "three_spheres")
    film = dataclasses.replace(scene.film, width=size[0], height=size[1])
    return dataclasses.replace(scene, film=film)


def figures(size: tuple[int, int], where: str, period: float, shares: list[float]) -> Record:
    """What records of both kinds have in common."""
    return {
        "size": f"{size[0]}x{size[1]}",
        "where": where,
        "period": period,
        "share": round(statistics.median(shares), 4),
        "shares": [round(share, 4) for share in shares],
    }


def compare(size: tuple[int, int], period: float, rounds: int, folder: Path) -> Record:
    """Return the record of a device."""
    target = folder / "a.png"
    with clpt.Renderer(resized(size)) as renderer:
        renderer.run(1)
        start = time.perf_counter()
        renderer.run(2)
        samples = max(1, int(2 * DEVICE_SECONDS / (time.perf_counter() - start)))
        count = max(2, round(2.0 * period / DEVICE_SECONDS))
        shares = []
        for _ in range(rounds):
            without = passes(renderer, samples, count, lambda: None)
            renderer.reset().wait()
            saving = Checkpoints(
                renderer, path_of(target, (target,)), period, False, [target], Lines()
            )
            began = time.perf_counter()
            with_them = passes(renderer, samples, count, saving.after_pass)
            seconds = time.perf_counter() - began
            shares.append(with_them / without - 1.0)
        each = parts(renderer, path_of(target, (target,)), 5)
        size_of_file = path_of(target, (target,)).stat().st_size
    cores = without / seconds
    total = each["copy"] * PERIOD / DEVICE_SECONDS + each["to_host"] + each["file"]
    return {
        **figures(size, "one device", period, shares),
        **{f"{name}_ms": round(1e3 * value, 1) for name, value in each.items()},
        "file_mb": round(size_of_file / 1e6, 1),
        "share_at_default": round(total / (PERIOD * max(cores, 1.0)), 5),
    }


def compare_on_cluster(
    size: tuple[int, int], workers: int, period: float, rounds: int, folder: Path
) -> Record:
    """A record of workers on this machine, which render the same samples in turns."""
    scene, target, shares = resized(size), folder / "a.png", []
    with processes.local_cluster(workers) as (client, started):
        client.wait_for_workers(workers)

        def render(samples: int, saves: bool) -> float:
            with ClusterRenderer(scene, client) as renderer:
                renderer.run(1)  # the scene is opened
                renderer.image()  # and what makes pictures is there, which every render needs

                def after(_: object) -> None:
                    if saving is not None:
                        saving.after_pass()

                before, saving = processor_time(started), None
                if saves:
                    saving = Checkpoints(
                        renderer, path_of(target, (target,)), period, False, [target], Lines()
                    )
                renderer.run(samples, after)
                if saving is not None:
                    saving.save(False)
                return processor_time(started) - before

        render(4, True)
        start = time.perf_counter()
        render(8, False)
        samples = max(8, int(8 * 2.0 * period / (time.perf_counter() - start)))
        for _ in range(rounds):
            without = render(samples, False)
            shares.append(render(samples, True) / without - 1.0)
    return figures(size, f"local:{workers}", period, shares)


@click.command(help=__doc__)
@click.option("--size", "sizes", multiple=True, default=("640x360", "1920x1080"))
@click.option("--period", default=20.0, help="Seconds between checkpoints of the renders.")
@click.option("--rounds", default=3)
@click.option("--workers", default=1, help="Of a cluster; 0: one device alone.")
@click.option("--json", "path", help="Append records to this file.")
def main(
    sizes: tuple[str, ...], period: float, rounds: int, workers: int, path: str | None
) -> None:
    rows = []
    for text in sizes:
        width, height = (int(side) for side in text.split("x"))
        with tempfile.TemporaryDirectory() as folder:
            size, where = (width, height), Path(folder)
            rows.append(compare(size, period, rounds, where))
            if workers:
                rows.append(compare_on_cluster(size, workers, period, rounds, where))
    table = Table(*rows[0])
    for row in rows:
        table.add_row(*(str(row.get(name, "")) for name in rows[0]))
    machine.console().print(table)
    machine.append(path, "checkpoints", [{**machine.circumstances(), **row} for row in rows])


if __name__ == "__main__":
    main()
