"""`vcm` finds what `path` finds, and caustics behind glass and in mirrors, which have formulas.

Merging blurs, so means over blocks are compared where light is smooth over the radius, and the bias
is measured by itself. See tests/pictures/support.py for the significance. Kernels are one lane
wide, which compiles soonest; test_bits has another width.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

import clpt
from clpt import device as dev
from clpt import transforms as tf
from clpt.errors import SceneError
from clpt.render.flow.scene_to_tables import lower
from clpt.render.wavefront.bounce_loop import BounceLoop
from clpt.scene import Film, Scene
from clpt.scene import materials as m
from clpt.scene.cameras import Camera, Orthographic, Perspective, Spherical, ThinLens
from clpt.scene.integrators import Path, Vcm
from clpt.scene.lights import DirectionalArea, Point
from clpt.scene.shapes import Cube, Curves, Disk, Group, Instance, Rectangle, Shape, Sphere
from clpt.scene.textures import Bitmap
from clpt.spectra import LED, Fluorophore
from tests.pictures.support import (
    assert_agree,
    assert_bands_are_the_colour,
    assert_bands_keep_their_bits,
    assert_mean,
    blocks,
    exposures,
    with_film,
)
from tests.pictures.transport.test_hybrid import (
    FLAT,
    MATERIALS,
    VIEW,
    caustic,
    corner,
    lamp,
    narrow,
)

WATER = 1.33
ABOVE, DEEP, HEIGHT = 1.0, 1.0, 3.0  # the light over the water, the floor under it, the camera
ALBEDO, INTENSITY = 0.7, 10.0


def with_vcm(scene: Scene, **changes: Any) -> Scene:
    return dataclasses.replace(scene, integrator=Vcm(**changes))


def flat_pool(mode: str = "rgb", **integrator: Any) -> Scene:
    """A floor under flat water, in the light of a point: no path from the camera finds that."""
    water = m.Dielectric(int_ior=WATER)
    return Scene(
        camera=Perspective(
            to_world=tf.look_at([0.0, HEIGHT, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 1.0]), fov=16
        ),
        shapes=[
            Rectangle(to_world=FLAT @ tf.scale(2.0), material=water),
            Rectangle(
                to_world=tf.translate([0.0, -DEEP, 0.0]) @ FLAT @ tf.scale(2.0),
                material=m.Diffuse(reflectance=ALBEDO),
            ),
        ],
        lights=[Point(position=(0.6, ABOVE, 0.0), intensity=INTENSITY)],
        film=Film(width=8, height=8, mode=mode),
        integrator=Vcm(max_depth=4, light_paths=64, **integrator),
    )


def transmitted(angle: np.ndarray, index: float = WATER) -> np.ndarray:
    """How much light passes a surface at an angle from its normal (Fresnel)."""
    c, cosine = np.cos(angle), np.sqrt(1.0 - (np.sin(angle) / index) ** 2)
    s, p = (c - index * cosine) / (c + index * cosine), (cosine - index * c) / (cosine + index * c)
    return 1.0 - (s**2 + p**2) / 2.0


def flat_pool_irradiance(
    x: np.ndarray, z: np.ndarray, deep: float = DEEP
) -> tuple[np.ndarray, np.ndarray]:
    """Of a floor at (x, -deep, z) in `flat_pool`, light refracted by Snell; and its cosine there.

    Light that leaves the point at t1 to the vertical goes on at t2, sin t1 = WATER sin t2, and
    meets the floor at rho = ABOVE tan t1 + deep tan t2 from the point's foot. A ring of it keeps
    its power: E = I T sin t1 / (rho drho/dt1).
    """
    rho = np.hypot(x - 0.6, z)
    low, high = np.zeros_like(rho), np.full_like(rho, 1.5)
    for _ in range(60):  # the angle at which light comes there
        t1 = (low + high) / 2.0
        t2 = np.arcsin(np.sin(t1) / WATER)
        short = ABOVE * np.tan(t1) + deep * np.tan(t2) < rho
        low, high = np.where(short, t1, low), np.where(short, high, t1)
    t2 = np.arcsin(np.sin(t1) / WATER)
    spread = ABOVE / np.cos(t1) ** 2 + deep * np.cos(t1) / (WATER * np.cos(t2) ** 3)
    return INTENSITY * transmitted(t1) * np.sin(t1) / (rho * spread), np.cos(t2)


def flat_pool_radiance(samples: int = 8) -> np.ndarray:
    """What the camera sees of `flat_pool`, (8, 8): its rays are refracted as well."""
    at = (np.arange(8 * samples) + 0.5) / (4 * samples) - 1.0
    x, z = np.meshgrid(-at, -at)  # of the film, mirrored as a camera's +x is to the left
    slope = np.tan(np.radians(8.0)) * np.hypot(x, z)
    across = np.arctan2(z, x)
    out = np.arctan(slope)
    inside = np.arcsin(np.sin(out) / WATER)
    far = HEIGHT * np.tan(out) + DEEP * np.tan(inside)
    irradiance, _ = flat_pool_irradiance(far * np.cos(across), far * np.sin(across))
    seen = ALBEDO / np.pi * irradiance * transmitted(out) / WATER**2
    return seen.reshape(8, samples, 8, samples).mean(axis=(1, 3))


@pytest.mark.parametrize("mode", ["rgb", pytest.param("spectral", marks=pytest.mark.slow)])
def test_a_point_seen_through_water(mode: str) -> None:
    """Light to a diffuse floor and back through water, with an exact answer: 1 %."""
    made = exposures(flat_pool(mode, radius=0.1), 8, 64, device=narrow())
    if mode == "spectral":
        made = made[..., 1:2] / made[..., 1].mean()  # of D65; the formula has no colours
        made *= flat_pool_radiance().mean()
    assert_mean(blocks(made, 8), flat_pool_radiance().mean(), 0.01)
    reference = flat_pool_radiance()[None, :, :, None]
    assert_agree(blocks(made[..., :1]), blocks(reference), mode, allowed=0.01)


@pytest.mark.slow
def test_the_bias_falls_with_the_square_of_the_radius() -> None:
    """Of one pass: that of later ones is smaller."""
    expected = flat_pool_radiance()
    bright = np.unravel_index(expected.argmax(), expected.shape)
    lost = []
    for radius in (0.6, 0.3):
        made = exposures(flat_pool(radius=radius), 400, 1, device=narrow())[..., 0]
        lost.append(1.0 - made.mean(axis=0)[bright] / expected[bright])
    assert lost[0] > 0.05, lost
    assert lost[1] == pytest.approx(lost[0] / 4.0, abs=0.02)


def agrees_with_path(scene: Scene, spp: int, what: str, **integrator: Any) -> None:
    depth = {"max_depth": integrator.pop("max_depth", 6)}
    alone = dataclasses.replace(scene, integrator=Path(light_paths=0, **depth))
    reference = blocks(exposures(alone, 12, 4 * spp, device=narrow()))
    merged = with_vcm(scene, light_paths=4, radius=0.04, **depth, **integrator)
    ours = blocks(exposures(merged, 12, spp, first_seed=101, device=narrow()))
    assert_agree(ours, reference, what, allowed=0.01)


SWITCHES: dict[str, dict[str, Any]] = {
    "both": {},
    "merging": {"light_tracing": False},
    "light_tracing": {"merging": False},
    "neither": {"light_tracing": False, "merging": False},
}


@pytest.mark.slow
@pytest.mark.parametrize("switch", SWITCHES)
@pytest.mark.parametrize("kind", MATERIALS)
def test_every_material(kind: str, switch: str) -> None:
    """A ball of it before a mirror, under a lamp that paths from the camera find as well."""
    ball = Sphere(center=(0.1, 0.45, 0.2), radius=0.4, material=MATERIALS[kind])
    place = tf.translate([-0.9, 0.5, -0.2]) @ tf.rotate([0, 1, 0], 60) @ tf.scale(0.5)
    mirror = Rectangle(to_world=place, material=m.TwoSided(front=m.Conductor()))
    agrees_with_path(corner({}, lamp(), ball, mirror), 128, kind, **SWITCHES[switch])


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["dielectric", "rough_dielectric"])
def test_in_the_spectral_mode(kind: str) -> None:
    alpha = {} if kind == "dielectric" else {"alpha_u": 0.2, "alpha_v": 0.2}
    make = m.Dielectric if kind == "dielectric" else m.RoughDielectric
    ball = Sphere(center=(0.1, 0.45, 0.2), radius=0.4, material=make(int_ior="sf11", **alpha))
    agrees_with_path(corner({}, lamp(), ball, mode="spectral"), 256, kind, wavelength_groups=2)


@pytest.mark.slow
def test_instances() -> None:
    group = Group(shapes=[Cube(to_world=tf.scale(0.3), material=m.Dielectric(int_ior=1.5))])
    placed = [
        Instance(group=group, to_world=tf.translate([x, 0.4, 0.2]) @ tf.rotate([0, 1, 0], 30))
        for x in (-0.6, 0.6)
    ]
    agrees_with_path(corner({}, lamp(), *placed), 128, "instances")


CAMERAS = {
    "orthographic": Orthographic(to_world=VIEW @ tf.scale([1.2, 1.2, 1.0])),
    "spherical": Spherical(to_world=VIEW),
    "a lens that disperses": ThinLens(to_world=VIEW, fov=50, aperture_radius=0.01, glass="sf11"),
}


def beside(camera: Camera) -> Scene:
    """A ball of glass under a lamp, seen by a camera that no light path can be joined to."""
    mode = "spectral" if isinstance(camera, ThinLens) else "rgb"
    ball = Sphere(center=(0.1, 0.45, 0.2), radius=0.4, material=m.Dielectric(int_ior=1.5))
    return dataclasses.replace(corner({}, lamp(), ball, mode=mode), camera=camera)


@pytest.mark.parametrize("camera", CAMERAS)
def test_cameras_that_cannot_be_joined(camera: str) -> None:
    """Light paths leave photons alone; without merging there are none."""
    lowered = lower(with_vcm(beside(CAMERAS[camera])))
    own = lowered.features.transport
    assert (own.merged, own.weighed, own.joined) == (True, True, False)
    assert [w for w in lowered.warnings if w.startswith("vcm.light_tracing: left aside")]
    alone = lower(with_vcm(beside(CAMERAS[camera]), merging=False)).features.transport
    assert not (alone.merged or alone.weighed or alone.joined)


@pytest.mark.slow
@pytest.mark.parametrize("camera", CAMERAS)
def test_cameras_that_cannot_be_joined_still_gather(camera: str) -> None:
    agrees_with_path(beside(CAMERAS[camera]), 128, camera)


DYE = Fluorophore(LED(450.0, 60.0), LED(560.0, 60.0), 0.9)
FUR = np.array(
    [[(x, 0.2 * i, 0.7 + 0.05 * i, 0.03) for i in range(4)] for x in np.linspace(0.5, 1.0, 6)],
    np.float32,
).reshape(-1, 4)
BEHIND = tf.translate([-0.7, 0.4, 0.3]) @ tf.rotate([0, 1, 0], 40) @ tf.scale(0.35)
ENDS: dict[str, tuple[str, Shape]] = {  # kinds that end light paths, and what a report calls them
    "hair": ("hair", Curves(points=FUR, lengths=(4,) * 6, material=m.Hair())),
    "grating": ("grating", Rectangle(to_world=BEHIND, material=m.TwoSided(front=m.Grating()))),
    "paint": (
        "fluorescent",
        Rectangle(to_world=BEHIND, material=m.Fluorescent(reflectance=0.1, reradiation=DYE)),
    ),
    "bumps": (
        "normal maps",
        Rectangle(
            to_world=BEHIND,
            material=m.NormalMap(
                material=m.Diffuse(),
                map=Bitmap(image=np.full((2, 2, 3), (0.7, 0.5, 0.9), np.float32), raw=True),
            ),
        ),
    ),
}


def beside_what_ends_light_paths(kind: str) -> Scene:
    """It and a ball of glass on a floor, under a lamp."""
    ball = Sphere(center=(0.1, 0.45, 0.2), radius=0.4, material=m.Dielectric(int_ior=1.5))
    return corner({}, lamp(), ball, ENDS[kind][1], mode="spectral")


@pytest.mark.slow
@pytest.mark.parametrize("kind", ENDS)
def test_what_ends_light_paths(kind: str) -> None:
    """What is behind it is left to the camera's paths, all else is as bright."""
    scene = beside_what_ends_light_paths(kind)
    agrees_with_path(scene, 256, kind)
    integrator = Path(light_paths=4, max_depth=6)
    renderer = clpt.Renderer(dataclasses.replace(scene, integrator=integrator), narrow())
    assert renderer.stats.light_paths_end == (ENDS[kind][0],)


