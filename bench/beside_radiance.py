"""A map of illuminance beside Radiance: processor time at equal error.

`python -m bench.beside_radiance` needs the package `pyradiance`. A matt room of 6 x 4 x 2.8 m has
two panels in its ceiling and four desks; the map has points above the whole floor at the height of
the desks. Both renderers get the same rectangles and boxes, grey walls, and lamps of radiance 1, so
both return irradiance. The reference is clpt's own on every 16th point with many samples; Radiance
without its cache, on a part of these, says whether both mean the same room. An error is the root
of the mean square of value / reference - 1.
"""

from __future__ import annotations

import itertools
import json
import resource
import subprocess
import sys
import time
from pathlib import Path

import click
import numpy as np
from numpy.typing import NDArray

from clpt import instruments
from clpt.scene import Film, Scene, cameras, lights, materials, shapes
from clpt.scene.integrators import Path as PathTracing
from clpt.spectra import Constant

ROOM = 6.0, 2.8, 4.0  # [m], y is up
PANELS = [(1.2, 1.8), (4.2, 4.8)], (1.4, 2.6)  # along x, along z
DESKS = [(0.8, 2.4), (3.6, 5.2)], [(0.6, 1.4), (2.6, 3.4)], (0.68, 0.72)
GREYS = {"floor": 0.2, "ceiling": 0.8, "walls": 0.5, "desk": 0.4}
HEIGHT = 0.75  # of the map
BOUNCES = 6
STEP = 32  # of an interpolated map
RANGE = 470.0  # nm of the film
COARSE = "-ab 6 -ad 256 -as 64 -aa 0.2 -ar 64 -ds 0.2 -dj 0.7 -dc 1 -dt 0 -lw 1e-3 -lr 8"
FINE = "-ab 6 -ad 1024 -as 256 -aa 0.1 -ar 128 -ds 0.1 -dj 0.7 -dc 1 -dt 0 -lw 1e-4 -lr 8"
EXACT = "-ab 6 -ad 65536 -as 0 -aa 0 -ds 0.05 -dj 0.7 -dc 1 -dt 0 -lw 1e-7 -lr 8"

Floats = NDArray[np.float64]


def corners() -> list[tuple[str, Floats]]:
    """Return the rectangles of the room, of its desks and of its lamps: name, corners (4, 3)."""
    x, y, z = ROOM
    found = []

    def box(name: str, low: tuple[float, ...], high: tuple[float, ...], outward: bool) -> None:
        for axis, side in itertools.product(range(3), range(2)):
            a, b = (axis + 1) % 3, (axis + 2) % 3
            points = np.tile(np.asarray(low, float), (4, 1))
            points[:, axis] = (low, high)[side][axis]
            points[[1, 2], a], points[[2, 3], b] = high[a], high[b]
            named = ("floor", "ceiling")[side] if axis == 1 and name == "walls" else name
            found.append((named, points if (side == 1) == outward else points[::-1]))

    box("walls", (0, 0, 0), (x, y, z), outward=False)
    for (x0, x1), (z0, z1) in itertools.product(DESKS[0], DESKS[1]):
        box("desk", (x0, DESKS[2][0], z0), (x1, DESKS[2][1], z1), outward=True)
    z0, z1 = PANELS[1]
    for x0, x1 in PANELS[0]:
        top = y - 0.01
        found.append(
            ("lamp", np.array([[x0, top, z0], [x1, top, z0], [x1, top, z1], [x0, top, z1]]))
        )
    return found


def scene() -> Scene:
    """Return the room of clpt."""
    parts: list[shapes.Shape] = []
    for name, points in corners():
        grey = materials.Diffuse(reflectance=GREYS.get(name, 0.0))
        glow = lights.Area(radiance=Constant(1.0)) if name == "lamp" else None
        parts.append(
            shapes.Mesh(
                vertices=points.astype(np.float32), faces=[[0, 1, 2], [0, 2, 3]], material=grey,
                emission=glow,
            )
        )  # fmt: skip
    return Scene(
        camera=cameras.Perspective(), shapes=parts, film=Film(size=(8, 8)),
        integrator=PathTracing(max_depth=BOUNCES + 2, rr_depth=BOUNCES + 2),
    )  # fmt: skip


