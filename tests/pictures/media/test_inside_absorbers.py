"""A camera or a lamp within a body that absorbs, in a medium (Bouguer 1729, Beer 1852).

Bodies have the index 1: rays go straight, so pictures have formulas.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

import clpt
from clpt import transforms as tf
from clpt.scene import Film, Scene, cameras, integrators, lights, media, shapes
from clpt.scene import materials as m
from tests.pictures.support import quick

A, FOG_A = np.array([0.9, 0.4, 0.1]), np.array([0.2, 0.5, 0.3])  # [1/m]
FOG = media.Homogeneous(sigma_a=tuple(FOG_A))
RADIUS, WALL, LIGHT = 0.5, 1.5, 3.0  # of the body, distance of the wall [m]; radiance of the wall
GLASS: dict[str, m.Material] = {
    "dielectric": m.Dielectric(int_ior=1.0, ext_ior=1.0, absorption=tuple(A)),
    "gltf_surface": m.GltfSurface(
        transmission=1.0, roughness=0.0, ior=1.0, base_color=(1.0, 1.0, 1.0), absorption=tuple(A)
    ),
    "blend": m.Blend(
        first=m.Dielectric(int_ior=1.0, ext_ior=1.0, absorption=tuple(A)),
        second=m.Dielectric(int_ior=1.0, ext_ior=1.0, absorption=tuple(A)),
    ),
}
WAYS: dict[str, integrators.Integrator] = {
    "path": integrators.Path(light_paths=0, max_depth=8),
    "light paths": integrators.Path(light_paths=1, max_depth=8),
    "vcm": integrators.Vcm(max_depth=8),
    "particle_tracer": integrators.ParticleTracer(max_depth=8),
    "guiding": integrators.Path(guiding=True, guide_paths=4096, light_paths=0, max_depth=8),
    "whitted": integrators.Whitted(max_depth=8),
}
QUICK = ("path", "light paths", "particle_tracer")  # others are as good in slow tests


def _ways(without: str = "") -> list[Any]:
    """Return the names of integrators as parameters."""
    return quick([way for way in WAYS if way != without], *QUICK)


def _body(material: m.Material, **sides: Any) -> shapes.Shape:
    return shapes.Sphere(radius=RADIUS, material=material, **sides)


def _fog() -> shapes.Shape:
    return shapes.Cube(material=m.Null(), interior=FOG, to_world=tf.scale(4))


def _camera(z: float, **more: Any) -> cameras.Camera:
    """It looks along -z through a narrow cone, so all its rays have about the same length."""
    to_world = tf.look_at([0, 0, z], [0, 0, -4], [0, 1, 0])
    return cameras.Perspective(to_world=to_world, fov=0.5, near=1e-6, **more)


def _mean(scene: Scene, spp: int = 4) -> np.ndarray:
    return np.asarray(clpt.render(scene, spp), np.float64).mean(axis=(0, 1))


def _scene(camera: cameras.Camera, parts: list[Any], way: integrators.Integrator) -> Scene:
    film = Film(width=8, height=8, mode="rgb")
    return Scene(camera=camera, shapes=[_fog(), *parts], film=film, integrator=way)


def _wall() -> shapes.Shape:
    return shapes.Rectangle(
        material=m.Diffuse(reflectance=0.0), emission=lights.Area(radiance=LIGHT),
        to_world=tf.translate([0, 0, -WALL]) @ tf.scale(0.5),
    )  # fmt: skip


@pytest.mark.parametrize("name", [False, True], ids=["detected", "camera.medium"])
@pytest.mark.parametrize("kind", GLASS)
def test_a_camera_within(kind: str, name: bool) -> None:
    """A wall that shines, seen from the body through the rest of it and through the fog."""
    camera = _camera(0.2, medium=FOG) if name else _camera(0.2)
    expected = LIGHT * np.exp(-A * (0.2 + RADIUS) - FOG_A * (WALL - RADIUS))
    seen = _mean(_scene(camera, [_wall(), _body(GLASS[kind])], WAYS["path"]))
    # the lobe of a gltf_surface is not quite smooth
    np.testing.assert_allclose(seen, expected, rtol=4e-3 if kind == "gltf_surface" else 2e-4)


@pytest.mark.parametrize("way", _ways("particle_tracer"))
def test_a_camera_within_by_every_integrator(way: str) -> None:
    """No light path goes through a smooth boundary to a camera that is a point."""
    expected = LIGHT * np.exp(-A * (0.2 + RADIUS) - FOG_A * (WALL - RADIUS))
    seen = _mean(_scene(_camera(0.2), [_wall(), _body(GLASS["dielectric"])], WAYS[way]))
    np.testing.assert_allclose(seen, expected, rtol=2e-4)


SCREEN, LAMP = 1.5, 0.45  # radii [m] of a sphere around all that light falls on, and of the lamp
REFLECTS = 0.005  # so little that the screen lights itself by .4 % at most
EYE = cameras.Perspective(
    to_world=tf.look_at([0, 0.8, 0.3], [0, 1.0, -1.0], [0, 1, 0]), fov=50, near=1e-6
)


def _lit_screen(way: integrators.Integrator, lamp: shapes.Shape | lights.Light) -> Scene:
    """A lamp at the centre of a body at the centre of a screen, which a camera in the fog sees."""
    screen = shapes.Sphere(
        radius=SCREEN, flip_normals=True, material=m.Diffuse(reflectance=REFLECTS)
    )
    is_shape = isinstance(lamp, shapes.Shape)
    parts = [screen, _body(GLASS["dielectric"]), *([lamp] if is_shape else [])]
    scene = _scene(EYE, parts, way)
    return scene if is_shape else dataclasses.replace(scene, lights=[lamp])


def _expected(irradiance: np.ndarray, extinction: np.ndarray = FOG_A) -> np.ndarray:
    """The mean radiance of the picture's pixels, whose rays to the screen differ in length."""
    at = np.tan(np.radians(25)) * (np.arange(64) + 0.5 - 32) / 32
    x, y = np.meshgrid(at, at)
    d = np.stack([x, y, np.ones_like(x)], axis=-1) / np.sqrt(x**2 + y**2 + 1)[..., None]
    forward = np.array([0, 0.2, -1.3]) / np.hypot(0.2, 1.3)
    right = np.array([1.0, 0, 0])
    d = d @ np.stack([right, np.cross(forward, right), forward])
    o = np.array([0, 0.8, 0.3])
    along = d @ o
    t = -along + np.sqrt(along**2 + SCREEN**2 - o @ o)
    return REFLECTS / np.pi * irradiance * np.exp(-t[..., None] * extinction).mean(axis=(0, 1))


