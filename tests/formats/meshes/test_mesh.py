"""Bare meshes: what is read from a file, what is refused, and the studio around them."""

from __future__ import annotations

import json
import time

import numpy as np
import pytest
import trimesh

from clpt import transforms
from clpt.errors import SceneError
from clpt.formats import load
from clpt.formats.meshes import mesh
from clpt.geometry.triangles import triangulate
from clpt.scene import materials, shapes, studio

OBJ = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
PLY = """ply
format ascii 1.0
element vertex 3
property float x
property float y
property float z
{more}element face 1
property list uchar int vertex_indices
end_header
{rows}
3 0 1 {last}
"""


@pytest.fixture
def read(tmp_path):
    """Write a file and read its meshes."""

    def of(name: str, content: str | bytes):
        path = tmp_path / name
        path.write_bytes(content.encode() if isinstance(content, str) else content)
        return mesh.read_mesh(path)

    return of


def ply(more="", rows="0 0 0\n1 0 0\n0 1 0", last="2"):
    return PLY.format(more=more, rows=rows, last=last)


def test_obj_without_normals_stays_without(read):
    (made,) = read("a.obj", OBJ + "f 1 2 3 4\n").meshes
    assert made.faces.tolist() == [[0, 1, 2], [0, 2, 3]] or len(made.faces) == 2
    assert made.normals is None and made.uvs is None
    assert made.vertices.dtype == np.float32 and made.faces.dtype == np.uint32


def test_obj_splits_vertices_by_normal_and_uv(read):
    text = (
        OBJ + "vt 0 0\nvt 0.5 0.25\nvn 0 0 2\nvn 0 1 0\nf 1/1/1 2/2/1 3/1/1\nf 1/2/2 3/1/1 4/1/1\n"
    )
    (made,) = read("a.obj", text).meshes
    assert len(made.vertices) == 5  # the first vertex twice
    assert np.allclose(np.linalg.norm(made.normals, axis=1), 1.0)
    assert {tuple(row) for row in made.uvs.tolist()} == {(0.0, 0.0), (0.5, 0.25)}


def test_ply_normals_and_uvs(read):
    names = ("nx", "ny", "nz", "u", "v")
    more = "".join(f"property float {name}\n" for name in names)
    rows = "0 0 0 0 0 1 0 0\n1 0 0 0 1 0 1 0\n0 1 0 1 0 0 0 1"
    (made,) = read("a.ply", ply(more, rows)).meshes
    assert made.normals.tolist() == [[0, 0, 1], [0, 1, 0], [1, 0, 0]]
    assert made.uvs.tolist() == [[0, 0], [1, 0], [0, 1]]


def test_bad_normals_are_replaced(read):
    more = "".join(f"property float {name}\n" for name in ("nx", "ny", "nz"))
    rows = "0 0 0 0 0 0\n1 0 0 nan 0 0\n0 1 0 0 1 0"
    (made,) = read("a.ply", ply(more, rows)).meshes
    assert made.normals.tolist() == [[0, 0, 1], [0, 0, 1], [0, 1, 0]]


@pytest.mark.parametrize("suffix", [".stl", ".off", ".obj", ".ply"])
def test_formats(tmp_path, suffix):
    whole = trimesh.creation.icosphere(subdivisions=1)
    path = tmp_path / f"ball{suffix}"
    whole.export(path)
    (made,) = mesh.read_mesh(path).meshes
    assert len(made.faces) == 80
    assert np.allclose(np.linalg.norm(made.vertices, axis=1), 1.0, atol=1e-4)


