"""Whatever is given to an option is a value or is refused in words: never a fault."""

from __future__ import annotations

import math

import click
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from clpt.cli import COMMANDS, cli
from clpt.cli.inspect import PixelType
from clpt.cli.options.applied import changed
from clpt.cli.options.changes import CameraType, CropType, SceneChanges
from clpt.cli.options.scene_options import Bytes, Where
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
from clpt.cli.render.settings import Address, Duration, Frames, Period, SampleRange
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


def test_names_may_have_capitals() -> None:
    """Every choice of every command, and names of the options whose values are of several forms."""
    for command in COMMANDS:
        for param in cli.get_command(click.Context(cli), command).params:
            if isinstance(param.type, click.Choice):
                for name in param.type.choices:
                    assert param.type(str(name).upper(), param, None) == name
    assert SensorName()("CIE1964", None, None) == "cie1964"
    assert White()("d65", None, None) == "D65" and White()("None", None, None) == "none"
    assert Stops()("Auto", None, None) == LightPaths()("AUTO", None, None) == "auto"
    assert Names(["depth", "albedo"])("Depth,ALBEDO", None, None) == ("depth", "albedo")


@pytest.mark.parametrize(
    "noise, advice", [("30", "write 30% or 0.3"), ("300", None), ("70%", None)]
)
def test_advice_of_noise_is_taken(noise: str, advice: str | None) -> None:
    with pytest.raises(click.BadParameter) as caught:
        Noise()(noise, None, None)
    assert (advice in caught.value.message) if advice else "write" not in caught.value.message
