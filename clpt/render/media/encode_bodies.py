"""Bodies that overlap: their numbers and rows in `media`, see kernels/media/bodies.cl.

What counts of a body is its matter: material, medium inside and priority. Bodies of the same matter
have one number, and join where they overlap.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from clpt.errors import SceneError
from clpt.render.materials.encode import MaterialWords
from clpt.render.materials.encoder import Encoder
from clpt.render.media.bodies import BENDS, Matter, matter_of
from clpt.render.media.encode import MediumWords
from clpt.scene import roles
from clpt.scene.materials import CLEAR
from clpt.scene.shapes import Shape

MOST = 255  # numbers: a byte of a path's word
DEPTH = 4  # bodies at a point: bytes of that word


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
                own = encoder.named_words("body", "index", shape.material.int_ior, roles.INDEX)[0]
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
        absorbs = shape.material.absorption
        if absorbs == CLEAR:
            return 0
        words = encoder.named_words("medium", "absorption", absorbs, roles.COEFFICIENT)[0]
        return 1 + encoder.store.append("materials", words)
