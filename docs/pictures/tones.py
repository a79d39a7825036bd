"""Makes the picture of tone curves in docs/colour.md: `python -m docs.pictures.tones`.

One render of the prism; each tile is written with another curve. The last one needs clpt[colour].
"""

from __future__ import annotations

import dataclasses
from pathlib import Path
from tempfile import TemporaryDirectory

from PIL import Image

import clpt

FILE = Path(__file__).parent / "colour.jpg"
SIZE = (420, 315)  # of a tile [pixels]
CURVES = (
    *({"tone": tone} for tone in ("none", "reinhard", "aces", "agx", "neutral")),
    {"view": clpt.View("ACES 2.0 - SDR 100 nits (Rec.709)")},
)


def main() -> None:
    scene = clpt.load(Path(__file__).parents[2] / "scenes" / "prism")
    scene.film = dataclasses.replace(scene.film, width=SIZE[0], height=SIZE[1])
    with clpt.Renderer(scene, denoise="oidn") as renderer:
        renderer.run(256)
        image = renderer.denoised()
    sheet = Image.new("RGB", (3 * SIZE[0], 2 * SIZE[1]))
    with TemporaryDirectory() as folder:
        tile = Path(folder) / "tile.png"
        for i, curve in enumerate(CURVES):
            clpt.write_image(tile, image, exposure=1.0, **curve)
            sheet.paste(Image.open(tile), (i % 3 * SIZE[0], i // 3 * SIZE[1]))
    sheet.save(FILE, quality=90)


if __name__ == "__main__":
    main()