@pytest.mark.slow
def test_a_light_that_has_no_light_paths() -> None:
    """Its light does not fall with distance: paths from the camera choose it as ever."""
    lights = [Point(position=(0.5, 1.7, 0.9), intensity=2.0, falloff=False)]
    ball = Sphere(center=(0.1, 0.45, 0.2), radius=0.4, material=m.Dielectric(int_ior=1.5))
    scene = dataclasses.replace(corner({}, lamp(), ball), lights=lights)
    told = [w for w in lower(with_vcm(scene)).warnings if w.startswith("vcm.light_paths: none")]
    assert len(told) == 1 and "lights[0]" in told[0]
    agrees_with_path(scene, 128, "without falloff")


def picture(scene: Scene, *runs: int, lanes: int = 1, **options: Any) -> np.ndarray:
    device = dev.choose()
    device.lanes = lanes
    renderer = clpt.Renderer(scene, device, **options)
    for samples in runs:
        renderer.run(samples)
    return renderer.image()


@pytest.mark.slow
def test_bits() -> None:
    """Runs, slots, steps, stages that the host enqueues, numbers of lanes, a merge."""
    scene = with_vcm(caustic(), max_depth=6, light_paths=4, radius=0.05)
    whole = picture(scene, 7)
    assert np.array_equal(picture(scene, 3, 4), whole)
    assert np.array_equal(picture(scene, 7, slots=128), whole)
    assert np.array_equal(picture(scene, 7, looped=False), whole)
    np.testing.assert_allclose(picture(scene, 7, lanes=8), whole, rtol=2e-3, atol=1e-4)
    renderer = clpt.Renderer(scene, narrow())
    for samples in (5, 2):
        event = renderer.step(samples)
    event.wait()
    assert np.array_equal(renderer.film.get()[..., :3], whole)
    parts = [clpt.Renderer(scene, narrow(), first_sample=first) for first in (0, 3)]
    for renderer, samples in zip(parts, (3, 4), strict=True):
        renderer.run(samples)
    parts[0].merge(parts[1].film_state())
    assert np.array_equal(parts[0].image(), whole)
    assert not np.array_equal(picture(with_vcm(caustic(), merging=False), 7), whole)


