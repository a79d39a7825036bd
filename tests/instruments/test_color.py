"""Color of light that instruments measure, against the tables of CIE 15, CIE 13.3 and TM-30."""

from __future__ import annotations

import numpy as np
import pytest

from clpt.errors import SceneError
from clpt.instruments import color, measure
from clpt.scene import Film, Scene, cameras, lights, materials, shapes
from clpt.scene.integrators import Path
from clpt.spectra import Blackbody, Constant, illuminant
from clpt.spectra.emission import UNIT_LUMINANCE

colour = pytest.importorskip("colour", reason="clpt[measure]")


def lit(spectrum, reflectance=0.5) -> Scene:
    """A point lamp 2 m above a matt floor."""
    floor = shapes.Disk(
        to_world=np.diag([2.0, 2.0, 1.0, 1.0]), material=materials.Diffuse(reflectance=reflectance)
    )
    return Scene(
        camera=cameras.Perspective(), shapes=[floor], film=Film(size=(8, 8)),
        lights=[lights.Point(position=(0, 0, 2), intensity=spectrum)],
        integrator=Path(max_depth=2),
    )  # fmt: skip


AT = {"at": [[0.1, 0.2, 1.0]], "directions": [0, 0, 1], "samples": 4096}


@pytest.mark.parametrize("kelvin", [2000.0, 2856.0, 5000.0, 9000.0])
def test_a_blackbody_has_its_temperature_and_renders_colors(kelvin):
    scene = lit(Blackbody(kelvin))
    measured = measure(scene, "cct", **AT)
    assert abs(measured.values[0] - kelvin) < 4.5 * measured.errors[0] + 2e-3 * kelvin
    assert measured.errors[0] < 0.01 * kelvin and measured.unit == "K"
    if kelvin < 5000.0:  # above it the reference is daylight
        for quantity in ("cri", "rf"):
            measured = measure(scene, quantity, **AT)
            assert measured.values[0] == pytest.approx(100.0, abs=0.3), quantity


@pytest.mark.parametrize(
    ("name", "cct", "cri"), [("F1", 6430, 76), ("F2", 4230, 64), ("F4", 2940, 51)]
)
def test_fluorescent_lamps(name, cct, cri):
    """CCT and Ra: CIE 15:2004, table T.8; Rf: of the lamp's own table."""
    scene = lit(illuminant(name))
    table = colour.SDS_ILLUMINANTS[f"FL{name[1:]}"].copy().align(colour.SpectralShape(380, 780, 5))
    rf = colour.colour_fidelity_index(table)
    for quantity, expected, digits in (("cct", cct, 40), ("cri", cri, 1.5), ("rf", rf, 2.0)):
        measured = measure(scene, quantity, **AT)
        assert measured.values[0] == pytest.approx(expected, abs=digits), quantity


def test_tristimulus_of_an_even_spectrum():
    """White E has X = Y = Z, and Y is the illuminance."""
    scene = lit(Constant(1.0))
    measured = measure(scene, "tristimulus", **{**AT, "samples": 16384})
    lux = measure(scene, "illuminance", **AT)
    assert measured.values.shape == (1, 3) and measured.unit == "lx"
    assert measured.values[0, 1] == pytest.approx(lux.values[0], rel=0.01)
    assert measured.values[0] / measured.values[0, 1] == pytest.approx(1.0, abs=0.02)
    expected = UNIT_LUMINANCE * (1.0 / (1.0 + 0.05)) * (1.0 / 1.05) ** 0.5
    assert lux.values[0] == pytest.approx(expected, rel=0.01)


def test_the_color_of_darkness_is_no_number():
    dark = measure(lit(Constant(1.0)), "cct", [0.0, 0.0, 3.0], [0, 0, 1], samples=64)
    assert np.isnan(dark.values).all() and dark.relative_error == 0.0
    for function in (color.temperature, color.rendering_index, color.fidelity_index):
        black = np.zeros((2, 3, 3 if function is color.temperature else 81))
        assert np.isnan(function(black)).all() and function(black).shape == (2, 3)


def test_green_light_has_no_color_temperature():
    assert np.isnan(color.temperature(np.array([0.1, 1.0, 0.1])))


def test_without_the_package(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "colour", None)
    with pytest.raises(SceneError, match="clpt\\[measure\\]"):
        measure(lit(Constant(1.0)), "rf", **{**AT, "samples": 16})
