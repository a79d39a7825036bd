"""Images that stand for missing image files, if the user allows it."""

from __future__ import annotations

import numpy as np

GREY = np.full((1, 1, 3), 0.5, np.float32)
EVEN = np.array([[[0.5, 0.5, 1.0]]], np.float32)  # a normal map that bends nothing
GREY.flags.writeable = EVEN.flags.writeable = False


def grey_for(name: object) -> str:
    """Return the warning of an image for which GREY or EVEN stands."""
    return f"there is no file {str(name)!r}; grey stands for it"
