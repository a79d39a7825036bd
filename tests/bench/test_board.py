"""The page of many results."""

from __future__ import annotations

import json
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from bench import board
from clpt.bench.scenes import PICTURES
from clpt.errors import SceneError

VOID = ("meta",)


def record(device: str, bench: str, figure: str, value: float | None, **more: Any) -> board.Row:
    about = {"date": "2026-11-26", "driver": "1", "processor": "P", "clpt": "0.1", "commit": "a"}
    row = {"device": device, "bench": bench, "figure": figure, "value": value, "unit": "Mrays/s"}
    return {**about, **row, "load": 0.5, "cores": 2, **more}


def drawn(device: str, points: float, wrong: str = "", **more: Any) -> list[board.Row]:
    """Records of all pictures, one of which may be wrong."""
    rows = []
    for name in PICTURES:
        value = None if name == wrong else 1.0
        own: dict[str, Any] = {"scene": name, "size": "quick", "points": points if value else 0.0}
        own |= {"refused": "wrong: 12 % of <tiles>"} if value is None else {}
        rows.append(record(device, "pictures", name, value, **own, **more))
    return rows


class Read(HTMLParser):
    """The rows of tables, by the headings before them; every element is closed."""

    def __init__(self, text: str):
        super().__init__()
        self.open: list[str] = []
        self.tables: dict[str, list[list[str]]] = {}
        self.heading = ""
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: Any) -> None:
        if tag not in VOID:
            self.open.append(tag)
        if tag == "h2":
            self.heading = ""
        elif tag == "tr":
            self.tables.setdefault(self.heading, []).append([])
        elif tag in ("td", "th"):
            self.tables[self.heading][-1].append("")

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if "h2" in self.open:
            self.heading += data
        elif "td" in self.open or "th" in self.open:
            self.tables[self.heading][-1][-1] += data


def test_devices_stand_by_their_points() -> None:
    rows = [*drawn("slow", 100.0), *drawn("bad <b>", 900.0, "glass"), *drawn("fast", 800.0, load=9)]
    read = Read(board.page(board.entries([*rows, *drawn("slow", 200.0, date="2026-11-27")])))
    (ranking,) = (table for heading, table in read.tables.items() if heading.startswith("Points"))
    assert ranking[0] == ["device", "all", *PICTURES]
    assert [row[1] for row in ranking[1:]] == ["800", "200", "no score"]
    assert ranking[1][0].startswith("fast") and ranking[1][0].endswith("did other work too")
    assert ranking[3][0].startswith("bad <b>") and ranking[3].count("wrong") == 1
    assert read.tables["What was wrong"][1][1:] == [
        "pictures of glass: glass",
        "wrong: 12 % of <tiles>",
    ]


def test_subscores_are_the_best_of_one_scene() -> None:
    rows = [
        record("one", "rays", "wide8 primary closest", 2.5, scene="atrium"),
        record("one", "rays", "compact primary closest", 1234.0, scene="atrium"),
        record("one", "rays", "compact primary closest", 9999.0, scene="cornell"),
        record("one", "start", "cold start", 3.0, scene="cornell", unit="s"),
        {"bench": "renders", "scene": "of something else"},
    ]
    read = Read(board.page(board.entries(rows)))
    heads, row = read.tables["What each is good at"]
    found = dict(zip(heads, row, strict=True))
    assert found["coherent rays"] == "1,234 Mrays/s" and found["cold start"] == "3 s"
    assert found["any hit"] == "" and "What was wrong" not in read.tables


def test_files(tmp_path: Path) -> None:
    lines = "".join(json.dumps(row) + "\n" for row in drawn("one", 50.0))
    (tmp_path / "a.jsonl").write_text(lines, encoding="utf-8")
    (tmp_path / "b.md").write_text(f"# First\n```json\n{lines}```\n", encoding="utf-8")
    assert board.read(tmp_path / "a.jsonl") == board.read(tmp_path / "b.md")
    page = tmp_path / "page.html"
    files = [str(tmp_path / name) for name in ("a.jsonl", "b.md")]
    done = CliRunner().invoke(board.main, [*files, "-o", str(page)])
    assert done.exit_code == 0 and done.output.endswith("1 devices and drivers\n")
    (tmp_path / "b.md").write_text("```json\nno json\n```\n", encoding="utf-8")
    with pytest.raises(SceneError, match="no report"):
        board.read(tmp_path / "b.md")
