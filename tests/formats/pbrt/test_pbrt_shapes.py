"""Shapes of PBRT files: where they are, which side is their front, their uv and their limits."""

from __future__ import annotations

import numpy as np
import pytest

from clpt import transforms
from clpt.errors import SceneError
from clpt.formats import load
from clpt.geometry import triangles
from clpt.scene import shapes, subdivision
from clpt.scene.materials import Mask, Null, TwoSided
from clpt.scene.textures import Product

QUAD = '"point3 P" [0 0 0 2 0 0 2 1 0 0 1 0] "integer indices" [0 1 2 0 2 3]'
TEXTURED = 'Texture "t" "spectrum" "checkerboard"\nMaterial "diffuse" "texture reflectance" "t"\n'


@pytest.fixture
def scene(tmp_path):
    def of(text):
        path = tmp_path / "a.pbrt"
        path.write_text("WorldBegin\n" + text)
        return load(path)

    return of


@pytest.fixture
def one(scene):
    def of(text):
        (made,) = scene(text).shapes
        return made

    return of


def fronts(shape):
    """Middles and unit normals of a mesh's triangles in the world, as the device gets them."""
    vertices, faces, _, _ = triangles.triangulate(shape)
    a, b, c = (vertices[faces[:, i]].astype(np.float64) for i in range(3))
    normals = np.cross(b - a, c - a)
    return (a + b + c) / 3, normals / np.linalg.norm(normals, axis=1, keepdims=True)


def area(shape):
    vertices, faces, _, _ = triangles.triangulate(shape)
    return triangles.triangle_areas(vertices, faces).sum()


@pytest.mark.parametrize(
    ("text", "toward"),
    [
        ("", 1),
        ("ReverseOrientation\n", -1),
        ("Scale -1 1 1\n", 1),  # a mirror does not turn a mesh inside out
        ("Scale -1 1 1\nReverseOrientation\n", -1),
    ],
)
def test_a_mesh_faces_where_it_runs_counter_clockwise(one, text, toward):
    _, normals = fronts(one(f'{text}Shape "trianglemesh" {QUAD}'))
    assert normals == pytest.approx(np.array([[0, 0, toward]] * 2))


@pytest.mark.parametrize(("text", "toward"), [("", -1), ("ReverseOrientation\n", 1)])
def test_a_mesh_faces_where_its_normals_point(one, text, toward):
    made = one(f'{text}Shape "trianglemesh" {QUAD} "normal N" [0 0 -1 0 0 -1 0 0 -1 0 0 -1]')
    _, normals = fronts(made)
    assert normals[:, 2] == pytest.approx([toward, toward])
    _, _, shading, _ = triangles.triangulate(made)
    assert shading[:, 2] == pytest.approx([toward] * 4)


def test_triangles_without_uv_have_those_of_pbrt(one):
    assert one(f'Shape "trianglemesh" {QUAD}').uvs is None
    made = one(f'{TEXTURED}Shape "trianglemesh" {QUAD}')
    assert made.uvs[made.faces[1]].tolist() == [[0, 0], [1, 0], [1, 1]]
    assert made.vertices[made.faces[1]].tolist() == [[0, 0, 0], [2, 1, 0], [0, 1, 0]]


@pytest.mark.parametrize(
    ("text", "kind", "flipped"),
    [
        ('Shape "sphere" "float radius" 2', shapes.Sphere, False),
        ('Scale -1 1 1 Shape "sphere"', shapes.Sphere, True),  # a mirror turns quadrics inside out
        ('ReverseOrientation Scale -1 1 1 Shape "sphere"', shapes.Sphere, False),
        ('Shape "disk" "float height" 1', shapes.Disk, False),
        ('Shape "cylinder" "float zmax" 3', shapes.Cylinder, False),
        ('Scale 1 2 1 Shape "sphere"', shapes.Mesh, False),
        ('Scale 1 1 2 Shape "cylinder"', shapes.Cylinder, False),
        ('Shape "sphere" "float zmax" 0', shapes.Mesh, False),
    ],
)
def test_quadrics(one, text, kind, flipped):
    made = one(text)
    assert type(made) is kind and made.flip_normals is flipped


