"""Kernels of glTF's material hold the lobes that a scene has."""

from __future__ import annotations

from clpt.render.flow.programs import sources
from clpt.render.flow.scene_to_tables import lower
from clpt.scene import Film, Scene
from clpt.scene.cameras import Perspective
from clpt.scene.materials import GltfSurface
from clpt.scene.shapes import Sphere


def _text(*materials):
    shapes = [Sphere(material=material) for material in materials]
    scene = Scene(camera=Perspective(), film=Film(width=8, height=8), shapes=shapes)
    made = sources(lower(scene).features, "wide8", 8, queued=True)
    return made["shade_gltf_surface"].text


def test_a_lobe_that_no_material_has_is_left_out():
    plain, coated = GltfSurface(), GltfSurface(clearcoat=0.5)
    alone, both = _text(plain), _text(plain, coated)
    assert "r.clearcoat = (real)(0.0f);" in alone and "r.clearcoat = (real)(0.0f);" not in both
    for text in (alone, both):
        assert "r.sheen_color = spectrum_of(0.0f);" in text
    assert "r.clearcoat = words" in both


def test_sides():
    assert not GltfSurface().transmits and not GltfSurface().uses_tangents
    assert GltfSurface(transmission=0.5).transmits and GltfSurface(anisotropy=0.1).uses_tangents
