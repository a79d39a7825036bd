"""Bodies that overlap: their numbers and rows in `media`, see kernels/media/bodies.cl.

What counts of a body is its matter: material, medium inside and priority. Bodies of the same matter
have one number, and join where they overlap.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from clpt.errors import SceneError
from clpt.render.lowering.encoder import Encoder
from clpt.render.lowering.geometry import shapes
from clpt.render.lowering.materials.material_words import CLEAR, MaterialWords
from clpt.render.lowering.media import MediumWords
from clpt.scene.materials import Dielectric, Material, Null, RoughDielectric
from clpt.scene.media import Medium
from clpt.scene.shapes import Curves, Cylinder, Disk, Instance, Rectangle, Shape

MOST = 255  # numbers: a byte of a path's word
DEPTH = 4  # bodies at a point: bytes of that word
OPEN = (Rectangle, Disk, Cylinder, Curves)
BENDS = (Dielectric, RoughDielectric)

Matter = tuple[int, Material, "Medium | None"]


def matter_of(shape: Shape) -> Matter | None:
    """Return the matter of a shape's body in a scene with priorities, None of what is no body."""
    if not isinstance(shape.material, BENDS) and shape.interior is None:
        return None
    return shape.priority, shape.material, shape.interior


def check_bodies(things: Iterable[Shape]) -> None:
    """Raise SceneError for priorities that make no sense; nothing in a scene without any."""
    found = list(things)
    for shape in found:
        where, given = shapes.where(shape), shape.priority
        if isinstance(given, bool) or not isinstance(given, int) or given < 0:
            raise SceneError(f"priority must be an integer from 0, not {given!r}", where=where)
        if given and isinstance(shape, Instance):
            raise SceneError("priority is for the shapes of its group", where=where)
        if given and not isinstance(shape.material, (*BENDS, Null)):
            raise SceneError(
                "priority is for bodies of dielectric, rough_dielectric or null, not of "
                f"{shape.material.kind}",
                where=where,
            )
    if not any(shape.priority for shape in found):
        return
    for shape in found:
        if isinstance(shape, OPEN) and matter_of(shape) is not None:
            raise SceneError(
                f"a {shape.kind} is not closed: where bodies have a priority, each is one closed "
                "shape, such as a mesh, a cube or a sphere",
                where=shapes.where(shape),
            )
    for shape in found:
        if shape.exterior is not None:
            raise SceneError(
                "leave exterior out where bodies have a priority: it tells what is outside",
                where=shapes.where(shape),
            )


class BodyWords:
    """Numbers the bodies of a scene. Raises SceneError where there are too many."""

    def __init__(self, things: Iterable[Shape]):
        kinds: dict[Matter, Shape] = {}
        for shape in things:
            matter = matter_of(shape)
            if matter is not None:
                kinds.setdefault(matter, shape)
        ranked = sorted(kinds.items(), key=lambda item: item[0][0])  # stable
        if len(ranked) > MOST:
            message = (
                f"bodies of {len(ranked)} kinds of matter; with priorities there may be {MOST}"
            )
            raise SceneError(message)
        self._numbers = {matter: 1 + i for i, (matter, _) in enumerate(ranked)}
        self._media: list[int] = []
        self._shapes = [shape for _, shape in ranked]

    def number(self, shape: Shape) -> int:
        """Return the number of a shape's body, 0 of none."""
        matter = matter_of(shape)
        return 0 if matter is None else self._numbers[matter]

    def rows(
        self,
        things: Iterable[Shape],
        encoder: Encoder,
        materials: MaterialWords,
        media: MediumWords,
    ) -> NDArray[np.uint32]:
        """Return the table `media`: two words for each shape, then two for each number."""
        words = [(self.number(shape), 0) for shape in things]
        words.append((materials.null(), 0))
        for shape in self._shapes:
            index = 0
            if isinstance(shape.material, BENDS):
                own = encoder.named_words("body", "index", shape.material.int_ior, "index")[0]
                index = encoder.store.append("materials", own)
            self._media.append(self._medium(shape, encoder, media))
            words.append((self._media[-1], index))
        return np.array(words, np.uint32).ravel()

    def around(self, inside: Iterable[Matter], media: MediumWords) -> tuple[int, int]:
        """Return the words of the bodies at the camera, and of their medium.

        inside: the matter of these bodies. Raises SceneError for too many.
        """
        numbers = sorted((self._numbers[matter] for matter in inside), reverse=True)
        if len(numbers) > DEPTH:
            raise SceneError(
                f"it is in {len(numbers)} bodies; there may be {DEPTH}", where="camera"
            )
        word = sum(number << 8 * i for i, number in enumerate(numbers))
        return word, self._media[numbers[0] - 1] if numbers else 0

    def _medium(self, shape: Shape, encoder: Encoder, media: MediumWords) -> int:
        """The word of the medium in a body, or of what its material absorbs."""
        if shape.interior is not None:
            return media.word(shape.interior)
        absorbs = getattr(shape.material, "absorption", CLEAR)
        if absorbs == CLEAR:
            return 0
        words = encoder.named_words("medium", "absorption", absorbs, "coefficient")[0]
        return 1 + encoder.store.append("materials", words)
