"""The card of the picture benchmark."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from PIL import Image

from clpt.bench import card, pictures
from clpt.bench.figures import Figure
from clpt.bench.scenes import PICTURES

ABOUT = {"device": "A <very> & long name " * 5, "driver": "1.0", "date": "2026-11-26T09:00:00"}


def figures(wrong: str = "") -> list[Figure]:
    """Figures of all scenes, the first of which may be wrong, and their score."""
    each = []
    for i, name in enumerate(PICTURES):
        more = {
            "size": "quick",
            "benchmark_version": 1,
            "points_each": 1e3,
            "points": 1e3 * (i + 1),
        }
        figure = Figure("pictures", name, "Msamples/s", (i + 1.0,), name, more)
        each.append(figure.refuse(wrong) if i == 0 else figure)
    return [Figure("rays", "any", "Mrays/s", (1.0,)), *each, pictures.score(each, "quick")]


def told(text: str) -> list[str]:
    root = ElementTree.fromstring(text)
    width, height = float(root.attrib["width"]), float(root.attrib["height"])
    for one in root.iter():
        if "x" in one.attrib:
            right = float(one.attrib["x"]) + float(one.attrib.get("width", 0))
            assert 0 <= float(one.attrib["x"]) <= right <= width
            assert 0 <= float(one.attrib["y"]) <= height
    return [one.text or "" for one in root.iter() if one.tag.endswith("text")]


def test_a_card_tells_points_and_what_made_them() -> None:
    words = told(card.card(ABOUT, figures()).svg())
    assert "2,605" in words and "5,000" in words and "clpt bench 1, quick" in words
    assert words[0].startswith("A <very> & long") and len(words[0]) == card.LONGEST
    assert any(word.startswith("5 of 5 pictures verified") for word in words)


def test_a_card_of_a_wrong_picture_has_no_score() -> None:
    words = told(card.card(ABOUT, figures("wrong: 12 % of tiles, first in append: 7")).svg())
    assert "no score" in words and "wrong: 12 % of tiles" in words
    assert any(word.startswith("4 of 5 pictures verified") for word in words)


def test_a_card_without_pictures_is_a_card() -> None:
    assert "no score" in told(card.card(ABOUT, []).svg())


def test_a_card_as_png(tmp_path: Path) -> None:
    """Of twice the size, with a bar of each scene, the last the longest."""
    own = card.card(ABOUT, figures())
    own.write(tmp_path / "card.png")
    own.write(tmp_path / "card.svg")
    assert (tmp_path / "card.svg").read_text("utf-8") == own.svg()
    with Image.open(tmp_path / "card.png") as image:
        assert image.size == (card.SCALE * card.WIDTH, card.SCALE * own.height)
        pixels = np.asarray(image.convert("RGB"))
    blue = (pixels == [int(card.BAR[i : i + 2], 16) for i in (1, 3, 5)]).all(2)
    bars = [one for one in own.drawn if isinstance(one, card.Bar)]
    lengths = [int(blue[card.SCALE * (bar.y + bar.height // 2)].sum()) for bar in bars]
    assert lengths == sorted(lengths) and abs(lengths[-1] - card.SCALE * bars[-1].length) < 3
