"""Textures and surroundings with a spectrum in every texel, against references in float64."""

from __future__ import annotations

import numpy as np
import pytest

from clpt.errors import SceneError
from clpt.images.spectral_exr import SpectralImage
from clpt.render.materials.encoder import Encoder
from clpt.render.textures.cases import dispatch_text
from clpt.render.textures.texels import FAR, bands
from clpt.scene import roles
from clpt.scene import textures as scene
from clpt.scene.lights import Constant, CubeMap, Envmap
from clpt.spectra import Tabulated, luminance
from tests.kernels.light_probe import lit
from tests.kernels.test_lights import INFINITE, SIGMAS, TURNED, directions, irradiance
from tests.kernels.test_textures import LAMBDAS, _uvs, look_up, reference
from tests.kernels.test_textures import TURNED as TURNED_UV

ODD = np.array([400.0, 431.0, 470.0, 555.0, 556.0, 620.0, 689.0])  # 690 nm lies beyond
EVEN = np.linspace(380.0, 730.0, 36)
BEYOND = np.linspace(700.0, 900.0, 9)  # what is seen at 420 nm lies far below


def image(lambdas=ODD, emissive=False, size=(5, 7), top=1.0, seed=4):
    values = np.random.default_rng(seed).random((*size, len(lambdas))) * top
    return SpectralImage(values, lambdas, emissive)


def seen(made: SpectralImage, lambdas) -> np.ndarray:
    """Values (h, w, k) of an image at wavelengths, pixel by pixel."""
    return np.array(
        [[made.spectrum(pixel).sample(lambdas) for pixel in row] for row in made.values]
    )


@pytest.mark.parametrize("lambdas", [ODD, EVEN, BEYOND, EVEN[:2]], ids=len)
@pytest.mark.parametrize("role", ["reflectance", "emission"])
def test_a_texture_has_the_spectra_of_its_image(role, lambdas):
    made = image(lambdas, role == "emission", top=1.0 if role == "reflectance" else 40.0)
    uv = _uvs()
    texture = scene.Bitmap(image=made, wrap="mirror", to_uv=TURNED_UV)
    expected = reference(seen(made, LAMBDAS), uv, TURNED_UV, wrap="mirror")
    found = look_up([texture], role, uv, mode="spectral")
    np.testing.assert_allclose(found, expected, atol=3e-5 * made.values.max())


def test_beyond_its_ends_a_reflectance_goes_on_and_light_ends():
    """The probe looks at 420, 500.5, 577.25 and 690 nm; the bands are at 500 and 600 nm."""
    for emissive, ends in ((False, (0.25, 0.75)), (True, (0.0, 0.0))):
        made = SpectralImage(np.array([[[0.25, 0.75]]]), [500.0, 600.0], emissive)
        found = look_up([scene.Bitmap(image=made)], _role(emissive), [[0.5, 0.5]], mode="spectral")
        np.testing.assert_allclose(found[0], [ends[0], 0.2525, 0.63625, ends[1]], atol=1e-5)


def _role(emissive):
    return "emission" if emissive else "reflectance"


@pytest.mark.parametrize("emissive", [False, True])
def test_rgb_mode_takes_the_image_s_colour(emissive):
    made = image(EVEN, emissive, top=0.9)
    uv = _uvs()
    colours = made.to_rgb().astype(np.float64)
    colours = np.clip(colours, 0.0, None if emissive else 1.0)
    found = look_up([scene.Bitmap(image=made)], _role(emissive), uv)
    np.testing.assert_allclose(found, reference(colours, uv), atol=5e-5)


def test_numbers_are_the_luminance_of_the_colour():
    made = image(EVEN)
    uv = _uvs()
    expected = reference(luminance(made.to_rgb())[..., None], uv)[:, 0]
    for mode in ("rgb", "spectral"):
        found = look_up([scene.Bitmap(image=made)], "real", uv, mode=mode)
        np.testing.assert_allclose(found, expected, atol=2e-5)


