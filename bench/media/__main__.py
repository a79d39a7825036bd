"""Light in media: efficiency of clpt and of Mitsuba, in turns on a core.

`python -m bench.media [SCENE ...]`. The relative MSE of passes, each beside the mean of the others,
over the square of a reference: (pass - others)^2 / (reference^2 + (mean / 10)^2). Efficiency is
1 / (relative MSE x processor seconds), without the worst hundredth of the pixels, as all samplers
have fireflies here. `bias` is the mean picture's, with its standard error.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import zlib
from pathlib import Path
from typing import Any

import click
import numpy as np
from rich.table import Table

from bench import machine

HERE = Path(__file__).parent
SCENES = {  # its samples in a pass
    "chroma": 64, "chroma_spectral": 64, "fog": 64, "milk": 32, "skin": 32, "smoke": 64, "cloud": 8,
}  # fmt: skip
PEERS = ("volpath", "volpathmis")
TRIM = 0.01
Row = dict[str, Any]


def figures(passes: np.ndarray, reference: np.ndarray, seconds: float) -> dict[str, float]:
    """Return the figures of passes (n, h, w, 3); took: seconds of a pass."""
    values, target = passes.astype(np.float64), reference.astype(np.float64)
    count, total = len(values), values.sum(axis=0)
    scale = target**2 + (0.1 * target.mean()) ** 2
    errors = np.zeros(target.shape[:2])
    for value in values:
        # The others' mean has an error of its own: 1 / (count - 1) of that of a pass.
        pseudo_value = (value - (total - value) / (count - 1)) ** 2 * (count - 1) / count
        errors += (pseudo_value / scale).mean(axis=-1) / count
    kept = np.sort(errors.ravel())[: int(errors.size * (1.0 - TRIM))].mean()
    means = values.mean(axis=(1, 2, 3)) / target.mean() - 1.0
    return {
        "relmse": float(errors.mean()),
        "relmse_99": float(kept),
        "efficiency": 1.0 / (float(errors.mean()) * seconds),
        "efficiency_99": 1.0 / (float(kept) * seconds),
        "bias": float(means.mean()),
        "bias_se": float(means.std(ddof=1) / np.sqrt(count)),
    }


def measure(name: str, mode: str, renderer: str, seconds: float, folder: Path) -> Row:
    """Render a scene in a process of its own. Raises CalledProcessError where that fails."""
    out = folder / "passes.npz"
    spp = SCENES[name]
    command = [sys.executable, "-m", "bench.media.one", renderer, str(folder / f"{name}.xml")]
    caches = {k: str(folder / k) for k in ("XDG_CACHE_HOME", "POCL_CACHE_DIR")}
    environment = {**os.environ, **caches, "POCL_MAX_PTHREAD_COUNT": "1"}
    subprocess.run(
        [*command, mode, str(spp), str(seconds), str(out)],
        check=True, cwd=machine.ROOT, env=environment,
    )  # fmt: skip
    with np.load(out) as rendered, np.load(HERE / "references" / f"{name}.npz") as kept:
        passes, took = rendered["passes"], float(rendered["seconds"])
        measured = figures(passes, kept["mean"], took)
        pixels = passes[0].shape[0] * passes[0].shape[1]
    rate = pixels * spp / took / 1e6
    return {
        "scene": name,
        "mode": mode,
        "renderer": renderer,
        "spp": spp,
        "msamples": rate,
        **measured,
    }


def unpack(folder: Path) -> None:
    """Put the files of the scenes into a folder."""
    for file in (HERE / "scenes").iterdir():
        if file.suffix == ".z":
            (folder / file.stem).write_bytes(zlib.decompress(file.read_bytes()))
        else:
            (folder / file.name).write_bytes(file.read_bytes())


@click.command(help=__doc__)
@click.argument("scenes", nargs=-1, type=click.Choice(list(SCENES)))
@click.option("--mode", "modes", multiple=True, type=click.Choice(["rgb", "spectral"]))
@click.option("--seconds", default=8.0, show_default=True, help="processor time of each")
@click.option("--json", "path", type=click.Path(), help="append the figures as JSON lines")
def main(scenes: tuple[str, ...], modes: tuple[str, ...], seconds: float, path: str | None) -> None:
    table = Table("scene", "mode", "renderer", "Msamples/s", "relMSE 99 %", "eff. 99 %", "bias, %")
    rows: list[Row] = []
    with tempfile.TemporaryDirectory() as folder_name:
        folder = Path(folder_name)
        unpack(folder)
        for name in scenes or SCENES:
            for mode in modes or ("rgb", "spectral"):
                if name == "chroma_spectral" and mode == "rgb":
                    continue  # its extinction is a spectrum
                compared = [
                    measure(name, mode, renderer, seconds, folder) for renderer in ("clpt", *PEERS)
                ]
                best = max(row["efficiency_99"] for row in compared[1:])
                compared[0]["efficiency_ratio"] = compared[0]["efficiency_99"] / best
                rows += compared
                for row in compared:
                    ratio = f" ({row['efficiency_99'] / best:.2f})"
                    table.add_row(
                        name, mode, row["renderer"], f"{row['msamples']:.3f}",
                        f"{row['relmse_99']:.4g}", f"{row['efficiency_99']:.3g}{ratio}",
                        f"{row['bias'] * 100:+.2f} ± {row['bias_se'] * 100:.2f}",
                    )  # fmt: skip
                machine.append(path, "media", compared)
    machine.console().print(table)
    ratios = [row["efficiency_ratio"] for row in rows if "efficiency_ratio" in row]
    mean = float(np.exp(np.mean(np.log(ratios))))
    machine.console().print(f"efficiency over the better of Mitsuba's, geometric mean: {mean:.2f}")


if __name__ == "__main__":
    main()
