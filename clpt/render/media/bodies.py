"""Bodies of media: those that may overlap, and those that no shadow ray leaves.

A body's matter is its priority, material and interior medium. Bodies of the same matter share a
number, and join where they overlap; see kernels/media/bodies.cl.

No shadow ray leaves a sealed medium, as in bodies of glass, of milk or of skin. Its boundaries stop
shadow rays, so next-event estimation never lights a point inside. Paths there do without it, and
light that they meet by chance has its full weight; this is right wherever the lights are. The boxes
below only tell where it pays.

Escape rays leave sealed media toward lamps instead, through smooth boundaries that refract all
wavelengths alike, see kernels/media/escape.cl. They need no medium outside and plain paths; scenes
with other needs do without.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import is_whole
from clpt.errors import SceneError
from clpt.files import budget
from clpt.geometry import shapes
from clpt.geometry.winding import box
from clpt.render.geometry.surroundings import bounds_media, every
from clpt.render.materials.encode import MaterialWords
from clpt.render.materials.encoder import Encoder
from clpt.render.media.encode import MediumWords
from clpt.render.records.tables import LoweringCache
from clpt.render.scene_index import SceneIndex, any_of, leaves_of
from clpt.scene import materials as mt
from clpt.scene import roles
from clpt.scene.materials import CLEAR, Material
from clpt.scene.media import Medium
from clpt.scene.shapes import Shape
from clpt.spectra import Constant, Spectrum

MOST_NUMBERS = 255  # a path's word holds a number in a byte
DEPTH = 4  # bodies at a point: bytes of that word

Matter = tuple[int, Material, "Medium | None"]


def matter_of(shape: Shape) -> Matter | None:
    """Return the matter of a shape in a scene with priorities, None if the shape is no body."""
    if not shape.material.bounds_body and shape.interior is None:
        return None
    return shape.priority, shape.material, shape.interior


def check_bodies(placed: Iterable[Shape]) -> None:
    """Raise SceneError for priorities that make no sense.

    Where a shape has a priority, bodies must be closed and name no exterior.
    """
    listed = list(placed)
    for shape in budget.steps(listed):
        _check_priority(shape)
    if not any(shape.priority for shape in listed):
        return
    for shape in listed:
        if shape.is_open and matter_of(shape) is not None:
            raise SceneError(
                f"a {shape.kind} is not closed: where bodies have a priority, each is one closed "
                "shape, such as a mesh, a cube or a sphere",
                where=shapes.where(shape),
            )
    for shape in listed:
        if shape.exterior is not None:
            raise SceneError(
                "leave exterior out where bodies have a priority: it tells what is outside",
                where=shapes.where(shape),
            )


def _check_priority(shape: Shape) -> None:
    where, priority, material = shapes.where(shape), shape.priority, shape.material
    if not is_whole(priority) or priority < 0:
        raise SceneError(f"priority must be an integer from 0, not {priority!r}", where=where)
    if priority and shape.group is not None:
        raise SceneError("priority is for the shapes of its group", where=where)
    if priority and not (material.bounds_body or material.is_null):
        raise SceneError(
            "priority is for bodies of dielectric, rough_dielectric or null, not of "
            f"{material.kind}",
            where=where,
        )


class BodyWords:
    """The numbers of a scene's bodies, by rising priority. Raises SceneError for too many."""

    def __init__(self, placed: Iterable[Shape]):
        first_shapes: dict[Matter, Shape] = {}
        for shape in placed:
            matter = matter_of(shape)
            if matter is not None:
                first_shapes.setdefault(matter, shape)
        ranked = sorted(first_shapes.items(), key=lambda item: item[0][0])  # stable
        if len(ranked) > MOST_NUMBERS:
            raise SceneError(
                f"bodies of {len(ranked)} kinds of matter; with priorities there may be "
                f"{MOST_NUMBERS}"
            )
        self._numbers = {matter: 1 + i for i, (matter, _) in enumerate(ranked)}
        self._media: list[int] = []
        self._shapes = [shape for _, shape in ranked]

    def number(self, shape: Shape) -> int:
        """Return the number of a shape's body, 0 if the shape is no body."""
        matter = matter_of(shape)
        return 0 if matter is None else self._numbers[matter]

    def rows(
        self,
        placed: Iterable[Shape],
        encoder: Encoder,
        materials: MaterialWords,
        media: MediumWords,
    ) -> NDArray[np.uint32]:
        """Return the table `media`: two words for each shape, then two for each number."""
        words = [(self.number(shape), 0) for shape in placed]
        words.append((materials.null(), 0))
        for shape in self._shapes:
            index = 0
            if shape.material.bounds_body:
                inside = shape.material.inside_index
                index_words = encoder.named_words("body", "index", inside, roles.INDEX)[0]
                index = encoder.store.append("materials", index_words)
            self._media.append(_interior_word(shape, media))
            words.append((self._media[-1], index))
        return np.array(words, np.uint32).ravel()

    def around(self, surrounding: Iterable[Matter], media: MediumWords) -> tuple[int, int]:
        """Return the word of the bodies at the camera or a light, and their medium's word.

        surrounding: the matter of these bodies. Raises SceneError for more than DEPTH bodies.
        """
        numbers = sorted((self._numbers[matter] for matter in surrounding), reverse=True)
        if len(numbers) > DEPTH:
            raise SceneError(
                f"it is in {len(numbers)} bodies; there may be {DEPTH}", where="camera"
            )
        word = sum(number << 8 * i for i, number in enumerate(numbers))
        return word, self._media[numbers[0] - 1] if numbers else 0


