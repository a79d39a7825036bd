"""How many lanes are busy while rays go through densities on grids.

`python -m bench.media.lanes [SCENE ...]`

A copy of the kernels counts in flights (kernels/media/grid_flight.cl) the steps that a path takes
and those that its block takes: a path's light is outshone by them, and a picture has their means.
`busy` is their ratio, lanes without a ray in a grid counted, and `flights` how many a path begins.
"""

from __future__ import annotations

import dataclasses
import shutil
import tempfile
from pathlib import Path

import click
import numpy as np

import clpt
from bench import machine
from bench.media.__main__ import unpack
from clpt.device import source

SCENES = {"cloud": 8, "smoke": 32}
UNIT = 1e4  # of light that stands for a step: a scene's own is some 1
COUNTERS = "taken", "steps", "begun"
MEMBERS = "real " + ", ".join(COUNTERS) + ";"
ZEROS = "(real)(0.0f), " * 3
BEGIN = """
    real taken = 0.0f, steps = 0.0f, begun = sel(active, (real)(1.0f), (real)(0.0f));
    while (any(active)) {
        taken += sel(active, (real)(1.0f), (real)(0.0f));
        steps += 1.0f;"""
COUNT = """        {
            union { integer all; int each[LANES]; } there;
            int count = 0;
            there.all = sel_i(alive, (integer)(1), (integer)(0));
            for (int i = 0; i < LANES; i++) count += there.each[i];
            Spectrum sum = spectrum_of(0.0f);
            sum.x = taken * UNIT;
            sum.y = steps * (UNIT * LANES / count);
            sum.z = begun * UNIT;
            store_path_radiance(path, at, alive, spectrum_add(load_path_radiance(path, at), sum));
        }
""".replace("UNIT", f"{UNIT:.1e}f")
KEEP = "            store_path_ratio(path, at, gridded, own.ratio);"
CHANGES = {  # what is put before and after a text
    "media/grid_flight.cl": [
        ("    mask collides;", "", MEMBERS),
        ("    while (any(active)) {", BEGIN, None),
        ("f = {mask_of(0), ", "", ZEROS),
        ("    return f;", "".join(f"    f.{n} = {n};\n" for n in COUNTERS), ""),
    ],
    "stage/flight.cl": [
        (
            "#if USES_GRIDS\n        mask gridded",
            "real taken = 0.0f, steps = 0.0f, begun = 0.0f;\n",
            "",
        ),
        (KEEP, "", "".join(f"{n} = own.{n};" for n in COUNTERS)),
        ("        store_path_beta(path, at, flies,", COUNT, ""),
    ],
}


def counting_kernels(folder: Path) -> Path:
    """Copy the kernels, and change those that count. Raises ValueError where a text has changed."""
    kernels = folder / "counting"
    shutil.copytree(source.kernels_folder(), kernels)
    for name, changes in CHANGES.items():
        text = (kernels / name).read_text()
        for old, before, after in changes:
            if old not in text:
                raise ValueError(f"{name} has no {old!r}")
            new = before if after is None else before + old + after  # None: in its place
            text = text.replace(old, new)
        (kernels / name).write_text(text)
    return kernels


def count(file: Path, spp: int) -> dict[str, float]:
    """Return the mean steps of a path and of its block, and its flights."""
    scene = clpt.load(file)
    scene.film = dataclasses.replace(scene.film, mode="rgb")
    with clpt.Renderer(scene, threads=1) as renderer:
        renderer.run(spp)
        taken, steps, begun = np.asarray(renderer.image(), float)[..., :3].mean(axis=(0, 1)) / UNIT
    return {
        "flights": round(float(begun), 3),
        "steps": round(float(taken), 3),
        "busy": round(float(taken / steps), 4),
    }


@click.command(help=__doc__)
@click.argument("scenes", nargs=-1, type=click.Choice(list(SCENES)))
@click.option("--json", "path", type=click.Path(), help="append the figures as JSON lines")
def main(scenes: tuple[str, ...], path: str | None) -> None:
    with tempfile.TemporaryDirectory() as folder_name:
        folder = Path(folder_name)
        unpack(folder)
        kernels = counting_kernels(folder)
        source.kernels_folder = lambda: kernels
        for name in scenes or SCENES:
            counts = count(folder / f"{name}.xml", SCENES[name])
            machine.console().print(name, counts)
            rows = [{**machine.circumstances(), "scene": name, **counts}]
            machine.append(path, "lanes", rows)


if __name__ == "__main__":
    main()
