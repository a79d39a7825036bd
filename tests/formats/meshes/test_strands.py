"""Curves in files: Mitsuba's text, ours around it, and pbrt's directive."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import BSpline

import clpt
from clpt.errors import SceneError
from clpt.formats.native.write import save
from clpt.scene.shapes import Curves, Mesh

TEXT = (
    " \n0 0 0 .1\r\n1 0 0 .1 ignored\n2 1 0 .2\n3 1 0 .2\n\n\n"
    "0 0 5 1e-1\n1 0 5 1\n2 1 5 .2\n3 1 5 0\n4 1 6 0"
)
SENSOR = '<sensor type="perspective"/>'


@pytest.fixture
def mitsuba(tmp_path):
    def of(text: str, more: str = "", plugin: str = "bsplinecurve"):
        (tmp_path / "hair.txt").write_text(text)
        shape = f'<shape type="{plugin}"><string name="filename" value="hair.txt"/>{more}</shape>'
        (tmp_path / "s.xml").write_text(f'<scene version="3.0.0">{shape}{SENSOR}</scene>')
        return clpt.load(tmp_path / "s.xml").shapes[0]

    return of


def test_mitsuba(mitsuba):
    curves = mitsuba(TEXT)
    assert isinstance(curves, Curves) and curves.basis == "bspline"
    assert curves.lengths.tolist() == [4, 5]
    np.testing.assert_allclose(curves.points[5], [1, 0, 5, 1])
    assert mitsuba(TEXT, plugin="linearcurve").basis == "linear"
    turn = '<transform name="to_world"><scale value="2"/><translate x="1"/></transform>'
    moved = mitsuba(TEXT, turn)
    np.testing.assert_allclose(moved.points[1], [3, 0, 0, 0.1])
    assert np.array_equal(moved.to_world, np.eye(4))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "has no points"),
        ("0 0 0 1\n1 2 3\n", "hair.txt:2: needs x, y, z and a radius"),
        ("0 0 0 1\n\n1 2 x 3\n", "hair.txt:3: is not all numbers"),
    ],
)
def test_broken_files_say_where(mitsuba, text, message):
    with pytest.raises(SceneError, match=message) as found:
        mitsuba(text)
    assert "s.xml" in str(found.value)


def test_scene_json(tmp_path, mitsuba):
    rng = np.random.default_rng(0)
    points = rng.normal(size=(9, 4)).astype(np.float32)
    shapes = [Curves(points=points, lengths=(4, 5)), Curves(points=points[:4], basis="bezier")]
    scene = mitsuba(TEXT) and clpt.load(tmp_path / "s.xml")
    save(clpt.Scene(camera=scene.camera, shapes=shapes), tmp_path / "scene.json")
    first, second = clpt.load(tmp_path / "scene.json").shapes
    assert np.array_equal(first.points, points) and list(first.lengths) == [4, 5]
    assert second.basis == "bezier" and list(second.lengths) == [4]
    (tmp_path / "scene.json").write_text(
        '{"camera": {"type": "perspective"}, "shapes": [{"type": "curves",'
        ' "points": [[0, 0, 0, 1], [0, 1, 0, 1], [0, 2, 0, 1], [0, 3, 0, 1]], "lengths": [4]}]}'
    )
    (read,) = clpt.load(tmp_path / "scene.json").shapes
    assert np.asarray(read.points).shape == (4, 4) and read.lengths == (4,)


@pytest.fixture
def pbrt(tmp_path):
    def of(*curves: str, before: str = ""):
        body = "\n".join(f'Shape "curve" {curve}' for curve in curves)
        path = tmp_path / "s.pbrt"
        path.write_text(f'Camera "perspective"\nWorldBegin\n{before}\n{body}\n')
        return clpt.load(path)

    return of


P = '"point3 P" [0 0 0  1 0 0  2 1 0  3 1 2] "string type" "cylinder"'


def test_pbrt_curves_are_one(pbrt):
    scene = pbrt(f'{P} "float width" .2', f'{P} "float width0" .2 "float width1" .1')
    (curves,) = scene.shapes
    assert curves.basis == "bezier" and curves.lengths == (4, 4) and not scene.warnings
    np.testing.assert_allclose(curves.points[4:, 3], [0.1, 0.25 / 3, 0.2 / 3, 0.05], rtol=1e-6)
    flat = P.replace("cylinder", "flat")
    assert "shaded as a round one" in pbrt(flat).warnings[0]
    assert not pbrt(flat, before='Material "hair"').warnings
    turned = pbrt(P, before="ReverseOrientation").shapes[0]
    assert not turned.flip_normals


@pytest.mark.parametrize("degree", [2, 3])
def test_pbrt_splines(pbrt, degree):
    rng = np.random.default_rng(degree)
    points = rng.normal(size=(6, 3))
    text = " ".join(f"{x:.6f}" for x in points.ravel())
    given = f'"point3 P" [{text}] "string basis" "bspline" "integer degree" {degree}'
    (curves,) = pbrt(f'{given} "string type" "cylinder"').shapes
    count = 6 - degree
    exact = BSpline(np.arange(-degree, 7.0), points, degree)(np.arange(count + 1.0))
    np.testing.assert_allclose(curves.points[::3, :3], exact, atol=1e-5)
    half = BSpline(np.arange(-degree, 7.0), points, degree)(0.5)
    np.testing.assert_allclose([1, 3, 3, 1] @ curves.points[:4, :3] / 8, half, atol=1e-5)


def test_pbrt_ribbons(pbrt):
    given = P.replace("cylinder", "ribbon")
    (strip,) = pbrt(f'{given} "normal3 N" [0 0 1  0 1 0] "float width" 0.5').shapes
    assert isinstance(strip, Mesh) and len(strip.faces) == 32
    sides = strip.vertices.reshape(-1, 2, 3)
    np.testing.assert_allclose(np.linalg.norm(sides[:, 1] - sides[:, 0], axis=1), 0.5, rtol=1e-5)
    np.testing.assert_allclose(sides[-1].mean(axis=0), [3, 1, 2], atol=1e-6)
    np.testing.assert_allclose(strip.normals[0], [0, 0, 1], atol=1e-6)
    assert np.einsum("ij,ij->i", sides[:, 1] - sides[:, 0], strip.normals[::2]).max() < 1e-6


@pytest.mark.parametrize(
    ("curve", "message"),
    [
        ("", "needs the parameter 'point3 P'"),
        ('"point3 P" [0 0 0 1 1 1 2 2 2]', "needs 4 points and 3 for each piece more, not 3"),
        (f'{P} "integer degree" 4', "must be 2 or 3"),
        (f'{P} "float width" -1', "must be positive"),
        (P.replace("cylinder", "ribbon"), "needs 2 normals 'N', not 0"),
        (P.replace("cylinder", "round"), "none of flat"),
    ],
)
def test_broken_pbrt_curves(pbrt, curve, message):
    with pytest.raises(SceneError, match=message):
        pbrt(curve)
