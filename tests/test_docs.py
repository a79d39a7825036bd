"""The pages of documentation: each has its place on the site, and every link leads somewhere."""

from __future__ import annotations

import dataclasses
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import clpt

ROOT = Path(__file__).resolve().parents[1]
PAGES = sorted((ROOT / "docs").glob("*.md"))
LINK = re.compile(r"\]\((?!\w+:)([^)#\s]+)(?:#[^)\s]*)?\)")


def test_every_page_is_in_the_navigation():
    text = (ROOT / "mkdocs.yml").read_text("utf-8")
    places = re.findall(r": (\S+\.md)$", text[text.index("nav:") : text.index("theme:")], re.M)
    assert len(set(places)) == len(places)
    assert {page.name for page in PAGES} <= set(places)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page: Path):
    links = LINK.findall(page.read_text("utf-8"))
    assert [link for link in links if not (page.parent / link).exists()] == []


def test_the_code_of_the_page_on_embedding_runs(monkeypatch: pytest.MonkeyPatch, capsys):
    code = re.findall(r"```python\n(.*?)```", (ROOT / "docs/embedding.md").read_text("utf-8"), re.S)
    load = clpt.load

    def smaller(path: str) -> clpt.Scene:
        scene = load(path)
        scene.film = dataclasses.replace(scene.film, width=32, height=24, mode="rgb")
        return scene

    monkeypatch.chdir(ROOT)
    monkeypatch.setattr(clpt, "load", smaller)
    names: dict = {}
    for block in code:
        exec(block, names)
    assert code[0].count("\n") <= 12  # ten lines that work, and a blank one or two
    assert names["pixels"].shape == (24, 32, 4) and 20 < names["pixels"][..., :3].mean() < 235
    assert 0 < names["rows"].get().min() < np.inf
    assert names["whole"] is False
    assert "must be a whole number above zero" in capsys.readouterr().out


@pytest.mark.slow
def test_the_site_builds_without_a_warning(tmp_path: Path):
    pytest.importorskip("mkdocstrings", reason="the extra clpt[docs] is not installed")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(tmp_path)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    api = (tmp_path / "api" / "clpt.html").read_text("utf-8")
    for name in clpt.__all__:
        assert name.startswith("_") or name in api
