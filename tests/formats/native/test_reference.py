"""The reference of scene.json is the one that the dataclasses give."""

from __future__ import annotations

from pathlib import Path

from clpt.formats.native import reference
from clpt.scene import KINDS
from clpt.scene.params import params

ROOT = Path(__file__).resolve().parents[3]


def test_the_page_is_up_to_date():
    assert (ROOT / "docs" / "scene_format.md").read_text("utf-8") == reference.text(), (
        "run python -m clpt.formats.native.reference"
    )


def test_every_kind_and_parameter_is_told():
    page = reference.text()
    for classes in KINDS.values():
        for cls in classes:
            section = page.split(f"### `{cls.kind}`\n")[1].split("\n## ")[0].split("\n### ")[0]
            assert all(f"| `{name}` |" in section for name in params(cls))
