"""The live notebook runs, its cells one after the other; a stand-in shows its pictures."""

from __future__ import annotations

import ast
import io
import json
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from PIL import Image

import clpt

NOTEBOOK = Path(__file__).resolve().parents[1] / "examples" / "live_notebook.ipynb"
CELLS = ["".join(c["source"]) for c in json.loads(NOTEBOOK.read_text("utf-8"))["cells"]
         if c["cell_type"] == "code"]  # fmt: skip
SIZE = "width=320, height=200"  # for people; the test's is smaller


class Shown:
    """What Jupyter's `display` gives: every picture that it was handed is kept, as it then was."""

    pictures: list[Image.Image] = []  # noqa: RUF012

    def __init__(self, thing: Any, display_id: bool = False):
        self.update(thing)

    def update(self, thing: Any) -> None:
        self.pictures.append(Image.open(io.BytesIO(thing._repr_png_())))


@pytest.fixture
def shown(monkeypatch):
    """A folder of modules in which IPython shows to the test."""
    for name in ("IPython", "IPython.display"):
        monkeypatch.setitem(sys.modules, name, ModuleType(name))
    monkeypatch.setattr(sys.modules["IPython.display"], "display", Shown, raising=False)
    monkeypatch.setattr(Shown, "pictures", [])
    return Shown.pictures


def run(cell: str, names: dict[str, Any]) -> Any:
    """Run a cell; the value of its last line, if that is an expression."""
    *body, last = ast.parse(cell).body
    if isinstance(last, ast.Expr):
        exec(compile(ast.Module(body, []), NOTEBOOK.name, "exec"), names)
        return eval(compile(ast.Expression(last.value), NOTEBOOK.name, "eval"), names)
    exec(cell, names)
    return None


def test_it_shows_a_live_picture(shown, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    assert sum(SIZE in cell for cell in CELLS) == 1
    results = [run(cell.replace(SIZE, "width=96, height=60"), names) for cell in CELLS]
    assert len(shown) >= 16
    assert shown[0].getextrema() == ((0, 0),) * 3  # before the first sample
    assert all(max(p.getextrema())[1] > 200 for p in shown[1:9])
    assert len({p.tobytes() for p in shown}) >= 16  # each shows something new
    assert sum(hasattr(result, "_repr_png_") for result in results) >= 2
    picture = clpt.read_image("live_notebook.png")
    assert 0.02 < picture.mean() < 0.98 and picture.std() > 0.02
    assert "samples in every pixel" in capsys.readouterr().out


def test_it_can_be_read_at_once():
    assert sum(len(cell.splitlines()) for cell in CELLS) < 80


def test_it_is_stored_with_its_pictures():
    cells = json.loads(NOTEBOOK.read_text("utf-8"))["cells"]
    outputs = [output for cell in cells for output in cell.get("outputs", [])]
    kinds = {kind for output in outputs for kind in output.get("data", ())}
    assert len(outputs) >= 4 and {"image/png", "image/jpeg"} <= kinds
    assert not any(output["output_type"] == "error" for output in outputs)
    assert NOTEBOOK.stat().st_size < 1 << 20


def test_the_list_of_examples_names_it():
    assert f"`{NOTEBOOK.name}`" in (NOTEBOOK.parent / "README.md").read_text("utf-8")
