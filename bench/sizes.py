"""Costs of a scene's size: hilly ground of 10 thousand to 10 million triangles.

Every size has a separate process: processor time and peak memory to load the file, then to lower
it and build its tree; bytes that stay on the device; processor time of a sample and of a ray. A
ray's time is fitted by a + b log2(triangles); the plot is written where `--plot` says.
"""

from __future__ import annotations

import multiprocessing
import resource
import tempfile
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any, TypeVar

import click
import numpy as np
from matplotlib.figure import Figure
from rich.table import Table

from bench import machine
from bench.meshes import write_ply
from bench.peer_scenes import grid

SIZES = (10_000, 30_000, 100_000, 300_000, 1_000_000, 3_000_000, 10_000_000)
SPP, SIDE, DEPTH = 4, 256, 5
STATUS = Path("/proc/self/statm")
PAGE = resource.getpagesize()
Made = TypeVar("Made")


def hills(triangles: int) -> tuple[np.ndarray, np.ndarray]:
    """A square of hills 20 m wide in as many triangles: the same hills, finer."""
    side = round(np.sqrt(triangles / 2)) + 1
    rng = np.random.default_rng(6)
    x = np.linspace(-10, 10, side)
    height = np.zeros((side, side), np.float32)
    for a, b, p, q in rng.uniform(-1, 1, (60, 4)):
        scale = 2.0 ** rng.uniform(0, 5.5)
        wave = np.outer(np.sin(a * scale * x + 9 * p), np.cos(b * scale * x + 9 * q))
        height += (0.35 / scale * wave).astype(np.float32)
    points = np.empty((side, side, 3), np.float32)
    points[..., 0], points[..., 1], points[..., 2] = x[:, None], height, -x[None]
    return grid(points)


class Watch:
    """Resident memory while something runs, looked at every few milliseconds [bytes]."""

    def __init__(self) -> None:
        self.peaks: dict[str, int] = {}
        self.seconds: dict[str, float] = {}

    def __call__(self, name: str, action: Callable[[], Made]) -> Made:
        """Do it; keep its processor time and the peak."""
        over, top = threading.Event(), [_resident()]

        def look() -> None:
            while not over.wait(0.005):
                top[0] = max(top[0], _resident())

        looking = threading.Thread(target=look)
        looking.start()
        start = time.process_time()
        result = action()
        self.seconds[name] = time.process_time() - start
        over.set()
        looking.join()
        self.peaks[name] = max(top[0], _resident())
        return result


def _resident() -> int:
    return int(STATUS.read_text().split()[1]) * PAGE


def measure(path: Path, layout: str | None) -> dict[str, Any]:
    """Load, lower, build and render a mesh file; what it took."""
    import clpt
    from clpt import transforms as tf
    from clpt.scene import Film, Scene
    from clpt.scene.cameras import Perspective
    from clpt.scene.integrators import Path as Paths
    from clpt.scene.lights import Constant

    watch = Watch()
    before = _resident()
    mesh = watch("load", lambda: clpt.load(path).shapes[0])
    scene = Scene(
        camera=Perspective(to_world=tf.look_at([0, 5, 11], [0, 0, 1], [0, 1, 0]), fov=50),
        shapes=[mesh],
        lights=[Constant(radiance=1.0)],
        film=Film(width=SIDE, height=SIDE, mode="rgb"),
        integrator=Paths(max_depth=DEPTH),
    )
    renderer = watch("prepare", lambda: clpt.Renderer(scene, layout=layout))
    watch("first", lambda: renderer.run(SPP))
    front = renderer._wavefront
    rays, start = front.counts.rays, time.process_time()
    renderer.run(SPP)
    cpu, rays = time.process_time() - start, front.counts.rays - rays
    stats, info = renderer.stats, renderer.device.info
    largest = max(b.size for b in front.arguments.values() if hasattr(b, "size"))
    if not np.isfinite(renderer.image()).all() or front.counts.rejected:
        raise SystemExit(f"{path.name}: refused: samples that are not finite")
    count = stats.triangles
    return {
        "triangles": count,
        "layout": front.tree.layout,
        "cpu_load": watch.seconds["load"],
        "cpu_prepare": watch.seconds["prepare"],
        "seconds_lower": stats.seconds["lower"],
        "seconds_build": stats.seconds["trees"],
        "peak_load": watch.peaks["load"] - before,
        "peak_prepare": watch.peaks["prepare"] - before,
        "peak": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024,
        "tree_bytes": stats.trees["triangles"],
        "table_bytes": sum(stats.tables.values()),
        "largest_buffer": largest,
        "max_alloc": info.max_alloc,
        "rays_per_sample": rays / (SPP * SIDE * SIDE),
        "us_per_sample": cpu / (SPP * SIDE * SIDE) * 1e6,
        "us_per_ray": cpu / rays * 1e6,
    }


