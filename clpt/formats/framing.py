"""A bare mesh or a bare density as a scene: it stands in the studio."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from clpt import transforms
from clpt.choices import Missing
from clpt.errors import SceneError
from clpt.formats import volumes
from clpt.formats.meshes import mesh
from clpt.scene import Scene, cameras, integrators, lights, materials, media, shapes
from clpt.scene.studio import Up

DARK = lights.Constant(radiance=0.0)  # in place of the studio's lights where shapes alone shine


def load_mesh(path: Path, missing: Missing = "error") -> Scene:
    """Read a bare mesh and put it into the studio, whatever its size and position.

    missing: see clpt.load.
    """
    file = mesh.read_mesh(path, missing=missing)
    if not any(mesh.has_area(part) for part in file.meshes):
        raise SceneError("none of its triangles has an area", file=path)
    scene = show(file.meshes, file=path, up="z" if path.suffix.lower() == ".stl" else "y")
    scene.warnings = file.warnings
    return scene


def show(
    contents: Sequence[shapes.Shape],
    *,
    file: Path,
    camera: cameras.Camera | None = None,
    own_lights: Sequence[lights.Light] = (),
    up: Up = "y",
    lit: bool = False,
) -> Scene:
    """Return a scene of the shapes of a file; `Scene.studio` adds missing cameras and lights.

    lit: whether the shapes light the scene, so that no lights are missing.
    """
    known = own_lights or ([DARK] if lit else [])
    try:
        scene = Scene.studio(contents, camera=camera, lights=known, up=up, name=file.stem)
    except SceneError as error:
        raise SceneError(error.message, file=file) from None
    scene.lights = [light for light in scene.lights if light is not DARK]
    scene.extra["format"] = file.suffix.lower()[1:]
    return scene


DEPTH = 16.0  # optical depth of the thickest column along an axis of the grid, on average
MAX_DEPTH = 128
TO_BOX = transforms.translate([0.5, 0.5, 0.5]) @ transforms.scale(0.5)  # from a cube's corners


def load_density(path: Path) -> Scene:
    """Read a bare density and put it into the studio, whatever its size, position and density.

    Programs give densities different units, so it is scaled to be as thick as DEPTH.
    Raises SceneError for a file without a density, and for a density that is 0 everywhere.
    """
    density = volumes.read(path)
    to_world = np.asarray(density.to_world, float)
    steps = np.linalg.norm(to_world[:3, :3], axis=0) / density.values.shape  # of a cell, [m]
    columns = [float(density.values.sum(axis=i, dtype=float).max()) * steps[i] for i in range(3)]
    if not min(columns) > 0.0:
        raise SceneError("its density is 0 everywhere: nothing would be seen", file=path)
    cloud = media.Grid(density=density, sigma_t=DEPTH / float(np.mean(columns)), albedo=0.99)
    box = shapes.Cube(
        to_world=to_world @ TO_BOX, material=materials.Null(), interior=cloud, name=path.stem
    )
    scene = show([box], file=path)
    scene.integrator = integrators.Path(max_depth=MAX_DEPTH, rr_depth=16)
    return scene
