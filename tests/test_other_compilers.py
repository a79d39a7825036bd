"""Every text through clang's OpenCL front end for other devices: what many drivers are made of.

It is stricter than the compiler of the device that tests run on: warnings count, but for those of
code that a scene does not need.
"""

from __future__ import annotations

import dataclasses
import re
import shutil
import subprocess
from collections.abc import Iterable
from pathlib import Path

import pytest

import clpt
from clpt import bvh, device
from clpt.render.codegen import programs
from clpt.render.lowering.scene import Lowered, lower
from clpt.scene import Film, Scene, lights, materials, shapes
from clpt.scene.cameras import Perspective

ROOT = Path(__file__).resolve().parents[1]
TARGETS = {
    "nvptx64-nvidia-nvcl": (),
    "amdgcn-amd-amdhsa": ("-nogpulib",),
    "spir64-unknown-unknown": (),
}
FLAGS = (
    *("-x", "cl", "-cl-std=CL1.2", "-fsyntax-only", "-Wall", "-Werror"),
    *("-Wno-unused-function", "-Wno-unused-variable", "-Wno-unknown-warning-option"),
    "-Wno-bitwise-instead-of-logical",  # masks are integers, in one lane as in eight
)

pytestmark = pytest.mark.skipif(shutil.which("clang") is None, reason="clang is not installed")


def check(folder: Path, target: str, texts: Iterable[str]) -> None:
    """Give each text to clang once."""
    files = []
    for number, text in enumerate(dict.fromkeys(texts)):
        files.append(folder / f"{number}.cl")
        files[-1].write_text(text, encoding="utf-8")
    command = ["clang", "-target", target, *TARGETS[target], *FLAGS, *map(str, files)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600, check=False)
    assert files and done.returncode == 0, done.stderr[:3000]


def texts_of(lowered: Lowered) -> list[str]:
    """All programs of a scene, as a GPU gets them."""
    features, made = lowered.features, []
    for layout in bvh.LAYOUTS:
        if layout == "brute" and features.instances:
            continue
        for queued in (False, True):
            made += programs.sources(features, layout, 1, queued=queued).values()
        made += programs.film_sources(features, layout).values()
        made += programs.loop_sources(features, layout, 1).values()
    return [source.text for source in made]


def builders() -> list[str]:
    """What builds trees, and what rays of applications are traced with."""
    made = []
    for path in sorted((ROOT / "kernels" / "bvh").glob("*.cl")):
        text = path.read_text(encoding="utf-8")
        if not re.search("^kernel ", text, re.MULTILINE) or path.stem == "place":
            continue
        for layout in bvh.TREES if "generated/" in text else ("",):
            virtual = {"generated/instance_traversal.cl": ""}
            if layout:
                all_hits = path.stem == "query_all_hits"
                virtual["generated/layout.cl"] = bvh.traversal_text(layout, all_hits)
            made.append(device.assemble(f"bvh/{path.name}", virtual).text)
    return made


def test_it_finds_what_is_wrong(tmp_path: Path) -> None:
    for wrong in ("float3 v = (float4)(1.0f);", "global int *p = &id;", "missing(id);"):
        with pytest.raises(AssertionError, match="error"):
            text = f"kernel void k(global int *a) {{ int id = get_global_id(0); {wrong} }}"
            check(tmp_path, "nvptx64-nvidia-nvcl", [text])


@pytest.mark.parametrize("target", TARGETS)
def test_builders(tmp_path: Path, target: str) -> None:
    check(tmp_path, target, builders())


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["rgb", "spectral"])
@pytest.mark.parametrize("target", TARGETS)
def test_every_material(tmp_path: Path, target: str, mode: str) -> None:
    row: list = [shapes.Rectangle(material=cls()) for cls in materials.LEAVES]
    row += [shapes.Sphere(emission=lights.Area()), shapes.Disk(material=materials.Mask())]
    film = Film(width=4, height=4, mode=mode)
    scene = Scene(camera=Perspective(), shapes=row, lights=[lights.Constant()], film=film)
    check(tmp_path, target, texts_of(lower(scene)))


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["rgb", "spectral"])
@pytest.mark.parametrize("target", TARGETS)
def test_every_scene(tmp_path: Path, scenes: Path, target: str, mode: str) -> None:
    made: list[str] = []
    for path in sorted(scenes.glob("*.xml")):
        scene = clpt.load(path)
        film = dataclasses.replace(scene.film, mode=mode)
        made += texts_of(lower(dataclasses.replace(scene, film=film)))
    check(tmp_path, target, made)
