"""Vertices that move by themselves: against formulas, and what is refused."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import clpt
from clpt import transforms
from clpt.errors import SceneError
from clpt.render.edit.scene_edit import between
from clpt.render.flow.scene_to_tables import lower
from clpt.scene import Scene, cameras, integrators, lights, materials, shapes, textures
from clpt.scene.motion import Deformation, Keys, Shutter
from tests.pictures.motion.test_motion import ball

DANCER = Path(__file__).parents[3] / "scenes" / "dancer" / "dancer.glb"
BALL, FACES, _ = ball(48, 0.25)
BALL = BALL.astype(np.float32)
OPEN = Shutter(0.0, 1.0)
GROWS = Deformation([0.0, 1.0], [BALL, 3.0 * BALL])


def scene(things: Any, shutter: Shutter | None = OPEN) -> Scene:
    camera = cameras.Orthographic(to_world=transforms.translate([0, 0, -3]), shutter=shutter)
    return Scene(
        camera=camera,
        shapes=list(things),
        lights=[lights.Constant(radiance=1.0)],
        film=integrators.Film(
            width=32, height=32, mode="rgb", filter=integrators.Box(), alpha=True
        ),
        integrator=integrators.Path(max_depth=2),
    )


def mesh(**given: Any) -> shapes.Mesh:
    return shapes.Mesh(
        **{"vertices": BALL, "faces": FACES, "normals": "smooth", "deformation": GROWS, **given}
    )


def test_coverage_of_a_ball_that_grows() -> None:
    """Parallel rays: at a distance from the axis it is there for the share of the time at which its
    radius is larger; by the shutter's shape for the share of the density."""
    x = (np.arange(32) + 0.5) / 16.0 - 1.0
    far = np.hypot(x[:, None], x)
    growing = scene([mesh()])
    with clpt.Renderer(growing) as renderer:  # one program for all
        for times, shape in (((0.0, 1.0), "box"), ((0.0, 1.0), "triangle"), ((-1.0, 1.0), "box")):
            shutter = Shutter(*times, shape)
            camera = dataclasses.replace(growing.camera, shutter=shutter)
            renderer.update(scene=dataclasses.replace(growing, camera=camera))
            renderer.run(512)
            found = np.asarray(renderer.image())[..., 3]
            passed = np.clip((far - 0.25) / 0.5, 0.0, 1.0)  # of the way from key to key
            passed = (passed - times[0]) / (times[1] - times[0])
            share = np.where(passed < 0.5, 2 * passed**2, 1 - 2 * (1 - passed) ** 2)
            expected = 1.0 - (share if shape == "triangle" else passed)
            inside = (far > 0.25 + 0.05) & (far < 0.75 - 0.05)
            assert np.abs(found - expected)[inside].max() < 5.5 * 0.5 / np.sqrt(512) + 0.01
            assert abs((found - expected)[inside].mean()) < 0.006  # 5 sigma, and a pixel's width
            assert (found[far < 0.2] > 0.99).all()  # the ball has a hole at its pole
            assert not found[far > 0.8].any()


def test_a_shutter_without_length_is_still() -> None:
    """The same tables and kernels as of the mesh as it is then, with no word of motion."""
    points = GROWS.at(0.3)[0]
    at_once = Shutter(0.3, 0.3)
    still = lower(scene([mesh(vertices=points, deformation=None)], None))
    found = lower(scene([mesh()], at_once))
    assert found.features == still.features and found.settings == still.settings
    assert np.array_equal(found.vertices, still.vertices)
    assert np.array_equal(found.faces, still.faces)
    assert all(np.array_equal(words, still.tables[name]) for name, words in found.tables.items())
    for shutter, moves in ((at_once, ()), (Shutter(2, 3), ()), (Shutter(0, 0.1), ("vertices",))):
        assert lower(scene([mesh()], shutter)).features.motion.parts == moves


