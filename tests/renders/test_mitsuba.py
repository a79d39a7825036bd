"""Pictures against Mitsuba 3: the same small scenes, in the same run, in RGB and spectral.

Both render many times with different seeds. Blocks of 4x4 pixels are compared by Welch's t-test,
corrected for their number, at the significance of tests/renders/support.py; the mean radiance too,
and that also within a bound.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import clpt
from tests.renders.support import assert_agree, blocks, exposures, with_film, with_path

mi = pytest.importorskip("mitsuba", reason="the renderer that we compare with is not installed")
pytestmark = pytest.mark.peers

SCENES = (
    "cornell", "delta_lights", "envmap", "glass_metal", "instances", "light_tracing",
    "orthographic", "plastic", "spectra", "textures", "thin_lens",
)  # fmt: skip
# Mitsuba's envmap is up to a quarter off its own RGB picture in spectral mode, where texels are
# saturated; tests/renders/test_spectral.py holds ours to the RGB picture instead.
CASES = [(name, mode) for name in SCENES for mode in ("rgb", "spectral")]
CASES.remove(("envmap", "spectral"))
CASES.remove(("spectra", "rgb"))  # of black bodies Mitsuba has no colour
# The rest is left to the sweep of many samples.
LEFT = [("instances", "spectral"), ("plastic", "rgb"), ("textures", "rgb"), ("orthographic", "rgb")]
QUICK = [case for case in CASES if case not in LEFT]
MEAN_WITHIN = 0.015  # relative; at a quick test's number of samples most of it is noise
COLOURS = 2e-3  # relative; the steps of the two programs' colour tables differ


def mitsuba_exposures(path: Path, mode: str, count: int, spp: int, **defaults: int) -> np.ndarray:
    """Render `count` times with Mitsuba: (count, h, w, 3) float64; `defaults` fill in $names."""
    mi.set_variant(f"scalar_{mode}")  # of its variants the ones that need no LLVM
    scene = mi.load_file(str(path), **{name: str(value) for name, value in defaults.items()})
    images = [np.array(mi.render(scene, spp=spp, seed=seed))[:, :, :3] for seed in range(count)]
    return np.array(images, np.float64)


def compare(path: Path, mode: str, count: int, spp: int, within: float) -> None:
    """Compare the pictures of a scene file, block by block and in the mean."""
    reference = mitsuba_exposures(path, mode, count, spp)
    ours = exposures(with_film(clpt.load(path), mode=mode), 2 * count, spp)
    ratio = ours.mean() / reference.mean()
    assert_agree(blocks(ours), blocks(reference), f"blocks of {path.stem}, {mode}", COLOURS)
    means = [a.mean(axis=(1, 2), keepdims=True) for a in (ours, reference)]
    assert_agree(*means, f"mean of {path.stem}, {mode}", COLOURS)
    assert abs(ratio - 1.0) < within, f"mean radiance is {ratio:.4f} of Mitsuba's"


@pytest.mark.parametrize(("name", "mode"), QUICK)
def test_pictures(scenes: Path, name: str, mode: str) -> None:
    compare(scenes / f"{name}.xml", mode, 24, 8, MEAN_WITHIN)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "mode"), CASES)
def test_pictures_of_many_samples(scenes: Path, name: str, mode: str) -> None:
    compare(scenes / f"{name}.xml", mode, 64, 64, 0.003)


@pytest.mark.parametrize("depth", [1, 2, 3])
def test_depths(scenes: Path, depth: int) -> None:
    """A path of depth 1 sees lights only, 2 adds direct light, 3 one reflection more."""
    path = scenes / "cornell.xml"
    reference = mitsuba_exposures(path, "rgb", 16, 4, max_depth=depth)
    scene = with_path(with_film(clpt.load(path), mode="rgb"), max_depth=depth)
    assert_agree(blocks(exposures(scene, 32, 4)), blocks(reference), allowed=COLOURS)
