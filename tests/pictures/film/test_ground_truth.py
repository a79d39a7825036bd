"""Layers as ground truth: each beside ray queries through the middles of pixels, in each situation.

docs/ground_truth.md has the same rows: what is looked through, and what is seen.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import clpt
from clpt import device as dev
from clpt import transforms as tf
from clpt.scene import Film, Scene, media, textures
from clpt.scene.cameras import Orthographic, Perspective
from clpt.scene.integrators import Auto, Box, Direct, Integrator, Path, Vcm
from clpt.scene.lights import Area, Constant
from clpt.scene.materials import (
    Blend,
    Dielectric,
    Diffuse,
    GltfSurface,
    Mask,
    Material,
    Null,
    RoughDielectric,
    ThinDielectric,
)
from clpt.scene.motion import Keys, Shutter
from clpt.scene.shapes import Cube, Curves, Disk, Group, Instance, Mesh, Rectangle, Shape, Sphere
from tests.pictures.support import quick

SIZE, EYE, NEAR = 24, 4.0, 1e-2
LAYERS = ("albedo", "shading_normal", "geometric_normal", "depth", "z", "position", "uv",
          "shape_id", "primitive_id", "material_id", "crypto_object")  # fmt: skip
CENTRES = {"filter": Box(radius=0.01), "filtering": "importance"}
PLAIN = Path(max_depth=6, light_paths=0)
RED, BLUE = (0.7, 0.2, 0.1), (0.1, 0.2, 0.6)
SKY = [Constant(radiance=1.0)]


def hills(rows: int = 9) -> tuple[np.ndarray, np.ndarray]:
    """A wavy sheet from -1 to 1: vertices and faces, of which every fourth has no area."""
    x, y = np.meshgrid(np.linspace(-1, 1, rows), np.linspace(-1, 1, rows))
    vertices = np.stack([x, y, 0.2 * np.sin(3 * x) * np.cos(2 * y)], axis=2).reshape(-1, 3)
    first = (np.arange(rows - 1)[:, None] * rows + np.arange(rows - 1)).reshape(-1)
    corners = np.array([[0, 1, rows + 1], [0, rows + 1, rows]])
    faces = (first[:, None, None] + corners).reshape(-1, 3)
    return vertices, np.insert(faces, np.arange(0, len(faces), 3), [0, 0, 1], axis=0)


SHEET, SHEET_FACES = hills()
SQUARE = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float)
HALVES = np.array([[0, 1, 2], [0, 2, 3]])
MESHES = {
    "sheet": (SHEET, SHEET_FACES, Diffuse(reflectance=RED, name="red")),
    "wall": (SQUARE * 5 - [0, 0, 1], HALVES, Diffuse(reflectance=BLUE, name="blue")),
}


def mesh(name: str, **options: Any) -> Mesh:
    vertices, faces, material = MESHES[name]
    uvs = vertices[:, :2] * 0.5 + 0.5
    return Mesh(vertices=vertices, faces=faces, uvs=uvs, material=material, name=name, **options)


def scene(
    more: list[Shape], integrator: Integrator = PLAIN, layers: Any = LAYERS, **options: Any
) -> Scene:
    film = {"width": SIZE, "height": SIZE, "mode": "rgb", **CENTRES, **options.pop("film", {})}
    camera = Perspective(origin=(0, 0, EYE), target=(0, 0, 0), fov=45, near=NEAR)
    return Scene(
        **{"camera": camera, "lights": SKY, **options},
        shapes=[mesh("sheet"), mesh("wall"), *more],
        integrator=integrator,
        film=Film(layers=layers, **film),
    )


def layers_of(one: Scene, spp: int = 16, **options: Any) -> dict[str, np.ndarray]:
    with clpt.Renderer(one, **options) as renderer:
        renderer.run(spp)
        return renderer.layers()


def rays(shift: float = 0.0) -> np.ndarray:
    """Directions through the middles of the pixels, or beside them [pixels]."""
    x = np.tan(np.radians(22.5)) * (2.0 * (np.arange(SIZE) + 0.5) / SIZE - 1.0)
    x = x + shift * 2.0 * np.tan(np.radians(22.5)) / SIZE
    d = np.stack([*np.meshgrid(x, -x), -np.ones((SIZE, SIZE))], axis=2).reshape(-1, 3)
    return d / np.linalg.norm(d, axis=1, keepdims=True)


def queried(panes: tuple[np.ndarray, ...]) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """What ray queries tell of the meshes and of panes before them; the pixels without edges.

    panes: vertices of two triangles each, which come behind the meshes in the scene.
    """
    parts = [(v, f) for v, f, _ in MESHES.values()] + [(pane, HALVES) for pane in panes]
    counts = np.cumsum([0, *(len(v) for v, _ in parts)])
    faces = np.concatenate([f + first for (_, f), first in zip(parts, counts, strict=False)])
    shape = np.repeat(np.arange(len(parts)), [len(f) for _, f in parts])
    row = np.concatenate([np.arange(len(f)) for _, f in parts])
    vertices = np.concatenate([v for v, _ in parts])
    with clpt.Accel(dev.choose().queue, vertices, faces) as accel:
        origins = np.tile([0.0, 0.0, EYE], (SIZE * SIZE, 1))
        hits = accel.intersect(origins, rays())
        beside = [accel.intersect(origins, rays(s)).primitive for s in (-0.02, 0.02)]
    inner = (beside[0] == hits.primitive) & (beside[1] == hits.primitive)
    d, t = rays(), hits.t.astype(np.float64)
    a, b, c = (vertices[faces[hits.primitive, i]] for i in range(3))
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    own, position = shape[hits.primitive], np.array([0, 0, EYE]) + t[:, None] * d
    found = {
        "depth": t - NEAR / -d[:, 2], "z": EYE - position[:, 2], "position": position,
        "geometric_normal": normal, "shading_normal": normal, "shape_id": own,
        "primitive_id": row[hits.primitive],
        "uv": np.where(own[:, None] < 2, position[:, :2] * 0.5 + 0.5, np.nan),
        "albedo": np.where(own[:, None] == 0, RED, np.where(own[:, None] == 1, BLUE, np.nan)),
        "material_id": np.minimum(own, 2),
    }  # fmt: skip
    return {name: v.reshape(SIZE, SIZE, -1) for name, v in found.items()}, inner.reshape(SIZE, SIZE)


def check(made: dict[str, np.ndarray], panes: tuple[np.ndarray, ...] = ()) -> None:
    """Hold layers against ray queries."""
    wanted, inner = queried(panes)
    assert inner.mean() > 0.8
    for name, values in wanted.items():
        if name not in made:
            continue
        told = np.isfinite(values).all(axis=2) & inner
        exact = name.endswith("_id")
        tolerance = 0.0 if exact else 2e-3
        np.testing.assert_allclose(
            made[name][told], values[told], atol=tolerance, rtol=0, err_msg=name
        )
    names = np.sort(made["crypto_object"][inner][:, 1::2], axis=1)[:, -1]
    np.testing.assert_allclose(names, 1.0, err_msg="one name has the whole pixel")


BEFORE = tf.translate([0, 0, 2]) @ tf.scale([4, 4, 0.5])
NEARER = SQUARE * [0.5, 0.9, 1] + [0.3, 0, 1.5]  # a pane before the middle


def fog(*, absorbs: float = 0.0, scatters: float = 0.0) -> Cube:
    inside = media.Homogeneous(sigma_a=absorbs, sigma_s=scatters)
    return Cube(to_world=BEFORE, material=Null(), interior=inside)


def hole(opacity: Any) -> Mesh:
    material = Mask(opacity=opacity, material=Diffuse(reflectance=0.9))
    return Mesh(vertices=NEARER, faces=HALVES, uvs=SQUARE[:, :2] * 0.5 + 0.5, material=material)


def lamp(**options: Any) -> Mesh:
    return Mesh(vertices=NEARER, faces=HALVES, emission=Area(radiance=3.0), **options)


HIDES = Path(max_depth=6, light_paths=0, hide_lights=True)
HAZE = media.Homogeneous(sigma_a=0.05, sigma_s=0.15)
GRID = media.Grid(density=np.full((4, 4, 4), 1.0, np.float32), sigma_a=0.1, sigma_s=0.4)
THROUGH: dict[str, dict[str, Any]] = {
    "nothing": {"more": []},
    "fog": {"more": [fog(scatters=0.5)]},
    "thick fog": {"more": [fog(scatters=3.0)]},
    "smoke": {"more": [fog(absorbs=2.0)]},
    "a cloud": {"more": [Cube(to_world=BEFORE, material=Null(), interior=GRID)]},
    "haze around the camera": {"more": [], "medium": HAZE},
    "a mask that is open": {"more": [hole(0.0)]},
    "a hidden lamp": {"more": [lamp()], "integrator": HIDES},
    "two hidden lamps in fog": {
        "more": [fog(scatters=0.5), lamp(), lamp(to_world=tf.translate([0, 0, -0.2]))],
        "integrator": HIDES,
    },
}  # fmt: skip
"""What layers look through: what lies behind is seen as if that were not there."""


@pytest.mark.parametrize("what", quick(THROUGH, "two hidden lamps in fog", "a mask that is open"))
def test_what_is_looked_through(what: str) -> None:
    given = dict(THROUGH[what])
    medium = given.pop("medium", None)
    if medium is not None:
        camera = Perspective(origin=(0, 0, EYE), target=(0, 0, 0), fov=45, near=NEAR, medium=medium)
        given["camera"] = camera
    check(layers_of(scene(**given)))


THIN = GltfSurface(transmission=1.0, roughness=0.0)
SEEN: dict[str, Material] = {
    "thin_dielectric": ThinDielectric(),
    "dielectric": Dielectric(),
    "rough_dielectric": RoughDielectric(alpha=0.2),
    "thin gltf": THIN,
    "a mask that is rather closed": Mask(opacity=1.0, material=Diffuse()),
    "a blend": Blend(weight=0.5, first=Diffuse(), second=ThinDielectric()),
}


@pytest.mark.parametrize("what", quick(SEEN, "thin_dielectric", "dielectric"))
def test_what_is_seen(what: str) -> None:
    """Glass is a surface, thin or not, however much light goes through it; so is a shown lamp."""
    pane = Mesh(vertices=NEARER, faces=HALVES, material=SEEN[what])
    check(layers_of(scene([pane])), (NEARER,))


@pytest.mark.slow
def test_a_shown_lamp_is_seen() -> None:
    check(layers_of(scene([lamp()])), (NEARER,))


HOW: dict[str, tuple[Integrator, dict[str, Any]]] = {
    "vcm": (Vcm(), {}),
    "direct": (Direct(), {}),
    "auto": (Auto(), {}),
    "light paths": (Path(light_paths=1.0), {}),
    "spectral": (PLAIN, {"film": {"mode": "spectral"}}),
}


@pytest.mark.parametrize("how", quick(HOW, "spectral"))
def test_whatever_makes_the_picture(how: str) -> None:
    integrator, options = HOW[how]
    made = layers_of(scene([fog(scatters=0.5), hole(0.0)], integrator, **options))
    if how == "spectral":  # four wavelengths of a sample tell colours with noise
        albedo = made.pop("albedo")
        assert np.abs(albedo.mean(axis=(0, 1)) - scene_albedo()).max() < 0.03
    check(made)


def scene_albedo() -> np.ndarray:
    """The mean colour of what is seen, by ray queries."""
    return queried(())[0]["albedo"].mean(axis=(0, 1))


@pytest.mark.slow
def test_the_same_bits_in_pieces() -> None:
    """Fog, a pane and a mask: one run, and others of another form."""
    pane = Mesh(vertices=NEARER, faces=HALVES, material=ThinDielectric())
    one = scene([fog(scatters=0.5), pane, hole(0.4)], layers=(*LAYERS, "denoising_albedo"))
    once = layers_of(one, 70)
    with clpt.Renderer(one, looped=False, slots=128) as other:
        other.run(3)
        other.step(60)
        other.run(7)
        split = other.layers()
    for name, values in once.items():
        np.testing.assert_array_equal(values, split[name], err_msg=name)


@pytest.mark.slow
def test_the_picture_is_that_without_layers() -> None:
    """Paths that go ahead leave no trace in it."""
    nearer = np.add(NEARER, (0, 0, 0.1))
    pane = Mesh(vertices=nearer, faces=HALVES, material=ThinDielectric())
    things = [fog(scatters=0.5), hole(0.4), pane]
    pictures = [clpt.render(scene(things, layers=layers), 6) for layers in ((), LAYERS)]
    np.testing.assert_array_equal(*pictures)


@pytest.mark.parametrize("opacity", [0.7, pytest.param(0.3, marks=pytest.mark.slow)])
def test_a_mask_counts_by_its_half_in_ids_and_by_its_share_in_mattes(opacity: float) -> None:
    made = layers_of(scene([hole(opacity)]), 64)
    wanted, inner = queried((NEARER,))
    before = (wanted["shape_id"][..., 0] == 2) & inner
    behind = queried(())[0]
    assert set(np.unique(made["shape_id"][before])) == (
        {2.0} if opacity > 0.5 else set(np.unique(behind["shape_id"][before]).astype(float))
    )
    pairs = made["crypto_object"][before]
    nearer = np.abs(pairs[:, 1::2] - opacity).min(axis=1)
    assert nearer.max() <= 2 / 64  # the samples of a pixel are spread evenly
    depth = opacity * wanted["depth"][before] + (1 - opacity) * behind["depth"][before]
    np.testing.assert_allclose(made["depth"][before], depth, atol=0.1)


# ---- cameras and shapes that move


@pytest.mark.parametrize("kind", [Perspective, pytest.param(Orthographic, marks=pytest.mark.slow)])
def test_z_of_a_camera_that_moves(kind: Any) -> None:
    """It backs from 6 to 9 m while the shutter is open, turns aside, and grows."""
    wall = Rectangle(to_world=tf.translate([0, 0, -1]) @ tf.scale(90))
    moves = Keys([0, 1], [np.eye(4), tf.translate([0, 0, 3])])
    place = tf.look_at([0, 0, 6], [0, 0, 0], [0, 1, 0])
    camera = kind(to_world=place, near=NEAR, shutter=Shutter(0, 1), motion=moves)
    film = Film(width=9, height=9, mode="rgb", layers=("z", "depth", "position"), **CENTRES)
    one = Scene(camera=camera, shapes=[wall], film=film, integrator=PLAIN)
    made = layers_of(one, 64)
    np.testing.assert_allclose(made["z"], 8.5, atol=0.05)
    np.testing.assert_allclose(made["depth"][4, 4], 8.5 - NEAR, atol=0.05)
    np.testing.assert_allclose(made["position"][..., 2], -1.0, atol=1e-5)


@pytest.mark.slow
def test_z_after_a_camera_was_moved_with_blur() -> None:
    wall = Rectangle(to_world=tf.translate([0, 0, -1]) @ tf.scale(90))
    given = {"target": (0, 0, 0), "near": NEAR, "shutter": Shutter(0, 1)}
    cameras = [Perspective(origin=(0, 0, z), **given) for z in (6, 9)]
    film = Film(width=9, height=9, mode="rgb", layers=("z", "depth"), **CENTRES)
    with clpt.Renderer(Scene(camera=cameras[0], shapes=[wall], film=film, integrator=PLAIN)) as r:
        r.update(camera=cameras[1], motion=True)
        r.run(64)
        made = r.layers()
    np.testing.assert_allclose(made["z"], 8.5, atol=0.05)
    np.testing.assert_allclose(made["depth"][4, 4], 8.5 - NEAR, atol=0.05)


# ---- sizes


@pytest.mark.parametrize("size", [1e-6, 1e-4, 1.0, 1e5, 1e9, 1e11])
def test_places_of_things_of_any_size(size: float) -> None:
    """A ball around the origin: its points in all octants, to float32."""
    eye = np.array([-2.5, -2.0, 1.5]) * size
    camera = Perspective(
        origin=tuple(eye), target=(0, 0, 0), fov=45, near=size * 1e-2, far=1e3 * size
    )
    names = ("position", "depth", "z", "shape_id")
    film = Film(width=15, height=15, mode="rgb", layers=names, **CENTRES)
    one = Scene(camera=camera, shapes=[Sphere(radius=size)], film=film, integrator=PLAIN)
    made = layers_of(one)
    hit = made["shape_id"][..., 0] == 0
    p = made["position"][hit].astype(np.float64) / size
    assert hit.sum() > 50 and (p < 0).any() and (p > 0).any()
    np.testing.assert_allclose(np.linalg.norm(p, axis=1), 1.0, atol=2e-4)
    far = np.linalg.norm(p - eye / size, axis=1)
    axis = -eye / np.linalg.norm(eye)
    z = (p - eye / size) @ axis
    np.testing.assert_allclose(made["z"][hit, 0] / size, z, rtol=1e-4)
    np.testing.assert_allclose(made["depth"][hit, 0] / size, far - 0.01 * far / z, rtol=1e-4)


# ---- rows of faces and strands


def ids_by_place(things: list[Shape], spp: int = 4) -> tuple[np.ndarray, np.ndarray]:
    """Ids of primitives and places, of what is seen."""
    film = Film(width=48, height=48, mode="rgb", layers=("primitive_id", "position"), **CENTRES)
    camera = Perspective(origin=(0, 0, 8), target=(0, 0, 0), fov=40)
    made = layers_of(Scene(camera=camera, shapes=things, film=film, integrator=PLAIN), spp)
    hit = made["primitive_id"][..., 0] >= 0
    return made["primitive_id"][hit][:, 0].astype(int), made["position"][hit]


FLAT = np.array([[0, 0, 1], [0, 1, 2], [3, 3, 3], [0, 2, 3]])
BIG = SQUARE * 2


@pytest.mark.parametrize("levels", [0, 2])
@pytest.mark.parametrize("placed", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_rows_of_faces_are_the_callers(levels: int, placed: bool) -> None:
    one = Mesh(vertices=BIG, faces=FLAT, subdivision=levels)
    things: list[Shape] = [one]
    if placed:
        group = Group(shapes=[one])
        things = [Instance(group=group, to_world=tf.translate([0, 0, z])) for z in (0, -1)]
    ids, p = ids_by_place(things)
    assert set(ids) == {1, 3}
    below = p[:, 0] - p[:, 1] > 0.1
    assert (ids[below] == 1).all() and (ids[p[:, 0] - p[:, 1] < -0.1] == 3).all()


def strands(**options: Any) -> Curves:
    points = [[x, y, 0, 0.2] for y in (-1, 0, 1) for x in (-2, -1, 1, 2)]
    return Curves(points=points, lengths=[4, 4, 4], **options)


@pytest.mark.parametrize(
    "how", quick(["as they are", "shine", "stretched", "often placed"], "as they are", "shine")
)
def test_strands_have_their_numbers(how: str) -> None:
    tubes = {
        "as they are": [strands()],
        "shine": [strands(emission=Area(radiance=1.0))],
        "stretched": [strands(to_world=tf.scale([1.0, 1.2, 1.0]))],
        "often placed": [Instance(group=Group(shapes=[strands()])) for _ in range(20)],
    }[how]
    ids, p = ids_by_place([*tubes, Disk(to_world=tf.translate([0, 0, -900]))])
    strand = np.rint(p[:, 1] / (1.2 if how == "stretched" else 1.0)) + 1
    assert set(ids) == {0, 1, 2}
    np.testing.assert_array_equal(ids[p[:, 2] > -1], strand[p[:, 2] > -1])


def test_a_stretched_ball_is_one_primitive() -> None:
    ball = Instance(group=Group(shapes=[Sphere()]), to_world=tf.scale([1, 1.5, 1]))
    assert set(ids_by_place([ball])[0]) == {0}


@pytest.mark.slow
def test_checkered_masks_have_the_ids_of_their_texels() -> None:
    """Where a texture says open, what is behind; where it says closed, the mask."""
    checks = textures.Checkerboard(color0=0.0, color1=1.0)
    made = layers_of(scene([hole(checks)]))
    wanted, inner = queried((NEARER,))
    before = (wanted["shape_id"][..., 0] == 2) & inner
    assert set(np.unique(made["shape_id"][before])) >= {0.0, 2.0}
