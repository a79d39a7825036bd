"""Paths from lights and paths from the camera make the same picture.

Means over blocks of pixels are compared by the spread of independent exposures; see
tests/pictures/support.py for the significance.
"""

from __future__ import annotations

import dataclasses
from pathlib import Path as FilePath
from typing import Any

import numpy as np
import pytest
import trimesh

import clpt
from clpt import transforms as tf
from clpt.device import choose
from clpt.errors import SceneError
from clpt.render.flow.scene_to_tables import lower
from clpt.scene import Film, Scene, kinds
from clpt.scene import materials as m
from clpt.scene.cameras import Camera, Orthographic, Perspective, ThinLens
from clpt.scene.integrators import Box, Filter, Lanczos, ParticleTracer, Path
from clpt.scene.lights import (
    Area,
    Constant,
    CubeMap,
    Directional,
    DirectionalArea,
    Envmap,
    Goniometric,
    Light,
    Point,
    Projector,
    Spot,
)
from clpt.scene.shapes import Cube, Cylinder, Disk, Mesh, Rectangle, Shape, Sphere
from clpt.scene.textures import Bitmap
from clpt.spectra import Tabulated, glass
from tests.pictures.support import assert_agree, assert_mean, blocks, exposures, with_film

ROOT = FilePath(__file__).parents[3]
MODES = ("rgb", "spectral")
UP = np.array([0.0, 1.0, 0.0])
VIEW = tf.look_at([0.0, 1.2, 3.2], [0.0, 0.4, 0.0], UP)
BLACK = m.Diffuse(reflectance=0.0)
DOWN = tf.rotate([1, 0, 0], 90)  # turns +z to -y


def ball(radius: float, center: tuple[float, float, float], material: m.Material) -> Mesh:
    """A coarse ball of triangles with smooth normals."""
    shape = trimesh.creation.icosphere(subdivisions=2, radius=radius)
    vertices = np.asarray(shape.vertices, np.float32)
    return Mesh(
        vertices=vertices,
        faces=np.asarray(shape.faces, np.uint32),
        normals=vertices / radius,
        to_world=tf.translate(center),
        material=material,
    )


def lit_shapes(on: dict[str, float]) -> list[Shape]:
    """A light of every shape, one in view; `on` tells their radiance."""

    def light(name: str) -> dict[str, Any]:
        v = on.get(name, 0.0)
        return {"material": BLACK, "emission": Area(radiance=(v, 0.8 * v, 0.5 * v)), "name": name}

    corners = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], np.float32)
    faces = np.array([(0, 1, 2), (0, 2, 3)], np.uint32)
    above = tf.translate([0.6, 1.9, 0.6]) @ DOWN
    return [
        Sphere(center=(0.9, 0.9, 0.3), radius=0.15, **light("sphere")),
        Disk(to_world=tf.translate([-0.8, 1.8, 0.5]) @ DOWN @ tf.scale(0.3), **light("disk")),
        Rectangle(to_world=above @ tf.scale([0.4, 0.2, 1.0]), **light("rectangle")),
        Mesh(vertices=corners, faces=faces, to_world=above @ tf.translate([0, 0.6, 0]) @ tf.scale(
            0.2), **light("mesh")),
        Cylinder(p0=(-0.5, 1.5, 0.8), p1=(0.2, 1.7, 0.8), radius=0.05, **light("cylinder")),
    ]  # fmt: skip


def lamps(on: dict[str, float]) -> list[Light]:
    """Every light off all shapes."""
    rgb = {name: (0.6 * v, v, v) for name, v in on.items()}
    image = np.zeros((8, 16, 3), np.float32)
    image[1:5, 6:9] = 4.0
    faces = [np.full((2, 2, 3), 0.2 * i, np.float32) for i in range(6)]
    spot = tf.look_at([0.4, 1.9, 0.9], [0.1, 0.0, 0.1], UP)
    black = (0.0, 0.0, 0.0)
    return [
        Point(position=(0.5, 1.7, 0.9), intensity=rgb.get("point", black)),
        Spot(to_world=spot, intensity=rgb.get("spot", black), cutoff=30.0, beam_width=12.0),
        Directional(direction=(0.3, -0.9, -0.4), irradiance=rgb.get("directional", black)),
        Constant(radiance=rgb.get("constant", black)),
        Envmap(image=image, scale=on.get("envmap", 0.0), to_world=tf.rotate([0, 1, 0], 130)),
        CubeMap(image=faces, scale=on.get("cube_map", 0.0)),
    ]