@pytest.mark.parametrize(
    ("text", "size"),
    [
        ('"sphere" "float radius" 2', 16 * np.pi),
        ('"sphere" "float radius" 2 "float zmin" -1 "float zmax" 1.5', 2 * np.pi * 2 * 2.5),
        ('"sphere" "float phimax" 90', np.pi),
        ('"disk" "float radius" 2 "float innerradius" 1', 3 * np.pi),
        ('"disk" "float phimax" 90', np.pi / 4),
        ('"cylinder" "float radius" 2 "float zmin" 0 "float zmax" 3', 12 * np.pi),
    ],
)
def test_quadrics_as_meshes(one, text, size):
    """Area, front and uv of pbrt's parametrisation, also of those that have a kind of their own."""
    made = one(f"{TEXTURED}Scale 1 1.00001 1\nShape {text}")
    if isinstance(made, shapes.Sphere):
        pytest.skip("rays meet it as it is")
    assert area(made) == pytest.approx(size, rel=1e-3)
    middles, normals = fronts(made)
    outward = middles * ([0, 0, 1] if "disk" in text else [1, 1, "sphere" in text])
    if "disk" in text:
        outward = np.array([[0, 0, 1]])
    assert ((outward * normals).sum(axis=1) > 0).all()
    u, v = made.uvs.T
    phi = np.arctan2(made.vertices[:, 1], made.vertices[:, 0])
    turn = np.radians(90 if "phimax" in text else 360)
    r = np.hypot(made.vertices[:, 0], made.vertices[:, 1])
    assert np.cos(u * turn - phi)[r > 1e-6] == pytest.approx(1.0, abs=1e-5)
    if "cylinder" in text:
        assert v == pytest.approx(made.vertices[:, 2] / 3, abs=1e-6)
    if "innerradius" in text:
        assert v == pytest.approx(2.0 - r, abs=1e-6)
    if "zmax" in text and "sphere" in text:
        low, high = np.arccos(-0.5), np.arccos(0.75)
        theta = low + (high - low) * v
        assert made.vertices[:, 2] == pytest.approx(2 * np.cos(theta), abs=1e-5)


def test_a_sphere_counts_v_from_below(one):
    """Our sphere's v is 0 at its pole, pbrt's at zmin: the pole is turned down."""
    made = one('Rotate 30 1 0 0 Shape "sphere"')
    pole = made.to_world[:3, 2]
    assert pole == pytest.approx(-transforms.rotate([1, 0, 0], 30)[:3, 2])
    assert made.to_world[:3, 0] == pytest.approx([1, 0, 0])


def test_patches(one):
    flat = one('Shape "bilinearmesh" "point3 P" [0 0 0 2 0 0 0 1 0 2 1 0]')
    assert len(flat.faces) == 2 and area(flat) == pytest.approx(2.0)
    assert fronts(flat)[1][:, 2] == pytest.approx([1, 1])
    bent = one('Shape "bilinearmesh" "point3 P" [0 0 0 1 0 0 0 1 0 1 1 1]')
    u, v = bent.uvs.T
    assert bent.vertices == pytest.approx(np.stack([u, v, u * v], axis=1), abs=1e-6)
    wanted = np.stack([-v, -u, np.ones_like(u)], axis=1)
    wanted /= np.linalg.norm(wanted, axis=1, keepdims=True)
    assert bent.normals == pytest.approx(wanted, abs=1e-5)


OCTAHEDRON = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]])
EIGHT = np.array(
    [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]]
)


