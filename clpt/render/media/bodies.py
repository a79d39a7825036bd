"""Bodies that may overlap: rules, numbers and rows of `media`, see kernels/media/bodies.cl.

A body's matter is its priority, material and interior medium. Bodies of the same matter share a
number, and join where they overlap.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import is_whole
from clpt.errors import SceneError
from clpt.geometry import shapes
from clpt.render.materials.encode import MaterialWords
from clpt.render.materials.encoder import Encoder
from clpt.render.media.encode import MediumWords
from clpt.scene import roles
from clpt.scene.materials import CLEAR, Material
from clpt.scene.media import Medium
from clpt.scene.shapes import Shape

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
    for shape in listed:
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
            self._media.append(_interior_word(shape, encoder, media))
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


def _interior_word(shape: Shape, encoder: Encoder, media: MediumWords) -> int:
    """Return the word of a body's interior medium, else of its material's absorption."""
    if shape.interior is not None:
        return media.word(shape.interior)
    absorption = shape.material.absorption
    if absorption == CLEAR:
        return 0
    words = encoder.named_words("medium", "absorption", absorption, roles.COEFFICIENT)[0]
    return 1 + encoder.store.append("materials", words)