LIGHTS = {
    "sphere": 30.0, "disk": 10.0, "rectangle": 10.0, "mesh": 20.0, "cylinder": 10.0, "point": 3.0,
    "spot": 8.0, "directional": 2.0, "constant": 1.0, "envmap": 2.0, "cube_map": 1.0,
}  # fmt: skip


def still_life(mode: str, on: dict[str, float], camera: Camera | None = None) -> Scene:
    """A floor, a rough mirror behind it and two balls, in the light of those `on`."""
    shapes: list[Shape] = [
        Rectangle(to_world=tf.rotate([1, 0, 0], -90) @ tf.scale(1.5), material=m.Diffuse()),
        Rectangle(
            to_world=tf.translate([0, 0.8, -1.0]) @ tf.scale([1.5, 0.8, 1.0]),
            material=m.RoughConductor(alpha_u=0.4, alpha_v=0.4),
        ),
        ball(0.4, (-0.6, 0.4, 0.2), m.Diffuse(reflectance=(0.7, 0.3, 0.2))),
        Sphere(center=(0.35, 0.35, 0.3), radius=0.35, material=m.RoughPlastic(alpha=0.3)),
    ]
    return Scene(
        camera=camera or Perspective(to_world=VIEW, fov=50, fov_axis="y", offset_x=0.05),
        shapes=[*shapes, *lit_shapes(on)],
        lights=lamps(on),
        film=Film(width=16, height=12, mode=mode),
    )


def both(scene: Scene, spp: int, what: str, *, many: int = 1, depth: int = 4, **kw: Any) -> None:
    """Compare the two integrators on a scene; `many`: light paths for one of the camera's."""
    from_camera = dataclasses.replace(scene, integrator=Path(max_depth=depth))
    from_lights = dataclasses.replace(scene, integrator=ParticleTracer(max_depth=depth))
    reference = blocks(exposures(from_camera, 12, spp))
    assert_agree(blocks(exposures(from_lights, 12, many * spp, **kw)), reference, what)


@pytest.mark.slow
@pytest.mark.parametrize("kind", LIGHTS)
def test_every_light(kind: str) -> None:
    """Diffuse, rough and smoothed surfaces under one kind of light."""
    both(still_life("rgb", {kind: LIGHTS[kind]}), 16, kind)


@pytest.mark.slow
def test_spectral_and_several_lights_at_once() -> None:
    scene = still_life("spectral", LIGHTS)
    some = dataclasses.replace(scene, shapes=scene.shapes[:5], lights=scene.lights[1:4:2])
    both(some, 16, "spectral")


@pytest.mark.slow
def test_lights_that_throw_images_and_shine_from_both_sides() -> None:
    """All in one scene, from where no one of them lights up what the others do not reach."""
    rng = np.random.default_rng(3)
    picture = Bitmap(image=rng.random((3, 5, 3)).astype(np.float32) ** 2)
    plate = tf.translate([-0.7, 0.9, 0.5]) @ tf.rotate([0, 1, 0], 70) @ tf.scale(0.25)
    scene = still_life("rgb", {})
    shines = Area(radiance=(5.0, 4.0, 3.0), two_sided=True)
    shapes = [*scene.shapes[:4], Rectangle(to_world=plate, material=BLACK, emission=shines)]
    at = [tf.look_at([x, 1.8, 1.0], [x / 2, 0, 0], UP) for x in (-0.5, 0.1, 0.6)]
    thrown: list[Light] = [
        Projector(to_world=at[0], image=picture, irradiance=(4.0, 4.0, 4.0), fov=50.0),
        Spot(to_world=at[1], image=picture, intensity=(9.0, 9.0, 5.0), cutoff=30.0),
        Goniometric(to_world=at[2], image=picture, intensity=(2.0, 2.0, 3.0)),
    ]
    both(dataclasses.replace(scene, shapes=shapes, lights=thrown), 16, "thrown")


