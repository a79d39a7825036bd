"""What an image's file says and is left out becomes a warning of the scene, once."""

from __future__ import annotations

import json

import numpy as np
import OpenEXR
from PIL import Image

import clpt
from clpt.formats.pbrt.textures import textured
from clpt.render.flow.scene_to_tables import lower
from clpt.scene.roles import REAL
from tests.formats.pbrt.directives import define, params, state


def test_textures_and_surroundings_tell_once(tmp_path):
    turned = Image.Exif()
    turned[0x0112] = 6
    Image.new("RGB", (4, 4), (9, 9, 9)).save(tmp_path / "turned.jpg", exif=turned)
    plane = np.ones((2, 4), np.float32)
    layers = {f"{layer}.{letter}": plane for layer in "ab" for letter in "RGB"}
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, layers).write(str(tmp_path / "sky.exr"))
    bitmap = {"type": "bitmap", "image": "turned.jpg"}
    material = {"type": "diffuse", "reflectance": bitmap}
    number = {"type": "rough_plastic", "alpha": {**bitmap, "raw": True}}
    scene = {
        "camera": {"type": "perspective"},
        "shapes": [
            {"type": "rectangle", "material": material},
            {"type": "rectangle", "material": number},
        ],
        "lights": [{"type": "envmap", "image": "sky.exr"}],
    }
    (tmp_path / "scene.json").write_text(json.dumps(scene))
    warnings = lower(clpt.load(tmp_path / "scene.json"), 1 << 20).warnings
    assert sum("turned.jpg: its Exif orientation 6 is left out" in one for one in warnings) == 1
    assert sum("sky.exr: its picture is taken from the layer 'a'" in one for one in warnings) == 1


def test_a_number_of_pbrt_tells(tmp_path):
    turned = Image.Exif()
    turned[0x0112] = 3
    Image.new("RGB", (4, 4), (9, 8, 7)).save(tmp_path / "turned.jpg", exif=turned)
    at = state(tmp_path)
    define(at, "float", "t", "imagemap", filename=("string", "turned.jpg"))
    textured(params(x=("texture", "t")), "x", REAL, at)
    [warning] = at.shared.warnings
    assert "its Exif orientation 3 is left out" in warning
