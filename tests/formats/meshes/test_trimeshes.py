"""Materials of trimesh: as the same mesh written as a .glb is loaded."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image
from trimesh.visual.material import PBRMaterial, SimpleMaterial

import clpt
from clpt.scene import shapes
from clpt.scene.params import fields_of
from clpt.scene.textures import Bitmap

CORNERS = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]


def image(mode: str, *values) -> Image.Image:
    return Image.fromarray(np.full((2, 2, len(values)), values, np.uint8).squeeze(), mode)


CLEAR = image("RGBA", 200, 100, 50, 77)
BENT = image("RGB", 128, 160, 240)
KINDS = {
    "factors": {"baseColorFactor": [255, 128, 0, 128], "metallicFactor": 0.25},
    "blend of a factor": {"baseColorFactor": [255, 128, 0, 128], "alphaMode": "BLEND"},
    "blend of an image": {"baseColorTexture": CLEAR, "alphaMode": "BLEND"},
    "blend of both": {
        "baseColorTexture": CLEAR, "baseColorFactor": [255, 128, 0, 128], "alphaMode": "BLEND",
    },
    "mask of a factor": {"baseColorFactor": [9, 9, 9, 100], "alphaMode": "MASK"},
    "mask of an image": {"baseColorTexture": CLEAR, "alphaMode": "MASK", "alphaCutoff": 0.5},
    "mask that lets it be": {"baseColorTexture": CLEAR, "alphaMode": "MASK", "alphaCutoff": 0.25},
    "mask of both": {
        "baseColorTexture": CLEAR, "baseColorFactor": [255, 255, 255, 128], "alphaMode": "MASK",
        "alphaCutoff": 0.2,
    },
    "opaque": {"baseColorTexture": CLEAR, "alphaMode": "OPAQUE"},
    "no alpha": {"baseColorTexture": BENT, "alphaMode": "BLEND"},
    "both sides": {"doubleSided": True, "roughnessFactor": 0.5},
    "normals": {"normalTexture": BENT, "metallicRoughnessTexture": BENT, "roughnessFactor": 0.5},
}  # fmt: skip


def mesh(material) -> trimesh.Trimesh:
    uv = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], float)
    look = trimesh.visual.TextureVisuals(uv=uv, material=material)
    return trimesh.Trimesh(CORNERS, [(0, 1, 2), (0, 2, 3)], visual=look, process=False)


def told(thing):
    """What a material says, as plain values; images by their pixels, spectra by wavelengths."""
    if isinstance(thing, Bitmap):
        pixels = np.asarray(thing.image, float)
        pixels = pixels if pixels.ndim == 3 else pixels[..., None]
        return [thing.raw, thing.channel, thing.wrap, thing.wrap_v, pixels[..., :3].tolist()]
    if hasattr(thing, "sample"):
        return np.asarray(thing.sample(np.array([450.0, 550.0, 650.0]))).round(5).tolist()
    if dataclasses.is_dataclass(thing):
        values = {n: told(v) for n, v in fields_of(thing).items() if n != "name"}
        return [type(thing).__name__, values]
    return np.round(thing, 5).tolist() if isinstance(thing, (float, np.ndarray)) else thing


@pytest.mark.parametrize("kind", KINDS)
def test_a_material_is_what_load_makes_of_its_glb(tmp_path: Path, kind):
    made = mesh(PBRMaterial(**KINDS[kind]))
    made.export(tmp_path / "a.glb")
    loaded = clpt.load(tmp_path / "a.glb").shapes[0].material
    assert told(shapes.Mesh.from_trimesh(made).material) == told(loaded)


def test_what_is_not_there_does_not_shine():
    glowing = PBRMaterial(
        baseColorFactor=[0, 0, 0, 128], alphaMode="BLEND", emissiveFactor=[1.0, 0.5, 0.0],
        doubleSided=True,
    )  # fmt: skip
    light = shapes.Mesh.from_trimesh(mesh(glowing)).emission
    assert light is not None and light.two_sided
    assert np.allclose(told(light.radiance)[1]["second"], 128 / 255, atol=1e-4)


@pytest.mark.parametrize(
    ("diffuse", "expected"),
    [([128, 64, 255, 255], (128 / 255, 64 / 255, 1.0)), (None, (1.0, 1.0, 1.0))],
)
def test_an_image_times_the_colour_of_a_simple_material(diffuse, expected):
    white = image("RGB", 255, 255, 255)
    plain = shapes.Mesh.from_trimesh(mesh(SimpleMaterial(image=white, diffuse=diffuse)))
    shown = plain.material.front.reflectance
    if diffuse is None:
        assert isinstance(shown, Bitmap)
    else:
        assert np.allclose(shown.second.to_rgb("unbounded"), expected, atol=1e-3)
