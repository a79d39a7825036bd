"""A scene in PBRT's format beside Mitsuba's picture of the same scene in its own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import clpt
from tests.pictures.peers.test_mitsuba import COLOURS, mitsuba_exposures
from tests.pictures.support import assert_agree, blocks, exposures, with_film

pytestmark = pytest.mark.peers


def test_the_box(scenes: Path) -> None:
    """Camera, depths, light and colours, mirrors, patches and instances, by Welch's t-test."""
    scene = clpt.load(scenes / "cornell.pbrt")
    assert scene.warnings == []
    reference = mitsuba_exposures(scenes / "cornell.xml", "rgb", 16, 8)
    ours = exposures(with_film(scene, mode="rgb"), 32, 8)
    assert_agree(blocks(ours), blocks(reference), "blocks of the box", COLOURS)
    assert abs(np.mean(ours) / np.mean(reference) - 1.0) < 0.015