def test_obj_material_textures(tmp_path):
    from PIL import Image

    Image.new("RGB", (2, 2), (255, 0, 188)).save(tmp_path / "t.png")
    (tmp_path / "a.mtl").write_text("newmtl a\nKd 1 1 1\nmap_Kd t.png\n")
    text = "mtllib a.mtl\nusemtl a\n" + OBJ + "vt 0 0\nf 1/1 2/1 3/1\n"
    (tmp_path / "a.obj").write_text(text)
    (made,) = mesh.read_mesh(tmp_path / "a.obj").meshes
    bitmap = made.material.front.reflectance
    assert not bitmap.raw and bitmap.image == tmp_path / "t.png"
    # Without its materials, an OBJ is one mesh, however often it names another.
    (tmp_path / "a.obj").write_text(text + "usemtl b\nf 1/1 3/1 4/1\n")
    (made,) = mesh.read_mesh(tmp_path / "a.obj", materials=False).meshes
    assert len(made.faces) == 2


def test_zero_area_triangles_stay_and_unused_vertices_go(read):
    made = read("a.obj", OBJ + "v 9 9 9\nf 1 2 3\nf 1 1 2\nf 1 2 2\n")
    assert len(made.meshes[0].faces) == 3, "counted as the file has them; lowering leaves them out"
    assert made.meshes[0].vertices.max() == 1
    assert made.warnings == []


BAD = {
    "empty.obj": ("", "no triangles: 0 vertices"),
    "points.obj": (OBJ, "no triangles"),
    "index.obj": (OBJ + "f 1 2 9\n", "names the .v. 9 of 4"),
    "nan.ply": (ply(rows="0 0 0\nnan 0 0\n0 1 0"), "not a finite number"),
    "inf.ply": (ply(rows="0 0 0\n1e39 0 0\n0 1 0"), "not a finite number"),
    "index.ply": (ply(last="7"), "outside 0 to 2"),
    "negative.ply": (ply(last="-1"), "outside 0 to 2"),
    "cut.ply": (ply()[:-12], "cannot be read|no triangles"),
    "text.ply": ("hello", "cannot be read"),
    "text.stl": ("hello", "cannot be read|no triangles"),
    "text.off": ("hello", "cannot be read"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_files_are_one_line(read, name):
    content, message = BAD[name]
    with pytest.raises(SceneError, match=message) as caught:
        read(name, content)
    assert name in str(caught.value) and "\n" not in str(caught.value)


def test_a_mesh_without_area_is_refused(tmp_path):
    (tmp_path / "flat.obj").write_text(OBJ + "f 1 1 1\n")
    with pytest.raises(SceneError, match=r"flat\.obj: none of its triangles has an area"):
        load(tmp_path / "flat.obj")


def test_load_refuses_what_is_not_there(tmp_path):
    for name, message in {
        "no.obj": "no such file",
        "\0": "no such file|cannot be read",
        "": "no scene.json",
    }.items():
        with pytest.raises(SceneError, match=message):
            load(f"{tmp_path}/{name}")
    (tmp_path / "a.blend").touch()
    with pytest.raises(SceneError, match=r"unknown format '\.blend'; known: \.json"):
        load(tmp_path / "a.blend")


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize(("suffix", "up"), [(".obj", 1), (".stl", 2)])
def test_the_studio_frames_any_mesh(tmp_path, size, suffix, up):
    offset = np.array([3.0, -2.0, 5.0]) * size
    box = trimesh.creation.box(extents=np.array([1.0, 2.0, 0.5]) * size)
    box.apply_translation(offset)
    box.export(tmp_path / f"box{suffix}", **({"digits": 12} if suffix == ".obj" else {}))
    made = load(tmp_path / f"box{suffix}")
    camera = made.camera
    seen = transforms.transform_points(np.linalg.inv(camera.to_world), made.shapes[0].vertices)
    across = np.abs(seen[:, :2] / seen[:, 2:]).max() / np.tan(np.radians(camera.fov / 2))
    assert 0.7 < across < 1.0  # all of it is in the picture, and it does not get lost there
    assert camera.near < seen[:, 2].min() and seen[:, 2].max() < camera.far
    assert camera.to_world[up, 3] > offset[up]
    ground = made.shapes[1]
    assert np.allclose(
        ground.to_world[up, 3], made.shapes[0].vertices[:, up].min(), atol=5e-3 * size
    )
    vertices, faces, normals, _ = triangulate(ground)
    first, second, third = (vertices[faces[0, i]].astype(float) for i in range(3))
    normal = np.cross(second - first, third - first)
    assert np.allclose(normal / np.linalg.norm(normal), np.eye(3)[up], atol=1e-6)
    middle = (vertices.min(axis=0) + vertices.max(axis=0)) / 2.0
    inward = ((middle - vertices) * normals).sum(axis=1)  # the floor and the walls are a bowl
    assert (inward > 0.0).all()


def test_bounds_of_every_shape():
    turn = transforms.rotate([1, 2, 3], 40) @ transforms.scale(2.0)
    made = [
        shapes.Sphere(center=(1, 0, 0), radius=0.5, to_world=turn),
        shapes.Disk(to_world=turn),
        shapes.Cylinder(p0=(0, 1, 0), p1=(1, 2, 1), radius=0.3, to_world=turn),
        shapes.Cube(to_world=turn),
        shapes.Rectangle(to_world=turn),
    ]
    rng = np.random.default_rng(1)
    angle = rng.uniform(0, 2 * np.pi, 20_000)
    ring = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    ball = rng.normal(size=(20_000, 3))
    axis = np.array([1.0, 1.0, 1.0]) / np.sqrt(3)
    side = np.stack([np.cross(axis, [0, 0, 1]), np.cross(axis, np.cross(axis, [0, 0, 1]))])
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    tube = np.array([0, 1, 0]) + 0.3 * ring[:, :2] @ side
    points = [
        [1, 0, 0] + 0.5 * ball / np.linalg.norm(ball, axis=1, keepdims=True),
        ring,
        np.concatenate([tube, tube + 1.0]),
        np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]),
        np.array([[x, y, 0] for x in (-1, 1) for y in (-1, 1)]),
    ]
    for shape, sample in zip(made, points, strict=True):
        low, high = studio.shape_bounds(shape)
        moved = transforms.transform_points(turn, sample)
        assert np.allclose(low, moved.min(axis=0), atol=3e-3), shape.kind
        assert np.allclose(high, moved.max(axis=0), atol=3e-3), shape.kind


