"""A sweep goes on where it ended, and what it prints is small."""

from __future__ import annotations

import json
import random
from pathlib import Path

import pytest

from clpt import bvh
from clpt.scene import Scene
from clpt.scene.lights import Envmap
from clpt.scene.shapes import Disk
from tests.together import sweep
from tests.together.builds import Way

ENOUGH = 4  # scenes of which each is made small in a second or two


@pytest.mark.long
def test_the_smallest_scene_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """As if disks under images failed."""

    def kinds_of(scene: Scene, way: Way) -> set[str]:
        disk = any(isinstance(shape, Disk) for shape in scene.shapes)
        return {"met"} if disk and any(isinstance(one, Envmap) for one in scene.lights) else set()

    monkeypatch.setattr(sweep, "kinds_of", kinds_of)
    monkeypatch.setattr(sweep, "TRIES", 2000)
    found = 0
    for seed in range(200):
        choices = sweep.Choices([], random.Random(seed))
        if kinds_of(*sweep.drawn(choices)):
            scene, way = sweep.drawn(sweep.Choices(sweep.smallest(choices.made, "met")))
            assert kinds_of(scene, way) and len(scene.shapes) + len(scene.lights) <= 6
            assert way == Way(next(iter(bvh.LAYOUTS)), 1, "stages")
            found += 1
        if found == ENOUGH:
            break
    assert found == ENOUGH


def test_a_sweep_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    output = tmp_path / "sweep.jsonl"
    monkeypatch.setattr(sweep, "BLOCK", 3)
    monkeypatch.setattr(sweep, "CLANG", "clang")
    monkeypatch.setattr(sweep, "errors", lambda texts: [""] * len(texts))
    monkeypatch.setattr(sweep, "attempt", lambda scene, way: ("", [repr(way)]))
    for scenes in ("3", "8"):
        monkeypatch.setattr("sys.argv", ["sweep", "--scenes", scenes, "--output", str(output)])
        assert sweep.main() == 0
    rows = [json.loads(row) for row in output.read_text().splitlines()]
    assert [(row["seed"], row["found"]["built"]) for row in rows] == [(1, 3), (4, 3), (7, 2)]
