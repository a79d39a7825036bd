"""Many spheres in one shape: what rays meet, what textures and lights see, files, and bad input."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pyopencl.array as cl_array
import pytest

import clpt
from clpt import bvh, device
from clpt import transforms as T
from clpt.cli.files.scene_contents import summary
from clpt.errors import SceneError
from clpt.formats.native import load, save
from clpt.geometry import analytic
from clpt.records import LIGHT
from clpt.render.flow.scene_to_tables import lower
from clpt.scene import Scene, cameras, integrators, lights, materials, shapes
from clpt.scene.textures import MeshAttribute
from tests.kernels.harness import opened
from tests.pictures.support import layers_of

RNG = np.random.default_rng(11)
PLACE = T.translate([0.1, -0.2, 0.3]) @ T.rotate([1, 2, 3], 40.0) @ T.scale(1.2)
COLOURS = RNG.random((40, 3)).astype(np.float32)
LAYERS = ("position", "geometric_normal", "albedo", "primitive_id")
PAINT = materials.Diffuse(reflectance=MeshAttribute(name="vertex_color"))
MANY = shapes.Spheres(
    centers=RNG.normal(size=(40, 3)).astype(np.float32),
    radii=(RNG.random(40) * 0.2 + 0.1).astype(np.float32),
    attributes={"vertex_color": COLOURS, "vertex_unused": COLOURS[:, :1]},
    material=PAINT,
    to_world=PLACE,
    name="bodies",
)
FEW = shapes.Spheres(centers=RNG.normal(size=(3, 3)), radii=0.3, material=materials.Diffuse())
SQUARE = shapes.Rectangle(to_world=T.scale(0.3))
SCENE = Scene(
    camera=cameras.Orthographic(to_world=T.look_at([0, 0, 9], [0, 0, 0], [0, 1, 0]) @ T.scale(2)),
    shapes=[MANY, shapes.Sphere(center=(0.5, 0.5, 1.0), radius=0.4), SQUARE, FEW],
    film=integrators.Film(
        width=48, height=48, mode="rgb", filter=integrators.Box(radius=0.01), layers=LAYERS
    ),
    integrator=integrators.Path(max_depth=1, light_paths=0),
)


def nearest(balls: np.ndarray, position: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Of rays along -z at (n, 3): which of the balls is met first, -1 for none, and its z."""
    balls = balls.astype(np.float64)
    off = position[:, None, :2] - balls[:, :2]
    height2 = balls[:, 3] ** 2 - (off**2).sum(axis=2)
    z = np.where(height2 >= 0.0, balls[:, 2] + np.sqrt(np.maximum(height2, 0.0)), -np.inf)
    which, top = z.argmax(axis=1), z.max(axis=1)
    return np.where(np.isfinite(top), which, -1), top


@pytest.mark.parametrize("layout", [pytest.param("brute", marks=pytest.mark.slow), "wide8"])
def test_rays_meet_the_nearest_sphere(layout: str) -> None:
    """Place, normal, number and colour of what is met, against float64."""
    layers = layers_of(SCENE, 1, layout=layout)
    found = {name: layer.reshape(48 * 48, -1) for name, layer in layers.items()}
    position = found["position"].astype(np.float64)
    single = np.array([[0.5, 0.5, 1.0, 0.4]])
    all_balls = np.concatenate([analytic.balls(MANY), single, analytic.balls(FEW)])
    which, top = nearest(all_balls, position)
    above = (np.abs(position[:, :2]).max(axis=1) < 0.3) & (top < 0.0)  # what the square hides
    met = (which >= 0) & ~above & position.any(axis=1)
    assert met.sum() > 500
    agree = np.abs(position[:, 2] - top) < 1e-4
    assert (agree | ~met).mean() > 0.995  # outlines
    met &= agree
    own = all_balls[which[met]]
    normal = (position[met] - own[:, :3]) / own[:, 3:]
    np.testing.assert_allclose(found["geometric_normal"][met], normal, atol=2e-4)
    of_many, of_few = met & (which < 40), met & (which > 40)
    assert of_many.sum() > 300 and of_few.sum() > 20
    assert (found["primitive_id"][of_many, 0] == which[of_many]).mean() > 0.995  # outlines
    np.testing.assert_array_equal(found["primitive_id"][of_few, 0], which[of_few] - 41)
    np.testing.assert_allclose(found["albedo"][of_many], COLOURS[which[of_many]], atol=1e-5)
    np.testing.assert_allclose(found["albedo"][of_few], 0.5, atol=1e-5)


