"""`path` whose pixels share second vertices makes the picture of `path`, with less noise.

Means over blocks of pixels, and over the picture, are compared by the spread of independent
exposures; see tests/pictures/support.py for the significance. Groups need eight lanes.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
import trimesh

import clpt
from clpt import device as dev
from clpt import transforms as tf
from clpt.errors import SceneError
from clpt.render.flow.scene_to_tables import lower
from clpt.render.flow.settings import SQUARE
from clpt.render.wavefront import path_buffers
from clpt.scene import Film, Scene, media
from clpt.scene import materials as m
from clpt.scene.cameras import Perspective
from clpt.scene.integrators import Box, Gaussian, Path
from clpt.scene.lights import Area
from clpt.scene.motion import Keys, Shutter
from clpt.scene.shapes import Cube, Disk, Group, Instance, Mesh, Rectangle, Shape, Sphere
from clpt.scene.textures import Bitmap, Checkerboard
from tests.pictures.support import assert_agree, blocks, exposures, quick, with_film
from tests.pictures.transport.test_light_tracing import BLACK, DOWN, UP

SEEDS = 12
GROUP = 8  # pixels, see kernels/transport/reuse.cl
WHITE = m.Diffuse(reflectance=0.8)


def wide(lanes: int = 8) -> dev.Device:
    device = dev.choose()
    device.lanes = lanes
    return device


def lamp(at: tuple[float, float, float] = (0.1, 1.98, 0.0), radiance: float = 10.0) -> Disk:
    place = tf.translate(at) @ DOWN @ tf.scale(0.4)
    return Disk(to_world=place, material=BLACK, emission=Area(radiance=radiance))


def wall(turn: tuple[list[float], float], material: m.Material) -> Rectangle:
    """A side of a cube of 2 m that stands on the origin; turn: of the back wall."""
    place = tf.translate([0, 1, 0]) @ tf.rotate(*turn) @ tf.translate([0, 0, -1])
    return Rectangle(to_world=place, material=material)


def walls(**changed: m.Material) -> dict[str, Shape]:
    """Five sides of a room, open toward the camera."""
    materials = {
        "back": WHITE,
        "floor": WHITE,
        "ceiling": WHITE,
        "left": m.Diffuse(reflectance=(0.63, 0.06, 0.05)),
        "right": m.Diffuse(reflectance=(0.14, 0.45, 0.09)),
        **changed,
    }
    turns: dict[str, tuple[list[float], float]] = {
        "back": ([1, 0, 0], 0),
        "floor": ([1, 0, 0], -90),
        "ceiling": ([1, 0, 0], 90),
        "left": ([0, 1, 0], 90),
        "right": ([0, 1, 0], -90),
    }
    return {name: wall(turns[name], materials[name]) for name in turns}


def room(*more: Shape, sides: dict[str, Shape] | None = None, **film: Any) -> Scene:
    """A room with a lamp below its ceiling, and with `more` shapes."""
    view = tf.look_at([0.0, 1.0, 3.6], [0.0, 1.0, 0.0], UP)
    return Scene(
        camera=Perspective(to_world=view, fov=40, fov_axis="y"),
        shapes=[*(sides or walls()).values(), lamp(), *more],
        film=Film(**{"width": 24, "height": 24, "mode": "rgb", **film}),
    )


def coarse(radius: float, at: tuple[float, float, float], material: m.Material) -> Mesh:
    """A ball of 80 triangles, whose smooth normals are far from those of its faces."""
    shape = trimesh.creation.icosphere(subdivisions=1, radius=radius)
    vertices = np.asarray(shape.vertices, np.float32)
    return Mesh(
        vertices=vertices,
        faces=np.asarray(shape.faces, np.uint32),
        normals=vertices / radius,
        to_world=tf.translate(at),
        material=material,
    )


def boxes() -> list[Shape]:
    tall = tf.translate([-0.4, 0.6, -0.4]) @ tf.rotate([0, 1, 0], 20) @ tf.scale([0.3, 0.6, 0.3])
    low = tf.translate([0.4, 0.3, 0.3]) @ tf.rotate([0, 1, 0], -15) @ tf.scale(0.3)
    return [Cube(to_world=place, material=WHITE) for place in (tall, low)]


def cornell(mode: str) -> Scene:
    return room(*boxes(), mode=mode)


def smooth(mode: str) -> Scene:
    """Balls with smooth normals, and a sheet whose back is black and one whose back is as bright.

    Sheets are seen from both sides: they stand upright.
    """
    two_sided = m.TwoSided(front=m.Diffuse(reflectance=(0.7, 0.3, 0.2)))
    sheets = [
        Rectangle(
            to_world=tf.translate([x, 0.3, 0.5]) @ tf.rotate([0, 1, 0], turn) @ tf.scale(0.3),
            material=material,
        )
        for x, turn, material in ((-0.6, 120.0, two_sided), (0.6, 240.0, WHITE))
    ]
    balls = [
        coarse(0.5, (-0.4, 0.6, -0.3), WHITE),
        coarse(0.4, (0.5, 0.5, -0.2), m.TwoSided(front=WHITE)),
    ]
    return room(*balls, *sheets, mode=mode)


def tilted(mode: str) -> Scene:
    """A floor whose shading normals are its own on the left, and far off on the right.

    There many directions about the shading normal go below the floor.
    """
    lean = np.radians(70.0)
    parts = [
        Mesh(
            vertices=np.array([(x, 0, 1), (x + 1, 0, 1), (x + 1, 0, -1), (x, 0, -1)], np.float32),
            faces=np.array([(0, 1, 2), (0, 2, 3)], np.uint32),
            normals=np.tile(np.array(normal, np.float32), (4, 1)),
            material=WHITE,
        )
        for x, normal in ((-1, (0, 1, 0)), (0, (np.sin(lean), np.cos(lean), 0)))
    ]
    sides = walls()
    del sides["floor"]
    scene = room(*parts, sides=sides, mode=mode)
    view = tf.look_at([0.0, 1.0, 1.0], [0.0, 0.0, 0.0], UP)
    return dataclasses.replace(scene, camera=Perspective(to_world=view, fov=50, fov_axis="y"))


def textured(mode: str) -> Scene:
    """Black texels, and texels of a single channel."""
    image = np.random.default_rng(3).random((8, 8, 3)).astype(np.float32)
    image[::2, ::2] = 0.0
    image[1::2, ::2] = (1.0, 0.0, 0.0)
    image[::2, 1::2] = (0.0, 0.9, 0.0)
    painted = m.Diffuse(reflectance=Bitmap(image=image, filter="nearest"))
    chess = m.Diffuse(reflectance=Checkerboard(color0=(0.0, 0.0, 0.9), color1=(0.9, 0.7, 0.0)))
    sides = walls(back=painted, floor=chess, left=m.Diffuse(reflectance=(0.9, 0.0, 0.0)))
    return room(*boxes(), sides=sides, mode=mode)


def masked(mode: str) -> Scene:
    """Sheets that let a part of the light pass, across the room and before the camera."""
    half = m.Mask(material=m.Diffuse(reflectance=(0.3, 0.7, 0.7)), opacity=0.5)
    holes = m.Mask(material=m.TwoSided(front=WHITE), opacity=Checkerboard(color0=0.0, color1=1.0))
    across = tf.translate([0, 1.2, 0]) @ tf.rotate([1, 0, 0], -90)
    before = tf.translate([0.5, 0.8, 0.7]) @ tf.rotate([0, 1, 0], 30) @ tf.scale(0.4)
    upright = tf.translate([-0.3, 1, 0]) @ tf.rotate([0, 1, 0], 70)
    sheets = [
        Rectangle(to_world=across @ tf.scale(0.7), material=half),
        Rectangle(to_world=before, material=holes),
        Rectangle(to_world=upright @ tf.scale(0.5), material=m.Null()),
    ]
    return room(*sheets, mode=mode)


def instanced(mode: str) -> Scene:
    group = Group(shapes=[coarse(0.3, (0, 0, 0), WHITE), *boxes()])
    places = [
        tf.translate([-0.5, 0.3, 0.0]) @ tf.scale([0.8, 0.6, 0.8]),
        tf.translate([0.5, 0.9, -0.2]) @ tf.rotate([0, 0, 1], 50) @ tf.scale([0.5, 0.9, 0.6]),
    ]
    return room(*(Instance(group=group, to_world=place) for place in places), mode=mode)


def shining(mode: str) -> Scene:
    """A part of a wall shines, and reflects."""
    corners = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], np.float32)
    faces = np.array([(0, 1, 2), (0, 2, 3)], np.uint32)
    part = Mesh(
        vertices=corners,
        faces=faces,
        to_world=tf.translate([0.2, 0.9, -0.99]) @ tf.scale(0.5),
        material=WHITE,
        emission=Area(radiance=(2.0, 1.0, 0.5)),
    )
    return room(part, *boxes(), mode=mode)


def mixed(mode: str) -> Scene:
    """Glass and rough metal among diffuse things, and plastic."""
    glass = m.RoughDielectric(int_ior=1.5, alpha_u=0.3, alpha_v=0.3)
    metal = m.RoughConductor(alpha_u=0.3, alpha_v=0.3)
    things = [
        Sphere(center=(-0.4, 0.4, 0.2), radius=0.35, material=glass),
        Sphere(center=(0.5, 0.4, -0.1), radius=0.35, material=metal),
    ]
    return room(*things, *boxes()[:1], sides=walls(right=m.RoughPlastic(alpha=0.3)), mode=mode)


def coated(mode: str) -> Scene:
    """Plastics, smooth and rough, whose coats turn dark and bright toward the horizon."""
    sides = walls(
        back=m.RoughPlastic(alpha=0.3, diffuse_reflectance=(0.7, 0.5, 0.3)),
        floor=m.RoughPlastic(alpha=0.1, distribution="beckmann", diffuse_reflectance=0.8),
        ceiling=m.Plastic(diffuse_reflectance=0.8, int_ior=1.8),
        left=m.RoughPlastic(alpha=0.6, int_ior=2.2, nonlinear=True, diffuse_reflectance=0.7),
        right=m.RoughPlastic(alpha=0.2, int_ior=1.0, ext_ior=1.3, diffuse_reflectance=0.6),
    )
    return room(*boxes(), coarse(0.3, (0.3, 1.2, 0.0), m.Plastic()), sides=sides, mode=mode)


KINDS = (cornell, smooth, tilted, textured, masked, instanced, shining, mixed, coated)
ROOMS = {scene.__name__: scene for scene in KINDS}


def sharing(scene: Scene, **path: Any) -> Scene:
    return dataclasses.replace(scene, integrator=Path(reuse=True, light_paths=0, **path))


def alone(scene: Scene, **path: Any) -> Scene:
    return dataclasses.replace(scene, integrator=Path(light_paths=0, **path))


def both(scene: Scene, spp: int, what: str, lanes: int = 8, **path: Any) -> None:
    """Compare blocks of a scene, and the mean of its picture, with and without reuse."""
    ours = sharing(scene, **path)
    assert lower(ours).features.film.reuse
    made = exposures(ours, SEEDS, spp, first_seed=101, device=wide(lanes))
    reference = exposures(alone(scene, **path), SEEDS, spp, device=wide())
    assert_agree(blocks(made), blocks(reference), what)
    means = [np.mean(images, axis=(1, 2), keepdims=True) for images in (made, reference)]
    assert_agree(*means, f"mean of {what}")


@pytest.mark.parametrize("mode", ["rgb", pytest.param("spectral", marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", ROOMS)
def test_means_are_those_without(name: str, mode: str) -> None:
    both(ROOMS[name](mode), 128, name, max_depth=4)


@pytest.mark.parametrize("cls", [cls for cls in m.LEAVES if cls.has_diffuse_lobe])
def test_means_of_each_kind_are_those_without(cls: type[m.Material]) -> None:
    """Walls and boxes of the kind, as its defaults are."""
    sides = walls(**dict.fromkeys(("back", "floor", "ceiling", "left", "right"), cls()))
    both(room(*boxes(), sides=sides), 128, cls.__name__, max_depth=4)


@pytest.mark.parametrize("chosen", [Box(radius=1.2), Gaussian()], ids=lambda f: f.kind)
@pytest.mark.parametrize("mode", ["rgb", pytest.param("spectral", marks=pytest.mark.slow)])
def test_means_under_wide_filters_are_those_without(mode: str, chosen: Any) -> None:
    both(with_film(cornell(mode), filter=chosen), 64, chosen.kind, max_depth=4)


@pytest.mark.slow
@pytest.mark.parametrize("path", [{"max_depth": 3}, {"max_depth": -1, "rr_depth": 1}])
def test_means_at_other_depths_are_those_without(path: dict[str, int]) -> None:
    both(textured("rgb"), 64, f"{path}", **path)


@pytest.mark.slow
@pytest.mark.parametrize("lanes", [1, 16])
def test_means_of_other_lanes_are_those_without(lanes: int) -> None:
    both(tilted("rgb"), 64, f"{lanes} lanes", lanes=lanes, max_depth=4)


@pytest.mark.parametrize(
    "material, most",
    [(WHITE, 0.55), (m.RoughPlastic(alpha=0.3, diffuse_reflectance=0.8), 0.8)],
    ids=["diffuse", "rough_plastic"],
)
def test_noise_falls_where_light_comes_indirectly(material: m.Material, most: float) -> None:
    """The lamp shines on the ceiling alone, above a screen. Measured: 0.47, 0.68."""
    up = tf.translate([0.0, 1.55, 0.0]) @ tf.rotate([1, 0, 0], -90)
    lit = Disk(to_world=up @ tf.scale(0.2), material=BLACK, emission=Area(radiance=20.0))
    screen = Rectangle(to_world=up @ tf.translate([0, 0, -0.02]) @ tf.scale(0.4), material=BLACK)
    sides = walls(**dict.fromkeys(("back", "floor", "ceiling", "left", "right"), material))
    scene = dataclasses.replace(cornell("rgb"), shapes=[*sides.values(), lit, screen])
    errors = []
    for own in (alone(scene, max_depth=4), sharing(scene, max_depth=4)):
        made = exposures(own, SEEDS, 16, device=wide())[:, 4:20, 4:20]
        errors.append(np.median(made.std(axis=0, ddof=1) / made.mean(axis=0)))
    assert errors[1] < most * errors[0], errors


def picture(scene: Scene, *runs: int, lanes: int = 8, **options: Any) -> np.ndarray:
    with clpt.Renderer(scene, wide(lanes), **options) as renderer:
        for samples in runs:
            renderer.run(samples)
        return renderer.image()


SPLIT = sharing(with_film(cornell("rgb"), width=21, height=13, filter=Gaussian()))


@pytest.fixture(scope="module")
def whole(one_context: None) -> np.ndarray:
    """Seven samples of SPLIT."""
    return picture(SPLIT, 7)


@pytest.mark.parametrize(
    "runs, options",
    [((3, 4), {}), ((7,), {"slots": 128}), ((7,), {"slots": 64}), ((7,), {"looped": False})],
)
def test_however_samples_are_split_bits_stay(whole: Any, runs: Any, options: Any) -> None:
    assert whole.any()
    assert np.array_equal(picture(SPLIT, *runs, **options), whole)


def test_films_that_are_merged_have_the_bits_of_one(whole: np.ndarray) -> None:
    parts = [clpt.Renderer(SPLIT, wide(), first_sample=first) for first in (0, 3)]
    for part, samples in zip(parts, (3, 4), strict=True):
        part.run(samples)
    parts[0].merge(parts[1].film_state())
    assert np.array_equal(parts[0].image(), whole)


def test_steps_have_the_bits_of_a_run(whole: np.ndarray) -> None:
    renderer = clpt.Renderer(SPLIT, wide())
    for samples in (5, 2):
        event = renderer.step(samples)
    event.wait()
    assert np.array_equal(renderer.film.get()[..., :3], whole)
    renderer.reset()
    renderer.run(7)
    assert np.array_equal(renderer.image(), whole)


@pytest.mark.parametrize("crop", [(5, 3, 9, 7), (0, 0, 3, 13), (17, 9, 4, 4)])
def test_a_crop_has_the_bits_of_the_whole(whole: Any, crop: Any) -> None:
    x, y, width, height = crop
    part = picture(with_film(SPLIT, crop=crop), 7)
    assert np.array_equal(part, whole[y : y + height, x : x + width])


@pytest.mark.slow
@pytest.mark.parametrize(
    "film", [{"filter": Box()}, {"filter": Gaussian(), "filtering": "importance"}]
)
def test_a_crop_without_splatting_has_the_bits_of_the_whole(film: dict[str, Any]) -> None:
    scene = with_film(SPLIT, **film)
    part = picture(with_film(scene, crop=(5, 3, 9, 7)), 3)
    assert np.array_equal(part, picture(scene, 3)[3:10, 5:14])


def test_pictures_that_share_differ_from_others() -> None:
    scene = cornell("rgb")
    assert not np.array_equal(picture(sharing(scene), 1), picture(alone(scene), 1))


def apart(name: str) -> Scene:
    """A scene whose paths are told apart by what the name says."""
    scene = cornell("spectral" if name == "dispersion" else "rgb")
    ways = Keys([0.0, 1.0], [np.eye(4), tf.translate([0.3, 0.1, 0.0])])
    glass = m.RoughDielectric(int_ior="sf11", alpha_u=0.3, alpha_v=0.3)
    changes: dict[str, dict[str, Any]] = {
        "noise": {"noise": 0.02},
        "motion": {
            "camera": dataclasses.replace(scene.camera, motion=ways, shutter=Shutter(0.0, 1.0))
        },
        "medium": {
            "camera": dataclasses.replace(
                scene.camera, medium=media.Homogeneous(sigma_t=0.1, albedo=0.5)
            )
        },
        "layers": {"film": dataclasses.replace(scene.film, layers=("direct",))},
        "dispersion": {"shapes": [*scene.shapes, Sphere(radius=0.3, material=glass)]},
    }
    return dataclasses.replace(scene, **changes[name])


@pytest.mark.parametrize(
    "name", quick(("noise", "motion", "medium", "layers", "dispersion"), "noise")
)
def test_paths_that_differ_share_nothing(name: str) -> None:
    ours, without = sharing(apart(name)), alone(apart(name))
    assert lower(ours).features == lower(without).features
    assert np.array_equal(picture(ours, 8), picture(without, 8))


@pytest.mark.parametrize(
    "beside", [{"light_paths": 1}, {"guiding": True}, {"guiding": True, "light_paths": 0}]
)
def test_other_ways_to_find_light_are_refused(beside: dict[str, Any]) -> None:
    with pytest.raises(SceneError, match=r"path\.reuse"):
        Path(reuse=True, **beside)


def test_denoisers_get_pictures_that_share_nothing() -> None:
    for own in (Path(reuse=True), Path(reuse=True, light_paths=0, max_depth=5)):
        asked = own.for_denoiser()
        assert isinstance(asked, Path) and not asked.reuse
        assert (asked.max_depth, asked.light_paths) == (own.max_depth, own.light_paths)


@pytest.mark.parametrize("chosen", [Box(), Gaussian()], ids=lambda f: f.kind)
@pytest.mark.parametrize(
    "width, height, crop",
    [(16, 8, None), (21, 13, None), (21, 13, (5, 3, 9, 7)), (40, 30, (13, 9, 1, 20))],
)
def test_groups_are_squares_of_the_film(width: int, height: int, crop: Any, chosen: Any) -> None:
    film = {"width": width, "height": height, "crop": crop, "filter": chosen}
    scene = sharing(with_film(cornell("rgb"), **film))
    settings = lower(scene).settings
    order = path_buffers.in_groups(settings, chosen.reach)
    x, y = path_buffers.pixels(settings)
    at = np.stack([x + int(settings["crop_x"]), y + int(settings["crop_y"])])[:, order]
    assert len(np.unique(order)) == len(order) and len(order) % SQUARE**2 == 0
    squares = (at // SQUARE).reshape(2, -1, GROUP)
    assert (squares == squares[..., :1]).all()
    inside = (x >= -chosen.reach) & (x < int(settings["width"]) + chosen.reach)
    inside &= (y >= -chosen.reach) & (y < int(settings["height"]) + chosen.reach)
    assert np.isin(np.flatnonzero(inside), order).all()  # each pixel that adds to the picture
