"""The pictures of docs/gallery.md: their sizes, and how noisy they are."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image, ImageFilter

PAGE = Path(__file__).parents[1] / "gallery.md"
PICTURE = re.compile(r"!\[[^\]]*\]\((\S+)\)\n.*?\n`[^`]*clpt render [^`]* (\S+)`\n", re.S)
SPARK = 50.0  # of 255


@dataclass(frozen=True)
class Measured:
    """A picture of the gallery; the noise is over the median of 3x3 pixels, in steps of 255.

    `grain` is the median of the distances from it, `mean` their mean, `sparks` the share of the
    pixels that are brighter by more than `SPARK`.
    """

    name: str
    size: tuple[int, int]
    grain: float
    mean: float
    sparks: float


def measured(file: Path, name: str) -> Measured:
    """Measure the luma of a picture; of one that moves, the first frame."""
    image = Image.open(file).convert("L")
    near = image.filter(ImageFilter.MedianFilter(3))
    above = np.asarray(image, float) - np.asarray(near, float)
    away = np.abs(above)
    sparks = float((above > SPARK).mean())
    return Measured(name, image.size, float(np.median(away)), float(away.mean()), sparks)


def pictures() -> list[Measured]:
    """Return the scenes' pictures in the order of the page, each by the name its command writes."""
    page = PAGE.read_text("utf-8").split("## Every kind")[0]
    return [measured(PAGE.parent / file, name) for file, name in PICTURE.findall(page)]