@pytest.mark.slow
@pytest.mark.parametrize("depth", [1, 2, 3])
def test_depths(depth: int) -> None:
    both(still_life("rgb", {"sphere": 30.0, "spot": 8.0}), 16, f"depth {depth}", depth=depth)


@pytest.mark.slow
def test_thin_lens() -> None:
    """A floor and a wall out of focus in the light of a spot."""
    camera = ThinLens(to_world=VIEW, fov=50, aperture_radius=0.2, focus_distance=2.0, near=0.5)
    scene = still_life("rgb", {"spot": 8.0}, camera)
    small = dataclasses.replace(scene, shapes=[scene.shapes[0]], lights=[scene.lights[1]])
    both(small, 32, "thin lens", depth=2)


def beam_through(slab: m.Material | None, mode: str) -> Scene:
    """A floor that a beam from above meets head on, perhaps through a slab of some material."""
    lamp = Rectangle(
        to_world=tf.translate([0, 2, 0]) @ DOWN @ tf.scale(0.5),
        material=BLACK,
        emission=DirectionalArea(irradiance=Tabulated((300.0, 900.0), (2.0, 2.0))),
    )
    shapes: list[Shape] = [
        Rectangle(to_world=tf.rotate([1, 0, 0], -90), material=m.Diffuse(reflectance=0.5)),
        lamp,
    ]
    if slab is not None:
        plate = tf.scale([0.9, 0.1, 0.9])
        shapes.append(Cube(to_world=tf.translate([0, 1, 0]) @ plate, material=slab))
    return Scene(
        camera=Perspective(to_world=tf.look_at([0, 0.5, 1.5], [0, 0, 0], UP), fov=8),
        shapes=shapes,
        integrator=ParticleTracer(),
        film=Film(width=8, height=8, mode=mode),
    )


@pytest.mark.slow
@pytest.mark.parametrize("mode", MODES)
def test_beam(mode: str) -> None:
    """A floor of albedo a under irradiance E sends out a E / pi, in every direction."""
    white = Tabulated((300.0, 900.0), (1.0, 1.0)).to_rgb("emission")
    assert_mean(exposures(beam_through(None, mode), 12, 128), 0.5 * 2.0 / np.pi * white, 0.02, 2e-3)


@pytest.mark.slow
def test_beam_through_glass_that_absorbs() -> None:
    """What passes a slab at right angles once: (1 - f)^2 a, f being Fresnel's reflectance and a
    what absorption leaves; the path is too short for what is reflected inside."""
    f, a = (0.5 / 2.5) ** 2, np.exp(-3.0 * 0.2)
    glass = m.Dielectric(int_ior=1.5, ext_ior=1.0, absorption=3.0)
    scene = dataclasses.replace(beam_through(glass, "rgb"), integrator=ParticleTracer(max_depth=4))
    white = Tabulated((300.0, 900.0), (1.0, 1.0)).to_rgb("emission")
    expected = 0.5 * 2.0 / np.pi * white * (1 - f) ** 2 * a
    assert_mean(exposures(scene, 12, 128), expected, 0.02, 2e-3)


def test_camera_does_not_see_delta_surfaces_and_beams() -> None:
    """Mirrors and the shapes that beams come from are black."""
    scene = beam_through(m.Conductor(), "rgb")
    above = Perspective(to_world=tf.look_at([0.1, 1.5, 0.0], [0, 1, 0], UP), fov=15)
    mirror = clpt.render(dataclasses.replace(scene, camera=above), 16)
    assert not mirror.any()
    below = Perspective(to_world=tf.look_at([0.1, 1.2, 0.0], [0, 2, 0], UP), fov=15)
    assert not clpt.render(dataclasses.replace(beam_through(None, "rgb"), camera=below), 16).any()


def under_glass(glass: m.Material, camera: Camera, mode: str) -> Scene:
    """A floor in the light of a disk, a ball of glass between them."""
    lamp = tf.translate([0.1, 2.0, 0.0]) @ DOWN @ tf.scale(0.5)
    shapes: list[Shape] = [
        Rectangle(to_world=tf.rotate([1, 0, 0], -90) @ tf.scale(2.0), material=m.Diffuse()),
        Sphere(center=(0, 0.7, 0), radius=0.4, material=glass),
        Disk(to_world=lamp, material=BLACK, emission=Area(radiance=10.0)),
    ]
    return Scene(camera=camera, shapes=shapes, film=Film(width=16, height=12, mode=mode))


