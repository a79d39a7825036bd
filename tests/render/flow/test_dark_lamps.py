"""Chances of lamps whose light no eye sees: a film or a dye may, so they are chosen too."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from clpt import SpectralImage, spectra
from clpt import transforms as tf
from clpt.records import LIGHT
from clpt.render.flow.scene_to_tables import lower
from clpt.scene import Film, Scene, lights, media, shapes
from clpt.scene import materials as m
from clpt.scene.cameras import Perspective
from clpt.scene.integrators import Path
from clpt.scene.textures import Bitmap, Product

INFRARED = spectra.Tabulated([850, 860, 870], [0, 5, 0])
ULTRAVIOLET = spectra.Tabulated([325, 330, 340, 345], [0, 5, 5, 0])
FILMS = {
    "infrared": (INFRARED, Film(mode="spectral", lambda_min=400.0, lambda_max=900.0, bands=5)),
    "ultraviolet": (ULTRAVIOLET, Film(mode="spectral", lambda_min=320.0, lambda_max=780.0)),
}
BLACK = m.Diffuse(reflectance=0.0)


def _image(light: spectra.Tabulated) -> Bitmap:
    values = np.tile(np.float32(light.values), (2, 2, 1))
    return Bitmap(image=SpectralImage(values, np.array(light.lambdas), emissive=True))


def _glowing(light: Any, **more: Any) -> shapes.Sphere:
    return shapes.Sphere(radius=0.3, **more, emission=lights.Area(radiance=light))


def _lamps(light: spectra.Tabulated) -> dict[str, list[Any]]:
    """A lamp of each kind that a spectrum makes, of much the same strength."""
    mesh = {"vertices": np.eye(3, dtype=np.float32), "faces": np.array([[0, 1, 2]], np.uint32)}
    fog = media.Homogeneous(sigma_a=2.0, emission=light)
    plain = Bitmap(image=np.ones((2, 2, 3), np.float32))
    box = np.ones((2, 2, 2), np.float32)
    grid = media.Grid(density=box, sigma_a=2.0, emission=light)
    return {
        "point": [lights.Point(intensity=light)],
        "spot": [lights.Spot(intensity=light)],
        "directional": [lights.Directional(irradiance=light)],
        "constant": [lights.Constant(radiance=light)],
        "ball": [_glowing(light, material=BLACK)],
        "cube": [shapes.Cube(material=BLACK, emission=lights.Area(radiance=light))],
        "mesh": [shapes.Mesh(**mesh, material=BLACK, emission=lights.Area(radiance=light))],
        "image": [shapes.Mesh(**mesh, emission=lights.Area(radiance=_image(light)))],
        "product": [
            _glowing(Product(first=light, second=_image(spectra.Tabulated([300, 900], [1, 1]))))
        ],
        "projector": [lights.Projector(irradiance=light, image=plain)],
        "goniometric": [lights.Goniometric(intensity=light, image=plain)],
        "fog": [shapes.Sphere(material=m.Null(), interior=fog)],
        "grid": [shapes.Cube(material=m.Null(), interior=grid, to_world=tf.scale(0.5))],
    }


@pytest.mark.parametrize("film", FILMS)
@pytest.mark.parametrize("kind", _lamps(INFRARED))
@pytest.mark.parametrize("others", [1, 40])
def test_lamps_that_no_eye_sees_are_chosen(film: str, kind: str, others: int) -> None:
    """By their power within the film's range, in a table and in a tree; skies have a half."""
    light, seen = FILMS[film]
    own = _lamps(light)[kind]
    dim = [lights.Point(position=(0.1 * i, 0.8, 0.5), intensity=1e-6) for i in range(others)]
    made = lower(
        Scene(
            camera=Perspective(to_world=tf.look_at([0, 0, 4], [0, 0, 0], [0, 1, 0])),
            shapes=[one for one in own if not isinstance(one, lights.Light)],
            lights=[*dim, *(one for one in own if isinstance(one, lights.Light))],
            film=dataclasses.replace(seen, width=4, height=4),
            integrator=Path(light_paths=0),
        )
    )
    power = _chances(made)
    assert np.sort(power)[::-1][: len(power) - others].sum() > 0.4


def _chances(made: Any) -> np.ndarray:
    return np.asarray(made.tables["lights"].view(LIGHT.dtype)["pmf"], float)