def _compare(scene: Scene, expected: np.ndarray, spp: int) -> None:
    """Ten exposures; significance: 5 standard errors, of at most 2 %."""
    means = np.array([_mean(dataclasses.replace(scene, seed=i), spp) for i in range(10)])
    error, mean = means.std(axis=0, ddof=1) / np.sqrt(len(means)), means.mean(axis=0)
    assert (error < 0.02 * mean).all(), f"too noisy to tell: {error / mean}"
    assert (np.abs(mean - expected) < 5.0 * error + 0.005 * expected).all(), mean / expected


@pytest.mark.parametrize("way", _ways("whitted"))
def test_a_lamp_within(way: str) -> None:
    """A ball that shines: the irradiance is an integral over its disk as the screen sees it."""
    theta = (np.arange(2000) + 0.5) / 2000 * np.arcsin(LAMP / SCREEN)
    b = SCREEN * np.sin(theta)  # distance of a ray from the centre
    within = np.sqrt(RADIUS**2 - b**2) - np.sqrt(LAMP**2 - b**2)
    in_fog = SCREEN * np.cos(theta) - np.sqrt(RADIUS**2 - b**2)
    through = np.exp(-within[:, None] * A - in_fog[:, None] * FOG_A)
    step = np.arcsin(LAMP / SCREEN) / 2000
    weights = (2 * np.pi * step * np.cos(theta) * np.sin(theta))[:, None]
    lamp = shapes.Sphere(
        radius=LAMP, material=m.Diffuse(reflectance=0.0), emission=lights.Area(radiance=LIGHT)
    )
    _compare(_lit_screen(WAYS[way], lamp), _expected(LIGHT * (weights * through).sum(0)), 128)


