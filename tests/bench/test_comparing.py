"""Records of JSON lines, and figures beside them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from clpt.bench import records
from clpt.bench.figures import Figure
from clpt.errors import SceneError


def figure(*rounds: float, name: str = "wide8 primary closest", unit: str = "Mrays/s") -> Figure:
    return Figure("rays", name, unit, rounds, "atrium")


def test_median_and_spread() -> None:
    one = figure(1.0, 4.0, 2.0, 3.0, 100.0)
    assert one.value == 3.0
    assert one.spread == pytest.approx((4.0 - 2.0) / 2 / 3.0)
    assert figure(5.0).spread == 0.0


def test_record_goes_to_a_file_and_comes_back(tmp_path: Path) -> None:
    path = tmp_path / "new" / "records.jsonl"
    records.append(path, [figure(1.0, 2.0).record() | {"device": "A"}])
    records.append(path, [figure(3.0).record()])
    first, second = records.read(path)
    assert (first["value"], first["rounds"], first["device"]) == (1.5, [1.0, 2.0], "A")
    assert {"date", "commit", "clpt", "processor", "cores"} <= first.keys()
    assert second["figure"] == "wide8 primary closest"


@pytest.mark.parametrize("text", ["{", "[1]\n", '{"bench": 1}\n3'])
def test_files_that_are_no_records(tmp_path: Path, text: str) -> None:
    path = tmp_path / "bad.jsonl"
    path.write_text(text)
    with pytest.raises(SceneError, match=r"bad.jsonl:\d"):
        records.read(path)
    with pytest.raises(SceneError, match="cannot be read"):
        records.read(tmp_path / "none")


def test_ratios_are_above_one_where_it_is_better() -> None:
    fast, start = figure(3.0, 3.0, 3.3), figure(2.0, name="warm start", unit="s")
    before = [figure(2.0).record(), figure(3.0, name="warm start", unit="s").record()]
    quick, sooner = records.against([fast, start], before, "A")
    assert quick.ratio == sooner.ratio == 1.5
    assert quick.noise == pytest.approx(fast.spread)


def test_the_newest_record_of_the_device_is_taken() -> None:
    rows = [
        figure(value).record() | {"device": device}
        for value, device in ((1.0, "A"), (2.0, "A"), (9.0, "B"))
    ]
    rows.append({"bench": "renders", "msamples": 1.0})  # as older parts of bench/ write them
    for device, value in (("A", 2.0), ("B", 9.0), ("C", 9.0)):
        (ratio,) = records.against([figure(18.0)], rows, device)
        assert ratio.then["value"] == value


def test_below_a_limit_only_beyond_noise() -> None:
    before = [json.loads(json.dumps(figure(1.0).record()))]
    (steady,) = records.against([figure(0.94, 0.94, 0.94)], before, "A")
    (noisy,) = records.against([figure(0.8, 0.94, 1.1)], before, "A")
    assert steady.below(0.95) and not steady.below(0.9)
    assert not noisy.below(0.95)


def test_nothing_in_common() -> None:
    with pytest.raises(SceneError, match="none of the figures"):
        records.against([figure(1.0)], [figure(1.0, name="other").record()], "A")
    with pytest.raises(SceneError, match="none of the figures"):
        records.against([figure(1.0).refuse("wrong")], [figure(1.0).record()], "A")
