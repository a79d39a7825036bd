"""Every channel of an .exr by name, for whoever looks at more than its picture."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.images import exr_files
from clpt.images.failures import check_there, reading


def read_layers(path: str | Path) -> dict[str, NDArray[np.float32]]:
    """Every channel of an EXR file by name, each (h, w) float32. Raises SceneError."""
    return {name: np.asarray(c, np.float32) for name, c in read_channels(path).items()}


def read_channels(path: str | Path) -> dict[str, NDArray[Any]]:
    """Every channel of an EXR file by name, (h, w) float16, float32 or uint32, as it is stored.

    Of its data window, and of its first part. Raises SceneError.
    """
    path = Path(path)
    check_there(path)
    with reading(path):
        return dict(exr_files.read_channels(path))
