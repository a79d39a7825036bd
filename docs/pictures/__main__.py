"""Renders the pictures of kinds, and writes what goes with them: `python -m docs.pictures [names]`.

A name is of a kind (material/hair) or of a category (light); none: all. Captions, the contact sheet
in docs/gallery.md and docs/scene_format.md are always written.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path

from PIL import Image

import clpt
from clpt import images
from clpt.formats.native import reference

from . import sheet, table

DOCS = Path(__file__).parents[1]


def main(names: list[str]) -> None:
    pictures = table.pictures()
    for name, picture in pictures.items():
        if names and name not in names and name.split("/")[0] not in names:
            continue
        began = time.time()
        file = table.file(name)
        file.parent.mkdir(parents=True, exist_ok=True)
        render(picture).save(file, quality=90, method=6)
        size, took = file.stat().st_size / 1e3, time.time() - began
        print(f"{name}: {size:.0f} kB, {took:.0f} s", flush=True)
    captions = {name: picture.caption for name, picture in pictures.items()}
    table.CAPTIONS.write_text(json.dumps(captions, indent=1) + "\n", "utf-8")
    gallery = DOCS / "gallery.md"
    gallery.write_text(sheet.written(gallery.read_text("utf-8")), "utf-8")
    (DOCS / "scene_format.md").write_text(reference.text(), "utf-8")


def render(picture: table.Picture) -> Image.Image:
    with clpt.Renderer(picture.scene(), denoise=picture.denoise) as renderer:
        renderer.run(picture.spp)
        image = renderer.denoised() if picture.denoise else renderer.image()
    return Image.fromarray(images.to_srgb8(image).repeat(picture.zoom, 0).repeat(picture.zoom, 1))


if __name__ == "__main__":
    main(sys.argv[1:])
