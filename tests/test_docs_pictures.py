"""The pictures of kinds in docs/pictures: each kind has one, and the pages show all of them."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from PIL import Image

from clpt.scene import KINDS
from clpt.scene.params import Kind
from docs.pictures import gallery

ROOT = Path(__file__).resolve().parents[1]
SMALL = 13  # pictures of the gallery; may only fall


@pytest.fixture(scope="module")
def table() -> ModuleType:
    """The table of pictures, whose materials take seconds to make: not for each collection."""
    from docs.pictures import table

    return table


def test_every_kind_has_a_picture_and_every_picture_is_of_a_kind(table):
    assert {c: list(made) for c, made in table.PICTURES.items()} == {
        category: [cls.kind for cls in classes] for category, classes in KINDS.items()
    }
    files = {
        f.relative_to(table.FOLDER).with_suffix("").as_posix() for f in table.FOLDER.glob("*/*")
    }
    assert files == set(table.pictures()), "run python -m docs.pictures with the names that differ"


def test_the_picture_of_a_kind_shows_it(table):
    wrong = []
    for name, picture in table.pictures().items():
        category, kind = name.split("/")
        shown = {p.kind for p in _parts(picture.scene()) if isinstance(p, _base(category))}
        image = np.asarray(Image.open(table.file(name)).convert("RGB"), float)
        if kind not in shown:
            wrong.append(f"{name}: its scene has none")
        if not 20.0 < image.mean() < 235.0 or image.std() <= 15.0:
            wrong.append(f"{name}: black, blown out or even")
    asked = "mend docs/pictures, then run python -m docs.pictures with these names"
    assert not wrong, "\n  ".join([asked, *wrong])


def test_captions_and_contact_sheet_are_up_to_date(table):
    from docs.pictures import sheet

    told = {name: picture.caption for name, picture in table.pictures().items()}
    assert json.loads(table.CAPTIONS.read_text("utf-8")) == told, "run python -m docs.pictures none"
    page = (ROOT / "docs/gallery.md").read_text("utf-8")
    assert page == sheet.written(page), "run python -m docs.pictures none"


def test_the_gallery_has_every_scene():
    page = (ROOT / "docs/gallery.md").read_text("utf-8")
    for picture in ROOT.glob("scenes/*/picture*.*"):
        name = picture.relative_to(ROOT).as_posix()
        assert f"](../{name})" in page
        assert f"clpt render scenes/{picture.parent.name}" in page


measured = cache(gallery.pictures)


def test_pictures_of_the_gallery_are_clean():
    pictures = measured()
    page = gallery.PAGE.read_text("utf-8").split("## Every kind")[0]
    assert len(pictures) == page.count("![") > 20
    assert [p for p in pictures if p.grain > 3.0 or p.sparks > 0.0025] == []


def test_pictures_of_the_gallery_are_large():
    """1280 pixels along the longer side; the animation is small."""
    sizes = {p.name: max(p.size) for p in measured()}
    small = sorted(name for name, size in sizes.items() if size < 1280 and name != "turn.webp")
    assert len(small) <= SMALL, f"smaller than 1280: {', '.join(small)}"


def test_grain_and_sparks_are_found(tmp_path):
    """A quarter of the pixels are 4 above an even grey and a quarter below; 1 of 100 is a spark."""
    grey = np.full((40, 40), 100, np.uint8)
    grainy, sparks = grey.copy(), grey.copy()
    grainy[::2, ::2] += 4
    grainy[1::2, 1::2] -= 4
    sparks[5::10, 5::10] = 255
    found = []
    for image in (grey, grainy, sparks):
        Image.fromarray(image).save(tmp_path / "a.png")
        found.append(gallery.measured(tmp_path / "a.png", "a"))
    assert [p.sparks for p in found] == [0.0, 0.0, 0.01]
    assert [p.mean for p in found] == [0.0, pytest.approx(2.0, abs=0.1), pytest.approx(1.55)]


def test_pictures_are_small_and_have_all_their_colours():
    files = [f for f in (ROOT / "docs/pictures").rglob("*") if f.suffix in (".png", ".webp")]
    assert sum(f.stat().st_size for f in files) < 3.5e6
    drawings = {"lens_planar.png"}
    assert {f.name for f in files if Image.open(f).mode == "P"} <= drawings


def _base(category: str) -> type[Kind]:
    """The class that all kinds of a category derive from."""
    return next(cls for cls in KINDS[category][0].__mro__ if cls.__mro__[1] is Kind)


def _parts(thing: Any) -> Iterator[Kind]:
    """All kinds in a scene, at whatever depth."""
    if isinstance(thing, Kind):
        yield thing
    if isinstance(thing, (list, tuple)):
        for entry in thing:
            yield from _parts(entry)
    elif dataclasses.is_dataclass(thing):
        for field in dataclasses.fields(thing):
            yield from _parts(getattr(thing, field.name))
