"""Negative values of images of light become 0, and a warning tells once for each image."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import clpt
from clpt.images.spectral_exr import SpectralImage
from clpt.render.flow.scene_to_tables import lower
from clpt.scene import Film, Scene, cameras, lights, shapes, textures

LAMBDAS = np.array([400.0, 500.0, 600.0, 700.0])


def pixels(*, negative: float = -0.25, rows: int = 8, columns: int = 16) -> np.ndarray:
    image = np.random.default_rng(1).uniform(0.5, 1.0, (rows, columns, 3)).astype(np.float32)
    image[2, 3, 1] = image[5, 7, 0] = negative
    return image


def spectra(values: np.ndarray) -> SpectralImage:
    return SpectralImage(np.repeat(values[..., :1], 4, axis=2), LAMBDAS, emissive=True)


def lit(kind: str, image: Any) -> Scene:
    """A scene whose light is an image."""
    camera, film = cameras.Perspective(), Film(width=8, height=8)
    if kind == "area":
        emission = lights.Area(radiance=textures.Bitmap(image=image))
        return Scene(camera=camera, film=film, shapes=[shapes.Rectangle(emission=emission)])
    lamps = {
        "envmap": lambda: lights.Envmap(image=image),
        "cube_map": lambda: lights.CubeMap(image=[image] + [pixels(negative=0.5)[:8, :8]] * 5),
    }
    return Scene(camera=camera, film=film, lights=[lamps[kind]()])


def told(scene: Scene) -> list[str]:
    return [text for text in lower(scene).warnings if "negative" in text]


@pytest.mark.parametrize("kind", ["envmap", "cube_map", "area"])
def test_negative_texels_are_told_once(kind: str) -> None:
    columns = 8 if kind == "cube_map" else 16
    (text,) = told(lit(kind, pixels(columns=columns)))
    assert f"2 of {8 * columns} texels have a negative value, down to -0.25" in text
    assert "count as 0" in text and text.startswith(("envmap", "cube_map", "bitmap"))
    assert not told(lit(kind, pixels(negative=0.0, columns=columns)))


def test_rounding_is_not_told() -> None:
    assert not told(lit("envmap", pixels(negative=-1e-8)))
    assert told(lit("envmap", np.full((8, 16, 3), -1.0, np.float32)))


def test_a_sky_of_spectra() -> None:
    """Its colours may be negative, as those of a laser: its spectra may not."""
    assert told(lit("envmap", spectra(pixels())))
    values = np.tile(np.array([0, 1, 0, 0], np.float32), (4, 8, 1))
    laser = SpectralImage(values, LAMBDAS, emissive=True)
    assert (laser.to_rgb() < 0).any() and not told(lit("envmap", laser))


def test_files_are_named_and_told_again_from_the_cache(tmp_path: Path) -> None:
    path = tmp_path / "sky.exr"
    clpt.write_image(path, pixels())
    for kind in ("envmap", "area"):
        first = lower(lit(kind, path))
        (text,) = [text for text in first.warnings if "negative" in text]
        assert "sky.exr: 2 of 128 texels" in text
        again = lower(lit(kind, path), former=first)
        assert [t for t in again.warnings if "negative" in t] == [text]
