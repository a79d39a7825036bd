"""Files of 8-bit codes for screens: PNG, JPEG and WebP."""

from __future__ import annotations

from io import BytesIO

import numpy as np
from numpy.typing import NDArray

from clpt.images.png_files import Metadata, png

QUALITY = 95  # of JPEG and WebP, of 100
DESCRIPTION, SOFTWARE = 0x010E, 0x0131  # tags of Exif
FORMATS = {".png": "PNG", ".jpg": "JPEG", ".jpeg": "JPEG", ".webp": "WEBP"}


def encode(suffix: str, codes: NDArray[np.uint8], metadata: Metadata | None = None) -> bytes:
    """Return a file of codes (h, w, 1, 3 or 4), by its suffix.

    A JPEG has no alpha. metadata: texts of a .png; of the others the
    description in Exif. Raises what Pillow raises, such as for a side that the format cannot have.
    """
    if FORMATS[suffix] == "PNG":
        return png(codes, metadata)
    from PIL import Image

    image = Image.fromarray(codes[..., 0] if codes.shape[2] == 1 else codes)
    exif = Image.Exif()
    if metadata:
        exif[DESCRIPTION] = "\n".join(f"{name}: {value}" for name, value in metadata.items())
        exif[SOFTWARE] = str(metadata.get("software", ""))
    file = BytesIO()
    subsampling = {"subsampling": 0} if FORMATS[suffix] == "JPEG" else {}
    image.save(file, FORMATS[suffix], quality=QUALITY, exif=exif.tobytes(), **subsampling)
    return file.getvalue()
