"""`clpt bench`: choosing, recording, comparing, refusing; the figures are made up."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

from clpt import bench as benchmark
from clpt import device
from clpt.__main__ import run
from clpt.bench import apart, pictures, records
from clpt.bench.figures import Figure
from clpt.choices import PICTURE_SIZES
from clpt.errors import DeviceError
from clpt.images import read

Made = Callable[..., list[dict[str, Any]]]
ABOUT = {
    "device": "D", "kind": "gpu", "opencl": "OpenCL 3.0", "driver": "1", "compute_units": 1,
    "global_mem": 1 << 30,
}  # fmt: skip
PHORONIX = Path(__file__).parents[2] / "packaging" / "phoronix" / "clpt"
SCHEMA = Path(benchmark.__file__).parent / "data" / "record.schema.json"


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> Made:
    """made(factor, refused) lets the benchmark tell such figures; what it was asked for."""
    asked: list[dict[str, Any]] = []

    def let(factor: float = 1.0, refused: str = "") -> list[dict[str, Any]]:
        def measure() -> Iterator[Figure]:
            picture = {"size": "quick", "benchmark_version": 1, "points": 7e3, "exact": True}
            yield Figure("pictures", "mist", "Msamples/s", (factor,) * 2, "mist", picture)
            about = {"layout": "wide8", "count": 9}
            yield Figure("rays", "wide8 primary any", "Mrays/s", (factor,) * 3, "box", about)
            figure = Figure("rays", "wide8 diffuse any", "Mrays/s", (factor, 2 * factor), "box")
            yield figure.refuse(refused)
            more = {"gbytes": 1.0, "of_copy": 0.1, "mode": "rgb"}
            yield Figure("stages", "shade_diffuse", "Mitems/s", (1e3, 2e3), "box", more)
            yield Figure("stages", "mix", "Mitems/s", (), "box", {"note": "no slot had work"})
            stats = {"programs": 5, "build_seconds": 1.0, "memory": 1 << 28}
            yield Figure("start", "cold start", "s", (2.0 / factor,), "box", stats)

        def measured(which: Any, label: Any, settings: Any, limit: float) -> Iterator[apart.Told]:
            asked.append(dict(settings))
            if which == "no such device":
                raise DeviceError("device 'no such device' is not there")
            return ((ABOUT, figure) for figure in measure())

        monkeypatch.setattr(apart, "measured", measured)
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
    assert (asked[0]["size"], asked[-1]["size"]) == ("standard", "standard")
    assert run(["bench", "--stage", "shading_hair"]) == 0
    assert (asked[-1]["parts"], asked[-1]["kinds"]) == (["shading"], ["hair"])


def test_record_comparison_and_plot(
    made: Made, tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    file, plot = tmp_path / "records.jsonl", tmp_path / "plot.png"
    made(1.0)
    assert run(["bench", "--json", str(file)]) == 0
    rows = records.read(file)
    names = ["mist", "wide8 primary any", "wide8 diffuse any"]
    assert [row["figure"] for row in rows][:3] == names
    about = {"device", "driver", "opencl", "clpt", "commit", "processor", "compute_units"}
    assert all(about <= row.keys() for row in rows) and len(rows) == 5
    made(0.5)
    compared = ["bench", "--compare", str(file), "--plot", str(plot)]
    assert run([*compared, "--fail-below", "0.4"]) == 0
    assert "0.50" in capsys.readouterr().out
    picture = read(plot)
    assert picture.shape[1] == 960 and picture.std() > 0.05
    assert run([*compared, "--fail-below", "0.6"]) == 3
    assert "below 0.6" in capsys.readouterr().out


def test_a_refused_figure_is_told_and_has_no_value(
    made: Made, tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    """It is not what a later one is compared with."""
    made(1.0, "7 rays were not traced")
    file = tmp_path / "records.jsonl"
    assert run(["bench", "--json", str(file)]) == 3
    assert "refused: 7 rays were not traced" in capsys.readouterr().out
    (row,) = (row for row in records.read(file) if row["figure"] == "wide8 diffuse any")
    assert (row["value"], row["rounds"], row["refused"]) == (None, [], "7 rays were not traced")
    made(1.0)
    assert run(["bench", "--compare", str(file)]) == 0
    assert "diffuse any" not in capsys.readouterr().out.split("compared with")[1]


def test_records_keep_to_the_schema(made: Made, tmp_path: Path) -> None:
    jsonschema = pytest.importorskip("jsonschema")
    validator = jsonschema.Draft202012Validator(json.loads(SCHEMA.read_text(encoding="utf-8")))
    validator.check_schema(validator.schema)
    file = tmp_path / "records.jsonl"
    made(1.0, "wrong hits")
    assert run(["bench", "--json", str(file)]) == 3
    rows = records.read(file)
    assert len(rows) == 5 and not [e for row in rows for e in validator.iter_errors(row)]
    for row, change in ((0, {"benchmark_version": None}), (1, {"value": None}), (2, {"value": 1})):
        assert list(validator.iter_errors({**rows[row], **change}))


def test_pictures_of_another_size_or_version_are_not_compared(
    made: Made, tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    file, other = tmp_path / "records.jsonl", tmp_path / "other.jsonl"
    made(1.0)
    assert run(["bench", "--json", str(file)]) == 0
    text = file.read_text(encoding="utf-8")
    for changed in ('"size": "large"', '"benchmark_version": 2'):
        name = changed.split(":")[0]
        now = re.sub(f"{name}: [^,}}]*", changed, text)
        assert now != text
        other.write_text(now, encoding="utf-8")
        capsys.readouterr()
        assert run(["bench", "--compare", str(other)]) == 0
        compared = capsys.readouterr().out.split("compared with")[1]
        assert "pictures" not in compared and "rays wide8" in compared


def test_every_device_is_a_process_and_a_card_is_written(
    made: Made, tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    card = tmp_path / "card.svg"
    asked = made()
    assert run(["bench", "--device", "all", "--size", "quick", "--card", str(card)]) == 0
    assert len(asked) == len(device.devices()) and asked[0]["size"] == "quick"
    assert "7,000 points; verified, to the bit" in capsys.readouterr().out
    assert "7,000" in card.read_text(encoding="utf-8")


def test_a_device_that_crashes_is_not_the_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture
) -> None:
    """Its row is recorded; there is nothing to compare or to plot, and the next one follows."""
    file, before = tmp_path / "records.jsonl", tmp_path / "before.jsonl"
    good = Figure("rays", "any", "Mrays/s", (1.0,), "box")
    records.append(before, [{**good.record(), **ABOUT}])
    crash = Figure(apart.PART, "measuring", "", ()).refuse("it died (SIGSEGV) after it began")
    each = iter([[({"device": "first"}, crash)], [(ABOUT, good)]])
    monkeypatch.setattr(apart, "measured", lambda *given: iter(next(each)))
    two = [*device.devices()[:1]] * 2
    monkeypatch.setattr(device, "devices", lambda: two)
    plot = ["--plot", str(tmp_path / "plot.svg"), "--card", str(tmp_path / "card.svg")]
    compared = ["--compare", str(before), "--json", str(file)]
    assert run(["bench", "--device", "all", *compared, *plot]) == 3
    assert "refused: it died (SIGSEGV)" in capsys.readouterr().out
    crashed, well = records.read(file)
    assert (crashed["bench"], crashed["device"], crashed["value"]) == ("process", "first", None)
    assert well["value"] == 1.0


def parsed(output: str) -> str:
    """The word that the Phoronix Test Suite takes from the last line with its hint."""
    root = ElementTree.parse(PHORONIX / "results-definition.xml").getroot()
    template, hint = (
        root.findtext(f"ResultsParser/{tag}") for tag in ("OutputTemplate", "LineHint")
    )
    assert template and hint and hint in template
    (*_, line) = (line for line in output.splitlines() if hint in line)
    words = re.sub(r"[()\t]", " ", line).split()
    return words[template.split().index("#_RESULT_#")]


@pytest.mark.parametrize("points", [0.51234, 87.4321, 2003.4, 1234567.0])
def test_the_phoronix_profile_finds_the_number(
    points: float, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture
) -> None:
    """A number that is refused is none, so that the suite calls the run failed."""
    figure = Figure("pictures", pictures.ALL, "points", (points,), "", {"size": "quick"})
    for one, found in ((figure, points), (figure.refuse("no score: mist did not pass"), None)):
        told = [(ABOUT, one)]
        monkeypatch.setattr(apart, "measured", lambda *given, told=told: iter(told))
        assert run(["bench", "--stage", "pictures"]) == (3 if found is None else 0)
        word = parsed(capsys.readouterr().out)
        if found is None:
            assert word == "points"
        else:
            assert float(word) == pytest.approx(found, rel=1e-3)


def test_the_phoronix_profile_asks_for_what_there_is(made: Made) -> None:
    root = ElementTree.parse(PHORONIX / "test-definition.xml").getroot()
    given = (root.findtext("TestSettings/Default/Arguments") or "").split()
    prefix = (root.findtext("TestSettings/Option/ArgumentPrefix") or "").strip()
    sizes = [entry.text or "" for entry in root.iter("Value")]
    asked = made()
    for size in sizes:
        assert run([*given, prefix, size]) == 0
    assert [one["size"] for one in asked] == sizes == list(PICTURE_SIZES)


def test_tables_have_80_columns(made: Made, capsys: pytest.CaptureFixture) -> None:
    made()
    assert run(["bench"]) == 0
    assert max(len(line.rstrip()) for line in capsys.readouterr().out.splitlines()) <= 80


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
        (["--card", "card.gif"], ".svg or .png"),
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
