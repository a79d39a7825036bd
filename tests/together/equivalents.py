"""Scenes, and ways to render them, that have the same picture: the table EQUIVALENTS.

BITS: the same numbers are computed, so that pictures are the same to the bit. NEAR: the same but
for how float32 rounds. MEAN: other random numbers serve the same integral, so means agree alone.
"""

from __future__ import annotations

import dataclasses
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import clpt
from clpt import device as dev
from clpt import spectra
from clpt.errors import SceneError
from clpt.render.edit.plans import refusal
from clpt.render.flow.scene_to_tables import lower
from clpt.scene import Scene, integrators, materials, media, shapes, textures
from clpt.scene.motion import Deformation, Keys, Shutter

Values = NDArray[np.float64]
Scenes = Callable[[Scene], "Scene | None"]
BITS, NEAR, MEAN = "bits", "near", "mean"
ROUNDING = 1e-5  # relative, of NEAR
FAR = 900.0  # where what is added does not matter [m]
STILL = Keys((0.0, 1.0), np.array([np.eye(4), np.eye(4)]))


@dataclasses.dataclass(frozen=True)
class Equivalent:
    """How else a scene may be rendered.

    scene: the equivalent scene, None where there is none; picture: of that scene at `samples`;
    part: of the picture of the first scene, which the other one's equals.
    """

    tolerance: str
    scene: Scenes = lambda scene: scene
    picture: Callable[[Scene, int], Values] | None = None
    part: Callable[[Values, Scene], Values] = lambda image, scene: image


def rendered(scene: Scene, samples: int, **options: Any) -> Values:
    """The picture after so many samples, in float64."""
    with clpt.Renderer(scene, **options) as renderer:
        renderer.run(samples)
        return np.asarray(renderer.image(), np.float64)


# Every part of a scene ------------------------------------------------------------------------


def with_materials(scene: Scene, change: Callable[[Any], Any]) -> Scene | None:
    """The scene with every material of its shapes changed; None where none is."""
    made: dict[Any, Any] = {}

    def of(shape: Any) -> Any:
        if isinstance(shape, shapes.Instance):
            return shape
        material = made.setdefault(shape.material, change(shape.material))
        return dataclasses.replace(shape, material=material)

    found = [of(shape) for shape in scene.shapes]
    if all(old is new for old, new in made.items()):
        return None
    return dataclasses.replace(scene, shapes=found)


def every_shape(scene: Scene) -> list[Any]:
    """The shapes of a scene, and of its groups."""
    groups = (getattr(one, "group", None) for one in scene.shapes)
    found = zip(scene.shapes, groups, strict=True)
    return [inner for one, group in found for inner in (group.shapes if group else (one,))]


def with_media(scene: Scene, change: Callable[[Any], Any]) -> Scene | None:
    """The scene with every medium changed; None where none is."""
    made: dict[Any, Any] = {None: None}

    def of(medium: Any) -> Any:
        return made.setdefault(medium, change(medium)) if medium is not None else None

    found = [
        shape
        if isinstance(shape, shapes.Instance)
        else dataclasses.replace(shape, interior=of(shape.interior), exterior=of(shape.exterior))
        for shape in scene.shapes
    ]
    if any(isinstance(shape, shapes.Instance) and _has_media(shape) for shape in scene.shapes):
        return None
    camera = dataclasses.replace(scene.camera, medium=of(scene.camera.medium))
    if all(old is new for old, new in made.items()):
        return None
    return dataclasses.replace(scene, shapes=found, camera=camera)


def _has_media(instance: shapes.Instance) -> bool:
    inner = instance.group.shapes
    return any(one.interior is not None or one.exterior is not None for one in inner)


# Equivalent scenes ----------------------------------------------------------------------------


def groups(*, far: bool) -> Scenes:
    """Meshes that are no light are instances of groups, one each.

    far: with a tiny copy far below, as a group that has one instance is put where that is.
    """
    below = clpt.transforms.translate([0.0, -FAR, 0.0]) @ clpt.transforms.scale(1e-2)

    def grouped(shape: Any) -> list[Any]:
        plain = isinstance(shape, (shapes.Mesh, shapes.Cube, shapes.Rectangle))
        plain = plain and shape.emission is None and shape.motion is None and not shape.priority
        if not plain or getattr(shape, "deformation", None) is not None:
            return [shape]
        group = shapes.Group((shape,))
        return [
            shapes.Instance(group=group, name=shape.name, to_world=place)
            for place in (np.eye(4), below)[: 1 + far]
        ]

    def changed(scene: Scene) -> Scene | None:
        found = [one for shape in scene.shapes for one in grouped(shape)]
        if all(one in scene.shapes for one in found):
            return None
        return dataclasses.replace(scene, shapes=found)

    return changed


def still_keys(scene: Scene) -> Scene | None:
    """What may move has two keys of one place."""
    found = [
        dataclasses.replace(shape, motion=STILL) if shape.motion is None else shape
        for shape in scene.shapes
    ]
    return dataclasses.replace(scene, shapes=found) if found else None


