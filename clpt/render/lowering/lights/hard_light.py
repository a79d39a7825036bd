"""Whether paths from lights help: what `light_paths="auto"` of `path` becomes.

They find the light that something sharp has gathered on something dull. Where the lamp is large,
paths from the camera find that light too, and sooner.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.render.contract import shape_records
from clpt.render.lowering.camera import cameras
from clpt.render.lowering.encoder import Encoder
from clpt.render.lowering.geometry import analytic, shapes, triangles
from clpt.render.lowering.geometry.geometry import Geometry
from clpt.render.lowering.index import SceneIndex
from clpt.render.lowering.lights import image_lights
from clpt.render.lowering.lights.aims import is_sharp
from clpt.render.lowering.lights.lights import Emitter
from clpt.scene import materials as mt
from clpt.scene.integrators import AUTO
from clpt.scene.lights import CubeMap, Envmap
from clpt.scene.shapes import Shape

SMALL = 0.01  # of the sphere that is seen: up to it a light is small
NEAR = 0.25  # of the scene's radius: a light counts as no nearer to what it shines on
SUN = 0.25  # of an image's power: where it comes from a small part the image is a small light
FEWEST = 3  # edges of a path from a light over two surfaces to the camera: the shortest caustic

Ball = tuple[NDArray[np.float64], float]  # centre and radius


def decided(
    index: SceneIndex,
    geometry: Geometry,
    encoder: Encoder,
    sphere: Ball,
    former: int | None = None,
) -> tuple[SceneIndex, str]:
    """Return the index with a number in the place of "auto", and the reason as a sentence.

    The sentence is empty where the scene says a number. sphere: centre and radius of one around the
    scene [m]; former: the number of a renderer that goes on with this scene, whose film has a place
    for light paths or none. Raises SceneError for an image light that is broken.
    """
    if getattr(index.scene.integrator, "light_paths", None) != AUTO:
        return index, ""
    if former is None:
        number, reason = _choice(index, geometry, encoder, sphere)
    else:
        number, reason = former, "as before the scene was edited"
    integrator: Any = replace(index.scene.integrator, light_paths=number)  # type: ignore[call-arg]
    return replace(index, scene=replace(index.scene, integrator=integrator)), reason


def _choice(
    index: SceneIndex, geometry: Geometry, encoder: Encoder, sphere: Ball
) -> tuple[int, str]:
    """The number of light paths for each sample, and why; what is cheap to know is asked first."""
    scene = index.scene
    if not cameras.is_connected(scene.camera, scene.film.mode):
        return 0, "points cannot be joined to this camera"
    if 0 <= scene.integrator.max_depth < FEWEST:  # type: ignore[attr-defined]
        return 0, "the longest path is too short for a caustic"
    sharp = _first_with(index.shapes, is_sharp)
    if sharp is None:
        return 0, "nothing is sharp"
    if _first_with((one for one in index.shapes if one.emission is None), _is_dull) is None:
        return 0, "there is nothing dull for a caustic to be seen on"
    small = next(_small_lights(index, geometry, encoder, sphere), None)
    if small is None:
        return 0, "no light is small"
    return 1, f"{shapes.where(sharp)} is sharp, and {small} is a small light"


def _first_with(all_: Iterable[Shape], wanted: Any) -> Shape | None:
    """The first shape whose material is as wanted; a material is asked once."""
    asked: set[int] = set()
    for shape in all_:
        if id(shape.material) not in asked and wanted(shape.material):
            return shape
        asked.add(id(shape.material))
    return None


def _is_dull(material: mt.Material) -> bool:
    """Whether light paths can be joined to the camera on a material, or on one inside it."""
    if isinstance(material, mt.NormalMapped) or not material.reversible:
        return False
    if isinstance(material, mt.COMPOSITES):
        return any(_is_dull(part) for _, part in mt.inner(material))
    return not material.delta and not is_sharp(material)


def _small_lights(
    index: SceneIndex, geometry: Geometry, encoder: Encoder, sphere: Ball
) -> Iterator[str]:
    """The names of small lights, those first of which it is known at once."""
    for i, lamp in enumerate(index.scene.lights):
        if lamp.reach in ("placed", "distant") and getattr(lamp, "falloff", True):
            yield f"lights[{i}]"
    middle, radius = sphere
    for emitter in geometry.emitters:
        area, place = _area_and_place(emitter, encoder)
        far = max(float(np.linalg.norm(place - middle)), NEAR * radius)
        if area < SMALL * 4.0 * np.pi * far**2:
            yield shapes.where(emitter.shape)
    for i, lamp in enumerate(index.scene.lights):
        if not isinstance(lamp, (Envmap, CubeMap)):
            continue
        if image_lights.extent(lamp, encoder, SUN) < SMALL:
            yield f"lights[{i}]"


def _area_and_place(emitter: Emitter, encoder: Encoder) -> tuple[float, NDArray[Any]]:
    """The area of a shape that emits [m^2], and the middle of the box around it (3,) [m]."""
    vertices, faces = emitter.vertices, emitter.faces
    if vertices is None:
        low, high = analytic.bounds(emitter.shape)
        return analytic.area(emitter.shape), (low + high) / 2.0
    middle = (vertices[:, :3].min(axis=0) + vertices[:, :3].max(axis=0)) / 2.0
    if emitter.shape.kind in shape_records.ONE_OF:
        return float(4.0 * np.pi * (vertices[:, 3].astype(np.float64) ** 2).sum()), middle
    return float(encoder.cache(triangles.triangle_areas, vertices, faces).sum()), middle
