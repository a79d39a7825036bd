"""One opened device for the tests of clpt.device, and a cache folder of their own."""

from __future__ import annotations

import pytest

from clpt.device import Device, choose
from clpt.files import disk_cache


@pytest.fixture(scope="session")
def device() -> Device:
    return choose()


@pytest.fixture
def cache_folder(tmp_path, monkeypatch):
    monkeypatch.setattr(disk_cache, "folder", lambda: tmp_path / "cache")
    return tmp_path / "cache"


@pytest.fixture
def user(tmp_path, monkeypatch):
    """A user's cache folder, and a folder for temporary files beside it."""
    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr(disk_cache.tempfile, "tempdir", str(tmp_path / "temporary"))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "user"))
    for cached in (disk_cache.private_folder, disk_cache.temporary_folder):
        cached.cache_clear()
    yield tmp_path / "user" / "clpt"
    for cached in (disk_cache.private_folder, disk_cache.temporary_folder):
        cached.cache_clear()