def test_lanes_and_neighbours_of_other_kinds_do_not_matter():
    made = [
        scene.Bitmap(image=image()),
        scene.Checkerboard(),
        scene.Bitmap(image=np.random.default_rng(7).random((3, 4, 3))),
        scene.Bitmap(image=image(EVEN), filter="nearest"),
    ]
    uv = _uvs(96)
    rows = np.arange(len(uv)) * 7 % 4
    mixed, single, wide = (
        look_up(made, "reflectance", uv, mode="spectral", rows=rows, lanes=n) for n in (8, 1, 16)
    )
    np.testing.assert_array_equal(mixed, wide)
    np.testing.assert_allclose(mixed, single, atol=1e-6)
    for i, texture in enumerate(made):
        alone = look_up([texture], "reflectance", uv[rows == i], mode="spectral")
        np.testing.assert_allclose(mixed[rows == i], alone, atol=1e-6)


def test_only_the_bands_of_the_film_s_range_are_kept():
    made = SpectralImage(np.arange(200.0).reshape(1, 1, -1), np.arange(200) * 10.0 + 5.0, True)
    values, number = bands(made, 400.0, 700.0)
    assert values.shape == (1, 32)  # 395 to 705 nm
    np.testing.assert_allclose(number.sample([395.0, 400.0, 705.0]), [0.0, 0.5, 31.0])
    assert number.values[0] == -FAR
    encoder = Encoder("spectral", 400.0, 700.0)
    encoder.textures.row(scene.Bitmap(image=made), roles.EMISSION)
    assert encoder.store.size("texels") == 4 + 32
    for lo, hi in ((1.0, 2.0), (3000.0, 4000.0)):
        assert bands(made, lo, hi)[0].shape == (1, 2)


def test_scenes_without_spectral_images_do_not_hold_their_text():
    encoder = Encoder("spectral")
    encoder.textures.row(scene.Bitmap(image=np.zeros((2, 2, 3))), roles.REFLECTANCE)
    encoder.textures.finish()
    text = dispatch_text(encoder.textures.features())
    assert "pectral" not in text.replace("spectrum", "")
    assert "bands" not in text


def test_a_role_needs_its_kind_of_spectra():
    for role, emissive, words in (
        (roles.REFLECTANCE, True, "holds light .* where reflectances"),
        (roles.EMISSION, False, "holds reflectances .* where light"),
    ):
        with pytest.raises(SceneError, match=words):
            Encoder("spectral").textures.row(scene.Bitmap(image=image(emissive=emissive)), role)
    with pytest.raises(SceneError, match="two wavelengths"):
        Encoder("spectral").textures.row(scene.Bitmap(image=image(ODD[:1])), roles.REFLECTANCE)
    with pytest.raises(SceneError, match="envmap only"):
        lit([CubeMap(image=[image(emissive=True, size=(4, 4))] * 6)])
    with pytest.raises(SceneError, match="holds reflectances"):
        lit([Envmap(image=image())])


@pytest.mark.parametrize("mode", ["rgb", "spectral"])
def test_an_even_envmap_is_a_constant_light(mode):
    curve = Tabulated(EVEN, np.linspace(0.5, 2.0, len(EVEN)))
    sky = SpectralImage(np.broadcast_to(curve.values, (4, 8, len(EVEN))), EVEN, True)
    d = directions(64, 1)
    found = lit([Envmap(image=sky, scale=2.0)], mode=mode)(INFINITE, d, 4)[:3]
    even = lit([Constant(radiance=Tabulated(EVEN, np.array(curve.values) * 2.0))], mode=mode)
    np.testing.assert_allclose(found, even(INFINITE, d, 4)[:3], rtol=2e-5)


def test_an_envmap_is_sampled_by_what_it_sends():
    """Irradiance from samples of the light is that from directions met at random."""
    sky = image(EVEN, True, size=(9, 16), top=3.0)
    scene_ = lit([Envmap(image=sky, to_world=TURNED)], mode="spectral")
    d = directions(1 << 17, 2)
    met = scene_(INFINITE, d, 4)[:3].astype(np.float64) * np.maximum(d[2], 0.0)
    expected = 4.0 * np.pi * met.mean(axis=1)
    spread = 4.0 * np.pi * met.std(axis=1) / np.sqrt(d.shape[1])
    found, error = irradiance(scene_, np.zeros(3))
    assert (np.abs(found - expected) < SIGMAS * np.hypot(spread, error)).all()
    assert (error < 0.01 * expected).all()


def test_light_that_nobody_sees_is_sampled_too():
    sky = SpectralImage(np.ones((4, 8, 3)), [900.0, 950.0, 1000.0], True)
    assert (lit([Envmap(image=sky)], mode="spectral")(INFINITE, directions(16, 1), 4)[3] > 0).all()