@pytest.mark.slow
def test_caustic_of_a_ball_of_glass() -> None:
    """The floor under the ball, where light is found by chance from the camera."""
    low = Perspective(to_world=tf.look_at([0.0, 0.28, 1.2], [0.0, 0.0, 0.0], UP), fov=30)
    both(under_glass(m.Dielectric(int_ior=1.5, absorption=1.0), low, "rgb"), 64, "caustic", depth=6)


@pytest.mark.slow
def test_rough_glass_that_disperses() -> None:
    """Each wavelength is refracted with its own index, by light that goes either way."""
    view = Perspective(to_world=tf.look_at([0.0, 0.9, 2.5], [0.0, 0.6, 0.0], UP), fov=30)
    glass = m.RoughDielectric(int_ior="sf11", alpha_u=0.4, alpha_v=0.4)
    both(under_glass(glass, view, "spectral"), 32, "rough glass", depth=5)


def test_stopped_early_is_as_bright() -> None:
    """A picture counts the paths that there were, wherever the film was left."""
    scene = dataclasses.replace(
        beam_through(None, "rgb"), film=Film(width=256, height=256, mode="rgb")
    )
    whole = clpt.render(scene, 4).mean(axis=(0, 1))
    renderer = clpt.Renderer(scene, slots=4096)
    assert not renderer.run(4, lambda progress: progress.samples < 0.5)
    paths = renderer._wavefront.counts.samples
    assert 0 < paths < 4 * 256 * 256
    part = renderer.image().mean(axis=(0, 1))
    assert np.allclose(part, whole, rtol=0.05), "100 thousand paths and more: half of a per cent"


SQUARE = Rectangle(name="square")
BEAM = Rectangle(emission=DirectionalArea(), name="beam")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"camera": Orthographic()}, "camera: .*thin_lens and calibrated, not orthographic"),
        ({"camera": ThinLens(glass="sf11")}, "camera.glass: .*does not disperse"),
        ({"lights": [Point(falloff=False)]}, r"lights\[0\]: .*falls with distance"),
        ({"film": Film(alpha=True)}, "film.alpha: .*without alpha"),
        ({"integrator": Path(), "shapes": [BEAM]}, "rectangle 'beam': only .*particle_tracer"),
    ],
)
def test_what_it_cannot_do_is_refused(changes: dict[str, Any], message: str) -> None:
    given = {"camera": Perspective(), "integrator": ParticleTracer(), "shapes": [SQUARE]}
    with pytest.raises(SceneError, match=message):
        lower(Scene(**{**given, **changes}))


FILTERS = [*(cls() for cls in kinds("filter").values()), Box(radius=0.8), Lanczos(radius=2.5)]


@pytest.mark.parametrize(
    "chosen",
    [pytest.param(f, marks=() if f.kind == "gaussian" else pytest.mark.slow) for f in FILTERS],
    ids=lambda f: f"{f.kind}_{getattr(f, 'radius', 0)}",
)
def test_every_filter(chosen: Filter) -> None:
    """A small lamp in view, pixel by pixel: light from it is spread as pixels gather it."""
    turned = tf.translate([0.03, 0.02, 0]) @ tf.rotate([0, 0, 1], 20) @ tf.scale([0.15, 0.1, 1.0])
    lamp = Rectangle(to_world=turned, emission=Area(radiance=(4.0, 2.0, 1.0)), material=BLACK)
    view = tf.look_at([0.0, 0.0, 1.0], [0.0, 0.0, 0.0], UP)
    film = Film(width=11, height=9, mode="rgb", filter=chosen)
    scene = Scene(camera=Perspective(to_world=view, fov=40), shapes=[lamp], film=film)
    from_camera = dataclasses.replace(scene, integrator=Path(max_depth=1))
    from_lights = dataclasses.replace(scene, integrator=ParticleTracer(max_depth=1))
    reference = exposures(from_camera, 12, 512)
    assert_agree(exposures(from_lights, 12, 2048), reference, chosen.kind)


