"""Groups and instances: what is shared, what is placed one by one, and boxes that hold it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import clpt
from clpt import transforms as tf
from clpt.cli.info import info
from clpt.errors import SceneError
from clpt.formats.native import save
from clpt.geometry import instancing
from clpt.geometry.analytic import tessellate
from clpt.geometry.triangles import triangulate
from clpt.records import INSTANCE, SHAPE
from clpt.render.flow.scene_to_tables import lower
from clpt.scene import Scene
from clpt.scene.cameras import Perspective
from clpt.scene.lights import Area
from clpt.scene.materials import Diffuse
from clpt.scene.shapes import Cube, Cylinder, Disk, Group, Instance, Mesh, Rectangle, Shape, Sphere

RNG = np.random.default_rng(11)
CLOUD = RNG.normal(size=(300, 3)).astype(np.float32) * [3.0, 1.0, 0.2] + [40.0, -7.0, 2.0]
FACES = np.arange(300, dtype=np.uint32).reshape(-1, 3)
STONE = Mesh(vertices=CLOUD.astype(np.float32), faces=FACES, name="stone")


def scene(*shapes: Shape) -> Scene:
    """A scene of these shapes."""
    return Scene(camera=Perspective(), shapes=list(shapes))


def placements(count: int) -> list[np.ndarray]:
    """Transforms of all sorts: turned, stretched, mirrored, near and far, tiny and large."""
    made = []
    for i in range(count):
        stretch = np.exp(RNG.uniform(-4, 4, 3)) * [(-1.0) ** i, 1.0, 1.0]
        turns = [tf.rotate(RNG.normal(size=3), a) for a in RNG.uniform(0, 360, 2)]
        made.append(tf.translate(RNG.normal(size=3) * 50) @ turns[0] @ tf.scale(stretch) @ turns[1])
    return made


def place(group: Group, matrices: list[np.ndarray]) -> list[Shape]:
    return [Instance(group=group, to_world=matrix) for matrix in matrices]


def test_triangles_are_held_once() -> None:
    group = Group((STONE, Cube()), "set")
    made = lower(scene(Rectangle(), *place(group, placements(50))))
    assert len(made.faces) == 2 + 100 + 12
    assert made.instances.triangles == (112,)
    rows = made.tables["instances"].view(INSTANCE.dtype)
    assert len(rows) == 50 and set(rows["prim"]) == {2}
    assert rows["number"].tolist() == list(range(1, 51))
    assert made.tables["shapes"].view(SHAPE.dtype)["prim"].tolist() == [0, 2, 102]
    assert made.features.geometry.instances


def test_what_is_placed_once_is_an_ordinary_shape() -> None:
    matrix = placements(1)[0]
    made = lower(scene(*place(Group((STONE,)), [matrix])))
    assert not made.features.geometry.instances and len(made.tables["instances"]) == 1
    expected = tf.transform_points(matrix, STONE.vertices)
    np.testing.assert_allclose(made.vertices, expected, rtol=1e-5, atol=1e-3)


def test_lights_and_analytic_shapes_are_placed_one_by_one() -> None:
    lamp = Rectangle(emission=Area(radiance=1.0))
    group = Group((lamp, Sphere(radius=0.5), STONE))
    moved = [tf.translate([i, 0, 0]) @ tf.scale(1.0 + i) for i in range(3)]
    made = lower(scene(*place(group, moved)))
    rows = made.tables["shapes"].view(SHAPE.dtype)
    assert (rows["kind"] != 0).sum() == 3 and len(made.boxes) == 3
    assert sorted(rows["number"][rows["kind"] != 0]) == [0, 1, 2]
    assert (rows["light"] >= 0).sum() == 3
    np.testing.assert_allclose(made.boxes[2, 1, 0], 2.0 + 3 * 0.5, rtol=1e-4)
    assert made.warnings == ()


def test_a_stretched_sphere_becomes_triangles() -> None:
    ball = Sphere(radius=0.5, name="ball")
    matrices = [np.eye(4), tf.scale([1, 2, 1]), tf.scale([1, 3, 1])]
    made = lower(scene(*place(Group((ball, Disk())), matrices)))
    assert len(made.boxes) == 1 + 3  # a disk may be an ellipse
    assert len(made.instances.rows) == 2
    assert "ball" in made.warnings[0] and "2 of 3" in made.warnings[0]
    np.testing.assert_allclose(made.instances.boxes[1, 1], [0.5, 1.5, 0.5], atol=2e-3)


@pytest.mark.parametrize(
    ("shape", "area"),
    [(Sphere(radius=2.0), 16 * np.pi), (Cylinder(p1=(0, 1, 2)), 2 * np.pi * np.sqrt(5.0))],
)
def test_tessellated_shapes_face_outward(shape: Sphere | Cylinder, area: float) -> None:
    vertices, faces, normals, uvs = triangulate(tessellate(shape))
    v0, v1, v2 = vertices[faces].astype(np.float64).transpose(1, 0, 2)
    crosses = np.cross(v1 - v0, v2 - v0)
    assert ((crosses * normals[faces].mean(axis=1)).sum(axis=1) > 0.0).all()
    assert np.linalg.norm(crosses, axis=1).sum() / 2 == pytest.approx(area, rel=2e-3)
    assert uvs.min() == 0.0 and uvs.max() == 1.0


def test_boxes_hold_what_rays_meet_and_little_more() -> None:
    matrices = placements(200)
    made = lower(scene(*place(Group((STONE,)), matrices)))
    for matrix, box in zip(matrices, made.instances.boxes, strict=True):
        points = tf.transform_points(matrix, STONE.vertices)
        low, high = points.min(axis=0), points.max(axis=0)
        assert (box[0] <= low).all() and (box[1] >= high).all()
        assert ((box[1] - box[0]) < 1.15 * (high - low) + 1e-3).all()


def test_rows_undo_their_transform() -> None:
    matrices = placements(20)
    made = lower(scene(*place(Group((STONE,)), matrices)))
    for matrix, row in zip(matrices, made.instances.rows, strict=True):
        world = tf.transform_points(matrix, STONE.vertices)
        local = (world - row["origin"]) @ np.stack([row[axis] for axis in "xyz"]).T
        size = np.abs(world).max() * np.abs([row[axis] for axis in "xyz"]).max()
        np.testing.assert_allclose(local, made.vertices, atol=1e-6 * size)


def test_the_scene_s_sphere_holds_instances() -> None:
    far = place(Group((Cube(),)), [tf.translate([100.0, 0, 0]), tf.translate([-100.0, 0, 0])])
    settings = lower(scene(*far)).settings
    assert settings["scene_radius"] == pytest.approx(np.sqrt(101**2 + 2), rel=1e-4)


@pytest.mark.parametrize(
    ("matrix", "message"),
    [
        (tf.scale([1, 0, 1]), "singular"),
        (np.full((4, 4), np.nan), "singular"),
        (np.eye(3), "must be"),
        (tf.perspective(40, 0.1, 10), "projection"),
        (tf.scale(1e30) @ tf.scale(1e30), "float32"),
    ],
)
def test_transforms_that_are_refused(matrix: np.ndarray, message: str) -> None:
    group = Group((Cube(),))
    with pytest.raises(SceneError, match=message):
        wrong = Instance(group=group, to_world=matrix, name="wrong")
        lower(scene(Instance(group=group), wrong, Instance(group=group)))


def test_groups_hold_shapes_only() -> None:
    with pytest.raises(SceneError, match=r"group 'outer'.shapes\[0\]: .*not an instance"):
        Group((Instance(group=Group()),), "outer")
    with pytest.raises(SceneError, match="must be a group"):
        Instance()
    with pytest.raises(TypeError, match="material"):
        Instance(group=Group(), material=Diffuse())
    assert not lower(
        scene(Instance(group=Group()), Instance(group=Group()))
    ).features.geometry.instances


def test_materials_of_a_group_are_checked() -> None:
    with pytest.raises(SceneError, match="must be a material"):
        Group((Cube(material="red"), STONE))


def test_what_a_scene_has_is_counted_once() -> None:
    group = Group((STONE,))
    found = list(instancing.distinct([Cube(), *place(group, placements(3))]))
    assert [shape.kind for shape in found] == ["cube", "mesh"]


def test_scene_files(tmp_path: Path) -> None:
    """Groups are written once; the matrices of many instances lie in a file."""
    group, other = Group((STONE, Cube()), "set"), Group((Cube(),))
    single = Instance(group=other, to_world=tf.translate([1, 2, 3]), name="single")
    made = scene(Rectangle(), *place(group, placements(40)), single)
    save(made, tmp_path / "scene.json")
    written = json.loads((tmp_path / "scene.json").read_text("utf-8"))
    assert len(written["shapes"]) == 3 and set(written["groups"]) == {"set", "group"}
    again = clpt.load(tmp_path)
    assert len(again.shapes) == 42
    assert len({id(shape.group) for shape in again.shapes[1:41]}) == 1
    for ours, theirs in zip(again.shapes, made.shapes, strict=True):
        assert type(ours) is type(theirs) and ours.name == theirs.name
        np.testing.assert_array_equal(ours.to_world, theirs.to_world)
    assert lower(again).faces.tolist() == lower(made).faces.tolist()
    found = CliRunner().invoke(info, [str(tmp_path), "--json"])
    warnings_of = json.loads(found.output)
    assert (warnings_of["triangles"], warnings_of["instances"]) == (2 + 112 + 12, 41)
    assert warnings_of["triangles_instanced"] == 2 + 40 * 112 + 12


ERRORS = {
    '{"type": "instance"}': "needs a 'group'",
    '{"type": "instance", "group": "oak"}': "group name 'oak'",
    '{"type": "instance", "group": "set", "material": {}}': "no parameter 'material'",
    '{"type": "instance", "group": "set", "file": "none.npy"}': "none.npy",
    '{"type": "instance", "group": "set", "file": "flat.npy"}': r"matrices, \(n, 3, 4\)",
    '{"type": "instance", "group": "set", "file": "text.npy"}': "no .npy",
    '{"type": "instance", "group": "nested"}': "cannot stand in a group",
    '{"type": "instance", "group": "self"}': "contains itself",
}


@pytest.mark.parametrize("shape", ERRORS)
def test_broken_files(tmp_path: Path, shape: str) -> None:
    np.save(tmp_path / "flat.npy", np.zeros((3, 3)))
    (tmp_path / "text.npy").write_text("nothing", "utf-8")
    groups = (
        '{"set": [{"type": "cube"}], "nested": [{"type": "instance", "group": "set"}],'
        ' "self": [{"type": "instance", "group": "self"}]}'
    )
    path = tmp_path / "scene.json"
    path.write_text(
        f'{{"camera": {{"type": "perspective"}},\n"shapes": [{shape}],\n"groups": {groups}}}'
    )
    with pytest.raises(SceneError, match=ERRORS[shape]) as caught:
        clpt.load(path)
    assert caught.value.line in (2, 3) or caught.value.file == tmp_path / "text.npy"
