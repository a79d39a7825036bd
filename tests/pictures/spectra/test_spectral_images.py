"""Charts with a spectrum in every patch: pictures have the colours that the spectra give."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import clpt
from clpt import spectra
from clpt import transforms as tf
from clpt.formats.native.write import save
from clpt.images.spectral_exr import SpectralImage
from clpt.render.flow.scene_to_tables import lower
from clpt.render.scene_index import SceneIndex
from clpt.render.spectra.find import Density, density
from clpt.scene import Film, Scene
from clpt.scene.cameras import Orthographic
from clpt.scene.integrators import Path as PathIntegrator
from clpt.scene.lights import Area, Constant, Envmap
from clpt.scene.materials import Diffuse
from clpt.scene.shapes import Rectangle
from clpt.scene.textures import Bitmap
from tests.pictures.builders import BLACK, UP
from tests.pictures.support import assert_agree, exposures, with_film

FINE = np.arange(360.0, 830.0, 0.5)  # [nm]
SCENES = Path(__file__).resolve().parents[3] / "scenes"
SIZE = {"width": 60, "height": 40}


def colour(values, lambdas, light, outside) -> np.ndarray:
    """Linear Rec. 709 (..., 3) of spectra (..., n) under a light, by a sum over FINE."""
    flat = np.asarray(values, np.float64).reshape(-1, len(lambdas))
    ends = (None, None) if outside == "hold" else (0.0, 0.0)
    fine = np.array([np.interp(FINE, lambdas, v, *ends) for v in flat]) * light
    xyz = fine @ spectra.cie_xyz(FINE) * 0.5 / spectra.CIE_Y_INTEGRAL
    return (xyz @ spectra.XYZ_TO_REC709.T).reshape(*np.shape(values)[:-1], 3)


def chart(texture: Bitmap, glowing: bool, lamp=None) -> Scene:
    """A chart of 6 x 4 patches that fills the film, lit from everywhere or glowing itself."""
    plain = {"material": Diffuse(reflectance=texture)}
    glow = {"material": BLACK, "emission": Area(radiance=texture)}
    view = tf.look_at([0, 0, 4], [0, 0, 0], UP) @ tf.scale([1.5, 1.5, 1.0])
    return Scene(
        camera=Orthographic(to_world=view),
        shapes=[Rectangle(to_world=tf.scale([1.5, 1.0, 1.0]), **(glow if glowing else plain))],
        lights=[] if lamp is None else [lamp],
        integrator=PathIntegrator(max_depth=2),
        film=Film(**SIZE),
    )


def patches(images: np.ndarray) -> np.ndarray:
    """The means of the middle of each patch, (k, 4, 6, 3)."""
    k = len(images)
    return images.reshape(k, 4, 10, 6, 10, 3)[:, :, 3:7, :, 3:7].mean(axis=(2, 4))


@pytest.fixture
def macbeth(assets):
    return assets / "spectral" / "spectral-exr" / "Macbeth.exr"


def middles(image: SpectralImage) -> np.ndarray:
    """The spectra (4, 6, n) in the middles of the patches of 100 x 100 texels."""
    return image.values[55::100, 55::100]


def density_of(scene: Scene) -> Density:
    return density(SceneIndex.of(scene))


@pytest.mark.parametrize("lamp", ["D65", "A"])
def test_macbeth_s_chart(macbeth, lamp):
    """Under daylight and under a filament, every patch is of its colour."""
    image, light = clpt.read_spectral(macbeth), spectra.illuminant(lamp)
    scene = chart(Bitmap(image=macbeth), False, Constant(radiance=light))
    expected = colour(middles(image), image.lambdas, light.sample(FINE), "hold")
    found = patches(exposures(scene, 8, 16))
    assert_agree(found, expected[None], lamp, allowed=2e-3)
    assert (expected.max(axis=2) > 0.02).all()


def test_macbeth_s_chart_in_rgb_mode(macbeth):
    """What stands for a spectrum there is its colour under D65, cut at the edge of Rec. 709."""
    image, light = clpt.read_spectral(macbeth), spectra.RGBIlluminant(1.0, 1.0, 1.0)
    scene = with_film(chart(Bitmap(image=macbeth), False, Constant(radiance=light)), mode="rgb")
    expected = colour(middles(image), image.lambdas, light.sample(FINE), "hold")
    found = patches(exposures(scene, 8, 16))
    assert_agree(found, np.clip(expected, 0.0, 1.0)[None], allowed=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["spectral", "rgb"])
def test_a_chart_that_glows(mode):
    """Narrow bands at uneven wavelengths, dark beyond the ends."""
    lambdas = np.array([410.0, 450.0, 470.0, 520.0, 575.0, 580.0, 640.0])
    values = np.random.default_rng(3).random((4, 6, 7)) ** 4 * 5.0
    texture = Bitmap(image=SpectralImage(values, lambdas, True), filter="nearest")
    found = patches(exposures(with_film(chart(texture, True), mode=mode), 8, 16))
    expected = colour(values, lambdas, 1.0, "zero")
    if mode == "rgb":
        np.testing.assert_allclose(found[0], np.maximum(expected, 0.0), rtol=1e-2, atol=1e-2)
    else:
        assert_agree(found, expected[None], allowed=5e-3)


@pytest.mark.slow
def test_surroundings_of_one_spectrum_are_a_constant_light():
    lambdas = np.linspace(360.0, 830.0, 48)
    values = spectra.illuminant("A").sample(lambdas)
    sky = SpectralImage(np.broadcast_to(values, (6, 12, 48)), lambdas, True)
    texture = Bitmap(image=np.random.default_rng(4).random((4, 6, 3)), filter="nearest")
    lamps = Envmap(image=sky), Constant(radiance=spectra.Tabulated(lambdas, values))
    ours, reference = (patches(exposures(chart(texture, False, lamp), 8, 16)) for lamp in lamps)
    assert_agree(ours, reference)


def test_wavelengths_are_drawn_where_an_image_shines():
    """As for a light of the image's mean spectrum, here a line too narrow for the eye's density."""
    lambdas = np.array([586.0, 589.0, 592.0])
    values = np.array([[0.0, 3.0, 0.0], [0.0, 1.0, 0.0]])
    line = spectra.Tabulated(lambdas, [0.0, 2.0, 0.0])
    sky = SpectralImage(np.broadcast_to(values[:, None], (2, 4, 3)), lambdas, True)
    blank = Bitmap(image=np.ones((2, 2, 3)))
    glow = Bitmap(image=sky)
    scenes = [chart(blank, False, Envmap(image=sky)), chart(glow, True)]
    expected = density_of(chart(blank, False, Constant(radiance=line))).values
    assert expected is not None
    for scene in scenes:
        np.testing.assert_allclose(density_of(scene).values, expected, rtol=1e-6)


def test_daylight_hides_what_an_amber_lamp_shows():
    """The whale and the sea beside it: the same colour under D65, far from it under the LED."""
    image = clpt.read_spectral(SCENES / "hidden_whale" / "painting.exr")
    whale, sea = image.values[205, 260], image.values[285, 20]
    light, lamp = (s.sample(FINE) for s in (spectra.illuminant("D65"), spectra.LED(594.0, 16.0)))
    day = colour(np.stack([whale, sea]), image.lambdas, light, "hold")
    night = colour(np.stack([whale, sea]), image.lambdas, lamp, "hold")
    np.testing.assert_allclose(day[0], day[1], atol=1e-3)
    assert night[0, 0] > 4.0 * night[1, 0]


def test_from_a_scene_file(tmp_path):
    """A spectral EXR file is a `bitmap` and an `envmap` like any other image."""
    lambdas = np.array([400.0, 500.0, 600.0, 700.0])
    values = np.random.default_rng(5).random((4, 6, 4)).astype(np.float32)
    clpt.write_spectral(tmp_path / "chart.exr", SpectralImage(values, lambdas))
    sky = SpectralImage(np.ones((2, 4, 4)), lambdas, True)
    clpt.write_spectral(tmp_path / "sky.exr", sky)
    text = {
        "camera": {"type": "orthographic"},
        "film": {"width": 8, "height": 4},
        "lights": [{"type": "envmap", "image": "sky.exr"}],
        "shapes": [
            {
                "type": "rectangle",
                "material": {
                    "type": "diffuse",
                    "reflectance": {"type": "bitmap", "image": "chart.exr"},
                },
            }
        ],
    }
    (tmp_path / "scene.json").write_text(json.dumps(text))
    renderer = clpt.Renderer(clpt.load(tmp_path / "scene.json"))
    features = renderer._wavefront.features
    assert features.textures.kinds == ("spectral_bitmap",)
    assert features.lights.kinds == ("spectral_envmap",)
    renderer.run(1)
    assert renderer.image().min() > -0.5
    assert renderer.image().max() > 0.1


XML = """
<scene version="3.0.0">
    <sensor type="orthographic"><film type="hdrfilm"/></sensor>
    <emitter type="envmap"><string name="filename" value="sky.exr"/></emitter>
    <shape type="rectangle"><bsdf type="diffuse"><texture type="bitmap" name="reflectance">
        <string name="filename" value="chart.exr"/></texture></bsdf></shape>
</scene>
"""


def test_from_mitsuba_and_written_as_ours(tmp_path):
    """Mitsuba's plugins name the same files; a spectral image in memory is written as one."""
    made = SpectralImage(np.random.default_rng(6).random((2, 3, 4)), [400.0, 500.0, 600.0, 700.0])
    clpt.write_spectral(tmp_path / "chart.exr", made)
    sky = SpectralImage(np.ones((2, 4, 2)), [400.0, 700.0], True)
    clpt.write_spectral(tmp_path / "sky.exr", sky)
    (tmp_path / "scene.xml").write_text(XML)
    scene = clpt.load(tmp_path / "scene.xml")
    found = lower(scene).features
    assert found.textures.kinds == ("spectral_bitmap",)
    assert found.lights.kinds == ("spectral_envmap",)
    scene.lights = [Envmap(image=sky)]
    save(scene, tmp_path / "scene.json")
    (lamp,) = clpt.load(tmp_path / "scene.json").lights
    np.testing.assert_array_equal(clpt.read_spectral(lamp.image).values, sky.values)
