"""Thin films in scene.json and in Mitsuba's XML: read, refused with a place, written."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest

from clpt import spectra
from clpt.errors import SceneError, UnusedParameterError
from clpt.formats import load, native
from clpt.scene import materials as m
from clpt.scene import textures

TARNISH = {"metal": "Ag", "thickness": 5}
SOAP = {"eta": "water", "thickness": 600, "profile": {"type": "checkerboard"}}


@pytest.fixture
def material(tmp_path):
    """The material of a scene.json with one sphere, or of a scene.xml with one bsdf."""

    def of(given):
        if isinstance(given, str):
            path = tmp_path / "scene.xml"
            sphere = f'<shape type="sphere">{given}</shape>'
            path.write_text(f'<scene version="3.0.0"><sensor type="perspective"/>{sphere}</scene>')
        else:
            path = tmp_path / "scene.json"
            sphere = {"type": "sphere", "material": given}
            path.write_text(json.dumps({"camera": {"type": "perspective"}, "shapes": [sphere]}))
        return load(path).shapes[0].material

    return of


def test_json(material):
    made = material({"type": "conductor", "layers": [SOAP, TARNISH]})
    outer, inner = made.layers
    assert (outer.eta, outer.thickness) == ("water", 600.0)
    assert outer.profile.kind == "checkerboard" and outer.k.value == 0.0
    assert inner.eta is spectra.metal("Ag")[0] and inner.k is spectra.metal("Ag")[1]
    assert inner.thickness == 5.0 and inner.profile == 1.0
    assert material({"type": "dielectric"}).layers == ()


@pytest.mark.parametrize(
    ("layers", "where"),
    [
        (SOAP, "shapes[0].material.layers"),
        ([{**SOAP, "thickness": -1}], "layers[0].thickness"),
        ([SOAP, {"eta": "bk8"}], "shapes[0].material.layers[1].eta"),
        ([{"eta": 1.3, "profile": 1.5}], "layers[0].profile"),
    ],
)
def test_json_errors(material, layers, where):
    with pytest.raises(SceneError) as caught:
        material({"type": "dielectric", "layers": layers})
    assert where in str(caught.value)


def test_unknown_keys_of_a_layer(material):
    with pytest.raises(UnusedParameterError, match="thickness"):
        material({"type": "rough_conductor", "layers": [{"thicknes": 3}]})


def test_only_layers_are_layers():
    for wrong in (m.Layer(), "soap", [m.Diffuse()], [1.5]):
        with pytest.raises(SceneError, match="layer"):
            m.Dielectric(layers=wrong)


def test_written_and_read(material, tmp_path):
    image = np.linspace(0.0, 1.0, 8, dtype=np.float32).reshape(2, 4)
    layers = (
        m.Layer(eta=1.7, k=0.25, thickness=120.0, profile=textures.Bitmap(image=image)),
        m.Layer(thickness=40.0),
    )
    material({"type": "rough_dielectric"})
    scene = load(tmp_path / "scene.json")
    ball = dataclasses.replace(scene.shapes[0], material=m.RoughDielectric(layers=layers))
    native.save(dataclasses.replace(scene, shapes=[ball]), tmp_path / "saved.json")
    outer, inner = load(tmp_path / "saved.json").shapes[0].material.layers
    assert (outer.eta.value, outer.k.value, outer.thickness) == (1.7, 0.25, 120.0)
    np.testing.assert_array_equal(np.load(outer.profile.image), image)
    assert (inner.eta, inner.thickness, inner.profile) == ("water", 40.0, 1.0)


XML_LAYERS = """
    <bsdf type="layer"><string name="eta" value="fused silica"/><float name="thickness" value="90"/>
        <texture name="profile" type="checkerboard"/></bsdf>
    <bsdf type="layer"><float name="eta" value="2.3"/><float name="k" value="0.1"/></bsdf>
    <bsdf type="layer"/>
"""


@pytest.mark.parametrize("kind", ["dielectric", "roughdielectric", "conductor", "roughconductor"])
def test_mitsuba(material, kind):
    layers = material(f'<bsdf type="{kind}">{XML_LAYERS}</bsdf>').layers
    assert [layer.thickness for layer in layers] == [90.0, 400.0, 400.0]
    assert (
        layers[0].eta is spectra.glass("fused silica") and layers[0].profile.kind == "checkerboard"
    )
    assert (layers[1].eta.value, layers[1].k.value) == (2.3, 0.1)
    assert layers[2].eta is spectra.glass("water") and layers[2].profile == 1.0


@pytest.mark.parametrize(
    ("xml", "message"),
    [
        ('<bsdf type="diffuse"><bsdf type="layer"/></bsdf>', "cannot stand"),
        ('<bsdf type="conductor"><bsdf type="diffuse"/></bsdf>', "'layer'"),
        (
            '<bsdf type="conductor"><bsdf type="layer"><float name="d" value="1"/></bsdf></bsdf>',
            "'d'",
        ),
        ('<bsdf type="layer"/>', "layer"),
    ],
)
def test_mitsuba_errors(material, xml, message):
    with pytest.raises(SceneError, match=message):
        material(xml)
