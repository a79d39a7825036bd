"""Pictures of thin films: RGB mode's colours beside those of spectral mode, and white furnaces."""

from __future__ import annotations

import numpy as np
import pytest

import clpt
from clpt import spectra
from clpt import transforms as tf
from clpt.scene import Film, Scene, cameras, lights, shapes, textures
from clpt.scene import materials as m
from tests.pictures.builders import furnace
from tests.pictures.support import assert_mean, blocks, exposures

RAMP = textures.Bitmap(
    image=np.linspace(0.0, 1.0, 64, dtype=np.float32).reshape(1, 64), wrap="clamp"
)
SILVER = dict(zip(("eta", "k"), spectra.metal("Ag"), strict=True))


def film(eta, thickness, **more):
    return (m.Layer(eta=eta, thickness=thickness, profile=RAMP, **more),)


MATERIALS = {
    "soap": m.Dielectric(int_ior="air", ext_ior="air", layers=film("water", 800)),
    "oil": m.Dielectric(int_ior="water", ext_ior="air", layers=film(1.5, 700)),
    "silica on silver": m.Conductor(**SILVER, layers=film("fused silica", 500)),
    "tinted film on rough silver": m.RoughConductor(
        **SILVER, alpha_u=0.1, alpha_v=0.1, layers=film(1.7, 400, k=0.1)
    ),
}


def strip(material, mode):
    """A strip along which a film grows thicker, seen at 40 degrees, daylight on its side only."""
    view = tf.look_at([0, -1.6, 2.0], [0, 0, 0], [0, 1, 0]) @ tf.scale([0.9, 0.25, 1.0])
    dark = shapes.Rectangle(
        material=m.Diffuse(reflectance=0.0),
        to_world=tf.translate([0, 0, -0.5]) @ tf.scale(50.0),
    )
    return Scene(
        camera=cameras.Orthographic(to_world=view),
        shapes=[shapes.Rectangle(material=material), dark],
        lights=[lights.Constant(radiance=spectra.RGBIlluminant(1.0, 1.0, 1.0))],
        film=Film(width=32, height=8, mode=mode),
    )


@pytest.mark.slow
@pytest.mark.parametrize("name", MATERIALS)
def test_rgb_is_close_to_spectral(name):
    """Delta E 2000 of the means over 4 x 4 pixels; of films on water, exposed as one would."""
    colour = pytest.importorskip("colour", reason="colour-science is for developers")
    labs = []
    for mode, spp in (("spectral", 512), ("rgb", 128)):
        rgb = np.maximum(blocks(clpt.render(strip(MATERIALS[name], mode), spp=spp)), 0.0)
        rgb = rgb * (8.0 if name in ("soap", "oil") else 1.0)
        labs.append(colour.XYZ_to_Lab(spectra.rgb_to_xyz(rgb)))
    difference = colour.delta_E(*labs, method="CIE 2000")
    # what is left is noise, and of soap colours so deep that Rec. 709 does not have them
    assert difference.mean() < 2.0 and difference.max() < 7.0


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["spectral", "rgb"])
def test_films_that_absorb_nothing_in_a_white_furnace(mode):
    """However often light passes the walls, all of it comes through."""
    for name in ("soap", "oil"):
        scene = furnace(MATERIALS[name], mode, max_depth=-1, rr_depth=1000)
        assert_mean(exposures(scene, 12, 64), np.ones(3), within=0.02)
