"""First light: checks that end in all ways, and the report of them; nothing is measured."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from clpt.__main__ import run
from clpt.bench import PARTS, agreement, apart, first_light, pictures
from clpt.bench.figures import Figure
from clpt.bench.scenes import PICTURES

ABOUT = {"device": "rusticl card", "opencl": "OpenCL 3.0", "driver": "22.3"}
WRONG = "wrong: 31 % of what it writes is wrong (beta), beside another"


@pytest.fixture
def ends(monkeypatch: pytest.MonkeyPatch) -> dict[str, Figure]:
    """How checks end, by a part or a scene; all others are right."""
    given: dict[str, Figure] = {}

    def measured(which: Any, label: Any, settings: Any, limit: float) -> Iterator[apart.Told]:
        (part,) = settings["parts"]
        scene = settings.get("scene", "")
        good = Figure(part, "figure", "s", (1.0,), scene)
        figure = given.get(scene if part == agreement.PART else "", given.get(part, good))
        yield (ABOUT if not figure.name.startswith("no ") else {"device": label}), figure

    monkeypatch.setattr(apart, "measured", measured)
    return given


def ended(why: str) -> Figure:
    return Figure(apart.PART, "measuring", "", ()).refuse(why)


def results() -> list[first_light.Result]:
    return list(first_light.run(None, 60.0, first_light.checks()))


def test_all_is_right(ends: dict[str, Figure]) -> None:
    found, total = results(), len(first_light.checks())
    assert len(found) == total and not any(one.wrong for one in found)
    parts = {part for one in found for part in one.check.settings["parts"]}
    assert parts == PARTS.keys() - {"stages", "shading"}
    scenes = [one.check.settings.get("scene") for one in found]
    assert all(scenes.count(name) >= 2 for name in PICTURES)
    text = first_light.report(found, total)
    assert f"{total} of {total} checks are right; 0 were not tried." in text
    assert "Nothing is wrong." in text and "| bandwidth: figure | 1 | s |" in text
    rows = text.split("```json\n")[1].split("```")[0].splitlines()
    assert [json.loads(row)["device"] for row in rows] == ["rusticl card"] * total


def test_each_fault_says_what_to_report_and_to_whom(ends: dict[str, Figure]) -> None:
    stage = Figure(agreement.PART, "shade_dielectric", "%", (69.0,), "glass").refuse(WRONG)
    ends["glass"] = stage
    ends[pictures.PART] = Figure(pictures.PART, "mist", "", (1.0,)).refuse("wrong: 12 % of tiles")
    ends["build"] = ended("it died (SIGSEGV) after it began: LLVM | ERROR")
    ends["rays"] = Figure("rays", "any", "Mrays/s", (1.0,)).refuse("3 of 64 rays were not traced")
    text = first_light.report(results(), 20)
    assert "| stages of glass | shade_dielectric: wrong: 31 % of what" in text
    assert "| building trees | measuring: it died (SIGSEGV) after it began: LLVM \\| " in text
    told = text.split("to whom\n")[1]
    assert "`clpt kernels glass -o fault --repro shade_dielectric` writes" in told
    assert "`clpt kernels mist -o fault --repro first` writes" in told
    assert "- building trees: the driver crashed, hung or refused." in told
    assert "- rays and trees: send this file to clpt first" in told
    assert told.count(first_light.TRACKERS["rusticl"]) == 2 + len(PICTURES)


def test_it_stops_where_nothing_opens_or_all_hangs(ends: dict[str, Figure]) -> None:
    ends["bandwidth"] = Figure(apart.PART, "no device", "", ()).refuse("no OpenCL device")
    (one,) = results()
    text = first_light.report([one], 20)
    assert "0 of 20 checks are right; 19 were not tried." in text
    ends["bandwidth"] = ends["rays"] = ended("it hangs: nothing came for 60 s after it began")
    assert len(results()) == first_light.MOST_HANGS


def test_drivers_have_their_trackers() -> None:
    pocl = {"device": "Portable Computing Language cpu", "opencl": "OpenCL 3.0 PoCL HSTR"}
    assert "pocl" in first_light.tracker(pocl)
    assert first_light.tracker({"device": "AMD Accelerated gfx1100"}).startswith("AMD: ")
    assert first_light.tracker({"device": "another"}) == first_light.NOBODY


def test_the_command(
    ends: dict[str, Figure], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["bench", "--first-light"]) == 0
    assert (tmp_path / "first-light.md").read_text("utf-8").startswith("# First light of rusticl")
    ends["build"] = ended("it died")
    assert run(["bench", "--first-light", "own.md"]) == 3
    assert "building trees" in capsys.readouterr().out
    assert run(["bench", "--first-light", str(tmp_path)]) == 2
    assert capsys.readouterr().err.count("\n") == 1
