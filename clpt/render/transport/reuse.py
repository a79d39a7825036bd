"""Whether path reuse pays, see kernels/transport/reuse.cl.

It does where most paths go from one diffuse surface to another. So a few rays are cast first.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from clpt.denoise import needs
from clpt.files import disk_cache
from clpt.geometry import casting
from clpt.render.geometry.find import Geometry
from clpt.render.scene_index import SceneIndex, leaves_of
from clpt.scene import materials as mt
from clpt.scene.cameras.camera import View
from clpt.scene.shapes import Shape

SAMPLES = 1 << 19  # of a film that is worth the rays: some hundredths of a second
RAYS = 512
OFFSET = 1e-4  # from a surface, of the distance of a hit
SHARE = 0.35  # of the rays whose paths share; measured, see bench/notes/light_paths.md


def is_certain(index: SceneIndex) -> bool:
    """Return whether path reuse pays wherever many paths share.

    Under a sky it pays in some scenes: in others most noise is that of light straight from there.
    """
    return not any(light.reach == "infinite" for light in index.lights)


def many_share(index: SceneIndex, geometry: Geometry) -> bool:
    """Return whether many paths have diffuse first and second vertices, which are shared.

    Never for denoisers: there the noise of pixels must be independent.
    """
    told = not {*needs.LAYERS}.isdisjoint(index.film.layers)
    if index.samples < SAMPLES or not index.reused or index.prototypes or told:
        return False
    view = index.camera.view_of(index.film.width, index.film.height)
    if view is None:
        return False
    diffuse = np.zeros(len(geometry.faces), bool)
    for shape, _, faces in geometry.meshes():
        diffuse[faces] = _is_diffuse(shape)
    if not diffuse.any():
        return False
    asked = repr((view.origin.tolist(), view.axis.tolist(), view.angle)).encode()
    code, content = (__file__, casting.__file__), (asked, geometry.digest, diffuse)

    def shared() -> float:
        return _share(geometry.vertices[geometry.faces], diffuse, view)

    share = disk_cache.remembered(code, content, shared)
    return bool(share >= SHARE)


def _share(triangles: NDArray[np.float32], diffuse: NDArray[np.bool_], view: View) -> float:
    """Return the share of paths whose first and second vertices are diffuse.

    triangles: (n, 3, 3) [m]; diffuse: (n,) whether they are.
    """
    random, caster = np.random.default_rng(0), casting.Caster(triangles)
    origins = np.tile(view.origin, (RAYS, 1))
    directions = casting.cone(view.axis, math.cos(view.angle), RAYS)
    for vertex in (1, 2):
        met, far = caster.nearest(origins, directions)
        stays = (met >= 0) & diffuse[met]
        if vertex == 2 or not stays.any():
            break
        corners, directions = triangles[met[stays]].astype(np.float64), directions[stays]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        normals *= -np.sign((normals * directions).sum(axis=1))[:, None]
        far = far[stays, None]
        origins = origins[stays] + far * directions + OFFSET * far * normals
        directions = normals + casting.sphere(random, len(normals))
    return int(stays.sum()) / RAYS


def _is_diffuse(shape: Shape) -> bool:
    """Whether paths share vertices on a shape."""
    bent = any(isinstance(part, mt.NormalMapped) for part in mt.parts(shape.material))
    lobes = all(cls.has_diffuse_lobe for cls in leaves_of(shape.material))
    return lobes and shape.emission is None and not bent
