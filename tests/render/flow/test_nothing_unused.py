"""What is left out of programs: no more than compilers leave out, and no less than is promised."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import pytest

import clpt
from clpt import device
from clpt.render.flow import flags, programs
from clpt.render.flow.scene_to_tables import lower
from clpt.render.records import Features

ROOT = Path(__file__).resolve().parents[3]


def features_of(name: str, mode: str) -> Features:
    scene = clpt.load(ROOT / name)
    film = dataclasses.replace(scene.film, mode=mode)
    return lower(dataclasses.replace(scene, film=film)).features


def made(features: Features, lanes: int) -> dict[str, device.Source]:
    found = programs.film_sources(features, "wide8")
    for number, own in enumerate(features.passes):
        texts = programs.sources(own, "wide8", lanes, queued=True)
        found |= {f"{number} {name}": text for name, text in texts.items()}
    programs.loop_sources.cache_clear()
    loop = programs.loop_sources(features, "wide8", lanes)
    return found | {f"loop {name}": text for name, text in loop.items()}


@pytest.mark.parametrize("lanes", [1, 8, 16])
@pytest.mark.parametrize("name", ["scenes/cornell_box/scene.json", "scenes/god_rays/scene.json"])
def test_only_compilers_are_asked(name: str, lanes: int) -> None:
    """No condition is left that a text decides by itself: all name what compilers define, or what
    follows from that, such as NATIVE_GATHER."""
    own = {
        *flags.SCENE,
        *flags.MATERIAL,
        "QUEUED",
        "PART",
        "SHADES_BOTH",
        "SHADES_SEVERAL",
        "SPECTRUM_SIZE",
    }
    for program, text in made(features_of(name, "spectral"), lanes).items():
        for condition in re.findall(r"^#(?:el)?if\w* (.*)", text.text, re.MULTILINE):
            assert own.isdisjoint(re.findall(r"\w+", condition)), (program, condition)


@pytest.mark.parametrize("mode", ["rgb", "spectral"])
def test_a_mean_takes_few_lines(mode: str) -> None:
    text = programs.film_sources(features_of("scenes/cornell_box/scene.json", mode), "wide8")
    rows = text["accumulate"].text.splitlines()
    assert len(rows) < 300
    assert not re.search(r"\b(?:load|store)_(?:path|hit|shadow)_", text["accumulate"].text)


def code_rows(text: str) -> list[str]:
    """The rows of a text without comments."""
    comment = re.compile(r"/\*.*?\*/", re.DOTALL)
    return comment.sub(lambda found: "\n" * found[0].count("\n"), text).split("\n")


def test_rows_are_at_their_lines() -> None:
    """A row of a kernel file is the row of the file that a compiler names, but for comments."""
    features = features_of("scenes/god_rays/scene.json", "rgb")
    texts = programs.sources(features, "wide8", 8, queued=False)
    files: dict[str, list[str]] = {}
    compared = 0
    for text in texts.values():
        file, line = "", 0
        for row in code_rows(text.text):
            told = re.match(r'#line (\d+)(?: "([^"]*)")?', row)
            line = int(told[1]) if told else line + 1
            if told:
                file, line = told[2] or file, line - 1
            elif file.startswith("kernels/") and row.strip() and not row.startswith("#"):
                if file not in files:
                    path = device.kernels_folder().parent / file
                    files[file] = code_rows(path.read_text("utf-8"))
                assert row.removeprefix("static ") == files[file][line - 1], (file, line)
                compared += 1
    assert compared > 1000
