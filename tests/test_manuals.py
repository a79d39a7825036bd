"""The programs in the pages on kernels and materials of one's own do what the pages say."""

from __future__ import annotations

import importlib
import re
import sys
from pathlib import Path

import numpy as np
import pytest

import clpt
from tests import pages

DOCS = Path(__file__).resolve().parents[1] / "docs"


@pytest.fixture
def program(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Run a page's Python as a module of a folder of its own; return what it defines."""
    monkeypatch.syspath_prepend(str(tmp_path))

    def run(page: str, **edits: str) -> dict:
        name = f"page_of_{page.removesuffix('.md')}"
        text = "\n".join(pages.blocks(DOCS / page, "python"))
        for old, new in edits.items():
            assert old in text
            text = text.replace(old, new)
        (tmp_path / f"{name}.py").write_text(text, "utf-8")
        monkeypatch.delitem(sys.modules, name, raising=False)
        return vars(importlib.import_module(name))

    return run


def test_a_kernel_of_ones_own(program) -> None:
    made = program("kernel_library.md")
    vertices, found = made["mesh"].vertices, made["openness"]
    ring = np.hypot(vertices[:, 0], vertices[:, 1])
    assert np.all(found[ring > 1.3] > 0.97)  # bulges outward: nothing is in the way
    narrow = found[ring < 0.45]  # 0.8 wide and 1.2 high: the other side takes about half of the sky
    assert np.all((narrow > 0.3) & (narrow < 0.65)) and np.all(found[ring < 0.7] < 0.95)


def test_the_entry_points_are_there() -> None:
    """Every name in the table of parts is defined by the text of its part."""
    page = (DOCS / "kernel_library.md").read_text("utf-8")
    rows = re.findall(r"^\| `([\w/<>]+)` \| (.*) \|$", page, re.MULTILINE)
    assert len(rows) == 11
    for part, names in rows:
        text = clpt.kernel_source(part.replace("<kind>", "hair"), lines=False)
        for name in re.findall(r"`([\w<>]+)`", names):
            name = name.replace("<kind>", "hair").replace("<Kind>", "Hair")
            a_type = rf"\}} {name};|typedef [\w(), ]+ {name};"
            a_function = rf"^\w[\w ]* {name}\(|BINARY\({name}, "
            defined = rf"#define {name}\b|{a_type}|{a_function}"
            assert re.search(defined, text, re.MULTILINE), f"{part}: {name}"
        assert "kernel void" not in text


@pytest.mark.slow
def test_a_material_of_ones_own(program, tmp_path: Path) -> None:
    (source,) = pages.blocks(DOCS / "custom_materials.md", "c")
    (tmp_path / "retroreflector.cl").write_text(source, "utf-8")
    fewer = {"(Retroreflector)\n": '(Retroreflector, modes=("rgb",))\n', "spp=16": "spp=1"}
    fewer["shapes=[sign]"] = "shapes=[sign], film=clpt.scene.Film(width=32, height=32, mode='rgb')"
    image = program("custom_materials.md", **fewer)["image"]
    middle = image[12:20, 12:20].mean(axis=(0, 1))
    # as bright as the sky where it faces the viewer, times its colour
    np.testing.assert_allclose(middle, [0.9, 0.8, 0.1], rtol=0.05)


def test_a_scene_that_changes(program) -> None:
    made = program("device_data.md")
    image, renderer = made["renderer"].image(), made["renderer"]
    assert renderer.samples == 4
    again = clpt.Renderer(renderer.scene, queue=made["queue"])
    again.step(4)
    np.testing.assert_allclose(image, again.image(), atol=1e-5)