def radiance_text() -> str:
    """Return the room of Radiance."""
    rows = ["void light lamp 0 0 3 1 1 1"]
    rows += [f"void plastic {name} 0 0 5 {grey} {grey} {grey} 0 0" for name, grey in GREYS.items()]
    for i, (name, points) in enumerate(corners()):
        rows.append(f"{name} polygon p{i} 0 0 12 " + " ".join(f"{v:.6g}" for v in points.ravel()))
    return "\n".join(rows) + "\n"


def points(width: int, height: int) -> Floats:
    """Return the points (h, w, 3) of the map."""
    x, z = (np.arange(n) + 0.5 for n in (width, height))
    across, along = np.meshgrid(x / width * ROOM[0], z / height * ROOM[2])
    return np.stack([across, np.full_like(across, HEIGHT), along], axis=-1)


def by_radiance(folder: Path, at: Floats, settings: str) -> tuple[Floats, float]:
    """Return irradiances (...) by rtrace, and its processor time [s]."""
    import pyradiance

    programs = Path(pyradiance.__file__).parent / "bin"
    (folder / "room.rad").write_text(radiance_text())
    octree = subprocess.run(
        [programs / "oconv", folder / "room.rad"], capture_output=True, check=True
    )
    (folder / "room.oct").write_bytes(octree.stdout)
    rays = np.concatenate([at.reshape(-1, 3), np.tile([0.0, 1.0, 0.0], (at.size // 3, 1))], axis=1)
    command = [programs / "rtrace", "-I", "-h", "-n", "1", "-ffd", *settings.split()]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    told = subprocess.run(
        [*command, folder / "room.oct"], input=rays.astype(np.float32).tobytes(),
        capture_output=True, check=True,
    )  # fmt: skip
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    took = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return np.frombuffer(told.stdout).reshape(-1, 3)[:, 1].reshape(at.shape[:-1]), took


def by_clpt(at: Floats, samples: int, step: int = 1) -> tuple[Floats, Floats, float]:
    """Return irradiances (...), standard errors, and the processor time [s]."""
    began = time.process_time()
    found = instruments.measure(scene(), "irradiance", at, samples=samples, interpolate=step)
    took = time.process_time() - began
    return found.values / RANGE, found.errors / RANGE, took


def error(values: Floats, reference: Floats) -> float:
    """Return the root of the mean square of relative errors."""
    return float(np.sqrt(((values / reference - 1.0) ** 2).mean()))


@click.command()
@click.option("--size", type=(int, int), default=(640, 480), show_default=True)
@click.option("--reference", default=1 << 17, help="Samples of a point of the reference.")
@click.option("--samples", default="32,128", show_default=True)
@click.option("--interpolated", default="64,128,256", show_default=True, help="Samples, likewise.")
@click.argument("folder", type=Path)
def main(
    size: tuple[int, int], reference: int, samples: str, interpolated: str, folder: Path
) -> None:
    """Print figures as JSON lines; FOLDER gets the room and the maps."""
    folder.mkdir(parents=True, exist_ok=True)
    at = points(*size)
    some = np.s_[8::16, 8::16]
    exact, errors, took = by_clpt(at[some], reference)
    np.save(folder / "reference.npy", exact)
    row = {"of": "reference", "error": float((errors / exact).mean()), "seconds": round(took, 1)}
    print(json.dumps(row), flush=True)
    few = np.s_[8::96, 8::96]
    pure, took = by_radiance(folder, at[few], EXACT)
    ratio = pure / exact[::6, ::6]
    row = {"of": "rtrace without a cache over clpt", "mean": float(ratio.mean())}
    print(json.dumps({**row, "spread": float(ratio.std()), "seconds": round(took, 1)}), flush=True)
    runs = [(int(count), 1) for count in samples.split(",") if count]
    runs += [(int(count), STEP) for count in interpolated.split(",") if count]
    for count, step in runs:
        values, _, took = by_clpt(at, count, step)
        np.save(folder / f"clpt_{count}_{step}.npy", values)
        row = {"of": f"clpt, {count} samples, step {step}", "error": error(values[some], exact)}
        print(json.dumps({**row, "seconds": round(took, 2)}), flush=True)
    for settings in (COARSE, FINE):
        values, took = by_radiance(folder, at, settings)
        row = {"of": f"rtrace {settings}", "error": error(values[some], exact)}
        print(json.dumps({**row, "seconds": round(took, 1)}), flush=True)


if __name__ == "__main__":
    sys.exit(main())
