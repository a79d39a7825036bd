"""Scenes in the format of PBRT versions 2, 3 and 4.

A feature that is not supported is an error or a warning that names the file, the line and the
directive. docs/pbrt.md has the tables.
"""

from __future__ import annotations

from pathlib import Path

from clpt.choices import Missing
from clpt.formats.pbrt import build_scene, camera_film, old_materials, reader
from clpt.formats.pbrt.params import Parameters
from clpt.formats.pbrt.state import Contents, Definition, State
from clpt.formats.reading import Progress
from clpt.scene import Scene

__all__ = ["load"]


def load(path: Path, progress: Progress | None = None, missing: Missing = "error") -> Scene:
    """Read a .pbrt file, packed by gzip or not.

    progress: called with the share that is done, from 0 to 1, and a text; missing: see clpt.load.
    Raises SceneError with file, line and directive for anything broken or not supported.
    """
    contents = reader.read(path)
    shared = contents.shared
    shared.missing = missing
    shared.make_material = build_scene.make_material
    shared.walks = all(item.kind in ("infinite", "portal") for item in contents.lights)
    options = contents.options
    camera = options.get("Camera") or _default_camera(path, contents)
    exposure = camera_film.exposure_time(camera.params, shared.old)
    film = camera_film.film(options.get("Film"), options.get("PixelFilter"), exposure, shared.old)
    integrator = options.get("Integrator")
    if shared.old:
        shared.mirrors = old_materials.has_mirrors(contents)
    chosen = options.get("Sampler")
    sampler, spp, seed = camera_film.sampler(chosen)
    scene = Scene(
        camera=camera_film.camera(camera, film, camera_film.diagonal(options.get("Film"))),
        shapes=build_scene.shapes(contents, progress),
        lights=build_scene.lights(contents),
        integrator=camera_film.integrator(integrator, film),
        sampler=sampler,
        film=film,
        spp=spp,
        seed=contents.seed or 0 if seed is None else seed,
        name=path.name.partition(".pbrt")[0],
        extra={"format": "pbrt", "sampler": chosen.kind if chosen else sampler.kind},
    )
    build_scene.check_unused_materials(contents)
    build_scene.check_options([item for name, item in options.items() if name != "Accelerator"])
    scene.warnings = build_scene.deduplicated(shared.warnings)
    return scene


def _default_camera(path: Path, contents: Contents) -> Definition:
    state = State(contents.shared, path.parent)
    return Definition("perspective", Parameters('Camera "perspective"', path, 1), state)
