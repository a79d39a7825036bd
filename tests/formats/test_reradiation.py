"""Fluorescence in scene files: JSON there and back, the Mitsuba plugin, errors with their place."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from clpt import spectra
from clpt.errors import SceneError
from clpt.formats import load, native
from clpt.scene import Scene
from clpt.scene.cameras import Perspective
from clpt.scene.materials import Fluorescent
from clpt.scene.shapes import Sphere
from clpt.scene.textures import Checkerboard
from clpt.spectra import Constant, Donaldson, Fluorophore, Tabulated

MATRIX = Donaldson((500.0, 510.0), (400.0, 420.0), ((0.0, 0.01), (0.02, 0.005)))
DYE = Fluorophore(Constant(0.4), Tabulated((480.0, 520.0, 600.0), (0.0, 1.0, 0.0)), 0.8)
TABLE = "nm, 400, 420\n500, 0, 0.01\n510, 0.02, 0.005\n"
BFC = ";remark\nr:c: 400 410 420\n400 0.3 0 0\n410 0.1 0.5 0\n420 0.2 0.2 0.6\nEOD\n"
DYE_JSON = {
    "type": "fluorophore",
    "absorption": 0.4,
    "emission": {"values": [[480, 0], [520, 1], [600, 0]]},
    "quantum_yield": 0.8,
}
DYE_XML = (
    '<float name="absorption" value="0.4"/><spectrum name="emission" value="480:0, 520:1, 600:0"/>'
    '<float name="quantum_yield" value="0.8"/>'
)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "m.csv").write_text(TABLE)
    (tmp_path / "m.bfc").write_text(BFC)
    return tmp_path


def from_json(folder: Path, **given) -> Fluorescent:
    shape = {"type": "sphere", "material": {"type": "fluorescent", **given}}
    path = folder / "scene.json"
    path.write_text(json.dumps({"camera": {"type": "perspective"}, "shapes": [shape]}))
    return load(path).shapes[0].material


def from_xml(folder: Path, body: str) -> Fluorescent:
    path = folder / "scene.xml"
    bsdf = f'<bsdf type="fluorescent">{body}</bsdf>'
    sensor = '<sensor type="perspective"/>'
    path.write_text(f'<scene version="3.0.0"><shape type="sphere">{bsdf}</shape>{sensor}</scene>')
    return load(path).shapes[0].material


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        (None, None),
        ({"file": "m.csv"}, MATRIX),
        (DYE_JSON, DYE),
        (
            {"type": "donaldson", "out": MATRIX.out, "into": MATRIX.into, "rows": MATRIX.rows},
            MATRIX,
        ),
    ],
)
def test_json(folder: Path, given, expected) -> None:
    assert from_json(folder, reradiation=given).reradiation == expected


def test_a_bfc_file_has_both_parts(folder: Path) -> None:
    made = from_json(folder, reflectance={"file": "m.bfc"}, reradiation={"file": "m.bfc"})
    diagonal, matrix = spectra.read_bispectral(folder / "m.bfc")
    assert (made.reflectance, made.reradiation) == (diagonal, matrix)
    assert matrix.rows[2][0] == pytest.approx(0.02)
    assert diagonal.values == pytest.approx((0.3, 0.45, 0.5))


@pytest.mark.parametrize("value", [None, MATRIX, DYE])
def test_there_and_back(folder: Path, value) -> None:
    paint = Fluorescent(reflectance=0.3, reradiation=value, amount=0.5)
    native.save(Scene(camera=Perspective(), shapes=[Sphere(material=paint)]), folder / "s.json")
    made = load(folder / "s.json").shapes[0].material
    assert (made.reflectance, made.reradiation, made.amount) == (Constant(0.3), value, 0.5)


@pytest.mark.parametrize(
    "given",
    [
        3,
        {"type": "dye"},
        {"file": "no.csv"},
        {"file": "scene.json"},
        {"type": "fluorophore", "absorption": 0.4},
        {**DYE_JSON, "yield": 1},
        {**DYE_JSON, "quantum_yield": 2},
        {**DYE_JSON, "absorption": 3},
        {"type": "donaldson", "out": [1, 2], "into": [1, 2], "rows": [[1, 2]]},
        {"type": "donaldson", "out": [1, 2], "into": [1, 2], "rows": [[1], [2]]},
    ],
)
def test_errors_have_their_place(folder: Path, given) -> None:
    with pytest.raises(SceneError, match=r"scene\.json"):
        from_json(folder, reradiation=given)


def test_mitsuba(folder: Path) -> None:
    made = from_xml(folder, DYE_XML + '<float name="reflectance" value="0.2"/>')
    assert (made.reradiation, made.reflectance, made.amount) == (DYE, Constant(0.2), 1.0)
    made = from_xml(folder, '<string name="filename" value="m.bfc"/>')
    assert (made.reflectance, made.reradiation) == spectra.read_bispectral(folder / "m.bfc")
    board = '<texture type="checkerboard" name="amount"/>'
    made = from_xml(folder, '<string name="filename" value="m.csv"/>' + board)
    assert made.reradiation == MATRIX and isinstance(made.amount, Checkerboard)


@pytest.mark.parametrize(
    "body",
    [
        "",
        '<string name="filename" value="no.csv"/>',
        '<string name="filename" value="m.csv"/><spectrum name="emission" value="1"/>',
        '<float name="quantum_yield" value="2"/>' + DYE_XML.split('<float name="quantum')[0],
        '<spectrum name="emission" value="1"/><texture type="checkerboard" name="absorption"/>',
    ],
)
def test_what_the_plugin_refuses(folder: Path, body: str) -> None:
    with pytest.raises(SceneError, match=r"scene\.xml"):
        from_xml(folder, body)
