"""Makes the picture of groups of lights in docs/layers.md: `python -m docs.pictures.light_groups`.

One render; each tile is another sum of its layers.
"""

from __future__ import annotations

import dataclasses
from pathlib import Path

from PIL import Image, ImageDraw, ImageFont

import clpt
from clpt import images
from clpt.scene import Scene, lights
from clpt.scene.materials import Conductor, RoughPlastic

from .studio import Array, knob, panel, studio

FILE = Path(__file__).parent / "light_groups.jpg"
SIZE, TITLE = (420, 240), 26  # of a tile, and of the line above it [pixels]
MIXES = {  # factors on the lamps and the sky
    "light_warm": (1.0, 0.0, 0.0),
    "light_cool": (0.0, 1.0, 0.0),
    "light_sky": (0.0, 0.0, 1.0),
    "the picture: 1, 1, 1": (1.0, 1.0, 1.0),
    "evening: 1.6, 0.2, 0.2": (1.6, 0.2, 0.2),
    "moonlight: 0.05, 0.8, 0.1": (0.05, 0.8, 0.1),
}


def main() -> None:
    with clpt.Renderer(scene()) as renderer:
        renderer.run(384)
        layers = renderer.layers()
    parts = [layers[f"light_{name}"] for name in ("warm", "cool", "sky")]
    width, height = SIZE[0], SIZE[1] + TITLE
    sheet = Image.new("RGB", (3 * width, 2 * height), "white")
    draw, font = ImageDraw.Draw(sheet), ImageFont.load_default(15)
    for i, (title, factors) in enumerate(MIXES.items()):
        mix: Array = sum(f * part for f, part in zip(factors, parts, strict=True))
        at = (i % 3 * width, i // 3 * height)
        draw.text((at[0] + 6, at[1] + 4), title, "black", font)
        sheet.paste(Image.fromarray(images.to_srgb8(mix)), (at[0], at[1] + TITLE))
    sheet.save(FILE, quality=90)


def scene() -> Scene:
    """Three things between a warm lamp at the left and a cool one at the right, under a sky."""
    things = [
        knob(RoughPlastic(diffuse_reflectance=(0.6, 0.1, 0.06), roughness=0.3), -1.42),
        knob(Conductor(metal="silver")),
        knob(RoughPlastic(diffuse_reflectance=(0.06, 0.18, 0.5), roughness=0.3), 1.42),
    ]
    left = panel(1.6, [-4.4, 2.8, 2.6], [0, 0.6, 0], (16.0, 9.0, 4.0))
    right = panel(1.6, [4.4, 2.8, 2.6], [0, 0.6, 0], (4.0, 8.0, 15.0))
    lamps = [
        dataclasses.replace(lamp, emission=dataclasses.replace(lamp.emission, group=group))
        for lamp, group in ((left, "warm"), (right, "cool"))
    ]
    made = studio(things, lamps=lamps, size=SIZE)
    made.lights = [lights.Constant(radiance=(0.35, 0.4, 0.5), group="sky")]
    made.film = dataclasses.replace(made.film, layers=("light_groups",), filtering="importance")
    return made


if __name__ == "__main__":
    main()
