"""Values of parameters as `repr` shows them: in a line, for people."""

from __future__ import annotations

from typing import Any

import numpy as np

from clpt.spectra import Constant, Spectrum

MATRIX = 16  # most numbers that an array shows; a larger array shows its shape
LONGEST = 60  # characters of a spectrum


def shown(value: Any) -> str:
    """Return a value in short: an even spectrum as its number, a large array as its shape."""
    if isinstance(value, np.ndarray):
        few = value.size <= MATRIX
        return str((value.round(5) + 0).tolist()) if few else f"<{value.dtype} {value.shape}>"
    if isinstance(value, Constant):
        return f"{value.value:g}"
    text = repr(value)
    if isinstance(value, Spectrum) and len(text) > LONGEST:
        return f"<{type(value).__name__}>"
    return text
