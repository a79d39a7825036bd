"""How a film's sensor, bands, white and space stand in scene.json and in Mitsuba's XML."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from clpt.errors import SceneError
from clpt.formats import load, native
from clpt.formats.native import schema
from clpt.scene import Film, Scene
from clpt.scene.cameras import Perspective
from clpt.spectra import Blackbody, Constant, Sensor, Tabulated

RAMP = Tabulated((400.0, 700.0), (0.25, 1.0))
CAMERA = Sensor((RAMP, Constant(0.5), Blackbody(3000.0, 1e-3)), np.eye(3))
TEXT = "nm r g b\n400 0.25 0 1\n550 0 1 0\n700 1 0 0\n"


def film(folder: Path, **given: object) -> Film:
    """The film of a scene.json with these entries."""
    (folder / "camera.csv").write_text(TEXT)
    document = {"camera": {"type": "perspective"}, "film": given}
    (folder / "scene.json").write_text(json.dumps(document))
    return load(folder / "scene.json").film


@pytest.mark.parametrize(
    "made",
    [
        Film(),
        Film(sensor="cie1964", bands=31, output_space="acescg", wavelengths="scene"),
        Film(sensor=CAMERA, white_balance=3200.0),
        Film(sensor=Sensor((RAMP, RAMP, RAMP)), white_balance=(0.31, 0.33)),
        Film(white_balance="D65"),
        Film(width=40, height=30, crop=(8, 4, 24, 16)),
    ],
    ids=["default", "names", "camera", "fitted", "white", "crop"],
)
def test_saved_and_loaded(made: Film, tmp_path: Path) -> None:
    native.save(Scene(camera=Perspective(), film=made), tmp_path / "scene.json")
    found = load(tmp_path).film
    for name in ("sensor", "bands", "white_balance", "output_space", "wavelengths"):
        assert getattr(found, name) == getattr(made, name), name
    jsonschema = pytest.importorskip("jsonschema")
    text = (tmp_path / "scene.json").read_text()
    assert not list(jsonschema.Draft202012Validator(schema.schema()).iter_errors(json.loads(text)))


def test_a_camera_from_a_file(tmp_path: Path) -> None:
    found = film(tmp_path, sensor={"file": "camera.csv"}).sensor
    np.testing.assert_allclose(found.sample([550.0])[0], [0, 1, 0])
    assert found.matrix is None
    rows = [[1, 0, 0], [0, 2, 0], [0, 0, 3]]
    given = film(tmp_path, sensor={"file": "camera.csv", "matrix": rows}).sensor
    assert np.array_equal(given.to_xyz, np.diag([1.0, 2.0, 3.0]))


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"sensor": "nikon"}, r"film\.sensor.*cie1931"),
        ({"sensor": 5}, r"film\.sensor: must be"),
        ({"sensor": {}}, r"film\.sensor.*either"),
        ({"sensor": {"file": "no.csv"}}, r"film\.sensor\.file.*no\.csv"),
        ({"sensor": {"curves": [1, 2]}}, r"film\.sensor\.curves.*3 entries"),
        ({"sensor": {"curve": 1}}, r"film\.sensor\.curve"),
        ({"sensor": {"file": "camera.csv", "matrix": [[1]]}}, r"film\.sensor\.matrix"),
        ({"white_balance": "D66"}, r"film\.white_balance.*D66"),
        ({"white_balance": [0.3]}, r"film\.white_balance"),
        ({"white_balance": True}, r"film\.white_balance"),
        ({"bands": 1.5}, r"film\.bands"),
        ({"bands": 100000}, r"film\.bands"),
        ({"output_space": "srgb"}, r"film\.output_space.*rec709"),
    ],
)
def test_bad_films_tell_where(given: dict, words: str, tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=words) as caught:
        film(tmp_path, **given)
    assert "\n" not in str(caught.value) and "scene.json:1" in str(caught.value)


def test_our_own_film_in_mitsubas_xml(tmp_path: Path) -> None:
    (tmp_path / "camera.csv").write_text(TEXT)

    def of(body: str, kind: str = "clptfilm") -> Film:
        sensor = f'<sensor type="perspective"><film type="{kind}">{body}</film></sensor>'
        (tmp_path / "scene.xml").write_text(f'<scene version="3.0.0">{sensor}</scene>')
        return load(tmp_path / "scene.xml").film

    assert of("").output_space == "rec709" and of("").width == 768
    made = of(
        '<string name="sensor" value="cie1964"/><integer name="bands" value="9"/>'
        '<float name="white_balance" value="3200"/><string name="output_space" value="xyz"/>'
        '<float name="lambda_min" value="300"/><float name="lambda_max" value="900"/>'
    )
    assert (made.sensor, made.bands, made.white_balance) == ("cie1964", 9, 3200.0)
    assert (made.output_space, made.lambda_min, made.lambda_max) == ("xyz", 300.0, 900.0)
    made = of(
        '<string name="sensor_filename" value="camera.csv"/><string name="mode" value="rgb"/>'
        '<string name="white_balance" value="A"/>'
    )
    assert isinstance(made.sensor, Sensor) and (made.white_balance, made.mode) == ("A", "rgb")
    with pytest.raises(SceneError, match="output_space"):
        of('<string name="output_space" value="xyz"/>', "hdrfilm")
    with pytest.raises(SceneError, match="D66"):
        of('<string name="white_balance" value="D66"/>')
