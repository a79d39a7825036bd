"""IES files: what they say by formulas, a floor lit by one, and broken ones by line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import clpt
from clpt import transforms as tf
from clpt.errors import SceneError
from clpt.formats import ies

VERTICAL = np.arange(0.0, 91.0, 5.0)


def lamp(
    horizontal: tuple[float, ...] = (0.0,),
    head: str = "IESNA:LM-63-2002\n[TEST] a\nTILT=NONE\n",
    multiplier: float = 2.0,
    photometry: int = 1,
) -> str:
    """A file of cos(vertical) (200 + horizontal) cd, halved by the ballast."""
    rows = [np.cos(np.radians(VERTICAL)) * (200.0 + h) for h in horizontal]
    numbers = [
        f"1 1000 {multiplier} {len(VERTICAL)} {len(horizontal)} {photometry} 2 0 0 0",
        "0.5 1 40",
        " ".join(map(str, VERTICAL)),
        ",".join(map(str, horizontal)),
        *(" ".join(f"{v:.6g}" for v in row) for row in rows),
    ]
    return head + "\n".join(numbers) + "\n"


@pytest.fixture
def written(tmp_path: Path):
    def of(text: str) -> Path:
        path = tmp_path / "lamp.ies"
        path.write_text(text)
        return path

    return of


def test_table_and_its_mirrors(written):
    whole = ies.read(written(lamp((0, 90, 180, 270, 360))))
    assert whole.intensity(0.0, 45.0) == pytest.approx(245.0)
    assert whole.intensity(60.0, 270.0) == pytest.approx(235.0, rel=1e-5)
    assert whole.intensity(120.0, 0.0) == 0.0
    half = ies.read(written(lamp((0, 90, 180))))
    assert half.intensity(0.0, 270.0) == pytest.approx(290.0)
    quarter = ies.read(written(lamp((0, 45, 90))))
    np.testing.assert_allclose(quarter.intensity(0.0, [45, 135, 225, 315]), 245.0)
    other = ies.read(written(lamp((90, 180, 270))))
    np.testing.assert_allclose(other.intensity(0.0, [0, 180, 45, 315]), [380, 380, 335, 425])
    tilted = lamp().replace("TILT=NONE", "TILT=INCLUDE\n1\n3\n0 90 180\n1 1 1")
    assert ies.read(written(tilted)).intensity(0.0, 7.0) == pytest.approx(200.0)


def test_a_floor_below_a_lamp(written, tmp_path):
    """Candela over the square of the distance, times the cosine: as native, and as Mitsuba's."""
    path = written(lamp((0, 90, 180, 270, 360)))
    (tmp_path / "a.json").write_text(
        """{"camera": {"type": "orthographic", "to_world": [{"look_at": {"origin": [0, 0, 1],
        "target": [0, 0, 0], "up": [0, 1, 0]}}, {"scale": 2}]}, "film": {"width": 16, "height": 16,
        "mode": "rgb"}, "integrator": {"type": "direct"}, "shapes": [{"type": "rectangle",
        "to_world": [{"scale": 3}], "material": {"type": "diffuse", "reflectance": 0.5}}],
        "lights": [{"type": "goniometric", "file": "lamp.ies", "intensity": [1, 1, 1],
        "to_world": [{"rotate": {"axis": [1, 0, 0], "angle": 90}}, {"translate": [0, 0, 2]}]}]}"""
    )
    scene = clpt.load(tmp_path / "a.json")
    picture = clpt.render(scene, 64)[..., 1]
    edges = 2.0 - (np.arange(16) + 0.5) / 4.0
    x, y = np.meshgrid(edges * np.sign(scene.camera.to_world[0, 0]), edges)
    cos = 2.0 / np.sqrt(x * x + y * y + 4.0)
    around = np.degrees(np.arctan2(x, -y))  # the file's 0 lies at -y, 90 at +x
    candela = ies.read(path).intensity(np.degrees(np.arccos(cos)), around)
    expected = 0.5 / np.pi * candela * cos / (x * x + y * y + 4.0)
    away = np.abs(around) > 20.0  # where 360 meets 0 the file jumps
    np.testing.assert_allclose(picture[away], expected[away], rtol=0.02)
    (tmp_path / "a.xml").write_text(
        '<scene version="3.0.0"><emitter type="ies"><string name="filename" value="lamp.ies"/>'
        '<float name="scale" value="2"/><transform name="to_world"><translate z="2"/></transform>'
        "</emitter></scene>"
    )
    theirs = clpt.load(tmp_path / "a.xml").lights[0]
    np.testing.assert_allclose(theirs.to_world, tf.translate([0, 0, 2]) @ tf.rotate([1, 0, 0], 90))
    np.testing.assert_allclose(theirs.image.image, 2.0 * scene.lights[0].image.image)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("nothing", "line TILT="),
        (lamp(head="TILT=other.ies\n"), ":1: TILT=OTHER.IES is a file of its own"),
        (lamp(photometry=2), "type B"),
        (lamp(photometry=9), "1, 2 or 3"),
        (lamp((0, 100)), "0 to 90, 180 or 360"),
        (lamp((0, 180, 90)), "must rise"),
        (lamp(multiplier=-1.0), "negative"),
        (lamp().replace("0.5 1 40", "0.5 one 40"), ":5: 'one' is no number"),
        (lamp()[:-40], "ends early"),
        (lamp().replace(" 19 1 1 ", " 1e9 1e9 1 "), "from 1"),
        (lamp().replace(" 19 1 1 ", " 4000 4000 1 "), "more than the"),
        (lamp().replace(" 19 1 1 ", " nan 1 1 "), "no number"),
    ],
)
def test_refused(written, text, message):
    with pytest.raises(SceneError, match=message):
        ies.read(written(text))