@pytest.mark.slow
def test_stopped_early_is_as_bright() -> None:
    """A pass that was left has fewer samples of some pixels, and its light paths are all there."""
    scene = with_film(with_vcm(caustic(), max_depth=6, radius=0.05), width=80, height=60)
    whole = picture(scene, 64).mean()
    renderer = clpt.Renderer(scene, narrow())
    assert not renderer.run(512, lambda progress: progress.samples < 64)
    assert 16 < renderer.film.get()[..., 3].mean() < 400
    assert np.isclose(renderer.image().mean(), whole, rtol=0.03)


@pytest.mark.slow
def test_bands() -> None:
    scene = with_vcm(caustic(mode="spectral", bands=235, output_space="xyz"), radius=0.05)
    assert_bands_are_the_colour(scene, narrow())
    assert_bands_keep_their_bits(with_film(scene, bands=3), narrow())


def test_photons_that_do_not_fit_are_left_out() -> None:
    """Fewer light paths leave some; all are joined to the camera."""
    scene = with_vcm(caustic(), max_depth=16, light_paths=64, photon_memory=1)
    settings = lower(scene).settings
    assert 0 < settings["photon_pixels"] < settings["padded_pixels"]
    deep = lower(with_vcm(caustic(), max_depth=-1, light_paths=64, photon_memory=1)).settings
    assert deep["max_depth"] == 65 and deep["photon_pixels"] >= 1, "1 MiB is enough for any"


