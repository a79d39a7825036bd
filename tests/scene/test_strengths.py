"""Lights by watts, lumens and kelvin: what is emitted adds up to what was asked for."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import clpt
from clpt import spectra, transforms
from clpt.errors import SceneError
from clpt.geometry.lamps import plainly_lit
from clpt.render.flow.find import analyse
from clpt.render.records.tables import LoweringCache
from clpt.scene import Scene, cameras, lights, shapes
from clpt.scene.textures import Checkerboard

CAMERA = cameras.Perspective()
SQUARE = transforms.scale(0.5)  # a rectangle of 1 m^2


def emitted(light: lights.Light, to_world: Any = SQUARE) -> spectra.Spectrum:
    """What a light emits, on a rectangle where it is one of a surface."""
    if isinstance(light, lights.ON_SHAPES):
        shape = shapes.Rectangle(to_world=to_world, emission=light)
        light = plainly_lit(Scene(camera=CAMERA, shapes=[shape])).shapes[0].emission  # type: ignore[assignment]
    else:
        light = plainly_lit(Scene(camera=CAMERA, lights=[light])).lights[0]
    assert isinstance(light, lights.Lamp) and light.temperature is None
    return getattr(light, light.emission_name)


@pytest.mark.parametrize(
    ("light", "extent"),
    [
        (lights.Area, math.pi),
        (lambda **more: lights.Area(two_sided=True, **more), 2.0 * math.pi),
        (lights.DirectionalArea, 1.0),
        (lights.Point, 4.0 * math.pi),
        (lights.Goniometric, 4.0 * math.pi),
        (
            lambda **more: lights.Spot(cutoff=30.0, beam_width=30.0, **more),
            2.0 * math.pi * (1.0 - math.cos(math.pi / 6.0)),
        ),
        (lambda **more: lights.Spot(cutoff=180.0, beam_width=180.0, **more), 4.0 * math.pi),
        (  # the cosine falls by a cubic that is symmetric: the cone ends halfway
            lambda **more: lights.Spot(cutoff=60.0, beam_width=0.0, edge="smooth", **more),
            2.0 * math.pi * 0.25,
        ),
        (  # the integral of the 4th power is a fifth
            lambda **more: lights.Spot(cutoff=60.0, beam_width=0.0, edge="quartic", **more),
            2.0 * math.pi * 0.1,
        ),
    ],
)
def test_watts_and_lumens(light: Callable[..., lights.Light], extent: float) -> None:
    watts = spectra.watts(emitted(light(power=60.0)))
    assert extent * watts == pytest.approx(60.0, rel=2e-5)
    lumens = spectra.lumens(emitted(light(lumens=800.0)))
    assert extent * lumens == pytest.approx(800.0, rel=2e-5)


def test_a_watt_of_555_nm_has_683_lumens() -> None:
    line = spectra.Lines([555.0], [1.0])
    assert spectra.watts(line) == pytest.approx(1.0)
    assert spectra.lumens(line) == pytest.approx(683.0, rel=1e-3)
    daylight = spectra.illuminant("D65")
    assert spectra.lumens(daylight) == pytest.approx(683.0 * spectra.CIE_Y_INTEGRAL, rel=1e-6)


def test_the_emission_is_the_colour_then() -> None:
    warm = emitted(lights.Point(temperature=2700.0, lumens=800.0))
    assert isinstance(warm, spectra.Blackbody) and warm.kelvin == 2700.0
    red = emitted(lights.Area(radiance=(1.0, 0.5, 0.25), power=10.0))
    assert red.to_rgb("emission") / red.to_rgb("emission")[0] == pytest.approx([1.0, 0.5, 0.25])
    lamp = emitted(lights.Point(intensity="F11", power=10.0))
    assert isinstance(lamp, spectra.Illuminant) and lamp.name == "F11"


def test_a_temperature_alone_keeps_the_luminance() -> None:
    made = emitted(lights.Directional(temperature=5000.0, irradiance=3.0))
    xyz = spectra.rgb_to_xyz(made.to_rgb("emission"))
    assert xyz[1] == pytest.approx(3.0, rel=1e-3)


def test_power_is_of_the_shape_in_the_world() -> None:
    lamp = lights.Area(power=60.0)
    small, large = (spectra.watts(emitted(lamp, transforms.scale(s))) for s in (0.5, 1.0))
    assert small == pytest.approx(4.0 * large)
    ball = shapes.Sphere(radius=0.5, emission=lamp, to_world=transforms.scale(2.0))
    light = plainly_lit(Scene(camera=CAMERA, shapes=[ball])).shapes[0].emission
    assert isinstance(light, lights.Area)
    assert 4.0 * math.pi**2 * spectra.watts(light.radiance) == pytest.approx(60.0, rel=2e-5)  # type: ignore[arg-type]


def test_lamps_of_groups_are_made_once() -> None:
    group = shapes.Group((shapes.Rectangle(emission=lights.Area(power=1.0)),), "lamps")
    places = [transforms.translate((x, 0.0, 0.0)) for x in (0.0, 3.0)]
    scene = Scene(
        camera=CAMERA, shapes=[shapes.Instance(group=group, to_world=one) for one in places]
    )
    made = plainly_lit(scene).shapes
    assert made[0].group is made[1].group is not group  # type: ignore[attr-defined]
    plain = Scene(camera=CAMERA, shapes=[shapes.Cube()], lights=[lights.Point()])
    assert plainly_lit(plain) is plain


def test_the_analysis_sees_what_shines() -> None:
    dim, bright = (
        analyse(Scene(camera=CAMERA, lights=[lights.Point(power=power)]), LoweringCache()).sources
        for power in (1.0, 10.0)
    )
    first, second = (found.power.sum() for found in (dim, bright))
    assert second == pytest.approx(10.0 * first)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: lights.Point(power=1.0, lumens=2.0), r"^point\.power: .*give either$"),
        (lambda: lights.Point(power=1.0, intensity=2.0), r"^point\.power: .*a number of intensity"),
        (lambda: lights.Point(lumens=-1.0), r"^point\.lumens: must be above 0, not -1\.0$"),
        (
            lambda: lights.Area(power=1.0, radiance=Checkerboard()),
            r"^area\.power: needs radiance to be without a texture$",
        ),
        (
            lambda: lights.Constant(temperature=3000.0, radiance="F11"),
            r"^constant\.temperature: gives a colour, as radiance does",
        ),
        (lambda: lights.Directional(power=1.0), r"directional has no parameter 'power'"),
        (
            lambda: emitted(lights.Area(power=1.0, radiance=(0.0, 1e-9, 0.0)), np.diag([0.0] * 4)),
            "singular",
        ),
        (
            lambda: emitted(lights.Point(power=1.0, intensity=spectra.Constant(0.0))),
            r"^point: its light is 0 whatever its strength$",
        ),
    ],
)
def test_what_is_refused(make: Callable[[], Any], message: str) -> None:
    with pytest.raises(SceneError, match=message):
        make()


def test_scene_files_have_them(tmp_path: Path) -> None:
    text = """{"camera": {"type": "perspective"},
      "lights": [{"type": "spot", "lumens": 500, "temperature": 3000}],
      "shapes": [{"type": "rectangle", "emission": {"type": "area", "power": 20}}]}"""
    (tmp_path / "scene.json").write_text(text)
    made = clpt.load(tmp_path)
    assert made.lights[0].lumens == 500.0 and made.shapes[0].emission.power == 20.0  # type: ignore[attr-defined, union-attr]
    clpt.save(made, tmp_path / "again.json")
    again = clpt.load(tmp_path / "again.json")
    assert again.lights[0].temperature == 3000.0 and again.shapes[0].emission.power == 20.0  # type: ignore[attr-defined, union-attr]


@pytest.mark.parametrize("cls", lights.KINDS, ids=lambda cls: cls.kind)
def test_what_has_a_power_says_its_extent(cls: type[lights.Light]) -> None:
    """Another light's would be wrong, and nobody would see it."""
    if issubclass(cls, lights.PoweredLamp):
        assert "extent" in vars(cls), f"{cls.__name__} needs a method `extent`"
