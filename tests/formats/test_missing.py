"""Images that are not there: an error, or grey for who wants to go on, in every format."""

from __future__ import annotations

import json

import numpy as np
import pytest

from clpt.errors import SceneError
from clpt.formats import load
from clpt.formats.reading import EVEN, GREY
from clpt.scene.textures import Bitmap, textures_in

BITMAP = '<texture type="bitmap" name="{}"><string name="filename" value="no.png"/></texture>'
MITSUBA = f"""<scene version="3.0.0"><sensor type="perspective"/>
<shape type="sphere"><bsdf type="normalmap">{BITMAP.format("normalmap")}
<bsdf type="diffuse">{BITMAP.format("reflectance")}</bsdf></bsdf></shape>
<emitter type="envmap"><string name="filename" value="no.exr"/></emitter></scene>"""
PBRT = """Camera "perspective"
WorldBegin
LightSource "infinite" "string filename" "no.exr"
Texture "t" "spectrum" "imagemap" "string filename" "no.png" "bool invert" true
Material "diffuse" "texture reflectance" "t" "string normalmap" "no.png"
Shape "sphere"
"""
NATIVE = {
    "camera": {"type": "perspective"},
    "shapes": [
        {
            "type": "sphere",
            "material": {
                "type": "normal_map",
                "map": {"type": "bitmap", "image": "no.png", "raw": True},
                "material": {
                    "type": "diffuse",
                    "reflectance": {"type": "bitmap", "image": "no.png"},
                },
            },
        }
    ],
    "lights": [{"type": "envmap", "image": "no.exr"}],
}
TRIANGLE = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"
GLTF = {
    "asset": {"version": "2.0"},
    "scene": 0,
    "scenes": [{"nodes": [0]}],
    "nodes": [{"mesh": 0}],
    "meshes": [
        {"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "material": 0}]}
    ],
    "materials": [
        {
            "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}},
            "normalTexture": {"index": 0},
        }
    ],
    "textures": [{"source": 0}],
    "images": [{"uri": "no.png"}],
    "buffers": [
        {"byteLength": 36, "uri": f"data:application/octet-stream;base64,{TRIANGLE}"}
    ],
    "bufferViews": [{"buffer": 0, "byteLength": 36}],
    "accessors": [
        {
            "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
            "min": [0, 0, 0], "max": [1, 1, 0],
        },
        {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC2"},
    ],
}  # fmt: skip
FILES = {
    "a.xml": MITSUBA, "a.pbrt": PBRT, "a.json": json.dumps(NATIVE), "a.gltf": json.dumps(GLTF),
}  # fmt: skip


@pytest.mark.parametrize("name", FILES)
def test_images_that_are_not_there(tmp_path, name):
    path = tmp_path / name
    path.write_text(FILES[name], "utf-8")
    with pytest.raises(SceneError, match=r"no\.(png|exr)"):
        load(path)
    made = load(path, missing_textures="grey")
    told = [warning for warning in made.warnings if "grey stands for it" in warning]
    assert told and len(told) == len(set(told))
    found = {id(one): one for shape in made.shapes for one in textures_in(shape.material)}
    images = [one.image for one in found.values() if isinstance(one, Bitmap)]
    assert {image.tobytes() for image in images} == {GREY.tobytes(), EVEN.tobytes()}
    if made.lights and name != "a.gltf":
        np.testing.assert_allclose(np.unique(made.lights[0].image), 0.5)


def test_strict_stops_at_a_warning(tmp_path):
    path = tmp_path / "a.xml"
    path.write_text(MITSUBA, "utf-8")
    warnings = load(path, missing_textures="grey").warnings
    with pytest.raises(SceneError, match="strict: ") as stopped:
        load(path, missing_textures="grey", strict=True)
    assert warnings[0] in str(stopped.value) and str(len(warnings) - 1) in str(stopped.value)
    whole = tmp_path / "whole.json"
    whole.write_text('{"camera": {"type": "perspective"}, "shapes": [{"type": "sphere"}]}', "utf-8")
    assert load(whole, strict=True).shapes


def test_there_is_no_third_way(tmp_path):
    path = tmp_path / "a.xml"
    path.write_text(MITSUBA, "utf-8")
    with pytest.raises(SceneError, match="'error' or 'grey'"):
        load(path, missing_textures="gray")
