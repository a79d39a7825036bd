"""`clpt mie`: a medium for a scene file, a table, a plot, and clear lines for bad input."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from clpt.__main__ import run
from clpt.cli import cli

FEW = ("--radii", "4", "--wavelengths", "450,650,100")


def test_writes_a_medium_and_a_plot(tmp_path: Path) -> None:
    made, plot = tmp_path / "fog.json", tmp_path / "fog.png"
    assert run(["mie", "2", *FEW, "-o", str(made), "--plot", str(plot)]) == 0
    medium = json.loads(made.read_text())
    assert medium["type"] == "homogeneous" and medium["phase"]["type"] == "tabulated"
    assert medium["phase"]["wavelengths"] == [450.0, 550.0, 650.0]
    assert len(medium["phase"]["values"]) == 3
    assert plot.read_bytes()[:4] == b"\x89PNG"


def test_shows_a_table() -> None:
    shown = CliRunner().invoke(cli, ["mie", "0.4", *FEW, "--index", "1.46", "--host", "water"])
    assert shown.exit_code == 0 and len(shown.output.splitlines()) == 4
    assert "sigma_t" in shown.output


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (("-1",), "above 0"),
        (("1", "--share", "0.4"), "do not scatter on their own"),
        (("1", "--wavelengths", "400"), "does not look like"),
        (("1", "--index", "watr"), "did you mean"),
        (("1", "--index", "no.yml"), "no.yml"),
        (("1", *FEW, "-o", "fog.xml"), "written as .json"),
        (("1", "--law", "gamma", "--spread", "0.7"), "below 0.5"),
    ],
)
def test_says_what_is_wrong(given: tuple[str, ...], said: str, capfd) -> None:
    assert run(["mie", "--", given[0]] if len(given) == 1 else ["mie", *given]) == 2
    line = capfd.readouterr().err.strip()
    assert said in line and "\n" not in line