def test_motion_between_two_scenes() -> None:
    """What changes has keys at both ends of the time; what does not, or cannot, is as it is."""
    cube, lamp = shapes.Cube(), lights.Point(position=(0, 1, 0))
    points = np.array([[0, 0, 0, 0.1], [0, 1, 0, 0.1]])
    strand = shapes.Curves(points=points, basis="linear")
    ball_ = mesh(deformation=None)
    glows = mesh(deformation=None, emission=lights.Area(), name="glows")
    placed = shapes.Instance(group=shapes.Group((ball_,)))
    dust = shapes.Spheres(centers=points)
    former = scene([cube, ball_, placed, glows, strand, dust], Shutter(1.0, 2.0))
    former = dataclasses.replace(former, lights=[lamp])
    bent = dataclasses.replace(ball_, vertices=2 * BALL)
    things = [
        cube,
        bent,
        dataclasses.replace(placed, group=shapes.Group((bent,))),
        dataclasses.replace(glows, vertices=2 * BALL),
        dataclasses.replace(strand, points=points + 1),
        dataclasses.replace(dust, centers=points + 1),
    ]
    aside = dataclasses.replace(former.camera, to_world=transforms.translate([1, 0, -3]))
    new = dataclasses.replace(
        former,
        shapes=things,
        lights=[dataclasses.replace(lamp, position=(1, 1, 0))],
        camera=aside,
    )
    moving, warnings = between(former, new)
    assert not warnings and moving.shapes[0] is cube
    for keys in (moving.shapes[1], moving.shapes[2].group.shapes[0], moving.shapes[3]):
        assert keys.deformation.times == (1.0, 2.0)
        assert np.array_equal(keys.deformation.points, [BALL, 2 * BALL])
    assert np.allclose(moving.shapes[4].deformation.points[1], points + 1)
    assert np.allclose(moving.lights[0].motion.at(1.5)[:3, 3], [0.5, 1, 0])
    assert np.allclose(moving.camera.motion.at(1.5)[:3, 3], [0.5, 0, -3])
    assert np.allclose(moving.shapes[5].deformation.points[1][:, :3], points[:, :3] + 1)
    parts = {"camera", "lights", "vertices", "spheres", "emitters"}
    assert set(lower(moving).features.motion.parts) == parts


@pytest.mark.slow
def test_updates_move_from_the_last_to_this() -> None:
    """The same bits as keys that say so; then from there, and afterwards nothing moves."""
    cube = shapes.Cube(to_world=transforms.scale(0.2), name="cube")
    plain = scene([mesh(deformation=None, name="ball"), cube])
    place = transforms.translate([0.5, 0, 0]) @ transforms.rotate([0, 0, 1], 30) @ cube.to_world
    turned = dataclasses.replace(
        cube, to_world=np.eye(4), motion=Keys([0.0, 1.0], [cube.to_world, place])
    )
    with clpt.Renderer(plain) as renderer:

        def picture() -> np.ndarray:
            renderer.run(4)
            return np.array(renderer.image())

        renderer.update(vertices={"ball": 3 * BALL}, transforms={"cube": place}, motion=True)
        keyed = scene([mesh(), turned])
        assert np.array_equal(picture(), np.asarray(clpt.render(keyed, 4)))
        renderer.update(vertices={"ball": BALL}, motion=True)
        lowered = renderer._wavefront.scene.lowered
        assert lowered.features.motion.parts == ("vertices",)  # the cube has come to rest
        corners = lowered.vertices[-2 * len(BALL) :].reshape(-1, 2, 3)
        assert np.allclose(corners[:, 0], 3 * corners[:, 1], atol=1e-5)
        renderer.update(transforms={"cube": cube.to_world})
        assert np.array_equal(picture(), np.asarray(clpt.render(plain, 4)))
    with clpt.Renderer(scene([cube], None)) as renderer:
        with pytest.raises(SceneError, match="the shutter is open"):
            renderer.update(transforms={"cube": place}, motion=True)
        with pytest.raises(SceneError, match="there were 1, now 2"):
            renderer.update(scene=scene([cube, cube]), motion=True)


def test_keys_between() -> None:
    keys = Deformation([1.0, 2.0, 4.0], [BALL, 2 * BALL, BALL], [BALL, BALL, -BALL])
    assert np.allclose(keys.at(1.5)[0], 1.5 * BALL) and np.allclose(keys.at(3.0)[1], 0.0)
    assert np.array_equal(keys.at(9.0)[0], keys.points[2]) and keys.at(0)[0] is not None
    assert keys.while_open(Shutter(1.5, 3.0)) == (1.5, 2.0, 3.0)
    assert keys.while_open(Shutter(-2.0, 1.0)) == (-2.0,)


@pytest.mark.parametrize(
    ("times", "points", "normals", "message"),
    [
        ([], [], None, "at least one key"),
        ([1.0, 0.5], [BALL, BALL], None, r"times\[1\].*later"),
        ([0.0, float("nan")], [BALL, BALL], None, r"times\[1\]"),
        ([0.0, 1.0], [BALL, BALL[1:]], None, "key 1 has .*: all must have as many"),
        ([0.0, 1.0], [BALL], None, "for 2 times, found"),
        ([0.0], [BALL + np.inf], None, "key 0 is not finite"),
        ([0.0], [BALL], [BALL[1:]], "as many normals as points"),
        ([0.0], 3, None, "deformation.points"),
        ([0.0], [[["a", "b", "c"]]], None, "not numbers"),
    ],
)
def test_keys_that_make_no_sense(times: Any, points: Any, normals: Any, message: str) -> None:
    with pytest.raises(SceneError, match=message):
        Deformation(times, points, normals)


