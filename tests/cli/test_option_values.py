"""Whatever is given to an option is a value or is refused in words: never a fault."""

from __future__ import annotations

import math

import click
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from clpt.cli.inspect import PixelType
from clpt.cli.options.applied import changed
from clpt.cli.options.changes import SceneChanges
from clpt.cli.options.composition import CameraType, CropType
from clpt.cli.options.loading_options import Bytes
from clpt.cli.options.values import (
    Count,
    LightPaths,
    Names,
    Noise,
    SensorName,
    Size,
    Stops,
    White,
)
from clpt.cli.options.workers import Where
from clpt.cli.render.frame_values import Frames
from clpt.cli.render.settings import Address, Duration, Period, SampleRange
from clpt.errors import SceneError
from clpt.scene import Scene
from clpt.scene.cameras import Perspective

KINDS = (
    CameraType(), CropType(), Frames(), PixelType(), Where(), Duration(), Period(), SampleRange(),
    Bytes(), LightPaths(), Names(["depth", "albedo"]), SensorName(), Size(), White(), Address(),
    Count(), Noise(), Stops(),
)  # fmt: skip
ALPHABET = "0123456789.,:-+%x/hmsKMGTB einfat"
TEXTS = st.text(ALPHABET, max_size=12) | st.text(max_size=12) | st.text("09", max_size=500)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: type(kind).__name__)
@given(text=TEXTS)
@example(text="\0")
@example(text="9" * 400)
@example(text="nan,inf")
@settings(max_examples=60, deadline=None)
def test_any_text(kind, text):
    try:
        kind(text)
    except (click.BadParameter, SceneError) as error:
        assert str(error)


@given(
    size=st.tuples(st.integers(1, 65536), st.integers(1, 65536)),
    crop=st.text("0123456789%:,.", max_size=14) | st.just("10%:90%,5:"),
    camera=st.tuples(*[st.floats(-1e3, 1e3)] * 3),
)
def test_what_is_accepted_makes_a_scene_or_is_refused(size, crop, camera):
    scene = Scene(camera=Perspective())
    try:
        orbit = CameraType()(",".join(map(repr, camera)))
        made = changed(scene, SceneChanges.of(size=size, crop=CropType()(crop), camera=orbit))
    except click.BadParameter as error:
        assert error.format_message()
        return
    x, y, width, height = made.film.crop
    assert 0 <= x < x + width <= size[0] and 0 <= y < y + height <= size[1]
    assert all(map(math.isfinite, made.camera.to_world.ravel()))