def _interior_word(shape: Shape, media: MediumWords) -> int:
    """Return the word of a body's interior medium, else of its material's absorption."""
    if shape.interior is not None:
        return media.word(shape.interior)
    absorption = cast(Spectrum, shape.material.absorption)
    return 0 if absorption == CLEAR else media.absorber(absorption)


MOST_COMPARED = 64  # lamps: beyond this number no boxes are compared
MOST_AIMS = 16  # the largest lamps; others are met by chance

Box = tuple[NDArray[Any], NDArray[Any]]


def sealed_media(index: SceneIndex, cache: LoweringCache | None = None) -> frozenset[Medium]:
    """Return the media inside of boundaries that stop shadow rays, away from all lamps.

    Where a ray cannot meet every light, no medium is sealed. cache: it keeps the triangles of
    boundaries.
    """
    if index.nested or any(light.reach != "infinite" for light in index.lights):
        return frozenset()
    bodies: dict[Medium, list[Shape]] = {}
    for shape in every(index.listed):
        if shape.interior is not None:
            bodies.setdefault(shape.interior, []).append(shape)
    exteriors = {shape.exterior for shape in index.shapes} | {index.camera.medium}
    shapes = every(index.listed, lambda shape: shape.emission is not None)
    lamps = [box(shape, cache) for shape in shapes if shape.emission is not None]
    if len(lamps) > MOST_COMPARED:
        return frozenset()
    return frozenset(
        medium
        for medium, boundaries in bodies.items()
        if all(_stops_shadow_rays(shape, index) for shape in boundaries)
        and medium.scatters
        and medium not in exteriors
        and medium not in index.emitting
        and not any(_overlaps(boundaries, lamp, cache) for lamp in lamps)
    )


def _stops_shadow_rays(shape: Shape, index: SceneIndex) -> bool:
    return not any(map(index.passes_shadow_rays, leaves_of(shape.material)))


def _overlaps(bodies: list[Shape], lamp: Box, cache: LoweringCache | None) -> bool:
    boxes = (box(shape, cache) for shape in bodies)
    return any(
        bool((np.minimum(high, lamp[1]) - np.maximum(low, lamp[0]) >= 0.0).all())
        for low, high in boxes
    )


def escape_lamps(
    index: SceneIndex, sealed: frozenset[Medium], cache: LoweringCache | None = None
) -> NDArray[np.float32]:
    """Return the targets of escape rays (k, 5): balls around lamps, each centre, radius [m] and 0.

    k is 0 to MOST_AIMS, and 0 where no escape ray is sent. cache: it keeps the triangles of lamps.
    """
    shapes = list(
        every(index.listed, lambda shape: shape.emission is not None or bounds_media(shape))
    )
    lamps = [shape for shape in shapes if shape.emission is not None]
    if not lamps or not _can_escape(index, sealed) or not _refract_alike(shapes, sealed):
        return np.zeros((0, 5), np.float32)
    boxes = [box(shape, cache) for shape in lamps]
    low, high = (np.array(ends) for ends in zip(*boxes, strict=True))
    radius = np.linalg.norm(high - low, axis=1) / 2.0
    rows = np.column_stack([(low + high) / 2.0, radius, np.zeros(len(radius))])
    return rows[np.argsort(-radius, kind="stable")[:MOST_AIMS]].astype(np.float32)


def _can_escape(index: SceneIndex, sealed: frozenset[Medium]) -> bool:
    """Return whether the integrator and the media of a scene allow escape rays."""
    plain = index.integrator.has_escape_rays and not index.weighed and not index.guided
    all_sealed = bool(sealed) and all(medium in sealed for medium in index.media)
    homogeneous = all(medium.lattice is None for medium in index.media)
    simple = not index.motions and not index.dyed and not index.shifts
    return plain and all_sealed and homogeneous and simple and not index.light_layers


def _refract_alike(shapes: list[Shape], sealed: frozenset[Medium]) -> bool:
    """Return whether smooth boundaries are unmixed, with the same index at all wavelengths.

    Some such boundary must surround a sealed medium.
    """
    surrounds = False
    for shape in shapes:
        material = shape.material
        if any(part.perturbs_normals for part in mt.parts(material)):
            return False
        if not any_of(material, mt.Dielectric):
            continue
        if not isinstance(material, mt.Dielectric):
            return False
        indices = material.int_ior, material.ext_ior
        if not all(isinstance(value, int | float | Constant) for value in indices):
            return False
        surrounds = surrounds or shape.interior in sealed
    return surrounds