def test_what_cannot_deform_is_refused() -> None:
    few = Deformation([0.0, 1.0], [BALL[1:], BALL[1:]])
    cases: list[tuple[Any, str]] = [
        (mesh(deformation=few), r"mesh.deformation: its keys have .* where vertices are"),
        (mesh(deformation=3), "must be a Deformation"),
        (mesh(vertices=None), "needs vertices too"),
        (mesh(normals=BALL), "needs normals at each time"),
        (mesh(displacement=textures.Bitmap(image=np.ones((2, 2)))), "displacement"),
    ]
    for shape, message in cases:
        with pytest.raises(SceneError, match=message):
            lower(scene([shape]))
    group = shapes.Group((mesh(deformation=few),))
    with pytest.raises(SceneError, match="its keys have"):
        lower(scene([shapes.Instance(group=group)]))
    with pytest.raises(SceneError, match="brute holds no instances"):
        clpt.render(scene([mesh()]), 1, layout="brute")


def test_rows_of_what_deforms() -> None:
    """Vertices stand once for each key, side by side; uvs and attributes with them."""
    given = {"vertex_tint": np.random.default_rng(0).random((len(BALL), 3)).astype(np.float32)}
    tint = textures.MeshAttribute(name="vertex_tint")
    shape = mesh(attributes=given, material=materials.Diffuse(reflectance=tint))
    still = shapes.Cube(material=materials.Diffuse())
    lowered = lower(scene([still, shape], Shutter(0.0, 0.5)))
    first = 24
    rows = lowered.vertices[first:].reshape(-1, 2, 3)
    assert len(rows) == len(BALL) and np.allclose(2 * rows[:, 0], rows[:, 1], atol=1e-6)
    assert (lowered.faces[12:] % 2 == first % 2).all() and lowered.instances.keys == (2,)
    box = lowered.instances.boxes[0]
    assert (box[0] <= 2 * BALL.min(axis=0)).all() and (box[1] >= 2 * BALL.max(axis=0)).all()


def test_scene_file(tmp_path: Path) -> None:
    file = tmp_path / "scene.json"
    points, faces = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32), [[0, 1, 2]]
    keys = Deformation([0.0, 0.5], [points, 2 * points], [points + 1, points + 2])
    shape = mesh(vertices=points, faces=np.array(faces), normals=points + 1, deformation=keys)
    clpt.save(scene([shape]), file)
    again = clpt.load(file).shapes[0].deformation
    assert again.times == keys.times
    assert np.array_equal(again.points, keys.points)
    assert np.array_equal(again.normals, keys.normals)
    text = json.loads(file.read_text("utf-8"))
    entry = text["shapes"][0]
    entry["deformation"] = [{"time": t, "points": (points * t).tolist()} for t in (1, 2)]
    file.write_text(json.dumps(text, indent=1), "utf-8")
    assert np.array_equal(clpt.load(file).shapes[0].deformation.points[1], 2 * points)
    wrong = {"later than 1 s": {"time": 0.5}, "2 points where the first key has 3": {}}
    for message, change in wrong.items():
        few = entry["deformation"][1]["points"][: 3 if change else 2]
        changed = [entry["deformation"][0], {**entry["deformation"][1], "points": few, **change}]
        entry["deformation"], kept = changed, entry["deformation"]
        file.write_text(json.dumps(text, indent=1), "utf-8")
        entry["deformation"] = kept
        with pytest.raises(SceneError, match=rf"scene\.json:\d+.*{message}"):
            clpt.load(file)
    entry["deformation"] = {"file": "none.npz"}
    file.write_text(json.dumps(text, indent=1), "utf-8")
    with pytest.raises(SceneError, match=r"scene\.json:\d+"):
        clpt.load(file)


def test_a_dancer_moves_by_keys() -> None:
    """Vertices between keys are where the file has them at that time."""
    begin, length = 0.66, 0.08
    moving = clpt.load(DANCER, time=begin, shutter=length)
    assert not moving.warnings
    parts = [shape for shape in moving.shapes if getattr(shape, "deformation", None)]
    assert len(parts) == 5  # of the body, and the skirt, whose folds are a morph
    for time in (begin, begin + 0.033, begin + length):
        still = clpt.load(DANCER, time=time)
        for part, one in zip(moving.shapes, still.shapes, strict=True):
            if part.deformation is not None:
                points, normals = part.deformation.at(time)
                size = np.ptp(one.vertices, axis=0).max()
                assert np.abs(points - one.vertices).max() < 2e-3 * size
                assert np.abs(normals - one.normals).max() < 0.05
