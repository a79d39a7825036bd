"""Of several runtimes of one processor the fastest is taken, by a trial that is made once."""

from __future__ import annotations

import dataclasses

import pytest

from clpt.device import DeviceInfo, choosing
from clpt.files import disk_cache

SECONDS = {"Alpha": 0.003, "Beta": 0.001, "Gamma": 0.002}


@pytest.fixture
def runtimes(monkeypatch, device, cache_folder) -> tuple[DeviceInfo, ...]:
    """Two runtimes of one processor, and one of another; all are the device that is there."""
    names = {"Alpha": "Core 9", "Beta": "pthread-new-Core 9", "Gamma": "Other"}
    there = tuple(
        dataclasses.replace(device.info, index=i, kind="cpu", platform=platform, name=name)
        for i, (platform, name) in enumerate(names.items())
    )
    monkeypatch.setattr(choosing, "devices", lambda: there)
    monkeypatch.setattr(choosing, "_opened", {})
    monkeypatch.delenv("CLPT_DEVICE", raising=False)
    return there


@pytest.fixture
def tried(monkeypatch) -> list[str]:
    """The platforms that were tried, with seconds as in `SECONDS`."""
    platforms: list[str] = []

    def measured(infos: list[DeviceInfo]) -> list[float]:
        platforms.extend(info.platform for info in infos)
        return [SECONDS[info.platform] for info in infos]

    monkeypatch.setattr(choosing, "_measured", measured)
    return platforms


def fails(infos: list[DeviceInfo]) -> list[float]:
    raise RuntimeError("broken")


def test_the_fastest_runtime_is_taken_and_remembered(runtimes, tried):
    for _ in range(2):
        choice = choosing.selection()
        assert choice.info.platform == "Beta"
        assert "3.00 ms by Alpha, 1.00 ms by Beta" in choice.reason
    assert tried == ["Alpha", "Beta"]


@pytest.mark.parametrize(
    ("alpha", "pocl", "taken"),
    [(1.0, 1.05, "Beta"), (1.05, 1.0, "Beta"), (1.0, 1.2, "Alpha"), (1.2, 1.0, "Beta")],
)
def test_of_two_that_are_as_fast_chance_does_not_choose(
    runtimes, tried, monkeypatch, alpha, pocl, taken
):
    """The times of a trial scatter; PoCL is taken unless the other one is faster by a tenth."""
    monkeypatch.setitem(SECONDS, "Alpha", 1e-3 * alpha)
    monkeypatch.setitem(SECONDS, "Beta", 1e-3 * pocl)
    there = [
        dataclasses.replace(info, version="OpenCL 3.0 PoCL 7" if info.index == 1 else "OpenCL 3.0")
        for info in runtimes
    ]
    monkeypatch.setattr(choosing, "devices", lambda: tuple(there))
    assert choosing.selection().info.platform == taken


def test_a_new_driver_is_tried(runtimes, tried, monkeypatch):
    choosing.selection()
    newer = tuple(dataclasses.replace(info, driver="newer") for info in runtimes)
    monkeypatch.setattr(choosing, "devices", lambda: newer)
    choosing.selection()
    assert len(tried) == 4


@pytest.mark.parametrize("case", ["named", "environment", "one processor each", "a GPU"])
def test_without_a_question_there_is_no_trial(runtimes, tried, monkeypatch, case):
    if case == "environment":
        monkeypatch.setenv("CLPT_DEVICE", "alpha")
    elif case == "one processor each":
        monkeypatch.setattr(choosing, "devices", lambda: runtimes[1:])
    elif case == "a GPU":
        gpu = dataclasses.replace(runtimes[0], kind="gpu", index=3)
        monkeypatch.setattr(choosing, "devices", lambda: (*runtimes, gpu))
    choice = choosing.selection("alpha" if case == "named" else None)
    assert choice.info.platform == ("Beta" if case == "one processor each" else "Alpha")
    assert not tried


def test_a_trial_that_failed_leaves_the_first_and_is_not_made_again(runtimes, monkeypatch):
    monkeypatch.setattr(choosing, "_measured", fails)
    assert choosing.selection().info.platform == "Alpha"
    monkeypatch.setattr(choosing, "_measured", lambda infos: pytest.fail("tried again"))
    assert choosing.selection().info.platform == "Alpha"


def test_without_a_cache_there_is_no_trial(runtimes, tried, monkeypatch):
    monkeypatch.setattr(disk_cache, "store", lambda *content: None)
    assert choosing.selection().info.platform == "Alpha"
    assert not tried


def test_a_trial_takes_time(device):
    for seconds in choosing.measure_speed([(device.queue, device.lanes), (device.queue, 8)]):
        assert 0.0 < seconds < 60.0


def test_a_trial_that_is_interrupted_is_made_again(cache_folder):
    def interrupted() -> list[float]:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        choosing.remembered(["a driver"], interrupted)
    assert choosing.remembered(["a driver"], lambda: [1.0, 2.0]) == [1.0, 2.0]
    assert choosing.remembered(["a driver"], interrupted) == [1.0, 2.0]
