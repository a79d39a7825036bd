"""What spectra become on the film's range of wavelengths, and what is refused or told there."""

from __future__ import annotations

import dataclasses
from typing import Any

import pytest

from clpt.errors import SceneError
from clpt.render.flow.scene_to_tables import lower
from clpt.scene import Film, Scene, cameras, integrators, lights, materials
from clpt.scene.params import params
from clpt.scene.roles import INDEX
from clpt.scene.shapes import Sphere
from clpt.spectra import Cauchy, Tabulated

SKY = [lights.Constant()]


def ball(material: materials.Material, camera: cameras.Camera | None = None, **film: Any) -> Scene:
    film = {"width": 4, "height": 4, **film}
    camera = camera or cameras.Orthographic()
    return Scene(camera=camera, shapes=[Sphere(material=material)], lights=SKY, film=Film(**film))


INDICES = [
    (cls, name)
    for cls in materials.LEAVES
    for name, param in params(cls).items()
    if param.role is INDEX and param.positive
]


@pytest.mark.parametrize(
    ("cls", "name"), INDICES, ids=[f"{cls.kind}.{name}" for cls, name in INDICES]
)
def test_an_index_of_0_within_the_film_is_refused(cls: Any, name: str) -> None:
    """The message names the material, the parameter and the wavelength."""
    zero = Tabulated((400.0, 500.0, 600.0), (1.5, 0.0, 1.5))
    material = cls(name="lens", **{name: zero})
    with pytest.raises(SceneError, match=rf"{cls.kind}\.{name} of 'lens': .* 0 at 500 nm"):
        lower(ball(material))
    lower(ball(material, lambda_min=550.0))


def test_flint_has_no_index_below_its_resonance() -> None:
    flint = materials.Dielectric(int_ior="sf11")
    lower(ball(flint))
    with pytest.raises(SceneError, match=r"dielectric\.int_ior: an index of 0 at 2\d\d nm"):
        lower(ball(flint, lambda_min=220.0, lambda_max=820.0, bands=20))
    with pytest.raises(SceneError, match=r"layer\.eta: an index of 0"):
        layers = (materials.Layer(eta=Cauchy(0.0)),)
        lower(ball(materials.Dielectric(layers=layers), mode="rgb"))
    with pytest.raises(SceneError, match=r"thin_lens\.glass: an index of 0"):
        lens = cameras.ThinLens(glass="sf11")
        lower(ball(materials.Diffuse(), camera=lens, lambda_min=220.0))


def test_a_table_beyond_the_film_is_told() -> None:
    infrared = Tabulated((900.0, 1000.0), (0.5, 0.5))
    scene = ball(materials.Diffuse(reflectance=infrared))
    (warning,) = lower(scene).warnings
    assert warning.startswith("diffuse.reflectance: its table from 900 to 1000 nm has nothing")
    (warning,) = lower(ball(materials.Diffuse(reflectance=infrared), lambda_max=950.0)).warnings
    assert warning.startswith("a lamp's spectrum ends at 830 nm, the film at 950 nm")


def test_a_film_that_sees_nothing_is_told() -> None:
    infrared = {"lambda_min": 900.0, "lambda_max": 2000.0}
    (warning,) = lower(ball(materials.Diffuse(), **infrared)).warnings
    assert "sees nothing from 900 to 2000 nm" in warning
    assert not lower(ball(materials.Diffuse(), **infrared, bands=2)).warnings


def test_a_scene_without_light_is_told_once() -> None:
    dark = dataclasses.replace(ball(materials.Diffuse()), lights=[])
    (warning,) = lower(dark).warnings
    assert warning.startswith("no light in the scene")
    lamp = Sphere(emission=lights.Area())
    whitted = integrators.Whitted()
    for lit in ({"shapes": [lamp]}, {"integrator": whitted}, {"lights": [lights.Sky()]}):
        assert not lower(dataclasses.replace(dark, **lit)).warnings
