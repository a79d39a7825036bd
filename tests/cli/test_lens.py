"""`clpt lens`: figures, a drawing, and clear lines for bad input."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

from clpt.__main__ import run
from clpt.cli import cli


def test_tells_of_a_lens_and_draws_it(tmp_path: Path) -> None:
    plot = tmp_path / "lens.svg"
    given = ["lens", "planar", "--fields", "0,12", "--f-number", "2.8", "--plot", str(plot)]
    shown = CliRunner().invoke(cli, given)
    assert shown.exit_code == 0, shown.output
    assert "US 3,874,771" in shown.output and "50" in shown.output and "2.8" in shown.output
    assert plot.read_text("utf-8").startswith("<?xml")


def test_reads_a_file(tmp_path: Path) -> None:
    path = tmp_path / "one.dat"
    path.write_text("0 1 0 8\n60 4 1.6 20\n-60 1 1.0 20\n")
    shown = CliRunner().invoke(cli, ["lens", str(path), "--wavelengths", "500"])
    assert shown.exit_code == 0 and "one, 3 surfaces" in shown.output


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (("planer",), "did you mean 'planar'"),
        (("no.zmx",), "cannot be read"),
        (("planar", "--fields", "x"), "is no list of 1 to 12 numbers"),
        (("planar", "--f-number", "0.5"), "opens to f/1.4"),
        (("planar", "--plot", "a.xcf"), "a plot is written to"),
    ],
)
def test_says_what_is_wrong(given: tuple[str, ...], said: str, capfd) -> None:
    assert run(["lens", *given]) == 2
    line = capfd.readouterr().err.strip()
    assert said in line and "\n" not in line
