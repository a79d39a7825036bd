"""Encodings by the names of the Color Interop Forum, alone and in OpenEXR files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import OpenEXR
import pytest

import clpt
from clpt.images import interop
from clpt.images.colour import linear_to_srgb
from clpt.scene import Film, Scene, cameras, lights
from clpt.spectra import spaces

COLOURS = np.array([[[0.05, 0.4, 0.9], [0.7, 0.2, 0.3]]], np.float32)  # linear Rec. 709
TO = {
    "rec709": np.eye(3), "p3d65": spaces.between("rec709", "display_p3"),
    "rec2020": spaces.between("rec709", "rec2020"), "ap0": spaces.between("rec709", "aces2065_1"),
    "ap1": spaces.between("rec709", "acescg"), "ciexyzd65": spaces.to_xyz("rec709"),
}  # fmt: skip
CURVES = {
    "lin": lambda light: light,
    "srgb": linear_to_srgb,
    "g22": lambda light: np.maximum(light, 0.0) ** (1.0 / 2.2),
    "g24": lambda light: np.maximum(light, 0.0) ** (1.0 / 2.4),
}


def written(path: Path, name: str, pixels: np.ndarray) -> Path:
    header = {"compression": OpenEXR.NO_COMPRESSION, "type": OpenEXR.scanlineimage}
    channels = {"RGB": np.ascontiguousarray(pixels, np.float32)}
    with OpenEXR.File({**header, "colorInteropID": name}, channels) as file:
        file.write(str(path))
    return path


@pytest.mark.parametrize("primaries", TO)
@pytest.mark.parametrize("curve", CURVES)
def test_a_file_of_each_encoding_has_the_same_colours(tmp_path, curve, primaries):
    state = "display" if curve in ("g24",) else "scene"
    encoded = CURVES[curve]((COLOURS @ TO[primaries].T).astype(np.float32))
    path = written(tmp_path / "a.exr", f"{curve}_{primaries}_{state}", encoded)
    np.testing.assert_allclose(clpt.read_image(path), COLOURS, atol=3e-5)


def test_a_sky_has_them_too_and_numbers_stay_as_they_are(tmp_path):
    """An even sky, encoded, lights a camera as its colours; raw numbers are what is stored."""
    even = np.broadcast_to(COLOURS[:, :1], (4, 8, 3))
    path = written(tmp_path / "a.exr", "srgb_rec709_display", linear_to_srgb(even))
    scene = Scene(
        camera=cameras.Perspective(), lights=[lights.Envmap(image=path)],
        film=Film(size=(2, 2), mode="rgb"),
    )  # fmt: skip
    np.testing.assert_allclose(clpt.render(scene, spp=4)[0, 0], COLOURS[0, 0], rtol=1e-4)
    np.testing.assert_array_equal(clpt.read_image(path, linear=False)[0], linear_to_srgb(even)[0])


@pytest.mark.parametrize("name", ["pq_rec2020_display", "hlg_rec2020_display", "srgb_mine_scene"])
def test_other_names_are_left_out_with_a_warning(tmp_path, name, caplog):
    assert interop.encoding(name) is None
    path = written(tmp_path / "a.exr", name, COLOURS)
    np.testing.assert_array_equal(clpt.read_image(path), COLOURS)
    assert name in caplog.text


@pytest.mark.parametrize("name", ["data", "unknown", ""])
def test_names_that_state_nothing(tmp_path, name):
    path = written(tmp_path / "a.exr", name, COLOURS)
    np.testing.assert_array_equal(clpt.read_image(path), COLOURS)