def fitted(rows: Sequence[dict[str, Any]]) -> dict[str, float]:
    """a + b log2(n) by least squares, and the largest relative distance from it."""
    n = np.log2([row["triangles"] for row in rows])
    cost = np.array([row["us_per_ray"] for row in rows])
    b, a = np.polyfit(n, cost, 1)
    return {"a": float(a), "b": float(b), "worst": float(np.abs(cost / (a + b * n) - 1).max())}


def plot(path: Path, rows: Sequence[dict[str, Any]], fit: dict[str, float]) -> None:
    """The time of a ray over the number of triangles, with the fit."""
    figure = Figure(figsize=(6.4, 4.2), dpi=120, layout="constrained")
    axes = figure.add_subplot()
    n = np.array([row["triangles"] for row in rows])
    many = np.geomspace(n[0], n[-1], 50)
    text = f"{fit['a']:.2g} + {fit['b']:.2g} log2 n"
    axes.plot(many, fit["a"] + fit["b"] * np.log2(many), color="#c1440e", label=text)
    axes.plot(n, [row["us_per_ray"] for row in rows], "o", color="#22262b", label="measured")
    axes.set(xscale="log", xlabel="triangles", ylabel="processor time of a ray [µs]")
    axes.set_ylim(0)
    axes.legend(frameon=False)
    axes.set_title(machine.processor(), loc="left", fontsize=10)
    figure.savefig(path)


COLUMNS = {
    "triangles": ("triangles", 1),
    "load [s]": ("cpu_load", 1),
    "lower [s]": ("seconds_lower", 1),
    "build [s]": ("seconds_build", 1),
    "peak [MiB]": ("peak", 2**20),
    "tree [MiB]": ("tree_bytes", 2**20),
    "tables [MiB]": ("table_bytes", 2**20),
    "largest buffer [MiB]": ("largest_buffer", 2**20),
    "µs a sample": ("us_per_sample", 1),
    "µs a ray": ("us_per_ray", 1),
}


@click.command(help=__doc__)
@click.option("--triangles", multiple=True, type=int, default=SIZES, show_default=True)
@click.option("--layout", help="of the tree, instead of what suits the device")
@click.option("--plot", "plot_file", type=click.Path(path_type=Path))
@click.option("--json", "json_file", type=click.Path(), help="append the figures as JSON lines")
def main(
    triangles: tuple[int, ...], layout: str | None, plot_file: Path | None, json_file: str | None
) -> None:
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for count in sorted(triangles):
            path = Path(folder) / "hills.ply"
            write_ply(path, *hills(count))
            with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
                rows.append(pool.submit(measure, path, layout).result())
            machine.append(json_file, "sizes", rows[-1:])
    table = Table(*COLUMNS, title=machine.processor())
    for row in rows:
        table.add_row(*(f"{row[key] / unit:,.4g}" for key, unit in COLUMNS.values()))
    machine.console().print(table)
    if len(rows) > 2:
        fit = fitted(rows)
        machine.append(json_file, "sizes_fit", [fit])
        print(f"a ray takes {fit['a']:.3g} + {fit['b']:.3g} log2 n µs, within {fit['worst']:.0%}")
        if plot_file:
            plot(plot_file, rows, fit)


if __name__ == "__main__":
    main()