def beside_motion(scene: Scene) -> Scene | None:
    """Something tiny moves far below, so that every path has a time."""
    if scene.camera.motion is not None or any(one.motion for one in scene.shapes):
        return None
    moved = np.array([np.eye(4), clpt.transforms.translate([0.1, 0.0, 0.0])])
    mote = shapes.Cube(
        to_world=clpt.transforms.translate([0.0, -FAR, 0.0]) @ clpt.transforms.scale(1e-2),
        motion=Keys((0.0, 1.0), moved),
    )
    camera = dataclasses.replace(scene.camera, shutter=Shutter(0.0, 1.0))
    return dataclasses.replace(scene, shapes=[*scene.shapes, mote], camera=camera)


def still_points(scene: Scene) -> Scene | None:
    """Meshes have two keys of the same vertices."""

    def deformed(shape: Any) -> Any:
        if not isinstance(shape, shapes.Mesh) or shape.deformation is not None:
            return shape
        points = np.asarray(shape.vertices)
        return dataclasses.replace(
            shape, deformation=Deformation((0.0, 1.0), np.array([points, points]))
        )

    found = [deformed(shape) for shape in scene.shapes]
    if all(new is old for new, old in zip(found, scene.shapes, strict=True)):
        return None
    return dataclasses.replace(scene, shapes=found)


def grids_of_one(scene: Scene) -> Scene | None:
    """Homogeneous media have a grid with one density, over the scene's box and more."""

    def gridded(medium: Any) -> Any:
        if type(medium) is not media.Homogeneous:
            return medium
        given = {f.name: getattr(medium, f.name) for f in dataclasses.fields(medium)}
        afar = clpt.transforms.scale(200.0) @ clpt.transforms.translate([-0.5, -0.5, -0.5])
        return media.Grid(density=np.ones((2, 3, 2), np.float32), to_world=afar, **given)

    if any(isinstance(m, media.Homogeneous) and m.light is not None for m in _media(scene)):
        return None
    return with_media(scene, gridded)


def mixtures_of_one(scene: Scene) -> Scene | None:
    """Media on a grid, or of one density, are the one part of a mixture."""

    def mixed(medium: Any) -> Any:
        plain = type(medium) in (media.Homogeneous, media.Grid) and medium.light is None
        if not plain or getattr(medium, "albedo_grid", None) is not None:
            return medium
        if getattr(medium, "color_grid", None) is not None:
            return medium
        empty = media.Grid(density=np.zeros((2, 2, 2), np.float32), to_world=_box_of(medium))
        parts = (medium,) if isinstance(medium, media.Grid) else (medium, empty)
        return media.Mixture(parts=parts)

    return with_media(scene, mixed)


def _box_of(medium: Any) -> Any:
    afar = clpt.transforms.scale(200.0) @ clpt.transforms.translate([-0.5, -0.5, -0.5])
    return getattr(medium, "to_world", afar)


def _media(scene: Scene) -> list[Any]:
    return [m for one in scene.shapes for m in (one.interior, one.exterior) if m is not None]


def blends(weight: float) -> Scenes:
    """Every material is the share 1 of a blend, which is never anything else."""

    def blended(material: Any) -> Any:
        if isinstance(material, (materials.Null, materials.Mask, *BENT)):
            return material
        other = materials.Diffuse(reflectance=0.123)
        pair = (other, material) if weight else (material, other)
        return materials.Blend(first=pair[0], second=pair[1], weight=weight)

    return lambda scene: with_materials(scene, blended)


BENT = (materials.Dielectric, materials.RoughDielectric)  # what is inside follows from them


def textures_of_one_colour(scene: Scene) -> Scene | None:
    """Colours of diffuse surfaces are images of 2 x 2 such pixels."""

    def textured(material: Any) -> Any:
        given = getattr(material, "reflectance", None)
        if type(material) is not materials.Diffuse or not isinstance(given, spectra.RGB):
            return material
        image = np.broadcast_to(np.float32([given.r, given.g, given.b]), (2, 2, 3)).copy()
        return dataclasses.replace(material, reflectance=textures.Bitmap(image=image))

    return with_materials(scene, textured)


def two_sided_twice(scene: Scene) -> Scene | None:
    """What is two-sided names its back; it is the front again."""

    def both(material: Any) -> Any:
        if type(material) is not materials.TwoSided or material.back is not None:
            return material
        return dataclasses.replace(material, back=material.front)

    return with_materials(scene, both)


def shapes_reversed(scene: Scene) -> Scene | None:
    """The shapes in the other order; of several that shine other ones would be chosen."""
    shining = sum(one.emission is not None for one in every_shape(scene))
    if len(scene.shapes) < 2 or shining > 1:
        return None
    return dataclasses.replace(scene, shapes=scene.shapes[::-1])


def lights_reversed(scene: Scene) -> Scene | None:
    """The lamps in the other order."""
    return dataclasses.replace(scene, lights=scene.lights[::-1]) if len(scene.lights) > 1 else None


