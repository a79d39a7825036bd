"""Files that lead elsewhere, change, wait for ever, or are too much."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from clpt.errors import SceneError
from clpt.files.budget import Budget
from clpt.formats import load
from tests.formats.usd.conftest import SQUARE, SUN, Loader, usda

pytest.importorskip("pxr")
from pxr import Usd, UsdGeom, Vt

MESH = f'def Mesh "M" {{ {SQUARE} }} {SUN}'


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="the system has no pipes by name")
@pytest.mark.parametrize("arc", ["references", "payload"])
def test_a_pipe_is_no_layer(stage: Loader, tmp_path: Path, arc: str) -> None:
    os.mkfifo(tmp_path / "pipe.usda")
    with pytest.raises(SceneError, match="is a pipe, not a file"):
        stage(f'{MESH} def "A" ({arc} = @pipe.usda@</M>) {{ }}')


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="the system has no pipes by name")
def test_a_pipe_is_no_image(stage: Loader, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "sky.exr")
    scene = stage(MESH + '\n def DomeLight "L" { asset inputs:texture:file = @./sky.exr@ }')
    assert scene.warnings == [
        "/L: image './sky.exr': 'sky.exr' is a pipe, not a file; its fallback stands for it"
    ]


def test_urls_are_no_files(stage: Loader) -> None:
    scene = stage(f'{MESH} def "A" (references = @https://example.org/a.usda@</M>) {{ }}')
    assert scene.warnings == ["/A: Could not open asset @https:/example.org/a.usda@ for reference"]


def test_a_layer_that_changes_is_read_anew(stage: Loader, tmp_path: Path) -> None:
    part = tmp_path / "part.usda"
    part.write_text(usda(f'def Mesh "M" {{ {SQUARE} }}'), encoding="utf-8")
    text = f'def Mesh "A" (references = @part.usda@</M>) {{ }} {SUN}'
    assert stage(text).shapes[0].vertices.max() == 1.0
    part.write_text(usda(f'def Mesh "M" {{ {SQUARE} }}').replace("1, 1", "5, 1"), encoding="utf-8")
    os.utime(part, (1, 1))
    assert stage(text).shapes[0].vertices.max() == 5.0


def test_layers_in_a_circle_end(stage: Loader) -> None:
    scene = stage(f"{MESH} ", "subLayers = [@stage.usda@]")
    assert [shape.name for shape in scene.shapes] == ["M"]


def test_a_point_that_is_not_finite_leaves_its_prim_out(stage: Loader) -> None:
    broken = SQUARE.replace("1, 1", "inf, 1")
    text = "\n".join(f'def Mesh "{name}" {{ {broken} }}' for name in "AB")
    balls = 'def Points "C" { point3f[] points = [(0, 0, nan)] }'
    lines = (
        'def BasisCurves "D" { point3f[] points = [(0, inf, 0), (0, 1, 0)]\n'
        ' int[] curveVertexCounts = [2]\n uniform token type = "linear" }'
    )
    scene = stage(f"{MESH}\n{text}\n{balls}\n{lines}")
    assert [shape.name for shape in scene.shapes] == ["M"]
    (warning,) = scene.warnings
    assert warning.endswith("left out, as a point of it is not finite")
    assert "/A" in warning and "/B" in warning


def test_copies_of_copies_are_refused(stage: Loader) -> None:
    """Ten prototypes, each of ten of the one before: a file of 2 kB would be 10^10 meshes."""
    text = f'class "P0" {{ def Mesh "M" {{ {SQUARE} }} }}\n'
    for i in range(1, 10):
        inner = "\n".join(
            f'def "I{j}" (instanceable = true\n references = </P{i - 1}>) {{ }}' for j in range(10)
        )
        text += f'class "P{i}" {{ {inner} }}\n'
    text += 'def "A" (instanceable = true\n references = </P9>) { }\n'
    with pytest.raises(SceneError, match="parts, most of them repeated"):
        stage(text + SUN)


def test_arrays_that_unpack_are_counted(tmp_path: Path) -> None:
    """Four million zeros are 4 kB of a .usdc."""
    file = tmp_path / "zeros.usdc"
    stage = Usd.Stage.CreateNew(str(file))
    mesh = UsdGeom.Mesh.Define(stage, "/M")
    mesh.CreatePointsAttr([(0.0, 0.0, 0.0)])
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray(4_000_000))
    stage.Save()
    assert file.stat().st_size < 100_000
    with pytest.raises(SceneError, match="of memory, the limit is"):
        load(file, budget=Budget(memory=10_000_000))


@pytest.mark.parametrize("size", [8, 88, 1000, 4000])
def test_a_file_that_is_cut_is_refused(tmp_path: Path, size: int) -> None:
    file = tmp_path / "whole.usdc"
    stage = Usd.Stage.CreateNew(str(file))
    for i in range(50):
        UsdGeom.Sphere.Define(stage, f"/S{i}")
    stage.Save()
    cut = tmp_path / "cut.usdc"
    cut.write_bytes(file.read_bytes()[:size])
    assert size < file.stat().st_size or size == 4000
    if size < file.stat().st_size:
        with pytest.raises(SceneError):
            load(cut)
