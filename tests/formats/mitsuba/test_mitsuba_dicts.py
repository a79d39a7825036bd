"""Mitsuba 3's dictionaries, as its tutorials write them."""

from __future__ import annotations

import numpy as np
import pytest

import clpt
from clpt.errors import SceneError
from clpt.formats.mitsuba import dicts
from clpt.scene import integrators, lights, materials, media, textures
from clpt.spectra import RGB, Tabulated

T = clpt.ScalarTransform4f
TUTORIAL = {
    "type": "scene",
    "integrator": {"type": "path", "max_depth": 8},
    "sensor": {
        "type": "perspective", "fov": 39.3, "fov_axis": "smaller",
        "to_world": T().look_at(origin=[0, 0, 4], target=[0, 0, 0], up=[0, 1, 0]),
        "film": {
            "type": "hdrfilm", "width": 32, "height": 24, "rfilter": {"type": "gaussian"},
            "pixel_format": "rgb", "component_format": "float32",
        },
        "sampler": {"type": "independent", "sample_count": 16},
    },
    "white": {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.5, 0.6, 0.7]}},
    "light": {
        "type": "rectangle", "to_world": T().translate([0, 1, 0]).rotate([1, 0, 0], 90).scale(0.5),
        "emitter": {"type": "area", "radiance": {"type": "rgb", "value": 3.0}},
        "bsdf": {"type": "ref", "id": "white"},
    },
    "ball": {
        "type": "sphere", "center": [0.1, 0.2, 0.3], "radius": 0.5,
        "material": {
            "type": "roughconductor", "material": "Al", "distribution": "ggx", "alpha_u": 0.05,
            "alpha_v": 0.3,
        },
    },
    "other": {"type": "cube", "bsdf": {"type": "ref", "id": "white"}, "flip_normals": True},
}  # fmt: skip


def test_a_scene_of_a_tutorial():
    scene = clpt.load_dict(TUTORIAL)
    assert (scene.film.width, scene.film.height, scene.spp) == (32, 24, 16)
    assert isinstance(scene.integrator, integrators.Path) and scene.integrator.max_depth == 8
    light, ball, other = scene.shapes
    assert light.material is other.material and light.material.reflectance == RGB(0.5, 0.6, 0.7)
    assert light.emission.radiance.r == 3.0 and other.flip_normals
    assert ball.center == (0.1, 0.2, 0.3) and isinstance(ball.material, materials.RoughConductor)
    assert np.allclose(np.asarray(light.to_world)[:3, 3], [0, 1, 0])
    assert np.allclose(scene.camera.to_world[:3, 3], [0, 0, 4])


def test_arrays_are_images():
    image = np.random.default_rng(1).random((4, 8, 3), np.float32)
    texture = {"type": "bitmap", "data": image, "raw": True, "filter_type": "nearest"}
    scene = clpt.load_dict({
        "type": "scene",
        "env": {"type": "envmap", "bitmap": image, "scale": 2.0},
        "ball": {"type": "sphere", "bsdf": {"type": "diffuse", "reflectance": texture}},
    })  # fmt: skip
    made = scene.shapes[0].material.reflectance
    assert isinstance(made, textures.Bitmap) and made.raw and np.array_equal(made.image, image)
    assert isinstance(scene.lights[0], lights.Envmap)
    assert np.array_equal(scene.lights[0].image, image) and scene.lights[0].scale == 2.0


def test_arrays_are_volumes():
    """A tensor of Mitsuba is (z, y, x)."""
    grid = np.random.default_rng(1).random((2, 3, 4), np.float32)
    scene = clpt.load_dict({
        "type": "scene",
        "box": {
            "type": "cube", "bsdf": {"type": "null"},
            "interior": {
                "type": "heterogeneous", "albedo": 0.5, "scale": 2.0,
                "sigma_t": {"type": "gridvolume", "data": grid},
                "phase": {"type": "hg", "g": 0.3},
            },
        },
    })  # fmt: skip
    medium = scene.shapes[0].interior
    assert isinstance(medium, media.Grid) and medium.phase.g.value == 0.3
    assert np.array_equal(medium.density, grid.transpose(2, 1, 0))


def test_spectra_are_pairs():
    pairs = {"type": "spectrum", "value": [(400, 0.1), (500, 0.2)]}
    scene = {
        "type": "scene",
        "a": {"type": "sphere", "b": {"type": "diffuse", "reflectance": pairs}},
    }
    made = clpt.load_dict(scene).shapes[0].material.reflectance
    assert isinstance(made, Tabulated) and made.values == (0.1, 0.2)


def test_transforms_join_and_invert():
    both = T().translate([1, 2, 3]) @ T().scale([2, 2, 2])
    assert np.allclose(both.matrix, T.translate([1, 2, 3]).scale(2).matrix)
    assert np.allclose((both @ both.inverse()).matrix, np.eye(4))
    assert np.allclose(T(both.matrix).matrix, both.matrix)


def test_stokes_is_the_integrator_inside():
    inside = {"type": "volpath", "max_depth": 5}
    scene = clpt.load_dict({"type": "scene", "i": {"type": "stokes", "nested": inside}})
    assert scene.integrator.max_depth == 5 and any("polar" in text for text in scene.warnings)


def test_every_plugin_has_a_tag():
    assert set(dicts.TAGS.values()) >= {"bsdf", "shape", "emitter", "sensor", "film", "texture"}
    assert dicts.TAGS["diffuse"] == "bsdf" and dicts.TAGS["gaussian"] == "rfilter"


def test_errors_name_the_entry(tmp_path):
    nested: dict = {"type": "twosided"}
    for _ in range(200):
        nested = {"type": "twosided", "b": nested}
    for scene, message in (
        ({"type": "sphere"}, "must be 'scene'"),
        ({}, "needs a 'type'"),
        ({"type": "scene", "a": {"type": "spheer"}}, "unknown plugin 'spheer'.*sphere"),
        ({"type": "scene", "a": {"type": "sphere", "radius": "x"}}, "must be a <float>"),
        ({"type": "scene", "a": {"type": "sphere", "to_world": object()}}, "cannot be a object"),
        ({"type": "scene", "a": {"type": "sphere", "width": 3}}, "no parameter 'width'"),
        ({"type": "scene", "a": {"type": "rgb"}}, "needs a 'value'"),
        ({"type": "scene", "a": {"type": "ply", "filename": "none.ply"}}, "no file 'none.ply'"),
        ({"type": "scene", "a": {"type": "sphere", "b": nested}}, "nested deeper"),
    ):
        with pytest.raises(SceneError, match=message):
            clpt.load_dict(scene, folder=tmp_path)
