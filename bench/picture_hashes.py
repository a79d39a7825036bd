"""Pictures of all scenes of the repository as hashes: whether a change kept every bit of them.

    python -m bench.picture_hashes > before.json
    python -m bench.picture_hashes --compare before.json

renders each scene of `scenes` and `tests/scenes` small, with few samples, in both modes; Cornell's
box also with every integrator, sampler, layout and way of queueing. Equal hashes are equal floats.
The hashes differ between processors, drivers and compilers: compare on the same machine only.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click
import numpy as np

import clpt
from clpt.scene import Scene, integrators

ROOT = Path(__file__).resolve().parents[1]
SIZE, SPP = (44, 33), 4
MODES = ("rgb", "spectral")
OPTIONS: tuple[dict[str, Any], ...] = (
    {"layout": "brute"},
    {"layout": "binary"},
    {"layout": "wide8"},
    {"layout": "compact"},
    {"looped": False},
    {"slots": 128},
)


def files() -> list[Path]:
    """Every scene file of the repository."""
    paths = [*ROOT.glob("scenes/*/scene*.json")]
    paths += [path for path in ROOT.glob("tests/scenes/**/*") if path.suffix in (".xml", ".pbrt")]
    return sorted(paths)


def small(scene: Scene, mode: str, **changes: Any) -> Scene:
    """The scene with a small film in a mode."""
    film = dataclasses.replace(scene.film, width=SIZE[0], height=SIZE[1], mode=mode, crop=None)
    if mode == "rgb":
        film = dataclasses.replace(film, bands=0, sensor="cie1931")
    return dataclasses.replace(scene, film=film, **changes)


def cases(only: str) -> Iterator[tuple[str, Scene, dict[str, Any]]]:
    """Name, scene and renderer's options of every picture whose name holds `only`."""
    for file in files():
        name = str(file.relative_to(ROOT))
        if any(only in f"{name} {mode}" for mode in MODES):
            try:
                scene = clpt.load(file)
            except clpt.SceneError as error:  # of a scene whose files its generate.py has to make
                click.echo(f"left out: {error}", err=True)
                continue
            yield from ((f"{name} {mode}", small(scene, mode), {}) for mode in MODES)
    box = clpt.load(ROOT / "scenes/cornell_box/scene.json")
    for mode in MODES:
        for cls in integrators.KINDS:
            yield f"integrator {cls.kind} {mode}", small(box, mode, integrator=cls()), {}
        for sampler in integrators.SAMPLERS:
            yield f"sampler {sampler.kind} {mode}", small(box, mode, sampler=sampler()), {}
    for options in OPTIONS:
        yield f"options {json.dumps(options)}", small(box, "rgb"), options


def picture(scene: Scene, options: dict[str, Any]) -> str:
    """The hash of a picture; of a scene that is refused, the kind of error."""
    try:
        image = clpt.render(scene, SPP, **options)
    except clpt.ClptError as error:
        return type(error).__name__
    return hashlib.sha256(np.ascontiguousarray(image, np.float32).tobytes()).hexdigest()


@click.command()
@click.option("--compare", type=click.Path(exists=True, path_type=Path), help="Former hashes.")
@click.option("--only", default="", help="Part of the names of the pictures to make.")
def main(compare: Path | None, only: str) -> None:
    """Print the hashes as JSON, or their differences from former hashes."""
    hashes = {n: picture(scene, options) for n, scene, options in cases(only) if only in n}
    if compare is None:
        click.echo(json.dumps(hashes, indent=1))
        return
    former = json.loads(compare.read_text("utf-8"))
    differ = [name for name, value in hashes.items() if former.get(name) != value]
    click.echo(
        "\n".join([*differ, f"{len(hashes) - len(differ)} of {len(hashes)} pictures are equal"])
    )
    raise SystemExit(bool(differ))


if __name__ == "__main__":
    main()
