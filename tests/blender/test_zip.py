"""The extension as a file for Blender, with the wheels that are there."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def maker(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Any:
    """packaging/blender_zip.py, without a network and with a store of its own."""
    file = ROOT / "packaging" / "blender_zip.py"
    spec = importlib.util.spec_from_file_location("blender_zip", file)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    monkeypatch.setattr(module, "pip", lambda *_: False)
    monkeypatch.setattr(module, "WHEELS", tmp_path / "wheels")
    return module


def test_without_a_network_it_says_what_is_missing(maker: Any, tmp_path: Path) -> None:
    missing = maker.write(tmp_path / "clpt.zip", ["linux-x64"])
    assert {"clpt", "pyopencl", "pyyaml"} <= set(missing) and "numpy" not in missing
    with zipfile.ZipFile(tmp_path / "clpt.zip") as archive:
        names = set(archive.namelist())
        manifest = archive.read("blender_manifest.toml").decode()
    sources = {file.name for file in (ROOT / "blender").glob("*.py")}
    assert sources | {"LICENSE", "blender_manifest.toml"} == names
    assert "wheels" not in manifest and "[permissions]" in manifest


def test_the_wheels_that_are_there_are_in_the_manifest(maker: Any, tmp_path: Path) -> None:
    folder = tmp_path / "wheels" / "linux-x64"
    folder.mkdir(parents=True)
    for name in ("pyopencl-1-cp311-cp311-manylinux_2_28_x86_64.whl", "numpy-2-py3-none-any.whl"):
        (folder / name).write_bytes(b"")
    missing = maker.write(tmp_path / "clpt.zip", ["linux-x64"])
    assert "pyopencl" not in missing and "clpt" in missing
    with zipfile.ZipFile(tmp_path / "clpt.zip") as archive:
        manifest = archive.read("blender_manifest.toml").decode()
        wheels = [name for name in archive.namelist() if name.endswith(".whl")]
    assert wheels == ["wheels/pyopencl-1-cp311-cp311-manylinux_2_28_x86_64.whl"]
    assert f'  "./{wheels[0]}",' in manifest and manifest.index(wheels[0]) < manifest.index("[perm")


@pytest.mark.slow
def test_blender_finds_the_manifest_valid(maker: Any, tmp_path: Path) -> None:
    """By its own tool, for all systems at once."""
    bpy = pytest.importorskip("bpy")
    tool = Path(bpy.utils.resource_path("LOCAL")) / "scripts/addons_core/bl_pkg/cli/blender_ext.py"
    file = tmp_path / "clpt.zip"
    for platform in maker.TAGS:
        folder = tmp_path / "wheels" / platform
        folder.mkdir(parents=True)
        (folder / f"pyopencl-1-cp311-cp311-{maker.TAGS[platform][0]}.whl").write_bytes(b"")
    maker.write(file, list(maker.TAGS))
    command = [sys.executable, str(tool), "validate", str(file)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0 and "FATAL" not in done.stdout, done.stdout + done.stderr


INSTALL = """
import sys
import bpy
file, picture = sys.argv[1:]
bpy.ops.wm.read_factory_settings()
bpy.ops.extensions.package_install_files(
    filepath=file, repo="user_default", enable_on_install=True)
scene = bpy.context.scene
scene.render.engine, scene.clpt.samples, scene.render.filepath = "CLPT", 1, picture
scene.render.resolution_x, scene.render.resolution_y = 32, 32
bpy.ops.render.render(write_still=True)
"""


@pytest.mark.slow
def test_blender_installs_the_file_and_renders(maker: Any, tmp_path: Path) -> None:
    """By Blender's operator, into an empty folder of a user."""
    pytest.importorskip("bpy")
    maker.write(tmp_path / "clpt.zip", ["linux-x64"])
    picture = tmp_path / "picture.png"
    command = [sys.executable, "-c", INSTALL, str(tmp_path / "clpt.zip"), str(picture)]
    folders = {"BLENDER_USER_RESOURCES": str(tmp_path / "user"), "CLPT_PYTHON": sys.executable}
    done = subprocess.run(
        command, env=os.environ | folders, cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0 and "ERROR" not in done.stdout, done.stdout + done.stderr
    assert picture.is_file()
