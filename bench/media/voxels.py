"""How many bytes a voxel of a density takes on the device, index and bounds included.

`python -m bench.media.voxels [FILE]`; no file: PBRT's teapot cloud, in ../shared/assets.

By three counts: a point of the grid's box, a cell of the bricks that are kept, and a point with a
density. `used` is the share of bricks that are kept.
"""

from __future__ import annotations

import os
from pathlib import Path

import click
import numpy as np

from bench import machine
from clpt.formats import volumes
from clpt.render.lights.bodies import CELLS, Windows
from clpt.render.media import grids

CLOUD = "volumes/teapot_cloud/teapot_cloud.nvdb"


@click.command(help=__doc__)
@click.argument("file", required=False, type=click.Path(exists=True, path_type=Path))
@click.option("--json", "path", type=click.Path(), help="append the figures as JSON lines")
def main(file: Path | None, path: str | None) -> None:
    assets = Path(os.environ.get("ASSETS", machine.ROOT.parent / "shared" / "assets"))
    density = np.asarray(volumes.read(file or assets / CLOUD).values)
    most = Windows(density).most
    kept = int((most > 0.0).sum())
    for bits in (16, 8):
        size = grids.bricks(density, bits).nbytes
        counts = {
            "box": density.size,
            "stored": kept * CELLS**3,
            "dense": int((density > 0.0).sum()),
        }
        row = {
            "figure": f"{bits} bits",
            "used": round(kept / len(most), 3),
            **{name: round(size / number, 2) for name, number in counts.items()},
        }
        machine.console().print(row)
        machine.append(path, "voxels", [{**machine.circumstances(), **row}])


if __name__ == "__main__":
    main()