def test_arrays_of_a_device_are_as_good() -> None:
    queue = opened().queue
    given = cl_array.to_device(queue, np.asarray(MANY.centers))
    radii = cl_array.to_device(queue, np.asarray(MANY.radii))
    other = shapes.Spheres(centers=given, radii=radii, to_world=PLACE)
    np.testing.assert_array_equal(analytic.balls(other), analytic.balls(MANY))
    four = np.column_stack([MANY.centers, MANY.radii])
    other = shapes.Spheres(centers=cl_array.to_device(queue, four), to_world=PLACE)
    np.testing.assert_array_equal(analytic.balls(other), analytic.balls(MANY))


def test_boxes_hold_the_spheres() -> None:
    far = np.array([[1e5, -3.0, 0.0, 0.25]], np.float32)
    low, high = analytic.boxes([analytic.balls(MANY), far]).transpose(1, 0, 2).astype(np.float64)
    whole = np.concatenate([analytic.balls(MANY), far]).astype(np.float64)
    reach = whole[:, 3:]
    assert (low < whole[:, :3] - reach).all() and (high > whole[:, :3] + reach).all()
    assert (high - low < 2.1 * reach)[:-1].all()


def test_lights_and_instances_are_those_of_single_spheres() -> None:
    """Rows of `lights` and boxes are the same, whether spheres come one by one or at once."""
    glow = lights.Area(radiance=2.0)
    many = shapes.Spheres(centers=MANY.centers, radii=MANY.radii, emission=glow)
    pairs = zip(MANY.centers, MANY.radii, strict=True)
    singles = [shapes.Sphere(center=c, radius=r, emission=glow) for c, r in pairs]
    made = []
    for inside in ([many], singles):
        group = shapes.Group(tuple(inside))
        places = [shapes.Instance(group=group, to_world=m) for m in (PLACE, T.scale(2.0))]
        integrator = integrators.Path()
        made.append(lower(Scene(camera=SCENE.camera, shapes=places, integrator=integrator)))
    one, other = (np.sort(low.boxes.reshape(-1, 6), axis=0) for low in made)
    np.testing.assert_allclose(one, other, rtol=1e-5, atol=1e-5)
    assert [low.settings["light_count"] for low in made] == [80, 80]
    words = [low.tables["lights"][: 80 * LIGHT.words] for low in made]
    pmf = [np.sort(rows.view(LIGHT.dtype)["pmf"]) for rows in words]
    np.testing.assert_allclose(pmf[0], pmf[1], rtol=1e-4)


def test_files_keep_them(tmp_path) -> None:
    save(SCENE, tmp_path / "scene.json")
    again = load(tmp_path / "scene.json")
    many = again.shapes[0]
    assert isinstance(many, shapes.Spheres) and many.name == "bodies"
    np.testing.assert_array_equal(analytic.balls(many), analytic.balls(MANY))
    np.testing.assert_array_equal(many.attributes["vertex_color"], COLOURS)
    np.testing.assert_array_equal(analytic.balls(again.shapes[3]), analytic.balls(FEW))
    assert summary(again)["spheres"] == 43
    document = json.loads((tmp_path / "scene.json").read_text())
    document["shapes"] = [{"type": "spheres", "centers": [[0, 0, 0], [1, 2, 3]], "radii": [1, 2]}]
    (tmp_path / "plain.json").write_text(json.dumps(document))
    assert summary(load(tmp_path / "plain.json"))["bounds"] == [[-2, -2, -2], [3, 4, 5]]
    np.savez(tmp_path / "scene.bodies0.npz", points=np.zeros((2, 3)))
    with pytest.raises(SceneError, match="holds 'points'"):
        load(tmp_path / "scene.json")


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({}, "centers must be (n, 3) or (n, 4)"),
        ({"centers": np.zeros((0, 3))}, "n at least one"),
        ({"centers": np.zeros((4, 2))}, "found (4, 2)"),
        ({"centers": np.zeros((4, 3)), "radii": np.ones(3)}, "or (4,), found (3,)"),
        ({"centers": np.zeros((4, 3)), "radii": [1, 1, 0, 1]}, "radii[2] must be above zero"),
        ({"centers": np.full((4, 3), np.nan)}, "centers[0] is not finite"),
        ({"centers": np.zeros((4, 3)), "to_world": T.scale([1, 2, 1])}, "use a mesh"),
        ({"centers": "abc"}, "not numbers"),
        (
            {"centers": np.zeros((4, 3)), "attributes": {"vertex_color": np.ones((3, 3))}},
            "must be (4, 1 or 3), found (3, 3)",
        ),
    ],
)
def test_bad_spheres_are_named(given: dict, words: str) -> None:
    bad = shapes.Spheres(material=PAINT if "attributes" in given else FEW.material, **given)
    with pytest.raises(SceneError) as caught:
        lower(Scene(camera=SCENE.camera, shapes=[bad]))
    assert words in str(caught.value)


