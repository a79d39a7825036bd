"""The media around lights as words of the table `media`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from clpt.render.media.encode import MediumWords
from clpt.render.media.encode_bodies import BodyWords
from clpt.render.media.light_media import LightMedia


def light_media_words(
    found: LightMedia, media: MediumWords, bodies: BodyWords | None
) -> NDArray[np.uint32]:
    """Return bodies and medium of each row of `lights`, (2 n,) uint32."""
    words: list[tuple[int, int]] = []
    for around, count in found.around:
        if bodies is None:
            own = 0, media.word(next(iter(around), None))
        else:
            own = bodies.around(around, media)
        words += [own] * count
    return np.array(words, np.uint32).ravel()
