"""Angles by which glass and water bend light, at ten wavelengths, through the whole renderer.

A thin beam from the camera goes through a body and must meet a far strip of light that stands where
the formula says, HALF_WIDTH of an angle to either side. How much it meets is Fresnel's share, to
five standard deviations of the number of paths that arrive.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from clpt import spectra
from clpt import transforms as tf
from clpt.scene import Film, Scene
from clpt.scene.cameras import Orthographic
from clpt.scene.integrators import Path
from clpt.scene.lights import Area
from clpt.scene.materials import Dielectric
from clpt.scene.shapes import Mesh, Rectangle, Sphere
from tests.pictures.builders import BLACK, UP
from tests.pictures.support import exposures

LAMBDAS = np.linspace(400.0, 700.0, 10)  # [nm]
RANGE = 0.25  # [nm] to either side
HALF_WIDTH = np.radians(0.03)
BEAM = 5e-5  # half of its width [m]
AWAY = 1e5  # where the strip stands [m]


def arrives(
    body: Any, start: np.ndarray, heading: float, leaving: float, nm: float, spp: int
) -> tuple:
    """(share, samples): of the beam that meets the strip, of how many paths.

    All in the plane of x and z; start: (2,), a point of the beam; heading, leaving: directions of
    the beam, and of the strip from the origin, as angles from +x to +z.
    """

    def at(angle: float, distance: float) -> np.ndarray:
        return np.array([np.cos(angle), 0.0, np.sin(angle)]) * distance

    target = np.array([start[0], 0.0, start[1]])
    view = tf.look_at(target - at(heading, 2.0), target, UP) @ tf.scale([BEAM, BEAM, 1.0])
    strip = tf.look_at(at(leaving, AWAY), [0, 0, 0], UP) @ tf.scale(HALF_WIDTH * AWAY)
    scene = Scene(
        camera=Orthographic(to_world=view),
        shapes=[body, Rectangle(to_world=strip, material=BLACK, emission=Area(radiance="E"))],
        integrator=Path(max_depth=6, rr_depth=100),
        film=Film(width=8, height=8, lambda_min=nm - RANGE, lambda_max=nm + RANGE),
    )
    image = exposures(scene, 1, spp)[0].mean(axis=(0, 1))
    whole = spectra.cie_xyz(np.array([nm]))[0] * 2.0 * RANGE / spectra.CIE_Y_INTEGRAL
    light = spectra.XYZ_TO_REC709 @ whole
    return float(image @ light / (light @ light)), 64 * spp


def assert_arrives(found: tuple[float, int], share: float, what: str) -> None:
    got, samples = found
    # At the ends of the range the observer's curves are steep: 1 % for their slope.
    bound = 5.0 * np.sqrt(share * (1.0 - share) / samples) + 0.01 * share
    assert abs(got - share) < bound, f"{what}: {got:.5f} arrives, not {share:.5f}"


def fresnel(i: float, r: float) -> float:
    """Reflectance at the angles of incidence and refraction, unpolarised."""
    s, p = np.sin(i - r) / np.sin(i + r), np.tan(i - r) / np.tan(i + r)
    return 0.5 * (s**2 + p**2)


PRISMS = [
    ("bk7", 60.0, None),
    *(
        pytest.param(*prism, marks=pytest.mark.slow)
        for prism in (("sf11", 60.0, 75.0), ("diamond", 35.0, None), ("water", 60.0, 40.0))
    ),
]


@pytest.mark.parametrize(("glass", "apex", "incidence"), PRISMS, ids=lambda v: str(v))
def test_prism(glass: str, apex: float, incidence: float | None) -> None:
    """Deviation i + e - A; at its minimum, sin((D + A) / 2) = n sin(A / 2) (Born and Wolf, 4.7.2).

    incidence: in degrees; None: the one of minimum deviation.
    """
    a = np.radians(apex)
    down = np.array([np.sin(a / 2), np.cos(a / 2)])  # along a face from the apex edge, (|x|, -z)
    section = [(0.0, 0.0), (-4 * down[0], -4 * down[1]), (4 * down[0], -4 * down[1])]
    vertices = [(x, y, z) for y in (-1.0, 1.0) for x, z in section]
    faces = [(0, 1, 2), (3, 5, 4), (0, 4, 1), (0, 3, 4), (0, 2, 5), (0, 5, 3), (1, 4, 5), (1, 5, 2)]
    body = Mesh(
        vertices=np.array(vertices, np.float32),
        faces=np.array(faces, np.uint32),
        material=Dielectric(int_ior=glass, ext_ior=1.0),
    )
    for nm, n in zip(LAMBDAS, spectra.glass(glass).sample(LAMBDAS), strict=True):
        i = np.arcsin(n * np.sin(a / 2)) if incidence is None else np.radians(incidence)
        r = np.arcsin(np.sin(i) / n)
        e = np.arcsin(n * np.sin(a - r))
        deviation = i + e - a
        heading = -a / 2 + i
        found = arrives(body, [-down[0], -down[1]], heading, heading - deviation, nm, 64)
        share = (1.0 - fresnel(i, r)) * (1.0 - fresnel(e, a - r))
        assert_arrives(found, share, f"{glass}, {nm:.0f} nm, {np.degrees(deviation):.3f} degrees")


@pytest.mark.parametrize("order", [1, pytest.param(2, marks=pytest.mark.slow)])
@pytest.mark.parametrize("incidence", [None, pytest.param(68.0, marks=pytest.mark.slow)])
def test_rainbow(order: int, incidence: float | None) -> None:
    """A drop's deviation 2 (i - r) + k (pi - 2 r) for k reflections inside.

    incidence: in degrees; None: where the deviation is least, cos^2 i = (n^2 - 1) / (k^2 + 2 k)
    (Descartes 1637; Nussenzveig 1977), which makes the bow.
    """
    body = Sphere(material=Dielectric(int_ior="water", ext_ior=1.0))
    for nm, n in zip(LAMBDAS, spectra.glass("water").sample(LAMBDAS), strict=True):
        least = np.arccos(np.sqrt((n**2 - 1.0) / (order**2 + 2.0 * order)))
        i = least if incidence is None else np.radians(incidence)
        r = np.arcsin(np.sin(i) / n)
        deviation = 2.0 * (i - r) + order * (np.pi - 2.0 * r)
        start = [-np.cos(i), np.sin(i)]
        found = arrives(body, start, 0.0, -deviation, nm, 128 * order**2)
        f = fresnel(i, r)
        share = (1.0 - f) ** 2 * f**order
        assert_arrives(found, share, f"{nm:.0f} nm, {np.degrees(deviation):.3f} degrees")
