"""Hard light: the error of renderers after equal processor time, on a core.

`python -m bench.hard_light [SCENE ...]`. A scene's pixels are those that see something diffuse
first (direct) and those that see it through or in something sharp (sharp). The relative MSE leaves
out the worst thousandth of the pixels. Light is the picture's share of the reference's, with and
without these: where a method finds it as few bright pixels, only the latter shows what is missing.
All figures are medians over seeds.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import click
import numpy as np
from numpy.typing import NDArray
from rich.table import Table

from bench import machine
from bench.hard_light import peers
from bench.hard_light.scenes import SCENES, write
from bench.workers import find_llvm

REFERENCES = Path(__file__).parent / "references"
METHODS = (
    *("clpt:auto", "clpt:path,--light-paths,0", "clpt:path,--light-paths,1", "clpt:vcm"),
    "clpt:particle_tracer",
    *("mitsuba:path", "mitsuba:ptracer"),
    *(f"luxcore:{name}" for name in peers.LUXCORE),
)
TRIM = 0.001  # of the pixels
PARTS = ("direct", "sharp")

Row = dict[str, Any]


def compare(
    image: NDArray[np.float64], reference: NDArray[np.float64], chosen: NDArray[np.bool_]
) -> dict[str, float] | None:
    """Return the relative MSE and the share of light of the chosen pixels (h, w), without and with
    the worst pixels; None without chosen pixels."""
    if not chosen.any():
        return None
    error = (image - reference) ** 2 / (reference**2 + 1e-2 * reference.mean() ** 2)
    pixel_errors, kept = error.mean(-1)[chosen], max(1, int(chosen.sum() * (1 - TRIM)))
    order = np.argsort(pixel_errors)[:kept]
    pixels, there = image[chosen], reference[chosen]
    return {
        "relmse": float(pixel_errors[order].mean()),
        "relmse_all": float(pixel_errors.mean()),
        "light_kept": float(pixels[order].mean() / there[order].mean()),
        "light": float(pixels.mean() / there.mean()),
    }


def measure(scene: str, method: str, file: Path, seconds: float, seeds: int) -> Row:
    """Return what a method reaches. Raises RuntimeError with its last words if it fails."""
    with np.load(REFERENCES / f"{scene}.npz") as stored:
        reference, direct = stored["image"].astype(np.float64), stored["direct"]
    shots = [_shot(method, file, seconds, seed) for seed in range(1, seeds + 1)]
    row: Row = {
        "scene": scene, "renderer": method, "version": shots[0].version, "seeds": seeds,
        "cpu": round(float(np.median([shot.cpu for shot in shots])), 2),
        "samples": int(np.median([shot.samples for shot in shots])),
    }  # fmt: skip
    for part, chosen in (("all", direct | True), ("direct", direct), ("sharp", ~direct)):
        compared = [compare(shot.image, reference, chosen) for shot in shots]
        known = [figures for figures in compared if figures is not None]
        if known:
            row[part] = {
                name: float(f"{np.median([figures[name] for figures in known]):.4g}")
                for name in known[0]
            }
    return row


def _shot(method: str, file: Path, seconds: float, seed: int) -> peers.Shot:
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "shot"
        code = (
            "import os, pickle, sys; from pathlib import Path; from bench.hard_light import peers; "
            "shot = peers.run(sys.argv[1], Path(sys.argv[2]), float(sys.argv[3]), int(sys.argv[4]))"
            "; Path(sys.argv[5]).write_bytes(pickle.dumps(shot)); os._exit(0)"
        )  # LuxCore's log does not survive the interpreter
        command = [sys.executable, "-c", code, method, str(file), str(seconds), str(seed), str(out)]
        # a single core, for a single thread of PoCL
        core = str(min(os.sched_getaffinity(0)))
        done = subprocess.run(
            ["taskset", "-c", core, *command],
            cwd=machine.ROOT, capture_output=True, text=True,
            env={**os.environ, "POCL_MAX_PTHREAD_COUNT": "1"},
        )  # fmt: skip
        if not out.exists():
            words = (done.stderr.strip() or f"status {done.returncode}").splitlines()[-1]
            raise RuntimeError(f"{method}: {words[:300]}")
        shot: peers.Shot = pickle.loads(out.read_bytes())  # of our own process
    return shot


def cells(row: Row) -> list[str]:
    """A row of the table."""
    parts = (row.get(part) for part in PARTS)
    figures = [
        text
        for part in parts
        for text in (
            ("", "")
            if part is None
            else (f"{part['relmse']:.2g}", f"{part['light']:.2f} ({part['light_kept']:.2f})")
        )
    ]
    return [row["scene"], row["renderer"], f"{row['cpu']:g}", str(row["samples"]), *figures]


@click.command(help=__doc__)
@click.argument("scenes", nargs=-1, type=click.Choice(list(SCENES)))
@click.option("--method", "methods", multiple=True, help=f"such as {', '.join(METHODS)}")
@click.option("--seconds", default=15.0, show_default=True, help="of processor time each")
@click.option("--seeds", default=1, show_default=True)
@click.option("--json", "json_file", type=click.Path(), help="append the figures as JSON lines")
def main(
    scenes: tuple[str, ...], methods: tuple[str, ...], seconds: float, seeds: int, json_file: str
) -> None:
    find_llvm()
    table = Table(
        "scene", "method", "s", "samples", "direct", "light", "sharp", "light",
        title=f"{machine.processor()}: relative MSE, and the light that was found",
    )  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:
        for scene in scenes or SCENES:
            file = write(scene, Path(folder))
            for method in methods or METHODS:
                try:
                    row = measure(scene, method, file, seconds, seeds)
                except (RuntimeError, OSError) as error:
                    print(f"{scene}: {error}", file=sys.stderr)
                    continue
                machine.append(json_file, "hard_light", [row])
                table.add_row(*cells(row))
                print(" | ".join(cells(row)), file=sys.stderr, flush=True)
    machine.console().print(table)


if __name__ == "__main__":
    main()
