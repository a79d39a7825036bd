"""A bare density in the studio of bare meshes: a white cloud, as thick as a cloud looks."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from clpt import transforms
from clpt.errors import SceneError
from clpt.formats import volumes
from clpt.formats.meshes import framing
from clpt.scene import Scene, integrators, materials, media, shapes

DEPTH = 16.0  # optical depth of the thickest column along an axis of the grid, on average
MAX_DEPTH = 128
TO_BOX = transforms.translate([0.5, 0.5, 0.5]) @ transforms.scale(0.5)  # from a cube's corners


def load(path: Path) -> Scene:
    """Read a bare density and put it into the studio, whatever its size, position and density.

    What a density means differs from program to program, so it is scaled to be as thick as DEPTH.
    Raises SceneError for what is no density, and for one that is 0 everywhere.
    """
    found = volumes.read(path)
    to_world = np.asarray(found.to_world, float)
    steps = np.linalg.norm(to_world[:3, :3], axis=0) / found.values.shape  # of a cell, [m]
    columns = [float(found.values.sum(axis=i, dtype=float).max()) * steps[i] for i in range(3)]
    if not min(columns) > 0.0:
        raise SceneError("its density is 0 everywhere: nothing would be seen", file=path)
    cloud = media.Grid(density=found, sigma_t=DEPTH / float(np.mean(columns)), albedo=0.99)
    box = shapes.Cube(
        to_world=to_world @ TO_BOX, material=materials.Null(), interior=cloud, name=path.stem
    )
    scene = framing.show([box], file=path)
    scene.integrator = integrators.Path(max_depth=MAX_DEPTH, rr_depth=16)
    return scene