@pytest.mark.parametrize(
    "way", ["light paths", pytest.param("vcm", marks=pytest.mark.slow), "particle_tracer"]
)
def test_a_point_lamp_within(way: str) -> None:
    """Light paths begin in the body and come into the fog."""
    through = np.exp(-A * RADIUS - FOG_A * (SCREEN - RADIUS))
    lamp = lights.Point(position=[0, 0, 0], intensity=LIGHT)
    _compare(_lit_screen(WAYS[way], lamp), _expected(LIGHT / SCREEN**2 * through), 128)


def test_an_absorber_among_others_is_innermost() -> None:
    """Many bodies of one material fill the scene, but the camera is in one of them."""
    others = [
        dataclasses.replace(_body(GLASS["dielectric"]), center=(x, 2.5, 0.0)) for x in (-3.0, 3.0)
    ]
    expected = LIGHT * np.exp(-A * (0.2 + RADIUS) - FOG_A * (WALL - RADIUS))
    parts = [_wall(), _body(GLASS["dielectric"]), *others]
    seen = _mean(_scene(_camera(0.2), parts, WAYS["path"]))
    np.testing.assert_allclose(seen, expected, rtol=2e-4)


def test_an_update_brings_the_camera_in_and_out() -> None:
    scene = _scene(_camera(0.2), [_wall(), _body(GLASS["dielectric"])], WAYS["path"])
    outside = 1.0
    with clpt.Renderer(scene) as renderer:
        for z in (0.2, outside, 0.2):
            renderer.update(camera=_camera(z))
            renderer.run(4)
            seen = np.asarray(renderer.image(), np.float64).mean(axis=(0, 1))
            within = 2 * RADIUS if z == outside else z + RADIUS
            in_fog = WALL - RADIUS + (outside - RADIUS) * (z == outside)
            expected = LIGHT * np.exp(-A * within - FOG_A * in_fog)
            np.testing.assert_allclose(seen, expected, rtol=2e-4)


def test_a_clear_body_is_the_fog() -> None:
    """A colour of zeros absorbs nothing: the fog is in the body too."""
    clear = m.Dielectric(int_ior=1.0, ext_ior=1.0, absorption=(0.0, 0.0, 0.0))
    seen = _mean(_scene(_camera(0.2), [_wall(), _body(clear)], WAYS["path"]))
    np.testing.assert_allclose(seen, LIGHT * np.exp(-FOG_A * (0.2 + WALL)), rtol=2e-4)


# without a medium around


def _in_glass(parts: list[Any], camera: cameras.Camera, way: integrators.Integrator) -> Scene:
    """A scene whose parts, with the camera, are all in a large ball that absorbs."""
    glass = shapes.Sphere(radius=4.0, material=GLASS["dielectric"])
    film = Film(width=8, height=8, mode="rgb")
    return Scene(camera=camera, shapes=[*parts, glass], film=film, integrator=way)


@pytest.mark.parametrize("way", _ways("particle_tracer"))
def test_a_camera_and_a_wall_in_the_same_body(way: str) -> None:
    seen = _mean(_in_glass([_wall()], _camera(0.2), WAYS[way]))
    np.testing.assert_allclose(seen, LIGHT * np.exp(-A * (0.2 + WALL)), rtol=2e-4)


@pytest.mark.parametrize("way", _ways("whitted"))
def test_a_lamp_and_a_screen_in_the_same_body(way: str) -> None:
    theta = (np.arange(2000) + 0.5) / 2000 * np.arcsin(LAMP / SCREEN)
    length = SCREEN * np.cos(theta) - np.sqrt(LAMP**2 - (SCREEN * np.sin(theta)) ** 2)
    step = np.arcsin(LAMP / SCREEN) / 2000
    weights = (2 * np.pi * step * np.cos(theta) * np.sin(theta))[:, None]
    irradiance = LIGHT * (weights * np.exp(-length[:, None] * A)).sum(0)
    lamp = shapes.Sphere(
        radius=LAMP, material=m.Diffuse(reflectance=0.0), emission=lights.Area(radiance=LIGHT)
    )
    screen = shapes.Sphere(
        radius=SCREEN, flip_normals=True, material=m.Diffuse(reflectance=REFLECTS)
    )
    scene = _in_glass([lamp, screen], EYE, WAYS[way])
    _compare(scene, _expected(irradiance, A), 128)