@pytest.mark.slow
def test_bands() -> None:
    """A film of bands gets what the camera's paths bring."""
    scene = with_film(still_life("spectral", {"disk": 10.0}), bands=3, width=8, height=8)
    both(scene, 512, "bands", many=4, depth=3)


@pytest.mark.slow
def test_lanes() -> None:
    """The same paths in every number of lanes."""
    scene = beam_through(m.Dielectric(int_ior="sf11"), "spectral")
    pictures = []
    for lanes in (1, 8, 16):
        device = choose()
        device.lanes = lanes
        pictures.append(clpt.render(scene, 32, device=device))
    for picture in pictures[1:]:
        np.testing.assert_allclose(picture, pictures[0], rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize("size", [(1, 1), (3, 5), (17, 9)])
def test_sky_fills_films_of_odd_sizes(size: tuple[int, int]) -> None:
    """A sky alone, joined to the camera: as bright everywhere as it is."""
    film = Film(width=size[0], height=size[1], mode="rgb")
    sky = Constant(radiance=(0.25, 0.5, 1.0))
    scene = Scene(camera=Perspective(fov=170), lights=[sky], film=film, integrator=ParticleTracer())
    mean = clpt.render(scene, 8192).mean(axis=(0, 1))
    assert np.allclose(mean, [0.25, 0.5, 1.0], rtol=0.15)


def bow_radius(index: float, reflections: int) -> float:
    """Where the edge of a bow falls on a screen a metre from the middle of a ball of 4 cm [m].

    Descartes' ray: the turn 2 (i - r) + k (pi - 2 r) of one that passes the middle at b radii is
    least where cos^2 i = (n^2 - 1) / (k (k + 2)); it leaves along a line at b radii as well.
    """
    k = reflections
    i = np.arccos(np.sqrt((index**2 - 1.0) / (k * (k + 2))))
    r = np.arcsin(np.sin(i) / index)
    turn = 2.0 * (i - r) + k * (np.pi - 2.0 * r)  # from straight on; pi is back where it came from
    angle = abs(turn - np.pi)
    side = 1.0 if turn < np.pi else -1.0
    return float(np.tan(angle) + side * 0.04 * np.sin(i) / np.cos(angle))


def rays(scene: Scene) -> np.ndarray:
    """Directions (h, w, 3) of the camera through the middles of its pixels, of any length."""
    w, h = scene.film.size
    half = np.tan(np.radians(scene.camera.fov / 2.0))
    x = half * (1.0 - 2.0 * (np.arange(w) + 0.5) / w)
    y = half * (h - 2.0 * (np.arange(h) + 0.5)) / w
    film = np.stack([*np.broadcast_arrays(x[None], y[:, None]), np.ones((h, w))], axis=-1)
    return film @ np.asarray(scene.camera.to_world)[:3, :3].T


def assert_bows(image: np.ndarray, origin: np.ndarray, d: np.ndarray) -> None:
    """Both bows are where they ought to be on the screen z = 0, and the band between is dark.

    origin (3,), d (h, w, 3): the rays that see the screen.
    """
    met = origin - d * (origin[2] / d[..., 2:])
    radius = np.hypot(met[..., 0], met[..., 1])
    red = float(glass("water").sample(640.0))
    first, second = bow_radius(red, 1), bow_radius(red, 2)
    assert 0.95 < first < 0.97 and 1.14 < second < 1.16
    seen = met[..., 1] > 0.1

    def between(low: float, high: float) -> float:
        return float(image[seen & (radius > low) & (radius < high), 0].mean())

    bow, band = between(first - 0.035, first - 0.005), between(first + 0.03, second - 0.03)
    assert band < 0.1 * bow
    assert between(first + 0.015, first + 0.03) < 0.2 * bow, "red ends at the first edge"
    again = between(second + 0.005, second + 0.035)
    assert again > 10.0 * band, "and begins at the second"
    assert between(second - 0.03, second - 0.015) < 0.2 * again


@pytest.mark.slow
def test_rainbow() -> None:
    scene = with_film(clpt.load(ROOT / "scenes/rainbow"), width=240, height=150)
    scene = dataclasses.replace(scene, lights=[])
    image = clpt.render(scene, 24)
    assert_bows(image, np.asarray(scene.camera.to_world)[:3, 3], rays(scene))
