"""A PBRT scene with all lights that Mitsuba has too, against Mitsuba's picture of the same.

Blocks of 4x4 pixels are compared by Welch's t-test, see tests/pictures/support.py.
"""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

import clpt
from clpt import images, spectra, transforms
from tests.pictures.support import assert_agree, blocks, exposures, with_film

mi = pytest.importorskip("mitsuba", reason="the renderer that we compare with is not installed")
pytestmark = pytest.mark.peers

GREY = spectra.Blackbody(6504.0, normalised=True).to_rgb("emission")


def radiance(d: np.ndarray) -> np.ndarray:
    """A smooth sky, of each direction (..., 3) another colour."""
    x, y, z = np.moveaxis(d, -1, 0)
    return np.stack([0.3 + 0.2 * x, 0.25 + 0.2 * y * z, 0.3 + 0.25 * z], axis=-1)


def octahedral_directions(size: int) -> np.ndarray:
    """Of the pixels of an equal-area octahedral image, by its definition (Clarberg 2008).

    Rings of equal areas around +z are squares of equal areas around the middle; within a quarter,
    azimuths are even.
    """
    y, x = np.meshgrid(*[(np.arange(size) + 0.5) / size * 2.0 - 1.0] * 2, indexing="ij")
    s = np.abs(x) + np.abs(y)
    from_pole = np.where(s <= 1.0, s, 2.0 - s)
    z = np.where(s <= 1.0, 1.0, -1.0) * (1.0 - from_pole**2)
    along = np.where(s <= 1.0, np.abs(y), 1.0 - np.abs(x))
    azimuth = 0.5 * np.pi * along / np.maximum(from_pole, 1e-12)
    r = np.sqrt(1.0 - z * z)
    return np.stack(
        [np.sign(x) * r * np.cos(azimuth), np.sign(y) * r * np.sin(azimuth), z], axis=-1
    )


@pytest.mark.slow
def test_every_light_that_both_have(scenes: Path, tmp_path: Path) -> None:
    shutil.copy(scenes / "pbrt" / "lights.pbrt", tmp_path)
    images.write(tmp_path / "octahedral.pfm", radiance(octahedral_directions(128)))
    theta = np.linspace(0.0, np.pi, 129)[:, None]  # Mitsuba's rows lie on the poles
    phi = (np.arange(256) + 0.5) * np.pi / 128
    d = [np.sin(phi) * np.sin(theta), np.cos(theta) + 0.0 * phi, -np.cos(phi) * np.sin(theta)]
    to_light = transforms.scale([-1.0, 1.0, 1.0]) @ transforms.rotate([0, 1, 0], 30.0)
    own = transforms.transform_vectors(to_light, np.stack(d, axis=-1))
    images.write(tmp_path / "sky.exr", 2.0 * radiance(own) + 0.05 * GREY, half=False)

    mi.set_variant("scalar_rgb")
    theirs = mi.load_file(str(scenes / "pbrt" / "lights.xml"), sky=str(tmp_path / "sky.exr"))
    made = [np.array(mi.render(theirs, spp=8, seed=seed))[..., :3] for seed in range(24)]
    scene = clpt.load(tmp_path / "lights.pbrt")
    assert not scene.warnings
    ours = exposures(with_film(scene, mode="rgb"), 48, 8)
    assert_agree(blocks(ours), blocks(made), "blocks", 4e-3)
    assert abs(ours.mean() / np.mean(made) - 1.0) < 0.015
