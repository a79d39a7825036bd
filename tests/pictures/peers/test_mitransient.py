"""Light by time beside mitransient, which renders transients with Mitsuba: its Cornell box."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import clpt
from clpt.scene.integrators import LIGHT_SPEED, Box, Path

FIRST, WIDTH, BINS = 3.5, 0.25, 40  # optical lengths of the bins [m]


@pytest.mark.slow
def test_cornell_box():
    """Sums over the picture in each bin with more than a hundredth of the light, to 4 %."""
    mi = pytest.importorskip("mitsuba", reason="the renderer that we compare with")
    mi.set_variant("llvm_ad_rgb")
    box = pytest.importorskip("mitransient", reason="the renderer that we compare with")
    parts = box.cornell_box()
    bins = {"temporal_bins": BINS, "bin_width_opl": WIDTH, "start_opl": FIRST}
    parts["sensor"]["film"] |= {"width": 32, "height": 32, **bins}
    theirs = np.array(mi.render(mi.load_dict(parts), spp=1024)[1]).sum(axis=(0, 1))

    parts["sensor"]["film"] = {"type": "hdrfilm", "width": 32, "height": 32}
    parts["integrator"] = {"type": "path"}
    scene = clpt.load_dict(parts)
    ends = FIRST / LIGHT_SPEED, (FIRST + BINS * WIDTH) / LIGHT_SPEED
    film = dataclasses.replace(
        scene.film, mode="rgb", filter=Box(), time_bins=BINS, time_min=ends[0], time_max=ends[1]
    )
    scene = dataclasses.replace(scene, film=film, integrator=Path(light_paths=0, max_depth=8))
    with clpt.Renderer(scene) as renderer:
        renderer.run(1024)
        ours = renderer.times()[:, :, :-1].sum(axis=(0, 1))
    bright = theirs > 0.01 * theirs.sum(axis=0)
    assert bright.sum() > 30
    np.testing.assert_allclose(ours[bright], theirs[bright], rtol=0.04)