@pytest.mark.parametrize("border", [False, True])
def test_the_limit_is_that_of_more_levels(border):
    """Vertices of a level lie in the limit where more levels bring them, borders too."""
    points = OCTAHEDRON + 0.1 * np.random.default_rng(1).random((6, 3))
    faces = EIGHT[:5] if border else EIGHT
    coarse, _, normals = subdivision.loop(points, faces, 1)
    fine, finer, exact = subdivision.loop(points, faces, 6)
    assert fine[: len(coarse)] == pytest.approx(coarse, abs=1e-12)
    assert exact[: len(coarse)] == pytest.approx(normals, abs=1e-9)
    a, b, c = (fine[finer[:, i]] for i in range(3))
    flat = np.cross(b - a, c - a)
    flat /= np.linalg.norm(flat, axis=1, keepdims=True)
    seen = np.einsum("ij,ij->i", flat, exact[finer[:, 0]])
    assert np.sort(seen)[len(seen) // 100] > 0.998


def test_regular_limit():
    """Around a vertex of six neighbours the limit is v / 2 + sum / 12 (box splines)."""
    angles = np.radians(60 * np.arange(6))
    ring = np.stack([np.cos(angles), np.sin(angles), np.arange(6) ** 2 / 10], axis=1)
    points = np.concatenate([[[0, 0, 1]], ring])
    faces = np.array([[0, 1 + i, 1 + (i + 1) % 6] for i in range(6)])
    limit, _, _ = subdivision.loop(points, faces, 2)
    assert limit[0] == pytest.approx(points[0] / 2 + ring.sum(axis=0) / 12)


def test_subdivided_shapes(one, scene):
    text = '"point3 P" [0 0 0 1 0 0 0 1 0] "integer indices" [0 1 2]'
    assert len(one(f'Shape "loopsubdiv" {text} "integer levels" 2').faces) == 16
    with pytest.raises(SceneError, match=r"loopsubdiv.*'levels' must be 0 to 10"):
        scene(f'Shape "loopsubdiv" {text} "integer levels" 11')


def test_a_lamp_does_not_shine_where_alpha_masks_it(scene):
    """But an alpha of 0 all over leaves it all its light, which no ray sees."""
    lamp = 'AreaLightSource "diffuse" "rgb L" [1 1 1] Shape "sphere" "{} alpha" {}'
    texture = 'Texture "t" "float" "checkerboard" "float tex1" 0 "float tex2" 1 '
    for kind, value, masks in (
        ("float", "0.5", True),
        ("texture", '"t"', True),
        ("float", "0", False),
    ):
        made = scene(texture + lamp.format(kind, value))
        radiance = made.shapes[0].emission.radiance
        assert made.shapes[0].emission.visible == masks
        assert isinstance(radiance, Product) == masks
        shared = not masks or radiance.second is made.shapes[0].material.opacity
        assert shared or radiance.second.value == made.shapes[0].material.opacity
        assert not made.warnings


def test_alpha(one, scene):
    assert one('Shape "sphere" "float alpha" 0.25').material.opacity == 0.25
    assert isinstance(one('Attribute "shape" "float alpha" 0 Shape "sphere"').material, Mask)
    assert isinstance(one('Shape "sphere" "float alpha" 1').material, TwoSided)
    cut = one(
        'Texture "a" "float" "checkerboard"\n'
        f'Shape "trianglemesh" {QUAD} "texture alpha" "a"'
    )  # fmt: skip
    assert cut.uvs is not None
    assert isinstance(one('Material "interface" Shape "sphere"').material, Null)


def test_objects_are_instances(scene):
    found = scene(
        f'ObjectBegin "a"\nTranslate 1 0 0\nShape "trianglemesh" {QUAD}\nObjectEnd\n'
        'Translate 0 5 0\nObjectInstance "a"\nScale -1 1 1\nObjectInstance "a"\n'
        'ObjectBegin "unused"\nShape "plymesh" "string filename" "none"\nObjectEnd\n'
    )
    first, second = found.shapes
    assert first.group is second.group
    assert first.group.shapes[0].to_world == pytest.approx(transforms.translate([1, 0, 0]))
    mirrored = transforms.translate([0, 5, 0]) @ transforms.scale([-1, 1, 1])
    assert second.to_world == pytest.approx(mirrored)
    with pytest.raises(SceneError, match=r"3: ObjectInstance .b.: there is no object"):
        scene('ObjectBegin "a" Shape "sphere" ObjectEnd\nObjectInstance "b"')


def test_materials_may_be_named_before_they_are_made(scene):
    found = scene(
        'NamedMaterial "grey"\nShape "sphere"\nShape "disk"\n'
        'MakeNamedMaterial "grey" "string type" "diffuse"'
    )
    first, second = (shape.material for shape in found.shapes)
    assert first is second and first.name == "grey"
    with pytest.raises(SceneError, match="no material 'gray'; did you mean 'grey'"):
        scene('MakeNamedMaterial "grey" "string type" "diffuse"\nNamedMaterial "gray" Shape "disk"')


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('Shape "spheer"', "unknown shape 'spheer'; did you mean 'sphere'"),
        ('Shape "cone"', "not supported; use a mesh"),
        ('Shape "trianglemesh"', "needs the parameter 'point3 P'"),
        (
            'Shape "trianglemesh" "point3 P" [0 0 0 1 0 0 0 1 0] "integer indices" [0 1 9]',
            "outside",
        ),
        ('Shape "trianglemesh" "point3 P" [0 0 0 1 0] "integer indices" [0 1 2]', "multiple of 3"),
        ('Shape "sphere" "float radius" -1', "must be positive"),
        ('Shape "sphere" "string radius" "1"', "of the type float, not string"),
        ('Shape "plymesh" "string filename" "none.ply"', "no file 'none.ply'"),
        ('Scale 0 1 1 Shape "sphere"', "flattens space"),
        ('Shape "bilinearmesh" "point3 P" [0 0 0 1 0 0 0 1 0]', "indices"),
    ],
)
def test_broken_shapes_say_where(scene, text, message):
    with pytest.raises(SceneError, match=message) as caught:
        scene(text)
    assert "a.pbrt:2: Shape" in str(caught.value)


def test_what_is_left_out_is_warned_of_once(scene):
    found = scene('Shape "sphere" "float raduis" 2\n' + 'Shape "sphere" "float zmin" 1\n' * 3)
    unknown = "'raduis': is not known here and is left out; did you mean 'radius'?"
    assert f'a.pbrt:2: Shape "sphere": {unknown}' in found.warnings
    assert scene('Shape "sphere" "float zmin" 1').shapes == []
    assert next(text for text in found.warnings if "no area" in text).endswith("(in 3 places)")
