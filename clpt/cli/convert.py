"""`clpt convert`: an image or film in another format or for a screen; a scene in another format."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..errors import SceneError
from ..formats import FORMATS, locate, save
from .info import read_scene
from .options.grading import GradingOptions, grading_options
from .options.records import with_records
from .options.scene_options import Loading, reading_options
from .process import terminal

if TYPE_CHECKING:
    from ..scene import Scene

MAP_ROWS, MAP_SAMPLES = 512, 64  # of a map of the surroundings


@click.command()
@click.argument("source", type=click.Path(path_type=Path))
@click.argument("target", type=click.Path(path_type=Path), required=False)
@click.option("-o", "--output", type=click.Path(path_type=Path), help="The same as TARGET.")
@click.option("--layer", metavar="NAME", help="Take this layer of an .exr in place of the picture.")
@grading_options
@reading_options
@with_records(graded=GradingOptions, loading=Loading)
def convert(
    source: Path, target: Path | None, output: Path | None, layer: str | None,
    graded: GradingOptions, loading: Loading,
) -> None:  # fmt: skip
    """Write the image or film SOURCE as TARGET, in another format or for a screen.

    SOURCE is any image that clpt reads, a film or a checkpoint; the suffix of TARGET is .exr, .png,
    .jpg, .webp, .hdr, .pfm or .npy. A spectral .exr becomes its colours.

    A SOURCE that is a scene or a folder with a scene, such as old.xml of Mitsuba 0.6, becomes a
    scene of today: TARGET is a .json, or a folder for a scene.json; or USD, .usda, .usdc or .usdz;
    or glTF, .glb or .gltf. What these cannot say is told, a line each.
    """
    if (target is None) == (output is None):
        raise click.UsageError("give TARGET once: as an argument, or by -o")
    target = target or output
    assert target is not None
    file = locate(source)
    if file.name.lower().endswith(tuple(FORMATS)):
        _convert_scene(file, target, loading)
        return
    from .files.image_tools import write_converted

    for line in write_converted(source, target, layer, graded.grading):
        terminal.say(line)


def _convert_scene(file: Path, target: Path, loading: Loading) -> None:
    """Write a scene, in a folder that is made if it is missing. Raises SceneError."""
    scene = read_scene(file, loading)
    for warning in scene.warnings:
        terminal.say(f"clpt: warning: {warning}")
    if not target.suffix:
        target /= "scene.json"
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise SceneError(f"cannot be written: {error}", file=target) from error
    if target.suffix.lower() != ".json":
        scene = _with_maps(scene)
    for loss in save(scene, target):
        terminal.say(f"clpt: not in the file: {loss}")
    terminal.say(str(target))


def _with_maps(scene: Scene) -> Scene:
    """Return a scene whose sky and cube of images are a map in latitude and longitude."""
    import numpy as np

    from ..scene import Film, Scene, cameras, integrators
    from ..scene.lights import Constant, Envmap

    around = [light for light in scene.lights if light.reach == "infinite"]
    if all(isinstance(light, (Constant, Envmap)) for light in around):
        return scene
    from ..render.renderer import Renderer

    film = Film(width=2 * MAP_ROWS, height=MAP_ROWS, mode="rgb", filter=integrators.Box())
    empty = Scene(camera=cameras.Spherical(), lights=around, film=film)
    with Renderer(empty) as renderer:
        renderer.run(MAP_SAMPLES)
        pixels = np.asarray(renderer.image())[..., :3]
    # Rows of the film lie half a row from the poles, rows of an envmap on them.
    row = np.clip(np.linspace(0.0, MAP_ROWS, MAP_ROWS) - 0.5, 0.0, MAP_ROWS - 1.0)
    upper = np.minimum(row.astype(int), MAP_ROWS - 2)
    share = (row - upper)[:, None, None]
    image = ((1.0 - share) * pixels[upper] + share * pixels[upper + 1]).astype(np.float32)
    others = [light for light in scene.lights if light.reach != "infinite"]
    return dataclasses.replace(scene, lights=[*others, Envmap(image=image)])
