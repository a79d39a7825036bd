"""Fluorescent surfaces against sums over re-radiation matrices in float64.

The significance of every statistical test is that of tests/pictures/support.py.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import clpt
from clpt import spectra
from clpt import transforms as tf
from clpt.errors import SceneError
from clpt.render.flow.scene_to_tables import lower
from clpt.scene import Film, Scene
from clpt.scene.cameras import Orthographic
from clpt.scene.integrators import Path, Whitted
from clpt.scene.lights import Area, Constant, Directional
from clpt.scene.materials import Dielectric, Diffuse, Fluorescent
from clpt.scene.shapes import Disk, Rectangle, Sphere
from clpt.spectra import Blackbody, Fluorophore, Spectrum, Tabulated
from tests.pictures.builders import BLACK, EXPECTED, UP, facing_down, overhead
from tests.pictures.support import agreement, assert_mean, exposures, with_film

WIDE = (300.0, 830.0)  # [nm]
FINE = 1.0  # [nm], of sums
# An orange day-glo paint: absorbs up to 560 nm, gives out around 600, reflects what is longer.
ABSORBS = ((300.0, 400.0, 520.0, 550.0, 590.0), (0.5, 0.6, 0.9, 0.8, 0.0))
EMITS = ((540.0, 560.0, 600.0, 640.0, 720.0), (0.0, 0.3, 1.0, 0.4, 0.0))
REFLECTS = ((300.0, 540.0, 610.0, 830.0), (0.06, 0.06, 0.85, 0.9))
YIELD = 0.9
DYE = Fluorophore(Tabulated(*ABSORBS), Tabulated(*EMITS), YIELD)
PAINT = Fluorescent(reflectance=Tabulated(*REFLECTS), reradiation=DYE)
LIGHTS: dict[str, Spectrum] = {
    "D65": spectra.illuminant("D65"),
    "A": spectra.illuminant("A"),
    "F2": spectra.illuminant("F2"),
    "UV": Tabulated((360.0, 365.0, 370.0), (0.0, 20.0, 0.0)),
    "black body": Blackbody(4000.0, 1e-4),
}


def lambdas(low: float = WIDE[0], high: float = WIDE[1]) -> np.ndarray:
    return np.arange(low, high + 0.5, FINE)


def operator(at: np.ndarray) -> np.ndarray:
    """What an even diffuse reflection does to radiance at wavelengths `at`, as a matrix.

    Written from the definition: out of the photons absorbed at one wavelength, a share YIELD is
    given out with the energy spectrum EMITS, cut off below it, on the 5 nm grid that clpt has.
    """
    grid = np.arange(250.0, 901.0, 5.0)
    absorbed = np.interp(grid, *ABSORBS, 0.0, 0.0)
    emitted = np.interp(grid, *EMITS, 0.0, 0.0)
    phi = np.zeros((len(grid), len(grid)))
    for j, into in enumerate(grid):
        shape = np.where(grid > into, emitted, 0.0)
        photons = (shape * grid).sum() * 5.0  # ends are zero
        if photons > 1e-3 * (emitted * grid).sum() * 5.0:
            phi[:, j] = YIELD * absorbed[j] * into * shape / photons
    rows = np.array([np.interp(at, grid, column) for column in phi.T]).T  # (at, grid)
    fine = np.array([np.interp(at, grid, row) for row in rows])
    weights = np.full(len(at), FINE)
    weights[[0, -1]] *= 0.5
    return np.diag(np.interp(at, *REFLECTS)) + fine * weights


def seen(at: np.ndarray, radiance: np.ndarray) -> np.ndarray:
    """Linear Rec. 709 (3,) of a spectrum (n,), by the sum with the observer."""
    xyz = (spectra.cie_xyz(at) * radiance[:, None]).sum(axis=0) * FINE / spectra.CIE_Y_INTEGRAL
    return spectra.XYZ_TO_REC709 @ xyz


def plane(light: Spectrum, material: object = PAINT, **film: object) -> Scene:
    """A plane under an even sky, seen from above."""
    ends = {"lambda_min": WIDE[0], "lambda_max": WIDE[1]}
    return Scene(
        camera=facing_down(),
        shapes=[Rectangle(material=material, to_world=tf.scale(100.0))],
        lights=[Constant(radiance=light)],
        integrator=Path(max_depth=2),
        film=Film(width=16, height=16, **{**ends, **film}),
    )


@pytest.mark.parametrize("name", LIGHTS)
def test_a_plane_is_a_matrix_product(name: str) -> None:
    at = lambdas()
    expected = seen(at, operator(at) @ LIGHTS[name].sample(at))
    images = exposures(plane(LIGHTS[name]), 32, 64)
    within = np.abs(expected).max() * 0.02
    means = images.mean(axis=(0, 1, 2))
    assert np.abs(means - expected).max() < within, f"{means}, expected {expected}"
    assert agreement(images.mean(axis=(1, 2)), expected[None], 1e-3) > 1e-4


def inside(depth: int) -> Scene:
    """In a ball whose walls shine evenly and fluoresce: every bounce is a matrix product."""
    wall = {"material": PAINT, "emission": Area(radiance=LIGHTS["D65"])}
    view = tf.look_at([0.1, 0.2, 0.3], [0, 0, 0], UP)
    return Scene(
        camera=Orthographic(to_world=view @ tf.scale([0.5, 0.5, 1.0])),
        shapes=[Sphere(radius=2.0, flip_normals=True, **wall)],
        integrator=Path(max_depth=depth),
        film=Film(width=16, height=16, lambda_min=WIDE[0]),
    )


@pytest.mark.parametrize("depth", [3, -1])
def test_a_furnace_is_a_power_series(depth: int) -> None:
    """E + M E + M^2 E with two bounces, (1 - M)^-1 E with all, roulette included."""
    at = lambdas()
    once, light = operator(at), LIGHTS["D65"].sample(at)
    whole = np.linalg.solve(np.eye(len(at)) - once, light)
    twice = light + once @ (light + once @ light)
    expected = seen(at, twice if depth == 3 else whole)
    images = exposures(inside(depth), 32, 64 if depth == 3 else 16)
    assert_mean(images, expected, 0.03, 2e-3)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["disk", "directional"])
@pytest.mark.parametrize("integrator", [Path(max_depth=2), Whitted(max_depth=1, ambient=0.0)])
def test_lights_that_are_sampled(kind: str, integrator: object) -> None:
    """A near disk, found by light and by material sampling, and a sun, by light sampling alone."""
    light = LIGHTS["D65"]
    scene = dataclasses.replace(plane(light), lights=[], integrator=integrator)
    if kind == "disk":
        scene.shapes.append(
            Disk(to_world=overhead(0.5), material=BLACK, emission=Area(radiance=light))
        )
    else:
        scene.lights.append(Directional(direction=(0.6, 0.0, -0.8), irradiance=light))
    at = lambdas()
    expected = seen(at, operator(at) @ light.sample(at)) * EXPECTED[kind] / np.pi
    assert_mean(exposures(scene, 24, 32), expected, 0.03, 2e-3)


@pytest.mark.slow
def test_a_sky_and_a_disk_share_the_weight() -> None:
    """The disk hides a part of the sky; what both give together has no seam."""
    light = LIGHTS["D65"]
    scene = plane(light)
    scene.shapes.append(Disk(to_world=overhead(1.5), material=BLACK, emission=Area(radiance=light)))
    at = lambdas()
    assert_mean(exposures(scene, 24, 32), seen(at, operator(at) @ light.sample(at)), 0.02, 2e-3)


@pytest.mark.slow
def test_one_wavelength_is_enough() -> None:
    """Behind glass that disperses, next to nothing, a path keeps its hero alone, which shifts."""
    means = []
    for index in (spectra.Constant(1.50004), spectra.Cauchy(1.5, 1e-5)):
        scene = plane(LIGHTS["D65"], lambda_min=360.0)
        pane = Dielectric(int_ior=index, ext_ior=1.0)
        scene.shapes.append(Rectangle(material=pane, to_world=tf.translate([0.0, 0.0, 0.02])))
        scene = dataclasses.replace(scene, integrator=Path(max_depth=5))
        means.append(exposures(scene, 24, 64).mean(axis=(1, 2)))
    assert agreement(*means) > 1e-4
    np.testing.assert_allclose(means[1].mean(axis=0), means[0].mean(axis=0), rtol=0.03, atol=0.02)


def test_light_goes_one_way() -> None:
    """Green light comes back orange; red light comes back as it was."""
    at = lambdas()
    for centre in (520.0, 680.0):
        light = Tabulated((centre - 10.0, centre, centre + 10.0), (0.0, 5.0, 0.0))
        kept = np.interp(at, *REFLECTS) * light.sample(at)
        image = exposures(plane(light), 16, 64).mean(axis=(0, 1, 2))
        brighter = image @ [0.2126, 0.7152, 0.0722] / (seen(at, kept) @ [0.2126, 0.7152, 0.0722])
        assert brighter > 3.0 if centre == 520.0 else brighter == pytest.approx(1.0, abs=0.03)


@pytest.mark.slow
def test_a_wider_range_lets_ultraviolet_in() -> None:
    """The same paint in the same light glows more where the film counts light from 300 nm on."""
    brightness = []
    for low in (300.0, 400.0):
        image = exposures(plane(LIGHTS["D65"], lambda_min=low), 8, 64).mean(axis=(0, 1, 2))
        at = lambdas(low)
        np.testing.assert_allclose(
            image[0], seen(at, operator(at) @ LIGHTS["D65"].sample(at))[0], rtol=0.02
        )
        brightness.append(image[0])
    assert brightness[0] > 1.03 * brightness[1]
    assert exposures(plane(LIGHTS["UV"], lambda_min=400.0), 2, 16).max() == 0.0


def test_no_light_is_made() -> None:
    """A dye that gives a photon for each, in white paint that keeps all else: a lossy furnace."""
    into = np.arange(300.0, 831.0, 5.0)
    dye = Fluorophore(Tabulated(*ABSORBS), Tabulated(*EMITS))
    rest = Tabulated(into, np.clip(1.0 - dye.emitted(into), 0.0, 1.0))
    Fluorescent(reflectance=rest, reradiation=dye)
    at = lambdas()
    given = dye.sample(at[:, None], at).sum(axis=0) * FINE
    assert np.all(given + rest.sample(at) < 1.005)


@pytest.mark.slow
def test_without_a_dye_it_is_diffuse() -> None:
    grey = Tabulated((300.0, 830.0), (0.2, 0.7))
    images = [exposures(plane(LIGHTS["A"], kind(reflectance=grey)), 16, 32)
              for kind in (Fluorescent, Diffuse)]  # fmt: skip
    np.testing.assert_allclose(images[0].mean(axis=0), images[1].mean(axis=0), rtol=1e-5)


@pytest.mark.slow
def test_rgb_has_the_colour_under_d65() -> None:
    """Half the dye, whose colour is within [0, 1]: the same as the spectral picture."""
    scene = plane(LIGHTS["D65"], dataclasses.replace(PAINT, amount=0.3))
    flat = with_film(scene, mode="rgb")
    assert any("D65" in warning for warning in lower(flat).warnings)
    assert not lower(scene).warnings
    image = exposures(scene, 24, 32).mean(axis=(0, 1, 2))
    expected = np.clip(image, 0.0, 1.0)
    np.testing.assert_allclose(clpt.render(flat, 16).mean(axis=(0, 1)), expected, atol=0.01)
    glaring = with_film(plane(LIGHTS["D65"]), mode="rgb")
    bright = np.array(LIGHTS["D65"].to_rgb("emission"))
    assert clpt.render(glaring, 256).mean(axis=(0, 1)).max() <= bright.max() + 1e-3


@pytest.mark.slow
def test_the_picture_does_not_depend_on_lanes() -> None:
    scene = inside(6)
    images = []
    for lanes in (1, 8, 16):
        device = clpt.device.choose()
        device.lanes = lanes
        images.append(clpt.render(scene, 4, device=device))
    for image in images[1:]:
        assert np.array_equal(image, images[0])


def test_too_much_light_is_refused() -> None:
    with pytest.raises(SceneError, match="would leave"):
        Fluorescent(reflectance=0.9, reradiation=DYE)
