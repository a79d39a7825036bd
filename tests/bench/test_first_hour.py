"""The script for a GPU's first hour: what ends, what is tried again, and its page."""

from __future__ import annotations

import json
import time
from pathlib import Path

import pytest

from bench import first_hour, gpu_page
from bench.first_hour import END, Step, fixed


@pytest.fixture
def steps(monkeypatch: pytest.MonkeyPatch) -> None:
    two = (Step("rays", 5, fixed("a", "b")), Step("tests", 5, first_hour.tests))
    monkeypatch.setattr(first_hour, "STEPS", two)
    monkeypatch.setattr(first_hour, "GPU_TESTS", ("t",))


def end(step: str, part: str, ended: str = "well") -> first_hour.Row:
    return {"step": step, "part": part, "figure": END, "ended": ended}


def names(rows: list[first_hour.Row]) -> list[str]:
    return [f"{step.name} {part}" for step, part in first_hour.order(rows, "", False)]


def test_it_goes_on_where_it_ended(steps: None) -> None:
    """What went wrong comes after what was not tried."""
    assert names([]) == ["rays a", "rays b", "tests t"]
    assert names([end("rays", "a")]) == ["rays b", "tests t"]
    assert names([end("rays", "a", "out of time")]) == ["rays b", "tests t", "rays a"]
    assert names([end("rays", part) for part in "ab"] + [end("tests", "t")]) == []


def test_tests_that_failed_come_first(steps: None) -> None:
    failed = {"step": "tests", "part": "t", "figure": "t", "wrong": ["t/test_x.py::test_y"]}
    assert names([failed, end("rays", "a"), end("rays", "b")]) == ["tests failed before", "tests t"]


def test_stages_that_are_wrong_are_written() -> None:
    rows = [
        {"step": "light", "wrong": ["shadow"], "scene": "cornell"},
        {"step": "light", "wrong": [], "scene": "atrium"},
    ]
    assert first_hour.wrong_stages(rows, "") == ["cornell: shadow"]


def test_a_part_that_fails_tells_why() -> None:
    (row,) = first_hour.run("none", "part", {"device": ""}, 60)
    assert row["figure"] == END and row["ended"] == "KeyError: 'none'"


def test_a_part_that_hangs_is_ended() -> None:
    start = time.monotonic()
    (row,) = first_hour.run("host", "cornell", {"device": ""}, 0.05)
    assert str(row["ended"]).startswith("out of time") and time.monotonic() - start < 5


def test_a_line_that_was_cut_is_passed_over(tmp_path: Path) -> None:
    file = tmp_path / "hour.jsonl"
    assert first_hour.read(file) == []
    file.write_text('{"bench": "first_hour", "part": "a"}\n{"bench": "other"}\n{"bench": "fir')
    assert first_hour.read(file) == [{"bench": "first_hour", "part": "a"}]


def test_the_page_tells_what_is_not_measured(tmp_path: Path) -> None:
    page = tmp_path / "gpus.md"
    page.write_text(f"# GPUs\n\n{gpu_page.HEADING}\n\nold\n\n## Other\n\ntext\n")
    gpu_page.write(page, tmp_path)
    assert page.read_text().count(gpu_page.NOT_YET) == len(gpu_page.ALL)
    figure = gpu_page.ALL[0]
    row = {"device": "GPU", "step": figure.step, "figure": figure.key, "value": 123.0, "part": "x"}
    wrong = {"device": "GPU", "step": "light", "part": "rays", "figure": END, "ended": "it hangs"}
    lines = (json.dumps(line) for line in (row, wrong))
    (tmp_path / "first_hour_1.jsonl").write_text("\n".join(lines))
    gpu_page.write(page, tmp_path)
    text = page.read_text()
    assert text.count(gpu_page.NOT_YET) == len(gpu_page.ALL) - 1
    assert "| 123 |" in text and "- GPU: light, rays: it hangs" in text
    assert text.endswith("## Other\n\ntext\n") and "old" not in text


def test_keys_of_the_page_are_figures_of_steps() -> None:
    """A key that no step writes would never be measured."""
    steps = {step.name: step.parts([], "") for step in first_hour.STEPS}
    for figure in gpu_page.ALL:
        assert any(figure.key.startswith(part) for part in steps[figure.step]), figure