CROP = (3, 2, 4, 5)


def cropped(scene: Scene) -> Scene | None:
    """A part of the picture alone, where no light is splatted from one pixel to another."""
    film, given = scene.film, scene.integrator
    splats = getattr(given, "light_paths", 0) != 0 or isinstance(given, integrators.ParticleTracer)
    box = type(film.filter) is integrators.Box and film.filter.radius == 0.5
    if splats or not box or film.crop is not None or min(film.width, film.height) < 8:
        return None
    return dataclasses.replace(scene, film=dataclasses.replace(film, crop=CROP))


def _crop_of(image: Values, scene: Scene) -> Values:
    x, y, w, h = CROP
    return image[y : y + h, x : x + w]


def saved_and_loaded(scene: Scene, samples: int) -> Values:
    """The scene as its file has it."""
    with tempfile.TemporaryDirectory() as folder:
        clpt.save(scene, Path(folder) / "scene.json")
        return rendered(clpt.load(Path(folder) / "scene.json"), samples)


# Other ways to render -------------------------------------------------------------------------


def before_update(scene: Scene) -> Scene:
    """A part of a scene whose renderer may go on with the whole; the scene where there is none."""
    other = dataclasses.replace(scene, shapes=scene.shapes[:1], lights=scene.lights[:1], seed=9)
    if not (other.lights or other.shapes):
        return scene
    try:
        former = lower(other)
    except SceneError:  # as a box is open without its lid
        return scene
    return scene if refusal(former, lower(scene, former=former, anew=True)) else other


def updated(scene: Scene, samples: int) -> Values:
    """By a renderer that had another scene before, with some samples taken."""
    with clpt.Renderer(before_update(scene)) as renderer:
        renderer.run(1)
        renderer.update(scene=scene)
        renderer.reset(seed=scene.seed)
        renderer.run(samples)
        return np.asarray(renderer.image(), np.float64)


def in_parts(scene: Scene, samples: int) -> Values:
    """In two runs, and the last sample by another renderer, whose film is merged."""
    with clpt.Renderer(scene) as first, clpt.Renderer(scene, first_sample=samples - 1) as last:
        for part in (1, samples - 2):
            if part > 0:
                first.run(part)
        last.run(1)
        first.merge(last.film_state())
        return np.asarray(first.image(), np.float64)


def with_options(**options: Any) -> Callable[[Scene, int], Values]:
    return lambda scene, samples: rendered(scene, samples, **options)


def with_lanes(lanes: int) -> Callable[[Scene, int], Values]:
    def picture(scene: Scene, samples: int) -> Values:
        on = dev.choose()
        on.lanes = lanes
        return rendered(scene, samples, device=on)

    return picture


EQUIVALENTS: dict[str, Equivalent] = {
    "groups of one": Equivalent(BITS, groups(far=False)),
    "groups and copies afar": Equivalent(NEAR, groups(far=True)),
    "beside motion": Equivalent(NEAR, beside_motion),
    "keys of one place": Equivalent(BITS, still_keys),
    "keys of the same vertices": Equivalent(BITS, still_points),
    "grids of one density": Equivalent(MEAN, grids_of_one),
    "mixtures of one": Equivalent(MEAN, mixtures_of_one),
    "blends with weight 0": Equivalent(BITS, blends(0.0)),
    "blends with weight 1": Equivalent(BITS, blends(1.0)),
    "textures of one colour": Equivalent(NEAR, textures_of_one_colour),
    "two-sided twice": Equivalent(BITS, two_sided_twice),
    "a crop": Equivalent(BITS, cropped, part=_crop_of),
    "shapes in the other order": Equivalent(BITS, shapes_reversed),
    "lights in the other order": Equivalent(MEAN, lights_reversed),
    "saved and loaded": Equivalent(BITS, picture=saved_and_loaded),
    "an update": Equivalent(BITS, picture=updated),
    "in parts": Equivalent(BITS, picture=in_parts),
    "the host's loop": Equivalent(BITS, picture=with_options(looped=False)),
    "few paths in flight": Equivalent(BITS, picture=with_options(slots=64)),
    "1 lane": Equivalent(NEAR, picture=with_lanes(1)),
    "8 lanes": Equivalent(NEAR, picture=with_lanes(8)),
    "brute": Equivalent(NEAR, picture=with_options(layout="brute")),
    "binary": Equivalent(NEAR, picture=with_options(layout="binary")),
    "compact": Equivalent(NEAR, picture=with_options(layout="compact")),
}


def off(ours: Values, other: Values) -> tuple[float, float]:
    """The share of pixels that are not the same to the bit, and the largest relative difference."""
    size = np.abs(other).max(axis=-1, keepdims=True) + 1e-3 * np.abs(other).mean() + 1e-30
    away = (np.abs(ours - other) / size).max(axis=-1)
    return float((ours != other).any(axis=-1).mean()), float(away.max())