def test_an_instance_must_not_stretch_them() -> None:
    good = shapes.Spheres(centers=np.zeros((4, 3)))
    placed = shapes.Instance(group=shapes.Group((good,)), to_world=T.scale([1, 2, 1]))
    with pytest.raises(SceneError, match="use a mesh"):
        lower(Scene(camera=SCENE.camera, shapes=[placed]))


@pytest.mark.slow
def test_they_move_on_the_device(monkeypatch: pytest.MonkeyPatch) -> None:
    """After a move the picture is that of a new renderer; nothing is read, nothing waited for."""
    before, after = (RNG.normal(size=(300, 3)).astype(np.float32) for _ in range(2))
    matrix = T.translate([0.2, 0.1, 0.0]) @ T.scale(0.8)
    queue = opened().queue
    body = shapes.Spheres(centers=before, radii=0.2, to_world=matrix, name="bodies")
    film = integrators.Film(width=32, height=32, mode="rgb")
    sky = lights.Constant(radiance=1.0)
    path = integrators.Path(max_depth=3)

    def scene(**given) -> Scene:
        placed = [dataclasses.replace(body, **given), shapes.Sphere(center=(0.0, 0.0, 2.0))]
        return Scene(camera=SCENE.camera, shapes=placed, lights=[sky], film=film, integrator=path)

    def picture(renderer: clpt.Renderer) -> np.ndarray:
        renderer.step(2)
        return renderer.image()

    def agree(renderer: clpt.Renderer, **given) -> bool:
        expected = picture(clpt.Renderer(scene(**given), queue=queue))
        return (np.abs(picture(renderer) - expected).max(axis=2) > 1e-3).mean() < 0.01  # outlines

    memory = cl_array.to_device(queue, before)
    renderer = clpt.Renderer(scene(centers=memory), queue=queue)
    assert not agree(renderer, centers=after)
    memory.set(after)
    with monkeypatch.context() as patched:
        for name in ("read", "read_later", "wait"):
            patched.delattr(device.Stream, name)
        renderer.update(vertices={"bodies": memory})
    assert agree(renderer, centers=after)
    four = np.column_stack([before, np.full(300, 0.1)]).astype(np.float32)
    renderer.update(vertices={"bodies": cl_array.to_device(queue, four)})
    assert agree(renderer, centers=four)
    renderer.update(transforms={"bodies": np.eye(4)})
    assert agree(renderer, centers=four, to_world=np.eye(4))
    nowhere = four.copy()
    nowhere[:200, 0] = np.nan
    nowhere[200:250, 3] = 0.0
    renderer.update(vertices={"bodies": cl_array.to_device(queue, nowhere)})
    assert agree(renderer, centers=four[250:], to_world=np.eye(4))
    renderer.update(vertices={"bodies": memory})
    renderer.update(materials={"bodies": materials.Diffuse(reflectance=0.2)})
    paint = materials.Diffuse(reflectance=0.2)
    assert agree(renderer, centers=after, to_world=np.eye(4), material=paint)
    glow = lights.Area(radiance=1.0)
    body = dataclasses.replace(renderer.scene.shapes[0], emission=glow)
    lit = dataclasses.replace(renderer.scene, shapes=[body, renderer.scene.shapes[1]])
    renderer.update(scene=lit)  # tables that were moved are made anew
    assert agree(renderer, centers=after, to_world=np.eye(4), material=paint, emission=glow)


