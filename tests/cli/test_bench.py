"""`clpt bench`: choosing, recording, comparing, refusing; the figures are made up."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from clpt import benchmark
from clpt.__main__ import run
from clpt.benchmark import records
from clpt.benchmark.figures import Figure
from clpt.images import read

Made = Callable[..., list[dict[str, Any]]]


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> Made:
    """made(factor, refused) lets the benchmark tell such figures; what it was asked for."""
    asked: list[dict[str, Any]] = []

    def let(factor: float = 1.0, refused: str = "") -> list[dict[str, Any]]:
        def measure(on: Any, **settings: Any) -> Iterator[Figure]:
            asked.append(settings)
            about = {"layout": "wide8", "count": 9}
            yield Figure("rays", "wide8 primary any", "Mrays/s", (factor,) * 3, "box", about)
            figure = Figure("rays", "wide8 diffuse any", "Mrays/s", (factor, 2 * factor), "box")
            yield figure.refuse(refused)
            more = {"gbytes": 1.0, "of_copy": 0.1, "mode": "rgb"}
            yield Figure("stages", "shade_diffuse", "Mitems/s", (1e3, 2e3), "box", more)
            yield Figure("stages", "mix", "Mitems/s", (), "box", {"note": "no slot had work"})
            stats = {"programs": 5, "build_seconds": 1.0, "memory": 1 << 28}
            yield Figure("start", "cold start", "s", (2.0 / factor,), "box", stats)

        monkeypatch.setattr(benchmark, "measure", measure)
        return asked

    return let


def test_what_is_asked_for(made: Made, capsys: pytest.CaptureFixture) -> None:
    asked = made()
    assert run(["bench"]) == 0
    told = capsys.readouterr().out
    assert "wide8 primary any" in told and "5 programs in 1.00 s, 256 MiB" in told
    assert "no slot had work" in told and "10.0%" in told
    assert asked[-1]["parts"] == list(benchmark.DEFAULT_PARTS)
    stages = [word for name in ("shade_diffuse", "append", "rays") for word in ("--stage", name)]
    assert run(["bench", *stages, "--layout", "wide8", "--scene", "cornell"]) == 0
    assert asked[-1]["parts"] == ["rays", "stages"]
    assert asked[-1]["only"] == ["shade_diffuse", "append"]
    assert (asked[-1]["layouts"], asked[-1]["scene"]) == (("wide8",), "cornell")
    assert run(["bench", "--stage", "shading_hair"]) == 0
    assert (asked[-1]["parts"], asked[-1]["kinds"]) == (["shading"], ["hair"])


def test_record_comparison_and_plot(
    made: Made, tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    file, plot = tmp_path / "records.jsonl", tmp_path / "plot.png"
    made(1.0)
    assert run(["bench", "--json", str(file)]) == 0
    rows = records.read(file)
    assert [row["figure"] for row in rows][:2] == ["wide8 primary any", "wide8 diffuse any"]
    about = {"device", "driver", "opencl", "clpt", "commit", "processor", "compute_units"}
    assert all(about <= row.keys() for row in rows) and len(rows) == 4
    made(0.5)
    compared = ["bench", "--compare", str(file), "--plot", str(plot)]
    assert run([*compared, "--fail-below", "0.4"]) == 0
    assert "0.50" in capsys.readouterr().out
    picture = read(plot)
    assert picture.shape[1] == 960 and picture.std() > 0.05
    assert run([*compared, "--fail-below", "0.6"]) == 3
    assert "below 0.6" in capsys.readouterr().out


def test_a_refused_figure_is_told_and_not_recorded(
    made: Made, tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    made(1.0, "7 rays were not traced")
    file = tmp_path / "records.jsonl"
    assert run(["bench", "--json", str(file)]) == 3
    assert "refused: 7 rays were not traced" in capsys.readouterr().out
    assert "wide8 diffuse any" not in [row["figure"] for row in records.read(file)]


def test_list(capsys: pytest.CaptureFixture) -> None:
    assert run(["bench", "--list"]) == 0
    told = capsys.readouterr().out
    assert all(name in told for name in (*benchmark.PARTS, "cornell", "atrium", "wide8", "shade"))


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--stage", "nothing"], "none of"),
        (["--fail-below", "0.9"], "--compare"),
        (["--compare", "none.jsonl"], "cannot be read"),
        (["--plot", "plot.txt"], ".svg"),
        (["--device", "no such device"], "not there"),
    ],
)
def test_bad_input_is_one_line(
    arguments: list[str], told: str, made: Made, capsys: pytest.CaptureFixture
) -> None:
    made()
    assert run(["bench", *arguments]) == 2
    error = capsys.readouterr().err
    assert told in error and error.count("\n") == 1
