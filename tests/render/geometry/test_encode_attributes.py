"""What meshes say per vertex and face: from arrays and files to the colours that are seen."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from clpt.errors import SceneError
from clpt.formats.meshes.mesh import read_mesh
from clpt.formats.native import load, save
from clpt.render.flow.scene_to_tables import lower
from clpt.scene import Scene, cameras, integrators, materials, shapes
from clpt.scene.textures import Bitmap, MeshAttribute, Mix, Product, textures_in
from clpt.spectra import luminance
from tests.pictures.support import layers_of

RNG = np.random.default_rng(7)
CORNERS = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0], [5, 5, 0]], np.float32)
FACES = np.array([[0, 1, 2], [0, 0, 1], [0, 2, 3]], np.uint32)  # the second has no area
COLOURS = RNG.random((5, 3)).astype(np.float32)
GREYS = RNG.random((3, 1)).astype(np.float32)


def _mesh(material, **more):
    given = {"vertex_color": COLOURS, "face_grey": GREYS, **more}
    return shapes.Mesh(vertices=CORNERS, faces=FACES, attributes=given, material=material)


def _scene(*found):
    to_world = np.diag([-1.0, 1.0, -1.0, 1.0])
    to_world[2, 3] = 5.0
    return Scene(
        camera=cameras.Orthographic(to_world=to_world),
        shapes=list(found),
        film=integrators.Film(width=16, height=16, mode="rgb", layers=("albedo", "position")),
        integrator=integrators.Path(max_depth=1, light_paths=0),
    )


def _expected(position):
    """Colour (n, 3) and grey (n,) at places of the square, in float64."""
    x, y = (position[..., :2].astype(np.float64).T + 1.0) / 2.0
    below = x >= y  # the first triangle
    first = np.stack([1 - x, x - y, y], -1) @ COLOURS[[0, 1, 2]]
    second = np.stack([1 - y, x, y - x], -1) @ COLOURS[[0, 2, 3]]
    return np.where(below[:, None], first, second), np.where(below, GREYS[0, 0], GREYS[2, 0])


def test_albedo_is_that_of_the_vertices_and_faces():
    """A triangle without area and a mesh before this one shift nothing."""
    colour = materials.Diffuse(reflectance=MeshAttribute(name="vertex_color"))
    mixed = Mix(
        first=(0.2, 0.4, 0.6), second=MeshAttribute(), amount=MeshAttribute(name="face_grey")
    )
    other = _mesh(materials.Diffuse(reflectance=0.5))
    behind = dataclasses.replace(other, to_world=np.diag([1.0, 1.0, 1.0, 1.0]) + _shift(-1.0))
    for material, of in (
        (colour, lambda c, g: c),
        (
            materials.Diffuse(reflectance=Product(first=mixed, second=0.5)),
            lambda c, g: 0.5 * ((1 - g) * np.array([[0.2, 0.4, 0.6]]).T + g * c.T).T,
        ),
    ):
        made = layers_of(_scene(behind, _mesh(material)), 1)
        colours, greys = _expected(made["position"].reshape(-1, 3))
        found = made["albedo"].reshape(-1, 3)
        np.testing.assert_allclose(found, of(colours, greys), atol=2e-5)


def test_a_second_set_of_uv_is_as_good_as_the_first():
    """The mapping uv1 finds on the attributes what uv finds on the same numbers as uvs."""
    uv = RNG.random((5, 2)).astype(np.float32)
    image = RNG.random((4, 4, 3)).astype(np.float32)
    second = {"vertex_u1": uv[:, :1], "vertex_v1": uv[:, 1:]}
    pictures = []
    for mapping, uvs in (("uv", uv), ("uv1", np.zeros_like(uv))):
        texture = Bitmap(image=image, mapping=mapping, raw=True)
        mesh = _mesh(materials.Diffuse(reflectance=texture), **second)
        pictures.append(layers_of(_scene(dataclasses.replace(mesh, uvs=uvs)), 1)["albedo"])
    np.testing.assert_allclose(pictures[1], pictures[0], atol=2e-5)
    assert pictures[0][..., :3].std() > 0.05


def _shift(z):
    moved = np.zeros((4, 4))
    moved[2, 3] = z
    return moved


def test_a_mesh_without_the_attribute_is_named():
    material = materials.Diffuse(reflectance=MeshAttribute(name="vertex_heat"))
    with pytest.raises(SceneError, match="'vertex_heat'; it has vertex_color, face_grey"):
        lower(_scene(_mesh(material)))
    with pytest.raises(SceneError, match="it has none"):
        lower(_scene(shapes.Sphere(material=material)))


@pytest.mark.parametrize("values", [np.zeros((4, 3)), np.zeros((5, 2)), np.full((5, 3), np.nan)])
def test_unusable_attributes(values):
    material = materials.Diffuse(reflectance=MeshAttribute(name="vertex_x"))
    with pytest.raises(SceneError, match="vertex_x"):
        lower(_scene(_mesh(material, vertex_x=values)))


def test_numbers_of_colours_and_tables_of_both_roles():
    """A name in two roles has two places; a number is the colour's luminance."""
    attribute = MeshAttribute(name="vertex_color")
    material = materials.Mask(material=materials.Diffuse(reflectance=attribute), opacity=attribute)
    tables = lower(_scene(_mesh(material))).tables["attributes"]
    values = tables[-4 * 5 - 5 - 4 :]
    found = values.view(np.float32)
    assert any(
        np.allclose(found[i : i + 5], luminance(COLOURS), atol=1e-6) for i in range(len(found) - 4)
    )


def test_files_keep_them(tmp_path):
    """Written beside a scene.json and read again; a PLY without a material shows its colours."""
    scene = _scene(_mesh(materials.Diffuse(reflectance=MeshAttribute())))
    save(scene, tmp_path / "scene.json")
    mesh = load(tmp_path / "scene.json").shapes[0]
    np.testing.assert_array_equal(
        mesh.attributes["vertex_color"], COLOURS[:4]
    )  # the fifth is unused
    np.testing.assert_array_equal(mesh.attributes["face_grey"], GREYS)
    file = next(tmp_path.glob("*.ply"))
    shown = read_mesh(file).meshes[0].material
    assert [t.name for t in textures_in(shown)] == ["vertex_color"]


def test_bytes_in_a_ply_are_srgb(tmp_path):
    head = "ply\nformat ascii 1.0\nelement vertex 3\n"
    head += "".join(f"property float {c}\n" for c in "xyz")
    head += "".join(f"property uchar {c}\n" for c in ("red", "green", "blue", "alpha"))
    head += "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    rows = "0 0 0 255 0 188 9\n1 0 0 255 0 188 9\n0 1 0 255 0 188 9\n3 0 1 2\n"
    (tmp_path / "a.ply").write_text(head + rows)
    mesh = read_mesh(tmp_path / "a.ply", materials=False).meshes[0]
    assert mesh.attributes["vertex_color"][1] == pytest.approx([1.0, 0.0, 0.5029], abs=1e-4)