@pytest.mark.parametrize("layout", ["shapes_binary", "shapes_wide8"])
def test_a_tree_is_built_anew_in_place(layout: str) -> None:
    """Over boxes that moved, bit for bit as a new one."""
    on = opened()
    old, new = (analytic.boxes([RNG.random((500, 4)).astype(np.float32)]) for _ in range(2))
    tree, expected = (bvh.build_boxes(on, boxes, layout) for boxes in (old, new))
    building = bvh.Building(on)
    bvh.rebuild_boxes(building, tree, building.upload(new, np.float32))
    same_trees(building, tree, expected)
    again = bvh.build_boxes(on, old, layout)
    bvh.refit_boxes(building, tree, building.upload(old, np.float32))
    bvh.rebuild_boxes(building, tree, building.upload(old, np.float32))
    same_trees(building, tree, again)


def same_trees(building: bvh.Building, tree: bvh.Bvh, expected: bvh.Bvh) -> None:
    """What rays read of a tree is that of another, to the bit."""
    words = 64 * int(expected.stats["nodes"]) if tree.layout == "shapes_wide8" else 8
    for name, buffer in tree.buffers.items():
        used = tree.count if name == "indices" else words
        found, wanted = (
            building.read(b, used, np.uint32) for b in (buffer, expected.buffers[name])
        )
        np.testing.assert_array_equal(found, wanted)


def test_a_tree_for_which_there_is_no_room_is_refitted() -> None:
    """It holds the boxes that moved, in the nodes that it had."""
    on = opened()
    building = bvh.Building(on)
    balls = [analytic.boxes([RNG.random((500, 4)).astype(np.float32)]) for _ in range(8)]
    trees = [bvh.build_boxes(on, boxes, "shapes_wide8") for boxes in balls]
    sizes = [int(tree.stats["nodes"]) for tree in trees]
    small, large = np.argmin(sizes), np.argmax(sizes)
    assert sizes[small] < sizes[large]
    nodes = building.allocate(256 * sizes[small])
    building.stream.copy(nodes, trees[small].buffers["nodes"], byte_count=nodes.size)
    buffers = {**trees[small].buffers, "nodes": nodes}
    cramped = dataclasses.replace(trees[small], buffers=buffers)
    moved = building.upload(balls[large], np.float32)
    bvh.rebuild_boxes(building, cramped, moved)
    found = building.read(nodes, nodes.size // 4, np.uint32)
    building.stream.copy(nodes, trees[small].buffers["nodes"], byte_count=nodes.size)
    bvh.refit_boxes(building, cramped, moved)
    wanted = building.read(nodes, nodes.size // 4, np.uint32)
    np.testing.assert_array_equal(found, wanted)
    np.testing.assert_array_equal(
        found[:48].view(np.float32).reshape(6, 8)[::2].min(axis=1) <= balls[large].min((0, 1)), True
    )


@pytest.mark.slow
def test_each_shines_in_its_own_colour() -> None:
    """As single spheres do; both are means of 2 million paths, which are within 1 percent."""
    centers, radii = np.array([[0, 1, 0], [-1.5, 0.8, 0.5], [1.5, 0.9, -0.3]]), [0.3, 0.2, 0.4]
    colours = np.array([[6.0, 1.0, 1.0], [1.0, 8.0, 1.0], [1.0, 1.0, 5.0]])
    black = materials.Diffuse(reflectance=0.0)
    glow = lights.Area(radiance=MeshAttribute(name="vertex_glow"))
    given = {"vertex_glow": colours}
    many = shapes.Spheres(
        centers=centers, radii=radii, material=black, attributes=given, emission=glow
    )
    singles = [
        shapes.Sphere(center=c, radius=r, material=black, emission=lights.Area(radiance=tuple(e)))
        for c, r, e in zip(centers, radii, colours, strict=True)
    ]
    floor = shapes.Rectangle(to_world=T.rotate([1, 0, 0], -90) @ T.scale(9.0))
    view = T.look_at([0, 3, 6], [0, 0.4, 0], [0, 1, 0])
    film = integrators.Film(width=48, height=48, mode="rgb")
    camera = cameras.Perspective(to_world=view, fov=40)
    found = [
        clpt.render(Scene(camera=camera, shapes=[floor, *lamps], film=film), 900).mean(axis=(0, 1))
        for lamps in ([many], singles)
    ]
    np.testing.assert_allclose(found[0], found[1], rtol=0.01)
