"""Processes with caches of their own."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

from clpt.bench import starting
from clpt.errors import DeviceError

TELL = "import json, os, sys; json.dump(dict(os.environ), open(sys.argv[1], 'w'))"


def test_a_process_has_its_own_caches(tmp_path: Path) -> None:
    told = tmp_path / "told.json"
    seconds, cpu = starting.run([sys.executable, "-c", TELL, str(told)], tmp_path / "caches")
    environment = json.loads(told.read_text())
    for name in starting.CACHES:
        assert Path(environment[name]).is_relative_to(tmp_path) and Path(environment[name]).is_dir()
    assert environment["PATH"]
    assert cpu > 0.0 and seconds > 0.0


def test_a_process_that_fails_tells_its_last_line(tmp_path: Path) -> None:
    words = "print('much'); raise SystemExit('no such thing')"
    with pytest.raises(DeviceError, match="no such thing"):
        starting.run([sys.executable, "-c", words], tmp_path)


@pytest.mark.slow
def test_cold_and_warm() -> None:
    """About 20 s: kernels are compiled."""
    cold, warm = starting.measure("cornell", "rgb", "", 1, "cornell")
    assert cold.refused == warm.refused == ""
    assert cold.more["programs"] == warm.more["programs"] > 1
    assert warm.more["build_seconds"] < cold.more["build_seconds"]
    assert 2**25 < warm.more["memory"] < 2**33


def test_a_black_picture_is_refused() -> None:
    stats = {"mean": 0.0, "ready": 0.5}
    figure = starting._figure("cold start", [(1.0, 1.0)], [stats], "box")
    assert "black" in figure.refused
    stats = {"mean": 0.5, "ready": 2.0}
    figure = starting._figure("cold start", [(1.0, 1.0)], [stats], "box")
    assert "later" in figure.refused
