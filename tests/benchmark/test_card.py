"""The card of the picture benchmark."""

from __future__ import annotations

from xml.etree import ElementTree

from clpt.benchmark import card, pictures
from clpt.benchmark.figures import Figure
from clpt.benchmark.picture_scenes import PICTURES

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
    words = told(card.card(ABOUT, figures()))
    assert "2,605" in words and "5,000" in words and "clpt bench 1, quick" in words
    assert words[0].startswith("A <very> & long") and len(words[0]) == card.LONGEST
    assert any(word.startswith("5 of 5 pictures verified") for word in words)


def test_a_card_of_a_wrong_picture_has_no_score() -> None:
    words = told(card.card(ABOUT, figures("wrong: 12 % of tiles, first in append: 7")))
    assert "no score" in words and "wrong: 12 % of tiles" in words
    assert any(word.startswith("4 of 5 pictures verified") for word in words)


def test_a_card_without_pictures_is_a_card() -> None:
    assert "no score" in told(card.card(ABOUT, []))
