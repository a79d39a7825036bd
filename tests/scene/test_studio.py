"""The studio in memory: meshes of clpt and of trimesh, and scenes of trimesh with their images."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

import clpt
from clpt.errors import SceneError
from clpt.scene import Scene, cameras, lights, materials, shapes, textures

RED = Image.fromarray(np.full((2, 2, 3), (255, 0, 0), np.uint8))


def textured_box() -> trimesh.Trimesh:
    box = trimesh.creation.box()
    box.visual = trimesh.visual.TextureVisuals(uv=np.zeros((8, 2)), image=RED)
    return box


def test_a_mesh_in_memory_is_shown_as_its_file(tmp_path: Path) -> None:
    box = trimesh.creation.box()
    box.export(tmp_path / "box.ply")
    file, memory = clpt.load(tmp_path / "box.ply"), Scene.studio(box, name="box")
    assert [type(one) for one in memory.shapes] == [type(one) for one in file.shapes]
    np.testing.assert_allclose(memory.camera.to_world, file.camera.to_world)
    assert memory.extra["studio"] == file.extra["studio"]
    assert memory.name == file.name and memory.film.filter.kind == "gaussian"


def test_the_studio_adds_what_is_missing() -> None:
    ball = shapes.Sphere()
    several = Scene.studio([ball, trimesh.creation.box()], up="z")
    assert several.shapes[0] is ball and several.shapes[1].kind == "mesh"
    assert several.extra["studio"]["up"] == "z" and several.camera.to_world[2, 3] > 0.0  # type: ignore[call-overload, index]
    lamp, camera = lights.Point(), cameras.Perspective()
    own = Scene.studio(ball, camera=camera, lights=[lamp])
    assert (own.camera, own.shapes, own.lights) == (camera, [ball], [lamp])
    with pytest.raises(SceneError, match=r"^up: 'x' is none of y, z$"):
        Scene.studio(ball, up="x")  # type: ignore[arg-type]
    with pytest.raises(SceneError, match=r"^shapes: must be a list of shapes, not 3$"):
        Scene.studio(3)
    with pytest.raises(SceneError, match=r"^shapes\[1\]: must be of a kind of shape, not 3$"):
        Scene.studio([ball, 3])


def test_the_mesh_is_brighter_than_the_backdrop_and_nothing_is_clipped(one_context: None) -> None:
    """A bound on the tones of the first picture of a newcomer, at 16 samples of 24x24 pixels."""
    scene = Scene.studio(shapes.Sphere())
    picture = clpt.render(scene, 16, size=(24, 24), mode="rgb")
    luminance = picture @ np.float32([0.2126, 0.7152, 0.0722])
    ball, corner = luminance[8:12, 6:12].mean(), luminance[:2, :2].mean()
    assert 0.25 < ball < 0.95 and corner < 0.5 * ball
    assert (picture.max(axis=2) > 1.0).mean() < 0.02
    warm, cool = picture[8:12, 6:12].mean((0, 1)), picture[:2, :2].mean((0, 1))
    assert warm[0] > warm[2] and cool[2] > cool[0]


def test_the_material_of_a_mesh_of_trimesh() -> None:
    made = shapes.Mesh.from_trimesh(textured_box()).material
    assert isinstance(made, materials.TwoSided) and isinstance(made.front, materials.Diffuse)
    assert isinstance(made.front.reflectance, textures.Bitmap)
    image = made.front.reflectance.image
    assert isinstance(image, np.ndarray) and image[0, 0].tolist() == [255, 0, 0]


def test_a_physical_material_of_trimesh() -> None:
    box = textured_box()
    box.visual.material = trimesh.visual.material.PBRMaterial(
        name="tin",
        baseColorFactor=[255, 51, 51, 255],
        baseColorTexture=RED.convert("RGBA"),
        metallicFactor=0.5,
        roughnessFactor=0.25,
        metallicRoughnessTexture=RED,
        normalTexture=RED,
        emissiveFactor=[0.5, 0.5, 0.5],
        alphaMode="MASK",
    )
    made = shapes.Mesh.from_trimesh(box)
    sides = made.material
    assert isinstance(sides, materials.TwoSided) and isinstance(sides.back, materials.Null)
    mask = sides.front
    assert isinstance(mask, materials.Mask) and isinstance(mask.opacity, textures.Bitmap)
    bent = mask.material
    assert isinstance(bent, materials.NormalMap) and bent.map is not None and bent.map.raw
    assert bent.along_v
    tin = bent.material
    assert isinstance(tin, materials.GltfSurface) and tin.name == "tin"
    assert isinstance(tin.base_color, textures.Product) and tin.base_color.rgb
    assert isinstance(tin.metallic, textures.Product)
    assert isinstance(tin.metallic.first, textures.Bitmap) and tin.metallic.first.channel == "b"
    assert isinstance(made.emission, lights.Area)
    own = shapes.Mesh.from_trimesh(box, material=materials.Diffuse())
    assert own.material.kind == "diffuse" and own.emission is None


def test_a_scene_of_trimesh(one_context: None) -> None:
    there = trimesh.transformations.translation_matrix([3.0, 0.0, 0.0])
    scene = trimesh.Scene()
    scene.add_geometry(textured_box(), geom_name="box", node_name="first")
    scene.graph.update("second", matrix=there, geometry="box")
    scene.add_geometry(trimesh.load_path(np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])))
    made = Scene.from_trimesh(scene, name="boxes")
    first, second = made.shapes[:2]
    assert isinstance(first, shapes.Mesh) and isinstance(second, shapes.Mesh)
    assert (first.name, second.name) == ("first", "second")
    assert first.vertices is second.vertices and first.material is second.material
    np.testing.assert_array_equal(second.to_world, there)
    assert len(made.warnings) == 1 and "is no mesh, left out" in made.warnings[0]
    picture = clpt.render(made, 4, size=(16, 16), mode="rgb")
    assert np.max(picture[..., 0] - picture[..., 2]) > 0.2  # it is red
    with pytest.raises(SceneError, match=r"must be a trimesh\.Scene, not Trimesh; Scene\.studio"):
        Scene.from_trimesh(textured_box())


def test_a_scene_of_trimesh_with_its_camera() -> None:
    scene = trimesh.Scene(trimesh.creation.box())
    to_world = trimesh.transformations.translation_matrix([0.0, 0.0, 5.0])
    scene.camera = trimesh.scene.Camera(resolution=(64, 48), fov=(40.0, 30.0))
    scene.camera_transform = to_world
    made = Scene.from_trimesh(scene).camera
    assert isinstance(made, cameras.Perspective) and made.fov == 40.0
    matrix = np.asarray(made.to_world)
    np.testing.assert_allclose(matrix[:3, 3], [0.0, 0.0, 5.0])
    np.testing.assert_allclose(matrix[:3, 2], [0.0, 0.0, -1.0])
