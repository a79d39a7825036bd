"""JPEG and WebP beside PNG: the same codes, but for what they lose."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image

import clpt
from clpt import images
from clpt.errors import SceneError

RAMP = np.linspace(0.0, 1.0, 64, dtype=np.float32)[None, :, None] * np.ones((64, 1, 3), np.float32)


@pytest.mark.parametrize("suffix", [".jpg", ".jpeg", ".webp", ".JPG"])
@pytest.mark.parametrize("how", [{}, {"exposure": -1.0, "tone": "agx"}, {"exposure": "auto"}])
def test_codes_are_nearly_those_of_a_png(tmp_path, suffix, how):
    for name in ("a.png", f"a{suffix}"):
        clpt.write_image(tmp_path / name, RAMP, **how)
    exact, found = (
        np.asarray(Image.open(tmp_path / name), int) for name in ("a.png", f"a{suffix}")
    )
    assert np.abs(found - exact).max() <= 3
    assert images.read(tmp_path / f"a{suffix}").shape == (64, 64, 3)


def test_grey_and_alpha(tmp_path):
    clpt.write_image(tmp_path / "grey.jpg", RAMP[..., :1])
    assert Image.open(tmp_path / "grey.jpg").mode == "L"
    covered = np.concatenate([RAMP, np.full((64, 64, 1), 0.5, np.float32)], axis=2)
    clpt.write_image(tmp_path / "a.webp", covered)
    assert Image.open(tmp_path / "a.webp").mode == "RGBA"
    clpt.write_image(tmp_path / "a.jpg", images.multiplied(covered))  # over black
    clpt.write_image(tmp_path / "half.png", RAMP * 0.5)
    two = [np.asarray(Image.open(tmp_path / name), int) for name in ("a.jpg", "half.png")]
    assert np.abs(two[0] - two[1]).max() <= 3


@pytest.mark.parametrize("suffix", [".jpg", ".webp"])
def test_how_it_was_made_stands_in_exif(tmp_path, suffix):
    clpt.write_image(tmp_path / f"a{suffix}", RAMP, metadata={"software": "clpt 1", "spp": 4})
    exif = Image.open(tmp_path / f"a{suffix}").getexif()
    assert (exif[0x0131], exif[0x010E]) == ("clpt 1", "software: clpt 1\nspp: 4")


def test_a_side_that_the_format_cannot_have(tmp_path):
    with pytest.raises(SceneError, match="cannot be written"):
        clpt.write_image(tmp_path / "a.webp", np.zeros((1, 16_400, 3), np.float32))
    assert not list(tmp_path.iterdir())
