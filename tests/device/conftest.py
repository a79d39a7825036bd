"""One opened device for the tests of clpt.device, and a cache folder of their own."""

from __future__ import annotations

import pytest

from clpt.device import Device, choose, disk_cache


@pytest.fixture(scope="session")
def device() -> Device:
    return choose()


@pytest.fixture
def cache_folder(tmp_path, monkeypatch):
    monkeypatch.setattr(disk_cache, "folder", lambda: tmp_path / "cache")
    return tmp_path / "cache"
