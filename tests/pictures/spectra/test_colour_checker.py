"""A chart of measured reflectances through the whole renderer, against colour-science.

24 patches lie under parallel light and are seen from above: all noise is that of the wavelengths.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import clpt
from clpt import spectra
from clpt import transforms as tf
from clpt.scene import Film, Scene
from clpt.scene.cameras import Orthographic
from clpt.scene.integrators import Box
from clpt.scene.integrators import Path as PathIntegrator
from clpt.scene.lights import Directional
from clpt.scene.materials import Diffuse
from clpt.scene.shapes import Rectangle
from tests.pictures.builders import UP

colour = pytest.importorskip("colour", reason="the package that we compare with is not installed")

pytestmark = pytest.mark.filterwarnings("ignore:.*Aligning")

CHART = Path(__file__).parents[3] / "scenes" / "color_checker" / "reflectances.csv"
COLUMNS, ROWS, SIDE = 6, 4, 8  # pixels across a patch
SPP = 256
WORST = 0.5  # Delta E 2000


def chart(lamp: str, table: np.ndarray) -> Scene:
    """The patches in the plane z = 0 under `lamp` from the camera's side; white has radiance 1."""
    patches = []
    for i, values in enumerate(table[1:]):
        x, y = 2 * (i % COLUMNS) - COLUMNS + 1, ROWS - 1 - 2 * (i // COLUMNS)
        reflectance = spectra.Tabulated(table[0], values, "hold")
        place = tf.translate([x, y, 0.0])
        patches.append(Rectangle(to_world=place, material=Diffuse(reflectance=reflectance)))
    look = tf.look_at([0, 0, 4], [0, 0, 0], UP) @ tf.scale([COLUMNS, COLUMNS, 1])
    return Scene(
        camera=Orthographic(to_world=look),
        shapes=patches,
        lights=[Directional(irradiance=spectra.illuminant(lamp, np.pi))],
        integrator=PathIntegrator(max_depth=2),
        film=Film(width=COLUMNS * SIDE, height=ROWS * SIDE, filter=Box()),
    )


@pytest.mark.parametrize("lamp", ["A", "D65", "F2"])
def test_rendered_chart(lamp: str) -> None:
    """Delta E 2000 below 0.5 for every patch; 16384 samples of one leave about a tenth of that."""
    table = np.loadtxt(CHART, delimiter=",").T
    image = clpt.render(chart(lamp, table), SPP).astype(np.float64)
    means = image.reshape(ROWS, SIDE, COLUMNS, SIDE, 3).mean(axis=(1, 3)).reshape(-1, 3)
    cmfs = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"]
    light = colour.SDS_ILLUMINANTS[lamp.replace("F", "FL")]

    def xyz_of(values: np.ndarray) -> np.ndarray:
        sd = colour.SpectralDistribution(values, table[0])
        return colour.sd_to_XYZ(sd, cmfs, light, method="Integration") / 100.0

    white = colour.XYZ_to_xy(xyz_of(np.ones_like(table[0])))
    expected = np.array([xyz_of(values) for values in table[1:]])
    labs = [colour.XYZ_to_Lab(xyz, white) for xyz in (spectra.rgb_to_xyz(means), expected)]
    error = colour.delta_E(*labs, method="CIE 2000")
    assert error.max() < WORST, dict(enumerate(error.round(3)))
