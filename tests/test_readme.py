"""What README.md says is so: its links lead somewhere, its Python runs, its commands exist."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import numpy as np
import pytest

import clpt
from tests import pages

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / "README.md").read_text("utf-8")


def test_links_lead_somewhere():
    links = re.findall(r"\]\(([^)#]+)\)", README)
    local = [link for link in links if not link.startswith("http")]
    assert len(local) > 10
    assert [link for link in local if not (ROOT / link).exists()] == []


def test_the_scene_from_dataclasses_renders():
    code = next(c for c in pages.blocks(ROOT / "README.md", "python") if "Sphere" in c)
    names: dict = {}
    exec(code, names)
    scene = names["scene"]
    scene.film = dataclasses.replace(scene.film, width=16, height=12)
    image = clpt.render(scene, spp=64)
    assert image.shape == (12, 16, 3) and np.isfinite(image).all()
    assert image[0, 0] == pytest.approx(1.0, abs=0.1)  # the sky; gold in the middle is yellow
    assert image[6, 8, 0] > 1.2 * image[6, 8, 2]


def test_commands_and_options_exist():
    lines = pages.commands(ROOT / "README.md")
    assert len(lines) > 5
    assert [f"{line}: {pages.unknown(line)}" for line in lines if pages.unknown(line)] == []