def test_assets_have_the_expected_triangles_and_bounds(assets):
    expected = json.loads((assets / "expected.json").read_text())["meshes"]
    for name, known in expected.items():
        if "triangles" not in known or name.endswith(".glb"):
            continue
        made = mesh.read_mesh(assets / name).meshes
        assert sum(len(part.faces) for part in made) == known["triangles"], name
        bounds = np.array(studio.world_bounds(made))
        assert np.allclose(bounds, known["bounds"], atol=2e-5 * np.abs(bounds).max()), name


def test_odd_assets_are_read_or_refused(assets):
    for path in sorted((assets / "meshes-odd").rglob("*.*")):
        if path.suffix.lower() not in mesh.SUFFIXES:
            continue
        try:
            load(path)
        except SceneError as error:
            assert path.name in str(error) and "\n" not in str(error)


@pytest.mark.slow
def test_a_million_triangles_take_seconds(tmp_path):
    trimesh.creation.icosphere(subdivisions=8).export(tmp_path / "ball.ply")
    start = time.perf_counter()
    assert len(load(tmp_path / "ball.ply").shapes[0].faces) == 1_310_720
    assert time.perf_counter() - start < 20.0


def test_a_mesh_of_trimesh():
    """Its arrays, uvs and colours; a material of the caller's comes first."""
    box = trimesh.creation.box()
    made = shapes.Mesh.from_trimesh(box, name="box", normals="smooth")
    np.testing.assert_array_equal(made.vertices, box.vertices)
    np.testing.assert_array_equal(made.faces, box.faces)
    assert (made.vertices.dtype, made.faces.dtype) == (np.float32, np.uint32)
    assert (made.name, made.normals, made.uvs, made.material.kind) == (
        "box", "smooth", None, "diffuse",
    )  # fmt: skip

    box.visual.face_colors = np.full((12, 4), [255, 0, 188, 255], np.uint8)
    made = shapes.Mesh.from_trimesh(box)
    np.testing.assert_allclose(made.attributes["face_color"][3], [1, 0, 0.5029], atol=1e-4)
    assert made.material.front.reflectance.name == "face_color"
    assert shapes.Mesh.from_trimesh(box, material=materials.Diffuse()).material.kind == "diffuse"

    uv = np.arange(16).reshape(8, 2) / 16
    box.visual = trimesh.visual.TextureVisuals(uv=uv)
    np.testing.assert_array_equal(shapes.Mesh.from_trimesh(box).uvs, np.float32(uv))
    with pytest.raises(SceneError, match=r"not Scene; Scene\.from_trimesh takes"):
        shapes.Mesh.from_trimesh(trimesh.Scene(box))


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (bytes(80) + (100).to_bytes(4, "little") + bytes(500), "holds 10 of 100 triangles"),
        (b"solid x".ljust(80) + (3).to_bytes(4, "little") + bytes(100), "holds 2 of 3 triangles"),
        (bytes(range(256))[:60], "ends within its header"),
        (bytes(range(200, 256)) * 4, "triangles"),
    ],
)
def test_stl_files_that_are_cut_off(tmp_path, data, message):
    path = tmp_path / "a.stl"
    path.write_bytes(data)
    with pytest.raises(SceneError, match=message):
        load(path)