def test_what_cannot_be_is_refused_or_left_aside() -> None:
    with pytest.raises(SceneError, match=r"vcm.light_paths: must be a whole number from 1 to 64"):
        Vcm(light_paths=0)
    with pytest.raises(SceneError, match=r"vcm.photon_memory: must be a whole number from 1 to"):
        Vcm(photon_memory=0)
    beam = Disk(emission=DirectionalArea(), name="beam")
    for integrator in (Vcm(), Path(light_paths=1)):
        with pytest.raises(SceneError, match=r"disk 'beam': only .*particle_tracer"):
            lower(dataclasses.replace(corner({}, beam), integrator=integrator))
    with pytest.raises(SceneError, match=r"vcm.radius"):
        Vcm(radius=-1.0)
    paint = Rectangle(material=m.Fluorescent(reflectance=0.5), to_world=tf.scale(0.1))
    glows = with_vcm(corner({}, lamp(), paint, mode="spectral"))
    lowered = lower(glows)
    assert not lowered.features.transport.merged
    assert any("vcm.merging: left aside" in warning for warning in lowered.warnings)
    with pytest.raises(SceneError, match="photons"):
        clpt.Renderer(with_vcm(caustic()), narrow()).run(4, noise=0.1)


def test_everything_is_built_before_the_first_sample(monkeypatch: pytest.MonkeyPatch) -> None:
    """`prepare` runs all of it once, with nothing to do."""
    renderer = clpt.Renderer(with_vcm(caustic(), max_depth=4), narrow())
    built, traced, run = renderer.device.builds.programs, [], BounceLoop.run
    assert "photons" in renderer._wavefront.programs

    def noted(loop: BounceLoop, *given: Any) -> bool:
        traced.append(loop.features.transport.light_paths)
        return run(loop, *given)

    monkeypatch.setattr(BounceLoop, "run", noted)
    renderer.prepare()
    assert traced == [True, False] and not renderer.image().any()
    renderer.run(2)
    assert renderer.image().any() and renderer.device.builds.programs == built
