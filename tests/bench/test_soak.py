"""The soak program: it ends, its records tell what it takes, and nothing grows in a few seconds."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from bench import soak


@pytest.mark.slow
def test_a_short_soak(tmp_path: Path) -> None:
    target = tmp_path / "records.jsonl"
    result = CliRunner().invoke(soak.main, ["0.05", "--json", str(target)])
    assert result.exit_code == 0, result.output
    rows = [json.loads(line) for line in target.read_text().splitlines()]
    assert len(rows) == soak.RECORDS + 1
    first, last = rows[0], rows[-1]
    assert last["rounds"] > first["rounds"] - 1
    assert last["unequal"] == 0
    assert (first["used_mib"], first["programs"]) == (last["used_mib"], last["programs"])
