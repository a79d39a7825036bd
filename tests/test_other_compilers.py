"""Every text through clang's OpenCL front end for other devices: what many drivers are made of.

It is stricter than the compiler of the device that tests run on: warnings count, but for those of
code that a scene does not need.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Iterable
from pathlib import Path

import pytest

import clpt
from clpt import bvh, device
from clpt.device import source
from clpt.render.flow.scene_to_tables import Lowered, lower
from clpt.scene import Film, Scene, lights, materials, shapes
from clpt.scene.cameras import Perspective
from tests.front_end import CLANG, TARGETS, errors
from tests.together.builds import Way, layouts, texts

ROOT = Path(__file__).resolve().parents[1]
pytestmark = pytest.mark.skipif(CLANG is None, reason="clang is not installed")


def check(target: str, texts: Iterable[str]) -> None:
    """Give each text to clang once."""
    given = dict.fromkeys(texts)
    assert given
    for error in errors(given, target):
        assert not error, error[:3000]


FORMS = ("stages", "queues", "loop", "film")


def texts_of(
    lowered: Lowered, lanes: tuple[int, ...] = (1,), forms: tuple[str, ...] = FORMS
) -> list[str]:
    """All programs of a scene, as a GPU gets them; lanes, forms: others, as CPUs do."""
    made: list[str] = []
    for layout in layouts(lowered.features):
        for number in lanes:
            for form in forms:
                made += texts(lowered.features, Way(layout, number, form))
    return made


def of_every_material(mode: str) -> Lowered:
    """A scene with each material that stands alone."""
    row: list = [shapes.Rectangle(material=cls()) for cls in materials.LEAVES]
    row += [shapes.Sphere(emission=lights.Area()), shapes.Disk(material=materials.Mask())]
    film = Film(width=4, height=4, mode=mode)
    return lower(Scene(camera=Perspective(), shapes=row, lights=[lights.Constant()], film=film))


def builders() -> list[str]:
    """What builds trees, and what rays of applications are traced with."""
    made = []
    for path in sorted((ROOT / "kernels" / "bvh").glob("*.cl")):
        for step, part in source.sections(ROOT / "kernels", f"bvh/{path.name}").items():
            if not re.search("^kernel ", part.text, re.MULTILINE) or path.stem == "place":
                continue
            for layout in bvh.TREES if "generated/" in part.text else ("",):
                virtual = {"generated/instance_traversal.cl": ""}
                if layout:
                    virtual["generated/layout.cl"] = bvh.traversal_text(layout, "all_hits" in step)
                root = f"bvh/{path.name}{step}" if step != "#" else f"bvh/{path.name}"
                made.append(device.assemble(root, virtual).text)
    return made


def test_it_finds_what_is_wrong() -> None:
    for wrong in ("float3 v = (float4)(1.0f);", "global int *p = &id;", "missing(id);"):
        with pytest.raises(AssertionError, match="error"):
            text = f"kernel void k(global int *a) {{ int id = get_global_id(0); {wrong} }}"
            check("nvptx64-nvidia-nvcl", [text])


@pytest.mark.parametrize("target", TARGETS)
def test_builders(target: str) -> None:
    check(target, builders())


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["rgb", "spectral"])
@pytest.mark.parametrize("target", TARGETS)
def test_every_material(target: str, mode: str) -> None:
    check(target, texts_of(of_every_material(mode)))


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["rgb", "spectral"])
@pytest.mark.parametrize("target", TARGETS)
def test_every_scene(scenes: Path, target: str, mode: str) -> None:
    made: list[str] = []
    for path in sorted(scenes.glob("*.xml")):
        scene = clpt.load(path)
        film = dataclasses.replace(scene.film, mode=mode)
        made += texts_of(lower(dataclasses.replace(scene, film=film)))
    check(target, made)
