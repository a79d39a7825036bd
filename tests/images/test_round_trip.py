"""What is written in any space and format is read as what was rendered."""

from __future__ import annotations

import numpy as np
import pytest

from clpt import images
from clpt.images import spectral_exr
from clpt.spectra import spaces

# Of each format: the options, and how far off a value may be: relative, absolute.
FORMATS = {
    "float.exr": ({"half": False}, 1e-5, 1e-6),
    "half.exr": ({}, 2e-3, 2e-3),
    "a.hdr": ({}, 0.0, 1.5 / 128),
    "a.pfm": ({}, 1e-5, 1e-6),
    "a.png": ({}, 0.02, 0.01),
}


@pytest.mark.parametrize("name", FORMATS)
@pytest.mark.parametrize("space", spaces.SPACES)
@pytest.mark.parametrize("channels", [1, 3, 4])
def test_every_space_in_every_format(tmp_path, name, space, channels):
    options, relative, absolute = FORMATS[name]
    random = np.random.default_rng(3)
    rendered = random.uniform(0.05, 0.95, (5, 7, channels)).astype(np.float32)
    stored = rendered.copy()
    if channels > 1:
        stored[..., :3] = rendered[..., :3] @ spaces.between("rec709", space).T
    stored = images.multiplied(stored) if name.endswith(".png") else stored
    images.write(tmp_path / name, stored, space=space, **options)
    back = images.read(tmp_path / name)
    if name.endswith((".hdr", ".pfm")):  # they have no alpha
        rendered = rendered[..., :3]
    if back.shape[2] == 3 and channels == 1:  # RGBE has three
        rendered = np.repeat(rendered, 3, axis=2)
    np.testing.assert_allclose(back, rendered, relative, absolute)


def test_numpy_arrays_are_as_they_are(tmp_path):
    values = np.full((2, 2, 3), (0.8, 0.3, 0.1), np.float32)
    images.write(tmp_path / "a.npy", values, space="acescg")
    np.testing.assert_array_equal(images.read(tmp_path / "a.npy"), values)


def test_a_spectral_image_in_its_window(tmp_path):
    """A crop of bands is read as the whole picture, zero outside."""
    bands = np.ones((2, 4), np.float32)
    channels = {f"S0.{nm},000000nm": nm / 100 * bands for nm in (400, 500, 600)}
    window = {"dataWindow": ((2, 1), (5, 2)), "displayWindow": ((0, 0), (7, 3))}
    images.write_channels(tmp_path / "a.exr", window, channels)
    values = spectral_exr.read(tmp_path / "a.exr").values
    assert values.shape == (4, 8, 3)
    assert values[1, 2].tolist() == [4, 5, 6]
    assert values[0, 0].tolist() == [0, 0, 0]
