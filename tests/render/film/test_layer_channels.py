"""Layers as channels of files: each of the table, by both names, beside colours and bands."""

from __future__ import annotations

import json

import numpy as np
import OpenEXR
import pytest

import clpt
from clpt import images
from clpt.__main__ import run
from clpt.images import spectral_exr
from clpt.render.film.colour import sensor
from clpt.render.film.layers import RANKS, SETS, channels_of, white_paper
from clpt.render.film.pictures import PictureForm, Still
from clpt.render.records.film import LayerNames
from clpt.scene import Film
from clpt.scene.layers import LAYERS
from clpt.spectra import cie

SIZE = (3, 5)


def pictures() -> dict[str, np.ndarray]:
    """A picture of every layer of the table, of numbers that halves cannot hold."""
    rng = np.random.default_rng(2)
    made = {}
    for name, layer in LAYERS.items():
        channels = 2 * RANKS if layer.form == "matte" else len(layer.channels)
        image = rng.uniform(70_000.0, 70_001.0, (*SIZE, channels)).astype(np.float32)
        made["light_key" if name == "light_groups" else name] = image
    return made


class Source(Still):
    """What a renderer has to show, without one."""

    def __init__(self, bands: int = 0):
        names = LayerNames(objects=("a ball", "a ball", "floor"), materials=("ink",))
        output = tuple(tuple(row) for row in np.eye(3).tolist())
        self.form = PictureForm(output, bands=bands, layers=tuple(LAYERS), names=names)

    def image(self):
        return np.full((*SIZE, 3), 0.5, np.float32)

    colours = image

    def layers(self):
        return pictures()

    def spectral_image(self):
        lambdas = self.form.band_centres
        return clpt.SpectralImage(np.ones((*SIZE, len(lambdas)), np.float32), lambdas, True)


@pytest.mark.parametrize("names", SETS)
def test_every_layer_comes_back(names, tmp_path):
    """In 32 bits, each channel under a name of its own, beside half colours."""
    path = tmp_path / "a.exr"
    clpt.write_layers(path, Source(), names=names)
    wanted = channels_of(pictures(), names)
    assert len(wanted) == sum(image.shape[2] for image in pictures().values())
    with OpenEXR.File(str(path), separate_channels=True) as file:
        found = {name: channel.pixels for name, channel in file.channels().items()}
    for name, values in wanted.items():
        assert found[name].dtype == np.float32
        np.testing.assert_array_equal(found[name], values)
    picture = "" if names == "clpt" else "ViewLayer.Combined."
    assert found.keys() - wanted.keys() == {f"{picture}{letter}" for letter in "RGB"}
    assert found[f"{picture}R"].dtype == np.float16
    np.testing.assert_array_equal(images.read(path), Source().image())


def test_names_of_blender():
    made = channels_of(pictures(), "blender")
    for name in (
        "Position.X", "Denoising Albedo.R", "Denoising Normal.Z", "IndexOB.X", "IndexMA.X",
        "Vector.W", "Combined_key.G", "CryptoObject00.r", "CryptoMaterial02.a",
        "Debug Sample Count.X",
    ):  # fmt: skip
        assert f"ViewLayer.{name}" in made
    assert all(name.startswith("ViewLayer.") for name in made)
    ours = channels_of(pictures())  # there vectors to the next picture point back
    for name, own, sign in (("X", "backward.u", 1), ("W", "forward.v", -1)):
        np.testing.assert_array_equal(made[f"ViewLayer.Vector.{name}"], sign * ours[own])


def test_a_spectral_file_has_layers_too(tmp_path, capsys):
    path = tmp_path / "a.exr"
    clpt.write_layers(path, Source(bands=4))
    assert spectral_exr.read(path).values.shape == (*SIZE, 4)
    channels = images.read_layers(path)
    np.testing.assert_array_equal(channels["depth.Z"], pictures()["depth"][..., 0])
    assert run(["inspect", str(path), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert "depth.Z" in said["layers"] and "S0" not in said["layers"]
    assert said["CryptoObject"] == "Cryptomatte, 2 names"


@pytest.mark.parametrize("wavelengths", [(300.0, 340.0), (900.0, 950.0), (360.0, 830.0)])
def test_white_paper_is_white(wavelengths):
    """Reflectance 1 at every wavelength gives ones; where nothing is seen, nothing divides by 0."""
    film = Film(lambda_min=wavelengths[0], lambda_max=wavelengths[1])
    with np.errstate(all="raise"):
        matrix = white_paper(film, "spectral")
    lambdas = np.arange(film.lambda_min, film.lambda_max + 1e-6)
    seen = sensor(film).sample(lambdas).sum(axis=0) / cie.CIE_Y_INTEGRAL
    np.testing.assert_allclose(matrix @ seen, 1.0 if seen.any() else 0.0, rtol=1e-6)