TEXTURED = """ply
format ascii 1.0
{comments}element vertex 4
property float x
property float y
property float z
{more}element face 2
property list uchar int vertex_indices
property list uchar float texcoord
property int texnumber
end_header
0 0 0
1 0 0
0 1 0
1 1 0
3 0 1 2 6 0 0 1 0 0 1 {first}
3 2 1 3 6 0 1 1 0 1 1 {second}
"""


def test_the_images_of_a_ply(read, tmp_path):
    """Each image is shown by the faces that name it; one that is not there is told."""
    from PIL import Image

    for name in ("a.png", "b c.png"):
        Image.new("RGB", (2, 2), (255, 0, 188)).save(tmp_path / name)
    comments = "comment TextureFile a.png\n"
    made = read("a.ply", TEXTURED.format(comments=comments, more="", first=0, second=0))
    (one,) = made.meshes
    assert made.warnings == [] and len(one.faces) == 2
    assert one.material.front.reflectance.image == tmp_path / "a.png"
    comments += "comment TextureFile b c.png\n"
    made = read("a.ply", TEXTURED.format(comments=comments, more="", first=1, second=0))
    assert made.warnings == []
    images = [mesh.material.front.reflectance.image for mesh in made.meshes]
    assert images == [tmp_path / "a.png", tmp_path / "b c.png"]
    assert [mesh.uvs.tolist() for mesh in made.meshes] == [
        [[1, 0], [0, 1], [1, 1]], [[0, 0], [1, 0], [0, 1]],
    ]  # fmt: skip
    made = read("a.ply", TEXTURED.format(comments=comments, more="", first=-1, second=1))
    assert [mesh.material.front.name for mesh in made.meshes] == ["b c", "grey"]
    assert [mesh.uvs.tolist()[0] for mesh in made.meshes] == [[1, 0], [0, 0]]
    (tmp_path / "a.png").unlink()
    made = read("a.ply", TEXTURED.format(comments=comments, more="", first=0, second=0))
    assert made.warnings == ["image 'a.png' left out, as it is not there"]
    assert made.meshes[0].material.front.reflectance.value == 0.6
    plain = mesh.read_mesh(tmp_path / "a.ply", materials=False)
    assert plain.warnings == [] and len(plain.meshes) == 1


def test_an_image_without_coordinates_is_told(read):
    made = read(
        "a.ply", ply().replace("element vertex", "comment TextureFile x.png\nelement vertex")
    )
    assert made.warnings == ["image 'x.png' left out, as there are no texture coordinates"]
