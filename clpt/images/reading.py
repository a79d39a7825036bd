"""Files of pictures by their suffix: the one way in for whatever names an image."""

from __future__ import annotations

import logging
from collections.abc import Callable
from pathlib import Path

from clpt.arrays import Floats32
from clpt.errors import SceneError
from clpt.files import budget
from clpt.images import exr, hdr, npy, pfm, pillow
from clpt.images.failures import check_there, reading
from clpt.images.stored import Stored

log = logging.getLogger("clpt.images")


READERS: dict[str, Callable[[Path], Stored]] = {
    ".exr": exr.read,
    ".hdr": hdr.read,
    ".pic": hdr.read,
    ".pfm": pfm.read,
    ".npy": npy.read,
    **dict.fromkeys(pillow.SUFFIXES, pillow.read),
}


STRAIGHT = pillow.SUFFIXES  # of files whose colours are not multiplied by alpha


def read(path: str | Path, *, linear: bool = True) -> Floats32:
    """Return an image file as (h, w, c) float32, row 0 at the top; c is 1, 3 or 4.

    Other counts are possible for EXR files without colours, and .npy.

    path: of the file. linear: colours, as linear Rec. 709. False: data, such as roughness or
    normals: the numbers as they are stored, those of 8 and 16 bits in [0, 1]. Alpha is never
    decoded; colours of .exr are multiplied by it, those of other files are not, and they stay so.
    What the file says and is left out is a warning in the log. docs/images.md has the table.

    Raises SceneError if there is no such file, its suffix is unknown, it is not an image, or too
    large.
    """
    image = read_stored(path)
    log_notes(path, image, raw=not linear)
    return image.decoded(linear)


def log_notes(path: str | Path, image: Stored, *, raw: bool) -> None:
    """Warn in the log of what an image's file says that is left out."""
    for note in image.notes_of(raw):
        log.warning("%s: %s", path, note)


def read_stored(path: str | Path) -> Stored:
    """Return an image file as it is stored; whoever asks tells its notes. Raises as `read`."""
    path = check_input(path)
    with reading(path):
        image = READERS[path.suffix.lower()](path)
    if image.values.size == 0:
        raise SceneError("the image has no pixels", file=path)
    budget.take_image(image.values.nbytes, "its pixels", path)
    return image


def check_input(path: str | Path) -> Path:
    """Return the path, if `read` knows its suffix and there is such a file. Else SceneError."""
    path = Path(path)
    if path.suffix.lower() not in READERS:
        message = f"unknown image suffix {path.suffix!r}; known: {', '.join(READERS)}"
        raise SceneError(message, file=path)
    check_there(path)
    return path
