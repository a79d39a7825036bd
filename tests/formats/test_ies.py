"""IES files: what they say by formulas, a floor lit by one, and broken ones by line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import clpt
from clpt import spectra
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


@pytest.mark.parametrize(
    ("head", "counts"),
    [
        ("TILT=NONE\n", True),  # of 1986
        ("IESNA91\n[TEST] a\nTILT=NONE\n", True),
        ("IESNA:LM-63-1995\nTILT=NONE\n", False),
        ("IESNA:LM-63-2002\nTILT=NONE\n", False),
        ("IES:LM-63-2019\nTILT=NONE\n", False),  # a number of the kind of file
    ],
)
def test_the_ballast_lamp_factor_is_of_old_editions(written, head, counts):
    text = lamp(head=head).replace("0.5 1 40", "0.5 0.9 40")
    assert ies.read(written(text)).intensity(0.0, 0.0) == pytest.approx(
        200.0 * (0.9 if counts else 1.0)
    )


@pytest.mark.parametrize("step", [15, 45, 90])
def test_angles_around_without_360(written, step):
    """Even steps that end one before 360 go around; others say what is missing."""
    angles = tuple(range(0, 360, step))
    found = ies.read(written(lamp(angles)))
    assert found.horizontal[-1] == 360.0
    last = 200.0 + angles[-1]
    assert found.intensity(0.0, angles[-1]) == pytest.approx(last)
    assert found.intensity(0.0, 360 - step / 2) == pytest.approx((last + 200.0) / 2.0)
    for wrong in ((0, 90, 200, 270), (0, 90, 180, 260), (10, 100, 190, 280)):
        with pytest.raises(SceneError, match="horizontal angles go from"):
            ies.read(written(lamp(wrong)))


def test_a_floor_below_a_lamp(written, tmp_path):
    """Candela over the square of the distance, times the cosine: as native, and as Mitsuba's."""
    path = written(lamp((0, 90, 180, 270, 360)))
    (tmp_path / "a.json").write_text(
        """{"version": 2, "camera": {"type": "orthographic",
        "to_world": [{"look_at": {"origin": [0, 0, 1], "target": [0, 0, 0], "up": [0, 1, 0]}},
        {"scale": 2}]}, "film": {"width": 16, "height": 16, "mode": "rgb"},
        "integrator": {"type": "direct"}, "shapes": [{"type": "rectangle",
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
    expected = 0.5 / np.pi * candela * cos / (x * x + y * y + 4.0) / spectra.UNIT_LUMINANCE
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


def ldt(symmetry: int, planes: tuple[float, ...], rows: np.ndarray, **more: object) -> str:
    """An EULUMDAT file of two sets of lamps, the first of 2000 lm; rows: cd for 1000 lm."""
    lines = ["a maker", "1", str(symmetry), str(len(planes)), "0", str(len(VERTICAL)), "5"]
    lines += ["report", "name", "number", "file", "today", *["0"] * 9, "100", "80"]
    lines += [str(more.get("factor", 0.5)), "0", "2"]
    lines += 2 * ["1", "LED", str(more.get("lumens", 2000)), "3000", "80", "20"]
    lines += ["0.5"] * 10 + [f"{c:g}" for c in planes] + [f"{v:g}" for v in VERTICAL]
    return "\n".join([*lines, *(f"{value:.6g}" for value in rows.ravel())]) + "\n"


@pytest.mark.parametrize(
    ("symmetry", "measured"),
    [
        (0, np.arange(0.0, 360.0, 45.0)), (1, [0.0]), (2, np.arange(0.0, 181.0, 45.0)),
        (3, np.arange(-90.0, 91.0, 45.0)), (4, [0.0, 45.0, 90.0]),
    ],
)  # fmt: skip
def test_eulumdat_of_each_symmetry(tmp_path, symmetry, measured):
    """The intensity is even in what the symmetry mirrors, by a formula at every angle."""

    def formula(vertical, around):
        c = np.radians(around)
        wave = [np.sin(c) + np.cos(c), 0.0 * c, np.cos(c), np.sin(c), np.cos(2.0 * c)][symmetry]
        return np.cos(np.radians(vertical)) * (200.0 + 50.0 * wave)

    planes = tuple(np.arange(0.0, 360.0, 45.0))
    rows = formula(VERTICAL, np.asarray(measured)[:, None])
    path = tmp_path / "lamp.ldt"
    path.write_text(ldt(symmetry, planes, rows))
    at = np.arange(0.0, 361.0, 45.0)[:, None]
    found = ies.read_eulumdat(path).intensity(VERTICAL, at)
    np.testing.assert_allclose(found, formula(VERTICAL, at), rtol=1e-5, atol=1e-3)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("nothing", ":1: ends early, before its kind of symmetry"),
        (ldt(7, (0.0,), np.ones((1, 19))), ":3: the kind of symmetry must be a whole number"),
        (ldt(1, (0.0,), -np.ones((1, 19))), "negative"),
        (ldt(1, (0.0,), np.ones((1, 19)), lumens="many"), ":29: 'many' is no number"),
        (ldt(1, (0.0,), np.ones((1, 19)), lumens=0), ":29: the luminous flux of its lamps is 0"),
        (ldt(1, (0.0,), np.ones((1, 19)))[:-9], "ends early"),
        (ldt(4, (0.0, 90.0), np.ones((1, 19))), "do not cover"),
        (ldt(2, (10.0, 0.0), np.ones((2, 19))), "must rise"),
        (ldt(1, (0.0,), np.ones((1, 19)), factor="nan"), ":24: 'nan' is no number"),
    ],
)
def test_eulumdat_refused(tmp_path, text, message):
    path = tmp_path / "lamp.ldt"
    path.write_text(text)
    with pytest.raises(SceneError, match=message):
        ies.read_eulumdat(path)
